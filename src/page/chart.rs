//! Small charts in the page's own colours and letters.

use crate::page::number::raised;
use kuva::prelude::{
    Layout, LinePlot, ReferenceLine, ScatterPlot, ShadedRegion, SvgBackend, Theme, TickFormat,
};
use kuva::render::annotations::{add_reference_lines, add_shaded_regions};
use kuva::render::layout::ComputedLayout;
use kuva::render::render::{Primitive, Scene, render_line, render_scatter};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Points of a series beyond this are thinned out.
const MOST_POINTS: usize = 2000;
/// Room for the labels, so that charts above each other line up.
const MARGINS: [f64; 2] = [88.0, 16.0];
/// Drawings wider than this have no room for a label beside the y axis on narrow screens.
const BROAD: f64 = 600.0;
/// Decades of a logarithmic axis below its top that are shown.
const DECADES: f64 = 12.0;

type Points = Vec<(f64, f64)>;

/// What is drawn in a chart.
enum Mark {
    Line(LinePlot),
    Dots(ScatterPlot),
}

/// A chart in the making. What is not finite is left out.
pub(super) struct Chart {
    marks: Vec<Mark>,
    lines: Vec<ReferenceLine>,
    regions: Vec<ShadedRegion>,
    labels: [String; 2],
    log: [bool; 2],
    /// Smallest and largest of both coordinates.
    range: [[f64; 2]; 2],
    equal: bool,
    whole: bool,
    size: [f64; 2],
}

impl Chart {
    pub fn new(x: impl Into<String>, y: impl Into<String>) -> Self {
        Self {
            marks: Vec::new(),
            lines: Vec::new(),
            regions: Vec::new(),
            labels: [x.into(), y.into()],
            log: [false; 2],
            range: [[f64::INFINITY, f64::NEG_INFINITY]; 2],
            equal: false,
            whole: false,
            size: [640.0, 300.0],
        }
    }

    pub fn size(self, width: f64, height: f64) -> Self {
        Self { size: [width, height], ..self }
    }
    /// Logarithmic axes; said before there is anything to show.
    pub fn log(self, x: bool, y: bool) -> Self {
        Self { log: [x, y], ..self }
    }
    /// One unit as long on both axes.
    pub fn equal(self) -> Self {
        Self { equal: true, ..self }
    }

    /// Whole numbers on the x axis.
    pub fn whole(self) -> Self {
        Self { whole: true, ..self }
    }
    /// An x axis that reaches over these places.
    pub fn over(mut self, places: impl IntoIterator<Item = f64>) -> Self {
        places.into_iter().filter(|x| x.is_finite()).for_each(|x| self.include(0, x));
        self
    }

    pub fn line(mut self, points: impl IntoIterator<Item = (f64, f64)>, color: &str) -> Self {
        let points = self.take(points);
        if !points.is_empty() {
            let line = LinePlot::new().with_data(points).with_color(color).with_stroke_width(1.6);
            self.marks.push(Mark::Line(line));
        }
        self
    }

    /// A band around a line: places, and its lower and upper edge there.
    pub fn around(mut self, edges: impl IntoIterator<Item = (f64, [f64; 2])>, color: &str) -> Self {
        let (low, high): (Points, Points) =
            edges.into_iter().map(|(x, [low, high])| ((x, low), (x, high))).unzip();
        let (low, high) = (self.take(low), self.take(high));
        let heights = |points: &Points| points.iter().map(|(_, y)| *y).collect::<Vec<f64>>();
        let (below, above) = (heights(&low), heights(&high));
        let line = LinePlot::new().with_data(low).with_color(color).with_stroke_width(0.0);
        self.marks.push(Mark::Line(line.with_band(below, above)));
        self
    }

    pub fn dots(
        mut self,
        points: impl IntoIterator<Item = (f64, f64)>,
        color: &str,
        size: f64,
    ) -> Self {
        let points = self.take(points);
        if !points.is_empty() {
            let dots = ScatterPlot::new().with_data(points).with_color(color).with_size(size);
            self.marks.push(Mark::Dots(dots));
        }
        self
    }

    /// A stem from the axis to each point.
    pub fn stems(mut self, points: impl IntoIterator<Item = (f64, f64)>, color: &str) -> Self {
        for (x, y) in self.take(points) {
            let stem = LinePlot::new().with_data([(x, 0.0), (x, y)]).with_color(color);
            self.marks.push(Mark::Line(stem.with_stroke_width(2.0)));
        }
        self.include(1, 0.0);
        self
    }

    /// A line across at a height, which stays in sight.
    pub fn level(mut self, y: f64) -> Self {
        if y.is_finite() {
            self.include(1, y);
            self.lines.push(dashed(ReferenceLine::horizontal(y)));
        }
        self
    }

    /// A line up from a place on the x axis.
    pub fn mark(mut self, x: f64) -> Self {
        if x.is_finite() {
            self.include(0, x);
            self.lines.push(dashed(ReferenceLine::vertical(x)));
        }
        self
    }

    /// A band across between two heights, which stays in sight.
    pub fn band(mut self, low: f64, high: f64) -> Self {
        if low.is_finite() && high.is_finite() {
            self.include(1, low);
            self.include(1, high);
            let band = ShadedRegion::horizontal(low, high);
            self.regions.push(band.with_color("var(--band)").with_opacity(1.0));
        }
        self
    }

    /// The drawing, or a word where there is nothing to draw.
    pub fn svg(self) -> String {
        if self.marks.is_empty() {
            return "<p class=\"none\">nothing to show</p>".into();
        }
        inline(&SvgBackend::default().render_scene(&self.drawn()))
    }

    /// The axes.
    fn layout(&self) -> Layout {
        let range = [self.padded(0), self.padded(1)];
        let [[left, right], [low, high]] = range;
        let mut layout = Layout::new((left, right), (low, high))
            .with_width(self.size[0])
            .with_height(self.size[1])
            .with_theme(theme())
            .with_label_size(13)
            .with_tick_size(12)
            .with_ticks(6)
            .with_axis_line_width(1.0)
            .with_grid_line_width(1.0)
            .with_force_margins(MARGINS[0], MARGINS[1])
            .with_x_axis_min(left)
            .with_x_axis_max(right)
            .with_y_axis_min(low)
            .with_y_axis_max(high)
            .with_x_label(self.labels[0].clone())
            .with_y_label(self.labels[1].clone())
            .with_x_tick_format(ticks(range[0], self.log[0]))
            .with_y_tick_format(ticks(range[1], self.log[1]));
        if self.log[0] {
            layout = layout.with_log_x();
        }
        if self.log[1] {
            layout = layout.with_log_y();
        }
        if self.equal {
            layout = layout.with_equal_aspect();
        }
        if self.whole {
            layout = layout.with_x_tick_step(((right - left) / 8.0).ceil().max(1.0));
        }
        layout
    }

    /// The drawing: axes, then what is clipped to them, bands, marks and lines. Kuva's function for several plots does the same,
    /// and brings all its dozens of kinds of plots into the program.
    fn drawn(&self) -> Scene {
        let computed = ComputedLayout::from_layout(&self.layout());
        let mut scene = render_line(&LinePlot::new(), self.layout());
        let axes = scene.elements.len();
        clip(&mut scene, &computed);
        add_shaded_regions(&self.regions, &mut scene, &computed);
        for mark in &self.marks {
            let alone = match mark {
                Mark::Line(line) => render_line(line, self.layout()),
                Mark::Dots(dots) => render_scatter(dots, self.layout()),
            };
            scene.elements.extend(alone.elements.into_iter().skip(axes));
        }
        add_reference_lines(&self.lines, &mut scene, &computed);
        scene.elements.push(Primitive::ClipEnd);
        scene
    }

    /// Keeps what can be drawn, and sees how far it reaches.
    fn take(&mut self, points: impl IntoIterator<Item = (f64, f64)>) -> Points {
        let [log_x, log_y] = self.log;
        let drawn = |(x, y): &(f64, f64)| {
            x.is_finite() && y.is_finite() && (!log_x || *x > 0.0) && (!log_y || *y > 0.0)
        };
        let points: Points = points.into_iter().filter(drawn).collect();
        for (x, y) in &points {
            self.include(0, *x);
            self.include(1, *y);
        }
        let every = points.len().div_ceil(MOST_POINTS).max(1);
        points.into_iter().step_by(every).collect()
    }

    fn include(&mut self, axis: usize, value: f64) {
        if !(self.log[axis] && value <= 0.0) {
            let [low, high] = &mut self.range[axis];
            (*low, *high) = (low.min(value), high.max(value));
        }
    }

    /// The range with some room, and never without extent.
    fn padded(&self, axis: usize) -> [f64; 2] {
        let [low, high] = self.range[axis];
        if self.log[axis] {
            let low = low.max(high * 10_f64.powf(-DECADES));
            let room = (high / low).powf(0.05).max(1.1);
            return [low / room, high * room];
        }
        let room = 0.05 * (high - low);
        // A single value, or rounding errors of one, needs an axis too.
        let least = 1e-9 * low.abs().max(high.abs());
        let room = if room > least { room } else { (0.1 * high.abs()).max(1.0) };
        let across = axis == 0 && !self.equal;
        let room = if across && room > least { 0.4 * room } else { room };
        [low - room, high + room]
    }
}

/// Begins what is not drawn outside of the axes.
fn clip(scene: &mut Scene, axes: &ComputedLayout) {
    // Ids are of the whole page.
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

/// As many decimals as ticks on such an axis need.
fn ticks([low, high]: [f64; 2], log: bool) -> TickFormat {
    let step = (high - low) / 10.0;
    let decimals = if log { 0 } else { (1.0 - step.log10().floor()).clamp(0.0, 9.0) as usize };
    TickFormat::Custom(Arc::new(move |x| {
        let text = match log {
            true => return decade(x),
            false => format!("{:.decimals$}", if x.abs() < 1e-9 * step { 0.0 } else { x }),
        };
        let text = match text.contains('.') && !text.contains('e') {
            true => text.trim_end_matches('0').trim_end_matches('.').to_string(),
            false => text,
        };
        text.replace('-', "\u{2212}")
    }))
}

/// A tick of a logarithmic axis: a power of ten, or a number near one.
fn decade(x: f64) -> String {
    let power = x.log10().round();
    match (x / 10_f64.powf(power) - 1.0).abs() < 1e-6 {
        true if power.abs() > 1.0 => format!("10{}", raised(power as i32)),
        _ if (1e-2..1e3).contains(&x) => format!("{}", (x * 1e4).round() / 1e4),
        _ => format!("{x:.0e}").replace('-', "\u{2212}"),
    }
}

/// The page's variables, so that the drawing is light or dark with it.
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
            let broad = width.parse::<f64>().is_ok_and(|width| width > BROAD);
            let class = if broad { " class=\"broad\"" } else { "" };
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
    fn nothing_breaks_a_chart() {
        let none: [(f64, f64); 0] = [];
        assert!(Chart::new("x", "y").line(none, "red").svg().contains("nothing to show"));
        let bad = [(f64::NAN, 1.0), (1.0, f64::INFINITY)];
        assert!(Chart::new("x", "y").dots(bad, "red", 3.0).svg().contains("nothing to show"));
        for (log, value) in [(false, 0.0), (false, 1e9), (true, 1e-300), (false, -1e-12)] {
            let svg = Chart::new("x", "y").log(log, log).dots([(value, value)], "red", 3.0).svg();
            assert!(svg.contains("<circle") && !svg.contains("NaN"), "{value}");
            assert!(!svg.contains("http") && svg.contains("viewBox"));
        }
        let zero = Chart::new("x", "y").log(true, true).dots([(0.0, -1.0)], "red", 3.0).svg();
        assert!(zero.contains("nothing to show"));
    }
}
