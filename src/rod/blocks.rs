//! Blocks of elements or unknowns for SIMD lanes: slices of as many as there are lanes, padded beyond the end of the
//! rod.
//!
//! Input: a list and the index of the first element; output: a slice with one element per lane. Complete blocks are
//! slices of the original list, without a copy. The last block is copied to the stack and filled up. [`block`] adds
//! copies of a given element without effect. [`window`] adds nodes that continue the rod straight by its last two
//! nodes, so that lengths and curvatures are finite. [`tension`] returns the tensions of the geometric stiffness, N:
//! the axial forces, or given ones, which are zero beyond the last edge.

use crate::numerics::scalar::{Scalar, SimdScalar};

/// The largest supported number of SIMD lanes: eight `f64` of a 512-bit register.
pub(super) const MOST: usize = 8;
/// Unknowns of a block and of the node after it, four per node.
const WINDOW: usize = 4 * (MOST + 1);

/// Stack space for the copy of a block that goes beyond the end of a rod.
pub(super) type PaddedBlock<T> = Option<[T; MOST]>;

/// The elements of `all` from index `first` on, one per SIMD lane. A complete block is a slice of `all`; else the
/// elements are copied to `room` and followed by copies of `beyond`.
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
            // The last block only: lanes beyond the rod must be finite, but their results are not used.
            let block = room.insert([beyond; MOST]);
            pad(block, all.get(first..).unwrap_or_default());
            &block[..V::LANES]
        }
    }
}

/// Overwrites the first elements of `block` with `left`, the last elements of a list, at most [`MOST`]. The other
/// elements of `block` stay.
#[cold]
#[inline(never)]
#[expect(clippy::manual_memcpy, reason = "a call costs more than a few numbers")]
fn pad<T: Copy>(block: &mut [T; MOST], left: &[T]) {
    for k in 0..left.len().min(MOST) {
        block[k] = left[k];
    }
}

/// The tensions for the geometric stiffness of the edges from `first` on, N, one per lane: the axial forces `force`,
/// unless tensions of all edges, `others`, are given. These are zero beyond the last edge.
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

/// The `size` unknowns from edge `first` on, with `stride` unknowns per node. Inside the rod it is a slice of `q`.
/// Beyond its end the unknowns are copied to `room` and the rod is continued straight there.
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

/// Overwrites `window` with the unknowns `q`, at least `stride` of them, then continues each coordinate and angle
/// linearly from its last two values (same edge length and direction). A coordinate or angle with one value in `q`
/// keeps it.
#[cold]
#[inline(never)]
#[expect(clippy::manual_memcpy, reason = "a call costs more than a few numbers")]
fn continue_straight<D: Scalar>(window: &mut [D], q: &[D], stride: usize) {
    for k in 0..q.len() {
        window[k] = q[k];
    }
    for k in q.len()..window.len() {
        // An edge beyond the end repeats the last one: a length of zero would divide by zero.
        let last = window[k - stride];
        window[k] = if k < 2 * stride { last } else { last + (last - window[k - 2 * stride]) };
    }
}
