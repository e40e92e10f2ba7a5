//! Required keys of the tables of a scene file.
//!
//! [`REQUIRED`] has a rule for each table: `[rod]` and `[material]` are always required, the others (shapes, sections,
//! masses, times, loads, signals, actuators, contacts, motions, recordings) are checked if they are given. A rule is a
//! function from a table to the keys that it must have. Those of a shape, section, actuator or contact depend on its
//! `kind`; only `kind` is required if it is missing or unknown. A polyline needs `file` unless it has `points`. The
//! rules do not decide whether a file is valid. If it cannot be parsed, `input::missing_keys` finds by them all keys
//! that are missing, for the error.

use crate::input::missing_keys::{Keys, Rule, always, if_there};

/// Required keys of every table of a scene file.
pub(crate) const REQUIRED: [Rule; 16] = [
    always("rod", |_| &["shape", "section"]),
    always("material", |_| &["density", "youngs_modulus"]),
    if_there("rod.shape", shape_keys),
    if_there("rod.section", section_keys),
    if_there("initial.shape", shape_keys),
    if_there("rod.mass[]", |_| &["node", "mass"]),
    if_there("time", |_| &["end"]),
    if_there("loads.point[]", |_| &["node"]),
    if_there("loads.line[]", |_| &["force"]),
    if_there("signals[]", |_| &["name"]),
    if_there("sensors[]", |_| &["name"]),
    if_there("actuation[]", actuation_keys),
    if_there("contacts[]", contact_keys),
    if_there("initial.point[]", |_| &["node"]),
    if_there("supports.motion[]", |_| &["end"]),
    if_there("supports.path", |_| &["file"]),
];

/// Required keys of a shape by its `kind`; a polyline requires `file` unless it has `points`. Only `kind` if that is
/// missing or unknown.
pub(super) fn shape_keys(shape: &toml::Table) -> Keys {
    match shape.get("kind").and_then(toml::Value::as_str) {
        Some("straight") => &["length", "direction"],
        Some("helix") => &["length", "radius", "pitch", "axis", "handedness"],
        Some("arc") => &["length", "angle"],
        Some("polyline") if shape.contains_key("points") => &[],
        Some("polyline") => &["file"],
        _ => &["kind"],
    }
}

/// Required keys of an actuator by its `kind`. Only `kind` if that is missing or unknown.
fn actuation_keys(actuator: &toml::Table) -> Keys {
    match actuator.get("kind").and_then(toml::Value::as_str) {
        Some("curvature") => &["component", "gain"],
        Some("tendon") => &["tension", "route"],
        _ => &["kind"],
    }
}

/// Required keys of a contact by its `kind`. Only `kind` if that is missing or unknown.
fn contact_keys(contact: &toml::Table) -> Keys {
    match contact.get("kind").and_then(toml::Value::as_str) {
        Some("plane") => &["point", "normal"],
        Some("sphere") => &["center", "radius"],
        Some("cylinder") => &["point", "axis", "radius"],
        Some("capsule") => &["from", "to", "radius"],
        _ => &["kind"],
    }
}

/// Required keys of a section by its `kind`. Only `kind` if that is missing or unknown.
pub(super) fn section_keys(section: &toml::Table) -> Keys {
    match section.get("kind").and_then(toml::Value::as_str) {
        Some("circle") => &["radius"],
        Some("tube") => &["radius", "thickness"],
        Some("rectangle") => &["width", "height", "up"],
        Some("custom") => &["area", "i1", "i2", "j", "up"],
        _ => &["kind"],
    }
}
