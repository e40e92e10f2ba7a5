//! The layout of a rod in the plane: one stretch per edge, one bend per inner node, two unknowns per node.
//!
//! Unknowns `q = [x0, y0, x1, y1, ..]`, m, in the plane of the scene; half-bandwidth of the tangent 5. Implements
//! [`Layout`] for [`Plane`]: edge vectors (m), curvatures `2 tan(phi/2)` with the turning angle `phi`, gradient (N),
//! and forces of follower loads (N) with their derivatives. Consumers write gradient and tangent. The hand-derived
//! formulas are checked against derivatives by num-dual. [`PlanarRod`] is a rod of this layout.

mod edges;
mod geometry;
mod rates;
mod sweep;

use crate::energy::law::StiffnessEntry;
use crate::energy::{DeadLoad, FollowerLoad, Local, PlanarBend, dual_gradient, dual_tangent};
use crate::numerics::banded::BandMatrix;
use crate::numerics::scalar::{RodScalar, Scalar, SimdScalar};
use crate::rod::DiscreteRod;
use crate::rod::layout::{EdgeSink, Layout, MAX_EDGE_UNKNOWNS, NodeSink, Plane};
pub use crate::rod::planar::edges::HALF_BANDWIDTH;
use crate::rod::planar::edges::{ByEdge, PlanarEdges, PlanarNodes};
pub use crate::rod::planar::geometry::Geometry;
use crate::rod::planar::sweep::{At, Elements, PlanarBlocks, PlanarGradient};

/// A rod in the plane.
pub type PlanarRod<D> = DiscreteRod<D, Plane, 2, 1>;

/// The `M` unknowns from node `i` on: those of the element that begins there.
#[inline(always)]
fn unknowns<D: Copy, const M: usize>(q: &[D], i: usize) -> &[D; M] {
    q[2 * i..].first_chunk().expect("an element's nodes are nodes of the rod")
}

/// Bend `i` as a linear elastic element with the same stiffness and moment at `q` as the bend with its nonlinear law
/// and its friction spring.
fn bend<D: RodScalar>(elements: &Elements<'_, D>, i: usize, q: &[D]) -> PlanarBend<D> {
    // The energy that num-dual differentiates is elastic: springs act as another stiffness and natural strain.
    elements.elastic_joint(i, &[elements.joint[i].strain(unknowns(q, i))])
}

impl Layout<2, 1> for Plane {
    const STRIDE: usize = 2;
    type Stiffness<T: StiffnessEntry> = [T; 1];
    type Joint<D: Scalar> = PlanarBend<D>;
    type Tangent<D: Scalar> = BandMatrix<D, HALF_BANDWIDTH>;
    type Frames<D: RodScalar> = ();
    type Geometry = Geometry;
    type ByEdge<V: Scalar> = ByEdge<V>;
    type Between<V: Scalar> = [[V; 2]; 2];
    type Blocks<'a, D: RodScalar, V: SimdScalar<D>> = PlanarBlocks<'a, D, V>;

    /// The vector of edge `i`, m: the position of its second node less that of its first.
    #[inline(always)]
    fn edge<D: Scalar>(q: &[D], i: usize) -> [D; 2] {
        let [x0, y0, x1, y1] = *unknowns(q, i);
        [x1 - x0, y1 - y0]
    }

    /// The forces of a follower load on both nodes of edge `i`, N; three entries have no meaning.
    fn follower_forces<D: RodScalar>(
        load: &FollowerLoad<D>,
        q: &[D],
        (): &(),
        i: usize,
    ) -> [D; MAX_EDGE_UNKNOWNS] {
        let [x0, y0, x1, y1] = load.planar_forces(unknowns(q, i));
        let zero = D::from(0.0);
        [x0, y0, x1, y1, zero, zero, zero]
    }

    /// Minus the derivatives of the forces of a follower load on edge `i` by the four coordinates of its nodes, N/m, by
    /// the hand-derived formulas; other entries are zero.
    fn follower_tangent<D: RodScalar>(
        load: &FollowerLoad<D>,
        q: &[D],
        (): &(),
        i: usize,
    ) -> [[D; MAX_EDGE_UNKNOWNS]; MAX_EDGE_UNKNOWNS] {
        let local = load.planar_tangent(unknowns(q, i));
        let mut block = [[D::from(0.0); MAX_EDGE_UNKNOWNS]; MAX_EDGE_UNKNOWNS];
        for (to, from) in block.iter_mut().zip(&local) {
            to[..4].copy_from_slice(from);
        }
        block
    }

    /// Overwrites `gradient` with that of elastic energy less work of the dead loads, N, by the hand-derived formulas,
    /// with friction springs and nonlinear bending. Nonlinear parts of stretching laws, constant moments, user-defined
    /// energies, contacts and follower loads are left out.
    fn gradient<D: RodScalar>(at: At<'_, D>, gradient: &mut [D]) {
        D::run_sweep(PlanarGradient { at, gradient });
    }

    /// Calls `add(first, gradient)` for each edge with its whole law, then for each bend with its nonlinear law and
    /// friction spring: the index of its first unknown and its local gradient, N, by num-dual. Loads, moments, contacts
    /// and user-defined energies are left out.
    fn dual_gradients<D: RodScalar>(
        At { elements, q, .. }: At<'_, D>,
        mut add: impl FnMut(usize, &[D]),
    ) {
        for i in 0..elements.stretch.len() {
            let element = &elements.stretch_element(i);
            add(2 * i, &dual_gradient::<_, _, 4>(element, unknowns(q, i)));
        }
        for i in 0..elements.joint.len() {
            add(2 * i, &dual_gradient::<_, _, 6>(&bend(&elements, i, q), unknowns(q, i)));
        }
    }

    /// The strain of joint `i` at `q`: its curvature `2 tan(phi/2)`.
    fn joint_strains<D: RodScalar>(at: &At<'_, D>, q: &[D], i: usize) -> [D; 1] {
        [at.elements.joint[i].strain(unknowns(q, i))]
    }

    /// A consumer of edge derivatives that overwrites `gradient`, N, and `tangent`, N/m, by nodes, less the loads.
    fn node_sink<'a, D: Scalar, V: SimdScalar<D>>(
        level: V::Level,
        load: &'a [DeadLoad<D, 2>],
        gradient: &'a mut [D],
        tangent: &'a mut BandMatrix<D, HALF_BANDWIDTH>,
    ) -> impl NodeSink<V, Self, 2, 1> {
        PlanarNodes::<D, V>::new(level, load, gradient, tangent)
    }

    /// A consumer of edge derivatives that adds the second ones to `tangent`, N/m, by edges; `last` is the index of the
    /// last edge.
    fn edge_sink<D: Scalar, V: SimdScalar<D>>(
        tangent: &mut BandMatrix<D, HALF_BANDWIDTH>,
        last: usize,
    ) -> impl EdgeSink<V, Self, 2, 1> {
        PlanarEdges { tangent, last }
    }

    /// Computes first and second derivatives of all edges and bends by num-dual and passes them to the consumer `to`,
    /// edge by edge. Given tensions replace the axial forces in the geometric stiffness.
    fn derive_by_duals<D: RodScalar>(
        At { elements, q, .. }: At<'_, D>,
        to: &mut impl EdgeSink<D, Self, 2, 1>,
    ) {
        let zero = D::from(0.0);
        // Derivatives by an edge of the joint before it, which are complete only with the joint after it.
        let mut open = ByEdge { gradient: [zero; 2], vector: [zero; 3] };
        for i in 0..elements.stretch.len() {
            let element = &elements.stretch_element(i);
            let Local { gradient: [.., gx, gy], hessian: h, .. } =
                dual_tangent(element, unknowns(q, i));
            let mut own = open.plus([gx, gy], [h[2][2], h[3][2], h[3][3]]);
            if let Some(tensions) = elements.tensions {
                // The tension replaces the axial force: the difference of both geometric stiffnesses is added.
                let gain = element.geometric_stiffness_change(&Plane::edge(q, i), tensions[i]);
                own = own.plus([zero; 2], [gain[0][0], gain[1][0], gain[1][1]]);
            }
            let mut after = [[zero; 2]; 2];
            if i < elements.joint.len() {
                let Local { gradient: g, hessian: h, .. } =
                    dual_tangent(&bend(&elements, i, q), unknowns(q, i));
                // The first edge goes against the first node, the second with the last.
                own = own.plus([-g[0], -g[1]], [h[0][0], h[1][0], h[1][1]]);
                after = [[-h[4][0], -h[4][1]], [-h[5][0], -h[5][1]]];
                open = ByEdge { gradient: [g[4], g[5]], vector: [h[4][4], h[5][4], h[5][5]] };
            }
            to.edges(i, &own, &after);
        }
    }
}
