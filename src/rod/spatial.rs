//! The layout of a rod in space: one stretch per edge, one bend and twist per inner node, four unknowns per node.
//!
//! Unknowns `q = [x0 (3), theta0, x1 (3), theta1, .., x_last (3)]`, m and rad; half-bandwidth of the tangent 10. The
//! angle `theta` of an edge turns its material directors from the reference frame. Implements [`Layout`] for [`Space`]:
//! edge vectors (m), strains of joints, gradient (N, N m) at given or moving frames, and forces of follower loads with
//! their derivatives. Consumers write gradient and tangent. The hand-derived formulas are checked against derivatives
//! by num-dual. [`SpatialRod`] is a rod of this layout; `bend_twist` returns one of its joints as an element.

mod force_rates;
mod forces;
mod frame_products;
mod frames;
mod geometry;
mod moving;
mod rates;
mod sweep;

use crate::energy::bend_twist;
use crate::energy::bend_twist::{BendTwist, JointLaw};
use crate::energy::frame::Frames;
use crate::energy::joint::{Between, ByEdge};
use crate::energy::law::StiffnessEntry;
use crate::energy::{DeadLoad, FollowerLoad, Local, Stiffness, dual_gradient, dual_tangent};
use crate::numerics::banded::BandMatrix;
use crate::numerics::scalar::{RodScalar, Scalar, SimdScalar};
use crate::numerics::vector::map_components;
use crate::rod::DiscreteRod;
pub use crate::rod::edges::HALF_BANDWIDTH;
use crate::rod::edges::{STRIDE, SpatialEdges, SpatialNodes};
use crate::rod::layout::{EdgeSink, Layout, MAX_EDGE_UNKNOWNS, NodeSink, Space};
use crate::rod::spatial::forces::{Gradient, MovedGradient};
pub use crate::rod::spatial::geometry::Geometry;
use crate::rod::spatial::sweep::{At, Elements, SpatialBlocks};

/// A rod in space.
pub type SpatialRod<D> = DiscreteRod<D, Space, 3, 3>;

/// Number of unknowns of a bend and twist: three nodes and two angles.
const WINDOW: usize = bend_twist::UNKNOWNS;
/// Places of the six unknowns of a stretch among seven successive unknowns.
const ENDS: [usize; 6] = [0, 1, 2, 4, 5, 6];

/// The 11 unknowns of bend and twist `i`: three nodes and the angles of two edges.
#[inline(always)]
fn around<D: Copy>(q: &[D], i: usize) -> &[D; WINDOW] {
    q[STRIDE * i..].first_chunk().expect("a joint's nodes are nodes of the rod")
}

/// The six coordinates of the end nodes of edge `i`, m.
#[inline(always)]
fn ends<D: Copy>(q: &[D], i: usize) -> [D; 6] {
    let own: &[D; 7] = q[STRIDE * i..].first_chunk().expect("an edge's nodes are nodes of the rod");
    let [a, b, c, d, e, f] = ENDS;
    [own[a], own[b], own[c], own[d], own[e], own[f]]
}

impl<D: RodScalar> SpatialRod<D> {
    /// The bend and twist element `i` with the reference frames of its edges.
    #[inline(always)]
    pub fn bend_twist(&self, i: usize, frames: &Frames<D>) -> BendTwist<D> {
        with_reference(&self.joint[i], i, frames)
    }
}

/// The element of joint law `i` with the reference frames of its edges.
#[inline(always)]
fn with_reference<D: Scalar>(joint: &JointLaw<D>, i: usize, frames: &Frames<D>) -> BendTwist<D> {
    joint.at([frames.edges[i], frames.edges[i + 1]], frames.twist[i])
}

/// Bend and twist `i` with its reference frames, as a linear elastic element. Stiffness and stress are those of the
/// joint with its nonlinear bending and friction springs at `q`.
fn joint<D: RodScalar>(
    elements: &Elements<'_, D>,
    i: usize,
    q: &[D],
    frames: &Frames<D>,
) -> BendTwist<D> {
    let strains = with_reference(&elements.joint[i], i, frames).strains(around(q, i));
    with_reference(&elements.elastic_joint(i, &strains), i, frames)
}

impl Layout<3, 3> for Space {
    const STRIDE: usize = STRIDE;
    type Stiffness<T: StiffnessEntry> = Stiffness<T>;
    type Joint<D: Scalar> = JointLaw<D>;
    type Tangent<D: Scalar> = BandMatrix<D, HALF_BANDWIDTH>;
    type Frames<D: RodScalar> = Frames<D>;
    type Geometry = Geometry;
    type ByEdge<V: Scalar> = ByEdge<V>;
    type Between<V: Scalar> = Between<V>;
    type Blocks<'a, D: RodScalar, V: SimdScalar<D>> = SpatialBlocks<'a, D, V>;

    /// The vector of edge `i`, m: the position of its second node less that of its first.
    #[inline(always)]
    fn edge<D: Scalar>(q: &[D], i: usize) -> [D; 3] {
        let [x0, y0, z0, x1, y1, z1] = ends(q, i);
        [x1 - x0, y1 - y0, z1 - z0]
    }

    /// The forces of a follower load on the seven unknowns from the first to the second node of edge `i`, N (N m for
    /// the angle).
    fn follower_forces<D: RodScalar>(
        load: &FollowerLoad<D>,
        q: &[D],
        frames: &Frames<D>,
        i: usize,
    ) -> [D; MAX_EDGE_UNKNOWNS] {
        let own = q[STRIDE * i..].first_chunk().expect("an edge of the rod");
        load.spatial_forces(own, &frames.edges[i])
    }

    /// Minus the derivatives of the forces of a follower load on edge `i` by its seven unknowns, N/m, in dual numbers.
    fn follower_tangent<D: RodScalar>(
        load: &FollowerLoad<D>,
        q: &[D],
        frames: &Frames<D>,
        i: usize,
    ) -> [[D; MAX_EDGE_UNKNOWNS]; MAX_EDGE_UNKNOWNS] {
        let own = q[STRIDE * i..].first_chunk().expect("an edge of the rod");
        load.spatial_tangent(own, &frames.edges[i])
    }

    /// Overwrites `gradient` with that of elastic energy less work of the dead loads, N and N m, by the hand-derived
    /// formulas, with friction springs and nonlinear bending. Nonlinear parts of stretching laws, user-defined
    /// energies, contacts and follower loads are left out.
    fn gradient<D: RodScalar>(at: At<'_, D>, gradient: &mut [D]) {
        D::run_sweep(Gradient { at, gradient });
    }

    /// Calls `add(first, gradient)` for each edge with its whole law, then for each joint with its nonlinear bending
    /// and friction springs: the index of its first unknown and its local gradient, N and N m, by num-dual. Loads,
    /// contacts and user-defined energies are left out.
    fn dual_gradients<D: RodScalar>(
        At { elements, q, frames }: At<'_, D>,
        mut add: impl FnMut(usize, &[D]),
    ) {
        for i in 0..elements.stretch.len() {
            let element = &elements.stretch_element(i);
            let local = dual_gradient(element, &ends(q, i));
            let mut own = [D::from(0.0); 7];
            // Stretching does not depend on the angle between the coordinates of both nodes: its entry stays zero.
            (0..6).for_each(|r| own[ENDS[r]] = local[r]);
            add(STRIDE * i, &own);
        }
        for i in 0..elements.joint.len() {
            let element = joint(&elements, i, q, frames);
            add(STRIDE * i, &bend_twist::dual_gradient(&element, around(q, i)));
        }
    }

    /// The strains of joint `i` at `q`: two curvatures along the material directors, and the twist, rad.
    fn joint_strains<D: RodScalar>(at: &At<'_, D>, q: &[D], i: usize) -> [D; 3] {
        with_reference(&at.elements.joint[i], i, at.frames).strains(around(q, i))
    }

    /// Moves the frames to `q` and overwrites `gradient` there, in one sweep: the moved frame of each edge is its own
    /// reference. The parts are those of `gradient` without friction springs and nonlinear bending.
    fn moved_gradient<D: RodScalar>(
        elements: Elements<'_, D>,
        q: &[D],
        frames: &mut Frames<D>,
        gradient: &mut [D],
    ) {
        D::run_sweep(MovedGradient { elements, q, frames, gradient });
    }

    /// A consumer of edge derivatives that overwrites `gradient`, N and N m, and `tangent`, N/m, by nodes, less the
    /// loads.
    fn node_sink<'a, D: Scalar, V: SimdScalar<D>>(
        level: V::Level,
        load: &'a [DeadLoad<D, 3>],
        gradient: &'a mut [D],
        tangent: &'a mut BandMatrix<D, HALF_BANDWIDTH>,
    ) -> impl NodeSink<V, Self, 3, 3> {
        SpatialNodes::<D, V>::new(level, load, gradient, tangent)
    }

    /// A consumer of edge derivatives that adds the second ones to `tangent`, N/m, by edges; `last` is the index of the
    /// last edge.
    fn edge_sink<D: Scalar, V: SimdScalar<D>>(
        tangent: &mut BandMatrix<D, HALF_BANDWIDTH>,
        last: usize,
    ) -> impl EdgeSink<V, Self, 3, 3> {
        SpatialEdges { tangent, last }
    }

    /// Computes first and second derivatives of all edges and joints by num-dual and passes them to the consumer `to`,
    /// edge by edge. Given tensions replace the axial forces in the geometric stiffness.
    fn derive_by_duals<D: RodScalar>(
        At { elements, q, frames }: At<'_, D>,
        to: &mut impl EdgeSink<D, Self, 3, 3>,
    ) {
        // Where the unknowns of the edges stand among those of an inner node, and their signs.
        const FIRST: [(usize, f64); 4] = [(0, -1.0), (1, -1.0), (2, -1.0), (3, 1.0)];
        const SECOND: [(usize, f64); 4] = [(8, 1.0), (9, 1.0), (10, 1.0), (7, 1.0)];
        let zero = D::from(0.0);
        let pick =
            |local: &Local<D, WINDOW>, rows: [(usize, f64); 4], columns: [(usize, f64); 4]| {
                let mut block = [[zero; 4]; 4];
                for (row, (r, a)) in block.iter_mut().zip(rows) {
                    for (to, (c, b)) in row.iter_mut().zip(columns) {
                        *to = local.hessian[r][c] * (a * b);
                    }
                }
                block
            };
        // Derivatives by an edge of the joint before it, which are complete only with the joint after it.
        let mut open = ([zero; 4], [[zero; 4]; 4]);
        for i in 0..elements.stretch.len() {
            let element = &elements.stretch_element(i);
            let stretch = dual_tangent(element, &ends(q, i));
            let (mut gradient, mut own) = open;
            for r in 0..3 {
                gradient[r] += stretch.gradient[3 + r];
                for c in 0..3 {
                    own[r][c] += stretch.hessian[3 + r][3 + c];
                }
            }
            if let Some(tensions) = elements.tensions {
                // The tension replaces the axial force: the difference of both geometric stiffnesses is added.
                let gain = element.geometric_stiffness_change(&Space::edge(q, i), tensions[i]);
                (0..3).for_each(|r| (0..3).for_each(|c| own[r][c] += gain[r][c]));
            }
            let mut after = [[zero; 4]; 4];
            if i < elements.joint.len() {
                let bent = bend_twist::dual_tangent(&joint(&elements, i, q, frames), around(q, i));
                let first = pick(&bent, FIRST, FIRST);
                for r in 0..4 {
                    gradient[r] += bent.gradient[FIRST[r].0] * FIRST[r].1;
                    for c in 0..4 {
                        own[r][c] += first[r][c];
                    }
                }
                after = pick(&bent, SECOND, FIRST);
                let second = map_components(&SECOND, |(r, sign)| bent.gradient[r] * sign);
                open = (second, pick(&bent, SECOND, SECOND));
            }
            let three = |r: usize| [own[r][0], own[r][1], own[r][2]];
            let (vector, angle_vector) = ([three(0), three(1), three(2)], three(3));
            to.edges(i, &ByEdge { gradient, vector, angle_vector, angle: own[3][3] }, &after);
        }
    }
}
