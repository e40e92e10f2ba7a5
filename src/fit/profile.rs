//! Profile likelihood intervals.
//!
//! Hold one unknown, fit all others: the misfit as a function of the held one is the profile. The
//! interval ends where it has risen by half the squared quantile of the noise. Unlike the standard
//! error it does not take the model for linear.

use super::search::{Optimum, Search};
use super::{Residuals, Unknown};
use crate::error::Error;
use argmin::core::Gradient;
use std::rc::Rc;

/// The end of an interval is found to this part of a standard deviation.
const TOLERANCE: f64 = 1e-3;
/// Profile points per end.
const MOST_POINTS: usize = 40;
/// An end farther than this on the unknown's scale (20 decades of a logarithm) is none.
const FARTHEST: f64 = 46.0;

/// The profile interval of one unknown, on its scale.
#[derive(Clone, Copy, Debug)]
pub(super) struct Interval {
    /// Lower and upper end; none where the misfit never rises enough.
    pub ends: [Option<f64>; 2],
    /// A point of the profile with a clearly lower misfit than the fit's.
    pub better: Option<f64>,
}

/// A point of the profile.
struct Point {
    x: Vec<f64>,
    /// Signed root of the rise of twice the misfit, in units of the noise.
    rise: f64,
    /// Its derivative by the held unknown.
    slope: f64,
}

/// The interval of unknown `i` around `optimum`, where the profile has risen to `reach` times the
/// standard deviation `noise` of the residuals (1 when sigma is known); `deviation` is the
/// unknown's standard deviation.
pub(super) fn interval(
    search: &Search,
    optimum: &Optimum,
    i: usize,
    (deviation, noise, reach): (f64, f64, f64),
) -> Result<Interval, Error> {
    let mut better = None;
    let mut ends = [None; 2];
    for (end, side) in ends.iter_mut().zip([-1.0, 1.0]) {
        let bound = search.unknowns[i].scaled_bounds()[usize::from(side > 0.0)];
        let mut from = optimum.x.clone();
        let start = optimum.x[i];
        let (mut inner, mut outer): (f64, Option<f64>) = (0.0, None);
        let mut distance = reach * deviation;
        for _ in 0..MOST_POINTS {
            let limit = (bound - start) * side;
            distance = distance.min(limit).min(FARTHEST);
            if distance <= 0.0 {
                *end = Some(bound);
                break;
            }
            let held = start + side * distance;
            let Ok(point) = profile(search, &from, i, held, optimum.cost, noise) else {
                // Where nothing can be simulated there is no profile: look nearer.
                outer = Some(distance);
                distance = 0.5 * (inner + distance);
                if distance - inner < TOLERANCE * deviation {
                    break;
                }
                continue;
            };
            if point.rise < -1e-2 {
                better = Some(held);
                break;
            }
            if (point.rise - reach).abs() <= TOLERANCE {
                *end = Some(held);
                break;
            }
            let newton = distance + (reach - point.rise) / (side * point.slope);
            match point.rise < reach {
                true if distance >= limit => {
                    // The bound is nearer than the interval's end.
                    *end = Some(bound);
                    break;
                }
                true if distance >= FARTHEST => break,
                true => {
                    inner = distance;
                    from = point.x;
                }
                false => outer = Some(distance),
            }
            let (low, high) = match outer {
                Some(outer) => (inner + 0.05 * (outer - inner), outer - 0.05 * (outer - inner)),
                None => (1.02 * inner, 2.5 * inner),
            };
            distance =
                if newton.is_finite() { newton.clamp(low, high) } else { 0.5 * (low + high) };
        }
        search.report(&format!("profile of {}", search.unknowns[i].parameter));
    }
    Ok(Interval { ends, better })
}

fn profile(
    search: &Search,
    from: &[f64],
    i: usize,
    held: f64,
    least: f64,
    noise: f64,
) -> Result<Point, Error> {
    let mut unknowns = search.unknowns.to_vec();
    let value = unknowns[i].from_scale(held);
    unknowns[i] = unknowns[i].bounds(value, value);
    let held_search = Search {
        problem: search.problem,
        observations: search.observations,
        sigmas: search.sigmas.clone(),
        unknowns: &unknowns,
        full_work: search.full_work,
        work: Rc::clone(&search.work),
        progress: None,
    };
    let mut start = from.to_vec();
    start[i] = held;
    let residuals: Residuals = held_search.residuals(search.duration())?;
    let (x, cost, gradient) = match unknowns.len() {
        1 => {
            let gradient = residuals.gradient(&start).map_err(fit_error)?;
            let cost = super::residuals::half_square(&residuals.residuals(&start)?);
            (start, cost, gradient[0])
        }
        _ => {
            let optimum = held_search.polish(&start)?;
            let rows = optimum.jacobian.iter().zip(&optimum.residuals);
            let gradient = rows.map(|(row, r)| row[i] * r).sum();
            (optimum.x, optimum.cost, gradient)
        }
    };
    let excess = 2.0 * (cost - least);
    let rise = excess.abs().sqrt().copysign(excess) / noise;
    // d(rise^2)/dx = 2 gradient/noise^2.
    let slope = gradient / (rise.abs().max(f64::MIN_POSITIVE) * noise * noise);
    Ok(Point { x, rise, slope })
}

fn fit_error(error: argmin::core::Error) -> Error {
    error.downcast::<Error>().unwrap_or_else(|error| Error::Fit(error.to_string()))
}

impl Interval {
    /// The ends in the parameter's unit.
    pub fn values(&self, unknown: &Unknown) -> [Option<f64>; 2] {
        self.ends.map(|end| {
            let [low, high] = unknown.parameter.limits();
            end.map(|x| unknown.from_scale(x).clamp(low, high))
        })
    }
}
