//! Codes: short stable names of grades, warnings and reasons for which a computation ended, such as `beyond-sigma`.
//!
//! A code follows its message in brackets, as in `[beyond-sigma]`, on the terminal, in JSON and on pages. Its entry
//! with meaning, test and remedy is in `docs/codes/`, compiled into the library, and `rodfit explain` prints it.
//! Messages may change; a renamed code is still read by its former name. Exit codes of the program have entries too.
//! [`Code`] has the codes (`Code::behind` appends one to a message), and [`named`] returns the one with a current or
//! former name. [`explained`] returns the entry of such a name, or of an exit code. Both return None for other texts.
//! [`all_explained`] returns all entries with their names.

use serde::{Deserialize, Serialize};
use std::fmt;

/// Documents with the entries of all codes, in the order of [`Code`], then those of the exit codes. Each entry has a
/// heading of the second level.
const PAGES: [&str; 7] = [
    include_str!("../docs/codes/grades.md"),
    include_str!("../docs/codes/residuals.md"),
    include_str!("../docs/codes/parameters.md"),
    include_str!("../docs/codes/posterior.md"),
    include_str!("../docs/codes/scenes.md"),
    include_str!("../docs/codes/equilibria.md"),
    include_str!("../docs/codes/runs.md"),
];

/// Declares the variants of [`Code`] with their names, and with their former names if they were renamed.
macro_rules! codes {
    ($($code:ident $name:literal $(formerly $former:literal)?,)*) => {
        /// A short stable name of a grade, a warning or the reason for the end of a computation.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
        #[cfg_attr(test, derive(schemars::JsonSchema))]
        #[non_exhaustive]
        pub enum Code {
            $(
                #[doc = concat!("`", $name, "`")]
                #[serde(rename = $name $(, alias = $former)?)]
                $code,
            )*
        }

        impl Code {
            /// All codes.
            pub const ALL: &[Self] = &[$(Self::$code,)*];

            /// The name, which follows messages in brackets.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$code => $name,)*
                }
            }

            /// The name that the code had up to version 0.1; `None` if it has not changed.
            pub const fn former_name(self) -> Option<&'static str> {
                match self {
                    $($(Self::$code => Some($former),)?)*
                    _ => None,
                }
            }
        }
    };
}

codes! {
    // Grades of a fit.
    Trustworthy "trustworthy",
    RefineNumerics "refine-numerics",
    CorrelatedOrMissing "correlated-or-missing",
    ModelDoesNotExplain "model-does-not-explain",
    NotIdentifiable "not-identifiable",
    Interrupted "interrupted",
    NotUsable "not-usable",
    // Parameters that the data of a fit do not determine.
    Structural "structural",
    Practical "practical",
    NearCopy "near-copy",
    UnequalNoise "unequal-noise",
    AssumedUnit "assumed-unit",
    // Problems of a fit.
    NoMotion "no-motion" formerly "nothing-moves",
    FarStart "far-start",
    LateRelease "late-release",
    ImplausibleTimeScale "implausible-time-scale" formerly "wrong-pace",
    BetterMinimum "better-minimum",
    EqualMinimum "equal-minimum",
    NotAMinimum "not-a-minimum",
    LargeResiduals "large-residuals" formerly "unexplained",
    OutlyingExperiment "outlying-experiment",
    ResidualsNotWhite "residuals-not-white" formerly "not-noise",
    BeyondSigma "beyond-sigma",
    ExceedsNoiseScale "exceeds-noise-scale",
    UnresolvedCorrelation "unresolved-correlation",
    SigmaDoubtful "sigma-doubtful",
    ConstantAxis "constant-axis",
    RepeatedFrames "repeated-frames",
    OmittedEffect "omitted-effect" formerly "looks-like",
    NotExtended "not-extended",
    AlternativeTerm "alternative-term",
    UndetectedBias "undetected-bias" formerly "could-hide", // old name
    Outliers "outliers",
    CorrelatedNoise "correlated-noise",
    AtBound "at-bound",
    PriorConflict "prior-conflict" formerly "against-prior",
    InconsistentInput "inconsistent-input" formerly "known-far-off",
    ThickRod "thick-rod",
    ModeNumbers "mode-numbers",
    LargePredictionError "large-prediction-error" formerly "badly-predicted",
    PredictionFailed "prediction-failed" formerly "not-predicted",
    NotFitted "not-fitted",
    MayBeZero "may-be-zero",
    OneSided "one-sided",
    HighLeverage "high-leverage" formerly "runaway-values", // old name
    GrowingSensitivity "growing-sensitivity",
    NumericsNotModel "numerics-not-model",
    DiscretizationError "discretization-error" formerly "mesh-and-step",
    NumericsUnknown "numerics-unknown",
    NumericsBelowData "numerics-below-data",
    HalvedSteps "halved-steps",
    ReplicatesFailed "replicates-failed",
    NoHessian "no-hessian",
    NoBudget "no-budget",
    BudgetNotLinear "budget-not-linear",
    NoSensitivityAnalysis "no-sensitivity-analysis" formerly "no-what-if",
    NoShapes "no-shapes",
    PosteriorNotConverged "posterior-not-converged",
    PosteriorTooNarrow "posterior-too-narrow",
    NoPosterior "no-posterior",
    // Problems of scenes and recordings, in simulations and fits.
    StepTooLarge "step-too-large",
    AccuracyOutOfReach "accuracy-out-of-reach",
    AccuracyNotMet "accuracy-not-met",
    LostFrames "lost-frames",
    SwappedLabels "swapped-labels",
    MissingFrames "missing-frames",
    RecordingJumps "recording-jumps",
    GravityInAcceleration "gravity-in-acceleration",
    Glitches "glitches",
    ImplausibleUnits "implausible-units",
    NoGravity "no-gravity",
    CoarseCurvature "coarse-curvature",
    LoadOnHeldNode "load-on-held-node",
    StepBeyondEnd "step-beyond-end",
    LargeStrain "large-strain",
    BeyondTable "beyond-table",
    DeepContact "deep-contact",
    StructureScope "structure-scope",
    NumericalDamping "numerical-damping",
    // Problems of equilibria and of derivatives.
    Frictionless "frictionless",
    NoLoadAtTime "no-load-at-time",
    CoarseMesh "coarse-mesh",
    Unstable "unstable",
    Marginal "marginal",
    UnstableState "unstable-state",
    DerivativesDisagree "derivatives-disagree",
    // Reasons for the end of a computation.
    NoSolution "no-solution",
    EnergyGrowth "energy-growth",
    NotFinite "not-finite",
    UnstableStep "unstable-step",
    MeanStretch "mean-stretch",
    CoarseStep "coarse-step",
    Fold "fold",
    LargeRotation "large-rotation" formerly "leap",
    PassedObstacle "passed-obstacle",
    SingularTangent "singular-tangent",
    NoEquilibrium "no-equilibrium",
    NeutralEquilibrium "neutral-equilibrium" formerly "indifferent",
    ModesNotFound "modes-not-found",
    ModeWithoutDerivative "mode-without-derivative",
    FitFailed "fit-failed",
    // Problems of a campaign.
    InvalidTask "invalid-task" formerly "will-be-refused",
    DamagedResult "damaged-result",
    // Problems of the run of a command.
    FewerThreads "fewer-threads",
    OlderResult "older-result",
    NoCtrlC "no-ctrl-c",
}

impl Code {
    /// Entry of the code in `docs/codes/`, in Markdown: title, meaning, test and remedy. Empty without an entry.
    pub fn explained(self) -> &'static str {
        explained(self.name()).unwrap_or_default()
    }

    /// The text followed by a space and the code in brackets: `text [code]`.
    pub(crate) fn behind(self, text: impl fmt::Display) -> String {
        format!("{text} [{self}]")
    }
}

impl fmt::Display for Code {
    /// Writes the name of the code, padded to the width of the format.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// Names and entries, in the order of the documents, of all codes and of the exit codes of the program, such as `3`.
/// The first line of an entry is its title; texts are trimmed Markdown.
pub fn all_explained() -> impl Iterator<Item = (&'static str, &'static str)> {
    PAGES.iter().flat_map(|page| page.split("\n## ").skip(1)).filter_map(|text| {
        let (name, text) = text.split_once('\n')?;
        Some((name.trim(), text.trim()))
    })
}

/// The code with this name, or with this former name; `None` for another text.
pub fn named(name: &str) -> Option<Code> {
    let is_name = |code: &&Code| code.name() == name || code.former_name() == Some(name);
    Code::ALL.iter().find(is_name).copied()
}

/// Entry, in Markdown, of a code by its current or former name, or of an exit code of the program. None for a text
/// without an entry.
pub fn explained(name: &str) -> Option<&'static str> {
    let name = named(name).map_or(name, |code| code.name());
    all_explained().find(|(other, _)| *other == name).map(|(_, text)| text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;
    use std::path::Path;

    /// A former name is not the current name of any code, and the changelog has it.
    #[test]
    fn former_names_are_listed_and_unique() {
        let listed = include_str!("../CHANGELOG.md");
        let renamed = Code::ALL.iter().filter_map(|code| Some((*code, code.former_name()?)));
        let renamed: Vec<(Code, &str)> = renamed.collect();
        for (code, former) in &renamed {
            assert!(listed.contains(&format!("  | `{former}` | `{code}` |\n")), "{former}");
            assert!(Code::ALL.iter().all(|other| other.name() != *former), "{former}");
            assert_eq!(named(former), Some(*code));
            assert_eq!(explained(former), Some(code.explained()));
            let read: Code = serde_json::from_str(&format!("\"{former}\"")).unwrap();
            assert_eq!(read, *code);
        }
        assert_eq!(
            renamed.iter().map(|(_, former)| former).collect::<BTreeSet<_>>().len(),
            renamed.len()
        );
    }

    /// The text of all Rust files in a folder and below it.
    fn sources(folder: &Path) -> String {
        let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
        let text = |path: std::path::PathBuf| match path.is_dir() {
            true => sources(&path),
            false if path.extension().is_some_and(|e| e == "rs") => {
                std::fs::read_to_string(&path).unwrap()
            }
            false => String::new(),
        };
        entries.map(text).collect()
    }

    #[test]
    fn every_code_is_explained_and_nothing_else() {
        let (codes, exits): (Vec<_>, Vec<_>) =
            all_explained().map(|(name, _)| name).partition(|name| name.parse::<u8>().is_err());
        let names: Vec<&str> = Code::ALL.iter().map(|code| code.name()).collect();
        assert_eq!(codes, names, "docs/codes has them in the order of the table");
        assert_eq!(names.iter().collect::<BTreeSet<_>>().len(), names.len());
        assert_eq!(exits, ["0", "2", "3", "101", "130"]);
        for (name, text) in all_explained() {
            let lines = text.lines().count();
            assert!((3..=14).contains(&lines), "{name}: {lines} lines");
            assert!(text.lines().all(|line| line.chars().count() <= 130), "{name}");
            let title = text.lines().next().unwrap();
            assert!(title.ends_with('.') && title.len() <= 100, "{name}: {title}");
            for part in ["**Meaning.** ", "**To do.** "] {
                assert_eq!(text.matches(part).count(), 1, "{name}: {part}");
            }
        }
        let source = sources(Path::new("src"));
        for code in Code::ALL {
            // A code that the program does not use is not explained either.
            let used = source
                .match_indices(&format!("Code::{code:?}"))
                .any(|(at, found)| !source[at + found.len()..].starts_with(char::is_alphanumeric));
            assert!(used, "{code}");
            let json = serde_json::to_string(code).unwrap();
            assert_eq!(json, format!("\"{code}\""));
            assert_eq!(explained(code.name()), Some(code.explained()));
            assert!(code.explained().contains("**Found** "), "{code}");
        }
    }
}
