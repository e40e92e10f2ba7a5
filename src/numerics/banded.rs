//! Symmetric band matrices and their LDL^T factors.
//!
//! The tangent of an open rod is a band: `W` entries below the diagonal, 5 in the plane. The
//! factorisation takes no pivots. It is backward stable when the matrix is positive definite; when
//! it is not, the number of negative pivots says so and the solution is checked by its
//! [residual](BandMatrix::residual).

use crate::numerics::scalar::Scalar;
use std::ops::Range;

/// `N` entries of `slice` from `start` on: one bounds check for all of them.
#[inline]
fn array<T, const N: usize>(slice: &[T], start: usize) -> &[T; N] {
    slice[start..].first_chunk().expect("the band has padding")
}

#[inline]
fn array_mut<T, const N: usize>(slice: &mut [T], start: usize) -> &mut [T; N] {
    slice[start..].first_chunk_mut().expect("the band has padding")
}

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
        let diagonal: &mut [D; N] = array_mut(&mut self.diagonal, start);
        let below: &mut [[D; W]; N] = array_mut(&mut self.below, start);
        for c in 0..N {
            diagonal[c] += block[c][c];
            for r in c + 1..N {
                below[c][r - c - 1] += block[r][c];
            }
        }
    }

    /// Adds the first `size` rows of the lower triangle of `block` from row and column `start` on.
    #[inline]
    pub fn add_corner<const N: usize>(&mut self, start: usize, size: usize, block: &[[D; N]; N]) {
        for c in 0..size {
            self.diagonal[start + c] += block[c][c];
            for r in c + 1..size {
                self.below[start + c][r - c - 1] += block[r][c];
            }
        }
    }

    /// Sets the columns `start .. start + C` from the lower triangle of `window`, whose first row
    /// and column are `start`; `N = W + 1`.
    #[inline]
    pub fn set_columns<const C: usize, const N: usize>(
        &mut self,
        start: usize,
        window: &[[D; N]; N],
    ) {
        let diagonal: &mut [D; C] = array_mut(&mut self.diagonal, start);
        let below: &mut [[D; W]; C] = array_mut(&mut self.below, start);
        for c in 0..C {
            diagonal[c] = window[c][c];
            below[c] = std::array::from_fn(|p| match window.get(c + 1 + p) {
                Some(row) => row[c],
                None => D::from(0.0),
            });
        }
    }

    /// Writes `|A| |x|` on the real parts: the size of the terms whose rounding errors limit how
    /// small a residual can become.
    pub fn absolute_product(&self, x: &[D], out: &mut [f64]) {
        let n = x.len();
        out[..n].fill(0.0);
        let (inner, rim) = self.below[..n].split_at(n.saturating_sub(W));
        for (j, column) in inner.iter().enumerate() {
            let xs: &[D; W] = array(x, j + 1);
            let (here, below) = out[j..].split_first_mut().expect("a row per unknown");
            let below: &mut [f64; W] = array_mut(below, 0);
            let xj = x[j].value().abs();
            let mut sum = self.diagonal[j].value().abs() * xj;
            for p in 0..W {
                let entry = column[p].value().abs();
                below[p] += entry * xj;
                sum += entry * xs[p].value().abs();
            }
            *here += sum;
        }
        for (j, column) in (inner.len()..).zip(rim) {
            out[j] += self.diagonal[j].value().abs() * x[j].value().abs();
            for (i, entry) in (j + 1..n).zip(column) {
                out[i] += entry.value().abs() * x[j].value().abs();
                out[j] += entry.value().abs() * x[i].value().abs();
            }
        }
    }

    /// Sets every entry to zero.
    pub fn clear(&mut self) {
        self.diagonal.fill(D::from(0.0));
        self.below.fill([D::from(0.0); W]);
    }

    /// Adds `factor` times `other`.
    pub fn add_scaled(&mut self, other: &Self, factor: f64) {
        for (to, from) in self.diagonal.iter_mut().zip(&other.diagonal) {
            *to += *from * factor;
        }
        for (to, from) in self.below.iter_mut().zip(&other.below) {
            for (to, from) in to.iter_mut().zip(from) {
                *to += *from * factor;
            }
        }
    }

    /// Adds column `j` times `x` to `out`.
    #[inline]
    pub fn add_column(&self, j: usize, x: D, out: &mut [D]) {
        out[j] += self.diagonal[j] * x;
        for (out, entry) in out[j + 1..].iter_mut().zip(&self.below[j]) {
            *out += *entry * x;
        }
        // Row j, left of the diagonal.
        for (p, i) in (j.saturating_sub(W)..j).rev().enumerate() {
            out[i] += self.below[i][p] * x;
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
        let Range { start, end } = self.range;
        let mut pivot = self.inverse_pivots[start];
        for j in start..end {
            let value = pivot.value();
            if value == 0.0 || !value.is_finite() {
                return Err(Singular { row: j });
            }
            self.negative_pivots += usize::from(value < 0.0);
            let inverse = pivot.recip();
            let column = self.lower[j];
            let scaled = column.map(|entry| entry * inverse);
            self.inverse_pivots[j] = inverse;
            self.lower[j] = scaled;
            let pivots: &mut [D; W] = array_mut(&mut self.inverse_pivots, j + 1);
            let columns: &mut [[D; W]; W] = array_mut(&mut self.lower, j + 1);
            // The next pivot waits for this one's inverse; its square is ready before that.
            pivot = pivots[0] - column[0] * column[0] * inverse;
            for p in 0..W {
                pivots[p] -= scaled[p] * column[p];
                for r in p + 1..W {
                    columns[p][r - p - 1] -= scaled[p] * column[r];
                }
            }
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
        // The rows a column acts on stay in registers: row j + p in window[p].
        let row = |x: &[[D; R]], i: usize| x.get(i).copied().unwrap_or([D::from(0.0); R]);
        let mut window: [[D; R]; W] = std::array::from_fn(|p| row(x, start + p));
        for j in start..end {
            let xj = window[0];
            let column = &self.lower[j];
            let entering = row(x, j + W);
            for p in 0..W {
                let next = if p + 1 < W { window[p + 1] } else { entering };
                for r in 0..R {
                    window[p][r] = next[r] - column[p] * xj[r];
                }
            }
            x[j] = xj;
        }
        // Row j + 1 + p in window[p].
        let mut window = [[D::from(0.0); R]; W];
        for j in (start..end).rev() {
            let (pivot, column) = (self.inverse_pivots[j], &self.lower[j]);
            let mut sum = x[j].map(|xr| xr * pivot);
            // The far rows first: they are known earliest, which shortens the dependency chain.
            for p in (0..W).rev() {
                for r in 0..R {
                    sum[r] -= column[p] * window[p][r];
                }
            }
            for p in (1..W).rev() {
                window[p] = window[p - 1];
            }
            window[0] = sum;
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
            a.add_block(
                j,
                &[
                    [3.0 + shift, v(0), v(1), v(2)],
                    [v(0), 2.0, v(3), v(4)],
                    [v(1), v(3), 1.0, v(5)],
                    [v(2), v(4), v(5), 1.0],
                ],
            );
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
        for shift in [0.0, -2.9, -6.1, -20.0] {
            let a = matrix(12, shift);
            let dense = nalgebra::DMatrix::from_fn(12, 12, |i, j| a.get(i, j));
            let negative = dense.symmetric_eigenvalues().iter().filter(|l| **l < 0.0).count();
            let mut ldlt = Ldlt::with_order(12);
            ldlt.factor(&a, 0..12).unwrap();
            assert_eq!(ldlt.negative_pivots(), negative);
        }
    }

    #[test]
    fn solves_as_faer_does() {
        use faer::linalg::solvers::Solve;
        for shift in [0.0, -2.9, -20.0] {
            let a = matrix(40, shift);
            let mut ldlt = Ldlt::with_order(40);
            ldlt.factor(&a, 0..40).unwrap();
            let b: Vec<f64> = (0..40).map(|i| 1.0 / (1.0 + i as f64)).collect();
            let mut x = b.clone();
            ldlt.solve(&mut x);
            let dense = faer::Mat::from_fn(40, 40, |i, j| a.get(i, j));
            let oracle = dense.partial_piv_lu().solve(faer::Mat::from_fn(40, 1, |i, _| b[i]));
            for i in 0..40 {
                assert!((x[i] - oracle[(i, 0)]).abs() < 1e-12 * oracle.norm_max(), "{shift} {i}");
            }
        }
    }

    #[test]
    fn absolute_product_takes_every_entry() {
        let a = matrix(12, -6.1);
        let x: Vec<f64> = (0..12).map(|i| (i as f64).cos()).collect();
        let mut found = vec![0.0; 12];
        a.absolute_product(&x, &mut found);
        for i in 0..12 {
            let sum: f64 = (0..12).map(|j| (a.get(i, j) * x[j]).abs()).sum();
            assert!((found[i] - sum).abs() < 1e-14);
        }
    }

    #[test]
    fn columns_add_up_to_the_product() {
        let a = matrix(12, -6.1);
        let x: Vec<f64> = (0..12).map(|i| (i as f64).cos()).collect();
        let mut found = vec![1.0; 12];
        for j in 0..12 {
            a.add_column(j, x[j], &mut found);
        }
        for i in 0..12 {
            let sum: f64 = (0..12).map(|j| a.get(i, j) * x[j]).sum();
            assert!((found[i] - 1.0 - sum).abs() < 1e-13);
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
