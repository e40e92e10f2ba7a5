//! Bending and twisting at one inner node in space.
//!
//! Energy (Eqs. 1b and 1c): `E = 1/2 sum_a K_a (s_a - s_natural_a)^2` over the strains
//!
//! ```text
//! kb  = 2 t_e x t_f / (1 + t_e.t_f)              curvature binormal, |kb| = 2 tan(phi/2)
//! k1  = 1/2 kb.(m2_e + m2_f)                     curvature in the plane of the tangent and m1
//! k2  = -1/2 kb.(m1_e + m1_f)                    curvature in the plane of the tangent and m2
//! tau = theta_f - theta_e + reference twist      see [`crate::energy::frame`]
//! ```
//!
//! with `K = (EI1, EI2, GJ)/dl` (or a full symmetric stiffness, see
//! [`Stiffness`]), the edges `e` and `f` before and after the node, unit tangents
//! `t` and material directors `m1`, `m2`. `1 + t_e.t_f` is `|t_e + t_f|^2/2`, which keeps its
//! digits in a fold.
//!
//! # Derivatives at any state
//!
//! The directors follow the tangents by parallel transport from a stored reference tangent. The
//! derivatives in the literature (Bergou et al. 2010 and what builds on it) are those at the
//! reference itself, where transport is stationary. Away from it a change `dx` of an edge turns
//! the transported director by `g.dx` with
//!
//! ```text
//! g = -kb_t/(2 l),   kb_t = 2 t_ref x t/(1 + t_ref.t)
//! ```
//!
//! so the exact derivatives are those forms with `d theta -> d theta + g.dx`, and one more block
//! per edge, `(dE/d theta) dg/dx`. Without them both are wrong at first order in the rotation since
//! the reference. [`Published`] is the element with the forms of the literature; [`crate::check`]
//! finds, over 500 random states a row with a turning angle of 40 degrees (largest error of an
//! entry over the sum of its absolute terms;
//! `cargo test --release --test derivatives published -- --nocapture`):
//!
//! | rotation since the reference, degrees | published gradient | published Hessian | exact, both |
//! |---|---|---|---|
//! | 0 | 6.3e-16 | 3.5e-16 | 5.4e-16 |
//! | 0.1 | 8.2e-3 | 1.2e-3 | 4.4e-16 |
//! | 1 | 4.2e-2 | 1.0e-2 | 4.9e-16 |
//! | 10 | 4.2e-1 | 7.3e-2 | 7.4e-16 |
//! | 30 | 9.0e-1 | 2.5e-1 | 4.4e-16 |
//! | 60 | 1.2 | 3.4e-1 | 4.8e-16 |
//! | 120 | 8.9e-1 | 5.8e-1 | 1.6e-15 |
//!
//! A simulation that steps with the published Hessian needs about twice the Newton iterations: on
//! the paper's helix at steps of 5 ms 6.4 instead of 3.3
//! (`cargo test --release --test physics helix:: -- --nocapture`).
//! In planar motion the missing terms vanish.

use crate::energy::frame::{EdgeFrame, transported_twist};
pub(crate) use crate::energy::joint::Edge;
pub use crate::energy::joint::EdgeState;
use crate::energy::joint::{EDGE_UNKNOWNS, Joint, Pull, Rotation, Slope};
use crate::energy::{Analytic, AsEnergy, Element, Energy, Local};
use crate::numerics::scalar::{Nestable, Scalar};
use crate::numerics::vector::{Vector, add, dot, scale, sub};
use nalgebra::SVector;
use num_dual::{Dual2SVec, Dual64, DualSVec};

/// Unknowns of the node: `[x0, theta0, x1, theta1, x2]`, m and rad.
pub const UNKNOWNS: usize = 11;

/// Stiffnesses of an inner node, all over the Voronoi length, N m.
#[derive(Clone, Copy, Debug)]
pub struct Stiffness<D> {
    /// Of bending: `[b11, b12, b22]`, symmetric in the material frame; `[EI1, 0, EI2]/dl` where
    /// nothing couples them.
    pub bend: [D; 3],
    /// Stiffness of twisting, GJ/dl, N m.
    pub twist: D,
    /// Between each curvature and twisting, zero where nothing couples them.
    pub coupling: [D; 2],
}

impl<D: Scalar> Stiffness<D> {
    /// Applied to three strains.
    #[inline]
    pub(crate) fn times(&self, s: &[D; 3]) -> [D; 3] {
        let ([b11, b12, b22], [c1, c2]) = (self.bend, self.coupling);
        [
            b11 * s[0] + b12 * s[1] + c1 * s[2],
            b12 * s[0] + b22 * s[1] + c2 * s[2],
            c1 * s[0] + c2 * s[1] + self.twist * s[2],
        ]
    }

    /// Converts every number.
    pub fn map<E>(&self, mut convert: impl FnMut(D) -> E) -> Stiffness<E> {
        Stiffness {
            bend: self.bend.map(&mut convert),
            twist: convert(self.twist),
            coupling: self.coupling.map(&mut convert),
        }
    }
}

/// One inner node, with the reference its frames are transported from.
#[derive(Clone, Copy, Debug)]
pub struct BendTwist<D> {
    /// Over the Voronoi length, N m.
    pub stiffness: Stiffness<D>,
    /// Integrated natural curvatures and natural twist (rad) in the material frame.
    pub natural: [D; 3],
    /// Reference of the two edges.
    pub frames: [EdgeFrame<D>; 2],
    /// Reference twist, rad.
    pub twist: D,
}

/// Stiffnesses and natural strains of a node: what does not change as the rod moves.
#[derive(Clone, Copy, Debug)]
pub struct JointLaw<D> {
    /// Over the Voronoi length, N m.
    pub stiffness: Stiffness<D>,
    /// Integrated natural curvatures and natural twist (rad) in the material frame.
    pub natural: [D; 3],
}

impl<D: Scalar> JointLaw<D> {
    /// The node with a reference.
    #[inline]
    pub fn at(&self, frames: [EdgeFrame<D>; 2], twist: D) -> BendTwist<D> {
        BendTwist { stiffness: self.stiffness, natural: self.natural, frames, twist }
    }

    /// Gradient between two edges whose frames are where they are, for a twist in rad: what is left
    /// of [`gradient_between`](BendTwist::gradient_between) at the reference.
    #[inline]
    pub(crate) fn pull(&self, e: &Edge<D>, f: &Edge<D>, twist: D) -> Pull<D> {
        let joint = Joint::new(*e, *f, twist);
        joint.pull(&self.stiffness.times(&sub(joint.strains, self.natural)))
    }

    /// The same node with Kelvin-Voigt stress over one step: see [`crate::dynamics::coefficients`].
    #[inline]
    pub fn viscous(&self, factor: D, shift: &[D; 3]) -> Self {
        Self {
            stiffness: self.stiffness.map(|k| k * factor),
            natural: std::array::from_fn(|a| (self.natural[a] + shift[a]) / factor),
        }
    }
}

#[inline]
fn split<D: Copy>(q: &[D; UNKNOWNS]) -> ([Vector<D>; 3], [D; 2]) {
    ([[q[0], q[1], q[2]], [q[4], q[5], q[6]], [q[8], q[9], q[10]]], [q[3], q[7]])
}

/// The unknowns in terms of edges.
#[inline]
fn to_edges<D: Scalar>(q: &[D; UNKNOWNS]) -> [D; EDGE_UNKNOWNS] {
    let ([x0, x1, x2], [te, tf]) = split(q);
    let (e, f) = (sub(x1, x0), sub(x2, x1));
    [e[0], e[1], e[2], te, f[0], f[1], f[2], tf]
}

/// Spreads a gradient with respect to the edges' unknowns over the nodes.
#[inline]
fn to_nodes<D: Scalar>(g: &[D; EDGE_UNKNOWNS]) -> [D; UNKNOWNS] {
    let [e0, e1, e2, te, f0, f1, f2, tf] = *g;
    [-e0, -e1, -e2, te, e0 - f0, e1 - f1, e2 - f2, tf, f0, f1, f2]
}

/// Spreads a Hessian with respect to the edges' unknowns over the nodes.
#[inline]
fn hessian_to_nodes<D: Scalar>(
    h: &[[D; EDGE_UNKNOWNS]; EDGE_UNKNOWNS],
) -> [[D; UNKNOWNS]; UNKNOWNS] {
    let half = h.map(|row| to_nodes(&row));
    // Columns are spread; now the rows.
    let mut out = [[D::from(0.0); UNKNOWNS]; UNKNOWNS];
    for c in 0..UNKNOWNS {
        let column = to_nodes(&std::array::from_fn(|r| half[r][c]));
        for r in 0..UNKNOWNS {
            out[r][c] = column[r];
        }
    }
    out
}

impl<D: Scalar> BendTwist<D> {
    #[inline]
    fn joint(&self, [e0, e1, e2, te, f0, f1, f2, tf]: &[D; EDGE_UNKNOWNS]) -> Joint<D> {
        let e = Edge::new(&self.frames[0], [*e0, *e1, *e2], *te);
        let f = Edge::new(&self.frames[1], [*f0, *f1, *f2], *tf);
        self.meet(e, f, *tf - *te)
    }

    /// The joint of two edges whose angles differ by `turn`, rad.
    #[inline]
    fn meet(&self, e: Edge<D>, f: Edge<D>, turn: D) -> Joint<D> {
        let from = [self.frames[0].tangent, self.frames[1].tangent];
        let transported = transported_twist(from, [e.tangent, f.tangent]);
        Joint::new(e, f, turn + (self.twist - transported))
    }

    /// As [`tangent`](Element::tangent), for edges known already; `turn` is how much the second's
    /// angle exceeds the first's, rad.
    #[inline]
    pub fn tangent_between(
        &self,
        e: &EdgeState<D>,
        f: &EdgeState<D>,
        turn: D,
    ) -> Local<D, UNKNOWNS> {
        let joint = self.meet(e.edge, f.edge, turn);
        spread(self.tangent_of(&joint, &[e.rotation, f.rotation]))
    }

    /// As [`gradient`](Element::gradient), for edges known already.
    #[inline]
    pub fn gradient_between(&self, e: &EdgeState<D>, f: &EdgeState<D>, turn: D) -> [D; UNKNOWNS] {
        let joint = self.meet(e.edge, f.edge, turn);
        let (stress, _) = self.stress(&joint.strains);
        to_nodes(&Self::gradient_of(&joint, &[e.rotation, f.rotation], &stress))
    }

    /// Integrated curvatures and twist (rad) in the material frame.
    #[inline]
    pub fn strains(&self, q: &[D; UNKNOWNS]) -> [D; 3] {
        self.joint(&to_edges(q)).strains
    }

    /// Energies of bending and twisting, J; of a coupling between them, half each.
    #[inline]
    pub fn energies(&self, q: &[D; UNKNOWNS]) -> [D; 2] {
        let (stress, strain) = self.stress(&self.strains(q));
        [(stress[0] * strain[0] + stress[1] * strain[1]) * 0.5, stress[2] * strain[2] * 0.5]
    }

    /// The energy as a function of the edges: eight unknowns instead of eleven.
    #[inline]
    fn energy_of_edges(&self, edges: &[D; EDGE_UNKNOWNS]) -> D {
        let (stress, strain) = self.stress(&self.joint(edges).strains);
        dot(stress, strain) * 0.5
    }

    /// dE/ds of every strain, and the strains less the natural ones.
    #[inline]
    fn stress(&self, strains: &[D; 3]) -> ([D; 3], [D; 3]) {
        let strain = sub(*strains, self.natural);
        (self.stiffness.times(&strain), strain)
    }

    #[inline]
    fn rotations(&self, joint: &Joint<D>) -> [Rotation<D>; 2] {
        [Rotation::new(&self.frames[0], &joint.e), Rotation::new(&self.frames[1], &joint.f)]
    }

    /// Gradient with respect to the edges' unknowns for given stresses.
    #[inline]
    fn gradient_of(
        joint: &Joint<D>,
        rotations: &[Rotation<D>; 2],
        w: &[D; 3],
    ) -> [D; EDGE_UNKNOWNS] {
        let Pull { e, f, theta: [te, tf] } = joint.pull(w);
        let e = add(e, scale(rotations[0].turn, te));
        let f = add(f, scale(rotations[1].turn, tf));
        [e[0], e[1], e[2], te, f[0], f[1], f[2], tf]
    }

    /// Energy and derivatives with respect to the edges' unknowns (the Hessian's lower triangle).
    #[inline]
    fn tangent_of(
        &self,
        joint: &Joint<D>,
        rotations: &[Rotation<D>; 2],
    ) -> Local<D, EDGE_UNKNOWNS> {
        let (w, strain) = self.stress(&joint.strains);
        let slopes = joint.slopes(rotations);
        let zero = D::from(0.0);
        let mut gradient = [zero; EDGE_UNKNOWNS];
        let mut h = joint.curvature(rotations, &w);
        // The stiffness of every strain.
        let row = |a: usize| {
            let Slope { e, f, theta } = &slopes[a];
            [e[0], e[1], e[2], theta[0], f[0], f[1], f[2], theta[1]]
        };
        let rows = [row(0), row(1), row(2)];
        for r in 0..EDGE_UNKNOWNS {
            let s = [rows[0][r], rows[1][r], rows[2][r]];
            gradient[r] = dot(w, s);
            let ks = self.stiffness.times(&s);
            for c in 0..=r {
                h[r][c] += ks[0] * rows[0][c] + ks[1] * rows[1][c] + ks[2] * rows[2][c];
            }
        }
        // (dE/dtheta) dg/dx.
        for (edge, first, torque) in [(0, 0, gradient[3]), (1, 4, gradient[7])] {
            let Rotation { turn, bow } = &rotations[edge];
            let turn = scale(*turn, torque);
            for r in 0..3 {
                for c in 0..=r {
                    h[first + r][first + c] += turn[r] * bow[c] + bow[r] * turn[c];
                }
            }
        }
        Local { energy: dot(w, strain) * 0.5, gradient, hessian: h }
    }
}

/// Fills the upper triangle from the lower.
#[inline]
fn symmetric<D: Copy, const N: usize>(mut h: [[D; N]; N]) -> [[D; N]; N] {
    for r in 0..N {
        for c in r + 1..N {
            h[r][c] = h[c][r];
        }
    }
    h
}

/// Spreads energy and derivatives over the nodes.
#[inline]
fn spread<D: Scalar>(local: Local<D, EDGE_UNKNOWNS>) -> Local<D, UNKNOWNS> {
    Local {
        energy: local.energy,
        gradient: to_nodes(&local.gradient),
        hessian: hessian_to_nodes(&symmetric(local.hessian)),
    }
}

impl<D: Scalar> Element<D, UNKNOWNS> for BendTwist<D> {
    const NAME: &'static str = "bend and twist";
    type Over<E: Scalar> = BendTwist<E>;

    fn map<E: Scalar>(&self, convert: impl Fn(D) -> E) -> BendTwist<E> {
        let frame = |frame: EdgeFrame<D>| EdgeFrame {
            tangent: frame.tangent.map(&convert),
            director: frame.director.map(&convert),
        };
        BendTwist {
            stiffness: self.stiffness.map(&convert),
            natural: self.natural.map(&convert),
            frames: self.frames.map(frame),
            twist: convert(self.twist),
        }
    }

    #[inline]
    fn energy(&self, q: &[D; UNKNOWNS]) -> D {
        self.energy_of_edges(&to_edges(q))
    }

    #[inline]
    fn gradient(&self, q: &[D; UNKNOWNS]) -> [D; UNKNOWNS] {
        let joint = self.joint(&to_edges(q));
        let rotations = self.rotations(&joint);
        to_nodes(&Self::gradient_of(&joint, &rotations, &self.stress(&joint.strains).0))
    }

    #[inline]
    fn tangent(&self, q: &[D; UNKNOWNS]) -> Local<D, UNKNOWNS> {
        let joint = self.joint(&to_edges(q));
        let rotations = self.rotations(&joint);
        spread(self.tangent_of(&joint, &rotations))
    }

    /// Only stiffnesses and natural strains carry derivatives here; those of the reference are the
    /// rod's business.
    fn gradient_rate(element: &BendTwist<Dual64>, q: &[f64; UNKNOWNS]) -> [f64; UNKNOWNS] {
        let real = element.map(|x| x.re);
        let joint = real.joint(&to_edges(q));
        let rotations = real.rotations(&joint);
        let (stress, _) = element.stress(&joint.strains.map(Dual64::from));
        let stress = stress.map(|w| w.eps);
        to_nodes(&BendTwist::gradient_of(&joint, &rotations, &stress))
    }
}

impl BendTwist<Dual64> {
    /// Without the derivatives of the reference.
    pub(crate) fn with_still_reference(mut self) -> Self {
        let still = |v: Vector<Dual64>| v.map(|x| Dual64::from(x.re));
        self.frames = self.frames.map(|frame| EdgeFrame {
            tangent: still(frame.tangent),
            director: still(frame.director),
        });
        self.twist = Dual64::from(self.twist.re);
        self
    }
}

/// The gradient by num-dual, through the edges' unknowns.
pub fn dual_gradient<D: Nestable>(element: &BendTwist<D>, q: &[D; UNKNOWNS]) -> [D; UNKNOWNS] {
    type Over<D> = DualSVec<D, EDGE_UNKNOWNS>;
    let over = element.map(Over::<D>::from_re);
    let energy = |q: SVector<Over<D>, EDGE_UNKNOWNS>| over.energy_of_edges(&q.data.0[0]);
    let (_, gradient) = num_dual::gradient(energy, &SVector::from(to_edges(q)));
    to_nodes(&gradient.data.0[0])
}

/// Energy, gradient and Hessian by num-dual, through the edges' unknowns: eight seeds instead of
/// eleven.
pub fn dual_tangent<D: Nestable>(element: &BendTwist<D>, q: &[D; UNKNOWNS]) -> Local<D, UNKNOWNS> {
    type Over<D> = Dual2SVec<D, EDGE_UNKNOWNS>;
    let over = element.map(Over::<D>::from_re);
    let energy = |q: SVector<Over<D>, EDGE_UNKNOWNS>| over.energy_of_edges(&q.data.0[0]);
    let (energy, gradient, hessian) = num_dual::hessian(energy, &SVector::from(to_edges(q)));
    spread(Local { energy, gradient: gradient.data.0[0], hessian: hessian.data.0 })
}

/// The element with the derivatives of the literature, which take the state for the reference.
/// It serves to show what they miss.
#[derive(Clone, Copy, Debug)]
pub struct Published(pub BendTwist<f64>);

impl Published {
    /// Energy, and the published gradient and Hessian.
    pub fn tangent(&self, q: &[f64; UNKNOWNS]) -> Local<f64, UNKNOWNS> {
        let joint = self.0.joint(&to_edges(q));
        spread(self.0.tangent_of(&joint, &[Rotation::none(), Rotation::none()]))
    }
}

impl Energy<UNKNOWNS> for Published {
    fn energy<D: Scalar>(&self, q: &[D; UNKNOWNS]) -> D {
        AsEnergy(self.0).energy(q)
    }
}

impl Analytic<UNKNOWNS> for Published {
    fn gradient(&self, q: &[f64; UNKNOWNS]) -> [f64; UNKNOWNS] {
        self.tangent(q).gradient
    }
    fn hessian(&self, q: &[f64; UNKNOWNS]) -> [[f64; UNKNOWNS]; UNKNOWNS] {
        self.tangent(q).hessian
    }
}
