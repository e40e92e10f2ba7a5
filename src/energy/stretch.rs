//! Stretching of one edge in the plane: the simplest element, and the one to read first.
//!
//! Energy (Eq. 1a): `E = 1/2 EA (eps - eps_natural)^2 l`, with rest length `l` and strain
//! `eps = |e|/l - 1`. The strain is computed as `(e.e - l^2) / (l (|e| + l))`, which loses no
//! digits when the edge is nearly at rest.

use super::{Element, Local};
use crate::scalar::Scalar;
use num_dual::Dual64;

/// One edge. Unknowns: `[x0, y0, x1, y1]`, m.
#[derive(Clone, Copy, Debug)]
pub struct Stretch<D> {
    /// Axial stiffness EA, N.
    pub stiffness: D,
    /// Rest length, m.
    pub rest_length: D,
    /// Strain at which the edge is free of stress; zero but for viscous steps.
    pub natural_strain: D,
}

/// What force and Hessian share: strain, 1/|e| and the unit tangent.
struct Stretched<D> {
    strain: D,
    inverse_length: D,
    tangent: [D; 2],
}

impl<D: Scalar> Stretch<D> {
    /// Strain, dimensionless.
    #[inline]
    pub fn strain(&self, q: &[D; 4]) -> D {
        let [ex, ey] = [q[2] - q[0], q[3] - q[1]];
        let squared = ex * ex + ey * ey;
        self.strain_of(squared, squared.sqrt())
    }

    /// The same edge with Kelvin-Voigt stress over one step: see [`crate::newmark`].
    #[inline]
    pub fn viscous(&self, factor: D, shift: D) -> Self {
        Self {
            stiffness: self.stiffness * factor,
            natural_strain: (self.natural_strain + shift) / factor,
            ..*self
        }
    }

    #[inline]
    fn strain_of(&self, squared: D, length: D) -> D {
        let rest = self.rest_length;
        (squared - rest * rest) / (rest * (length + rest))
    }

    #[inline]
    fn stretched(&self, q: &[D; 4]) -> Stretched<D> {
        let [ex, ey] = [q[2] - q[0], q[3] - q[1]];
        let squared = ex * ex + ey * ey;
        let length = squared.sqrt();
        let inverse_length = length.recip();
        Stretched {
            strain: self.strain_of(squared, length),
            inverse_length,
            tangent: [ex * inverse_length, ey * inverse_length],
        }
    }
}

impl<D: Scalar> Element<D, 4> for Stretch<D> {
    const NAME: &'static str = "stretch";
    type Over<E: Scalar> = Stretch<E>;

    fn map<E: Scalar>(&self, convert: impl Fn(D) -> E) -> Stretch<E> {
        Stretch {
            stiffness: convert(self.stiffness),
            rest_length: convert(self.rest_length),
            natural_strain: convert(self.natural_strain),
        }
    }

    #[inline]
    fn energy(&self, q: &[D; 4]) -> D {
        let strain = self.strain(q) - self.natural_strain;
        self.stiffness * self.rest_length * strain * strain * 0.5
    }

    /// The force `F = EA (eps - eps_natural)` pulls along the tangent `t`: dE/de = F t.
    #[inline]
    fn gradient(&self, q: &[D; 4]) -> [D; 4] {
        let Stretched { strain, tangent: [tx, ty], .. } = self.stretched(q);
        let force = self.stiffness * (strain - self.natural_strain);
        [-(force * tx), -(force * ty), force * tx, force * ty]
    }

    /// d2E/de2 = (EA/l - F/|e|) t t' + F/|e| I.
    #[inline]
    fn tangent(&self, q: &[D; 4]) -> Local<D, 4> {
        let Stretched { strain, inverse_length, tangent: [tx, ty] } = self.stretched(q);
        let strain = strain - self.natural_strain;
        let force = self.stiffness * strain;
        let across = force * inverse_length;
        let along = self.stiffness / self.rest_length - across;
        let (xx, xy, yy) = (along * tx * tx + across, along * tx * ty, along * ty * ty + across);
        Local {
            energy: force * strain * self.rest_length * 0.5,
            gradient: [-(force * tx), -(force * ty), force * tx, force * ty],
            hessian: [
                [xx, xy, -xx, -xy],
                [xy, yy, -xy, -yy],
                [-xx, -xy, xx, xy],
                [-xy, -yy, xy, yy],
            ],
        }
    }

    /// Only the force depends on stiffness and natural strain; the rest length is a given.
    #[inline]
    fn gradient_rate(element: &Stretch<Dual64>, q: &[f64; 4]) -> [f64; 4] {
        let at_rest = Stretch {
            stiffness: element.stiffness.re,
            rest_length: element.rest_length.re,
            natural_strain: element.natural_strain.re,
        };
        let Stretched { strain, tangent: [tx, ty], .. } = at_rest.stretched(q);
        let rate = (element.stiffness * (element.natural_strain * -1.0 + strain)).eps;
        [-rate * tx, -rate * ty, rate * tx, rate * ty]
    }
}
