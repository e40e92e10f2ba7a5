//! The page of a simulation.
//!
//! Input are the report and the film of a run: frames with all nodes, and samples of tip and energies. The first card
//! has the status of the run, positions of the tip (start, largest displacement, end), energy and warnings. Sections
//! follow with an animation, up to [`MAX_SNAPSHOTS`] shapes side by side, energies over time, the path of the tip,
//! settings and cost. Output is a self-contained HTML page. A film without frames has the card and the settings only.
//! [`simulation_page`] makes the page. `run_card` (the first card, colored by status and warnings), `snapshots` (shapes
//! side by side) and `run_settings` (scene file, model, mesh, step and scheme) are parts of other pages too, as are the
//! figures `energy` and `tip`.

use crate::dynamics::{Film, FilmSample, Frame, SimulationReport};
use crate::error::GIVEN_AS_TEXT;
use crate::page::card::{MessageList, card};
use crate::page::chart::{ChartAxis, PageChart, labeled};
use crate::page::figure::{figure, row, series_color};
use crate::page::html::{capitalized, escaped, note, section, with_explanation};
use crate::page::number::{Scale, quantity};
use crate::page::page;
use crate::page::plane::{AXES, DrawingPlane, planes};
use crate::page::player::player;
use crate::page::settings::time_steps;
use crate::page::snapshots::{DrawnSnapshot, strip};
use crate::page::table::{HtmlTable, KeyTable};
use crate::problem::Problem;
use crate::rod::Energies;
use crate::scene::Time;
use crate::summary::Tone;
use std::path::Path;

/// Most shapes that are drawn side by side.
const MAX_SNAPSHOTS: usize = 12;
/// Error of the displayed positions of the tip, in the displayed unit: numbers show the second digit of it, a
/// hundredth.
const DISPLAYED_ERROR: f64 = 0.1;

/// A self-contained HTML page of a simulation, from its report, its film (stored frames and samples) and its problem,
/// with a script of its own that plays the motion. `title` names the simulation, for example its scene file. Without
/// stored frames it has the first card and the settings only.
pub fn simulation_page(
    report: &SimulationReport,
    film: &Film,
    problem: &Problem,
    title: &str,
) -> String {
    let (frames, samples) = (film.frames(), film.samples());
    let mut body = first_card(report, samples);
    let planes = planes(|| frames.iter().flat_map(|frame| &frame.nodes));
    if !frames.is_empty() {
        body += &section("Trajectory", &player(report, film, problem, &planes));
        body += &section("Shapes over time", &snapshots(frames, &planes));
        body += &section("Energy", &energy(samples));
        body += &section("Tip trajectory", &tip(samples, &planes));
    }
    body += &section("Settings and cost", &settings(report, problem));
    page("Simulation", title, &body, None)
}

/// The first card, HTML: status of the run, positions of the tip, a sentence on the energy, and the warnings. A note on
/// the discretization follows if the program chose or checked the numerics. Its color is good, doubtful with warnings,
/// or bad for a run that stopped.
fn first_card(report: &SimulationReport, samples: &[FilmSample]) -> String {
    let energy = escaped(&capitalized(&report.energy_in_words()));
    let mut content = tip_table(samples) + &format!("<p>{energy}.</p>\n");
    if let Some(resolution) = &report.resolution {
        content += &note(&format!("{}.", escaped(&capitalized(&resolution.words()))));
    }
    run_card(&report.status, &report.warnings, &content)
}

/// The card of a run that ended with this `status`, HTML: the `content`, and the warnings. Its color is bad unless the
/// status is `completed`, else doubtful with warnings, good without.
pub(super) fn run_card(status: &str, warnings: &[String], content: &str) -> String {
    let tone = Tone::of_result(status == "completed", !warnings.is_empty());
    let warnings = MessageList { heading: "Warnings", messages: warnings.to_vec() };
    card(tone, &with_explanation(&capitalized(status)), content, &[warnings])
}

/// The unit with prefix for all positions of the tip, by the largest absolute coordinate.
fn tip_scale(samples: &[FilmSample]) -> Scale {
    Scale::for_values(samples.iter().flat_map(|sample| sample.tip), "m")
}

/// A coordinate, m, as a number in the unit of the scale, to a hundredth of it.
pub(super) fn coordinate(scale: &Scale, x: f64) -> String {
    scale.format(x, Some(DISPLAYED_ERROR * scale.factor))
}

/// The time axis, common to all charts, in seconds with a prefix by the last time.
fn time_axis(samples: &[FilmSample]) -> ChartAxis {
    ChartAxis::new("time", &Scale::for_values(samples.iter().map(|sample| sample.time), "s"))
}

/// The HTML table of the tip's position at the start, at its largest displacement from the start, and at the end, with
/// times and displacements. Coordinates that are always zero are left out. Empty without samples.
fn tip_table(samples: &[FilmSample]) -> String {
    let (Some(first), Some(last)) = (samples.first(), samples.last()) else { return String::new() };
    let displacement = |sample: &FilmSample| {
        let squares = sample.tip.iter().zip(&first.tip).map(|(x, start)| (x - start).powi(2));
        squares.sum::<f64>().sqrt()
    };
    // The time of the largest displacement shows the amplitude.
    let farthest =
        samples.iter().max_by(|a, b| displacement(a).total_cmp(&displacement(b))).unwrap_or(last);
    let scale = tip_scale(samples);
    let shown = |x: f64| coordinate(&scale, x);
    let rows =
        [("at the start", first), ("at the largest displacement", farthest), ("at the end", last)];
    let mut table = HtmlTable::new("position of the tip", rows)
        .id("answer")
        .text("tip", |(name, _)| name.to_string())
        .text("time", |(_, sample)| quantity(sample.time, "s"));
    for (c, axis) in AXES.iter().enumerate() {
        // A tip that stays in a plane has no column for the normal of the plane.
        let is_used = samples.iter().any(|sample| sample.tip[c] != 0.0);
        let head = labeled(axis, &scale.unit);
        table = table.text(&head, |(_, sample)| is_used.then(|| shown(sample.tip[c])));
    }
    let head = labeled("displacement", &scale.unit);
    table.text(&head, |(_, sample)| shown(displacement(sample))).render()
}

/// Up to [`MAX_SNAPSHOTS`] shapes side by side, evenly spaced in the stored frames, first and last included, as HTML:
/// one strip for each plane.
pub(super) fn snapshots(frames: &[Frame], planes: &[DrawingPlane]) -> String {
    let count = frames.len().min(MAX_SNAPSHOTS);
    let drawn = |k: usize| {
        // The first and the last frame are always drawn.
        let frame = &frames[(frames.len() - 1) * k / (count - 1).max(1)];
        let caption = quantity(frame.time, "s");
        DrawnSnapshot { time: frame.time, nodes: &frame.nodes, observed: &[], caption }
    };
    let snapshots: Vec<DrawnSnapshot> = (0..count).map(drawn).collect();
    planes.iter().map(|plane| strip(&snapshots, *plane, "The rod", "")).collect()
}

/// The figure of the energies, J, over time (HTML): total, kinetic, bending, stretching, twisting, loads, and contacts
/// with tendons and user-defined energies, without those that stay zero. The potential of the loads has an arbitrary
/// zero: its change since the start is shown, also in the total.
pub(super) fn energy(samples: &[FilmSample]) -> String {
    type Term = (&'static str, fn(&Energies) -> f64);
    let terms: [Term; 7] = [
        ("total", |e| e.total()),
        ("kinetic", |e| e.kinetic),
        ("bending", |e| e.bend),
        ("stretching", |e| e.stretch),
        ("twisting", |e| e.twist),
        ("potential of the loads, change", |e| e.potential),
        ("contacts, tendons and user-defined", |e| e.own),
    ];
    let start = samples.first().map_or(0.0, |sample| sample.energies.potential);
    let change =
        |s: &FilmSample| Energies { potential: s.energies.potential - start, ..s.energies };
    let energies: Vec<Energies> = samples.iter().map(change).collect();
    let all = terms.iter().flat_map(|(_, term)| energies.iter().map(term));
    let y = ChartAxis::new("energy", &Scale::for_values(all, "J"));
    let mut chart = PageChart::new(time_axis(samples), y, [760.0, 360.0]);
    for (k, (name, term)) in terms.iter().enumerate() {
        // A planar rod has no energy of twist, and most rods neither contacts nor tendons.
        if energies.iter().any(|e| term(e).abs() > 0.0) {
            let points = samples.iter().zip(&energies).map(|(s, e)| [s.time, term(e)]);
            let color = if k == 0 { "var(--ink)".into() } else { series_color(k - 1) };
            chart = chart.line(name, points, &color);
        }
    }
    figure("Energy over time", "energies over time", &chart, "")
}

/// The figures of the tip as HTML, side by side: its coordinates over time, and its path in each of the `planes`.
pub(super) fn tip(samples: &[FilmSample], planes: &[DrawingPlane]) -> String {
    let scale = tip_scale(samples);
    let size = [520.0, 340.0];
    let mut chart = PageChart::new(time_axis(samples), ChartAxis::new("position", &scale), size);
    for c in (0..3).filter(|c| planes.iter().flatten().any(|axis| axis == c)) {
        let points = samples.iter().map(|s| [s.time, s.tip[c]]);
        chart = chart.line(AXES[c], points, &series_color(c));
    }
    let mut figures = figure("Position over time", "tip position over time", &chart, "");
    for [a, b] in planes.iter().copied() {
        let [x, y] = [a, b].map(|c| ChartAxis::new(AXES[c], &scale));
        let path = samples.iter().map(|s| [s.tip[a], s.tip[b]]);
        let chart = PageChart::new(x, y, size).equal_scales();
        let chart = chart.line("path of the tip", path, "var(--observed)");
        let title = format!("Path in the {}{} plane", AXES[a], AXES[b]);
        figures += &figure(&title, &format!("tip: {title}"), &chart, "");
    }
    row(&figures)
}

/// The HTML table of scene file, model, mesh, time step, scheme, and cost of the run.
fn settings(report: &SimulationReport, problem: &Problem) -> String {
    let scene = problem.scene();
    let mesh = format!("{} segments on {}", problem.segments(), quantity(problem.length(), "m"));
    let model = format!("{}, {} degrees of freedom", report.model, report.dof);
    let cost = format!("{} steps, {} Newton iterations", report.steps, report.newton_iterations);
    run_settings(scene.path.as_deref(), model, mesh, scene.time.as_ref())
        .row("cost", cost)
        .row("wall-clock time", quantity(report.wall_seconds, "s"))
        .render()
}

/// The table of scene file, model, mesh, time step and scheme of a run.
pub(super) fn run_settings(
    scene: Option<&Path>,
    model: String,
    mesh: String,
    time: Option<&Time>,
) -> KeyTable {
    KeyTable::default()
        .row_if_any(
            "scene",
            scene
                .filter(|path| !path.ends_with(GIVEN_AS_TEXT))
                .map(|path| path.display().to_string()),
        )
        .row("model", model)
        .row("mesh", mesh)
        .row_if_any("time step", time.map(|time| time_steps(time.step_size(), time.end)))
        .row_if_any("scheme", time.map(|time| time.scheme.name()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The energy `own` is not only that of user-defined energies.
    #[test]
    fn energy_of_contacts_has_their_name_in_the_figure() {
        let sample = |time: f64| {
            let energies = Energies { kinetic: 1.0 - time, own: time, ..Energies::default() };
            FilmSample { time, tip: [0.0; 3], energies }
        };
        let figure = energy(&[sample(0.0), sample(0.5), sample(1.0)]);
        assert!(figure.contains("contacts, tendons and user-defined"), "{figure}");
    }
}
