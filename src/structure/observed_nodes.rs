//! Points of a structure as weighted sums of its nodes, and the motion of these nodes.
//!
//! Nodes are numbered over all rods, one rod after the other. In a plane four further nodes follow for each body of
//! `[[bodies]]`: its center of mass `c` without the carried masses, and the points `c + R e` at one meter from it. Here
//! `e` are the three world axes and `R` is the rotation from rest. A point at the offset `o` is `c + R o`, with the
//! weights `1 - sum o` and `o`. In space bodies have no nodes, and a point of a body is an error, as are unknown names
//! and points off the rod.
//!
//! [`StructureNodes::stencil`] returns nodes and weights of a point, `around` the nodes on which it depends for
//! slightly different lengths too. [`Structure::node_motions`] returns position, m, and velocity, m/s, of every node in
//! world axes, in the order of their numbers. Nodes that bodies carry are placed by these.

use crate::error::{Error, ensure};
use crate::numerics::scalar::{RodScalar, Scalar};
use crate::numerics::vector::{add, cross, scale};
use crate::rod::Assembly;
use crate::rod::assembly::AssemblyFrames;
use crate::scene::mesh::Mesh;
use crate::scene::number::Quantity;
use crate::scene::structure_point::{PointOfBody, PointOfRod, StructurePoint};
use crate::scene::{Plane, Stencil, StructureScene};
use crate::structure::blueprint::RodModels;
use crate::structure::definition::Structure;
use nalgebra::Vector3;

/// Number of nodes of a body.
const NODES_OF_BODY: usize = 4;

/// Position, m, and velocity, m/s, in world axes.
pub type NodeMotion<D> = [[D; 3]; 2];

/// Meshes of all rods and names of all bodies of a structure, which give the stencil of a point.
#[derive(Clone, Debug)]
pub struct StructureNodes<'a, D = f64> {
    scene: &'a StructureScene,
    meshes: Vec<Mesh<D>>,
    is_spatial: bool,
}

impl<D: Scalar> StructureNodes<'_, D> {
    /// Nodes and weights whose weighted sum is a point. `key` is that of the point, for messages.
    ///
    /// # Errors
    /// [`Error::Invalid`] for names that the structure does not have, points that are not on the rod, and in space
    /// points of bodies.
    pub fn stencil(&self, point: &StructurePoint, key: &str) -> Result<Stencil<D>, Error> {
        match point {
            StructurePoint::Rod(PointOfRod { rod, at }) => {
                let rod = self.scene.rod(&format!("{key}.rod"), rod)?;
                let first = self.first_node(rod);
                let stencil = at.point().fixed().stencil(&self.meshes[rod]).map_err(|error| {
                    let place = format!("of the rod {}", self.scene.rods[rod].name);
                    error.at_key(format!("{key}.at"), &place)
                })?;
                let nodes = stencil.nodes.into_iter().map(|(i, weight)| (first + i, weight));
                Ok(Stencil { nodes: nodes.collect() })
            }
            StructurePoint::Body(PointOfBody { body, offset }) => {
                let allowed = "a point of a rod, in a structure in space";
                ensure(!self.is_spatial, format!("{key}.body"), body, allowed)?;
                let body = self.scene.body(&format!("{key}.body"), body)?;
                let first = self.rod_nodes() + NODES_OF_BODY * body;
                // `c + R o = (1 - sum o) c + sum o_k (c + R e_k)`: linear in the four nodes of the
                // body.
                let center = (first, D::from(1.0 - offset.iter().sum::<f64>()));
                let ends = (1..NODES_OF_BODY).map(|c| (first + c, D::from(offset[c - 1])));
                Ok(Stencil { nodes: std::iter::once(center).chain(ends).collect() })
            }
        }
    }

    /// Indices of the nodes on which a point of a rod depends, for these lengths of rods and slightly different ones;
    /// some may be listed twice. Those of a point of a body are its four nodes.
    ///
    /// # Errors
    /// As [`stencil`](Self::stencil).
    pub fn around(&self, point: &StructurePoint, key: &str) -> Result<Vec<usize>, Error> {
        let own = self.stencil(point, key)?.nodes.into_iter().map(|(node, _)| node);
        let StructurePoint::Rod(PointOfRod { rod, at }) = point else { return Ok(own.collect()) };
        let rod = self.scene.rod(&format!("{key}.rod"), rod)?;
        let first = self.first_node(rod);
        let around = at.point().fixed().nodes_around(&self.meshes[rod])?;
        Ok(own.chain(around.map(|node| first + node)).collect())
    }

    /// Number of nodes of the rods before the one with the index `rod`, which is the index of its first node.
    fn first_node(&self, rod: usize) -> usize {
        self.meshes[..rod].iter().map(|mesh| mesh.nodes.len()).sum()
    }

    /// Number of nodes of all rods.
    pub fn rod_nodes(&self) -> usize {
        self.first_node(self.meshes.len())
    }

    /// Number of nodes of [`Structure::node_motions`]: those of all rods, and in a plane four for each body.
    pub fn count(&self) -> usize {
        let bodies = if self.is_spatial { 0 } else { self.scene.bodies.len() };
        self.rod_nodes() + NODES_OF_BODY * bodies
    }
}

impl Structure {
    /// The meshes at rest and the names of rods and bodies of this structure, from which nodes and weights of points
    /// follow.
    pub fn nodes(&self) -> StructureNodes<'_> {
        let (meshes, is_spatial) = (self.at_rest.meshes.clone(), self.is_spatial());
        StructureNodes { scene: &self.scene, meshes, is_spatial }
    }

    /// As [`nodes`](Self::nodes), over another number type; `seed` returns the number of a path, value and quantity of
    /// the scene.
    ///
    /// # Errors
    /// As [`at_rest_over`](Self::at_rest_over).
    pub fn nodes_over<D: RodScalar>(
        &self,
        seed: impl FnMut(&str, f64, Quantity) -> D,
    ) -> Result<StructureNodes<'_, D>, Error> {
        let meshes = self.at_rest_over(seed)?.meshes;
        Ok(StructureNodes { scene: &self.scene, meshes, is_spatial: self.is_spatial() })
    }

    /// Positions, m, and velocities, m/s, of all nodes of an assembly of this structure in world axes, from its
    /// unknowns `q`, m (rad for angles), their rates `v`, 1/s of these, and its frames. In a plane those of bodies
    /// follow those of rods; in space bodies have no nodes.
    pub fn node_motions<D: RodScalar>(
        &self,
        assembly: &Assembly<D>,
        [q, v]: [&[D]; 2],
        frames: &AssemblyFrames<D>,
    ) -> Vec<NodeMotion<D>> {
        // Entries of carried nodes have no meaning in unknowns and rates: bodies give their motion.
        let (mut placed, mut rates) = (q.to_vec(), v.to_vec());
        assembly.place_carried(&mut placed, frames);
        assembly.set_carried_rates(&placed, frames, &mut rates);
        let first = assembly.body_coordinates().start;
        let (rods, plane) = match (assembly, &self.blueprint.models) {
            (Assembly::Plane(rods), RodModels::Plane { plane, .. }) => (rods, plane),
            _ => {
                let place = |x: &[D], i: usize| [x[i], x[i + 1], x[i + 2]];
                let nodes = (0..first).step_by(4);
                return nodes.map(|i| [place(&placed, i), place(&rates, i)]).collect();
            }
        };
        let pair = |x: &[D], i: usize| [x[i], x[i + 1]];
        let nodes = (0..first)
            .step_by(2)
            .map(|i| [plane.to_world(pair(&placed, i)), plane.direction_to_world(pair(&rates, i))]);
        let mut motions: Vec<NodeMotion<D>> = nodes.collect();
        let z = &placed[first..];
        let normal = plane.x.cross(&plane.y);
        // Bodies of the scene are the first ones of the assembly, in their order.
        for (plan, body) in self.blueprint.plan.bodies.iter().zip(&rods.bodies().bodies) {
            if plan.own.is_none() {
                continue;
            }
            let [angle, rate] = match &body.rotation {
                Some(turn) => {
                    let coordinate = first + turn.coordinate;
                    [placed[coordinate], rates[coordinate]].map(|x| x * turn.length.recip())
                }
                None => [D::from(0.0); 2],
            };
            // The body's own center of mass: its coordinates are those of the center with the
            // carried nodes.
            let center = plane.to_world(rods.bodies().load_point(z, body));
            let arm = axes_rotated(plane, [body.load_arm[0], body.load_arm[1]], angle);
            let spin = [0, 1, 2].map(|c| rate * normal[c]);
            let base = plane.direction_to_world(pair(&rates, first + body.coordinate));
            // Rigid motion about the center with the carried nodes.
            let velocity = add(base, cross(spin, arm));
            motions.push([center, velocity]);
            for axis in 0..3 {
                let turned = rotated_axis(&normal, axis, angle);
                motions.push([add(center, turned), add(velocity, cross(spin, turned))]);
            }
        }
        motions
    }

    /// Whether the structure is computed in space, not in its plane.
    pub fn is_spatial(&self) -> bool {
        self.at_rest.assembly.is_spatial()
    }

    /// Unit vectors of the x and y axes of the plane of the structure, in world axes; none in space.
    pub(crate) fn plane_axes(&self) -> Option<[[f64; 3]; 2]> {
        match &self.blueprint.models {
            RodModels::Plane { plane, .. } => Some([plane.x, plane.y].map(Into::into)),
            RodModels::Space(_) => None,
        }
    }
}

/// The vector with the components `x` and `y`, m, in the axes of the plane after a rotation by `angle`, rad, in world
/// axes.
fn axes_rotated<D: Scalar>(plane: &Plane, [x, y]: [D; 2], angle: D) -> [D; 3] {
    let (cosine, sine) = (angle.cos(), angle.sin());
    plane.direction_to_world([cosine * x - sine * y, sine * x + cosine * y])
}

/// The unit vector along the world axis with the index `axis` after a rotation by `angle`, rad, about the unit vector
/// `normal`, in world axes (Rodrigues).
fn rotated_axis<D: Scalar>(normal: &Vector3<f64>, axis: usize, angle: D) -> [D; 3] {
    let unit = Vector3::ith(axis, 1.0);
    let along = normal * normal.dot(&unit);
    let (across, ahead) = (unit - along, normal.cross(&unit));
    let (cosine, sine) = (angle.cos(), angle.sin());
    let turned = add(
        scale([0, 1, 2].map(|c| D::from(across[c])), cosine),
        scale([0, 1, 2].map(|c| D::from(ahead[c])), sine),
    );
    [0, 1, 2].map(|c| turned[c] + along[c])
}
