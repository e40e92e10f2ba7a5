//! Reader of CSV files of DeepLabCut: frames by number, without a rate, and positions with likelihoods.
//!
//! Rows `scorer`, `individuals` if there are several animals, `bodyparts` and `coords` are above the columns. Markers
//! are named by their body part, of several animals `animal:part`. The last column before the markers has the frame
//! number, or the name of an image. Of an image name the last group of digits that increases from each name to the next
//! is the frame number, and the last group if none does. Positions are in pixels with y down; if a marker has z, all
//! are in the unit of the calibration. A missing row, other coordinates, no body part, and cells without a frame
//! number, or with a negative one, are errors; those of the columns and rows are of [`ColumnLayout`].

use crate::error::Error;
use crate::format::Format;
use crate::hdf5;
use crate::marker_file::{
    Clock, ColumnKind, ColumnLayout, FieldLine, FieldLines, LengthUnit, MarkerFile,
};
use std::path::Path;

/// Reads the bytes of a file of DeepLabCut into frames by number and positions with likelihoods; `path` is for
/// messages. Markers of several animals are named `animal:part`. An error for missing header rows, other coordinates,
/// or an image name without a frame number.
pub(crate) fn read(path: &Path, bytes: &[u8]) -> Result<MarkerFile, Error> {
    let bytes = hdf5::deeplabcut_table(path, bytes)?;
    let lines = FieldLines::new(path, Format::DeepLabCut, &bytes, b',')?;
    let header: Vec<&FieldLine> = lines.list.iter().take(4).collect();
    let row = |name: &str| header.iter().find(|l| l.field(0) == name).copied();
    let (Some(scorer), Some(parts), Some(coords)) =
        (row("scorer"), row("bodyparts"), row("coords"))
    else {
        return lines.rejected(
            1,
            "no rows `scorer`, `bodyparts` and `coords`",
            "all three rows above the numbers",
        );
    };
    let individuals = row("individuals");
    // Names of images may fill several columns.
    let first = (1..scorer.len()).find(|i| !scorer.field(*i).is_empty()).unwrap_or(scorer.len());
    let mut layout = ColumnLayout::new(&lines, coords.number);
    let mut in_space = false;
    // Spreadsheet programs pad the lines with empty columns.
    for column in (first..coords.len()).filter(|column| !coords.field(*column).is_empty()) {
        let part = parts.field(column);
        let name = match individuals.map(|row| row.field(column)) {
            Some(animal) => format!("{animal}:{part}"),
            None => part.to_string(),
        };
        let coordinate = coords.field(column);
        let kind = match coordinate {
            "likelihood" => ColumnKind::Likelihood,
            coordinate => match ColumnKind::axis(coordinate) {
                Some(kind) => kind,
                None => {
                    let found = format!("coords `{coordinate}`");
                    return lines.rejected(coords.number, &found, "x, y, z or likelihood");
                }
            },
        };
        in_space |= kind == ColumnKind::Axis(2);
        layout.add(column, &name, kind)?;
    }
    if layout.is_empty() {
        return lines.rejected(coords.number, "no column", "x and y of at least one body part");
    }
    let rows: Vec<&FieldLine> = lines
        .list
        .iter()
        .skip_while(|l| l.number <= coords.number)
        .filter(|l| !l.is_empty())
        .collect();
    // The frame number is found by all names, as one name may have several groups of digits.
    let names: Vec<&str> = rows.iter().map(|line| line.field(first.saturating_sub(1))).collect();
    let position = counting_group(&names);
    let rows = rows.into_iter();
    let frame = |_, line: &FieldLine| {
        let name = line.field(first.saturating_sub(1));
        let number = frame(name, position);
        number.ok_or_else(|| {
            let message = format!(
                "found `{name}`, allowed: a frame number, or the name of an image with a frame \
                 number"
            );
            lines.error(line.number, message)
        })
    };
    let table = layout.read(coords.len(), rows, frame)?;
    let lengths = match in_space {
        true => LengthUnit::Calibrated,
        false => LengthUnit::Pixels { down: Some(true) },
    };
    let clock = Clock::Frames { first: 0.0, rate: None };
    Ok(lines.file(clock, lengths, table))
}

/// The frame number in a cell: the cell itself if it is a number, else the group of digits with the index `group` from
/// the end in the name of an image, `img0012_cam1.png`. `None` without such digits, and for a negative number.
fn frame(name: &str, group: usize) -> Option<f64> {
    if let Ok(number) = name.parse::<f64>() {
        return (number.is_finite() && number >= 0.0).then_some(number);
    }
    digits(name).nth(group)?.parse().ok()
}

/// The groups of digits in the name of an image without its extension, the last one first.
fn digits(name: &str) -> impl Iterator<Item = &str> {
    let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
    stem.rsplit(|c: char| !c.is_ascii_digit()).filter(|digits| !digits.is_empty())
}

/// Index, from the end, of the last group of digits that increases from each name to the next; 0 if none does. Other
/// groups are the number of a camera or a date.
fn counting_group(names: &[&str]) -> usize {
    let groups = names.first().map_or(0, |name| digits(name).count());
    let number = |name: &str, group: usize| digits(name).nth(group)?.parse::<f64>().ok();
    let counts = |group: &usize| {
        names.windows(2).all(|pair| {
            let [before, after] = [pair[0], pair[1]].map(|name| number(name, *group));
            before.zip(after).is_some_and(|(before, after)| before < after)
        })
    };
    (0..groups).find(counts).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frame_is_the_number_that_increases() {
        for (names, frames) in [
            (["img0012.png", "img0013.png", "img0020.png"], [12.0, 13.0, 20.0]),
            (
                ["a-04_0012_cam1.png", "a-04_0013_cam1.png", "a-04_0014_cam1.png"],
                [12.0, 13.0, 14.0],
            ),
            (["cam2_7_2026.jpg", "cam2_8_2026.jpg", "cam2_10_2026.jpg"], [7.0, 8.0, 10.0]),
            (["0", "1", "2"], [0.0, 1.0, 2.0]),
        ] {
            let group = counting_group(&names);
            assert_eq!(names.map(|name| frame(name, group).unwrap()), frames);
        }
    }
}
