//! Writers of outputs: standard output, a device, or a temporary file.
//!
//! [`OutputWriter`] buffers the bytes of an output and passes them to its [`Sink`]. A standard output whose reader has
//! closed it drops the rest without an error. The temporary file becomes the output when `Outputs` ends it.
//! [`with_partial_file`] keeps the temporary file of an output that could not be written or renamed, and returns the
//! error with its path. [`open_device`] opens an existing device. [`is_stdout_closed_at_start`] tests for a standard
//! output that was closed from the beginning (Linux only; elsewhere it counts as open).

use crate::command::output::Output;
use crate::command::terminal;
use rodfit::PartFile;
use std::cell::Cell;
use std::fs::{File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::Path;
use std::rc::Rc;

/// A buffered output that is being written.
pub struct OutputWriter {
    pub(super) output: Output,
    pub(super) buffer: BufWriter<Sink>,
}

impl Write for OutputWriter {
    /// Writes bytes into the buffer, and returns how many of them are taken. Error: a failed write of the sink.
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.buffer.write(bytes)
    }

    /// Passes all buffered bytes to the sink, and flushes it. Error: a failed write of the sink.
    fn flush(&mut self) -> io::Result<()> {
        self.buffer.flush()
    }
}

/// Destination of the bytes of an output.
pub(super) enum Sink {
    /// Standard output. The flag is set once its reader has closed it; the rest is dropped.
    Stdout(Rc<Cell<bool>>),
    /// A device, such as /dev/null.
    Device(File),
    /// A temporary file beside the one it becomes.
    PartFile(PartFile),
}

impl Write for Sink {
    /// Writes bytes to the destination, and returns how many of them are written. On a closed standard output they are
    /// dropped and count as written; the flag is set. Other failed writes are errors.
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self {
            Self::Stdout(is_closed) if is_closed.get() => Ok(bytes.len()),
            Self::Stdout(is_closed) => match terminal::write_data(bytes) {
                // The reader has read enough, as `head` does: this is no error.
                Err(error) if error.kind() == io::ErrorKind::BrokenPipe => {
                    is_closed.set(true);
                    Ok(bytes.len())
                }
                written => written,
            },
            Self::Device(file) => file.write(bytes),
            Self::PartFile(file) => file.write(bytes),
        }
    }

    /// Flushes the destination; a closed standard output is no error.
    fn flush(&mut self) -> io::Result<()> {
        match self {
            Self::Stdout(_) => terminal::unless_closed(io::stdout().flush()),
            Self::Device(file) => file.flush(),
            Self::PartFile(file) => file.flush(),
        }
    }
}

/// Keeps the temporary file of a failed write, and returns the error `source` with its path, or with the reason why it
/// is lost.
pub(super) fn with_partial_file(file: PartFile, source: io::Error) -> io::Error {
    let note = match file.keep() {
        Ok(path) => format!("the partial output is in {}", path.display()),
        Err(error) => format!("the partial output is lost: {error}"),
    };
    io::Error::new(source.kind(), format!("{source}; {note}"))
}

/// Opens an existing device for writing; it is not created. Error: it does not exist or cannot be written.
pub(super) fn open_device(path: &Path) -> io::Result<File> {
    OpenOptions::new().write(true).open(path)
}

/// Whether standard output was closed before the program began, as by `>&-`; false on other systems than Linux. The
/// runtime then opens /dev/null in its place for reading and writing; a shell that redirects an output to /dev/null
/// opens it for writing only.
pub(super) fn is_stdout_closed_at_start() -> bool {
    /// The access mode of an open file for reading and writing, O_RDWR.
    const READ_AND_WRITE: u32 = 2;
    /// The bits of the access mode, O_ACCMODE.
    const ACCESS_MODE: u32 = 3;
    // Other systems than Linux have no such files: there the output counts as open.
    let is_null = std::fs::read_link("/proc/self/fd/1").is_ok_and(|p| p == Path::new("/dev/null"));
    let info = std::fs::read_to_string("/proc/self/fdinfo/1").unwrap_or_default();
    let flags = info.lines().find_map(|line| line.strip_prefix("flags:"));
    let flags = flags.and_then(|flags| u32::from_str_radix(flags.trim(), 8).ok());
    is_null && flags.is_some_and(|flags| flags & ACCESS_MODE == READ_AND_WRITE)
}
