//! The lowest eigenvalues of a [`Pencil`] `K x = lambda M x` without omissions, with eigenvectors.
//!
//! Input: a number of eigenvalues, and the scale (1/s^2) of a small one. Output of `lowest`: so many pairs (all if
//! there are fewer), ascending, with `x' M x = 1`. Method: subspace iteration with the shifted inverse, `Y = (K - shift
//! M)^-1 M X`, and a Rayleigh-Ritz step on `Y`. It ends when the eigenvalues converge to [`EIGENVALUE_TOLERANCE`], or
//! to `STALLED` without further decrease.
//!
//! Eigenvalues are found from below, in batches. The first shift lies below all eigenvalues, later ones just above
//! those already found, to which vectors are kept orthogonal. Completeness is verified: by Sylvester's law `K - lambda
//! M` has as many negative pivots as there are eigenvalues below `lambda`, for a `lambda` just above the last one
//! found. A batch that fails is repeated with twice as many vectors; after `DOUBLINGS` doublings this is an error.

use crate::error::Error;
use crate::numerics::tangent::{Factors, Tangent};
use crate::statics::pencil::Pencil;
use crate::statics::stability::linear_combination;
use faer::{Mat, Side};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Number of eigenvalues of a batch. A larger number costs more per iteration, a smaller one more factorizations.
const BATCH: usize = 16;
/// Number of vectors iterated beyond a batch: they speed up the convergence of the last ones.
const EXTRA: usize = 8;
/// Largest number of iterations of a batch; then it is repeated with twice as many vectors.
const ITERATIONS: usize = 150;
/// Largest number of doublings of the number of vectors; then the search fails.
const DOUBLINGS: usize = 5;
/// Relative change of an eigenvalue's distance from the shift below which it is converged.
const EIGENVALUE_TOLERANCE: f64 = 1e-13;
/// Relative changes below this that no longer decrease are rounding errors, and count as converged.
const STALLED: f64 = 1e-7;
/// Number of iterations without a decrease after which a change is stalled.
const STALLED_ITERATIONS: usize = 10;
/// Relative distance below which eigenvalues belong to one batch: no shift can be placed between them.
const CLUSTER_DISTANCE: f64 = 1e-6;
/// Ratio of sufficient and insufficient distances of the first shift from zero at which its bisection ends. A ratio
/// closer to 1 costs factorizations, a larger one iterations.
const SHIFT_MARGIN: f64 = 1.1;
/// Ratio to the smallest change so far below which a change counts as a decrease.
const PROGRESS: f64 = 0.9;
/// Rounding errors of an eigenvalue by which the shift for the verification lies above it, at least.
const ROUNDING_MARGIN: f64 = 10.0;

/// An eigenvalue and eigenvector of a pencil.
#[derive(Clone, Debug)]
pub(crate) struct PencilMode {
    /// Eigenvalue, the squared angular frequency, 1/s^2.
    pub squared: f64,
    /// Eigenvector over the unknowns of the pencil, `x' M x = 1`.
    pub vector: Vec<f64>,
}

/// The iterated subspace.
#[derive(Default)]
struct Subspace {
    /// Vectors that span it.
    basis: Vec<Vec<f64>>,
    /// Distances of the Ritz values from the shift, ascending.
    values: Vec<f64>,
}

/// The lowest eigenvalues of a batch that are verified to be complete, with the shift of the next batch.
struct VerifiedBatch<F> {
    count: usize,
    /// A shift above these eigenvalues.
    shift: f64,
    /// The factors of the pencil at that shift.
    factors: F,
}

impl<T: Tangent<f64>> Pencil<f64, T> {
    /// The `count` lowest eigenpairs in ascending order, or all if there are fewer, with `x' M x = 1`. `scale`, 1/s^2,
    /// must be above zero: the order of magnitude of a small eigenvalue, where the search for the first shift starts.
    /// Start vectors are random with a fixed seed. A batch that is incomplete or does not converge is repeated with
    /// twice as many vectors.
    ///
    /// # Errors
    /// [`Error::Unconverged`] after [`DOUBLINGS`] doublings, [`Error::SingularEquilibrium`] for singular factors.
    pub fn lowest(&self, count: usize, scale: f64) -> Result<Vec<PencilMode>, Error> {
        let available = self.order();
        let count = count.min(available);
        let (mut factors, mut shift) = self.lower_shift(scale)?;
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let mut found: Vec<PencilMode> = Vec::new();
        let mut next = Subspace::default();
        let mut doublings = 0;
        while found.len() < count {
            // A batch of vectors, with some extra ones, filled up at random; a failed batch is repeated with twice as
            // many.
            let left = available - found.len();
            let batch = ((count - found.len()).min(BATCH) << doublings).min(left);
            let block = (batch + EXTRA).min(left);
            while next.basis.len() < block {
                let mut x = vec![0.0; self.mass.len()];
                x[self.free.clone()].fill_with(|| random.random_range(-1.0..1.0));
                next.basis.push(x);
            }
            let converged = self.iterate(&factors, batch, &found, &mut next)?;
            // A subspace of all remaining eigenvectors is complete; others are verified by counting.
            let verified = match converged && block < left {
                true => self.verify(batch, shift, found.len(), &next),
                false => None,
            };
            let own = match &verified {
                Some(verified) => verified.count,
                None if block == left => block,
                None => {
                    doublings += 1;
                    if doublings > DOUBLINGS {
                        return Err(Error::Unconverged { asked: count, unknowns: available });
                    }
                    continue;
                }
            };
            // Accepted eigenpairs leave the subspace; the others are start vectors of the next batch.
            for (value, vector) in next.values.drain(..own).zip(next.basis.drain(..own)) {
                found.push(PencilMode { squared: shift + value, vector });
            }
            next.values.clear();
            if let Some(verified) = verified {
                (shift, factors) = (verified.shift, verified.factors);
            }
        }
        found.truncate(count);
        Ok(found)
    }

    /// A shift below all eigenvalues, 1/s^2, and the factors of `K - shift M`. The shift is negative. Its distance from
    /// zero starts at `scale` and grows by factors of four until no pivot is negative. Bisection then reduces it to
    /// within [`SHIFT_MARGIN`] of an insufficient distance, if `scale` was insufficient. An error only if the distance
    /// overflows.
    fn lower_shift(&self, scale: f64) -> Result<(T::Factors, f64), Error> {
        // Distances of the shift from zero: sufficient, and insufficient.
        // Growth by factors of four until no pivot is negative.
        let [mut distance, mut short] = [scale, 0.0];
        let mut found = loop {
            match self.factors(-distance) {
                Ok(factors) if factors.negative_pivots() == 0 => break factors,
                Err(error) if !distance.is_finite() => return Err(error),
                _ => (short, distance) = (distance, 4.0 * distance),
            }
        };
        // Bisection towards the lowest eigenvalue: the distance of the shift slows the iteration down.
        while short > 0.0 && distance > SHIFT_MARGIN * short {
            let middle = 0.5 * (short + distance);
            match self.factors(-middle) {
                Ok(factors) if factors.negative_pivots() == 0 => {
                    (found, distance) = (factors, middle)
                }
                _ => short = middle,
            }
        }
        Ok((found, -distance))
    }

    /// Iterates the subspace until its first `batch` values converge, and overwrites its basis (Ritz vectors of unit
    /// norm in `M`) and values (ascending distances of Ritz values from the shift, 1/s^2). Returns whether they
    /// converge within [`ITERATIONS`] iterations: to a relative change of [`EIGENVALUE_TOLERANCE`], or to [`STALLED`]
    /// without further decrease. `factors` are those of the shifted matrix. Vectors are kept orthogonal to the modes
    /// `found`.
    fn iterate(
        &self,
        factors: &T::Factors,
        batch: usize,
        found: &[PencilMode],
        Subspace { basis, values }: &mut Subspace,
    ) -> Result<bool, Error> {
        let (mass, block) = (&self.mass[..], basis.len());
        let mut least = f64::INFINITY;
        let mut no_better = 0;
        for _ in 0..ITERATIONS {
            // Right-hand sides M X, and solutions Y; then Y made M-orthonormal, and M X with it.
            let image = |x: &Vec<f64>| x.iter().zip(mass).map(|(x, m)| x * m).collect();
            let mut images: Vec<Vec<f64>> = basis.iter().map(image).collect();
            basis.clone_from(&images);
            for x in basis.iter_mut() {
                factors.solve(x);
                // Rounding errors along the modes already found would grow.
                for PencilMode { vector, .. } in found {
                    let part = product(vector, x, mass);
                    x.iter_mut().zip(vector).for_each(|(x, y)| *x -= part * y);
                }
            }
            orthonormalize(basis, &mut images, mass);
            // Rayleigh-Ritz: the eigenvectors of the inverse, projected on the subspace.
            let small = Mat::from_fn(block, block, |i, j| {
                0.5 * (dot(&basis[i], &images[j]) + dot(&basis[j], &images[i]))
            });
            let eigen =
                small.self_adjoint_eigen(Side::Lower).map_err(|_| Error::SingularEquilibrium)?;
            let weights = |k: usize| (0..block).map(|j| eigen.U()[(j, k)]).collect::<Vec<f64>>();
            *basis = (0..block).map(|k| linear_combination(&basis[..], &weights(k))).collect();
            let before = std::mem::take(values);
            *values = (0..block).map(|k| eigen.S()[k]).collect();
            let change = |k: usize| match before.get(k) {
                Some(before) => (values[k] - before).abs() / values[k].abs(),
                None => f64::INFINITY,
            };
            let largest = (0..batch).map(change).fold(0.0, f64::max);
            (least, no_better) =
                if largest < PROGRESS * least { (largest, 0) } else { (least, no_better + 1) };
            let stalled = largest <= STALLED && no_better >= STALLED_ITERATIONS;
            if largest <= EIGENVALUE_TOLERANCE || stalled {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// The largest number `k` of the first `batch` values of the subspace after which a gap follows, with a shift just
    /// above them and its factors. A gap is twice [`CLUSTER_DISTANCE`] of the value, or twice [`ROUNDING_MARGIN`]
    /// rounding errors if that is more. The negative pivots at that shift must be `k` plus the number `known` of
    /// eigenvalues found before. `None` where they are not, where no gap follows any value, and for singular factors.
    fn verify(
        &self,
        batch: usize,
        shift: f64,
        known: usize,
        next: &Subspace,
    ) -> Option<VerifiedBatch<T::Factors>> {
        for k in (0..batch).rev() {
            // A shift between two eigenvalues must be farther from both than their rounding errors.
            let margin = (CLUSTER_DISTANCE * next.values[k])
                .max(ROUNDING_MARGIN * self.rounding(&next.basis[k]));
            if next.values[k] + 2.0 * margin < next.values[k + 1] {
                let shift = shift + next.values[k] + margin;
                let factors = self.factors(shift).ok()?;
                let complete = factors.negative_pivots() == known + k + 1;
                return complete.then_some(VerifiedBatch { count: k + 1, shift, factors });
            }
        }
        None
    }
}

/// The inner product `a' M b` with the diagonal matrix M of `mass`; the three have one length.
fn product(a: &[f64], b: &[f64], mass: &[f64]) -> f64 {
    a.iter().zip(b).zip(mass).map(|((a, b), m)| a * b * m).sum()
}

/// The inner product `a' b` of two vectors of one length.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Gram-Schmidt orthonormalization of the independent vectors `basis` with the inner product `a' M b` of the diagonal
/// `mass`, in place and in order, twice for accuracy. `images`, the products of the vectors with a matrix, are combined
/// with the same coefficients.
fn orthonormalize(basis: &mut [Vec<f64>], images: &mut [Vec<f64>], mass: &[f64]) {
    for k in 0..basis.len() {
        for _ in 0..2 {
            for j in 0..k {
                let part = product(&basis[j], &basis[k], mass);
                for vectors in [&mut *basis, &mut *images] {
                    let (done, rest) = vectors.split_at_mut(k);
                    rest[0].iter_mut().zip(&done[j]).for_each(|(x, y)| *x -= part * y);
                }
            }
            let norm = product(&basis[k], &basis[k], mass).sqrt().recip();
            for vectors in [&mut *basis, &mut *images] {
                vectors[k].iter_mut().for_each(|x| *x *= norm);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::banded::BandMatrix;

    fn diagonal(entries: &[f64]) -> Pencil<f64, BandMatrix<f64, 3>> {
        let mut tangent = BandMatrix::zeros(entries.len());
        for (i, entry) in entries.iter().enumerate() {
            tangent.add_corner(i, 1, &[[2.0 * entry]]);
        }
        Pencil { tangent, mass: vec![2.0; entries.len()], free: 0..entries.len() }
    }

    /// Among them clusters, negative eigenvalues and ones far below the scale.
    #[test]
    fn lowest_eigenvalues_of_a_diagonal_matrix_are_found() {
        let mut all: Vec<f64> = (0..60).map(|k| f64::from((k * 37) % 60).powi(2)).collect();
        all.extend([-7e5, -7e5, -3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 4.0, 4.0]);
        let pencil = diagonal(&all);
        all.sort_by(f64::total_cmp);
        for count in [1, 2, 3, 6, 12, 20, 50, 71, 100] {
            let found = pencil.lowest(count, 1.0).unwrap();
            assert_eq!(found.len(), count.min(71));
            for (PencilMode { squared: value, .. }, exact) in found.iter().zip(&all) {
                // The error is a part of the distance from the shift, which lies below all.
                assert!((value - exact).abs() < 1e-13 * 7e5, "{value} {exact}");
            }
        }
    }

    /// A converged subspace without one of the lowest eigenvectors is rejected.
    #[test]
    fn missing_eigenvalue_is_detected_by_the_inertia() {
        let pencil = diagonal(&[1.0, 2.0, 3.0, 4.0, 5.0]);
        let unit = |i: usize| (0..5).map(|k| f64::from(u8::from(k == i))).collect::<Vec<_>>();
        let verified = |modes: [usize; 3], batch: usize| {
            let basis = modes.map(unit).to_vec();
            let values = modes.map(|i| i as f64 + 1.5).to_vec();
            pencil.verify(batch, -0.5, 0, &Subspace { basis, values }).map(|v| v.count)
        };
        assert_eq!(verified([0, 1, 2], 2), Some(2));
        assert_eq!(verified([0, 2, 3], 1), Some(1));
        assert_eq!(verified([0, 2, 3], 2), None);
        assert_eq!(verified([1, 2, 3], 1), None);
    }
}
