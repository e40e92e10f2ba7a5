//! Rest shapes and their meshes.

use super::{direction, positive};
use crate::error::Error;
use nalgebra::{Unit, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

/// The rod's shape at rest. Length counts from the wall to the tip; arc length 0 is at the origin.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Shape {
    /// From the origin along `direction`.
    Straight {
        /// m.
        length: f64,
        /// Any non-zero vector.
        direction: [f64; 3],
    },
    /// `x(s) = (R cos p, R sin p, -c p)`, `p = s/sqrt(R^2 + c^2)`, `c = pitch/(2 pi)`, for the
    /// axis `[0, 0, -1]` and left-handed.
    Helix {
        /// Along the curve, m.
        length: f64,
        /// R, m.
        radius: f64,
        /// Advance along the axis per turn, m.
        pitch: f64,
        /// Direction of advance.
        axis: [f64; 3],
        /// Sense of the turns.
        handedness: Handedness,
    },
    /// In the xy plane, from the origin along +x, curving toward +y.
    Arc {
        /// Along the curve, m.
        length: f64,
        /// Total turning angle, rad.
        angle: f64,
    },
    /// The nodes themselves, from a CSV file with the columns x, y, z in m.
    Polyline {
        /// Relative to the scene file.
        file: PathBuf,
    },
}

/// Sense of a helix.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Handedness {
    /// Turns clockwise as it comes toward the viewer.
    Left,
    /// Turns counter-clockwise as it comes toward the viewer.
    Right,
}

/// Nodes of the rest shape.
#[derive(Clone, Debug)]
pub struct Mesh {
    /// Positions, m.
    pub nodes: Vec<[f64; 3]>,
    /// Arc length of every node from the wall, m; negative behind the wall.
    pub arc_length: Vec<f64>,
    /// Length between the walls or ends, m.
    pub length: f64,
    /// Length of the curve along every edge, m; estimated for a polyline.
    pub arcs: Vec<f64>,
}

impl Mesh {
    /// Where the inner nodes are, as parts of the length.
    pub(crate) fn places(&self) -> Vec<f64> {
        let inner = &self.arc_length[1..self.arc_length.len() - 1];
        inner.iter().map(|s| s / self.length).collect()
    }
}

impl Shape {
    /// Checks every value; `table` is where it stands.
    pub(crate) fn check(&self, table: &str) -> Result<(), Error> {
        let key = |name: &str| format!("{table}.{name}");
        match self {
            Self::Straight { length, direction: d } => {
                positive(&key("length"), *length)?;
                direction(&key("direction"), d)
            }
            Self::Helix { length, radius, pitch, axis, .. } => {
                positive(&key("length"), *length)?;
                positive(&key("radius"), *radius)?;
                positive(&key("pitch"), *pitch)?;
                direction(&key("axis"), axis)
            }
            Self::Arc { length, angle } => {
                positive(&key("length"), *length)?;
                if angle.is_finite() {
                    return Ok(());
                }
                Err(Error::invalid(key("angle"), angle, "a finite number"))
            }
            Self::Polyline { .. } => Ok(()),
        }
    }

    /// How far the tangent turns from end to end, rad; zero for a polyline, whose mesh is given.
    pub(crate) fn turning(&self) -> f64 {
        match self {
            Self::Straight { .. } | Self::Polyline { .. } => 0.0,
            Self::Arc { angle, .. } => angle.abs(),
            Self::Helix { length, radius, pitch, .. } => {
                length * radius / (radius.powi(2) + (pitch / TAU).powi(2))
            }
        }
    }

    /// The mesh of `segments` equal edges; a wall at the start or the end cuts the middle of the
    /// outermost edge where `cut` says so. A polyline brings its own nodes.
    pub fn mesh(&self, segments: usize, cut: [bool; 2], folder: &Path) -> Result<Mesh, Error> {
        let before = if cut[0] { 0.5 } else { 0.0 };
        let after = if cut[1] { 0.5 } else { 0.0 };
        let length = match self {
            Self::Straight { length, .. }
            | Self::Helix { length, .. }
            | Self::Arc { length, .. } => *length,
            Self::Polyline { file } => return polyline(&folder.join(file), [before, after]),
        };
        let edge = length / (segments as f64 - before - after);
        let arc_length: Vec<f64> = (0..=segments).map(|i| (i as f64 - before) * edge).collect();
        let point = self.curve();
        let nodes = arc_length.iter().map(|s| point(*s).into()).collect();
        Ok(Mesh { nodes, arc_length, length, arcs: vec![edge; segments] })
    }

    /// The curve by arc length.
    fn curve(&self) -> Box<dyn Fn(f64) -> Vector3<f64>> {
        match *self {
            Self::Straight { direction, .. } => {
                let direction = Vector3::from(direction).normalize();
                Box::new(move |s| direction * s)
            }
            Self::Helix { radius, pitch, axis, handedness, .. } => {
                let c = pitch / TAU;
                let speed = radius.hypot(c);
                let turn = if handedness == Handedness::Left { -1.0 } else { 1.0 };
                // Seen along the axis -z, y(p) = +R sin p winds left-handed.
                let axis = Unit::new_normalize(Vector3::from(axis));
                let to_axis = UnitQuaternion::rotation_between_axis(&-Vector3::z_axis(), &axis)
                    .unwrap_or_else(|| {
                        UnitQuaternion::from_axis_angle(&Vector3::x_axis(), TAU / 2.0)
                    });
                Box::new(move |s| {
                    let p = s / speed;
                    to_axis * Vector3::new(radius * p.cos(), -turn * radius * p.sin(), -c * p)
                })
            }
            Self::Arc { length, angle } => Box::new(move |s| {
                let half = 0.5 * angle * s / length;
                // The chord of an arc of half angle a is s sin(a)/a long and points along a.
                let chord = if half == 0.0 { s } else { s * half.sin() / half };
                Vector3::new(chord * half.cos(), chord * half.sin(), 0.0)
            }),
            Self::Polyline { .. } => unreachable!("a polyline brings its own nodes"),
        }
    }
}

fn polyline(path: &Path, cut: [f64; 2]) -> Result<Mesh, Error> {
    let table = crate::table::Table::read(path)?;
    let columns: Vec<usize> =
        ["x", "y", "z"].iter().map(|name| table.require(name)).collect::<Result<_, _>>()?;
    let mut nodes: Vec<[f64; 3]> = Vec::with_capacity(table.rows.len());
    for row in &table.rows {
        let node = [0, 1, 2].map(|i| row.values[columns[i]].unwrap_or(f64::NAN));
        if !node.iter().all(|x| x.is_finite()) {
            return Err(table.error(row.line, "a blank, where x, y and z in m are needed"));
        }
        if nodes.last() == Some(&node) {
            return Err(
                table.error(row.line, "the same point as the line before; edges need a length")
            );
        }
        nodes.push(node);
    }
    if nodes.len() < 3 {
        let message = format!("{} nodes, where at least 3 are needed", nodes.len());
        return Err(table.error(1, &message));
    }
    let edges: Vec<f64> = nodes
        .windows(2)
        .map(|pair| (Vector3::from(pair[1]) - Vector3::from(pair[0])).norm())
        .collect();
    let wall = cut[0] * edges[0];
    let mut arc_length = vec![-wall];
    for edge in &edges {
        arc_length.push(arc_length[arc_length.len() - 1] + edge);
    }
    let length = arc_length[nodes.len() - 1] - cut[1] * edges[edges.len() - 1];
    let arcs = arcs_over(&nodes, &edges);
    Ok(Mesh { nodes, arc_length, length, arcs })
}

/// The arc over every chord of a polygon inscribed in a smooth curve: it turns by the mean of the
/// angles at its ends.
fn arcs_over(nodes: &[[f64; 3]], chords: &[f64]) -> Vec<f64> {
    let edges: Vec<Vector3<f64>> =
        nodes.windows(2).map(|p| Vector3::from(p[1]) - Vector3::from(p[0])).collect();
    let turns: Vec<f64> = edges.windows(2).map(|e| e[0].angle(&e[1])).collect();
    let arc = |(j, chord): (usize, &f64)| {
        let before = j.checked_sub(1).and_then(|i| turns.get(i));
        let sides = [before, turns.get(j)].into_iter().flatten();
        let half = 0.5 * sides.clone().sum::<f64>() / sides.count().max(1) as f64;
        if half < 1e-9 { *chord } else { chord * half / half.sin() }
    };
    chords.iter().enumerate().map(arc).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn the_helix_is_the_documented_curve() {
        let (radius, pitch) = (0.02, 0.05);
        let helix = Shape::Helix {
            length: 0.5,
            radius,
            pitch,
            axis: [0.0, 0.0, -1.0],
            handedness: Handedness::Left,
        };
        let mesh = helix.mesh(50, [false, false], Path::new("")).unwrap();
        let c = pitch / TAU;
        for (node, s) in mesh.nodes.iter().zip(&mesh.arc_length) {
            let p = s / radius.hypot(c);
            assert_relative_eq!(node[0], radius * p.cos(), epsilon = 1e-15);
            assert_relative_eq!(node[1], radius * p.sin(), epsilon = 1e-15);
            assert_relative_eq!(node[2], -c * p, epsilon = 1e-15);
        }
    }

    #[test]
    fn a_wall_cuts_the_middle_of_the_outermost_edge() {
        let shape = Shape::Arc { length: 1.0, angle: 1.0 };
        let mesh = shape.mesh(10, [true, false], Path::new("")).unwrap();
        let edge = 1.0 / 9.5;
        assert_relative_eq!(mesh.arc_length[0], -0.5 * edge);
        assert_relative_eq!(mesh.arc_length[10], 1.0, epsilon = 1e-15);
        assert_relative_eq!(mesh.nodes[10][0], 1.0_f64.sin(), epsilon = 1e-15);
        assert_relative_eq!(mesh.nodes[10][1], 1.0 - 1.0_f64.cos(), epsilon = 1e-15);
    }

    #[test]
    fn arcs_over_a_polygon_are_the_curves() {
        let shape = Shape::Arc { length: 1.0, angle: 2.0 };
        let mesh = shape.mesh(10, [false, false], Path::new("")).unwrap();
        let chords: Vec<f64> = mesh
            .nodes
            .windows(2)
            .map(|p| (Vector3::from(p[1]) - Vector3::from(p[0])).norm())
            .collect();
        for (estimate, exact) in arcs_over(&mesh.nodes, &chords).iter().zip(&mesh.arcs) {
            assert_relative_eq!(estimate, exact, max_relative = 1e-14);
        }
        assert!(chords[0] < 0.999 * mesh.arcs[0]);
    }
}
