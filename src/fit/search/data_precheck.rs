//! A look at data and scene before the search: where the recording starts, whether anything moves,
//! and whether it moves as gravity would have it. It takes no simulation.
//!
//! Where a rod at rest is released under its weight, the mean of a point's way down times the
//! square of its circular frequency is about the acceleration of gravity, whatever the rod is made
//! of: 1.55 of it at the tip of a cantilever, 1.30 in the middle between two walls. Wrong clocks and
//! wrong scales change that number.

use crate::code::Code;
use crate::error::Error;
use crate::fit::measurement::Measurement;
use crate::fit::measurement::constant_axes::ConstantAxis;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::measurement::loss::Loss;
use crate::fit::measurement::motion::{PointMotion, Sample};
use crate::fit::measurement::repeated_frames::RepeatedFrames;
use crate::fit::misfit::camera::View;
use crate::fit::misfit::residual_tests::{ResidualTests, significance_level};
use crate::fit::unknown::Unknown;
use crate::input::onset::onset_of_motion;
use crate::numerics::vector::{Vector, dot, scale, sub};
use crate::scene::Parameter;
use crate::scene::Point;
use crate::scene::{InitialState, Shape, Support};

/// Parts of the rod's length that a recording may start away from where the scene does: more is
/// suspicious, much more impossible.
const AWAY: [f64; 2] = [0.05, 0.25];
/// What the mean way down times the circular frequency squared over gravity may be.
const PACE: [f64; 2] = [0.3, 6.0];
/// Part of a free fall below which a fall that goes on is too slow.
const SLOWEST: f64 = 0.2;
/// Motion below this part of the length may be nothing but noise.
const HARDLY: f64 = 5e-3;

/// What looks wrong before anything is computed.
#[derive(Default)]
pub(crate) struct DataPrecheck {
    /// Why the search is not worth its time.
    pub fatal: Option<String>,
    /// What is likely wrong, should the fit leave much of the data.
    pub suspicions: Vec<(Code, String)>,
    /// Coordinates that are left out of the fit.
    pub constant_axes: Vec<ConstantAxis>,
    /// Observations of videos that were converted to a higher frame rate.
    pub repeated_frames: Vec<RepeatedFrames>,
}

impl DataPrecheck {
    /// The error with which a search ended, and what looked wrong before it.
    pub fn beside(&self, error: Error) -> Error {
        match self.suspicions.is_empty() {
            true => error,
            false => {
                let words: Vec<&str> =
                    self.suspicions.iter().map(|(_, words)| &words[..]).collect();
                Error::Fit(format!("{}; {error}", words.join("; ")))
            }
        }
    }
}

impl DataPrecheck {
    /// Looks at `fitted` experiments; an error is a recording that cannot be of this rod.
    pub fn at(fitted: &[Experiment], unknowns: &[Unknown]) -> Result<Self, Error> {
        let mut look = Self::default();
        for experiment in fitted {
            let of_it = |u: &&Unknown| u.is_of(experiment);
            let sought: Vec<Parameter> =
                unknowns.iter().filter(of_it).map(|u| u.parameter).collect();
            if experiment.never_moves() {
                look.fatal = Some(experiment.stillness());
            }
            if sought.iter().any(|p| p.is_of_the_camera() || *p == Parameter::ClampAngle) {
                // Where and when the recording starts is what is looked for.
                continue;
            }
            for measurement in &experiment.measurements {
                let label = experiment.label(measurement);
                let Some(release) = Release::new(experiment, measurement)? else { continue };
                let late = release.late_release(&label).map(|words| (Code::LateRelease, words));
                let is_late = late.is_some();
                look.suspicions.extend(late);
                let far =
                    release.check_start_position(&label)?.map(|words| (Code::FarStart, words));
                look.suspicions.extend(far);
                // A wrong start of the clock makes the pace meaningless.
                let pace = release.check_time_scale(&label).filter(|_| !is_late);
                look.suspicions.extend(pace.map(|words| (Code::ImplausibleTimeScale, words)));
            }
        }
        Ok(look)
    }
}

impl Experiment {
    /// Whether the scene says that the rod moves, and the recordings that it does not.
    fn never_moves(&self) -> bool {
        let scene = self.problem.scene();
        let released = scene.initial.state == InitialState::Rest;
        let driven = scene.loads.gravity != [0.0; 3]
            || !scene.loads.point.is_empty()
            || scene.supports.move_ends()
            || scene.loads.have_flow()
            || scene.initial.moves();
        let still = |m: &Measurement| {
            m.motion().is_some_and(|o| o.is_still(self.problem.length(), m.sigma()))
        };
        released && driven && !self.measurements.is_empty() && self.measurements.iter().all(still)
    }

    fn stillness(&self) -> String {
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
    /// Whether it shows nothing but noise.
    fn is_still(&self, length: f64, sigma: Option<f64>) -> bool {
        let spread = self.spread();
        if spread <= 1e-9 * length {
            return true;
        }
        if spread > HARDLY * length || sigma.is_some_and(|sigma| spread > 1.5 * sigma) {
            return false;
        }
        (0..3).all(|c| {
            let seen = self.samples.iter().filter_map(|s| Some((s.time, s.position[c]?)));
            let (times, x): (Vec<f64>, Vec<f64>) = seen.unzip();
            if x.is_empty() {
                return true;
            }
            let mean = x.iter().sum::<f64>() / x.len() as f64;
            let x: Vec<f64> = x.iter().map(|x| x - mean).collect();
            x.len() >= 30
                && ResidualTests::new(
                    (String::new(), ""),
                    (&times, &x),
                    Loss::Squares,
                    0.0,
                    significance_level(1),
                )
                .is_some_and(|tests| tests.is_noise())
        })
    }

    /// Noise of a coordinate, m, by the second differences of the samples.
    fn noise(&self) -> f64 {
        let off = self.samples.windows(3).flat_map(|w| {
            (0..3).filter_map(|c| {
                let [a, b, c] = [w[0].position[c]?, w[1].position[c]?, w[2].position[c]?];
                Some((a - 2.0 * b + c).abs() / 6.0_f64.sqrt())
            })
        });
        let mut off: Vec<f64> = off.collect();
        off.sort_by(f64::total_cmp);
        off.get(off.len() / 2).map_or(0.0, |median| 1.5 * median)
    }
}

fn norm(a: Vector<f64>) -> f64 {
    dot(a, a).sqrt()
}

/// A recording of a rod that starts at rest, and where the scene has its point.
struct Release<'a> {
    experiment: &'a Experiment,
    observation: &'a PointMotion,
    /// Start of the motion on the clock of its file, in its unit.
    time_zero: f64,
    view: View<f64>,
    /// Of the point at the start, in the recording, m.
    start: Vector<f64>,
    noise: f64,
}

impl<'a> Release<'a> {
    fn new(
        experiment: &'a Experiment,
        measurement: &'a Measurement,
    ) -> Result<Option<Self>, Error> {
        let Some(observation) = measurement.motion() else { return Ok(None) };
        let problem = &experiment.problem;
        if problem.scene().initial.state != InitialState::Rest || observation.samples.is_empty() {
            return Ok(None);
        }
        let view = View::new(problem, |_, value| value);
        let PointMotion { point, offset, .. } = observation;
        let start = view.recorded(problem.marker_at_rest(*point, *offset)?);
        let noise = measurement.sigma().unwrap_or_else(|| observation.noise());
        let recording = measurement.header.recording.as_ref();
        let time_zero = recording.and_then(|recording| recording.time_zero).unwrap_or(0.0);
        Ok(Some(Self { experiment, observation, time_zero, view, start, noise }))
    }

    /// From `place` to a sample, along the coordinates that were seen.
    fn from(&self, place: Vector<f64>, sample: &Sample) -> Vector<f64> {
        std::array::from_fn(|c| sample.position[c].map_or(0.0, |x| x - place[c]))
    }

    /// That the point rests at first, though the scene has released the rod: the recording began before the release.
    fn late_release(&self, label: &str) -> Option<String> {
        let samples = &self.observation.samples;
        if self.experiment.problem.scene().supports.move_ends() {
            return None;
        }
        let (times, places): (Vec<f64>, Vec<[Option<f64>; 3]>) =
            samples.iter().map(|s| (s.time, s.position)).unzip();
        let onset = onset_of_motion(&times, &places)?;
        let distance = |t: &f64| (t - onset).abs();
        let onset = times.into_iter().min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
        let rest = self.view.time(onset);
        (rest > 0.0).then(|| {
            format!(
                "{label}: the point rests until t = {onset:.4} s, and the scene releases the rod at t = 0 s. The recording \
                 began before the release. Raise time_zero by {rest:.4} s (to {:.4} if the clock of the file is in s)",
                self.time_zero + rest
            )
        })
    }

    /// What is wrong where the recording does not start where the rod does.
    fn check_start_position(&self, label: &str) -> Result<Option<String>, Error> {
        let samples = &self.observation.samples;
        let length = self.experiment.problem.length();
        let seen = |s: &&Sample| s.position.iter().any(Option::is_some);
        let speed = |w: &[Sample]| {
            let way = std::array::from_fn(|c| {
                w[1].position[c].zip(w[0].position[c]).map_or(0.0, |(a, b)| a - b)
            });
            norm(way) / (w[1].time - w[0].time)
        };
        let fastest = samples.windows(2).map(speed).fold(0.0, f64::max);
        // Farther than it can have come since the start; one of the first three may be an outlier.
        let excess = |s: &Sample| {
            norm(self.from(self.start, s)) - fastest * self.view.time(s.time) - 6.0 * self.noise
        };
        let first = samples.iter().filter(seen).take(3);
        let Some(nearest) = first.min_by(|a, b| excess(a).total_cmp(&excess(b))) else {
            return Ok(None);
        };
        if excess(nearest) <= AWAY[0] * length {
            return Ok(None);
        }
        let shown = |v: Vector<f64>| format!("({:.4}, {:.4}, {:.4}) m", v[0], v[1], v[2]);
        let place = std::array::from_fn(|c| nearest.position[c].unwrap_or(self.start[c]));
        let found = format!(
            "a recording that starts {:.3} m from the position of the point in the scene: at {} instead of {}",
            norm(self.from(self.start, nearest)),
            shown(place),
            shown(self.start)
        );
        let likely = self.likely(place);
        if excess(nearest) > AWAY[1] * length {
            let allowed = format!("a start within {} m of it; {likely}", AWAY[1] * length);
            return Err(Error::invalid(label, found, allowed));
        }
        Ok(Some(format!("{label}: {found}; {likely}")))
    }

    /// What would bring the point to `place`.
    fn likely(&self, place: Vector<f64>) -> String {
        let problem = &self.experiment.problem;
        let (wall, length) = (problem.wall(), problem.length());
        let near = |x: Vector<f64>| norm(sub(self.start, x)) <= AWAY[0] * length;
        let mirrored = [place[0], -place[1], place[2]];
        if near(mirrored) {
            return "most likely y points down (y = \"down\")".into();
        }
        let (arm, seen) = (sub(self.start, wall), sub(place, wall));
        let along = dot(arm, seen) / (norm(arm) * norm(seen)).max(f64::MIN_POSITIVE);
        let nodes = (0..problem.nodes()).filter_map(|i| problem.stencil(Point::Node(i)).ok());
        let distance = |(_, x): &(usize, Vector<f64>)| norm(sub(self.view.recorded(*x), place));
        let places = nodes.map(|stencil| problem.rest_position(&stencil)).enumerate();
        let closest = places.min_by(|a, b| distance(a).total_cmp(&distance(b)));
        let other = closest.filter(|node| distance(node) <= 0.5 * AWAY[0] * length);
        if let Some((node, _)) = other {
            return format!(
                "node {node} starts there: another point was followed, or the scale is off by a \
                 factor of {:.3}",
                norm(seen) / norm(arm)
            );
        }
        if along > 0.98 {
            return format!("the scale is off by a factor of {:.3}", norm(seen) / norm(arm));
        }
        let shift = sub(place, self.start);
        format!(
            "most likely the origin (({:.4}, {:.4}, {:.4}) m farther would do), the point or the scale \
             is wrong",
            shift[0], shift[1], shift[2]
        )
    }

    /// What is wrong where a straight rod under its weight moves up, or too fast or too slowly.
    fn check_time_scale(&self, label: &str) -> Option<String> {
        let problem = &self.experiment.problem;
        let scene = problem.scene();
        let Shape::Straight { direction, .. } = &scene.rod.shape else { return None };
        let (gravity, length) = (scene.loads.gravity, problem.length());
        let (g, place) = (norm(gravity), problem.arc_length(self.observation.point).ok()? / length);
        let down = scale(gravity, g.recip());
        let across = dot(*direction, down) / norm(*direction);
        let free = [scene.supports.start, scene.supports.end].map(|s| s == Support::Free);
        let swings = match free {
            [false, true] => place >= 0.5,
            [true, false] => place <= 0.5,
            [false, false] => (0.25..=0.75).contains(&place),
            [true, true] => false,
        };
        let other_drives = !scene.loads.point.is_empty()
            || scene.loads.drag.is_some()
            || scene.supports.move_ends()
            || scene.initial.moves();
        if g == 0.0 || !swings || other_drives || across.abs() > 0.9 {
            return None;
        }
        let unseen = |s: &Sample| (0..3).any(|c| s.position[c].is_none() && down[c].abs() > 1e-6);
        let whole: Vec<&Sample> = self.observation.samples.iter().filter(|s| !unseen(s)).collect();
        let first = whole.first()?;
        let origin = std::array::from_fn(|c| first.position[c].unwrap_or(0.0));
        let way: Vec<f64> = whole.iter().map(|s| dot(self.from(origin, s), down)).collect();
        let mean = way.iter().sum::<f64>() / way.len() as f64;
        let spread =
            (way.iter().map(|u| (u - mean).powi(2)).sum::<f64>() / way.len() as f64).sqrt();
        if spread < 4.0 * self.noise {
            return None;
        }
        if -mean > 0.5 * spread {
            return Some(format!(
                "{label}: the point moves up from its start, against gravity. The y axis or gravity has the wrong \
                 sign. Set y = \"down\" for image coordinates, or change loads.gravity"
            ));
        }
        // Where it passes its mean, once it was away from it on the other side.
        let (mut side, mut passes) = (0.0, Vec::new());
        for (s, u) in whole.iter().zip(&way) {
            let away = u - mean;
            if away.abs() > 0.3 * spread && away.signum() != side {
                if side != 0.0 {
                    passes.push(s.time);
                }
                side = away.signum();
            }
        }
        if passes.len() < 2 {
            // It has not turned yet: it falls nearly freely.
            let since = whole.last()?.time - first.time;
            let (end, before) = (*way.last()?, way[way.len() * 3 / 4]);
            let part = end / (0.5 * g * since * since);
            let falls_on = end > 0.0 && end - before > 0.2 * end;
            return (falls_on && part < SLOWEST).then(|| {
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
        let (from, to) = (passes.first()?, passes.last()?);
        let half = (to - from) / (passes.len() as f64 - 1.0);
        let between = (whole.last()?.time - first.time) / (whole.len() as f64 - 1.0);
        if passes.len() < 3 || half < 3.0 * between || mean <= 0.0 {
            return None;
        }
        let pace = mean * (std::f64::consts::PI / half).powi(2) / g;
        let (clock, size) = ((pace / 1.4).sqrt(), 1.4 / pace);
        (!(PACE[0]..=PACE[1]).contains(&pace)).then(|| {
            format!(
                "{label}: a point that falls {mean:.2e} m in the mean should swing {} with a period of {:.2e} s. \
                 The unit of time or length is wrong. Times {clock:.2} times as long (fps, the unit of t) or \
                 lengths {size:.2e} times as large (scale, the unit of x and y) would be consistent",
                if pace > 1.4 { "more slowly than" } else { "faster than" },
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

    /// Rods from limp to stiff, damped or not, as they are: nothing is suspicious.
    #[test]
    fn right_set_ups_are_not_suspected() {
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
                let look = DataPrecheck::at(&fitted, &[Parameter::YoungsModulus.into()]).unwrap();
                assert!(
                    look.fatal.is_none() && look.suspicions.is_empty(),
                    "E = 1e{exponent}, {damping} 1/s, {end} s, {point:?}: {:?}",
                    look.suspicions
                );
            }
        }
    }
}
