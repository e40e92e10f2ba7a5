//! Short stable names of what the program says of a result: its grade, each warning, and why a computation ended.
//!
//! They stand in brackets behind the words, as in `[beyond-sigma]`, on the terminal, in JSON and on pages; `rodfit
//! explain` tells what they mean, from the one text there is, `docs/codes.md`. Words may become better, a code stays.

use serde::{Deserialize, Serialize};
use std::fmt;

/// What every code means, how it is found and what to do: a heading each.
const EXPLAINED: &str = include_str!("../docs/codes.md");

/// Declares the codes with their names.
macro_rules! codes {
    ($($code:ident $name:literal,)*) => {
        /// A short stable name of something that the program may say.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
        #[cfg_attr(test, derive(schemars::JsonSchema))]
        #[non_exhaustive]
        pub enum Code {
            $(
                #[doc = concat!("`", $name, "`")]
                #[serde(rename = $name)]
                $code,
            )*
        }

        impl Code {
            /// All there are.
            pub const ALL: &[Self] = &[$(Self::$code,)*];

            /// As it stands in brackets behind what it names.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$code => $name,)*
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
    // What the data of a fit do not determine.
    Structural "structural",
    Practical "practical",
    // What speaks against a fit.
    NothingMoves "nothing-moves",
    FarStart "far-start",
    LateRelease "late-release",
    WrongPace "wrong-pace",
    BetterMinimum "better-minimum",
    NotAMinimum "not-a-minimum",
    Unexplained "unexplained",
    OutlyingExperiment "outlying-experiment",
    NotNoise "not-noise",
    BeyondSigma "beyond-sigma",
    ExceedsNoiseScale "exceeds-noise-scale",
    UnresolvedCorrelation "unresolved-correlation",
    SigmaDoubtful "sigma-doubtful",
    ConstantAxis "constant-axis",
    RepeatedFrames "repeated-frames",
    LooksLike "looks-like",
    NotExtended "not-extended",
    AlternativeTerm "alternative-term",
    CouldHide "could-hide",
    Outliers "outliers",
    CorrelatedNoise "correlated-noise",
    AtBound "at-bound",
    AgainstPrior "against-prior",
    KnownFarOff "known-far-off",
    ThickRod "thick-rod",
    ModeNumbers "mode-numbers",
    BadlyPredicted "badly-predicted",
    NotPredicted "not-predicted",
    NotFitted "not-fitted",
    MayBeZero "may-be-zero",
    OneSided "one-sided",
    RunawayValues "runaway-values",
    GrowingSensitivity "growing-sensitivity",
    NumericsNotModel "numerics-not-model",
    MeshAndStep "mesh-and-step",
    NumericsUnknown "numerics-unknown",
    NumericsBelowData "numerics-below-data",
    HalvedSteps "halved-steps",
    ReplicatesFailed "replicates-failed",
    NoHessian "no-hessian",
    NoBudget "no-budget",
    BudgetNotLinear "budget-not-linear",
    NoWhatIf "no-what-if",
    NoShapes "no-shapes",
    // Of scenes and recordings, in simulations and fits.
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
    StepBeyondEnd "step-beyond-end",
    LargeStrain "large-strain",
    NumericalDamping "numerical-damping",
    // Of rods at rest and of derivatives.
    Unstable "unstable",
    Marginal "marginal",
    UnstableState "unstable-state",
    DerivativesDisagree "derivatives-disagree",
    // Why a computation ended.
    NoSolution "no-solution",
    EnergyGrowth "energy-growth",
    NotFinite "not-finite",
    UnstableStep "unstable-step",
    Fold "fold",
    Leap "leap",
    SingularTangent "singular-tangent",
    NoEquilibrium "no-equilibrium",
    Indifferent "indifferent",
    ModesNotFound "modes-not-found",
    ModeWithoutDerivative "mode-without-derivative",
    FitFailed "fit-failed",
    // Of a campaign.
    WillBeRefused "will-be-refused",
    DamagedResult "damaged-result",
    // Of the run itself.
    FewerThreads "fewer-threads",
    OlderResult "older-result",
    NoCtrlC "no-ctrl-c",
}

impl Code {
    /// What it means, how it is found and what to do.
    pub fn explained(self) -> &'static str {
        explained(self.name()).unwrap_or_default()
    }

    /// Words with the code behind them.
    pub(crate) fn behind(self, words: impl fmt::Display) -> String {
        format!("{words} [{self}]")
    }
}

impl fmt::Display for Code {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// Everything that is explained, by its name: the codes, and the exit codes of the program, such as `3`. The first
/// line of a text is its title.
pub fn all_explained() -> impl Iterator<Item = (&'static str, &'static str)> {
    EXPLAINED.split("\n## ").skip(1).filter_map(|text| {
        let (name, text) = text.split_once('\n')?;
        // Without what introduces the next part.
        let text = text.split("\n# ").next().unwrap_or(text);
        Some((name.trim(), text.trim()))
    })
}

/// What a code, or an exit code of the program, means, how it is found and what to do.
pub fn explained(name: &str) -> Option<&'static str> {
    all_explained().find(|(other, _)| *other == name).map(|(_, text)| text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;
    use std::path::Path;

    /// All that is written in Rust.
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
        assert_eq!(codes, names, "docs/codes.md has them in the order of the table");
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
            // What nothing says any more is not explained either.
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
