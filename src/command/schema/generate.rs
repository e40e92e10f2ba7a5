//! Tests of the schemas in `src/command/schema`: they are generated from the types and their documentation (schemars,
//! draft 07) and compared with the files that the program prints. Every description must be present and stand alone.
//!
//! Definitions that are equal in several schemas are in `shared.json`, with `true` in their places. With the
//! environment variable `RODFIT_WRITE_SCHEMAS` the test writes the files instead.

use super::SchemaKind;
use clap::ValueEnum;
use rodfit::campaign::Plan;
use rodfit::dynamics::SimulationReport;
use rodfit::fit::{Design, FieldReport, FitFile, FitReport, ValidationReport};
use rodfit::statics::Equilibrium;
use rodfit::structure::{StructureEquilibrium, StructureModes, StructureReport};
use rodfit::study::Study;
use rodfit::vibration::Modes;
use rodfit::{Scene, StructureScene};
use schemars::generate::SchemaSettings;
use schemars::transform::{Transform, transform_subschemas};
use schemars::{JsonSchema, Schema};
use serde_json::{Map, Value};

/// Environment variable with which the test writes the files instead of comparing them.
const WRITE: &str = "RODFIT_WRITE_SCHEMAS";

/// The schema of a kind of file or result, generated from its type: as read for input files, as serialized for results.
fn generated(of: SchemaKind) -> Schema {
    match of {
        // Input files have schemas of deserialization, results (`true`) those of serialization.
        SchemaKind::Scene => schema::<Scene>(false, "Scene of rodfit"),
        SchemaKind::Structure => schema::<StructureScene>(false, "Structure of rodfit"),
        SchemaKind::StructureSimulation => {
            schema::<StructureReport>(true, "Result of the simulation of a structure by rodfit")
        }
        SchemaKind::StructureStatic => {
            schema::<StructureEquilibrium>(true, "Equilibrium of a structure by rodfit")
        }
        SchemaKind::StructureModes => {
            schema::<StructureModes>(true, "Vibration modes of a structure by rodfit")
        }
        SchemaKind::Fit => schema::<FitFile>(false, "Fit of rodfit"),
        SchemaKind::Campaign => schema::<Plan>(false, "Campaign of rodfit"),
        SchemaKind::Result => schema::<FitReport>(true, "Result of a fit by rodfit"),
        SchemaKind::FieldResult => {
            schema::<FieldReport>(true, "Result of a fit of values along the rod by rodfit")
        }
        SchemaKind::Simulation => {
            schema::<SimulationReport>(true, "Result of a simulation by rodfit")
        }
        SchemaKind::Static => schema::<Equilibrium>(true, "Equilibrium by rodfit"),
        SchemaKind::Modes => schema::<Modes>(true, "Vibration modes by rodfit"),
        SchemaKind::Study => schema::<Study>(true, "Work-precision study by rodfit"),
        SchemaKind::Predict => schema::<ValidationReport>(true, "Prediction errors by rodfit"),
        SchemaKind::Design => schema::<Design>(true, "Expected uncertainties of a plan by rodfit"),
    }
}

/// A kind with its generated schema (JSON).
struct Generated {
    of: SchemaKind,
    schema: Value,
}

#[test]
fn schema_files_equal_those_of_the_types() {
    let kinds = SchemaKind::value_variants().iter();
    let all: Vec<Generated> =
        kinds.map(|of| Generated { of: *of, schema: generated(*of).to_value() }).collect();
    if std::env::var_os(WRITE).is_some() {
        return write(all);
    }
    for Generated { of, schema } in all {
        let command = format!("{WRITE}=1 cargo test --release --lib schema_files");
        let is_same = of.text() == format!("{schema:#}");
        assert!(is_same, "the schema of a {} is another: {command}", name(of));
    }
}

/// The name of a kind on the command line, which is the stem of its schema file.
fn name(of: SchemaKind) -> String {
    of.to_possible_value().expect("none is hidden").get_name().to_string()
}

/// Writes all schemas to the files of the repository, one per kind. Definitions that are equal in at least two schemas
/// go into `shared.json`; `true` replaces them.
fn write(mut all: Vec<Generated>) {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/src/command/schema");
    let file = |name: &str, value: &Value| {
        std::fs::write(format!("{folder}/{name}.json"), format!("{value:#}\n")).unwrap();
    };
    let mut shared = Map::new();
    for (k, later) in all.iter().enumerate() {
        for (name, definition) in later.schema["definitions"].as_object().into_iter().flatten() {
            let has_it =
                |other: &Generated| other.schema["definitions"].get(name) == Some(definition);
            // A definition is shared if an earlier schema has an equal one; other contents of the same name stay in
            // place.
            if all[..k].iter().any(has_it) {
                shared.entry(name).or_insert(definition.clone());
            }
        }
    }
    for Generated { of, schema } in &mut all {
        for (name, definition) in schema["definitions"].as_object_mut().into_iter().flatten() {
            if shared.get(name) == Some(&*definition) {
                *definition = true.into();
            }
        }
        file(&name(*of), schema);
    }
    file("shared", &Value::Object(shared));
}

/// The schema (draft 07, which most editors support) of a type: of its serialized form if `written`, else of the form
/// that is read from TOML, without nulls. Descriptions become plain text without links and examples; it has this
/// `title`.
fn schema<T: JsonSchema>(written: bool, title: &str) -> Schema {
    let settings = SchemaSettings::draft07();
    let settings = if written { settings.for_serialize() } else { settings };
    let mut schema = settings.into_generator().into_root_schema_for::<T>();
    Plain { nulls: written }.transform(&mut schema);
    schema.insert("title".into(), title.into());
    schema
}

/// A transformation of a schema: removes links and examples from descriptions, describes constant tags, and removes
/// nulls from schemas of TOML, which has none.
struct Plain {
    /// Whether nulls are kept.
    nulls: bool,
}

impl Transform for Plain {
    /// Changes the schema and all its subschemas in place: a description for constant tags without one, plain
    /// descriptions, and, unless nulls are kept, no null as default, type or alternative.
    fn transform(&mut self, schema: &mut Schema) {
        transform_subschemas(self, schema);
        let Some(object) = schema.as_object_mut() else { return };
        // A constant tag, as `kind = "circle"`, has no documentation of its own.
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
        // TOML has no null: a value that is not given has no key.
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

/// A documentation up to its first code block, on one line, with links replaced by their text. Other brackets stay.
fn plain(words: &str) -> String {
    let words = words.split("```").next().unwrap_or_default();
    let words: Vec<&str> = words.split_whitespace().collect();
    let (words, mut plain) = (words.join(" "), String::new());
    let mut rest = &words[..];
    while let Some((before, after)) = rest.split_once('[') {
        plain += before;
        // Links have a target in parentheses, or are code in brackets.
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
fn links_in_documentation_become_text() {
    let words = "The [motion](crate::accuracy), by\n[`Scene::load`] in [0, 1]. [a\n\n```\nx\n```";
    assert_eq!(plain(words), "The motion, by `Scene::load` in [0, 1]. [a");
}

/// Adds to `found` the paths of the properties and definitions of a schema whose description is missing, marked
/// `(none)`, or refers to its neighbors: it begins with a word such as `Its` or `The same`. Alternatives (`anyOf`,
/// `oneOf`, `allOf`) are searched too.
fn dependent_descriptions(path: &str, value: &Value, found: &mut Vec<String>) {
    let starts =
        ["The same", "Of ", "On ", "Likewise", "Its ", "It ", "As many", "Those ", "In the same"];
    let Value::Object(object) = value else { return };
    let description = object.get("description").and_then(Value::as_str);
    // Editors show a description alone, without those of its neighbors.
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
fn schema_descriptions_do_not_refer_to_their_neighbors() {
    for of in SchemaKind::value_variants() {
        let mut found = Vec::new();
        dependent_descriptions("", generated(*of).as_value(), &mut found);
        assert!(found.is_empty(), "{}: {found:#?}", name(*of));
    }
}
