//! The budgets of uncertainty on the page of a fit.

use crate::fit::{BudgetLine, Estimate, FitReport};
use crate::page::escaped;
use crate::page::number::{Scale, quantity, short};

/// So many numbers are named of which one per cent matters.
const NAMED: usize = 6;

/// A table of every parameter, and what one per cent of other numbers would change; empty without both.
pub(super) fn budgets(report: &FitReport) -> String {
    report.parameters.iter().map(|e| table(e) + &per_cents(e) + &monte_carlo(e)).collect()
}

fn table(e: &Estimate) -> String {
    let (Some(combined), Some(factor), Some(expanded)) =
        (e.combined_std, e.coverage_factor, e.expanded95)
    else {
        return String::new();
    };
    let unit = e.name.unit();
    let scale = Scale::of(combined, unit);
    let two = |x: f64| scale.show(x, Some(combined));
    let row = |line: &BudgetLine| {
        let cells = [
            line.std.map_or(String::new(), |std| format!("\u{b1} {}", quantity(std, &line.unit))),
            line.sensitivity.map_or(String::new(), |c| {
                let per = [unit, &line.unit].map(|u| if u.is_empty() { "1" } else { u });
                format!(
                    "{} {}",
                    short(c),
                    if per == ["1", "1"] { String::new() } else { per.join(" / ") }
                )
            }),
            line.relative_sensitivity.map_or(String::new(), short),
            two(line.contribution),
            format!("{:.1} %", 100.0 * line.share),
        ];
        let cells: String =
            cells.iter().map(|cell| format!("<td>{}</td>", escaped(cell.trim()))).collect();
        format!("<tr><th>{}</th>{cells}</tr>\n", escaped(&line.source))
    };
    let rows: String = e.budget.iter().map(row).collect();
    format!(
        "<h3>{}</h3>\n<div class=\"wide\" tabindex=\"0\"><table class=\"budget\"><thead><tr><th>source</th><th>standard \
         uncertainty</th><th>sensitivity</th><th>relative sensitivity</th><th>contribution, {unit}</th><th>share</th></tr></thead>\n\
         <tbody>{rows}</tbody></table></div>\n<p class=\"note\">Combined standard uncertainty {combined} \
         {unit}; with a coverage factor of {factor:.2} the expanded interval (95 %) is \
         <b>{expanded}</b>.</p>\n",
        escaped(&e.label()),
        unit = escaped(&scale.unit),
        combined = two(combined),
        expanded = interval(expanded, combined, unit),
    )
}

/// An interval, with as many digits as its standard uncertainty asks for.
fn interval(ends: [f64; 2], uncertainty: f64, unit: &str) -> String {
    let scale = Scale::of(ends[1], unit);
    let ends = ends.map(|end| scale.show(end, Some(uncertainty)));
    escaped(&format!("{} to {} {}", ends[0], ends[1], scale.unit))
}

fn per_cents(e: &Estimate) -> String {
    let words: Vec<String> = e
        .input_sensitivities
        .iter()
        .take(NAMED)
        .map(|p| {
            let change = match p.relative {
                Some(relative) => format!("{} %", short(100.0 * relative)),
                None => quantity(p.change, e.name.unit()),
            };
            format!("{}: {change}", p.source)
        })
        .collect();
    match words.is_empty() {
        true => String::new(),
        false => format!(
            "<p class=\"note\">Sensitivity of {} to +1 % of inputs without a stated uncertainty: {}.</p>\n",
            escaped(&e.label()),
            escaped(&words.join(", "))
        ),
    }
}

fn monte_carlo(e: &Estimate) -> String {
    let Some(found) = &e.monte_carlo else { return String::new() };
    let scale = Scale::of(found.std, e.name.unit());
    let [std, linear] = [found.std, found.linear_std].map(|x| scale.show(x, Some(x)));
    format!(
        "<p class=\"note\">{} fits with other known numbers and other noise spread by \u{b1} {std} {unit}, \
         \u{b1} {linear} {unit} by the budget.</p>\n",
        found.fits,
        unit = escaped(&scale.unit)
    )
}
