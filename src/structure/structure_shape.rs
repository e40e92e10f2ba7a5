//! Positions of the rods and bodies of a structure, by their names, and their CSV.
//!
//! [`Structure::shape_at`] converts unknowns and frames to a [`StructureShape`] in the world, m: all nodes and the end
//! (`tip`) of each rod, and the pose of each body of `[[bodies]]`. A pose is its own center of mass and its rotation
//! from rest, rad: the angle about the normal of the plane, or in space the rotation vector and its size. Bodies of
//! joints are left out. Nodes that bodies carry are placed by these. The tip is the last node, or the wall or joint
//! that holds the end between two nodes. `displacements` are those of nodes in a mode shape, in world axes. The CSV
//! (`to_csv`; `write_rows` with a time) has a row per node of each rod, without bodies.

use crate::numerics::rotation::{identity, product, rotation_vector, transpose};
use crate::numerics::vector::dot;
use crate::rod::Assembly;
use crate::rod::assembly::AssemblyFrames;
use crate::statics::EquilibriumState;
use crate::structure::blueprint::RodModels;
use crate::structure::definition::Structure;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::io::{self, Write};

/// Nodes of a rod.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct RodNodes {
    /// Position of the end of the rod, m: its last node, or the wall or joint that holds this end between two nodes.
    pub tip: [f64; 3],
    /// Position of every node, m.
    pub nodes: Vec<[f64; 3]>,
}

/// Position and rotation of a body.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct BodyPose {
    /// Position of its center of mass, m.
    pub position: [f64; 3],
    /// Rotation from rest about the normal of the plane, rad; in space the size of the rotation.
    pub angle: f64,
    /// Rotation vector from rest in space, rad, up to half a turn; absent in a plane.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotation: Option<[f64; 3]>,
}

/// Rods and bodies of a structure at one time, by their names.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct StructureShape {
    /// The rods.
    pub rods: BTreeMap<String, RodNodes>,
    /// The bodies of `[[bodies]]`.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub bodies: BTreeMap<String, BodyPose>,
}

impl Structure {
    /// Positions of all rods and bodies at the unknowns `q`, m (rad for angles). In space rotations of bodies are
    /// measured from the frames at rest.
    pub fn shape(&self, q: &[f64]) -> StructureShape {
        self.shape_at(q, &self.at_rest.frames)
    }

    /// Positions of all rods and bodies in the world, m, at the unknowns `q`, with the `frames` from which rotations
    /// and angles are measured. Entries of carried nodes in `q` have no effect: the bodies place them. Bodies of joints
    /// are left out.
    pub fn shape_at(&self, q: &[f64], frames: &AssemblyFrames<f64>) -> StructureShape {
        let mut q = q.to_vec();
        let assembly = &self.at_rest.assembly;
        // Unknowns of carried nodes have no meaning: bodies give their places.
        assembly.place_carried(&mut q, frames);
        let mut shape = StructureShape::default();
        for (k, range) in assembly.rod_ranges().into_iter().enumerate() {
            let nodes = self.node_vectors(&q[range], true);
            let tip = self.tip(k, &nodes);
            shape.rods.insert(self.scene.rods[k].name.clone(), RodNodes { tip, nodes });
        }
        let z = &q[assembly.body_coordinates()];
        for (i, plan) in self.blueprint.plan.bodies.iter().enumerate() {
            if let Some(own) = plan.own {
                let pose = self.body_pose(i, z, frames);
                shape.bodies.insert(self.scene.bodies[own].name.clone(), pose);
            }
        }
        shape
    }

    /// The pose of body `i` of the plan at the coordinates `z` of all bodies: its own center of mass in the world, m,
    /// and its rotation from rest, rad. In a plane that is the angle about the normal, zero for a body that does not
    /// rotate. In space it is the rotation vector and its size. `frames` has the references of rotations in space,
    /// without effect in a plane.
    fn body_pose(&self, i: usize, z: &[f64], frames: &AssemblyFrames<f64>) -> BodyPose {
        match (&self.at_rest.assembly, &self.blueprint.models) {
            (Assembly::Plane(rods), RodModels::Plane { plane, .. }) => {
                let body = &rods.bodies().bodies[i];
                let angle = body.rotation.map_or(0.0, |turn| z[turn.coordinate] / turn.length);
                let position = plane.to_world(rods.bodies().load_point(z, body));
                BodyPose { position, angle, rotation: None }
            }
            (Assembly::Space(rods), _) => {
                let (bodies, body) = (rods.bodies(), &rods.bodies().bodies[i]);
                let axes = bodies.axes(z, frames, body);
                // The principal axes have a rotation at rest already, which is not part of the
                // pose.
                let rest = body.rotation.map(|turn| turn.rest_axes(&self.at_rest.frames));
                let turned = rest.map_or_else(identity, |rest| product(&axes, &transpose(&rest)));
                let rotation = rotation_vector(&turned);
                let angle = dot(rotation, rotation).sqrt();
                let position = bodies.load_point(z, frames, body);
                BodyPose { position, angle, rotation: Some(rotation) }
            }
            _ => BodyPose::default(),
        }
    }

    /// Positions, m, of all nodes of one rod in the world, from its unknowns `own`. With `are_positions` false `own`
    /// are changes of the unknowns, and the result is in world axes without the origin of the plane. In space angles of
    /// edges are dropped.
    pub(super) fn node_vectors(&self, own: &[f64], are_positions: bool) -> Vec<[f64; 3]> {
        match &self.blueprint.models {
            RodModels::Plane { plane, .. } => {
                let nodes = own.as_chunks::<2>().0.iter();
                nodes
                    .map(|x| match are_positions {
                        true => plane.to_world(*x),
                        false => plane.direction_to_world(*x),
                    })
                    .collect()
            }
            RodModels::Space(_) => own.chunks(4).map(|x| [x[0], x[1], x[2]]).collect(),
        }
    }

    /// Displacements of all nodes in world axes, by the name of the rod, for a small `change` of the unknowns at a
    /// `state`, in the unit of the change. Those of carried nodes follow from the bodies; those of fixed nodes are
    /// zero.
    pub(super) fn displacements(
        &self,
        state: &EquilibriumState<AssemblyFrames<f64>>,
        change: &[f64],
    ) -> BTreeMap<String, Vec<[f64; 3]>> {
        let mut change = change.to_vec();
        let assembly = &self.at_rest.assembly;
        // To first order the change of a carried node is a velocity of its body.
        assembly.set_carried_rates(&state.q, &state.frames, &mut change);
        let ranges = assembly.rod_ranges().into_iter().zip(&self.scene.rods);
        ranges
            .map(|(range, rod)| (rod.name.clone(), self.node_vectors(&change[range], false)))
            .collect()
    }

    /// Position of the end of rod `k`, m, from the positions of its `nodes`, m: the wall or joint if it is between two
    /// nodes, as a weighted sum of nodes, else the last node.
    fn tip(&self, k: usize, nodes: &[[f64; 3]]) -> [f64; 3] {
        let mesh = &self.at_rest.meshes[k];
        match crate::scene::Point::Tip.stencil(mesh) {
            Ok(stencil) => stencil.place(|i| nodes[i]),
            Err(_) => nodes[nodes.len() - 1],
        }
    }
}

impl StructureShape {
    /// Writes a row of CSV, without header, for each node of each rod: `time,rod,node,x,y,z` with the `time`, s, name,
    /// node index from 0 and position, m. Rods are in the order of their names.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn write_rows(&self, time: f64, to: &mut impl Write) -> io::Result<()> {
        for (name, rod) in &self.rods {
            for (i, [x, y, z]) in rod.nodes.iter().enumerate() {
                writeln!(to, "{time},{name},{i},{x},{y},{z}")?;
            }
        }
        Ok(())
    }

    /// All nodes as CSV with the header `rod,node,x,y,z`: name, node index from 0 and position, m. Rods are in the
    /// order of their names.
    pub fn to_csv(&self) -> String {
        let mut text = String::from("rod,node,x,y,z\n");
        for (name, rod) in &self.rods {
            for (i, [x, y, z]) in rod.nodes.iter().enumerate() {
                text += &format!("{name},{i},{x},{y},{z}\n");
            }
        }
        text
    }
}
