//! Required keys of a fit file, as a list of rules by table for messages about missing keys.
//!
//! A rule returns the required keys of each table of a name, such as `experiment[].shape[]` for each shape of each
//! experiment. Most lists are fixed; others depend on the keys that the table has. An observation needs `file`, a
//! planned one (`duration`) `fps` instead, and free markers (`markers` is a string) need none. A shape needs `file`
//! unless it has `at`. An experiment needs `scene`, and `name` unless it has `path` or `paths`. The file needs a
//! `parameter`, unless it has a `field` or all `[[experiment]]` are held out. [`REQUIRED`] has all rules. The parser in
//! `input::missing_keys` reports all missing keys of a file at once by them; values are not checked here.

use crate::input::missing_keys::{Keys, Rule, always, if_there};

/// The rules for the required keys of every table of a fit file. The first is that of the file itself; the others apply
/// to every table of their name.
pub(crate) const REQUIRED: [Rule; 17] = [
    always("", fit_keys),
    if_there("field[]", |_| &["name", "sigma", "length"]),
    if_there("parameter[]", |_| &["name"]),
    if_there("parameter[].prior", |_| &["mean", "sigma"]),
    if_there("known[]", |_| &["name", "sigma"]),
    if_there("known[].correlation[]", |_| &["with", "value"]),
    if_there("observation[]", observation_keys),
    if_there("shape[]", shape_keys),
    if_there("frequencies[]", |_| &["sigma"]),
    if_there("load_deflection[]", |_| &["load", "file"]),
    if_there("buckling[]", |_| &["load", "value", "sigma"]),
    if_there("experiment[]", experiment_keys),
    if_there("experiment[].observation[]", observation_keys),
    if_there("experiment[].shape[]", shape_keys),
    if_there("experiment[].frequencies[]", |_| &["sigma"]),
    if_there("experiment[].load_deflection[]", |_| &["load", "file"]),
    if_there("experiment[].buckling[]", |_| &["load", "value", "sigma"]),
];

/// Required keys of the file: `parameter`. Empty if the file fits lists along the rod (`field`), or if every
/// `[[experiment]]` has `held_out = true`.
fn fit_keys(fit: &toml::Table) -> Keys {
    let held_out = |table: &toml::Value| table.get("held_out") == Some(&toml::Value::Boolean(true));
    let experiments = fit.get("experiment").and_then(toml::Value::as_array);
    let only_predicts = experiments.is_some_and(|list| list.iter().all(held_out));
    if fit.contains_key("field") || only_predicts { &[] } else { &["parameter"] }
}

/// Required keys of `[[experiment]]`: a scene, and a name unless a recording in `path` or `paths` provides it.
fn experiment_keys(experiment: &toml::Table) -> Keys {
    match experiment.contains_key("path") || experiment.contains_key("paths") {
        true => &["scene"],
        false => &["name", "scene"],
    }
}

/// Required keys of `[[observation]]`: `file`. Planned observations (with `duration`) need `fps` instead. Free markers
/// (`markers` is a string), which are in the recording that prescribes the ends, need none.
fn observation_keys(observation: &toml::Table) -> Keys {
    let free = observation.get("markers").is_some_and(toml::Value::is_str);
    match observation.contains_key("duration") {
        true => &["fps"],
        false if free => &[],
        false => &["file"],
    }
}

/// Required keys of `[[shape]]`: `file`; none for a planned shape, which has arc lengths (`at`).
fn shape_keys(shape: &toml::Table) -> Keys {
    if shape.contains_key("at") { &[] } else { &["file"] }
}
