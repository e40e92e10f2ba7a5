//! L D L^T of one band, from both ends at once.

use crate::numerics::banded::elimination::{Column, Columns, Elimination};
use crate::numerics::banded::{BandMatrix, array};
use crate::numerics::scalar::Scalar;
use crate::numerics::simd::{has_simd, with_simd};
use crate::numerics::tangent::{Factors, RightHandSide, Singular, Tangent};
use std::ops::Range;

/// The factors L D L^T of a [`BandMatrix`], restricted to a range of its rows and columns.
#[derive(Clone, Debug)]
pub struct Ldlt<D, const W: usize> {
    /// From the first row downwards and from the last upwards.
    ends: Elimination<D, W, 2>,
    /// What the ends leave of the matrix between them, `W` or `W + 1` rows; fewer in a short range,
    /// which has no ends.
    rest: BandMatrix<D, W>,
    middle: Elimination<D, W, 1>,
    range: Range<usize>,
}

/// The matrix that is factored, `diag(masses) * scale + factor * matrix`, or without masses, over the rows and columns
/// from `start` to `end`.
#[derive(Clone, Copy)]
struct Sum<'a, D, const W: usize> {
    masses: Option<(&'a [D], D)>,
    matrix: &'a BandMatrix<D, W>,
    factor: D,
    start: usize,
    end: usize,
}

impl<D: Scalar, const W: usize> Sum<'_, D, W> {
    /// The entry of row and column `j`.
    #[inline(always)]
    fn diagonal(&self, j: usize) -> D {
        let own = self.matrix.diagonal[j] * self.factor;
        self.masses.map_or(own, |(masses, scale)| masses[j] * scale + own)
    }
    /// One below the diagonal, where the matrix has `entry`.
    #[inline(always)]
    fn below(&self, entry: D) -> D {
        entry * self.factor
    }
}

/// The columns from the first row downwards and from the last upwards.
impl<D: Scalar, const W: usize> Columns<D, W, 2> for Sum<'_, D, W> {
    #[inline(always)]
    fn column(&self, k: usize) -> Column<D, W, 2> {
        let below = &self.matrix.below;
        let (top, bottom) = (self.start + k, self.end - 1 - k);
        // Downwards from `top`, and leftwards from `bottom`: row bottom of the columns before.
        let (down, left): (_, &[[D; W]; W]) = (&below[top], array(below, bottom - W));
        let mut column = [[D::from(0.0); 2]; W];
        for p in 0..W {
            column[p] = [self.below(down[p]), self.below(left[W - 1 - p][p])];
        }
        ([self.diagonal(top), self.diagonal(bottom)], column)
    }
}

impl<D: Scalar, const W: usize> Columns<D, W, 1> for BandMatrix<D, W> {
    #[inline(always)]
    fn column(&self, k: usize) -> Column<D, W, 1> {
        let mut column = [[D::from(0.0)]; W];
        for p in 0..W {
            column[p] = [self.below[k][p]];
        }
        ([self.diagonal[k]], column)
    }
}

/// What is factored on a vector unit.
struct Factor<'a, D, const W: usize> {
    factors: &'a mut Ldlt<D, W>,
    of: Sum<'a, D, W>,
}

impl<D: Scalar, const W: usize> pulp::NullaryFnOnce for Factor<'_, D, W> {
    type Output = Result<(), Singular>;

    #[inline(always)]
    fn call(self) -> Self::Output {
        self.factors.eliminate_here(self.of)
    }
}

/// What is solved there.
struct Solve<'a, D, E, const W: usize, const R: usize> {
    factors: &'a Ldlt<D, W>,
    x: &'a mut [[E; R]],
}

impl<D: Scalar, E: RightHandSide<D>, const W: usize, const R: usize> pulp::NullaryFnOnce
    for Solve<'_, D, E, W, R>
{
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.factors.solve_in_turn::<E, R, true>(self.x);
    }
}

impl<D: Scalar, const W: usize> Factors<D> for Ldlt<D, W> {
    type Matrix = BandMatrix<D, W>;

    fn with_order(n: usize) -> Self {
        Self {
            ends: Elimination::with_order(n / 2),
            rest: BandMatrix::zeros(W + 1),
            middle: Elimination::with_order(W + 1),
            range: 0..0,
        }
    }

    fn factor(&mut self, matrix: &BandMatrix<D, W>, range: Range<usize>) -> Result<(), Singular> {
        let Range { start, end } = range;
        self.eliminate(Sum { masses: None, matrix, factor: D::from(1.0), start, end })
    }

    fn factor_sum(
        &mut self,
        diagonal: &[D],
        scale: D,
        matrix: &BandMatrix<D, W>,
        factor: D,
        range: Range<usize>,
    ) -> Result<(), Singular> {
        let Range { start, end } = range;
        let masses = Some((&diagonal[..end], scale));
        self.eliminate(Sum { masses, matrix, factor, start, end })
    }

    fn negative_pivots(&self) -> usize {
        let m = self.at_each_end();
        self.ends.negative_pivots(m) + self.middle.negative_pivots(self.range.len() - 2 * m)
    }

    fn solve_many<E: RightHandSide<D>, const R: usize>(&self, x: &mut [[E; R]]) {
        let Range { start, end } = self.range;
        x[..start].fill([E::from(0.0); R]);
        x[end..].fill([E::from(0.0); R]);
        let x = &mut x[start..end];
        match E::PLAIN && has_simd() {
            true => with_simd(Solve { factors: self, x }),
            false => self.solve_in_turn::<E, R, false>(x),
        }
    }
}

impl<D: Scalar, const W: usize> Ldlt<D, W> {
    fn eliminate(&mut self, of: Sum<'_, D, W>) -> Result<(), Singular> {
        match D::PLAIN {
            true => with_simd(Factor { factors: self, of }),
            false => self.eliminate_here(of),
        }
    }

    #[inline(always)]
    fn eliminate_here(&mut self, of: Sum<'_, D, W>) -> Result<(), Singular> {
        let Sum { matrix, start, end, .. } = of;
        self.range = start..end;
        let m = self.at_each_end();
        let Self { ends, rest, middle, .. } = self;
        ends.eliminate(m, &of)
            .map_err(|(k, end_of)| Singular { row: [start + k, end - 1 - k][end_of] })?;

        let (first, n) = (start + m, end - start - 2 * m);
        for i in 0..n {
            rest.diagonal[i] = of.diagonal(first + i);
            for p in 0..W {
                rest.below[i][p] = of.below(matrix.below[first + i][p]);
            }
        }
        // Nothing couples to what lies beyond.
        for i in n.saturating_sub(W)..n {
            for p in n - 1 - i..W {
                rest.below[i][p] = D::from(0.0);
            }
        }
        if m > 0 {
            for c in 0..W {
                let (pivot, column) = ends.update(m, c);
                rest.diagonal[c] += pivot[0];
                rest.diagonal[n - 1 - c] += pivot[1];
                for p in 0..W - 1 - c {
                    rest.below[c][p] += column[p][0];
                    rest.below[n - 2 - c - p][p] += column[p][1];
                }
            }
        }
        middle.eliminate(n, rest).map_err(|(i, _)| Singular { row: first + i })
    }

    /// How many rows are eliminated from either end: as many as leave `W` rows, so that what one
    /// end changes is nothing that the other reads.
    fn at_each_end(&self) -> usize {
        self.range.len().saturating_sub(W) / 2
    }

    /// Solves for all right-hand sides, as many at once as there are registers for, which may be `WIDE`.
    #[inline(always)]
    fn solve_in_turn<E: RightHandSide<D>, const R: usize, const WIDE: bool>(
        &self,
        x: &mut [[E; R]],
    ) {
        let at_once = match (WIDE, Elimination::<D, W, 2>::NARROW) {
            (true, true) => 4,
            (true, false) | (false, true) => 2,
            (false, false) => 1,
        };
        let mut done = 0;
        while at_once >= 4 && done + 4 <= R {
            self.solve_some::<E, R, 4>(x, done);
            done += 4;
        }
        while at_once >= 2 && done + 2 <= R {
            self.solve_some::<E, R, 2>(x, done);
            done += 2;
        }
        while done < R {
            self.solve_some::<E, R, 1>(x, done);
            done += 1;
        }
    }

    /// Solves for `C` right-hand sides from `first` on.
    #[inline(always)]
    fn solve_some<E: RightHandSide<D>, const R: usize, const C: usize>(
        &self,
        x: &mut [[E; R]],
        first: usize,
    ) {
        let m = self.at_each_end();
        let (top, rest) = x.split_at_mut(m);
        let (middle, bottom) = rest.split_at_mut(rest.len() - m);
        let n = middle.len();
        let sums = self.ends.forward::<E, R, C>([top, bottom], first);
        for p in 0..W.min(n) {
            for r in 0..C {
                middle[p][first + r] += sums[p][r][0];
                middle[n - 1 - p][first + r] += sums[p][r][1];
            }
        }
        self.middle.forward::<E, R, C>([middle], first);
        self.middle.backward::<E, R, C>([middle], first, [[[E::from(0.0)]; C]; W]);
        let mut after = [[[E::from(0.0); 2]; C]; W];
        for p in 0..W.min(n) {
            for r in 0..C {
                after[p][r] = [middle[p][first + r], middle[n - 1 - p][first + r]];
            }
        }
        self.ends.backward::<E, R, C>([top, bottom], first, after);
    }
}
