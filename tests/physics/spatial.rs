//! Spatial rods against planar ones, torsional theory, and invariance under rigid motion.

use nalgebra::{Rotation3, Unit, Vector3};
use rodfit::energy::frame::Frames;
use rodfit::rod::Rod;
use rodfit::scene::section::{circle, rectangle};
use rodfit::scene::{
    Clamp, Dimension, InitialState, Material, Point, PointForce, Scene, Scheme, Section, Shape,
    Support, Time,
};

use crate::common::differences::assembled;
use crate::common::{at_tip, cantilever, cantilever_with, helix_with};

/// The largest distance between the nodes of the planar and the spatial model at any step.
fn models_apart(mut scene: Scene) -> f64 {
    scene.material.poisson_ratio = Some(0.3);
    scene.rod.dimension = Dimension::Auto;
    let planar = scene.problem().unwrap();
    scene.rod.dimension = Dimension::Spatial;
    let spatial = scene.problem().unwrap();
    assert_eq!((planar.model().0, spatial.model().0), ("planar", "spatial"));
    let (a, b) = (planar.simulate().unwrap(), spatial.simulate().unwrap());
    let mut apart = 0.0_f64;
    for k in 0..a.times().len() {
        for i in 0..a.nodes() {
            let d = Vector3::from(a.node(i, k)) - Vector3::from(b.node(i, k));
            apart = apart.max(d.norm());
        }
    }
    apart
}

/// `auto` selects the planar model in any plane. Both models have the same motion, up to the rounding errors that grow in an
/// undamped whipping rod.
#[test]
fn planar_and_spatial_models_agree_on_planar_scenes() {
    let turned = |mut scene: Scene| {
        scene.rod.shape = Shape::Straight { length: 0.5, direction: [0.3, -0.5, 0.8] };
        scene.loads.gravity = [5.0, 2.0, -7.0];
        scene
    };
    let curved = |mut scene: Scene| {
        scene.rod.shape = Shape::Arc { length: 0.5, angle: 2.0 };
        scene.rod.natural_curvature = 0.7.into();
        scene.loads.damping.mass = 0.5;
        scene.loads.damping.stiffness = 1e-3;
        scene.supports.end = Support::Pinned;
        scene.loads.point = vec![PointForce {
            node: Point::Node(20),
            force: [0.1, -0.3, 0.0],
            ..PointForce::default()
        }];
        scene
    };
    let flat = |up: [f64; 3]| {
        let mut scene = cantilever_with(0.5, 1e-3, 0.3, Clamp::MidEdge);
        scene.rod.section = Section::Rectangle { width: 0.01, height: 0.004, up };
        scene
    };
    let scenes = [
        ("cantilever", cantilever_with(0.5, 1e-3, 0.5, Clamp::Nodes)),
        ("dissipating", cantilever_with(0.8, 5e-3, 1.0, Clamp::MidEdge)),
        ("turned", turned(cantilever_with(0.5, 1e-3, 0.3, Clamp::MidEdge))),
        ("curved, damped", curved(cantilever_with(0.5, 1e-3, 0.3, Clamp::MidEdge))),
        ("flat", flat([0.0, 1.0, 0.0])),
        ("on edge", flat([0.0, 0.0, 1.0])),
    ];
    for (name, scene) in scenes {
        let apart = models_apart(scene);
        println!("{name}: {apart:.1e} m");
        // Rounding errors that grow along an undamped motion.
        assert!(apart < 1e-11, "{name}: {apart:e}");
    }
}

/// A straight rod is released after a twist: the lowest torsional frequency of a clamped rod is
/// `pi/(2 L) sqrt(G J/(rho (I1 + I2)))`, and there is no other motion.
#[test]
fn frequency_of_torsional_vibration_equals_theory() {
    for (section, moments) in [
        (Section::Circle { radius: 0.005 }, circle(0.005)),
        (
            Section::Rectangle { width: 0.02, height: 0.005, up: [0.0, 1.0, 0.0] },
            rectangle(0.02, 0.005),
        ),
    ] {
        let wave = (moments.torsion_constant / moments.second_moments.iter().sum::<f64>() * 4e7
            / 1000.0)
            .sqrt();
        let exact = std::f64::consts::FRAC_PI_2 / 0.5 * wave;
        let mut errors = Vec::new();
        for segments in [20, 40] {
            let shape = Shape::Straight { length: 0.5, direction: [1.0, 0.0, 0.0] };
            let material = Material { shear_modulus: Some(4e7), ..Material::new(1000.0, 1e8) };
            let mut scene = Scene::new(segments, shape, section.clone(), material);
            scene.rod.dimension = Dimension::Spatial;
            let period = std::f64::consts::TAU / exact;
            let step = period / 400.0;
            scene.time = Some(Time::new(period, step));
            let problem = scene.problem().unwrap();
            let mut simulation = problem.spatial().unwrap().simulation().unwrap();
            // The lowest mode, at unit speed at the free end.
            let n = problem.segments();
            let edge = 0.5 / (n as f64 - 0.5);
            let mut v = vec![0.0; problem.dof()];
            for j in 0..n {
                v[4 * j + 3] = (exact / wave * j as f64 * edge).sin();
            }
            simulation.set_velocity(&v);
            // The end comes back after half a period.
            let last = 4 * (n - 1) + 3;
            let mut crossing = f64::NAN;
            for k in 1.. {
                let before = simulation.state().q[last];
                simulation.step_to(f64::from(k) * step).unwrap();
                let now = simulation.state().q[last];
                if k > 10 && before > 0.0 && now <= 0.0 {
                    crossing = (f64::from(k) - now / (now - before)) * step;
                    break;
                }
            }
            let still = (0..problem.dof()).filter(|i| i % 4 != 3);
            let q = &simulation.state().q;
            let rest = problem.spatial().unwrap().rest();
            // Torsion moves no node.
            assert!(still.map(|i| (q[i] - rest[i]).abs()).fold(0.0, f64::max) < 1e-14);
            errors.push(std::f64::consts::PI / crossing / exact - 1.0);
        }
        println!("torsional frequency off by {errors:?}");
        // Second order in the edge, less what the steps of 1/400 period cost.
        assert!(errors[1].abs() < 2e-4 && errors[1].abs() < 0.35 * errors[0].abs(), "{errors:?}");
    }
}

/// Fifty turns of the end of a rod, in increments: twist counts on.
#[test]
fn twist_of_fifty_turns_is_counted() {
    let mut scene = cantilever();
    (scene.rod.dimension, scene.material.poisson_ratio) = (Dimension::Spatial, Some(0.3));
    scene.rod.segments = Some(11);
    let problem = scene.problem().unwrap();
    let discretized = problem.spatial().unwrap();
    let (rod, mut q, mut frames) = (
        discretized.rod(),
        discretized.rest(),
        discretized.simulation().unwrap().state().frames.clone(),
    );
    let turns = 50.0 * std::f64::consts::TAU;
    for k in 1..=500 {
        for j in 0..11 {
            q[4 * j + 3] = turns * f64::from(k) / 500.0 * j as f64 / 10.0;
        }
        <_ as Moves>::update_reference_frames(&rod, &mut frames, &q);
    }
    // Those next to the wall are of their own.
    let stiffness: f64 = rod.joint.iter().map(|joint| joint.stiffness.twist).sum();
    let exact = 0.5 * stiffness * (turns / 10.0_f64).powi(2);
    let found = rod.energies(&q, &frames).twist;
    assert!((found / exact - 1.0).abs() < 1e-14, "{found} {exact}");

    // One edge swung around the other on a cone: every loop adds the cone's solid angle, that of
    // `steps` spherical triangles.
    let (steps, loops, half) = (50, 50, 0.6_f64);
    let tangent = |k: usize| {
        let a = std::f64::consts::TAU * (k % steps) as f64 / steps as f64;
        [half.cos(), half.sin() * a.cos(), half.sin() * a.sin()]
    };
    let mut frames = Frames::bishop(&[[1.0, 0.0, 0.0], tangent(0)], [0.0, 1.0, 0.0]);
    for k in 1..=steps * loops {
        frames.update_reference_frames(|j| if j == 0 { [1.0, 0.0, 0.0] } else { tangent(k) });
    }
    // Legs of the isosceles spherical triangle and the angle between them (L'Huilier's form).
    let apex = std::f64::consts::TAU / steps as f64;
    let t = (half / 2.0).tan().powi(2);
    let triangle = 2.0 * (t * apex.sin()).atan2(1.0 + t * apex.cos());
    let exact = triangle * (steps * loops) as f64;
    // Excess of the spherical triangle that the tangent circles (L'Huilier), summed over all turns.
    assert!((frames.twist[0] / exact - 1.0).abs() < 1e-14, "{} {exact}", frames.twist[0]);
}

/// Gives a rod of known dimension the method [`Rod::update_reference_frames`].
trait Moves {
    fn update_reference_frames(&self, frames: &mut Frames<f64>, q: &[f64]);
}

impl Moves for rodfit::rod::SpatialRod<f64> {
    fn update_reference_frames(&self, frames: &mut Frames<f64>, q: &[f64]) {
        <Self as Rod<f64>>::update_reference_frames(frames, q);
    }
}

/// A helix in motion, its frames a step old.
fn moving_helix() -> (rodfit::Problem, Vec<f64>, Frames<f64>) {
    let mut scene = helix_with(0.5, 2e-3, 0.2, Clamp::MidEdge);
    scene.rod.section = Section::Rectangle { width: 0.01, height: 0.006, up: [1.0, 0.3, 0.0] };
    scene.loads.point = at_tip([0.05, 0.03, 0.0]);
    let problem = scene.problem().unwrap();
    let mut simulation = problem.spatial().unwrap().simulation().unwrap();
    for k in 1..=60 {
        simulation.step_to(f64::from(k) * 2e-3).unwrap();
    }
    let (q, frames) = (simulation.state().q.clone(), simulation.previous().frames.clone());
    (problem, q, frames)
}

/// A rigid rotation of the rod, in one or many steps, keeps its elastic energy. The angles of the edges change by the rotation
/// between the transported directors and those fixed in the body.
#[test]
fn energy_is_invariant_under_rigid_motion() {
    let (problem, q, frames) = moving_helix();
    let rod = problem.spatial().unwrap().rod();
    let elastic = |q: &[f64], frames: &Frames<f64>| {
        let e = rod.energies(q, frames);
        [e.stretch, e.bend, e.twist]
    };
    let before = elastic(&q, &frames);
    let axis = Unit::new_normalize(Vector3::new(0.3, -0.8, 0.5));
    for (steps, degrees) in [(1, 40.0_f64), (1, 110.0), (30, 700.0)] {
        let (mut q, mut frames) = (q.clone(), frames.clone());
        let turn = Rotation3::from_axis_angle(&axis, degrees.to_radians() / f64::from(steps));
        for _ in 0..steps {
            let mut moved = q.clone();
            for i in 0..problem.nodes() {
                let x = turn * Vector3::new(q[4 * i], q[4 * i + 1], q[4 * i + 2]);
                moved[4 * i..4 * i + 3].copy_from_slice((x + Vector3::x()).as_slice());
            }
            let mut last = 0.0;
            for j in 0..problem.segments() {
                let tangent = |q: &[f64]| {
                    let x = |i: usize| Vector3::new(q[4 * i], q[4 * i + 1], q[4 * i + 2]);
                    (x(j + 1) - x(j)).normalize()
                };
                let (t, edge) = (tangent(&moved), &frames.edges[j]);
                // The director the body carries, and the one transport finds.
                let [m1, _] = edge.material(tangent(&q).into(), q[4 * j + 3]);
                let carried = turn * Vector3::from(m1);
                let [m1, m2] = edge.material(t.into(), q[4 * j + 3]).map(Vector3::from);
                let psi = carried.dot(&m2).atan2(carried.dot(&m1));
                // Neighboring directors turn alike: no jump by a full turn between them.
                let whole = ((last - psi) / std::f64::consts::TAU).round();
                last = psi + whole * std::f64::consts::TAU;
                moved[4 * j + 3] += last;
            }
            q = moved;
            if steps > 1 {
                <_ as Moves>::update_reference_frames(&rod, &mut frames, &q);
            }
        }
        let after = elastic(&q, &frames);
        for (a, b) in before.iter().zip(after) {
            // Rigid motion changes no elastic energy: rounding errors.
            assert!((a - b).abs() < 1e-11 * before[1], "{degrees}: {a} {b}");
        }
    }
}

/// Moving the reference changes no energy.
#[test]
fn rebasing_frames_does_not_change_the_energy() {
    let (problem, q, frames) = moving_helix();
    let rod = problem.spatial().unwrap().rod();
    let mut moved = frames.clone();
    <_ as Moves>::update_reference_frames(&rod, &mut moved, &q);
    let (a, b) = (rod.energies(&q, &frames), rod.energies(&q, &moved));
    for (a, b) in [(a.bend, b.bend), (a.twist, b.twist), (a.stretch, b.stretch)] {
        // As above: rounding errors.
        assert!((a - b).abs() < 1e-13 * a.abs(), "{a} {b}");
    }
}

#[test]
fn assembly_counts_every_element_once() {
    let (problem, q, frames) = moving_helix();
    let rod = problem.spatial().unwrap().rod();
    assembled(&rod, &q, &frames, 1e-7);
}

/// A rod that hangs although its rest shape stands, so that edges start rotated by half a turn, with an initial velocity:
/// both models have the same motion.
#[test]
fn rod_that_starts_rotated_by_half_a_turn_moves_as_in_the_plane() {
    let mut scene = cantilever_with(0.5, 2e-3, 0.04, Clamp::Nodes);
    scene.rod.segments = Some(11);
    scene.rod.shape = Shape::Arc { length: 0.6, angle: 1.7 };
    scene.rod.natural_curvature = 0.0.into();
    scene.material.youngs_modulus = 2e6;
    scene.loads.gravity = [-2.8, -9.5, 0.0];
    scene.initial.state = InitialState::Equilibrium;
    scene.initial.point = at_tip([-0.008, 0.012, 0.0]);
    let rest = scene.problem().unwrap().equilibrium().unwrap();
    let turned = |i: usize| {
        let edge = Vector3::from(rest.nodes[i + 1]) - Vector3::from(rest.nodes[i]);
        let (sin, cos) = (1.7 * (i as f64 + 0.5) / 11.0).sin_cos();
        edge.normalize().dot(&Vector3::new(cos, sin, 0.0))
    };
    let most = (0..11).map(turned).fold(1.0, f64::min);
    // The edges at the tip are turned by nearly half a turn, as the test requires.
    assert!(most < -0.97, "{most}");
    for (scheme, velocity) in
        [(Scheme::GeneralisedAlpha, [0.0; 3]), (Scheme::NewmarkBeta, [-0.3, 0.08, 0.0])]
    {
        scene.time.as_mut().unwrap().scheme = scheme;
        scene.initial.velocity = velocity;
        let apart = models_apart(scene.clone());
        // Rounding errors that grow along the motion.
        assert!(apart < 1e-10, "{scheme:?}: {apart:e}");
    }
}
