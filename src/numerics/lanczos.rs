//! The Lanczos method (1950) for symmetric positive semidefinite matrices that are given by products with vectors.
//!
//! Input: a vector `b`, and products with the matrix `A`, which the caller computes: [`Lanczos::next`] returns the
//! vector to be multiplied by `A`, or none at the end, and [`Lanczos::extend`] takes the product. After `k` products
//! there are an orthonormal basis `Q` of the Krylov space of `b`, and the tridiagonal matrix `T = Q' A Q`. Output:
//! eigenvalues of `T` ([`Lanczos::ritz_pairs`]: Ritz values, descending, each with vector and error bound), which
//! approximate the largest ones of `A`. [`Lanczos::solve`] returns `Q (T + shift)^-1 Q' b`, with `b` scaled to a given
//! length: the approximate solution of `(A + shift) x = b` for any shift without further products, with the norm of its
//! residual. This solution is zero before the first product, and if `T + shift` is not positive definite. Fits of many
//! parameters (fields along the rod) use it for steps and uncertainties, with one forward and one adjoint run for each
//! product.

use crate::numerics::total_order;
use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// Norm of the remainder of a product, relative to the largest norm of the products and of the start vector, up to
/// which it consists of rounding errors.
const BREAKDOWN: f64 = 1e-12;

/// The Krylov basis of a symmetric matrix `A` and its projection on it.
#[derive(Clone, Debug)]
pub struct Lanczos {
    /// Orthonormal basis vectors.
    basis: Vec<DVector<f64>>,
    /// The next basis vector.
    next: DVector<f64>,
    /// Norm of the part of the last product outside of the basis: the next subdiagonal entry of `T`.
    remainder: f64,
    /// Diagonal of `T`.
    diagonal: Vec<f64>,
    /// Subdiagonal of `T`, up to the entry beside the next basis vector.
    subdiagonal: Vec<f64>,
    /// Largest norm of the start vector and of the products with basis vectors.
    scale: f64,
}

/// An approximate eigenvalue and eigenvector of a matrix.
#[derive(Clone, Debug)]
pub struct RitzPair {
    /// Approximate eigenvalue.
    pub value: f64,
    /// Norm of the residual `A v - value v`, a bound of the distance to the nearest eigenvalue.
    pub error: f64,
    /// Approximate eigenvector of length one.
    pub vector: Vec<f64>,
}

/// The scalar product, summed in the order of the entries, so that results do not depend on the vector instructions.
fn dot(a: &DVector<f64>, b: &DVector<f64>) -> f64 {
    a.iter().zip(b.iter()).map(|(a, b)| a * b).sum()
}

impl Lanczos {
    /// The Krylov space of the vector `start`, before the first product: the first [next](Self::next) vector is `start`
    /// over its norm. The space of a zero vector is complete.
    pub fn new(start: Vec<f64>) -> Self {
        let start = DVector::from_vec(start);
        let norm = dot(&start, &start).sqrt();
        Self {
            basis: Vec::new(),
            // A zero vector stays zero instead of NaN; its space is complete.
            next: start / norm.max(f64::MIN_POSITIVE),
            remainder: norm,
            diagonal: Vec::new(),
            subdiagonal: Vec::new(),
            scale: norm,
        }
    }

    /// The vector, of length one, whose product with `A` extends the basis; `None` if the Krylov space is complete. It
    /// is after as many products as rows, or if the remainder is at most `BREAKDOWN` of the largest norm of a product
    /// or of the start vector.
    pub fn next(&self) -> Option<&[f64]> {
        let complete =
            self.remainder <= BREAKDOWN * self.scale || self.basis.len() >= self.next.len();
        (!complete).then_some(self.next.as_slice())
    }

    /// Number of products so far, the dimension of the basis.
    pub fn count(&self) -> usize {
        self.basis.len()
    }

    /// Extends the basis by `product`, that of `A` with the [next](Self::next) vector: orthogonalizes it twice against
    /// all basis vectors, and adds a row and column to `T`.
    pub fn extend(&mut self, product: Vec<f64>) {
        let mut product = DVector::from_vec(product);
        self.diagonal.push(dot(&product, &self.next));
        self.scale = self.scale.max(dot(&product, &product).sqrt());
        self.basis.push(std::mem::take(&mut self.next));
        // Twice: rounding errors of the first orthogonalization would grow to copies of the basis vectors.
        for _ in 0..2 {
            for vector in &self.basis {
                let part = dot(&product, vector);
                product.axpy(-part, vector, 1.0);
            }
        }
        self.remainder = dot(&product, &product).sqrt();
        self.subdiagonal.push(self.remainder);
        self.next = product / self.remainder.max(f64::MIN_POSITIVE);
    }

    /// The tridiagonal projection `T = Q' A Q` of the matrix on the basis, with as many rows as products.
    fn projection(&self) -> DMatrix<f64> {
        let k = self.count();
        DMatrix::from_fn(k, k, |i, j| match i.abs_diff(j) {
            0 => self.diagonal[i],
            1 => self.subdiagonal[i.min(j)],
            _ => 0.0,
        })
    }

    /// The vector `Q c` with the `coordinates` `c` in the Krylov basis; missing coordinates count as zero.
    fn combination(&self, coordinates: impl IntoIterator<Item = f64>) -> Vec<f64> {
        let mut sum = DVector::zeros(self.next.len());
        for (coordinate, vector) in coordinates.into_iter().zip(&self.basis) {
            sum.axpy(coordinate, vector, 1.0);
        }
        sum.data.into()
    }

    /// The solution `x` of `(A + shift) x = b` in the Krylov space, and the norm of its residual. `b` is the start
    /// vector scaled to the norm `length`. Zero, with the residual `length`, before the first product or if `T + shift`
    /// is not positive definite.
    pub fn solve(&self, shift: f64, length: f64) -> (Vec<f64>, f64) {
        let k = self.count();
        let matrix = self.projection() + DMatrix::identity(k, k) * shift;
        match matrix.cholesky().filter(|_| k > 0) {
            None => (vec![0.0; self.next.len()], length),
            Some(factors) => {
                let y =
                    factors.solve(&DVector::from_fn(k, |i, _| if i == 0 { length } else { 0.0 }));
                // The residual is the part of `A x` outside of the basis: the last coordinate times the remainder.
                (self.combination(y.iter().copied()), self.remainder * y[k - 1].abs())
            }
        }
    }

    /// Approximate eigenpairs of `A` from the eigenvalues and eigenvectors of `T`, one per product, by descending
    /// eigenvalues. Each has a bound of its distance to the nearest eigenvalue of `A`. At least one product is
    /// required.
    pub fn ritz_pairs(&self) -> Vec<RitzPair> {
        let SymmetricEigen { eigenvalues, eigenvectors } = SymmetricEigen::new(self.projection());
        let mut order: Vec<usize> = (0..eigenvalues.len()).collect();
        order.sort_by_cached_key(|k| std::cmp::Reverse(total_order(eigenvalues[*k])));
        let pair = |k: usize| RitzPair {
            value: eigenvalues[k],
            error: (self.remainder * eigenvectors[(self.count() - 1, k)]).abs(),
            vector: self.combination(eigenvectors.column(k).iter().copied()),
        };
        order.into_iter().map(pair).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Entries of a diagonal matrix: four large ones, two of them equal, and small ones.
    fn entry(i: usize) -> f64 {
        [100.0, 7.0, 7.0, 2.0].get(i).copied().unwrap_or(1e-3 / (1.0 + i as f64))
    }

    /// The basis after so many products with that matrix.
    fn basis(products: usize) -> Lanczos {
        let mut lanczos = Lanczos::new((0..40).map(|i| 1.0 + (i % 3) as f64).collect());
        while let (Some(next), true) = (lanczos.next(), lanczos.count() < products) {
            let product = next.iter().enumerate().map(|(i, x)| entry(i) * x).collect();
            lanczos.extend(product);
        }
        lanczos
    }

    #[test]
    fn ritz_values_converge_to_the_largest_eigenvalues() {
        let pairs = basis(12).ritz_pairs();
        // The largest eigenvalues of the diagonal matrix.
        for expected in [100.0, 7.0, 2.0] {
            let agrees =
                |pair: &RitzPair| (pair.value - expected).abs() < 1e-9 && pair.error < 1e-6;
            assert!(pairs.iter().any(agrees), "{expected}");
        }
        let product: f64 = pairs[0].vector.iter().zip(&pairs[1].vector).map(|(a, b)| a * b).sum();
        assert!(product.abs() < 1e-12 && (pairs[0].vector[0].abs() - 1.0).abs() < 1e-9);
    }

    #[test]
    fn systems_with_any_shift_are_solved_from_the_same_products() {
        let lanczos = basis(12);
        let b = DVector::from_fn(40, |i, _| 1.0 + (i % 3) as f64);
        for shift in [1.0, 10.0] {
            let (x, residual) = lanczos.solve(shift, b.norm());
            let largest =
                (0..40).map(|i| ((entry(i) + shift) * x[i] - b[i]).abs()).fold(0.0, f64::max);
            assert!(largest < 1e-9 && residual < 1e-8, "{shift}: {largest:e}, {residual:e}");
        }
        // The Krylov space is complete at the latest after as many products as unknowns.
        assert!(basis(40).count() <= 40);
    }
}
