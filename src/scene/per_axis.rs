//! Numbers of one quantity that a plane has once and space three times, one for each axis.
//!
//! [`PerAxis`] is read from a number or a list of three. It is used for moments of inertia of bodies, kg m^2, and
//! compliances of spring joints, rad/(N m). `all` repeats a single number for all three axes. As a `NumberTree` its
//! numbers are parameters: `key` for one number, `key.0` to `key.2` for three. Numbers that are not finite, or have a
//! sign that the quantity does not allow, are errors.

use crate::error::Error;
use crate::scene::number::{NumberVisitor, Quantity, SceneNumber};
use crate::scene::table::NumberTree;
use serde::{Deserialize, Serialize};

/// One number, or one for each of three axes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(bound = "D: SceneNumber + schemars::JsonSchema"))]
#[serde(
    untagged,
    bound = "D: SceneNumber",
    expecting = "expected a number, or a list with one number for each of three axes"
)]
pub enum PerAxis<D = f64> {
    /// One number.
    One(D),
    /// One for each axis.
    Three([D; 3]),
}

impl<D: From<f64>> Default for PerAxis<D> {
    /// One number, zero.
    fn default() -> Self {
        Self::One(D::from(0.0))
    }
}

impl<D: Copy> PerAxis<D> {
    /// Whether there is one number for each of three axes.
    pub fn is_per_axis(&self) -> bool {
        matches!(self, Self::Three(_))
    }

    /// The numbers of three axes; one number is repeated three times.
    pub fn all(&self) -> [D; 3] {
        match self {
            Self::One(value) => [*value; 3],
            Self::Three(values) => *values,
        }
    }
}

/// One number, or `key.0`, `key.1` and `key.2`.
impl NumberTree for PerAxis {
    type Kind = Quantity;
    type Over<D> = PerAxis<D>;

    /// The same numbers over `D`, each converted by the visitor with the `quantity`. One number has the path `key`,
    /// three have `key.0`, `key.1` and `key.2`.
    fn map_numbers<D: From<f64>>(
        &self,
        key: &str,
        quantity: Quantity,
        visitor: &mut NumberVisitor<'_, D>,
    ) -> PerAxis<D> {
        match self {
            Self::One(value) => PerAxis::One(visitor.number(key, *value, quantity)),
            Self::Three([a, b, c]) => {
                let outer_length = visitor.enter(key);
                let values = [
                    visitor.number("0", *a, quantity),
                    visitor.number("1", *b, quantity),
                    visitor.number("2", *c, quantity),
                ];
                visitor.leave(outer_length);
                PerAxis::Three(values)
            }
        }
    }

    /// Rejects numbers that are not finite or have a sign that the `quantity` does not allow. Their path is `key`, or
    /// `key[i]` for three.
    fn check_numbers(&self, key: &str, quantity: Quantity) -> Result<(), Error> {
        match self {
            Self::One(value) => quantity.check(key, *value),
            Self::Three(values) => {
                let mut values = values.iter().enumerate();
                values.try_for_each(|(c, value)| quantity.check(&format!("{key}[{c}]"), *value))
            }
        }
    }
}
