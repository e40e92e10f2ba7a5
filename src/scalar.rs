//! The number type every energy is written over.
//!
//! An energy is one generic function. With `f64` it is a number; with a dual number of
//! [`num_dual`] it is a number and its exact derivatives; with [`Terms`](crate::check::Terms) it
//! tells how large the terms are that cancel in each derivative.

use num_dual::DualNum;
use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// What an energy may do with its numbers.
///
/// Every `Copy` dual number of [`num_dual`] over `f64`, and `f64` itself, is a `Scalar`. Another
/// number type joins by implementing this trait.
///
/// Branches are taken on [`value`](Scalar::value), the real part, never on derivatives.
///
/// ```
/// use rodfit::Scalar;
/// fn spring<D: Scalar>(x: D) -> D { x * x * 0.5 }
/// let slope = spring(num_dual::Dual64::new(3.0, 1.0)).eps;
/// assert_eq!((spring(3.0), slope), (4.5, 3.0));
/// ```
pub trait Scalar:
    Copy
    + Debug
    + Send
    + Sync
    + 'static
    + From<f64>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + AddAssign
    + SubAssign
{
    /// How many orders of derivatives travel with the number.
    const ORDER: usize;
    /// The real part.
    fn value(&self) -> f64;
    /// 1/x.
    fn recip(self) -> Self;
    /// Square root; its derivatives exist for positive values only.
    fn sqrt(self) -> Self;
    /// x^n.
    fn powi(self, n: i32) -> Self;
    /// e^x.
    fn exp(self) -> Self;
    /// Natural logarithm.
    fn ln(self) -> Self;
    /// Sine of an angle in rad.
    fn sin(self) -> Self;
    /// Cosine of an angle in rad.
    fn cos(self) -> Self;
    /// Tangent of an angle in rad.
    fn tan(self) -> Self;
    /// Angle of the point (`x`, `self`) in rad, in (-pi, pi].
    fn atan2(self, x: Self) -> Self;
}

impl<T: DualNum<Primitive = f64> + Copy + Send + Sync> Scalar for T {
    const ORDER: usize = T::NDERIV;

    #[inline]
    fn value(&self) -> f64 {
        self.re()
    }
    #[inline]
    fn recip(self) -> Self {
        DualNum::recip(&self)
    }
    #[inline]
    fn sqrt(self) -> Self {
        DualNum::sqrt(&self)
    }
    #[inline]
    fn powi(self, n: i32) -> Self {
        DualNum::powi(&self, n)
    }
    #[inline]
    fn exp(self) -> Self {
        DualNum::exp(&self)
    }
    #[inline]
    fn ln(self) -> Self {
        DualNum::ln(&self)
    }
    #[inline]
    fn sin(self) -> Self {
        DualNum::sin(&self)
    }
    #[inline]
    fn cos(self) -> Self {
        DualNum::cos(&self)
    }
    #[inline]
    fn tan(self) -> Self {
        DualNum::tan(&self)
    }
    #[inline]
    fn atan2(self, x: Self) -> Self {
        DualNum::atan2(&self, x)
    }
}

/// A [`Scalar`] that num-dual can differentiate once more, by nesting it in its own dual numbers.
pub trait Nestable: Scalar + DualNum<Primitive = f64> {}
impl<T: Scalar + DualNum<Primitive = f64>> Nestable for T {}
