//! What is left of the data on a mesh and in steps far finer than the parameters need.
//!
//! Mesh and step are chosen as fine as the parameters need them, and those follow the motion that is large and slow. Small
//! quick vibrations may be out of phase by the end of a record then: motion that is left, with nothing wrong about the
//! model. So before residuals speak against it, the model runs once more, on finer numerics, and the unknowns follow
//! what that changes.

use crate::accuracy::Extrapolation;
use crate::error::Error;
use crate::fit::measurement::experiment::{Experiment, full_work};
use crate::fit::search::Task;
use crate::fit::search::fitted::Fitted;
use crate::fit::uncertainty::covariance::gauss_newton::Covariance;
use crate::fit::uncertainty::covariance::local_analysis::LocalAnalysis;
use crate::fit::uncertainty::shifts::{Response, Shifts};
use std::sync::OnceLock;

/// So many times more edges, and more steps; and what that changes is carried on to edges and steps of no length, as
/// errors of second order are.
const MORE: usize = 2;
const LIMIT: Extrapolation = Extrapolation { ratio: MORE as f64, order: 2.0 };
/// Most work of the run, steps times edges: about ten seconds.
const MOST_WORK: f64 = 4e7;
/// What numerics leave of this size together, in standard deviations of the noise, may be seen by a test.
const SEEN: f64 = 2.0;

/// The run on finer numerics, if anybody asks.
pub(crate) struct Finer<'a> {
    fitted: Fitted<'a>,
    shifts: &'a Shifts,
    covariance: Covariance,
    weights: Vec<f64>,
    change: OnceLock<Option<Vec<f64>>>,
}

impl<'a> Finer<'a> {
    /// Of an optimum whose unknowns are by `shifts` from those of the continuum.
    pub fn new(
        fitted: Fitted<'a>,
        LocalAnalysis { covariance, noise, .. }: &LocalAnalysis,
        shifts: &'a Shifts,
    ) -> Self {
        let (covariance, weights) = (covariance.clone(), noise.weights.clone());
        Self { fitted, shifts, covariance, weights, change: OnceLock::new() }
    }

    /// The optimum's residuals as they would be on finer numerics; none where numerics are given or leave too little to be seen, or where the run fails.
    pub fn residuals(&self) -> Option<Vec<f64>> {
        let residuals = &self.fitted.optimum.residuals;
        let seen = self.shifts.left * (residuals.len() as f64).sqrt() > SEEN;
        if !self.shifts.chosen.contains(&true) || !seen {
            return None;
        }
        let change = self.change.get_or_init(|| self.run().ok().flatten()).as_ref()?;
        Some(residuals.iter().zip(change).map(|(r, by)| r + by).collect())
    }

    /// By how much the residuals change, once the unknowns have followed.
    fn run(&self) -> Result<Option<Vec<f64>>, Error> {
        let Fitted { search, optimum } = self.fitted;
        let finer = |e: &Experiment| {
            let scene = e.problem.scene();
            let step = scene.time.as_ref().map_or(1.0, |time| time.step_size()) / MORE as f64;
            let other = scene.resolved(MORE * e.problem.segments(), step);
            Ok::<_, Error>(e.posed_as(e.problem.like_it(other)?))
        };
        let experiments: Vec<Experiment> =
            search.experiments.iter().map(finer).collect::<Result<_, _>>()?;
        if full_work(&experiments)? > MOST_WORK {
            return Ok(None);
        }
        let there = Task { experiments: &experiments, ..search.task() }.search();
        let corrected = optimum.x.iter().zip(search.unknowns).enumerate().map(|(i, (x, u))| {
            let [low, high] = u.scaled_bounds();
            (x + self.shifts.correction(i)).clamp(low, high)
        });
        let residuals = there.all_residuals()?.plain(&corrected.collect::<Vec<f64>>())?;
        search.work.add(there.work.total());
        search.report("finer numerics");
        let to_limit = LIMIT.error_before();
        let change: Vec<f64> =
            residuals.iter().zip(&optimum.residuals).map(|(a, b)| to_limit * (a - b)).collect();
        let response = Response::to(&change, &self.covariance, &self.weights, &optimum.jacobian);
        Ok(Some(response.residuals))
    }
}
