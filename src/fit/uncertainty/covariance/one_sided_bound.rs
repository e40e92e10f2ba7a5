//! One-sided bounds of parameters that the data do not bound on the other side, from the profile likelihood.
//!
//! Above some modulus a rod no longer bends by a detectable amount: the misfit is flat, and an interval around the
//! optimum has no meaning. Candidates are positive parameters without a prior that alone form an unidentifiable
//! direction, or (except those that may be zero) whose misfit in the global scan is flat at an end. Parameters in an
//! unidentifiable combination are none. The parameter is held and all others are fitted (profile), at factors of 2, 16
//! and 65536 to both sides of the optimum; at 2^32 and 2^48 too if both sides are open. The values are within the
//! bounds of the parameter and at most [`BEYOND_SCAN`] above the scan; if the optimum is above the scan, factors are
//! counted from the end of the scan. If the profile has risen by [`OPEN_BELOW`] there, the data determine a value above
//! the scan, and factors and range are counted from the optimum. Rises are those of twice the misfit over the least of
//! the profile, in units of the variance of the noise. A side is open if its farthest point, at least a factor of 2
//! off, has risen by less than [`OPEN_BELOW`], and closed if it has risen by at least that. If one side is open and the
//! other closed, the bound is the value on the closed side where the rise is the squared one-sided 95 % quantile.
//! [`add_one_sided_bounds`] adds the bounds, in the unit of the parameter, to the entries of the candidates: an upper
//! bound where the lower side is open, a lower bound where the upper side is open. It adds none without convergence or
//! where residuals are rounding errors. A stop is an error, and so is a failed fit at a lower minimum that a profile
//! finds.

use crate::error::Error;
use crate::fit::search::damping::may_vanish;
use crate::fit::search::fitted::Fitted;
use crate::fit::uncertainty::covariance::gauss_newton::Covariance;
use crate::fit::uncertainty::covariance::zero_bound::NearZeroEstimate;
use crate::fit::uncertainty::noise::autocorrelation::NoiseModel;
use crate::fit::uncertainty::noise::residual_noise::ResidualNoise;
use crate::numerics::total_order;
use crate::scene::number::Candidates;
use std::f64::consts::LN_2;

/// Rise of the profile, in units of the variance of the noise, below which a side is open and from which on it is
/// closed: two standard deviations of a likelihood ratio.
const OPEN_BELOW: f64 = 4.0;
/// Rise over the optimum, in units of the variance of the noise, above which nothing farther off is evaluated: five
/// standard deviations.
const CLOSED_ABOVE: f64 = 25.0;
/// Distances on the scale of logarithms at which the profile is evaluated: factors of 2, 16 and 65536 (nearly five
/// decades). Farther off the rounding errors of a simulation show.
const DISTANCES: [f64; 3] = [LN_2, 4.0 * LN_2, 16.0 * LN_2];
/// Further distances where the profile is flat on both sides: the optimum may be 9.6 or 14.4 decades from where it
/// rises.
const FARTHER: [f64; 2] = [32.0 * LN_2, 48.0 * LN_2];
/// Least distance of the farthest point of an open side on the scale of logarithms: a factor of two, less a margin for
/// rounding.
const LEAST_DISTANCE: f64 = 0.99 * LN_2;
/// Distance beyond the largest value of the scan, on the scale of logarithms, up to which the profile is evaluated: a
/// factor of 16.
const BEYOND_SCAN: f64 = 4.0 * LN_2;
/// Misfit at an end of the scan over the least misfit of the scan, below which the end is flat and the profile is
/// evaluated. A rise by [`OPEN_BELOW`] of twenty values is less.
const FLAT: f64 = 1.5;
/// Largest number of points of the search for the end of a bound.
const MOST_STEPS: usize = 12;
/// Accuracy of an end on the scale of logarithms: 2 %.
const TOLERANCE: f64 = 0.02;
/// Least and largest part of the bracket of an end at which its next point is evaluated, so that every step shortens
/// the bracket.
const BRACKET_PARTS: [f64; 2] = [0.1, 0.9];

/// A point of the profile: the optimum of all other unknowns with one unknown held.
struct ProfilePoint {
    /// The held unknown, on its scale.
    held: f64,
    /// All unknowns at this point, on their scales, the held one included.
    x: Vec<f64>,
    /// Rise of twice the misfit over the optimum, in units of the variance of the noise.
    rise: f64,
}

/// The search for a one-sided bound of one unknown by its profile likelihood.
struct BoundSearchProfile<'a> {
    /// The search with its optimum.
    fitted: Fitted<'a>,
    /// Index of the unknown.
    unknown: usize,
    /// Origin of the distances, on the scale of the unknown: its optimum, or the largest sensible value where the
    /// optimum is above it and the data fit that value too. Rounding errors of simulations are small there.
    here: f64,
    /// Least and largest value of the unknown, on its scale, at which the profile is evaluated.
    range: [f64; 2],
    /// Variance of the noise, with the inflation by autocorrelation for this unknown.
    variance: f64,
    /// Evaluated points, ascending by the held value.
    points: Vec<ProfilePoint>,
}

/// Sets entries of `bounds` (one per unknown) that have no one-sided bound yet to the bound by the profile likelihood,
/// where there is one. Candidates are positive parameters without a prior that are unidentifiable by themselves, not in
/// a combination. Others except dampings are candidates if their scan is flat on a side. Unknowns without an effect on
/// the residuals are no candidates. Nothing is added without convergence, or where the residuals are rounding errors.
/// The standard deviation of the logarithm of a bounded unknown is that with all others held, at least 1. Lower minima
/// that the profiles find are recorded in the search. Error: the fit is stopped, or the fit at such a minimum fails.
pub(crate) fn add_one_sided_bounds(
    fitted: Fitted,
    noise: &ResidualNoise,
    correlations: &NoiseModel,
    covariance: &Covariance,
    bounds: &mut [Option<NearZeroEstimate>],
) -> Result<(), Error> {
    let Fitted { search, optimum } = fitted;
    if !optimum.converged || search.is_rounding(optimum) {
        return Ok(());
    }
    for (j, unknown) in search.unknowns.iter().enumerate() {
        let found = || covariance.findings.iter().map(|f| &f.parameters[..]);
        // The profiles of both parts of an undetermined combination are flat: they have no bound.
        let is_combined = found().any(|all| all.len() > 1 && all.contains(&unknown.parameter));
        let is_refused =
            covariance.deviation[j].is_none() && found().any(|all| all == [unknown.parameter]);
        let is_suspect = is_refused || !may_vanish(unknown) && is_scan_flat(fitted, j);
        let has_bound = bounds[j].is_some_and(|bound| bound.is_one_sided());
        let has_profile = unknown.parameter.is_positive() && unknown.prior.is_none();
        let squares =
            optimum.jacobian.iter().zip(&noise.weights).map(|(row, w)| (w * row[j]).powi(2));
        let norm = squares.sum::<f64>().sqrt();
        // Without an effect on the residuals the profile is flat.
        if !has_profile || is_combined || !is_suspect || has_bound || norm == 0.0 {
            continue;
        }
        // Autocorrelated noise makes the same rise less significant.
        let variance = noise.misfit_scale * correlations.inflation[j].powi(2);
        let profile = BoundSearchProfile::new(fitted, j, variance);
        if let Some(bound) = profile.bound(correlations.one_sided_factor(j))? {
            let deviation = noise.variance.sqrt() / norm;
            let log_deviation = if deviation.is_finite() { deviation.max(1.0) } else { 1.0 };
            bounds[j] = Some(NearZeroEstimate { log_deviation, ..bound });
        }
    }
    Ok(())
}

/// Whether the global scan of the search is flat at the least or the largest of its values of unknown `j`. There the
/// misfit is below [`FLAT`] times the least one of this line of the scan, and the value is more than a factor of two
/// from the optimum. False with fewer than three scanned values.
fn is_scan_flat(Fitted { search, optimum }: Fitted, j: usize) -> bool {
    let scanned = search.journal.scanned_line(j);
    let least = scanned.iter().map(|(_, misfit)| *misfit).fold(f64::INFINITY, f64::min);
    let ends = [scanned.first(), scanned.last()].into_iter().flatten();
    let is_flat =
        |(x, misfit): &(f64, f64)| (x - optimum.x[j]).abs() > LN_2 && *misfit < FLAT * least;
    scanned.len() > 2 && ends.into_iter().any(is_flat)
}

impl<'a> BoundSearchProfile<'a> {
    /// The profile with the optimum as its only point. `variance` is that of the noise for this unknown. Let `last` be
    /// the largest scanned value or the largest usual value of the parameter, whichever is smaller; without either it
    /// is infinite. The range is that of the bounds of the unknown, but ends [`BEYOND_SCAN`] above `last`. Distances
    /// are counted from the optimum, or from `last` if the optimum is larger.
    fn new(fitted: Fitted<'a>, unknown: usize, variance: f64) -> Self {
        let Fitted { search, optimum } = fitted;
        let [low, high] = search.unknowns[unknown].scaled_bounds();
        let optimal = optimum.x[unknown];
        // The profile starts within the scan, which covers all sensible values.
        let scanned = search.journal.scanned_values(unknown).last().copied();
        let largest = match search.unknowns[unknown].parameter.quantity().candidates {
            Candidates::Decades(_, largest, _) => Some(largest.ln()),
            _ => None,
        };
        // A start of the fit may be far above all sensible values.
        let last = [scanned, largest].into_iter().flatten().fold(f64::INFINITY, f64::min);
        let here = optimal.min(last);
        let range = [low, high.min(last + BEYOND_SCAN)];
        let first = ProfilePoint { held: optimal, x: optimum.x.clone(), rise: 0.0 };
        Self { fitted, unknown, here, range, variance, points: vec![first] }
    }

    /// The bound, in the parameter's unit, if one side is open and the other is closed; else none. It is an upper bound
    /// if the lower side is open, else a lower bound. `quantile` is the distance of a one-sided 95 % limit in standard
    /// deviations: the bound is where the rise over the least point is its square. The estimate is the evaluated point
    /// nearest to `here` with a rise up to that level, and `log_deviation` is a placeholder of 1. A lower minimum than
    /// the optimum is recorded in the search. Error: the fit is stopped, or fails at that minimum.
    fn bound(mut self, quantile: f64) -> Result<Option<NearZeroEstimate>, Error> {
        let optimal = self.fitted.optimum.x[self.unknown];
        if self.here != optimal {
            let point = self.evaluate(self.here, &self.fitted.optimum.x)?;
            if point.rise < OPEN_BELOW {
                self.insert(point);
            } else {
                // The data exclude all sensible values: larger ones are evaluated about the optimum.
                let [low, high] = self.fitted.search.unknowns[self.unknown].scaled_bounds();
                self.here = optimal;
                self.range = [low, high.min(optimal + BEYOND_SCAN)];
            }
        }
        let here = self.here;
        self.explore(-1.0, &DISTANCES)?;
        self.explore(1.0, &DISTANCES)?;
        // Flat on both sides: the optimum may be far from where the profile rises.
        for side in [-1.0, 1.0] {
            if self.is_open() == [true; 2] {
                self.explore(side, &FARTHER)?;
            }
        }
        let least = self.least();
        self.record_lower_minimum(least)?;
        // Exactly one open side is a bound; none is an interval, two are not identifiable.
        let [is_closed_below, is_closed_above] = self.is_closed();
        let side = match self.is_open() {
            [true, _] if is_closed_above => 1.0,
            [_, true] if is_closed_below => -1.0,
            _ => return Ok(None),
        };
        let level = least + quantile * quantile;
        let end = self.end(side, level)?;
        let unknown = &self.fitted.search.unknowns[self.unknown];
        let accepted = self.points.iter().filter(|p| p.rise <= level);
        // The accepted point that is nearest to the optimum.
        let value = accepted.min_by(|a, b| (a.held - here).abs().total_cmp(&(b.held - here).abs()));
        let bound = unknown.from_scale(end);
        Ok(Some(NearZeroEstimate {
            value: unknown.from_scale(value.map_or(here, |point| point.held)),
            lower95: (side < 0.0).then_some(bound),
            upper95: (side > 0.0).then_some(bound),
            log_deviation: 1.0,
        }))
    }

    /// The least rise of the points over the optimum; at most 0, as the optimum is a point, and negative where a point
    /// is better than the optimum.
    fn least(&self) -> f64 {
        self.points.iter().map(|p| p.rise).fold(f64::INFINITY, f64::min)
    }

    /// Whether the lower and the upper side are open: their farthest points are at least [`LEAST_DISTANCE`] from the
    /// origin of the distances (`here`) and have risen by less than [`OPEN_BELOW`] over the least point.
    fn is_open(&self) -> [bool; 2] {
        let (least, here) = (self.least(), self.here);
        self.test_ends(|p| p.rise - least < OPEN_BELOW && (p.held - here).abs() >= LEAST_DISTANCE)
    }

    /// Whether the farthest points of the lower and the upper side have risen by at least [`OPEN_BELOW`] over the least
    /// point. At a bound of the parameter a side may be neither open nor closed.
    fn is_closed(&self) -> [bool; 2] {
        let least = self.least();
        self.test_ends(|p| p.rise - least >= OPEN_BELOW)
    }

    /// Results of a `test` of the point with the least held value (lower side) and of that with the largest one (upper
    /// side).
    fn test_ends(&self, test: impl Fn(&ProfilePoint) -> bool) -> [bool; 2] {
        [self.points.first(), self.points.last()].map(|end| end.is_some_and(&test))
    }

    /// Evaluates the profile on a `side` (-1 or 1) at these ascending `distances` from `here` and adds the points.
    /// Points start from the fit at the point before. It ends after a point that has risen above [`CLOSED_ABOVE`],
    /// after the end of the range, and before a point that cannot be simulated. If the first distance is within the
    /// explored range, nothing is added. Error: the fit is stopped.
    fn explore(&mut self, side: f64, distances: &[f64]) -> Result<(), Error> {
        let ([low, high], here) = (self.range, self.here);
        let limit = if side > 0.0 { high - here } else { here - low };
        let end = if side > 0.0 { self.points.last() } else { self.points.first() };
        let explored = end.map_or(0.0, |end| (end.held - here).abs());
        // Each fit of the other unknowns starts at the optimum of the nearest point.
        let mut from = end.map_or(&self.fitted.optimum.x, |end| &end.x).clone();
        for distance in distances {
            let reached = distance.min(limit);
            if reached <= explored {
                return Ok(());
            }
            let point = self.evaluate(here + side * reached, &from)?;
            if point.rise.is_infinite() {
                return Ok(());
            }
            let is_last = point.rise > CLOSED_ABOVE || reached < *distance;
            from.clone_from(&point.x);
            self.insert(point);
            if is_last {
                return Ok(());
            }
        }
        Ok(())
    }

    /// The profile at the value `held` of the unknown, on its scale (logarithm), by a fit of the other unknowns from
    /// `from`. Where that fit fails the rise is infinite, and the others stay at `from`. Error: the fit is stopped.
    fn evaluate(&self, held: f64, from: &[f64]) -> Result<ProfilePoint, Error> {
        let mut x = from.to_vec();
        x[self.unknown] = held;
        match self.fitted.search.optimum_with_held(self.unknown, held, from) {
            Ok(there) => {
                let rise = 2.0 * (there.cost - self.fitted.optimum.cost) / self.variance;
                Ok(ProfilePoint { held, x: there.x, rise })
            }
            Err(Error::Interrupted) => Err(Error::Interrupted),
            Err(_) => Ok(ProfilePoint { held, x, rise: f64::INFINITY }),
        }
    }

    /// Adds a point to the points, which stay ascending by the held value.
    fn insert(&mut self, point: ProfilePoint) {
        self.points.push(point);
        self.points.sort_by_cached_key(|x| total_order(x.held));
    }

    /// Adds the lowest point to the local minima of the search, after a repeated fit there, if it is lower than the
    /// optimum by more than [`OPEN_BELOW`]. `least` is its rise over the optimum (negative where it is lower): that of
    /// twice the misfit, in units of the variance of the noise. Error: the repeated fit at that point fails.
    fn record_lower_minimum(&self, least: f64) -> Result<(), Error> {
        let lowest = self.points.iter().find(|p| p.rise == least && least < -OPEN_BELOW);
        if let Some(point) = lowest {
            let there = self.fitted.search.optimum_with_held(self.unknown, point.held, &point.x)?;
            self.fitted.search.add_minimum(&there);
        }
        Ok(())
    }

    /// Value of the unknown, on its scale (logarithm), at which the profile rises above `level` on the given `side` (-1
    /// or 1), to [`TOLERANCE`]. Each new point is where a parabola through the outermost accepted point (rise up to
    /// `level`) and its neighbor outside reaches the level. The result is that neighbor once it is near enough. Without
    /// a neighbor outside, or after [`MOST_STEPS`], it is the outermost accepted point. Error: the fit is stopped.
    fn end(&mut self, side: f64, level: f64) -> Result<f64, Error> {
        for _ in 0..MOST_STEPS {
            // From the closed end inwards, the first accepted point, and the one outside of it.
            let mut order: Vec<&ProfilePoint> = self.points.iter().collect();
            if side > 0.0 {
                order.reverse();
            }
            let Some(k) = order.iter().position(|point| point.rise <= level) else { break };
            let inner = order[k];
            let Some(outer) = k.checked_sub(1).map(|k| order[k]) else { return Ok(inner.held) };
            if (outer.held - inner.held).abs() < TOLERANCE {
                return Ok(outer.held);
            }
            // The profile is nearly a parabola; bisection where that fails.
            let part = ((level - inner.rise) / (outer.rise - inner.rise)).sqrt();
            let part =
                if part.is_finite() { part.clamp(BRACKET_PARTS[0], BRACKET_PARTS[1]) } else { 0.5 };
            let (held, from) = (inner.held + part * (outer.held - inner.held), inner.x.clone());
            let point = self.evaluate(held, &from)?;
            self.insert(point);
        }
        let accepted = self.points.iter().filter(|p| p.rise <= level).map(|p| side * p.held);
        Ok(side * accepted.fold(f64::NEG_INFINITY, f64::max))
    }
}
