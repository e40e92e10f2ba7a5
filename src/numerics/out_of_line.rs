//! Numbers whose operations are functions that are called, where others lay theirs into the formula.
//!
//! A formula in numbers with many derivatives is thousands of instructions for every operation it has. Where it is no
//! loop that anybody waits for, it is written once as calls.

use crate::numerics::scalar::{ForEachScalar, Nestable, Scalar, SimdScalar, Sweep};
use nalgebra::Const;
use num_dual::{Dual64, DualSVec64, HyperDual64};
use std::cmp::Ordering;
use std::iter::Sum;
use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

/// A number of type `D` whose operations are called. It has the value and the derivatives that `D` has, to the last
/// digit.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub struct OutOfLine<D>(pub D);

impl<D: Scalar> From<f64> for OutOfLine<D> {
    fn from(x: f64) -> Self {
        Self(D::from(x))
    }
}

/// An operator between such numbers, and with a plain one.
macro_rules! operators {
    ($($operator:ident $name:ident $assign:ident $assigning:ident;)*) => {$(
        impl<D: Scalar> $operator for OutOfLine<D> {
            type Output = Self;
            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                // By where they are: a number that is handed over is copied first.
                #[inline(never)]
                fn called<D: Scalar>(a: &D, b: &D) -> D {
                    $operator::$name(*a, *b)
                }
                Self(called(&self.0, &other.0))
            }
        }
        impl<D: Scalar> $operator<f64> for OutOfLine<D> {
            type Output = Self;
            #[inline(always)]
            fn $name(self, other: f64) -> Self {
                #[inline(never)]
                fn called<D: Scalar>(a: &D, b: f64) -> D {
                    $operator::$name(*a, b)
                }
                Self(called(&self.0, other))
            }
        }
        impl<D: Scalar> $assign for OutOfLine<D> {
            #[inline(always)]
            fn $assigning(&mut self, other: Self) {
                *self = $operator::$name(*self, other);
            }
        }
        impl<D: Scalar> $assign<f64> for OutOfLine<D> {
            #[inline(always)]
            fn $assigning(&mut self, other: f64) {
                *self = $operator::$name(*self, other);
            }
        }
    )*};
}
operators! {
    Add add AddAssign add_assign;
    Sub sub SubAssign sub_assign;
    Mul mul MulAssign mul_assign;
    Div div DivAssign div_assign;
}

impl<D: Scalar> Neg for OutOfLine<D> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        #[inline(never)]
        fn called<D: Scalar>(x: &D) -> D {
            -*x
        }
        Self(called(&self.0))
    }
}

impl<D: Scalar> Sum for OutOfLine<D> {
    fn sum<I: Iterator<Item = Self>>(numbers: I) -> Self {
        Self(numbers.map(|x| x.0).sum())
    }
}

impl<D: Scalar> PartialEq for OutOfLine<D> {
    fn eq(&self, other: &Self) -> bool {
        self.0 == other.0
    }
}
impl<D: Scalar> PartialOrd for OutOfLine<D> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        self.0.partial_cmp(&other.0)
    }
}
impl<D: Scalar> PartialEq<f64> for OutOfLine<D> {
    fn eq(&self, other: &f64) -> bool {
        self.0 == *other
    }
}
impl<D: Scalar> PartialOrd<f64> for OutOfLine<D> {
    fn partial_cmp(&self, other: &f64) -> Option<Ordering> {
        self.0.partial_cmp(other)
    }
}

/// Functions of one number.
macro_rules! functions {
    ($($name:ident)*) => {
        $(#[inline(always)]
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

    fn value(&self) -> f64 {
        self.0.value()
    }
    #[inline(never)]
    fn powi(self, n: i32) -> Self {
        Self(self.0.powi(n))
    }
    #[inline(never)]
    fn powf(self, n: f64) -> Self {
        Self(self.0.powf(n))
    }
    #[inline(never)]
    fn atan2(self, x: Self) -> Self {
        Self(self.0.atan2(x.0))
    }
}

/// One of them, whatever it is made of.
impl<D: Scalar> SimdScalar<D> for OutOfLine<D> {
    type Level = ();
    const LANES: usize = 1;

    #[inline(always)]
    fn gather((): (), mut of: impl FnMut(usize) -> D) -> Self {
        Self(of(0))
    }
    #[inline(always)]
    fn lane(&self, _: usize) -> D {
        self.0
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

macro_rules! nestable {
    ($($scalar:ty: $instance:ident, $sweeps:ty, $parts:expr;)*) => {
        $(impl Nestable for $scalar {
            fn instance<T: ForEachScalar + ?Sized>(all: &T) -> &T::Instance<Self> {
                all.$instance()
            }
            #[inline]
            fn run_sweep<S: Sweep<Self>>(sweep: S) -> S::Output {
                sweep.sweep::<$sweeps>(())
            }
            fn is_identically_zero(&self) -> bool {
                let parts: fn(&Self) -> [f64; _] = $parts;
                parts(self).iter().all(|part| *part == 0.0)
            }
        })*
    };
}

// With its parts, and how each sweeps along a rod: what has more than one derivative calls its operations, which would be a tenth of
// all code if they were laid into the sweeps.
nestable! {
    Dual64: dual, Self, |x| [x.re, x.eps];
    HyperDual64: hyper_dual, OutOfLine<Self>, |x| [x.re, x.eps1, x.eps2, x.eps1eps2];
    DualSVec64<2>: pair, OutOfLine<Self>, |x| {
        let [a, b] = x.eps.unwrap_generic(Const::<2>, Const::<1>).data.0[0];
        [x.re, a, b]
    };
}
