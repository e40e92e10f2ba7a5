//! The basis of the chosen numerics of a motion: the last trial run of the search, its estimated errors and orders, and the
//! limits of the work; from them follow the refinement, edges and steps of the chosen run.

use crate::accuracy::aim::allowed_edges;
use crate::accuracy::refinement::{ErrorModel, Free, RefinementFactors, work};
use crate::accuracy::trial::{Numerics, TrialRun};
use crate::scene::Scene;
use crate::scene::resolution::Bound;

/// Largest growth of the work from the last trial run to the chosen one, where the search ended at its limit of work.
pub(super) const LAST_GROWTH: f64 = 20.0;
/// The chosen numerics of a motion, their estimated error, and the basis that the check of the run needs.
pub(crate) struct ChosenMotion {
    pub numerics: Numerics,
    /// Step, s.
    pub step: f64,
    /// Estimated error over the length.
    pub error: Option<f64>,
    pub bound: Option<Bound>,
    pub basis: Option<Basis>,
}

/// The last trial run and the errors that were estimated of it.
#[derive(Clone)]
pub(crate) struct Basis {
    pub trial: TrialRun,
    pub errors: ErrorModel,
    /// Whether every refinement adds modes to the motion.
    pub has_many_modes: bool,
    /// Whether the errors of all parts that may change were estimated.
    pub is_known: bool,
    /// The parts that may change, and whose errors were estimated.
    pub free: Free,
    pub target: f64,
    /// Most work of a chosen run, and that of the trial run, edges times steps of generalised-alpha.
    pub most_work: f64,
    pub trial_work: f64,
}

impl Basis {
    /// The cheapest refinement of the trial run whose extrapolated error is the target, or the best within the largest growth
    /// of the work.
    pub fn refinement(&self) -> RefinementFactors {
        let segments = self.trial.numerics.segments as f64;
        match self.errors.cheapest(self.target, segments, self.free) {
            Some((finer, growth)) if growth <= LAST_GROWTH => finer,
            _ => self.errors.best_within(LAST_GROWTH, segments, self.free),
        }
    }

    /// Edges, steps and scheme of a refinement of the trial run.
    pub fn refined(&self, finer: RefinementFactors, scene: &Scene) -> Numerics {
        let from = self.trial.numerics;
        let segments = (finer.mesh * from.segments as f64 - 1e-6).ceil().max(2.0) as usize;
        let steps = (finer.step * from.steps as f64 - 1e-6).ceil().max(1.0) as usize;
        Numerics { segments: allowed_edges(scene, segments), steps, scheme: from.scheme }
    }

    /// Whether the work of a run with these numerics is at most that of the longest run that may be chosen.
    pub fn is_affordable(&self, numerics: Numerics) -> bool {
        let [chosen, trial] =
            [numerics, self.trial.numerics].map(|n| n.segments as f64 * n.steps as f64);
        self.trial_work * chosen <= self.most_work * trial
    }

    /// Work of a run of the chosen scheme, in units of the trial run's.
    pub fn growth(&self, numerics: Numerics) -> f64 {
        let [chosen, trial] =
            [numerics, self.trial.numerics].map(|n| work(n.segments as f64, n.steps as f64));
        chosen / trial
    }
}
