//! Experiments: the prepared problem of one scene with its measurements. Several experiments may share parameters.
//!
//! [`Experiment`] has a name, the problem (`new`, or `of_structure`) and the measurements (`observe`). Its `records`
//! are the recorded motions, with readings of gauges and sensors over time as x coordinates; `duration` is their last
//! time, s. `moves` returns whether there are records, `rests` whether there is any other measurement. `highest_mode`
//! is the highest measured mode, at least 1 with a critical load, and 0 without both. `aim` is the simulation by whose
//! accuracy the mesh is chosen: the motion, else the modes, else the equilibrium.
//!
//! The work of a simulation is steps times segments of the motion, plus `rest_work`: [`STEPS_OF_REST`] times segments
//! for every equilibrium if anything is measured at rest. A measured motion in a scene without time is an error of the
//! work. Texts for messages have the name of the experiment in front. Over a list of experiments, [`all`] iterates over
//! measurements in the order of the residuals, [`full_work`] sums the work, and [`fitted`] removes validation data.
//! [`named`] adds experiments to the name of a parameter.

use crate::accuracy::Calculation;
use crate::error::Error;
use crate::fit::measurement::Measurement;
use crate::fit::measurement::motion::{PointMotion, Sample};
use crate::fit::structure::structure_problem::representative_problem;
use crate::problem::Problem;
use crate::scene::{Parameter, StructureScene};
use std::borrow::Cow;

/// Work of a static solution, in time steps: both take about as many Newton iterations in total.
const STEPS_OF_REST: f64 = 20.0;

/// Part of a critical load that the scene has while the mesh is chosen: the rod is stable, and the mesh suits the
/// lowest mode under the load.
const PART_OF_CRITICAL_LOAD: f64 = 0.5;

/// Smallest motion of a point whose rise time counts, over the largest motion of the experiment: a marker beside a
/// clamp moves by its noise alone.
const LEAST_MOTION: f64 = 0.05;

/// A scene with its measurements. Several experiments may share parameters.
#[derive(Clone, Debug)]
pub struct Experiment {
    /// Name of the experiment; empty where there is only one.
    pub name: String,
    /// The prepared scene.
    pub problem: Problem,
    /// Measurements of the rod.
    pub measurements: Vec<Measurement>,
    /// Loads of the scene that [`set_test_loads`](Self::set_test_loads) replaced, with their own values.
    pub(crate) own_loads: Vec<OwnLoad>,
}

/// A load of a scene with the value that the scene itself gives it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct OwnLoad {
    pub load: Parameter,
    /// In the unit of the load.
    pub value: f64,
}

impl Experiment {
    /// An experiment with a prepared scene, without measurements yet.
    pub fn new(name: impl Into<String>, problem: &Problem) -> Self {
        let (problem, measurements) = (problem.clone(), Vec::new());
        Self { name: name.into(), problem, measurements, own_loads: Vec::new() }
    }

    /// An experiment with a structure, without measurements yet. Its parameters are the numbers of the structure, such
    /// as `materials.steel.youngs_modulus`.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a structure that is not valid.
    pub fn of_structure(name: impl Into<String>, scene: StructureScene) -> Result<Self, Error> {
        Ok(Self::new(name, &representative_problem(scene)?))
    }

    /// The experiment with another measurement after those that it has.
    pub fn observe(mut self, measurement: impl Into<Measurement>) -> Self {
        self.measurements.push(measurement.into());
        if !self.own_loads.is_empty() {
            self.set_test_loads();
        }
        self
    }

    /// Replaces loads of the scene if all measurements are load-deflection curves and critical loads, so that the mesh
    /// is chosen for a loaded rod. The load of a curve becomes its largest value, and a critical load
    /// [`PART_OF_CRITICAL_LOAD`] of it. Their own values are kept: each curve and critical load is simulated with the
    /// other loads as the scene has them. With any other measurement all loads are those of the scene. A load that the
    /// scene cannot have is left to the check of the measurement.
    pub(crate) fn set_test_loads(&mut self) {
        // A problem is built again only where its loads were replaced before.
        let own = std::mem::take(&mut self.own_loads);
        let values = own.iter().map(|OwnLoad { load, value }| (*load, *value));
        if !own.is_empty()
            && let Ok(restored) = self.problem.with(values)
        {
            self.problem = restored;
        }
        let of = |m: &Measurement| match (m.load_curve(), m.buckling()) {
            (Some(curve), _) => Some((curve.load, curve.largest_load())),
            (_, Some(own)) => Some((own.load, PART_OF_CRITICAL_LOAD * own.value)),
            _ => None,
        };
        let loads: Option<Vec<_>> = self.measurements.iter().map(of).collect();
        for (load, value) in loads.unwrap_or_default() {
            let own = load.of(self.problem.scene());
            if let (Some(own), Ok(loaded)) = (own, self.problem.with([(load, value)])) {
                self.problem = loaded;
                // Of several measurements with one load the first has the value of the scene.
                if self.own_loads.iter().all(|other| other.load != load) {
                    self.own_loads.push(OwnLoad { load, value: own });
                }
            }
        }
    }

    /// The experiment with all measurements as validation data: predicted, not fitted.
    pub fn held_out(mut self) -> Self {
        self.measurements.iter_mut().for_each(|m| m.header.held_out = true);
        self
    }

    /// The recorded motions of points, in the order of the measurements.
    pub(crate) fn motions(&self) -> impl Iterator<Item = &PointMotion> {
        self.measurements.iter().filter_map(Measurement::motion)
    }

    /// The recorded motions, in the order of the measurements. Readings of a gauge or a sensor over time are included
    /// as the x coordinate of a motion, in their own unit. Measurements at rest and frequencies are not.
    pub(crate) fn records(&self) -> impl Iterator<Item = Cow<'_, PointMotion>> {
        self.measurements.iter().filter_map(record)
    }

    /// The shortest [rise time](PointMotion::rise_time) of the recorded motions, on the clock of the rod, and of the
    /// gauges and sensors over time, s. Left out are motions smaller than [`LEAST_MOTION`] of the largest one, whose
    /// rise is noise, and rise times of zero. None where nothing is left.
    pub(crate) fn rise_time(&self) -> Option<f64> {
        let largest = self.motions().map(PointMotion::largest_distance).fold(0.0, f64::max);
        let moves = |m: &&Measurement| {
            m.motion().is_none_or(|own| own.largest_distance() >= LEAST_MOTION * largest)
        };
        let time_scale = self.problem.scene().camera.time_scale;
        let rise = |own: &Measurement| {
            let scale = if own.motion().is_some() { time_scale } else { 1.0 };
            Some(record(own)?.rise_time() / scale)
        };
        let rises = self.measurements.iter().filter(moves).filter_map(rise);
        rises.filter(|rise| *rise > 0.0).reduce(f64::min)
    }

    /// Whether a motion, or a gauge or sensor over time, was measured, so that the motion of the rod is simulated.
    pub(crate) fn moves(&self) -> bool {
        self.records().next().is_some()
    }

    /// Whether any measurement is no [record](Self::records) over time, so that the equilibrium is solved: a shape or
    /// readings at rest, frequencies, a load-deflection curve or a critical load.
    pub(crate) fn rests(&self) -> bool {
        self.records().count() < self.measurements.len()
    }

    /// The highest number of a mode whose frequency was measured; at least 1 with a critical load, and 0 without both.
    pub(crate) fn highest_mode(&self) -> usize {
        let highest = self.measurements.iter().filter_map(|m| {
            let required = m.requirements();
            // A rod buckles in its lowest mode.
            let lowest = (!required.buckling_cases.is_empty()).then_some(1);
            required.modes.iter().map(|mode| mode.number).chain(lowest).max()
        });
        highest.max().unwrap_or(0)
    }

    /// The time of the latest sample of the recorded motions, and of gauges and sensors over time, s; zero without any.
    pub(crate) fn duration(&self) -> f64 {
        let last = |o: &PointMotion| o.samples.last().map_or(0.0, |s| s.time);
        self.records().map(|o| last(&o)).fold(0.0, f64::max)
    }

    /// Work of one full simulation of the experiment, in steps times segments: all steps of the scene's time if
    /// `moves`, plus [its equilibria](Self::rest_work). An error if a motion was measured and the scene has no time.
    pub(crate) fn full_work(&self) -> Result<f64, Error> {
        // An experiment may have a motion and measurements at rest, which are simulated separately.
        let steps = if self.moves() { self.problem.time()?.steps() as f64 } else { 0.0 };
        Ok(steps * self.problem.segments() as f64 + self.rest_work())
    }

    /// Work of the static solutions, [`STEPS_OF_REST`] times segments each: one per load of the load-deflection curves
    /// and one without the load for each curve. With any measurement at rest there is at least one; without these the
    /// work is zero.
    pub(crate) fn rest_work(&self) -> f64 {
        // Every load of a curve has an equilibrium of its own.
        let cases = self.measurements.iter().map(|m| m.requirements().load_cases.len());
        let equilibria = cases.sum::<usize>().max(usize::from(self.rests()));
        STEPS_OF_REST * (equilibria * self.problem.segments()) as f64
    }

    /// The simulation by whose accuracy the mesh is chosen: the motion if any is measured, else the modes up to the
    /// highest measured one, else the equilibrium.
    pub(crate) fn aim(&self) -> Calculation {
        match (self.moves(), self.highest_mode()) {
            (true, _) => Calculation::Motion,
            (false, 0) => Calculation::Rest,
            (false, modes) => Calculation::Modes(modes),
        }
    }

    /// The key `own` of the fit file for messages, after the name of the experiment and a period if it has a name:
    /// `bent.shape[0]`.
    pub(crate) fn key(&self, own: &str) -> String {
        match self.name.is_empty() {
            true => own.into(),
            false => format!("{}.{own}", self.name),
        }
    }

    /// The label of a measurement (file or name) for messages, after the name of the experiment and a colon if it has a
    /// name.
    pub(crate) fn label(&self, measurement: &Measurement) -> String {
        self.with_name(measurement.label())
    }

    /// A text after the name of the experiment, a colon and a space; the text alone if the name is empty.
    pub(crate) fn with_name(&self, text: String) -> String {
        if self.name.is_empty() { text } else { format!("{}: {text}", self.name) }
    }

    /// The label of the group that a measurement belongs to in statistics, after the name of the experiment: its own
    /// label, or `the markers` for a marker of the scene's own recording. All such markers are one group.
    pub(crate) fn group(&self, measurement: &Measurement) -> String {
        match measurement.marker() {
            None => self.label(measurement),
            Some(_) => self.with_name("the markers".into()),
        }
    }

    /// A copy of the experiment with only the measurements for which `keep` is true, in their order; perhaps none.
    pub(crate) fn only(&self, keep: impl Fn(&Measurement) -> bool) -> Self {
        let measurements = self.measurements.iter().filter(|m| keep(m)).cloned().collect();
        Self { measurements, ..self.clone() }
    }

    /// The experiment with another problem of the same rod, as on another [mesh](Problem::remeshed), and the same
    /// measurements.
    pub(crate) fn with_problem(&self, problem: Problem) -> Self {
        Self { problem, ..self.clone() }
    }
}

/// The text of a parameter's `name`, followed by the names of its `experiments` in parentheses unless that list is
/// empty (all).
pub(crate) fn named(name: &impl std::fmt::Display, experiments: &[String]) -> String {
    match experiments.is_empty() {
        true => name.to_string(),
        false => format!("{name} ({})", experiments.join(", ")),
    }
}

/// Copies of the experiments with only the measurements that are fitted, without validation data. Experiments may be
/// left without any.
pub(crate) fn fitted(experiments: &[Experiment]) -> Vec<Experiment> {
    experiments.iter().map(|e| e.only(|m| !m.held_out())).collect()
}

/// Work of one full simulation of all experiments, steps times segments. An error if a motion was measured and a scene
/// has no time.
pub(crate) fn full_work(experiments: &[Experiment]) -> Result<f64, Error> {
    experiments.iter().map(Experiment::full_work).sum()
}

/// A recorded motion, or the readings over time of a gauge or sensor as its x coordinate, in their own unit; none of
/// other measurements.
fn record(measurement: &Measurement) -> Option<Cow<'_, PointMotion>> {
    if let Some(motion) = measurement.motion() {
        return Some(Cow::Borrowed(motion));
    }
    // Readings at rest have no time and are no record.
    let values = measurement.times().into_iter().zip(measurement.scalars());
    let sample =
        |(t, x): (Option<f64>, f64)| Some(Sample { time: t?, position: [Some(x), None, None] });
    let samples: Vec<Sample> = values.filter_map(sample).collect();
    (!samples.is_empty()).then(|| Cow::Owned(PointMotion::new(samples)))
}

/// All measurements of all experiments, each with its experiment, in the order of the residuals: by experiment, then by
/// measurement.
pub(crate) fn all(
    experiments: &[Experiment],
) -> impl Iterator<Item = (&Experiment, &Measurement)> + Clone {
    experiments.iter().flat_map(|e| e.measurements.iter().map(move |m| (e, m)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::measurement::motion::Observation;
    use crate::scene::Scene;

    /// A marker that trembles by a thousandth of the tip's motion has a rise time of one frame, which is no time of the
    /// rod's motion. The cosine rises within half its period, 0.5 s.
    #[test]
    fn rise_time_of_an_experiment_is_that_of_its_moving_markers() {
        let problem = Scene::load("data/cantilever.toml").unwrap().problem().unwrap();
        let motion = |y: &dyn Fn(usize) -> f64| {
            let sample =
                |k: usize| Sample { time: 0.01 * k as f64, position: [None, Some(y(k)), None] };
            Observation::new((0..200).map(sample).collect())
        };
        let tip = motion(&|k| 0.1 * (std::f64::consts::TAU * 0.01 * k as f64).cos());
        let still = motion(&|k| 1e-4 * f64::from(u8::from(k % 2 == 1)));
        let alone = Experiment::new("", &problem).observe(tip);
        let rise = alone.rise_time().unwrap();
        assert!((0.3..0.51).contains(&rise), "{rise}");
        assert_eq!(alone.observe(still.clone()).rise_time(), Some(rise));
        assert_eq!(Experiment::new("", &problem).observe(still).rise_time(), Some(0.01));
    }
}
