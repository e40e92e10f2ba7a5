//! Shared parts of the command's tests: a scene, a fit of it, a temporary folder in which commands run, and functions that
//! read their output.

use serde_json::Value;
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};
use tempfile::TempDir;

pub const SCENE: &str = r#"
[rod]
segments = 20
shape = { kind = "straight", length = 0.5, direction = [1, 0, 0] }
section = { kind = "circle", radius = 0.005 }

[material]
density = 1273.52
youngs_modulus = 1e8
poisson_ratio = 0.5

[loads]
gravity = [0, -9.8, 0]

[time]
end = 0.3
step = 2e-3
beta = 0.5
"#;

pub const FIT: &str = r#"
scene = "scene.toml"

[[observation]]
file = "tip.csv"
point = "tip"

[[parameter]]
name = "youngs_modulus"
"#;

/// A text with a part replaced.
pub fn replaced(text: &str, from: &str, to: &str) -> String {
    assert!(text.contains(from), "{from}");
    text.replace(from, to)
}

/// The scene with a part replaced.
pub fn change(from: &str, to: &str) -> String {
    replaced(SCENE, from, to)
}

/// The scene with its rod given by the points in rest.csv.
pub fn polyline() -> String {
    let straight = "kind = \"straight\", length = 0.5, direction = [1, 0, 0]";
    replaced(&change("segments = 20", ""), straight, "kind = \"polyline\", file = \"rest.csv\"")
}

/// A folder with a scene, a fit file and data.
pub struct Folder(TempDir);

impl Folder {
    /// A temporary folder with a scene, a fit file and 30 rows of data, which the model need not describe well.
    pub fn new() -> Self {
        let folder = Self(TempDir::new().unwrap());
        folder.write("scene.toml", SCENE);
        folder.write("fit.toml", FIT);
        // Free fall for a while, then whatever: a fit need not be good to be possible.
        let rows = (0..30)
            .map(|k| f64::from(k) * 0.01)
            .map(|t| format!("{t},{},{}\n", 0.5 - 2.0 * t * t * t, -2.0 * t * t));
        folder.write("tip.csv", &format!("t,x,y\n{}", rows.collect::<String>()));
        folder
    }
    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }
    pub fn write(&self, name: &str, text: &str) {
        std::fs::write(self.path(name), text).unwrap();
    }
    /// Runs the command with these arguments in the folder.
    pub fn run(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().unwrap()
    }
    /// The command with its output caught, not yet run.
    pub fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_rodfit"));
        command.args(arguments).current_dir(self.0.path());
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        command
    }
    /// Runs the command in a shell after `before`, such as a limit.
    pub fn run_after(&self, before: &str, arguments: &[&str]) -> Output {
        Command::new("sh")
            .args(["-c", &format!("{before}; exec \"$0\" \"$@\""), env!("CARGO_BIN_EXE_rodfit")])
            .args(arguments)
            .current_dir(self.0.path())
            .output()
            .unwrap()
    }
    pub fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).unwrap()
    }
    /// The names of all files.
    pub fn files(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.path("")).unwrap();
        entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect()
    }
    pub fn json(&self, name: &str) -> Value {
        serde_json::from_str(&self.read(name)).unwrap()
    }
}

/// Standard error; the lines that a message is wrapped into are joined again.
pub fn stderr(output: &Output) -> String {
    unwrapped(&String::from_utf8_lossy(&output.stderr))
}

/// A text whose continued messages are on one line each. Lines that quote a file begin with `|`.
pub fn unwrapped(text: &str) -> String {
    let mut whole = String::new();
    for line in text.split_inclusive('\n') {
        match line.strip_prefix("  ").filter(|rest| !rest.starts_with([' ', '|'])) {
            Some(rest) if whole.ends_with('\n') => {
                whole.pop();
                whole.push(' ');
                whole.push_str(rest);
            }
            _ => whole.push_str(line),
        }
    }
    whole
}

/// The first paragraph of a text on one line: the status of a summary.
pub fn status(text: &str) -> String {
    words(text.split("\n\n").next().unwrap())
}

/// A text with one space between its words, however it is wrapped.
pub fn words(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

pub fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

/// Expects exit code 0.
#[track_caller]
pub fn succeeds(output: &Output) {
    assert_eq!(output.status.code(), Some(0), "{}", stderr(output));
}

/// Expects exit code 2 and one message with all of `words`.
#[track_caller]
pub fn refused(output: &Output, words: &[&str]) {
    let message = stderr(output);
    assert_eq!(output.status.code(), Some(2), "{message}");
    for word in words {
        assert!(message.contains(word), "`{word}` in: {message}");
    }
    assert_eq!(message.matches("error: ").count(), 1, "{message}");
}
