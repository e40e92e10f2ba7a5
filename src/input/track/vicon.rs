//! Vicon Nexus's CSV export: sections, of which `Trajectories` has the markers. Below its name stand frames a
//! second, the markers over the first of their columns, the names of the columns, and their units; frames count
//! from 1, and cells of what was not seen are empty.

use crate::error::Error;
use crate::input::track::format::Format;
use crate::input::track::sheet::{Clock, Layout, Lengths, Line, Lines, Says, Sheet, unit};
use std::path::Path;

/// What other sections are called.
const SECTIONS: [&str; 6] =
    ["Devices", "Model Outputs", "Joints", "Segments", "Events", "Trajectories"];

pub(crate) fn read(path: &Path, bytes: &[u8]) -> Result<Sheet, Error> {
    // The first lines have no separator.
    let separator = bytes.iter().find(|b| b",;\t".contains(b)).unwrap_or(&b',');
    let lines = Lines::of(path, bytes, *separator)?;
    let not =
        |line, found: &str, allowed: &str| Err(lines.not_of(Format::Vicon, line, found, allowed));
    let Some(start) = lines.list.iter().position(|l| l.field(0) == "Trajectories") else {
        return not(1, "no section `Trajectories`", "one: export with `Trajectories` ticked");
    };
    let section: Vec<&Line> =
        lines.list[start + 1..].iter().filter(|l| !l.is_empty()).take(4).collect();
    let [rate, called, names, units] = section[..] else {
        return not(
            lines.list[start].number,
            "a section that ends after its name",
            "its rate and columns",
        );
    };
    let per_second = lines.rate(rate, 0, "the rate below `Trajectories`")?;
    if names.field(0) != "Frame" {
        let found = format!("`{}`", names.field(0));
        return not(names.number, &found, "`Frame` before the names of the columns");
    }
    let (mut layout, mut lengths): (Layout, Option<Lengths>) = (Layout::default(), None);
    let mut marker = "";
    for column in 2..names.len() {
        if !called.field(column).is_empty() {
            marker = called.field(column);
        }
        // Velocities and accelerations have primes.
        let Some(says) = Says::axis(names.field(column)) else { continue };
        if marker.is_empty() {
            return not(called.number, "no marker over the first column", "its name");
        }
        layout.add(&lines, names.number, (column, marker, says))?;
        let said = units.field(column);
        let Some(own) = unit(said) else {
            return not(units.number, &format!("unit `{said}` of `{marker}`"), "mm, cm or m");
        };
        if lengths.replace(own).is_some_and(|before| before != own) {
            return not(units.number, "several units", "one for all markers");
        }
    }
    let Some(lengths) = lengths else {
        return not(names.number, "no column X, Y and Z", "those of one marker at least");
    };
    let below = lines.list[start + 1..].iter().skip_while(|l| l.number <= units.number);
    let rows = below.filter(|l| !l.is_empty()).take_while(|l| !SECTIONS.contains(&l.field(0)));
    let frame = |_, line: &Line| lines.some_number(line, 0, "Frame");
    let (rows, markers) = layout.read(&lines, (names.number, names.len()), rows, frame)?;
    let clock = Clock::Frames { first: 1.0, rate: Some(per_second) };
    Ok(Sheet { path: path.into(), format: Format::Vicon, clock, lengths, rows, markers })
}
