//! The player of a simulated motion: its data, its controls and its script.

use crate::dynamics::{Film, Frame, SimulationReport};
use crate::page::html::{capitalized, escaped};
use crate::page::number::quantity;
use crate::page::shapes::AXES;
use crate::problem::Problem;

/// Plays and stops the motion, and draws the rod at a time.
const SCRIPT: &str = include_str!("simulation.js");
/// Coordinates on the page are integers up to this.
const GRID: f64 = 9999.0;
/// Duration of the motion at the speed that is selected first, s.
const SHOWN: f64 = 8.0;
/// Selectable speeds.
const SPEEDS: [f64; 15] =
    [1e-4, 1e-3, 2e-3, 5e-3, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 100.0];

/// Integer coordinates on the page: the axes of the world, their signs, the origin, and the size of a cell.
struct Grid {
    axes: Vec<usize>,
    signs: Vec<f64>,
    low: Vec<f64>,
    extent: Vec<f64>,
    /// Size of a cell, m.
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
                // A second axis changes its sign too: the frame stays right-handed.
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

/// A list as JSON, each entry as `of` writes it.
fn list<T>(entries: &[T], of: impl Fn(&T) -> String) -> String {
    format!("[{}]", entries.iter().map(of).collect::<Vec<_>>().join(","))
}

/// The data that the script draws, as JSON.
fn data(film: &Film, problem: &Problem, grid: &Grid) -> String {
    let names: Vec<&str> = grid.axes.iter().map(|c| AXES[*c]).collect();
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

/// The player of the motion.
pub(super) fn player(
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
            1.0 => "real time".into(),
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
            "<label>Azimuth <input id=\"turn\" type=\"range\" min=\"-180\" max=\"180\" value=\"30\"></label>\
              <label>Elevation <input id=\"tilt\" type=\"range\" min=\"-90\" max=\"90\" value=\"20\"></label>"
        }
        _ => "",
    };
    let hint = if turning.is_empty() { "" } else { " Drag the drawing to rotate it." };
    let high = match &grid.extent[..] {
        // The aspect ratio of the motion, within limits.
        [wide, high] => (100.0 * (high + 0.1 * wide) / wide.max(1.0)).clamp(30.0, 75.0),
        _ => 65.0,
    };
    let thinned = film.thinned(problem);
    let thinned = thinned
        .map_or(String::new(), |words| format!(" Stored on this page: {}.", escaped(&words)));
    format!(
        "<div class=\"player\"><canvas id=\"stage\" class=\"{}\" style=\"aspect-ratio:100/{high:.0}\" role=\"img\" \
         aria-label=\"The rod in motion over {}\"></canvas>\n\
         <div class=\"controls\"><button id=\"play\" type=\"button\">Play</button>\
         <label class=\"long\">Time <input id=\"time\" type=\"range\" min=\"0\" max=\"1000\" value=\"0\"></label>\
         <label>Speed <select id=\"speed\">{speeds}</select></label>{turning}</div>\n\
         <p id=\"now\" class=\"note\"></p></div>\n\
         <p class=\"note\"><i class=\"stroke model\"></i>rod <i class=\"stroke observed\"></i>path of the tip \
         \u{2013} dashed: the rod at the start.{hint}{thinned} {} model: {}.</p>\n\
         <noscript><p class=\"note\">The animation needs scripts; the shapes below do not.</p></noscript>\n\
         <script type=\"application/json\" id=\"motion\">{}</script>\n<script>\n{SCRIPT}</script>\n",
        if turning.is_empty() { "still" } else { "turns" },
        quantity(lasts, "s"),
        capitalized(&escaped(&report.model)),
        escaped(&report.model_reason),
        data(film, problem, &grid),
    )
}
