//! Numbers side by side: the same formula for several of them at once.

use std::ops::{Add, AddAssign, Mul, Sub, SubAssign};

/// `G` numbers that go through the same formula. Each is what it would be alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lanes<const G: usize>(pub [f64; G]);

impl<const G: usize> Lanes<G> {
    /// Zeros.
    pub const ZERO: Self = Self([0.0; G]);
}

impl<const G: usize> From<f64> for Lanes<G> {
    #[inline(always)]
    fn from(x: f64) -> Self {
        Self([x; G])
    }
}

impl<const G: usize> Add for Lanes<G> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let mut sum = self;
        for g in 0..G {
            sum.0[g] += other.0[g];
        }
        sum
    }
}

impl<const G: usize> Sub for Lanes<G> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        let mut difference = self;
        for g in 0..G {
            difference.0[g] -= other.0[g];
        }
        difference
    }
}

impl<const G: usize> Mul<f64> for Lanes<G> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        let mut product = self;
        for g in 0..G {
            product.0[g] *= factor;
        }
        product
    }
}

impl<const G: usize> AddAssign for Lanes<G> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<const G: usize> SubAssign for Lanes<G> {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

/// a . b of a vector of numbers and one of lanes.
#[inline(always)]
pub fn dot<const G: usize, const N: usize>(a: &[f64; N], b: &[Lanes<G>; N]) -> Lanes<G> {
    let mut sum = b[0] * a[0];
    for i in 1..N {
        sum += b[i] * a[i];
    }
    sum
}

/// All of some things, if all are there.
pub fn all<T, const G: usize>(some: [Option<T>; G]) -> Option<[T; G]> {
    let all: Vec<T> = some.into_iter().collect::<Option<_>>()?;
    all.try_into().ok()
}
