//! Elimination `L D L^T` of `S` symmetric band matrices at once, column by column from the first row, and the triangular
//! solves with its factors. The `S` matrices are independent; their numbers are adjacent, as lanes of vector instructions.

use crate::numerics::banded::array;
use crate::numerics::scalar::Scalar;
use crate::numerics::tangent::RightHandSide;
use std::ops::Range;

/// A column of `S` bands: the diagonal entry and the `W` entries below it.
#[derive(Clone, Copy)]
pub(super) struct BandColumn<D, const W: usize, const S: usize> {
    pub diagonal: [D; S],
    pub below: [[D; S]; W],
}

/// Source of the columns of `S` bands.
pub(super) trait ColumnSource<D, const W: usize, const S: usize> {
    /// Column `k` of the matrices.
    fn column(&self, k: usize) -> BandColumn<D, W, S>;
}

/// Position of a pivot that is zero or not finite.
pub(super) struct SingularColumn {
    pub column: usize,
    /// Index of the band, below `S`.
    pub band: usize,
}

/// `W` consecutive rows of unknowns, of `C` right-hand sides and `S` bands.
pub(super) type Window<D, const W: usize, const S: usize, const C: usize> = [[[D; S]; C]; W];

/// The factors of `S` bands.
///
/// Columns are computed one after the other, each from the `W` columns before it (left-looking): every entry is read once
/// from the matrix, accumulated in a register and written once.
#[derive(Clone, Debug)]
pub(super) struct Elimination<D, const W: usize, const S: usize> {
    /// Reciprocals of the pivots.
    inverse_pivots: Vec<[D; S]>,
    /// The pivots `D`, with `W` zeros before them and room for `W` after them.
    pivots: Vec<[D; S]>,
    /// The columns of `L`, padded likewise: `lower[W + k][p]` is the entry of row `k + 1 + p`, column `k`.
    lower: Vec<[[D; S]; W]>,
}

impl<D: Scalar, const W: usize, const S: usize> Elimination<D, W, S> {
    /// Whether a window and a column fit into 16 vector registers.
    pub const NARROW: bool = W <= 5;

    /// Allocates `n` columns.
    pub fn with_order(n: usize) -> Self {
        let zero = [D::from(0.0); S];
        Self {
            inverse_pivots: vec![zero; n],
            pivots: vec![zero; W + n + W],
            lower: vec![[zero; W]; W + n + W],
        }
    }

    /// Eliminates `n` columns of a matrix.
    ///
    /// # Errors
    /// The first pivot that is zero or not finite.
    #[inline(always)]
    pub fn eliminate(
        &mut self,
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
            subtract(array(lower, k), array(pivots, k), 1..reach, &mut entries);
            let BandColumn { diagonal: mut pivot, below: mut column } = entries;
            let nearest = if Self::NARROW { &divided } else { &lower[W + k - 1] };
            for s in 0..S {
                // The critical path: the pivot waits for the inverse of the previous one; the square is ready by then.
                pivot[s] -= first[s] * first[s] * inverse[s];
            }
            for p in 1..W {
                for s in 0..S {
                    column[p - 1][s] -= nearest[p][s] * first[s];
                }
            }
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
                // The product with the inverse is NaN for 0 and infinity, and so is the sum: one test at the end suffices.
                ones[s] += pivot[s].value() * inverse[s].value();
            }
            pivots[W + k] = pivot;
            inverse_pivots[k] = inverse;
        }
        if ones.iter().all(|sum| sum.is_finite()) { Ok(()) } else { Err(self.first_singular(n)) }
    }

    /// The first of `n` pivots that is zero or not finite.
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

    /// The contribution of the first `n` columns to column `n + c` of the Schur complement, `c < W`.
    #[inline(always)]
    pub fn schur_update(&self, n: usize, c: usize) -> BandColumn<D, W, S> {
        let zero = [D::from(0.0); S];
        let mut sum = BandColumn { diagonal: zero, below: [zero; W] };
        subtract(array(&self.lower, n + c), array(&self.pivots, n + c), c..W, &mut sum);
        sum
    }

    /// Number of negative pivots among the first `n` of all bands.
    pub fn negative_pivots(&self, n: usize) -> usize {
        let mut negative = 0;
        for row in &self.pivots[W..W + n] {
            for pivot in row {
                negative += usize::from(pivot.value() < 0.0);
            }
        }
        negative
    }

    /// Solves `L y = x` in place, for `C` right-hand sides from index `first` on. Returns the contribution to the `W` rows
    /// after the last. The rows of the second band are in reverse order.
    #[inline(always)]
    pub fn forward<E: RightHandSide<D>, const R: usize, const C: usize>(
        &self,
        x: [&mut [[E; R]]; S],
        first: usize,
    ) -> Window<E, W, S, C> {
        let n = x[0].len();
        let lower = &self.lower[W..W + n];
        let row = |s: usize, k: usize| if s == 0 { k } else { n - 1 - k };
        let zero = E::from(0.0);
        // The rows that a column acts on stay in registers: row k + p in window[p].
        let mut window = [[[zero; S]; C]; W];
        for p in 0..W.min(n) {
            for r in 0..C {
                for s in 0..S {
                    window[p][r][s] = x[s][row(s, p)][first + r];
                }
            }
        }
        for k in 0..n {
            let here = window[0];
            let mut entering = [[zero; S]; C];
            if k + W < n {
                for r in 0..C {
                    for s in 0..S {
                        entering[r][s] = x[s][row(s, k + W)][first + r];
                    }
                }
            }
            for p in 0..W {
                let next = if p + 1 < W { window[p + 1] } else { entering };
                for r in 0..C {
                    for s in 0..S {
                        window[p][r][s] = next[r][s] - here[r][s] * lower[k][p][s];
                    }
                }
            }
            for s in 0..S {
                for r in 0..C {
                    x[s][row(s, k)][first + r] = here[r][s];
                }
            }
        }
        window
    }

    /// Solves `D L^T x = y` in place likewise. `window` has the solution in the `W` rows after the last.
    #[inline(always)]
    pub fn backward<E: RightHandSide<D>, const R: usize, const C: usize>(
        &self,
        x: [&mut [[E; R]]; S],
        first: usize,
        mut window: Window<E, W, S, C>,
    ) {
        let n = x[0].len();
        let lower = &self.lower[W..W + n];
        let inverse_pivots = &self.inverse_pivots[..n];
        let row = |s: usize, k: usize| if s == 0 { k } else { n - 1 - k };
        for k in (0..n).rev() {
            let mut sum = [[E::from(0.0); S]; C];
            for r in 0..C {
                for s in 0..S {
                    sum[r][s] = x[s][row(s, k)][first + r] * inverse_pivots[k][s];
                }
            }
            // The far rows first: they are computed earliest, which shortens the dependency chain.
            for p in (0..W).rev() {
                for r in 0..C {
                    for s in 0..S {
                        sum[r][s] -= window[p][r][s] * lower[k][p][s];
                    }
                }
            }
            for p in (1..W).rev() {
                window[p] = window[p - 1];
            }
            window[0] = sum;
            for s in 0..S {
                for r in 0..C {
                    x[s][row(s, k)][first + r] = sum[r][s];
                }
            }
        }
    }
}

/// Subtracts from a column the products with the columns of `L` `before` it. Column `q` of `distances` lies `q` columns
/// before the nearest one.
#[inline(always)]
fn subtract<D: Scalar, const W: usize, const S: usize>(
    before: &[[[D; S]; W]; W],
    pivots: &[[D; S]; W],
    distances: Range<usize>,
    column: &mut BandColumn<D, W, S>,
) {
    const { assert!(W <= 10, "the loop is unrolled for at most 10 columns") }
    // Unrolled by hand: with optimization for size, compilers keep a loop whose inner loop depends on its index.
    macro_rules! unrolled {
        ($($q:literal)*) => {
            $(if $q < W && distances.contains(&$q) {
                subtract_one::<D, W, S, $q>(&before[W - 1 - $q], &pivots[W - 1 - $q], column);
            })*
        };
    }
    // The far columns first: they are computed earliest.
    unrolled!(9 8 7 6 5 4 3 2 1 0);
}

/// Subtracts the product with one column of `L`, `Q` columns before the nearest one.
#[inline(always)]
fn subtract_one<D: Scalar, const W: usize, const S: usize, const Q: usize>(
    lower: &[[D; S]; W],
    pivots: &[D; S],
    column: &mut BandColumn<D, W, S>,
) {
    let mut times = *pivots;
    for s in 0..S {
        times[s] = lower[Q][s] * pivots[s];
        column.diagonal[s] -= lower[Q][s] * times[s];
    }
    for r in Q + 1..W {
        for s in 0..S {
            column.below[r - Q - 1][s] -= lower[r][s] * times[s];
        }
    }
}
