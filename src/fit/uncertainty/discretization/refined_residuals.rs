//! Residuals of an optimum on a mesh and with a step that are much finer than the parameters need.
//!
//! A mesh and step that the program chose are as fine as the estimates require, which depend on large and slow motion.
//! Small fast vibrations may be out of phase at the end of a record: residuals that are no error of the model. So
//! before residuals lower a grade, the model runs once more, at the corrected estimates, with element and step size
//! divided by [`REFINEMENT`]. The change of the residuals, after the linear response of the unknowns, is extrapolated
//! to zero element and step size, as of second order. [`RefinedResiduals::residuals`] returns the residuals in this
//! limit, in units of sigma, for the tests of a fit. It returns none if neither mesh nor step was chosen for all
//! experiments, for undetectable errors ([`DETECTABLE`]), and where the run is too expensive ([`MOST_WORK`]) or fails.

use crate::accuracy::Extrapolation;
use crate::error::Error;
use crate::fit::measurement::experiment::{Experiment, full_work};
use crate::fit::search::Search;
use crate::fit::search::fitted::Fitted;
use crate::fit::uncertainty::covariance::gauss_newton::Covariance;
use crate::fit::uncertainty::covariance::local_analysis::LocalAnalysis;
use crate::fit::uncertainty::discretization::bias::DiscretizationBias;
use std::sync::OnceLock;

/// Factor on edges and on steps of the finer numerics. Larger: more accurate and, by its square, more expensive.
const REFINEMENT: usize = 2;
/// Extrapolation of the change to zero element and step size, as of second-order errors.
const TO_LIMIT: Extrapolation = Extrapolation { ratio: REFINEMENT as f64, order: 2.0 };
/// Most work of the run, steps times edges: about ten seconds.
const MOST_WORK: f64 = 4e7;
/// Norm of the discretization errors of all residuals, in standard deviations of the noise, above which a test may
/// detect them.
const DETECTABLE: f64 = 2.0;

/// Residuals on finer numerics, computed on demand and once.
pub(crate) struct RefinedResiduals<'a> {
    /// The search with its optimum.
    fitted: Fitted<'a>,
    /// Bias of the unknowns by mesh and step, with which the estimates are corrected.
    bias: &'a DiscretizationBias,
    /// Covariance at the optimum, for the linear response of the unknowns.
    covariance: Covariance,
    /// Weights of the residuals.
    weights: Vec<f64>,
    /// Change of the residuals to the limit; empty before the first call, `None` inside where the run was omitted or
    /// failed.
    change: OnceLock<Option<Vec<f64>>>,
}

impl<'a> RefinedResiduals<'a> {
    /// Residuals of an optimum whose unknowns have this `bias`, with covariance and weights of its local analysis.
    /// Nothing is simulated yet.
    pub fn new(fitted: Fitted<'a>, local: &LocalAnalysis, bias: &'a DiscretizationBias) -> Self {
        let (covariance, weights) = (local.covariance.clone(), local.noise.weights.clone());
        Self { fitted, bias, covariance, weights, change: OnceLock::new() }
    }

    /// Residuals in the limit of zero element and step size, in units of sigma, without the weights of robust losses.
    /// The run is made at the first call only. None unless the program chose the mesh or the step for all experiments,
    /// and where the run is too large or fails. None also where the discretization errors are undetectable: the
    /// residual fraction of the bias times the root of the number of residuals is at most [`DETECTABLE`].
    pub fn residuals(&self) -> Option<Vec<f64>> {
        let residuals = &self.fitted.optimum.residuals;
        let norm = self.bias.residual_fraction() * (residuals.len() as f64).sqrt();
        if !self.bias.parts().iter().any(|part| part.is_chosen) || norm <= DETECTABLE {
            return None;
        }
        let change = self.change.get_or_init(|| self.change().ok().flatten()).as_ref()?;
        Some(residuals.iter().zip(change).map(|(r, by)| r + by).collect())
    }

    /// Change of the residuals to the limit of zero element and step size, once the unknowns have followed linearly.
    /// One run at the corrected estimates has both sizes divided by [`REFINEMENT`]. Its difference to the residuals of
    /// the optimum is multiplied by 4/3, as of second order. Its work is added to that of the search. None where the
    /// run exceeds [`MOST_WORK`]. Error: it fails.
    fn change(&self) -> Result<Option<Vec<f64>>, Error> {
        let Fitted { search, optimum } = self.fitted;
        // The original mesh and step, both refined.
        let finer = |e: &Experiment| {
            let scene = e.problem.scene();
            let step = scene.time.as_ref().map_or(1.0, |time| time.step_size());
            let segments = REFINEMENT * e.problem.segments();
            let other = scene.resolved(segments, step / REFINEMENT as f64);
            Ok::<_, Error>(e.with_problem(e.problem.with_scene(other)?))
        };
        let experiments: Vec<Experiment> =
            search.experiments.iter().map(finer).collect::<Result<_, _>>()?;
        if full_work(&experiments)? > MOST_WORK {
            return Ok(None);
        }
        let finer = Search { experiments: &experiments, ..search.detached() };
        let unknowns = search.unknowns.iter().zip(&optimum.x).enumerate();
        // At the corrected estimates, where the finer model has its optimum.
        let x: Vec<f64> = unknowns.map(|(i, (u, x))| self.bias.corrected(u, i, *x)).collect();
        let residuals = finer.all_residuals()?.plain_residuals(&x)?;
        search.work.add(finer.work.total());
        search.report("finer numerics");
        // The change to the finer numerics is a part of that to the limit.
        let pairs = residuals.iter().zip(&optimum.residuals);
        let change: Vec<f64> = pairs.map(|(a, b)| TO_LIMIT.error_before() * (a - b)).collect();
        Ok(Some(self.covariance.response(&change, &self.weights, &optimum.jacobian).residuals))
    }
}
