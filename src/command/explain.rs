//! `rodfit explain`: prints the entry of a code (of a grade, a warning, an end reason) or of an exit code.
//!
//! The entries are the documents in `docs/codes/`, compiled into the program. Former names of codes are accepted;
//! case and brackets are ignored. An unknown code is an error that names the most similar one (Jaro-Winkler
//! similarity). Without a code all codes are listed, one line each.

use crate::command::style::Stream;
use crate::command::terminal;
use rodfit::Error;
use rodfit::code::{all_explained, explained, named};
use rodfit::summary::wrap_message;

/// Options of `rodfit explain`.
#[derive(clap::Args)]
pub struct ExplainOptions {
    /// Code, as `beyond-sigma`, or exit code, as 3; default: a list of all.
    code: Option<String>,
}

/// Prints the entry of the given code, or the list of all codes without one. Returns exit code 0; an error for an
/// unknown code.
pub fn run(options: &ExplainOptions) -> Result<u8, Error> {
    let text = options.code.as_deref().map_or_else(|| Ok(list()), entry)?;
    terminal::print(&text).map(|()| 0)
}

/// The text of the entry of a code or exit code: name and document, wrapped for the terminal, with the former name if
/// that was given. Brackets around the code and its case are ignored. An unknown code is an error with the most similar
/// one.
fn entry(code: &str) -> Result<String, Error> {
    let name = code.trim_matches(['[', ']']).to_lowercase();
    let text = explained(&name).ok_or_else(|| {
        // The most similar code is more helpful than a list of all.
        let similarity = |other: &&str| strsim::jaro_winkler(other, &name);
        let names = all_explained().map(|(other, _)| other);
        let closest = names.max_by(|a, b| similarity(a).total_cmp(&similarity(b)));
        let closest = closest.unwrap_or_default();
        let allowed = format!("a code that `rodfit explain` lists, such as {closest}");
        Error::invalid("explain", code, allowed)
    })?;
    let title = match named(&name) {
        Some(code) if code.name() != name => format!("{code} (formerly {name})"),
        _ => name,
    };
    // The terminal shows no bold text.
    let text = format!("{title}: {}", text.replace("**", ""));
    Ok(text.split("\n\n").map(paragraph).collect::<Vec<_>>().join("\n"))
}

/// A paragraph wrapped to the terminal's width, its line breaks replaced by spaces. Paragraphs with lists, tables or
/// code keep their line breaks.
fn paragraph(text: &str) -> String {
    // Lists, tables and code would lose their structure without line breaks.
    let is_list = |line: &str| line.starts_with(['-', '|', ' ', '`']);
    let text = if text.lines().any(is_list) { text.into() } else { text.replace('\n', " ") };
    wrap_message(&text, Stream::Output.style())
}

/// One line for each code and exit code: its name, padded to a common width, and the first line of its document,
/// wrapped.
fn list() -> String {
    let width = all_explained().map(|(name, _)| name.len()).max().unwrap_or(0);
    let lines = all_explained().map(|(name, text)| {
        let line = format!("{name:<width$}  {}", text.lines().next().unwrap_or_default());
        wrap_message(&line, Stream::Output.style())
    });
    lines.collect::<Vec<_>>().join("\n")
}
