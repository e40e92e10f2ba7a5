//! Reader of CSV exports of Vicon Nexus: frames by number, with their rate, and markers in the unit of the file.
//!
//! The section `Trajectories` has the markers; other sections are skipped. Below its name are the frames per second,
//! the markers above the first of their columns, the names of the columns, and their units. All have one unit: um, mm,
//! cm or m. Frame numbers are those of the file, which begin with 1. Columns of velocities and accelerations are
//! skipped; missing positions are empty. A file without this section, a positive rate, `Frame` or a coordinate, a
//! column without a marker, and several or unknown units are errors.

use crate::error::Error;
use crate::format::Format;
use crate::marker_file::{
    Clock, ColumnKind, ColumnLayout, FieldLine, FieldLines, LengthUnit, MarkerFile, length_unit,
};
use std::path::Path;

/// Names of the sections of an export, in the first cell of a line.
const SECTIONS: [&str; 6] =
    ["Devices", "Model Outputs", "Joints", "Segments", "Events", "Trajectories"];

/// Reads the bytes of a file of Vicon Nexus into frames by number, with their rate, and markers; `path` is for
/// messages. Columns of velocities and accelerations are skipped. The rows end at the next section. An error without a
/// section `Trajectories`, its rate, `Frame` or a coordinate, for a column without a marker, and for several or unknown
/// units.
pub(crate) fn read(path: &Path, bytes: &[u8]) -> Result<MarkerFile, Error> {
    // The first lines have no separators.
    let separator = bytes.iter().find(|b| b",;\t".contains(b)).unwrap_or(&b',');
    let lines = FieldLines::new(path, Format::Vicon, bytes, *separator)?;
    let Some(start) = lines.list.iter().position(|l| l.field(0) == "Trajectories") else {
        return lines.rejected(
            1,
            "no section `Trajectories`",
            "this section. Export the file with `Trajectories` selected",
        );
    };
    // Four lines describe the section: rate, markers, names and units of the columns.
    let section: Vec<&FieldLine> =
        lines.list[start + 1..].iter().filter(|l| !l.is_empty()).take(4).collect();
    let [rate, called, names, units] = section[..] else {
        return lines.rejected(
            lines.list[start].number,
            "a section with nothing below its name",
            "a section with its rate and columns",
        );
    };
    let per_second = lines.rate(rate, 0, "the rate below `Trajectories`")?;
    if names.field(0) != "Frame" {
        let found = format!("`{}`", names.field(0));
        return lines.rejected(names.number, &found, "`Frame` before the names of the columns");
    }
    let mut layout = ColumnLayout::new(&lines, names.number);
    let mut lengths: Option<LengthUnit> = None;
    let mut marker = "";
    for column in 2..names.len() {
        if !called.field(column).is_empty() {
            marker = called.field(column);
        }
        // Names of velocities and accelerations have primes.
        let Some(kind) = ColumnKind::axis(names.field(column)) else { continue };
        if marker.is_empty() {
            return lines.rejected(
                called.number,
                "no marker name above the first column",
                "a \
                                                  marker name",
            );
        }
        layout.add(column, marker, kind)?;
        let stated = units.field(column);
        let Some(own) = length_unit(stated) else {
            return lines.rejected(
                units.number,
                &format!("unit `{stated}` of `{marker}`"),
                "mm, cm or m",
            );
        };
        if lengths.replace(own).is_some_and(|before| before != own) {
            return lines.rejected(units.number, "several units", "one unit for all markers");
        }
    }
    let Some(lengths) = lengths else {
        return lines.rejected(
            names.number,
            "no column X, Y and Z",
            "columns X, Y and Z of at least one marker",
        );
    };
    // The rows end where another section begins.
    let below = lines.list[start + 1..].iter().skip_while(|l| l.number <= units.number);
    let rows = below.filter(|l| !l.is_empty()).take_while(|l| !SECTIONS.contains(&l.field(0)));
    let frame = |_, line: &FieldLine| lines.required_number(line, 0, "Frame");
    let table = layout.read(names.len(), rows, frame)?;
    let clock = Clock::Frames { first: 1.0, rate: Some(per_second) };
    Ok(lines.file(clock, lengths, table))
}
