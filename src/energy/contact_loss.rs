//! Forces of a contact that depend on the velocity: damping of the normal force, and friction. On an edge, N.
//!
//! The normal force per length of a contact is, with the overlap `delta` and its rate `delta'`,
//!
//! ```text
//! k delta^2 max(0, 1 + c delta')
//! ```
//!
//! (Hunt and Crossley 1975): it dissipates impacts and never pulls. The part `k delta^2` is the [elastic
//! one](crate::energy::edge_contact), which is left out here. Friction opposes the velocity `w` of the surface of the
//! rod along the obstacle with
//!
//! ```text
//! mu |N| (2 - |w|/s) w/s    for |w| < s,      mu |N| w/|w|    beyond
//! ```
//!
//! where `N` is the normal force with damping: Coulomb's law beyond the slip velocity `s`. A rod that sticks creeps
//! below `s`. Near zero `|w|` is smoothed ([`STILL`]). The surface moves with the axis of the rod, and in space with
//! its spin: a rate `v` of the angle of an edge adds `v r t x n`, with the radius `r`, the tangent `t` and the normal
//! `n` towards the obstacle. The force acts there, and so has a moment about the axis. Four Gauss points integrate
//! along the part of the edge that overlaps the obstacle. The integrands are no polynomials, so that the ends of this
//! part have derivatives.
//!
//! Input: a contact with its numbers, unknowns and velocities of an edge. Output: minus the forces on these unknowns
//! (`forces`, N, N m for the angle), as for a gradient. Also their derivatives (`tangent`) by the unknowns at the end
//! of a step, on which the velocities depend linearly; they are computed in dual numbers and not symmetric. `touches`
//! is whether there is an overlap. `drag_over_slip` is the law of friction.

use crate::energy::autodiff::jacobian;
use crate::energy::edge_contact::{EdgeContact, GAUSS};
use crate::energy::overlap::EdgePart;
use crate::numerics::scalar::{RodScalar, Scalar};
use crate::numerics::vector::{Vector, add, cross, dot, scale, sub, unit};
use crate::scene::contact::ContactLoss;

/// Part of the slip velocity that is added to the speed, as the root of the sum of squares: friction is smooth at rest.
const STILL: f64 = 1e-3;

/// Friction over that of Coulomb's law and over the `slip`, the velocity along the surface, m/s; s/m.
pub(crate) fn drag_over_slip<D: Scalar>(slip: Vector<D>, slip_velocity: D) -> D {
    let still = slip_velocity * STILL;
    let speed = (dot(slip, slip) + still * still).sqrt();
    match speed.value() < slip_velocity.value() {
        true => (-(speed / slip_velocity) + 2.0) / slip_velocity,
        false => speed.recip(),
    }
}

/// Contact of a part of an edge with an obstacle, with the numbers of its losses.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LossyContact<'a, D> {
    pub contact: EdgeContact<'a, D>,
    pub loss: ContactLoss<D>,
}

/// Positions or velocities of both nodes of an edge from the list of `U` values of its unknowns, with `A` coordinates
/// of each node; the third coordinate in a plane is zero.
fn ends<D: Scalar, const A: usize, const U: usize>(x: &[D; U]) -> [Vector<D>; 2] {
    let mut ends = [[D::from(0.0); 3]; 2];
    for c in 0..A {
        (ends[0][c], ends[1][c]) = (x[c], x[U - A + c]);
    }
    ends
}

impl<D: Scalar> LossyContact<'_, D> {
    /// Whether the edge with the unknowns `q` touches the obstacle: its overlap with a surface is positive somewhere.
    pub fn touches<const A: usize, const U: usize>(&self, q: &[D; U]) -> bool {
        let (edge, nodes) = (&self.contact.edge, ends::<D, A, U>(q));
        !edge.is_apart(nodes)
            && (0..edge.surfaces()).any(|k| {
                let (overlap, bounds) = edge.surface(k, nodes);
                overlap.along(nodes).positive_part(bounds).is_some()
            })
    }

    /// Minus the damping and friction forces, N (N m for the angle), on the unknowns `q` of an edge with the velocities
    /// `v`; zero without an overlap. Nodes have `A` coordinates; in space the angle follows those of the first node.
    pub fn forces<const A: usize, const U: usize>(&self, q: &[D; U], v: &[D; U]) -> [D; U] {
        let (nodes, velocities) = (ends::<D, A, U>(q), ends::<D, A, U>(v));
        let (contact, ContactLoss { damping, friction, slip_velocity }) =
            (&self.contact, self.loss);
        let has_spin = U > 2 * A;
        let tangent = unit(sub(nodes[1], nodes[0]));
        let mut forces = [D::from(0.0); U];
        for k in 0..contact.edge.surfaces() {
            let (overlap, bounds) = contact.edge.surface(k, nodes);
            let along = overlap.along(nodes);
            let Some([from, to]) = along.moving_part(bounds) else { continue };
            for [point, weight] in GAUSS {
                let t = from + (to - from) * point;
                let shares = [-t + 1.0, t];
                let mix = |[a, b]: [Vector<D>; 2]| add(scale(a, shares[0]), scale(b, shares[1]));
                let (delta, slope, velocity) =
                    (along.at_moving(t), mix(along.slopes), mix(velocities));
                let part = contact.edge.part.length * (to - from) * weight;
                let elastic = contact.stiffness * part * delta * delta;
                let factor = damping * dot(slope, velocity) + 1.0;
                let factor = if factor.value() > 0.0 { factor } else { D::from(0.0) };
                let size = dot(slope, slope).sqrt();
                let normal = scale(slope, size.recip());
                // Velocity of the surface along the obstacle.
                let arm = scale(cross(tangent, normal), contact.edge.part.radius);
                let mut slip = sub(velocity, scale(normal, dot(velocity, normal)));
                if has_spin {
                    slip = add(slip, scale(arm, v[A]));
                }
                let direction = drag_over_slip(slip, slip_velocity);
                let drag = scale(slip, friction * elastic * factor * size * direction);
                let force = add(scale(slope, elastic * (factor - 1.0)), drag);
                for c in 0..A {
                    forces[c] += force[c] * shares[0];
                    forces[U - A + c] += force[c] * shares[1];
                }
                if has_spin {
                    forces[A] += dot(arm, drag);
                }
            }
        }
        forces
    }
}

impl<D: RodScalar> LossyContact<'_, D> {
    /// Derivatives of [`forces`](Self::forces) by the `U` unknowns of an edge, N/m (N or N m for the angle). The edge
    /// has two nodes with `A` coordinates each (2 in a plane, 3 in space), and in space an angle. Each velocity has the
    /// derivative `rate`, 1/s, by its unknown.
    pub fn tangent<const A: usize, const U: usize>(
        &self,
        q: &[D; U],
        v: &[D; U],
        rate: D,
    ) -> [[D; U]; U] {
        jacobian(
            |over, unknowns| {
                let unknowns: &[_; U] = unknowns.first_chunk().expect("as many as were given");
                let EdgePart { obstacle, part } = self.contact.edge;
                let (obstacle, part) = (obstacle.map(over), part.map(over));
                let edge = EdgePart { obstacle: &obstacle, part: &part };
                let contact = EdgeContact { edge, stiffness: over(self.contact.stiffness) };
                let mut velocities = v.map(over);
                for i in 0..U {
                    velocities[i] += (unknowns[i] - over(q[i])) * over(rate);
                }
                let loss = self.loss.map(over);
                LossyContact { contact, loss }.forces::<A, U>(unknowns, &velocities)
            },
            q,
        )
    }
}

#[cfg(test)]
mod tests;
