//! The section "Global scan and local minima" of a page of a fit.
//!
//! Input are the report and, if kept, the plot data. First is the summary of the report on local minima, if it has one.
//! With plot data a figure for each parameter with three or more values in the scan shows the misfit relative to its
//! lowest. Another one shows the convergence: the RMS residual relative to the last one, over the cost in full
//! simulations, with a line for each stage. If at least two local minima were found, a table lists their values, their
//! misfit over the lowest one of the same model, and the stage that found them. Parameters that are not identifiable
//! are left out of it. Output is HTML.

use crate::fit::{FitReport, Landscape, LocalMinimum, MinimumSource, PlotData};
use crate::numerics::total_order;
use crate::page::chart::{ChartAxis, PageChart, Points};
use crate::page::figure::{MODEL, figure, row};
use crate::page::html::{capitalized, escaped, note};
use crate::page::number::{Scale, three_digits};
use crate::page::plane::range;
use crate::page::table::HtmlTable;

/// Local minima in the table that are shown at once; further ones are folded.
const SHOWN_MINIMA: usize = 5;
/// Stages of a search in their order, as the report names them. On the page the first is the "global scan", the third
/// the "growing part of the record".
const STAGES: [&str; 4] = ["scan", "coarse model", "growing horizon", "full model"];
/// A scan whose largest value exceeds its smallest by this ratio has a logarithmic axis.
const LOG_RATIO: f64 = 20.0;

/// The content of the section as HTML: the summary sentence, then with plot data the figures of scans and convergence,
/// and the table of local minima if there are two or more.
pub(super) fn search(report: &FitReport, plots: Option<&PlotData>) -> String {
    let summary = &report.local_minima.summary;
    let mut html = match summary.is_empty() {
        true => String::new(),
        false => format!("<p>{}.</p>\n", escaped(&capitalized(summary))),
    };
    let is_static = plots.is_some_and(|p| p.settings.iter().all(|s| s.step.is_none()));
    if let Some(plots) = plots {
        let scan = |landscape: &Landscape| {
            let own = report.parameters.iter().find(|e| e.label() == landscape.label);
            scan_figure(landscape, own.and_then(|e| e.value), is_static)
        };
        let scans: String = plots.landscape.iter().map(scan).collect();
        html += &row(&(scans + &convergence(plots)));
    }
    html + &minima(report, is_static)
}

/// The figure of the RMS residual, relative to the last one of the history, over the cost in full simulations. Each
/// stage of the search has a line with dots, in the order of the cost. Empty without iterations.
fn convergence(plots: &PlotData) -> String {
    let Some(last) = plots.history.last().map(|last| last.rms()) else { return String::new() };
    let mut iterates: Vec<_> = plots.history.iter().collect();
    // Descents from several minima interleave in the history.
    iterates.sort_by_cached_key(|x| total_order(x.simulations));
    let rms = ChartAxis::from("RMS residual / final one").log(true);
    let mut chart = PageChart::new("cost (full simulations)", rms, [520.0, 280.0]).covering([0.0]);
    for (k, stage) in STAGES.into_iter().enumerate() {
        let own = iterates.iter().filter(|i| i.stage == stage);
        let points: Points = own.map(|i| [i.simulations, i.rms() / last]).collect();
        let name = if k == 2 { "growing part of the record" } else { stage };
        let name = if k == 0 { "global scan" } else { name };
        chart = chart.dotted_line(name, points, &format!("var(--stage{k})"), 3.5);
    }
    let caption = "each over the part of the record that its stage uses";
    figure("Convergence", "convergence of the search", &chart, caption)
}

/// The figure of the scan's misfit, relative to its lowest, over one parameter, with its estimate `value` as a dashed
/// line. `is_static`: the fit has no motion, so that the scanned model is a coarse mesh; otherwise the scan covers the
/// first period only. The misfit is on a logarithmic axis, the parameter too if all its values are positive and their
/// ratio exceeds [`LOG_RATIO`]. The caption notes an estimate more than one step of the scan beside the lowest value.
fn scan_figure(landscape: &Landscape, value: Option<f64>, is_static: bool) -> String {
    let Landscape { label, name, values, misfit, .. } = landscape;
    let [smallest, largest] = range(values.iter().copied());
    let is_log = values.iter().all(|x| *x > 0.0) && largest.max(0.0) > LOG_RATIO * smallest;
    // Displayed numbers are those of the estimate, not of the end of a wide range.
    let scale = match value.filter(|_| is_log) {
        Some(value) => Scale::for_size(value, name.unit()),
        None => Scale::for_values(values.iter().copied(), name.unit()),
    };
    let [lowest, _] = range(misfit.iter().copied());
    let points: Points = values.iter().zip(misfit).map(|(x, y)| [*x, y / lowest]).collect();
    let y = ChartAxis::from("misfit / lowest misfit").log(true);
    let mut chart = PageChart::new(ChartAxis::new(label, &scale).log(is_log), y, [520.0, 280.0])
        .dotted_line("scan", points, MODEL, 3.0);
    if let Some(value) = value {
        chart = chart.mark(value);
    }
    let model = if is_static { "coarse mesh" } else { "coarse model over the first period" };
    let is_beside = value.is_some_and(|value| is_beside_minimum(landscape, value));
    let beside = match is_beside {
        true => {
            ". The estimate differs from the minimum of the scan, which has a coarse mesh; the search refined it"
        }
        false => "",
    };
    figure(
        &format!("Global scan over {label}"),
        &format!("global scan over {label}"),
        &chart,
        &format!("{model}, all other parameters at their optimum; dashed: the estimate{beside}"),
    )
}

/// Whether a value lies outside the interval between the two neighbors of the scan's value with the lowest misfit. At
/// the edge of the scan the interval ends there. False without a scan, or if values and misfits differ in number.
fn is_beside_minimum(landscape: &Landscape, value: f64) -> bool {
    let Landscape { values, misfit, .. } = landscape;
    let lowest = (0..misfit.len()).min_by(|i, j| misfit[*i].total_cmp(&misfit[*j]));
    let Some(lowest) = lowest.filter(|_| values.len() == misfit.len()) else { return false };
    // The scan resolves a minimum to one of its steps.
    let [low, high] = [lowest.saturating_sub(1), (lowest + 1).min(values.len() - 1)];
    !(values[low]..=values[high]).contains(&value)
}

/// The HTML table of the local minima: number or "reported", values of the identifiable parameters with units, misfit
/// over the lowest one, and source. Rows beyond [`SHOWN_MINIMA`] are folded. Empty if fewer than two were found. A note
/// follows if estimates were corrected for the discretization error, since these values are not.
fn minima(report: &FitReport, is_static: bool) -> String {
    let list = &report.local_minima.list;
    if list.len() < 2 {
        return String::new();
    }
    let is_corrected = report.discretization_error.iter().any(|e| e.correction.is_some());
    let mut table = HtmlTable::new("local minima", list.iter().zip(1..))
        .row_class(|(minimum, _)| if minimum.chosen { "chosen" } else { "" })
        .text("minimum", |(minimum, number)| match minimum.chosen {
            true => "reported".into(),
            false => number.to_string(),
        });
    // Values that the data do not determine are arbitrary.
    for (k, e) in report.parameters.iter().enumerate().filter(|(_, e)| e.identifiable) {
        table = table.text(&e.label(), |(minimum, _)| {
            let value = *minimum.values.get(k)?;
            let scale = Scale::for_size(value, e.name.unit());
            Some(scale.format_with_unit(value, Some(value * 1e-3)))
        });
    }
    table
        .text("misfit / lowest misfit", |(minimum, _)| three_digits(minimum.relative))
        .text("found by", |(minimum, _)| source(minimum, is_static).to_string())
        .render_folded(SHOWN_MINIMA, "local minima")
        + &note(if is_corrected {
            "Values before the correction of the discretization error."
        } else {
            ""
        })
}

/// The source of a local minimum as text: a fit of the whole record, with a remark if it did not converge, or the scan.
/// The model of the scan is a coarse mesh if `is_static`, and the first period otherwise.
fn source(minimum: &LocalMinimum, is_static: bool) -> &'static str {
    match minimum.found_by {
        MinimumSource::Fit if minimum.converged => "fit of the whole record",
        MinimumSource::Fit => "fit of the whole record, not converged",
        MinimumSource::Scan if is_static => "scan on a coarse mesh",
        MinimumSource::Scan => "scan over the first period",
    }
}
