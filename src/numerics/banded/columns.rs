//! Columns of band matrices in the order of their elimination: from both ends at once, or from the first row.
//!
//! [`WeightedSum`] is the matrix `scale diag(masses) + factor matrix` of a time step over a range of rows; it is never
//! formed. Its [`EndColumns`] are the first columns from the top and, mirrored, the last ones from the bottom, for an
//! elimination from both ends. A `BandMatrix` provides its own columns, for the rows in the middle. `Elimination` reads
//! both as a [`ColumnSource`]: column `k` is the diagonal entry and the `W` entries below it. The stored lower triangle
//! alone is read: matrices are symmetric.

use crate::numerics::banded::elimination::{BandColumn, ColumnSource};
use crate::numerics::banded::{BandMatrix, array};
use crate::numerics::scalar::Scalar;

/// The matrix `scale diag(masses) + factor matrix` over the rows and columns from `start` to `end`.
#[derive(Clone, Copy)]
pub(super) struct WeightedSum<'a, D, const W: usize> {
    /// One number per row of the matrix, up to `end`.
    pub masses: &'a [D],
    pub scale: D,
    pub matrix: &'a BandMatrix<D, W>,
    pub factor: D,
    /// First row and column.
    pub start: usize,
    /// Row and column after the last.
    pub end: usize,
}

impl<'a, D: Scalar, const W: usize> WeightedSum<'a, D, W> {
    /// The diagonal entry of row and column `j`, `scale masses[j] + factor A_jj`.
    #[inline(always)]
    pub fn diagonal(&self, j: usize) -> D {
        self.masses[j] * self.scale + self.matrix.diagonal[j] * self.factor
    }

    /// A source of columns of this matrix, `scale diag(masses) + factor matrix`, for an elimination from both ends. The
    /// first band has the first `n` columns from the top, with the entries below the diagonal. The second has the last
    /// `n` rows from the bottom, with the entries left of it. Masses and matrix are borrowed; entries are computed when
    /// they are read.
    #[inline(always)]
    pub fn end_columns(&self, n: usize) -> EndColumns<'a, D, W> {
        let BandMatrix { diagonal, below, .. } = self.matrix;
        let (top, bottom) = (self.start..self.start + n, self.end - n..self.end);
        EndColumns {
            scale: self.scale,
            factor: self.factor,
            diagonal: [&diagonal[top.clone()], &diagonal[bottom.clone()]],
            masses: [&self.masses[top.clone()], &self.masses[bottom.clone()]],
            down: &below[top],
            // Row `j` left of the diagonal is in the columns `j - W` to `j - 1`, by symmetry.
            left: if n == 0 { &[] } else { &below[bottom.start - W..self.end] },
        }
    }
}

/// The first `n` columns of a [`WeightedSum`] from the first row downwards and from the last upwards.
pub(super) struct EndColumns<'a, D, const W: usize> {
    /// Factor on the masses.
    scale: D,
    /// Factor on the matrix.
    factor: D,
    /// The diagonal of the columns at the top and of those at the bottom; `masses` likewise.
    diagonal: [&'a [D]; 2],
    masses: [&'a [D]; 2],
    /// The entries below the diagonal of the columns at the top.
    down: &'a [[D; W]],
    /// The entries below the diagonal of the columns at the bottom and of the `W` columns before these.
    left: &'a [[D; W]],
}

impl<D: Scalar, const W: usize> ColumnSource<D, W, 2> for EndColumns<'_, D, W> {
    /// Two bands: column `k` from the top with the entries below its diagonal, and row `k` from the bottom with the
    /// entries left of its diagonal.
    #[inline(always)]
    fn column(&self, k: usize) -> BandColumn<D, W, 2> {
        let up = self.down.len() - 1 - k;
        // Below the diagonal of a column, and left of the diagonal of a row.
        let (down, left): (_, &[[D; W]; W]) = (&self.down[k], array(self.left, up));
        let mut below = [[D::from(0.0); 2]; W];
        for p in 0..W {
            below[p] = [down[p] * self.factor, left[W - 1 - p][p] * self.factor];
        }
        let (diagonal, masses) = (&self.diagonal, &self.masses);
        let diagonal = [
            masses[0][k] * self.scale + diagonal[0][k] * self.factor,
            masses[1][up] * self.scale + diagonal[1][up] * self.factor,
        ];
        BandColumn { diagonal, below }
    }
}

impl<D: Scalar, const W: usize> ColumnSource<D, W, 1> for BandMatrix<D, W> {
    /// Column `k` of the matrix as one band: its diagonal entry and the entries below it.
    #[inline(always)]
    fn column(&self, k: usize) -> BandColumn<D, W, 1> {
        let mut below = [[D::from(0.0)]; W];
        for p in 0..W {
            below[p] = [self.below[k][p]];
        }
        BandColumn { diagonal: [self.diagonal[k]], below }
    }
}
