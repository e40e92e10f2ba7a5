//! The report of the local minima that a search found.
//!
//! [`local_minima`] makes it. Input: the minima of the full model (ends of complete fits), the grid of the scan, and
//! the chosen minimum. Minima within [`SAME`] of each other on the unknowns' scales are one. Minima of other meshes
//! that are lower than the chosen one are left out, as their misfits are not comparable. A minimum of the scan within
//! [`SAME_BASIN`] grid spacings of one of the full model counts as refined to it, and is left out. Output:
//! [`LocalMinima`] with the chosen minimum first, other minima of the full model by misfit, and unrefined minima of the
//! scan (at most [`LISTED`]; the count has all). Each has its values, its misfit and the ratio of that to the lowest
//! one of the same model. Misfits of the full model are in units of the given sigmas. The summary is a text on the
//! selection, empty without a chosen minimum (after an interruption). `without_values` removes the values of minima
//! from the summary, for parameters that the data do not determine. [`distance`] is the largest difference of two
//! points in any unknown.

use crate::fit::search::grid::{GridMinimum, ScanGrid};
use crate::fit::search::minimum::Minimum;
use crate::fit::unknown::{ParameterPoint, Unknown};
use crate::numerics::total_order;
use serde::{Deserialize, Serialize};

/// Largest number of listed minima of the scan. `LocalMinima::count` includes all.
const LISTED: usize = 20;
/// Largest distance, along each unknown, from a minimum of the scan to a minimum of the full model that was reached
/// from it, over the spacing of the grid. A larger one merges separate minima, a smaller one counts a minimum twice.
const SAME_BASIN: f64 = 1.5;
/// Largest distance of two points on the unknowns' scales that are the same optimum; 1 % of a positive parameter. A
/// larger one merges separate minima, a smaller one lists one several times.
pub(crate) const SAME: f64 = 1e-2;

/// Local minima of the misfit that the search found.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct LocalMinima {
    /// Number of local minima.
    pub count: usize,
    /// Local minima: the selected one, then those of the full model, then those of the scan, the
    /// best first.
    pub list: Vec<LocalMinimum>,
    /// Reason for the selection, as text.
    pub summary: String,
}

/// A local minimum of the misfit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct LocalMinimum {
    /// Model by which the minimum was found.
    pub found_by: MinimumSource,
    /// Values of the parameters, in the order and units of the report.
    pub values: Vec<f64>,
    /// Half the sum of squared residuals at this minimum, in units of their sigmas.
    pub misfit: f64,
    /// Misfit divided by the lowest one of the same model.
    #[serde(deserialize_with = "crate::input::arrays::or_infinite")]
    pub relative: f64,
    /// Whether the optimizer converged to this minimum.
    pub converged: bool,
    /// Whether this minimum is the reported one.
    pub chosen: bool,
}

/// Model by which a local minimum was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum MinimumSource {
    /// Fit of the whole record with the full model.
    Fit,
    /// Scan of the coarse model over the first period, not refined.
    Scan,
}

impl LocalMinima {
    /// The report for parameters that are not all identifiable. The summary keeps its text up to the first semicolon,
    /// and a standard text replaces the values, which are arbitrary along the combinations that the data do not
    /// determine. Counts and list stay.
    pub(crate) fn without_values(mut self) -> Self {
        if let Some((first, _)) = self.summary.split_once("; ") {
            self.summary = format!(
                "{first}, which differ along the combination that is not identifiable, or are worse"
            );
        }
        self
    }
}

/// The report of the `minima` of the full model and those of the scan's `grid`, of which `chosen` is the result.
/// Misfits of the full model are in units of `sigmas`, one per measurement; those of the scan are as it computed them.
/// Lower minima on other meshes than the chosen one's are left out. The list has the chosen minimum, the other fitted
/// ones by misfit, and at most [`LISTED`] of those of the scan that are near none of these.
pub(crate) fn local_minima(
    unknowns: &[Unknown],
    minima: &[Minimum],
    sigmas: &[f64],
    grid: Option<&ScanGrid>,
    chosen: Option<&Minimum>,
) -> LocalMinima {
    let misfit = |minimum: &Minimum| minimum.squares.misfit(sigmas);
    let mut minima: Vec<&Minimum> = minima.iter().collect();
    minima.sort_by_cached_key(|x| total_order(misfit(x)));
    // The chosen minimum comes first: other weights and meshes move it a little from the recorded one.
    let mut reached: Vec<&Minimum> = chosen.into_iter().collect();
    for minimum in minima {
        // Objectives of other meshes are not comparable. The competing minima were followed to the final mesh.
        let is_lower_elsewhere = chosen
            .is_some_and(|own| own.numerics != minimum.numerics && misfit(minimum) < misfit(own));
        if !is_lower_elsewhere && reached.iter().all(|other| distance(&minimum.x, &other.x) > SAME)
        {
            reached.push(minimum);
        }
    }
    // Misfits are reported relative to the lowest one of the same model.
    let least = reached.iter().map(|minimum| misfit(minimum)).fold(f64::INFINITY, f64::min);
    let values = |x: &[f64]| ParameterPoint { unknowns, x }.values();
    let fitted = |(k, minimum): (usize, &&Minimum)| LocalMinimum {
        found_by: MinimumSource::Fit,
        values: values(&minimum.x),
        misfit: misfit(minimum),
        relative: ratio(misfit(minimum), least),
        converged: minimum.converged,
        chosen: k == 0 && chosen.is_some(),
    };
    let mut list: Vec<LocalMinimum> = reached.iter().enumerate().map(fitted).collect();
    let is_comparable = |other: &&Minimum| chosen.is_none_or(|own| own.numerics == other.numerics);
    let next_is_comparable = reached.get(1).is_none_or(is_comparable);
    // Local minima of the grid, the best one first.
    let scanned = grid.map_or(Vec::new(), ScanGrid::minima);
    let points = grid.map_or(0, |grid| grid.points.len());
    let least = scanned.first().map_or(0.0, |minimum| minimum.misfit);
    // Minima of the scan near a minimum of the full model were refined to it.
    let is_unrefined = |own: &&GridMinimum| {
        let is_near = |other: &&Minimum| {
            let mut pairs = own.x.iter().zip(&other.x).zip(&own.spacing);
            pairs.all(|((x, y), h)| (x - y).abs() <= SAME_BASIN * h)
        };
        !reached.iter().any(is_near)
    };
    let unrefined = |own: &GridMinimum| LocalMinimum {
        found_by: MinimumSource::Scan,
        values: values(&own.x),
        misfit: own.misfit,
        relative: ratio(own.misfit, least),
        converged: false,
        chosen: false,
    };
    let unrefined: Vec<LocalMinimum> = scanned.iter().filter(is_unrefined).map(unrefined).collect();
    // The count has all minima, the list the best ones of the scan only.
    let count = list.len() + unrefined.len();
    let summary = summary(unknowns, &list, next_is_comparable, &unrefined, points);
    list.extend(unrefined.into_iter().take(LISTED));
    LocalMinima { count, list, summary }
}

/// The selection as text: the number of scanned `points` (0: from the given start), the number of minima, and the next
/// `fitted` one after the chosen one with the ratio of the misfits. The best unrefined minimum of the scan (`scanned`)
/// follows, with the number of worse ones. `next_is_comparable` states whether the next one has the mesh of the chosen
/// one. Ratios are over the chosen minimum for fitted ones, and over the lowest of the scan for scanned ones. Empty
/// without a chosen minimum.
fn summary(
    unknowns: &[Unknown],
    fitted: &[LocalMinimum],
    next_is_comparable: bool,
    scanned: &[LocalMinimum],
    points: usize,
) -> String {
    let at = |minimum: &LocalMinimum| {
        let pairs = unknowns.iter().zip(&minimum.values);
        let words = pairs.map(|(unknown, value)| {
            format!("{unknown} = {} {}", four_digits(*value), unknown.parameter.unit())
        });
        words.collect::<Vec<_>>().join(", ").replace(" ,", ",").trim_end().to_string()
    };
    // An interrupted search has no selection to explain.
    let chosen = match fitted.first() {
        Some(first) if first.chosen => first,
        _ => return String::new(),
    };
    // The number of points shows the extent of the scan.
    let mut words = match points {
        0 => "from the start given: ".to_string(),
        _ => format!("{points} points scanned: "),
    };
    words += &match fitted.len() + scanned.len() {
        1 => "one local minimum found".to_string(),
        n => format!("{n} local minima found"),
    };
    // The ratio of the misfits shows how clearly the data prefer the chosen minimum.
    if let Some(next) = fitted.get(1) {
        let ratio = times(next.misfit / chosen.misfit);
        let numerics = if next_is_comparable { "" } else { " on another mesh" };
        words += &format!("; the next, {}, has {ratio} times the misfit{numerics}", at(next));
    }
    // Minima of the scan are compared with the lowest of the scan: the coarse model has another misfit.
    if let Some(next) = scanned.first() {
        let more = times(next.relative);
        words += &format!("; rejected: {} ({more} times the lowest misfit of the scan)", at(next));
        if scanned.len() > 1 {
            words += &format!(" and {} with a larger misfit", scanned.len() - 1);
        }
    }
    words
}

/// A value as text with four significant digits. Absolute values below 0.01 or from 10 000 on have an exponent; zero is
/// `0`.
fn four_digits(value: f64) -> String {
    match value.abs() {
        0.0 => "0".into(),
        size if (1e-2..1e4).contains(&size) => {
            let decimals = (3.0 - size.log10().floor()).max(0.0) as usize;
            format!("{value:.decimals$}")
        }
        _ => format!("{value:.3e}"),
    }
}

/// A ratio as text: two decimals, or one digit and an exponent from 100 on.
fn times(ratio: f64) -> String {
    if ratio < 100.0 { format!("{ratio:.2}") } else { format!("{ratio:.0e}") }
}

/// The largest absolute difference of the points `x` and `y`, on the unknowns' scales, in any unknown (maximum norm).
pub(crate) fn distance(x: &[f64], y: &[f64]) -> f64 {
    x.iter().zip(y).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// The ratio `misfit/least`; 1 if both are equal, also if both are zero.
fn ratio(misfit: f64, least: f64) -> f64 {
    if misfit == least { 1.0 } else { misfit / least }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Parameter;

    /// Of three fits two end in one minimum. The scan's minimum at (1, 0.7) was refined, that at (5, 0.7) was not.
    #[test]
    fn refined_minima_are_counted_once() {
        let unknowns = [Parameter::YoungsModulus, Parameter::Beta].map(Unknown::new);
        let minima = [([1.2, 0.71], 4.0), ([1.2005, 0.71], 4.1), ([2.9, 0.71], 8.0)]
            .map(|(x, cost)| Minimum::with_cost(&x, cost));
        let grid = ScanGrid::two_wells();
        let found = local_minima(&unknowns, &minima, &[1.0], Some(&grid), Some(&minima[0]));
        assert_eq!((found.count, found.list.len()), (3, 3), "{found:?}");
        let listed: Vec<_> =
            found.list.iter().map(|b| (b.found_by, b.chosen, b.relative)).collect();
        assert_eq!(
            listed,
            [
                (MinimumSource::Fit, true, 1.0),
                (MinimumSource::Fit, false, 2.0),
                (MinimumSource::Scan, false, 3.0)
            ]
        );
        assert!(found.summary.contains("3 local minima") && found.summary.contains("2.00 times"));
        let landscape = grid.landscape(&unknowns);
        assert_eq!((landscape.len(), landscape[0].misfit[1]), (2, 1.0));
    }

    /// A search that was stopped before its first minimum reports none.
    #[test]
    fn summary_without_minima_is_empty() {
        let empty = local_minima(&[Unknown::new(Parameter::Beta)], &[], &[], None, None);
        assert_eq!((empty.count, empty.summary.as_str()), (0, ""));
    }
}
