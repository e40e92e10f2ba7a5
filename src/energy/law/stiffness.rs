//! Stiffnesses: symmetric matrices of the derivatives of the stresses of an edge or a joint by its strains.
//!
//! An edge and a planar joint have one strain and the stiffness `[k]`. A spatial joint has the strains `k1`, `k2` of
//! bending and `tau` of twisting, and a [`Stiffness`]. The trait [`Symmetric`] has entries of the upper triangle,
//! products, scaling by kinds of strain, and the solution of `K s = w`. Entries are numbers (plain, with
//! derivatives, or in SIMD lanes), or derivatives of a number alone in SIMD lanes, one lane per parameter.

use crate::numerics::scalar::{Scalar, SimdScalar};
use std::fmt::Debug;
use std::ops::{Add, Mul};

/// An entry of a stiffness: a number, or the derivatives of one in SIMD lanes.
pub trait StiffnessEntry:
    Copy + Debug + Send + Sync + From<f64> + Add<Output = Self> + Mul<f64, Output = Self>
{
}

impl<T> StiffnessEntry for T where
    T: Copy + Debug + Send + Sync + From<f64> + Add<Output = T> + Mul<f64, Output = T>
{
}

/// A symmetric matrix over `S` strains.
pub trait Symmetric<T: StiffnessEntry, const S: usize>: Copy + Debug + Send + Sync {
    /// Row and column of each entry: the upper triangle row by row.
    const PLACES: &'static [[usize; 2]];

    /// Entry `k`, in the order of [`PLACES`](Self::PLACES).
    fn entry(&self, k: usize) -> T;

    /// The matrix with `entry(k)` for every entry `k`, in the order of [`PLACES`](Self::PLACES).
    fn from_entries(entry: impl FnMut(usize) -> T) -> Self;

    /// The product of the full symmetric matrix with the strains `s`.
    fn times<U: Copy, V: Add<Output = V>>(&self, s: &[U; S]) -> [V; S]
    where
        T: Mul<U, Output = V>;

    /// Whether entry `k` couples bending (strain 0 or 1) and twisting (strain 2).
    #[inline(always)]
    fn is_coupling(k: usize) -> bool {
        Self::PLACES[k][0] < 2 && Self::PLACES[k][1] == 2
    }

    /// The mean of both stiffnesses of bending (diagonal entries of the first two strains); for a single strain its
    /// stiffness.
    fn mean(&self) -> T {
        if S == 3 { (self.entry(0) + self.entry(3)) * 0.5 } else { self.entry(0) }
    }

    /// The matrix without the coupling of bending and twisting.
    #[inline(always)]
    fn uncoupled(&self) -> Self {
        Self::from_entries(|k| if Self::is_coupling(k) { T::from(0.0) } else { self.entry(k) })
    }

    /// The matrix with each entry times the factor of its row's strain, and the couplings of bending and twisting times
    /// `coupling`. The entry between both bending strains has the factor of the first.
    #[inline(always)]
    fn scaled(&self, coupling: T, factors: &[T; S]) -> Self
    where
        T: Scalar,
    {
        Self::from_entries(|k| {
            let own = factors[Self::PLACES[k][0]];
            self.entry(k) * if Self::is_coupling(k) { coupling } else { own }
        })
    }

    /// The solution `s` of `K s = w`, by the factors `K = L D L'` without pivoting; not finite if a pivot is zero.
    fn inverse_times(&self, w: &[T; S]) -> [T; S]
    where
        T: Scalar,
    {
        let zero = T::from(0.0);
        let (mut scaled, mut s, mut lower, mut pivots) = ([[zero; S]; S], *w, [[zero; S]; S], *w);
        // L D L' of a matrix of one or three rows, without pivoting: stiffnesses are positive
        // definite.
        for (k, [r, c]) in Self::PLACES.iter().copied().enumerate() {
            scaled[c][r] = self.entry(k);
        }
        for r in 0..S {
            pivots[r] = scaled[r][r];
            for k in 0..r {
                for j in 0..k {
                    scaled[r][k] -= lower[r][j] * scaled[k][j];
                }
                lower[r][k] = scaled[r][k] / pivots[k];
                pivots[r] -= lower[r][k] * scaled[r][k];
                s[r] -= lower[r][k] * s[k];
            }
        }
        // Back substitution with D L'.
        for r in (0..S).rev() {
            s[r] /= pivots[r];
            for c in r + 1..S {
                s[r] -= lower[c][r] * s[c];
            }
        }
        s
    }
}

impl<T: StiffnessEntry> Symmetric<T, 1> for [T; 1] {
    const PLACES: &'static [[usize; 2]] = &[[0, 0]];

    /// The only entry.
    #[inline(always)]
    fn entry(&self, _: usize) -> T {
        self[0]
    }

    /// The matrix `[entry(0)]`.
    #[inline(always)]
    fn from_entries(mut entry: impl FnMut(usize) -> T) -> Self {
        [entry(0)]
    }

    /// The product of the only entry with the only strain.
    #[inline(always)]
    fn times<U: Copy, V: Add<Output = V>>(&self, s: &[U; 1]) -> [V; 1]
    where
        T: Mul<U, Output = V>,
    {
        [self[0] * s[0]]
    }
}

/// Stiffnesses of an inner node, all over the Voronoi length, N m.
#[derive(Clone, Copy, Debug)]
pub struct Stiffness<D> {
    /// Of bending: `[b11, b12, b22]`, symmetric in the material frame; `[EI1, 0, EI2]/dl` where
    /// nothing couples them.
    pub bend: [D; 3],
    /// Stiffness of twisting, GJ/dl, N m.
    pub twist: D,
    /// Between each curvature and twisting, zero where nothing couples them.
    pub coupling: [D; 2],
}

impl<T: StiffnessEntry> Symmetric<T, 3> for Stiffness<T> {
    const PLACES: &'static [[usize; 2]] = &[[0, 0], [0, 1], [0, 2], [1, 1], [1, 2], [2, 2]];

    /// Entry `k` in the order `b11, b12, c1, b22, c2, twist`. Panics from 6 on.
    #[inline(always)]
    fn entry(&self, k: usize) -> T {
        let ([b11, b12, b22], [c1, c2]) = (self.bend, self.coupling);
        [b11, b12, c1, b22, c2, self.twist][k]
    }

    /// The matrix with the entries `b11, b12, c1, b22, c2, twist` from `entry(0)` to `entry(5)`.
    #[inline(always)]
    fn from_entries(mut entry: impl FnMut(usize) -> T) -> Self {
        Self {
            bend: [entry(0), entry(1), entry(3)],
            twist: entry(5),
            coupling: [entry(2), entry(4)],
        }
    }

    /// The product of the full symmetric matrix with the strains `[k1, k2, tau]`.
    #[inline(always)]
    fn times<U: Copy, V: Add<Output = V>>(&self, s: &[U; 3]) -> [V; 3]
    where
        T: Mul<U, Output = V>,
    {
        let ([b11, b12, b22], [c1, c2]) = (self.bend, self.coupling);
        [
            b11 * s[0] + b12 * s[1] + c1 * s[2],
            b12 * s[0] + b22 * s[1] + c2 * s[2],
            c1 * s[0] + c2 * s[1] + self.twist * s[2],
        ]
    }
}

impl<D: StiffnessEntry> Stiffness<D> {
    /// The stiffnesses of joints as one stiffness in SIMD lanes: lane `k` has the numbers of `stiffness(&all[k])`.
    #[inline(always)]
    pub(crate) fn pack_lanes<V: SimdScalar<D>, L>(
        level: V::Level,
        all: &[L],
        stiffness: impl Fn(&L) -> &Self,
    ) -> Stiffness<V> {
        Stiffness {
            bend: [
                V::gather(level, |lane| stiffness(&all[lane]).bend[0]),
                V::gather(level, |lane| stiffness(&all[lane]).bend[1]),
                V::gather(level, |lane| stiffness(&all[lane]).bend[2]),
            ],
            twist: V::gather(level, |lane| stiffness(&all[lane]).twist),
            coupling: [
                V::gather(level, |lane| stiffness(&all[lane]).coupling[0]),
                V::gather(level, |lane| stiffness(&all[lane]).coupling[1]),
            ],
        }
    }

    /// The stiffness with every number converted to another type.
    #[inline]
    pub fn map<E: StiffnessEntry>(&self, mut convert: impl FnMut(D) -> E) -> Stiffness<E> {
        Stiffness::from_entries(|k| convert(self.entry(k)))
    }
}
