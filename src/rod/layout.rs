//! The interface of a rod's layout, planar ([`Plane`]) or spatial ([`Space`]), that
//! [`DiscreteRod`](crate::rod::DiscreteRod) is generic over.
//!
//! A layout defines the unknowns of a node (`N` coordinates, `STRIDE` unknowns), the `S` strains of a joint, and the
//! types of stiffness, tangent and frames. It iterates over edges in blocks, one edge per SIMD lane ([`EdgeBlocks`]),
//! and has the formulas of strains, energies (J), forces of follower loads (N), and their derivatives. First and second
//! derivatives are computed by edge vectors and passed to an [`EdgeSink`]. The sink writes them by nodes (gradient, N,
//! and band matrix, N/m) or by edges. [`Elements`] are references to the laws, loads and springs of a rod, [`At`] these
//! with unknowns and frames. Functions of [`Elements`]: `stretch_element` is the whole law of an edge, `elastic_joint`
//! an elastic law with stiffness and stress of a joint. In SIMD lanes `stretches` are laws of edges, and `responses`
//! stiffnesses and stresses (N m) of joints. Those of joints include friction springs and nonlinear bending. Nonlinear
//! parts of stretching laws, constant moments, user-defined energies and contacts are added outside of a layout.
//!
//! `LayoutSprings` and `LayoutBending` are friction springs and nonlinear bending of all joints, `AdditionalStresses`
//! both. `NodeSink` is a sink that writes by nodes.

use crate::energy::law::{self, Law, NonlinearBending, NonlinearPart, StiffnessEntry, Symmetric};
use crate::energy::{DeadLoad, FollowerLoad, HyperelasticStretch, Stretch};
use crate::numerics::scalar::{RodScalar, Scalar, SimdScalar};
use crate::numerics::tangent::{PatternByOrder, UnsymmetricTangent};
use crate::numerics::vector::components;
use crate::rod::blocks::{MOST, block};
use crate::rod::frames::{ReferenceFrames, RodGeometry};
use std::fmt::Debug;

/// The layout of a rod in the plane.
#[derive(Clone, Copy, Debug)]
pub struct Plane;

/// The layout of a rod in space.
#[derive(Clone, Copy, Debug)]
pub struct Space;

/// The springs of internal friction of all joints of a rod.
pub type LayoutSprings<L, D, const N: usize, const S: usize> =
    law::ActiveSlipElements<D, <L as Layout<N, S>>::Stiffness<D>, S>;

/// Stiffness matrix and stresses, N m, of a joint.
pub type JointResponse<L, D, const N: usize, const S: usize> =
    (<L as Layout<N, S>>::Stiffness<D>, [D; S]);

/// Nonlinear bending of all joints of a rod.
pub type LayoutBending<L, D, const N: usize, const S: usize> =
    NonlinearBending<D, <L as Layout<N, S>>::Stiffness<D>, S>;

/// Parts of the stresses of joints beyond their linear laws, which are computed joint by joint.
#[derive(Clone, Copy)]
pub struct AdditionalStresses<'a, D: Scalar, L: Layout<N, S>, const N: usize, const S: usize> {
    /// Springs of internal friction, if they act.
    pub springs: Option<&'a LayoutSprings<L, D, N, S>>,
    /// Nonlinear bending of every joint; empty for linear laws.
    pub bending: &'a [LayoutBending<L, D, N, S>],
}

/// References to the elements of a rod, for a sweep over them.
#[derive(Clone, Copy)]
pub struct Elements<'a, D: Scalar, L: Layout<N, S>, const N: usize, const S: usize> {
    /// One per edge.
    pub stretch: &'a [Stretch<D, N>],
    /// The parts of their laws beyond the linear ones, one per edge or none; sweeps in SIMD lanes leave them out.
    pub nonlinear: &'a [NonlinearPart<D>],
    /// One per inner node.
    pub joint: &'a [L::Joint<D>],
    /// One per node.
    pub load: &'a [DeadLoad<D, N>],
    /// Parts of joints beyond their linear laws, if there are any.
    pub additional: Option<AdditionalStresses<'a, D, L, N, S>>,
    /// Tensions of the edges, N, that replace their axial forces in the geometric stiffness; none for the axial forces.
    pub tensions: Option<&'a [D]>,
}

/// The elements of a rod with the unknowns and frames at which they are evaluated.
pub struct At<'a, D: RodScalar, L: Layout<N, S>, const N: usize, const S: usize> {
    /// Its elements.
    pub elements: Elements<'a, D, L, N, S>,
    /// The unknowns.
    pub q: &'a [D],
    /// The frames.
    pub frames: &'a L::Frames<D>,
}

// Derived, these would require that frames are `Copy`.
impl<D: RodScalar, L: Layout<N, S>, const N: usize, const S: usize> Copy for At<'_, D, L, N, S> {}
impl<D: RodScalar, L: Layout<N, S>, const N: usize, const S: usize> Clone for At<'_, D, L, N, S> {
    /// A copy of the references to elements, unknowns and frames.
    #[inline(always)]
    fn clone(&self) -> Self {
        *self
    }
}

impl<D: RodScalar, L: Layout<N, S>, const N: usize, const S: usize> Elements<'_, D, L, N, S> {
    /// Edge `i` with its whole law.
    pub(super) fn stretch_element(&self, i: usize) -> HyperelasticStretch<D, N> {
        HyperelasticStretch { linear: self.stretch[i], nonlinear: self.nonlinear.get(i).copied() }
    }

    /// Stiffness and stresses, N m, of joint `i` at its `strains`: those of its law, of its nonlinear bending, and of
    /// its friction spring if it has an active one.
    fn response(&self, i: usize, strains: &[D; S]) -> JointResponse<L, D, N, S> {
        let mut response = self.joint[i].response(strains);
        let Some(AdditionalStresses { springs, bending }) = self.additional else {
            return response;
        };
        if let Some(bending) = bending.get(i) {
            add_response::<L, D, N, S>(&mut response, bending.response(strains));
        }
        if let Some((springs, spring)) = springs.and_then(|all| Some((all, all.acting.get(i)?))) {
            let z = components(|c| strains[c] + spring.offset[c]);
            let own = springs.sliders.response(i, &spring.elastic, &z);
            add_response::<L, D, N, S>(&mut response, own);
        }
        response
    }

    /// An elastic law with the same stiffness and stress as joint `i` with its nonlinear bending and friction spring at
    /// these `strains`: natural strains are `strains - K^-1 stress`. Without these parts it is the law of the joint.
    pub(super) fn elastic_joint(&self, i: usize, strains: &[D; S]) -> L::Joint<D> {
        if self.additional.is_none() {
            return self.joint[i];
        }
        let (stiffness, stress) = self.response(i, strains);
        let back = stiffness.inverse_times(&stress);
        self.joint[i].with(stiffness, components(|c| strains[c] - back[c]))
    }

    /// The stretching laws of the edges from index `first` on, one per SIMD lane. Lanes beyond the last edge have a
    /// law without stiffness.
    #[inline(always)]
    pub(super) fn stretches<V: SimdScalar<D>>(
        &self,
        level: V::Level,
        first: usize,
    ) -> Stretch<V, N> {
        let mut room = None;
        Stretch::pack_lanes(
            level,
            block::<D, V, _>(self.stretch, first, Stretch::none(), &mut room),
        )
    }

    /// Stiffnesses and stresses, N m, of the joints from index `first` on, one per SIMD lane, at their `strains`.
    /// Linear ones without active friction springs follow from `law`, the elastic laws of these joints. Others are
    /// computed joint by joint, and are zero in lanes beyond the last joint.
    #[inline(always)]
    pub(super) fn responses<V: SimdScalar<D>>(
        &self,
        level: V::Level,
        first: usize,
        law: &L::Joint<V>,
        strains: &[V; S],
    ) -> JointResponse<L, V, N, S> {
        let Some(AdditionalStresses { bending, .. }) = self.additional else {
            return law.response(strains);
        };
        // A copy: a caller whose elements were borrowed here would keep all its numbers in memory.
        let (elements, zero) = (*self, D::from(0.0));
        let mut all = [(L::Stiffness::<D>::from_entries(|_| zero), [zero; S]); MOST];
        let joints = self.joint.len().saturating_sub(first);
        for (lane, own) in all.iter_mut().enumerate().take(V::LANES.min(joints)) {
            let strains = V::extract_lane(strains, lane);
            // One strain has a natural strain at which the law has this stress.
            *own = match S {
                1 if bending.is_empty() => {
                    elements.elastic_joint(first + lane, &strains).response(&strains)
                }
                _ => elements.response(first + lane, &strains),
            };
        }
        let mut stress = *strains;
        for c in 0..S {
            stress[c] = V::gather(level, |lane| all[lane].1[c]);
        }
        let entry = |k: usize| V::gather(level, |lane| all[lane].0.entry(k));
        (Symmetric::from_entries(entry), stress)
    }
}

/// Adds another stiffness and other stresses, N m, to those of a joint.
fn add_response<L: Layout<N, S>, D: Scalar, const N: usize, const S: usize>(
    sum: &mut JointResponse<L, D, N, S>,
    own: JointResponse<L, D, N, S>,
) {
    let ((stiffness, stress), (own, own_stress)) = (sum, own);
    for c in 0..S {
        stress[c] += own_stress[c];
    }
    let linear = *stiffness;
    *stiffness = Symmetric::from_entries(|k| linear.entry(k) + own.entry(k));
}

/// The most unknowns from the first node of an edge to its second one, with both: 7 in space (4 in the plane).
pub(super) const MAX_EDGE_UNKNOWNS: usize = 7;

/// The layout of a rod whose nodes have `N` coordinates and whose joints have `S` strains.
pub trait Layout<const N: usize, const S: usize>: Copy + Debug + Send + Sync + 'static {
    /// Unknowns from one node to the next: `N` coordinates, and the angle of the next edge if there are frames.
    const STRIDE: usize;
    /// The stiffness of a joint, or its derivatives.
    type Stiffness<T: StiffnessEntry>: Symmetric<T, S>;
    /// The law of a joint.
    type Joint<D: Scalar>: Law<D, S, Stiffness = Self::Stiffness<D>>;
    /// Second derivatives of the energy.
    type Tangent<D: Scalar>: PatternByOrder<D> + UnsymmetricTangent<D>;
    /// The reference frames of the angles.
    type Frames<D: RodScalar>: ReferenceFrames<D>;
    /// Edges and joints at the unknowns of a rod, in plain numbers.
    type Geometry: RodGeometry;
    /// First and second derivatives of the energy by an edge: its vector, and its angle in space.
    type ByEdge<V: Scalar>;
    /// Second derivatives by two successive edges: rows of the second, columns of the first.
    type Between<V: Scalar>;
    /// The edges in SIMD lanes.
    type Blocks<'a, D: RodScalar, V: SimdScalar<D>>: EdgeBlocks<'a, D, V, Self, N, S>;

    /// A consumer of derivatives by edges that overwrites `gradient`, N, and `tangent`, N/m, by nodes. The dead loads
    /// `load` of the nodes are subtracted from the gradient.
    fn node_sink<'a, D: Scalar, V: SimdScalar<D>>(
        level: V::Level,
        load: &'a [DeadLoad<D, N>],
        gradient: &'a mut [D],
        tangent: &'a mut Self::Tangent<D>,
    ) -> impl NodeSink<V, Self, N, S>;

    /// A consumer of derivatives by edges that adds second derivatives to `tangent`, N/m, at the indices of edges
    /// (edge `j` at node `j + 1`). `last` is the index of the last edge.
    fn edge_sink<D: Scalar, V: SimdScalar<D>>(
        tangent: &mut Self::Tangent<D>,
        last: usize,
    ) -> impl EdgeSink<V, Self, N, S>;

    /// Computes all first and second derivatives of edges and joints by num-dual, one edge at a time, and passes them
    /// to the consumer `to`. For checks of the hand-derived formulas only.
    fn derive_by_duals<D: RodScalar>(
        at: At<'_, D, Self, N, S>,
        to: &mut impl EdgeSink<D, Self, N, S>,
    );

    /// The coordinates of node `i` in the unknowns `q`, m. Panics beyond the last node.
    #[inline(always)]
    fn node<D>(q: &[D], i: usize) -> &[D; N] {
        q[Self::STRIDE * i..].first_chunk().expect("a node of the rod")
    }

    /// The vector of edge `i` at the unknowns `q`, m: the position of its second node less that of its first.
    fn edge<D: Scalar>(q: &[D], i: usize) -> [D; N];

    /// Overwrites `gradient` with that of elastic energy less work of the dead loads, N (N m for angles), by the
    /// hand-derived formulas. Friction springs and nonlinear bending are included. Nonlinear parts of stretching laws,
    /// constant moments, user-defined energies, contacts and follower loads are left out.
    fn gradient<D: RodScalar>(at: At<'_, D, Self, N, S>, gradient: &mut [D]);

    /// Calls `add(first, gradient)` for each edge and joint, with the index of its first unknown and its local
    /// gradient, N, by num-dual, with nonlinear laws and friction springs. Loads, constant moments, user-defined
    /// energies and contacts are left out.
    fn dual_gradients<D: RodScalar>(at: At<'_, D, Self, N, S>, add: impl FnMut(usize, &[D]));

    /// The strains of joint `i`, between edges `i` and `i + 1`, at the unknowns `q`. In the plane it is the curvature
    /// `2 tan(phi/2)` with the turning angle `phi`, in space two curvatures and the twist, rad.
    fn joint_strains<D: RodScalar>(at: &At<'_, D, Self, N, S>, q: &[D], i: usize) -> [D; S];

    /// The forces of a load that turns with edge `i`, N (N m for its angle), at the unknowns `q`: on the unknowns from
    /// those of its first node to those of its second one. Entries beyond them have no meaning.
    fn follower_forces<D: RodScalar>(
        load: &FollowerLoad<D>,
        q: &[D],
        frames: &Self::Frames<D>,
        i: usize,
    ) -> [D; MAX_EDGE_UNKNOWNS];

    /// Minus the derivatives of [`follower_forces`](Self::follower_forces) by the same unknowns, N/m.
    fn follower_tangent<D: RodScalar>(
        load: &FollowerLoad<D>,
        q: &[D],
        frames: &Self::Frames<D>,
        i: usize,
    ) -> [[D; MAX_EDGE_UNKNOWNS]; MAX_EDGE_UNKNOWNS];

    /// Moves the frames to the edges at `q` and overwrites `gradient` there, N (N m for angles), by the hand-derived
    /// formulas, with the parts of [`gradient`](Self::gradient). In space friction springs and nonlinear bending are
    /// left out. The default leaves the frames unchanged, as in the plane.
    fn moved_gradient<D: RodScalar>(
        elements: Elements<'_, D, Self, N, S>,
        q: &[D],
        frames: &mut Self::Frames<D>,
        gradient: &mut [D],
    ) {
        Self::gradient(At { elements, q, frames }, gradient);
    }
}

/// An iterator over the edges of a rod, one block of as many edges as SIMD lanes at a time.
pub trait EdgeBlocks<
    'a,
    D: RodScalar,
    V: SimdScalar<D>,
    L: Layout<N, S>,
    const N: usize,
    const S: usize,
>: Sized
{
    /// A block: edges, the edges after them, and the joints between. The joint after the last edge carries nothing.
    type Block;

    /// The iterator before its first block, over all edges of the elements in `at`; `level` is the vector instruction
    /// set.
    fn new(at: At<'a, D, L, N, S>, level: V::Level) -> Self;

    /// The next block: as many edges as SIMD lanes, the edges after them and the joints between; `None` after the
    /// last edge.
    fn next(&mut self) -> Option<Self::Block>;

    /// The index of the first edge of a block, that in lane 0.
    fn first(block: &Self::Block) -> usize;

    /// The axial strains of the edges of a block, and the strains of the joints after them, one edge and joint per
    /// lane.
    fn strains(&self, block: &Self::Block) -> (V, [V; S]);

    /// Energies of stretching, bending and twisting of the linear laws of a block, J, one edge and the joint after it
    /// per lane. Nonlinear parts of laws and friction springs are left out.
    fn energies(&self, block: &Self::Block) -> [V; 3];

    /// Writes lengths, directions and strains of the edges and joints of a block to their entries of `geometry`;
    /// lanes beyond the rod are left out.
    fn measure(&self, block: &Self::Block, geometry: &mut L::Geometry);

    /// Passes the first and second derivatives of the energy of all edges and joints, by the hand-derived formulas, to
    /// the consumer `to`, block by block. Friction springs and nonlinear bending are included, nonlinear parts of
    /// stretching laws are not. Overwrites `geometry` if one is given.
    fn derive(self, to: &mut impl EdgeSink<V, L, N, S>, geometry: Option<&mut L::Geometry>);
}

/// A consumer of the derivatives of the energy by edges, block by block from the first edge on.
pub trait EdgeSink<V: Scalar, L: Layout<N, S>, const N: usize, const S: usize> {
    /// Takes the first and second derivatives `own` by the edges from index `first` on, one edge per lane. `after`
    /// are the second derivatives between the next edges (rows) and these (columns).
    fn edges(&mut self, first: usize, own: &L::ByEdge<V>, after: &L::Between<V>);
}

/// An [`EdgeSink`] that writes gradient and tangent by nodes.
pub trait NodeSink<V: Scalar, L: Layout<N, S>, const N: usize, const S: usize>:
    EdgeSink<V, L, N, S>
{
    /// Writes gradient and tangent of the last node, at which the last edge ends; called once, after all edges.
    fn end(self);
}
