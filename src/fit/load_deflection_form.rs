//! `[[load_deflection]]` of a fit file: its keys, and their conversion to measured load-deflection curves.
//!
//! Input: the deserialized table, and the folder that its path is relative to. The file is a table of numbers with the
//! column `load`, in a unit of force, or of moment if the load of the scene is one. Columns `x`, `y` and `z` are
//! displacements of one point from its position without the load, in a unit of length. Loads are multiplied by
//! `load_factor`. Output: one [`Measurement`] per displacement column that the file has, with loads in N or N m and
//! displacements in m. Rows without a load, or without a displacement of this column, are left out of the measurement.
//! Errors: a `load_factor` that is 0 or not finite, and, with its path, a file that cannot be read or that lacks the
//! load or all displacements.

use crate::error::{Error, ensure};
use crate::fit::measurement::Measurement;
use crate::fit::measurement::load_deflection::{LoadDeflection, LoadedPoint};
use crate::fit::measurement::loss::Loss;
use crate::fit::measurement::sensor_reference::SensorReference;
use crate::scene::{Parameter, Point};
use marker_files::table::{LENGTHS, Table};
use marker_files::{ColumnRules, Dropped, FORCES, MOMENTS, Recording};
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// `[[load_deflection]]`: measured displacements of a point of the rod at rest under several values of one load.
#[derive(Clone, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct LoadDeflectionForm {
    /// Number of the scene that takes the values of the load, such as `loads.point.0.force.y`.
    load: Parameter,
    /// Table with the columns `load`, and `x`, `y` or `z` of the displacements.
    file: PathBuf,
    /// Columns of the file by name or number, where the header has other names or is missing.
    columns: Option<ColumnRules>,
    /// Factor of the loads in the file, such as -1 for weights; default 1.
    #[serde(default = "one")]
    load_factor: f64,
    /// Displaced point; default: the tip.
    #[serde(default)]
    point: Point,
    /// Dial gauge in `[[sensors]]` of the scene, with its reading without load; default: set to zero.
    sensor: Option<String>,
    /// Standard deviation of a displacement, m; default: estimated from the residuals.
    sigma: Option<f64>,
    /// Loss function of the residuals.
    #[serde(default)]
    loss: Loss,
    /// Whether the displacements are validation data: predicted, not fitted.
    #[serde(default)]
    held_out: bool,
}

/// The default factor of the loads.
fn one() -> f64 {
    1.0
}

impl LoadDeflectionForm {
    /// The measurements of the table, one per displacement column of the file, whose path is relative to `folder`.
    /// `key` is that of the table in the fit file, for errors. Errors: a `load_factor` that is zero or not finite, and
    /// a file that cannot be read or that lacks the load or all displacements.
    pub fn read(&self, folder: &Path, key: &str) -> Result<Vec<Measurement>, Error> {
        let factor = self.load_factor;
        let is_valid = factor.is_finite() && factor != 0.0;
        ensure(is_valid, format!("{key}.load_factor"), factor, "a finite number, not 0")?;
        let path = marker_files::file::at(folder, &self.file);
        let bytes = marker_files::file::data(&path)?;
        let table = Table::of_columns(&path, &bytes, self.columns.as_ref())?;
        let missing = |allowed: &str| {
            let found = table.columns_found();
            let message =
                format!("found the columns {found}, allowed: {allowed}, or the key columns");
            Error::from(table.error(1, &message))
        };
        let load = table.find("load").ok_or_else(|| missing("a column load"))?;
        let units: Vec<(&str, f64)> = match self.load.unit() {
            "N m" => MOMENTS.to_vec(),
            _ => FORCES.to_vec(),
        };
        let unit = factor * table.factor(load, &units, "")?;
        let mut measurements = Vec::new();
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            let Some(column) = table.find(name) else { continue };
            let length = table.factor(column, &LENGTHS, "")?;
            let (mut curve, mut dropped) = (Vec::new(), Dropped::default());
            for row in &table.rows {
                match (row.values[load], row.values[column]) {
                    (Some(load), Some(displacement)) => curve.push(LoadedPoint {
                        load: unit * load,
                        displacement: length * displacement,
                    }),
                    _ => dropped.empty += 1,
                }
            }
            let recording = Recording { columns: self.columns.clone(), ..Recording::default() };
            let mut own = LoadDeflection::new(self.load, self.point, axis, curve)
                .with_source(&path, &recording, dropped)
                .with_properties(self.sigma, self.loss, self.held_out);
            own.data.gauge = SensorReference(self.sensor.clone());
            measurements.push(own.into());
        }
        match measurements.is_empty() {
            true => Err(missing("a column x, y or z of displacements")),
            false => Ok(measurements),
        }
    }
}
