//! Rods whose ends follow recorded positions and rotations of grippers: their motion by every number.

use rodfit::Parameter;
use rodfit::scene::{
    End, GripperFrame, Initial, InitialState, Motion, Scene, Scheme, Support, Track,
};

use crate::common::poses::{driven, gripper, quaternion, times};
use crate::recorded::check;

/// A gripper that moves and turns about all axes, at a distance from the origin, m.
pub fn hand(x: f64, turn: f64) -> Track {
    gripper(&times(30, 0.01), |t| GripperFrame {
        position: [x + 0.03 * (8.0 * t).sin(), 0.2 - 0.05 * t, 0.02 * (7.0 * t).cos()],
        quaternion: quaternion([turn * (6.0 * t).cos(), 0.3 + turn * t, turn * (9.0 * t).sin()]),
    })
}

/// The curved cable of recorded ends, held by two grippers with offsets, or by one at its start or its end.
fn scene(scheme: Scheme, ends: &[End]) -> Scene {
    let mut scene = crate::recorded::scene(false, scheme);
    scene.supports.path = None;
    let is_held = |end| if ends.contains(&end) { Support::Clamped } else { Support::Free };
    (scene.supports.start, scene.supports.end) = (is_held(End::Start), is_held(End::End));
    let motion = |end: &End| {
        let track = match end {
            End::Start => hand(0.1, 0.3),
            End::End => hand(0.5, -0.4),
        };
        let mut motion = driven(*end, track);
        let pose = motion.pose.as_mut().unwrap();
        pose.offset = [0.01, -0.02, 0.03];
        pose.rotation = [0.2, -0.1, 0.3];
        motion
    };
    scene.supports.motion = ends.iter().map(motion).collect();
    // One with a constant twist in addition.
    scene.supports.motion[0].twist = 0.2;
    let state = if ends.len() == 2 { InitialState::Equilibrium } else { InitialState::Rest };
    scene.initial = Initial { state, ..Initial::default() };
    if ends.len() < 2 {
        scene.supports.motion[0].twist = 0.0;
        let twist = Motion { end: ends[0], twist: 0.3, ramp: Some(0.05), ..Motion::default() };
        scene.supports.motion.push(twist);
    }
    scene
}

/// Offset and rotation of the rod in the gripper are numbers, with derivatives as those of the rod.
#[test]
fn derivatives_with_posed_ends_equal_differences() {
    for scheme in [Scheme::GeneralisedAlpha, Scheme::NewmarkBeta, Scheme::AverageVectorField] {
        for ends in [&[End::Start, End::End][..], &[End::Start], &[End::End]] {
            let scene = scene(scheme, ends);
            let all = Parameter::all(&scene);
            let of_pose = all.iter().filter(|own| own.path().contains(".pose.")).count();
            assert_eq!(of_pose, 6 * ends.len());
            println!("{scheme:?}, {ends:?}");
            let smooth = scheme != Scheme::AverageVectorField;
            assert!(check(&scene.problem().unwrap(), smooth) >= 6 * ends.len() + 6);
        }
    }
}
