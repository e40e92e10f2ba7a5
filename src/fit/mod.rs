//! Identification of parameters from recorded motion.
//!
//! [`Fit`] minimises the distance between the simulated and the recorded points by
//! [Levenberg-Marquardt](levenberg_marquardt) on exact sensitivities, from a start of its own
//! making ([`search`](self)), and says how well the data determine each parameter.
//!
//! A number comes with what speaks against it: what the data cannot tell
//! ([`FitReport::not_identifiable`]), its statistical error (the covariance of the exact Jacobian;
//! [on request](Analysis) the exact Hessian, the likelihood's profile, a bootstrap), what mesh and
//! step may be off ([`DiscretizationError`]), and whether the residuals look like noise
//! ([`ResidualTests`]).

mod analysis;
mod assessment;
mod bootstrap;
mod discretization;
mod evidence;
mod file;
mod hessian;
mod identifiability;
mod journal;
pub mod levenberg_marquardt;
mod linearized;
mod observation;
mod profile;
mod recording;
mod replay;
mod report;
mod residual_tests;
mod residuals;
mod search;
mod uncertainty;
mod unknown;
mod view;

pub use analysis::{Analysis, Refinement};
pub use bootstrap::Bootstrap;
pub use discretization::DiscretizationError;
pub use evidence::{
    Asked, Basin, Basins, Evidence, Iterate, Landscape, Over, Profile, Seen, Series, Setup, Shape,
};
pub use file::FitFile;
pub use identifiability::{Finding, Kind};
pub use levenberg_marquardt::LevenbergMarquardt;
pub use observation::{Observation, Sample};
pub use recording::{Recording, Vertical};
pub use report::{Estimate, FitReport};
pub use residual_tests::ResidualTests;
pub use residuals::Residuals;
pub use search::Progress;
pub use unknown::Unknown;

use crate::error::Error;
use crate::problem::Problem;
use journal::Journal;
use search::{Optimum, Search};
use std::cell::Cell;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Part of the observed motion that a model may leave unexplained before the search is repeated
/// on a finer grid, and before the report warns, unless it is noise.
const UNEXPLAINED: f64 = 0.1;
/// Bootstrap replicates beyond this are a slip of the pen.
const MOST_REPLICATES: usize = 1_000_000;

/// An identification in the making.
///
/// ```no_run
/// use rodfit::{Fit, Observation, Parameter, Scene};
/// let problem = Scene::load("data/cantilever.toml")?.problem()?;
/// let fit = Fit::new(&problem)
///     .observe(Observation::read("data/cantilever-tip.csv")?)
///     .identify(Parameter::YoungsModulus)
///     .solve()?;
/// println!("{fit}");
/// # Ok::<(), rodfit::Error>(())
/// ```
#[derive(Clone)]
pub struct Fit {
    problem: Problem,
    observations: Vec<Observation>,
    unknowns: Vec<Unknown>,
    analysis: Analysis,
    progress: Option<Progress>,
    keep_evidence: bool,
}

impl Fit {
    /// A fit of the parameters of `problem`.
    pub fn new(problem: &Problem) -> Self {
        Self {
            problem: problem.clone(),
            observations: Vec::new(),
            unknowns: Vec::new(),
            analysis: Analysis::default(),
            progress: None,
            keep_evidence: false,
        }
    }

    /// Adds recorded motion.
    pub fn observe(mut self, observation: Observation) -> Self {
        self.observations.push(observation);
        self
    }

    /// Adds a parameter to identify.
    pub fn identify(mut self, unknown: impl Into<Unknown>) -> Self {
        self.unknowns.push(unknown.into());
        self
    }

    /// Says what to do beyond finding the parameters.
    pub fn analyse(self, analysis: Analysis) -> Self {
        Self { analysis, ..self }
    }

    /// Calls `progress` with the stage and the work done so far, in full simulations.
    pub fn on_progress(mut self, progress: impl Fn(&str, f64) + 'static) -> Self {
        self.progress = Some(Rc::new(progress));
        self
    }

    /// Keeps what the numbers rest on in [`FitReport::evidence`]; costs one more simulation.
    pub fn keep_evidence(self) -> Self {
        Self { keep_evidence: true, ..self }
    }

    /// Stops once `flag` is set, at the next time step of whatever runs then. The report has the
    /// best values so far and says that it was interrupted.
    pub fn stop_when(mut self, flag: Arc<AtomicBool>) -> Self {
        self.problem = self.problem.stop_when(flag);
        self
    }

    /// The residuals and their derivatives, for any solver of argmin.
    pub fn residuals(&self) -> Result<Residuals, Error> {
        self.check()?;
        let sigmas = self.first_sigmas();
        Residuals::new(
            &self.problem,
            &self.observations,
            &sigmas,
            &self.unknowns,
            f64::MAX,
            self.full_work()?,
        )
    }

    /// Finds the parameters. An error means that there is nothing to report; a report may still
    /// say that the fit did not converge, was interrupted, or that a parameter is not identifiable.
    pub fn solve(&self) -> Result<FitReport, Error> {
        let clock = std::time::Instant::now();
        self.check()?;
        let full_work = self.full_work()?;
        let work = Rc::new(Cell::new(0.0));
        let journal = Rc::new(Journal::default());
        let mut sigmas = self.first_sigmas();
        let search = |sigmas: &[f64]| Search {
            problem: &self.problem,
            observations: &self.observations,
            sigmas: sigmas.to_vec(),
            unknowns: &self.unknowns,
            full_work,
            work: work.clone(),
            progress: self.progress.clone(),
            journal: journal.clone(),
        };
        let optimum = self.optimum(&search, &mut sigmas);
        let search = search(&sigmas);
        let mut report = match optimum.and_then(|optimum| self.assess(&search, &optimum)) {
            Err(Error::Interrupted) => self.unfinished(&search)?,
            report => report?,
        };
        report.simulations = work.get() / full_work;
        report.wall_seconds = clock.elapsed().as_secs_f64();
        Ok(report)
    }

    /// The best of all starts, with the weights that belong to it.
    fn optimum<'a>(
        &self,
        search: &impl Fn(&[f64]) -> Search<'a>,
        sigmas: &mut Vec<f64>,
    ) -> Result<Optimum, Error> {
        let mut optimum = self.globally(&search(sigmas))?;
        // Weights of several observations of unknown noise depend on the fit, and it on them.
        let unknown_noise = self.observations.iter().filter(|o| o.sigma.is_none()).count();
        if unknown_noise > 0 && self.observations.len() > 1 {
            for _ in 0..20 {
                let before = sigmas.clone();
                self.estimate_sigmas(&optimum, sigmas);
                let search = search(sigmas);
                search.journal.reweight();
                optimum = search.polish(&optimum.x)?;
                let settled = |(a, b): (&f64, &f64)| (a / b - 1.0).abs() < 1e-3;
                if sigmas.iter().zip(&before).all(settled) {
                    break;
                }
            }
        }
        Ok(optimum)
    }

    /// The best of all starts; searches again, more finely, when much of the motion is left
    /// unexplained.
    fn globally(&self, search: &Search) -> Result<Optimum, Error> {
        let mut best: Option<Optimum> = None;
        let mut failure = None;
        for effort in &search::EFFORTS {
            for start in search.starts(effort)? {
                match search.refine(&start, effort) {
                    Ok(optimum) => {
                        if best.as_ref().is_none_or(|b| optimum.cost < b.cost) {
                            best = Some(optimum);
                        }
                    }
                    Err(Error::Interrupted) => return Err(Error::Interrupted),
                    Err(error) => failure = Some(error),
                }
                // The first start is nearly always it; the second is for when it was not.
                if best.as_ref().is_some_and(|b| b.converged && self.explained(b, &search.sigmas)) {
                    break;
                }
            }
            if best.as_ref().is_some_and(|b| self.explained(b, &search.sigmas)) {
                break;
            }
        }
        best.ok_or_else(|| {
            failure.unwrap_or_else(|| Error::Fit("no start for the fit was found".into()))
        })
    }

    /// Whether every observation is explained but for a tenth of its motion, three sigma, or noise.
    fn explained(&self, optimum: &Optimum, sigmas: &[f64]) -> bool {
        let rms = rms_per_observation(optimum, sigmas);
        let mut rest = &optimum.residuals[..];
        self.observations.iter().zip(rms).zip(&optimum.counts).all(|((observation, rms), count)| {
            let (own, others) = rest.split_at(*count);
            rest = others;
            let spread = observation.spread();
            rms <= (UNEXPLAINED * spread).max(3.0 * observation.sigma.unwrap_or(0.0))
                || spread == 0.0
                || self.is_noisy(observation, rms, own)
        })
    }

    /// Sigmas given, and for the others the rod's length: a common scale.
    fn first_sigmas(&self) -> Vec<f64> {
        self.observations.iter().map(|o| o.sigma.unwrap_or(self.problem.length())).collect()
    }

    /// Replaces the sigmas that are not given by the spread of the residuals.
    fn estimate_sigmas(&self, optimum: &Optimum, sigmas: &mut [f64]) {
        let total: usize = optimum.counts.iter().sum();
        let freedom = 1.0 - self.unknowns.len() as f64 / total as f64;
        let rms = rms_per_observation(optimum, sigmas);
        for ((sigma, observation), rms) in sigmas.iter_mut().zip(&self.observations).zip(rms) {
            if observation.sigma.is_none() && rms > 0.0 {
                *sigma = rms / freedom.sqrt();
            }
        }
    }

    fn full_work(&self) -> Result<f64, Error> {
        let time = self.problem.time()?;
        Ok((time.steps() * self.problem.segments()) as f64)
    }

    fn check(&self) -> Result<(), Error> {
        if self.observations.is_empty() {
            return Err(Error::invalid("observation", "none", "at least one"));
        }
        if self.unknowns.is_empty() {
            return Err(Error::invalid("parameter", "none", "at least one"));
        }
        for (i, unknown) in self.unknowns.iter().enumerate() {
            let key = format!("parameter[{i}]");
            if self.unknowns[..i].iter().any(|u| u.parameter == unknown.parameter) {
                return Err(Error::invalid(
                    format!("{key}.name"),
                    unknown.parameter,
                    "each name once",
                ));
            }
            unknown.check(&self.problem, &key)?;
        }
        if self.analysis.bootstrap == 1 || self.analysis.bootstrap > MOST_REPLICATES {
            let allowed = format!("0, or 2 .. {MOST_REPLICATES}");
            return Err(Error::invalid("analysis.bootstrap", self.analysis.bootstrap, allowed));
        }
        let end = self.problem.time()?.end;
        // With a clock of its own a recording may show later times than the motion lasts.
        let other_clock = self.problem.scene().camera.time_offset != 0.0
            || self.unknowns.iter().any(|u| u.parameter == crate::Parameter::TimeOffset);
        let mut values = 0;
        for (i, observation) in self.observations.iter().enumerate() {
            self.problem.stencil(observation.point).map_err(|error| {
                Error::invalid(format!("observation[{i}].point"), error, "a point of the rod")
            })?;
            if let Some(sigma) = observation.sigma {
                crate::scene::positive(&format!("observation[{i}].sigma"), sigma)?;
            }
            let late = observation.samples.iter().find(|s| s.time > end * (1.0 + 1e-9));
            if let Some(late) = late.filter(|_| !other_clock) {
                return Err(Error::invalid(
                    observation.label(),
                    format!("t = {} s", late.time),
                    format!("up to the scene's time.end = {end} s"),
                ));
            }
            let sane = |s: &Sample| {
                s.time.is_finite()
                    && s.time >= 0.0
                    && s.position.iter().flatten().all(|x| x.is_finite())
            };
            if !observation.samples.iter().all(sane)
                || observation.samples.windows(2).any(|w| w[0].time >= w[1].time)
            {
                let allowed = "finite positions at increasing times from 0 on";
                return Err(Error::invalid(observation.label(), "other samples", allowed));
            }
            values += observation.values();
        }
        let needed = self.unknowns.len() + 1;
        if values < needed {
            let allowed = format!("at least {needed}, one more than parameters");
            return Err(Error::invalid("observation", format!("{values} values"), allowed));
        }
        Ok(())
    }
}

/// Root mean square residual of each observation, m.
fn rms_per_observation(optimum: &Optimum, sigmas: &[f64]) -> Vec<f64> {
    let mut rest = &optimum.residuals[..];
    let mut rms = Vec::new();
    for (count, sigma) in optimum.counts.iter().zip(sigmas) {
        let (own, others) = rest.split_at(*count);
        let mean = own.iter().map(|r| r * r).sum::<f64>() / (*count).max(1) as f64;
        rms.push(mean.sqrt() * sigma);
        rest = others;
    }
    rms
}
