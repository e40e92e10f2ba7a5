//! Forces between two edges of rods in contact that depend on the velocity: damping of the normal force, and friction.
//!
//! The laws are those of [`contact_loss`](crate::energy::contact_loss), along the parts of both edges that touch
//! ([`edge_pair`](crate::energy::edge_pair)). With the point `x` of one edge, the nearest point `y` of the other and `w
//! = x - y`, the overlap has the rate `-w.(x' - y')/D`. The contact point divides `w` by the ratio of the radii. An
//! edge `e` with the spin `v` moves there, at the vector `a` from its axis, with
//!
//! ```text
//! V = x' + W x a      W = e x e'/(e.e) + v e/|e|
//! ```
//!
//! The angular velocity `W` is that of the edge, so that a rigid motion of both edges has no slip. Forces on both edges
//! are equal and opposite at the contact point, and act on the unknowns by the transposed equations (virtual work).
//! Linear and angular momentum of both edges are therefore conserved to rounding errors. In a plane edges have no spin.
//!
//! Input: the pair and the numbers of its losses, and unknowns and velocities of both edges, those of the first edge
//! first. Output: minus the forces on these unknowns (`forces`, N, N m for angles), and their derivatives by the
//! unknowns at the end of a step (`tangent`), in dual numbers and not symmetric. `touches` is whether there is an
//! overlap.

use crate::energy::autodiff::jacobian;
use crate::energy::contact_loss::drag_over_slip;
use crate::energy::edge_contact::GAUSS;
use crate::energy::edge_pair::{EdgeNodes, EdgePair};
use crate::numerics::scalar::{RodScalar, Scalar};
use crate::numerics::vector::{Vector, add, combine, cross, dot, norm, scale, sub, unit};
use crate::scene::contact::ContactLoss;

/// Contact of two edges, with the numbers of its losses.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LossyPair<D> {
    pub pair: EdgePair<D>,
    pub loss: ContactLoss<D>,
}

/// An edge that moves.
struct MovingEdge<D> {
    nodes: EdgeNodes<D>,
    /// Velocities of the nodes, m/s.
    velocities: [Vector<D>; 2],
    /// From the first node to the second, m.
    edge: Vector<D>,
    /// Unit tangent; none without an angle.
    tangent: Option<Vector<D>>,
    /// Angular velocity, rad/s.
    rotation: Vector<D>,
}

impl<D: Scalar> MovingEdge<D> {
    /// The edge with these unknowns and velocities: `A` coordinates of each node, and in space an angle between them.
    fn new<const A: usize>(q: &[D], v: &[D]) -> Self {
        let ends = |x: &[D]| {
            let mut ends = [[D::from(0.0); 3]; 2];
            ends[0][..A].copy_from_slice(&x[..A]);
            ends[1][..A].copy_from_slice(&x[x.len() - A..]);
            ends
        };
        let (nodes, velocities) = (ends(q), ends(v));
        let edge = sub(nodes[1], nodes[0]);
        let tangent = (q.len() > 2 * A).then(|| unit(edge));
        let turning = cross(edge, sub(velocities[1], velocities[0]));
        let mut rotation = scale(turning, dot(edge, edge).recip());
        if let Some(tangent) = tangent {
            rotation = add(rotation, scale(tangent, v[A]));
        }
        Self { nodes, velocities, edge, tangent, rotation }
    }

    /// The point at the fraction `t`, m.
    fn point(&self, t: D) -> Vector<D> {
        combine(-t + 1.0, self.nodes[0], t, self.nodes[1])
    }

    /// The velocity of the point of the axis at the fraction `t`, m/s.
    fn velocity(&self, t: D) -> Vector<D> {
        combine(-t + 1.0, self.velocities[0], t, self.velocities[1])
    }

    /// Adds a `force` on the point at the fraction `t`, at the distance `arm` from the axis, to those on the unknowns.
    fn add_force<const A: usize>(&self, t: D, arm: Vector<D>, force: Vector<D>, to: &mut [D]) {
        let moment = cross(arm, force);
        let couple = scale(cross(moment, self.edge), dot(self.edge, self.edge).recip());
        let last = to.len() - A;
        for c in 0..A {
            to[c] += force[c] * (-t + 1.0) - couple[c];
            to[last + c] += force[c] * t + couple[c];
        }
        if let Some(tangent) = self.tangent {
            to[A] += dot(tangent, moment);
        }
    }
}

impl<D: Scalar> LossyPair<D> {
    /// Whether the edges with the unknowns `q` touch, with `A` coordinates of each node.
    pub fn touches<const A: usize, const P: usize>(&self, q: &[D; P]) -> bool {
        let (first, second) = q.split_at(P / 2);
        let nodes = [first, second].map(|own| MovingEdge::new::<A>(own, own).nodes);
        self.pair.touches(nodes)
    }

    /// Minus the damping and friction forces, N (N m for angles), on the `P` unknowns `q` of both edges with the
    /// velocities `v`; zero without an overlap. Nodes have `A` coordinates; in space the angle of an edge follows those
    /// of its first node.
    pub fn forces<const A: usize, const P: usize>(&self, q: &[D; P], v: &[D; P]) -> [D; P] {
        let ((q, more), (v, faster)) = (q.split_at(P / 2), v.split_at(P / 2));
        let edges = [MovingEdge::new::<A>(q, v), MovingEdge::new::<A>(more, faster)];
        let mut forces = [D::from(0.0); P];
        for (own, other) in [(0, 1), (1, 0)] {
            let nodes = [edges[own].nodes, edges[other].nodes];
            self.pair.for_each_part(own, nodes, |part| {
                let Some([from, to]) = part.along.moving_part(part.limits) else { return };
                let stiffness = self.pair.stiffness * self.pair.lengths[own] * (0.5 * part.sign);
                for [point, weight] in GAUSS {
                    let t = from + (to - from) * point;
                    let s = part.nearest[0] * (-t + 1.0) + part.nearest[1] * t;
                    let delta = part.along.at_moving(t);
                    let elastic = stiffness * delta * delta * (to - from) * weight;
                    let moving = [&edges[own], &edges[other]];
                    let SurfaceForce { force, arms } =
                        self.surface_force(moving, [t, s], self.pair.radii[own], elastic);
                    let (first, second) = forces.split_at_mut(P / 2);
                    let [ours, theirs] = if own == 0 { [first, second] } else { [second, first] };
                    edges[own].add_force::<A>(t, arms[0], force, ours);
                    edges[other].add_force::<A>(s, arms[1], scale(force, D::from(-1.0)), theirs);
                }
            });
        }
        forces
    }

    /// Minus the force on the first edge, N, at these fractions of both edges. The radius of the first rod is `radius`,
    /// m. `elastic` is the elastic force at a distance of the axes equal to the sum of the radii, N.
    fn surface_force(
        &self,
        [own, other]: [&MovingEdge<D>; 2],
        [t, s]: [D; 2],
        radius: D,
        elastic: D,
    ) -> SurfaceForce<D> {
        let ContactLoss { damping, friction, slip_velocity } = self.loss;
        let way = sub(other.point(s), own.point(t));
        let distance = norm(way);
        let normal = scale(way, distance.recip());
        // The gradient of the overlap by the point of the first edge is `size normal`.
        let size = distance / (self.pair.radii[0] + self.pair.radii[1]);
        let arm = scale(normal, radius * size);
        let arms = [arm, sub(arm, way)];
        let apart = sub(own.velocity(t), other.velocity(s));
        let factor = damping * size * dot(normal, apart) + 1.0;
        let factor = if factor.value() > 0.0 { factor } else { D::from(0.0) };
        let turning = sub(cross(own.rotation, arms[0]), cross(other.rotation, arms[1]));
        let slip = add(sub(apart, scale(normal, dot(apart, normal))), turning);
        let coulomb = friction * elastic * factor * size;
        let drag = scale(slip, coulomb * drag_over_slip(slip, slip_velocity));
        SurfaceForce { force: add(scale(normal, elastic * (factor - 1.0) * size), drag), arms }
    }
}

/// Minus the force of a contact point on the first of two edges.
struct SurfaceForce<D> {
    /// The force, N.
    force: Vector<D>,
    /// From the axes of both edges to the contact point, m.
    arms: [Vector<D>; 2],
}

impl<D: RodScalar> LossyPair<D> {
    /// Derivatives of [`forces`](Self::forces) by the `P` unknowns of both edges, N/m (N or N m for angles): rows are
    /// forces. Each velocity has the derivative `rate`, 1/s, by its unknown.
    pub fn tangent<const A: usize, const P: usize>(
        &self,
        q: &[D; P],
        v: &[D; P],
        rate: D,
    ) -> [[D; P]; P] {
        jacobian(
            |over, unknowns| {
                let unknowns: &[_; P] = unknowns.first_chunk().expect("as many as were given");
                let mut velocities = v.map(over);
                for i in 0..P {
                    velocities[i] += (unknowns[i] - over(q[i])) * over(rate);
                }
                let lossy = LossyPair { pair: self.pair.map(over), loss: self.loss.map(over) };
                lossy.forces::<A, P>(unknowns, &velocities)
            },
            q,
        )
    }
}

#[cfg(test)]
mod tests;
