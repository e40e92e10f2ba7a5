//! The fit file.

use super::{Analysis, Fit, Observation, Recording, Unknown, Vertical};
use crate::error::Error;
use crate::parameter::Parameter;
use crate::point::Point;
use crate::problem::Problem;
use crate::scene::{Scene, parse};
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// A fit file and the scene it names, ready to solve.
#[derive(Clone, Debug)]
pub struct FitFile {
    /// The scene.
    pub problem: Problem,
    /// The recorded motion.
    pub observations: Vec<Observation>,
    /// What to identify.
    pub unknowns: Vec<Unknown>,
    /// What to do beyond finding them.
    pub analysis: Analysis,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Form {
    scene: PathBuf,
    observation: Vec<ObservationForm>,
    parameter: Vec<ParameterForm>,
    #[serde(default)]
    analysis: Analysis,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ObservationForm {
    file: PathBuf,
    #[serde(default)]
    point: Point,
    sigma: Option<f64>,
    fps: Option<f64>,
    scale: Option<f64>,
    origin: Option<[f64; 3]>,
    y: Option<Vertical>,
    time_zero: Option<f64>,
}

impl ObservationForm {
    fn recording(&self) -> Recording {
        let Self { fps, scale, origin, y, time_zero, .. } = *self;
        Recording { fps, scale, origin, y, time_zero }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ParameterForm {
    name: Parameter,
    start: Option<f64>,
    bounds: Option<[f64; 2]>,
}

impl FitFile {
    /// Reads and validates a fit file, its scene and its data.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, Error> {
        let path = path.as_ref();
        let text = std::fs::read_to_string(path).map_err(|source| Error::io(path, source))?;
        let form: Form = parse(&text).map_err(|error| error.in_file(Some(path)))?;
        let folder = path.parent().unwrap_or(Path::new(""));
        let problem = Scene::load(folder.join(form.scene))?.problem()?;
        let observations = form
            .observation
            .into_iter()
            .map(|o| {
                let read = o.recording().read(folder.join(o.file))?;
                read.check_units(&problem)?;
                Ok(Observation { sigma: o.sigma, ..read.at(o.point) })
            })
            .collect::<Result<_, Error>>()?;
        let unknowns = form
            .parameter
            .into_iter()
            .map(|p| Unknown { parameter: p.name, start: p.start, bounds: p.bounds })
            .collect();
        let file = Self { problem, observations, unknowns, analysis: form.analysis };
        file.fit().check().map_err(|error| error.in_file(Some(path)))?;
        Ok(file)
    }

    /// The fit the file describes.
    pub fn fit(&self) -> Fit {
        let mut fit = Fit::new(&self.problem);
        fit.observations = self.observations.clone();
        fit.unknowns = self.unknowns.clone();
        fit.analysis = self.analysis.clone();
        fit
    }
}
