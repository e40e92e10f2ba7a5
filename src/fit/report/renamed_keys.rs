//! Keys of reports that were renamed after version 0.1, and the conversion of stored reports.
//!
//! Campaigns and other programs keep reports as JSON. [`with_current_names`] takes a JSON value and replaces former
//! keys by the current ones, in place, at any depth; no number changes, and current reports stay as they are. A former
//! key is recognized by the current key of the object or array that contains it (empty for the report), by the table
//! [`RENAMED_KEYS`]. Former codes are replaced in `warning_codes`, and in brackets at the end of any text.

use crate::code::{Code, named};
use serde_json::{Map, Value};

/// A key of a report that has another name than in version 0.1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct RenamedKey {
    /// Current key of the object or array that contains it; empty for the report itself.
    pub within: &'static str,
    /// Key in version 0.1.
    pub former: &'static str,
    /// Current key.
    pub current: &'static str,
}

/// An entry of the table [`RENAMED_KEYS`]: the key `former` in the container `within` is now `current`.
const fn key(within: &'static str, former: &'static str, current: &'static str) -> RenamedKey {
    RenamedKey { within, former, current }
}

/// All renamed keys of the reports of fits, plans, fits along the rod and inspections.
pub const RENAMED_KEYS: &[RenamedKey] = &[
    key("", "basins", "local_minima"),
    key("local_minima", "words", "summary"),
    key("list", "seen", "found_by"),
    key("", "could_hide", "undetected_bias"), // old name
    key("undetected_bias", "words", "effect"),
    key("undetected_bias", "plausible", "plausible_size"),
    key("undetected_bias", "visible", "residual_effect"),
    key("undetected_bias", "tell", "test"), // old name
    key("score_tests", "words", "effect"),
    key("score_tests", "place", "rank"),
    key("score_tests", "sigmas", "z_score"),
    key("not_identifiable", "words", "description"),
    key("parameters", "one_per_cent", "input_sensitivities"),
    key("parameters", "across_experiments", "cluster_jackknife"),
    key("residual_tests", "correlation", "autocorrelation"),
    key("residual_tests", "new_whiteness", "innovation_whiteness"),
    key("residual_tests", "doubt", "significance_level"),
    key("losses", "beyond_scale", "down_weighted"),
    key("losses", "error_factor", "std_error_factor"),
    key("", "evidence", "plot_data"),
    key("plot_data", "asked", "ranges"),
    key("plot_data", "setups", "settings"),
    key("settings", "measured", "measurements"),
    key("series", "over", "abscissa"),
    key("series", "at", "abscissa_values"),
    key("motions", "moments", "snapshots"),
    key("snapshots", "seen", "markers"),
    key("advice", "question", "variable"),
    key("advice", "of", "observation"),
    key("fields", "places", "arc_lengths"),
    key("fields", "prior", "prior_std"),
    key("", "determined", "effective_parameters"),
    key("", "residuals_over_sigma", "normalized_residual_rms"),
    key("", "measured", "values"),
    key("", "leaps", "clock_gaps"),
    key("markers", "seen", "detected"),
    key("markers", "unsure", "low_confidence"),
    key("", "keeps_series", "has_series"),
];

/// Replaces former keys and codes of warnings of a report, in place. Current reports stay as they are.
pub fn with_current_names(report: &mut Value) {
    rename(report, "");
}

/// Replaces former keys and codes in a `value`, in place, and in all values that it contains. `within` is its (current)
/// key in its container; elements of an array have that of the array.
fn rename(value: &mut Value, within: &str) {
    match value {
        Value::Object(object) => {
            let renamed = std::mem::take(object).into_iter().map(|(name, mut value)| {
                // The container identifies a key: the same name may have had several meanings.
                let is_former = |key: &&RenamedKey| key.within == within && key.former == name;
                let name = match RENAMED_KEYS.iter().find(is_former) {
                    Some(key) => key.current.to_string(),
                    None => name,
                };
                rename(&mut value, &name);
                (name, value)
            });
            *object = renamed.collect::<Map<_, _>>();
        }
        Value::Array(list) => list.iter_mut().for_each(|value| rename(value, within)),
        Value::String(text) => {
            if let Some(current) = with_current_code(text, within == "warning_codes") {
                *text = current;
            }
        }
        _ => {}
    }
}

/// The text with the current code instead of a former one: of a message that ends with the code in brackets, or, if
/// `is_code`, of a code alone. `None` for texts without a former code.
fn with_current_code(text: &str, is_code: bool) -> Option<String> {
    // Brackets inside a text are no codes: only the last ones of a warning are.
    let (message, name) = match is_code {
        true => ("", text),
        false => text.strip_suffix(']')?.rsplit_once('[')?,
    };
    let code: Code = named(name).filter(|code| code.former_name() == Some(name))?;
    Some(if is_code { code.name().into() } else { format!("{message}[{code}]") })
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    /// Keys are renamed by the key of their container only: `correlation` of the report itself stays.
    #[test]
    fn former_report_gets_current_names() {
        let mut report = json!({
            "basins": { "count": 1, "list": [{ "seen": "fit", "misfit": 0.1 }], "words": "one" },
            "could_hide": [{ "words": "taper", "tell": "calliper", "size": 1.0 }], // old name
            "correlation": [[1.0]],
            "residual_tests": [{ "correlation": 0.5, "doubt": 0.001 }],
            "warning_codes": ["could-hide", "at-bound"], // old name
            "warnings": ["words [could-hide]", "words [x]", "leap"], // old name
        });
        let current = json!({
            "local_minima": { "count": 1, "list": [{ "found_by": "fit", "misfit": 0.1 }], "summary": "one" },
            "undetected_bias": [{ "effect": "taper", "test": "calliper", "size": 1.0 }],
            "correlation": [[1.0]],
            "residual_tests": [{ "autocorrelation": 0.5, "significance_level": 0.001 }],
            "warning_codes": ["undetected-bias", "at-bound"],
            "warnings": ["words [undetected-bias]", "words [x]", "leap"],
        });
        with_current_names(&mut report);
        assert_eq!(report, current);
        with_current_names(&mut report);
        assert_eq!(report, current);
    }

    /// The table of renamed keys in the changelog has a row for each.
    #[test]
    fn changelog_lists_every_renamed_key() {
        let changelog = include_str!("../../../CHANGELOG.md");
        for RenamedKey { within, former, current } in RENAMED_KEYS {
            let place = if within.is_empty() { "report".into() } else { format!("`{within}`") };
            let row = format!("  | {place} | `{former}` | `{current}` |\n");
            assert!(changelog.contains(&row), "{row}");
        }
    }
}
