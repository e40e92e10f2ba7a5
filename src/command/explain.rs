//! `rodfit explain`: the entry of a code in `docs/codes/`, or a list of all codes.

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

/// Prints the entry of a code, or the list.
pub fn run(options: &ExplainOptions) -> Result<u8, Error> {
    let text = options.code.as_deref().map_or_else(|| Ok(list()), entry)?;
    terminal::print(&text).map(|()| 0)
}

/// The entry of a code, which may be in brackets, or of an exit code. An unknown code is an error with the closest one.
fn entry(code: &str) -> Result<String, Error> {
    let name = code.trim_matches(['[', ']']).to_lowercase();
    let text = explained(&name).ok_or_else(|| {
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

/// A paragraph in lines of the terminal's width. Lists and examples keep their lines.
fn paragraph(text: &str) -> String {
    let is_list = |line: &str| line.starts_with(['-', '|', ' ', '`']);
    let text = if text.lines().any(is_list) { text.into() } else { text.replace('\n', " ") };
    wrap_message(&text, Stream::Output.style())
}

/// All codes with their titles.
fn list() -> String {
    let width = all_explained().map(|(name, _)| name.len()).max().unwrap_or(0);
    let lines = all_explained().map(|(name, text)| {
        let line = format!("{name:<width$}  {}", text.lines().next().unwrap_or_default());
        wrap_message(&line, Stream::Output.style())
    });
    lines.collect::<Vec<_>>().join("\n")
}
