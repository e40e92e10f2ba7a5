//! Drag of a fluid on the nodes of a rod: forces (N), their derivatives by velocities (kg/s), and the transposed
//! derivatives for the adjoint.
//!
//! `u` is the velocity of a node relative to the fluid, `u_t = u.t` its component along the rod's unit tangent `t`,
//! `u_n` the vector across it. The force per length is
//!
//! ```text
//! -(a_n + b_n |u_n|) u_n - (a_t + b_t |u_t|) u_t t
//! ```
//!
//! with linear and quadratic coefficients `a`, kg/(m s), and `b`, kg/m^2. It is multiplied by the tributary length of
//! the node, m. The tangent is the direction from the node before to the node after, one-sided at the ends. The speeds
//! `|u|` are the roots of `u^2` plus [`STILL`]. `add_forces` and `add_slopes` add minus the drag and its derivatives,
//! as for a gradient. At a given tangent the derivative by the velocity is symmetric, with one block per node.
//! `tangents` overwrites a list with those of all nodes; the tangent is zero where both neighbors coincide. `is_none`
//! returns whether all coefficients are zero without derivatives, and `no_slopes` a zero [`DragSlopes`].
//! `add_transposed_slopes` adds the derivatives of `d . f`, with weights `d` and minus the drag `f`, by coefficients,
//! fluid velocity, lengths, velocities, and positions through the tangents.

use crate::numerics::scalar::Scalar;
use crate::numerics::tangent::Tangent;
use crate::numerics::vector::{Vector, add, components, dot, scale, sub};
use num_dual::Dual64;

/// Square of a speed, m^2/s^2 (1 micrometer per second), added under the root of every speed, so that quadratic drag is
/// smooth at rest. A larger value weakens quadratic drag at low speed; zero would divide by zero there.
const STILL: f64 = 1e-12;

/// Drag on the nodes of a rod.
#[derive(Clone, Debug)]
pub struct NodalDrag<D> {
    /// Linear and quadratic coefficients across the rod, kg/(m s) and kg/m^2.
    pub normal: [D; 2],
    /// Linear and quadratic coefficients along the rod, kg/(m s) and kg/m^2.
    pub tangential: [D; 2],
    /// Velocity of the fluid in the rod's axes, m/s.
    pub fluid: Vector<D>,
    /// The length that every node stands for, m.
    pub lengths: Vec<D>,
    /// Unknowns from one node to the next, and the number of them that are coordinates.
    pub unknowns: [usize; 2],
}

impl<D: Scalar> NodalDrag<D> {
    /// The coordinates of node `i` in a list `x` over all unknowns, such as positions or velocities. Components
    /// beyond the rod's axes (the third one in the plane) are zero.
    fn of_node(&self, x: &[D], i: usize) -> Vector<D> {
        let [stride, axes] = self.unknowns;
        components(|c| if c < axes { x[stride * i + c] } else { D::from(0.0) })
    }

    /// Overwrites `tangents` with the unit tangent at every node of a rod at `q`: the direction from the node before
    /// to the node after, one-sided at the ends. It is the zero vector where both coincide.
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

    /// Adds minus the drag on all nodes, N, at the given `tangents` and velocities `v`, m/s, to the entries of the
    /// coordinates in `out`.
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

    /// Adds to `matrix` the derivatives of [minus the drag](Self::add_forces) by the velocities, kg/s, times
    /// `factor`, at fixed tangents: a symmetric block for each node.
    pub fn add_slopes(
        &self,
        tangents: &[Vector<D>],
        v: &[D],
        factor: D,
        matrix: &mut impl Tangent<D>,
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

    /// The velocity of node `i` relative to the fluid, m/s, split into components along the tangent `t` and across
    /// it. Also its smoothed speeds, and the coefficients `a + b speed` across and along.
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

/// The velocity of a node relative to the fluid, split at the tangent, with the coefficients of drag.
struct Parts<D> {
    /// Velocity along the tangent, m/s.
    along: D,
    /// Velocity across the tangent, m/s.
    across: Vector<D>,
    /// Smoothed speeds across and along, m/s.
    speeds: [D; 2],
    /// Force per length and velocity across, kg/(m s).
    normal: D,
    /// Force per length and velocity along, kg/(m s).
    tangential: D,
}

/// The derivatives of a number by the coefficients, fluid velocity and node lengths of drag, each in the field of that
/// quantity.
pub type DragSlopes = NodalDrag<f64>;

impl NodalDrag<Dual64> {
    /// Whether all coefficients of drag are zero and have zero derivatives.
    pub fn is_none(&self) -> bool {
        self.normal.iter().chain(&self.tangential).all(|x| x.re == 0.0 && x.eps == 0.0)
    }
}

impl NodalDrag<f64> {
    /// A [`DragSlopes`] of zeros for this drag, to which derivatives of a number by its coefficients, fluid velocity
    /// and node lengths are added.
    pub fn no_slopes(&self) -> DragSlopes {
        let lengths = vec![0.0; self.lengths.len()];
        let (normal, tangential, fluid) = ([0.0; 2], [0.0; 2], [0.0; 3]);
        NodalDrag { normal, tangential, fluid, lengths, unknowns: self.unknowns }
    }

    /// Adds the derivatives of the number `d . f`, with given weights `d` of all unknowns and [minus the
    /// drag](Self::add_forces) `f` at positions `q`, m, and velocities `v`, m/s, by hand-derived formulas. Those by
    /// coefficients, fluid velocity and node lengths are added to `slopes`, those by positions, through the tangents,
    /// to `by_q`, those by velocities to `by_v`.
    pub fn add_transposed_slopes(
        &self,
        [q, v, d]: [&[f64]; 3],
        slopes: &mut DragSlopes,
        [by_q, by_v]: [&mut [f64]; 2],
    ) {
        let mut tangents = Vec::new();
        self.tangents(q, &mut tangents);
        let ([stride, axes], last) = (self.unknowns, self.lengths.len() - 1);
        for (i, t) in tangents.iter().enumerate() {
            let Parts { along, across, speeds, normal, tangential } = self.parts(t, v, i);
            let d = self.of_node(d, i);
            let [force_normal, force_along] = [dot(d, across), dot(d, *t) * along];
            // The force of a node is proportional to its length.
            slopes.lengths[i] += force_normal * normal + force_along * tangential;
            let length = self.lengths[i];
            let d = scale(d, length);
            let [by_normal, by_tangential] = [force_normal * length, force_along * length];
            // By the linear and quadratic coefficients: the quadratic part has the speed as a
            // factor.
            slopes.normal[0] += by_normal;
            slopes.normal[1] += by_normal * speeds[0];
            slopes.tangential[0] += by_tangential;
            slopes.tangential[1] += by_tangential * speeds[1];
            // By the velocity relative to the fluid, through its parts across and along the
            // tangent.
            let speeding = by_normal * self.normal[1] / speeds[0];
            let by_across = add(scale(d, normal), scale(across, speeding));
            let by_along = tangential * dot(d, *t)
                + by_tangential * self.tangential[1] * along / speeds[1]
                - dot(by_across, *t);
            let relative = add(across, scale(*t, along));
            let by_velocity = add(by_across, scale(*t, by_along));
            // By the tangent: across and along are projections on it.
            let by_tangent = add(
                scale(d, tangential * along),
                sub(scale(relative, by_along), scale(by_across, along)),
            );
            slopes.fluid = sub(slopes.fluid, by_velocity);
            // The tangent of a node is the unit chord between its neighbors: d t = (I - t
            // t')/|chord| d chord.
            let [a, b] = [i.saturating_sub(1), (i + 1).min(last)];
            let chord = sub(self.of_node(q, b), self.of_node(q, a));
            let size = dot(chord, chord).sqrt();
            let by_chord = match size > 0.0 {
                true => scale(sub(by_tangent, scale(*t, dot(*t, by_tangent))), size.recip()),
                false => by_tangent,
            };
            for c in 0..axes {
                by_v[stride * i + c] += by_velocity[c];
                by_q[stride * b + c] += by_chord[c];
                by_q[stride * a + c] -= by_chord[c];
            }
        }
    }
}
