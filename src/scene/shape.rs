//! Rest shapes and their meshes.

use super::polyline::Polyline;
use super::{direction, positive};
use crate::error::Error;
use nalgebra::{Unit, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

/// The rod's shape at rest. Length counts from the wall to the tip; arc length 0 is at the origin.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Shape {
    /// From the origin along `direction`.
    Straight {
        /// m.
        length: f64,
        /// Any non-zero vector.
        #[serde(deserialize_with = "crate::exact::numbers")]
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
        #[serde(deserialize_with = "crate::exact::numbers")]
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
    /// A smooth curve through the points of a CSV file with the columns x, y, z, in m or in the unit
    /// of their header: `x[mm]`. The first point is where the rod begins, at the wall of a clamped
    /// start, and the last is where it ends, at the wall of a clamped end or the tip. The rod gets
    /// as many nodes as there are points, unless `segments` says otherwise. They are the points
    /// themselves, but for rods whose walls are at `"mid-edge"`: those put the middle of the
    /// outermost edge at the point, as for all shapes, and the nodes between move along the curve
    /// by up to half an edge; a corner of the line is cut by as much.
    ///
    /// As `initial.shape` the file may have any number of points: every node begins at the same
    /// part of the line's length as at rest. A column s, as `rodfit static --out` writes, says for
    /// every row which point of the rod it is instead: its arc length from the wall at rest,
    /// negative behind it.
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

    /// How far the edges turn from end to end, rad.
    pub(crate) fn turning(&self) -> f64 {
        self.turns().sum()
    }

    /// Whether no joint turns, but for rounding errors.
    pub(crate) fn is_straight(&self) -> bool {
        self.turns().all(|turn| turn < 1e-9)
    }

    fn turns(&self) -> impl Iterator<Item = f64> {
        self.nodes.windows(3).map(|p| {
            let [a, b, c] = [0, 1, 2].map(|i| Vector3::from(p[i]));
            angle(&(b - a), &(c - b))
        })
    }
}

/// A length, m, and the curve by arc length.
type Curve = (f64, Box<dyn Fn(f64) -> Vector3<f64>>);

/// The error of a mesh that nobody has said the fineness of.
pub(super) fn no_segments() -> Error {
    Error::invalid("rod.segments", "no such key", "2 .. 1e7")
}

/// Between two vectors, rad, small ones to the last digit.
pub(super) fn angle(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    a.cross(b).norm().atan2(a.dot(b))
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

    /// How far the tangent turns from end to end, rad; none where only the points tell.
    pub(crate) fn turning(&self) -> Option<f64> {
        match self {
            Self::Straight { .. } => Some(0.0),
            Self::Arc { angle, .. } => Some(angle.abs()),
            Self::Helix { length, radius, pitch, .. } => {
                Some(length * radius / (radius.powi(2) + (pitch / TAU).powi(2)))
            }
            Self::Polyline { .. } => None,
        }
    }

    /// The mesh of `segments` equal edges; a wall at the start or the end cuts the middle of the
    /// outermost edge where `cut` says so. The edges of a polyline go with the distances of its
    /// points; by default there are as many.
    pub fn mesh(
        &self,
        segments: Option<usize>,
        cut: [bool; 2],
        folder: &Path,
    ) -> Result<Mesh, Error> {
        let cut = cut.map(|cut| if cut { 0.5 } else { 0.0 });
        let (length, point) = match self.curve() {
            Ok(curve) => curve,
            Err(file) => return Polyline::read(&folder.join(file), false)?.mesh(segments, cut),
        };
        let segments = segments.ok_or_else(no_segments)?;
        let edge = length / (segments as f64 - cut[0] - cut[1]);
        let arc_length: Vec<f64> = (0..=segments).map(|i| (i as f64 - cut[0]) * edge).collect();
        let nodes = arc_length.iter().map(|s| point(*s).into()).collect();
        Ok(Mesh { nodes, arc_length, length, arcs: vec![edge; segments] })
    }

    /// Where the nodes of a rod are that has this shape instead of its `rest`.
    pub(crate) fn nodes_of(&self, rest: &Mesh, folder: &Path) -> Result<Vec<[f64; 3]>, Error> {
        let (length, point) = match self.curve() {
            Ok(curve) => curve,
            Err(file) => {
                let path = folder.join(file);
                return Polyline::read(&path, true)?.nodes_of(rest, &path);
            }
        };
        let stretch = length / rest.length;
        Ok(rest.arc_length.iter().map(|s| point(s * stretch).into()).collect())
    }

    /// The length and the curve by arc length; or the file of a polyline.
    fn curve(&self) -> Result<Curve, &Path> {
        let (length, curve): Curve = match *self {
            Self::Straight { length, direction } => {
                let direction = Vector3::from(direction).normalize();
                (length, Box::new(move |s| direction * s))
            }
            Self::Helix { length, radius, pitch, axis, handedness } => {
                let c = pitch / TAU;
                let speed = radius.hypot(c);
                let turn = if handedness == Handedness::Left { -1.0 } else { 1.0 };
                // Seen along the axis -z, y(p) = +R sin p winds left-handed.
                let axis = Unit::new_normalize(Vector3::from(axis));
                let to_axis = UnitQuaternion::rotation_between_axis(&-Vector3::z_axis(), &axis)
                    .unwrap_or_else(|| {
                        UnitQuaternion::from_axis_angle(&Vector3::x_axis(), TAU / 2.0)
                    });
                let point = move |s: f64| {
                    let p = s / speed;
                    to_axis * Vector3::new(radius * p.cos(), -turn * radius * p.sin(), -c * p)
                };
                (length, Box::new(point))
            }
            Self::Arc { length, angle } => {
                let point = move |s: f64| {
                    let half = 0.5 * angle * s / length;
                    // The chord of an arc of half angle a is s sin(a)/a long and points along a.
                    let chord = if half == 0.0 { s } else { s * half.sin() / half };
                    Vector3::new(chord * half.cos(), chord * half.sin(), 0.0)
                };
                (length, Box::new(point))
            }
            Self::Polyline { ref file } => return Err(file),
        };
        Ok((length, curve))
    }
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
        let mesh = helix.mesh(Some(50), [false, false], Path::new("")).unwrap();
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
        let mesh = shape.mesh(Some(10), [true, false], Path::new("")).unwrap();
        let edge = 1.0 / 9.5;
        assert_relative_eq!(mesh.arc_length[0], -0.5 * edge);
        assert_relative_eq!(mesh.arc_length[10], 1.0, epsilon = 1e-15);
        assert_relative_eq!(mesh.nodes[10][0], 1.0_f64.sin(), epsilon = 1e-15);
        assert_relative_eq!(mesh.nodes[10][1], 1.0 - 1.0_f64.cos(), epsilon = 1e-15);
    }
}
