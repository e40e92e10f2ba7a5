//! Drag of a fluid on the nodes of a rod.
//!
//! With the velocity `u` of a node relative to the fluid, its part `u_t = u.t` along the rod's tangent `t` and the
//! rest `u_n` across, the force per length is
//!
//! ```text
//! -(a_n + b_n |u_n|) u_n - (a_t + b_t |u_t|) u_t t
//! ```
//!
//! for linear and quadratic coefficients `a` and `b`. Of a given tangent its derivative by the velocity is
//! symmetric, a block for every node.

use crate::numerics::banded::BandMatrix;
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::{Vector, add, components, dot, scale, sub};

/// The square of a speed, m^2/s^2, below which quadratic drag is smooth.
const STILL: f64 = 1e-12;

/// Drag on the nodes of a rod.
#[derive(Clone, Debug)]
pub struct NodalDrag<D> {
    /// Linear and quadratic across the rod, kg/(m s) and kg/m^2.
    pub normal: [D; 2],
    /// The same along the rod.
    pub tangential: [D; 2],
    /// Velocity of the fluid in the rod's axes, m/s.
    pub fluid: Vector<D>,
    /// The length that every node stands for, m.
    pub lengths: Vec<D>,
    /// Unknowns from one node to the next, and those of them that are places.
    pub unknowns: [usize; 2],
}

impl<D: Scalar> NodalDrag<D> {
    /// The place or velocity of node `i`.
    fn of_node(&self, x: &[D], i: usize) -> Vector<D> {
        let [stride, axes] = self.unknowns;
        components(|c| if c < axes { x[stride * i + c] } else { D::from(0.0) })
    }

    /// Writes the tangents at all nodes of a rod that is at `q`: from the node before to the one after.
    pub fn tangents(&self, q: &[D], tangents: &mut Vec<Vector<D>>) {
        let last = self.lengths.len() - 1;
        tangents.clear();
        tangents.extend((0..=last).map(|i| {
            let chord =
                sub(self.of_node(q, (i + 1).min(last)), self.of_node(q, i.saturating_sub(1)));
            let squared = dot(chord, chord);
            // A rod folded onto itself has no direction there.
            if squared.value() > 0.0 { scale(chord, squared.sqrt().recip()) } else { chord }
        }));
    }

    /// Adds minus the forces, N, on nodes with these velocities.
    pub fn add_forces(&self, tangents: &[Vector<D>], v: &[D], out: &mut [D]) {
        let [stride, axes] = self.unknowns;
        for (i, t) in tangents.iter().enumerate() {
            let Parts { along, across, normal, tangential, .. } = self.parts(t, v, i);
            let force = add(scale(across, normal), scale(*t, tangential * along));
            for c in 0..axes {
                out[stride * i + c] += force[c] * self.lengths[i];
            }
        }
    }

    /// Adds the derivatives of [these](Self::add_forces) by the velocities, times `factor`, to a matrix.
    pub fn add_slopes<const W: usize>(
        &self,
        tangents: &[Vector<D>],
        v: &[D],
        factor: D,
        matrix: &mut BandMatrix<D, W>,
    ) {
        let [stride, axes] = self.unknowns;
        for (i, t) in tangents.iter().enumerate() {
            let Parts { along, across, speeds, normal, tangential } = self.parts(t, v, i);
            let on_axis = tangential + self.tangential[1] * along * along / speeds[1];
            let bulge = self.normal[1] / speeds[0];
            let weight = factor * self.lengths[i];
            let entry = |r: usize, c: usize| {
                let identity = if r == c { normal } else { D::from(0.0) };
                (identity + (on_axis - normal) * t[r] * t[c] + bulge * across[r] * across[c])
                    * weight
            };
            let row = |r: usize| [entry(r, 0), entry(r, 1), entry(r, 2)];
            let block = [row(0), row(1), row(2)];
            matrix.add_corner(stride * i, axes, &block);
        }
    }

    fn parts(&self, t: &Vector<D>, v: &[D], i: usize) -> Parts<D> {
        let relative = sub(self.of_node(v, i), self.fluid);
        let along = dot(relative, *t);
        let across = sub(relative, scale(*t, along));
        let speeds = [(dot(across, across) + STILL).sqrt(), (along * along + STILL).sqrt()];
        Parts {
            along,
            across,
            speeds,
            normal: self.normal[0] + self.normal[1] * speeds[0],
            tangential: self.tangential[0] + self.tangential[1] * speeds[1],
        }
    }
}

/// The velocity of a node relative to the fluid.
struct Parts<D> {
    along: D,
    across: Vector<D>,
    /// Across and along.
    speeds: [D; 2],
    /// Force by velocity, kg/(m s).
    normal: D,
    tangential: D,
}
