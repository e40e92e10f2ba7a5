//! The tangent of an assembly and its factors: one band for each rod, bordered by the coordinates of the bodies.
//!
//! ```text
//! | A1      B1 | | x1 |   | b1 |          S = C - sum Bi' Ai^-1 Bi
//! |    A2   B2 | | x2 | = | b2 |          S z = c - sum Bi' Ai^-1 bi
//! | B1' B2' C  | | z  |   | c  |          xi = Ai^-1 bi - Ai^-1 Bi z
//! ```
//!
//! `Bi` has entries in four rows beside each carried end. The Schur complement `S` is an [envelope](Envelope). The
//! numbers of negative pivots of all `Ai` and of `S` add up to that of the whole matrix.

use crate::numerics::banded::{BandMatrix, Ldlt};
use crate::numerics::envelope::Envelope;
use crate::numerics::scalar::Scalar;
use crate::numerics::simd::with_simd;
use crate::numerics::tangent::{Factors, RightHandSide, Singular, Tangent};
use crate::rod::planar::HALF_BANDWIDTH;
use std::ops::Range;

/// Rows of a rod that are coupled to a carried end: two nodes.
pub(super) const ROWS: usize = 4;
/// Columns of `Ai^-1 Bi` that are solved for together: those of both ends of a rod, in two registers.
const GROUP: usize = 8;

/// Second derivatives between the rows beside a carried end and the coordinates that carry it.
#[derive(Clone, Debug)]
pub struct Coupling<D> {
    /// The rows, counted from the first unknown of the rod.
    pub rows: Range<usize>,
    /// The coordinates, counted from the first one of all bodies.
    pub columns: Vec<usize>,
    /// Entries of each column.
    pub entries: Vec<[D; ROWS]>,
}

/// The part of a tangent that belongs to a rod.
#[derive(Clone, Debug)]
pub struct MemberTangent<D> {
    /// Second derivatives by the unknowns of the rod; rows and columns of carried and fixed nodes are those of the
    /// identity.
    pub band: BandMatrix<D, HALF_BANDWIDTH>,
    /// The unknowns of the rod.
    pub range: Range<usize>,
    /// Couplings of its carried ends.
    pub couplings: Vec<Coupling<D>>,
}

/// The second derivatives of the energy of an assembly, N/m.
#[derive(Clone, Debug)]
pub struct AssemblyTangent<D> {
    /// One per rod.
    pub members: Vec<MemberTangent<D>>,
    /// Second derivatives by the coordinates of bodies.
    pub bodies: Envelope<D>,
}

impl<D: Scalar> AssemblyTangent<D> {
    /// The first coordinate of the bodies.
    fn first(&self) -> usize {
        self.members.last().map_or(0, |member| member.range.end)
    }

    /// The rod with unknown `i`, and the unknown counted from its first; none for a coordinate of bodies.
    fn member(&self, i: usize) -> Option<(usize, usize)> {
        let k = self.members.partition_point(|member| member.range.end <= i);
        self.members.get(k).map(|member| (k, i - member.range.start))
    }
}

impl<D: Scalar> Tangent<D> for AssemblyTangent<D> {
    const NUMBERS_PER_ROW: usize = HALF_BANDWIDTH + 1;
    type Factors = AssemblyFactors<D>;

    /// Factors for matrices of this sparsity pattern, not yet computed.
    fn new_factors(&self) -> AssemblyFactors<D> {
        let member = |member: &MemberTangent<D>| MemberFactors {
            band: member.band.new_factors(),
            range: member.range.clone(),
            couplings: member.couplings.clone(),
            responses: Vec::new(),
            room: Vec::new(),
        };
        AssemblyFactors {
            members: self.members.iter().map(member).collect(),
            schur: self.bodies.clone(),
        }
    }

    /// The entry of row `i`, column `j`; zero outside the pattern.
    fn get(&self, i: usize, j: usize) -> D {
        let (low, high, first) = (i.min(j), i.max(j), self.first());
        match (self.member(low), self.member(high)) {
            (Some((k, row)), Some((other, column))) if k == other => {
                self.members[k].band.get(row, column)
            }
            (Some((k, row)), None) => {
                let mut sum = D::from(0.0);
                for coupling in &self.members[k].couplings {
                    let column = coupling.columns.iter().position(|c| *c == high - first);
                    if let (true, Some(column)) = (coupling.rows.contains(&row), column) {
                        sum += coupling.entries[column][row - coupling.rows.start];
                    }
                }
                sum
            }
            (None, None) => self.bodies.get(high - first, low - first),
            _ => D::from(0.0),
        }
    }

    /// A range with all rows that have an entry in column `j` of the matrix, whose order is `n`.
    fn coupled(&self, j: usize, n: usize) -> Range<usize> {
        match self.member(j) {
            Some((k, _)) if self.members[k].couplings.is_empty() => self.members[k].range.clone(),
            _ => 0..n,
        }
    }

    /// Adds the lower triangle of the leading `size` by `size` part of `block` to the entries from row and column
    /// `start` on.
    fn add_corner<const N: usize>(&mut self, start: usize, size: usize, block: &[[D; N]; N]) {
        let first = self.first();
        match self.member(start) {
            Some((k, row)) => self.members[k].band.add_corner(row, size, block),
            None => {
                for r in 0..size {
                    for c in 0..=r {
                        self.bodies.add(start - first + r, start - first + c, block[r][c]);
                    }
                }
            }
        }
    }

    /// Replaces row and column `i` by those of the identity.
    fn uncouple(&mut self, i: usize) {
        let first = self.first();
        if let Some((k, row)) = self.member(i) {
            self.members[k].band.uncouple(row);
            for coupling in &mut self.members[k].couplings {
                if coupling.rows.contains(&row) {
                    let at = row - coupling.rows.start;
                    coupling.entries.iter_mut().for_each(|column| column[at] = D::from(0.0));
                }
            }
            return;
        }
        self.bodies.uncouple(i - first);
        for coupling in self.members.iter_mut().flat_map(|member| &mut member.couplings) {
            for (column, entries) in coupling.columns.iter().zip(&mut coupling.entries) {
                if *column == i - first {
                    *entries = [D::from(0.0); ROWS];
                }
            }
        }
    }

    /// Sets every entry to zero.
    fn clear(&mut self) {
        self.bodies.clear();
        for member in &mut self.members {
            member.band.clear();
            for coupling in &mut member.couplings {
                coupling.entries.fill([D::from(0.0); ROWS]);
            }
        }
    }

    /// Adds `factor` times `other`.
    fn add_scaled(&mut self, other: &Self, factor: f64) {
        self.bodies.add_scaled(&other.bodies, factor);
        for (to, from) in self.members.iter_mut().zip(&other.members) {
            to.band.add_scaled(&from.band, factor);
            for (to, from) in to.couplings.iter_mut().zip(&from.couplings) {
                for (to, from) in to.entries.iter_mut().zip(&from.entries) {
                    (0..ROWS).for_each(|r| to[r] += from[r] * factor);
                }
            }
        }
    }

    /// Adds `A e_j x[g]`, column `j` times a number, to each vector `out[..][g]`.
    fn add_column<const G: usize>(&self, j: usize, x: [D; G], out: &mut [[D; G]]) {
        for i in self.coupled(j, out.len()) {
            let entry = self.get(i, j);
            (0..G).for_each(|g| out[i][g] += entry * x[g]);
        }
    }

    /// Adds `A x` to `out`, for `G` vectors.
    fn add_product<const G: usize>(&self, x: &[[D; G]], out: &mut [[D; G]]) {
        let first = self.first();
        let (rods, bodies) = x.split_at(first);
        let (to_rods, to_bodies) = out.split_at_mut(first);
        for member in &self.members {
            let (own, to) = (&rods[member.range.clone()], &mut to_rods[member.range.clone()]);
            member.band.add_product(own, to);
            for coupling in &member.couplings {
                let (own, to) = (&own[coupling.rows.clone()], &mut to[coupling.rows.clone()]);
                for (column, entries) in coupling.columns.iter().zip(&coupling.entries) {
                    for r in 0..ROWS {
                        for g in 0..G {
                            to[r][g] += entries[r] * bodies[*column][g];
                            to_bodies[*column][g] += entries[r] * own[r][g];
                        }
                    }
                }
            }
        }
        self.bodies.for_each(|i, j, entry| {
            for g in 0..G {
                to_bodies[i][g] += entry * bodies[j][g];
                if i != j {
                    to_bodies[j][g] += entry * bodies[i][g];
                }
            }
        });
    }

    /// Writes `|A| |x|` of the real parts to `out`: rounding errors of `A x` are proportional to it.
    fn absolute_product(&self, x: &[D], out: &mut [f64]) {
        let first = self.first();
        let (rods, bodies) = x.split_at(first);
        let (to_rods, to_bodies) = out[..x.len()].split_at_mut(first);
        to_bodies.fill(0.0);
        let size = |x: D| x.value().abs();
        for member in &self.members {
            let (own, to) = (&rods[member.range.clone()], &mut to_rods[member.range.clone()]);
            member.band.absolute_product(own, to);
            for coupling in &member.couplings {
                let (own, to) = (&own[coupling.rows.clone()], &mut to[coupling.rows.clone()]);
                for (column, entries) in coupling.columns.iter().zip(&coupling.entries) {
                    for r in 0..ROWS {
                        to[r] += size(entries[r]) * size(bodies[*column]);
                        to_bodies[*column] += size(entries[r]) * size(own[r]);
                    }
                }
            }
        }
        self.bodies.for_each(|i, j, entry| {
            to_bodies[i] += size(entry) * size(bodies[j]);
            if i != j {
                to_bodies[j] += size(entry) * size(bodies[i]);
            }
        });
    }
}

/// Factors of the band of a rod, with its couplings and their responses.
#[derive(Clone, Debug)]
struct MemberFactors<D> {
    band: Ldlt<D, HALF_BANDWIDTH>,
    range: Range<usize>,
    /// `Bi`.
    couplings: Vec<Coupling<D>>,
    /// The columns of `Ai^-1 Bi`; columns of all couplings, one after the other.
    responses: Vec<Vec<D>>,
    /// Columns that are solved for.
    room: Vec<[D; GROUP]>,
}

impl<D: Scalar> MemberFactors<D> {
    /// The coordinate of every column of all couplings.
    fn columns(&self) -> impl Iterator<Item = usize> {
        self.couplings.iter().flat_map(|coupling| coupling.columns.iter().copied())
    }

    /// Computes the responses, and subtracts `Bi' Ai^-1 Bi` from the Schur complement.
    fn eliminate(&mut self, schur: &mut Envelope<D>) {
        let Self { band, range, couplings, responses, room } = self;
        let count: usize = couplings.iter().map(|coupling| coupling.columns.len()).sum();
        let zero = D::from(0.0);
        responses.resize_with(count, || vec![zero; range.len()]);
        room.resize(range.len(), [zero; GROUP]);
        let mut columns = couplings.iter().flat_map(|coupling| {
            coupling.entries.iter().map(|entries| (coupling.rows.start, entries))
        });
        for group in responses.chunks_mut(GROUP) {
            room.fill([zero; GROUP]);
            for (g, (row, entries)) in columns.by_ref().take(group.len()).enumerate() {
                (0..ROWS).for_each(|r| room[row + r][g] = entries[r]);
            }
            band.solve_many(room);
            for (g, response) in group.iter_mut().enumerate() {
                response.iter_mut().zip(&*room).for_each(|(to, from)| *to = from[g]);
            }
        }
        for coupling in &self.couplings {
            for (row, entries) in coupling.columns.iter().zip(&coupling.entries) {
                for (column, response) in self.columns().zip(&self.responses) {
                    if column <= *row {
                        let response = &response[coupling.rows.clone()];
                        let mut sum = zero;
                        (0..ROWS).for_each(|r| sum += entries[r] * response[r]);
                        schur.add(*row, column, -sum);
                    }
                }
            }
        }
    }
}

/// Subtracts a column times numbers from vectors, as work for a vector unit.
struct LessColumn<'a, D, E, const R: usize> {
    x: &'a mut [[E; R]],
    column: &'a [D],
    factor: [E; R],
}

impl<D: Scalar, E: RightHandSide<D>, const R: usize> pulp::NullaryFnOnce
    for LessColumn<'_, D, E, R>
{
    type Output = ();

    /// Runs the computation, compiled for the instruction set of the caller.
    #[inline(always)]
    fn call(self) {
        let count = self.x.len().min(self.column.len());
        let (x, column) = (&mut self.x[..count], &self.column[..count]);
        for i in 0..count {
            for r in 0..R {
                x[i][r] -= self.factor[r] * column[i];
            }
        }
    }
}

/// The factors of an [`AssemblyTangent`].
#[derive(Clone, Debug)]
pub struct AssemblyFactors<D> {
    members: Vec<MemberFactors<D>>,
    /// Factors of the Schur complement.
    schur: Envelope<D>,
}

impl<D: Scalar> AssemblyFactors<D> {
    /// Factors `scale diag(diagonal) + factor matrix`.
    fn factor_weighted(
        &mut self,
        (diagonal, scale): (&[D], D),
        matrix: &AssemblyTangent<D>,
        factor: D,
    ) -> Result<(), Singular> {
        let first = matrix.first();
        self.schur.set_scaled(&matrix.bodies, factor);
        for (i, entry) in diagonal[first..].iter().enumerate() {
            self.schur.add(i, i, *entry * scale);
        }
        for (member, own) in self.members.iter_mut().zip(&matrix.members) {
            let (range, all) = (member.range.clone(), 0..member.range.len());
            member
                .band
                .factor_sum(&diagonal[range.clone()], scale, &own.band, factor, all)
                .map_err(|singular| Singular { row: range.start + singular.row })?;
            for (to, from) in member.couplings.iter_mut().zip(&own.couplings) {
                for (to, from) in to.entries.iter_mut().zip(&from.entries) {
                    (0..ROWS).for_each(|r| to[r] = from[r] * factor);
                }
            }
            member.eliminate(&mut self.schur);
        }
        self.schur.factor().map_err(|singular| Singular { row: first + singular.row })
    }
}

impl<D: Scalar> Factors<D> for AssemblyFactors<D> {
    type Matrix = AssemblyTangent<D>;

    /// Factors the rows and columns of `range`; allocates nothing.
    fn factor(&mut self, matrix: &AssemblyTangent<D>, _: Range<usize>) -> Result<(), Singular> {
        let zeros = vec![D::from(0.0); matrix.first() + matrix.bodies.order()];
        self.factor_weighted((&zeros, D::from(0.0)), matrix, D::from(1.0))
    }

    /// Factors `scale diag(diagonal) + factor matrix` over `range` without forming it.
    fn factor_sum(
        &mut self,
        diagonal: &[D],
        scale: D,
        matrix: &AssemblyTangent<D>,
        factor: D,
        _: Range<usize>,
    ) -> Result<(), Singular> {
        self.factor_weighted((diagonal, scale), matrix, factor)
    }

    /// Number of negative eigenvalues of the factored matrix (Sylvester's law of inertia).
    fn negative_pivots(&self) -> usize {
        let rods: usize = self.members.iter().map(|member| member.band.negative_pivots()).sum();
        rods + self.schur.negative_pivots()
    }

    /// Solves `A x = b` in place for `R` right-hand sides, over the factored range.
    fn solve_many<E: RightHandSide<D>, const R: usize>(&self, x: &mut [[E; R]]) {
        let first = x.len() - self.schur.order();
        let (rods, bodies) = x.split_at_mut(first);
        for member in &self.members {
            let x = &mut rods[member.range.clone()];
            member.band.solve_many(x);
            for coupling in &member.couplings {
                let x = &x[coupling.rows.clone()];
                for (column, entries) in coupling.columns.iter().zip(&coupling.entries) {
                    for r in 0..ROWS {
                        (0..R).for_each(|k| bodies[*column][k] -= x[r][k] * entries[r]);
                    }
                }
            }
        }
        self.schur.solve(bodies);
        for member in &self.members {
            let x = &mut rods[member.range.clone()];
            for (column, response) in member.columns().zip(&member.responses) {
                with_simd(LessColumn { x: &mut *x, column: response, factor: bodies[column] });
            }
        }
    }
}
