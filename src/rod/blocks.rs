//! Blocks of elements, one for each SIMD lane.

use crate::numerics::scalar::{Scalar, SimdScalar};

/// An upper limit of the number of SIMD lanes.
pub(super) const MOST: usize = 8;
/// Unknowns of a block and the node after it, four of each.
const WINDOW: usize = 4 * (MOST + 1);

/// Copies of elements for a block that goes beyond the end of a rod.
pub(super) type PaddedBlock<T> = Option<[T; MOST]>;

/// `LANES` elements of `all` from `first` on, filled with `beyond` after the end.
#[inline(always)]
pub(super) fn block<'a, D, V: SimdScalar<D>, T: Copy>(
    all: &'a [T],
    first: usize,
    beyond: T,
    room: &'a mut PaddedBlock<T>,
) -> &'a [T] {
    match all.get(first..first + V::LANES) {
        Some(all) => all,
        None => {
            let block = room.insert([beyond; MOST]);
            pad(block, all.get(first..).unwrap_or_default());
            &block[..V::LANES]
        }
    }
}

/// Overwrites the first numbers of a block with those that are left.
#[cold]
#[inline(never)]
#[expect(clippy::manual_memcpy, reason = "a call costs more than a few numbers")]
fn pad<T: Copy>(block: &mut [T; MOST], left: &[T]) {
    for k in 0..left.len().min(MOST) {
        block[k] = left[k];
    }
}

/// The tensions for the geometric stiffness of the edges from `first` on, N: `force`, unless `others` are given.
#[inline(always)]
pub(super) fn tension<D: Scalar, V: SimdScalar<D>>(
    others: Option<&[D]>,
    level: V::Level,
    first: usize,
    force: V,
) -> V {
    let Some(others) = others else { return force };
    let mut room = None;
    let others = block::<D, V, _>(others, first, D::from(0.0), &mut room);
    V::gather(level, |lane| others[lane])
}

/// The unknowns of `LANES` edges from `first` on, `stride` for each node; beyond its end the rod is continued straight.
#[inline(always)]
pub(super) fn window<'a, D: Scalar>(
    q: &'a [D],
    first: usize,
    stride: usize,
    size: usize,
    room: &'a mut Option<[D; WINDOW]>,
) -> &'a [D] {
    let start = stride * first;
    match q.get(start..start + size) {
        Some(q) => q,
        None => {
            let window = &mut room.insert([D::from(0.0); WINDOW])[..size];
            continue_straight(window, &q[start..], stride);
            window
        }
    }
}

/// Fills a window with the unknowns `q`, and the rest with nodes that continue the last edge.
#[cold]
#[inline(never)]
#[expect(clippy::manual_memcpy, reason = "a call costs more than a few numbers")]
fn continue_straight<D: Scalar>(window: &mut [D], q: &[D], stride: usize) {
    for k in 0..q.len() {
        window[k] = q[k];
    }
    for k in q.len()..window.len() {
        let last = window[k - stride];
        window[k] = if k < 2 * stride { last } else { last + (last - window[k - 2 * stride]) };
    }
}
