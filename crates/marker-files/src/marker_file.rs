//! Contents of a file of markers, common to all formats: the frames, and the positions of the markers in them.

use crate::error::Error;
use crate::format::Format;
use crate::table::{csv_error, number};
use crate::unknown_file::check_text;
use csv::{ReaderBuilder, StringRecord, Trim};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Frames and markers of a file, in its units.
#[derive(Clone, Debug)]
pub struct MarkerFile {
    /// The file.
    pub path: PathBuf,
    /// Format of the file.
    pub format: Format,
    /// Quantity that the clock counts.
    pub clock: Clock,
    /// Unit of the positions.
    pub lengths: LengthUnit,
    /// Frames by increasing time.
    pub frames: Vec<Frame>,
    /// Markers in the order of the file.
    pub markers: Vec<MarkerData>,
}

impl MarkerFile {
    /// An error at a line of this file.
    pub fn error(&self, line: u64, message: impl Into<String>) -> Error {
        Error::Data { path: self.path.clone(), line, message: message.into() }
    }
}

/// A frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Line in the file.
    pub line: u64,
    /// Reading of the clock.
    pub clock: f64,
}

/// Quantity that a clock counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Clock {
    /// Time, with the number of seconds per unit.
    Time(f64),
    /// Frame numbers.
    Frames {
        /// Number of the first frame of the recording.
        first: f64,
        /// Frames per second, if the file has them.
        rate: Option<f64>,
    },
}

/// Unit of positions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LengthUnit {
    /// A unit of length, with its size in meters.
    Known(&'static str, f64),
    /// Pixels.
    Pixels {
        /// Whether y points down, if that is the same in all files of the program.
        down: Option<bool>,
    },
    /// The unit of a calibration, which the file does not name.
    Calibrated,
}

/// The unit of length with this name, in the spelling of any program.
pub(crate) fn length_unit(name: &str) -> Option<LengthUnit> {
    Some(match &name.to_lowercase()[..] {
        "mm" | "millimeters" | "millimetres" => LengthUnit::Known("mm", 1e-3),
        "cm" | "centimeters" | "centimetres" => LengthUnit::Known("cm", 1e-2),
        "m" | "meters" | "metres" => LengthUnit::Known("m", 1.0),
        _ => return None,
    })
}

/// Whether a marker has this name, ignoring case.
pub fn is_same_name(marker: &str, name: &str) -> bool {
    marker.to_lowercase() == name.to_lowercase()
}

/// Positions of a marker in all frames.
#[derive(Clone, Debug, PartialEq)]
pub struct MarkerData {
    /// Name of the marker; empty in a table of one.
    pub name: String,
    /// Whether x, y and z were recorded.
    pub axes: [bool; 3],
    /// Positions in all frames; `None` where the marker was not detected.
    pub positions: Vec<[Option<f64>; 3]>,
    /// Confidence of the program in each position, from 0 to 1, where the file has it.
    pub likelihood: Option<Vec<Option<f64>>>,
}

/// A file as lines of fields, without blank lines.
pub(crate) struct Lines {
    pub path: PathBuf,
    /// Whether numbers may have decimal commas.
    commas: bool,
    pub list: Vec<Line>,
}

/// A line.
pub(crate) struct Line {
    /// Its number in the file.
    pub number: u64,
    fields: StringRecord,
}

impl Line {
    /// A field without surrounding spaces; empty beyond the last.
    pub fn field(&self, column: usize) -> &str {
        self.fields.get(column).unwrap_or("")
    }

    pub fn fields(&self) -> impl Iterator<Item = &str> {
        self.fields.iter()
    }

    pub fn len(&self) -> usize {
        self.fields.len()
    }

    /// Whether all fields are empty.
    pub fn is_empty(&self) -> bool {
        self.fields.iter().all(str::is_empty)
    }
}

impl Lines {
    /// Splits a file at `delimiter`; with semicolons and tabs numbers may have decimal commas.
    pub fn of(path: &Path, bytes: &[u8], delimiter: u8) -> Result<Self, Error> {
        check_text(path, bytes)?;
        let mut reader = ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .trim(Trim::All)
            .delimiter(delimiter)
            .from_reader(bytes);
        let mut list = Vec::new();
        let mut fields = StringRecord::new();
        while reader.read_record(&mut fields).map_err(|e| csv_error(path, e))? {
            // The reader reports the position before the blank lines that it skips.
            let from = fields.position().map_or(0, |at| at.byte()) as usize;
            let blank = bytes[from.min(bytes.len())..].iter().take_while(|b| b"\r\n".contains(b));
            let skipped = blank.filter(|b| **b == b'\n').count() as u64;
            let number = fields.position().map_or(0, |at| at.line()) + skipped;
            list.push(Line { number, fields: fields.clone() });
        }
        Ok(Self { path: path.into(), commas: b";\t".contains(&delimiter), list })
    }

    /// An error at a line of this file.
    pub fn error(&self, line: u64, message: impl Into<String>) -> Error {
        Error::Data { path: self.path.clone(), line, message: message.into() }
    }

    /// The error of a file that does not have the format.
    pub fn format_error(&self, format: Format, line: u64, found: &str, allowed: &str) -> Error {
        let words = format!(
            "found {found}, allowed: {allowed}, in a file of {}; format = \"csv\" or another says what it is",
            format.program()
        );
        self.error(line, words)
    }

    /// A number, or none in a blank field.
    pub fn number(&self, line: &Line, column: usize, name: &str) -> Result<Option<f64>, Error> {
        let field = line.field(column);
        match self.commas && field.contains(',') {
            // The error shows the field as it is in the file.
            true => number(&field.replace(',', "."), name, &self.path, line.number)
                .or_else(|_| number(field, name, &self.path, line.number)),
            false => number(field, name, &self.path, line.number),
        }
    }

    /// A number in a field that must not be blank.
    pub fn required_number(&self, line: &Line, column: usize, name: &str) -> Result<f64, Error> {
        self.number(line, column, name)?
            .ok_or_else(|| self.error(line.number, format!("`{name}` is blank, allowed: a number")))
    }

    /// A rate, frames per second.
    pub fn rate(&self, line: &Line, column: usize, name: &str) -> Result<f64, Error> {
        let rate = self.required_number(line, column, name)?;
        match rate > 0.0 {
            true => Ok(rate),
            false => {
                let message = format!("{name} = {rate}, allowed: above 0 frames a second");
                Err(self.error(line.number, message))
            }
        }
    }
}

/// Quantity in a column of a marker.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum ColumnKind {
    /// A coordinate: x, y or z.
    Axis(usize),
    /// Confidence of the program in the position.
    Likelihood,
}

impl ColumnKind {
    /// The coordinate with this name, ignoring case.
    pub fn axis(name: &str) -> Option<Self> {
        let axis = ["x", "y", "z"].iter().position(|axis| name.eq_ignore_ascii_case(axis))?;
        Some(Self::Axis(axis))
    }
}

/// Markers and quantities of the columns of a file.
#[derive(Default)]
pub(crate) struct Layout {
    /// Indices of the markers by their names: files may have a hundred thousand columns.
    markers: HashMap<String, usize>,
    /// Names of the markers, and whether x, y, z and likelihood are present.
    names: Vec<(String, [bool; 4])>,
    /// Column, marker, and quantity.
    columns: Vec<(usize, usize, ColumnKind)>,
}

impl Layout {
    /// Adds a column; rejects a second one with the same quantity of a marker.
    pub fn add(
        &mut self,
        lines: &Lines,
        line: u64,
        (column, name, kind): (usize, &str, ColumnKind),
    ) -> Result<(), Error> {
        let marker = self.markers.get(name).copied().unwrap_or_else(|| {
            self.markers.insert(name.into(), self.names.len());
            self.names.push((name.into(), [false; 4]));
            self.names.len() - 1
        });
        let (what, own) = match kind {
            ColumnKind::Axis(axis) => (["x", "y", "z"][axis], axis),
            ColumnKind::Likelihood => ("likelihood", 3),
        };
        if std::mem::replace(&mut self.names[marker].1[own], true) {
            let message = format!("two columns {what} of the marker `{name}`, allowed: one");
            return Err(lines.error(line, message));
        }
        self.columns.push((column, marker, kind));
        Ok(())
    }

    /// Whether there is no marker.
    pub fn is_empty(&self) -> bool {
        self.names.is_empty()
    }

    /// Rejects markers without x or y.
    fn check(&self, lines: &Lines, line: u64) -> Result<(), Error> {
        match self.names.iter().find(|(_, has)| !has[0] || !has[1]) {
            None => Ok(()),
            Some((name, _)) => {
                let message = format!("marker `{name}` without a column x or y, allowed: both");
                Err(lines.error(line, message))
            }
        }
    }

    /// Reads the rows. `clock` returns the reading of the clock in a row with its number from 0 on. `header` is the line
    /// with the names of the columns, and `width` their number.
    pub fn read<'a>(
        self,
        lines: &Lines,
        (header, width): (u64, usize),
        rows: impl Iterator<Item = &'a Line>,
        clock: impl Fn(usize, &Line) -> Result<f64, Error>,
    ) -> Result<(Vec<Frame>, Vec<MarkerData>), Error> {
        self.check(lines, header)?;
        let new = |(name, [x, y, z, likelihood]): (String, [bool; 4])| MarkerData {
            name,
            axes: [x, y, z],
            positions: Vec::new(),
            likelihood: likelihood.then(Vec::new),
        };
        let mut markers: Vec<MarkerData> = self.names.into_iter().map(new).collect();
        let mut found: Vec<Frame> = Vec::new();
        for (k, line) in rows.enumerate() {
            if line.len() < width || line.fields().skip(width).any(|field| !field.is_empty()) {
                let message =
                    format!("found {} fields, allowed: {width} as in the header", line.len());
                return Err(lines.error(line.number, message));
            }
            let now = clock(k, line)?;
            if let Some(before) = found.last().filter(|before| before.clock >= now) {
                let message =
                    format!("time or frame {now} after {}, allowed: increasing ones", before.clock);
                return Err(lines.error(line.number, message));
            }
            found.push(Frame { line: line.number, clock: now });
            markers.iter_mut().for_each(|m| m.positions.push([None; 3]));
            for (column, marker, kind) in &self.columns {
                let own = &mut markers[*marker];
                match kind {
                    ColumnKind::Axis(axis) => {
                        let name = format!("{} {}", own.name, ["x", "y", "z"][*axis]);
                        own.positions[k][*axis] = lines.number(line, *column, &name)?;
                    }
                    ColumnKind::Likelihood => {
                        let value = lines.number(line, *column, "likelihood")?;
                        own.likelihood.get_or_insert_default().push(value);
                    }
                }
            }
        }
        if found.is_empty() {
            return Err(lines.error(header, "no row below the header, allowed: one at least"));
        }
        Ok((found, markers))
    }
}
