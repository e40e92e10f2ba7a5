//! The page of a work-precision study: error of the tip against wall time over schemes, time steps and meshes.
//!
//! Input is the study. The first card has the fastest settings (scheme, step, mesh) for each of several errors of the
//! tip over the length, and the estimated error of the reference. It has the color of a failure if no run reaches any
//! of these errors. A plot has a dot per run and a line through the best runs of each scheme; a folded table has all
//! runs. Output is a self-contained HTML page.

use crate::numerics::total_order;
use crate::page::card::card;
use crate::page::chart::{ChartAxis, PageChart, Points};
use crate::page::figure::{figure, series_color};
use crate::page::html::{folded, note, section};
use crate::page::number::{Scale, quantity, scientific};
use crate::page::page;
use crate::page::table::HtmlTable;
use crate::study::{Study, StudyRow, scheme_name};
use crate::summary::Tone;

/// A self-contained HTML page of a study: the fastest settings for each error first, then the work-precision plot and a
/// folded table of all runs. `scene` names the scene.
pub fn study_page(study: &Study, scene: &str) -> String {
    let reference = format!(
        "The reference is finer than all runs. Its estimated error is {} of the length.",
        scientific(study.reference_error, 1)
    );
    let content = recommended_settings(study) + &note(&reference);
    let headline = "Fastest settings for an error of the tip";
    let runs = folded(&format!("all {} runs", study.rows.len()), &run_table(study));
    let is_reached = study.advice.iter().any(|advice| advice.row.is_some());
    let body = card(Tone::of_result(is_reached, false), headline, &content, &[])
        + &section("Error and cost", &(work_precision(study) + &runs));
    page("Study", scene, &body, None)
}

/// The HTML table of the fastest run for every error of the tip over the length; an error that no run reaches has a
/// text instead.
fn recommended_settings(study: &Study) -> String {
    let advice = study.advice.iter().map(|advice| (advice, advice.row.map(|i| &study.rows[i])));
    HtmlTable::new("fastest settings", advice)
        .id("answer")
        .text("tip error / length", |(advice, _)| scientific(advice.error, 0))
        .text("scheme", |(_, row)| {
            row.map_or("none of these runs is that accurate".into(), scheme_name)
        })
        .text("time step", |(_, row)| row.map(|row| quantity(row.step, "s")))
        .text("segments", |(_, row)| row.map(|row| row.segments.to_string()))
        .text("wall-clock time", |(_, row)| row.map(|row| quantity(row.wall_seconds, "s")))
        .render()
}

/// The HTML table of all runs: settings, errors by time step and mesh, wall time, iterations, energy drift and status.
fn run_table(study: &Study) -> String {
    HtmlTable::new("all runs", &study.rows)
        .text("scheme", |row| scheme_name(row))
        .text("time step", |row| quantity(row.step, "s"))
        .text("segments", |row| row.segments.to_string())
        .text("tip error / length", |row| {
            row.error.map_or("failed".into(), |error| scientific(error, 2))
        })
        .text("by the time step", |row| row.step_error.map(|error| scientific(error, 2)))
        .text("by the mesh", |row| scientific(row.mesh_error, 2))
        .text("wall-clock time", |row| quantity(row.wall_seconds, "s"))
        .text("Newton iterations", |row| row.newton_iterations.to_string())
        .text("energy error / largest kinetic energy", |row| scientific(row.energy_drift, 1))
        .text("status", |row| row.status.clone())
        .render()
}

/// The figure of error over wall time on logarithmic axes: a dot for every completed run, and for each scheme a line
/// through its best runs, of which no faster run has a smaller error.
fn work_precision(study: &Study) -> String {
    let mut names: Vec<String> = study.rows.iter().map(scheme_name).collect();
    // Rows are in the order of schemes: equal names are neighbors.
    names.dedup();
    let scale = Scale::for_values(study.rows.iter().map(|row| row.wall_seconds), "s");
    let x = ChartAxis::new("wall-clock time", &scale).log(true);
    let mut chart =
        PageChart::new(x, ChartAxis::from("tip error / length").log(true), [760.0, 460.0]);
    for (k, scheme) in names.iter().enumerate() {
        let own = study.rows.iter().filter(|row| scheme_name(row) == *scheme);
        // A run that failed has no error and no dot.
        let point = |row: &StudyRow| Some([row.wall_seconds, row.error?]);
        let mut points: Points = own.filter_map(point).collect();
        points.sort_by_cached_key(|[time, _]| total_order(*time));
        // The front: runs that no faster run of the scheme excels.
        let mut best = f64::INFINITY;
        let is_best = |[_, error]: &[f64; 2]| {
            let is_better = *error < best;
            best = best.min(*error);
            is_better
        };
        let front: Points = points.iter().copied().filter(is_best).collect();
        let color = series_color(k);
        chart = chart.line("", front, &color).dots(scheme, points, &color, 3.5);
    }
    figure(
        "Error of the tip over the wall-clock time",
        "error over the wall-clock time of all runs",
        &chart,
        "dots: runs; lines: the best of each scheme",
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scheme;
    use crate::study::FastestRun;

    /// No run has an error below 0.1 of the length.
    #[test]
    fn study_without_an_accurate_run_has_the_color_of_a_failure() {
        let row = |error: f64, wall_seconds: f64| StudyRow {
            scheme: Scheme::NewmarkBeta,
            beta: 0.5,
            step: 1e-3,
            segments: 10,
            error: Some(error),
            step_error: Some(error),
            mesh_error: 0.1,
            wall_seconds,
            newton_iterations: 3,
            energy_drift: 0.01,
            status: "completed".into(),
        };
        let rows = vec![row(0.5, 0.1), row(0.3, 0.2)];
        let advice = vec![FastestRun { error: 0.1, row: None }];
        let page = study_page(&Study { rows, reference_error: 0.3, advice }, "scene");
        assert!(page.contains("<section class=\"verdict bad\""));
    }
}
