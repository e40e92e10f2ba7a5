//! Symmetric band matrices and their LDL^T factors.
//!
//! The tangent of an open rod is a band: `W` entries below the diagonal, 5 in the plane. The
//! factorisation takes no pivots. It is backward stable when the matrix is positive definite; when
//! it is not, the number of negative pivots says so and [`Ldlt::solve`]'s caller can look at
//! [`BandMatrix::residual`].

use crate::scalar::Scalar;
use std::ops::Range;

/// A symmetric matrix of half-bandwidth `W`, stored by columns from the diagonal down.
#[derive(Clone, Debug)]
pub struct BandMatrix<D, const W: usize> {
    diagonal: Vec<D>,
    /// `below[j][p]` is the entry of row `j + 1 + p`, column `j`.
    below: Vec<[D; W]>,
}

impl<D: Scalar, const W: usize> BandMatrix<D, W> {
    /// The zero matrix of `n` rows.
    pub fn zeros(n: usize) -> Self {
        // W rows of padding, so that inner loops need not look at the end.
        Self { diagonal: vec![D::from(0.0); n + W], below: vec![[D::from(0.0); W]; n + W] }
    }

    /// Number of rows.
    pub fn order(&self) -> usize {
        self.diagonal.len() - W
    }

    /// Sets every entry to zero.
    pub fn clear(&mut self) {
        self.diagonal.fill(D::from(0.0));
        self.below.fill([D::from(0.0); W]);
    }

    /// The entry of row `i`, column `j`; zero outside the band.
    pub fn get(&self, i: usize, j: usize) -> D {
        let (low, high) = (i.min(j), i.max(j));
        match high - low {
            0 => self.diagonal[low],
            d if d <= W => self.below[low][d - 1],
            _ => D::from(0.0),
        }
    }

    /// Adds the lower triangle of the symmetric `block` at the diagonal position `start`;
    /// `N <= W + 1`.
    #[inline]
    pub fn add_block<const N: usize>(&mut self, start: usize, block: &[[D; N]; N]) {
        let diagonal = &mut self.diagonal[start..start + N];
        let below = &mut self.below[start..start + N];
        for c in 0..N {
            diagonal[c] += block[c][c];
            for r in c + 1..N {
                below[c][r - c - 1] += block[r][c];
            }
        }
    }

    /// Becomes `diag(diagonal) * scale + factor * other`.
    #[inline]
    pub fn set_sum(&mut self, diagonal: &[D], scale: D, other: &Self, factor: D) {
        for ((to, from), m) in self.diagonal.iter_mut().zip(&other.diagonal).zip(diagonal) {
            *to = *m * scale + *from * factor;
        }
        for (to, from) in self.below.iter_mut().zip(&other.below) {
            *to = from.map(|b| b * factor);
        }
    }

    /// Writes `|A| |x|` on the real parts: the size of the terms whose rounding errors limit how
    /// small a residual can become.
    pub fn absolute_product(&self, x: &[D], out: &mut [f64]) {
        let n = x.len();
        out[..n].fill(0.0);
        for j in 0..n {
            let xj = x[j].value().abs();
            out[j] += self.diagonal[j].value().abs() * xj;
            for (p, entry) in self.below[j].iter().enumerate().take(n - 1 - j) {
                let entry = entry.value().abs();
                out[j + 1 + p] += entry * xj;
                out[j] += entry * x[j + 1 + p].value().abs();
            }
        }
    }

    /// `b - A x` over the rows and columns of `range`, other unknowns taken as zero.
    pub fn residual(&self, range: Range<usize>, x: &[D], b: &[D]) -> Vec<D> {
        let mut r: Vec<D> = range.clone().map(|i| b[i]).collect();
        for j in range.clone() {
            r[j - range.start] -= self.diagonal[j] * x[j];
            for (p, &entry) in self.below[j].iter().enumerate() {
                let i = j + 1 + p;
                if i < range.end {
                    r[i - range.start] -= entry * x[j];
                    r[j - range.start] -= entry * x[i];
                }
            }
        }
        r
    }
}

/// The factors L D L^T of a [`BandMatrix`], restricted to a range of its rows and columns.
#[derive(Clone, Debug)]
pub struct Ldlt<D, const W: usize> {
    inverse_pivots: Vec<D>,
    lower: Vec<[D; W]>,
    range: Range<usize>,
    negative_pivots: usize,
}

/// A pivot of the factorisation is zero or not a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the matrix is singular at row {row}")]
pub struct Singular {
    /// Row of the pivot.
    pub row: usize,
}

impl<D: Scalar, const W: usize> Ldlt<D, W> {
    /// Room for the factors of matrices of `n` rows.
    pub fn with_order(n: usize) -> Self {
        Self {
            inverse_pivots: vec![D::from(0.0); n + W],
            lower: vec![[D::from(0.0); W]; n + W],
            range: 0..0,
            negative_pivots: 0,
        }
    }

    /// Factors the rows and columns of `range`; allocates nothing.
    pub fn factor(
        &mut self,
        matrix: &BandMatrix<D, W>,
        range: Range<usize>,
    ) -> Result<(), Singular> {
        self.load(matrix, range, |_, d| d, |b| b)
    }

    /// Factors `diag(diagonal) * scale + factor * matrix` over `range` without forming it.
    #[inline]
    pub fn factor_sum(
        &mut self,
        diagonal: &[D],
        scale: D,
        matrix: &BandMatrix<D, W>,
        factor: D,
        range: Range<usize>,
    ) -> Result<(), Singular> {
        self.load(matrix, range, |j, d| diagonal[j] * scale + d * factor, |b| b * factor)
    }

    #[inline]
    fn load(
        &mut self,
        matrix: &BandMatrix<D, W>,
        range: Range<usize>,
        diagonal: impl Fn(usize, D) -> D,
        below: impl Fn(D) -> D,
    ) -> Result<(), Singular> {
        for j in range.clone() {
            self.inverse_pivots[j] = diagonal(j, matrix.diagonal[j]);
            self.lower[j] = matrix.below[j].map(&below);
        }
        // Nothing couples to what lies beyond the range.
        for j in range.end.saturating_sub(W).max(range.start)..range.end {
            self.lower[j][range.end - 1 - j..].fill(D::from(0.0));
        }
        self.range = range;
        self.eliminate()
    }

    fn eliminate(&mut self) -> Result<(), Singular> {
        self.negative_pivots = 0;
        for j in self.range.clone() {
            let pivot = self.inverse_pivots[j];
            let value = pivot.value();
            if value == 0.0 || !value.is_finite() {
                return Err(Singular { row: j });
            }
            self.negative_pivots += usize::from(value < 0.0);
            let inverse = pivot.recip();
            let column = self.lower[j];
            let scaled = column.map(|entry| entry * inverse);
            let pivots = &mut self.inverse_pivots[j + 1..j + 1 + W];
            let columns = &mut self.lower[j + 1..j + 1 + W];
            for p in 0..W {
                pivots[p] -= scaled[p] * column[p];
                for r in p + 1..W {
                    columns[p][r - p - 1] -= scaled[p] * column[r];
                }
            }
            self.inverse_pivots[j] = inverse;
            self.lower[j] = scaled;
        }
        Ok(())
    }

    /// Number of negative eigenvalues of the factored matrix (Sylvester's law of inertia).
    pub fn negative_pivots(&self) -> usize {
        self.negative_pivots
    }

    /// Solves `A x = b` in place for `R` right-hand sides side by side, over the factored range;
    /// `x` has as many rows as the matrix, and rows outside the range become zero.
    #[inline]
    pub fn solve_many<const R: usize>(&self, x: &mut [[D; R]]) {
        let Range { start, end } = self.range;
        x[..start].fill([D::from(0.0); R]);
        x[end..].fill([D::from(0.0); R]);
        let middle = end.saturating_sub(W).max(start);
        for j in start..middle {
            let xj = x[j];
            let rows = &mut x[j + 1..j + 1 + W];
            for p in 0..W {
                for r in 0..R {
                    rows[p][r] -= self.lower[j][p] * xj[r];
                }
            }
        }
        for j in middle..end {
            let xj = x[j];
            for p in 0..end - 1 - j {
                for r in 0..R {
                    x[j + 1 + p][r] -= self.lower[j][p] * xj[r];
                }
            }
        }
        for j in (middle..end).rev() {
            for r in 0..R {
                let mut sum = x[j][r] * self.inverse_pivots[j];
                for p in 0..end - 1 - j {
                    sum -= self.lower[j][p] * x[j + 1 + p][r];
                }
                x[j][r] = sum;
            }
        }
        for j in (start..middle).rev() {
            let mut sum = x[j].map(|xr| xr * self.inverse_pivots[j]);
            let rows = &x[j + 1..j + 1 + W];
            // The far rows first: they are known earliest, which shortens the dependency chain.
            for p in (0..W).rev() {
                for r in 0..R {
                    sum[r] -= self.lower[j][p] * rows[p][r];
                }
            }
            x[j] = sum;
        }
    }

    /// Solves `A x = b` in place for one right-hand side.
    #[inline]
    pub fn solve(&self, x: &mut [D]) {
        self.solve_many(x.as_chunks_mut::<1>().0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A fixed, diagonally dominant or indefinite, matrix.
    fn matrix(n: usize, shift: f64) -> BandMatrix<f64, 3> {
        let mut a = BandMatrix::zeros(n);
        for j in 0..n - 3 {
            let v = |k: usize| ((j * 7 + k * 3) % 11) as f64 / 11.0 - 0.4;
            a.add_block(j, &[
                [3.0 + shift, v(0), v(1), v(2)],
                [v(0), 2.0, v(3), v(4)],
                [v(1), v(3), 1.0, v(5)],
                [v(2), v(4), v(5), 1.0],
            ]);
        }
        a
    }

    #[test]
    fn solves_over_a_range_and_leaves_the_rest_zero() {
        let a = matrix(20, 0.0);
        let b: Vec<f64> = (0..20).map(|i| (i as f64).sin()).collect();
        for range in [0..20, 4..20, 4..16, 7..9, 5..6] {
            let mut ldlt = Ldlt::with_order(20);
            ldlt.factor(&a, range.clone()).unwrap();
            let mut x = b.clone();
            ldlt.solve(&mut x);
            assert!(a.residual(range.clone(), &x, &b).iter().all(|r| r.abs() < 1e-14));
            assert!((0..20).filter(|i| !range.contains(i)).all(|i| x[i] == 0.0));
        }
    }

    #[test]
    fn many_right_hand_sides_are_each_the_single_solution() {
        let a = matrix(20, 0.0);
        let mut ldlt = Ldlt::with_order(20);
        ldlt.factor(&a, 2..19).unwrap();
        let mut both: Vec<[f64; 2]> = (0..20).map(|i| [i as f64, 1.0 / (1.0 + i as f64)]).collect();
        let mut single: Vec<f64> = both.iter().map(|b| b[1]).collect();
        ldlt.solve_many(&mut both);
        ldlt.solve(&mut single);
        assert!(both.iter().zip(&single).all(|(b, s)| b[1] == *s));
    }

    #[test]
    fn negative_pivots_count_negative_eigenvalues() {
        for shift in [0.0, -3.0, -6.0, -20.0] {
            let a = matrix(12, shift);
            let dense = nalgebra::DMatrix::from_fn(12, 12, |i, j| a.get(i, j));
            let negative = dense.symmetric_eigenvalues().iter().filter(|l| **l < 0.0).count();
            let mut ldlt = Ldlt::with_order(12);
            ldlt.factor(&a, 0..12).unwrap();
            assert_eq!(ldlt.negative_pivots(), negative);
        }
    }

    #[test]
    fn a_singular_matrix_is_an_error() {
        let mut ldlt = Ldlt::<f64, 3>::with_order(8);
        assert_eq!(ldlt.factor(&BandMatrix::zeros(8), 2..8), Err(Singular { row: 2 }));
        let mut a = matrix(8, 0.0);
        a.add_block(3, &[[f64::NAN]]);
        assert!(ldlt.factor(&a, 0..8).is_err());
    }
}
