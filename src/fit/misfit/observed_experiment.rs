//! An experiment as the residuals need it: cut to its horizon, with every measured point as a sum of
//! nodes, so that a simulation records no more than is looked at.

use crate::dynamics::record::Recorded;
use crate::dynamics::{Snapshot, Trajectory};
use crate::error::Error;
use crate::fit::measurement::Measurement;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::measurement::frequencies::Frequency;
use crate::fit::measurement::gauge::{Moving, Reading, Sight};
use crate::fit::measurement::gauge::{OverScalars, Shown};
use crate::fit::measurement::loss::Loss;
use crate::fit::measurement::motion::Sample;
use crate::fit::misfit::camera::View;
use crate::fit::misfit::foot_point::Curve;
use crate::fit::unknown::Unknown;
use crate::problem::Problem;
use crate::scene::Parameter;
use crate::scene::Point;
use crate::scene::Scene;
use crate::scene::Stencil;
use crate::scene::marker::{Marker, is_beside};
use crate::vibration::ModeName;
use crate::vibration::NaturalFrequency;
use num_dual::Dual64;
use std::sync::Arc;

/// Motions last at most so many times as long as the scene and the recording say, whatever the camera's clock is off.
const FARTHEST: f64 = 2.0;

/// An experiment, cut to its horizon.
#[derive(Debug)]
pub(crate) struct ObservedExperiment {
    pub(super) problem: Problem,
    /// Places of the unknowns that it depends on.
    pub(super) unknowns: Vec<usize>,
    pub(super) series: Vec<Series>,
    /// Points that move, and points at rest, that are looked at.
    pub(super) moving: Vec<Point>,
    resting: Vec<Point>,
    /// Whether all of the rod at rest is looked at.
    rests_whole: bool,
    /// Points that move and have a marker beside them.
    pub(super) beside: Vec<Point>,
    /// The modes whose frequencies are looked at.
    modes: Vec<ModeName>,
    /// Time of the last sample on the camera's clock, and of the last reading of a gauge, s.
    end: f64,
    gauged: f64,
    rest_work: f64,
}

/// A measurement.
#[derive(Debug)]
pub(super) struct Series {
    pub values: Values,
    /// One over the standard deviation of every value.
    pub weights: Vec<f64>,
    pub loss: Loss,
}

/// What was measured.
#[derive(Debug)]
pub(super) enum Values {
    /// Of a point, or a marker beside it.
    Motion(Point, [f64; 3], Vec<Sample>),
    RestShape(Vec<(Point, [Option<f64>; 3])>),
    /// Of points of a rod at rest whose arc lengths are only about these, m.
    CenterLine(Vec<(f64, [Option<f64>; 3])>),
    /// Places among the modes, and rad/s.
    Frequencies(Vec<(usize, f64)>),
    Gauge {
        shows: Arc<dyn OverScalars>,
        points: Vec<Point>,
        readings: Vec<Reading>,
    },
}

/// What an experiment's problem does at one point.
pub(crate) struct Run {
    pub problem: Problem,
    pub moving: Option<Trajectory>,
    pub resting: Option<Trajectory>,
}

/// What an experiment is simulated to do, in numbers that may carry derivatives.
pub(crate) struct Simulated<'a, D> {
    pub moving: Option<Recorded<'a, D>>,
    pub resting: Option<Recorded<'a, D>>,
    pub frequencies: &'a [D],
    pub view: &'a View<D>,
    pub scene: &'a Scene<D>,
}

impl ObservedExperiment {
    /// `experiment` up to `horizon`, s, with one of `sigmas` for each of its measurements.
    pub fn new<'s>(
        experiment: &Experiment,
        unknowns: &[Unknown],
        sigmas: &mut impl Iterator<Item = &'s f64>,
        horizon: f64,
    ) -> Result<Self, Error> {
        let own = (0..unknowns.len()).filter(|i| unknowns[*i].is_of(experiment));
        let mut comparison = Self {
            problem: experiment.problem.clone(),
            unknowns: own.collect(),
            series: Vec::new(),
            moving: Vec::new(),
            resting: Vec::new(),
            rests_whole: false,
            beside: Vec::new(),
            modes: Vec::new(),
            end: 0.0,
            gauged: 0.0,
            rest_work: experiment.rest_work(),
        };
        for (measurement, sigma) in experiment.measurements.iter().zip(sigmas) {
            comparison.add(measurement, *sigma, horizon)?;
        }
        nodes(&comparison.moving, &comparison.problem)?;
        nodes(&comparison.resting, &comparison.problem)?;
        Ok(comparison)
    }

    fn add(&mut self, measurement: &Measurement, sigma: f64, horizon: f64) -> Result<(), Error> {
        let values = match measurement {
            Measurement::Motion(observation) => {
                self.moving.push(observation.point);
                if is_beside(observation.offset) {
                    self.beside.push(observation.point);
                }
                let samples: Vec<Sample> =
                    observation.samples.iter().copied().filter(|s| s.time <= horizon).collect();
                self.end = samples.last().map_or(self.end, |s| self.end.max(s.time));
                Values::Motion(observation.point, observation.offset, samples)
            }
            Measurement::RestShape(shape) if shape.arc_lengths_fitted => {
                self.rests_whole = true;
                Values::CenterLine(shape.approximate_arc_lengths(&self.problem))
            }
            Measurement::RestShape(shape) => {
                self.resting.extend(shape.sightings.iter().map(|s| s.point));
                Values::RestShape(shape.sightings.iter().map(|s| (s.point, s.position)).collect())
            }
            Measurement::Frequencies(frequencies) => {
                let first = self.modes.len();
                self.modes.extend(frequencies.names());
                let place = |(k, f): (usize, &Frequency)| (first + k, f.rad_s);
                Values::Frequencies(frequencies.values.iter().enumerate().map(place).collect())
            }
            Measurement::Gauge(gauge) => {
                let points = gauge.points.clone();
                let seen = |r: &&Reading| r.time.is_none_or(|t| t <= horizon);
                let readings: Vec<Reading> = gauge.readings.iter().filter(seen).copied().collect();
                if let Some(last) = readings.iter().filter_map(|r| r.time).reduce(f64::max) {
                    self.gauged = self.gauged.max(last);
                    self.moving.extend(&points);
                }
                if readings.iter().any(|r| r.time.is_none()) {
                    self.resting.extend(&points);
                }
                Values::Gauge { shows: gauge.shows(), points, readings }
            }
        };
        let weights = measurement.sigmas(sigma).into_iter().map(f64::recip).collect();
        self.series.push(Series { values, weights, loss: measurement.loss() });
        Ok(())
    }

    /// Number of residuals of each measurement.
    pub fn counts(&self) -> impl Iterator<Item = usize> {
        self.series.iter().map(Series::len)
    }

    /// The loss of every residual.
    pub fn losses(&self) -> impl Iterator<Item = Loss> {
        self.series.iter().flat_map(|s| std::iter::repeat_n(s.loss, s.len()))
    }

    /// The modes whose frequencies were measured.
    pub fn modes(&self) -> &[ModeName] {
        &self.modes
    }

    /// Whether unknown `i` is one of its own.
    pub fn has(&self, i: usize) -> bool {
        self.unknowns.contains(&i)
    }

    /// The parameters that more than the recording depends on.
    pub(super) fn of_the_motion(&self, unknowns: &[Unknown]) -> Vec<Parameter> {
        let own = self.unknowns.iter().map(|i| unknowns[*i].parameter);
        own.filter(|p| !p.is_of_the_camera()).collect()
    }

    /// Its problem at `x`, and how many steps its motion takes.
    pub(super) fn made(
        &self,
        (unknowns, x): (&[Unknown], &[f64]),
    ) -> Result<(Problem, usize), Error> {
        let own =
            self.unknowns.iter().map(|i| (unknowns[*i].parameter, unknowns[*i].from_scale(x[*i])));
        let mut problem = self.problem.varied(own)?;
        if self.moving.is_empty() {
            return Ok((problem, 0));
        }
        let time = problem.time()?;
        let end = (self.end - problem.scene().camera.time_offset).max(self.gauged);
        let longest = FARTHEST * time.end.max(self.end);
        if end > longest {
            // A search may try any clock: this one would take for ever.
            let words = "the time offset of the camera is longer than the motion";
            return Err(Error::Fit(format!("{words} ({end:.3e} s of at most {longest:.3e} s)")));
        }
        let steps = ((end / time.step_size() - 1e-9).ceil().max(1.0)) as usize;
        if end > time.end * (1.0 + 1e-9) {
            // Whole steps: a last one cut to the clock's offset would depend on it.
            let end = steps as f64 * time.step_size();
            problem = problem.lasting(end);
        }
        let steps = steps.min(problem.time()?.steps());
        Ok((problem, steps))
    }

    /// What its problem does at `x`, with derivatives by the parameters of the unknowns if
    /// `derived`. Motions last as long as their samples on the camera's clock. `count` is told the
    /// work, of runs that fail too; `after` sees the motion at the start and after every step.
    pub fn run(
        &self,
        (unknowns, x): (&[Unknown], &[f64]),
        derived: bool,
        count: impl Fn(f64),
        after: &mut dyn FnMut(&Problem, &dyn Snapshot),
    ) -> Result<Run, Error> {
        let (problem, steps) = self.made((unknowns, x))?;
        let wanted = if derived { self.of_the_motion(unknowns) } else { Vec::new() };

        let mut moving = None;
        if !self.moving.is_empty() {
            let mut trajectory =
                Trajectory::new(&problem, &nodes(&self.moving, &problem)?, &wanted)?
                    .keep_axes(&edges(&self.beside, &problem)?);
            let outcome = trajectory.run(&problem, steps, |simulation| after(&problem, simulation));
            let steps = trajectory.work().steps + usize::from(outcome.is_err());
            count((steps * problem.segments()) as f64);
            outcome?;
            moving = Some(trajectory);
        }
        count(self.rest_work);
        let resting = match (self.rests_whole, self.resting.is_empty()) {
            (false, true) => None,
            (false, false) => Some(nodes(&self.resting, &problem)?),
            (true, _) => Some((0..problem.nodes()).collect()),
        };
        let resting = resting.map(|nodes| Trajectory::at_rest(&problem, &nodes, &wanted));
        let resting = resting.transpose()?;
        Ok(Run { problem, moving, resting })
    }

    /// What it does to every plain residual and to their derivatives by all unknowns if
    /// `derived`.
    pub fn compare(
        &self,
        run: &Run,
        (unknowns, x): (&[Unknown], &[f64]),
        derived: bool,
    ) -> Result<(Vec<f64>, Vec<Vec<f64>>), Error> {
        let wanted = if derived { self.of_the_motion(unknowns) } else { Vec::new() };
        let natural_frequencies = match self.modes.is_empty() {
            true => Vec::new(),
            false => run.problem.natural_frequencies(&self.modes, &wanted)?,
        };
        let frequencies: Vec<f64> = natural_frequencies.iter().map(|t| t.frequency_rad_s).collect();
        let simulated = Simulated {
            moving: run.moving.as_ref().map(|motion| motion.record().read()),
            resting: run.resting.as_ref().map(|rest| rest.record().read()),
            frequencies: &frequencies,
            view: &View::new(&run.problem, |_, value| value),
            scene: run.problem.scene(),
        };
        let mut residuals = Vec::with_capacity(self.counts().sum());
        self.each_residual(&simulated, |r: f64, _| residuals.push(r))?;
        if !derived {
            return Ok((residuals, Vec::new()));
        }
        let mut rows = vec![vec![0.0; unknowns.len()]; residuals.len()];
        for i in &self.unknowns {
            let unknown = &unknowns[*i];
            let seed = |p, value| Dual64::new(value, f64::from(p == unknown.parameter));
            let track = wanted.iter().position(|p| *p == unknown.parameter);
            let slope = unknown.slope(unknown.from_scale(x[*i]));
            let rate = |t: &NaturalFrequency| track.map_or(0.0, |track| t.derivatives[track]);
            let frequencies: Vec<Dual64> = natural_frequencies
                .iter()
                .map(|t| Dual64::new(t.frequency_rad_s, rate(t)))
                .collect();
            let simulated = Simulated {
                moving: run.moving.as_ref().map(|motion| motion.record().along(track)),
                resting: run.resting.as_ref().map(|rest| rest.record().along(track)),
                frequencies: &frequencies,
                view: &View::new(&run.problem, seed),
                scene: &run.problem.scene().over_parameters(seed),
            };
            let mut row = rows.iter_mut();
            self.each_residual(&simulated, |r: Dual64, _| {
                if let Some(row) = row.next() {
                    row[*i] = r.eps * slope;
                }
            })?;
        }
        Ok((residuals, rows))
    }

    /// Calls `each` with every plain residual and its loss.
    pub fn each_residual<D: Shown>(
        &self,
        simulated: &Simulated<D>,
        mut each: impl FnMut(D, Loss),
    ) -> Result<(), Error> {
        let &Simulated { moving, resting, frequencies, view, scene } = simulated;
        let mesh = scene.made_mesh();
        for Series { values, weights, loss } in &self.series {
            let mut weights = weights.iter().copied();
            let mut compare = |position: [D; 3], seen: &[Option<f64>; 3]| {
                let recorded = view.recorded(position);
                for c in 0..3 {
                    let Some(seen) = seen[c] else { continue };
                    if let Some(weight) = weights.next() {
                        each((recorded[c] - D::from(seen)) * weight, *loss);
                    }
                }
            };
            match values {
                Values::Motion(point, offset, samples) => {
                    let Some(moving) = moving else { continue };
                    let marker = Marker::new(point.fixed(), *offset, &mesh)?;
                    for sample in samples {
                        let time = view.time(sample.time);
                        compare(moving.marker(&marker, time)?, &sample.position);
                    }
                }
                Values::RestShape(points) => {
                    let Some(resting) = resting else { continue };
                    for (point, position) in points {
                        let (stencil, start) = (point.fixed().stencil(&mesh)?, D::from(0.0));
                        compare(resting.position(&stencil, start)?, position);
                    }
                }
                Values::CenterLine(points) => {
                    let Some(resting) = resting else { continue };
                    let place = |i: usize| resting.position(&Stencil::node(i), D::from(0.0));
                    let nodes = (0..mesh.nodes.len()).map(|i| Ok(view.recorded(place(i)?)));
                    let nodes = nodes.collect::<Result<Vec<_>, Error>>()?;
                    let curve = Curve { nodes: &nodes, arc_length: &mesh.arc_length };
                    for (near, observed) in points {
                        let offset = curve.offset(observed, *near);
                        for c in (0..3).filter(|c| observed[*c].is_some()) {
                            if let Some(weight) = weights.next() {
                                each(offset[c] * weight, *loss);
                            }
                        }
                    }
                }
                Values::Gauge { shows, points, readings } => {
                    let mut seen = Vec::with_capacity(points.len());
                    let stencils = points.iter().map(|point| point.fixed().stencil(&mesh));
                    let stencils = stencils.collect::<Result<Vec<_>, _>>()?;
                    for (Reading { time, value }, weight) in readings.iter().zip(weights) {
                        let (record, time) = match time {
                            Some(time) => (moving, *time),
                            None => (resting, 0.0),
                        };
                        let Some(record) = record else { continue };
                        seen.clear();
                        for stencil in &stencils {
                            let [position, velocity] = record.motion(stencil, time)?;
                            seen.push(Moving { position, velocity });
                        }
                        let sight = Sight { time, points: &seen, scene };
                        each((D::shown(&**shows, &sight) - *value) * weight, *loss);
                    }
                }
                Values::Frequencies(values) => {
                    for ((place, seen), weight) in values.iter().zip(weights) {
                        each((frequencies[*place] - D::from(*seen)) * weight, *loss);
                    }
                }
            }
        }
        Ok(())
    }
}

/// Whether all steps of a motion were taken in halves.
pub(super) fn in_halves(motion: &Trajectory) -> bool {
    motion.record().taken.len() >= motion.times().len()
}

/// The nodes whose sums points are: others, where the rod has another length.
pub(super) fn nodes(points: &[Point], problem: &Problem) -> Result<Vec<usize>, Error> {
    let mut nodes = Vec::new();
    for point in points {
        // A point at a node slides to its neighbours when the rod gets longer.
        nodes.extend(problem.nodes_around(*point)?);
    }
    Ok(ascending(nodes))
}

/// The edges whose axes markers beside these points move with, likewise.
fn edges(points: &[Point], problem: &Problem) -> Result<Vec<usize>, Error> {
    let mut edges = Vec::new();
    for point in points {
        edges.extend(problem.edges_around(*point)?);
    }
    Ok(ascending(edges))
}

fn ascending(mut places: Vec<usize>) -> Vec<usize> {
    places.sort_unstable();
    places.dedup();
    places
}

impl Series {
    fn len(&self) -> usize {
        let seen = |position: &[Option<f64>; 3]| position.iter().flatten().count();
        match &self.values {
            Values::Motion(_, _, samples) => samples.iter().map(|s| seen(&s.position)).sum(),
            Values::RestShape(points) => points.iter().map(|(_, position)| seen(position)).sum(),
            Values::CenterLine(points) => points.iter().map(|(_, position)| seen(position)).sum(),
            Values::Frequencies(values) => values.len(),
            Values::Gauge { readings, .. } => readings.len(),
        }
    }
}
