//! Plain numbers side by side in a register of the processor's vector unit, found out when the program runs.
//!
//! No two operations are fused into one, so that every lane has what a number alone would have, to the last
//! digit; but for sines and cosines, whose series is not the library's.

use crate::numerics::scalar::{ForEachScalar, Nestable, Scalar, SimdScalar, Sweep};
use crate::numerics::trigonometry::{self, sin_and_cos};
use pulp::{Simd, bytemuck};
use std::cmp::Ordering;
use std::iter::Sum;
use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

/// A vector unit: whoever has one knows that the processor does.
pub trait Level: Simd {
    /// Where the program runs on it already.
    fn here() -> Self;
    /// The numbers one lane before these, of which `earlier` ones go before all.
    fn before(own: Self::f64s, earlier: Self::f64s) -> Self::f64s;
    /// The numbers one lane after these, of which `later` ones come after all.
    fn after(own: Self::f64s, later: Self::f64s) -> Self::f64s;
}

#[cfg(target_arch = "x86_64")]
impl Level for pulp::x86::V3 {
    #[inline(always)]
    fn here() -> Self {
        Self::try_new().expect("its numbers are made where the processor has it")
    }
    #[inline(always)]
    fn before(own: Self::f64s, earlier: Self::f64s) -> Self::f64s {
        let (mut numbers, own, earlier) = (own, lanes(&own), lanes(&earlier));
        let to: &mut [f64] = bytemuck::cast_slice_mut(std::slice::from_mut(&mut numbers));
        (to[0], to[1], to[2], to[3]) = (earlier[3], own[0], own[1], own[2]);
        numbers
    }
    #[inline(always)]
    fn after(own: Self::f64s, later: Self::f64s) -> Self::f64s {
        let (mut numbers, own, later) = (own, lanes(&own), lanes(&later));
        let to: &mut [f64] = bytemuck::cast_slice_mut(std::slice::from_mut(&mut numbers));
        (to[0], to[1], to[2], to[3]) = (own[1], own[2], own[3], later[0]);
        numbers
    }
}

/// The numbers in a register, one by one.
#[inline(always)]
fn lanes<T: bytemuck::NoUninit>(numbers: &T) -> &[f64] {
    bytemuck::cast_slice(std::slice::from_ref(numbers))
}

/// As many plain numbers as go into one register, each of which is what it would be alone.
#[derive(Clone, Copy, Debug)]
pub struct SimdF64<L: Level> {
    level: L,
    numbers: L::f64s,
}

impl<L: Level> SimdF64<L> {
    /// The same number in every lane.
    #[inline(always)]
    fn splat(level: L, x: f64) -> Self {
        Self { level, numbers: level.splat_f64s(x) }
    }

    #[inline(always)]
    fn lanes(&self) -> &[f64] {
        lanes(&self.numbers)
    }

    /// What `f` makes of every lane, one by one.
    #[inline(always)]
    fn each(self, f: impl Fn(f64) -> f64) -> Self {
        Self::gather(self.level, |lane| f(self.lanes()[lane]))
    }
}

impl<L: Level> SimdScalar<f64> for SimdF64<L> {
    type Level = L;
    const LANES: usize = L::F64_LANES;

    #[inline(always)]
    fn gather(level: L, mut of: impl FnMut(usize) -> f64) -> Self {
        let mut numbers = level.splat_f64s(0.0);
        let lanes: &mut [f64] = bytemuck::cast_slice_mut(std::slice::from_mut(&mut numbers));
        for lane in 0..L::F64_LANES {
            lanes[lane] = of(lane);
        }
        Self { level, numbers }
    }

    #[inline(always)]
    fn lane(&self, lane: usize) -> f64 {
        self.lanes()[lane]
    }

    #[inline(always)]
    fn before(self, earlier: Self) -> Self {
        Self { numbers: L::before(self.numbers, earlier.numbers), ..self }
    }

    #[inline(always)]
    fn after(self, later: Self) -> Self {
        Self { numbers: L::after(self.numbers, later.numbers), ..self }
    }
}

impl<L: Level> From<f64> for SimdF64<L> {
    #[inline(always)]
    fn from(x: f64) -> Self {
        Self::splat(L::here(), x)
    }
}

/// An operator between such numbers, and with a plain one.
macro_rules! operators {
    ($($operator:ident $name:ident $assign:ident $assigning:ident $of_unit:ident;)*) => {$(
        impl<L: Level> $operator for SimdF64<L> {
            type Output = Self;
            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                let Self { level, numbers } = self;
                Self { level, numbers: level.$of_unit(numbers, other.numbers) }
            }
        }
        impl<L: Level> $operator<f64> for SimdF64<L> {
            type Output = Self;
            #[inline(always)]
            fn $name(self, other: f64) -> Self {
                $operator::$name(self, Self::splat(self.level, other))
            }
        }
        impl<L: Level> $assign for SimdF64<L> {
            #[inline(always)]
            fn $assigning(&mut self, other: Self) {
                *self = $operator::$name(*self, other);
            }
        }
        impl<L: Level> $assign<f64> for SimdF64<L> {
            #[inline(always)]
            fn $assigning(&mut self, other: f64) {
                *self = $operator::$name(*self, other);
            }
        }
    )*};
}
operators! {
    Add add AddAssign add_assign add_f64s;
    Sub sub SubAssign sub_assign sub_f64s;
    Mul mul MulAssign mul_assign mul_f64s;
    Div div DivAssign div_assign div_f64s;
}

impl<L: Level> Neg for SimdF64<L> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { numbers: self.level.neg_f64s(self.numbers), ..self }
    }
}

impl<L: Level> Sum for SimdF64<L> {
    fn sum<I: Iterator<Item = Self>>(numbers: I) -> Self {
        numbers.fold(Self::from(0.0), |sum, x| sum + x)
    }
}

impl<L: Level> PartialEq for SimdF64<L> {
    fn eq(&self, other: &Self) -> bool {
        self.lanes() == other.lanes()
    }
}
impl<L: Level> PartialOrd for SimdF64<L> {
    /// As all lanes agree.
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        let mut lanes = self.lanes().iter().zip(other.lanes()).map(|(a, b)| a.partial_cmp(b));
        let first = lanes.next()?;
        if lanes.all(|order| order == first) { first } else { None }
    }
}
impl<L: Level> PartialEq<f64> for SimdF64<L> {
    fn eq(&self, other: &f64) -> bool {
        *self == Self::splat(self.level, *other)
    }
}
impl<L: Level> PartialOrd<f64> for SimdF64<L> {
    fn partial_cmp(&self, other: &f64) -> Option<Ordering> {
        self.partial_cmp(&Self::splat(self.level, *other))
    }
}

/// Functions of one number that are taken lane by lane.
macro_rules! lane_by_lane {
    ($($name:ident)*) => {
        $(#[inline]
        fn $name(self) -> Self {
            self.each(f64::$name)
        })*
    };
}

impl<L: Level> Scalar for SimdF64<L> {
    const ORDER: usize = 0;

    lane_by_lane!(exp ln tan asin acos atan sinh cosh tanh);

    /// The one that all lanes have; no number if they differ: what goes side by side selects instead.
    #[inline]
    fn value(&self) -> f64 {
        let [first, rest @ ..] = self.lanes() else { return f64::NAN };
        if rest.iter().all(|x| x == first) { *first } else { f64::NAN }
    }
    #[inline(always)]
    fn recip(self) -> Self {
        Self::splat(self.level, 1.0) / self
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self { numbers: self.level.sqrt_f64s(self.numbers), ..self }
    }
    #[inline]
    fn powi(self, n: i32) -> Self {
        self.each(|x| x.powi(n))
    }
    #[inline]
    fn powf(self, n: f64) -> Self {
        self.each(|x| x.powf(n))
    }
    #[inline(always)]
    fn sin(self) -> Self {
        self.sin_cos()[0]
    }
    #[inline(always)]
    fn cos(self) -> Self {
        self.sin_cos()[1]
    }
    #[inline(always)]
    fn sin_cos(self) -> [Self; 2] {
        if self.abs().all_less(self.like(trigonometry::LARGEST)) {
            return sin_and_cos(self);
        }
        [self.each(f64::sin), self.each(f64::cos)]
    }
    #[inline]
    fn atan2(self, x: Self) -> Self {
        Self::gather(self.level, |lane| self.lanes()[lane].atan2(x.lanes()[lane]))
    }
    #[inline(always)]
    fn like(&self, x: f64) -> Self {
        Self::splat(self.level, x)
    }
    #[inline(always)]
    fn if_less(self, bound: Self, then: Self, otherwise: Self) -> Self {
        let level = self.level;
        let less = level.less_than_f64s(self.numbers, bound.numbers);
        Self { level, numbers: level.select_f64s(less, then.numbers, otherwise.numbers) }
    }
    #[inline(always)]
    fn all_less(&self, bound: Self) -> bool {
        let less = self.level.less_than_f64s(self.numbers, bound.numbers);
        self.level.first_true_m64s(self.level.not_m64s(less)) == L::F64_LANES
    }
    /// Of numbers below 2^51.
    #[inline(always)]
    fn nearest_whole(self) -> Self {
        // Added and taken away again, this leaves nothing but a whole number.
        const TO_WHOLE: f64 = 6_755_399_441_055_744.0;
        (self + TO_WHOLE) - TO_WHOLE
    }
    #[inline(always)]
    fn abs(self) -> Self {
        let all_but_sign = self.level.splat_f64s(f64::from_bits(!(1 << 63)));
        Self { numbers: self.level.and_f64s(self.numbers, all_but_sign), ..self }
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        other.if_less(self, other, self)
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.if_less(other, other, self)
    }
}

/// A sweep at a level.
struct At<L, S>(L, S);

impl<L: Level, S: Sweep<f64>> pulp::NullaryFnOnce for At<L, S> {
    type Output = S::Output;

    #[inline(always)]
    fn call(self) -> S::Output {
        self.1.sweep::<SimdF64<L>>(self.0)
    }
}

impl Nestable for f64 {
    fn instance<T: ForEachScalar + ?Sized>(all: &T) -> &T::Instance<Self> {
        all.plain()
    }

    #[inline]
    fn run_sweep<S: Sweep<Self>>(sweep: S) -> S::Output {
        #[cfg(target_arch = "x86_64")]
        if let Some(level) = pulp::x86::V3::try_new() {
            return level.vectorize(At(level, sweep));
        }
        sweep.sweep::<Self>(())
    }

    fn is_identically_zero(&self) -> bool {
        *self == 0.0
    }
}

/// Does what goes side by side as it stands, in lists of a few numbers each, compiled for the processor's vector unit
/// if there [is one](has_simd): all it calls must be `#[inline(always)]`.
#[inline(always)]
pub fn with_simd<T: pulp::NullaryFnOnce>(work: T) -> T::Output {
    #[cfg(target_arch = "x86_64")]
    if let Some(level) = pulp::x86::V3::try_new() {
        return level.vectorize(work);
    }
    work.call()
}

/// The same where each list has more than two numbers: fewer fill no wider unit.
#[inline(always)]
pub fn with_simd_if_wide<T: pulp::NullaryFnOnce, const G: usize>(work: T) -> T::Output {
    if G > 2 { with_simd(work) } else { work.call() }
}

/// Whether there is a vector unit of more than two numbers.
pub fn has_simd() -> bool {
    simd_level() != "scalar"
}

/// What plain numbers go side by side with on this processor: `avx2`, four of them, or `scalar`, one.
pub fn simd_level() -> &'static str {
    #[cfg(target_arch = "x86_64")]
    if pulp::x86::V3::is_available() {
        return "avx2";
    }
    "scalar"
}
