//! The rod at several times, drawn side by side on one scale.

use crate::page::html::escaped;
use crate::page::number::quantity;
use crate::page::shapes::AXES;

/// Width of a drawing, and its least height, px.
const WIDE: f64 = 200.0;
const LOW: f64 = 50.0;

/// The rod at one time.
pub(super) struct Moment<'a> {
    /// Time, s.
    pub time: f64,
    /// Positions of the nodes, m.
    pub nodes: &'a [[f64; 3]],
    /// Observed positions of the markers, m.
    pub observed: &'a [Option<[f64; 3]>],
    /// Caption, HTML.
    pub caption: String,
}

/// All moments in one plane on one scale. `name` is text; `key` explains the colors, in HTML.
pub(super) fn strip(moments: &[Moment], [a, b]: [usize; 2], name: &str, key: &str) -> String {
    let axes = AXES;
    let mut range = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
    for moment in moments {
        for x in moment.nodes.iter().chain(moment.observed.iter().flatten()) {
            for (range, x) in range.iter_mut().zip([x[a], x[b]]) {
                *range = [range[0].min(x), range[1].max(x)];
            }
        }
    }
    let [[left, right], [bottom, top]] = range;
    if ![left, right, bottom, top].iter().all(|x| x.is_finite()) {
        return "<p class=\"none\">no data</p>\n".into();
    }
    let room = 8.0;
    let extent = (right - left).max(0.5 * (top - bottom)).max(f64::MIN_POSITIVE);
    let zoom = (WIDE - 2.0 * room) / extent;
    let high = ((top - bottom) * zoom + 2.0 * room).max(LOW);
    let across = 0.5 * (WIDE - (right - left) * zoom);
    let up = 0.5 * (high - (top - bottom) * zoom);
    let at = |x: &[f64; 3]| ((x[a] - left) * zoom + across, (top - x[b]) * zoom + up);
    let cell = |moment: &Moment| {
        let line: Vec<String> = moment
            .nodes
            .iter()
            .filter(|x| x.iter().all(|x| x.is_finite()))
            .map(|x| format!("{:.1},{:.1}", at(x).0, at(x).1))
            .collect();
        let dot = |x: &[f64; 3]| {
            let (x, y) = at(x);
            format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3\"/>")
        };
        let dots: String = moment.observed.iter().flatten().map(dot).collect();
        let time = quantity(moment.time, "s");
        let label = format!("{name} in the {}{} plane at {time}", axes[a], axes[b]);
        format!(
            "<figure><svg viewBox=\"0 0 {WIDE} {high:.1}\" role=\"img\" aria-label=\"{}\">\
             <g class=\"observed\">{dots}</g><polyline class=\"rod\" points=\"{}\"/></svg>\
             <figcaption>{}</figcaption></figure>\n",
            escaped(&label),
            line.join(" "),
            moment.caption,
        )
    };
    let cells: String = moments.iter().map(cell).collect();
    format!(
        "<p class=\"key\">{}{} plane, each drawing {} wide{key}</p>\n<div class=\"moments\">{cells}</div>\n",
        axes[a],
        axes[b],
        quantity(WIDE / zoom, "m"),
    )
}
