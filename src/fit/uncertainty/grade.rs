//! Grade of a fit, and the status and verdict that explain it.
//!
//! [`Conclusion::new`] receives the end of the fit ([`FitEnd`]), the unidentifiable directions and all warnings. The
//! grade is decided in this order: unusable without convergence; not identifiable, or interrupted if all parameters are
//! identified, unless a warning has the severity `Worthless`; else by the severity of the worst warning. `Worthless`
//! is unusable, `Mesh` and `Numerics` are discretization too coarse, `Ambiguous` is correlated noise or a missing
//! effect. Other severities above a note are model inadequate, notes alone no problem detected. The status is one line
//! on the end of the fit. The verdict is the reason of the grade: a text that the severities and codes of the warnings
//! select, or that of a warning itself. Directions of an unusable result are added as notes. The report of a fit shows
//! grade, status, verdict and the sorted warnings.

use crate::code::Code;
use crate::fit::uncertainty::covariance::identifiability::{UnidentifiableDirection, summarize};
use crate::fit::uncertainty::warning_list::{ReportedWarnings, Severity, Warnings};
use serde::{Deserialize, Serialize};
use std::fmt;

/// Verdict on residuals with a small effect only: one that changes the estimates by less than a standard error.
const MINOR: &str = "an effect that the scene omits explains a part of the residuals. It would change the estimates by less than \
                     their standard errors. Add it to the scene, or fit it (--extend)";

/// Verdict where no residual can show an error of the model.
const UNCHECKED: &str = "no more values than parameters: an error of the model cannot show";

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
    /// The code of the grade in reports, such as `refine-numerics`; `docs/codes.md` explains it.
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

    /// Whether the values can be used, with the warnings of the report: grades up to [`Grade::ModelDoesNotExplain`].
    pub fn is_usable(self) -> bool {
        self <= Self::ModelDoesNotExplain
    }

    /// Grade of a minimum that determines all parameters, by the severity of its worst warning. `Worthless` is
    /// [`Grade::NotUsable`], `Mesh` and `Numerics` are [`Grade::RefineNumerics`], and `Ambiguous` is
    /// [`Grade::CorrelatedOrMissing`]. All other severities above a note are [`Grade::ModelDoesNotExplain`]. Without
    /// warnings, or with notes only, it is [`Grade::Trustworthy`].
    fn from_warnings(warnings: &Warnings) -> Self {
        match warnings.worst() {
            Some(Severity::Worthless) => Self::NotUsable,
            Some(Severity::Mesh | Severity::Numerics) => Self::RefineNumerics,
            Some(
                Severity::Suspicion
                | Severity::Unexplained
                | Severity::Validity
                | Severity::Misfit
                | Severity::Contradiction,
            ) => Self::ModelDoesNotExplain,
            Some(Severity::Ambiguous) => Self::CorrelatedOrMissing,
            Some(Severity::Note) | None => Self::Trustworthy,
        }
    }
}

impl fmt::Display for Grade {
    /// Writes the grade as text, such as `model inadequate`, padded as the format requests.
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

/// State of a fit at its end, before it is graded.
pub(crate) struct FitEnd<'a> {
    /// Whether the search converged to a minimum.
    pub converged: bool,
    /// Whether the data determine every parameter.
    pub identified: bool,
    /// Whether it was stopped before all analyses were complete.
    pub interrupted: bool,
    /// Whether there are more values than parameters, priors counted as values.
    pub redundant: bool,
    /// Termination reason of the optimizer.
    pub exit: &'a str,
    /// Whether all intervals allow for the differences between experiments (cluster jackknife), so that a misfit does
    /// not make them too narrow.
    pub compares_experiments: bool,
}

/// Grade of a result with the texts that explain it, as the report has them.
#[derive(Debug)]
pub(crate) struct Conclusion {
    pub grade: Grade,
    /// One line on the end of the fit.
    pub status: String,
    /// Reason of the grade.
    pub verdict: String,
    /// Texts and codes of all warnings, sorted.
    pub warnings: ReportedWarnings,
}

impl Conclusion {
    /// Grades a result by its end, its unidentifiable directions (`findings`) and its `warnings`, and composes status
    /// and verdict. In this order: unusable without convergence; not identifiable, or interrupted if all parameters are
    /// identified, unless a warning has the severity `Worthless`; else the grade of `Grade::from_warnings`. The first
    /// warning of the severity `Suspicion` (a likely error of the setup) is named as the probable cause. For an
    /// unusable result the directions are added as notes. The warnings are returned sorted and summarized.
    pub fn new(end: FitEnd, findings: &[UnidentifiableDirection], mut warnings: Warnings) -> Self {
        let unidentifiable = summarize(findings);
        // A likely error of the setup is named as the cause of a bad result.
        let cause = warnings.first(Severity::Suspicion);
        let cause = cause.map_or(String::new(), |text| format!(". Probable cause: {text}"));
        let worthless = warnings.first(Severity::Worthless);
        let worthless = worthless.map_or(String::new(), |text| format!("{text}{cause}"));
        let grade = match (end.converged, end.identified) {
            (false, _) => Grade::NotUsable,
            // Residuals as large as the data make all parameters unidentifiable; they are the worse finding.
            (true, false) if worthless.is_empty() => Grade::NotIdentifiable,
            (true, true) if end.interrupted && worthless.is_empty() => Grade::Interrupted,
            (true, _) => Grade::from_warnings(&warnings),
        };
        // The status describes the end of the search, the verdict the reason of the grade.
        let status = match grade {
            Grade::NotIdentifiable => format!("not identifiable: {unidentifiable}"),
            Grade::Interrupted => "interrupted after convergence".into(),
            Grade::NotUsable if !end.converged => format!("not converged: {}", end.exit),
            Grade::NotUsable if end.identified => format!("unusable: {worthless}"),
            Grade::NotUsable => {
                format!("unusable: {worthless}; not identifiable: {unidentifiable}")
            }
            _ => "converged".into(),
        };
        let verdict = match grade {
            Grade::Trustworthy if !end.redundant => UNCHECKED.into(),
            Grade::Trustworthy => grade.to_string(),
            Grade::RefineNumerics => coarse_discretization(&warnings),
            Grade::CorrelatedOrMissing => correlated_or_missing(&warnings).into(),
            Grade::ModelDoesNotExplain => inadequate_model(&warnings, end.compares_experiments),
            Grade::NotIdentifiable => format!(
                "the data do not determine all parameters. Fix one of them (fixed = VALUE), give it a prior, or add data \
                 that depend on it{cause}"
            ),
            Grade::Interrupted => {
                "the fit was stopped at a minimum before all analyses were complete. Run it again for the full report"
                    .into()
            }
            Grade::NotUsable if end.converged => worthless,
            Grade::NotUsable => format!("the fit did not converge: {}", end.exit),
        };
        // The verdict on an unusable result does not describe the unidentifiable directions: they become notes.
        if grade == Grade::NotUsable {
            for finding in findings {
                warnings.add(Severity::Note, finding.kind.code(), &finding.description[..]);
            }
        }
        Self { grade, status, verdict, warnings: warnings.into_report() }
    }
}

/// Verdict on discretization errors beyond the intervals, with the action. It begins with large residuals if a warning
/// has the severity `Unexplained`, or else with residuals that are no noise if one has the severity `Misfit`.
fn coarse_discretization(warnings: &Warnings) -> String {
    let misfit = match [Severity::Unexplained, Severity::Misfit].map(|s| warnings.first(s)) {
        [Some(_), _] => "large residuals. Also ",
        [None, Some(_)] => "the residuals are not noise. Also ",
        [None, None] => "",
    };
    let action = match warnings.first_of(&[Code::StructureScope]) {
        Some(_) => "Use more rods.segments and a smaller time.step",
        None => "Leave rod.segments and time.step out of the scene, and the program chooses them",
    };
    format!(
        "{misfit}the given element or step size changes the estimates by more than their intervals. {action}"
    )
}

/// Verdict on residuals that are autocorrelated noise or a missing effect: [`MINOR`] if all misfits are minor. If the
/// first warning of the severity `Ambiguous` is of outliers, near copies or a missing unit, it names these; else it
/// names both causes.
fn correlated_or_missing(warnings: &Warnings) -> &'static str {
    if warnings.has_only_minor_misfits() {
        MINOR
    } else if warnings.first_code(Severity::Ambiguous) == Some(Code::NearCopy) {
        "two shapes have the same errors, and the intervals are too narrow. Remove one of them, or measure \
         the shape anew"
    } else if warnings.first_code(Severity::Ambiguous) == Some(Code::AssumedUnit) {
        "angles without a unit were read as rad. State the unit in the header of the column, as in angle[deg]"
    } else if warnings.first_code(Severity::Ambiguous) == Some(Code::Outliers) {
        "outliers bias the estimates, or an effect is missing in the model. Use a robust loss \
         (huber, cauchy) before looking for an effect"
    } else {
        "the noise is autocorrelated, or an effect is missing in the model and the estimates are \
         biased by more than their intervals. Record the rod at rest and state its scatter as \
         sigma, or fit the likely omitted effects (--extend)"
    }
}

/// Verdict on an inadequate model or setup, by the first of these that has a warning: error of the setup
/// (`Suspicion`), bound or prior, large residuals (`Unexplained`), validity of the model, misfits that are all minor
/// ([`MINOR`]), contradictions without a misfit, misfit. A verdict on a misfit names the outlying experiments. It calls
/// intervals too narrow unless `compares_experiments`: they then contain the differences between experiments.
fn inadequate_model(warnings: &Warnings, compares_experiments: bool) -> String {
    // A likely error of the setup explains all else.
    if let Some(text) = warnings.first(Severity::Suspicion) {
        return format!("large residuals, most likely because of {text}");
    }
    // A bound or a prior that holds a parameter explains the misfit beside it.
    if let Some(text) = warnings.first_of(&[Code::AtBound, Code::PriorConflict]) {
        return format!("the data contradict a bound or a prior: {text}");
    }
    if warnings.first(Severity::Unexplained).is_some() {
        return "large residuals. Probable causes: a setup error (units or scale, release time, origin, place on the rod, \
                direction of an axis or of a load, rod dimensions) or a wrong local minimum. Check the setup, or \
                give a start or bounds"
            .into();
    }
    if let Some(text) = warnings.first(Severity::Validity) {
        // The finding alone: the warning itself has the reason and the action.
        return text.split(". ").next().unwrap_or(text).into();
    }
    if warnings.has_only_minor_misfits() {
        return MINOR.into();
    }
    // Only warnings of contradictions remain.
    if warnings.first(Severity::Misfit).is_none() {
        return "the data contradict a bound, a prior or the validation data".into();
    }
    // Intervals from the differences between experiments allow for misfit.
    let narrow = if compares_experiments { "" } else { " and intervals are too narrow" };
    let finding = match warnings.first_code(Severity::Misfit) {
        Some(Code::BeyondSigma) => "the residuals are larger than the stated sigma",
        Some(Code::OmittedEffect) => {
            "the residuals have the shape of an effect that the scene omits"
        }
        _ => "the residuals are not noise",
    };
    let text = format!(
        "{finding}, so that estimates may be biased{narrow}. An effect is missing in the scene \
         (damping, drag, a compliant or tilted clamp, clock or camera), or sigma is too small"
    );
    // Single bad recordings are named: the other experiments may be used without them.
    match &warnings.outlying_experiments()[..] {
        [] => text,
        [one] => format!("{one} stands out, most experiments are explained. {text}"),
        all => format!("{} stand out, most experiments are explained. {text}", all.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Conclusion of a converged fit.
    fn conclusion(warnings: Warnings, compares_experiments: bool) -> Conclusion {
        let (converged, identified, interrupted, redundant, exit) = (true, true, false, true, "");
        let end =
            FitEnd { converged, identified, interrupted, redundant, exit, compares_experiments };
        Conclusion::new(end, &[], warnings)
    }

    #[test]
    fn intervals_from_differences_between_experiments_are_not_too_narrow() {
        let mut warnings = Warnings::default();
        warnings.add(Severity::Misfit, Code::ResidualsNotWhite, "autocorrelated");
        let narrow =
            |compares| conclusion(warnings.clone(), compares).verdict.contains("too narrow");
        assert_eq!([narrow(false), narrow(true)], [true, false]);
    }

    /// Values that a warning calls worthless stay so in an interrupted fit.
    #[test]
    fn interrupted_fit_with_a_worthless_warning_is_unusable() {
        let graded = |warnings: Warnings| {
            let (converged, identified, interrupted, redundant, exit) =
                (true, true, true, true, "");
            let compares_experiments = false;
            let end = FitEnd {
                converged,
                identified,
                interrupted,
                redundant,
                exit,
                compares_experiments,
            };
            Conclusion::new(end, &[], warnings)
        };
        assert_eq!(graded(Warnings::default()).grade, Grade::Interrupted);
        let mut warnings = Warnings::default();
        warnings.add(Severity::Worthless, Code::LargeResiduals, "residuals as large as the motion");
        let found = graded(warnings);
        assert_eq!(found.grade, Grade::NotUsable);
        assert!(found.verdict.contains("as large as the motion"), "{}", found.verdict);
    }

    #[test]
    fn small_bias_is_the_last_warning_and_the_verdict() {
        let mut warnings = Warnings::default();
        warnings.add_minor(Severity::Ambiguous, Code::OmittedEffect, "scale".into());
        warnings.add(Severity::Note, Code::MayBeZero, "damping");
        let found = conclusion(warnings.clone(), false);
        assert_eq!(found.grade, Grade::CorrelatedOrMissing);
        assert!(found.verdict.contains("less than their standard errors"));
        assert_eq!(found.warnings.codes, [Code::MayBeZero, Code::OmittedEffect]);
        warnings.add(Severity::Misfit, Code::ResidualsNotWhite, "autocorrelated");
        let found = conclusion(warnings, false);
        assert!(found.verdict.contains("not noise"), "{}", found.verdict);
        assert_eq!(found.warnings.codes[0], Code::ResidualsNotWhite);
    }

    #[test]
    fn most_severe_warning_comes_first_and_grades() {
        let graded = |severities: &[Severity]| {
            let mut warnings = Warnings::default();
            for severity in severities {
                warnings.add(*severity, Code::ResidualsNotWhite, format!("{severity:?}"));
            }
            (Grade::from_warnings(&warnings), warnings.into_report().texts)
        };
        use Severity::*;
        assert_eq!(graded(&[]), (Grade::Trustworthy, Vec::new()));
        assert_eq!(graded(&[Note]).0, Grade::Trustworthy);
        assert_eq!(graded(&[Note, Numerics]).0, Grade::RefineNumerics);
        let (grade, text) = graded(&[Note, Numerics, Misfit]);
        assert_eq!(
            (grade, &text[0][..]),
            (Grade::ModelDoesNotExplain, "Misfit [residuals-not-white]")
        );
        // Discretization errors explain the misfit.
        let (grade, text) = graded(&[Misfit, Unexplained, Mesh]);
        assert_eq!((grade, &text[0][..]), (Grade::RefineNumerics, "Mesh [residuals-not-white]"));
        assert_eq!(graded(&[Mesh, Worthless]).0, Grade::NotUsable);
    }
}
