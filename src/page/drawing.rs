//! Renders a chart as inline SVG with the plotting library kuva, in the colors and fonts of the page.
//!
//! Input: a finished `PageChart`. Layout and ticks are set here; bands, series (marks) and reference lines are clipped
//! to the rectangle of the axes. Colors are CSS variables, so that a drawing follows the light or dark mode of the
//! page. A chart without any series becomes a note.

use crate::page::chart::{Mark, PageChart};
use crate::page::html::no_data;
use crate::page::number::{scientific, superscripts, with_minus_sign};
use kuva::prelude::{Layout, LinePlot, ReferenceLine, SvgBackend, Theme, TickFormat};
use kuva::render::annotations::{add_reference_lines, add_shaded_regions};
use kuva::render::layout::ComputedLayout;
use kuva::render::render::{Primitive, Scene, render_line, render_scatter};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Margins left and right of the axes, px; the same for all charts, so that their axes align.
const MARGINS: [f64; 2] = [88.0, 16.0];
/// Estimated width of a letter in the names of rows, px, which sets the left margin.
const LETTER_WIDTH: f64 = 9.0;
/// Most letters of a row's name; the middle of a longer name is left out.
const MAX_LETTERS: usize = 24;
/// Approximate number of ticks of an axis.
const TICKS: usize = 6;
/// Approximate number of ticks beside the names of rows, which leave less room.
const TICKS_BESIDE_NAMES: usize = 3;
/// Approximate number of ticks of charts up to [`LOW_HEIGHT`].
const TICKS_OF_LOW: usize = 4;
/// Height up to which a chart has fewer ticks, px.
const LOW_HEIGHT: f64 = 200.0;
/// Width above which a chart hides the label of the y axis on narrow screens (CSS class `broad`), px.
const BROAD_WIDTH: f64 = 600.0;

/// The drawing of a chart as an SVG element, or a note (HTML) if it has no marks.
pub(super) fn svg(chart: &PageChart) -> String {
    if chart.marks.is_empty() {
        return no_data("no data");
    }
    inline_svg(&SvgBackend::default().render_scene(&scene(chart)))
}

/// The layout of a chart for kuva, the plotting library: ranges, size, margins, ticks and labels of its axes. Names of
/// rows replace the label and numbers of the y axis, and widen the left margin. Ticks are about 6, or 4 up to a height
/// of [`LOW_HEIGHT`], and 3 beside names of rows; those of x may be restricted to whole numbers. Scales may be
/// logarithmic, or equal for both axes.
fn layout(chart: &PageChart) -> Layout {
    let [x, y] = &chart.axes;
    let [[left, right], [low, high]] = [0, 1].map(|axis| chart.padded_range(axis));
    let [width, height] = chart.size;
    let names: Vec<String> = chart.row_names.iter().map(|name| shortened(name)).collect();
    // Long names of rows need a wider margin than numbers.
    let longest = names.iter().map(|name| name.chars().count()).max().unwrap_or(0);
    let margin = MARGINS[0].max(LETTER_WIDTH * longest as f64 + 24.0);
    let mut layout = Layout::new((left, right), (low, high))
        .with_width(width)
        .with_height(height)
        .with_theme(theme())
        .with_label_size(13)
        .with_tick_size(12)
        .with_axis_line_width(1.0)
        .with_grid_line_width(1.0)
        .with_force_margins(margin, MARGINS[1])
        .with_x_axis_min(left)
        .with_x_axis_max(right)
        .with_y_axis_min(low)
        .with_y_axis_max(high)
        .with_x_label(x.label.clone())
        .with_x_tick_format(tick_labels([left, right], x.is_log));
    // Names of rows take the place of the label of the y axis.
    layout = match names.is_empty() {
        true => layout
            .with_ticks(if height <= LOW_HEIGHT { TICKS_OF_LOW } else { TICKS })
            .with_y_label(y.label.clone())
            .with_y_tick_format(tick_labels([low, high], y.is_log)),
        false => layout
            .with_ticks(TICKS_BESIDE_NAMES)
            .with_y_tick_step(1.0)
            .with_y_tick_format(TickFormat::Custom(Arc::new(move |y| row_name(&names, y)))),
    };
    if x.is_log {
        layout = layout.with_log_x();
    }
    if y.is_log {
        layout = layout.with_log_y();
    }
    if chart.has_equal_scales {
        layout = layout.with_equal_aspect();
    }
    if chart.has_whole_ticks {
        layout = layout.with_x_tick_step(((right - left) / 8.0).ceil().max(1.0));
    }
    layout
}

/// The name of the row at a height (name k is at -k); empty between two rows and outside of the list.
fn row_name(names: &[String], height: f64) -> String {
    let row = -height.round();
    let is_row = (height + row).abs() < 1e-6 && row >= 0.0;
    names.get(row as usize).filter(|_| is_row).cloned().unwrap_or_default()
}

/// A name, with its middle replaced by an ellipsis if it has more than [`MAX_LETTERS`] letters; the result then has
/// that many letters.
pub(super) fn shortened(name: &str) -> String {
    let letters: Vec<char> = name.chars().collect();
    if letters.len() <= MAX_LETTERS {
        return name.into();
    }
    let start = MAX_LETTERS / 2 - 1;
    let end = letters.len() - (MAX_LETTERS - 1 - start);
    letters[..start].iter().chain(&['\u{2026}']).chain(&letters[end..]).collect()
}

/// The graphic primitives of a chart in the order of drawing: axes, then bands, marks and dashed reference lines,
/// clipped to the axes.
fn scene(chart: &PageChart) -> Scene {
    let layout = || layout(chart);
    // The same layout clips and draws, so that all marks align.
    let computed = ComputedLayout::from_layout(&layout());
    let mut scene = render_line(&LinePlot::new(), layout());
    let axes = scene.elements.len();
    clip_to_axes(&mut scene, &computed);
    add_shaded_regions(&chart.regions, &mut scene, &computed);
    // Each mark is rendered as a chart of its own, without its axes. The function of kuva for several plots would link
    // the code of all its kinds of plots.
    for mark in &chart.marks {
        let alone = match mark {
            Mark::Line(line) => render_line(line, layout()),
            Mark::Dots(dots) => render_scatter(dots, layout()),
        };
        scene.elements.extend(alone.elements.into_iter().skip(axes));
    }
    let dashed = |line: &ReferenceLine| {
        line.clone().with_color("var(--mark)").with_stroke_width(1.2).with_dasharray("5 4")
    };
    let lines: Vec<ReferenceLine> = chart.lines.iter().map(dashed).collect();
    add_reference_lines(&lines, &mut scene, &computed);
    scene.elements.push(Primitive::ClipEnd);
    scene
}

/// Adds a clip path of the rectangle of the `axes`, and begins the part of `scene` that is clipped to it. The
/// identifier of the path is unique in the process.
fn clip_to_axes(scene: &mut Scene, axes: &ComputedLayout) {
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

/// The format of tick labels for the range of an axis: that of [`log_tick_label`] on a logarithmic axis. Else numbers
/// have as many decimals as the range needs, or two and a power of ten if the largest absolute end of the range is
/// below 1e-3 or from 1e6 on.
fn tick_labels([low, high]: [f64; 2], is_log: bool) -> TickFormat {
    if is_log {
        return TickFormat::Custom(Arc::new(log_tick_label));
    }
    let step = (high - low) / 10.0;
    let decimals = (1.0 - step.log10().floor()).clamp(0.0, 9.0) as usize;
    let is_plain = (1e-3..1e6).contains(&low.abs().max(high.abs()));
    TickFormat::Custom(Arc::new(move |x| {
        // Rounding errors of a tick at zero.
        let x = if x.abs() < 1e-9 * step { 0.0 } else { x };
        if is_plain || x == 0.0 {
            return with_minus_sign(without_trailing_zeros(&format!("{x:.decimals$}")));
        }
        let text = scientific(x, 2);
        let (mantissa, power) = text.split_once('\u{d7}').unwrap_or((&text, ""));
        format!("{}\u{d7}{power}", without_trailing_zeros(mantissa))
    }))
}

/// A decimal number without zeros at the end of its decimals, and without a point at its end.
fn without_trailing_zeros(number: &str) -> String {
    match number.contains('.') {
        true => number.trim_end_matches('0').trim_end_matches('.').into(),
        false => number.into(),
    }
}

/// The label of a tick on a logarithmic axis. Powers of ten below 0.1 and above 10 are 10 with an exponent. Other
/// numbers are decimal from 0.01 to below 1000, else a mantissa with a power of ten.
fn log_tick_label(x: f64) -> String {
    let power = x.log10().round();
    match (x / 10_f64.powf(power) - 1.0).abs() < 1e-6 {
        true if power.abs() > 1.0 => format!("10{}", superscripts(&power.to_string())),
        _ if (1e-2..1e3).contains(&x) => format!("{}", (x * 1e4).round() / 1e4),
        _ => scientific(x, 0),
    }
}

/// kuva's light theme with the colors of axes, grid and text as CSS variables of the page, so that a drawing is light
/// or dark with it.
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

/// An SVG document as an element of HTML: its opening tag is replaced by one with which the drawing shrinks where the
/// page is narrower than it. Empty if the document has no width or height.
fn inline_svg(svg: &str) -> String {
    let Some((head, body)) = svg.split_once('>') else { return String::new() };
    let attribute = |key: &str| Some(head.split_once(&format!(" {key}=\""))?.1.split_once('"')?.0);
    let (Some(width), Some(height)) = (attribute("width"), attribute("height")) else {
        return String::new();
    };
    let is_broad = width.parse::<f64>().is_ok_and(|width| width > BROAD_WIDTH);
    let class = if is_broad { " class=\"broad\"" } else { "" };
    format!(
        "<svg{class} viewBox=\"0 0 {width} {height}\" \
         style=\"max-width:{width}px;--width:{width}\" role=\"img\">{body}"
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::page::chart::{ChartAxis, IntervalPoint};

    const SIZE: [f64; 2] = [640.0, 300.0];

    #[test]
    fn empty_and_extreme_data_still_give_a_drawing() {
        let none: [[f64; 2]; 0] = [];
        assert!(svg(&PageChart::new("x", "y", SIZE).line("a", none, "red")).contains("no data"));
        let bad = [[f64::NAN, 1.0], [1.0, f64::INFINITY]];
        let chart = PageChart::new("x", "y", SIZE).dots("a", bad, "red", 3.0);
        assert!(svg(&chart).contains("no data") && chart.csv("a").is_empty());
        for (log, value) in [(false, 0.0), (false, 1e9), (true, 1e-300), (false, -1e-12)] {
            let axis = || ChartAxis::from("x").log(log);
            let chart = PageChart::new(axis(), axis(), SIZE).dots("a", [[value; 2]], "red", 3.0);
            let svg = svg(&chart);
            assert!(svg.contains("<circle") && !svg.contains("NaN"), "{value}");
            assert!(!svg.contains("http") && svg.contains("viewBox"));
        }
        let axis = || ChartAxis::from("x").log(true);
        let zero = PageChart::new(axis(), axis(), SIZE).dots("a", [[0.0, -1.0]], "red", 3.0);
        assert!(svg(&zero).contains("no data"));
    }

    #[test]
    fn small_values_without_a_prefix_have_powers_in_their_ticks() {
        let points = (0..5).map(|k| [f64::from(k), 1e-7 * f64::from(k)]);
        let small = svg(&PageChart::new("x", "y", SIZE).dots("a", points, "red", 3.0));
        assert!(small.contains("\u{d7}10\u{207b}\u{2077}<"), "{small}");
        let wide = [[1e-3, 1.0], [1e7, 2.0]];
        let chart = PageChart::new(ChartAxis::from("x").log(true), "y", SIZE);
        let wide = svg(&chart.dots("a", wide, "red", 3.0));
        assert!(wide.contains(">10\u{207b}\u{b3}<") && !wide.contains(">0\u{d7}"), "{wide}");
    }

    #[test]
    fn rows_have_their_names_and_their_points_in_the_file() {
        let names =
            vec!["first".to_string(), "a name of more than twenty-four letters".to_string()];
        let points = [
            IntervalPoint { at: [2.0, 0.0], ends: [1.0, 3.0] },
            IntervalPoint { at: [4.0, -1.0], ends: [3.5, 4.5] },
        ];
        let chart = PageChart::new("E (MPa)", "fit", SIZE)
            .row_names(names)
            .dots_with_bars("fits", &points, "red");
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
