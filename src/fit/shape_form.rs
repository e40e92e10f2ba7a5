//! `[[shape]]` of a fit file: which file, or which points are to be photographed.

use crate::error::Error;
use crate::fit::measurement::Measurement;
use crate::fit::measurement::loss::Loss;
use crate::fit::measurement::shape::RestShape;
use crate::fit::observation_form::Sigma;
use crate::input::track::recording::{Recording, Vertical};
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// A shape at rest that names a file, or one that is planned.
#[derive(Clone, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct ShapeForm {
    file: Option<PathBuf>,
    /// Arc lengths of the points that are to be photographed, m, in the place of a file.
    #[serde(default)]
    at: Vec<f64>,
    sigma: Option<Sigma>,
    #[serde(default)]
    loss: Loss,
    #[serde(default)]
    held_out: bool,
    scale: Option<f64>,
    #[serde(default, deserialize_with = "crate::input::arrays::some_numbers")]
    origin: Option<[f64; 3]>,
    y: Option<Vertical>,
}

impl ShapeForm {
    /// What it names; `key` names its table.
    pub fn read(self, folder: &Path, key: &str) -> Result<Measurement, Error> {
        let Self { sigma, loss, held_out, scale, origin, y, .. } = self;
        let (sigma, columns) = sigma.map_or((None, None), Sigma::parts);
        let recording = Recording { scale, origin, y, sigma: columns, ..Recording::default() };
        let read = match &self.file {
            Some(file) if self.at.is_empty() => RestShape::read_as(folder.join(file), &recording)?,
            None if self.at.is_empty() => {
                let allowed = "a file, or at = [arc lengths in m] of what is planned";
                return Err(Error::invalid(format!("{key}.file"), "none", allowed));
            }
            None if recording == Recording::default() => RestShape::planned(&self.at),
            _ => {
                let found = format!("{:?}", self.at);
                let allowed =
                    "either a file with what says how to read it, or at: nothing is recorded yet";
                return Err(Error::invalid(format!("{key}.at"), found, allowed));
            }
        };
        let sigma = sigma.or(read.sigma);
        Ok(Measurement::RestShape(RestShape { sigma, loss, held_out, ..read }))
    }
}
