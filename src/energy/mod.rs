//! Energies of the elements of a rod, their derivatives, and the interfaces of user-defined energies.
//!
//! Input: the unknowns of an element (coordinates of its nodes, m, and angles of its edges, rad) and its parameters.
//! Output: its energy, J, gradient and full Hessian ([`Local`]). Elements are stretching of an edge ([`stretch`], with
//! `hyperelastic_stretch`), bending of a planar joint ([`planar_bend`]), and bending and twisting of a spatial one
//! ([`bend_twist`], with [`frame`] and `joint`). Dead loads ([`dead_load`]) and dead moments ([`dead_moment`]) are
//! elements too. Each is an [`Element`]: one definition of its energy, generic over the [`Scalar`], and a hand-derived
//! gradient and Hessian. [`law`] has the material laws of the elastic ones. Loads that turn with an edge have no energy
//! ([`follower_load`]). [`Derivatives`] selects the derivatives of a simulation: the hand-derived formulas, or
//! num-dual's differentiation of the energy ([`dual_gradient`], [`dual_tangent`]).
//!
//! A user-defined energy on a rod implements [`OwnEnergy`] ([`own`]). `attach` adds it to a scene, [`place`] finds its
//! elements, and `adapter` with `autodiff` derives it by the unknowns. `anchor_spring` is a spring to a fixed point,
//! `tendon` a tendon, `edge_contact` the contact of an edge with an obstacle, `edge_pair` that of two edges.
//! `pair_loss` has the damping and friction of two edges. `swept_edge` and `swept_pair` test whether an edge passes
//! through an obstacle or another edge. Outside a rod an energy implements [`Energy`], and [`Analytic`] if its
//! derivatives are derived by hand; [`AsEnergy`] makes an element such an energy.
//!
//! Read [`stretch`] first: it is the simplest complete element.

pub(crate) mod adapter;
pub(crate) mod anchor_spring;
pub(crate) mod attach;
pub(crate) mod autodiff;
pub mod bend_twist;
pub(crate) mod contact_loss;
pub mod dead_load;
pub mod dead_moment;
pub(crate) mod edge_contact;
pub(crate) mod edge_pair;
pub(crate) mod edge_tie;
pub mod follower_load;
pub mod frame;
pub(crate) mod hyperelastic_stretch;
pub(crate) mod joint;
pub mod law;
pub(crate) mod overlap;
pub mod own;
pub(crate) mod pair_loss;
pub mod place;
pub mod planar_bend;
pub mod stretch;
pub(crate) mod swept_edge;
pub(crate) mod swept_pair;
pub(crate) mod tendon;

pub use crate::scene::At;
pub use bend_twist::BendTwist;
pub use dead_load::DeadLoad;
pub use dead_moment::DeadMoment;
pub use follower_load::FollowerLoad;
pub use hyperelastic_stretch::HyperelasticStretch;
pub use law::{Law, SlipElements, Stiffness};
pub use own::{Argument, EnergyGradient, EnergyHessian, OwnEnergy};
pub use place::{Directors, Place};
pub use planar_bend::PlanarBend;
pub use stretch::Stretch;

#[doc(hidden)]
#[deprecated(since = "0.2.0", note = "renamed to SlipElements")]
pub use law::SlipElements as Sliders;
#[doc(hidden)]
#[deprecated(since = "0.2.0", note = "renamed to Argument")]
pub use own::Argument as By;
#[doc(hidden)]
#[deprecated(since = "0.2.0", note = "renamed to EnergyGradient")]
pub use own::EnergyGradient as Slopes;
#[doc(hidden)]
#[deprecated(since = "0.2.0", note = "renamed to EnergyHessian")]
pub use own::EnergyHessian as Curvatures;

use crate::numerics::out_of_line::OutOfLine;
use crate::numerics::scalar::{RodScalar, Scalar};
use nalgebra::SVector;
use num_dual::{Dual2SVec, DualSVec};
use serde::{Deserialize, Serialize};

/// An energy of `N` unknowns, written once for every number type. Implement it to have your own
/// energy differentiated and checked ([`crate::check`]).
pub trait Energy<const N: usize> {
    /// The energy, J, at the unknowns `q`.
    fn energy<D: Scalar>(&self, q: &[D; N]) -> D;
}

/// An [`Energy`] with derivatives derived by hand.
pub trait Analytic<const N: usize>: Energy<N> {
    /// The gradient dE/dq at the unknowns `q`, J over the units of `q`.
    fn gradient(&self, q: &[f64; N]) -> [f64; N];
    /// The Hessian d2E/dq2 at the unknowns `q`, J over the product of their units, all of the symmetric matrix.
    fn hessian(&self, q: &[f64; N]) -> [[f64; N]; N];
}

/// Which derivatives the simulation uses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Derivatives {
    /// The hand-derived formulas: fast.
    #[default]
    Hand,
    /// num-dual's derivatives of the energy: the definition, with which the formulas are compared. Rods in dual numbers
    /// use the hand-derived formulas nevertheless.
    Dual,
}

/// An element's energy with its derivatives with respect to its own `N` unknowns.
#[derive(Clone, Copy, Debug)]
pub struct Local<D, const N: usize> {
    /// The energy, J.
    pub energy: D,
    /// The gradient dE/dq, in the order of the unknowns.
    pub gradient: [D; N],
    /// d2E/dq2, all of the symmetric matrix.
    pub hessian: [[D; N]; N],
}

/// An element of the rod with `N` unknowns. Its parameters (stiffness, natural strain) are numbers of type `D`: dual
/// parameters give derivatives along parameters.
pub trait Element<D: Scalar, const N: usize>: Copy {
    /// Name in reports.
    const NAME: &'static str;
    /// The same element with parameters of another number type.
    type Over<E: Scalar>: Element<E, N>;

    /// The element with every parameter converted to another number type.
    fn map<E: Scalar>(&self, convert: impl Fn(D) -> E) -> Self::Over<E>;
    /// The energy, J, at the unknowns `q`: the definition of the element.
    fn energy(&self, q: &[D; N]) -> D;
    /// dE/dq at the unknowns `q`, derived by hand, J over the units of `q`.
    fn gradient(&self, q: &[D; N]) -> [D; N];
    /// E, dE/dq and the full matrix d2E/dq2 at the unknowns `q`, derived by hand, in one pass.
    fn tangent(&self, q: &[D; N]) -> Local<D, N>;
}

/// dE/dq of an element at the unknowns `q`, J over the units of `q`, by num-dual (first-order dual numbers with `N`
/// derivatives).
pub fn dual_gradient<D: RodScalar, E: Element<D, N>, const N: usize>(
    element: &E,
    q: &[D; N],
) -> [D; N] {
    let over = element.map(|x| OutOfLine(DualSVec::<D, N>::from_re(x)));
    let energy = |q: SVector<DualSVec<D, N>, N>| over.energy(&q.data.0[0].map(OutOfLine)).0;
    num_dual::gradient(energy, &SVector::from(*q)).1.data.0[0]
}

/// E, dE/dq and the full matrix d2E/dq2 of an element at the unknowns `q` by num-dual (second-order dual numbers with
/// `N` derivatives).
pub fn dual_tangent<D: RodScalar, E: Element<D, N>, const N: usize>(
    element: &E,
    q: &[D; N],
) -> Local<D, N> {
    let over = element.map(|x| OutOfLine(Dual2SVec::<D, N>::from_re(x)));
    let energy = |q: SVector<Dual2SVec<D, N>, N>| over.energy(&q.data.0[0].map(OutOfLine)).0;
    let (energy, gradient, hessian) = num_dual::hessian(energy, &SVector::from(*q));
    Local { energy, gradient: gradient.data.0[0], hessian: hessian.data.0 }
}

/// Wrapper that makes an element with `f64` parameters an [`Analytic`] energy, like that of a user.
#[derive(Clone, Copy, Debug)]
pub struct AsEnergy<E>(pub E);

impl<E: Element<f64, N>, const N: usize> Energy<N> for AsEnergy<E> {
    /// The energy of the element, J, at the unknowns `q`.
    fn energy<D: Scalar>(&self, q: &[D; N]) -> D {
        self.0.map(D::from).energy(q)
    }
}

impl<E: Element<f64, N>, const N: usize> Analytic<N> for AsEnergy<E> {
    /// The hand-derived gradient of the element at the unknowns `q`.
    fn gradient(&self, q: &[f64; N]) -> [f64; N] {
        self.0.gradient(q)
    }
    /// The hand-derived Hessian of the element at the unknowns `q`, all entries of the symmetric matrix.
    fn hessian(&self, q: &[f64; N]) -> [[f64; N]; N] {
        self.0.tangent(q).hessian
    }
}
