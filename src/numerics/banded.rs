//! Band matrices of half-bandwidth `W`, symmetric in general, and their `L D L^T` factors, for the linear systems of a
//! rod.
//!
//! The tangent of an open rod is a band with `W = 5` in the plane and 10 in space. [`BandMatrix`] stores it by columns,
//! adds element blocks and multiplies it with vectors (as a [`Tangent`]). [`Ldlt`] factors a range of its rows and
//! solves. The factorization takes no pivots (no row exchanges); a pivot that is zero or not finite is an error with
//! its row. It is backward stable for positive definite matrices. For other symmetric matrices the number of negative
//! pivots is positive; callers check the solution by its [residual](Tangent::residual).
//!
//! Row by row, an elimination mostly waits for the previous pivot. Therefore it proceeds from both ends at once:
//! first row, last row, second row, and so on. The ends meet in `W` or `W + 1` rows in the middle, which come last.
//! This is `L D L^T` of the matrix with permuted rows and columns: equally stable, and with the same number of
//! negative pivots. The numbers of both ends are adjacent in memory, so that one vector instruction processes both.
//!
//! Blocks that are not symmetric (follower loads) add a second triangle: the differences of the upper triangle from the
//! transposed lower one (skew part). Such a matrix has factors `L U` instead.

mod columns;
mod elimination;
mod ldlt;
mod lu;
mod products;
mod substitution;

pub use ldlt::Ldlt;

use crate::numerics::scalar::Scalar;
use crate::numerics::simd::with_simd_if_wide;
use crate::numerics::tangent::{PatternByOrder, Tangent, UnsymmetricTangent};
use std::ops::Range;

/// The `N` entries of `slice` from index `start` on, as an array, with one bounds check for all. Panics if there are
/// fewer.
#[inline(always)]
fn array<T, const N: usize>(slice: &[T], start: usize) -> &[T; N] {
    slice[start..].first_chunk().expect("the band has padding")
}

/// The `N` mutable entries of `slice` from index `start` on, as an array, with one bounds check for all. Panics if
/// there are fewer.
#[inline(always)]
fn array_mut<T, const N: usize>(slice: &mut [T], start: usize) -> &mut [T; N] {
    slice[start..].first_chunk_mut().expect("the band has padding")
}

/// A square matrix whose entries are zero more than `W` places from the diagonal, stored by columns from the diagonal
/// down. It is symmetric where `skew` is empty.
#[derive(Clone, Debug)]
pub struct BandMatrix<D, const W: usize> {
    /// The diagonal, with `W` more zeros (padding), as the other lists.
    diagonal: Vec<D>,
    /// `below[j][p]` is the entry of row `j + 1 + p`, column `j`.
    below: Vec<[D; W]>,
    /// `skew[j][p]` is the entry of row `j`, column `j + 1 + p`, less `below[j][p]`; empty for a symmetric matrix.
    skew: Vec<[D; W]>,
}

/// The sum `out + A x` for `G` vectors, as work for a vector unit. A closure instead would be compiled without its
/// instructions.
struct Product<'a, D, const W: usize, const G: usize> {
    matrix: &'a BandMatrix<D, W>,
    x: &'a [[D; G]],
    out: &'a mut [[D; G]],
}

impl<D: Scalar, const W: usize, const G: usize> pulp::NullaryFnOnce for Product<'_, D, W, G> {
    type Output = ();

    /// Adds the product `A x` to `out`, compiled for the instruction set of the caller.
    #[inline(always)]
    fn call(self) {
        self.matrix.add_product_inlined(self.x, self.out);
    }
}

impl<D: Scalar, const W: usize> BandMatrix<D, W> {
    /// The zero matrix of `n` rows, stored with `W` more rows of zeros (padding) after the last.
    pub fn zeros(n: usize) -> Self {
        // W rows of padding, so that inner loops need no test for the end.
        let (diagonal, below) = (vec![D::from(0.0); n + W], vec![[D::from(0.0); W]; n + W]);
        Self { diagonal, below, skew: Vec::new() }
    }

    /// Mutable access to the differences of the upper triangle from the transposed lower one. Allocates them, as zeros,
    /// if the matrix was symmetric.
    fn allocated_skew(&mut self) -> &mut [[D; W]] {
        self.skew.resize(self.below.len(), [D::from(0.0); W]);
        &mut self.skew
    }

    /// Adds the product of the skew part (the upper triangle less the transposed lower one) with `G` vectors to `out`;
    /// nothing for a symmetric matrix.
    fn add_skew_product<const G: usize>(&self, x: &[[D; G]], out: &mut [[D; G]]) {
        for (j, row) in self.skew.iter().enumerate().take(x.len()) {
            for (p, entry) in row.iter().enumerate().take(x.len() - 1 - j) {
                for g in 0..G {
                    out[j][g] += *entry * x[j + 1 + p][g];
                }
            }
        }
    }

    /// Number of rows, without the padding.
    pub fn order(&self) -> usize {
        self.diagonal.len() - W
    }

    /// Mutable access to the columns in groups of `C`: the diagonal entries, and the entries below the diagonal (index
    /// `p` is row `j + 1 + p` of column `j`). Some groups include the padding beyond the last column; columns that fill
    /// no group are omitted. The matrix becomes symmetric: differences of the upper triangle are dropped.
    #[inline]
    pub fn columns_mut<const C: usize>(&mut self) -> (&mut [[D; C]], &mut [[[D; W]; C]]) {
        self.skew.clear();
        (self.diagonal.as_chunks_mut().0, self.below.as_chunks_mut().0)
    }

    /// Adds `A x` to `out` for `G` vectors (`x[i][g]` is row `i` of vector `g`), where `A` is the symmetric matrix of
    /// the stored lower triangle; the skew part is left out. Reads each stored entry once. Inlined into its caller.
    #[inline(always)]
    fn add_product_inlined<const G: usize>(&self, x: &[[D; G]], out: &mut [[D; G]]) {
        let n = x.len();
        for j in 0..n {
            let (own, column) = (x[j], &self.below[j]);
            let (here, below) = out[j..n].split_first_mut().expect("a row per unknown");
            let mut sum = *here;
            for g in 0..G {
                sum[g] += self.diagonal[j] * own[g];
            }
            // Each stored entry acts twice: below the diagonal and, by symmetry, right of it.
            let mut both = |below: &mut [D; G], x: &[D; G], entry: D| {
                for g in 0..G {
                    below[g] += entry * own[g];
                    sum[g] += entry * x[g];
                }
            };
            // The last W rows have fewer entries below them.
            match (below.first_chunk_mut::<W>(), x[j + 1..].first_chunk::<W>()) {
                (Some(below), Some(x)) => {
                    for p in 0..W {
                        both(&mut below[p], &x[p], column[p]);
                    }
                }
                _ => {
                    for p in 0..below.len() {
                        both(&mut below[p], &x[j + 1 + p], column[p]);
                    }
                }
            }
            *here = sum;
        }
    }
}

impl<D: Scalar, const W: usize> Tangent<D> for BandMatrix<D, W> {
    const NUMBERS_PER_ROW: usize = W + 1;
    type Factors = Ldlt<D, W>;

    /// Allocates factors for matrices of this order; they are not yet computed.
    fn new_factors(&self) -> Ldlt<D, W> {
        Ldlt::with_order(self.order())
    }

    /// The entry of row `i`, column `j`, in either triangle; zero more than `W` places from the diagonal.
    fn get(&self, i: usize, j: usize) -> D {
        let (low, high) = (i.min(j), i.max(j));
        match high - low {
            0 => self.diagonal[low],
            d if d > W => D::from(0.0),
            d if i < j && !self.skew.is_empty() => self.below[low][d - 1] + self.skew[low][d - 1],
            d => self.below[low][d - 1],
        }
    }

    /// Adds the leading `size` by `size` part of the symmetric `block` to the entries from row and column `start` on.
    /// Only its lower triangle is read. Panics if `size` is above `W + 1`.
    #[inline]
    fn add_corner<const N: usize>(&mut self, start: usize, size: usize, block: &[[D; N]; N]) {
        for c in 0..size {
            self.diagonal[start + c] += block[c][c];
            for r in c + 1..size {
                self.below[start + c][r - c - 1] += block[r][c];
            }
        }
    }

    /// Replaces row and column `i`, in both triangles, by those of the identity: zeros, and one on the diagonal.
    fn eliminate_row_and_column(&mut self, i: usize) {
        self.diagonal[i] = D::from(1.0);
        self.below[i] = [D::from(0.0); W];
        for (p, j) in (i.saturating_sub(W)..i).rev().enumerate() {
            self.below[j][p] = D::from(0.0);
        }
        if !self.skew.is_empty() {
            self.skew[i] = [D::from(0.0); W];
            for (p, j) in (i.saturating_sub(W)..i).rev().enumerate() {
                self.skew[j][p] = D::from(0.0);
            }
        }
    }

    /// Sets every entry to zero; the matrix becomes symmetric.
    fn clear(&mut self) {
        self.diagonal.fill(D::from(0.0));
        self.below.fill([D::from(0.0); W]);
        self.skew.clear();
    }

    /// Adds `factor` times the matrix `other`, of the same order, to this one.
    fn add_scaled(&mut self, other: &Self, factor: f64) {
        for (to, from) in self.diagonal.iter_mut().zip(&other.diagonal) {
            *to += *from * factor;
        }
        for (to, from) in self.below.iter_mut().zip(&other.below) {
            for (to, from) in to.iter_mut().zip(from) {
                *to += *from * factor;
            }
        }
        if other.skew.is_empty() {
            return;
        }
        for (to, from) in self.allocated_skew().iter_mut().zip(&other.skew) {
            for (to, from) in to.iter_mut().zip(from) {
                *to += *from * factor;
            }
        }
    }

    /// Adds column `j` of the matrix times the number `x[g]` to vector `g` of `out`, for `G` vectors (`out[i][g]` is
    /// row `i`).
    #[inline(always)]
    fn add_column<const G: usize>(&self, j: usize, x: [D; G], out: &mut [[D; G]]) {
        let add = |out: &mut [D; G], entry: D| {
            for g in 0..G {
                out[g] += entry * x[g];
            }
        };
        add(&mut out[j], self.diagonal[j]);
        // Entries below the diagonal; the last columns have fewer than W.
        let column = &self.below[j];
        let below = &mut out[j + 1..];
        match below.first_chunk_mut::<W>() {
            Some(below) => {
                for p in 0..W {
                    add(&mut below[p], column[p]);
                }
            }
            None => {
                for p in 0..below.len() {
                    add(&mut below[p], column[p]);
                }
            }
        }
        // By symmetry, row j left of the diagonal.
        let first = j.saturating_sub(W);
        let (above, rows) = (&mut out[first..j], &self.below[first..j]);
        match (above.first_chunk_mut::<W>(), rows.first_chunk::<W>()) {
            (Some(above), Some(rows)) => {
                for p in 0..W {
                    add(&mut above[p], rows[p][W - 1 - p]);
                }
            }
            _ => {
                for p in 0..above.len() {
                    add(&mut above[p], rows[p][j - first - 1 - p]);
                }
            }
        }
        // The same entries as far as they differ from those below the diagonal.
        if let Some(rows) = self.skew.get(first..j) {
            for (p, row) in rows.iter().enumerate() {
                add(&mut out[first + p], row[j - first - 1 - p]);
            }
        }
    }

    /// Adds `A x` to `out`, for `G` vectors (`x[i][g]` is row `i` of vector `g`), the skew part included. For more than
    /// two vectors it uses AVX2 instructions where the processor has them.
    fn add_product<const G: usize>(&self, x: &[[D; G]], out: &mut [[D; G]]) {
        with_simd_if_wide::<_, G>(Product { matrix: self, x, out: &mut *out });
        self.add_skew_product(x, out);
    }

    /// Writes the product of the absolute values of all entries, `|A| |x|`, to `out`, by the real parts; for a matrix
    /// that is not symmetric an upper bound of it. Rounding errors of `A x` are proportional to it.
    fn absolute_product(&self, x: &[D], out: &mut [f64]) {
        let n = x.len();
        out[..n].fill(0.0);
        // Columns with W rows below them, then the last ones with fewer.
        let (inner, rim) = self.below[..n].split_at(n.saturating_sub(W));
        for (j, column) in inner.iter().enumerate() {
            let xs: &[D; W] = array(x, j + 1);
            let (here, below) = out[j..].split_first_mut().expect("a row per unknown");
            let below: &mut [f64; W] = below.first_chunk_mut().expect("W rows follow");
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
        for (j, row) in self.skew.iter().enumerate().take(n) {
            for (i, entry) in (j + 1..n).zip(row) {
                out[j] += entry.value().abs() * x[i].value().abs();
            }
        }
    }

    /// The rows with an entry in column `j` of the matrix, whose order is `n`: those at most `W` rows from the
    /// diagonal.
    fn coupled(&self, j: usize, n: usize) -> Range<usize> {
        j.saturating_sub(W)..(j + W + 1).min(n)
    }
}

impl<D: Scalar, const W: usize> UnsymmetricTangent<D> for BandMatrix<D, W> {
    /// Adds the leading `size` by `size` part of `block`, both triangles, to the entries from row and column `start`
    /// on. Panics if `size` is above `W + 1`.
    fn add_unsymmetric<const N: usize>(&mut self, start: usize, size: usize, block: &[[D; N]; N]) {
        self.add_corner(start, size, block);
        let skew = self.allocated_skew();
        for c in 0..size {
            for r in c + 1..size {
                skew[start + c][r - c - 1] += block[c][r] - block[r][c];
            }
        }
    }

    /// Whether the matrix is stored as symmetric: no unsymmetric block was added since it was made, cleared or
    /// overwritten through `columns_mut`.
    fn is_symmetric(&self) -> bool {
        self.skew.is_empty()
    }
}

impl<D: Scalar, const W: usize> PatternByOrder<D> for BandMatrix<D, W> {
    /// The zero matrix of `n` rows.
    fn zeros(n: usize) -> Self {
        Self::zeros(n)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::tangent::{Factors, Singular};

    /// A matrix of order `n`, positive definite without `shift` and indefinite with a negative one.
    fn matrix(n: usize, shift: f64) -> BandMatrix<f64, 3> {
        let mut a = BandMatrix::zeros(n);
        for j in 0..n - 3 {
            let v = |k: usize| ((j * 7 + k * 3) % 11) as f64 / 11.0 - 0.4;
            a.add_corner(
                j,
                4,
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

    /// A band with arbitrary entries, of any width; positive definite without `shift`.
    fn band<T: PatternByOrder<f64>>(n: usize, shift: f64) -> T {
        let (mut a, w) = (T::zeros(n), T::NUMBERS_PER_ROW - 1);
        for j in 0..n {
            let mut column = [[0.0; 11]; 11];
            column[0][0] = 2.0 + shift + (j % 3) as f64;
            for p in 0..w.min(n - 1 - j) {
                column[p + 1][0] =
                    ((j * 13 + p * 5) % 17) as f64 / (17.0 * w as f64) - 0.4 / w as f64;
            }
            a.add_corner(j, (w + 1).min(n - j), &column);
        }
        a
    }

    /// The solution over `range` by L D L^T from the first row to the last.
    fn solve_from_the_top(a: &impl Tangent<f64>, range: Range<usize>, b: &[f64]) -> Vec<f64> {
        let n = range.len();
        let mut rows =
            nalgebra::DMatrix::from_fn(n, n, |i, j| a.get(range.start + i, range.start + j));
        let mut x = nalgebra::DVector::from_column_slice(&b[range]);
        for j in 0..n {
            for i in j + 1..n {
                let factor = rows[(i, j)] / rows[(j, j)];
                for k in j..n {
                    rows[(i, k)] -= factor * rows[(j, k)];
                }
                x[i] -= factor * x[j];
            }
        }
        assert!(rows.solve_upper_triangular_mut(&mut x));
        x.as_slice().to_vec()
    }

    #[test]
    fn elimination_from_both_ends_agrees_with_that_from_the_top_for_every_length() {
        fn check<T: PatternByOrder<f64>>() {
            let a = band::<T>(45, 0.0);
            let b: Vec<f64> = (0..45).map(|i| (i as f64).sin()).collect();
            let mut ldlt = a.new_factors();
            // Long ranges first, so that entries of earlier factors would show.
            for length in (1..=40).rev() {
                for start in [0, 3, 45 - length] {
                    let range = start..start + length;
                    ldlt.factor(&a, range.clone()).unwrap();
                    let mut x = b.clone();
                    ldlt.solve(&mut x);
                    let expected = solve_from_the_top(&a, range.clone(), &b);
                    for (x, expected) in x[range].iter().zip(&expected) {
                        assert!((x - expected).abs() < 1e-14, "{length} rows");
                    }
                }
            }
        }
        check::<BandMatrix<f64, 1>>();
        check::<BandMatrix<f64, 3>>();
        check::<BandMatrix<f64, 5>>();
        check::<BandMatrix<f64, 10>>();
    }

    #[test]
    fn solution_outside_of_the_range_is_zero() {
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
    fn solutions_of_several_right_hand_sides_equal_single_ones() {
        fn check<T: PatternByOrder<f64>, const R: usize>() {
            let a = band::<T>(40, 0.0);
            let mut ldlt = a.new_factors();
            ldlt.factor(&a, 2..39).unwrap();
            let b = |i: usize, r: usize| (i as f64 + 1.0 / (1.0 + r as f64)).cos();
            let mut all: Vec<[f64; R]> =
                (0..40).map(|i| std::array::from_fn(|r| b(i, r))).collect();
            ldlt.solve_many(&mut all);
            for r in 0..R {
                let mut single: Vec<f64> = (0..40).map(|i| b(i, r)).collect();
                ldlt.solve(&mut single);
                assert!(all.iter().zip(&single).all(|(all, single)| all[r] == *single));
            }
        }
        check::<BandMatrix<f64, 5>, 2>();
        check::<BandMatrix<f64, 5>, 3>();
        check::<BandMatrix<f64, 5>, 4>();
        check::<BandMatrix<f64, 10>, 2>();
        check::<BandMatrix<f64, 10>, 3>();
    }

    #[test]
    fn negative_pivots_equal_the_number_of_negative_eigenvalues() {
        for n in [5, 12, 13, 29] {
            for shift in [0.0, -2.9, -6.1, -20.0] {
                let a = matrix(n, shift);
                let dense = nalgebra::DMatrix::from_fn(n, n, |i, j| a.get(i, j));
                let negative = dense.symmetric_eigenvalues().iter().filter(|l| **l < 0.0).count();
                let mut ldlt = Ldlt::with_order(n);
                ldlt.factor(&a, 0..n).unwrap();
                assert_eq!(ldlt.negative_pivots(), negative, "{n} rows, {shift}");
            }
        }
    }

    #[test]
    fn zero_or_infinite_pivot_is_an_error_with_its_row() {
        let mut ldlt = Ldlt::<f64, 3>::with_order(20);
        for row in 2..19 {
            for pivot in [0.0, f64::NAN, f64::INFINITY] {
                let mut a = BandMatrix::zeros(20);
                for j in 0..20 {
                    a.diagonal[j] = if j == row { pivot } else { 1.0 - 2.0 * (j % 2) as f64 };
                }
                assert_eq!(ldlt.factor(&a, 2..19), Err(Singular { row }), "{pivot}");
            }
        }
        let mut ones = BandMatrix::zeros(20);
        ones.diagonal.fill(1.0);
        assert_eq!(ldlt.factor(&ones, 2..19), Ok(()));
        assert_eq!(ldlt.negative_pivots(), 0);
    }

    #[test]
    fn dual_solution_has_the_derivative_of_the_solution() {
        use num_dual::Dual64;
        // (A + p B) x = b: x' = -A^-1 B x.
        let (a, slope) =
            (band::<BandMatrix<f64, 5>>(30, 0.0), band::<BandMatrix<f64, 5>>(30, -1.7));
        let mut dual = BandMatrix::<Dual64, 5>::zeros(30);
        for j in 0..30 {
            dual.diagonal[j] = Dual64::new(a.diagonal[j], slope.diagonal[j]);
            dual.below[j] = std::array::from_fn(|p| Dual64::new(a.below[j][p], slope.below[j][p]));
        }
        let b: Vec<f64> = (0..30).map(|i| (i as f64).sin()).collect();
        let mut x: Vec<Dual64> = b.iter().map(|b| Dual64::from(*b)).collect();
        let mut ldlt = Ldlt::with_order(30);
        ldlt.factor(&dual, 0..30).unwrap();
        ldlt.solve(&mut x);

        let mut plain = Ldlt::with_order(30);
        plain.factor(&a, 0..30).unwrap();
        let mut value = b.clone();
        plain.solve(&mut value);
        let mut derivative = slope.residual(0..30, &value, &[0.0; 30]);
        plain.solve(&mut derivative);
        for (x, (value, derivative)) in x.iter().zip(value.iter().zip(&derivative)) {
            assert!((x.re - value).abs() < 1e-15 && (x.eps - derivative).abs() < 1e-14);
        }
    }

    #[test]
    fn solution_agrees_with_a_dense_lu_solver() {
        for shift in [0.0, -2.9, -20.0] {
            let a = matrix(40, shift);
            let mut ldlt = Ldlt::with_order(40);
            ldlt.factor(&a, 0..40).unwrap();
            let b: Vec<f64> = (0..40).map(|i| 1.0 / (1.0 + i as f64)).collect();
            let mut x = b.clone();
            ldlt.solve(&mut x);
            let dense = nalgebra::DMatrix::from_fn(40, 40, |i, j| a.get(i, j));
            let oracle = dense.lu().solve(&nalgebra::DVector::from_column_slice(&b)).unwrap();
            for i in 0..40 {
                assert!((x[i] - oracle[i]).abs() < 1e-12 * oracle.amax(), "{shift} {i}");
            }
        }
    }

    #[test]
    fn unsymmetric_matrix_agrees_with_a_dense_one() {
        let (n, block) = (30, |j: usize| {
            std::array::from_fn(|r| {
                std::array::from_fn(|c| ((5 * r + 3 * c + j) as f64).sin() * 0.4)
            })
        });
        let mut a = matrix(n, 0.0);
        let mut dense = nalgebra::DMatrix::from_fn(n, n, |i, j| a.get(i, j));
        for j in [0, 9, 10, n - 4] {
            let block: [[f64; 4]; 4] = block(j);
            a.add_unsymmetric(j, 4, &block);
            for r in 0..4 {
                for c in 0..4 {
                    dense[(j + r, j + c)] += block[r][c];
                }
            }
        }
        assert!(!a.is_symmetric());
        assert!((0..n).all(|i| (0..n).all(|j| (a.get(i, j) - dense[(i, j)]).abs() < 1e-15)));
        let x: Vec<f64> = (0..n).map(|i| (1.3 * i as f64).cos()).collect();
        let right = nalgebra::DVector::from_column_slice(&x);
        let (mut product, mut columns) = (vec![0.0; n], vec![[0.0]; n]);
        a.product(&x, &mut product);
        (0..n).for_each(|j| a.add_column(j, [x[j]], &mut columns));
        let expected = &dense * &right;
        let mut factors = a.new_factors();
        factors.factor_sum(&vec![1.0; n], 0.5, &a, 2.0, 3..n).unwrap();
        let mut solution = x.clone();
        factors.solve(&mut solution);
        let part = dense.view((3, 3), (n - 3, n - 3)) * 2.0
            + nalgebra::DMatrix::identity(n - 3, n - 3) * 0.5;
        let solved = part.lu().solve(&right.rows(3, n - 3).into_owned()).unwrap();
        for i in 0..n {
            assert!((product[i] - expected[i]).abs() < 1e-14, "{i}");
            assert!((columns[i][0] - expected[i]).abs() < 1e-14, "{i}");
            let exact = if i < 3 { 0.0 } else { solved[i - 3] };
            assert!((solution[i] - exact).abs() < 1e-12, "{i}");
        }
        // A symmetric matrix again.
        a.clear();
        assert!(a.is_symmetric() && a.get(0, 1) == 0.0);
    }

    #[test]
    fn absolute_product_sums_all_entries() {
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
    fn sum_over_columns_equals_the_product() {
        let a = matrix(12, -6.1);
        let x: Vec<f64> = (0..12).map(|i| (i as f64).cos()).collect();
        let mut found = vec![[1.0; 2]; 12];
        for j in 0..12 {
            a.add_column(j, [x[j], 2.0 * x[j]], &mut found);
        }
        let mut at_once = vec![[1.0; 2]; 12];
        let both: Vec<[f64; 2]> = x.iter().map(|x| [*x, 2.0 * x]).collect();
        a.add_product(&both, &mut at_once);
        for i in 0..12 {
            let sum: f64 = (0..12).map(|j| a.get(i, j) * x[j]).sum();
            for found in [found[i], at_once[i]] {
                assert!((found[0] - 1.0 - sum).abs() < 1e-13);
                assert!((found[1] - 1.0 - 2.0 * sum).abs() < 1e-13);
            }
        }
    }

    #[test]
    fn zero_or_nan_matrix_is_an_error() {
        let mut ldlt = Ldlt::<f64, 3>::with_order(8);
        assert_eq!(ldlt.factor(&BandMatrix::zeros(8), 2..8), Err(Singular { row: 2 }));
        let mut a = matrix(8, 0.0);
        a.add_corner(3, 1, &[[f64::NAN]]);
        assert!(ldlt.factor(&a, 0..8).is_err());
    }
}
