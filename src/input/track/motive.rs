//! OptiTrack Motive's CSV export: settings in pairs in the first line, then what each column is of, in five rows or
//! six. Rigid bodies and bones stand between the markers. Cells of what was not seen are empty.

use crate::error::Error;
use crate::input::table::delimiter;
use crate::input::track::format::Format;
use crate::input::track::sheet::{Clock, Layout, Line, Lines, Says, Sheet, unit};
use std::path::Path;

pub(crate) fn read(path: &Path, bytes: &[u8]) -> Result<Sheet, Error> {
    let lines = Lines::of(path, bytes, delimiter(bytes))?;
    let not =
        |line, found: &str, allowed: &str| Err(lines.not_of(Format::Motive, line, found, allowed));
    let Some(settings) = lines.list.first().filter(|l| l.field(0) == "Format Version") else {
        return not(1, "no `Format Version`", "it at the beginning of the first line");
    };
    let pairs: Vec<&str> = settings.fields().collect();
    let setting =
        |name: &str| pairs.chunks(2).find(|p| p[0] == name).and_then(|p| p.get(1).copied());
    let Some(said) = setting("Length Units") else {
        return not(settings.number, "no `Length Units`", "Millimeters, Centimeters or Meters");
    };
    let Some(lengths) = unit(said) else {
        return not(
            settings.number,
            &format!("Length Units `{said}`"),
            "Millimeters, Centimeters or Meters",
        );
    };
    let Some(header) = lines.list.iter().position(|l| l.field(0) == "Frame") else {
        return not(settings.number, "no row that begins with `Frame`", "one above the numbers");
    };
    let above: Vec<&Line> = lines.list[1..header].iter().filter(|l| !l.is_empty()).collect();
    let row = |name: &str| above.iter().find(|l| l.field(1) == name);
    let names = &lines.list[header];
    let (Some(types), Some(called), Some(properties)) = (row("Type"), row("Name"), above.last())
    else {
        return not(names.number, "no rows `Type` and `Name` above it", "both");
    };
    if !names.field(1).starts_with("Time") {
        return not(
            names.number,
            &format!("`{}` beside `Frame`", names.field(1)),
            "`Time (Seconds)`",
        );
    }
    let mut layout = Layout::default();
    for column in 2..names.len() {
        let of = (types.field(column), properties.field(column));
        if let (("Marker", "Position"), Some(says)) = (of, Says::axis(names.field(column))) {
            layout.add(&lines, names.number, (column, called.field(column), says))?;
        }
    }
    if layout.is_empty() {
        let mut found: Vec<&str> = types.fields().skip(2).filter(|f| !f.is_empty()).collect();
        found.dedup();
        let found = format!("no column of the type Marker, but {found:?}");
        return not(types.number, &found, "markers: export them with `Markers` switched on");
    }
    let rows = lines.list[header + 1..].iter().filter(|l| !l.is_empty());
    let time = |_, line: &Line| lines.some_number(line, 1, "Time (Seconds)");
    let (rows, markers) = layout.read(&lines, (names.number, names.len()), rows, time)?;
    let clock = Clock::Time(1.0);
    Ok(Sheet { path: path.into(), format: Format::Motive, clock, lengths, rows, markers })
}
