//! Factors `L D L^T` of one band matrix, eliminated from both ends at once (see [`banded`](crate::numerics::banded)).
//!
//! [`Ldlt`] factors the rows and columns of a range, of a matrix or of `scale diag(d) + factor matrix`, without row
//! exchanges. Both ends are factored by `Elimination` with two bands, then the Schur complement of `W` or `W + 1` rows
//! in the middle. A pivot that is zero or not finite is an error with its row. It solves in place for several
//! right-hand sides in blocks (rows outside of the range become zero) and counts negative pivots, as many as negative
//! eigenvalues. On x86-64 with AVX2 and FMA, numbers without derivatives use vector instructions. A matrix that is not
//! symmetric gets [`BandLu`] factors instead, whose negative pivots are no count of eigenvalues.

use crate::numerics::banded::columns::WeightedSum;
use crate::numerics::banded::elimination::{BandColumn, Elimination};
use crate::numerics::banded::lu::BandLu;
use crate::numerics::banded::products::unrolled;
use crate::numerics::banded::substitution::EndRows;
use crate::numerics::banded::{BandMatrix, array_mut};
use crate::numerics::scalar::Scalar;
use crate::numerics::simd::PairLevel;
use crate::numerics::tangent::{Factors, RightHandSide, Singular, UnsymmetricTangent};
use std::ops::Range;

/// The factors of a range of rows and columns of a [`BandMatrix`]: `L D L^T`, or `L U` if it is not symmetric.
#[derive(Clone, Debug)]
pub struct Ldlt<D, const W: usize> {
    /// Eliminations from the first row downwards and from the last upwards.
    ends: Elimination<D, W, 2>,
    /// Schur complement of the ends: the `W` or `W + 1` rows between them; fewer in a short range without ends.
    schur: BandMatrix<D, W>,
    /// Elimination of the Schur complement.
    middle: Elimination<D, W, 1>,
    /// Rows and columns of the last factored matrix that are factored.
    range: Range<usize>,
    /// The factors `L U` where the last matrix was not symmetric; else none.
    unsymmetric: Option<Box<BandLu<D, W>>>,
}

/// A factorization as work for a vector unit. A closure instead would be compiled without its instructions.
#[cfg(target_arch = "x86_64")]
struct Factor<'a, V, D, const W: usize> {
    level: V,
    factors: &'a mut Ldlt<D, W>,
    sum: WeightedSum<'a, D, W>,
}

#[cfg(target_arch = "x86_64")]
impl<V: PairLevel, D: Scalar, const W: usize> pulp::NullaryFnOnce for Factor<'_, V, D, W> {
    type Output = Result<(), Singular>;

    /// Factors the matrix, compiled for the instruction set of the caller. An error has the row of a singular pivot.
    #[inline(always)]
    fn call(self) -> Self::Output {
        self.factors.eliminate_inlined(self.level, self.sum)
    }
}

/// The solution of linear systems, in place in `x`, as work for a vector unit.
#[cfg(target_arch = "x86_64")]
struct Solve<'a, V, D, E, const W: usize, const R: usize> {
    level: V,
    factors: &'a Ldlt<D, W>,
    x: &'a mut [[E; R]],
}

#[cfg(target_arch = "x86_64")]
impl<V, D, E, const W: usize, const R: usize> pulp::NullaryFnOnce for Solve<'_, V, D, E, W, R>
where
    V: PairLevel,
    D: Scalar,
    E: RightHandSide<D>,
{
    type Output = ();

    /// Solves the systems in place, compiled for the instruction set of the caller.
    #[inline(always)]
    fn call(self) {
        self.factors.solve_blocks(self.level, self.x);
    }
}

/// The largest number of right-hand sides at once whose window of solved rows fits into the vector registers.
/// `is_wide`: registers have four numbers instead of two; `is_narrow`: the half-bandwidth is at most 5.
const fn most_at_once(is_wide: bool, is_narrow: bool) -> usize {
    match (is_wide, is_narrow) {
        (true, true) => 4,
        (true, false) | (false, true) => 2,
        (false, false) => 1,
    }
}

impl<D: Scalar, const W: usize> Ldlt<D, W> {
    /// Allocates the factors of matrices of order `n`; they are not yet computed, and their range is empty.
    pub fn with_order(n: usize) -> Self {
        Self {
            ends: Elimination::with_order(n / 2),
            schur: BandMatrix::zeros(W + 1),
            middle: Elimination::with_order(W + 1),
            range: 0..0,
            unsymmetric: None,
        }
    }
}

impl<D: Scalar, const W: usize> Factors<D> for Ldlt<D, W> {
    type Matrix = BandMatrix<D, W>;

    /// Factors the rows and columns of `range` of the matrix, as `L D L^T`, or as `L U` if it is not symmetric, and
    /// replaces earlier factors. Allocates nothing for a symmetric matrix. An error has the row of a pivot that is zero
    /// or not finite.
    fn factor(&mut self, matrix: &BandMatrix<D, W>, range: Range<usize>) -> Result<(), Singular> {
        let diagonal = &matrix.diagonal;
        self.factor_sum(diagonal, D::from(0.0), matrix, D::from(1.0), range)
    }

    /// Factors `scale diag(diagonal) + factor matrix` over `range` without forming it, as `L D L^T`, or as `L U` for an
    /// unsymmetric `matrix`. Earlier factors are replaced. An error has the row of a pivot that is zero or not finite.
    fn factor_sum(
        &mut self,
        diagonal: &[D],
        scale: D,
        matrix: &BandMatrix<D, W>,
        factor: D,
        range: Range<usize>,
    ) -> Result<(), Singular> {
        if !matrix.is_symmetric() {
            self.range = range.clone();
            let factors = self.unsymmetric.get_or_insert_with(|| Box::new(BandLu::new()));
            return factors.factor(diagonal, scale, matrix, factor, range);
        }
        self.unsymmetric = None;
        let Range { start, end } = range;
        self.eliminate(WeightedSum { masses: &diagonal[..end], scale, matrix, factor, start, end })
    }

    /// Number of negative pivots. For a symmetric matrix it is the number of negative eigenvalues (Sylvester's law of
    /// inertia); for another one its parity is that of the sign of the determinant.
    fn negative_pivots(&self) -> usize {
        if let Some(factors) = &self.unsymmetric {
            return factors.negative_pivots();
        }
        let m = self.end_rows();
        self.ends.negative_pivots(m) + self.middle.negative_pivots(self.range.len() - 2 * m)
    }

    /// Solves `A x = b` in place for `R` right-hand sides (`x[i][r]` is row `i` of number `r`), over the factored
    /// range. Rows outside of it become zero.
    fn solve_many<E: RightHandSide<D>, const R: usize>(&self, x: &mut [[E; R]]) {
        let Range { start, end } = self.range;
        // Rows outside of the range belong to held unknowns, which do not change.
        x[..start].fill([E::from(0.0); R]);
        x[end..].fill([E::from(0.0); R]);
        let x = &mut x[start..end];
        if let Some(factors) = &self.unsymmetric {
            return factors.solve(x);
        }
        #[cfg(target_arch = "x86_64")]
        if const { E::PLAIN }
            && let Some(level) = pulp::x86::V3::try_new()
        {
            return level.vectorize(Solve { level, factors: self, x });
        }
        self.solve_blocks((), x);
    }
}

impl<D: Scalar, const W: usize> Ldlt<D, W> {
    /// Factors a matrix over its range, with AVX2 instructions for numbers without derivatives if the processor has
    /// them. An error has the row of a pivot that is zero or not finite.
    fn eliminate(&mut self, sum: WeightedSum<'_, D, W>) -> Result<(), Singular> {
        #[cfg(target_arch = "x86_64")]
        if const { D::PLAIN }
            && let Some(level) = pulp::x86::V3::try_new()
        {
            return level.vectorize(Factor { level, factors: self, sum });
        }
        self.eliminate_inlined((), sum)
    }

    /// Factors a matrix with the instructions of `level`: both ends at once, the Schur complement of the rows between
    /// them, then these rows. An error has the row of a pivot that is zero or not finite.
    #[inline(always)]
    fn eliminate_inlined<V: PairLevel>(
        &mut self,
        level: V,
        sum: WeightedSum<'_, D, W>,
    ) -> Result<(), Singular> {
        let WeightedSum { matrix, factor, start, end, .. } = sum;
        self.range = start..end;
        let m = self.end_rows();
        let Self { ends, schur, middle, .. } = self;
        ends.eliminate(level, m, &sum.end_columns(m)).map_err(|singular| Singular {
            row: [start + singular.column, end - 1 - singular.column][singular.band],
        })?;

        // The Schur complement: the rows in the middle, without their couplings to the ends, and the updates by both.
        let (first, n) = (start + m, end - start - 2 * m);
        let rows = &matrix.below[first..first + n];
        for (i, (row, to)) in rows.iter().zip(&mut schur.below).enumerate() {
            schur.diagonal[i] = sum.diagonal(first + i);
            for p in 0..W {
                to[p] = if i + 1 + p < n { row[p] * factor } else { D::from(0.0) };
            }
        }
        // Updates of the Schur complement: by the top in order, by the bottom mirrored.
        if m > 0 {
            unrolled!(C in 0 1 2 3 4 5 6 7 8 9, W: {
                let BandColumn { diagonal, below } = ends.schur_update::<V, C>(level, m);
                schur.diagonal[C] += diagonal[0];
                schur.diagonal[n - 1 - C] += diagonal[1];
                for p in 0..W {
                    schur.below[C][p] += below[p][0];
                }
                let rows: &mut [[D; W]; W] = array_mut(&mut schur.below, n - W);
                for p in 0..W - 1 - C {
                    rows[W - 2 - C - p][p] += below[p][1];
                }
            });
        }
        middle
            .eliminate(level, n, schur)
            .map_err(|singular| Singular { row: first + singular.column })
    }

    /// Number of rows that are eliminated from either end: half of the rows of the range less `W`, rounded down; 0 if
    /// it has at most `W + 1`. At least `W` rows remain in the middle (all in a shorter range), so that the ends are
    /// not coupled.
    fn end_rows(&self) -> usize {
        self.range.len().saturating_sub(W) / 2
    }

    /// Solves in place for all `R` right-hand sides, in blocks of 4 if registers have four numbers and `W <= 5`, of 2
    /// if one of both holds, else of 1. The remaining ones take smaller blocks.
    #[inline(always)]
    fn solve_blocks<V: PairLevel, E: RightHandSide<D>, const R: usize>(
        &self,
        level: V,
        x: &mut [[E; R]],
    ) {
        let mut done = 0;
        // Conditions of constants, so that blocks that do not occur are not compiled.
        if const { R >= 4 && most_at_once(V::WIDE, Elimination::<D, W, 2>::NARROW) >= 4 } {
            while done + 4 <= R {
                self.solve_block::<V, E, R, 4>(level, x, done);
                done += 4;
            }
        }
        if const { R >= 2 && most_at_once(V::WIDE, Elimination::<D, W, 2>::NARROW) >= 2 } {
            while done + 2 <= R {
                self.solve_block::<V, E, R, 2>(level, x, done);
                done += 2;
            }
        }
        while done < R {
            self.solve_block::<V, E, R, 1>(level, x, done);
            done += 1;
        }
    }

    /// Solves in place for the `C` right-hand sides from index `first` on: forward substitution from both ends,
    /// solution in the middle, backward substitution to both ends.
    #[inline(always)]
    fn solve_block<V: PairLevel, E: RightHandSide<D>, const R: usize, const C: usize>(
        &self,
        level: V,
        x: &mut [[E; R]],
        first: usize,
    ) {
        let m = self.end_rows();
        let (top, rest) = x.split_at_mut(m);
        let (middle, bottom) = rest.split_at_mut(rest.len() - m);
        let n = middle.len();
        // Forward substitution from both ends, whose updates reach the middle rows.
        let updates = self.ends.forward::<V, E, R, C>(level, EndRows { top, bottom }, first);
        for p in 0..W.min(n) {
            for r in 0..C {
                middle[p][first + r] += updates[p][r][0];
                middle[n - 1 - p][first + r] += updates[p][r][1];
            }
        }
        self.middle.forward::<V, E, R, C>(level, EndRows { top: middle, bottom: &mut [] }, first);
        self.middle.backward::<V, E, R, C>(
            level,
            EndRows { top: middle, bottom: &mut [] },
            first,
            [[[E::from(0.0)]; C]; W],
        );
        // Backward substitution begins in the middle and continues to both ends.
        let mut after = [[[E::from(0.0); 2]; C]; W];
        for p in 0..W.min(n) {
            for r in 0..C {
                after[p][r] = [middle[p][first + r], middle[n - 1 - p][first + r]];
            }
        }
        self.ends.backward::<V, E, R, C>(level, EndRows { top, bottom }, first, after);
    }
}
