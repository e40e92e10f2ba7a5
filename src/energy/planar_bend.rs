//! Element for bending at one inner node of a rod in a plane: energy, hand-derived gradient and Hessian.
//!
//! Energy (Eq. 1b): `E = 1/2 (EI/dl) (k - k_natural)^2`, with the Voronoi length `dl` and the integrated curvature `k =
//! 2 tan(phi/2)` of the turning angle `phi` between the edges `e` and `f`, positive counter-clockwise. Input: `EI/dl`,
//! N m, and the coordinates of three nodes, m; output: energy, J, gradient, N, and full Hessian, N/m. [`curvature`] is
//! `k` of three points, `strain` the same of an element, and `curvature_between` that of two unit tangents. `energy_at`
//! is the energy at `k`. `slope` is `dk/dphi`, and `by_angle` the moment `dE/dphi` and `d2E/dphi2`, N m, from stiffness
//! and stress by the curvature. `to_nodes` turns the gradient by both edge vectors into that by the nodes. `none` and
//! `pack_lanes` serve SIMD lanes of several joints.
//!
//! `tan(phi/2)` is `sin/(1 + cos)` for turning angles up to a right angle and `(1 - cos)/sin` beyond, so that
//! nothing cancels, neither in a straight rod nor in a fold. A fold of exactly 180 degrees has infinite energy.
//!
//! Hand derivation: with `n(x) = perp(x)/|x|^2` and `u(x) = x/|x|^2`, the angle of a vector has the gradient `n`
//! and the Hessian `-(u n' + n u')`; `phi = angle(f) - angle(e)`, `dk/dphi = 1 + k^2/4`, `d2k/dphi2 = k/2 dk/dphi`.

use crate::energy::law::Law;
use crate::energy::{Element, Local};
use crate::numerics::scalar::{Scalar, SimdScalar};

/// One inner node. Unknowns: `[x0, y0, x1, y1, x2, y2]` of the node's neighbour, itself and its
/// other neighbour, m.
#[derive(Clone, Copy, Debug)]
pub struct PlanarBend<D> {
    /// Bending stiffness over Voronoi length EI/dl, N m.
    pub stiffness: D,
    /// Integrated natural curvature, dimensionless.
    pub natural_curvature: D,
}

/// The edges `e`, `f` at the node, their squared lengths, and the curvature.
struct BentJoint<D> {
    e: [D; 2],
    f: [D; 2],
    ee: D,
    ff: D,
    curvature: D,
}

/// The edge vectors, m, their squared lengths, m^2, and the curvature `2 tan(phi/2)` of a joint with the coordinates
/// `q` of its three nodes.
#[inline]
fn bent_joint<D: Scalar>(q: &[D; 6]) -> BentJoint<D> {
    let e = [q[2] - q[0], q[3] - q[1]];
    let f = [q[4] - q[2], q[5] - q[3]];
    let ee = e[0] * e[0] + e[1] * e[1];
    let ff = f[0] * f[0] + f[1] * f[1];
    let cross = e[0] * f[1] - e[1] * f[0];
    let dot = e[0] * f[0] + e[1] * f[1];
    let lengths = (ee * ff).sqrt();
    // tan(phi/2), without a cancellation: a selection, so that joints can be computed in SIMD lanes.
    let zero = dot.like(0.0);
    let above = dot.if_less(zero, lengths - dot, cross);
    let below = dot.if_less(zero, cross, lengths + dot);
    BentJoint { e, f, ee, ff, curvature: above / below * 2.0 }
}

impl<D: Scalar> BentJoint<D> {
    /// The gradients `n(e)`, then `n(f)`, of the angles of both edges by their own vectors, 1/m: `perp(x)/|x|^2`, where
    /// `perp` rotates by +90 degrees.
    #[inline]
    fn angle_gradients(&self) -> ([D; 2], [D; 2]) {
        // One division for both reciprocals.
        let both = (self.ee * self.ff).recip();
        let (by_ee, by_ff) = (self.ff * both, self.ee * both);
        let n_e = [-(self.e[1] * by_ee), self.e[0] * by_ee];
        let n_f = [-(self.f[1] * by_ff), self.f[0] * by_ff];
        (n_e, n_f)
    }
}

/// Gradient by the coordinates of the three nodes from the gradients `g_e` and `g_f` by the vectors of both edges, each
/// the difference of two nodes.
#[inline]
pub(crate) fn to_nodes<D: Scalar>(g_e: [D; 2], g_f: [D; 2]) -> [D; 6] {
    [-g_e[0], -g_e[1], g_e[0] - g_f[0], g_e[1] - g_f[1], g_f[0], g_f[1]]
}

impl<D: Scalar> PlanarBend<D> {
    /// A joint with a stiffness and a natural curvature of zero, as padding of SIMD lanes.
    pub(crate) fn none() -> Self {
        let zero = D::from(0.0);
        Self { stiffness: zero, natural_curvature: zero }
    }

    /// The joints `all` of consecutive nodes as one joint in SIMD lanes: lane `k` has the numbers of joint `k`. Panics
    /// for fewer joints than lanes.
    #[inline(always)]
    pub(crate) fn pack_lanes<V: SimdScalar<D>>(level: V::Level, all: &[Self]) -> PlanarBend<V> {
        PlanarBend {
            stiffness: V::gather(level, |lane| all[lane].stiffness),
            natural_curvature: V::gather(level, |lane| all[lane].natural_curvature),
        }
    }

    /// Integrated curvature 2 tan(phi/2), dimensionless, at the three nodes `q`, m.
    #[inline]
    pub fn strain(&self, q: &[D; 6]) -> D {
        bent_joint(q).curvature
    }

    /// The derivative dk/dphi = 1 + k^2/4 of the curvature `k` by the turning angle, 1/rad.
    #[inline(always)]
    pub(crate) fn slope(k: D) -> D {
        let half = k * 0.5;
        half * half + 1.0
    }

    /// Moment dE/dphi and stiffness d2E/dphi2, N m, by the turning angle `phi`, at the curvature `k`, from `stiffness`
    /// and `stress` of the law by the curvature (chain rule).
    #[inline(always)]
    pub(crate) fn by_angle(k: D, [stiffness]: [D; 1], [stress]: [D; 1]) -> [D; 2] {
        let half = k * 0.5;
        let slope = Self::slope(k);
        [stress * slope, slope * (stiffness * slope + stress * half)]
    }

    /// Moment dE/dphi and stiffness d2E/dphi2 by the turning angle, N m, of the elastic joint at the curvature `k`.
    #[inline(always)]
    fn turning_response(&self, k: D) -> [D; 2] {
        Self::by_angle(k, self.stiffness(), self.stress(&[k]))
    }

    /// The energy `1/2 EI/dl (k - k_natural)^2`, J, at the curvature `k`.
    #[inline(always)]
    pub(crate) fn energy_at(&self, k: D) -> D {
        self.energies(&self.difference(&[k]))[1]
    }
}

impl<D: Scalar> Law<D, 1> for PlanarBend<D> {
    type Stiffness = [D; 1];

    const KINDS: [usize; 1] = [1];

    /// The bending stiffness over the Voronoi length, N m.
    #[inline(always)]
    fn stiffness(&self) -> [D; 1] {
        [self.stiffness]
    }

    /// The integrated natural curvature, at which there is no stress.
    #[inline(always)]
    fn natural(&self) -> [D; 1] {
        [self.natural_curvature]
    }

    /// The joint with another stiffness, N m, and another natural curvature.
    #[inline(always)]
    fn with(&self, [stiffness]: [D; 1], [natural_curvature]: [D; 1]) -> Self {
        Self { stiffness, natural_curvature }
    }

    /// Energies of stretching (zero), bending and twisting (zero), J, at the difference `k` of the curvature from the
    /// natural one.
    #[inline(always)]
    fn energies(&self, [k]: &[D; 1]) -> [D; 3] {
        let zero = k.like(0.0);
        [zero, self.stiffness * *k * *k * 0.5, zero]
    }
}

/// Integrated curvature `2 tan(phi/2)`, dimensionless, with the turning angle `phi` from the unit tangent `t` to the
/// unit tangent `u`, positive counter-clockwise.
#[inline(always)]
pub(crate) fn curvature_between<D: Scalar>(t: [D; 2], u: [D; 2]) -> D {
    // 1 + t.u, without cancellation in a fold.
    let sum = [t[0] + u[0], t[1] + u[1]];
    let chi = (sum[0] * sum[0] + sum[1] * sum[1]) * 0.5;
    (t[0] * u[1] - t[1] * u[0]) / chi * 2.0
}

/// Integrated curvature `2 tan(phi/2)`, dimensionless, at the middle one of three points of the plane, with the turning
/// angle `phi`, positive counter-clockwise.
pub fn curvature<D: Scalar>(points: &[[D; 2]; 3]) -> D {
    let [[a, b], [c, d], [e, f]] = *points;
    bent_joint(&[a, b, c, d, e, f]).curvature
}

impl<D: Scalar> Element<D, 6> for PlanarBend<D> {
    const NAME: &'static str = "bend";
    type Over<E: Scalar> = PlanarBend<E>;

    /// The element with every parameter converted to another number type.
    fn map<E: Scalar>(&self, convert: impl Fn(D) -> E) -> PlanarBend<E> {
        PlanarBend {
            stiffness: convert(self.stiffness),
            natural_curvature: convert(self.natural_curvature),
        }
    }

    /// The energy, J, at the nodes `q`: the definition of the element.
    #[inline]
    fn energy(&self, q: &[D; 6]) -> D {
        self.energy_at(self.strain(q))
    }

    /// dE/dq at the nodes `q`, derived by hand, N.
    fn gradient(&self, q: &[D; 6]) -> [D; 6] {
        let bent = bent_joint(q);
        let (n_e, n_f) = bent.angle_gradients();
        let [moment, _] = self.turning_response(bent.curvature);
        to_nodes([-(moment * n_e[0]), -(moment * n_e[1])], [moment * n_f[0], moment * n_f[1]])
    }

    /// E, J, dE/dq, N, and the full matrix d2E/dq2, N/m, at the nodes `q`, derived by hand. With m = dE/dphi and s =
    /// d2E/dphi2: E_ee = s n_e n_e' + m (u_e n_e' + n_e u_e'), E_ff = s n_f n_f' - m (u_f n_f' + n_f u_f'), E_ef = -s
    /// n_e n_f'.
    fn tangent(&self, q: &[D; 6]) -> Local<D, 6> {
        let bent = bent_joint(q);
        let (n_e, n_f) = bent.angle_gradients();
        let [moment, stiffness] = self.turning_response(bent.curvature);

        // With u = (p, q): s n n' + m (u n' + n u') =
        // [[q (s q - 2 m p), p (m p - s q) - m q^2], [.., p (s p + 2 m q)]].
        let edge_block = |n: [D; 2], moment: D| {
            let (p, q) = (n[1], -n[0]);
            let (mp, mq) = (moment * p, moment * q);
            let (along, across) = (stiffness * p + mq, stiffness * q - mp);
            (q * (across - mp), -(p * across + q * mq), p * (along + mq))
        };
        let (ee00, ee01, ee11) = edge_block(n_e, moment);
        let (ff00, ff01, ff11) = edge_block(n_f, -moment);
        let s_e = [stiffness * n_e[0], stiffness * n_e[1]];
        // rows f, columns e
        let (fe00, fe01) = (-(s_e[0] * n_f[0]), -(s_e[1] * n_f[0]));
        let (fe10, fe11) = (-(s_e[0] * n_f[1]), -(s_e[1] * n_f[1]));

        // rows of node 1 against node 0, node 2 against node 1, node 1 against itself
        let (a00, a01, a10, a11) = (fe00 - ee00, fe01 - ee01, fe10 - ee01, fe11 - ee11);
        let (b00, b01, b10, b11) = (fe00 - ff00, fe01 - ff01, fe10 - ff01, fe11 - ff11);
        let (c00, c01, c11) =
            (ee00 + ff00 - fe00 - fe00, ee01 + ff01 - fe01 - fe10, ee11 + ff11 - fe11 - fe11);
        // Nodes move edges with both signs: node 0 by -e, node 1 by e - f, node 2 by f.
        Local {
            energy: self.energy_at(bent.curvature),
            gradient: to_nodes(
                [-(moment * n_e[0]), -(moment * n_e[1])],
                [moment * n_f[0], moment * n_f[1]],
            ),
            hessian: [
                [ee00, ee01, a00, a10, -fe00, -fe10],
                [ee01, ee11, a01, a11, -fe01, -fe11],
                [a00, a01, c00, c01, b00, b10],
                [a10, a11, c01, c11, b01, b11],
                [-fe00, -fe01, b00, b01, ff00, ff01],
                [-fe10, -fe11, b10, b11, ff01, ff11],
            ],
        }
    }
}
