//! The JSON schemas allow exactly the keys that the program reads, and describe the reports that it writes. A small validator
//! checks files and reports against them.

use crate::folder::{Folder, succeeds};
use rodfit::Scene;
use rodfit::fit::FitFile;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// The JSON schema that `rodfit schema` prints for a kind of file.
pub fn schema(of: &str) -> Value {
    let output = Folder::new().run(&["schema", of]);
    succeeds(&output);
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Violations of a JSON schema by a value, each with its place in the value. Only the keywords that occur in the program's
/// schemas are supported.
fn violations(value: &Value, schema: &Value, root: &Value, place: &str) -> Vec<String> {
    let Some(rules) = schema.as_object() else {
        let nothing = schema == &json!(false);
        return if nothing { vec![format!("{place}: not allowed")] } else { Vec::new() };
    };
    let all = |schemas: &Value| -> Vec<Vec<String>> {
        let each = |one: &Value| violations(value, one, root, place);
        schemas.as_array().unwrap().iter().map(each).collect()
    };
    let mut found = Vec::new();
    for (rule, said) in rules {
        let fine = match rule.as_str() {
            "$schema" | "title" | "description" | "default" | "definitions" | "format" => true,
            "$ref" => {
                let pointer = said.as_str().unwrap().strip_prefix('#').unwrap();
                found.extend(violations(value, root.pointer(pointer).unwrap(), root, place));
                true
            }
            "allOf" => {
                found.extend(all(said).concat());
                true
            }
            "anyOf" => all(said).iter().any(Vec::is_empty),
            "oneOf" => all(said).iter().filter(|one| one.is_empty()).count() == 1,
            "const" => value == said,
            "enum" => said.as_array().unwrap().contains(value),
            "type" => {
                let types = said.as_array().cloned().unwrap_or_else(|| vec![said.clone()]);
                types.iter().any(|name| match name.as_str().unwrap() {
                    "object" => value.is_object(),
                    "array" => value.is_array(),
                    "string" => value.is_string(),
                    "boolean" => value.is_boolean(),
                    "number" => value.is_number(),
                    "integer" => value.is_i64() || value.is_u64(),
                    "null" => value.is_null(),
                    name => panic!("{name}"),
                })
            }
            "required" => said.as_array().unwrap().iter().all(|key| {
                value.as_object().is_none_or(|object| object.contains_key(key.as_str().unwrap()))
            }),
            "minimum" => value.as_f64().is_none_or(|x| x >= said.as_f64().unwrap()),
            "maximum" => value.as_f64().is_none_or(|x| x <= said.as_f64().unwrap()),
            "minItems" => value.as_array().is_none_or(|a| a.len() as u64 >= said.as_u64().unwrap()),
            "maxItems" => value.as_array().is_none_or(|a| a.len() as u64 <= said.as_u64().unwrap()),
            "items" => {
                for (i, entry) in value.as_array().into_iter().flatten().enumerate() {
                    let own = said.as_array().map_or(said, |each| &each[i]);
                    found.extend(violations(entry, own, root, &format!("{place}[{i}]")));
                }
                true
            }
            "properties" => {
                for (key, inner) in value.as_object().into_iter().flatten() {
                    if let Some(own) = said.get(key) {
                        found.extend(violations(inner, own, root, &format!("{place}.{key}")));
                    }
                }
                true
            }
            "additionalProperties" => {
                let known = |key: &str| rules.get("properties").and_then(|p| p.get(key)).is_some();
                let object = value.as_object().into_iter().flatten();
                for (key, inner) in object.filter(|(key, _)| !known(key)) {
                    found.extend(violations(inner, said, root, &format!("{place}.{key}")));
                }
                true
            }
            rule => panic!("a rule that this test does not know: {rule}"),
        };
        if !fine {
            found.push(format!("{place}: {rule} {said}"));
        }
    }
    found
}

/// The same of a part of a file, from which keys may be missing.
pub fn violations_in_part(value: &Value, schema: &Value) -> Vec<String> {
    /// The schema without its lists of required keys, at all depths.
    fn without_required(schema: &Value) -> Value {
        match schema {
            Value::Object(rules) => {
                let rules =
                    rules.iter().filter(|(rule, said)| *rule != "required" || !said.is_array());
                rules.map(|(rule, said)| (rule.clone(), without_required(said))).collect()
            }
            Value::Array(list) => list.iter().map(without_required).collect(),
            other => other.clone(),
        }
    }
    let schema = without_required(schema);
    violations(value, &schema, &schema, "")
}

/// A file of TOML as the values of JSON.
pub fn read(text: &str) -> Value {
    serde_json::to_value(text.parse::<toml::Table>().unwrap()).unwrap()
}

/// All TOML files of a folder and of its subfolders, sorted.
fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut all: Vec<PathBuf> = entries
        .flat_map(|path| if path.is_dir() { files(&path) } else { vec![path] })
        .filter(|path| path.extension().is_some_and(|e| e == "toml"))
        .collect();
    all.sort();
    all
}

/// A copy for every table in a value, with a key that no table has; the keys of `markers` are names.
fn with_unknown_keys(value: &Value) -> Vec<Value> {
    let mut all = Vec::new();
    let inner = |at: &dyn Fn(Value) -> Value, inner: &Value| -> Vec<Value> {
        with_unknown_keys(inner).into_iter().map(at).collect()
    };
    if let Value::Object(table) = value {
        let mut changed = table.clone();
        changed.insert("surely_not".into(), json!(1));
        all.push(Value::Object(changed));
        for (key, entry) in table {
            let put = |new| {
                let mut copy = table.clone();
                copy.insert(key.clone(), new);
                Value::Object(copy)
            };
            if key != "markers" {
                all.extend(inner(&put, entry));
            }
        }
    }
    if let Value::Array(list) = value {
        for (i, entry) in list.iter().enumerate() {
            let put = |new| {
                let mut copy = list.clone();
                copy[i] = new;
                Value::Array(copy)
            };
            all.extend(inner(&put, entry));
        }
    }
    all
}

#[test]
fn schemas_allow_exactly_the_read_keys() {
    let (scene, fit) = (schema("scene"), schema("fit"));
    let mut counts = [0; 3];
    for path in files(Path::new("data")) {
        let value = read(&std::fs::read_to_string(&path).unwrap());
        if value.get("fits").is_some() {
            let campaign = schema("campaign");
            assert_eq!(violations(&value, &campaign, &campaign, ""), [""; 0], "{}", path.display());
            continue;
        }
        if value.get("rods").is_some() {
            let structure = schema("structure");
            assert_eq!(
                violations(&value, &structure, &structure, ""),
                [""; 0],
                "{}",
                path.display()
            );
            continue;
        }
        let is_fit = value.get("parameter").is_some();
        let schema = if is_fit { &fit } else { &scene };
        counts[usize::from(is_fit)] += 1;
        assert_eq!(violations(&value, schema, schema, ""), [""; 0], "{}", path.display());
        let folder = path.parent().unwrap();
        for changed in with_unknown_keys(&value) {
            counts[2] += 1;
            let text = toml::to_string(&changed).unwrap();
            assert_ne!(violations(&changed, schema, schema, ""), [""; 0], "{text}");
            let error = match is_fit {
                true => FitFile::from_toml(&text, folder).err(),
                false => Scene::from_toml(&text, folder).err(),
            };
            assert!(error.is_some(), "{text}");
        }
    }
    assert!(counts[0] > 5 && counts[1] > 5 && counts[2] > 100, "{counts:?}");
    // Words for editors, without what only the documentation of the code can follow.
    let youngs = &scene["definitions"]["Material"]["properties"]["youngs_modulus"];
    assert!(youngs["description"].as_str().unwrap().contains("Pa"), "{youngs}");
    for schema in [&scene, &fit] {
        let text = schema.to_string();
        assert!(!text.contains("](") && !text.contains("```") && !text.contains("\"null\""));
    }
    // Values of another kind, and keys that are missing.
    let value = read(crate::folder::SCENE);
    for (pointer, wrong) in [
        ("/rod/section/kind", json!("round")),
        ("/rod/segments", json!("many")),
        ("/loads/gravity", json!([0.0, -9.8])),
        ("/material", json!({ "density": 1000.0 })),
        ("/time/step", json!([1])),
    ] {
        let mut changed = value.clone();
        *changed.pointer_mut(pointer).unwrap() = wrong;
        assert_ne!(violations(&changed, &scene, &scene, ""), [""; 0], "{pointer}");
    }
}

#[test]
fn schemas_describe_written_reports() {
    let folder = Folder::new();
    succeeds(&folder.run(&["fit", "fit.toml", "--report", "page"]));
    succeeds(&folder.run(&["simulate", "scene.toml", "--json", "run.json"]));
    succeeds(&folder.run(&["predict", "scene.toml", "--on", "tip.csv", "--json", "predict.json"]));
    let mut all = vec![("result", "page/fit.json"), ("simulation", "run.json")];
    all.push(("predict", "predict.json"));
    for (of, input, file) in [
        ("static", "scene.toml", "static.json"),
        ("modes", "scene.toml", "modes.json"),
        ("study", "scene.toml", "study.json"),
        ("design", "fit.toml", "design.json"),
    ] {
        let mut arguments = vec![of, input, "--json", file];
        if of == "design" {
            arguments.extend(["--sigma", "1e-3"]);
        }
        succeeds(&folder.run(&arguments));
        all.push((of, file));
    }
    for (of, file) in all {
        let (schema, value) = (schema(of), folder.json(file));
        assert_eq!(violations(&value, &schema, &schema, ""), [""; 0], "{of}");
        let mut changed = value.clone();
        changed[if of == "study" { "rows" } else { "warnings" }] = json!(1);
        assert_ne!(violations(&changed, &schema, &schema, ""), [""; 0], "{of}");
    }
}
