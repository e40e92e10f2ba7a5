//! SIMD arithmetic: several `f64` in one register of the processor's vector unit, which is detected at run time.
//!
//! [`SimdF64`] implements [`Scalar`], so that a formula written for any scalar processes four elements of a rod at once
//! (AVX2). Operations are never fused (no FMA): each lane has bitwise the result of scalar arithmetic. Exceptions are
//! sines and cosines, by polynomials (`numerics::trigonometry`), and `nearest_whole`, which rounds halves to even. The
//! value of a vector whose lanes differ is NaN. [`with_simd`] runs a computation compiled for the vector unit,
//! [`with_simd_if_wide`] does so only for arrays of more than two numbers. [`simd_level`] is the name of the
//! instruction set. [`PairLevel`] computes `a - x y` of pairs for band matrices. Without AVX2 all of them use scalar
//! code.

use crate::numerics::operators::derived_operators;
use crate::numerics::scalar::{ForEachScalar, RodScalar, Scalar, SimdScalar, Sweep};
use crate::numerics::trigonometry::{self, sin_and_cos};
use pulp::{Simd, bytemuck};
use std::cmp::Ordering;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A SIMD instruction set. A value of the type is the proof that the processor supports it.
pub trait Level: Simd {
    /// The value of the type, in code that already runs with this instruction set.
    fn here() -> Self;
    /// `own` shifted by one lane towards higher indices; the first lane receives the last lane of `earlier`.
    fn before(own: Self::f64s, earlier: Self::f64s) -> Self::f64s;
    /// `own` shifted by one lane towards lower indices; the last lane receives the first lane of `later`.
    fn after(own: Self::f64s, later: Self::f64s) -> Self::f64s;
}

#[cfg(target_arch = "x86_64")]
impl Level for pulp::x86::V3 {
    /// The value of the type. Panics on a processor without the instruction set.
    #[inline(always)]
    fn here() -> Self {
        Self::try_new().expect("numbers of this type exist only where the processor supports it")
    }
    /// The four lanes of `own` shifted towards higher indices; the first lane receives the last lane of `earlier`.
    #[inline(always)]
    fn before(own: Self::f64s, earlier: Self::f64s) -> Self::f64s {
        // A cast of four numbers, which the compiler turns into a permutation of registers.
        let (x, e) = (lanes(&own), lanes(&earlier));
        bytemuck::cast([e[3], x[0], x[1], x[2]])
    }
    /// The four lanes of `own` shifted towards lower indices; the last lane receives the first lane of `later`.
    #[inline(always)]
    fn after(own: Self::f64s, later: Self::f64s) -> Self::f64s {
        let (x, l) = (lanes(&own), lanes(&later));
        bytemuck::cast([x[1], x[2], x[3], l[0]])
    }
}

/// The lanes of a register as a slice of numbers.
#[inline(always)]
fn lanes<T: bytemuck::NoUninit>(numbers: &T) -> &[f64] {
    bytemuck::cast_slice(std::slice::from_ref(numbers))
}

/// As many `f64` as fit into one register of the instruction set `L`. Operations act on all lanes at once.
#[derive(Clone, Copy, Debug)]
pub struct SimdF64<L: Level> {
    level: L,
    numbers: L::f64s,
}

impl<L: Level> SimdF64<L> {
    /// `x` in every lane.
    #[inline(always)]
    fn splat(level: L, x: f64) -> Self {
        Self { level, numbers: level.splat_f64s(x) }
    }

    /// The numbers of all lanes as a slice.
    #[inline(always)]
    fn lanes(&self) -> &[f64] {
        lanes(&self.numbers)
    }

    /// The vector with `f(x)` for the number `x` of every lane, evaluated one after the other.
    #[inline(always)]
    fn map_lanes(self, f: impl Fn(f64) -> f64) -> Self {
        Self::gather(self.level, |lane| f(self.lanes()[lane]))
    }
}

impl<L: Level> SimdScalar<f64> for SimdF64<L> {
    type Level = L;
    const LANES: usize = L::F64_LANES;

    /// The vector with `of(lane)` in each lane, called from lane 0 on.
    #[inline(always)]
    fn gather(level: L, mut of: impl FnMut(usize) -> f64) -> Self {
        let mut numbers = level.splat_f64s(0.0);
        let lanes: &mut [f64] = bytemuck::cast_slice_mut(std::slice::from_mut(&mut numbers));
        for lane in 0..L::F64_LANES {
            lanes[lane] = of(lane);
        }
        Self { level, numbers }
    }

    /// The number of the lane `lane`.
    #[inline(always)]
    fn lane(&self, lane: usize) -> f64 {
        self.lanes()[lane]
    }

    /// The previous number of each lane: shifts all lanes up by one, and the last lane of `earlier` moves into the
    /// first.
    #[inline(always)]
    fn before(self, earlier: Self) -> Self {
        Self { numbers: L::before(self.numbers, earlier.numbers), ..self }
    }

    /// The next number of each lane: shifts all lanes down by one, and the first lane of `later` moves into the last.
    #[inline(always)]
    fn after(self, later: Self) -> Self {
        Self { numbers: L::after(self.numbers, later.numbers), ..self }
    }
}

impl<L: Level> From<f64> for SimdF64<L> {
    /// The number `x` in every lane.
    #[inline(always)]
    fn from(x: f64) -> Self {
        Self::splat(L::here(), x)
    }
}

/// Binary operators of two such numbers, and of one with an `f64` in all lanes.
macro_rules! operators {
    ($($operator:ident $name:ident $instruction:ident;)*) => {$(
        impl<L: Level> $operator for SimdF64<L> {
            type Output = Self;
            /// The result of the operator lane by lane, by one vector instruction.
            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                let Self { level, numbers } = self;
                Self { level, numbers: level.$instruction(numbers, other.numbers) }
            }
        }
        impl<L: Level> $operator<f64> for SimdF64<L> {
            type Output = Self;
            /// The result of the operator with `other` in every lane.
            #[inline(always)]
            fn $name(self, other: f64) -> Self {
                $operator::$name(self, Self::splat(self.level, other))
            }
        }
    )*};
}
operators! { Add add add_f64s; Sub sub sub_f64s; Mul mul mul_f64s; Div div div_f64s; }
derived_operators!([L: Level] SimdF64<L>);

impl<L: Level> Neg for SimdF64<L> {
    type Output = Self;
    /// The numbers with the opposite sign.
    #[inline(always)]
    fn neg(self) -> Self {
        Self { numbers: self.level.neg_f64s(self.numbers), ..self }
    }
}

impl<L: Level> PartialOrd for SimdF64<L> {
    /// The order that all lanes have; `None` if lanes differ in it, or one is NaN.
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        // Comparisons of formulas with SIMD numbers must not branch on one lane only.
        let mut lanes = self.lanes().iter().zip(other.lanes()).map(|(a, b)| a.partial_cmp(b));
        let first = lanes.next()?;
        if lanes.all(|order| order == first) { first } else { None }
    }
}
/// Functions without SIMD code, evaluated lane by lane.
macro_rules! lane_by_lane {
    ($($name:ident)*) => {
        $(#[inline]
        /// The function of this name of the standard library, lane by lane.
        fn $name(self) -> Self {
            self.map_lanes(f64::$name)
        })*
    };
}

impl<L: Level> Scalar for SimdF64<L> {
    const ORDER: usize = 0;

    lane_by_lane!(exp ln tan asin acos atan sinh cosh tanh);

    /// The number that all lanes have; NaN if they differ. Formulas with SIMD numbers use [`if_less`](Scalar::if_less)
    /// instead of branches on the value.
    #[inline]
    fn value(&self) -> f64 {
        // A branch on the value would treat all lanes alike; NaN shows that they differ.
        let [first, rest @ ..] = self.lanes() else { return f64::NAN };
        if rest.iter().all(|x| x == first) { *first } else { f64::NAN }
    }
    /// 1/x of every lane.
    #[inline(always)]
    fn recip(self) -> Self {
        Self::splat(self.level, 1.0) / self
    }
    /// Square root of every lane.
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self { numbers: self.level.sqrt_f64s(self.numbers), ..self }
    }
    /// The whole power `n` of every lane.
    #[inline]
    fn powi(self, n: i32) -> Self {
        self.map_lanes(|x| x.powi(n))
    }
    /// The power `n` of every lane; for positive numbers.
    #[inline]
    fn powf(self, n: f64) -> Self {
        self.map_lanes(|x| x.powf(n))
    }
    /// Sine of the angles in rad.
    #[inline(always)]
    fn sin(self) -> Self {
        self.sin_cos()[0]
    }
    /// Cosine of the angles in rad.
    #[inline(always)]
    fn cos(self) -> Self {
        self.sin_cos()[1]
    }
    /// Sine and cosine of the angles in rad, sine first: by polynomials if all are below `trigonometry::LARGEST` in
    /// absolute value, else lane by lane with the standard library.
    #[inline(always)]
    fn sin_cos(self) -> [Self; 2] {
        // Argument reduction in two parts of pi/2 is exact to rounding below this bound.
        if self.abs().all_less(self.like(trigonometry::LARGEST)) {
            return sin_and_cos(self);
        }
        [self.map_lanes(f64::sin), self.map_lanes(f64::cos)]
    }
    /// Angle of each point (`x`, `self`) in rad, in (-pi, pi].
    #[inline]
    fn atan2(self, x: Self) -> Self {
        Self::gather(self.level, |lane| self.lanes()[lane].atan2(x.lanes()[lane]))
    }
    /// The constant `x` in every lane.
    #[inline(always)]
    fn like(&self, x: f64) -> Self {
        Self::splat(self.level, x)
    }
    /// `then` in the lanes in which this number is less than `bound`, and `otherwise` in the others, without a branch.
    #[inline(always)]
    fn if_less(self, bound: Self, then: Self, otherwise: Self) -> Self {
        let level = self.level;
        // A selection by a mask: no lane branches.
        let less = level.less_than_f64s(self.numbers, bound.numbers);
        Self { level, numbers: level.select_f64s(less, then.numbers, otherwise.numbers) }
    }
    /// Whether the numbers of all lanes are less than those of `bound`.
    #[inline(always)]
    fn all_less(&self, bound: Self) -> bool {
        let less = self.level.less_than_f64s(self.numbers, bound.numbers);
        self.level.first_true_m64s(self.level.not_m64s(less)) == L::F64_LANES
    }
    /// The nearest integer in every lane, halves to the even one, for absolute values below 2^51.
    #[inline(always)]
    fn nearest_whole(self) -> Self {
        // 1.5 * 2^52, at which the spacing of doubles is one: adding and subtracting it rounds to an integer.
        const TO_WHOLE: f64 = 6_755_399_441_055_744.0;
        (self + TO_WHOLE) - TO_WHOLE
    }
    /// Absolute value of every lane.
    #[inline(always)]
    fn abs(self) -> Self {
        // All bits but the sign.
        let all_but_sign = self.level.splat_f64s(f64::from_bits(!(1 << 63)));
        Self { numbers: self.level.and_f64s(self.numbers, all_but_sign), ..self }
    }
    /// The smaller number in every lane; that of this vector if they are equal or one is NaN.
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        other.if_less(self, other, self)
    }
    /// The larger number in every lane; that of this vector if they are equal or one is NaN.
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.if_less(other, other, self)
    }
}

impl RodScalar for f64 {
    /// The instance of `all`, such as a user-defined energy, that is compiled for `f64`, without derivatives.
    fn instance<T: ForEachScalar + ?Sized>(all: &T) -> &T::Instance<Self> {
        all.plain()
    }

    /// Runs a sweep with vectors of four numbers if the processor has AVX2, else with one number at a time; returns its
    /// output.
    #[inline]
    fn run_sweep<S: Sweep<Self>>(sweep: S) -> S::Output {
        #[cfg(target_arch = "x86_64")]
        // Decided at run time: the same program runs on processors without AVX2.
        if let Some(level) = pulp::x86::V3::try_new() {
            return level.vectorize(
                #[inline(always)]
                || sweep.sweep::<SimdF64<_>>(level),
            );
        }
        sweep.sweep::<Self>(())
    }

    /// Whether the number is zero.
    fn is_identically_zero(&self) -> bool {
        *self == 0.0
    }
}

/// Runs `work` compiled for AVX2 if the processor [has it](simd_level), else as compiled for any processor; returns its
/// output. The compiler vectorizes its loops over short arrays. All functions that it calls must be
/// `#[inline(always)]`.
#[inline(always)]
pub fn with_simd<T: pulp::NullaryFnOnce>(work: T) -> T::Output {
    #[cfg(target_arch = "x86_64")]
    if let Some(level) = pulp::x86::V3::try_new() {
        return level.vectorize(work);
    }
    work.call()
}

/// Runs `work` by [`with_simd`] if `G`, the number of values in its arrays, is above 2, and calls it plainly otherwise:
/// two numbers fit into the registers that every x86-64 processor has.
#[inline(always)]
pub fn with_simd_if_wide<T: pulp::NullaryFnOnce, const G: usize>(work: T) -> T::Output {
    if G > 2 { with_simd(work) } else { work.call() }
}

/// Products of pairs of numbers, each pair in one register. A compiler that pairs scalar operations may find other,
/// worse pairs.
pub trait PairLevel: Copy {
    /// Whether registers have four numbers.
    const WIDE: bool;

    /// `a - x y` of a pair, number by number.
    fn subtract_product(self, a: [f64; 2], x: [f64; 2], y: [f64; 2]) -> [f64; 2];

    /// `a - x y` of two pairs with the same `y`.
    fn subtract_products(self, a: [[f64; 2]; 2], x: [[f64; 2]; 2], y: [f64; 2]) -> [[f64; 2]; 2];
}

impl PairLevel for () {
    const WIDE: bool = false;

    /// `a - x y` of a pair, by scalar instructions.
    #[inline(always)]
    fn subtract_product(self, a: [f64; 2], x: [f64; 2], y: [f64; 2]) -> [f64; 2] {
        [a[0] - x[0] * y[0], a[1] - x[1] * y[1]]
    }

    /// `a - x y` of two pairs with the same `y`, by scalar instructions.
    #[inline(always)]
    fn subtract_products(self, a: [[f64; 2]; 2], x: [[f64; 2]; 2], y: [f64; 2]) -> [[f64; 2]; 2] {
        [self.subtract_product(a[0], x[0], y), self.subtract_product(a[1], x[1], y)]
    }
}

#[cfg(target_arch = "x86_64")]
impl PairLevel for pulp::x86::V3 {
    const WIDE: bool = true;

    /// `a - x y` of a pair, number by number, by instructions that process two numbers each (product, then difference).
    #[inline(always)]
    fn subtract_product(self, a: [f64; 2], x: [f64; 2], y: [f64; 2]) -> [f64; 2] {
        let [a, x, y] = [bytemuck::cast(a), bytemuck::cast(x), bytemuck::cast(y)];
        bytemuck::cast(self.sse2._mm_sub_pd(a, self.sse2._mm_mul_pd(x, y)))
    }

    /// `a - x y` of two pairs with the same `y`, number by number, by instructions that process four numbers each.
    #[inline(always)]
    fn subtract_products(self, a: [[f64; 2]; 2], x: [[f64; 2]; 2], y: [f64; 2]) -> [[f64; 2]; 2] {
        let [a, x, y] = [bytemuck::cast(a), bytemuck::cast(x), bytemuck::cast([y, y])];
        bytemuck::cast(self.avx._mm256_sub_pd(a, self.avx._mm256_mul_pd(x, y)))
    }
}

/// Instruction set of the sweeps on this processor, detected at run time: `avx2` with four `f64` per register, or
/// `scalar`.
pub fn simd_level() -> &'static str {
    #[cfg(target_arch = "x86_64")]
    if pulp::x86::V3::is_available() {
        return "avx2";
    }
    "scalar"
}
