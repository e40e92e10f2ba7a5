//! Profile likelihood intervals, which do not assume a linear model.
//!
//! One unknown is held and all others are fitted: the misfit as a function of the held one is its profile. The 95 %
//! interval ends where twice the misfit, in units of the variance of the noise, has risen by the squared coverage
//! factor. Each end is found by Newton's method within brackets, on the signed root of the rise. The derivative of the
//! profile is the partial derivative of the misfit by the held unknown (envelope theorem). [`profile_intervals`]
//! returns the intervals and the evaluated points for plots, for all unknowns with a standard deviation, on request of
//! the fit; both are converted to the unit of the parameter (`ProfileInterval::values`). An end is the bound of the
//! unknown where the profile has not risen there. There is no end on a side where the profile has not risen enough at
//! the distance [`FARTHEST`], after [`MOST_POINTS`], where simulations fail before it, or with a point of a lower
//! misfit than the optimum. Such a point is a warning of a wrong minimum (severity `Worthless`).

use crate::code::Code;
use crate::error::Error;
use crate::fit::search::fitted::Fitted;
use crate::fit::uncertainty::covariance::local_analysis::LocalAnalysis;
use crate::fit::uncertainty::noise::residual_noise::misfit_slopes;
use crate::fit::uncertainty::warning_list::{Severity, Warnings};
use crate::fit::unknown::Unknown;
use crate::numerics::total_order;
use crate::scene::Parameter;
use serde::{Deserialize, Serialize};

/// Accuracy of the ends, in standard deviations: a thousandth does not change a reported digit.
const TOLERANCE: f64 = 1e-3;
/// Largest number of points of the profile for each end; an end that takes more is none.
const MOST_POINTS: usize = 40;
/// Largest distance of an end on the unknown's scale: 20 decades of a logarithm.
const FARTHEST: f64 = 46.0;
/// Signed root of the rise, in standard deviations, below which a point is better than the optimum.
const BETTER: f64 = -1e-2;

/// Part of a bracket, from either side, in which no Newton step ends, so that every step shortens the bracket.
const BRACKET_MARGIN: f64 = 0.05;
/// Least and largest factor on the distance from the optimum in a step without an outer bracket: smaller ones hardly
/// move, and larger ones may leave the range that can be simulated.
const EXPANSION: [f64; 2] = [1.02, 2.5];

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

/// A point of the profile, for plots.
#[derive(Clone, Copy, Debug)]
struct ProfileSample {
    /// The unknown, on its scale.
    x: f64,
    /// Rise of twice the misfit, in units of the variance of the noise.
    rise: f64,
}

/// The profile interval of one unknown, on its scale.
#[derive(Clone, Debug)]
pub(crate) struct ProfileInterval {
    /// Lower and upper end; none where none was found.
    ends: [Option<f64>; 2],
    /// The last found value of the unknown, on its scale, with a lower misfit than the optimum; none without one.
    better: Option<f64>,
    /// Evaluated points, in the order of evaluation.
    points: Vec<ProfileSample>,
}

/// A point of the profile: the fit of all others with one unknown held, and the derivative of the profile there.
struct RootedProfile {
    /// All unknowns at the point, on their scales.
    x: Vec<f64>,
    /// Root of the absolute rise of twice the misfit over the optimum, in standard deviations of the noise; negative
    /// where the misfit is lower than at the optimum.
    root: f64,
    /// Derivative of the root by the held unknown on its scale.
    slope: f64,
}

/// Profile intervals of all unknowns with a positive standard deviation, one entry per unknown in their order; none for
/// others. After a stop of the fit the unfinished one and all later ones are none. A point with a lower misfit than the
/// optimum adds a warning of the severity `Worthless`.
pub(crate) fn profile_intervals(
    fitted: Fitted,
    LocalAnalysis { covariance, noise, correlations, .. }: &LocalAnalysis,
    warnings: &mut Warnings,
) -> Vec<Option<ProfileInterval>> {
    let search = fitted.search;
    let mut intervals = vec![None; search.unknowns.len()];
    for (i, unknown) in search.unknowns.iter().enumerate() {
        let Some(sd) = covariance.deviation[i].filter(|sd| *sd > 0.0) else { continue };
        // Autocorrelated noise widens the profile as it does the standard error.
        let noise = noise.misfit_scale.sqrt() * correlations.inflation[i];
        let found = profile_interval(fitted, i, sd, noise, correlations.coverage_factor(i));
        if search.is_stopped() {
            break;
        }
        if let Some(x) = found.better {
            let text = format!(
                "{unknown} = {:e} has a lower misfit. The result is not the global minimum. Give a start near \
                 that value",
                unknown.from_scale(x)
            );
            warnings.add(Severity::Worthless, Code::BetterMinimum, text);
        }
        intervals[i] = Some(found);
    }
    intervals
}

/// The interval of unknown `i` on its scale (logarithm of a positive parameter), where its standard deviation is
/// `deviation`. At both ends the root of the rise of twice the misfit over the optimum, divided by `noise`, is the
/// `coverage_factor`. It is negative where the misfit is lower. `noise` is the standard deviation of the residuals for
/// this unknown. An end is the bound of the unknown where the profile has not risen there. There is none where the
/// profile has not risen enough at the distance [`FARTHEST`], after [`MOST_POINTS`], where simulations fail before the
/// end, and on a side with a point better than the optimum. That point, and all evaluated ones for plots, are part of
/// the result.
fn profile_interval(
    fitted: Fitted,
    i: usize,
    deviation: f64,
    noise: f64,
    coverage_factor: f64,
) -> ProfileInterval {
    let Fitted { search, optimum } = fitted;
    let start = optimum.x[i];
    let mut better = None;
    let mut points = vec![ProfileSample { x: start, rise: 0.0 }];
    let mut ends = [None; 2];
    for (end, side) in ends.iter_mut().zip([-1.0, 1.0]) {
        let bound = search.unknowns[i].scaled_bounds()[usize::from(side > 0.0)];
        let limit = (bound - start) * side;
        // Distances from the optimum that are within and beyond the interval.
        let (mut inner, mut outer): (f64, Option<f64>) = (0.0, None);
        let mut from = optimum.x.clone();
        // The linear model is the first guess.
        let mut distance = coverage_factor * deviation;
        for _ in 0..MOST_POINTS {
            distance = distance.min(limit).min(FARTHEST);
            // The optimum is at the bound of this side.
            if distance <= 0.0 {
                *end = Some(bound);
                break;
            }
            let held = start + side * distance;
            let Ok(point) = rooted_profile(fitted, i, held, &from, noise) else {
                // The simulation fails: the profile is evaluated nearer to the optimum.
                outer = Some(distance);
                distance = 0.5 * (inner + distance);
                if distance - inner < TOLERANCE * deviation {
                    break;
                }
                continue;
            };
            points.push(ProfileSample { x: held, rise: point.root * point.root.abs() });
            // The optimum is not the least point: its interval has no meaning.
            if point.root < BETTER {
                better = Some(held);
                break;
            }
            if (point.root - coverage_factor).abs() <= TOLERANCE {
                *end = Some(held);
                break;
            }
            // Newton's method, within brackets.
            let newton = distance + (coverage_factor - point.root) / (side * point.slope);
            // The optima of the other unknowns at the inner end are the start of the next point.
            if point.root < coverage_factor {
                if distance >= limit {
                    *end = Some(bound);
                }
                if distance >= limit.min(FARTHEST) {
                    break;
                }
                (inner, from) = (distance, point.x);
            } else {
                outer = Some(distance);
            }
            let (low, high) = match outer {
                Some(outer) => {
                    let margin = BRACKET_MARGIN * (outer - inner);
                    (inner + margin, outer - margin)
                }
                None => (EXPANSION[0] * inner, EXPANSION[1] * inner),
            };
            distance =
                if newton.is_finite() { newton.clamp(low, high) } else { 0.5 * (low + high) };
        }
        search.report(&format!("profile of {}", search.unknowns[i]));
    }
    ProfileInterval { ends, better, points }
}

/// The profile of unknown `i` at the value `held` on its scale, by a fit of the others from the start `from`. Returns
/// all unknowns there, the signed root `sqrt(2 |rise|)/noise` of the rise of the misfit over the optimum, and its
/// derivative by the held value. `noise` is the standard deviation of the residuals. Error: the constrained fit fails.
fn rooted_profile(
    Fitted { search, optimum }: Fitted,
    i: usize,
    held: f64,
    from: &[f64],
    noise: f64,
) -> Result<RootedProfile, Error> {
    // By the envelope theorem the derivative of the profile is the partial one at the constrained optimum.
    let there = search.optimum_with_held(i, held, from)?;
    let slopes = misfit_slopes(&search.all_residuals()?, &there);
    let gradient: f64 = there.jacobian.iter().zip(&slopes).map(|(row, slope)| row[i] * slope).sum();
    let rise = 2.0 * (there.cost - optimum.cost);
    // The root of a parabola is linear in the distance, so that Newton's method converges in few steps.
    let root = rise.abs().sqrt().copysign(rise) / noise;
    // d(root^2)/dx = 2 gradient/noise^2.
    let slope = gradient / (root.abs().max(f64::MIN_POSITIVE) * noise * noise);
    Ok(RootedProfile { x: there.x, root, slope })
}

impl ProfileInterval {
    /// The lower and the upper end in the parameter's unit, clamped to the limits of the parameter; none where there is
    /// no end.
    pub fn values(&self, unknown: &Unknown) -> [Option<f64>; 2] {
        let [low, high] = unknown.parameter.limits();
        self.ends.map(|end| end.map(|x| unknown.from_scale(x).clamp(low, high)))
    }

    /// The profile for plots: values in the parameter's unit, ascending, with their rises. The level of the interval is
    /// the squared `coverage_factor`.
    pub fn profile(mut self, unknown: &Unknown, coverage_factor: f64) -> Profile {
        self.points.sort_by_cached_key(|point| total_order(point.x));
        Profile {
            name: unknown.parameter,
            label: unknown.to_string(),
            values: self.points.iter().map(|point| unknown.from_scale(point.x)).collect(),
            rise: self.points.iter().map(|point| point.rise).collect(),
            level: coverage_factor * coverage_factor,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::measurement::experiment::Experiment;
    use crate::fit::measurement::motion::Observation;
    use crate::fit::search::Search;
    use crate::fit::search::optimum::Optimum;
    use crate::fit::uncertainty::analysis::TOLERANCE;
    use crate::scene::Parameter;
    use crate::scene::Point;
    use crate::scene::{Material, Scene, Section, Shape, Time};

    /// A profile about a point beside the minimum finds a better one. About the minimum of a nearly linear model it
    /// ends at 1.96 standard errors.
    #[test]
    fn profile_ends_at_1_96_standard_errors_and_finds_better_points() {
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
        let mut search = Search::new(&experiments, &unknowns, None, TOLERANCE).unwrap();
        search.sigmas = vec![1e-3];
        let best = search.polish(&[1.01e8_f64.ln()]).unwrap();
        let norm = best.jacobian.iter().map(|row| row[0] * row[0]).sum::<f64>().sqrt();
        let sd = 1.0 / norm;
        let found = profile_interval(Fitted { search: &search, optimum: &best }, 0, sd, 1.0, 1.96);
        assert!(found.better.is_none());
        for (end, side) in found.ends.iter().zip([-1.0, 1.0]) {
            let expected = 1e8_f64.ln() + side * 1.96 * sd;
            assert!((end.unwrap() - expected).abs() < 0.05 * sd, "{found:?}");
        }
        let away = search.all_residuals().unwrap().residuals(&[best.x[0] + 4.0 * sd]).unwrap();
        let cost = crate::numerics::half_sum_of_squares(&away);
        let off = Optimum { x: vec![best.x[0] + 4.0 * sd], cost, ..best };
        assert!(
            profile_interval(Fitted { search: &search, optimum: &off }, 0, sd, 1.0, 1.96)
                .better
                .is_some()
        );
    }
}
