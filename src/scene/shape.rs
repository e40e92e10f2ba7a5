//! Rest shapes: straight, helix, arc, or a polyline; their nodes by arc length.
//!
//! [`Shape::mesh`] places nodes along the curve, m, with given fractions of the outermost edges behind walls. All edges
//! have equal lengths along the curve. Those of a polyline are proportional to the distances of its points, and by
//! default as many; other shapes without a number of edges are errors. `Shape::nodes_of` places the nodes of a rod in
//! this shape as an initial one: at the same fractions of the length as at rest, or at arc lengths that the file of a
//! polyline gives. Both work over any number type, with derivatives with respect to the numbers of the shape.
//!
//! `Shape::read` reads the points of a polyline from a file or from the scene (module `polyline`); mesh and nodes of
//! one that has not been read are errors. `Shape::check` rejects invalid numbers.

use crate::error::Error;
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::{Vector, add, cross, dot, scale, unit};
use crate::scene::mesh::Mesh;
use crate::scene::number::{Quantity, is_default, is_one, one};
use crate::scene::polyline::Polyline;
use crate::scene::table::{NumberTree, TABLE, table};
use crate::scene::validate::direction;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};
use std::sync::Arc;

table! {
    /// Shape of the rod at rest. Arc length is measured from the wall to the tip; arc length 0 is at
    /// the origin.
    pub enum Shape {
        /// A straight line from the origin along `direction`.
        Straight {
            /// Length of the rod, m.
            length: D = LENGTH,
            /// Direction of the rod: any non-zero vector.
            #[serde(deserialize_with = "crate::input::arrays::numbers")]
            direction: [D; 3] = Quantity::signed(""),
        },
        /// A helix `x(s) = (R cos p, R sin p, -c p)`, `p = s/sqrt(R^2 + c^2)`, `c = pitch/(2 pi)`, for
        /// the axis `[0, 0, -1]` and left-handed.
        Helix {
            /// Length along the curve, m.
            length: D = LENGTH,
            /// Radius R of the helix, m.
            radius: D = LENGTH,
            /// Advance along the axis per turn, m.
            pitch: D = LENGTH,
            /// Direction of advance of the helix.
            #[serde(deserialize_with = "crate::input::arrays::numbers")]
            axis: [D; 3] = Quantity::signed(""),
            /// Sense of rotation of the helix.
            handedness: Handedness,
        },
        /// A circular arc in the xy plane, from the origin along +x, curving toward +y.
        Arc {
            /// Length along the curve, m.
            length: D = LENGTH,
            /// Total turning angle, rad.
            angle: D = Quantity::signed("rad").within(-1e3, 1e3),
        },
        /// A smooth curve through the points of a CSV file with the columns x, y, z, in m or in the unit
        /// of their header, `x[mm]`. The first point is the start of the rod, at the wall of a clamped
        /// start; the last is its end, at the wall of a clamped end or the tip. Without `segments` the
        /// rod has as many nodes as there are points. The nodes are the points, except with walls at
        /// `"mid-edge"`: there the middle of the outermost edge is at the point, and the nodes between
        /// move along the curve by up to half an edge.
        ///
        /// As `initial.shape` the file may have any number of points: every node starts at the same
        /// fraction of the length as at rest. An optional column s, as `rodfit static --out` writes it,
        /// gives the arc length of each row from the wall at rest, m.
        ///
        /// The scene may contain the points instead, as `points = [[x, y, z], ..]`, m; those of
        /// [`Shape::points`] are saved that way.
        Polyline {
            /// CSV file of the points, relative to the scene file; absent beside `points`.
            #[serde(default, skip_serializing_if = "is_default")]
            file: PathBuf,
            /// Points of the curve, m, instead of a file.
            #[serde(
                deserialize_with = "crate::input::arrays::rows",
                default,
                skip_serializing_if = "Vec::is_empty"
            )]
            points: Vec<[f64; 3]>,
            /// Factor on the coordinates.
            #[serde(default = "one::<D>", skip_serializing_if = "is_one")]
            scale: D = Quantity::positive(""),
            /// Lengths of the edges between the points, m, where the points give the turning angles but
            /// not the lengths.
            #[serde(default, skip_serializing_if = "Vec::is_empty")]
            lengths: Vec<f64>,
            /// The curve, once the points are read.
            #[serde(skip)]
            line: Option<Arc<Polyline>>,
        },
    }
}

/// Quantity of a length, radius or pitch, m.
const LENGTH: Quantity = Quantity::positive("m");

/// Sense of rotation of a helix.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Handedness {
    /// Left-handed: clockwise for an observer that the helix approaches.
    Left,
    /// Right-handed: counterclockwise for an observer that the helix approaches.
    Right,
}

/// The error for a missing number of edges of a shape other than a polyline.
fn no_segments() -> Error {
    Error::invalid("rod.segments", "no such key", "2 .. 1e7")
}

impl Shape {
    /// A smooth curve through the points of a CSV file, relative to the scene file. It is not read yet; the factor on
    /// coordinates is 1, and no lengths of edges are given.
    pub fn polyline(file: impl Into<PathBuf>) -> Self {
        Self::Polyline {
            file: file.into(),
            points: Vec::new(),
            scale: 1.0,
            lengths: Vec::new(),
            line: None,
        }
    }

    /// A smooth curve through points, m, from the wall or the first end of the rod to the last. A saved scene contains
    /// these points.
    pub fn points(points: impl IntoIterator<Item = [f64; 3]>) -> Self {
        let mut shape = Self::polyline("");
        if let Self::Polyline { points: own, .. } = &mut shape {
            *own = points.into_iter().collect();
        }
        shape
    }

    /// Reads the points of a polyline from its file, relative to `folder`, or takes those of the scene, and applies
    /// given lengths of the edges. Points and lengths that have been read are not read again; no effect for other
    /// shapes. `on_a_rod` is true for an initial shape: its file may have a column of arc lengths. Errors are those of
    /// `Polyline`.
    pub(crate) fn read(&mut self, folder: &Path, on_a_rod: bool) -> Result<(), Error> {
        if let Self::Polyline { file, points, line, lengths, .. } = self {
            let path = marker_files::file::at(folder, file);
            let given = !points.is_empty();
            // Another file, or other points, than those of the curve are read.
            let read = |line: &Arc<Polyline>| match given {
                true => line.is_through(points) && lengths.is_empty(),
                false => line.path() == Some(path.as_path()) && line.lengths() == &lengths[..],
            };
            if !line.as_ref().is_some_and(read) {
                let found = match given {
                    true => Polyline::through(points, on_a_rod)?,
                    false => Polyline::read(&path, on_a_rod)?,
                };
                *line = Some(Arc::new(found.with_lengths(lengths)?));
            }
        }
        Ok(())
    }

    /// Rejects numbers that are not finite or not above 0 where they must be, directions of no length, and a polyline
    /// with neither or both of file and points. `table` is the path of the shape, for the error.
    pub(crate) fn check(&self, table: &str) -> Result<(), Error> {
        self.check_numbers(table, TABLE)?;
        match self {
            Self::Straight { direction: d, .. } => direction(&format!("{table}.direction"), d),
            Self::Helix { axis, .. } => direction(&format!("{table}.axis"), axis),
            Self::Polyline { file, points, .. } if is_default(file) == points.is_empty() => {
                let found = if points.is_empty() { "neither file nor points" } else { "both" };
                Err(Error::invalid(format!("{table}.points"), found, "a file, or points"))
            }
            Self::Arc { .. } | Self::Polyline { .. } => Ok(()),
        }
    }

    /// Length along the curve, m, as the scene gives it; 0 for a polyline, whose points determine it.
    pub(crate) fn length(&self) -> f64 {
        match self {
            Self::Straight { length, .. }
            | Self::Arc { length, .. }
            | Self::Helix { length, .. } => *length,
            Self::Polyline { .. } => 0.0,
        }
    }

    /// Length along the curve, m. Of a polyline it is that of the curve through its points times the factor `scale`,
    /// and NaN before they are read.
    pub(super) fn curve_length(&self) -> f64 {
        match self {
            Self::Polyline { line, scale, .. } => {
                line.as_ref().map_or(f64::NAN, |line| scale * line.length())
            }
            _ => self.length(),
        }
    }

    /// Integral of the curvature along the curve, rad, not negative: `|angle|` of an arc, 0 of a straight line, `L
    /// R/(R^2 + (pitch/(2 pi))^2)` of a helix. None for a polyline, whose points determine it.
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
}

impl<D: Scalar> Shape<D> {
    /// Mesh of `segments` edges of equal length along the curve, m. `behind` are the fractions of the first and of the
    /// last edge behind a wall. An edge is the rod length over `segments - behind[0] - behind[1]`, and arc length 0 is
    /// at the first wall. The edges of a polyline are proportional to the distances of its points, and by default as
    /// many. Its points must have been read, by [`Scene::load`](super::Scene::load) or
    /// [`Scene::problem`](super::Scene::problem), else there is an error. For other shapes a missing number of edges is
    /// an error.
    pub fn mesh(&self, segments: Option<usize>, behind: [f64; 2]) -> Result<Mesh<D>, Error> {
        let (length, point) = match self.curve()? {
            ShapeCurve::Formula(length, point) => (length, point),
            ShapeCurve::Points(line, scale) => {
                return Ok(line.mesh(segments, behind)?.times(scale));
            }
        };
        let segments = segments.ok_or_else(no_segments)?;
        // Edges behind walls are longer than their part of the rod: equal edges in all.
        let edge = length / D::from(segments as f64 - behind[0] - behind[1]);
        let arc_length: Vec<D> = (0..=segments).map(|i| edge * (i as f64 - behind[0])).collect();
        let nodes = arc_length.iter().map(|s| point(*s)).collect();
        Ok(Mesh { nodes, arc_length, length, arcs: vec![edge; segments], named: None })
    }

    /// Positions, m, of the nodes of a rod in this shape. They are at the same fractions of the length as in `rest`,
    /// the mesh of the rest shape. If the file of a polyline gives arc lengths, the nodes are at their arc lengths in
    /// `rest`. An error for a polyline that is not read or does not cover the rod.
    pub(crate) fn nodes_of(&self, rest: &Mesh<D>) -> Result<Vec<Vector<D>>, Error> {
        let (length, point) = match self.curve()? {
            ShapeCurve::Formula(length, point) => (length, point),
            ShapeCurve::Points(line, factor) => {
                let nodes = line.nodes_of(rest)?;
                return Ok(nodes.into_iter().map(|x| scale(x, factor)).collect());
            }
        };
        // An initial shape may have another length than the rod: nodes keep their fractions of it.
        let stretch = length / rest.length;
        Ok(rest.arc_length.iter().map(|s| point(*s * stretch)).collect())
    }

    /// The shape as its length, m, and the position, m, as a function of arc length, in closed form. A polyline that
    /// has been read is its curve, with the factor on its coordinates. Arc length 0 is at the origin, except for a
    /// helix, which begins at its radius from the axis through the origin. An error for a polyline that has not been
    /// read.
    fn curve(&self) -> Result<ShapeCurve<'_, D>, Error> {
        Ok(match *self {
            Self::Straight { length, direction } => {
                let direction = unit(direction);
                ShapeCurve::Formula(length, Box::new(move |s| scale(direction, s)))
            }
            Self::Helix { length, radius, pitch, axis, handedness } => {
                let c = pitch / D::from(TAU);
                let speed = (radius * radius + c * c).sqrt();
                let turn = if handedness == Handedness::Left { -1.0 } else { 1.0 };
                // Seen along the axis -z, y(p) = +R sin p winds left-handed.
                let axis = unit(axis);
                let point = move |s: D| {
                    let p = s / speed;
                    to_axis(axis, [radius * p.cos(), radius * p.sin() * -turn, -(c * p)])
                };
                ShapeCurve::Formula(length, Box::new(point))
            }
            Self::Arc { length, angle } => {
                let point = move |s: D| {
                    let half = angle * s / length * 0.5;
                    // The chord of an arc of half angle a is s sin(a)/a long and points along a.
                    let chord = s * sine_over(half);
                    [chord * half.cos(), chord * half.sin(), D::from(0.0)]
                };
                ShapeCurve::Formula(length, Box::new(point))
            }
            Self::Polyline { ref file, ref line, scale, .. } => {
                let line = line.as_deref().ok_or_else(|| {
                    let found = format!("{}, which has not been read", file.display());
                    Error::invalid(
                        "shape.file",
                        found,
                        "the shape of a loaded scene or of a \
                                    problem",
                    )
                })?;
                ShapeCurve::Points(line, scale)
            }
        })
    }
}

/// Shape as a function of arc length, or through points.
enum ShapeCurve<'a, D> {
    /// Length, m, and position, m, as a function of arc length.
    Formula(D, Box<dyn Fn(D) -> Vector<D>>),
    /// Curve through points, and a factor on their coordinates.
    Points(&'a Polyline, D),
}

/// The vector `v` rotated by the smallest rotation that takes -z to the unit vector `axis`. For an `axis` within 1e-14
/// of +z the rotation is by half a turn about x, then by the smallest one from +z.
fn to_axis<D: Scalar>(axis: Vector<D>, v: Vector<D>) -> Vector<D> {
    // The smallest rotation to the opposite direction is not unique, and its formula divides by zero.
    let (from, v) = match axis[2].value() > 1.0 - 1e-14 {
        true => ([0.0, 0.0, 1.0], [v[0], -v[1], -v[2]]),
        false => ([0.0, 0.0, -1.0], v),
    };
    let from = from.map(D::from);
    let about = cross(from, axis);
    let across = cross(about, v);
    add(add(v, across), scale(cross(about, across), (dot(from, axis) + 1.0).recip()))
}

/// `sin(x)/x`. For |x| up to 0.05 it is the power series to `x^10`, since the derivatives of the quotient do not exist
/// at 0.
fn sine_over<D: Scalar>(x: D) -> D {
    if x.value().abs() > 0.05 {
        return x.sin() / x;
    }
    let square = x * x;
    (1..=5).rev().fold(D::from(1.0), |sum, k| {
        let k = f64::from(2 * k);
        -(sum * square) * (1.0 / (k * (k + 1.0))) + 1.0
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn helix_nodes_follow_the_documented_formula() {
        let (radius, pitch) = (0.02, 0.05);
        let helix = Shape::Helix {
            length: 0.5,
            radius,
            pitch,
            axis: [0.0, 0.0, -1.0],
            handedness: Handedness::Left,
        };
        let mesh = helix.mesh(Some(50), [0.0, 0.0]).unwrap();
        // (R cos p, R sin p, -c p), as the schema has it.
        let c = pitch / TAU;
        for (node, s) in mesh.nodes.iter().zip(&mesh.arc_length) {
            let p = s / radius.hypot(c);
            assert_relative_eq!(node[0], radius * p.cos(), epsilon = 1e-15);
            assert_relative_eq!(node[1], radius * p.sin(), epsilon = 1e-15);
            assert_relative_eq!(node[2], -c * p, epsilon = 1e-15);
        }
    }

    #[test]
    fn wall_is_at_the_middle_of_the_outermost_edge() {
        let shape = Shape::Arc { length: 1.0, angle: 1.0 };
        let mesh = shape.mesh(Some(10), [0.5, 0.0]).unwrap();
        // Half an edge is behind the wall: 9.5 edges for the length of 1. The arc ends at (sin 1,
        // 1 - cos 1).
        let edge = 1.0 / 9.5;
        assert_relative_eq!(mesh.arc_length[0], -0.5 * edge);
        assert_relative_eq!(mesh.arc_length[10], 1.0, epsilon = 1e-15);
        assert_relative_eq!(mesh.nodes[10][0], 1.0_f64.sin(), epsilon = 1e-15);
        assert_relative_eq!(mesh.nodes[10][1], 1.0 - 1.0_f64.cos(), epsilon = 1e-15);
    }
}
