//! `[[experiment]]` of a fit file: its scene, its recordings and its measurements, and their conversion to an
//! experiment.
//!
//! Input: the deserialized table and the path of the fit file, to whose folder the paths are relative. A table is one
//! experiment, or one for each recording in its `paths`. The scene (of a rod or a structure, in a file or the table) is
//! loaded and prepared as a [`Problem`](crate::Problem) on its initial mesh, and the files of the measurements are
//! read. Output: an [`Experiment`]. Errors are those of the scene, with its file or that of the fit, and of the
//! measurements.

use crate::accuracy::Calculation;
use crate::error::{Error, ensure};
use crate::fit::buckling_form::BucklingForm;
use crate::fit::frequencies_form::FrequenciesForm;
use crate::fit::load_deflection_form::LoadDeflectionForm;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::measurement_tables::MeasurementTables;
use crate::fit::observation_form::ObservationForm;
use crate::fit::shape_form::ShapeForm;
use crate::fit::structure::structure_problem::{representative_problem, representative_rod};
use crate::scene::{Scene, StructureScene};
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// A check of each scene before it is used in a fit. It returns an error for scenes that must not be prepared, as by
/// limits of memory.
pub(crate) type SceneCheck<'a> = dyn Fn(&Scene) -> Result<(), Error> + 'a;

/// `[[experiment]]`: a scene with its measurements.
#[derive(Clone, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct ExperimentForm {
    /// Name of the experiment; default: that of its recording.
    pub name: Option<String>,
    /// Scene file, or the scene itself as a table.
    pub scene: SceneForm,
    /// Recording that drives the ends, instead of that of the scene.
    pub path: Option<PathBuf>,
    /// Recordings that drive the ends, one experiment each.
    #[serde(default)]
    pub paths: Vec<PathBuf>,
    /// Whether the experiment is validation data: predicted, not fitted.
    #[serde(default)]
    pub held_out: bool,
    /// Recorded motions of points of the rod.
    #[serde(default)]
    pub observation: Vec<ObservationForm>,
    /// Measured shapes of the rod at rest.
    #[serde(default)]
    pub shape: Vec<ShapeForm>,
    /// Measured natural frequencies.
    #[serde(default)]
    pub frequencies: Vec<FrequenciesForm>,
    /// Measured load-deflection curves.
    #[serde(default)]
    pub load_deflection: Vec<LoadDeflectionForm>,
    /// Measured critical loads.
    #[serde(default)]
    pub buckling: Vec<BucklingForm>,
}

/// A scene in a fit file.
#[derive(Clone, Deserialize)]
#[serde(try_from = "toml::Value")]
pub(crate) enum SceneForm {
    /// Path of the scene file.
    File(PathBuf),
    /// The scene as a table.
    Inline(toml::Table),
}

#[cfg(test)]
impl schemars::JsonSchema for SceneForm {
    /// Name of the definition in JSON schemas: `SceneOfFit`.
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "SceneOfFit".into()
    }

    /// The JSON schema of a scene in a fit file: a string (path of the scene file), or the scene as an object.
    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        let here = generator.subschema_for::<Scene>();
        let structure = generator.subschema_for::<StructureScene>();
        schemars::json_schema!({
            "description": "Scene file, or the scene itself as a table.",
            "anyOf": [{ "type": "string", "description": "Path of the scene file." }, here, structure],
        })
    }
}

impl TryFrom<toml::Value> for SceneForm {
    type Error = String;

    /// A string as the path of a scene file, a table as the scene itself; an error for any other type of value.
    fn try_from(value: toml::Value) -> Result<Self, Self::Error> {
        match value {
            toml::Value::String(file) => Ok(Self::File(file.into())),
            toml::Value::Table(scene) => Ok(Self::Inline(scene)),
            other => {
                let found = other.type_str();
                Err(format!(
                    "found {found} as a scene, allowed: the name of a scene file, or a \
                             table with a scene"
                ))
            }
        }
    }
}

impl SceneForm {
    /// The structure, if the scene is one: it has `[[rods]]`; `None` for the scene of one rod, and for a file that
    /// cannot be read. `file` is the fit file in `folder`. With `is_replaced` its recording is not read, as another one
    /// follows. Error: a structure that is not valid.
    fn structure(
        &self,
        folder: &Path,
        file: &Path,
        is_replaced: bool,
    ) -> Result<Option<StructureScene>, Error> {
        let read = |text: &str, path: &Path| match is_replaced {
            true => StructureScene::read_without_recording(text, path),
            false => StructureScene::read(text, path),
        };
        match self {
            Self::File(scene) => {
                let path = marker_files::file::at(folder, scene);
                match marker_files::file::text(&path) {
                    Ok(text) if StructureScene::is_text_of(&text) => Ok(Some(read(&text, &path)?)),
                    // A file that cannot be read is reported by the reader of scenes.
                    _ => Ok(None),
                }
            }
            Self::Inline(scene) if scene.contains_key("rods") => {
                Ok(Some(read(&scene.to_string(), file)?))
            }
            Self::Inline(_) => Ok(None),
        }
    }
}

/// `[[experiment]]`: a scene with its measurements, named explicitly or after its recording.
#[derive(Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(try_from = "ExperimentForm")]
pub(crate) struct NamedForm(pub ExperimentForm);

impl TryFrom<ExperimentForm> for NamedForm {
    type Error = &'static str;

    /// Accepts an experiment with a `name`, a `path` or `paths`; else the error is that the field `name` is missing.
    fn try_from(form: ExperimentForm) -> Result<Self, Self::Error> {
        match form.name.is_none() && form.path.is_none() && form.paths.is_empty() {
            true => Err("missing field `name`"),
            false => Ok(Self(form)),
        }
    }
}

impl ExperimentForm {
    /// One copy of the experiment for every recording in `paths`, each named after its file; without `paths` the
    /// experiment itself. An error if `paths` stands together with `path` or `name`. `i` is the index of the table in
    /// the fit file, for errors.
    pub fn per_recording(mut self, i: usize) -> Result<Vec<Self>, Error> {
        let paths = std::mem::take(&mut self.paths);
        let key = |own: &str| format!("experiment[{i}].{own}");
        if paths.is_empty() {
            return Ok(vec![self.named_after_recording()]);
        }
        // The three ways to name a recording exclude each other.
        ensure(self.path.is_none(), key("paths"), "both path and paths", "one of the two")?;
        let found = format!("{:?}", self.name.as_deref().unwrap_or_default());
        let allowed = "no name together with paths, as each experiment is named after its file";
        ensure(self.name.is_none(), key("name"), found, allowed)?;
        let of_recording = |path| Self { path: Some(path), ..self.clone() }.named_after_recording();
        Ok(paths.into_iter().map(of_recording).collect())
    }

    /// The experiment with the name of the recording's file, without folder and extension, if it has no name of its
    /// own.
    fn named_after_recording(self) -> Self {
        // Experiments with the same scene are distinguished by their recordings.
        let stem = || Some(self.path.as_ref()?.file_stem()?.to_string_lossy().into_owned());
        Self { name: self.name.clone().or_else(stem), ..self }
    }

    /// Reads the scene of this table of the fit file at path `file`, with the recording `path` that drives the ends,
    /// and prepares it on its initial mesh. `check_scene` is called before any mesh is created, for a structure with
    /// the rod that represents it. Then it reads the measurements; all are marked as validation data if the table is
    /// `held_out`. Paths are relative to the folder of `file`. Errors are those of the scene, of `check_scene` and of
    /// the measurements.
    pub fn read(self, file: &Path, check_scene: &SceneCheck) -> Result<Experiment, Error> {
        // All paths in a fit file are relative to its folder.
        let folder = file.parent().unwrap_or(Path::new(""));
        if let Some(mut structure) = self.scene.structure(folder, file, self.path.is_some())? {
            if let Some(path) = &self.path {
                structure.follow(marker_files::file::at(folder, path))?;
            }
            // The check comes before the meshes, whose size may exceed the memory.
            check_scene(&representative_rod(&structure)?)?;
            let problem = representative_problem(structure)?;
            let experiment = Experiment::new(self.name.clone().unwrap_or_default(), &problem);
            return self.with_measurements(experiment, folder);
        }
        let follow = |scene: &mut Scene| match &self.path {
            Some(path) => scene.follow(marker_files::file::at(folder, path)),
            None => Ok(()),
        };
        let scene = match &self.scene {
            SceneForm::File(scene) => {
                Scene::load_with(marker_files::file::at(folder, scene), follow)?
            }
            SceneForm::Inline(scene) => Scene::read_with(&scene.to_string(), file, follow)?,
        };
        // The check comes before the mesh, whose size may exceed the memory.
        check_scene(&scene)?;
        let name = self.name.clone().unwrap_or_default();
        let experiment = Experiment::new(name, &scene.problem_for(Calculation::Guess)?);
        self.with_measurements(experiment, folder)
    }

    /// The experiment with the measurements of this table, whose files are relative to `folder`; all become validation
    /// data if the table is `held_out`. Errors are those of the measurements.
    fn with_measurements(
        self,
        mut experiment: Experiment,
        folder: &Path,
    ) -> Result<Experiment, Error> {
        let tables = MeasurementTables {
            observation: self.observation,
            shape: self.shape,
            frequencies: self.frequencies,
            load_deflection: self.load_deflection,
            buckling: self.buckling,
        };
        tables.add_to(&mut experiment, folder)?;
        Ok(if self.held_out { experiment.held_out() } else { experiment })
    }
}
