//! Positions of the rods and bodies of a structure.

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
    /// Rotation from rest about the normal of the plane, rad.
    pub angle: f64,
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
    /// Positions at the unknowns `q`.
    pub fn shape(&self, q: &[f64]) -> StructureShape {
        let mut q = q.to_vec();
        let assembly = &self.at_rest.assembly;
        assembly.place_carried(&mut q);
        let mut shape = StructureShape::default();
        for (k, member) in assembly.members().iter().enumerate() {
            let own = &q[member.range.clone()];
            let nodes: Vec<[f64; 3]> =
                own.as_chunks::<2>().0.iter().map(|x| self.blueprint.plane.to_world(*x)).collect();
            let tip = self.tip(k, &nodes);
            shape.rods.insert(self.scene.rods[k].name.clone(), RodNodes { tip, nodes });
        }
        let z = &q[assembly.body_coordinates()];
        for (plan, body) in self.blueprint.plan.bodies.iter().zip(&assembly.bodies().bodies) {
            let Some(own) = plan.own else { continue };
            let x = assembly.bodies().load_point(z, body);
            let angle = body.rotation.map_or(0.0, |turn| z[turn.coordinate] / turn.length);
            let pose = BodyPose { position: self.blueprint.plane.to_world(x), angle };
            shape.bodies.insert(self.scene.bodies[own].name.clone(), pose);
        }
        shape
    }

    /// Displacements along a change of the unknowns at `q`.
    pub(super) fn displacements(
        &self,
        q: &[f64],
        change: &[f64],
    ) -> BTreeMap<String, Vec<[f64; 3]>> {
        let mut change = change.to_vec();
        let assembly = &self.at_rest.assembly;
        assembly.set_carried_rates(q, &mut change);
        let members = assembly.members().iter().zip(&self.scene.rods);
        members
            .map(|(member, rod)| {
                let own = change[member.range.clone()].as_chunks::<2>().0;
                let plane = &self.blueprint.plane;
                (rod.name.clone(), own.iter().map(|x| plane.direction_to_world(*x)).collect())
            })
            .collect()
    }

    /// The end of rod `k` with these nodes.
    fn tip(&self, k: usize, nodes: &[[f64; 3]]) -> [f64; 3] {
        let mesh = &self.at_rest.meshes[k];
        match crate::scene::Point::Tip.stencil(mesh) {
            Ok(stencil) => stencil.place(|i| nodes[i]),
            Err(_) => nodes[nodes.len() - 1],
        }
    }
}

impl StructureShape {
    /// Writes all nodes as rows of CSV at a time, s: `time,rod,node,x,y,z`.
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

    /// All nodes as CSV: `rod,node,x,y,z`.
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
