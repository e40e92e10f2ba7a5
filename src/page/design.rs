//! The page of a planned experiment: the expected uncertainty, the contribution of each measurement, and other choices of
//! marker, duration and frame rate.

use crate::fit::{
    Advice, Choice, Contribution, Design, DesignVariable, Estimate, quoted_estimates,
};
use crate::page::budget::budgets;
use crate::page::card::{Tone, card};
use crate::page::chart::{Chart, labeled};
use crate::page::correlation::Correlations;
use crate::page::effects::{largest_biases, undetected_bias};
use crate::page::figure::{figure, row};
use crate::page::html::{capitalized, escaped, folded, note, section, section_if_any};
use crate::page::number::{Scale, percent, quantity};
use crate::page::table::{Table, of_keys};
use crate::page::{estimate, page};

/// Colors of the parameters.
const COLORS: usize = 6;
/// Measurements that are not folded.
const SHOWN: usize = 12;

/// A self-contained HTML page of a planned experiment. `title` names the plan, for example its file.
pub fn design_page(design: &Design, title: &str) -> String {
    let mut body = first_card(design);
    let contributions = contributions(&design.contributions, &design.parameters);
    body += &section_if_any("Contribution of each measurement", &contributions);
    let choice = |advice| format!("<div>{}</div>", choice(advice, design));
    let choices: String = design.advice.iter().map(choice).collect();
    let choices = row(&choices.replace("<div></div>", ""));
    body += &section_if_any("Marker position, duration and frame rate", &choices);
    body += &section_if_any("Uncertainty budget", &budgets(&design.parameters));
    body += &section_if_any("Undetected bias", &undetected_bias(&design.undetected_bias));
    body += &section_if_any("Correlation matrix", &Correlations::from(design).html());
    let rows = [
        ("cost", format!("{:.1} simulations", design.simulations)),
        ("wall-clock time", quantity(design.wall_seconds, "s")),
    ];
    body += &section("Cost", &of_keys(&rows));
    page("Plan", title, &body, None)
}

/// The expected standard errors and intervals, and the warnings.
fn first_card(design: &Design) -> String {
    let unknown = design.parameters.iter().filter(|e| !e.identifiable).count();
    let (tone, headline) = match (unknown, design.warnings.is_empty()) {
        (0, true) => (Tone::Good, "The plan determines all parameters".to_string()),
        (0, false) => (Tone::Doubtful, "The plan determines all parameters, with warnings".into()),
        (n, _) => {
            let all = design.parameters.len();
            (Tone::Bad, format!("The plan does not determine {n} of {all} parameters"))
        }
    };
    let heads = ["assumed value", "expected standard error"];
    let mut content = estimate::table(&quoted_estimates(&design.parameters, &[]), heads);
    content += &note(&largest_biases(&design.undetected_bias, &design.parameters));
    let findings = design.not_identifiable.iter();
    let findings: Vec<String> =
        findings.map(|f| f.kind.code().behind(capitalized(&f.description))).collect();
    let never = design.never_identifiable.iter();
    let never = never.map(|name| {
        format!("{name}: not identifiable with any other marker, duration or frame rate")
    });
    card(
        tone,
        &headline,
        &content,
        &[
            ("Warnings", design.warnings.clone()),
            ("Not identifiable", findings.into_iter().chain(never).collect()),
        ],
    )
}

/// A standard error, in per cent of a value that is positive.
fn error_of(e: &Estimate, error: Option<f64>) -> Option<String> {
    let error = error?;
    Some(match e.value.filter(|value| e.name.is_positive() && *value > 0.0) {
        Some(value) => percent(error / value),
        None => escaped(&quantity(error, e.name.unit())),
    })
}

fn contributions(contributions: &[Contribution], parameters: &[Estimate]) -> String {
    if contributions.is_empty() {
        return String::new();
    }
    let of_each = |e: &Estimate| {
        ["alone", "without it"].map(|kind| format!("{}, {kind}", escaped(&e.label())))
    };
    let heads = ["measurement".to_string(), "values".into()].into_iter();
    let heads = heads.chain(parameters.iter().flat_map(of_each));
    let mut table = Table::new("contribution of each measurement", heads).id("contributions");
    for one in contributions {
        let name = match one.axis.is_empty() {
            true => escaped(&one.measurement),
            false => format!("{}: {}", escaped(&one.measurement), escaped(&one.axis)),
        };
        let errors = one.std_error_alone.iter().zip(&one.std_error_without).zip(parameters);
        let errors = errors.flat_map(|((alone, without), e)| {
            [alone, without].map(|error| error_of(e, *error).or(Some("not identifiable".into())))
        });
        let cells = std::iter::once(Some(one.values.to_string())).chain(errors).collect();
        table.row(name, cells);
    }
    note(
        "Expected standard errors by the measurement alone, and by all others without it. Both include the priors.",
    ) + &table.folded_after(SHOWN, "measurements")
}

/// Title, name of the abscissa and its unit.
fn wording(variable: DesignVariable) -> [&'static str; 3] {
    match variable {
        DesignVariable::MarkerPosition => ["Marker position", "arc length from the wall", "m"],
        DesignVariable::Duration => ["Duration", "duration", "s"],
        DesignVariable::FrameRate => ["Frame rate", "frame rate", "Hz"],
    }
}

/// The standard errors over one choice, relative to those of the plan, with a table.
fn choice(advice: &Advice, design: &Design) -> String {
    let is_determined = |choice: &Choice| choice.std_error.iter().any(Option::is_some);
    if !advice.choices.iter().any(is_determined) {
        return String::new();
    }
    let [title, name, unit] = wording(advice.variable);
    let scale = Scale::fitting(advice.choices.iter().map(|choice| choice.value), unit);
    let mut chart = Chart::new(labeled(name, &scale.unit), "standard error / that of the plan")
        .log(advice.variable != DesignVariable::MarkerPosition, true)
        .size(520.0, 300.0);
    for (j, e) in design.parameters.iter().enumerate() {
        let points = relative_errors(&advice.choices, j);
        let points: Vec<(f64, f64)> =
            points.into_iter().map(|(x, y)| (x / scale.factor, y)).collect();
        let color = format!("var(--scheme{})", j % COLORS);
        chart =
            chart.line("", points.iter().copied(), &color).dots(&e.label(), points, &color, 3.5);
    }
    if let Some(planned) = advice.choices.iter().find(|choice| choice.planned) {
        chart = chart.mark(planned.value / scale.factor);
    }
    let best = advice.choices.iter().find(|choice| choice.best);
    let best =
        best.map_or(String::new(), |best| format!("; recommended: {}", quantity(best.value, unit)));
    let of = if advice.observation.is_empty() {
        String::new()
    } else {
        format!(", {}", advice.observation)
    };
    let drawn = figure(
        &format!("{title}{}", escaped(&of)),
        &format!("standard errors over the {}{of}", title.to_lowercase()),
        &chart,
        &format!("dashed: the plan{best}"),
    );
    drawn + &folded("standard errors", &choice_table(advice, design, name, unit))
}

/// Standard errors of a parameter over those of the plan, or over the smallest where the plan does not determine it.
fn relative_errors(choices: &[Choice], parameter: usize) -> Vec<(f64, f64)> {
    let error = |choice: &Choice| choice.std_error.get(parameter).copied().flatten();
    let planned = choices.iter().find(|choice| choice.planned).and_then(error);
    let least = choices.iter().filter_map(error).fold(f64::INFINITY, f64::min);
    let unit = planned.unwrap_or(least);
    choices.iter().filter_map(|choice| Some((choice.value, error(choice)? / unit))).collect()
}

fn choice_table(advice: &Advice, design: &Design, name: &str, unit: &str) -> String {
    let labels = design.parameters.iter().map(|e| escaped(&e.label()));
    let heads = std::iter::once(name.to_string()).chain(labels).chain(["".to_string()]);
    let mut table = Table::new(&format!("expected standard errors over the {name}"), heads);
    for choice in &advice.choices {
        let mut cells: Vec<Option<String>> = choice
            .std_error
            .iter()
            .zip(&design.parameters)
            .map(|(error, e)| error_of(e, *error).or(Some("not identifiable".into())))
            .collect();
        let marks = [(choice.planned, "planned"), (choice.best, "recommended")];
        let marks: Vec<&str> = marks.iter().filter(|(is, _)| *is).map(|(_, m)| *m).collect();
        cells.push(Some(marks.join(", ")));
        let class = if choice.best { "chosen" } else { "" };
        table.marked_row(class, quantity(choice.value, unit), cells);
    }
    table.html()
}
