//! Second derivatives between the rows beside a carried end of a rod and the body coordinates that carry it
//! ([`Coupling`]), N/m.
//!
//! `iter` and `iter_mut` visit the columns, each with its coordinate, and `entry_of` is an entry of all couplings of a
//! rod together.

use crate::numerics::scalar::Scalar;
use std::ops::Range;

/// Second derivatives between the rows beside a carried end and the coordinates that carry it.
#[derive(Clone, Debug)]
pub struct Coupling<D> {
    /// The rows, counted from the first unknown of the rod.
    pub rows: Range<usize>,
    /// The coordinates, counted from the first one of all bodies.
    pub columns: Vec<usize>,
    /// Entries of all columns, one after the other.
    pub entries: Vec<D>,
}

impl<D> Coupling<D> {
    /// For each column: the index of its coordinate among those of all bodies, and its entries, one per row.
    pub(super) fn iter(&self) -> impl Iterator<Item = (usize, &[D])> {
        self.columns.iter().copied().zip(self.entries.chunks_exact(self.rows.len()))
    }

    /// For each column: the index of its coordinate among those of all bodies, and its entries, one per row, mutable.
    pub(super) fn iter_mut(&mut self) -> impl Iterator<Item = (usize, &mut [D])> {
        self.columns.iter().copied().zip(self.entries.chunks_exact_mut(self.rows.len()))
    }
}

/// The entry of an unknown of the rod, counted from its first one, and a body coordinate in all couplings of the rod.
pub(super) fn entry_of<D: Scalar>(couplings: &[Coupling<D>], unknown: usize, body: usize) -> D {
    let mut sum = D::from(0.0);
    // Both ends of a rod may be on the same body: their couplings add up.
    for coupling in couplings.iter().filter(|coupling| coupling.rows.contains(&unknown)) {
        if let Some((_, entries)) = coupling.iter().find(|(column, _)| *column == body) {
            sum += entries[unknown - coupling.rows.start];
        }
    }
    sum
}
