//! Profile likelihood intervals.
//!
//! Hold one unknown, fit all others: the misfit as a function of the held one is the profile. The
//! interval ends where it has risen by half the squared quantile of the noise. Unlike the standard
//! error it does not take the model for linear.

use crate::code::Code;
use crate::error::Error;
use crate::fit::search::Search;
use crate::fit::search::fitted::Fitted;
use crate::fit::search::optimum::Optimum;
use crate::fit::uncertainty::covariance::local_analysis::LocalAnalysis;
use crate::fit::uncertainty::grade::{Severity, Warnings};
use crate::fit::unknown::Unknown;
use crate::numerics::total_order;
use crate::scene::Parameter;
use serde::{Deserialize, Serialize};

/// The end of an interval is found to this part of a standard deviation.
const TOLERANCE: f64 = 1e-3;
/// Profile points per end.
const MOST_POINTS: usize = 40;
/// An end farther than this on the unknown's scale (20 decades of a logarithm) is none.
const FARTHEST: f64 = 46.0;

/// Profile likelihood of a parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Profile {
    /// Name of the parameter.
    pub name: Parameter,
    /// Name of the parameter with its experiments, if it does not belong to all.
    pub label: String,
    /// Values of the parameter, ascending, in its unit.
    pub values: Vec<f64>,
    /// Rise of twice the misfit over the optimum, all other parameters fitted, in units of the
    /// noise variance.
    pub rise: Vec<f64>,
    /// Rise of the profile at the ends of the 95 % interval, in units of the noise variance.
    pub level: f64,
}

/// The profile interval of one unknown, on its scale.
#[derive(Clone, Debug)]
pub(crate) struct Interval {
    /// Lower and upper end; none where the misfit never rises enough.
    pub ends: [Option<f64>; 2],
    /// A point of the profile with a clearly lower misfit than the fit's.
    pub better: Option<f64>,
    /// Points of the profile: the unknown, and the rise of twice the misfit in units of the
    /// noise's variance.
    pub points: Vec<(f64, f64)>,
}

/// A point of the profile.
struct Point {
    x: Vec<f64>,
    /// Signed root of the rise of twice the misfit, in units of the noise.
    rise: f64,
    /// Its derivative by the held unknown.
    slope: f64,
}

/// The profile intervals of all unknowns with a standard deviation; those that were not looked at in
/// time are none.
pub(crate) fn intervals(
    fitted: Fitted,
    LocalAnalysis { covariance, noise, correlations, .. }: &LocalAnalysis,
    warnings: &mut Warnings,
) -> Vec<Option<Interval>> {
    let search = fitted.search;
    let mut intervals = vec![None; search.unknowns.len()];
    for (i, unknown) in search.unknowns.iter().enumerate() {
        let Some(sd) = covariance.deviation[i].filter(|sd| *sd > 0.0) else { continue };
        let size = noise.rise.sqrt() * correlations.inflation[i];
        let found = interval(fitted, i, (sd, size, correlations.reach[i]));
        if search.is_stopped() {
            // Half a profile says nothing about its ends.
            break;
        }
        if let Some(x) = found.better {
            let words = format!(
                "{unknown} = {:e} has a lower misfit. The result is not the global minimum. Give a start near \
                 that value",
                unknown.from_scale(x)
            );
            warnings.add(Severity::Worthless, Code::BetterMinimum, words);
        }
        intervals[i] = Some(found);
    }
    intervals
}

/// The interval of unknown `i` around `optimum`, where the profile has risen to `reach` times the
/// standard deviation `noise` of the residuals (1 when sigma is known and the noise white); `deviation` is
/// the unknown's standard deviation.
fn interval(
    Fitted { search, optimum }: Fitted,
    i: usize,
    (deviation, noise, reach): (f64, f64, f64),
) -> Interval {
    let mut better = None;
    let mut points = vec![(optimum.x[i], 0.0)];
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
            points.push((held, point.rise * point.rise.abs()));
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
        search.report(&format!("profile of {}", search.unknowns[i]));
    }
    Interval { ends, better, points }
}

fn profile(
    search: &Search,
    from: &[f64],
    i: usize,
    held: f64,
    least: f64,
    noise: f64,
) -> Result<Point, Error> {
    let optimum = search.optimum_with_held(i, held, from)?;
    let Optimum { x, cost, residuals, jacobian, .. } = optimum;
    let all = search.all_residuals()?;
    let made = all.losses().into_iter().zip(all.leverage_weights());
    let gradient: f64 = made
        .zip(jacobian.iter().zip(&residuals))
        .map(|((loss, weight), (row, r))| weight * row[i] * loss.influence(weight * r)[0])
        .sum();
    let excess = 2.0 * (cost - least);
    let rise = excess.abs().sqrt().copysign(excess) / noise;
    // d(rise^2)/dx = 2 gradient/noise^2.
    let slope = gradient / (rise.abs().max(f64::MIN_POSITIVE) * noise * noise);
    Ok(Point { x, rise, slope })
}

impl Interval {
    /// The ends in the parameter's unit.
    pub fn values(&self, unknown: &Unknown) -> [Option<f64>; 2] {
        self.ends.map(|end| {
            let [low, high] = unknown.parameter.limits();
            end.map(|x| unknown.from_scale(x).clamp(low, high))
        })
    }

    /// The curve, and where its 95 % interval ends.
    pub fn profile(&self, unknown: &Unknown, reach: f64) -> Profile {
        let mut points = self.points.clone();
        points.sort_by_cached_key(|x| total_order(x.0));
        Profile {
            name: unknown.parameter,
            label: unknown.to_string(),
            values: points.iter().map(|(x, _)| unknown.from_scale(*x)).collect(),
            rise: points.iter().map(|(_, rise)| *rise).collect(),
            level: reach * reach,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::measurement::experiment::Experiment;
    use crate::fit::measurement::motion::Observation;
    use crate::fit::search::Task;
    use crate::fit::uncertainty::analysis::TOLERANCE;
    use crate::scene::Parameter;
    use crate::scene::Point;
    use crate::scene::{Material, Scene, Section, Shape, Time};

    /// A profile that starts away from the minimum says that it found better; one that starts at
    /// the minimum of nearly linear data ends where the standard error says.
    #[test]
    fn a_better_fit_is_noticed() {
        let shape = Shape::Straight { length: 0.5, direction: [1.0, 0.0, 0.0] };
        let section = Section::Circle { radius: 0.005 };
        let mut scene = Scene::new(8, shape, section, Material::new(1273.52, 1e8));
        scene.loads.gravity = [0.0, -9.8, 0.0];
        scene.time = Some(Time::new(0.4, 4e-3));
        let problem = scene.problem().unwrap();
        let run = problem.simulate().unwrap();
        let samples = (1..=20).map(|k| {
            let (x, _) = run.at(Point::Tip, 0.02 * f64::from(k)).unwrap();
            crate::fit::Sample { time: 0.02 * f64::from(k), position: x.map(Some) }
        });
        let observation = Observation::new(samples.collect());
        let experiments = [Experiment::new("", &problem).observe(observation)];
        let unknowns = [Unknown::new(Parameter::YoungsModulus)];
        let task = Task {
            experiments: &experiments,
            leverage_weights: &[],
            sigmas: &[1e-3],
            unknowns: &unknowns,
            full_work: 1.0,
            tolerance: TOLERANCE,
        };
        let search = task.search();
        let best = search.polish(&[1.01e8_f64.ln()]).unwrap();
        let norm = best.jacobian.iter().map(|row| row[0] * row[0]).sum::<f64>().sqrt();
        let sd = 1.0 / norm;
        let found = interval(Fitted { search: &search, optimum: &best }, 0, (sd, 1.0, 1.96));
        assert!(found.better.is_none());
        for (end, side) in found.ends.iter().zip([-1.0, 1.0]) {
            let expected = 1e8_f64.ln() + side * 1.96 * sd;
            assert!((end.unwrap() - expected).abs() < 0.05 * sd, "{found:?}");
        }
        let away = search.all_residuals().unwrap().residuals(&[best.x[0] + 4.0 * sd]).unwrap();
        let cost = crate::numerics::half_sum_of_squares(&away);
        let off = Optimum { x: vec![best.x[0] + 4.0 * sd], cost, ..best };
        assert!(
            interval(Fitted { search: &search, optimum: &off }, 0, (sd, 1.0, 1.96))
                .better
                .is_some()
        );
    }
}
