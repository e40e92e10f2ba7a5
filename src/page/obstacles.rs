//! Outlines of obstacles for the animation of a motion: polylines in the world, and their displacements in time.
//!
//! Input: the contacts of a scene and the drawing: one coordinate plane, or space, with the center of all drawn points
//! and their extent (m). In a coordinate plane a half-space is the line in which its boundary cuts the plane through
//! the center, a sphere a circle, a cylinder a circle or two lines, and a capsule its outline. In space a half-space is
//! a square of its boundary, and the others are circles with lines along their axes. Endless obstacles are cut off at
//! the extent. Output of [`drawn_obstacles`]: polylines (world coordinates, m) of each obstacle at t = 0, and its
//! displacements at the given times, m; none for a fixed one.

use crate::numerics::vector::{Vector, add, combine, cross, dot, scale, sub, unit};
use crate::page::plane::DrawingPlane;
use crate::scene::Contact;
use crate::scene::contact::{Obstacle, ObstacleKind};
use crate::scene::obstacle_motion::ObstaclePath;
use std::f64::consts::TAU;

/// Number of chords of a full circle.
const CHORDS: usize = 48;
/// Part of a direction of length one within a coordinate plane below which it is drawn as normal to the plane.
const NORMAL: f64 = 1e-6;
/// Axes of the world.
const WORLD: [Vector<f64>; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// The range of space that a drawing shows.
pub(super) struct DrawnRange {
    /// The coordinate plane; none of a drawing in space.
    pub plane: Option<DrawingPlane>,
    /// Center of all drawn points, m.
    pub center: Vector<f64>,
    /// Extent of the drawn points, m.
    pub extent: f64,
}

/// An obstacle of a drawing.
pub(super) struct DrawnObstacle {
    /// Its outline at t = 0 as polylines in the world, m.
    pub lines: Vec<Vec<Vector<f64>>>,
    /// Its displacement at each stored time, m; empty for a fixed one.
    pub displacements: Vec<Vector<f64>>,
}

/// The obstacles of contacts in a drawing, with their displacements at these times, s.
pub(super) fn drawn_obstacles(
    contacts: &[Contact],
    range: &DrawnRange,
    times: &[f64],
) -> Vec<DrawnObstacle> {
    let drawn = |contact: &Contact| {
        let path = ObstaclePath::new(contact.motions(), WORLD);
        let moved = path.map(|path| times.iter().map(|time| path.displacement(*time)).collect());
        DrawnObstacle {
            lines: outline(&contact.obstacle(), range),
            displacements: moved.unwrap_or_default(),
        }
    };
    contacts.iter().map(drawn).collect()
}

/// The part of a circle of this radius about a center, from an angle over a range of angles, rad; the angle is zero
/// along the first direction and a quarter turn along the second.
fn arc(
    center: Vector<f64>,
    radius: f64,
    [u, v]: [Vector<f64>; 2],
    [from, angle]: [f64; 2],
) -> Vec<Vector<f64>> {
    let count = ((CHORDS as f64 * angle / TAU).ceil() as usize).max(1);
    let at = |k: usize| {
        let (sin, cos) = (from + angle * k as f64 / count as f64).sin_cos();
        add(center, combine(radius * cos, u, radius * sin, v))
    };
    (0..=count).map(at).collect()
}

/// The outline of an obstacle at t = 0 in a drawing.
fn outline(obstacle: &Obstacle<f64>, range: &DrawnRange) -> Vec<Vec<Vector<f64>>> {
    match range.plane {
        Some([across, up]) => outline_in_plane(obstacle, range, [WORLD[across], WORLD[up]]),
        None => outline_in_space(obstacle, range),
    }
}

/// The point of the axis of an obstacle next to the center of the drawing.
fn nearest_of_axis(
    Obstacle { point, axis, .. }: &Obstacle<f64>,
    center: Vector<f64>,
) -> Vector<f64> {
    add(*point, scale(*axis, dot(sub(center, *point), *axis)))
}

/// The outline in the coordinate plane with these two directions.
fn outline_in_plane(
    obstacle: &Obstacle<f64>,
    &DrawnRange { center, extent, .. }: &DrawnRange,
    axes: [Vector<f64>; 2],
) -> Vec<Vec<Vector<f64>>> {
    let Obstacle { kind, radius, point, axis, length } = *obstacle;
    let [u, v] = axes;
    let [along_u, along_v] = axes.map(|own| dot(own, axis));
    let within = along_u.hypot(along_v);
    let circle = || vec![arc(point, radius, axes, [0.0, TAU])];
    // The axis within the plane, and the direction across it.
    let way = combine(along_u / within, u, along_v / within, v);
    let aside = combine(-along_v / within, u, along_u / within, v);
    let line =
        |middle: Vector<f64>, way| [-extent, extent].map(|x| add(middle, scale(way, x))).to_vec();
    match kind {
        // The drawing does not show the boundary of a half-space that is parallel to it.
        ObstacleKind::Plane if within < NORMAL => Vec::new(),
        ObstacleKind::Plane => {
            let distance = dot(axis, sub(center, point)) / within;
            vec![line(sub(center, scale(way, distance)), aside)]
        }
        ObstacleKind::Sphere => circle(),
        ObstacleKind::Cylinder | ObstacleKind::Capsule if within < NORMAL => circle(),
        ObstacleKind::Cylinder => {
            let middle = nearest_of_axis(obstacle, center);
            [-radius, radius].map(|x| line(add(middle, scale(aside, x)), way)).to_vec()
        }
        ObstacleKind::Capsule => {
            let end = add(point, scale(axis, length));
            let half = TAU / 2.0;
            let mut closed = arc(end, radius, [way, aside], [-0.5 * half, half]);
            closed.extend(arc(point, radius, [way, aside], [0.5 * half, half]));
            closed.push(closed[0]);
            vec![closed]
        }
    }
}

/// The outline in space.
fn outline_in_space(
    obstacle: &Obstacle<f64>,
    &DrawnRange { center, extent, .. }: &DrawnRange,
) -> Vec<Vec<Vector<f64>>> {
    let Obstacle { kind, radius, point, axis, length } = *obstacle;
    if kind == ObstacleKind::Sphere {
        let pairs = [[0, 1], [1, 2], [2, 0]].map(|pair| pair.map(|c| WORLD[c]));
        return pairs.map(|pair| arc(point, radius, pair, [0.0, TAU])).to_vec();
    }
    // Two directions across the axis, from the world axis that is least along it.
    let least = (0..3).min_by(|a, b| axis[*a].abs().total_cmp(&axis[*b].abs())).unwrap_or(0);
    let u = unit(cross(axis, WORLD[least]));
    let across = [u, cross(axis, u)];
    let ends = match kind {
        ObstacleKind::Plane => {
            let middle = sub(center, scale(axis, dot(axis, sub(center, point))));
            let corners = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5], [-0.5, -0.5]];
            let [u, v] = across;
            let corner = |[a, b]: [f64; 2]| add(middle, combine(a * extent, u, b * extent, v));
            return vec![corners.map(corner).to_vec()];
        }
        ObstacleKind::Capsule => [point, add(point, scale(axis, length))],
        _ => {
            let middle = nearest_of_axis(obstacle, center);
            [-0.5, 0.5].map(|x| add(middle, scale(axis, x * extent)))
        }
    };
    let mut lines = ends.map(|end| arc(end, radius, across, [0.0, TAU])).to_vec();
    for direction in across.into_iter().flat_map(|own| [own, scale(own, -1.0)]) {
        lines.push(ends.map(|end| add(end, scale(direction, radius))).to_vec());
    }
    if kind == ObstacleKind::Capsule {
        let half = TAU / 2.0;
        for own in across {
            lines.push(arc(ends[0], radius, [own, scale(axis, -1.0)], [0.0, half]));
            lines.push(arc(ends[1], radius, [own, axis], [0.0, half]));
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    /// The contacts of these tables beside any rod.
    fn contacts(tables: &str) -> Vec<Contact> {
        let text = std::fs::read_to_string("data/cantilever.toml").unwrap();
        Scene::from_toml(&(text + tables), ".").unwrap().contacts
    }

    const TABLES: &str = "\n[[contacts]]\nkind = \"plane\"\npoint = [0, -1, 0]\nnormal = [0.1, 2, 0]\n\
        [[contacts]]\nkind = \"sphere\"\ncenter = [0.1, -1.2, 0]\nradius = 0.1\n\
        motion = [{ velocity = [0, 0.5, 0] }]\n\
        [[contacts]]\nkind = \"cylinder\"\npoint = [0.3, -1.5, 2]\naxis = [0, 0, 3]\nradius = 0.05\n\
        [[contacts]]\nkind = \"cylinder\"\npoint = [0.3, -1.5, 2]\naxis = [1, 0, 0]\nradius = 0.05\n\
        [[contacts]]\nkind = \"capsule\"\nfrom = [0, -2, 0.1]\nto = [0.5, -2.5, 0.1]\nradius = 0.05\n";

    /// Every point of an outline is on the surface of its obstacle; in a coordinate plane at its distance in the plane.
    #[test]
    fn outlines_are_on_the_surfaces() {
        let contacts = contacts(TABLES);
        for plane in [Some([0, 1]), None] {
            let range = DrawnRange { plane, center: [0.25, -0.1, 0.0], extent: 0.5 };
            let drawn = drawn_obstacles(&contacts, &range, &[0.0, 2.0]);
            assert_eq!(drawn.len(), 5);
            for (contact, drawn) in contacts.iter().zip(&drawn) {
                let own = contact.obstacle();
                assert!(!drawn.lines.is_empty());
                for x in drawn.lines.iter().flatten() {
                    let mut from = sub(*x, own.point);
                    let along = dot(from, own.axis);
                    match own.kind {
                        ObstacleKind::Plane => from = scale(own.axis, along),
                        ObstacleKind::Cylinder => from = sub(from, scale(own.axis, along)),
                        ObstacleKind::Capsule => {
                            from = sub(from, scale(own.axis, along.clamp(0.0, own.length)));
                        }
                        ObstacleKind::Sphere => {}
                    }
                    // A drawing shows no coordinate across its plane.
                    if plane.is_some() {
                        from[2] = 0.0;
                    }
                    let off = dot(from, from).sqrt() - own.radius;
                    assert!(off.abs() < 1e-12, "{:?} {x:?} {off:e}", own.kind);
                }
            }
            let moved = &drawn[1].displacements;
            assert_eq!(moved[..], [[0.0; 3], [0.0, 1.0, 0.0]]);
            assert!(drawn[0].displacements.is_empty());
        }
    }

    /// The boundary of a half-space that is parallel to the drawing is left out.
    #[test]
    fn parallel_boundary_is_left_out() {
        let contacts = contacts(&TABLES.replace("[0.1, 2, 0]", "[0, 2, 0]"));
        let range = DrawnRange { plane: Some([0, 2]), center: [0.0; 3], extent: 1.0 };
        assert!(drawn_obstacles(&contacts, &range, &[])[0].lines.is_empty());
    }
}
