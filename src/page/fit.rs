//! The page of a fit of single parameters.
//!
//! Input: the report of the fit. The first card has the grade, the estimates with intervals and the warnings. Sections
//! follow on parameters, residuals, data and model in pictures, prediction errors, discretization error, uncertainty
//! budget, undetected bias, omitted effects, correlations, posterior distribution, likelihood profiles, search,
//! trajectory and settings. Output: a self-contained HTML page.

use crate::code::Code;
use crate::fit::{FitReport, interval_content, quoted_estimates};
use crate::page::budget::budgets;
use crate::page::card::{MessageList, card};
use crate::page::correlation::correlation_matrix;
use crate::page::discretization::discretization;
use crate::page::effects::{likely_omitted, undetected_bias};
use crate::page::estimate::{error_heading, estimate_table};
use crate::page::html::{capitalized, escaped, note, section, with_explanation};
use crate::page::number::quantity;
use crate::page::overlay::overlays;
use crate::page::parameters::parameters;
use crate::page::posterior::posterior_pairs;
use crate::page::profile::profiles;
use crate::page::recordings::recordings;
use crate::page::search::search;
use crate::page::settings::settings;
use crate::page::trajectory::trajectories;
use crate::page::{page, residuals};

/// A self-contained HTML page of a fit. `title` names the fit, for example its file. Series, scans, shapes and settings
/// are shown if the fit [kept its plots](crate::Fit::keep_plot_data). Sections without content are left out.
pub fn fit_page(report: &FitReport, title: &str) -> String {
    let plots = report.plot_data.as_ref();
    let tests = Some(&report.residual_tests[..]);
    let series = plots.map(|plots| residuals::all_series(&plots.series, tests));
    let residuals = residuals::summary(report) + &series.unwrap_or_default();
    let recordings = report
        .recordings
        .as_ref()
        .map(|errors| recordings(errors, plots.and_then(|plots| plots.recordings.as_ref())));
    let errors = discretization(&report.discretization_error, &report.parameters);
    let matrix =
        correlation_matrix(&report.parameters, &report.correlation, &report.singular_values);
    let profiles = plots.map(|plots| profiles(report, &plots.profiles));
    let pictures = plots.map(|plots| overlays(&plots.overlays));
    let trajectories = plots.map(|plots| trajectories(report.interrupted, plots));
    let settings = settings(plots.map_or(&[][..], |plots| &plots.settings))
        .row("cost", format!("equal to {:.1} full simulations", report.simulations))
        .row("wall-clock time", quantity(report.wall_seconds, "s"));
    // The order of the sections is that of the questions of a reader: result, fit quality, uncertainty, search.
    let body = first_card(report)
        + &section("Parameters", &parameters(report))
        + &section("Residuals", &residuals)
        + &section("Data and model in pictures", &pictures.unwrap_or_default())
        + &section("Free-run prediction errors", &recordings.unwrap_or_default())
        + &section("Discretization error", &errors)
        + &section("Uncertainty budget", &budgets(&report.parameters))
        + &section("Undetected bias", &undetected_bias(&report.undetected_bias))
        + &section("Likely omitted effects", &likely_omitted(&report.score_tests))
        + &section("Correlation matrix", &matrix)
        + &section("Posterior distribution", &posterior_pairs(report))
        + &section("Likelihood profiles", &profiles.unwrap_or_default())
        + &section("Global scan and local minima", &search(report, plots))
        + &trajectories.unwrap_or_default()
        + &section("Settings and cost", &settings.render());
    page("Fit", title, &body, plots.map(|plots| &plots.version[..]))
}

/// The first card, HTML: grade, verdict and status, estimates with their quoted intervals, and lists of warnings, of
/// parameters that are not identifiable, and of likely omitted effects that no warning contains. Its color is that of
/// the grade.
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
    let basis = interval_content(report).unwrap_or_default();
    content += &estimate_table(&estimates, "estimate", error_heading(&estimates), &basis);
    let findings = report.not_identifiable.iter();
    let findings = findings.map(|found| found.kind.code().behind(&found.description)).collect();
    // The best one is already in a warning.
    let is_warned = |text: &String| report.warnings.iter().any(|warning| warning.contains(text));
    let likely = report.likely_omitted_effects().into_iter().filter(|text| !is_warned(text));
    let likely = likely.map(|text| Code::OmittedEffect.behind(capitalized(&text))).collect();
    let lists = [
        MessageList { heading: "Warnings", messages: report.warnings.clone() },
        MessageList { heading: "Not identifiable", messages: findings },
        MessageList { heading: "Other likely omitted effects", messages: likely },
    ];
    card(report.grade.tone(), &headline, &content, &lists)
}
