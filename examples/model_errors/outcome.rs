//! Comparison of a fit's report with the truth: coverage of the interval of E, whether the true cause is named by the score
//! tests, and the listed undetected bias over the true one.

use crate::kinds::Kind;
use rodfit::FitReport;
use rodfit::fit::{Grade, UndetectedBias};
use std::fmt::Write;

/// Score tests up to this rank count as naming the cause.
const NAMED_PLACES: usize = 2;
/// Part of the true bias from which on a listed undetected bias covers it.
pub const COVERING: f64 = 0.8;

/// The comparison of one fit with the truth.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// The code of the grade; none of a fit that failed.
    pub grade: Option<&'static str>,
    /// Graded `trustworthy`.
    pub unreserved: bool,
    /// Whether the score tests or the undetected biases include the cause.
    pub has_term: bool,
    /// Whether the 95 % interval of E contains the truth; none without an interval.
    pub covered: Option<bool>,
    /// Whether the cause is in the first two places of the significant score tests.
    pub named: bool,
    /// Listed change of E by the cause over the true bias of E; 0 where the cause is not listed.
    pub bias_ratio: f64,
    /// Of a right model, for all effects listed for E: listed over plausible size, and listed change over E.
    pub size_ratios: Vec<f64>,
    pub changes: Vec<f64>,
}

/// The effects that these data could not reveal, with a bias of E.
fn listed(report: &FitReport) -> impl Iterator<Item = &UndetectedBias> {
    let modulus = report.parameters.first().map(|e| e.label()).unwrap_or_default();
    report.undetected_bias.iter().filter(move |hidden| hidden.parameter == modulus)
}

/// The plausible size of an effect, read from the JSON; none if the report has none.
fn plausible(effect: &UndetectedBias) -> Option<f64> {
    serde_json::to_value(effect).ok()?.get("plausible")?.as_f64()
}

impl Outcome {
    /// Compares a report with the truth of its kind.
    pub fn new(kind: &Kind, report: &FitReport) -> Self {
        let truth = kind.rod.modulus;
        let graded = Self {
            grade: Some(report.grade.code().name()),
            unreserved: report.grade == Grade::Trustworthy,
            ..Self::default()
        };
        let Some((estimate, value)) = report.parameters.first().and_then(|e| Some((e, e.value?)))
        else {
            return graded;
        };
        let tests = &report.score_tests;
        let significant = |place: usize| {
            tests.iter().find(|t| t.rank == place).is_some_and(|first| first.is_significant())
        };
        let named = |cause: &str| {
            tests.iter().any(|t| t.source == cause && t.rank <= NAMED_PLACES && significant(t.rank))
        };
        // The listed bias of the true cause, or, for a right model, all listed biases.
        let of_cause = kind.cause.and_then(|cause| listed(report).find(|h| h.source == cause));
        let right = || listed(report).filter(|_| kind.cause.is_none());
        let ratio = |h: &UndetectedBias| Some((h.size / plausible(h)?).abs());
        Self {
            has_term: of_cause.is_some()
                || tests.iter().any(|t| kind.cause == Some(t.source.as_str())),
            covered: estimate.interval95.map(|[low, high]| low <= truth && truth <= high),
            named: kind.cause.is_some_and(named),
            bias_ratio: of_cause.map_or(0.0, |h| h.change.abs() / (value - truth).abs()),
            size_ratios: right().filter_map(ratio).collect(),
            changes: right().map(|h| h.change.abs() / value).collect(),
            ..graded
        }
    }

    /// Whether the fit is graded without reservation although the interval misses the truth.
    pub fn is_silent(&self) -> bool {
        self.unreserved && self.covered == Some(false)
    }
}

/// The lines that verbose output prints of a fit.
pub fn details(kind: &Kind, report: &FitReport) -> String {
    let mut text = String::new();
    let truth = kind.rod.modulus;
    for e in &report.parameters {
        let value = e.value.unwrap_or(f64::NAN);
        let [low, high] = e.interval95.unwrap_or([f64::NAN; 2]);
        let _ = write!(text, "    {} {value:.4e} [{low:.4e}, {high:.4e}]", e.label());
        if e.name == rodfit::Parameter::YoungsModulus {
            let _ = write!(text, " {:+.2} %", 100.0 * (value / truth - 1.0));
        }
        text.push('\n');
    }
    // Residuals: autocorrelation and whiteness of each axis.
    let correlations: Vec<String> = report
        .residual_tests
        .iter()
        .map(|t| format!("{} {:.3} (whiteness {:.1e})", t.axis, t.autocorrelation, t.whiteness))
        .collect();
    let sigmas: Vec<String> = report.sigma.iter().map(|sigma| format!("{sigma:.3e}")).collect();
    let _ = writeln!(
        text,
        "    RMS {:.3e} m, sigma {} m, correlation {}",
        report.residual_rms,
        sigmas.join(", "),
        correlations.join(", ")
    );
    // The true cause is marked by an asterisk.
    for t in &report.score_tests {
        let mark = if kind.cause == Some(t.source.as_str()) { "*" } else { " " };
        let _ = writeln!(
            text,
            "   {mark}test {}: {} {:+.2e} {}, {:.1} sigma, p {:.1e}",
            t.rank, t.source, t.estimate, t.unit, t.z_score, t.p_value
        );
    }
    for h in listed(report) {
        let mark = if kind.cause == Some(h.source.as_str()) { "*" } else { " " };
        let plausible = plausible(h).map(|x| format!(" (plausible {x:.2e})")).unwrap_or_default();
        let _ = writeln!(
            text,
            "   {mark}undetected: {} {:.2e} {}{plausible}: E {:+.2} %, visible {:.2}",
            h.source,
            h.size,
            h.unit,
            100.0 * h.change / report.parameters[0].value.unwrap_or(f64::NAN),
            h.residual_effect
        );
    }
    let codes: Vec<&str> = report.warning_codes.iter().map(|code| code.name()).collect();
    let _ = writeln!(text, "    warnings: {}", codes.join(", "));
    text
}
