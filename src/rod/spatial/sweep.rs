//! Sweeps over the edges of a spatial rod in SIMD lanes: strains, energies, geometry, and derivatives by edges.
//!
//! Input: the unknowns `q` (position of each node and angle of the edge after it) and the reference frames of the
//! edges. Edge vectors are differences of positions. Each block has as many edges as SIMD lanes, their reference frames
//! and angles, and the joints after them. Output by block: axial strains of edges, two curvatures and twist (rad) of
//! joints, energies of the linear laws (J), and geometry. First and second derivatives by edge vectors and angles (N, N
//! m; N/m), with nonlinear bending and active friction springs, go to a consumer, which stores them by nodes or by
//! edges. Nonlinear parts of stretching laws are added elsewhere. `response` returns stiffnesses and stresses of the
//! joints of a block; [`vectors_at`] and [`frames_at`] return vectors with angles, and frames, of a block of edges.
//!
//! `Elements` are those of a spatial rod, and `At` these with unknowns and frames. `SpatialBlocks` iterates over blocks
//! of edges; each is a `SpatialEdgePairs`: edges, the edges after them, and the joints between.

use crate::energy::Law;
use crate::energy::bend_twist::{EdgeState, JointLaw, Stiffness};
use crate::energy::frame::{EdgeFrame, one_plus_dot};
use crate::energy::joint::{EdgeSum, JointStrains, between};
use crate::numerics::scalar::{RodScalar, Scalar, SimdScalar};
use crate::numerics::vector::{Vector, combine, scale, sub};
use crate::rod::blocks::{block, tension, window};
use crate::rod::edges::STRIDE;
use crate::rod::layout::{self, EdgeBlocks, EdgeSink, Space};
use crate::rod::spatial::geometry::{Geometry, SpatialEdgeGeometry};

/// The elements of a spatial rod.
pub(super) type Elements<'a, D> = layout::Elements<'a, D, Space, 3, 3>;

/// A spatial rod at its unknowns, with its frames.
pub(super) type At<'a, D> = layout::At<'a, D, Space, 3, 3>;

/// Edges in SIMD lanes: lengths and directors, angles, rad, and reference frames.
#[derive(Clone, Copy)]
struct Edges<V> {
    state: EdgeState<V>,
    angle: V,
    frame: EdgeFrame<V>,
}

/// Edges in SIMD lanes, the edges after them, and the joints between. The joint after the last edge has neither
/// stiffness nor stress; results of lanes beyond are not used.
pub struct SpatialEdgePairs<V> {
    /// The index of the first edge.
    pub(super) first: usize,
    /// The edges.
    pub(super) e: EdgeState<V>,
    /// The edges after them.
    pub(super) f: EdgeState<V>,
    /// The elastic laws of the joints between.
    pub(super) law: JointLaw<V>,
    /// Strains of these joints, with intermediate results for the derivatives.
    pub(super) bent: JointStrains<V>,
}

/// The iterator over the edges of a rod at the unknowns `q`, one block of SIMD lanes at a time.
pub struct SpatialBlocks<'a, D: Scalar, V: SimdScalar<D>> {
    elements: Elements<'a, D>,
    q: &'a [D],
    frames: &'a [EdgeFrame<D>],
    twist: &'a [D],
    level: V::Level,
    /// The number of the first edge of the next block.
    first: usize,
    edges: Edges<V>,
}

impl<'a, D: RodScalar, V: SimdScalar<D>> SpatialBlocks<'a, D, V> {
    /// Stiffnesses and stresses, N m, of the joints of a block, one per lane, with nonlinear bending and the active
    /// friction springs.
    #[inline(always)]
    pub fn response(
        &self,
        SpatialEdgePairs { first, law, bent, .. }: &SpatialEdgePairs<V>,
    ) -> (Stiffness<V>, [V; 3]) {
        self.elements.responses::<V>(self.level, *first, law, &bent.strains)
    }
}

impl<'a, D: RodScalar, V: SimdScalar<D>> EdgeBlocks<'a, D, V, Space, 3, 3>
    for SpatialBlocks<'a, D, V>
{
    type Block = SpatialEdgePairs<V>;

    /// The iterator over the edges of the rod `at` its unknowns and frames, before its first block.
    #[inline(always)]
    fn new(At { elements, q, frames }: At<'a, D>, level: V::Level) -> Self {
        let (frames, twist) = (&frames.edges[..], &frames.twist[..]);
        let edges = edges_at(q, frames, level, 0);
        Self { elements, q, frames, twist, level, first: 0, edges }
    }

    /// The next block: edges, the edges after them, and laws and strains of the joints between; `None` after the last
    /// edge. The edges of the block after it are computed already, as the last joint needs the first of them.
    #[inline(always)]
    fn next(&mut self) -> Option<SpatialEdgePairs<V>> {
        let (first, edges) = (self.first, self.edges);
        if first >= self.elements.stretch.len() {
            return None;
        }
        // The next block is computed now: its first edge is the second one of the last lane's
        // joint.
        self.first += V::LANES;
        if self.first < self.elements.stretch.len() {
            self.edges = edges_at(self.q, self.frames, self.level, self.first);
        }
        let (e, f) = (edges.state, edges.state.after::<D>(&self.edges.state));
        // Angle of the second edge less that of the first, rad.
        let turn = edges.angle.after(self.edges.angle) - edges.angle;
        let frames = [edges.frame, edges.frame.after::<D>(&self.edges.frame)];
        let mut room = None;
        let twist = block::<D, V, _>(self.twist, first, D::from(0.0), &mut room);
        let law: JointLaw<V> = joints(self.elements.joint, self.level, first);
        let joint = law.at(frames, V::gather(self.level, |lane| twist[lane]));
        let bent = joint.joint(&e, &f, turn);
        Some(SpatialEdgePairs { first, e, f, law, bent })
    }

    /// The index of the first edge of a block.
    fn first(block: &SpatialEdgePairs<V>) -> usize {
        block.first
    }

    /// Axial strains of the edges of a block, and `[k1, k2, tau]` (two curvatures and the twist, rad) of the joints
    /// after them, one edge and joint per lane.
    #[inline(always)]
    fn strains(
        &self,
        SpatialEdgePairs { first, e, bent, .. }: &SpatialEdgePairs<V>,
    ) -> (V, [V; 3]) {
        (
            self.elements.stretches::<V>(self.level, *first).strain_of(e.squared, e.length),
            bent.strains,
        )
    }

    /// Energies of stretching, bending and twisting of the linear laws of a block, J, without nonlinear parts of laws
    /// and friction springs.
    #[inline(always)]
    fn energies(
        &self,
        SpatialEdgePairs { first, e, law, bent, .. }: &SpatialEdgePairs<V>,
    ) -> [V; 3] {
        let [_, bend, twist] = law.energies(&law.difference(&bent.strains));
        [
            self.elements.stretches::<V>(self.level, *first).energy_at(e.squared, e.length),
            bend,
            twist,
        ]
    }

    /// Writes lengths, directors, axial strains and parallel-transport factors of the edges of a block to its entries
    /// of `geometry`, as plain numbers. Joints get their strains and the derivatives by `p`, `q` and `h` of both edges.
    /// Lanes beyond the rod are left out.
    #[inline(always)]
    fn measure(
        &self,
        SpatialEdgePairs { first, e: state, f: next, bent: joint, .. }: &SpatialEdgePairs<V>,
        geometry: &mut Geometry,
    ) {
        let (first, level) = (*first, self.level);
        // Geometry as plain numbers, one struct per edge and joint, for the derivatives along
        // parameters.
        let mut references = None;
        let beyond = self.frames[self.frames.len() - 1];
        let frames = block::<D, V, _>(self.frames, first, beyond, &mut references);
        let frame = EdgeFrame::pack_lanes::<V>(level, frames);
        let strain =
            self.elements.stretches::<V>(level, first).strain_of(state.squared, state.length);
        let EdgeState { edge, length, turn, .. } = state;
        // 1/(1 + t.t_ref), the factor of parallel transport from the reference tangent.
        let by_chi = one_plus_dot(frame.tangent, edge.tangent).recip();
        let across = [scale(edge.m[0], edge.inverse_length), scale(edge.m[1], edge.inverse_length)];
        let follow = combine(turn[0], across[0], turn[1], across[1]);
        let value = |x: &V, lane: usize| x.lane(lane).value();
        for (lane, to) in geometry.edges[first..].iter_mut().take(V::LANES).enumerate() {
            let vector =
                |v: &Vector<V>| [value(&v[0], lane), value(&v[1], lane), value(&v[2], lane)];
            *to = SpatialEdgeGeometry {
                length: value(length, lane),
                inverse_length: value(&edge.inverse_length, lane),
                tangent: vector(&edge.tangent),
                strain: value(&strain, lane),
                across: [vector(&across[0]), vector(&across[1])],
                turn: [value(&turn[0], lane), value(&turn[1], lane)],
                follow: vector(&follow),
                by_chi: value(&by_chi, lane),
            };
        }
        // Derivatives of the three strains by the motions p, q and h of both edges.
        let slopes = joint.slopes(edge, &next.edge);
        for (lane, to) in geometry.joints[first..].iter_mut().take(V::LANES).enumerate() {
            for a in 0..3 {
                to.strains[a] = value(&joint.strains[a], lane);
                for c in 0..3 {
                    to.by[0][a][c] = value(&slopes[0][a][c], lane);
                    to.by[1][a][c] = value(&slopes[1][a][c], lane);
                }
            }
        }
    }

    /// Passes first and second derivatives by all edges, with their stretching and both their joints, by the
    /// hand-derived formulas to the consumer `to`. Nonlinear bending and active friction springs are included,
    /// nonlinear parts of stretching laws are not. Overwrites `geometry` if there is one.
    #[inline(always)]
    fn derive(
        mut self,
        to: &mut impl EdgeSink<V, Space, 3, 3>,
        mut geometry: Option<&mut Geometry>,
    ) {
        let zero = V::gather(self.level, |_| D::from(0.0));
        let mut open = EdgeSum { gradient: [zero; 3], hessian: [zero; 6] };
        // Per block: stresses of the joints, their derivatives by both edges, axial force; one
        // edge has two joints.
        while let Some(pairs) = self.next() {
            let SpatialEdgePairs { first, e, f, bent, .. } = &pairs;
            if let Some(geometry) = &mut geometry {
                self.measure(&pairs, geometry);
            }
            let (stiffness, stress) = self.response(&pairs);
            let tangent = bent.tangent(&e.edge, &f.edge, &stiffness, &stress);
            let [force, along] =
                self.elements.stretches::<V>(self.level, *first).tension(e.squared, e.length);
            // The joint before an edge is in the previous lane, or was the last of the previous
            // block.
            let sum = tangent.f.before::<D>(&open).plus(&tangent.e);
            let tension = tension(self.elements.tensions, self.level, *first, force);
            let own = e.derivatives(&sum, [force, tension], along);
            to.edges(*first, &own, &between(e, f, tangent.fe));
            // Derivatives of the last joint by its second edge, which the next block has.
            open = tangent.f;
        }
    }
}

/// The elastic laws of the joints after the edges from index `first` on; without stiffness beyond the last joint.
#[inline(always)]
pub(super) fn joints<D: RodScalar, V: SimdScalar<D>>(
    all: &[JointLaw<D>],
    level: V::Level,
    first: usize,
) -> JointLaw<V> {
    let mut room = None;
    JointLaw::pack_lanes(level, block::<D, V, _>(all, first, JointLaw::none(), &mut room))
}

/// The vectors, m, and angles, rad, of the edges from index `first` on at the unknowns `q`, one edge per lane. Beyond
/// the last edge the rod is continued straight.
#[inline(always)]
pub(super) fn vectors_at<D: RodScalar, V: SimdScalar<D>>(
    q: &[D],
    level: V::Level,
    first: usize,
) -> (Vector<V>, V) {
    let mut room = None;
    let q = window(q, first, STRIDE, STRIDE * V::LANES + 3, &mut room);
    let start = [
        V::gather(level, |lane| q[STRIDE * lane]),
        V::gather(level, |lane| q[STRIDE * lane + 1]),
        V::gather(level, |lane| q[STRIDE * lane + 2]),
    ];
    let end = [
        V::gather(level, |lane| q[STRIDE * lane + 4]),
        V::gather(level, |lane| q[STRIDE * lane + 5]),
        V::gather(level, |lane| q[STRIDE * lane + 6]),
    ];
    (sub(end, start), V::gather(level, |lane| q[STRIDE * lane + 3]))
}

/// The reference frames of the edges from index `first` on, one per lane; lanes beyond the last edge have its frame.
#[inline(always)]
pub(super) fn frames_at<D: RodScalar, V: SimdScalar<D>>(
    frames: &[EdgeFrame<D>],
    level: V::Level,
    first: usize,
) -> EdgeFrame<V> {
    let mut room = None;
    let beyond = frames[frames.len() - 1];
    EdgeFrame::pack_lanes(level, block::<D, V, _>(frames, first, beyond, &mut room))
}

/// Lengths, directors, angles and reference frames of the edges from index `first` on at the unknowns `q`, one edge per
/// lane. Beyond the last edge the rod is continued straight.
#[inline(always)]
fn edges_at<D: RodScalar, V: SimdScalar<D>>(
    q: &[D],
    frames: &[EdgeFrame<D>],
    level: V::Level,
    first: usize,
) -> Edges<V> {
    let frame = frames_at(frames, level, first);
    let (e, angle) = vectors_at(q, level, first);
    Edges { state: EdgeState::new(&frame, e, angle), angle, frame }
}
