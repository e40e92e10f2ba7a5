//! DeepLabCut's CSV: rows `scorer`, `individuals` where there are several animals, `bodyparts` and `coords` over
//! the columns; before them the number of the frame, or the name of its image. Pixels, with y down; of cameras that
//! were put together, x, y and z in the unit of their calibration.

use crate::error::Error;
use crate::input::track::format::Format;
use crate::input::track::sheet::{Clock, Layout, Lengths, Line, Lines, Says, Sheet};
use std::path::Path;

pub(crate) fn read(path: &Path, bytes: &[u8]) -> Result<Sheet, Error> {
    let lines = Lines::of(path, bytes, b',')?;
    let format = Format::DeepLabCut;
    let not = |line, found: &str, allowed: &str| Err(lines.not_of(format, line, found, allowed));
    let header: Vec<&Line> = lines.list.iter().take(4).collect();
    let row = |name: &str| header.iter().find(|l| l.field(0) == name).copied();
    let (Some(scorer), Some(parts), Some(coords)) =
        (row("scorer"), row("bodyparts"), row("coords"))
    else {
        return not(1, "no rows `scorer`, `bodyparts` and `coords`", "all three over the columns");
    };
    let individuals = row("individuals");
    // Names of images may take several columns.
    let first = (1..scorer.len()).find(|i| !scorer.field(*i).is_empty()).unwrap_or(scorer.len());
    let mut layout = Layout::default();
    let mut in_space = false;
    for column in first..coords.len() {
        let part = parts.field(column);
        let name = match individuals.map(|row| row.field(column)) {
            Some(animal) => format!("{animal}:{part}"),
            None => part.to_string(),
        };
        let coordinate = coords.field(column);
        let says = match coordinate {
            "likelihood" => Says::Likelihood,
            coordinate => match Says::axis(coordinate) {
                Some(says) => says,
                None => {
                    let found = format!("coords `{coordinate}`");
                    return not(coords.number, &found, "x, y, z or likelihood");
                }
            },
        };
        in_space |= says == Says::Axis(2);
        layout.add(&lines, coords.number, (column, &name, says))?;
    }
    if layout.is_empty() {
        return not(coords.number, "no column", "x and y of one body part at least");
    }
    let rows =
        lines.list.iter().skip_while(|l| l.number <= coords.number).filter(|l| !l.is_empty());
    let frame = |_, line: &Line| {
        let name = line.field(first - 1);
        let number = frame(name);
        number.ok_or_else(|| {
            let message = format!(
                "found `{name}`, allowed: a frame's number, or an image with one in its name"
            );
            lines.error(line.number, message)
        })
    };
    let (rows, markers) = layout.read(&lines, (coords.number, coords.len()), rows, frame)?;
    let lengths = match in_space {
        true => Lengths::Calibrated,
        false => Lengths::Pixels { down: Some(true) },
    };
    let clock = Clock::Frames { first: 0.0, rate: None };
    Ok(Sheet { path: path.into(), format, clock, lengths, rows, markers })
}

/// The number that a frame has, or the last one in the name of its image, `img0012.png`.
fn frame(name: &str) -> Option<f64> {
    if let Ok(number) = name.parse::<f64>() {
        return (number.is_finite() && number >= 0.0).then_some(number);
    }
    let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
    let digits = stem.rsplit(|c: char| !c.is_ascii_digit()).find(|digits| !digits.is_empty())?;
    digits.parse().ok()
}
