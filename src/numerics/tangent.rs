//! Traits of a symmetric sparse matrix (a tangent: the second derivatives of an energy) and of its `L D L^T` factors.
//!
//! The tangent of one open rod is a [band](crate::numerics::banded::BandMatrix). [`Tangent`] has assembly, products and
//! residuals. [`Factors`] factors the rows and columns of a range, without row exchanges: of the matrix, or of
//! `scale diag(d) + factor matrix`. It solves for several right-hand sides in place (rows outside of the range become
//! zero) and counts negative pivots, which are as many as negative eigenvalues. [`UnsymmetricTangent`] also takes
//! blocks that are not symmetric; then the number of negative pivots has no such meaning. A pivot that is zero or not
//! finite is the error [`Singular`] with its row. Steppers, equilibria, modes and sensitivities use only these traits,
//! so that other sparsity patterns need no change there.

use crate::numerics::scalar::Scalar;
use std::fmt::Debug;
use std::ops::{Mul, Range};

/// A number of the right-hand side of a system with matrix entries `D`: a `D`, or a number with derivatives beside
/// `f64` entries.
pub trait RightHandSide<D>: Scalar + Mul<D, Output = Self> {}

impl<D, E: Scalar + Mul<D, Output = E>> RightHandSide<D> for E {}

/// A symmetric matrix `A` with a fixed sparsity pattern.
pub trait Tangent<D: Scalar>: Clone + Debug + Send + Sync {
    /// Approximate number of stored entries per row.
    const NUMBERS_PER_ROW: usize;
    /// The factors of such a matrix.
    type Factors: Factors<D, Matrix = Self>;

    /// Factors for matrices of this sparsity pattern, allocated and not yet computed.
    fn new_factors(&self) -> Self::Factors;

    /// The entry of row `i`, column `j`, in either triangle; zero outside the pattern.
    fn get(&self, i: usize, j: usize) -> D;

    /// A range that contains all rows with an entry in column `j` of the matrix, whose order is `n`. It may contain
    /// others.
    fn coupled(&self, j: usize, n: usize) -> Range<usize>;

    /// Adds the leading `size` by `size` part of the symmetric `block` to the entries from row and column `start` on;
    /// only its lower triangle is read.
    fn add_corner<const N: usize>(&mut self, start: usize, size: usize, block: &[[D; N]; N]);

    /// Replaces row and column `i` by those of the identity: zeros, and one on the diagonal.
    fn eliminate_row_and_column(&mut self, i: usize);

    /// Sets every entry to zero.
    fn clear(&mut self);

    /// Adds `factor` times `other`, a matrix of the same sparsity pattern.
    fn add_scaled(&mut self, other: &Self, factor: f64);

    /// Adds `A e_j x[g]`, column `j` times a number, to vector `g` of `out`, for `G` vectors (`out[i][g]` is row `i` of
    /// vector `g`).
    fn add_column<const G: usize>(&self, j: usize, x: [D; G], out: &mut [[D; G]]);

    /// Adds `A x` to `out`, for `G` vectors (`x[i][g]` is row `i` of vector `g`).
    fn add_product<const G: usize>(&self, x: &[[D; G]], out: &mut [[D; G]]);

    /// Writes the product `A x` with one vector to `out`, which is overwritten.
    fn product(&self, x: &[D], out: &mut [D]) {
        out.fill(D::from(0.0));
        self.add_product(x.as_chunks::<1>().0, out.as_chunks_mut::<1>().0);
    }

    /// Writes the product of absolute values, `|A| |x|` of the real parts, or an upper bound of it, to `out`: rounding
    /// errors of `A x` are proportional to it.
    fn absolute_product(&self, x: &[D], out: &mut [f64]);

    /// The residual `b - A x`, one number per row of `range`, from its first row on. `x` and `b` are indexed like the
    /// whole matrix; unknowns outside of the range count as zero.
    fn residual(&self, range: Range<usize>, x: &[D], b: &[D]) -> Vec<D> {
        let row = |i: usize| {
            let coupled = self.coupled(i, range.end);
            let columns = coupled.start.max(range.start)..coupled.end;
            columns.fold(b[i], |sum, j| sum - self.get(i, j) * x[j])
        };
        range.clone().map(row).collect()
    }
}

/// A [`Tangent`] to which blocks that are not symmetric can be added, as those of loads without a potential.
pub trait UnsymmetricTangent<D: Scalar>: Tangent<D> {
    /// Adds the leading `size` by `size` part of `block`, both triangles, to the entries from row and column `start`
    /// on.
    fn add_unsymmetric<const N: usize>(&mut self, start: usize, size: usize, block: &[[D; N]; N]);

    /// Whether no such block was added since the matrix was made or cleared.
    fn is_symmetric(&self) -> bool;
}

/// A [`Tangent`] whose sparsity pattern follows from its order.
pub trait PatternByOrder<D: Scalar>: Tangent<D> {
    /// The zero matrix of `n` rows.
    fn zeros(n: usize) -> Self;
}

/// The factors `L D L^T` of a range of rows and columns of a [`Tangent`], without pivoting.
pub trait Factors<D: Scalar>: Clone + Debug + Send + Sync {
    /// Type of the factored matrices.
    type Matrix;

    /// Factors the rows and columns of `range` of the matrix (of an assembly all of them) and replaces earlier factors.
    /// A symmetric band matrix needs no allocation.
    ///
    /// # Errors
    /// The row of a pivot that is zero or not finite.
    fn factor(&mut self, matrix: &Self::Matrix, range: Range<usize>) -> Result<(), Singular>;

    /// Factors `scale diag(diagonal) + factor matrix` over `range` (of an assembly all of it) without forming it, and
    /// replaces earlier factors.
    ///
    /// # Errors
    /// As [`factor`](Self::factor).
    fn factor_sum(
        &mut self,
        diagonal: &[D],
        scale: D,
        matrix: &Self::Matrix,
        factor: D,
        range: Range<usize>,
    ) -> Result<(), Singular>;

    /// Number of negative pivots: that of negative eigenvalues of the factored matrix if it is symmetric (Sylvester's
    /// law of inertia).
    fn negative_pivots(&self) -> usize;

    /// Solves `A x = b` in place for `R` right-hand sides (`x[i][r]` is row `i` of number `r`), over the factored
    /// range. `x` has as many rows as the matrix; rows outside of the range become zero.
    fn solve_many<E: RightHandSide<D>, const R: usize>(&self, x: &mut [[E; R]]);

    /// Solves `A x = b` in place for one right-hand side over the factored range. `x` has as many rows as the matrix;
    /// rows outside of the range become zero.
    fn solve<E: RightHandSide<D>>(&self, x: &mut [E]) {
        self.solve_many(x.as_chunks_mut::<1>().0);
    }
}

/// Error of a factorization: a pivot is zero or not finite.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the matrix is singular at row {row}")]
pub struct Singular {
    /// Row of that pivot.
    pub row: usize,
}
