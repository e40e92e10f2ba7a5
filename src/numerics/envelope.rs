//! Symmetric matrices stored by their envelope (every row from its first column with an entry to the diagonal), and
//! their `L D L^T` factors, for the linear systems of structures.
//!
//! [`Envelope::zeros`] takes the first column of each row. `factor` replaces the matrix by its factors, without row
//! exchanges and without entries outside the envelope (Jennings 1966, doi:10.1093/comjnl/9.3.281); a pivot that is zero
//! or not finite is an error with its row. With the factors, `solve` overwrites several right-hand sides by their
//! solutions, and `negative_pivots` counts the negative eigenvalues. The cost is the sum of the squared lengths of the
//! rows, so that a good order of the rows has short ones. [`reverse_cuthill_mckee`] returns such an order of the
//! vertices from the lists of neighbors in the graph of the matrix. Entries outside the envelope are zero and cannot be
//! set.

use crate::numerics::scalar::Scalar;
use crate::numerics::tangent::{RightHandSide, Singular};
use std::sync::Arc;

/// A symmetric matrix with an entry for every column from `first[i]` to `i` of each row `i`.
#[derive(Clone, Debug)]
pub struct Envelope<D> {
    /// First column of each row inside the envelope.
    first: Arc<[usize]>,
    /// Offset of each row in `entries`: entry `(i, j)` is at `start[i] + j` (with wrapping).
    start: Arc<[usize]>,
    /// The entries of the lower triangle inside the envelope, row by row.
    entries: Vec<D>,
}

impl<D: Scalar> Envelope<D> {
    /// The zero matrix with a row `i` for each entry of `first`, from column `first[i]`, at most `i`, to the diagonal.
    pub fn zeros(first: Vec<usize>) -> Self {
        let (mut start, mut count) = (Vec::with_capacity(first.len()), 0_usize);
        for (i, first) in first.iter().enumerate() {
            // May wrap around; the sum with a column does not.
            start.push(count.wrapping_sub(*first));
            count += i + 1 - first;
        }
        Self { first: first.into(), start: start.into(), entries: vec![D::from(0.0); count] }
    }

    /// Number of rows.
    pub fn order(&self) -> usize {
        self.first.len()
    }

    /// Index of the entry of row `i`, column `j`, in the list of all entries. The entry must be inside the envelope and
    /// `j` at most `i`.
    fn index(&self, i: usize, j: usize) -> usize {
        self.start[i].wrapping_add(j)
    }

    /// First column of row `i`.
    pub fn first(&self, i: usize) -> usize {
        self.first[i]
    }

    /// The entry of row `i`, column `j`, in either triangle; zero outside the envelope.
    pub fn get(&self, i: usize, j: usize) -> D {
        let (row, column) = (i.max(j), i.min(j));
        match column >= self.first[row] {
            true => self.entries[self.index(row, column)],
            false => D::from(0.0),
        }
    }

    /// Adds `entry` to the one of row `i`, column `j`, at most `i`, which is inside the envelope.
    #[inline]
    pub fn add(&mut self, i: usize, j: usize, entry: D) {
        let k = self.index(i, j);
        self.entries[k] += entry;
    }

    /// Replaces the entry of row `i`, column `j`, at most `i`, which is inside the envelope.
    pub fn set(&mut self, i: usize, j: usize, entry: D) {
        let k = self.index(i, j);
        self.entries[k] = entry;
    }

    /// Sets every entry to zero.
    pub fn clear(&mut self) {
        self.entries.fill(D::from(0.0));
    }

    /// Adds `factor` times the matrix `other`, which has the same envelope, to this one.
    pub fn add_scaled(&mut self, other: &Self, factor: f64) {
        for (to, from) in self.entries.iter_mut().zip(&other.entries) {
            *to += *from * factor;
        }
    }

    /// Overwrites the matrix with `factor` times `other`, which has the same envelope.
    pub fn set_scaled(&mut self, other: &Self, factor: D) {
        for (to, from) in self.entries.iter_mut().zip(&other.entries) {
            *to = *from * factor;
        }
    }

    /// Replaces row and column `i` by those of the identity: zeros, and one on the diagonal.
    pub fn eliminate_row_and_column(&mut self, i: usize) {
        for row in i..self.order() {
            if self.first[row] <= i {
                let k = self.index(row, i);
                self.entries[k] = D::from(0.0);
            }
        }
        let (from, own) = (self.index(i, self.first[i]), self.index(i, i));
        self.entries[from..own].fill(D::from(0.0));
        self.entries[own] = D::from(1.0);
    }

    /// Calls `visit(row, column, entry)` for each entry of the lower triangle inside the envelope, zeros and the
    /// diagonal included, row by row.
    pub fn for_each(&self, mut visit: impl FnMut(usize, usize, D)) {
        for (i, first) in self.first.iter().enumerate() {
            for j in *first..=i {
                visit(i, j, self.entries[self.index(i, j)]);
            }
        }
    }

    /// Replaces the matrix `A` by its factors `L D L^T`: `L` (unit lower triangle) below the diagonal, `D` on it.
    ///
    /// # Errors
    /// The row of a pivot that is zero or not finite; the matrix is then partly overwritten.
    pub fn factor(&mut self) -> Result<(), Singular> {
        for i in 0..self.order() {
            let first = self.first[i];
            // Row i of L D, from left to right.
            for j in first..i {
                let mut sum = self.entries[self.index(i, j)];
                for k in first.max(self.first[j])..j {
                    sum -= self.entries[self.index(i, k)] * self.entries[self.index(j, k)];
                }
                let at = self.index(i, j);
                self.entries[at] = sum;
            }
            // Row i of L, and the pivot.
            let mut pivot = self.entries[self.index(i, i)];
            for j in first..i {
                let at = self.index(i, j);
                let scaled = self.entries[at];
                let own = scaled / self.entries[self.index(j, j)];
                pivot -= scaled * own;
                self.entries[at] = own;
            }
            if !(pivot.value().abs() > 0.0 && pivot.value().is_finite()) {
                return Err(Singular { row: i });
            }
            let at = self.index(i, i);
            self.entries[at] = pivot;
        }
        Ok(())
    }

    /// Number of negative pivots of a [factored](Self::factor) matrix, which is that of its negative eigenvalues
    /// (Sylvester's law of inertia).
    pub fn negative_pivots(&self) -> usize {
        (0..self.order()).filter(|i| self.entries[self.index(*i, *i)].value() < 0.0).count()
    }

    /// Solves `A x = b` in place for `R` right-hand sides (`x[i][r]` is row `i` of number `r`). This matrix has been
    /// [factored](Self::factor): forward substitution with `L`, division by `D`, backward with `L^T`.
    pub fn solve<E: RightHandSide<D>, const R: usize>(&self, x: &mut [[E; R]]) {
        // Forward substitution with L.
        for i in 0..self.order() {
            for j in self.first[i]..i {
                let entry = self.entries[self.index(i, j)];
                for r in 0..R {
                    let known = x[j][r];
                    x[i][r] -= known * entry;
                }
            }
        }
        // Division by the pivots.
        for i in (0..self.order()).rev() {
            let by_pivot = self.entries[self.index(i, i)].recip();
            for r in 0..R {
                x[i][r] = x[i][r] * by_pivot;
            }
        }
        // Backward substitution with the transpose of L.
        for i in (0..self.order()).rev() {
            for j in self.first[i]..i {
                let entry = self.entries[self.index(i, j)];
                for r in 0..R {
                    let known = x[i][r];
                    x[j][r] -= known * entry;
                }
            }
        }
    }
}

/// An order of the vertices of a graph with a small envelope: Cuthill and McKee's, reversed (George and Liu 1981).
/// `neighbors` has the list of neighbors of each vertex, which may have one several times. Returns every vertex once,
/// in their new order. A breadth-first search, vertices with few entries in their list first, runs through each
/// connected part from a vertex with the fewest entries. It is repeated from its last vertex, and this second search is
/// the order of the part before the reversal.
pub fn reverse_cuthill_mckee(neighbors: &[Vec<usize>]) -> Vec<usize> {
    let mut order = Vec::with_capacity(neighbors.len());
    let mut seen = vec![false; neighbors.len()];
    let degree = |i: usize| neighbors[i].len();
    while order.len() < neighbors.len() {
        // Each connected part begins at a vertex with few neighbors.
        let unseen = (0..neighbors.len()).filter(|i| !seen[*i]);
        let Some(mut root) = unseen.min_by_key(|i| degree(*i)) else { break };
        // The last vertex of a breadth-first order is far from its root: a better root.
        for last in [false, true] {
            let from = order.len();
            let mut reached = seen.clone();
            order.push(root);
            reached[root] = true;
            let mut next = from;
            while next < order.len() {
                let mut near: Vec<usize> =
                    neighbors[order[next]].iter().copied().filter(|i| !reached[*i]).collect();
                near.sort_by_key(|i| degree(*i));
                for i in near {
                    // A neighbor may be listed several times.
                    if !std::mem::replace(&mut reached[i], true) {
                        order.push(i);
                    }
                }
                next += 1;
            }
            if last {
                seen = reached;
            } else {
                root = order[order.len() - 1];
                order.truncate(from);
            }
        }
    }
    order.reverse();
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Envelope of rows of different lengths.
    const FIRST: [usize; 8] = [0, 0, 2, 1, 4, 0, 3, 6];

    /// Matrix with the envelope [`FIRST`]; indefinite for a negative `shift`.
    fn matrix(shift: f64) -> Envelope<f64> {
        let mut a = Envelope::zeros(FIRST.to_vec());
        for (i, first) in FIRST.into_iter().enumerate() {
            for j in first..i {
                a.add(i, j, ((i * 7 + j * 5) % 9) as f64 / 9.0 - 0.45);
            }
            a.add(i, i, 3.0 + shift * (i % 3) as f64);
        }
        a
    }

    /// The same matrix with all entries.
    fn dense(a: &Envelope<f64>) -> nalgebra::DMatrix<f64> {
        nalgebra::DMatrix::from_fn(a.order(), a.order(), |i, j| a.get(i, j))
    }

    /// Oracle: the dense LU factors of nalgebra, and the signs of its eigenvalues.
    #[test]
    fn solution_and_inertia_agree_with_those_of_the_dense_matrix() {
        for shift in [0.0, -4.0] {
            let a = matrix(shift);
            let dense = dense(&a);
            let b: Vec<[f64; 2]> =
                (0..8).map(|i| [(i as f64).sin(), 1.0 / (1.0 + i as f64)]).collect();
            let (mut factors, mut x) = (a.clone(), b.clone());
            factors.factor().unwrap();
            factors.solve(&mut x);
            for r in 0..2 {
                let right = nalgebra::DVector::from_fn(8, |i, _| b[i][r]);
                let expected = dense.clone().lu().solve(&right).unwrap();
                assert!((0..8).all(|i| (x[i][r] - expected[i]).abs() < 1e-13));
            }
            let negative = dense.symmetric_eigenvalues().iter().filter(|l| **l < 0.0).count();
            assert_eq!(factors.negative_pivots(), negative);
            assert_eq!(negative > 0, shift < 0.0);
        }
    }

    #[test]
    fn uncoupled_row_and_column_are_those_of_the_identity() {
        let mut a = matrix(0.0);
        a.eliminate_row_and_column(3);
        for i in 0..8 {
            assert_eq!([a.get(3, i), a.get(i, 3)], [f64::from(i == 3); 2]);
        }
        assert_eq!(a.get(6, 4), matrix(0.0).get(6, 4));
    }

    #[test]
    fn zero_pivot_is_reported_with_its_row() {
        let mut a = Envelope::<f64>::zeros(vec![0, 0]);
        a.add(0, 0, 1.0);
        a.add(1, 0, 2.0);
        a.add(1, 1, 4.0);
        assert_eq!(a.factor(), Err(Singular { row: 1 }));
    }

    /// A path whose vertices are numbered at random has rows of two entries in the new order.
    #[test]
    fn path_graph_has_an_envelope_of_neighbors() {
        let place = [5, 2, 7, 0, 6, 1, 4, 3];
        let mut neighbors = vec![Vec::new(); 8];
        for pair in place.windows(2) {
            neighbors[pair[0]].push(pair[1]);
            neighbors[pair[1]].push(pair[0]);
        }
        let order = reverse_cuthill_mckee(&neighbors);
        assert!(order.windows(2).all(|pair| neighbors[pair[0]].contains(&pair[1])));
    }

    /// A star of three leaves with double edges, and one more pair of vertices: leaves of equal degree are listed
    /// twice, not next to each other. The order is a permutation of all vertices.
    #[test]
    fn repeated_neighbors_are_numbered_once() {
        let star = [vec![1, 1], vec![0, 2, 3, 0, 2, 3], vec![1, 1], vec![1, 1]];
        let neighbors: Vec<Vec<usize>> = star.into_iter().chain([vec![5], vec![4]]).collect();
        let mut order = reverse_cuthill_mckee(&neighbors);
        order.sort_unstable();
        assert_eq!(order, [0, 1, 2, 3, 4, 5]);
    }
}
