//! A number that remembers how large the terms of its derivatives were.

use crate::numerics::scalar::Scalar;
use crate::numerics::vector::{components, each};
use std::cmp::Ordering;
use std::iter::Sum;
use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

/// A value and, for its first and second derivatives by `N` unknowns, the sums of the absolute
/// values of all terms the chain rule adds up. A derivative that comes out small because large
/// terms cancel has few correct digits; this is the size its rounding errors are measured by.
///
/// It is not a dual number of num-dual, yet any energy runs on it: this is what the [`Scalar`]
/// trait is for.
#[derive(Clone, Copy, Debug)]
pub struct Terms<const N: usize> {
    /// The value itself.
    pub value: f64,
    /// Sums of absolute terms of the gradient.
    pub first: [f64; N],
    /// Sums of absolute terms of the Hessian.
    pub second: [[f64; N]; N],
}

impl<const N: usize> Terms<N> {
    /// The unknowns at `q`.
    pub fn unknowns(q: &[f64; N]) -> [Self; N] {
        std::array::from_fn(|i| {
            let mut x = Self::from(q[i]);
            x.first[i] = 1.0;
            x
        })
    }

    /// f(x) with f, |f'| and |f''|.
    fn chain(&self, value: f64, slope: f64, curvature: f64) -> Self {
        let (slope, curvature) = (slope.abs(), curvature.abs());
        Self {
            value,
            first: each(&self.first, |a| slope * a),
            second: table(|i, j| {
                slope * self.second[i][j] + curvature * self.first[i] * self.first[j]
            }),
        }
    }

    /// f(x, y) with the absolute values of its first and second partial derivatives.
    fn chain2(&self, other: &Self, value: f64, slopes: [f64; 2], curvatures: [f64; 3]) -> Self {
        let [p, q] = each(&slopes, f64::abs);
        let [pp, pq, qq] = each(&curvatures, f64::abs);
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
        }
    }
}

/// `N` rows of what `of` tells by row and column.
fn table<const N: usize>(of: impl Fn(usize, usize) -> f64) -> [[f64; N]; N] {
    let mut rows = [[0.0; N]; N];
    for (i, row) in rows.iter_mut().enumerate() {
        *row = components(|j| of(i, j));
    }
    rows
}

impl<const N: usize> From<f64> for Terms<N> {
    fn from(value: f64) -> Self {
        Self { value, first: [0.0; N], second: [[0.0; N]; N] }
    }
}

impl<const N: usize> Add for Terms<N> {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        self.chain2(&other, self.value + other.value, [1.0, 1.0], [0.0; 3])
    }
}
impl<const N: usize> Sub for Terms<N> {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self.chain2(&other, self.value - other.value, [1.0, 1.0], [0.0; 3])
    }
}
impl<const N: usize> Mul for Terms<N> {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let (a, b) = (self.value, other.value);
        self.chain2(&other, a * b, [b, a], [0.0, 1.0, 0.0])
    }
}
impl<const N: usize> Div for Terms<N> {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let (a, b) = (self.value, other.value);
        let r = 1.0 / b;
        self.chain2(&other, a / b, [r, a * r * r], [0.0, r * r, 2.0 * a * r * r * r])
    }
}
impl<const N: usize> Neg for Terms<N> {
    type Output = Self;
    fn neg(self) -> Self {
        Self { value: -self.value, ..self }
    }
}
impl<const N: usize> Add<f64> for Terms<N> {
    type Output = Self;
    fn add(self, other: f64) -> Self {
        Self { value: self.value + other, ..self }
    }
}
impl<const N: usize> Sub<f64> for Terms<N> {
    type Output = Self;
    fn sub(self, other: f64) -> Self {
        Self { value: self.value - other, ..self }
    }
}
impl<const N: usize> Mul<f64> for Terms<N> {
    type Output = Self;
    fn mul(self, other: f64) -> Self {
        self.chain(self.value * other, other, 0.0)
    }
}
impl<const N: usize> Div<f64> for Terms<N> {
    type Output = Self;
    fn div(self, other: f64) -> Self {
        self.chain(self.value / other, 1.0 / other, 0.0)
    }
}

/// `x += y` is `x = x + y`, for another of these numbers and for a plain one.
macro_rules! assigning {
    ($($assign:ident $name:ident $operator:tt)*) => {$(
        impl<const N: usize> $assign for Terms<N> {
            fn $name(&mut self, other: Self) {
                *self = *self $operator other;
            }
        }
        impl<const N: usize> $assign<f64> for Terms<N> {
            fn $name(&mut self, other: f64) {
                *self = *self $operator other;
            }
        }
    )*};
}
assigning!(AddAssign add_assign + SubAssign sub_assign - MulAssign mul_assign * DivAssign div_assign /);

impl<const N: usize> Sum for Terms<N> {
    fn sum<I: Iterator<Item = Self>>(numbers: I) -> Self {
        numbers.fold(Self::from(0.0), |sum, x| sum + x)
    }
}

impl<const N: usize> PartialEq for Terms<N> {
    fn eq(&self, other: &Self) -> bool {
        self.value == other.value
    }
}
impl<const N: usize> PartialOrd for Terms<N> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        self.value.partial_cmp(&other.value)
    }
}
impl<const N: usize> PartialEq<f64> for Terms<N> {
    fn eq(&self, other: &f64) -> bool {
        self.value == *other
    }
}
impl<const N: usize> PartialOrd<f64> for Terms<N> {
    fn partial_cmp(&self, other: &f64) -> Option<Ordering> {
        self.value.partial_cmp(other)
    }
}

impl<const N: usize> Scalar for Terms<N> {
    const ORDER: usize = 2;

    fn value(&self) -> f64 {
        self.value
    }
    fn recip(self) -> Self {
        let r = 1.0 / self.value;
        self.chain(r, r * r, 2.0 * r * r * r)
    }
    fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        self.chain(root, 0.5 / root, 0.25 / (root * self.value))
    }
    fn powi(self, n: i32) -> Self {
        let (x, k) = (self.value, f64::from(n));
        let slope = if n == 0 { 0.0 } else { k * x.powi(n - 1) };
        let curvature = if n == 0 || n == 1 { 0.0 } else { k * (k - 1.0) * x.powi(n - 2) };
        self.chain(x.powi(n), slope, curvature)
    }
    fn powf(self, n: f64) -> Self {
        let x = self.value;
        self.chain(x.powf(n), n * x.powf(n - 1.0), n * (n - 1.0) * x.powf(n - 2.0))
    }
    fn exp(self) -> Self {
        let e = self.value.exp();
        self.chain(e, e, e)
    }
    fn ln(self) -> Self {
        let r = 1.0 / self.value;
        self.chain(self.value.ln(), r, r * r)
    }
    fn sin(self) -> Self {
        let (sin, cos) = self.value.sin_cos();
        self.chain(sin, cos, sin)
    }
    fn cos(self) -> Self {
        let (sin, cos) = self.value.sin_cos();
        self.chain(cos, sin, cos)
    }
    fn tan(self) -> Self {
        let tan = self.value.tan();
        let slope = 1.0 + tan * tan;
        self.chain(tan, slope, 2.0 * tan * slope)
    }
    fn asin(self) -> Self {
        let slope = 1.0 / (1.0 - self.value * self.value).sqrt();
        self.chain(self.value.asin(), slope, self.value * slope.powi(3))
    }
    fn acos(self) -> Self {
        let slope = 1.0 / (1.0 - self.value * self.value).sqrt();
        self.chain(self.value.acos(), slope, self.value * slope.powi(3))
    }
    fn atan(self) -> Self {
        let slope = 1.0 / (1.0 + self.value * self.value);
        self.chain(self.value.atan(), slope, 2.0 * self.value * slope * slope)
    }
    fn sinh(self) -> Self {
        let (sinh, cosh) = (self.value.sinh(), self.value.cosh());
        self.chain(sinh, cosh, sinh)
    }
    fn cosh(self) -> Self {
        let (sinh, cosh) = (self.value.sinh(), self.value.cosh());
        self.chain(cosh, sinh, cosh)
    }
    fn tanh(self) -> Self {
        let tanh = self.value.tanh();
        let slope = 1.0 / self.value.cosh().powi(2);
        self.chain(tanh, slope, 2.0 * tanh * slope)
    }
    fn atan2(self, x: Self) -> Self {
        let (y, x_) = (self.value, x.value);
        let by_rr = 1.0 / (x_ * x_ + y * y);
        let mixed = 2.0 * x_ * y * by_rr * by_rr;
        let curvatures = [mixed, (y * y - x_ * x_) * by_rr * by_rr, mixed];
        self.chain2(&x, y.atan2(x_), [x_ * by_rr, y * by_rr], curvatures)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_dual::Dual2SVec64;

    /// Uses every operation; all derivatives of every step are positive at positive arguments, so
    /// that the sums of absolute terms are the derivatives themselves.
    fn rising<D: Scalar>(x: D, y: D) -> D {
        (x * y + x.exp() * 0.2 + y.powi(3)).tan() + (x + 0.1) * y * y
    }

    #[test]
    fn without_cancellation_the_terms_are_the_derivatives() {
        let q = [0.02, 0.1];
        let [x, y] = Terms::unknowns(&q);
        let terms = rising(x * 0.1, y);
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
    fn cancelling_terms_stay_visible() {
        let [x] = Terms::unknowns(&[3.0]);
        let zero = x * x - x * x;
        assert_eq!((zero.value, zero.first[0], zero.second[0][0]), (0.0, 12.0, 4.0));
    }

    #[test]
    fn every_function_bounds_its_own_derivatives() {
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
        let [x, y] = Terms::unknowns(&q);
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
