//! Recordings that lead a rod's ends, on the page of a fit: how far off the rod is, by how long it goes on its
//! own and by how fast its markers are, and the rod with its markers at a dozen moments.

use crate::fit::{MeanError, RecordedMotion, RecordedSnapshot, RecordingErrors, RecordingPlots};
use crate::numerics::order;
use crate::page::chart::Chart;
use crate::page::escaped;
use crate::page::figures::{figure, labelled, planes};
use crate::page::moments::{Moment, strip};
use crate::page::number::{Scale, quantity};

/// Recordings whose moments are drawn.
const DRAWN: usize = 4;
/// Means of fewer values than this are not drawn.
const FEW: usize = 20;
/// What is what in the drawings of moments.
const KEY: &str = ": <i class=\"stroke model\"></i>the rod, simulated <i class=\"dot seen\"></i>its markers, recorded";

const FITTED: &str = "var(--scheme2)";
const HELD_OUT: &str = "var(--scheme3)";

/// All of it; drawings where the fit kept its plots.
pub(super) fn recordings(errors: &RecordingErrors, plots: Option<&RecordingPlots>) -> String {
    let mut html = table(errors);
    let Some(plots) = plots else { return html };
    html += &format!("<div class=\"row\">{}{}</div>\n", windows(plots), speeds(plots));
    let held_out = plots.motions.iter().any(|m| m.held_out);
    let mut ranked: Vec<&RecordedMotion> =
        plots.motions.iter().filter(|m| m.held_out == held_out).collect();
    order::sort_by(&mut ranked, |x| x.mean_error);
    let all = ranked.len();
    if all > DRAWN {
        let chosen = (0..DRAWN).map(|k| ranked[(all - 1) * k / (DRAWN - 1)]);
        ranked = chosen.collect();
        html += &format!(
            "<p class=\"note\">Drawn are {} of the {all} recordings {}: from the best to the worst, evenly over \
             their ranks.</p>\n",
            ranked.len(),
            if held_out { "held out" } else { "fitted" },
        );
    }
    html + &ranked.into_iter().map(motion).collect::<String>()
}

/// In millimetres or so, three digits.
fn error(mean: f64) -> String {
    quantity(mean, "m")
}

fn table(errors: &RecordingErrors) -> String {
    let summaries = [("fitted", &errors.fitted), ("held out", &errors.held_out)];
    let rows: String = summaries
        .into_iter()
        .filter_map(|(what, summary)| {
            let s = summary.as_ref()?;
            let worst = match s.worst_experiment.is_empty() {
                true => String::new(),
                false => format!(", {}", escaped(&s.worst_experiment)),
            };
            let cells = [
                ("recordings", s.experiments.to_string()),
                ("mean", error(s.mean)),
                ("median", error(s.median)),
                ("worst", format!("{}{worst}", error(s.worst))),
            ];
            let cell = |(head, text): (&str, String)| {
                format!("<td data-head=\"{head}\"><span>{text}</span></td>")
            };
            Some(format!("<tr><th>{what}</th>{}</tr>\n", cells.map(cell).concat()))
        })
        .collect();
    let heads = ["of", "recordings", "mean", "median", "worst"].map(|h| format!("<th>{h}</th>"));
    let each = |e: &crate::fit::RecordingError| {
        let mean = e.mean_error.map_or("failed".into(), error);
        format!("<li>{}{}: {mean}</li>", escaped(&e.experiment), held_out(e.held_out))
    };
    let list = match &errors.list[..] {
        [] | [_] => String::new(),
        list => {
            format!("<ul class=\"columns\">{}</ul>\n", list.iter().map(each).collect::<String>())
        }
    };
    format!(
        "<p class=\"note\">Mean distance per coordinate between the recorded markers, held ones too, and the rod, \
         which goes on its own after the first two frames.</p>\n<div class=\"wide\" tabindex=\"0\"><table class=\"cards\"><thead>\
         <tr>{}</tr></thead>\n<tbody>{rows}</tbody></table></div>\n{list}",
        heads.concat()
    )
}

fn held_out(held_out: bool) -> &'static str {
    if held_out { ", held out" } else { "" }
}

/// Lines of the fitted and the held-out: places, with both errors there.
fn curves(
    chart: Chart,
    scale: &Scale,
    points: &[(f64, [Option<MeanError>; 2])],
    few: usize,
) -> (Chart, String) {
    let (mut chart, mut legend) = (chart, String::new());
    for (k, (color, what)) in [(FITTED, "fitted"), (HELD_OUT, "held out")].into_iter().enumerate() {
        let own = points.iter().filter_map(|(x, errors)| Some((*x, errors[k]?)));
        let own: Vec<(f64, f64)> =
            own.filter(|(_, e)| e.count >= few).map(|(x, e)| (x, e.mean / scale.factor)).collect();
        if !own.is_empty() {
            legend += &format!("<i class=\"dot\" style=\"background:{color}\"></i>{what} ");
        }
        chart = chart.line(own.clone(), color).dots(own, color, 3.5);
    }
    (chart, legend)
}

fn scale<'a>(errors: impl Iterator<Item = &'a Option<MeanError>>) -> Scale {
    Scale::fitting(errors.flatten().map(|e| e.mean), "m")
}

fn windows(plots: &RecordingPlots) -> String {
    let scale = scale(plots.windows.iter().flat_map(|w| [&w.fitted, &w.held_out]));
    let points: Vec<_> = plots.windows.iter().map(|w| (w.length, [w.fitted, w.held_out])).collect();
    let chart = Chart::new("length of the window, s", labelled("mean error", &scale.unit))
        .log(true, false)
        .size(520.0, 300.0)
        .level(0.0);
    let (chart, legend) = curves(chart, &scale, &points, 1);
    let failed: usize = plots.windows.iter().map(|w| w.failed).sum();
    let failed = if failed > 0 { format!("; {failed} windows failed") } else { String::new() };
    figure(
        "Error by how long the rod goes on its own",
        "mean error by the length of the window",
        &chart.svg(),
        &format!(
            "{legend}\u{2013} of all markers, in windows that start anew from two frames of the recording{failed}"
        ),
    )
}

fn speeds(plots: &RecordingPlots) -> String {
    let scale = scale(plots.speeds.iter().flat_map(|s| [&s.fitted, &s.held_out]));
    let middle = |[low, high]: [f64; 2]| 0.5 * (low + high);
    let points: Vec<_> =
        plots.speeds.iter().map(|s| (middle(s.speed), [s.fitted, s.held_out])).collect();
    let chart = Chart::new("speed of the marker, m/s", labelled("mean error", &scale.unit))
        .size(520.0, 300.0)
        .over(plots.speeds.iter().flat_map(|s| s.speed))
        .level(0.0);
    let (chart, legend) = curves(chart, &scale, &points, FEW);
    figure(
        "Error by how fast the markers are",
        "mean error by the speed of the marker",
        &chart.svg(),
        &format!(
            "{legend}\u{2013} of the markers that no end holds, over whole recordings, in ranges of speed; the last \
             takes all that are faster"
        ),
    )
}

/// The rod and its markers at a dozen moments, in one plane or two.
fn motion(motion: &RecordedMotion) -> String {
    let nodes = || motion.snapshots.iter().flat_map(|m| &m.nodes);
    let name = match motion.experiment.is_empty() {
        true => "The recording".into(),
        false => escaped(&motion.experiment),
    };
    let title = format!("{name}{}: {}", held_out(motion.held_out), error(motion.mean_error));
    let caption = |m: &RecordedSnapshot| format!("{:.2} s, off by {}", m.time, error(m.error));
    let moments: Vec<Moment> = motion
        .snapshots
        .iter()
        .map(|m| Moment { time: m.time, nodes: &m.nodes, seen: &m.markers, caption: caption(m) })
        .collect();
    let drawn: String =
        planes(nodes).into_iter().map(|plane| strip(&moments, plane, &name, KEY)).collect();
    format!("<h3>{title}</h3>\n{drawn}")
}
