//! `rodfit explain`

use crate::command::style::Stream;
use crate::command::terminal;
use rodfit::Error;
use rodfit::code::{all_explained, explained, named};
use rodfit::summary::wrap_message;

#[derive(clap::Args)]
pub struct Options {
    /// Code, as `beyond-sigma`, or exit code, as 3; default: a list of all.
    code: Option<String>,
}

pub fn run(options: &Options) -> Result<u8, Error> {
    let text = match &options.code {
        Some(code) => one(code)?,
        None => all(),
    };
    terminal::print(&text).map(|()| 0)
}

fn one(code: &str) -> Result<String, Error> {
    let name = code.trim_matches(['[', ']']).to_lowercase();
    let text = explained(&name).ok_or_else(|| {
        let near = |other: &&str| strsim::jaro_winkler(other, &name);
        let names = all_explained().map(|(other, _)| other);
        let closest = names.max_by(|a, b| near(a).total_cmp(&near(b))).unwrap_or_default();
        Error::Invalid {
            file: None,
            key: "explain".into(),
            found: code.into(),
            allowed: format!("a code that `rodfit explain` lists, such as {closest}"),
        }
    })?;
    let title = match named(&name) {
        Some(code) if code.name() != name => format!("{code} (formerly {name})"),
        _ => name,
    };
    // The terminal shows no bold text.
    let text = format!("{title}: {}", text.replace("**", ""));
    Ok(text.split("\n\n").map(paragraph).collect::<Vec<_>>().join("\n"))
}

/// A paragraph in lines of the terminal's width; lists and examples stay as they are.
fn paragraph(text: &str) -> String {
    let is_list = |line: &str| line.starts_with(['-', '|', ' ', '`']);
    let text = if text.lines().any(is_list) { text.into() } else { text.replace('\n', " ") };
    wrap_message(&text, Stream::Output.style())
}

/// Every word with its title.
fn all() -> String {
    let width = all_explained().map(|(name, _)| name.len()).max().unwrap_or(0);
    let line = |(name, text): (&str, &str)| {
        let line = format!("{name:<width$}  {}", text.lines().next().unwrap_or_default());
        wrap_message(&line, Stream::Output.style())
    };
    all_explained().map(line).collect::<Vec<_>>().join("\n")
}
