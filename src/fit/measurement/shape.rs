//! Shapes of a rod at rest: positions of its points, or of its center line.

use crate::error::Error;
use crate::fit::measurement::dataset::{Abscissa, DataKind, Dataset, Header, Subject};
use crate::fit::measurement::quantity::Shown;
use crate::fit::measurement::simulated::{Requirements, Simulated};
use crate::fit::misfit::foot_point::Curve;
use crate::problem::Problem;
use crate::scene::{Point, Stencil};
use marker_files::table::{LENGTHS, Table, TableRow};
use marker_files::{Dropped, NOT_FINITE, Recording, is_finite};
use std::path::Path;

/// Where a point of the rod at rest was seen. World coordinates, m; a coordinate that was not seen
/// is `None`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sighting {
    /// The point of the rod.
    pub point: Point,
    /// Where it was seen: x, y, z in m.
    pub position: [Option<f64>; 3],
}

/// Positions of points of a rod at rest under the scene's loads: its equilibrium, whatever its motion.
#[derive(Clone, Debug)]
pub struct EquilibriumShape {
    /// Where points of the rod were seen.
    pub sightings: Vec<Sighting>,
    /// Whether the points have no given arc length: each is compared with the nearest point of the rod, and its own
    /// [`Point`] is only about where it is.
    pub arc_lengths_fitted: bool,
}

/// A measured shape of the rod at rest.
pub type RestShape = Dataset<EquilibriumShape>;

/// Fewest points of a center line without arc lengths: fewer do not show its order and shape.
const LEAST_OF_A_LINE: usize = 3;

/// Distance in the coordinates that both have, m.
fn chord(a: [Option<f64>; 3], b: [Option<f64>; 3]) -> f64 {
    let parts = a.iter().zip(b).filter_map(|(a, b)| Some(((*a)? - b?).powi(2)));
    parts.sum::<f64>().sqrt()
}

impl RestShape {
    /// Sightings of a rod at rest.
    pub fn new(sightings: Vec<Sighting>) -> Self {
        let data = EquilibriumShape { sightings, arc_lengths_fitted: false };
        Self { header: Header::of_lengths(), data }
    }

    /// Points of the center line of a rod at rest, in their order along the rod, whose arc lengths are not known: x, y, z
    /// in m.
    pub fn center_line(positions: &[[Option<f64>; 3]]) -> Self {
        let mut along = 0.0;
        let mut before: Option<[Option<f64>; 3]> = None;
        let sighting = |position: &[Option<f64>; 3]| {
            along += before.map_or(0.0, |before| chord(before, *position));
            before = Some(*position);
            Sighting { point: Point::ArcLength(along), position: *position }
        };
        let mut line = Self::new(positions.iter().map(sighting).collect());
        line.arc_lengths_fitted = true;
        line
    }

    /// A photograph that is only planned, of points at these arc lengths from the wall, m, in all three coordinates.
    pub fn planned(at: &[f64]) -> Self {
        let sighting = |s: &f64| Sighting { point: Point::ArcLength(*s), position: [Some(0.0); 3] };
        let mut planned = Self::new(at.iter().map(sighting).collect());
        planned.header.planned = true;
        planned
    }

    /// Reads a CSV file with the column `s` (arc length from the wall, m or in the unit of its
    /// header) or `node` (index), and at least one of x, y, z as in [`Recording`]s. Without `s` and `node` the rows are
    /// points of the [center line](Self::center_line) in their order along the rod.
    ///
    /// # Errors
    ///
    /// A file that cannot be read, or a line of it that makes no sense, with its number.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, Error> {
        Self::read_as(path, &Recording::default())
    }

    /// The same with the scale, origin and axes of `recording`.
    ///
    /// # Errors
    ///
    /// Those of [`read`](Self::read).
    pub fn read_as(path: impl AsRef<Path>, recording: &Recording) -> Result<Self, Error> {
        Ok(Self::read_file(path.as_ref(), recording)?)
    }

    fn read_file(path: &Path, recording: &Recording) -> Result<Self, marker_files::Error> {
        let table = Table::read(path)?;
        let known = ["s", "node", "x", "y", "z"];
        recording.check_columns(&table, &known)?;
        let point = PointColumn::find(&table)?;
        // Points without arc lengths need a direction.
        let (known, fewest) = if point.is_some() { (&known[..], 1) } else { (&known[2..], 2) };
        let axes = recording.axis_columns(&table)?;
        let sigma_columns = recording.sigma_columns(&table, &axes, known)?;
        let (mut points, mut positions, mut sigmas) = (Vec::new(), Vec::new(), Vec::new());
        let mut dropped = Dropped::default();
        for row in &table.rows {
            let point = point.as_ref().map(|own| own.point(&table, row)).transpose()?;
            let position = recording.position(&axes, &row.values);
            let place = match point {
                Some(Point::ArcLength(s)) => s,
                _ => 0.0,
            };
            if !is_finite(place, &position) {
                return Err(table.error(row.line, NOT_FINITE));
            }
            if position.iter().flatten().count() < fewest {
                dropped.empty += 1;
                continue;
            }
            if recording.sigma.is_some() {
                let seen = position.map(|x| x.is_some());
                sigmas.extend(
                    recording.row_sigma(&table, &sigma_columns, row, seen)?.iter().flatten(),
                );
            }
            points.extend(point);
            positions.push(position);
        }
        let shape = match point {
            Some(_) if positions.is_empty() => {
                let message = "no value below the header, allowed: one row with a value at least";
                return Err(table.error(1, message));
            }
            Some(_) => {
                let pairs = points.into_iter().zip(positions);
                Self::new(pairs.map(|(point, position)| Sighting { point, position }).collect())
            }
            None if positions.len() < LEAST_OF_A_LINE => {
                let message = format!(
                    "no column s or node, and {} points, allowed: {LEAST_OF_A_LINE} or more points along the center line, \
                     with two coordinates each, or a column s (arc length) or node (index)",
                    positions.len()
                );
                return Err(table.error(1, &message));
            }
            None => Self::center_line(&positions),
        };
        Ok(shape.read_from(path, recording, dropped).sigmas(&sigmas))
    }
}

/// The column that names the points of a table.
enum PointColumn {
    Node(usize),
    /// With the factor to meters.
    ArcLength(usize, f64),
}

impl PointColumn {
    /// That of a table; none of a center line.
    fn find(table: &Table) -> Result<Option<Self>, marker_files::Error> {
        match (table.find("s"), table.find("node")) {
            (Some(column), None) => {
                Ok(Some(Self::ArcLength(column, table.factor(column, &LENGTHS, "")?)))
            }
            (None, Some(column)) => match &table.columns[column].1 {
                Some(unit) => {
                    Err(table.error(1, &format!("unit [{unit}] of `node`, allowed: none")))
                }
                None => Ok(Some(Self::Node(column))),
            },
            (Some(_), Some(_)) => {
                let found = "columns `s` and `node`";
                let allowed = "one of s (arc length) and node (index)";
                Err(table.error(1, &format!("{found}, allowed: {allowed}")))
            }
            (None, None) => Ok(None),
        }
    }

    /// The point of a row.
    fn point(&self, table: &Table, row: &TableRow) -> Result<Point, marker_files::Error> {
        let (Self::Node(column) | Self::ArcLength(column, _)) = self;
        let value = row.values[*column]
            .ok_or_else(|| table.error(row.line, "the point is blank, allowed: s or node"))?;
        match self {
            Self::Node(_) if value >= 0.0 && value.fract() == 0.0 => {
                Ok(Point::Node(value as usize))
            }
            Self::Node(_) => {
                let message = format!("node = {value}, allowed: an index from 0 on");
                Err(table.error(row.line, &message))
            }
            Self::ArcLength(_, factor) => Ok(Point::ArcLength(value * factor)),
        }
    }
}

impl EquilibriumShape {
    /// Arc lengths by the chords between the points, from the end of the rod that is nearer to the first point, m, with
    /// the positions.
    pub(crate) fn approximate_arc_lengths(
        &self,
        problem: &Problem,
    ) -> Vec<(f64, [Option<f64>; 3])> {
        let wall = problem.wall().map(Some);
        let from_wall = |s: Option<&Sighting>| s.map_or(0.0, |s| chord(wall, s.position));
        let [first, last] = [self.sightings.first(), self.sightings.last()].map(from_wall);
        let place = |s: &Sighting| match s.point {
            Point::ArcLength(along) => along,
            _ => 0.0,
        };
        let whole = self.sightings.last().map_or(0.0, place);
        let at = |s: &Sighting| {
            let along = place(s);
            let from_wall = if first <= last { first + along } else { last + whole - along };
            (from_wall.min(problem.length()), s.position)
        };
        self.sightings.iter().map(at).collect()
    }

    /// The observed points with points of the rod: approximate ones where arc lengths are unknown.
    pub(crate) fn placed(&self, problem: &Problem) -> Vec<Sighting> {
        if !self.arc_lengths_fitted {
            return self.sightings.clone();
        }
        let approximate = self.approximate_arc_lengths(problem).into_iter();
        let sighting = |(along, position)| Sighting { point: Point::ArcLength(along), position };
        approximate.map(sighting).collect()
    }

    /// Offsets of the points of a planar center line along the normal of the line, with their arc lengths; none in space,
    /// where they have no sign. The `residuals` are those of the coordinates, point by point.
    pub(crate) fn normal_offsets(&self, problem: &Problem, residuals: &[f64]) -> Vec<[f64; 2]> {
        let seen = |s: &Sighting| -> Option<[f64; 2]> {
            let values: Vec<f64> = s.position.iter().flatten().copied().collect();
            values.try_into().ok()
        };
        let Some(points) = self.sightings.iter().map(seen).collect::<Option<Vec<_>>>() else {
            return Vec::new();
        };
        let places = self.approximate_arc_lengths(problem).into_iter();
        let offset = |((i, (along, _)), r): ((usize, (f64, _)), &[f64])| {
            let (before, after) = (i.saturating_sub(1), (i + 1).min(points.len() - 1));
            let tangent = [0, 1].map(|c| points[after][c] - points[before][c]);
            let side = tangent[0] * r[1] - tangent[1] * r[0];
            [along, side.signum() * r[0].hypot(r[1])]
        };
        places.enumerate().zip(residuals.chunks_exact(2)).map(offset).collect()
    }
}

impl DataKind for EquilibriumShape {
    fn table(&self) -> &'static str {
        "shape"
    }

    fn label(&self, header: &Header) -> String {
        match &header.source {
            Some(path) => path.display().to_string(),
            None => "the shape at rest".into(),
        }
    }

    fn abscissa(&self) -> Abscissa {
        Abscissa::ArcLength
    }

    fn abscissas(&self, problem: &Problem) -> Vec<f64> {
        let place = |s: Sighting| problem.arc_length(s.point).unwrap_or(0.0);
        self.placed(problem).into_iter().map(place).collect()
    }

    fn positions(&self) -> Vec<[Option<f64>; 3]> {
        self.sightings.iter().map(|s| s.position).collect()
    }

    fn positions_mut(&mut self) -> Vec<&mut [Option<f64>; 3]> {
        self.sightings.iter_mut().map(|s| &mut s.position).collect()
    }

    fn fitted_arc_lengths(&self) -> usize {
        if self.arc_lengths_fitted { self.sightings.len() } else { 0 }
    }

    /// Root mean square distance of the coordinates from those of the rest shape, m.
    fn size(&self, problem: &Problem) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0_f64);
        for sighting in self.placed(problem) {
            let Ok(stencil) = problem.stencil(sighting.point) else { continue };
            let rest = problem.rest_position(&stencil);
            for (seen, rest) in sighting.position.iter().zip(rest) {
                if let Some(seen) = seen {
                    sum += (seen - rest).powi(2);
                    count += 1.0;
                }
            }
        }
        (sum / count.max(1.0)).sqrt()
    }

    fn check(&self, _header: &Header, subject: &Subject) -> Result<(), Error> {
        let Subject { problem, label, .. } = subject;
        let given = self.sightings.iter().filter(|_| !self.arc_lengths_fitted);
        for (k, sighting) in given.enumerate() {
            problem.stencil(sighting.point).map_err(|error| {
                let allowed = "points of the rod. Check the unit in the header, as in s[mm]";
                Error::invalid(format!("{label}: point {}", k + 1), error, allowed)
            })?;
        }
        match self.sightings.iter().all(|s| is_finite(0.0, &s.position)) {
            true => Ok(()),
            false => Err(Error::invalid(*label, "other positions", "finite positions")),
        }
    }

    fn prepare(&mut self, problem: &Problem, _horizon: f64) {
        self.sightings = self.placed(problem);
    }

    fn require(&self, outputs: &mut Requirements) {
        match self.arc_lengths_fitted {
            true => outputs.whole_rest = true,
            false => outputs.resting.extend(self.sightings.iter().map(|s| s.point)),
        }
    }

    fn differences<D: Shown>(
        &self,
        simulated: &Simulated<D>,
        each: &mut dyn FnMut(D),
    ) -> Result<(), Error> {
        let Some(resting) = simulated.resting else { return Ok(()) };
        let (mesh, start) = (simulated.mesh, D::from(0.0));
        if !self.arc_lengths_fitted {
            for Sighting { point, position } in &self.sightings {
                let place = resting.position(&point.fixed().stencil(mesh)?, start)?;
                simulated.compare(place, position, each);
            }
            return Ok(());
        }
        let place = |i: usize| resting.position(&Stencil::node(i), start);
        let nodes = (0..mesh.nodes.len()).map(|i| Ok(simulated.view.recorded(place(i)?)));
        let nodes = nodes.collect::<Result<Vec<_>, Error>>()?;
        let curve = Curve { nodes: &nodes, arc_length: &mesh.arc_length };
        for Sighting { point, position } in &self.sightings {
            let near = if let Point::ArcLength(s) = point { *s } else { 0.0 };
            let offset = curve.offset(position, near);
            (0..3).filter(|c| position[*c].is_some()).for_each(|c| each(offset[c]));
        }
        Ok(())
    }
}
