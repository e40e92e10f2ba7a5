//! Measured shapes of a rod at rest: positions of points with known arc lengths, of markers beside these, or of the
//! centerline without arc lengths.
//!
//! Input: a CSV file with arc lengths `s` or node indices, coordinates and offsets of markers (m), a CSV file of at
//! least [`LEAST_OF_A_LINE`] points in order along the centerline, or planned arc lengths. Output: [`RestShape`], a
//! data set. Its differences in a fit are simulated less observed coordinate, m, of each point of the rod in
//! equilibrium, as the camera records it. Without arc lengths they are the offset from each position to the foot of its
//! perpendicular on the simulated centerline, a cubic curve through the nodes. Files that cannot be read, points that
//! are not on the rod, and positions that are not finite are errors. In a structure the name of the rod and arc lengths
//! or nodes are required.
//!
//! `new` takes positions of points, `center_line` positions in order along the rod without arc lengths; `read` and
//! `read_as` read files, `planned` makes a plan. Unknown arc lengths are approximated by sums of chords
//! (`with_approximate_points`). `normal_offsets` are the signed distances, m, of the points of a centerline with two
//! coordinates from the simulated one, for statistics along the rod.

use crate::error::{Error, ensure};
use crate::fit::measurement::dataset::{Abscissa, DataKind, Dataset, Header, ValidationContext};
use crate::fit::measurement::quantity::GaugeScalar;
use crate::fit::measurement::shape_columns::{OFFSETS, OffsetColumns, PointColumn};
use crate::fit::measurement::simulated::{Requirements, SimulatedOutput};
use crate::fit::misfit::foot_point::NodeCurve;
use crate::fit::structure::structure_places::{check_place, check_rod, rest_position};
use crate::problem::Problem;
use crate::scene::marker::{MarkerStencil, is_beside};
use crate::scene::structure_point::{ArcLengthOfRod, RodEndName, RodPoint, StructurePoint};
use crate::scene::{Point, Stencil};
use marker_files::table::Table;
use marker_files::{Dropped, NOT_FINITE, Recording, is_finite};
use std::path::Path;

/// The observed position of a point of the rod at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShapePoint {
    /// The point of the rod.
    pub point: Point,
    /// World coordinates x, y and z, m; `None` where not observed.
    pub position: [Option<f64>; 3],
    /// Offset of a marker from the point, m: along the tangent and the first and second material director there.
    pub offset: [f64; 3],
}

/// Positions of points of a rod in equilibrium with the loads of its scene.
#[derive(Clone, Debug)]
pub struct EquilibriumShape {
    /// Observed positions with their points.
    pub sightings: Vec<ShapePoint>,
    /// Whether the arc lengths are unknown: each position is compared with the nearest point of the rod, and its own
    /// [`Point`] is an approximation.
    pub arc_lengths_fitted: bool,
    /// Name of the rod in a structure; `None` of a scene of one rod.
    pub rod: Option<String>,
}

/// A measured shape of the rod at rest with its header.
pub type RestShape = Dataset<EquilibriumShape>;

/// Smallest number of points of a centerline without arc lengths. Fewer do not determine its shape.
const LEAST_OF_A_LINE: usize = 3;

/// Euclidean distance between two positions, m, by the coordinates that both have; zero without any.
fn chord(a: [Option<f64>; 3], b: [Option<f64>; 3]) -> f64 {
    let parts = a.iter().zip(b).filter_map(|(a, b)| Some(((*a)? - b?).powi(2)));
    parts.sum::<f64>().sqrt()
}

impl ShapePoint {
    /// The observed `position`, m, of a point on the centerline.
    pub fn new(point: Point, position: [Option<f64>; 3]) -> Self {
        Self { point, position, offset: [0.0; 3] }
    }

    /// The sighting of a marker beside the point, at this [offset](Self::offset), m.
    ///
    /// ```
    /// use rodfit::Point;
    /// use rodfit::fit::ShapePoint;
    /// let flag = ShapePoint::new(Point::Tip, [Some(0.5), Some(0.02), None]).offset([0.0, 0.02, 0.0]);
    /// assert_eq!(flag.offset[1], 0.02); // m along the first director
    /// ```
    pub fn offset(self, offset: [f64; 3]) -> Self {
        Self { offset, ..self }
    }

    /// The arc length of the point from the wall, m; 0 for points that are given as a node or the tip, wherever they
    /// are.
    fn arc_length(&self) -> f64 {
        if let Point::ArcLength(s) = self.point { s } else { 0.0 }
    }
}

impl RestShape {
    /// A shape given by the observed positions of points of the rod at rest, with unknown noise and squared loss.
    ///
    /// ```
    /// use rodfit::Point;
    /// use rodfit::fit::{RestShape, ShapePoint};
    /// let sighting = |s: f64, y: f64| ShapePoint::new(Point::ArcLength(s), [None, Some(y), None]);
    /// let shape = RestShape::new(vec![sighting(0.2, -0.01), sighting(0.4, -0.04)]).sigma(1e-3); // m
    /// assert_eq!(shape.values(), 2);
    /// ```
    pub fn new(sightings: Vec<ShapePoint>) -> Self {
        let data = EquilibriumShape { sightings, arc_lengths_fitted: false, rod: None };
        Self { header: Header::in_meters(), data }
    }

    /// A shape of points of the centerline of a rod at rest in their order along the rod, x, y and z in m. Their arc
    /// lengths are unknown and are fitted. Sums of the chords between the points, from the first one on, are their
    /// first approximation.
    pub fn center_line(positions: &[[Option<f64>; 3]]) -> Self {
        let mut along = 0.0;
        let mut before: Option<[Option<f64>; 3]> = None;
        let sighting = |position: &[Option<f64>; 3]| {
            along += before.map_or(0.0, |before| chord(before, *position));
            before = Some(*position);
            ShapePoint::new(Point::ArcLength(along), *position)
        };
        let mut line = Self::new(positions.iter().map(sighting).collect());
        // Chords are shorter than arcs: these arc lengths only select the part of the rod to search.
        line.arc_lengths_fitted = true;
        line
    }

    /// A planned shape of points at the arc lengths `at` from the wall, m, in all three coordinates, with zeros as
    /// placeholders for the positions.
    pub fn planned(at: &[f64]) -> Self {
        let sighting = |s: &f64| ShapePoint::new(Point::ArcLength(*s), [Some(0.0); 3]);
        let mut planned = Self::new(at.iter().map(sighting).collect());
        planned.header.planned = true;
        planned
    }

    /// Reads a CSV file with the column `s` (arc length from the wall, m or in the unit of its header) or `node`
    /// (index), and at least one of x, y, z as in [`Recording`]s. The columns `offset_t`, `offset_d1` and `offset_d2`
    /// are the [offsets](ShapePoint::offset) of markers, zero where blank. Without `s` and `node` the rows are points
    /// of the [centerline](Self::center_line) in their order along the rod.
    ///
    /// # Errors
    ///
    /// A file that cannot be read, or a line of it that makes no sense, with its number.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, Error> {
        Self::read_as(path, &Recording::default())
    }

    /// Reads a CSV file of points of the rod with `s`, `node` or in order along the centerline, like
    /// [`read`](Self::read), converted by the scale, origin and axes of `recording`.
    ///
    /// # Errors
    ///
    /// Those of [`read`](Self::read).
    pub fn read_as(path: impl AsRef<Path>, recording: &Recording) -> Result<Self, Error> {
        Ok(Self::read_file(path.as_ref(), recording)?)
    }

    /// Reads a CSV file, with the scale, origin and axes of `recording`; the errors have the path and the line. Rows
    /// without coordinates (for centerlines: with fewer than two) are dropped and counted. An error for columns that
    /// are missing or unknown, a value that is not finite, no remaining row, and fewer than [`LEAST_OF_A_LINE`]
    /// remaining points of a centerline.
    fn read_file(path: &Path, recording: &Recording) -> Result<Self, marker_files::Error> {
        // Columns are checked before the rows, so that a wrong header has one error.
        let bytes = marker_files::file::data(path)?;
        let table = Table::of_columns(path, &bytes, recording.columns.as_ref())?;
        let known = [&["s", "node", "x", "y", "z"], &OFFSETS[..]].concat();
        recording.check_columns(&table, &known)?;
        let column = PointColumn::find(&table)?;
        let offsets = OffsetColumns::find(&table, column.is_some())?;
        // A point without arc length has an offset in two coordinates at least.
        let (known, fewest) = if column.is_some() { (&known[..], 1) } else { (&known[2..5], 2) };
        let axes = recording.axis_columns(&table)?;
        let sigma_columns = recording.sigma_columns(&table, &axes, known)?;
        let (mut sightings, mut sigmas) = (Vec::new(), Vec::new());
        let mut dropped = Dropped::default();
        for row in &table.rows {
            let point = column.as_ref().map(|own| own.point(&table, row)).transpose()?;
            let position = recording.position(&axes, &row.values);
            // Points of a centerline get their arc lengths below, from the chords of all rows.
            let point = point.unwrap_or(Point::ArcLength(0.0));
            let sighting = ShapePoint { point, position, offset: offsets.of_row(row) };
            if !is_finite(sighting.arc_length(), &position) {
                return Err(table.error(row.line, NOT_FINITE));
            }
            // A row with too few coordinates determines nothing.
            if position.iter().flatten().count() < fewest {
                dropped.empty += 1;
                continue;
            }
            if recording.sigma.is_some() {
                let observed = position.map(|x| x.is_some());
                sigmas.extend(
                    recording.row_sigma(&table, &sigma_columns, row, observed)?.iter().flatten(),
                );
            }
            sightings.push(sighting);
        }
        let shape = match column {
            Some(_) if sightings.is_empty() => {
                let message = "found no value below the header, allowed: at least one row with a \
                               value";
                return Err(table.error(1, message));
            }
            Some(_) => Self::new(sightings),
            None if sightings.len() < LEAST_OF_A_LINE => {
                let message = format!(
                    "found no column s or node and {} points, allowed: at least {LEAST_OF_A_LINE} \
                     points along the center line with two coordinates each, or a column s (arc length) or node (index)",
                    sightings.len()
                );
                return Err(table.error(1, &message));
            }
            None => {
                let positions: Vec<_> = sightings.iter().map(|s| s.position).collect();
                Self::center_line(&positions)
            }
        };
        let mut shape = shape.with_source(path, recording, dropped);
        shape.header.pixels = recording.pixel_axes(&axes);
        Ok(shape.sigmas(&sigmas))
    }
}

impl EquilibriumShape {
    /// Whether any observed marker is beside the centerline.
    pub(crate) fn is_beside(&self) -> bool {
        self.sightings.iter().any(|s| is_beside(s.offset))
    }

    /// The `point` on the rod of this shape as a point of a structure; `None` in a scene of one rod.
    pub(crate) fn place(&self, point: Point) -> Option<StructurePoint> {
        let at = match point {
            Point::Tip => RodPoint::End(RodEndName::Tip),
            Point::Node(node) => RodPoint::Node(node),
            Point::ArcLength(arc_length) => RodPoint::ArcLength(ArcLengthOfRod { arc_length }),
        };
        Some(StructurePoint::on_rod(self.rod.clone()?, at))
    }

    /// The observed positions with points of the rod, in their order. Unknown arc lengths are approximated: the
    /// distance of the first or last point, whichever is nearer to the wall, from the wall, plus the sum of the chords
    /// from this point on, at most the length of the rod. Known ones stay. The input must be the positions as given,
    /// without arc lengths from an earlier call.
    pub(crate) fn with_approximate_points(&self, problem: &Problem) -> Vec<ShapePoint> {
        if !self.arc_lengths_fitted {
            return self.sightings.clone();
        }
        let wall = problem.wall().map(Some);
        // Chords from the wall show at which end the list of points begins.
        let from_wall = |s: Option<&ShapePoint>| s.map_or(0.0, |s| chord(wall, s.position));
        let [first, last] = [self.sightings.first(), self.sightings.last()].map(from_wall);
        let whole = self.sightings.last().map_or(0.0, ShapePoint::arc_length);
        let approximate = |s: &ShapePoint| {
            let along = s.arc_length();
            let from_wall = if first <= last { first + along } else { last + whole - along };
            ShapePoint { point: Point::ArcLength(from_wall.min(problem.length())), ..*s }
        };
        self.sightings.iter().map(approximate).collect()
    }

    /// For each point of a centerline with exactly two observed coordinates per point: its approximate arc length, m,
    /// and its signed distance from the simulated line. `residuals` are those of the coordinates, point by point, whose
    /// unit the distances have. The distance is positive if the residual points to the left of the line through the
    /// neighboring observed points, in the order of the points and coordinates. Empty if any point has another number
    /// of coordinates, as in space, where offsets have no sign.
    pub(crate) fn normal_offsets(&self, problem: &Problem, residuals: &[f64]) -> Vec<[f64; 2]> {
        let in_plane = |s: &ShapePoint| -> Option<[f64; 2]> {
            let values: Vec<f64> = s.position.iter().flatten().copied().collect();
            values.try_into().ok()
        };
        let Some(points) = self.sightings.iter().map(in_plane).collect::<Option<Vec<_>>>() else {
            return Vec::new();
        };
        let sightings = self.with_approximate_points(problem);
        let pairs = sightings.iter().zip(residuals.chunks_exact(2)).enumerate();
        let offset = |(i, (sighting, r)): (usize, (&ShapePoint, &[f64]))| {
            let (before, after) = (i.saturating_sub(1), (i + 1).min(points.len() - 1));
            // The direction of the line at a point is that between its neighbors; it determines the sign of the offset.
            let tangent = [0, 1].map(|c| points[after][c] - points[before][c]);
            let side = tangent[0] * r[1] - tangent[1] * r[0];
            [sighting.arc_length(), side.signum() * r[0].hypot(r[1])]
        };
        pairs.map(offset).collect()
    }
}

impl DataKind for EquilibriumShape {
    /// Name of the table of this kind of data in a fit file: `shape`.
    fn table(&self) -> &'static str {
        "shape"
    }

    /// The path of the file of the shape; without a file `the shape at rest`.
    fn label(&self, header: &Header) -> String {
        match &header.source {
            Some(path) => path.display().to_string(),
            None => "the shape at rest".into(),
        }
    }

    /// The abscissa of plots: arc length.
    fn abscissa(&self) -> Abscissa {
        Abscissa::ArcLength
    }

    /// Arc length of every point from the wall, m, in their order; approximate if it is fitted, 0 for points that are
    /// not on the rod. In a structure it is 0 also for nodes and the tip.
    fn abscissas(&self, problem: &Problem) -> Vec<f64> {
        let arc_length = |s: ShapePoint| match self.rod {
            Some(_) => s.arc_length(),
            None => problem.arc_length(s.point).unwrap_or(0.0),
        };
        self.with_approximate_points(problem).into_iter().map(arc_length).collect()
    }

    /// The observed position of every point, m, in their order, with `None` for coordinates that were not observed.
    fn positions(&self) -> Vec<[Option<f64>; 3]> {
        self.sightings.iter().map(|s| s.position).collect()
    }

    /// Mutable references to the observed position of every point, m, in their order.
    fn positions_mut(&mut self) -> Vec<&mut [Option<f64>; 3]> {
        self.sightings.iter_mut().map(|s| &mut s.position).collect()
    }

    /// Number of fitted arc lengths: one per point if they are unknown, else zero.
    fn fitted_nuisances(&self) -> usize {
        if self.arc_lengths_fitted { self.sightings.len() } else { 0 }
    }

    /// Root mean square of the differences of the observed coordinates from those of the unloaded rod, m: the
    /// deflection; zero without any. Unknown arc lengths are approximated by chords. Points that are not on the rod are
    /// skipped.
    fn size(&self, problem: &Problem) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0_f64);
        for sighting in self.with_approximate_points(problem) {
            let place = self.place(sighting.point);
            // Positions along a rod differ by its length: their size is the deflection from the unloaded rod.
            let rest = match is_beside(sighting.offset) {
                true => problem.marker_at_rest(sighting.point, sighting.offset),
                false => rest_position(problem, sighting.point, place.as_ref()),
            };
            let Ok(rest) = rest else { continue };
            for (observed, rest) in sighting.position.iter().zip(rest) {
                if let Some(observed) = observed {
                    sum += (observed - rest).powi(2);
                    count += 1.0;
                }
            }
        }
        (sum / count.max(1.0)).sqrt()
    }

    /// Rejects points that are not on the rod (unless their arc lengths are fitted), and positions that are not finite.
    /// In a structure it rejects a missing name of the rod, unknown points, and shapes without arc lengths. Errors have
    /// the label or the key.
    fn check(&self, _header: &Header, context: &ValidationContext) -> Result<(), Error> {
        let ValidationContext { problem, label, key, .. } = context;
        if check_rod(problem, self.rod.as_deref(), key)? {
            let allowed = "a column s or node, in a structure";
            ensure(!self.arc_lengths_fitted, *label, "points without arc lengths", allowed)?;
            for sighting in &self.sightings {
                let place = self.place(sighting.point);
                check_place(problem, place.as_ref(), sighting.offset, key)?;
            }
            let are_finite = self.sightings.iter().all(|s| is_finite(0.0, &s.position));
            return ensure(are_finite, *label, "other positions", "finite positions");
        }
        // Approximate arc lengths may exceed the rod: the search for the foot points limits them.
        let given = self.sightings.iter().filter(|_| !self.arc_lengths_fitted);
        for (k, sighting) in given.enumerate() {
            problem.stencil(sighting.point).map_err(|error| {
                let allowed = "points of the rod. Check the unit in the header, as in s[mm]";
                Error::invalid(format!("{label}: point {}", k + 1), error, allowed)
            })?;
            // A marker farther from the rod than its length is most likely in another unit.
            let size = sighting.offset.iter().map(|x| x * x).sum::<f64>().sqrt();
            let found = format!("offset {:?}", sighting.offset);
            let allowed = format!("up to the rod's length, {} m", problem.length());
            ensure(size <= problem.length(), format!("{label}: point {}", k + 1), found, allowed)?;
        }
        let are_finite = self.sightings.iter().all(|s| is_finite(0.0, &s.position));
        ensure(are_finite, *label, "other positions", "finite positions")
    }

    /// Replaces unknown arc lengths by approximate ones from chords, in place. Shapes have no times to cut at a
    /// horizon.
    fn prepare(&mut self, problem: &Problem, _horizon: f64) {
        self.sightings = self.with_approximate_points(problem);
    }

    /// Adds the points to the required `outputs` at rest, and those with a marker beside them. For a structure they are
    /// added as points of its rod. If the arc lengths are unknown, all nodes at rest are required instead.
    fn require(&self, outputs: &mut Requirements) {
        match self.arc_lengths_fitted {
            _ if self.rod.is_some() => outputs
                .resting_places
                .extend(self.sightings.iter().filter_map(|s| self.place(s.point))),
            true => outputs.whole_rest = true,
            false => {
                let beside = self.sightings.iter().filter(|s| is_beside(s.offset));
                outputs.beside_at_rest.extend(beside.map(|s| s.point));
                outputs.resting.extend(self.sightings.iter().map(|s| s.point));
            }
        }
    }

    /// Calls `each` with simulated less observed coordinate, m, point by point, observed coordinates only. For unknown
    /// arc lengths these are the coordinates of the vector from the observed point to the foot of its perpendicular on
    /// the cubic curve through the simulated nodes (`NodeCurve`). Positions are those that the camera records. Nothing
    /// without a simulated equilibrium. An error for a point that is not on the rod.
    fn differences<D: GaugeScalar>(
        &self,
        simulated: &SimulatedOutput<D>,
        each: &mut dyn FnMut(D),
    ) -> Result<(), Error> {
        let Some(resting) = simulated.resting else { return Ok(()) };
        // Points with arc lengths are compared coordinate by coordinate, others by their offset from the nearest point.
        let (mesh, start) = (simulated.mesh, D::from(0.0));
        if !self.arc_lengths_fitted {
            for ShapePoint { point, position, offset } in &self.sightings {
                let simulated_position = match (self.place(*point), simulated.structure) {
                    (Some(place), Some(nodes)) => {
                        resting.position(&nodes.stencil(&place, "shape.rod")?, start)?
                    }
                    _ => {
                        resting.marker(&MarkerStencil::new(point.fixed(), *offset, mesh)?, start)?
                    }
                };
                simulated.compare(simulated_position, position, each);
            }
            return Ok(());
        }
        let node = |i: usize| resting.position(&Stencil::node(i), start);
        let nodes = (0..mesh.nodes.len()).map(|i| Ok(simulated.view.recorded(node(i)?)));
        let nodes = nodes.collect::<Result<Vec<_>, Error>>()?;
        // The curve through the recorded nodes has the foot point of every observed point.
        let curve = NodeCurve { nodes: &nodes, arc_length: &mesh.arc_length };
        for sighting in &self.sightings {
            let observed = simulated.view.undistorted(&sighting.position);
            let offset = curve.offset(&observed, sighting.arc_length());
            let offset = simulated.view.distorted_difference(offset, &sighting.position);
            (0..3).filter(|c| sighting.position[*c].is_some()).for_each(|c| each(offset[c]));
        }
        Ok(())
    }
}
