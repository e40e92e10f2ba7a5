//! List of the warnings of a result, by severity, with summaries of warnings that many experiments share.
//!
//! [`Warnings`] collects findings, each with a [`Severity`], a code and a text. The worst severity determines the grade
//! of a fit; notes do not affect it. `add` adds a warning that is listed by itself, `add_minor` one of a finding that
//! changes the estimates by less than their standard errors, `add_for` one that other observations may have as well.
//! Later findings may replace earlier ones by a note: if discretization errors explain a misfit, warnings of the
//! severities `Misfit` and `Ambiguous` are removed, but not those of large residuals (`downgrade_misfit`). If they are
//! only visible, those of `Ambiguous` alone are (`downgrade_ambiguity`).
//!
//! [`Warnings::into_report`] sorts the warnings, the most severe first and minor ones last, else in the order of
//! addition, and appends the code to each text. Of warnings of `add_for`, [`SUMMARIZED`] or more of one kind (severity
//! and plural noun) are one line: the first one, and the number of the others by experiment. [`percent`] is the text of
//! a fraction in per cent.

use crate::code::Code;
use std::cmp::Reverse;

/// Number of warnings of one kind from which on one line has the first of them and the number of the others. Larger:
/// longer lists.
const SUMMARIZED: usize = 3;
/// Number of experiments that a summary names with their counts, those with the most warnings first; the rest is
/// counted.
const NAMED: usize = 5;

/// Severity of a warning, the most severe first; the worst one determines the grade.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Severity {
    /// The estimates have no meaning.
    Worthless,
    /// The check before the search found a probable cause of large residuals.
    Suspicion,
    /// Discretization errors are as large as the residuals.
    Mesh,
    /// The residuals are large compared with the observed motion.
    Unexplained,
    /// The model leaves out an effect that biases an estimate by more than its standard error.
    Validity,
    /// The residuals are no noise.
    Misfit,
    /// A bound, a prior or validation data contradict the result.
    Contradiction,
    /// Autocorrelated noise or a missing effect: the data do not separate the two.
    Ambiguous,
    /// The discretization error may exceed the intervals.
    Numerics,
    /// Information without an effect on the grade.
    Note,
}

/// The warnings of a result, in the order of their addition.
#[derive(Clone, Debug, Default)]
pub(crate) struct Warnings(Vec<Warning>);

/// Warnings as a report lists them, the most severe first.
#[derive(Debug, Default)]
pub(crate) struct ReportedWarnings {
    /// Texts, each with its code in brackets.
    pub texts: Vec<String>,
    /// Code of each text, in the same order.
    pub codes: Vec<Code>,
}

/// A finding with its consequence and the action against it.
#[derive(Clone, Debug)]
struct Warning {
    severity: Severity,
    code: Code,
    /// Text without the code: finding, consequence and action.
    text: String,
    /// Name of the experiment of a warning that may be summarized with others of its kind; empty where experiments have
    /// no names. None: a warning that is never summarized.
    experiment: Option<String>,
    /// Whether the finding changes the estimates by less than their standard errors.
    is_minor: bool,
}

impl Warning {
    /// Whether both are of one kind that a summary can count: both were added for an experiment, with the same severity
    /// and the same plural text.
    fn is_like(&self, other: &Self) -> bool {
        self.experiment.is_some()
            && other.experiment.is_some()
            && self.severity == other.severity
            && plural(self.severity, self.code) == plural(other.severity, other.code)
    }
}

/// Plural phrase for a summary after the number of further warnings, such as `coordinates with outliers`, by severity
/// and code of a kind of warning. Codes without one of their own are `warnings of simulations`.
fn plural(severity: Severity, code: Code) -> &'static str {
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
    /// Adds a warning that is listed by itself, and never summarized with others.
    pub fn add(&mut self, severity: Severity, code: Code, text: impl Into<String>) {
        let (text, experiment, is_minor) = (text.into(), None, false);
        self.0.push(Warning { severity, code, text, experiment, is_minor });
    }

    /// Adds a warning of a finding that changes the estimates by less than their standard errors. The report lists it
    /// after all others, whatever its severity.
    pub fn add_minor(&mut self, severity: Severity, code: Code, text: String) {
        self.0.push(Warning { severity, code, text, experiment: None, is_minor: true });
    }

    /// Adds a warning of an `experiment` (empty: none) of a kind that other observations may have as well.
    /// [`SUMMARIZED`] or more of one kind are one line of the report.
    pub fn add_for(&mut self, experiment: &str, severity: Severity, code: Code, text: String) {
        let experiment = Some(experiment.into());
        self.0.push(Warning { severity, code, text, experiment, is_minor: false });
    }

    /// Adds all warnings of another list at the end, in their order.
    pub fn append(&mut self, mut others: Self) {
        self.0.append(&mut others.0);
    }

    /// Severity of the most severe warning; none of an empty list.
    pub fn worst(&self) -> Option<Severity> {
        self.0.iter().map(|w| w.severity).min()
    }

    /// Text of the first added warning of exactly this severity; none without one.
    pub fn first(&self, severity: Severity) -> Option<&str> {
        self.0.iter().find(|w| w.severity == severity).map(|w| &w.text[..])
    }

    /// Code of the first added warning of exactly this severity; none without one.
    pub fn first_code(&self, severity: Severity) -> Option<Code> {
        self.0.iter().find(|w| w.severity == severity).map(|w| w.code)
    }

    /// Text of the first added warning with any of these codes; none without one.
    pub fn first_of(&self, codes: &[Code]) -> Option<&str> {
        self.0.iter().find(|w| codes.contains(&w.code)).map(|w| &w.text[..])
    }

    /// Whether the residuals are no noise, or may not be: any warning of the severity `Worthless`, `Unexplained`,
    /// `Misfit` or `Ambiguous`.
    pub fn has_misfit(&self) -> bool {
        let misfits =
            [Severity::Worthless, Severity::Unexplained, Severity::Misfit, Severity::Ambiguous];
        self.0.iter().any(|w| misfits.contains(&w.severity))
    }

    /// Replaces all warnings of the severities `Misfit` and `Ambiguous` by one note with this code and text on another
    /// cause of the residuals. Warnings of large residuals (`Worthless`, `Unexplained`) stay, and also lead to the
    /// note. Without any of the four nothing changes.
    pub fn downgrade_misfit(&mut self, code: Code, text: &str) {
        if self.has_misfit() {
            // Residuals that are large compared with the motion keep their warning, whatever their cause.
            self.0.retain(|w| ![Severity::Misfit, Severity::Ambiguous].contains(&w.severity));
            self.add(Severity::Note, code, text);
        }
    }

    /// Replaces all warnings of the severity `Ambiguous` (autocorrelated noise or a missing effect) by one note with
    /// this code and text, if there are any; else nothing changes.
    pub fn downgrade_ambiguity(&mut self, code: Code, text: &str) {
        if self.first(Severity::Ambiguous).is_some() {
            self.0.retain(|w| w.severity != Severity::Ambiguous);
            self.add(Severity::Note, code, text);
        }
    }

    /// Whether there are warnings of the severity `Misfit` or `Ambiguous`, and all of them are minor.
    pub fn has_only_minor_misfits(&self) -> bool {
        let severities = [Severity::Misfit, Severity::Ambiguous];
        let mut own = self.0.iter().filter(|w| severities.contains(&w.severity)).peekable();
        // `all` holds for an empty list too, but without a misfit there is no minor one.
        own.peek().is_some() && own.all(|w| w.is_minor)
    }

    /// Names of the experiments with a warning `OutlyingExperiment`, in the order of addition; equal neighbors are
    /// merged. Empty without such warnings.
    pub fn outlying_experiments(&self) -> Vec<&str> {
        let own = self.0.iter().filter(|w| w.code == Code::OutlyingExperiment);
        let mut names: Vec<&str> = own.filter_map(|w| w.experiment.as_deref()).collect();
        // Measurements of one experiment follow each other, each with a warning of its own.
        names.dedup();
        names
    }

    /// Texts, each followed by its code, and codes: sorted by severity, minor ones last, else in the order of addition.
    /// Of [`SUMMARIZED`] or more warnings of `add_for` with one severity and plural noun only the first is listed, with
    /// the number of the others and their experiments. Those of `add` and `add_minor` are all listed.
    pub fn into_report(mut self) -> ReportedWarnings {
        // The sort is stable: within one severity the order of addition stays.
        self.0.sort_by_key(|w| (w.is_minor, w.severity));
        let mut report = ReportedWarnings::default();
        for warning in &self.0 {
            let same: Vec<&Warning> = self.0.iter().filter(|w| w.is_like(warning)).collect();
            // The first of many represents them; the others are counted with it.
            let text = match same[..] {
                [first, ref others @ ..] if same.len() >= SUMMARIZED => {
                    if !std::ptr::eq(first, warning) {
                        continue;
                    }
                    warning.code.behind(format_args!("{}; {}", warning.text, summary(others)))
                }
                _ => warning.code.behind(&warning.text),
            };
            report.texts.push(text);
            report.codes.push(warning.code);
        }
        report
    }
}

/// Text on the further warnings of one kind, such as `4 more coordinates with outliers: 3 in a, 1 in b`. Up to
/// [`NAMED`] experiments are named, those with the most warnings first, and the rest is counted. Without names of
/// experiments only the number remains.
fn summary(others: &[&Warning]) -> String {
    let mut experiments: Vec<(&str, usize)> = Vec::new();
    for name in others.iter().filter_map(|w| w.experiment.as_deref()).filter(|e| !e.is_empty()) {
        match experiments.iter_mut().find(|(own, _)| *own == name) {
            Some((_, count)) => *count += 1,
            None => experiments.push((name, 1)),
        }
    }
    experiments.sort_by_key(|(_, count)| Reverse(*count));
    let named = experiments.iter().take(NAMED);
    let named: Vec<String> = named.map(|(name, count)| format!("{count} in {name}")).collect();
    let mut text = format!("{} more", others.len());
    if let Some(first) = others.first() {
        text += &format!(" {}", plural(first.severity, first.code));
    }
    if !named.is_empty() {
        text += &format!(": {}", named.join(", "));
    }
    match experiments.len().saturating_sub(NAMED) {
        0 => text,
        further => format!("{text}, and in {further} others"),
    }
}

/// Text of a fraction (0.01 is 1 %) in per cent: one significant digit below 0.01 %, two decimals up to 9.5 %, whole
/// numbers above. Values above 1000 % and NaN are `more than 1000 %`.
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
    use super::{Code, Severity, Warnings, percent};

    /// Residuals as large as the motion are no noise either.
    #[test]
    fn worthless_estimates_count_as_a_misfit() {
        let mut warnings = Warnings::default();
        warnings.add(Severity::Note, Code::Outliers, "a note");
        assert!(!warnings.has_misfit());
        warnings.add(Severity::Worthless, Code::NotAMinimum, "no minimum");
        assert!(warnings.has_misfit());
    }

    #[test]
    fn percentages_have_few_digits() {
        let cases = [
            (1e290, "more than 1000 %"),
            (f64::INFINITY, "more than 1000 %"),
            (f64::NAN, "more than 1000 %"),
            (1.164, "116 %"),
            (0.0213, "2.13 %"),
            (1e-6, "1e-4 %"),
        ];
        for (fraction, text) in cases {
            assert_eq!(percent(fraction), text);
        }
    }
}
