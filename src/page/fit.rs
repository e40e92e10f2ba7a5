//! The page of a fit: the answer first, then the residuals, then its uncertainty and the search.

use crate::code::Code;
use crate::fit::{FitReport, Grade, QuotedEstimate, quoted_estimates};
use crate::page::budget::budgets;
use crate::page::card::{Tone, card};
use crate::page::correlation::Correlations;
use crate::page::discretization::discretization;
use crate::page::effects::{largest_biases, likely_omitted, undetected_bias};
use crate::page::html::{capitalized, escaped, note, section, section_if_any, with_explanation};
use crate::page::parameters::parameters;
use crate::page::profile::profiles;
use crate::page::recordings::recordings;
use crate::page::search::search;
use crate::page::{estimate, page, residuals, settings, shapes};

/// A self-contained HTML page of a fit. `title` names the fit, for example its file. Data,
/// model and the search are shown if the fit [kept its plots](crate::Fit::keep_plot_data).
pub fn fit_page(report: &FitReport, title: &str) -> String {
    let plots = report.plot_data.as_ref();
    let mut body = first_card(report);
    body += &section("Parameters", &parameters(report));
    let tests = Some(&report.residual_tests[..]);
    let series = plots.map(|plots| residuals::all_series(&plots.series, tests));
    body += &section("Residuals", &(residuals::summary(report) + &series.unwrap_or_default()));
    if let Some(errors) = &report.recordings {
        let drawn = plots.and_then(|plots| plots.recordings.as_ref());
        body += &section("Free-run prediction errors", &recordings(errors, drawn));
    }
    let errors = discretization(&report.discretization_error, &report.parameters);
    body += &section_if_any("Discretization error", &errors);
    body += &section_if_any("Uncertainty budget", &budgets(&report.parameters));
    body += &section_if_any("Undetected bias", &undetected_bias(&report.undetected_bias));
    body += &section_if_any("Likely omitted effects", &likely_omitted(&report.score_tests));
    body += &section_if_any("Correlation matrix", &Correlations::from(report).html());
    if let Some(plots) = plots.filter(|plots| !plots.profiles.is_empty()) {
        body += &section("Likelihood profiles", &profiles(report, &plots.profiles));
    }
    body += &section_if_any("Global scan and local minima", &search(report, plots));
    if let Some(plots) = plots {
        let shapes = shapes::shapes(report.interrupted, plots);
        body += &section_if_any(shapes::heading(plots), &shapes);
    }
    body += &section("Settings and cost", &settings::of_fit(report, plots));
    page("Fit", title, &body, plots.map(|plots| &plots.version[..]))
}

/// The tone of a grade.
pub(super) fn tone(grade: Grade) -> Tone {
    match grade {
        Grade::Trustworthy => Tone::Good,
        grade if grade.is_usable() => Tone::Doubtful,
        _ => Tone::Bad,
    }
}

/// Grade, estimates with intervals, and the most severe warnings.
fn first_card(report: &FitReport) -> String {
    let grade = capitalized(&report.grade.to_string());
    let headline = with_explanation(&report.grade.code().behind(&grade));
    let mut content = String::new();
    if !report.verdict.eq_ignore_ascii_case(&grade) {
        content +=
            &format!("<p>{}.</p>\n", escaped(capitalized(&report.verdict).trim_end_matches('.')));
    }
    if !["converged", &report.verdict].contains(&&report.status[..]) {
        content += &note(&escaped(&capitalized(&report.status)));
    }
    let estimates = quoted_estimates(&report.parameters, &report.determined_groups);
    content += &estimate::table(&estimates, ["estimate", error_head(&estimates)]);
    content += &note(&largest_biases(&report.undetected_bias, &report.parameters));
    let findings = report.not_identifiable.iter();
    let findings = findings.map(|found| found.kind.code().behind(&found.description)).collect();
    let likely = report.likely_omitted_effects().into_iter();
    let likely = likely.map(|text| Code::OmittedEffect.behind(capitalized(&text))).collect();
    card(
        tone(report.grade),
        &headline,
        &content,
        &[
            ("Warnings", report.warnings.clone()),
            ("Not identifiable", findings),
            ("Likely omitted effects", likely),
        ],
    )
}

/// The heading of the errors.
pub(super) fn error_head(rows: &[QuotedEstimate]) -> &'static str {
    if rows.iter().any(|row| row.is_expanded) { "standard uncertainty" } else { "standard error" }
}
