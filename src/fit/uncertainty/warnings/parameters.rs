//! Warnings about estimates: parameters that are bounded from one side only, at a bound of the search, or in conflict
//! with a prior.
//!
//! Input: the unknowns, with the optimum or the estimates in the same order. Each function adds to the warnings of the
//! fit. One-sided 95 % bounds of estimates are notes (`one_sided_bounds`). An optimum at a bound of the search is a
//! contradiction, with the bound in its unit, if the unknown has a standard deviation (`bounds_reached`). An optimum
//! more than [`CONTRADICTION`] standard deviations of its prior from the mean of the prior is a contradiction too
//! (`prior_conflicts`). Contradictions lower the grade.

use crate::code::Code;
use crate::fit::search::damping::may_vanish;
use crate::fit::search::optimum::Optimum;
use crate::fit::uncertainty::covariance::gauss_newton::Covariance;
use crate::fit::uncertainty::estimate::Estimate;
use crate::fit::uncertainty::warning_list::{Severity, Warnings};
use crate::fit::unknown::Unknown;

/// Distance from the mean of a prior, in its standard deviations, above which data and prior contradict each other. A
/// normal deviate exceeds 3 in 0.3 % of all cases.
const CONTRADICTION: f64 = 3.0;

/// Adds a note for each estimate with a one-sided 95 % bound: a damping with an upper bound, which may be zero, or
/// another parameter with a lower or an upper bound. `estimates` are in the order of the `unknowns`.
pub(crate) fn one_sided_bounds(
    unknowns: &[Unknown],
    estimates: &[Estimate],
    warnings: &mut Warnings,
) {
    for (unknown, estimate) in unknowns.iter().zip(estimates) {
        let (label, unit) = (estimate.label(), estimate.name.unit());
        match (estimate.lower95, estimate.upper95) {
            // A damping may be zero: its upper bound is a result.
            (None, Some(upper)) if may_vanish(unknown) => {
                let text = format!(
                    "{label} is not distinguishable from zero: at most {upper:.3e} {unit} (one-sided 95 %). The \
                     upper bound is the result. Record a longer motion to determine it"
                );
                warnings.add(Severity::Note, Code::MayBeZero, text);
            }
            // Of other parameters the open side is a gap in the data.
            (Some(bound), _) | (_, Some(bound)) => {
                let [side, open] = match estimate.lower95 {
                    Some(_) => ["at least", "larger"],
                    None => ["at most", "smaller"],
                };
                let text = format!(
                    "{label} is bounded from one side only: {side} {bound:.3e} {unit} (one-sided 95 %). The data fit \
                     any {open} value as well. Record a motion that depends on it, or keep it fixed"
                );
                warnings.add(Severity::Note, Code::OneSided, text);
            }
            _ => {}
        }
    }
}

/// Adds a warning of a contradiction for each identifiable unknown whose optimum is at or beyond a bound of the search,
/// with the bound in its unit. Unknowns without a standard deviation in the `covariance` are skipped.
pub(crate) fn bounds_reached(
    unknowns: &[Unknown],
    optimum: &Optimum,
    covariance: &Covariance,
    warnings: &mut Warnings,
) {
    for ((unknown, x), deviation) in unknowns.iter().zip(&optimum.x).zip(&covariance.deviation) {
        let [low, high] = unknown.scaled_bounds();
        // Unidentifiable unknowns drift to their bounds by themselves.
        if deviation.is_some() && (*x <= low || *x >= high) {
            let bound = unknown.from_scale(if *x <= low { low } else { high });
            let text = format!(
                "{unknown} is at its bound {bound}. The interval does not account for the bound. Widen the bound, \
                 or check the model"
            );
            warnings.add(Severity::Contradiction, Code::AtBound, text);
        }
    }
}

/// Adds a warning of a contradiction for each unknown whose optimum is more than [`CONTRADICTION`] standard deviations
/// from the mean of its prior.
pub(crate) fn prior_conflicts(unknowns: &[Unknown], optimum: &Optimum, warnings: &mut Warnings) {
    for (unknown, x) in unknowns.iter().zip(&optimum.x) {
        let sigmas = unknown.prior_residual(*x).map_or(0.0, f64::abs);
        if sigmas > CONTRADICTION {
            let text = format!(
                "{unknown} is {sigmas:.1} sigma from the mean of its prior. Data and prior contradict each other. Check \
                 the prior and the setup"
            );
            warnings.add(Severity::Contradiction, Code::PriorConflict, text);
        }
    }
}
