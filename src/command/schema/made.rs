//! Schemas made from the types and their documentation, and held against the files that the program prints.

use super::Of;
use clap::ValueEnum;
use rodfit::Scene;
use rodfit::campaign::Plan;
use rodfit::dynamics::SimulationReport;
use rodfit::fit::{FitFile, FitReport};
use schemars::generate::SchemaSettings;
use schemars::transform::{Transform, transform_subschemas};
use schemars::{JsonSchema, Schema};
use serde_json::{Map, Value};

/// With this variable set, files that differ are written anew.
const WRITE: &str = "RODFIT_WRITE_SCHEMAS";

fn made(of: Of) -> Schema {
    match of {
        Of::Scene => schema::<Scene>(false, "Scene of rodfit"),
        Of::Fit => schema::<FitFile>(false, "Fit of rodfit"),
        Of::Campaign => schema::<Plan>(false, "Campaign of rodfit"),
        Of::Result => schema::<FitReport>(true, "Result of a fit by rodfit"),
        Of::Simulation => schema::<SimulationReport>(true, "Result of a simulation by rodfit"),
    }
}

#[test]
fn the_files_say_what_the_types_say() {
    let all: Vec<(Of, Value)> =
        Of::value_variants().iter().map(|of| (*of, made(*of).to_value())).collect();
    if std::env::var_os(WRITE).is_some() {
        return write(all);
    }
    for (of, made) in all {
        let command = format!("{WRITE}=1 cargo test --release --lib the_files_say");
        assert!(
            of.text() == format!("{made:#}"),
            "the schema of a {} is another: {command}",
            name(of)
        );
    }
}

fn name(of: Of) -> String {
    of.to_possible_value().expect("none is hidden").get_name().to_string()
}

/// Writes the files, what several define into one.
fn write(mut all: Vec<(Of, Value)>) {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/src/command/schema");
    let file = |name: &str, value: &Value| {
        std::fs::write(format!("{folder}/{name}.json"), format!("{value:#}\n")).unwrap();
    };
    let mut shared = Map::new();
    for k in 0..all.len() {
        let (before, from) = all.split_at(k);
        for (name, definition) in from[0].1["definitions"].as_object().into_iter().flatten() {
            if before.iter().any(|(_, other)| other["definitions"].get(name) == Some(definition)) {
                shared.entry(name).or_insert(definition.clone());
            }
        }
    }
    for (of, schema) in &mut all {
        for (name, definition) in schema["definitions"].as_object_mut().into_iter().flatten() {
            if shared.get(name) == Some(&*definition) {
                *definition = true.into();
            }
        }
        file(&name(*of), schema);
    }
    file("shared", &Value::Object(shared));
}

/// Of what is read, or of what is written, in the draft that most editors know.
fn schema<T: JsonSchema>(written: bool, title: &str) -> Schema {
    let settings = SchemaSettings::draft07();
    let settings = if written { settings.for_serialize() } else { settings };
    let mut schema = settings.into_generator().into_root_schema_for::<T>();
    Plain { nulls: written }.transform(&mut schema);
    schema.insert("title".into(), title.into());
    schema
}

/// Removes the links of the code's documentation, and nulls, which TOML lacks.
struct Plain {
    /// Whether they are kept.
    nulls: bool,
}

impl Transform for Plain {
    fn transform(&mut self, schema: &mut Schema) {
        transform_subschemas(self, schema);
        let Some(object) = schema.as_object_mut() else { return };
        if let Some(Value::Object(properties)) = object.get_mut("properties") {
            for property in properties.values_mut().filter_map(Value::as_object_mut) {
                if let Some(Value::String(tag)) = property.get("const")
                    && !property.contains_key("description")
                {
                    let text = format!("Always `{tag}`: selects this kind.");
                    property.insert("description".into(), text.into());
                }
            }
        }
        if let Some(Value::String(words)) = object.get_mut("description") {
            *words = plain(words);
        }
        if self.nulls {
            return;
        }
        if object.get("default").is_some_and(Value::is_null) {
            object.remove("default");
        }
        if let Some(Value::Array(types)) = object.get_mut("type") {
            types.retain(|name| name != "null");
            if let [one] = &types[..] {
                let one = one.clone();
                object.insert("type".into(), one);
            }
        }
        if let Some(Value::Array(any)) = object.get_mut("anyOf") {
            any.retain(|one| one.get("type").is_none_or(|name| name != "null"));
        }
    }
}

/// The first words of a documentation: until an example, and without links.
fn plain(words: &str) -> String {
    let words = words.split("```").next().unwrap_or_default();
    let words: Vec<&str> = words.split_whitespace().collect();
    let (words, mut plain) = (words.join(" "), String::new());
    let mut rest = &words[..];
    while let Some((before, after)) = rest.split_once('[') {
        plain += before;
        match after.split_once(']') {
            Some((text, target)) if target.starts_with('(') => {
                plain += text;
                rest = target.split_once(')').map_or("", |(_, rest)| rest);
            }
            Some((text, behind)) if text.starts_with('`') => {
                plain += text;
                rest = behind;
            }
            _ => {
                plain.push('[');
                rest = after;
            }
        }
    }
    plain + rest
}

#[test]
fn links_become_their_words() {
    let words = "The [motion](crate::accuracy), by\n[`Scene::load`] in [0, 1]. [a\n\n```\nx\n```";
    assert_eq!(plain(words), "The motion, by `Scene::load` in [0, 1]. [a");
}

/// Paths of the properties and definitions of a schema whose description is missing or refers to its neighbors.
fn dependent_descriptions(path: &str, value: &Value, found: &mut Vec<String>) {
    let starts =
        ["The same", "Of ", "On ", "Likewise", "Its ", "It ", "As many", "Those ", "In the same"];
    let Value::Object(object) = value else { return };
    let description = object.get("description").and_then(Value::as_str);
    if description.is_some_and(|text| starts.iter().any(|start| text.starts_with(start))) {
        found.push(path.into());
    }
    for group in ["properties", "definitions"] {
        for (name, inner) in object.get(group).and_then(Value::as_object).into_iter().flatten() {
            let path = format!("{path}/{name}");
            if inner.is_object() && inner.get("description").is_none() {
                found.push(format!("{path} (none)"));
            }
            dependent_descriptions(&path, inner, found);
        }
    }
    for group in ["anyOf", "oneOf", "allOf"] {
        for inner in object.get(group).and_then(Value::as_array).into_iter().flatten() {
            dependent_descriptions(path, inner, found);
        }
    }
}

#[test]
fn descriptions_of_schemas_stand_alone() {
    for of in Of::value_variants() {
        let mut found = Vec::new();
        dependent_descriptions("", made(*of).as_value(), &mut found);
        assert!(found.is_empty(), "{}: {found:#?}", name(*of));
    }
}
