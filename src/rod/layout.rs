//! What differs between a rod in the plane and one in space: the unknowns of a node, the strains of a joint, the frames.

use crate::energy::frame::EdgeFrame;
use crate::energy::friction::{SliderRates, Springs};
use crate::energy::{DeadLoad, Sliders, Stretch};
use crate::numerics::lanes::Lanes;
use crate::numerics::scalar::{Nestable, Scalar};
use crate::numerics::tangent::Tangent;
use crate::numerics::vector::components;
use crate::rod::joint_law::LinearJoint;
use crate::rod::moments::EdgeMoments;
use crate::rod::{Energies, FrameRate, Laws};
use num_dual::Dual64;
use std::fmt::Debug;
use std::ops::{Add, Mul};

/// The layout of a rod in the plane.
#[derive(Clone, Copy, Debug)]
pub struct Plane;

/// The layout of a rod in space.
#[derive(Clone, Copy, Debug)]
pub struct Space;

/// The elastic stiffness of a joint, and the stretch of its spring at no strain.
pub type Spring<L, D, const N: usize, const S: usize> =
    (<<L as Layout<N, S>>::Joint<D> as LinearJoint<D, S>>::Stiffness, [D; S]);

/// The elements of a rod.
pub struct Elements<'a, D: Scalar, L: Layout<N, S>, const N: usize, const S: usize> {
    /// One per edge.
    pub stretch: &'a [Stretch<D, N>],
    /// One per inner node.
    pub joint: &'a [L::Joint<D>],
    /// One per node.
    pub load: &'a [DeadLoad<D, N>],
    /// Springs of internal friction, if they act.
    pub springs: Option<&'a Springs<D, Spring<L, D, N, S>>>,
    /// The tensions of edges, N, where the stretching does not determine them.
    pub tensions: Option<&'a [D]>,
}

/// A rod at its unknowns, with its frames.
pub struct At<'a, D: Scalar, L: Layout<N, S>, const N: usize, const S: usize> {
    /// Its elements.
    pub elements: Elements<'a, D, L, N, S>,
    /// The unknowns.
    pub q: &'a [D],
    /// The frames.
    pub frames: &'a L::Frames<D>,
}

// Derived, these would require what elements and frames refer to to be `Copy` too.
impl<D: Scalar, L: Layout<N, S>, const N: usize, const S: usize> Copy for Elements<'_, D, L, N, S> {}
impl<D: Scalar, L: Layout<N, S>, const N: usize, const S: usize> Clone
    for Elements<'_, D, L, N, S>
{
    #[inline(always)]
    fn clone(&self) -> Self {
        *self
    }
}

impl<D: Scalar, L: Layout<N, S>, const N: usize, const S: usize> Copy for At<'_, D, L, N, S> {}
impl<D: Scalar, L: Layout<N, S>, const N: usize, const S: usize> Clone for At<'_, D, L, N, S> {
    #[inline(always)]
    fn clone(&self) -> Self {
        *self
    }
}

/// Derivatives of the stresses of a joint along `G` parameters, as functions of its `S` strains.
pub trait JointRate<J, const S: usize, const G: usize>:
    Copy + Debug + PartialEq + Send + Sync
{
    /// Of dual joints, one for each parameter.
    fn of(duals: [&J; G]) -> Self;

    /// Whether nothing changes.
    fn is_zero(&self) -> bool;

    /// The part that is proportional to the strains, with the `coupled` part of bending and twisting or without.
    fn stiffer(&self, strains: &[f64; S], coupled: bool) -> [Lanes<G>; S];

    /// The part without strains.
    fn offset(&self) -> [Lanes<G>; S];

    /// The derivatives of the stresses at these strains.
    #[inline(always)]
    fn stress(&self, strains: &[f64; S]) -> [Lanes<G>; S] {
        let (mut stress, offset) = (self.stiffer(strains, true), self.offset());
        for c in 0..S {
            stress[c] += offset[c];
        }
        stress
    }

    /// The product with the derivatives of a number by the law of the joint, see [`Laws::joint`].
    fn along(&self, law: &([f64; 6], [f64; 3])) -> Lanes<G>;
}

/// The layout of a rod whose nodes have `N` coordinates and whose joints have `S` strains.
pub trait Layout<const N: usize, const S: usize>: Copy + Debug + Send + Sync + 'static {
    /// Unknowns from one node to the next: `N` coordinates, and the angle of the next edge if there are frames.
    const STRIDE: usize;
    /// The law of a joint.
    type Joint<D: Scalar>: LinearJoint<D, S>;
    /// Derivatives of that law along parameters.
    type JointRate<const G: usize>: JointRate<Self::Joint<Dual64>, S, G>;
    /// Constant moments on edges.
    type Moments<D: Scalar>: EdgeMoments<D>;
    /// Second derivatives of the energy.
    type Tangent<D: Scalar>: Tangent<D>;
    /// What angles are measured from.
    type Frames<D: Scalar>: Clone + Debug + Send + Sync;
    /// Edges and joints as they are, in plain numbers.
    type Geometry: Clone + Debug + Default + Send + Sync;

    /// The coordinates of node `i`, m.
    #[inline(always)]
    fn node<D>(q: &[D], i: usize) -> &[D; N] {
        q[Self::STRIDE * i..].first_chunk().expect("a node of the rod")
    }

    /// The vector of edge `i`, m.
    #[inline(always)]
    fn edge<D: Scalar>(q: &[D], i: usize) -> [D; N] {
        let (a, b) = (Self::node(q, i), Self::node(q, i + 1));
        components(|c| b[c] - a[c])
    }

    /// Writes the gradient by the hand-derived formulas.
    fn gradient<D: Nestable>(at: At<'_, D, Self, N, S>, gradient: &mut [D]);

    /// Adds the gradient of edges and joints by num-dual.
    fn add_gradient_by_duals<D: Nestable>(at: At<'_, D, Self, N, S>, gradient: &mut [D]);

    /// Writes gradient and tangent, and the geometry if there is one, by the hand-derived formulas.
    fn tangent<D: Nestable>(
        at: At<'_, D, Self, N, S>,
        gradient: &mut [D],
        tangent: &mut Self::Tangent<D>,
        geometry: Option<&mut Self::Geometry>,
    );

    /// Writes gradient and tangent by num-dual.
    fn tangent_by_duals<D: Nestable>(
        at: At<'_, D, Self, N, S>,
        gradient: &mut [D],
        tangent: &mut Self::Tangent<D>,
    );

    /// Adds the tangent in terms of edges, by num-dual or by the formulas.
    fn edge_tangent<D: Nestable>(
        at: At<'_, D, Self, N, S>,
        by_duals: bool,
        tangent: &mut Self::Tangent<D>,
    );

    /// Writes the geometry.
    fn measure<D: Nestable>(at: At<'_, D, Self, N, S>, geometry: &mut Self::Geometry);

    /// Elastic energies, J, without those of springs.
    fn energies<D: Nestable>(at: At<'_, D, Self, N, S>) -> Energies;

    /// Writes the strains of edges and of joints.
    fn strains<D: Nestable>(at: At<'_, D, Self, N, S>, edges: &mut [D], joints: &mut [[D; S]]);

    /// The strains of joint `i`.
    fn joint_strains<D: Nestable>(at: &At<'_, D, Self, N, S>, q: &[D], i: usize) -> [D; S];

    /// The frames of all edges; none in the plane.
    fn edge_frames<D: Scalar>(_: &Self::Frames<D>) -> &[EdgeFrame<D>] {
        &[]
    }

    /// Moves the frames to `q`, without changing any energy there.
    fn rebase<D: Nestable>(_: &mut Self::Frames<D>, _q: &[D]) {}

    /// Moves the frames to `q` and writes the gradient there, by the hand-derived formulas.
    fn moved_gradient<D: Nestable>(
        elements: Elements<'_, D, Self, N, S>,
        q: &[D],
        frames: &mut Self::Frames<D>,
        gradient: &mut [D],
    ) {
        Self::gradient(At { elements, q, frames }, gradient);
    }

    /// Writes frames without their derivatives.
    fn set_real_frames<D: Scalar>(_dual: &Self::Frames<Dual64>, _: &mut Self::Frames<D>) {}

    /// Measures the angles of `q`, which are from `from`, from `to` instead.
    fn refer<D: Scalar>(_q: &mut [D], _from: &Self::Frames<D>, _to: &Self::Frames<D>) {}

    /// The first material director of an edge, if edges have one.
    fn director<D: Scalar>(_q: &[D], _: &Self::Frames<D>, _edge: usize) -> Option<[D; 3]> {
        None
    }

    /// Turns all edges but the first about themselves until no joint is twisted.
    fn untwist<D: Scalar>(_q: &mut [D], _: &Self::Frames<D>) {}

    /// Turns an edge so that its first material director is `director`, on the turn nearest to
    /// `turn` beyond its angle in `q`.
    fn align<D: Scalar>(
        _q: &mut [D],
        _: &Self::Frames<D>,
        _edge: usize,
        _director: [D; 3],
        _turn: f64,
    ) {
    }

    /// The strains of the edges in a geometry.
    fn measured_edges(geometry: &Self::Geometry) -> impl Iterator<Item = f64>;

    /// The strains of the joints in a geometry.
    fn measured_joints(geometry: &Self::Geometry) -> impl Iterator<Item = [f64; S]>;

    /// Writes the derivatives of the gradient at fixed unknowns and frames from those of the axial forces, by the strain
    /// of an edge, of the stresses, by those of a joint, and of the loads.
    fn pull<const G: usize>(
        geometry: &Self::Geometry,
        axial: impl Fn(usize, f64) -> Lanes<G>,
        stress: impl Fn(usize, &[f64; S]) -> [Lanes<G>; S],
        load: impl Fn(usize) -> [Lanes<G>; N],
        out: &mut [[f64; G]],
    );

    /// Passes the derivatives of the gradients of edges and joints, by num-dual at fixed unknowns, to `add`, each with
    /// its first unknown.
    fn add_rates_by_duals(
        elements: Elements<'_, Dual64, Self, N, S>,
        q: &[f64],
        frames: &Self::Frames<f64>,
        add: impl FnMut(usize, &[f64]),
    );

    /// Passes the derivatives of the gradients of moments to `add`, likewise.
    fn add_moment_rates(_: &Self::Moments<Dual64>, _q: &[f64], _add: impl FnMut(usize, &[f64])) {}

    /// Adds the derivatives of the strains along those of the unknowns and frames.
    fn add_strain_rates<const G: usize>(
        stretch: &[Stretch<f64, N>],
        frames: &[FrameRate<G>],
        geometry: &Self::Geometry,
        q: &[[f64; G]],
        out: (&mut [Lanes<G>], &mut [[Lanes<G>; S]]),
    );

    /// The product of a joint's stiffness with `s`, with the `coupled` part of bending and twisting or without.
    fn stiffness_times<T>(joint: &Self::Joint<f64>, s: &[T; S], coupled: bool) -> [T; S]
    where
        T: Copy + Add<Output = T> + Mul<f64, Output = T>;

    /// The derivatives of the stretch of the springs of joint `i`, where that without slip is `z` with the derivatives
    /// `rate`.
    fn slip_rate<const G: usize>(
        changes: &SliderRates<G>,
        sliders: (&Sliders<f64>, usize),
        joint: (&Self::Joint<f64>, &Self::JointRate<G>),
        z: [f64; S],
        rate: [Lanes<G>; S],
    ) -> [Lanes<G>; S];

    /// Adds the derivatives of the gradient along those of the frames, see
    /// [`Sensitive::frame_rate`](crate::rod::Sensitive::frame_rate).
    fn frame_rate<const G: usize>(
        _frames: &[FrameRate<G>],
        _geometry: &Self::Geometry,
        _gradient: &[f64],
        _tangent: &Self::Tangent<f64>,
        _out: &mut [[f64; G]],
    ) {
    }

    /// Moves the derivatives of the frames to where the rod is measured and has the derivatives `q`.
    fn rebase_rates<const G: usize>(
        _frames: &mut [FrameRate<G>],
        _geometry: &Self::Geometry,
        _q: &[[f64; G]],
    ) {
    }

    /// The derivatives that frames carry.
    fn frame_rates<const G: usize>(_: [&Self::Frames<Dual64>; G]) -> Vec<FrameRate<G>> {
        Vec::new()
    }

    /// Writes frames with the derivatives along parameter `lane`.
    fn set_dual_frames<const G: usize>(
        _frames: &Self::Frames<f64>,
        _rates: &[FrameRate<G>],
        _lane: usize,
        _dual: &mut Self::Frames<Dual64>,
    ) {
    }

    /// Adds the derivatives of a number by the law of a joint, see [`Laws::joint`], where the stresses have the
    /// derivatives `w`; `own` are the strains with a viscosity of their kind.
    fn add_to_joint(
        w: &[f64; S],
        strains: &[f64; S],
        own: &[f64; S],
        law: &mut ([f64; 6], [f64; 3]),
    );

    /// Adds the derivatives by the moments at `q`, where the forces have the derivatives `d`.
    fn add_to_moments(_q: &[f64], _d: &[f64], _laws: &mut Laws) {}

    /// The product with the derivatives by moments.
    fn along_moments(_: &Self::Moments<Dual64>, _laws: &Laws) -> f64 {
        0.0
    }

    /// Transposed part of the frames' turn with the angles of their edges.
    fn turn_frames(_: &Self::Geometry, _angles: &[f64], _frames: &mut [FrameRate<1>]) {}

    /// Transposed [`frame_rate`](Self::frame_rate): see
    /// [`Transposed::add_to_frames`](crate::rod::Transposed::add_to_frames).
    fn add_to_frames(
        _: &Self::Geometry,
        _gradient: &[f64],
        _by: (&[f64], &[f64]),
        _frames: &mut [FrameRate<1>],
    ) {
    }

    /// Transposed [`rebase_rates`](Self::rebase_rates).
    fn rebase_back(_: &Self::Geometry, _frames: &mut [FrameRate<1>], _q: &mut [f64]) {}
}
