//! What resists the bending and twisting of a joint.

use crate::numerics::scalar::{Scalar, SimdScalar};
use crate::numerics::vector::{components, map_components};

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

impl<D: Scalar> Stiffness<D> {
    /// As many as there are lanes, of joints that have them.
    #[inline(always)]
    pub(crate) fn side_by_side<V: SimdScalar<D>, T>(
        level: V::Level,
        all: &[T],
        of: impl Fn(&T) -> &Self,
    ) -> Stiffness<V> {
        Stiffness {
            bend: [
                V::gather(level, |lane| of(&all[lane]).bend[0]),
                V::gather(level, |lane| of(&all[lane]).bend[1]),
                V::gather(level, |lane| of(&all[lane]).bend[2]),
            ],
            twist: V::gather(level, |lane| of(&all[lane]).twist),
            coupling: [
                V::gather(level, |lane| of(&all[lane]).coupling[0]),
                V::gather(level, |lane| of(&all[lane]).coupling[1]),
            ],
        }
    }

    /// Applied to three strains.
    #[inline(always)]
    pub(crate) fn times(&self, s: &[D; 3]) -> [D; 3] {
        let ([b11, b12, b22], [c1, c2]) = (self.bend, self.coupling);
        [
            b11 * s[0] + b12 * s[1] + c1 * s[2],
            b12 * s[0] + b22 * s[1] + c2 * s[2],
            c1 * s[0] + c2 * s[1] + self.twist * s[2],
        ]
    }

    /// The sum of two.
    #[inline]
    pub(crate) fn plus(&self, other: &Self) -> Self {
        Self {
            bend: components(|k| self.bend[k] + other.bend[k]),
            twist: self.twist + other.twist,
            coupling: components(|k| self.coupling[k] + other.coupling[k]),
        }
    }

    /// With factors of what couples bending and twisting, of bending and of twisting.
    #[inline]
    pub(crate) fn by_kind(&self, coupling: D, [bend, twist]: [D; 2]) -> Self {
        Self {
            bend: map_components(&self.bend, |k| k * bend),
            twist: self.twist * twist,
            coupling: map_components(&self.coupling, |k| k * coupling),
        }
    }

    /// The strains that three stresses make, by Cholesky's elimination.
    pub(crate) fn inverse_times(&self, w: &[D; 3]) -> [D; 3] {
        let ([b11, b12, b22], [c1, c2]) = (self.bend, self.coupling);
        let (l21, l31) = (b12 / b11, c1 / b11);
        let d2 = b22 - l21 * b12;
        let l32 = (c2 - l31 * b12) / d2;
        let d3 = self.twist - l31 * c1 - l32 * (c2 - l31 * b12);
        let y2 = w[1] - l21 * w[0];
        let y3 = w[2] - l31 * w[0] - l32 * y2;
        let x3 = y3 / d3;
        let x2 = y2 / d2 - l32 * x3;
        [w[0] / b11 - l21 * x2 - l31 * x3, x2, x3]
    }

    /// Converts every number.
    #[inline]
    pub fn map<E>(&self, mut convert: impl FnMut(D) -> E) -> Stiffness<E> {
        let ([b11, b12, b22], [c1, c2]) = (self.bend, self.coupling);
        Stiffness {
            bend: [convert(b11), convert(b12), convert(b22)],
            twist: convert(self.twist),
            coupling: [convert(c1), convert(c2)],
        }
    }
}
