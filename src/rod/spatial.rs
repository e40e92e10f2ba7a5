//! The layout of a rod in space: stretch, bend and twist, four unknowns a node.
//!
//! Unknowns `q = [x0 (3), theta0, x1 (3), theta1, .., x_last (3)]`, m and rad; half-bandwidth 10.

mod forces;
mod geometry;
mod moving;
mod rates;
mod sweep;
mod transposed;

use crate::energy::bend_twist;
use crate::energy::bend_twist::{BendTwist, JointLaw};
use crate::energy::frame::{EdgeFrame, Frames, transported_twist};
use crate::energy::joint::{Between, ByEdge};
use crate::energy::{DeadLoad, Local, dual_gradient, dual_tangent};
use crate::numerics::banded::BandMatrix;
use crate::numerics::scalar::{Nestable, Scalar, SimdScalar};
use crate::numerics::vector::{Vector, add, dot, map_components, unit};
use crate::rod::DiscreteRod;
pub use crate::rod::edges::HALF_BANDWIDTH;
use crate::rod::edges::{STRIDE, ToEdges, ToNodes};
use crate::rod::layout::{EdgeSink, Layout, NodeSink, Space};
use crate::rod::spatial::forces::{Gradient, MovedGradient};
pub use crate::rod::spatial::geometry::Geometry;
use crate::rod::spatial::moving::Rebase;
use crate::rod::spatial::sweep::{Along, At, Elements};
use num_dual::Dual64;
use std::f64::consts::TAU;

/// A rod in space.
pub type SpatialRod<D> = DiscreteRod<D, Space, 3, 3>;

/// Unknowns of a bend and twist.
const WINDOW: usize = bend_twist::UNKNOWNS;
/// Where the six unknowns of a stretch stand in the window.
const ENDS: [usize; 6] = [0, 1, 2, 4, 5, 6];

/// The unknowns of bend and twist `i`.
#[inline(always)]
fn around<D: Copy>(q: &[D], i: usize) -> &[D; WINDOW] {
    q[STRIDE * i..].first_chunk().expect("a joint's nodes are nodes of the rod")
}

/// The unknowns of stretch `i`.
#[inline(always)]
fn ends<D: Copy>(q: &[D], i: usize) -> [D; 6] {
    let own: &[D; 7] = q[STRIDE * i..].first_chunk().expect("an edge's nodes are nodes of the rod");
    let [a, b, c, d, e, f] = ENDS;
    [own[a], own[b], own[c], own[d], own[e], own[f]]
}

impl<D: Nestable> SpatialRod<D> {
    /// Bend and twist `i` with its reference.
    #[inline(always)]
    pub fn bend_twist(&self, i: usize, frames: &Frames<D>) -> BendTwist<D> {
        with_reference(&self.joint[i], i, frames)
    }
}

/// Joint `i` with its reference.
#[inline(always)]
fn with_reference<D: Scalar>(joint: &JointLaw<D>, i: usize, frames: &Frames<D>) -> BendTwist<D> {
    joint.at([frames.edges[i], frames.edges[i + 1]], frames.twist[i])
}

/// The same with the springs of internal friction that act there.
fn joint<D: Nestable>(
    elements: &Elements<'_, D>,
    i: usize,
    q: &[D],
    frames: &Frames<D>,
) -> BendTwist<D> {
    let element = with_reference(&elements.joint[i], i, frames);
    let spring = elements.springs.and_then(|springs| Some((springs, springs.acting.get(i)?)));
    let Some((springs, (elastic, from))) = spring else { return element };
    let strains = element.strains(around(q, i));
    let both = (&elements.joint[i], elastic);
    let JointLaw { stiffness, natural } =
        springs.sliders.joint(i, both, strains, add(strains, *from));
    BendTwist { stiffness, natural, ..element }
}

impl Layout<3, 3> for Space {
    const STRIDE: usize = STRIDE;
    type Joint<D: Scalar> = JointLaw<D>;
    type Moments<D: Scalar> = ();
    type Tangent<D: Scalar> = BandMatrix<D, HALF_BANDWIDTH>;
    type Frames<D: Scalar> = Frames<D>;
    type Geometry = Geometry;
    type ByEdge<V: Scalar> = ByEdge<V>;
    type Between<V: Scalar> = Between<V>;
    type Blocks<'a, D: Nestable, V: SimdScalar<D>> = Along<'a, D, V>;

    #[inline(always)]
    fn edge<D: Scalar>(q: &[D], i: usize) -> [D; 3] {
        let [x0, y0, z0, x1, y1, z1] = ends(q, i);
        [x1 - x0, y1 - y0, z1 - z0]
    }

    fn resize(geometry: &mut Geometry, edges: usize) {
        geometry.resize(edges);
    }

    fn gradient<D: Nestable>(at: At<'_, D>, gradient: &mut [D]) {
        D::run_sweep(Gradient { at, gradient });
    }

    fn add_gradient_by_duals<D: Nestable>(
        At { elements, q, frames }: At<'_, D>,
        gradient: &mut [D],
    ) {
        for (i, element) in elements.stretch.iter().enumerate() {
            let local = dual_gradient(element, &ends(q, i));
            for r in 0..6 {
                gradient[STRIDE * i + ENDS[r]] += local[r];
            }
        }
        for i in 0..elements.joint.len() {
            let local = bend_twist::dual_gradient(&joint(&elements, i, q, frames), around(q, i));
            for (to, from) in gradient[STRIDE * i..].iter_mut().zip(&local) {
                *to += *from;
            }
        }
    }

    fn joint_strains<D: Nestable>(at: &At<'_, D>, q: &[D], i: usize) -> [D; 3] {
        with_reference(&at.elements.joint[i], i, at.frames).strains(around(q, i))
    }

    fn edge_frames<D: Scalar>(frames: &Frames<D>) -> &[EdgeFrame<D>] {
        &frames.edges
    }

    fn rebase<D: Nestable>(frames: &mut Frames<D>, q: &[D]) {
        D::run_sweep(Rebase { q, frames });
    }

    /// One sweep: every edge's frame is moved, and is its own reference.
    fn moved_gradient<D: Nestable>(
        elements: Elements<'_, D>,
        q: &[D],
        frames: &mut Frames<D>,
        gradient: &mut [D],
    ) {
        D::run_sweep(MovedGradient { elements, q, frames, gradient });
    }

    fn set_real_frames<D: Scalar>(dual: &Frames<Dual64>, frames: &mut Frames<D>) {
        let real = |v: Vector<Dual64>| v.map(|c| D::from(c.re));
        for (to, from) in frames.edges.iter_mut().zip(&dual.edges) {
            *to = EdgeFrame { tangent: real(from.tangent), director: real(from.director) };
        }
        for (to, from) in frames.twist.iter_mut().zip(&dual.twist) {
            *to = D::from(from.re);
        }
    }

    fn refer<D: Scalar>(q: &mut [D], from: &Frames<D>, to: &Frames<D>) {
        let count = from.edges.len();
        let tangents: Vec<Vector<D>> = (0..count).map(|j| unit(Space::edge(q, j))).collect();
        let mut before: Option<(D, D)> = None;
        for (j, t) in tangents.iter().enumerate() {
            let theta = STRIDE * j + 3;
            let old = q[theta];
            let [director, _] = from.edges[j].material(*t, old);
            let [d1, d2] = to.edges[j].material(*t, D::from(0.0));
            let angle = dot(director, d2).atan2(dot(director, d1));
            // Whole turns: the first edge's as they were, the others' so that twist stays.
            let expected = match before {
                None => old,
                Some((old_left, new_left)) => {
                    let twist = |frames: &Frames<D>| {
                        let ends = [frames.edges[j - 1].tangent, frames.edges[j].tangent];
                        frames.twist[j - 1] - transported_twist(ends, [tangents[j - 1], *t])
                    };
                    old - old_left + twist(from) - twist(to) + new_left
                }
            };
            let turns = ((expected - angle).value() / TAU).round();
            let new = angle + turns * TAU;
            before = Some((old, new));
            q[theta] = new;
        }
    }

    fn director<D: Scalar>(q: &[D], frames: &Frames<D>, j: usize) -> Option<[D; 3]> {
        Some(frames.edges[j].material(unit(Space::edge(q, j)), q[STRIDE * j + 3])[0])
    }

    fn untwist<D: Scalar>(q: &mut [D], frames: &Frames<D>) {
        for (j, twist) in frames.twist.iter().enumerate() {
            q[STRIDE * (j + 1) + 3] = q[STRIDE * j + 3] - *twist;
        }
    }

    fn align<D: Scalar>(q: &mut [D], frames: &Frames<D>, j: usize, director: [D; 3], turn: f64) {
        let [d1, d2] = frames.edges[j].material(unit(Space::edge(q, j)), D::from(0.0));
        let angle = dot(director, d2).atan2(dot(director, d1));
        let theta = &mut q[STRIDE * j + 3];
        let turns = ((*theta + turn - angle).value() / TAU).round();
        *theta = angle + turns * TAU;
    }

    fn node_sink<'a, D: Scalar, V: SimdScalar<D>>(
        level: V::Level,
        load: &'a [DeadLoad<D, 3>],
        gradient: &'a mut [D],
        tangent: &'a mut BandMatrix<D, HALF_BANDWIDTH>,
    ) -> impl NodeSink<V, Self, 3, 3> {
        ToNodes::<D, V>::new(level, load, gradient, tangent)
    }

    fn edge_sink<D: Scalar, V: SimdScalar<D>>(
        tangent: &mut BandMatrix<D, HALF_BANDWIDTH>,
        last: usize,
    ) -> impl EdgeSink<V, Self, 3, 3> {
        ToEdges { tangent, last }
    }

    fn derive_by_duals<D: Nestable>(
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
        let mut open = ([zero; 4], [[zero; 4]; 4]);
        for (i, element) in elements.stretch.iter().enumerate() {
            let stretch = dual_tangent(element, &ends(q, i));
            let (mut gradient, mut own) = open;
            for r in 0..3 {
                gradient[r] += stretch.gradient[3 + r];
                for c in 0..3 {
                    own[r][c] += stretch.hessian[3 + r][3 + c];
                }
            }
            if let Some(tensions) = elements.tensions {
                let gain = element.under(&Space::edge(q, i), tensions[i]);
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

    fn measured_edges(geometry: &Geometry) -> impl Iterator<Item = f64> {
        geometry.edges.iter().map(|edge| edge.strain)
    }

    fn measured_joints(geometry: &Geometry) -> impl Iterator<Item = [f64; 3]> {
        geometry.joints.iter().map(|joint| joint.strains)
    }
}
