//! The lowest eigenvalues of a [`Pencil`], none left out: by subspace iteration with the shifted
//! inverse, `Y = (K - shift M)^-1 M X` on the band factors, and a Rayleigh-Ritz step on `Y` (the
//! small eigenproblem is faer's), until the eigenvalues stand.
//!
//! They are found from below, some at a time. The shift lies just above those that are already
//! found, and vectors are kept orthogonal to theirs, so that the lowest of the others come first;
//! to begin with it lies below all, where `K - shift M` has no negative pivot. That none was missed
//! is not believed but counted: by Sylvester's law `K - lambda M` has as many negative pivots as
//! there are eigenvalues below `lambda`, for a `lambda` just above the last one found.

use crate::error::Error;
use crate::numerics::tangent::{Factors, Tangent};
use crate::statics::Pencil;
use faer::{Mat, Side};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// So many are found at a time.
const BATCH: usize = 16;
/// Vectors iterated beyond those asked for: they speed up the last ones.
const EXTRA: usize = 8;
/// Iterations at most; then twice as many vectors are taken, so often at most.
const ITERATIONS: usize = 150;
const DOUBLINGS: usize = 5;
/// Eigenvalues that change by less than this part of their distance from the shift stand.
const STANDS: f64 = 1e-13;
/// Changes below this part that fall no more are rounding errors.
const STALLED: f64 = 1e-7;
/// Eigenvalues nearer than this part are found together.
const APART: f64 = 1e-6;

/// Vectors that span the lowest modes not found before, and the distances of their Rayleigh
/// quotients from the shift.
#[derive(Default)]
struct Subspace {
    basis: Vec<Vec<f64>>,
    values: Vec<f64>,
}

impl<T: Tangent<f64>> Pencil<f64, T> {
    /// The `count` lowest eigenvalues in ascending order, or all there are, with their vectors.
    /// `scale`, 1/s^2, is a small eigenvalue.
    pub fn lowest(&self, count: usize, scale: f64) -> Result<Vec<(f64, Vec<f64>)>, Error> {
        let available = self.order();
        let count = count.min(available);
        let (mut factors, mut shift) = self.below_all(scale)?;
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let mut found: Vec<(f64, Vec<f64>)> = Vec::new();
        let mut next = Subspace::default();
        let mut doublings = 0;
        while found.len() < count {
            let left = available - found.len();
            let batch = ((count - found.len()).min(BATCH) << doublings).min(left);
            let block = (batch + EXTRA).min(left);
            while next.basis.len() < block {
                let mut x = vec![0.0; self.mass.len()];
                x[self.free.clone()].fill_with(|| random.random_range(-1.0..1.0));
                next.basis.push(x);
            }
            let stands = self.iterate(&factors, batch, &found, &mut next)?;
            let (own, above) = match block == left {
                true => (block, None),
                false if stands => match self.counted(batch, shift, found.len(), &next)? {
                    Some((own, above, factors)) => (own, Some((above, factors))),
                    None => (0, None),
                },
                false => (0, None),
            };
            if own == 0 {
                doublings += 1;
                if doublings > DOUBLINGS {
                    return Err(Error::Unconverged { asked: count, unknowns: available });
                }
                continue;
            }
            let values = next.values.drain(..own).map(|value| shift + value);
            found.extend(values.zip(next.basis.drain(..own)));
            next.values.clear();
            if let Some(above) = above {
                (shift, factors) = above;
            }
        }
        found.truncate(count);
        Ok(found)
    }

    /// The factors of `K - shift M`, and a shift below all eigenvalues.
    fn below_all(&self, scale: f64) -> Result<(T::Factors, f64), Error> {
        let [mut distance, mut short] = [scale, 0.0];
        let mut found = loop {
            match self.factors(-distance) {
                Ok(factors) if factors.negative_pivots() == 0 => break factors,
                Err(error) if !distance.is_finite() => return Err(error),
                _ => (short, distance) = (distance, 4.0 * distance),
            }
        };
        // Nearer to the lowest: the shift's distance slows down the iteration.
        while short > 0.0 && distance > 1.1 * short {
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

    /// Iterates until the first `batch` values stand; whether they do.
    fn iterate(
        &self,
        factors: &T::Factors,
        batch: usize,
        found: &[(f64, Vec<f64>)],
        Subspace { basis, values }: &mut Subspace,
    ) -> Result<bool, Error> {
        let (mass, block) = (&self.mass[..], basis.len());
        let mut least = f64::INFINITY;
        let mut no_better = 0;
        for _ in 0..ITERATIONS {
            // Right-hand sides M X, and solutions Y; then Y made M-orthonormal, and M X with it.
            let mut images: Vec<Vec<f64>> = basis
                .iter()
                .map(|x| x.iter().zip(mass).map(|(x, m)| x * m).collect::<Vec<f64>>())
                .collect();
            basis.clone_from(&images);
            for x in basis.iter_mut() {
                factors.solve(x);
                // What is found would come back, as rounding errors at the least.
                for (_, known) in found {
                    let part = product(known, x, mass);
                    x.iter_mut().zip(known).for_each(|(x, y)| *x -= part * y);
                }
            }
            orthonormalize(basis, &mut images, mass);
            let small = Mat::from_fn(block, block, |i, j| {
                0.5 * (dot(&basis[i], &images[j]) + dot(&basis[j], &images[i]))
            });
            let eigen =
                small.self_adjoint_eigen(Side::Lower).map_err(|_| Error::SingularEquilibrium)?;
            let rotation = eigen.U();
            *basis = (0..block)
                .map(|k| {
                    let mut x = vec![0.0; mass.len()];
                    for (j, y) in basis.iter().enumerate() {
                        let weight = rotation[(j, k)];
                        x.iter_mut().zip(y).for_each(|(x, y)| *x += weight * y);
                    }
                    x
                })
                .collect();
            let before = std::mem::take(values);
            *values = (0..block).map(|k| eigen.S()[k]).collect();
            let change = |k: usize| match before.get(k) {
                Some(before) => (values[k] - before).abs() / values[k].abs(),
                None => f64::INFINITY,
            };
            let largest = (0..batch).map(change).fold(0.0, f64::max);
            (least, no_better) =
                if largest < 0.9 * least { (largest, 0) } else { (least, no_better + 1) };
            if largest <= STANDS || largest <= STALLED && no_better >= 10 {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// How many of the first `batch` values are the lowest beyond the `known` ones for certain, and a
    /// shift above them with its factors; none where eigenvalues were missed, or where no gap tells
    /// those of the batch from others.
    fn counted(
        &self,
        batch: usize,
        shift: f64,
        known: usize,
        next: &Subspace,
    ) -> Result<Option<(usize, f64, T::Factors)>, Error> {
        for k in (0..batch).rev() {
            let margin = (APART * next.values[k]).max(10.0 * self.rounding(&next.basis[k]));
            if next.values[k] + 2.0 * margin < next.values[k + 1] {
                let above = shift + next.values[k] + margin;
                let Ok(factors) = self.factors(above) else { return Ok(None) };
                let all = factors.negative_pivots() == known + k + 1;
                return Ok(all.then_some((k + 1, above, factors)));
            }
        }
        Ok(None)
    }
}

/// `a' M b`.
fn product(a: &[f64], b: &[f64], mass: &[f64]) -> f64 {
    a.iter().zip(b).zip(mass).map(|((a, b), m)| a * b * m).sum()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Gram-Schmidt on `basis` in the metric `mass`, twice for accuracy, with the same combinations of
/// `images`.
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

    /// Clusters, negative ones and ones far below the scale.
    #[test]
    fn lowest_of_known_ones() {
        let mut all: Vec<f64> = (0..60).map(|k| f64::from((k * 37) % 60).powi(2)).collect();
        all.extend([-7e5, -7e5, -3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 4.0, 4.0]);
        let pencil = diagonal(&all);
        all.sort_by(f64::total_cmp);
        for count in [1, 2, 3, 6, 12, 20, 50, 71, 100] {
            let found = pencil.lowest(count, 1.0).unwrap();
            assert_eq!(found.len(), count.min(71));
            for ((value, _), exact) in found.iter().zip(&all) {
                // A part of the distance from the shift, which lies below all.
                assert!((value - exact).abs() < 1e-13 * 7e5, "{value} {exact}");
            }
        }
    }

    /// A subspace without one of the lowest, however well it stands, is found out.
    #[test]
    fn a_missing_one_is_noticed() {
        let pencil = diagonal(&[1.0, 2.0, 3.0, 4.0, 5.0]);
        let unit = |i: usize| (0..5).map(|k| f64::from(u8::from(k == i))).collect::<Vec<_>>();
        let counted = |modes: [usize; 3], batch: usize| {
            let basis = modes.map(unit).to_vec();
            let values = modes.map(|i| i as f64 + 1.5).to_vec();
            pencil.counted(batch, -0.5, 0, &Subspace { basis, values }).unwrap().map(|c| c.0)
        };
        assert_eq!(counted([0, 1, 2], 2), Some(2));
        assert_eq!(counted([0, 2, 3], 1), Some(1));
        assert_eq!(counted([0, 2, 3], 2), None);
        assert_eq!(counted([1, 2, 3], 1), None);
    }
}
