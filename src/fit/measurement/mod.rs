//! Measurements of a rod: its motion, its shape at rest, its natural frequencies, forces and moments of its supports,
//! accelerations, angles, strains and orientations of its points, load-deflection curves, critical loads, and
//! user-defined quantities.
//!
//! [`Measurement`] is a data set of any of these kinds ([`MeasuredData`]) with its header (noise, loss, source). Each
//! kind has its file here: `motion`, `shape`, `frequencies`, `load_deflection`, `buckling`, `gauge` (with `quantity`),
//! `sensor` (with `sensor_channel`, `sensor_reference`, `sensor_table`, `low_pass`, `point_channel`,
//! `point_acceleration`, `point_angle` and `point_strain`) and `point_pose` (with `pose_sensor` and
//! `rotation_readings`); readings of gauges and sensors are in `reading`. `dataset` has the header and the interface of
//! the kinds, `loss` the robust losses, `simulated` the outputs of a simulation with which they are compared. Others
//! concern their preparation: `experiment` groups measurements with a scene, `inspection` and `inspection_summary`
//! examine marker files, `constant_axes`, `repeated_frames` and `placeholder_frames` detect faulty data. Every kind
//! provides the differences simulated less measured value (`DataKind::differences`), of which `fit::misfit` makes
//! residuals.
//!
//! Functions of [`Measurement`] for any kind: `sigma` (`None` if it is to be estimated) and `sigmas` are standard
//! deviations, `unit` is that of the values, `data_unit` that in which they were given and reports display them.
//! `held_out` (validation data) and `planned` (no values yet) state the use. `motion`, `observation`, `shape`,
//! `frequencies`, `load_curve` and `buckling` return data of one kind, `None` for others.

pub(crate) mod buckling;
pub(crate) mod camera_needs;
pub(crate) mod constant_axes;
pub(crate) mod dataset;
pub(crate) mod experiment;
pub(crate) mod frequencies;
pub(crate) mod gauge;
pub(crate) mod inspection;
mod inspection_summary;
pub(crate) mod load_deflection;
pub(crate) mod loss;
mod low_pass;
pub(crate) mod motion;
pub(crate) mod placeholder_frames;
mod point_acceleration;
mod point_angle;
pub(crate) mod point_channel;
pub(crate) mod point_pose;
mod point_strain;
pub(crate) mod pose_sensor;
pub(crate) mod quantity;
pub(crate) mod reading;
pub(crate) mod repeated_frames;
pub(crate) mod rotation_readings;
pub(crate) mod sensor;
pub(crate) mod sensor_channel;
pub(crate) mod sensor_reference;
pub(crate) mod sensor_table;
pub(crate) mod shape;
mod shape_columns;
pub(crate) mod simulated;

use crate::error::Error;
use crate::fit::measurement::buckling::BucklingLoad;
use crate::fit::measurement::dataset::{DataKind, DataUnit, Dataset};
use crate::fit::measurement::frequencies::ModeFrequencies;
use crate::fit::measurement::gauge::GaugeReadings;
use crate::fit::measurement::load_deflection::LoadCurve;
use crate::fit::measurement::loss::Loss;
use crate::fit::measurement::motion::{Observation, PointMotion};
use crate::fit::measurement::point_pose::PoseReadings;
use crate::fit::measurement::quantity::GaugeScalar;
use crate::fit::measurement::sensor::SensorReadings;
use crate::fit::measurement::shape::EquilibriumShape;
use crate::fit::measurement::simulated::SimulatedOutput;
use marker_files::Dropped;
use std::ops::{Deref, DerefMut};

/// Defines [`MeasuredData`], whose variants have the names of the types of their data, and dispatches to these.
macro_rules! kinds {
    ($($(#[$documentation:meta])* $Kind:ident,)*) => {
        /// Values of one of the kinds that can be measured.
        #[derive(Clone, Debug)]
        #[non_exhaustive]
        pub enum MeasuredData {
            $($(#[$documentation])* $Kind($Kind),)*
        }

        $(impl From<$Kind> for MeasuredData {
            /// The data of this kind as the variant of [`MeasuredData`] with its name.
            fn from(data: $Kind) -> Self {
                Self::$Kind(data)
            }
        })*

        impl Deref for MeasuredData {
            type Target = dyn DataKind;

            /// The kind of these data as a trait object, for the methods of `DataKind`.
            fn deref(&self) -> &(dyn DataKind + 'static) {
                match self {
                    $(Self::$Kind(data) => data,)*
                }
            }
        }

        impl DerefMut for MeasuredData {
            /// The kind of these data as a mutable trait object, for changes of its values.
            fn deref_mut(&mut self) -> &mut (dyn DataKind + 'static) {
                match self {
                    $(Self::$Kind(data) => data,)*
                }
            }
        }

        impl MeasuredData {
            /// Calls `each` with simulated less measured value, in the order of the values and in their unit. An error
            /// for points that are not on the rod, and times after the end of the simulation.
            pub(crate) fn differences<D: GaugeScalar>(
                &self,
                simulated: &SimulatedOutput<D>,
                each: &mut dyn FnMut(D),
            ) -> Result<(), Error> {
                match self {
                    $(Self::$Kind(data) => data.differences(simulated, each),)*
                }
            }
        }
    };
}

kinds! {
    /// Positions of a point over time, m.
    PointMotion,
    /// Positions of points of the rod at rest, m.
    EquilibriumShape,
    /// Natural frequencies, rad/s.
    ModeFrequencies,
    /// Readings of a user-defined quantity, in its own unit.
    GaugeReadings,
    /// Readings of a component of a sensor: reaction of a support, N or N m; acceleration, m/s^2, angle, rad,
    /// curvature, 1/m, or strain of a point.
    SensorReadings,
    /// A component of measured orientations of a point, rad.
    PoseReadings,
    /// Displacements of a point at rest under several values of a load, m.
    LoadCurve,
    /// Critical value of a load, N or N m.
    BucklingLoad,
}

/// Measured values of any kind with their header, as a fit handles them.
pub type Measurement = Dataset<MeasuredData>;

impl<K: DataKind + Into<MeasuredData>> From<Dataset<K>> for Measurement {
    /// The data set of one kind as a measurement of any kind, with the same header.
    fn from(own: Dataset<K>) -> Self {
        Self { header: own.header, data: own.data.into() }
    }
}

impl Measurement {
    /// The given standard deviation of the values, in their unit; `None` if it is to be estimated from the residuals.
    pub fn sigma(&self) -> Option<f64> {
        self.header.sigma
    }

    /// Loss function of the residuals of this measurement.
    pub fn loss(&self) -> Loss {
        self.header.loss
    }

    /// Whether the measurement is validation data: predicted, not fitted.
    pub fn held_out(&self) -> bool {
        self.header.held_out
    }

    /// Whether the measurement is only planned: points and times are there, values are placeholders.
    pub fn planned(&self) -> bool {
        self.header.planned
    }

    /// Numbers of rows of the file that were left out, by reason.
    pub fn dropped(&self) -> Dropped {
        self.header.dropped
    }

    /// The recorded motion of a point; `None` if the measurement is of another kind.
    pub fn motion(&self) -> Option<&PointMotion> {
        if let MeasuredData::PointMotion(motion) = &self.data { Some(motion) } else { None }
    }

    /// A copy of the recorded motion with its header; `None` if the measurement is of another kind.
    pub fn observation(&self) -> Option<Observation> {
        Some(Dataset { header: self.header.clone(), data: self.motion()?.clone() })
    }

    /// The shape at rest; `None` if the measurement is of another kind.
    pub(crate) fn shape(&self) -> Option<&EquilibriumShape> {
        if let MeasuredData::EquilibriumShape(shape) = &self.data { Some(shape) } else { None }
    }

    /// The natural frequencies; `None` if the measurement is of another kind.
    pub(crate) fn frequencies(&self) -> Option<&ModeFrequencies> {
        if let MeasuredData::ModeFrequencies(own) = &self.data { Some(own) } else { None }
    }

    /// The load-deflection curve; `None` if the measurement is of another kind.
    pub(crate) fn load_curve(&self) -> Option<&LoadCurve> {
        if let MeasuredData::LoadCurve(curve) = &self.data { Some(curve) } else { None }
    }

    /// The measured critical load; `None` if the measurement is of another kind.
    pub(crate) fn buckling(&self) -> Option<&BucklingLoad> {
        if let MeasuredData::BucklingLoad(own) = &self.data { Some(own) } else { None }
    }

    /// Whether every position of a motion or a shape has an observed coordinate `c` (0 for x); true for other
    /// measurements. Positions without any observed coordinate do not count.
    pub(crate) fn has_coordinate(&self, c: usize) -> bool {
        let motion = self.motion().into_iter().flat_map(|own| &own.samples).map(|s| s.position);
        let shape = self.shape().into_iter().flat_map(|own| &own.sightings).map(|s| s.position);
        motion.chain(shape).all(|x| x[c].is_some() || x.iter().all(Option::is_none))
    }

    /// Name of the marker in the recording that prescribes the ends; `None` of other measurements.
    pub(crate) fn marker(&self) -> Option<&str> {
        self.motion()?.marker.as_deref()
    }

    /// Symbol of the unit of the values: m, rad/s, N, N m, m/s^2, rad, 1/m, or that of a gauge; empty for pure
    /// numbers.
    pub(crate) fn unit(&self) -> &str {
        &self.header.unit
    }

    /// The unit in which the values were given and reports display them (as Hz), with its size in the unit of the
    /// values. Without such a unit it is that of the values, of size 1.
    pub(crate) fn data_unit(&self) -> DataUnit<'_> {
        self.header.data_unit.unwrap_or(DataUnit { name: self.unit(), size: 1.0 })
    }

    /// Standard deviations of all values, in their unit and in the order of the residuals: `sigma` in the place of that
    /// of the header, times the factors of the header.
    pub(crate) fn sigmas(&self, sigma: f64) -> Vec<f64> {
        self.data.sigmas(&self.header, sigma)
    }

    /// Adds to every value its residual times its standard deviation, in place, for synthetic data. The standard
    /// deviation is `sigma`, in the place of that of the header, times the factor of the value in the header, if any.
    /// `residuals` are in the order of the values.
    pub(crate) fn add_residuals(&mut self, residuals: &[f64], sigma: f64) {
        // A residual is in units of the standard deviation of its own value, which may differ by factors.
        let sigmas = self.sigmas(sigma);
        let changes = residuals.iter().zip(sigmas);
        let values = self.data.values_mut();
        values.into_iter().zip(changes).for_each(|(value, (r, s))| *value += r * s);
    }

    /// The name of the measurement in messages: its file, or the name of the data.
    pub(crate) fn label(&self) -> String {
        self.data.label(&self.header)
    }
}
