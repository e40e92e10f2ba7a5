//! Macro `derived_operators!`, which implements the operators of a number type that follow from its binary operators
//! `+ - * /` and its comparison.
//!
//! These are the assignments (`+=` and so on), `Sum`, equality, and comparison with an `f64`. Numbers are equal if
//! their comparison returns `Equal`, whatever their derivatives; the empty sum is 0. Input: the generic parameters
//! and the type. The scalars of this crate (SIMD, out-of-line and term-bound numbers) use it.

/// Implements, for a `Copy` number type `N` with `N + N`, `N + f64` and so on, `From<f64>` and `PartialOrd`:
/// the assignments `+= -= *= /=` of an `N` and of an `f64`, `Sum`, equality, and comparison with an `f64`.
///
/// The first argument are the generic parameters of the type in brackets.
macro_rules! derived_operators {
    (@assign [$($parameters:tt)*] $Number:ty, $Other:ty, $Assign:ident $name:ident $operator:tt) => {
        impl<$($parameters)*> std::ops::$Assign<$Other> for $Number {
            /// Replaces the number by the result of the operator with `other`.
            #[inline(always)]
            fn $name(&mut self, other: $Other) {
                *self = *self $operator other;
            }
        }
    };
    (@others [$($parameters:tt)*] $Number:ty) => {
        impl<$($parameters)*> std::iter::Sum for $Number {
            /// The sum of all numbers; 0 without any.
            fn sum<I: Iterator<Item = Self>>(numbers: I) -> Self {
                numbers.fold(Self::from(0.0), |sum, x| sum + x)
            }
        }
        impl<$($parameters)*> PartialEq for $Number {
            /// Whether the comparison of both numbers returns `Equal`; derivatives do not matter.
            fn eq(&self, other: &Self) -> bool {
                self.partial_cmp(other) == Some(std::cmp::Ordering::Equal)
            }
        }
        impl<$($parameters)*> PartialEq<f64> for $Number {
            /// Whether the comparison of the number with the `f64` returns `Equal`; derivatives do not matter.
            fn eq(&self, other: &f64) -> bool {
                *self == Self::from(*other)
            }
        }
        impl<$($parameters)*> PartialOrd<f64> for $Number {
            /// The order of the number and the `f64`, by the comparison of the type; derivatives do not matter.
            fn partial_cmp(&self, other: &f64) -> Option<std::cmp::Ordering> {
                self.partial_cmp(&Self::from(*other))
            }
        }
    };
    ($parameters:tt $Number:ty) => {
        $crate::numerics::operators::derived_operators!(
            $parameters $Number, AddAssign add_assign +, SubAssign sub_assign -, MulAssign mul_assign *,
            DivAssign div_assign /
        );
    };
    ($parameters:tt $Number:ty, $($Assign:ident $name:ident $operator:tt),*) => {
        $(
            $crate::numerics::operators::derived_operators!(
                @assign $parameters $Number, Self, $Assign $name $operator
            );
            $crate::numerics::operators::derived_operators!(
                @assign $parameters $Number, f64, $Assign $name $operator
            );
        )*
        $crate::numerics::operators::derived_operators!(@others $parameters $Number);
    };
}

pub(super) use derived_operators;
