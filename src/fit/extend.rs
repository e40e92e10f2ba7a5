//! Fits again, with what the score tests of the first one name.

use crate::code::Code;
use crate::error::Error;
use crate::fit::file::FitFile;
use crate::fit::report::FitReport;
use crate::fit::uncertainty::discrepancy::omitted_effects::{OMITTED_EFFECTS, OmittedEffect};
use crate::fit::uncertainty::discrepancy::rod_sizes::RodSizes;
use crate::fit::uncertainty::estimate::Estimate;
use crate::fit::uncertainty::grade::Grade;
use crate::fit::unknown::Unknown;

/// Terms that are tried at most: three of them often resemble each other, as a tilted clamp, a tilted camera and a curved rest
/// shape do.
const MOST_TERMS: usize = 6;
/// Rise of twice the logarithm of the likelihood by which a further parameter explains more than noise does: two
/// standard deviations.
const EXPLAINS_MORE: f64 = 4.0;
/// Twice the logarithm of a likelihood ratio of 100: below it the data do not decide between two terms.
const DECIDES: f64 = 9.2;
/// Terms whose motions resemble each other, so that far from the truth the score tests may name one for the other: the
/// first is tried behind the second. All of these are losses of energy.
const RESEMBLING: [[&str; 2]; 4] = [
    ["loads.damping.stiffness", "loads.damping.friction.stiffness"],
    ["loads.damping.stiffness", "loads.damping.mass"],
    ["loads.damping.stiffness", "loads.drag.linear_normal"],
    ["loads.damping.stiffness", "loads.drag.quadratic_normal"],
];

/// A fit with one more term than another.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct ExtendedFit {
    /// The fit.
    pub file: FitFile,
    /// The term, in words.
    pub term: String,
}

impl FitFile {
    /// The fit with the term that explains best what its `report` left, or with the number that is most likely off;
    /// none where noise explains it.
    ///
    /// # Errors
    ///
    /// Scenes that cannot have the values of the report.
    pub fn extended(&self, report: &FitReport) -> Result<Option<Self>, Error> {
        Ok(self.extensions(report)?.into_iter().next().map(|extended| extended.file))
    }

    /// The fits with one of the terms each that may explain what its `report` left, at most six, the most likely
    /// first.
    ///
    /// # Errors
    ///
    /// Scenes that cannot have the values of the report.
    pub fn extensions(&self, report: &FitReport) -> Result<Vec<ExtendedFit>, Error> {
        let mut tried: Vec<&str> = Vec::new();
        let mut found = Vec::new();
        for test in report.score_tests.iter().filter(|test| test.is_significant()) {
            let own = [(&test.source[..], test.to_string(), Some(test.estimate))];
            let alike = RESEMBLING.iter().filter(|[_, other]| *other == test.source);
            let alike = alike.map(|[place, _]| {
                (*place, format!("{place}, whose motion resembles {}", test.effect), None)
            });
            for (place, term, estimate) in own.into_iter().chain(alike) {
                let Some(extension) = OMITTED_EFFECTS.iter().find(|e| e.path == place) else {
                    continue;
                };
                let is_new = !tried.contains(&extension.path)
                    && self.unknowns.iter().all(|u| u.parameter != extension.parameter());
                if is_new
                    && found.len() < MOST_TERMS
                    && let Some(file) = self.with_term(extension, estimate, report)?
                {
                    tried.push(extension.path);
                    found.push(ExtendedFit { file, term });
                }
            }
        }
        Ok(found)
    }

    /// The fit with a term, which starts at its `estimate` or else at its plausible size; none where no scene can have
    /// it.
    fn with_term(
        &self,
        extension: &OmittedEffect,
        estimate: Option<f64>,
        report: &FitReport,
    ) -> Result<Option<Self>, Error> {
        let (mut file, parameter) = (self.clone(), extension.parameter());
        let (mut names, mut start) = (Vec::new(), None);
        for experiment in &mut file.experiments {
            let problem = experiment.problem.with(report.parameters_of(experiment))?;
            let sizes = RodSizes::new(experiment, &problem);
            if let Some(problem) = extension.added(&experiment.problem, &sizes) {
                let there = parameter.of(problem.scene()).unwrap_or(0.0);
                let size = estimate.or((extension.plausible)(&sizes)).unwrap_or(0.0);
                start.get_or_insert(there + size);
                names.push(experiment.name.clone());
                experiment.problem = problem;
            }
        }
        if names.is_empty() {
            return Ok(None);
        }
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
    /// The report with a warning that none of these `terms` made the fit better.
    pub fn not_extended(mut self, terms: &[String]) -> Self {
        let words = format!(
            "No extension improves this fit. These terms were tried: {}. The values are those without them",
            terms.join("; ")
        );
        self.warnings.push(Code::NotExtended.behind(words));
        self.warning_codes.push(Code::NotExtended);
        self
    }

    /// Whether this fit is better than the one without its last parameter: it converged, its grade is no worse, and it
    /// explains more than a further parameter explains of noise.
    pub fn improves_on(&self, first: &Self) -> bool {
        self.converged
            && !self.interrupted
            && self.grade <= first.grade
            && (self.explains_more_than(first) > EXPLAINS_MORE || !first.converged)
    }

    /// Twice the logarithm of the likelihood ratio of this fit and another one of the same data, for white noise.
    fn explains_more_than(&self, other: &Self) -> f64 {
        let values: f64 = self.residual_tests.iter().map(|tests| tests.values as f64).sum();
        values.max(1.0) * 2.0 * (other.residual_rms / self.residual_rms).ln()
    }

    /// This fit with one more term, as the `best` of several that were tried. Where one of the `others`, named with
    /// its term, explains the data as well and gives a parameter another value, a warning names both values and the
    /// grade has a reservation: the data do not show which effect the rod has.
    pub fn among_alternatives(mut self, others: &[(String, Self)]) -> Self {
        for (term, other) in others {
            if self.explains_more_than(other) > DECIDES {
                continue;
            }
            let Some((own, value)) = self.contradicted_by(other) else { continue };
            let (name, unit) = (&own.name, own.name.unit());
            let words = format!(
                "{term} explains the residuals as well, with {name} = {value:.4e} {unit} instead of {:.4e} {unit}. The \
                 data do not show which effect is present. Measure one of the two",
                own.value.unwrap_or(f64::NAN),
            );
            if self.grade < Grade::CorrelatedOrMissing {
                self.grade = Grade::CorrelatedOrMissing;
                self.verdict = words.clone();
            }
            self.warnings.insert(0, Code::AlternativeTerm.behind(words));
            self.warning_codes.insert(0, Code::AlternativeTerm);
        }
        self
    }

    /// The parameter whose interval excludes most clearly the value that another fit found, with that value.
    fn contradicted_by(&self, other: &Self) -> Option<(&Estimate, f64)> {
        let distance = |own: &Estimate, value: f64| {
            let [low, high] = own.interval95?;
            let outside = (low - value).max(value - high);
            (outside > 0.0).then_some(outside / (high - low))
        };
        let pairs = self.parameters.iter().filter_map(|own| {
            let same = other.parameters.iter().find(|p| p.name == own.name)?;
            let value = same.value?;
            Some((own, value, distance(own, value)?))
        });
        pairs.max_by(|a, b| a.2.total_cmp(&b.2)).map(|(own, value, _)| (own, value))
    }
}
