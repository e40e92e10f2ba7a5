//! Construction of the [assembly](crate::rod::assembly) of a structure over any number type of its scene.

use crate::error::Error;
use crate::numerics::scalar::{Nestable, Scalar};
use crate::problem::{
    Model, PlanarModel, Setup, check_edges, check_on_mesh, correction, nodal_loads,
};
use crate::rod::assembly::bodies::{Attachment, CarriedNode};
use crate::rod::assembly::{FixedNode, Member};
use crate::rod::{AssembledRod, Assembly};
use crate::scene::mesh::Mesh;
use crate::scene::structure::StructureScene;
use crate::scene::{Plane, Point, PointForce, Scene, Support};
use crate::structure::inertia::BodiesAtRest;
use crate::structure::placement::{
    PlacedRod, check_joints, common_plane, end_nodes, placed_meshes,
};
use crate::structure::plan::{EndHold, StructurePlan};

/// A rod of a structure with its model in the common plane.
#[derive(Clone, Debug)]
pub(super) struct PartModel {
    /// Scene of the rod alone.
    pub scene: Scene,
    pub model: PlanarModel,
}

/// A structure with the choices that have no derivatives.
#[derive(Clone, Debug)]
pub(super) struct Blueprint {
    pub plan: StructurePlan,
    pub parts: Vec<PartModel>,
    pub plane: Plane,
}

/// An assembly with its unknowns at rest.
#[derive(Clone, Debug)]
pub struct AssemblyAtRest<D: Scalar> {
    /// The rods and bodies.
    pub assembly: Assembly<D>,
    /// Unknowns at rest, m.
    pub q: Vec<D>,
    /// Meshes of the rods, at their places.
    pub meshes: Vec<Mesh<D>>,
}

/// An error of a rod's own scene, with the key in the structure.
fn of_rod(error: Error, name: &str) -> Error {
    match error {
        Error::Invalid { file, key, found, allowed } => {
            let key = match key.strip_prefix("rod.") {
                Some(rest) => format!("rods.{name}.{rest}"),
                None => format!("rods.{name}.{key}"),
            };
            Error::Invalid { file, key, found, allowed }
        }
        error => error,
    }
}

/// The model of a rod in the plane of the structure.
fn part_model(part: &Scene, plane: Plane) -> Result<PlanarModel, Error> {
    let mesh = part.mesh()?;
    check_edges("rod.shape", &mesh.nodes)?;
    let factors = part.rod.natural_curvature.values();
    if mesh.is_straight() && factors.iter().any(|factor| *factor != 1.0) {
        let allowed = "1, or no such key, with a straight shape, whose curvature is zero";
        return Err(Error::invalid("rod.natural_curvature", format!("{factors:?}"), allowed));
    }
    check_on_mesh(part, &mesh)?;
    PlanarModel::in_plane(part, &mesh, plane, correction(part, &mesh, &[]))
}

impl Blueprint {
    /// The choices of a validated scene.
    ///
    /// # Errors
    /// [`Error::Invalid`]: a structure that is not in one plane, joints of distant points, rods that nothing connects.
    pub fn new(scene: &StructureScene) -> Result<Self, Error> {
        let plan = StructurePlan::new(scene)?;
        let parts = plan.ends.iter().enumerate();
        let scenes: Vec<Scene> = parts
            .map(|(i, ends)| scene.part(i, ends.map(EndHold::support)))
            .collect::<Result<_, _>>()?;
        for (part, rod) in scenes.iter().zip(&scene.rods) {
            part.validate().map_err(|error| of_rod(error, &rod.name))?;
        }
        let meshes = placed_meshes(&plan, scene, &scenes)?;
        check_joints(&plan, scene, &meshes)?;
        let plane = common_plane(scene, &meshes)?;
        let parts = scenes.into_iter().zip(&scene.rods).map(|(part, rod)| {
            let model =
                part_model(&part, plane.clone()).map_err(|error| of_rod(error, &rod.name))?;
            Ok(PartModel { scene: part, model })
        });
        let parts = parts.collect::<Result<_, Error>>()?;
        Ok(Self { plan, parts, plane })
    }

    /// The assembly over a number type.
    ///
    /// # Errors
    /// [`Error::Invalid`]: a joint without inertia, loads outside of rods.
    pub fn build<D: Nestable>(
        &self,
        scene: &StructureScene<D>,
    ) -> Result<AssemblyAtRest<D>, Error> {
        let parts = self.parts.iter().enumerate();
        let scenes: Vec<Scene<D>> = parts
            .map(|(i, part)| {
                let mut own = part.scene.map_numbers(|_, value, _| D::from(value));
                scene.fill_part(i, &mut own).map(|()| own)
            })
            .collect::<Result<_, Error>>()?;
        let meshes = placed_meshes(&self.plan, scene, &scenes)?;
        let mut rods = Vec::with_capacity(meshes.len());
        for (i, (own, mesh)) in scenes.into_iter().zip(meshes).enumerate() {
            rods.push(self.rod(scene, i, own, mesh)?);
        }
        let BodiesAtRest { bodies, centers, mut z } =
            BodiesAtRest::new(&self.plan, &self.plane, scene, &rods)?;
        let (mut members, mut q, mut meshes) = (Vec::new(), Vec::new(), Vec::new());
        for (i, own) in rods.into_iter().enumerate() {
            let (attachments, fixed) = self.held_nodes(i, &own, &centers);
            let range = q.len()..q.len() + own.q.len();
            q.extend_from_slice(&own.q);
            members.push(Member { rod: own.rod, range, attachments, fixed });
            meshes.push(own.mesh);
        }
        q.append(&mut z);
        let assembly = Assembly::new(members, bodies, self.plan.coordinates);
        Ok(AssemblyAtRest { assembly, q, meshes })
    }

    /// A rod with its masses and loads.
    fn rod<D: Nestable>(
        &self,
        structure: &StructureScene<D>,
        i: usize,
        scene: Scene<D>,
        mesh: Mesh<D>,
    ) -> Result<PlacedRod<D>, Error> {
        let (model, name) = (&self.parts[i].model, &structure.rods[i].name);
        let rest = model.at_rest(&scene, &mesh);
        let q = model.unknowns(&rest);
        let setup = Setup { scene, mesh, rest, start: None };
        let mut rod = setup.rod(model);
        // The node behind a wall or a joint has neither mass nor weight.
        for (end, hold) in self.plan.ends[i].into_iter().enumerate() {
            if hold.support() == Support::Clamped {
                let [outer, _] = end_nodes(setup.mesh.nodes.len(), end);
                rod.mass[2 * outer..2 * outer + 2].fill(D::from(0.0));
                rod.load[outer].force = [D::from(0.0); 2];
            }
        }
        for (k, load) in structure.loads.point.iter().enumerate() {
            if load.rod.as_ref() != Some(name) {
                continue;
            }
            let force = PointForce {
                node: load.node.unwrap_or_default(),
                force: load.force,
                moment: [D::from(0.0); 3],
            };
            let loads =
                nodal_loads(&[force], "loads", &setup.mesh).map_err(|error| match error {
                    Error::Invalid { file, found, allowed, .. } => {
                        let key = format!("loads.point[{k}].node");
                        Error::Invalid { file, key, found, allowed }
                    }
                    error => error,
                })?;
            for nodal in loads {
                let behind = |end: usize| {
                    let [outer, _] = end_nodes(setup.mesh.nodes.len(), end);
                    outer == nodal.node && self.plan.ends[i][end].support() == Support::Clamped
                };
                if matches!(load.node, Some(Point::Node(_))) && (behind(0) || behind(1)) {
                    let key = format!("loads.point[{k}].node");
                    let found = format!("node {}, which lies behind a wall or a joint", nodal.node);
                    return Err(Error::invalid(
                        key,
                        found,
                        "\"tip\", { arc_length = .. } or another node",
                    ));
                }
                rod.add_force(nodal.node, model.components(nodal.force));
            }
        }
        Ok(PlacedRod { rod, q, mesh: setup.mesh })
    }

    /// The nodes of rod `i` that bodies with these centers carry, and those at walls.
    fn held_nodes<D: Nestable>(
        &self,
        i: usize,
        own: &PlacedRod<D>,
        centers: &[[D; 2]],
    ) -> (Vec<Attachment<D>>, Vec<FixedNode<D>>) {
        let (mut attachments, mut fixed) = (Vec::new(), Vec::new());
        let arm = |a: [D; 2], b: [D; 2]| [a[0] - b[0], a[1] - b[1]];
        for (end, hold) in self.plan.ends[i].into_iter().enumerate() {
            let mut held = end_nodes(own.nodes(), end).to_vec();
            // A hinge holds the end node only; a clamp also the next one, and with it the
            // direction.
            if hold.support() == Support::Pinned {
                held.truncate(1);
            }
            held.sort_unstable();
            match hold {
                EndHold::Free => {}
                EndHold::Wall { .. } => {
                    let at = |node| FixedNode { node, position: own.node(node) };
                    fixed.extend(held.into_iter().map(at));
                }
                EndHold::Body { body, spring, .. } => {
                    let node = |node: usize| {
                        let (place, zero) = (own.node(node), [D::from(0.0); 2]);
                        let (on_body, on_clamp) = match spring {
                            None => (arm(place, centers[body]), zero),
                            // With a rotational spring, two arms: of the wall on the body, and of
                            // the node on the clamp that turns.
                            Some(_) => {
                                let wall = own.wall(end);
                                (arm(wall, centers[body]), arm(place, wall))
                            }
                        };
                        CarriedNode { node, on_body, on_clamp }
                    };
                    let nodes = held.into_iter().map(node).collect();
                    attachments.push(Attachment { body, spring, nodes });
                }
            }
        }
        (attachments, fixed)
    }
}
