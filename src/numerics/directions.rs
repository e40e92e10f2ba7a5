//! `G` numbers in an array with elementwise arithmetic ([`Directions`]), such as the derivatives of a state by `G`
//! parameters.
//!
//! Lanes are added, subtracted, and multiplied by one `f64`; products of two `Directions` do not exist. [`dot`] is the
//! sum of `N` `Directions` with `N` numbers as weights. [`all`] converts an array of options to one of values, or
//! `None` if one is missing. The compiler maps the loops to SIMD instructions; results are bitwise those of scalar
//! arithmetic. Forward sensitivities of several parameters are propagated with it.

use std::ops::{Add, AddAssign, Mul, Sub, SubAssign};

/// `G` numbers that are processed by the same formula. Each has bitwise the result of scalar arithmetic.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Directions<const G: usize>(pub [f64; G]);

impl<const G: usize> Directions<G> {
    /// Zeros.
    pub const ZERO: Self = Self([0.0; G]);
}

impl<const G: usize> From<f64> for Directions<G> {
    /// The number `x` in each lane.
    #[inline(always)]
    fn from(x: f64) -> Self {
        Self([x; G])
    }
}

/// Implements binary operators of `Directions`, lane by lane, by the assignment operator of `f64`.
macro_rules! elementwise {
    ($($Operator:ident<$Other:ty> $name:ident, $g:ident $other:ident -> $value:expr, $assign:tt;)*) => {$(
        impl<const G: usize> $Operator<$Other> for Directions<G> {
            type Output = Self;
            /// The result of the operator in each lane.
            #[inline(always)]
            fn $name(mut self, $other: $Other) -> Self {
                for $g in 0..G {
                    self.0[$g] $assign $value;
                }
                self
            }
        }
    )*};
}
elementwise! {
    Add<Self> add, g other -> other.0[g], +=;
    Sub<Self> sub, g other -> other.0[g], -=;
    Mul<f64> mul, g factor -> factor, *=;
}

impl<const G: usize> Mul<Directions<G>> for f64 {
    type Output = Directions<G>;
    /// Each lane multiplied by this number.
    #[inline(always)]
    fn mul(self, lanes: Directions<G>) -> Directions<G> {
        lanes * self
    }
}

impl<const G: usize> AddAssign for Directions<G> {
    /// Adds the numbers lane by lane.
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<const G: usize> SubAssign for Directions<G> {
    /// Subtracts the numbers lane by lane.
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

/// The sum of `a[i] b[i]` over `N` numbers `a` and `N` groups of lanes `b`, lane by lane.
#[inline(always)]
pub fn dot<const G: usize, const N: usize>(a: &[f64; N], b: &[Directions<G>; N]) -> Directions<G> {
    let mut sum = b[0] * a[0];
    for i in 1..N {
        sum += b[i] * a[i];
    }
    sum
}

/// The array of the values of all lanes; `None` if at least one is missing.
pub fn all<T, const G: usize>(some: [Option<T>; G]) -> Option<[T; G]> {
    let all: Vec<T> = some.into_iter().collect::<Option<_>>()?;
    all.try_into().ok()
}
