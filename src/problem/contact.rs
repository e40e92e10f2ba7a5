//! Contacts of a scene on the mesh of a rod: their energies, the default stiffness, and overlaps of shapes.
//!
//! [`contact_energies`] returns an energy over all edges for each contact. The part of an edge behind a wall has none. Without
//! a stiffness in the scene the force per length is `w + E I/L^3` at an overlap of [`OVERLAP_AT_REST`] radii: the weight of
//! the rod per length, and the line load that bends it by about a tenth of its length. [`Problem::check_contacts`] rejects a
//! start that overlaps an obstacle. [`PenetrationRecord`] holds the largest overlap of a motion, and its warning above
//! [`LARGEST_PENETRATION`].

use crate::code::Code;
use crate::energy::adapter::Chart;
use crate::energy::edge_contact::{EdgeContact, contact_values};
use crate::energy::overlap::{ContactPart, largest_overlap};
use crate::energy::place::Spot;
use crate::error::Error;
use crate::numerics::scalar::{Nestable, Scalar};
use crate::numerics::vector::{Vector, dot};
use crate::problem::{Problem, with_model};
use crate::rod::Placed;
use crate::scene::Scene;
use crate::scene::contact::{Contact, Obstacle};
use crate::scene::mesh::Mesh;
use std::sync::Arc;

/// Overlap, over the radius of the rod, at which a contact of the default stiffness carries the weight of the rod.
const OVERLAP_AT_REST: f64 = 0.005;
/// Largest overlap of a motion without a warning, over the radius of the rod.
const LARGEST_PENETRATION: f64 = 0.1;
/// Largest overlap at the start, over the radius of the rod, that is a rounding error.
const ROUNDING: f64 = 1e-6;

/// The parts of all edges of a mesh that may be in a contact, in the order of the edges.
fn contact_parts<D: Scalar>(
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

/// Contacts of a scene, whose overlaps with shapes are computed.
#[derive(Clone, Debug, Default)]
struct Obstacles {
    /// Each obstacle with the parts of all edges.
    list: Vec<(Obstacle<f64>, Vec<ContactPart<f64>>)>,
}

/// Largest overlap of a shape with the obstacles of a scene.
#[derive(Clone, Copy, Debug)]
struct Penetration {
    /// Index of the contact.
    contact: usize,
    /// Overlap over the radius of the rod; negative without contact.
    relative: f64,
    /// Overlap, m.
    overlap: f64,
    /// Arc length of the middle of the edge, m.
    place: f64,
    /// Time, s; none of an equilibrium.
    time: Option<f64>,
}

impl Obstacles {
    /// The obstacles of a scene on a mesh.
    fn new(scene: &Scene, mesh: &Mesh) -> Self {
        let contacts = scene.contacts.iter();
        let list = contacts.map(|c| (c.obstacle(), contact_parts(c, scene, mesh))).collect();
        Self { list }
    }

    /// The largest overlap, over the radius of the rod, of a shape with nodes at `position(i)`, m, at a time, s, or at rest.
    /// `None` without contacts.
    fn largest(
        &self,
        position: impl Fn(usize) -> Vector<f64>,
        time: Option<f64>,
    ) -> Option<Penetration> {
        let mut largest: Option<Penetration> = None;
        for (contact, (obstacle, parts)) in self.list.iter().enumerate() {
            for (edge, part) in parts.iter().enumerate() {
                let nodes = [position(edge), position(edge + 1)];
                let overlap = largest_overlap(obstacle, part, nodes);
                let relative = overlap / part.radius;
                if largest.is_none_or(|found| relative > found.relative) {
                    let place = part.arc_length;
                    largest = Some(Penetration { contact, relative, overlap, place, time });
                }
            }
        }
        largest
    }
}

impl Problem {
    /// Rejects an initial shape, or else a rest shape, that overlaps an obstacle. `Ok` without contacts.
    pub(super) fn check_contacts(&self) -> Result<(), Error> {
        let scene = self.scene();
        if scene.contacts.is_empty() {
            return Ok(());
        }
        let nodes = with_model!(self, |discretized| discretized.start_positions());
        match Obstacles::new(scene, &scene.made_mesh()).largest(|i| nodes[i], None) {
            Some(Penetration { contact, relative, overlap, place, .. }) if relative > ROUNDING => {
                let found = format!(
                    "an overlap with the rod of {overlap:.3e} m at the start, {place:.3e} m along the rod"
                );
                let allowed = "an obstacle that the rod does not overlap at the start";
                Err(Error::invalid(format!("contacts[{contact}]"), found, allowed))
            }
            _ => Ok(()),
        }
    }
}

/// Largest overlap of a motion with the obstacles of its scene.
#[derive(Clone, Debug, Default)]
pub(crate) struct PenetrationRecord {
    obstacles: Obstacles,
    largest: Option<Penetration>,
}

impl PenetrationRecord {
    /// A record of a motion of the problem before its first state; empty without contacts.
    pub fn new(problem: &Problem) -> Self {
        let scene = problem.scene();
        let obstacles = match scene.contacts.is_empty() {
            true => Obstacles { list: Vec::new() },
            false => Obstacles::new(scene, &scene.made_mesh()),
        };
        Self { obstacles, largest: None }
    }

    /// Adds a state with nodes at `position(i)`, m, at a time, s.
    pub fn add(&mut self, position: impl Fn(usize) -> Vector<f64>, time: Option<f64>) {
        if let Some(found) = self.obstacles.largest(position, time)
            && self.largest.is_none_or(|before| found.relative > before.relative)
        {
            self.largest = Some(found);
        }
    }

    /// Warning, with its code, of an overlap above [`LARGEST_PENETRATION`]; none for smaller ones.
    pub fn warning(&self) -> Option<(Code, String)> {
        let Penetration { contact, relative, overlap, place, time } = self.largest?;
        let moment = time.map_or(String::new(), |time| format!(", t = {time:.3e} s"));
        let message = format!(
            "the rod overlaps the obstacle contacts[{contact}] by {overlap:.3e} m, {:.0} % of its radius ({place:.3e} m \
             along the rod{moment}). Contact forces are not valid above {:.0} %. Give a larger \
             contacts[{contact}].stiffness, N/m^3, and a smaller time.step",
            100.0 * relative,
            100.0 * LARGEST_PENETRATION
        );
        (relative > LARGEST_PENETRATION).then_some((Code::DeepContact, message))
    }
}

/// All records are equal, so that they do not distinguish results.
impl PartialEq for PenetrationRecord {
    /// True for any two records.
    fn eq(&self, _: &Self) -> bool {
        true
    }
}
