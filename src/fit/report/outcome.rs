//! Outcomes of a fit, from which its report is made: an assessed optimum ([`FitOutcome::assessed`]), a search stopped
//! by the user (`unfinished`), or data rejected without a search (`unsearched`).
//!
//! [`FitOutcome`] has the assessment (estimates, noise, tests), the conclusion (grade, verdict, status, warnings), the
//! local minima and, on demand, the data of plots. Estimates have errors only after an assessment. Of a stopped search
//! they are the best values so far, with the grade `interrupted`; a stop before the first simulation is the error
//! [`Error::Interrupted`]. Rejected data give estimates without values, the grade unusable and one warning
//! (`NoMotion`). If the simulation for the plots of an assessed optimum fails, a note is added. The summary of the
//! local minima has no values if a parameter is not identifiable.

use crate::code::Code;
use crate::error::Error;
use crate::fit::measurement::experiment::{Experiment, all};
use crate::fit::report::overlay_run::image_overlays;
use crate::fit::report::plot_data::PlotData;
use crate::fit::report::recorded_motion::recording_plots;
use crate::fit::report::replay::{add_motion, static_plots};
use crate::fit::search::Search;
use crate::fit::search::fitted::Fitted;
use crate::fit::search::journal::SearchStage;
use crate::fit::search::local_minima::LocalMinima;
use crate::fit::search::optimum::Optimum;
use crate::fit::uncertainty::assessment::FitAssessment;
use crate::fit::uncertainty::estimate::Estimate;
use crate::fit::uncertainty::grade::{Conclusion, FitEnd, Grade};
use crate::fit::uncertainty::noise::residual_noise::residual_rms;
use crate::fit::uncertainty::resampling::cluster_jackknife::compares_experiments;
use crate::fit::uncertainty::warning_list::{ReportedWarnings, Severity};

/// The content of a report: how the fit ended, and its results.
pub(crate) struct FitOutcome {
    pub converged: bool,
    pub interrupted: bool,
    pub assessment: FitAssessment,
    pub conclusion: Conclusion,
    pub local_minima: LocalMinima,
    pub plot_data: Option<PlotData>,
}

impl FitOutcome {
    /// The outcome of an assessed optimum, with its grade, warnings and local minima. `experiments` include the
    /// validation data. With `keeps_plots` it has the data of plots, which need further simulations. If one fails,
    /// there is a note and no shapes, or no pictures. The fit counts as interrupted if the stop flag is set by now. The
    /// summary of the local minima has no values if a parameter is not identifiable.
    pub fn assessed(
        Fitted { search, optimum }: Fitted,
        mut assessment: FitAssessment,
        experiments: &[Experiment],
        keeps_plots: bool,
    ) -> Self {
        // Plots may add a warning, so that warnings are concluded last.
        let mut warnings = std::mem::take(&mut assessment.warnings);
        let plot_data = keeps_plots.then(|| {
            let static_plots = static_plots(search, Some(optimum), &assessment.sigma);
            let profiles = std::mem::take(&mut assessment.profiles);
            let recordings = recording_plots(experiments, search, &optimum.x);
            let mut plots = PlotData { profiles, recordings, ..static_plots };
            if let Err(error) = add_motion(search, &optimum.x, &mut plots) {
                let words = format!("no shapes of the rod: {error}");
                warnings.add(Severity::Note, Code::NoShapes, words);
            }
            match image_overlays(search, experiments, &optimum.x) {
                Ok(overlays) => plots.overlays = overlays,
                Err(error) => {
                    let words = format!("no data and model in pictures: {error}");
                    warnings.add(Severity::Note, Code::NoShapes, words);
                }
            }
            plots
        });
        // The stop flag may be set after convergence: the analyses may then be incomplete.
        let interrupted = search.is_stopped();
        let identified = assessment.estimates.iter().all(|e| e.identifiable);
        let end = FitEnd {
            converged: optimum.converged,
            identified,
            interrupted,
            redundant: optimum.residuals.len() > optimum.x.len(),
            exit: &optimum.status,
            compares_experiments: compares_experiments(&assessment.estimates),
        };
        let findings = assessment.covariance.as_ref().map_or(&[][..], |c| &c.findings);
        // Values along an undetermined combination are arbitrary and are left out of the summary.
        let local_minima = search.local_minima(Some(optimum));
        Self {
            converged: optimum.converged,
            interrupted,
            conclusion: Conclusion::new(end, findings, warnings),
            local_minima: if identified { local_minima } else { local_minima.without_values() },
            plot_data,
            assessment,
        }
    }

    /// The outcome of a search that the user stopped: the best values so far, without errors, the noise estimated at
    /// them, and the grade `interrupted`. Plots have series only if that point is of the whole records.
    /// [`Error::Interrupted`] if nothing was simulated yet.
    pub fn unfinished(search: &Search, keeps_plots: bool) -> Result<Self, Error> {
        // The last points may be those of a search with other sigmas, as on a finer mesh.
        search.journal.reweight(&search.sigmas);
        let best = search.journal.best().ok_or(Error::Interrupted)?;
        // Only residuals of the whole records can be shown against all data.
        let (stage, is_whole) = (best.stage, best.stage == SearchStage::Full);
        let optimum = Optimum {
            x: best.x,
            cost: best.cost,
            residuals: best.residuals,
            counts: best.counts,
            status: "interrupted".into(),
            ..Optimum::default()
        };
        // Residuals of a part of the records still estimate the noise.
        let sigma = search.estimated_sigmas(&optimum);
        let pairs = search.unknowns.iter().zip(&optimum.x);
        let estimates = pairs.map(|(u, x)| Estimate::without_error(u, Some(u.from_scale(*x))));
        Ok(Self {
            converged: false,
            interrupted: true,
            conclusion: Conclusion {
                grade: Grade::Interrupted,
                verdict: format!(
                    "not a result: these are the best values when the search was stopped ({})",
                    stage.name()
                ),
                status: optimum.status.clone(),
                warnings: Default::default(),
            },
            local_minima: search.local_minima(None),
            plot_data: keeps_plots
                .then(|| static_plots(search, is_whole.then_some(&optimum), &sigma)),
            assessment: FitAssessment {
                estimates: estimates.collect(),
                residual_rms: residual_rms(Fitted { search, optimum: &optimum }),
                sigma,
                ..FitAssessment::default()
            },
        })
    }

    /// The outcome of recordings that cannot be fitted for a `reason`, as without motion. The grade is unusable,
    /// parameters have no values, and the only warning is the reason with the code `NoMotion`. The sigmas are the sizes
    /// of the observed motions, and the RMS residual is the largest of them. Local minima and series of plots are
    /// empty.
    pub fn unsearched(search: &Search, reason: &str, keeps_plots: bool) -> Self {
        let sizes: Vec<f64> = all(search.experiments).map(|(e, m)| m.size(&e.problem)).collect();
        let estimates = search.unknowns.iter().map(|u| Estimate::without_error(u, None));
        Self {
            converged: false,
            interrupted: false,
            conclusion: Conclusion {
                grade: Grade::NotUsable,
                status: format!("unusable: {reason}"),
                verdict: reason.into(),
                warnings: ReportedWarnings {
                    texts: vec![Code::NoMotion.behind(reason)],
                    codes: vec![Code::NoMotion],
                },
            },
            local_minima: search.local_minima(None),
            plot_data: keeps_plots.then(|| static_plots(search, None, &search.sigmas)),
            assessment: FitAssessment {
                estimates: estimates.collect(),
                residual_rms: sizes.iter().copied().fold(0.0, f64::max),
                sigma: sizes,
                ..FitAssessment::default()
            },
        }
    }
}
