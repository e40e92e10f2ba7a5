//! Former names of public types of this module, deprecated since version 0.2.0.

#[deprecated(since = "0.2.0", note = "renamed to DesignVariable")]
pub use crate::fit::design::report::DesignVariable as Question;
#[deprecated(since = "0.2.0", note = "renamed to GaugeContext")]
pub use crate::fit::measurement::quantity::GaugeContext as Sight;
#[deprecated(since = "0.2.0", note = "renamed to Observable")]
pub use crate::fit::measurement::quantity::Observable as Quantity;
#[deprecated(since = "0.2.0", note = "renamed to PointState")]
pub use crate::fit::measurement::quantity::PointState as Moving;
#[deprecated(since = "0.2.0", note = "renamed to ShapePoint")]
pub use crate::fit::measurement::shape::ShapePoint as Sighting;
#[deprecated(since = "0.2.0", note = "renamed to RecordedSnapshot")]
pub use crate::fit::report::recorded_motion::RecordedSnapshot as RecordedMoment;
#[deprecated(since = "0.2.0", note = "renamed to LocalMinima")]
pub use crate::fit::search::local_minima::LocalMinima as Basins;
#[deprecated(since = "0.2.0", note = "renamed to LocalMinimum")]
pub use crate::fit::search::local_minima::LocalMinimum as Basin;
#[deprecated(since = "0.2.0", note = "renamed to MinimumSource")]
pub use crate::fit::search::local_minima::MinimumSource as SeenBy;
#[deprecated(since = "0.2.0", note = "renamed to InputSensitivity")]
pub use crate::fit::uncertainty::budget::entries::InputSensitivity as PerCent;
#[deprecated(since = "0.2.0", note = "renamed to UnidentifiableDirection")]
pub use crate::fit::uncertainty::covariance::identifiability::UnidentifiableDirection as Finding;
#[deprecated(since = "0.2.0", note = "renamed to UndetectedBias")]
pub use crate::fit::uncertainty::discrepancy::findings::UndetectedBias as CouldHide;
#[deprecated(since = "0.2.0", note = "renamed to ClusterJackknife")]
pub use crate::fit::uncertainty::estimate::ClusterJackknife as AcrossExperiments;
