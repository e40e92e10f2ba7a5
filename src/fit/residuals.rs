//! Residuals of a fit and their exact Jacobian, as any solver of argmin can use them.

use super::view::View;
use super::{Experiment, Loss, Measurement, Sample, Unknown};
use crate::error::Error;
use crate::parameter::Parameter;
use crate::point::Stencil;
use crate::problem::Problem;
use crate::scalar::Scalar;
use crate::trajectory::{Lifted, Snapshot, Trajectory};
use argmin::core::{CostFunction, Gradient, Jacobian, Operator};
use num_dual::Dual64;
use std::cell::{Cell, RefCell};
use std::rc::Rc;

/// Residuals as a function of the unknowns on their [scales](Unknown::to_scale), logarithms of
/// positive parameters: `(simulated - measured)/sigma` of all values, [bent](Loss::bent) where the
/// loss is robust, and `(value - mean)/sigma` of what is known of the unknowns.
///
/// Implements argmin's `Operator` (the residuals), `Jacobian`, `CostFunction` (half the sum of
/// squares), `Gradient` and `Hessian` (exact, in second-order dual numbers). A simulation that
/// fails is an error, never a made-up number.
#[derive(Debug)]
pub struct Residuals {
    unknowns: Vec<Unknown>,
    parts: Vec<Part>,
    full_work: f64,
    last: RefCell<Option<Evaluation>>,
    work: Rc<Cell<f64>>,
}

/// An experiment, cut to its horizon.
#[derive(Debug)]
struct Part {
    problem: Problem,
    /// Of the unknowns that it depends on.
    unknowns: Vec<usize>,
    series: Vec<Series>,
    /// Nodes that move, and nodes at rest, that are looked at.
    moving: Vec<usize>,
    resting: Vec<usize>,
    /// Numbers of the modes whose frequencies are looked at.
    modes: Vec<usize>,
    /// Time of the last sample, s.
    end: f64,
    rest_work: f64,
}

/// A measurement with its points as sums of nodes.
#[derive(Debug)]
struct Series {
    seen: Seen,
    weight: f64,
    loss: Loss,
}

#[derive(Debug)]
enum Seen {
    Motion(Stencil, Vec<Sample>),
    RestShape(Vec<(Stencil, [Option<f64>; 3])>),
    /// Places among the modes, and rad/s.
    Frequencies(Vec<(usize, f64)>),
}

/// What an experiment's problem does at one point.
pub(super) struct Run {
    pub problem: Problem,
    pub moving: Option<Trajectory>,
    pub resting: Option<Trajectory>,
}

/// The same with numbers that may carry derivatives, which the records have on some tracks.
pub(super) struct Seeing<'a, D, const P: usize> {
    pub moving: Option<&'a Trajectory>,
    pub resting: Option<&'a Trajectory>,
    pub frequencies: &'a [D],
    pub view: &'a View<D>,
    pub tracks: [Option<usize>; P],
}

/// Residuals, not bent, and their Jacobian if it was asked for, at one point.
#[derive(Clone, Debug)]
struct Evaluation {
    x: Vec<f64>,
    residuals: Vec<f64>,
    jacobian: Option<Vec<Vec<f64>>>,
}

impl Residuals {
    /// The residuals of `experiments` up to `horizons`, s, one per experiment. `sigmas` has one per
    /// measurement, in its unit. `full_work` is the work of one full simulation, steps times
    /// segments.
    pub(crate) fn new(
        experiments: &[Experiment],
        sigmas: &[f64],
        unknowns: &[Unknown],
        horizons: &[f64],
        full_work: f64,
    ) -> Result<Self, Error> {
        let mut sigmas = sigmas.iter();
        let mut parts = Vec::new();
        for (experiment, horizon) in experiments.iter().zip(horizons) {
            let own = (0..unknowns.len()).filter(|i| unknowns[*i].is_of(experiment));
            let mut part = Part {
                problem: experiment.problem.clone(),
                unknowns: own.collect(),
                series: Vec::new(),
                moving: Vec::new(),
                resting: Vec::new(),
                modes: Vec::new(),
                end: 0.0,
                rest_work: experiment.rest_work(),
            };
            for (measurement, sigma) in experiment.measurements.iter().zip(&mut sigmas) {
                part.add(measurement, sigma.recip(), *horizon)?;
            }
            for nodes in [&mut part.moving, &mut part.resting] {
                nodes.sort_unstable();
                nodes.dedup();
            }
            parts.push(part);
        }
        Ok(Self {
            unknowns: unknowns.to_vec(),
            parts,
            full_work,
            last: RefCell::new(None),
            work: Rc::default(),
        })
    }

    /// Counts its work, steps times segments, in a shared counter.
    pub(super) fn counting(self, work: Rc<Cell<f64>>) -> Self {
        Self { work, ..self }
    }

    /// The unknowns, in the order of the solver's vector.
    pub fn unknowns(&self) -> &[Unknown] {
        &self.unknowns
    }

    /// From the solver's vector to parameter values in SI units.
    pub fn values(&self, x: &[f64]) -> Vec<(Parameter, f64)> {
        let pairs = self.unknowns.iter().zip(x);
        pairs.map(|(unknown, x)| (unknown.parameter, unknown.from_scale(*x))).collect()
    }

    /// Work so far in full simulations: steps times segments over those of one full run. A run
    /// with derivatives counts once.
    pub fn simulations(&self) -> f64 {
        self.work.get() / self.full_work
    }

    /// Number of residuals.
    pub fn len(&self) -> usize {
        self.counts().iter().sum::<usize>() + self.priors()
    }

    /// Whether there are no residuals.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of residuals of each measurement; those of the priors come after them.
    pub(crate) fn counts(&self) -> Vec<usize> {
        self.parts.iter().flat_map(|p| &p.series).map(Series::len).collect()
    }

    fn priors(&self) -> usize {
        self.unknowns.iter().filter(|u| u.prior.is_some()).count()
    }

    /// The loss of every residual.
    pub(super) fn losses(&self) -> Vec<Loss> {
        let series = self.parts.iter().flat_map(|p| &p.series);
        let mut losses: Vec<Loss> =
            series.flat_map(|s| std::iter::repeat_n(s.loss, s.len())).collect();
        losses.resize(self.len(), Loss::Squares);
        losses
    }

    /// Residuals at `x`.
    pub fn residuals(&self, x: &[f64]) -> Result<Vec<f64>, Error> {
        self.evaluate(x, false, |e| self.bend(&e.residuals))
    }

    /// Rows of the Jacobian at `x`.
    pub fn jacobian_at(&self, x: &[f64]) -> Result<Vec<Vec<f64>>, Error> {
        let mut rows = self.straight_jacobian(x)?;
        for ((row, r), loss) in rows.iter_mut().zip(self.straight(x)?).zip(self.losses()) {
            if loss.is_robust() {
                let [_, slope] = loss.bent(r);
                row.iter_mut().for_each(|d| *d *= slope);
            }
        }
        Ok(rows)
    }

    /// Residuals at `x` as they are without a robust loss.
    pub(super) fn straight(&self, x: &[f64]) -> Result<Vec<f64>, Error> {
        self.evaluate(x, false, |e| e.residuals.clone())
    }

    /// Rows of the Jacobian at `x` as they are without a robust loss.
    pub(super) fn straight_jacobian(&self, x: &[f64]) -> Result<Vec<Vec<f64>>, Error> {
        self.evaluate(x, true, |e| e.jacobian.clone().unwrap_or_default())
    }

    fn bend(&self, residuals: &[f64]) -> Vec<f64> {
        residuals.iter().zip(self.losses()).map(|(r, loss)| loss.bent(*r)[0]).collect()
    }

    /// Evaluates unless the last evaluation was at the same point and has what is needed.
    fn evaluate<T>(
        &self,
        x: &[f64],
        with_jacobian: bool,
        read: impl FnOnce(&Evaluation) -> T,
    ) -> Result<T, Error> {
        let mut last = self.last.borrow_mut();
        let usable = |e: &Evaluation| e.x == x && (e.jacobian.is_some() || !with_jacobian);
        if !last.as_ref().is_some_and(usable) {
            *last = None;
            *last = Some(self.simulate(x, with_jacobian)?);
        }
        match &*last {
            Some(evaluation) => Ok(read(evaluation)),
            None => unreachable!("just set"),
        }
    }

    /// What every experiment does at `x`, with derivatives by the parameters of the unknowns if
    /// `derived`. Motions last as long as their samples on the camera's clock.
    pub(super) fn runs(&self, x: &[f64], derived: bool) -> Result<Vec<Run>, Error> {
        self.parts.iter().map(|part| self.run(part, x, derived)).collect()
    }

    /// What experiment `k` does at `x`; `after` sees its motion at the start and after every step.
    pub(super) fn run_seen(
        &self,
        k: usize,
        x: &[f64],
        after: &mut dyn FnMut(&Problem, &dyn Snapshot),
    ) -> Result<Run, Error> {
        self.run_part(&self.parts[k], x, false, after)
    }

    fn run(&self, part: &Part, x: &[f64], derived: bool) -> Result<Run, Error> {
        self.run_part(part, x, derived, &mut |_, _| {})
    }

    fn run_part(
        &self,
        part: &Part,
        x: &[f64],
        derived: bool,
        after: &mut dyn FnMut(&Problem, &dyn Snapshot),
    ) -> Result<Run, Error> {
        let own = part.unknowns.iter().map(|i| &self.unknowns[*i]);
        let values =
            own.clone().zip(&part.unknowns).map(|(u, i)| (u.parameter, u.from_scale(x[*i])));
        let mut problem = part.problem.with(values)?;
        let wanted = if derived { part.of_the_motion(&self.unknowns) } else { Vec::new() };
        let count = |work: f64| self.work.set(self.work.get() + work);
        let mut moving = None;
        if !part.moving.is_empty() {
            let time = problem.time()?;
            let end = part.end - problem.scene().camera.time_offset;
            let steps = ((end / time.step - 1e-9).ceil().max(1.0)) as usize;
            if end > time.end * (1.0 + 1e-9) {
                // Whole steps: a last one cut to the clock's offset would depend on it.
                let end = steps as f64 * time.step;
                problem = problem.lasting(end);
            }
            let steps = steps.min(problem.time()?.steps());
            let mut trajectory = Trajectory::new(&problem, &part.moving, &wanted)?;
            let outcome = trajectory.run(&problem, steps, |simulation| after(&problem, simulation));
            let steps = trajectory.work().steps + usize::from(outcome.is_err());
            count((steps * problem.segments()) as f64);
            outcome?;
            moving = Some(trajectory);
        }
        count(part.rest_work);
        let resting = match part.resting.is_empty() {
            true => None,
            false => Some(Trajectory::at_rest(&problem, &part.resting, &wanted)?),
        };
        Ok(Run { problem, moving, resting })
    }

    /// Calls `each` with every residual of experiment `k`, not bent.
    pub(super) fn each_residual<D: Lifted<P>, const P: usize>(
        &self,
        k: usize,
        seeing: &Seeing<D, P>,
        mut each: impl FnMut(D, Loss),
    ) -> Result<(), Error> {
        let &Seeing { moving, resting, frequencies, view, tracks } = seeing;
        for Series { seen, weight, loss } in &self.parts[k].series {
            let mut compare = |position: [D; 3], seen: &[Option<f64>; 3]| {
                let recorded = view.recorded(position);
                for c in 0..3 {
                    if let Some(seen) = seen[c] {
                        each((recorded[c] - D::from(seen)) * *weight, *loss);
                    }
                }
            };
            match seen {
                Seen::Motion(stencil, samples) => {
                    let Some(moving) = moving else { continue };
                    for sample in samples {
                        let time = view.time(sample.time);
                        compare(moving.sample_over(stencil, time, tracks)?, &sample.position);
                    }
                }
                Seen::RestShape(points) => {
                    let Some(resting) = resting else { continue };
                    for (stencil, position) in points {
                        let start = D::from(0.0);
                        compare(resting.sample_over(stencil, start, tracks)?, position);
                    }
                }
                Seen::Frequencies(values) => {
                    for (place, seen) in values {
                        each((frequencies[*place] - D::from(*seen)) * *weight, *loss);
                    }
                }
            }
        }
        Ok(())
    }

    /// The modes of experiment `k` whose frequencies were measured.
    pub(super) fn modes(&self, k: usize) -> &[usize] {
        &self.parts[k].modes
    }

    /// Whether unknown `i` is one of experiment `k`'s.
    pub(super) fn has(&self, k: usize, i: usize) -> bool {
        self.parts[k].unknowns.contains(&i)
    }

    fn simulate(&self, x: &[f64], with_jacobian: bool) -> Result<Evaluation, Error> {
        let n = self.unknowns.len();
        let mut residuals = Vec::with_capacity(self.len());
        let mut rows: Vec<Vec<f64>> = Vec::new();
        for (k, part) in self.parts.iter().enumerate() {
            let run = self.run(part, x, with_jacobian)?;
            let wanted =
                if with_jacobian { part.of_the_motion(&self.unknowns) } else { Vec::new() };
            let tones = match part.modes.is_empty() {
                true => Vec::new(),
                false => run.problem.tones(&part.modes, &wanted)?,
            };
            let plain = View::new(&run.problem, |_, value| value);
            let frequencies: Vec<f64> = tones.iter().map(|t| t.frequency_rad_s).collect();
            let seeing = Seeing {
                moving: run.moving.as_ref(),
                resting: run.resting.as_ref(),
                frequencies: &frequencies,
                view: &plain,
                tracks: [],
            };
            let first = residuals.len();
            self.each_residual(k, &seeing, |r: f64, _| residuals.push(r))?;
            if !with_jacobian {
                continue;
            }
            rows.resize_with(residuals.len(), || vec![0.0; n]);
            for i in &part.unknowns {
                let unknown = &self.unknowns[*i];
                let seed = |p, value| Dual64::new(value, f64::from(p == unknown.parameter));
                let track = wanted.iter().position(|p| *p == unknown.parameter);
                let slope = unknown.slope(unknown.from_scale(x[*i]));
                let rate = |t: &crate::Tone| track.map_or(0.0, |track| t.derivatives[track]);
                let frequencies: Vec<Dual64> =
                    tones.iter().map(|t| Dual64::new(t.frequency_rad_s, rate(t))).collect();
                let seeing = Seeing {
                    moving: run.moving.as_ref(),
                    resting: run.resting.as_ref(),
                    frequencies: &frequencies,
                    view: &View::new(&run.problem, seed),
                    tracks: [track],
                };
                let mut row = rows[first..].iter_mut();
                self.each_residual(k, &seeing, |r: Dual64, _| {
                    if let Some(row) = row.next() {
                        row[*i] = r.eps * slope;
                    }
                })?;
            }
        }
        for (i, unknown) in self.unknowns.iter().enumerate() {
            let Some(surprise) = unknown.surprise(Dual64::new(x[i], 1.0)) else { continue };
            residuals.push(surprise.value());
            if with_jacobian {
                let mut row = vec![0.0; n];
                row[i] = surprise.eps;
                rows.push(row);
            }
        }
        Ok(Evaluation { x: x.to_vec(), residuals, jacobian: with_jacobian.then_some(rows) })
    }
}

impl Part {
    fn add(&mut self, measurement: &Measurement, weight: f64, horizon: f64) -> Result<(), Error> {
        let nodes = |stencil: &Stencil| stencil.nodes.iter().map(|(i, _)| *i).collect::<Vec<_>>();
        let seen = match measurement {
            Measurement::Motion(observation) => {
                let stencil = self.problem.stencil(observation.point)?;
                self.moving.extend(nodes(&stencil));
                let samples: Vec<Sample> =
                    observation.samples.iter().copied().filter(|s| s.time <= horizon).collect();
                self.end = samples.last().map_or(self.end, |s| self.end.max(s.time));
                Seen::Motion(stencil, samples)
            }
            Measurement::RestShape(shape) => {
                let mut points = Vec::with_capacity(shape.sightings.len());
                for sighting in &shape.sightings {
                    let stencil = self.problem.stencil(sighting.point)?;
                    self.resting.extend(nodes(&stencil));
                    points.push((stencil, sighting.position));
                }
                Seen::RestShape(points)
            }
            Measurement::Frequencies(frequencies) => {
                let first = self.modes.len();
                self.modes.extend(frequencies.values.iter().map(|f| f.mode));
                let place = |(k, f): (usize, &super::Frequency)| (first + k, f.rad_s);
                Seen::Frequencies(frequencies.values.iter().enumerate().map(place).collect())
            }
        };
        self.series.push(Series { seen, weight, loss: measurement.loss() });
        Ok(())
    }

    /// The parameters that more than the recording depends on.
    fn of_the_motion(&self, unknowns: &[Unknown]) -> Vec<Parameter> {
        let own = self.unknowns.iter().map(|i| unknowns[*i].parameter);
        own.filter(|p| !p.is_of_the_camera()).collect()
    }
}

impl Series {
    fn len(&self) -> usize {
        let seen = |position: &[Option<f64>; 3]| position.iter().flatten().count();
        match &self.seen {
            Seen::Motion(_, samples) => samples.iter().map(|s| seen(&s.position)).sum(),
            Seen::RestShape(points) => points.iter().map(|(_, position)| seen(position)).sum(),
            Seen::Frequencies(values) => values.len(),
        }
    }
}

impl Operator for Residuals {
    type Param = Vec<f64>;
    type Output = Vec<f64>;
    fn apply(&self, x: &Vec<f64>) -> Result<Vec<f64>, argmin::core::Error> {
        Ok(self.residuals(x)?)
    }
}

impl Jacobian for Residuals {
    type Param = Vec<f64>;
    type Jacobian = Vec<Vec<f64>>;
    fn jacobian(&self, x: &Vec<f64>) -> Result<Vec<Vec<f64>>, argmin::core::Error> {
        Ok(self.jacobian_at(x)?)
    }
}

impl CostFunction for Residuals {
    type Param = Vec<f64>;
    type Output = f64;
    fn cost(&self, x: &Vec<f64>) -> Result<f64, argmin::core::Error> {
        Ok(half_square(&self.residuals(x)?))
    }
}

impl Gradient for Residuals {
    type Param = Vec<f64>;
    type Gradient = Vec<f64>;
    fn gradient(&self, x: &Vec<f64>) -> Result<Vec<f64>, argmin::core::Error> {
        let rows = self.jacobian_at(x)?;
        let residuals = self.residuals(x)?;
        let component = |j: usize| rows.iter().zip(&residuals).map(|(row, r)| row[j] * r).sum();
        Ok((0..self.unknowns.len()).map(component).collect())
    }
}

/// Half the sum of squares.
pub(crate) fn half_square(residuals: &[f64]) -> f64 {
    0.5 * residuals.iter().map(|r| r * r).sum::<f64>()
}
