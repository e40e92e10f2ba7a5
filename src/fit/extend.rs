//! Extension of a fit by effects that its model omits, and the choice among extended fits (`rodfit fit --extend`).
//!
//! Input: a fit and its report with score tests (Rao's test of each omitted effect). [`FitFile::extensions`] returns
//! copies of the fit, each with one significant effect added as a further unknown, in the order of the tests. After
//! friction, mass damping or drag comes a copy with internal damping, which has a similar effect and needs no test of
//! its own. All copies together are at most [`MOST_TERMS`]. Effects that are unknowns already, or that no scene can
//! have, are skipped.
//!
//! The caller solves the copies. [`FitReport::improves_on`] accepts one that converged without interruption, has no
//! worse grade than the first fit, and passes the likelihood-ratio test. Twice its log-likelihood must be higher by
//! more than [`SIGNIFICANT_RISE`]; this is not required if the first fit did not converge.
//!
//! [`FitReport::among_alternatives`] compares the best extended fit with the others. Another one is an alternative if
//! twice its log-likelihood is lower by at most [`DISCRIMINATING_RISE`]. If one of its values is outside the best
//! fit's 95 % interval of that parameter, a warning is added. The grade becomes correlated-or-missing, unless it is
//! worse already. [`FitReport::not_extended`] adds a warning that no extension was accepted.

use crate::code::Code;
use crate::error::Error;
use crate::fit::file::FitFile;
use crate::fit::measurement::experiment::all;
use crate::fit::report::FitReport;
use crate::fit::uncertainty::discrepancy::rod_sizes::RodSizes;
use crate::fit::uncertainty::discrepancy::tested_effects::add_effect;
use crate::fit::uncertainty::estimate::Estimate;
use crate::fit::uncertainty::grade::Grade;
use crate::fit::unknown::Unknown;
use crate::scene::Parameter;

/// Start of a positive number, over its value in the scene, where its estimate is not positive.
const SMALL_START: f64 = 0.1;
/// Largest number of extensions that are tried, each a complete fit. Three of them often have similar effects, as a
/// tilted clamp, a tilted camera and a curved rest shape.
const MOST_TERMS: usize = 6;
/// Smallest significant rise of twice the log-likelihood by a further parameter: two standard deviations, as the rise
/// is chi-squared distributed with one degree of freedom (Wilks).
const SIGNIFICANT_RISE: f64 = 4.0;
/// Twice the logarithm of a likelihood ratio of 100, above which the data discriminate between two terms.
const DISCRIMINATING_RISE: f64 = 9.2;
/// Pairs of terms with similar effects on the motion. Far from the optimum a score test may find the second instead of
/// the first, which is tried after it. All of these are losses of energy.
const SIMILAR_TERMS: [[&str; 2]; 4] = [
    ["loads.damping.stiffness", "loads.damping.friction.stiffness"],
    ["loads.damping.stiffness", "loads.damping.mass"],
    ["loads.damping.stiffness", "loads.drag.linear_normal"],
    ["loads.damping.stiffness", "loads.drag.quadratic_normal"],
];

/// A fit with one omitted effect more than another, as a further unknown.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct ExtendedFit {
    /// The fit.
    pub file: FitFile,
    /// Description of the term.
    pub term: String,
}

impl FitFile {
    /// The fit with the most likely omitted effect, by the score tests of its `report`, as a further unknown: the first
    /// of [`extensions`](Self::extensions). `None` if that is empty.
    ///
    /// # Errors
    ///
    /// Scenes that cannot have the values of the report.
    pub fn extended(&self, report: &FitReport) -> Result<Option<Self>, Error> {
        Ok(self.extensions(report)?.into_iter().next().map(|extended| extended.file))
    }

    /// Fits with one likely omitted effect each as a further unknown, by the significant score tests of the `report` of
    /// this fit; at most six, the most likely first. Friction, mass damping or drag is followed by internal damping,
    /// whose motion is similar. Effects that are unknowns already, or that no scene can have, are skipped.
    /// Empty without more values than unknowns after such an extension.
    ///
    /// # Errors
    ///
    /// Scenes that cannot have the values of the report.
    pub fn extensions(&self, report: &FitReport) -> Result<Vec<ExtendedFit>, Error> {
        // With a further unknown there must be more values than unknowns: else any effect explains all.
        let values: usize = all(&self.experiments).map(|(_, m)| m.values()).sum();
        if values <= self.unknowns.len() + 1 {
            return Ok(Vec::new());
        }
        // Significant score tests in the order of their rank, each followed by terms with similar effects.
        let mut tried: Vec<&str> = Vec::new();
        let mut found = Vec::new();
        for test in report.score_tests.iter().filter(|test| test.is_significant()) {
            let own = [(&test.source[..], test.to_string(), Some(test.estimate))];
            let similar = SIMILAR_TERMS.iter().filter(|[_, other]| *other == test.source);
            let similar = similar.map(|[place, _]| {
                (*place, format!("{place}, whose motion resembles {}", test.effect), None)
            });
            for (place, term, estimate) in own.into_iter().chain(similar) {
                // Several tests may suggest the same similar term, which is added once.
                let parameter = Parameter::at(place);
                let is_new = !tried.contains(&place)
                    && self.unknowns.iter().all(|u| u.parameter != parameter);
                if is_new
                    && found.len() < MOST_TERMS
                    && let Some(file) = self.with_term(parameter, estimate, report)?
                {
                    tried.push(place);
                    found.push(ExtendedFit { file, term });
                }
            }
        }
        Ok(found)
    }

    /// The fit with the effect of the number `parameter` added to all scenes that can have it, and whose number is that
    /// of the first one, as a further unknown of these experiments. The unknown starts at the value of the first such
    /// scene plus `estimate`, or else plus the plausible size of the effect. The start is in the parameter's unit,
    /// within its limits. The unknown belongs to all experiments if all scenes can have the effect, else to those by
    /// name. `None` if no scene can have the effect. An error if a scene cannot have the values of the `report`.
    fn with_term(
        &self,
        parameter: Parameter,
        estimate: Option<f64>,
        report: &FitReport,
    ) -> Result<Option<Self>, Error> {
        let mut file = self.clone();
        let (mut names, mut start, mut first) = (Vec::new(), None, None);
        for experiment in &mut file.experiments {
            // The plausible size depends on the rod's size at the estimates.
            let problem = experiment.problem.with(report.parameters_of(experiment))?;
            let sizes = RodSizes::new(experiment, &problem);
            // One unknown has one value: experiments with another value of the number keep it.
            let stated = parameter.of(experiment.problem.scene());
            if first.is_some_and(|first| first != stated) {
                continue;
            }
            if let Some(plausible) = add_effect(parameter.path(), experiment, &sizes) {
                // The scene may have a part of the effect: the score test estimates the change from it.
                let value = parameter.of(experiment.problem.scene()).unwrap_or(0.0);
                let size = estimate.unwrap_or(plausible);
                // An estimate below zero of a positive number is one of a smaller number.
                let sum = value + size;
                let is_beyond = parameter.is_positive() && value > 0.0 && sum <= 0.0;
                start.get_or_insert(if is_beyond { SMALL_START * value } else { sum });
                names.push(experiment.name.clone());
                first = Some(stated);
            }
        }
        if names.is_empty() {
            return Ok(None);
        }
        // A term that only some scenes can have belongs to these experiments.
        let [least, most] = parameter.limits();
        let mut unknown = Unknown::new(parameter);
        unknown.start = start.map(|start| start.clamp(least, most));
        if names.len() < file.experiments.len() {
            unknown.experiments = names;
        }
        file.unknowns.push(unknown);
        Ok(Some(file))
    }
}

impl FitReport {
    /// The report with a further warning that no extension improved the fit, with the descriptions of the `terms` that
    /// were tried. It is the last warning; grade, verdict and values stay.
    pub fn not_extended(mut self, terms: &[String]) -> Self {
        let words = format!(
            "No extension improves this fit. These terms were tried: {}. The values are those without them",
            terms.join("; ")
        );
        self.warnings.push(Code::NotExtended.behind(words));
        self.warning_codes.push(Code::NotExtended);
        self
    }

    /// Whether this fit, with one more parameter than `first`, is better: it converged without interruption and its
    /// grade is no worse. Twice its log-likelihood must also be higher by more than 4, two standard deviations, unless
    /// `first` did not converge.
    pub fn improves_on(&self, first: &Self) -> bool {
        self.converged
            && !self.interrupted
            && self.grade <= first.grade
            && (self.likelihood_rise(first) > SIGNIFICANT_RISE || !first.converged)
    }

    /// Twice the logarithm of the likelihood ratio of this fit to `other`, of the same data, for white Gaussian noise
    /// of unknown size. It is `2 n ln(rms_other / rms)`, with `n` the number of values in the residual tests, at least
    /// 1.
    fn likelihood_rise(&self, other: &Self) -> f64 {
        // At the maximum-likelihood size of the noise, -2 ln L is n ln(rms^2) and a constant.
        let values: f64 = self.residual_tests.iter().map(|tests| tests.values as f64).sum();
        // Two fits of exact data are equally likely.
        if other.residual_rms == self.residual_rms {
            return 0.0;
        }
        values.max(1.0) * 2.0 * (other.residual_rms / self.residual_rms).ln()
    }

    /// The report of this fit, the best of several extended fits, with warnings about alternatives. `others` are the
    /// other extended fits, each with the description of its effect. An alternative is one whose twice log-likelihood
    /// is lower by at most 9.2 (a likelihood ratio of 100), and which has a value outside this fit's 95 % interval. For
    /// each alternative a warning with both values of the parameter that is farthest outside is put before all others,
    /// so that the last alternative is first. A grade better than correlated-or-missing becomes that grade, with the
    /// text about the first alternative as the verdict.
    pub fn among_alternatives(mut self, others: &[(String, Self)]) -> Self {
        let mut listed = 0;
        for (term, other) in others {
            if self.likelihood_rise(other) > DISCRIMINATING_RISE {
                continue;
            }
            let Some((own, value)) = self.largest_contradiction(other) else { continue };
            let (name, unit) = (&own.name, own.name.unit());
            let words = format!(
                "{term} explains the residuals as well, with {name} = {value:.4e} {unit} instead of {:.4e} {unit}. The \
                 data do not show which effect is present. Measure one of the two",
                own.value.unwrap_or(f64::NAN),
            );
            // The grade is lowered once; the warning comes first, because it concerns the model.
            if self.grade < Grade::CorrelatedOrMissing {
                self.grade = Grade::CorrelatedOrMissing;
                self.verdict = words.clone();
            }
            self.warnings.insert(listed, Code::AlternativeTerm.behind(words));
            self.warning_codes.insert(listed, Code::AlternativeTerm);
            listed += 1;
        }
        self
    }

    /// The estimate whose 95 % interval is farthest from the `other` fit's value of the same parameter of the same
    /// experiments, in widths of the interval, with that value. `None` if all intervals contain the other values;
    /// estimates without an interval are skipped.
    fn largest_contradiction(&self, other: &Self) -> Option<(&Estimate, f64)> {
        let pairs = self.parameters.iter().filter_map(|own| {
            let is_same = |p: &&Estimate| p.name == own.name && p.experiments == own.experiments;
            let value = other.parameters.iter().find(is_same)?.value?;
            let [low, high] = own.interval95?;
            // Distances in widths of the interval are comparable between parameters of any unit.
            let outside = (low - value).max(value - high);
            (outside > 0.0).then_some((own, value, outside / (high - low)))
        });
        pairs.max_by(|a, b| a.2.total_cmp(&b.2)).map(|(own, value, _)| (own, value))
    }
}
