//! Fits of rodfit where there is no disk: on a web page, in WebAssembly.
//!
//! [`fit`] takes the contents of a fit file, its scenes and its data by name, and returns the report as text, as JSON
//! and as a self-contained HTML page. `exports` has the functions that JavaScript calls (`rodfit.js`).

mod exports;

use rodfit::fit::FitFile;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Result of a fit, or the reason why there is none.
#[derive(Debug, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FitOutput {
    /// The report of a fit.
    Solved {
        /// The report as the terminal shows it.
        text: String,
        /// The report as `rodfit fit --json` prints it.
        report: serde_json::Value,
        /// The page of `rodfit fit --report`, HTML.
        page: String,
    },
    /// What is wrong with the input, or why the fit failed.
    Failed(String),
}

/// Solves the fit in the fit file `name`, one of `files` (contents by file name). Scenes and data are read from `files`
/// only.
///
/// ```
/// use rodfit_web::{FitOutput, fit};
/// let names = ["cantilever-fit.toml", "cantilever.toml", "cantilever-tip.csv"];
/// let read = |name| (name, std::fs::read(format!("../../data/{name}")).unwrap());
/// let files = names.map(read).map(|(name, content)| (name.into(), content)).into();
/// let FitOutput::Solved { report, .. } = fit(files, "cantilever-fit.toml") else { panic!("no report") };
/// let modulus = report["parameters"][0]["value"].as_f64().unwrap(); // Pa
/// assert!((modulus / 1e8 - 1.0).abs() < 2e-3);
/// ```
pub fn fit(files: BTreeMap<PathBuf, Vec<u8>>, name: &str) -> FitOutput {
    let solved = || -> Result<FitOutput, String> {
        let file = FitFile::load(Path::new(name)).map_err(|error| error.to_string())?;
        if !file.fields.is_empty() {
            return Err("found lists along the rod ([[field]]), allowed: single parameters".into());
        }
        let report = file.fit().keep_plot_data().solve().map_err(|error| error.to_string())?;
        Ok(FitOutput::Solved {
            text: report.to_string(),
            page: rodfit::page::fit_page(&report, name),
            report: serde_json::to_value(&report).map_err(|error| error.to_string())?,
        })
    };
    // Pictures are read after the fit.
    marker_files::file::with_files(files, solved).unwrap_or_else(FitOutput::Failed)
}
