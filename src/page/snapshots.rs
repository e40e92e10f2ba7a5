//! Drawings of the rod at several times, side by side on one scale, as SVG: the nodes as a line, observed markers as
//! dots.
//!
//! [`strip`] draws a list of [`DrawnSnapshot`] (positions in m, caption in HTML) in one coordinate plane. The width of
//! a drawing is the whole width of the motion, or half its height if that is larger. Nodes with NaN are left out and
//! separate lines; films of structures have them between two rods. Output is HTML with a line that has the plane and
//! the width of a drawing, or a note if there are no points or infinite ones. Pages of simulations, and sections on
//! recordings, use it; shapes are visible without scripts and on paper.

use crate::page::html::{escaped, no_data};
use crate::page::number::quantity;
use crate::page::plane::{AXES, DrawingPlane, range};

/// Width of each drawing, px.
const WIDTH: f64 = 200.0;
/// Least height of a drawing, px.
const MIN_HEIGHT: f64 = 50.0;
/// Space between the drawn points and the edges, px.
const MARGIN: f64 = 8.0;

/// The rod at one time, with observed markers, if there are any.
pub(super) struct DrawnSnapshot<'a> {
    /// Time, s.
    pub time: f64,
    /// Positions of the nodes, m.
    pub nodes: &'a [[f64; 3]],
    /// Observed positions of the markers, m.
    pub observed: &'a [Option<[f64; 3]>],
    /// Caption, HTML.
    pub caption: String,
}

/// All snapshots projected on one plane, on one scale, as HTML, with a line that has the plane and the width of a
/// drawing. The width of a drawing is the whole width of the motion, or half its height if that is larger. `name` is
/// that of the rod, as text; `key` explains the colors, in HTML. Nodes with NaN are left out and separate lines. A note
/// in place of the drawings if there are no points or infinite ones.
pub(super) fn strip(
    snapshots: &[DrawnSnapshot],
    plane: DrawingPlane,
    name: &str,
    key: &str,
) -> String {
    let points =
        || snapshots.iter().flat_map(|s| s.nodes.iter().chain(s.observed.iter().flatten()));
    let [a, b] = plane;
    let [[left, right], [bottom, top]] = plane.map(|c| range(points().map(|x| x[c])));
    if ![left, right, bottom, top].iter().all(|x| x.is_finite()) {
        return no_data("no data") + "\n";
    }
    // One zoom for both axes; the motion is in the middle of each drawing.
    let extent = (right - left).max(0.5 * (top - bottom)).max(f64::MIN_POSITIVE);
    let zoom = (WIDTH - 2.0 * MARGIN) / extent;
    let height = ((top - bottom) * zoom + 2.0 * MARGIN).max(MIN_HEIGHT);
    let [x_margin, y_margin] =
        [WIDTH - (right - left) * zoom, height - (top - bottom) * zoom].map(|space| 0.5 * space);
    let pixel = |x: &[f64; 3]| [(x[a] - left) * zoom + x_margin, (top - x[b]) * zoom + y_margin];
    let drawing = |snapshot: &DrawnSnapshot| {
        // Positions that are not finite separate several rods, or are those of a run that failed.
        let is_finite = |x: &[f64; 3]| x.iter().all(|x| x.is_finite());
        let lines = snapshot.nodes.split(|x| !is_finite(x)).filter(|line| !line.is_empty());
        let lines = lines.map(|line| {
            let points = line.iter().map(pixel).map(|[x, y]| format!("{x:.1},{y:.1}"));
            let points = points.collect::<Vec<_>>().join(" ");
            format!("<polyline class=\"rod\" points=\"{points}\"/>")
        });
        let dots = snapshot.observed.iter().flatten().map(pixel);
        let dots = dots.map(|[x, y]| format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3\"/>"));
        let time = quantity(snapshot.time, "s");
        let label = format!("{name} in the {}{} plane at {time}", AXES[a], AXES[b]);
        format!(
            "<figure><svg viewBox=\"0 0 {WIDTH} {height:.1}\" role=\"img\" aria-label=\"{}\">\
             <g class=\"observed\">{}</g>{}</svg>\
             <figcaption>{}</figcaption></figure>\n",
            escaped(&label),
            dots.collect::<String>(),
            lines.collect::<String>(),
            snapshot.caption,
        )
    };
    format!(
        "<p class=\"key\">{}{} plane, each drawing {} wide{key}</p>\n<div class=\"moments\">{}</div>\n",
        AXES[a],
        AXES[b],
        quantity(WIDTH / zoom, "m"),
        snapshots.iter().map(drawing).collect::<String>(),
    )
}
