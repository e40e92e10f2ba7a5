//! Consistency of the documents with the program: TOML snippets have keys of the schemas, shown commands run with the shown
//! output, links have targets, and the summary of the book lists every page.

use crate::folder::{Folder, stderr, stdout};
use crate::schema::{read, schema, violations_in_part};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// All Markdown files below a folder.
fn pages(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let files = entries.flat_map(|path| if path.is_dir() { pages(&path) } else { vec![path] });
    files.filter(|path| path.extension().is_some_and(|extension| extension == "md")).collect()
}

/// The README and all pages, with their texts.
fn documents() -> Vec<(PathBuf, String)> {
    let mut all = pages(Path::new("docs"));
    all.extend(["README.md".into(), "CONTRIBUTING.md".into(), "data/README.md".into()]);
    all.sort();
    all.into_iter().map(|path| (path.clone(), std::fs::read_to_string(path).unwrap())).collect()
}

/// The anchors of the headings of a page, as GitHub and mdBook form them.
fn anchors(text: &str) -> Vec<String> {
    let prose = text.split("```").step_by(2);
    let headings = prose.flat_map(str::lines).filter(|line| line.starts_with('#'));
    let kept = |c: &char| c.is_alphanumeric() || " -_".contains(*c);
    headings
        .map(|line| line.trim_start_matches('#').trim().to_lowercase())
        .map(|title| title.chars().filter(kept).collect::<String>().replace(' ', "-"))
        .collect()
}

/// Contents of all code blocks of this language in a Markdown text.
fn blocks<'a>(text: &'a str, language: &str) -> Vec<&'a str> {
    let parts = text.split(&format!("```{language}\n")).skip(1).collect::<Vec<_>>();
    parts.into_iter().map(|part| part.split("```").next().unwrap()).collect()
}

#[test]
fn toml_snippets_have_only_keys_of_the_schemas() {
    let all = ["fit", "campaign", "scene", "structure"].map(schema);
    let mut count = 0;
    for (path, text) in documents() {
        for block in blocks(&text, "toml") {
            let value = read(block);
            let keys = value.as_object().unwrap();
            let knows =
                |schema: &&Value| keys.keys().all(|key| schema["properties"].get(key).is_some());
            let schema = all.iter().find(knows).unwrap_or(&all[2]);
            let found = violations_in_part(&value, schema);
            assert!(found.is_empty(), "{}: {found:?} in\n{block}", path.display());
            count += 1;
        }
    }
    // A guard against a search that finds no snippets.
    assert!(count > 15, "{count}");
}

#[test]
fn shown_commands_run() {
    let mut count = 0;
    for (path, text) in documents() {
        // A page is read from its top: a command may need what those before it have written.
        let folder = Folder::new();
        let mut printed = String::new();
        let data = std::path::absolute("data").unwrap();
        std::os::unix::fs::symlink(data, folder.path("data")).unwrap();
        for line in blocks(&text, "sh").into_iter().flat_map(str::lines) {
            let line = line.split(" #").next().unwrap().split(" > ").next().unwrap().trim();
            let rodfit = ["rodfit ", "cargo run --release -- "];
            let Some(words) = rodfit.into_iter().find_map(|start| line.strip_prefix(start)) else {
                continue;
            };
            let words: Vec<&str> = words.split_whitespace().collect();
            // Recordings of others are fetched first, and looked at for a while.
            if words.iter().any(|word| word.starts_with("data/cables")) {
                continue;
            }
            let output = folder.run(&words);
            let code = output.status.code();
            assert_eq!(code, Some(0), "{}: {line}: {}", path.display(), stderr(&output));
            printed += &without_numbers(&stdout(&output));
            count += 1;
        }
        let page = path.to_str().unwrap();
        if page.starts_with("docs/tutorials") || page.ends_with("get-started.md") {
            for shown in blocks(&text, "text").into_iter().flat_map(str::lines) {
                let is_output = shown.starts_with("  ") || shown.contains(": converged");
                let found = !is_output || printed.contains(&without_numbers(shown));
                assert!(found, "{page}: no command prints {shown:?}");
            }
        }
    }
    assert!(count >= 4, "{count}");
}

/// Output that does not depend on the rounding of the machine.
fn without_numbers(text: &str) -> String {
    text.chars().filter(|c| !c.is_ascii_digit() && !"+-.".contains(*c)).collect()
}

/// The names of the subcommands that a help text lists.
fn listed_commands(help: &str) -> Vec<String> {
    let list = help.split("Commands:\n").nth(1).unwrap_or_default();
    let lines = list.lines().take_while(|line| line.starts_with("  "));
    let names = lines.filter_map(|line| line.split_whitespace().next()).map(String::from);
    names.filter(|name| name != "help").collect()
}

#[test]
fn help_of_every_command_has_an_example_that_runs() {
    let folder = Folder::new();
    let data = std::path::absolute("data").unwrap();
    std::os::unix::fs::symlink(data, folder.path("data")).unwrap();
    let mut commands: Vec<Vec<String>> = listed_commands(&stdout(&folder.run(&["help"])))
        .into_iter()
        .map(|name| vec![name])
        .collect();
    let campaign = listed_commands(&stdout(&folder.run(&["campaign", "help"])));
    commands.extend(campaign.into_iter().map(|name| vec!["campaign".into(), name]));
    assert!(commands.len() > 15, "{commands:?}");
    for command in commands {
        let words: Vec<&str> = command.iter().map(String::as_str).chain(["--help"]).collect();
        let help = stdout(&folder.run(&words));
        let example = help.split("Example: rodfit ").nth(1).unwrap_or_else(|| panic!("{words:?}"));
        let example: Vec<&str> = example.lines().next().unwrap().split_whitespace().collect();
        assert!(example.starts_with(&words[..command.len()]), "{words:?}: {example:?}");
        // These measure times for many seconds.
        if ["bench", "study"].contains(&&command[0][..]) {
            continue;
        }
        let output = folder.run(&example);
        assert_eq!(output.status.code(), Some(0), "{example:?}: {}", stderr(&output));
    }
}

/// The outputs in the README are those of the program. Only numbers may differ, by the rounding of other machines.
#[test]
fn output_in_the_readme_is_that_of_the_program() {
    let text = std::fs::read_to_string("README.md").unwrap();
    let shown = blocks(&text, "text")[0];
    let folder = Folder::new();
    let data = std::path::absolute("data").unwrap();
    std::os::unix::fs::symlink(data, folder.path("data")).unwrap();
    let printed = stdout(&folder.run(&["fit", "data/cantilever-fit.toml"]));
    assert_eq!(without_numbers(shown.trim()), without_numbers(printed.trim()));
}

#[test]
fn relative_links_have_a_target() {
    let mut count = 0;
    for (path, text) in documents() {
        let folder = path.parent().unwrap();
        let prose: String = text.split("```").step_by(2).collect();
        for after in prose.split("](").skip(1) {
            let link = after.split(')').next().unwrap();
            let (file, anchor) = link.split_once('#').unwrap_or((link, ""));
            if link.contains("://") {
                continue;
            }
            let target = if file.is_empty() { path.clone() } else { folder.join(file) };
            assert!(target.exists(), "{}: {link}", path.display());
            if !anchor.is_empty() {
                let page = std::fs::read_to_string(&target).unwrap();
                assert!(anchors(&page).iter().any(|a| a == anchor), "{}: {link}", path.display());
            }
            count += 1;
        }
    }
    // A guard against a search that finds no links.
    assert!(count > 100, "{count}");
}

#[test]
fn summary_lists_every_page() {
    let summary = std::fs::read_to_string("docs/SUMMARY.md").unwrap();
    for path in pages(Path::new("docs")) {
        let name = path.strip_prefix("docs").unwrap().to_str().unwrap();
        assert!(name == "SUMMARY.md" || summary.contains(&format!("({name})")), "{name}");
    }
    assert!(Path::new("docs/book.toml").exists());
}

#[test]
fn pages_have_at_most_250_lines() {
    for path in pages(Path::new("docs")) {
        let lines = std::fs::read_to_string(&path).unwrap().lines().count();
        // The limit of CONTRIBUTING.
        assert!(lines <= 250, "{}: {lines} lines", path.display());
    }
}
