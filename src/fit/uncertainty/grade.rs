//! The grade of a result, and the warnings that determine it.

use crate::code::Code;
use crate::fit::uncertainty::covariance::identifiability::{
    UnidentifiableDirection, in_one_sentence,
};
use serde::{Deserialize, Serialize};
use std::cmp::Reverse;
use std::fmt;

/// Grade of a result, the best first; in JSON in kebab case, as `refine-numerics`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Grade {
    /// No problem detected.
    Trustworthy,
    /// Discretization too coarse: the discretization error may exceed the intervals.
    RefineNumerics,
    /// Correlated noise or a missing effect: the data do not separate the two, and a missing effect
    /// would bias the estimates.
    CorrelatedOrMissing,
    /// Model inadequate: the residuals are not noise, and the intervals may be too narrow.
    ModelDoesNotExplain,
    /// The data do not determine all requested parameters.
    NotIdentifiable,
    /// The fit was stopped before convergence.
    Interrupted,
    /// Unusable: the fit did not converge, or the data show no motion of this rod.
    NotUsable,
}

impl Grade {
    /// Its name in JSON, by which it is explained.
    pub fn code(self) -> Code {
        match self {
            Self::Trustworthy => Code::Trustworthy,
            Self::RefineNumerics => Code::RefineNumerics,
            Self::CorrelatedOrMissing => Code::CorrelatedOrMissing,
            Self::ModelDoesNotExplain => Code::ModelDoesNotExplain,
            Self::NotIdentifiable => Code::NotIdentifiable,
            Self::Interrupted => Code::Interrupted,
            Self::NotUsable => Code::NotUsable,
        }
    }

    /// Whether the values can be used, with the warnings that are named beside them.
    pub fn is_usable(self) -> bool {
        match self {
            Self::Trustworthy
            | Self::RefineNumerics
            | Self::CorrelatedOrMissing
            | Self::ModelDoesNotExplain => true,
            Self::NotIdentifiable | Self::Interrupted | Self::NotUsable => false,
        }
    }
}

impl fmt::Display for Grade {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Trustworthy => "no problem detected",
            Self::RefineNumerics => "discretization too coarse",
            Self::CorrelatedOrMissing => "correlated noise or a missing effect",
            Self::ModelDoesNotExplain => "model inadequate",
            Self::NotIdentifiable => "not identifiable",
            Self::Interrupted => "interrupted",
            Self::NotUsable => "unusable",
        })
    }
}

/// Severity of a warning, the most severe first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Severity {
    /// The values mean nothing.
    Worthless,
    /// Before the search something looked wrong that explains what is left.
    Suspicion,
    /// Mesh and step are to blame for what is left.
    Mesh,
    /// Much of what was measured is left.
    Unexplained,
    /// The model leaves out an effect that shifts a value by more than its standard error.
    Validity,
    /// What is left is no noise.
    Misfit,
    /// A bound, a prior or held-out data contradict the result.
    Contradiction,
    /// Autocorrelated noise or a missing effect: the data do not separate the two.
    Ambiguous,
    /// Mesh and step may be off by more than the intervals say.
    Numerics,
    /// Good to know, and no reason to doubt.
    Note,
}

/// The warnings of a result.
#[derive(Clone, Debug, Default)]
pub(crate) struct Warnings(Vec<Warning>);

#[derive(Clone, Debug)]
struct Warning {
    severity: Severity,
    code: Code,
    words: String,
    /// Of what many observations may have alike: which it is, and whose it is here.
    alike: Option<(&'static str, String)>,
    /// Whether the finding changes the estimates by less than their standard errors.
    is_minor: bool,
}

/// Verdict on residuals with a small effect only.
const MINOR: &str = "an effect is missing in the model, which changes the estimates by less than their standard errors. Add it \
                     to the scene, or fit it (--extend)";
/// From so many warnings of one kind on, one line has the first of them and the number of the others.
const SUMMARIZED: usize = 3;
/// Experiments with their counts in a summary, those with the most warnings first.
const NAMED: usize = 5;

/// The kind of warnings that several observations may have, as a plural.
fn kind(severity: Severity, code: Code) -> &'static str {
    match code {
        Code::OutlyingExperiment => "that stand out",
        Code::LargeResiduals => "with large residuals",
        Code::BeyondSigma => "with residuals beyond the stated sigma",
        Code::ResidualsNotWhite => "coordinates whose residuals are not white noise",
        Code::Outliers if severity == Severity::Note => "coordinates with possible outliers",
        Code::Outliers => "coordinates with outliers",
        Code::ExceedsNoiseScale => "coordinates with residuals beyond their noise scale",
        Code::UnresolvedCorrelation => "coordinates with unresolved correlation",
        Code::ConstantAxis => "coordinates with one value only",
        Code::RepeatedFrames => "observations with repeated frames",
        Code::SigmaDoubtful => "observations with a doubtful sigma",
        Code::PredictionFailed => "whose validation data could not be predicted",
        Code::LargePredictionError => "validation data with larger errors than expected",
        Code::LostFrames => "gaps of lost frames",
        Code::Glitches => "markers that jump",
        Code::SwappedLabels => "exchanges of labels",
        _ => "warnings of simulations",
    }
}

impl Warnings {
    pub fn add(&mut self, severity: Severity, code: Code, words: impl Into<String>) {
        self.0.push(Warning { severity, code, words: words.into(), alike: None, is_minor: false });
    }

    /// Adds a warning of a finding that changes the estimates by less than their standard errors. It stands behind all others.
    pub fn add_minor(&mut self, severity: Severity, code: Code, words: String) {
        self.0.push(Warning { severity, code, words, alike: None, is_minor: true });
    }

    /// Adds a warning that other observations may have as well, of an experiment.
    pub fn add_alike(&mut self, severity: Severity, code: Code, experiment: &str, words: String) {
        let alike = Some((kind(severity, code), experiment.into()));
        self.0.push(Warning { severity, code, words, alike, is_minor: false });
    }

    /// Adds all of others.
    pub fn append(&mut self, mut others: Self) {
        self.0.append(&mut others.0);
    }

    /// The first warning of this severity.
    pub fn first(&self, severity: Severity) -> Option<&str> {
        self.0.iter().find(|w| w.severity == severity).map(|w| w.words.as_str())
    }

    /// Whether what is left of the data is no noise.
    pub fn has_misfit(&self) -> bool {
        let misfits = [Severity::Unexplained, Severity::Misfit, Severity::Ambiguous];
        misfits.iter().any(|w| self.first(*w).is_some())
    }

    /// What is left is no noise, and no fault of the model either, as `words` say.
    pub fn downgrade_misfit(&mut self, code: Code, words: &str) {
        if self.has_misfit() {
            self.0.retain(|w| ![Severity::Misfit, Severity::Ambiguous].contains(&w.severity));
            self.add(Severity::Note, code, words);
        }
    }

    /// Replaces the warnings of autocorrelated noise or a missing effect by a note.
    pub fn downgrade_ambiguity(&mut self, code: Code, words: &str) {
        let before = self.0.len();
        self.0.retain(|w| w.severity != Severity::Ambiguous);
        if self.0.len() < before {
            self.add(Severity::Note, code, words);
        }
    }

    /// Whether all warnings of noise or a missing effect are minor ones.
    fn are_minor(&self) -> bool {
        let severities = [Severity::Misfit, Severity::Ambiguous];
        let mut own = self.0.iter().filter(|w| severities.contains(&w.severity)).peekable();
        own.peek().is_some() && own.all(|w| w.is_minor)
    }

    /// Whether the first warning of noise or a missing effect is one of outliers.
    fn begins_with_outliers(&self) -> bool {
        let first = self.0.iter().find(|w| w.severity == Severity::Ambiguous);
        first.is_some_and(|w| w.code == Code::Outliers)
    }

    /// Of a minimum that determines all parameters.
    pub fn grade(&self) -> Grade {
        match self.0.iter().map(|w| w.severity).min() {
            Some(Severity::Worthless) => Grade::NotUsable,
            Some(Severity::Mesh | Severity::Numerics) => Grade::RefineNumerics,
            Some(
                Severity::Suspicion
                | Severity::Unexplained
                | Severity::Validity
                | Severity::Misfit
                | Severity::Contradiction,
            ) => Grade::ModelDoesNotExplain,
            Some(Severity::Ambiguous) => Grade::CorrelatedOrMissing,
            Some(Severity::Note) | None => Grade::Trustworthy,
        }
    }

    /// The texts with their codes, the most severe first; of many alike some, and of which experiments the others are.
    pub fn into_words(mut self) -> (Vec<String>, Vec<Code>) {
        self.0.sort_by_key(|w| (w.is_minor, w.severity));
        let kind = |w: &Warning| Some((w.severity, w.alike.as_ref()?.0));
        let (mut words, mut codes) = (Vec::new(), Vec::new());
        let mut say = |code: Code, said: &dyn fmt::Display| {
            words.push(code.behind(said));
            codes.push(code);
        };
        let mut summed = Vec::new();
        for warning in &self.0 {
            let Some(own) = kind(warning) else {
                say(warning.code, &warning.words);
                continue;
            };
            let all: Vec<&Warning> = self.0.iter().filter(|w| kind(w) == Some(own)).collect();
            if all.len() < SUMMARIZED {
                say(warning.code, &warning.words);
            } else if !summed.contains(&own) {
                summed.push(own);
                let others = likewise(own.1, &all[1..]);
                say(warning.code, &format_args!("{}; {others}", warning.words));
            }
        }
        (words, codes)
    }
}

/// How many more there are of a kind, and in which experiments.
fn likewise(kind: &str, others: &[&Warning]) -> String {
    let mut experiments: Vec<(&str, usize)> = Vec::new();
    for (_, experiment) in others.iter().filter_map(|w| w.alike.as_ref()) {
        match experiments.iter_mut().find(|(name, _)| name == experiment) {
            Some((_, count)) => *count += 1,
            None => experiments.push((experiment, 1)),
        }
    }
    experiments.retain(|(name, _)| !name.is_empty());
    experiments.sort_by_key(|(_, count)| Reverse(*count));
    let further = experiments.len().saturating_sub(NAMED);
    let named = experiments.iter().take(NAMED);
    let named: Vec<String> = named.map(|(name, count)| format!("{count} in {name}")).collect();
    let further = if further > 0 { format!(", and in {further} others") } else { String::new() };
    let places = match named.is_empty() {
        true => String::new(),
        false => format!(": {}{further}", named.join(", ")),
    };
    format!("{} more {kind}{places}", others.len())
}

/// How a fit ended that found an optimum.
pub(crate) struct End<'a> {
    /// Whether it is a minimum.
    pub converged: bool,
    /// Whether every parameter is identified.
    pub identified: bool,
    /// Whether it was told to stop before all was done.
    pub interrupted: bool,
    /// How the optimiser ended.
    pub exit: &'a str,
    /// Whether all intervals contain the differences between experiments.
    pub compares_experiments: bool,
}

/// What a report says of its result as a whole.
#[derive(Debug)]
pub(crate) struct Conclusion {
    pub grade: Grade,
    /// In one line how the fit ended.
    pub status: String,
    /// Why this grade.
    pub verdict: String,
    /// The weightiest first, and their codes.
    pub warnings: (Vec<String>, Vec<Code>),
}

/// Grades a result that `findings` and `warnings` speak against.
pub(crate) fn conclude(
    end: End,
    findings: &[UnidentifiableDirection],
    mut warnings: Warnings,
) -> Conclusion {
    let unknown = in_one_sentence(findings);
    let cause = warnings.first(Severity::Suspicion);
    let cause = cause.map_or(String::new(), |words| format!(". Probable cause: {words}"));
    let worthless = warnings.first(Severity::Worthless);
    let worthless = worthless.map_or(String::new(), |words| format!("{words}{cause}"));
    let grade = match (end.converged, end.identified) {
        (false, _) => Grade::NotUsable,
        // Beside a misfit as large as the data nothing is identifiable.
        (true, false) if worthless.is_empty() => Grade::NotIdentifiable,
        (true, true) if end.interrupted => Grade::Interrupted,
        (true, _) => warnings.grade(),
    };
    let (status, verdict) = match grade {
        Grade::Trustworthy => ("converged".into(), "no problem detected".into()),
        Grade::RefineNumerics => {
            let fits = match [Severity::Unexplained, Severity::Misfit].map(|w| warnings.first(w)) {
                [Some(_), _] => "large residuals. Also ",
                [None, Some(_)] => "the residuals are not noise. Also ",
                [None, None] => "",
            };
            let words = format!(
                "{fits}the given element or step size changes the estimates by more than their intervals. Leave \
                 rod.segments and time.step out of the scene, and the program chooses them"
            );
            ("converged".into(), words)
        }
        Grade::CorrelatedOrMissing if warnings.are_minor() => ("converged".into(), MINOR.into()),
        Grade::CorrelatedOrMissing if warnings.begins_with_outliers() => {
            let words = "outliers bias the estimates, or an effect is missing in the model. Use a robust loss \
                         (huber, cauchy) before looking for an effect";
            ("converged".into(), words.into())
        }
        Grade::CorrelatedOrMissing => {
            let words = "the noise is autocorrelated, or an effect is missing in the model and the estimates are \
                         biased by more than their intervals. Record the rod at rest and state its scatter as \
                         sigma, or fit the likely omitted effects (--extend)";
            ("converged".into(), words.into())
        }
        Grade::ModelDoesNotExplain => {
            ("converged".into(), warnings.of_the_model(end.compares_experiments))
        }
        Grade::NotIdentifiable => (
            format!("not identifiable: {unknown}"),
            format!("the data do not determine all parameters{cause}"),
        ),
        Grade::Interrupted => (
            "interrupted after convergence".into(),
            "the fit was stopped at a minimum before all analyses were complete. Run it again for the full report".into(),
        ),
        Grade::NotUsable if end.converged => {
            let mut status = format!("unusable: {worthless}");
            if !end.identified {
                status += &format!("; not identifiable: {unknown}");
            }
            (status, worthless)
        }
        Grade::NotUsable => {
            let exit = end.exit;
            (format!("not converged: {exit}"), format!("the fit did not converge: {exit}"))
        }
    };
    if grade == Grade::NotUsable {
        findings
            .iter()
            .for_each(|f| warnings.add(Severity::Note, f.kind.code(), &f.description[..]));
    }
    Conclusion { grade, status, verdict, warnings: warnings.into_words() }
}

impl Warnings {
    /// Which experiments stand out, if any does.
    fn outlying_experiments(&self) -> Option<String> {
        let own = self.0.iter().filter(|w| w.code == Code::OutlyingExperiment);
        let mut names: Vec<&str> = own.filter_map(|w| Some(w.alike.as_ref()?.1.as_str())).collect();
        names.dedup();
        match names.len() {
            0 => None,
            1 => Some(format!("{} stands out", names[0])),
            _ => Some(format!("{} stand out", names.join(", "))),
        }
    }

    /// What is wrong with the model or its set-up.
    fn of_the_model(&self, compares_experiments: bool) -> String {
        if let Some(words) = self.first(Severity::Suspicion) {
            return format!("large residuals, most likely because of {words}");
        }
        // A bound or a prior that holds a parameter explains the misfit beside it.
        let holds = |w: &&Warning| [Code::AtBound, Code::PriorConflict].contains(&w.code);
        if let Some(held) = self.0.iter().find(holds) {
            return format!("the data contradict a bound or a prior: {}", held.words);
        }
        if self.first(Severity::Unexplained).is_some() {
            return "large residuals. Probable causes: a set-up error (release time, scale, fps, origin, tracked \
                    point, y direction, rod dimensions) or a wrong local minimum. Check the set-up, or give a \
                    start or bounds"
                .into();
        }
        if let Some(words) = self.first(Severity::Validity) {
            // The finding alone: the warning below has the reason and what to do.
            return words.split(". ").next().unwrap_or(words).into();
        }
        if self.are_minor() {
            return MINOR.into();
        }
        if self.first(Severity::Misfit).is_some() {
            // Intervals from the differences between experiments allow for it.
            let narrow = if compares_experiments { "" } else { " and intervals are too narrow" };
            let words = format!(
                "the residuals are not noise, so that estimates may be biased{narrow}. An effect is missing in the scene \
                 (damping, drag, a compliant or tilted clamp, clock or camera), or sigma is too small"
            );
            return match self.outlying_experiments() {
                Some(names) => format!("{names}, most experiments are explained. {words}"),
                None => words,
            };
        }
        "the data contradict a bound, a prior or the validation data".into()
    }
}

/// A part of a whole as a person says it: never hundreds of digits.
pub(crate) fn percent(fraction: f64) -> String {
    match 100.0 * fraction {
        p if p.is_nan() || p > 1000.0 => "more than 1000 %".into(),
        p if p < 0.01 => format!("{p:.0e} %"),
        p if p < 9.5 => format!("{p:.2} %"),
        p => format!("{p:.0} %"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentages_can_be_read() {
        let cases = [
            (1e290, "more than 1000 %"),
            (f64::INFINITY, "more than 1000 %"),
            (f64::NAN, "more than 1000 %"),
            (1.164, "116 %"),
            (0.0213, "2.13 %"),
            (1e-6, "1e-4 %"),
        ];
        for (fraction, words) in cases {
            assert_eq!(percent(fraction), words);
        }
    }

    fn verdict(warnings: Warnings, compares_experiments: bool) -> Conclusion {
        let (converged, identified, interrupted, exit) = (true, true, false, "");
        conclude(
            End { converged, identified, interrupted, exit, compares_experiments },
            &[],
            warnings,
        )
    }

    #[test]
    fn intervals_from_differences_between_experiments_are_not_called_too_narrow() {
        let mut warnings = Warnings::default();
        warnings.add(Severity::Misfit, Code::ResidualsNotWhite, "autocorrelated");
        let narrow = |compares| verdict(warnings.clone(), compares).verdict.contains("too narrow");
        assert_eq!([narrow(false), narrow(true)], [true, false]);
    }

    #[test]
    fn finding_of_a_small_bias_stands_last_and_in_the_verdict() {
        let mut warnings = Warnings::default();
        warnings.add_minor(Severity::Ambiguous, Code::OmittedEffect, "scale".into());
        warnings.add(Severity::Note, Code::MayBeZero, "damping");
        let conclusion = verdict(warnings.clone(), false);
        assert_eq!(conclusion.grade, Grade::CorrelatedOrMissing);
        assert!(conclusion.verdict.contains("less than their standard errors"));
        assert_eq!(conclusion.warnings.1, [Code::MayBeZero, Code::OmittedEffect]);
        warnings.add(Severity::Misfit, Code::ResidualsNotWhite, "autocorrelated");
        let conclusion = verdict(warnings, false);
        assert!(conclusion.verdict.contains("not noise"), "{}", conclusion.verdict);
        assert_eq!(conclusion.warnings.1[0], Code::ResidualsNotWhite);
    }

    #[test]
    fn most_severe_warning_comes_first_and_grades() {
        let graded = |weights: &[Severity]| {
            let mut warnings = Warnings::default();
            weights
                .iter()
                .for_each(|w| warnings.add(*w, Code::ResidualsNotWhite, format!("{w:?}")));
            (warnings.grade(), warnings.into_words().0)
        };
        use Severity::*;
        assert_eq!(graded(&[]), (Grade::Trustworthy, Vec::new()));
        assert_eq!(graded(&[Note]).0, Grade::Trustworthy);
        assert_eq!(graded(&[Note, Numerics]).0, Grade::RefineNumerics);
        let (grade, words) = graded(&[Note, Numerics, Misfit]);
        assert_eq!(
            (grade, &words[0][..]),
            (Grade::ModelDoesNotExplain, "Misfit [residuals-not-white]")
        );
        // What mesh and step explain is not the model's fault.
        let (grade, words) = graded(&[Misfit, Unexplained, Mesh]);
        assert_eq!((grade, &words[0][..]), (Grade::RefineNumerics, "Mesh [residuals-not-white]"));
        assert_eq!(graded(&[Mesh, Worthless]).0, Grade::NotUsable);
    }
}
