//! Prints the rows and totals of a camera: wrong models, right models, and the ratio of listed to true biases.

use crate::Fitted;
use crate::kinds::Kind;
use crate::laboratory::Camera;
use crate::outcome::Outcome;
use crate::tally::Tally;

/// The fits of a camera that fulfil the predicate.
fn tally<'a>(
    camera: &Camera,
    fits: &'a [Fitted],
    predicate: impl Fn(&Kind, &Outcome) -> bool,
) -> Tally<'a> {
    let own = fits.iter().filter(|fitted| fitted.task.camera.name == camera.name);
    let own = own.filter(|fitted| predicate(fitted.task.kind, &fitted.outcome));
    Tally::new(own.map(|fitted| &fitted.outcome))
}

/// Prints the rows and totals of the wrong models of a camera; nothing without fits.
pub fn print_wrong(camera: &Camera, kinds: &[&Kind], fits: &[Fitted]) {
    let of = |predicate: &dyn Fn(&Kind, &Outcome) -> bool| {
        tally(camera, fits, |kind, outcome| kind.cause.is_some() && predicate(kind, outcome))
    };
    let all = of(&|_, _| true);
    if all.is_empty() {
        return;
    }
    println!("{}", Tally::header());
    let mut without_term = Vec::new();
    for kind in kinds.iter().filter(|kind| kind.cause.is_some()) {
        println!("{}", of(&|k, _| k.name == kind.name).row(&kind.name));
        if of(&|k, o| k.name == kind.name && o.has_term).is_empty() {
            without_term.push(kind.name.as_str());
        }
    }
    // Effects that the library has no term for cannot be named.
    let has_term = |kind: &Kind| !without_term.contains(&kind.name.as_str());
    let missed = |o: &Outcome| o.covered == Some(false);
    let apparent = of(&|k, _| !k.is_collinear);
    let lines = [
        all.row("all wrong models"),
        all.grades(),
        format!("  effects without a term: {}", without_term.join(", ")),
        all.silence("all", camera),
        apparent.silence("without collinear errors", camera),
        of(&|k, _| !k.is_collinear && has_term(k)).naming("effects with a term"),
        of(&|k, _| has_term(k)).biases("effects with a term"),
        of(&|k, o| has_term(k) && missed(o)).biases("where the interval misses the truth"),
        of(&|k, o| has_term(k) && o.is_silent()).biases("silent fits"),
    ];
    println!("{}", lines.join("\n"));
}

/// Prints the rows and totals of the right models of a camera; nothing without fits.
pub fn print_right(camera: &Camera, kinds: &[&Kind], fits: &[Fitted]) {
    let of = |predicate: &dyn Fn(&Kind) -> bool| {
        tally(camera, fits, |kind, _| kind.cause.is_none() && predicate(kind))
    };
    let all = of(&|_| true);
    if all.is_empty() {
        return;
    }
    println!("{}", Tally::right_header());
    for kind in kinds.iter().filter(|kind| kind.cause.is_none()) {
        println!("{}", of(&|k| k.name == kind.name).right_row(&kind.name));
    }
    println!("{}\n{}", all.right_row("all right models"), all.grades());
    println!("{}", all.right_requirements());
}

/// Prints the median ratio of listed to true or plausible biases over all fits.
pub fn print_ratio(fits: &[Fitted]) {
    println!("\n{}", Tally::new(fits.iter().map(|fitted| &fitted.outcome)).overall_ratio());
}
