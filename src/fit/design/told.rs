//! What a plan is expected to tell, as reports say it.

use crate::code::Code;
use crate::fit::uncertainty::estimate::Estimate;
use crate::fit::uncertainty::identifiability::Finding;
use crate::fit::uncertainty::sources::{BudgetLine, CouldHide};
use serde::{Deserialize, Serialize};

/// What a plan is expected to tell. Its `Display` is the summary on the terminal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Design {
    /// The parameters, with the values that the plan is looked at for, and the standard errors, intervals and budgets
    /// that a fit would have.
    pub parameters: Vec<Estimate>,
    /// Correlations between the parameters; none where one is not identifiable.
    pub correlation: Vec<Vec<Option<f64>>>,
    /// Singular values of the Jacobian with its columns scaled to length one, descending.
    pub singular_values: Vec<f64>,
    /// The combinations of parameters that the plan does not determine.
    pub not_identifiable: Vec<Finding>,
    /// The parameters that no choice of the advice determines either.
    pub never_identifiable: Vec<String>,
    /// The budgets of all parameters in one list.
    pub budget: Vec<BudgetLine>,
    /// What could be off without a trace in the data, and what it would do to each parameter.
    pub could_hide: Vec<CouldHide>,
    /// What other markers, lengths and rates would tell.
    pub advice: Vec<Advice>,
    /// What the user should know before believing the numbers.
    pub warnings: Vec<String>,
    /// The codes of the warnings, in their order.
    pub warning_codes: Vec<Code>,
    /// Work, in full simulations.
    pub simulations: f64,
    /// Wall time, s.
    pub wall_seconds: f64,
}

/// What is asked of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum Question {
    /// Where on the rod the marker is: arc length, m.
    Place,
    /// How long is filmed, s.
    Length,
    /// How many frames there are in a second, 1/s.
    Rate,
}

/// What a recording would tell if one thing of it were chosen in another way.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Advice {
    /// What is chosen.
    pub question: Question,
    /// The recording, or the experiment, of which it is chosen.
    pub of: String,
    /// The choices, ascending.
    pub choices: Vec<Choice>,
}

/// One choice.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Choice {
    /// Arc length, m, length, s, or rate, 1/s.
    pub value: f64,
    /// The standard error of each parameter, in its unit; none where it is not identifiable.
    pub std_error: Vec<Option<f64>>,
    /// Whether it is that of the plan.
    pub planned: bool,
    /// Whether it tells most of all parameters together; of lengths and rates the least that tells nearly as much.
    pub best: bool,
}
