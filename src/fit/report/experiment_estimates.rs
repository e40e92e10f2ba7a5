//! Table of the estimates by each of several experiments, where these differ by more than the residuals explain.
//!
//! Input: the estimates of a fit with their cluster jackknife. If the reported interval of any parameter is that of the
//! differences between experiments, the output is the summary with a table. It has a row for each experiment that has
//! estimates of its own, at most [`LISTED`]; the title counts the others. It has a column for each parameter with such
//! estimates, in its unit. Otherwise the summary is unchanged. [`compared_estimates`] returns these parameters. The
//! estimates by an experiment are those of one Gauss-Newton step from the common estimate with its data alone.

use crate::fit::report::digits;
use crate::fit::uncertainty::estimate::Estimate;
use crate::summary::{Summary, SummaryTable, TextColumn};

/// Most experiments in the table; the JSON has all.
const LISTED: usize = 12;

/// The parameters with estimates by each experiment, in their order, if the reported interval of any parameter is that
/// of the differences between experiments; empty otherwise.
pub(crate) fn compared_estimates(estimates: &[Estimate]) -> Vec<&Estimate> {
    let jackknife =
        |e: &&Estimate| e.cluster_jackknife.as_ref().is_some_and(|c| !c.estimates.is_empty());
    let is_reported = |e: &Estimate| e.cluster_jackknife.as_ref().is_some_and(|c| c.reported);
    match estimates.iter().any(is_reported) {
        true => estimates.iter().filter(jackknife).collect(),
        false => Vec::new(),
    }
}

/// The text of the estimate of a parameter by the experiment with this name, with digits by the smaller one of the
/// standard errors between experiments and of the residuals. `None` without an estimate.
fn own_estimate(e: &Estimate, experiment: &str) -> Option<String> {
    let jackknife = e.cluster_jackknife.as_ref()?;
    let own = jackknife.estimates.iter().find(|own| own.experiment == experiment)?;
    Some(digits(own.value, jackknife.std_error.min(jackknife.residual_std_error)))
}

/// The `summary` with a table of the estimates by each experiment alone: one row per experiment, at most [`LISTED`]
/// (the title counts the others), one column per compared parameter with its unit. Unchanged if no interval is from the
/// differences between experiments.
pub(super) fn add_experiment_estimates(summary: Summary, estimates: &[Estimate]) -> Summary {
    let compared = compared_estimates(estimates);
    let Some(names) = compared.first().and_then(|e| e.cluster_jackknife.as_ref()) else {
        return summary;
    };
    // A pure number has no unit.
    let heads = compared.iter().map(|e| match e.name.unit() {
        "" => TextColumn::right(e.label()),
        unit => TextColumn::right(format!("{}, {unit}", e.label())),
    });
    let mut table = SummaryTable::new(std::iter::once(TextColumn::left("experiment")).chain(heads));
    for own in names.estimates.iter().take(LISTED) {
        let values = compared.iter().map(|e| own_estimate(e, &own.experiment).unwrap_or_default());
        table.row(std::iter::once(own.experiment.clone()).chain(values));
    }
    let more = match names.estimates.len().saturating_sub(LISTED) {
        0 => String::new(),
        more => format!("; {more} more in the JSON"),
    };
    summary.table(format!("Estimates by each experiment alone, linearized{more}"), table)
}
