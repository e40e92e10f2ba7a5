//! Results on standard output; progress, warnings and errors on standard error; stop of a run by Ctrl-C or the signal
//! TERM.
//!
//! Input is a text, a [`Summary`], an error or data. If the reader of standard output closes the pipe
//! (`rodfit fit .. | head -1`), the rest of the text is dropped without an error. A standard output that cannot be
//! written for another reason, such as a full disk, is an error. Failed writes on standard error are ignored.
//!
//! Control characters in messages, and in data on a terminal, are shown as `\x1b`, so that a file cannot control the
//! terminal; line breaks and tabs stay. Data that another program reads from standard output are not changed.
//!
//! [`stop_on_ctrl_c`] returns a flag that the first signal sets and that a run reads; a second signal ends the process
//! at once with exit code 130. [`end_after_stop`] ends the process some time after the flag was set. Progress bars and
//! spinners are hidden with `--quiet`.
//!
//! On standard output `print` prints a text, `print_summary` a result in the width and the colors of the terminal, and
//! `write_data` a part of data; for the last one a closed pipe is an error. `unless_closed` turns the error of a closed
//! pipe into `Ok`, `stdout_error` adds the name of standard output to an error. On standard error `print_note`, `warn`
//! (with a code) and `print_error` print messages; `progress_bar` and `spinner` show progress.

use crate::command::GlobalOptions;
use crate::command::style::Stream;
use indicatif::{ProgressBar, ProgressState, ProgressStyle};
use rodfit::summary::{Summary, duration, wrap_message};
use rodfit::{Code, Error, printable};
use std::fmt::Display;
use std::io::{ErrorKind, IsTerminal, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Prints a text and a line break on standard output, with control characters escaped, without wrapping its lines. A
/// closed pipe is no error.
pub fn print(text: &impl Display) -> Result<(), Error> {
    print_line(&printable(&text.to_string()))
}

/// Prints a result on standard output, wrapped to its width and colored if it is a terminal with colors
/// ([`Stream::style`]). A closed pipe is no error.
pub fn print_summary(summary: &Summary) -> Result<(), Error> {
    print_line(&summary.render(Stream::Output.style()))
}

/// Prints a text without changes, and a line break, on standard output, and flushes it. A closed pipe is no error.
fn print_line(text: &str) -> Result<(), Error> {
    let mut stdout = std::io::stdout().lock();
    unless_closed(writeln!(stdout, "{text}").and_then(|()| stdout.flush())).map_err(stdout_error)
}

/// Writes a part of a result on standard output, and returns the number of bytes of `bytes` that were written: all of
/// them on a terminal, where control characters are escaped. Programs get the bytes unchanged. A closed pipe is an
/// error here.
pub fn write_data(bytes: &[u8]) -> std::io::Result<usize> {
    let mut stdout = std::io::stdout();
    // Another program reads the data.
    if !stdout.is_terminal() {
        return stdout.write(bytes);
    }
    let text = String::from_utf8_lossy(bytes);
    stdout.write_all(printable(&text).as_bytes()).map(|()| bytes.len())
}

/// The outcome of a write; a closed pipe (`BrokenPipe`) becomes `Ok`. Other errors stay.
pub fn unless_closed(written: std::io::Result<()>) -> std::io::Result<()> {
    match written {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        written => written,
    }
}

/// The error of a failed write on standard output, with `standard output` in the place of the path.
pub fn stdout_error(source: std::io::Error) -> Error {
    Error::Io { named_in: None, path: "standard output".into(), source }
}

/// Prints a message on standard error, wrapped to its width, with control characters escaped. A failure is ignored.
pub fn print_note(text: impl Display) {
    let text = wrap_message(&printable(&text.to_string()), Stream::Error.style());
    let _ = writeln!(std::io::stderr(), "{text}");
}

/// Prints `warning: `, the text and the code in brackets on standard error.
pub fn warn(code: Code, text: impl Display) {
    print_note(format_args!("warning: {text} [{code}]"));
}

/// Prints `error: ` and the error on standard error, with its code in brackets if it has one.
pub fn print_error(error: &Error) {
    match error.code() {
        Some(code) => print_note(format_args!("error: {error} [{code}]")),
        None => print_note(format_args!("error: {error}")),
    }
}

/// A flag that is set by Ctrl-C and by the signal TERM, by which schedulers and containers end a process. A note is
/// printed unless `--quiet`. A second signal ends the process at once with exit code 130. If Ctrl-C cannot be caught, a
/// warning is printed and the flag is never set.
pub fn stop_on_ctrl_c(global: GlobalOptions) -> Arc<AtomicBool> {
    let flag = Arc::new(AtomicBool::new(false));
    let shared = flag.clone();
    // The handler runs on a thread of its own.
    let handler = ctrlc::set_handler(move || {
        if shared.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
        if !global.quiet {
            print_note("\nstopping; Ctrl-C again ends at once");
        }
    });
    if let Err(error) = handler {
        let text = "It ends the run without results. Let the run finish";
        warn(Code::NoCtrlC, format_args!("Ctrl-C cannot be caught ({error}). {text}"));
    }
    flag
}

/// Starts a thread that ends the process, with a note and exit code 0, if it still runs `delay` after `stop` was set:
/// for runs that store each result at once.
pub fn end_after_stop(stop: &Arc<AtomicBool>, delay: Duration) {
    /// Time between two reads of the flag.
    const INTERVAL: Duration = Duration::from_millis(50);
    let stop = stop.clone();
    std::thread::spawn(move || {
        while !stop.load(Ordering::Relaxed) {
            std::thread::sleep(INTERVAL);
        }
        std::thread::sleep(delay);
        print_note(
            "stopped before the running fits were complete; the next run computes them again",
        );
        std::process::exit(0);
    });
}

/// A progress bar on standard error for this number of steps, with the estimated remaining time; hidden with `--quiet`.
pub fn progress_bar(global: GlobalOptions, steps: u64) -> ProgressBar {
    if global.quiet {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template("{bar:40} {pos}/{len}, {remaining} remaining");
    let style = style.unwrap_or_else(|_| ProgressStyle::default_bar());
    let remaining = |state: &ProgressState, text: &mut dyn std::fmt::Write| {
        // Without the time if it cannot be written.
        let _ = text.write_str(&duration(state.eta().as_secs_f64().round()));
    };
    ProgressBar::new(steps).with_style(style.with_key("remaining", remaining))
}

/// A spinner on standard error for work of unknown length; hidden with `--quiet`.
pub fn spinner(global: GlobalOptions) -> ProgressBar {
    if global.quiet { ProgressBar::hidden() } else { ProgressBar::new_spinner() }
}
