//! The contents of a file of markers, common to all formats, and the parts that the readers of text formats share.
//!
//! A [`MarkerFile`] has the frames with the reading of the clock, and the positions of each marker in them, with their
//! units: [`Clock`] and [`LengthUnit`]. [`FieldLines`] splits bytes at a separator into lines of fields and leaves out
//! empty lines; binary files and fields that are not UTF-8 are errors. It also reads single fields: `number` (`None`
//! for blank and NaN), `required_number` (an error for these), and `rate` (positive). `error` builds an error with a
//! line, `rejected` that of a file without the format of its program. [`ColumnLayout`] maps columns to markers (`add`)
//! and reads rows into frames ([`FrameTable`]); blank and NaN fields are missing (`None`). A marker without x or y, two
//! columns of one quantity, and no row are errors. So are, with their line, rows with too few or further fields that
//! are not blank, other texts, and clocks that do not increase. [`length_unit`] recognizes the name of a unit;
//! [`is_same_name`] compares names of markers, ignoring case.

use crate::error::Error;
use crate::format::Format;
use crate::separator::{csv_error, record_line};
use crate::table::{has_decimal_commas, number};
use crate::units::plain_unit;
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
    pub frames: Vec<FrameReading>,
    /// Markers in the order of the file.
    pub markers: Vec<MarkerData>,
}

impl MarkerFile {
    /// An error at a line, counted from 1, of this file, with the found and the allowed content as message.
    pub fn error(&self, line: u64, message: impl Into<String>) -> Error {
        Error::data(&self.path, line, message)
    }
}

/// A frame: its line in the file, and the reading of the clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameReading {
    /// Line in the file, counted from 1; of a C3D file the number of the frame in the file.
    pub line: u64,
    /// Reading of the clock: a time in the unit of [`Clock::Time`], or a frame number.
    pub clock: f64,
}

/// Quantity that a clock counts: time or frame numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Clock {
    /// Time, with the number of seconds per unit.
    Time(f64),
    /// Frame numbers.
    Frames {
        /// Number of the frame at time zero, unless the recording states another one: that from which the program
        /// counts.
        first: f64,
        /// Frames per second, if the file has them.
        rate: Option<f64>,
    },
}

/// Unit of the positions in a file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LengthUnit {
    /// A unit of length, with its size in meters.
    Known(&'static str, f64),
    /// Pixels.
    Pixels {
        /// Whether y points down; `None` if that differs between files of the program.
        down: Option<bool>,
    },
    /// The unit of a calibration, which the file does not name.
    Calibrated,
}

/// The unit of length with this name, ignoring case: `um`, `mm`, `cm` or `m`, or their full names in the plural, as
/// `millimeters`. A micro sign is read as `u`. `None` for other names.
pub(crate) fn length_unit(name: &str) -> Option<LengthUnit> {
    Some(match &plain_unit(&name.to_lowercase())[..] {
        "um" | "micrometers" | "micrometres" => LengthUnit::Known("um", 1e-6),
        "mm" | "millimeters" | "millimetres" => LengthUnit::Known("mm", 1e-3),
        "cm" | "centimeters" | "centimetres" => LengthUnit::Known("cm", 1e-2),
        "m" | "meters" | "metres" => LengthUnit::Known("m", 1.0),
        _ => return None,
    })
}

/// Whether two names of markers are equal, ignoring case.
pub fn is_same_name(marker: &str, name: &str) -> bool {
    marker.to_lowercase() == name.to_lowercase()
}

/// Positions of a marker in all frames, in the unit of the file.
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

/// Frames and markers of a file, before its units are known.
pub(crate) struct FrameTable {
    pub frames: Vec<FrameReading>,
    pub markers: Vec<MarkerData>,
}

/// A file of a program as lines of fields, without blank lines.
pub(crate) struct FieldLines {
    pub path: PathBuf,
    format: Format,
    /// Whether numbers may have decimal commas.
    commas: bool,
    /// The lines in the order of the file.
    pub list: Vec<FieldLine>,
}

/// A line of fields, without spaces around them.
pub(crate) struct FieldLine {
    /// Its number in the file.
    pub number: u64,
    fields: StringRecord,
}

impl FieldLine {
    /// The field in a column counted from 0; empty beyond the last one.
    pub fn field(&self, column: usize) -> &str {
        self.fields.get(column).unwrap_or("")
    }

    /// All fields in their order.
    pub fn fields(&self) -> impl Iterator<Item = &str> {
        self.fields.iter()
    }

    /// Number of fields.
    pub fn len(&self) -> usize {
        self.fields.len()
    }

    /// Whether all fields are empty.
    pub fn is_empty(&self) -> bool {
        self.fields.iter().all(str::is_empty)
    }
}

impl FieldLines {
    /// Splits the bytes of a file into lines of fields at `delimiter`. Lines without any character are left out, lines
    /// of delimiters stay; lines may have different numbers of fields. With semicolons and tabs numbers may have
    /// decimal commas.
    ///
    /// # Errors
    ///
    /// Binary files, and fields that are not UTF-8 text.
    pub fn new(path: &Path, format: Format, bytes: &[u8], delimiter: u8) -> Result<Self, Error> {
        check_text(path, bytes)?;
        // Lines may have different numbers of fields: programs write several headers.
        let mut reader = ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .trim(Trim::All)
            .delimiter(delimiter)
            .from_reader(bytes);
        let mut list = Vec::new();
        let mut fields = StringRecord::new();
        while reader.read_record(&mut fields).map_err(|e| csv_error(path, bytes, e))? {
            let number = record_line(bytes, fields.position());
            list.push(FieldLine { number, fields: fields.clone() });
        }
        Ok(Self { path: path.into(), format, commas: has_decimal_commas(delimiter), list })
    }

    /// The contents of the file as a [`MarkerFile`], with this clock, unit of length, frames and markers.
    pub fn file(&self, clock: Clock, lengths: LengthUnit, table: FrameTable) -> MarkerFile {
        let FrameTable { frames, markers } = table;
        MarkerFile { path: self.path.clone(), format: self.format, clock, lengths, frames, markers }
    }

    /// An error at a line, counted from 1, of this file, with the found and the allowed content as message.
    pub fn error(&self, line: u64, message: impl Into<String>) -> Error {
        Error::data(&self.path, line, message)
    }

    /// An `Err` for a file that does not have the format of its program, at a line counted from 1. The message has the
    /// `found` and the `allowed` content, and the key `format` as the remedy for a wrong recognition.
    pub fn rejected<T>(&self, line: u64, found: &str, allowed: &str) -> Result<T, Error> {
        // The recognition by the first lines may be wrong: the message names the key that overrides it.
        let words = format!(
            "found {found}, allowed: {allowed}, in a file of {}. If this is not the format of the \
             file, set format, as in format = \"csv\"",
            self.format.program()
        );
        Err(self.error(line, words))
    }

    /// The finite number in a column, counted from 0, of a line, with a decimal comma where the separator permits it;
    /// `None` if the field is blank or NaN, an error for other texts. `name` is that of the column, for messages.
    pub fn number(
        &self,
        line: &FieldLine,
        column: usize,
        name: &str,
    ) -> Result<Option<f64>, Error> {
        number(line.field(column), self.commas, name, &self.path, line.number)
    }

    /// The number in a column, counted from 0, of a line; an error if the field is blank, NaN or another text. `name`
    /// is that of the column, for messages.
    pub fn required_number(
        &self,
        line: &FieldLine,
        column: usize,
        name: &str,
    ) -> Result<f64, Error> {
        self.number(line, column, name)?.ok_or_else(|| {
            self.error(
                line.number,
                format!(
                    "found a blank `{name}`, allowed: a \
                                                            number"
                ),
            )
        })
    }

    /// The rate, frames per second, in a column, counted from 0, of a line; an error unless it is a positive number.
    /// `name` is that of the rate, for messages.
    pub fn rate(&self, line: &FieldLine, column: usize, name: &str) -> Result<f64, Error> {
        let rate = self.required_number(line, column, name)?;
        match rate > 0.0 {
            true => Ok(rate),
            false => {
                let message = format!(
                    "found {name} = {rate}, allowed: a rate above 0 frames per \
                                       second"
                );
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
    /// The coordinate with the name x, y or z, ignoring case; `None` for another name.
    pub fn axis(name: &str) -> Option<Self> {
        let axis = AXES.iter().position(|axis| name.eq_ignore_ascii_case(axis))?;
        Some(Self::Axis(axis))
    }
}

/// Names of the coordinates.
const AXES: [&str; 3] = ["x", "y", "z"];

/// A column (counted from 0) with a quantity of a marker.
struct MarkerColumn {
    column: usize,
    /// Index of the marker.
    marker: usize,
    kind: ColumnKind,
}

/// The markers and quantities of the columns of a file, under construction.
pub(crate) struct ColumnLayout<'a> {
    lines: &'a FieldLines,
    /// Number of the line with the names of the columns.
    header: u64,
    /// Indices of the markers by their names: files may have a hundred thousand columns.
    indices: HashMap<String, usize>,
    /// The markers without positions.
    markers: Vec<MarkerData>,
    columns: Vec<MarkerColumn>,
}

impl<'a> ColumnLayout<'a> {
    /// A layout without columns, for a file whose names of columns are in the line number `header`.
    pub fn new(lines: &'a FieldLines, header: u64) -> Self {
        let (indices, markers, columns) = (HashMap::new(), Vec::new(), Vec::new());
        Self { lines, header, indices, markers, columns }
    }

    /// Adds a column, counted from 0, with a quantity of the marker `name`, which is new at its first column. An error
    /// if the marker has this quantity already.
    pub fn add(&mut self, column: usize, name: &str, kind: ColumnKind) -> Result<(), Error> {
        // A new name begins a new marker; files repeat it for each coordinate.
        let marker = self.indices.get(name).copied().unwrap_or_else(|| {
            self.indices.insert(name.into(), self.markers.len());
            let (axes, positions) = ([false; 3], Vec::new());
            self.markers.push(MarkerData { name: name.into(), axes, positions, likelihood: None });
            self.markers.len() - 1
        });
        let own = &mut self.markers[marker];
        let (quantity, is_second) = match kind {
            ColumnKind::Axis(axis) => (AXES[axis], std::mem::replace(&mut own.axes[axis], true)),
            ColumnKind::Likelihood => ("likelihood", own.likelihood.replace(Vec::new()).is_some()),
        };
        if is_second {
            let message =
                format!("found two columns {quantity} of the marker `{name}`, allowed: one");
            return Err(self.lines.error(self.header, message));
        }
        self.columns.push(MarkerColumn { column, marker, kind });
        Ok(())
    }

    /// Whether no column was added yet, so that there is no marker.
    pub fn is_empty(&self) -> bool {
        self.markers.is_empty()
    }

    /// Reads rows into frames and positions. `width` is the number of fields that each row must have; further ones must
    /// be blank. `clock` returns the reading of the clock of a row with its index, counted from 0, or an error. Errors:
    /// a marker without x or y, another number of fields, a text that is no number, a clock that does not increase, no
    /// row.
    pub fn read<'b>(
        mut self,
        width: usize,
        rows: impl Iterator<Item = &'b FieldLine>,
        clock: impl Fn(usize, &FieldLine) -> Result<f64, Error>,
    ) -> Result<FrameTable, Error> {
        let lines = self.lines;
        // z may be missing: videos have two coordinates.
        if let Some(marker) = self.markers.iter().find(|m| !m.axes[0] || !m.axes[1]) {
            let name = &marker.name;
            let message = format!(
                "found the marker `{name}` without a column x or y, allowed: \
                                   both columns"
            );
            return Err(lines.error(self.header, message));
        }
        let mut frames: Vec<FrameReading> = Vec::new();
        for (k, line) in rows.enumerate() {
            // Programs may end lines with empty fields, but a missing field would shift the others.
            if line.len() < width || line.fields().skip(width).any(|field| !field.is_empty()) {
                let message =
                    format!("found {} fields, allowed: {width} as in the header", line.len());
                return Err(lines.error(line.number, message));
            }
            let now = clock(k, line)?;
            // Clocks that stand still or go back belong to a spliced file.
            if let Some(before) = frames.last().filter(|before| before.clock >= now) {
                let message = format!(
                    "found the time or frame {now} after {}, allowed: increasing values",
                    before.clock
                );
                return Err(lines.error(line.number, message));
            }
            frames.push(FrameReading { line: line.number, clock: now });
            // Coordinates without a number stay missing.
            self.markers.iter_mut().for_each(|m| m.positions.push([None; 3]));
            for MarkerColumn { column, marker, kind } in &self.columns {
                let own = &mut self.markers[*marker];
                match kind {
                    ColumnKind::Axis(axis) => {
                        let name = format!("{} {}", own.name, AXES[*axis]);
                        own.positions[k][*axis] = lines.number(line, *column, &name)?;
                    }
                    ColumnKind::Likelihood => {
                        let value = lines.number(line, *column, "likelihood")?;
                        own.likelihood.get_or_insert_default().push(value);
                    }
                }
            }
        }
        if frames.is_empty() {
            let message = "found no row below the header, allowed: at least one";
            return Err(lines.error(self.header, message));
        }
        Ok(FrameTable { frames, markers: self.markers })
    }
}
