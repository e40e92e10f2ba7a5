//! Recordings as laboratories write them: their columns, units, clocks and image axes.

use crate::error::Error;
use crate::input::table::{LENGTHS, TIMES, Table};
use serde::{Deserialize, Serialize};

/// How the numbers of a CSV file become seconds and metres. The default reads files in SI units, or
/// in the units of their header.
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
/// };
/// # let folder = tempfile::tempdir()?;
/// # let path = folder.path().join("tip.csv");
/// std::fs::write(&path, "frame,x[px],y[px]\n36,1362,305\n38,1361,310\n39,1358,\n")?;
/// let observation = Observation::read_as(&path, &recording)?;
/// assert_eq!(observation.samples.len(), 2);
/// assert_eq!(observation.samples[0].position[1], Some(-5.0 * 0.4e-3));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Recording {
    /// Frames a second, Hz; where the time is a frame number, and only there.
    pub fps: Option<f64>,
    /// Metres a pixel; where positions are in pixels, `x[px]`, and only there.
    pub scale: Option<f64>,
    /// Where the world's origin is in the file's own coordinates and units, whatever these are; 0
    /// along an axis that was not seen.
    #[serde(default, deserialize_with = "crate::input::arrays::some_numbers")]
    pub origin: Option<[f64; 3]>,
    /// Which way the y axis points; needed for pixels, up for lengths.
    pub y: Option<Vertical>,
    /// When the motion starts on the file's own clock, in its unit; what was seen before is left
    /// out, and counted in [`Observation::dropped`](crate::Observation::dropped).
    pub time_zero: Option<f64>,
}

/// Which way an axis points.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Vertical {
    /// Against gravity, as in drawings.
    Up,
    /// With gravity, as in images.
    Down,
}

/// The columns x, y, z with their factors to metres.
pub(crate) type Axes = [Option<(usize, f64)>; 3];

/// The columns of a recording.
pub(crate) struct Columns {
    /// The clock's column, and its unit in s.
    pub time: (usize, f64),
    pub axes: Axes,
}

impl Recording {
    /// Where a row saw the point, m.
    pub(crate) fn position(&self, axes: &Axes, row: &[Option<f64>]) -> [Option<f64>; 3] {
        let origin = self.origin.unwrap_or_default();
        std::array::from_fn(|c| {
            let (column, factor) = axes[c]?;
            row[column].map(|value| (value - origin[c]) * factor)
        })
    }

    /// Refuses columns of other names, and two of one.
    pub(crate) fn check_columns(table: &Table, names: &[&str]) -> Result<(), Error> {
        for (i, (name, _)) in table.columns.iter().enumerate() {
            if !names.contains(&name.as_str()) {
                let allowed = names.join(", ");
                return Err(table.error(1, &format!("column `{name}`, allowed: {allowed}")));
            }
            if table.columns[..i].iter().any(|(before, _)| before == name) {
                return Err(table.error(1, &format!("two columns `{name}`, allowed: one")));
            }
        }
        Ok(())
    }

    pub(crate) fn columns(&self, table: &Table) -> Result<Columns, Error> {
        Self::check_columns(table, &["t", "time", "frame", "x", "y", "z"])?;
        let clocks = ["t", "time", "frame"].into_iter().filter_map(|name| table.find(name));
        let clocks: Vec<usize> = clocks.collect();
        let time = match clocks[..] {
            [clock] if table.columns[clock].0 == "frame" => (clock, self.frame_time(table, clock)?),
            [clock] => (clock, self.clock_time(table, clock)?),
            [] => {
                let found: Vec<&str> = table.columns.iter().map(|(name, _)| &name[..]).collect();
                let message = format!("no column t, time or frame; found {}", found.join(", "));
                return Err(table.error(1, &message));
            }
            _ => return Err(table.error(1, "two clocks, allowed: one of t, time and frame")),
        };
        Ok(Columns { time, axes: self.axes(table)? })
    }

    /// The columns of positions. What says how to read columns that are not there is refused.
    pub(crate) fn axes(&self, table: &Table) -> Result<Axes, Error> {
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
