//! The section "Posterior distribution" of a page of a fit: draws of pairs of parameters.
//!
//! Input: the draws of a report, which only a fit of the same process has (they are not in its JSON). Of all pairs of
//! parameters those with the strongest correlations are drawn, at most [`PAIRS`]. Each figure has one dot for every
//! draw, or for every k-th one of many, the correlation of all draws, and the estimates as dashed lines. Output: HTML,
//! empty without draws and for a single parameter. Draws that do not vary have no correlation and no figure.

use crate::fit::{FitReport, PosteriorDraws};
use crate::page::chart::{ChartAxis, PageChart};
use crate::page::figure::{MODEL, figure, row};
use crate::page::number::{Scale, with_minus_sign};

/// Largest number of pairs with a figure.
const PAIRS: usize = 6;
/// Largest number of dots of a figure: more are neither distinguished nor fast to draw.
const DOTS: usize = 1000;

/// Two parameters by their indices, with the correlation of their draws.
struct DrawnPair {
    first: usize,
    second: usize,
    correlation: f64,
}

/// The figures of the most correlated pairs of parameters side by side, as HTML; empty without draws of two parameters.
pub(super) fn posterior_pairs(report: &FitReport) -> String {
    let Some(draws) = &report.posterior_draws else { return String::new() };
    let columns: Vec<Vec<f64>> = (0..draws.names.len()).map(|k| column(draws, k)).collect();
    let mut pairs = Vec::new();
    for second in 1..columns.len() {
        for first in 0..second {
            let correlation = correlation(&columns[first], &columns[second]);
            pairs.extend(correlation.map(|correlation| DrawnPair { first, second, correlation }));
        }
    }
    pairs.sort_by(|a, b| b.correlation.abs().total_cmp(&a.correlation.abs()));
    pairs.truncate(PAIRS);
    row(&pairs.iter().map(|pair| pair_figure(report, draws, pair, &columns)).collect::<String>())
}

/// The draws of parameter `k` of all chains, in its unit.
fn column(draws: &PosteriorDraws, k: usize) -> Vec<f64> {
    draws.chains.iter().flatten().map(|draw| draw.values[k]).collect()
}

/// The correlation coefficient of two lists of the same length; none if one of them does not vary.
fn correlation(a: &[f64], b: &[f64]) -> Option<f64> {
    let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len() as f64;
    let [mean_a, mean_b] = [mean(a), mean(b)];
    let [mut aa, mut bb, mut ab] = [0.0; 3];
    for (x, y) in a.iter().zip(b) {
        let [x, y] = [x - mean_a, y - mean_b];
        (aa, bb, ab) = (aa + x * x, bb + y * y, ab + x * y);
    }
    Some(ab / (aa.sqrt() * bb.sqrt())).filter(|correlation| correlation.is_finite())
}

/// The figure of a pair as HTML: draws as dots, and dashed lines at the estimates.
fn pair_figure(
    report: &FitReport,
    draws: &PosteriorDraws,
    pair: &DrawnPair,
    columns: &[Vec<f64>],
) -> String {
    let DrawnPair { first, second, correlation } = pair;
    let [a, b] = [first, second].map(|k| &columns[*k]);
    let scale = |k: usize| {
        let unit = report.parameters.get(k).map_or("", |e| e.name.unit());
        Scale::for_values(columns[k].iter().copied(), unit)
    };
    let [x_scale, y_scale] = [scale(*first), scale(*second)];
    let axes = [(first, &x_scale), (second, &y_scale)]
        .map(|(k, scale)| ChartAxis::new(&draws.names[*k], scale));
    let [x, y] = axes;
    let stride = a.len().div_ceil(DOTS).max(1);
    let points = a.iter().zip(b).step_by(stride).map(|(x, y)| [*x, *y]);
    // The draws are in the file of `--draws`, and not once more beside every figure.
    let mut chart = PageChart::new(x, y, [420.0, 320.0]).dots("", points, MODEL, 1.5);
    let estimate = |k: usize| report.parameters.get(k).and_then(|e| e.value);
    if let Some(value) = estimate(*first) {
        chart = chart.mark(value);
    }
    if let Some(value) = estimate(*second) {
        chart = chart.level(value / y_scale.factor);
    }
    let title = format!("{} and {}", draws.names[*first], draws.names[*second]);
    let value = with_minus_sign(format!("{correlation:.3}"));
    let caption = format!("correlation of the draws {value}; dashed: the estimates");
    figure(&title, &format!("posterior of {title}"), &chart, &caption)
}

#[cfg(test)]
mod tests {
    use crate::page::posterior::correlation;

    #[test]
    fn correlation_of_a_line_is_one_and_of_a_constant_missing() {
        let x = [1.0, 2.0, 4.0];
        assert!((correlation(&x, &x.map(|x| 3.0 - 2.0 * x)).unwrap() + 1.0).abs() < 1e-15);
        assert!(
            (correlation(&x, &[1.0, -1.0, 1.0]).unwrap() - 0.188_982_236_504_613_6).abs() < 1e-14
        );
        assert_eq!(correlation(&x, &[2.0; 3]), None);
    }
}
