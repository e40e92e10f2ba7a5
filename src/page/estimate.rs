//! The interval of an estimate that is to be quoted, and tables of estimates.

use crate::fit::Estimate;
use crate::page::html::{escaped, note};
use crate::page::number::{NONE, Scale, short};
use crate::page::table::Table;

/// The interval that is to be quoted: the expanded one where inputs have stated uncertainties, else the statistical one.
pub(super) struct Quoted {
    pub std: Option<f64>,
    pub ends: Option<[f64; 2]>,
    pub is_expanded: bool,
}

impl Quoted {
    pub fn of(e: &Estimate) -> Self {
        let has_inputs = e.budget.iter().any(|line| line.std.is_some());
        match (e.expanded95, e.combined_std) {
            (Some(ends), Some(std)) if has_inputs => {
                Self { std: Some(std), ends: Some(ends), is_expanded: true }
            }
            _ => Self { std: e.std_error, ends: e.interval95, is_expanded: false },
        }
    }
}

/// The scale of an estimate, or of its bound.
pub(super) fn scale(e: &Estimate) -> Scale {
    let size = e.lower95.or(e.value.filter(|value| *value != 0.0)).or(e.upper95);
    Scale::of(size.unwrap_or(0.0), e.name.unit())
}

/// Ends of an interval with the digits of an error.
pub(super) fn interval([low, high]: [f64; 2], std: Option<f64>, scale: &Scale) -> String {
    format!("[{}, {}]", scale.show(low, std), scale.show(high, std))
}

/// The estimates with the intervals that are to be quoted. `wording` has the heads of the columns of the estimate and of
/// its error.
pub(super) fn table(parameters: &[Estimate], [estimate, error]: [&str; 2]) -> String {
    let is_expanded = parameters.iter().any(|e| Quoted::of(e).is_expanded);
    let interval_of = if is_expanded { "95 % interval (expanded)" } else { "95 % interval" };
    let heads = ["parameter", estimate, error, interval_of, "unit"];
    let mut table = Table::new("estimates and intervals", heads).id("answer");
    for e in parameters {
        let scale = scale(e);
        let quoted = Quoted::of(e);
        table.row(format!("<b>{}</b>", escaped(&e.label())), cells(e, &quoted, &scale));
        if let (true, Some(std), Some(ends)) = (quoted.is_expanded, e.std_error, e.interval95) {
            let cells = [None, relative(e, std, &scale), Some(interval(ends, Some(std), &scale))];
            let cells = cells.into_iter().map(|cell| cell.or(Some(" ".into())));
            table.marked_row("sub", "statistical only", cells.collect());
        }
    }
    let basis = match is_expanded {
        true => "Expanded interval: noise, inputs with a stated uncertainty, and discretization.",
        false => "Statistical interval: inputs are taken as exact.",
    };
    let has_interval = parameters.iter().any(|e| e.std_error.is_some());
    table.html() + &if has_interval { note(basis) } else { String::new() }
}

fn cells(e: &Estimate, quoted: &Quoted, scale: &Scale) -> Vec<Option<String>> {
    let unit = Some(escaped(&scale.unit));
    if let Some(lower) = e.lower95 {
        let bound = format!("at least {} (one-sided)", scale.show(lower, Some(0.01 * lower)));
        return vec![None, None, Some(bound), unit];
    }
    let Some(value) = e.value else {
        return vec![Some("<td class=\"bad\">not identifiable</td>".into()), None, None, None];
    };
    if let Some(upper) = e.upper95 {
        let error = Some(0.01 * upper);
        let bound = format!("at most {} (one-sided)", scale.show(upper, error));
        return vec![Some(scale.show(value, error)), None, Some(bound), unit];
    }
    vec![
        Some(format!("<b>{}</b>", scale.show(value, quoted.std))),
        quoted.std.and_then(|std| relative(e, std, scale)),
        quoted.ends.map(|ends| interval(ends, quoted.std, scale)),
        unit,
    ]
}

/// An error in the unit of the estimate, and in per cent of an estimate that is positive.
fn relative(e: &Estimate, std: f64, scale: &Scale) -> Option<String> {
    let own = scale.show(std, Some(std));
    let own = if own == NONE { return None } else { own };
    Some(match e.value.filter(|value| e.name.is_positive() && *value > 0.0) {
        Some(value) => format!("{own} ({} %)", short(100.0 * std / value)),
        None => own,
    })
}
