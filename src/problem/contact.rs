//! Contacts of a scene on the mesh of a rod: their energies, and the default stiffness.
//!
//! [`rod_contacts`] returns the contacts of a scene: obstacle in the axes of the model at its place at a time (s), its
//! prescribed motion, stiffness (N/m^3), losses, and for each edge the part of it that may touch. The part of an edge
//! behind a wall cannot touch. The force per length is the stiffness times the square of the overlap. Without a
//! stiffness in the scene it is chosen so that this force is `w + E I/L^3` at an overlap of [`OVERLAP_AT_REST`] radii.
//! `w` is the weight of the rod per length, the other term the line load that bends it by about a tenth of its length
//! `L`. Section and material are those halfway along the rod, `I` the smaller second moment.

use crate::energy::adapter::Chart;
use crate::energy::overlap::ContactPart;
use crate::numerics::scalar::{RodScalar, Scalar};
use crate::numerics::vector::{Vector, cross, dot, map_components, sub};
use crate::rod::{MovedObstacle, RodContact, RodContacts};
use crate::scene::Scene;
use crate::scene::contact::{Contact, Obstacle};
use crate::scene::mesh::Mesh;
use crate::scene::obstacle_motion::ObstaclePath;

/// Overlap, over the radius of the rod, at which a contact of the default stiffness carries the weight of the rod.
const OVERLAP_AT_REST: f64 = 0.005;

/// For each edge of a mesh, in their order, the part of it that may be in a contact. A part has the arc length of the
/// middle of the edge and the length of the edge, m, the fractions of the edge between which it is outside of walls,
/// and the radius of the rod, m.
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

/// Stiffness of a contact, N/m^3: that of the scene. Without one it is `(rho A g + E I/length^3)/overlap^2` with an
/// overlap of [`OVERLAP_AT_REST`] radii and the smaller second moment `I`. Section and material are those halfway along
/// the rod; `length` is that of the rod, m.
fn contact_stiffness<D: Scalar>(contact: &Contact<D>, scene: &Scene<D>, length: D) -> D {
    if let Some(stiffness) = contact.given_stiffness() {
        return stiffness;
    }
    let radius = contact.rod_radius(&scene.at(0.5).0).expect("a contact has a radius of the rod");
    default_contact_stiffness(scene, radius, length)
}

/// Stiffness of a contact that gives none, N/m^3, for a radius of the rod, m ([`contact_stiffness`]).
pub(crate) fn default_contact_stiffness<D: Scalar>(scene: &Scene<D>, radius: D, length: D) -> D {
    let (section, material) = scene.at(0.5);
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

/// The axes of the model in the world; in the plane the third one is its normal.
fn model_axes<D: Scalar>(chart: &Chart<D>) -> [Vector<f64>; 3] {
    match chart {
        Chart::Plane { axes: [x, y], .. } => [*x, *y, cross(*x, *y)],
        Chart::Space { axes: Some(axes) } => *axes,
        Chart::Space { axes: None } => [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
    }
}

/// An obstacle of the world in the axes of the model: its point relative to the origin of the model, and its axis.
/// Kind, radius and length stay.
fn in_model<D: Scalar>(chart: &Chart<D>, obstacle: &Obstacle<D>) -> Obstacle<D> {
    let origin = match chart {
        Chart::Plane { origin, .. } => *origin,
        Chart::Space { axes: Some(_) } => [0.0; 3],
        Chart::Space { axes: None } => return *obstacle,
    };
    let axes = model_axes(chart);
    let along = |v: Vector<D>| axes.map(|axis| dot(map_components(&axis, D::from), v));
    let point = along(sub(obstacle.point, map_components(&origin, D::from)));
    Obstacle { point, axis: along(obstacle.axis), ..*obstacle }
}

/// All contacts of a scene on its mesh, in their order: obstacle in the axes of the model at its place at a time, s,
/// its motion, stiffness, loss, and parts of all edges.
pub(crate) fn rod_contacts<D: RodScalar>(
    chart: &Chart<D>,
    scene: &Scene<D>,
    mesh: &Mesh<D>,
    time: f64,
) -> RodContacts<D> {
    let list = scene.contacts.iter().map(|contact| {
        let obstacle = in_model(chart, &contact.obstacle());
        let still = [D::from(0.0); 3];
        let moved =
            |path| MovedObstacle { start: obstacle.point, path, velocity: still, movement: still };
        RodContact {
            obstacle,
            moved: ObstaclePath::new(contact.motions(), model_axes(chart)).map(moved),
            stiffness: contact_stiffness(contact, scene, mesh.length),
            loss: contact.loss(),
            parts: contact_parts(contact, scene, mesh),
        }
    });
    let mut contacts = RodContacts { list: list.collect() };
    contacts.move_obstacles([time; 2]);
    contacts
}
