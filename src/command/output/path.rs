//! Paths of outputs: folders, links, and the identity of files with several names.
//!
//! Input and output are paths; the files need not exist. [`identity`] maps all names of a file (relative, links, case
//! on Windows and macOS) to one path, the canonical path of its existing part with the missing rest. [`resolved`]
//! returns the canonical path of an existing file, or the target of a link (up to `MAX_LINKS` links) that does not
//! exist; other missing paths are unchanged. [`interrupted_name`] is the name of an interrupted result,
//! `fit.interrupted.json` for `fit.json`. [`is_device`], [`ends_like_folder`] and [`folder_of`] classify a path and
//! return its folder.

use std::ffi::OsString;
use std::fs::metadata;
use std::path::{Path, PathBuf};

/// Symbolic links that are followed one after another, as operating systems do.
const MAX_LINKS: usize = 40;

/// Whether a path exists and is neither a file nor a folder, such as `/dev/null` or a pipe.
pub(super) fn is_device(path: &Path) -> bool {
    metadata(path).is_ok_and(|found| !found.is_file() && !found.is_dir())
}

/// The canonical absolute path of an existing file, with links followed. For a link whose target does not exist it is
/// the path of that target, after at most [`MAX_LINKS`] links. Any other missing path is returned unchanged.
pub(super) fn resolved(path: &Path) -> PathBuf {
    if let Ok(found) = path.canonicalize() {
        return found;
    }
    let mut path = path.to_path_buf();
    // A link to a missing file has no canonical path: links are followed one by one.
    for _ in 0..MAX_LINKS {
        match std::fs::read_link(&path) {
            Ok(target) => path = folder_of(&path).join(target),
            Err(_) => break,
        }
    }
    path
}

/// Whether a path ends with a separator, `/.` or `/..`, or is `..`, which only folders do.
pub(super) fn ends_like_folder(path: &Path) -> bool {
    let bytes = path.as_os_str().as_encoded_bytes();
    let is_separator = |byte: &u8| std::path::is_separator(char::from(*byte));
    let ends = [&b"/."[..], b"/.."].iter().any(|end| bytes.ends_with(end));
    bytes.last().is_some_and(is_separator) || ends || bytes == b".."
}

/// The parent folder of a path; `.` for a bare name, the path itself for a root.
pub(super) fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if folder.as_os_str().is_empty() => Path::new("."),
        Some(folder) => folder,
        None => path,
    }
}

/// A path that all names of a file share, whether the file exists or not: the canonical path of its existing part with
/// the missing rest. In lower case on Windows and macOS.
pub(super) fn identity(path: &Path) -> PathBuf {
    // The part that exists is canonical; the missing rest is appended.
    let mut missing = Vec::new();
    let mut existing = path;
    let found = loop {
        match (existing.canonicalize(), existing.file_name()) {
            (Ok(found), _) => break found,
            (Err(_), Some(name)) => {
                missing.push(name);
                existing = folder_of(existing);
            }
            _ => break existing.into(),
        }
    };
    let whole = missing.iter().rev().fold(found, |path, name| path.join(name));
    match cfg!(any(windows, target_os = "macos")) {
        // Their file systems ignore the case of letters.
        true => whole.to_string_lossy().to_lowercase().into(),
        false => whole,
    }
}

/// The name of an interrupted result beside an older one: `fit.interrupted.json` for `fit.json`.
pub(super) fn interrupted_name(path: &Path) -> PathBuf {
    let mut name: OsString = path.file_stem().unwrap_or_default().into();
    name.push(".interrupted");
    if let Some(extension) = path.extension() {
        name.push(".");
        name.push(extension);
    }
    path.with_file_name(name)
}
