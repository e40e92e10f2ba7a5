//! Results on disk. Every process appends to a file of its own, a line a result with its checksum at the end, one write
//! and one sync each. A process that is killed leaves at most one line torn, the last, which is dropped when it is read.

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

/// The folder of the parts.
const PARTS: &str = "parts";
/// Bytes of a checksum.
const CHECKSUM: usize = 8;

/// What is said of a result besides: it is not compared.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct About {
    /// Wall time of the fit, s.
    pub wall_seconds: f64,
    /// Where it was computed.
    pub host: String,
    /// When it was done, s since 1970.
    pub finished: f64,
}

/// A result as it was stored.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Record {
    pub id: String,
    /// The [outcome](Outcome) as it was written.
    pub result: String,
    pub about: About,
    /// Where it stands, for messages.
    pub file: PathBuf,
    pub line: u64,
}

/// A line of a part that is not whole: torn, as the last of a process that was killed, or damaged.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Broken {
    pub file: PathBuf,
    pub line: u64,
    /// Whether it is the last, without an end.
    pub torn: bool,
}

/// Where a process stores its results.
#[derive(Debug)]
pub struct Store {
    folder: PathBuf,
    host: String,
    /// Made with the first result.
    part: Mutex<Option<File>>,
}

impl Store {
    /// The store of a plan's folder.
    pub fn new(folder: &Path) -> Self {
        Self { folder: folder.join(PARTS), host: host(), part: Mutex::new(None) }
    }

    /// Appends a result. When this returns it is on disk.
    ///
    /// # Errors
    ///
    /// What the system says of the file.
    pub fn add(&self, id: &str, outcome: &Outcome, wall_seconds: f64) -> Result<(), Error> {
        let about = About { wall_seconds, host: self.host.clone(), finished: now().as_secs_f64() };
        let about = serde_json::to_string(&about).unwrap_or_default();
        let line = format!("{{\"id\":\"{id}\",\"result\":{},\"about\":{about}", outcome.json);
        let line = format!("{line},\"checksum\":\"{}\"}}\n", hash(line.as_bytes(), CHECKSUM));
        let mut part = self.part.lock().unwrap_or_else(PoisonError::into_inner);
        let mut file = match part.take() {
            Some(file) => file,
            None => self.begin().map_err(|source| Error::io(&self.folder, source))?,
        };
        // After a failure the next result begins another part, so that only last lines are ever torn.
        let written = file.write_all(line.as_bytes()).and_then(|()| file.sync_data());
        written.map_err(|source| Error::io(&self.folder, source))?;
        *part = Some(file);
        Ok(())
    }

    /// A part of this process's own.
    fn begin(&self) -> io::Result<File> {
        std::fs::create_dir_all(&self.folder)?;
        loop {
            let name = format!("{}-{}-{}.jsonl", self.host, std::process::id(), now().as_nanos());
            match OpenOptions::new().append(true).create_new(true).open(self.folder.join(name)) {
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                opened => {
                    // Its name is on disk too; where folders cannot be synced they need not be.
                    let _ = File::open(&self.folder).and_then(|folder| folder.sync_all());
                    return opened;
                }
            }
        }
    }

    /// Reads all that is stored, and says which lines are not whole.
    pub(crate) fn read(&self, mut each: impl FnMut(Record)) -> Result<Vec<Broken>, Error> {
        let mut broken = Vec::new();
        let entries = match std::fs::read_dir(&self.folder) {
            Ok(entries) => entries,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(broken),
            Err(error) => return Err(Error::io(&self.folder, error)),
        };
        let files: Result<Vec<PathBuf>, _> = entries.map(|entry| Ok(entry?.path())).collect();
        let mut files = files.map_err(|error| Error::io(&self.folder, error))?;
        files.retain(|file| file.extension().is_some_and(|extension| extension == "jsonl"));
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
                    match record(&line, &file, number) {
                        Some(record) => each(record),
                        None => {
                            let torn = line.last() != Some(&b'\n');
                            broken.push(Broken { file: file.clone(), line: number, torn });
                        }
                    }
                }
                Ok(())
            };
            read().map_err(|error| Error::io(&file, error))?;
        }
        Ok(broken)
    }
}

/// What a line says, if it is whole.
fn record(line: &[u8], file: &Path, number: u64) -> Option<Record> {
    let line = std::str::from_utf8(line).ok()?.strip_suffix("\"}\n")?;
    let (line, checksum) = line.rsplit_once(",\"checksum\":\"")?;
    if checksum != hash(line.as_bytes(), CHECKSUM) {
        return None;
    }
    let (id, rest) = line.strip_prefix("{\"id\":\"")?.split_once("\",\"result\":")?;
    let (result, about) = rest.rsplit_once(",\"about\":")?;
    let about = serde_json::from_str(about).ok()?;
    Some(Record {
        id: id.into(),
        result: with_current_names(result),
        about,
        file: file.into(),
        line: number,
    })
}

fn now() -> std::time::Duration {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default()
}

/// The machine's name, as far as file names take it.
fn host() -> String {
    let of_system = || std::fs::read_to_string("/proc/sys/kernel/hostname").ok();
    let variable = |name: &str| std::env::var(name).ok();
    let name = variable("SLURMD_NODENAME").or_else(of_system).or_else(|| variable("HOSTNAME"));
    let name = name.or_else(|| variable("COMPUTERNAME")).unwrap_or_default();
    let plain = |c: char| if c.is_ascii_alphanumeric() || ".-_".contains(c) { c } else { '_' };
    let name: String = name.trim().chars().take(60).map(plain).collect();
    if name.is_empty() { "host".into() } else { name }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(store: &Store) -> (Vec<String>, Vec<Broken>) {
        let mut ids = Vec::new();
        let broken = store.read(|record| ids.push(record.id)).unwrap();
        (ids, broken)
    }

    #[test]
    fn what_is_not_whole_is_dropped() {
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
            let (ids, broken) = read(&store);
            assert_eq!(ids, ["a", "b"], "{length}");
            assert_eq!((broken.len(), broken[0].line, broken[0].torn), (1, 3, true));
        }
        // A digit that is another one.
        let mut damaged = whole.clone();
        let digit = whole.windows(8).position(|w| w == b"\"code\":0").unwrap() + 7;
        damaged[digit] = b'3';
        std::fs::write(&file, damaged).unwrap();
        let (ids, broken) = read(&store);
        assert_eq!((ids, broken[0].line, broken[0].torn), (vec!["b".into(), "c".into()], 1, false));
    }
}
