//! `[[shape]]` of a fit file: its keys, and their conversion to a measured or planned shape of the rod at rest.
//!
//! Input: the deserialized table, and the folder that its path is relative to. The table has the CSV file of the points
//! (read with scale, origin and direction of y), or the arc lengths `at`, m, of a planned shape. Further keys are the
//! standard deviation (a number, m, or columns of the file), the loss function, the name of the rod in a structure, the
//! use as validation data, and a photograph (`image`). Output: a [`Measurement`]. Both or neither of file and arc
//! lengths, and keys of a file in a plan, are errors with the key. A file that cannot be read is an error with its
//! path, and the line if it has one.

use crate::error::{Error, ensure};
use crate::fit::image::ImageForm;
use crate::fit::measurement::Measurement;
use crate::fit::measurement::loss::Loss;
use crate::fit::measurement::shape::RestShape;
use crate::fit::observation_form::Sigma;
use marker_files::{ColumnRules, Recording, Vertical};
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// `[[shape]]`: a measured or planned shape of the rod at rest.
#[derive(Clone, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct ShapeForm {
    /// CSV file with the arc length `s` or the node, and x, y, z.
    file: Option<PathBuf>,
    /// Columns of the file by name or number, where the header has other names or is missing.
    columns: Option<ColumnRules>,
    /// Name of the rod in a structure.
    rod: Option<String>,
    /// Arc lengths of the points of a planned shape, m, instead of a file.
    #[serde(default)]
    at: Vec<f64>,
    /// Standard deviation of a coordinate, m, or columns of the file.
    sigma: Option<Sigma>,
    /// Loss function of the residuals.
    #[serde(default)]
    loss: Loss,
    /// Whether the shape is validation data: predicted, not fitted.
    #[serde(default)]
    held_out: bool,
    /// Meters per pixel, or per length unit where the file states none.
    scale: Option<f64>,
    /// Position of the world's origin in the file's own coordinates and unit.
    #[serde(default, deserialize_with = "crate::input::arrays::some_numbers")]
    origin: Option<[f64; 3]>,
    /// Direction of the file's y axis.
    y: Option<Vertical>,
    /// Photograph, over which the page of the fit draws data and model: its name, or a table.
    image: Option<ImageForm>,
}

impl ShapeForm {
    /// The measurement of the table: the points of the file, whose path is relative to `folder`, or planned points at
    /// the arc lengths `at`. An error, with the `key` of the table in the fit file, for both, neither, or keys of files
    /// in a plan. A file that cannot be read is an error, too.
    pub fn read(self, folder: &Path, key: &str) -> Result<Measurement, Error> {
        let Self { columns, sigma, loss, held_out, scale, origin, y, .. } = self;
        let rod = self.rod;
        let (sigma, sigma_columns) = sigma.map_or((None, None), Sigma::parts);
        let recording =
            Recording { columns, scale, origin, y, sigma: sigma_columns, ..Recording::default() };
        // A shape has a file or planned arc lengths, not both.
        let mut read = match &self.file {
            Some(file) if self.at.is_empty() => {
                RestShape::read_as(marker_files::file::at(folder, file), &recording)?
            }
            None if self.at.is_empty() => {
                let allowed = "a file, or at = [arc lengths in m] for a planned shape";
                return Err(Error::invalid(format!("{key}.file"), "none", allowed));
            }
            None if recording == Recording::default() => RestShape::planned(&self.at),
            _ => {
                let found = format!("{:?}", self.at);
                let allowed =
                    "a file with the keys of its format, or at = [..] for a planned shape";
                return Err(Error::invalid(format!("{key}.at"), found, allowed));
            }
        };
        if let Some(image) = &self.image {
            let no_plan = "no picture of a planned shape";
            ensure(
                self.file.is_some(),
                format!("{key}.image"),
                "a picture without a file",
                no_plan,
            )?;
            let positions: Vec<_> = read.sightings.iter().map(|s| s.position).collect();
            let pixels = read.header.pixels;
            read.header.images = image.of_shape(folder, key, &positions, pixels, &recording)?;
        }
        let mut read = read.with_properties(sigma, loss, held_out);
        read.data.rod = rod;
        Ok(read.into())
    }
}
