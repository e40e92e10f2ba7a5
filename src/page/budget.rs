//! The uncertainty budgets, and the sensitivities to inputs.

use crate::fit::{BudgetLine, Estimate};
use crate::page::estimate::interval;
use crate::page::html::{escaped, note};
use crate::page::number::{Scale, change, percent, quantity, short};
use crate::page::table::Table;
use crate::summary::quantity::counted;

/// Inputs that are not folded.
const SHOWN: usize = 6;

/// Budget, sensitivities and Monte Carlo check of every parameter that has any.
pub(super) fn budgets(parameters: &[Estimate]) -> String {
    let one = |e: &Estimate| {
        let content = budget(e) + &sensitivities(e) + &monte_carlo(e);
        match content.is_empty() {
            true => content,
            false => format!("<h3>{}</h3>\n{content}", escaped(&e.label())),
        }
    };
    parameters.iter().map(one).collect()
}

fn budget(e: &Estimate) -> String {
    let (Some(combined), Some(factor), Some(expanded)) =
        (e.combined_std, e.coverage_factor, e.expanded95)
    else {
        return String::new();
    };
    let unit = e.name.unit();
    let scale = Scale::of(combined, unit);
    let contribution = match scale.unit.is_empty() {
        true => "contribution".into(),
        false => format!("contribution ({})", escaped(&scale.unit)),
    };
    let heads = [
        "source".to_string(),
        "standard uncertainty".into(),
        "sensitivity".into(),
        "relative sensitivity".into(),
        contribution,
        "share of the variance".into(),
    ];
    let mut table = Table::new(&format!("uncertainty budget of {}", e.label()), heads);
    for line in &e.budget {
        let cells = vec![
            line.std.map(|std| escaped(&format!("\u{b1} {}", quantity(std, &line.unit)))),
            line.sensitivity.map(|c| escaped(&sensitivity(c, unit, line))),
            line.relative_sensitivity.map(short),
            Some(scale.show(line.contribution, Some(line.contribution.abs()))),
            Some(format!("{:.1} %", 100.0 * line.share)),
        ];
        table.row(escaped(source(&line.source)), cells);
    }
    let value = Scale::of(expanded[1], unit);
    table.html()
        + &note(&format!(
            "Combined standard uncertainty {}; coverage factor {factor:.2}; expanded interval (95 %) <b>{} {}</b>.",
            escaped(&scale.with_unit(combined, Some(combined))),
            interval(expanded, Some(combined), &value),
            escaped(&value.unit),
        ))
}

/// The name of a source in words, where it is not that of an input.
fn source(name: &str) -> &str {
    match name {
        "mesh" => "discretization: mesh",
        "step" => "discretization: time step",
        "experiments" => "differences between experiments",
        name => name,
    }
}

fn sensitivity(value: f64, unit: &str, line: &BudgetLine) -> String {
    let per = [unit, &line.unit].map(|unit| if unit.is_empty() { "1" } else { unit });
    match per {
        ["1", "1"] => short(value),
        _ => format!("{} {}", short(value), per.join(" / ")),
    }
}

fn sensitivities(e: &Estimate) -> String {
    let label = escaped(&e.label());
    let heads = ["input".to_string(), "change by +1 % of the input".into()];
    let mut table = Table::new(&format!("sensitivities of {} to inputs", e.label()), heads);
    for input in &e.input_sensitivities {
        let by = match input.relative {
            Some(relative) if relative > 0.0 => format!("+{}", percent(relative)),
            Some(relative) => percent(relative),
            None => escaped(&change(input.change, e.name.unit())),
        };
        table.row(escaped(&input.source), vec![Some(by)]);
    }
    match table.len() {
        0 => String::new(),
        _ => {
            note(&format!("Sensitivity of {label} to inputs without a stated uncertainty."))
                + &table.folded_after(SHOWN, "inputs")
        }
    }
}

fn monte_carlo(e: &Estimate) -> String {
    let Some(found) = &e.monte_carlo else { return String::new() };
    let scale = Scale::of(found.std, e.name.unit());
    let [std, linear] = [found.std, found.linear_std].map(|x| scale.with_unit(x, Some(x)));
    note(&escaped(&format!(
        "Monte Carlo, {} with random inputs and noise: standard deviation {std}; budget: {linear}.",
        counted(found.fits, "fit")
    )))
}
