//! The budget of uncertainty, as metrology keeps it (Guide to the Expression of Uncertainty in
//! Measurement): every source with its sensitivity coefficient, what it contributes, and its share.
//!
//! Contributions of numbers that are [known](crate::fit::Known) with an error are `|c| u`, with `c` from
//! the [answers](crate::fit::uncertainty::budget::input_changes) of the estimates; correlated ones add up as
//! `sum_ij c_i u_i r_ij c_j u_j`. Beside them stand the noise, what mesh and step may be off (anything
//! up to the stated error is as likely: a rectangle, its half width over the root of 3), and by how much
//! experiments differ beyond noise and beyond the known numbers of their own. The coverage factor is
//! Student's t at the effective degrees of freedom of Welch and Satterthwaite.

use crate::code::Code;
use crate::fit::known::Known;
use crate::fit::search::Search;
use crate::fit::search::fitted::Fitted;
use crate::fit::uncertainty::analysis::Analysis;
use crate::fit::uncertainty::budget::entries::{BudgetLine, MonteCarlo};
use crate::fit::uncertainty::budget::input_errors::InputErrors;
use crate::fit::uncertainty::discretization::DiscretizationError;
use crate::fit::uncertainty::estimate::Estimate;
use crate::fit::uncertainty::grade::{Severity, Warnings};
use crate::fit::uncertainty::noise::autocorrelation::Correlations;
use crate::fit::uncertainty::noise::coverage_factor::quantile95;
use crate::fit::uncertainty::resampling::bootstrap::{self, Bootstrap, Draws, Replicates};

/// A spread this much other than the budget's is not by the error of either.
const NOT_LINEAR: f64 = 0.1;

/// What is given beside the data.
#[derive(Clone, Copy)]
pub(crate) struct BudgetInputs<'a> {
    /// None where that could not be computed.
    pub known: Option<&'a InputErrors<'a>>,
    pub analysis: &'a Analysis,
    pub discretization: &'a [DiscretizationError],
    /// The noise of each measurement, in its unit.
    pub sigma: &'a [f64],
    pub correlations: &'a Correlations,
}

/// The estimates with their budgets, and what was asked for about them.
pub(crate) fn budgeted(
    estimates: Vec<Estimate>,
    fitted: Fitted,
    given: BudgetInputs,
    warnings: &mut Warnings,
) -> Vec<Estimate> {
    let search = fitted.search;
    let BudgetInputs { known, analysis, discretization, sigma, correlations } = given;
    let Some(known) = known else { return estimates };
    if estimates.iter().all(|e| e.std_error.is_none()) || search.is_stopped() {
        return estimates;
    }
    let estimates = with_budgets(estimates, search, &correlations.freedom, discretization, known);
    match analysis.monte_carlo {
        0 => estimates,
        fits => {
            let draws = Draws { sigma, knowns: known.knowns, correlations, blocks: false };
            let numbers = 0..fits;
            let replicates =
                Replicates { what: "Monte Carlo", numbers, seed: analysis.seed, kept: false };
            let spreads = bootstrap::spreads(fitted, draws, replicates, warnings);
            with_monte_carlo(estimates, search, (fits, known), spreads, warnings)
        }
    }
}

/// The estimates with their spread over so many fits.
fn with_monte_carlo(
    mut estimates: Vec<Estimate>,
    search: &Search,
    (fits, known): (usize, &InputErrors),
    spreads: Vec<Option<Bootstrap>>,
    warnings: &mut Warnings,
) -> Vec<Estimate> {
    for (j, (estimate, spread)) in estimates.iter_mut().zip(spreads).enumerate() {
        let (Some(value), Some(std_error), Some(spread)) =
            (estimate.value, estimate.std_error, spread)
        else {
            continue;
        };
        let jackknife = estimate.cluster_jackknife.as_ref();
        let noisy = jackknife.map_or(std_error, |jackknife| jackknife.residual_std_error);
        let by_known = known.variance(j).sqrt() * search.unknowns[j].slope(value);
        let (std, linear_std) = (spread.std_error, noisy.hypot(by_known));
        // The spread of n fits is off by one part in the root of 2 n.
        let by_chance = 3.0 / (2.0 * fits as f64).sqrt();
        if (std / linear_std - 1.0).abs() > by_chance.max(NOT_LINEAR) {
            let words = format!(
                "{}: the Monte Carlo spread is {:.2} times that of the budget. The model is not linear over the \
                 input errors. Quote the Monte Carlo interval",
                estimate.label(),
                std / linear_std
            );
            warnings.add(Severity::Note, Code::BudgetNotLinear, words);
        }
        let interval95 = spread.interval95;
        estimate.monte_carlo = Some(MonteCarlo { fits, std, interval95, linear_std });
    }
    estimates
}

/// The estimates with the lines of their budgets, and what those come to.
fn with_budgets(
    estimates: Vec<Estimate>,
    search: &Search,
    freedom: &[Option<f64>],
    discretization: &[DiscretizationError],
    known: &InputErrors,
) -> Vec<Estimate> {
    let with = |(j, estimate): (usize, Estimate)| {
        let (Some(value), Some(std_error)) = (estimate.value, estimate.std_error) else {
            return estimate;
        };
        let unknown = &search.unknowns[j];
        let slope = unknown.slope(value);
        let line = |source: &str, contribution: f64, degrees_of_freedom: Option<f64>| BudgetLine {
            source: source.into(),
            parameter: estimate.name,
            std: None,
            unit: String::new(),
            sensitivity: None,
            relative_sensitivity: None,
            contribution,
            share: contribution * contribution,
            degrees_of_freedom,
        };
        let by = known.of_unknown(j) * slope;
        let shares = (&known.correlations * &by).component_mul(&by);
        let mut lines: Vec<BudgetLine> = Vec::new();
        for (i, of) in known.knowns.iter().enumerate() {
            let sensitivity = by[i] / of.sigma;
            let size = known.values[i].filter(|size| *size != 0.0);
            let relative = size.map(|size| sensitivity * size / value);
            lines.push(BudgetLine {
                std: Some(of.sigma),
                unit: of.parameter.unit().into(),
                sensitivity: Some(sensitivity),
                relative_sensitivity: relative.filter(|_| unknown.parameter.is_positive()),
                share: shares[i],
                ..line(&of.label(), by[i].abs(), None)
            });
        }
        // Together they have the freedom of the experiments' differences.
        let jackknife = estimate.cluster_jackknife.as_ref().filter(|jackknife| jackknife.reported);
        let (noisy, freedom) = match jackknife {
            Some(jackknife) => {
                let own = |(known, by): (&Known, &f64)| {
                    if known.experiments.len() == 1 { by * by } else { 0.0 }
                };
                let own: f64 = known.knowns.iter().zip(&by).map(own).sum();
                let noisy = jackknife.residual_std_error.min(std_error);
                let differ = (std_error.powi(2) - noisy.powi(2) - own).max(0.0).sqrt();
                let freedom = Some(jackknife.experiments as f64 - 1.0);
                lines.push(line("noise", noisy, freedom));
                lines.push(line("experiments", differ, freedom));
                (noisy.hypot(differ), freedom)
            }
            None => {
                lines.push(line("noise", std_error, freedom[j]));
                (std_error, freedom[j])
            }
        };
        if let Some(error) = discretization.get(j) {
            for (source, part) in [("mesh", error.mesh), ("step", error.step)] {
                let half = part.map(|part| part * value.abs() / 3.0_f64.sqrt());
                lines.extend(half.map(|half| line(source, half, None)));
            }
        }
        let variance: f64 = lines.iter().map(|line| line.share).sum();
        lines.iter_mut().for_each(|line| line.share /= variance.max(f64::MIN_POSITIVE));
        let combined = variance.max(0.0).sqrt();
        let coverage_factor = coverage(combined, (noisy, freedom));
        // The smallest positive number stands for zero.
        let [low, high] = estimate.name.limits();
        let low = if low > 0.0 && low < 1e-300 { 0.0 } else { low };
        let expanded =
            [-1.0, 1.0].map(|side| (value + side * coverage_factor * combined).clamp(low, high));
        Estimate {
            budget: lines,
            combined_std: Some(combined),
            coverage_factor: Some(coverage_factor),
            expanded95: Some(expanded),
            ..estimate
        }
    };
    estimates.into_iter().enumerate().map(with).collect()
}

/// How many combined standard uncertainties 95 % are, where only the part `noisy` has degrees of freedom
/// that count.
fn coverage(combined: f64, (noisy, freedom): (f64, Option<f64>)) -> f64 {
    let effective = freedom.map(|freedom| freedom * (combined / noisy).powi(4));
    quantile95(effective.filter(|effective| *effective < 1e6))
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// By Welch and Satterthwaite: as much again of what is known well makes 5 degrees of freedom 20.
    #[test]
    fn what_is_known_well_adds_degrees_of_freedom() {
        let t = |freedom| coverage(2.0_f64.sqrt(), (1.0, Some(freedom)));
        assert_relative_eq!(t(5.0), quantile95(Some(20.0)), max_relative = 1e-12);
        assert_relative_eq!(coverage(3.0, (3.0, Some(5.0))), 2.5706, max_relative = 1e-4);
        assert_relative_eq!(coverage(3.0, (0.0, Some(5.0))), quantile95(None));
    }
}
