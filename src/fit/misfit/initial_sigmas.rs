//! What is taken for the noise of measurements before anything is fitted.

use crate::fit::measurement::Measurement;
use crate::fit::measurement::experiment::{Experiment, all};
use crate::fit::unknown::Unknown;

/// Part of the observed motion that a model may leave unexplained before the search is repeated
/// on a finer grid, and before the report warns, unless it is noise.
pub(crate) const UNEXPLAINED: f64 = 0.1;

/// Sigmas given, and for the others the size of the rod, a common scale; where outliers shall count
/// less, what may be left of the motion at first.
pub(crate) fn first_sigmas(experiments: &[Experiment]) -> Vec<f64> {
    let first = |(experiment, measurement): (&Experiment, &Measurement)| {
        let problem = &experiment.problem;
        measurement.sigma().unwrap_or_else(|| match measurement.loss().is_robust() {
            // What hardly moves leaves what the camera sees of it.
            true => 0.5 * UNEXPLAINED * measurement.size(problem).max(1e-2 * problem.length()),
            false => problem.length(),
        })
    };
    all(experiments).map(first).collect()
}

/// Whether noise that is estimated from the residuals changes what the residuals come out as: not so
/// where all have the same.
pub(crate) fn weights_depend_on_the_fit(fitted: &[Experiment], unknowns: &[Unknown]) -> bool {
    let mut unknown = all(fitted).filter(|(_, m)| m.sigma().is_none());
    let robust = unknown.clone().any(|(_, m)| m.loss().is_robust());
    let several = all(fitted).count() > 1 || unknowns.iter().any(|u| u.prior.is_some());
    unknown.next().is_some() && (robust || several)
}
