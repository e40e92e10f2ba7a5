//! The page of a study.

use crate::numerics::order;
use crate::page::chart::Chart;
use crate::page::figures::figure;
use crate::page::{escaped, page, section};
use crate::study;
use crate::study::{Row, Study};

/// Colours of the schemes.
const COLORS: usize = 6;

/// A self-contained HTML page of a study: advice first, then the work-precision plot and all runs.
pub fn study_page(study: &Study, scene: &str) -> String {
    let advice: String =
        study.advice_lines().iter().map(|line| format!("<li>{}</li>\n", escaped(line))).collect();
    let body = format!(
        "<section class=\"verdict good\" id=\"advice\"><p class=\"words\">Speed against error</p>\n\
         <ul>\n{advice}</ul>\n<p class=\"note\">The reference, extrapolated from meshes finer than any \
         other, is good to {:.1e} of the length or better.</p></section>\n",
        study.reference_error
    );
    let body = body
        + &section("Work and precision", &work_precision(study))
        + &section("All runs", &table(study));
    page("Study", &escaped(scene), &body)
}

fn table(study: &Study) -> String {
    let number = |x: Option<f64>| x.map_or("failed".into(), |x| format!("{x:.2e}"));
    let heads = [
        "scheme",
        "step, s",
        "segments",
        "error / length",
        "of the step",
        "of the mesh",
        "time, s",
        "Newton iterations",
        "energy",
        "status",
    ];
    let row = |row: &Row| {
        let cells = [
            study::name(row),
            format!("{:.3e}", row.step),
            row.segments.to_string(),
            number(row.error),
            number(row.step_error),
            number(Some(row.mesh_error)),
            format!("{:.2e}", row.wall_seconds),
            row.newton_iterations.to_string(),
            format!("{:.1e}", row.energy_drift),
            escaped(&row.status),
        ];
        let cell = |(cell, head): (&String, &str)| format!("<td data-head=\"{head}\">{cell}</td>");
        let rest: String = cells[1..].iter().zip(&heads[1..]).map(|(c, h)| cell((c, h))).collect();
        format!("<tr><th>{}</th>{rest}</tr>\n", cells[0])
    };
    format!(
        "<div class=\"wide\" tabindex=\"0\"><table class=\"cards\"><thead><tr>{}</tr></thead>\n<tbody>{}</tbody></table></div>",
        heads.map(|head| format!("<th>{head}</th>")).concat(),
        study.rows.iter().map(row).collect::<String>()
    )
}

/// Error over time on logarithmic axes: every run a dot, each scheme's best runs joined.
fn work_precision(study: &Study) -> String {
    let mut names: Vec<String> = study.rows.iter().map(study::name).collect();
    names.dedup();
    let mut chart = Chart::new("time, s", "tip error / length").log(true, true).size(760.0, 460.0);
    let mut legend = String::new();
    for (k, name) in names.iter().enumerate() {
        let color = format!("var(--scheme{})", k % COLORS);
        let own = study.rows.iter().filter(|row| study::name(row) == *name);
        let mut points: Vec<(f64, f64)> =
            own.filter_map(|row| Some((row.wall_seconds, row.error?))).collect();
        order::sort_by(&mut points, |x| x.0);
        let mut best = f64::INFINITY;
        let front: Vec<(f64, f64)> = points
            .iter()
            .copied()
            .filter(|(_, error)| {
                let better = *error < best;
                best = best.min(*error);
                better
            })
            .collect();
        chart = chart.line(front, &color).dots(points, &color, 3.5);
        legend += &format!("<i class=\"dot\" style=\"background:{color}\"></i>{} ", escaped(name));
    }
    let words = format!("{legend}\u{2013} dots are runs; lines join the best of each scheme");
    figure(
        "Error of the tip over the time it takes",
        "error over time of all runs",
        &chart.svg(),
        &words,
    )
}
