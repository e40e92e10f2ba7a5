//! A photographed droop: where points of a rod at rest were seen.

use crate::error::Error;
use crate::fit::measurement::loss::{Loss, typical};
use crate::fit::measurement::motion::Dropped;
use crate::input::table::{LENGTHS, Table};
use crate::input::track::recording::{BEYOND, Recording, is_finite};
use crate::problem::Problem;
use crate::scene::Point;
use std::path::{Path, PathBuf};

/// Where a point of the rod at rest was seen. World coordinates, m; a coordinate that was not seen
/// is `None`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sighting {
    /// The point of the rod.
    pub point: Point,
    /// Where it was seen: x, y, z in m.
    pub position: [Option<f64>; 3],
}

/// A rod at rest under the scene's loads, as it was seen: its equilibrium, whatever its motion.
#[derive(Clone, Debug)]
pub struct RestShape {
    /// Where points of the rod were seen.
    pub sightings: Vec<Sighting>,
    /// Standard deviation per coordinate, m; estimated from the residuals when `None`.
    pub sigma: Option<f64>,
    /// That of every sighting, or of every coordinate that was seen, over `sigma`, which is then typical of them; empty
    /// where all have the same.
    pub sigma_factors: Vec<f64>,
    /// How residuals count.
    pub loss: Loss,
    /// Whether the shape is kept out of the fit and only predicted.
    pub held_out: bool,
    /// The file it was read from, for messages.
    pub source: Option<PathBuf>,
    /// How that file was read.
    pub recording: Option<Recording>,
    /// Rows of that file that were left out.
    pub dropped: Dropped,
    /// Whether it is only [planned](Self::planned): its positions mean nothing, but which coordinates would be seen.
    pub planned: bool,
    /// Whether the points have no given arc length: each is compared with the nearest point of the rod, and its own
    /// [`Point`] is only about where it is.
    pub arc_lengths_fitted: bool,
}

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
        Self {
            sightings,
            sigma: None,
            sigma_factors: Vec::new(),
            loss: Loss::Squares,
            held_out: false,
            source: None,
            recording: None,
            dropped: Dropped::default(),
            planned: false,
            arc_lengths_fitted: false,
        }
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
        let sightings = positions.iter().map(sighting).collect();
        Self { arc_lengths_fitted: true, ..Self::new(sightings) }
    }

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

    /// Values that the unknown arc lengths use up: one for each point.
    pub(crate) fn fitted_arc_lengths(&self) -> usize {
        if self.arc_lengths_fitted { self.sightings.len() } else { 0 }
    }

    /// A photograph that is only planned, of points at these arc lengths from the wall, m, in all three coordinates.
    pub fn planned(at: &[f64]) -> Self {
        let sighting = |s: &f64| Sighting { point: Point::ArcLength(*s), position: [Some(0.0); 3] };
        Self { planned: true, ..Self::new(at.iter().map(sighting).collect()) }
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
        Self::read_file(path.as_ref(), recording)
    }

    fn read_file(path: &Path, recording: &Recording) -> Result<Self, Error> {
        let table = Table::read(path)?;
        let known = ["s", "node", "x", "y", "z"];
        recording.check_columns(&table, &known)?;
        let refused = |found: &str| {
            table.error(1, &format!("{found}, allowed: one of s (arc length) and node (index)"))
        };
        let (place, by_node) = match (table.find("s"), table.find("node")) {
            (Some(column), None) => (column, false),
            (None, Some(column)) => (column, true),
            (Some(_), Some(_)) => return Err(refused("columns `s` and `node`")),
            (None, None) => return Self::read_center_line(path, &table, recording),
        };
        let factor = match (by_node, &table.columns[place].1) {
            (true, Some(unit)) => {
                return Err(table.error(1, &format!("unit [{unit}] of `node`, allowed: none")));
            }
            (true, None) => 1.0,
            (false, _) => table.factor(place, &LENGTHS, "")?,
        };
        let axes = recording.axis_columns(&table)?;
        let sigma_columns = recording.sigma_columns(&table, &axes, &known)?;
        let mut sigmas = Vec::new();
        let mut sightings = Vec::with_capacity(table.rows.len());
        let mut dropped = Dropped::default();
        for row in &table.rows {
            let value = row.values[place]
                .ok_or_else(|| table.error(row.line, "the point is blank, allowed: s or node"))?;
            let point = match by_node {
                true if value >= 0.0 && value.fract() == 0.0 => Point::Node(value as usize),
                true => {
                    let message = format!("node = {value}, allowed: an index from 0 on");
                    return Err(table.error(row.line, &message));
                }
                false => Point::ArcLength(value * factor),
            };
            let position = recording.position(&axes, &row.values);
            if !is_finite(value, &position) {
                return Err(table.error(row.line, BEYOND));
            }
            if recording.sigma.is_some() {
                let seen = position.map(|x| x.is_some());
                sigmas.extend(recording.sigma(&table, &sigma_columns, row, seen)?.iter().flatten());
            }
            match position.iter().any(Option::is_some) {
                true => sightings.push(Sighting { point, position }),
                false => dropped.empty += 1,
            }
        }
        let shape = Self {
            source: Some(path.into()),
            recording: Some(recording.clone()),
            dropped,
            ..Self::new(sightings)
        };
        if shape.values() == 0 {
            return Err(
                table.error(1, "no value below the header, allowed: one row with a value at least")
            );
        }
        Ok(shape.sigmas(&sigmas))
    }

    /// Points of the center line, without arc lengths.
    fn read_center_line(path: &Path, table: &Table, recording: &Recording) -> Result<Self, Error> {
        let known = ["x", "y", "z"];
        recording.check_columns(table, &known)?;
        let axes = recording.axis_columns(table)?;
        let sigma_columns = recording.sigma_columns(table, &axes, &known)?;
        let (mut positions, mut sigmas) = (Vec::new(), Vec::new());
        let mut dropped = Dropped::default();
        for row in &table.rows {
            let position = recording.position(&axes, &row.values);
            if !is_finite(0.0, &position) {
                return Err(table.error(row.line, BEYOND));
            }
            if position.iter().flatten().count() < 2 {
                dropped.empty += 1;
                continue;
            }
            if recording.sigma.is_some() {
                let seen = position.map(|x| x.is_some());
                sigmas.extend(recording.sigma(table, &sigma_columns, row, seen)?.iter().flatten());
            }
            positions.push(position);
        }
        if positions.len() < LEAST_OF_A_LINE {
            let message = format!(
                "no column s or node, and {} points, allowed: {LEAST_OF_A_LINE} or more points along the center line, with \
                 two coordinates each, or a column s (arc length) or node (index)",
                positions.len()
            );
            return Err(table.error(1, &message));
        }
        let line = Self::center_line(&positions);
        let (source, recording) = (Some(path.into()), Some(recording.clone()));
        Ok(Self { source, recording, dropped, ..line }.sigmas(&sigmas))
    }

    /// With a known standard deviation per coordinate, m.
    pub fn sigma(self, sigma: f64) -> Self {
        Self { sigma: Some(sigma), ..self }
    }

    /// With a known standard deviation of each sighting, per coordinate, m, or of each coordinate that was seen, sighting
    /// by sighting.
    pub fn sigmas(self, sigmas: &[f64]) -> Self {
        let Some((sigma, sigma_factors)) = typical(sigmas) else { return self };
        Self { sigma: Some(sigma), sigma_factors, ..self }
    }

    /// With another loss than squares.
    pub fn loss(self, loss: Loss) -> Self {
        Self { loss, ..self }
    }

    /// Kept out of the fit, to be predicted by it.
    pub fn held_out(self) -> Self {
        Self { held_out: true, ..self }
    }

    /// Number of coordinates seen.
    pub fn values(&self) -> usize {
        self.sightings.iter().flat_map(|s| s.position).flatten().count()
    }
}
