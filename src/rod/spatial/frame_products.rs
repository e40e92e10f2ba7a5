//! Products of the geometry of a spatial rod with derivatives of its reference frames, forward and transposed.
//!
//! The director of an edge follows the tangent `t` from its reference `t_ref` by parallel transport. It turns by
//! `g.dx` when the edge of length `l` changes by `dx` (see [`bend_twist`](crate::energy::bend_twist)). Transport from
//! `t` to `t_ref` is the inverse, so that it turns by `l g.dt_ref` when the reference changes. Besides the change of
//! its tangent the derivative of an edge's frame is therefore one number for each parameter: the turn of its
//! directors about the tangent.
//!
//! Output: derivatives of the gradient (N) along those of the frames, derivatives of the frames after a step, and the
//! transposes of both for the adjoint.

use crate::numerics::directions::{Directions, dot as lanes_dot};
use crate::numerics::vector::{Vector, add, cross, dot, scale, sub};
use crate::rod::edges::STRIDE;
use crate::rod::frames::{FrameRate, RodGeometry};
use crate::rod::layout::{Layout, Space};
use crate::rod::spatial::geometry::{Geometry, SpatialEdgeGeometry, SpatialJointGeometry, edge};

/// The cross product `a x b` of a vector of plain numbers and a vector of lanes.
#[inline(always)]
fn lanes_cross<const G: usize>(a: &Vector<f64>, b: &[Directions<G>; 3]) -> [Directions<G>; 3] {
    [b[2] * a[1] - b[1] * a[2], b[0] * a[2] - b[2] * a[0], b[1] * a[0] - b[0] * a[1]]
}

/// Adds derivatives of a number by the turn and the tangent of a frame to `frame`.
fn add_frame(frame: &mut FrameRate<1>, turn: f64, tangent: Vector<f64>) {
    frame.turn.0[0] += turn;
    for (to, from) in frame.tangent.iter_mut().zip(tangent) {
        to.0[0] += from;
    }
}

impl RodGeometry for Geometry {
    /// Sets the lists to `edges` edges and `edges - 1` joints; new entries are zero.
    fn resize(&mut self, edges: usize) {
        self.edges.resize(edges, SpatialEdgeGeometry::default());
        self.joints.resize(edges - 1, SpatialJointGeometry::default());
    }

    /// The axial strains of the edges.
    fn edge_strains(&self) -> impl Iterator<Item = f64> {
        self.edges.iter().map(|edge| edge.strain)
    }

    /// Two curvatures and the twist of each joint, one joint after the other.
    fn joint_strains(&self) -> impl Iterator<Item = f64> {
        self.joints.iter().flat_map(|joint| joint.strains)
    }

    /// Overwrites the entries of angles in `angles`, rad, with the turns of the directors that follow from the
    /// derivatives of the frames: `turn + l g.dt_ref`. Adds to `out`, N, the derivatives of the gradient by the change
    /// of `g` itself, from the torques in `gradient`. The product of the tangent with `angles` is left to the caller.
    #[inline(always)]
    fn add_frame_forces<const G: usize>(
        &self,
        frames: &[FrameRate<G>],
        gradient: &[f64],
        angles: &mut [[f64; G]],
        out: &mut [[f64; G]],
    ) {
        let count = self.edges.len();
        let (edges, frames) = (&self.edges[..count], &frames[..count]);
        let mut carried = [Directions::ZERO; 3];
        for j in 0..count {
            let (edge, rate) = (&edges[j], &frames[j]);
            let own: &mut [[f64; G]; STRIDE] =
                angles[STRIDE * j..].first_chunk_mut().expect("an edge's first node");
            own[3] = (rate.turn + lanes_dot(&edge.follow, &rate.tangent) * edge.length).0;
            // g = t x t_ref / (l (1 + t.t_ref))
            let torque = gradient[STRIDE * j + 3] * edge.by_chi;
            let sideways = torque * edge.inverse_length;
            let along = lanes_dot(&edge.tangent, &rate.tangent) * torque;
            let turned = lanes_cross(&edge.tangent, &rate.tangent);
            let node: &mut [[f64; G]; STRIDE] =
                out[STRIDE * j..].first_chunk_mut().expect("an edge's first node");
            for c in 0..3 {
                let force = turned[c] * sideways - along * edge.follow[c];
                node[c] = (Directions(node[c]) + carried[c] - force).0;
                carried[c] = force;
            }
        }
        for c in 0..3 {
            let last = &mut out[STRIDE * count + c];
            *last = (Directions(*last) + carried[c]).0;
        }
    }

    /// Replaces the derivatives of the frames before a step by those after it, when the frames move to this geometry.
    /// `q` are the derivatives of the unknowns there. With the edge's derivative `e`, the turn grows by
    /// `g.(l dt_ref + e)`, and the tangent's derivative becomes that of `e/|e|`.
    #[inline(always)]
    fn move_frame_rates<const G: usize>(&self, frames: &mut [FrameRate<G>], q: &[[f64; G]]) {
        for (j, (measured, rate)) in self.edges.iter().zip(frames).enumerate() {
            let e = edge(q, j);
            let along = lanes_dot(&measured.tangent, &e);
            let SpatialEdgeGeometry { length, inverse_length, tangent, follow, .. } = measured;
            for c in 0..3 {
                // Both ends of the transport move: the old reference by its rate, the new one with the edge.
                rate.turn += (rate.tangent[c] * *length + e[c]) * follow[c];
                rate.tangent[c] = (e[c] - along * tangent[c]) * *inverse_length;
            }
        }
    }

    /// Adds to `frames` the derivatives of a number by the frames that follow from its derivatives by the `angles` of
    /// the edges (a list of all unknowns): the same by `turn`, and times `l g` by the reference tangent.
    fn turn_frames(&self, angles: &[f64], frames: &mut [FrameRate<1>]) {
        for (j, (measured, frame)) in self.edges.iter().zip(frames).enumerate() {
            let turn = angles[STRIDE * j + 3];
            add_frame(frame, turn, scale(measured.follow, measured.length * turn));
        }
    }

    /// The transpose of `add_frame_rates`: adds to `frames` the derivatives of a number by the frames. `d` are its
    /// derivatives by the forces, `stiff` is the product of the tangent with `d`, `gradient` has the torques at this
    /// geometry.
    fn add_to_frames(
        &self,
        gradient: &[f64],
        d: &[f64],
        stiff: &[f64],
        frames: &mut [FrameRate<1>],
    ) {
        // The tangent is symmetric: the transposed product with the angles is that with `d`.
        self.turn_frames(stiff, frames);
        for (j, (measured, frame)) in self.edges.iter().zip(frames).enumerate() {
            let SpatialEdgeGeometry { tangent, follow, by_chi, inverse_length, .. } = measured;
            let torque = gradient[STRIDE * j + 3] * by_chi;
            let e = Space::edge(d, j);
            let turned = scale(cross(e, *tangent), torque * inverse_length);
            let along = scale(*tangent, torque * dot(*follow, e));
            add_frame(frame, 0.0, sub(turned, along));
        }
    }

    /// The transpose of `move_frame_rates`: replaces the derivatives of a number by the frames after their move by
    /// those before it. Adds the part by the unknowns to the coordinates of both nodes of each edge in `q`.
    fn move_frames_back(&self, frames: &mut [FrameRate<1>], q: &mut [f64]) {
        for (j, (measured, frame)) in self.edges.iter().zip(frames).enumerate() {
            let SpatialEdgeGeometry { length, inverse_length, tangent, follow, .. } = measured;
            let (turn, by) = (frame.turn.0[0], frame.tangent.map(|x| x.0[0]));
            // Transpose of the projection across the edge: a unit tangent has no change along itself.
            let across = sub(by, scale(*tangent, dot(by, *tangent)));
            let e = add(scale(*follow, turn), scale(across, *inverse_length));
            for c in 0..3 {
                q[STRIDE * j + c] -= e[c];
                q[STRIDE * (j + 1) + c] += e[c];
                frame.tangent[c] = Directions([follow[c] * length * turn]);
            }
        }
    }
}
