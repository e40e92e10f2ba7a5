//! Reads whole files of limited size, as bytes ([`data`], up to 500 MB; [`limited`], up to a stated size) or UTF-8 text
//! ([`text`], up to 100 MB). [`is_there`] returns whether there is a file.
//!
//! Larger files, text that is not UTF-8, folders, named pipes and devices are errors ([`Error::Io`]) with the path,
//! because reading a pipe may never end. If a missing path has an environment variable that is not set, the message
//! names it. `/dev/stdin` and files in `/dev/fd` and `/proc/self/fd` are accepted. [`at`] joins the name of a file to a
//! folder, without reading it. A name that begins with `$NAME/` is relative to the folder in the environment variable
//! NAME, if that is set and not empty. In [`with_files`] the given contents take the place of the files of the disk on
//! the calling thread, as is needed where there is no disk (WebAssembly in a browser).

use crate::error::Error;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Component, Path, PathBuf};

/// Largest size of a table, bytes. Larger files are rejected, as their numbers may need several times this memory.
const MOST_DATA: u64 = 500_000_000;
/// Largest size of a text, bytes; its parsed form may need many times its size.
const MOST_TEXT: u64 = 100_000_000;

thread_local! {
    /// Contents of files that are read in place of the disk, within [`with_files`].
    static FILES: RefCell<Option<BTreeMap<PathBuf, Vec<u8>>>> = const { RefCell::new(None) };
}

/// Calls `read`, during which this thread reads `files` (their contents by path) and no others. A path that is read is
/// looked up without its components `.`, which the keys must not have. Other threads read the disk. The files of an
/// outer call are read again afterwards.
///
/// ```
/// use marker_files::file;
/// let files = [("tip.csv".into(), b"time,x\n0,0.1\n".to_vec())].into();
/// let text = file::with_files(files, || file::text("tip.csv".as_ref()))?;
/// assert_eq!(text, "time,x\n0,0.1\n");
/// # Ok::<(), marker_files::Error>(())
/// ```
pub fn with_files<T>(files: BTreeMap<PathBuf, Vec<u8>>, read: impl FnOnce() -> T) -> T {
    /// The files of the outer call, which are put back also after a panic.
    struct Outer(Option<BTreeMap<PathBuf, Vec<u8>>>);
    impl Drop for Outer {
        fn drop(&mut self) {
            FILES.set(self.0.take());
        }
    }
    let files = files.into_iter().map(|(path, content)| (without_dots(&path), content)).collect();
    let _outer = Outer(FILES.replace(Some(files)));
    read()
}

/// The path without parts `.`: `./tip.csv` and `tip.csv` are one file.
fn without_dots(path: &Path) -> PathBuf {
    path.components().filter(|part| *part != Component::CurDir).collect()
}

/// The content of the file at `path` within [`with_files`], an error if it is none of those; `None` outside of it.
fn in_memory(path: &Path) -> Option<io::Result<Vec<u8>>> {
    FILES.with_borrow(|files| {
        let files = files.as_ref()?;
        Some(files.get(&without_dots(path)).cloned().ok_or_else(|| {
            let names: Vec<_> = files.keys().map(|name| name.display().to_string()).collect();
            let message = format!("found no such file, given: {}", names.join(", "));
            io::Error::new(io::ErrorKind::NotFound, message)
        }))
    })
}

/// The bytes of a table of measurements.
///
/// # Errors
///
/// A file that cannot be read, is no regular file, or is larger than 500 MB.
pub fn data(path: &Path) -> Result<Vec<u8>, Error> {
    bytes(path, MOST_DATA).map_err(|source| unreadable(path, source))
}

/// The bytes of a file of at most `most` bytes.
///
/// # Errors
///
/// A file that cannot be read, is no regular file, or is larger.
pub fn limited(path: &Path, most: u64) -> Result<Vec<u8>, Error> {
    bytes(path, most).map_err(|source| unreadable(path, source))
}

/// Whether there is a regular file at a path, or one of the contents given within [`with_files`].
pub fn is_there(path: &Path) -> bool {
    match in_memory(path) {
        Some(content) => content.is_ok(),
        None => std::fs::metadata(path).is_ok_and(|found| found.is_file()),
    }
}

/// The text of a file, which must be UTF-8.
///
/// # Errors
///
/// A file that cannot be read, is no regular file, is larger than 100 MB, or is not UTF-8 text.
pub fn text(path: &Path) -> Result<String, Error> {
    let bytes = bytes(path, MOST_TEXT).map_err(|source| unreadable(path, source))?;
    String::from_utf8(bytes).map_err(|error| {
        let message = format!("byte {} is not UTF-8 text", error.utf8_error().valid_up_to());
        Error::io(path, io::Error::new(io::ErrorKind::InvalidData, message))
    })
}

/// The error of a file that could not be read for the reason `source`. If it is missing and a part of its path is an
/// environment variable that is not set, the message names the variable.
fn unreadable(path: &Path, source: io::Error) -> Error {
    let mut parts = path.iter().filter_map(|part| part.to_str()?.strip_prefix('$'));
    let unset = parts.find(|name| !name.is_empty() && variable(name).is_none());
    match unset.filter(|_| source.kind() == io::ErrorKind::NotFound) {
        Some(name) => {
            let message = format!(
                "the environment variable {name} is not set; set it to the folder that contains the file"
            );
            Error::io(path, io::Error::new(io::ErrorKind::NotFound, message))
        }
        None => Error::io(path, source),
    }
}

/// The value of an environment variable; `None` if it is not set or empty.
fn variable(name: &str) -> Option<OsString> {
    std::env::var_os(name).filter(|value| !value.is_empty())
}

/// The bytes of a regular file, or of a pipe that the shell opened. An error for more than `most` bytes, and for other
/// kinds of files. Within [`with_files`] the given contents are returned, of any size.
fn bytes(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    if let Some(content) = in_memory(path) {
        return content;
    }
    // A pipe without a writer blocks forever.
    if !std::fs::metadata(path)?.is_file() && !is_handed_over(path) {
        let message =
            "found a folder, a pipe or a device, allowed: a regular file, /dev/stdin or /dev/fd/N";
        return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
    }
    let mut bytes = Vec::new();
    // One byte more than allowed shows that a file is too large, without reading all of it.
    File::open(path)?.take(most + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most {
        let message =
            format!("found more than {0} MB, allowed: files up to {0} MB", most / 1_000_000);
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, message));
    }
    Ok(bytes)
}

/// Whether a path is one by which the shell hands over an open file or pipe: `/dev/stdin`, or a file in `/dev/fd` or
/// `/proc/self/fd`.
fn is_handed_over(path: &Path) -> bool {
    let folders: [PathBuf; 2] = ["/dev/fd".into(), "/proc/self/fd".into()];
    path == Path::new("/dev/stdin") || path.parent().is_some_and(|p| folders.iter().any(|f| f == p))
}

/// The path of a file whose `name` is relative to `folder`; the name stays if it is absolute. A name that begins with
/// `$NAME/` is relative to the folder in the environment variable NAME instead, if that is set and not empty.
pub fn at(folder: &Path, name: &Path) -> PathBuf {
    let text = name.to_string_lossy();
    let Some((own, rest)) = text.strip_prefix('$').and_then(|text| text.split_once('/')) else {
        return folder.join(name);
    };
    variable(own).map_or_else(|| folder.join(name), |value| Path::new(&value).join(rest))
}
