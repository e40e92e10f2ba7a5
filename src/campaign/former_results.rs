//! Conversion of results that version 0.1 stored: former names of keys and codes become the current ones.
//!
//! Input: a stored result (JSON on one line). One of that version has the key `FORMER_KEY` in its report, or a former
//! code at the end of its error message. [`with_current_names`] returns it with current names in `report` and `error`,
//! on one line. All others, and texts that are no JSON, are returned unchanged. The store applies the conversion when
//! it reads, so that old results remain usable.

use crate::code::Code;
use crate::fit;
use serde_json::Value;

/// Text that every report of version 0.1 contains, and no later one.
const FORMER_KEY: &str = "\"basins\":";

/// A stored result with current keys and codes, on one line; current results, and texts that are no JSON, are returned
/// unchanged.
pub(crate) fn with_current_names(result: &str) -> String {
    if !has_former_names(result) {
        return result.into();
    }
    let Ok(mut whole) = serde_json::from_str::<Value>(result) else { return result.into() };
    for key in ["report", "error"] {
        if let Some(part) = whole.get_mut(key) {
            fit::with_current_names(part);
        }
    }
    whole.to_string()
}

/// Whether a result has a former key ([`FORMER_KEY`]), or a former code in brackets at the end of its error message,
/// before the key `platform`.
fn has_former_names(result: &str) -> bool {
    let has_former_code = || {
        let former = Code::ALL.iter().filter_map(|code| code.former_name());
        former.into_iter().any(|name| result.contains(&format!("[{name}]\",\"platform\":")))
    };
    result.contains(FORMER_KEY) || has_former_code()
}
