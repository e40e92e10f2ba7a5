//! The section "Residuals": observed and simulated values, residuals over sigma, their autocorrelation, and their
//! tests.
//!
//! Input: the series of the plot data, and of fits the report and the tests. Each coordinate of an observation has two
//! charts (values; residuals) over time, arc length, load, or the number of a mode or reading. Beside them are a chart
//! of the autocorrelation with the 95 % band of white noise, and of fits p-values of Ljung-Box, Anderson-Darling and
//! trend tests. Coordinates whose residuals are all zero are left out, unless all are. Of more than [`MAX_SERIES`]
//! coordinates only the [`WORST_SERIES`] with the largest residuals are drawn. Notes (`summary`) have the RMS residual,
//! down-weighted and omitted data, and errors of validation data. Pages of fits, field fits and predictions use it.
//! Output: HTML.

use crate::fit::{Abscissa, FitReport, ResidualTests, Series};
use crate::numerics::total_order;
use crate::page::chart::{ChartAxis, PageChart, Points};
use crate::page::figure::{MODEL, OBSERVED, figure};
use crate::page::html::{escaped, folded, no_data, note, subsection};
use crate::page::number::{Scale, three_digits};
use std::cmp::Reverse;

/// Largest lag of the autocorrelation that is drawn, samples.
const LAGS: usize = 40;
/// Most coordinates of which all are drawn; hundreds of charts would make the page slow.
const MAX_SERIES: usize = 36;
/// Coordinates that are drawn of more than [`MAX_SERIES`]: those with the largest residuals.
const WORST_SERIES: usize = 12;
/// Coordinates that are shown at once; further ones are folded.
const UNFOLDED_SERIES: usize = 6;

/// Notes on the residuals of a fit, as HTML: their RMS in the unit of the data, down-weighted observations, errors of
/// validation data with their expected size, and rows of files that were left out.
pub(super) fn summary(report: &FitReport) -> String {
    let series = report.plot_data.as_ref().map_or(&[][..], |e| &e.series);
    let unit = match series.iter().any(|s| s.unit == "m") || series.is_empty() {
        true => "m",
        // Series are in the unit of the data, the RMS residual is in SI units.
        false if series[0].unit == "Hz" => "rad/s",
        false => &series[0].unit,
    };
    let in_unit = |value: f64, unit: &str| {
        let (value, unit) = report.in_data_unit(value, unit);
        Scale::for_size(value, unit).format_with_unit(value, Some(0.01 * value))
    };
    let mut lines = vec![format!("RMS residual {}", in_unit(report.residual_rms, unit))];
    lines.extend(report.losses.iter().map(|l| {
        format!(
            "Robust loss, {}: {} of {} values down-weighted, {} beyond 5 \u{3c3}; standard errors multiplied by {:.2} (already applied)",
            l.observation, l.down_weighted, l.values, l.beyond_5_sigma, l.std_error_factor
        )
    }));
    lines.extend(report.predictions.iter().map(|p| {
        let [rms, expected] = [p.rms, p.expected].map(|x| in_unit(x, &p.unit));
        format!("Validation data, {}: RMS error {rms}, {expected} expected from sigma and the parameter errors", p.observation)
    }));
    let dropped = report.dropped.iter();
    lines.extend(dropped.map(|d| format!("Left out, {}: rows {}", d.observation, d.rows)));
    lines.iter().map(|line| note(&format!("{}.", escaped(line)))).collect()
}

/// Charts of all coordinates of all observations, or of the worst of many, as HTML; those beyond [`UNFOLDED_SERIES`]
/// are folded, except a single one. Coordinates whose residuals are all zero are left out, unless all are. A note
/// without series. `tests` are those of the residuals, if any were made.
pub(super) fn all_series(series: &[Series], tests: Option<&[ResidualTests]>) -> String {
    if series.is_empty() {
        return no_data("no comparison of the whole record: the fit was interrupted");
    }
    // A page with hundreds of charts would be slow.
    let mut shown = drawn_series(series);
    let mut html = String::new();
    let is_exact = |s: &&Series| s.residuals().iter().all(|r| *r == 0.0);
    let exact = shown.iter().copied().filter(is_exact).count();
    // A coordinate normal to the plane of the motion has no information.
    if exact > 0 && exact < shown.len() {
        shown.retain(|s| !is_exact(s));
        html += &note(
            "Coordinates without any residual, normal to the plane of the motion, are left out.",
        );
    }
    if shown.len() + exact < series.len() {
        html += &note(&format!(
            "The {} of {} coordinates with the largest residuals in units of \u{3c3}; the JSON has all.",
            shown.len(),
            series.len()
        ));
    }
    match shown.split_at_checked(UNFOLDED_SERIES) {
        Some((first, others)) if others.len() > 1 => {
            let summary = format!("Show {} more coordinates", others.len());
            html + &observations(first, tests) + &folded(&summary, &observations(others, tests))
        }
        _ => html + &observations(&shown, tests),
    }
}

/// The charts of coordinates under the names of their observations (HTML). Each has the table of its tests (for center
/// lines of the test along their normal), or a note if there is none; without `tests` it has neither.
fn observations(shown: &[&Series], tests: Option<&[ResidualTests]>) -> String {
    let mut html = String::new();
    for observation in shown.chunk_by(|a, b| name(a, ": ") == name(b, ": ")) {
        let name = name(observation[0], ": ");
        let tested_coordinate = |series: &&Series| {
            // Center lines are tested along their normal.
            let is_own = |t: &&ResidualTests| {
                t.observation == name && (t.axis == series.axis || t.axis == "normal")
            };
            let tests = tests.map(|tests| match tests.iter().find(is_own) {
                Some(tests) => test_table(tests),
                None => no_data("too few values to test for noise"),
            });
            coordinate(series, &tests.unwrap_or_default())
        };
        html += &subsection(&name, &observation.iter().map(tested_coordinate).collect::<String>());
    }
    html
}

/// The names of the experiment and of the observation of a coordinate, joined by a separator; an empty one is left out.
fn name(series: &Series, separator: &str) -> String {
    let mut parts = vec![series.experiment.as_str(), series.label.as_str()];
    parts.retain(|part| !part.is_empty());
    parts.join(separator)
}

/// All coordinates, or of more than [`MAX_SERIES`] the [`WORST_SERIES`] with the largest RMS residuals over sigma, in
/// their order.
fn drawn_series(series: &[Series]) -> Vec<&Series> {
    let variance = |s: &Series| {
        let residuals = s.residuals();
        residuals.iter().map(|r| r * r).sum::<f64>() / residuals.len().max(1) as f64
    };
    let mut ranked: Vec<usize> = (0..series.len()).collect();
    // The worst coordinates show a wrong model first.
    if ranked.len() > MAX_SERIES {
        ranked.sort_by_cached_key(|i| Reverse(total_order(variance(&series[*i]))));
        ranked.truncate(WORST_SERIES);
        ranked.sort_unstable();
    }
    ranked.into_iter().map(|i| &series[i]).collect()
}

/// The charts of one coordinate (data and model, residuals over sigma, autocorrelation) and the HTML of its `tests`
/// below the last one. The abscissa is time, arc length, load, or the number of a mode or reading, which has whole
/// ticks. The model is a line through its stored curve, or through the simulated values without one; over numbers it is
/// dots. Residuals are model minus data, over a band of 2 sigma.
fn coordinate(series: &Series, tests: &str) -> String {
    let (unit, quantity) = match series.abscissa {
        Abscissa::Time => ("s", "time"),
        Abscissa::ArcLength => ("m", "arc length"),
        Abscissa::Mode => ("", "mode number"),
        Abscissa::Reading => ("", "reading number"),
        Abscissa::Load => ("N", "load"),
        Abscissa::Moment => ("N m", "load"),
    };
    let is_counted = matches!(series.abscissa, Abscissa::Mode | Abscissa::Reading);
    let abscissas = || series.abscissa_values.iter().copied();
    let x_scale = match is_counted {
        true => Scale::for_size(1.0, unit),
        false => Scale::for_values(abscissas(), unit),
    };
    let points = |y: &[f64]| abscissas().zip(y).map(|(x, y)| [x, *y]).collect::<Points>();
    let curve = match series.curve.is_empty() {
        true => points(&series.simulated),
        false => series.curve.clone(),
    };
    // Both charts have the same x axis.
    let axes = |y: ChartAxis, height: f64| {
        let chart = PageChart::new(ChartAxis::new(quantity, &x_scale), y, [680.0, height]);
        let chart = chart.covering(curve.iter().map(|[x, _]| *x).chain(abscissas()));
        if is_counted { chart.whole_ticks() } else { chart }
    };
    let y_scale = Scale::for_values(series.observed.iter().copied(), &series.unit);
    let values = axes(ChartAxis::new(&series.axis, &y_scale), 290.0);
    let observed = points(&series.observed);
    // Counted values are few: the model is drawn as larger dots below them.
    let values = match is_counted {
        true => values
            .dots("model", curve.iter().copied(), MODEL, 6.0)
            .dots("observed", observed, OBSERVED, 3.5),
        false => values.dots("observed", observed, OBSERVED, 2.6).line(
            "model",
            curve.iter().copied(),
            MODEL,
        ),
    };
    let r = series.residuals();
    let residuals = axes("(model \u{2212} data) / \u{3c3}".into(), 200.0)
        .band(-2.0, 2.0)
        .level(0.0)
        .dots("residual", points(&r), OBSERVED, 2.6);
    let sigma = Scale::for_size(series.sigma, &series.unit);
    let sigma = escaped(&sigma.format_with_unit(series.sigma, Some(0.01 * series.sigma)));
    let figure = |part: &str, chart: &PageChart, caption: &str| {
        let title = format!("{}: {part}", series.axis);
        figure(&title, &format!("{}, {title}", name(series, ", ")), chart, caption)
    };
    let band = "band: \u{b1}1.96/\u{221a}n, 95 % of the values of white noise";
    let autocorrelation = autocorrelation_chart(&r);
    let autocorrelation =
        autocorrelation.map(|chart| figure("residual autocorrelation", &chart, band));
    format!(
        "<div class=\"series\"><div>{}{}</div><div>{}{tests}</div></div>\n",
        figure("data and model", &values, ""),
        figure("residuals", &residuals, &format!("\u{3c3} = {sigma}; band: \u{b1}2 \u{3c3}")),
        autocorrelation.unwrap_or_default(),
    )
}

/// The chart of the autocorrelation of residuals over the lag with the 95 % band of white noise, `+-1.96/sqrt(n)` for
/// `n` residuals; `None` for fewer than four.
fn autocorrelation_chart(residuals: &[f64]) -> Option<PageChart> {
    let lags = autocorrelation(residuals);
    let band = 1.96 / (residuals.len() as f64).max(1.0).sqrt();
    let chart = PageChart::new("lag (samples)", "autocorrelation", [400.0, 290.0])
        .whole_ticks()
        .band(-band, band)
        .stems(lags.iter().copied(), OBSERVED)
        .dots("autocorrelation", lags.iter().copied(), OBSERVED, 3.0);
    (!lags.is_empty()).then_some(chart)
}

/// Points `[k, sum r_i r_(i+k) / sum r_i^2]` of the autocorrelation of residuals for the lags `k` from 1 to [`LAGS`],
/// at most a quarter of their number. The mean is not removed: that of residuals is zero unless the model is wrong.
fn autocorrelation(r: &[f64]) -> Points {
    let power: f64 = r.iter().map(|r| r * r).sum();
    let coefficient = |lag: usize| {
        let product: f64 = r.iter().zip(&r[lag..]).map(|(a, b)| a * b).sum();
        [lag as f64, product / power]
    };
    // At larger lags few products remain, and coefficients are uncertain.
    (1..=LAGS.min(r.len() / 4)).map(coefficient).collect()
}

/// The HTML table of p-values of the residual tests of a coordinate (Ljung-Box, Anderson-Darling, trend) with their
/// verdict. p-values below the significance level are marked.
fn test_table(tests: &ResidualTests) -> String {
    let row = |name: &str, p: f64| {
        let class = if p < tests.significance_level { " class=\"bad\"" } else { "" };
        format!("<tr><th>{name}</th><td{class}>{}</td></tr>", three_digits(p))
    };
    let class = if tests.passed { "good" } else { "bad" };
    format!(
        "<table class=\"tests\"><caption>Residual tests: p-values, a finding below {}</caption>{}{}{}</table><p class=\"{class}\">{}</p>",
        three_digits(tests.significance_level),
        row("independent (Ljung\u{2013}Box)", tests.whiteness),
        row("normal (Anderson\u{2013}Darling)", tests.normality),
        row("no trend", tests.trend),
        escaped(&tests.verdict),
    )
}
