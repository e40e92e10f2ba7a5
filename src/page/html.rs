//! HTML elements of the pages: escaped text, headed sections, folded parts, lists, and messages with the explanation of
//! their code.
//!
//! Functions return HTML; headings and messages are text, which they escape, and contents are HTML already. All page
//! modules use them.
//!
//! - `section` and `subsection` have a heading, `note` is a small paragraph, `folded` a part below a summary line.
//!   `list` folds the entries beyond `SHOWN_ENTRIES`, except a single one. Sections, notes and lists without content
//!   are an empty string, so that a page leaves them out.
//! - `no_data` is a paragraph with the reason why data are missing.
//! - `with_explanation` converts a message. If that ends with a known code in brackets, a click on it unfolds the
//!   explanation of the code.
//! - `escaped`, `capitalized` (first letter) and `percent_encoded` (for links) convert text.

use crate::code::explained;
use std::fmt::Write;

/// Entries of a message list that are shown at once; further ones are folded.
const SHOWN_ENTRIES: usize = 3;

/// A section of the page: its heading (text, escaped) over its content (HTML); empty without content.
pub(super) fn section(heading: &str, content: &str) -> String {
    match content.is_empty() {
        true => String::new(),
        false => format!("<section><h2>{}</h2>\n{content}\n</section>\n", escaped(heading)),
    }
}

/// A part of a section: its heading (text) over its content (HTML). The content alone if heading or content is empty.
pub(super) fn subsection(heading: &str, content: &str) -> String {
    match content.is_empty() || heading.is_empty() {
        true => content.into(),
        false => format!("<h3>{}</h3>\n{content}", escaped(heading)),
    }
}

/// Content (HTML) below a summary line (text), hidden until a click on that line.
pub(super) fn folded(summary: &str, content: &str) -> String {
    let summary = escaped(summary);
    format!("<details class=\"fold\"><summary>{summary}</summary>\n{content}</details>\n")
}

/// A small paragraph of HTML; empty without content.
pub(super) fn note(content: &str) -> String {
    match content.is_empty() {
        true => String::new(),
        false => format!("<p class=\"note\">{content}</p>\n"),
    }
}

/// A paragraph with the reason (HTML) in the place of missing data.
pub(super) fn no_data(reason: &str) -> String {
    format!("<p class=\"none\">{reason}</p>")
}

/// A list of entries, both HTML. Entries beyond [`SHOWN_ENTRIES`] are folded under their number and `plural`, their
/// name; a single further one is not folded. Empty without entries.
pub(super) fn list(entries: &[String], plural: &str) -> String {
    let items = |entries: &[String]| {
        let items: String = entries.iter().map(|entry| format!("<li>{entry}</li>\n")).collect();
        format!("<ul>\n{items}</ul>\n")
    };
    match entries.split_at_checked(SHOWN_ENTRIES) {
        _ if entries.is_empty() => String::new(),
        Some((shown, others)) if others.len() > 1 => {
            items(shown) + &folded(&format!("Show {} more {plural}", others.len()), &items(others))
        }
        _ => items(entries),
    }
}

/// Text with `&`, `<`, `>` and `"` escaped, which have a meaning in HTML.
pub(super) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// Text with its first letter in upper case; the others stay.
pub(super) fn capitalized(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().map(|first| first.to_uppercase().to_string());
    first.unwrap_or_default() + letters.as_str()
}

/// Text in percent-encoding (RFC 3986): all bytes but letters, digits, `-_.~` and those of `kept`.
pub(super) fn percent_encoded(text: &str, kept: &[u8]) -> String {
    let mut encoded = String::with_capacity(text.len() + text.len() / 8);
    for byte in text.bytes() {
        if byte.is_ascii_alphanumeric() || b"-_.~".contains(&byte) || kept.contains(&byte) {
            encoded.push(char::from(byte));
        } else {
            // Writing to a string cannot fail.
            let _ = write!(encoded, "%{byte:02X}");
        }
    }
    encoded
}

/// A message (text) as HTML. If it ends with a known code in brackets, a click unfolds the explanation of the code;
/// other messages are escaped only.
pub(super) fn with_explanation(message: &str) -> String {
    // Codes follow their message in brackets.
    let coded = message.strip_suffix(']').and_then(|message| message.rsplit_once(" ["));
    match coded.and_then(|(text, code)| Some((text, code, explained(code)?))) {
        Some((text, code, explanation)) => format!(
            "<details><summary>{} <code>{code}</code></summary>{}</details>",
            escaped(text),
            paragraphs(explanation)
        ),
        None => escaped(message),
    }
}

/// A code's explanation, in Markdown with bold and code spans and blank lines between paragraphs, as paragraphs of
/// HTML.
fn paragraphs(markdown: &str) -> String {
    let marked = |text: String, mark: &str, tag: &str| -> String {
        // Odd parts stand between a pair of marks.
        let parts = text.split(mark).enumerate().map(|(i, part)| match i % 2 {
            0 => part.to_string(),
            _ => format!("<{tag}>{part}</{tag}>"),
        });
        parts.collect()
    };
    let paragraph =
        |text: &str| format!("<p>{}</p>", marked(marked(escaped(text), "**", "b"), "`", "code"));
    markdown.split("\n\n").map(paragraph).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_list_shows_three_entries_and_folds_the_others() {
        let entries: Vec<String> = (0..6).map(|k| format!("entry {k}")).collect();
        let html = list(&entries, "warnings");
        let (shown, hidden) = html.split_once("<details").unwrap();
        assert_eq!((shown.matches("<li>").count(), hidden.matches("<li>").count()), (3, 3));
        assert!(hidden.contains("3 more warnings"));
        assert!(!list(&entries[..4], "warnings").contains("<details"));
        assert!(list(&[], "warnings").is_empty());
    }

    #[test]
    fn text_cannot_add_elements_or_attributes() {
        assert_eq!(escaped("<a href=\"x\">&"), "&lt;a href=&quot;x&quot;&gt;&amp;");
        assert_eq!(with_explanation("<b> [no-such-code]"), "&lt;b&gt; [no-such-code]");
        assert!(with_explanation("text [trustworthy]").contains("<code>trustworthy</code>"));
    }

    #[test]
    fn percent_encoding_keeps_unreserved_and_listed_bytes() {
        assert_eq!(percent_encoded("a b/c,d", b"/"), "a%20b/c%2Cd");
    }
}
