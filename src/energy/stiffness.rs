//! What resists the bending and twisting of a joint.

use crate::numerics::scalar::Scalar;

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

    /// Converts every number.
    pub fn map<E>(&self, mut convert: impl FnMut(D) -> E) -> Stiffness<E> {
        Stiffness {
            bend: self.bend.map(&mut convert),
            twist: convert(self.twist),
            coupling: self.coupling.map(&mut convert),
        }
    }
}
