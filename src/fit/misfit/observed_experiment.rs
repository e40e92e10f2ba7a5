//! An experiment as the residuals need it: cut to its horizon, with every measured point as a sum of
//! nodes, so that a simulation records no more than is looked at.

use crate::dynamics::{Snapshot, Trajectory};
use crate::error::Error;
use crate::fit::measurement::MeasuredData;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::measurement::loss::Loss;
use crate::fit::measurement::quantity::Shown;
use crate::fit::measurement::simulated::{Requirements, Simulated};
use crate::fit::misfit::camera::View;
use crate::fit::unknown::Unknown;
use crate::problem::Problem;
use crate::scene::Parameter;
use crate::scene::Point;
use crate::vibration::ModeName;
use crate::vibration::NaturalFrequency;
use num_dual::Dual64;

/// Motions last at most so many times as long as the scene and the recording say, whatever the camera's clock is off.
const FARTHEST: f64 = 2.0;

/// An experiment, cut to its horizon.
#[derive(Debug)]
pub(crate) struct ObservedExperiment {
    pub(super) problem: Problem,
    /// Places of the unknowns that it depends on.
    pub(super) unknowns: Vec<usize>,
    pub(super) series: Vec<Series>,
    /// Outputs of a run that the series are compared with.
    pub(super) required: Requirements,
    rest_work: f64,
}

/// A measurement.
#[derive(Debug)]
pub(super) struct Series {
    pub data: MeasuredData,
    /// One over the standard deviation of every value.
    pub weights: Vec<f64>,
    pub loss: Loss,
}

/// What an experiment's problem does at one point.
pub(crate) struct Run {
    pub problem: Problem,
    pub moving: Option<Trajectory>,
    pub resting: Option<Trajectory>,
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
            required: Requirements::default(),
            rest_work: experiment.rest_work(),
        };
        for (measurement, sigma) in experiment.measurements.iter().zip(sigmas) {
            let mut data = measurement.data.clone();
            data.prepare(&comparison.problem, horizon);
            data.require(&mut comparison.required);
            let weights = measurement.sigmas(*sigma).into_iter().map(f64::recip).collect();
            comparison.series.push(Series { data, weights, loss: measurement.loss() });
        }
        nodes(&comparison.required.moving, &comparison.problem)?;
        nodes(&comparison.required.resting, &comparison.problem)?;
        Ok(comparison)
    }

    /// Number of residuals of each measurement.
    pub fn counts(&self) -> impl Iterator<Item = usize> {
        self.series.iter().map(|s| s.data.values())
    }

    /// The loss of every residual.
    pub fn losses(&self) -> impl Iterator<Item = Loss> {
        self.series.iter().flat_map(|s| std::iter::repeat_n(s.loss, s.data.values()))
    }

    /// The modes whose frequencies were measured.
    pub fn modes(&self) -> &[ModeName] {
        &self.required.modes
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
        let mut problem = self.problem.with_fixed_layout(own)?;
        if self.required.moving.is_empty() {
            return Ok((problem, 0));
        }
        let time = problem.time()?;
        let end = (self.required.last_recorded - problem.scene().camera.time_offset)
            .max(self.required.last_read);
        let longest = FARTHEST * time.end.max(self.required.last_recorded);
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
    /// `derived`. Motions last as long as their samples on the camera's clock. `count` receives the
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
        if !self.required.moving.is_empty() {
            let mut trajectory =
                Trajectory::new(&problem, &nodes(&self.required.moving, &problem)?, &wanted)?
                    .keep_axes(&edges(&self.required.beside, &problem)?);
            let outcome = trajectory.run(&problem, steps, |simulation| after(&problem, simulation));
            let steps = trajectory.work().steps + usize::from(outcome.is_err());
            count((steps * problem.segments()) as f64);
            outcome?;
            moving = Some(trajectory);
        }
        count(self.rest_work);
        let resting = match self.required.whole_rest {
            true => Some((0..problem.nodes()).collect()),
            false if self.required.is_at_rest() => Some(nodes(&self.required.resting, &problem)?),
            false => None,
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
        let natural_frequencies = match self.modes().is_empty() {
            true => Vec::new(),
            false => run.problem.natural_frequencies(self.modes(), &wanted)?,
        };
        let frequencies: Vec<f64> = natural_frequencies.iter().map(|t| t.frequency_rad_s).collect();
        let simulated = Simulated {
            moving: run.moving.as_ref().map(|motion| motion.record().read()),
            resting: run.resting.as_ref().map(|rest| rest.record().read()),
            frequencies: &frequencies,
            view: &View::new(&run.problem, |_, value| value),
            scene: run.problem.scene(),
            mesh: &run.problem.scene().made_mesh(),
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
            let scene = run.problem.scene().over_parameters(seed);
            let simulated = Simulated {
                moving: run.moving.as_ref().map(|motion| motion.record().along(track)),
                resting: run.resting.as_ref().map(|rest| rest.record().along(track)),
                frequencies: &frequencies,
                view: &View::new(&run.problem, seed),
                scene: &scene,
                mesh: &scene.made_mesh(),
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
        let mut frequencies = simulated.frequencies;
        for Series { data, weights, loss } in &self.series {
            let (own, others) = frequencies.split_at(data.requirements().modes.len());
            frequencies = others;
            let simulated = Simulated { frequencies: own, ..*simulated };
            let mut weights = weights.iter().copied();
            data.differences(&simulated, &mut |difference| {
                if let Some(weight) = weights.next() {
                    each(difference * weight, *loss);
                }
            })?;
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
