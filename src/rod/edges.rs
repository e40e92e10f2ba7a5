//! Tangents by edges, made of elements whose Hessians are by nodes.

use crate::numerics::banded::BandMatrix;
use crate::numerics::scalar::Scalar;

/// Adds an element's Hessian by nodes to a tangent by edges, at place `start`: `rows` are those of
/// the element's unknowns that stand for its edges, and their signs.
#[inline]
pub(super) fn add_edges<D: Scalar, const N: usize, const M: usize, const W: usize>(
    tangent: &mut BandMatrix<D, W>,
    start: usize,
    hessian: &[[D; N]; N],
    rows: &[(usize, f64); M],
) {
    let entry = |r: usize, c: usize| hessian[rows[r].0][rows[c].0] * (rows[r].1 * rows[c].1);
    tangent.add_block::<M>(start, &std::array::from_fn(|r| std::array::from_fn(|c| entry(r, c))));
}
