//! The basis of the chosen numerics of a motion: the last trial run of the search, its estimated errors (over the rod
//! length) and orders, and the limits of the work.
//!
//! [`Basis::refinement`] returns the factors on mesh and step with the least work whose extrapolated error is the
//! target. If there are none within [`LAST_GROWTH`] times the work of the trial run, it returns the most accurate ones
//! within that work. A part that is not free keeps the factor 1; factors below 1 are coarser. [`Basis::refined`]
//! returns edges and steps of a run with them, rounded up. [`Basis::growth`] is the work of a run over that of the
//! trial run, and [`Basis::is_affordable`] whether it is within the limit. [`ChosenMotion`] is the result of the
//! search: numerics, step in s, estimated error (none if unknown), and the reason if the requested error is not
//! reached.

use crate::accuracy::calculation::allowed_edges;
use crate::accuracy::refinement::{ErrorModel, Free, RefinementFactors, work};
use crate::accuracy::trial::{Numerics, TrialRun};
use crate::scene::Scene;
use crate::scene::resolution::Bound;

/// Largest growth of the work from the last trial run to the chosen run. A larger value permits longer extrapolations
/// and runs.
pub(super) const LAST_GROWTH: f64 = 20.0;

/// The chosen numerics of a motion, their estimated error, and the basis that the check of the run needs.
pub(crate) struct ChosenMotion {
    /// Edges, steps and scheme.
    pub numerics: Numerics,
    /// Step, s.
    pub step: f64,
    /// Estimated error over the length.
    pub error: Option<f64>,
    /// The reason why the requested error is not reached, if so.
    pub bound: Option<Bound>,
    /// The basis of the choice; `None` if no trial run succeeded, or only ones that a later failure discarded.
    pub basis: Option<Basis>,
}

/// The last trial run and its estimated errors.
#[derive(Clone)]
pub(crate) struct Basis {
    /// The last trial run.
    pub trial: TrialRun,
    /// Errors of its mesh and step, over the length, with their orders.
    pub errors: ErrorModel,
    /// Whether every refinement adds modes to the motion.
    pub has_many_modes: bool,
    /// Whether the errors of all parts that may change were estimated.
    pub is_known: bool,
    /// The parts that may change, and whose errors were estimated.
    pub free: Free,
    /// Error for which the numerics are chosen, over the length.
    pub target: f64,
    /// Error that the search was to reach, over the length: the request of the scene, or a larger one where that is out
    /// of reach.
    pub requested: f64,
    /// Largest work of a chosen run, edges times steps of generalised-alpha.
    pub most_work: f64,
    /// Work of the trial run, in the same unit.
    pub trial_work: f64,
}

impl Basis {
    /// The refinement of the trial run with the least work whose extrapolated error is the target, if that is at most
    /// [`LAST_GROWTH`] times the work of the trial run; else the most accurate one within that work. A part, mesh or
    /// step, that is not `free` keeps the factor 1. Factors below 1 are coarser than the trial run.
    pub fn refinement(&self) -> RefinementFactors {
        let segments = self.trial.numerics.segments as f64;
        match self.errors.cheapest(self.target, segments, self.free) {
            Some((finer, growth)) if growth <= LAST_GROWTH => finer,
            _ => self.errors.best_within(LAST_GROWTH, segments, self.free),
        }
    }

    /// Edges, steps and scheme of the trial run refined by the factors `finer`. Both numbers are rounded up, to at
    /// least 2 edges and 1 step; edges further so that every marker of a recorded path is at a node.
    pub fn refined(&self, finer: RefinementFactors, scene: &Scene) -> Numerics {
        let from = self.trial.numerics;
        // Rounding errors of a factor that gives a whole number must not add an edge or a step.
        let segments = (finer.mesh * from.segments as f64 - 1e-6).ceil().max(2.0) as usize;
        let steps = (finer.step * from.steps as f64 - 1e-6).ceil().max(1.0) as usize;
        Numerics { segments: allowed_edges(scene, segments), steps, scheme: from.scheme }
    }

    /// Whether the expected work of a run with these numerics, the trial run's scaled by edges times steps, is at most
    /// `most_work`.
    pub fn is_affordable(&self, numerics: Numerics) -> bool {
        let [chosen, trial] =
            [numerics, self.trial.numerics].map(|n| n.segments as f64 * n.steps as f64);
        self.trial_work * chosen <= self.most_work * trial
    }

    /// The work of a run with these numerics over that of the trial run. Work is (edges + 8) times steps, independent
    /// of the scheme.
    pub fn growth(&self, numerics: Numerics) -> f64 {
        let [chosen, trial] =
            [numerics, self.trial.numerics].map(|n| work(n.segments as f64, n.steps as f64));
        chosen / trial
    }
}
