//! Reader of CSV exports of OptiTrack Motive: frames by time in seconds, and markers in the unit of the file.
//!
//! The first line has settings in pairs of name and value, among them `Length Units`. Rows above the numbers have
//! type, name and property of the columns; they are found by their names, as their number depends on the version.
//! Read are columns of the type Marker with the property Position; those of rigid bodies (`motive_bodies` reads them)
//! and bones are skipped.
//! Missing positions are empty. A file without the settings, a known unit, the rows `Frame`, `Type` and `Name`, or
//! any marker is an error.

use crate::error::Error;
use crate::format::Format;
use crate::marker_file::{
    Clock, ColumnKind, ColumnLayout, FieldLine, FieldLines, LengthUnit, MarkerFile, length_unit,
};
use crate::table::delimiter;
use std::path::Path;

/// A file of Motive whose header was found: its lines, settings, and the rows with types, names and properties of the
/// columns.
pub(super) struct MotiveExport {
    pub lines: FieldLines,
    /// Unit of the positions.
    pub lengths: LengthUnit,
    /// Index of the row `Frame`, with the names of the columns.
    header: usize,
    /// Indices of the rows `Type`, `Name` and of the properties.
    types: usize,
    names: usize,
    properties: usize,
}

impl MotiveExport {
    /// Finds the header in the bytes of a file; `path` is for messages. A file without settings, a known unit, or the
    /// rows `Frame`, `Type` and `Name` is an error.
    pub fn open(path: &Path, bytes: &[u8]) -> Result<Self, Error> {
        let lines = FieldLines::new(path, Format::Motive, bytes, delimiter(bytes))?;
        let Some(settings) = lines.list.first().filter(|l| l.field(0) == "Format Version") else {
            let allowed = "this text at the beginning of the first line";
            return lines.rejected(1, "no `Format Version`", allowed);
        };
        let number = settings.number;
        let units = "Millimeters, Centimeters or Meters";
        let Some(stated) = setting(settings, "Length Units") else {
            return lines.rejected(number, "no `Length Units`", units);
        };
        let Some(lengths) = length_unit(stated) else {
            return lines.rejected(number, &format!("Length Units `{stated}`"), units);
        };
        // The number of rows above `Frame` depends on the version of Motive: they are found by their names.
        let Some(header) = lines.list.iter().position(|l| l.field(0) == "Frame") else {
            let allowed = "such a row above the numbers";
            return lines.rejected(number, "no row that begins with `Frame`", allowed);
        };
        // The last row above `Frame` has the properties (Position, Rotation); blank rows stand between.
        let above: Vec<usize> = (1..header).filter(|l| !lines.list[*l].is_empty()).collect();
        let row = |name: &str| above.iter().copied().find(|l| lines.list[*l].field(1) == name);
        let columns = &lines.list[header];
        let (Some(types), Some(names), Some(properties)) =
            (row("Type"), row("Name"), above.last().copied())
        else {
            let found = "no rows `Type` and `Name` above the row `Frame`";
            return lines.rejected(columns.number, found, "both");
        };
        if !columns.field(1).starts_with("Time") {
            let found = format!("`{}` next to `Frame`", columns.field(1));
            return lines.rejected(columns.number, &found, "`Time (Seconds)`");
        }
        Ok(Self { lengths, header, types, names, properties, lines })
    }

    /// The value of a setting in the first line; `None` without it.
    pub fn setting(&self, name: &str) -> Option<&str> {
        self.lines.list.first().and_then(|settings| setting(settings, name))
    }

    /// The row with the names of the columns, below which the numbers begin.
    pub fn columns(&self) -> &FieldLine {
        &self.lines.list[self.header]
    }

    /// Type (`Marker`, `Rigid Body`), name and property (`Position`, `Rotation`) of a column, counted from 0.
    pub fn column(&self, column: usize) -> [&str; 3] {
        [self.types, self.names, self.properties].map(|row| self.lines.list[row].field(column))
    }

    /// The error of a file without a column of the type `wanted`; `remedy` ends the message.
    pub fn without<T>(&self, wanted: &str, remedy: &str) -> Result<T, Error> {
        let types = &self.lines.list[self.types];
        let mut found: Vec<&str> = types.fields().skip(2).filter(|f| !f.is_empty()).collect();
        found.dedup();
        let found = format!("no column of the type {wanted}, but {found:?}");
        self.lines.rejected(types.number, &found, remedy)
    }

    /// The rows of numbers, without blank ones.
    pub fn rows(&self) -> impl Iterator<Item = &FieldLine> {
        self.lines.list[self.header + 1..].iter().filter(|l| !l.is_empty())
    }

    /// The time of a row, s; an error if it is blank or no number.
    pub fn time(&self, row: &FieldLine) -> Result<f64, Error> {
        self.lines.required_number(row, 1, "Time (Seconds)")
    }
}

/// The value behind the name of a setting in a line of pairs; `None` without the name.
fn setting<'a>(line: &'a FieldLine, name: &str) -> Option<&'a str> {
    let pairs: Vec<&str> = line.fields().collect();
    pairs.chunks(2).find(|p| p[0] == name).and_then(|p| p.get(1).copied())
}

/// Reads the bytes of a file of Motive into frames by time, s, and markers; `path` is for messages. The unit of length
/// is that of its first line. Only columns of the type Marker with the property Position are read. A file without
/// markers, settings, a known unit, or the rows `Frame`, `Type` and `Name` is an error.
pub(crate) fn read(path: &Path, bytes: &[u8]) -> Result<MarkerFile, Error> {
    let export = MotiveExport::open(path, bytes)?;
    let names = export.columns();
    // Only positions of markers: rigid bodies and bones have the same names of columns.
    let mut layout = ColumnLayout::new(&export.lines, names.number);
    for column in 2..names.len() {
        let [kind, name, property] = export.column(column);
        if let (("Marker", "Position"), Some(axis)) =
            ((kind, property), ColumnKind::axis(names.field(column)))
        {
            layout.add(column, name, axis)?;
        }
    }
    if layout.is_empty() {
        let remedy = "columns of markers. Export the file with `Markers` switched on. The poses of rigid bodies are \
                      read by pose in [[supports.motion]]";
        return export.without("Marker", remedy);
    }
    let table = layout.read(names.len(), export.rows(), |_, line| export.time(line))?;
    Ok(export.lines.file(Clock::Time(1.0), export.lengths, table))
}
