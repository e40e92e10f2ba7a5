//! Pages that open offline: one file each, without scripts, fonts or links from elsewhere.

mod budget;
mod chart;
mod coded;
mod field;
mod figures;
mod fit;
mod moments;
mod number;
mod prediction;
mod recordings;
mod simulation;
mod study;

pub use field::field_page;
pub use fit::fit_page;
pub use prediction::prediction_page;
pub use simulation::simulation_page;
pub use study::study_page;

use crate::error::printable::printable;

const STYLE: &str = include_str!("page.css");

/// A whole page; `title` and `body` are HTML. Control characters in names have no place there; they are shown as on
/// a terminal.
fn page(kind: &str, title: &str, body: &str) -> String {
    let (title, body) = (printable(title), printable(body));
    format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\
         <meta name=\"color-scheme\" content=\"light dark\"><title>{kind}: {title}</title>\n\
         <style>{STYLE}</style></head>\n<body><main>\n\
         <header><p class=\"kind\">{kind}</p><h1>{title}</h1></header>\n{body}</main></body></html>\n"
    )
}

/// A part of a page; both are HTML.
fn section(title: &str, content: &str) -> String {
    format!("<section><h2>{title}</h2>\n{content}\n</section>\n")
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

fn capitalised(words: &str) -> String {
    let mut letters = words.chars();
    letters
        .next()
        .map_or(String::new(), |first| first.to_uppercase().collect::<String>() + letters.as_str())
}
