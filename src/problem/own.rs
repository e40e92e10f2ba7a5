//! A scene's energies of one's own on the rod of a model.

use crate::energy::adapter::{Adapter, AnyEnergy, Chart};
use crate::energy::attach;
use crate::energy::frame::EdgeFrame;
use crate::energy::own::{By, Curvatures, OwnEnergy, Slopes};
use crate::energy::place::{Directors, Place, Spot, numbers, spots};
use crate::numerics::scalar::{Nestable, Scalar};
use crate::numerics::vector::{Vector, components, dot, scale};
use crate::rod::{Extra, Placed};
use crate::scene::mesh::Mesh;
use crate::scene::number::Quantity;
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
        let rest = |i: usize| {
            let own = &q[chart.stride() * i..];
            let frames = frames.get(i..i + nodes - 1).unwrap_or(&[]);
            macro_rules! of {
                ($n:literal) => {{
                    let (nodes, edges) = chart.world::<D, $n>(|x| x, own, frames);
                    (nodes.to_vec(), edges[..$n - 1].to_vec())
                }};
            }
            match nodes {
                1 => of!(1),
                2 => of!(2),
                _ => of!(3),
            }
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

/// A spring between a node and a place in the world, m, which acts at the node alone.
struct Tie([f64; 3]);

impl OwnEnergy<1, 1> for Tie {
    const PARAMETERS: [(&'static str, Quantity); 1] = [("stiffness", Quantity::positive("N/m"))];

    fn energy<D: Scalar>(
        &self,
        _: &Place<D>,
        [stiffness]: &[D; 1],
        [x]: &[Vector<D>; 1],
        _: &[Directors<D>],
    ) -> D {
        let way: Vector<D> = components(|c| x[c] - self.0[c]);
        *stiffness * dot(way, way) * 0.5
    }

    fn gradient<D: Scalar>(
        &self,
        _: &Place<D>,
        [stiffness]: &[D; 1],
        [x]: &[Vector<D>; 1],
        _: &[Directors<D>],
    ) -> Option<Slopes<D, 1>> {
        let way = components(|c| x[c] - self.0[c]);
        Some(Slopes::default().with(By::Node(0), scale(way, *stiffness)))
    }

    fn hessian<D: Scalar>(
        &self,
        _: &Place<D>,
        [stiffness]: &[D; 1],
        _: &[Vector<D>; 1],
        _: &[Directors<D>],
    ) -> Option<Curvatures<D, 1>> {
        let row = |r: usize| components(|c| *stiffness * f64::from(r == c));
        let block = [row(0), row(1), row(2)];
        Some(Curvatures::default().with(By::Node(0), By::Node(0), block))
    }
}

/// As a rod has it. Not generic: what is would bring the code of every derivative into each program that makes models.
fn tie_to(place: [f64; 3]) -> Arc<dyn AnyEnergy> {
    Arc::new(Adapter(Tie(place)))
}

/// Springs that tie nodes to places in the world, m, each with its stiffness, N/m.
pub(crate) fn ties<D: Nestable>(chart: &Chart<D>, ties: &[(usize, [f64; 3], D)]) -> Extra<D> {
    let tie = |(node, place, stiffness): &(usize, [f64; 3], D)| Placed {
        name: "tie".into(),
        energy: tie_to(*place),
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
