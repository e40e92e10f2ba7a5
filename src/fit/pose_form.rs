//! `[[observation]]` with `quantity = "pose"`: measured orientations of a point of the rod.
//!
//! Input: the keys of the table ([`SensorForm`]), its [`SensorTable`] with the path of the file, and the prepared
//! scene. Output: three measurements, of the rotation about tangent and both directors, rad, or in a planar scene one,
//! of the angle about the normal; each with filter, standard deviation, loss and `held_out` of the table.
//!
//! Errors have the key: a tare in numbers, a free mounting together with `axes` or `rotation`, and those of
//! [`PoseSensor::measurements`]. A file that cannot be read is an error with its path.

use crate::error::{Error, ensure};
use crate::fit::measurement::Measurement;
use crate::fit::measurement::pose_sensor::{Mounting, PoseSensor};
use crate::fit::measurement::sensor_table::SensorTable;
use crate::fit::sensor_form::{NuisanceTare, SensorForm, TareForm};
use crate::problem::Problem;
use crate::scene::Point;
use std::path::Path;

impl SensorForm {
    /// The measurements of the rotations in the file at `path`, which is read as the `table` states. `key` is that of
    /// the table in the fit file, for errors: those of the module's header.
    pub(super) fn read_pose(
        &self,
        table: &SensorTable,
        path: &Path,
        problem: &Problem,
        key: &str,
    ) -> Result<Vec<Measurement>, Error> {
        let (axes, rotation) = (self.recording.axes, self.rotation);
        let mounting = match self.tare {
            None => Mounting::Known { axes, rotation },
            Some(TareForm::Nuisance(NuisanceTare::Free)) => Mounting::Free,
            Some(_) => {
                let allowed = "\"free\"; axes and rotation state a known mounting";
                return Err(Error::invalid(format!("{key}.tare"), "numbers", allowed));
            }
        };
        let allowed = "no such key with tare = \"free\", which estimates the whole mounting";
        let is_free = mounting == Mounting::Free;
        let has_axes = is_free && axes.is_some();
        ensure(!has_axes, format!("{key}.axes"), "axes of a free mounting", allowed)?;
        let is_rotated = is_free && rotation != [0.0; 3];
        ensure(!is_rotated, format!("{key}.rotation"), "a rotation of a free mounting", allowed)?;
        let read = table.read_rotations(path, self.body.as_deref())?;
        let low_pass = self.filter.map(|filter| filter.low_pass);
        let point = self.point.unwrap_or(Point::Tip);
        let (readings, sensor) = (read.readings, self.sensor.clone());
        let sensor = PoseSensor { point, readings, mounting, low_pass, sensor };
        let below = |error: Error| match &error {
            Error::Invalid { key: own, found, allowed, .. } if own == "file" => {
                // The contents of the file are named with its path.
                let found = format!("{} with {found}", path.display());
                Error::invalid(format!("{key}.file"), found, allowed.clone())
            }
            _ => error.below(key),
        };
        let measurements = sensor.measurements(problem).map_err(below)?.into_iter();
        let with_keys = |own: Measurement| {
            let mut own = own.with_source(path, &self.recording, read.dropped);
            own.header.assumed_unit = read.assumed_unit.clone();
            own.with_properties(self.sigma, self.loss, self.held_out)
        };
        Ok(measurements.map(with_keys).collect())
    }
}
