//! Contacts of a scene on the mesh of a rod: their energies, and the default stiffness.
//!
//! [`contact_energies`] returns an energy over all edges for each contact. The part of an edge behind a wall has none. Without
//! a stiffness in the scene the force per length is `w + E I/L^3` at an overlap of [`OVERLAP_AT_REST`] radii: the weight of
//! the rod per length, and the line load that bends it by about a tenth of its length.

use crate::energy::adapter::Chart;
use crate::energy::edge_contact::{EdgeContact, contact_values};
use crate::energy::overlap::ContactPart;
use crate::energy::place::Spot;
use crate::numerics::scalar::{Nestable, Scalar};
use crate::numerics::vector::dot;
use crate::rod::Placed;
use crate::scene::Scene;
use crate::scene::contact::Contact;
use crate::scene::mesh::Mesh;
use std::sync::Arc;

/// Overlap, over the radius of the rod, at which a contact of the default stiffness carries the weight of the rod.
const OVERLAP_AT_REST: f64 = 0.005;

/// The parts of all edges of a mesh that may be in a contact, in the order of the edges.
pub(super) fn contact_parts<D: Scalar>(
    contact: &Contact<D>,
    scene: &Scene<D>,
    mesh: &Mesh<D>,
) -> Vec<ContactPart<D>> {
    let ends = [0.0, mesh.length.value()];
    let part = |pair: &[D]| {
        let (length, middle) = (pair[1] - pair[0], (pair[0] + pair[1]) * 0.5);
        let bounds = ends.map(|end| ((end - pair[0].value()) / length.value()).clamp(0.0, 1.0));
        let (section, _) = scene.at((middle.value() / ends[1]).clamp(0.0, 1.0));
        let radius = contact.rod_radius(&section).expect("a contact has a radius of the rod");
        ContactPart { arc_length: middle, length, bounds, radius }
    };
    mesh.arc_length.windows(2).map(part).collect()
}

/// Stiffness of a contact, N/m^3: that of the scene, or the default.
fn contact_stiffness<D: Scalar>(contact: &Contact<D>, scene: &Scene<D>, length: D) -> D {
    if let Some(stiffness) = contact.given_stiffness() {
        return stiffness;
    }
    let (section, material) = scene.at(0.5);
    let radius = contact.rod_radius(&section).expect("a contact has a radius of the rod");
    let properties = section.moments();
    let [i1, i2] = properties.second_moments;
    let bending = material.youngs_modulus * i1.min(i2) / (length * length * length);
    let gravity = scene.loads.gravity;
    // The length of a zero vector has no derivative.
    let acceleration = match gravity.iter().all(|g| g.value() == 0.0) {
        true => D::from(0.0),
        false => dot(gravity, gravity).sqrt(),
    };
    let overlap = radius * OVERLAP_AT_REST;
    (material.density * properties.area * acceleration + bending) / (overlap * overlap)
}

/// The energies of all contacts of a scene on its mesh.
pub(crate) fn contact_energies<D: Nestable>(
    chart: &Chart<D>,
    scene: &Scene<D>,
    mesh: &Mesh<D>,
) -> Vec<Placed<D>> {
    let placed = |(i, contact): (usize, &Contact<D>)| {
        let obstacle = contact.obstacle();
        let parts = contact_parts(contact, scene, mesh).into_iter().enumerate();
        let spot = |(first, part): (usize, ContactPart<D>)| Spot {
            first,
            weight: None,
            numbers: part.numbers(),
        };
        Placed {
            name: format!("contacts[{i}]").into(),
            energy: Arc::new(EdgeContact(obstacle.kind)),
            chart: chart.clone(),
            values: contact_values(contact_stiffness(contact, scene, mesh.length), &obstacle),
            spots: parts.map(spot).collect(),
        }
    };
    scene.contacts.iter().enumerate().map(placed).collect()
}
