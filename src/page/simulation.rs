//! The page of a simulation: its result, the trajectory, energies and tip, and its settings.

use crate::dynamics::{Film, Frame, Sample, SimulationReport};
use crate::page::card::{Tone, card};
use crate::page::chart::{Chart, labeled};
use crate::page::figure::{figure, row};
use crate::page::html::{capitalized, escaped, note, section, with_explanation};
use crate::page::moments::{Moment, strip};
use crate::page::number::{Scale, quantity};
use crate::page::page;
use crate::page::player::player;
use crate::page::shapes::{AXES, planes};
use crate::page::table::{Table, of_keys};
use crate::problem::Problem;
use crate::rod::Energies;

/// Shapes drawn side by side.
const MOMENTS: usize = 12;
/// Second digit of positions behind the point, in the displayed unit.
const DIGIT: f64 = 0.1;

/// A self-contained HTML page of a simulation, with a script of its own that plays the motion. `title` names the
/// simulation, for example its scene file.
pub fn simulation_page(
    report: &SimulationReport,
    film: &Film,
    problem: &Problem,
    title: &str,
) -> String {
    let mut body = first_card(report, film.samples());
    let frames = film.frames();
    let planes = planes(|| frames.iter().flat_map(|frame| &frame.nodes));
    if !frames.is_empty() {
        body += &section("Trajectory", &player(report, film, problem, &planes));
        body += &section("Shapes over time", &moments(frames, &planes));
        body += &section("Energy", &energy(film.samples()));
        body += &section("Tip trajectory", &tip(film.samples(), &planes));
    }
    body += &section("Settings and cost", &settings(report, problem));
    page("Simulation", title, &body, None)
}

/// The end of the run, the motion of the tip, energy and discretization error, and the warnings.
fn first_card(report: &SimulationReport, samples: &[Sample]) -> String {
    let tone = match (report.status == "completed", report.warnings.is_empty()) {
        (true, true) => Tone::Good,
        (true, false) => Tone::Doubtful,
        (false, _) => Tone::Bad,
    };
    let energy = escaped(&capitalized(&report.energy_in_words()));
    let mut content = tip_table(samples) + &format!("<p>{energy}.</p>\n");
    if let Some(resolution) = &report.resolution {
        content += &note(&format!("{}.", escaped(&capitalized(&resolution.words()))));
    }
    let headline = with_explanation(&capitalized(&report.status));
    card(tone, &headline, &content, &[("Warnings", report.warnings.clone())])
}

/// Position of the tip at the start, at its largest displacement and at the end.
fn tip_table(samples: &[Sample]) -> String {
    let (Some(first), Some(last)) = (samples.first(), samples.last()) else { return String::new() };
    let displacement = |sample: &Sample| {
        let squares = sample.tip.iter().zip(&first.tip).map(|(x, start)| (x - start).powi(2));
        squares.sum::<f64>().sqrt()
    };
    let farthest =
        samples.iter().max_by(|a, b| displacement(a).total_cmp(&displacement(b))).unwrap_or(last);
    let scale = Scale::fitting(samples.iter().flat_map(|sample| sample.tip), "m");
    let heads = ["tip", "time"].map(String::from).into_iter();
    let heads = heads.chain(AXES.map(|axis| labeled(axis, &scale.unit)));
    let heads = heads.chain([labeled("displacement", &scale.unit)]);
    let mut table = Table::new("position of the tip", heads).id("answer");
    let rows =
        [("at the start", first), ("at the largest displacement", farthest), ("at the end", last)];
    let shown = |x: f64| Some(scale.show(x, Some(DIGIT * scale.factor)));
    let is_used = |c: usize| samples.iter().any(|sample| sample.tip[c] != 0.0);
    for (name, sample) in rows {
        let mut cells = vec![Some(quantity(sample.time, "s"))];
        cells.extend((0..3).map(|c| shown(sample.tip[c]).filter(|_| is_used(c))));
        cells.push(shown(displacement(sample)));
        table.row(name, cells);
    }
    table.html()
}

/// Some shapes side by side, for paper.
fn moments(frames: &[Frame], planes: &[[usize; 2]]) -> String {
    let count = frames.len().min(MOMENTS);
    let chosen = (0..count).map(|k| &frames[(frames.len() - 1) * k / (count - 1).max(1)]);
    let moments: Vec<Moment> = chosen
        .map(|f| Moment {
            time: f.time,
            nodes: &f.nodes,
            observed: &[],
            caption: quantity(f.time, "s"),
        })
        .collect();
    planes.iter().map(|plane| strip(&moments, *plane, "The rod", "")).collect()
}

/// The energies over time, without those that stay zero. The potential of the loads has no zero of its own: its change
/// is shown.
fn energy(samples: &[Sample]) -> String {
    type Term = (&'static str, &'static str, fn(&Energies) -> f64);
    let terms: [Term; 7] = [
        ("total", "var(--ink)", |e| e.total()),
        ("kinetic", "var(--scheme0)", |e| e.kinetic),
        ("bending", "var(--scheme1)", |e| e.bend),
        ("stretching", "var(--scheme2)", |e| e.stretch),
        ("twisting", "var(--scheme3)", |e| e.twist),
        ("potential of the loads, change", "var(--scheme4)", |e| e.potential),
        ("user-defined", "var(--scheme5)", |e| e.own),
    ];
    let start = samples.first().map_or(0.0, |sample| sample.energies.potential);
    let energies: Vec<Energies> = samples
        .iter()
        .map(|s| Energies { potential: s.energies.potential - start, ..s.energies })
        .collect();
    let largest =
        |of: fn(&Energies) -> f64| energies.iter().map(of).fold(0.0, |m, e| e.abs().max(m));
    let all = terms.map(|(.., of)| largest(of)).into_iter().fold(0.0, f64::max);
    let (up, over) =
        (Scale::of(all, "J"), Scale::fitting(samples.iter().map(|sample| sample.time), "s"));
    let mut chart =
        Chart::new(labeled("time", &over.unit), labeled("energy", &up.unit)).size(760.0, 360.0);
    for (name, color, of) in terms {
        if largest(of) > 0.0 {
            let both = samples.iter().zip(&energies);
            let points = both.map(|(s, e)| (s.time / over.factor, of(e) / up.factor));
            chart = chart.line(name, points, color);
        }
    }
    figure("Energy over time", "energies over time", &chart, "")
}

/// Position of the tip over time, and its path in the planes of the motion.
fn tip(samples: &[Sample], planes: &[[usize; 2]]) -> String {
    let scale = Scale::fitting(samples.iter().flat_map(|sample| sample.tip), "m");
    let over = Scale::fitting(samples.iter().map(|sample| sample.time), "s");
    let place = |s: &Sample, c: usize| s.tip[c] / scale.factor;
    let mut chart = Chart::new(labeled("time", &over.unit), labeled("position", &scale.unit))
        .size(520.0, 340.0);
    for c in (0..3).filter(|c| planes.iter().flatten().any(|axis| axis == c)) {
        let color = format!("var(--scheme{c})");
        let points = samples.iter().map(|s| (s.time / over.factor, place(s, c)));
        chart = chart.line(AXES[c], points, &color);
    }
    let mut drawn = figure("Position over time", "tip position over time", &chart, "");
    for [a, b] in planes {
        let label = |c: usize| labeled(AXES[c], &scale.unit);
        let path = samples.iter().map(|s| (place(s, *a), place(s, *b)));
        let chart = Chart::new(label(*a), label(*b)).size(520.0, 340.0).equal();
        let chart = chart.line("path of the tip", path, "var(--observed)");
        let title = format!("Path in the {}{} plane", AXES[*a], AXES[*b]);
        drawn += &figure(&title, &format!("tip: {title}"), &chart, "");
    }
    row(&drawn)
}

fn settings(report: &SimulationReport, problem: &Problem) -> String {
    let scene = problem.scene();
    let mut rows: Vec<(&str, String)> = Vec::new();
    if let Some(path) = &scene.path {
        rows.push(("scene", path.display().to_string()));
    }
    rows.push(("model", format!("{}, {} degrees of freedom", report.model, report.dof)));
    let (segments, length) = (problem.segments(), problem.length());
    rows.push(("mesh", format!("{segments} segments on {}", quantity(length, "m"))));
    if let Some(time) = &scene.time {
        let step = format!("{} up to {}", quantity(time.step_size(), "s"), quantity(time.end, "s"));
        rows.push(("time step", step));
        rows.push(("scheme", time.scheme.name().into()));
    }
    let cost = format!("{} steps, {} Newton iterations", report.steps, report.newton_iterations);
    rows.push(("cost", cost));
    rows.push(("wall-clock time", quantity(report.wall_seconds, "s")));
    of_keys(&rows)
}
