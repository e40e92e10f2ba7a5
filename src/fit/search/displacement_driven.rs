//! Fits of rods whose ends are led by a recording.
//!
//! Hands that lead a rod force its motion: no period can be slipped, as in a free vibration, and a start
//! is as good as it was called. So a fit whose unknowns all have one goes from there, on the whole
//! recordings. Without a start, Young's modulus alone is scanned over decades, all others where the scene
//! has them.
//!
//! Where such a rod whips about, the least change of a parameter sends it elsewhere, and so does whatever
//! the model lacks: values there have derivatives far beyond all others, would decide the fit, and say
//! nothing. Their noise is taken for as many times larger as their derivatives are beyond ten medians. All
//! unknowns count together, each by its part of what it does to all values: a curvature of the rod at one place
//! moves the markers there far more than the others, which is no whip.

use crate::error::Error;
use crate::fit::search::Search;
use crate::fit::search::coarse::Coarse;
use crate::fit::search::fitted::MeasuredResiduals;
use crate::fit::search::journal::Stage;
use crate::fit::search::optimum::Optimum;
use crate::fit::search::scan::Candidate;
use crate::fit::unknown::Unknown;
use crate::numerics::half_sum_of_squares;
use crate::numerics::total_order;
use statrs::statistics::{Data, Median};

/// Medians of a derivative's size from which on a value runs away.
const MAX_LEVERAGE: f64 = 10.0;
/// An unknown that changes all residuals together by less than this, in units of the noise, has no effect
/// that could run away.
const NO_EFFECT: f64 = 0.1;
/// How often that is looked at: at the start, and where the fit has gone.
const LOOKS: usize = 3;
/// Before it is looked at again: part of a standard error by which the minimum may be missed, and iterations. What they end
/// with is only where the next ones begin.
const NEARLY: f64 = 0.1;
const BETWEEN: u64 = 12;
/// Descents from a scan: its best minimum, and others with up to so many times its misfit.
const DESCENTS: usize = 2;
const RIVAL: f64 = 1.5;

impl Search<'_> {
    /// Whether recordings lead the ends of all rods that move.
    pub fn is_displacement_driven(&self) -> bool {
        let mut moving = self.experiments.iter().filter(|e| e.moves()).peekable();
        moving.peek().is_some() && moving.all(|e| e.problem.scene().supports.path.is_some())
    }

    /// The best of the starts on the whole recordings.
    pub fn led(&mut self) -> Result<Optimum, Error> {
        let mut best: Option<(Optimum, Vec<f64>)> = None;
        let mut failure = None;
        for start in self.led_starts()? {
            match self.led_from(start) {
                Ok(optimum) => {
                    let is_lower = |(other, weights): &(Optimum, Vec<f64>)| {
                        self.cost_with(&optimum, weights) < self.cost_with(other, weights)
                    };
                    if best.as_ref().is_none_or(is_lower) {
                        best = Some((optimum, self.leverage_weights.clone()));
                    }
                }
                Err(Error::Interrupted) => return Err(Error::Interrupted),
                Err(error) => failure = Some(error),
            }
        }
        let nothing = || {
            Error::Fit(
                "no start value for the fit was found. Give a start or bounds for each \
                                     parameter"
                    .into(),
            )
        };
        let (optimum, weights) = best.ok_or_else(|| match failure {
            Some(error) => Error::Fit(format!(
                "the scene cannot be simulated at the start values: {error}. Give \
                                               another start"
            )),
            None => nothing(),
        })?;
        self.leverage_weights = weights;
        Ok(optimum)
    }

    /// The objective at an optimum with the smaller one of two weights of each value: those of this search and
    /// `weights`. Only with the same weights can two optima be compared.
    fn cost_with(&self, optimum: &Optimum, weights: &[f64]) -> f64 {
        let weight = |k: usize| {
            let of = |weights: &[f64]| weights.get(k).copied().unwrap_or(1.0);
            of(weights).min(of(&self.leverage_weights))
        };
        let mut cost = half_sum_of_squares(&optimum.residuals[optimum.counts.iter().sum()..]);
        for MeasuredResiduals { measurement, residuals, rows, .. } in self.measured(optimum) {
            let loss = measurement.loss();
            let robust = |(k, r)| 0.5 * loss.robust(weight(k) * r)[0].powi(2);
            cost += rows.zip(residuals).map(robust).sum::<f64>();
        }
        cost
    }

    /// The given start, or the lowest points of a scan over Young's modulus.
    fn led_starts(&self) -> Result<Vec<Vec<f64>>, Error> {
        let given = |u: &Unknown| Some(u.to_scale(self.led_start(u)?));
        if let Some(start) = self.unknowns.iter().map(given).collect() {
            return Ok(vec![start]);
        }
        let first = self.first_periods(1.0);
        let mut scanned = self.scan(&Coarse::as_it_is(self), &first, 1)?;
        let lower = |k: usize, other: Option<&Candidate>| {
            other.is_none_or(|other| scanned[k].cost <= other.cost)
        };
        let lowest: Vec<bool> = (0..scanned.len())
            .map(|k| {
                let before = k.checked_sub(1).and_then(|k| scanned.get(k));
                lower(k, before) && lower(k, scanned.get(k + 1))
            })
            .collect();
        let mut lowest = lowest.into_iter();
        scanned.retain(|_| lowest.next() == Some(true));
        scanned.sort_by_cached_key(|x| total_order(x.cost));
        let least = scanned.first().map_or(0.0, |c| c.cost);
        let rivals = scanned.into_iter().filter(|c| c.cost <= RIVAL * least).take(DESCENTS);
        Ok(rivals.map(|c| c.x).collect())
    }

    /// Where an unknown starts, in its unit; none where it is scanned.
    pub(super) fn led_start(&self, unknown: &Unknown) -> Option<f64> {
        let hint = unknown.start.or(unknown.prior.map(|prior| prior.mean));
        if hint.is_some() || unknown.is_stiffness() {
            return hint;
        }
        self.here(unknown)
    }

    /// What the scene says of an unknown, in its unit, if a search can start there.
    pub(super) fn here(&self, unknown: &Unknown) -> Option<f64> {
        let own = self.experiments.iter().find(|e| unknown.is_of(e))?;
        let here = unknown.parameter.of(own.problem.scene())?;
        // A logarithm cannot start at zero.
        (here > 0.0 || !unknown.parameter.is_positive()).then_some(here)
    }

    /// Fits the whole recordings from a start.
    fn led_from(&mut self, start: Vec<f64>) -> Result<Optimum, Error> {
        self.leverage_weights.clear();
        let residuals = self.all_residuals()?;
        let rows = residuals.plain_jacobian(&start)?;
        let (mut x, mut there) = (start.clone(), (residuals.plain(&start)?, rows));
        let mut halved = residuals.halved();
        self.leverage_weights = weights_by_leverage(&there.1);
        for _ in 1..LOOKS {
            let known = self.all_residuals()?.knowing(&x, there, halved);
            let near = self.optimize(known, &x, (1e-10, NEARLY, BETWEEN), Some(Stage::Full))?;
            let weights = weights_by_leverage(&near.jacobian);
            let settled = same(&weights, &self.leverage_weights);
            if !settled {
                self.leverage_weights = weights;
            }
            (x, there, halved) = (near.x, (near.residuals, near.jacobian), near.halved);
            if settled {
                break;
            }
        }
        let optimum = self.raised(self.polish_knowing(&x, there, halved)?)?;
        self.add_minimum(&optimum);
        Ok(optimum)
    }
}

/// Factors on the residuals, from their derivatives; empty where none runs away.
fn weights_by_leverage(rows: &[Vec<f64>]) -> Vec<f64> {
    let mut squares = vec![0.0; rows.len()];
    for j in 0..rows.first().map_or(0, Vec::len) {
        let effect = rows.iter().map(|row| row[j] * row[j]).sum::<f64>();
        if effect < NO_EFFECT * NO_EFFECT {
            continue;
        }
        for (square, row) in squares.iter_mut().zip(rows) {
            *square += row[j] * row[j] / effect;
        }
    }
    let seen: Vec<f64> = squares.iter().map(|s| s.sqrt()).filter(|size| *size > 0.0).collect();
    if seen.is_empty() {
        return Vec::new();
    }
    let most = MAX_LEVERAGE * Data::new(seen).median();
    let weights: Vec<f64> = squares.iter().map(|square| most / square.sqrt().max(most)).collect();
    if weights.iter().all(|t| *t == 1.0) { Vec::new() } else { weights }
}

/// Whether two sets of factors weigh alike.
fn same(a: &[f64], b: &[f64]) -> bool {
    let at = |t: &[f64], i: usize| t.get(i).copied().unwrap_or(1.0);
    (0..a.len().max(b.len())).all(|i| (at(a, i) / at(b, i)).ln().abs() < 0.2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// Derivatives by four unknowns, each of which moves the values of its own place by 1 and the others by `far`.
    fn local(far: f64) -> Vec<Vec<f64>> {
        (0..400).map(|i| (0..4).map(|j| if i % 4 == j { 1.0 } else { far }).collect()).collect()
    }

    /// What an unknown does to its own place is no whip, however little it does elsewhere.
    #[test]
    fn what_acts_on_one_place_does_not_run_away() {
        assert!(weights_by_leverage(&local(1e-3)).is_empty());
    }

    /// Of values that change 50 times as much as usual a fifth of counts; unknowns without effect have no say.
    #[test]
    fn a_whip_counts_for_less() {
        let mut rows = local(0.1);
        for row in &mut rows[..8] {
            row.iter_mut().for_each(|d| *d *= 50.0);
        }
        rows.iter_mut().enumerate().for_each(|(i, row)| row.push(1e-6 * i as f64));
        let found = weights_by_leverage(&rows);
        for (i, weight) in found.iter().enumerate() {
            assert_relative_eq!(*weight, if i < 8 { 0.2 } else { 1.0 }, max_relative = 1e-12);
        }
        assert_eq!(found.len(), 400);
    }
}
