//! Places of the rods of a structure: meshes at their origins, points of joints, and the common plane.
//!
//! The mesh of each rod is shifted, without rotation, to its origin (zero without one), or so that its end is at
//! another point of a joint. The point of a clamped end is the middle of its outer edge; of a pinned end it is its
//! outer node ([`end_point`]). That of a body is its position plus the offset. [`placed_meshes`] returns the shifted
//! meshes. [`check_joints`] rejects joints with a point farther from their first point than `JOINT_TOLERANCE` times the
//! length of the longest rod; body points without an offset are not compared.
//!
//! [`common_plane`] returns the plane of all nodes, gravity, point forces, body positions and recorded positions of
//! ends. It is an error, with the key, if one of them leaves it. Offsets must be in that plane; hinge axes and a
//! principal axis of each body must be normal to it. Springs with numbers for three axes are errors too.
//!
//! [`PlacedRod`] is a rod at its place, with the position, m, and the mass, kg, of its nodes; the wall of a clamped end
//! is the middle of its outer edge.

use crate::error::Error;
use crate::numerics::scalar::{RodScalar, Scalar};
use crate::numerics::vector::{Vector, add, dot, rotate, scale, sub};
use crate::rod::Rod;
use crate::rod::assembly::AssemblyLayout;
use crate::scene::contact::contact_directions;
use crate::scene::mesh::Mesh;
use crate::scene::per_axis::PerAxis;
use crate::scene::plane::KeyedVector;
use crate::scene::structure::{RigidBody, StructureJoint, StructureScene};
use crate::scene::{Plane, Scene, Support};
use crate::structure::plan::{JointPoint, Placement, StructurePlan};
use nalgebra::Vector3;

/// Largest distance of the points of a joint, over the length of the longest rod.
const JOINT_TOLERANCE: f64 = 1e-6;
/// Largest component of an offset out of the plane, over the length of the longest rod.
const PLANE_TOLERANCE: f64 = 1e-9;
/// Largest angular momentum out of the plane of a body that turns in it, over that in it. Angles are often given with
/// four digits.
const MOMENTUM_TOLERANCE: f64 = 1e-3;
/// Distance of a recorded marker from the first node, over the length of the longest rod, below which its direction
/// from there is a rounding error.
const AT_NODE: f64 = 1e-6;

/// A rod over a number type, at its place.
pub(super) struct PlacedRod<D: RodScalar, L: AssemblyLayout> {
    pub rod: L::Rod<D>,
    /// Unknowns at rest, m (rad for angles).
    pub q: Vec<D>,
    /// Frames at rest.
    pub frames: L::RodFrames<D>,
    pub mesh: Mesh<D>,
}

impl<D: RodScalar, L: AssemblyLayout> PlacedRod<D, L> {
    /// Position of node `i` at rest, m, in the axes of the model.
    pub fn node(&self, i: usize) -> L::Place<D> {
        L::place(|c| self.q[L::STRIDE * i + c])
    }

    /// Number of nodes of the rod.
    pub fn nodes(&self) -> usize {
        self.q.len().div_ceil(L::STRIDE)
    }

    /// Mass of node `i`, kg, with its point masses.
    pub fn mass(&self, i: usize) -> D {
        self.rod.mass()[L::STRIDE * i]
    }

    /// The middle of the outer edge of an end (0 start, 1 end) at rest, m, in the axes of the model.
    pub fn wall(&self, end: usize) -> L::Place<D> {
        let [outer, inner] = end_nodes(self.nodes(), end).map(|i| L::STRIDE * i);
        L::place(|c| (self.q[outer + c] + self.q[inner + c]) * 0.5)
    }
}

/// Indices of the outermost node of an end (0 start, else end) of a rod with `n` nodes, at least two, and of the node
/// next to it.
pub(super) fn end_nodes(n: usize, end: usize) -> [usize; 2] {
    if end == 0 { [0, 1] } else { [n - 1, n - 2] }
}

/// The point, m, at which an end (0 or 1) of a rod with these nodes is joined: the middle of its outer edge for a
/// clamped `support`, else its outer node.
pub(super) fn end_point<D: Scalar>(nodes: &[Vector<D>], end: usize, support: Support) -> Vector<D> {
    let [outer, inner] = end_nodes(nodes.len(), end).map(|i| nodes[i]);
    match support {
        Support::Clamped => scale(add(outer, inner), D::from(0.5)),
        _ => outer,
    }
}

/// The mesh of every rod, in order, shifted to its place; places are computed in the order of the plan. A rod with the
/// placement `Origin` is shifted by its `origin`, or zero without one. Another one is shifted so that its end is at
/// another point of a joint; the shift is zero if that point is of a body without an offset. `scenes` are those of the
/// single rods. Errors are those of [`Scene::mesh`].
pub(super) fn placed_meshes<D: Scalar>(
    plan: &StructurePlan,
    structure: &StructureScene<D>,
    scenes: &[Scene<D>],
) -> Result<Vec<Mesh<D>>, Error> {
    let mut meshes = scenes.iter().map(Scene::mesh).collect::<Result<Vec<_>, _>>()?;
    // In the order of the plan, in which a rod follows those that its place depends on.
    for placement in &plan.placements {
        let (rod, origin) = match *placement {
            Placement::Origin(rod) => {
                (rod, structure.rods[rod].origin.unwrap_or([D::from(0.0); 3]))
            }
            Placement::Joint { rod, end, joint, at } => {
                let there = point(plan, structure, &meshes, joint, at);
                let own = end_point(&meshes[rod].nodes, end, plan.ends[rod][end].support());
                (rod, there.map_or([D::from(0.0); 3], |there| sub(there, own)))
            }
        };
        meshes[rod].nodes.iter_mut().for_each(|node| *node = add(*node, origin));
    }
    Ok(meshes)
}

/// The point `at` of a joint in the world, m: that of the end of a rod ([`end_point`]), or the position of a body plus
/// the offset of the joint. None for a body without an offset there.
fn point<D: Scalar>(
    plan: &StructurePlan,
    structure: &StructureScene<D>,
    meshes: &[Mesh<D>],
    joint: usize,
    at: JointPoint,
) -> Option<Vector<D>> {
    match at {
        JointPoint::Rod(rod, end) => {
            Some(end_point(&meshes[rod].nodes, end, plan.ends[rod][end].support()))
        }
        JointPoint::Body(body, number) => {
            let offset = structure.joints[joint].connects()[number].offset?;
            Some(add(structure.bodies[body].position, offset))
        }
    }
}

/// Rejects the first joint of which a point is farther from its first point than [`JOINT_TOLERANCE`] of the length of
/// the longest rod. Points of bodies without an offset are not compared. The error has the key `joints[i]`.
pub(super) fn check_joints(
    plan: &StructurePlan,
    structure: &StructureScene,
    meshes: &[Mesh],
) -> Result<(), Error> {
    let longest = meshes.iter().map(|mesh| mesh.length).fold(0.0, f64::max);
    for (joint, points) in plan.joints.iter().enumerate() {
        // Only ends of rods and bodies with an offset have a stated point.
        let places: Vec<Vector<f64>> =
            points.iter().filter_map(|at| point(plan, structure, meshes, joint, *at)).collect();
        let distance = |x: &Vector<f64>| {
            let apart = sub(*x, places[0]);
            dot(apart, apart).sqrt()
        };
        let apart = places.iter().map(distance).fold(0.0, f64::max);
        if apart > JOINT_TOLERANCE * longest {
            let allowed = format!(
                "points that coincide within {:e} m; change rods.origin, a shape or an offset",
                JOINT_TOLERANCE * longest
            );
            let found = format!("points that are {apart:e} m apart");
            return Err(Error::invalid(format!("joints[{joint}]"), found, allowed));
        }
    }
    Ok(())
}

/// The plane through all nodes of the rods, gravity, point forces, positions of bodies, normals, centers and motions of
/// obstacles and, at all frames, of the markers that recorded ends follow ([`Plane::through`]). A structure on one line
/// takes the plane with the first `up` of a section. An error, with the key, for a quantity that leaves the plane.
/// Offsets of joints may leave it by [`PLANE_TOLERANCE`] of the longest rod. Axes of hinges, cylinders and capsules and
/// one principal axis of each body must be normal to it, and springs must have one number for all axes.
pub(super) fn common_plane(structure: &StructureScene, meshes: &[Mesh]) -> Result<Plane, Error> {
    let loads = structure.loads.point.iter().enumerate();
    let forces = loads.map(|(k, load)| KeyedVector {
        key: format!("loads.point[{k}].force"),
        vector: load.force,
    });
    let mut vectors =
        vec![KeyedVector { key: "loads.gravity".into(), vector: structure.loads.gravity }];
    vectors.extend(forces);
    let nodes: Vec<Vector<f64>> = meshes.iter().flat_map(|mesh| mesh.nodes.clone()).collect();
    let start = nodes[0];
    // A body is in the plane if the vector from a node to its center is.
    let centers = structure.bodies.iter().map(|body| KeyedVector {
        key: format!("bodies.{}.position", body.name),
        vector: sub(body.position, start),
    });
    vectors.extend(centers);
    let longest = meshes.iter().map(|mesh| mesh.length).fold(0.0, f64::max);
    let [within, across] = contact_directions(&structure.contacts, start);
    vectors.extend(within);
    for (i, contact) in structure.contacts.iter().enumerate() {
        let motions = contact.motions().iter().enumerate();
        vectors.extend(motions.flat_map(|(k, own)| {
            let keyed = |name: &str, vector| KeyedVector {
                key: format!("contacts[{i}].motion[{k}].{name}"),
                vector,
            };
            [keyed("velocity", own.velocity), keyed("displacement", own.displacement)]
        }));
    }
    // Recorded ends leave the plane where one of their markers does.
    if let Some(recording) = &structure.recording {
        let ways = recording.driving_positions(&structure.supports).map(|place| sub(place, start));
        let ways = ways.filter(|way| dot(*way, *way).sqrt() > AT_NODE * longest);
        vectors.extend(ways.map(|vector| KeyedVector { key: "recording.file".into(), vector }));
    }
    // Rods on one line determine no plane; the section of one of them does.
    let up = structure.rods.iter().find_map(|rod| rod.section.up()).map(Vector3::from);
    let allowed = "a structure whose rods, bodies, loads and recorded ends are in one plane";
    let leaves = |what: String| {
        let found = "a direction out of the plane of the other rods, bodies and loads";
        Error::invalid(what, found, allowed)
    };
    let plane =
        Plane::through(&nodes, &vectors, up).map_err(|what| match what.strip_prefix("edge") {
            Some(_) => leaves("rods".into()),
            None => leaves(what),
        })?;
    // Axes of cylinders and capsules are normal to the plane.
    for KeyedVector { key, vector } in across {
        let (within, out) = plane.components(vector.into());
        if within.norm() >= PLANE_TOLERANCE * out.abs() {
            return Err(leaves(key));
        }
    }
    for (j, joint) in structure.joints.iter().enumerate() {
        for (k, end) in joint.connects().iter().enumerate() {
            let out = end.offset.map_or(0.0, |offset| plane.components(offset.into()).1);
            if out.abs() > PLANE_TOLERANCE * longest {
                return Err(leaves(format!("joints[{j}].connects[{k}].offset")));
            }
        }
        if let StructureJoint::Hinge { axis: Some(axis), .. } = joint {
            let (within, out) = plane.components((*axis).into());
            if within.norm() >= PLANE_TOLERANCE * out.abs() {
                return Err(leaves(format!("joints[{j}].axis")));
            }
        }
        // Numbers for three axes are those of a rotation in space.
        if let StructureJoint::Spring { rotation, rest, .. } = joint {
            for (key, is_per_axis) in
                [("rotation", rotation.is_per_axis()), ("rest", rest.is_per_axis())]
            {
                if is_per_axis {
                    let found = "numbers for three axes";
                    return Err(Error::invalid(
                        format!("joints[{j}].{key}"),
                        found,
                        "one number in a plane",
                    ));
                }
            }
        }
    }
    // A body whose principal axes are tilted against the plane turns out of it.
    for body in &structure.bodies {
        if is_tilted(body, plane.x.cross(&plane.y).into()) {
            return Err(leaves(format!("bodies.{}.orientation", body.name)));
        }
    }
    Ok(plane)
}

/// Whether a rotation of the body about the unit vector `normal` has an angular momentum with a component across it
/// above [`MOMENTUM_TOLERANCE`] of that along it. This is so if no principal axis is along `normal` and the moments
/// differ. False for one moment of inertia.
fn is_tilted(body: &RigidBody, normal: Vector<f64>) -> bool {
    let PerAxis::Three(principal) = body.inertia else { return false };
    let back = body.orientation.map_or([0.0; 3], |turn| turn.map(|c| -c));
    let normal = rotate(back, normal);
    let momentum = [0, 1, 2].map(|i| principal[i] * normal[i]);
    let along = dot(momentum, normal);
    let out = [0, 1, 2].map(|i| momentum[i] - along * normal[i]);
    dot(out, out).sqrt() > MOMENTUM_TOLERANCE * along
}
