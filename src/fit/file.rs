//! The fit file.

use crate::accuracy::Aim;
use crate::error::Error;
use crate::fit::Fit;
use crate::fit::field::Field;
use crate::fit::frequencies_form::FrequenciesForm;
use crate::fit::known::{self, Known};
use crate::fit::measurement::experiment::Experiment;
use crate::fit::observation_form::ObservationForm;
use crate::fit::parameter_form::{KnownForm, ParameterForm};
use crate::fit::required::REQUIRED;
use crate::fit::shape_form::ShapeForm;
use crate::fit::uncertainty::analysis::Analysis;
use crate::fit::unknown::Unknown;
use crate::fit::validate::{check, check_predicted, recorded};
use crate::fit::validation_errors::is_validation_only;
use crate::input::hints::{FIT, explained};
use crate::input::missing_keys::parse;
use crate::scene::Scene;
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// Most experiments of a fit.
const MOST_EXPERIMENTS: usize = 1000;
/// Most characters of an experiment's name: it is part of messages, tables and file names.
const LONGEST_NAME: usize = 100;

/// Says whether a scene may be worked on.
type Admit<'a> = dyn Fn(&Scene) -> Result<(), Error> + 'a;

/// A fit file and the scenes it names, ready to solve.
#[derive(Clone, Debug)]
pub struct FitFile {
    /// The scenes, and what was measured in each.
    pub experiments: Vec<Experiment>,
    /// What to identify.
    pub unknowns: Vec<Unknown>,
    /// What is known with an error.
    pub knowns: Vec<Known>,
    /// Lists of numbers along the rod to identify; with any it is a [fit of those](crate::fit::FieldFit).
    pub fields: Vec<Field>,
    /// What to do beyond finding them.
    pub analysis: Analysis,
}

/// A fit: scenes, measurements, and parameters to identify.
#[derive(Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
struct Form {
    /// Scene file, or the scene itself as a table.
    scene: Option<SceneForm>,
    /// Recorded motions of points of the rod.
    #[serde(default)]
    observation: Vec<ObservationForm>,
    /// Measured shapes of the rod at rest.
    #[serde(default)]
    shape: Vec<ShapeForm>,
    /// Measured natural frequencies.
    #[serde(default)]
    frequencies: Vec<FrequenciesForm>,
    /// Experiments with their own scenes, instead of `scene`.
    #[serde(default)]
    experiment: Vec<NamedForm>,
    /// Parameters to identify.
    #[serde(default)]
    parameter: Vec<ParameterForm>,
    /// Inputs with a standard uncertainty.
    #[serde(default)]
    known: Vec<KnownForm>,
    /// Lists along the rod to identify with a smooth prior.
    #[serde(default)]
    field: Vec<Field>,
    /// Computations in addition to the estimate.
    #[serde(default)]
    analysis: Analysis,
}

#[derive(Clone, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
struct ExperimentForm {
    /// Name of the experiment; default: that of its recording.
    name: Option<String>,
    /// Scene file, or the scene itself as a table.
    scene: SceneForm,
    /// Recording that drives the ends, instead of that of the scene.
    path: Option<PathBuf>,
    /// Recordings that drive the ends, one experiment each.
    #[serde(default)]
    paths: Vec<PathBuf>,
    /// Whether the experiment is validation data: predicted, not fitted.
    #[serde(default)]
    held_out: bool,
    /// Recorded motions of points of the rod.
    #[serde(default)]
    observation: Vec<ObservationForm>,
    /// Measured shapes of the rod at rest.
    #[serde(default)]
    shape: Vec<ShapeForm>,
    /// Measured natural frequencies.
    #[serde(default)]
    frequencies: Vec<FrequenciesForm>,
}

/// A scene's file, or the scene itself.
#[derive(Clone, Deserialize)]
#[serde(try_from = "toml::Value")]
enum SceneForm {
    File(PathBuf),
    Here(toml::Table),
}

#[cfg(test)]
impl schemars::JsonSchema for SceneForm {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "SceneOfFit".into()
    }

    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        let here = generator.subschema_for::<Scene>();
        schemars::json_schema!({
            "description": "Scene file, or the scene itself as a table.",
            "anyOf": [{ "type": "string", "description": "Path of the scene file." }, here],
        })
    }
}

impl TryFrom<toml::Value> for SceneForm {
    type Error = String;

    fn try_from(value: toml::Value) -> Result<Self, Self::Error> {
        match value {
            toml::Value::String(file) => Ok(Self::File(file.into())),
            toml::Value::Table(scene) => Ok(Self::Here(scene)),
            other => {
                let found = other.type_str();
                Err(format!("found {found} as a scene, allowed: its file, or a table with it"))
            }
        }
    }
}

/// `[[experiment]]`: a scene with its measurements, named explicitly or after its recording.
#[derive(Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(try_from = "ExperimentForm")]
struct NamedForm(ExperimentForm);

impl TryFrom<ExperimentForm> for NamedForm {
    type Error = &'static str;

    fn try_from(form: ExperimentForm) -> Result<Self, Self::Error> {
        match form.name.is_none() && form.path.is_none() && form.paths.is_empty() {
            true => Err("missing field `name`"),
            false => Ok(Self(form)),
        }
    }
}

impl ExperimentForm {
    /// One experiment of every recording in `paths`.
    fn each(mut self, i: usize) -> Result<Vec<Self>, Error> {
        let paths = std::mem::take(&mut self.paths);
        let key = |own: &str| format!("experiment[{i}].{own}");
        let several = !paths.is_empty();
        if several && self.path.is_some() {
            return Err(Error::invalid(key("paths"), "besides path", "one of the two"));
        }
        if let Some(name) = self.name.as_ref().filter(|_| several) {
            let allowed = "no name besides paths: each experiment has that of its file";
            return Err(Error::invalid(key("name"), format!("{name:?}"), allowed));
        }
        if !several {
            return Ok(vec![self.called()]);
        }
        Ok(paths.into_iter().map(|p| Self { path: Some(p), ..self.clone() }.called()).collect())
    }

    /// With the name of its recording, if it has no other.
    fn called(self) -> Self {
        let stem = || Some(self.path.as_ref()?.file_stem()?.to_string_lossy().into_owned());
        Self { name: self.name.clone().or_else(stem), ..self }
    }

    /// What stands in the fit file `file`.
    fn read(self, file: &Path, admit: &Admit) -> Result<Experiment, Error> {
        let folder = file.parent().unwrap_or(Path::new(""));
        let follow = |scene: &mut Scene| match &self.path {
            Some(path) => scene.follow(marker_files::file::at(folder, path)),
            None => Ok(()),
        };
        let scene = match &self.scene {
            SceneForm::File(scene) => {
                Scene::load_with(marker_files::file::at(folder, scene), follow)?
            }
            SceneForm::Here(scene) => Scene::read_with(&scene.to_string(), file, follow)?,
        };
        admit(&scene)?;
        let mut experiment =
            Experiment::new(self.name.unwrap_or_default(), &scene.problem_for(Aim::Guess)?);
        let measured = (self.observation, self.shape, self.frequencies);
        measure(&mut experiment, measured, folder)?;
        Ok(if self.held_out { experiment.held_out() } else { experiment })
    }
}

/// Reads what was measured in an experiment.
fn measure(
    experiment: &mut Experiment,
    (observation, shape, frequencies): (Vec<ObservationForm>, Vec<ShapeForm>, Vec<FrequenciesForm>),
    folder: &Path,
) -> Result<(), Error> {
    let mut measurements = Vec::new();
    for (k, observation) in observation.into_iter().enumerate() {
        let key = experiment.key(&format!("observation[{k}]"));
        measurements.extend(observation.read(folder, &experiment.problem, &key)?);
    }
    for (k, shape) in shape.into_iter().enumerate() {
        measurements.push(shape.read(folder, &experiment.key(&format!("shape[{k}]")))?);
    }
    for (k, frequencies) in frequencies.into_iter().enumerate() {
        measurements.push(frequencies.read(&experiment.key(&format!("frequencies[{k}]")))?);
    }
    experiment.measurements.extend(measurements);
    experiment.measurements.iter().try_for_each(|m| m.check_units(experiment))
}

/// Tables of a fit file by themselves.
#[derive(Default, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
struct Tables {
    observation: Vec<ObservationForm>,
    shape: Vec<ShapeForm>,
    frequencies: Vec<FrequenciesForm>,
    parameter: Vec<ParameterForm>,
    known: Vec<KnownForm>,
    analysis: Option<Analysis>,
}

impl Fit {
    /// Adds what the tables of a fit file say that stand in `text`: `[[observation]]`, `[[shape]]` and `[[frequencies]]` of the
    /// last experiment, `[[parameter]]`, `[[known]]`, and `[analysis]` in the place of what was said of it before. Paths
    /// are relative to `folder`.
    ///
    /// # Errors
    ///
    /// Those of [`FitFile::load`] that concern these tables.
    pub fn add_toml(&self, text: &str, folder: impl AsRef<Path>) -> Result<Self, Error> {
        self.add_tables(text, folder.as_ref())
    }

    fn add_tables(&self, text: &str, folder: &Path) -> Result<Self, Error> {
        let Fit { experiments, unknowns, knowns, analysis, progress, keep_plot_data } =
            self.clone();
        let tables: Tables = parse(text, &REQUIRED[1..])?;
        let analysis = tables.analysis.unwrap_or(analysis);
        let fields = Vec::new();
        let mut file = FitFile { experiments, unknowns, knowns, fields, analysis };
        if let Some(last) = file.experiments.last_mut() {
            let measured = (tables.observation, tables.shape, tables.frequencies);
            measure(last, measured, folder)?;
        }
        file.add(tables.parameter, tables.known)?;
        Ok(Self { progress, keep_plot_data, ..file.fit() })
    }
}

/// What a fit file may say.
#[cfg(test)]
impl schemars::JsonSchema for FitFile {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Fit".into()
    }

    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        Form::json_schema(generator)
    }
}

impl FitFile {
    /// Reads and validates a fit file, its scenes and its data.
    ///
    /// # Errors
    ///
    /// A file that cannot be read or is no fit file, scenes and data likewise, and fits that cannot be
    /// solved.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, Error> {
        Self::load_if(path, |_| Ok(()))
    }

    /// The same, and `admit` sees every scene before its mesh is made.
    ///
    /// # Errors
    ///
    /// Those of [`load`](Self::load), and what `admit` refuses.
    pub fn load_if(
        path: impl AsRef<Path>,
        admit: impl Fn(&Scene) -> Result<(), Error>,
    ) -> Result<Self, Error> {
        Self::load_file(path.as_ref(), &admit)
    }

    fn load_file(path: &Path, admit: &Admit) -> Result<Self, Error> {
        let file = Self::load_plan(path, admit)?;
        recorded(&file.experiments).map_err(|error| error.in_file(Some(path)))?;
        Ok(file)
    }

    /// The same of a file whose observations and shapes may be planned only, for [`Fit::design`].
    ///
    /// # Errors
    ///
    /// Those of [`load_if`](Self::load_if), but for what is not recorded yet.
    pub fn load_plan_if(
        path: impl AsRef<Path>,
        admit: impl Fn(&Scene) -> Result<(), Error>,
    ) -> Result<Self, Error> {
        Self::load_plan(path.as_ref(), &admit)
    }

    fn load_plan(path: &Path, admit: &Admit) -> Result<Self, Error> {
        Self::read(&marker_files::file::text(path)?, path, admit)
    }

    /// Reads and validates the text of a fit file. Paths in it are relative to `folder`; messages name the
    /// text as if it were a file `fit` there.
    ///
    /// # Errors
    ///
    /// Those of [`load`](Self::load).
    pub fn from_toml(text: &str, folder: impl AsRef<Path>) -> Result<Self, Error> {
        Self::read(text, &folder.as_ref().join("fit"), &|_| Ok(()))
    }

    /// What stands in a fit file of this path.
    pub(crate) fn read(text: &str, path: &Path, admit: &Admit) -> Result<Self, Error> {
        let mut form: Form = parse(text, &REQUIRED)
            .map_err(|error| explained(error, text, &FIT).in_file(Some(path)))?;
        let forms = form.experiments().map_err(|error| error.in_file(Some(path)))?;
        let read = |e: ExperimentForm| e.read(path, admit);
        let experiments = forms.into_iter().map(read).collect::<Result<_, Error>>();
        let experiments = experiments.map_err(|error| error.in_file(Some(path)))?;
        let (unknowns, knowns, analysis) = (Vec::new(), Vec::new(), form.analysis);
        let mut file = Self { experiments, unknowns, knowns, fields: form.field, analysis };
        file.add(form.parameter, form.known).map_err(|error| error.in_file(Some(path)))?;
        if let Some(fit) = file.field_fit().map_err(|error| error.in_file(Some(path)))? {
            fit.check().map_err(|error| error.in_file(Some(path)))?;
            return Ok(file);
        }
        if file.is_validation_only() {
            check_predicted(&file.experiments).map_err(|error| error.in_file(Some(path)))?;
            return Ok(file);
        }
        check(&file.experiments, &file.unknowns, &file.analysis)
            .and_then(|()| known::check(&file.experiments, &file.unknowns, &file.knowns))
            .map_err(|error| error.in_file(Some(path)))?;
        Ok(file)
    }

    /// Adds what is looked for, and what is known.
    fn add(&mut self, parameters: Vec<ParameterForm>, known: Vec<KnownForm>) -> Result<(), Error> {
        for (i, parameter) in parameters.into_iter().enumerate() {
            self.take(i, parameter)?;
        }
        for (i, known) in known.into_iter().enumerate() {
            self.knowns.push(known.known(&format!("known[{i}]"))?);
        }
        Ok(())
    }

    /// Adds an unknown, or gives the experiments its fixed value.
    fn take(&mut self, i: usize, parameter: ParameterForm) -> Result<(), Error> {
        let (fixed, key) = (parameter.fixed, format!("parameter[{i}]"));
        let unknown = parameter.unknown(&key)?;
        let Some(value) = fixed else {
            self.unknowns.push(unknown);
            return Ok(());
        };
        if unknown.start.is_some() || unknown.bounds.is_some() || unknown.prior.is_some() {
            let allowed = "no start, bounds or prior beside it: it is not identified";
            return Err(Error::invalid(format!("{key}.fixed"), value, allowed));
        }
        unknown.check(&self.experiments, &key)?;
        for experiment in self.experiments.iter_mut().filter(|e| unknown.is_of(e)) {
            let fixed = experiment.problem.with([(unknown.parameter, value)]);
            experiment.problem = fixed.map_err(|error| match error {
                Error::Invalid { allowed, .. } => {
                    Error::invalid(format!("{key}.fixed"), value, allowed)
                }
                error => error,
            })?;
        }
        Ok(())
    }

    /// The files of its scenes and data.
    pub fn files(&self) -> Vec<PathBuf> {
        let of = |e: &Experiment| {
            let data = e.measurements.iter().filter_map(|m| m.header.source.clone());
            e.problem.scene().files().into_iter().chain(data).collect::<Vec<_>>()
        };
        self.experiments.iter().flat_map(of).collect()
    }

    /// The file, if its fit is one of parameters alone.
    ///
    /// # Errors
    ///
    /// [`Error::Invalid`] where it asks for lists of numbers along the rod, which [`field_fit`](Self::field_fit) finds.
    pub fn of_parameters(self) -> Result<Self, Error> {
        if self.fields.is_empty() {
            return Ok(self);
        }
        let allowed = "[[parameter]] alone; `rodfit fit` finds numbers along the rod";
        Err(Error::invalid("field", "numbers along the rod", allowed))
    }

    /// Whether every measurement is validation data: nothing can be fitted, and [`Fit::predict`] compares them with the
    /// scenes.
    pub fn is_validation_only(&self) -> bool {
        self.fields.is_empty() && is_validation_only(&self.experiments)
    }

    /// The fit of parameters the file describes.
    pub fn fit(&self) -> Fit {
        let fit = Fit::of(self.experiments.clone()).analyse(self.analysis.clone());
        let fit = self.unknowns.iter().fold(fit, |fit, unknown| fit.identify(unknown.clone()));
        self.knowns.iter().fold(fit, |fit, known| fit.known(known.clone()))
    }
}

impl Form {
    /// The experiments: those of the list, or the only one.
    fn experiments(&mut self) -> Result<Vec<ExperimentForm>, Error> {
        let listed = std::mem::take(&mut self.experiment).into_iter().enumerate();
        let listed = listed.map(|(i, NamedForm(form))| form.each(i));
        let listed: Vec<ExperimentForm> =
            listed.collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect();
        let (observation, shape) =
            (std::mem::take(&mut self.observation), std::mem::take(&mut self.shape));
        let frequencies = std::mem::take(&mut self.frequencies);
        let alone = [
            ("observation", observation.is_empty()),
            ("shape", shape.is_empty()),
            ("frequencies", frequencies.is_empty()),
        ];
        let alone = alone.iter().find(|(_, empty)| !empty);
        match self.scene.take() {
            Some(scene) if listed.is_empty() => Ok(vec![ExperimentForm {
                name: None,
                scene,
                path: None,
                paths: Vec::new(),
                held_out: false,
                observation,
                shape,
                frequencies,
            }]),
            Some(_) => {
                let allowed = "either scene, or [[experiment]] with a scene each";
                Err(Error::invalid("scene", "besides [[experiment]]", allowed))
            }
            None if listed.is_empty() => {
                Err(Error::invalid("scene", "none", "a scene, or [[experiment]] with a scene each"))
            }
            None => {
                if let Some((table, _)) = alone {
                    let allowed = format!("[[experiment.{table}]] below its [[experiment]]");
                    return Err(Error::invalid(*table, "besides [[experiment]]", allowed));
                }
                if listed.len() > MOST_EXPERIMENTS {
                    let allowed = format!("up to {MOST_EXPERIMENTS}");
                    return Err(Error::invalid("experiment", listed.len(), allowed));
                }
                let is_name =
                    |name: &str| !name.trim().is_empty() && name.chars().count() <= LONGEST_NAME;
                let named = |e: &ExperimentForm| e.name.as_deref().is_some_and(is_name);
                if let Some(i) = listed.iter().position(|e| !named(e)) {
                    let found = listed[i].name.as_deref().unwrap_or_default();
                    let key = format!("experiment[{i}].name");
                    let allowed = format!("a name of up to {LONGEST_NAME} characters");
                    return Err(Error::invalid(key, format!("{found:?}"), allowed));
                }
                Ok(listed)
            }
        }
    }
}
