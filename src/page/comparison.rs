//! The page that compares several fits, of a campaign or of one command.
//!
//! Input: the summaries of the fits. The first card has the number of fits per grade, and for each parameter the
//! smallest and largest value of the fits that identify it. From [`MIN_VALUES`] values on it has their mean and the
//! standard deviation between fits too. Then each parameter has a section with a plot and a table of its estimates with
//! 95 % intervals. The last table has the grade, the status of fits that did not converge, the warnings, and a column
//! per changed key. Output: a self-contained HTML page.

use crate::fit::{Estimate, FitSummary, Grade, QuotedEstimate, interval_heading};
use crate::page::card::{card, tone_class};
use crate::page::chart::{ChartAxis, IntervalPoint, PageChart};
use crate::page::drawing::shortened;
use crate::page::estimate::{NOT_IDENTIFIABLE, error_heading, quoted_interval};
use crate::page::figure::{OBSERVED, figure};
use crate::page::html::{capitalized, escaped, percent_encoded, section, with_explanation};
use crate::page::number::{MISSING, Scale};
use crate::page::page;
use crate::page::plane::range;
use crate::page::table::HtmlTable;
use crate::summary::quantity::counted;
use crate::summary::{Tone, distinct};
use std::collections::BTreeSet;

/// Height of a row of a plot, px.
const ROW_HEIGHT: f64 = 24.0;
/// Height of a plot's axis with its label, px.
const AXIS_HEIGHT: f64 = 70.0;
/// Most fits that are drawn with their names; the plot of more has their numbers.
const MAX_NAMED: usize = 60;
/// Rows of a table that are shown at once; further ones are folded.
const SHOWN_FITS: usize = 60;
/// Fewest values of which a mean and a standard deviation are shown: of two values they mean little.
const MIN_VALUES: usize = 3;

/// A self-contained HTML page that compares fits, with a section for each parameter that any fit has. `title` names
/// them, for example their campaign.
pub fn comparison_page(fits: &[FitSummary], title: &str) -> String {
    let labels = distinct(fits.iter().flat_map(|fit| &fit.parameters).map(Estimate::label));
    let parameters: Vec<ComparedParameter> =
        labels.iter().map(|label| ComparedParameter::new(fits, label)).collect();
    let mut body = first_card(fits, &parameters);
    for parameter in &parameters {
        body += &section(parameter.label, &(parameter.plot() + &parameter.table()));
    }
    body += &section("Grades and warnings", &grade_table(fits));
    page("Comparison", title, &body, None)
}

/// A parameter with its label, its SI unit, and its estimate in each fit that has it.
struct ComparedParameter<'a> {
    label: &'a str,
    unit: &'static str,
    estimates: Vec<ComparedEstimate<'a>>,
}

/// A fit with its estimate of the parameter.
struct ComparedEstimate<'a> {
    fit: &'a FitSummary,
    estimate: &'a Estimate,
}

/// Statistics of the values of a parameter over all fits that identify it, in SI units.
struct ValueStatistics {
    count: usize,
    mean: f64,
    /// `None` of fewer than [`MIN_VALUES`] values.
    std: Option<f64>,
    range: [f64; 2],
}

impl<'a> ComparedParameter<'a> {
    /// Collects the estimates of the parameter with this label from all fits that have it, in their order; the unit is
    /// that of the first.
    fn new(fits: &'a [FitSummary], label: &'a str) -> Self {
        let own = |fit: &'a FitSummary| {
            let estimate = fit.parameters.iter().find(|e| e.label() == *label)?;
            Some(ComparedEstimate { fit, estimate })
        };
        let estimates: Vec<ComparedEstimate> = fits.iter().filter_map(own).collect();
        let unit = estimates.first().map_or("", |own| own.estimate.name.unit());
        Self { label, unit, estimates }
    }

    /// The values, in SI units, of the fits in which the parameter is identifiable, in their order.
    fn values(&self) -> Vec<f64> {
        let identifiable = self.estimates.iter().map(|own| own.estimate).filter(|e| e.identifiable);
        identifiable.filter_map(|e| e.value).collect()
    }

    /// Number, mean, standard deviation (divisor n - 1; none of fewer than [`MIN_VALUES`]), smallest and largest of the
    /// values; `None` without values.
    fn statistics(&self) -> Option<ValueStatistics> {
        let values = self.values();
        let count = values.len();
        let mean = values.iter().sum::<f64>() / count as f64;
        let squares: f64 = values.iter().map(|x| (x - mean).powi(2)).sum();
        let std = (count >= MIN_VALUES).then(|| (squares / (count as f64 - 1.0)).sqrt());
        let range = range(values);
        (count > 0).then_some(ValueStatistics { count, mean, std, range })
    }

    /// The unit with a prefix in which all values and ends of intervals of the parameter are displayed, by the largest
    /// absolute one.
    fn scale(&self) -> Scale {
        let sizes = self.estimates.iter().map(|own| own.estimate);
        let sizes = sizes.flat_map(|e| e.value.into_iter().chain(ends(e).into_iter().flatten()));
        Scale::for_values(sizes, self.unit)
    }

    /// The figure (HTML) with one row per fit, from the top: its value as a dot and its quoted 95 % interval as a bar.
    /// Rows have names, numbers if there are more than [`MAX_NAMED`] fits, or both if names are not unique.
    fn plot(&self) -> String {
        let count = self.estimates.len();
        let has_numbers = self.has_numbers();
        // Names of many fits would overlap.
        let name = |(k, own): (usize, &ComparedEstimate)| match (has_numbers, count <= MAX_NAMED) {
            (false, _) => own.fit.name.clone(),
            (true, true) => format!("{}: {}", k + 1, own.fit.name),
            (true, false) => (k + 1).to_string(),
        };
        let point = |(k, own): (usize, &ComparedEstimate)| {
            let value = own.estimate.value?;
            // An estimate without an interval has a bar of length zero.
            let ends = ends(own.estimate).unwrap_or([value; 2]);
            Some(IntervalPoint { at: [value, -(k as f64)], ends })
        };
        let numbered = || self.estimates.iter().enumerate();
        let points: Vec<IntervalPoint> = numbered().filter_map(point).collect();
        let size = [520.0, AXIS_HEIGHT + ROW_HEIGHT * count as f64];
        let chart = PageChart::new(ChartAxis::new(self.label, &self.scale()), "fit", size)
            .row_names(numbered().map(name).collect())
            .dots_with_bars(self.label, &points, OBSERVED);
        let name = format!("{} of every fit", self.label);
        figure("Estimates", &name, &chart, "bars: 95 % intervals")
    }

    /// Whether the axis and the table number the fits: there are more than [`MAX_NAMED`], or their shortened names are
    /// not unique.
    fn has_numbers(&self) -> bool {
        let names: BTreeSet<String> =
            self.estimates.iter().map(|own| shortened(&own.fit.name)).collect();
        self.estimates.len() > MAX_NAMED || names.len() < self.estimates.len()
    }

    /// The HTML table with name, estimate, standard error, quoted interval, unit and grade of every fit that has the
    /// parameter. All numbers have one unit. Names have the number of the fit if the plot has numbers. Rows beyond
    /// [`SHOWN_FITS`] are folded.
    fn table(&self) -> String {
        let has_numbers = self.has_numbers();
        // One unit for all fits makes their numbers comparable.
        let scale = self.scale();
        let quoted: Vec<QuotedEstimate> =
            self.estimates.iter().map(|own| QuotedEstimate::new(own.estimate)).collect();
        let bound_error = |std: Option<f64>, bound: f64| std.unwrap_or(1e-3 * bound.abs());
        let show = |row: &QuotedEstimate, x: f64| scale.format(x, Some(bound_error(row.std, x)));
        let numbers = (1..).map(|k| if has_numbers { format!("{k}: ") } else { String::new() });
        let rows = self.estimates.iter().zip(&quoted).zip(numbers);
        HtmlTable::new(&format!("{} of every fit", self.label), rows)
            .html("fit", |((own, _), number)| format!("{number}{}", linked_name(own.fit)))
            .html("estimate", |((own, row), _)| match own.estimate.value {
                Some(value) => format!("<b>{}</b>", show(row, value)),
                None if own.estimate.lower95.is_some() => MISSING.into(),
                None => NOT_IDENTIFIABLE.into(),
            })
            .text(error_heading(&quoted), |((_, row), _)| row.std.map(|std| show(row, std)))
            .text(interval_heading(&quoted), |((_, row), _)| {
                let bound_error = |bound: f64| bound_error(row.std, bound);
                row.interval.map(|x| quoted_interval(x, row.std, &scale, bound_error))
            })
            .text("unit", |_| scale.unit.clone())
            .html("grade", |((own, _), _)| colored_grade(own.fit))
            .render_folded(SHOWN_FITS, "fits")
    }
}

/// Ends of the quoted 95 % interval in SI units: the expanded one if inputs have a stated uncertainty, else the
/// statistical one; `None` without a two-sided interval.
fn ends(e: &Estimate) -> Option<[f64; 2]> {
    e.expanded95.filter(|_| QuotedEstimate::new(e).is_expanded).or(e.interval95)
}

/// The first card, HTML: numbers of fits of each grade, and a table with the mean of every parameter, its standard
/// deviation between fits (both from [`MIN_VALUES`] values on) and its range. Its severity is good if all fits are, bad
/// if any fit is, else doubtful.
fn first_card(fits: &[FitSummary], parameters: &[ComparedParameter]) -> String {
    let is = |tone: Tone| move |fit: &FitSummary| fit_tone(fit) == tone;
    // The page has the worst tone of its fits.
    let tone = match (fits.iter().all(is(Tone::Good)), fits.iter().any(is(Tone::Bad))) {
        (true, _) => Tone::Good,
        (_, true) => Tone::Bad,
        _ => Tone::Doubtful,
    };
    let names: Vec<String> = fits.iter().map(grade_name).collect();
    let count = |name: String| {
        let count = names.iter().filter(|other| **other == name).count();
        format!("{count}: {}", escaped(&name))
    };
    let counts: Vec<String> = distinct(names.iter().cloned()).into_iter().map(count).collect();
    let statistics = parameters.iter().filter_map(|parameter| {
        let scale = Scale::for_values(parameter.values(), parameter.unit);
        Some((parameter.label, parameter.statistics()?, scale))
    });
    let table = HtmlTable::new("means over all fits", statistics)
        .id("answer")
        .text("parameter", |(label, ..)| label.to_string())
        .text("fits", |(_, s, _)| s.count.to_string())
        .html("mean", |(_, s, scale)| {
            s.std.map(|std| format!("<b>{}</b>", scale.format(s.mean, Some(std))))
        })
        .text("standard deviation between fits", |(_, s, scale)| {
            s.std.map(|std| scale.format(std, Some(std)))
        })
        .text("smallest", |(_, s, scale)| scale.format(s.range[0], s.std))
        .text("largest", |(_, s, scale)| scale.format(s.range[1], s.std))
        .text("unit", |(.., scale)| scale.unit.clone());
    let content = format!("<p>{}.</p>\n{}", counts.join(", "), table.render());
    card(tone, &counted(fits.len(), "fit"), &content, &[])
}

/// The severity of a fit's grade; bad for a fit without a result.
fn fit_tone(fit: &FitSummary) -> Tone {
    fit.grade.map_or(Tone::Bad, Grade::tone)
}

/// The grade of a fit as text, or `without a result`.
fn grade_name(fit: &FitSummary) -> String {
    fit.grade.map_or("without a result".into(), |grade| grade.to_string())
}

/// The name of a fit as HTML, linked to its page if it has one.
fn linked_name(fit: &FitSummary) -> String {
    let name = escaped(&fit.name);
    match &fit.page {
        // The leading "./" keeps a colon in a name from being read as that of a scheme.
        Some(page) => format!("<a href=\"./{}\">{name}</a>", percent_encoded(page, b"/")),
        None => name,
    }
}

/// The grade of a fit as a table cell (HTML) in the color of its severity.
fn colored_grade(fit: &FitSummary) -> String {
    format!("<td class=\"{}\">{}</td>", tone_class(fit_tone(fit)), escaped(&grade_name(fit)))
}

/// The HTML table with name, grade, warning codes, status (unless converged) and changed keys of every fit, a column
/// per key; rows beyond [`SHOWN_FITS`] are folded.
fn grade_table(fits: &[FitSummary]) -> String {
    // Fits may change different keys: the columns are their union.
    let keys = distinct(fits.iter().flat_map(|fit| &fit.changes).map(|(key, _)| key));
    let mut table = HtmlTable::new("grades and warnings", fits)
        .id("grades")
        .html("fit", |fit| linked_name(fit))
        .html("grade", |fit| colored_grade(fit))
        .html("warnings", |fit| {
            let codes = fit.warning_codes.iter();
            let codes = codes.map(|code| format!("<code>{}</code>", escaped(code)));
            codes.collect::<Vec<_>>().join(" ")
        })
        .html("status", |fit| {
            let status = with_explanation(&capitalized(&fit.status));
            let is_shown = fit.status != "converged" && !status.is_empty();
            is_shown.then(|| format!("<td class=\"long\">{status}</td>"))
        });
    for key in keys {
        table = table.text(key, |fit| {
            let own = fit.changes.iter().find(|(other, _)| other == key);
            own.map(|(_, value)| value.clone())
        });
    }
    table.render_folded(SHOWN_FITS, "fits")
}
