//! Data of the recorded start of a structure in space: places of recorded markers on a structure at rest, and the
//! relaxed structure in the first two frames of a recording.
//!
//! [`MarkerPlace`] has the rod of a marker, its arc length and its position at rest, m, its index in the track, and
//! whether a recorded end holds it. [`RelaxedFrames`] has the unknowns (m, rad) of both frames, whose angles are
//! measured from one common pose.

use crate::numerics::vector::Vector;
use crate::rod::assembly::AssemblyFrames;

/// A marker on a rod: where it is at rest.
#[derive(Clone, Debug)]
pub(super) struct MarkerPlace {
    /// Index of the rod.
    pub rod: usize,
    /// Arc length from the start of the rod, m.
    pub arc_length: f64,
    /// Position at rest, m.
    pub rest: Vector<f64>,
    /// Index in the track.
    pub marker: usize,
    /// Whether a recorded end holds it.
    pub is_held: bool,
}

/// The relaxed structure in the first two frames of the recording.
#[derive(Clone, Debug)]
pub(super) struct RelaxedFrames {
    /// Frames of the pose through the markers of the first frame, from which all angles are measured.
    pub pose: AssemblyFrames<f64>,
    /// Unknowns in both frames.
    pub q: [Vec<f64>; 2],
}
