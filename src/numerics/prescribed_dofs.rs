//! Unknowns between free ones that go where something else leads them.
//!
//! What is solved for lies side by side, in one range. An unknown inside of it that is led stays in all
//! equations, but is coupled to none: its row and column are those of the identity, and its right-hand side is
//! zero. So its change is zero, and it has no part in that of the others. Where none is led, nothing is done.

use crate::numerics::scalar::Scalar;
use crate::numerics::tangent::Tangent;
use std::sync::Arc;

/// The unknowns that are led, in ascending order; clones share them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PrescribedDofs(Arc<[usize]>);

impl Default for PrescribedDofs {
    fn default() -> Self {
        Self(Arc::new([]))
    }
}

impl PrescribedDofs {
    /// These.
    pub fn new(mut unknowns: Vec<usize>) -> Self {
        unknowns.sort_unstable();
        unknowns.dedup();
        Self(unknowns.into())
    }

    /// Whether none is.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Whether unknown `i` is.
    pub fn contains(&self, i: usize) -> bool {
        self.0.binary_search(&i).is_ok()
    }

    /// The unknowns.
    pub fn iter(&self) -> impl Iterator<Item = usize> {
        self.0.iter().copied()
    }

    /// Gives the entries of led unknowns this value.
    #[inline]
    pub fn fill<T: Copy>(&self, x: &mut [T], value: T) {
        for i in &*self.0 {
            x[*i] = value;
        }
    }

    /// Makes their rows and columns those of the identity.
    #[inline]
    pub fn uncouple<D: Scalar>(&self, matrix: &mut impl Tangent<D>) {
        for i in &*self.0 {
            matrix.uncouple(*i);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::banded::{BandMatrix, Ldlt};
    use crate::numerics::tangent::Factors;

    /// What is left of the others is what leaving the led ones out would leave, and these do not change.
    #[test]
    fn others_are_solved_as_if_led_ones_were_not_there() {
        let n = 14;
        let mut whole = BandMatrix::<f64, 3>::zeros(n);
        for j in 0..n - 3 {
            let v = |k: usize| ((j * 7 + k * 3) % 11) as f64 / 11.0 - 0.4;
            whole.add_block(
                j,
                &[
                    [3.0, v(0), v(1), v(2)],
                    [v(0), 2.5, v(3), v(4)],
                    [v(1), v(3), 2.0, v(5)],
                    [v(2), v(4), v(5), 2.0],
                ],
            );
        }
        for led in [vec![], vec![4, 5], vec![9, 2], vec![0, 13], vec![7, 6, 7, 5]] {
            let led = PrescribedDofs::new(led);
            let free: Vec<usize> = (0..n).filter(|i| !led.contains(*i)).collect();
            let mut b: Vec<f64> = (0..n).map(|i| (i as f64).sin()).collect();
            led.fill(&mut b, 0.0);
            let mut matrix = whole.clone();
            led.uncouple(&mut matrix);
            let mut factors = Ldlt::with_order(n);
            factors.factor(&matrix, 0..n).unwrap();
            let mut x = b.clone();
            factors.solve(&mut x);
            assert!(led.iter().all(|i| x[i] == 0.0));
            let m = free.len();
            let rows = nalgebra::DMatrix::from_fn(m, m, |i, j| whole.get(free[i], free[j]));
            let right = nalgebra::DVector::from_fn(m, |i, _| b[free[i]]);
            let expected = rows.lu().solve(&right).unwrap();
            assert!(free.iter().zip(&expected).all(|(i, e)| (x[*i] - e).abs() < 1e-13));
        }
    }
}
