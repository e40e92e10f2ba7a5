//! Elements taken several at a time: as many as there are lanes.

use crate::numerics::scalar::{Scalar, Wide};

/// More lanes than any vector unit has.
pub(super) const MOST: usize = 8;
/// Unknowns of a block and the node after it, four of each.
const WINDOW: usize = 4 * (MOST + 1);

/// Room for a block that goes beyond the end of a rod.
pub(super) type Room<T> = Option<[T; MOST]>;

/// `LANES` of `all` from `first` on, those beyond the end as they are said to be.
#[inline(always)]
pub(super) fn block<'a, D, V: Wide<D>, T: Copy>(
    all: &'a [T],
    first: usize,
    beyond: T,
    room: &'a mut Room<T>,
) -> &'a [T] {
    match all.get(first..first + V::LANES) {
        Some(all) => all,
        None => &room.insert(padded(all, first, beyond))[..V::LANES],
    }
}

#[cold]
#[inline(never)]
fn padded<T: Copy>(all: &[T], first: usize, beyond: T) -> [T; MOST] {
    let (mut block, left) = ([beyond; MOST], &all[first.min(all.len())..]);
    block[..left.len()].copy_from_slice(left);
    block
}

/// The unknowns of `LANES` edges from `first` on, `stride` for each node; a rod that ends before is taken to go
/// straight on.
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
        None => &room.insert(continued(&q[start..], stride, size))[..size],
    }
}

#[cold]
#[inline(never)]
fn continued<D: Scalar>(q: &[D], stride: usize, size: usize) -> [D; WINDOW] {
    let mut all = [D::from(0.0); WINDOW];
    all[..q.len()].copy_from_slice(q);
    for k in q.len()..size {
        let last = all[k - stride];
        all[k] = if k < 2 * stride { last } else { last + (last - all[k - 2 * stride]) };
    }
    all
}
