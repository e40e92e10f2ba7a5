//! Numbers that bound the rounding errors of derivatives, for the check of hand-derived derivatives.
//!
//! A computed derivative is a sum of terms. If large terms cancel, its relative error is large although the formula is
//! correct. [`CancellationBound`] evaluates an energy with its value and, for every first and second derivative, the
//! sum of the absolute values of the terms of the chain rule; it has no derivatives with signs. The check accepts
//! differences between two derivatives up to a tolerance times that sum. Optionally the sums have a floor: the change
//! of each term by rounding errors of the values in it.

use crate::numerics::operators::derived_operators;
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::{components, map_components};
use num_dual::Dual3_64;
use std::cmp::Ordering;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// Rounding errors of a value that count as agreement, over the value's magnitude and over the tolerance of
/// derivatives: with a tolerance of 1e-12 about 70 machine epsilons. In 500 random scenes the largest error is then
/// 8e-15 of the sum, a hundredth of that tolerance.
const VALUE_ROUNDING: f64 = 1.0 / 64.0;

/// A value and, for its first and second derivatives by `N` unknowns, the sums of the absolute
/// values of all terms of the chain rule. Rounding errors of a derivative are proportional to its sum, even if
/// large terms cancel and the derivative is small.
///
/// With [`CancellationBound::rounded_unknowns`] every sum also has a floor: the change of each term by rounding errors
/// of the values in it. A stress `k (s - s_natural)` of an element at rest is 0 by one formula and `k` times a rounding
/// error of the strain by another; the sum of its terms alone is 0.
///
/// It implements [`Scalar`] without being a dual number of num-dual, so that every energy can be evaluated with it.
#[derive(Clone, Copy, Debug)]
pub struct CancellationBound<const N: usize> {
    /// The value itself.
    pub value: f64,
    /// Sums of absolute terms of the gradient.
    pub first: [f64; N],
    /// Sums of absolute terms of the Hessian.
    pub second: [[f64; N]; N],
    /// Sum of absolute terms of the value, the size of its rounding errors.
    magnitude: f64,
    /// Rounding error of the value over `magnitude`, in units of the tolerance; 0 for constants and without a floor.
    rounding: f64,
}

/// Partial derivatives of a function of two numbers `x`, `y`, by their orders. Each list starts with the derivative
/// by `x` alone and ends with that by `y` alone.
struct Partials {
    first: [f64; 2],
    second: [f64; 3],
    third: [f64; 4],
}

impl<const N: usize> CancellationBound<N> {
    /// The unknowns at the values `q`, each with the sum 1 for the derivative by itself. Sums of absolute terms have no
    /// floor for rounding errors of the values, as those of [`rounded_unknowns`](Self::rounded_unknowns) have.
    pub fn unknowns(q: &[f64; N]) -> [Self; N] {
        std::array::from_fn(|i| {
            let mut x = Self::from(q[i]);
            x.first[i] = 1.0;
            x
        })
    }

    /// The unknowns at the values `q`, each with the sum 1 for the derivative by itself, and with relative rounding
    /// errors of `VALUE_ROUNDING` (in units of the tolerance). Each sum then has a floor: the change of its terms by
    /// these errors.
    pub fn rounded_unknowns(q: &[f64; N]) -> [Self; N] {
        Self::unknowns(q).map(|x| Self { rounding: VALUE_ROUNDING, ..x })
    }

    /// The chain rule for `f(x)` with `x = self`: its value and the absolute terms of its derivatives, `|f'| |x_i|` and
    /// `|f'| |x_ij| + |f''| |x_i x_j|`. `f` is evaluated with dual numbers of third order. Each derivative of `f` is
    /// enlarged by the next one times the rounding error of `x`, so that the floor of the second derivative needs the
    /// third.
    fn chain(&self, f: impl Fn(Dual3_64) -> Dual3_64) -> Self {
        // Value and three derivatives of f by one dual number of third order.
        let exact = f(Dual3_64::new(self.value, 1.0, 0.0, 0.0));
        let [plain, curvature, third] = [exact.v1, exact.v2, exact.v3].map(f64::abs);
        // The argument is known to this error: the derivatives change by it times the next
        // derivative.
        let error = self.rounding * self.magnitude;
        let slope = plain + error * curvature;
        let curvature = curvature + error * third;
        let value = exact.re;
        Self {
            value,
            first: map_components(&self.first, |a| slope * a),
            // Chain rule of second order with absolute values: |f'| |x_ij| + |f''| |x_i| |x_j|.
            second: table(|i, j| {
                slope * self.second[i][j] + curvature * self.first[i] * self.first[j]
            }),
            magnitude: value.abs().max(plain * self.magnitude),
            rounding: self.rounding,
        }
    }

    /// The chain rule for `f(x, y)` with `x = self` and `y = other`, from the value and the partial derivatives of `f`,
    /// whose signs do not matter. Each partial derivative is enlarged by its change over the rounding errors of `x` and
    /// `y`.
    fn chain2(&self, other: &Self, value: f64, partials: Partials) -> Self {
        let [p, q] = partials.first.map(f64::abs);
        let [pp, pq, qq] = partials.second.map(f64::abs);
        let [ppp, ppq, pqq, qqq] = partials.third.map(f64::abs);
        let magnitude = value.abs().max(p * self.magnitude + q * other.magnitude);
        let rounding = self.rounding.max(other.rounding);
        let (x, y) = (self.rounding * self.magnitude, other.rounding * other.magnitude);
        // Partial derivatives with their change over the rounding errors of both arguments.
        let (p, q) = (p + pp * x + pq * y, q + pq * x + qq * y);
        let (pp, pq, qq) = (pp + ppp * x + ppq * y, pq + ppq * x + pqq * y, qq + pqq * x + qqq * y);
        let (a, b) = (&self.first, &other.first);
        Self {
            value,
            first: components(|i| p * a[i] + q * b[i]),
            second: table(|i, j| {
                p * self.second[i][j]
                    + q * other.second[i][j]
                    + pp * a[i] * a[j]
                    + qq * b[i] * b[j]
                    + pq * (a[i] * b[j] + b[i] * a[j])
            }),
            magnitude,
            rounding,
        }
    }
}

/// The `N` by `N` matrix, by its rows, with `entry(row, column)` at each place.
fn table<const N: usize>(entry: impl Fn(usize, usize) -> f64) -> [[f64; N]; N] {
    let mut rows = [[0.0; N]; N];
    for (i, row) in rows.iter_mut().enumerate() {
        *row = components(|j| entry(i, j));
    }
    rows
}

impl<const N: usize> From<f64> for CancellationBound<N> {
    /// The constant `value`, without derivatives and rounding errors.
    fn from(value: f64) -> Self {
        let magnitude = value.abs();
        Self { value, first: [0.0; N], second: [[0.0; N]; N], magnitude, rounding: 0.0 }
    }
}

/// Partial derivatives of a sum or a difference.
const LINEAR: Partials = Partials { first: [1.0; 2], second: [0.0; 3], third: [0.0; 4] };

impl<const N: usize> Add for CancellationBound<N> {
    type Output = Self;
    /// The sum of the values. Absolute terms of derivatives, and sizes of rounding errors, are the sums of those of
    /// both numbers.
    fn add(self, other: Self) -> Self {
        self.chain2(&other, self.value + other.value, LINEAR)
    }
}
impl<const N: usize> Sub for CancellationBound<N> {
    type Output = Self;
    /// The difference of the values. Absolute terms of derivatives are the sums (not differences) of those of both
    /// numbers.
    fn sub(self, other: Self) -> Self {
        self.chain2(&other, self.value - other.value, LINEAR)
    }
}
impl<const N: usize> Mul for CancellationBound<N> {
    type Output = Self;
    /// The product `a b`: its value, and for each first and second derivative the sum of the absolute terms of the
    /// product rule, for example `|b| a_i + |a| b_i`. `a_i` and `b_i` are such sums too: there are no derivatives with
    /// signs.
    fn mul(self, other: Self) -> Self {
        let (a, b) = (self.value, other.value);
        let partials = Partials { first: [b, a], second: [0.0, 1.0, 0.0], third: [0.0; 4] };
        self.chain2(&other, a * b, partials)
    }
}
impl<const N: usize> Div for CancellationBound<N> {
    type Output = Self;
    /// The quotient `a/b`: its value, and for each first and second derivative the sum of the absolute terms of the
    /// quotient rule, for example `|1/b| a_i + |a/b^2| b_i`. `a_i` and `b_i` are such sums too: there are no
    /// derivatives with signs.
    fn div(self, other: Self) -> Self {
        let (a, b) = (self.value, other.value);
        // Derivatives of a/b by a and b: 1/b, -a/b^2, and so on; signs do not matter for bounds.
        let r = 1.0 / b;
        let partials = Partials {
            first: [r, a * r * r],
            second: [0.0, r * r, 2.0 * a * r * r * r],
            third: [0.0, 0.0, 2.0 * r * r * r, 6.0 * a * r * r * r * r],
        };
        self.chain2(&other, a / b, partials)
    }
}
impl<const N: usize> Neg for CancellationBound<N> {
    type Output = Self;
    /// The number with the opposite value and the same absolute terms.
    fn neg(self) -> Self {
        // Terms are absolute values.
        Self { value: -self.value, ..self }
    }
}
impl<const N: usize> Add<f64> for CancellationBound<N> {
    type Output = Self;
    /// The sum with a constant: absolute terms of derivatives stay, and the rounding error of the value includes the
    /// constant.
    fn add(self, other: f64) -> Self {
        Self { value: self.value + other, magnitude: self.magnitude + other.abs(), ..self }
    }
}
impl<const N: usize> Sub<f64> for CancellationBound<N> {
    type Output = Self;
    /// The difference from a constant: absolute terms of derivatives stay, and the rounding error of the value includes
    /// the constant.
    fn sub(self, other: f64) -> Self {
        self + -other
    }
}
impl<const N: usize> Mul<f64> for CancellationBound<N> {
    type Output = Self;
    /// The product with a constant: all terms are multiplied by its absolute value.
    fn mul(self, other: f64) -> Self {
        self.chain(|x| x * other)
    }
}
impl<const N: usize> Div<f64> for CancellationBound<N> {
    type Output = Self;
    /// The quotient by a constant: all terms are divided by its absolute value.
    fn div(self, other: f64) -> Self {
        self.chain(|x| x / other)
    }
}

derived_operators!([const N: usize] CancellationBound<N>);

impl<const N: usize> PartialOrd for CancellationBound<N> {
    /// The order of the values; absolute terms are not compared. None if a value is NaN.
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        self.value.partial_cmp(&other.value)
    }
}
/// Functions of one number, with the derivatives of num-dual.
macro_rules! functions {
    ($($name:ident)*) => {
        /// The function of this name of the value, with the absolute terms of the chain rule.
        $(fn $name(self) -> Self {
            self.chain(|x| x.$name())
        })*
    };
}

impl<const N: usize> Scalar for CancellationBound<N> {
    const ORDER: usize = 2;

    /// The value itself.
    fn value(&self) -> f64 {
        self.value
    }
    functions!(recip sqrt exp ln sin cos tan asin acos atan sinh cosh tanh);

    /// The whole power `n` of the value, with the absolute terms of the chain rule for both orders of derivatives.
    fn powi(self, n: i32) -> Self {
        self.chain(|x| Scalar::powi(x, n))
    }
    /// The power `n` of a positive value, with the absolute terms of the chain rule for both orders of derivatives.
    fn powf(self, n: f64) -> Self {
        self.chain(|x| Scalar::powf(x, n))
    }
    /// Angle of the point (`x`, `self`) in rad, in (-pi, pi], with the absolute terms of the chain rule for both orders
    /// of derivatives. Third derivatives, for the floor, are bounded by `2/r^3`.
    fn atan2(self, x: Self) -> Self {
        let (y, x_) = (self.value, x.value);
        let by_rr = 1.0 / (x_ * x_ + y * y);
        let mixed = 2.0 * x_ * y * by_rr * by_rr;
        let partials = Partials {
            first: [x_ * by_rr, y * by_rr],
            second: [mixed, (y * y - x_ * x_) * by_rr * by_rr, mixed],
            // Bounds: third derivatives of the angle in any directions are 2/r^3 at most.
            third: [2.0 * by_rr * by_rr.sqrt(); 4],
        };
        self.chain2(&x, y.atan2(x_), partials)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_dual::{Dual2SVec64, DualNum};

    /// Uses every operation; all derivatives of every step are positive at positive arguments, so
    /// that the sums of absolute terms are the derivatives themselves.
    fn rising<D: Scalar>(x: D, y: D) -> D {
        (x * y + x.exp() * 0.2 + y.powi(3)).tan() + (x + 0.1) * y * y
    }

    #[test]
    fn terms_without_cancellation_equal_the_derivatives() {
        let q = [0.02, 0.1];
        let [x, y] = CancellationBound::unknowns(&q);
        let terms = rising(x * 0.1, y);
        // All terms are positive, so that the sums of absolute terms are the derivatives by
        // num-dual.
        let dual = |i: usize| Dual2SVec64::<2>::from_re(q[i]).derivative(i);
        let exact = rising(dual(0) * 0.1, dual(1));
        let first = exact.v1.unwrap_generic(nalgebra::U1, nalgebra::U2);
        let second = exact.v2.unwrap_generic(nalgebra::U2, nalgebra::U2);
        for i in 0..2 {
            approx::assert_relative_eq!(terms.first[i], first[i], max_relative = 1e-13);
            for j in 0..2 {
                approx::assert_relative_eq!(
                    terms.second[i][j],
                    second[(i, j)],
                    max_relative = 1e-13
                );
            }
        }
    }

    #[test]
    fn terms_of_a_vanishing_difference_remain() {
        let [x] = CancellationBound::unknowns(&[3.0]);
        let zero = x * x - x * x;
        // x^2 has the derivatives 2x = 6 and 2; both terms count.
        assert_eq!((zero.value, zero.first[0], zero.second[0][0]), (0.0, 12.0, 4.0));
    }

    /// A stress at rest: its terms are 0, and by another route it may be the stiffness times a rounding
    /// error of the strain.
    #[test]
    fn terms_of_a_vanishing_stress_have_the_floor_of_the_strain() {
        let energy = |[x]: [CancellationBound<1>; 1]| {
            let strain = x * 3.0 - 6.0;
            strain * strain * 0.5
        };
        let plain = energy(CancellationBound::unknowns(&[2.0]));
        assert_eq!((plain.first[0], plain.second[0][0]), (0.0, 9.0));
        // The strain is 6 - 6: a magnitude of 12, times its slope of 3.
        let rounded = energy(CancellationBound::rounded_unknowns(&[2.0]));
        approx::assert_relative_eq!(rounded.first[0], VALUE_ROUNDING * 12.0 * 3.0);
        assert_eq!(rounded.second[0][0], 9.0);
    }

    /// The floor of a derivative is the next derivative times the rounding of the argument.
    #[test]
    fn floor_of_second_derivative_is_the_third_derivative() {
        type Route<D> = fn(D) -> D;
        let functions: [(&str, Route<Dual3_64>, Route<CancellationBound<1>>); 14] = [
            ("recip", |x| x.recip(), Scalar::recip),
            ("sqrt", |x| x.sqrt(), Scalar::sqrt),
            ("powi", |x| DualNum::powi(&x, 5), |x| Scalar::powi(x, 5)),
            ("powf", |x| DualNum::powf(&x, 2.5), |x| Scalar::powf(x, 2.5)),
            ("exp", |x| x.exp(), Scalar::exp),
            ("ln", |x| x.ln(), Scalar::ln),
            ("sin", |x| x.sin(), Scalar::sin),
            ("cos", |x| x.cos(), Scalar::cos),
            ("tan", |x| x.tan(), Scalar::tan),
            ("asin", |x| x.asin(), Scalar::asin),
            ("acos", |x| x.acos(), Scalar::acos),
            ("atan", |x| x.atan(), Scalar::atan),
            ("sinh", |x| x.sinh(), Scalar::sinh),
            ("tanh", |x| x.tanh(), Scalar::tanh),
        ];
        let value = 0.7;
        for (name, exact, terms) in functions {
            let exact = exact(Dual3_64::new(value, 1.0, 0.0, 0.0));
            let of = |x: [CancellationBound<1>; 1]| terms(x[0]).second[0][0];
            let floor = of(CancellationBound::rounded_unknowns(&[value]))
                - of(CancellationBound::unknowns(&[value]));
            let third = floor / (VALUE_ROUNDING * value);
            assert!((third - exact.v3.abs()).abs() < 1e-11 * (1.0 + exact.v3.abs()), "{name}");
        }
    }

    /// At one function each, no terms cancel: the sums are the absolute derivatives by num-dual.
    #[test]
    fn terms_of_every_function_equal_its_absolute_derivatives() {
        /// Every function and operator at `x` and `y`.
        fn all<D: Scalar>(x: D, y: D) -> Vec<D> {
            vec![
                x + y,
                x - y,
                x * y,
                x / y,
                -x,
                x + 2.0,
                x - 2.0,
                x * 2.0,
                x / 2.0,
                x.recip(),
                x.sqrt(),
                x.powi(0),
                x.powi(1),
                x.powi(-2),
                x.powf(2.5),
                x.powf(-0.5),
                x.exp(),
                x.ln(),
                x.sin(),
                x.cos(),
                x.tan(),
                x.asin(),
                x.acos(),
                x.atan(),
                x.sinh(),
                x.cosh(),
                x.tanh(),
                (-x).abs(),
                x.min(y),
                x.max(y),
                x.atan2(y),
                y.atan2(x),
            ]
        }
        let q = [0.7, 1.3];
        let [x, y] = CancellationBound::unknowns(&q);
        let dual = |i: usize| Dual2SVec64::<2>::from_re(q[i]).derivative(i);
        for (terms, exact) in all(x, y).iter().zip(all(dual(0), dual(1))) {
            let first = exact.v1.unwrap_generic(nalgebra::U1, nalgebra::U2);
            let second = exact.v2.unwrap_generic(nalgebra::U2, nalgebra::U2);
            for i in 0..2 {
                approx::assert_relative_eq!(terms.first[i], first[i].abs(), max_relative = 1e-14);
                for j in 0..2 {
                    let exact = second[(i, j)].abs();
                    approx::assert_relative_eq!(terms.second[i][j], exact, max_relative = 1e-14);
                }
            }
        }
    }
}
