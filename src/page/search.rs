//! The global scan, the local minima it found, and the convergence to the reported one.

use crate::fit::{FitReport, Landscape, LocalMinimum, MinimumSource, PlotData};
use crate::numerics::total_order;
use crate::page::chart::{Chart, labeled};
use crate::page::figure::{MODEL, figure, row};
use crate::page::html::{capitalized, escaped};
use crate::page::number::{Scale, short};
use crate::page::table::Table;

/// Local minima that are not folded.
const SHOWN: usize = 5;
/// Stages of a search in their order, and their names on the page.
const STAGES: [(&str, &str); 4] = [
    ("scan", "global scan"),
    ("coarse model", "coarse model"),
    ("growing horizon", "growing horizon"),
    ("full model", "full model"),
];
/// Values of a scan over more than this ratio have a logarithmic axis.
const WIDE_RATIO: f64 = 20.0;

/// The section's content.
pub(super) fn search(report: &FitReport, plots: Option<&PlotData>) -> String {
    let summary = &report.local_minima.summary;
    let mut html = match summary.is_empty() {
        true => String::new(),
        false => format!("<p>{}.</p>\n", escaped(&capitalized(summary))),
    };
    if let Some(plots) = plots {
        let moves = plots.settings.iter().any(|settings| settings.step.is_some());
        let scan = |landscape: &Landscape| {
            let own = report.parameters.iter().find(|e| e.label() == landscape.label);
            one_scan(landscape, own.and_then(|e| e.value), moves)
        };
        let scans: String = plots.landscape.iter().map(scan).collect();
        html += &row(&(scans + &convergence(plots)));
    }
    html + &minima(report, plots)
}

/// The RMS residual over the cost, forwards, with a line of its own for every stage.
fn convergence(plots: &PlotData) -> String {
    let Some(last) = plots.history.last().map(|last| last.rms()) else { return String::new() };
    let mut iterates: Vec<_> = plots.history.iter().collect();
    iterates.sort_by_cached_key(|x| total_order(x.simulations));
    let mut chart = Chart::new("cost (full simulations)", "RMS residual / final one")
        .log(false, true)
        .size(520.0, 280.0)
        .covering([0.0]);
    for (k, (stage, name)) in STAGES.iter().enumerate() {
        let color = format!("var(--stage{k})");
        let own = iterates.iter().filter(|i| i.stage == *stage);
        let own: Vec<(f64, f64)> = own.map(|i| (i.simulations, i.rms() / last)).collect();
        chart = chart.line("", own.iter().copied(), &color).dots(name, own, &color, 3.5);
    }
    let caption = "each over the part of the record that its stage uses";
    figure("Convergence", "convergence of the search", &chart, caption)
}

/// The misfit of the scan over one parameter. A scan of motions (`moves`) covers their first period only.
fn one_scan(landscape: &Landscape, value: Option<f64>, moves: bool) -> String {
    let values = &landscape.values;
    let least = values.iter().copied().fold(f64::INFINITY, f64::min);
    let largest = values.iter().copied().fold(0.0, f64::max);
    let log = values.iter().all(|x| *x > 0.0) && largest > WIDE_RATIO * least;
    let scale = match (log, value) {
        (true, Some(value)) => Scale::of(value, landscape.name.unit()),
        _ => Scale::fitting(values.iter().copied(), landscape.name.unit()),
    };
    let lowest = landscape.misfit.iter().copied().fold(f64::INFINITY, f64::min);
    let points: Vec<(f64, f64)> =
        values.iter().zip(&landscape.misfit).map(|(x, y)| (x / scale.factor, y / lowest)).collect();
    let mut chart = Chart::new(labeled(&landscape.label, &scale.unit), "misfit / lowest misfit")
        .log(log, true)
        .size(520.0, 280.0)
        .line("", points.clone(), MODEL)
        .dots("scan", points, MODEL, 3.0);
    if let Some(value) = value {
        chart = chart.mark(value / scale.factor);
    }
    let model = if moves { "coarse model over the first period" } else { "coarse mesh" };
    let beside = value.is_some_and(|value| is_beside_the_minimum(landscape, value));
    let beside = match beside {
        true => {
            ". The estimate is not at the minimum of the scan: the minimum of the coarse mesh is elsewhere"
        }
        false => "",
    };
    figure(
        &format!("Global scan over {}", escaped(&landscape.label)),
        &format!("global scan over {}", landscape.label),
        &chart,
        &format!("{model}, all other parameters at their optimum; dashed: the estimate{beside}"),
    )
}

/// Whether a value lies more than a step of the scan away from the minimum of the scan.
fn is_beside_the_minimum(landscape: &Landscape, value: f64) -> bool {
    let Landscape { values, misfit, .. } = landscape;
    let least = (0..misfit.len()).min_by(|i, j| misfit[*i].total_cmp(&misfit[*j]));
    let Some(least) = least.filter(|_| values.len() == misfit.len()) else { return false };
    let [low, high] = [least.saturating_sub(1), (least + 1).min(values.len() - 1)];
    !(values[low]..=values[high]).contains(&value)
}

/// A table of the local minima; nothing where only one was found.
fn minima(report: &FitReport, plots: Option<&PlotData>) -> String {
    let list = &report.local_minima.list;
    if list.len() < 2 {
        return String::new();
    }
    let labels = report.parameters.iter().map(|e| escaped(&e.label()));
    let heads = ["minimum".to_string()].into_iter().chain(labels);
    let heads = heads.chain(["misfit / lowest misfit".into(), "found by".into()]);
    let mut table = Table::new("local minima", heads);
    let is_static = plots.is_some_and(|p| p.settings.iter().all(|s| s.step.is_none()));
    for (k, basin) in list.iter().enumerate() {
        let value = |(value, e): (&f64, &crate::fit::Estimate)| {
            Some(escaped(&Scale::of(*value, e.name.unit()).with_unit(*value, Some(value * 1e-3))))
        };
        let mut cells: Vec<Option<String>> =
            basin.values.iter().zip(&report.parameters).map(value).collect();
        cells.push(Some(short(basin.relative)));
        cells.push(Some(found_by(basin, is_static).into()));
        let (class, heading) =
            if basin.chosen { ("chosen", "reported".into()) } else { ("", (k + 1).to_string()) };
        table.marked_row(class, heading, cells);
    }
    table.folded_after(SHOWN, "local minima")
}

fn found_by(basin: &LocalMinimum, is_static: bool) -> &'static str {
    match basin.found_by {
        MinimumSource::Fit if basin.converged => "fit of the whole record",
        MinimumSource::Fit => "fit of the whole record, not converged",
        MinimumSource::Scan if is_static => "scan on a coarse mesh",
        MinimumSource::Scan => "scan over the first period",
    }
}
