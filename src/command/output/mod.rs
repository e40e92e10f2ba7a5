//! The outputs of a command: its report as JSON, as a page and as a summary, and further files.
//!
//! [`Outputs`] is the list of outputs with the options that name them. All are checked before anything runs: none is an
//! input of the command or another output, and all can be written. A file is written under a temporary name beside its
//! own and renamed when it is complete, so that its name never stands for a part of it. Standard output and devices are
//! written directly. An interrupted result does not replace an older one without `--overwrite`: it is written beside it
//! under another name, with a warning. An output that fails is an error of its own; the others are written.
//! [`Outputs::write`] writes one file, [`Outputs::begin`] one in pieces. [`Outputs::finish`] writes report and page,
//! prints the summary, and returns the exit code. The summary is printed unless `--quiet`, or an output on standard
//! output, is given.
//!
//! Functions of [`Outputs`]:
//!
//! - `empty`, `new` (the report of `--json`), `with_json_file` and `with_json` make a list; only the last one checks
//!   it.
//! - `add` and `add_in_folder` add a file, and return its index, or `None` if its option is not given. `add_page` adds
//!   the page of `--report`, `add_page_with_data` also the report as JSON beside it.
//! - `check` rejects outputs as above, `check_beside` those that another fit of the command writes too.
//! - `set_interrupted` marks all later results as those of an interrupted run. `end_pieces` ends an output that was
//!   begun; after an error its written part is kept. `print` prints a summary.
//! - `has_json`, `has_page` and `has_summary` return what was requested; `is_file` excludes standard output and
//!   devices; `is_stdout_closed` is true after its reader closed it.

mod path;
mod target;
mod writer;

use crate::command::output::path::{folder_of, identity, interrupted_name, is_device, resolved};
use crate::command::output::target::Target;
use crate::command::output::writer::{Sink, open_device, with_partial_file};
use crate::command::{GlobalOptions, JsonOption, conclude, terminal};
use rodfit::summary::Summary;
use rodfit::{Code, Error, PartFile};
use serde::Serialize;
use std::cell::Cell;
use std::fs::{metadata, symlink_metadata};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::rc::Rc;

pub use writer::OutputWriter;

/// All outputs of a command.
pub struct Outputs {
    global: GlobalOptions,
    targets: Vec<Target>,
    json: Option<Output>,
    page: Option<Output>,
    page_json: Option<Output>,
    is_interrupted: bool,
    /// Set once the reader of standard output has closed it.
    is_stdout_closed: Rc<Cell<bool>>,
}

/// Index of an output.
#[derive(Clone, Copy)]
pub struct Output(usize);

impl Outputs {
    /// Outputs without a report and without files; a summary is printed unless `--quiet`.
    pub fn empty(global: GlobalOptions) -> Self {
        Self {
            global,
            targets: Vec::new(),
            json: None,
            page: None,
            page_json: None,
            is_interrupted: false,
            is_stdout_closed: Rc::default(),
        }
    }

    /// Outputs with the report in the file of `--json`, if it is given; not yet checked.
    pub fn new(json: &JsonOption, global: GlobalOptions) -> Self {
        Self::with_json_file(json.json.as_deref(), global)
    }

    /// Outputs with the report (JSON) in this file, if there is one; not yet checked.
    pub fn with_json_file(file: Option<&Path>, global: GlobalOptions) -> Self {
        let mut outputs = Self::empty(global);
        outputs.json = outputs.add("--json", file);
        outputs
    }

    /// Outputs with the report of `--json`, if given, as the only one, checked against the `inputs` of the command.
    /// Errors are those of [`check`](Self::check).
    pub fn with_json(
        json: &JsonOption,
        inputs: &[PathBuf],
        global: GlobalOptions,
    ) -> Result<Self, Error> {
        let outputs = Self::new(json, global);
        outputs.check(inputs).map(|()| outputs)
    }

    /// Adds the file that an `option` names, and returns its index; `None` without a path. `-` is standard output.
    pub fn add(&mut self, option: &str, path: Option<&Path>) -> Option<Output> {
        self.push(option, path?.into(), false)
    }

    /// Adds the file `name` in the folder that an `option` names, and returns its index; `None` without a folder. A
    /// missing folder is created when the file is written.
    pub fn add_in_folder(
        &mut self,
        option: &str,
        folder: Option<&Path>,
        name: &str,
    ) -> Option<Output> {
        self.push(option, folder?.join(name), true)
    }

    /// Adds the page of the report as the file `name` in the folder of `--report`; no page without a folder.
    pub fn add_page(&mut self, folder: Option<&Path>, name: &str) {
        self.page = self.add_in_folder("--report", folder, name);
    }

    /// Adds the page of the report, `NAME.html`, and the report as JSON, `NAME.json`, in the folder of `--report`;
    /// neither without a folder.
    pub fn add_page_with_data(&mut self, folder: Option<&Path>, name: &str) {
        self.add_page(folder, &format!("{name}.html"));
        self.page_json = self.add_in_folder("--report", folder, &format!("{name}.json"));
    }

    /// Adds a target for the `option`, and returns its index. `creates_folder`: a missing folder is created. The index
    /// is never `None`.
    fn push(&mut self, option: &str, path: PathBuf, creates_folder: bool) -> Option<Output> {
        self.targets.push(Target { option: option.into(), path, creates_folder });
        Some(Output(self.targets.len() - 1))
    }

    /// An error for the first output that is one of the `inputs` or another output, and for a file that [cannot be
    /// written](Target::check_writable). Two outputs on standard output, and `-` as the folder of an output, are errors
    /// too. No file is created.
    pub fn check(&self, inputs: &[PathBuf]) -> Result<(), Error> {
        let inputs: Vec<PathBuf> = inputs.iter().map(|path| identity(path)).collect();
        // Each output is compared with the inputs and with the outputs before it.
        for (i, target) in self.targets.iter().enumerate() {
            let path = target.path.display();
            // Standard output can take one file only.
            if target.creates_folder && folder_of(&target.path) == Path::new("-") {
                return Err(target.invalid("-", "a folder, as there may be several files"));
            }
            let files = target.files();
            if files.iter().any(|file| inputs.contains(file)) {
                let found = format!("{path}, an input of this run");
                return Err(target.invalid(found, "a file that is not an input"));
            }
            for before in &self.targets[..i] {
                if before.is_stdout() && target.is_stdout() {
                    let found = format!("standard output, which {} uses", before.option);
                    return Err(target.invalid(found, "- for one output at most"));
                }
                if before.files().iter().any(|file| files.contains(file)) {
                    let found = format!("{path}, which {} also writes", before.option);
                    return Err(target.invalid(found, "a separate file for each output"));
                }
            }
        }
        self.targets.iter().try_for_each(Target::check_writable)
    }

    /// An error if any of these outputs is a file that another fit of the same command (`other`) writes too.
    pub fn check_beside(&self, other: &Self) -> Result<(), Error> {
        let taken: Vec<PathBuf> = other.targets.iter().flat_map(Target::files).collect();
        let is_taken = |target: &&Target| target.files().iter().any(|file| taken.contains(file));
        self.targets.iter().find(is_taken).map_or(Ok(()), |target| {
            let found = format!("{}, which another fit also writes", target.path.display());
            Err(target.invalid(found, "a separate file for each output"))
        })
    }

    /// Marks all results from now on as those of an interrupted run, which do not replace older files without
    /// `--overwrite`.
    pub fn set_interrupted(&mut self) {
        self.is_interrupted = true;
    }

    /// Whether the reader of standard output closed it while an output was written there.
    pub fn is_stdout_closed(&self) -> bool {
        self.is_stdout_closed.get()
    }

    /// Whether a report in JSON was requested (`--json`).
    pub fn has_json(&self) -> bool {
        self.json.is_some()
    }

    /// Whether a page of the report was requested (`--report`).
    pub fn has_page(&self) -> bool {
        self.page.is_some()
    }

    /// Whether a summary is printed: not with `--quiet`, nor if an output goes to standard output.
    pub fn has_summary(&self) -> bool {
        // A summary would mix with the data on standard output.
        !self.global.quiet && !self.targets.iter().any(Target::is_stdout)
    }

    /// Whether an output goes to a regular file, which need not exist yet; `false` for no output, standard output and
    /// devices.
    pub fn is_file(&self, output: Option<Output>) -> bool {
        output.is_some_and(|Output(i)| !self.targets[i].files().is_empty())
    }

    /// Writes the `content` of an output, which is computed before the file is created; nothing without an output. A
    /// failed write keeps no part.
    pub fn write(
        &self,
        output: Option<Output>,
        content: impl FnOnce() -> Result<Vec<u8>, Error>,
    ) -> Result<(), Error> {
        let Some(output) = output else { return Ok(()) };
        // The content is complete before the file is created.
        let content = content()?;
        let mut writer = self.begin(output)?;
        let written = writer.write_all(&content);
        self.end(writer, written, false)
    }

    /// Writes a `report` as JSON on one line with a line break; nothing without an output. Error: the output cannot be
    /// written.
    fn write_json(&self, output: Option<Output>, report: &impl Serialize) -> Result<(), Error> {
        let Some(output) = output else { return Ok(()) };
        let mut writer = self.begin(output)?;
        // Serialized in memory: a generic writer would compile the serialization of every report once more.
        let json = serde_json::to_vec(report).map_err(io::Error::from);
        let written = json.and_then(|json| writer.write_all(&[&json[..], b"\n"].concat()));
        self.end(writer, written, false)
    }

    /// Writes a `report` as its page (if there is one) and as JSON, and prints its `summary`. Errors of outputs are
    /// printed. Returns the exit code: the larger one of `code` and those of outputs that could not be written.
    pub fn finish(
        &self,
        code: u8,
        report: &impl Serialize,
        page: Option<&dyn Fn() -> String>,
        summary: &Summary,
    ) -> u8 {
        let page = page
            .zip(self.page)
            .map_or(Ok(()), |(page, output)| self.write(Some(output), || Ok(page().into_bytes())));
        // An output that fails does not prevent the others.
        let json = [self.json, self.page_json].map(|output| self.write_json(output, report));
        conclude(code, json.into_iter().chain([page, self.print(summary)]))
    }

    /// Prints a `summary` on standard output; nothing where [no summary is printed](Self::has_summary).
    pub fn print(&self, summary: &Summary) -> Result<(), Error> {
        match self.has_summary() {
            true => terminal::print_summary(summary),
            false => Ok(()),
        }
    }

    /// Begins an output that is written in pieces: on standard output, on a device, or in a temporary file beside its
    /// path, whose missing folder is created if so requested. Error: the device, the folder or the temporary file
    /// cannot be opened or created.
    pub fn begin(&self, output: Output) -> Result<OutputWriter, Error> {
        let target = &self.targets[output.0];
        let sink = if target.is_stdout() {
            Ok(Sink::Stdout(self.is_stdout_closed.clone()))
        } else if is_device(&target.path) {
            open_device(&target.path).map(Sink::Device)
        } else {
            let path = resolved(&target.path);
            let folder = folder_of(&path);
            let created =
                if target.creates_folder { std::fs::create_dir_all(folder) } else { Ok(()) };
            created.and_then(|()| PartFile::beside(&path)).map(Sink::PartFile)
        };
        let sink = sink.map_err(|source| target.error(source))?;
        Ok(OutputWriter { output, buffer: BufWriter::new(sink) })
    }

    /// Ends an output that was written in pieces, with `written` as the outcome of the writes. After an error the
    /// written part is kept, and the error has its path.
    pub fn end_pieces(&self, writer: OutputWriter, written: io::Result<()>) -> Result<(), Error> {
        self.end(writer, written, true)
    }

    /// Flushes an output and gives its temporary file the final name, with the permissions of a file that it replaces.
    /// After an error of `written` or the flush the temporary file is removed, or kept with `keeps_part`. If only the
    /// final name fails, it is kept.
    fn end(
        &self,
        mut writer: OutputWriter,
        written: io::Result<()>,
        keeps_part: bool,
    ) -> Result<(), Error> {
        let target = &self.targets[writer.output.0];
        let written = written.and_then(|()| writer.buffer.flush());
        // Without the buffer: its drop would try to write the rest again.
        let (sink, _) = writer.buffer.into_parts();
        let Sink::PartFile(file) = sink else {
            return written.map_err(|source| target.error(source));
        };
        if let Err(source) = written {
            let source = if keeps_part { with_partial_file(file, source) } else { source };
            return Err(target.error(source));
        }
        let path = self.final_path(target);
        if let Ok(older) = metadata(&path) {
            // A result keeps the permissions of the one it replaces.
            let _ = std::fs::set_permissions(file.path(), older.permissions());
        }
        file.persist(&path).map_err(|(source, file)| target.error(with_partial_file(file, source)))
    }

    /// The path of a complete file: that of the target, with links resolved. If this run was interrupted and an older
    /// file exists, it is another name beside it, with a warning, unless `--overwrite` is given.
    fn final_path(&self, target: &Target) -> PathBuf {
        let path = resolved(&target.path);
        let replaces = !self.is_interrupted || self.global.overwrites();
        if replaces || symlink_metadata(&path).is_err() {
            return path;
        }
        // A complete older result is worth more than a part of a new one.
        let beside = interrupted_name(&path);
        let text = format!(
            "{} of an earlier run is kept. The result of this interrupted run is in {}. Use --overwrite to \
             replace the earlier one",
            path.display(),
            beside.display()
        );
        terminal::warn(Code::OlderResult, text);
        beside
    }
}
