//! `[[parameter]]` and `[[known]]` of a fit file: their keys, and their conversion to unknowns and inputs with an
//! uncertainty.
//!
//! Input: the deserialized tables, with numbers in the unit of each parameter. Output: an [`Unknown`] (start, bounds,
//! prior, experiments) or a [`Known`] (standard uncertainty, correlations, experiments), in the same units. Without
//! names of experiments their list is empty, which means all experiments. The only error here is an empty list in the
//! file; values are checked later with the scenes. The key `fixed` is not part of the unknown: `fit::file` sets that
//! value in the scenes instead.

use crate::error::Error;
use crate::fit::known::{Correlation, Known};
use crate::fit::unknown::{Prior, Unknown};
use crate::scene::Parameter;
use serde::Deserialize;

/// `[[parameter]]`: a parameter to identify.
#[derive(Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct ParameterForm {
    /// Name of the parameter.
    name: Parameter,
    /// Start value in the unit of the parameter; default: searched, or the value of the scene.
    start: Option<f64>,
    /// Lowest and highest value, in the unit of the parameter.
    #[serde(default, deserialize_with = "crate::input::arrays::some_numbers")]
    bounds: Option<[f64; 2]>,
    /// Normal prior of the value.
    prior: Option<Prior>,
    /// Fixed value that replaces that of the scene, in its unit; the parameter is not identified.
    pub fixed: Option<f64>,
    /// Name or names of the experiments with this parameter; default: all.
    #[serde(default)]
    experiment: ExperimentNames,
}

/// `[[known]]`: an input with a standard uncertainty.
#[derive(Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct KnownForm {
    /// Name of the input.
    name: Parameter,
    /// Standard uncertainty, in the unit of the input.
    sigma: f64,
    /// Name or names of the experiments that share the error; default: all.
    #[serde(default)]
    experiment: ExperimentNames,
    /// Correlations with other inputs.
    #[serde(default)]
    correlation: Vec<CorrelationForm>,
}

/// Correlation of the errors of two inputs.
#[derive(Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct CorrelationForm {
    /// Name of the other input.
    with: Parameter,
    /// Experiment of the other input, where several inputs have that name.
    experiment: Option<String>,
    /// Correlation coefficient, -1 to 1.
    value: f64,
}

/// Name of an experiment, or a list of names.
#[derive(Default, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(rename = "Names"))]
#[serde(untagged, expecting = "expected the name of an experiment, or a list of names")]
pub(crate) enum ExperimentNames {
    #[default]
    All,
    One(String),
    Some(Vec<String>),
}

impl ExperimentNames {
    /// The names of the experiments, of one name or a list in the file; without the key an empty list, which means all
    /// experiments. An error, with the `key` of the table, if the list in the file is empty.
    pub fn list(self, key: &str) -> Result<Vec<String>, Error> {
        match self {
            Self::All => Ok(Vec::new()),
            Self::One(name) => Ok(vec![name]),
            Self::Some(names) if names.is_empty() => {
                let allowed = "names of experiments, or no key, so that all experiments share the \
                               parameter";
                Err(Error::invalid(format!("{key}.experiment"), "[]", allowed))
            }
            Self::Some(names) => Ok(names),
        }
    }
}

impl ParameterForm {
    /// The unknown of the table at `key` of the fit file, with its start, bounds, prior and experiments. The `fixed`
    /// value is not part of it. An error for an empty list of experiments.
    pub fn unknown(self, key: &str) -> Result<Unknown, Error> {
        let Self { name, start, bounds, prior, experiment, .. } = self;
        let experiments = experiment.list(key)?;
        Ok(Unknown { start, bounds, prior, experiments, ..Unknown::new(name) })
    }
}

impl KnownForm {
    /// The input of the table at `key` of the fit file, with its standard uncertainty, experiments and correlations. An
    /// error for an empty list of experiments.
    pub fn known(self, key: &str) -> Result<Known, Error> {
        let Self { name, sigma, experiment, correlation } = self;
        // The form has the names of the file's keys, the input those of the library.
        let correlation = correlation.into_iter().map(|form| {
            let CorrelationForm { with, experiment, value } = form;
            Correlation { with, experiment, value }
        });
        let (experiments, correlations) = (experiment.list(key)?, correlation.collect());
        Ok(Known { experiments, correlations, ..Known::new(name, sigma) })
    }
}
