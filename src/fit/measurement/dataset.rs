//! Data with their header: the noise, the loss, the use in the fit and the origin that all kinds of data have.
//!
//! A kind of data implements [`DataKind`]: its values, the outputs of a run that they need, and the differences from
//! these outputs. Everything else in a fit uses this interface.

use crate::error::Error;
use crate::fit::measurement::loss::{Loss, typical};
use crate::fit::measurement::quantity::Shown;
use crate::fit::measurement::simulated::{Requirements, Simulated};
use crate::numerics::total_order;
use crate::problem::Problem;
use marker_files::{Dropped, Recording};
use serde::{Deserialize, Serialize};
use std::fmt::Debug;
use std::ops::{Deref, DerefMut};
use std::path::{Path, PathBuf};

/// A unit that data are given in, and reports display them in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct DataUnit<'a> {
    /// Its symbol.
    pub name: &'a str,
    /// Its size in the unit of the values.
    pub size: f64,
}

impl DataUnit<'_> {
    /// Of frequencies, whose values are in rad/s.
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
}

/// Values of one coordinate, in the order of the residuals, with their abscissas.
pub(crate) struct Coordinate {
    /// x, y, z, f of frequencies, or g of gauges.
    pub axis: &'static str,
    /// Index among the measurement's values, and abscissa.
    pub places: Vec<(usize, f64)>,
}

impl Coordinate {
    /// Index and abscissa of the values below index `count`, ascending by the abscissa.
    pub fn ascending(&self, count: usize) -> Vec<(usize, f64)> {
        let mut places = self.places.clone();
        places.retain(|(k, _)| *k < count);
        places.sort_by_cached_key(|(_, abscissa)| total_order(*abscissa));
        places
    }
}

/// The properties that all kinds of measurements have.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct Header {
    /// Name for messages and reports; empty: the file, or the kind of the data.
    pub name: String,
    /// Unit of the values; empty for pure numbers.
    pub unit: String,
    /// The unit that reports display, where it is another.
    pub(crate) data_unit: Option<DataUnit<'static>>,
    /// Standard deviation of a value, in its unit; estimated from the residuals when `None`.
    pub sigma: Option<f64>,
    /// Standard deviations of all points, or of all values, over `sigma`, which is then typical of them; empty where all
    /// are equal.
    pub sigma_factors: Vec<f64>,
    /// Loss function of the residuals.
    pub loss: Loss,
    /// Whether the values are validation data: predicted, not fitted.
    pub held_out: bool,
    /// Whether the measurement is only planned: its values mean nothing, but which ones there will be.
    pub planned: bool,
    /// The file it was read from, for messages.
    pub source: Option<PathBuf>,
    /// How that file was read.
    pub recording: Option<Recording>,
    /// Rows of that file that were left out.
    pub dropped: Dropped,
}

impl Header {
    /// Of values in meters.
    pub(crate) fn of_lengths() -> Self {
        Self { unit: "m".into(), ..Self::default() }
    }

    /// Of values with a known standard deviation, in their unit.
    pub(crate) fn known(unit: impl Into<String>, sigma: f64) -> Self {
        Self { unit: unit.into(), sigma: Some(sigma), ..Self::default() }
    }
}

/// Data of one kind, or of [any](crate::fit::MeasuredData), with their header. The fields of the data are accessible on the
/// data set itself.
#[derive(Clone, Debug)]
pub struct Dataset<D> {
    /// What all kinds of data have.
    pub header: Header,
    /// The values.
    pub data: D,
}

impl<D> Deref for Dataset<D> {
    type Target = D;

    fn deref(&self) -> &D {
        &self.data
    }
}

impl<D> DerefMut for Dataset<D> {
    fn deref_mut(&mut self) -> &mut D {
        &mut self.data
    }
}

impl<D: DataKind> Dataset<D> {
    /// With a known standard deviation of every value, in its unit.
    pub fn sigma(mut self, sigma: f64) -> Self {
        self.header.sigma = Some(sigma);
        self
    }

    /// With a known standard deviation of each point, or of each value, point by point, in its unit.
    pub fn sigmas(mut self, sigmas: &[f64]) -> Self {
        if let Some((sigma, factors)) = typical(sigmas) {
            (self.header.sigma, self.header.sigma_factors) = (Some(sigma), factors);
        }
        self
    }

    /// With another loss than squares.
    pub fn loss(mut self, loss: Loss) -> Self {
        self.header.loss = loss;
        self
    }

    /// As validation data: predicted, not fitted.
    pub fn held_out(mut self) -> Self {
        self.header.held_out = true;
        self
    }

    /// Number of values.
    pub fn values(&self) -> usize {
        self.data.values()
    }

    /// With its file, for messages, the way it was read, and the numbers of its rows that were left out.
    pub(crate) fn read_from(
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

    /// With the properties that a fit file states; a stated sigma replaces that of the file.
    pub(crate) fn stated(mut self, sigma: Option<f64>, loss: Loss, held_out: bool) -> Self {
        self.header.sigma = sigma.or(self.header.sigma);
        (self.header.loss, self.header.held_out) = (loss, held_out);
        self
    }
}

/// A measurement in the messages of its validation.
pub struct Subject<'a> {
    /// Its problem.
    pub problem: &'a Problem,
    /// Its place in the fit file.
    pub key: &'a str,
    /// Its file or name.
    pub label: &'a str,
    /// Whether its times are on a clock with an unknown offset.
    pub other_clock: bool,
}

/// A kind of data: either positions of points, or scalars.
pub trait DataKind: Debug + Send + Sync {
    /// The table of a fit file that has such data.
    fn table(&self) -> &'static str;

    /// The file or the kind of the data, for messages.
    fn label(&self, header: &Header) -> String;

    /// Quantity on the abscissa of plots.
    fn abscissa(&self) -> Abscissa;

    /// Abscissa of every point.
    fn abscissas(&self, problem: &Problem) -> Vec<f64>;

    /// Name of the scalars; none of positions.
    fn axis(&self) -> Option<&'static str> {
        None
    }

    /// The observed positions, m; empty for scalars.
    fn positions(&self) -> Vec<[Option<f64>; 3]> {
        Vec::new()
    }

    /// The same, to be changed.
    fn positions_mut(&mut self) -> Vec<&mut [Option<f64>; 3]> {
        Vec::new()
    }

    /// The scalars; empty for positions.
    fn scalars(&self) -> Vec<f64> {
        Vec::new()
    }

    /// The same, to be changed.
    fn scalars_mut(&mut self) -> Vec<&mut f64> {
        Vec::new()
    }

    /// Times on the clock of the motion or of its recording, s, of all values; none of values at rest.
    fn times(&self) -> Vec<Option<f64>> {
        vec![None; self.values()]
    }

    /// Number of values that unknown arc lengths use up.
    fn fitted_arc_lengths(&self) -> usize {
        0
    }

    /// Typical size of the measured effect: the spread of a motion, the deflection of a shape, a typical frequency.
    fn size(&self, problem: &Problem) -> f64;

    /// Rejects values that cannot be compared with the problem.
    ///
    /// # Errors
    ///
    /// The key or the label, with what is allowed.
    fn check(&self, header: &Header, subject: &Subject) -> Result<(), Error>;

    /// Removes values after the `horizon`, s, and locates points of unknown arc length approximately.
    fn prepare(&mut self, _problem: &Problem, _horizon: f64) {}

    /// Adds the outputs of a run that the values are compared with.
    fn require(&self, outputs: &mut Requirements);

    /// Calls `each` with the difference of every value from its simulated one, in the order of the values.
    ///
    /// # Errors
    ///
    /// Points that are not on the rod, and times after the end of the run.
    fn differences<D: Shown>(
        &self,
        simulated: &Simulated<D>,
        each: &mut dyn FnMut(D),
    ) -> Result<(), Error>
    where
        Self: Sized;

    /// All values, in the order of the residuals.
    fn values_in_order(&self) -> Vec<f64> {
        self.positions().into_iter().flatten().flatten().chain(self.scalars()).collect()
    }

    /// The same, to be changed.
    fn values_mut(&mut self) -> Vec<&mut f64> {
        match self.axis() {
            Some(_) => self.scalars_mut(),
            None => self.positions_mut().into_iter().flatten().flatten().collect(),
        }
    }

    /// Number of values.
    fn values(&self) -> usize {
        self.values_in_order().len()
    }

    /// Number of samples, points along the rod, frequencies or readings.
    fn points(&self) -> usize {
        self.positions().len() + self.scalars().len()
    }
}

impl dyn DataKind + '_ {
    /// Standard deviations of all values, where that of the header is `sigma`.
    pub(crate) fn sigmas(&self, header: &Header, sigma: f64) -> Vec<f64> {
        let (factors, values) = (&header.sigma_factors, self.values());
        if factors.len() == values {
            return factors.iter().map(|factor| sigma * factor).collect();
        }
        if factors.is_empty() {
            return vec![sigma; values];
        }
        let of = |(position, factor): ([Option<f64>; 3], &f64)| {
            std::iter::repeat_n(sigma * factor, position.iter().flatten().count())
        };
        self.positions().into_iter().zip(factors).flat_map(of).collect()
    }

    /// The values coordinate by coordinate; coordinates without values are left out.
    pub(crate) fn coordinates(&self, problem: &Problem) -> Vec<Coordinate> {
        let abscissas = self.abscissas(problem);
        if let Some(axis) = self.axis() {
            return vec![Coordinate { axis, places: abscissas.into_iter().enumerate().collect() }];
        }
        let mut axes = ["x", "y", "z"].map(|axis| Coordinate { axis, places: Vec::new() });
        let mut index = 0;
        for (at, position) in abscissas.into_iter().zip(self.positions()) {
            for (axis, seen) in axes.iter_mut().zip(position) {
                if seen.is_some() {
                    axis.places.push((index, at));
                    index += 1;
                }
            }
        }
        axes.into_iter().filter(|axis| !axis.places.is_empty()).collect()
    }

    /// Scale of rounding errors and of changes that matter: the length of the rod or the size of its motion, or a typical
    /// value.
    pub(crate) fn scale(&self, problem: &Problem) -> f64 {
        match self.axis() {
            Some(_) => self.size(problem),
            None => problem.length().max(self.size(problem)),
        }
    }

    /// The part of the values that unknown arc lengths leave as degrees of freedom.
    pub(crate) fn free_share(&self) -> f64 {
        let values = self.values().max(1) as f64;
        (1.0 - self.fitted_arc_lengths() as f64 / values).max(1.0 / values)
    }

    /// The outputs of a run that the values are compared with.
    pub(crate) fn requirements(&self) -> Requirements {
        let mut outputs = Requirements::default();
        self.require(&mut outputs);
        outputs
    }
}
