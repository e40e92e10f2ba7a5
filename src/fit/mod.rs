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
mod experiment;
mod file;
mod frequencies;
mod hessian;
mod identifiability;
mod journal;
pub mod levenberg_marquardt;
mod linearized;
mod loss;
mod measurement;
mod observation;
mod prediction;
mod profile;
mod recording;
mod replay;
mod report;
mod residual_tests;
mod residuals;
mod rest_shape;
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
pub use experiment::Experiment;
pub use file::FitFile;
pub use frequencies::{Frequencies, Frequency};
pub use identifiability::{Finding, Kind};
pub use levenberg_marquardt::LevenbergMarquardt;
pub use loss::Loss;
pub use measurement::Measurement;
pub use observation::{Observation, Sample};
pub use prediction::Prediction;
pub use recording::{Recording, Vertical};
pub use report::{Estimate, FitReport, LossEffect};
pub use residual_tests::ResidualTests;
pub use residuals::Residuals;
pub use rest_shape::{RestShape, Sighting};
pub use search::Progress;
pub use unknown::{Prior, Unknown};

use crate::error::Error;
use crate::problem::Problem;
use experiment::all;
use journal::Journal;
use search::{Optimum, Search};
use std::cell::Cell;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Part of the observed motion that a model may leave unexplained before the search is repeated
/// on a finer grid, and before the report warns, unless it is noise.
const UNEXPLAINED: f64 = 0.1;
/// How often weights are estimated from the residuals.
const MOST_WEIGHTINGS: usize = 20;
/// Fewer values do not show their own noise beside other measurements.
const FEW: usize = 8;
/// Noise below this part of the rod's length is none.
const EXACT: f64 = 1e-12;
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
///
/// Experiments share the parameters that are not said to be of some of them only:
///
/// ```no_run
/// use rodfit::fit::{Experiment, Frequencies, RestShape};
/// use rodfit::{Fit, Parameter, Scene, Unknown};
/// # let (long, short) = (Scene::load("a.toml")?.problem()?, Scene::load("b.toml")?.problem()?);
/// let droop = Experiment::new("long", &long).observe(RestShape::read("droop.csv")?);
/// let ringing = Experiment::new("short", &short).observe(Frequencies::hz(&[4.21], 0.02));
/// let fit = Fit::of([droop, ringing])
///     .identify(Parameter::YoungsModulus)
///     .identify(Parameter::Density)
///     .identify(Unknown::new(Parameter::ClampAngle).of_experiment("long"))
///     .solve()?;
/// # Ok::<(), rodfit::Error>(())
/// ```
#[derive(Clone)]
pub struct Fit {
    experiments: Vec<Experiment>,
    unknowns: Vec<Unknown>,
    analysis: Analysis,
    progress: Option<Progress>,
    keep_evidence: bool,
}

impl Fit {
    /// A fit of the parameters of `problem`.
    pub fn new(problem: &Problem) -> Self {
        Self::of([Experiment::new("", problem)])
    }

    /// A fit of the parameters of several experiments.
    pub fn of(experiments: impl IntoIterator<Item = Experiment>) -> Self {
        Self {
            experiments: experiments.into_iter().collect(),
            unknowns: Vec::new(),
            analysis: Analysis::default(),
            progress: None,
            keep_evidence: false,
        }
    }

    /// Adds what was measured in the last experiment.
    pub fn observe(mut self, measurement: impl Into<Measurement>) -> Self {
        if let Some(experiment) = self.experiments.last_mut() {
            experiment.measurements.push(measurement.into());
        }
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
        for experiment in &mut self.experiments {
            experiment.problem = experiment.problem.clone().stop_when(flag.clone());
        }
        self
    }

    /// The residuals and their derivatives, for any solver of argmin.
    pub fn residuals(&self) -> Result<Residuals, Error> {
        self.check()?;
        let fitted = self.fitted();
        let horizons = vec![f64::MAX; fitted.len()];
        let (sigmas, work) = (first_sigmas(&fitted), full_work(&fitted)?);
        Residuals::new(&fitted, &sigmas, &self.unknowns, &horizons, work)
    }

    /// Finds the parameters. An error means that there is nothing to report; a report may still
    /// say that the fit did not converge, was interrupted, or that a parameter is not identifiable.
    pub fn solve(&self) -> Result<FitReport, Error> {
        let clock = std::time::Instant::now();
        self.check()?;
        let fitted = self.fitted();
        let full_work = full_work(&fitted)?;
        let work = Rc::new(Cell::new(0.0));
        let journal = Rc::new(Journal::default());
        let mut sigmas = first_sigmas(&fitted);
        let search = |sigmas: &[f64]| Search {
            experiments: &fitted,
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
        sigmas: &mut [f64],
    ) -> Result<Optimum, Error> {
        let first = search(sigmas);
        let mut optimum = globally(&first)?;
        if self.weights_depend_on_the_fit(first.experiments) {
            for _ in 0..MOST_WEIGHTINGS {
                let before = sigmas.to_vec();
                search(&before).estimate_sigmas(&optimum, sigmas);
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

    /// The experiments with the measurements that are fitted.
    fn fitted(&self) -> Vec<Experiment> {
        self.experiments.iter().map(|e| e.only(|m| !m.held_out())).collect()
    }

    /// Whether noise that is estimated from the residuals changes what the residuals come out as:
    /// not so where all have the same.
    fn weights_depend_on_the_fit(&self, fitted: &[Experiment]) -> bool {
        let mut unknown = all(fitted).filter(|(_, m)| m.sigma().is_none());
        let robust = unknown.clone().any(|(_, m)| m.loss().is_robust());
        let several = all(fitted).count() > 1 || self.unknowns.iter().any(|u| u.prior.is_some());
        unknown.next().is_some() && (robust || several)
    }

    fn check(&self) -> Result<(), Error> {
        let fitted = self.fitted();
        if all(&fitted).next().is_none() {
            return Err(Error::invalid("observation", "none", "at least one that is not held out"));
        }
        if self.unknowns.is_empty() {
            return Err(Error::invalid("parameter", "none", "at least one"));
        }
        for (i, experiment) in self.experiments.iter().enumerate() {
            if self.experiments[..i].iter().any(|e| e.name == experiment.name) {
                let key = format!("experiment[{i}].name");
                return Err(Error::invalid(
                    key,
                    format!("{:?}", experiment.name),
                    "each name once",
                ));
            }
        }
        for (i, unknown) in self.unknowns.iter().enumerate() {
            let key = format!("parameter[{i}]");
            unknown.check(&self.experiments, &key)?;
            let shared = |e: &Experiment, u: &Unknown| u.is_of(e) && unknown.is_of(e);
            let twice = self.unknowns[..i].iter().any(|u| {
                u.parameter == unknown.parameter && self.experiments.iter().any(|e| shared(e, u))
            });
            if twice {
                let allowed = "each name once in an experiment";
                return Err(Error::invalid(format!("{key}.name"), unknown.parameter, allowed));
            }
        }
        if self.analysis.bootstrap == 1 || self.analysis.bootstrap > MOST_REPLICATES {
            let allowed = format!("0, or 2 .. {MOST_REPLICATES}");
            return Err(Error::invalid("analysis.bootstrap", self.analysis.bootstrap, allowed));
        }
        let several = all(&fitted).count() > 1;
        for experiment in &self.experiments {
            // With a clock of its own a recording may show later times than the motion lasts.
            let other_clock = experiment.problem.scene().camera.time_offset != 0.0
                || self
                    .unknowns
                    .iter()
                    .any(|u| u.parameter == crate::Parameter::TimeOffset && u.is_of(experiment));
            for (i, measurement) in experiment.measurements.iter().enumerate() {
                let kind = match measurement {
                    Measurement::Motion(_) => "observation",
                    Measurement::RestShape(_) => "shape",
                    Measurement::Frequencies(_) => "frequencies",
                };
                let before = experiment.measurements[..i].iter();
                let same = |m: &&Measurement| {
                    std::mem::discriminant(*m) == std::mem::discriminant(measurement)
                };
                let key = match experiment.name.is_empty() {
                    true => format!("{kind}[{}]", before.filter(same).count()),
                    false => format!("{}.{kind}[{}]", experiment.name, before.filter(same).count()),
                };
                measurement.check(&experiment.problem, (&key, other_clock))?;
                if several && measurement.sigma().is_none() && measurement.values() < FEW {
                    let found = format!("none, with {} values", measurement.values());
                    let allowed = format!("a number; only {FEW} values or more show their noise");
                    return Err(Error::invalid(format!("{key}.sigma"), found, allowed));
                }
            }
        }
        let values: usize = all(&fitted).map(|(_, m)| m.values()).sum();
        let priors = self.unknowns.iter().filter(|u| u.prior.is_some()).count();
        let needed = self.unknowns.len() + 1;
        if values + priors < needed {
            let allowed = format!("at least {needed}, one more than parameters");
            return Err(Error::invalid("observation", format!("{values} values"), allowed));
        }
        Ok(())
    }
}

/// The best of all starts; searches again, more finely, when much of what was measured is left
/// unexplained.
fn globally(search: &Search) -> Result<Optimum, Error> {
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
            if best.as_ref().is_some_and(|b| b.converged && search.explained(b)) {
                break;
            }
        }
        if best.as_ref().is_some_and(|b| search.explained(b)) {
            break;
        }
    }
    best.ok_or_else(|| {
        failure.unwrap_or_else(|| Error::Fit("no start for the fit was found".into()))
    })
}

impl Search<'_> {
    /// Every measurement with its sigma and its residuals at an optimum.
    fn measured<'b>(
        &'b self,
        optimum: &'b Optimum,
    ) -> impl Iterator<Item = (&'b Experiment, &'b Measurement, f64, &'b [f64])> {
        let mut rest = &optimum.residuals[..];
        let counts = self.sigmas.iter().zip(&optimum.counts);
        all(self.experiments).zip(counts).map(move |((experiment, measurement), (sigma, count))| {
            let (own, others) = rest.split_at(*count);
            rest = others;
            (experiment, measurement, *sigma, own)
        })
    }

    /// Root mean square residual of each measurement, in its unit; whatever outliers do, where the
    /// loss is robust.
    fn spreads(&self, optimum: &Optimum) -> Vec<f64> {
        let spread = |(_, m, sigma, r): (_, &Measurement, f64, &[f64])| m.loss().spread(r) * sigma;
        self.measured(optimum).map(spread).collect()
    }

    /// Whether every measurement is explained but for a tenth of its motion, three sigma, or noise.
    fn explained(&self, optimum: &Optimum) -> bool {
        let spreads = self.spreads(optimum);
        self.measured(optimum).zip(spreads).all(|((experiment, measurement, _, own), rms)| {
            let size = measurement.size(&experiment.problem);
            rms <= (UNEXPLAINED * size).max(3.0 * measurement.sigma().unwrap_or(0.0))
                || size == 0.0
                || assessment::is_noisy(experiment, measurement, rms, own)
        })
    }

    /// Replaces the sigmas that are not given by the spread of the residuals.
    fn estimate_sigmas(&self, optimum: &Optimum, sigmas: &mut [f64]) {
        let total = optimum.residuals.len() as f64;
        let freedom = (1.0 - self.unknowns.len() as f64 / total).max(1.0 / total);
        let spreads = self.spreads(optimum);
        for ((sigma, (experiment, measurement)), spread) in
            sigmas.iter_mut().zip(all(self.experiments)).zip(spreads)
        {
            if measurement.sigma().is_none() && spread > 0.0 {
                // Perfect data have no noise to estimate.
                let least = EXACT * measurement.scale(&experiment.problem);
                *sigma = (spread / freedom.sqrt()).max(least);
            }
        }
    }
}

/// Sigmas given, and for the others the size of the rod, a common scale; where outliers shall count
/// less, what may be left of the motion at first.
fn first_sigmas(experiments: &[Experiment]) -> Vec<f64> {
    let first = |(experiment, measurement): (&Experiment, &Measurement)| {
        let problem = &experiment.problem;
        measurement.sigma().unwrap_or_else(|| match measurement.loss().is_robust() {
            true => (0.5 * UNEXPLAINED * measurement.size(problem)).max(f64::MIN_POSITIVE),
            false => problem.length(),
        })
    };
    all(experiments).map(first).collect()
}

fn full_work(experiments: &[Experiment]) -> Result<f64, Error> {
    experiments.iter().map(Experiment::full_work).sum()
}
