//! `L U` factors of a dense matrix with row exchanges, over any scalar: [`DenseLu`].
//!
//! Input: the order and all entries by rows. `factor` chooses the largest pivot of each column by the real parts. A
//! pivot that is zero or not finite is an error with its column. `solve` overwrites several right-hand sides by their
//! solutions. Small matrices only: all entries are stored.

use crate::numerics::scalar::Scalar;
use crate::numerics::tangent::{RightHandSide, Singular};

/// Factors of a dense matrix.
#[derive(Clone, Debug)]
pub struct DenseLu<D> {
    /// Rows of `L` (unit diagonal, not stored) and `U`, in the order of elimination.
    rows: Vec<Vec<D>>,
    /// The row of the matrix that each row of the factors comes from.
    order: Vec<usize>,
}

impl<D: Scalar> DenseLu<D> {
    /// Factors the matrix with these rows.
    ///
    /// # Errors
    /// The column of a pivot that is zero or not finite.
    pub fn factor(mut rows: Vec<Vec<D>>) -> Result<Self, Singular> {
        let mut order: Vec<usize> = (0..rows.len()).collect();
        for k in 0..rows.len() {
            let size = |i: usize| rows[i][k].value().abs();
            let largest = (k..rows.len()).max_by(|i, j| size(*i).total_cmp(&size(*j)));
            let pivot = largest.filter(|i| size(*i) > 0.0 && size(*i).is_finite());
            let Some(pivot) = pivot else { return Err(Singular { row: k }) };
            rows.swap(k, pivot);
            order.swap(k, pivot);
            let (done, below) = rows.split_at_mut(k + 1);
            let (pivot_row, over) = (&done[k], done[k][k].recip());
            for row in below {
                let factor = row[k] * over;
                row[k] = factor;
                row[k + 1..]
                    .iter_mut()
                    .zip(&pivot_row[k + 1..])
                    .for_each(|(x, p)| *x -= factor * *p);
            }
        }
        Ok(Self { rows, order })
    }

    /// Solves in place for `R` right-hand sides (`x[i][r]` is row `i` of number `r`).
    pub fn solve<E: RightHandSide<D>, const R: usize>(&self, x: &mut [[E; R]]) {
        let mut sorted: Vec<[E; R]> = self.order.iter().map(|i| x[*i]).collect();
        for i in 0..sorted.len() {
            let (before, now) = sorted.split_at_mut(i);
            for (factor, other) in self.rows[i].iter().zip(before) {
                (0..R).for_each(|r| now[0][r] -= other[r] * *factor);
            }
        }
        for i in (0..sorted.len()).rev() {
            let (now, after) = sorted.split_at_mut(i + 1);
            for (factor, other) in self.rows[i][i + 1..].iter().zip(after) {
                (0..R).for_each(|r| now[i][r] -= other[r] * *factor);
            }
            let over = self.rows[i][i].recip();
            (0..R).for_each(|r| now[i][r] = now[i][r] * over);
        }
        x.copy_from_slice(&sorted);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_dual::Dual64;

    /// A matrix whose first pivot is zero, and the derivative of the solution by a number in it.
    #[test]
    fn solution_and_its_derivative_satisfy_the_equations() {
        let a = |i: usize, j: usize| {
            let entry = ((3 * i + 5 * j * j) % 7) as f64 - 2.0 * f64::from(i == j);
            Dual64::new(entry, f64::from(i == 1 && j == 2))
        };
        let rows: Vec<Vec<Dual64>> = (0..5).map(|i| (0..5).map(|j| a(i, j)).collect()).collect();
        assert_eq!(DenseLu::factor(vec![vec![1.0, 2.0], vec![2.0, 4.0]]).unwrap_err().row, 1);
        let mut x: [[Dual64; 2]; 5] =
            [0, 1, 2, 3, 4].map(|i| [Dual64::from(i as f64 - 1.5), Dual64::from(1.0)]);
        let b = x;
        DenseLu::factor(rows).unwrap().solve(&mut x);
        for i in 0..5 {
            for r in 0..2 {
                let mut sum = Dual64::from(0.0);
                (0..5).for_each(|j| sum += a(i, j) * x[j][r]);
                let off = sum - b[i][r];
                assert!(off.re.abs() < 1e-12 && off.eps.abs() < 1e-11, "{off:?}");
            }
        }
    }
}
