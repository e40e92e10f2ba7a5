//! Sweeps over the edges of a planar rod in SIMD lanes: strains, energies, gradient, and derivatives by edges.
//!
//! Input: elements and the unknowns `q` (positions of the nodes, m). Each block has as many edges as SIMD lanes, the
//! edges after them and the joints between. Output by block: axial strain of each edge, curvature `2 tan(phi/2)` of
//! each joint, energies of the linear laws, J, and geometry. First and second derivatives by edge vectors, N and N/m,
//! include nonlinear bending and active friction springs. A consumer stores them by nodes or by edges.
//! [`PlanarGradient`] overwrites the gradient alone, N, less the dead loads. An edge then has its axial force along it,
//! and the difference of the moments at its ends over its length as shear force. Nonlinear parts of stretching laws are
//! added elsewhere.
//!
//! `Elements` are those of a planar rod, and `At` these with unknowns. `PlanarBlocks` iterates over blocks of edges;
//! each is a `PlanarEdgePairs`: edges, the edges after them, and the curvatures of the joints between.

use crate::energy::PlanarBend;
use crate::energy::planar_bend::{curvature, curvature_between};
use crate::numerics::scalar::{RodScalar, Scalar, SimdScalar, Sweep};
use crate::rod::blocks::{block, tension, window};
use crate::rod::columns::write_gradient;
use crate::rod::layout::{self, EdgeBlocks, EdgeSink, Plane};
use crate::rod::planar::edges::ByEdge;
use crate::rod::planar::geometry::{Geometry, PlanarEdge, PlanarEdgeGeometry};

/// Edges in SIMD lanes, the edges after them, and the curvatures of the joints between. The joint after the last edge
/// is straight; results of lanes beyond are not used.
pub struct PlanarEdgePairs<V> {
    /// The index of the first edge.
    first: usize,
    /// The edges.
    e: PlanarEdge<V>,
    /// The edges after them.
    f: PlanarEdge<V>,
    /// The curvatures of the joints between.
    curvature: V,
}

/// The elements of a planar rod.
pub(super) type Elements<'a, D> = layout::Elements<'a, D, Plane, 2, 1>;

/// A planar rod at its unknowns.
pub(super) type At<'a, D> = layout::At<'a, D, Plane, 2, 1>;

/// The iterator over the edges of a rod at the unknowns `q`, one block of SIMD lanes at a time.
pub struct PlanarBlocks<'a, D: Scalar, V: SimdScalar<D>> {
    elements: Elements<'a, D>,
    q: &'a [D],
    level: V::Level,
    /// The number of the first edge of the next block.
    first: usize,
    edge: PlanarEdge<V>,
}

impl<'a, D: RodScalar, V: SimdScalar<D>> PlanarBlocks<'a, D, V> {
    /// The elastic laws of the joints after the edges from index `first` on, one per lane; without stiffness beyond the
    /// last joint.
    #[inline(always)]
    fn bends(&self, first: usize) -> PlanarBend<V> {
        let mut room = None;
        let all = block::<D, V, _>(self.elements.joint, first, PlanarBend::none(), &mut room);
        PlanarBend::pack_lanes(self.level, all)
    }

    /// `[moment, stiffness]` of the joints of a block, N m: first and second derivatives of the energy by the turning
    /// angles, with nonlinear bending and active friction springs.
    #[inline(always)]
    fn turning_response(
        &self,
        PlanarEdgePairs { first, curvature, .. }: &PlanarEdgePairs<V>,
    ) -> [V; 2] {
        let law = self.bends(*first);
        let (stiffness, stress) =
            self.elements.responses::<V>(self.level, *first, &law, &[*curvature]);
        PlanarBend::by_angle(*curvature, stiffness, stress)
    }
}

impl<'a, D: RodScalar, V: SimdScalar<D>> EdgeBlocks<'a, D, V, Plane, 2, 1>
    for PlanarBlocks<'a, D, V>
{
    type Block = PlanarEdgePairs<V>;

    /// The iterator over the edges of the rod `at` its unknowns, before its first block.
    #[inline(always)]
    fn new(At { elements, q, .. }: At<'a, D>, level: V::Level) -> Self {
        Self { elements, q, level, first: 0, edge: edges_at(q, level, 0) }
    }

    /// The next block: edges, the edges after them and the curvatures between; `None` after the last edge. The edges of
    /// the block after it are computed already, as the last joint needs the first of them.
    #[inline(always)]
    fn next(&mut self) -> Option<PlanarEdgePairs<V>> {
        let (first, e) = (self.first, self.edge);
        if first >= self.elements.stretch.len() {
            return None;
        }
        // The last joint of this block needs the first edge of the next one.
        self.first += V::LANES;
        if self.first < self.elements.stretch.len() {
            self.edge = edges_at(self.q, self.level, self.first);
        }
        let f = e.after::<D>(&self.edge);
        let curvature = curvature_between(e.tangent, f.tangent);
        Some(PlanarEdgePairs { first, e, f, curvature })
    }

    /// The index of the first edge of a block.
    fn first(block: &PlanarEdgePairs<V>) -> usize {
        block.first
    }

    /// Strains of the edges of a block and curvatures of the joints after them. The curvatures are those of
    /// [`PlanarBend::strain`], to the last digit.
    #[inline(always)]
    fn strains(&self, PlanarEdgePairs { first, e, .. }: &PlanarEdgePairs<V>) -> (V, [V; 1]) {
        let mut room = None;
        let q = window(self.q, *first, 2, 2 * V::LANES + 4, &mut room);
        let at = |c: usize| V::gather(self.level, |lane| q[2 * lane + c]);
        let joint = curvature(&[[at(0), at(1)], [at(2), at(3)], [at(4), at(5)]]);
        (self.elements.stretches::<V>(self.level, *first).strain_of(e.squared, e.length), [joint])
    }

    /// Energies of stretching, bending and twisting (zero) of the linear laws of a block, J, without nonlinear parts of
    /// laws and friction springs.
    #[inline(always)]
    fn energies(&self, PlanarEdgePairs { first, e, curvature, .. }: &PlanarEdgePairs<V>) -> [V; 3] {
        let bend = self.bends(*first).energy_at(*curvature);
        let stretch =
            self.elements.stretches::<V>(self.level, *first).energy_at(e.squared, e.length);
        [stretch, bend, stretch.like(0.0)]
    }

    /// Writes tangents, normals over lengths, lengths, strains, curvatures and their slopes `1 + k^2/4` of a block to
    /// its entries of `geometry`, as plain numbers; lanes beyond the rod are left out.
    #[inline(always)]
    fn measure(
        &self,
        PlanarEdgePairs { first, e: edge, curvature, .. }: &PlanarEdgePairs<V>,
        geometry: &mut Geometry,
    ) {
        let first = *first;
        let strain =
            self.elements.stretches::<V>(self.level, first).strain_of(edge.squared, edge.length);
        let slope = PlanarBend::slope(*curvature);
        let value = |x: V, lane: usize| x.lane(lane).value();
        for (lane, to) in geometry.edges[first..].iter_mut().take(V::LANES).enumerate() {
            let both = |[x, y]: [V; 2]| [value(x, lane), value(y, lane)];
            *to = PlanarEdgeGeometry {
                tangent: both(edge.tangent),
                normal: both(edge.normal),
                strain: value(strain, lane),
                length: value(edge.length, lane),
                inverse_length: value(edge.inverse_length, lane),
            };
        }
        for (lane, to) in geometry.joints[first..].iter_mut().take(V::LANES).enumerate() {
            *to = [value(*curvature, lane), value(slope, lane)];
        }
    }

    /// Passes first and second derivatives by all edges, with their stretching and both their joints, to the consumer
    /// `to`, and overwrites `geometry` if there is one. Nonlinear bending and active friction springs are included,
    /// nonlinear parts of stretching laws are not. An edge has the tangent `t` and the normal `n` over its length `l`.
    /// A change `dx` turns it by `n.dx`, and `n` changes by `-(t n' + n t') dx/l`.
    #[inline(always)]
    fn derive(
        mut self,
        to: &mut impl EdgeSink<V, Plane, 2, 1>,
        mut geometry: Option<&mut Geometry>,
    ) {
        let zero = V::gather(self.level, |_| D::from(0.0));
        let (mut moments, mut stiffnesses) = (zero, zero);
        while let Some(pairs) = self.next() {
            if let Some(geometry) = &mut geometry {
                self.measure(&pairs, geometry);
            }
            let [moment, stiffness] = self.turning_response(&pairs);
            let PlanarEdgePairs { first, e, f, .. } = pairs;
            // Derivatives between an edge and the next, through the joint: -k n_f n_e'.
            let s = [stiffness * f.normal[0], stiffness * f.normal[1]];
            let after = [
                [-(s[0] * e.normal[0]), -(s[0] * e.normal[1])],
                [-(s[1] * e.normal[0]), -(s[1] * e.normal[1])],
            ];
            // The joint before an edge is in the previous lane, or was the last one of the previous block.
            let torque = moment.before(moments) - moment;
            let both = stiffness.before(stiffnesses) + stiffness;
            let [force, along] =
                self.elements.stretches::<V>(self.level, first).tension(e.squared, e.length);
            let tension = tension(self.elements.tensions, self.level, first, force);
            let axial = [force, tension, along];
            to.edges(first, &by_edge(axial, &e, torque, both), &after);
            (moments, stiffnesses) = (moment, stiffness);
        }
    }
}

/// The edges from index `first` on at the unknowns `q`, one per SIMD lane. Beyond the last edge the rod is continued
/// straight.
#[inline(always)]
fn edges_at<D: RodScalar, V: SimdScalar<D>>(
    q: &[D],
    level: V::Level,
    first: usize,
) -> PlanarEdge<V> {
    let mut room = None;
    let q = window(q, first, 2, 2 * V::LANES + 2, &mut room);
    PlanarEdge::new(&[
        V::gather(level, |lane| q[2 * lane]),
        V::gather(level, |lane| q[2 * lane + 1]),
        V::gather(level, |lane| q[2 * lane + 2]),
        V::gather(level, |lane| q[2 * lane + 3]),
    ])
}

/// First and second derivatives of the energy by an edge vector, N and N/m. The edge has an axial `force`, N, a
/// `tension` in its geometric stiffness, N, and the axial stiffness `along`, N/m. Its angle has the `moment` and the
/// `stiffness` of both its joints, N m.
#[inline(always)]
fn by_edge<V: Scalar>(
    [force, tension, along]: [V; 3],
    edge: &PlanarEdge<V>,
    moment: V,
    stiffness: V,
) -> ByEdge<V> {
    let ([t0, t1], [n0, n1]) = (edge.tangent, edge.normal);
    let across = tension * edge.inverse_length;
    let (along, half) = (along - across, stiffness * 0.5);
    let turned = moment * edge.inverse_length;
    // s n n' - m (t n' + n t')/l = n w' + w n'.
    let w = [half * n0 - turned * t0, half * n1 - turned * t1];
    let (n0w0, n1w1) = (n0 * w[0], n1 * w[1]);
    let (a0, a1) = (along * t0, along * t1);
    ByEdge {
        gradient: [force * t0 + moment * n0, force * t1 + moment * n1],
        vector: [
            a0 * t0 + across + (n0w0 + n0w0),
            a0 * t1 + n0 * w[1] + n1 * w[0],
            a1 * t1 + across + (n1w1 + n1w1),
        ],
    }
}

/// Overwrites the gradient alone, N, by the hand-derived formulas. An edge carries its axial force, and the difference
/// of the moments at its ends over its length as shear force. The gradient at a node is the difference of the forces of
/// its two edges, less its load.
pub(super) struct PlanarGradient<'a, D: RodScalar> {
    pub at: At<'a, D>,
    pub gradient: &'a mut [D],
}

impl<D: RodScalar> Sweep<D> for PlanarGradient<'_, D> {
    type Output = ();

    /// Overwrites the gradient of all nodes, less their dead loads, N, block by block with one edge per SIMD lane.
    /// Nonlinear bending and active friction springs are included, nonlinear parts of stretching laws are not.
    #[inline(always)]
    fn sweep<V: SimdScalar<D>>(self, level: V::Level) {
        let elements = self.at.elements;
        let nodes: &mut [[D; 2]] = self.gradient.as_chunks_mut().0;
        let mut along = PlanarBlocks::<D, V>::new(self.at, level);
        let zero = V::gather(level, |_| D::from(0.0));
        let (mut moments, mut carried, edges) = (zero, [zero; 2], elements.stretch.len());
        while let Some(pairs) = along.next() {
            let [moment, _] = along.turning_response(&pairs);
            let PlanarEdgePairs { first, e, .. } = pairs;
            // Moment equilibrium of the edge: the difference of its moments over the length is the shear force.
            let torque = moment.before(moments) - moment;
            let axial = elements.stretches::<V>(level, first).force(e.squared, e.length);
            let force = [
                axial * e.tangent[0] + torque * e.normal[0],
                axial * e.tangent[1] + torque * e.normal[1],
            ];
            let elastic =
                [force[0].before(carried[0]) - force[0], force[1].before(carried[1]) - force[1]];
            write_gradient::<D, V, 2, 2>((first, edges - first), &elastic, elements.load, nodes);
            (moments, carried) = (moment, force);
        }
        let ([x, y], load) =
            (V::extract_lane(&carried, (edges - 1) % V::LANES), &elements.load[edges].force);
        nodes[edges] = [x - load[0], y - load[1]];
    }
}
