//! What a user sees: results on standard output; progress, warnings and errors on standard error.
//!
//! Nothing here panics. Whoever closes the pipe that standard output goes to (`rodfit fit .. | head -1`) has read
//! enough: what is left of it is dropped without a word, all other outputs are written, and the exit code is that of
//! the computation. A standard output that cannot be written, on a full disk, is an error.
//!
//! Control characters of names and of quoted lines are shown as `\x1b`: files from elsewhere have no say in what a
//! terminal shows.

use crate::command::Manner;
use crate::command::style::Stream;
use indicatif::{ProgressBar, ProgressState, ProgressStyle};
use rodfit::summary::{Summary, duration, wrap_message};
use rodfit::{Code, Error, printable};
use std::fmt::Display;
use std::io::{ErrorKind, IsTerminal, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Prints a text as it is, such as a script or a part of a file.
pub fn print(text: &impl Display) -> Result<(), Error> {
    print_line(&printable(&text.to_string()))
}

/// Prints a result in the width and the color of standard output.
pub fn print_summary(summary: &Summary) -> Result<(), Error> {
    print_line(&summary.render(Stream::Output.style()))
}

fn print_line(text: &str) -> Result<(), Error> {
    let mut stdout = std::io::stdout().lock();
    unless_closed(writeln!(stdout, "{text}").and_then(|()| stdout.flush())).map_err(stdout_error)
}

/// Writes a piece of a result on standard output, and returns how much of it was written. Control characters are escaped
/// where a person reads it; programs get every byte unchanged.
pub fn write_data(bytes: &[u8]) -> std::io::Result<usize> {
    let mut stdout = std::io::stdout();
    if !stdout.is_terminal() {
        return stdout.write(bytes);
    }
    let text = String::from_utf8_lossy(bytes);
    stdout.write_all(printable(&text).as_bytes()).map(|()| bytes.len())
}

/// A closed pipe is no error.
pub fn unless_closed(written: std::io::Result<()>) -> std::io::Result<()> {
    match written {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        written => written,
    }
}

/// What the system said of standard output.
pub fn stdout_error(source: std::io::Error) -> Error {
    Error::Io { named_in: None, path: "standard output".into(), source }
}

/// Prints a message on standard error, in lines of its width. A failure is ignored: there is no place to report it.
pub fn tell(text: impl Display) {
    let text = wrap_message(&printable(&text.to_string()), Stream::Error.style());
    let _ = writeln!(std::io::stderr(), "{text}");
}

/// Prints a warning.
pub fn warn(code: Code, words: impl Display) {
    tell(format_args!("warning: {words} [{code}]"));
}

/// Prints an error.
pub fn complain(error: &Error) {
    match error.code() {
        Some(code) => tell(format_args!("error: {error} [{code}]")),
        None => tell(format_args!("error: {error}")),
    }
}

/// A flag that Ctrl-C sets, and the signal by which schedulers and containers end a process. A second one ends
/// it at once.
pub fn stop_on_ctrl_c(manner: Manner) -> Arc<AtomicBool> {
    let flag = Arc::new(AtomicBool::new(false));
    let seen = flag.clone();
    let handler = ctrlc::set_handler(move || {
        if seen.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
        if !manner.quiet {
            tell("\nstopping; Ctrl-C again ends at once");
        }
    });
    if let Err(error) = handler {
        warn(
            Code::NoCtrlC,
            format_args!(
                "Ctrl-C cannot be caught ({error}). It ends the run without results. Let \
                                          the run finish"
            ),
        );
    }
    flag
}

/// Ends the process with exit code 0 if it still runs so long after `stop` was set. For runs whose results are on disk
/// as soon as they are there.
pub fn end_after_stop(stop: &Arc<AtomicBool>, patience: Duration) {
    /// How often the flag is looked at.
    const INTERVAL: Duration = Duration::from_millis(50);
    let stop = stop.clone();
    std::thread::spawn(move || {
        while !stop.load(Ordering::Relaxed) {
            std::thread::sleep(INTERVAL);
        }
        std::thread::sleep(patience);
        tell("stopped before the running fits were complete; the next run computes them again");
        std::process::exit(0);
    });
}

/// A bar of so many steps, with the remaining time.
pub fn progress_bar(manner: Manner, steps: u64) -> ProgressBar {
    if manner.quiet {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template("{bar:40} {pos}/{len}, {remaining} remaining");
    let style = style.unwrap_or_else(|_| ProgressStyle::default_bar());
    let remaining = |state: &ProgressState, text: &mut dyn std::fmt::Write| {
        // The bar is drawn without it where it cannot be written.
        let _ = text.write_str(&duration(state.eta().as_secs_f64().round()));
    };
    ProgressBar::new(steps).with_style(style.with_key("remaining", remaining))
}

/// For work of unknown length.
pub fn spinner(manner: Manner) -> ProgressBar {
    if manner.quiet { ProgressBar::hidden() } else { ProgressBar::new_spinner() }
}
