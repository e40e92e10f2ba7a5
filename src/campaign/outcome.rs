//! Solution of one task of a campaign, and its outcome as JSON: a report, or an error message.
//!
//! [`solve`] receives a task with its files resolved and a stop flag. Output: the exit code of `rodfit fit` and the
//! JSON with code, platform, and report or error; None if the fit was stopped. The code is 0 for a usable grade, 2 for
//! rejected input, 3 for other grades and failed fits. The JSON depends on the fit, its data and the platform only: the
//! wall time is removed, and paths of files in texts are replaced by the names of their keys. So equal tasks have equal
//! bytes, whatever the folder, the process and the load of the machine. [`Outcome::new`] is the outcome of another
//! program.

use crate::campaign::platform::platform;
use crate::campaign::resolved::{PathName, ResolvedFit};
use crate::error::Error;
use serde_json::{Map, Value, json};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// The outcome of a task. A fit that was rejected or did not converge is a result too: a repetition would be equal.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Outcome {
    /// The exit code of `rodfit fit`: 0 done; 2 bad input; 3 not computed, not converged or not identifiable.
    pub code: u8,
    /// The outcome as JSON: `code`, `platform`, and `report` or `error`. It contains no paths and no times.
    pub json: String,
}

impl Outcome {
    /// An outcome of another program, with its exit code and its JSON on one line; neither is checked.
    pub fn new(code: u8, json: String) -> Self {
        Self { code, json }
    }
}

/// Key of a report with the wall time, which depends on the speed of the machine and is removed.
const TIME_KEY: &str = "wall_seconds";

/// Solves a task. Its outcome has the exit code of `rodfit fit` and the report: 0 for a usable grade, else 3. If the
/// fit was rejected (2) or failed (3), it has the error message instead. The JSON has the platform, no wall time, and
/// names of keys in the place of paths. None if `stop` was set before its end.
pub(crate) fn solve(task: &ResolvedFit, stop: Arc<AtomicBool>) -> Option<Outcome> {
    let solved = task.fit(|_| Ok(())).and_then(|file| file.fit().stop_when(stop).solve());
    let (code, key, mut content) = match solved {
        // The values of an interrupted fit depend on the time of the stop.
        Ok(report) if report.interrupted => return None,
        Ok(report) => {
            let code = if report.is_success() { 0 } else { 3 };
            let json = serde_json::to_string(&report);
            match json.and_then(|json| serde_json::from_str(&json)) {
                Ok(report) => (code, "report", report),
                Err(error) => (3, "error", error.to_string().into()),
            }
        }
        Err(Error::Interrupted) => return None,
        Err(error) => (if error.is_input() { 2 } else { 3 }, "error", error.to_string().into()),
    };
    // Results do not depend on the speed of the machine.
    if let Value::Object(report) = &mut content {
        report.remove(TIME_KEY);
    }
    // Results do not depend on the folder of the files.
    replace_paths(&mut content, &task.path_names());
    let whole = Map::from_iter([
        ("platform".to_string(), json!(platform())),
        ("code".into(), json!(code)),
        (key.into(), content),
    ]);
    Some(Outcome { code, json: Value::Object(whole).to_string() })
}

/// Replaces the paths of files by the names of their keys, in place, in all texts of a JSON value and of its items. All
/// occurrences within a text are replaced. The paths are replaced in the order of `names` (the longest first); keys of
/// objects stay.
fn replace_paths(value: &mut Value, names: &[PathName]) {
    match value {
        Value::String(text) => {
            for PathName { path, name } in names {
                if text.contains(path) {
                    *text = text.replace(path, name);
                }
            }
        }
        Value::Array(list) => list.iter_mut().for_each(|value| replace_paths(value, names)),
        Value::Object(object) => object.values_mut().for_each(|value| replace_paths(value, names)),
        _ => {}
    }
}
