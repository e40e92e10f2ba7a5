//! Rods with prescribed motion of inner nodes, or with free twist of their ends.

use rodfit::Trajectory;
use rodfit::scene::{
    Dimension, End, InitialState, Material, Motion, Recorded, Scene, Scheme, Shape, StepTolerance,
    Support, Time, Track,
};
use std::f64::consts::PI;

use crate::common::recordings::{MARKERS, cable, recorded};

use crate::common::straight_rod;

/// Inner markers with their free motion prescribed change nothing: the cable moves as before, with one such marker and with
/// all but one, in all schemes.
#[test]
fn prescribed_motion_equal_to_the_free_one_does_not_change_the_run() {
    for scheme in [Scheme::GeneralisedAlpha, Scheme::NewmarkBeta, Scheme::AverageVectorField] {
        for dimension in [Dimension::Auto, Dimension::Spatial] {
            let run = |track: Track, inner: &[&str]| {
                let mut scene = cable(track.clone());
                scene.rod.dimension = dimension;
                scene.material.poisson_ratio = Some(0.4);
                scene.initial.state = InitialState::Equilibrium;
                // Steps without ringing of the edges.
                let time = Time::new(track.end(), 0.01);
                let tolerance = match scheme {
                    Scheme::AverageVectorField => StepTolerance::default(),
                    _ => StepTolerance::Rounding,
                };
                scene.time = Some(Time { scheme, beta: 1.0, tolerance, ..time });
                let inner = inner.iter().map(|name| (*name).into()).collect();
                scene.supports.path = Some(Recorded { inner, ..Recorded::of(track) });
                scene.problem().unwrap().simulate().unwrap()
            };
            let hands = recorded(3, 60, 0.0, |_| {});
            let free = run(hands.clone(), &[]);
            let seen = |j: usize| (0..60).map(|k| Some(free.node(j, k))).collect();
            let markers = (0..MARKERS).map(|j| (j.to_string(), seen(j))).collect();
            let track = Track::new(hands.times().to_vec(), markers).unwrap();
            for inner in [&["3"][..], &["2", "4"]] {
                let prescribed = run(track.clone(), inner);
                let off = |j: usize, k: usize| {
                    let (a, b) = (free.node(j, k), prescribed.node(j, k));
                    (0..3).map(|c| (a[c] - b[c]).abs()).fold(0.0, f64::max)
                };
                let all = (0..60).flat_map(|k| (0..MARKERS).map(move |j| (j, k)));
                let most = all.map(|(j, k)| off(j, k)).fold(0.0, f64::max);
                println!("{scheme:?}, {dimension:?}, {inner:?}: {most:.1e} m apart");
                // Prescribed motion equal to the free one adds errors of the tolerance only.
                assert!(most < 1e-9, "{scheme:?}, {dimension:?}, {inner:?}: {most:e}");
            }
        }
    }
}

const LENGTH: f64 = 0.4;
const RADIUS: f64 = 2e-3;
const MODULUS: f64 = 1e7;
const DENSITY: f64 = 1000.0;
/// rad/s about the rod.
const SPIN: f64 = 0.5;
/// s.
const STEP: f64 = 1e-4;

/// Simulates a straight rod that spins about its axis between two grippers, free to turn in those at the ends `free_twist`.
/// Returns kinetic energy, J, and the torques of both grippers, N m, at the start and after each of 150 steps.
fn spinning(free_twist: &[End]) -> Vec<(f64, [f64; 2])> {
    let (markers, times) = (5, vec![0.0, 1.0]);
    let place = |j: usize| Some([LENGTH * j as f64 / (markers - 1) as f64, 0.0, 0.0]);
    let seen = |j: usize| (j.to_string(), times.iter().map(|_| place(j)).collect());
    let track = Track::new(times.clone(), (0..markers).map(seen).collect()).unwrap();
    let material = Material { poisson_ratio: Some(0.5), ..Material::new(DENSITY, MODULUS) };
    let mut scene = straight_rod(80, [LENGTH, RADIUS], material);
    scene.rod.dimension = Dimension::Spatial;
    scene.initial.state = InitialState::Equilibrium;
    scene.initial.angular_velocity = [SPIN, 0.0, 0.0];
    (scene.supports.start, scene.supports.end) = (Support::Recorded, Support::Recorded);
    scene.supports.path = Some(Recorded { free_twist: free_twist.to_vec(), ..Recorded::of(track) });
    let scheme = Scheme::GeneralisedAlpha;
    scene.time = Some(Time { scheme, ..Time::new(150.0 * STEP, STEP) });
    let problem = scene.problem().unwrap();
    let mut run = Trajectory::new(&problem, &[], &[]).unwrap().keep_reactions().keep_energies();
    run.run(&problem, 150, |_| {}).unwrap();
    let torques = run.reactions().into_iter().map(|r| [r.start.moment[0], r.end.moment[0]]);
    run.energies().iter().map(|e| e.kinetic).zip(torques).collect()
}

/// An end that turns freely bears no torque; between two of them a rod spins on. A gripper stops its end with the torque of a
/// wave, `GJ w/c`, until the wave returns from the free end or meets that of the other gripper.
#[test]
fn rod_between_grippers_with_free_twist_keeps_spinning() {
    let polar = PI * RADIUS.powi(4) / 2.0;
    let (inertia, rigidity) = (DENSITY * polar, MODULUS / 3.0 * polar);
    let speed = (rigidity / inertia).sqrt();
    for free_twist in [&[][..], &[End::Start], &[End::End], &[End::Start, End::End]] {
        let steps = spinning(free_twist);
        // Hands hold twenty edges each.
        let free = free_twist.len();
        let spins = LENGTH * [0.5, 0.75, 1.0][free];
        let begun = steps[0].0 / (0.5 * inertia * SPIN * SPIN * spins);
        println!("{free_twist:?}: {begun:.6} of the energy of what spins");
        // Kinetic energy of the spinning part, `I w^2/2` per length.
        assert!((begun - 1.0).abs() < 1e-9, "{begun}");
        for (k, (kinetic, torques)) in steps.iter().enumerate() {
            if free == 2 {
                // Between two free ends the rod spins on without loss.
                assert!((kinetic / steps[0].0 - 1.0).abs() < 1e-9, "{k}: {kinetic:e}");
            }
            for (end, torque) in [End::Start, End::End].into_iter().zip(torques) {
                let lets = free_twist.contains(&end);
                // A free end bears no torque.
                assert!(!lets || torque.abs() < 1e-12 * rigidity * SPIN, "{end:?} {torque:e}");
            }
        }
        for (side, end) in [End::Start, End::End].into_iter().enumerate() {
            if free_twist.contains(&end) {
                continue;
            }
            let lasts = spins / speed * [1.0, 2.0][free];
            let seen = &steps[1..(0.9 * lasts / STEP) as usize];
            let mean = seen.iter().map(|(_, torques)| torques[side].abs()).sum::<f64>();
            let part = mean / seen.len() as f64 / (rigidity * SPIN / speed);
            println!("{end:?} stops it with {part:.3} of the wave's torque");
            // Torque of a torsional wave, `G J w/c`.
            assert!((part - 1.0).abs() < 0.03, "{end:?}: {part}");
        }
    }
}

/// Invalid prescribed motions are rejected: inner markers that do not exist or are held already, no free node, no motion at
/// all, free twist of an end without a recording or with a prescribed twist, and an unsupported scheme.
#[test]
fn invalid_prescribed_motion_is_rejected() {
    let error = |change: &dyn Fn(&mut Scene)| {
        let mut scene = cable(recorded(1, 10, 0.0, |_| {}));
        scene.rod.dimension = Dimension::Spatial;
        scene.material.poisson_ratio = Some(0.4);
        change(&mut scene);
        scene.problem().err().map(|error| error.to_string())
    };
    fn inner(scene: &mut Scene, names: &[&str]) {
        let path = scene.supports.path.as_mut().unwrap();
        path.inner = names.iter().map(|name| (*name).into()).collect();
    }
    fn free_twist(scene: &mut Scene, ends: &[End]) {
        scene.supports.path.as_mut().unwrap().free_twist = ends.to_vec();
    }
    assert_eq!(error(&|scene| inner(scene, &["3", "2"])), None);
    assert_eq!(error(&|scene| free_twist(scene, &[End::End])), None);
    let only_inner = |scene: &mut Scene| {
        (scene.supports.start, scene.supports.end) = (Support::Clamped, Support::Free);
        scene.supports.clamp = rodfit::scene::Clamp::Nodes;
    };
    assert_eq!(error(&|scene| (only_inner(scene), inner(scene, &["3"])).1), None);
    for (change, words) in [
        (
            &(|scene: &mut Scene| inner(scene, &["ring"])) as &dyn Fn(&mut Scene),
            r#"supports.path.inner: found "ring", which is not a marker between the supports, allowed: some of ["2", "3", "4"]"#,
        ),
        (&|scene| inner(scene, &["1"]), "supports.path.inner: found \"1\""),
        (&|scene| inner(scene, &["4", "3", "2"]), "leaves no node free"),
        (
            &|scene| (only_inner(scene), inner(scene, &["1"])).1,
            r#"allowed: some of ["2", "3", "4", "5", "6"]"#,
        ),
        (&|scene| only_inner(scene), "supports.path: found a recording that prescribes no motion"),
        (
            &|scene| {
                scene.supports.start = Support::Clamped;
                free_twist(scene, &[End::Start]);
            },
            "supports.path.free_twist: found \"start\", whose motion is not recorded",
        ),
        (
            &|scene| {
                free_twist(scene, &[End::Start]);
                scene.supports.motion =
                    vec![Motion { end: End::Start, twist: 0.1, ..Motion::default() }];
            },
            "supports.motion[0].twist: found a twist of an end with free twist",
        ),
        (
            &|scene| {
                inner(scene, &["3"]);
                scene.time = Some(Time { scheme: Scheme::Verlet, ..Time::new(0.05, 1e-5) });
                scene.loads.damping.stiffness = 0.0;
            },
            "with the scheme verlet",
        ),
    ] {
        let error = error(change).unwrap_or_default();
        assert!(error.contains(words), "{error:?} for {words}");
    }
}

/// A rod longer than the line of markers in a coordinate plane can reach another equilibrium only out of that plane. It finds the
/// same shape as a rod whose markers are in an inclined plane, where rounding errors lead it out.
#[test]
fn long_rod_in_an_axis_plane_has_recorded_start() {
    // Along, up, and how far out of the plane the nodes start.
    let start = |seed: u64, turn: f64, (longer, segments): (f64, usize), inner: &[&str]| {
        let flat = recorded(seed, 12, 0.0, |_| {});
        let (sin, cos) = turn.sin_cos();
        let seen = |j: usize| {
            let at = |t: &f64| {
                let [x, y, _]: [f64; 3] = flat.markers()[j].at(*t);
                Some([x * cos, x * sin, y])
            };
            (j.to_string(), flat.times().iter().map(at).collect())
        };
        let track = Track::new(flat.times().to_vec(), (0..MARKERS).map(seen).collect()).unwrap();
        let mut scene = cable(track.clone());
        let length = longer * 0.42;
        scene.rod.shape = Shape::Straight { length, direction: [1.0, 0.0, 0.0] };
        (scene.rod.segments, scene.rod.dimension) = (Some(segments), Dimension::Spatial);
        scene.material.poisson_ratio = Some(0.4);
        scene.loads.gravity = [0.0, 0.0, -9.8];
        let inner = inner.iter().map(|name| (*name).into()).collect();
        scene.supports.path = Some(Recorded { inner, ..Recorded::of(track) });
        let run = scene.problem().unwrap().simulate().unwrap();
        let node = |j: usize| {
            let [x, y, z] = run.node(j, 0);
            [cos * x + sin * y, z, (cos * y - sin * x).abs()]
        };
        (0..=segments).map(node).collect::<Vec<[f64; 3]>>()
    };
    for (rod, inner) in [((1.03, 12), &["2", "4"][..]), ((1.2, 24), &[])] {
        for seed in [0, 2] {
            let [along, askew] = [0.0, 0.3].map(|turn| start(seed, turn, rod, inner));
            let apart = along.iter().flatten().zip(askew.iter().flatten());
            let apart = apart.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            let out = along.iter().map(|[.., out]| *out).fold(0.0, f64::max);
            println!("{rod:?}, {seed}: {apart:.1e} m apart, {out:.1e} m out of the plane");
            // Both starts find the same shape.
            assert!(apart < 1e-8, "{rod:?}, {seed}: {apart:e}");
        }
    }
}
