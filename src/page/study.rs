//! The page of a work-precision study.

use crate::numerics::total_order;
use crate::page::card::{Tone, card};
use crate::page::chart::{Chart, labeled};
use crate::page::figure::figure;
use crate::page::html::{escaped, folded, note, section};
use crate::page::number::{Scale, quantity, scientific};
use crate::page::page;
use crate::page::table::Table;
use crate::study::{Row, Study, name};

/// Colors of the schemes.
const COLORS: usize = 6;

/// A self-contained HTML page of a study: the recommended settings first, then the work-precision plot and all runs.
/// `scene` names the scene.
pub fn study_page(study: &Study, scene: &str) -> String {
    let reference = format!(
        "The reference is extrapolated from finer meshes than any other. Its own error is at most {} of the length.",
        scientific(study.reference_error, 1)
    );
    let content = recommended(study) + &note(&reference);
    let headline = "Fastest settings for an error of the tip";
    let runs = folded(&format!("all {} runs", study.rows.len()), &runs(study));
    let body = card(Tone::Good, headline, &content, &[])
        + &section("Error and cost", &(work_precision(study) + &runs));
    page("Study", scene, &body, None)
}

/// The fastest run for every error.
fn recommended(study: &Study) -> String {
    let heads = ["tip error / length", "scheme", "time step", "segments", "wall-clock time"];
    let mut table = Table::new("fastest settings", heads).id("answer");
    for advice in &study.advice {
        let cells = match advice.row.map(|i| &study.rows[i]) {
            Some(row) => vec![
                Some(escaped(&name(row))),
                Some(quantity(row.step, "s")),
                Some(row.segments.to_string()),
                Some(quantity(row.wall_seconds, "s")),
            ],
            None => vec![Some("none of these runs is that accurate".into()), None, None, None],
        };
        table.row(scientific(advice.error, 0), cells);
    }
    table.html()
}

/// A table of all runs.
fn runs(study: &Study) -> String {
    let heads = [
        "scheme",
        "time step",
        "segments",
        "tip error / length",
        "by the time step",
        "by the mesh",
        "wall-clock time",
        "Newton iterations",
        "energy error / largest kinetic energy",
        "status",
    ];
    let mut table = Table::new("all runs", heads);
    for row in &study.rows {
        let cells = vec![
            Some(quantity(row.step, "s")),
            Some(row.segments.to_string()),
            Some(row.error.map_or("failed".into(), |error| scientific(error, 2))),
            row.step_error.map(|error| scientific(error, 2)),
            Some(scientific(row.mesh_error, 2)),
            Some(quantity(row.wall_seconds, "s")),
            Some(row.newton_iterations.to_string()),
            Some(scientific(row.energy_drift, 1)),
            Some(escaped(&row.status)),
        ];
        table.row(escaped(&name(row)), cells);
    }
    table.html()
}

/// Error over time on logarithmic axes: a dot for every run, and a line through the best runs of each scheme.
fn work_precision(study: &Study) -> String {
    let mut names: Vec<String> = study.rows.iter().map(name).collect();
    names.dedup();
    let scale = Scale::fitting(study.rows.iter().map(|row| row.wall_seconds), "s");
    let mut chart = Chart::new(labeled("wall-clock time", &scale.unit), "tip error / length")
        .log(true, true)
        .size(760.0, 460.0);
    for (k, scheme) in names.iter().enumerate() {
        let color = format!("var(--scheme{})", k % COLORS);
        let own = study.rows.iter().filter(|row| name(row) == *scheme);
        let point = |row: &Row| Some((row.wall_seconds / scale.factor, row.error?));
        let mut points: Vec<(f64, f64)> = own.filter_map(point).collect();
        points.sort_by_cached_key(|x| total_order(x.0));
        let mut best = f64::INFINITY;
        let front: Vec<(f64, f64)> = points
            .iter()
            .copied()
            .filter(|(_, error)| {
                let is_better = *error < best;
                best = best.min(*error);
                is_better
            })
            .collect();
        chart = chart.line("", front, &color).dots(scheme, points, &color, 3.5);
    }
    figure(
        "Error of the tip over the wall-clock time",
        "error over the wall-clock time of all runs",
        &chart,
        "dots: runs; lines: the best of each scheme",
    )
}
