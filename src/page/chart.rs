//! Charts: their data, with legend and CSV. [`drawing`](crate::page::drawing) draws them.

use crate::page::csv;
use crate::page::html::escaped;
use crate::page::plotted::{Datum, csv_rows};
use kuva::prelude::{LinePlot, ReferenceLine, ScatterPlot, ShadedRegion};

/// Points of a series beyond this number are thinned out.
const MAX_POINTS: usize = 2000;
/// Decades of a logarithmic axis that are shown below its top.
const DECADES: f64 = 12.0;

pub(super) type Points = Vec<(f64, f64)>;

/// A mark of a chart.
pub(super) enum Mark {
    Line(LinePlot),
    Dots(ScatterPlot),
}

/// A series of the legend.
struct Entry {
    name: String,
    color: String,
    is_line: bool,
}

/// A chart under construction. Values that are not finite are left out.
pub(super) struct Chart {
    pub marks: Vec<Mark>,
    pub lines: Vec<ReferenceLine>,
    pub regions: Vec<ShadedRegion>,
    pub labels: [String; 2],
    pub log: [bool; 2],
    /// Smallest and largest value on each axis.
    range: [[f64; 2]; 2],
    pub equal: bool,
    pub whole: bool,
    /// Names of the rows of a chart whose y axis has names: row k is at height -k.
    pub rows: Vec<String>,
    pub size: [f64; 2],
    legend: Vec<Entry>,
    data: Vec<Datum>,
    thinned: usize,
}

impl Chart {
    /// A chart with these labels of its axes, units included.
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
            rows: Vec::new(),
            size: [640.0, 300.0],
            legend: Vec::new(),
            data: Vec::new(),
            thinned: 1,
        }
    }

    pub fn size(self, width: f64, height: f64) -> Self {
        Self { size: [width, height], ..self }
    }

    /// Logarithmic axes; to be set before data are added.
    pub fn log(self, x: bool, y: bool) -> Self {
        Self { log: [x, y], ..self }
    }

    /// The same length of a unit on both axes.
    pub fn equal(self) -> Self {
        Self { equal: true, ..self }
    }

    /// Whole numbers on the x axis.
    pub fn whole(self) -> Self {
        Self { whole: true, ..self }
    }

    /// Names on the y axis, from the top; row k is at height -k.
    pub fn rows(mut self, names: Vec<String>) -> Self {
        let last = names.len().saturating_sub(1) as f64;
        [0.6, -last - 0.6].into_iter().for_each(|y| self.include(1, y));
        Self { rows: names, ..self }
    }

    /// An x axis that covers these values.
    pub fn covering(mut self, values: impl IntoIterator<Item = f64>) -> Self {
        values.into_iter().filter(|x| x.is_finite()).for_each(|x| self.include(0, x));
        self
    }

    /// A line of a series. Series without a name are decoration: neither legend nor CSV has them.
    pub fn line(
        mut self,
        series: &str,
        points: impl IntoIterator<Item = (f64, f64)>,
        color: &str,
    ) -> Self {
        let points = self.take(series, points);
        if !points.is_empty() {
            self.add_entry(series, color, true);
            let line = LinePlot::new().with_data(points).with_color(color).with_stroke_width(1.6);
            self.marks.push(Mark::Line(line));
        }
        self
    }

    /// Dots of a series; see [`line`](Self::line).
    pub fn dots(
        mut self,
        series: &str,
        points: impl IntoIterator<Item = (f64, f64)>,
        color: &str,
        radius: f64,
    ) -> Self {
        let points = self.take(series, points);
        if !points.is_empty() {
            self.add_entry(series, color, false);
            let dots = ScatterPlot::new().with_data(points).with_color(color).with_size(radius);
            self.marks.push(Mark::Dots(dots));
        }
        self
    }

    /// A line of a series with the interval of each point as a band.
    pub fn line_with_band(
        mut self,
        series: &str,
        points: &[((f64, f64), [f64; 2])],
        color: &str,
    ) -> Self {
        let edge = |k: usize| points.iter().map(move |((x, _), ends)| (*x, ends[k]));
        let (low, high) = (self.take("", edge(0)), self.take("", edge(1)));
        let heights = |points: &Points| points.iter().map(|(_, y)| *y).collect::<Vec<f64>>();
        let (below, above) = (heights(&low), heights(&high));
        let line = LinePlot::new().with_data(low).with_color(color).with_stroke_width(0.0);
        self.marks.push(Mark::Line(line.with_band(below, above)));
        let chart = self.line("", points.iter().map(|(point, _)| *point), color);
        chart.with_intervals(series, points)
    }

    /// Points of a series, each with a horizontal bar over its interval.
    pub fn dots_with_bars(
        mut self,
        series: &str,
        points: &[((f64, f64), [f64; 2])],
        color: &str,
    ) -> Self {
        for ((_, y), [low, high]) in points {
            self = self.line("", [(*low, *y), (*high, *y)], color);
        }
        let chart = self.dots("", points.iter().map(|(point, _)| *point), color, 4.0);
        chart.with_intervals(series, points)
    }

    /// A stem from the axis to each point, which are decoration.
    pub fn stems(mut self, points: impl IntoIterator<Item = (f64, f64)>, color: &str) -> Self {
        for (x, y) in self.take("", points) {
            let stem = LinePlot::new().with_data([(x, 0.0), (x, y)]).with_color(color);
            self.marks.push(Mark::Line(stem.with_stroke_width(2.0)));
        }
        self.include(1, 0.0);
        self
    }

    /// A horizontal line, always inside the range.
    pub fn level(mut self, y: f64) -> Self {
        if y.is_finite() {
            self.include(1, y);
            self.lines.push(ReferenceLine::horizontal(y));
        }
        self
    }

    /// A vertical line.
    pub fn mark(mut self, x: f64) -> Self {
        if x.is_finite() {
            self.include(0, x);
            self.lines.push(ReferenceLine::vertical(x));
        }
        self
    }

    /// A horizontal band, always inside the range.
    pub fn band(mut self, low: f64, high: f64) -> Self {
        if low.is_finite() && high.is_finite() {
            self.include(1, low);
            self.include(1, high);
            let band = ShadedRegion::horizontal(low, high);
            self.regions.push(band.with_color("var(--band)").with_opacity(1.0));
        }
        self
    }

    /// The names of the series beside their colors, as HTML, where there are several.
    pub fn legend(&self) -> String {
        let entry = |entry: &Entry| {
            let class = if entry.is_line { "stroke" } else { "dot" };
            let Entry { name, color, .. } = entry;
            format!("<i class=\"{class}\" style=\"background:{color}\"></i>{} ", escaped(name))
        };
        let thinned = match self.thinned {
            1 => String::new(),
            n => format!("(one of {n} points drawn) "),
        };
        let entries = if self.legend.len() > 1 { &self.legend[..] } else { &[] };
        entries.iter().map(entry).collect::<String>() + &thinned
    }

    /// The chart without the names of the series so far in its legend.
    pub fn without_legend(mut self) -> Self {
        self.legend.clear();
        self
    }

    /// A link to the plotted data as a CSV file, which is named after the chart; nothing without data.
    pub fn csv(&self, name: &str) -> String {
        match self.data.is_empty() {
            true => String::new(),
            false => csv::link(name, &csv_rows(&self.data, &self.labels, &self.rows)),
        }
    }

    fn with_intervals(mut self, series: &str, points: &[((f64, f64), [f64; 2])]) -> Self {
        let finite = points.iter().filter(|((x, y), _)| x.is_finite() && y.is_finite());
        self.data.extend(finite.map(|(point, ends)| Datum {
            series: series.into(),
            point: *point,
            interval: Some(*ends),
        }));
        self
    }

    fn add_entry(&mut self, series: &str, color: &str, is_line: bool) {
        let is_new = self.legend.iter().all(|entry| entry.name != series);
        if !series.is_empty() && is_new {
            self.legend.push(Entry { name: series.into(), color: color.into(), is_line });
        }
    }

    /// The points that can be drawn, thinned out, which extend the range; the data of the series.
    fn take(&mut self, series: &str, points: impl IntoIterator<Item = (f64, f64)>) -> Points {
        let [log_x, log_y] = self.log;
        let is_drawn = |(x, y): &(f64, f64)| {
            x.is_finite() && y.is_finite() && (!log_x || *x > 0.0) && (!log_y || *y > 0.0)
        };
        let points: Points = points.into_iter().filter(is_drawn).collect();
        for (x, y) in &points {
            self.include(0, *x);
            self.include(1, *y);
        }
        let every = points.len().div_ceil(MAX_POINTS).max(1);
        self.thinned = self.thinned.max(every);
        let kept: Points = points.into_iter().step_by(every).collect();
        if !series.is_empty() {
            let datum =
                |point: &(f64, f64)| Datum { series: series.into(), point: *point, interval: None };
            self.data.extend(kept.iter().map(datum));
        }
        kept
    }

    fn include(&mut self, axis: usize, value: f64) {
        if !(self.log[axis] && value <= 0.0) {
            let [low, high] = &mut self.range[axis];
            (*low, *high) = (low.min(value), high.max(value));
        }
    }

    /// The range of an axis with a margin, never without extent.
    pub fn padded(&self, axis: usize) -> [f64; 2] {
        let [low, high] = self.range[axis];
        if self.log[axis] {
            let low = low.max(high * 10_f64.powf(-DECADES));
            let margin = (high / low).powf(0.05).max(1.1);
            return [low / margin, high * margin];
        }
        if axis == 1 && !self.rows.is_empty() {
            return [low, high];
        }
        let margin = 0.05 * (high - low);
        // A single value, or rounding errors of one, needs an axis too.
        let least = 1e-9 * low.abs().max(high.abs());
        let margin = if margin > least { margin } else { (0.1 * high.abs()).max(1.0) };
        let is_along = axis == 0 && !self.equal;
        let margin = if is_along && margin > least { 0.4 * margin } else { margin };
        [low - margin, high + margin]
    }
}

/// The label of an axis: the quantity and its unit.
pub(super) fn labeled(name: &str, unit: &str) -> String {
    if unit.is_empty() { name.into() } else { format!("{name} ({unit})") }
}
