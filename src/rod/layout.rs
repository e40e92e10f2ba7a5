//! The interface of a rod's layout, in the plane or in space: unknowns of a node, strains of a joint, frames, and sweeps.

use crate::energy::frame::EdgeFrame;
use crate::energy::friction::Springs;
use crate::energy::{DeadLoad, Stretch};
use crate::numerics::scalar::{Nestable, Scalar, SimdScalar};
use crate::numerics::tangent::Tangent;
use crate::rod::joint_law::LinearJoint;
use crate::rod::moments::EdgeMoments;
use num_dual::Dual64;
use std::fmt::Debug;

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

/// The layout of a rod whose nodes have `N` coordinates and whose joints have `S` strains.
pub trait Layout<const N: usize, const S: usize>: Copy + Debug + Send + Sync + 'static {
    /// Unknowns from one node to the next: `N` coordinates, and the angle of the next edge if there are frames.
    const STRIDE: usize;
    /// The law of a joint.
    type Joint<D: Scalar>: LinearJoint<D, S>;
    /// Constant moments on edges.
    type Moments<D: Scalar>: EdgeMoments<D>;
    /// Second derivatives of the energy.
    type Tangent<D: Scalar>: Tangent<D>;
    /// What angles are measured from.
    type Frames<D: Scalar>: Clone + Debug + Send + Sync;
    /// Edges and joints as they are, in plain numbers.
    type Geometry: Clone + Debug + Default + Send + Sync;
    /// Derivatives of the energy by an edge.
    type ByEdge<V: Scalar>;
    /// Derivatives by two edges that follow each other: rows of the second, columns of the first.
    type Between<V: Scalar>;
    /// The edges in SIMD lanes.
    type Blocks<'a, D: Nestable, V: SimdScalar<D>>: EdgeBlocks<'a, D, V, Self, N, S>;

    /// A consumer that writes gradient and tangent by nodes.
    fn node_sink<'a, D: Scalar, V: SimdScalar<D>>(
        level: V::Level,
        load: &'a [DeadLoad<D, N>],
        gradient: &'a mut [D],
        tangent: &'a mut Self::Tangent<D>,
    ) -> impl NodeSink<V, Self, N, S>;

    /// A consumer that adds the tangent in terms of edges, of which `last` is the last.
    fn edge_sink<D: Scalar, V: SimdScalar<D>>(
        tangent: &mut Self::Tangent<D>,
        last: usize,
    ) -> impl EdgeSink<V, Self, N, S>;

    /// Passes all derivatives by num-dual to a consumer.
    fn derive_by_duals<D: Nestable>(
        at: At<'_, D, Self, N, S>,
        to: &mut impl EdgeSink<D, Self, N, S>,
    );

    /// Gives a geometry room for so many edges.
    fn resize(geometry: &mut Self::Geometry, edges: usize);

    /// The coordinates of node `i`, m.
    #[inline(always)]
    fn node<D>(q: &[D], i: usize) -> &[D; N] {
        q[Self::STRIDE * i..].first_chunk().expect("a node of the rod")
    }

    /// The vector of edge `i`, m.
    fn edge<D: Scalar>(q: &[D], i: usize) -> [D; N];

    /// Writes the gradient by the hand-derived formulas.
    fn gradient<D: Nestable>(at: At<'_, D, Self, N, S>, gradient: &mut [D]);

    /// Adds the gradient of edges and joints by num-dual.
    fn add_gradient_by_duals<D: Nestable>(at: At<'_, D, Self, N, S>, gradient: &mut [D]);

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
}

/// The edges of a rod in blocks of as many as there are SIMD lanes.
pub trait EdgeBlocks<
    'a,
    D: Nestable,
    V: SimdScalar<D>,
    L: Layout<N, S>,
    const N: usize,
    const S: usize,
>: Sized
{
    /// Edges, the edges after them, and the joints between. The joint after the last edge carries nothing.
    type Block;

    /// Before the first block.
    fn new(at: At<'a, D, L, N, S>, level: V::Level) -> Self;

    /// The next block.
    fn next(&mut self) -> Option<Self::Block>;

    /// The number of its first edge.
    fn first(block: &Self::Block) -> usize;

    /// The strains of its edges and joints.
    fn strains(&self, block: &Self::Block) -> (V, [V; S]);

    /// Energies of stretching, bending and twisting, J, without those of springs.
    fn energies(&self, block: &Self::Block) -> [V; 3];

    /// Writes its geometry.
    fn measure(&self, block: &Self::Block, geometry: &mut L::Geometry);

    /// Passes all derivatives by the hand-derived formulas to a consumer, and writes the geometry if there is one.
    fn derive(self, to: &mut impl EdgeSink<V, L, N, S>, geometry: Option<&mut L::Geometry>);
}

/// A consumer of the derivatives of the energy by edges, block by block from the first edge on.
pub trait EdgeSink<V: Scalar, L: Layout<N, S>, const N: usize, const S: usize> {
    /// The derivatives by the edges from `first` on, and those between the next edges (rows) and these (columns).
    fn edges(&mut self, first: usize, own: &L::ByEdge<V>, after: &L::Between<V>);
}

/// An [`EdgeSink`] that writes gradient and tangent by nodes.
pub trait NodeSink<V: Scalar, L: Layout<N, S>, const N: usize, const S: usize>:
    EdgeSink<V, L, N, S>
{
    /// Writes the last node.
    fn end(self);
}
