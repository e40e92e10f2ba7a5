//! The page that compares several fits: a plot and a table of every parameter, with the grades.

use crate::fit::{Estimate, FitSummary, Grade, QuotedEstimate, QuotedInterval, interval_heading};
use crate::page::card::{Tone, card};
use crate::page::chart::{Chart, labeled};
use crate::page::estimate::interval;
use crate::page::figure::{OBSERVED, figure};
use crate::page::fit::{error_head, tone};
use crate::page::html::{capitalized, escaped, section, with_explanation};
use crate::page::number::{NONE, Scale};
use crate::page::page;
use crate::page::table::Table;
use crate::summary::quantity::counted;

/// Height of a row of a plot, and of its axis, px.
const ROW_HEIGHT: f64 = 24.0;
const AXIS_HEIGHT: f64 = 70.0;
/// Fits that are drawn with their names; the plot of more has their numbers.
const MAX_NAMED: usize = 60;
/// Rows of a table that are not folded.
const SHOWN: usize = 60;
/// Fewest values with a mean and a standard deviation.
const FEWEST: usize = 3;

/// A self-contained HTML page that compares fits. `title` names them, for example their campaign.
pub fn comparison_page(fits: &[FitSummary], title: &str) -> String {
    let mut labels: Vec<String> = Vec::new();
    for label in fits.iter().flat_map(|fit| &fit.parameters).map(Estimate::label) {
        if !labels.contains(&label) {
            labels.push(label);
        }
    }
    let mut body = first_card(fits, &labels);
    for label in &labels {
        body += &section(&escaped(label), &parameter(fits, label));
    }
    body += &section("Grades and warnings", &grades(fits));
    page("Comparison", title, &body, None)
}

/// The estimate of a parameter in a fit.
fn estimate<'a>(fit: &'a FitSummary, label: &str) -> Option<&'a Estimate> {
    fit.parameters.iter().find(|e| e.label() == *label)
}

/// The numbers of fits of each grade, and the mean of every parameter with its scatter.
fn first_card(fits: &[FitSummary], labels: &[String]) -> String {
    let is = |tone: Tone| move |fit: &FitSummary| tone_of(fit) == tone;
    let tone = match (fits.iter().all(is(Tone::Good)), fits.iter().any(is(Tone::Bad))) {
        (true, _) => Tone::Good,
        (_, true) => Tone::Bad,
        _ => Tone::Doubtful,
    };
    let mut counts: Vec<(String, usize)> = Vec::new();
    for name in fits.iter().map(|fit| grade_of(fit.grade)) {
        match counts.iter_mut().find(|(other, _)| *other == name) {
            Some((_, count)) => *count += 1,
            None => counts.push((name, 1)),
        }
    }
    let counts: Vec<String> =
        counts.iter().map(|(name, count)| format!("{count}: {}", escaped(name))).collect();
    let heads = [
        "parameter",
        "fits",
        "mean",
        "standard deviation between fits",
        "smallest",
        "largest",
        "unit",
    ];
    let mut table = Table::new("means over all fits", heads).id("answer");
    for label in labels {
        let own: Vec<&Estimate> = fits.iter().filter_map(|fit| estimate(fit, label)).collect();
        let values: Vec<f64> =
            own.iter().filter(|e| e.identifiable).filter_map(|e| e.value).collect();
        let Some(first) = own.first().filter(|_| !values.is_empty()) else { continue };
        let scale = Scale::fitting(values.iter().copied(), first.name.unit());
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let squares: f64 = values.iter().map(|x| (x - mean).powi(2)).sum();
        let std = (values.len() >= FEWEST).then(|| (squares / (n - 1.0)).sqrt());
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let show = |x: f64| scale.show(x, std);
        let cells = vec![
            Some(values.len().to_string()),
            std.map(|_| format!("<b>{}</b>", show(mean))),
            std.map(show),
            Some(show(low)),
            Some(show(high)),
            Some(escaped(&scale.unit)),
        ];
        table.row(escaped(label), cells);
    }
    let content = format!("<p>{}.</p>\n{}", counts.join(", "), table.html());
    card(tone, &counted(fits.len(), "fit"), &content, &[])
}

fn tone_of(fit: &FitSummary) -> Tone {
    fit.grade.map_or(Tone::Bad, tone)
}

fn grade_of(grade: Option<Grade>) -> String {
    grade.map_or("without a result".into(), |grade| grade.to_string())
}

/// The name of a fit, linked to its page where it has one.
fn linked(fit: &FitSummary) -> String {
    let name = escaped(&fit.name);
    match &fit.page {
        Some(page) => format!("<a href=\"{}\">{name}</a>", escaped(&address(page))),
        None => name,
    }
}

/// A relative address: a colon or another special character of a name is no part of its syntax.
fn address(path: &str) -> String {
    let mut address = String::from("./");
    for byte in path.bytes() {
        match byte {
            b'A'..=b'Z' | b'a'..=b'z' | b'0'..=b'9' | b'-' | b'_' | b'.' | b'~' | b'/' => {
                address.push(char::from(byte));
            }
            _ => address += &format!("%{byte:02X}"),
        }
    }
    address
}

/// A plot of the intervals of a parameter, and its table.
fn parameter(fits: &[FitSummary], label: &str) -> String {
    let own: Vec<(&FitSummary, &Estimate)> =
        fits.iter().filter_map(|fit| Some((fit, estimate(fit, label)?))).collect();
    let Some((_, first)) = own.first() else { return String::new() };
    let sizes =
        own.iter().flat_map(|(_, e)| e.value.into_iter().chain(ends(e).into_iter().flatten()));
    let scale = Scale::fitting(sizes, first.name.unit());
    let numbered = |k: usize, fit: &FitSummary| match own.len() <= MAX_NAMED {
        true => fit.name.clone(),
        false => (k + 1).to_string(),
    };
    let names = own.iter().enumerate().map(|(k, (fit, _))| numbered(k, fit)).collect();
    let height = AXIS_HEIGHT + ROW_HEIGHT * own.len() as f64;
    let points: Vec<((f64, f64), [f64; 2])> = own
        .iter()
        .enumerate()
        .filter_map(|(k, (_, e))| {
            let value = e.value?;
            let ends = ends(e).unwrap_or([value; 2]);
            Some(((value / scale.factor, -(k as f64)), ends.map(|end| end / scale.factor)))
        })
        .collect();
    let chart = Chart::new(labeled(label, &scale.unit), "fit")
        .size(520.0, height)
        .rows(names)
        .dots_with_bars(label, &points, OBSERVED);
    let drawn =
        figure("Estimates", &format!("{label} of every fit"), &chart, "bars: 95 % intervals");
    drawn + &table(&own, label, &scale)
}

/// Ends of the quoted interval.
fn ends(e: &Estimate) -> Option<[f64; 2]> {
    e.expanded95.filter(|_| QuotedEstimate::of(e).is_expanded).or(e.interval95)
}

fn table(own: &[(&FitSummary, &Estimate)], label: &str, scale: &Scale) -> String {
    let rows: Vec<QuotedEstimate> = own.iter().map(|(_, e)| QuotedEstimate::of(e)).collect();
    let heads = ["fit", "estimate", error_head(&rows), interval_heading(&rows), "unit", "grade"];
    let mut table = Table::new(&format!("{label} of every fit"), heads);
    for ((fit, e), quoted) in own.iter().zip(&rows) {
        let show = |x: f64| scale.show(x, quoted.std.or(Some(1e-3 * x.abs())));
        let bound = quoted.interval.map(|bound| match bound {
            QuotedInterval::AtLeast(lower) => format!("at least {} (one-sided)", show(lower)),
            QuotedInterval::AtMost(upper) => format!("at most {} (one-sided)", show(upper)),
            QuotedInterval::Between(ends) => interval(ends, quoted.std, scale),
        });
        let value = match e.value {
            Some(value) => format!("<b>{}</b>", show(value)),
            None if e.lower95.is_some() => NONE.into(),
            None => "<td class=\"bad\">not identifiable</td>".into(),
        };
        let cells = vec![
            Some(value),
            quoted.std.map(show),
            bound,
            Some(escaped(&scale.unit)),
            Some(colored(fit)),
        ];
        table.row(linked(fit), cells);
    }
    table.folded_after(SHOWN, "fits")
}

/// The grade in its color.
fn colored(fit: &FitSummary) -> String {
    let class = tone_of(fit).class();
    format!("<td class=\"{class}\">{}</td>", escaped(&grade_of(fit.grade)))
}

/// Grade, warnings and changed keys of every fit.
fn grades(fits: &[FitSummary]) -> String {
    let mut keys: Vec<&str> = Vec::new();
    for (key, _) in fits.iter().flat_map(|fit| &fit.changes) {
        if !keys.contains(&&key[..]) {
            keys.push(key);
        }
    }
    let heads = ["fit", "grade", "warnings", "status"].map(String::from).into_iter();
    let heads = heads.chain(keys.iter().map(|key| escaped(key)));
    let mut table = Table::new("grades and warnings", heads).id("grades");
    for fit in fits {
        let codes: Vec<String> = fit
            .warning_codes
            .iter()
            .map(|code| format!("<code>{}</code>", escaped(code)))
            .collect();
        let status = match fit.status.as_str() {
            "converged" => String::new(),
            status => with_explanation(&capitalized(status)),
        };
        let status = (!status.is_empty()).then(|| format!("<td class=\"long\">{status}</td>"));
        let mut cells = vec![Some(colored(fit)), Some(codes.join(" ")), status];
        let value = |key: &&str| {
            let own = fit.changes.iter().find(|(own, _)| own == key);
            own.map(|(_, value)| escaped(value))
        };
        cells.extend(keys.iter().map(value));
        table.row(linked(fit), cells);
    }
    table.folded_after(SHOWN, "fits")
}
