//! Derivatives of forces and strains of a planar rod along `G` parameters, from the geometry of the rod.
//!
//! `gradient_rates` overwrites its output with the derivatives of the energy gradient, N, at fixed unknowns,
//! `B^T dsigma - dload`, from those of axial forces, moments and dead loads. `node_force_rates` does the same for
//! stresses that change with the unknowns, plus the change of `B` by the derivatives of the unknowns, without loads.
//! `add_strain_rates` adds to the derivatives of strains those by the unknowns, `B dq`. All are hand-derived, with
//! `B = ds/dq`, one SIMD lane per parameter. Forward sensitivities use them.

use crate::energy::Stretch;
use crate::numerics::directions::{Directions, dot};
use crate::rod::FrameRate;
use crate::rod::discrete::{RateLayout, StressRate};
use crate::rod::layout::Plane;
use crate::rod::planar::geometry::{Geometry, PlanarEdgeGeometry};

impl RateLayout<2, 1> for Plane {
    /// Overwrites `out` with the derivatives of the gradient, N: from those of the axial forces, `axial(edge, strain)`,
    /// of the moments, `stress(joint, curvature)`, and of the loads, `load(node)`.
    #[inline(always)]
    fn gradient_rates<const G: usize>(
        geometry: &Geometry,
        axial: impl Fn(usize, f64) -> Directions<G>,
        stress: impl Fn(usize, &[f64; 1]) -> [Directions<G>; 1],
        load: impl Fn(usize) -> [Directions<G>; 2],
        out: &mut [[f64; G]],
    ) {
        let out = out.as_chunks_mut::<2>().0;
        let mut carried = [Directions::ZERO; 2];
        let mut node = |i: usize, force: [Directions<G>; 2]| {
            let load = load(i);
            for c in 0..2 {
                out[i][c] = (carried[c] - force[c] - load[c]).0;
            }
            carried = force;
        };
        // One pass along the rod: a node takes the forces of its two edges, an edge the moments of its two joints.
        let mut before = Directions::ZERO;
        let by_edge = |i: usize, moment: Directions<G>| -> [Directions<G>; 2] {
            let PlanarEdgeGeometry { tangent: [t0, t1], normal: [n0, n1], strain, .. } =
                geometry.edges[i];
            let axial = axial(i, strain);
            [axial * t0 + moment * n0, axial * t1 + moment * n1]
        };
        for (i, [curvature, slope]) in geometry.joints.iter().enumerate() {
            let moment = stress(i, &[*curvature])[0] * *slope;
            node(i, by_edge(i, before - moment));
            before = moment;
        }
        let i = geometry.joints.len();
        node(i, by_edge(i, before));
        node(i + 1, [Directions::ZERO; 2]);
    }

    /// Overwrites `out` with the derivatives of the node forces, N, of given axial forces and joint moments. They
    /// change with these stresses (their rates) and with the directions, through the derivatives `q` of the unknowns.
    /// Loads have no part.
    ///
    /// An edge of the tangent `t`, the normal `n` over its length `l`, and the change `e` turns by `w = n.e`: `t`
    /// changes by `l w n`, and `n` by `-w t/l - (t.e) n/l`. The derivative `1 + k^2/4` of a curvature by the angle
    /// changes by `k/2` of the change of the curvature.
    #[inline(always)]
    fn node_force_rates<const G: usize>(
        geometry: &Geometry,
        axial: impl Fn(usize) -> StressRate<1, G>,
        stress: impl Fn(usize) -> StressRate<1, G>,
        _: &[FrameRate<G>],
        q: &[[f64; G]],
        out: &mut [[f64; G]],
    ) {
        let count = geometry.edges.len();
        let (edges, joints) = (&geometry.edges[..count], &geometry.joints[..count - 1]);
        let q = &q.as_chunks::<2>().0[..=count];
        let out = &mut out.as_chunks_mut::<2>().0[..=count];
        let change = |j: usize| {
            [
                Directions(q[j + 1][0]) - Directions(q[j][0]),
                Directions(q[j + 1][1]) - Directions(q[j][1]),
            ]
        };
        let mut e = change(0);
        let mut turn = dot(&edges[0].normal, &e);
        let (mut moment, mut moment_rate) = (0.0, Directions::ZERO);
        let mut carried = [Directions::ZERO; 2];
        for j in 0..count {
            let edge = &edges[j];
            // The moment of the joint after the edge, with its derivative; none after the last edge.
            let (mut next, mut next_rate) = (0.0, Directions::ZERO);
            let (mut next_e, mut next_turn) = (e, turn);
            if j + 1 < count {
                next_e = change(j + 1);
                next_turn = dot(&edges[j + 1].normal, &next_e);
                let [curvature, slope] = joints[j];
                let StressRate { value: [value], rate: [rate] } = stress(j);
                next = value * slope;
                next_rate = (rate + (next_turn - turn) * (value * 0.5 * curvature)) * slope;
            }
            // The torque on the edge, N m, and its axial force, N, with their derivatives.
            let (torque, torque_rate) = (moment - next, moment_rate - next_rate);
            let StressRate { value: [force], rate: [force_rate] } = axial(j);
            let stretched = dot(&edge.tangent, &e);
            // Components of the change of the force along the normal and the tangent.
            let along_normal = torque_rate + turn * (force * edge.length)
                - stretched * (torque * edge.inverse_length);
            let along_tangent = force_rate - turn * (torque * edge.inverse_length);
            for c in 0..2 {
                let force = along_normal * edge.normal[c] + along_tangent * edge.tangent[c];
                out[j][c] = (carried[c] - force).0;
                carried[c] = force;
            }
            (moment, moment_rate, e, turn) = (next, next_rate, next_e, next_turn);
        }
        out[count] = [carried[0].0, carried[1].0];
    }

    /// Adds to `edges` and `joints` the derivatives of the strains that follow from those `q` of the unknowns: `t.e/l0`
    /// with the rest length `l0` of an edge, and `(1 + k^2/4)` times the difference of the turns of both edges of a
    /// joint.
    #[inline(always)]
    fn add_strain_rates<const G: usize>(
        stretch: &[Stretch<f64, 2>],
        _: &[FrameRate<G>],
        geometry: &Geometry,
        q: &[[f64; G]],
        edges: &mut [Directions<G>],
        joints: &mut [[Directions<G>; 1]],
    ) {
        let count = geometry.edges.len();
        let (q, stretch) = (&q.as_chunks::<2>().0[..=count], &stretch[..count]);
        let mut before = Directions::ZERO;
        for (j, PlanarEdgeGeometry { tangent, normal, .. }) in geometry.edges.iter().enumerate() {
            let e = [
                Directions(q[j + 1][0]) - Directions(q[j][0]),
                Directions(q[j + 1][1]) - Directions(q[j][1]),
            ];
            edges[j] += dot(tangent, &e) * stretch[j].rest_length.recip();
            let turn = dot(normal, &e);
            if j > 0 {
                joints[j - 1][0] += (turn - before) * geometry.joints[j - 1][1];
            }
            before = turn;
        }
    }
}
