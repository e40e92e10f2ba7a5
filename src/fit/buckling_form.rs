//! `[[buckling]]` of a fit file: its keys, and their conversion to a measured critical load.
//!
//! Input: the deserialized table with the load, its critical value and the standard deviation, N or N m. Output: a
//! [`Measurement`], validation data with the key `held_out`. Values are not checked here but with the fit.

use crate::fit::measurement::Measurement;
use crate::fit::measurement::buckling::Buckling;
use crate::scene::Parameter;
use serde::Deserialize;

/// `[[buckling]]`: a measured critical load, at which the rod buckles.
#[derive(Clone, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct BucklingForm {
    /// Number of the scene that takes the value of the load, such as `loads.point.0.force.x`.
    load: Parameter,
    /// Critical value of the load, N or N m, with its sign in the scene.
    value: f64,
    /// Standard deviation of the value, N or N m.
    sigma: f64,
    /// Whether the critical load is validation data: predicted, not fitted.
    #[serde(default)]
    held_out: bool,
}

impl BucklingForm {
    /// The measurement of the table; validation data if `held_out` is set.
    pub fn read(&self) -> Measurement {
        let own = Buckling::new(self.load, self.value, self.sigma);
        if self.held_out { own.held_out().into() } else { own.into() }
    }
}
