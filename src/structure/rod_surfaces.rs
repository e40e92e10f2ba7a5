//! Contacts of the rods of a structure with each other: from the scene to the laws of the assembly.
//!
//! [`RodSurfaces::new`] evaluates stiffness, losses, radii and lengths of all edges of the rods, over any number type.
//! Without a stiffness in the scene a contact has the largest of those that the rods would have in contact with an
//! obstacle. [`RodSurfaces::laws`] adds the unknowns of the edges, their fixed nodes, and the bodies that carry the
//! ends of their rods. Edges with a node that a body carries are left out.
//!
//! [`RodOverlapRecord`] holds the largest overlap of all states that `add` receives. `check` rejects any overlap, for
//! the start. `warning` is that of an overlap above [`LARGEST_PENETRATION`] of the radius.

use crate::code::Code;
use crate::error::Error;
use crate::numerics::scalar::{RodScalar, Scalar};
use crate::problem::{LARGEST_PENETRATION, default_contact_stiffness};
use crate::rod::assembly::contact_pairs::DeepestOverlap;
use crate::rod::assembly::{
    AssemblyLayout, ContactLaw, ContactPairs, JointDistance, Member, TouchingEdge,
};
use crate::scene::contact::ContactLoss;
use crate::scene::mesh::Mesh;
use crate::scene::structure::StructureScene;
use crate::scene::{Scene, rod_contact::RodContactLaw};

/// Overlap at the start, over the radius of the rod, that is a rounding error.
const ROUNDING: f64 = 1e-6;

/// Numbers of an edge in a contact.
struct EdgeSurface<D> {
    /// Arc lengths of its nodes, m.
    arc: [f64; 2],
    /// Rest length, m.
    length: D,
    /// Radius of the rod, m.
    radius: D,
}

/// Numbers of the contacts of all rods with each other.
pub(super) struct RodSurfaces<D> {
    contacts: Vec<ContactSurfaces<D>>,
}

/// Numbers of one contact.
struct ContactSurfaces<D> {
    /// Its stiffness, N/m^3.
    stiffness: D,
    /// The numbers of the forces that depend on the velocity; none without any.
    loss: Option<ContactLoss<D>>,
    /// The edges of each rod; none of rods without it.
    rods: Vec<Vec<EdgeSurface<D>>>,
}

impl<D: RodScalar> RodSurfaces<D> {
    /// The numbers of all contacts of a structure, whose rods have these scenes and meshes.
    pub fn new(structure: &StructureScene<D>, scenes: &[Scene<D>], meshes: &[Mesh<D>]) -> Self {
        let of_contact = |contact: &RodContactLaw<D>| {
            let rods = || scenes.iter().zip(meshes).zip(&structure.rods);
            let touches = |name: &str| contact.applies_to(name);
            let own = rods()
                .map(|((scene, mesh), rod)| match touches(&rod.name) {
                    true => edge_surfaces(contact, scene, mesh),
                    false => Vec::new(),
                })
                .collect();
            let defaults =
                rods().filter(|(_, rod)| touches(&rod.name)).map(|((scene, mesh), _)| {
                    let radius = radius(contact, scene, 0.5);
                    default_contact_stiffness(scene, radius, mesh.length)
                });
            let stiffness = contact.stiffness.or_else(|| defaults.reduce(Scalar::max));
            let stiffness = stiffness.unwrap_or(D::from(1.0));
            ContactSurfaces { stiffness, loss: contact.loss(), rods: own }
        };
        Self { contacts: structure.rod_contacts.iter().map(of_contact).collect() }
    }

    /// The laws of these contacts for the rods of an assembly.
    pub fn laws<L: AssemblyLayout>(self, members: &[Member<D, L>]) -> Vec<ContactLaw<D>> {
        let law = |(index, surfaces): (usize, ContactSurfaces<D>)| {
            let ContactSurfaces { stiffness, loss, rods } = surfaces;
            let parts = rods.into_iter().zip(members).enumerate();
            let edges = parts.flat_map(|(rod, (edges, member))| touching_edges(rod, edges, member));
            ContactLaw { index, stiffness, loss, edges: edges.collect() }
        };
        self.contacts.into_iter().enumerate().map(law).collect()
    }
}

/// Radius of a rod in a contact, m, at the fraction `x` of its length.
fn radius<D: RodScalar>(contact: &RodContactLaw<D>, scene: &Scene<D>, x: f64) -> D {
    contact.radius_of(&scene.at(x).0).expect("a contact of rods has a radius of each rod")
}

/// Numbers of the edges of a rod in a contact.
fn edge_surfaces<D: RodScalar>(
    contact: &RodContactLaw<D>,
    scene: &Scene<D>,
    mesh: &Mesh<D>,
) -> Vec<EdgeSurface<D>> {
    let edge = |pair: &[D]| {
        let arc = [pair[0].value(), pair[1].value()];
        let middle = 0.5 * (arc[0] + arc[1]) / mesh.length.value();
        let radius = radius(contact, scene, middle.clamp(0.0, 1.0));
        EdgeSurface { arc, length: pair[1] - pair[0], radius }
    };
    mesh.arc_length.windows(2).map(edge).collect()
}

/// The edges of a rod that may touch others, without those with a carried node.
fn touching_edges<D: RodScalar, L: AssemblyLayout>(
    rod: usize,
    edges: Vec<EdgeSurface<D>>,
    member: &Member<D, L>,
) -> Vec<TouchingEdge<D>> {
    let ends = [edges.first(), edges.last()].map(|edge| edge.map_or([0.0; 2], |edge| edge.arc));
    // The body that carries each end.
    let carrier = |node: usize| {
        let carries =
            member.attachments.iter().find(|own| own.nodes.iter().any(|n| n.node == node));
        carries.map(|attachment| attachment.body)
    };
    let bodies = [carrier(0), carrier(edges.len())];
    let is_carried = |node: usize| {
        member.attachments.iter().flat_map(|own| &own.nodes).any(|own| own.node == node)
    };
    let is_free = |node: usize| member.fixed.iter().all(|fixed| fixed.node != node);
    // A clamp at a wall also fixes the angle of the edge after its node.
    let width = L::STRIDE.min(3);
    let has_free_angle =
        |node: usize| member.fixed.iter().all(|fixed| fixed.node != node || fixed.width <= width);
    let touching =
        edges.into_iter().enumerate().filter(|(i, _)| !is_carried(*i) && !is_carried(i + 1));
    let edge = |(i, EdgeSurface { arc, length, radius }): (usize, EdgeSurface<D>)| TouchingEdge {
        rod,
        first: member.range.start + L::STRIDE * i,
        arc,
        length,
        radius,
        is_free: [is_free(i), is_free(i + 1)],
        has_free_angle: has_free_angle(i),
        joints: [
            bodies[0].map(|body| JointDistance { body, distance: arc[0] - ends[0][0] }),
            bodies[1].map(|body| JointDistance { body, distance: ends[1][1] - arc[1] }),
        ],
    };
    touching.map(edge).collect()
}

/// Largest overlap of the rods of a structure with each other over all states.
#[derive(Clone, Debug)]
pub(super) struct RodOverlapRecord {
    contacts: ContactPairs<f64>,
    /// Names of the rods.
    names: Vec<String>,
    largest: Option<DeepestOverlap>,
    /// Time of that state, s; none of an equilibrium.
    time: Option<f64>,
}

impl RodOverlapRecord {
    /// A record without a state, of rods with these names and contacts (`contacts_on_nodes`).
    pub fn new(contacts: ContactPairs<f64>, names: Vec<String>) -> Self {
        Self { contacts, names, largest: None, time: None }
    }

    /// Adds a state at a time, s; an equilibrium has no time. `nodes` returns the nodes of the rod of a name, m.
    pub fn add<'a>(&mut self, nodes: impl Fn(&str) -> &'a [[f64; 3]], time: Option<f64>) {
        if self.contacts.is_empty() || self.names.iter().any(|name| nodes(name).is_empty()) {
            return;
        }
        let q: Vec<f64> =
            self.names.iter().flat_map(|name| nodes(name)).flatten().copied().collect();
        if let Some(found) = self.contacts.deepest(&q)
            && self.largest.is_none_or(|before| found.relative > before.relative)
        {
            self.largest = Some(found);
            self.time = time;
        }
    }

    /// The overlap in words: how deep, over the radius, where.
    fn describe(&self, found: &DeepestOverlap, time: Option<f64>) -> String {
        let DeepestOverlap { overlap, relative, rods: [a, b], arc, .. } = *found;
        let moment = time.map_or(String::new(), |time| format!(", t = {time:.3e} s"));
        format!(
            "rods.{} overlaps rods.{} by {overlap:.3e} m, {:.0} % of the radius ({:.3e} m along the first and {:.3e} m \
             along the second{moment})",
            self.names[a],
            self.names[b],
            100.0 * relative,
            arc[0],
            arc[1]
        )
    }

    /// Rejects a structure whose rods overlap each other in the states so far by more than rounding errors.
    pub fn check(&self) -> Result<(), Error> {
        match &self.largest {
            Some(found) if found.relative > ROUNDING => {
                let found_text = format!("at the start {}", self.describe(found, None));
                let allowed = "rods that do not overlap at the start";
                Err(Error::invalid(format!("rod_contacts[{}]", found.law), found_text, allowed))
            }
            _ => Ok(()),
        }
    }

    /// Warning, with its code, of an overlap above [`LARGEST_PENETRATION`] of the radius; none for smaller ones.
    pub fn warning(&self) -> Option<(Code, String)> {
        let found = self.largest.as_ref()?;
        let law = found.law;
        let words = format!(
            "{}. Contact forces are not valid above {:.0} %. Give a larger rod_contacts[{law}].stiffness, N/m^3, and a \
             smaller time.step",
            self.describe(found, self.time),
            100.0 * LARGEST_PENETRATION
        );
        (found.relative > LARGEST_PENETRATION).then_some((Code::DeepContact, words))
    }
}
