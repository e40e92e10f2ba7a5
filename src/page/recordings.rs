//! Free-run prediction errors of recordings that prescribe the ends of a rod: over the length of the window and the speed
//! of the markers, and the rod with its markers at a dozen times.

use crate::fit::{
    MeanError, RecordedMotion, RecordedSnapshot, RecordingErrors, RecordingPlots, SpeedError,
    WindowError,
};
use crate::numerics::total_order;
use crate::page::chart::{Chart, labeled};
use crate::page::figure::{figure, row};
use crate::page::html::{escaped, folded, note};
use crate::page::moments::{Moment, strip};
use crate::page::number::{Scale, quantity};
use crate::page::shapes::planes;
use crate::page::table::Table;

/// Recordings whose moments are drawn.
const DRAWN: usize = 4;
/// Means of fewer values than this are not drawn.
const FEW: usize = 20;
/// Colors in the drawings of shapes.
const KEY: &str = ": <i class=\"stroke model\"></i>rod, simulated <i class=\"dot observed\"></i>markers, recorded";

const FITTED: &str = "var(--scheme2)";
const HELD_OUT: &str = "var(--scheme3)";

/// The section's content; drawings where the fit kept its plots.
pub(super) fn recordings(errors: &RecordingErrors, plots: Option<&RecordingPlots>) -> String {
    let mut html = table(errors);
    let Some(plots) = plots else { return html };
    html += &row(&(windows(plots) + &speeds(plots)));
    let held_out = plots.motions.iter().any(|m| m.held_out);
    let mut ranked: Vec<&RecordedMotion> =
        plots.motions.iter().filter(|m| m.held_out == held_out).collect();
    ranked.sort_by_cached_key(|x| total_order(x.mean_error));
    let all = ranked.len();
    if all > DRAWN {
        let chosen = (0..DRAWN).map(|k| ranked[(all - 1) * k / (DRAWN - 1)]);
        ranked = chosen.collect();
        html += &note(&format!(
            "Drawn: {} of {all} {} recordings, evenly spaced in rank from the best to the worst.",
            ranked.len(),
            if held_out { "validation" } else { "fitted" },
        ));
    }
    html + &ranked.into_iter().map(motion).collect::<String>()
}

/// In millimetres or so, three digits.
fn error(mean: f64) -> String {
    quantity(mean, "m")
}

fn table(errors: &RecordingErrors) -> String {
    let heads = ["data", "recordings", "mean", "median", "worst"];
    let mut table = Table::new("free-run prediction errors", heads);
    for (name, summary) in [("fitted", &errors.fitted), ("validation", &errors.held_out)] {
        let Some(s) = summary else { continue };
        let worst = match s.worst_experiment.is_empty() {
            true => error(s.worst),
            false => format!("{}, {}", error(s.worst), escaped(&s.worst_experiment)),
        };
        let cells = [s.experiments.to_string(), error(s.mean), error(s.median), worst];
        table.row(name, cells.map(Some).to_vec());
    }
    let each = |e: &crate::fit::RecordingError| {
        let mean = e.mean_error.map_or("failed".into(), error);
        format!("<li>{}{}: {mean}</li>", escaped(&e.experiment), held_out(e.held_out))
    };
    let list = match &errors.list[..] {
        [] | [_] => String::new(),
        list => {
            let items: String = list.iter().map(each).collect();
            let line = format!("mean error of each of {} recordings", list.len());
            folded(&line, &format!("<ul class=\"columns\">{items}</ul>\n"))
        }
    };
    note(
        "Mean distance per coordinate between the recorded markers, those of the ends included, and the rod, which is \
         simulated from the first two frames.",
    ) + &table.html()
        + &list
}

fn held_out(held_out: bool) -> &'static str {
    if held_out { ", validation" } else { "" }
}

/// Mean errors at one abscissa, of fitted and of validation recordings.
struct Means {
    at: f64,
    errors: [Option<MeanError>; 2],
}

/// A chart with a line for the fitted and one for the validation recordings, of means of at least `few` values.
fn curves(chart: Chart, scale: &Scale, means: &[Means], few: usize) -> Chart {
    let mut chart = chart;
    for (k, (color, name)) in [(FITTED, "fitted"), (HELD_OUT, "validation")].into_iter().enumerate()
    {
        let own = means.iter().filter_map(|means| Some((means.at, means.errors[k]?)));
        let own: Vec<(f64, f64)> =
            own.filter(|(_, e)| e.count >= few).map(|(x, e)| (x, e.mean / scale.factor)).collect();
        chart = chart.line("", own.clone(), color).dots(name, own, color, 3.5);
    }
    chart
}

fn scale<'a>(errors: impl Iterator<Item = &'a Option<MeanError>>) -> Scale {
    Scale::fitting(errors.flatten().map(|e| e.mean), "m")
}

fn windows(plots: &RecordingPlots) -> String {
    let scale = scale(plots.windows.iter().flat_map(|w| [&w.fitted, &w.held_out]));
    let mean = |w: &WindowError| Means { at: w.length, errors: [w.fitted, w.held_out] };
    let means: Vec<Means> = plots.windows.iter().map(mean).collect();
    let chart = Chart::new("length of the window (s)", labeled("mean error", &scale.unit))
        .log(true, false)
        .size(520.0, 300.0)
        .level(0.0);
    let chart = curves(chart, &scale, &means, 1);
    let failed: usize = plots.windows.iter().map(|w| w.failed).sum();
    let failed = if failed > 0 { format!("; {failed} windows failed") } else { String::new() };
    figure(
        "Error over the length of the free run",
        "mean error over the length of the window",
        &chart,
        &format!("all markers, in windows that start from two frames of the recording{failed}"),
    )
}

fn speeds(plots: &RecordingPlots) -> String {
    let scale = scale(plots.speeds.iter().flat_map(|s| [&s.fitted, &s.held_out]));
    let middle = |[low, high]: [f64; 2]| 0.5 * (low + high);
    let mean = |s: &SpeedError| Means { at: middle(s.speed), errors: [s.fitted, s.held_out] };
    let means: Vec<Means> = plots.speeds.iter().map(mean).collect();
    let chart = Chart::new("speed of the marker (m/s)", labeled("mean error", &scale.unit))
        .size(520.0, 300.0)
        .covering(plots.speeds.iter().flat_map(|s| s.speed))
        .level(0.0);
    figure(
        "Error over the speed of the markers",
        "mean error over the speed of the marker",
        &curves(chart, &scale, &means, FEW),
        "markers between the ends, over whole recordings, in ranges of speed; the last has all that are faster",
    )
}

/// The rod and its markers at a dozen times, in one plane or two.
fn motion(motion: &RecordedMotion) -> String {
    let nodes = || motion.snapshots.iter().flat_map(|m| &m.nodes);
    let name = match motion.experiment.is_empty() {
        true => "The recording",
        false => &motion.experiment,
    };
    let title =
        format!("{}{}: {}", escaped(name), held_out(motion.held_out), error(motion.mean_error));
    let caption =
        |m: &RecordedSnapshot| format!("{}, error {}", quantity(m.time, "s"), error(m.error));
    let moments: Vec<Moment> = motion
        .snapshots
        .iter()
        .map(|m| Moment {
            time: m.time,
            nodes: &m.nodes,
            observed: &m.markers,
            caption: caption(m),
        })
        .collect();
    let drawn: String =
        planes(nodes).into_iter().map(|plane| strip(&moments, plane, name, KEY)).collect();
    format!("<h3>{title}</h3>\n{drawn}")
}
