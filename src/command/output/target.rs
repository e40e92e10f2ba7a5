//! The destination of an output, and the check that it can be written.
//!
//! A [`Target`] has the option that names it, the path, and whether a missing folder is created. `-` and `/dev/stdout`
//! are standard output ([`Target::is_stdout`]). [`Target::files`] returns the identities of the file and of the one
//! that an interrupted run may write beside it, to find files with two uses; none for standard output and devices.
//! [`Target::invalid`] makes the error of an unusable destination, [`Target::error`] that of a failed write.
//!
//! Before a run [`Target::check_writable`] rejects closed standard output, folders, read-only files, pipes, and devices
//! that are not in `/dev` or do not open. It also rejects files whose folder is not writable, or is missing and not to
//! be created. Afterwards no file exists that did not before.

use crate::command::output::path::{
    ends_like_folder, folder_of, identity, interrupted_name, is_device, resolved,
};
use crate::command::output::writer::{is_stdout_closed_at_start, open_device};
use crate::command::terminal;
use rodfit::{Error, PartFile};
use std::fmt::Display;
use std::fs::{metadata, symlink_metadata};
use std::io;
use std::path::{Path, PathBuf};

/// The destination of an output.
pub(super) struct Target {
    /// The option that names it, for messages.
    pub option: String,
    pub path: PathBuf,
    /// Whether a missing folder is created.
    pub creates_folder: bool,
}

impl Target {
    /// Whether the output goes to standard output: its path is `-` or `/dev/stdout`, and it is no file in a folder of
    /// an option.
    pub fn is_stdout(&self) -> bool {
        let is_name = ["-", "/dev/stdout"].iter().any(|name| self.path == Path::new(name));
        !self.creates_folder && is_name
    }

    /// The error of the option with the unusable destination `found` and the `allowed` ones.
    pub fn invalid(&self, found: impl Display, allowed: &str) -> Error {
        Error::invalid(&self.option, found, allowed)
    }

    /// The error of a failed write, with the path or the name of standard output.
    pub fn error(&self, source: io::Error) -> Error {
        match self.is_stdout() {
            true => terminal::stdout_error(source),
            false => Error::io(&self.path, source),
        }
    }

    /// [Identities](identity) of the file and of the one that an interrupted run may write beside it; empty for
    /// standard output and devices.
    pub fn files(&self) -> Vec<PathBuf> {
        match self.is_stdout() || is_device(&self.path) {
            true => Vec::new(),
            false => vec![identity(&self.path), identity(&interrupted_name(&self.path))],
        }
    }

    /// An error if the destination cannot be written: closed standard output, the name of a folder, a read-only file, a
    /// pipe, a device that does not open, or a file whose folder is unusable. No file remains.
    pub fn check_writable(&self) -> Result<(), Error> {
        let path = self.path.display();
        if self.is_stdout() {
            return match is_stdout_closed_at_start() {
                true => {
                    Err(self
                        .invalid("standard output, which is closed", "a file, or an open output"))
                }
                false => Ok(()),
            };
        }
        // Existing folders, read-only files and pipes are rejected; a missing file needs a folder.
        match metadata(&self.path) {
            Err(_) if ends_like_folder(&self.path) => {
                let found = format!("{path}, which ends like the name of a folder");
                Err(self.invalid(found, "the name of a file"))
            }
            Ok(found) if found.is_dir() => {
                Err(self.invalid(format!("{path}, a folder"), "the name of a file"))
            }
            Ok(found) if found.is_file() && found.permissions().readonly() => {
                Err(self.invalid(format!("{path}, which is read-only"), "a writable file"))
            }
            Ok(found) if found.is_file() => self.check_folder(),
            // Opening a pipe without a reader would block.
            Ok(_) if !self.path.starts_with("/dev") => {
                let found = format!("{path}, which is not a regular file");
                Err(self.invalid(found, "a file, or - for standard output"))
            }
            Ok(_) => open_device(&self.path).map(drop).map_err(|source| self.error(source)),
            Err(error) => match error.kind() {
                io::ErrorKind::NotFound | io::ErrorKind::NotADirectory => self.check_folder(),
                _ => Err(self.error(error)),
            },
        }
    }

    /// An error unless a file can be created in the folder of the path (links resolved), or in the nearest one that
    /// exists if missing ones are to be created. A temporary file is created and removed.
    fn check_folder(&self) -> Result<(), Error> {
        let path = resolved(&self.path);
        let mut folder = folder_of(&path);
        while self.creates_folder && symlink_metadata(folder).is_err() {
            folder = folder_of(folder);
        }
        let found = match metadata(folder) {
            Ok(found) if found.is_dir() => None,
            Ok(_) => {
                Some(format!("{}, where {} is not a folder", path.display(), folder.display()))
            }
            Err(_) => {
                let link = match path == self.path {
                    true => String::new(),
                    false => format!("{}, a link to ", self.path.display()),
                };
                Some(format!("{link}{}, whose folder does not exist", path.display()))
            }
        };
        if let Some(found) = found {
            return Err(self.invalid(found, "a file in an existing folder"));
        }
        let beside = folder.join(path.file_name().unwrap_or_default());
        PartFile::beside(&beside).map(drop).map_err(|source| {
            // The message of the system has the temporary file's name: only its kind is shown.
            let reason = source.kind();
            let found = format!("{}, whose folder is not writable: {reason}", path.display());
            self.invalid(found, "a writable folder")
        })
    }
}
