//! Columns of a table of measured points of a rod at rest: which point each row is, and the offset of its marker.
//!
//! Input: a table with lower-case names of columns, and its rows. Output: [`PointColumn`] returns the point of a row,
//! an arc length (m) or a node. [`OffsetColumns`] returns the offset (m) of its marker along the tangent and both
//! material directors. Errors are units that are no lengths, blank points, nodes that are no indices, and columns that
//! exclude each other.

use crate::scene::Point;
use marker_files::table::{LENGTHS, Table, TableRow};

/// Columns with the offset of a marker from its point: along the tangent and both material directors.
pub(super) const OFFSETS: [&str; 3] = ["offset_t", "offset_d1", "offset_d2"];

/// The columns [`OFFSETS`] of a table with their factors to meters; `None` for missing ones.
pub(super) struct OffsetColumns([Option<(usize, f64)>; 3]);

impl OffsetColumns {
    /// The offset columns of a table. An error for a unit that is no length, and for offsets of points of a centerline,
    /// whose table has no column of points.
    pub fn find(table: &Table, has_points: bool) -> Result<Self, marker_files::Error> {
        let mut found = [None; 3];
        for (found, name) in found.iter_mut().zip(OFFSETS) {
            let Some(column) = table.find(name) else { continue };
            if !has_points {
                let allowed = "offsets beside a column s (arc length) or node (index)";
                let message = format!("found the column `{name}`, allowed: {allowed}");
                return Err(table.error(1, &message));
            }
            *found = Some((column, table.factor(column, &LENGTHS, "")?));
        }
        Ok(Self(found))
    }

    /// The offset in a row of the table, m; zero for a blank cell or a missing column.
    pub fn of_row(&self, row: &TableRow) -> [f64; 3] {
        let value = |(column, factor): (usize, f64)| row.values[column].unwrap_or(0.0) * factor;
        self.0.map(|column| column.map_or(0.0, value))
    }
}

/// The column of a table that assigns each row to a point of the rod.
pub(super) enum PointColumn {
    /// Index of the column with node indices.
    Node(usize),
    /// Index of the column with arc lengths, and the factor to meters.
    ArcLength(usize, f64),
}

impl PointColumn {
    /// The column that assigns the rows of a table to points: `s`, with its factor to meters, or `node`. `None` without
    /// both: a centerline without arc lengths. An error for both columns, or node indices with a unit.
    pub fn find(table: &Table) -> Result<Option<Self>, marker_files::Error> {
        match (table.find("s"), table.find("node")) {
            (Some(column), None) => {
                Ok(Some(Self::ArcLength(column, table.factor(column, &LENGTHS, "")?)))
            }
            (None, Some(column)) => match &table.columns[column].1 {
                Some(unit) => Err(table.error(
                    1,
                    &format!(
                        "found the unit [{unit}] of `node`, allowed: no \
                                                 unit"
                    ),
                )),
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

    /// The point of a row of the table: a node, or an arc length in m. An error for a blank cell, and for a node that
    /// is negative or fractional.
    pub fn point(&self, table: &Table, row: &TableRow) -> Result<Point, marker_files::Error> {
        let (Self::Node(column) | Self::ArcLength(column, _)) = self;
        let value = row.values[*column].ok_or_else(|| {
            table.error(
                row.line,
                "found a blank point, allowed: a value of s or \
                                                  node",
            )
        })?;
        match self {
            Self::Node(_) if value >= 0.0 && value.fract() == 0.0 => {
                Ok(Point::Node(value as usize))
            }
            Self::Node(_) => {
                let message = format!("found node = {value}, allowed: an index of 0 or more");
                Err(table.error(row.line, &message))
            }
            Self::ArcLength(_, factor) => Ok(Point::ArcLength(value * factor)),
        }
    }
}
