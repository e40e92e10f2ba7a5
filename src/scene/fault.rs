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
    /// Its short name, by which it is explained.
    pub fn code(&self) -> Code {
        match self {
            Self::LostFrames { .. } => Code::LostFrames,
            Self::SwappedLabels { .. } => Code::SwappedLabels,
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
                write!(f, "{lost} lost after t = {time:.4} s, by the way of the held markers: ")?;
                f.write_str(match mended {
                    true => "the clock goes on in true time from there",
                    false => "lost_frames = \"stretch\" lets the clock go on in true time",
                })
            }
            Self::SwappedLabels { markers: [one, other], mended } => {
                write!(f, "markers {one} and {other} have each other's label: ")?;
                f.write_str(match mended {
                    true => "they were exchanged",
                    false => "swapped_labels = \"mend\" exchanges them",
                })
            }
            Self::Glitches { marker, times, .. } => {
                let first = times.first().copied().unwrap_or(0.0);
                let count = match times.len() {
                    1 => "once".into(),
                    n => format!("{n} times, first"),
                };
                write!(
                    f,
                    "marker {marker} jumps by more than {} mm against the frames beside it, {count} at \
                     t = {first:.4} s: glitches = \"mask\" of an observation leaves that out",
                    1e3 * JUMP
                )
            }
        }
    }
}
