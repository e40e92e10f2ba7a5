//! Validation of measured points and rods in scenes of structures, and the position of a point at rest.
//!
//! Input: a problem, the point or the rod's name of a measurement, and its key for messages. [`check_place`] and
//! [`check_rod`] return whether the scene is a structure. Errors are a point or rod of a structure in a scene of one
//! rod, and a measurement of a structure without one. So are points and rods that the structure does not have, and an
//! offset beside a rod in a structure. [`rest_position`] returns the position at rest, m: in a structure that of its
//! point (`place`), else that of the point of the rod.

use crate::error::{Error, ensure};
use crate::fit::structure::structure_problem::structure_of;
use crate::problem::Problem;
use crate::scene::marker::is_beside;
use crate::scene::{Point, StructurePoint};

/// Rejects a `place` (point of a structure) in a scene of one rod, a measurement without one in a structure, and places
/// that the structure does not have. Returns whether the scene is a structure. `key` is that of the measurement; an
/// `offset`, m, of a marker beside a rod is rejected in a structure.
pub(crate) fn check_place(
    problem: &Problem,
    place: Option<&StructurePoint>,
    offset: [f64; 3],
    key: &str,
) -> Result<bool, Error> {
    let point = format!("{key}.point");
    let Some(structure) = structure_of(problem)? else {
        let allowed =
            "\"tip\", the index of a node or { arc_length = .. }, as the scene has one rod";
        let found = "a point of a structure";
        return ensure(place.is_none(), point, found, allowed).map(|()| false);
    };
    // A point of one rod is ambiguous in a structure: the message lists the names of the rods.
    let Some(place) = place else {
        let names: Vec<&str> = structure.scene().rods.iter().map(|rod| &rod.name[..]).collect();
        let allowed = format!(
            "{{ rod = \"..\", at = \"tip\" }} or {{ body = \"..\" }} in a structure, with a rod among {}",
            names.join(", ")
        );
        return Err(Error::invalid(point, "a point without a rod or body", allowed));
    };
    let allowed = "no such key in a structure; the offset of a point of a body is in its point";
    ensure(!is_beside(offset), format!("{key}.offset"), format!("{offset:?}"), allowed)?;
    structure.nodes().stencil(place, &point).map(|_| true)
}

/// Rejects a rod's name in a scene of one rod, and in a structure a missing name or one that it does not have. Returns
/// whether the scene is a structure. `key` is that of the measurement.
pub(crate) fn check_rod(problem: &Problem, rod: Option<&str>, key: &str) -> Result<bool, Error> {
    let key = format!("{key}.rod");
    match (&problem.scene().structure, rod) {
        (None, None) => Ok(false),
        (None, Some(name)) => {
            Err(Error::invalid(key, name, "no such key, as the scene has one rod"))
        }
        (Some(structure), Some(name)) => structure.rod(&key, name).map(|_| true),
        (Some(structure), None) => {
            let names: Vec<&str> = structure.rods.iter().map(|rod| &rod.name[..]).collect();
            Err(Error::invalid(key, "no such key", format!("one of {}", names.join(", "))))
        }
    }
}

/// Position of a point at rest, m, in the world: of a structure that of its `place`, of one rod that of `point`.
///
/// # Errors
/// A point that is not on the rod, a place that the structure does not have, and a structure that is not valid.
pub(crate) fn rest_position(
    problem: &Problem,
    point: Point,
    place: Option<&StructurePoint>,
) -> Result<[f64; 3], Error> {
    match (place, structure_of(problem)?) {
        (Some(place), Some(structure)) => {
            let stencil = structure.nodes().stencil(place, "point")?;
            let rest = structure.at_rest();
            // Only positions are needed: the velocities at rest are zero.
            let zero = vec![0.0; rest.q.len()];
            let motions = structure.node_motions(&rest.assembly, [&rest.q, &zero], &rest.frames);
            Ok(stencil.place(|node| motions[node][0]))
        }
        _ => Ok(problem.rest_position(&problem.stencil(point)?)),
    }
}
