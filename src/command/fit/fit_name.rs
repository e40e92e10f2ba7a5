//! Names of several fits, which are appended to the names of their outputs.

use rodfit::Error;
use std::path::{Component, Path, PathBuf};

/// The name of each of several fits: that of its file, with as many of its folders as make it unique. A single fit has
/// no name.
pub(super) fn fit_names(fits: &[PathBuf]) -> Result<Vec<Option<String>>, Error> {
    if fits.len() < 2 {
        return Ok(vec![None; fits.len()]);
    }
    let parts: Vec<Vec<String>> = fits.iter().map(|fit| name_parts(fit)).collect();
    let name = |i: usize, depth: usize| {
        let parts: Vec<&str> = parts[i].iter().take(depth).rev().map(|part| &part[..]).collect();
        parts.join("-")
    };
    let unique_name = |i: usize| {
        let is_unique =
            |depth: &usize| (0..fits.len()).all(|j| j == i || name(j, *depth) != name(i, *depth));
        // The smallest number of folders that makes the name unique.
        let depth = (1..=parts[i].len()).find(is_unique).ok_or_else(|| {
            let found = format!("{} twice", fits[i].display());
            Error::invalid("fit", found, "each fit file once")
        })?;
        Ok(Some(name(i, depth)))
    };
    (0..fits.len()).map(unique_name).collect()
}

/// The name of a fit file without its extension, and the names of its folders, the innermost first.
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

/// The path of an output that belongs to one of several fits or experiments: `fitted-NAME.toml` for `fitted.toml`.
pub(super) fn path_with_name(path: &Path, name: &str, extension: &str) -> PathBuf {
    // Characters that file systems reject.
    let plain = |c: char| if c.is_control() || r#"/\:*?"<>|"#.contains(c) { '_' } else { c };
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let name: String = name.chars().map(plain).collect();
    path.with_file_name(format!("{stem}-{name}.{extension}"))
}

/// The path of an option's output for the fit with a name, if it is one of several. Several fits cannot share standard
/// output.
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
