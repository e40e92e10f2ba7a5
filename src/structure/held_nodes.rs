//! The nodes of a rod that bodies carry or walls hold.
//!
//! At a clamped end (at a wall, a rigid joint or a spring) the two outermost nodes are held, and in space the angle of
//! their edge. At a pinned end it is one node. Nodes at a wall become [`FixedNode`]s with their position at rest. Those
//! on a body become an [`Attachment`] with the arm of each node, m: from the center of the body, in the axes of the
//! body at rest. With a rotational spring there are two arms: from the center of the body to the wall, and from the
//! wall to the node, in the axes of the clamp. In space an attachment with a clamped end also has tangent and director
//! of the edge.
//!
//! Input: the plan, a rod at rest, and the centers (m) and axes of the bodies. Output: [`HeldNodes`] of this rod, in
//! the order of its ends; free and recorded ends have none.

use crate::numerics::scalar::RodScalar;
use crate::numerics::vector::sub;
use crate::rod::assembly::{AssemblyLayout, Attachment, CarriedEdge, CarriedNode, FixedNode};
use crate::rod::layout::{Plane, Space};
use crate::scene::Support;
use crate::structure::placement::{PlacedRod, end_nodes};
use crate::structure::plan::{EndSupport, StructurePlan};
use crate::structure::spatial_inertia::{
    SpatialBodiesAtRest, clamp_axes, end_edge, in_axes, rest_axes,
};

/// The carried and fixed nodes of a rod.
pub(super) struct HeldNodes<P> {
    pub attachments: Vec<Attachment<P>>,
    pub fixed: Vec<FixedNode<P>>,
}

/// End of a rod that a body carries: index of the end (0 start, 1 end), of the body, and of the spring, if there is
/// one.
#[derive(Clone, Copy)]
struct CarriedEnd {
    end: usize,
    body: usize,
    spring: Option<usize>,
}

/// The nodes of rod `i` that bodies carry and walls hold, in the order of the ends. A clamped end has two nodes, a
/// pinned end one, a free or recorded end none. In space the first of the two nodes of a clamped end also holds the
/// angle of the edge after it. `arms` returns the arms, m, of a node on body and on clamp; `edge` returns the outer
/// edge of a clamped end on a body, none in a plane.
fn held_nodes<D: RodScalar, L: AssemblyLayout>(
    plan: &StructurePlan,
    i: usize,
    own: &PlacedRod<D, L>,
    arms: impl Fn(CarriedEnd, L::Place<D>) -> [L::Place<D>; 2],
    edge: impl Fn(CarriedEnd) -> Option<CarriedEdge<L::Place<D>>>,
) -> HeldNodes<L::Place<D>> {
    let (mut attachments, mut fixed) = (Vec::new(), Vec::new());
    for (end, hold) in plan.ends[i].into_iter().enumerate() {
        let mut held = end_nodes(own.nodes(), end).to_vec();
        // A hinge holds the end node only; a clamp also the next one, and with it the direction.
        let pinned = hold.support() == Support::Pinned;
        if pinned {
            held.truncate(1);
        }
        held.sort_unstable();
        let components = own.node(0).as_ref().len();
        // In space a clamp also holds the angle of the edge between both nodes.
        let width = |node: usize| match !pinned && node == held[0] {
            true => L::STRIDE,
            false => components,
        };
        match hold {
            EndSupport::Free | EndSupport::Recorded(_) => {}
            EndSupport::Wall { .. } => {
                let at =
                    |node: usize| FixedNode { node, width: width(node), position: own.node(node) };
                fixed.extend(held.iter().copied().map(at));
            }
            EndSupport::Body { body, spring, .. } => {
                let carried = CarriedEnd { end, body, spring };
                let node = |node: usize| {
                    let [on_body, on_clamp] = arms(carried, own.node(node));
                    CarriedNode { node, width: width(node), on_body, on_clamp }
                };
                let nodes = held.iter().copied().map(node).collect();
                let edge = edge(carried).filter(|_| !pinned);
                attachments.push(Attachment { body, spring, nodes, edge });
            }
        }
    }
    HeldNodes { attachments, fixed }
}

/// The nodes of rod `i` in a plane that bodies with these `centers`, m, carry, and those at walls: one node of a hinged
/// end, two of a clamped one. The first arm of a node on a body, m, is from the center to the node, the second zero.
/// With a rotational spring the first one is from the center to the wall, the second from the wall to the node.
pub(super) fn planar_held_nodes<D: RodScalar>(
    plan: &StructurePlan,
    i: usize,
    own: &PlacedRod<D, Plane>,
    centers: &[[D; 2]],
) -> HeldNodes<[D; 2]> {
    let arm = |a: [D; 2], b: [D; 2]| [a[0] - b[0], a[1] - b[1]];
    let arms = |CarriedEnd { end, body, spring }: CarriedEnd, place| match spring {
        None => [arm(place, centers[body]), [D::from(0.0); 2]],
        // With a rotational spring, two arms: of the wall on the body, and of the node on the clamp that turns.
        Some(_) => {
            let wall = own.wall(end);
            [arm(wall, centers[body]), arm(place, wall)]
        }
    };
    held_nodes(plan, i, own, arms, |_| None)
}

/// The nodes of rod `i` in space that bodies carry, and those at walls: one of a hinged end, two of a clamped one with
/// the angle of their edge. The arm, m, from the center of the body to a node, and tangent and director of a carried
/// edge are in the axes of the body at rest. With a spring the first arm ends at the wall; the second one, from the
/// wall to the node, and the edge are in the axes of the clamp at rest.
pub(super) fn spatial_held_nodes<D: RodScalar>(
    plan: &StructurePlan,
    i: usize,
    own: &PlacedRod<D, Space>,
    at_rest: &SpatialBodiesAtRest<D>,
) -> HeldNodes<[D; 3]> {
    let references = &at_rest.references;
    let body_axes =
        |body: usize| rest_axes(at_rest.bodies.bodies[body].rotation.as_ref(), references);
    let clamp =
        |spring: usize| rest_axes(Some(&at_rest.bodies.springs[spring].rotation), references);
    let arms = |CarriedEnd { end, body, spring }: CarriedEnd, place: [D; 3]| {
        let (axes, center) = (body_axes(body), at_rest.centers[body]);
        match spring {
            None => [in_axes(&axes, sub(place, center)), [D::from(0.0); 3]],
            Some(spring) => {
                let wall = own.wall(end);
                [in_axes(&axes, sub(wall, center)), in_axes(&clamp(spring), sub(place, wall))]
            }
        }
    };
    let edge = |CarriedEnd { end, body, spring }: CarriedEnd| {
        let axes = spring.map_or_else(|| body_axes(body), clamp);
        let [director, _, tangent] = crate::numerics::rotation::transpose(&clamp_axes(own, end));
        let frame = [tangent, director].map(|v| in_axes(&axes, v));
        Some(CarriedEdge { edge: end_edge(own, end), frame })
    };
    held_nodes(plan, i, own, arms, edge)
}
