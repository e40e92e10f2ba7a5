//! A start for the optimiser when none is known, or when the one given may be far off.
//!
//! The misfit over Young's modulus has many minima: a wrong stiffness can match a long vibration
//! every few periods. Over the first period there is only one. So: scan a coarse model over the
//! first period, refine the best candidates there while the horizon doubles, and only then turn to
//! the full model, whose own horizon starts where the coarse model's bias is still harmless.

use super::journal::{Grid, Journal, Stage, Visit};
use super::levenberg_marquardt::{LeastSquaresState, LevenbergMarquardt};
use super::{Experiment, Loss, Observation, Residuals, Unknown};
use crate::direct::splitting::stability_limit;
use crate::error::Error;
use crate::parameter::Parameter;
use crate::problem::Problem;
use crate::scene::{Clamp, Node, Scheme, Support};
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
/// Points of the scan at most; with more unknowns, each is tried at fewer values.
const MOST_POINTS: usize = 6000;

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
    pub experiments: &'a [Experiment],
    /// One per measurement, in its unit.
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
    pub experiments: &'a [Experiment],
    pub sigmas: &'a [f64],
    pub unknowns: &'a [Unknown],
    pub full_work: f64,
}

impl<'a> Task<'a> {
    /// A silent search that counts its own work.
    pub fn search(self) -> Search<'a> {
        Search {
            experiments: self.experiments,
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
    /// Half the sum of the losses.
    pub cost: f64,
    /// Of all measurements and then of the priors, not bent by a robust loss.
    pub residuals: Vec<f64>,
    /// Of the same.
    pub jacobian: Vec<Vec<f64>>,
    /// Residuals of each measurement.
    pub counts: Vec<usize>,
    pub converged: bool,
    pub status: String,
}

impl Search<'_> {
    /// What other searches of the same problem need.
    pub fn task(&self) -> Task<'_> {
        Task {
            experiments: self.experiments,
            sigmas: &self.sigmas,
            unknowns: self.unknowns,
            full_work: self.full_work,
        }
    }

    /// Counts the work of another search.
    pub fn count(&self, work: f64) {
        self.work.set(self.work.get() + work);
    }

    /// Ends of the records, s.
    fn durations(&self) -> Vec<f64> {
        self.experiments.iter().map(Experiment::duration).collect()
    }

    /// About the first period of every experiment, s, with enough samples to tell the unknowns;
    /// zero without motion.
    fn first_periods(&self, stretch: f64) -> Vec<f64> {
        let enough = 8 + 4 * self.unknowns.len();
        let wait = |o: &Observation| o.samples.get(enough).map_or(f64::MAX, |s| s.time);
        let first = |experiment: &Experiment| {
            let least = |part: &dyn Fn(&Observation) -> f64| {
                experiment.motions().map(part).fold(f64::MAX, f64::min)
            };
            let (rise, sampled) = (least(&Observation::rise_time), least(&wait));
            (2.0 * rise * stretch).max(sampled).min(experiment.duration())
        };
        self.experiments.iter().map(first).collect()
    }

    /// Tells the progress.
    pub fn report(&self, stage: &str) {
        if let Some(progress) = &self.progress {
            progress(stage, self.work.get() / self.full_work);
        }
    }

    /// Whether the fit shall stop.
    pub fn is_stopped(&self) -> bool {
        self.experiments.iter().any(|e| e.problem.is_stopped())
    }

    /// Notes a point.
    fn note(&self, visit: Visit) {
        self.journal.visit(visit, self.work.get() / self.full_work);
    }

    /// Starts for the full model, most promising first.
    pub fn starts(&self, effort: &Effort) -> Result<Vec<Vec<f64>>, Error> {
        let grid = effort.grid;
        let first = self.first_periods(effort.stretch);
        let coarse = Coarse::new(self, &first)?;
        let mut scanned = self.scan(&coarse, &first, grid)?;
        scanned.sort_by(|a, b| a.1.total_cmp(&b.1));
        let mut candidates: Vec<(Vec<f64>, f64)> = Vec::new();
        for (x, cost) in scanned {
            let far = |y: &[f64]| x.iter().zip(y).any(|(a, b)| (a - b).abs() > 0.9);
            if candidates.iter().all(|(y, _)| far(y)) && candidates.len() < CANDIDATES * grid {
                candidates.push((x, cost));
            }
        }
        let mut horizons = first.clone();
        loop {
            for (x, cost) in &mut candidates {
                let residuals = coarse.residuals(self, &horizons)?;
                match self.optimize(residuals, x, (1e-4, 1e-2, 12), None) {
                    Ok(Optimum { x: there, cost: least, residuals, counts, .. }) => {
                        (*x, *cost) = (there, least);
                        let corrected = coarse.correct(self, x.clone());
                        let stage = Stage::Coarse;
                        self.note(Visit { stage, x: corrected, cost: least, residuals, counts });
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
            let durations = self.durations();
            let trusted = first.iter().zip(&durations).map(|(t, end)| {
                // The coarse model is not trusted further.
                end.min(effort.trusted_periods * t)
            });
            if horizons.iter().zip(trusted).all(|(h, most)| *h >= most) {
                break;
            }
            horizons.iter_mut().zip(&durations).for_each(|(h, end)| *h = (2.0 * *h).min(*end));
        }
        Ok(candidates.into_iter().take(2).map(|(x, _)| coarse.correct(self, x)).collect())
    }

    /// Misfit of every combination of candidate values over the first period.
    fn scan(
        &self,
        coarse: &Coarse,
        first: &[f64],
        grid: usize,
    ) -> Result<Vec<(Vec<f64>, f64)>, Error> {
        let mut lists: Vec<Vec<f64>> = self
            .unknowns
            .iter()
            .map(|unknown| {
                let mut values = self.candidates(unknown, first);
                if grid > 1 {
                    let middles: Vec<f64> =
                        values.windows(2).map(|v| (v[0] * v[1]).abs().sqrt()).collect();
                    values.extend(middles);
                    values.sort_by(f64::total_cmp);
                }
                values
            })
            .collect();
        thin(&mut lists, self.unknowns);
        let scaled = |(unknown, values): (&Unknown, &Vec<f64>)| {
            values.iter().map(|v| unknown.to_scale(*v)).collect()
        };
        let axes = self.unknowns.iter().zip(&lists).map(scaled).collect();
        let mut points = vec![Vec::new()];
        for (unknown, values) in self.unknowns.iter().zip(lists) {
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
        for (g, e) in self.tied_shear_moduli() {
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
                        self.note(Visit {
                            stage: Stage::Scan,
                            x: coarse.correct(self, x.clone()),
                            cost,
                            residuals: residuals.straight(&x)?,
                            counts: residuals.counts(),
                        });
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

    /// Values of an unknown worth trying, as the first experiment that has it suggests.
    fn candidates(&self, unknown: &Unknown, first: &[f64]) -> Vec<f64> {
        let own = self.experiments.iter().zip(first).find(|(e, _)| unknown.is_of(e));
        let Some((experiment, first)) = own else { return Vec::new() };
        let with_modulus = self.youngs_modulus_beside(unknown).is_some();
        let (duration, rise) = (experiment.duration(), 0.5 * first);
        unknown.candidates(&experiment.problem, duration, rise, with_modulus)
    }

    /// The unknown Young's modulus of the same rod as another unknown.
    fn youngs_modulus_beside(&self, unknown: &Unknown) -> Option<usize> {
        self.unknowns.iter().position(|u| {
            u.parameter == Parameter::YoungsModulus
                && self.experiments.iter().any(|e| u.is_of(e) && unknown.is_of(e))
        })
    }

    /// Unknown shear moduli of which nothing is known, with the Young's modulus beside each.
    fn tied_shear_moduli(&self) -> Vec<(usize, usize)> {
        let free = |u: &Unknown| {
            u.parameter == Parameter::ShearModulus && u.start.is_none() && u.prior.is_none()
        };
        let shear = self.unknowns.iter().enumerate().filter(|(_, u)| free(u));
        shear.filter_map(|(g, u)| Some((g, self.youngs_modulus_beside(u)?))).collect()
    }

    /// Fits the full model from `start`, over growing horizons where the record is long.
    pub fn refine(&self, start: &[f64], effort: &Effort) -> Result<Optimum, Error> {
        let durations = self.durations();
        let first = self.first_periods(effort.stretch);
        let mut horizons: Vec<f64> = first.iter().map(|t| effort.trusted_periods * t).collect();
        let nearly = 0.5 + 0.5 * effort.growth;
        let mut x = start.to_vec();
        while horizons.iter().zip(&durations).any(|(h, end)| *h < end / nearly) {
            let part = self.residuals(&horizons)?;
            x = self.optimize(part, &x, (1e-5, 1e-2, 20), Some(Stage::Growing))?.x;
            self.report("growing horizon");
            horizons.iter_mut().for_each(|h| *h *= effort.growth);
        }
        let optimum = self.polish(&x)?;
        self.journal.reach(&optimum);
        Ok(optimum)
    }

    /// Fits the full model to the whole record.
    pub fn polish(&self, start: &[f64]) -> Result<Optimum, Error> {
        self.optimize(self.all_residuals()?, start, (1e-10, 1e-3, 60), Some(Stage::Full))
    }

    /// The residuals of the full model.
    pub fn all_residuals(&self) -> Result<Residuals, Error> {
        self.residuals(&self.durations())
    }

    /// The residuals of the full model up to `horizons`, s.
    fn residuals(&self, horizons: &[f64]) -> Result<Residuals, Error> {
        self.residuals_of(self.experiments, horizons)
    }

    fn residuals_of(
        &self,
        experiments: &[Experiment],
        horizons: &[f64],
    ) -> Result<Residuals, Error> {
        let (sigmas, unknowns) = (&self.sigmas, self.unknowns);
        let residuals = Residuals::new(experiments, sigmas, unknowns, horizons, self.full_work)?;
        Ok(residuals.counting(self.work.clone()))
    }

    /// Fits `residuals` with these tolerances of step and noise and this many iterations, and notes
    /// each of them as of this stage.
    fn optimize(
        &self,
        residuals: Residuals,
        start: &[f64],
        (step_tolerance, noise_tolerance, iterations): (f64, f64, u64),
        stage: Option<Stage>,
    ) -> Result<Optimum, Error> {
        let (counts, losses) = (residuals.counts(), residuals.losses());
        let bounds = self.unknowns.iter().map(Unknown::scaled_bounds).collect();
        let solver = LevenbergMarquardt::new(bounds)
            .step_tolerance(step_tolerance)
            .noise_tolerance(noise_tolerance);
        let observer = Observer {
            progress: self.progress.clone(),
            work: self.work.clone(),
            full_work: self.full_work,
            journal: self.journal.clone(),
            stage,
            counts: counts.clone(),
            losses: losses.clone(),
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
        let mut residuals = state.take_residuals().ok_or_else(lost)?;
        let mut jacobian = state.take_jacobian().ok_or_else(lost)?;
        for ((r, row), loss) in residuals.iter_mut().zip(&mut jacobian).zip(losses) {
            if loss.is_robust() {
                *r = loss.straight(*r);
                let [_, slope] = loss.bent(*r);
                row.iter_mut().for_each(|d| *d /= slope);
            }
        }
        Ok(Optimum {
            x: state.take_param().or_else(|| state.take_best_param()).ok_or_else(lost)?,
            cost,
            residuals,
            jacobian,
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
    /// None: not worth noting.
    stage: Option<Stage>,
    counts: Vec<usize>,
    losses: Vec<Loss>,
}

impl Observer {
    fn note(&self, state: &LeastSquaresState) {
        if let (Some(stage), Some(x), Some(bent)) =
            (self.stage, state.get_param(), state.get_residuals())
        {
            let residuals = bent.iter().zip(&self.losses).map(|(r, loss)| loss.straight(*r));
            let visit = Visit {
                stage,
                x: x.clone(),
                cost: state.get_cost(),
                residuals: residuals.collect(),
                counts: self.counts.clone(),
            };
            self.journal.visit(visit, self.work.get() / self.full_work);
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
        self.note(state);
        Ok(())
    }

    fn observe_iter(
        &mut self,
        state: &LeastSquaresState,
        _: &KV,
    ) -> Result<(), argmin::core::Error> {
        self.note(state);
        if let Some(progress) = &self.progress {
            let (iteration, misfit) = (state.get_iter() + 1, state.get_cost());
            let stage = format!("iteration {iteration}, misfit {misfit:.6e}");
            progress(&stage, self.work.get() / self.full_work);
        }
        Ok(())
    }
}

/// Halves the longest lists of values until their combinations are few enough; Young's modulus, over
/// which the misfit has most minima, keeps its values longest.
fn thin(lists: &mut [Vec<f64>], unknowns: &[Unknown]) {
    let points = |lists: &[Vec<f64>]| lists.iter().map(|l| l.len() as f64).product::<f64>();
    while points(lists) > MOST_POINTS as f64 {
        let weight = |i: usize| match unknowns[i].parameter {
            Parameter::YoungsModulus => lists[i].len() / 8,
            _ => lists[i].len(),
        };
        let Some(longest) = (0..lists.len()).max_by_key(|i| weight(*i)) else { return };
        let kept = lists[longest].iter().skip(lists[longest].len() / 2 % 2).step_by(2).copied();
        lists[longest] = kept.collect();
    }
}

/// The experiments on coarse meshes with large steps.
struct Coarse {
    experiments: Vec<Experiment>,
}

impl Coarse {
    fn new(search: &Search, first: &[f64]) -> Result<Self, Error> {
        let coarse = |(experiment, first): (&Experiment, &f64)| {
            let unknowns: Vec<&Unknown> =
                search.unknowns.iter().filter(|u| u.is_of(experiment)).collect();
            experiment.posed_as(coarse(&experiment.problem, &unknowns, *first)?)
        };
        let experiments = search.experiments.iter().zip(first).map(coarse);
        Ok(Self { experiments: experiments.collect::<Result<_, _>>()? })
    }

    fn residuals(&self, search: &Search, horizons: &[f64]) -> Result<Residuals, Error> {
        search.residuals_of(&self.experiments, horizons)
    }

    /// Walls at nodes make a rod half an edge too short, on the coarse mesh more than on the full
    /// one; frequencies go with sqrt(E)/length^2.
    fn correct(&self, search: &Search, mut x: Vec<f64>) -> Vec<f64> {
        for (x, unknown) in x.iter_mut().zip(search.unknowns) {
            let mut both = search.experiments.iter().zip(&self.experiments);
            let own = both.find(|(e, _)| unknown.is_of(e));
            if let Some((full, coarse)) = own
                && unknown.parameter == Parameter::YoungsModulus
            {
                *x += 4.0 * (free(&full.problem) / free(&coarse.problem)).ln();
            }
        }
        x
    }
}

/// The part of a rod's length that walls at nodes leave free.
fn free(problem: &Problem) -> f64 {
    let supports = &problem.scene().supports;
    let walls = [supports.start, supports.end].iter().filter(|s| **s == Support::Clamped).count();
    match supports.clamp {
        Clamp::Nodes => 1.0 - 0.5 * walls as f64 / problem.segments() as f64,
        Clamp::MidEdge => 1.0,
    }
}

/// A problem on a coarse mesh with large steps, of which `first` are its first period, s.
fn coarse(problem: &Problem, unknowns: &[&Unknown], first: f64) -> Result<Problem, Error> {
    let mut scene = problem.scene().clone();
    if !scene.mesh_is_given() {
        let turns = scene.rod.shape.turning() / COARSE_TURN;
        let coarse = COARSE_SEGMENTS.max(turns.ceil() as usize);
        scene.rod.segments = scene.rod.segments.map(|n| n.min(coarse));
        let ratio = scene.rod.segments.unwrap_or(1) as f64 / problem.segments() as f64;
        for load in scene.loads.point.iter_mut().chain(&mut scene.initial.point) {
            if let Node::Index(i) = &mut load.node {
                *i = (*i as f64 * ratio).round() as usize;
            }
        }
    }
    let beta_is_known = unknowns.iter().all(|u| u.parameter != Parameter::Beta);
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
    Ok(scene.problem()?.computed_as(problem))
}
