//! The section "Parameters" of a page of a fit: value and all intervals of each parameter, with its prior, and bounds
//! and start value if plot data were kept.
//!
//! Input: the report of the fit. Intervals are the expanded and the statistical one, those between experiments (cluster
//! jackknife), and errors by observed information, by bootstrap and of the posterior distribution, where computed.
//! A table of 95 % intervals by method follows: linear, profile likelihood, bootstrap, posterior. Another one has the
//! estimates by each of several experiments, for parameters whose estimates differ by more than noise. The last one has
//! ratios such as stiffness over density that the data determine without the density. Output: HTML tables.

use crate::fit::{Estimate, FitReport, QuotedEstimate, compared_estimates, method_intervals};
use crate::page::chart::labeled;
use crate::page::estimate::{NOT_IDENTIFIABLE, estimate_scale, interval};
use crate::page::html::{note, subsection};
use crate::page::number::{MISSING, Scale, percent, quantity};
use crate::page::table::HtmlTable;

/// Experiments in the table of their estimates; the others are folded.
const SHOWN_EXPERIMENTS: usize = 12;

/// An error, SI, with a plus-minus sign, in the unit of the estimate and with the digits of its standard error.
fn plus_minus(e: &Estimate, error: f64) -> String {
    format!("\u{b1} {}", estimate_scale(e).format(error, e.std_error.or(Some(error))))
}

/// The ends, SI, of an interval as text in the unit of the estimate, with the digits that its standard error allows.
fn own_interval(e: &Estimate, ends: [f64; 2]) -> String {
    interval(ends, e.std_error, &estimate_scale(e))
}

/// The value as HTML, with the digits of its standard error, or with `no error` if it has none. Without a value a dash
/// if there is a one-sided lower bound, else `not identifiable`.
fn value_cell(e: &Estimate) -> String {
    let scale = estimate_scale(e);
    match (e.value, e.std_error) {
        (Some(value), Some(std)) => {
            format!("<b>{}</b>", scale.format(value, Some(std)))
        }
        (Some(value), None) => format!("<b>{}</b>, no error", scale.format(value, None)),
        (None, _) if e.lower95.is_some() => MISSING.into(),
        (None, _) => NOT_IDENTIFIABLE.into(),
    }
}

/// The HTML table of all parameters with the intervals that were computed, prior, bounds and start value; columns
/// without any content are left out. Below it are the intervals by method, the estimates by each experiment, where they
/// differ, and the table of ratios that the data determine without the density.
pub(super) fn parameters(report: &FitReport) -> String {
    let ranges = report.plot_data.as_ref().map_or(&[][..], |plots| &plots.ranges);
    let table = HtmlTable::new("parameters", report.parameters.iter().enumerate())
        .id("parameters")
        .text("parameter", |(_, e)| e.label())
        .html("value", |(_, e)| value_cell(e))
        .text("95 % interval (expanded)", |(_, e)| {
            let expanded = e.expanded95.filter(|_| QuotedEstimate::new(e).is_expanded);
            expanded.map(|ends| interval(ends, e.combined_std, &estimate_scale(e)))
        })
        .text("standard error (statistical)", |(_, e)| {
            e.value.and(e.std_error).map(|std| plus_minus(e, std))
        })
        .text("95 % interval (statistical)", |(_, e)| e.interval95.map(|x| own_interval(e, x)))
        .text("unit", |(_, e)| estimate_scale(e).unit)
        // Columns of analyses that were not made are empty, and left out.
        .text("between experiments, 95 %", |(_, e)| {
            e.cluster_jackknife.as_ref().map(|c| own_interval(e, c.interval95))
        })
        .text("residuals alone, 95 %", |(_, e)| {
            e.cluster_jackknife.as_ref().map(|c| own_interval(e, c.residual_interval95))
        })
        .text("observed information", |(_, e)| e.observed_std_error.map(|x| plus_minus(e, x)))
        .text("bootstrap", |(_, e)| Some(plus_minus(e, e.bootstrap.as_ref()?.std_error)))
        .text("posterior", |(_, e)| {
            let p = e.posterior.as_ref()?;
            let median = estimate_scale(e).format(p.median, Some(p.std_dev));
            Some(format!("{median} {}", plus_minus(e, p.std_dev)))
        })
        // Input of the fit: prior, bounds and start value.
        .text("prior", |(_, e)| {
            let prior = e.prior?;
            let shown = |x: f64| estimate_scale(e).format(x, Some(prior.sigma));
            Some(format!("{} \u{b1} {}", shown(prior.mean), shown(prior.sigma)))
        })
        .text("bounds", |(k, e)| {
            let [low, high] = ranges.get(*k)?.bounds?.map(|end| quantity(end, e.name.unit()));
            Some(format!("{low} \u{2026} {high}"))
        })
        .text("start", |(k, e)| Some(quantity(ranges.get(*k)?.start?, e.name.unit())));
    table.render()
        + &intervals_by_method(report)
        + &experiment_estimates(&report.parameters)
        + &density_free_ratios(report)
}

/// The HTML table of the 95 % intervals of all parameters by each method, under a heading; an open end of a profile is
/// `none`. Empty if only linear intervals were computed.
fn intervals_by_method(report: &FitReport) -> String {
    // From the estimates: stored reports of earlier versions have no list.
    let all = method_intervals(&report.parameters);
    let rows = all.iter().zip(&report.parameters);
    let closed = |e: &Estimate, ends: Option<[f64; 2]>| ends.map(|x| own_interval(e, x));
    let table = HtmlTable::new("intervals by method", rows)
        .id("methods")
        .text("parameter", |(own, _)| own.parameter.clone())
        .text("linear", |(own, e)| closed(e, own.linear95))
        .text("profile likelihood", |(own, e)| {
            let end = |x: f64| estimate_scale(e).format(x, e.std_error);
            let [low, high] = own.profile95?.map(|x| x.map_or("none".into(), end));
            Some(format!("[{low}, {high}]"))
        })
        .text("bootstrap", |(own, e)| closed(e, own.bootstrap95))
        .text("posterior", |(own, e)| closed(e, own.posterior95))
        .text("unit", |(_, e)| estimate_scale(e).unit)
        .text("R-hat", |(_, e)| Some(format!("{:.3}", e.posterior.as_ref()?.r_hat)))
        .text("effective draws", |(_, e)| {
            Some(format!("{:.0}", e.posterior.as_ref()?.effective_draws))
        });
    subsection("95 % intervals by method", &table.render())
}

/// The HTML table of the linearized estimates by the data of each experiment alone: a row per experiment, a column for
/// each parameter whose estimates differ by more than noise. Rows beyond [`SHOWN_EXPERIMENTS`] are folded; empty
/// without such a parameter.
fn experiment_estimates(estimates: &[Estimate]) -> String {
    let compared = compared_estimates(estimates);
    let Some(names) = compared.first().and_then(|e| e.cluster_jackknife.as_ref()) else {
        return String::new();
    };
    let mut table = HtmlTable::new("estimates by experiment", &names.estimates)
        .text("experiment", |own| own.experiment.clone());
    for e in compared {
        let scale = estimate_scale(e);
        let (heading, error) = (labeled(&e.label(), &scale.unit), e.std_error);
        table = table.text(&heading, move |own| {
            let all = &e.cluster_jackknife.as_ref()?.estimates;
            let value = all.iter().find(|other| other.experiment == own.experiment)?.value;
            Some(scale.format(value, error))
        });
    }
    let explanation = "By the data of each experiment alone, linearized: one Gauss\u{2013}Newton step from the common estimate.";
    subsection(
        "Estimates by experiment",
        &(table.render_folded(SHOWN_EXPERIMENTS, "experiments") + &note(explanation)),
    )
}

/// The HTML table of combinations of parameters that the data determine without the density, under a heading; empty
/// without any.
fn density_free_ratios(report: &FitReport) -> String {
    let groups = report.determined_groups.iter().filter(|group| group.interval95.is_none());
    let table = HtmlTable::new("ratios independent of the density", groups)
        .text("ratio", |group| group.name.clone())
        .text("value", |group| {
            let std = group.value * group.relative_std_error;
            Scale::for_size(group.value, &group.unit).format_with_unit(group.value, Some(std))
        })
        .text("standard error (noise, or between experiments)", |group| {
            percent(group.relative_std_error)
        });
    subsection("Independent of the density", &table.render())
}
