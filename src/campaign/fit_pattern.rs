//! Glob patterns of fit files in a campaign file, as `specimens/*/fit.toml` and `**/fit.toml`.
//!
//! Input is a pattern, absolute or relative to a folder, and that folder; output are the matching files in alphabetical
//! order, an empty list without any. `**` matches any number of folders; below it a link is followed unless it leads to
//! a folder on the way to it. Folders that cannot be read are skipped, and so are folders of devices and processes,
//! which hold no fits and may change while they are listed. A pattern that is not well formed, and a search of the
//! whole disk or of more than `MOST_ENTRIES` entries, are errors.

use crate::error::Error;
use glob::Pattern;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Most entries of folders that a pattern may visit: about a minute on a local disk.
const MOST_ENTRIES: usize = 1_000_000;
/// Folders of devices and processes, which are not searched.
const SYSTEM_FOLDERS: [&str; 3] = ["/dev", "/proc", "/sys"];
/// The component of a pattern that matches any number of folders, including none.
const ANY_DEPTH: &str = "**";

/// The files that match a pattern, which is relative to `folder` or absolute, each once in alphabetical order (of
/// paths, with `folder` in front of relative patterns); none if none matches. `key` is the key with the pattern, for
/// messages.
///
/// # Errors
///
/// A pattern that is not well formed, or that walks over the whole disk or over too many files.
pub(crate) fn matching_files(
    folder: &Path,
    pattern: &str,
    key: &str,
) -> Result<Vec<PathBuf>, Error> {
    let mut parts = Vec::new();
    for part in Path::new(pattern).components().map(|part| part.as_os_str().to_string_lossy()) {
        let parsed = Pattern::new(&part)
            .map_err(|error| Error::invalid(key, pattern, format!("a pattern: {error}")))?;
        parts.push(PatternPart { text: part.into_owned(), pattern: parsed });
    }
    let mut walk = Walk { files: BTreeSet::new(), entries: 0 };
    walk.visit(folder, &parts).map_err(|scope| {
        let found = format!("{pattern:?}, which would search {scope}");
        let allowed =
            "a pattern that begins with the folder of the fits, such as specimens/**/fit.toml";
        Error::invalid(key, found, allowed)
    })?;
    Ok(walk.files.into_iter().collect())
}

/// A component of a pattern between two separators: its text and its compiled form.
struct PatternPart {
    text: String,
    pattern: Pattern,
}

impl PatternPart {
    /// Whether the component has no wildcard, so that no folder needs to be listed.
    fn is_literal(&self) -> bool {
        !self.text.contains(['*', '?', '['])
    }
}

/// A recursive search that collects matching files. Its error is the scope of a search that is too large, as text.
struct Walk {
    files: BTreeSet<PathBuf>,
    /// Number of visited entries of folders.
    entries: usize,
}

impl Walk {
    /// Adds the files below the path `place` that match the remaining `parts` of a pattern. A part with wildcards is
    /// compared with the names of all entries of the folder; a literal part is appended to the path. A part `**`
    /// matches all folders below ([`visit_below`](Self::visit_below)). Without parts `place` itself is added, if it is
    /// a file. Error: the scope of a search that is too large, as text.
    fn visit(&mut self, place: &Path, parts: &[PatternPart]) -> Result<(), String> {
        let Some((part, rest)) = parts.split_first() else {
            if place.is_file() {
                self.files.insert(place.into());
            }
            return Ok(());
        };
        if part.text == ANY_DEPTH {
            // Several in a row have the meaning of one.
            let next = rest.iter().position(|part| part.text != ANY_DEPTH).unwrap_or(rest.len());
            return self.visit_below(place, &rest[next..]);
        }
        if part.is_literal() {
            return self.visit(&place.join(&part.text), rest);
        }
        for entry in self.entries(place)? {
            let name = entry.file_name();
            if part.pattern.matches(&name.to_string_lossy()) && !is_in_system(&entry.path()) {
                self.visit(&entry.path(), rest)?;
            }
        }
        Ok(())
    }

    /// Adds the files in the folder `top` and in all folders below it that match `parts`, or all files without parts. A
    /// link to a folder is followed unless it leads to a folder on the way to it. Nothing is added for a folder that
    /// does not exist. Error: `top` is the root of the disk, or there are too many entries.
    fn visit_below(&mut self, top: &Path, parts: &[PatternPart]) -> Result<(), String> {
        let Ok(real) = top.canonicalize() else { return Ok(()) };
        if real.parent().is_none() {
            return Err("the whole disk".into());
        }
        // Each folder with the real paths of the top and of all links on the way to it.
        let mut folders = vec![(top.to_path_buf(), vec![real])];
        while let Some((folder, passed)) = folders.pop() {
            if !parts.is_empty() {
                self.visit(&folder, parts)?;
            }
            // Links are followed only if they lead out of the folders on the way: no endless loop.
            for entry in self.entries(&folder)? {
                let path = entry.path();
                if entry.file_type().is_ok_and(|kind| kind.is_symlink()) && path.is_dir() {
                    let Ok(target) = path.canonicalize() else { continue };
                    if !is_system(&target) && !passed.iter().any(|p| p.starts_with(&target)) {
                        folders.push((path, [&passed[..], &[target]].concat()));
                    }
                } else if path.is_dir() {
                    if !is_in_system(&path) {
                        folders.push((path, passed.clone()));
                    }
                } else if parts.is_empty() && path.is_file() {
                    self.files.insert(path);
                }
            }
        }
        Ok(())
    }

    /// The entries of a folder; none of a folder that cannot be read. Each counts. Error: more than [`MOST_ENTRIES`]
    /// entries in total.
    fn entries(&mut self, folder: &Path) -> Result<Vec<std::fs::DirEntry>, String> {
        let mut entries = Vec::new();
        for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
            self.entries += 1;
            if self.entries > MOST_ENTRIES {
                return Err(format!("more than {MOST_ENTRIES} files"));
            }
            entries.push(entry);
        }
        Ok(entries)
    }
}

/// Whether a folder, or the target of a link to a folder, is one of [`SYSTEM_FOLDERS`].
fn is_in_system(folder: &Path) -> bool {
    is_system(folder) || folder.canonicalize().is_ok_and(|folder| is_system(&folder))
}

/// Whether a path is one of [`SYSTEM_FOLDERS`].
fn is_system(folder: &Path) -> bool {
    SYSTEM_FOLDERS.iter().any(|system| folder == Path::new(system))
}

#[cfg(test)]
mod tests {
    use crate::campaign::fit_pattern::matching_files;
    use std::fs::{create_dir_all, write};
    use std::path::PathBuf;

    #[test]
    fn patterns_match_files_in_alphabetical_order() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path().canonicalize().unwrap();
        for file in
            ["b/fit.toml", "a/fit.toml", "a/deep/fit.toml", "a/other.toml", "fit.toml", "[x].toml"]
        {
            create_dir_all(root.join(file).parent().unwrap()).unwrap();
            write(root.join(file), "").unwrap();
        }
        let found = |pattern: &str| -> Vec<String> {
            let files = matching_files(&root, pattern, "fits[0]").unwrap();
            let relative = |file: PathBuf| file.strip_prefix(&root).unwrap().display().to_string();
            files.into_iter().map(relative).collect()
        };
        assert_eq!(found("*/fit.toml"), ["a/fit.toml", "b/fit.toml"]);
        let all = ["a/deep/fit.toml", "a/fit.toml", "b/fit.toml", "fit.toml"];
        assert_eq!(found("**/fit.toml"), all);
        assert_eq!(found("**/**/fit.toml"), all);
        assert_eq!(found(&format!("{}/**/fit.toml", root.display())), all);
        assert_eq!(found("a/**").len(), 3);
        assert_eq!(found("a/../b/f*.toml"), ["a/../b/fit.toml"]);
        assert_eq!(found("[[]x].toml"), ["[x].toml"]);
        assert!(found("none/*.toml").is_empty());
        assert!(matching_files(&root, "a[/fit.toml", "fits[0]").is_err());
    }

    #[cfg(unix)]
    #[test]
    fn links_to_folders_are_followed_once() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path().canonicalize().unwrap();
        for name in ["a", "b"] {
            create_dir_all(root.join(name)).unwrap();
            write(root.join(name).join("fit.toml"), "").unwrap();
        }
        std::os::unix::fs::symlink("../b", root.join("a/l")).unwrap();
        std::os::unix::fs::symlink("../a", root.join("b/l")).unwrap();
        let found = matching_files(&root, "a/**/fit.toml", "fits[0]").unwrap();
        assert_eq!(found, ["a/fit.toml", "a/l/fit.toml"].map(|file| root.join(file)));
    }

    #[cfg(unix)]
    #[test]
    fn whole_disk_is_refused_and_system_folders_are_skipped() {
        let root = std::env::temp_dir();
        for pattern in ["/**/*.toml", "/usr/../**/fit.toml", "/./**"] {
            let error = matching_files(&root, pattern, "fits[0]").unwrap_err().to_string();
            assert!(error.contains("fits[0]") && error.contains("whole disk"), "{error}");
        }
        // Links in /proc lead to processes that may end at any moment.
        assert!(matching_files(&root, "/[dps][er]*[vcs]/**/fd/*", "fits[0]").unwrap().is_empty());
    }
}
