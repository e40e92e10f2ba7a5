//! Invalid and hostile input of the command: every case here and in `hostile_fits` and `hostile_scenes` ends within
//! seconds, with the exit code and a message that names the fault, and without a panic. Runs above the limits of
//! memory, time and disk are rejected.

use rayon::prelude::*;
use std::fmt::Write;
use std::process::Output;
use std::time::{Duration, Instant};

use crate::folder::{FIT, Folder, SCENE, refused, replaced, stderr, succeeds};

/// Longest accepted time of a command, on a busy machine.
const PATIENCE: Duration = Duration::from_secs(60);

/// A command line with its files, and the expected exit code and message.
pub struct Case {
    name: String,
    /// Written beside the scene, the fit file and the data, or instead of them.
    files: Vec<(&'static str, Vec<u8>)>,
    arguments: Vec<String>,
    code: i32,
    words: Vec<&'static str>,
}

impl Case {
    /// A run of the command with the expected exit code and the words expected in its output.
    pub fn new(
        name: impl Into<String>,
        arguments: &[&str],
        code: i32,
        words: &[&'static str],
    ) -> Self {
        let arguments = arguments.iter().map(|a| a.to_string()).collect();
        Self { name: name.into(), files: Vec::new(), arguments, code, words: words.to_vec() }
    }
    /// Adds a file with this content to the folder of the run.
    pub fn with(mut self, name: &'static str, content: impl Into<Vec<u8>>) -> Self {
        self.files.push((name, content.into()));
        self
    }

    /// The difference between the actual and the expected result; none if they agree.
    pub fn fault(&self) -> Option<String> {
        let folder = Folder::new();
        for (name, content) in &self.files {
            std::fs::write(folder.path(name), content).unwrap();
        }
        let arguments: Vec<&str> = self.arguments.iter().map(String::as_str).collect();
        let start = Instant::now();
        let output = match within(PATIENCE, &folder, &arguments) {
            Some(output) => output,
            None => return Some(format!("{}: no answer in {PATIENCE:?}", self.name)),
        };
        let (message, took) = (stderr(&output), start.elapsed());
        let mut faults = String::new();
        if output.status.code() != Some(self.code) {
            write!(faults, " {} instead of {}", output.status, self.code).unwrap();
        }
        for word in self.words.iter().filter(|word| !message.contains(**word)) {
            write!(faults, " no `{word}`").unwrap();
        }
        if message.len() > 5000 {
            write!(faults, " {} bytes of message", message.len()).unwrap();
        }
        if self.code != 0 && !arguments.is_empty() && !message.contains("error: ") {
            faults += " no error";
        }
        let shown: String = message.chars().take(600).collect();
        (!faults.is_empty()).then(|| format!("{}, {took:.1?}:{faults}\n    {shown}", self.name))
    }
}

/// Runs the command, and ends it if it takes too long.
fn within(time: Duration, folder: &Folder, arguments: &[&str]) -> Option<Output> {
    let mut command = folder.command(arguments);
    // Into files, as nobody reads pipes while it runs.
    let file = |name: &str| std::fs::File::create(folder.path(name)).unwrap();
    let mut child = command.stdout(file("stdout")).stderr(file("stderr")).spawn().unwrap();
    let start = Instant::now();
    let status = loop {
        match child.try_wait().unwrap() {
            Some(status) => break status,
            None if start.elapsed() > time => {
                child.kill().unwrap();
                child.wait().unwrap();
                return None;
            }
            None => std::thread::sleep(Duration::from_millis(5)),
        }
    };
    let read = |name: &str| std::fs::read(folder.path(name)).unwrap();
    Some(Output { status, stdout: read("stdout"), stderr: read("stderr") })
}

/// Runs all cases in parallel and fails with the list of faults. There must be at least `least` cases.
pub fn all_are_answered(cases: Vec<Case>, least: usize) {
    assert!(cases.len() >= least, "{} cases", cases.len());
    let faults: Vec<String> = cases.par_iter().filter_map(Case::fault).collect();
    assert!(faults.is_empty(), "{} of {}:\n{}", faults.len(), cases.len(), faults.join("\n"));
}

#[test]
fn hostile_command_lines_are_rejected() {
    let name = "x".repeat(4000);
    let long = ["simulate", &name];
    let cases: Vec<(&[&str], i32, &[&'static str])> = vec![
        (&[], 2, &["Usage"]),
        (&["simulat", "scene.toml"], 2, &["simulat"]),
        (&["simulate"], 2, &["SCENE"]),
        (&["simulate", "scene.toml", "scene.toml"], 2, &["scene.toml"]),
        (&["simulate", "scene.toml", "--fast"], 2, &["--fast"]),
        (&["simulate", "scene.toml", "--json"], 2, &["--json"]),
        (&["simulate", "scene.toml", "--derivatives", "auto"], 2, &["auto", "hand", "dual"]),
        (&["modes", "scene.toml", "--count", "-1"], 2, &["-1"]),
        (&["modes", "scene.toml", "--count", "201"], 2, &["201"]),
        (&["modes", "scene.toml", "--count", "ten"], 2, &["ten"]),
        (&["simulate", ""], 2, &["SCENE"]),
        (&["simulate", "-"], 2, &["-: ", "No such file"]),
        (&["simulate", "."], 2, &["regular file"]),
        (&["simulate", "scene.toml/"], 2, &["scene.toml/"]),
        (&["simulate", "no\nsuch\nfile"], 2, &["No such file"]),
        (&["simulate", "/dev/null"], 2, &["/dev/null", "regular file"]),
        (&["simulate", "/dev/zero"], 2, &["/dev/zero", "regular file"]),
        (&["simulate", "tip.csv"], 2, &["tip.csv", "line 1"]),
        (&["simulate", "fit.toml"], 2, &["fit.toml"]),
        (&long, 2, &["too long"]),
        (&["static", "fit.toml"], 2, &["fit.toml"]),
        (&["modes", "absent.toml"], 2, &["absent.toml", "No such file"]),
        (&["check", "tip.csv"], 2, &["tip.csv"]),
        (&["study", "/dev/zero"], 2, &["/dev/zero"]),
        (&["fit", "scene.toml"], 2, &["scene.toml"]),
        (&["fit", "tip.csv"], 2, &["tip.csv", "line 1"]),
        (&["fit", "."], 2, &["regular file"]),
        (&["fit", "/dev/zero"], 2, &["/dev/zero"]),
        // Nothing comes through this pipe, and it ends.
        (&["simulate", "/dev/stdin"], 2, &["/dev/stdin"]),
    ];
    let case = |(arguments, code, words): &(&[&str], i32, &[&'static str])| {
        Case::new(format!("{arguments:.60?}"), arguments, *code, words)
    };
    all_are_answered(cases.iter().map(case).collect(), 25);
}

/// Runs that would need all memory, hours or years are rejected, with the estimate and the limit.
#[test]
fn runs_above_limits_are_rejected() {
    let fine = |n: u32| replaced(SCENE, "segments = 20", &format!("segments = {n}"));
    let in_space = |n: u32| format!("segments = {n}\ndimension = \"spatial\"");
    let in_space = |n: u32| replaced(SCENE, "segments = 20", &in_space(n));
    let step = |step: &str| replaced(SCENE, "step = 2e-3", &format!("step = {step}"));
    let memory: &[&'static str] =
        &["rod.segments", "nodes", "GB of memory", "up to 4.0 GB", "--no-limits"];
    let time: &[&'static str] = &["time.step", "steps of 21 nodes", "up to 60 min", "--no-limits"];
    let at = |text: String, arguments: &[&str], words: &[&'static str]| {
        Case::new(format!("{arguments:?}"), arguments, 2, words).with("scene.toml", text)
    };
    let experiment = |i: usize| format!("[[experiment]]\nname = \"{i}\"\nscene = \"scene.toml\"\n");
    let many: String = (0..2_000).map(experiment).collect();
    let parameter = "[[parameter]]\nname = \"youngs_modulus\"\n";
    let named = |name: &str| replaced(&experiment(0), "\"0\"", &format!("\"{name}\""));
    let experiments = |text: &str, words: &[&'static str]| {
        Case::new("experiments", &["fit", "fit.toml"], 2, words)
            .with("fit.toml", format!("{text}{parameter}"))
    };
    let mut cases = vec![
        at(fine(10_000_000), &["simulate", "scene.toml"], memory),
        at(fine(10_000_000), &["static", "scene.toml"], memory),
        at(fine(10_000_000), &["modes", "scene.toml"], memory),
        at(fine(10_000_000), &["check", "scene.toml"], memory),
        at(fine(10_000_000), &["study", "scene.toml"], &["GB of memory", "--no-limits"]),
        at(fine(10_000_000), &["fit", "fit.toml"], memory),
        at(fine(1_000_000), &["modes", "scene.toml", "--count", "200"], memory),
        at(in_space(3_000_000), &["simulate", "scene.toml"], memory),
        at(in_space(2_000_000), &["static", "scene.toml"], memory),
        at(step("1e-9"), &["simulate", "scene.toml", "--json", "-"], &["GB", "--no-limits"]),
        at(step("1e-8"), &["fit", "fit.toml"], &["fit.toml", "scene", "steps", "60 min"]),
        at(step("1e-7"), &["study", "scene.toml"], &["time.step", "--no-limits"]),
        at(replaced(&step("1e-6"), "end = 0.3", "end = 900"), &["simulate", "scene.toml"], time),
        at(
            replaced(&step("1e-4"), "end = 0.3", "end = 3000"),
            &["simulate", "scene.toml", "--out", "nodes.csv"],
            &["GB of disk", "up to 10.0 GB", "--no-limits"],
        ),
        experiments(&many, &["fit.toml", "experiment", "found 2000", "up to 1000"]),
        experiments(&named(&"n".repeat(101)), &["experiment[0].name", "up to 100 characters"]),
    ];
    let nodes: String = (0..2_000_000).map(|i| format!("{i},0,0.00000000000000\n")).collect();
    cases.push(
        at(
            replaced(
                SCENE,
                "segments = 20\nshape = {",
                "shape = { kind = \"polyline\", file = \"rest.csv\" } #",
            ),
            &["static", "scene.toml"],
            memory,
        )
        .with("rest.csv", format!("x,y,z\n{}", nodes.repeat(2))),
    );
    all_are_answered(cases, 15);
}

/// A pipe without a writer is rejected at once.
#[cfg(target_os = "linux")]
#[test]
fn pipe_without_writer_is_rejected() {
    let folder = Folder::new();
    let pipe = folder.path("pipe");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    folder.write("piped.toml", &replaced(FIT, "scene.toml", "pipe"));
    folder.write("data.toml", &replaced(FIT, "tip.csv", "pipe"));
    let runs = [
        ["simulate", "pipe"],
        ["static", "pipe"],
        ["fit", "pipe"],
        ["fit", "piped.toml"],
        ["fit", "data.toml"],
    ];
    for arguments in runs {
        let output = within(PATIENCE, &folder, &arguments).expect("an answer");
        refused(&output, &["pipe", "regular file", "/dev/stdin"]);
    }
    // What a shell hands over is read.
    let shell = |text: &str| {
        let line = format!("{text} | \"$0\" simulate /dev/stdin -q");
        let mut command = std::process::Command::new("sh");
        command.args(["-c", &line, env!("CARGO_BIN_EXE_rodfit")]).current_dir(folder.path(""));
        command.output().unwrap()
    };
    assert_eq!(shell("cat scene.toml").status.code(), Some(0));
    let output = shell("cat /dev/zero");
    refused(&output, &["/dev/stdin", "more than 100 MB"]);
}

/// A number of threads above the useful one is limited.
#[test]
fn excessive_thread_count_is_limited() {
    let folder = Folder::new();
    let mut command = folder.command(&["fit", "fit.toml"]);
    let output = command.env("RAYON_NUM_THREADS", "100000").output().unwrap();
    succeeds(&output);
    assert!(
        stderr(&output).contains("RAYON_NUM_THREADS = 100000; 256 threads"),
        "{}",
        stderr(&output)
    );
}
