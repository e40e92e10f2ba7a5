//! What a fit file must say.

use crate::input::missing_keys::{Keys, Rule, always, if_there};

/// What a fit file must have.
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

/// Lists of numbers along the rod are unknowns too, and predictions have none.
fn fit_keys(fit: &toml::Table) -> Keys {
    let held_out = |table: &toml::Value| table.get("held_out") == Some(&toml::Value::Boolean(true));
    let experiments = fit.get("experiment").and_then(toml::Value::as_array);
    let only_predicts = experiments.is_some_and(|list| list.iter().all(held_out));
    if fit.contains_key("field") || only_predicts { &[] } else { &["parameter"] }
}

/// Experiments of recordings are called after these.
fn experiment_keys(experiment: &toml::Table) -> Keys {
    match experiment.contains_key("path") || experiment.contains_key("paths") {
        true => &["scene"],
        false => &["name", "scene"],
    }
}

/// Free markers are in the recording that leads the rod's ends; what is only planned is in no file.
fn observation_keys(observation: &toml::Table) -> Keys {
    let free = observation.get("markers").is_some_and(toml::Value::is_str);
    match observation.contains_key("duration") {
        true => &["fps"],
        false if free => &[],
        false => &["file"],
    }
}

fn shape_keys(shape: &toml::Table) -> Keys {
    if shape.contains_key("at") { &[] } else { &["file"] }
}
