//! All intervals of the parameters, with their priors, bounds and start values.

use crate::fit::{Estimate, FitReport, QuotedEstimate};
use crate::page::estimate::{interval, scale};
use crate::page::html::escaped;
use crate::page::number::{NONE, Scale, percent, quantity};
use crate::page::table::Table;

/// The table of all parameters.
pub(super) fn parameters(report: &FitReport) -> String {
    let heads = [
        "parameter",
        "value \u{b1} standard error (statistical)",
        "95 % interval (statistical)",
        "unit",
        "95 % interval (expanded)",
        "between experiments, 95 %",
        "residuals alone, 95 %",
        "observed information",
        "profile likelihood, 95 %",
        "bootstrap",
        "prior",
        "bounds",
        "start",
    ];
    let mut table = Table::new("parameters", heads).id("parameters");
    for (i, e) in report.parameters.iter().enumerate() {
        let scale = scale(e);
        let range = report.plot_data.as_ref().and_then(|plots| plots.ranges.get(i));
        let bounds = range.and_then(|range| range.bounds);
        let start = range.and_then(|range| range.start);
        let mut cells = intervals(e, &scale);
        cells.push(bounds.map(|ends| {
            let [low, high] = ends.map(|end| quantity(end, e.name.unit()));
            escaped(&format!("{low} \u{2026} {high}"))
        }));
        cells.push(start.map(|start| escaped(&quantity(start, e.name.unit()))));
        table.row(escaped(&e.label()), cells);
    }
    table.html() + &groups(report)
}

fn intervals(e: &Estimate, scale: &Scale) -> Vec<Option<String>> {
    let std = e.std_error;
    let plus_minus = |error: f64| format!("\u{b1} {}", scale.show(error, std.or(Some(error))));
    let value = match (e.value, std) {
        (Some(value), Some(_)) => {
            let error = std.map_or(String::new(), plus_minus);
            format!("<b>{}</b> {error}", scale.show(value, std))
        }
        (Some(value), None) => format!("<b>{}</b>, no error", scale.show(value, None)),
        (None, _) if e.lower95.is_some() => NONE.into(),
        (None, _) => "<td class=\"bad\">not identifiable</td>".into(),
    };
    let across = e.cluster_jackknife.as_ref();
    let expanded = e.expanded95.filter(|_| QuotedEstimate::of(e).is_expanded);
    let profile = e.profile95.map(|ends| {
        let end = |x: Option<f64>| x.map_or("none".into(), |x| scale.show(x, std));
        format!("[{}, {}]", end(ends[0]), end(ends[1]))
    });
    let prior = e.prior.map(|prior| {
        let sigma = Some(prior.sigma);
        format!("{} \u{b1} {}", scale.show(prior.mean, sigma), scale.show(prior.sigma, sigma))
    });
    vec![
        Some(value),
        e.interval95.map(|ends| interval(ends, std, scale)),
        Some(escaped(&scale.unit)),
        expanded.map(|ends| interval(ends, e.combined_std, scale)),
        across.map(|across| interval(across.interval95, std, scale)),
        across.map(|across| interval(across.residual_interval95, std, scale)),
        e.observed_std_error.map(plus_minus),
        profile,
        e.bootstrap.as_ref().map(|b| {
            format!("{}, {}", plus_minus(b.std_error), interval(b.interval95, std, scale))
        }),
        prior,
    ]
}

/// Ratios that the data determine without the density.
fn groups(report: &FitReport) -> String {
    let mut table =
        Table::new("ratios known without the density", ["ratio", "value", "standard error"]);
    for group in report.determined_groups.iter().filter(|group| group.interval95.is_none()) {
        let std = group.value * group.relative_std_error;
        let value = Scale::of(group.value, &group.unit).with_unit(group.value, Some(std));
        table.row(
            escaped(&group.name),
            vec![Some(escaped(&value)), Some(percent(group.relative_std_error))],
        );
    }
    match table.html() {
        html if html.is_empty() => html,
        html => format!("<h3>Known without the density</h3>\n{html}"),
    }
}
