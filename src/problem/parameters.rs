//! The numbers of a scene, listed for people.

use crate::problem::Problem;
use crate::scene::Parameter;
use serde::{Deserialize, Serialize};
use std::fmt;

/// A number of a scene, for people.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct ListedParameter {
    /// Its place in the file.
    pub name: String,
    /// Short names.
    pub aliases: Vec<String>,
    /// In the scene.
    pub value: f64,
    /// Empty for pure numbers.
    pub unit: String,
    /// Smallest and largest value it may take at all.
    pub limits: [f64; 2],
    /// Why it cannot be identified or differentiated by in this scene; none if it can.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
}

/// All physical numbers of a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct ParameterList(pub Vec<ListedParameter>);

impl ParameterList {
    /// Those of a problem's scene.
    pub fn of(problem: &Problem) -> Self {
        let listed = |parameter: Parameter| {
            Some(ListedParameter {
                name: parameter.path().into(),
                aliases: parameter.aliases().into_iter().map(Into::into).collect(),
                value: parameter.of(problem.scene())?,
                unit: parameter.unit().into(),
                limits: parameter.limits(),
                note: problem.check_parameter(parameter).err().map(|error| error.to_string()),
            })
        };
        Self(Parameter::all(problem.scene()).into_iter().filter_map(listed).collect())
    }
}

impl fmt::Display for ParameterList {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let width = self.0.iter().map(|p| p.name.len()).max().unwrap_or(0);
        for (i, parameter) in self.0.iter().enumerate() {
            let ListedParameter { name, aliases, value, unit, note, .. } = parameter;
            let end = if i == 0 { "" } else { "\n" };
            let value = format!("{value:e} {unit}");
            write!(f, "{end}{name:width$}  {value:22} {}", aliases.join(", "))?;
            if note.is_some() {
                write!(f, " (cannot be varied in this scene)")?;
            }
        }
        Ok(())
    }
}
