//! The minima of the misfit that a search saw, told in words: the number found is worth no more than
//! what it was preferred to.

use crate::fit::search::grid::Grid;
use crate::fit::search::minimum::Minimum;
use crate::fit::unknown::Unknown;
use crate::numerics::total_order;
use serde::{Deserialize, Serialize};

/// Minima of the scan that are listed; all are counted.
const LISTED: usize = 20;
/// Optima nearer than this on the unknowns' scales are one.
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

/// The minima that were found, of which `chosen` was taken; all objectives with the weights of `sigmas`.
pub(crate) fn local_minima(
    unknowns: &[Unknown],
    (minima, sigmas): (&[Minimum], &[f64]),
    grid: Option<&Grid>,
    chosen: Option<&Minimum>,
) -> LocalMinima {
    let misfit = |minimum: &Minimum| minimum.squares.misfit(sigmas);
    let mut minima: Vec<&Minimum> = minima.iter().collect();
    minima.sort_by_cached_key(|x| total_order(misfit(x)));
    // New weights and other meshes move the chosen one a little.
    let mut reached: Vec<&Minimum> = chosen.into_iter().collect();
    for minimum in minima {
        // Lower on another mesh is not lower here, where the nearest ones have been followed.
        let is_lower_elsewhere = chosen
            .is_some_and(|own| own.numerics != minimum.numerics && misfit(minimum) < misfit(own));
        if !is_lower_elsewhere && reached.iter().all(|other| distance(&minimum.x, &other.x) > SAME)
        {
            reached.push(minimum);
        }
    }
    let least = reached.iter().map(|minimum| misfit(minimum)).fold(f64::INFINITY, f64::min);
    let basin = |(k, minimum): (usize, &&Minimum)| LocalMinimum {
        found_by: MinimumSource::Fit,
        values: values(unknowns, &minimum.x),
        misfit: misfit(minimum),
        relative: ratio(misfit(minimum), least),
        converged: minimum.converged,
        chosen: k == 0 && chosen.is_some(),
    };
    let mut list: Vec<LocalMinimum> = reached.iter().enumerate().map(basin).collect();
    let is_comparable = |other: &&Minimum| chosen.is_none_or(|own| own.numerics == other.numerics);
    let comparable: Vec<bool> = reached.iter().map(is_comparable).collect();
    let scanned = grid.map_or(Vec::new(), Grid::minima);
    let points = grid.map_or(0, |grid| grid.points.len());
    let least = scanned.first().map_or(0.0, |(_, cost, _)| *cost);
    let unfollowed = scanned.iter().filter(|(x, _, spacing)| {
        let at = |other: &&Minimum| {
            x.iter().zip(&other.x).zip(spacing).all(|((x, y), h)| (x - y).abs() <= 1.5 * h)
        };
        !reached.iter().any(at)
    });
    let unfollowed: Vec<LocalMinimum> = unfollowed
        .map(|(x, cost, _)| LocalMinimum {
            found_by: MinimumSource::Scan,
            values: values(unknowns, x),
            misfit: *cost,
            relative: ratio(*cost, least),
            converged: false,
            chosen: false,
        })
        .collect();
    let count = list.len() + unfollowed.len();
    let summary = in_words(unknowns, (&list, &comparable), &unfollowed, points);
    list.extend(unfollowed.into_iter().take(LISTED));
    LocalMinima { count, list, summary }
}

fn in_words(
    unknowns: &[Unknown],
    (fitted, comparable): (&[LocalMinimum], &[bool]),
    scanned: &[LocalMinimum],
    points: usize,
) -> String {
    let at = |basin: &LocalMinimum| {
        let pairs = unknowns.iter().zip(&basin.values);
        let words = pairs.map(|(unknown, value)| {
            format!("{unknown} = {} {}", four_digits(*value), unknown.parameter.unit())
        });
        words.collect::<Vec<_>>().join(", ").replace(" ,", ",").trim_end().to_string()
    };
    let chosen = match fitted.first() {
        Some(first) if first.chosen => first,
        _ => return String::new(),
    };
    let mut words = match points {
        0 => "from the start given: ".to_string(),
        _ => format!("{points} points scanned: "),
    };
    words += &match fitted.len() + scanned.len() {
        1 => "one local minimum found".to_string(),
        n => format!("{n} local minima found"),
    };
    if let Some(next) = fitted.get(1) {
        let ratio = times(next.misfit / chosen.misfit);
        let numerics = if comparable[1] { "" } else { " on another mesh" };
        words += &format!("; the next, {}, has {ratio} times the misfit{numerics}", at(next));
    }
    if let Some(next) = scanned.first() {
        let more = times(next.relative);
        words += &format!("; rejected: {} ({more} times the least misfit of the scan)", at(next));
        if scanned.len() > 1 {
            words += &format!(" and {} worse", scanned.len() - 1);
        }
    }
    words
}

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

fn times(ratio: f64) -> String {
    if ratio < 100.0 { format!("{ratio:.2}") } else { format!("{ratio:.0e}") }
}

pub(crate) fn values(unknowns: &[Unknown], x: &[f64]) -> Vec<f64> {
    unknowns.iter().zip(x).map(|(unknown, x)| unknown.from_scale(*x)).collect()
}

/// The largest difference between two points on the unknowns' scales.
pub(crate) fn distance(x: &[f64], y: &[f64]) -> f64 {
    x.iter().zip(y).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

fn ratio(cost: f64, least: f64) -> f64 {
    if cost == least { 1.0 } else { cost / least }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Parameter;

    #[test]
    fn what_was_followed_counts_once() {
        let unknowns = [Parameter::YoungsModulus, Parameter::Beta].map(Unknown::new);
        let minima = [([1.2, 0.71], 4.0), ([1.2005, 0.71], 4.1), ([2.9, 0.71], 8.0)]
            .map(|(x, cost)| Minimum::at(&x, cost));
        let grid = Grid::two_wells();
        let found = (&minima[..], &[1.0][..]);
        let basins = local_minima(&unknowns, found, Some(&grid), Some(&minima[0]));
        assert_eq!((basins.count, basins.list.len()), (3, 3), "{basins:?}");
        let seen: Vec<_> = basins.list.iter().map(|b| (b.found_by, b.chosen, b.relative)).collect();
        assert_eq!(
            seen,
            [
                (MinimumSource::Fit, true, 1.0),
                (MinimumSource::Fit, false, 2.0),
                (MinimumSource::Scan, false, 3.0)
            ]
        );
        assert!(basins.summary.contains("3 local minima") && basins.summary.contains("2.00 times"));
        let landscape = grid.landscape(&unknowns);
        assert_eq!((landscape.len(), landscape[0].misfit[1]), (2, 1.0));
    }

    #[test]
    fn nothing_seen_nothing_said() {
        let empty = local_minima(&[Unknown::new(Parameter::Beta)], (&[], &[]), None, None);
        assert_eq!((empty.count, empty.summary.as_str()), (0, ""));
    }
}
