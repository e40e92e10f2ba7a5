//! Element for bending and twisting at one inner node of a rod in space: energy, hand-derived gradient and Hessian.
//!
//! Input: three node positions (m) and the angles of both edges (rad) in the order of [`UNKNOWNS`]. A [`BendTwist`] has
//! stiffness, natural strains and the references of the directors. Output: strains (rad), energy (J), gradient (N, N m
//! for angles) and full Hessian, also by num-dual ([`dual_gradient`], [`dual_tangent`]). [`JointLaw`] is the law alone:
//! `pull` returns its first derivatives by rotations of both edges, `pack_lanes` puts several laws in SIMD lanes. `at`
//! makes the element of a node from a law and the frames, `strains` are its strains; `joint` makes the joint of two
//! edges, `energies` are those of bending and of twisting.
//!
//! Other energies of a joint share the unknowns: `to_edges` returns those of the edges (`EDGE_UNKNOWNS`), `by_edges`
//! converts derivatives by `p`, `q` and `h` to them, `to_nodes` and `spread` those by the edges to those by the nodes.
//!
//! Energy (Huang and Jawed 2019, Eqs. 1b and 1c): `E = 1/2 sum_a K_a (s_a - s_natural_a)^2` over the strains
//!
//! ```text
//! kb  = 2 t_e x t_f / (1 + t_e.t_f)         curvature binormal, |kb| = 2 tan(phi/2)
//! k1  = 1/2 kb.(m2_e + m2_f)                curvature in the plane of the tangent and m1
//! k2  = -1/2 kb.(m1_e + m1_f)               curvature in the plane of the tangent and m2
//! tau = theta_f - theta_e + reference twist   see [`crate::energy::frame`]
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
//! derivatives in the literature (Bergou et al. 2010 and later work) are those at the
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
pub use crate::energy::joint::EdgeState;
use crate::energy::joint::{
    DirectedEdge, EdgeSum, JointGradient, JointStrains, JointTangent, between,
};
use crate::energy::law::Law;
pub use crate::energy::law::Stiffness;
use crate::energy::law::Symmetric;
use crate::energy::{Analytic, AsEnergy, Element, Energy, Local};
use crate::numerics::out_of_line::OutOfLine;
use crate::numerics::scalar::{RodScalar, Scalar, SimdScalar};
use crate::numerics::vector::{Vector, components, dot, map_components, sub};
use nalgebra::SVector;
use num_dual::{Dual2SVec, DualSVec};

/// Number of unknowns of the element: `[x0, theta0, x1, theta1, x2]`, three node positions, m, and two edge angles,
/// rad.
pub const UNKNOWNS: usize = 11;
/// Number of unknowns in terms of its edges: `[e, theta_e, f, theta_f]`, two edge vectors, m, and their angles, rad.
pub(crate) const EDGE_UNKNOWNS: usize = 8;

/// Bending and twisting element at one inner node, with the reference from which its frames are transported.
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

/// The elastic law of bending and twisting at an inner node: stiffnesses and natural strains.
#[derive(Clone, Copy, Debug)]
pub struct JointLaw<D> {
    /// Over the Voronoi length, N m.
    pub stiffness: Stiffness<D>,
    /// Integrated natural curvatures and natural twist (rad) in the material frame.
    pub natural: [D; 3],
}

impl<D: Scalar> JointLaw<D> {
    /// A law with stiffnesses and natural strains of zero, as padding of SIMD lanes.
    pub(crate) fn none() -> Self {
        let zero = D::from(0.0);
        let stiffness = Stiffness { bend: [zero; 3], twist: zero, coupling: [zero; 2] };
        Self { stiffness, natural: [zero; 3] }
    }

    /// The laws `all` of consecutive nodes as one law in SIMD lanes: lane `k` has the numbers of law `k`. Panics for
    /// fewer laws than lanes.
    #[inline(always)]
    pub(crate) fn pack_lanes<V: SimdScalar<D>>(level: V::Level, all: &[Self]) -> JointLaw<V> {
        JointLaw {
            stiffness: Stiffness::pack_lanes(level, all, |law| &law.stiffness),
            natural: [
                V::gather(level, |lane| all[lane].natural[0]),
                V::gather(level, |lane| all[lane].natural[1]),
                V::gather(level, |lane| all[lane].natural[2]),
            ],
        }
    }

    /// The element of a node with this law, the reference frames of its two edges, and their reference twist, rad.
    #[inline(always)]
    pub fn at(&self, frames: [EdgeFrame<D>; 2], twist: D) -> BendTwist<D> {
        BendTwist { stiffness: self.stiffness, natural: self.natural, frames, twist }
    }

    /// First derivatives of the energy, N m, by `p`, `q` and `h` of the edges `e` and `f`, with the total `twist`, rad.
    /// `p` and `q` are rotations of the tangent towards both directors, `h` is the rotation about it, rad. See
    /// [`JointStrains`].
    #[inline(always)]
    pub(crate) fn pull(
        &self,
        e: &DirectedEdge<D>,
        f: &DirectedEdge<D>,
        twist: D,
    ) -> JointGradient<D> {
        let joint = JointStrains::new(e, f, twist);
        joint.pull(e, f, &self.stress(&joint.strains))
    }
}

impl<D: Scalar> Law<D, 3> for JointLaw<D> {
    type Stiffness = Stiffness<D>;

    const KINDS: [usize; 3] = [1, 1, 2];

    /// The stiffness over the Voronoi length, N m.
    #[inline(always)]
    fn stiffness(&self) -> Stiffness<D> {
        self.stiffness
    }

    /// Natural strains: integrated curvatures and twist, rad, `[k1, k2, tau]`, at which there is no stress.
    #[inline(always)]
    fn natural(&self) -> [D; 3] {
        self.natural
    }

    /// The law with another stiffness, N m, and other natural strains.
    #[inline(always)]
    fn with(&self, stiffness: Stiffness<D>, natural: [D; 3]) -> Self {
        Self { stiffness, natural }
    }

    /// Energies of stretching (zero), bending and twisting, J, at the difference `s` of the strains from the natural
    /// ones. Half of a coupling between bending and twisting belongs to each of the two.
    #[inline(always)]
    fn energies(&self, s: &[D; 3]) -> [D; 3] {
        let stress: [D; 3] = self.stiffness.times(s);
        // The energy of a coupling is half in each of both products.
        let bend = (stress[0] * s[0] + stress[1] * s[1]) * 0.5;
        [s[0].like(0.0), bend, stress[2] * s[2] * 0.5]
    }
}

/// The positions of the three nodes, m, and the angles of the two edges, rad, from the unknowns
/// `[x0, theta0, x1, theta1, x2]`.
#[inline]
fn split<D: Copy>(q: &[D; UNKNOWNS]) -> ([Vector<D>; 3], [D; 2]) {
    ([[q[0], q[1], q[2]], [q[4], q[5], q[6]], [q[8], q[9], q[10]]], [q[3], q[7]])
}

/// The unknowns in terms of edges: edge vectors from differences of nodes, m, and edge angles, rad.
#[inline]
pub(crate) fn to_edges<D: Scalar>(q: &[D; UNKNOWNS]) -> [D; EDGE_UNKNOWNS] {
    let ([x0, x1, x2], [te, tf]) = split(q);
    let (e, f) = (sub(x1, x0), sub(x2, x1));
    [e[0], e[1], e[2], te, f[0], f[1], f[2], tf]
}

/// Gradient by the 11 unknowns of the nodes from the gradient `g` by the 8 unknowns of the edges: the transposed
/// differences, with angles unchanged.
#[inline]
pub(crate) fn to_nodes<D: Scalar>(g: &[D; EDGE_UNKNOWNS]) -> [D; UNKNOWNS] {
    let [e0, e1, e2, te, f0, f1, f2, tf] = *g;
    [-e0, -e1, -e2, te, e0 - f0, e1 - f1, e2 - f2, tf, f0, f1, f2]
}

/// Hessian by the 11 unknowns of the nodes from the full Hessian `h` by the 8 unknowns of the edges: [`to_nodes`] of
/// every row, then of every column.
#[inline]
fn hessian_to_nodes<D: Scalar>(
    h: &[[D; EDGE_UNKNOWNS]; EDGE_UNKNOWNS],
) -> [[D; UNKNOWNS]; UNKNOWNS] {
    let mut half = [[D::from(0.0); UNKNOWNS]; EDGE_UNKNOWNS];
    for r in 0..EDGE_UNKNOWNS {
        half[r] = to_nodes(&h[r]);
    }
    // Columns are spread; now the rows.
    let mut out = [[D::from(0.0); UNKNOWNS]; UNKNOWNS];
    for c in 0..UNKNOWNS {
        let column = to_nodes(&components(|r| half[r][c]));
        for r in 0..UNKNOWNS {
            out[r][c] = column[r];
        }
    }
    out
}

/// Two edges and the joint between them.
struct JointState<D> {
    /// The first edge.
    e: EdgeState<D>,
    /// The second edge.
    f: EdgeState<D>,
    /// The joint between them.
    joint: JointStrains<D>,
}

impl<D: Scalar> BendTwist<D> {
    /// The two edges and the joint between them, at the edge vectors, m, and angles, rad: directors are transported
    /// from the reference frames.
    #[inline(always)]
    fn joined(&self, [e0, e1, e2, te, f0, f1, f2, tf]: &[D; EDGE_UNKNOWNS]) -> JointState<D> {
        let e = EdgeState::new(&self.frames[0], [*e0, *e1, *e2], *te);
        let f = EdgeState::new(&self.frames[1], [*f0, *f1, *f2], *tf);
        JointState { e, f, joint: self.joint(&e, &f, *tf - *te) }
    }

    /// The joint of two edges whose angles differ by `turn`, rad. Its twist is `turn` plus the reference twist, moved
    /// to the present tangents.
    #[inline(always)]
    pub(crate) fn joint(&self, e: &EdgeState<D>, f: &EdgeState<D>, turn: D) -> JointStrains<D> {
        // The reference twist belongs to the reference tangents; transport to the present ones
        // changes it by an area on the sphere.
        let from = [self.frames[0].tangent, self.frames[1].tangent];
        let transported = transported_twist(from, [e.edge.tangent, f.edge.tangent]);
        JointStrains::new(&e.edge, &f.edge, turn + (self.twist - transported))
    }

    /// The strains `[k1, k2, tau]` at the unknowns `q`: integrated curvatures in the material frame, and the twist,
    /// rad.
    #[inline]
    pub fn strains(&self, q: &[D; UNKNOWNS]) -> [D; 3] {
        self.joined(&to_edges(q)).joint.strains
    }

    /// Energies `[bending, twisting]`, J, at the unknowns `q`; half of a coupling between them belongs to each.
    #[inline]
    pub fn energies(&self, q: &[D; UNKNOWNS]) -> [D; 2] {
        let law = self.law();
        let [_, bend, twist] = law.energies(&law.difference(&self.strains(q)));
        [bend, twist]
    }

    /// The energy, J, as a function of the 8 unknowns of the edges: half the product of stresses and strains less
    /// natural ones.
    #[inline]
    fn energy_of_edges(&self, edges: &[D; EDGE_UNKNOWNS]) -> D {
        let (law, strains) = (self.law(), self.joined(edges).joint.strains);
        dot(law.stress(&strains), law.difference(&strains)) * 0.5
    }

    /// The law of the element: stiffness and natural strains without the reference frames.
    #[inline(always)]
    fn law(&self) -> JointLaw<D> {
        JointLaw { stiffness: self.stiffness, natural: self.natural }
    }

    /// Gradient by the 8 unknowns of the edges, N and N m, at the state of the joint, for the stresses `w` of the three
    /// strains, N m; derived by hand.
    #[inline]
    fn gradient_of(JointState { e, f, joint }: &JointState<D>, w: &[D; 3]) -> [D; EDGE_UNKNOWNS] {
        let pull = joint.pull(&e.edge, &f.edge, w);
        let zero = D::from(0.0);
        let [e0, e1, e2, te] = e.gradient(pull.e, zero);
        let [f0, f1, f2, tf] = f.gradient(pull.f, zero);
        [e0, e1, e2, te, f0, f1, f2, tf]
    }

    /// Energy, gradient and lower triangle of the Hessian by the 8 unknowns of the edges, at the state of the joint.
    fn tangent_of(&self, JointState { e, f, joint }: &JointState<D>) -> Local<D, EDGE_UNKNOWNS> {
        let (law, strains) = (self.law(), &joint.strains);
        let (w, strain) = (law.stress(strains), law.difference(strains));
        let tangent = joint.tangent(&e.edge, &f.edge, &self.stiffness, &w);
        by_edges([e, f], &tangent, D::from(0.0), dot(w, strain) * 0.5)
    }
}

/// The given `energy`, J, with gradient and lower triangle of the Hessian by the 8 unknowns of the edges `e` and `f`,
/// which have the axial `force`, N. Hand-derived derivatives by the edges' `p`, `q` and `h` (`energy::joint`) are
/// converted to edge vectors and angles. Entries above the diagonal are zero or partly set.
#[inline]
pub(crate) fn by_edges<D: Scalar>(
    [e, f]: [&EdgeState<D>; 2],
    JointTangent { e: at_e, f: at_f, fe }: &JointTangent<D>,
    force: D,
    energy: D,
) -> Local<D, EDGE_UNKNOWNS> {
    let zero = D::from(0.0);
    let (mut gradient, mut hessian) =
        ([zero; EDGE_UNKNOWNS], [[zero; EDGE_UNKNOWNS]; EDGE_UNKNOWNS]);
    // Diagonal block of one edge: its vector and angle, from the sums by `p`, `q` and `h`.
    let mut own = |first: usize, edge: &EdgeState<D>, sum: &EdgeSum<D>| {
        let own = edge.derivatives(sum, [force; 2], zero);
        gradient[first..first + 4].copy_from_slice(&own.gradient);
        for r in 0..3 {
            hessian[first + r][first..=first + r].copy_from_slice(&own.vector[r][..=r]);
        }
        hessian[first + 3][first..first + 3].copy_from_slice(&own.angle_vector);
        hessian[first + 3][first + 3] = own.angle;
    };
    own(0, e, at_e);
    own(4, f, at_f);
    // Block between the edges: rows of the second, columns of the first.
    for (row, between) in hessian[4..].iter_mut().zip(between(e, f, *fe)) {
        row[..4].copy_from_slice(&between);
    }
    Local { energy, gradient, hessian }
}

/// The symmetric matrix with the lower triangle of `h`, whose upper triangle is overwritten.
#[inline]
fn symmetric<D: Copy, const N: usize>(mut h: [[D; N]; N]) -> [[D; N]; N] {
    for r in 0..N {
        for c in r + 1..N {
            h[r][c] = h[c][r];
        }
    }
    h
}

/// Energy, gradient and full Hessian by the 11 unknowns of the nodes from those by the 8 unknowns of the edges. Of the
/// Hessian by the edges only the lower triangle is read.
#[inline]
pub(crate) fn spread<D: Scalar>(local: Local<D, EDGE_UNKNOWNS>) -> Local<D, UNKNOWNS> {
    Local {
        energy: local.energy,
        gradient: to_nodes(&local.gradient),
        // By the edges only the lower triangle is computed; the differences of nodes need both.
        hessian: hessian_to_nodes(&symmetric(local.hessian)),
    }
}

impl<D: Scalar> Element<D, UNKNOWNS> for BendTwist<D> {
    const NAME: &'static str = "bend and twist";
    type Over<E: Scalar> = BendTwist<E>;

    /// The element with stiffnesses, natural strains, reference frames and reference twist converted to another number
    /// type.
    fn map<E: Scalar>(&self, convert: impl Fn(D) -> E) -> BendTwist<E> {
        BendTwist {
            stiffness: self.stiffness.map(&convert),
            natural: map_components(&self.natural, &convert),
            frames: [self.frames[0].map(&convert), self.frames[1].map(&convert)],
            twist: convert(self.twist),
        }
    }

    /// The energy, J, at the unknowns `q`: the definition of the element.
    #[inline]
    fn energy(&self, q: &[D; UNKNOWNS]) -> D {
        self.energy_of_edges(&to_edges(q))
    }

    /// dE/dq, derived by hand, N for positions and N m for angles, exact also away from the reference frames.
    fn gradient(&self, q: &[D; UNKNOWNS]) -> [D; UNKNOWNS] {
        let joined = self.joined(&to_edges(q));
        to_nodes(&Self::gradient_of(&joined, &self.law().stress(&joined.joint.strains)))
    }

    /// E, J, dE/dq and the full matrix d2E/dq2, derived by hand, in one pass; exact also away from the reference
    /// frames.
    fn tangent(&self, q: &[D; UNKNOWNS]) -> Local<D, UNKNOWNS> {
        spread(self.tangent_of(&self.joined(&to_edges(q))))
    }
}

/// The gradient dE/dq of `element` at the unknowns `q` by num-dual, N and N m: differentiated by the 8 unknowns of the
/// edges, then converted to the 11 of the nodes.
pub fn dual_gradient<D: RodScalar>(element: &BendTwist<D>, q: &[D; UNKNOWNS]) -> [D; UNKNOWNS] {
    type Over<D> = DualSVec<D, EDGE_UNKNOWNS>;
    // Positions enter through edges only: eight derivatives in each number instead of eleven.
    let over = element.map(|x| OutOfLine(Over::<D>::from_re(x)));
    let energy =
        |q: SVector<Over<D>, EDGE_UNKNOWNS>| over.energy_of_edges(&q.data.0[0].map(OutOfLine)).0;
    let (_, gradient) = num_dual::gradient(energy, &SVector::from(to_edges(q)));
    to_nodes(&gradient.data.0[0])
}

/// Energy, gradient and full Hessian of `element` at the unknowns `q` by num-dual: differentiated by the 8 unknowns of
/// the edges instead of eleven, then converted to the nodes.
pub fn dual_tangent<D: RodScalar>(element: &BendTwist<D>, q: &[D; UNKNOWNS]) -> Local<D, UNKNOWNS> {
    type Over<D> = Dual2SVec<D, EDGE_UNKNOWNS>;
    let over = element.map(|x| OutOfLine(Over::<D>::from_re(x)));
    let energy =
        |q: SVector<Over<D>, EDGE_UNKNOWNS>| over.energy_of_edges(&q.data.0[0].map(OutOfLine)).0;
    let (energy, gradient, hessian) = num_dual::hessian(energy, &SVector::from(to_edges(q)));
    spread(Local { energy, gradient: gradient.data.0[0], hessian: hessian.data.0 })
}

/// The element with the derivatives of the literature, which assume that the state is its own reference. It shows their
/// error.
#[derive(Clone, Copy, Debug)]
pub struct Published(pub BendTwist<f64>);

impl Published {
    /// Energy, and the published gradient and full Hessian, by the 11 unknowns `q`: those of [`BendTwist`] as if the
    /// present frames were the reference.
    pub fn tangent(&self, q: &[f64; UNKNOWNS]) -> Local<f64, UNKNOWNS> {
        let JointState { e, f, joint } = self.0.joined(&to_edges(q));
        // The literature leaves out the turn of the directors with the tangents since the
        // reference.
        let reference = JointState { e: e.at_reference(), f: f.at_reference(), joint };
        spread(self.0.tangent_of(&reference))
    }
}

impl Energy<UNKNOWNS> for Published {
    /// The energy, J, at the unknowns `q`, which is that of [`BendTwist`].
    fn energy<D: Scalar>(&self, q: &[D; UNKNOWNS]) -> D {
        AsEnergy(self.0).energy(q)
    }
}

impl Analytic<UNKNOWNS> for Published {
    /// The published gradient at the unknowns `q`, N and N m.
    fn gradient(&self, q: &[f64; UNKNOWNS]) -> [f64; UNKNOWNS] {
        self.tangent(q).gradient
    }
    /// The published Hessian at the unknowns `q`, all of the symmetric matrix.
    fn hessian(&self, q: &[f64; UNKNOWNS]) -> [[f64; UNKNOWNS]; UNKNOWNS] {
        self.tangent(q).hessian
    }
}
