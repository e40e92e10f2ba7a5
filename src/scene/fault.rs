//! What may be wrong in a recording of markers, in words.

use crate::code::Code;
use serde::{Deserialize, Serialize};
use std::fmt;

/// A marker whose places have a larger second difference, m, has jumped.
pub(super) const JUMP: f64 = 0.01;

/// What was found wrong in a recording.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", tag = "fault")]
#[non_exhaustive]
pub enum Fault {
    /// All markers jump as if frames were missing.
    LostFrames {
        /// Time of the last frame before, on the recording's own clock, s.
        time: f64,
        /// How many are missing.
        frames: usize,
        /// Whether the clock goes on in true time.
        mended: bool,
    },
    /// Two neighbours have each other's label.
    SwappedLabels {
        /// Their names.
        markers: [String; 2],
        /// Whether each has the place of the other.
        mended: bool,
    },
    /// Frames of a point that drives a support are missing, and interpolation over them is inaccurate.
    MissingFrames {
        /// Name of the marker; empty for the only point of a file.
        marker: String,
        /// Times of the frames before and after, s.
        from: f64,
        /// The latter.
        to: f64,
        /// How many are missing.
        frames: usize,
        /// Error of the interpolation over as many frames elsewhere in the recording, RMS, m; none where the
        /// recording has no such stretch, or ends or begins there.
        error: Option<f64>,
    },
    /// A point that drives a support jumps from one frame to the next.
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
    /// A marker jumps for single frames.
    Glitches {
        /// Its name.
        marker: String,
        /// The frames, from 0.
        frames: Vec<usize>,
        /// Their times, s.
        times: Vec<f64>,
    },
}

impl Fault {
    /// Whether it is another fault than these: jumps of lost frames and of glitches are theirs.
    pub(super) fn is_beside(&mut self, others: &[Self], step: f64) -> bool {
        let Self::Jumps { marker, times, .. } = self else { return true };
        for other in others {
            match other {
                Self::LostFrames { time, .. } => times.retain(|t| (t - time).abs() > 2.0 * step),
                Self::Glitches { marker: name, .. } if name == marker => return false,
                _ => {}
            }
        }
        !times.is_empty()
    }

    /// Its short name, by which it is explained.
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

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
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
                write!(f, "{frames} missing{} from t = {from:.4} s to {to:.4} s. ", of(marker))?;
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
            Self::Jumps { marker, times, distance } => {
                let first = times.first().copied().unwrap_or(0.0);
                let count = match times.len() {
                    1 => "once".into(),
                    n => format!("{n} times, first"),
                };
                write!(
                    f,
                    "the motion{} jumps {count} at t = {first:.4} s, by up to {distance:.2e} m between two frames. \
                     The rod follows the jump. Correct these frames, or leave them blank",
                    of(marker)
                )
            }
            Self::Gravity { mean: [x, y, z] } => write!(
                f,
                "the mean acceleration is ({x:.2}, {y:.2}, {z:.2}) m/s^2, the size of gravity. The end falls \
                 freely. Subtract gravity from the readings of the accelerometer"
            ),
            Self::Glitches { marker, times, .. } => {
                let first = times.first().copied().unwrap_or(0.0);
                let count = match times.len() {
                    1 => "once".into(),
                    n => format!("{n} times, first"),
                };
                write!(
                    f,
                    "marker {marker} jumps by more than {} mm for one frame, {count} at t = {first:.4} s. Such \
                     glitches bias a fit. Set glitches = \"mask\" in the observation, which leaves them out",
                    1e3 * JUMP
                )
            }
        }
    }
}

/// ` of marker A`; nothing for the only point of a file.
fn of(marker: &str) -> String {
    if marker.is_empty() { String::new() } else { format!(" of marker {marker}") }
}
