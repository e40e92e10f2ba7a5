//! Data sets: measured values with their header, and the interface of the kinds of data.
//!
//! [`Header`] has the noise (standard deviations), the loss, the use in the fit (fitted, validation, planned) and the
//! origin of the values. A kind of data (such as a motion, a shape or frequencies) implements [`DataKind`]: its values,
//! the outputs of a simulation that they require, and the differences of these outputs from the values. [`Dataset`] is
//! a header with data of a kind. Everything else in a fit uses this interface.
//!
//! Values are in the order of the residuals: point by point, and within a point x, y, z, observed coordinates only; or
//! scalars in their order. The standard deviation of a value is the `sigma` of the header times its factor, given per
//! point, per value, or not at all (1). `sigma` and `sigmas` of a data set set them; `with_properties` sets those of a
//! table of a fit file, whose sigma replaces that of the data file and leaves the factors. `scale` is the size of
//! relevant changes, for tolerances. `free_share` is the number of values less that of fitted nuisance parameters, over
//! the number of values. A [`Coordinate`] lists the values of one axis, or scalars, with their abscissas.

use crate::error::{Error, ensure};
use crate::fit::image::{ImageSeries, ImagedPosition};
use crate::fit::measurement::loss::Loss;
use crate::fit::measurement::quantity::GaugeScalar;
use crate::fit::measurement::reading::{Reading, spread_or_size};
use crate::fit::measurement::sensor_reference::SensorReference;
use crate::fit::measurement::simulated::{Requirements, SimulatedOutput};
use crate::numerics::total_order;
use crate::problem::Problem;
use crate::scene::Parameter;
use marker_files::{Dropped, PixelAxes, Recording};
use serde::{Deserialize, Serialize};
use std::fmt::Debug;
use std::ops::{Deref, DerefMut};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A unit in which data are given, and in which reports display them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct DataUnit<'a> {
    /// Symbol of the unit.
    pub name: &'a str,
    /// Size of the unit in the unit of the values.
    pub size: f64,
}

impl DataUnit<'_> {
    /// Hertz as the unit of given and displayed frequencies; the values are in rad/s.
    pub const HERTZ: Self = Self { name: "Hz", size: std::f64::consts::TAU };
}

/// Abscissa of an observation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Abscissa {
    /// Time, s.
    Time,
    /// Arc length from the wall, m.
    ArcLength,
    /// The number of a mode, from 1 on.
    Mode,
    /// The number of a reading, from 1 on.
    Reading,
    /// Force as the load, N.
    Load,
    /// Moment as the load, N m.
    Moment,
}

/// The values of one coordinate of a measurement, given by index and abscissa, in the order of the residuals.
pub(crate) struct Coordinate {
    /// x, y, z, f of frequencies, g of gauges, P of critical loads, or the component of a sensor.
    pub axis: &'static str,
    pub values: Vec<CoordinateValue>,
}

/// The place of one value of a coordinate; the value itself is at `index` among those of the measurement.
#[derive(Clone, Copy)]
pub(crate) struct CoordinateValue {
    /// Index among all values of the measurement.
    pub index: usize,
    /// Time, s, arc length, m, load, N or N m, or number of a mode or reading.
    pub abscissa: f64,
}

impl Coordinate {
    /// Index and abscissa of the values of this coordinate with an index below `count`, in ascending order of the
    /// abscissa.
    pub fn ascending(&self, count: usize) -> Vec<(usize, f64)> {
        let values = self.first_values(count);
        let mut pairs: Vec<(usize, f64)> = values.map(|v| (v.index, v.abscissa)).collect();
        pairs.sort_by_cached_key(|(_, abscissa)| total_order(*abscissa));
        pairs
    }

    /// The values of this coordinate that are among the first `count` values of the measurement.
    pub fn first_values(&self, count: usize) -> impl Iterator<Item = CoordinateValue> {
        self.values.iter().copied().filter(move |value| value.index < count)
    }
}

/// The properties that all kinds of measurements have: noise, loss, use and origin.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct Header {
    /// Name for messages and reports; empty: the file, or the kind of the data.
    pub name: String,
    /// Unit of the values; empty for pure numbers.
    pub unit: String,
    /// The unit that reports display, if it differs from `unit`.
    pub(crate) data_unit: Option<DataUnit<'static>>,
    /// Standard deviation of a value, in its unit; estimated from the residuals when `None`.
    pub sigma: Option<f64>,
    /// Standard deviations of all points, or of all values, over `sigma`; empty where all
    /// are equal.
    pub sigma_factors: Vec<f64>,
    /// Loss function of the residuals.
    pub loss: Loss,
    /// Whether the values are validation data: predicted, not fitted.
    pub held_out: bool,
    /// Whether the measurement is only planned: its times and coordinates count, its values do not.
    pub planned: bool,
    /// File of the values.
    pub source: Option<PathBuf>,
    /// Interpretation of the file.
    pub recording: Option<Recording>,
    /// Numbers of rows of the file that were left out.
    pub dropped: Dropped,
    /// Name of the column of angles without a unit, which were read as rad; none where the file states the unit.
    pub(crate) assumed_unit: Option<String>,
    /// Number of the frame of each position of a motion as it was read; empty of other data.
    pub(crate) frames: Vec<f64>,
    /// Pixels of the picture in which the positions of the file were measured; `None` for lengths.
    pub(crate) pixels: Option<PixelAxes>,
    /// Pictures of the positions; `None` without the key `image`.
    pub(crate) images: Option<Arc<ImageSeries>>,
    /// Positions of a motion with pictures, as they were read.
    pub(crate) imaged: Vec<ImagedPosition>,
}

impl Header {
    /// Rejects a nuisance that minimizes the squares of the residuals of `count` readings, if these are fewer than two,
    /// or have a robust loss or unequal standard deviations. `key` is that of the table, `other` what is allowed
    /// instead, for the error.
    pub(crate) fn check_free_nuisance(
        &self,
        count: usize,
        key: &str,
        other: &str,
    ) -> Result<(), Error> {
        let key = format!("{key}.tare");
        let found = format!("\"free\" of {count} reading");
        ensure(count > 1, &key, found, format!("{other}, or at least two readings"))?;
        let is_linear = self.loss == Loss::Squares && self.sigma_factors.is_empty();
        let found = "\"free\" with a robust loss or several sigmas";
        let allowed = format!("{other}, or loss = \"squares\" with one sigma");
        ensure(is_linear, key, found, allowed)
    }

    /// A header of values in meters, with unknown noise and squared loss.
    pub(crate) fn in_meters() -> Self {
        Self { unit: "m".into(), ..Self::default() }
    }

    /// A header of values with a known standard deviation, in their unit.
    pub(crate) fn with_sigma(unit: impl Into<String>, sigma: f64) -> Self {
        Self { unit: unit.into(), sigma: Some(sigma), ..Self::default() }
    }

    /// The label of one `component` of the data: the path of the file, or the name of the header without a file,
    /// followed by a space and the component.
    pub(crate) fn component_label(&self, component: &str) -> String {
        let file = self.source.as_ref().map(|path| path.display().to_string());
        let name = file.unwrap_or_else(|| self.name.clone());
        format!("{name} {component}").trim_start().into()
    }

    /// Sets the standard deviations of all points or of all values, in their unit. If all are equal, `sigma` becomes
    /// that value, without factors. Else it becomes the one with their mean information, `(mean sigma_i^-2)^(-1/2)`,
    /// and the factors are `sigma_i/sigma`. No change for an empty list. The length is not checked here; it must be the
    /// number of points or of values.
    fn set_sigmas(&mut self, sigmas: &[f64]) {
        let Some(first) = sigmas.first() else { return };
        self.sigma = Some(*first);
        self.sigma_factors.clear();
        if sigmas.iter().any(|sigma| sigma != first) {
            // Mean information 1/sigma^2: the factors over that sigma keep the sum of the
            // weights.
            let information = sigmas.iter().map(|s| (s * s).recip()).sum::<f64>();
            let sigma = (information / sigmas.len() as f64).sqrt().recip();
            self.sigma = Some(sigma);
            self.sigma_factors = sigmas.iter().map(|s| s / sigma).collect();
        }
    }
}

/// Data of one kind, or of [any](crate::fit::MeasuredData), with their header. The fields of the data are accessible on
/// the data set itself.
#[derive(Clone, Debug)]
pub struct Dataset<D> {
    /// Properties that all kinds of data have.
    pub header: Header,
    /// The values.
    pub data: D,
}

impl<D> Deref for Dataset<D> {
    type Target = D;

    /// The data of the data set, without the header, so that their fields and methods are accessible on the data set.
    fn deref(&self) -> &D {
        &self.data
    }
}

impl<D> DerefMut for Dataset<D> {
    /// The data of the data set, without the header, for changes of their fields.
    fn deref_mut(&mut self) -> &mut D {
        &mut self.data
    }
}

impl<D: DataKind> Dataset<D> {
    /// The data set with a known standard deviation `sigma`, in the unit of the values, of every value. If factors of
    /// points or values are set ([`sigmas`](Self::sigmas)), they stay, and the standard deviation of a value is `sigma`
    /// times its factor.
    pub fn sigma(mut self, sigma: f64) -> Self {
        self.header.sigma = Some(sigma);
        self
    }

    /// The data set with a known standard deviation of each point, or of each value, point by point, in its unit. An
    /// empty list changes nothing.
    pub fn sigmas(mut self, sigmas: &[f64]) -> Self {
        self.header.set_sigmas(sigmas);
        self
    }

    /// The data set with this loss function of its residuals instead of the default, squares.
    pub fn loss(mut self, loss: Loss) -> Self {
        self.header.loss = loss;
        self
    }

    /// Marks the data set as validation data: its values are predicted, not fitted.
    pub fn held_out(mut self) -> Self {
        self.header.held_out = true;
        self
    }

    /// Number of measured values; a position has up to three.
    pub fn values(&self) -> usize {
        self.data.values()
    }
}

impl<T> Dataset<T> {
    /// The data set with the path of its file, the interpretation of the file, and the numbers of rows that were left
    /// out.
    pub(crate) fn with_source(
        mut self,
        path: &Path,
        recording: &Recording,
        dropped: Dropped,
    ) -> Self {
        self.header.source = Some(path.into());
        self.header.recording = Some(recording.clone());
        self.header.dropped = dropped;
        self
    }

    /// The data set with the properties in the table of a fit file. A sigma in the table, in the unit of the values,
    /// replaces that of the data file, whose factors of points or values stay and multiply it. Loss and `held_out` are
    /// always replaced.
    pub(crate) fn with_properties(
        mut self,
        sigma: Option<f64>,
        loss: Loss,
        held_out: bool,
    ) -> Self {
        // The user's table overrides the file, which may have columns of standard deviations.
        self.header.sigma = sigma.or(self.header.sigma);
        (self.header.loss, self.header.held_out) = (loss, held_out);
        self
    }
}

/// Context of the validation of a measurement: the problem that it is compared with, and its names for errors.
pub struct ValidationContext<'a> {
    /// The problem with which it is compared.
    pub problem: &'a Problem,
    /// Key of its table in the fit file.
    pub key: &'a str,
    /// Its file or name.
    pub label: &'a str,
    /// Whether its times are on a clock with an offset, given or unknown.
    pub other_clock: bool,
    /// Parameters that the fit identifies in its experiment.
    pub parameters: &'a [Parameter],
}

/// A kind of data: positions of points, readings, or other scalars. The defaults are those of readings.
pub trait DataKind: Debug + Send + Sync {
    /// Name of the table of a fit file for this kind of data, as `observation`; part of keys in messages.
    fn table(&self) -> &'static str;

    /// The name of the data in messages and reports: the file, or a name without a file.
    fn label(&self, header: &Header) -> String;

    /// The readings of a gauge or a sensor with their times; empty for other data.
    fn readings(&self) -> &[Reading] {
        &[]
    }

    /// The sensor of the scene to which readings refer; `None` of other data.
    fn sensor_reference(&self) -> Option<&SensorReference> {
        None
    }

    /// The list of the readings, for changes; `None` of other data.
    fn readings_mut(&mut self) -> Option<&mut Vec<Reading>> {
        None
    }

    /// The quantity on the abscissa of plots: time, arc length, mode number, load or number of the reading. The default
    /// is that of readings: time if any has one, or else their number.
    fn abscissa(&self) -> Abscissa {
        match self.readings().iter().any(|r| r.time.is_some()) {
            true => Abscissa::Time,
            false => Abscissa::Reading,
        }
    }

    /// Abscissa of every point, in the order of the points: time, s, arc length, m, mode number, load, N or N m, or
    /// number of the reading (from 1). The default is that of readings: the time of each, or its number if it is at
    /// rest.
    fn abscissas(&self, _problem: &Problem) -> Vec<f64> {
        let number = |(k, r): (usize, &Reading)| r.time.unwrap_or((k + 1) as f64);
        self.readings().iter().enumerate().map(number).collect()
    }

    /// Name of the axis of scalars in reports; `None` for positions, whose axes are x, y and z.
    fn axis(&self) -> Option<&'static str> {
        None
    }

    /// The observed positions in the order of the points, m, with `None` for coordinates that were not observed; empty
    /// for scalars.
    fn positions(&self) -> Vec<[Option<f64>; 3]> {
        Vec::new()
    }

    /// Mutable references to the observed positions, in the order of the points; empty for scalars.
    fn positions_mut(&mut self) -> Vec<&mut [Option<f64>; 3]> {
        Vec::new()
    }

    /// The scalars (frequencies or readings) in their order, in the unit of the values; empty for positions.
    fn scalars(&self) -> Vec<f64> {
        self.readings().iter().map(|r| r.value).collect()
    }

    /// Mutable references to the scalars, in their order; empty for positions.
    fn scalars_mut(&mut self) -> Vec<&mut f64> {
        self.readings_mut().into_iter().flatten().map(|r| &mut r.value).collect()
    }

    /// The time of every value on the clock of the motion or of its recording, s; `None` for values at rest; the
    /// default is the time of a reading, or `None` for every other value.
    fn times(&self) -> Vec<Option<f64>> {
        match self.readings() {
            [] => vec![None; self.values()],
            readings => readings.iter().map(|r| r.time).collect(),
        }
    }

    /// Number of nuisance parameters (arc lengths, offsets) that are fitted to the values, each of which takes a degree
    /// of freedom; 0 by default.
    fn fitted_nuisances(&self) -> usize {
        0
    }

    /// Typical size of the measured effect, in the unit of the values: the spread of a motion, the deflection of a
    /// shape, the mean frequency. The default is the spread of readings about their mean, or the magnitude of a single
    /// one or of equal ones.
    fn size(&self, _problem: &Problem) -> f64 {
        spread_or_size(self.readings())
    }

    /// Rejects values that cannot be compared with the problem.
    ///
    /// # Errors
    ///
    /// [`Error::Invalid`] with the key of the table or the label, and the allowed values.
    fn check(&self, header: &Header, context: &ValidationContext) -> Result<(), Error>;

    /// Removes values after the `horizon`, s, up to which residuals are computed, and computes approximate arc lengths
    /// of points without one, in place. The default removes readings after the horizon; those at rest stay. Residuals
    /// call it on a copy of the data.
    fn prepare(&mut self, _problem: &Problem, horizon: f64) {
        let readings = self.readings_mut().into_iter();
        readings.for_each(|readings| readings.retain(|r| r.time.is_none_or(|t| t <= horizon)));
    }

    /// Adds the simulated outputs with which the values are compared (points, times, modes) to `outputs`.
    fn require(&self, outputs: &mut Requirements);

    /// Calls `each` with simulated less measured value, over the scalar type of the `simulated` outputs, in the order
    /// of the values and in their unit.
    ///
    /// # Errors
    ///
    /// Points that are not on the rod, and times after the end of the simulation.
    fn differences<D: GaugeScalar>(
        &self,
        simulated: &SimulatedOutput<D>,
        each: &mut dyn FnMut(D),
    ) -> Result<(), Error>
    where
        Self: Sized;

    /// All values in the order of the residuals: observed coordinates point by point (x, y, z in each), or scalars.
    fn values_in_order(&self) -> Vec<f64> {
        self.positions().into_iter().flatten().flatten().chain(self.scalars()).collect()
    }

    /// Mutable references to all values, observed coordinates or scalars, in the order of the residuals.
    fn values_mut(&mut self) -> Vec<&mut f64> {
        match self.axis() {
            Some(_) => self.scalars_mut(),
            None => self.positions_mut().into_iter().flatten().flatten().collect(),
        }
    }

    /// Number of values, which is that of the residuals: observed coordinates, or scalars.
    fn values(&self) -> usize {
        self.values_in_order().len()
    }

    /// Number of points of the abscissa: samples, points along the rod, frequencies or readings.
    fn points(&self) -> usize {
        self.positions().len() + self.scalars().len()
    }
}

impl dyn DataKind + '_ {
    /// Standard deviations of all values, in their unit, in the order of the residuals: a given `sigma` times the
    /// factors of the header. These are per value, per point (then for all coordinates of the point), or none (1 for
    /// all).
    pub(crate) fn sigmas(&self, header: &Header, sigma: f64) -> Vec<f64> {
        let (factors, values) = (&header.sigma_factors, self.values());
        // The factors are given per value, per point, or not at all.
        if factors.len() == values {
            return factors.iter().map(|factor| sigma * factor).collect();
        }
        if factors.is_empty() {
            return vec![sigma; values];
        }
        // One factor per point: all its coordinates have the same standard deviation.
        let repeated = |(position, factor): ([Option<f64>; 3], &f64)| {
            std::iter::repeat_n(sigma * factor, position.iter().flatten().count())
        };
        self.positions().into_iter().zip(factors).flat_map(repeated).collect()
    }

    /// Indices (in the order of the residuals) and abscissas of the values, without the values, grouped by coordinate:
    /// x, y and z of positions, of which those without values are left out, or the one axis of scalars.
    pub(crate) fn coordinates(&self, problem: &Problem) -> Vec<Coordinate> {
        let abscissas = self.abscissas(problem).into_iter();
        if let Some(axis) = self.axis() {
            let values = abscissas.enumerate();
            let values = values.map(|(index, abscissa)| CoordinateValue { index, abscissa });
            return vec![Coordinate { axis, values: values.collect() }];
        }
        // Residuals are stored point by point; tests and plots need them coordinate by
        // coordinate.
        let mut axes = ["x", "y", "z"].map(|axis| Coordinate { axis, values: Vec::new() });
        let mut index = 0;
        for (abscissa, position) in abscissas.zip(self.positions()) {
            for (axis, observed) in axes.iter_mut().zip(position) {
                if observed.is_some() {
                    axis.values.push(CoordinateValue { index, abscissa });
                    index += 1;
                }
            }
        }
        axes.into_iter().filter(|axis| !axis.values.is_empty()).collect()
    }

    /// Size relative to which rounding errors and changes of the values are judged, in the unit of the values. For
    /// positions it is the larger of the rod's length and the [`size`](DataKind::size) of their motion or deflection;
    /// for scalars it is the `size`.
    pub(crate) fn scale(&self, problem: &Problem) -> f64 {
        // Positions are rounded relative to the size of the rod, however little it moves.
        match self.axis() {
            Some(_) => self.size(problem),
            None => problem.length().max(self.size(problem)),
        }
    }

    /// Degrees of freedom of the residuals over the number `n` of values: `(n - m)/n`, at least `1/n`, for `m` fitted
    /// nuisance parameters; 1 without these.
    pub(crate) fn free_share(&self) -> f64 {
        // Each fitted nuisance removes one direction of the residuals.
        let values = self.values().max(1) as f64;
        (1.0 - self.fitted_nuisances() as f64 / values).max(1.0 / values)
    }

    /// The outputs of a simulation (points, times, modes) with which the values are compared.
    pub(crate) fn requirements(&self) -> Requirements {
        let mut outputs = Requirements::default();
        self.require(&mut outputs);
        outputs
    }
}
