//! The section "Uncertainty budget" of a page: how much each source of uncertainty contributes to that of a parameter.
//!
//! Input: the estimates of a fit or design. For each parameter a table lists the sources of its uncertainty (noise,
//! inputs, discretization, differences between experiments): standard uncertainty, sensitivity, contribution and part
//! of the variance (GUM: combined standard uncertainty). A second table has the change of the parameter by +1 % of each
//! input without a stated uncertainty. A note compares the budget with Monte Carlo fits, if there were any. Output:
//! HTML with a subsection for each parameter that has any of the three, else empty.

use crate::fit::{BudgetLine, Estimate, QuotedEstimate};
use crate::page::chart::labeled;
use crate::page::estimate::interval;
use crate::page::html::{escaped, note, subsection};
use crate::page::number::{Scale, quantity, signed_percent, signed_quantity, three_digits};
use crate::page::table::HtmlTable;
use crate::summary::quantity::counted;

/// Inputs in a table of sensitivities that are shown at once; further ones are folded.
const SHOWN_INPUTS: usize = 6;

/// HTML with budget, sensitivities and Monte Carlo check of every parameter that has any of these, under its label;
/// empty if none has.
pub(super) fn budgets(parameters: &[Estimate]) -> String {
    let content = |e: &Estimate| budget(e) + &sensitivities(e) + &monte_carlo(e);
    parameters.iter().map(|e| subsection(&e.label(), &content(e))).collect()
}

/// The HTML table of contributions to the combined standard uncertainty of a parameter, and a note with that and its
/// coverage factor. If inputs have a stated uncertainty, the note has the expanded 95 % interval too. Empty unless the
/// estimate has a combined uncertainty, a coverage factor and an expanded interval.
fn budget(e: &Estimate) -> String {
    let (Some(combined), Some(factor), Some(expanded)) =
        (e.combined_std, e.coverage_factor, e.expanded95)
    else {
        return String::new();
    };
    let unit = e.name.unit();
    // Contributions share the unit of the combined uncertainty, so that they can be compared.
    let scale = Scale::for_size(combined, unit);
    let table = HtmlTable::new(&format!("uncertainty budget of {}", e.label()), &e.budget)
        .text("source", |line| source_name(&line.source).to_string())
        .text("standard uncertainty", |line| {
            line.std.map(|std| format!("\u{b1} {}", quantity(std, &line.unit)))
        })
        .text("sensitivity", |line| line.sensitivity.map(|c| sensitivity(c, unit, line)))
        .text("relative sensitivity", |line| line.relative_sensitivity.map(relative_sensitivity))
        .text(&labeled("contribution", &scale.unit), |line| {
            scale.format(line.contribution, Some(line.contribution.abs()))
        })
        .text("share of the variance", |line| format!("{:.1} %", 100.0 * line.share));
    let combined_text = escaped(&scale.format_with_unit(combined, Some(combined)));
    let text =
        format!("Combined standard uncertainty {combined_text}; coverage factor {factor:.2}");
    // Without stated inputs the interval is the statistical one, which the first table has.
    let own = match QuotedEstimate::new(e).is_expanded {
        true => {
            let value = Scale::for_size(expanded[1], unit);
            let ends = interval(expanded, Some(combined), &value);
            format!("; 95 % interval of these sources <b>{ends} {}</b>", escaped(&value.unit))
        }
        false => String::new(),
    };
    table.render() + &note(&format!("{text}{own}."))
}

/// The name of a source of uncertainty for display: `mesh`, `step` and `experiments` have explanations; other keys
/// (`noise`, and names of inputs) are unchanged.
fn source_name(key: &str) -> &str {
    match key {
        "mesh" => "discretization: mesh",
        "step" => "discretization: time step",
        "experiments" => "differences between experiments",
        input => input,
    }
}

/// A relative sensitivity (dimensionless) in three digits; `0.00` below 1e-3 in absolute value.
fn relative_sensitivity(value: f64) -> String {
    if value.abs() < 1e-3 { "0.00".into() } else { three_digits(value) }
}

/// The derivative `value` of a parameter with this `unit` by the input of a `line`, in three significant digits with
/// the unit of the quotient, as `Pa / m`.
fn sensitivity(value: f64, unit: &str, line: &BudgetLine) -> String {
    let units = [unit, &line.unit].map(|unit| if unit.is_empty() { "1" } else { unit });
    match units {
        ["1", "1"] => three_digits(value),
        _ => format!("{} {}", three_digits(value), units.join(" / ")),
    }
}

/// The HTML table of changes of a parameter by +1 % of each input without a stated uncertainty, relative or in its
/// unit, below a note; rows beyond [`SHOWN_INPUTS`] are folded. Empty without such inputs.
fn sensitivities(e: &Estimate) -> String {
    let label = e.label();
    let name = format!("sensitivities of {label} to inputs");
    let table = HtmlTable::new(&name, &e.input_sensitivities)
        .text("input", |input| input.source.clone())
        .text("value", |input| {
            let value = input.value?;
            Some(
                Scale::for_size(value, &input.unit)
                    .format_with_unit(value, Some(1e-3 * value.abs())),
            )
        })
        .text("change by +1 % of the input", |input| {
            let change = || signed_quantity(input.change, e.name.unit());
            input.relative.map_or_else(change, signed_percent)
        })
        .render_folded(SHOWN_INPUTS, "inputs");
    let label = escaped(&label);
    let line = note(&format!("Sensitivity of {label} to inputs without a stated uncertainty."));
    if table.is_empty() { table } else { line + &table }
}

/// A sentence (HTML) with the number and the standard deviation of fits with random inputs and noise, beside that of
/// the linear budget. Empty without a Monte Carlo run.
fn monte_carlo(e: &Estimate) -> String {
    let Some(found) = &e.monte_carlo else { return String::new() };
    let scale = Scale::for_size(found.std, e.name.unit());
    let [std, linear] = [found.std, found.linear_std].map(|x| scale.format_with_unit(x, Some(x)));
    note(&escaped(&format!(
        "Monte Carlo, {} with random inputs and noise: standard deviation {std}; budget: {linear}.",
        counted(found.fits, "fit")
    )))
}
