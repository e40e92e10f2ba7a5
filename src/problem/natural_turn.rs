//! Turning angles of the joints of a rod in the stress-free state, and whether the mesh resolves them.
//!
//! The integrated natural curvature `k` (rad) of a joint is the integrated rest curvature times
//! `rod.natural_curvature`, plus `rod.natural_bending` times its length. Here the rest curvature is taken as the
//! turning angle at rest, and the sizes of both terms are added. The joint is free of stress at the turning angle
//! `2 atan(k/2)`, which approximates `k` with the relative error `k^2/12` and stays below half a turn. [`check`]
//! rejects a scene in which `k` of a joint, or the angle by a constant actuator of curvature, is half a turn or more.
//! If `k` exceeds `MAX_RESOLVED_TURN`, there is a warning for a given mesh, with node and sufficient number of edges
//! (`natural_turn_note`). The limits of `k` do not apply to rods with the factor 1 and no natural bending. [`turning`]
//! returns an upper bound of the turning angle (rad) of the whole rod, at rest or without stress, for a first mesh.

use crate::code::Code;
use crate::error::Error;
use crate::problem::Problem;
use crate::scene::Scene;
use crate::scene::mesh::Mesh;
use crate::scene::{ActuatedStrain, Actuation};
use std::f64::consts::PI;

/// Largest natural turning angle of a joint without a warning, rad: its stress-free polygon is curved 7 % too little.
const MAX_RESOLVED_TURN: f64 = 1.0;

/// Joint with the largest turning angle by natural curvature and bending.
#[derive(Clone, Copy, Debug, PartialEq)]
struct LargestTurn {
    /// Integrated natural curvature, rad.
    angle: f64,
    /// Node of the joint.
    node: usize,
    /// Whether `rod.natural_bending` contributes more than the rest shape times `rod.natural_curvature`.
    by_bending: bool,
}

impl LargestTurn {
    /// Key of the scene with the larger contribution to the angle.
    fn key(&self) -> &'static str {
        if self.by_bending { "rod.natural_bending" } else { "rod.natural_curvature" }
    }

    /// Number of edges with which the largest joint turns by at most `angle`, rad, if there are `segments` edges now.
    /// The turning angle is taken as proportional to the length of an edge.
    fn edges_for(&self, segments: usize, angle: f64) -> f64 {
        (segments as f64 * self.angle / angle).ceil()
    }
}

/// Joint with the largest sum of the sizes of both contributions to the integrated natural curvature, rad. The rest
/// curvature is taken as the turning angle. None if the curvature factor is 1 along the rod and there is no natural
/// bending.
fn largest_turn(scene: &Scene, mesh: &Mesh) -> Option<LargestTurn> {
    let rod = &scene.rod;
    if rod.natural_bending.is_empty() && rod.natural_curvature.values().iter().all(|f| *f == 1.0) {
        return None;
    }
    let places = mesh.places();
    let joint = |(i, rest): (usize, f64)| {
        let node = i + 1;
        // Both parts may have different directions: the sum of their sizes is an upper bound.
        let curvature = rod.natural_curvature.at(places[node]).abs() * rest;
        let [first, second] = rod.bending_at(node, &places);
        let bending = first.hypot(second) * 0.5 * (mesh.arcs[i] + mesh.arcs[node]);
        LargestTurn { angle: curvature + bending, node, by_bending: bending > curvature }
    };
    mesh.turns().enumerate().map(joint).max_by(|a, b| a.angle.total_cmp(&b.angle))
}

/// Rejects a constant actuator of curvature along a director (`d1` or `d2`) if `|gain|`, 1/m, times the longest edge of
/// the mesh, m, is half a turn (pi) or more.
fn check_actuators(scene: &Scene, mesh: &Mesh) -> Result<(), Error> {
    let longest = mesh.arcs.iter().copied().fold(0.0, f64::max);
    for (k, actuator) in scene.actuation.iter().enumerate() {
        let Actuation::Curvature { component, gain, signal: None, .. } = actuator else { continue };
        let bends = matches!(component, ActuatedStrain::D1 | ActuatedStrain::D2);
        if bends && gain.abs() * longest >= PI {
            let allowed = format!("less than {:.3e} 1/m, half a turn for each edge", PI / longest);
            return Err(Error::invalid(format!("actuation[{k}].gain"), *gain, allowed));
        }
    }
    Ok(())
}

/// Rejects constant actuators, natural curvature and bending that turn a joint by half a turn or more. The error of
/// curvature and bending has the key of the larger contribution, the node, and the number of edges that must be
/// exceeded. That of an actuator has its key and the limit of its gain, `pi` over the longest edge, 1/m.
pub(super) fn check(scene: &Scene, mesh: &Mesh) -> Result<(), Error> {
    let segments = mesh.nodes.len() - 1;
    check_actuators(scene, mesh)?;
    match largest_turn(scene, mesh).filter(|turn| turn.angle >= PI) {
        Some(turn) => {
            let found = format!(
                "a natural turning angle of {:.3e} rad at node {} of {segments} segments",
                turn.angle, turn.node
            );
            let allowed = format!(
                "less than half a turn for each edge. Use more than {:.0} segments, or less \
                 curvature",
                turn.edges_for(segments, PI)
            );
            Err(Error::invalid(turn.key(), found, allowed))
        }
        None => Ok(()),
    }
}

/// Upper bound of the turning angle of the whole rod, rad. It is the larger one of that at rest, `rest`, and of
/// `max|factor| rest + max|bending| length` in the stress-free state; `length` is in m.
pub(crate) fn turning(scene: &Scene, rest: f64, length: f64) -> f64 {
    let factors = scene.rod.natural_curvature.values().into_iter();
    let factor = factors.map(f64::abs).fold(0.0, f64::max);
    let bending = scene.rod.natural_bending.iter().map(|[a, b]| a.hypot(*b)).fold(0.0, f64::max);
    rest.max(factor * rest + bending * length)
}

impl Problem {
    /// The warning, with its code, that a given mesh is too coarse for the natural curvature: a joint turns by more
    /// than [`MAX_RESOLVED_TURN`]. It has the node, the natural angle k and the polygon's `2 atan(k/2)`, rad, and the
    /// number of edges with half of [`MAX_RESOLVED_TURN`]. None for a mesh that the program chose, which is as fine as
    /// the accuracy requires.
    pub(super) fn natural_turn_note(&self) -> Option<(Code, String)> {
        let turn = largest_turn(&self.scene, &self.mesh)?;
        let (LargestTurn { angle, node, .. }, segments) = (turn, self.segments());
        let words = format!(
            "{} turns the joint at node {node} by {angle:.2} rad without stress, which {segments} segments represent by \
             {:.2} rad. Results have an error of that order. Take {:.0} segments or more, or leave rod.segments out",
            turn.key(),
            2.0 * (0.5 * angle).atan(),
            turn.edges_for(segments, 0.5 * MAX_RESOLVED_TURN)
        );
        // A chosen mesh is as fine as the requested accuracy requires.
        let coarse = angle > MAX_RESOLVED_TURN && !self.scene.chosen().segments;
        coarse.then_some((Code::CoarseCurvature, words))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accuracy::Calculation;
    use crate::scene::{Along, Material, Section, Shape};

    /// An arc of 1 rad, 0.5 m long, whose natural shape is `factor` times as curved.
    fn arc(segments: usize, factor: f64) -> Scene {
        let shape = Shape::Arc { length: 0.5, angle: 1.0 };
        let section = Section::Circle { radius: 0.005 };
        let mut scene = Scene::new(segments, shape, section, Material::new(1273.52, 1e8));
        scene.rod.natural_curvature = Along::Whole(factor);
        scene
    }

    /// 19.5 edges between wall and end turn by 1 rad at rest: half a turn each at a factor of 19.5 pi = 61.3.
    #[test]
    fn natural_curvature_of_half_a_turn_an_edge_is_refused() {
        for (factor, allowed) in
            [(61.0, true), (-61.0, true), (61.5, false), (-61.5, false), (1e3, false)]
        {
            let found = arc(20, factor).problem().map(drop).map_err(|error| error.to_string());
            match (allowed, found) {
                (true, found) => assert_eq!(found, Ok(()), "{factor}"),
                (false, found) => {
                    let words = found.unwrap_err();
                    assert!(words.starts_with("rod.natural_curvature"), "{words}");
                    assert!(words.contains("half a turn for each edge"), "{words}");
                }
            }
        }
    }

    /// A constant actuator bends an edge of 0.5 m/19.5 by half a turn at 122.5 1/m.
    #[test]
    fn actuator_of_half_a_turn_an_edge_is_refused() {
        for (gain, allowed) in [(122.0, true), (123.0, false), (-123.0, false)] {
            let mut scene = arc(20, 1.0);
            let (component, signal) = (ActuatedStrain::D1, None);
            scene.actuation =
                vec![Actuation::Curvature { component, from: 0.0, to: None, signal, gain }];
            let found = scene.problem().map(drop).map_err(|error| error.to_string());
            assert_eq!(found.is_ok(), allowed, "{gain}: {found:?}");
            if let Err(words) = found {
                assert!(words.starts_with("actuation[0].gain"), "{words}");
            }
        }
    }

    /// On a straight rod 1/m of bending turns an edge of 0.5 m/19.5 by 0.0256 rad: half a turn at 122.5 1/m.
    #[test]
    fn natural_bending_of_half_a_turn_an_edge_is_refused() {
        for (size, allowed) in [(122.0, true), (123.0, false), (1e6, false)] {
            let mut scene = arc(20, 1.0);
            scene.rod.shape = Shape::Straight { length: 0.5, direction: [1.0, 0.0, 0.0] };
            scene.material.poisson_ratio = Some(0.5);
            scene.rod.natural_bending = vec![[0.6 * size, 0.8 * size]];
            let found = scene.problem().map(drop).map_err(|error| error.to_string());
            assert_eq!(found.is_ok(), allowed, "{found:?}");
            assert!(allowed || found.unwrap_err().starts_with("rod.natural_bending"));
        }
    }

    /// A natural turn of 55/19.5 = 2.82 rad a joint is represented by 2 atan(1.41) = 1.91 rad.
    #[test]
    fn coarse_mesh_of_a_natural_shape_is_reported() {
        let found = arc(20, 55.0).problem().unwrap().equilibrium().unwrap();
        assert!(found.warning_codes.contains(&Code::CoarseCurvature), "{:?}", found.warnings);
        let fine = arc(20, 15.0).problem().unwrap();
        assert_eq!(fine.natural_turn_note(), None);
        let coarse = arc(20, 55.0).problem().unwrap().natural_turn_note().unwrap();
        assert!(coarse.1.contains("2.82 rad") && coarse.1.contains("1.91 rad"), "{coarse:?}");
    }

    /// Without `rod.segments` the first mesh resolves the natural shape, not the rest shape alone.
    #[test]
    fn chosen_mesh_resolves_the_natural_shape() {
        let mut scene = arc(20, 55.0);
        scene.rod.segments = None;
        let problem = scene.problem_for(Calculation::Guess).unwrap();
        assert!(problem.segments() as f64 >= 55.0 / 1.5, "{}", problem.segments());
    }
}
