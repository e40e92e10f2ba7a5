//! What came of a task: a report, or why there is none.

use crate::campaign::platform::platform;
use crate::campaign::resolved::Resolved;
use crate::error::Error;
use serde_json::{Map, Value, json};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// What came of a task. A fit that was refused or did not converge is a result too: it would be the same again.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Outcome {
    /// As `rodfit fit` would have ended: 0 done; 2 bad input; 3 could not be computed, did not converge, or not
    /// identifiable.
    pub code: u8,
    /// The whole of it as JSON: `code`, `platform`, and `report` or `error`. It holds no paths and no times.
    pub json: String,
}

impl Outcome {
    /// An outcome from elsewhere, with its code and its JSON on one line.
    pub fn new(code: u8, json: String) -> Self {
        Self { code, json }
    }
}

/// What depends on how fast the machine is.
const TIMES: &str = "wall_seconds";

/// Solves a task; nothing where it was told to stop.
pub(crate) fn solve(task: &Resolved, stop: Arc<AtomicBool>) -> Option<Outcome> {
    let solved = task.fit(|_| Ok(())).and_then(|file| file.fit().stop_when(stop).solve());
    let (code, key, mut what) = match solved {
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
    if let Value::Object(report) = &mut what {
        report.remove(TIMES);
    }
    rename(&mut what, &task.names());
    let whole = Map::from_iter([
        ("platform".to_string(), json!(platform())),
        ("code".into(), json!(code)),
        (key.into(), what),
    ]);
    Some(Outcome { code, json: Value::Object(whole).to_string() })
}

/// Says the keys of files in the place of their paths.
fn rename(value: &mut Value, names: &[(String, String)]) {
    match value {
        Value::String(text) => {
            for (path, name) in names {
                if text.contains(path) {
                    *text = text.replace(path, name);
                }
            }
        }
        Value::Array(list) => list.iter_mut().for_each(|value| rename(value, names)),
        Value::Object(object) => object.values_mut().for_each(|value| rename(value, names)),
        _ => {}
    }
}
