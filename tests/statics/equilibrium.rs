//! Equilibria against theory and independent continuum values, on all meshes, and critical loads (Euler, Greenhill, lateral
//! buckling).

use rodfit::numerics::banded::{BandMatrix, Ldlt};
use rodfit::numerics::tangent::{Factors, Tangent};
use rodfit::rod::Rod;
use rodfit::scene::{
    Clamp, Dimension, Discretization, End, Material, Motion, Point, PointForce, Scene, Section,
    Shape, Support,
};
use rodfit::{Derivatives, Equilibrium};
use std::f64::consts::PI;

use crate::bifurcations::critical;
use crate::common::{at_tip, cantilever, helix_with, rest, unit_rod};

/// Sag of the heavy cantilever over its length; continuum 0.29061133785.
#[test]
fn heavy_cantilever_sag_agrees_with_the_continuum() {
    for (segments, clamp, sag) in [
        (50, Clamp::MidEdge, 0.29052485),
        (50, Clamp::Nodes, 0.28014829),
        (200, Clamp::MidEdge, 0.29060601),
    ] {
        let mut scene = cantilever();
        (scene.rod.segments, scene.supports.clamp) = (Some(segments), clamp);
        let found = rest(&scene);
        println!("{segments} segments, {clamp:?}: {:.8}", -found.tip[1] / 0.5);
        // Independent values of the discrete problem and its limit, to eight digits.
        assert!((-found.tip[1] / 0.5 - sag).abs() < 1e-8, "{found}");
        assert_eq!((found.stable, found.stable_in_plane), (None, Some(true)));
    }
}

/// From limp to stiff, from thick to hair-thin, from 3 nodes to 10,001, all from the straight state.
#[test]
fn cantilevers_of_all_stiffnesses_and_meshes_reach_equilibrium() {
    let mut most = 0;
    for modulus in [1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12] {
        for slenderness in [0.1, 1e-2, 1e-3, 1e-4, 1e-5] {
            let mut sags = Vec::new();
            for segments in [2, 5, 50, 500, 10_000] {
                let mut scene = cantilever();
                scene.rod.segments = Some(segments);
                scene.rod.section = Section::Circle { radius: 0.5 * slenderness };
                scene.material.youngs_modulus = modulus;
                let found = rest(&scene);
                assert_eq!(found.stable_in_plane, Some(true), "{modulus:e} {slenderness}: {found}");
                most = most.max(found.newton_iterations);
                sags.push(-found.tip[1] / 0.5);
            }
            // The same rod on both fine meshes, not just any equilibrium. Its bend at the wall is
            // as short as sqrt(EI/weight), down to a part of an edge of the coarser one.
            let [.., coarse, fine] = sags[..] else { unreachable!() };
            assert!((coarse / fine - 1.0).abs() < 2e-3, "{modulus:e} {slenderness}: {sags:?}");
        }
    }
    println!("at most {most} Newton iterations");
}

/// A hundred thousand edges from the straight state, and a helix of twenty thousand edges, have the limit of coarser meshes
/// and the same stability.
#[test]
fn very_fine_meshes_agree_with_coarser_ones() {
    let sag = |segments: usize| {
        let mut scene = cantilever();
        scene.rod.segments = Some(segments);
        let found = rest(&scene);
        assert_eq!(found.stable_in_plane, Some(true));
        println!("{segments} segments: {:.12}, {found}", -found.tip[1] / 0.5);
        -found.tip[1] / 0.5
    };
    for segments in [1500, 10_000, 100_000] {
        let exact = 0.29061133785;
        // Second order, 0.22/segments^2, and the digits of the exact value.
        let allowed = 0.3 / (segments as f64).powi(2) + 1e-10;
        assert!((sag(segments) - exact).abs() < allowed, "{segments}");
    }
    let extension = |segments: usize| {
        let mut scene = helix_with(0.5, 1e-3, 1.0, Clamp::MidEdge);
        scene.rod.segments = Some(segments);
        let problem = scene.problem().unwrap();
        let start = problem.spatial().unwrap().rest();
        let found = problem.equilibrium().unwrap();
        assert_eq!(found.stable, Some(true));
        let axial = 0.5 * 0.05 / (0.05_f64.powi(2) + (2.0 * PI * 0.02).powi(2)).sqrt();
        println!(
            "{segments} segments: {:.12}, {found}",
            (start[start.len() - 1] - found.tip[2]) / axial
        );
        (start[start.len() - 1] - found.tip[2]) / axial
    };
    for segments in [1500, 20_000] {
        let found = extension(segments);
        // The continuum value of the hanging helix.
        assert!((found / 0.0749973549 - 1.0).abs() < 1e-6, "{segments}: {found}");
    }
}

/// The tangent by edges is `T' K T` of that by nodes.
fn edges_are_congruent<R: Rod<f64>>(rod: &R, frames: &R::Frames, rest: &[f64], stride: usize) {
    let n = rest.len();
    let q: Vec<f64> = (0..n).map(|i| rest[i] + 2e-3 * (7.0 * i as f64).sin()).collect();
    let (mut nodes, mut edges) = (rod.zero_tangent(), rod.zero_tangent());
    rod.tangent(&q, frames, Derivatives::Hand, &mut vec![0.0; n], &mut nodes);
    for derivatives in [Derivatives::Hand, Derivatives::Dual] {
        rod.edge_tangent(&q, frames, derivatives, &mut edges);
        // An edge moves all nodes beyond.
        let moves = |i: usize| {
            let beyond = (i..n).step_by(stride).take_while(move |k| !R::is_angle(i) || *k == i);
            beyond.collect::<Vec<_>>()
        };
        let largest = (0..n).map(|i| nodes.get(i, i)).fold(0.0, f64::max);
        for i in 0..n {
            for j in 0..n {
                let sum = |k: usize| moves(j).iter().map(|m| nodes.get(k, *m)).sum::<f64>();
                let exact: f64 = moves(i).into_iter().map(sum).sum();
                let found = edges.get(i, j);
                // Congruence holds up to rounding errors.
                assert!((found - exact).abs() < 1e-12 * largest, "{i} {j}: {found} {exact}");
            }
        }
    }
}

#[test]
fn edge_tangent_is_congruent_to_the_node_tangent() {
    let mut plane = cantilever();
    plane.rod.segments = Some(7);
    plane.loads.point = vec![PointForce {
        node: Point::Tip,
        force: [0.0; 3],
        moment: [0.0, 0.0, 0.1],
        ..PointForce::default()
    }];
    let problem = plane.problem().unwrap();
    let discretized = problem.planar().unwrap();
    edges_are_congruent(&discretized.rod(), &(), &discretized.rest(), 2);
    let mut space = helix_with(0.5, 1e-3, 1.0, Clamp::MidEdge);
    space.rod.segments = Some(20);
    let problem = space.problem().unwrap();
    let discretized = problem.spatial().unwrap();
    let frames = discretized.simulation().unwrap().state().frames.clone();
    edges_are_congruent(&discretized.rod(), &frames, &discretized.rest(), 4);
}

/// Deflection of the end-loaded elastica (exact integrals).
#[test]
fn tip_loaded_elastica_agrees_with_exact_integrals() {
    for (load, exact) in [
        (1.0, 0.3017207738),
        (2.0, 0.4934574804),
        (5.0, 0.7137915236),
        (10.0, 0.8106090249),
        (50.0, 0.9171554473),
    ] {
        let deflection = |segments: usize| {
            let mut scene = unit_rod(segments, 1e-4);
            scene.loads.point = at_tip([0.0, -load, 0.0]);
            -rest(&scene).tip[1]
        };
        let errors = [100, 200].map(|n| deflection(n) - exact);
        let order = (errors[0] / errors[1]).log2();
        println!("P L^2/EI = {load}: error {:.1e} at 200 segments, order {order:.2}", errors[1]);
        // Second order in the mesh, against the exact integrals.
        assert!(errors[1].abs() < 5e-5 && order > 1.8, "{errors:?}");
    }
}

/// Extension of the hanging helix over its axial length; continuum 0.0749973549.
#[test]
fn hanging_helix_extension_agrees_with_the_continuum() {
    let axial = 0.5 * 0.05 / (0.05_f64.powi(2) + (2.0 * PI * 0.02).powi(2)).sqrt();
    for (clamp, discretization, segments, error) in [
        (Clamp::Nodes, Discretization::Paper, 50, -0.0836),
        (Clamp::MidEdge, Discretization::Paper, 50, -0.0665),
        (Clamp::MidEdge, Discretization::Corrected, 25, -0.004020),
        (Clamp::MidEdge, Discretization::Corrected, 50, -0.000716),
        (Clamp::MidEdge, Discretization::Corrected, 100, -0.000155),
        (Clamp::MidEdge, Discretization::Corrected, 200, -0.000037),
    ] {
        let mut scene = helix_with(0.5, 1e-3, 1.0, clamp);
        (scene.rod.segments, scene.rod.discretization) = (Some(segments), Some(discretization));
        let problem = scene.problem().unwrap();
        let start = problem.spatial().unwrap().rest();
        let found = problem.equilibrium().unwrap();
        let extension = (start[start.len() - 1] - found.tip[2]) / axial;
        let relative = extension / 0.0749973549 - 1.0;
        println!(
            "{clamp:?} {discretization:?} {segments}: {extension:.10}, {:.3} %",
            1e2 * relative
        );
        // The relative error that each form has at this mesh, by the list above.
        assert!((relative - error).abs() < 0.01 * error.abs() + 1e-6, "{relative}");
        assert_eq!(found.stable, Some(true));
    }
}

/// Buckling under a push, against the closed form of the discrete column, all of whose edges are
/// alike in the paper's form only; of a slender one that makes no difference.
#[test]
fn euler_column_buckles_at_the_closed_form_of_its_discretization() {
    for (slenderness, discretization) in
        [(1e-2, Discretization::Paper), (1e-4, Discretization::Corrected)]
    {
        euler_column_of(slenderness, discretization);
    }
}

/// Compares the critical load of a straight column of this slenderness, by bisection of the sign of its stiffness, with the
/// closed form for the discrete column.
fn euler_column_of(slenderness: f64, discretization: Discretization) {
    let stable = |push: f64| {
        let mut scene = unit_rod(50, slenderness);
        scene.loads.point = at_tip([-push, 0.0, 0.0]);
        scene.rod.dimension = Dimension::Planar;
        scene.rod.discretization = Some(discretization);
        let problem = scene.problem().unwrap();
        let discretized = problem.planar().unwrap();
        let straight = discretized.equilibrium().unwrap();
        let n = straight.q.len();
        let (mut gradient, mut tangent) = (vec![0.0; n], BandMatrix::zeros(n));
        discretized.rod().tangent(&straight.q, &(), Derivatives::Hand, &mut gradient, &mut tangent);
        let mut factors = Ldlt::with_order(n);
        factors.factor(&tangent, discretized.free()).unwrap();
        factors.negative_pivots() == 0
    };
    let found = critical([1.0, 3.0], 1e-13, stable);
    // P (1 - P/EA) = 4 EI/l^2 sin^2(pi/(2 (2 n + 1))), n = N - 2 nodes free to move.
    let (edge, axial) = (1.0 / 49.5, 4.0 / slenderness.powi(2));
    let right = 4.0 / (edge * edge) * (PI / (2.0 * 99.0)).sin().powi(2);
    let exact = 0.5 * axial * (1.0 - (1.0 - 4.0 * right / axial).sqrt());
    println!("Euler column {found:.12}, closed form {exact:.12}, continuum {:.6}", PI * PI / 4.0);
    // Closed form of the discrete column above, up to the tolerance of the bisection.
    assert!((found / exact - 1.0).abs() < 1e-9, "{found} {exact}");
}

/// A column under its own weight: q L^3/EI = 7.8373474389.
#[test]
fn heavy_column_buckles_at_the_weight_of_greenhill() {
    let found = [50, 100].map(|segments| {
        critical([5.0, 10.0], 1e-13, |weight| {
            let mut scene = unit_rod(segments, 1e-4);
            scene.loads.gravity = [-weight / (PI * 1e-8), 0.0, 0.0];
            rest(&scene).stable_in_plane == Some(true)
        })
    });
    let errors = found.map(|q| q / 7.8373474389 - 1.0);
    let order = (errors[0] / errors[1]).log2();
    // Far above the critical weight a slight push makes it fall; exactly upright it stays, and is reported as unstable.
    for (side, stable) in [(1e-9, Some(true)), (0.0, Some(false))] {
        let mut scene = unit_rod(100, 1e-4);
        scene.loads.gravity = [-1.0, side, 0.0].map(|g| g * 50.0 / (PI * 1e-8));
        let fallen = rest(&scene);
        assert_eq!(fallen.stable_in_plane, stable, "{fallen}");
        assert_eq!(fallen.tip[0] < -0.5, stable == Some(true), "{fallen}");
    }
    println!("heavy column: {:.6}, error {:.1e}, order {order:.2}", found[1], errors[1]);
    // Second order in the mesh, against Greenhill's 7.8373.
    assert!(errors[1].abs() < 1e-3 && order > 1.8, "{found:?}");
}

/// A strip on edge tips over sideways: P L^2/sqrt(B2 C) = 4.0125993436 under a load at its tip,
/// q L^3/sqrt(B2 C) = 12.8537633214 under its weight.
#[test]
fn strip_buckles_laterally_at_the_loads_of_beam_theory() {
    let strip = |segments: usize| {
        let mut scene = unit_rod(segments, 1e-4);
        // B1 = 1e6, B2 = 1, C = 0.7.
        let modulus = scene.material.youngs_modulus;
        let area = PI * 1e-8;
        let up = [0.0, 1.0, 0.0];
        let (i1, i2) = (1e6 / modulus, 1.0 / modulus);
        scene.rod.section = Section::Custom { area, i1, i2, j: 0.7 / modulus, up };
        scene.material.shear_modulus = Some(modulus);
        scene
    };
    let scale = 0.7_f64.sqrt();
    for (name, exact) in [("tip load", 4.0125993436), ("weight", 12.8537633214)] {
        let found = [50, 100].map(|segments| {
            let at = |load: f64| -> Equilibrium {
                let mut scene = strip(segments);
                match name {
                    "weight" => scene.loads.gravity = [0.0, -load / (PI * 1e-8), 0.0],
                    _ => scene.loads.point = at_tip([0.0, -load, 0.0]),
                }
                rest(&scene)
            };
            let load = critical([0.5 * exact * scale, 1.5 * exact * scale], 1e-13, |load| {
                let found = at(load);
                assert_eq!((found.model.as_str(), found.stable_in_plane), ("planar", Some(true)));
                found.stable == Some(true)
            });
            // Just above the critical load one direction is unstable.
            assert_eq!(at(1.01 * load).negative_directions, 1);
            load / scale
        });
        let errors = found.map(|load| load / exact - 1.0);
        let order = (errors[0] / errors[1]).log2();
        println!("{name}: {:.6}, error {:.1e}, order {order:.2}", found[1], errors[1]);
        // Critical loads of beam theory, with the error of the mesh.
        assert!(errors[1].abs() < 1e-3, "{found:?}");
    }
}

/// The buckled column: its tip turns by alpha where P/P_critical = (2 K(sin(alpha/2))/pi)^2.
#[test]
fn buckled_column_tip_angle_agrees_with_the_elliptic_integral() {
    for degrees in [20.0_f64, 60.0, 90.0, 120.0] {
        let modulus = (0.5 * degrees.to_radians()).sin();
        // The complete elliptic integral by the arithmetic-geometric mean.
        let (mut a, mut b) = (1.0_f64, (1.0 - modulus * modulus).sqrt());
        while (a - b).abs() > 1e-15 {
            (a, b) = (0.5 * (a + b), (a * b).sqrt());
        }
        let integral = PI / (2.0 * a);
        let turns = [100, 200].map(|segments| {
            let mut scene = unit_rod(segments, 1e-4);
            scene.loads.point = at_tip([-integral * integral, -1e-7, 0.0]);
            let found = rest(&scene);
            assert_eq!(found.stable_in_plane, Some(true));
            let [.., before, last] = &found.nodes[..] else { unreachable!() };
            (before[1] - last[1]).atan2(last[0] - before[0]).to_degrees()
        });
        println!("{degrees} degrees: {:.4} {:.4}", turns[0], turns[1]);
        // The elliptic integral's angle, with the error of the mesh, degrees.
        assert!((turns[1] - degrees).abs() < 0.02, "{turns:?}");
    }
}

/// The 45-degree bend with a load across its plane: Kirchhoff's continuum at P = 600; Simo and
/// Vu-Quoc's shear-flexible rod is at (15.79, 47.23, 53.37).
#[test]
fn bend_of_45_degrees_agrees_with_the_kirchhoff_continuum() {
    let bend = |segments: usize| {
        let shape = Shape::Arc { length: 25.0 * PI, angle: 0.25 * PI };
        let up = [0.0, 0.0, 1.0];
        let twelfth = 1.0 / 12.0;
        let section = Section::Custom { area: 1.0, i1: twelfth, i2: twelfth, j: twelfth, up };
        let material = Material { shear_modulus: Some(1e7), ..Material::new(1.0, 1e7) };
        let mut scene = Scene::new(segments, shape, section, material);
        scene.loads.point = at_tip([0.0, 0.0, 600.0]);
        let found = rest(&scene);
        assert_eq!((found.model.as_str(), found.stable), ("spatial", Some(true)));
        // Theirs starts along y and curves towards x.
        let [x, y, z] = found.tip;
        [y, x, z]
    };
    for segments in [50, 100, 200] {
        println!("{segments} segments: {:.6?}", bend(segments));
    }
    let tip = bend(100);
    for (found, exact) in tip.iter().zip([15.685356, 47.152150, 53.471763]) {
        // Continuum of Kirchhoff's theory at P = 600, computed independently.
        assert!((found / exact - 1.0).abs() < 1e-3, "{tip:?}");
    }
    for (found, theirs) in tip.iter().zip([15.79, 47.23, 53.37]) {
        // Values of Simo and Vu-Quoc, whose rod also shears.
        assert!((found / theirs - 1.0).abs() < 1e-2, "{tip:?}");
    }
}

/// A quarter circle under a small force at its tip, along each axis (Castigliano's integrals): the
/// corrected form against the paper's, in the plane and across it.
#[test]
fn quarter_circle_deflection_agrees_with_castigliano() {
    let (quarter, rest) = (0.25 * PI, 0.75 * PI - 2.0);
    // EI = 1, GJ = 1/1.3, R = 1.
    for (axis, exact) in [(0, quarter), (1, rest), (2, quarter + 1.3 * rest)] {
        let error = |discretization: Discretization, segments: usize| {
            let mut scene = unit_rod(segments, 1e-3);
            scene.rod.shape = Shape::Arc { length: 0.5 * PI, angle: 0.5 * PI };
            scene.rod.discretization = Some(discretization);
            scene.material.poisson_ratio = Some(0.3);
            let mut force = [0.0; 3];
            force[axis] = 1e-6;
            scene.loads.point = at_tip(force);
            let problem = scene.problem().unwrap();
            let moved = problem.equilibrium().unwrap().tip[axis];
            let start = if axis == 2 { 0.0 } else { 1.0 };
            (moved - start) / 1e-6 / exact - 1.0
        };
        let paper = [12, 24].map(|n| error(Discretization::Paper, n));
        let corrected = [12, 24].map(|n| error(Discretization::Corrected, n));
        println!("axis {axis}: paper {paper:?}, corrected {corrected:?}");
        for k in 0..2 {
            // The correction reduces the error to about a third or less.
            assert!(corrected[k].abs() < 0.35 * paper[k].abs(), "{paper:?} {corrected:?}");
        }
        // Second order without the correction.
        assert!((1.9..2.2).contains(&(paper[0] / paper[1]).log2()), "{paper:?}");
        assert!(corrected[1].abs() < 1.1e-3, "{corrected:?}");
    }
}

/// A rod that hangs from a hinge spins without resistance. That is neither an instability nor a singular tangent, on any
/// mesh, for any section, from the hanging or the horizontal start.
#[test]
fn rod_hanging_from_a_hinge_is_stable_despite_its_free_spin() {
    let flat = Section::Rectangle { width: 0.01, height: 0.002, up: [1.0, 0.0, 0.0] };
    let thin = Section::Rectangle { width: 2.3e-4, height: 1.4e-4, up: [1.0, 0.0, 0.0] };
    for section in [Section::Circle { radius: 0.002 }, Section::Circle { radius: 1e-4 }, flat, thin]
    {
        for direction in [[0.0, -1.0, 0.0], [0.3, -1.0, 0.0], [0.02, -1.0, 0.0]] {
            for segments in (4..60).step_by(5).chain([20, 30, 100, 400]) {
                let shape = Shape::Straight { length: 0.5, direction };
                let material = Material { poisson_ratio: Some(0.4), ..Material::new(1200.0, 1e8) };
                let mut scene = Scene::new(segments, shape, section.clone(), material);
                scene.supports.start = Support::Pinned;
                scene.loads.gravity = [0.0, -9.81, 0.0];
                let found = scene.problem().unwrap().equilibrium();
                let found = found.unwrap_or_else(|e| panic!("{segments} {section:?}: {e}"));
                assert_eq!(found.stable, Some(true), "{segments} {section:?}: {found}");
                let long = found.tip[0].hypot(found.tip[2]) < 1e-6 && found.tip[1] < -0.499;
                // Let go from the side it turns about the hinge, which is not at the origin's side.
                assert!(long || direction[0] != 0.0, "{segments} {section:?}: {found}");
            }
        }
    }
}

/// A rod without supports and loads stays in place; balanced forces on its ends stretch it.
#[test]
fn free_rods_keep_their_place_and_stretch_under_balanced_forces() {
    let straight = Shape::Straight { length: 0.5, direction: [0.3, 0.5, -0.2] };
    let arc = Shape::Arc { length: 0.5, angle: 2.0 };
    let helix = helix_with(0.5, 1e-3, 1.0, Clamp::MidEdge).rod.shape;
    for shape in [straight, arc, helix] {
        for segments in [8, 20, 51, 100, 333] {
            let mut scene = unit_rod(segments, 1e-3);
            scene.rod.shape = shape.clone();
            scene.material = Material { poisson_ratio: Some(0.3), ..Material::new(2700.0, 7e10) };
            scene.supports.start = Support::Free;
            let problem = scene.problem().unwrap();
            let found =
                problem.equilibrium().unwrap_or_else(|e| panic!("{shape:?} {segments}: {e}"));
            assert_eq!(found.stable, Some(true), "{shape:?} {segments}: {found}");
            let mut still = scene.clone();
            still.supports.start = Support::Clamped;
            still.supports.clamp = Clamp::Nodes;
            let rest = still.problem().unwrap().equilibrium().unwrap().nodes;
            let moved =
                found.nodes.iter().zip(&rest).flat_map(|(a, b)| (0..3).map(|c| a[c] - b[c]));
            // Balanced forces stretch the rod as if it were held: rounding errors.
            assert!(moved.fold(0.0, |m: f64, x| m.max(x.abs())) < 1e-9, "{shape:?} {segments}");
        }
    }
    let mut scene = unit_rod(40, 1e-2);
    scene.supports.start = Support::Free;
    let pull = |node, force| PointForce { node, force: [force, 0.0, 0.0], ..PointForce::default() };
    scene.loads.point = vec![pull(Point::Tip, 1.0), pull(Point::Node(0), -1.0)];
    let found = rest(&scene);
    assert_eq!(found.stable_in_plane, Some(true), "{found}");
    // EA = 4/slenderness^2.
    let longer = found.tip[0] - found.nodes[0][0] - 1.0;
    assert!((longer / 2.5e-5 - 1.0).abs() < 1e-6, "{longer}");
    // Pushed together, it does not stand.
    scene.loads.point.iter_mut().for_each(|load| load.force[0] *= -1.0);
    let found = rest(&scene);
    assert!(found.negative_directions > 0 || found.tip[0] < found.nodes[0][0], "{found}");
    // A net force has no equilibrium.
    scene.loads.point.truncate(1);
    assert!(scene.problem().unwrap().equilibrium().is_err());
}

/// A force `P` at arc length `a` of a cantilever deflects its tip by `P a^2 (3 L - a)/(6 EI)` for any positions of the nodes; its
/// position does not change with the mesh.
#[test]
fn force_between_nodes_deflects_as_in_beam_theory_on_every_mesh() {
    let (length, radius, modulus): (f64, f64, f64) = (0.5, 5e-3, 1e9);
    let bending = modulus * PI * radius.powi(4) / 4.0;
    let tip = |at: f64, segments: usize| {
        let mut scene = cantilever();
        scene.rod.segments = Some(segments);
        scene.material.youngs_modulus = modulus;
        scene.loads.gravity = [0.0; 3];
        let force = [0.0, 1e-4, 0.0];
        let node = Point::ArcLength(at);
        scene.loads.point =
            vec![PointForce { node, force, moment: [0.0; 3], follower: false, signal: None }];
        rest(&scene).tip[1]
    };
    for at in [0.03, 0.111, 0.25, 0.377, 0.49, 0.5] {
        let theory = 1e-4 * at * at * (3.0 * length - at) / (6.0 * bending);
        let off = [25, 50, 100].map(|segments| tip(at, segments) / theory - 1.0);
        println!("force at {at} m: {:.1e} {:.1e} {:.1e} off", off[0], off[1], off[2]);
        // Of second order, wherever between two nodes the force is.
        assert!(off[0].abs() < 0.3 * (0.02 / at).powi(2), "{at}: {off:?}");
        assert!((3.7..4.3).contains(&(off[1] / off[2])), "{at}: {off:?}");
    }
    let mut scene = cantilever();
    let node = Point::ArcLength(0.51);
    scene.loads.point = vec![PointForce { node, ..PointForce::default() }];
    let error = scene.problem().unwrap_err().to_string();
    assert!(error.contains("loads.point[0].node.arc_length: found 0.51"), "{error}");
}

/// Reactions at rest balance the loads, whatever the motion of the supports at later times.
#[test]
fn reactions_at_rest_do_not_depend_on_later_support_motion() {
    let mut scene = cantilever();
    (scene.rod.segments, scene.supports.clamp) = (Some(10), Clamp::Nodes);
    scene.supports.motion = vec![Motion {
        end: End::Start,
        rotation: [0.0, 0.0, 0.2],
        frequency: Some(20.0),
        ..Motion::default()
    }];
    let moved = rest(&scene).reactions;
    scene.supports.motion.clear();
    assert_eq!(moved, rest(&scene).reactions);
}
