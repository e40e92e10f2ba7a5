//! `L U` factors of a band matrix that is not symmetric: [`BandLu`].
//!
//! Such a matrix is the tangent of a rod under follower loads. `factor` takes `scale diag(d) + factor matrix` over a
//! range of rows and columns, and eliminates row by row without pivoting, so that the factors stay in the band. `L` has
//! a unit diagonal. `solve` overwrites several right-hand sides by their solutions. A pivot that is zero or not finite
//! is an error with its row. The number of negative pivots is odd where the determinant is negative; it is not the
//! number of negative eigenvalues.

use crate::numerics::banded::BandMatrix;
use crate::numerics::scalar::Scalar;
use crate::numerics::tangent::{RightHandSide, Singular, Tangent};
use std::ops::Range;

/// Factors `L U` of the rows and columns of a range.
#[derive(Clone, Debug)]
pub struct BandLu<D, const W: usize> {
    /// `lower[i][p]` is the entry of `L` in row `i`, column `i - W + p`.
    lower: Vec<[D; W]>,
    /// `upper[i][p]` is the entry of `U` in row `i`, column `i + 1 + p`.
    upper: Vec<[D; W]>,
    /// Reciprocals of the diagonal of `U`.
    inverse: Vec<D>,
    /// The row under elimination: `W` entries left of the diagonal, the diagonal, `W` entries right of it.
    row: Vec<D>,
}

impl<D: Scalar, const W: usize> BandLu<D, W> {
    /// Factors of no rows.
    pub fn new() -> Self {
        let row = vec![D::from(0.0); 2 * W + 1];
        Self { lower: Vec::new(), upper: Vec::new(), inverse: Vec::new(), row }
    }

    /// Factors `scale diag(diagonal) + factor matrix` over the rows and columns of `range`, and replaces earlier
    /// factors.
    ///
    /// # Errors
    /// The row of a pivot that is zero or not finite.
    pub fn factor(
        &mut self,
        diagonal: &[D],
        scale: D,
        matrix: &BandMatrix<D, W>,
        factor: D,
        range: Range<usize>,
    ) -> Result<(), Singular> {
        let zero = D::from(0.0);
        let Self { lower, upper, inverse, row } = self;
        lower.clear();
        upper.clear();
        inverse.clear();
        for i in range.clone() {
            for (p, entry) in row.iter_mut().enumerate() {
                let inside = i + p >= range.start + W && i + p < range.end + W;
                *entry = if inside { matrix.get(i, i + p - W) * factor } else { zero };
            }
            row[W] += diagonal[i] * scale;
            // Rows before this one, from the first to the last within the band.
            let (own, mut left) = (i - range.start, [zero; W]);
            for p in W.saturating_sub(own)..W {
                let before = own + p - W;
                let multiple = row[p] * inverse[before];
                for s in 0..W {
                    row[p + 1 + s] -= multiple * upper[before][s];
                }
                left[p] = multiple;
            }
            let pivot = row[W];
            // NaN fails the comparison too.
            if !(pivot.value().abs() > 0.0 && pivot.value().is_finite()) {
                return Err(Singular { row: i });
            }
            let mut right = [zero; W];
            right.copy_from_slice(&row[W + 1..]);
            lower.push(left);
            upper.push(right);
            inverse.push(pivot.recip());
        }
        Ok(())
    }

    /// Number of negative pivots; odd if the determinant is negative.
    pub fn negative_pivots(&self) -> usize {
        self.inverse.iter().filter(|pivot| pivot.value() < 0.0).count()
    }

    /// Solves `A x = b` in place for `R` right-hand sides; `x` has the rows of the factored range only.
    pub fn solve<E: RightHandSide<D>, const R: usize>(&self, x: &mut [[E; R]]) {
        for i in 0..x.len() {
            for p in W.saturating_sub(i)..W {
                let known = x[i + p - W];
                for r in 0..R {
                    x[i][r] -= known[r] * self.lower[i][p];
                }
            }
        }
        for i in (0..x.len()).rev() {
            for p in 0..W.min(x.len() - 1 - i) {
                let known = x[i + 1 + p];
                for r in 0..R {
                    x[i][r] -= known[r] * self.upper[i][p];
                }
            }
            for r in 0..R {
                x[i][r] = x[i][r] * self.inverse[i];
            }
        }
    }
}
