//! Defects of a recording of markers ([`TrackDefect`]), their warning codes and texts.
//!
//! Kinds: lost frames, exchanged labels, missing frames, jumps, gravity in accelerations, and glitches (jumps of a
//! single frame); other modules detect them. A defect has data of its kind: names of markers, times (s), numbers of
//! frames, the largest jump or the error of interpolation (m), the mean acceleration (m/s^2). Lost frames and exchanged
//! labels also have whether they were corrected. [`TrackDefect::code`] is the warning code; the text has finding,
//! consequence and action. `retain_distinct` removes jumps that are reported already as lost frames or glitches.

use crate::code::Code;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Second difference of the positions of a marker, m, above which the marker has jumped. Smaller values report fast
/// motion, larger ones leave glitches in.
pub(super) const JUMP: f64 = 0.01;

/// Defect of a recording.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", tag = "fault")]
#[non_exhaustive]
pub enum TrackDefect {
    /// Lost frames: all markers jump together.
    LostFrames {
        /// Time of the last frame before the gap, on the recording's own clock, s.
        time: f64,
        /// Number of lost frames.
        frames: usize,
        /// Whether later times were corrected.
        mended: bool,
    },
    /// Labels of two neighbors that are exchanged.
    SwappedLabels {
        /// Names of the markers.
        markers: [String; 2],
        /// Whether the labels were exchanged back.
        mended: bool,
    },
    /// Missing frames of a point that drives a support, over which interpolation is inaccurate.
    MissingFrames {
        /// Name of the marker; empty for the only point of a file.
        marker: String,
        /// Time of the frame before, s.
        from: f64,
        /// Time of the frame after, s.
        to: f64,
        /// Number of missing frames.
        frames: usize,
        /// Error, RMS, m, of the interpolation over equally many frames elsewhere in the recording. None if the
        /// recording has no such frames, or if the gap is at its start or end.
        error: Option<f64>,
    },
    /// Jumps, from one frame to the next, of a point that drives a support.
    Jumps {
        /// Name of the marker; empty for the only point of a file.
        marker: String,
        /// Times of the frames after the jumps, s.
        times: Vec<f64>,
        /// Largest jump, m.
        distance: f64,
    },
    /// Recorded accelerations include gravity.
    Gravity {
        /// Mean acceleration, m/s^2.
        mean: [f64; 3],
    },
    /// Jumps of a marker for single frames.
    Glitches {
        /// Name of the marker.
        marker: String,
        /// Indices of the frames, from 0.
        frames: Vec<usize>,
        /// Times of the frames, s.
        times: Vec<f64>,
    },
}

impl TrackDefect {
    /// Removes from jumps the times, s, within two frame intervals `step`, s, of lost frames among the `others`.
    /// Returns whether the defect is to be kept. False for jumps without times left, or of a marker with glitches among
    /// the `others`; other kinds are kept unchanged.
    pub(super) fn retain_distinct(&mut self, others: &[Self], step: f64) -> bool {
        let Self::Jumps { marker, times, .. } = self else { return true };
        for other in others {
            match other {
                // At lost frames all markers jump together, which is reported once.
                Self::LostFrames { time, .. } => times.retain(|t| (t - time).abs() > 2.0 * step),
                // A glitch is a jump there and back, which is reported already.
                Self::Glitches { marker: name, .. } if name == marker => return false,
                _ => {}
            }
        }
        !times.is_empty()
    }

    /// Warning code of the defect, one for each kind, whether or not it was corrected.
    pub fn code(&self) -> Code {
        match self {
            Self::LostFrames { .. } => Code::LostFrames,
            Self::SwappedLabels { .. } => Code::SwappedLabels,
            Self::MissingFrames { .. } => Code::MissingFrames,
            Self::Jumps { .. } => Code::RecordingJumps,
            Self::Gravity { .. } => Code::GravityInAcceleration,
            Self::Glitches { .. } => Code::Glitches,
        }
    }
}

impl fmt::Display for TrackDefect {
    /// Writes finding, consequence and action as text, without the code; a corrected defect has the correction in place
    /// of the action. Several occurrences have their number and the time of the first. Missing frames have the error of
    /// interpolation, m, if it is known; jumps the largest distance, m.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            // Each text has finding, consequence and action.
            Self::LostFrames { time, frames, mended } => {
                let lost = match frames {
                    1 => "a frame was".into(),
                    n => format!("{n} frames were"),
                };
                write!(
                    f,
                    "{lost} lost after t = {time:.4} s: most markers jump by as many. Later times are wrong \
                           by that amount. "
                )?;
                f.write_str(match mended {
                    true => "The later times were corrected",
                    false => "Set lost_frames = \"stretch\", which corrects the later times",
                })
            }
            Self::SwappedLabels { markers: [one, other], mended } => {
                write!(f, "the labels of markers {one} and {other} are swapped. ")?;
                f.write_str(match mended {
                    true => "They were exchanged",
                    false => "The positions belong to the wrong points. Set swapped_labels = \"mend\", which \
                              exchanges them",
                })
            }
            Self::MissingFrames { marker, from, to, frames, error } => {
                let frames = match frames {
                    1 => "1 frame is".into(),
                    n => format!("{n} frames are"),
                };
                write!(
                    f,
                    "{frames} missing{} from t = {from:.4} s to {to:.4} s. ",
                    of_marker(marker)
                )?;
                match error {
                    Some(error) => write!(
                        f,
                        "Interpolation over as many frames elsewhere is off by {:.2e} m (RMS)",
                        error
                    )?,
                    None => f.write_str("The motion there is interpolated or extrapolated")?,
                }
                f.write_str(
                    ". Fill the gap in the program that recorded it, or simulate another part",
                )
            }
            Self::Jumps { marker, times, distance } => write!(
                f,
                "the motion{} jumps {}, by up to {distance:.2e} m between two frames. \
                     The rod follows the jump. Correct these frames, or leave them blank",
                of_marker(marker),
                occurrences(times)
            ),
            Self::Gravity { mean: [x, y, z] } => write!(
                f,
                "the mean acceleration is ({x:.2}, {y:.2}, {z:.2}) m/s^2, the size of gravity. The end falls \
                 freely. Subtract gravity from the readings of the accelerometer"
            ),
            Self::Glitches { marker, times, .. } => write!(
                f,
                "marker {marker} jumps by more than {} mm for one frame, {}. Such \
                     glitches bias a fit. Set glitches = \"mask\" in the observation, which leaves them out",
                1e3 * JUMP,
                occurrences(times)
            ),
        }
    }
}

/// Number of occurrences and the time of the first, s: `once at t = 0.1000 s`, or `3 times, first at t = 0.1000 s`.
fn occurrences(times: &[f64]) -> String {
    let first = times.first().copied().unwrap_or(0.0);
    match times.len() {
        1 => format!("once at t = {first:.4} s"),
        n => format!("{n} times, first at t = {first:.4} s"),
    }
}

/// The words ` of marker A` for the name A; empty for an empty name, that of the only point of a file.
fn of_marker(marker: &str) -> String {
    if marker.is_empty() { String::new() } else { format!(" of marker {marker}") }
}
