//! Two edges that meet in a node of space: their frames, the strains there, and the derivatives of
//! the strains. The formulas are explained in [`bend_twist`](super::bend_twist).

use crate::energy::frame::{EdgeFrame, one_plus_dot};
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::{Vector, add, combine, cross, dot, scale, sub};

/// Unknowns of a joint in terms of its edges: `[e, theta_e, f, theta_f]`, m and rad.
pub(super) const EDGE_UNKNOWNS: usize = 8;

/// An edge as it is: inverse length, tangent and material directors.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Edge<D> {
    pub inverse_length: D,
    pub tangent: Vector<D>,
    pub m: [Vector<D>; 2],
}

impl<D: Scalar> Edge<D> {
    #[inline]
    pub fn new(frame: &EdgeFrame<D>, e: Vector<D>, angle: D) -> Self {
        let inverse_length = dot(e, e).sqrt().recip();
        let tangent = scale(e, inverse_length);
        Self { inverse_length, tangent, m: frame.material(tangent, angle) }
    }

    /// An edge whose frame has moved with it.
    #[inline]
    pub fn moved(frame: &EdgeFrame<D>, inverse_length: D, angle: D) -> Self {
        Self { inverse_length, tangent: frame.tangent, m: frame.turned(angle) }
    }
}

/// How an edge has rotated since its reference.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rotation<D> {
    /// `g`: the turn of the transported director per change of the edge, 1/m.
    pub turn: Vector<D>,
    /// `-(t + (t + t_ref)/(1 + t.t_ref))/(2 l)`: with `turn`, the block of `dg/dx`, 1/m.
    pub bow: Vector<D>,
}

impl<D: Scalar> Rotation<D> {
    #[inline]
    pub fn new(frame: &EdgeFrame<D>, edge: &Edge<D>) -> Self {
        let (from, to) = (frame.tangent, edge.tangent);
        let inverse = one_plus_dot(from, to).recip();
        let half = edge.inverse_length * 0.5;
        Self {
            turn: scale(cross(from, to), -(inverse * edge.inverse_length)),
            bow: combine(-half, to, -(half * inverse), add(from, to)),
        }
    }

    /// As the literature has it: no rotation.
    pub fn none() -> Self {
        let zero = D::from(0.0);
        Self { turn: [zero; 3], bow: [zero; 3] }
    }
}

/// An edge with its rotation: what two neighbouring nodes share.
#[derive(Clone, Copy, Debug)]
pub struct EdgeState<D> {
    pub(super) edge: Edge<D>,
    pub(super) rotation: Rotation<D>,
}

impl<D: Scalar> EdgeState<D> {
    /// The edge `e`, m, with its angle, rad.
    #[inline]
    pub fn new(frame: &EdgeFrame<D>, e: Vector<D>, angle: D) -> Self {
        let edge = Edge::new(frame, e, angle);
        Self { rotation: Rotation::new(frame, &edge), edge }
    }
}

/// Two edges that meet in a node, and the strains there.
pub(super) struct Joint<D> {
    pub e: Edge<D>,
    pub f: Edge<D>,
    /// 1/(1 + t_e.t_f).
    pub inverse_chi: D,
    /// Curvature binormal.
    pub kb: Vector<D>,
    pub strains: [D; 3],
}

/// What a joint's stresses do to its edges: the gradient at fixed frames.
pub(crate) struct Pull<D> {
    pub e: Vector<D>,
    pub f: Vector<D>,
    pub theta: [D; 2],
}

/// First derivatives of one strain.
pub(super) struct Slope<D> {
    pub e: Vector<D>,
    pub f: Vector<D>,
    pub theta: [D; 2],
}

impl<D: Scalar> Joint<D> {
    /// Two edges and the twist between them, rad.
    #[inline]
    pub fn new(e: Edge<D>, f: Edge<D>, twist: D) -> Self {
        let inverse_chi = one_plus_dot(e.tangent, f.tangent).recip();
        let kb = scale(cross(e.tangent, f.tangent), inverse_chi * 2.0);
        let strains =
            [dot(kb, add(e.m[1], f.m[1])) * 0.5, -(dot(kb, add(e.m[0], f.m[0])) * 0.5), twist];
        Self { e, f, inverse_chi, kb, strains }
    }

    /// The sum of the [`slopes`](Self::slopes) times the stresses `w`, but for the rotations.
    #[inline]
    pub fn pull(&self, w: &[D; 3]) -> Pull<D> {
        let Self { e, f, inverse_chi, kb, strains } = self;
        let c_e = combine(w[0], e.m[1], -w[1], e.m[0]);
        let c_f = combine(w[0], f.m[1], -w[1], f.m[0]);
        let c = scale(add(c_e, c_f), *inverse_chi);
        let along = -((w[0] * strains[0] + w[1] * strains[1]) * *inverse_chi);
        let both = combine(along, add(e.tangent, f.tangent), w[2] * 0.5, *kb);
        let turn = |m: &[Vector<D>; 2]| dot(*kb, combine(w[0], m[0], w[1], m[1])) * 0.5;
        Pull {
            e: scale(add(both, cross(f.tangent, c)), e.inverse_length),
            f: scale(add(both, cross(c, e.tangent)), f.inverse_length),
            theta: [-(turn(&e.m)) - w[2], w[2] - turn(&f.m)],
        }
    }

    /// (t_e + t_f)/(1 + t_e.t_f).
    #[inline]
    fn tilde(&self) -> Vector<D> {
        scale(add(self.e.tangent, self.f.tangent), self.inverse_chi)
    }

    /// First derivatives of the strains.
    #[inline]
    pub fn slopes(&self, rotations: &[Rotation<D>; 2]) -> [Slope<D>; 3] {
        let Self { e, f, inverse_chi, kb, strains } = self;
        let tilde = self.tilde();
        let [s1, s2] = [0, 1].map(|a| scale(add(e.m[a], f.m[a]), *inverse_chi));
        let (le, lf) = (e.inverse_length, f.inverse_length);
        let [ge, gf] = [rotations[0].turn, rotations[1].turn];
        let bend = |k: D, towards_e: Vector<D>, towards_f: Vector<D>, theta: [D; 2]| Slope {
            e: add(scale(combine(-k, tilde, D::from(1.0), towards_e), le), scale(ge, theta[0])),
            f: add(scale(combine(-k, tilde, D::from(1.0), towards_f), lf), scale(gf, theta[1])),
            theta,
        };
        let minus_half = *kb;
        let turn = |m: usize| [-(dot(minus_half, e.m[m]) * 0.5), -(dot(minus_half, f.m[m]) * 0.5)];
        let minus = D::from(-1.0);
        [
            bend(strains[0], cross(f.tangent, s2), cross(s2, e.tangent), turn(0)),
            bend(strains[1], cross(s1, f.tangent), cross(e.tangent, s1), turn(1)),
            Slope {
                e: combine(le * 0.5, *kb, minus, ge),
                f: combine(lf * 0.5, *kb, D::from(1.0), gf),
                theta: [minus, D::from(1.0)],
            },
        ]
    }

    /// `sum_a w_a d2 s_a` with respect to the edges' unknowns, the lower triangle, without the
    /// blocks of `dg/dx`.
    #[inline]
    pub fn curvature(
        &self,
        rotations: &[Rotation<D>; 2],
        w: &[D; 3],
    ) -> [[D; EDGE_UNKNOWNS]; EDGE_UNKNOWNS] {
        let Self { e, f, inverse_chi, kb, strains } = self;
        let (te, tf, tilde, ix) = (e.tangent, f.tangent, self.tilde(), *inverse_chi);
        let (le, lf) = (e.inverse_length, f.inverse_length);
        let [ge, gf] = [rotations[0].turn, rotations[1].turn];
        let c_e = combine(w[0], e.m[1], -w[1], e.m[0]);
        let c_f = combine(w[0], f.m[1], -w[1], f.m[0]);
        let n_e = combine(w[0], e.m[0], w[1], e.m[1]);
        let n_f = combine(w[0], f.m[0], w[1], f.m[1]);
        let c = scale(add(c_e, c_f), ix);
        let kw = w[0] * strains[0] + w[1] * strains[1];
        let (a, b) = (cross(tf, c), cross(te, c));
        let half = |n: Vector<D>| dot(*kb, n) * 0.5;
        let (ne, nf) = (half(n_e), half(n_f));
        let e_te = scale(combine(ne, tilde, -ix, cross(tf, n_e)), le);
        let e_tf = scale(combine(nf, tilde, -ix, cross(tf, n_f)), le);
        let f_te = scale(combine(ne, tilde, ix, cross(te, n_e)), lf);
        let f_tf = scale(combine(nf, tilde, ix, cross(te, n_f)), lf);
        let (q_e, q_f) = (-half(c_e), -half(c_f));

        let mut h = [[D::from(0.0); EDGE_UNKNOWNS]; EDGE_UNKNOWNS];
        // Diagonal blocks: sums of u v' + v u', and of I - t t'.
        let quarter = w[2] * -0.25;
        let around = -(kw * ix);
        let mut block = |first: usize,
                         t: Vector<D>,
                         l: D,
                         by_tilde: Vector<D>,
                         c: Vector<D>,
                         g: Vector<D>,
                         by_g: Vector<D>| {
            let l2 = l * l;
            let by_tilde = scale(by_tilde, l2);
            let by_kb = scale(combine(D::from(0.25), c, quarter, add(t, tilde)), l2);
            let around = around * l2;
            for r in 0..3 {
                for s in 0..=r {
                    h[first + r][first + s] = tilde[r] * by_tilde[s]
                        + by_tilde[r] * tilde[s]
                        + (kb[r] * by_kb[s] + by_kb[r] * kb[s])
                        + (g[r] * by_g[s] + by_g[r] * g[s])
                        - around * t[r] * t[s];
                }
                h[first + r][first + r] += around;
            }
        };
        let one = D::from(1.0);
        block(0, te, le, combine(kw, tilde, -one, a), c_e, ge, combine(one, e_te, q_e * 0.5, ge));
        block(4, tf, lf, combine(kw, tilde, one, b), c_f, gf, combine(one, f_tf, q_f * 0.5, gf));

        // Rows f, columns e: the transpose of
        // (2 kw T - a - w3/2 kb) T' + T b' - kw/chi (I + t_e t_f') + [w3/chi t_e - c]x.
        let lelf = le * lf;
        let by_tilde = scale(sub(combine(kw * 2.0, tilde, w[2] * -0.5, *kb), a), lelf);
        let (b, v) = (scale(b, lelf), scale(combine(w[2] * ix, te, -one, c), lelf));
        let around = around * lelf;
        let skew =
            [[D::from(0.0), v[2], -v[1]], [-v[2], D::from(0.0), v[0]], [v[1], -v[0], D::from(0.0)]];
        for r in 0..3 {
            for s in 0..3 {
                h[4 + r][s] = tilde[r] * by_tilde[s]
                    + b[r] * tilde[s]
                    + around * tf[r] * te[s]
                    + skew[r][s]
                    + (gf[r] * e_tf[s] + f_te[r] * ge[s]);
            }
            h[4 + r][r] += around;
        }
        for s in 0..3 {
            h[3][s] = e_te[s] + q_e * ge[s];
            h[7][s] = e_tf[s];
            h[4 + s][3] = f_te[s];
            h[7][4 + s] = f_tf[s] + q_f * gf[s];
        }
        h[3][3] = q_e;
        h[7][7] = q_f;
        h
    }
}
