//! Construction of the [assembly](crate::rod::assembly) of a structure over any number type of its scene.

use crate::error::Error;
use crate::numerics::scalar::Nestable;
use crate::problem::{
    Model, PlanarModel, Setup, SpatialModel, check_edges, check_on_mesh, correction, nodal_loads,
};
use crate::rod::assembly::carrying::MemberRod;
use crate::rod::assembly::{AssemblyFrames, AssemblyLayout, JoinedRods, Member};
use crate::rod::layout::{Plane as PlanarLayout, Space};
use crate::rod::{AssembledRod, Assembly};
use crate::scene::mesh::Mesh;
use crate::scene::rod::Dimension;
use crate::scene::structure::StructureScene;
use crate::scene::{Plane, Point, PointForce, Scene, Support};
use crate::structure::held_nodes::{HeldNodes, planar_held_nodes, spatial_held_nodes};
use crate::structure::inertia::BodiesAtRest;
use crate::structure::placement::{
    PlacedRod, check_joints, common_plane, end_nodes, placed_meshes,
};
use crate::structure::plan::{EndHold, StructurePlan};
use crate::structure::spatial_inertia::SpatialBodiesAtRest;

/// Models of the rods of a structure.
#[derive(Clone, Debug)]
pub(super) enum RodModels {
    /// In the common plane.
    Plane { plane: Plane, rods: Vec<PlanarModel> },
    /// In space.
    Space(Vec<SpatialModel>),
}

/// A structure with the choices that have no derivatives.
#[derive(Clone, Debug)]
pub(super) struct Blueprint {
    pub plan: StructurePlan,
    /// Scenes of the rods alone.
    pub parts: Vec<Scene>,
    pub models: RodModels,
}

/// An assembly with its unknowns at rest.
#[derive(Clone, Debug)]
pub struct AssemblyAtRest<D: Nestable> {
    /// The rods and bodies.
    pub assembly: Assembly<D>,
    /// Unknowns at rest, m (rad for angles).
    pub q: Vec<D>,
    /// Frames at rest.
    pub frames: AssemblyFrames<D>,
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

/// Rejects meshes and keys of a rod that its model cannot have.
fn check_part(part: &Scene, mesh: &Mesh) -> Result<(), Error> {
    check_edges("rod.shape", &mesh.nodes)?;
    let factors = part.rod.natural_curvature.values();
    if mesh.is_straight() && factors.iter().any(|factor| *factor != 1.0) {
        let allowed = "1, or no such key, with a straight shape, whose curvature is zero";
        return Err(Error::invalid("rod.natural_curvature", format!("{factors:?}"), allowed));
    }
    check_on_mesh(part, mesh)?;
    Ok(())
}

/// The model of a rod in the plane of the structure.
fn planar_part(part: &Scene, plane: Plane) -> Result<PlanarModel, Error> {
    let mesh = part.mesh()?;
    check_part(part, &mesh)?;
    PlanarModel::in_plane(part, &mesh, plane, correction(part, &mesh, &[]))
}

/// The model of a rod in space.
fn spatial_part(part: &Scene) -> Result<SpatialModel, Error> {
    let mesh = part.mesh()?;
    check_part(part, &mesh)?;
    if !can_twist(part) {
        let allowed = "poisson_ratio or shear_modulus: a rod in space can twist";
        return Err(Error::invalid("rod.material", "neither of both", allowed));
    }
    SpatialModel::new(part, &mesh, correction(part, &mesh, &[]), &[], None)
}

/// Whether the shear modulus of a rod is known.
fn can_twist(part: &Scene) -> bool {
    part.material.shear_modulus.is_some() || part.material.poisson_ratio.is_some()
}

/// The models of the rods in their common plane.
fn planar_models(
    scene: &StructureScene,
    parts: &[Scene],
    meshes: &[Mesh],
) -> Result<RodModels, Error> {
    let plane = common_plane(scene, meshes)?;
    let rods = parts.iter().zip(&scene.rods).map(|(part, rod)| {
        planar_part(part, plane.clone()).map_err(|error| of_rod(error, &rod.name))
    });
    let rods = rods.collect::<Result<_, Error>>()?;
    Ok(RodModels::Plane { plane, rods })
}

/// Plan, scenes of the rods and their meshes, for a plane or for space.
struct PlacedScenes {
    plan: StructurePlan,
    parts: Vec<Scene>,
    meshes: Vec<Mesh>,
}

/// The rods at their places.
fn placed(scene: &StructureScene, in_space: bool) -> Result<PlacedScenes, Error> {
    let plan = StructurePlan::new(scene, in_space)?;
    let dimension = if in_space { Dimension::Spatial } else { Dimension::Planar };
    let ends = plan.ends.iter().enumerate();
    let parts: Vec<Scene> = ends
        .map(|(i, ends)| scene.part(i, ends.map(EndHold::support), dimension))
        .collect::<Result<_, _>>()?;
    for (part, rod) in parts.iter().zip(&scene.rods) {
        part.validate().map_err(|error| of_rod(error, &rod.name))?;
    }
    let meshes = placed_meshes(&plan, scene, &parts)?;
    check_joints(&plan, scene, &meshes)?;
    Ok(PlacedScenes { plan, parts, meshes })
}

impl Blueprint {
    /// The choices of a validated scene.
    ///
    /// # Errors
    /// [`Error::Invalid`]: a planar structure that is not in one plane, joints of distant points, rods that nothing connects.
    pub fn new(scene: &StructureScene) -> Result<Self, Error> {
        if scene.dimension != Dimension::Spatial {
            let PlacedScenes { plan, parts, meshes } = placed(scene, false)?;
            match planar_models(scene, &parts, &meshes) {
                Ok(models) => return Ok(Self { plan, parts, models }),
                // Without shear moduli the structure was meant to be in a plane.
                Err(error) if scene.dimension == Dimension::Planar => return Err(error),
                Err(error) if !parts.iter().all(can_twist) => return Err(error),
                Err(_) => {}
            }
        }
        let PlacedScenes { plan, parts, .. } = placed(scene, true)?;
        let rods = parts.iter().zip(&scene.rods);
        let rods = rods
            .map(|(part, rod)| spatial_part(part).map_err(|error| of_rod(error, &rod.name)))
            .collect::<Result<_, Error>>()?;
        Ok(Self { plan, parts, models: RodModels::Space(rods) })
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
                let mut own = part.map_numbers(|_, value, _| D::from(value));
                scene.fill_part(i, &mut own).map(|()| own)
            })
            .collect::<Result<_, Error>>()?;
        let meshes = placed_meshes(&self.plan, scene, &scenes)?;
        match &self.models {
            RodModels::Plane { plane, rods } => {
                let rods = self.rods::<D, PlanarLayout, _>(scene, rods, scenes, meshes)?;
                let BodiesAtRest { bodies, centers, z } =
                    BodiesAtRest::new(&self.plan, plane, scene, &rods)?;
                let held = |i: usize, own: &_| planar_held_nodes(&self.plan, i, own, &centers);
                let (members, q, _, meshes) = joined(rods, z, held);
                let rods = JoinedRods::new(members, bodies, self.plan.coordinates);
                let frames = AssemblyFrames::default();
                Ok(AssemblyAtRest { assembly: Assembly::Plane(rods), q, frames, meshes })
            }
            RodModels::Space(models) => {
                let rods = self.rods::<D, Space, _>(scene, models, scenes, meshes)?;
                let at_rest = SpatialBodiesAtRest::new(&self.plan, scene, &rods)?;
                let held = |i: usize, own: &_| spatial_held_nodes(&self.plan, i, own, &at_rest);
                let (members, q, rods, meshes) = joined(rods, at_rest.z.clone(), held);
                let frames = AssemblyFrames { rods, rotations: at_rest.references };
                let rods = JoinedRods::new(members, at_rest.bodies, self.plan.coordinates);
                Ok(AssemblyAtRest { assembly: Assembly::Space(rods), q, frames, meshes })
            }
        }
    }

    /// All rods with their masses and loads.
    fn rods<D: Nestable, L: AssemblyLayout, M: Model<Rod<D> = L::Rod<D>>>(
        &self,
        scene: &StructureScene<D>,
        models: &[M],
        scenes: Vec<Scene<D>>,
        meshes: Vec<Mesh<D>>,
    ) -> Result<Vec<PlacedRod<D, L>>, Error> {
        let parts = scenes.into_iter().zip(meshes).zip(models).enumerate();
        parts.map(|(i, ((own, mesh), model))| self.rod(scene, i, model, own, mesh)).collect()
    }

    /// A rod with its masses and loads.
    fn rod<D: Nestable, L: AssemblyLayout, M: Model<Rod<D> = L::Rod<D>>>(
        &self,
        structure: &StructureScene<D>,
        i: usize,
        model: &M,
        scene: Scene<D>,
        mesh: Mesh<D>,
    ) -> Result<PlacedRod<D, L>, Error> {
        let name = &structure.rods[i].name;
        let rest = model.at_rest(&scene, &mesh);
        let (q, frames) = (model.unknowns(&rest), model.frames(&rest));
        let setup = Setup { scene, mesh, rest, start: None };
        let mut rod = setup.rod(model);
        // The node behind a wall or a joint has neither mass nor weight.
        for (end, hold) in self.plan.ends[i].into_iter().enumerate() {
            if hold.support() == Support::Clamped {
                let [outer, _] = end_nodes(setup.mesh.nodes.len(), end);
                rod.clear_node(outer);
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
        Ok(PlacedRod { rod, q, frames, mesh: setup.mesh })
    }
}

/// Members, unknowns, frames and meshes of an assembly.
type Joined<D, L> =
    (Vec<Member<D, L>>, Vec<D>, Vec<<L as AssemblyLayout>::RodFrames<D>>, Vec<Mesh<D>>);

/// The members of an assembly of rods and bodies with the coordinates `z`; `held` returns the carried and fixed nodes of a
/// rod.
fn joined<D: Nestable, L: AssemblyLayout>(
    rods: Vec<PlacedRod<D, L>>,
    mut z: Vec<D>,
    held: impl Fn(usize, &PlacedRod<D, L>) -> HeldNodes<L::Place<D>>,
) -> Joined<D, L> {
    let (mut members, mut q, mut all, mut meshes) =
        (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for (i, own) in rods.into_iter().enumerate() {
        let HeldNodes { attachments, fixed } = held(i, &own);
        let range = q.len()..q.len() + own.q.len();
        q.extend_from_slice(&own.q);
        q.resize(q.len().next_multiple_of(L::STRIDE), D::from(0.0));
        members.push(Member { rod: own.rod, range, attachments, fixed });
        all.push(own.frames);
        meshes.push(own.mesh);
    }
    q.append(&mut z);
    (members, q, all, meshes)
}
