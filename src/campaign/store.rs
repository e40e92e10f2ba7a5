//! The results of a campaign on disk, in the folder `parts` of the plan.
//!
//! Every process appends to a file of its own, named by machine, process and time. Each result is one line of JSON, in
//! one write and one sync: task id, outcome, circumstances (wall time in s, machine, end in s since 1970), and a
//! checksum at the end. So a killed process leaves at most one torn line, the last of its file. `Store::add` appends an
//! outcome; a failed write is an error. `Store::read` passes every valid result to a function, by files in alphabetical
//! order; a task may have several. It returns lines of another form or with a wrong checksum as damaged (torn if last
//! without a line break). A missing folder has no results; results of version 0.1 get current names.
//!
//! `StoredRecord` is a stored result, with the circumstances of its computation (`RecordContext`), which differ between
//! equal results. `DamagedLine` is a line without a valid result.

use crate::campaign::former_results::with_current_names;
use crate::campaign::hash::hash;
use crate::campaign::outcome::Outcome;
use crate::error::Error;
use serde::{Deserialize, Serialize};
use std::fs::{File, OpenOptions};
use std::io::{self, BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::{SystemTime, UNIX_EPOCH};

/// Name of the subfolder with the files of results.
const PARTS: &str = "parts";
/// Bytes of a line's checksum, 64 bits of SHA-256: it detects torn and damaged lines, not intended changes.
const CHECKSUM: usize = 8;

/// Circumstances of a computation, which differ between equal results.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct RecordContext {
    /// Wall time of the fit, s.
    pub wall_seconds: f64,
    /// Name of the machine.
    pub host: String,
    /// End of the fit, s since 1970.
    pub finished: f64,
}

/// A stored result.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct StoredRecord {
    pub id: String,
    /// The JSON of the [outcome](Outcome), with current names.
    pub result: String,
    pub context: RecordContext,
    /// The file of the result, for messages.
    pub file: PathBuf,
    /// The line in the file, from 1.
    pub line: u64,
}

/// A line without a valid result: torn, as the last one of a killed process, or damaged.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct DamagedLine {
    pub file: PathBuf,
    pub line: u64,
    /// Whether it is the last line, without a line break.
    pub is_torn: bool,
}

/// The results of a campaign on disk, with the file of this process.
#[derive(Debug)]
pub struct Store {
    folder: PathBuf,
    host: String,
    /// The file of this process, created with its first result.
    part: Mutex<Option<File>>,
}

impl Store {
    /// The store of a plan's folder, with its files in the subfolder `parts`. Nothing is created or read yet.
    pub fn new(folder: &Path) -> Self {
        Self { folder: folder.join(PARTS), host: host(), part: Mutex::new(None) }
    }

    /// Appends the outcome of the task `id` with its wall time, s, the name of the machine and the present time. It is
    /// on disk when this returns. The first result of this store creates its file; the first after a failed write
    /// begins another. Threads may call it at once.
    ///
    /// # Errors
    ///
    /// A failed write.
    pub fn add(&self, id: &str, outcome: &Outcome, wall_seconds: f64) -> Result<(), Error> {
        let finished = now().as_secs_f64();
        let context = RecordContext { wall_seconds, host: self.host.clone(), finished };
        let context = serde_json::to_string(&context).unwrap_or_default();
        let line = format!("{{\"id\":\"{id}\",\"result\":{},\"about\":{context}", outcome.json);
        let line = format!("{line},\"checksum\":\"{}\"}}\n", hash(line.as_bytes(), CHECKSUM));
        // One line is one write, so that threads do not mix their lines.
        let mut part = self.part.lock().unwrap_or_else(PoisonError::into_inner);
        let mut file = match part.take() {
            Some(file) => file,
            None => self.begin().map_err(|source| Error::io(&self.folder, source))?,
        };
        // After a failure the next result begins another file, so that only last lines are torn.
        let written = file.write_all(line.as_bytes()).and_then(|()| file.sync_data());
        written.map_err(|source| Error::io(&self.folder, source))?;
        *part = Some(file);
        Ok(())
    }

    /// Creates the folder, and the file of this process, `HOST-PROCESS-NANOSECONDS.jsonl`, with a name that no other
    /// file has. It opens the file for appending and syncs the folder, where the system can. Error: either cannot be
    /// created.
    fn begin(&self) -> io::Result<File> {
        std::fs::create_dir_all(&self.folder)?;
        loop {
            let name = format!("{}-{}-{}.jsonl", self.host, std::process::id(), now().as_nanos());
            match OpenOptions::new().append(true).create_new(true).open(self.folder.join(name)) {
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                opened => {
                    // The name is synced too, on systems that can sync folders.
                    let _ = File::open(&self.folder).and_then(|folder| folder.sync_all());
                    return opened;
                }
            }
        }
    }

    /// Calls `each` with every stored result, file by file (`.jsonl`) in alphabetical order, and returns the lines
    /// without a valid one, in the same order. A task may have several results. A missing folder has no results. Error:
    /// a folder or file that cannot be read.
    pub(crate) fn read(
        &self,
        mut each: impl FnMut(StoredRecord),
    ) -> Result<Vec<DamagedLine>, Error> {
        let mut damaged = Vec::new();
        let entries = match std::fs::read_dir(&self.folder) {
            Ok(entries) => entries,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(damaged),
            Err(error) => return Err(Error::io(&self.folder, error)),
        };
        let files: Result<Vec<PathBuf>, _> = entries.map(|entry| Ok(entry?.path())).collect();
        let mut files = files.map_err(|error| Error::io(&self.folder, error))?;
        files.retain(|file| file.extension().is_some_and(|extension| extension == "jsonl"));
        // The order of reading is the same on every machine.
        files.sort();
        for file in files {
            let mut read = || -> io::Result<()> {
                let mut from = BufReader::new(File::open(&file)?);
                let mut line = Vec::new();
                for number in 1.. {
                    line.clear();
                    if from.read_until(b'\n', &mut line)? == 0 {
                        break;
                    }
                    match parse_record(&line, &file, number) {
                        Some(record) => each(record),
                        None => {
                            let is_torn = line.last() != Some(&b'\n');
                            damaged.push(DamagedLine { file: file.clone(), line: number, is_torn });
                        }
                    }
                }
                Ok(())
            };
            read().map_err(|error| Error::io(&file, error))?;
        }
        Ok(damaged)
    }
}

/// The result of a line (with its line break), with current names; none if the line is torn, is no UTF-8, has another
/// form, or a wrong checksum. `number` counts the lines of `file` from 1.
fn parse_record(line: &[u8], file: &Path, number: u64) -> Option<StoredRecord> {
    let line = std::str::from_utf8(line).ok()?.strip_suffix("\"}\n")?;
    let (line, checksum) = line.rsplit_once(",\"checksum\":\"")?;
    // A torn or damaged line has another checksum.
    if checksum != hash(line.as_bytes(), CHECKSUM) {
        return None;
    }
    // The line is divided at its fixed keys, so that the result keeps its bytes.
    let (id, rest) = line.strip_prefix("{\"id\":\"")?.split_once("\",\"result\":")?;
    let (result, context) = rest.rsplit_once(",\"about\":")?;
    let context = serde_json::from_str(context).ok()?;
    Some(StoredRecord {
        id: id.into(),
        result: with_current_names(result),
        context,
        file: file.into(),
        line: number,
    })
}

/// The time since 1970-01-01 UTC; 0 if the clock is before it.
fn now() -> std::time::Duration {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default()
}

/// The name of the machine by Slurm, else the kernel, else the environment. It has at most 60 characters, of which
/// those other than ASCII letters, digits and `.-_` are `_`; `host` if unknown.
fn host() -> String {
    let system = || std::fs::read_to_string("/proc/sys/kernel/hostname").ok();
    let variable = |name: &str| std::env::var(name).ok();
    let name = variable("SLURMD_NODENAME").or_else(system).or_else(|| variable("HOSTNAME"));
    let name = name.or_else(|| variable("COMPUTERNAME")).unwrap_or_default();
    // The name of the machine is a part of file names.
    let plain = |c: char| if c.is_ascii_alphanumeric() || ".-_".contains(c) { c } else { '_' };
    let name: String = name.trim().chars().take(60).map(plain).collect();
    if name.is_empty() { "host".into() } else { name }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Identifiers of all records of a store, and its damaged lines.
    fn read(store: &Store) -> (Vec<String>, Vec<DamagedLine>) {
        let mut ids = Vec::new();
        let damaged = store.read(|record| ids.push(record.id)).unwrap();
        (ids, damaged)
    }

    #[test]
    fn torn_and_damaged_lines_are_ignored() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::new(folder.path());
        assert_eq!(read(&store), (vec![], vec![]));
        let outcome = Outcome { code: 0, json: "{\"code\":0,\"about\":\"\\\",\"}".into() };
        for id in ["a", "b", "c"] {
            store.add(id, &outcome, 0.5).unwrap();
        }
        assert_eq!(read(&store), (vec!["a".into(), "b".into(), "c".into()], vec![]));
        let mut results = Vec::new();
        store.read(|record| results.push(record.result)).unwrap();
        assert_eq!(results, [&outcome.json[..]; 3]);
        let file =
            std::fs::read_dir(folder.path().join(PARTS)).unwrap().next().unwrap().unwrap().path();
        let whole = std::fs::read(&file).unwrap();
        // Torn anywhere in the last line.
        let last = whole.iter().rev().skip(1).position(|b| *b == b'\n').unwrap() + 1;
        for length in [1, 2, 10, last / 2, last - 1] {
            std::fs::write(&file, &whole[..whole.len() - length]).unwrap();
            let (ids, damaged) = read(&store);
            assert_eq!(ids, ["a", "b"], "{length}");
            assert_eq!((damaged.len(), damaged[0].line, damaged[0].is_torn), (1, 3, true));
        }
        // A digit that is another one.
        let mut altered = whole.clone();
        let digit = whole.windows(8).position(|w| w == b"\"code\":0").unwrap() + 7;
        altered[digit] = b'3';
        std::fs::write(&file, altered).unwrap();
        let (ids, damaged) = read(&store);
        assert_eq!(
            (ids, damaged[0].line, damaged[0].is_torn),
            (vec!["b".into(), "c".into()], 1, false)
        );
    }
}
