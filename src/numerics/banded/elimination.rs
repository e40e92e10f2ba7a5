//! Elimination `L D L^T` of `S` symmetric band matrices at once, column by column from the first row, and the triangular
//! solves with its factors. The `S` matrices are independent; their numbers are adjacent, as lanes of vector instructions.

use crate::numerics::banded::array;
use crate::numerics::scalar::Scalar;
use crate::numerics::simd::PairLevel;
use crate::numerics::tangent::RightHandSide;
use std::ops::Range;

/// The statement for each index below a number, at most 10 of them. Unrolled by hand: compilers keep a loop whose inner loop
/// depends on its index, and then arrays that are indexed by it are no registers.
macro_rules! unrolled {
    ($index:ident in $($number:literal)*, $count:ident: $statement:block) => {
        const { assert!($count <= 10, "the loop is unrolled for at most 10 indices") }
        $({
            const $index: usize = $number;
            if $index < $count $statement
        })*
    };
}

pub(super) use unrolled;

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

/// Right-hand sides of the rows that are eliminated downwards, and of those that are eliminated upwards, in reverse order.
pub(super) struct EndRows<'a, E, const R: usize> {
    pub top: &'a mut [[E; R]],
    /// As many rows; none of a single band.
    pub bottom: &'a mut [[E; R]],
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
            subtract(level, array(lower, k), array(pivots, k), 1..reach, &mut entries);
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

    /// The contribution of the first `n` columns to column `n + C` of the Schur complement, `C < W`.
    #[inline(always)]
    pub fn schur_update<V: PairLevel, const C: usize>(
        &self,
        level: V,
        n: usize,
    ) -> BandColumn<D, W, S> {
        let zero = [D::from(0.0); S];
        let mut sum = BandColumn { diagonal: zero, below: [zero; W] };
        subtract(level, array(&self.lower, n + C), array(&self.pivots, n + C), C..W, &mut sum);
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
    pub fn forward<V: PairLevel, E: RightHandSide<D>, const R: usize, const C: usize>(
        &self,
        level: V,
        x: EndRows<'_, E, R>,
        first: usize,
    ) -> Window<E, W, S, C> {
        let zero = [[E::from(0.0); S]; C];
        let n = x.top.len();
        let window = self.substitute::<V, E, R, C, true>(level, x, first, [zero; W]);
        let before: &[[[D; S]; W]; W] = array(&self.lower, n);
        let mut contribution = [zero; W];
        unrolled!(I in 0 1 2 3 4 5 6 7 8 9, W: {
            for p in (I..W).rev() {

                subtract_products(level, &mut contribution[I], &window[W - 1 + I - p], &before[W - 1 + I - p][p]);
            }
        });
        contribution
    }

    /// Solves `D L^T x = y` in place likewise. `after` has the solution in the `W` rows after the last.
    #[inline(always)]
    pub fn backward<V: PairLevel, E: RightHandSide<D>, const R: usize, const C: usize>(
        &self,
        level: V,
        x: EndRows<'_, E, R>,
        first: usize,
        after: Window<E, W, S, C>,
    ) {
        let mut window = after;
        for p in 0..W {
            window[p] = after[W - 1 - p];
        }
        self.substitute::<V, E, R, C, false>(level, x, first, window);
    }

    /// Solves `L y = x` from the first row to the last, or `D L^T x = y` from the last to the first. `window` has the `W`
    /// rows of the solution before these, the nearest one last.
    #[inline(always)]
    fn substitute<V, E, const R: usize, const C: usize, const FORWARD: bool>(
        &self,
        level: V,
        mut x: EndRows<'_, E, R>,
        first: usize,
        window: Window<E, W, S, C>,
    ) -> Window<E, W, S, C>
    where
        V: PairLevel,
        E: RightHandSide<D>,
    {
        let n = x.top.len();
        let single = if E::PLAIN { n % W } else { n };
        let (one, all) = (0..single, single..n);
        let window =
            self.substitute_rows::<V, E, R, C, FORWARD, 1>(level, &mut x, one, first, window);
        self.substitute_rows::<V, E, R, C, FORWARD, W>(level, &mut x, all, first, window)
    }

    /// Solves for some rows, which are counted in the order of their solution, in blocks of `B`. In a block of `W` rows,
    /// each takes the place in the window of the one `W` rows before it, so that no row is moved.
    #[inline(always)]
    fn substitute_rows<V, E, const R: usize, const C: usize, const FORWARD: bool, const B: usize>(
        &self,
        level: V,
        x: &mut EndRows<'_, E, R>,
        rows: Range<usize>,
        first: usize,
        mut window: Window<E, W, S, C>,
    ) -> Window<E, W, S, C>
    where
        V: PairLevel,
        E: RightHandSide<D>,
    {
        let (n, count) = (x.top.len(), rows.len() / B);
        let starts = if FORWARD { [rows.start, n - rows.end] } else { [n - rows.end, rows.start] };
        let own = &self.lower[W + starts[0]..].as_chunks::<B>().0[..count];
        let inverse_pivots = &self.inverse_pivots[starts[0]..].as_chunks::<B>().0[..count];
        let top = &mut x.top[starts[0]..].as_chunks_mut::<B>().0[..count];
        let bottom = match S {
            1 => &mut [],
            _ => &mut x.bottom[starts[1]..].as_chunks_mut::<B>().0[..count],
        };
        for i in 0..count {
            let block = if FORWARD { i } else { count - 1 - i };
            let before: &[_; W] = array(&self.lower, starts[0] + block * B);
            unrolled!(I in 0 1 2 3 4 5 6 7 8 9, B: {
                let j = if FORWARD { I } else { B - 1 - I };
                let mut row = [[E::from(0.0); S]; C];
                for r in 0..C {
                    for s in 0..S {
                        row[r][s] = match s {
                            0 => top[block][j][first + r],
                            _ => bottom[count - 1 - block][B - 1 - j][first + r],
                        };
                        if !FORWARD {
                            row[r][s] = row[r][s] * inverse_pivots[block][j][s];
                        }
                    }
                }
                // The far rows first: they are computed earliest, which shortens the dependency chain.
                for p in (0..W).rev() {
                    let factors: &[D; S] = match FORWARD {
                        true if p < j => &own[block][j - 1 - p][p],
                        true => &before[W + j - 1 - p][p],
                        false => &own[block][j][p],
                    };
                    subtract_products(level, &mut row, &window[(I + W - 1 - p) % W], factors);
                }
                for r in 0..C {
                    for s in 0..S {
                        match s {
                            0 => top[block][j][first + r] = row[r][s],
                            _ => bottom[count - 1 - block][B - 1 - j][first + r] = row[r][s],
                        }
                    }
                }
                window[I] = row;
            });
            if B < W {
                let row = window[0];
                for p in 1..W {
                    window[p - 1] = window[p];
                }
                window[W - 1] = row;
            }
        }
        window
    }
}

/// Subtracts `x y` from `a`, for each of several numbers of `S` bands with the same `y`.
#[inline(always)]
fn subtract_products<V: PairLevel, D: Scalar, E: RightHandSide<D>, const S: usize>(
    level: V,
    a: &mut [[E; S]],
    x: &[[E; S]],
    y: &[D; S],
) {
    if S != 2 || !E::PLAIN || !D::PLAIN {
        for k in 0..a.len() {
            for s in 0..S {
                a[k][s] -= x[k][s] * y[s];
            }
        }
        return;
    }
    let (last, y) = (S - 1, [y[0].value(), y[S - 1].value()]);
    let (twos, rest) = a.as_chunks_mut::<2>();
    let (x_twos, x_rest) = x.as_chunks::<2>();
    for k in 0..twos.len() {
        let ([a, b], [c, d]) = (&mut twos[k], &x_twos[k]);
        let results = level.less_products(
            [[a[0].value(), a[last].value()], [b[0].value(), b[last].value()]],
            [[c[0].value(), c[last].value()], [d[0].value(), d[last].value()]],
            y,
        );
        for s in 0..S {
            (a[s], b[s]) = (E::from(results[0][s]), E::from(results[1][s]));
        }
    }
    for k in 0..rest.len() {
        let (a, c) = (&mut rest[k], &x_rest[k]);
        let result =
            level.less_product([a[0].value(), a[last].value()], [c[0].value(), c[last].value()], y);
        for s in 0..S {
            a[s] = E::from(result[s]);
        }
    }
}

/// Subtracts from a column the products with the columns of `L` `before` it. Column `q` of `distances` lies `q` columns
/// before the nearest one.
#[inline(always)]
fn subtract<V: PairLevel, D: Scalar, const W: usize, const S: usize>(
    level: V,
    before: &[[[D; S]; W]; W],
    pivots: &[[D; S]; W],
    distances: Range<usize>,
    column: &mut BandColumn<D, W, S>,
) {
    // The far columns first: they are computed earliest.
    unrolled!(Q in 9 8 7 6 5 4 3 2 1 0, W: {
        if distances.contains(&Q) {
            subtract_one::<V, D, W, S, Q>(level, &before[W - 1 - Q], &pivots[W - 1 - Q], column);
        }
    });
}

/// Subtracts the product with one column of `L`, `Q` columns before the nearest one.
#[inline(always)]
fn subtract_one<V: PairLevel, D: Scalar, const W: usize, const S: usize, const Q: usize>(
    level: V,
    lower: &[[D; S]; W],
    pivots: &[D; S],
    column: &mut BandColumn<D, W, S>,
) {
    let mut times = *pivots;
    for s in 0..S {
        times[s] = lower[Q][s] * pivots[s];
        column.diagonal[s] -= lower[Q][s] * times[s];
    }
    subtract_products(level, &mut column.below[..W - 1 - Q], &lower[Q + 1..], &times);
}
