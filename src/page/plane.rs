//! Selection of the coordinate planes in which a rod is drawn: the one or two with the largest extents of its points.
//!
//! Input: the points of all drawn shapes, m. Planes rank by the larger of the two extents of the points in them, then
//! by the smaller. A plane is left out if one of its extents is at most `FLAT` of the largest of all; the x-y plane is
//! drawn if none remains. [`planes`] returns one or two pairs of axes; [`range`] is the smallest and largest of
//! numbers, for axes too. Pages of simulations, fits and predictions draw in these planes.

use crate::numerics::total_order;
use std::cmp::Reverse;

/// Coordinates whose extent is at most this part of the largest extent are not drawn. It separates rounding errors from
/// motion.
const FLAT: f64 = 1e-6;
/// Names of the world axes.
pub(super) const AXES: [&str; 3] = ["x", "y", "z"];

/// Indices (0 x, 1 y, 2 z) of the horizontal and of the vertical axis of a drawing.
pub(super) type DrawingPlane = [usize; 2];

/// The smallest and the largest of numbers; `[inf, -inf]` of none.
pub(super) fn range(values: impl IntoIterator<Item = f64>) -> [f64; 2] {
    let none = [f64::INFINITY, -f64::INFINITY];
    values.into_iter().fold(none, |[low, high], x| [low.min(x), high.max(x)])
}

/// The one or two coordinate planes with the largest extents of these points, m. They are in descending order of the
/// larger of their two extents, then of the smaller. Planes with an extent up to [`FLAT`] of the largest are left out;
/// the x-y plane if none remains. `points` returns an iterator, for three passes.
pub(super) fn planes<'a, I: Iterator<Item = &'a [f64; 3]>>(
    points: impl Fn() -> I,
) -> Vec<DrawingPlane> {
    let extents = [0, 1, 2].map(|c| {
        let [low, high] = range(points().map(|x| x[c]));
        high - low
    });
    let largest = extents.iter().copied().fold(0.0, f64::max);
    let mut planes = vec![[0, 1], [0, 2], [1, 2]];
    planes.retain(|plane| plane.iter().all(|c| extents[*c] > FLAT * largest));
    planes.sort_by_cached_key(|[a, b]| {
        let (smaller, larger) = (extents[*a].min(extents[*b]), extents[*a].max(extents[*b]));
        Reverse((total_order(larger), total_order(smaller)))
    });
    // The third plane shows no coordinate that the first two do not show.
    planes.truncate(2);
    // A rod that stays straight along an axis has an extent along one axis only.
    if planes.is_empty() { vec![[0, 1]] } else { planes }
}
