//! Physical numbers of a scene: their quantities (unit, limits, search range) and the visitor that converts them one
//! by one.
//!
//! A number is declared once, in its table (`scene::table`): the field, whose name is the key in the file, and its
//! [`Quantity`]. From the declaration follow the number's parameter name (its path in the file,
//! `loads.point.0.force.y`), its validation, and its place in lists of all numbers. Validation rejects numbers that are
//! not finite or have a sign that is not allowed; the limits bound fits, and the values of user-defined energies.
//! `NumberVisitor` has the path of the present table (`enter` appends a key, `leave` removes it), and converts a scene
//! to another number type, such as dual numbers.
//!
//! A [`Quantity`] is `positive` (identified in its logarithm) or `signed`. `vanishing` also allows zero, `within` sets
//! limits, `searched` the values at which a search begins, and `of_the_recording` marks numbers without effect on the
//! motion. `Quantity::check` rejects a value as above, not by its limits. `is_default` returns whether a value is left
//! out in files.

use crate::error::Error;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::f64::consts::PI;

/// Number type of scenes that are read from files and written to them: `f64`.
pub trait SceneNumber:
    Copy + Serialize + DeserializeOwned + Default + From<f64> + PartialEq
{
}
impl SceneNumber for f64 {}

/// Whether a value equals the default of its type; such values are not written to files.
pub(crate) fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

/// The number 1, a factor without effect.
pub(crate) fn one<D: From<f64>>() -> D {
    D::from(1.0)
}

/// Whether a factor is 1; such a factor is not written to files.
pub(super) fn is_one<D: From<f64> + PartialEq>(factor: &D) -> bool {
    *factor == one()
}

/// Unit, limits and search range of a physical number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quantity {
    /// Unit; empty for pure numbers.
    pub unit: &'static str,
    /// Smallest and largest allowed value, in `unit`.
    pub limits: [f64; 2],
    /// Whether it is above zero (or also zero, with `may_vanish`); fits then identify its logarithm.
    pub is_positive: bool,
    /// Whether it is positive or zero, where zero switches the effect off.
    pub may_vanish: bool,
    /// Whether only the recording depends on it, and not the motion.
    pub is_of_the_recording: bool,
    /// Values at which a fit without a start value begins its search.
    pub candidates: Candidates,
}

/// Values at which a fit without a start value begins its search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Candidates {
    /// The value of the scene.
    Here,
    /// From the first to the second value, geometrically spaced; the third is the number of values per decade.
    Decades(f64, f64, f64),
    /// These values.
    Values(&'static [f64]),
    /// These values over the rod length.
    PerLength(&'static [f64]),
    /// From the first to the second fraction of the rod length; the third is the number of values per decade.
    OfLength(f64, f64, f64),
    /// From the first fraction of Young's modulus to it; the second is the number of values per decade.
    OfYoungsModulus(f64, f64),
    /// Rates, 1/s: from the first over the duration of the record to the second over its first swing; the third is the
    /// number of values per decade.
    Rate(f64, f64, f64),
    /// Times, s: from the first to the second fraction of the record's first swing; the third is the number of values
    /// per decade.
    Time(f64, f64, f64),
}

impl Quantity {
    /// A number above zero in a unit, from the smallest to the largest positive normal `f64`, identified in its
    /// logarithm. A search begins at the scene's value.
    pub const fn positive(unit: &'static str) -> Self {
        Self {
            unit,
            limits: [f64::MIN_POSITIVE, f64::MAX],
            is_positive: true,
            may_vanish: false,
            is_of_the_recording: false,
            candidates: Candidates::Here,
        }
    }

    /// A number of either sign in a unit, from -1e12 to 1e12. A search begins at the scene's value.
    pub const fn signed(unit: &'static str) -> Self {
        Self { limits: [-1e12, 1e12], is_positive: false, ..Self::positive(unit) }
    }

    /// An angle in rad, up to half a turn in either direction.
    pub const ANGLE: Self = Self::signed("rad").within(-PI, PI);

    /// The same quantity with the limits `low` and `high`, in its unit: the smallest and largest value in fits and of
    /// the parameters of user-defined energies.
    pub const fn within(self, low: f64, high: f64) -> Self {
        Self { limits: [low, high], ..self }
    }

    /// The same quantity with the values `candidates`, at which a fit without a start value begins its search.
    pub const fn searched(self, candidates: Candidates) -> Self {
        Self { candidates, ..self }
    }

    /// The same positive quantity, which may also be zero, where it switches its effect off. For a signed one nothing
    /// changes.
    pub const fn vanishing(self) -> Self {
        Self { may_vanish: true, ..self }
    }

    /// The same quantity marked as one of the recording, by a camera or sensor: measured values depend on it, and the
    /// motion does not.
    pub const fn of_the_recording(self) -> Self {
        Self { is_of_the_recording: true, ..self }
    }

    /// Rejects a value that is not finite or has a sign that the quantity does not allow; limits are not checked. `key`
    /// is its path, for the error.
    pub(crate) fn check(&self, key: &str, value: f64) -> Result<(), Error> {
        // Limits bound fits only; a scene may have values beyond them.
        let (is_allowed, allowed) = match (self.is_positive, self.may_vanish) {
            (true, false) => (value > 0.0, "a finite number above 0"),
            (true, true) => (value >= 0.0, "a finite number, 0 or above"),
            (false, _) => (true, "a finite number"),
        };
        match is_allowed && value.is_finite() {
            true => Ok(()),
            false => Err(Error::invalid(key, value, allowed)),
        }
    }
}

/// Conversion of the numbers of a scene to another number type `D`, one after the other, with the path of each.
pub(crate) struct NumberVisitor<'a, D> {
    /// Path of the table that is visited, `loads.point.0`.
    path: String,
    /// Returns the converted number of a path, value and quantity.
    convert: &'a mut dyn FnMut(&str, f64, Quantity) -> D,
}

impl<'a, D> NumberVisitor<'a, D> {
    /// A visitor at the root of a scene; `convert(path, value, quantity)` returns the new number.
    pub fn new(convert: &'a mut dyn FnMut(&str, f64, Quantity) -> D) -> Self {
        Self { path: String::new(), convert }
    }

    /// The converted number of the entry `key` of the present table. `convert` gets its path (that of the table, a dot,
    /// `key`), value and quantity. The path of the table is unchanged afterwards.
    pub fn number(&mut self, key: &str, value: f64, quantity: Quantity) -> D {
        // One buffer for all paths: keys are appended and removed, not copied.
        let outer_length = self.enter(key);
        let number = (self.convert)(&self.path, value, quantity);
        self.leave(outer_length);
        number
    }

    /// Appends a key to the path, behind a dot unless the path is empty. Returns the length of the path before, in
    /// bytes, for [`leave`](Self::leave).
    pub fn enter(&mut self, key: &str) -> usize {
        let outer_length = self.path.len();
        if outer_length > 0 {
            self.path.push('.');
        }
        self.path.push_str(key);
        outer_length
    }

    /// Shortens the path to `outer_length` bytes, which [`enter`](Self::enter) returned, and so removes the keys
    /// appended since.
    pub fn leave(&mut self, outer_length: usize) {
        self.path.truncate(outer_length);
    }
}
