//! Reader of CSV exports of OptiTrack Motive: frames by time in seconds, and markers in the unit of the file.
//!
//! The first line has settings in pairs of name and value, among them `Length Units`. Rows above the numbers have
//! type, name and property of the columns; they are found by their names, as their number depends on the version.
//! Read are columns of the type Marker with the property Position; those of rigid bodies and bones are skipped.
//! Missing positions are empty. A file without the settings, a known unit, the rows `Frame`, `Type` and `Name`, or
//! any marker is an error.

use crate::error::Error;
use crate::format::Format;
use crate::marker_file::{
    Clock, ColumnKind, ColumnLayout, FieldLine, FieldLines, MarkerFile, length_unit,
};
use crate::table::delimiter;
use std::path::Path;

/// Reads the bytes of a file of Motive into frames by time, s, and markers; `path` is for messages. The unit of length
/// is that of its first line. Only columns of the type Marker with the property Position are read. A file without
/// markers, settings, a known unit, or the rows `Frame`, `Type` and `Name` is an error.
pub(crate) fn read(path: &Path, bytes: &[u8]) -> Result<MarkerFile, Error> {
    let lines = FieldLines::new(path, Format::Motive, bytes, delimiter(bytes))?;
    let Some(settings) = lines.list.first().filter(|l| l.field(0) == "Format Version") else {
        return lines.rejected(
            1,
            "no `Format Version`",
            "this text at the beginning of the first \
                                  line",
        );
    };
    let pairs: Vec<&str> = settings.fields().collect();
    let setting =
        |name: &str| pairs.chunks(2).find(|p| p[0] == name).and_then(|p| p.get(1).copied());
    let Some(stated) = setting("Length Units") else {
        return lines.rejected(
            settings.number,
            "no `Length Units`",
            "Millimeters, Centimeters or Meters",
        );
    };
    let Some(lengths) = length_unit(stated) else {
        return lines.rejected(
            settings.number,
            &format!("Length Units `{stated}`"),
            "Millimeters, Centimeters or Meters",
        );
    };
    // The number of rows above `Frame` depends on the version of Motive: they are found by their names.
    let Some(header) = lines.list.iter().position(|l| l.field(0) == "Frame") else {
        return lines.rejected(
            settings.number,
            "no row that begins with `Frame`",
            "such a row above the numbers",
        );
    };
    // The last row above `Frame` has the properties (Position, Rotation); blank rows stand between.
    let above: Vec<&FieldLine> = lines.list[1..header].iter().filter(|l| !l.is_empty()).collect();
    let row = |name: &str| above.iter().find(|l| l.field(1) == name);
    let names = &lines.list[header];
    let (Some(types), Some(called), Some(properties)) = (row("Type"), row("Name"), above.last())
    else {
        return lines.rejected(
            names.number,
            "no rows `Type` and `Name` above the row `Frame`",
            "both",
        );
    };
    if !names.field(1).starts_with("Time") {
        return lines.rejected(
            names.number,
            &format!("`{}` next to `Frame`", names.field(1)),
            "`Time (Seconds)`",
        );
    }
    // Only positions of markers: rigid bodies and bones have the same names of columns.
    let mut layout = ColumnLayout::new(&lines, names.number);
    for column in 2..names.len() {
        let of = (types.field(column), properties.field(column));
        if let (("Marker", "Position"), Some(kind)) = (of, ColumnKind::axis(names.field(column))) {
            layout.add(column, called.field(column), kind)?;
        }
    }
    if layout.is_empty() {
        let mut found: Vec<&str> = types.fields().skip(2).filter(|f| !f.is_empty()).collect();
        found.dedup();
        let found = format!("no column of the type Marker, but {found:?}");
        return lines.rejected(
            types.number,
            &found,
            "columns of markers. Export the file with `Markers` switched on",
        );
    }
    let rows = lines.list[header + 1..].iter().filter(|l| !l.is_empty());
    let time = |_, line: &FieldLine| lines.required_number(line, 1, "Time (Seconds)");
    let table = layout.read(names.len(), rows, time)?;
    let clock = Clock::Time(1.0);
    Ok(lines.file(clock, lengths, table))
}
