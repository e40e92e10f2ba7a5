//! CSV export of Vicon Nexus. The section `Trajectories` has the markers. Below its name are the frames per second, the
//! markers above the first of their columns, the names of the columns, and their units. Frames are numbered from 1.
//! Missing positions are empty.

use crate::error::Error;
use crate::format::Format;
use crate::marker_file::{
    Clock, ColumnKind, Layout, LengthUnit, Line, Lines, MarkerFile, length_unit,
};
use std::path::Path;

/// Names of the sections.
const SECTIONS: [&str; 6] =
    ["Devices", "Model Outputs", "Joints", "Segments", "Events", "Trajectories"];

pub(crate) fn read(path: &Path, bytes: &[u8]) -> Result<MarkerFile, Error> {
    // The first lines have no separators.
    let separator = bytes.iter().find(|b| b",;\t".contains(b)).unwrap_or(&b',');
    let lines = Lines::of(path, bytes, *separator)?;
    let rejected = |line, found: &str, allowed: &str| {
        Err(lines.format_error(Format::Vicon, line, found, allowed))
    };
    let Some(start) = lines.list.iter().position(|l| l.field(0) == "Trajectories") else {
        return rejected(1, "no section `Trajectories`", "one: export with `Trajectories` ticked");
    };
    let section: Vec<&Line> =
        lines.list[start + 1..].iter().filter(|l| !l.is_empty()).take(4).collect();
    let [rate, called, names, units] = section[..] else {
        return rejected(
            lines.list[start].number,
            "a section that ends after its name",
            "its rate and columns",
        );
    };
    let per_second = lines.rate(rate, 0, "the rate below `Trajectories`")?;
    if names.field(0) != "Frame" {
        let found = format!("`{}`", names.field(0));
        return rejected(names.number, &found, "`Frame` before the names of the columns");
    }
    let (mut layout, mut lengths): (Layout, Option<LengthUnit>) = (Layout::default(), None);
    let mut marker = "";
    for column in 2..names.len() {
        if !called.field(column).is_empty() {
            marker = called.field(column);
        }
        // Names of velocities and accelerations have primes.
        let Some(kind) = ColumnKind::axis(names.field(column)) else { continue };
        if marker.is_empty() {
            return rejected(called.number, "no marker over the first column", "its name");
        }
        layout.add(&lines, names.number, (column, marker, kind))?;
        let stated = units.field(column);
        let Some(own) = length_unit(stated) else {
            return rejected(
                units.number,
                &format!("unit `{stated}` of `{marker}`"),
                "mm, cm or m",
            );
        };
        if lengths.replace(own).is_some_and(|before| before != own) {
            return rejected(units.number, "several units", "one for all markers");
        }
    }
    let Some(lengths) = lengths else {
        return rejected(names.number, "no column X, Y and Z", "those of one marker at least");
    };
    let below = lines.list[start + 1..].iter().skip_while(|l| l.number <= units.number);
    let rows = below.filter(|l| !l.is_empty()).take_while(|l| !SECTIONS.contains(&l.field(0)));
    let frame = |_, line: &Line| lines.required_number(line, 0, "Frame");
    let (frames, markers) = layout.read(&lines, (names.number, names.len()), rows, frame)?;
    let clock = Clock::Frames { first: 1.0, rate: Some(per_second) };
    Ok(MarkerFile { path: path.into(), format: Format::Vicon, clock, lengths, frames, markers })
}
