//! The section "Free-run prediction errors": of recordings that prescribe the ends of a rod, whose other markers are
//! predicted.
//!
//! Input: the errors of fitted and validation recordings, m, over all markers, those of the ends included. A table has
//! mean, median and worst of the mean errors of the recordings for both kinds, a folded list the mean error of each. If
//! plot data were kept, plots show the mean error over the length of the simulated window, s, and over the speed of the
//! markers, m/s. Up to `DRAWN_RECORDINGS` validation recordings (fitted ones without any), evenly spaced in rank from
//! the best to the worst, are drawn as rod and markers at a dozen times. Output: HTML.

use crate::fit::{MeanError, RecordedMotion, RecordingError, RecordingErrors, RecordingPlots};
use crate::numerics::total_order;
use crate::page::chart::{ChartAxis, PageChart, Points};
use crate::page::figure::{figure, row, series_color};
use crate::page::html::{escaped, folded, note, subsection};
use crate::page::number::{Scale, quantity};
use crate::page::plane::planes;
use crate::page::snapshots::{DrawnSnapshot, strip};
use crate::page::table::HtmlTable;

/// Most recordings that are drawn with their rod.
const DRAWN_RECORDINGS: usize = 4;
/// Fewest values in a range of speeds whose mean is drawn: means of few values scatter.
const MIN_VALUES: usize = 20;
/// Explanation of the colors in the drawings of shapes, HTML.
const COLOR_KEY: &str = ": <i class=\"stroke model\"></i>rod, simulated <i class=\"dot observed\"></i>markers, recorded";

/// The content of the section as HTML: tables and list of errors; figures and drawings if plot data were kept. Drawn
/// are validation recordings, or fitted ones without any, at most [`DRAWN_RECORDINGS`], evenly spaced in rank from the
/// best to the worst.
pub(super) fn recordings(errors: &RecordingErrors, plots: Option<&RecordingPlots>) -> String {
    let mut html = error_table(errors) + &error_list(&errors.list);
    let Some(plots) = plots else { return html };
    html += &row(&(window_errors(plots) + &speed_errors(plots)));
    // Validation recordings show more than fitted ones.
    let is_validation = plots.motions.iter().any(|m| m.held_out);
    let mut ranked: Vec<&RecordedMotion> =
        plots.motions.iter().filter(|m| m.held_out == is_validation).collect();
    // From the best to the worst.
    ranked.sort_by_cached_key(|motion| total_order(motion.mean_error));
    let all = ranked.len();
    if all > DRAWN_RECORDINGS {
        // The best and the worst recording are always drawn.
        let index = |k: usize| (all - 1) * k / (DRAWN_RECORDINGS - 1);
        ranked = (0..DRAWN_RECORDINGS).map(|k| ranked[index(k)]).collect();
        html += &note(&format!(
            "Drawn: {DRAWN_RECORDINGS} of {all} {} recordings, evenly spaced in rank from the best to the worst.",
            if is_validation { "validation" } else { "fitted" },
        ));
    }
    html + &ranked.into_iter().map(recorded_motion).collect::<String>()
}

/// An error, m, in three significant digits with its unit.
fn shown_error(error: f64) -> String {
    quantity(error, "m")
}

/// The HTML table of the fitted and of the validation recordings, below a note on the definition of their errors. It
/// has the number of recordings and mean, median and worst of their mean errors. A kind without recordings has no row.
fn error_table(errors: &RecordingErrors) -> String {
    let rows = [("fitted", &errors.fitted), ("validation", &errors.held_out)];
    let rows = rows.into_iter().filter_map(|(name, summary)| Some((name, summary.as_ref()?)));
    let table = HtmlTable::new("free-run prediction errors", rows)
        .text("data", |(name, _)| name.to_string())
        .text("recordings", |(_, s)| s.experiments.to_string())
        .text("mean", |(_, s)| shown_error(s.mean))
        .text("median", |(_, s)| shown_error(s.median))
        .text("worst", |(_, s)| match s.worst_experiment.is_empty() {
            true => shown_error(s.worst),
            false => format!("{}, {}", shown_error(s.worst), s.worst_experiment),
        });
    note(
        "Mean of the absolute differences between simulated and recorded coordinates, over x, y and z of all markers and \
         frames. The rod is simulated from the first two frames. The mean includes the markers of the ends, which are \
         prescribed: it is smaller than the RMS residual of the markers between them.",
    ) + &table.render()
}

/// The folded list of the mean error of each recording, or `failed`, as HTML; empty for fewer than two.
fn error_list(errors: &[RecordingError]) -> String {
    let item = |e: &RecordingError| {
        let mean = e.mean_error.map_or("failed".into(), shown_error);
        format!("<li>{}{}: {mean}</li>", escaped(&e.experiment), validation_suffix(e.held_out))
    };
    let items: String = errors.iter().map(item).collect();
    let summary = format!("mean error of each of {} recordings", errors.len());
    match errors.len() {
        0 | 1 => String::new(),
        _ => folded(&summary, &format!("<ul class=\"columns\">{items}</ul>\n")),
    }
}

/// `, validation` behind the name of a validation recording; empty for a fitted one.
fn validation_suffix(is_validation: bool) -> &'static str {
    if is_validation { ", validation" } else { "" }
}

/// Mean errors of fitted recordings, and of validation recordings, at one abscissa (in SI units).
struct MeanErrors {
    abscissa: f64,
    /// Fitted first, then validation; none without values.
    errors: [Option<MeanError>; 2],
}

/// A chart of mean errors, m, with a line for fitted and one for validation recordings, from zero on. Means of fewer
/// than `min_values` values are not drawn; the x axis covers the values of `range` too.
fn error_chart(x: ChartAxis, means: &[MeanErrors], min_values: usize, range: &[f64]) -> PageChart {
    // Both curves have one scale.
    let all = means.iter().flat_map(|m| m.errors).flatten().map(|e| e.mean);
    let y = ChartAxis::new("mean error", &Scale::for_values(all, "m"));
    let mut chart = PageChart::new(x, y, [520.0, 300.0]).covering(range.iter().copied()).level(0.0);
    for (k, name) in ["fitted", "validation"].into_iter().enumerate() {
        let own = means.iter().filter_map(|m| Some((m.abscissa, m.errors[k]?)));
        let own = own.filter(|(_, error)| error.count >= min_values);
        let points: Points = own.map(|(x, error)| [x, error.mean]).collect();
        chart = chart.dotted_line(name, points, &series_color(k + 2), 3.5);
    }
    chart
}

/// The figure of the mean error over the length, s, of the free run, on a logarithmic axis; the caption has the number
/// of failed windows.
fn window_errors(plots: &RecordingPlots) -> String {
    let means = plots.windows.iter();
    let means = means.map(|w| MeanErrors { abscissa: w.length, errors: [w.fitted, w.held_out] });
    let axis = ChartAxis::from("length of the window (s)").log(true);
    let failed: usize = plots.windows.iter().map(|w| w.failed).sum();
    let failed = if failed > 0 { format!("; {failed} windows failed") } else { String::new() };
    figure(
        "Error over the length of the free run",
        "mean error over the length of the window",
        &error_chart(axis, &means.collect::<Vec<_>>(), 1, &[]),
        &format!("all markers, in windows that start from two frames of the recording{failed}"),
    )
}

/// The figure of the mean error over the speed, m/s, of the markers, at the middle of each range of speeds with at
/// least [`MIN_VALUES`] values.
fn speed_errors(plots: &RecordingPlots) -> String {
    let means = plots.speeds.iter().map(|s| MeanErrors {
        abscissa: 0.5 * (s.speed[0] + s.speed[1]),
        errors: [s.fitted, s.held_out],
    });
    let range: Vec<f64> = plots.speeds.iter().flat_map(|s| s.speed).collect();
    let axis = ChartAxis::from("speed of the marker (m/s)");
    figure(
        "Error over the speed of the markers",
        "mean error over the speed of the marker",
        &error_chart(axis, &means.collect::<Vec<_>>(), MIN_VALUES, &range),
        "markers between the ends, over whole recordings, in ranges of speed; the last has all that are faster",
    )
}

/// Drawings of the rod and its markers at a dozen times of a recording, in one plane or two, as HTML. The heading has
/// the recording's name and mean error, each caption the time and the error at it.
fn recorded_motion(motion: &RecordedMotion) -> String {
    let name = match motion.experiment.is_empty() {
        true => "The recording",
        false => &motion.experiment,
    };
    let validation = validation_suffix(motion.held_out);
    let title = format!("{name}{validation}: {}", shown_error(motion.mean_error));
    let snapshots: Vec<DrawnSnapshot> = motion
        .snapshots
        .iter()
        .map(|s| DrawnSnapshot {
            time: s.time,
            nodes: &s.nodes,
            observed: &s.markers,
            caption: format!("{}, error {}", quantity(s.time, "s"), shown_error(s.error)),
        })
        .collect();
    let planes = planes(|| motion.snapshots.iter().flat_map(|s| &s.nodes));
    let drawn = planes.into_iter().map(|plane| strip(&snapshots, plane, name, COLOR_KEY));
    subsection(&title, &drawn.collect::<String>())
}
