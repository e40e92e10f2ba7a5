//! Mutated files are read or rejected without a panic, within seconds and with bounded memory. The targets are those of
//! `fuzz/`; their corpus is mutated here.

#[path = "../../fuzz/mutate.rs"]
mod mutate;
#[path = "../../fuzz/targets.rs"]
mod targets;

use mutate::{Random, mutated};
use rodfit::fit::Format;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use targets::{TARGETS, Target, corpus};

/// Longest accepted time for one file.
const LONGEST: Duration = Duration::from_secs(5);
/// How often a file that took longer is tried again.
const RETRIES: usize = 3;

/// Folder of the scenes and of the data to which scenes and fits refer.
fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("data")
}

/// A temporary folder, in memory where `/dev/shm` exists: files are written and read by the million.
fn scratch() -> tempfile::TempDir {
    let memory = Path::new("/dev/shm");
    let made = if memory.is_dir() { tempfile::tempdir_in(memory) } else { tempfile::tempdir() };
    made.or_else(|_| tempfile::tempdir()).unwrap()
}

/// Reads mutated files of a target until `goes_on` (given their count) is false. Returns the numbers of files and of accepted
/// files.
fn taken(
    (name, target): (&str, Target),
    seed: u64,
    mut goes_on: impl FnMut(usize) -> bool,
) -> (usize, usize) {
    let scratch = scratch();
    let (folder, place) = (folder(), scratch.path().join("file"));
    let files: Vec<Vec<u8>> = corpus(name).into_iter().map(|(_, bytes)| bytes).collect();
    let mut random = Random(seed);
    let (mut count, mut accepted) = (0, 0);
    while goes_on(count) {
        let bytes = mutated(&mut random, &files);
        let take = || {
            let since = Instant::now();
            let found = catch_unwind(AssertUnwindSafe(|| target.take(&bytes, &folder, &place)));
            (found, since.elapsed())
        };
        let (found, mut time) = take();
        // On a busy machine a process may wait for many seconds; a file that hangs does so every time.
        for _ in 0..RETRIES {
            if time > LONGEST {
                time = take().1;
            }
        }
        let (file, text) = (format!("{name} {seed} {count}"), String::from_utf8_lossy(&bytes));
        match found {
            Ok(found) => accepted += usize::from(found),
            Err(_) => panic!("panicked at {file}: {text}"),
        }
        assert!(time < LONGEST, "{file} took {time:?}: {text}");
        count += 1;
    }
    (count, accepted)
}

#[test]
fn file_of_the_corpus_is_accepted() {
    let scratch = scratch();
    for (name, target) in TARGETS {
        for (path, bytes) in corpus(name) {
            let accepted = target.take(&bytes, &folder(), &scratch.path().join("file"));
            assert!(accepted, "{}", path.display());
        }
    }
}

/// A mesh that the program chooses is one that can be made.
#[test]
fn shape_of_a_billion_turns_is_rejected() {
    let text = std::fs::read_to_string(folder().join("cantilever.toml")).unwrap();
    let shape = text.lines().find(|line| line.starts_with("shape")).unwrap();
    let arc = "shape = { kind = \"arc\", length = 0.5, angle = 1e12 }";
    let text = text.replace("segments = 50\n", "").replace(shape, arc);
    let error = rodfit::Scene::from_toml(&text, folder()).and_then(|s| s.problem().map(drop));
    let error = error.unwrap_err().to_string();
    assert!(error.contains("rod.segments") && error.contains("a number, or no value"), "{error}");
}

/// Some of these times the eight edges of a span are nought again.
#[test]
fn number_of_held_markers_beyond_range_is_rejected() {
    let text =
        std::fs::read_to_string(folder().join("../fuzz/corpus/scene/recorded.toml")).unwrap();
    for held in [(1 << 61) + 1, (1 << 62) + 1, i64::MAX] {
        let text = text.replace("held = 1", &format!("held = {held}"));
        let error = rodfit::Scene::from_toml(&text, folder()).and_then(|s| s.problem().map(drop));
        let error = error.unwrap_err().to_string();
        assert!(error.contains("supports.path.held") && error.contains("fewer"), "{error}");
    }
}

/// Files with 25 000 markers are read within 10 s (twice [`LONGEST`]); a reader of quadratic time would exceed it.
#[test]
fn file_with_many_columns_is_read_in_linear_time() {
    const MARKERS: usize = 25_000;
    let each = |of: &dyn Fn(usize) -> String| (0..MARKERS).map(of).collect::<String>();
    let scratch = scratch();
    let all = |text: &str| text.repeat(MARKERS);
    let wide = [
        (Format::Csv, format!("t{}\n0{}\n", each(&|k| format!(",x{k},y{k}")), all(",1,2"))),
        (
            Format::Tracker,
            format!("{}\nt{}\n0{}\n", each(&|k| format!(",m{k},")), all(",x,y"), all(",1,2")),
        ),
        (
            Format::Dltdv,
            format!("{}z\n{}0\n", each(&|k| format!("pt{k}_X,pt{k}_Y,")), all("1,2,"))
                .replace(",z\n", "\n")
                .replace("2,0\n", "2\n"),
        ),
        (
            Format::Qualisys,
            format!(
                "NO_OF_FRAMES\t1\nFREQUENCY\t9\nMARKER_NAMES{}\nTRAJECTORY_TYPES\n1{}\n",
                each(&|k| format!("\tm{k}")),
                all("\t2\t3\t4")
            ),
        ),
        (
            Format::Trc,
            format!(
                "PathFileType\t4\nUnits\nmm\nFrame#\tTime{}\n1\t0{}\n",
                each(&|k| format!("\tm{k}\t\t")),
                all("\t2\t3\t4")
            ),
        ),
        (
            Format::Sto,
            format!(
                "endheader\ntime{}\n0{}\n",
                each(&|k| format!("\tm{k}_X\tm{k}_Y")),
                all("\t1\t2")
            ),
        ),
    ];
    for (format, text) in wide {
        let since = Instant::now();
        let place = scratch.path().join("file");
        let accepted = Target::Markers(format).take(text.as_bytes(), &folder(), &place);
        println!("{format:?}: {MARKERS} markers in {:?}", since.elapsed());
        assert!(accepted && since.elapsed() < 2 * LONGEST, "{format:?}");
    }
}

#[test]
fn mutated_file_is_read_or_rejected_without_panic() {
    for (name, target) in TARGETS {
        let most = if matches!(target, Target::Markers(_)) { 600 } else { 300 };
        let (count, accepted) = taken((name, target), 1, |count| count < most);
        println!("{name:12} {accepted} of {count} accepted");
        // Neither all nor none: what is changed matters, and what is not still is a file.
        assert!(accepted > count / 50 && accepted < count, "{name}: {accepted} of {count}");
    }
}

/// As many as one likes: `FUZZ_FILES=100000 FUZZ_SEED=7 cargo test --release --test library millions -- --ignored --nocapture`,
/// with `FUZZ_TARGET=vicon` for one target only.
#[test]
#[ignore = "as many as one likes"]
fn millions_of_mutated_files() {
    let said = |name: &str| std::env::var(name).ok();
    let number = |name: &str, or: u64| said(name).and_then(|n| n.parse().ok()).unwrap_or(or);
    let (files, seed) = (number("FUZZ_FILES", 1000) as usize, number("FUZZ_SEED", 1));
    let only = said("FUZZ_TARGET");
    for (name, target) in TARGETS {
        if only.as_ref().is_some_and(|only| only != name) {
            continue;
        }
        let since = Instant::now();
        let (count, accepted) = taken((name, target), seed, |count| count < files);
        let memory = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
        let memory = memory.lines().find(|line| line.starts_with("VmHWM")).unwrap_or_default();
        println!(
            "{name:12} {count} files, {accepted} accepted, {:.0} a second, {memory}",
            count as f64 / since.elapsed().as_secs_f64()
        );
    }
}
