//! Messages about likely mistakes behind an input file (TOML) that cannot be parsed as its kind.
//!
//! [`explained`] takes the error, the text and the expected kind of file ([`SCENE`], [`STRUCTURE`], [`FIT`] or
//! [`CAMPAIGN`]). It replaces the message of the TOML reader if the text is valid TOML with one of two mistakes. First,
//! a file without a key of its own kind, but with one of another kind (a fit instead of a scene): the message names
//! that kind and its commands. Second, `[[table]]` for `[table]`, or the other way round: the message has its line, if
//! the header is found. Other errors stay.

use crate::error::Error;
use toml::{Table, Value};

/// A kind of input file.
pub(crate) struct FileKind {
    /// Its name, with an article.
    name: &'static str,
    /// Keys at the root by which a file of this kind is recognized: every file has at least one of them.
    marks: &'static [&'static str],
    /// Commands for such files, for messages.
    commands: &'static str,
    /// Tables that occur once: `[rod]`.
    single: &'static [&'static str],
    /// Tables that may be repeated: `[[parameter]]`; nested ones by their path.
    repeated: &'static [&'static str],
}

/// Scene file: one rod with its supports, loads and times.
pub(crate) const SCENE: FileKind = FileKind {
    name: "a scene",
    marks: &["rod", "material"],
    commands: "use it with `rodfit simulate`, `static`, `modes` and `predict`, or as `scene = \"..\"` in a fit \
               file",
    single: &[
        "rod",
        "rod.shape",
        "rod.section",
        "rod.taper",
        "material",
        "supports",
        "supports.path",
        "loads",
        "loads.damping",
        "loads.drag",
        "initial",
        "initial.shape",
        "time",
        "camera",
    ],
    repeated: &[
        "rod.mass",
        "loads.point",
        "loads.line",
        "initial.point",
        "supports.motion",
        "energy",
        "signals",
        "sensors",
        "actuation",
        "contacts",
        "contacts.motion",
    ],
};

/// Structure file: several rods with bodies and joints.
pub(crate) const STRUCTURE: FileKind = FileKind {
    name: "a structure",
    marks: &["rods"],
    commands: "use it with `rodfit simulate`, `static` and `modes`, or as `scene = \"..\"` in a fit file",
    single: &["loads", "loads.damping", "initial", "time", "camera"],
    repeated: &[
        "rods",
        "rods.mass",
        "materials",
        "bodies",
        "joints",
        "supports",
        "loads.point",
        "contacts",
        "contacts.motion",
        "rod_contacts",
    ],
};

/// Fit file: observations of a motion and free parameters.
pub(crate) const FIT: FileKind = FileKind {
    name: "a fit file",
    marks: &[
        "parameter",
        "observation",
        "experiment",
        "shape",
        "frequencies",
        "load_deflection",
        "buckling",
        "field",
    ],
    commands: "use it with `rodfit fit` or `rodfit design`",
    single: &["analysis"],
    repeated: &[
        "observation",
        "shape",
        "frequencies",
        "load_deflection",
        "buckling",
        "experiment",
        "experiment.observation",
        "experiment.shape",
        "experiment.frequencies",
        "experiment.load_deflection",
        "experiment.buckling",
        "parameter",
        "known",
        "field",
    ],
};

/// Campaign file: many fits on one or several machines.
pub(crate) const CAMPAIGN: FileKind = FileKind {
    name: "a campaign file",
    marks: &["fits", "grid", "starts", "bootstrap", "table"],
    commands: "use it with `rodfit campaign plan`",
    single: &["grid", "bootstrap", "starts"],
    repeated: &[],
};

/// The parse error with the likely mistake as its message, if `text` is valid TOML with one. `read_as` is the kind of
/// file that was expected; a file of another kind is reported before wrong brackets. Other errors, and errors of texts
/// without such a mistake, are unchanged.
pub(crate) fn explained(error: Error, text: &str, read_as: &FileKind) -> Error {
    let Error::Parse { file, message } = error else { return error };
    // The text is TOML, but not of this kind: the likely mistake is clearer than the parser's
    // message.
    let hint = text.parse::<Table>().ok().and_then(|table| {
        other_kind(&table, read_as).or_else(|| wrong_brackets(&table, text, read_as))
    });
    Error::Parse { file, message: hint.unwrap_or(message) }
}

/// Message that a file is of another kind than `read_as`, with the commands for it. None for a file with a key of the
/// kind `read_as`, and for one without a key of any kind.
fn other_kind(table: &Table, read_as: &FileKind) -> Option<String> {
    let has_marks = |kind: &FileKind| kind.marks.iter().any(|key| table.contains_key(*key));
    // A file with a key of its own kind has another error.
    if has_marks(read_as) {
        return None;
    }
    let other = [&SCENE, &STRUCTURE, &FIT, &CAMPAIGN].into_iter().find(|kind| has_marks(kind))?;
    Some(format!("this is {}, not {}; {}", other.name, read_as.name, other.commands))
}

/// Message about the first table of the kind `read_as` that is given as a list (`[[x]]` for `[x]`), or else about the
/// first list that is given as a table. The order is that of `single` and `repeated` of the kind. The message begins
/// with the line of its header in `text`, if that is found. None without such a mistake.
fn wrong_brackets(table: &Table, text: &str, read_as: &FileKind) -> Option<String> {
    let is_list = |value: &Value| {
        value.as_array().is_some_and(|list| !list.is_empty() && list.iter().all(Value::is_table))
    };
    let line = |header: String| {
        let is_header = |line: &str| line.replace([' ', '\t'], "").starts_with(&header);
        let number = text.lines().position(is_header);
        number.map_or(String::new(), |number| format!("line {}: ", number + 1))
    };
    // Brackets are the most frequent mistake: [[x]] for [x], and the other way round.
    for path in read_as.single {
        if value_at(table, path).is_some_and(is_list) {
            return Some(format!(
                "{}found [[{path}]], allowed: [{path}], once",
                line(format!("[[{path}]]"))
            ));
        }
    }
    for path in read_as.repeated {
        if value_at(table, path).is_some_and(Value::is_table) {
            return Some(format!(
                "{}found [{path}], allowed: [[{path}]], with double brackets even if there is only one",
                line(format!("[{path}]"))
            ));
        }
    }
    None
}

/// Value at a dotted path (`rod.shape`); in a list of tables the first one is followed. None if a part is missing or is
/// no table.
fn value_at<'a>(table: &'a Table, path: &str) -> Option<&'a Value> {
    let (first, rest) =
        path.split_once('.').map_or((path, None), |(first, rest)| (first, Some(rest)));
    let value = table.get(first)?;
    let Some(rest) = rest else { return Some(value) };
    let inner = match value {
        // Tables of a list have the same keys: the first one represents them.
        Value::Array(list) => list.first()?,
        value => value,
    };
    value_at(inner.as_table()?, rest)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Message of a parse error after the search for a likely mistake.
    fn hint(text: &str, read_as: &FileKind) -> String {
        let error = Error::Parse { file: None, message: "plain".into() };
        explained(error, text, read_as).to_string()
    }

    #[test]
    fn file_of_another_kind_is_named_with_its_commands() {
        let scene = "[rod]\n[material]\ndensity = 1";
        let fit = "scene = \"a\"\n[[parameter]]\nname = \"youngs_modulus\"";
        let campaign = "fits = [\"a\"]";
        for (text, read_as, words) in [
            (scene, &FIT, ["this is a scene, not a fit file", "rodfit simulate"]),
            (fit, &SCENE, ["this is a fit file, not a scene", "rodfit fit"]),
            (campaign, &FIT, ["this is a campaign file, not a fit file", "campaign plan"]),
            (fit, &CAMPAIGN, ["this is a fit file, not a campaign file", "rodfit fit"]),
        ] {
            let found = hint(text, read_as);
            assert!(words.iter().all(|word| found.contains(word)), "{found}");
        }
        assert_eq!(hint("[rod]\nlenght = 1", &SCENE), "plain");
        assert_eq!(hint("nonsense", &SCENE), "plain");
    }

    #[test]
    fn wrong_brackets_are_named_with_their_line() {
        for (text, read_as, words) in [
            (
                "[rod]\n\n[[material]]\ndensity = 1",
                &SCENE,
                "line 3: found [[material]], allowed: [material]",
            ),
            (
                "[rod]\n[[rod.shape]]\nkind = \"arc\"",
                &SCENE,
                "found [[rod.shape]], allowed: [rod.shape]",
            ),
            (
                "[rod]\n[loads.point]\nnode = 1",
                &SCENE,
                "found [loads.point], allowed: [[loads.point]]",
            ),
            (
                "[parameter]\nname = \"a\"",
                &FIT,
                "line 1: found [parameter], allowed: [[parameter]]",
            ),
            (
                "[[experiment]]\n[experiment.shape]\nfile = \"a\"",
                &FIT,
                "allowed: [[experiment.shape]]",
            ),
            ("[[analysis]]\n[[parameter]]", &FIT, "found [[analysis]], allowed: [analysis]"),
        ] {
            let found = hint(text, read_as);
            assert!(found.contains(words), "{found}");
        }
    }
}
