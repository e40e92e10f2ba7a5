//! Prescribed (Dirichlet) degrees of freedom inside the range of free ones, such as nodes that follow a recorded
//! motion.
//!
//! Linear systems are solved over one range of unknowns. [`PrescribedDofs`] is the list of the indices of the
//! prescribed ones, sorted and without repetitions. `eliminate_rows_and_columns` replaces their rows and columns in a
//! tangent by those of the identity, and `fill` sets their entries of a right-hand side to zero (or another value).
//! Then their change is zero, and the changes of the other unknowns are those of the system without them.

use crate::numerics::scalar::Scalar;
use crate::numerics::tangent::Tangent;
use std::sync::Arc;

/// The indices of the prescribed unknowns, in ascending order; clones share the list.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PrescribedDofs(Arc<[usize]>);

impl Default for PrescribedDofs {
    /// No prescribed unknowns.
    fn default() -> Self {
        Self(Arc::new([]))
    }
}

impl PrescribedDofs {
    /// The list from indices in any order, with or without repetitions.
    pub fn new(mut unknowns: Vec<usize>) -> Self {
        unknowns.sort_unstable();
        unknowns.dedup();
        Self(unknowns.into())
    }

    /// Whether no unknown is prescribed.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Whether unknown `i` is prescribed.
    pub fn contains(&self, i: usize) -> bool {
        self.0.binary_search(&i).is_ok()
    }

    /// The indices of prescribed unknowns in ascending order.
    pub fn iter(&self) -> impl Iterator<Item = usize> {
        self.0.iter().copied()
    }

    /// Sets the entries of prescribed unknowns in `x`, which has an entry for every unknown, to `value`.
    #[inline]
    pub fn fill<T: Copy>(&self, x: &mut [T], value: T) {
        for i in &*self.0 {
            x[*i] = value;
        }
    }

    /// Replaces the rows and columns of all prescribed unknowns in a matrix by those of the identity.
    #[inline]
    pub fn eliminate_rows_and_columns<D: Scalar>(&self, matrix: &mut impl Tangent<D>) {
        for i in &*self.0 {
            matrix.eliminate_row_and_column(*i);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::banded::{BandMatrix, Ldlt};
    use crate::numerics::tangent::Factors;

    /// Oracle: the dense system without the rows and columns of the prescribed unknowns.
    #[test]
    fn free_unknowns_solve_the_system_without_prescribed_ones() {
        let n = 14;
        let mut whole = BandMatrix::<f64, 3>::zeros(n);
        for j in 0..n - 3 {
            let v = |k: usize| ((j * 7 + k * 3) % 11) as f64 / 11.0 - 0.4;
            whole.add_corner(
                j,
                4,
                &[
                    [3.0, v(0), v(1), v(2)],
                    [v(0), 2.5, v(3), v(4)],
                    [v(1), v(3), 2.0, v(5)],
                    [v(2), v(4), v(5), 2.0],
                ],
            );
        }
        for prescribed in [vec![], vec![4, 5], vec![9, 2], vec![0, 13], vec![7, 6, 7, 5]] {
            let prescribed = PrescribedDofs::new(prescribed);
            let free: Vec<usize> = (0..n).filter(|i| !prescribed.contains(*i)).collect();
            let mut b: Vec<f64> = (0..n).map(|i| (i as f64).sin()).collect();
            prescribed.fill(&mut b, 0.0);
            let mut matrix = whole.clone();
            prescribed.eliminate_rows_and_columns(&mut matrix);
            let mut factors = Ldlt::with_order(n);
            factors.factor(&matrix, 0..n).unwrap();
            let mut x = b.clone();
            factors.solve(&mut x);
            assert!(prescribed.iter().all(|i| x[i] == 0.0));
            let m = free.len();
            let rows = nalgebra::DMatrix::from_fn(m, m, |i, j| whole.get(free[i], free[j]));
            let right = nalgebra::DVector::from_fn(m, |i, _| b[free[i]]);
            let expected = rows.lu().solve(&right).unwrap();
            assert!(free.iter().zip(&expected).all(|(i, e)| (x[*i] - e).abs() < 1e-13));
        }
    }
}
