//! Products of the geometry of a spatial rod with derivatives of its reference frames, forward and transposed.
//!
//! The director of an edge follows the tangent `t` from its reference `t_ref` by parallel transport. It turns by `g.dx`
//! when the edge of length `l` changes by `dx` (see [`bend_twist`](crate::energy::bend_twist)). Transport from `t` to
//! `t_ref` is the inverse, so that it turns by `l g.dt_ref` when the reference changes. Besides the change of its
//! tangent the derivative of an edge's frame is therefore one number for each parameter: the turn of its directors
//! about the tangent.
//!
//! Output: derivatives of the gradient (N) along those of the frames, derivatives of the frames after a step, and the
//! transposes of both for the adjoint.

use crate::numerics::lanes::{Lanes, dot as lanes_dot};
use crate::numerics::simd::with_simd_if_wide;
use crate::numerics::tangent::Tangent;
use crate::numerics::vector::{Vector, add, cross, dot, scale, sub};
use crate::rod::edges::STRIDE;
use crate::rod::frames::{FrameRate, RodGeometry};
use crate::rod::layout::{Layout, Space};
use crate::rod::spatial::geometry::{Geometry, SpatialEdgeGeometry, SpatialJointGeometry};
use crate::rod::spatial::rates::edge;

/// The cross product `a x b` of a vector of plain numbers and a vector of lanes.
#[inline(always)]
fn lanes_cross<const G: usize>(a: &Vector<f64>, b: &[Lanes<G>; 3]) -> [Lanes<G>; 3] {
    [b[2] * a[1] - b[1] * a[2], b[0] * a[2] - b[2] * a[0], b[1] * a[0] - b[0] * a[1]]
}

/// The arguments of [`add_frame_rates`](RodGeometry::add_frame_rates), as work for a vector unit.
struct FrameChange<'a, T, const G: usize> {
    frames: &'a [FrameRate<G>],
    geometry: &'a Geometry,
    gradient: &'a [f64],
    tangent: &'a T,
    out: &'a mut [[f64; G]],
}

impl<T: Tangent<f64>, const G: usize> pulp::NullaryFnOnce for FrameChange<'_, T, G> {
    type Output = ();

    /// Adds the derivatives of the gradient: the directors turn as by a change of the angle, and the turn depends on
    /// the edge vector.
    #[inline(always)]
    fn call(self) {
        let Self { frames, geometry, gradient, tangent, out } = self;
        for (j, (edge, rate)) in geometry.edges.iter().zip(frames).enumerate() {
            let theta = STRIDE * j + 3;
            let psi = rate.turn + lanes_dot(&edge.follow, &rate.tangent) * edge.length;
            tangent.add_column(theta, psi.0, out);
            // g = t x t_ref / (l (1 + t.t_ref))
            let torque = gradient[theta];
            let sideways = torque * edge.by_chi * edge.inverse_length;
            let along = lanes_dot(&edge.tangent, &rate.tangent) * (torque * edge.by_chi);
            let turned = lanes_cross(&edge.tangent, &rate.tangent);
            for c in 0..3 {
                let force = turned[c] * sideways - along * edge.follow[c];
                let (before, after) = (STRIDE * j + c, STRIDE * (j + 1) + c);
                out[before] = (Lanes(out[before]) - force).0;
                out[after] = (Lanes(out[after]) + force).0;
            }
        }
    }
}

/// Adds derivatives of a number by the turn and the tangent of a frame to `frame`.
fn add_frame(frame: &mut FrameRate<1>, turn: f64, tangent: Vector<f64>) {
    frame.turn.0[0] += turn;
    for (to, from) in frame.tangent.iter_mut().zip(tangent) {
        to.0[0] += from;
    }
}

impl RodGeometry for Geometry {
    /// Sets the lists to so many edges, and one joint fewer.
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

    /// Adds to `out` the derivatives of the gradient, N, along those of the frames at fixed unknowns. `gradient` and
    /// `tangent` are those at this geometry.
    fn add_frame_rates<const G: usize>(
        &self,
        frames: &[FrameRate<G>],
        gradient: &[f64],
        tangent: &impl Tangent<f64>,
        out: &mut [[f64; G]],
    ) {
        with_simd_if_wide::<_, G>(FrameChange { frames, geometry: self, gradient, tangent, out });
    }

    /// Replaces the derivatives of the frames before a step by those after it, when the frames move to this geometry.
    /// `q` are the derivatives of the unknowns there.
    #[inline(always)]
    fn move_frame_rates<const G: usize>(&self, frames: &mut [FrameRate<G>], q: &[[f64; G]]) {
        for (j, (measured, rate)) in self.edges.iter().zip(frames).enumerate() {
            let e = edge(q, j);
            let along = lanes_dot(&measured.tangent, &e);
            let SpatialEdgeGeometry { length, inverse_length, tangent, follow, .. } = measured;
            for c in 0..3 {
                rate.turn += (rate.tangent[c] * *length + e[c]) * follow[c];
                rate.tangent[c] = (e[c] - along * tangent[c]) * *inverse_length;
            }
        }
    }

    /// Adds to `frames` the derivatives of a number by the frames that follow from those by the `angles` of the edges.
    fn turn_frames(&self, angles: &[f64], frames: &mut [FrameRate<1>]) {
        for (j, (measured, frame)) in self.edges.iter().zip(frames).enumerate() {
            let turn = angles[STRIDE * j + 3];
            add_frame(frame, turn, scale(measured.follow, measured.length * turn));
        }
    }

    /// The transpose of `add_frame_rates`: adds the derivatives of a number by the frames, where it has those `d` by
    /// the forces, and `stiff` is the product of `d` with the tangent.
    fn add_to_frames(
        &self,
        gradient: &[f64],
        d: &[f64],
        stiff: &[f64],
        frames: &mut [FrameRate<1>],
    ) {
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
    /// those before it, and adds the part by the unknowns to `q`.
    fn move_frames_back(&self, frames: &mut [FrameRate<1>], q: &mut [f64]) {
        for (j, (measured, frame)) in self.edges.iter().zip(frames).enumerate() {
            let SpatialEdgeGeometry { length, inverse_length, tangent, follow, .. } = measured;
            let (turn, by) = (frame.turn.0[0], frame.tangent.map(|x| x.0[0]));
            let across = sub(by, scale(*tangent, dot(by, *tangent)));
            let e = add(scale(*follow, turn), scale(across, *inverse_length));
            for c in 0..3 {
                q[STRIDE * j + c] -= e[c];
                q[STRIDE * (j + 1) + c] += e[c];
                frame.tangent[c] = Lanes([follow[c] * length * turn]);
            }
        }
    }
}
