//! Numbers that may change along the rod.

use crate::error::Error;
use serde::{Deserialize, Serialize};

/// Most parts of a rod.
pub const MOST_PARTS: usize = 16;

/// A number that holds all along the rod, or a list with one for each of as many equal parts of its
/// length, from the start. In code, `0.5.into()` or `vec![0.5, 0.8].into()`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(
    untagged,
    expecting = "expected a number, or a list of numbers, one for each part of the rod"
)]
pub enum Along {
    /// Of the whole rod.
    Whole(f64),
    /// Of each part, 1 to 16.
    Parts(Vec<f64>),
}

impl From<f64> for Along {
    fn from(value: f64) -> Self {
        Self::Whole(value)
    }
}

impl From<Vec<f64>> for Along {
    fn from(values: Vec<f64>) -> Self {
        Self::Parts(values)
    }
}

impl Along {
    /// The numbers, one for each part.
    pub fn values(&self) -> &[f64] {
        match self {
            Self::Whole(value) => std::slice::from_ref(value),
            Self::Parts(values) => values,
        }
    }

    /// Whether it is zero all along.
    pub fn is_zero(&self) -> bool {
        self.values().iter().all(|value| *value == 0.0)
    }

    /// The number of the whole rod.
    pub fn whole(&self) -> Option<f64> {
        self.clone().whole_mut().copied()
    }

    /// The number of a part, counted from 1.
    pub fn part(&self, part: u8) -> Option<f64> {
        self.clone().part_mut(part).copied()
    }

    pub(crate) fn whole_mut(&mut self) -> Option<&mut f64> {
        match self {
            Self::Whole(value) => Some(value),
            Self::Parts(_) => None,
        }
    }

    pub(crate) fn part_mut(&mut self, part: u8) -> Option<&mut f64> {
        match self {
            Self::Whole(_) => None,
            Self::Parts(values) => values.get_mut(usize::from(part).checked_sub(1)?),
        }
    }

    pub(super) fn check(&self, key: &str) -> Result<(), Error> {
        match self {
            Self::Whole(value) if !value.is_finite() => {
                Err(Error::invalid(key, value, "a finite number"))
            }
            Self::Parts(values)
                if !(1..=MOST_PARTS).contains(&values.len())
                    || values.iter().any(|value| !value.is_finite()) =>
            {
                let allowed = format!("1 to {MOST_PARTS} finite numbers");
                Err(Error::invalid(key, format!("{values:?}"), allowed))
            }
            _ => Ok(()),
        }
    }
}
