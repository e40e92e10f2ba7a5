//! Parts of pages in HTML: escaped text, sections, folded lists, warnings with their codes.

use crate::code::explained;

/// Entries of a list that are shown; the others are folded.
pub(super) const SHOWN: usize = 3;

/// A section with its heading; both are HTML.
pub(super) fn section(title: &str, content: &str) -> String {
    format!("<section><h2>{title}</h2>\n{content}\n</section>\n")
}

/// The same, or nothing without content.
pub(super) fn section_if_any(title: &str, content: &str) -> String {
    if content.is_empty() { String::new() } else { section(title, content) }
}

/// Content that is folded under a line; both are HTML.
pub(super) fn folded(line: &str, content: &str) -> String {
    format!("<details class=\"fold\"><summary>{line}</summary>\n{content}</details>\n")
}

/// A small paragraph of HTML; nothing without content.
pub(super) fn note(content: &str) -> String {
    match content.is_empty() {
        true => String::new(),
        false => format!("<p class=\"note\">{content}</p>\n"),
    }
}

/// A list of entries in HTML, of which those beyond the first [`SHOWN`] are folded; `name` is their plural.
pub(super) fn list(entries: &[String], name: &str) -> String {
    let items = |entries: &[String]| {
        let items: String = entries.iter().map(|entry| format!("<li>{entry}</li>\n")).collect();
        format!("<ul>\n{items}</ul>\n")
    };
    match entries.len() {
        0 => String::new(),
        n if n <= SHOWN + 1 => items(entries),
        n => {
            let more = format!("{} more {name}", n - SHOWN);
            items(&entries[..SHOWN]) + &folded(&more, &items(&entries[SHOWN..]))
        }
    }
}

/// Text as HTML.
pub(super) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

pub(super) fn capitalized(text: &str) -> String {
    let mut letters = text.chars();
    letters
        .next()
        .map_or(String::new(), |first| first.to_uppercase().collect::<String>() + letters.as_str())
}

/// A message as HTML. The explanation of a code in brackets at its end is folded below it.
pub(super) fn with_explanation(message: &str) -> String {
    let coded = message.rsplit_once(" [").and_then(|(text, code)| {
        let code = code.strip_suffix(']')?;
        Some((text, code, explained(code)?))
    });
    match coded {
        Some((text, code, explanation)) => format!(
            "<details><summary>{} <code>{code}</code></summary>{}</details>",
            escaped(text),
            paragraphs(explanation)
        ),
        None => escaped(message),
    }
}

/// Paragraphs of the explanation of a code.
fn paragraphs(text: &str) -> String {
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
}
