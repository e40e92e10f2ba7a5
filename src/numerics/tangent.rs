//! Symmetric matrices of second derivatives, and their factors, whatever the pattern of their entries.
//!
//! The tangent of one open rod is a [band](crate::numerics::banded::BandMatrix). A structure of several rods has
//! another pattern. Steppers, equilibria, modes and sensitivities use these two traits only.

use crate::numerics::scalar::Scalar;
use std::fmt::Debug;
use std::ops::{Mul, Range};

/// A right-hand side of a system whose matrix has entries `D`: the same numbers, or numbers with derivatives.
pub trait RightHandSide<D>: Scalar + Mul<D, Output = Self> {}

impl<D, E: Scalar + Mul<D, Output = E>> RightHandSide<D> for E {}

/// A symmetric matrix `A` with a fixed pattern of entries.
pub trait Tangent<D: Scalar>: Clone + Debug + Send + Sync {
    /// How many numbers are stored for each row, about.
    const NUMBERS_PER_ROW: usize;
    /// The factors of such a matrix.
    type Factors: Factors<D, Matrix = Self>;

    /// The zero matrix of `n` rows.
    fn zeros(n: usize) -> Self;

    /// The entry of row `i`, column `j`; zero outside the pattern.
    fn get(&self, i: usize, j: usize) -> D;

    /// The rows, of `n`, that may have an entry in column `j`.
    fn coupled(j: usize, n: usize) -> Range<usize>;

    /// Adds the first `size` rows of the lower triangle of `block` from row and column `start` on.
    fn add_corner<const N: usize>(&mut self, start: usize, size: usize, block: &[[D; N]; N]);

    /// Makes row and column `i` those of the identity.
    fn uncouple(&mut self, i: usize);

    /// Sets every entry to zero.
    fn clear(&mut self);

    /// Adds `factor` times `other`.
    fn add_scaled(&mut self, other: &Self, factor: f64);

    /// Adds column `j` times each of `x` to `out`.
    fn add_column<const G: usize>(&self, j: usize, x: [D; G], out: &mut [[D; G]]);

    /// Adds `A` times each of `x` to `out`.
    fn add_product<const G: usize>(&self, x: &[[D; G]], out: &mut [[D; G]]);

    /// Writes `A x`.
    fn product(&self, x: &[D], out: &mut [D]);

    /// Writes `|A| |x|` on the real parts: the size of the terms whose rounding errors limit how
    /// small a residual can become.
    fn absolute_product(&self, x: &[D], out: &mut [f64]);

    /// `b - A x` over the rows and columns of `range`, other unknowns taken as zero.
    fn residual(&self, range: Range<usize>, x: &[D], b: &[D]) -> Vec<D>;
}

/// The factors `L D L^T` of a [`Tangent`], restricted to a range of its rows and columns.
pub trait Factors<D: Scalar>: Clone + Debug + Send + Sync {
    /// The matrices that are factored.
    type Matrix;

    /// Room for the factors of matrices of `n` rows.
    fn with_order(n: usize) -> Self;

    /// Factors the rows and columns of `range`; allocates nothing.
    ///
    /// # Errors
    /// The row of a pivot that is zero or not a number.
    fn factor(&mut self, matrix: &Self::Matrix, range: Range<usize>) -> Result<(), Singular>;

    /// Factors `diag(diagonal) * scale + factor * matrix` over `range` without forming it.
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

    /// Number of negative eigenvalues of the factored matrix (Sylvester's law of inertia).
    fn negative_pivots(&self) -> usize;

    /// Solves `A x = b` in place for `R` right-hand sides side by side, over the factored range;
    /// `x` has as many rows as the matrix, and rows outside the range become zero.
    fn solve_many<E: RightHandSide<D>, const R: usize>(&self, x: &mut [[E; R]]);

    /// Solves `A x = b` in place for one right-hand side.
    fn solve<E: RightHandSide<D>>(&self, x: &mut [E]) {
        self.solve_many(x.as_chunks_mut::<1>().0);
    }
}

/// A pivot of the factorization is zero or not a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the matrix is singular at row {row}")]
pub struct Singular {
    /// Row of the pivot.
    pub row: usize,
}
