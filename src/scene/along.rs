//! Numbers that may change along the rod.

use crate::error::Error;
use crate::scene::number::{Numbers, Quantity, Written};
use serde::{Deserialize, Serialize};

/// A number that holds all along the rod, or a list with one for each of as many equal parts of its
/// length, from the start. In code, `0.5.into()` or `vec![0.5, 0.8].into()`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(
    untagged,
    bound = "D: Written",
    expecting = "expected a number, or a list of numbers, one for each part of the rod"
)]
pub enum Along<D = f64> {
    /// One number for the whole rod.
    Whole(D),
    /// One number for each of as many equal parts of the length.
    Piecewise(Vec<D>),
}

impl From<f64> for Along {
    fn from(value: f64) -> Self {
        Self::Whole(value)
    }
}

impl From<Vec<f64>> for Along {
    fn from(values: Vec<f64>) -> Self {
        Self::Piecewise(values)
    }
}

impl<D> Along<D> {
    /// The numbers, one for each part.
    pub fn values(&self) -> &[D] {
        match self {
            Self::Whole(value) => std::slice::from_ref(value),
            Self::Piecewise(values) => values,
        }
    }

    /// The number at a place, given as a part of the rod's length. Where two parts meet, the second's.
    pub fn at(&self, place: f64) -> D
    where
        D: Copy,
    {
        let values = self.values();
        // Rounding errors of arc lengths do not count.
        let part = (place * values.len() as f64 + 1e-9).max(0.0) as usize;
        values[part.min(values.len() - 1)]
    }
}

impl Along {
    pub(super) fn over<D>(
        &self,
        key: &str,
        quantity: [Quantity; 2],
        n: &mut Numbers<'_, D>,
    ) -> Along<D> {
        let [whole, part] = quantity;
        match self {
            Self::Whole(value) => Along::Whole(n.number(key, *value, whole)),
            Self::Piecewise(values) => n.table(key, |n| {
                let each = |(i, value): (usize, &f64)| n.number(&i.to_string(), *value, part);
                Along::Piecewise(values.iter().enumerate().map(each).collect())
            }),
        }
    }

    /// Whether it is zero all along.
    pub fn is_zero(&self) -> bool {
        self.values().iter().all(|value| *value == 0.0)
    }

    pub(super) fn check(&self, key: &str) -> Result<(), Error> {
        match self {
            Self::Whole(value) if !value.is_finite() => {
                Err(Error::invalid(key, value, "a finite number"))
            }
            Self::Piecewise(values)
                if values.is_empty() || values.iter().any(|value| !value.is_finite()) =>
            {
                Err(Error::invalid(key, format!("{values:?}"), "one finite number or more"))
            }
            _ => Ok(()),
        }
    }
}
