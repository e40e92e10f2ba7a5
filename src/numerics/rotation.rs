//! Rotations in space by rotation vectors: the exponential map, its tangent map, and the logarithm (Simo and Vu-Quoc
//! 1988, doi:10.1016/0045-7825(88)90073-4), and small operations on matrices of three rows.
//!
//! The rotation vector `r`, rad, belongs to the rotation `exp(r)`. To first order in a change `dr` of the vector,
//!
//! ```text
//! exp(r + dr) = exp(r) exp(T dr),  T = 1 - a r x + b r x r x,  a = (1 - cos s)/s^2,  b = (s - sin s)/s^3,  s = |r|,
//! ```
//!
//! where `r x` is the matrix of the cross product with `r`. So `T dr` is the small rotation that follows, in the turned
//! axes. Rotation matrices have the turned axes in their columns. `exponential` is `exp(r)` and `tangent_map` is `T`.
//! `logarithm` returns the rotation vector of a rotation by less than half a turn, and is not finite at half a turn.
//! `rotation_vector` returns that of any rotation, of length up to half a turn. `tangent_map_slope` is the symmetric
//! part of the derivative of `T' u` by `r`. All functions take numbers with derivatives. Bodies and joints of
//! assemblies, and measured rotations, use them.
//!
//! `orthonormal` returns a rotation matrix near a given one (Gram-Schmidt). The inverse of a singular matrix is not
//! finite.

use crate::numerics::scalar::Scalar;
use crate::numerics::vector::{
    Vector, add, combine, components, cross, dot, rotate, scale, sub, unit,
};

/// A matrix of three rows and columns, by its rows.
pub type Matrix3<D> = [[D; 3]; 3];

/// The square of an angle, rad^2, below which series replace quotients of small differences.
const SERIES_BELOW: f64 = 1.0;
/// Number of terms of these series: the first neglected one is below 1e-17.
const TERMS: usize = 9;
/// The square of the sine of half an angle below which the series of the arc sine is used.
const SMALL_HALF_SINE: f64 = 0.02;
/// Coefficients of the series of `asin(x)/x` by `x^2`.
const ARC_SINE: [f64; 10] = [
    1.0,
    1.0 / 6.0,
    3.0 / 40.0,
    15.0 / 336.0,
    105.0 / 3456.0,
    945.0 / 42240.0,
    10395.0 / 599_040.0,
    135_135.0 / 9_676_800.0,
    2_027_025.0 / 175_472_640.0,
    34_459_425.0 / 3_530_096_640.0,
];

/// The identity matrix of three rows.
pub fn identity<D: Scalar>() -> Matrix3<D> {
    components_of(|i, j| D::from(f64::from(i == j)))
}

/// The matrix with the entries `entry(row, column)`.
#[inline(always)]
pub fn components_of<D: Scalar>(entry: impl Fn(usize, usize) -> D) -> Matrix3<D> {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| entry(i, j)))
}

/// The product `m v` of a matrix and a vector.
#[inline(always)]
pub fn times<D: Scalar>(m: &Matrix3<D>, v: Vector<D>) -> Vector<D> {
    [dot(m[0], v), dot(m[1], v), dot(m[2], v)]
}

/// `m' v`, with the transpose of `m`.
#[inline(always)]
pub fn transposed_times<D: Scalar>(m: &Matrix3<D>, v: Vector<D>) -> Vector<D> {
    components(|c| m[0][c] * v[0] + m[1][c] * v[1] + m[2][c] * v[2])
}

/// The matrix product `a b`.
pub fn product<D: Scalar>(a: &Matrix3<D>, b: &Matrix3<D>) -> Matrix3<D> {
    components_of(|i, j| a[i][0] * b[0][j] + a[i][1] * b[1][j] + a[i][2] * b[2][j])
}

/// The transpose of `m`.
pub fn transpose<D: Scalar>(m: &Matrix3<D>) -> Matrix3<D> {
    components_of(|i, j| m[j][i])
}

/// Column `j` of `m`, from 0 on.
#[inline(always)]
pub fn column<D: Scalar>(m: &Matrix3<D>, j: usize) -> Vector<D> {
    [m[0][j], m[1][j], m[2][j]]
}

/// The skew matrix `M` of the vector `v = [x, y, z]` with `M u = v x u` for every `u`.
pub fn cross_matrix<D: Scalar>([x, y, z]: Vector<D>) -> Matrix3<D> {
    let zero = D::from(0.0);
    [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
}

/// The inverse of `m` by cofactors over the determinant; entries are not finite for a singular matrix.
pub fn inverse<D: Scalar>(m: &Matrix3<D>) -> Matrix3<D> {
    let rows = [cross(m[1], m[2]), cross(m[2], m[0]), cross(m[0], m[1])];
    let by = dot(m[0], rows[0]).recip();
    components_of(|i, j| rows[j][i] * by)
}

/// The matrix with orthonormal columns near those of `m` (Gram-Schmidt). The first column is that of `m` scaled to
/// length one, the second one that of `m` made orthogonal to the first and scaled. The third one is their cross
/// product, whatever that of `m` is.
pub fn orthonormal<D: Scalar>(m: &Matrix3<D>) -> Matrix3<D> {
    let first = unit(column(m, 0));
    let second = column(m, 1);
    let second = unit(sub(second, scale(first, dot(first, second))));
    transpose(&[first, second, cross(first, second)])
}

/// The rotation matrix of the rotation vector `r`, rad, by Rodrigues' formula; the identity for zero.
pub fn exponential<D: Scalar>(r: Vector<D>) -> Matrix3<D> {
    transpose(&identity::<D>().map(|axis| rotate(r, axis)))
}

/// The sum of `(-1)^k x^k/(2k + first)!` over `k` below [`TERMS`], or its derivative by `x` if `is_derivative`.
fn alternating_series<D: Scalar>(x: D, first: usize, is_derivative: bool) -> D {
    let factorial = |n: usize| (1..=n).map(|k| k as f64).product::<f64>();
    let coefficient = |k: usize| {
        let sign = if k.is_multiple_of(2) { 1.0 } else { -1.0 };
        sign / factorial(2 * k + first) * if is_derivative { k as f64 } else { 1.0 }
    };
    let least = usize::from(is_derivative);
    (least..TERMS).rev().fold(D::from(0.0), |sum, k| sum * x + coefficient(k))
}

/// Returns `[a, b, 2 da/dx, 2 db/dx]` with the coefficients `a` and `b` of the tangent map, at the squared angle
/// `x = square`, rad^2. They are computed by series below [`SERIES_BELOW`], else by the formulas of the header.
fn coefficients<D: Scalar>(square: D) -> [D; 4] {
    // The quotients below lose digits at small angles, and their derivatives do not exist at zero.
    if square.value() < SERIES_BELOW {
        let double = |first: usize| alternating_series(square, first, true) * 2.0;
        let plain = |first: usize| alternating_series(square, first, false);
        return [plain(2), plain(3), double(2), double(3)];
    }
    let angle = square.sqrt();
    let [sine, cosine] = angle.sin_cos();
    let (rest, part) = (-cosine + 1.0, angle - sine);
    [
        rest / square,
        part / (square * angle),
        (angle * sine - rest * 2.0) / (square * square),
        (angle * rest - part * 3.0) / (square * square * angle),
    ]
}

/// The tangent map `T = 1 - a r x + b r x r x` at the rotation vector `r`, rad.
pub fn tangent_map<D: Scalar>(r: Vector<D>) -> Matrix3<D> {
    let [a, b, ..] = coefficients(dot(r, r));
    let (once, twice) = (cross_matrix(r), product(&cross_matrix(r), &cross_matrix(r)));
    components_of(|i, j| twice[i][j] * b - once[i][j] * a + f64::from(i == j))
}

/// The symmetric part of the derivative of `T(r)' u` by the rotation vector `r`, rad, at a fixed vector `u`. It equals
/// the second derivatives of `u.log(exp(-r) exp(r + dr))` by `dr`.
pub fn tangent_map_slope<D: Scalar>(r: Vector<D>, u: Vector<D>) -> Matrix3<D> {
    let [a, b, da, db] = coefficients(dot(r, r));
    let (across, twice) = (cross(r, u), cross(r, cross(r, u)));
    let along = combine(da, across, db, twice);
    // Column by column: the derivative along an axis.
    let columns = identity::<D>().map(|axis| {
        let first = scale(cross(axis, u), a);
        let second = add(cross(axis, across), cross(r, cross(axis, u)));
        add(add(first, scale(second, b)), scale(along, dot(r, axis)))
    });
    components_of(|i, j| (columns[i][j] + columns[j][i]) * 0.5)
}

/// The rotation vector, rad, of the rotation matrix `m` by less than half a turn. It is zero for the identity, loses
/// digits towards half a turn and is not finite there.
pub fn logarithm<D: Scalar>(m: &Matrix3<D>) -> Vector<D> {
    let cosine = (m[0][0] + m[1][1] + m[2][2] - 1.0) * 0.5;
    let half_cosine = ((cosine + 1.0) * 0.5).sqrt();
    // The axis times the sine of half the angle.
    let by = (half_cosine * 4.0).recip();
    let axis = [m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]].map(|x| x * by);
    twice_half_angle(axis, half_cosine)
}

/// The rotation vector of any rotation matrix, rad, of length up to half a turn. It and its derivatives are finite for
/// every rotation. Its sign changes at half a turn, where both signs are the same rotation.
pub fn rotation_vector<D: Scalar>(m: &Matrix3<D>) -> Vector<D> {
    let diagonal = [m[0][0], m[1][1], m[2][2]];
    let trace = diagonal[0] + diagonal[1] + diagonal[2];
    // Of the quaternion a component that is not small follows from the diagonal, the others by division by it.
    let (half_cosine, axis) = if trace.value() > 0.0 {
        let half_cosine = (trace + 1.0).sqrt() * 0.5;
        let by = (half_cosine * 4.0).recip();
        let axis = [m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]];
        (half_cosine, axis.map(|x| x * by))
    } else {
        let larger = |i: usize, j: usize| if diagonal[j] > diagonal[i].value() { j } else { i };
        let i = larger(larger(0, 1), 2);
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        let own = (diagonal[i] - diagonal[j] - diagonal[k] + 1.0).sqrt() * 0.5;
        let by = (own * 4.0).recip();
        let mut axis = [own; 3];
        axis[j] = (m[i][j] + m[j][i]) * by;
        axis[k] = (m[i][k] + m[k][i]) * by;
        ((m[k][j] - m[j][k]) * by, axis)
    };
    // A quaternion and its negative are the same rotation.
    let sign = if half_cosine.value() < 0.0 { -1.0 } else { 1.0 };
    twice_half_angle(axis.map(|x| x * sign), half_cosine * sign)
}

/// The rotation vector, rad, of the unit quaternion with the vector part `axis` (the axis times the sine of half the
/// angle) and the scalar part `half_cosine`, which is not negative.
fn twice_half_angle<D: Scalar>(axis: Vector<D>, half_cosine: D) -> Vector<D> {
    let square = dot(axis, axis);
    let quotient = match square.value() < SMALL_HALF_SINE {
        true => ARC_SINE.iter().rev().fold(D::from(0.0), |sum, c| sum * square + *c),
        // The arc sine of a sine near 1 loses digits; the cosine is at hand.
        false => square.sqrt().atan2(half_cosine) / square.sqrt(),
    };
    scale(axis, quotient * 2.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_dual::{Dual64, HyperDual64};
    use std::f64::consts::PI;

    const VECTORS: [[f64; 3]; 6] = [
        [0.0; 3],
        [1e-5, -2e-5, 3e-6],
        [0.1, -0.05, 0.2],
        [0.5, 0.6, -0.6],
        [0.9, -0.7, 0.3],
        [1.5, 1.2, -2.0],
    ];

    #[test]
    fn logarithm_inverts_the_exponential_map() {
        for r in VECTORS {
            let back = logarithm(&exponential(r));
            assert!((0..3).all(|c| (back[c] - r[c]).abs() < 2e-15), "{r:?} {back:?}");
        }
    }

    /// Also half a turn, where the sign of the axis is free, and rotations of the size of rounding errors.
    #[test]
    fn rotation_vector_inverts_the_exponential_map_up_to_half_a_turn() {
        let axis = [0.6, 0.0, -0.8];
        for angle in [0.0, 1e-17, 1e-9, 1e-3, 1.0, 3.0, PI - 1e-9, PI] {
            let found = rotation_vector(&exponential(scale(axis, angle)));
            let sign = if dot(found, axis) < 0.0 { -1.0 } else { 1.0 };
            assert!(sign > 0.0 || angle >= PI - 1e-9, "{angle}");
            let off = (0..3).map(|c| (sign * found[c] - axis[c] * angle).abs()).fold(0.0, f64::max);
            assert!(off < 1e-14 * angle.max(1.0), "{angle}: {off:e}");
        }
    }

    /// Oracle: central differences by small rotations about each axis, from zero to half a turn.
    #[test]
    fn derivatives_of_rotation_vector_are_those_of_differences() {
        const STEP: f64 = 1e-5;
        for (axis, angle) in [0.0, 1e-9, 1e-3, 0.3, 2.0, 2.5, 3.1, PI - 1e-3]
            .into_iter()
            .flat_map(|angle| [[0.6, 0.0, -0.8], [0.0, 1.0, 0.0]].map(|axis| (axis, angle)))
        {
            let m = exponential(scale(axis, angle));
            for k in 0..3 {
                let small = |h: f64| [0, 1, 2].map(|c| if c == k { h } else { 0.0 });
                let at = |h: f64| rotation_vector(&product(&m, &exponential(small(h))));
                let differences = scale(sub(at(STEP), at(-STEP)), 0.5 / STEP);
                let step = small(1.0).map(|h| Dual64::new(0.0, h));
                let dual = m.map(|row| row.map(Dual64::from));
                let found = rotation_vector(&product(&dual, &exponential(step))).map(|x| x.eps);
                let off = (0..3).map(|c| (found[c] - differences[c]).abs()).fold(0.0, f64::max);
                assert!(off < 1e-8, "{axis:?} {angle}: {found:?} {differences:?}");
            }
        }
        let half_turn = exponential([0.0, 0.0, PI]).map(|row| row.map(Dual64::from));
        let step = [0.1, 0.2, 0.3].map(|h| Dual64::new(0.0, h));
        let found = rotation_vector(&product(&half_turn, &exponential(step)));
        assert!(found.iter().all(|x| x.re.is_finite() && x.eps.is_finite()), "{found:?}");
    }

    /// Oracle: dual numbers of the exponential map.
    #[test]
    fn tangent_map_is_the_derivative_of_the_exponential_map() {
        for r in VECTORS {
            let (plain, map) = (exponential(r), tangent_map(r));
            for k in 0..3 {
                let dual = [0, 1, 2].map(|c| Dual64::new(r[c], f64::from(c == k)));
                let rate = exponential(dual).map(|row| row.map(|x| x.eps));
                let found = product(&transpose(&plain), &rate);
                let expected = cross_matrix(column(&map, k));
                for i in 0..3 {
                    for j in 0..3 {
                        assert!((found[i][j] - expected[i][j]).abs() < 1e-14, "{r:?}");
                    }
                }
            }
        }
    }

    /// Oracle: hyper-dual numbers of the logarithm.
    #[test]
    fn slope_of_the_tangent_map_is_a_second_derivative() {
        let u = [0.3, -1.1, 0.7];
        for r in VECTORS {
            let slope = tangent_map_slope(r, u);
            let back = transpose(&exponential(r)).map(|row| row.map(HyperDual64::from_re));
            for i in 0..3 {
                for j in 0..3 {
                    let moved = [0, 1, 2]
                        .map(|c| HyperDual64::new(r[c], f64::from(c == i), f64::from(c == j), 0.0));
                    let change = logarithm(&product(&back, &exponential(moved)));
                    let second: f64 = (0..3).map(|c| u[c] * change[c].eps1eps2).sum();
                    assert!((second - slope[i][j]).abs() < 1e-12, "{r:?} {second} {slope:?}");
                }
            }
        }
    }

    #[test]
    fn inverse_and_orthonormal_columns() {
        let r = [0.4, -0.8, 0.3];
        let one = product(&tangent_map(r), &inverse(&tangent_map(r)));
        let turned = exponential(r);
        let same = orthonormal(&turned);
        for i in 0..3 {
            for j in 0..3 {
                assert!((one[i][j] - f64::from(i == j)).abs() < 1e-15);
                assert!((same[i][j] - turned[i][j]).abs() < 1e-15);
            }
        }
    }
}
