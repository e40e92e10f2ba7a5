//! L D L^T of bands from the first row down, for several bands in step.

use crate::numerics::banded::array;
use crate::numerics::scalar::Scalar;
use crate::numerics::tangent::RightHandSide;
use std::ops::Range;

/// A pivot and the column below it, one of each band.
pub(super) type Column<D, const W: usize, const S: usize> = ([D; S], [[D; S]; W]);

/// Where columns come from.
pub(super) trait Columns<D, const W: usize, const S: usize> {
    /// What the matrix has in column `k`.
    fn column(&self, k: usize) -> Column<D, W, S>;
}

/// Rows of unknowns that follow each other, of `C` right-hand sides and `S` bands.
pub(super) type Window<D, const W: usize, const S: usize, const C: usize> = [[[D; S]; C]; W];

/// The eliminations of `S` bands in step; none touches what another reads.
///
/// Columns are formed one after the other, each from the `W` columns before it: every entry is read
/// once where the matrix has it, collects its sum in a register and is written once.
#[derive(Clone, Debug)]
pub(super) struct Elimination<D, const W: usize, const S: usize> {
    inverse_pivots: Vec<[D; S]>,
    /// The pivots, between `W` zeros before and room for `W` after them.
    pivots: Vec<[D; S]>,
    /// The columns of L likewise: `lower[W + k][p]` belongs to row `k + 1 + p` of column `k`.
    lower: Vec<[[D; S]; W]>,
}

impl<D: Scalar, const W: usize, const S: usize> Elimination<D, W, S> {
    /// Whether a window, and a column besides, fit into 16 registers.
    pub const NARROW: bool = W <= 5;

    /// Room for `n` columns.
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
    /// The column, and which of the bands, of the first pivot that is zero or not a number.
    #[inline(always)]
    pub fn eliminate(
        &mut self,
        n: usize,
        matrix: &impl Columns<D, W, S>,
    ) -> Result<(), (usize, usize)> {
        let (inverse_pivots, pivots) = (&mut self.inverse_pivots[..n], &mut self.pivots[..W + n]);
        let lower = &mut self.lower[..W + n];
        // Of the column before: its pivot's inverse, its first entry before and all after division.
        let mut inverse = [D::from(0.0); S];
        let (mut first, mut divided) = (inverse, [inverse; W]);
        let mut ones = [0.0; S];
        for k in 0..n {
            let mut entries = matrix.column(k);
            // A band from its first row has no more than k columns before; with several in step,
            // the zeros before them cost less than asking.
            let reach = if S == 1 { W.min(k + 1) } else { W };
            subtract(array(lower, k), array(pivots, k), 1..reach, &mut entries);
            let (mut pivot, mut column) = entries;
            let nearest = if Self::NARROW { &divided } else { &lower[W + k - 1] };
            for s in 0..S {
                // The pivot waits for the inverse of the one before; the square is ready by then.
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
                // 0 and infinity have the product NaN: one look at the sum will do.
                ones[s] += pivot[s].value() * inverse[s].value();
            }
            pivots[W + k] = pivot;
            inverse_pivots[k] = inverse;
        }
        if ones.iter().all(|sum| sum.is_finite()) { Ok(()) } else { Err(self.first_singular(n)) }
    }

    #[cold]
    fn first_singular(&self, n: usize) -> (usize, usize) {
        let singular = |inverse: &D| inverse.value() == 0.0 || !inverse.value().is_finite();
        self.inverse_pivots[..n]
            .iter()
            .enumerate()
            .find_map(|(k, inverses)| Some((k, inverses.iter().position(singular)?)))
            .unwrap_or((n - 1, 0))
    }

    /// What the first `n` columns add to column `n + c`, of the `W` that they reach.
    #[inline(always)]
    pub fn update(&self, n: usize, c: usize) -> Column<D, W, S> {
        let zero = [D::from(0.0); S];
        let mut sum = (zero, [zero; W]);
        subtract(array(&self.lower, n + c), array(&self.pivots, n + c), c..W, &mut sum);
        sum
    }

    /// How many of the first `n` pivots of each band are negative, in all.
    pub fn negative_pivots(&self, n: usize) -> usize {
        let mut negative = 0;
        for row in &self.pivots[W..W + n] {
            for pivot in row {
                negative += usize::from(pivot.value() < 0.0);
            }
        }
        negative
    }

    /// Solves `L y = x` in place, for `C` right-hand sides from `first` on; returns what that adds
    /// to the `W` rows after the last. The second band's rows stand in reverse order.
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
        // The rows a column acts on stay in registers: row k + p in window[p].
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

    /// Solves `D L^T x = y` in place likewise, where `window` has the `W` rows after the last.
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
            // The far rows first: they are known earliest, which shortens the dependency chain.
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

/// Subtracts from a column what the columns of L `before` it have to do with it, those `distances`
/// columns before the nearest.
#[inline(always)]
fn subtract<D: Scalar, const W: usize, const S: usize>(
    before: &[[[D; S]; W]; W],
    pivots: &[[D; S]; W],
    distances: Range<usize>,
    column: &mut Column<D, W, S>,
) {
    const { assert!(W <= 10, "a distance is written out for each column of a band") }
    // Written out: a loop within a loop that tells how long it is stays one where code is to be small.
    macro_rules! one_by_one {
        ($($q:literal)*) => {
            $(if $q < W && distances.contains(&$q) {
                subtract_one::<D, W, S, $q>(&before[W - 1 - $q], &pivots[W - 1 - $q], column);
            })*
        };
    }
    // The far columns first: they are known earliest.
    one_by_one!(9 8 7 6 5 4 3 2 1 0);
}

/// The same for one column of L, `Q` before the nearest.
#[inline(always)]
fn subtract_one<D: Scalar, const W: usize, const S: usize, const Q: usize>(
    lower: &[[D; S]; W],
    pivots: &[D; S],
    (pivot, column): &mut Column<D, W, S>,
) {
    let mut times = *pivots;
    for s in 0..S {
        times[s] = lower[Q][s] * pivots[s];
        pivot[s] -= lower[Q][s] * times[s];
    }
    for r in Q + 1..W {
        for s in 0..S {
            column[r - Q - 1][s] -= lower[r][s] * times[s];
        }
    }
}
