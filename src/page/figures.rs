//! The figures of a fit's page.

use crate::fit::Estimate;
use crate::fit::ResidualTests;
use crate::fit::{Abscissa, Landscape, PlotData, Profile, RodShape, Series};
use crate::numerics::order;
use crate::page::chart::Chart;
use crate::page::escaped;
use crate::page::number::{Scale, short};
use std::collections::HashMap;

/// Autocorrelations are shown up to this many samples apart.
const LAGS: usize = 40;
/// Points of a profile's curve between two fits.
const BETWEEN: usize = 16;
/// A coordinate that varies by less than this part of the largest is not drawn.
const FLAT: f64 = 1e-6;

const SEEN: &str = "var(--seen)";
const MODEL: &str = "var(--model)";

/// A drawing with words above and below it, and its `name` for who cannot see it; all words are HTML.
pub(super) fn figure(title: &str, name: &str, svg: &str, caption: &str) -> String {
    let svg = svg.replacen("role=\"img\"", &format!("role=\"img\" aria-label=\"{name}\""), 1);
    format!(
        "<figure><h3 class=\"small\">{title}</h3>{svg}<figcaption>{caption}</figcaption></figure>\n"
    )
}

/// Data, model, residuals and their correlation of one coordinate, and what the tests say, if any were made: none where the
/// coordinate has too few values.
pub(super) fn series(series: &Series, tests: Option<Option<&ResidualTests>>) -> String {
    let (place, per) = match series.abscissa {
        Abscissa::Time => ("s", "time"),
        Abscissa::ArcLength => ("m", "arc length"),
        Abscissa::Mode => ("", "mode"),
        Abscissa::Reading => ("", "reading"),
    };
    let across = match series.abscissa {
        Abscissa::Mode | Abscissa::Reading => Scale::of(1.0, place),
        _ => Scale::fitting(series.abscissa_values.iter().copied(), place),
    };
    let up = Scale::fitting(series.observed.iter().copied(), &series.unit);
    let x_label = labelled(per, &across.unit);
    let name = escaped(&series.axis);
    let at = |x: f64| x / across.factor;
    let points = |y: &[f64]| -> Vec<(f64, f64)> {
        series.abscissa_values.iter().zip(y).map(|(x, y)| (at(*x), y / up.factor)).collect()
    };
    let curve: Vec<(f64, f64)> = match series.curve.is_empty() {
        true => points(&series.simulated),
        false => series.curve.iter().map(|[x, y]| (at(*x), y / up.factor)).collect(),
    };
    let modes = matches!(series.abscissa, Abscissa::Mode | Abscissa::Reading);
    let axis = |y: String| match modes {
        true => Chart::new(x_label.clone(), y).whole(),
        false => Chart::new(x_label.clone(), y),
    };
    let all = || curve.iter().map(|(x, _)| *x).chain(series.abscissa_values.iter().map(|x| at(*x)));
    let both = axis(labelled(&series.axis, &up.unit)).size(680.0, 290.0).over(all());
    let both = match modes {
        true => both.dots(curve.clone(), MODEL, 6.0).dots(points(&series.observed), SEEN, 3.5),
        false => both.dots(points(&series.observed), SEEN, 2.6).line(curve.clone(), MODEL),
    };
    let residuals = series.residuals();
    let left = axis("(model \u{2212} data) / \u{3c3}".into())
        .size(680.0, 200.0)
        .over(all())
        .band(-2.0, 2.0)
        .level(0.0)
        .dots(series.abscissa_values.iter().zip(&residuals).map(|(x, r)| (at(*x), *r)), SEEN, 2.6);
    let n = residuals.len() as f64;
    let band = 1.96 / n.max(1.0).sqrt();
    let lags = autocorrelation(&residuals);
    let correlation = Chart::new("samples apart", "autocorrelation")
        .size(400.0, 290.0)
        .whole()
        .band(-band, band)
        .stems(lags.iter().copied(), SEEN)
        .dots(lags.iter().copied(), SEEN, 3.0);
    let parts = [series.experiment.as_str(), series.label.as_str()];
    let of: Vec<String> = parts.into_iter().filter(|p| !p.is_empty()).map(escaped).collect();
    let figure = |what: &str, svg: &str, caption: &str| {
        let title = format!("{name}: {what}");
        figure(&title, &format!("{}, {title}", of.join(", ")), svg, caption)
    };
    let sigma = Scale::of(series.sigma, &series.unit);
    format!(
        "<div class=\"series\"><div>{}{}</div><div>{}{}</div></div>\n",
        figure(
            "data and model",
            &both.svg(),
            &format!(
                "<i class=\"dot seen\"></i>seen <i class=\"{} model\"></i>model{}",
                if modes { "dot" } else { "stroke" },
                if up.unit.is_empty() { String::new() } else { format!(", in {}", up.unit) }
            ),
        ),
        figure(
            "what is left",
            &left.svg(),
            &format!(
                "in units of \u{3c3} = {} {}; the band is \u{b1}2 \u{3c3}",
                sigma.show(series.sigma, Some(0.01 * series.sigma)),
                sigma.unit
            ),
        ),
        match lags.is_empty() {
            true => String::new(),
            false => figure(
                "correlation of what is left",
                &correlation.svg(),
                "white noise stays in the band, \u{b1}1.96/\u{221a}n, 95 % of the time",
            ),
        },
        tests.map_or(String::new(), |tests| tests.map_or(
            "<p class=\"none\">too few values to test for noise</p>".to_string(),
            probabilities,
        )),
    )
}

pub(super) fn labelled(name: &str, unit: &str) -> String {
    if unit.is_empty() { name.into() } else { format!("{name}, {unit}") }
}

fn probabilities(tests: &ResidualTests) -> String {
    let row = |name: &str, p: f64| {
        let class = if p < 1e-3 { " class=\"bad\"" } else { "" };
        format!("<tr><th>{name}</th><td{class}>{}</td></tr>", short(p))
    };
    format!(
        "<table class=\"tests\"><caption>How probable noise looks like this: p</caption>{}{}{}</table>\
         <p class=\"{}\">{}</p>",
        row("neighbours unlike (Ljung\u{2013}Box)", tests.whiteness),
        row("normal (Anderson\u{2013}Darling)", tests.normality),
        row("no trend in time", tests.trend),
        if tests.passed { "good" } else { "bad" },
        escaped(&tests.verdict),
    )
}

/// About zero: a fit has no mean of its own to remove.
fn autocorrelation(r: &[f64]) -> Vec<(f64, f64)> {
    let power: f64 = r.iter().map(|r| r * r).sum();
    let lags = LAGS.min(r.len() / 4);
    let at = |lag: usize| {
        let product: f64 = r.iter().zip(&r[lag..]).map(|(a, b)| a * b).sum();
        (lag as f64, product / power)
    };
    (1..=lags).map(at).collect()
}

/// The rise of twice the misfit. Its root is nearly straight, so that a few fits give a smooth
/// curve.
pub(super) fn profile(profile: &Profile, estimate: Option<&Estimate>) -> String {
    let scale = Scale::fitting(profile.values.iter().copied(), profile.name.unit());
    let best = estimate.and_then(|e| e.value);
    let side = |x: f64| best.map_or(1.0, |best| (x - best).signum());
    let points: Vec<(f64, f64)> = profile
        .values
        .iter()
        .zip(&profile.rise)
        .map(|(x, rise)| (*x / scale.factor, side(*x) * rise.max(0.0).sqrt()))
        .collect();
    let between = points.windows(2).flat_map(|pair| {
        let [(x0, y0), (x1, y1)] = [pair[0], pair[1]];
        (0..=BETWEEN).map(move |k| {
            let u = k as f64 / BETWEEN as f64;
            (x0 + u * (x1 - x0), (y0 + u * (y1 - y0)).powi(2))
        })
    });
    let mut chart =
        Chart::new(labelled(&profile.label, &scale.unit), "rise of 2 \u{d7} misfit / noise\u{b2}")
            .size(520.0, 280.0)
            .level(profile.level)
            .line(between, MODEL)
            .dots(points.iter().map(|(x, root)| (*x, root * root)), MODEL, 3.5);
    for end in estimate.and_then(|e| e.profile95).into_iter().flatten().flatten() {
        chart = chart.mark(end / scale.factor);
    }
    let name = escaped(&profile.label);
    figure(
        &name,
        &format!("likelihood profile of {name}"),
        &chart.svg(),
        "dots are fits of all others; dashed: the 95 % level, and where it is crossed",
    )
}

/// How the search came down.
pub(super) fn history(plots: &PlotData) -> String {
    let Some(last) = plots.history.last().map(|last| last.rms()) else { return String::new() };
    let mut stages: Vec<&str> = plots.history.iter().map(|i| i.stage.as_str()).collect();
    stages.dedup();
    stages.sort_unstable();
    stages.dedup();
    let order = ["scan", "coarse model", "growing horizon", "full model"];
    order::sort_by_key(&mut stages, |stage| {
        order.iter().position(|name| name == stage).unwrap_or(order.len())
    });
    let all = plots.history.iter().map(|i| (i.simulations, i.rms() / last));
    let mut chart = Chart::new("work, simulations", "rms residual / last")
        .log(false, true)
        .size(520.0, 280.0)
        .line(all, "var(--axis)");
    let mut legend = String::new();
    for (k, stage) in stages.iter().enumerate() {
        let color = format!("var(--stage{})", k % 4);
        let own = plots.history.iter().filter(|i| i.stage == **stage);
        chart = chart.dots(own.map(|i| (i.simulations, i.rms() / last)), &color, 3.5);
        legend += &format!("<i class=\"dot\" style=\"background:{color}\"></i>{} ", escaped(stage));
    }
    let words = format!("{legend}\u{2013} each over the part of the record it looks at");
    figure("Convergence", "convergence of the search", &chart.svg(), &words)
}

/// The misfit of the scan over one unknown. `moves` says whether motions were fitted, of which the scan has the first
/// period; shapes and frequencies have none.
pub(super) fn landscape(landscape: &Landscape, value: Option<f64>, moves: bool) -> String {
    let values = &landscape.values;
    let positive = values.iter().all(|x| *x > 0.0);
    let wide = values.iter().copied().fold(0.0, f64::max)
        > 20.0 * values.iter().copied().fold(f64::INFINITY, f64::min);
    let log = positive && wide;
    let (factor, unit) = match log {
        true => (1.0, Scale::of(1.0, landscape.name.unit()).unit),
        false => {
            let scale = Scale::fitting(values.iter().copied(), landscape.name.unit());
            (scale.factor, scale.unit)
        }
    };
    let least = landscape.misfit.iter().copied().fold(f64::INFINITY, f64::min);
    let points: Vec<(f64, f64)> =
        values.iter().zip(&landscape.misfit).map(|(x, y)| (x / factor, y / least)).collect();
    let mut chart = Chart::new(labelled(&landscape.label, &unit), "misfit / least")
        .log(log, true)
        .size(520.0, 280.0)
        .line(points.clone(), MODEL)
        .dots(points, MODEL, 3.0);
    if let Some(value) = value {
        chart = chart.mark(value / factor);
    }
    let name = escaped(&landscape.label);
    figure(
        &format!("Scan over {name}"),
        &format!("misfit in the scan over {name}"),
        &chart.svg(),
        &format!(
            "coarse {}, the other unknowns at their best; dashed: the fit{}",
            if moves { "model over the first period" } else { "mesh" },
            if value.is_some_and(|value| is_beside_the_minimum(landscape, value)) {
                ", which is not at the minimum of the scan: the coarse mesh has its minimum elsewhere"
            } else {
                ""
            }
        ),
    )
}

/// Whether a value lies more than a step of the scan away from the scan's minimum.
fn is_beside_the_minimum(landscape: &Landscape, value: f64) -> bool {
    let Landscape { values, misfit, .. } = landscape;
    let least = (0..misfit.len()).min_by(|i, j| misfit[*i].total_cmp(&misfit[*j]));
    let Some(least) = least.filter(|_| values.len() == misfit.len()) else { return false };
    let [low, high] = [least.saturating_sub(1), (least + 1).min(values.len() - 1)];
    !(values[low]..=values[high]).contains(&value)
}

/// One plane or two of the axes, that show most of these places.
pub(super) fn planes<'a, I: Iterator<Item = &'a [f64; 3]>>(
    places: impl Fn() -> I,
) -> Vec<[usize; 2]> {
    let extent = |c: usize| {
        let (low, high) = places().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
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
    order::sort_down_by(&mut planes, smaller);
    order::sort_down_by(&mut planes, larger);
    planes.truncate(2);
    // A rod that stays straight along an axis.
    if planes.is_empty() { vec![[0, 1]] } else { planes }
}

/// The rod over time, with the points seen, in one plane or two; not where a recording that leads it is drawn.
pub(super) fn shapes(is_interrupted: bool, plots: &PlotData) -> String {
    let motions = plots.recordings.as_ref().map_or(&[][..], |r| &r.motions);
    let is_drawn = |name: &str| motions.iter().any(|m| m.experiment == name);
    let mut experiments: Vec<&str> = plots.shapes.iter().map(|s| s.experiment.as_str()).collect();
    experiments.dedup();
    experiments.retain(|name| !is_drawn(name));
    let one = |experiment: &str| {
        let shapes: Vec<&RodShape> =
            plots.shapes.iter().filter(|s| s.experiment == experiment).collect();
        let seen = sightings(&plots.series, experiment);
        let planes = planes(|| shapes.iter().flat_map(|shape| &shape.nodes));
        let draw = |plane: &[usize; 2]| {
            let what = (&shapes[..], &seen[..], experiment);
            projection(what, *plane, planes.len() > 1)
        };
        let title = if experiment.is_empty() {
            String::new()
        } else {
            format!("<h3>{}</h3>\n", escaped(experiment))
        };
        format!(
            "{title}<div class=\"row\">{}</div>\n{}",
            planes.iter().map(draw).collect::<String>(),
            time_key(&shapes)
        )
    };
    let drawn: String = experiments.into_iter().map(one).collect();
    match (drawn.is_empty(), is_interrupted) {
        (false, _) => drawn,
        (true, true) => "<p class=\"none\">not simulated: the fit was interrupted</p>".into(),
        // All are drawn with their recordings.
        (true, false) if !motions.is_empty() => String::new(),
        (true, false) => "<p class=\"none\">none</p>".into(),
    }
}

/// Shapes and sightings of an experiment in one plane.
fn projection(
    (shapes, seen, experiment): (&[&RodShape], &[[Option<f64>; 3]], &str),
    [a, b]: [usize; 2],
    narrow: bool,
) -> String {
    let names = ["x", "y", "z"];
    let all = shapes.iter().flat_map(|shape| &shape.nodes).flatten().copied();
    let scale = Scale::fitting(all, "m");
    let of = |x: f64| x / scale.factor;
    let label = |c: usize| labelled(names[c], &scale.unit);
    let size = if narrow { [520.0, 460.0] } else { [760.0, 520.0] };
    let mut chart = Chart::new(label(a), label(b)).size(size[0], size[1]).equal();
    for (k, shape) in shapes.iter().enumerate() {
        let nodes = shape.nodes.iter().map(|x| (of(x[a]), of(x[b])));
        chart = chart.line(nodes, &color(k, shapes.len()));
    }
    let both = seen.iter().filter_map(|x| Some((of(x[a]?), of(x[b]?))));
    let chart = chart.dots(both, SEEN, 1.8);
    let title = format!("{}{} plane", names[a], names[b]);
    let of =
        if experiment.is_empty() { String::new() } else { format!(" of {}", escaped(experiment)) };
    figure(&title, &format!("the rod{of} in the {title}"), &chart.svg(), "")
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
        "<p class=\"key\">{} moments, t = {} <i style=\"background:linear-gradient(90deg,{})\"></i> {} {}; \
         <i class=\"dot seen\"></i>points seen</p>\n",
        times.len(),
        short(first / scale.factor),
        stops.join(","),
        short(last / scale.factor),
        scale.unit
    )
}

/// The coordinates that were seen of the same point at the same time.
fn sightings(series: &[Series], experiment: &str) -> Vec<[Option<f64>; 3]> {
    let mut points: HashMap<(&str, u64), [Option<f64>; 3]> = HashMap::new();
    let mut order = Vec::new();
    for s in series.iter().filter(|s| s.experiment == experiment && s.unit == "m") {
        let Some(c) = ["x", "y", "z"].iter().position(|axis| *axis == s.axis) else { continue };
        for (at, seen) in s.abscissa_values.iter().zip(&s.observed) {
            let key = (s.label.as_str(), at.to_bits());
            let point = points.entry(key).or_insert_with(|| {
                order.push(key);
                [None; 3]
            });
            point[c] = Some(*seen);
        }
    }
    order.iter().filter_map(|key| points.get(key).copied()).collect()
}
