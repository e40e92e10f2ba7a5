//! `L D L^T` of one band matrix, eliminated from both ends at once (see [`banded`](crate::numerics::banded)).

use crate::numerics::banded::elimination::{BandColumn, ColumnSource, Elimination};
use crate::numerics::banded::{BandMatrix, array};
use crate::numerics::scalar::Scalar;
use crate::numerics::simd::{has_simd, with_simd};
use crate::numerics::tangent::{Factors, RightHandSide, Singular, Tangent};
use std::ops::Range;

/// The factors `L D L^T` of a range of rows and columns of a [`BandMatrix`].
#[derive(Clone, Debug)]
pub struct Ldlt<D, const W: usize> {
    /// Eliminations from the first row downwards and from the last upwards.
    ends: Elimination<D, W, 2>,
    /// Schur complement of the ends: the `W` or `W + 1` rows between them; fewer in a short range without ends.
    schur: BandMatrix<D, W>,
    /// Elimination of the Schur complement.
    middle: Elimination<D, W, 1>,
    range: Range<usize>,
}

/// The matrix `scale diag(masses) + factor matrix`, without masses `factor matrix`, over the rows and columns from `start`
/// to `end`.
#[derive(Clone, Copy)]
struct WeightedSum<'a, D, const W: usize> {
    masses: Option<&'a [D]>,
    scale: D,
    matrix: &'a BandMatrix<D, W>,
    factor: D,
    start: usize,
    end: usize,
}

impl<D: Scalar, const W: usize> WeightedSum<'_, D, W> {
    /// The entry of row and column `j`.
    #[inline(always)]
    fn diagonal(&self, j: usize) -> D {
        let own = self.matrix.diagonal[j] * self.factor;
        match self.masses {
            Some(masses) => masses[j] * self.scale + own,
            None => own,
        }
    }
}

/// The columns from the first row downwards and from the last upwards.
impl<D: Scalar, const W: usize> ColumnSource<D, W, 2> for WeightedSum<'_, D, W> {
    #[inline(always)]
    fn column(&self, k: usize) -> BandColumn<D, W, 2> {
        let entries = &self.matrix.below;
        let (top, bottom) = (self.start + k, self.end - 1 - k);
        // Below the diagonal of column `top`, and left of the diagonal of row `bottom`.
        let (down, left): (_, &[[D; W]; W]) = (&entries[top], array(entries, bottom - W));
        let mut below = [[D::from(0.0); 2]; W];
        for p in 0..W {
            below[p] = [down[p] * self.factor, left[W - 1 - p][p] * self.factor];
        }
        BandColumn { diagonal: [self.diagonal(top), self.diagonal(bottom)], below }
    }
}

impl<D: Scalar, const W: usize> ColumnSource<D, W, 1> for BandMatrix<D, W> {
    #[inline(always)]
    fn column(&self, k: usize) -> BandColumn<D, W, 1> {
        let mut below = [[D::from(0.0)]; W];
        for p in 0..W {
            below[p] = [self.below[k][p]];
        }
        BandColumn { diagonal: [self.diagonal[k]], below }
    }
}

/// A factorization as work for a vector unit. A closure instead would be compiled without its instructions.
struct Factor<'a, D, const W: usize> {
    factors: &'a mut Ldlt<D, W>,
    sum: WeightedSum<'a, D, W>,
}

impl<D: Scalar, const W: usize> pulp::NullaryFnOnce for Factor<'_, D, W> {
    type Output = Result<(), Singular>;

    #[inline(always)]
    fn call(self) -> Self::Output {
        self.factors.eliminate_inlined(self.sum)
    }
}

/// A solution of linear systems, likewise.
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
        self.factors.solve_blocks::<E, R, true>(self.x);
    }
}

impl<D: Scalar, const W: usize> Factors<D> for Ldlt<D, W> {
    type Matrix = BandMatrix<D, W>;

    fn with_order(n: usize) -> Self {
        Self {
            ends: Elimination::with_order(n / 2),
            schur: BandMatrix::zeros(W + 1),
            middle: Elimination::with_order(W + 1),
            range: 0..0,
        }
    }

    fn factor(&mut self, matrix: &BandMatrix<D, W>, range: Range<usize>) -> Result<(), Singular> {
        let Range { start, end } = range;
        let one = D::from(1.0);
        self.eliminate(WeightedSum { masses: None, scale: one, matrix, factor: one, start, end })
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
        let masses = Some(&diagonal[..end]);
        self.eliminate(WeightedSum { masses, scale, matrix, factor, start, end })
    }

    fn negative_pivots(&self) -> usize {
        let m = self.end_rows();
        self.ends.negative_pivots(m) + self.middle.negative_pivots(self.range.len() - 2 * m)
    }

    fn solve_many<E: RightHandSide<D>, const R: usize>(&self, x: &mut [[E; R]]) {
        let Range { start, end } = self.range;
        x[..start].fill([E::from(0.0); R]);
        x[end..].fill([E::from(0.0); R]);
        let x = &mut x[start..end];
        match E::PLAIN && has_simd() {
            true => with_simd(Solve { factors: self, x }),
            false => self.solve_blocks::<E, R, false>(x),
        }
    }
}

impl<D: Scalar, const W: usize> Ldlt<D, W> {
    /// Factors a matrix, with vector instructions for numbers without derivatives.
    fn eliminate(&mut self, sum: WeightedSum<'_, D, W>) -> Result<(), Singular> {
        match D::PLAIN {
            true => with_simd(Factor { factors: self, sum }),
            false => self.eliminate_inlined(sum),
        }
    }

    /// Factors a matrix.
    #[inline(always)]
    fn eliminate_inlined(&mut self, sum: WeightedSum<'_, D, W>) -> Result<(), Singular> {
        let WeightedSum { matrix, factor, start, end, .. } = sum;
        self.range = start..end;
        let m = self.end_rows();
        let Self { ends, schur, middle, .. } = self;
        ends.eliminate(m, &sum).map_err(|singular| Singular {
            row: [start + singular.column, end - 1 - singular.column][singular.band],
        })?;

        // The Schur complement: the rows in the middle, without their couplings to the ends, and the updates by both.
        let (first, n) = (start + m, end - start - 2 * m);
        for i in 0..n {
            schur.diagonal[i] = sum.diagonal(first + i);
            for p in 0..W {
                schur.below[i][p] = matrix.below[first + i][p] * factor;
            }
        }
        for i in n.saturating_sub(W)..n {
            for p in n - 1 - i..W {
                schur.below[i][p] = D::from(0.0);
            }
        }
        if m > 0 {
            for c in 0..W {
                let BandColumn { diagonal, below } = ends.schur_update(m, c);
                schur.diagonal[c] += diagonal[0];
                schur.diagonal[n - 1 - c] += diagonal[1];
                for p in 0..W - 1 - c {
                    schur.below[c][p] += below[p][0];
                    schur.below[n - 2 - c - p][p] += below[p][1];
                }
            }
        }
        middle.eliminate(n, schur).map_err(|singular| Singular { row: first + singular.column })
    }

    /// Number of rows that are eliminated from either end. At least `W` rows remain, so that the ends are not coupled.
    fn end_rows(&self) -> usize {
        self.range.len().saturating_sub(W) / 2
    }

    /// Solves for all right-hand sides, in blocks of as many as the registers hold; `WIDE` registers have four numbers.
    #[inline(always)]
    fn solve_blocks<E: RightHandSide<D>, const R: usize, const WIDE: bool>(
        &self,
        x: &mut [[E; R]],
    ) {
        let block = match (WIDE, Elimination::<D, W, 2>::NARROW) {
            (true, true) => 4,
            (true, false) | (false, true) => 2,
            (false, false) => 1,
        };
        let mut done = 0;
        while block >= 4 && done + 4 <= R {
            self.solve_block::<E, R, 4>(x, done);
            done += 4;
        }
        while block >= 2 && done + 2 <= R {
            self.solve_block::<E, R, 2>(x, done);
            done += 2;
        }
        while done < R {
            self.solve_block::<E, R, 1>(x, done);
            done += 1;
        }
    }

    /// Solves for `C` right-hand sides from index `first` on: forward from both ends, in the middle, and backward.
    #[inline(always)]
    fn solve_block<E: RightHandSide<D>, const R: usize, const C: usize>(
        &self,
        x: &mut [[E; R]],
        first: usize,
    ) {
        let m = self.end_rows();
        let (top, rest) = x.split_at_mut(m);
        let (middle, bottom) = rest.split_at_mut(rest.len() - m);
        let n = middle.len();
        let updates = self.ends.forward::<E, R, C>([top, bottom], first);
        for p in 0..W.min(n) {
            for r in 0..C {
                middle[p][first + r] += updates[p][r][0];
                middle[n - 1 - p][first + r] += updates[p][r][1];
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
