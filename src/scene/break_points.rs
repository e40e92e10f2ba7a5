//! Numbers at places along the rod, linear between ([`BreakPoints`]).
//!
//! Input: ascending arc lengths (m) from 0 to the end of the rod, and as many numbers. The last arc length stands for
//! the end of the rod, so that the places move in proportion where the length of the rod varies. Output: the value at a
//! fraction of the rod length, the weights of the numbers in it (`shares`), and the inner places as fractions
//! (`breaks`). Beyond an end the value is that at the end. Rejected are fewer than two places, places that do not
//! ascend from 0, another count of numbers, and numbers that are not finite.

use crate::error::Error;
use crate::numerics::scalar::Scalar;
use crate::scene::number::SceneNumber;
use serde::{Deserialize, Serialize};

/// Numbers at places along the rod, linear between.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(bound = "D: SceneNumber + schemars::JsonSchema"))]
#[serde(deny_unknown_fields, bound = "D: SceneNumber")]
pub struct BreakPoints<D = f64> {
    /// Arc lengths, m, ascending from 0 to the end of the rod.
    pub at: Vec<f64>,
    /// Value at each of these arc lengths.
    pub factor: Vec<D>,
}

/// Two neighboring numbers and the weight of the second.
#[derive(Clone, Copy)]
struct Bracket {
    first: usize,
    weight: f64,
}

impl<D> BreakPoints<D> {
    /// The places between the first and the last, ascending, as fractions of the rod length.
    pub(super) fn breaks(&self) -> Vec<f64> {
        let (end, inner) = (self.at.last().copied().unwrap_or(1.0), self.at.len().max(2) - 1);
        self.at.iter().take(inner).skip(1).map(|at| at / end).collect()
    }

    /// The numbers between which a fraction of the rod length lies; at a break point they are those after it.
    fn between(&self, place: f64) -> Bracket {
        let end = self.at.last().copied().unwrap_or(1.0);
        let at = place.clamp(0.0, 1.0) * end;
        let first = self.at.partition_point(|x| *x <= at).clamp(1, self.at.len() - 1) - 1;
        let [from, to] = [self.at[first], self.at[first + 1]];
        Bracket { first, weight: (at - from) / (to - from) }
    }

    /// Indices and weights of the two numbers whose weighted sum is the value at a fraction of the rod length.
    pub(super) fn shares(&self, place: f64) -> Vec<(usize, f64)> {
        let Bracket { first, weight } = self.between(place);
        vec![(first, 1.0 - weight), (first + 1, weight)]
    }
}

impl<D: Scalar> BreakPoints<D> {
    /// The value at `place`, a fraction of the rod length; beyond an end that at the end.
    pub(super) fn value(&self, place: f64) -> D {
        let Bracket { first, weight } = self.between(place);
        self.factor[first] + (self.factor[first + 1] - self.factor[first]) * weight
    }
}

impl BreakPoints {
    /// Rejects fewer than two places, places that do not ascend from 0, another number of values, and numbers that are
    /// not finite. `key` is the path, for the error.
    pub(super) fn check(&self, key: &str) -> Result<(), Error> {
        let Self { at, factor } = self;
        let ascends =
            at.windows(2).all(|pair| pair[0] < pair[1]) && at.iter().all(|x| x.is_finite());
        if at.len() < 2 || at[0] != 0.0 || !ascends {
            let allowed = "two or more arc lengths, m, ascending from 0 to the end of the rod";
            return Err(Error::invalid(format!("{key}.at"), format!("{at:?}"), allowed));
        }
        if factor.len() != at.len() || !factor.iter().all(|x| x.is_finite()) {
            let allowed = format!("{} finite numbers, one for each place of `at`", at.len());
            return Err(Error::invalid(format!("{key}.factor"), format!("{factor:?}"), allowed));
        }
        Ok(())
    }
}
