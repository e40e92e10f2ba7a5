//! Identification of parameters from what was measured of rods.
//!
//! [`Fit`] minimises the distance between what was measured in [experiments](Experiment) and what
//! their scenes do, by [Levenberg-Marquardt](crate::numerics::levenberg_marquardt) on exact sensitivities, from a
//! start of its own making, and says how well the data determine each parameter.
//!
//! A number comes with what speaks against it: what the data cannot tell
//! ([`FitReport::not_identifiable`]), its statistical error (the covariance of the exact Jacobian;
//! [on request](Analysis) the exact Hessian, the likelihood's profile, a bootstrap), what mesh and
//! step may be off ([`DiscretizationError`]), whether the residuals look like noise
//! ([`ResidualTests`]), how well held-out data are predicted ([`Prediction`]), and which other minima
//! were seen ([`Basins`]).
//!
//! The way through it: a [`FitFile`] or calls to [`Fit`] say what was measured and what is looked
//! for; [`Residuals`] compare; a search over starts finds an optimum; an assessment makes the
//! [`FitReport`] of it.

mod file;
pub(crate) mod measurement;
pub(crate) mod misfit;
pub(crate) mod report;
pub(crate) mod search;
pub(crate) mod uncertainty;
mod unknown;
mod validate;

pub use crate::numerics::levenberg_marquardt::LevenbergMarquardt;
pub use file::FitFile;
pub use measurement::Measurement;
pub use measurement::experiment::Experiment;
pub use measurement::frequencies::{Frequencies, Frequency};
pub use measurement::gauge::{Gauge, Moving, Quantity, Reading, Sight};
pub use measurement::loss::Loss;
pub use measurement::motion::{Dropped, Observation, Sample};
pub use measurement::recording::{Recording, Vertical};
pub use measurement::shape::{RestShape, Sighting};
pub use misfit::residuals::Residuals;
pub use report::plot_data::{
    Asked, Basin, Basins, Evidence, Iterate, Landscape, Measured, Over, Profile, Seen, Series,
    Setup, Shape,
};
pub use report::{DroppedRows, Estimate, FitReport, LossEffect};
pub use search::Progress;
pub use uncertainty::analysis::{Analysis, Refinement};
pub use uncertainty::bootstrap::Bootstrap;
pub use uncertainty::discretization::DiscretizationError;
pub use uncertainty::identifiability::{Finding, Kind};
pub use uncertainty::prediction::Prediction;
pub use uncertainty::residual_tests::ResidualTests;
pub use uncertainty::verdict::Grade;
pub use unknown::{Prior, Unknown};

use crate::error::Error;
use crate::fit::search::Search;
use crate::fit::search::journal::Journal;
use crate::fit::search::optimum::Optimum;
use crate::fit::uncertainty::noise::first_sigmas;
use crate::problem::Problem;
use std::cell::Cell;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// How often weights are estimated from the residuals.
const MOST_WEIGHTINGS: usize = 20;

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
        let setup = self.look(&fitted)?;
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
            suspicious: !setup.suspicions.is_empty(),
        };
        if let Some(words) = &setup.hopeless {
            return Ok(FitReport {
                dropped: self.dropped(),
                ..self.unsearched(&search(&sigmas), words)
            });
        }
        let optimum = self.optimum(&search, &mut sigmas);
        let search = search(&sigmas);
        let mut report = match optimum.and_then(|optimum| self.assess(&search, &optimum, &setup)) {
            Err(Error::Interrupted) => self.unfinished(&search)?,
            Err(error @ Error::Fit(_)) => return Err(setup.beside(error)),
            report => report?,
        };
        report.dropped = self.dropped();
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
        first.journal.reweight(sigmas);
        let mut optimum = first.globally()?;
        if self.weights_depend_on_the_fit(first.experiments) {
            for _ in 0..MOST_WEIGHTINGS {
                let before = sigmas.to_vec();
                search(&before).estimate_sigmas(&optimum, sigmas);
                let search = search(sigmas);
                search.journal.reweight(sigmas);
                optimum = search.polish(&optimum.x)?;
                let settled = |(a, b): (&f64, &f64)| (a / b - 1.0).abs() < 1e-3;
                if sigmas.iter().zip(&before).all(settled) {
                    break;
                }
            }
        }
        Ok(optimum)
    }

    /// Rows of the files that are not looked at.
    fn dropped(&self) -> Vec<DroppedRows> {
        let all = self.experiments.iter().flat_map(|e| e.measurements.iter().map(move |m| (e, m)));
        all.filter_map(|(e, m)| {
            let rows = m.dropped();
            let observation = e.label(m);
            (rows != Dropped::default()).then_some(DroppedRows { observation, rows })
        })
        .collect()
    }

    /// The experiments with the measurements that are fitted.
    fn fitted(&self) -> Vec<Experiment> {
        self.experiments.iter().map(|e| e.only(|m| !m.held_out())).collect()
    }
}

fn full_work(experiments: &[Experiment]) -> Result<f64, Error> {
    experiments.iter().map(Experiment::full_work).sum()
}
