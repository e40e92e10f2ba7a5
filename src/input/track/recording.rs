//! Recordings as laboratories write them: their columns, units, clocks and image axes.

use crate::error::Error;
use crate::error::printable::token;
use crate::input::table::Row;
use crate::input::table::{LENGTHS, TIMES, Table};
use crate::input::track::axes::Axes;
use crate::input::track::format::Format;
use crate::input::track::sheet::{Clock, Lengths, Sheet, Sighted, is_called};
use crate::input::track::sigma::SigmaColumns;
use serde::{Deserialize, Serialize};

/// Units, axes and marker of a recorded file. The default is SI units or the units of the header.
///
/// ```
/// use rodfit::Observation;
/// use rodfit::fit::{Recording, Vertical};
/// // A 240 Hz camera that sees 0.4 mm a pixel, the clamp at pixel (112, 305), release at frame 37.
/// let recording = Recording {
///     fps: Some(240.0),
///     scale: Some(0.4e-3),
///     origin: Some([112.0, 305.0, 0.0]),
///     y: Some(Vertical::Down),
///     time_zero: Some(37.0),
///     ..Recording::default()
/// };
/// # let folder = tempfile::tempdir()?;
/// # let path = folder.path().join("tip.csv");
/// std::fs::write(&path, "frame,x[px],y[px]\n36,1362,305\n38,1361,310\n39,1358,\n")?;
/// let observation = Observation::read_as(&path, &recording)?;
/// assert_eq!(observation.samples.len(), 2);
/// assert_eq!(observation.samples[0].position[1], Some(-5.0 * 0.4e-3));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(default)]
pub struct Recording {
    /// Program that wrote the file; null: determined from the first bytes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub format: Option<Format>,
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
    #[serde(deserialize_with = "crate::input::arrays::some_numbers")]
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

/// Direction of the vertical image axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Vertical {
    /// Upward, as in drawings.
    Up,
    /// Downward, as in images.
    Down,
}

/// The columns x, y, z with their factors to metres.
pub(crate) type AxisColumns = [Option<(usize, f64)>; 3];

/// The columns of a recording.
pub(crate) struct Columns {
    /// The clock's column, and its unit in s.
    pub time: (usize, f64),
    pub axes: AxisColumns,
    /// Of the standard deviations, likewise.
    pub sigma: AxisColumns,
}

/// What is said of a time or a place that no number holds.
pub(crate) const BEYOND: &str =
    "a time or position that is not finite, allowed: a rate, scale and origin of plausible size";

/// Whether a time and a place are numbers, whatever rate, scale and origin made of them.
pub(crate) fn is_finite(time: f64, place: &[Option<f64>; 3]) -> bool {
    time.is_finite() && place.iter().flatten().all(|x| x.is_finite())
}

/// A marker in seconds and metres of the world, row by row.
pub(crate) struct Converted {
    /// Line in the file, and when, s; before 0 where `time_zero` leaves a row out.
    pub times: Vec<(u64, f64)>,
    pub places: Vec<[Option<f64>; 3]>,
}

impl Recording {
    /// Where a row saw the point, m.
    pub(crate) fn position(&self, axes: &AxisColumns, row: &[Option<f64>]) -> [Option<f64>; 3] {
        let origin = self.origin.unwrap_or_default();
        self.turned(std::array::from_fn(|c| {
            let (column, factor) = axes[c]?;
            row[column].map(|value| (value - origin[c]) * factor)
        }))
    }

    /// How far off a row says that its `seen` coordinates are, m.
    pub(crate) fn sigma(
        &self,
        table: &Table,
        columns: &AxisColumns,
        row: &Row,
        seen: [bool; 3],
    ) -> Result<[Option<f64>; 3], Error> {
        let mut own = [None; 3];
        for (own, column) in own.iter_mut().zip(columns) {
            let Some((column, factor)) = column else { continue };
            *own = row.values[*column].map(|value| (value, *factor, *column));
        }
        let there = columns.iter().flatten().next().map_or(0, |(column, _)| *column);
        let turned = match self.axes {
            None => own,
            Some(axes) => axes.chosen(own),
        };
        let mut sigma = [None; 3];
        for c in (0..3).filter(|c| seen[*c]) {
            let refused = |column: usize, found: String| {
                let name = &table.columns[column].0;
                let allowed = "a finite number above 0 for every place that was seen";
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

    /// The columns of standard deviations beside those of these `axes`, with their factors to metres; none where no
    /// column says them. Those without a unit have that of the places.
    pub(crate) fn sigma_columns(
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
                None => own.abs(),
                Some(_) => self.axis(table, column)?.abs(),
            };
            *slot = Some((column, factor));
        }
        Ok(columns)
    }

    /// A place along the world's axes.
    fn turned(&self, place: [Option<f64>; 3]) -> [Option<f64>; 3] {
        self.axes.map_or(place, |axes| axes.turned(place))
    }

    /// Which of the world's axes a place along some of the file's has.
    pub(crate) fn seen_along(&self, file: [bool; 3]) -> [bool; 3] {
        self.turned(file.map(|there| there.then_some(0.0))).map(|axis| axis.is_some())
    }

    /// Refuses axes that the file does not have.
    fn check_axes(&self, has: [bool; 3]) -> Result<(), String> {
        self.axes.map_or(Ok(()), |axes| axes.check(has))
    }

    /// The marker that is meant; capitals count where they tell markers apart.
    pub(crate) fn chosen<'a>(&self, sheet: &'a Sheet) -> Result<&'a Sighted, Error> {
        let exact = |name: &String| sheet.markers.iter().any(|m| m.name == *name);
        let is_exact = self.marker.as_ref().is_some_and(exact);
        let own = |m: &&Sighted| match &self.marker {
            Some(name) if is_exact => *name == m.name,
            Some(name) => is_called(&m.name, name),
            None => true,
        };
        let mut found = sheet.markers.iter().filter(own);
        match (found.next(), found.next()) {
            (Some(marker), None) => Ok(marker),
            (first, _) => {
                let names: Vec<&str> = sheet.markers.iter().map(|m| &m.name[..]).collect();
                if names.is_empty() {
                    return Err(sheet.error(1, "no column x, y or z"));
                }
                let said = match (&self.marker, first) {
                    (Some(name), None) => format!("marker = {name:?}"),
                    _ => format!("{} markers and no marker = \"..\"", names.len()),
                };
                let message = format!(
                    "{said} in a file of {}, allowed: one of {}",
                    sheet.format.program(),
                    names.join(", ")
                );
                Err(sheet.error(1, message))
            }
        }
    }

    /// A marker in seconds and metres.
    pub(crate) fn convert(&self, sheet: &Sheet, marker: &Sighted) -> Result<Converted, Error> {
        let refused = |message: String| sheet.error(1, message);
        if self.sigma.is_some() {
            let message = "sigma names columns, allowed: a number, m, for markers that are named and files of \
                           other programs";
            return Err(refused(message.into()));
        }
        let start = self.time_zero.unwrap_or(match sheet.clock {
            Clock::Time(_) => 0.0,
            Clock::Frames { first, .. } => first,
        });
        if !start.is_finite() {
            return Err(refused(format!("time_zero = {start}, allowed: a finite number")));
        }
        let rate = match (sheet.clock, self.fps) {
            (Clock::Time(_), None) => None,
            (Clock::Frames { rate: Some(rate), .. }, None) => Some(rate),
            (Clock::Frames { rate: None, .. }, Some(fps)) if fps.is_finite() && fps > 0.0 => {
                Some(fps)
            }
            (Clock::Frames { rate: None, .. }, Some(fps)) => {
                return Err(refused(format!("fps = {fps}, allowed: above 0")));
            }
            (Clock::Frames { rate: None, .. }, None) => {
                return Err(refused(
                    "the time is a frame number, which needs fps = frames a second".into(),
                ));
            }
            (Clock::Frames { rate: Some(rate), .. }, Some(fps)) => {
                let message =
                    format!("fps = {fps} beside {rate} frames a second in the file, allowed: none");
                return Err(refused(message));
            }
            (Clock::Time(_), Some(fps)) => {
                return Err(refused(format!(
                    "fps = {fps} beside a clock, allowed: beside frame numbers"
                )));
            }
        };
        let seconds = |clock: f64| match (sheet.clock, rate) {
            (_, Some(rate)) => (clock - start) / rate,
            (Clock::Time(unit), None) => (clock - start) * unit,
            (Clock::Frames { .. }, None) => f64::NAN,
        };
        let factor = match (sheet.lengths, self.scale) {
            (_, Some(scale)) if !(scale.is_finite() && scale > 0.0) => {
                return Err(refused(format!("scale = {scale}, allowed: above 0")));
            }
            (Lengths::Known(_, factor), None) => factor,
            (Lengths::Known(unit, _), Some(scale)) => {
                let message = format!(
                    "scale = {scale}, metres a pixel, beside lengths in {unit}, allowed: beside pixels, or where \
                     the file does not name the unit"
                );
                return Err(refused(message));
            }
            (Lengths::Pixels { .. }, Some(scale)) => scale,
            (Lengths::Pixels { .. }, None) => {
                let message =
                    format!("`{}` is in pixels, which needs scale = metres a pixel", marker.name);
                return Err(refused(message));
            }
            (Lengths::Calibrated, scale) => scale.unwrap_or(1.0),
        };
        let down = match (self.y, sheet.lengths) {
            (Some(y), _) => y == Vertical::Down,
            (None, Lengths::Pixels { down: Some(down) }) => down,
            (None, Lengths::Pixels { down: None }) => {
                let message = "`y` is in pixels, which needs y = \"down\" (images) or \"up\"";
                return Err(refused(message.into()));
            }
            (None, _) if sheet.format == Format::TrackMate => {
                let message = "`y` is an image coordinate, which needs y = \"down\" or \"up\"";
                return Err(refused(message.into()));
            }
            (None, _) => false,
        };
        let origin = self.origin.unwrap_or_default();
        for (axis, origin) in origin.iter().enumerate() {
            if !origin.is_finite() || *origin != 0.0 && !marker.axes[axis] {
                let name = ["x", "y", "z"][axis];
                return Err(refused(format!(
                    "origin = {origin} along {name}, allowed: a finite number, 0 without a column {name}"
                )));
            }
        }
        self.check_axes(marker.axes).map_err(refused)?;
        let least = match (self.likelihood, &marker.likelihood) {
            (None, _) => None,
            (Some(least), Some(sure)) if (0.0..=1.0).contains(&least) => Some((least, sure)),
            (Some(least), Some(_)) => {
                return Err(refused(format!("likelihood = {least}, allowed: from 0 to 1")));
            }
            (Some(least), None) => {
                let message =
                    format!("likelihood = {least} without a column likelihood, allowed: with one");
                return Err(refused(message));
            }
        };
        let factors = [factor, if down { -factor } else { factor }, factor];
        let place = |(k, place): (usize, &[Option<f64>; 3])| {
            // What the program says nothing of it is not sure of.
            if least.is_some_and(|(least, sure)| sure[k].is_none_or(|sure| sure < least)) {
                return [None; 3];
            }
            self.turned([0, 1, 2].map(|c| Some((place[c]? - origin[c]) * factors[c])))
        };
        let times: Vec<(u64, f64)> =
            sheet.rows.iter().map(|row| (row.line, seconds(row.clock))).collect();
        let places: Vec<_> = marker.places.iter().enumerate().map(place).collect();
        match times.iter().zip(&places).find(|((_, time), place)| !is_finite(*time, place)) {
            Some(((line, _), _)) => Err(sheet.error(*line, BEYOND)),
            None => Ok(Converted { times, places }),
        }
    }

    /// Refuses columns of other names, and two of one.
    pub(crate) fn check_columns(&self, table: &Table, names: &[&str]) -> Result<(), Error> {
        let sigma = self.sigma.as_ref().map(SigmaColumns::all).unwrap_or_default();
        for (i, (name, _)) in table.columns.iter().enumerate() {
            if !names.contains(&name.as_str()) && !sigma.contains(name) {
                let allowed = format!("{}, and those that sigma names", names.join(", "));
                return Err(table.error(1, &format!("column `{name}`, allowed: {allowed}")));
            }
            if table.columns[..i].iter().any(|(before, _)| before == name) {
                return Err(table.error(1, &format!("two columns `{name}`, allowed: one")));
            }
        }
        Ok(())
    }

    pub(crate) fn columns(&self, table: &Table) -> Result<Columns, Error> {
        let known = ["t", "time", "frame", "x", "y", "z"];
        self.check_columns(table, &known)?;
        let clocks = ["t", "time", "frame"].into_iter().filter_map(|name| table.find(name));
        let clocks: Vec<usize> = clocks.collect();
        let time = match clocks[..] {
            [clock] if table.columns[clock].0 == "frame" => (clock, self.frame_time(table, clock)?),
            [clock] => (clock, self.clock_time(table, clock)?),
            // Frames may be numbered beside a clock.
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
            _ => return Err(table.error(1, "two clocks, allowed: one of t, time and frame")),
        };
        let axes = self.axis_columns(table)?;
        Ok(Columns { time, axes, sigma: self.sigma_columns(table, &axes, &known)? })
    }

    /// The columns of positions. What says how to read columns that are not there is refused.
    pub(crate) fn axis_columns(&self, table: &Table) -> Result<AxisColumns, Error> {
        let mut axes = [None; 3];
        let pixels = |(_, unit): &(String, Option<String>)| unit.as_deref() == Some("px");
        if let Some(scale) = self.scale.filter(|_| !table.columns.iter().any(pixels)) {
            let message = format!(
                "scale = {scale}, metres a pixel, without a column in pixels, allowed: with one, as in \
                 x[px]; lengths in m are without a unit"
            );
            return Err(table.error(1, &message));
        }
        if self.y.is_some() && table.find("y").is_none() {
            return Err(
                table.error(1, "y = \"up\" or \"down\" without a column y, allowed: with one")
            );
        }
        for (name, origin) in ["x", "y", "z"].into_iter().zip(self.origin.unwrap_or_default()) {
            if !origin.is_finite() || origin != 0.0 && table.find(name).is_none() {
                let message = format!(
                    "origin = {origin} along {name}, allowed: a finite number, 0 without a column {name}"
                );
                return Err(table.error(1, &message));
            }
        }
        for (slot, name) in axes.iter_mut().zip(["x", "y", "z"]) {
            if let Some(column) = table.find(name) {
                *slot = Some((column, self.axis(table, column)?));
            }
        }
        if axes.iter().all(Option::is_none) {
            return Err(table.error(1, "no column x, y or z"));
        }
        if let Some(least) = self.likelihood {
            let message =
                format!("likelihood = {least} without a column likelihood, allowed: with one");
            return Err(table.error(1, &message));
        }
        self.check_axes(axes.map(|axis| axis.is_some()))
            .map_err(|message| table.error(1, &message))?;
        Ok(axes)
    }

    /// Seconds a unit of a clock that counts no frames.
    fn clock_time(&self, table: &Table, clock: usize) -> Result<f64, Error> {
        if let Some(fps) = self.fps {
            let name = &table.columns[clock].0;
            let message = format!(
                "fps = {fps} beside the clock `{name}`, allowed: beside frame numbers, a column `frame`"
            );
            return Err(table.error(1, &message));
        }
        table.factor(clock, &TIMES, "")
    }

    /// Seconds a frame.
    fn frame_time(&self, table: &Table, clock: usize) -> Result<f64, Error> {
        if let Some(unit) = &table.columns[clock].1 {
            return Err(table.error(1, &format!("unit [{unit}] of `frame`, allowed: none")));
        }
        match self.fps {
            Some(fps) if fps.is_finite() && fps > 0.0 => Ok(1.0 / fps),
            Some(fps) => Err(table.error(1, &format!("fps = {fps}, allowed: above 0"))),
            None => {
                Err(table.error(1, "the time is a frame number, which needs fps = frames a second"))
            }
        }
    }

    /// Metres a unit of an axis, negative where it points down.
    fn axis(&self, table: &Table, column: usize) -> Result<f64, Error> {
        let (name, unit_name) = &table.columns[column];
        let pixels = unit_name.as_deref() == Some("px");
        let factor = match (pixels, self.scale) {
            (true, Some(scale)) if scale.is_finite() && scale > 0.0 => scale,
            (true, Some(scale)) => {
                return Err(table.error(1, &format!("scale = {scale}, allowed: above 0")));
            }
            (true, None) => {
                let message = format!("`{name}` is in pixels, which needs scale = metres a pixel");
                return Err(table.error(1, &message));
            }
            (false, _) => table.factor(column, &LENGTHS, ", px")?,
        };
        match (name.as_str(), self.y) {
            ("y", Some(Vertical::Down)) => Ok(-factor),
            ("y", None) if pixels => {
                let message = "`y` is in pixels, which needs y = \"down\" (images) or \"up\"";
                Err(table.error(1, message))
            }
            _ => Ok(factor),
        }
    }
}
