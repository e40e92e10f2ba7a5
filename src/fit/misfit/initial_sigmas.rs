//! Preliminary standard deviations (sigmas) of the measurements before the first fit, in the unit of each.
//!
//! Input: the fitted experiments. Output: one sigma per measurement. It is the given sigma, if there is one. Without
//! it, and with squared losses, it is the length of the rod in m as a number, whatever the unit: a common scale of all.
//! With a robust loss it is half of [`UNEXPLAINED`] (5 %) of the size of the measured effect, which is at least
//! [`LEAST_MOTION`] of the length. So outliers are down-weighted from the start. [`weights_depend_on_the_fit`] returns
//! whether a search must estimate missing sigmas from its residuals, because they change the optimum.

use crate::fit::measurement::Measurement;
use crate::fit::measurement::experiment::{Experiment, all};
use crate::fit::unknown::Unknown;

/// Largest RMS residual of an acceptable fit, over the RMS of the observed motion, unless the residuals are noise.
/// Above it the search is repeated on a finer grid, and the report warns.
pub(crate) const UNEXPLAINED: f64 = 0.1;
/// Smallest motion for the preliminary sigma of a robust loss, over the length of the rod: a rod that hardly moves has
/// residuals of the size of the camera's noise.
const LEAST_MOTION: f64 = 1e-2;

/// One sigma per measurement of all experiments, in its unit: the given one, or else the length of the rod in m as a
/// number. With a robust loss it is half of [`UNEXPLAINED`] times the size of the measured effect (at least
/// [`LEAST_MOTION`] of the length), so that outliers are down-weighted from the start.
pub(crate) fn first_sigmas(experiments: &[Experiment]) -> Vec<f64> {
    let first = |(experiment, measurement): (&Experiment, &Measurement)| {
        let problem = &experiment.problem;
        // Squares need a common scale only. A robust loss needs the size of an outlier from the first fit on.
        measurement.sigma().unwrap_or_else(|| match measurement.loss().is_robust() {
            true => {
                let motion = measurement.size(problem).max(LEAST_MOTION * problem.length());
                0.5 * UNEXPLAINED * motion
            }
            false => problem.length(),
        })
    };
    all(experiments).map(first).collect()
}

/// Whether estimating the sigmas that are not given from the residuals changes the optimum. At least one sigma must be
/// missing; also, a measurement without sigma has a robust loss, or there are several measurements (with sigma or
/// without), or a prior. A single squared measurement has one common factor, which changes nothing.
pub(crate) fn weights_depend_on_the_fit(fitted: &[Experiment], unknowns: &[Unknown]) -> bool {
    let mut unknown = all(fitted).filter(|(_, m)| m.sigma().is_none());
    let robust = unknown.clone().any(|(_, m)| m.loss().is_robust());
    // A common factor of all residuals does not move their minimum. Other measurements and priors have their own.
    let several = all(fitted).count() > 1 || unknowns.iter().any(|u| u.prior.is_some());
    unknown.next().is_some() && (robust || several)
}
