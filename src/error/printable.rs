//! Text from elsewhere as it is shown: file names, names of markers and lines of files may hold control
//! characters, which color, hide or rewrite what a terminal shows.

use std::borrow::Cow;
use std::fmt::Write;
use std::path::Path;

/// Most characters of a token that are shown of a file that cannot be read.
pub(crate) const LONGEST_TOKEN: usize = 80;

/// Most characters of the name of a column that are shown beside such a token.
const LONGEST_NAME: usize = 24;

/// A text whose control characters are shown as `\x1b`, and characters that reverse the direction of text as
/// `\u202e`. Line breaks and tabs stay.
pub fn printable(text: &str) -> Cow<'_, str> {
    escaped(text, |c| c != '\n' && c != '\t')
}

/// The same for a name, which stands on one line: line breaks and tabs are shown as `\n` and `\t`.
pub fn printable_name(name: &str) -> Cow<'_, str> {
    escaped(name, |_| true)
}

/// A path as a printable name.
pub(crate) fn printable_path(path: &Path) -> String {
    printable_name(&path.display().to_string()).into_owned()
}

/// A token of a file that cannot be read: printable, and cut to 80 characters, since the file may be one that the
/// reader of the message must not see.
pub(crate) fn token(text: &str) -> String {
    cut(text, LONGEST_TOKEN)
}

/// The name of a column that a token stands in, cut to 24 characters.
pub(crate) fn column_name(name: &str) -> String {
    cut(name, LONGEST_NAME)
}

fn cut(text: &str, longest: usize) -> String {
    let shown = printable_name(text);
    match shown.char_indices().nth(longest) {
        None => shown.into_owned(),
        Some((end, _)) => {
            format!("{} [.. {} bytes left out ..]", &shown[..end], shown.len() - end)
        }
    }
}

/// A message whose tokens, those between two `quote` characters, are cut to 80 characters where they are longer. Tokens
/// that are cut already stay.
pub(crate) fn with_tokens_cut(message: &str, quote: char) -> Cow<'_, str> {
    let is_long = |token: &str| {
        token.len() > LONGEST_TOKEN && (!token.ends_with(" ..]") || token.len() > 2 * LONGEST_TOKEN)
    };
    let mut parts = message.split(quote);
    // Every other part is a token, if a quote ends it.
    let count = message.matches(quote).count() / 2 * 2;
    if message.split(quote).skip(1).step_by(2).all(|token| !is_long(token)) {
        return message.into();
    }
    let mut whole = parts.next().unwrap_or_default().to_string();
    for (k, part) in parts.enumerate() {
        whole.push(quote);
        match k % 2 == 0 && k < count && is_long(part) {
            true => whole.push_str(&token(part)),
            false => whole.push_str(part),
        }
    }
    whole.into()
}

fn escaped(text: &str, is_shown: impl Fn(char) -> bool) -> Cow<'_, str> {
    let acts = |c: char| (c.is_control() || reverses(c)) && is_shown(c);
    if !text.contains(acts) {
        return text.into();
    }
    let mut shown = String::with_capacity(text.len() + 8);
    for c in text.chars() {
        // Writing to a string does not fail.
        let _ = match c {
            c if !acts(c) => shown.write_char(c),
            '\n' => shown.write_str("\\n"),
            '\t' => shown.write_str("\\t"),
            '\r' => shown.write_str("\\r"),
            c if (c as u32) < 0x100 => write!(shown, "\\x{:02x}", c as u32),
            c => write!(shown, "\\u{:04x}", c as u32),
        };
    }
    shown.into()
}

/// Marks, embeddings, overrides and isolates of the bidirectional algorithm (Unicode Standard Annex 9).
fn reverses(c: char) -> bool {
    matches!(c, '\u{200e}' | '\u{200f}' | '\u{061c}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

#[cfg(test)]
mod tests {
    use crate::error::printable::{printable, printable_name, token, with_tokens_cut};
    use std::borrow::Cow;

    #[test]
    fn control_characters_are_escaped() {
        assert_eq!(printable("A\x1b[31mB\n\tC\x07\u{9b}\x7f"), "A\\x1b[31mB\n\tC\\x07\\x9b\\x7f");
        assert_eq!(printable_name("a\nwarning: b\t\r"), "a\\nwarning: b\\t\\r");
        assert_eq!(printable("txt.\u{202e}lmot"), "txt.\\u202elmot");
        assert!(matches!(printable("\u{3b8} in \u{b0}, \u{e9}"), Cow::Borrowed(_)));
    }

    #[test]
    fn tokens_are_cut_to_80_characters() {
        assert_eq!(token(&"\u{3b8}".repeat(80)), "\u{3b8}".repeat(80));
        assert_eq!(
            token(&"\u{3b8}".repeat(81)),
            format!("{} [.. 2 bytes left out ..]", "\u{3b8}".repeat(80))
        );
        let [long, cut] = ["ab".repeat(50), "ab".repeat(40) + " [.. 20 bytes left out ..]"];
        let message = format!("found `{long}` or `b`, {long} `");
        assert_eq!(with_tokens_cut(&message, '`'), format!("found `{cut}` or `b`, {long} `"));
        let again = format!("found `{cut}`");
        assert_eq!(with_tokens_cut(&again, '`'), again);
        assert_eq!(with_tokens_cut("none", '`'), "none");
    }
}
