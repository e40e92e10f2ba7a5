//! Derivatives of forces and strains of a spatial rod along `G` parameters, from the geometry of the rod.
//!
//! `gradient_rates` overwrites its output with the derivatives of the energy gradient, N and N m (angles), at fixed
//! unknowns and frames, `B^T dsigma - dload`, from those of axial forces, bending and twisting moments and dead
//! loads. `node_force_rates` does the same for stresses that change with the unknowns, plus the change of `B` by the
//! derivatives of unknowns and frames, without loads. `add_strain_rates` adds to the derivatives of strains those by
//! unknowns and frames, `B dq`. All are hand-derived, with `B = ds/dq`, one SIMD lane per parameter. Forward
//! sensitivities use them.

use crate::energy::Stretch;
use crate::numerics::directions::{Directions, dot as lanes_dot};
use crate::rod::discrete::{RateLayout, StressRate};
use crate::rod::edges::STRIDE;
use crate::rod::frames::FrameRate;
use crate::rod::layout::Space;
use crate::rod::spatial::force_rates::{
    EdgeForceRate, EdgeMotion, edge_force_rate, joint_force_rates,
};
use crate::rod::spatial::geometry::{Geometry, SpatialEdgeGeometry, SpatialJointGeometry, edge};

impl RateLayout<3, 3> for Space {
    /// Overwrites `out` with the derivatives of the gradient, N and N m: from those of the axial forces,
    /// `axial(edge, strain)`, of the joint stresses, `stress(joint, strains)`, and of the loads, `load(node)`.
    #[inline(always)]
    fn gradient_rates<const G: usize>(
        Geometry { edges, joints }: &Geometry,
        axial: impl Fn(usize, f64) -> Directions<G>,
        stress: impl Fn(usize, &[f64; 3]) -> [Directions<G>; 3],
        load: impl Fn(usize) -> [Directions<G>; 3],
        out: &mut [[f64; G]],
    ) {
        let by_edge = |i: usize, [p, q, h]: [Directions<G>; 3]| -> [Directions<G>; 3] {
            let SpatialEdgeGeometry { tangent, strain, across: [m1, m2], turn, .. } = &edges[i];
            let force = axial(i, *strain);
            let (p, q) = (p + h * turn[0], q + h * turn[1]);
            let along = |c: usize| force * tangent[c] + p * m1[c] + q * m2[c];
            [along(0), along(1), along(2)]
        };
        // One pass along the rod: a node takes the forces of its two edges, an edge the stresses of its two joints.
        let (mut carried, mut open) = ([Directions::ZERO; 3], [Directions::ZERO; 3]);
        for (i, SpatialJointGeometry { strains, by: [by_e, by_f] }) in joints.iter().enumerate() {
            let w = stress(i, strains);
            let pull =
                |[p, q, h]: &[[f64; 3]; 3]| [lanes_dot(p, &w), lanes_dot(q, &w), lanes_dot(h, &w)];
            // The joint's stresses act on the edge before it now, and on the edge after it in the next pass.
            let [p, q, h] = pull(by_e);
            let by = [open[0] + p, open[1] + q, open[2] + h];
            let (force, load) = (by_edge(i, by), load(i));
            let node: &mut [[f64; G]; STRIDE] =
                out[STRIDE * i..].first_chunk_mut().expect("a node");
            for c in 0..3 {
                node[c] = (carried[c] - force[c] - load[c]).0;
            }
            node[3] = by[2].0;
            carried = force;
            open = pull(by_f);
        }
        let i = joints.len();
        let (force, loads) = (by_edge(i, open), [load(i), load(i + 1)]);
        for c in 0..3 {
            out[STRIDE * i + c] = (carried[c] - force[c] - loads[0][c]).0;
            out[STRIDE * (i + 1) + c] = (force[c] - loads[1][c]).0;
        }
        out[STRIDE * i + 3] = open[2].0;
    }

    /// Overwrites `out` with the derivatives of the forces, N and N m, of given axial forces and joint stresses. They
    /// change with these stresses (their rates) and with the directions, through the derivatives `q` of the unknowns
    /// and of the `frames`. Loads have no part.
    #[inline(always)]
    fn node_force_rates<const G: usize>(
        Geometry { edges, joints }: &Geometry,
        axial: impl Fn(usize) -> StressRate<1, G>,
        stress: impl Fn(usize) -> StressRate<3, G>,
        frames: &[FrameRate<G>],
        q: &[[f64; G]],
        out: &mut [[f64; G]],
    ) {
        let count = edges.len();
        let (joints, frames) = (&joints[..count - 1], &frames[..count]);
        let mut motion = EdgeMotion::new(&edges[0], &frames[0], q, 0);
        let mut open = EdgeForceRate::ZERO;
        let mut carried = [Directions::ZERO; 3];
        for j in 0..count {
            // First the joint before the edge, from the last pass, then the joint after it.
            let mut pull = open;
            let mut next = motion;
            if j + 1 < count {
                next = EdgeMotion::new(&edges[j + 1], &frames[j + 1], q, j + 1);
                let [by_e, by_f] = joint_force_rates(&joints[j], &stress(j), &motion, &next);
                pull = pull.plus(&by_e);
                open = by_f;
            }
            let StressRate { value: [force], rate: [force_rate] } = axial(j);
            let (force, torque) =
                edge_force_rate(&edges[j], &frames[j], &motion, &pull, force, force_rate);
            let node: &mut [[f64; G]; STRIDE] =
                out[STRIDE * j..].first_chunk_mut().expect("a node");
            for c in 0..3 {
                node[c] = (carried[c] - force[c]).0;
            }
            node[3] = torque.0;
            (carried, motion) = (force, next);
        }
        for c in 0..3 {
            out[STRIDE * count + c] = carried[c].0;
        }
    }

    /// Adds to `edges` and `joints` the derivatives of the strains that follow from those `q` of the unknowns and those
    /// of the `frames`: by the change of length of an edge, and by the rotations `p`, `q` and `h` of both edges of a
    /// joint.
    #[inline(always)]
    fn add_strain_rates<const G: usize>(
        stretch: &[Stretch<f64, 3>],
        frames: &[FrameRate<G>],
        geometry: &Geometry,
        q: &[[f64; G]],
        edges: &mut [Directions<G>],
        joints: &mut [[Directions<G>; 3]],
    ) {
        let mut before = [Directions::ZERO; 3];
        for (j, (measured, frame)) in geometry.edges.iter().zip(frames).enumerate() {
            let SpatialEdgeGeometry { length, tangent, across, turn, follow, .. } = measured;
            let e = edge(q, j);
            edges[j] += lanes_dot(tangent, &e) * stretch[j].rest_length.recip();
            // Rotations of the edge towards its directors, and its turn about the tangent with that of the frame.
            let (a, b) = (lanes_dot(&across[0], &e), lanes_dot(&across[1], &e));
            let turned = frame.turn + lanes_dot(follow, &frame.tangent) * *length;
            let own = [a, b, Directions(q[STRIDE * j + 3]) + turned + a * turn[0] + b * turn[1]];
            if let Some(i) = j.checked_sub(1) {
                let [by_e, by_f] = &geometry.joints[i].by;
                for c in 0..3 {
                    for r in 0..3 {
                        joints[i][c] += before[r] * by_e[r][c] + own[r] * by_f[r][c];
                    }
                }
            }
            before = own;
        }
    }
}
