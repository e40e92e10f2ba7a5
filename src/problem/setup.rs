//! What a problem makes of its scene's numbers, whatever their type.

use crate::error::Error;
use crate::numerics::scalar::{Nestable, Scalar};
use crate::numerics::vector::Vector;
use crate::problem::model::{Model, NodalLoad, NodalMass};
use crate::problem::own;
use crate::rod::{AssembledRod, NodalDrag};
use crate::scene::mesh::Mesh;
use crate::scene::{PointForce, PointMass, Scene, Track};

/// A scene with its mesh and its rest shape in a model's terms.
#[derive(Clone, Debug)]
pub(crate) struct Setup<D: Nestable, M: Model> {
    pub scene: Scene<D>,
    pub mesh: Mesh<D>,
    pub rest: M::Rest<D>,
    /// The nodes of the shape the rod begins in, if not the rest shape, m.
    pub start: Option<Vec<Vector<D>>>,
}

impl<D: Nestable, M: Model> Setup<D, M> {
    pub fn new(model: &M, scene: Scene<D>) -> Self {
        let mesh = scene.made_mesh();
        let rest = model.at_rest(&scene, &mesh);
        let start = start_shape(&scene, &mesh).expect("a problem's start has been made");
        Self { scene, mesh, rest, start }
    }

    /// The rod under its loads.
    pub fn rod(&self, model: &M) -> M::Rod<D> {
        let mut rod = model.rod(&self.scene, &self.rest);
        let gravity = model.components(self.scene.loads.gravity);
        for NodalMass { node, mass } in self.masses() {
            rod.add_mass(node, mass, gravity);
        }
        self.add_loads(model, &mut rod, &self.loads());
        if !self.scene.energies.is_empty() {
            let chart = model.chart(&self.scene, &self.rest);
            let (q, frames) = (model.unknowns(&self.rest), model.frames(&self.rest));
            let rest = (&q[..], M::Rod::edge_frames(&frames));
            rod.set_own(own::extra(&chart, &self.scene, &self.mesh, rest));
        }
        rod
    }

    /// The rod without loads, every edge as many times as stiff along itself, whose marked nodes are tied to
    /// places in the world, m, by springs of a stiffness, N/m.
    pub fn tied(
        &self,
        model: &M,
        stiffer: impl Fn(usize) -> f64,
        ties: &[(usize, [f64; 3], D)],
    ) -> M::Rod<D> {
        let mut scene = self.scene.clone();
        scene.loads.gravity = [D::from(0.0); 3];
        let mut rod = model.rod(&scene, &self.rest);
        rod.stiffen_edges(stiffer);
        let chart = model.chart(&scene, &self.rest);
        rod.set_own(own::ties(&chart, ties));
        rod
    }

    /// The drag on nodes, if there is a fluid.
    pub fn drag(&self, model: &M) -> Option<NodalDrag<D>> {
        let drag = self.scene.loads.drag.as_ref()?;
        let axes = M::STRIDE.min(3);
        Some(NodalDrag {
            normal: [drag.linear_normal, drag.quadratic_normal],
            tangential: [drag.linear_tangential, drag.quadratic_tangential],
            fluid: model.components(drag.fluid_velocity),
            lengths: M::node_lengths(&self.rest).to_vec(),
            unknowns: [M::STRIDE, axes],
        })
    }

    /// The masses on nodes.
    fn masses(&self) -> Vec<NodalMass<D>> {
        nodal_masses(&self.scene, &self.mesh).expect("checked when the model was chosen")
    }

    /// The loads on nodes.
    pub fn loads(&self) -> Vec<NodalLoad<D>> {
        self.nodal(&self.scene.loads.point)
    }

    /// The rod with the forces that hold it until t = 0.
    pub fn held(&self, model: &M, rod: &M::Rod<D>) -> M::Rod<D> {
        let mut held = rod.clone();
        self.add_loads(model, &mut held, &self.nodal(&self.scene.initial.point));
        held
    }

    fn add_loads(&self, model: &M, rod: &mut M::Rod<D>, loads: &[NodalLoad<D>]) {
        for load in loads {
            rod.add_force(load.node, model.components(load.force));
        }
        model.add_moments(rod, &self.rest, loads);
    }

    fn nodal(&self, points: &[PointForce<D>]) -> Vec<NodalLoad<D>> {
        nodal(points, "loads", &self.mesh).expect("checked when the model was chosen")
    }
}

/// The nodes of the shape the rod begins in, where the scene gives one or it was recorded.
pub(crate) fn start_shape<D: Scalar>(
    scene: &Scene<D>,
    rest: &Mesh<D>,
) -> Result<Option<Vec<Vector<D>>>, Error> {
    if let Some(path) = &scene.supports.path {
        return Ok(Some(between_markers(path.track()?, 0.0, rest.nodes.len() - 1)));
    }
    scene.initial.shape.as_ref().map(|shape| shape.nodes_of(rest)).transpose()
}

/// Where the nodes of a rod of so many edges are at a time, s, by the markers along it: straight from one
/// to the next.
pub(crate) fn between_markers<D: Scalar>(
    track: &Track,
    time: f64,
    segments: usize,
) -> Vec<Vector<D>> {
    let markers = track.markers();
    let edges = segments / (markers.len() - 1);
    let place = |i: usize| {
        let (marker, part) = (i / edges, (i % edges) as f64 / edges as f64);
        let x = markers[marker].at(time);
        match part == 0.0 {
            true => x.map(D::from),
            false => {
                let next = markers[marker + 1].at(time);
                std::array::from_fn(|c| D::from(x[c] + part * (next[c] - x[c])))
            }
        }
    };
    (0..=segments).map(place).collect()
}

/// The loads on the nodes of a mesh.
pub(crate) fn nodal<D: Scalar>(
    loads: &[PointForce<D>],
    table: &str,
    mesh: &Mesh<D>,
) -> Result<Vec<NodalLoad<D>>, Error> {
    let mut nodal = Vec::with_capacity(loads.len());
    for (k, load) in loads.iter().enumerate() {
        let stencil = load.node.stencil(mesh).map_err(|e| off_the_rod(e, table, "point", k))?;
        nodal.extend(stencil.nodes.into_iter().map(|(node, weight)| {
            let share = |vector: Vector<D>| vector.map(|c| c * weight);
            NodalLoad { node, force: share(load.force), moment: share(load.moment) }
        }));
    }
    Ok(nodal)
}

/// The masses on the nodes of a mesh.
pub(crate) fn nodal_masses<D: Scalar>(
    scene: &Scene<D>,
    mesh: &Mesh<D>,
) -> Result<Vec<NodalMass<D>>, Error> {
    let mut nodal = Vec::with_capacity(scene.rod.mass.len());
    for (k, PointMass { node, mass }) in scene.rod.mass.iter().enumerate() {
        let shares = node.shares(mesh).map_err(|error| off_the_rod(error, "rod", "mass", k))?;
        let share = |(node, part)| NodalMass { node, mass: *mass * part };
        nodal.extend(shares.nodes.into_iter().map(share));
    }
    Ok(nodal)
}

/// Names the key of a point that is not on the rod.
fn off_the_rod(error: Error, table: &str, list: &str, k: usize) -> Error {
    match error {
        Error::OutOfRange { what, found, low, high } => {
            let key = if what == "node" { "node" } else { "node.arc_length" };
            let allowed = format!("{low} .. {high}, or \"tip\"");
            Error::invalid(format!("{table}.{list}[{k}].{key}"), found, allowed)
        }
        error => error,
    }
}
