//! What a run writes. All places are looked at before anything runs: none is an input of the run or a place of another
//! output, and all can be written. Files are written under a temporary name beside theirs and renamed when they are
//! whole, so that a name never stands for half a file; and what a run that was interrupted has to say does not take
//! the place of an older result unless it is told to.

use crate::command::{Manner, terminal};
use rodfit::summary::Summary;
use rodfit::{Code, Error, PartFile};
use serde::Serialize;
use std::cell::Cell;
use std::ffi::OsString;
use std::fmt::Display;
use std::fs::{File, OpenOptions, metadata, symlink_metadata};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// All outputs of a run.
pub struct Outputs {
    manner: Manner,
    targets: Vec<Target>,
    interrupted: bool,
    /// Whether whoever reads standard output has closed it.
    closed: Rc<Cell<bool>>,
}

/// One of them.
#[derive(Clone, Copy)]
pub struct Output(usize);

struct Target {
    /// The option that asked for it, for messages.
    option: String,
    path: PathBuf,
    /// The folder is made where it is missing.
    makes_folder: bool,
}

impl Target {
    fn is_stdout(&self) -> bool {
        !self.makes_folder && (self.path == Path::new("-") || self.path == Path::new("/dev/stdout"))
    }

    fn refused(&self, found: impl Display, allowed: &str) -> Error {
        let (key, allowed) = (self.option.clone(), allowed.into());
        Error::Invalid { file: None, key, found: found.to_string(), allowed }
    }

    fn error(&self, source: io::Error) -> Error {
        match self.is_stdout() {
            true => terminal::stdout_error(source),
            false => Error::Io { named_in: None, path: self.path.clone(), source },
        }
    }

    /// The file itself, and the one that an interrupted run may write beside it.
    fn claims(&self) -> Vec<PathBuf> {
        match self.is_stdout() || is_device(&self.path) {
            true => Vec::new(),
            false => vec![identity(&self.path), identity(&interrupted_name(&self.path))],
        }
    }

    /// Looks whether the place can be written, without leaving a trace.
    fn try_out(&self) -> Result<(), Error> {
        match metadata(&self.path) {
            _ if self.is_stdout() && stdout_is_closed() => {
                Err(self.refused("standard output, which is closed", "a file, or an open output"))
            }
            _ if self.is_stdout() => Ok(()),
            Err(_) if names_a_folder(&self.path) => {
                let found =
                    format!("{}, which ends like the name of a folder", self.path.display());
                Err(self.refused(found, "the name of a file"))
            }
            Ok(found) if found.is_dir() => {
                Err(self
                    .refused(format!("{}, a folder", self.path.display()), "the name of a file"))
            }
            Ok(found) if found.is_file() && found.permissions().readonly() => {
                let found = format!("{}, which is read-only", self.path.display());
                Err(self.refused(found, "a writable file"))
            }
            Ok(found) if found.is_file() => self.try_folder(),
            // Opening a pipe that nobody reads would wait for ever.
            Ok(_) if !self.path.starts_with("/dev") => Err(self.refused(
                format!("{}, which is not a regular file", self.path.display()),
                "a file, or - for standard output",
            )),
            Ok(_) => open(&self.path).map(drop).map_err(|source| self.error(source)),
            Err(error)
                if matches!(
                    error.kind(),
                    io::ErrorKind::NotFound | io::ErrorKind::NotADirectory
                ) =>
            {
                self.try_folder()
            }
            Err(error) => Err(self.error(error)),
        }
    }

    fn try_folder(&self) -> Result<(), Error> {
        let path = resolved(&self.path);
        let mut folder = folder_of(&path);
        while self.makes_folder && symlink_metadata(folder).is_err() {
            folder = folder_of(folder);
        }
        match metadata(folder) {
            Ok(found) if found.is_dir() => {}
            Ok(_) => {
                let found =
                    format!("{}, where {} is not a folder", path.display(), folder.display());
                return Err(self.refused(found, "a file in an existing folder"));
            }
            Err(_) => {
                let link = match path == self.path {
                    true => String::new(),
                    false => format!("{}, a link to ", self.path.display()),
                };
                let found = format!("{link}{}, whose folder does not exist", path.display());
                return Err(self.refused(found, "a file in an existing folder"));
            }
        }
        // With `makes_folder` the folder itself may be missing.
        let beside = folder.join(path.file_name().unwrap_or_default());
        PartFile::beside(&beside).map(drop).map_err(|source| {
            // What the system says of the temporary file's own name would only confuse.
            let found =
                format!("{}, whose folder is not writable: {}", path.display(), source.kind());
            self.refused(found, "a writable folder")
        })
    }
}

impl Outputs {
    pub fn new(manner: Manner) -> Self {
        let closed = Rc::default();
        Self { manner, targets: Vec::new(), interrupted: false, closed }
    }

    /// Adds the file that an option asks for; `-` is standard output.
    pub fn add(&mut self, option: &str, path: Option<&Path>) -> Option<Output> {
        self.push(option, path?.into(), false)
    }

    /// Adds a file in the folder that an option asks for, which is made.
    pub fn add_in_folder(
        &mut self,
        option: &str,
        folder: Option<&Path>,
        name: &str,
    ) -> Option<Output> {
        self.push(option, folder?.join(name), true)
    }

    fn push(&mut self, option: &str, path: PathBuf, makes_folder: bool) -> Option<Output> {
        self.targets.push(Target { option: option.into(), path, makes_folder });
        Some(Output(self.targets.len() - 1))
    }

    /// Refuses what would overwrite an input or another output, or cannot be written.
    pub fn check(&self, inputs: &[PathBuf]) -> Result<(), Error> {
        let inputs: Vec<PathBuf> = inputs.iter().map(|path| identity(path)).collect();
        for (i, target) in self.targets.iter().enumerate() {
            let path = target.path.display();
            if target.makes_folder && folder_of(&target.path) == Path::new("-") {
                return Err(target.refused("-", "a folder, as there may be several files"));
            }
            let claims = target.claims();
            if claims.iter().any(|claim| inputs.contains(claim)) {
                let found = format!("{path}, an input of this run");
                return Err(target.refused(found, "a file that is not an input"));
            }
            for before in &self.targets[..i] {
                if before.is_stdout() && target.is_stdout() {
                    let found = format!("standard output, which {} uses", before.option);
                    return Err(target.refused(found, "- for one output at most"));
                }
                if before.claims().iter().any(|claim| claims.contains(claim)) {
                    let found = format!("{path}, which {} also writes", before.option);
                    return Err(target.refused(found, "a separate file for each output"));
                }
            }
        }
        self.targets.iter().try_for_each(Target::try_out)
    }

    /// Refuses what another run of the same call writes too.
    pub fn check_beside(&self, before: &Self) -> Result<(), Error> {
        let taken: Vec<PathBuf> = before.targets.iter().flat_map(Target::claims).collect();
        let twice = |target: &&Target| target.claims().iter().any(|claim| taken.contains(claim));
        match self.targets.iter().find(twice) {
            Some(target) => {
                let found = format!("{}, which another fit also writes", target.path.display());
                Err(target.refused(found, "a separate file for each output"))
            }
            None => Ok(()),
        }
    }

    /// From now on results are those of a run that was interrupted.
    pub fn are_interrupted(&mut self) {
        self.interrupted = true;
    }

    /// Whether whoever reads standard output has closed it.
    pub fn reader_left(&self) -> bool {
        self.closed.get()
    }

    /// Whether an output becomes a file.
    pub fn on_disk(&self, output: Option<Output>) -> bool {
        output.is_some_and(|Output(i)| !self.targets[i].claims().is_empty())
    }

    /// Writes an output whole.
    pub fn write(
        &self,
        output: Option<Output>,
        content: impl FnOnce() -> Result<Vec<u8>, Error>,
    ) -> Result<(), Error> {
        let Some(output) = output else { return Ok(()) };
        let content = content()?;
        let mut writing = self.begin(output)?;
        let written = writing.write_all(&content);
        self.end(writing, written, false)
    }

    /// Writes a report as JSON.
    pub fn write_json(&self, output: Option<Output>, report: &impl Serialize) -> Result<(), Error> {
        let Some(output) = output else { return Ok(()) };
        let mut writing = self.begin(output)?;
        // By way of memory, as all that becomes JSON: every other writer would be all of it once more.
        let written = serde_json::to_vec(report).map_err(io::Error::from);
        let written = written.and_then(|json| writing.write_all(&[&json[..], b"\n"].concat()));
        self.end(writing, written, false)
    }

    /// Whether a summary is printed: it may be unwanted, or standard output holds a result.
    pub fn has_summary(&self) -> bool {
        !self.manner.quiet && !self.targets.iter().any(Target::is_stdout)
    }

    /// Prints a summary, if there is one.
    pub fn summary(&self, summary: &Summary) -> Result<(), Error> {
        match self.has_summary() {
            true => terminal::print_summary(summary),
            false => Ok(()),
        }
    }

    /// Starts to write an output piece by piece.
    pub fn begin(&self, output: Output) -> Result<Writing, Error> {
        let target = &self.targets[output.0];
        let sink = if target.is_stdout() {
            Ok(Sink::Standard(self.closed.clone()))
        } else if is_device(&target.path) {
            open(&target.path).map(Sink::Device)
        } else {
            let path = resolved(&target.path);
            let folder = folder_of(&path);
            let made = if target.makes_folder { std::fs::create_dir_all(folder) } else { Ok(()) };
            made.and_then(|()| PartFile::beside(&path)).map(Sink::Beside)
        };
        let sink = sink.map_err(|source| target.error(source))?;
        Ok(Writing { output, to: BufWriter::new(sink) })
    }

    /// Ends what was written piece by piece: `written` says how that went. What was written stays, whatever happens.
    pub fn finish(&self, writing: Writing, written: io::Result<()>) -> Result<(), Error> {
        self.end(writing, written, true)
    }

    fn end(&self, mut writing: Writing, written: io::Result<()>, keep: bool) -> Result<(), Error> {
        let target = &self.targets[writing.output.0];
        let written = written.and_then(|()| writing.to.flush());
        // What does not fit is not tried again.
        let (sink, _) = writing.to.into_parts();
        let Sink::Beside(file) = sink else {
            return written.map_err(|source| target.error(source));
        };
        if let Err(source) = written {
            let source = if keep { kept(file, source) } else { source };
            return Err(target.error(source));
        }
        let path = self.place(target);
        if let Ok(older) = metadata(&path) {
            // A result keeps the permissions of the one it replaces.
            let _ = std::fs::set_permissions(file.path(), older.permissions());
        }
        file.persist(&path).map_err(|(source, file)| target.error(kept(file, source)))
    }

    /// Where a file goes: beside an older one if this run was interrupted.
    fn place(&self, target: &Target) -> PathBuf {
        let path = resolved(&target.path);
        if !self.interrupted || self.manner.overwrites() || symlink_metadata(&path).is_err() {
            return path;
        }
        let beside = interrupted_name(&path);
        let words = format!(
            "{} of an earlier run is kept. The result of this interrupted run is in {}. Use --overwrite to \
             replace the earlier one",
            path.display(),
            beside.display()
        );
        terminal::warn(Code::OlderResult, words);
        beside
    }
}

/// An output while it is written.
pub struct Writing {
    output: Output,
    to: BufWriter<Sink>,
}

impl Write for Writing {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.to.write(bytes)
    }
    fn flush(&mut self) -> io::Result<()> {
        self.to.flush()
    }
}

/// Where the bytes go.
enum Sink {
    /// Standard output; the flag is set once nobody reads it.
    Standard(Rc<Cell<bool>>),
    /// What is no regular file, such as /dev/null.
    Device(File),
    /// A temporary file beside the one it will be.
    Beside(PartFile),
}

impl Write for Sink {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self {
            Self::Standard(closed) if closed.get() => Ok(bytes.len()),
            Self::Standard(closed) => match terminal::write_data(bytes) {
                Err(error) if error.kind() == io::ErrorKind::BrokenPipe => {
                    closed.set(true);
                    Ok(bytes.len())
                }
                written => written,
            },
            Self::Device(file) => file.write(bytes),
            Self::Beside(file) => file.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match self {
            Self::Standard(_) => terminal::unless_closed(io::stdout().flush()),
            Self::Device(file) => file.flush(),
            Self::Beside(file) => file.flush(),
        }
    }
}

/// Keeps a temporary file, and says so in the error that stopped it.
fn kept(file: PartFile, source: io::Error) -> io::Error {
    let note = match file.keep() {
        Ok(path) => format!("the partial output is in {}", path.display()),
        Err(error) => format!("the partial output is lost: {error}"),
    };
    io::Error::new(source.kind(), format!("{source}; {note}"))
}

fn open(path: &Path) -> io::Result<File> {
    OpenOptions::new().write(true).open(path)
}

/// Whether a path is there and neither a file nor a folder.
fn is_device(path: &Path) -> bool {
    metadata(path).is_ok_and(|found| !found.is_file() && !found.is_dir())
}

/// Symbolic links that are followed one after another, as systems do.
const MAX_LINKS: usize = 40;

/// The file that a symbolic link leads to, whether it is there or not; any other path is itself.
fn resolved(path: &Path) -> PathBuf {
    if let Ok(found) = path.canonicalize() {
        return found;
    }
    let mut path = path.to_path_buf();
    for _ in 0..MAX_LINKS {
        match std::fs::read_link(&path) {
            Ok(target) => path = folder_of(&path).join(target),
            Err(_) => break,
        }
    }
    path
}

/// Whether a path ends as those of folders do.
fn names_a_folder(path: &Path) -> bool {
    let bytes = path.as_os_str().as_encoded_bytes();
    let ends = |end: &[u8]| bytes.ends_with(end);
    let is_separator = |byte: &u8| std::path::is_separator(char::from(*byte));
    bytes.last().is_some_and(is_separator) || ends(b"/.") || ends(b"/..") || bytes == b".."
}

/// Whether standard output was closed before the program began, as by `>&-`: the runtime opens /dev/null in its
/// place, for reading and writing, while a shell that redirects an output to it opens it for writing.
#[cfg(target_os = "linux")]
fn stdout_is_closed() -> bool {
    /// The access mode of an open file for reading and writing, O_RDWR, in the two bits of O_ACCMODE.
    const READ_AND_WRITE: u32 = 2;
    const ACCESS_MODE: u32 = 3;
    let is_null = std::fs::read_link("/proc/self/fd/1").is_ok_and(|p| p == Path::new("/dev/null"));
    let about = std::fs::read_to_string("/proc/self/fdinfo/1").unwrap_or_default();
    let flags = about.lines().find_map(|line| line.strip_prefix("flags:"));
    let flags = flags.and_then(|flags| u32::from_str_radix(flags.trim(), 8).ok());
    is_null && flags.is_some_and(|flags| flags & ACCESS_MODE == READ_AND_WRITE)
}

#[cfg(not(target_os = "linux"))]
fn stdout_is_closed() -> bool {
    false
}

/// The folder of a file.
fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if folder.as_os_str().is_empty() => Path::new("."),
        Some(folder) => folder,
        None => path,
    }
}

/// The same for all names of a file, whether it is there or not.
fn identity(path: &Path) -> PathBuf {
    let mut missing = Vec::new();
    let mut there = path;
    let found = loop {
        match (there.canonicalize(), there.file_name()) {
            (Ok(found), _) => break found,
            (Err(_), Some(name)) => {
                missing.push(name);
                there = folder_of(there);
            }
            _ => break there.into(),
        }
    };
    let whole = missing.iter().rev().fold(found, |path, name| path.join(name));
    match cfg!(any(windows, target_os = "macos")) {
        // Their file systems do not tell capitals apart.
        true => whole.to_string_lossy().to_lowercase().into(),
        false => whole,
    }
}

/// `fit.interrupted.json` beside `fit.json`.
fn interrupted_name(path: &Path) -> PathBuf {
    let mut name: OsString = path.file_stem().unwrap_or_default().into();
    name.push(".interrupted");
    if let Some(extension) = path.extension() {
        name.push(".");
        name.push(extension);
    }
    path.with_file_name(name)
}
