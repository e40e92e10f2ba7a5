//! Summaries of fits for the comparison of several fits (campaigns, several fit files on one page).
//!
//! Input: a [`FitReport`] and a name ([`FitSummary::new`]), or a name and an error ([`FitSummary::without_result`]).
//! Output: [`FitSummary`] with the name, the grade, the status, the estimates and the codes of the warnings. Without a
//! result the grade is None, the status is the error, and the lists are empty. The keys that differ from the fit file
//! are empty and the address of the fit's page is None until the caller sets them (`with_page`). `named` is the summary
//! under another name.

use crate::fit::report::FitReport;
use crate::fit::uncertainty::estimate::Estimate;
use crate::fit::uncertainty::grade::Grade;

/// Result of a fit in a comparison of several fits.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct FitSummary {
    /// Name of the fit or of the specimen.
    pub name: String,
    /// Keys that differ from the fit file, with their values.
    pub changes: Vec<(String, String)>,
    /// Grade; none of a fit without a result.
    pub grade: Option<Grade>,
    /// End of the search, or the error of a fit without a result.
    pub status: String,
    /// Estimates; empty without a result.
    pub parameters: Vec<Estimate>,
    /// Names of the codes of the warnings.
    pub warning_codes: Vec<String>,
    /// Address of the page of this fit, relative to that of the comparison; none without a page.
    pub page: Option<String>,
}

impl FitSummary {
    /// The summary of a report under a `name`: grade, status, estimates and warning codes; without changed keys and
    /// page.
    pub fn new(name: impl Into<String>, report: &FitReport) -> Self {
        let codes = report.warning_codes.iter().map(ToString::to_string).collect();
        Self {
            grade: Some(report.grade),
            parameters: report.parameters.clone(),
            warning_codes: codes,
            ..Self::without_result(name, report.status.clone())
        }
    }

    /// The summary under another name.
    pub fn named(self, name: &str) -> Self {
        Self { name: name.into(), ..self }
    }

    /// The summary with the address of the page of the fit, relative to the page of the comparison.
    pub fn with_page(self, page: String) -> Self {
        Self { page: Some(page), ..self }
    }

    /// The summary of a fit without a result under a `name`: no grade, no estimates; its status is the `error`.
    pub fn without_result(name: impl Into<String>, error: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            changes: Vec::new(),
            grade: None,
            status: error.into(),
            parameters: Vec::new(),
            warning_codes: Vec::new(),
            page: None,
        }
    }
}
