//! Charts drawn as SVG in the colors and letters of the page.

use crate::page::chart::{Chart, Mark};
use crate::page::number::{scientific, signed, superscripts};
use kuva::prelude::{Layout, LinePlot, ReferenceLine, SvgBackend, Theme, TickFormat};
use kuva::render::annotations::{add_reference_lines, add_shaded_regions};
use kuva::render::layout::ComputedLayout;
use kuva::render::render::{Primitive, Scene, render_line, render_scatter};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Margins left and right of the axes, px; the same for all charts, so that their axes align.
const MARGINS: [f64; 2] = [88.0, 16.0];
/// Width of a letter in the names of rows, px, and the largest number of letters.
const LETTER: f64 = 9.0;
const MAX_LETTERS: usize = 24;
/// Ticks of the axes; fewer beside the names of rows and on low charts, which leave less room.
const TICKS: usize = 6;
const TICKS_BESIDE_NAMES: usize = 3;
const TICKS_OF_LOW: usize = 4;
/// Charts up to this height are low, px.
const LOW: f64 = 200.0;
/// Charts wider than this have no room for the label of the y axis on narrow screens.
const BROAD: f64 = 600.0;

/// The drawing of a chart, or a note where there are no data.
pub(super) fn svg(chart: &Chart) -> String {
    if chart.marks.is_empty() {
        return "<p class=\"none\">no data</p>".into();
    }
    inline(&SvgBackend::default().render_scene(&scene(chart)))
}

fn layout(chart: &Chart) -> Layout {
    let range = [chart.padded(0), chart.padded(1)];
    let [[left, right], [low, high]] = range;
    let names: Vec<String> = chart.rows.iter().map(|name| cut(name)).collect();
    let longest = names.iter().map(|name| name.chars().count()).max().unwrap_or(0);
    let margin = MARGINS[0].max(LETTER * longest as f64 + 24.0);
    let mut layout = Layout::new((left, right), (low, high))
        .with_width(chart.size[0])
        .with_height(chart.size[1])
        .with_theme(theme())
        .with_label_size(13)
        .with_tick_size(12)
        .with_ticks(match (names.is_empty(), chart.size[1] <= LOW) {
            (false, _) => TICKS_BESIDE_NAMES,
            (true, true) => TICKS_OF_LOW,
            (true, false) => TICKS,
        })
        .with_axis_line_width(1.0)
        .with_grid_line_width(1.0)
        .with_force_margins(margin, MARGINS[1])
        .with_x_axis_min(left)
        .with_x_axis_max(right)
        .with_y_axis_min(low)
        .with_y_axis_max(high)
        .with_x_label(chart.labels[0].clone())
        .with_x_tick_format(ticks(range[0], chart.log[0]))
        .with_y_tick_format(match names.is_empty() {
            true => ticks(range[1], chart.log[1]),
            false => TickFormat::Custom(Arc::new(move |y| name_at(&names, y))),
        });
    if chart.rows.is_empty() {
        layout = layout.with_y_label(chart.labels[1].clone());
    }
    if chart.log[0] {
        layout = layout.with_log_x();
    }
    if chart.log[1] {
        layout = layout.with_log_y();
    }
    if chart.equal {
        layout = layout.with_equal_aspect();
    }
    if chart.whole {
        layout = layout.with_x_tick_step(((right - left) / 8.0).ceil().max(1.0));
    }
    if !chart.rows.is_empty() {
        layout = layout.with_y_tick_step(1.0);
    }
    layout
}

/// The name of the row at a height.
fn name_at(names: &[String], y: f64) -> String {
    let k = -y.round();
    match (y + k).abs() < 1e-6 && k >= 0.0 {
        true => names.get(k as usize).cloned().unwrap_or_default(),
        false => String::new(),
    }
}

/// A name with an ellipsis in its middle where it is too long for an axis.
fn cut(name: &str) -> String {
    let letters: Vec<char> = name.chars().collect();
    if letters.len() <= MAX_LETTERS {
        return name.into();
    }
    let start = MAX_LETTERS / 2 - 1;
    let end = letters.len() - (MAX_LETTERS - 1 - start);
    letters[..start].iter().chain(&['\u{2026}']).chain(&letters[end..]).collect()
}

/// The axes, then bands, marks and lines, clipped to the axes. The function of kuva for several plots does the same,
/// and adds all its dozens of kinds of plots to the program.
fn scene(chart: &Chart) -> Scene {
    let layout = || layout(chart);
    let computed = ComputedLayout::from_layout(&layout());
    let mut scene = render_line(&LinePlot::new(), layout());
    let axes = scene.elements.len();
    clip(&mut scene, &computed);
    add_shaded_regions(&chart.regions, &mut scene, &computed);
    for mark in &chart.marks {
        let alone = match mark {
            Mark::Line(line) => render_line(line, layout()),
            Mark::Dots(dots) => render_scatter(dots, layout()),
        };
        scene.elements.extend(alone.elements.into_iter().skip(axes));
    }
    let lines: Vec<ReferenceLine> = chart.lines.iter().cloned().map(dashed).collect();
    add_reference_lines(&lines, &mut scene, &computed);
    scene.elements.push(Primitive::ClipEnd);
    scene
}

/// Begins the part of the drawing that is clipped to the axes.
fn clip(scene: &mut Scene, axes: &ComputedLayout) {
    // Identifiers are unique on the page.
    static COUNT: AtomicUsize = AtomicUsize::new(0);
    let id = format!("clip-{}", COUNT.fetch_add(1, Ordering::Relaxed));
    let (x, y, width, height) =
        (axes.margin_left, axes.margin_top, axes.plot_width(), axes.plot_height());
    let [left, top, wide, high] = [x, y, width, height].map(|v| (v * 100.0).round() / 100.0);
    scene.defs.push(format!(
        "<clipPath id=\"{id}\"><rect x=\"{left}\" y=\"{top}\" width=\"{wide}\" height=\"{high}\"/></clipPath>"
    ));
    scene.elements.push(Primitive::ClipStart { x, y, width, height, id });
}

fn dashed(line: ReferenceLine) -> ReferenceLine {
    line.with_color("var(--mark)").with_stroke_width(1.2).with_dasharray("5 4")
}

/// Labels of ticks with as many decimals as the axis needs.
fn ticks([low, high]: [f64; 2], log: bool) -> TickFormat {
    let step = (high - low) / 10.0;
    let decimals = if log { 0 } else { (1.0 - step.log10().floor()).clamp(0.0, 9.0) as usize };
    let largest = low.abs().max(high.abs());
    let is_plain = (1e-3..1e6).contains(&largest);
    TickFormat::Custom(Arc::new(move |x| {
        if log {
            return decade(x);
        }
        let x = if x.abs() < 1e-9 * step { 0.0 } else { x };
        let text = match is_plain {
            false if x != 0.0 => return without_zeros(scientific(x, 2)),
            _ => format!("{x:.decimals$}"),
        };
        let text = match text.contains('.') {
            true => text.trim_end_matches('0').trim_end_matches('.').to_string(),
            false => text,
        };
        signed(text)
    }))
}

/// A power of ten whose mantissa has no zeros at its end.
fn without_zeros(number: String) -> String {
    match number.split_once('\u{d7}') {
        Some((mantissa, power)) => {
            let mantissa = mantissa.trim_end_matches('0').trim_end_matches('.');
            format!("{mantissa}\u{d7}{power}")
        }
        None => number,
    }
}

/// A tick of a logarithmic axis: a power of ten, or a number near one.
fn decade(x: f64) -> String {
    let power = x.log10().round();
    match (x / 10_f64.powf(power) - 1.0).abs() < 1e-6 {
        true if power.abs() > 1.0 => format!("10{}", superscripts(power as i32)),
        _ if (1e-2..1e3).contains(&x) => format!("{}", (x * 1e4).round() / 1e4),
        _ => scientific(x, 0),
    }
}

/// The variables of the page, so that the drawing is light or dark with it.
fn theme() -> Theme {
    Theme {
        background: "none".into(),
        axis_color: "var(--axis)".into(),
        grid_color: "var(--grid)".into(),
        tick_color: "var(--axis)".into(),
        text_color: "var(--soft)".into(),
        ..Theme::light()
    }
}

/// A drawing that shrinks with the page; inside of HTML it needs no namespace.
fn inline(svg: &str) -> String {
    let Some((head, body)) = svg.split_once('>') else { return String::new() };
    let value = |key: &str| {
        let rest = head.split_once(&format!(" {key}=\""))?.1;
        rest.split_once('"').map(|(value, _)| value.to_string())
    };
    match (value("width"), value("height")) {
        (Some(width), Some(height)) => {
            let is_broad = width.parse::<f64>().is_ok_and(|width| width > BROAD);
            let class = if is_broad { " class=\"broad\"" } else { "" };
            format!(
                "<svg{class} viewBox=\"0 0 {width} {height}\" \
                 style=\"max-width:{width}px;--width:{width}\" role=\"img\">{body}"
            )
        }
        _ => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn empty_and_extreme_data_still_give_a_drawing() {
        let none: [(f64, f64); 0] = [];
        assert!(svg(&Chart::new("x", "y").line("a", none, "red")).contains("no data"));
        let bad = [(f64::NAN, 1.0), (1.0, f64::INFINITY)];
        let chart = Chart::new("x", "y").dots("a", bad, "red", 3.0);
        assert!(svg(&chart).contains("no data") && chart.csv("a").is_empty());
        for (log, value) in [(false, 0.0), (false, 1e9), (true, 1e-300), (false, -1e-12)] {
            let svg =
                svg(&Chart::new("x", "y").log(log, log).dots("a", [(value, value)], "red", 3.0));
            assert!(svg.contains("<circle") && !svg.contains("NaN"), "{value}");
            assert!(!svg.contains("http") && svg.contains("viewBox"));
        }
        let zero = Chart::new("x", "y").log(true, true).dots("a", [(0.0, -1.0)], "red", 3.0);
        assert!(svg(&zero).contains("no data"));
    }

    #[test]
    fn small_values_without_a_prefix_have_powers_in_their_ticks() {
        let points = (0..5).map(|k| (f64::from(k), 1e-7 * f64::from(k)));
        let small = svg(&Chart::new("x", "y").dots("a", points, "red", 3.0));
        assert!(small.contains("\u{d7}10\u{207b}\u{2077}<"), "{small}");
        let wide = [(1e-3, 1.0), (1e7, 2.0)];
        let wide = svg(&Chart::new("x", "y").log(true, false).dots("a", wide, "red", 3.0));
        assert!(wide.contains(">10\u{207b}\u{b3}<") && !wide.contains(">0\u{d7}"), "{wide}");
    }

    #[test]
    fn rows_have_their_names_and_their_points_in_the_file() {
        let names =
            vec!["first".to_string(), "a name of more than twenty-four letters".to_string()];
        let points = [((2.0, 0.0), [1.0, 3.0]), ((4.0, -1.0), [3.5, 4.5])];
        let chart = Chart::new("E (MPa)", "fit").rows(names).dots_with_bars("fits", &points, "red");
        let svg = svg(&chart);
        assert!(svg.contains(">first<") && svg.contains(">a name of m\u{2026}four letters<"));
        assert!(
            chart.csv("E").contains(
                ",fit,E%20%28MPa%29,95%20%25%20low%3A%20E%20%28MPa%29,95%20%25%20high%3A%20E%20%28MPa%29%0A\
                 first,2,1,3%0Aa%20name%20of%20more%20than%20twenty-four%20letters,4,3.5,4.5%0A\""
            ),
            "{}",
            chart.csv("E")
        );
    }
}
