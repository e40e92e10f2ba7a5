//! Charts under construction: series of data in SI units, axes, legend and CSV. `drawing` renders them as SVG.
//!
//! Values are given in SI units and divided by the factor of the unit of their axis, except for horizontal reference
//! lines and shaded bands, which are in that unit already. A [`ChartAxis`] is linear unless `log` makes it logarithmic.
//! Points that are not finite, or not positive on a logarithmic axis, are left out. Functions of [`PageChart`]:
//!
//! - `line`, `dots` and `dotted_line` draw a series. If it has a name, it enters the legend and the CSV file, else it
//!   is decoration.
//! - `line_with_band` and `dots_with_bars` draw points with intervals, along y or along x. They enter the CSV file
//!   only.
//! - `stems` (decoration), `level` and `mark` (horizontal and vertical reference line), `band` (a shaded range of
//!   ordinates).
//! - `covering` extends the x axis without drawing. `equal_scales` gives both axes the same length per unit,
//!   `whole_ticks` restricts the ticks of the x axis to whole numbers, and `row_names` replaces the numbers of the y
//!   axis by names.
//! - `legend` returns HTML: the names of two or more series, and a note if points were thinned out. `without_legend`
//!   clears the names so far. `csv` returns an HTML link to the data, empty without any.
//!
//! Series of more than `MAX_POINTS` points are thinned out evenly, in the drawing and in the CSV file. Series with
//! intervals keep all finite points in the CSV file.

use crate::page::csv::csv_link;
use crate::page::html::escaped;
use crate::page::number::Scale;
use crate::page::plotted::{Datum, csv_rows};
use kuva::prelude::{LinePlot, ReferenceLine, ScatterPlot, ShadedRegion};

/// Most points of a series that are drawn, also in the CSV: more are thinned out evenly. More points enlarge the page
/// without a visible difference.
const MAX_POINTS: usize = 2000;
/// Decades of a logarithmic axis that are shown below its top; smaller values are cut off, as they would flatten the
/// rest.
const DECADES: f64 = 12.0;

/// Points of a chart: abscissa and ordinate, in SI units or, as they are drawn, in the units of the axes.
pub(super) type Points = Vec<[f64; 2]>;

/// A drawn series, in the units of the axes.
pub(super) enum Mark {
    Line(LinePlot),
    Dots(ScatterPlot),
}

/// A series of the legend: name, CSS color, and whether it is a line or dots.
struct LegendEntry {
    name: String,
    color: String,
    is_line: bool,
}

/// A point with its 95 % interval, in SI units: along y for a band, along x for a bar.
pub(super) struct IntervalPoint {
    /// Abscissa and ordinate.
    pub at: [f64; 2],
    /// Lower and upper end of the interval.
    pub ends: [f64; 2],
}

/// An axis with its label and the range of its data.
pub(super) struct ChartAxis {
    /// The quantity with its unit.
    pub label: String,
    pub is_log: bool,
    /// Factor by which SI values are divided to displayed values.
    factor: f64,
    /// Smallest and largest displayed value.
    range: [f64; 2],
}

impl ChartAxis {
    /// A linear axis of a quantity, labeled with its name and the unit of `scale`, and with an empty range.
    pub fn new(name: &str, scale: &Scale) -> Self {
        let label = labeled(name, &scale.unit);
        Self { label, is_log: false, factor: scale.factor, range: [f64::INFINITY, -f64::INFINITY] }
    }

    /// The axis in logarithmic scale if `is_log`, else in linear scale.
    pub fn log(self, is_log: bool) -> Self {
        Self { is_log, ..self }
    }

    /// Whether a displayed value can be drawn: it is finite, and positive on a logarithmic axis.
    fn can_show(&self, value: f64) -> bool {
        value.is_finite() && !(self.is_log && value <= 0.0)
    }

    /// Extends the range of the axis by a displayed value, if that can be drawn.
    fn include(&mut self, value: f64) {
        if self.can_show(value) {
            self.range = [self.range[0].min(value), self.range[1].max(value)];
        }
    }
}

impl From<&str> for ChartAxis {
    /// A linear axis with this label, whose values are displayed as they are (factor 1).
    fn from(label: &str) -> Self {
        Self::new(label, &Scale { factor: 1.0, unit: String::new() })
    }
}

/// A chart under construction. Values that are not finite are left out.
pub(super) struct PageChart {
    /// The x and the y axis.
    pub axes: [ChartAxis; 2],
    /// The drawn series in their order.
    pub marks: Vec<Mark>,
    /// Reference lines.
    pub lines: Vec<ReferenceLine>,
    /// Shaded bands.
    pub regions: Vec<ShadedRegion>,
    pub has_equal_scales: bool,
    pub has_whole_ticks: bool,
    /// Names on the y axis: name k is at height -k.
    pub row_names: Vec<String>,
    /// Width and height, px.
    pub size: [f64; 2],
    /// Named series in the order of their first drawing.
    legend: Vec<LegendEntry>,
    /// Points of the named series and of intervals, for the CSV file.
    data: Vec<Datum>,
    /// Largest stride of the drawn points of any series: one of so many points is drawn.
    thinning: usize,
}

impl PageChart {
    /// A chart without data, with these axes, and with width and height in px.
    pub fn new(x: impl Into<ChartAxis>, y: impl Into<ChartAxis>, size: [f64; 2]) -> Self {
        Self {
            axes: [x.into(), y.into()],
            marks: Vec::new(),
            lines: Vec::new(),
            regions: Vec::new(),
            has_equal_scales: false,
            has_whole_ticks: false,
            row_names: Vec::new(),
            size,
            legend: Vec::new(),
            data: Vec::new(),
            thinning: 1,
        }
    }

    /// Gives both axes the same length per unit.
    pub fn equal_scales(self) -> Self {
        Self { has_equal_scales: true, ..self }
    }

    /// Restricts the ticks of the x axis to whole numbers.
    pub fn whole_ticks(self) -> Self {
        Self { has_whole_ticks: true, ..self }
    }

    /// Puts names in place of numbers on the y axis, from the top; name k is at height -k. The axis covers all of them.
    pub fn row_names(mut self, names: Vec<String>) -> Self {
        let last = names.len().saturating_sub(1) as f64;
        // The margin keeps the first and the last row off the frame.
        [0.6, -last - 0.6].into_iter().for_each(|y| self.axes[1].include(y));
        Self { row_names: names, ..self }
    }

    /// Extends the range of the x axis to these SI values, without drawing; those that cannot be drawn have no effect.
    pub fn covering(mut self, values: impl IntoIterator<Item = f64>) -> Self {
        let factor = self.axes[0].factor;
        values.into_iter().for_each(|x| self.axes[0].include(x / factor));
        self
    }

    /// Adds a line of a CSS color through points in SI units. Points that cannot be drawn are left out, dense ones
    /// thinned. A series without a name is decoration, which neither legend nor CSV contains.
    pub fn line(
        mut self,
        series: &str,
        points: impl IntoIterator<Item = [f64; 2]>,
        color: &str,
    ) -> Self {
        let points = self.add_points(series, points);
        if !points.is_empty() {
            self.add_entry(series, color, true);
            self.marks.push(Mark::Line(stroke(points, color, 1.6)));
        }
        self
    }

    /// Adds dots of a CSS color and this radius, px, at points in SI units. Points that cannot be drawn are left out,
    /// dense ones thinned. A series without a name is neither in legend nor in CSV.
    pub fn dots(
        mut self,
        series: &str,
        points: impl IntoIterator<Item = [f64; 2]>,
        color: &str,
        radius: f64,
    ) -> Self {
        let points = self.add_points(series, points);
        if !points.is_empty() {
            self.add_entry(series, color, false);
            let dots = ScatterPlot::new().with_data(points.into_iter().map(<(f64, f64)>::from));
            self.marks.push(Mark::Dots(dots.with_color(color).with_size(radius)));
        }
        self
    }

    /// Adds a series as dots of this radius, px, at points in SI units, connected by a line; legend and CSV have it
    /// once.
    pub fn dotted_line(self, series: &str, points: Points, color: &str, radius: f64) -> Self {
        // The line has no name: legend and CSV have the dots only.
        self.line("", points.iter().copied(), color).dots(series, points, color, radius)
    }

    /// Adds a line through the points, in SI units, with the interval of each as a band along y. The series is in the
    /// CSV with its intervals, and not in the legend.
    pub fn line_with_band(mut self, series: &str, points: &[IntervalPoint], color: &str) -> Self {
        let edge = |k: usize| points.iter().map(move |p| [p.at[0], p.ends[k]]);
        let (low, high) = (self.add_points("", edge(0)), self.add_points("", edge(1)));
        let heights = |points: &Points| points.iter().map(|[_, y]| *y).collect::<Vec<f64>>();
        let (below, above) = (heights(&low), heights(&high));
        // The band is the area between both edges, which have no line of their own.
        self.marks.push(Mark::Line(stroke(low, color, 0.0).with_band(below, above)));
        let mut chart = self.line("", points.iter().map(|p| p.at), color);
        chart.add_intervals(series, points, 1);
        chart
    }

    /// Adds dots at the points, in SI units, with the interval of each as a bar along x. The series is in the CSV with
    /// its intervals, and not in the legend.
    pub fn dots_with_bars(mut self, series: &str, points: &[IntervalPoint], color: &str) -> Self {
        // Bars are decoration: the CSV has the ends beside their point.
        for IntervalPoint { at: [_, y], ends: [low, high] } in points {
            self = self.line("", [[*low, *y], [*high, *y]], color);
        }
        let mut chart = self.dots("", points.iter().map(|p| p.at), color, 4.0);
        chart.add_intervals(series, points, 0);
        chart
    }

    /// Adds a stem from the height zero to each point, in SI units, as decoration; the range includes zero.
    pub fn stems(mut self, points: impl IntoIterator<Item = [f64; 2]>, color: &str) -> Self {
        for [x, y] in self.add_points("", points) {
            self.marks.push(Mark::Line(stroke(vec![[x, 0.0], [x, y]], color, 2.0)));
        }
        self.axes[1].include(0.0);
        self
    }

    /// Adds a horizontal reference line at `y`, in the unit of the axis, which the range includes; nothing unless it is
    /// finite.
    pub fn level(mut self, y: f64) -> Self {
        if y.is_finite() {
            self.axes[1].include(y);
            self.lines.push(ReferenceLine::horizontal(y));
        }
        self
    }

    /// Adds a vertical reference line at an SI value, which the range includes; nothing unless it is finite.
    pub fn mark(mut self, x: f64) -> Self {
        let x = x / self.axes[0].factor;
        if x.is_finite() {
            self.axes[0].include(x);
            self.lines.push(ReferenceLine::vertical(x));
        }
        self
    }

    /// Shades the band between two ordinates in the unit of the axis, which the range includes; nothing unless both are
    /// finite.
    pub fn band(mut self, low: f64, high: f64) -> Self {
        if low.is_finite() && high.is_finite() {
            [low, high].into_iter().for_each(|y| self.axes[1].include(y));
            let band = ShadedRegion::horizontal(low, high);
            self.regions.push(band.with_color("var(--band)").with_opacity(1.0));
        }
        self
    }

    /// HTML with the names of the series beside their colors, if there are at least two, and a note if points were
    /// thinned out; else empty.
    pub fn legend(&self) -> String {
        let entry = |LegendEntry { name, color, is_line }: &LegendEntry| {
            let class = if *is_line { "stroke" } else { "dot" };
            format!("<i class=\"{class}\" style=\"background:{color}\"></i>{} ", escaped(name))
        };
        let thinning = match self.thinning {
            1 => String::new(),
            n => format!("(one of {n} points drawn) "),
        };
        // A single series is named by the axes.
        let entries = if self.legend.len() > 1 { &self.legend[..] } else { &[] };
        entries.iter().map(entry).collect::<String>() + &thinning
    }

    /// Removes the series added so far from the legend.
    pub fn without_legend(mut self) -> Self {
        self.legend.clear();
        self
    }

    /// An HTML link to the data of all named series and intervals as a CSV file with this name; empty without such
    /// data.
    pub fn csv(&self, name: &str) -> String {
        let labels = self.axes.each_ref().map(|axis| &axis.label[..]);
        match self.data.is_empty() {
            true => String::new(),
            false => csv_link(name, &csv_rows(&self.data, labels, &self.row_names)),
        }
    }

    /// Adds points, in SI units, with their intervals along the axis 0 (x) or 1 (y) to the CSV data of a series. Points
    /// that are not finite are left out.
    fn add_intervals(&mut self, series: &str, points: &[IntervalPoint], axis: usize) {
        let factor = self.axes[axis].factor;
        let finite = points.iter().filter(|p| p.at.iter().all(|x| x.is_finite()));
        let data = finite.map(|p| Datum {
            series: series.into(),
            point: self.displayed(p.at),
            interval: Some(p.ends.map(|end| end / factor)),
        });
        let data: Vec<Datum> = data.collect();
        self.data.extend(data);
    }

    /// Adds a series with its CSS color to the legend unless its name is empty or already in the legend.
    fn add_entry(&mut self, series: &str, color: &str, is_line: bool) {
        // Several calls may add points to one series.
        let is_new = self.legend.iter().all(|entry| entry.name != series);
        if !series.is_empty() && is_new {
            self.legend.push(LegendEntry { name: series.into(), color: color.into(), is_line });
        }
    }

    /// A point in SI units, converted to the units of the axes.
    fn displayed(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [x / self.axes[0].factor, y / self.axes[1].factor]
    }

    /// Converts points from SI units to those of the axes and returns those that can be drawn, thinned out to
    /// [`MAX_POINTS`]. Extends the ranges of the axes by all of them, and the CSV data by the returned ones if the
    /// series has a name.
    fn add_points(&mut self, series: &str, points: impl IntoIterator<Item = [f64; 2]>) -> Points {
        let points = points.into_iter().map(|point| self.displayed(point));
        let can_show = |[x, y]: &[f64; 2]| self.axes[0].can_show(*x) && self.axes[1].can_show(*y);
        let points: Points = points.filter(can_show).collect();
        // Ranges include all points, also those that are thinned out.
        for point in &points {
            self.axes.iter_mut().zip(point).for_each(|(axis, x)| axis.include(*x));
        }
        // Every k-th point keeps the shape of a dense line.
        let every = points.len().div_ceil(MAX_POINTS).max(1);
        self.thinning = self.thinning.max(every);
        let kept: Points = points.into_iter().step_by(every).collect();
        if !series.is_empty() {
            let datum =
                |point: &[f64; 2]| Datum { series: series.into(), point: *point, interval: None };
            self.data.extend(kept.iter().map(datum));
        }
        kept
    }

    /// The range of the axis 0 (x) or 1 (y) in its unit with a margin, never without extent. The margin is 5 % of the
    /// range at each end, 2 % on an x axis without equal scales; a y axis with names has none. Without extent it is 10
    /// % of the value, at least 1. A logarithmic axis has at most [`DECADES`] decades; its margin is a factor, the
    /// ratio of both ends to the power 0.05, at least 1.1.
    pub fn padded_range(&self, axis: usize) -> [f64; 2] {
        let ChartAxis { range: [low, high], is_log, .. } = self.axes[axis];
        if is_log {
            // Values many decades below the top would flatten the rest.
            let low = low.max(high * 10_f64.powf(-DECADES));
            let margin = (high / low).powf(0.05).max(1.1);
            return [low / margin, high * margin];
        }
        if axis == 1 && !self.row_names.is_empty() {
            return [low, high];
        }
        // A single value, or values that differ by rounding errors, get an axis of their own size.
        let margin = 0.05 * (high - low);
        let has_extent = margin > 1e-9 * low.abs().max(high.abs());
        let margin = match has_extent {
            true if axis == 0 && !self.has_equal_scales => 0.4 * margin,
            true => margin,
            false => (0.1 * high.abs()).max(1.0),
        };
        [low - margin, high + margin]
    }
}

/// A line of a CSS color and a width, px, through points in the units of the axes.
fn stroke(points: Points, color: &str, width: f64) -> LinePlot {
    let line = LinePlot::new().with_data(points.into_iter().map(<(f64, f64)>::from));
    line.with_color(color).with_stroke_width(width)
}

/// The label of a quantity: its name, and its unit in parentheses if it has one.
pub(super) fn labeled(name: &str, unit: &str) -> String {
    if unit.is_empty() { name.into() } else { format!("{name} ({unit})") }
}
