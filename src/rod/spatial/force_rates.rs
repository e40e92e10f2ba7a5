//! Derivatives along `G` parameters of the forces of given stresses on a spatial rod, from the rates of the stresses
//! and the motions of its edges and frames: `B^T dsigma` plus the product of the geometric stiffness with a motion,
//! without its matrix.
//!
//! Input: the geometry, stresses with rates, and an `EdgeMotion` per edge: the rotations `p`, `q`, `h`, rad, and the
//! relative change of length. `joint_force_rates` returns the derivatives of a joint's energy by the rotations of
//! both edges, N m, with their rates. `edge_force_rate` returns the rates of the force on the second node of an edge,
//! N, and of the torque about it, N m.
//!
//! Two edges `e` and `f` meet in a joint with the numbers `a`, `b`, `u` and `v` of [`joint`](crate::energy::joint).
//! Where the tangents move by `p` and `q` towards the directors and the edges turn about themselves by `h`,
//!
//! ```text
//! d chi/chi = a.(p_e, q_e) + b.(p_f, q_f)         rho = 1/chi = (1 + a.a)/2    c = u - 1 + rho
//! d a1 = -(1 - rho) p_e - a1 a.(p_e, q_e) + a2 h_e + c p_f - v q_f
//! d a2 = -(1 - rho) q_e - a2 a.(p_e, q_e) - a1 h_e + v p_f + c q_f
//! d b1 = -(1 - rho) p_f - b1 b.(p_f, q_f) + b2 h_f + c p_e + v q_e
//! d b2 = -(1 - rho) q_f - b2 b.(p_f, q_f) - b1 h_f - v p_e + c q_e
//! d tau = a1 q_e - a2 p_e - h_e + b2 p_f - b1 q_f + h_f
//! d c = -c d chi/chi - v d tau     d v = -v d chi/chi + c d tau     d u = rho d chi/chi + d c
//! ```

use crate::numerics::directions::{Directions, dot as lanes_dot};
use crate::rod::discrete::StressRate;
use crate::rod::edges::STRIDE;
use crate::rod::frames::FrameRate;
use crate::rod::spatial::geometry::{SpatialEdgeGeometry, SpatialJointGeometry, edge};

/// The derivatives of an edge along `G` parameters.
#[derive(Clone, Copy)]
pub(super) struct EdgeMotion<const G: usize> {
    /// Of its tangent towards the directors, and of its turn about itself, rad.
    pub rotation: [Directions<G>; 3],
    /// Of the logarithm of its length.
    stretch: Directions<G>,
}

impl<const G: usize> EdgeMotion<G> {
    /// The derivatives of edge `j` from those of the unknowns, `q`, and of its reference frame: rotations `p` and `q`
    /// towards both directors, turn `h` about itself with its frame, and relative change of length.
    #[inline(always)]
    pub fn new(
        measured: &SpatialEdgeGeometry,
        frame: &FrameRate<G>,
        q: &[[f64; G]],
        j: usize,
    ) -> Self {
        let SpatialEdgeGeometry { length, inverse_length, tangent, across, turn, follow, .. } =
            measured;
        let e = edge(q, j);
        let (a, b) = (lanes_dot(&across[0], &e), lanes_dot(&across[1], &e));
        // The director follows the tangent from its reference, which moves itself.
        let turned = frame.turn + lanes_dot(follow, &frame.tangent) * *length;
        let h = Directions(q[STRIDE * j + 3]) + turned + a * turn[0] + b * turn[1];
        Self { rotation: [a, b, h], stretch: lanes_dot(tangent, &e) * *inverse_length }
    }
}

/// Derivatives of an energy by `p`, `q` and `h` of an edge, N m, with their derivatives along `G` parameters.
#[derive(Clone, Copy)]
pub(super) struct EdgeForceRate<const G: usize> {
    value: [f64; 3],
    rate: [Directions<G>; 3],
}

impl<const G: usize> EdgeForceRate<G> {
    /// No stress.
    pub const ZERO: Self = Self { value: [0.0; 3], rate: [Directions::ZERO; 3] };

    /// The sum with `other`, of values and of derivatives.
    #[inline(always)]
    pub fn plus(mut self, other: &Self) -> Self {
        for c in 0..3 {
            self.value[c] += other.value[c];
            self.rate[c] += other.rate[c];
        }
        self
    }
}

/// The derivatives of the energy of a joint by `p`, `q` and `h` of its first and of its second edge, N m, at the
/// stresses `w`. Each has its derivatives along `G` parameters, from those of the stresses and from the motions `e` and
/// `f` of both edges.
#[inline(always)]
pub(super) fn joint_force_rates<const G: usize>(
    SpatialJointGeometry { by: [by_e, by_f], .. }: &SpatialJointGeometry,
    StressRate { value: w, rate: dw }: &StressRate<3, G>,
    e: &EdgeMotion<G>,
    f: &EdgeMotion<G>,
) -> [EdgeForceRate<G>; 2] {
    let ([pe, qe, he], [pf, qf, hf]) = (e.rotation, f.rotation);
    // The numbers of the joint from the derivatives of its strains.
    let (a, b) = ([-by_e[2][1], by_e[2][0]], [by_f[2][1], -by_f[2][0]]);
    let (u, v) = (by_f[0][0] - b[0] * b[0], b[0] * b[1] - by_f[1][0]);
    let rho = 0.5 * (1.0 + a[0] * a[0] + a[1] * a[1]);
    let (c, rest) = (u - 1.0 + rho, 1.0 - rho);
    let (along_e, along_f) = (pe * a[0] + qe * a[1], pf * b[0] + qf * b[1]);
    let chi = along_e + along_f;
    let da = [
        he * a[1] - pe * rest - along_e * a[0] + pf * c - qf * v,
        pf * v + qf * c - qe * rest - along_e * a[1] - he * a[0],
    ];
    let db = [
        pe * c + qe * v + hf * b[1] - pf * rest - along_f * b[0],
        qe * c - pe * v - qf * rest - along_f * b[1] - hf * b[0],
    ];
    let twist = qe * a[0] - pe * a[1] - he + pf * b[1] - qf * b[0] + hf;
    let dv = twist * c - chi * v;
    let du = chi * (rho - c) - twist * v;

    let product = |row: &[f64; 3]| w[0] * row[0] + w[1] * row[1] + w[2] * row[2];
    let value_e = [product(&by_e[0]), product(&by_e[1]), product(&by_e[2])];
    let value_f = [product(&by_f[0]), product(&by_f[1]), product(&by_f[2])];
    // w1 a1 + w2 a2 with its derivative at fixed stresses, and the same of b.
    let (wa, wb) = (w[0] * a[0] + w[1] * a[1], w[0] * b[0] + w[1] * b[1]);
    let (dwa, dwb) = (da[0] * w[0] + da[1] * w[1], db[0] * w[0] + db[1] * w[1]);
    // Both blocks have -+(w1 du) + w2 dv and -+(w2 du) - w1 dv.
    let (u1, u2, v1, v2) = (du * w[0], du * w[1], dv * w[0], dv * w[1]);
    let rate_e = [
        lanes_dot(&by_e[0], dw) + v2 - u1 - da[0] * (wa) - dwa * a[0] - da[1] * w[2],
        lanes_dot(&by_e[1], dw) - v1 - u2 - da[1] * (wa) - dwa * a[1] + da[0] * w[2],
        lanes_dot(&by_e[2], dw) + da[1] * w[0] - da[0] * w[1],
    ];
    let rate_f = [
        lanes_dot(&by_f[0], dw) + u1 + v2 + db[0] * wb + dwb * b[0] + db[1] * w[2],
        lanes_dot(&by_f[1], dw) + u2 - v1 + db[1] * wb + dwb * b[1] - db[0] * w[2],
        lanes_dot(&by_f[2], dw) + db[0] * w[1] - db[1] * w[0],
    ];
    [EdgeForceRate { value: value_e, rate: rate_e }, EdgeForceRate { value: value_f, rate: rate_f }]
}

/// The derivatives along `G` parameters of the force on the second node of an edge, N, and of the torque about it, N m.
/// The edge has the axial `force`, which changes by `force_rate`, and the `motion`. `pull` are the derivatives of the
/// energies of both its joints by its rotations, `[p, q, h]`, with their rates.
///
/// With the turns `g` of the director per rotation of the tangent towards each director, and the directors `m`, the
/// force is `F t + (P m1 + Q m2)/l`, where `P = p + h g1` and `Q = q + h g2`.
#[inline(always)]
pub(super) fn edge_force_rate<const G: usize>(
    measured: &SpatialEdgeGeometry,
    frame: &FrameRate<G>,
    motion: &EdgeMotion<G>,
    pull: &EdgeForceRate<G>,
    force: f64,
    force_rate: Directions<G>,
) -> ([Directions<G>; 3], Directions<G>) {
    let SpatialEdgeGeometry { length, inverse_length, tangent, across, turn, by_chi, .. } =
        measured;
    let (EdgeMotion { rotation: [p, q, h], stretch }, [g1, g2]) = (*motion, *turn);
    let ([p0, q0, torque], [dp, dq, dh]) = (pull.value, pull.rate);
    // Changes of g: by the reference tangent, and by the tangent and its directors.
    let reference = [lanes_dot(&across[0], &frame.tangent), lanes_dot(&across[1], &frame.tangent)];
    let back = lanes_dot(tangent, &frame.tangent) * *by_chi + p * g2 - q * g1;
    let (rest, moved) = (1.0 - by_chi, by_chi * length);
    let dg1 = q * rest + h * g2 - back * g1 - reference[1] * moved;
    let dg2 = reference[0] * moved - p * rest - h * g1 - back * g2;
    // P and Q with their derivatives.
    let (big_p, big_q) = (p0 + torque * g1, q0 + torque * g2);
    let (dbig_p, dbig_q) = (dp + dh * g1 + dg1 * torque, dq + dh * g2 + dg2 * torque);
    // Components along both directors over the length, and along the tangent: d t = p m1 + q m2, d m1 = h m2 - p t,
    // d m2 = -h m1 - q t.
    let axial = force * length;
    let first = dbig_p + p * axial - h * big_q - stretch * big_p;
    let second = dbig_q + q * axial + h * big_p - stretch * big_q;
    let along = force_rate - (p * big_p + q * big_q) * *inverse_length;
    let component = |c: usize| along * tangent[c] + first * across[0][c] + second * across[1][c];
    ([component(0), component(1), component(2)], dh)
}
