//! What is asked of a resolution.

use crate::scene::resolution::Bound;
use crate::scene::{Recorded, Scene, Time, Tolerance};

/// What a mesh is chosen for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Aim {
    /// The motion over the time of the scene.
    Motion,
    /// The rod at rest under its loads.
    Rest,
    /// So many modes.
    Modes(usize),
    /// Nothing yet: a first guess, which whoever asks makes better.
    Guess,
}

/// Newton's tolerance in a step over the accuracy, of the run and of those on the way, and the most that a scene may have. What a
/// step leaves is foreseen as too much rather than as too little, and errors of many steps do not add up: a run stays what it is
/// to three digits of its error.
pub(super) const RUN_TOLERANCE: f64 = 1e-5;
pub(super) const TRIAL_TOLERANCE: f64 = 1e-4;
pub(super) const LARGEST_TOLERANCE: f64 = 1e-6;
/// Most edges of a rod at rest, and of one whose modes are looked at: rounding errors of frequencies go with the fourth power
/// of the edges, and 1e3 of them leave some 1e-5.
pub(super) const MAX_SEGMENTS: usize = 20_000;
pub(super) const MAX_SEGMENTS_OF_MODES: usize = 1_000;

/// Edges, step, the error that is left over the length, and what kept it from being smaller.
pub(super) type Found = (usize, f64, Option<f64>, Option<Bound>);

/// The scene with Newton's tolerance at a part of the accuracy that is asked for, where the program chooses the scheme.
pub(super) fn set_newton_tolerance(scene: &mut Scene, part: f64) {
    let (asked, chosen) = (scene.asked(), scene.chosen().scheme);
    let iterated = |time: &&mut Time| time.scheme.traits().parameter.is_some();
    if let Some(time) = scene.time.as_mut().filter(|_| chosen).filter(iterated) {
        time.tolerance = Tolerance::Predicted((part * asked).min(LARGEST_TOLERANCE));
    }
}

/// So many edges, or a few more where markers stand at nodes.
pub(super) fn allowed_edges(scene: &Scene, edges: usize) -> usize {
    let spans = scene.supports.path.as_ref().map_or(1, Recorded::spans);
    edges.div_ceil(spans) * spans
}

/// Whether velocities jump at the start where the rod is held.
pub(super) fn is_struck(Scene { initial, supports, .. }: &Scene) -> bool {
    !supports.motion.is_empty() || [initial.velocity, initial.angular_velocity] != [[0.0; 3]; 2]
}
