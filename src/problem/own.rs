//! A scene's energies of one's own on the rod of a model.

use crate::energy::adapter::Chart;
use crate::energy::attach;
use crate::energy::frame::EdgeFrame;
use crate::energy::place::{Spot, numbers, spots};
use crate::energy::tie::Tie;
use crate::numerics::scalar::Nestable;
use crate::rod::{Extra, Placed};
use crate::scene::mesh::Mesh;
use crate::scene::{Attached, Scene};
use nalgebra::Vector3;
use num_dual::Dual64;
use std::sync::Arc;

/// What acts on a rod whose unknowns at rest these are, with the frames of its edges; none in a plane.
pub(crate) fn extra<D: Nestable>(
    chart: &Chart<D>,
    scene: &Scene<D>,
    mesh: &Mesh<D>,
    (q, frames): (&[D], &[EdgeFrame<D>]),
) -> Extra<D> {
    let placed = |attached: &Attached<D>| {
        let energy = attach::energy(attached)?.clone();
        let nodes = energy.nodes();
        // Node by node and edge by edge.
        let rest = |i: usize| {
            let node = |i: usize| chart.world::<D, 1>(|x| x, &q[chart.stride() * i..], &[]).0[0];
            let edge = |i: usize| {
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
            spots: spots(attached.at(), nodes, mesh, rest),
        })
    };
    Extra::new(scene.energies.iter().filter_map(placed).collect())
}

/// Springs that tie nodes to places in the world, m, each with its stiffness, N/m.
pub(crate) fn ties<D: Nestable>(chart: &Chart<D>, ties: &[(usize, [f64; 3], D)]) -> Extra<D> {
    let tie = |(node, place, stiffness): &(usize, [f64; 3], D)| Placed {
        name: "tie".into(),
        energy: Arc::new(Tie(*place)),
        chart: chart.clone(),
        values: vec![*stiffness],
        spots: vec![Spot {
            first: *node,
            weight: None,
            numbers: numbers([D::from(0.0); 2], &[place.map(D::from)], &[]),
        }],
    };
    Extra::new(ties.iter().map(tie).collect())
}

/// The key of an energy that does not keep a plane.
pub(crate) fn leaving(
    energies: &[Attached],
    normal: Vector3<f64>,
    point: Vector3<f64>,
) -> Option<String> {
    let values = |attached: &Attached| attached.values().map(|(_, value)| *value).collect();
    first_leaving(energies, values, normal, point)
}

/// The same of one that does not once its numbers change as their derivatives say.
pub(crate) fn left_by(
    energies: &[Attached<Dual64>],
    normal: Vector3<f64>,
    point: Vector3<f64>,
) -> Option<String> {
    let values = |attached: &Attached<Dual64>| {
        attached.values().map(|(_, v)| v.re + v.eps * (1.0 + v.re.abs())).collect()
    };
    first_leaving(energies, values, normal, point)
}

fn first_leaving<D>(
    energies: &[Attached<D>],
    values: impl Fn(&Attached<D>) -> Vec<f64>,
    normal: Vector3<f64>,
    point: Vector3<f64>,
) -> Option<String> {
    let leaves = |attached: &&Attached<D>| {
        let keeps = |values: &[f64]| {
            let energy = attach::energy(attached);
            energy.is_none_or(|e| e.keeps_plane(values, normal.into(), point.into()))
        };
        !keeps(&values(attached))
    };
    energies.iter().find(leaves).map(Attached::key)
}
