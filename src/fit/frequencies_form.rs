//! `[[frequencies]]` of a fit file: its keys, and their conversion to a measurement of natural frequencies.
//!
//! Input: the deserialized table with frequencies in Hz or rad/s, and their standard deviation in the same unit.
//! Optional are mode numbers (from 1; default: the lowest modes) and filters of the modes (plane, kind, direction). So
//! are shear and rotary inertia of the simulated frequencies, a loss function, and the use as validation data. Output:
//! a [`Measurement`] in rad/s. Errors, with the key: both or neither unit, a frequency that is not finite and above 0,
//! or another number of mode numbers than frequencies. Other values are checked with the fit.

use crate::error::Error;
use crate::fit::measurement::Measurement;
use crate::fit::measurement::frequencies::Frequencies;
use crate::fit::measurement::loss::Loss;
use crate::vibration::{ModeFilter, ModeKind, ModePlane};
use serde::Deserialize;

/// `[[frequencies]]`: measured natural frequencies.
#[derive(Clone, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct FrequenciesForm {
    /// Frequencies, Hz; or `rad_s`.
    hz: Option<Vec<f64>>,
    /// Angular frequencies, rad/s; or `hz`.
    rad_s: Option<Vec<f64>>,
    /// Mode numbers from 1, as `rodfit modes` lists them; default: the lowest modes.
    modes: Option<Vec<usize>>,
    /// Plane of the modes relative to the plane of the scene; default: in the plane.
    plane: Option<ModePlane>,
    /// Kind of the modes; mode numbers count within it.
    kind: Option<ModeKind>,
    /// Direction of most of the motion, in spatial scenes, instead of a plane.
    #[serde(default, deserialize_with = "crate::input::arrays::some_numbers")]
    direction: Option<[f64; 3]>,
    /// Whether shear deformation and rotary inertia reduce the simulated frequencies of bending modes, as in a thick
    /// bar.
    #[serde(default)]
    timoshenko: bool,
    /// Standard deviation in the unit of the frequencies.
    sigma: f64,
    /// Loss function of the residuals.
    #[serde(default)]
    loss: Loss,
    /// Whether the frequencies are validation data: predicted, not fitted.
    #[serde(default)]
    held_out: bool,
}

impl FrequenciesForm {
    /// The measurement of the table, in rad/s, for the lowest modes (1, 2, ..) unless mode numbers are given. An error,
    /// with the `key` of the table in the fit file, for both or neither unit, frequencies that are not finite and above
    /// 0, or another number of mode numbers than frequencies.
    pub fn read(self, key: &str) -> Result<Measurement, Error> {
        // Exactly one of both units: errors name the key in the user's own unit.
        let (unit, values) = match (self.hz, self.rad_s) {
            (Some(hz), None) => ("hz", hz),
            (None, Some(rad_s)) => ("rad_s", rad_s),
            (hz, _) => {
                let found = if hz.is_some() { "both hz and rad_s" } else { "neither hz nor rad_s" };
                return Err(Error::invalid(key, found, "one of the two"));
            }
        };
        if let Some(k) = values.iter().position(|f| !(f.is_finite() && *f > 0.0)) {
            return Err(Error::invalid(format!("{key}.{unit}[{k}]"), values[k], "above 0"));
        }
        // From here on frequencies and sigma are in rad/s.
        let mut frequencies = match unit {
            "hz" => Frequencies::hz(&values, self.sigma),
            _ => Frequencies::new(&values, self.sigma),
        };
        // Without mode numbers the frequencies are those of the lowest modes.
        if let Some(modes) = self.modes {
            if modes.len() != values.len() {
                let found =
                    format!("{} mode numbers for {} frequencies", modes.len(), values.len());
                return Err(Error::invalid(
                    format!("{key}.modes"),
                    found,
                    "one mode number for \
                                                   each frequency",
                ));
            }
            frequencies = frequencies.of_modes(&modes)?;
        }
        let Self { plane, kind, direction, timoshenko, loss, held_out, .. } = self;
        frequencies.among = ModeFilter { plane, kind, direction };
        frequencies.timoshenko = timoshenko;
        Ok(frequencies.with_properties(None, loss, held_out).into())
    }
}
