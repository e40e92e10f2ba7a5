//! Calculations for which numerics are chosen ([`Calculation`]: a motion, an equilibrium, modes, or a first guess), and
//! limits of the choice: Newton tolerances, largest meshes, allowed numbers of edges.
//!
//! [`set_newton_tolerance`] sets the Newton tolerance of a step, an error over the rod length, to a fraction of the
//! requested accuracy ([`RUN_TOLERANCE`], [`TRIAL_TOLERANCE`]), at most [`LARGEST_TOLERANCE`]. It changes a scene only
//! where the program chose the scheme and that has Newton iterations. Compared meshes at rest, and the first mesh of
//! any calculation, have at most [`MAX_SEGMENTS`] edges. Compared meshes of modes have at most
//! [`MAX_SEGMENTS_OF_MODES`], unless the first one has more. The chosen mesh may have up to twice as many, by
//! extrapolation. Markers of a recorded path round these numbers up. [`allowed_edges`] returns the smallest number of
//! edges, at least the given one, at which every marker of a recorded path is at a node. Without such a path it is the
//! given one. [`begins_with_velocity_jump`] returns whether a motion begins with a jump of velocities:
//! `supports.motion`, or an initial velocity or angular velocity that is not zero.

use crate::scene::{Recorded, Scene, StepTolerance, Time};

/// Newton tolerance of a step over the requested accuracy, for the chosen run. The predicted residual error
/// is an upper bound, and errors of many steps do not add up: the error of the run stays the same to three digits.
pub(super) const RUN_TOLERANCE: f64 = 1e-5;
/// The same for trial runs, whose errors are compared and not reported.
pub(super) const TRIAL_TOLERANCE: f64 = 1e-4;
/// Largest Newton tolerance of a step, over the length, for low requested accuracies.
pub(super) const LARGEST_TOLERANCE: f64 = 1e-6;
/// Largest number of edges of a compared mesh at rest, and of the first mesh.
pub(super) const MAX_SEGMENTS: usize = 20_000;
/// Largest number of edges of a compared mesh for modes, unless the first mesh has more. Rounding errors of frequencies
/// grow with the fourth power of the edges, and are 1e-5 at 1e3 edges.
pub(super) const MAX_SEGMENTS_OF_MODES: usize = 1_000;

/// Calculation that mesh, step and scheme are chosen for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Calculation {
    /// The motion over the time of the scene.
    Motion,
    /// The rod at rest under its loads.
    Rest,
    /// The given number of modes.
    Modes(usize),
    /// A first guess without an error estimate, which the caller refines.
    Guess,
}

/// Sets the Newton tolerance of a step, a predicted error over the rod length, to `part` times the requested accuracy,
/// at most [`LARGEST_TOLERANCE`]. Nothing changes where the program did not choose the scheme, the scene has no
/// `[time]`, or the scheme has no Newton iterations.
pub(super) fn set_newton_tolerance(scene: &mut Scene, part: f64) {
    let (requested, chosen) = (scene.asked(), scene.chosen().scheme);
    // A scheme that the scene gives keeps the tolerance of the scene.
    let iterated = |time: &&mut Time| time.scheme.traits().parameter.is_some();
    if let Some(time) = scene.time.as_mut().filter(|_| chosen).filter(iterated) {
        time.tolerance = StepTolerance::Predicted((part * requested).min(LARGEST_TOLERANCE));
    }
}

/// The smallest number of edges, at least `edges`, at which every marker of a recorded path is at a node: a multiple of
/// the number of parts between markers. `edges` without such a path.
pub(super) fn allowed_edges(scene: &Scene, edges: usize) -> usize {
    let spans = scene.supports.path.as_ref().map_or(1, Recorded::spans);
    edges.div_ceil(spans) * spans
}

/// Whether the motion begins with a jump of velocities: the scene has a `supports.motion`, or an initial velocity or
/// angular velocity that is not zero. Recorded ends (`supports.path`) do not count.
pub(super) fn begins_with_velocity_jump(Scene { initial, supports, .. }: &Scene) -> bool {
    !supports.motion.is_empty() || [initial.velocity, initial.angular_velocity] != [[0.0; 3]; 2]
}
