//! The factors of one rod in those of a bordered matrix ([`MemberFactors`]): of its band, its couplings to the bodies,
//! and the responses of the rod to the coordinates of the bodies.
//!
//! `set_couplings` copies the couplings, and `eliminate` computes the responses and the part of the rod in the Schur
//! complement. In a matrix that is not symmetric the rows of the bodies (`body_rows`) are not the transposed couplings.
//! [`LessColumn`] subtracts a response from vectors.

use crate::numerics::scalar::Scalar;
use crate::numerics::tangent::{Factors, RightHandSide};
use crate::rod::assembly::coupling::Coupling;
use std::ops::Range;

/// Columns of `Ai^-1 Bi` that are solved for together: those of both ends of a rod, in two registers.
const GROUP: usize = 8;

/// Factors of the band of a rod, with its couplings and their responses.
#[derive(Clone, Debug)]
pub(super) struct MemberFactors<D, F> {
    pub band: F,
    pub range: Range<usize>,
    /// `Bi`.
    couplings: Vec<Coupling<D>>,
    /// The rows of the bodies in the columns of the rod, transposed, where these are not `Bi'`; else empty.
    rows: Vec<Coupling<D>>,
    /// The columns of `Ai^-1 Bi`; columns of all couplings, one after the other.
    responses: Vec<Vec<D>>,
    /// Columns that are solved for.
    room: Vec<[D; GROUP]>,
}

impl<D: Scalar, F: Factors<D>> MemberFactors<D, F> {
    /// Factors of this band, for a rod with this range of unknowns and these couplings, not yet computed.
    pub fn new(band: F, range: Range<usize>, couplings: Vec<Coupling<D>>) -> Self {
        Self { band, range, couplings, rows: Vec::new(), responses: Vec::new(), room: Vec::new() }
    }

    /// Overwrites the couplings by `factor` times the given ones. The rows of the bodies are `factor` times their sums
    /// with `differences`, or the transposed couplings if that is `None`.
    pub fn set_couplings(
        &mut self,
        couplings: &[Coupling<D>],
        differences: Option<&[Coupling<D>]>,
        factor: D,
    ) {
        for (to, from) in self.couplings.iter_mut().zip(couplings) {
            for (to, from) in to.entries.iter_mut().zip(&from.entries) {
                *to = *from * factor;
            }
        }
        let Some(differences) = differences else { return self.rows.clear() };
        self.rows.clone_from(&self.couplings);
        for (to, from) in self.rows.iter_mut().zip(differences) {
            for (to, from) in to.entries.iter_mut().zip(&from.entries) {
                *to += *from * factor;
            }
        }
    }

    /// The rows of the bodies in the columns of the rod, transposed.
    pub fn body_rows(&self) -> &[Coupling<D>] {
        if self.rows.is_empty() { &self.couplings } else { &self.rows }
    }

    /// The body coordinate of every column of `Bi`, with the response to it.
    pub fn responses(&self) -> impl Iterator<Item = (usize, &[D])> {
        self.columns().zip(self.responses.iter().map(|response| &response[..]))
    }

    /// The body coordinate of every column of all couplings, in the order of the responses. A coordinate of both ends
    /// is there twice.
    fn columns(&self) -> impl Iterator<Item = usize> {
        self.couplings.iter().flat_map(|coupling| coupling.columns.iter().copied())
    }

    /// Computes the responses `Ai^-1 Bi` of the rod with its factored band `Ai` and its couplings `Bi`, [`GROUP`]
    /// columns at a time. Calls `add(row, column, x)` with the entries `x` of `-Bi' Ai^-1 Bi`, which belong to the
    /// Schur complement: of its lower triangle, or of both if the rows of the bodies are not `Bi'`.
    pub fn eliminate(&mut self, mut add: impl FnMut(usize, usize, D)) {
        let Self { band, range, couplings, responses, room, .. } = self;
        let count: usize = couplings.iter().map(|coupling| coupling.columns.len()).sum();
        let zero = D::from(0.0);
        responses.resize_with(count, || vec![zero; range.len()]);
        room.resize(range.len(), [zero; GROUP]);
        let mut columns = couplings.iter().flat_map(|coupling| {
            coupling.iter().map(|(_, entries)| (coupling.rows.start, entries))
        });
        for group in responses.chunks_mut(GROUP) {
            // A group of columns shares one pass over the factors of the band.
            room.fill([zero; GROUP]);
            for (g, (row, entries)) in columns.by_ref().take(group.len()).enumerate() {
                entries.iter().enumerate().for_each(|(r, entry)| room[row + r][g] = *entry);
            }
            band.solve_many(room);
            for (g, response) in group.iter_mut().enumerate() {
                response.iter_mut().zip(&*room).for_each(|(to, from)| *to = from[g]);
            }
        }
        drop(columns);
        let both = !self.rows.is_empty();
        for coupling in self.body_rows() {
            for (row, entries) in coupling.iter() {
                for (column, response) in self.columns().zip(&self.responses) {
                    // The Schur complement is symmetric as long as the bands are: its lower triangle suffices.
                    if both || column <= row {
                        let response = &response[coupling.rows.clone()];
                        let mut sum = zero;
                        for (entry, response) in entries.iter().zip(response) {
                            sum += *entry * *response;
                        }
                        add(row, column, -sum);
                    }
                }
            }
        }
    }
}

/// Subtracts a column times numbers from vectors, as work for a vector unit.
pub(super) struct LessColumn<'a, D, E, const R: usize> {
    pub x: &'a mut [[E; R]],
    pub column: &'a [D],
    pub factor: [E; R],
}

impl<D: Scalar, E: RightHandSide<D>, const R: usize> pulp::NullaryFnOnce
    for LessColumn<'_, D, E, R>
{
    type Output = ();

    /// Subtracts `factor[r] column[i]` from `x[i][r]` for all `i` and `r`, compiled for the instruction set of the
    /// caller.
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
