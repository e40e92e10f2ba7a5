//! Placement of user-defined energies, and of springs to fixed points, on the rod of a model.
//!
//! [`attached_energies`] evaluates the places of a scene's energies on the rod at rest: elements, weights and rest
//! shapes, with the values of their parameters over any number type. Energies without code are left out. [`ties`] makes
//! springs of the energy `k |x - x0|^2/2` (J) between nodes and points of the world (m); [`point_ties`] those of points
//! of edges. All three return `UserEnergies`, the user-defined part of a rod. [`find_nonplanar`] returns the key of the
//! first energy that does not keep a given plane at given parameter values, or `None`, for the choice of the model.
//!
//! `RestState` is the rod at rest. `NodeTie` and `PointTie` are springs between a node, or a point between two nodes,
//! and a fixed point.

use crate::energy::adapter::{Adapter, Chart};
use crate::energy::anchor_spring::AnchorSpring;
use crate::energy::attach;
use crate::energy::edge_tie::EdgeTie;
use crate::energy::frame::EdgeFrame;
use crate::energy::place::{ElementPlacement, numbers, placements};
use crate::numerics::scalar::RodScalar;
use crate::rod::{Placed, UserEnergies};
use crate::scene::mesh::Mesh;
use crate::scene::{Attached, Scene};
use nalgebra::Vector3;
use std::sync::Arc;

/// Rod at rest: its unknowns, and the frames of its edges, of which there are none in a plane.
pub(crate) struct RestState<'a, D> {
    /// Unknowns, m (rad for angles).
    pub q: &'a [D],
    /// Frames of the edges.
    pub frames: &'a [EdgeFrame<D>],
}

/// Linear spring between a node and a fixed point of the world.
pub(crate) struct NodeTie<D> {
    /// Index of the node.
    pub node: usize,
    /// Point in the world, m.
    pub point: [f64; 3],
    /// Stiffness, N/m.
    pub stiffness: D,
}

/// Spring between a point on the straight line from a node to the next one and a fixed point of the world.
#[derive(Clone, Debug)]
pub(crate) struct PointTie {
    /// Index of the first node.
    pub node: usize,
    /// Weight of the next node.
    pub weight: f64,
    /// Point in the world, m.
    pub point: [f64; 3],
}

/// Springs of this stiffness, N/m, between points of a rod and fixed points, as the part `UserEnergies` of the rod;
/// their energy is `k |x - x0|^2/2`, J. `chart` has the axes of the model.
pub(crate) fn point_ties<D: RodScalar>(
    chart: &Chart<D>,
    stiffness: D,
    ties: &[PointTie],
) -> UserEnergies<D> {
    let tie = |PointTie { node, weight, point }: &PointTie| Placed {
        name: "tie".into(),
        energy: Arc::new(Adapter(EdgeTie { weight: *weight, point: *point })),
        chart: chart.clone(),
        values: vec![stiffness],
        placements: vec![ElementPlacement {
            first: *node,
            weight: None,
            numbers: numbers(
                [D::from(0.0); 2],
                &[point.map(D::from); 2],
                &[[[D::from(0.0); 3]; 3]],
            ),
        }],
    };
    UserEnergies::new(ties.iter().map(tie).collect())
}

/// User-defined energies of a scene as the part `UserEnergies` of its rod. Each has its elements with weights and rest
/// shapes, and the values of its parameters. Elements follow from the place of the energy and the `mesh`. Energies
/// without code are left out.
pub(crate) fn attached_energies<D: RodScalar>(
    chart: &Chart<D>,
    scene: &Scene<D>,
    mesh: &Mesh<D>,
    RestState { q, frames }: RestState<D>,
) -> UserEnergies<D> {
    let placed = |attached: &Attached<D>| {
        let energy = attach::energy(attached)?.clone();
        let nodes = energy.nodes();
        // Nodes and edges at rest of the element from node `i` on.
        let rest = |i: usize| {
            let node = |i: usize| chart.world::<D, 1>(|x| x, &q[chart.stride() * i..], &[]).0[0];
            let edge = |i: usize| {
                // A plane has no frames; its chart does not use them.
                let frames = frames.get(i..=i).unwrap_or(&[]);
                chart.world::<D, 2>(|x| x, &q[chart.stride() * i..], frames).1[0]
            };
            ((i..i + nodes).map(node).collect(), (i..i + nodes - 1).map(edge).collect())
        };
        Some(Placed {
            name: attached.shared_name(),
            energy,
            chart: chart.clone(),
            values: attached.values().map(|(_, value)| *value).collect(),
            placements: placements(attached.at(), nodes, mesh, rest),
        })
    };
    UserEnergies::new(scene.energies.iter().filter_map(placed).collect())
}

/// Springs with the energy `k |x - x0|^2/2` between nodes and fixed points, as the part `UserEnergies` of a rod; `k` is
/// a number of the type `D`.
pub(crate) fn ties<D: RodScalar>(chart: &Chart<D>, ties: &[NodeTie<D>]) -> UserEnergies<D> {
    let tie = |NodeTie { node, point, stiffness }: &NodeTie<D>| Placed {
        name: "tie".into(),
        energy: Arc::new(AnchorSpring(*point)),
        chart: chart.clone(),
        values: vec![*stiffness],
        placements: vec![ElementPlacement {
            first: *node,
            weight: None,
            numbers: numbers([D::from(0.0); 2], &[point.map(D::from)], &[]),
        }],
    };
    UserEnergies::new(ties.iter().map(tie).collect())
}

/// Key of the first energy whose method `keeps_plane` is false for the plane with this normal through this point, m.
/// None if all keep it; energies without code count as keeping it. `value` returns the number at which a parameter is
/// evaluated.
pub(crate) fn find_nonplanar<D>(
    energies: &[Attached<D>],
    value: impl Fn(&D) -> f64,
    normal: Vector3<f64>,
    point: Vector3<f64>,
) -> Option<String> {
    let leaves = |attached: &&Attached<D>| {
        let values: Vec<f64> = attached.values().map(|(_, v)| value(v)).collect();
        let energy = attach::energy(attached);
        energy.is_some_and(|e| !e.keeps_plane(&values, normal.into(), point.into()))
    };
    energies.iter().find(leaves).map(Attached::key)
}
