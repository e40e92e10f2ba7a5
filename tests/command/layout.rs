//! Layout of all printed results: at most 80 columns, warnings before details, no color outside a terminal unless a variable
//! forces it.

use crate::folder::{Folder, stderr, stdout};
use std::process::Output;

/// Lines that are longer than a terminal, without those that quote a file or name a path.
fn long_lines(text: &str) -> Vec<&str> {
    let is_long = |line: &&str| line.chars().count() > 80;
    // A path cannot be wrapped.
    let has_path = |line: &str| line.contains("./data/cantilever-tip.csv");
    text.lines().filter(is_long).filter(|line| !has_path(line)).collect()
}

/// A folder with the shipped data, and files whose results have warnings.
fn folder() -> Folder {
    let folder = Folder::new();
    let data = std::path::absolute("data").unwrap();
    std::os::unix::fs::symlink(data, folder.path("data")).unwrap();
    // The chosen step is far above the accuracy, and the density is in g/cm^3.
    let fit = |scene: &str, more: &str| {
        format!(
            "scene = \"data/{scene}\"\n[[observation]]\nfile = \"data/cantilever-tip.csv\"\npoint = \"tip\"\n\
             [[parameter]]\nname = \"youngs_modulus\"\n{more}"
        )
    };
    folder.write("coarse-fit.toml", &fit("cantilever-coarse-steps.toml", ""));
    let both = fit("cantilever.toml", "[[parameter]]\nname = \"density\"\n");
    folder.write("both-fit.toml", &both);
    let light = std::fs::read_to_string("data/cantilever.toml").unwrap();
    folder.write("light.toml", &light.replace("1273.52", "1.27352"));
    folder.write(
        "campaign.toml",
        "fits = [\"data/cantilever-fit.toml\"]\n[grid]\n\"material.density\" = [1200, 1300]\n",
    );
    folder
}

/// Commands with their output.
fn outputs(folder: &Folder) -> Vec<(String, Output)> {
    let known = ["--known", "radius=5e-5", "--known", "rod.shape.length=5e-4"];
    let commands: [&[&str]; 29] = [
        &["fit", "data/cantilever-fit.toml"],
        &[&["fit", "data/cantilever-fit.toml"][..], &known].concat(),
        &["fit", "data/droop-fit.toml"],
        &["fit", "data/outliers-fit.toml"],
        &["fit", "coarse-fit.toml"],
        &["fit", "both-fit.toml"],
        &["design", "data/cantilever-fit.toml", "--sigma", "1e-3", "--known", "radius=5e-5"],
        &["simulate", "data/cantilever.toml"],
        &["simulate", "light.toml"],
        &["static", "data/cantilever.toml"],
        &["static", "light.toml"],
        &["modes", "data/cantilever.toml"],
        &["modes", "light.toml"],
        &["check", "data/cantilever.toml"],
        &["bench", "--seconds", "0"],
        &["bench", "--published", "--seconds", "0"],
        &["inspect", "data/cantilever-tip.csv"],
        &["parameters", "data/cantilever.toml"],
        &["predict", "data/cantilever.toml", "--on", "data/cantilever-tip.csv"],
        &["campaign", "plan", "campaign.toml", "--out", "out"],
        &["campaign", "run", "out"],
        &["campaign", "status", "out"],
        &["campaign", "collect", "out", "--csv", "all.csv"],
        &["init", "cable", "--out", "cable"],
        &["simulate", "none.toml"],
        &["explain"],
        &["explain", "undetected-bias"],
        &["explain", "3"],
        &["fit", "data/cantilever-fit.toml", "--known", "nothing"],
    ];
    commands.iter().map(|words| (words.join(" "), folder.run(words))).collect()
}

#[test]
fn results_have_80_columns_with_warnings_before_details() {
    let folder = folder();
    let mut warned = 0;
    for (command, output) in outputs(&folder) {
        let shown = String::from_utf8(output.stdout.clone()).unwrap();
        let errors = String::from_utf8(output.stderr.clone()).unwrap();
        // The part of a fit file is printed as it is.
        let text = shown.split("Observation for a fit file:").next().unwrap();
        assert!(long_lines(text).is_empty(), "{command}:\n{:#?}", long_lines(text));
        assert!(!shown.contains('\x1b') && !errors.contains('\x1b'), "{command}:\n{shown}{errors}");
        // Errors that are read by other programs have one line each.
        assert!(!errors.contains("\n  "), "{command}:\n{errors}");
        let paragraphs: Vec<&str> = shown.split("\n\n").collect();
        let is_warning = |text: &&&str| text.starts_with("warning: ");
        let Some(first) = paragraphs.iter().position(|text| is_warning(&text)) else { continue };
        warned += 1;
        // The status and the result come before them, everything else behind.
        assert!(first <= 2, "{command}:\n{shown}");
        let behind = paragraphs[first + 1..].iter().filter(is_warning).count();
        assert_eq!(behind, 0, "{command}:\n{shown}");
        let codes = paragraphs[first].matches("warning: ").count();
        assert!(paragraphs[first].matches(']').count() >= codes, "{command}:\n{shown}");
    }
    assert!(warned >= 4, "{warned}");
}

#[test]
fn color_is_forced_by_a_variable_and_removed_by_no_color() {
    let folder = folder();
    let run = |variables: &[(&str, &str)]| {
        let mut command = folder.command(&["fit", "coarse-fit.toml"]);
        command.env_remove("NO_COLOR").env_remove("CLICOLOR_FORCE");
        command.envs(variables.iter().copied());
        let output = command.output().unwrap();
        stdout(&output) + &stderr(&output)
    };
    let forced = run(&[("CLICOLOR_FORCE", "1")]);
    assert!(forced.contains("\x1b[33mdiscretization too coarse"), "{forced}");
    assert!(forced.contains("\x1b[33mwarning:\x1b[0m "), "{forced}");
    for variables in [&[][..], &[("CLICOLOR_FORCE", "1"), ("NO_COLOR", "1")]] {
        assert!(!run(variables).contains('\x1b'), "{variables:?}");
    }
}
