//! The one table that all readers make of their files: when, and where each marker was.

use crate::error::Error;
use crate::input::table::number;
use crate::input::track::format::Format;
use crate::input::unknown_file::check_text;
use csv::{ReaderBuilder, StringRecord, Trim};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// What a program wrote down of markers, in its own units.
#[derive(Clone, Debug)]
pub(crate) struct Sheet {
    pub path: PathBuf,
    pub format: Format,
    pub clock: Clock,
    pub lengths: Lengths,
    /// One per frame, by increasing time.
    pub rows: Vec<Row>,
    pub markers: Vec<Sighted>,
}

impl Sheet {
    /// An error at a line of this file.
    pub fn error(&self, line: u64, message: impl Into<String>) -> Error {
        Error::Data { path: self.path.clone(), line, message: message.into() }
    }
}

/// A frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Row {
    /// Line in the file.
    pub line: u64,
    /// What its clock said.
    pub clock: f64,
}

/// What a clock counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Clock {
    /// Time, so many seconds a unit.
    Time(f64),
    /// Frames from this number on, and how many a second, if the file says so.
    Frames { first: f64, rate: Option<f64> },
}

/// What places are measured in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Lengths {
    /// A unit, so many metres.
    Known(&'static str, f64),
    /// Pixels; whether y points down, if the program always writes it so.
    Pixels { down: Option<bool> },
    /// The unit of a calibration that the file does not name.
    Calibrated,
}

/// Units of lengths as programs spell them.
pub(crate) fn unit(name: &str) -> Option<Lengths> {
    Some(match &name.to_lowercase()[..] {
        "mm" | "millimeters" | "millimetres" => Lengths::Known("mm", 1e-3),
        "cm" | "centimeters" | "centimetres" => Lengths::Known("cm", 1e-2),
        "m" | "meters" | "metres" => Lengths::Known("m", 1.0),
        _ => return None,
    })
}

/// Whether a marker is called so, with whatever capitals.
pub(crate) fn is_called(marker: &str, name: &str) -> bool {
    marker.to_lowercase() == name.to_lowercase()
}

/// A marker, row by row.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Sighted {
    pub name: String,
    /// Which of x, y and z it has.
    pub axes: [bool; 3],
    pub places: Vec<[Option<f64>; 3]>,
    /// How sure the program is of each, where it says so.
    pub likelihood: Option<Vec<Option<f64>>>,
}

/// A file as lines of fields, blank lines left out.
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
    /// A field without spaces around it; nothing beyond the last.
    pub fn field(&self, column: usize) -> &str {
        self.fields.get(column).unwrap_or("")
    }

    pub fn fields(&self) -> impl Iterator<Item = &str> {
        self.fields.iter()
    }

    pub fn len(&self) -> usize {
        self.fields.len()
    }

    /// Whether nothing stands in it.
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
        while reader
            .read_record(&mut fields)
            .map_err(|e| crate::input::table::csv_error(path, e))?
        {
            // The reader counts from before the blank lines that it leaves out.
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

    /// The error of a file that is not what it is read as.
    pub fn not_of(&self, format: Format, line: u64, found: &str, allowed: &str) -> Error {
        let words = format!(
            "found {found}, allowed: {allowed}, in a file of {}; format = \"csv\" or another says what it is",
            format.program()
        );
        self.error(line, words)
    }

    /// A number, or nothing.
    pub fn number(&self, line: &Line, column: usize, name: &str) -> Result<Option<f64>, Error> {
        let field = line.field(column);
        match self.commas && field.contains(',') {
            // The error shows the field as in the file.
            true => number(&field.replace(',', "."), name, &self.path, line.number)
                .or_else(|_| number(field, name, &self.path, line.number)),
            false => number(field, name, &self.path, line.number),
        }
    }

    /// A number that must be there.
    pub fn some_number(&self, line: &Line, column: usize, name: &str) -> Result<f64, Error> {
        self.number(line, column, name)?
            .ok_or_else(|| self.error(line.number, format!("`{name}` is blank, allowed: a number")))
    }

    /// A rate in frames a second.
    pub fn rate(&self, line: &Line, column: usize, name: &str) -> Result<f64, Error> {
        let rate = self.some_number(line, column, name)?;
        match rate > 0.0 {
            true => Ok(rate),
            false => {
                let message = format!("{name} = {rate}, allowed: above 0 frames a second");
                Err(self.error(line.number, message))
            }
        }
    }
}

/// What a column says of a marker.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Says {
    /// Its x, y or z.
    Axis(usize),
    /// How sure the program is.
    Likelihood,
}

impl Says {
    /// x, y or z, in either case.
    pub fn axis(name: &str) -> Option<Self> {
        let axis = ["x", "y", "z"].iter().position(|axis| name.eq_ignore_ascii_case(axis))?;
        Some(Self::Axis(axis))
    }
}

/// Which columns say what of which marker.
#[derive(Default)]
pub(crate) struct Layout {
    /// The markers' numbers by their names: files may have a hundred thousand columns.
    markers: HashMap<String, usize>,
    /// Their names, and what there is of each: x, y, z and likelihood.
    names: Vec<(String, [bool; 4])>,
    /// Column, marker, and what it says.
    columns: Vec<(usize, usize, Says)>,
}

impl Layout {
    /// Adds a column; refuses a second one that says the same.
    pub fn add(
        &mut self,
        lines: &Lines,
        line: u64,
        (column, name, says): (usize, &str, Says),
    ) -> Result<(), Error> {
        let marker = self.markers.get(name).copied().unwrap_or_else(|| {
            self.markers.insert(name.into(), self.names.len());
            self.names.push((name.into(), [false; 4]));
            self.names.len() - 1
        });
        let (what, own) = match says {
            Says::Axis(axis) => (["x", "y", "z"][axis], axis),
            Says::Likelihood => ("likelihood", 3),
        };
        if std::mem::replace(&mut self.names[marker].1[own], true) {
            let message = format!("two columns {what} of the marker `{name}`, allowed: one");
            return Err(lines.error(line, message));
        }
        self.columns.push((column, marker, says));
        Ok(())
    }

    /// Whether there is no marker yet.
    pub fn is_empty(&self) -> bool {
        self.names.is_empty()
    }

    /// Refuses markers of which x or y is missing.
    fn check(&self, lines: &Lines, line: u64) -> Result<(), Error> {
        match self.names.iter().find(|(_, has)| !has[0] || !has[1]) {
            None => Ok(()),
            Some((name, _)) => {
                let message = format!("marker `{name}` without a column x or y, allowed: both");
                Err(lines.error(line, message))
            }
        }
    }

    /// Reads the rows; `clock` says when each was, by its number from 0 on. `header` is the line with the names of
    /// the columns, and `width` how many there are.
    pub fn read<'a>(
        self,
        lines: &Lines,
        (header, width): (u64, usize),
        rows: impl Iterator<Item = &'a Line>,
        clock: impl Fn(usize, &Line) -> Result<f64, Error>,
    ) -> Result<(Vec<Row>, Vec<Sighted>), Error> {
        self.check(lines, header)?;
        let new = |(name, [x, y, z, likelihood]): (String, [bool; 4])| Sighted {
            name,
            axes: [x, y, z],
            places: Vec::new(),
            likelihood: likelihood.then(Vec::new),
        };
        let mut markers: Vec<Sighted> = self.names.into_iter().map(new).collect();
        let mut found: Vec<Row> = Vec::new();
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
            found.push(Row { line: line.number, clock: now });
            markers.iter_mut().for_each(|m| m.places.push([None; 3]));
            for (column, marker, says) in &self.columns {
                let own = &mut markers[*marker];
                match says {
                    Says::Axis(axis) => {
                        let name = format!("{} {}", own.name, ["x", "y", "z"][*axis]);
                        own.places[k][*axis] = lines.number(line, *column, &name)?;
                    }
                    Says::Likelihood => {
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
