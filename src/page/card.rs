//! The first card of a page: the grade, the answer, the most severe warnings.

use crate::page::html::{list, with_explanation};

/// How a result is to be taken.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Tone {
    Good,
    Doubtful,
    Bad,
}

impl Tone {
    pub fn class(self) -> &'static str {
        match self {
            Self::Good => "good",
            Self::Doubtful => "doubt",
            Self::Bad => "bad",
        }
    }
}

/// A card with its headline and content, which are HTML, and lists of messages below their headings.
pub(super) fn card(
    tone: Tone,
    headline: &str,
    content: &str,
    messages: &[(&str, Vec<String>)],
) -> String {
    let lists = messages.iter().filter(|(_, messages)| !messages.is_empty());
    let lists = lists.map(|(title, messages)| {
        let entries: Vec<String> = messages.iter().map(|text| with_explanation(text)).collect();
        format!("<h2>{title}</h2>\n{}", list(&entries, &title.to_lowercase()))
    });
    format!(
        "<section class=\"verdict {}\" id=\"verdict\"><div class=\"headline\">{headline}</div>\n{content}{}</section>\n",
        tone.class(),
        lists.collect::<String>(),
    )
}
