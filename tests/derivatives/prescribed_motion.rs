//! Rods with recorded nodes between the ends or with free twist of the ends: derivatives of their motion by every number.

use rodfit::scene::{
    Damping, End, Friction, Initial, InitialState, Maxwell, Motion, Point, PointForce, Recorded,
    Scene, Scheme, Support, Track,
};

use crate::recorded::{check, stream};

/// Markers as far apart as they are on the cable, on an arc between two hands that move; in the plane z stays 0.
fn track(planar: bool) -> Track {
    let times: Vec<f64> = (0..30).map(|k| 0.01 * f64::from(k)).collect();
    let place = |j: i32, t: f64| {
        let u = f64::from(j) / 6.0;
        let (angle, radius) = (2.0 * u - 1.0, 0.2537);
        let beside = if planar { 0.0 } else { 0.02 * (3.0 * t + u).sin() };
        let hand = 0.01 * (9.0 * t).sin() * (1.0 - u);
        [radius * angle.sin() + hand, -radius * angle.cos() + 0.02 * (7.0 * t).cos(), beside]
    };
    let seen = |j: i32| (format!("{j}"), times.iter().map(|t| Some(place(j, *t))).collect());
    Track::new(times.clone(), (0..7).map(seen).collect()).unwrap()
}

/// The cable, with what leads it beside its ends, and the ends that turn freely.
pub fn scene(planar: bool, scheme: Scheme, inner: &[&str], free_twist: &[End]) -> Scene {
    let mut scene = crate::recorded::scene(planar, scheme);
    scene.supports.path = Some(Recorded {
        inner: inner.iter().map(|name| (*name).to_string()).collect(),
        free_twist: free_twist.to_vec(),
        ..Recorded::of(track(planar))
    });
    scene
}

/// Ends whose twist nothing holds, and markers between the ends that lead the rod: one, and two beside each other.
#[test]
fn derivatives_with_free_twists_and_driven_nodes_equal_differences() {
    for scheme in [Scheme::GeneralisedAlpha, Scheme::NewmarkBeta, Scheme::AverageVectorField] {
        for (planar, inner, free_twist) in [
            (false, &[][..], &[End::Start][..]),
            (false, &[], &[End::End, End::Start]),
            (false, &["3"], &[]),
            (false, &["3", "2"], &[End::End]),
            (true, &["3"], &[]),
        ] {
            let scene = scene(planar, scheme, inner, free_twist);
            println!("{scheme:?}, planar: {planar}, {inner:?}, {free_twist:?}");
            let smooth = planar || scheme != Scheme::AverageVectorField;
            assert!(check(&scene.problem().unwrap(), smooth) >= 6);
        }
    }
}

/// All that makes forces, between a hand that turns the rod about itself and one that lets it turn.
#[test]
fn derivatives_with_driven_nodes_and_all_forces_equal_differences() {
    for scheme in [Scheme::GeneralisedAlpha, Scheme::NewmarkBeta] {
        for planar in [true, false] {
            for k in 0..4 {
                let free_twist = if planar { &[][..] } else { &[End::Start] };
                let mut scene = scene(planar, scheme, &["3"], free_twist);
                if !planar {
                    let motion = Motion { end: End::End, twist: 0.4, ..Motion::default() };
                    scene.supports.motion = vec![motion];
                }
                let damping = &mut scene.loads.damping;
                match k {
                    0 => *damping = Damping { mass: 0.4, bending: 2e-3, ..Damping::default() },
                    1 => damping.maxwell = Maxwell { stiffness: 0.7, time: 0.02 }.into(),
                    2 => damping.friction = Some(Friction { stiffness: 1.6, curvature: 50.0 }),
                    _ => scene.loads.drag = Some(stream(planar)),
                }
                println!("{scheme:?}, planar: {planar}, {k}");
                assert!(check(&scene.problem().unwrap(), true) >= 6);
            }
        }
    }
}

/// From an equilibrium, after a weight lets go of a cable that a hinge, or a hand, and a ring and a hand hold.
#[test]
fn derivatives_with_driven_nodes_from_equilibrium_equal_differences() {
    for scheme in [Scheme::GeneralisedAlpha, Scheme::NewmarkBeta] {
        for planar in [true, false] {
            for start in [Support::Pinned, Support::Recorded] {
                let state = InitialState::Equilibrium;
                let mut scene = scene(planar, scheme, &["3"], &[]);
                scene.supports.start = start;
                // A hand holds the turn about itself.
                scene.supports.end = Support::Recorded;
                scene.loads.damping.stiffness = 2e-2;
                let force = [0.0, -0.2, if planar { 0.0 } else { 0.1 }];
                let weight =
                    PointForce { node: Point::ArcLength(0.34), force, ..PointForce::default() };
                scene.initial = Initial { state, point: vec![weight], ..Initial::default() };
                println!("{scheme:?}, planar: {planar}, {start:?}");
                assert!(check(&scene.problem().unwrap(), true) >= 6);
            }
        }
    }
}

/// Inner nodes are where their markers are, at every step and half-way between frames, as fast as they go; the nodes
/// beside them are not.
#[test]
fn driven_nodes_follow_their_markers() {
    for scheme in [Scheme::GeneralisedAlpha, Scheme::NewmarkBeta, Scheme::AverageVectorField] {
        for planar in [true, false] {
            let problem = scene(planar, scheme, &["3", "2"], &[]).problem().unwrap();
            let run = problem.simulate().unwrap();
            let (track, edges) = (track(planar), problem.segments() / 6);
            let off = |marker: usize, k: usize| {
                let t = run.times()[k];
                let (found, seen) = (run.node(edges * marker, k), track.markers()[marker].at(t));
                (0..3).map(|c| (found[c] - seen[c]).abs()).fold(0.0, f64::max)
            };
            for k in 0..run.times().len() {
                for marker in [0, 1, 2, 3] {
                    assert!(off(marker, k) < 1e-15, "{scheme:?} {planar} {marker} {k}");
                }
            }
            assert!(off(4, run.times().len() - 1) > 1e-4);
        }
    }
}
