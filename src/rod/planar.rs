//! The layout of a rod in the plane: stretch and bend, two unknowns a node.
//!
//! Unknowns `q = [x0, y0, x1, y1, ..]`, m, in the plane of the scene; half-bandwidth 5.

mod edges;
mod geometry;
mod rates;
mod sweep;

use crate::energy::{Local, PlanarBend, dual_gradient, dual_tangent};
use crate::numerics::banded::BandMatrix;
use crate::numerics::scalar::{Nestable, Scalar, Wide};
use crate::rod::DiscreteRod;
use crate::rod::layout::{Layout, Plane};
use crate::rod::moments::Moments;
pub use crate::rod::planar::edges::HALF_BANDWIDTH;
use crate::rod::planar::edges::{ByEdge, TakesEdges, ToEdges, ToNodes};
pub use crate::rod::planar::geometry::Geometry;
use crate::rod::planar::sweep::{Along, At, EdgeTangent, Elements, Forces, TangentSweep};

/// A rod in the plane.
pub type PlanarRod<D> = DiscreteRod<D, Plane, 2, 1>;

/// The unknowns of element `i`: `M` of them from node `i` on.
#[inline(always)]
fn unknowns<D: Copy, const M: usize>(q: &[D], i: usize) -> &[D; M] {
    q[2 * i..].first_chunk().expect("an element's nodes are nodes of the rod")
}

#[inline(always)]
fn scatter<D: Scalar, const M: usize>(from: &[D; M], to: &mut [D], i: usize) {
    let to: &mut [D; M] = to[2 * i..].first_chunk_mut().expect("an element's nodes are the rod's");
    for (to, from) in to.iter_mut().zip(from) {
        *to += *from;
    }
}

/// Bend `i` with its spring of internal friction, where the rod is at `q`.
fn bend<D: Nestable>(elements: &Elements<'_, D>, i: usize, q: &[D]) -> PlanarBend<D> {
    let bend = &elements.joint[i];
    elements.sliding(i, bend, bend.strain(unknowns(q, i)))
}

/// Shows all derivatives by num-dual.
fn each_edge_in_duals<D: Nestable>(At { elements, q, .. }: At<'_, D>, to: &mut impl TakesEdges<D>) {
    let zero = D::from(0.0);
    let mut open = ByEdge { gradient: [zero; 2], vector: [zero; 3] };
    for (i, element) in elements.stretch.iter().enumerate() {
        let Local { gradient: [.., gx, gy], hessian: h, .. } =
            dual_tangent(element, unknowns(q, i));
        let mut own = open.plus([gx, gy], [h[2][2], h[3][2], h[3][3]]);
        if let Some(tensions) = elements.tensions {
            let gain = element.under(&Plane::edge(q, i), tensions[i]);
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

impl Layout<2, 1> for Plane {
    const STRIDE: usize = 2;
    type Joint<D: Scalar> = PlanarBend<D>;
    type Moments<D: Scalar> = Moments<D>;
    type Tangent<D: Scalar> = BandMatrix<D, HALF_BANDWIDTH>;
    type Frames<D: Scalar> = ();
    type Geometry = Geometry;
    type Blocks<'a, D: Nestable, V: Wide<D>> = Along<'a, D, V>;

    #[inline(always)]
    fn edge<D: Scalar>(q: &[D], i: usize) -> [D; 2] {
        let [x0, y0, x1, y1] = *unknowns(q, i);
        [x1 - x0, y1 - y0]
    }

    fn resize(geometry: &mut Geometry, edges: usize) {
        geometry.resize(edges);
    }

    fn gradient<D: Nestable>(at: At<'_, D>, gradient: &mut [D]) {
        D::side_by_side(Forces { at, gradient });
    }

    fn add_gradient_by_duals<D: Nestable>(At { elements, q, .. }: At<'_, D>, gradient: &mut [D]) {
        for (i, element) in elements.stretch.iter().enumerate() {
            scatter(&dual_gradient::<_, _, 4>(element, unknowns(q, i)), gradient, i);
        }
        for i in 0..elements.joint.len() {
            let local: [D; 6] = dual_gradient(&bend(&elements, i, q), unknowns(q, i));
            scatter(&local, gradient, i);
        }
    }

    fn tangent<D: Nestable>(
        at: At<'_, D>,
        gradient: &mut [D],
        tangent: &mut BandMatrix<D, HALF_BANDWIDTH>,
        geometry: Option<&mut Geometry>,
    ) {
        D::side_by_side(TangentSweep { at, gradient, tangent, geometry });
    }

    fn tangent_by_duals<D: Nestable>(
        at: At<'_, D>,
        gradient: &mut [D],
        tangent: &mut BandMatrix<D, HALF_BANDWIDTH>,
    ) {
        let mut nodes = ToNodes::<D, D>::new((), at.elements.load, gradient, tangent);
        each_edge_in_duals(at, &mut nodes);
        nodes.end();
    }

    fn edge_tangent<D: Nestable>(
        at: At<'_, D>,
        by_duals: bool,
        tangent: &mut BandMatrix<D, HALF_BANDWIDTH>,
    ) {
        let mut edges = ToEdges { tangent, last: at.elements.joint.len() };
        match by_duals {
            true => each_edge_in_duals(at, &mut edges),
            false => D::side_by_side(EdgeTangent { at, edges }),
        }
    }

    fn joint_strains<D: Nestable>(at: &At<'_, D>, q: &[D], i: usize) -> [D; 1] {
        [at.elements.joint[i].strain(unknowns(q, i))]
    }

    fn measured_edges(geometry: &Geometry) -> impl Iterator<Item = f64> {
        geometry.edges.iter().map(|edge| edge.strain)
    }

    fn measured_joints(geometry: &Geometry) -> impl Iterator<Item = [f64; 1]> {
        geometry.joints.iter().map(|[curvature, _]| [*curvature])
    }
}
