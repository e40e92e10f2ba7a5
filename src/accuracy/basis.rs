//! The last trial run of a search, from whose errors the numerics of a motion follow.

use crate::accuracy::aim::allowed_edges;
use crate::accuracy::refinement::{ErrorModel, Free, RefinementFactors, work};
use crate::accuracy::trial::{Numerics, TrialRun};
use crate::scene::Scene;
use crate::scene::resolution::Bound;

/// Growth of the work from the last trial run where further ones would take too long.
pub(super) const LAST_GROWTH: f64 = 20.0;
/// What is chosen for a motion, and what a check of the chosen run needs.
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
    pub numerics: Numerics,
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
    /// The cheapest refinement that reaches the target, within the growth that is allowed at the end.
    pub fn refinement(&self) -> RefinementFactors {
        let segments = self.numerics.segments as f64;
        match self.errors.cheapest(self.target, segments, self.free) {
            Some((finer, growth)) if growth <= LAST_GROWTH => finer,
            _ => self.errors.best_within(LAST_GROWTH, segments, self.free),
        }
    }

    /// Edges and steps of a refinement.
    pub fn refined(&self, finer: RefinementFactors, scene: &Scene) -> Numerics {
        let from = self.numerics;
        let segments = (finer.mesh * from.segments as f64 - 1e-6).ceil().max(2.0) as usize;
        let steps = (finer.step * from.steps as f64 - 1e-6).ceil().max(1.0) as usize;
        Numerics { segments: allowed_edges(scene, segments), steps, scheme: from.scheme }
    }

    /// Whether a run with these numerics takes no longer than the longest that is chosen.
    pub fn is_affordable(&self, numerics: Numerics) -> bool {
        let [chosen, trial] = [numerics, self.numerics].map(|n| n.segments as f64 * n.steps as f64);
        self.trial_work * chosen <= self.most_work * trial
    }

    /// Work of a run of the chosen scheme, in units of the trial run's.
    pub fn growth(&self, numerics: Numerics) -> f64 {
        let [chosen, trial] =
            [numerics, self.numerics].map(|n| work(n.segments as f64, n.steps as f64));
        chosen / trial
    }
}
