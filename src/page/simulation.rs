//! The page of a simulation: how it went, the rod in motion, its energies and its tip, and what was run.

use crate::dynamics::{Film, Frame, Sample, SimulationReport};
use crate::page::chart::Chart;
use crate::page::coded::with_its_code;
use crate::page::figures::{figure, labelled, planes};
use crate::page::moments::{Moment, strip};
use crate::page::number::{Scale, quantity, short};
use crate::page::{capitalised, escaped, page, section};
use crate::problem::Problem;
use crate::rod::Energies;

/// Plays, stops, and draws the rod at a moment.
const SCRIPT: &str = include_str!("simulation.js");
/// Moments drawn side by side.
const MOMENTS: usize = 12;
/// Places on the page are whole numbers up to this.
const GRID: f64 = 9999.0;
/// How long a motion is shown, s, at the speed that is offered first.
const SHOWN: f64 = 8.0;
/// Speeds that are offered.
const SPEEDS: [f64; 15] =
    [1e-4, 1e-3, 2e-3, 5e-3, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 100.0];

/// A self-contained HTML page of a simulation, with a script of its own that plays the motion. `title` says which, such
/// as the scene file's name.
pub fn simulation_page(
    report: &SimulationReport,
    film: &Film,
    problem: &Problem,
    title: &str,
) -> String {
    let mut body = verdict(report);
    let frames = film.frames();
    let planes = planes(|| frames.iter().flat_map(|frame| &frame.nodes));
    if !frames.is_empty() {
        body += &section("The motion", &motion(report, film, problem, &planes));
        body += &section("Moments", &moments(frames, &planes));
        body += &section("Energy", &energy(film.samples()));
        body += &section("The tip", &tip(film.samples(), &planes));
    }
    body += &section("What was run", &run(report, problem));
    page("Simulation", &escaped(title), &body)
}

/// How it ended, and everything that speaks against it.
fn verdict(report: &SimulationReport) -> String {
    let class = match (report.status == "completed", report.warnings.is_empty()) {
        (true, true) => "good",
        (true, false) => "doubt",
        (false, _) => "bad",
    };
    let warnings: String =
        report.warnings.iter().map(|w| format!("<li>{}</li>\n", with_its_code(w))).collect();
    let warnings = match warnings.is_empty() {
        true => String::new(),
        false => format!("<h2>Warnings</h2>\n<ul>\n{warnings}</ul>\n"),
    };
    let energy = escaped(&capitalised(&report.energy_in_words()));
    format!(
        "<section class=\"verdict {class}\" id=\"verdict\"><div class=\"words\">{}</div><p>{energy}.</p>\n{warnings}\
         </section>\n",
        with_its_code(&capitalised(&report.status)),
    )
}

/// How places in the world become numbers on the page: which axes, with which sign, from where, and how fine.
struct Grid {
    axes: Vec<usize>,
    signs: Vec<f64>,
    low: Vec<f64>,
    extent: Vec<f64>,
    /// Of a cell, m.
    cell: f64,
}

impl Grid {
    /// The plane of the motion, or all three axes with the one that points up last.
    fn new(film: &Film, problem: &Problem, planes: &[[usize; 2]]) -> Self {
        let (axes, signs) = match planes {
            [[a, b]] => (vec![*a, *b], vec![1.0; 2]),
            _ => {
                let gravity = problem.scene().loads.gravity;
                let size = |c: &usize| gravity[*c].abs();
                let up = (0..3).rev().max_by(|a, b| size(a).total_cmp(&size(b))).unwrap_or(2);
                // Turned over together with another axis, left stays left.
                let sign = if gravity[up] > 0.0 { -1.0 } else { 1.0 };
                (vec![(up + 1) % 3, (up + 2) % 3, up], vec![1.0, sign, sign])
            }
        };
        let mut grid = Self { axes, signs, low: Vec::new(), extent: Vec::new(), cell: 1.0 };
        let nodes = film.frames().iter().flat_map(|frame| &frame.nodes);
        let places = nodes.chain(film.samples().iter().map(|sample| &sample.tip));
        let mut range = vec![[f64::INFINITY, f64::NEG_INFINITY]; grid.axes.len()];
        for place in places {
            for (range, x) in range.iter_mut().zip(grid.turned(place)) {
                *range = [range[0].min(x), range[1].max(x)];
            }
        }
        let largest = range.iter().map(|[low, high]| high - low).fold(0.0, f64::max);
        grid.cell = if largest > 0.0 { largest / GRID } else { 1.0 };
        grid.low = range.iter().map(|[low, _]| *low).collect();
        grid.extent = range.iter().map(|[low, high]| (high - low) / grid.cell).collect();
        grid
    }

    fn turned(&self, place: &[f64; 3]) -> Vec<f64> {
        self.axes.iter().zip(&self.signs).map(|(c, sign)| sign * place[*c]).collect()
    }

    fn cells(&self, place: &[f64; 3]) -> String {
        let cell = |(x, low): (f64, &f64)| format!("{:.0}", (x - low) / self.cell);
        self.turned(place).into_iter().zip(&self.low).map(cell).collect::<Vec<_>>().join(",")
    }
}

/// A list as JSON, of what each entry becomes.
fn list<T>(entries: &[T], of: impl Fn(&T) -> String) -> String {
    format!("[{}]", entries.iter().map(of).collect::<Vec<_>>().join(","))
}

/// What the script draws.
fn data(film: &Film, problem: &Problem, grid: &Grid) -> String {
    let names: Vec<&str> = grid.axes.iter().map(|c| ["x", "y", "z"][*c]).collect();
    let (frames, samples) = (film.frames(), film.samples());
    let length = problem.length();
    // A bar of 1, 2 or 5 times a power of ten, about a quarter of the rod.
    let power = 10_f64.powf((0.25 * length).log10().floor());
    let bar = [5.0, 2.0, 1.0].into_iter().map(|k| k * power).find(|bar| *bar <= 0.25 * length);
    let bar = bar.unwrap_or(power);
    let digits = (4.0 - length.log10().ceil()).clamp(0.0, 12.0);
    let time = |t: f64| format!("{t}");
    let place = |x: &[f64; 3]| list(x, |x| format!("{x:.p$}", p = digits as usize + 1));
    let frame = |frame: &Frame| {
        let nodes: Vec<String> = frame.nodes.iter().map(|x| grid.cells(x)).collect();
        format!("[{}]", nodes.join(","))
    };
    format!(
        "{{\"axes\":{},\"signs\":{},\"middle\":{},\"extent\":{},\"reach\":{:.0},\"bar\":{{\"cells\":{:.1},\"label\":\
         \"{}\"}},\"digits\":{digits},\"times\":{},\"frames\":{},\"tips\":{},\"path\":{{\"times\":{},\"places\":{}}}}}",
        list(&names, |name| format!("\"{name}\"")),
        list(&grid.signs, |sign| sign.to_string()),
        list(&grid.extent, |e| format!("{:.0}", 0.5 * e)),
        list(&grid.extent, |e| format!("{e:.0}")),
        grid.extent.iter().map(|e| e * e).sum::<f64>().sqrt(),
        bar / grid.cell,
        quantity(bar, "m"),
        list(frames, |frame| time(frame.time)),
        list(frames, frame),
        list(samples, |sample| place(&sample.tip)),
        list(samples, |sample| time(sample.time)),
        list(samples, |sample| format!("[{}]", grid.cells(&sample.tip))),
    )
}

/// The player.
fn motion(
    report: &SimulationReport,
    film: &Film,
    problem: &Problem,
    planes: &[[usize; 2]],
) -> String {
    let grid = Grid::new(film, problem, planes);
    let times = film.frames().iter().map(|frame| frame.time);
    let lasts = times.fold(0.0, f64::max);
    let far = |speed: &f64| (lasts / speed / SHOWN).ln().abs();
    let first = SPEEDS.into_iter().min_by(|a, b| far(a).total_cmp(&far(b))).unwrap_or(1.0);
    let offered = |speed: &f64| {
        let words = match *speed {
            1.0 => "as fast as it is".into(),
            s if s < 1.0 => format!("{:.0} times slower", s.recip()),
            s => format!("{s:.0} times faster"),
        };
        let selected = if *speed == first { " selected" } else { "" };
        format!("<option value=\"{speed}\"{selected}>{words}</option>")
    };
    let near = |speed: &&f64| (-7.0..=7.0).contains(&(**speed / first).ln());
    let speeds: String = SPEEDS.iter().filter(near).map(offered).collect();
    let turning = match grid.axes.len() {
        3 => {
            "<label>Turn <input id=\"turn\" type=\"range\" min=\"-180\" max=\"180\" value=\"30\"></label>\
              <label>Tilt <input id=\"tilt\" type=\"range\" min=\"-90\" max=\"90\" value=\"20\"></label>"
        }
        _ => "",
    };
    let hint = if turning.is_empty() { "" } else { " Drag the drawing to turn it." };
    let high = match &grid.extent[..] {
        // As high as the motion is for its width, within reason.
        [wide, high] => (100.0 * (high + 0.1 * wide) / wide.max(1.0)).clamp(30.0, 75.0),
        _ => 65.0,
    };
    let thinned = film.thinned(problem);
    let thinned = thinned.map_or(String::new(), |words| format!(" Kept on this page: {words}."));
    format!(
        "<div class=\"player\"><canvas id=\"stage\" class=\"{}\" style=\"aspect-ratio:100/{high:.0}\" role=\"img\" \
         aria-label=\"The rod in motion over {} s\"></canvas>\n\
         <div class=\"controls\"><button id=\"play\" type=\"button\">Play</button>\
         <label class=\"long\">Time <input id=\"time\" type=\"range\" min=\"0\" max=\"1000\" value=\"0\"></label>\
         <label>Speed <select id=\"speed\">{speeds}</select></label>{turning}</div>\n\
         <p id=\"now\" class=\"note\"></p></div>\n\
         <p class=\"note\"><i class=\"stroke model\"></i>the rod <i class=\"stroke seen\"></i>the way of its tip \
         \u{2013} dashed: the rod at the start.{hint}{thinned} {} model: {}.</p>\n\
         <noscript><p class=\"note\">Without scripts the rod does not move; below are some moments.</p></noscript>\n\
         <script type=\"application/json\" id=\"motion\">{}</script>\n<script>\n{SCRIPT}</script>\n",
        if turning.is_empty() { "still" } else { "turns" },
        short(lasts),
        capitalised(&escaped(&report.model)),
        escaped(&report.model_reason),
        data(film, problem, &grid),
    )
}

/// Some frames side by side, for paper.
fn moments(frames: &[Frame], planes: &[[usize; 2]]) -> String {
    let count = frames.len().min(MOMENTS);
    let chosen = (0..count).map(|k| &frames[(frames.len() - 1) * k / (count - 1).max(1)]);
    let moment = |frame: &'_ Frame| format!("{} s", short(frame.time));
    let moments: Vec<Moment> = chosen
        .map(|f| Moment { time: f.time, nodes: &f.nodes, seen: &[], caption: moment(f) })
        .collect();
    planes.iter().map(|plane| strip(&moments, *plane, "The rod", "")).collect()
}

/// Terms with their colours, those that stay zero left out. What loads could still do has no zero of its own: shown is
/// by how much it changes.
fn energy(samples: &[Sample]) -> String {
    type Term = (&'static str, &'static str, fn(&Energies) -> f64);
    let terms: [Term; 7] = [
        ("total", "var(--ink)", |e| e.total()),
        ("motion", "var(--scheme0)", |e| e.kinetic),
        ("bending", "var(--scheme1)", |e| e.bend),
        ("stretching", "var(--scheme2)", |e| e.stretch),
        ("twisting", "var(--scheme3)", |e| e.twist),
        ("weight and loads, from the start", "var(--scheme4)", |e| e.potential),
        ("energies of your own", "var(--scheme5)", |e| e.own),
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
        Chart::new(labelled("time", &over.unit), labelled("energy", &up.unit)).size(760.0, 360.0);
    let mut legend = String::new();
    for (name, color, of) in terms {
        if largest(of) > 0.0 {
            let both = samples.iter().zip(&energies);
            let points = both.map(|(s, e)| (s.time / over.factor, of(e) / up.factor));
            chart = chart.line(points, color);
            legend += &format!("<i class=\"stroke\" style=\"background:{color}\"></i>{name} ");
        }
    }
    figure("Energy over time", "the rod's energies over time", &chart.svg(), &legend)
}

/// Where the tip is over time, and its way in the planes of the motion.
fn tip(samples: &[Sample], planes: &[[usize; 2]]) -> String {
    let names = ["x", "y", "z"];
    let scale = Scale::fitting(samples.iter().flat_map(|sample| sample.tip), "m");
    let over = Scale::fitting(samples.iter().map(|sample| sample.time), "s");
    let place = |s: &Sample, c: usize| s.tip[c] / scale.factor;
    let mut chart =
        Chart::new(labelled("time", &over.unit), labelled("place", &scale.unit)).size(520.0, 340.0);
    let mut legend = String::new();
    for c in (0..3).filter(|c| planes.iter().flatten().any(|axis| axis == c)) {
        let color = format!("var(--scheme{c})");
        chart = chart.line(samples.iter().map(|s| (s.time / over.factor, place(s, c))), &color);
        legend += &format!("<i class=\"stroke\" style=\"background:{color}\"></i>{} ", names[c]);
    }
    let mut drawn = figure("Over time", "the tip's place over time", &chart.svg(), &legend);
    for [a, b] in planes {
        let label = |c: usize| labelled(names[c], &scale.unit);
        let way = samples.iter().map(|s| (place(s, *a), place(s, *b)));
        let chart = Chart::new(label(*a), label(*b)).size(520.0, 340.0).equal();
        let title = format!("Its way in the {}{} plane", names[*a], names[*b]);
        drawn += &figure(&title, &title, &chart.line(way, "var(--seen)").svg(), "");
    }
    format!("<div class=\"row\">{drawn}</div>")
}

fn run(report: &SimulationReport, problem: &Problem) -> String {
    let scene = problem.scene();
    let mut rows: Vec<(&str, String)> = Vec::new();
    if let Some(path) = &scene.path {
        rows.push(("scene", path.display().to_string()));
    }
    rows.push(("model", format!("{}, {} unknowns", report.model, report.dof)));
    let (segments, length) = (problem.segments(), problem.length());
    rows.push(("segments", format!("{segments} on {}", quantity(length, "m"))));
    if let Some(time) = &scene.time {
        let step = format!("{} up to {}", quantity(time.step_size(), "s"), quantity(time.end, "s"));
        rows.push(("step", step));
        rows.push(("scheme", time.scheme.name().into()));
    }
    if let Some(resolution) = &report.resolution {
        rows.push(("chosen", resolution.words()));
    }
    let work = format!("{} steps, {} Newton iterations", report.steps, report.newton_iterations);
    rows.push(("work", work));
    rows.push(("time", quantity(report.wall_seconds, "s")));
    rows.push(("rodfit", env!("CARGO_PKG_VERSION").into()));
    let row = |(key, value): &(&str, String)| {
        format!("<tr><th>{key}</th><td>{}</td></tr>\n", escaped(value))
    };
    format!("<table class=\"plain\">{}</table>", rows.iter().map(row).collect::<String>())
}
