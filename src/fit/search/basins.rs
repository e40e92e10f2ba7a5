//! The minima of the misfit that a search saw, told in words: the number found is worth no more than
//! what it was preferred to.

use crate::fit::search::grid::Grid;
use crate::fit::unknown::Unknown;
use crate::numerics::order;
use serde::{Deserialize, Serialize};

/// Minima of the scan that are listed; all are counted.
const LISTED: usize = 20;
/// Optima nearer than this on the unknowns' scales are one.
pub(crate) const SAME: f64 = 1e-2;

/// The minima of the misfit that the search came across.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Basins {
    /// How many minima were seen.
    pub count: usize,
    /// The minima: the chosen one first, then those of the full model, then those of the scan, best
    /// first.
    pub list: Vec<Basin>,
    /// Why the chosen one was taken, in words.
    pub words: String,
}

/// A minimum of the misfit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Basin {
    /// How the minimum was seen.
    pub seen: SeenBy,
    /// The parameters, in the report's order and their units.
    pub values: Vec<f64>,
    /// Half the sum of squared residuals there.
    pub misfit: f64,
    /// The misfit over the best that was seen in the same way.
    #[serde(deserialize_with = "crate::input::arrays::or_infinite")]
    pub relative: f64,
    /// Whether the optimiser reached the minimum.
    pub converged: bool,
    /// Whether it is the one reported.
    pub chosen: bool,
}

/// How a minimum was seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum SeenBy {
    /// By fitting the whole record with the full model.
    Fit,
    /// In the scan of the coarse model over the first period, and not followed to the end.
    Scan,
}

/// Where a fit ended on the unknowns' scales, with which misfit, and whether at a minimum.
pub(crate) type Reached = (Vec<f64>, f64, bool);

/// The minima that were seen, of which the one at `chosen` was taken.
pub(crate) fn basins(
    unknowns: &[Unknown],
    all: &[Reached],
    grid: Option<&Grid>,
    chosen: Option<(&[f64], f64)>,
) -> Basins {
    let mut reached: Vec<Reached> = Vec::new();
    let mut all = all.to_vec();
    order::sort_by(&mut all, |x| x.1);
    for (x, cost, converged) in all {
        if reached.iter().all(|(y, ..)| distance(&x, y) > SAME) {
            reached.push((x, cost, converged));
        }
    }
    let least = reached.first().map_or(0.0, |(_, cost, _)| *cost);
    let mut list: Vec<Basin> = reached
        .iter()
        .map(|(x, cost, converged)| Basin {
            seen: SeenBy::Fit,
            values: values(unknowns, x),
            misfit: *cost,
            relative: ratio(*cost, least),
            converged: *converged,
            chosen: false,
        })
        .collect();
    // New weights move the optimum a little.
    let nearest = chosen.and_then(|(x, _)| {
        let far = |(y, ..): &Reached| distance(x, y);
        (0..reached.len()).min_by(|a, b| far(&reached[*a]).total_cmp(&far(&reached[*b])))
    });
    if let (Some(i), Some((x, cost))) = (nearest, chosen) {
        list[i] =
            Basin { values: values(unknowns, x), misfit: cost, chosen: true, ..list[i].clone() };
        list[..=i].rotate_right(1);
    }
    let scanned = grid.map_or(Vec::new(), Grid::minima);
    let points = grid.map_or(0, |grid| grid.points.len());
    let least = scanned.first().map_or(0.0, |(_, cost, _)| *cost);
    let unfollowed = scanned.iter().filter(|(x, _, spacing)| {
        let at = |(y, ..): &Reached| {
            x.iter().zip(y).zip(spacing).all(|((x, y), h)| (x - y).abs() <= 1.5 * h)
        };
        !reached.iter().any(at)
    });
    let unfollowed: Vec<Basin> = unfollowed
        .map(|(x, cost, _)| Basin {
            seen: SeenBy::Scan,
            values: values(unknowns, x),
            misfit: *cost,
            relative: ratio(*cost, least),
            converged: false,
            chosen: false,
        })
        .collect();
    let count = list.len() + unfollowed.len();
    let words = in_words(unknowns, &list, &unfollowed, points);
    list.extend(unfollowed.into_iter().take(LISTED));
    Basins { count, list, words }
}

fn in_words(unknowns: &[Unknown], fitted: &[Basin], scanned: &[Basin], points: usize) -> String {
    let at = |basin: &Basin| {
        let pairs = unknowns.iter().zip(&basin.values);
        let words = pairs.map(|(unknown, value)| {
            format!("{unknown} = {} {}", four_digits(*value), unknown.parameter.unit())
        });
        words.collect::<Vec<_>>().join(", ").replace(" ,", ",").trim_end().to_string()
    };
    let scan = match points {
        0 => "from the start given".to_string(),
        _ => format!("in a scan of {points} points and fits from its best"),
    };
    let chosen = match fitted.first() {
        Some(first) if first.chosen => first,
        _ => return String::new(),
    };
    let mut words = match fitted.len() + scanned.len() {
        1 => format!("one minimum of the misfit seen {scan}"),
        n => format!("{n} minima of the misfit seen {scan}"),
    };
    if let Some(next) = fitted.get(1) {
        words += &match next.misfit / chosen.misfit {
            more if more >= 1.0 => {
                format!("; the next, {}, has {} times this one's misfit", at(next), times(more))
            }
            _ => format!("; {} fits better than this one", at(next)),
        };
    }
    if let Some(next) = scanned.first() {
        let more = times(next.relative);
        words += &format!(
            "; not followed: {}, {more} times the least misfit over the first period",
            at(next)
        );
        if scanned.len() > 1 {
            words += &format!(", and {} with more", scanned.len() - 1);
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
        let reached = [([1.2, 0.71], 4.0), ([1.2005, 0.71], 4.1), ([2.9, 0.71], 8.0)]
            .map(|(x, cost)| (x.to_vec(), cost, true));
        let grid = Grid::two_wells();
        let basins = basins(&unknowns, &reached, Some(&grid), Some((&[1.2, 0.71], 4.0)));
        assert_eq!((basins.count, basins.list.len()), (3, 3), "{basins:?}");
        let seen: Vec<_> = basins.list.iter().map(|b| (b.seen, b.chosen, b.relative)).collect();
        assert_eq!(
            seen,
            [(SeenBy::Fit, true, 1.0), (SeenBy::Fit, false, 2.0), (SeenBy::Scan, false, 3.0)]
        );
        assert!(basins.words.contains("3 minima") && basins.words.contains("2.00 times"));
        let landscape = grid.landscape(&unknowns);
        assert_eq!((landscape.len(), landscape[0].misfit[1]), (2, 1.0));
    }

    #[test]
    fn nothing_seen_nothing_said() {
        let empty = basins(&[Unknown::new(Parameter::Beta)], &[], None, None);
        assert_eq!((empty.count, empty.words.as_str()), (0, ""));
    }
}
