//! The first card of a page: a headline with the status, the main result, and lists of messages such as warnings.
//!
//! Input of [`card`]: a severity (`Tone`), headline and content in HTML, and lists of messages as text. The color of
//! its border is that of the severity. Lists without messages are left out; of long ones the further messages are
//! folded. Messages that end with a code unfold the code's explanation. Output is HTML, for every kind of page.

use crate::page::html::{list, with_explanation};
use crate::summary::Tone;

/// CSS class of a severity: `good`, `doubt` or `bad`; empty for a neutral statement.
pub(super) const fn tone_class(tone: Tone) -> &'static str {
    match tone {
        Tone::Good => "good",
        Tone::Doubtful => "doubt",
        Tone::Bad => "bad",
        Tone::Neutral => "",
    }
}

/// Messages (text) of one kind, such as warnings, under their heading.
pub(super) struct MessageList {
    /// Heading of the list (text).
    pub heading: &'static str,
    /// The messages, each with its code at the end, if it has one.
    pub messages: Vec<String>,
}

/// The card as HTML: headline and content, which are HTML, and below them the lists that have messages, each under its
/// heading. Its border has the color of `tone`.
pub(super) fn card(tone: Tone, headline: &str, content: &str, lists: &[MessageList]) -> String {
    let mut html = String::new();
    for MessageList { heading, messages } in lists.iter().filter(|l| !l.messages.is_empty()) {
        let entries: Vec<String> = messages.iter().map(|text| with_explanation(text)).collect();
        html += &format!("<h2>{heading}</h2>\n{}", list(&entries, &heading.to_lowercase()));
    }
    format!(
        "<section class=\"verdict {}\" id=\"verdict\"><div class=\"headline\">{headline}</div>\n{content}{html}</section>\n",
        tone_class(tone),
    )
}
