//! The animation of a simulated motion on a page: a canvas, controls, the motion as JSON, and a script that draws it.
//!
//! Input: the frames (nodes, m, at stored times), the samples of the tip, obstacles, and the drawn planes. Positions
//! are rounded to integers up to [`LARGEST_COORDINATE`] by a [`DrawingGrid`], with one scale for all axes, which keeps
//! the page small. A motion with a single plane is drawn in it; others can be rotated, with the world axis that has the
//! largest component of gravity upwards. The speed selected first is that at which the motion takes closest to
//! `FIRST_DURATION`. Output: HTML, by [`player`] for the page of a rod and [`motion_player`] for that of a structure;
//! without scripts it has a note.

use crate::dynamics::{Film, FilmSample, Frame, SimulationReport};
use crate::page::html::{capitalized, escaped};
use crate::page::number::quantity;
use crate::page::obstacles::{DrawnRange, drawn_obstacles};
use crate::page::plane::{AXES, DrawingPlane, range};
use crate::problem::Problem;
use crate::scene::Contact;

/// The script (JavaScript) that draws the rod at a time, and plays and stops the motion.
const SCRIPT: &str = include_str!("simulation.js");
/// Largest integer coordinate in the data. The rod is drawn on fewer pixels, so that rounding is not visible; more
/// digits enlarge the page.
const LARGEST_COORDINATE: f64 = 9999.0;
/// Duration of the animation at the speed that is selected at first, s.
const FIRST_DURATION: f64 = 8.0;
/// Selectable speeds of the animation, as multiples of real time.
const SPEEDS: [f64; 15] =
    [1e-4, 1e-3, 2e-3, 5e-3, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 100.0];

/// The transformation of positions, m, to integer coordinates of the drawing.
struct DrawingGrid {
    /// World axis (0 x, 1 y, 2 z) of each coordinate of the drawing.
    axes: Vec<usize>,
    /// Sign of each coordinate: -1 if it is opposite to its world axis.
    signs: Vec<f64>,
    /// Smallest value of each coordinate, with its sign, m.
    low: Vec<f64>,
    /// Extent of each coordinate in integer steps.
    extent: Vec<f64>,
    /// Length of one integer step, m.
    cell: f64,
}

/// A motion that is played. Nodes that are not finite separate the lines of several rods.
pub(super) struct PlayedMotion<'a> {
    /// Positions of all nodes at the stored times.
    pub frames: &'a [Frame],
    /// Position of the tip at the stored samples.
    pub samples: &'a [FilmSample],
    /// Length of the rod, m.
    pub length: f64,
    /// Gravitational acceleration, m/s^2.
    pub gravity: [f64; 3],
    /// Obstacles that the rod touches.
    pub contacts: &'a [Contact],
    /// Omitted steps and nodes, as HTML with a leading space; empty if there are none.
    pub thinned: String,
    /// The model, as HTML.
    pub model: String,
}

impl DrawingGrid {
    /// The transformation of the nodes and the tip path of a motion to integer coordinates from 0 to at most
    /// [`LARGEST_COORDINATE`], with one scale for all axes. There are two axes for a single plane, else all three. The
    /// last of these is the axis with the largest component of gravity, of equal ones the last, pointing upwards: z
    /// without gravity.
    fn new(motion: &PlayedMotion<'_>, planes: &[DrawingPlane]) -> Self {
        let (axes, signs) = match planes {
            [plane] => (plane.to_vec(), vec![1.0; 2]),
            _ => {
                let gravity = motion.gravity;
                let size = |c: &usize| gravity[*c].abs();
                let up = (0..3).max_by(|a, b| size(a).total_cmp(&size(b))).unwrap_or(2);
                // A second axis changes its sign too: the frame stays right-handed.
                let sign = if gravity[up] > 0.0 { -1.0 } else { 1.0 };
                (vec![(up + 1) % 3, (up + 2) % 3, up], vec![1.0, sign, sign])
            }
        };
        let nodes = motion.frames.iter().flat_map(|frame| &frame.nodes);
        let points: Vec<&[f64; 3]> =
            nodes.chain(motion.samples.iter().map(|sample| &sample.tip)).collect();
        let ranges: Vec<[f64; 2]> = axes
            .iter()
            .zip(&signs)
            .map(|(c, sign)| range(points.iter().map(|x| sign * x[*c])))
            .collect();
        // All axes have the scale of the longest.
        let largest = ranges.iter().map(|[low, high]| high - low).fold(0.0, f64::max);
        let cell = if largest > 0.0 { largest / LARGEST_COORDINATE } else { 1.0 };
        let low = ranges.iter().map(|[low, _]| *low).collect();
        let extent = ranges.iter().map(|[low, high]| (high - low) / cell).collect();
        Self { axes, signs, low, extent, cell }
    }

    /// The range of the drawing in the world: of a single plane the center has zero for its normal.
    fn drawn_range(&self) -> DrawnRange {
        let mut center = [0.0; 3];
        for (k, axis) in self.axes.iter().enumerate() {
            center[*axis] = self.signs[k] * (self.low[k] + 0.5 * self.extent[k] * self.cell);
        }
        let extent = self.cell * self.extent.iter().map(|e| e * e).sum::<f64>().sqrt();
        let plane = match self.axes[..] {
            [across, up] => Some([across, up]),
            _ => None,
        };
        DrawnRange { plane, center, extent: 2.0 * extent }
    }

    /// The integer coordinates of a displacement, m, as text separated by commas.
    fn displacement(&self, x: &[f64; 3]) -> String {
        let integer = |k: usize| {
            let way = self.signs[k] * x[self.axes[k]] / self.cell;
            if way.is_finite() { format!("{way:.0}") } else { "0".into() }
        };
        (0..self.axes.len()).map(integer).collect::<Vec<_>>().join(",")
    }

    /// The integer coordinates of a position, m, as text separated by commas; `null` for those that are not finite.
    fn coordinates(&self, x: &[f64; 3]) -> String {
        let integer = |k: usize| {
            let place = (self.signs[k] * x[self.axes[k]] - self.low[k]) / self.cell;
            if place.is_finite() { format!("{place:.0}") } else { "null".into() }
        };
        (0..self.axes.len()).map(integer).collect::<Vec<_>>().join(",")
    }
}

/// A JSON list of entries, each written by `notation`, separated by commas.
fn json_list<T>(entries: &[T], notation: impl Fn(&T) -> String) -> String {
    format!("[{}]", entries.iter().map(notation).collect::<Vec<_>>().join(","))
}

/// The data that the script draws, as JSON: axes, signs, extents, scale bar, times in s and frames (integer coordinates
/// of all nodes). Of the tip they have the positions in m at all samples, and the path with times in s and integer
/// coordinates.
fn motion_json(motion: &PlayedMotion<'_>, grid: &DrawingGrid) -> String {
    let PlayedMotion { frames, samples, length, .. } = *motion;
    // A bar of 1, 2 or 5 times a power of ten, about a quarter of the rod.
    let power = 10_f64.powf((0.25 * length).log10().floor());
    let bar = [5.0, 2.0, 1.0].into_iter().map(|k| k * power).find(|bar| *bar <= 0.25 * length);
    let bar = bar.unwrap_or(power);
    let digits = (4.0 - length.log10().ceil()).clamp(0.0, 12.0);
    let position = |x: &[f64; 3]| json_list(x, |x| format!("{x:.p$}", p = digits as usize + 1));
    format!(
        "{{\"obstacles\":{},\"axes\":{},\"signs\":{},\"middle\":{},\"extent\":{},\"reach\":{:.0},\"bar\":{{\"cells\":{:.1},\"label\":\
         \"{}\"}},\"digits\":{digits},\"times\":{},\"frames\":{},\"tips\":{},\"path\":{{\"times\":{},\"places\":{}}}}}",
        obstacles_json(motion, grid),
        json_list(&grid.axes, |c| format!("\"{}\"", AXES[*c])),
        json_list(&grid.signs, |sign| sign.to_string()),
        json_list(&grid.extent, |e| format!("{:.0}", 0.5 * e)),
        json_list(&grid.extent, |e| format!("{e:.0}")),
        grid.extent.iter().map(|e| e * e).sum::<f64>().sqrt(),
        bar / grid.cell,
        quantity(bar, "m"),
        json_list(frames, |frame| frame.time.to_string()),
        json_list(frames, |frame: &Frame| json_list(&frame.nodes, |x| grid.coordinates(x))),
        json_list(samples, |sample| position(&sample.tip)),
        json_list(samples, |sample| sample.time.to_string()),
        json_list(samples, |sample| format!("[{}]", grid.coordinates(&sample.tip))),
    )
}

/// The obstacles of a motion as JSON: polylines as lists of integer coordinates, and displacements at the stored times
/// in the same unit.
fn obstacles_json(motion: &PlayedMotion<'_>, grid: &DrawingGrid) -> String {
    let times: Vec<f64> = motion.frames.iter().map(|frame| frame.time).collect();
    let drawn = drawn_obstacles(motion.contacts, &grid.drawn_range(), &times);
    json_list(&drawn, |obstacle| {
        format!(
            "{{\"lines\":{},\"moved\":{}}}",
            json_list(&obstacle.lines, |line| json_list(line, |x| grid.coordinates(x))),
            json_list(&obstacle.displacements, |x| format!("[{}]", grid.displacement(x))),
        )
    })
}

/// The options (HTML) of the list of speeds for a motion of this `duration`, s. The speed at which it takes closest to
/// [`FIRST_DURATION`] is selected; speeds beyond a factor of about 1000 of it are left out.
fn speed_options(duration: f64) -> String {
    let difference = |speed: &f64| (duration / speed / FIRST_DURATION).ln().abs();
    let nearest = |a: &f64, b: &f64| difference(a).total_cmp(&difference(b));
    let first = SPEEDS.into_iter().min_by(nearest).unwrap_or(1.0);
    let option = |speed: f64| {
        let words = match speed {
            1.0 => "real time".into(),
            s if s < 1.0 => format!("{:.0} times slower", s.recip()),
            s => format!("{s:.0} times faster"),
        };
        let selected = if speed == first { " selected" } else { "" };
        format!("<option value=\"{speed}\"{selected}>{words}</option>")
    };
    // Within a factor of 1000.
    let near = SPEEDS.into_iter().filter(|speed| (speed / first).ln().abs() <= 7.0);
    near.map(option).collect()
}

/// The player of the motion of one rod as HTML with its canvas, controls, legend, data (JSON) and script. With a single
/// plane the drawing is still; in space it can be rotated. A note follows if the film omits steps or nodes of the run.
pub(super) fn player(
    report: &SimulationReport,
    film: &Film,
    problem: &Problem,
    planes: &[DrawingPlane],
) -> String {
    let thinned =
        film.thinned(problem).map(|text| format!(" Stored on this page: {}.", escaped(&text)));
    let model = format!(
        "{} model: {}",
        capitalized(&escaped(&report.model)),
        escaped(&report.model_reason)
    );
    let motion = PlayedMotion {
        frames: film.frames(),
        samples: film.samples(),
        length: problem.length(),
        gravity: problem.scene().loads.gravity,
        contacts: &problem.scene().contacts,
        thinned: thinned.unwrap_or_default(),
        model,
    };
    motion_player(&motion, planes)
}

/// The player of a motion of one or several rods as HTML, as [`player`]. With a single plane the data have two
/// coordinates, else three, which the script rotates.
pub(super) fn motion_player(motion: &PlayedMotion<'_>, planes: &[DrawingPlane]) -> String {
    // Three coordinates: the script rotates the rod about the axis of gravity.
    let grid = DrawingGrid::new(motion, planes);
    let duration = motion.frames.iter().map(|frame| frame.time).fold(0.0, f64::max);
    let (class, angles, hint) = match grid.axes.len() {
        3 => (
            "turns",
            "<label>Azimuth <input id=\"turn\" type=\"range\" min=\"-180\" max=\"180\" value=\"30\"></label>\
              <label>Elevation <input id=\"tilt\" type=\"range\" min=\"-90\" max=\"90\" value=\"20\"></label>",
            " Drag the drawing to rotate it.",
        ),
        _ => ("still", "", ""),
    };
    // The aspect ratio of the motion, within limits, %.
    let height = match &grid.extent[..] {
        [wide, high] => (100.0 * (high + 0.1 * wide) / wide.max(1.0)).clamp(30.0, 75.0),
        _ => 65.0,
    };
    format!(
        "<div class=\"player\"><canvas id=\"stage\" class=\"{class}\" style=\"aspect-ratio:100/{height:.0}\" role=\"img\" \
         aria-label=\"The rod in motion over {}\"></canvas>\n\
         <div class=\"controls\"><button id=\"play\" type=\"button\">Play</button>\
         <label class=\"long\">Time <input id=\"time\" type=\"range\" min=\"0\" max=\"1000\" value=\"0\"></label>\
         <label>Speed <select id=\"speed\">{}</select></label>{angles}</div>\n\
         <p id=\"now\" class=\"note\"></p></div>\n\
         <p class=\"note\"><i class=\"stroke model\"></i>rod <i class=\"stroke observed\"></i>path of the tip \
         {}\u{2013} dashed: the rod at the start.{hint}{} {}.</p>\n\
         <noscript><p class=\"note\">The animation needs scripts; the shapes below do not.</p></noscript>\n\
         <script type=\"application/json\" id=\"motion\">{}</script>\n<script>\n{SCRIPT}</script>\n",
        quantity(duration, "s"),
        speed_options(duration),
        if motion.contacts.is_empty() { "" } else { "<i class=\"stroke obstacle\"></i>obstacles " },
        motion.thinned,
        motion.model,
        motion_json(motion, &grid),
    )
}
