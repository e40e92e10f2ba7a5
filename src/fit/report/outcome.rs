//! The ways in which a fit ends.

use crate::code::Code;
use crate::error::Error;
use crate::fit::measurement::experiment::{Experiment, all};
use crate::fit::report::plot_data::PlotData;
use crate::fit::report::recorded_motion::recorded;
use crate::fit::report::replay::{add_motion, still};
use crate::fit::search::Search;
use crate::fit::search::fitted::Fitted;
use crate::fit::search::journal::Stage;
use crate::fit::search::local_minima::LocalMinima;
use crate::fit::search::optimum::Optimum;
use crate::fit::uncertainty::assessment::FitAssessment;
use crate::fit::uncertainty::estimate::Estimate;
use crate::fit::uncertainty::grade::{Conclusion, FitEnd, Grade};
use crate::fit::uncertainty::noise::residual_noise::residual_rms;
use crate::fit::uncertainty::resampling::cluster_jackknife::compares_experiments;
use crate::fit::uncertainty::warning_list::{ReportedWarnings, Severity};

/// All that a report says of a result.
pub(crate) struct FitOutcome {
    pub converged: bool,
    pub interrupted: bool,
    pub assessment: FitAssessment,
    pub conclusion: Conclusion,
    pub local_minima: LocalMinima,
    pub plot_data: Option<PlotData>,
}

impl FitOutcome {
    /// With an optimum and what it is worth; `kept` says whether plots are wanted. `experiments` have what was
    /// held out too.
    pub fn assessed(
        Fitted { search, optimum }: Fitted,
        mut assessment: FitAssessment,
        experiments: &[Experiment],
        kept: bool,
    ) -> Self {
        let mut warnings = std::mem::take(&mut assessment.warnings);
        let plot_data = kept.then(|| {
            let still = still(search, Some(optimum), &assessment.sigma);
            let profiles = std::mem::take(&mut assessment.profiles);
            let recordings = recorded(experiments, search, &optimum.x);
            let mut plots = PlotData { profiles, recordings, ..still };
            if let Err(error) = add_motion(search, &optimum.x, &mut plots) {
                let words = format!("no shapes of the rod: {error}");
                warnings.add(Severity::Note, Code::NoShapes, words);
            }
            plots
        });
        let interrupted = search.is_stopped();
        let end = FitEnd {
            converged: optimum.converged,
            identified: assessment.estimates.iter().all(|e| e.identifiable),
            interrupted,
            exit: &optimum.status,
            compares_experiments: compares_experiments(&assessment.estimates),
        };
        let findings = assessment.covariance.as_ref().map_or(&[][..], |c| &c.findings);
        Self {
            converged: optimum.converged,
            interrupted,
            conclusion: Conclusion::new(end, findings, warnings),
            local_minima: search.local_minima(Some(optimum)),
            plot_data,
            assessment,
        }
    }

    /// Told to stop on the way: the best values so far, without errors; an error where there are none.
    pub fn unfinished(search: &Search, kept: bool) -> Result<Self, Error> {
        let best = search.journal.best().ok_or(Error::Interrupted)?;
        let (stage, whole) = (best.stage, best.stage == Stage::Full);
        let optimum = Optimum {
            x: best.x,
            cost: best.cost,
            residuals: best.residuals,
            jacobian: Vec::new(),
            counts: best.counts,
            converged: false,
            status: "interrupted".into(),
            halved: false,
        };
        let sigma = search.estimated_sigmas(&optimum);
        let known = search.unknowns.iter().zip(&optimum.x);
        let estimates = known.map(|(u, x)| Estimate::without_error(u, Some(u.from_scale(*x))));
        Ok(Self {
            converged: false,
            interrupted: true,
            conclusion: Conclusion {
                grade: Grade::Interrupted,
                verdict: format!(
                    "do not believe this: these are the best values when the search was stopped ({})",
                    stage.name()
                ),
                status: optimum.status.clone(),
                warnings: Default::default(),
            },
            local_minima: search.local_minima(None),
            plot_data: kept.then(|| still(search, whole.then_some(&optimum), &sigma)),
            assessment: FitAssessment {
                estimates: estimates.collect(),
                residual_rms: residual_rms(Fitted { search, optimum: &optimum }),
                sigma,
                ..FitAssessment::default()
            },
        })
    }

    /// Of recordings that a search would be wasted on, as `words` say: what is left is all that moves in
    /// them.
    pub fn unsearched(search: &Search, words: &str, kept: bool) -> Self {
        let left: Vec<f64> = all(search.experiments).map(|(e, m)| m.size(&e.problem)).collect();
        let estimates = search.unknowns.iter().map(|u| Estimate::without_error(u, None));
        Self {
            converged: false,
            interrupted: false,
            conclusion: Conclusion {
                grade: Grade::NotUsable,
                status: format!("unusable: {words}"),
                verdict: words.into(),
                warnings: ReportedWarnings {
                    texts: vec![Code::NoMotion.behind(words)],
                    codes: vec![Code::NoMotion],
                },
            },
            local_minima: search.local_minima(None),
            plot_data: kept.then(|| still(search, None, &search.sigmas)),
            assessment: FitAssessment {
                estimates: estimates.collect(),
                residual_rms: left.iter().copied().fold(0.0, f64::max),
                sigma: left,
                ..FitAssessment::default()
            },
        }
    }
}
