//! The trait [`Scalar`]: the number type over which every energy and every physical formula is written.
//!
//! An energy is one generic function. With `f64` it returns its value, with a dual number of [`num_dual`] its value and
//! exact derivatives, and with [`CancellationBound`](crate::check::CancellationBound) the size of the terms that may
//! cancel in each derivative. [`SimdScalar`] is a vector of numbers for loops along a rod ([`Sweep`]). [`RodScalar`]
//! are the five scalars with which rods are computed: `f64`, dual numbers with one, two or eight first derivatives, and
//! those with two first derivatives and the mixed second one.

use num_dual::{Dual64, DualNum, DualSVec64, HyperDual64};
use std::fmt::Debug;
use std::iter::Sum;
use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

/// Arithmetic and elementary functions, as those of `f64`, of a real number that may carry derivatives.
///
/// Every `Copy` dual number of [`num_dual`] over `f64`, and `f64` itself, is a `Scalar`. Other number types can
/// implement this trait.
///
/// Comparisons use the [`value`](Scalar::value), the real part, never derivatives.
///
/// Constants stand on the right of an operator, `x * 2.0`, or are converted first, `D::from(1.0) - x`: Rust's orphan
/// rule does not allow this crate to define `f64 - D`.
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
    /// Highest order of the derivatives that the number carries.
    const ORDER: usize;
    /// Whether the number carries no derivatives. Branches on this constant are removed at compile time.
    const PLAIN: bool = Self::ORDER == 0;
    /// The real part.
    fn value(&self) -> f64;
    /// 1/x.
    fn recip(self) -> Self;
    /// Square root; its derivatives exist for positive values only.
    fn sqrt(self) -> Self;
    /// The number to the whole power `n`.
    fn powi(self, n: i32) -> Self;
    /// The number to any power `n`; for positive numbers.
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

    /// `[sin x, cos x]` of an angle in rad.
    #[inline]
    fn sin_cos(self) -> [Self; 2] {
        [self.sin(), self.cos()]
    }
    /// The constant `x` in the type, and on the SIMD level, of this number.
    #[inline]
    fn like(&self, x: f64) -> Self {
        Self::from(x)
    }
    /// `then` where this number is less than `bound`, and `otherwise` elsewhere: a selection without a branch, made in
    /// every SIMD lane.
    #[inline]
    fn if_less(self, bound: Self, then: Self, otherwise: Self) -> Self {
        if self.value() < bound.value() { then } else { otherwise }
    }
    /// Whether this number, or every SIMD lane of it, is less than `bound`.
    #[inline]
    fn all_less(&self, bound: Self) -> bool {
        self.value() < bound.value()
    }

    /// The nearest integer, without derivatives; halves away from zero (SIMD numbers: to the even one).
    #[inline]
    fn nearest_whole(self) -> Self {
        Self::from(self.value().round())
    }

    /// Absolute value, with the derivatives of the number or of its negative; at zero those of the number itself.
    #[inline]
    fn abs(self) -> Self {
        if self.value() < 0.0 { -self } else { self }
    }
    /// The smaller of two numbers, with its derivatives; this number if the values are equal or one is NaN.
    #[inline]
    fn min(self, other: Self) -> Self {
        if other.value() < self.value() { other } else { self }
    }
    /// The larger of two numbers, with its derivatives; this number if the values are equal or one is NaN.
    #[inline]
    fn max(self, other: Self) -> Self {
        if other.value() > self.value() { other } else { self }
    }
    /// Length of the hypotenuse over two legs, `sqrt(x^2 + y^2)`. If both are zero the derivatives are not finite.
    #[inline]
    fn hypot(self, other: Self) -> Self {
        (self * self + other * other).sqrt()
    }
}

/// Functions of one number that num-dual has under the same name.
macro_rules! num_dual_functions {
    ($($name:ident)*) => {
        $(#[inline]
        /// The function of this name of num-dual, with its derivatives.
        fn $name(self) -> Self {
            DualNum::$name(&self)
        })*
    };
}

impl<T: DualNum<Primitive = f64> + Copy + Send + Sync> Scalar for T {
    const ORDER: usize = T::NDERIV;

    num_dual_functions!(recip sqrt exp ln sin cos tan asin acos atan sinh cosh tanh);

    /// The real part.
    #[inline]
    fn value(&self) -> f64 {
        self.re()
    }
    /// The number to the whole power `n`.
    #[inline]
    fn powi(self, n: i32) -> Self {
        DualNum::powi(&self, n)
    }
    /// The number to any power `n`; for positive numbers.
    #[inline]
    fn powf(self, n: f64) -> Self {
        DualNum::powf(&self, n)
    }
    /// Angle of the point (`x`, `self`) in rad, in (-pi, pi], with accurate derivatives also near x = 0: there they are
    /// those of `-atan(x/y)`.
    #[inline]
    fn atan2(self, x: Self) -> Self {
        // |y| <= |x|: the quotient y/x is small, and its derivatives are accurate.
        if T::NDERIV == 0 || self.re().abs() <= x.re().abs() {
            return DualNum::atan2(&self, x);
        }
        // num-dual differentiates atan(y/x), whose derivatives lose digits where x is small, and are NaN at x = 0.
        let angle = -(x / self).atan();
        angle - angle.re() + self.re().atan2(x.re())
    }
}

/// One number of type `D`, or a SIMD vector of them. An element of the vector is a lane; operations act on all lanes.
pub trait SimdScalar<D>: Scalar {
    /// The SIMD level, which constructing a vector requires.
    type Level: Copy;
    /// Number of lanes.
    const LANES: usize;

    /// The vector with `value(lane)` in each lane.
    fn gather(level: Self::Level, value: impl FnMut(usize) -> D) -> Self;

    /// The number of the lane `lane`.
    fn lane(&self, lane: usize) -> D;

    /// The array of the `N` numbers that lane `lane` has in each of the vectors `all`, in their order.
    #[inline(always)]
    fn extract_lane<const N: usize>(all: &[Self; N], lane: usize) -> [D; N]
    where
        D: Scalar,
    {
        let mut numbers = [D::from(0.0); N];
        for i in 0..N {
            numbers[i] = all[i].lane(lane);
        }
        numbers
    }

    /// The previous number of each lane: shifts all lanes up by one, and the last lane of `earlier` moves into the
    /// first.
    fn before(self, earlier: Self) -> Self;

    /// The next number of each lane: shifts all lanes down by one, and the first lane of `later` moves into the last.
    fn after(self, later: Self) -> Self;
}

impl<D: Scalar> SimdScalar<D> for D {
    type Level = ();
    const LANES: usize = 1;

    /// The number `value(0)`: there is one lane.
    #[inline(always)]
    fn gather((): (), mut value: impl FnMut(usize) -> D) -> Self {
        value(0)
    }
    /// The number itself.
    #[inline(always)]
    fn lane(&self, _: usize) -> D {
        *self
    }
    /// The previous number of the only lane: `earlier`.
    #[inline(always)]
    fn before(self, earlier: Self) -> Self {
        earlier
    }
    /// The next number of the only lane: `later`.
    #[inline(always)]
    fn after(self, later: Self) -> Self {
        later
    }
}

/// A computation along a rod with numbers of type `D`, in blocks of as many elements as the processor has SIMD lanes.
///
/// Functions that a sweep calls with SIMD numbers must be `#[inline(always)]`, so that they are compiled for the vector
/// unit. Closures, and functions that take them, are not inlined reliably: they may only read lanes.
pub trait Sweep<D> {
    /// Result of the computation.
    type Output;
    /// Runs the computation with numbers of type `V`, on the SIMD `level` that they need.
    fn sweep<V: SimdScalar<D>>(self, level: V::Level) -> Self::Output;
}

/// A [`Scalar`] that rods are computed with, and that num-dual can differentiate once more when nested in its dual
/// numbers. The set is closed: an object chosen at run time, such as a [user-defined energy](crate::energy::own), has
/// one instance compiled for each of them.
pub trait RodScalar: Scalar + DualNum<Primitive = f64> {
    /// The instance of `all` for this scalar, such as a user-defined energy compiled for it.
    #[doc(hidden)]
    fn instance<T: ForEachScalar + ?Sized>(all: &T) -> &T::Instance<Self>;

    /// Runs a sweep with the widest SIMD numbers of this processor, or with one number at a time, and returns its
    /// output.
    #[doc(hidden)]
    fn run_sweep<S: Sweep<Self>>(sweep: S) -> S::Output;

    /// Whether the value and all derivatives are zero.
    #[doc(hidden)]
    fn is_identically_zero(&self) -> bool;
}

/// An object with one instance for each [`RodScalar`] scalar.
#[doc(hidden)]
pub trait ForEachScalar {
    /// The instance for the scalar `D`.
    type Instance<D: Scalar>: ?Sized;
    /// The instance over `f64`, without derivatives.
    fn plain(&self) -> &Self::Instance<f64>;
    /// The instance over dual numbers with one first derivative.
    fn dual(&self) -> &Self::Instance<Dual64>;
    /// The instance over hyper-dual numbers: two first derivatives and the mixed second one.
    fn hyper_dual(&self) -> &Self::Instance<HyperDual64>;
    /// The instance over dual numbers with two first derivatives.
    fn pair(&self) -> &Self::Instance<DualSVec64<2>>;
    /// The instance over dual numbers with eight first derivatives.
    fn eight(&self) -> &Self::Instance<DualSVec64<8>>;
}

/// Whether the values of all numbers are finite; derivatives are not tested. True for an empty list. Tests whether
/// their sum, in four independent parts, is finite: it is only if its terms are. Finite numbers whose sum overflows
/// count as not finite.
#[inline(always)]
pub(crate) fn is_finite<D: Scalar>(x: &[D]) -> bool {
    // The order of the sum does not matter: only whether it is finite.
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
    fn atan2_second_derivatives_are_exact_in_every_quadrant() {
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
