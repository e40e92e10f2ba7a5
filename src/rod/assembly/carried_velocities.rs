//! Derivatives of the velocities of carried nodes by the coordinates of bodies at the end of a time step.
//!
//! The velocity of a carried node is `J v`, with the derivatives `J` of its unknowns and the velocities `v` of the
//! coordinates. It changes with the coordinates through `v`, and through `J`, which turns with the body:
//!
//! ```text
//! plane:  d(J v) = J s dz + J' v dz
//! space:  V = R (w x a),    dV = R (phi x (w x a)) + R ((s T^-1 phi) x a)
//! ```
//!
//! `s` is the derivative of a velocity by its coordinate, 1/s, `w` the angular velocity in the axes of the body, rad/s,
//! `a` an arm, and `T` the tangent map of the rotation vector of the step, which changes by `T^-1 phi` with the
//! increment `phi`. Output is `d(J v) - s J phi`, the part that the unknowns of the node times `s` do not have. Damping
//! and friction of contacts depend on these velocities.

use crate::numerics::rotation::{column, components_of, inverse, tangent_map, times};
use crate::numerics::scalar::{RodScalar, Scalar};
use crate::numerics::vector::{add, cross, dot, scale};
use crate::rod::StepVelocities;
use crate::rod::assembly::attachment::Attachment;
use crate::rod::assembly::bodies::CarriedPosition;
use crate::rod::assembly::carrying::VelocitySlopes;
use crate::rod::assembly::frames::AssemblyFrames;
use crate::rod::assembly::spatial_bodies::SpatialBodies;

impl<D: Scalar> CarriedPosition<D> {
    /// The slopes of the velocity of this node, with the velocities `rates` of all body coordinates.
    pub(super) fn planar_velocity_slopes(&self, rates: &[D]) -> VelocitySlopes<D> {
        let mut slopes = [[D::from(0.0); 4]; 9];
        for k in 0..self.count {
            // Derivatives by one coordinate change with this one only.
            let rate = rates[self.coordinates[k]];
            (0..2).for_each(|c| slopes[k][c] = self.curvatures[k][c] * rate);
        }
        slopes
    }
}

impl<D: RodScalar> SpatialBodies<D> {
    /// Appends to `to` the slopes of each node of an attachment, at the coordinates `z` and velocities `rates` of all
    /// bodies.
    pub(super) fn spatial_velocity_slopes(
        &self,
        z: &[D],
        frames: &AssemblyFrames<D>,
        rates: StepVelocities<'_, D>,
        attachment: &Attachment<[D; 3]>,
        to: &mut Vec<VelocitySlopes<D>>,
    ) {
        let body = self.bodies[attachment.body].rotation.as_ref();
        let clamp = attachment.spring.map(|i| &self.springs[i].rotation);
        for node in &attachment.nodes {
            let edge = attachment.edge.as_ref().filter(|_| node.width > 3);
            let tangent = edge.map(|edge| edge.frame[0]);
            let mut slopes = [[D::from(0.0); 4]; 9];
            // The order of the coordinates of a carried node: center, rotation of the body, rotation of the clamp.
            let turns = [
                body.map(|turn| (turn, node.on_body, tangent.filter(|_| clamp.is_none()))),
                clamp.map(|turn| (turn, node.on_clamp, tangent)),
            ];
            let mut k = 3;
            for (turn, arm, tangent) in turns.into_iter().flatten() {
                let (by, axes) = (turn.length.recip(), turn.axes(z, frames));
                let spin = turn.of(rates.velocity).map(|rate| rate * by);
                let turning = cross(spin, arm);
                // The change of the angular velocity beyond `s phi`, by `phi`.
                let back = inverse(&tangent_map(turn.vector(z, frames)));
                let back = components_of(|i, j| {
                    let one = if i == j { D::from(1.0) } else { D::from(0.0) };
                    (back[i][j] - one) * rates.slope
                });
                for c in 0..3 {
                    let mut axis = [D::from(0.0); 3];
                    axis[c] = D::from(1.0);
                    let faster = column(&back, c);
                    let change = add(cross(axis, turning), cross(faster, arm));
                    let [x, y, z] = scale(times(&axes, change), D::from(by));
                    let angle = tangent.map_or(D::from(0.0), |tangent| dot(tangent, faster));
                    slopes[k + c] = [x, y, z, angle * by];
                }
                k += 3;
            }
            to.push(slopes);
        }
    }
}
