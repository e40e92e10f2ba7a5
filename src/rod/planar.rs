//! The layout of a rod in the plane: stretch and bend, two unknowns a node.
//!
//! Unknowns `q = [x0, y0, x1, y1, ..]`, m, in the plane of the scene; half-bandwidth 5.

mod edges;
mod geometry;
mod rates;
mod sweep;

use crate::energy::friction::SliderRates;
use crate::energy::{
    Local, PlanarBend, Sliders, Stretch, dual_gradient, dual_gradient_rate, dual_tangent,
};
use crate::numerics::banded::BandMatrix;
use crate::numerics::lanes::Lanes;
use crate::numerics::scalar::{Nestable, Scalar};
use crate::rod::layout::{Layout, Plane};
use crate::rod::moments::{Moments, add_slopes};
pub use crate::rod::planar::edges::HALF_BANDWIDTH;
use crate::rod::planar::edges::{ByEdge, TakesEdges, ToEdges, ToNodes};
pub use crate::rod::planar::geometry::Geometry;
use crate::rod::planar::rates::BendRate;
use crate::rod::planar::sweep::{
    At, EdgeTangent, Elastic, Elements, Forces, Measured, Strains, TangentSweep,
};
use crate::rod::{DiscreteRod, Energies, FrameRate, Laws};
use num_dual::Dual64;
use std::ops::{Add, Mul};

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
    type JointRate<const G: usize> = BendRate<G>;
    type Moments<D: Scalar> = Moments<D>;
    type Tangent<D: Scalar> = BandMatrix<D, HALF_BANDWIDTH>;
    type Frames<D: Scalar> = ();
    type Geometry = Geometry;

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

    fn measure<D: Nestable>(at: At<'_, D>, geometry: &mut Geometry) {
        D::side_by_side(Measured { at, geometry });
    }

    fn energies<D: Nestable>(at: At<'_, D>) -> Energies {
        D::side_by_side(Elastic { at })
    }

    fn strains<D: Nestable>(at: At<'_, D>, edges: &mut [D], joints: &mut [[D; 1]]) {
        D::side_by_side(Strains { at, edges, joints });
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

    fn pull<const G: usize>(
        geometry: &Geometry,
        axial: impl Fn(usize, f64) -> Lanes<G>,
        stress: impl Fn(usize, &[f64; 1]) -> [Lanes<G>; 1],
        load: impl Fn(usize) -> [Lanes<G>; 2],
        out: &mut [[f64; G]],
    ) {
        rates::pull(geometry, axial, stress, load, out);
    }

    fn add_rates_by_duals(
        elements: Elements<'_, Dual64>,
        q: &[f64],
        (): &(),
        mut add: impl FnMut(usize, &[f64]),
    ) {
        for (i, element) in elements.stretch.iter().enumerate() {
            add(2 * i, &dual_gradient_rate(element, unknowns::<_, 4>(q, i)));
        }
        for (i, element) in elements.joint.iter().enumerate() {
            add(2 * i, &dual_gradient_rate(element, unknowns::<_, 6>(q, i)));
        }
    }

    fn add_moment_rates(moments: &Moments<Dual64>, q: &[f64], add: impl FnMut(usize, &[f64])) {
        moments.add_gradient_rate(q, add);
    }

    fn add_strain_rates<const G: usize>(
        stretch: &[Stretch<f64, 2>],
        _: &[FrameRate<G>],
        geometry: &Geometry,
        q: &[[f64; G]],
        (edges, joints): (&mut [Lanes<G>], &mut [[Lanes<G>; 1]]),
    ) {
        rates::add_strain_rates(stretch, geometry, q, edges, joints);
    }

    fn stiffness_times<T>(joint: &PlanarBend<f64>, [s]: &[T; 1], _: bool) -> [T; 1]
    where
        T: Copy + Add<Output = T> + Mul<f64, Output = T>,
    {
        [*s * joint.stiffness]
    }

    fn slip_rate<const G: usize>(
        changes: &SliderRates<G>,
        (sliders, i): (&Sliders<f64>, usize),
        _: (&PlanarBend<f64>, &BendRate<G>),
        [z]: [f64; 1],
        [rate]: [Lanes<G>; 1],
    ) -> [Lanes<G>; 1] {
        [changes.slid(sliders, i, z, rate)]
    }

    fn add_to_joint(
        [w]: &[f64; 1],
        [strain]: &[f64; 1],
        [own]: &[f64; 1],
        (stiffness, offset): &mut ([f64; 6], [f64; 3]),
    ) {
        stiffness[0] += w * (strain + own);
        offset[0] += w;
    }

    fn add_to_moments(q: &[f64], d: &[f64], laws: &mut Laws) {
        add_slopes(q, d, &mut laws.moment);
    }

    fn along_moments(moments: &Moments<Dual64>, laws: &Laws) -> f64 {
        let moments = moments.list.iter().filter(|(i, _)| *i < laws.moment.len());
        moments.map(|(i, m)| m.moment.eps * laws.moment[*i]).sum()
    }
}
