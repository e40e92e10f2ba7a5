//! Numbers that may vary along the rod: constant, piecewise constant, or linear or piecewise linear in arc length
//! ([`Along`]).
//!
//! `rod.natural_curvature`, `rod.natural_twist` and the taper of section and material have this type. A scene file
//! gives a number, a list with one number for each of equally many equal parts of the length, `{ from, to }`, or `{ at,
//! factor }`. [`Along::at`] returns the value at a fraction of the rod length: at a boundary of two parts that of the
//! second, beyond an end that at the end. `at_joint` returns that of a joint, of a list the mean over it.
//! [`Along::values`] lists the numbers, `joint_shares` their weights in the value of a joint, and `breaks` the inner
//! boundaries of parts as fractions of the length (none of a number and a linear function). `is_zero` returns whether
//! all are zero. Every number is a parameter of the scene: `key`, `key.0`, `key.1`, .., `key.from` and `key.to`, or
//! `key.factor.0` and so on. Empty lists, numbers that are not finite, and arc lengths `at` that do not ascend from 0
//! are rejected.

use crate::error::Error;
use crate::numerics::scalar::Scalar;
use crate::scene::break_points::BreakPoints;
use crate::scene::number::{NumberVisitor, Quantity, SceneNumber};
use crate::scene::table::NumberTree;
use serde::{Deserialize, Serialize};

/// Distance before a boundary, as a fraction of a part, within which a place belongs to the part after the boundary:
/// rounding errors of arc lengths.
const PLACE_ROUNDING: f64 = 1e-9;

/// A value along the rod: one number, a list with one number for each of equally many equal parts of the length, a
/// linear function of arc length, or numbers at arc lengths, linear between. In code: `0.5.into()`,
/// `vec![0.5, 0.8].into()` or `Along::linear(1.0, 0.5)`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(bound = "D: SceneNumber + schemars::JsonSchema"))]
#[serde(
    untagged,
    bound = "D: SceneNumber",
    expecting = "expected a number, a list with one number for each part of the rod, { from = \
                 number, to = number }, or { at = [0, ..], factor = [..] }"
)]
pub enum Along<D = f64> {
    /// One number for the whole rod.
    Whole(D),
    /// One number for each of equally many equal parts of the length.
    Piecewise(Vec<D>),
    /// A linear function of arc length.
    Linear(Linear<D>),
    /// Numbers at arc lengths, linear between.
    BreakPoints(BreakPoints<D>),
}

/// A linear function of arc length from one end of the rod to the other.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(bound = "D: SceneNumber + schemars::JsonSchema"))]
#[serde(deny_unknown_fields, bound = "D: SceneNumber")]
pub struct Linear<D = f64> {
    /// Value at the start of the rod, in the unit of the list.
    pub from: D,
    /// Value at the end of the rod, in the unit of the list.
    pub to: D,
}

impl<D> Along<D> {
    /// The last arc length of break points, m; none otherwise.
    pub(super) fn last_arc_length(&self) -> Option<f64> {
        match self {
            Self::BreakPoints(points) => points.at.last().copied(),
            _ => None,
        }
    }

    /// Scales the arc lengths of break points, so that the last one is `length`, m. No effect on other lists, and if
    /// the factor is not finite, as for a `length` of NaN.
    pub(super) fn end_at(&mut self, length: f64) {
        let Self::BreakPoints(points) = self else { return };
        let factor = length / points.at.last().copied().unwrap_or(length);
        if factor.is_finite() && factor != 1.0 {
            points.at.iter_mut().for_each(|at| *at *= factor);
        }
    }
}

impl From<f64> for Along {
    /// One number for the whole rod, along which the value is constant.
    fn from(value: f64) -> Self {
        Self::Whole(value)
    }
}

impl From<Vec<f64>> for Along {
    /// A list with one number for each of equally many equal parts of the length.
    fn from(values: Vec<f64>) -> Self {
        Self::Piecewise(values)
    }
}

impl<D> Along<D> {
    /// Linear function of arc length from the value at the start to the value at the end.
    ///
    /// ```
    /// use rodfit::scene::Along;
    /// let along = Along::linear(1.0, 0.5);
    /// assert_eq!([along.at(0.0), along.at(0.5), along.at(1.0)], [1.0, 0.75, 0.5]);
    /// ```
    pub fn linear(from: D, to: D) -> Self {
        Self::Linear(Linear { from, to })
    }

    /// The numbers of the value along the rod: one, or one for each part or break point from the start on. Of a linear
    /// function they are those at start and end.
    pub fn values(&self) -> Vec<D>
    where
        D: Copy,
    {
        match self {
            Self::Whole(value) => vec![*value],
            Self::Piecewise(values) => values.clone(),
            Self::Linear(line) => vec![line.from, line.to],
            Self::BreakPoints(points) => points.factor.clone(),
        }
    }

    /// Inner boundaries of the parts of a list, or inner break points, ascending, as fractions of the rod length. None
    /// for a single number and a linear function.
    pub(crate) fn breaks(&self) -> Vec<f64> {
        match self {
            Self::Piecewise(values) => {
                let parts = values.len();
                (1..parts).map(|part| part as f64 / parts as f64).collect()
            }
            Self::BreakPoints(points) => points.breaks(),
            Self::Whole(_) | Self::Linear(_) => Vec::new(),
        }
    }
}

impl<D: Scalar> Along<D> {
    /// Value at `place`, a fraction of the rod length. At the boundary of two parts of a list, and up to
    /// `PLACE_ROUNDING` before it, it is that of the second part. Beyond an end it is that at the end.
    pub fn at(&self, place: f64) -> D {
        match self {
            Self::Whole(value) => *value,
            Self::Piecewise(values) => values[part(place, values.len())],
            // Nodes behind a wall are beyond the ends: they have the value at the end.
            Self::Linear(Linear { from, to }) => *from + (*to - *from) * place.clamp(0.0, 1.0),
            Self::BreakPoints(points) => points.value(place),
        }
    }
}

impl<D: Scalar> Along<D> {
    /// Value of the joint at the inner node `node` of a mesh. `places` are the arc lengths of all nodes, as fractions
    /// of the rod length. Of a list it is the mean over the joint, which extends to the middles of both adjacent edges;
    /// else the [value](Self::at) at the node. With the mean, errors by the boundaries of parts are of second order in
    /// the edge length.
    pub(crate) fn at_joint(&self, node: usize, places: &[f64]) -> D {
        match self {
            Self::Piecewise(values) => {
                let shares = self.joint_shares(node, places);
                match shares[..] {
                    [(part, _)] => values[part],
                    _ => shares.iter().map(|(part, weight)| values[*part] * *weight).sum(),
                }
            }
            _ => self.at(places[node]),
        }
    }
}

impl<D> Along<D> {
    /// Indices and weights of the [numbers](Self::values) whose weighted sum is the [value](Self::at_joint) of the
    /// joint at an inner node: those of all parts of a list that overlap the joint, one number with weight 1, or both
    /// ends of a linear part.
    pub(crate) fn joint_shares(&self, node: usize, places: &[f64]) -> Vec<(usize, f64)> {
        let place = places[node];
        match self {
            Self::Whole(_) => vec![(0, 1.0)],
            Self::Piecewise(values) => {
                let parts = values.len();
                let [from, to] =
                    [0.5 * (places[node - 1] + place), 0.5 * (place + places[node + 1])];
                let first = part(from, parts);
                // A joint that ends at a boundary, but for rounding, has no share of the part behind it.
                let last = part(to - 2.0 * PLACE_ROUNDING / parts as f64, parts).max(first);
                // Beyond the ends the first and the last part continue.
                let boundary = |part: usize| (part as f64 / parts as f64).clamp(from, to);
                let end = |part: usize| if part == last { to } else { boundary(part + 1) };
                let start = |part: usize| if part == first { from } else { boundary(part) };
                (first..=last).map(|k| (k, (end(k) - start(k)) / (to - from))).collect()
            }
            Self::Linear(_) => {
                let place = place.clamp(0.0, 1.0);
                vec![(0, 1.0 - place), (1, place)]
            }
            Self::BreakPoints(points) => points.shares(place),
        }
    }
}

/// Index of the part, of `parts` equal ones, that contains a fraction of the rod length; the first or last part beyond
/// the ends.
fn part(place: f64, parts: usize) -> usize {
    // A fraction below a boundary by rounding errors of arc lengths belongs to the part behind it.
    ((place * parts as f64 + PLACE_ROUNDING).max(0.0) as usize).min(parts - 1)
}

impl Along {
    /// Whether all numbers of the value along the rod are zero.
    pub fn is_zero(&self) -> bool {
        self.values().iter().all(|value| *value == 0.0)
    }
}

/// One number, `key.0`, `key.1`, .. of a list, `key.from` and `key.to`, or `key.factor.0`, .. of break points. The
/// first quantity is that of a single number, the second that of each of several.
impl NumberTree for Along {
    type Kind = [Quantity; 2];
    type Over<D> = Along<D>;

    /// The same value over `D`, with each number converted by the visitor. A single number has the path `key` and the
    /// quantity `whole`. Entries of a list have `key.0`, `key.1`, .., a linear function has `key.from` and `key.to`,
    /// break points have `key.factor.0`, `key.factor.1`, .., all with the quantity `part`. Arc lengths of break points
    /// stay.
    fn map_numbers<D: From<f64>>(
        &self,
        key: &str,
        [whole, part]: [Quantity; 2],
        visitor: &mut NumberVisitor<'_, D>,
    ) -> Along<D> {
        match self {
            Self::Whole(value) => Along::Whole(visitor.number(key, *value, whole)),
            Self::Piecewise(values) => Along::Piecewise(values.map_numbers(key, part, visitor)),
            Self::Linear(Linear { from, to }) => {
                // Both ends are numbers below the key, as the fields of a table are.
                let outer_length = visitor.enter(key);
                let line = Along::linear(
                    visitor.number("from", *from, part),
                    visitor.number("to", *to, part),
                );
                visitor.leave(outer_length);
                line
            }
            Self::BreakPoints(BreakPoints { at, factor }) => {
                let outer_length = visitor.enter(key);
                let factor = factor.map_numbers("factor", part, visitor);
                visitor.leave(outer_length);
                Along::BreakPoints(BreakPoints { at: at.clone(), factor })
            }
        }
    }

    /// Rejects an empty list, break points that do not ascend from 0, and numbers that are not finite. Numbers of
    /// either sign are accepted. `key` is their path, for the error.
    fn check_numbers(&self, key: &str, _: [Quantity; 2]) -> Result<(), Error> {
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
            Self::BreakPoints(points) => points.check(key),
            _ => Ok(()),
        }
    }
}
