//! Names for several fits of one command, and the paths of their outputs.
//!
//! A fit is named after its file, with as many parent folders in front as distinguish it from the others (`a-fit`,
//! `b-fit` for `a/fit.toml`, `b/fit.toml`); all names differ. The name is appended to the stem of each output file
//! (`--save`, `--json`), and is the folder of its page in that of `--report`. Files of `--save` get the extension
//! `toml`. A single fit has no name, and its paths stay. A fit file that is given twice, and several fits on standard
//! output, are errors. [`fit_names`] returns the names, [`output_path`] the path of the output of an option, and
//! [`path_with_name`] a path with a name appended and another extension.

use rodfit::Error;
use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};

/// The name of each fit file: its stem, preceded by as many parent folders (joined by `-`) as distinguish it from the
/// names of all others. Of equal names those with the fewest folders get one more. `None` for a single fit. Errors: a
/// file that is given twice, and equal names of files without further folders.
pub(super) fn fit_names(fits: &[PathBuf]) -> Result<Vec<Option<String>>, Error> {
    if fits.len() < 2 {
        return Ok(vec![None; fits.len()]);
    }
    let parts: Vec<Vec<String>> = fits.iter().map(|fit| name_parts(fit)).collect();
    if let Some(twice) = (1..fits.len()).find(|i| parts[..*i].contains(&parts[*i])) {
        let found = format!("{} twice", fits[twice].display());
        return Err(Error::invalid("fit", found, "each fit file once"));
    }
    // Numbers of parts of the names, from the stem on; each round adds one to some of them.
    let mut depths = vec![1; fits.len()];
    loop {
        let name = |i: usize| {
            let parts: Vec<&str> =
                parts[i][..depths[i]].iter().rev().map(|part| &part[..]).collect();
            parts.join("-")
        };
        let mut by_name: BTreeMap<String, Vec<usize>> = BTreeMap::new();
        (0..fits.len()).for_each(|i| by_name.entry(name(i)).or_default().push(i));
        let Some((equal, same)) = by_name.iter().find(|(_, same)| same.len() > 1) else {
            return Ok((0..fits.len()).map(|i| Some(name(i))).collect());
        };
        let longer = same.iter().copied().filter(|i| depths[*i] < parts[*i].len());
        let Some(fewest) = longer.clone().map(|i| depths[i]).min() else {
            let found = format!("several fits with the name {equal}");
            return Err(Error::invalid("fit", found, "files whose names with folders differ"));
        };
        let grown: Vec<usize> = longer.filter(|i| depths[*i] == fewest).collect();
        grown.into_iter().for_each(|i| depths[i] += 1);
    }
}

/// The stem of a fit file, followed by the names of its folders, the innermost first.
fn name_parts(fit: &Path) -> Vec<String> {
    let whole = std::path::absolute(fit).unwrap_or_else(|_| fit.into());
    let stem = whole.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let folders = whole.parent().into_iter().flat_map(Path::components).rev();
    let folders = folders.filter_map(|part| match part {
        Component::Normal(name) => Some(name.to_string_lossy().into_owned()),
        _ => None,
    });
    std::iter::once(stem).chain(folders).collect()
}

/// A path with a hyphen and a name appended to its stem: `fitted-NAME.toml` for `fitted.toml`. Characters of `name`
/// that file systems reject become `_`; `extension` is without its dot and replaces that of the path.
pub(super) fn path_with_name(path: &Path, name: &str, extension: &str) -> PathBuf {
    // Characters that file systems reject.
    let plain = |c: char| if c.is_control() || r#"/\:*?"<>|"#.contains(c) { '_' } else { c };
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let name: String = name.chars().map(plain).collect();
    path.with_file_name(format!("{stem}-{name}.{extension}"))
}

/// The path of the file that an `option` names, with the `name` of the fit appended if it is one of several. Unchanged
/// for a single fit, `None` without a path. Several fits cannot share standard output (`-`): an error. Files of
/// `--save` get the extension `toml`.
pub(super) fn output_path(
    path: Option<&Path>,
    name: Option<&str>,
    option: &str,
) -> Result<Option<PathBuf>, Error> {
    let (Some(path), Some(name)) = (path, name) else { return Ok(path.map(Path::to_path_buf)) };
    if path == Path::new("-") {
        let found = format!("- with several fits, such as {name}");
        let allowed = "a file; the names of the fits are appended to its name";
        return Err(Error::invalid(option, found, allowed));
    }
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    let extension = if option == "--save" { "toml" } else { &extension };
    Ok(Some(path_with_name(path, name, extension)))
}
