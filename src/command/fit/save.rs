//! `rodfit fit --save`: the scene files (TOML) with fitted values.
//!
//! Experiments with the same fitted parameters, whose scenes differ in their recordings only, share one file. A
//! single group of several experiments, or of one without a name, is written to the path of the option. Otherwise the
//! name of the experiment (groups of one) or of the scene file is appended to that path; several groups on standard
//! output are an error. Paths of data files become absolute. Mesh, step and scheme that the program chose are not
//! written.

use crate::command::fit::fit_name::path_with_name;
use crate::command::output::{Output, Outputs};
use rodfit::fit::FitFile;
use rodfit::{Error, Parameter, Problem, Unknown};
use std::path::Path;

/// A scene file to write: the experiment whose fitted values it gets, and its destination.
pub(super) struct SavedScene {
    /// Index of the experiment with the scene: the first of those that differ in their recordings only.
    pub experiment: usize,
    pub output: Option<Output>,
}

/// The scene of a problem with other `values` of its parameters, as TOML (UTF-8 bytes) with absolute paths of its data
/// files. Mesh and step that the program chose are left open again. Errors: values that the scene does not allow, and a
/// path that cannot be made absolute.
pub(super) fn scene_text(
    problem: &Problem,
    values: Vec<(Parameter, f64)>,
) -> Result<Vec<u8>, Error> {
    let mut scene = problem.with(values)?.scene().reopened();
    scene.make_paths_absolute()?;
    Ok(scene.to_toml()?.into_bytes())
}

/// Adds an output for every group of experiments with the same fitted scene to `outputs`, and returns the list. A
/// single group of several, or of an experiment without a name, has `path` itself. To others the experiment's name
/// (groups of one) or the scene's is appended. Several groups on standard output (`-`) are an error.
pub(super) fn add_saved_scenes(
    path: &Path,
    file: &FitFile,
    outputs: &mut Outputs,
) -> Result<Vec<SavedScene>, Error> {
    let groups = scene_groups(file);
    if let [_, second, ..] = &groups[..]
        && path == Path::new("-")
    {
        let second = &file.experiments[second[0]].name;
        let found = format!("- with {} experiments, such as {second}", groups.len());
        let allowed = "a file; the names of the experiments are appended to its name";
        return Err(Error::invalid("--save", found, allowed));
    }
    let add = |group: &Vec<usize>| {
        // Names: none for a single group of several experiments, the experiment's for a group of one, else the scene's.
        let name = match (group.len(), groups.len()) {
            (2.., 1) => String::new(),
            (1, _) => file.experiments[group[0]].name.clone(),
            _ => group_name(file, group, &groups),
        };
        let output = match name.is_empty() {
            true => outputs.add("--save", Some(path)),
            false => {
                let option = format!("--save of experiment {name:?}");
                outputs.add(&option, Some(&path_with_name(path, &name, "toml")))
            }
        };
        SavedScene { experiment: group[0], output }
    };
    Ok(groups.iter().map(add).collect())
}

/// Groups of indices of experiments that share a fitted scene: scenes that differ in the recording only, and the same
/// parameters. In the order of their first experiments.
fn scene_groups(file: &FitFile) -> Vec<Vec<usize>> {
    let all = &file.experiments;
    let share_scene = |i: usize, j: usize| {
        let is_parameter_of = |u: &Unknown, k: usize| {
            u.experiments.is_empty() || u.experiments.contains(&all[k].name)
        };
        // A parameter of some experiments only has another value in the scenes of the others.
        let share_parameters =
            file.unknowns.iter().all(|u| is_parameter_of(u, i) == is_parameter_of(u, j));
        let [a, b] = [i, j].map(|k| all[k].problem.scene());
        share_parameters && a.differs_in_recording_only(b)
    };
    let mut groups: Vec<Vec<usize>> = Vec::new();
    // The first experiment of a group represents it.
    for i in 0..all.len() {
        match groups.iter_mut().find(|group| share_scene(group[0], i)) {
            Some(group) => group.push(i),
            None => groups.push(vec![i]),
        }
    }
    groups
}

/// The stem of the scene file of a `group`; the name of its first experiment if another of the `groups` has the same
/// stem or the scene has no file.
fn group_name(file: &FitFile, group: &[usize], groups: &[Vec<usize>]) -> String {
    let stem = |group: &[usize]| {
        let path = file.experiments[group[0]].problem.scene().path.clone()?;
        Some(path.file_stem()?.to_string_lossy().into_owned())
    };
    let same = groups.iter().filter(|other| stem(other) == stem(group)).count();
    let first = file.experiments[group[0]].name.clone();
    stem(group).filter(|_| same == 1).unwrap_or(first)
}
