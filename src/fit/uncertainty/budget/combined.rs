//! Uncertainty budget of the estimates (Guide to the Expression of Uncertainty in Measurement, GUM).
//!
//! Every source has a contribution in the unit of the parameter and a share of the combined variance; inputs also have
//! a sensitivity coefficient `c`, the derivative of the estimate by the input. Inputs that are
//! [known](crate::fit::Known) with standard uncertainties `u` and correlations `r` contribute the variance
//! `sum_ij c_i u_i r_ij c_j u_j`, with `c` from the
//! [sensitivities](crate::fit::uncertainty::budget::input_sensitivities) of the estimates. Other sources are the noise,
//! mesh and step (rectangular distributions: the discretization error over the root of 3). Differences between
//! experiments beyond the noise and their own inputs are one more, if the interval of the jackknife is the reported
//! one.
//!
//! [`add_budgets`] adds to every estimate with a value and a standard error its lines, the combined standard
//! uncertainty, the coverage factor and the expanded 95 % interval, within the limits of the parameter. The factor is
//! Student's t with the effective degrees of freedom of Welch and Satterthwaite. Nothing is added where the responses
//! to known inputs are unknown, or after an interruption. On request a Monte Carlo of fits verifies the budget; a
//! spread that differs by more than [`NOT_LINEAR`] and significantly adds a note.

use crate::code::Code;
use crate::fit::search::Search;
use crate::fit::search::fitted::Fitted;
use crate::fit::uncertainty::analysis::Analysis;
use crate::fit::uncertainty::budget::entries::{BudgetLine, MonteCarlo};
use crate::fit::uncertainty::budget::input_errors::InputErrors;
use crate::fit::uncertainty::discretization::errors::DiscretizationError;
use crate::fit::uncertainty::estimate::Estimate;
use crate::fit::uncertainty::noise::autocorrelation::NoiseModel;
use crate::fit::uncertainty::noise::coverage_factor::quantile95;
use crate::fit::uncertainty::resampling::bootstrap::{Bootstrap, Resampling, spreads};
use crate::fit::uncertainty::warning_list::{Severity, Warnings};
use nalgebra::DVector;

/// Relative difference between the spread of a Monte Carlo and the budget above which it is reported, if it is
/// significant.
const NOT_LINEAR: f64 = 0.1;
/// Standard errors of the spread by which it must differ from the budget to be significant.
const SIGNIFICANT_SPREAD: f64 = 3.0;
/// Degrees of freedom from which on the coverage factor is that of the normal distribution.
const MANY: f64 = 1e6;
/// Largest positive lower limit of a parameter that stands for zero: limits of positive parameters are the smallest
/// numbers.
const ZERO_LIMIT: f64 = 1e-300;

/// Sources of a budget.
#[derive(Clone, Copy)]
pub(crate) struct BudgetInputs<'a> {
    /// Known inputs with the responses to them; none where the responses could not be computed.
    pub known: Option<&'a InputErrors<'a>>,
    pub analysis: &'a Analysis,
    /// Discretization error of each unknown; empty: none.
    pub discretization: &'a [DiscretizationError],
    /// Standard deviation of the noise of each measurement, in its unit.
    pub sigma: &'a [f64],
    /// Noise, with its degrees of freedom for each unknown.
    pub correlations: &'a NoiseModel,
}

/// Sets the budget of every estimate, and the spread over Monte Carlo fits with random inputs and noise if the analysis
/// requests them. A spread that differs significantly from the budget adds a note. Nothing changes after an
/// interruption, without the responses to known inputs, or where no estimate has a standard error.
pub(crate) fn add_budgets(
    estimates: &mut [Estimate],
    fitted: Fitted,
    inputs: BudgetInputs,
    warnings: &mut Warnings,
) {
    let search = fitted.search;
    let BudgetInputs { known, analysis, discretization, sigma, correlations } = inputs;
    let Some(known) = known.filter(|_| !search.is_stopped()) else { return };
    if estimates.iter().all(|e| e.std_error.is_none()) {
        return;
    }
    // The linear budget of each estimate.
    for (j, estimate) in estimates.iter_mut().enumerate() {
        let freedom = correlations.degrees_of_freedom[j];
        add_budget(estimate, search, j, freedom, discretization.get(j), known);
    }
    // Fits with random inputs and noise show whether the response is linear.
    if analysis.monte_carlo > 0 {
        let resampling = Resampling {
            name: "Monte Carlo",
            numbers: 0..analysis.monte_carlo,
            seed: analysis.seed,
            stores_estimates: false,
            sigma,
            knowns: known.knowns,
            correlations,
            draws_blocks: false,
        };
        let spreads = spreads(fitted, &resampling, warnings);
        add_monte_carlo(estimates, search, known, analysis.monte_carlo, spreads, warnings);
    }
}

/// Sets the spread of the estimates over this number of Monte Carlo `fits`, beside the standard deviation that noise
/// and inputs predict. The number includes failed fits, which have no part in the spread. The prediction is the root of
/// the sum of squares of both, with the noise by the residuals and not by the jackknife. A spread that differs from the
/// prediction by more than [`NOT_LINEAR`], and by more than [`SIGNIFICANT_SPREAD`] of its relative standard errors
/// `1/sqrt(2 fits)`, adds a note. Estimates without a value, a standard error or a spread are skipped.
fn add_monte_carlo(
    estimates: &mut [Estimate],
    search: &Search,
    known: &InputErrors,
    fits: usize,
    spreads: Vec<Option<Bootstrap>>,
    warnings: &mut Warnings,
) {
    for (j, (estimate, spread)) in estimates.iter_mut().zip(spreads).enumerate() {
        let (Some(value), Some(std_error), Some(spread)) =
            (estimate.value, estimate.std_error, spread)
        else {
            continue;
        };
        // Experiments do not differ in simulated data.
        let jackknife = estimate.cluster_jackknife.as_ref();
        let noise = jackknife.map_or(std_error, |jackknife| jackknife.residual_std_error);
        let inputs = known.variance(j).sqrt() * search.unknowns[j].slope(value);
        let (std, linear_std) = (spread.std_error, noise.hypot(inputs));
        // The standard deviation of n values has the relative standard error 1/sqrt(2 n).
        let chance = SIGNIFICANT_SPREAD / (2.0 * fits as f64).sqrt();
        if (std / linear_std - 1.0).abs() > chance.max(NOT_LINEAR) {
            let text = format!(
                "{}: the Monte Carlo spread is {:.2} times that of the budget. The model is not linear over the \
                 input errors. Quote the Monte Carlo interval",
                estimate.label(),
                std / linear_std
            );
            warnings.add(Severity::Note, Code::BudgetNotLinear, text);
        }
        let interval95 = spread.interval95;
        estimate.monte_carlo = Some(MonteCarlo { fits, std, interval95, linear_std });
    }
}

/// Sets the budget of unknown `j`, its combined standard uncertainty, coverage factor and expanded interval. Lines:
/// each known input, the noise, differences between experiments if the jackknife is reported, then mesh and step.
/// Shares are fractions of the combined variance. `noise_freedom` are the degrees of freedom of the noise; none: a
/// known noise. `discretization` is the error by mesh and step, if there is one. The expanded interval is cut at the
/// limits of the parameter. Nothing is set without a value or a standard error.
fn add_budget(
    estimate: &mut Estimate,
    search: &Search,
    j: usize,
    noise_freedom: Option<f64>,
    discretization: Option<&DiscretizationError>,
    known: &InputErrors,
) {
    let (Some(value), Some(std_error)) = (estimate.value, estimate.std_error) else { return };
    let unknown = &search.unknowns[j];
    let line =
        |source: &str, size: f64, freedom| BudgetLine::new(estimate.name, source, size, freedom);
    // Inputs: signed contributions, and shares with their correlations.
    let contributions: DVector<f64> = known.responses_of(j) * unknown.slope(value);
    let shares = (&known.correlations * &contributions).component_mul(&contributions);
    let mut lines: Vec<BudgetLine> = Vec::new();
    for (i, input) in known.knowns.iter().enumerate() {
        let sensitivity = contributions[i] / input.sigma;
        let size = known.values[i].filter(|size| *size != 0.0);
        let relative = size.map(|size| sensitivity * size / value);
        lines.push(BudgetLine {
            std: Some(input.sigma),
            unit: input.parameter.unit().into(),
            sensitivity: Some(sensitivity),
            relative_sensitivity: relative.filter(|_| unknown.parameter.is_positive()),
            share: shares[i],
            ..line(&input.label(), contributions[i].abs(), None)
        });
    }
    // Noise and differences between experiments have the degrees of freedom of these differences together. Inputs of
    // one experiment are a part of the differences.
    let jackknife = estimate.cluster_jackknife.as_ref().filter(|jackknife| jackknife.reported);
    let (scatter, freedom) = match jackknife {
        Some(jackknife) => {
            let inputs = known.knowns.iter().zip(&contributions);
            let own = inputs.filter(|(known, _)| known.experiments.len() == 1);
            let own: f64 = own.map(|(_, contribution)| contribution * contribution).sum();
            // With few degrees of freedom the wider interval may have the smaller standard error.
            let noise = jackknife.residual_std_error.min(std_error);
            let differences = (std_error.powi(2) - noise.powi(2) - own).max(0.0).sqrt();
            let freedom = Some(jackknife.experiments as f64 - 1.0);
            lines.push(line("noise", noise, freedom));
            lines.push(line("experiments", differences, freedom));
            (noise.hypot(differences), freedom)
        }
        None => {
            lines.push(line("noise", std_error, noise_freedom));
            (std_error, noise_freedom)
        }
    };
    // Discretization errors are bounds of unknown sign: their distributions are rectangular.
    if let Some(error) = discretization {
        for (source, relative) in [("mesh", error.mesh), ("step", error.step)] {
            let size = relative.map(|relative| relative * value.abs() / 3.0_f64.sqrt());
            lines.extend(size.map(|size| line(source, size, None)));
        }
    }
    let variance: f64 = lines.iter().map(|line| line.share).sum();
    lines.iter_mut().for_each(|line| line.share /= variance.max(f64::MIN_POSITIVE));
    let combined = variance.max(0.0).sqrt();
    let coverage_factor = effective_coverage_factor(combined, scatter, freedom);
    // The smallest positive number as a limit represents zero.
    let [low, high] = estimate.name.limits();
    let low = if low > 0.0 && low < ZERO_LIMIT { 0.0 } else { low };
    let expanded =
        [-1.0, 1.0].map(|side| (value + side * coverage_factor * combined).clamp(low, high));
    estimate.budget = lines;
    estimate.combined_std = Some(combined);
    estimate.coverage_factor = Some(coverage_factor);
    estimate.expanded95 = Some(expanded);
}

/// Coverage factor of a `combined` standard uncertainty, of which the part `scatter` has `freedom` degrees of freedom
/// (none: known) and the rest infinitely many: the two-sided 95 % quantile of Student's t at `freedom
/// (combined/scatter)^4`. From [`MANY`] on, and without `freedom`, it is that of the normal distribution.
fn effective_coverage_factor(combined: f64, scatter: f64, freedom: Option<f64>) -> f64 {
    let effective = freedom.map(|freedom| freedom * (combined / scatter).powi(4));
    quantile95(effective.filter(|effective| *effective < MANY))
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// Welch and Satterthwaite: with a second part of equal size and infinite degrees of freedom 5 become 20. The t
    /// quantile of 5 is 2.5706.
    #[test]
    fn sources_with_infinite_freedom_increase_the_effective_freedom() {
        let factor = effective_coverage_factor(2.0_f64.sqrt(), 1.0, Some(5.0));
        assert_relative_eq!(factor, quantile95(Some(20.0)), max_relative = 1e-12);
        let factor = effective_coverage_factor(3.0, 3.0, Some(5.0));
        assert_relative_eq!(factor, 2.5706, max_relative = 1e-4);
        assert_relative_eq!(effective_coverage_factor(3.0, 0.0, Some(5.0)), quantile95(None));
    }
}
