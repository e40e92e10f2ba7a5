//! The rod at a dozen times, with the observed points, in one plane or two.

use crate::fit::{PlotData, RodShape, Series};
use crate::numerics::total_order;
use crate::page::chart::{Chart, labeled};
use crate::page::figure::{OBSERVED, figure, row};
use crate::page::html::escaped;
use crate::page::number::{Scale, short};
use std::cmp::Reverse;
use std::collections::HashMap;

/// Coordinates that vary by less than this part of the largest variation are not drawn.
const FLAT: f64 = 1e-6;
/// Names of the axes of the world.
pub(super) const AXES: [&str; 3] = ["x", "y", "z"];

/// One plane or two of the axes, those that show most of these points.
pub(super) fn planes<'a, I: Iterator<Item = &'a [f64; 3]>>(
    points: impl Fn() -> I,
) -> Vec<[usize; 2]> {
    let extent = |c: usize| {
        let (low, high) = points().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
            (low.min(x[c]), high.max(x[c]))
        });
        high - low
    };
    let extents = [extent(0), extent(1), extent(2)];
    let largest = extents.iter().copied().fold(0.0, f64::max);
    let mut planes = vec![[0, 1], [0, 2], [1, 2]];
    planes.retain(|plane| plane.iter().all(|c| extents[*c] > FLAT * largest));
    let smaller = |plane: &[usize; 2]| extents[plane[0]].min(extents[plane[1]]);
    let larger = |plane: &[usize; 2]| extents[plane[0]].max(extents[plane[1]]);
    planes.sort_by_cached_key(|x| Reverse(total_order(smaller(x))));
    planes.sort_by_cached_key(|x| Reverse(total_order(larger(x))));
    planes.truncate(2);
    // A rod that stays straight along an axis.
    if planes.is_empty() { vec![[0, 1]] } else { planes }
}

/// The shapes of all experiments, without those whose recordings are drawn elsewhere on the page.
pub(super) fn shapes(is_interrupted: bool, plots: &PlotData) -> String {
    let motions = plots.recordings.as_ref().map_or(&[][..], |r| &r.motions);
    let is_drawn = |name: &str| motions.iter().any(|m| m.experiment == name);
    let mut experiments: Vec<&str> = plots.shapes.iter().map(|s| s.experiment.as_str()).collect();
    experiments.dedup();
    experiments.retain(|name| !is_drawn(name));
    let drawn: String = experiments.into_iter().map(|name| of_experiment(plots, name)).collect();
    match (drawn.is_empty(), is_interrupted) {
        (false, _) => drawn,
        (true, true) => "<p class=\"none\">not simulated: the fit was interrupted</p>".into(),
        // All are drawn with their recordings.
        (true, false) if !motions.is_empty() => String::new(),
        (true, false) => "<p class=\"none\">none</p>".into(),
    }
}

/// The heading of these shapes.
pub(super) fn heading(plots: &PlotData) -> &'static str {
    let moves = plots.shapes.is_empty() || plots.shapes.iter().any(|shape| shape.time.is_some());
    if moves { "Trajectory" } else { "Shape at rest" }
}

fn of_experiment(plots: &PlotData, experiment: &str) -> String {
    let shapes: Vec<&RodShape> =
        plots.shapes.iter().filter(|s| s.experiment == experiment).collect();
    let observed = observed_points(&plots.series, experiment);
    let planes = planes(|| shapes.iter().flat_map(|shape| &shape.nodes));
    let size = if planes.len() > 1 { [520.0, 460.0] } else { [760.0, 520.0] };
    let draw = |plane: &[usize; 2]| {
        let chart = projection(&shapes, &observed, *plane).size(size[0], size[1]);
        let title = format!("{}{} plane", AXES[plane[0]], AXES[plane[1]]);
        let of = if experiment.is_empty() { String::new() } else { format!(" of {experiment}") };
        figure(&title, &format!("rod{of}, {title}"), &chart, &time_key(&shapes))
    };
    let title = match experiment.is_empty() {
        true => String::new(),
        false => format!("<h3>{}</h3>\n", escaped(experiment)),
    };
    title + &row(&planes.iter().map(draw).collect::<String>())
}

/// Shapes and observed points of an experiment in one plane.
fn projection(shapes: &[&RodShape], observed: &[[Option<f64>; 3]], [a, b]: [usize; 2]) -> Chart {
    let all = shapes.iter().flat_map(|shape| &shape.nodes).flatten().copied();
    let scale = Scale::fitting(all, "m");
    let of = |x: f64| x / scale.factor;
    let label = |c: usize| labeled(AXES[c], &scale.unit);
    let mut chart = Chart::new(label(a), label(b)).equal();
    for (k, shape) in shapes.iter().enumerate() {
        let nodes = shape.nodes.iter().map(|x| (of(x[a]), of(x[b])));
        let name = shape.time.map_or("rod".into(), |time| format!("t = {} s", short(time)));
        chart = chart.line(&name, nodes, &color(k, shapes.len()));
    }
    let both = observed.iter().filter_map(|x| Some((of(x[a]?), of(x[b]?))));
    // The key of the times below stands for all shapes.
    chart.without_legend().dots("observed", both, OBSERVED, 1.8)
}

/// From blue over violet to orange.
fn color(k: usize, n: usize) -> String {
    let part = k as f64 / n.saturating_sub(1).max(1) as f64;
    format!("hsl({:.0} 65% 55%)", 215.0 + 170.0 * part)
}

fn time_key(shapes: &[&RodShape]) -> String {
    let times: Vec<f64> = shapes.iter().filter_map(|shape| shape.time).collect();
    let [Some(first), Some(last)] = [times.first(), times.last()] else { return String::new() };
    let scale = Scale::of(*last, "s");
    let stops: Vec<String> = (0..shapes.len()).map(|k| color(k, shapes.len())).collect();
    format!(
        "{} times, t = {} <i class=\"ramp\" style=\"background:linear-gradient(90deg,{})\"></i> {} {}",
        times.len(),
        short(first / scale.factor),
        stops.join(","),
        short(last / scale.factor),
        scale.unit
    )
}

/// The observed coordinates of each point at each time.
fn observed_points(series: &[Series], experiment: &str) -> Vec<[Option<f64>; 3]> {
    let mut points: HashMap<(&str, u64), [Option<f64>; 3]> = HashMap::new();
    let mut order = Vec::new();
    for s in series.iter().filter(|s| s.experiment == experiment && s.unit == "m") {
        let Some(c) = AXES.iter().position(|axis| *axis == s.axis) else { continue };
        for (at, observed) in s.abscissa_values.iter().zip(&s.observed) {
            let key = (s.label.as_str(), at.to_bits());
            let point = points.entry(key).or_insert_with(|| {
                order.push(key);
                [None; 3]
            });
            point[c] = Some(*observed);
        }
    }
    order.iter().filter_map(|key| points.get(key).copied()).collect()
}
