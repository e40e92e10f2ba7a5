//! Numbers that may change along the rod.

use crate::error::Error;
use crate::numerics::scalar::Scalar;
use crate::scene::number::{Numbers, Quantity, Written};
use serde::{Deserialize, Serialize};

/// A value along the rod: one number, a list with one number for each of equally many equal parts
/// of the length, or a linear function of arc length. In code: `0.5.into()`, `vec![0.5,
/// 0.8].into()` or `Along::linear(1.0, 0.5)`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(bound = "D: Written + schemars::JsonSchema"))]
#[serde(
    untagged,
    bound = "D: Written",
    expecting = "expected a number, a list of numbers, one for each part of the rod, or { from = number, to = number }"
)]
pub enum Along<D = f64> {
    /// One number for the whole rod.
    Whole(D),
    /// One number for each of equally many equal parts of the length.
    Piecewise(Vec<D>),
    /// A linear function of arc length.
    Linear(Linear<D>),
}

/// A linear function of arc length from one end of the rod to the other.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(bound = "D: Written + schemars::JsonSchema"))]
#[serde(deny_unknown_fields, bound = "D: Written")]
pub struct Linear<D = f64> {
    /// Value at the start of the rod, in the unit of the list.
    pub from: D,
    /// Value at the end of the rod, in the unit of the list.
    pub to: D,
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
    /// In a straight line from one number to another.
    pub fn linear(from: D, to: D) -> Self {
        Self::Linear(Linear { from, to })
    }

    /// The numbers: one for each part, or those at the ends.
    pub fn values(&self) -> Vec<D>
    where
        D: Copy,
    {
        match self {
            Self::Whole(value) => vec![*value],
            Self::Piecewise(values) => values.clone(),
            Self::Linear(line) => vec![line.from, line.to],
        }
    }

    /// Where parts meet, as parts of the rod's length.
    pub(crate) fn breaks(&self) -> impl Iterator<Item = f64> {
        let parts = match self {
            Self::Piecewise(values) => values.len(),
            _ => 1,
        };
        (1..parts).map(move |part| part as f64 / parts as f64)
    }
}

impl<D: Scalar> Along<D> {
    /// The number at a place, given as a part of the rod's length. Where two parts meet, the second's;
    /// beyond an end, that of the end.
    pub fn at(&self, place: f64) -> D {
        match self {
            Self::Whole(value) => *value,
            Self::Piecewise(values) => values[part(place, values.len())],
            Self::Linear(Linear { from, to }) => *from + (*to - *from) * place.clamp(0.0, 1.0),
        }
    }
}

impl<D> Along<D> {
    /// Which of the numbers of a list the [number](Self::at) at a place is made of, with their weights.
    pub(crate) fn shares(&self, place: f64) -> Vec<(usize, f64)> {
        match self {
            Self::Whole(_) => vec![(0, 1.0)],
            Self::Piecewise(values) => vec![(part(place, values.len()), 1.0)],
            Self::Linear(_) => {
                let place = place.clamp(0.0, 1.0);
                vec![(0, 1.0 - place), (1, place)]
            }
        }
    }
}

/// The part a place lies in, of so many.
fn part(place: f64, parts: usize) -> usize {
    // Rounding errors of arc lengths do not count.
    ((place * parts as f64 + 1e-9).max(0.0) as usize).min(parts - 1)
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
            Self::Linear(Linear { from, to }) => n.table(key, |n| {
                Along::linear(n.number("from", *from, part), n.number("to", *to, part))
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
            Self::Linear(Linear { from, to }) if !(from.is_finite() && to.is_finite()) => {
                Err(Error::invalid(key, format!("from {from} to {to}"), "finite numbers"))
            }
            _ => Ok(()),
        }
    }
}
