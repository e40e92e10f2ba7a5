//! Triangular solves with the factors `L` and `D` of an [`Elimination`]: `L y = x` (forward) and `D L^T x = y`
//! (backward).
//!
//! Input: right-hand sides of one or two matrices (bands), of which `C` are overwritten by their solutions. Forward,
//! row `k` of `y` is that of `x`, less the products of the `W` rows of `y` before it with entries of `L`. Backward,
//! each row is divided by its pivot, and the products of the `W` rows of the solution after it with entries of `L` are
//! subtracted. These `W` rows (the window) stay in registers. `forward` also returns the contribution of the solved
//! rows to the `W` rows that follow, to be added to their right-hand sides. `Ldlt` solves with it from both ends of a
//! matrix and in the middle.

use crate::numerics::banded::array;
use crate::numerics::banded::elimination::Elimination;
use crate::numerics::banded::products::{subtract_products, unrolled};
use crate::numerics::scalar::Scalar;
use crate::numerics::simd::PairLevel;
use crate::numerics::tangent::RightHandSide;
use std::ops::Range;

/// Right-hand sides of the rows that are eliminated downwards, and of those that are eliminated upwards, in reverse
/// order.
pub(super) struct EndRows<'a, E, const R: usize> {
    /// Rows of the first band, in the order of their elimination.
    pub top: &'a mut [[E; R]],
    /// As many rows; none of a single band.
    pub bottom: &'a mut [[E; R]],
}

/// Number of parts into which the products of a row are divided; each is short enough for a compiler to unroll.
const PARTS: usize = 2;

/// One row of `C` right-hand sides for each of `S` bands.
pub(super) type Row<E, const S: usize, const C: usize> = [[E; S]; C];

impl<D: Scalar, const W: usize, const S: usize> Elimination<D, W, S> {
    /// Solves `L y = x` in place, for the `C` right-hand sides from index `first` on. Returns the contribution to the
    /// `W` rows after the last, to be added to their right-hand sides. The rows of a second band (`x.bottom`) are in
    /// reverse order.
    #[inline(always)]
    pub fn forward<V: PairLevel, E: RightHandSide<D>, const R: usize, const C: usize>(
        &self,
        level: V,
        x: EndRows<'_, E, R>,
        first: usize,
    ) -> [Row<E, S, C>; W] {
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

    /// Solves `D L^T x = y` in place, for the `C` right-hand sides from index `first` on, from the last row to the
    /// first. `after` has the solution in the `W` rows after the last, the nearest one first; zeros without such rows.
    #[inline(always)]
    pub fn backward<V: PairLevel, E: RightHandSide<D>, const R: usize, const C: usize>(
        &self,
        level: V,
        x: EndRows<'_, E, R>,
        first: usize,
        after: [Row<E, S, C>; W],
    ) {
        let mut window = after;
        for p in 0..W {
            window[p] = after[W - 1 - p];
        }
        self.substitute::<V, E, R, C, false>(level, x, first, window);
    }

    /// Solves `L y = x` from the first row to the last (`FORWARD`), or `D L^T x = y` from the last to the first, in
    /// place. `window` has the `W` rows of the solution before these, the nearest one last. Returned are the last `W`
    /// rows of the solution.
    #[inline(always)]
    fn substitute<V, E, const R: usize, const C: usize, const FORWARD: bool>(
        &self,
        level: V,
        mut x: EndRows<'_, E, R>,
        first: usize,
        window: [Row<E, S, C>; W],
    ) -> [Row<E, S, C>; W]
    where
        V: PairLevel,
        E: RightHandSide<D>,
    {
        let n = x.top.len();
        // Only plain numbers are solved in blocks of W rows. As constants, these conditions compile no blocks for
        // others.
        let single = if const { E::PLAIN } { n % W } else { n };
        // The first rows make the remaining number a multiple of W.
        let window =
            self.substitute_rows::<V, E, R, C, FORWARD, 1>(level, &mut x, 0..single, first, window);
        if const { E::PLAIN } {
            self.substitute_rows::<V, E, R, C, FORWARD, W>(level, &mut x, single..n, first, window)
        } else {
            window
        }
    }

    /// [`substitute`](Self::substitute) for the given `rows`, which are counted in the order of their solution, in
    /// blocks of `B` rows (1 or `W`). In a block of `W` rows, each takes the place in the window of the one `W` rows
    /// before it, so that no row is moved.
    #[inline(always)]
    fn substitute_rows<V, E, const R: usize, const C: usize, const FORWARD: bool, const B: usize>(
        &self,
        level: V,
        x: &mut EndRows<'_, E, R>,
        rows: Range<usize>,
        first: usize,
        mut window: [Row<E, S, C>; W],
    ) -> [Row<E, S, C>; W]
    where
        V: PairLevel,
        E: RightHandSide<D>,
    {
        // Blocks of factors and right-hand sides from both ends; the second band runs in reverse order.
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
                // In two parts, each short enough for a compiler to unroll.
                unrolled!(PART in 1 0, PARTS: {
                    let end = if PART == 1 { W } else { W / 2 };
                    for p in (PART * (W / 2)..end).rev() {
                        let factors: &[D; S] = match FORWARD {
                            true if p < j => &own[block][j - 1 - p][p],
                            true => &before[W + j - 1 - p][p],
                            false => &own[block][j][p],
                        };
                        subtract_products(level, &mut row, &window[(I + W - 1 - p) % W], factors);
                    }
                });
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
            // A single row moves the window; a block of W rows has replaced all of it.
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
