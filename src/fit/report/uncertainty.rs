//! Text of the uncertainty of the estimates, beyond the table of estimates.
//!
//! Input: a [`FitReport`]. Output: its summary with the discretization error of each parameter (correction and
//! remaining error), in per cent, or in the unit of a parameter that may be zero. Errors by other methods follow, as
//! far as they were computed: observed information, differences between experiments, bootstrap, posterior. A table has
//! the intervals by all methods. The table of estimates by each experiment is next, if the differences between them
//! give a reported interval. The strongest correlations (at most [`CORRELATIONS`]), ratios of parameters to the
//! density, uncertainty budgets and input sensitivities are last.

use crate::fit::report::estimate_table::is_from_clusters;
use crate::fit::report::experiment_estimates::add_experiment_estimates;
use crate::fit::report::method_table::method_table;
use crate::fit::report::{FitReport, budget, digits};
use crate::fit::uncertainty::estimate::Estimate;
use crate::fit::uncertainty::posterior::summary::Posterior;
use crate::fit::uncertainty::resampling::bootstrap::Bootstrap;
use crate::fit::uncertainty::warning_list::percent;
use crate::numerics::total_order;
use crate::summary::Summary;
use std::cmp::Reverse;

/// Ratio of the standard error between experiments to that of the residuals above which the experiments differ by more
/// than noise. A smaller ratio reports chance differences of few experiments.
const DIFFERENCE: f64 = 2.0;
/// Number of listed correlations, the strongest first.
const CORRELATIONS: usize = 6;

/// The `summary` with discretization errors, intervals by other methods, estimates by experiment, correlations, ratios
/// to the density (with the source of their error), budgets and input sensitivities. Each part is added only if the
/// `report` has it.
pub(super) fn add_uncertainty(mut summary: Summary, report: &FitReport) -> Summary {
    summary = summary.facts("Discretization error", discretization(report));
    summary = report.parameters.iter().fold(summary, add_intervals);
    if let Some(table) = method_table(report) {
        summary = summary.table("95 % intervals by method", table);
    }
    summary = add_experiment_estimates(summary, &report.parameters);
    summary = summary.facts("Correlation", correlations(report));
    // Combinations of parameters are in the table of estimates.
    let groups = report.determined_groups.iter().filter(|group| group.interval95.is_none());
    let is_compared = report.parameters.iter().any(is_from_clusters);
    let source = if is_compared { "between experiments" } else { "noise only" };
    let groups = groups.map(|group| format!("{group} ({source})"));
    summary = summary.facts("Independent of density", groups);
    summary = report.parameters.iter().fold(summary, budget::add_budget);
    budget::add_input_sensitivities(summary, &report.parameters)
}

/// The estimated discretization error of every parameter as text: its correction, if any, and the remaining error, in
/// per cent or in the unit of a parameter that may be zero. Parameters without an estimate of it are left out.
fn discretization(report: &FitReport) -> Vec<String> {
    let mut texts = Vec::new();
    for (e, error) in report.parameters.iter().zip(&report.discretization_error) {
        let Some(relative) = error.relative else { continue };
        // The relative error of a parameter that may be zero is converted to its unit.
        let size = |part: f64| match (e.name.is_positive(), e.value) {
            (false, Some(value)) => {
                format!("{:.1e} {}", part * value.abs(), e.name.unit()).trim_end().to_string()
            }
            _ => percent(part),
        };
        let most = size(relative);
        let at_most = if most.starts_with("more than") { "" } else { "at most " };
        let rest = format!("{at_most}{most} of {}", e.label());
        texts.push(match error.correction {
            Some(by) => {
                let sign = if by < 0.0 { "-" } else { "+" };
                let by = size(by.abs());
                format!("corrected by {sign}{by}; {rest} remains (in the interval)")
            }
            None => rest,
        });
    }
    texts
}

/// The `summary` with one fact for each other interval of an estimate that was computed: observed information,
/// differences between experiments, bootstrap and posterior (without their intervals). That of the differences has the
/// reason for the reported interval.
fn add_intervals(mut summary: Summary, e: &Estimate) -> Summary {
    let (unit, label) = (e.name.unit(), e.label());
    let error = e.std_error.unwrap_or(0.0);
    let interval = |error: f64, [low, high]: [f64; 2]| {
        let [size, low, high] = [error, low, high].map(|x| digits(x, error));
        format!("+- {size} {unit}, 95 % [{low}, {high}]")
    };
    // Its deviation from the reported error shows how far the model is from linear.
    if let Some(observed) = e.observed_std_error {
        let text = format!("{label} +- {} {unit}", digits(observed, error));
        summary = summary.fact("Observed information", text);
    }
    // The wider one of both intervals is reported in the table of estimates; the other one is shown for comparison.
    if let Some(across) = &e.cluster_jackknife {
        let experiments = interval(across.std_error, across.interval95);
        let residuals = interval(across.residual_std_error, across.residual_interval95);
        let source = format!("the differences between {} experiments", across.experiments);
        // The wider interval is reported; the other one is named with the reason.
        let text = match across.reported {
            true if across.std_error > DIFFERENCE * across.residual_std_error => format!(
                "{label}: from {source}, which exceed noise. The residuals alone give {residuals}, which is too narrow"
            ),
            true => format!("{label}: from {source}. The residuals alone give {residuals}"),
            false => format!(
                "{label}: from the residuals. From {source} follows {experiments}, which is narrower"
            ),
        };
        summary = summary.fact("Interval", text);
    }
    // Their intervals are in the table of all methods.
    if let Some(Bootstrap { std_error, .. }) = &e.bootstrap {
        let text = format!("{label} +- {} {unit}", digits(*std_error, *std_error));
        summary = summary.fact("Bootstrap", text);
    }
    if let Some(Posterior { median, std_dev, r_hat, effective_draws, .. }) = &e.posterior {
        let [median, spread] = [median, std_dev].map(|x| digits(*x, *std_dev));
        let quality = format!("R-hat {r_hat:.3}, {effective_draws:.0} effective draws");
        summary =
            summary.fact("Posterior", format!("{label} {median} +- {spread} {unit} ({quality})"));
    }
    summary
}

/// The correlations between two estimates as text, the largest magnitudes first, at most [`CORRELATIONS`]. Pairs
/// without a value are left out.
fn correlations(report: &FitReport) -> Vec<String> {
    let n = report.parameters.len();
    let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
    for (i, row) in report.correlation.iter().enumerate().take(n) {
        for (j, value) in row.iter().enumerate().take(i) {
            pairs.extend(value.map(|value| (value, j, i)));
        }
    }
    // The strongest correlations matter most for the interpretation.
    pairs.sort_by_cached_key(|x| Reverse(total_order(x.0.abs())));
    let label = |k: usize| report.parameters[k].label();
    let named = pairs.iter().take(CORRELATIONS);
    named.map(|(value, i, j)| format!("{value:+.3} {} and {}", label(*i), label(*j))).collect()
}
