//! Corrections of the discretization (clamps, thickness, curvature) on rods of many sizes: errors and their order against closed
//! forms and Castigliano's integrals.

use nalgebra::Vector3;
use rodfit::scene::{
    Dimension, Discretization, Handedness, Material, Scene, Section, Shape, Support,
};
use std::f64::consts::{PI, TAU};

use crate::common::{at_tip, cantilever, extremum, sag};

/// E = 1e7 Pa, G = E/3, 1000 kg/m^3.
fn rod(segments: usize, shape: Shape, section: Section) -> Scene {
    let material = Material { poisson_ratio: Some(0.5), ..Material::new(1e3, 1e7) };
    Scene::new(segments, shape, section, material)
}

/// A straight rod that hangs downward.
fn straight(segments: usize, length: f64, radius: f64) -> Scene {
    let shape = Shape::Straight { length, direction: [0.0, 0.0, -1.0] };
    rod(segments, shape, Section::Circle { radius })
}

/// A rod that hangs along itself: a force at its tip stretches it exactly at every node, on every
/// mesh; of its weight, a quarter of an edge is missing in the first one and a half at each wall.
#[test]
fn stretching_next_to_walls() {
    for (segments, length, radius, dimension) in [
        (2, 0.5, 0.005, Dimension::Planar),
        (3, 2.0, 0.1, Dimension::Spatial),
        (50, 0.5, 0.005, Dimension::Planar),
        (100, 30.0, 0.2, Dimension::Spatial),
    ] {
        for (end, weight, force) in
            [(Support::Free, 0.0, 2.0), (Support::Free, 1.0, 2.0), (Support::Clamped, 1.0, 0.0)]
        {
            if end == Support::Clamped && segments < 4 {
                continue;
            }
            let mut scene = straight(segments, length, radius);
            (scene.rod.dimension, scene.supports.end) = (dimension, end);
            // Strains of about 1e-3, N/m over EA.
            let (axial, line) = (1e7 * PI * radius * radius, 1e3 * PI * radius * radius);
            let unit = 1e-3 * axial / length;
            scene.loads.gravity = [0.0, 0.0, -weight * unit / line];
            let force = force * unit * length;
            if force != 0.0 {
                let force = [0.0, 0.0, -force];
                scene.loads.point = at_tip(force);
            }
            let problem = scene.problem().unwrap();
            let found = problem.equilibrium().unwrap();
            // Tension at the wall, N.
            let wall =
                force + weight * unit * length * if end == Support::Clamped { 0.5 } else { 1.0 };
            for i in 2..=segments {
                let s = problem.arc_length(rodfit::Point::Node(i)).unwrap();
                if s > length * (1.0 + 1e-12) {
                    continue;
                }
                let exact = (wall * s - 0.5 * weight * unit * s * s) / axial;
                let moved = -found.nodes[i][2] - s;
                // The node next to the second wall is held, half an edge before it.
                if end == Support::Clamped && i == segments - 1 {
                    assert_eq!(moved, 0.0);
                    continue;
                }
                let edge = problem.arc_length(rodfit::Point::Node(1)).unwrap() * 2.0;
                let missing = 0.25 * 1.5 * weight * unit * edge * edge / axial;
                let allowed = if end == Support::Clamped { 2.0 } else { 1.0 } * missing;
                // Allowed: a quarter of an edge's weight missing in the first edge, and half an edge's at each wall, as
                // derived above.
                assert!(
                    (moved - exact).abs() < allowed * (1.0 + 1e-9) + 1e-12 * length,
                    "{segments} {end:?} node {i}: {moved:e} {exact:e}"
                );
            }
        }
    }
}

/// Small deflections of cantilevers under their weight and under a force at the tip are third order
/// in the mesh where they are curved ever so little, and second without the correction at the wall.
#[test]
fn small_deflections_of_cantilevers() {
    for (length, radius) in [(0.5, 0.005), (2.0, 0.05), (0.1, 0.0001)] {
        for load in ["weight", "force"] {
            let error = |segments: usize, discretization: Discretization| {
                // By 6e-6 a joint; the curve changes the sag by 1e-7.
                let shape = Shape::Arc { length, angle: 3e-4 };
                let mut scene = rod(segments, shape, Section::Circle { radius });
                scene.rod.discretization = Some(discretization);
                let bending = 1e7 * PI * radius.powi(4) / 4.0;
                // Sags of 1e-4 of the length: geometry adds 1e-8 of that.
                let sag = match load {
                    "weight" => {
                        let line = 1e3 * PI * radius * radius;
                        scene.loads.gravity = [0.0, 8e-4 * bending / (line * length.powi(3)), 0.0];
                        1e-4 * length
                    }
                    _ => {
                        let force = [0.0, 3e-4 * bending / length.powi(2), 0.0];
                        scene.loads.point = at_tip(force);
                        1e-4 * length
                    }
                };
                let problem = scene.problem().unwrap();
                let rest = problem.planar().unwrap().rest();
                (problem.equilibrium().unwrap().tip[1] - rest[rest.len() - 1]) / sag - 1.0
            };
            let corrected = [13, 25, 49].map(|n| error(n, Discretization::Corrected));
            let paper = [13, 25, 49].map(|n| error(n, Discretization::Paper));
            let order = |e: [f64; 3]| (e[1] / e[2]).abs().log2() / (48.5_f64 / 24.5).log2();
            println!(
                "{length} m, {load}: {corrected:?}, order {:.2}; uncorrected {paper:?}, {:.2}",
                order(corrected),
                order(paper)
            );
            // Third order with the correction, by halving the edges.
            assert!(order(corrected) > 2.8, "{corrected:?}");
            // Second order without it.
            assert!((1.9..2.1).contains(&order(paper)), "{paper:?}");
            // The correction matters on the finest mesh.
            assert!(corrected[2].abs() < 0.1 * paper[2].abs());
        }
    }
}

/// Displacement of the tip of a clamped curve along a unit acceleration `g` of its mass, for small loads: the integral of the
/// moments over the stiffnesses.
fn castigliano(scene: &Scene, g: Vector3<f64>) -> f64 {
    let n = 20_000;
    let mesh = scene.rod.shape.mesh(Some(n), [0.0; 2]).unwrap();
    let x = |i: usize| Vector3::from(mesh.nodes[i]);
    let l = mesh.length / n as f64;
    let (area, [i1, i2], j) = match scene.rod.section {
        Section::Custom { area, i1, i2, j, .. } => (area, [i1, i2], j),
        Section::Circle { radius } => {
            let i = PI * radius.powi(4) / 4.0;
            (PI * radius * radius, [i; 2], 2.0 * i)
        }
        Section::Rectangle { .. } | Section::Tube { .. } => unreachable!("none here"),
    };
    let e = scene.material.youngs_modulus;
    let torsion = e / 3.0 * j;
    let line = scene.material.density * area;
    // Below node i: mass, and mass times position; half a cell at the ends.
    let (mut mass, mut first, mut sum) = (0.0, Vector3::zeros(), 0.0);
    for i in (0..=n).rev() {
        let half = 0.5 * line * l;
        if i < n {
            (mass, first) = (mass + half, first + x(i) * half);
        }
        let (a, b) = (x(i.saturating_sub(1)), x((i + 1).min(n)));
        let t = (b - a).normalize();
        let any = Vector3::new(0.3, 0.5, 0.81);
        let m1 = scene.rod.section.up().map_or(any, Vector3::from);
        let m1 = (m1 - t * t.dot(&m1)).normalize();
        let m2 = t.cross(&m1);
        let moment = (first - x(i) * mass).cross(&g);
        let unit = (x(n) - x(i)).cross(&g);
        let along = |d: Vector3<f64>| d.dot(&moment) * d.dot(&unit);
        let pull = mass * g.dot(&t).powi(2) / (e * area);
        let here = along(m2) / (e * i1) + along(m1) / (e * i2) + along(t) / torsion + pull;
        sum += here * l * if i == 0 || i == n { 0.5 } else { 1.0 };
        (mass, first) = (mass + half, first + x(i) * half);
    }
    sum
}

/// Helices and arcs under small loads along every axis.
#[test]
fn small_deflections_of_curves() {
    let helix = |length: f64, radius: f64, pitch: f64| Shape::Helix {
        length,
        radius,
        pitch,
        axis: [0.0, 0.0, -1.0],
        handedness: Handedness::Right,
    };
    let circle = |radius: f64| Section::Circle { radius };
    let strip = |height: f64| Section::Custom {
        area: 4.0 * height * height,
        i1: height.powi(4) / 3.0,
        i2: height.powi(4) * 3.0,
        j: height.powi(4),
        up: [0.0, 0.0, 1.0],
    };
    for (name, shape, section, segments) in [
        ("the paper's helix", helix(0.5, 0.02, 0.05), circle(0.005), 50),
        ("flat", helix(0.5, 0.02, 0.01), circle(0.001), 50),
        ("steep", helix(0.5, 0.02, 0.2), circle(0.002), 40),
        ("a corkscrew", helix(3.0, 0.05, 0.6), circle(0.003), 80),
        ("many turns", helix(1.0, 0.01, 0.02), circle(0.0005), 200),
        ("less than a turn", helix(1.0, 0.3, 0.5), circle(0.01), 12),
        ("quarter circle", Shape::Arc { length: 1.0, angle: 0.5 * PI }, circle(0.01), 12),
        ("full circle", Shape::Arc { length: 1.0, angle: TAU }, circle(0.01), 36),
        ("a strip's half circle", Shape::Arc { length: 4.0, angle: PI }, strip(0.02), 24),
    ] {
        for axis in 0..3 {
            let g: Vector3<f64> = Vector3::ith(axis, 1.0);
            let error = |segments: usize, discretization: Discretization, exact: f64| {
                let mut scene = rod(segments, shape.clone(), section.clone());
                scene.rod.discretization = Some(discretization);
                scene.rod.dimension = Dimension::Spatial;
                // Goes 1e-5 of the length.
                let load = 1e-5 * scene.problem().unwrap().length() / exact.abs();
                scene.loads.gravity = (g * load).into();
                let problem = scene.problem().unwrap();
                let start = problem.spatial().unwrap().rest();
                let moved =
                    problem.equilibrium().unwrap().tip[axis] - start[start.len() - 3 + axis];
                moved / (load * exact) - 1.0
            };
            let exact = castigliano(&rod(segments, shape.clone(), section.clone()), g);
            let [paper, coarse, fine] = [
                (segments, Discretization::Paper),
                (segments, Discretization::Corrected),
                (2 * segments, Discretization::Corrected),
            ]
            .map(|(n, form)| error(n, form, exact));
            println!(
                "{name}, axis {axis}: {segments} segments: paper's {:.3} %, corrected {:.4} %, \
                 twice as many {:.4} %",
                1e2 * paper,
                1e2 * coarse,
                1e2 * fine
            );
            // A turn and more: little is left. Less: what the tip leaves, at second order.
            let (left, order, none) =
                if segments >= 36 { (0.02, 0.6, 1e-4) } else { (0.75, 0.33, 4e-4) };
            assert!(coarse.abs() < left * paper.abs(), "{name} {axis}: {coarse}");
            assert!(
                fine.abs() < none || fine.abs() < order * coarse.abs(),
                "{name} {axis}: {fine}"
            );
        }
    }
}

/// Errors of the first swing of the paper's cantilever (0.544335 L in the continuum) and of its lowest frequency, with the
/// corrections of the clamp: bounded at 50 edges, of second order in the edge length.
#[test]
fn first_swing_of_the_cantilever() {
    let continuum = |discretization: Discretization, segments: usize| {
        let mut scene = cantilever();
        scene.rod.segments = Some(segments);
        scene.rod.discretization = Some(discretization);
        let time = rodfit::scene::Time::new(0.35, 2e-4);
        scene.time = Some(rodfit::scene::Time { scheme: rodfit::scene::Scheme::Rodas4, ..time });
        let problem = scene.problem().unwrap();
        let run = problem.simulate().unwrap();
        let swing = extremum(run.times(), &sag(&run), [0.1, 0.35], 1.0);
        let lowest = problem
            .modes(1, rodfit::vibration::LinearizationPoint::Rest)
            .unwrap()
            .frequencies_rad_s[0];
        let bending = 1e8 * 0.005_f64.powi(2) / 4.0 / 1273.52;
        let exact = 1.87510407_f64.powi(2) * bending.sqrt() / 0.25;
        [swing - 0.544335, lowest / exact - 1.0]
    };
    for (discretization, swing, frequency) in [
        (Discretization::Corrected, 2.0e-4, 7e-5),
        (Discretization::CorrectedStatics, 1e-4, 1.7e-4),
    ] {
        let [coarse, fine] = [50, 100].map(|n| continuum(discretization, n));
        let order = (coarse[0] / fine[0]).abs().log2();
        println!(
            "{discretization:?}: swing off by {:.1e} L at 50 segments, {:.1e} at 100, order {order:.1}; \
             frequency by {:.1e}",
            coarse[0], fine[0], coarse[1]
        );
        assert!(coarse[0].abs() < swing && coarse[1].abs() < frequency, "{coarse:?}");
        // Second order, up to the scatter of the extremum.
        assert!(order > 1.7, "{coarse:?} {fine:?}");
    }
}
