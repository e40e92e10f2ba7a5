//! Overlaps of the shapes of a rod with the obstacles of its scene.
//!
//! [`Problem::check_contacts`], and [`check_start`] for other nodes, reject a scene whose initial shape, or else rest
//! shape, overlaps an obstacle by more than rounding errors. [`PenetrationRecord`] takes the states (`add`) of a motion
//! (positions of nodes, m, with the time, s) or of an equilibrium, and holds the largest overlap over the radius of the
//! rod. It has a warning with code, obstacle, overlap, place and time if that exceeds [`LARGEST_PENETRATION`].

use crate::code::Code;
use crate::energy::overlap::{ContactPart, EdgePart, largest_overlap};
use crate::error::Error;
use crate::numerics::vector::{Vector, add};
use crate::problem::contact::contact_parts;
use crate::problem::{Problem, with_model};
use crate::scene::Scene;
use crate::scene::contact::{Contact, Obstacle};
use crate::scene::mesh::Mesh;
use crate::scene::obstacle_motion::ObstaclePath;

/// Largest overlap of a motion without a warning, over the radius of the rod.
pub(crate) const LARGEST_PENETRATION: f64 = 0.1;
/// Largest overlap at the start, over the radius of the rod, that is a rounding error.
const ROUNDING: f64 = 1e-6;

/// Contacts of a scene, whose overlaps with shapes are computed.
#[derive(Clone, Debug, Default)]
struct Obstacles {
    list: Vec<PlacedObstacle>,
}

/// Obstacle with the parts of all edges that may touch it.
#[derive(Clone, Debug)]
struct PlacedObstacle {
    /// The obstacle at t = 0, in the world.
    obstacle: Obstacle<f64>,
    /// Its motion; none of a fixed one.
    path: Option<ObstaclePath<f64>>,
    parts: Vec<ContactPart<f64>>,
}

/// Axes of the world.
const WORLD: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

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
    /// The obstacles of a scene, each with the parts of all edges of a mesh that may touch it.
    fn new(scene: &Scene, mesh: &Mesh) -> Self {
        let contacts = scene.contacts.iter();
        let placed = |contact: &Contact| PlacedObstacle {
            obstacle: contact.obstacle(),
            path: ObstaclePath::new(contact.motions(), WORLD),
            parts: contact_parts(contact, scene, mesh),
        };
        Self { list: contacts.map(placed).collect() }
    }

    /// The largest overlap, over the radius of the rod, of a shape with nodes at `position(i)`, m, at a time, s, or at
    /// rest, with obstacles as at t = 0. `None` without contacts.
    fn largest(
        &self,
        position: impl Fn(usize) -> Vector<f64>,
        time: Option<f64>,
    ) -> Option<Penetration> {
        let mut largest: Option<Penetration> = None;
        for (contact, PlacedObstacle { obstacle, path, parts }) in self.list.iter().enumerate() {
            let mut obstacle = *obstacle;
            if let Some(path) = path {
                obstacle.point = add(obstacle.point, path.displacement(time.unwrap_or(0.0)));
            }
            for (edge, part) in parts.iter().enumerate() {
                let nodes = [position(edge), position(edge + 1)];
                let overlap = largest_overlap(EdgePart { obstacle: &obstacle, part }, nodes);
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
    /// Rejects an initial shape, or else a rest shape, that overlaps an obstacle by more than rounding errors
    /// ([`ROUNDING`] radii). `Ok` without contacts.
    pub(super) fn check_contacts(&self) -> Result<(), Error> {
        let scene = self.scene();
        if scene.contacts.is_empty() {
            return Ok(());
        }
        let nodes = with_model!(self, |discretized| discretized.start_positions());
        check_start(scene, |i| nodes[i], "the rod")
    }
}

/// Rejects nodes at `position(i)`, m, of the rod of a scene that overlap an obstacle by more than rounding errors.
/// `name` is that of the rod in the error.
pub(crate) fn check_start(
    scene: &Scene,
    position: impl Fn(usize) -> Vector<f64>,
    name: &str,
) -> Result<(), Error> {
    match Obstacles::new(scene, &scene.made_mesh()).largest(position, None) {
        Some(Penetration { contact, relative, overlap, place, .. }) if relative > ROUNDING => {
            let found = format!(
                "an overlap with {name} of {overlap:.3e} m at the start, {place:.3e} m along the rod"
            );
            let allowed = "an obstacle that the rod does not overlap at the start";
            Err(Error::invalid(format!("contacts[{contact}]"), found, allowed))
        }
        _ => Ok(()),
    }
}

/// Largest overlap of a motion with the obstacles of its scene.
#[derive(Clone, Debug, Default)]
pub(crate) struct PenetrationRecord {
    obstacles: Obstacles,
    largest: Option<Penetration>,
}

impl PenetrationRecord {
    /// A record of a motion of the rod of a scene before its first state; empty without contacts.
    pub fn new(scene: &Scene) -> Self {
        let obstacles = match scene.contacts.is_empty() {
            true => Obstacles { list: Vec::new() },
            false => Obstacles::new(scene, &scene.made_mesh()),
        };
        Self { obstacles, largest: None }
    }

    /// Adds a state with nodes at `position(i)`, m, at a time, s; none for an equilibrium. Its largest overlap is kept
    /// if it exceeds those before.
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
