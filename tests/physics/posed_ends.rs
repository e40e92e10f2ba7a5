//! Rods whose ends follow the recorded position and rotation of grippers.

use rodfit::scene::{
    Clamp, Dimension, End, GripperFrame, InitialState, Material, Motion, Recorded, Scene, Scheme,
    StepTolerance, Support, Time, Track,
};
use rodfit::{Reactions, Trajectory};
use std::f64::consts::PI;

use crate::common::poses::{driven, gripper, product, quaternion, rotated, times};
use crate::common::straight_rod;

const LENGTH: f64 = 0.4;
const RADIUS: f64 = 2e-3;
const MODULUS: f64 = 1e7;
/// Poisson's ratio.
const RATIO: f64 = 0.4;

/// A straight rod in space without weight, clamped at both ends, in equilibrium at t = 0.
fn rod(segments: usize, scheme: Scheme, time: [f64; 2]) -> Scene {
    let material = Material { poisson_ratio: Some(RATIO), ..Material::new(1000.0, MODULUS) };
    let mut scene = straight_rod(segments, [LENGTH, RADIUS], material);
    scene.rod.dimension = Dimension::Spatial;
    scene.initial.state = InitialState::Equilibrium;
    (scene.supports.start, scene.supports.end) = (Support::Clamped, Support::Clamped);
    let [end, step] = time;
    scene.time = Some(Time { scheme, tolerance: StepTolerance::Rounding, ..Time::new(end, step) });
    scene
}

/// The run with reactions and energies of all steps.
fn run(scene: &Scene) -> Trajectory {
    let problem = scene.problem().unwrap();
    let nodes: Vec<usize> = (0..problem.nodes()).collect();
    let run = Trajectory::new(&problem, &nodes, &[]).unwrap();
    let mut run = run.keep_reactions().keep_energies();
    run.run(&problem, problem.time().unwrap().steps(), |_| {}).unwrap();
    run
}

/// Largest distance of nodes of two runs at the same times, m, after `map` of those of the first.
fn apart(a: &Trajectory, b: &Trajectory, map: impl Fn([f64; 3]) -> [f64; 3]) -> f64 {
    let mut largest = 0.0_f64;
    for k in 0..a.times().len() {
        for i in 0..a.nodes() {
            let (x, y) = (map(a.node(i, k)), b.node(i, k));
            largest = (0..3).map(|c| (x[c] - y[c]).abs()).fold(largest, f64::max);
        }
    }
    largest
}

/// Two grippers that move and turn about all axes.
fn hands(times: &[f64]) -> [Vec<GripperFrame>; 2] {
    let frames = |at: &dyn Fn(f64) -> ([f64; 3], [f64; 3])| {
        let frame = |t: &f64| {
            let (position, rotation) = at(*t);
            GripperFrame { position, quaternion: quaternion(rotation) }
        };
        times.iter().map(frame).collect::<Vec<_>>()
    };
    let (s, c) = (|w: f64, t: f64| (w * t).sin(), |w: f64, t: f64| (w * t).cos());
    [
        frames(&|t| {
            ([0.02 * s(5.0, t), 0.3, 0.01 * c(4.0, t)], [1.5 * s(4.0, t), 0.3, 0.2 * s(6.0, t)])
        }),
        frames(&|t| {
            ([0.35, 0.3 + 0.03 * s(5.0, t), 0.0], [0.2, 0.4 * c(5.0, t), -2.0 * s(3.0, t)])
        }),
    ]
}

/// Both grippers as motions of the ends.
fn both(times: &[f64], frames: [Vec<GripperFrame>; 2]) -> Vec<Motion> {
    let ends = [End::Start, End::End].into_iter().zip(frames);
    let motion = |(end, frames): (End, Vec<GripperFrame>)| {
        let poses: Vec<_> = frames.into_iter().map(Some).collect();
        driven(end, Track::of_poses(times.to_vec(), &poses).unwrap())
    };
    ends.map(motion).collect()
}

/// The torque of a rod whose gripper is turned about it by an angle is `GJ angle/L`, also beyond half a turn with a stated
/// twist.
#[test]
fn torque_of_a_turned_gripper_equals_the_closed_form() {
    let rigidity = MODULUS / (2.0 * (1.0 + RATIO)) * PI * RADIUS.powi(4) / 2.0;
    for clamp in [Clamp::MidEdge, Clamp::Nodes] {
        for (angle, twist) in [(0.4, 0.0), (-2.5, 0.0), (3.1, 2.0 * PI)] {
            let mut scene = rod(12, Scheme::NewmarkBeta, [0.02, 0.01]);
            scene.supports.clamp = clamp;
            let times = times(4, 0.01);
            let still = |x: f64, angle: f64| {
                let frame = GripperFrame {
                    position: [0.1, -x, 0.2],
                    // The tangent is -y in the world.
                    quaternion: product(
                        quaternion([0.0, 0.0, -PI / 2.0]),
                        quaternion([angle, 0.0, 0.0]),
                    ),
                };
                gripper(&times, |_| frame)
            };
            let end = Motion { twist, ..driven(End::End, still(LENGTH, angle)) };
            scene.supports.motion = vec![driven(End::Start, still(0.0, 0.0)), end];
            // At nodes the rod is an edge shorter.
            let free = LENGTH * if clamp == Clamp::Nodes { 11.0 / 12.0 } else { 1.0 };
            let exact = rigidity * (angle + twist) / free;
            let [start, end] = {
                let Reactions { start, end } = run(&scene).reactions()[0];
                [start.moment, end.moment]
            };
            println!("{clamp:?}, {angle}, {twist}: {start:?} {end:?}, exact {exact:e}");
            // The moment of the end is along the tangent.
            for (found, exact) in [(start, exact), (end, -exact)] {
                assert!((found[1] - exact).abs() < 1e-9 * exact.abs(), "{angle} {twist}");
                assert!(found[0].hypot(found[2]) < 1e-9 * exact.abs(), "{angle} {twist}");
            }
        }
    }
}

/// A rotation of both grippers and of gravity rotates the motion. So do other axes of the grippers and offsets in them that
/// describe the same ends.
#[test]
fn rotated_grippers_rotate_the_motion() {
    for scheme in [Scheme::GeneralisedAlpha, Scheme::NewmarkBeta, Scheme::AverageVectorField] {
        let times = times(50, 0.01);
        let mut scene = rod(12, scheme, [0.3, 0.01]);
        scene.loads.gravity = [0.0, -9.8, 0.0];
        // Steps without ringing of the edges.
        scene.loads.damping.stiffness = 2e-3;
        scene.supports.motion = both(&times, hands(&times));
        let before = run(&scene);
        let turn = quaternion([1.2, -0.7, 2.1]);
        let moved = |x: [f64; 3]| {
            let x = rotated(turn, x);
            [x[0] + 0.3, x[1] - 0.1, x[2] + 0.5]
        };
        let rotate = |frame: GripperFrame| GripperFrame {
            position: moved(frame.position),
            quaternion: product(turn, frame.quaternion),
        };
        let frames = hands(&times).map(|own| own.into_iter().map(rotate).collect());
        let mut rotated_scene = scene.clone();
        rotated_scene.loads.gravity = rotated(turn, scene.loads.gravity);
        rotated_scene.supports.motion = both(&times, frames);
        let off = apart(&before, &run(&rotated_scene), moved);
        println!("{scheme:?}: {off:.1e} m apart");
        assert!(off < 1e-9, "{scheme:?}: {off:e}");
        // The same ends by grippers with other axes: x of the rod is z of the gripper, 0.1 m before it and turned. The
        // grippers are beside the ends, so that paths between frames differ; steps end at frames.
        let arm = [0.02, -0.01, 0.1];
        let inner = quaternion([0.3, 0.1, -0.2]);
        // Columns z, x, y: a third of a turn about (1, 1, 1), from the axes of the rod to those of the gripper.
        let mount = product(inner, quaternion([-2.0 * PI / 3.0 / 3.0_f64.sqrt(); 3]));
        let conjugate = |[w, x, y, z]: [f64; 4]| [w, -x, -y, -z];
        let remount = |frame: GripperFrame| {
            let own = product(frame.quaternion, conjugate(mount));
            let arm = rotated(own, arm);
            let position = std::array::from_fn(|c| frame.position[c] - arm[c]);
            GripperFrame { position, quaternion: own }
        };
        let frames = hands(&times).map(|own| own.into_iter().map(remount).collect());
        let mut mounted = scene.clone();
        mounted.supports.motion = both(&times, frames);
        for motion in &mut mounted.supports.motion {
            let pose = motion.pose.as_mut().unwrap();
            pose.axes = Some(["z", "x", "y"].map(String::from).to_vec().try_into().unwrap());
            (pose.offset, pose.rotation) = (arm, [0.3, 0.1, -0.2]);
        }
        let off = apart(&before, &run(&mounted), |x| x);
        println!("{scheme:?}, other axes: {off:.1e} m apart");
        assert!(off < 1e-9, "{scheme:?}: {off:e}");
    }
}

/// The quaternions q and -q are one rotation: exchanging them changes nothing, not even a rounding error.
#[test]
fn sign_of_a_quaternion_does_not_change_the_motion() {
    let times = times(50, 0.01);
    let run_with = |sign: fn(usize) -> f64| {
        let mut scene = rod(8, Scheme::GeneralisedAlpha, [0.2, 0.01]);
        let mut frames = hands(&times);
        for own in &mut frames {
            for (k, frame) in own.iter_mut().enumerate() {
                frame.quaternion = frame.quaternion.map(|c| c * sign(k));
            }
        }
        scene.supports.motion = both(&times, frames);
        run(&scene)
    };
    let (plain, signed) = (run_with(|_| 1.0), run_with(|k| if k % 3 == 1 { -1.0 } else { 1.0 }));
    assert_eq!(apart(&plain, &signed, |x| x), 0.0);
}

/// A gripper that turns by one and a half turns about the rod moves it as a twist with a ramp does: the quaternions at the
/// frames, which are the steps, have the same angles.
#[test]
fn gripper_that_turns_beyond_a_full_turn_equals_a_ramp_of_twist() {
    let (ramp, twist) = (0.3, 3.0 * PI);
    let mut scene = rod(12, Scheme::GeneralisedAlpha, [0.35, 2e-3]);
    scene.loads.gravity = [0.0, -1.0, 0.0];
    scene.loads.damping.stiffness = 5e-3;
    let mut ramped = scene.clone();
    ramped.supports.motion =
        vec![Motion { end: End::End, twist, ramp: Some(ramp), ..Motion::default() }];
    let angle = |t: f64| {
        let u = (t / ramp).min(1.0);
        twist * u.powi(3) * (10.0 - 15.0 * u + 6.0 * u * u)
    };
    let track = gripper(&times(200, 2e-3), |t| GripperFrame {
        position: [LENGTH, 0.0, 0.0],
        quaternion: quaternion([angle(t), 0.0, 0.0]),
    });
    scene.supports.motion = vec![driven(End::End, track)];
    let (ramped, posed) = (run(&ramped), run(&scene));
    let last = |run: &Trajectory| run.reactions().last().unwrap().end.moment[0];
    println!("torques {:e}, {:e} N m", last(&ramped), last(&posed));
    assert!((last(&posed) / last(&ramped) - 1.0).abs() < 1e-8);
    let off = apart(&ramped, &posed, |x| x);
    println!("{off:.1e} m apart");
    assert!(off < 1e-9, "{off:e}");
}

/// Grippers that turn about one axis without twist: two markers on each gripper, an edge apart, and its pose describe the same
/// motion. Steps end at frames. Between frames, which enter no step, the distance of two interpolated markers changes.
#[test]
fn ends_driven_by_poses_equal_ends_driven_by_two_markers() {
    let segments = 16;
    let edge = LENGTH / segments as f64;
    let times = times(50, 0.01);
    let start = |t: f64| ([0.02 * (5.0 * t).sin(), 0.0, 0.0], 0.5 * (4.0 * t).sin());
    let end = |t: f64| ([0.37, 0.02 * (3.0 * t).sin(), 0.0], -0.3 - 0.4 * (5.0 * t).sin());
    let along = |angle: f64| [angle.cos(), angle.sin(), 0.0];
    for scheme in [Scheme::GeneralisedAlpha, Scheme::NewmarkBeta] {
        let mut scene = rod(segments, scheme, [0.4, 0.01]);
        scene.supports.clamp = Clamp::Nodes;
        scene.loads.gravity = [0.0, -9.8, 0.0];
        scene.loads.damping.stiffness = 2e-3;
        let mut marked = scene.clone();
        let posed = |at: &dyn Fn(f64) -> ([f64; 3], f64)| {
            gripper(&times, |t| {
                let (position, angle) = at(t);
                GripperFrame { position, quaternion: quaternion([0.0, 0.0, angle]) }
            })
        };
        scene.supports.motion =
            vec![driven(End::Start, posed(&start)), driven(End::End, posed(&end))];
        let place = |j: usize, t: f64| -> [f64; 3] {
            let ((x0, a0), (x1, a1)) = (start(t), end(t));
            let [t0, t1] = [along(a0), along(a1)];
            let inner = [0, 1, 2].map(|c| [x0[c] + edge * t0[c], x1[c] - edge * t1[c]]);
            match j {
                0 => x0,
                j if j == segments => x1,
                j => {
                    let part = (j - 1) as f64 / (segments - 2) as f64;
                    inner.map(|[a, b]| (1.0 - part) * a + part * b)
                }
            }
        };
        let seen = |j: usize| times.iter().map(|t| Some(place(j, *t))).collect();
        let markers = (0..=segments).map(|j| (j.to_string(), seen(j))).collect();
        let track = Track::new(times.clone(), markers).unwrap();
        (marked.supports.start, marked.supports.end) = (Support::Recorded, Support::Recorded);
        marked.supports.path = Some(Recorded::of(track));
        let off = apart(&run(&marked), &run(&scene), |x| x);
        println!("{scheme:?}: {off:.1e} m apart");
        assert!(off < 1e-9, "{scheme:?}: {off:e}");
    }
}

/// The energy of a rod changes by the work of its grippers, `F v + M w` over time. Second derivatives of the cubics between
/// frames, and with them inertial reactions, have errors of first order in the time between frames, and so has the balance.
#[test]
fn work_of_grippers_changes_the_energy_to_first_order_in_the_frames() {
    let defect = |step: f64| {
        let mut scene = rod(8, Scheme::NewmarkBeta, [0.2, step]);
        scene.supports.clamp = Clamp::Nodes;
        // The steps, which end at frames, resolve the axial waves. Each gripper turns about an axis, rad/s, and moves along another.
        let [turn, way] = [[0.6, 0.3, -0.2], [0.02, -0.03, 0.01]];
        let frequency = 15.0;
        let at = |sign: f64, x: f64| {
            gripper(&times((0.25 / step) as u32, step), move |t| {
                let part = sign * (1.0 - (frequency * t).cos()).powi(2);
                let position = [x + way[0] * part, way[1] * part, way[2] * part];
                GripperFrame { position, quaternion: quaternion(turn.map(|c| c * part)) }
            })
        };
        scene.supports.motion =
            vec![driven(End::Start, at(1.0, 0.0)), driven(End::End, at(-1.0, 0.38))];
        let run = run(&scene);
        let (energies, reactions, times) = (run.energies(), run.reactions(), run.times());
        let power = |k: usize| {
            let phase = frequency * times[k];
            let rate = 2.0 * frequency * (1.0 - phase.cos()) * phase.sin();
            let of = |sign: f64, [force, moment]: [[f64; 3]; 2]| {
                let parts = (0..3).map(|c| force[c] * way[c] + moment[c] * turn[c]);
                sign * rate * parts.sum::<f64>()
            };
            let Reactions { start, end } = reactions[k];
            of(1.0, [start.force, start.moment]) + of(-1.0, [end.force, end.moment])
        };
        // The energies are those of the free nodes; grippers move two nodes each.
        let problem = scene.problem().unwrap();
        let mass = problem.spatial().unwrap().rod().mass;
        let energy = |k: usize| {
            let held = [0, 1, 7, 8].map(|i| {
                let v = run.velocity(i, k);
                0.5 * mass[4 * i] * v.iter().map(|c| c * c).sum::<f64>()
            });
            energies[k].total() + held.iter().sum::<f64>()
        };
        let mut work = energy(0);
        let mut largest = 0.0_f64;
        for k in 1..times.len() {
            work += 0.5 * (times[k] - times[k - 1]) * (power(k - 1) + power(k));
            largest = largest.max((energy(k) - work).abs());
        }
        let changes = (0..times.len()).map(|k| (energy(k) - energy(0)).abs());
        let most = changes.fold(0.0, f64::max);
        largest / most
    };
    let [coarse, fine] = [2e-4, 1e-4].map(defect);
    println!("defect {coarse:.2e}, {fine:.2e} of the largest change");
    assert!(coarse < 5e-3 && coarse / fine > 1.8, "{coarse:e} {fine:e}");
}
