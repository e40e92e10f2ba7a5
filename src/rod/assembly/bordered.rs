//! Tangent and factors of an assembly as enums: [`AssemblyTangent`], the second derivatives of its energy (N/m), and
//! [`AssemblyFactors`], in the plane or in space.
//!
//! Each has a bordered matrix: one band per rod, bordered by the rows of the bodies (module `tangent`), which does
//! every operation. Factorizations cover the whole matrix, whatever the requested range; the row of a pivot that is
//! zero or not finite is the error. In the steps of a simulation the matrix of the bodies may have unsymmetric blocks,
//! of rotating bodies in space. Products and entries leave these out, factorizations include them. Two matrices of
//! different layouts (plane, space) are an error in the program: sums then leave the matrix unchanged (a debug build
//! panics), and factorizations return [`Singular`] at row 0.

use crate::numerics::scalar::Scalar;
use crate::numerics::tangent::{Factors, RightHandSide, Singular, Tangent};
use crate::rod::assembly::tangent::{BorderedFactors, BorderedTangent};
use crate::rod::layout::{Layout, Plane, Space};
use std::ops::Range;

/// Second derivatives of the energy of a planar rod.
type PlanarBand<D> = <Plane as Layout<2, 1>>::Tangent<D>;
/// Second derivatives of the energy of a rod in space.
type SpatialBand<D> = <Space as Layout<3, 3>>::Tangent<D>;

/// The second derivatives of the energy of an assembly, N/m.
#[derive(Clone, Debug)]
pub enum AssemblyTangent<D: Scalar> {
    /// In a plane.
    Plane(BorderedTangent<D, PlanarBand<D>>),
    /// In space.
    Space(BorderedTangent<D, SpatialBand<D>>),
}

/// The factors of an [`AssemblyTangent`].
#[derive(Clone, Debug)]
pub enum AssemblyFactors<D: Scalar> {
    /// In a plane.
    Plane(BorderedFactors<D, PlanarBand<D>>),
    /// In space.
    Space(BorderedFactors<D, SpatialBand<D>>),
}

/// The expression for a matrix in the plane or in space.
macro_rules! of_either {
    ($type:ident, $own:expr, $matrix:ident => $value:expr) => {
        match $own {
            $type::Plane($matrix) => $value,
            $type::Space($matrix) => $value,
        }
    };
}

impl<D: Scalar> Tangent<D> for AssemblyTangent<D> {
    const NUMBERS_PER_ROW: usize = <SpatialBand<D> as Tangent<D>>::NUMBERS_PER_ROW;
    type Factors = AssemblyFactors<D>;

    /// Factors for matrices of this sparsity pattern, not yet computed.
    fn new_factors(&self) -> AssemblyFactors<D> {
        match self {
            Self::Plane(matrix) => AssemblyFactors::Plane(matrix.new_factors()),
            Self::Space(matrix) => AssemblyFactors::Space(matrix.new_factors()),
        }
    }

    /// The entry of row `i`, column `j`, in either triangle, without unsymmetric blocks; zero outside the pattern.
    fn get(&self, i: usize, j: usize) -> D {
        of_either!(Self, self, matrix => matrix.get(i, j))
    }

    /// A range with all rows that have an entry in column `j` of the matrix, whose order is `n`: all unknowns of the
    /// rod of the column if no body carries it, else all rows.
    fn coupled(&self, j: usize, n: usize) -> Range<usize> {
        of_either!(Self, self, matrix => matrix.coupled(j, n))
    }

    /// Adds the lower triangle of the leading `size` by `size` part of `block` from row and column `start` on, within
    /// one rod or within the coordinates of bodies.
    fn add_corner<const N: usize>(&mut self, start: usize, size: usize, block: &[[D; N]; N]) {
        of_either!(Self, self, matrix => matrix.add_corner(start, size, block));
    }

    /// Replaces row and column `i` by those of the identity.
    fn eliminate_row_and_column(&mut self, i: usize) {
        of_either!(Self, self, matrix => matrix.eliminate_row_and_column(i));
    }

    /// Sets every entry to zero and removes unsymmetric blocks.
    fn clear(&mut self) {
        of_either!(Self, self, matrix => matrix.clear());
    }

    /// Adds `factor` times `other`, without its unsymmetric blocks. A matrix of the other layout changes nothing.
    fn add_scaled(&mut self, other: &Self, factor: f64) {
        match (self, other) {
            (Self::Plane(matrix), Self::Plane(other)) => matrix.add_scaled(other, factor),
            (Self::Space(matrix), Self::Space(other)) => matrix.add_scaled(other, factor),
            _ => debug_assert!(false, "a tangent of the other layout"),
        }
    }

    /// Adds `A e_j x[g]`, column `j` times a number, to vector `g` of `out` (`out[i][g]` is row `i`), for `G` vectors,
    /// without unsymmetric blocks.
    fn add_column<const G: usize>(&self, j: usize, x: [D; G], out: &mut [[D; G]]) {
        of_either!(Self, self, matrix => matrix.add_column(j, x, out));
    }

    /// Adds `A x` to `out`, for `G` vectors (`x[i][g]` is row `i` of vector `g`), without unsymmetric blocks.
    fn add_product<const G: usize>(&self, x: &[[D; G]], out: &mut [[D; G]]) {
        of_either!(Self, self, matrix => matrix.add_product(x, out));
    }

    /// Overwrites `out` with `|A| |x|` of the real parts: rounding errors of `A x` are proportional to it.
    fn absolute_product(&self, x: &[D], out: &mut [f64]) {
        of_either!(Self, self, matrix => matrix.absolute_product(x, out));
    }
}

impl<D: Scalar> Factors<D> for AssemblyFactors<D> {
    type Matrix = AssemblyTangent<D>;

    /// Factors the whole matrix, whatever the `range`, and replaces earlier factors. An error has the row of a pivot
    /// that is zero or not finite, or row 0 for a matrix of the other layout.
    fn factor(&mut self, matrix: &AssemblyTangent<D>, range: Range<usize>) -> Result<(), Singular> {
        match (self, matrix) {
            (Self::Plane(factors), AssemblyTangent::Plane(matrix)) => factors.factor(matrix, range),
            (Self::Space(factors), AssemblyTangent::Space(matrix)) => factors.factor(matrix, range),
            // An error in the program, which ends as a failed factorization instead of wrong results.
            _ => Err(Singular { row: 0 }),
        }
    }

    /// Factors `scale diag(diagonal) + factor matrix` without forming it, whatever the `range`. Errors are those of
    /// `factor`.
    fn factor_sum(
        &mut self,
        diagonal: &[D],
        scale: D,
        matrix: &AssemblyTangent<D>,
        factor: D,
        range: Range<usize>,
    ) -> Result<(), Singular> {
        match (self, matrix) {
            (Self::Plane(factors), AssemblyTangent::Plane(matrix)) => {
                factors.factor_sum(diagonal, scale, matrix, factor, range)
            }
            (Self::Space(factors), AssemblyTangent::Space(matrix)) => {
                factors.factor_sum(diagonal, scale, matrix, factor, range)
            }
            _ => Err(Singular { row: 0 }),
        }
    }

    /// Number of negative pivots, which is that of negative eigenvalues of the factored matrix (Sylvester's law of
    /// inertia). It needs a matrix without unsymmetric blocks.
    fn negative_pivots(&self) -> usize {
        of_either!(Self, self, factors => factors.negative_pivots())
    }

    /// Solves `A x = b` in place for `R` right-hand sides (`x[i][r]` is row `i` of number `r`), over all rows.
    fn solve_many<E: RightHandSide<D>, const R: usize>(&self, x: &mut [[E; R]]) {
        of_either!(Self, self, factors => factors.solve_many(x));
    }
}
