//! Continuous collision detection: whether an edge passes through a round obstacle within a step.
//!
//! Contact forces act on the state at the end of a step. A step that moves the rod by more than the size of an
//! obstacle may therefore end behind it, without any overlap. Here both nodes of an edge move on straight lines from
//! their positions before the step to those after it. `d(t)` is the smallest distance, m, of the edge from the center
//! of a sphere, or the axis of a cylinder or capsule, at the fraction `t` of the step. The edge has passed through the
//! obstacle if `d` dips in between:
//!
//! ```text
//! min d(t) < DIP min(d(0), d(1), R + r)
//! ```
//!
//! with the radii `R` of the obstacle and `r` of the rod. A rod that crosses a center or axis has a minimum of zero. An
//! edge that slides round the obstacle by the angle `phi` on a straight chord has one of `d cos(phi/2)`, so that
//! correct steps up to 70 degrees are accepted, and so are states in a steady overlap. A step that ends near the center
//! or axis counts as a pass too, because the force there has no direction: one that goes deeper by more than
//! [`DEEPEST_ENTRY`] of `R + r`, and one that ends within [`CENTER`] of it. A plane needs no test: its overlap grows
//! behind it.
//!
//! The minimum is found by conservative advancement (Mirtich 1996, Impulse-based dynamic simulation of rigid body
//! systems): `d` changes by at most the movement of the faster node, so that `t` may advance by the quotient of both.
//!
//! Input: an edge part with its obstacle, and the positions of both nodes before and after the step, m. Output of
//! [`passes_obstacle`]: whether the edge has passed. [`passes`] is the same test for any distance.

use crate::energy::overlap::{EdgePart, largest_overlap};
use crate::numerics::vector::{Vector, combine, dot, sub};
use crate::scene::contact::ObstacleKind;

/// Smallest distance in a step over that at its ends (at most that of touching) below which the obstacle is passed.
/// Larger values reject steps that slide round thin obstacles; smaller ones accept those through their rims.
const DIP: f64 = 0.8;
/// Largest decrease of the distance within the overlap in one step, over the distance of touching.
const DEEPEST_ENTRY: f64 = 0.5;
/// Distance of a state from the center or axis, over that of touching, below which the direction of the force is
/// undetermined.
const CENTER: f64 = 0.05;
/// Smallest advance of the distance, over the distance at which the obstacle is passed.
const RESOLUTION: f64 = 0.05;
/// Smallest advance of the fraction of the step: limits the number of distances that are computed.
const SMALLEST_ADVANCE: f64 = 1e-4;

/// Smallest distance, m, of an edge between two nodes from the center or axis of a round obstacle; infinite behind a
/// wall.
fn distance(edge: EdgePart<'_, f64>, nodes: [Vector<f64>; 2]) -> f64 {
    // The overlap of round obstacles is (D^2 - d^2)/(2 D).
    let reach = edge.obstacle.radius + edge.part.radius;
    (reach * (reach - 2.0 * largest_overlap(edge, nodes))).max(0.0).sqrt()
}

/// Whether an edge whose nodes move from `before` to `now`, m, on straight lines passes through its obstacle. False for
/// planes, and for positions that are not finite.
pub(crate) fn passes_obstacle(
    edge: EdgePart<'_, f64>,
    before: [Vector<f64>; 2],
    now: [Vector<f64>; 2],
) -> bool {
    if edge.obstacle.kind == ObstacleKind::Plane {
        return false;
    }
    let squared = [0, 1].map(|i| {
        let change = sub(now[i], before[i]);
        dot(change, change)
    });
    let squared_movement = squared[0].max(squared[1]);
    if edge.is_apart_within(before, squared_movement) {
        return false;
    }
    let reach = edge.obstacle.radius + edge.part.radius;
    passes(squared_movement.sqrt(), reach, |t| {
        distance(edge, [0, 1].map(|i| combine(1.0 - t, before[i], t, now[i])))
    })
}

/// Whether something passes through a round obstacle in a step. `distance(t)`, m, is their distance at the fraction `t`
/// of the step, which changes by at most the `movement`, m, in the whole step. They touch at the distance `reach`, m.
/// False for distances that are not finite.
pub(super) fn passes(movement: f64, reach: f64, distance: impl Fn(f64) -> f64) -> bool {
    let (first, last) = (distance(0.0), distance(1.0));
    let lower_bound = 0.5 * (first + last - movement);
    if lower_bound.is_nan() {
        return false;
    }
    if last < (first.min(reach) - DEEPEST_ENTRY * reach).max(CENTER * reach) {
        return true;
    }
    let limit = DIP * first.min(last).min(reach);
    if lower_bound >= limit {
        return false;
    }
    let (mut t, mut d) = (0.0, first);
    loop {
        t += ((d - limit).max(RESOLUTION * limit) / movement).max(SMALLEST_ADVANCE);
        if t >= 1.0 {
            return false;
        }
        d = distance(t);
        if d < limit {
            return true;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::energy::overlap::ContactPart;
    use crate::scene::contact::Obstacle;

    /// Radius of the obstacle and of the rod, m.
    const RADII: [f64; 2] = [0.01, 0.005];
    const PART: ContactPart<f64> =
        ContactPart { arc_length: 0.1, length: 0.04, bounds: [0.0, 1.0], radius: RADII[1] };

    /// A round obstacle about the origin, with an axis along z; a capsule from z = -0.02 to 0.02.
    fn obstacle(kind: ObstacleKind) -> Obstacle<f64> {
        let (axis, length) = match kind {
            ObstacleKind::Capsule => ([0.0, 0.0, 1.0], 0.04),
            ObstacleKind::Sphere | ObstacleKind::Plane => ([0.0; 3], 0.0),
            ObstacleKind::Cylinder => ([0.0, 0.0, 1.0], 0.0),
        };
        let z = if kind == ObstacleKind::Capsule { -0.02 } else { 0.0 };
        Obstacle { kind, radius: RADII[0], point: [0.0, 0.0, z], axis, length }
    }

    const ROUND: [ObstacleKind; 3] =
        [ObstacleKind::Sphere, ObstacleKind::Cylinder, ObstacleKind::Capsule];

    fn passes(kind: ObstacleKind, before: [Vector<f64>; 2], now: [Vector<f64>; 2]) -> bool {
        let obstacle = obstacle(kind);
        passes_obstacle(EdgePart { obstacle: &obstacle, part: &PART }, before, now)
    }

    /// An edge along x with its middle at this place.
    fn along_x([x, y, z]: Vector<f64>) -> [Vector<f64>; 2] {
        [[x - 0.02, y, z], [x + 0.02, y, z]]
    }

    /// An edge at this distance from the origin, rotated about z by an angle, rad.
    fn tangent(distance: f64, angle: f64) -> [Vector<f64>; 2] {
        let (sin, cos) = angle.sin_cos();
        [-0.02, 0.02].map(|s| [s * cos - distance * sin, s * sin + distance * cos, 0.0])
    }

    /// Steps of all sizes across the center, from either side, end behind the obstacle.
    #[test]
    fn edge_that_crosses_an_obstacle_is_detected() {
        for kind in ROUND {
            for (above, below) in [(0.016, -0.016), (0.1, -0.02), (0.003, -0.004), (10.0, -10.0)] {
                for x in [0.0, 0.015, 0.019] {
                    let ends = [above, below].map(|y| along_x([x, y, 0.0]));
                    assert!(passes(kind, ends[0], ends[1]), "{kind:?} {above} {below} {x}");
                    assert!(passes(kind, ends[1], ends[0]), "{kind:?} {above} {below} {x}");
                }
            }
            // The tip passes at half the distance of touching.
            let ends = [0.03, -0.03].map(|y| along_x([0.0275, y, 0.0]));
            assert!(passes(kind, ends[0], ends[1]), "{kind:?}");
        }
    }

    /// An edge that turns by more than a right angle while it crosses the center is detected.
    #[test]
    fn edge_that_turns_over_an_obstacle_is_detected() {
        for kind in ROUND {
            let [a, b] = tangent(0.02, 0.0);
            assert!(passes(kind, [a, b], [a, [-0.03, -0.04, 0.0]]), "{kind:?}");
        }
    }

    /// Steps that lead past, along or round the obstacle, or into an overlap, are accepted.
    #[test]
    fn edge_that_slides_on_an_obstacle_is_accepted() {
        for kind in ROUND {
            // In contact, with 2 % of overlap, along the rod by many lengths of the edge.
            for x in [0.001, 0.03, 0.2] {
                let ends = [-x, x].map(|x| along_x([x, 0.0147, 0.0]));
                assert!(!passes(kind, ends[0], ends[1]), "{kind:?} {x}");
            }
            // Round the obstacle by up to 60 degrees.
            for angle in [0.01, 0.5, 1.04] {
                let ends = [tangent(0.0147, 0.3), tangent(0.0147, 0.3 + angle)];
                assert!(!passes(kind, ends[0], ends[1]), "{kind:?} {angle}");
            }
            // Into a deep overlap, along in it, and out of it.
            let depths = [0.02, 0.008, 0.007, 0.02].map(|y| along_x([0.0, y, 0.0]));
            for pair in depths.windows(2) {
                assert!(!passes(kind, pair[0], pair[1]), "{kind:?}");
            }
            // The tip falls down beside the obstacle.
            let ends = [0.03, -0.03].map(|y| along_x([0.0351, y, 0.0]));
            assert!(!passes(kind, ends[0], ends[1]), "{kind:?}");
            assert!(!passes(kind, [[f64::NAN; 3]; 2], along_x([0.0; 3])), "{kind:?}");
        }
        let [above, below] = [0.1, -0.1].map(|y| along_x([0.0, y, 0.0]));
        assert!(!passes(ObstacleKind::Plane, above, below));
    }

    /// Beyond the end of a capsule, or beside a sphere, there is no obstacle; the cylinder has no end.
    #[test]
    fn edge_that_passes_beyond_the_end_of_a_capsule_is_accepted() {
        let [above, below] = [0.03, -0.03].map(|y| along_x([0.0, y, 0.0351]));
        assert!(!passes(ObstacleKind::Capsule, above, below));
        assert!(!passes(ObstacleKind::Sphere, above, below));
        assert!(passes(ObstacleKind::Cylinder, above, below));
        // Within the round end.
        let [above, below] = [0.03, -0.03].map(|y| along_x([0.0, y, 0.025]));
        assert!(passes(ObstacleKind::Capsule, above, below));
    }

    /// The part of an edge behind a wall does not count.
    #[test]
    fn edge_behind_a_wall_is_accepted() {
        for kind in ROUND {
            let (obstacle, part) = (obstacle(kind), ContactPart { bounds: [1.0, 1.0], ..PART });
            let [above, below] = [0.03, -0.03].map(|y| along_x([0.0, y, 0.0]));
            let edge = EdgePart { obstacle: &obstacle, part: &part };
            assert!(!passes_obstacle(edge, above, below), "{kind:?}");
        }
    }
}
