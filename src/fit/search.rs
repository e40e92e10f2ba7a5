//! A start for the optimiser when none is known, or when the one given may be far off.
//!
//! The misfit over Young's modulus has many minima: a wrong stiffness can match a long vibration
//! every few periods. Over the first period there is only one. So: scan a coarse model over the
//! first period, refine the best candidates there while the horizon doubles, and only then turn to
//! the full model, whose own horizon starts where the coarse model's bias is still harmless.

use super::journal::{Grid, Journal, Stage, Visit};
use super::levenberg_marquardt::{LeastSquaresState, LevenbergMarquardt};
use super::{Observation, Residuals, Unknown};
use crate::direct::splitting::stability_limit;
use crate::error::Error;
use crate::parameter::Parameter;
use crate::point::Point;
use crate::problem::Problem;
use crate::scene::{Clamp, Scheme, Support};
use argmin::core::observers::{Observe, ObserverMode};
use argmin::core::{Executor, KV, State, TerminationReason};
use std::cell::Cell;
use std::rc::Rc;

/// Edges of the coarse model of a straight rod.
const COARSE_SEGMENTS: usize = 12;
/// Largest turn per edge of the coarse model of a curved rod, rad: a coarser polygon is stiffer
/// than the curve by more than the search forgives.
const COARSE_TURN: f64 = 0.2;
/// Shear modulus over Young's modulus in the scan, when neither is known: Poisson's ratio 0.3.
const SHEAR_OF_YOUNGS: f64 = 1.0 / 2.6;
/// Steps of the coarse model per first period.
const COARSE_STEPS: f64 = 48.0;
/// Candidates of the scan that are refined.
const CANDIDATES: usize = 4;

/// How much a search does before it believes its start.
pub(super) struct Effort {
    /// Factor on the first period.
    stretch: f64,
    /// Factor on the number of candidates.
    grid: usize,
    /// How many first periods the coarse model is trusted for.
    trusted_periods: f64,
    /// Factor from one horizon of the full model to the next.
    growth: f64,
}

/// In order, until the motion is explained. The coarse model identifies the modulus of a
/// moderately bent rod to a few per cent, which is inside the basin of a record of 16 periods. A
/// rod so soft that it whips about needs the full model from the first period on.
pub(super) const EFFORTS: [Effort; 4] = [
    Effort { stretch: 1.0, grid: 1, trusted_periods: 16.0, growth: 4.0 },
    Effort { stretch: 1.0, grid: 1, trusted_periods: 1.0, growth: 1.5 },
    Effort { stretch: 0.5, grid: 2, trusted_periods: 1.0, growth: 1.5 },
    Effort { stretch: 2.0, grid: 2, trusted_periods: 1.0, growth: 1.5 },
];

/// Told what the search does: stage, and how many simulations' worth of work is done.
pub type Progress = Rc<dyn Fn(&str, f64)>;

/// What every stage needs.
pub(super) struct Search<'a> {
    pub problem: &'a Problem,
    pub observations: &'a [Observation],
    pub sigmas: Vec<f64>,
    pub unknowns: &'a [Unknown],
    /// Work of one full simulation, steps times segments.
    pub full_work: f64,
    /// Work so far, steps times segments.
    pub work: Rc<Cell<f64>>,
    pub progress: Option<Progress>,
    /// What it comes across.
    pub journal: Rc<Journal>,
}

/// What threads share of a search.
#[derive(Clone, Copy)]
pub(super) struct Task<'a> {
    pub problem: &'a Problem,
    pub observations: &'a [Observation],
    pub sigmas: &'a [f64],
    pub unknowns: &'a [Unknown],
    pub full_work: f64,
}

impl<'a> Task<'a> {
    /// A silent search that counts its own work.
    pub fn search(self) -> Search<'a> {
        Search {
            problem: self.problem,
            observations: self.observations,
            sigmas: self.sigmas.to_vec(),
            unknowns: self.unknowns,
            full_work: self.full_work,
            work: Rc::default(),
            progress: None,
            journal: Rc::default(),
        }
    }
}

/// Where an optimisation ended.
#[derive(Clone, Debug)]
pub(super) struct Optimum {
    pub x: Vec<f64>,
    pub cost: f64,
    pub residuals: Vec<f64>,
    pub jacobian: Vec<Vec<f64>>,
    pub counts: Vec<usize>,
    pub converged: bool,
    pub status: String,
}

impl Search<'_> {
    /// What other searches of the same problem need.
    pub fn task(&self) -> Task<'_> {
        Task {
            problem: self.problem,
            observations: self.observations,
            sigmas: &self.sigmas,
            unknowns: self.unknowns,
            full_work: self.full_work,
        }
    }

    /// Counts the work of another search.
    pub fn count(&self, work: f64) {
        self.work.set(self.work.get() + work);
    }

    /// End of the record, s.
    pub fn duration(&self) -> f64 {
        let last = |o: &Observation| o.samples.last().map_or(0.0, |s| s.time);
        self.observations.iter().map(last).fold(0.0, f64::max)
    }

    /// About the first period, s, with enough samples to tell the unknowns.
    fn first_period(&self, stretch: f64) -> f64 {
        let rise = self.observations.iter().map(Observation::rise_time).fold(f64::MAX, f64::min);
        let enough = 8 + 4 * self.unknowns.len();
        let wait = |o: &Observation| o.samples.get(enough).map_or(f64::MAX, |s| s.time);
        let sampled = self.observations.iter().map(wait).fold(f64::MAX, f64::min);
        (2.0 * rise * stretch).max(sampled).min(self.duration())
    }

    /// Tells the progress.
    pub fn report(&self, stage: &str) {
        if let Some(progress) = &self.progress {
            progress(stage, self.work.get() / self.full_work);
        }
    }

    /// Notes a point.
    fn note(
        &self,
        (stage, horizon): (Stage, f64),
        (x, cost): (Vec<f64>, f64),
        (residuals, counts): (Vec<f64>, Vec<usize>),
    ) {
        let visit = Visit { stage, horizon, x, cost, residuals, counts };
        self.journal.visit(visit, self.work.get() / self.full_work);
    }

    /// Starts for the full model, most promising first.
    pub fn starts(&self, effort: &Effort) -> Result<Vec<Vec<f64>>, Error> {
        let grid = effort.grid;
        let first = self.first_period(effort.stretch);
        let coarse = Coarse::new(self, first)?;
        let mut scanned = self.scan(&coarse, first, grid)?;
        scanned.sort_by(|a, b| a.1.total_cmp(&b.1));
        let mut candidates: Vec<(Vec<f64>, f64)> = Vec::new();
        for (x, cost) in scanned {
            let far = |y: &[f64]| x.iter().zip(y).any(|(a, b)| (a - b).abs() > 0.9);
            if candidates.iter().all(|(y, _)| far(y)) && candidates.len() < CANDIDATES * grid {
                candidates.push((x, cost));
            }
        }
        let mut horizon = first;
        loop {
            for (x, cost) in &mut candidates {
                let residuals = coarse.residuals(self, horizon)?;
                match self.optimize(residuals, x, (1e-4, 1e-2, 12), None) {
                    Ok(optimum) => {
                        (*x, *cost) = (optimum.x, optimum.cost);
                        let corrected = coarse.correct(self, x.clone());
                        let left = (optimum.residuals, optimum.counts);
                        self.note((Stage::Coarse, horizon), (corrected, *cost), left);
                    }
                    Err(Error::Interrupted) => return Err(Error::Interrupted),
                    // A candidate whose refinement fails stays where it is.
                    Err(_) => {}
                }
            }
            candidates.sort_by(|a, b| a.1.total_cmp(&b.1));
            let best = candidates[0].1;
            candidates.retain(|(_, cost)| *cost <= 4.0 * best);
            candidates.dedup_by(|a, b| a.0.iter().zip(&b.0).all(|(a, b)| (a - b).abs() < 1e-2));
            self.report("coarse model");
            if horizon >= self.duration().min(effort.trusted_periods * first) {
                break;
            }
            horizon = (2.0 * horizon).min(self.duration());
        }
        Ok(candidates.into_iter().take(2).map(|(x, _)| coarse.correct(self, x)).collect())
    }

    /// Misfit of every combination of candidate values over the first period.
    fn scan(
        &self,
        coarse: &Coarse,
        first: f64,
        grid: usize,
    ) -> Result<Vec<(Vec<f64>, f64)>, Error> {
        let mut points = vec![Vec::new()];
        let mut axes = Vec::new();
        for unknown in self.unknowns {
            let mut values = unknown.candidates(
                self.problem,
                self.duration(),
                0.5 * first,
                self.unknowns.iter().any(|u| u.parameter == Parameter::YoungsModulus),
            );
            if grid > 1 {
                let middles: Vec<f64> =
                    values.windows(2).map(|v| (v[0] * v[1]).abs().sqrt()).collect();
                values.extend(middles);
                values.sort_by(f64::total_cmp);
            }
            axes.push(values.iter().map(|v| unknown.to_scale(*v)).collect());
            points = points
                .iter()
                .flat_map(|point| {
                    values.iter().map(|v| {
                        let mut point: Vec<f64> = point.clone();
                        point.push(unknown.to_scale(*v));
                        point
                    })
                })
                .collect();
        }
        let place = |p| self.unknowns.iter().position(|u| u.parameter == p);
        if let (Some(e), Some(g)) =
            (place(Parameter::YoungsModulus), place(Parameter::ShearModulus))
            && self.unknowns[g].start.is_none()
        {
            let [low, high] = self.unknowns[g].scaled_bounds();
            for point in &mut points {
                point[g] = (point[e] + SHEAR_OF_YOUNGS.ln()).clamp(low, high);
            }
        }
        let residuals = coarse.residuals(self, first)?;
        let mut grid = Grid { axes, points: Vec::new() };
        let mut least = f64::INFINITY;
        let mut failure = None;
        for (i, x) in points.into_iter().enumerate() {
            let mut cost = f64::INFINITY;
            match residuals.residuals(&x) {
                Ok(left) => {
                    cost = super::residuals::half_square(&left);
                    if cost < least {
                        least = cost;
                        let corrected = coarse.correct(self, x.clone());
                        let left = (left, residuals.counts());
                        self.note((Stage::Scan, first), (corrected, cost), left);
                    }
                }
                Err(Error::Interrupted) => return Err(Error::Interrupted),
                Err(error) => failure = Some(error),
            }
            grid.points.push((x, cost));
            if i % 16 == 0 {
                self.report("scan");
            }
        }
        let scanned: Vec<_> =
            grid.points.iter().filter(|(_, cost)| *cost < f64::INFINITY).cloned().collect();
        self.journal.scan(grid);
        match failure {
            Some(error) if scanned.is_empty() => Err(Error::Fit(format!(
                "no start found: every trial simulation failed, the last one with: {error}"
            ))),
            _ => Ok(scanned),
        }
    }

    /// Fits the full model from `start`, over growing horizons where the record is long.
    pub fn refine(&self, start: &[f64], effort: &Effort) -> Result<Optimum, Error> {
        let duration = self.duration();
        let mut horizon = effort.trusted_periods * self.first_period(effort.stretch);
        let mut x = start.to_vec();
        while horizon < duration / (0.5 + 0.5 * effort.growth) {
            let part = Some((Stage::Growing, horizon));
            x = self.optimize(self.residuals(horizon)?, &x, (1e-5, 1e-2, 20), part)?.x;
            self.report("growing horizon");
            horizon *= effort.growth;
        }
        let optimum = self.polish(&x)?;
        self.journal.reach(&optimum);
        Ok(optimum)
    }

    /// Fits the full model to the whole record.
    pub fn polish(&self, start: &[f64]) -> Result<Optimum, Error> {
        let whole = Some((Stage::Full, self.duration()));
        self.optimize(self.residuals(self.duration())?, start, (1e-10, 1e-3, 60), whole)
    }

    /// The residuals of the full model up to `horizon`, s.
    pub fn residuals(&self, horizon: f64) -> Result<Residuals, Error> {
        let residuals = Residuals::new(
            self.problem,
            self.observations,
            &self.sigmas,
            self.unknowns,
            horizon,
            self.full_work,
        )?;
        Ok(residuals.counting(self.work.clone()))
    }

    /// Fits `residuals` with these tolerances of step and noise and this many iterations, and notes
    /// each as of this stage and horizon.
    fn optimize(
        &self,
        residuals: Residuals,
        start: &[f64],
        (step_tolerance, noise_tolerance, iterations): (f64, f64, u64),
        part: Option<(Stage, f64)>,
    ) -> Result<Optimum, Error> {
        let counts = residuals.counts();
        let bounds = self.unknowns.iter().map(Unknown::scaled_bounds).collect();
        let solver = LevenbergMarquardt::new(bounds)
            .step_tolerance(step_tolerance)
            .noise_tolerance(noise_tolerance);
        let observer = Observer {
            progress: self.progress.clone(),
            work: self.work.clone(),
            full_work: self.full_work,
            journal: self.journal.clone(),
            part,
            counts: counts.clone(),
        };
        let executor = Executor::new(residuals, solver)
            .configure(|state| state.param(start.to_vec()).max_iters(iterations))
            .add_observer(observer, ObserverMode::Always);
        let mut result = executor.run().map_err(|error| match error.downcast::<Error>() {
            Ok(error) => error,
            Err(error) => Error::Fit(error.to_string()),
        })?;
        let lost = || Error::Fit("the optimiser lost its state".into());
        let state: &mut LeastSquaresState = &mut result.state;
        let reason = state.get_termination_reason().cloned();
        let cost = state.get_cost();
        Ok(Optimum {
            x: state.take_param().or_else(|| state.take_best_param()).ok_or_else(lost)?,
            cost,
            residuals: state.take_residuals().ok_or_else(lost)?,
            jacobian: state.take_jacobian().ok_or_else(lost)?,
            counts,
            converged: reason == Some(TerminationReason::SolverConverged),
            status: reason.map_or("not terminated".into(), |reason| reason.text().to_string()),
        })
    }
}

/// Passes the optimiser's iterations on.
struct Observer {
    progress: Option<Progress>,
    work: Rc<Cell<f64>>,
    full_work: f64,
    journal: Rc<Journal>,
    part: Option<(Stage, f64)>,
    counts: Vec<usize>,
}

impl Observer {
    fn see(&self, state: &LeastSquaresState) {
        let simulations = self.work.get() / self.full_work;
        if let (Some((stage, horizon)), Some(x), Some(residuals)) =
            (self.part, state.get_param(), state.get_residuals())
        {
            let visit = Visit {
                stage,
                horizon,
                x: x.clone(),
                cost: state.get_cost(),
                residuals: residuals.clone(),
                counts: self.counts.clone(),
            };
            self.journal.visit(visit, simulations);
        }
    }
}

impl Observe<LeastSquaresState> for Observer {
    fn observe_init(
        &mut self,
        _: &str,
        state: &LeastSquaresState,
        _: &KV,
    ) -> Result<(), argmin::core::Error> {
        self.see(state);
        Ok(())
    }

    fn observe_iter(
        &mut self,
        state: &LeastSquaresState,
        _: &KV,
    ) -> Result<(), argmin::core::Error> {
        self.see(state);
        if let Some(progress) = &self.progress {
            let (iteration, misfit) = (state.get_iter() + 1, state.get_cost());
            let stage = format!("iteration {iteration}, misfit {misfit:.6e}");
            progress(&stage, self.work.get() / self.full_work);
        }
        Ok(())
    }
}

/// The scene on a coarse mesh with large steps.
struct Coarse {
    problem: Problem,
    observations: Vec<Observation>,
}

impl Coarse {
    fn new(search: &Search, first: f64) -> Result<Self, Error> {
        let mut scene = search.problem.scene().clone();
        if !scene.mesh_is_given() {
            let turns = scene.rod.shape.turning() / COARSE_TURN;
            let coarse = COARSE_SEGMENTS.max(turns.ceil() as usize);
            scene.rod.segments = scene.rod.segments.map(|n| n.min(coarse));
        }
        let beta_is_known = search.unknowns.iter().all(|u| u.parameter != Parameter::Beta);
        if let Some(time) = &mut scene.time
            && beta_is_known
        {
            let step = (first / COARSE_STEPS).max(time.step);
            // The scheme damps like (beta - 1/2) h.
            time.beta = 0.5 + (time.beta - 0.5) * time.step / step;
            if stability_limit(time.scheme).is_some() {
                time.scheme = Scheme::NewmarkBeta;
            }
            time.step = step;
        }
        // Nodes of the full mesh are elsewhere on the coarse one.
        let moved = |observation: &Observation| {
            let point = match observation.point {
                Point::Node(_) => {
                    let s = search.problem.arc_length(observation.point)?;
                    Point::ArcLength(s.clamp(0.0, search.problem.length()))
                }
                point => point,
            };
            Ok(Observation { point, ..observation.clone() })
        };
        let observations = search.observations.iter().map(moved).collect::<Result<_, Error>>()?;
        let problem = scene.problem()?.computed_as(search.problem);
        Ok(Self { problem, observations })
    }

    fn residuals(&self, search: &Search, horizon: f64) -> Result<Residuals, Error> {
        let residuals = Residuals::new(
            &self.problem,
            &self.observations,
            &search.sigmas,
            search.unknowns,
            horizon,
            search.full_work,
        )?;
        Ok(residuals.counting(search.work.clone()))
    }

    /// Walls at nodes make a rod half an edge too short, on the coarse mesh more than on the full
    /// one; frequencies go with sqrt(E)/length^2.
    fn correct(&self, search: &Search, mut x: Vec<f64>) -> Vec<f64> {
        let supports = &search.problem.scene().supports;
        if supports.clamp != Clamp::Nodes {
            return x;
        }
        let walls =
            [supports.start, supports.end].iter().filter(|s| **s == Support::Clamped).count();
        let free = |problem: &Problem| 1.0 - 0.5 * walls as f64 / problem.segments() as f64;
        let ratio = free(search.problem) / free(&self.problem);
        let modulus = search.unknowns.iter().position(|u| u.parameter == Parameter::YoungsModulus);
        if let Some(i) = modulus {
            x[i] += 4.0 * ratio.ln();
        }
        x
    }
}
