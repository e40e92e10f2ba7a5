//! `L U` factors of an unsymmetric matrix with the symmetric pattern of an [envelope](Envelope): [`EnvelopeLu`].
//!
//! Such a matrix is a symmetric one plus a factor times 3 x 3 blocks on its diagonal ([`DiagonalBlock`]), which lie
//! inside the envelope. Implicit time steps with rotating bodies in space have one. With damping or friction of
//! contacts the triangles differ anywhere in the envelope (`add_to_upper`, `add`). `set` copies the matrix, `factor`
//! replaces it by `L` (unit diagonal) and `U`, and `solve` overwrites several right-hand sides by their solutions. The
//! elimination exchanges no rows and fills no entry outside the envelope. A pivot that is zero or not finite is an
//! error with its row. No exchanges are needed, since the mass matrix is positive definite, and the rest is small
//! beside it at reasonable steps.

use crate::numerics::envelope::Envelope;
use crate::numerics::rotation::Matrix3;
use crate::numerics::scalar::Scalar;
use crate::numerics::tangent::{RightHandSide, Singular};
use std::cmp::Ordering;

/// Three rows and columns on the diagonal, whose entries need not be symmetric.
#[derive(Clone, Copy, Debug)]
pub struct DiagonalBlock<D> {
    /// First row and column.
    pub start: usize,
    /// The entries by rows.
    pub entries: Matrix3<D>,
}

/// An unsymmetric matrix after `set`, and its factors `L U` after `factor`; `L` has a unit diagonal.
#[derive(Clone, Debug)]
pub struct EnvelopeLu<D> {
    /// First column of every row, and first row of every column.
    first: Vec<usize>,
    /// Rows of `L` from the first column to the one before the diagonal.
    lower: Vec<Vec<D>>,
    /// Columns of `U` from the first row to the one before the diagonal.
    upper: Vec<Vec<D>>,
    /// Diagonal of the matrix, or of `U` once it is factored.
    diagonal: Vec<D>,
}

impl<D> Default for EnvelopeLu<D> {
    /// An empty matrix without rows.
    fn default() -> Self {
        Self { first: Vec::new(), lower: Vec::new(), upper: Vec::new(), diagonal: Vec::new() }
    }
}

impl<D: Scalar> EnvelopeLu<D> {
    /// Overwrites this matrix with the symmetric `matrix` plus `factor` times the `blocks`, which lie inside its
    /// envelope. It is not yet factored.
    pub fn set(&mut self, matrix: &Envelope<D>, blocks: &[DiagonalBlock<D>], factor: D) {
        let n = matrix.order();
        self.first.clear();
        self.first.extend((0..n).map(|i| matrix.first(i)));
        for entries in [&mut self.lower, &mut self.upper] {
            entries.resize(n, Vec::new());
            for (i, row) in entries.iter_mut().enumerate() {
                row.clear();
                row.extend((matrix.first(i)..i).map(|j| matrix.get(i, j)));
            }
        }
        self.diagonal.clear();
        self.diagonal.extend((0..n).map(|i| matrix.get(i, i)));
        // Entries of a block below the diagonal are in rows of `lower`, those above in columns of `upper`.
        for DiagonalBlock { start, entries } in blocks {
            for r in 0..3 {
                self.diagonal[start + r] += entries[r][r] * factor;
                for c in 0..r {
                    let at = start + c - self.first[start + r];
                    self.lower[start + r][at] += entries[r][c] * factor;
                    self.upper[start + r][at] += entries[c][r] * factor;
                }
            }
        }
    }

    /// Adds `factor` times the entries of `differences` below the diagonal to those at the transposed places, in the
    /// upper triangle. Its envelope is that of this matrix, which is not yet factored.
    pub fn add_to_upper(&mut self, differences: &Envelope<D>, factor: D) {
        differences.for_each(|i, j, entry| {
            if j < i {
                self.upper[i][j - self.first[i]] += entry * factor;
            }
        });
    }

    /// Adds `entry` to that of row `i`, column `j`, in either triangle inside the envelope. The matrix is not yet
    /// factored.
    pub fn add(&mut self, i: usize, j: usize, entry: D) {
        match i.cmp(&j) {
            Ordering::Equal => self.diagonal[i] += entry,
            Ordering::Greater => self.lower[i][j - self.first[i]] += entry,
            Ordering::Less => self.upper[j][i - self.first[j]] += entry,
        }
    }

    /// Replaces the matrix that was [`set`](Self::set) by its factors `L U`, row by row without pivoting.
    ///
    /// # Errors
    /// The row of a pivot that is zero or not finite; the matrix is then partly overwritten.
    pub fn factor(&mut self) -> Result<(), Singular> {
        for i in 0..self.diagonal.len() {
            let first = self.first[i];
            let (lower_before, lower) = self.lower.split_at_mut(i);
            let (upper_before, upper) = self.upper.split_at_mut(i);
            let (row, column) = (&mut lower[0], &mut upper[0]);
            let mut pivot = self.diagonal[i];
            for j in first..i {
                let own = self.first[j];
                // Row i of L and column i of U together, from the rows and columns before (Doolittle).
                let (mut left, mut right) = (row[j - first], column[j - first]);
                for k in first.max(own)..j {
                    left -= row[k - first] * upper_before[j][k - own];
                    right -= lower_before[j][k - own] * column[k - first];
                }
                left /= self.diagonal[j];
                pivot -= left * right;
                (row[j - first], column[j - first]) = (left, right);
            }
            // NaN fails the comparison too.
            if !(pivot.value().abs() > 0.0 && pivot.value().is_finite()) {
                return Err(Singular { row: i });
            }
            self.diagonal[i] = pivot;
        }
        Ok(())
    }

    /// Solves `A x = b` in place for `R` right-hand sides (`x[i][r]` is row `i` of number `r`), with the factors of
    /// `A`.
    pub fn solve<E: RightHandSide<D>, const R: usize>(&self, x: &mut [[E; R]]) {
        // Forward with L, whose diagonal is one.
        for i in 0..self.diagonal.len() {
            for (k, entry) in self.lower[i].iter().enumerate() {
                for r in 0..R {
                    let known = x[self.first[i] + k][r];
                    x[i][r] -= known * *entry;
                }
            }
        }
        // Backward with U, stored by columns: each solved row is subtracted from those above it.
        for i in (0..self.diagonal.len()).rev() {
            let by_pivot = self.diagonal[i].recip();
            (0..R).for_each(|r| x[i][r] = x[i][r] * by_pivot);
            for (k, entry) in self.upper[i].iter().enumerate() {
                for r in 0..R {
                    let known = x[i][r];
                    x[self.first[i] + k][r] -= known * *entry;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Blocks, differences of the triangles and single entries. Oracle: the dense LU factors of nalgebra.
    #[test]
    fn solution_agrees_with_that_of_the_dense_matrix() {
        let first = vec![0, 0, 0, 2, 1, 3, 3, 3];
        let mut matrix = Envelope::zeros(first.clone());
        for (i, first) in first.into_iter().enumerate() {
            for j in first..i {
                matrix.add(i, j, ((i * 7 + j * 5) % 9) as f64 / 9.0 - 0.45);
            }
            matrix.add(i, i, 3.0 + (i % 3) as f64);
        }
        let block = |start: usize, shift: f64| DiagonalBlock {
            start,
            entries: [0, 1, 2]
                .map(|r| [0, 1, 2].map(|c| (shift + 3.0 * r as f64 - c as f64).sin())),
        };
        let blocks = [block(0, 0.3), block(5, 1.1)];
        let mut dense = nalgebra::DMatrix::from_fn(8, 8, |i, j| matrix.get(i, j));
        for block in &blocks {
            for r in 0..3 {
                for c in 0..3 {
                    dense[(block.start + r, block.start + c)] += 0.7 * block.entries[r][c];
                }
            }
        }
        let mut factors = EnvelopeLu::default();
        factors.set(&matrix, &blocks, 0.7);
        let mut differences = matrix.clone();
        differences.set_scaled(&matrix, 0.5);
        factors.add_to_upper(&differences, 0.4);
        for i in 0..8 {
            (0..i).for_each(|j| dense[(j, i)] += 0.2 * matrix.get(i, j));
        }
        for (i, j, entry) in [(4, 2, 0.3), (2, 4, -0.2), (5, 5, 0.4)] {
            factors.add(i, j, entry);
            dense[(i, j)] += entry;
        }
        factors.factor().unwrap();
        let b: Vec<[f64; 1]> = (0..8).map(|i| [(1.7 * i as f64).cos()]).collect();
        let mut x = b.clone();
        factors.solve(&mut x);
        let right = nalgebra::DVector::from_fn(8, |i, _| b[i][0]);
        let expected = dense.lu().solve(&right).unwrap();
        assert!((0..8).all(|i| (x[i][0] - expected[i]).abs() < 1e-13), "{x:?} {expected}");
    }
}
