//! Measurements of a rod: its motion, its shape at rest, its frequencies, and user-defined quantities.

pub(crate) mod constant_axes;
pub(crate) mod dataset;
pub(crate) mod experiment;
pub(crate) mod frequencies;
pub(crate) mod gauge;
pub(crate) mod inspection;
mod inspection_summary;
pub(crate) mod loss;
pub(crate) mod motion;
pub(crate) mod quantity;
pub(crate) mod repeated_frames;
pub(crate) mod shape;
pub(crate) mod simulated;

use crate::error::Error;
use crate::fit::measurement::dataset::{DataKind, DataUnit, Dataset};
use crate::fit::measurement::frequencies::ModeFrequencies;
use crate::fit::measurement::gauge::GaugeReadings;
use crate::fit::measurement::loss::Loss;
use crate::fit::measurement::motion::{Observation, PointMotion};
use crate::fit::measurement::quantity::Shown;
use crate::fit::measurement::shape::EquilibriumShape;
use crate::fit::measurement::simulated::Simulated;
use marker_files::Dropped;
use std::ops::{Deref, DerefMut};

/// Makes the enumeration of the kinds of data, which have the names of their types.
macro_rules! kinds {
    ($($(#[$documentation:meta])* $Kind:ident,)*) => {
        /// Values of one of the kinds that can be measured.
        #[derive(Clone, Debug)]
        #[non_exhaustive]
        pub enum MeasuredData {
            $($(#[$documentation])* $Kind($Kind),)*
        }

        $(impl From<$Kind> for MeasuredData {
            fn from(data: $Kind) -> Self {
                Self::$Kind(data)
            }
        })*

        impl Deref for MeasuredData {
            type Target = dyn DataKind;

            fn deref(&self) -> &(dyn DataKind + 'static) {
                match self {
                    $(Self::$Kind(data) => data,)*
                }
            }
        }

        impl DerefMut for MeasuredData {
            fn deref_mut(&mut self) -> &mut (dyn DataKind + 'static) {
                match self {
                    $(Self::$Kind(data) => data,)*
                }
            }
        }

        impl MeasuredData {
            /// Calls `each` with the difference of every value from its simulated one.
            pub(crate) fn differences<D: Shown>(
                &self,
                simulated: &Simulated<D>,
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
}

/// A set of values with a common noise.
pub type Measurement = Dataset<MeasuredData>;

impl<K: DataKind + Into<MeasuredData>> From<Dataset<K>> for Measurement {
    fn from(own: Dataset<K>) -> Self {
        Self { header: own.header, data: own.data.into() }
    }
}

impl Measurement {
    /// Standard deviation of the values, in their unit, where it is known.
    pub fn sigma(&self) -> Option<f64> {
        self.header.sigma
    }

    /// Loss function of the residuals.
    pub fn loss(&self) -> Loss {
        self.header.loss
    }

    /// Whether it is validation data: predicted, not fitted.
    pub fn held_out(&self) -> bool {
        self.header.held_out
    }

    /// Whether it is only planned.
    pub fn planned(&self) -> bool {
        self.header.planned
    }

    /// Rows of its file that were left out.
    pub fn dropped(&self) -> Dropped {
        self.header.dropped
    }

    /// Number of values.
    pub fn values(&self) -> usize {
        self.data.values()
    }

    /// The recorded motion, if it is one.
    pub fn motion(&self) -> Option<&PointMotion> {
        if let MeasuredData::PointMotion(motion) = &self.data { Some(motion) } else { None }
    }

    /// The recorded motion with its header, if it is one.
    pub fn observation(&self) -> Option<Observation> {
        Some(Dataset { header: self.header.clone(), data: self.motion()?.clone() })
    }

    /// The shape at rest, if it is one.
    pub(crate) fn shape(&self) -> Option<&EquilibriumShape> {
        if let MeasuredData::EquilibriumShape(shape) = &self.data { Some(shape) } else { None }
    }

    /// The frequencies, if it has these.
    pub(crate) fn frequencies(&self) -> Option<&ModeFrequencies> {
        if let MeasuredData::ModeFrequencies(own) = &self.data { Some(own) } else { None }
    }

    /// The marker on the rod that was followed, if it is one of a recording that leads the ends.
    pub(crate) fn marker(&self) -> Option<&str> {
        self.motion()?.marker.as_deref()
    }

    /// Unit of the values.
    pub(crate) fn unit(&self) -> &str {
        &self.header.unit
    }

    /// The unit that the values were given in.
    pub(crate) fn data_unit(&self) -> DataUnit<'_> {
        self.header.data_unit.unwrap_or(DataUnit { name: self.unit(), size: 1.0 })
    }

    /// Standard deviations of all values, in the order of the residuals, where `sigma` is typical of them.
    pub(crate) fn sigmas(&self, sigma: f64) -> Vec<f64> {
        self.data.sigmas(&self.header, sigma)
    }

    /// The file or the name, for messages.
    pub(crate) fn label(&self) -> String {
        self.data.label(&self.header)
    }
}
