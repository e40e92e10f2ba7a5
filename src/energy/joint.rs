//! Joint of two edges that meet in a node of a rod in space: its strains (two curvatures, twist) and their
//! derivatives.
//!
//! Input: unit tangents `t` and material directors `m1`, `m2` of the edges `e` and `f` before and after the node, the
//! total twist (rad), stiffness and stresses (N m). [`EdgeState`] computes tangent and directors of an edge from its
//! vector (m), angle (rad) and reference frame. Output: the strains, and gradient and Hessian of the energy by `p`, `q`
//! and `h` of both edges.
//!
//! An edge of constant length moves in three ways: its tangent moves towards its directors, `t + p m1 + q m2`, and
//! it rotates about itself by `h`, rad. By these (`p`, `q` and `h` of both edges) all derivatives are short. With
//! `chi = 1 + t_e.t_f` and
//!
//! ```text
//! a = (m1_e.t_f, m2_e.t_f)/chi   b = (m1_f.t_e, m2_f.t_e)/chi   u = 1 - 1/chi + cos/chi   v = sin/chi
//! ```
//!
//! where `cos` and `sin` are those of the angle from the first edge's directors to the second edge's, transported
//! to the first, the strains are `a1 - b1`, `a2 - b2` and the twist, and their derivatives by `p`, `q` and `h`
//!
//! ```text
//!       of e                                  of f
//! k1   -(u + a1 a1), -(v + a1 a2),  a2        u + b1 b1, b1 b2 - v, -b2
//! k2   v - a1 a2,   -(u + a2 a2),  -a1        v + b1 b2, u + b2 b2,  b1
//! tau  -a2,          a1,           -1         b2,       -b1,          1
//! ```
//!
//! [`EdgeState::gradient`] and [`EdgeState::derivatives`] convert them to derivatives by an edge's vector (m) and angle
//! (rad), once for the sum of the edge's two joints. They add those of an axial force; [`between`] converts the block
//! of two edges. [`JointStrains::slopes`] returns the table above, `JointStrains::pull` the first derivatives of the
//! energy by `p`, `q` and `h` from given stresses, `JointStrains::cayley_twist` the twist as a tangent.
//! [`DirectedEdge`] is tangent, directors and inverse length of an edge: `moved` makes it from a transported frame,
//! `across` returns the derivative by the edge vector from those by `p` and `q`. `EdgeSum::plus` adds the parts of both
//! joints of an edge. `EdgeState::at_reference` takes the present frame as the reference, as the derivatives of the
//! literature do.
//!
//! `JointGradient` and `JointTangent` are derivatives by `p`, `q` and `h` of both edges, `EdgeSum` and `ByEdge` those
//! by one edge before and after the conversion. `Between` are second derivatives by both edges.

use crate::energy::frame::{EdgeFrame, vector_after};
use crate::energy::law::{Stiffness, Symmetric};
use crate::numerics::scalar::{Scalar, SimdScalar};
use crate::numerics::vector::{Vector, add, combine, dot, scale, sub};

/// Inverse length, 1/m, unit tangent and material directors of an edge.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DirectedEdge<D> {
    pub inverse_length: D,
    pub tangent: Vector<D>,
    pub m: [Vector<D>; 2],
}

impl<D: Scalar> DirectedEdge<D> {
    /// The edge with the inverse length, 1/m, and the tangent of a frame that has been transported to its present
    /// tangent; its material directors are those of the frame turned by `angle`, rad.
    #[inline(always)]
    pub fn moved(frame: &EdgeFrame<D>, inverse_length: D, angle: D) -> Self {
        Self { inverse_length, tangent: frame.tangent, m: frame.turned(angle) }
    }

    /// The derivative by the edge vector, from those by `p` and `q` (the tangent towards both directors): `(p m1 + q
    /// m2)/l`.
    #[inline(always)]
    pub fn across(&self, [p, q]: [D; 2]) -> Vector<D> {
        scale(combine(p, self.m[0], q, self.m[1]), self.inverse_length)
    }

    /// The derivatives by the three components of the edge vector and by its angle, from those by `p`, `q` and `h`.
    #[inline(always)]
    fn row(&self, p: D, q: D, h: D) -> [D; 4] {
        let [x, y, z] = self.across([p, q]);
        [x, y, z, h]
    }

    /// The scalar products of the vector `t` with both material directors, `[m1.t, m2.t]`, times `factor`.
    #[inline(always)]
    fn along(&self, t: Vector<D>, factor: D) -> [D; 2] {
        [dot(self.m[0], t) * factor, dot(self.m[1], t) * factor]
    }
}

/// An edge, and the rotation of its frame since the reference.
#[derive(Clone, Copy, Debug)]
pub struct EdgeState<D> {
    pub(crate) edge: DirectedEdge<D>,
    /// Its length, m, and the square of it.
    pub(crate) length: D,
    pub(crate) squared: D,
    /// The turn of the transported director per change of `p` and `q`: zero at the reference.
    pub(crate) turn: [D; 2],
}

/// Derivatives of the energies of an edge's stretching and of both its joints by the edge.
#[derive(Clone, Copy, Debug)]
pub struct ByEdge<D> {
    /// By its vector, N, and by its angle, N m.
    pub gradient: [D; 4],
    /// By its vector twice, the lower triangle, N/m.
    pub vector: [[D; 3]; 3],
    /// By its vector and its angle, N.
    pub angle_vector: [D; 3],
    /// By its angle twice, N m.
    pub angle: D,
}

/// The first and second derivatives of energies by `p`, `q` and `h` of one edge, summed over its joints.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EdgeSum<D> {
    pub gradient: [D; 3],
    /// `pp, qp, qq, hp, hq, hh`.
    pub hessian: [D; 6],
}

impl<D: Scalar> EdgeSum<D> {
    /// The derivatives of the edge before each one: shifted by one SIMD lane towards later edges. The first lane
    /// receives the last lane of `earlier`.
    #[inline(always)]
    pub fn before<S>(&self, earlier: &Self) -> Self
    where
        D: SimdScalar<S>,
    {
        let mut sum = *self;
        for i in 0..3 {
            sum.gradient[i] = self.gradient[i].before(earlier.gradient[i]);
        }
        for i in 0..6 {
            sum.hessian[i] = self.hessian[i].before(earlier.hessian[i]);
        }
        sum
    }

    /// The sum of these derivatives by `p`, `q` and `h` of one edge and of `other`, entry by entry.
    #[inline(always)]
    pub fn plus(&self, other: &Self) -> Self {
        let mut sum = *self;
        for i in 0..3 {
            sum.gradient[i] += other.gradient[i];
        }
        for i in 0..6 {
            sum.hessian[i] += other.hessian[i];
        }
        sum
    }
}

impl<D: Scalar> EdgeState<D> {
    /// The edge with the vector `e`, m, and the angle `angle`, rad: length, tangent, and material directors,
    /// transported in parallel from the reference `frame` and turned by the angle. Also the change of its turn with its
    /// tangent, which is zero at the reference.
    #[inline(always)]
    pub fn new(frame: &EdgeFrame<D>, e: Vector<D>, angle: D) -> Self {
        let squared = dot(e, e);
        let length = squared.sqrt();
        let inverse_length = length.recip();
        let tangent = scale(e, inverse_length);
        // t + t_ref: half its square is 1 + t.t_ref.
        let both = add(frame.tangent, tangent);
        // 1/(1 + t.t_ref), to full accuracy when they nearly oppose each other.
        let inverse = (dot(both, both) * 0.5).recip();
        // Parallel transport of the reference director to the tangent.
        let director = sub(frame.director, scale(both, dot(tangent, frame.director) * inverse));
        let m = EdgeFrame { tangent, director }.turned(angle);
        let turn = [-(dot(frame.tangent, m[1]) * inverse), dot(frame.tangent, m[0]) * inverse];
        Self { edge: DirectedEdge { inverse_length, tangent, m }, length, squared, turn }
    }

    /// The edges shifted by one SIMD lane towards earlier ones; the last lane receives the first lane of `later`.
    #[inline(always)]
    pub(crate) fn after<S>(&self, later: &Self) -> Self
    where
        D: SimdScalar<S>,
    {
        let (own, rest) = (&self.edge, &later.edge);
        Self {
            edge: DirectedEdge {
                inverse_length: own.inverse_length.after(rest.inverse_length),
                tangent: vector_after(own.tangent, rest.tangent),
                m: [vector_after(own.m[0], rest.m[0]), vector_after(own.m[1], rest.m[1])],
            },
            length: self.length.after(later.length),
            squared: self.squared.after(later.squared),
            turn: [self.turn[0].after(later.turn[0]), self.turn[1].after(later.turn[1])],
        }
    }

    /// The edge as if its present frame were the reference, the assumption of the derivatives in the literature: its
    /// turn per change of the tangent is zero.
    pub(super) fn at_reference(mut self) -> Self {
        self.turn = [D::from(0.0); 2];
        self
    }

    /// The gradient of an energy by the edge's vector, N, and angle, N m, from its derivatives by `p`, `q` and `h` and
    /// its axial `force`, N. Includes the turn of the director that follows from its transport from the reference.
    #[inline(always)]
    pub(crate) fn gradient(&self, [p, q, h]: [D; 3], force: D) -> [D; 4] {
        let across = self.edge.across([p + h * self.turn[0], q + h * self.turn[1]]);
        let [x, y, z] = add(scale(self.edge.tangent, force), across);
        [x, y, z, h]
    }

    /// All derivatives of an energy by the edge's vector and angle, from those by `p`, `q` and `h` in `sum`. The edge
    /// has the axial `force`, N, the `tension` in its geometric stiffness, N, and the axial `stiffness`, N/m.
    ///
    /// The director follows the tangent by parallel transport from the reference: `dh -> dh + g.dx`
    /// with the [turn](Self::turn) `g`, and one more block, `(dE/dh) dg/dx`. A displacement of the tangent by
    /// `p` and `q` has a second-order part against the tangent.
    #[inline(always)]
    pub(crate) fn derivatives(
        &self,
        sum: &EdgeSum<D>,
        [force, tension]: [D; 2],
        stiffness: D,
    ) -> ByEdge<D> {
        let DirectedEdge { inverse_length, tangent, m } = &self.edge;
        // g = the turn per p and q, torque = dE/dh.
        let ([g1, g2], torque) = (self.turn, sum.gradient[2]);
        let [pp, qp, qq, hp, hq, hh] = sum.hessian;
        let (t1, t2) = (torque * g1, torque * g2);
        let (p, q) = (sum.gradient[0] + t1, sum.gradient[1] + t2);
        // The chain rule dh -> dh + g.dx at second order.
        let (up, uq) = (hp + hh * g1, hq + hh * g2);
        let bow = t1 * g2;
        let pp = pp + g1 * (hp + up) - bow;
        let qq = qq + g2 * (hq + uq) + bow;
        let qp = qp + g1 * uq + g2 * hp + (t1 * g1 - t2 * g2) * 0.5;

        // Derivatives by p and q are those by displacements across the edge over its length.
        let by_square = *inverse_length * *inverse_length;
        let across = tension * *inverse_length;
        let (pp, qq, qp) = (pp * by_square + across, qq * by_square + across, qp * by_square);
        let (tp, tq) = (-(p * by_square), -(q * by_square));
        // Components along the directors and the tangent become a matrix in the model's axes.
        let rows = [
            add(combine(pp, m[0], qp, m[1]), scale(*tangent, tp)),
            add(combine(qp, m[0], qq, m[1]), scale(*tangent, tq)),
            add(combine(tp, m[0], tq, m[1]), scale(*tangent, stiffness)),
        ];
        let mut vector = [[across; 3]; 3];
        for r in 0..3 {
            for c in 0..=r {
                vector[r][c] =
                    m[0][r] * rows[0][c] + m[1][r] * rows[1][c] + tangent[r] * rows[2][c];
            }
        }
        let [x, y, z] = add(scale(*tangent, force), self.edge.across([p, q]));
        ByEdge {
            gradient: [x, y, z, torque],
            vector,
            angle_vector: self.edge.across([up, uq]),
            angle: hh,
        }
    }
}

/// Derivatives by the vectors and angles of two edges, N/m, N and N m: rows of the second, columns of
/// the first.
pub type Between<D> = [[D; 4]; 4];

/// Second derivatives by the vectors and angles of two edges, from those in `fe` by three motions of each edge. These
/// are shifts of its unit tangent towards both directors (`p`, `q`) and its rotation about itself (`h`, rad). Rows of
/// both belong to `f`, columns to `e`. Includes the turns of both directors by transport from their references.
#[inline(always)]
pub(crate) fn between<D: Scalar>(
    e: &EdgeState<D>,
    f: &EdgeState<D>,
    mut fe: [[D; 3]; 3],
) -> Between<D> {
    // Columns of e: h follows p and q by the turn of its director.
    for row in &mut fe {
        row[0] += row[2] * e.turn[0];
        row[1] += row[2] * e.turn[1];
    }
    // Rows of f likewise.
    for c in 0..3 {
        fe[0][c] += f.turn[0] * fe[2][c];
        fe[1][c] += f.turn[1] * fe[2][c];
    }
    // The rows of f as vectors, then the columns of e.
    let by_f = [
        f.edge.across([fe[0][0], fe[1][0]]),
        f.edge.across([fe[0][1], fe[1][1]]),
        f.edge.across([fe[0][2], fe[1][2]]),
    ];
    [
        e.edge.row(by_f[0][0], by_f[1][0], by_f[2][0]),
        e.edge.row(by_f[0][1], by_f[1][1], by_f[2][1]),
        e.edge.row(by_f[0][2], by_f[1][2], by_f[2][2]),
        e.edge.row(fe[2][0], fe[2][1], fe[2][2]),
    ]
}

/// The sum of the derivatives `by` of the two bending strains (by one of `p`, `q`, `h`), each times its stress `w`, N
/// m; the third entries are not used.
#[inline(always)]
fn bent<D: Scalar>(by: &[D; 3], w: &[D; 3]) -> D {
    w[0] * by[0] + w[1] * by[1]
}

/// Two edges that meet in a node: `1/chi`, `a` and `b` of the header, and the strains `[k1, k2, twist]` of their joint,
/// rad.
pub(crate) struct JointStrains<D> {
    /// 1/(1 + t_e.t_f).
    inverse_chi: D,
    a: [D; 2],
    b: [D; 2],
    pub strains: [D; 3],
}

/// First derivatives of an energy by `p`, `q` and `h` of both edges, N m.
pub(crate) struct JointGradient<D> {
    pub e: [D; 3],
    pub f: [D; 3],
}

/// First and second derivatives of an energy by `p`, `q` and `h` of both edges, N m.
pub(crate) struct JointTangent<D> {
    pub e: EdgeSum<D>,
    pub f: EdgeSum<D>,
    /// Rows of the second edge, columns of the first.
    pub fe: [[D; 3]; 3],
}

impl<D: Scalar> JointStrains<D> {
    /// The joint of the edges `e` and `f` with its strains: two curvatures from tangents and directors, and the given
    /// `twist`, rad.
    #[inline(always)]
    pub fn new(e: &DirectedEdge<D>, f: &DirectedEdge<D>, twist: D) -> Self {
        let both = add(e.tangent, f.tangent);
        // To full accuracy in a fold.
        let inverse_chi = (dot(both, both) * 0.5).recip();
        let (a, b) = (e.along(f.tangent, inverse_chi), f.along(e.tangent, inverse_chi));
        Self { inverse_chi, a, b, strains: [a[0] - b[0], a[1] - b[1], twist] }
    }

    /// `[cos/chi, sin/chi]`, with `chi = 1 + t_e.t_f` and the angle from the first edge's directors to the second
    /// edge's, transported to the first.
    #[inline(always)]
    fn turned(&self, e: &DirectedEdge<D>, f: &DirectedEdge<D>) -> [D; 2] {
        let Self { inverse_chi, a, b, .. } = self;
        let [cos, sin] = e.along(f.m[0], *inverse_chi);
        [cos - a[0] * b[0], sin - a[1] * b[0]]
    }

    /// `2 tan(tau/2)` of the angle `tau` from the directors of the edge `e`, transported, to those of `f`: the
    /// component along the tangent of the Cayley vector of the rotation between them.
    #[inline]
    pub fn cayley_twist(&self, e: &DirectedEdge<D>, f: &DirectedEdge<D>) -> D {
        let [cos, sin] = self.turned(e, f);
        sin / (cos + self.inverse_chi) * 2.0
    }

    /// The derivatives of the three strains (columns) by `p`, `q` and `h` (rows), for the edge `e` and for the edge
    /// `f`: the table of the header.
    #[inline(always)]
    pub fn slopes(&self, e: &DirectedEdge<D>, f: &DirectedEdge<D>) -> [[[D; 3]; 3]; 2] {
        let [c, v] = self.turned(e, f);
        let ([a1, a2], [b1, b2], one) = (self.a, self.b, c.like(1.0));
        let u = c - self.inverse_chi + 1.0;
        let (aa, bb) = ([a1 * a1, a1 * a2, a2 * a2], [b1 * b1, b1 * b2, b2 * b2]);
        [
            [[-(u + aa[0]), v - aa[1], -a2], [-(v + aa[1]), -(u + aa[2]), a1], [a2, -a1, -one]],
            [[u + bb[0], v + bb[1], b2], [bb[1] - v, u + bb[2], -b1], [-b2, b1, one]],
        ]
    }

    /// First derivatives of the energy by `p`, `q` and `h` of both edges, N m: those of the strains times their
    /// stresses `w`, N m.
    #[inline(always)]
    pub fn pull(&self, e: &DirectedEdge<D>, f: &DirectedEdge<D>, w: &[D; 3]) -> JointGradient<D> {
        let [c, v] = self.turned(e, f);
        let ([a1, a2], [b1, b2], u) = (self.a, self.b, c - self.inverse_chi + 1.0);
        let (wa, wb) = (w[0] * a1 + w[1] * a2, w[0] * b1 + w[1] * b2);
        let (u1, u2, v1, v2) = (w[0] * u, w[1] * u, w[0] * v, w[1] * v);
        JointGradient {
            e: [
                v2 - u1 - a1 * wa - w[2] * a2,
                w[2] * a1 - v1 - u2 - a2 * wa,
                w[0] * a2 - w[1] * a1 - w[2],
            ],
            f: [
                u1 + v2 + b1 * wb + w[2] * b2,
                u2 - v1 + b2 * wb - w[2] * b1,
                w[1] * b1 - w[0] * b2 + w[2],
            ],
        }
    }

    /// First and second derivatives of the energy by `p`, `q` and `h` of both edges, derived by hand. `stiffness` and
    /// stresses `w` are those of the strains, N m. The second derivatives are a block for each edge and one between
    /// them (rows of `f`, columns of `e`).
    #[inline(always)]
    pub fn tangent(
        &self,
        e: &DirectedEdge<D>,
        f: &DirectedEdge<D>,
        stiffness: &Stiffness<D>,
        w: &[D; 3],
    ) -> JointTangent<D> {
        let [c, v] = self.turned(e, f);
        let ([a1, a2], [b1, b2], rho) = (self.a, self.b, self.inverse_chi);
        let (one, [w1, w2, w3]) = (c.like(1.0), *w);
        let sigma = -rho + 1.0;
        let u = c + sigma;
        let (aa, bb) = ([a1 * a1, a1 * a2, a2 * a2], [b1 * b1, b1 * b2, b2 * b2]);

        // The strains' derivatives, and their products with the stresses of bending.
        let by_e =
            [[-(u + aa[0]), v - aa[1], -a2], [-(v + aa[1]), -(u + aa[2]), a1], [a2, -a1, -one]];
        let by_f = [[u + bb[0], v + bb[1], b2], [bb[1] - v, u + bb[2], -b1], [-b2, b1, one]];
        let (p_e, q_e, h_e) = (-bent(&by_e[0], w), -bent(&by_e[1], w), bent(&by_e[2], w));
        let (p_f, q_f, h_f) = (bent(&by_f[0], w), bent(&by_f[1], w), bent(&by_f[2], w));
        let gradient_e = [-(p_e + w3 * a2), w3 * a1 - q_e, h_e - w3];
        let gradient_f = [p_f + w3 * b2, q_f - w3 * b1, h_f + w3];

        // The stresses times the strains' second derivatives, and the stiffness of every strain: block after block,
        // so that few operations depend on the one before.
        let kw = w1 * self.strains[0] + w2 * self.strains[1];
        let (around, half) = (-(rho * kw), w3 * 0.5);
        let (w11, w12, w21, w22) = (w1 * a1, w1 * a2, w2 * a1, w2 * a2);
        let (x11, x12, x21, x22) = (w1 * b1, w1 * b2, w2 * b1, w2 * b2);

        // Block of e twice: by' K by, plus the stresses times the second derivatives of the
        // strains.
        let k = [stiffness.times(&by_e[0]), stiffness.times(&by_e[1]), stiffness.times(&by_e[2])];
        let twisted = w3 * aa[1];
        let ee = [
            dot(by_e[0], k[0]) + around + (p_e * a1) * 2.0 + w22 + twisted,
            dot(by_e[1], k[0]) + p_e * a2 + q_e * a1 - (w12 + w21) * 0.5 + half * (aa[2] - aa[0]),
            dot(by_e[1], k[1]) + around + (q_e * a2) * 2.0 + w11 - twisted,
            dot(by_e[2], k[0]) + w2 * (sigma + aa[0]) - w1 * aa[1],
            dot(by_e[2], k[1]) + w2 * aa[1] - w1 * (sigma + aa[2]),
            dot(by_e[2], k[2]) - (w11 + w22),
        ];

        // Block between the edges: rows of f, columns of e.
        let (r1, r2) = (p_e - kw * a1, q_e - kw * a2);
        let (kc, kv, wc, wv) = (kw * c, kw * v, w3 * c, w3 * v);
        let (c1, c2, v1, v2) = (w1 * c, w2 * c, w1 * v, w2 * v);
        let fe = [
            [
                dot(by_f[0], k[0]) + r1 * b1 - a1 * p_f + (w11 - x11) - kc - wv,
                dot(by_f[0], k[1]) + r2 * b1 - a2 * p_f + (w12 - x21) - kv + wc,
                dot(by_f[0], k[2]) + v1 - c2,
            ],
            [
                dot(by_f[1], k[0]) + r1 * b2 - a1 * q_f + (w21 - x12) + kv - wc,
                dot(by_f[1], k[1]) + r2 * b2 - a2 * q_f + (w22 - x22) - kc - wv,
                dot(by_f[1], k[2]) + c1 + v2,
            ],
            [dot(by_f[2], k[0]) + v1 + c2, dot(by_f[2], k[1]) + v2 - c1, dot(by_f[2], k[2])],
        ];

        // Block of f twice.
        let k = [stiffness.times(&by_f[0]), stiffness.times(&by_f[1]), stiffness.times(&by_f[2])];
        let twisted = w3 * bb[1];
        let ff = [
            dot(by_f[0], k[0]) + around - (p_f * b1) * 2.0 - x22 - twisted,
            dot(by_f[1], k[0]) + (x12 + x21) * 0.5 - p_f * b2 - q_f * b1 + half * (bb[0] - bb[2]),
            dot(by_f[1], k[1]) + around - (q_f * b2) * 2.0 - x11 + twisted,
            dot(by_f[2], k[0]) + w1 * bb[1] - w2 * (sigma + bb[0]),
            dot(by_f[2], k[1]) + w1 * (sigma + bb[2]) - w2 * bb[1],
            dot(by_f[2], k[2]) + x11 + x22,
        ];
        JointTangent {
            e: EdgeSum { gradient: gradient_e, hessian: ee },
            f: EdgeSum { gradient: gradient_f, hessian: ff },
            fe,
        }
    }
}
