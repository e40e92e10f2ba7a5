//! Modules of `src` import names in one direction, and no two files import each other in a circle.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Modules in the order of imports: each may import from those before it.
const ORDER: [&str; 20] = [
    "code",
    "error",
    "summary",
    "numerics",
    "input",
    "scene",
    "energy",
    "rod",
    "problem",
    "statics",
    "vibration",
    "dynamics",
    "structure",
    "accuracy",
    "fit",
    "check",
    "study",
    "export",
    "campaign",
    "page",
];

/// Files by their modules, without the command, comments and unit tests.
fn sources(folder: &Path, module: &str, found: &mut BTreeMap<String, String>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_stem().unwrap().to_str().unwrap();
        let own = match (module, name) {
            (_, "mod") => module.to_string(),
            ("", _) => name.to_string(),
            _ => format!("{module}::{name}"),
        };
        if path.is_dir() {
            sources(&path, &own, found);
        } else if name != "tests" && path.extension().is_some_and(|e| e == "rs") {
            let text = std::fs::read_to_string(&path).unwrap();
            let code = text.split("#[cfg(test)]").next().unwrap();
            let lines = code.lines().map(|line| line.split("//").next().unwrap());
            found.insert(own, lines.collect::<Vec<_>>().join("\n"));
        }
    }
}

/// The modules that each module imports names from, as files.
fn imports() -> BTreeMap<String, BTreeSet<String>> {
    let mut files = BTreeMap::new();
    sources(Path::new("src"), "", &mut files);
    files.retain(|module, _| {
        !["lib", "main"].contains(&&**module) && !module.starts_with("command")
    });
    let of = |(module, code): (&String, &String)| {
        assert!(!code.contains("super::"), "{module}: names are imported from their owner");
        let uses = code.split("crate::").skip(1).filter_map(|after| {
            let end = after.find(|c: char| !(c.is_alphanumeric() || c == '_' || c == ':'));
            let path: Vec<&str> = after[..end.unwrap_or(after.len())].split("::").collect();
            (1..=path.len()).rev().map(|n| path[..n].join("::")).find(|m| files.contains_key(m))
        });
        (module.clone(), uses.filter(|other| other != module).collect())
    };
    files.iter().map(of).collect()
}

/// Position of the top-level module of a module in the order of imports.
fn position(module: &str) -> usize {
    let name = module.split("::").next().unwrap();
    let position = ORDER.iter().position(|other| *other == name);
    position.unwrap_or_else(|| panic!("{name} is not in the order of imports"))
}

#[test]
fn modules_import_in_one_direction() {
    let imports = imports();
    // A guard against a search that finds no imports.
    assert!(imports.len() > 100 && imports["dynamics::trajectory"].contains("problem"));
    for (module, others) in &imports {
        for other in others {
            assert!(position(other) <= position(module), "{module} imports from {other}");
        }
    }
}

#[test]
fn files_do_not_import_each_other_in_a_circle() {
    let mut left = imports();
    // Remove files without imports from the remaining ones, until only circles and the files that import from them remain.
    while let Some(module) =
        left.iter().find(|(_, others)| others.is_empty()).map(|(module, _)| module.clone())
    {
        left.remove(&module);
        left.values_mut().for_each(|others| others.retain(|other| *other != module));
    }
    // Remove files that no remaining file imports: they only import from a circle.
    while let Some(module) =
        left.keys().find(|m| !left.values().any(|others| others.contains(*m))).cloned()
    {
        left.remove(&module);
    }
    assert!(left.is_empty(), "files that import each other in a circle: {left:#?}");
}
