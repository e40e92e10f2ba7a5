//! `rodfit explain`

use crate::command::terminal;
use rodfit::Error;
use rodfit::code::{all_explained, explained, named};

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
    Ok(format!("{title}: {}", text.replace("**", "").replace("\n\n", "\n")))
}

/// Every word with its title.
fn all() -> String {
    let width = all_explained().map(|(name, _)| name.len()).max().unwrap_or(0);
    let line = |(name, text): (&str, &str)| {
        format!("{name:<width$}  {}", text.lines().next().unwrap_or_default())
    };
    all_explained().map(line).collect::<Vec<_>>().join("\n")
}
