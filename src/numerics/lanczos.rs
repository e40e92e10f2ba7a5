//! Symmetric matrices that are known by what they make of vectors, after Lanczos (1950): the matrix in the few directions
//! in which it is large, one product each.

use crate::numerics::total_order;
use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// Part of a vector below which what is left of it has no digits.
const NOTHING: f64 = 1e-12;

/// A symmetric matrix `A` in the directions that follow from a vector.
#[derive(Clone, Debug)]
pub struct Lanczos {
    /// Orthonormal.
    directions: Vec<Vec<f64>>,
    /// The next one, and how much of it the last product had.
    next: Vec<f64>,
    left: f64,
    diagonal: Vec<f64>,
    beside: Vec<f64>,
    size: f64,
}

/// Directions in which a matrix is known.
#[derive(Clone, Debug)]
pub struct Ritz {
    /// What it is in each, the largest first, and how far that may be off.
    pub values: Vec<(f64, f64)>,
    /// The directions, of length one.
    pub vectors: Vec<Vec<f64>>,
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn add(to: &mut [f64], factor: f64, from: &[f64]) {
    to.iter_mut().zip(from).for_each(|(to, from)| *to += factor * from);
}

impl Lanczos {
    /// From a vector, without any product yet.
    pub fn new(start: Vec<f64>) -> Self {
        let size = dot(&start, &start).sqrt();
        let next = start.into_iter().map(|x| x / size.max(f64::MIN_POSITIVE)).collect();
        let (directions, diagonal, beside) = (Vec::new(), Vec::new(), Vec::new());
        Self { directions, next, left: size, diagonal, beside, size }
    }

    /// The direction whose product with `A` is wanted next; none where all are known that follow.
    pub fn next(&self) -> Option<&[f64]> {
        let known = self.left <= NOTHING * self.size || self.directions.len() >= self.next.len();
        (!known).then_some(&self.next[..])
    }

    /// How many products it was told.
    pub fn count(&self) -> usize {
        self.directions.len()
    }

    /// Takes the product of `A` with the [next](Self::next) direction.
    pub fn take(&mut self, mut product: Vec<f64>) {
        let direction = std::mem::take(&mut self.next);
        self.diagonal.push(dot(&product, &direction));
        self.size = self.size.max(dot(&product, &product).sqrt());
        self.directions.push(direction);
        // Twice: what rounding leaves of the directions that there are would make copies of them.
        for _ in 0..2 {
            for direction in &self.directions {
                let part = dot(&product, direction);
                add(&mut product, -part, direction);
            }
        }
        self.left = dot(&product, &product).sqrt();
        self.beside.push(self.left);
        let by = self.left.max(f64::MIN_POSITIVE);
        self.next = product.into_iter().map(|x| x / by).collect();
    }

    fn matrix(&self) -> DMatrix<f64> {
        let k = self.count();
        DMatrix::from_fn(k, k, |i, j| match i.abs_diff(j) {
            0 => self.diagonal[i],
            1 => self.beside[i.min(j)],
            _ => 0.0,
        })
    }

    /// The solution of `(A + shift) x = b` in the directions known, `b` the vector that they follow from, of the length
    /// it has; and how long what is left of `b` is.
    pub fn solve(&self, shift: f64, length: f64) -> (Vec<f64>, f64) {
        let k = self.count();
        let mut x = vec![0.0; self.next.len()];
        let mut right = DVector::zeros(k);
        let Some(first) = right.get_mut(0) else { return (x, length) };
        *first = length;
        let matrix = self.matrix() + DMatrix::identity(k, k) * shift;
        let Some(y) = matrix.cholesky().map(|factors| factors.solve(&right)) else {
            return (x, length);
        };
        y.iter().zip(&self.directions).for_each(|(y, direction)| add(&mut x, *y, direction));
        (x, self.left * y[k - 1].abs())
    }

    /// What is known of the matrix.
    pub fn ritz(&self) -> Ritz {
        let eigen = SymmetricEigen::new(self.matrix());
        let values = &eigen.eigenvalues;
        let mut order: Vec<usize> = (0..values.len()).collect();
        order.sort_by_cached_key(|x| total_order(values[*x]));
        order.reverse();
        let last = self.count().saturating_sub(1);
        let value =
            |i: &usize| (eigen.eigenvalues[*i], (self.left * eigen.eigenvectors[(last, *i)]).abs());
        let vector = |i: &usize| {
            let mut vector = vec![0.0; self.next.len()];
            for (k, direction) in self.directions.iter().enumerate() {
                add(&mut vector, eigen.eigenvectors[(k, *i)], direction);
            }
            vector
        };
        Ritz {
            values: order.iter().map(value).collect(),
            vectors: order.iter().map(vector).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A diagonal matrix with few large entries, among them two alike.
    fn entry(i: usize) -> f64 {
        [100.0, 7.0, 7.0, 2.0].get(i).copied().unwrap_or(1e-3 / (1.0 + i as f64))
    }

    fn known(products: usize) -> Lanczos {
        let mut lanczos = Lanczos::new((0..40).map(|i| 1.0 + (i % 3) as f64).collect());
        while let (Some(next), true) = (lanczos.next(), lanczos.count() < products) {
            let product = next.iter().enumerate().map(|(i, x)| entry(i) * x).collect();
            lanczos.take(product);
        }
        lanczos
    }

    #[test]
    fn large_directions_are_known_after_few_products() {
        let ritz = known(12).ritz();
        for expected in [100.0, 7.0, 2.0] {
            let known = |(value, off): &(f64, f64)| (value - expected).abs() < 1e-9 && *off < 1e-6;
            assert!(ritz.values.iter().any(known), "{expected}: {:?}", ritz.values);
        }
        let across = dot(&ritz.vectors[0], &ritz.vectors[1]);
        assert!(across.abs() < 1e-12 && (ritz.vectors[0][0].abs() - 1.0).abs() < 1e-9);
    }

    #[test]
    fn equations_with_any_shift_are_solved_from_the_same_products() {
        let lanczos = known(12);
        let b: Vec<f64> = (0..40).map(|i| 1.0 + (i % 3) as f64).collect();
        for shift in [1.0, 10.0] {
            let (x, left) = lanczos.solve(shift, dot(&b, &b).sqrt());
            let off = (0..40).map(|i| ((entry(i) + shift) * x[i] - b[i]).abs()).fold(0.0, f64::max);
            assert!(off < 1e-9 && left < 1e-8, "{shift}: {off:e}, {left:e}");
        }
        // All directions that follow are known sooner than there are unknowns.
        assert!(known(40).count() <= 40);
    }
}
