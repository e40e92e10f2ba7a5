//! The tangent of an assembly and its factors: one band for each rod, bordered by the coordinates of the bodies.
//!
//! ```text
//! | A1      B1 | | x1 |   | b1 |          S = C - sum Bi' Ai^-1 Bi
//! |    A2   B2 | | x2 | = | b2 |          S z = c - sum Bi' Ai^-1 bi
//! | B1' B2' C  | | z  |   | c  |          xi = Ai^-1 bi - Ai^-1 Bi z
//! ```
//!
//! `Bi` has entries in the rows of two nodes beside each carried end. The Schur complement `S` is an
//! [envelope](Envelope). The numbers of negative pivots of all `Ai` and of `S` add up to that of the whole matrix. `C`
//! may have blocks that are not symmetric, of rotating bodies in a step. With damping or friction of contacts no part
//! of the matrix is symmetric: the rows of the bodies are not `Bi'` ([`skew_part`](SkewPart)). `S` is then factored as
//! `L U`, else as `L D L^T`. Output: factors of the matrix or of `scale diag(d) + factor matrix`, solutions in place
//! for several right-hand sides, and entries and products, which leave the unsymmetric blocks out. A pivot that is zero
//! or not finite is an error with its row in the unknowns of the assembly.
//!
//! `BorderedTangent` is the matrix, `MemberTangent` its part that belongs to a rod, with second derivatives by its
//! nodes and bodies (`coupling`). `BorderedFactors` are its factors, those of each rod in `member_factors`.

use crate::numerics::envelope::Envelope;
use crate::numerics::envelope_lu::{DiagonalBlock, EnvelopeLu};
use crate::numerics::scalar::Scalar;
use crate::numerics::simd::with_simd;
use crate::numerics::tangent::{Factors, RightHandSide, Singular, Tangent};
use crate::rod::assembly::coupling::{Coupling, entry_of};
use crate::rod::assembly::member_factors::{LessColumn, MemberFactors};
use crate::rod::assembly::rod_couplings::{CouplingFactors, RodCouplings};
use crate::rod::assembly::skew_part::SkewPart;
use std::ops::Range;

/// The part of a tangent that belongs to a rod.
#[derive(Clone, Debug)]
pub struct MemberTangent<D, T> {
    /// Second derivatives by the unknowns of the rod; rows and columns of carried and fixed nodes are those of the
    /// identity.
    pub band: T,
    /// Range of the unknowns of the rod in those of the assembly.
    pub range: Range<usize>,
    /// Couplings of its carried ends.
    pub couplings: Vec<Coupling<D>>,
}

/// The second derivatives of the energy of an assembly, N/m.
#[derive(Clone, Debug)]
pub struct BorderedTangent<D, T> {
    /// One per rod.
    pub members: Vec<MemberTangent<D, T>>,
    /// Index of the first coordinate of the bodies in the unknowns.
    pub first: usize,
    /// Second derivatives by the coordinates of bodies.
    pub bodies: Envelope<D>,
    /// Parts of the derivatives of a step's forces that are not symmetric; none without rotating bodies in space.
    pub blocks: Vec<DiagonalBlock<D>>,
    /// Differences of entries at transposed places; none without damping and friction of contacts.
    pub skew: SkewPart<D, T>,
    /// Entries between nodes of rods in contact; none without contacts of rods.
    pub between: RodCouplings<D>,
}

/// A row or column of a bordered matrix.
enum MatrixRow {
    /// Rod, and unknown counted from its first one.
    Rod(usize, usize),
    /// Gap after the unknowns of a rod.
    Gap,
    /// Coordinate of the bodies.
    Body(usize),
}

impl<D: Scalar, T> BorderedTangent<D, T> {
    /// The kind of unknown `i` of the assembly: an unknown of a rod, a coordinate of the bodies, or a gap after a rod.
    fn row(&self, i: usize) -> MatrixRow {
        if i >= self.first {
            return MatrixRow::Body(i - self.first);
        }
        let k = self.members.partition_point(|member| member.range.end <= i);
        match self.members.get(k) {
            Some(member) if member.range.start <= i => MatrixRow::Rod(k, i - member.range.start),
            _ => MatrixRow::Gap,
        }
    }
}

impl<D: Scalar, T: Tangent<D>> Tangent<D> for BorderedTangent<D, T> {
    const NUMBERS_PER_ROW: usize = T::NUMBERS_PER_ROW;
    type Factors = BorderedFactors<D, T>;

    /// Factors for matrices of this sparsity pattern, allocated and not yet computed.
    fn new_factors(&self) -> BorderedFactors<D, T> {
        let member = |member: &MemberTangent<D, T>| {
            let (band, range) = (member.band.new_factors(), member.range.clone());
            MemberFactors::new(band, range, member.couplings.clone())
        };
        BorderedFactors {
            members: self.members.iter().map(member).collect(),
            schur: self.bodies.clone(),
            general: None,
            between: None,
        }
    }

    /// The entry of row `i`, column `j`, in either triangle, without unsymmetric blocks. It is that of a band, a sum
    /// over the couplings of a rod, or that of the bodies. Gaps have those of the identity; other pairs are zero.
    fn get(&self, i: usize, j: usize) -> D {
        let skew = self.skew.active();
        let entry = match (self.row(i), self.row(j)) {
            (MatrixRow::Rod(k, row), MatrixRow::Rod(other, column)) if k == other => {
                self.members[k].band.get(row, column)
            }
            (MatrixRow::Rod(k, unknown), MatrixRow::Body(body)) => {
                entry_of(&self.members[k].couplings, unknown, body)
            }
            (MatrixRow::Body(body), MatrixRow::Rod(k, unknown)) => {
                let entry = entry_of(&self.members[k].couplings, unknown, body);
                skew.map_or(entry, |skew| {
                    entry + entry_of(&skew.members[k].couplings, unknown, body)
                })
            }
            (MatrixRow::Body(row), MatrixRow::Body(column)) => {
                let entry = self.bodies.get(row, column);
                match skew {
                    Some(skew) if row < column => entry + skew.bodies.get(column, row),
                    _ => entry,
                }
            }
            (MatrixRow::Gap, MatrixRow::Gap) => D::from(f64::from(i == j)),
            _ => D::from(0.0),
        };
        if self.between.is_empty() { entry } else { entry + self.between.get(i, j) }
    }

    /// A range with all rows that have an entry in column `j` of the matrix, whose order is `n`: all unknowns of the
    /// rod of the column if no body carries it, else all rows `0..n`.
    fn coupled(&self, j: usize, n: usize) -> Range<usize> {
        match self.row(j) {
            MatrixRow::Rod(k, _)
                if self.members[k].couplings.is_empty() && !self.between.has_column(j) =>
            {
                self.members[k].range.clone()
            }
            _ => 0..n,
        }
    }

    /// Adds the lower triangle of the leading `size` by `size` part of `block` to the entries from row and column
    /// `start` on. They lie in the band of one rod or in the matrix of the bodies. Nothing happens if `start` is in a
    /// gap.
    fn add_corner<const N: usize>(&mut self, start: usize, size: usize, block: &[[D; N]; N]) {
        match self.row(start) {
            MatrixRow::Rod(k, row) => self.members[k].band.add_corner(row, size, block),
            MatrixRow::Body(body) => {
                for r in 0..size {
                    for c in 0..=r {
                        self.bodies.add(body + r, body + c, block[r][c]);
                    }
                }
            }
            MatrixRow::Gap => {}
        }
    }

    /// Replaces row and column `i`, of a rod or of a body coordinate, by those of the identity, also in the couplings.
    /// Unsymmetric blocks stay; nothing happens in a gap.
    fn eliminate_row_and_column(&mut self, i: usize) {
        self.between.eliminate(i);
        match self.row(i) {
            MatrixRow::Rod(k, row) => {
                self.members[k].band.eliminate_row_and_column(row);
                let skew = self.skew.active_mut().map(|skew| &mut skew.members[k].couplings);
                for coupling in skew.into_iter().flatten().chain(&mut self.members[k].couplings) {
                    if coupling.rows.contains(&row) {
                        let at = row - coupling.rows.start;
                        coupling.iter_mut().for_each(|(_, column)| column[at] = D::from(0.0));
                    }
                }
            }
            MatrixRow::Body(body) => {
                self.bodies.eliminate_row_and_column(body);
                let skew = self.skew.active_mut().map(|skew| {
                    skew.bodies.eliminate_row_and_column(body);
                    skew.members.iter_mut().flat_map(|member| &mut member.couplings)
                });
                let couplings = self.members.iter_mut().flat_map(|member| &mut member.couplings);
                for coupling in skew.into_iter().flatten().chain(couplings) {
                    for (column, entries) in coupling.iter_mut() {
                        if column == body {
                            entries.fill(D::from(0.0));
                        }
                    }
                }
            }
            MatrixRow::Gap => {}
        }
    }

    /// Sets every entry to zero, also in the couplings, and removes all unsymmetric blocks.
    fn clear(&mut self) {
        self.bodies.clear();
        self.blocks.clear();
        self.skew.clear();
        self.between.clear();
        for member in &mut self.members {
            member.band.clear();
            for coupling in &mut member.couplings {
                coupling.entries.fill(D::from(0.0));
            }
        }
    }

    /// Adds `factor` times `other`, which has the same pattern, without its unsymmetric blocks and the differences of
    /// its rows of bodies from their columns.
    fn add_scaled(&mut self, other: &Self, factor: f64) {
        self.bodies.add_scaled(&other.bodies, factor);
        self.between.add_scaled(&other.between, factor);
        for (to, from) in self.members.iter_mut().zip(&other.members) {
            to.band.add_scaled(&from.band, factor);
            for (to, from) in to.couplings.iter_mut().zip(&from.couplings) {
                for (to, from) in to.entries.iter_mut().zip(&from.entries) {
                    *to += *from * factor;
                }
            }
        }
    }

    /// Adds `A e_j x[g]`, column `j` times a number, to vector `g` of `out` (`out[i][g]` is row `i`), for `G` vectors.
    fn add_column<const G: usize>(&self, j: usize, x: [D; G], out: &mut [[D; G]]) {
        for i in self.coupled(j, out.len()) {
            let entry = self.get(i, j);
            (0..G).for_each(|g| out[i][g] += entry * x[g]);
        }
    }

    /// Adds `A x` to `out`, for `G` vectors (`x[i][g]` is row `i` of vector `g`): bands, couplings and their
    /// transposes, bodies. Gaps and unsymmetric blocks have no part.
    fn add_product<const G: usize>(&self, x: &[[D; G]], out: &mut [[D; G]]) {
        self.between.add_product(x, out);
        let (rods, bodies) = x.split_at(self.first);
        let (to_rods, to_bodies) = out.split_at_mut(self.first);
        for member in &self.members {
            let (own, to) = (&rods[member.range.clone()], &mut to_rods[member.range.clone()]);
            member.band.add_product(own, to);
            for coupling in &member.couplings {
                let (own, to) = (&own[coupling.rows.clone()], &mut to[coupling.rows.clone()]);
                for (column, entries) in coupling.iter() {
                    // A coupling stands in both triangles: it acts on the rod and, transposed, on the bodies.
                    for (r, entry) in entries.iter().enumerate() {
                        for g in 0..G {
                            to[r][g] += *entry * bodies[column][g];
                            to_bodies[column][g] += *entry * own[r][g];
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
        let starts = self.members.iter().map(|member| member.range.start);
        self.skew.add_product(starts, [rods, bodies], to_bodies);
    }

    /// Overwrites `out` with `|A| |x|` of the real parts, to which rounding errors of `A x` are proportional. Gaps
    /// become zero; unsymmetric blocks, and differences of rows of bodies from their columns, have no part.
    fn absolute_product(&self, x: &[D], out: &mut [f64]) {
        let (rods, bodies) = x.split_at(self.first);
        let (to_rods, to_bodies) = out[..x.len()].split_at_mut(self.first);
        to_bodies.fill(0.0);
        // Gaps between the unknowns of rods.
        if self.members.iter().map(|member| member.range.len()).sum::<usize>() < self.first {
            to_rods.fill(0.0);
        }
        let size = |x: D| x.value().abs();
        for member in &self.members {
            let (own, to) = (&rods[member.range.clone()], &mut to_rods[member.range.clone()]);
            member.band.absolute_product(own, to);
            for coupling in &member.couplings {
                let (own, to) = (&own[coupling.rows.clone()], &mut to[coupling.rows.clone()]);
                for (column, entries) in coupling.iter() {
                    for (r, entry) in entries.iter().enumerate() {
                        to[r] += size(*entry) * size(bodies[column]);
                        to_bodies[column] += size(*entry) * size(own[r]);
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
        self.between.for_each(|i, j, entry| {
            out[i] += size(entry) * size(x[j]);
        });
    }
}

/// The factors of a [`BorderedTangent`].
#[derive(Clone, Debug)]
pub struct BorderedFactors<D: Scalar, T: Tangent<D>> {
    members: Vec<MemberFactors<D, T::Factors>>,
    /// The Schur complement, or its factors where it is symmetric.
    schur: Envelope<D>,
    /// Its factors where it is not.
    general: Option<EnvelopeLu<D>>,
    /// What solutions need where rods touch each other.
    between: Option<CouplingFactors<D>>,
}

impl<D: Scalar, T: Tangent<D>> BorderedFactors<D, T> {
    /// Solves `A x = b` in place without the entries between rods in contact, for `R` right-hand sides (`x[i][r]` is
    /// row `i` of number `r`), over all rows: the rods alone, then the bodies by the Schur complement, then the
    /// responses of the rods. Rows in gaps stay as they are.
    fn solve_alone<E: RightHandSide<D>, const R: usize>(&self, x: &mut [[E; R]]) {
        let first = x.len() - self.schur.order();
        let (rods, bodies) = x.split_at_mut(first);
        for member in &self.members {
            let x = &mut rods[member.range.clone()];
            // Forward: each rod alone, and its effect on the right-hand side of the bodies.
            member.band.solve_many(x);
            for coupling in member.body_rows() {
                let x = &x[coupling.rows.clone()];
                for (column, entries) in coupling.iter() {
                    for (x, entry) in x.iter().zip(entries) {
                        (0..R).for_each(|k| bodies[column][k] -= x[k] * *entry);
                    }
                }
            }
        }
        // The Schur complement: the coordinates of the bodies.
        match &self.general {
            Some(general) => general.solve(bodies),
            None => self.schur.solve(bodies),
        }
        for member in &self.members {
            let x = &mut rods[member.range.clone()];
            // Backward: each rod responds to the bodies by the stored columns, without another solution.
            for (column, response) in member.responses() {
                with_simd(LessColumn { x: &mut *x, column: response, factor: bodies[column] });
            }
        }
    }

    /// Factors `scale diag(diagonal) + factor matrix`: the band of each rod, then the Schur complement of the bodies.
    /// Of a matrix that is not symmetric the latter is factored as `L U`, else as `L D L^T`. An error has the row of a
    /// pivot that is zero or not finite, in the unknowns of the assembly.
    fn factor_weighted(
        &mut self,
        (diagonal, scale): (&[D], D),
        matrix: &BorderedTangent<D, T>,
        factor: D,
    ) -> Result<(), Singular> {
        let first = matrix.first;
        let (schur, skew) = (&mut self.schur, matrix.skew.active());
        // The matrix of the bodies first; each rod then subtracts its part.
        schur.set_scaled(&matrix.bodies, factor);
        for (i, entry) in diagonal[first..].iter().enumerate() {
            schur.add(i, i, *entry * scale);
        }
        if let Some(skew) = skew {
            let general = self.general.get_or_insert_with(EnvelopeLu::default);
            general.set(schur, &matrix.blocks, factor);
            general.add_to_upper(&skew.bodies, factor);
        }
        for (k, (member, own)) in self.members.iter_mut().zip(&matrix.members).enumerate() {
            let (range, all) = (member.range.clone(), 0..member.range.len());
            member
                .band
                .factor_sum(&diagonal[range.clone()], scale, &own.band, factor, all)
                .map_err(|singular| Singular { row: range.start + singular.row })?;
            let differences = skew.map(|skew| &skew.members[k].couplings[..]);
            member.set_couplings(&own.couplings, differences, factor);
            match (&mut self.general, skew) {
                (Some(general), Some(_)) => {
                    member.eliminate(|i, j, entry| general.add(i, j, entry))
                }
                _ => member.eliminate(|i, j, entry| schur.add(i, j, entry)),
            }
        }
        let factored = match (skew.is_some(), matrix.blocks.is_empty()) {
            (false, true) => {
                self.general = None;
                self.schur.factor()
            }
            (is_set, _) => {
                let general = self.general.get_or_insert_with(EnvelopeLu::default);
                // Unsymmetric blocks alone are in the matrix of the bodies only: the bands are `L D L^T`.
                if !is_set {
                    general.set(&self.schur, &matrix.blocks, factor);
                }
                general.factor()
            }
        };
        factored.map_err(|singular| Singular { row: first + singular.row })?;
        self.between = None;
        if !matrix.between.is_empty() {
            let order = first + matrix.bodies.order();
            let alone = &*self;
            let solve = |x: &mut [[D; _]]| alone.solve_alone(x);
            self.between = Some(CouplingFactors::new(&matrix.between, factor, order, solve)?);
        }
        Ok(())
    }
}

impl<D: Scalar, T: Tangent<D>> Factors<D> for BorderedFactors<D, T> {
    type Matrix = BorderedTangent<D, T>;

    /// Factors the whole matrix, whatever the range, and replaces earlier factors. An error has the row of a pivot that
    /// is zero or not finite.
    fn factor(&mut self, matrix: &BorderedTangent<D, T>, _: Range<usize>) -> Result<(), Singular> {
        // The sum with a zero diagonal, so that one routine serves both factorizations.
        let zeros = vec![D::from(0.0); matrix.first + matrix.bodies.order()];
        self.factor_weighted((&zeros, D::from(0.0)), matrix, D::from(1.0))
    }

    /// Factors `scale diag(diagonal) + factor matrix` without forming it, whatever the range, and replaces earlier
    /// factors. An error has the row of a pivot that is zero or not finite.
    fn factor_sum(
        &mut self,
        diagonal: &[D],
        scale: D,
        matrix: &BorderedTangent<D, T>,
        factor: D,
        _: Range<usize>,
    ) -> Result<(), Singular> {
        self.factor_weighted((diagonal, scale), matrix, factor)
    }

    /// Number of negative pivots of all bands and of the Schur complement: that of negative eigenvalues of the factored
    /// matrix (Sylvester's law of inertia). It has no meaning with unsymmetric blocks.
    fn negative_pivots(&self) -> usize {
        let rods: usize = self.members.iter().map(|member| member.band.negative_pivots()).sum();
        let alone = rods + self.schur.negative_pivots();
        let change = self.between.as_ref().map_or(0, CouplingFactors::change_of_negative_pivots);
        alone.saturating_add_signed(change)
    }

    /// Solves `A x = b` in place for `R` right-hand sides (`x[i][r]` is row `i` of number `r`), over all rows. Rows in
    /// gaps stay as they are.
    fn solve_many<E: RightHandSide<D>, const R: usize>(&self, x: &mut [[E; R]]) {
        self.solve_alone(x);
        if let Some(between) = &self.between {
            between.correct(x);
        }
    }
}
