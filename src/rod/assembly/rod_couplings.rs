//! Entries of the tangent between nodes of rods in contact, which lie outside of the bands, and the solution of systems
//! with them.
//!
//! [`RodCouplings`] is a list of blocks `S`, each between the coordinates of two nodes, in both triangles. Blocks of
//! damping and friction are between the unknowns of two edges, each in one triangle, and make `S` unsymmetric. With the
//! matrix `A` without them and the columns `P` of the identity at these coordinates, a solution follows from that with
//! `A` alone (Woodbury's formula):
//!
//! ```text
//! (A + P S P')^-1 b = x0 - A^-1 P (I + S P' A^-1 P)^-1 S P' x0,    x0 = A^-1 b
//! ```
//!
//! [`CouplingFactors`] has `A^-1 P` and the factors of the small matrix. `correct` replaces `x0` by the solution.
//! `change_of_negative_pivots`, of symmetric blocks, is the number of negative eigenvalues of the whole matrix less
//! that of `A`, from the inertia of both Schur complements of `[A, P Q; Q' P', -L^-1]` with `S = Q L Q'` (Haynsworth
//! 1968, Determination of the inertia of a partitioned Hermitian matrix).

use crate::numerics::dense_lu::DenseLu;
use crate::numerics::scalar::Scalar;
use crate::numerics::tangent::{RightHandSide, Singular};
use crate::numerics::vector::Vector;
use nalgebra::DMatrix;

/// Columns that are solved for together.
const GROUP: usize = 8;
/// Eigenvalue of the blocks over the largest one below which it is zero.
const NEGLIGIBLE: f64 = 1e-12;

/// Second derivatives between the coordinates of two nodes, N/m.
#[derive(Clone, Copy, Debug)]
pub struct NodeBlock<D> {
    /// First unknowns of both nodes in those of the assembly: of the rows, and of the columns.
    pub first: [usize; 2],
    /// The entries by rows.
    pub entries: [Vector<D>; 3],
}

/// Largest number of unknowns of an edge, with the angle between its nodes.
pub const LARGEST_EDGE: usize = 7;

/// Derivatives of the forces on the unknowns of one edge by those of another, N/m.
#[derive(Clone, Copy, Debug)]
pub struct EdgeBlock<D> {
    /// First unknowns of both edges in those of the assembly: of the rows, and of the columns.
    pub first: [usize; 2],
    /// The entries by rows; those beyond the unknowns of an edge are not used.
    pub entries: [[D; LARGEST_EDGE]; LARGEST_EDGE],
}

/// All blocks between rods in contact.
#[derive(Clone, Debug)]
pub struct RodCouplings<D> {
    /// The blocks, each in both triangles; several may have the same place.
    pub blocks: Vec<NodeBlock<D>>,
    /// Blocks of damping and friction, each at its own place only.
    pub losses: Vec<EdgeBlock<D>>,
    /// Coordinates of a node: 2 or 3.
    pub width: usize,
}

impl<D: Scalar> RodCouplings<D> {
    /// No blocks, for nodes of `width` coordinates.
    pub fn none(width: usize) -> Self {
        Self { blocks: Vec::new(), losses: Vec::new(), width }
    }

    /// Whether there are no blocks.
    pub fn is_empty(&self) -> bool {
        self.blocks.is_empty() && self.losses.is_empty()
    }

    /// Removes all blocks.
    pub fn clear(&mut self) {
        self.blocks.clear();
        self.losses.clear();
    }

    /// Number of unknowns of an edge: two nodes, and in space an angle.
    fn edge_width(&self) -> usize {
        if self.width == 2 { 4 } else { LARGEST_EDGE }
    }

    /// Calls `visit` with row, column and entry of all entries, of both triangles.
    pub fn for_each(&self, mut visit: impl FnMut(usize, usize, D)) {
        for NodeBlock { first: [row, column], entries } in &self.blocks {
            for k in 0..self.width {
                for l in 0..self.width {
                    visit(row + k, column + l, entries[k][l]);
                    visit(column + l, row + k, entries[k][l]);
                }
            }
        }
        for EdgeBlock { first: [row, column], entries } in &self.losses {
            for k in 0..self.edge_width() {
                for l in 0..self.edge_width() {
                    visit(row + k, column + l, entries[k][l]);
                }
            }
        }
    }

    /// The entry of row `i`, column `j`.
    pub fn get(&self, i: usize, j: usize) -> D {
        let mut sum = D::from(0.0);
        for NodeBlock { first: [row, column], entries } in &self.blocks {
            for (i, j) in [(i, j), (j, i)] {
                let (k, l) = (i.wrapping_sub(*row), j.wrapping_sub(*column));
                if k < self.width && l < self.width {
                    sum += entries[k][l];
                }
            }
        }
        for EdgeBlock { first: [row, column], entries } in &self.losses {
            let (k, l) = (i.wrapping_sub(*row), j.wrapping_sub(*column));
            if k < self.edge_width() && l < self.edge_width() {
                sum += entries[k][l];
            }
        }
        sum
    }

    /// Whether column `j` has entries.
    pub fn has_column(&self, j: usize) -> bool {
        let contains = |first: usize, width: usize| (first..first + width).contains(&j);
        let touches = |first: &usize| contains(*first, self.width);
        self.blocks.iter().any(|block| block.first.iter().any(touches))
            || self.losses.iter().any(|block| contains(block.first[1], self.edge_width()))
    }

    /// Sets row and column `i` to zero.
    pub fn eliminate(&mut self, i: usize) {
        for NodeBlock { first: [row, column], entries } in &mut self.blocks {
            if (*row..*row + self.width).contains(&i) {
                entries[i - *row] = [D::from(0.0); 3];
            }
            if (*column..*column + self.width).contains(&i) {
                entries.iter_mut().for_each(|row| row[i - *column] = D::from(0.0));
            }
        }
        let width = self.edge_width();
        for EdgeBlock { first: [row, column], entries } in &mut self.losses {
            if (*row..*row + width).contains(&i) {
                entries[i - *row] = [D::from(0.0); LARGEST_EDGE];
            }
            if (*column..*column + width).contains(&i) {
                entries.iter_mut().for_each(|row| row[i - *column] = D::from(0.0));
            }
        }
    }

    /// Adds `factor` times the blocks of `other`.
    pub fn add_scaled(&mut self, other: &Self, factor: f64) {
        let scaled = |block: &NodeBlock<D>| NodeBlock {
            entries: block.entries.map(|row| row.map(|entry| entry * factor)),
            ..*block
        };
        self.blocks.extend(other.blocks.iter().map(scaled));
        let scaled = |block: &EdgeBlock<D>| EdgeBlock {
            entries: block.entries.map(|row| row.map(|entry| entry * factor)),
            ..*block
        };
        self.losses.extend(other.losses.iter().map(scaled));
    }

    /// Adds the product with `G` vectors (`x[i][g]` is row `i` of vector `g`) to `out`.
    pub fn add_product<const G: usize>(&self, x: &[[D; G]], out: &mut [[D; G]]) {
        self.for_each(|i, j, entry| {
            for g in 0..G {
                out[i][g] += entry * x[j][g];
            }
        });
    }
}

/// What solutions with couplings need beside the factors of the matrix without them.
#[derive(Clone, Debug)]
pub struct CouplingFactors<D> {
    /// The coupled unknowns.
    unknowns: Vec<usize>,
    /// `S` by rows.
    couplings: Vec<Vec<D>>,
    /// Columns of `A^-1 P`.
    responses: Vec<Vec<D>>,
    /// Factors of `I + S P' A^-1 P`.
    small: DenseLu<D>,
}

impl<D: Scalar> CouplingFactors<D> {
    /// The factors for `factor` times the couplings, in a system of `order` unknowns which `solve` solves without them.
    ///
    /// # Errors
    /// The row of a pivot of the small matrix that is zero or not finite.
    pub fn new(
        couplings: &RodCouplings<D>,
        factor: D,
        order: usize,
        solve: impl Fn(&mut [[D; GROUP]]),
    ) -> Result<Self, Singular> {
        let mut unknowns: Vec<usize> = Vec::new();
        for block in &couplings.blocks {
            block.first.iter().for_each(|first| unknowns.extend(*first..first + couplings.width));
        }
        let width = couplings.edge_width();
        for block in &couplings.losses {
            block.first.iter().for_each(|first| unknowns.extend(*first..first + width));
        }
        unknowns.sort_unstable();
        unknowns.dedup();
        let (count, zero) = (unknowns.len(), D::from(0.0));
        let mut matrix = vec![vec![zero; count]; count];
        let place = |i: usize| unknowns.partition_point(|own| *own < i);
        couplings.for_each(|i, j, entry| {
            let (i, j) = (place(i), place(j));
            matrix[i][j] += entry * factor;
        });
        let mut responses: Vec<Vec<D>> = Vec::with_capacity(count);
        let mut room = vec![[zero; GROUP]; order];
        for group in unknowns.chunks(GROUP) {
            room.fill([zero; GROUP]);
            group.iter().enumerate().for_each(|(g, i)| room[*i][g] = D::from(1.0));
            solve(&mut room);
            responses.extend((0..group.len()).map(|g| room.iter().map(|row| row[g]).collect()));
        }
        let mut small = vec![vec![zero; count]; count];
        for (i, (row, coupled)) in small.iter_mut().zip(&matrix).enumerate() {
            row[i] = D::from(1.0);
            for (k, entry) in coupled.iter().enumerate().filter(|(_, entry)| **entry != 0.0) {
                row.iter_mut().zip(&responses).for_each(|(x, y)| *x += *entry * y[unknowns[k]]);
            }
        }
        let small =
            DenseLu::factor(small).map_err(|singular| Singular { row: unknowns[singular.row] })?;
        Ok(Self { unknowns, couplings: matrix, responses, small })
    }

    /// Replaces solutions without the couplings (`x[i][r]` is row `i` of number `r`) by those with them.
    pub fn correct<E: RightHandSide<D>, const R: usize>(&self, x: &mut [[E; R]]) {
        let row = |coupled: &Vec<D>| {
            let mut sums = [E::from(0.0); R];
            for (entry, i) in coupled.iter().zip(&self.unknowns) {
                (0..R).for_each(|r| sums[r] += x[*i][r] * *entry);
            }
            sums
        };
        let mut small: Vec<[E; R]> = self.couplings.iter().map(row).collect();
        self.small.solve(&mut small);
        for (response, factor) in self.responses.iter().zip(&small) {
            for (x, y) in x.iter_mut().zip(response) {
                (0..R).for_each(|r| x[r] -= factor[r] * *y);
            }
        }
    }

    /// Number of negative eigenvalues of the matrix with the couplings less that without them.
    pub fn change_of_negative_pivots(&self) -> isize {
        let count = self.unknowns.len();
        let couplings = DMatrix::from_fn(count, count, |i, j| self.couplings[i][j].value());
        let flexibility =
            DMatrix::from_fn(count, count, |i, j| self.responses[j][self.unknowns[i]].value());
        let parts = couplings.symmetric_eigen();
        let largest = parts.eigenvalues.amax();
        let kept: Vec<usize> =
            (0..count).filter(|i| parts.eigenvalues[*i].abs() > NEGLIGIBLE * largest).collect();
        let vectors = parts.eigenvectors.select_columns(&kept);
        let mut complement = vectors.transpose() * flexibility * vectors;
        for (k, i) in kept.iter().enumerate() {
            complement[(k, k)] += parts.eigenvalues[*i].recip();
        }
        let positive = |values: &mut dyn Iterator<Item = f64>| values.filter(|x| *x > 0.0).count();
        let after = positive(&mut complement.symmetric_eigenvalues().iter().copied());
        let before = positive(&mut kept.iter().map(|i| parts.eigenvalues[*i]));
        after as isize - before as isize
    }
}
