//! Observations and model, residuals and their autocorrelation, coordinate by coordinate.

use crate::fit::{Abscissa, FitReport, ResidualTests, Series};
use crate::numerics::total_order;
use crate::page::chart::{Chart, labeled};
use crate::page::figure::{MODEL, OBSERVED, figure};
use crate::page::html::{escaped, folded, note};
use crate::page::number::{Scale, short};
use std::cmp::Reverse;

/// Lags of the autocorrelation, samples.
const LAGS: usize = 40;
/// With more coordinates than this only those with the largest residuals are drawn, and so many of them.
const MAX_SERIES: usize = 36;
const WORST_SERIES: usize = 12;
/// Coordinates that are not folded.
const UNFOLDED: usize = 6;

/// The size of the residuals, down-weighted observations, validation data and rows left out, a line each.
pub(super) fn summary(report: &FitReport) -> String {
    let series = report.plot_data.as_ref().map_or(&[][..], |e| &e.series);
    let unit = match series.iter().any(|s| s.unit == "m") || series.is_empty() {
        true => "m",
        // Series are in the unit of the data.
        false if series[0].unit == "Hz" => "rad/s",
        false => &series[0].unit,
    };
    let in_unit = |value: f64, unit: &str| {
        let (value, unit) = report.in_data_unit(value, unit);
        Scale::of(value, unit).with_unit(value, Some(0.01 * value))
    };
    let mut lines = vec![format!("RMS residual {}", in_unit(report.residual_rms, unit))];
    lines.extend(report.losses.iter().map(|l| {
        format!(
            "Robust loss, {}: {} of {} values down-weighted, {} beyond 5 \u{3c3}; standard errors \u{d7} {:.2} (included)",
            l.observation, l.down_weighted, l.values, l.beyond_5_sigma, l.std_error_factor
        )
    }));
    lines.extend(report.predictions.iter().map(|p| {
        let [rms, expected] = [p.rms, p.expected].map(|x| in_unit(x, &p.unit));
        format!("Validation data, {}: RMS error {rms}, {expected} expected", p.observation)
    }));
    let dropped = report.dropped.iter();
    lines.extend(dropped.map(|d| format!("Left out, {}: rows {}", d.observation, d.rows)));
    lines.iter().map(|line| note(&format!("{}.", escaped(line)))).collect()
}

/// All coordinates of all observations. `tests` are those of the residuals, where tests were made.
pub(super) fn all_series(series: &[Series], tests: Option<&[ResidualTests]>) -> String {
    if series.is_empty() {
        return "<p class=\"none\">no comparison of the whole record: the fit was interrupted</p>"
            .into();
    }
    let shown = worst(series);
    let mut html = String::new();
    if shown.len() < series.len() {
        html += &note(&format!(
            "The {} of {} coordinates with the largest residuals in units of \u{3c3}; the JSON has all.",
            shown.len(),
            series.len()
        ));
    }
    let [first, others] = match shown.len() > UNFOLDED + 1 {
        true => [&shown[..UNFOLDED], &shown[UNFOLDED..]],
        false => [&shown[..], &[]],
    };
    html += &drawn(first, tests);
    if !others.is_empty() {
        html += &folded(&format!("{} more coordinates", others.len()), &drawn(others, tests));
    }
    html
}

/// Coordinates under the names of their observations.
fn drawn(shown: &[&Series], tests: Option<&[ResidualTests]>) -> String {
    let mut html = String::new();
    let mut before = None;
    for series in shown {
        let name = name(series, ": ");
        if before.as_ref() != Some(&name) {
            html += &format!("<h3>{}</h3>\n", escaped(&name));
        }
        // Center lines are tested along their normal.
        let is_own = |t: &&ResidualTests| {
            t.observation == name && (t.axis == series.axis || t.axis == "normal")
        };
        html += &one_series(series, tests.map(|tests| tests.iter().find(is_own)));
        before = Some(name);
    }
    html
}

/// Experiment and observation of a coordinate.
fn name(series: &Series, separator: &str) -> String {
    let parts = [series.experiment.as_str(), series.label.as_str()];
    let parts: Vec<&str> = parts.into_iter().filter(|part| !part.is_empty()).collect();
    parts.join(separator)
}

/// All coordinates, or those with the largest residuals where there are many, in their order.
fn worst(series: &[Series]) -> Vec<&Series> {
    let variance = |s: &Series| {
        let residuals = s.residuals();
        residuals.iter().map(|r| r * r).sum::<f64>() / residuals.len().max(1) as f64
    };
    let mut ranked: Vec<(usize, f64)> = series.iter().map(variance).enumerate().collect();
    if ranked.len() > MAX_SERIES {
        ranked.sort_by_cached_key(|x| Reverse(total_order(x.1)));
        ranked.truncate(WORST_SERIES);
        ranked.sort_by_key(|(i, _)| *i);
    }
    ranked.into_iter().map(|(i, _)| &series[i]).collect()
}

/// Data and model, residuals, their autocorrelation and tests of one coordinate.
fn one_series(series: &Series, tests: Option<Option<&ResidualTests>>) -> String {
    let (unit, quantity) = match series.abscissa {
        Abscissa::Time => ("s", "time"),
        Abscissa::ArcLength => ("m", "arc length"),
        Abscissa::Mode => ("", "mode number"),
        Abscissa::Reading => ("", "reading number"),
    };
    let is_counted = matches!(series.abscissa, Abscissa::Mode | Abscissa::Reading);
    let across = match is_counted {
        true => Scale::of(1.0, unit),
        false => Scale::fitting(series.abscissa_values.iter().copied(), unit),
    };
    let up = Scale::fitting(series.observed.iter().copied(), &series.unit);
    let x_label = labeled(quantity, &across.unit);
    let at = |x: f64| x / across.factor;
    let points = |y: &[f64]| -> Vec<(f64, f64)> {
        series.abscissa_values.iter().zip(y).map(|(x, y)| (at(*x), y / up.factor)).collect()
    };
    let curve: Vec<(f64, f64)> = match series.curve.is_empty() {
        true => points(&series.simulated),
        false => series.curve.iter().map(|[x, y]| (at(*x), y / up.factor)).collect(),
    };
    let all: Vec<f64> = curve
        .iter()
        .map(|(x, _)| *x)
        .chain(series.abscissa_values.iter().map(|x| at(*x)))
        .collect();
    let axes = |y: String| {
        let chart = Chart::new(x_label.clone(), y).covering(all.iter().copied());
        if is_counted { chart.whole() } else { chart }
    };
    let both = axes(labeled(&series.axis, &up.unit)).size(680.0, 290.0);
    let both = match is_counted {
        true => both.dots("model", curve, MODEL, 6.0).dots(
            "observed",
            points(&series.observed),
            OBSERVED,
            3.5,
        ),
        false => both
            .dots("observed", points(&series.observed), OBSERVED, 2.6)
            .line("model", curve, MODEL),
    };
    let residuals = series.residuals();
    let left = axes("(model \u{2212} data) / \u{3c3}".into())
        .size(680.0, 200.0)
        .band(-2.0, 2.0)
        .level(0.0)
        .dots(
            "residual",
            series.abscissa_values.iter().zip(&residuals).map(|(x, r)| (at(*x), *r)),
            OBSERVED,
            2.6,
        );
    let sigma = Scale::of(series.sigma, &series.unit);
    let sigma = escaped(&sigma.with_unit(series.sigma, Some(0.01 * series.sigma)));
    let figure = |part: &str, chart: &Chart, caption: &str| {
        let title = format!("{}: {part}", series.axis);
        figure(&escaped(&title), &format!("{}, {title}", name(series, ", ")), chart, caption)
    };
    format!(
        "<div class=\"series\"><div>{}{}</div><div>{}{}</div></div>\n",
        figure("data and model", &both, ""),
        figure("residuals", &left, &format!("\u{3c3} = {sigma}; band: \u{b1}2 \u{3c3}")),
        match autocorrelation_chart(&residuals) {
            Some(chart) => figure(
                "residual autocorrelation",
                &chart,
                "band: \u{b1}1.96/\u{221a}n, 95 % of the values of white noise"
            ),
            None => String::new(),
        },
        tests.map_or(String::new(), |tests| tests.map_or(
            "<p class=\"none\">too few values to test for noise</p>".to_string(),
            probabilities,
        )),
    )
}

fn autocorrelation_chart(residuals: &[f64]) -> Option<Chart> {
    let lags = autocorrelation(residuals);
    let band = 1.96 / (residuals.len() as f64).max(1.0).sqrt();
    let chart = Chart::new("lag (samples)", "autocorrelation")
        .size(400.0, 290.0)
        .whole()
        .band(-band, band)
        .stems(lags.iter().copied(), OBSERVED)
        .dots("autocorrelation", lags.iter().copied(), OBSERVED, 3.0);
    (!lags.is_empty()).then_some(chart)
}

/// About zero: a fit has no mean of its own to remove.
fn autocorrelation(r: &[f64]) -> Vec<(f64, f64)> {
    let power: f64 = r.iter().map(|r| r * r).sum();
    let lags = LAGS.min(r.len() / 4);
    let at = |lag: usize| {
        let product: f64 = r.iter().zip(&r[lag..]).map(|(a, b)| a * b).sum();
        (lag as f64, product / power)
    };
    (1..=lags).map(at).collect()
}

fn probabilities(tests: &ResidualTests) -> String {
    let row = |name: &str, p: f64| {
        let class = if p < tests.significance_level { " class=\"bad\"" } else { "" };
        format!("<tr><th>{name}</th><td{class}>{}</td></tr>", short(p))
    };
    let class = if tests.passed { "good" } else { "bad" };
    format!(
        "<table class=\"tests\"><caption>Residual tests: p-values</caption>{}{}{}</table><p class=\"{class}\">{}</p>",
        row("independent (Ljung\u{2013}Box)", tests.whiteness),
        row("normal (Anderson\u{2013}Darling)", tests.normality),
        row("no trend", tests.trend),
        escaped(&tests.verdict),
    )
}
