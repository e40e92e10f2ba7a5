//! Files that are replaced only when complete: written under a temporary name, `NAME.XXXXXX.part`, and renamed at the
//! end.
//!
//! [`PartFile::beside`] creates and locks the temporary file, in the folder of the result and with its name. `persist`
//! renames it to the result, `keep` to `NAME.XXXXXX.kept`, and dropping it removes it. It is locked while it is open.
//! `XXXXXX` are random letters and digits. A temporary file without a lock belongs to a process that was killed; the
//! next process that writes the same name removes it. Where the file system has no locks, such files stay. Names longer
//! than `LONGEST_NAME` bytes are replaced by `rodfit`. [`folder_of`] returns the folder of a path.

use std::ffi::{OsStr, OsString};
use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// Extension of temporary names.
const SUFFIX: &str = ".part";
/// Extension of an incomplete file that is kept.
const KEPT_SUFFIX: &str = "kept";
/// Number of random letters and digits in a temporary name.
const RANDOM_LENGTH: usize = 6;
/// Longest name, bytes, at the beginning of a temporary name; longer ones are replaced. File systems allow 255 bytes in
/// total.
const LONGEST_NAME: usize = 200;
/// Largest number of attempts to create a file that another process removes before it is locked.
const MAX_ATTEMPTS: usize = 100;

/// A temporary file that is being written; it is removed when dropped.
#[derive(Debug)]
pub struct PartFile(NamedTempFile);

impl PartFile {
    /// Creates a locked temporary file in the existing folder of `path`, named after it, or `rodfit` if the name is
    /// longer than `LONGEST_NAME`. Removes temporary files of the same name that terminated processes left.
    ///
    /// # Errors
    ///
    /// A folder in which no file can be created, or in which another program removes new files repeatedly.
    pub fn beside(path: &Path) -> io::Result<Self> {
        let folder = folder_of(path);
        let mut prefix: OsString = path.file_name().unwrap_or_default().into();
        if prefix.len() > LONGEST_NAME {
            prefix = "rodfit".into();
        }
        prefix.push(".");
        let file = create_locked(folder, &prefix)?;
        remove_abandoned(folder, &prefix);
        Ok(Self(file))
    }

    /// Path of the temporary file.
    pub fn path(&self) -> &Path {
        self.0.path()
    }

    /// The open temporary file.
    pub fn file(&self) -> &File {
        self.0.as_file()
    }

    /// Renames the complete file to `path`; an existing file there is replaced. It is no temporary file any more.
    ///
    /// # Errors
    ///
    /// The reason why it cannot be renamed, and the file.
    pub fn persist(self, path: &Path) -> Result<(), (io::Error, Self)> {
        self.0.persist(path).map(drop).map_err(|failed| (failed.error, Self(failed.file)))
    }

    /// Keeps an incomplete file under a name that no other run removes, `NAME.XXXXXX.kept`, and returns its path. If it
    /// cannot be renamed, it keeps its temporary name.
    ///
    /// # Errors
    ///
    /// A file that does not exist any more.
    pub fn keep(self) -> io::Result<PathBuf> {
        let (_, path) = self.0.keep().map_err(|failed| failed.error)?;
        let kept = path.with_extension(KEPT_SUFFIX);
        Ok(std::fs::rename(&path, &kept).map_or(path, |()| kept))
    }
}

impl Write for PartFile {
    /// Writes bytes to the temporary file, and returns how many of them were written.
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.write(bytes)
    }
    /// Flushes the temporary file, as `File::flush`.
    fn flush(&mut self) -> io::Result<()> {
        self.0.flush()
    }
}

/// Creates a temporary file in `folder` whose name is `prefix`, random characters and [`SUFFIX`], and locks it for this
/// process. Where the file system has no locks, it stays unlocked. An error if no file can be created, or if another
/// program removes [`MAX_ATTEMPTS`] of them before they are locked.
fn create_locked(folder: &Path, prefix: &OsStr) -> io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // Permissions of a new file, reduced by the umask.
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    builder.prefix(prefix).suffix(SUFFIX).rand_bytes(RANDOM_LENGTH);
    for _ in 0..MAX_ATTEMPTS {
        let file = builder.tempfile_in(folder)?;
        // Another process may take a file without a lock for an abandoned one, and remove it before it is locked here.
        if file.as_file().lock().is_err() || file.path().symlink_metadata().is_ok() {
            return Ok(file);
        }
    }
    Err(io::Error::other("temporary files are removed by another program"))
}

/// Removes the temporary files in `folder` whose name begins with `prefix` and that no process has locked; ignores
/// errors.
fn remove_abandoned(folder: &Path, prefix: &OsStr) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for entry in entries.flatten().filter(|entry| is_temporary(&entry.file_name(), prefix)) {
        if !entry.file_type().is_ok_and(|kind| kind.is_file()) {
            continue;
        }
        let Ok(file) = OpenOptions::new().read(true).write(true).open(entry.path()) else {
            continue;
        };
        // The lock is held until the file is gone, so that its maker notices.
        if file.try_lock().is_ok() {
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

/// Whether a file name is `prefix`, [`RANDOM_LENGTH`] letters or digits, and [`SUFFIX`].
fn is_temporary(name: &OsStr, prefix: &OsStr) -> bool {
    let random = name.as_encoded_bytes().strip_prefix(prefix.as_encoded_bytes());
    let random = random.and_then(|rest| rest.strip_suffix(SUFFIX.as_bytes()));
    random.is_some_and(|r| r.len() == RANDOM_LENGTH && r.iter().all(u8::is_ascii_alphanumeric))
}

/// Folder of a file: `.` for a file name alone, and the path itself for a root.
pub fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if folder.as_os_str().is_empty() => Path::new("."),
        Some(folder) => folder,
        None => path,
    }
}

#[cfg(test)]
mod tests {
    use crate::input::part_file::PartFile;
    use std::fs::{read_dir, write};

    #[test]
    fn abandoned_files_are_removed_and_those_in_use_stay() {
        let folder = tempfile::tempdir().unwrap();
        let names = || {
            let names = read_dir(folder.path()).unwrap().map(|e| e.unwrap().file_name());
            let mut names: Vec<String> = names.map(|n| n.into_string().unwrap()).collect();
            names.sort();
            names
        };
        // Of other names, and of other forms of name.
        let foreign = ["a.csv.part", "a.csv.Ab3-5f.part", "b.csv.Ab3d5f.part", "a.csv.Ab3d5f.kept"];
        for name in foreign.iter().chain(&["a.csv.Ab3d5f.part", "a.csv.000000.part"]) {
            write(folder.path().join(name), "older").unwrap();
        }
        let path = folder.path().join("a.csv");
        let first = PartFile::beside(&path).unwrap();
        let second = PartFile::beside(&path).unwrap();
        let mut expected: Vec<String> = foreign.map(String::from).to_vec();
        for file in [&first, &second] {
            expected.push(file.path().file_name().unwrap().to_str().unwrap().into());
        }
        expected.sort();
        assert_eq!(names(), expected);
        first.persist(&path).unwrap();
        let kept = second.keep().unwrap();
        assert!(kept.exists() && kept.to_str().unwrap().ends_with(".kept"), "{}", kept.display());
        drop(PartFile::beside(&path).unwrap());
        assert_eq!(names().len(), foreign.len() + 2, "{:?}", names());
    }
}
