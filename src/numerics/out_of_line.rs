//! Out-of-line arithmetic: numbers whose operations are function calls instead of inlined code.
//!
//! With many derivatives per number, inlined operations expand a formula to thousands of instructions. Formulas that
//! are not time-critical are evaluated with [`OutOfLine`] numbers, which keeps the compiled program small. Value and
//! derivatives are bitwise those of the number inside. The file also implements `RodScalar` for the dual numbers that
//! rods are computed with: sweeps along a rod are inlined for dual numbers with one derivative, and out of line for
//! those with several.

use crate::numerics::operators::derived_operators;
use crate::numerics::scalar::{ForEachScalar, RodScalar, Scalar, SimdScalar, Sweep};
use nalgebra::Const;
use num_dual::{Dual64, DualSVec64, HyperDual64};
use std::cmp::Ordering;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A number of type `D` whose operations are function calls. Value and derivatives are bitwise those of `D`.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub struct OutOfLine<D>(pub D);

impl<D: Scalar> From<f64> for OutOfLine<D> {
    /// The constant `x`: derivatives are zero.
    fn from(x: f64) -> Self {
        Self(D::from(x))
    }
}

/// Binary operators of two such numbers, and of one with an `f64`.
macro_rules! operators {
    ($($operator:ident $name:ident;)*) => {$(
        impl<D: Scalar> $operator for OutOfLine<D> {
            type Output = Self;
            /// The result of the operator, by a function call.
            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                // By reference: an argument passed by value would be copied first.
                #[inline(never)]
                fn called<D: Scalar>(a: &D, b: &D) -> D {
                    $operator::$name(*a, *b)
                }
                Self(called(&self.0, &other.0))
            }
        }
        impl<D: Scalar> $operator<f64> for OutOfLine<D> {
            type Output = Self;
            /// The result of the operator with a constant, by a function call.
            #[inline(always)]
            fn $name(self, other: f64) -> Self {
                #[inline(never)]
                fn called<D: Scalar>(a: &D, b: f64) -> D {
                    $operator::$name(*a, b)
                }
                Self(called(&self.0, other))
            }
        }
    )*};
}
operators! { Add add; Sub sub; Mul mul; Div div; }
derived_operators!([D: Scalar] OutOfLine<D>);

impl<D: Scalar> Neg for OutOfLine<D> {
    type Output = Self;
    /// The number with the opposite value and derivatives, by a function call.
    #[inline(always)]
    fn neg(self) -> Self {
        #[inline(never)]
        fn called<D: Scalar>(x: &D) -> D {
            -*x
        }
        Self(called(&self.0))
    }
}

impl<D: Scalar> PartialOrd for OutOfLine<D> {
    /// The order of the values; derivatives do not matter. None if one is NaN.
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        self.0.partial_cmp(&other.0)
    }
}
/// Functions of one number, as calls.
macro_rules! functions {
    ($($name:ident)*) => {
        $(#[inline(always)]
        /// The function of this name of the number inside, by a function call.
        fn $name(self) -> Self {
            #[inline(never)]
            fn called<D: Scalar>(x: &D) -> D {
                x.$name()
            }
            Self(called(&self.0))
        })*
    };
}

impl<D: Scalar> Scalar for OutOfLine<D> {
    const ORDER: usize = D::ORDER;

    functions!(recip sqrt exp ln sin cos tan asin acos atan sinh cosh tanh);

    /// The real part.
    fn value(&self) -> f64 {
        self.0.value()
    }
    /// The number to the whole power `n`.
    #[inline(never)]
    fn powi(self, n: i32) -> Self {
        Self(self.0.powi(n))
    }
    /// The number to any power `n`; for positive numbers.
    #[inline(never)]
    fn powf(self, n: f64) -> Self {
        Self(self.0.powf(n))
    }
    /// Angle of the point (`x`, `self`) in rad, in (-pi, pi].
    #[inline(never)]
    fn atan2(self, x: Self) -> Self {
        Self(self.0.atan2(x.0))
    }
}

/// One lane.
impl<D: Scalar> SimdScalar<D> for OutOfLine<D> {
    type Level = ();
    const LANES: usize = 1;

    /// The number of lane 0, the only one.
    #[inline(always)]
    fn gather((): (), mut of: impl FnMut(usize) -> D) -> Self {
        Self(of(0))
    }
    /// The number inside, whatever the index: there is one lane.
    #[inline(always)]
    fn lane(&self, _: usize) -> D {
        self.0
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

/// Implements [`RodScalar`] for dual numbers.
macro_rules! nestable {
    ($($scalar:ty: $instance:ident, $sweeps:ty, $components:expr;)*) => {
        $(impl RodScalar for $scalar {
            /// The instance of `all`, such as a user-defined energy, that is compiled for this scalar.
            fn instance<T: ForEachScalar + ?Sized>(all: &T) -> &T::Instance<Self> {
                all.$instance()
            }
            /// Runs a sweep along a rod with one number at a time, by out-of-line arithmetic for scalars with several
            /// derivatives, and returns its output.
            #[inline]
            fn run_sweep<S: Sweep<Self>>(sweep: S) -> S::Output {
                sweep.sweep::<$sweeps>(())
            }
            /// Whether the value and all derivatives are zero.
            fn is_identically_zero(&self) -> bool {
                let components: fn(&Self) -> [f64; _] = $components;
                components(self).iter().all(|part| *part == 0.0)
            }
        })*
    };
}

// Scalar: its instance in `ForEachScalar`, the numbers of its sweeps along a rod, and its components. Scalars with more
// than one derivative sweep with out-of-line arithmetic: inlined, these sweeps would be a tenth of the program.
nestable! {
    Dual64: dual, Self, |x| [x.re, x.eps];
    HyperDual64: hyper_dual, OutOfLine<Self>, |x| [x.re, x.eps1, x.eps2, x.eps1eps2];
    DualSVec64<2>: pair, OutOfLine<Self>, |x| {
        let [a, b] = x.eps.unwrap_generic(Const::<2>, Const::<1>).data.0[0];
        [x.re, a, b]
    };
    DualSVec64<8>: eight, OutOfLine<Self>, |x| {
        let [a, b, c, d, e, f, g, h] = x.eps.unwrap_generic(Const::<8>, Const::<1>).data.0[0];
        [x.re, a, b, c, d, e, f, g, h]
    };
}
