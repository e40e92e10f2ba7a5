//! Words with their codes, and what those mean below them.

use crate::code::explained;
use crate::page::escaped;

/// Words, behind which a code may stand in brackets: what it means opens below them.
pub(super) fn with_its_code(words: &str) -> String {
    let coded = words.rsplit_once(" [").and_then(|(words, code)| {
        let code = code.strip_suffix(']')?;
        Some((words, code, explained(code)?))
    });
    match coded {
        Some((words, code, text)) => format!(
            "<details><summary>{} <code>{code}</code></summary>{}</details>",
            escaped(words),
            prose(text)
        ),
        None => escaped(words),
    }
}

/// Paragraphs of the explanation of a code.
fn prose(text: &str) -> String {
    let marked = |text: String, mark: &str, tag: &str| -> String {
        let parts = text.split(mark).enumerate().map(|(i, part)| match i % 2 {
            0 => part.to_string(),
            _ => format!("<{tag}>{part}</{tag}>"),
        });
        parts.collect()
    };
    let paragraph =
        |text: &str| format!("<p>{}</p>", marked(marked(escaped(text), "**", "b"), "`", "code"));
    text.split("\n\n").map(paragraph).collect()
}
