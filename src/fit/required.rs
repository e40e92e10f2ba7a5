//! Required keys of a fit file, as rules for messages about missing keys.

use crate::input::missing_keys::{Keys, Rule, always, if_there};

/// The required keys of every table.
pub(crate) const REQUIRED: [Rule; 13] = [
    always("", fit_keys),
    if_there("field[]", |_| &["name", "sigma", "length"]),
    if_there("parameter[]", |_| &["name"]),
    if_there("parameter[].prior", |_| &["mean", "sigma"]),
    if_there("known[]", |_| &["name", "sigma"]),
    if_there("known[].correlation[]", |_| &["with", "value"]),
    if_there("observation[]", observation_keys),
    if_there("shape[]", shape_keys),
    if_there("frequencies[]", |_| &["sigma"]),
    if_there("experiment[]", experiment_keys),
    if_there("experiment[].observation[]", observation_keys),
    if_there("experiment[].shape[]", shape_keys),
    if_there("experiment[].frequencies[]", |_| &["sigma"]),
];

/// Required keys of the file: `parameter`, unless lists along the rod are fitted or all measurements are validation data.
fn fit_keys(fit: &toml::Table) -> Keys {
    let held_out = |table: &toml::Value| table.get("held_out") == Some(&toml::Value::Boolean(true));
    let experiments = fit.get("experiment").and_then(toml::Value::as_array);
    let only_predicts = experiments.is_some_and(|list| list.iter().all(held_out));
    if fit.contains_key("field") || only_predicts { &[] } else { &["parameter"] }
}

/// Required keys of an experiment. Experiments of recordings have the names of these.
fn experiment_keys(experiment: &toml::Table) -> Keys {
    match experiment.contains_key("path") || experiment.contains_key("paths") {
        true => &["scene"],
        false => &["name", "scene"],
    }
}

/// Required keys of an observation. Free markers are in the recording that prescribes the ends, and planned observations have
/// no file.
fn observation_keys(observation: &toml::Table) -> Keys {
    let free = observation.get("markers").is_some_and(toml::Value::is_str);
    match observation.contains_key("duration") {
        true => &["fps"],
        false if free => &[],
        false => &["file"],
    }
}

/// Required keys of a shape. Planned shapes have arc lengths instead of a file.
fn shape_keys(shape: &toml::Table) -> Keys {
    if shape.contains_key("at") { &[] } else { &["file"] }
}
