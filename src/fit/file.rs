//! The fit file: its tables in TOML, and their conversion to experiments, unknowns, inputs with an uncertainty and
//! analyses.
//!
//! Input: the text of a fit file and its path, to whose folder the paths in it are relative. The tables are
//! deserialized (`FitForm`). A `scene` is one experiment; each `[[experiment]]` is one, or one for each recording in
//! its `paths`. Each scene (of a rod or a structure) is loaded and prepared as a [`Problem`](crate::Problem) on its
//! initial mesh, and the files of the measurements are read. Parameters with `fixed` replace values of the scenes.
//!
//! Output: a [`FitFile`]. It is checked as a fit of lists along the rod if it has any, as validation data if all
//! measurements are, else as a fit of parameters. [`FitFile::load`] and [`FitFile::load_if`] reject planned
//! measurements, [`FitFile::load_plan_if`] and [`FitFile::from_toml`] accept them; duplicates are rejected by the fit.
//! [`FitFile::fit`] makes a [`Fit`] of all but the lists along the rod. Errors have the file (of the fit, a scene or
//! data); those of a key have the key with the value found and the allowed values. [`Fit::add_toml`] adds measurements
//! (to the last experiment), parameters and inputs to a fit, and replaces its analyses.

use crate::error::{Error, GIVEN_AS_TEXT, ensure};
use crate::fit::Fit;
use crate::fit::buckling_form::BucklingForm;
use crate::fit::experiment_form::{ExperimentForm, NamedForm, SceneCheck, SceneForm};
use crate::fit::field::Field;
use crate::fit::frequencies_form::FrequenciesForm;
use crate::fit::known::{self, Known};
use crate::fit::load_deflection_form::LoadDeflectionForm;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::measurement_tables::MeasurementTables;
use crate::fit::observation_form::ObservationForm;
use crate::fit::parameter_form::{KnownForm, ParameterForm};
use crate::fit::required::REQUIRED;
use crate::fit::shape_form::ShapeForm;
use crate::fit::uncertainty::analysis::Analysis;
use crate::fit::unknown::Unknown;
use crate::fit::validate::{check, check_predicted, check_recorded};
use crate::fit::validation_errors::is_validation_only;
use crate::input::hints::{FIT, explained};
use crate::input::missing_keys::parse;
use crate::scene::Scene;
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// Largest number of experiments of a fit; more are rejected before the data are read.
const MOST_EXPERIMENTS: usize = 1000;
/// Largest number of characters of an experiment's name, which is part of messages, tables and file names.
const LONGEST_NAME: usize = 100;

/// Content of a fit file: experiments with prepared scenes and read data, unknowns, inputs and analyses.
#[derive(Clone, Debug)]
pub struct FitFile {
    /// The scenes with their measurements.
    pub experiments: Vec<Experiment>,
    /// Parameters to identify.
    pub unknowns: Vec<Unknown>,
    /// Inputs with a standard uncertainty.
    pub knowns: Vec<Known>,
    /// Lists along the rod to identify; with any it is a [fit of those](crate::fit::FieldFit).
    pub fields: Vec<Field>,
    /// Analyses beside the estimates.
    pub analysis: Analysis,
}

/// A fit: scenes, measurements, and parameters to identify.
#[derive(Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
struct FitForm {
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
    /// Measured load-deflection curves.
    #[serde(default)]
    load_deflection: Vec<LoadDeflectionForm>,
    /// Measured critical loads.
    #[serde(default)]
    buckling: Vec<BucklingForm>,
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

/// Tables of a fit file that can be added to a fit.
#[derive(Default, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
struct Tables {
    observation: Vec<ObservationForm>,
    shape: Vec<ShapeForm>,
    frequencies: Vec<FrequenciesForm>,
    load_deflection: Vec<LoadDeflectionForm>,
    buckling: Vec<BucklingForm>,
    parameter: Vec<ParameterForm>,
    known: Vec<KnownForm>,
    analysis: Option<Analysis>,
}

impl Fit {
    /// Adds the tables in `text` to a copy of the fit: `[[observation]]`, `[[shape]]`, `[[frequencies]]`,
    /// `[[load_deflection]]` and `[[buckling]]` to the last experiment, `[[parameter]]` and `[[known]]` to the fit.
    /// `[analysis]` replaces the analyses. Paths are relative to `folder`. Measurements without an experiment are an
    /// error. The fit as a whole is checked when it is solved.
    ///
    /// # Errors
    ///
    /// Those of [`FitFile::load`] that concern these tables.
    pub fn add_toml(&self, text: &str, folder: impl AsRef<Path>) -> Result<Self, Error> {
        let Fit { experiments, unknowns, knowns, analysis, progress, keep_plot_data } =
            self.clone();
        // Tables are parsed with the same rules as in a file; `scene` is not required here.
        let tables: Tables = parse(text, &REQUIRED[1..])?;
        let analysis = tables.analysis.unwrap_or(analysis);
        let fields = Vec::new();
        let mut file = FitFile { experiments, unknowns, knowns, fields, analysis };
        let Tables { observation, shape, frequencies, load_deflection, buckling, .. } = tables;
        let (parameter, known) = (tables.parameter, tables.known);
        let tables =
            MeasurementTables { observation, shape, frequencies, load_deflection, buckling };
        match file.experiments.last_mut() {
            Some(last) => tables.add_to(last, folder.as_ref())?,
            None if tables.is_empty() => {}
            None => {
                let allowed = "an experiment of the fit that they belong to";
                return Err(Error::invalid("experiment", "measurements without one", allowed));
            }
        }
        file.add(parameter, known)?;
        Ok(Self { progress, keep_plot_data, ..file.fit() })
    }
}

#[cfg(test)]
impl schemars::JsonSchema for FitFile {
    /// Name of the schema of a fit file: `Fit`.
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Fit".into()
    }

    /// The JSON schema of a fit file, which is that of its tables (`FitForm`).
    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        FitForm::json_schema(generator)
    }
}

impl FitFile {
    /// Reads and validates a fit file, its scenes, which are prepared on their initial meshes, and its data. Planned
    /// measurements are rejected.
    ///
    /// ```
    /// use rodfit::Parameter;
    /// use rodfit::fit::FitFile;
    /// let file = FitFile::load("data/cantilever-fit.toml")?;
    /// assert_eq!(file.unknowns[0].parameter, Parameter::YoungsModulus);
    /// # Ok::<(), rodfit::Error>(())
    /// ```
    ///
    /// # Errors
    ///
    /// A file that cannot be read or is no fit file, scenes and data that cannot be read or are not valid, and
    /// parameters, inputs, measurements and analyses that do not fit the scenes or each other.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, Error> {
        Self::load_if(path, |_| Ok(()))
    }

    /// Reads and validates a fit file, its scenes and its data like [`load`](Self::load). `check_scene` is called for
    /// every scene of one rod before its mesh is created, and for the rod that represents a structure, before the
    /// structure is built. Its error ends the reading. Planned measurements are rejected.
    ///
    /// # Errors
    ///
    /// Those of [`load`](Self::load), and those of `check_scene`.
    pub fn load_if(
        path: impl AsRef<Path>,
        check_scene: impl Fn(&Scene) -> Result<(), Error>,
    ) -> Result<Self, Error> {
        let file = Self::load_plan_if(&path, check_scene)?;
        // A planned measurement has no values to fit, but is valid in a file for `Fit::design`.
        check_recorded(&file.experiments).map_err(|error| error.in_file(Some(path.as_ref())))?;
        Ok(file)
    }

    /// Reads and validates a fit file, its scenes and its data like [`load_if`](Self::load_if), with the same calls of
    /// `check_scene`. Observations and shapes may be planned, for [`Fit::design`].
    ///
    /// # Errors
    ///
    /// Those of [`load_if`](Self::load_if) other than planned measurements.
    pub fn load_plan_if(
        path: impl AsRef<Path>,
        check_scene: impl Fn(&Scene) -> Result<(), Error>,
    ) -> Result<Self, Error> {
        let path = path.as_ref();
        Self::read(&marker_files::file::text(path)?, path, &check_scene)
    }

    /// Reads and validates the text of a fit file. Paths in it are relative to `folder`.
    ///
    /// # Errors
    ///
    /// Those of [`load`](Self::load) other than planned measurements, which are accepted.
    pub fn from_toml(text: &str, folder: impl AsRef<Path>) -> Result<Self, Error> {
        Self::read(text, &folder.as_ref().join(GIVEN_AS_TEXT), &|_| Ok(()))
    }

    /// Reads and validates the `text` of a fit file at `path`, its scenes and its data, planned ones included.
    /// `check_scene` is called as in [`load_if`](Self::load_if). Duplicate measurements are found only by the fit.
    /// Errors have the path.
    pub(crate) fn read(text: &str, path: &Path, check_scene: &SceneCheck) -> Result<Self, Error> {
        Self::parse_and_check(text, path, check_scene).map_err(|error| error.in_file(Some(path)))
    }

    /// Parses the `text` of a fit file at `path`, reads its scenes and data, and checks the fit. A fit is checked as
    /// lists along the rod if it has any, as validation data if all measurements are, or else as parameters with
    /// inputs. Duplicate and planned measurements are not rejected. Errors may lack the path.
    fn parse_and_check(text: &str, path: &Path, check_scene: &SceneCheck) -> Result<Self, Error> {
        let mut form: FitForm =
            parse(text, &REQUIRED).map_err(|error| explained(error, text, &FIT))?;
        // Scenes and data of all experiments, in the order of the file.
        let read = |e: ExperimentForm| e.read(path, check_scene);
        let experiments = form.experiments()?.into_iter().map(read).collect::<Result<_, _>>()?;
        let (unknowns, knowns, analysis) = (Vec::new(), Vec::new(), form.analysis);
        let mut file = Self { experiments, unknowns, knowns, fields: form.field, analysis };
        file.add(form.parameter, form.known)?;
        // The checks depend on the kind of fit: a field, validation only, or parameters.
        match file.field_fit()? {
            Some(fit) => fit.check()?,
            None if file.is_validation_only() => check_predicted(&file.experiments)?,
            None => {
                check(&file.experiments, &file.unknowns, &file.analysis)?;
                known::check(&file.experiments, &file.unknowns, &file.knowns)?;
            }
        }
        Ok(file)
    }

    /// Adds the unknowns and the inputs with an uncertainty of these tables. A parameter with a `fixed` value changes
    /// the scenes instead. Errors are those of the tables, with their keys.
    fn add(&mut self, parameters: Vec<ParameterForm>, known: Vec<KnownForm>) -> Result<(), Error> {
        for (i, parameter) in parameters.into_iter().enumerate() {
            self.add_parameter(i, parameter)?;
        }
        for (i, known) in known.into_iter().enumerate() {
            self.knowns.push(known.known(&format!("known[{i}]"))?);
        }
        Ok(())
    }

    /// Adds the unknown of the `i`-th parameter table. With a `fixed` value, it sets this in all experiments that have
    /// the parameter instead. Then start, bounds or prior in the table are an error, and so is a value that a scene
    /// rejects, with the key `fixed`.
    fn add_parameter(&mut self, i: usize, parameter: ParameterForm) -> Result<(), Error> {
        let (fixed, key) = (parameter.fixed, format!("parameter[{i}]"));
        // A fixed parameter replaces the value of the scene and is no unknown.
        let unknown = parameter.unknown(&key)?;
        let Some(value) = fixed else {
            self.unknowns.push(unknown);
            return Ok(());
        };
        // A parameter that is not searched has no use for a start, bounds or a prior: they would be a mistake.
        let is_alone =
            unknown.start.is_none() && unknown.bounds.is_none() && unknown.prior.is_none();
        let allowed = "no start, bounds or prior together with fixed, as the parameter is not \
                       identified";
        ensure(is_alone, format!("{key}.fixed"), value, allowed)?;
        unknown.check(&self.experiments, &key)?;
        // The value of every scene that has the parameter is replaced.
        for experiment in self.experiments.iter_mut().filter(|e| unknown.is_of(e)) {
            // The value is in the fit file: an error of the scene would name the wrong place.
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

    /// The keys of fit files: their tables, and `scene`.
    #[cfg(feature = "cli")]
    pub(crate) fn keys() -> &'static [&'static str] {
        crate::input::table_keys::table_keys::<FitForm>()
    }

    /// The paths of all files the fit was read from other than itself, by experiment: the files of the scene (with
    /// recordings that drive ends), those of its structure, then those of the data. Duplicates stay.
    pub fn files(&self) -> Vec<PathBuf> {
        let own = |e: &Experiment| {
            let data = e.measurements.iter().filter_map(|m| m.header.source.clone());
            let scene = e.problem.scene();
            let structure = scene.structure.iter().flat_map(|structure| structure.files());
            scene.files().into_iter().chain(structure).chain(data).collect::<Vec<_>>()
        };
        self.experiments.iter().flat_map(own).collect()
    }

    /// The file unchanged, if it has no lists along the rod (`[[field]]`) to identify; a guard for commands that need a
    /// fit of parameters.
    ///
    /// # Errors
    ///
    /// [`Error::Invalid`] for a file with lists along the rod, which [`field_fit`](Self::field_fit) identifies.
    pub fn of_parameters(self) -> Result<Self, Error> {
        let allowed = "[[parameter]] only. Use `rodfit fit` for distributed parameters ([[field]])";
        ensure(self.fields.is_empty(), "field", "distributed parameters", allowed)?;
        Ok(self)
    }

    /// Whether every measurement is validation data and the file has no list along the rod. Then [`Fit::predict`]
    /// compares the data with the scenes instead of a fit.
    pub fn is_validation_only(&self) -> bool {
        self.fields.is_empty() && is_validation_only(&self.experiments)
    }

    /// The fit of the parameters in the file: its experiments, unknowns, inputs and analyses. Lists along the rod are
    /// not part of it.
    pub fn fit(&self) -> Fit {
        let fit = Fit::of(self.experiments.clone()).analyse(self.analysis.clone());
        let fit = self.unknowns.iter().fold(fit, |fit, unknown| fit.identify(unknown.clone()));
        self.knowns.iter().fold(fit, |fit, known| fit.known(known.clone()))
    }
}

impl FitForm {
    /// Moves the experiments out of the tables: those of `[[experiment]]` (one per recording), or the one of the file's
    /// own `scene` with its measurements, without a name. An error for both or neither, for measurements outside of
    /// `[[experiment]]` in a file that has these, for more than [`MOST_EXPERIMENTS`], and for names of `[[experiment]]`
    /// that are blank or longer than [`LONGEST_NAME`].
    fn experiments(&mut self) -> Result<Vec<ExperimentForm>, Error> {
        let mut listed: Vec<ExperimentForm> = Vec::new();
        for (i, NamedForm(form)) in std::mem::take(&mut self.experiment).into_iter().enumerate() {
            listed.extend(form.per_recording(i)?);
        }
        let observation = std::mem::take(&mut self.observation);
        let shape = std::mem::take(&mut self.shape);
        let frequencies = std::mem::take(&mut self.frequencies);
        let load_deflection = std::mem::take(&mut self.load_deflection);
        let buckling = std::mem::take(&mut self.buckling);
        // Either the file has a scene with measurements of its own, or a list of experiments. Mixed forms are
        // ambiguous.
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
                load_deflection,
                buckling,
            }]),
            Some(_) => {
                let allowed = "one scene, or a scene in each [[experiment]]";
                Err(Error::invalid("scene", "both scene and [[experiment]]", allowed))
            }
            None if listed.is_empty() => {
                Err(Error::invalid("scene", "none", "one scene, or a scene in each [[experiment]]"))
            }
            None => {
                let tables = [
                    ("observation", observation.is_empty()),
                    ("shape", shape.is_empty()),
                    ("load_deflection", load_deflection.is_empty()),
                    ("buckling", buckling.is_empty()),
                    ("frequencies", frequencies.is_empty()),
                ];
                for (table, is_empty) in tables {
                    let allowed = format!("[[experiment.{table}]] after its [[experiment]]");
                    ensure(is_empty, table, "outside of [[experiment]]", allowed)?;
                }
                // Names are keys of messages and results, so that each experiment of several needs one.
                let (count, allowed) = (listed.len(), format!("up to {MOST_EXPERIMENTS}"));
                ensure(count <= MOST_EXPERIMENTS, "experiment", count, allowed)?;
                for (i, experiment) in listed.iter().enumerate() {
                    let name = experiment.name.as_deref().unwrap_or_default();
                    let is_name = !name.trim().is_empty() && name.chars().count() <= LONGEST_NAME;
                    let key = format!("experiment[{i}].name");
                    let allowed = format!("a name of up to {LONGEST_NAME} characters");
                    ensure(is_name, key, format!("{name:?}"), allowed)?;
                }
                Ok(listed)
            }
        }
    }
}
