//! Purposes that a mesh is chosen for, and limits of the choice: Newton tolerances, largest meshes, allowed numbers of edges.

use crate::scene::{Recorded, Scene, StepTolerance, Time};

/// Purpose that mesh, step and scheme are chosen for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Aim {
    /// The motion over the time of the scene.
    Motion,
    /// The rod at rest under its loads.
    Rest,
    /// The given number of modes.
    Modes(usize),
    /// A first guess without an error estimate, which the caller refines.
    Guess,
}

/// Newton tolerance of a step over the requested accuracy, for the chosen run. The predicted residual error
/// is an upper bound, and errors of many steps do not add up: the error of the run stays the same to three digits.
pub(super) const RUN_TOLERANCE: f64 = 1e-5;
/// The same of trial runs, whose errors are compared and not reported.
pub(super) const TRIAL_TOLERANCE: f64 = 1e-4;
/// Largest Newton tolerance of a step, over the length.
pub(super) const LARGEST_TOLERANCE: f64 = 1e-6;
/// Most edges of a rod at rest.
pub(super) const MAX_SEGMENTS: usize = 20_000;
/// Most edges for modes: rounding errors of frequencies grow with the fourth power of the edges, and are 1e-5 at 1e3 edges.
pub(super) const MAX_SEGMENTS_OF_MODES: usize = 1_000;

/// Sets the Newton tolerance to `part` of the requested accuracy, where the program chooses a scheme with Newton iterations.
pub(super) fn set_newton_tolerance(scene: &mut Scene, part: f64) {
    let (requested, chosen) = (scene.asked(), scene.chosen().scheme);
    let iterated = |time: &&mut Time| time.scheme.traits().parameter.is_some();
    if let Some(time) = scene.time.as_mut().filter(|_| chosen).filter(iterated) {
        time.tolerance = StepTolerance::Predicted((part * requested).min(LARGEST_TOLERANCE));
    }
}

/// The next number of edges from `edges` on at which every marker of a recorded path is at a node.
pub(super) fn allowed_edges(scene: &Scene, edges: usize) -> usize {
    let spans = scene.supports.path.as_ref().map_or(1, Recorded::spans);
    edges.div_ceil(spans) * spans
}

/// Whether the motion begins with a jump of velocities: a support moves, or the rod has an initial velocity.
pub(super) fn is_struck(Scene { initial, supports, .. }: &Scene) -> bool {
    !supports.motion.is_empty() || [initial.velocity, initial.angular_velocity] != [[0.0; 3]; 2]
}
