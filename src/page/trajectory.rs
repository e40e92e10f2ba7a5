//! The section "Trajectory" or "Shape at rest": the simulated rod at a dozen times of each experiment with the observed
//! points.
//!
//! Both are projected on the one or two planes of the rod's largest extents. Input are the shapes and series that a fit
//! or prediction kept for plots, m; each experiment has a figure per plane. Experiments with a drawn recording of their
//! own are left out, as another section shows them. Output is HTML.

use crate::fit::{PlotData, RodShape, Series};
use crate::page::chart::{ChartAxis, PageChart};
use crate::page::figure::{OBSERVED, figure, row};
use crate::page::html::{no_data, section, subsection};
use crate::page::number::{Scale, three_digits};
use crate::page::plane::{AXES, DrawingPlane, planes};
use std::collections::HashMap;

/// The section with the shapes of all experiments, as HTML, except those whose recordings are drawn elsewhere on the
/// page. A note replaces them if there are none and the fit was interrupted, or if there are no recordings either. Its
/// heading is "Shape at rest" if no shape has a time.
pub(super) fn trajectories(is_interrupted: bool, plots: &PlotData) -> String {
    let recorded = plots.recordings.as_ref().map_or(&[][..], |r| &r.motions);
    let mut experiments: Vec<&str> = plots.shapes.iter().map(|s| s.experiment.as_str()).collect();
    experiments.dedup();
    // Drawings of recordings are in a section of their own.
    experiments.retain(|name| recorded.iter().all(|motion| motion.experiment != *name));
    let mut html: String = experiments.iter().map(|name| trajectory(plots, name)).collect();
    if html.is_empty() && is_interrupted {
        html = no_data("not simulated: the fit was interrupted");
    } else if html.is_empty() && recorded.is_empty() {
        html = no_data("none");
    }
    let moves = plots.shapes.is_empty() || plots.shapes.iter().any(|shape| shape.time.is_some());
    section(if moves { "Trajectory" } else { "Shape at rest" }, &html)
}

/// The figures of one experiment's shapes with its observed points, one for each plane, under its name if it has one.
fn trajectory(plots: &PlotData, experiment: &str) -> String {
    let shapes: Vec<&RodShape> =
        plots.shapes.iter().filter(|s| s.experiment == experiment).collect();
    let observed = observed_points(&plots.series, experiment);
    let planes = planes(|| shapes.iter().flat_map(|shape| &shape.nodes));
    let size = if planes.len() > 1 { [520.0, 460.0] } else { [760.0, 520.0] };
    let draw = |plane: &DrawingPlane| {
        let chart = projection(&shapes, &observed, *plane, size);
        let title = format!("{}{} plane", AXES[plane[0]], AXES[plane[1]]);
        let of = if experiment.is_empty() { String::new() } else { format!(" of {experiment}") };
        figure(&title, &format!("rod{of}, {title}"), &chart, &time_key(&shapes))
    };
    subsection(experiment, &row(&planes.iter().map(draw).collect::<String>()))
}

/// A chart of shapes (a line each) and observed points (dots), m, in the plane of the axes `a` and `b`, with equal
/// scales. Points without both coordinates are left out.
fn projection(
    shapes: &[&RodShape],
    observed: &[[Option<f64>; 3]],
    [a, b]: DrawingPlane,
    size: [f64; 2],
) -> PageChart {
    let all = shapes.iter().flat_map(|shape| &shape.nodes).flatten().copied();
    let scale = Scale::for_values(all, "m");
    let [x, y] = [a, b].map(|c| ChartAxis::new(AXES[c], &scale));
    let mut chart = PageChart::new(x, y, size).equal_scales();
    for (k, shape) in shapes.iter().enumerate() {
        let name = shape.time.map_or("rod".into(), |time| format!("t = {} s", three_digits(time)));
        let nodes = shape.nodes.iter().map(|x| [x[a], x[b]]);
        chart = chart.line(&name, nodes, &time_color(k, shapes.len()));
    }
    let points = observed.iter().filter_map(|x| Some([x[a]?, x[b]?]));
    // The key of the times stands below the chart.
    chart.without_legend().dots("observed", points, OBSERVED, 1.8)
}

/// The CSS color of time number `k` (from 0) of `n`, from blue over violet to orange.
fn time_color(k: usize, n: usize) -> String {
    let part = k as f64 / n.saturating_sub(1).max(1) as f64;
    format!("hsl({:.0} 65% 55%)", 215.0 + 170.0 * part)
}

/// The number of times and the color scale between the first and the last one, as HTML; empty for shapes at rest.
fn time_key(shapes: &[&RodShape]) -> String {
    let times: Vec<f64> = shapes.iter().filter_map(|shape| shape.time).collect();
    let [Some(first), Some(last)] = [times.first(), times.last()] else { return String::new() };
    let scale = Scale::for_size(*last, "s");
    let colors: Vec<String> = (0..shapes.len()).map(|k| time_color(k, shapes.len())).collect();
    format!(
        "{} times, t = {} <i class=\"ramp\" style=\"background:linear-gradient(90deg,{})\"></i> {} {}",
        times.len(),
        three_digits(first / scale.factor),
        colors.join(","),
        three_digits(last / scale.factor),
        scale.unit
    )
}

/// The observed coordinates x, y, z, m, of each point of an experiment at each time, in the order of the series.
/// Missing coordinates are `None`; series in other units or along other axes are left out.
fn observed_points(series: &[Series], experiment: &str) -> Vec<[Option<f64>; 3]> {
    let mut index_of: HashMap<(&str, u64), usize> = HashMap::new();
    let mut points = Vec::new();
    for s in series.iter().filter(|s| s.experiment == experiment && s.unit == "m") {
        let Some(c) = AXES.iter().position(|axis| *axis == s.axis) else { continue };
        for (time, observed) in s.abscissa_values.iter().zip(&s.observed) {
            // Coordinates of one point at one time are in several series.
            let index = *index_of.entry((&s.label, time.to_bits())).or_insert(points.len());
            if index == points.len() {
                points.push([None; 3]);
            }
            points[index][c] = Some(*observed);
        }
    }
    points
}
