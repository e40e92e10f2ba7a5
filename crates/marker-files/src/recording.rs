//! The keys of a recording, which state properties that its file does not have, and the conversion of the file. Results
//! are in seconds and meters in the axes of the world.
//!
//! Time is (reading - start) over the frame rate, or times the unit of the clock. A coordinate is (reading - origin)
//! times the unit of the file. The key `scale` is the size of pixels, and of a unit that the file does not name (m
//! without the key). y changes its sign where it points down. The result is mapped to the world's axes. If a likelihood
//! is stated, positions with a lower one, or without any, are missing (`None`). [`Recording::convert`] converts all
//! frames of a marker of a [`MarkerFile`], which [`Recording::select_marker`] selects. For plain tables with one
//! marker, [`Recording::columns`] and its parts (`axis_columns`, `sigma_columns`) return columns of clock, coordinates
//! and standard deviations with their factors; `check_columns` rejects further columns. [`Recording::position`] returns
//! the position of a row, m, and [`Recording::row_sigma`] its standard deviations, m. [`Recording::observed_axes`]
//! returns which axes of the world are observed, [`Recording::pixel_axes`] the pixels of a picture in which a table was
//! measured. Keys that contradict the file, or are missing, are errors, as are
//! results of a conversion that are not finite.

use crate::axes::Axes;
use crate::columns::ColumnRules;
use crate::error::Error;
use crate::format::Format;
use crate::marker_file::{Clock, LengthUnit, MarkerData, MarkerFile, is_same_name};
use crate::printable::token;
use crate::sigma::SigmaColumns;
use crate::table::TableRow;
use crate::table::{LENGTHS, TIMES, Table};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};

/// Units, axes and marker of a recorded file. The default is SI units or the units of the header.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct Recording {
    /// Program that wrote the file; null: determined from the first bytes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub format: Option<Format>,
    /// Columns of a table by name or number; null: by the names of the header.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub columns: Option<ColumnRules>,
    /// Name of the marker in the file; null if there is only one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub marker: Option<String>,
    /// Confidence below which positions are treated as missing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub likelihood: Option<f64>,
    /// Axes of the file that are the world's x, y and z.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axes: Option<Axes>,
    /// Frames per second, Hz, for files with frame numbers only.
    pub fps: Option<f64>,
    /// Meters per pixel, or per unit that the file does not name.
    pub scale: Option<f64>,
    /// Position of the world's origin in the file's own coordinates and unit.
    #[serde(deserialize_with = "three_numbers")]
    pub origin: Option<[f64; 3]>,
    /// Direction of the file's y axis; required for pixels, up for lengths.
    pub y: Option<Vertical>,
    /// Time on the file's own clock, in its unit, at which the motion starts; earlier rows are
    /// dropped and counted in `dropped`.
    pub time_zero: Option<f64>,
    /// Columns with the standard deviations of the positions.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sigma: Option<SigmaColumns>,
}

/// Deserializes three numbers or null; an error for another count, as TOML's reader would ignore a fourth number.
fn three_numbers<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<[f64; 3]>, D::Error> {
    let Some(values) = Option::<Vec<f64>>::deserialize(deserializer)? else { return Ok(None) };
    let wrong_length = |values: Vec<f64>| D::Error::invalid_length(values.len(), &"3 numbers");
    values.try_into().map(Some).map_err(wrong_length)
}

/// Names of the columns of coordinates.
const AXES: [&str; 3] = ["x", "y", "z"];

/// Direction of the vertical image axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Vertical {
    /// Upward, as in drawings.
    Up,
    /// Downward, as in images.
    Down,
}

/// Columns of x, y and z, counted from 0, with their factors to meters; `None` for a coordinate without a column.
pub type AxisColumns = [Option<(usize, f64)>; 3];

/// The columns of a table with a clock and one marker.
pub struct ClockedColumns {
    /// Column of the clock, and its unit in s.
    pub time: (usize, f64),
    /// Columns of the positions, by axis of the file; the factor of y is negative if y points down.
    pub axes: AxisColumns,
    /// Columns of their standard deviations, by axis of the file; all `None` without the key `sigma`.
    pub sigma: AxisColumns,
}

/// Message on a time or position that is not finite after the conversion.
pub const NOT_FINITE: &str = "found a time or position that is not finite, allowed: finite values. Check fps, scale and \
     origin";

/// Message about frame numbers without a rate.
const NO_RATE: &str = "found frame numbers instead of times, allowed: frame numbers with fps. Set fps to the number of \
     frames per second";

/// Message about pixels without the direction of y.
const NO_DIRECTION: &str = "found `y` in pixels, allowed: pixels with the direction of y. Set y = \"down\" (images) or \
     y = \"up\"";

/// Message about pixels of `name`, a column or marker, without their size.
fn no_scale(name: &str) -> String {
    format!(
        "found `{name}` in pixels, allowed: pixels with scale. Set scale to the size of a pixel in m"
    )
}

/// The `value` of a key if it is finite and above 0; else the message with the key.
fn positive(key: &str, value: f64) -> Result<f64, String> {
    match value.is_finite() && value > 0.0 {
        true => Ok(value),
        false => Err(format!("found {key} = {value}, allowed: a number above 0")),
    }
}

/// Whether a time and all coordinates of a position are finite after the conversion by rate, scale and origin. Missing
/// coordinates (`None`) count as finite.
pub fn is_finite(time: f64, position: &[Option<f64>; 3]) -> bool {
    time.is_finite() && position.iter().flatten().all(|x| x.is_finite())
}

/// The trajectory of a marker in seconds and meters in the axes of the world.
pub struct Converted {
    /// Line in the file and time, s, of all frames; negative before `time_zero`.
    pub times: Vec<(u64, f64)>,
    /// Positions in all frames, m; a coordinate that was not observed is `None`.
    pub positions: Vec<[Option<f64>; 3]>,
    /// Pixels of the picture in which the positions were measured; `None` if they are lengths.
    pub pixels: Option<PixelAxes>,
}

/// Coordinates x and y of a file in pixels of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelAxes {
    /// Size of a pixel, m.
    pub size: f64,
    /// Whether y points down.
    pub down: bool,
    /// Whether both count from the center of the picture. Otherwise they count from its left edge, and from its upper
    /// edge if y points down, or its lower edge if y points up.
    pub is_centered: bool,
}

impl Recording {
    /// The position in a row of a table, m, in the axes of the world: (reading - origin) times the factor of each
    /// column. `axes` are the columns of the file's coordinates; a coordinate without a column or reading is `None`.
    pub fn position(&self, axes: &AxisColumns, row: &[Option<f64>]) -> [Option<f64>; 3] {
        // Origin in the units of the file, then the factor to m, then the axes of the world.
        let origin = self.origin.unwrap_or_default();
        self.to_world(std::array::from_fn(|c| {
            let (column, factor) = axes[c]?;
            row[column].map(|value| (value - origin[c]) * factor)
        }))
    }

    /// Standard deviations, m, of the coordinates of a row that are `observed`, in the axes of the world; `None` for
    /// others. `columns` are those of the standard deviations with their factors to m, in the axes of the file. An
    /// error for an observed coordinate whose standard deviation is blank, or not finite and positive.
    pub fn row_sigma(
        &self,
        table: &Table,
        columns: &AxisColumns,
        row: &TableRow,
        observed: [bool; 3],
    ) -> Result<[Option<f64>; 3], Error> {
        let mut own = [None; 3];
        for (own, column) in own.iter_mut().zip(columns) {
            let Some((column, factor)) = column else { continue };
            *own = row.values[*column].map(|value| (value, *factor, *column));
        }
        // A blank is reported at the first stated column, because it has none of its own.
        let there = columns.iter().flatten().next().map_or(0, |(column, _)| *column);
        // The standard deviations follow their coordinates into the axes of the world, without a
        // sign.
        let turned = match self.axes {
            None => own,
            Some(axes) => axes.select(own),
        };
        let mut sigma = [None; 3];
        for c in (0..3).filter(|c| observed[*c]) {
            let refused = |column: usize, found: String| {
                let name = &table.columns[column].0;
                let allowed = "a finite number above 0 for every observed position";
                table
                    .error(row.line, &format!("column `{name}`: found {found}, allowed: {allowed}"))
            };
            match turned[c] {
                Some((value, factor, _))
                    if value * factor > 0.0 && (value * factor).is_finite() =>
                {
                    sigma[c] = Some(value * factor);
                }
                Some((value, _, column)) => return Err(refused(column, value.to_string())),
                None => return Err(refused(there, "a blank".into())),
            }
        }
        Ok(sigma)
    }

    /// Columns of the standard deviations of these `axes` (of the file), with their positive factors to meters; all
    /// `None` without the key `sigma`. Columns without a unit have that of the positions. `others` are names of columns
    /// with other contents.
    ///
    /// # Errors
    ///
    /// An axis for which the key states no column, and columns that are missing, have other contents or an unknown
    /// unit.
    pub fn sigma_columns(
        &self,
        table: &Table,
        axes: &AxisColumns,
        others: &[&str],
    ) -> Result<AxisColumns, Error> {
        let Some(sigma) = &self.sigma else { return Ok([None; 3]) };
        let found = sigma.find(table, axes.map(|axis| axis.is_some()), others)?;
        let mut columns = [None; 3];
        for ((slot, column), axis) in columns.iter_mut().zip(found).zip(axes) {
            let (Some(column), Some((_, own))) = (column, axis) else { continue };
            let factor = match &table.columns[column].1 {
                // A column without a unit has that of its coordinate; an axis that points down
                // has a negative factor.
                None => own.abs(),
                Some(_) => self.axis(table, column)?.abs(),
            };
            *slot = Some((column, factor));
        }
        Ok(columns)
    }

    /// Converts a position from the axes of the file to those of the world; unchanged without the key `axes`.
    fn to_world(&self, position: [Option<f64>; 3]) -> [Option<f64>; 3] {
        self.axes.map_or(position, |axes| axes.to_world(position))
    }

    /// Whether x, y and z of the world are observed, by the key `axes`, in a file that has the axes x, y and z where
    /// `file` is true.
    pub fn observed_axes(&self, file: [bool; 3]) -> [bool; 3] {
        self.to_world(file.map(|there| there.then_some(0.0))).map(|axis| axis.is_some())
    }

    /// Rejects an origin that is not finite, or not 0 along an axis that the file does not have (`has`); the error is
    /// the message.
    fn check_origin(&self, has: [bool; 3]) -> Result<(), String> {
        let mut origins = ["x", "y", "z"].iter().zip(self.origin.unwrap_or_default()).zip(has);
        match origins.find(|((_, origin), has)| !origin.is_finite() || *origin != 0.0 && !has) {
            None => Ok(()),
            Some(((name, origin), _)) => Err(format!(
                "found origin = {origin} along {name}, allowed: a finite number, and 0 if the \
                 file has no column {name}"
            )),
        }
    }

    /// Rejects a key `axes` with axes that the file does not have; the error is the message. `has` is whether the file
    /// has x, y and z.
    fn check_axes(&self, has: [bool; 3]) -> Result<(), String> {
        self.axes.map_or(Ok(()), |axes| axes.check(has))
    }

    /// The marker of a file with the name in the key `marker`, or its only one without the key. Case is ignored, unless
    /// a marker has exactly this name.
    ///
    /// # Errors
    ///
    /// A name that no marker has, or several: exactly, or in other case if none has exactly this name. Several markers
    /// without the key, and a file without markers.
    pub fn select_marker<'a>(&self, file: &'a MarkerFile) -> Result<&'a MarkerData, Error> {
        // Two markers may differ in the case of their names only: an exact match has priority.
        let exact = |name: &String| file.markers.iter().any(|m| m.name == *name);
        let is_exact = self.marker.as_ref().is_some_and(exact);
        let own = |m: &&MarkerData| match &self.marker {
            Some(name) if is_exact => *name == m.name,
            Some(name) => is_same_name(&m.name, name),
            None => true,
        };
        let mut found = file.markers.iter().filter(own);
        match (found.next(), found.next()) {
            (Some(marker), None) => Ok(marker),
            (first, _) => {
                let names: Vec<&str> = file.markers.iter().map(|m| &m.name[..]).collect();
                if names.is_empty() {
                    return Err(file.error(
                        1,
                        "found no column x, y or z, allowed: at least one of \
                                              these",
                    ));
                }
                let stated = match (&self.marker, first) {
                    (Some(name), None) => format!("marker = {name:?}"),
                    (Some(name), Some(_)) => format!("several markers with the name {name:?}"),
                    _ => format!("{} markers and no key marker", names.len()),
                };
                let message = format!(
                    "found {stated} in a file of {}, allowed: marker with one of the names {}",
                    file.format.program(),
                    names.join(", ")
                );
                Err(file.error(1, message))
            }
        }
    }

    /// Converts all frames of a marker of a file to seconds and meters in the axes of the world. The clock begins at
    /// `time_zero`, else at the first frame number of the program or zero. Missing positions, and with the key
    /// `likelihood` those with a lower or no likelihood, are `None`.
    ///
    /// # Errors
    ///
    /// The key `sigma`, which is for tables with one marker only. A missing `fps` for frame numbers without a rate,
    /// `scale` for pixels, or `y` for pixels whose direction the program does not fix and for lengths of TrackMate. A
    /// key that contradicts the file, or has a wrong value, and a result that is not finite.
    pub fn convert(&self, file: &MarkerFile, marker: &MarkerData) -> Result<Converted, Error> {
        let refused = |message: String| file.error(1, message);
        if self.sigma.is_some() {
            let message = "found column names in sigma, allowed: a number in m for named markers \
                           and for files of tracking programs";
            return Err(refused(message.into()));
        }
        // The clock begins at time_zero; without it at the first frame number, or at the zero of
        // the times.
        let start = self.time_zero.unwrap_or(match file.clock {
            Clock::Time(_) => 0.0,
            Clock::Frames { first, .. } => first,
        });
        if !start.is_finite() {
            return Err(refused(format!("found time_zero = {start}, allowed: a finite number")));
        }
        // Frame numbers need a rate, from the file or from fps, and never from both.
        let rate = match (file.clock, self.fps) {
            (Clock::Time(_), None) => None,
            (Clock::Frames { rate: Some(rate), .. }, None) => Some(rate),
            (Clock::Frames { rate: None, .. }, Some(fps)) => {
                Some(positive("fps", fps).map_err(refused)?)
            }
            (Clock::Frames { rate: None, .. }, None) => return Err(refused(NO_RATE.into())),
            (Clock::Frames { rate: Some(rate), .. }, Some(fps)) => {
                let message = format!(
                    "found fps = {fps} and {rate} frames per second in the file, allowed: \
                             no fps. Remove fps"
                );
                return Err(refused(message));
            }
            (Clock::Time(_), Some(fps)) => {
                return Err(refused(format!(
                    "found fps = {fps} and times in the file, allowed: fps with frame numbers \
                     only. Remove fps"
                )));
            }
        };
        let seconds = |clock: f64| match (file.clock, rate) {
            (_, Some(rate)) => (clock - start) / rate,
            (Clock::Time(unit), None) => (clock - start) * unit,
            // Not reached: frame numbers without a rate are rejected above.
            (Clock::Frames { .. }, None) => f64::NAN,
        };
        // Meters per unit: of the file where it names the unit, otherwise of the key scale.
        let scale =
            self.scale.map(|scale| positive("scale", scale)).transpose().map_err(refused)?;
        let factor = match (file.lengths, scale) {
            (LengthUnit::Known(_, factor), None) => factor,
            (LengthUnit::Known(unit, _), Some(scale)) => {
                let message = format!(
                    "found scale = {scale} (m per pixel) and lengths in {unit}, allowed: scale \
                     for pixels, or for a file without a stated unit. Remove scale"
                );
                return Err(refused(message));
            }
            (LengthUnit::Pixels { .. }, Some(scale)) => scale,
            (LengthUnit::Pixels { .. }, None) => return Err(refused(no_scale(&marker.name))),
            (LengthUnit::Calibrated, scale) => scale.unwrap_or(1.0),
        };
        // Pixels need a direction of y: images count downward, drawings upward.
        let down = match (self.y, file.lengths) {
            (Some(y), _) => y == Vertical::Down,
            (None, LengthUnit::Pixels { down: Some(down) }) => down,
            (None, LengthUnit::Pixels { down: None }) => return Err(refused(NO_DIRECTION.into())),
            (None, _) if file.format == Format::TrackMate => {
                let message = "found `y` as an image coordinate, allowed: with the direction of \
                               y. Set y = \"down\" or y = \"up\"";
                return Err(refused(message.into()));
            }
            (None, _) => false,
        };
        // A table has a scale for pixels only; calibrated units of programs are those of their own axes.
        let is_in_pixels = match file.lengths {
            LengthUnit::Pixels { .. } => true,
            LengthUnit::Calibrated => file.format == Format::Csv && scale.is_some(),
            LengthUnit::Known(..) => false,
        };
        let is_centered = file.format == Format::Kinovea;
        let pixels = is_in_pixels.then_some(PixelAxes { size: factor, down, is_centered });
        let origin = self.origin.unwrap_or_default();
        self.check_origin(marker.axes).map_err(refused)?;
        self.check_axes(marker.axes).map_err(refused)?;
        // A limit of the confidence is an error in files without confidences.
        let least = match (self.likelihood, &marker.likelihood) {
            (None, _) => None,
            (Some(least), Some(confidence)) if (0.0..=1.0).contains(&least) => {
                Some((least, confidence))
            }
            (Some(least), Some(_)) => {
                return Err(refused(format!("found likelihood = {least}, allowed: from 0 to 1")));
            }
            (Some(least), None) => {
                let message = format!(
                    "found likelihood = {least}, but no column likelihood, allowed: with \
                             such a column only. Remove the key"
                );
                return Err(refused(message));
            }
        };
        // The y axis of an image points down: its sign changes.
        let factors = [factor, if down { -factor } else { factor }, factor];
        let position = |(k, position): (usize, &[Option<f64>; 3])| {
            // A position without a confidence is uncertain.
            if least.is_some_and(|(least, confidence)| {
                confidence[k].is_none_or(|confidence| confidence < least)
            }) {
                return [None; 3];
            }
            self.to_world([0, 1, 2].map(|c| Some((position[c]? - origin[c]) * factors[c])))
        };
        let times: Vec<(u64, f64)> =
            file.frames.iter().map(|row| (row.line, seconds(row.clock))).collect();
        let positions: Vec<_> = marker.positions.iter().enumerate().map(position).collect();
        match times.iter().zip(&positions).find(|((_, time), position)| !is_finite(*time, position))
        {
            Some(((line, _), _)) => Err(file.error(*line, NOT_FINITE)),
            None => Ok(Converted { times, positions, pixels }),
        }
    }

    /// Rejects a table with a column that is neither in `names` nor one of the standard deviations that the key `sigma`
    /// states, or with two columns of one name.
    pub fn check_columns(&self, table: &Table, names: &[&str]) -> Result<(), Error> {
        let sigma = self.sigma.as_ref().map(SigmaColumns::all).unwrap_or_default();
        for (i, (name, _)) in table.columns.iter().enumerate() {
            if !names.contains(&name.as_str()) && !sigma.contains(name) {
                let allowed = format!("{}, and the columns in sigma", names.join(", "));
                return Err(table.error(
                    1,
                    &format!(
                        "found the column `{name}`, allowed: \
                                                    {allowed}"
                    ),
                ));
            }
            if table.columns[..i].iter().any(|(before, _)| before == name) {
                return Err(table.error(1, &format!("found two columns `{name}`, allowed: one")));
            }
        }
        Ok(())
    }

    /// The columns of clock, positions and standard deviations in a table with one marker, with their factors to s and
    /// m. The clock is `t`, `time` or `frame`; beside a time, `frame` is used if `fps` is given. Errors: other columns,
    /// no clock, both `t` and `time`, and the errors of its parts ([`axis_columns`](Self::axis_columns),
    /// [`sigma_columns`](Self::sigma_columns)). A time with `fps`, and frame numbers without, are errors too.
    pub fn columns(&self, table: &Table) -> Result<ClockedColumns, Error> {
        let known = ["t", "time", "frame", "x", "y", "z"];
        self.check_columns(table, &known)?;
        // One column is the clock, or two: a time and a frame number, of which fps selects the
        // second.
        let clocks = ["t", "time", "frame"].into_iter().filter_map(|name| table.find(name));
        let clocks: Vec<usize> = clocks.collect();
        let time = match clocks[..] {
            [clock] if table.columns[clock].0 == "frame" => (clock, self.frame_time(table, clock)?),
            [clock] => (clock, self.clock_time(table, clock)?),
            // A table may have frame numbers in addition to a clock.
            [clock, frame] if table.columns[frame].0 == "frame" => match self.fps {
                Some(_) => (frame, self.frame_time(table, frame)?),
                None => (clock, self.clock_time(table, clock)?),
            },
            [] => {
                let found: Vec<&str> = table.columns.iter().map(|(name, _)| &name[..]).collect();
                let message =
                    format!("no column t, time or frame; found {}", token(&found.join(", ")));
                return Err(table.error(1, &message));
            }
            _ => {
                return Err(table.error(
                    1,
                    "found two time columns, allowed: one of t, time and \
                                            frame",
                ));
            }
        };
        let axes = self.axis_columns(table)?;
        Ok(ClockedColumns { time, axes, sigma: self.sigma_columns(table, &axes, &known)? })
    }

    /// The columns of the positions x, y and z in a table, with their factors to m, negative where y points down;
    /// `None` for a missing coordinate. Errors: no such column, pixels without `scale` or `y`, an unknown unit, and the
    /// key `likelihood`, which tables with one marker do not have. A `scale` that no column needs, and the keys `y`,
    /// `origin` and `axes` for coordinates that the table does not have, are errors too.
    pub fn axis_columns(&self, table: &Table) -> Result<AxisColumns, Error> {
        let mut axes = [None; 3];
        // The scale is that of pixels, or of columns without a unit that the key `columns` states.
        let is_scaled = |(_, unit): &(String, Option<String>)| match unit {
            Some(unit) => unit == "px",
            None => table.has_rules,
        };
        let mut positions = table.columns.iter().filter(|(name, _)| AXES.contains(&&name[..]));
        if let Some(scale) = self.scale.filter(|_| !positions.any(is_scaled)) {
            let message = format!(
                "found scale = {scale} (m per pixel), but no column in pixels, allowed: with \
                 columns such as x[px] only. Columns without a unit are in m"
            );
            return Err(table.error(1, &message));
        }
        if self.y.is_some() && table.find("y").is_none() {
            return Err(table.error(
                1,
                "found y = \"up\" or \"down\", but no column y, allowed: with such \
                                a column only. Remove the key",
            ));
        }
        // An origin along a coordinate that the table does not have is an error.
        let in_table = ["x", "y", "z"].map(|name| table.find(name).is_some());
        self.check_origin(in_table).map_err(|message| table.error(1, &message))?;
        for (slot, name) in axes.iter_mut().zip(["x", "y", "z"]) {
            if let Some(column) = table.find(name) {
                *slot = Some((column, self.axis(table, column)?));
            }
        }
        if axes.iter().all(Option::is_none) {
            return Err(table.error(1, "found no column x, y or z, allowed: at least one of these"));
        }
        // A plain table has no confidences, so that a limit of them is a mistake.
        if let Some(least) = self.likelihood {
            let message = format!(
                "found likelihood = {least}, but no column likelihood, allowed: with such \
                         a column only. Remove the key"
            );
            return Err(table.error(1, &message));
        }
        self.check_axes(axes.map(|axis| axis.is_some()))
            .map_err(|message| table.error(1, &message))?;
        Ok(axes)
    }

    /// The pixels in which the columns x and y of a table were measured; `None` unless both are there and have the
    /// factor `scale`. `axes` are the columns with their factors to meters.
    pub fn pixel_axes(&self, axes: &AxisColumns) -> Option<PixelAxes> {
        let ([Some((_, x)), Some((_, y)), _], Some(size)) = (axes, self.scale) else { return None };
        let are_pixels = *x == size && y.abs() == size;
        are_pixels.then_some(PixelAxes { size, down: *y < 0.0, is_centered: false })
    }

    /// Seconds per unit of the clock in a column (index from 0), by the unit of its header (1 without one). An error if
    /// the key `fps` is given, or for an unknown unit.
    fn clock_time(&self, table: &Table, clock: usize) -> Result<f64, Error> {
        if let Some(fps) = self.fps {
            let name = &table.columns[clock].0;
            let message = format!(
                "found fps = {fps} and the time column `{name}`, allowed: fps with frame numbers \
                 only, a column `frame`. Remove fps"
            );
            return Err(table.error(1, &message));
        }
        table.factor(clock, &TIMES, "")
    }

    /// Seconds per frame by the key `fps`, for a column (index from 0) of frame numbers. An error without `fps`, unless
    /// it is positive and finite, or if the column has a unit.
    fn frame_time(&self, table: &Table, clock: usize) -> Result<f64, Error> {
        // A frame number is a count; a unit would contradict the frame rate.
        if let Some(unit) = &table.columns[clock].1 {
            return Err(table.error(
                1,
                &format!(
                    "found the unit [{unit}] of `frame`, allowed: no \
                                                unit"
                ),
            ));
        }
        let fps = self.fps.ok_or_else(|| table.error(1, NO_RATE))?;
        let rate = positive("fps", fps).map_err(|message| table.error(1, &message))?;
        Ok(1.0 / rate)
    }

    /// Meters per unit of the coordinate in a column (index from 0), negative if it is y and points down. It is the key
    /// `scale` for pixels, and for columns without a unit that the key `columns` states. Else it is the unit of the
    /// header, m without one. An error for pixels without scale or direction, for a scale that is not positive, and for
    /// an unknown unit.
    fn axis(&self, table: &Table, column: usize) -> Result<f64, Error> {
        let (name, unit_name) = &table.columns[column];
        let pixels = unit_name.as_deref() == Some("px");
        let is_unnamed = table.has_rules && unit_name.is_none();
        let factor = match (pixels, self.scale.filter(|_| pixels || is_unnamed)) {
            (_, Some(scale)) => {
                positive("scale", scale).map_err(|message| table.error(1, &message))?
            }
            (true, None) => return Err(table.error(1, &no_scale(name))),
            (false, None) => table.factor(column, &LENGTHS, ", px")?,
        };
        match (name.as_str(), self.y) {
            // Only y changes its sign with the direction of the vertical axis.
            ("y", Some(Vertical::Down)) => Ok(-factor),
            ("y", None) if pixels => Err(table.error(1, NO_DIRECTION)),
            _ => Ok(factor),
        }
    }
}
