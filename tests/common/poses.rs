//! Recordings of grippers that turn about fixed axes.

use rodfit::scene::{End, GripperFrame, GripperPose, Motion, Track};

/// The quaternion of a rotation vector, rad.
pub fn quaternion(vector: [f64; 3]) -> [f64; 4] {
    let angle = vector.iter().map(|c| c * c).sum::<f64>().sqrt();
    let factor = if angle == 0.0 { 0.5 } else { (0.5 * angle).sin() / angle };
    let [x, y, z] = vector.map(|c| factor * c);
    [(0.5 * angle).cos(), x, y, z]
}

/// The rotation `b`, then `a`.
pub fn product([a, b, c, d]: [f64; 4], [w, x, y, z]: [f64; 4]) -> [f64; 4] {
    [
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
    ]
}

/// The vector `v` rotated by a unit quaternion.
pub fn rotated(q: [f64; 4], v: [f64; 3]) -> [f64; 3] {
    let [_, x, y, z] = product(product(q, [0.0, v[0], v[1], v[2]]), [q[0], -q[1], -q[2], -q[3]]);
    [x, y, z]
}

/// Times from 0 in steps of `step`, s, and one more than `frames` of them.
pub fn times(frames: u32, step: f64) -> Vec<f64> {
    (0..=frames).map(|k| f64::from(k) * step).collect()
}

/// A gripper at the frames of a recording.
pub fn gripper(times: &[f64], at: impl Fn(f64) -> GripperFrame) -> Track {
    let poses: Vec<_> = times.iter().map(|t| Some(at(*t))).collect();
    Track::of_poses(times.to_vec(), &poses).unwrap()
}

/// The motion of an end in a gripper whose axes are those of the rod.
pub fn driven(end: End, track: Track) -> Motion {
    let pose = Some(GripperPose::default());
    Motion { end, pose, track: Some(track.into()), ..Motion::default() }
}
