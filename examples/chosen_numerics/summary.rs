//! Summary of the comparisons: how many runs are within the request, and medians of errors and costs for each kind of scene.

use crate::median;
use crate::scenes::KINDS;

/// The result of a scene for a request.
pub enum Outcome {
    /// The simulation failed.
    Failed,
    /// The error of the reference is too large to decide.
    Undecided {
        is_warned: bool,
    },
    Compared(Comparison),
}

/// A run by chosen numerics next to the true motion.
pub struct Comparison {
    pub kind: &'static str,
    /// True error over the requested one.
    pub ratio: f64,
    pub is_within: bool,
    pub is_warned: bool,
    /// Work of choosing over that of the chosen run.
    pub choosing: f64,
    /// Work of choosing and of the run over the least work by hand.
    pub cost: Option<f64>,
}

/// Prints the counts of a request over all scenes.
pub fn summarize(requested: f64, outcomes: &[&Outcome]) {
    let compared: Vec<&Comparison> = outcomes
        .iter()
        .filter_map(|outcome| match outcome {
            Outcome::Compared(comparison) => Some(comparison),
            _ => None,
        })
        .collect();
    let count = |is: &dyn Fn(&Comparison) -> bool| compared.iter().filter(|one| is(one)).count();
    let undecided: Vec<bool> = outcomes
        .iter()
        .filter_map(|outcome| match outcome {
            Outcome::Undecided { is_warned } => Some(*is_warned),
            _ => None,
        })
        .collect();
    println!(
        "requested {requested:.0e}: {} of {} within, {} exceeded without a warning, {} warned although within, {} failed; {} \
         undecided, {} of them without a warning; median error {:.2} of the requested one, choosing \
         takes {:.2} runs in the median and {:.2} at most",
        count(&|one| one.is_within),
        compared.len(),
        count(&|one| !one.is_within && !one.is_warned),
        count(&|one| one.is_within && one.is_warned),
        outcomes.iter().filter(|outcome| matches!(outcome, Outcome::Failed)).count(),
        undecided.len(),
        undecided.iter().filter(|is_warned| !**is_warned).count(),
        median(compared.iter().map(|one| one.ratio).collect()),
        median(compared.iter().map(|one| one.choosing).collect()),
        compared.iter().map(|one| one.choosing).fold(0.0, f64::max),
    );
    for kind in KINDS {
        let of_kind: Vec<&Comparison> =
            compared.iter().copied().filter(|one| one.kind == kind).collect();
        if !of_kind.is_empty() {
            println!("  {kind}: {}", costs(&of_kind));
        }
    }
    if !compared.is_empty() {
        println!("  all kinds: {}", costs(&compared));
    }
}

/// Medians of the scenes: true error over the requested one, the work of choosing over that of the run, and, where they
/// were compared by hand, the whole work and that of the run alone over the least one.
fn costs(compared: &[&Comparison]) -> String {
    let of = |value: &dyn Fn(&Comparison) -> f64| {
        median(compared.iter().map(|one| value(one)).collect())
    };
    let text = format!(
        "{} scenes, error {:.2} of the requested one, choosing {:.2} runs",
        compared.len(),
        of(&|one| one.ratio),
        of(&|one| one.choosing)
    );
    let by_hand = |whole: bool| {
        let costs = compared.iter().filter_map(|one| {
            one.cost.map(|cost| if whole { cost } else { cost / (1.0 + one.choosing) })
        });
        costs.collect::<Vec<f64>>()
    };
    let (whole, run) = (by_hand(true), by_hand(false));
    if whole.is_empty() {
        return text;
    }
    let number = whole.len();
    format!(
        "{text}; {:.2} times the least work by hand, the run alone {:.2} times, in the median of {number}",
        median(whole),
        median(run)
    )
}
