//! Parameters that the data bound from one side only.
//!
//! Above some modulus a rod no longer bends by what the noise lets one see: the misfit is flat from there on, and an
//! interval around the optimum means nothing. The profile of the likelihood shows it: hold the parameter, fit all
//! others, and go away from the optimum by factors of 2, 16 and 65536. Where twice the misfit, in units of the
//! variance of the noise, rises by less than 4 however far one goes, the side is open. The other side ends where the
//! profile has risen by the square of the one-sided 95 % quantile above its least value.

use crate::error::Error;
use crate::fit::search::damping::is_damping;
use crate::fit::search::fitted::Fitted;
use crate::fit::uncertainty::covariance::gauss_newton::Covariance;
use crate::fit::uncertainty::covariance::zero_bound::Bound;
use crate::fit::uncertainty::noise::autocorrelation::Correlations;
use crate::fit::uncertainty::noise::residual_noise::Noise;
use crate::numerics::total_order;
use crate::scene::number::Candidates;
use std::f64::consts::LN_2;

/// Rise of the profile, in units of the variance of the noise, up to which a side is open: two standard deviations of a
/// likelihood ratio.
const OPEN_BELOW: f64 = 4.0;
/// Rise above which a side is closed, and nothing farther off is evaluated.
const CLOSED_ABOVE: f64 = 25.0;
/// Distances on the scale of logarithms at which the profile is evaluated: from a factor of two, four times as far
/// each, to five decades. Farther off the rounding errors of a simulation show.
const DISTANCES: [f64; 3] = [LN_2, 4.0 * LN_2, 16.0 * LN_2];
/// The same where the profile is flat on both sides of an optimum, which may be far from where it rises.
const FARTHER: [f64; 2] = [32.0 * LN_2, 48.0 * LN_2];
/// How far beyond the values of the scan it is evaluated.
const BEYOND_SCAN: f64 = 4.0 * LN_2;
/// Misfit of the scan at the end of an axis over its least one below which the profile is evaluated. A rise by
/// [`OPEN_BELOW`] of twenty values is less.
const FLAT: f64 = 1.5;
/// Points by which an end is approached at most, and how exactly, on the scale of logarithms.
const MOST_STEPS: usize = 12;
const TOLERANCE: f64 = 0.02;

/// A point of the profile.
struct Point {
    /// The parameter, on its scale.
    held: f64,
    /// All unknowns there.
    x: Vec<f64>,
    /// Rise of twice the misfit over the optimum, in units of the variance of the noise.
    rise: f64,
}

/// The profile of one unknown.
struct Profile<'a> {
    fitted: Fitted<'a>,
    unknown: usize,
    /// The optimum's value, or the largest of the scan where it is beyond: there the rounding errors of a simulation are
    /// small.
    here: f64,
    /// The least and the largest value at which it is evaluated.
    range: [f64; 2],
    /// Variance of the noise, for this unknown.
    variance: f64,
    /// Ascending.
    points: Vec<Point>,
}

/// The one-sided bounds of unknowns that the `covariance` refuses, or that the scan shows to be flat on a side; what is
/// in `known` already stays.
pub(crate) fn one_sided(
    fitted: Fitted,
    noise: &Noise,
    correlations: &Correlations,
    covariance: &Covariance,
    known: &mut [Option<Bound>],
) -> Result<(), Error> {
    let Fitted { search, optimum } = fitted;
    if !optimum.converged || search.is_rounding(optimum) {
        return Ok(());
    }
    for (j, unknown) in search.unknowns.iter().enumerate() {
        let found = || covariance.findings.iter().map(|f| &f.parameters[..]);
        let is_combined = found().any(|all| all.len() > 1 && all.contains(&unknown.parameter));
        let is_refused =
            covariance.deviation[j].is_none() && found().any(|all| all == [unknown.parameter]);
        let is_suspect = is_refused || !is_damping(unknown) && is_flat(fitted, j);
        // With a combination that the data do not determine, the profile of each part is flat.
        if !unknown.parameter.is_positive() || unknown.prior.is_some() || is_combined || !is_suspect
        {
            continue;
        }
        if known[j].is_some_and(|bound| bound.is_one_sided()) {
            continue;
        }
        let size = optimum.jacobian.iter().zip(&noise.weights);
        let norm = size.map(|(row, w)| (w * row[j]).powi(2)).sum::<f64>().sqrt();
        if norm == 0.0 {
            // Nothing observed depends on it: no profile has an end.
            continue;
        }
        let variance = noise.rise * correlations.inflation[j].powi(2);
        let profile = Profile::new(fitted, j, variance);
        if let Some(bound) = profile.bound(correlations.up[j])? {
            let deviation = noise.variance.sqrt() / norm;
            let log_deviation = if deviation.is_finite() { deviation.max(1.0) } else { 1.0 };
            known[j] = Some(Bound { log_deviation, ..bound });
        }
    }
    Ok(())
}

/// Whether the scan's least misfit hardly rises towards an end of an unknown's values.
fn is_flat(Fitted { search, optimum }: Fitted, j: usize) -> bool {
    let scanned = search.journal.scanned_line(j);
    let least = scanned.iter().map(|(_, misfit)| *misfit).fold(f64::INFINITY, f64::min);
    let ends = [scanned.first(), scanned.last()].into_iter().flatten();
    let is_flat =
        |(x, misfit): &(f64, f64)| (x - optimum.x[j]).abs() > LN_2 && *misfit < FLAT * least;
    scanned.len() > 2 && ends.into_iter().any(is_flat)
}

impl<'a> Profile<'a> {
    fn new(fitted: Fitted<'a>, unknown: usize, variance: f64) -> Self {
        let Fitted { search, optimum } = fitted;
        let [low, high] = search.unknowns[unknown].scaled_bounds();
        let optimal = optimum.x[unknown];
        let scanned = search.journal.scanned_values(unknown).last().copied();
        let largest = match search.unknowns[unknown].parameter.quantity().candidates {
            Candidates::Decades(_, largest, _) => Some(largest.ln()),
            _ => None,
        };
        // A start may be far above all sensible values.
        let last = [scanned, largest].into_iter().flatten().fold(f64::INFINITY, f64::min);
        let here = optimal.min(last);
        let range = [low, high.min(last + BEYOND_SCAN)];
        let first = Point { held: optimal, x: optimum.x.clone(), rise: 0.0 };
        Self { fitted, unknown, here, range, variance, points: vec![first] }
    }

    /// The bound, if exactly one side is open; `up` standard deviations end a one-sided 95 % interval.
    fn bound(mut self, up: f64) -> Result<Option<Bound>, Error> {
        let here = self.here;
        if here != self.fitted.optimum.x[self.unknown] {
            let point = self.at(here, &self.fitted.optimum.x)?;
            self.insert(point);
        }
        for side in [-1.0, 1.0] {
            self.explore(side, &DISTANCES)?;
        }
        for side in [-1.0, 1.0] {
            if self.is_open() == [true; 2] {
                self.explore(side, &FARTHER)?;
            }
        }
        let least = self.least();
        self.note_lower(least)?;
        let [is_closed_below, is_closed_above] = self.is_closed();
        let side = match self.is_open() {
            [true, _] if is_closed_above => 1.0,
            [_, true] if is_closed_below => -1.0,
            _ => return Ok(None),
        };
        let end = self.end(side, least + up * up)?;
        let unknown = &self.fitted.search.unknowns[self.unknown];
        let accepted = self.points.iter().filter(|p| p.rise <= least + up * up);
        // The optimum, or what is as good and nearest to it.
        let value = accepted.min_by(|a, b| (a.held - here).abs().total_cmp(&(b.held - here).abs()));
        let bound = unknown.from_scale(end);
        Ok(Some(Bound {
            value: unknown.from_scale(value.map_or(here, |point| point.held)),
            lower95: (side < 0.0).then_some(bound),
            upper95: (side > 0.0).then_some(bound),
            log_deviation: 1.0,
        }))
    }

    /// The least rise of the profile, which is below zero where the optimum is not the best.
    fn least(&self) -> f64 {
        self.points.iter().map(|p| p.rise).fold(f64::INFINITY, f64::min)
    }

    /// Whether the lower and the upper side are open. The end of a side that is lies beyond a factor of two.
    fn is_open(&self) -> [bool; 2] {
        let (least, here) = (self.least(), self.here);
        let is_open =
            |p: &Point| p.rise - least < OPEN_BELOW && (p.held - here).abs() >= 0.99 * LN_2;
        [self.points.first(), self.points.last()].map(|end| end.is_some_and(is_open))
    }

    /// Whether the profile rises on the lower and the upper side. At a bound of the parameter it may do neither.
    fn is_closed(&self) -> [bool; 2] {
        let least = self.least();
        let is_closed = |p: &Point| p.rise - least >= OPEN_BELOW;
        [self.points.first(), self.points.last()].map(|end| end.is_some_and(is_closed))
    }

    /// Evaluates the profile on a side at growing distances, until it has risen.
    fn explore(&mut self, side: f64, distances: &[f64]) -> Result<(), Error> {
        let ([low, high], here) = (self.range, self.here);
        let limit = if side > 0.0 { high - here } else { here - low };
        let end = if side > 0.0 { self.points.last() } else { self.points.first() };
        let explored = end.map_or(0.0, |end| (end.held - here).abs());
        let mut from = end.map_or(&self.fitted.optimum.x, |end| &end.x).clone();
        for distance in distances {
            let reached = distance.min(limit);
            if reached <= explored {
                return Ok(());
            }
            let point = self.at(here + side * reached, &from)?;
            if point.rise.is_infinite() {
                // What cannot be simulated shows nothing of the data.
                return Ok(());
            }
            let risen = point.rise > CLOSED_ABOVE;
            from.clone_from(&point.x);
            self.insert(point);
            if risen || reached < *distance {
                return Ok(());
            }
        }
        Ok(())
    }

    /// The profile at a value, where the other unknowns start `from`; infinite where it cannot be simulated.
    fn at(&self, held: f64, from: &[f64]) -> Result<Point, Error> {
        let mut x = from.to_vec();
        x[self.unknown] = held;
        match self.fitted.search.optimum_with_held(self.unknown, held, from) {
            Ok(there) => {
                let rise = 2.0 * (there.cost - self.fitted.optimum.cost) / self.variance;
                Ok(Point { held, x: there.x, rise })
            }
            Err(Error::Interrupted) => Err(Error::Interrupted),
            Err(_) => Ok(Point { held, x, rise: f64::INFINITY }),
        }
    }

    fn insert(&mut self, point: Point) {
        self.points.push(point);
        self.points.sort_by_cached_key(|x| total_order(x.held));
    }

    /// Records a point that is clearly lower than the optimum as a minimum to be followed.
    fn note_lower(&self, least: f64) -> Result<(), Error> {
        let lowest = self.points.iter().find(|p| p.rise == least && least < -OPEN_BELOW);
        if let Some(point) = lowest {
            let there = self.fitted.search.optimum_with_held(self.unknown, point.held, &point.x)?;
            self.fitted.search.add_minimum(&there);
        }
        Ok(())
    }

    /// Where the profile rises above `level`, going to a `side` from the open one.
    fn end(&mut self, side: f64, level: f64) -> Result<f64, Error> {
        for _ in 0..MOST_STEPS {
            let order: Vec<usize> = match side > 0.0 {
                true => (0..self.points.len()).rev().collect(),
                false => (0..self.points.len()).collect(),
            };
            // From the closed end inwards, the first that is accepted.
            let Some(k) = order.iter().position(|i| self.points[*i].rise <= level) else { break };
            let inner = &self.points[order[k]];
            let Some(outer) = k.checked_sub(1).map(|k| &self.points[order[k]]) else {
                return Ok(inner.held);
            };
            if (outer.held - inner.held).abs() < TOLERANCE {
                return Ok(outer.held);
            }
            // A parabola through the level would be between; halves are safe.
            let part = ((level - inner.rise) / (outer.rise - inner.rise)).sqrt();
            let part = if part.is_finite() { part.clamp(0.1, 0.9) } else { 0.5 };
            let (held, from) = (inner.held + part * (outer.held - inner.held), inner.x.clone());
            let point = self.at(held, &from)?;
            self.insert(point);
        }
        let accepted = self.points.iter().filter(|p| p.rise <= level);
        let ends = accepted.map(|p| p.held);
        Ok(match side > 0.0 {
            true => ends.fold(f64::NEG_INFINITY, f64::max),
            false => ends.fold(f64::INFINITY, f64::min),
        })
    }
}
