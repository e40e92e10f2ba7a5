//! Construction of the [assembly](crate::rod::assembly) of a structure over any number type of its scene.
//! [`Blueprint::new`] makes the choices that have no derivatives, in plain numbers. These are the plan (supports,
//! bodies, springs, places of the rods), the scene of each rod alone, and one model per rod, all planar or all spatial.
//! Planar models are tried unless `dimension` is `spatial`. With `auto`, spatial ones replace them if a planar model is
//! an error, as where the structure leaves a plane. Without a shear modulus or Poisson's ratio of every rod that error
//! is returned.
//!
//! [`Blueprint::build`] evaluates rods, bodies and springs for a scene over any number type, such as dual numbers. With
//! `ties`, `build_tied` adds springs from points of each rod to fixed points (recorded markers), and multiplies the
//! axial stiffness of all rods by `AXIAL_FACTOR`. The result, [`AssemblyAtRest`], has the assembly, its unknowns (m,
//! rad) and frames at rest, and the meshes at their places.

use crate::error::Error;
use crate::numerics::scalar::RodScalar;
use crate::problem::{
    Model, PlanarModel, PointTie, Setup, SpatialModel, check_edges, check_on_mesh, correction,
    nodal_loads, nodal_masses, point_ties,
};
use crate::rod::assembly::carrying::MemberRod;
use crate::rod::assembly::{AssemblyFrames, AssemblyLayout, JoinedRods, Member};
use crate::rod::layout::{Plane as PlanarLayout, Space};
use crate::rod::{AssembledRod, Assembly};
use crate::scene::mesh::Mesh;
use crate::scene::rod::Dimension;
use crate::scene::structure::StructureScene;
use crate::scene::{Plane, Point, PointForce, Scene, Support};
use crate::statics::{AXIAL_FACTOR, marker_spring};
use crate::structure::held_nodes::{HeldNodes, planar_held_nodes, spatial_held_nodes};
use crate::structure::inertia::BodiesAtRest;
use crate::structure::placement::{
    PlacedRod, check_joints, common_plane, end_nodes, placed_meshes,
};
use crate::structure::plan::{EndSupport, StructurePlan};
use crate::structure::rod_surfaces::RodSurfaces;
use crate::structure::spatial_inertia::SpatialBodiesAtRest;

/// Springs of points of each rod to recorded markers.
pub(super) struct MarkerTies(pub Vec<Vec<PointTie>>);

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
pub struct AssemblyAtRest<D: RodScalar> {
    /// The rods and bodies.
    pub assembly: Assembly<D>,
    /// Unknowns at rest, m (rad for angles).
    pub q: Vec<D>,
    /// Frames at rest.
    pub frames: AssemblyFrames<D>,
    /// Meshes of the rods, at their places.
    pub meshes: Vec<Mesh<D>>,
}

/// The error of the scene of the rod `name` alone, with the key in the structure: `rods.name.` replaces the prefix
/// `rod.` or precedes a key without it, but for keys of contacts. Errors other than [`Error::Invalid`] are unchanged.
fn of_rod(error: Error, name: &str) -> Error {
    match error {
        Error::Invalid { file, key, found, allowed } => {
            let key = match key.strip_prefix("rod.") {
                // Contacts are those of the structure.
                _ if key.starts_with("contacts") => key,
                Some(rest) => format!("rods.{name}.{rest}"),
                None => format!("rods.{name}.{key}"),
            };
            Error::Invalid { file, key, found, allowed }
        }
        error => error,
    }
}

/// Rejects edges of extreme length ([`check_edges`]), a natural curvature factor other than 1 of a straight rod, and
/// keys that do not fit the mesh ([`check_on_mesh`]).
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

/// The planar model of a rod, from its own scene `part`, in the `plane` of the structure. Errors are those of
/// [`check_part`] and of a section that bends out of the plane.
fn planar_part(part: &Scene, plane: Plane) -> Result<PlanarModel, Error> {
    let mesh = part.mesh()?;
    check_part(part, &mesh)?;
    PlanarModel::in_plane(part, &mesh, plane, correction(part, &mesh, &[]))
}

/// The spatial model of a rod, from its own scene `part`. Errors are those of [`check_part`], and a rod with neither
/// shear modulus nor Poisson's ratio.
fn spatial_part(part: &Scene) -> Result<SpatialModel, Error> {
    let mesh = part.mesh()?;
    check_part(part, &mesh)?;
    if !part.material.has_shear_modulus() {
        let allowed = "poisson_ratio or shear_modulus: a rod in space can twist";
        return Err(Error::invalid("rod.material", "neither of both", allowed));
    }
    Ok(SpatialModel::new(part, &mesh, correction(part, &mesh, &[]), None))
}

/// One planar model per rod, in order, in the common plane of rods, bodies and loads. An error if they are not in one
/// plane ([`common_plane`]), or if a rod is invalid ([`planar_part`]); its key is in `rods.name`.
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

/// Plan, scenes of the single rods and their meshes at their places, in the plane (`in_space` false) or in space. Each
/// scene of a rod has the supports of the plan and is validated. Errors are those of plan, scenes and meshes, and
/// joints whose points are apart ([`check_joints`]).
fn placed(scene: &StructureScene, in_space: bool) -> Result<PlacedScenes, Error> {
    let plan = StructurePlan::new(scene, in_space)?;
    let dimension = if in_space { Dimension::Spatial } else { Dimension::Planar };
    let ends = plan.ends.iter().enumerate();
    let parts: Vec<Scene> = ends
        .map(|(i, ends)| scene.part(i, ends.map(EndSupport::support), dimension))
        .collect::<Result<_, _>>()?;
    // Each rod is checked as a scene of its own; its errors get the keys of the structure.
    for (part, rod) in parts.iter().zip(&scene.rods) {
        part.validate().map_err(|error| of_rod(error, &rod.name))?;
    }
    let meshes = placed_meshes(&plan, scene, &parts)?;
    check_joints(&plan, scene, &meshes)?;
    Ok(PlacedScenes { plan, parts, meshes })
}

impl Blueprint {
    /// The choices of a validated scene. The models are planar unless `dimension` is `spatial`. With `auto`, an error
    /// of the planar models leads to spatial ones, if all rods have a shear modulus or Poisson's ratio; else it is
    /// returned.
    ///
    /// # Errors
    /// [`Error::Invalid`]: a requested planar structure that is not in one plane, joints whose points are apart, rods
    /// or bodies that nothing connects. Also ends held twice, rods that nothing places, and invalid keys of a rod.
    pub fn new(scene: &StructureScene) -> Result<Self, Error> {
        if scene.dimension != Dimension::Spatial {
            let PlacedScenes { plan, parts, meshes } = placed(scene, false)?;
            match planar_models(scene, &parts, &meshes) {
                Ok(models) => return Ok(Self { plan, parts, models }),
                // Without shear moduli the structure was meant to be in a plane.
                Err(error) if scene.dimension == Dimension::Planar => return Err(error),
                Err(error) if !parts.iter().all(|part| part.material.has_shear_modulus()) => {
                    return Err(error);
                }
                Err(_) => {}
            }
        }
        // Hinges are pinned ends in a plane and springs in space, so that the plan is made again.
        let PlacedScenes { plan, parts, .. } = placed(scene, true)?;
        let rods = parts.iter().zip(&scene.rods);
        let rods = rods
            .map(|(part, rod)| spatial_part(part).map_err(|error| of_rod(error, &rod.name)))
            .collect::<Result<_, Error>>()?;
        Ok(Self { plan, parts, models: RodModels::Space(rods) })
    }

    /// The assembly of `scene`, over its number type `D`, with unknowns and frames at rest and the meshes at their
    /// places. The choices of this blueprint are kept. Unknowns are those of the rods in order, then the coordinates of
    /// bodies and springs. In space those of each rod are padded with a zero to a multiple of four.
    ///
    /// # Errors
    /// [`Error::Invalid`]: a rigid joint without a moment of inertia, a spring that is too stiff for its rod. Loads
    /// outside of rods, or on a node behind a wall or joint, are errors too. In space also a body without three moments
    /// of inertia, and a hinge without axis.
    pub fn build<D: RodScalar>(
        &self,
        scene: &StructureScene<D>,
    ) -> Result<AssemblyAtRest<D>, Error> {
        self.build_tied(scene, None)
    }

    /// [`build`](Self::build), with springs of points of the rods to fixed points if `ties` are given, one list per
    /// rod. The axial stiffness of all rods is then multiplied by [`AXIAL_FACTOR`], so that the springs do not stretch
    /// them.
    pub fn build_tied<D: RodScalar>(
        &self,
        scene: &StructureScene<D>,
        ties: Option<&MarkerTies>,
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
                let surfaces = RodSurfaces::new(scene, &scenes, &meshes);
                let rods = self.rods::<D, PlanarLayout, _>(scene, rods, scenes, meshes, ties)?;
                let BodiesAtRest { bodies, centers, z } =
                    BodiesAtRest::new(&self.plan, plane, scene, &rods)?;
                let held = |i: usize, own: &_| planar_held_nodes(&self.plan, i, own, &centers);
                let (members, q, _, meshes) = joined(scene, rods, z, held);
                let laws = surfaces.laws(&members);
                let rods = JoinedRods::new(members, bodies, self.plan.coordinates);
                let rods = rods.with_contacts(laws);
                let frames = AssemblyFrames::default();
                Ok(AssemblyAtRest { assembly: Assembly::Plane(rods), q, frames, meshes })
            }
            RodModels::Space(models) => {
                let surfaces = RodSurfaces::new(scene, &scenes, &meshes);
                let rods = self.rods::<D, Space, _>(scene, models, scenes, meshes, ties)?;
                let at_rest = SpatialBodiesAtRest::new(&self.plan, scene, &rods)?;
                let held = |i: usize, own: &_| spatial_held_nodes(&self.plan, i, own, &at_rest);
                let (members, q, rods, meshes) = joined(scene, rods, at_rest.z.clone(), held);
                let frames = AssemblyFrames { rods, rotations: at_rest.references };
                let laws = surfaces.laws(&members);
                let rods = JoinedRods::new(members, at_rest.bodies, self.plan.coordinates);
                let rods = rods.with_contacts(laws);
                Ok(AssemblyAtRest { assembly: Assembly::Space(rods), q, frames, meshes })
            }
        }
    }

    /// All rods in order, each as [`rod`](Self::rod) makes it from its model, own scene, mesh and ties. The first error
    /// is returned.
    fn rods<D: RodScalar, L: AssemblyLayout, M: Model<Rod<D> = L::Rod<D>>>(
        &self,
        scene: &StructureScene<D>,
        models: &[M],
        scenes: Vec<Scene<D>>,
        meshes: Vec<Mesh<D>>,
        ties: Option<&MarkerTies>,
    ) -> Result<Vec<PlacedRod<D, L>>, Error> {
        let parts = scenes.into_iter().zip(meshes).zip(models).enumerate();
        let own_ties = |i: usize| ties.map(|ties| &ties.0[i][..]);
        parts
            .map(|(i, ((own, mesh), model))| self.rod(scene, i, model, own, mesh, own_ties(i)))
            .collect()
    }

    /// Rod number `i` with its unknowns and frames at rest and its mesh. It has its weight and point masses, and the
    /// forces of `loads.point` of the structure on this rod, by default at its tip. The outer node of a clamped end,
    /// behind a wall or joint, has only the masses that point masses put on it, not the mass of the rod. With `ties`
    /// the rod has springs to markers and a larger axial stiffness. An error for a force outside the rod, or on the
    /// outer node of a clamped end by its index.
    fn rod<D: RodScalar, L: AssemblyLayout, M: Model<Rod<D> = L::Rod<D>>>(
        &self,
        structure: &StructureScene<D>,
        i: usize,
        model: &M,
        scene: Scene<D>,
        mesh: Mesh<D>,
        ties: Option<&[PointTie]>,
    ) -> Result<PlacedRod<D, L>, Error> {
        let name = &structure.rods[i].name;
        let rest = model.at_rest(&scene, &mesh);
        let (q, frames) = (model.unknowns(&rest), model.frames(&rest));
        let setup = Setup { scene, mesh, rest, start: None };
        let mut rod = setup.rod(model);
        // The node behind a wall or a joint has neither mass nor weight of the rod, but its share of point masses.
        for (end, hold) in self.plan.ends[i].into_iter().enumerate() {
            if hold.support() == Support::Clamped {
                let [outer, _] = end_nodes(setup.mesh.nodes.len(), end);
                rod.clear_node(outer);
                let shares = nodal_masses(&setup.scene, &setup.mesh)?;
                for own in shares.into_iter().filter(|own| own.node == outer) {
                    rod.add_mass(outer, own.mass, model.components(setup.scene.loads.gravity));
                }
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
                follower: false,
                signal: None,
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
                // The outer node of a clamped end is beyond the joint: a force on it is probably a
                // mistake.
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
        if let Some(ties) = ties {
            let stiffness = marker_spring(&setup, setup.mesh.nodes.len() - 1);
            rod.stiffen_edges(|_| AXIAL_FACTOR);
            rod.set_own(point_ties(&model.chart(&setup.scene, &setup.rest), stiffness, ties));
        }
        Ok(PlacedRod { rod, q, frames, mesh: setup.mesh })
    }
}

/// Members, unknowns, frames and meshes of an assembly.
type Joined<D, L> =
    (Vec<Member<D, L>>, Vec<D>, Vec<<L as AssemblyLayout>::RodFrames<D>>, Vec<Mesh<D>>);

/// The members of an assembly of rods in order, with their damping factors in `scene` and the ranges of their unknowns,
/// then the unknowns, frames and meshes. The unknowns are those of all rods, each padded with zeros to a multiple of
/// `L::STRIDE`, then the coordinates `z` of bodies and springs. `held` returns the nodes of a rod that bodies carry and
/// walls hold.
fn joined<D: RodScalar, L: AssemblyLayout>(
    scene: &StructureScene<D>,
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
        // A rod in space has no angle after its last node: the gap keeps every fourth unknown an
        // angle.
        q.resize(q.len().next_multiple_of(L::STRIDE), D::from(0.0));
        let damping_factor = scene.rods[i].damping_factor;
        members.push(Member { rod: own.rod, range, attachments, fixed, damping_factor });
        all.push(own.frames);
        meshes.push(own.mesh);
    }
    q.append(&mut z);
    (members, q, all, meshes)
}
