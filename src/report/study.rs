//! The page of a study.

use super::escaped;
use crate::study::{self, Study};
use kuva::prelude::{Layout, LinePlot, Plot, ScatterPlot, SvgBackend, render_multiple};

const COLORS: [&str; 6] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"];

/// A self-contained HTML page of a study: advice first, then the work-precision plot and all runs.
pub fn study_page(study: &Study, scene: &str) -> String {
    let advice: String =
        study.advice_lines().iter().map(|line| format!("<li>{}</li>\n", escaped(line))).collect();
    let number = |x: Option<f64>| x.map_or("failed".into(), |x| format!("{x:.2e}"));
    let rows: String = study
        .rows
        .iter()
        .map(|row| {
            format!(
                "<tr><td>{}</td><td>{:.3e}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td>\
                 <td>{:.2e}</td><td>{}</td><td>{:.1e}</td><td>{}</td></tr>\n",
                study::name(row),
                row.step,
                row.segments,
                number(row.error),
                number(row.step_error),
                number(Some(row.mesh_error)),
                row.wall_seconds,
                row.newton_iterations,
                row.energy_drift,
                escaped(&row.status)
            )
        })
        .collect();
    format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
         <title>Speed against error: {scene}</title><style>\
         body{{font:15px sans-serif;max-width:1000px;margin:2em auto;padding:0 1em}}\
         table{{border-collapse:collapse}}td,th{{padding:.2em .7em;text-align:right}}\
         tr:nth-child(even){{background:#f3f3f3}}</style></head><body>\n\
         <h1>Speed against error</h1><p>{scene}</p>\n<ul>\n{advice}</ul>\n\
         <p>The reference, extrapolated from meshes finer than any other, is good to {:.1e} of the length \
         or better.</p>\n{}\n<table><tr><th>scheme</th><th>step, s</th><th>segments</th>\
         <th>error/L</th><th>of the step</th><th>of the mesh</th><th>time, s</th>\
         <th>Newton iterations</th><th>energy</th><th>status</th></tr>\n{rows}</table>\n\
         </body></html>\n",
        study.reference_error,
        work_precision(study),
        scene = escaped(scene),
    )
}

/// Error over time on logarithmic axes: every run a dot, each scheme's best runs joined.
fn work_precision(study: &Study) -> String {
    let mut names: Vec<String> = study.rows.iter().map(study::name).collect();
    names.dedup();
    let mut plots: Vec<Plot> = Vec::new();
    for (name, color) in names.into_iter().zip(COLORS) {
        let own = study.rows.iter().filter(|row| study::name(row) == name);
        let mut points: Vec<(f64, f64)> = own
            .filter_map(|row| Some((row.wall_seconds, row.error.filter(|e| *e > 0.0)?)))
            .collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
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
        plots.push(Plot::Scatter(ScatterPlot::new().with_data(points).with_color(color)));
        plots
            .push(Plot::Line(LinePlot::new().with_data(front).with_color(color).with_legend(name)));
    }
    let layout = Layout::auto_from_plots(&plots)
        .with_log_scale()
        .with_x_label("time, s")
        .with_y_label("tip error over length")
        .with_title("work and precision");
    SvgBackend::default().render_scene(&render_multiple(plots, layout))
}
