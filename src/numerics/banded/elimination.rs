//! Elimination `L D L^T` of `S` symmetric band matrices at once, column by column from the first row.
//!
//! Input: a [`ColumnSource`] with the columns of `S` independent matrices (bands) of half-bandwidth `W`; their numbers
//! are adjacent in memory, as lanes of vector instructions. [`Elimination`] stores `L`, the pivots `D` and their
//! reciprocals for the first `n` columns, without row exchanges. A pivot that is zero or not finite is an error with
//! column and band. `schur_update` returns the update of one of the `W` columns that follow, to be added to it. `Ldlt`
//! uses `S = 2` for the two ends of a matrix and `S = 1` for its middle.

use crate::numerics::banded::array;
use crate::numerics::banded::products::{subtract_products, unrolled};
use crate::numerics::scalar::Scalar;
use crate::numerics::simd::PairLevel;
use std::ops::Range;

/// A column of `S` bands: the diagonal entry and the `W` entries below it.
#[derive(Clone, Copy)]
pub(super) struct BandColumn<D, const W: usize, const S: usize> {
    /// Diagonal entry of the column in each band.
    pub diagonal: [D; S],
    /// `below[p]` is the entry `p + 1` rows below the diagonal in each band.
    pub below: [[D; S]; W],
}

/// Source of the columns of `S` bands.
pub(super) trait ColumnSource<D, const W: usize, const S: usize> {
    /// Column `k` of each band: its diagonal entry and the `W` entries below it.
    fn column(&self, k: usize) -> BandColumn<D, W, S>;
}

/// Column and band of a pivot that is zero or not finite.
pub(super) struct SingularColumn {
    /// Index of the column, from the first one eliminated.
    pub column: usize,
    /// Index of the band, below `S`.
    pub band: usize,
}

/// The factors of `S` bands.
///
/// Columns are computed one after the other, each from the `W` columns before it (left-looking): every entry is read
/// once from the matrix, accumulated in a register and written once.
#[derive(Clone, Debug)]
pub(super) struct Elimination<D, const W: usize, const S: usize> {
    /// Reciprocals of the pivots.
    pub(super) inverse_pivots: Vec<[D; S]>,
    /// The pivots `D`, with `W` zeros before them and room for `W` after them.
    pivots: Vec<[D; S]>,
    /// The columns of `L`, padded likewise: `lower[W + k][p]` is the entry of row `k + 1 + p`, column `k`.
    pub(super) lower: Vec<[[D; S]; W]>,
}

impl<D: Scalar, const W: usize, const S: usize> Elimination<D, W, S> {
    /// Whether the last computed column stays in vector registers (16 are enough) instead of being read again.
    pub const NARROW: bool = W <= 5;

    /// Allocates the factors of `S` bands with up to `n` columns, as zeros with padding.
    pub fn with_order(n: usize) -> Self {
        let zero = [D::from(0.0); S];
        Self {
            inverse_pivots: vec![zero; n],
            pivots: vec![zero; W + n + W],
            lower: vec![[zero; W]; W + n + W],
        }
    }

    /// Eliminates the first `n` columns of the `S` bands of `matrix` and stores pivots and columns of `L` here. `level`
    /// is the set of vector instructions. Factors after column `n` are left as they were.
    ///
    /// # Errors
    /// The first pivot that is zero or not finite; the factors are then not usable.
    #[inline(always)]
    pub fn eliminate<V: PairLevel>(
        &mut self,
        level: V,
        n: usize,
        matrix: &impl ColumnSource<D, W, S>,
    ) -> Result<(), SingularColumn> {
        let (inverse_pivots, pivots) = (&mut self.inverse_pivots[..n], &mut self.pivots[..W + n]);
        let lower = &mut self.lower[..W + n];
        // Of the previous column: the inverse of its pivot, its first entry before the division, all entries after it.
        let mut inverse = [D::from(0.0); S];
        let (mut first, mut divided) = (inverse, [inverse; W]);
        let mut ones = [0.0; S];
        for k in 0..n {
            let mut entries = matrix.column(k);
            // Column k has at most k columns before it. With several bands the zeros of the padding cost less than the
            // test.
            let reach = if S == 1 { W.min(k + 1) } else { W };
            Self::subtract(level, (array(lower, k), array(pivots, k)), 1..reach, &mut entries);
            let BandColumn { diagonal: mut pivot, below: mut column } = entries;
            let nearest = if Self::NARROW { &divided } else { &lower[W + k - 1] };
            for s in 0..S {
                // The critical path: the pivot waits for the inverse of the previous one; the square is ready by then.
                pivot[s] -= first[s] * first[s] * inverse[s];
            }
            subtract_products(level, &mut column[..W - 1], &nearest[1..], &first);
            for s in 0..S {
                inverse[s] = pivot[s].recip();
            }
            first = column[0];
            let to = &mut lower[W + k];
            for p in 0..W {
                for s in 0..S {
                    divided[p][s] = column[p][s] * inverse[s];
                    to[p][s] = divided[p][s];
                }
            }
            for s in 0..S {
                // The product with the inverse is NaN for 0 and infinity, and so is the sum: one test at the end
                // suffices.
                ones[s] += pivot[s].value() * inverse[s].value();
            }
            pivots[W + k] = pivot;
            inverse_pivots[k] = inverse;
        }
        if ones.iter().all(|sum| sum.is_finite()) { Ok(()) } else { Err(self.first_singular(n)) }
    }

    /// Column and band of the first of `n` pivots whose inverse is zero or not finite. The last column of the first
    /// band if there is none.
    #[cold]
    fn first_singular(&self, n: usize) -> SingularColumn {
        let singular = |inverse: &D| inverse.value() == 0.0 || !inverse.value().is_finite();
        self.inverse_pivots[..n]
            .iter()
            .enumerate()
            .find_map(|(column, inverses)| {
                Some(SingularColumn { column, band: inverses.iter().position(singular)? })
            })
            .unwrap_or(SingularColumn { column: n - 1, band: 0 })
    }

    /// The update of column `n + C` of the matrix, `C < W`, by the elimination of the first `n` columns: to be added to
    /// the matrix, it yields the Schur complement. Entries are those of the diagonal and the `W` rows below it.
    #[inline(always)]
    pub fn schur_update<V: PairLevel, const C: usize>(
        &self,
        level: V,
        n: usize,
    ) -> BandColumn<D, W, S> {
        let zero = [D::from(0.0); S];
        let mut sum = BandColumn { diagonal: zero, below: [zero; W] };
        let before = (array(&self.lower, n + C), array(&self.pivots, n + C));
        Self::subtract(level, before, C..W, &mut sum);
        sum
    }

    /// Subtracts from `column` the products of the columns before it, whose `L` and `D` are given for the `W` nearest
    /// ones in ascending order. Of these only columns at the `distances` are used; 0 is the nearest one.
    #[inline(always)]
    fn subtract<V: PairLevel>(
        level: V,
        (lower, pivots): (&[[[D; S]; W]; W], &[[D; S]; W]),
        distances: Range<usize>,
        column: &mut BandColumn<D, W, S>,
    ) {
        // The far columns first: they are computed earliest.
        unrolled!(Q in 9 8 7 6 5 4 3 2 1 0, W: {
            if distances.contains(&Q) {
                let (lower, mut times) = (&lower[W - 1 - Q], pivots[W - 1 - Q]);
                for s in 0..S {
                    times[s] = lower[Q][s] * times[s];
                    column.diagonal[s] -= lower[Q][s] * times[s];
                }
                subtract_products(level, &mut column.below[..W - 1 - Q], &lower[Q + 1..], &times);
            }
        });
    }

    /// Number of negative pivots among the first `n` of each band, all bands together.
    pub fn negative_pivots(&self, n: usize) -> usize {
        let mut negative = 0;
        for row in &self.pivots[W..W + n] {
            for pivot in row {
                negative += usize::from(pivot.value() < 0.0);
            }
        }
        negative
    }
}
