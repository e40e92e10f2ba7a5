//! Plausibility checks of data and scene before the search, without a simulation.
//!
//! Input: the fitted experiments and the unknowns. If the scene releases and drives a rod and none of its recordings
//! shows a motion, that is a fatal reason: the fit is not searched. For rods released at rest, up to three properties
//! of each recorded motion are checked. These are the distance of the first samples from the point's position in the
//! scene ([`START_DISTANCE`] of the length), rest after t = 0 (a late release), and the fall under gravity (upward, too
//! slow, or a swing whose time scale is outside of [`TIME_SCALE`]). Experiments of structures, and those with an
//! unknown of the camera or the clamp angle, have none of these three. Output: [`DataPrecheck`] with the fatal reason,
//! and with suspicions that name likely causes and corrections. The report has the suspicions if the fit does not
//! explain the data; `explain` adds them to the error of a search that failed. A start beyond the second
//! [`START_DISTANCE`] is an error, and so are a point that is not on the rod and a recording with a placeholder of lost
//! frames.
//!
//! Time scale: consider a straight rod at rest that is released under its weight alone. The mean displacement of a
//! point downward times the square of its circular frequency is about the acceleration of gravity `g`, whatever the
//! material of the rod. It is `1.55 g` at the tip of a cantilever, `1.30 g` in the middle between two walls. Wrong
//! clocks and wrong scales change that number.

use crate::code::Code;
use crate::error::Error;
use crate::fit::measurement::Measurement;
use crate::fit::measurement::constant_axes::ConstantAxis;
use crate::fit::measurement::dataset::Abscissa;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::measurement::loss::Loss;
use crate::fit::measurement::motion::{PointMotion, Sample};
use crate::fit::measurement::placeholder_frames::refuse_placeholder_frames;
use crate::fit::measurement::repeated_frames::RepeatedFrames;
use crate::fit::misfit::camera::View;
use crate::fit::misfit::residual_tests::{ResidualSeries, ResidualTests, significance_level};
use crate::fit::unknown::Unknown;
use crate::input::onset::onset_of_motion;
use crate::numerics::upper_median;
use crate::numerics::vector::{Vector, dot, norm, scale, sub};
use crate::scene::{InitialState, Parameter, Point, Shape, Support};

/// Distances of the first sample from the start in the scene, over the length of the rod: above the first one a
/// suspicion is reported, above the second one the recording is rejected.
const START_DISTANCE: [f64; 2] = [0.05, 0.25];
/// Largest distance from the first sample to a node that the recording may have followed instead, over the first start
/// distance. A larger one names a node that is not the tracked point.
const NODE_DISTANCE: f64 = 0.5;
/// Distance of a first sample, in standard deviations of the noise, that noise explains. A larger number accepts starts
/// that are farther away in noisy data.
const START_NOISE: f64 = 6.0;
/// Smallest spread of the displacement along gravity whose time scale is checked, in standard deviations of the noise.
/// A smaller one checks motions that noise dominates.
const SWING_NOISE: f64 = 4.0;
/// Smallest cosine of the angle between the directions from the wall to the start in the scene and the recorded start
/// at which a wrong scale is the likely cause. A smaller one attributes wrong origins to the scale.
const SAME_DIRECTION: f64 = 0.98;
/// Plausible range of the mean displacement along gravity times the square of the circular frequency, over gravity (no
/// unit). A wider range finds fewer wrong clocks and scales, a narrower one suspects correct ones.
const TIME_SCALE: [f64; 2] = [0.3, 6.0];
/// The typical value in [`TIME_SCALE`], by which the warning computes the likely factors.
const TYPICAL_TIME_SCALE: f64 = 1.4;
/// Largest cosine of the angle between the straight rod and gravity at which the time scale is checked: a rod along
/// gravity does not fall.
const LARGEST_SLOPE: f64 = 0.9;
/// Mean displacement against gravity, over the spread of the displacement, above which the point moves up. A smaller
/// ratio suspects noisy or sideways motions.
const UPWARD: f64 = 0.5;
/// Distance from the mean, over the spread of the displacement, after which a return counts as a pass of the mean. A
/// smaller one counts noise.
const SWING: f64 = 0.3;
/// Smallest fraction of the last quarter of the record in the whole displacement of a point that still falls. A smaller
/// fraction includes points that have come to rest.
const STILL_FALLING: f64 = 0.2;
/// Smallest plausible displacement of a point that still falls at the end of the recording, over that of a free fall in
/// the same time. A larger one suspects more recordings.
const SLOWEST_FALL: f64 = 0.2;
/// Largest spread (standard deviation) of positions that may be noise without motion, over the length of the rod.
/// Larger motions are fitted without the test.
const STILL: f64 = 5e-3;
/// Largest spread of positions that may be noise without motion, in given sigmas. Larger motions are fitted without the
/// test.
const STILL_SIGMAS: f64 = 1.5;
/// Smallest number of samples for the test of whether a small spread is white noise.
const ENOUGH: usize = 30;
/// Standard deviation of normal noise over the median of its absolute values: 1.4826, rounded.
const DEVIATION_OF_MEDIAN: f64 = 1.5;

/// Result of the checks before the search.
#[derive(Default)]
pub(crate) struct DataPrecheck {
    /// The reason why no search can succeed.
    pub fatal: Option<String>,
    /// Likely errors of the setup, with the codes of their warnings. They are reported if the fit does not explain the
    /// data.
    pub suspicions: Vec<Suspicion>,
    /// Constant coordinates, which are left out of the fit.
    pub constant_axes: Vec<ConstantAxis>,
    /// Observations of videos that were converted to a higher frame rate.
    pub repeated_frames: Vec<RepeatedFrames>,
}

/// A likely error of the setup, as the scale or the clock, with the code of its warning.
pub(crate) struct Suspicion {
    pub code: Code,
    /// Finding, consequence and action.
    pub text: String,
}

impl DataPrecheck {
    /// Checks the `fitted` experiments. The fatal reason is that of the last experiment without any motion. Experiments
    /// with an unknown of the camera or the clamp angle, which change the recorded start, have no other checks. In the
    /// others each released motion may add suspicions: a late release, a far start, and (without a late release) an
    /// implausible time scale. Constant coordinates and repeated frames are left empty, for the caller to set. An error
    /// for a placeholder of lost frames, a start too far from the point in the scene, or a point that is not on the
    /// rod.
    pub fn new(fitted: &[Experiment], unknowns: &[Unknown]) -> Result<Self, Error> {
        let mut precheck = Self::default();
        let mut add = |code: Code, text: Option<String>| {
            precheck.suspicions.extend(text.map(|text| Suspicion { code, text }));
        };
        for experiment in fitted {
            // A placeholder of lost frames looks like a motion, or like a start far away.
            for measurement in &experiment.measurements {
                refuse_placeholder_frames(measurement, &experiment.label(measurement))?;
            }
            // No search can succeed on data that show no motion.
            if experiment.has_no_motion() {
                precheck.fatal = Some(experiment.no_motion_message());
            }
            // Unknowns of the camera and the clamp angle change the recorded start.
            let changes_start = |u: &Unknown| {
                u.parameter.path().starts_with("camera.") || u.parameter == Parameter::ClampAngle
            };
            if unknowns.iter().any(|u| u.is_of(experiment) && changes_start(u)) {
                continue;
            }
            for measurement in &experiment.measurements {
                let label = experiment.label(measurement);
                let Some(release) = Release::new(experiment, measurement)? else { continue };
                let late = release.check_release_time(&label);
                let is_late = late.is_some();
                add(Code::LateRelease, late);
                add(Code::FarStart, release.check_start_position(&label)?);
                // A recording that starts late has no meaningful time scale.
                let time_scale = release.check_time_scale(&label).filter(|_| !is_late);
                add(Code::ImplausibleTimeScale, time_scale);
            }
        }
        Ok(precheck)
    }

    /// The `error` of a failed search; with suspicions an [`Error::Fit`] whose text has all of them before that of the
    /// error, separated by semicolons.
    pub fn explain(&self, error: Error) -> Error {
        if self.suspicions.is_empty() {
            return error;
        }
        let texts: Vec<&str> = self.suspicions.iter().map(|s| &s.text[..]).collect();
        Error::Fit(format!("{}; {error}", texts.join("; ")))
    }
}

impl Experiment {
    /// Whether the scene releases the rod from its rest shape (`initial.state`), something drives it, and all
    /// measurements (at least one) are recorded motions [without motion](PointMotion::is_still). Gravity, forces, flow,
    /// moving ends and an initial velocity drive it.
    fn has_no_motion(&self) -> bool {
        let scene = self.problem.scene();
        // A rod that the scene keeps at rest, or starts with a velocity, may be recorded without motion.
        let released = scene.initial.state == InitialState::Rest;
        let driven = scene.loads.gravity != [0.0; 3]
            || scene.loads.have_forces()
            || scene.supports.move_ends()
            || scene.loads.have_flow()
            || scene.initial.moves();
        let still = |m: &Measurement| {
            m.motion().is_some_and(|o| o.is_still(self.problem.length(), m.sigma()))
        };
        released && driven && !self.measurements.is_empty() && self.measurements.iter().all(still)
    }

    /// The text why recordings without motion cannot be fitted, with the label of the first measurement, the largest
    /// spread of the positions of all, m, and the rod's length, m.
    fn no_motion_message(&self) -> String {
        let spread = self.measurements.iter().map(|m| m.size(&self.problem)).fold(0.0, f64::max);
        let label = self.measurements.first().map(|m| self.label(m)).unwrap_or_default();
        format!(
            "{label}: nothing moves beyond the noise ({spread:.1e} m on a rod of {} m), though the scene releases \
             the rod. A fit to these data is meaningless. Check the tracked point, the columns, and that the \
             recording includes the release",
            self.problem.length()
        )
    }
}

impl PointMotion {
    /// Whether the positions are constant but for white noise. Spreads (standard deviations) up to 1e-9 of the rod's
    /// `length`, m, are. Those above [`STILL`] lengths, or [`STILL_SIGMAS`] times a given noise `sigma`, m, are not.
    /// Between, the deviations from the mean of every observed coordinate must be white noise without a trend, with at
    /// least [`ENOUGH`] samples.
    fn is_still(&self, length: f64, sigma: Option<f64>) -> bool {
        let spread = self.spread();
        // Exactly equal positions have no noise to test.
        if spread <= 1e-9 * length {
            return true;
        }
        // A large spread is a motion, whatever the tests find.
        if spread > STILL * length || sigma.is_some_and(|sigma| spread > STILL_SIGMAS * sigma) {
            return false;
        }
        // A small spread is noise if the deviations from the mean of each coordinate are white.
        (0..3).all(|c| {
            let observed = self.samples.iter().filter_map(|s| Some((s.time, s.position[c]?)));
            let (times, x): (Vec<f64>, Vec<f64>) = observed.unzip();
            if x.is_empty() {
                return true;
            }
            let mean = x.iter().sum::<f64>() / x.len() as f64;
            let residuals: Vec<f64> = x.iter().map(|x| x - mean).collect();
            let series = ResidualSeries {
                times: &times,
                abscissa: Abscissa::Time,
                residuals: &residuals,
                loss: Loss::Squares,
                correlation: 0.0,
            };
            let tests = ResidualTests::new(String::new(), "", series, significance_level(1));
            x.len() >= ENOUGH && tests.is_some_and(|tests| tests.is_noise())
        })
    }

    /// Standard deviation of the noise of a coordinate, m: the median over samples and coordinates of the absolute
    /// second differences `|a - 2 b + c|` over sqrt(6), times [`DEVIATION_OF_MEDIAN`]. Zero with fewer than three
    /// consecutive observed samples.
    fn noise(&self) -> f64 {
        let differences = self.samples.windows(3).flat_map(|w| {
            (0..3).filter_map(|c| {
                let [a, b, c] = [w[0].position[c]?, w[1].position[c]?, w[2].position[c]?];
                Some((a - 2.0 * b + c).abs() / 6.0_f64.sqrt())
            })
        });
        upper_median(differences).map_or(0.0, |median| DEVIATION_OF_MEDIAN * median)
    }
}

/// The recording of a point of a rod that starts at rest, with the point's position in the scene.
struct Release<'a> {
    experiment: &'a Experiment,
    observation: &'a PointMotion,
    /// Start of the motion on the clock of its file, in its unit.
    time_zero: f64,
    view: View<f64>,
    /// Recorded position of the point at rest by the scene, m.
    start: Vector<f64>,
    /// Standard deviation of the noise, m, given or estimated.
    noise: f64,
}

impl<'a> Release<'a> {
    /// The release in a `measurement`, with the position of the point at rest as the camera records it and the noise
    /// (given, or [estimated](PointMotion::noise)). `None` if it is no motion, the scene is a structure or does not
    /// start at rest, or there are no samples. An error for a point that is not on the rod.
    fn new(
        experiment: &'a Experiment,
        measurement: &'a Measurement,
    ) -> Result<Option<Self>, Error> {
        let Some(observation) = measurement.motion() else { return Ok(None) };
        let problem = &experiment.problem;
        // The rules of thumb hold for one rod.
        let is_structure = problem.scene().structure.is_some();
        if is_structure
            || problem.scene().initial.state != InitialState::Rest
            || observation.samples.is_empty()
        {
            return Ok(None);
        }
        let view = View::new(problem, |_, value| value);
        let PointMotion { point, offset, .. } = observation;
        let start = view.pictured(problem.marker_at_rest(*point, *offset)?);
        let noise = measurement.sigma().unwrap_or_else(|| observation.noise());
        let recording = measurement.header.recording.as_ref();
        let time_zero = recording.and_then(|recording| recording.time_zero).unwrap_or(0.0);
        Ok(Some(Self { experiment, observation, time_zero, view, start, noise }))
    }

    /// The displacement from `position`, m, to the position of a sample, m; zero along coordinates that were not
    /// observed.
    fn displacement(position: Vector<f64>, sample: &Sample) -> Vector<f64> {
        std::array::from_fn(|c| sample.position[c].map_or(0.0, |x| x - position[c]))
    }

    /// The warning text that the recording began before the release of the rod: the point rests until the onset of
    /// motion, after the scene's t = 0. The onset is the sample nearest to the change point of the recorded positions.
    /// `None` if it is not after zero, no change point is found, ends or obstacles move, or loads have signals. `label`
    /// names the measurement. The text has the correction of `time_zero`.
    fn check_release_time(&self, label: &str) -> Option<String> {
        let samples = &self.observation.samples;
        // Ends, obstacles and loads that follow time may leave the point at rest for a while.
        let scene = self.experiment.problem.scene();
        let is_driven = scene.supports.move_ends() || scene.has_moved_obstacles();
        if is_driven || !scene.signals.is_empty() {
            return None;
        }
        let times: Vec<f64> = samples.iter().map(|s| s.time).collect();
        let positions: Vec<[Option<f64>; 3]> = samples.iter().map(|s| s.position).collect();
        let onset = onset_of_motion(&times, &positions)?;
        // The sample nearest to the change point is the onset.
        let distance = |t: &f64| (t - onset).abs();
        let first =
            samples.iter().min_by(|a, b| distance(&a.time).total_cmp(&distance(&b.time)))?;
        let (onset, rest) = (first.time, self.view.sample_time(first.time, &first.position));
        (rest > 0.0).then(|| {
            format!(
                "{label}: the point rests until t = {onset:.4} s, and the scene releases the rod at t = 0 s. The recording \
                 began before the release. Raise time_zero by {rest:.4} s (to {:.4} if the clock of the file is in s)",
                self.time_zero + rest
            )
        })
    }

    /// The warning text that the recording starts away from the position of the point in the scene, with the likely
    /// cause. The excess distance of a sample is its distance from that position, less the largest speed times its time
    /// and [`START_NOISE`] standard deviations of the noise. The smallest excess of the first three observed samples
    /// counts. `None` up to the first [`START_DISTANCE`] of the length; an error above the second. `label` names the
    /// measurement.
    fn check_start_position(&self, label: &str) -> Result<Option<String>, Error> {
        let samples = &self.observation.samples;
        let length = self.experiment.problem.length();
        let is_observed = |s: &&Sample| s.position.iter().any(Option::is_some);
        let fastest = self.observation.largest_speed();
        // Distance beyond the largest possible way since the start. One of the first three samples may be an outlier.
        let excess = |s: &Sample| {
            let distance = norm(Self::displacement(self.start, s));
            distance
                - fastest * self.view.sample_time(s.time, &s.position)
                - START_NOISE * self.noise
        };
        let first = samples.iter().filter(is_observed).take(3);
        let Some(nearest) = first.min_by(|a, b| excess(a).total_cmp(&excess(b))) else {
            return Ok(None);
        };
        // Within a twentieth of the length the difference may be a measurement error of the
        // setup.
        if excess(nearest) <= START_DISTANCE[0] * length {
            return Ok(None);
        }
        let shown = |v: Vector<f64>| format!("({:.4}, {:.4}, {:.4}) m", v[0], v[1], v[2]);
        let position = std::array::from_fn(|c| nearest.position[c].unwrap_or(self.start[c]));
        let found = format!(
            "a recording that starts {:.3} m from the position of the point in the scene: at {} instead of {}",
            norm(Self::displacement(self.start, nearest)),
            shown(position),
            shown(self.start)
        );
        let cause = self.likely_cause(position);
        if excess(nearest) > START_DISTANCE[1] * length {
            let allowed = format!("a start within {} m of it; {cause}", START_DISTANCE[1] * length);
            return Err(Error::invalid(label, found, allowed));
        }
        Ok(Some(format!("{label}: {found}; {cause}")))
    }

    /// The likely cause, as text, of a recorded start at `position`, m: the first that fits. The mirrored position is
    /// near the expected one: y points down. Another node of the rod is within [`NODE_DISTANCE`] times the first
    /// [`START_DISTANCE`] of the length: another point. The direction from the wall is the same ([`SAME_DIRECTION`]):
    /// the scale, with its factor. Else the origin, with the shift, m.
    fn likely_cause(&self, position: Vector<f64>) -> String {
        let problem = &self.experiment.problem;
        let (wall, length) = (problem.wall(), problem.length());
        let is_start = |x: Vector<f64>| norm(sub(self.start, x)) <= START_DISTANCE[0] * length;
        // The causes in the order of their probability: y downward, another node, the scale, the
        // origin.
        let mirrored = [position[0], -position[1], position[2]];
        if is_start(mirrored) {
            return "most likely y points down (y = \"down\")".into();
        }
        // A wrong scale keeps the direction from the wall; its factor is the ratio of the distances.
        let (arm, recorded) = (sub(self.start, wall), sub(position, wall));
        let ratio = norm(recorded) / norm(arm);
        let cosine = dot(arm, recorded) / (norm(arm) * norm(recorded)).max(f64::MIN_POSITIVE);
        let nodes = (0..problem.nodes()).filter_map(|i| problem.stencil(Point::Node(i)).ok());
        let distance = |(_, x): &(usize, Vector<f64>)| norm(sub(self.view.pictured(*x), position));
        let positions = nodes.map(|stencil| problem.rest_position(&stencil)).enumerate();
        let closest = positions.min_by(|a, b| distance(a).total_cmp(&distance(b)));
        let nearest = NODE_DISTANCE * START_DISTANCE[0] * length;
        if let Some((node, _)) = closest.filter(|node| distance(node) <= nearest) {
            let text = format!("node {node} starts there, so that another point was tracked");
            // A point at the wall has no distance from it that a scale could change.
            return match ratio.is_finite() {
                true => format!("{text}, or the scale is wrong by a factor of {ratio:.3}"),
                false => text,
            };
        }
        if cosine > SAME_DIRECTION && ratio.is_finite() {
            return format!(
                "most likely the scale is wrong by a factor of {ratio:.3}, or another point was tracked"
            );
        }
        // Without a better explanation a constant shift explains any start.
        let shift = sub(position, self.start);
        format!(
            "most likely the origin is wrong (by ({:.4}, {:.4}, {:.4}) m), or the point, the scale, or the initial state \
             of the scene (initial.state)",
            shift[0], shift[1], shift[2]
        )
    }

    /// The warning text for a straight rod under its weight whose point moves up, falls too slowly, or swings too
    /// slowly or too fast; `None` if the motion is plausible or not checked. `label` names the measurement. The text
    /// has factors on time or length that would be consistent. With fewer than two passes of the mean position, a point
    /// that still falls is compared with a free fall ([`SLOWEST_FALL`]). With three or more passes, the mean
    /// displacement along gravity times `(pi/half period)^2/g` must be in [`TIME_SCALE`]; the half period is the mean
    /// time between passes, and must be at least three samples. Exactly two passes, and a spread below [`SWING_NOISE`]
    /// times the noise, are not checked. Checked are points in the half of a rod away from its only support, or in the
    /// middle half between two supports. Not checked are other shapes, free rods, no gravity, other loads, drag, driven
    /// ends, initial velocities, and rods nearly along gravity.
    fn check_time_scale(&self, label: &str) -> Option<String> {
        let problem = &self.experiment.problem;
        let scene = problem.scene();
        let Shape::Straight { direction, .. } = &scene.rod.shape else { return None };
        let (gravity, length) = (scene.loads.gravity, problem.length());
        let (g, place) = (norm(gravity), problem.arc_length(self.observation.point).ok()? / length);
        let down = scale(gravity, g.recip());
        let across = dot(*direction, down) / norm(*direction);
        // Only points that swing with about the first mode have the known time scale.
        let free = [scene.supports.start, scene.supports.end].map(|s| s == Support::Free);
        let swings = match free {
            [false, true] => place >= 0.5,
            [true, false] => place <= 0.5,
            [false, false] => (0.25..=0.75).contains(&place),
            [true, true] => false,
        };
        // Other forces than weight change the relation between way and period.
        let other_drives = scene.loads.have_forces()
            || scene.loads.drag.is_some()
            || scene.supports.move_ends()
            || !scene.contacts.is_empty()
            || scene.initial.moves();
        if g == 0.0 || !swings || other_drives || across.abs() > LARGEST_SLOPE {
            return None;
        }
        // The way down from the first sample, of samples with all coordinates along gravity.
        let is_whole =
            |s: &&Sample| (0..3).all(|c| s.position[c].is_some() || down[c].abs() <= 1e-6);
        let whole: Vec<&Sample> = self.observation.samples.iter().filter(is_whole).collect();
        let first = whole.first()?;
        let origin = std::array::from_fn(|c| first.position[c].unwrap_or(0.0));
        let way: Vec<f64> =
            whole.iter().map(|s| dot(Self::displacement(origin, s), down)).collect();
        let mean = way.iter().sum::<f64>() / way.len() as f64;
        let spread =
            (way.iter().map(|u| (u - mean).powi(2)).sum::<f64>() / way.len() as f64).sqrt();
        if spread < SWING_NOISE * self.noise {
            return None;
        }
        // A mean above the start by half the spread is a motion against gravity.
        if -mean > UPWARD * spread {
            return Some(format!(
                "{label}: the point moves up from its start, against gravity. The vertical axis of the recording or \
                 gravity has the wrong sign. Set y = \"down\" for coordinates that point down, y = \"up\" for those that \
                 point up, or change loads.gravity"
            ));
        }
        // Times at which the point passes its mean position, after a distance from it on the other side.
        let (mut side, mut passes) = (0.0, Vec::new());
        for (s, u) in whole.iter().zip(&way) {
            let away = u - mean;
            if away.abs() > SWING * spread && away.signum() != side {
                if side != 0.0 {
                    passes.push(s.time);
                }
                side = away.signum();
            }
        }
        if passes.len() < 2 {
            // Without a swing the point is compared with a free fall.
            let since = whole.last()?.time - first.time;
            let (end, before) = (*way.last()?, way[way.len() * 3 / 4]);
            let part = end / (0.5 * g * since * since);
            let still_falls = end > 0.0 && end - before > STILL_FALLING * end;
            return (still_falls && part < SLOWEST_FALL).then(|| {
                format!(
                    "{label}: the point has fallen {end:.2e} m after {since} s and still falls, {:.0} times \
                     slower than in free fall. The unit of time or length is wrong. Times {:.2} times as long \
                     (fps, the unit of t) or lengths {:.1} times as large (scale, the unit of x and y) would be \
                     consistent",
                    part.recip(),
                    part.sqrt(),
                    part.recip()
                )
            });
        }
        // Half the period is the mean time between passes of the mean position.
        let (from, to) = (passes.first()?, passes.last()?);
        let half = (to - from) / (passes.len() as f64 - 1.0);
        let between = (whole.last()?.time - first.time) / (whole.len() as f64 - 1.0);
        if passes.len() < 3 || half < 3.0 * between || mean <= 0.0 {
            return None;
        }
        // Mean way down times the squared circular frequency, over gravity: 1.3 to 1.55 for a
        // real rod.
        let found = mean * (std::f64::consts::PI / half).powi(2) / g;
        let (clock, size) = ((found / TYPICAL_TIME_SCALE).sqrt(), TYPICAL_TIME_SCALE / found);
        (!(TIME_SCALE[0]..=TIME_SCALE[1]).contains(&found)).then(|| {
            format!(
                "{label}: a point that falls {mean:.2e} m in the mean should swing {} with a period of {:.2e} s. \
                 The unit of time or length is wrong. Times {clock:.2} times as long (fps, the unit of t) or \
                 lengths {size:.2e} times as large (scale, the unit of x and y) would be consistent",
                if found > TYPICAL_TIME_SCALE { "more slowly than" } else { "faster than" },
                2.0 * half
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::measurement::motion::Observation;
    use crate::scene::{Material, Scene, Section, Time};

    /// Simulated recordings of rods from 1e3 to 1e9 Pa, with and without damping, at two points.
    #[test]
    fn precheck_of_correct_set_ups_has_no_suspicions() {
        for (exponent, damping, end) in
            [(3, 0.0, 1.0), (4, 0.0, 2.0), (5, 1.0, 2.0), (6, 0.0, 2.0), (6, 8.0, 2.0)]
                .into_iter()
                .chain([(7, 0.0, 1.0), (7, 3.0, 0.4), (8, 0.0, 1.0), (8, 0.5, 0.1), (9, 0.0, 0.3)])
        {
            let shape = Shape::Straight { length: 0.5, direction: [1.0, 0.0, 0.0] };
            let section = Section::Circle { radius: 0.005 };
            let material = Material::new(1273.52, 10_f64.powi(exponent));
            let mut scene = Scene::new(12, shape, section, material);
            scene.loads.gravity = [0.0, -9.8, 0.0];
            scene.loads.damping.mass = damping;
            scene.time = Some(Time::new(end, 2e-3));
            let problem = scene.problem().unwrap();
            let run = problem.simulate().unwrap();
            for point in [Point::Tip, Point::Node(7)] {
                let sample = |k: usize| {
                    let time = end * k as f64 / 100.0;
                    Sample { time, position: run.at(point, time).unwrap().0.map(Some) }
                };
                let data = Observation::new((0..100).map(sample).collect()).at(point);
                let fitted = [Experiment::new("", &problem).observe(data)];
                let unknowns = [Parameter::YoungsModulus.into()];
                let precheck = DataPrecheck::new(&fitted, &unknowns).unwrap();
                let texts: Vec<&String> = precheck.suspicions.iter().map(|s| &s.text).collect();
                assert!(
                    precheck.fatal.is_none() && texts.is_empty(),
                    "E = 1e{exponent}, {damping} 1/s, {end} s, {point:?}: {texts:?}"
                );
            }
        }
    }
}
