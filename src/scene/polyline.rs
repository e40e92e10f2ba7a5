//! Shapes of the rod as smooth curves through points of a file or of the scene.
//!
//! [`Polyline::read`] reads the points from columns x, y, z of a file (m, or the unit of their header),
//! [`Polyline::through`] takes those of the scene, m. The file of an initial shape (`on_a_rod`) may also have s, the
//! arc length of each point on the rod at rest; in that of a rest shape s is an error. Without s the arc lengths start
//! at 0 and increase by those of circles through neighboring points. Between points the position is the cubic in arc
//! length through four points, two on either side (at the ends the outermost four); three points have a parabola.
//!
//! - [`Polyline::with_lengths`] gives the edges between the points other lengths, m, with the same directions; not for
//!   a curve with s.
//! - [`Polyline::mesh`] is the mesh of a rest shape. Given fractions of the first and last edge are behind walls.
//! - [`Polyline::nodes_of`] are the positions, m, of the nodes of a rod in an initial shape: at their arc lengths if s
//!   is given, else at the same fractions of the length as at rest.
//!
//! Rejected are fewer than three points, a point that equals the one before, and arc lengths that do not increase or do
//! not cover the rod. If any node is not at a point, a curve with a corner above `SHARPEST` degrees is rejected.

use crate::error::Error;
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::{Vector, add};
use crate::scene::mesh::{Mesh, angle};
use marker_files::table::{LENGTHS, Table};
use nalgebra::Vector3;
use std::path::{Path, PathBuf};

/// Curve through points from the wall, or the first end of the rod, to the last: at each arc length the cubic through
/// the four nearest points.
#[derive(Clone, Debug, PartialEq)]
pub struct Polyline {
    points: Vec<Vector3<f64>>,
    /// Arc length of every point, m.
    arc_length: Vec<f64>,
    /// Whether the file gives the arc lengths; otherwise they are those of the curve.
    given: bool,
    /// Given lengths of the edges, m; empty without any.
    lengths: Vec<f64>,
    source: PointSource,
}

/// Origin of the points, for error messages.
#[derive(Clone, Debug, PartialEq)]
enum PointSource {
    /// File, with the line number of every point.
    File(PathBuf, Vec<u64>),
    /// Key of the scene.
    Scene(&'static str),
}

impl PointSource {
    /// The error at point `i` with the found and the allowed value. It has the file and the line of the point (line 1
    /// if there is no point `i`), or the key of the scene with the index in brackets.
    fn error(&self, i: usize, found: &str, allowed: &str) -> Error {
        match self {
            Self::File(path, lines) => Error::Data {
                path: path.clone(),
                line: lines.get(i).copied().unwrap_or(1),
                message: format!("{found}, allowed: {allowed}"),
            },
            Self::Scene(key) => Error::invalid(format!("{key}[{i}]"), found, allowed),
        }
    }
}

/// Largest turning angle at a point, degrees, at which nodes between the points follow the curve.
const SHARPEST: f64 = 90.0;

/// Distance of a node from a point, as a fraction of the length, at which both are the same.
const AT_POINT: f64 = 1e-9;

/// Part of the rod, as a fraction of its length, that given arc lengths need not cover at either end.
const UNCOVERED: f64 = 1e-6;

/// Half turning angle, rad, below which an arc equals its chord to rounding.
const STRAIGHT: f64 = 1e-9;

impl Polyline {
    /// Reads the columns x, y, z of a file, in m or in the unit of their header. For an initial shape (`on_a_rod`) it
    /// also reads a column s, if there is one: the arc length of each point on the rod at rest, m or in its unit.
    /// Errors are a file that cannot be read, a missing column x, y or z, an unknown unit, and blanks. So are a column
    /// s of a rest shape, arc lengths that do not increase, fewer than three points, and a point that equals the one
    /// before.
    pub fn read(path: &Path, on_a_rod: bool) -> Result<Self, Error> {
        let table = Table::read(path)?;
        let column = |name: &str| {
            let column = table.require(name)?;
            Ok::<_, Error>((column, table.factor(column, &LENGTHS, "")?))
        };
        // Positions in m, whatever the unit of their header.
        let columns = [column("x")?, column("y")?, column("z")?];
        let place = table.find("s").map(|_| column("s")).transpose()?;
        if place.is_some() && !on_a_rod {
            let message = "found the column `s`, allowed: in the file of initial.shape only, \
                           where it is the arc length of a row";
            return Err(table.error(1, message).into());
        }
        let mut points: Vec<Vector3<f64>> = Vec::with_capacity(table.rows.len());
        let mut arc_length: Vec<f64> = Vec::new();
        for row in &table.rows {
            let value =
                |(column, factor): (usize, f64)| row.values[column].map(|value| value * factor);
            let blank = || table.error(row.line, "found a blank, allowed: a length");
            let mut point = Vector3::zeros();
            for (c, column) in columns.iter().enumerate() {
                point[c] = value(*column).ok_or_else(blank)?;
            }
            points.push(point);
            // Arc lengths of an initial shape must increase, because nodes are found by
            // bisection.
            if let Some(place) = place {
                let s = value(place).ok_or_else(blank)?;
                if let Some(before) = arc_length.last().filter(|before| **before >= s) {
                    let message = format!(
                        "found s = {s} m after {before} m, allowed: increasing \
                                           values"
                    );
                    return Err(table.error(row.line, &message).into());
                }
                arc_length.push(s);
            }
        }
        let lines = table.rows.iter().map(|row| row.line).collect();
        Self::new(points, arc_length, PointSource::File(path.into(), lines))
    }

    /// The curve through points of the scene, m. `on_a_rod` is true for an initial shape, and only selects the key in
    /// errors. Errors are numbers that are not finite, fewer than three points, and a point that equals the one before.
    pub fn through(points: &[[f64; 3]], on_a_rod: bool) -> Result<Self, Error> {
        let source =
            PointSource::Scene(if on_a_rod { "initial.shape.points" } else { "rod.shape.points" });
        let finite = |point: &[f64; 3]| point.iter().all(|x| x.is_finite());
        if let Some(i) = points.iter().position(|point| !finite(point)) {
            return Err(source.error(i, &format!("{:?}", points[i]), "finite numbers, m"));
        }
        Self::new(points.iter().map(|point| (*point).into()).collect(), Vec::new(), source)
    }

    /// The curve through `points`, m, at the given arc lengths, m, one for each point. For an empty list they start at
    /// 0, and increase by the arcs of circles through neighbors. Rejects fewer than three points, and a point that
    /// equals the one before.
    fn new(
        points: Vec<Vector3<f64>>,
        mut arc_length: Vec<f64>,
        source: PointSource,
    ) -> Result<Self, Error> {
        if let Some(i) = points.windows(2).position(|pair| pair[0] == pair[1]) {
            let found = "the same point as before";
            return Err(source.error(
                i + 1,
                found,
                "a different point, as the length of an edge is \
                                                   above 0",
            ));
        }
        // Three points are the least that determine a curvature.
        if points.len() < 3 {
            let found = format!("{} points", points.len());
            return Err(match &source {
                PointSource::File(..) => source.error(usize::MAX, &found, "at least 3"),
                PointSource::Scene(key) => Error::invalid(*key, found, "at least 3"),
            });
        }
        // Without given arc lengths those of the curve, estimated from circles through neighbors.
        let given = !arc_length.is_empty();
        if !given {
            arc_length.push(0.0);
            arc_length.extend(arcs(&points).iter().scan(0.0, |sum, arc| {
                *sum += arc;
                Some(*sum)
            }));
        }
        Ok(Self { points, arc_length, given, lengths: Vec::new(), source })
    }

    /// The curve with new points: from the first point on, each edge between neighboring points keeps its direction and
    /// gets its entry of `lengths`, m, as its length. Unchanged for an empty list. Rejects a list of another number
    /// than that of the edges, lengths that are not positive, and a curve with given arc lengths.
    pub fn with_lengths(self, lengths: &[f64]) -> Result<Self, Error> {
        let edges = self.points.len() - 1;
        if lengths.is_empty() {
            return Ok(self);
        }
        let positive = |length: &f64| length.is_finite() && *length > 0.0;
        if self.given || lengths.len() != edges || !lengths.iter().all(positive) {
            let found = format!("{} numbers for {} points", lengths.len(), edges + 1);
            let allowed = format!("{edges} lengths above 0, in a rest shape");
            return Err(Error::invalid("shape.lengths", found, allowed));
        }
        let mut points = vec![self.points[0]];
        for (pair, length) in self.points.windows(2).zip(lengths) {
            // Directions of the points, lengths of the list: laid end to end.
            points.push(points[points.len() - 1] + (pair[1] - pair[0]).normalize() * *length);
        }
        let line = Self::new(points, Vec::new(), self.source)?;
        Ok(Self { lengths: lengths.to_vec(), ..line })
    }

    /// The lengths of the edges that [`with_lengths`](Self::with_lengths) set, m; empty without any.
    pub fn lengths(&self) -> &[f64] {
        &self.lengths
    }

    /// The file from which the points were read; none for points of the scene.
    pub fn path(&self) -> Option<&Path> {
        match &self.source {
            PointSource::File(path, _) => Some(path),
            PointSource::Scene(_) => None,
        }
    }

    /// Whether it was made of exactly these points of the scene, m, and not read from a file.
    pub fn is_through(&self, points: &[[f64; 3]]) -> bool {
        let own = self.points.iter().map(|point| <[f64; 3]>::from(*point));
        self.path().is_none() && own.eq(points.iter().copied())
    }

    /// Arc length of the last point, m: the length of the whole curve, or, of given arc lengths, the last one.
    pub(super) fn length(&self) -> f64 {
        self.arc_length[self.points.len() - 1]
    }

    /// Position, m, at arc length `s`, m, by Lagrange interpolation through two points on either side: at the ends
    /// through the outermost four, or through all of three. Beyond the ends it is extrapolated.
    fn at<D: Scalar>(&self, s: D) -> Vector<D> {
        let own = &self.arc_length;
        let count = own.len().min(4);
        // Lagrange interpolation through the four nearest points.
        let right = own.partition_point(|x| *x <= s.value());
        let first = right.saturating_sub(2).min(own.len() - count);
        let near = first..first + count;
        near.clone().fold([D::from(0.0); 3], |sum, i| {
            let others = near.clone().filter(|j| *j != i);
            let weight = others.fold(D::from(1.0), |product, j| {
                product * ((s - own[j]) / D::from(own[i] - own[j]))
            });
            let point: [f64; 3] = self.points[i].into();
            add(sum, point.map(|x| weight * x))
        })
    }

    /// Positions of the curve, m, at the arc lengths `places`, m. If at least one place is not at a point (within
    /// [`AT_POINT`] of the length), a curve that turns at any point by more than [`SHARPEST`] degrees is rejected.
    fn positions<D: Scalar>(&self, places: &[D]) -> Result<Vec<Vector<D>>, Error> {
        let between = |s: &&D| {
            let s = s.value();
            let i = self.arc_length.partition_point(|x| *x < s);
            let near = [i.checked_sub(1), Some(i)].into_iter().flatten();
            let mut near = near.filter_map(|i| self.arc_length.get(i));
            near.all(|x| (x - s).abs() > AT_POINT * self.length())
        };
        if places.iter().find(between).is_some() {
            let turn = |p: &[Vector3<f64>]| angle(&(p[1] - p[0]), &(p[2] - p[1])).to_degrees();
            let mut turns = self.points.windows(3).map(turn).enumerate();
            if let Some((i, turn)) = turns.find(|(_, turn)| *turn > SHARPEST) {
                let found = format!("the line turns by {turn:.0} degrees here");
                let allowed = format!(
                    "up to {SHARPEST} degrees if nodes are between the points, as with a wall in \
                     the middle of an edge. Give more points of a smooth curve"
                );
                return Err(self.source.error(i + 1, &found, &allowed));
            }
        }
        Ok(places.iter().map(|s| self.at(*s)).collect())
    }

    /// Mesh of `segments` edges, by default as many as between the points. `before` and `after` are the fractions of
    /// the first and last edge behind a wall; the walls are at the first and last point. Nodes are evenly spaced in the
    /// index of the points, and linear in arc length between two of them; without walls and with the default number
    /// they are the points. Nodes behind a wall are extrapolated, with arc lengths that mirror the spacing before the
    /// end. Rejects a corner above 90 degrees (`SHARPEST`) if a node is not at a point.
    pub fn mesh(&self, segments: Option<usize>, [before, after]: [f64; 2]) -> Result<Mesh, Error> {
        let (spans, length) = (self.points.len() - 1, self.length());
        let segments = segments.unwrap_or(spans);
        // Edges behind a wall count in part only: nodes are shifted along the curve.
        let stride = spans as f64 / (segments as f64 - before - after);
        // Places are counted in points; those beyond an end mirror those before it.
        let place = |i: usize| {
            let u = (i as f64 - before) * stride;
            if u < 0.0 {
                -self.arc_length_at(-u)
            } else if u > spans as f64 {
                2.0 * length - self.arc_length_at(2.0 * spans as f64 - u)
            } else {
                self.arc_length_at(u)
            }
        };
        let arc_length: Vec<f64> = (0..=segments).map(place).collect();
        let nodes = self.positions(&arc_length)?;
        let points: Vec<Vector3<f64>> = nodes.iter().map(|x| (*x).into()).collect();
        Ok(Mesh { nodes, arc_length, length, arcs: arcs(&points), named: None })
    }

    /// Arc length, m, at the place `u` in units of points, counted from 0: 1.5 is halfway in arc length from the second
    /// point to the third.
    fn arc_length_at(&self, u: f64) -> f64 {
        let i = (u as usize).min(self.points.len() - 2);
        let [a, b] = [self.arc_length[i], self.arc_length[i + 1]];
        a + (u - i as f64) * (b - a)
    }

    /// Positions, m, of the nodes of a rod with the rest mesh `rest` in this shape. They are at their arc lengths, if
    /// the file gives those of the points. Otherwise they are at the same fractions of the length as at rest. Nodes
    /// behind walls are extrapolated. Rejects given arc lengths that leave more than 1e-6 of the rod (`UNCOVERED`)
    /// uncovered at an end, and a corner above 90 degrees (`SHARPEST`) if a node is not at a point.
    pub fn nodes_of<D: Scalar>(&self, rest: &Mesh<D>) -> Result<Vec<Vector<D>>, Error> {
        // A shape without arc lengths is stretched to the rod: the same fractions of the length.
        if !self.given {
            let stretch = rest.length.recip() * self.length();
            let places: Vec<D> = rest.arc_length.iter().map(|s| *s * stretch).collect();
            return self.positions(&places);
        }
        let length = rest.length.value();
        let (first, last, near) = (self.arc_length[0], self.length(), UNCOVERED * length);
        if first > near || last < length - near {
            let file = self.path().unwrap_or(Path::new("")).display();
            let found = format!("{file}: s from {first} to {last} m");
            let allowed = format!("from 0 (the wall) or before to {length} m or beyond");
            return Err(Error::invalid("initial.shape.file", found, allowed));
        }
        self.positions(&rest.arc_length)
    }
}

/// Arc length over every edge of a polygon inscribed in a smooth curve, m: `l h/sin(h)` for an edge of length `l`. Half
/// the angle by which the curve turns over an edge is `h`. It is half the mean turning angle at the two ends of the
/// edge, or half that at the inner end of an outermost edge. For `h` below [`STRAIGHT`] rad the arc length is `l`.
fn arcs(points: &[Vector3<f64>]) -> Vec<f64> {
    let edges: Vec<Vector3<f64>> = points.windows(2).map(|p| p[1] - p[0]).collect();
    let turns: Vec<f64> = edges.windows(2).map(|e| angle(&e[0], &e[1])).collect();
    let arc = |(j, edge): (usize, &Vector3<f64>)| {
        let before = j.checked_sub(1).and_then(|i| turns.get(i));
        let sides = [before, turns.get(j)].into_iter().flatten();
        let half = 0.5 * sides.clone().sum::<f64>() / sides.count().max(1) as f64;
        if half < STRAIGHT { edge.norm() } else { edge.norm() * half / half.sin() }
    };
    edges.iter().enumerate().map(arc).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;
    use crate::scene::initial::{Initial, InitialState};
    use crate::scene::material::Material;
    use crate::scene::section::Section;
    use crate::scene::shape::{Handedness, Shape};
    use crate::scene::support::Support;
    use crate::scene::time::Time;
    use std::fmt::Write;

    /// Points of a shape at parts of its length, as a file of the folder.
    fn points_of(shape: &Shape, parts: &[f64], folder: &Path) -> Shape {
        let fine = shape.mesh(Some(1), [0.0; 2]).unwrap();
        let rest = Mesh { arc_length: parts.iter().map(|p| p * fine.length).collect(), ..fine };
        let mut text = "x,y,z\n".to_string();
        for [x, y, z] in shape.nodes_of(&rest).unwrap() {
            writeln!(text, "{x:e},{y:e},{z:e}").unwrap();
        }
        std::fs::write(folder.join("points.csv"), text).unwrap();
        let mut line = Shape::polyline("points.csv");
        line.read(folder, false).unwrap();
        line
    }

    /// Fractions of the length of equal parts.
    fn equal(spans: usize) -> Vec<f64> {
        (0..=spans).map(|i| i as f64 / spans as f64).collect()
    }

    /// A straight line, an arc and a helix.
    fn shapes() -> [Shape; 3] {
        let axis = [0.3, -0.2, 1.0];
        let handedness = Handedness::Right;
        [
            Shape::Straight { length: 0.5, direction: [1.0, 2.0, -0.3] },
            Shape::Arc { length: 0.5, angle: 2.0 },
            Shape::Helix { length: 0.5, radius: 0.05, pitch: 0.1, axis, handedness },
        ]
    }

    /// However the ends are held and however fine the mesh, points of a shape make its mesh; with
    /// as many nodes as points to fourth order in their distance.
    #[test]
    fn mesh_through_points_of_a_shape_equals_its_mesh() {
        let folder = tempfile::tempdir().unwrap();
        for shape in shapes() {
            for cut in [[0.0, 0.0], [0.5, 0.0], [0.0, 0.5], [0.5, 0.5]] {
                for segments in [None, Some(80), Some(13)] {
                    let error = |spans: usize| {
                        let line = points_of(&shape, &equal(spans), folder.path());
                        let found = line.mesh(segments, cut).unwrap();
                        let wanted = Some(segments.unwrap_or(spans));
                        let exact = shape.mesh(wanted, cut).unwrap();
                        assert_eq!(found.nodes.len(), exact.nodes.len());
                        let pairs = found.nodes.iter().zip(&exact.nodes);
                        let off = |(a, b): (&[f64; 3], &[f64; 3])| {
                            (Vector3::from(*a) - Vector3::from(*b)).norm()
                        };
                        let places = found.arc_length.iter().zip(&exact.arc_length);
                        let places = places.map(|(a, b)| (a - b).abs());
                        let length = (found.length - exact.length).abs();
                        pairs.map(off).chain(places).fold(length, f64::max) / exact.length
                    };
                    let [coarse, fine] = [40, 80].map(error);
                    println!("{cut:?} {segments:?}: {coarse:.1e}, {fine:.1e}");
                    let order = if segments.is_none() { 3.5 } else { 1.0 };
                    let allowed = (coarse * 0.5_f64.powf(order)).max(2e-14);
                    assert!(coarse < 2e-3 && fine < allowed, "{coarse} {fine}");
                }
            }
        }
    }

    /// Edges get the lengths they are given, along the line's own directions.
    #[test]
    fn given_lengths_become_lengths_of_edges() {
        let points = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.1, 0.2, 0.0], [0.1, 0.2, 0.3]];
        let mut shape = Shape::points(points);
        let Shape::Polyline { lengths, .. } = &mut shape else { unreachable!() };
        *lengths = vec![0.3, 0.1, 0.2];
        shape.read(Path::new(""), false).unwrap();
        let mesh = shape.mesh(None, [0.0; 2]).unwrap();
        let wanted = [[0.0, 0.0, 0.0], [0.3, 0.0, 0.0], [0.3, 0.1, 0.0], [0.3, 0.1, 0.2]];
        let off = mesh.nodes.iter().flatten().zip(wanted.iter().flatten());
        assert!(off.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) < 1e-15);
        let Shape::Polyline { lengths, .. } = &mut shape else { unreachable!() };
        *lengths = vec![0.3, 0.1];
        let refused = shape.read(Path::new(""), false).unwrap_err().to_string();
        assert!(refused.contains("3 lengths above 0"), "{refused}");
    }

    /// Where no wall cuts an edge the points are the nodes, to the last digit.
    #[test]
    fn nodes_without_a_wall_equal_the_points() {
        let folder = tempfile::tempdir().unwrap();
        let parts = [0.0, 0.03, 0.2, 0.25, 0.5, 0.6, 1.0];
        let line = points_of(&shapes()[2], &parts, folder.path());
        let points = Polyline::read(&folder.path().join("points.csv"), false).unwrap().points;
        let mesh = line.mesh(None, [0.0; 2]).unwrap();
        let points: Vec<[f64; 3]> = points.into_iter().map(Into::into).collect();
        assert_eq!(mesh.nodes, points);
    }

    /// A wall stands at the first point and at the last, in the middle of an edge, whatever the
    /// distances of the points.
    #[test]
    fn walls_are_at_the_outermost_points() {
        let folder = tempfile::tempdir().unwrap();
        let parts = [0.0, 0.03, 0.1, 0.2, 0.3, 0.45, 0.6, 0.8, 0.9, 1.0];
        let [straight, arc, _] = shapes();
        for (shape, near) in [(straight, 1e-14), (arc, 4e-3)] {
            let line = points_of(&shape, &parts, folder.path());
            let mesh = line.mesh(None, [0.5, 0.5]).unwrap();
            let nodes: Vec<Vector3<f64>> = mesh.nodes.iter().map(|x| (*x).into()).collect();
            let ends = shape.mesh(Some(1), [0.0; 2]).unwrap().nodes;
            for (pair, s, end) in [(0, 0.0, ends[0]), (8, mesh.length, ends[1])] {
                let middle = (nodes[pair] + nodes[pair + 1]) / 2.0;
                let off = (middle - Vector3::from(end)).norm() / mesh.length;
                assert!(off <= near, "{off}");
                let at = (mesh.arc_length[pair] + mesh.arc_length[pair + 1]) / 2.0;
                assert!((at - s).abs() < 1e-15, "{at} {s}");
            }
        }
    }

    /// Scene of a rod in this shape under its weight, saved in `folder`.
    fn scene(shape: Shape, folder: &Path) -> Scene {
        let material = Material { poisson_ratio: Some(0.3), ..Material::new(1200.0, 1e9) };
        let mut scene = Scene::new(40, shape, Section::Circle { radius: 0.003 }, material);
        scene.loads.gravity = [0.0, -9.8, 0.0];
        scene.time = Some(Time::new(0.05, 1e-3));
        scene.path = Some(folder.join("scene.toml"));
        scene
    }

    /// Rods whose shape is given by points hang and swing as those whose shape is given by name,
    /// clamped at one end and at both.
    #[test]
    fn rod_through_points_moves_as_its_shape() {
        let folder = tempfile::tempdir().unwrap();
        for shape in shapes() {
            for end in [Support::Free, Support::Clamped] {
                let mut named = scene(shape.clone(), folder.path());
                named.supports.end = end;
                let mut given = named.clone();
                given.rod.shape = points_of(&shape, &equal(40), folder.path());
                given.rod.segments = None;
                let middle = |scene: &Scene| {
                    let problem = scene.problem().unwrap();
                    let rest = problem.equilibrium().unwrap().nodes[20];
                    let run = problem.simulate().unwrap();
                    let moved = run.node(20, 50);
                    [rest, moved].map(Vector3::from)
                };
                let [a, b] = [middle(&named), middle(&given)];
                let from = Vector3::from(named.problem().unwrap().equilibrium().unwrap().nodes[0]);
                for k in 0..2 {
                    let off = (a[k] - b[k]).norm() / (a[k] - from).norm();
                    println!("{end:?} {k}: {off:.1e}");
                    assert!(off < 1e-4, "{shape:?} {end:?}: {off}");
                }
            }
        }
    }

    /// A rod that starts in a shape given by any number of points starts as in the shape itself;
    /// and one that starts where it hangs, as `rodfit static` writes it, stays there.
    #[test]
    fn rod_starts_in_a_shape_of_points() {
        let folder = tempfile::tempdir().unwrap();
        let [straight, arc, _] = shapes();
        let mut named = scene(straight, folder.path());
        named.rod.shape = Shape::Straight { length: 0.5, direction: [1.0, 0.0, 0.0] };
        // So small that no step is taken in halves, which two runs would not do at the same times.
        named.time = Some(Time::new(0.05, 1e-4));
        let starting = |shape: Shape| {
            let (state, shape) = (InitialState::Shape, Some(shape));
            Scene { initial: Initial { state, shape, ..Initial::default() }, ..named.clone() }
        };
        let tips = |scene: &Scene| {
            let run = scene.problem().unwrap().simulate().unwrap();
            [0, 500].map(|k| Vector3::from(run.tip(k)))
        };
        let exact = tips(&starting(arc.clone()));
        for (spans, near) in [(60, 1e-5), (40, 2e-5), (23, 1e-4)] {
            let found = tips(&starting(points_of(&arc, &equal(spans), folder.path())));
            for k in 0..2 {
                let off = (found[k] - exact[k]).norm();
                println!("{spans} {k}: {off:.1e} m");
                assert!(off < near, "{spans}: {off}");
            }
        }
        let problem = named.problem().unwrap();
        let nodes = problem.equilibrium().unwrap().nodes;
        let csv = crate::dynamics::shape_csv(&problem, &nodes).unwrap();
        std::fs::write(folder.path().join("points.csv"), csv).unwrap();
        let hung = tips(&starting(Shape::polyline("points.csv")));
        for tip in hung {
            let off = (tip - Vector3::from(nodes[40])).norm();
            assert!(off < 1e-10, "{off}");
        }
    }
}
