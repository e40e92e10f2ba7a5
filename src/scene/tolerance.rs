//! `time.tolerance`: largest Newton error of the solution of a time step, a fraction of the rod length or
//! `"rounding"`.
//!
//! [`StepTolerance`] is read from and written to files as a number or that word; the default is 3e-14. Reading accepts
//! every number; `check` rejects fractions outside (0, 1e-6]. `part` is the fraction, or 0 for `"rounding"`.
//! Newmark-beta and generalised-alpha use it; the average vector field always solves to rounding.

use crate::error::Error;
use serde::de::{self, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;

/// Largest Newton error of a step: a fraction of the rod length, or `"rounding"`. The average vector field always
/// solves to rounding, since it is chosen for its conservation of energy.
///
/// The error is predicted from the decrease of Newton's corrections. With the default, `3e-14`, trajectories
/// stay within `1e-10` of the rod's length a second of those solved to rounding
/// (`cargo test --release --test physics newton_error_stays -- --nocapture`), orders of magnitude below
/// the errors of step and mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StepTolerance {
    /// Predicted error of the coordinates, as a fraction of the rod length.
    Predicted(f64),
    /// Only rounding errors remain.
    Rounding,
}

impl StepTolerance {
    /// Allowed error as a fraction of the rod length; 0 for [`StepTolerance::Rounding`].
    pub(crate) fn part(self) -> f64 {
        match self {
            Self::Predicted(part) => part,
            Self::Rounding => 0.0,
        }
    }

    /// Rejects fractions outside (0, 1e-6], and NaN; accepts `Rounding`.
    pub(super) fn check(self) -> Result<(), Error> {
        match self {
            Self::Predicted(part) if !(part > 0.0 && part <= LARGEST) => {
                let allowed = "a fraction of the length in (0, 1e-6], or \"rounding\"";
                Err(Error::invalid("time.tolerance", part, allowed))
            }
            _ => Ok(()),
        }
    }
}

/// Largest allowed fraction: above it the Newton error would no longer be the smallest of all errors.
const LARGEST: f64 = 1e-6;
/// Word of files for [`StepTolerance::Rounding`].
const ROUNDING: &str = "rounding";

/// Default fraction. Trajectories stay within 1e-10 of the rod length a second of those solved to rounding, far below
/// the errors of step and mesh.
const DEFAULT: f64 = 3e-14;

impl Default for StepTolerance {
    /// The predicted error `DEFAULT`, 3e-14 of the rod length.
    fn default() -> Self {
        Self::Predicted(DEFAULT)
    }
}

impl Serialize for StepTolerance {
    /// Writes the fraction as a number, or the word `rounding`.
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Predicted(part) => serializer.serialize_f64(*part),
            Self::Rounding => serializer.serialize_str(ROUNDING),
        }
    }
}

impl<'de> Deserialize<'de> for StepTolerance {
    /// Reads a number, also an integer, without a check of its range, or the word `rounding`. An error for other words
    /// and types.
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        /// Reader of a number or the word `rounding`.
        struct ToleranceVisitor;
        impl Visitor<'_> for ToleranceVisitor {
            type Value = StepTolerance;

            /// Writes the allowed forms, for messages.
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "a fraction of the length, such as 3e-14, or \"{ROUNDING}\"")
            }
            /// A number `part` becomes [`StepTolerance::Predicted`], without a check of its range.
            fn visit_f64<E: de::Error>(self, part: f64) -> Result<StepTolerance, E> {
                Ok(StepTolerance::Predicted(part))
            }
            /// An integer becomes [`StepTolerance::Predicted`], without a check of its range; the check of the scene
            /// rejects all of them.
            fn visit_i64<E: de::Error>(self, part: i64) -> Result<StepTolerance, E> {
                Ok(StepTolerance::Predicted(part as f64))
            }
            /// The word `rounding`; an error for another word.
            fn visit_str<E: de::Error>(self, word: &str) -> Result<StepTolerance, E> {
                match word {
                    ROUNDING => Ok(StepTolerance::Rounding),
                    _ => Err(E::invalid_value(de::Unexpected::Str(word), &self)),
                }
            }
        }
        deserializer.deserialize_any(ToleranceVisitor)
    }
}

#[cfg(test)]
impl schemars::JsonSchema for StepTolerance {
    /// Name of the JSON schema of `StepTolerance`.
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Tolerance".into()
    }

    /// JSON schema of `StepTolerance`.
    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({
            "description": "Newton error of a step as a fraction of the rod length, or \"rounding\".",
            "anyOf": [{ "type": "number" }, { "const": ROUNDING }],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Time;

    /// Times of a `[time]` with this line, or the message of an error.
    fn read(line: &str) -> Result<Time, String> {
        let text = format!("end = 1.0\nstep = 1e-3\n{line}");
        let time: Time = toml::from_str(&text).map_err(|error| error.to_string())?;
        time.tolerance.check().map_err(|error| error.to_string())?;
        Ok(time)
    }

    #[test]
    fn a_number_or_a_word() {
        for (line, tolerance) in [
            ("", StepTolerance::default()),
            ("tolerance = 1e-10", StepTolerance::Predicted(1e-10)),
            ("tolerance = \"rounding\"", StepTolerance::Rounding),
        ] {
            let time = read(line).unwrap();
            assert_eq!(time.tolerance, tolerance);
            let again: Time = toml::from_str(&toml::to_string(&time).unwrap()).unwrap();
            assert_eq!(again, time);
        }
        for line in ["tolerance = 0.0", "tolerance = -1", "tolerance = nan", "tolerance = 1e-3"] {
            assert!(read(line).unwrap_err().contains("in (0, 1e-6]"), "{line}");
        }
        assert!(read("tolerance = \"exact\"").unwrap_err().contains("or \"rounding\""));
        let beside = read("scheme = \"verlet\"\ntolerance = 1e-10").unwrap_err();
        assert!(beside.contains("with newmark-beta"), "{beside}");
    }
}
