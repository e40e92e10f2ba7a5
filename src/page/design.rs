//! The page of a planned experiment (`rodfit design`).
//!
//! Input: a design. The first card has the expected standard errors and intervals. Sections have the contribution of
//! each measurement, and plots of the standard errors over marker position, duration and frame rate with the
//! recommended choice. Further ones have the uncertainty budget, undetected biases, correlations and cost. Output: a
//! self-contained HTML page.

use crate::fit::{
    Advice, Choice, Contribution, Design, DesignVariable, Estimate, quoted_estimates,
};
use crate::page::budget::budgets;
use crate::page::card::{MessageList, card};
use crate::page::chart::{ChartAxis, PageChart, Points};
use crate::page::correlation::correlation_matrix;
use crate::page::effects::{largest_biases, undetected_bias};
use crate::page::estimate::estimate_table;
use crate::page::figure::{figure, row, series_color};
use crate::page::html::{capitalized, folded, note, section};
use crate::page::number::{Scale, percent, quantity};
use crate::page::page;
use crate::page::table::{HtmlTable, KeyTable};
use crate::summary::Tone;

/// Measurements in the table of contributions that are shown at once; further ones are folded.
const SHOWN_MEASUREMENTS: usize = 12;

/// A self-contained HTML page of a planned experiment. `title` names the plan, for example its file. Sections without
/// content are left out.
pub fn design_page(design: &Design, title: &str) -> String {
    let choices: String = design.advice.iter().map(|advice| choice(advice, design)).collect();
    let (parameters, singular_values) = (&design.parameters, &design.singular_values);
    let matrix = correlation_matrix(parameters, &design.correlation, singular_values);
    let cost = KeyTable::default()
        .row("cost", format!("equal to {:.1} full simulations", design.simulations))
        .row("wall-clock time", quantity(design.wall_seconds, "s"));
    let contributions = contributions(&design.contributions, parameters);
    let body = first_card(design)
        + &section("Contribution of each measurement", &contributions)
        + &section("Marker position, duration and frame rate", &row(&choices))
        + &section("Uncertainty budget", &budgets(parameters))
        + &section("Undetected bias", &undetected_bias(&design.undetected_bias))
        + &section("Correlation matrix", &matrix)
        + &section("Cost", &cost.render());
    page("Plan", title, &body, None)
}

/// The first card, HTML: whether the plan determines all parameters, and their expected standard errors and intervals.
/// Below them are a note on which errors the intervals contain, the largest undetected biases, and lists of warnings
/// and of parameters that are not identifiable.
fn first_card(design: &Design) -> String {
    let (unknown, all) =
        (design.parameters.iter().filter(|e| !e.identifiable).count(), design.parameters.len());
    let headline = match (unknown, design.warnings.is_empty()) {
        (0, true) => "The plan determines all parameters".to_string(),
        (0, false) => "The plan determines all parameters, with warnings".into(),
        (n, _) => format!("The plan does not determine {n} of {all} parameters"),
    };
    let tone = Tone::of_result(unknown == 0, !design.warnings.is_empty());
    // The basis states which errors the intervals contain.
    let estimates = quoted_estimates(&design.parameters, &[]);
    let basis = if estimates.iter().any(|row| row.is_expanded) {
        "Expanded interval: noise, inputs with a stated uncertainty, and discretization."
    } else if estimates.iter().any(|row| row.std.is_some()) {
        "Statistical interval: inputs are taken as exact."
    } else {
        ""
    };
    let content = estimate_table(&estimates, "assumed value", "expected standard error", basis)
        + &note(&largest_biases(&design.undetected_bias, &design.parameters));
    let findings = design.not_identifiable.iter();
    let findings = findings.map(|f| f.kind.code().behind(capitalized(&f.description)));
    let never = design.never_identifiable.iter();
    let never = never.map(|name| {
        format!("{name}: not identifiable with any other marker, duration or frame rate")
    });
    let not_identifiable = findings.chain(never).collect();
    let lists = [
        MessageList { heading: "Warnings", messages: design.warnings.clone() },
        MessageList { heading: "Not identifiable", messages: not_identifiable },
    ];
    card(tone, &headline, &content, &lists)
}

/// Text of the standard error `errors[k]` of the parameter `e`: in per cent of its value if the parameter is positive
/// by its kind and its value is above 0, else in its unit; `not identifiable` if missing.
fn shown_error(e: &Estimate, errors: &[Option<f64>], k: usize) -> String {
    let error = errors.get(k).copied().flatten();
    match (error, e.value.filter(|value| e.name.is_positive() && *value > 0.0)) {
        (None, _) => "not identifiable".into(),
        (Some(error), Some(value)) => percent(error / value),
        (Some(error), None) => quantity(error, e.name.unit()),
    }
}

/// The HTML table of expected standard errors by each measurement alone, and by all others without it, two columns per
/// parameter; rows beyond [`SHOWN_MEASUREMENTS`] are folded. Empty without measurements.
fn contributions(contributions: &[Contribution], parameters: &[Estimate]) -> String {
    if contributions.is_empty() {
        return String::new();
    }
    let mut table = HtmlTable::new("contribution of each measurement", contributions)
        .id("contributions")
        .text("measurement", |c| match c.axis.is_empty() {
            true => c.measurement.clone(),
            false => format!("{}: {}", c.measurement, c.axis),
        })
        .text("values", |c| c.values.to_string());
    for (k, e) in parameters.iter().enumerate() {
        table = table
            .text(&format!("{}, alone", e.label()), |c| shown_error(e, &c.std_error_alone, k))
            .text(&format!("{}, without it", e.label()), |c| {
                shown_error(e, &c.std_error_without, k)
            });
    }
    note(
        "Expected standard errors by the measurement alone, and by all others without it. Both include the priors.",
    ) + &table.render_folded(SHOWN_MEASUREMENTS, "measurements")
}

/// Title of the figure, name of the abscissa and its SI unit, of a design variable (marker position, duration or frame
/// rate).
fn wording(variable: DesignVariable) -> [&'static str; 3] {
    match variable {
        DesignVariable::MarkerPosition => ["Marker position", "arc length from the wall", "m"],
        DesignVariable::Duration => ["Duration", "duration", "s"],
        DesignVariable::FrameRate => ["Frame rate", "frame rate", "Hz"],
    }
}

/// The figure (HTML) of the standard errors over one design variable, relative to those of the plan, with a line per
/// parameter. A folded table has the values. Both axes are logarithmic, except that of the marker position. A dashed
/// line marks the planned choice; the caption names the recommended one. Empty if no choice determines any parameter.
fn choice(advice: &Advice, design: &Design) -> String {
    let Advice { variable, choices, observation, .. } = advice;
    if choices.iter().flat_map(|choice| &choice.std_error).all(Option::is_none) {
        return String::new();
    }
    // Standard errors of all parameters share one axis, as each is relative to its planned one.
    let [title, name, unit] = wording(*variable);
    let scale = Scale::for_values(choices.iter().map(|choice| choice.value), unit);
    let x = ChartAxis::new(name, &scale).log(*variable != DesignVariable::MarkerPosition);
    let y = ChartAxis::from("standard error / that of the plan").log(true);
    let mut chart = PageChart::new(x, y, [520.0, 300.0]);
    for (j, e) in design.parameters.iter().enumerate() {
        chart = chart.dotted_line(&e.label(), relative_errors(choices, j), &series_color(j), 3.5);
    }
    if let Some(planned) = choices.iter().find(|choice| choice.planned) {
        chart = chart.mark(planned.value);
    }
    let best = choices.iter().find(|choice| choice.best);
    let best = best.map(|best| format!("; recommended: {}", quantity(best.value, unit)));
    let of = match observation.is_empty() {
        true => String::new(),
        false => format!(", {observation}"),
    };
    let drawn = figure(
        &format!("{title}{of}"),
        &format!("standard errors over the {}{of}", title.to_lowercase()),
        &chart,
        &format!("dashed: the plan{}", best.unwrap_or_default()),
    );
    // The table has the values in units, with the planned and the recommended choice marked.
    let mut table = HtmlTable::new(&format!("expected standard errors over the {name}"), choices)
        .row_class(|choice| if choice.best { "chosen" } else { "" })
        .text(name, |choice| quantity(choice.value, unit));
    for (k, e) in design.parameters.iter().enumerate() {
        table = table.text(&e.label(), |choice| shown_error(e, &choice.std_error, k));
    }
    let table = table.text("", |choice| {
        let marks = [(choice.planned, "planned"), (choice.best, "recommended")];
        let marks = marks.into_iter().filter(|(is_marked, _)| *is_marked);
        marks.map(|(_, mark)| mark).collect::<Vec<_>>().join(", ")
    });
    format!("<div>{drawn}{}</div>", folded("standard errors", &table.render()))
}

/// Points `[value, ratio]` of the choices: the standard error of the parameter with this index, relative to that of the
/// planned choice, or to the smallest one if the plan does not determine the parameter. Choices that do not determine
/// it are left out.
fn relative_errors(choices: &[Choice], parameter: usize) -> Points {
    let error = |choice: &Choice| choice.std_error.get(parameter).copied().flatten();
    let planned = choices.iter().find(|choice| choice.planned).and_then(error);
    let smallest = choices.iter().filter_map(error).fold(f64::INFINITY, f64::min);
    let unit = planned.unwrap_or(smallest);
    choices.iter().filter_map(|choice| Some([choice.value, error(choice)? / unit])).collect()
}
