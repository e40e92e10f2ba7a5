//! Statics and modes with recorded supports: nodes held between the ends, and grippers with free twist, against beam theory.

use rodfit::Problem;
use rodfit::scene::{
    Dimension, End, InitialState, Material, Motion, Recorded, Scene, Scheme, Shape, Support, Time,
    Track,
};
use rodfit::vibration::{LinearizationPoint, ModeKind};
use std::f64::consts::PI;

use crate::common::straight_rod;

const LENGTH: f64 = 0.5;
const MODULUS: f64 = 1e8;
const DENSITY: f64 = 1000.0;
const RADIUS: f64 = 5e-3;

/// Fixed markers, evenly along the rod; the middle one is offset by `beside`, m.
fn still(markers: usize, beside: f64) -> Track {
    let times = vec![0.0, 0.1, 0.2];
    let place = |j: usize| {
        let y = if 2 * j + 1 == markers { beside } else { 0.0 };
        [LENGTH * j as f64 / (markers - 1) as f64, y, 0.0]
    };
    let seen = |j: usize| (j.to_string(), times.iter().map(|_| Some(place(j))).collect());
    Track::new(times.clone(), (0..markers).map(seen).collect()).unwrap()
}

/// A straight rod with G = E/3.
fn rod(segments: usize, dimension: Dimension) -> Scene {
    let material = Material { poisson_ratio: Some(0.5), ..Material::new(DENSITY, MODULUS) };
    let mut scene = straight_rod(segments, [LENGTH, RADIUS], material);
    scene.rod.dimension = dimension;
    scene.initial.state = InitialState::Equilibrium;
    scene
}

/// A rod on hinges at its ends and a held node in the middle, offset by `beside`, m.
fn two_spans(segments: usize, dimension: Dimension, beside: f64, gravity: f64) -> Problem {
    let mut scene = rod(segments, dimension);
    (scene.supports.start, scene.supports.end) = (Support::Pinned, Support::Pinned);
    scene.supports.path =
        Some(Recorded { inner: vec!["1".into()], ..Recorded::of(still(3, beside)) });
    scene.loads.gravity = [0.0, -gravity, 0.0];
    scene.problem().unwrap()
}

fn bending_stiffness() -> f64 {
    MODULUS * PI * RADIUS.powi(4) / 4.0
}

/// Two equal spans vibrate as one span on two hinges where they go against each other, and as one between a wall and a
/// hinge where they go alike.
#[test]
fn rod_held_in_its_middle_has_the_frequencies_of_two_spans() {
    let unit = (MODULUS * RADIUS * RADIUS / (4.0 * DENSITY)).sqrt() / (0.5 * LENGTH).powi(2);
    let roots = [PI, 3.92660231, 2.0 * PI, 7.06858275];
    for dimension in [Dimension::Planar, Dimension::Spatial] {
        let errors = [60, 120].map(|segments| {
            let problem = two_spans(segments, dimension, 0.0, 0.0);
            // And a spin about itself.
            let modes = problem.modes(9, LinearizationPoint::Equilibrium);
            let mut found: Vec<f64> = (modes.unwrap().modes.iter())
                .filter(|mode| mode.kind == ModeKind::Bending)
                .map(|mode| mode.frequency_rad_s)
                .collect();
            found.sort_by(f64::total_cmp);
            // In the plane and out of it alike.
            (0..4).for_each(|k| assert!((found[2 * k + 1] / found[2 * k] - 1.0).abs() < 1e-6));
            [0, 1, 2, 3].map(|k| found[2 * k] / (roots[k] * roots[k] * unit) - 1.0)
        });
        println!("{dimension:?}: {errors:?}");
        for k in 0..4 {
            // The slender rod of the theory has no axial and no rotational inertia.
            assert!(errors[1][k].abs() < 4e-3, "{errors:?}");
            assert!((errors[0][k] / errors[1][k]).log2() > 1.7 || errors[1][k].abs() < 2e-4);
        }
    }
}

/// Each outer hinge carries 3/8 of the weight of its span, which sags by `w l^4/(192 EI)` halfway; and a beam whose
/// middle is `d` beside its line presses on each of them with `24 EI d/L^3`.
#[test]
fn rod_held_in_its_middle_has_the_reactions_of_two_spans() {
    let (gravity, d, span) = (0.5, 1e-4, 0.5 * LENGTH);
    let weight = DENSITY * PI * RADIUS * RADIUS * gravity;
    for dimension in [Dimension::Planar, Dimension::Spatial] {
        let hanging = two_spans(120, dimension, 0.0, gravity).equilibrium().unwrap();
        let carried = 0.375 * weight * span;
        let sag = weight * span.powi(4) / (192.0 * bending_stiffness());
        let [start, end] = [hanging.reactions.start, hanging.reactions.end].map(|r| r.force[1]);
        println!("{dimension:?}: {start:.6} {end:.6} for {carried:.6} N");
        // 3/8 of the weight of a span at its outer hinge, and symmetry.
        assert!((start / carried - 1.0).abs() < 1e-3 && (start / end - 1.0).abs() < 1e-6);
        // Sag halfway, `w l^4/(192 EI)`.
        assert!((-hanging.nodes[30][1] / sag - 1.0).abs() < 5e-3, "{:e}", hanging.nodes[30][1]);
        assert_eq!((hanging.nodes[60], hanging.stable), ([span, 0.0, 0.0], Some(true)));
        let bent = two_spans(120, dimension, d, 0.0).equilibrium().unwrap();
        let pressed = -24.0 * bending_stiffness() * d / LENGTH.powi(3);
        let [start, end] = [bent.reactions.start, bent.reactions.end].map(|r| r.force[1]);
        println!("{dimension:?}: {start:.6} {end:.6} for {pressed:.6} N");
        // Force `24 EI d/L^3` of a beam whose middle is displaced.
        assert!((start / pressed - 1.0).abs() < 2e-3 && (start / end - 1.0).abs() < 1e-6);
        assert_eq!(bent.nodes[60], [span, d, 0.0]);
    }
}

/// A rod between two grippers with two markers each, ten edges apart, and free twist at some ends.
fn between_hands(free_twist: &[End]) -> Scene {
    let mut scene = rod(50, Dimension::Spatial);
    (scene.supports.start, scene.supports.end) = (Support::Recorded, Support::Recorded);
    scene.supports.path =
        Some(Recorded { free_twist: free_twist.to_vec(), ..Recorded::of(still(6, 0.0)) });
    scene
}

/// The reactions of grippers that hold eleven nodes each balance the weight, for any twist.
#[test]
fn gripper_reactions_balance_the_weight() {
    for free_twist in [&[][..], &[End::Start], &[End::Start, End::End]] {
        let mut scene = between_hands(free_twist);
        scene.loads.gravity = [0.0, -0.5, 0.2];
        let weight = DENSITY * PI * RADIUS * RADIUS * LENGTH;
        let reactions = scene.problem().unwrap().equilibrium().unwrap().reactions;
        for (c, pull) in [0.0, -0.5, 0.2].into_iter().enumerate() {
            let carried = reactions.start.force[c] + reactions.end.force[c];
            println!("{free_twist:?}: {carried:.9} N against {:.9} N", weight * pull);
            // Vertical equilibrium: rounding errors.
            assert!((carried + weight * pull).abs() < 1e-9 * weight, "{carried:e}");
        }
    }
}

/// Torsional waves extend to the edge that a gripper holds, or to the end of the rod if it turns freely in the gripper. Half
/// waves between two grippers, odd quarter waves with one free end, half waves of the whole rod with two.
#[test]
fn torsional_frequencies_depend_on_grippers_with_free_twist() {
    let (speed, edge) = ((MODULUS / 3.0 / DENSITY).sqrt(), LENGTH / 50.0);
    for (free_twist, wave, zeros) in [
        (&[][..], PI / (31.0 * edge), 0),
        (&[End::Start], 0.5 * PI / (40.5 * edge), 0),
        (&[End::End], 0.5 * PI / (40.5 * edge), 0),
        (&[End::Start, End::End], PI / LENGTH, 1),
    ] {
        let problem = between_hands(free_twist).problem().unwrap();
        let modes = problem.modes(40, LinearizationPoint::Equilibrium).unwrap().modes;
        let still = modes.iter().filter(|mode| mode.frequency_rad_s == 0.0).count();
        let torsion = modes.iter().find(|mode| mode.kind == ModeKind::Torsion).unwrap();
        let off = torsion.frequency_rad_s / (speed * wave) - 1.0;
        println!("{free_twist:?}: {still} free, torsion off by {off:.1e}");
        // Half waves or odd quarter waves of the free part, with the error of the mesh.
        assert!(off.abs() < 5e-4 && still == zeros, "{free_twist:?}: {off:e} {still}");
    }
}

/// Natural twist stores energy in a rod between two grippers, but not if the rod turns freely in one of them. Both grippers then
/// bear no torque.
#[test]
fn end_with_free_twist_bears_no_torque() {
    let twist = 3.0;
    let rigidity = MODULUS / 3.0 * PI * RADIUS.powi(4) / 2.0;
    for free_twist in [&[][..], &[End::Start], &[End::End], &[End::Start, End::End]] {
        let mut scene = between_hands(free_twist);
        scene.rod.natural_twist = twist.into();
        let rest = scene.problem().unwrap().equilibrium().unwrap();
        let torques = [rest.reactions.start, rest.reactions.end].map(|r| r.moment[0]);
        println!("{free_twist:?}: twist {:.3e} J, torques {torques:?}", rest.energies.twist);
        // Along all joints: those between held edges are wound up, too, unless they are let go.
        let wound = match free_twist {
            [] => 0.5 * rigidity * twist * twist * LENGTH * 49.0 / 50.0,
            [_] => 0.5 * rigidity * twist * twist * LENGTH * 9.0 / 50.0,
            _ => 0.0,
        };
        let size = rigidity * twist;
        // Energy of the natural twist in the part that cannot turn: 49 or 9 of 50 edges, or none.
        assert!((rest.energies.twist - wound).abs() < 1e-9 * size, "{:e}", rest.energies.twist);
        for (end, torque) in [End::Start, End::End].into_iter().zip(torques) {
            // What the held edges bear among each other adds up to nothing.
            let held = if free_twist.is_empty() { size } else { 0.0 };
            assert!((torque.abs() - held).abs() < 1e-9 * size, "{end:?} {torque:e}");
        }
    }
}

/// Twisted grippers apply the torque of a shaft as long as from the last held edge to the next one.
#[test]
fn twisted_grippers_apply_the_torque_of_a_shaft() {
    let shaft = MODULUS / 3.0 * PI * RADIUS.powi(4) / 2.0 / (31.0 * LENGTH / 50.0);
    let mut scene = between_hands(&[]);
    let motion = |end, twist| Motion { end, twist, ..Motion::default() };
    scene.supports.motion = vec![motion(End::Start, 0.2), motion(End::End, 0.9)];
    for state in [InitialState::Equilibrium, InitialState::Recorded] {
        scene.initial.state = state;
        let rest = scene.problem().unwrap().equilibrium().unwrap();
        let torques = [rest.reactions.start, rest.reactions.end].map(|r| r.moment[0]);
        println!("{:.9e} J, torques {torques:?}", rest.energies.twist);
        // A shaft with a stiffness `shaft` (N m/rad) that is twisted by 0.7 rad.
        assert!((rest.energies.twist / (0.5 * shaft * 0.7 * 0.7) - 1.0).abs() < 1e-9);
        assert!((torques[0] / (-0.7 * shaft) - 1.0).abs() < 1e-9, "{torques:?}");
        assert!((torques[1] / (0.7 * shaft) - 1.0).abs() < 1e-9, "{torques:?}");
    }
}

/// A damped run between fixed grippers ends at the static equilibrium. Both hold the curved rod at the rotation about its axis
/// that has the least energy along the first markers, plus the twist of the scene.
#[test]
fn damped_run_between_fixed_grippers_reaches_the_static_equilibrium() {
    let times: Vec<f64> = (0..=400).map(|k| 0.01 * f64::from(k)).collect();
    let place = |j: usize| {
        let u = j as f64 / 6.0;
        [0.42 * u, 0.0, 0.448 * u * (u - 1.0)]
    };
    let seen = |j: usize| (j.to_string(), times.iter().map(|_| Some(place(j))).collect());
    let track = Track::new(times.clone(), (0..7).map(seen).collect()).unwrap();
    let mut scene = rod(24, Dimension::Spatial);
    scene.rod.shape = Shape::Arc { length: LENGTH, angle: 1.0 };
    (scene.supports.start, scene.supports.end) = (Support::Recorded, Support::Recorded);
    scene.supports.path = Some(Recorded::of(track));
    scene.initial.state = InitialState::Recorded;
    scene.loads.gravity = [0.0, 0.0, -2.0];
    scene.loads.damping.mass = 20.0;
    scene.time = Some(Time { scheme: Scheme::GeneralisedAlpha, ..Time::new(4.0, 0.01) });
    for twist in [0.0, 0.6] {
        scene.supports.motion = vec![Motion { end: End::End, twist, ..Motion::default() }];
        let problem = scene.problem().unwrap();
        let (rest, run) = (problem.equilibrium().unwrap(), problem.simulate().unwrap());
        let last = run.times().len() - 1;
        let middle = problem.segments() / 2;
        let apart = (0..3).map(|c| run.node(middle, last)[c] - rest.nodes[middle][c]);
        let apart = apart.fold(0.0, |most: f64, x| most.max(x.abs()));
        println!("{twist}: {apart:.1e} m apart of {:?}", rest.nodes[middle]);
        // The damped motion ends at the static equilibrium.
        assert!(apart < 1e-9, "{apart:e}");
    }
}
