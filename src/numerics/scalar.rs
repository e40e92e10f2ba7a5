//! The number type every energy is written over.
//!
//! An energy is one generic function. With `f64` it is a number; with a dual number of
//! [`num_dual`] it is a number and its exact derivatives; with [`Terms`](crate::check::Terms) it
//! tells how large the terms are that cancel in each derivative.

use num_dual::{Dual64, DualNum, DualSVec64, HyperDual64};
use std::fmt::Debug;
use std::iter::Sum;
use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

/// What an energy may do with its numbers: what one writes for an `f64`.
///
/// Every `Copy` dual number of [`num_dual`] over `f64`, and `f64` itself, is a `Scalar`. Another
/// number type joins by implementing this trait.
///
/// Comparisons look at the [`value`](Scalar::value), the real part, never at derivatives.
///
/// Constants stand on the right of an operator, `x * 2.0`, or become a `D` first,
/// `D::from(1.0) - x`: what `1.0 - x` is could only be said where `f64` or the dual number is
/// defined.
///
/// ```
/// use rodfit::Scalar;
/// fn spring<D: Scalar>(x: D) -> D { x * x / 2.0 }
/// fn contact<D: Scalar>(gap: D) -> D {
///     if gap > 0.0 { D::from(0.0) } else { gap.abs().powf(2.5) * 4e3 }
/// }
/// let slope = spring(num_dual::Dual64::new(3.0, 1.0)).eps;
/// assert_eq!((spring(3.0), slope), (4.5, 3.0));
/// assert_eq!((contact(0.1), contact(-1.0)), (0.0, 4e3));
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
    + Div<f64, Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
    + DivAssign
    + AddAssign<f64>
    + SubAssign<f64>
    + MulAssign<f64>
    + DivAssign<f64>
    + Sum
    + PartialOrd
    + PartialOrd<f64>
{
    /// How many orders of derivatives travel with the number.
    const ORDER: usize;
    /// Whether none do. What is behind it is not even compiled for other numbers.
    const PLAIN: bool = Self::ORDER == 0;
    /// The real part.
    fn value(&self) -> f64;
    /// 1/x.
    fn recip(self) -> Self;
    /// Square root; its derivatives exist for positive values only.
    fn sqrt(self) -> Self;
    /// x^n.
    fn powi(self, n: i32) -> Self;
    /// x^n for any n; of positive numbers.
    fn powf(self, n: f64) -> Self;
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
    /// Angle with this sine, rad, in [-pi/2, pi/2].
    fn asin(self) -> Self;
    /// Angle with this cosine, rad, in [0, pi].
    fn acos(self) -> Self;
    /// Angle with this tangent, rad, in (-pi/2, pi/2).
    fn atan(self) -> Self;
    /// Angle of the point (`x`, `self`) in rad, in (-pi, pi].
    fn atan2(self, x: Self) -> Self;
    /// Hyperbolic sine.
    fn sinh(self) -> Self;
    /// Hyperbolic cosine.
    fn cosh(self) -> Self;
    /// Hyperbolic tangent.
    fn tanh(self) -> Self;

    /// Sine and cosine of an angle in rad.
    #[inline]
    fn sin_cos(self) -> [Self; 2] {
        [self.sin(), self.cos()]
    }
    /// A constant beside this number.
    #[inline]
    fn like(&self, x: f64) -> Self {
        Self::from(x)
    }
    /// `then` where this number is less than `bound`, and `otherwise` elsewhere: a selection, so that several
    /// numbers can go side by side.
    #[inline]
    fn if_less(self, bound: Self, then: Self, otherwise: Self) -> Self {
        if self.value() < bound.value() { then } else { otherwise }
    }
    /// Whether this number is less than `bound`; of several side by side, whether all are.
    #[inline]
    fn all_less(&self, bound: Self) -> bool {
        self.value() < bound.value()
    }

    /// The whole number next to it, which has no derivatives.
    #[inline]
    fn nearest_whole(self) -> Self {
        Self::from(self.value().round())
    }

    /// The number without its sign; at zero with the derivatives of the number itself.
    #[inline]
    fn abs(self) -> Self {
        if self.value() < 0.0 { -self } else { self }
    }
    /// The smaller of two numbers, with its derivatives.
    #[inline]
    fn min(self, other: Self) -> Self {
        if other.value() < self.value() { other } else { self }
    }
    /// The larger of two numbers, with its derivatives.
    #[inline]
    fn max(self, other: Self) -> Self {
        if other.value() > self.value() { other } else { self }
    }
    /// Length of the hypotenuse over two legs; not both zero, where it has no derivatives.
    #[inline]
    fn hypot(self, other: Self) -> Self {
        (self * self + other * other).sqrt()
    }
}

/// Functions of one number that num-dual has under the same name.
macro_rules! of_num_dual {
    ($($name:ident)*) => {
        $(#[inline]
        fn $name(self) -> Self {
            DualNum::$name(&self)
        })*
    };
}

impl<T: DualNum<Primitive = f64> + Copy + Send + Sync> Scalar for T {
    const ORDER: usize = T::NDERIV;

    of_num_dual!(recip sqrt exp ln sin cos tan asin acos atan sinh cosh tanh);

    #[inline]
    fn value(&self) -> f64 {
        self.re()
    }
    #[inline]
    fn powi(self, n: i32) -> Self {
        DualNum::powi(&self, n)
    }
    #[inline]
    fn powf(self, n: f64) -> Self {
        DualNum::powf(&self, n)
    }
    #[inline]
    fn atan2(self, x: Self) -> Self {
        if T::NDERIV == 0 || self.re().abs() <= x.re().abs() {
            return DualNum::atan2(&self, x);
        }
        // num-dual differentiates atan(y/x), whose derivatives lose digits where x is small, and are NaN at x = 0.
        let angle = -(x / self).atan();
        angle - angle.re() + self.re().atan2(x.re())
    }
}

/// One number of type `D`, or several side by side: lanes.
pub trait SimdScalar<D>: Scalar {
    /// What it takes to make one.
    type Level: Copy;
    /// How many there are.
    const LANES: usize;

    /// Those that `of` tells for each lane.
    fn gather(level: Self::Level, of: impl FnMut(usize) -> D) -> Self;

    /// The number of one lane.
    fn lane(&self, lane: usize) -> D;

    /// The numbers of one lane.
    #[inline(always)]
    fn extract_lane<const N: usize>(all: &[Self; N], lane: usize) -> [D; N]
    where
        D: Scalar,
    {
        let mut of = [D::from(0.0); N];
        for i in 0..N {
            of[i] = all[i].lane(lane);
        }
        of
    }

    /// The numbers one lane before these, of which `earlier` ones go before all.
    fn before(self, earlier: Self) -> Self;

    /// The numbers one lane after these, of which `later` ones come after all.
    fn after(self, later: Self) -> Self;
}

impl<D: Scalar> SimdScalar<D> for D {
    type Level = ();
    const LANES: usize = 1;

    #[inline(always)]
    fn gather((): (), mut of: impl FnMut(usize) -> D) -> Self {
        of(0)
    }
    #[inline(always)]
    fn lane(&self, _: usize) -> D {
        *self
    }
    #[inline(always)]
    fn before(self, earlier: Self) -> Self {
        earlier
    }
    #[inline(always)]
    fn after(self, later: Self) -> Self {
        later
    }
}

/// What is done with numbers of type `D`, however many of them are side by side.
///
/// Whatever a sweep calls with wide numbers must be `#[inline(always)]`, so that it is compiled for the vector unit.
/// Closures, and what takes them, are not: they may only read lanes.
pub trait Sweep<D> {
    /// What comes of it.
    type Output;
    /// Does it.
    fn sweep<V: SimdScalar<D>>(self, level: V::Level) -> Self::Output;
}

/// A [`Scalar`] that rods run in, and that num-dual can differentiate once more by nesting it in its
/// own dual numbers. There are few: what is chosen at run time, such as an [energy of one's
/// own](crate::energy::own), must be made for each of them beforehand.
pub trait Nestable: Scalar + DualNum<Primitive = f64> {
    /// The instance for this scalar.
    #[doc(hidden)]
    fn instance<T: ForEachScalar + ?Sized>(all: &T) -> &T::Instance<Self>;

    /// Sweeps with as many numbers side by side as there is a unit for.
    #[doc(hidden)]
    fn run_sweep<S: Sweep<Self>>(sweep: S) -> S::Output;

    /// Whether it is zero, and so are all its derivatives.
    #[doc(hidden)]
    fn is_identically_zero(&self) -> bool;
}

/// Something that has an instance for each scalar that rods run in.
#[doc(hidden)]
pub trait ForEachScalar {
    type Instance<D: Scalar>: ?Sized;
    fn plain(&self) -> &Self::Instance<f64>;
    fn dual(&self) -> &Self::Instance<Dual64>;
    fn hyper_dual(&self) -> &Self::Instance<HyperDual64>;
    fn pair(&self) -> &Self::Instance<DualSVec64<2>>;
}

/// Whether all numbers are finite, by four sums side by side.
pub(crate) fn is_finite<D: Scalar>(x: &[D]) -> bool {
    let (chunks, rest) = x.as_chunks::<4>();
    let mut sums = [0.0; 4];
    for chunk in chunks {
        for k in 0..4 {
            sums[k] += chunk[k].value();
        }
    }
    sums.iter().copied().chain(rest.iter().map(D::value)).sum::<f64>().is_finite()
}

#[cfg(test)]
mod tests {
    use crate::numerics::scalar::Scalar;
    use num_dual::HyperDual64;

    /// The angle of (x, y) has the second derivatives 2xy/r^4 by x twice and (y^2 - x^2)/r^4 by x and y.
    #[test]
    fn second_derivatives_of_angles_are_exact_in_every_direction() {
        for (x, y) in [(0.0, 2.0), (1e-9, -2.0), (-1e-3, 0.5), (1.0, 1e-9), (-3.0, 0.0), (1.0, 1.0)]
        {
            let angle = |x: HyperDual64, y: HyperDual64| Scalar::atan2(y, x);
            let plain = HyperDual64::from_re;
            let twice = angle(HyperDual64::new(x, 1.0, 1.0, 0.0), plain(y));
            let mixed =
                angle(HyperDual64::new(x, 1.0, 0.0, 0.0), HyperDual64::new(y, 0.0, 1.0, 0.0));
            assert_eq!((twice.re, mixed.re), (y.atan2(x), y.atan2(x)));
            let r2: f64 = x * x + y * y;
            let close = |found: f64, exact: f64| {
                assert!((found - exact).abs() <= 1e-14 / r2, "{found} {exact} at {x}, {y}");
            };
            close(twice.eps1 * r2.sqrt(), -y / r2.sqrt());
            close(twice.eps1eps2, 2.0 * x * y / (r2 * r2));
            close(mixed.eps1eps2, (y * y - x * x) / (r2 * r2));
        }
    }
}
