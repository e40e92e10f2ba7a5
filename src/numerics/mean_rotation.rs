//! The mean of rotations: the constant rotation from which they differ least.
//!
//! Input: rotation matrices `R_k`, with numbers that may carry derivatives. Output: the rotation matrix `C` that
//! minimizes the sum of the squares of the rotation vectors `r_k` of `C' R_k` (the Karcher mean; Moakher 2002,
//! doi:10.1137/S0895479801383877). There the sum of the `r_k` is zero. Newton's method starts at the rotation nearest
//! to the sum of the matrices:
//!
//! ```text
//! C <- C exp(c),   (sum of J(r_k)^-1) c = sum of r_k,   J(r) = T(r)'
//! ```
//!
//! with the tangent map `T`. It converges in plain numbers first. One step with derivatives for each of their orders
//! then makes these exact. The mean of no rotations is the identity. Rotations that differ by about half a turn may
//! have several means; the result is then one of them, or the start, and finite.

use crate::numerics::rotation::{
    Matrix3, components_of, exponential, identity, inverse, product, rotation_vector, tangent_map,
    times, transpose,
};
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::{Vector, add, dot};

/// Largest number of steps of Newton's method in plain numbers. Rotations that differ by less than 1 rad take about
/// four.
const MOST_STEPS: usize = 50;
/// Length of the last step, rad, at which the method has converged.
const CONVERGED: f64 = 1e-14;

/// The mean of `rotations`, as the header defines it, with derivatives.
pub(crate) fn mean_rotation<D: Scalar>(rotations: &[Matrix3<D>]) -> Matrix3<D> {
    let plain: Vec<Matrix3<f64>> =
        rotations.iter().map(|m| m.map(|row| row.map(|x| x.value()))).collect();
    let mut mean = nearest_rotation(&plain);
    let mut slope = identity();
    for _ in 0..MOST_STEPS {
        let (sum, inverse_slope) = (sum_of_vectors(&mean, &plain), inverse_slope(&mean, &plain));
        let step = times(&inverse_slope, sum);
        if !step.iter().chain(inverse_slope.iter().flatten()).all(|x| x.is_finite()) {
            break;
        }
        slope = inverse_slope;
        mean = product(&mean, &exponential(step));
        if dot(step, step).sqrt() < CONVERGED {
            break;
        }
    }
    let mut derived = mean.map(|row| row.map(D::from));
    let slope = slope.map(|row| row.map(D::from));
    for _ in 0..D::ORDER {
        let step = times(&slope, sum_of_vectors(&derived, rotations));
        derived = product(&derived, &exponential(step));
    }
    derived
}

/// The sum of the rotation vectors, rad, of the `rotations` relative to `mean`.
fn sum_of_vectors<D: Scalar>(mean: &Matrix3<D>, rotations: &[Matrix3<D>]) -> Vector<D> {
    let back = transpose(mean);
    let vector = |rotation| rotation_vector(&product(&back, rotation));
    rotations.iter().map(vector).fold([D::from(0.0); 3], add)
}

/// The inverse of the sum of `J(r)^-1` over the rotation vectors `r` of the `rotations` relative to `mean`. Not finite
/// if the sum is singular.
fn inverse_slope(mean: &Matrix3<f64>, rotations: &[Matrix3<f64>]) -> Matrix3<f64> {
    let back = transpose(mean);
    let mut sum = [[0.0; 3]; 3];
    for rotation in rotations {
        let own = inverse(&tangent_map(rotation_vector(&product(&back, rotation))));
        sum = components_of(|i, j| sum[i][j] + own[j][i]);
    }
    inverse(&sum)
}

/// The rotation nearest to the sum of the `rotations` (in the Frobenius norm, by singular values); the identity
/// of none.
fn nearest_rotation(rotations: &[Matrix3<f64>]) -> Matrix3<f64> {
    let sum = nalgebra::Matrix3::from_fn(|i, j| rotations.iter().map(|m| m[i][j]).sum());
    if rotations.is_empty() || !sum.iter().all(|x: &f64| x.is_finite()) {
        return identity();
    }
    let svd = nalgebra::SVD::new(sum, true, true);
    let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else { return identity() };
    // A reflection is turned to a rotation along the direction of the least singular value.
    let sign = (u * v_t).determinant().signum();
    let least = svd.singular_values.imin();
    let mut signs = nalgebra::Matrix3::identity();
    signs[(least, least)] = sign;
    let nearest = u * signs * v_t;
    components_of(|i, j| nearest[(i, j)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_dual::{Dual64, HyperDual64};

    const CENTER: [f64; 3] = [0.9, -1.7, 1.4];
    const OTHERS: [[f64; 3]; 5] =
        [[0.3, -0.2, 0.5], [-0.7, 0.4, 0.1], [0.0; 3], [0.1, 0.9, -0.6], [-0.2, -0.4, 0.3]];

    /// Rotations about a center by vectors that change with `h`.
    fn rotations<D: Scalar>(h: D) -> Vec<Matrix3<D>> {
        let changed = |(k, r): (usize, &[f64; 3])| {
            let r = [0, 1, 2].map(|c| D::from(r[c]) + (h * (1.0 + k as f64 * c as f64)).sin());
            product(&exponential(CENTER.map(D::from)), &exponential(r))
        };
        OTHERS.iter().enumerate().map(changed).collect()
    }

    #[test]
    fn mean_of_equal_rotations_is_the_rotation_and_of_pairs_the_center() {
        let center = exponential(CENTER);
        let near = |found: Matrix3<f64>| {
            let off = rotation_vector(&product(&transpose(&center), &found));
            assert!(dot(off, off).sqrt() < 1e-14, "{off:?}");
        };
        near(mean_rotation(&[center, center]));
        // Rotations by opposite vectors, up to 3 rad.
        let pair = |r: [f64; 3]| {
            [1.0, -1.0].map(|sign| product(&center, &exponential(r.map(|x| sign * x))))
        };
        near(mean_rotation(&[pair([0.1, 0.2, -0.3]), pair([0.5, -0.9, 0.2])].concat()));
        near(mean_rotation(&[&[center; 3][..], &pair([1.8, -2.1, 1.2])].concat()));
        assert_eq!(mean_rotation::<f64>(&[]), identity::<f64>());
    }

    #[test]
    fn sum_of_rotation_vectors_about_the_mean_is_zero() {
        let all = rotations(0.02);
        let sum = sum_of_vectors(&mean_rotation(&all), &all);
        assert!(sum.iter().all(|x| x.abs() < 1e-13), "{sum:?}");
    }

    /// Oracle: differences of fourth order of the plain mean, and of the first derivatives.
    #[test]
    fn derivatives_of_the_mean_are_those_of_differences() {
        // The rotations have derivatives up to 9^n of order n: central differences alone are off by 1e-8.
        const STEP: f64 = 1e-4;
        let plain = |h: f64| mean_rotation(&rotations(h));
        let dual =
            |h: f64| mean_rotation(&rotations(Dual64::new(h, 1.0))).map(|row| row.map(|x| x.eps));
        let difference = |of: &dyn Fn(f64) -> Matrix3<f64>, i: usize, j: usize| {
            let side = |h: f64| (of(h)[i][j] - of(-h)[i][j]) / (2.0 * h);
            (4.0 * side(STEP) - side(2.0 * STEP)) / 3.0
        };
        let second = mean_rotation(&rotations(HyperDual64::new(0.0, 1.0, 1.0, 0.0)));
        let first = dual(0.0);
        for i in 0..3 {
            for j in 0..3 {
                let by_differences = difference(&plain, i, j);
                let off = (first[i][j] - by_differences).abs();
                assert!(off < 1e-9, "{i} {j}: {off:e}");
                assert!((second[i][j].eps1 - first[i][j]).abs() < 1e-12, "{i} {j}");
                let by_differences = difference(&dual, i, j);
                let off = (second[i][j].eps1eps2 - by_differences).abs();
                assert!(off < 1e-8 * by_differences.abs().max(1.0), "{i} {j}: {off:e}");
            }
        }
    }

    /// Half turns about three axes have no single mean.
    #[test]
    fn mean_of_half_turns_is_finite() {
        let half = std::f64::consts::PI;
        let turns = [[half, 0.0, 0.0], [0.0, half, 0.0], [0.0, 0.0, half], [0.0; 3]];
        let turns = turns.map(|r| exponential(r.map(|x| Dual64::new(x, 1.0))));
        let mean = mean_rotation(&turns);
        assert!(mean.iter().flatten().all(|x| x.re.is_finite() && x.eps.is_finite()), "{mean:?}");
    }
}
