//! Detection of frames that repeat the previous one, as in a video that was converted to a higher frame rate.
//!
//! A repeated frame has the position of an earlier time. Fitted as a measurement it delays the motion and adds a
//! periodic residual that no noise model describes. Input: positions in the order of time. A frame repeats if its
//! position equals the one before while the marker moves. It moves if the step after it, or that before the equal pair,
//! exceeds in a coordinate [`COARSE_STEPS`] times its resolution, the step between neighboring distinct values. Frames
//! without a position do not count. Output: the number of repeated frames ([`count_repeated_frames`]).
//! [`is_converted_video`] returns whether it is more than [`LEAST_REPEATED`] of all frames. [`all_repeated_frames`]
//! lists the recorded motions of experiments (not planned ones) in which it is more than [`LEAST_REPEATED`] of all
//! frames, for warnings of the report.

use crate::fit::measurement::dataset::DataKind;
use crate::fit::measurement::experiment::{Experiment, all};
use crate::numerics::noise_scale::quantization_step;

/// Smallest step of a moving marker, over the resolution of its positions. With larger steps equal positions are no
/// rounding.
const COARSE_STEPS: f64 = 3.0;
/// Smallest fraction of repeated frames in a converted video. From 24 to 30 frames per second it is one of five.
const LEAST_REPEATED: f64 = 0.1;

/// An observation with the number of its repeated frames, for a warning.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct RepeatedFrames {
    /// The file, or the point.
    pub observation: String,
    /// Number of repeated frames.
    pub repeated: usize,
    /// Number of all frames.
    pub frames: usize,
}

/// The recorded motions of all experiments whose repeated frames are those of a converted video, with label and counts.
/// Planned ones are skipped.
pub(crate) fn all_repeated_frames(experiments: &[Experiment]) -> Vec<RepeatedFrames> {
    let found =
        all(experiments).filter_map(|(experiment, measurement)| {
            let positions = measurement.motion()?.positions();
            let (repeated, frames) = (count_repeated_frames(&positions), positions.len());
            (!measurement.planned() && is_converted_video(repeated, frames)).then(|| {
                RepeatedFrames { observation: experiment.label(measurement), repeated, frames }
            })
        });
    found.collect()
}

/// Whether `repeated` is more than [`LEAST_REPEATED`] of all `frames`: a video that was converted to a higher rate.
pub(crate) fn is_converted_video(repeated: usize, frames: usize) -> bool {
    repeated as f64 > LEAST_REPEATED * frames as f64
}

/// Number of frames whose position equals the previous one while the marker moves. It moves if the step after them, or
/// that before the equal pair, is larger in a coordinate than [`COARSE_STEPS`] times its resolution (the step between
/// neighboring distinct values). Frames without a position do not count.
pub(crate) fn count_repeated_frames(positions: &[[Option<f64>; 3]]) -> usize {
    // The resolution of a coordinate: the step between neighboring distinct values.
    let resolution = [0, 1, 2].map(|axis| {
        let values: Vec<f64> = positions.iter().filter_map(|position| position[axis]).collect();
        quantization_step(&values).unwrap_or(0.0)
    });
    let moves = |a: usize, b: usize| {
        let (Some(a), Some(b)) = (positions.get(a), positions.get(b)) else { return false };
        // Equal positions of a slow marker are rounding: only steps of several resolutions show motion.
        (0..3).any(|axis| match (a[axis], b[axis]) {
            (Some(a), Some(b)) => (a - b).abs() > COARSE_STEPS * resolution[axis] && a != b,
            _ => false,
        })
    };
    let repeats = |k: &usize| {
        let position = &positions[*k];
        position.iter().any(Option::is_some)
            && *position == positions[k - 1]
            && (moves(*k, k + 1) || *k > 1 && moves(k - 2, k - 1))
    };
    (1..positions.len()).filter(repeats).count()
}
