//! Texts of files in messages: control characters escaped, long tokens, words and lines cut.
//!
//! Input are texts, names or paths of files; they may have control characters, which color, hide or rewrite the output
//! of a terminal. [`printable`] shows these as `\x1b`, and characters that change the direction of text as `\u202e`;
//! line breaks and tabs stay. [`printable_name`] and [`printable_path`] escape these too. [`token`] also cuts at
//! [`LONGEST_TOKEN`] characters, [`column_name`] earlier; both state the number of bytes left out. [`with_tokens_cut`]
//! cuts the tokens between quotes, and [`clipped`] the middle of words above 200 bytes and of lines above 3000 bytes.
//! [`shown`] does all of this for a whole message with tokens in backquotes. [`io_reason`] is the text of an input or
//! output error. A message should be short, and a file may be confidential.

use std::borrow::Cow;
use std::fmt::Write;
use std::io::ErrorKind;
use std::path::Path;

/// Largest number of characters of a token in a message.
pub const LONGEST_TOKEN: usize = 80;

/// Largest number of characters of the name of a column in a message.
const LONGEST_NAME: usize = 24;

/// A text whose control characters are shown as `\x1b`, and characters that reverse the direction of text as `\u202e`.
/// Line breaks and tabs stay. Borrowed if nothing changes.
pub fn printable(text: &str) -> Cow<'_, str> {
    escaped(text, |c| c != '\n' && c != '\t')
}

/// A name on one line: as [`printable`], with line breaks and tabs shown as `\n` and `\t`.
pub fn printable_name(name: &str) -> Cow<'_, str> {
    escaped(name, |_| true)
}

/// A path as text on one line, with control characters escaped.
pub fn printable_path(path: &Path) -> String {
    printable_name(&path.display().to_string()).into_owned()
}

/// A token of a file, for a message: printable on one line, and cut to [`LONGEST_TOKEN`] characters, with the number of
/// bytes left out.
pub fn token(text: &str) -> String {
    cut(text, LONGEST_TOKEN)
}

/// The name of a column for a message: printable on one line, and cut to 24 characters, with the number of bytes left
/// out.
pub fn column_name(name: &str) -> String {
    cut(name, LONGEST_NAME)
}

/// Printable text on one line, cut to `longest` characters; if it is cut, the number of bytes that are left out
/// follows.
fn cut(text: &str, longest: usize) -> String {
    let shown = printable_name(text);
    match shown.char_indices().nth(longest) {
        None => shown.into_owned(),
        Some((end, _)) => {
            format!("{} [.. {} bytes left out ..]", &shown[..end], shown.len() - end)
        }
    }
}

/// A message whose tokens, the texts between two `quote` characters, are cut as by [`token`] if they have more than
/// [`LONGEST_TOKEN`] bytes. Tokens up to twice that length that end with ` ..]`, as cut ones do, stay, and so do texts
/// outside of quotes. Borrowed if no token is long.
pub fn with_tokens_cut(message: &str, quote: char) -> Cow<'_, str> {
    let is_long = |token: &str| {
        token.len() > LONGEST_TOKEN && (!token.ends_with(" ..]") || token.len() > 2 * LONGEST_TOKEN)
    };
    let mut parts = message.split(quote);
    // Every second part is a token, if a quote ends it.
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

/// The reason of an input or output error as text, with the remedy if the file is missing or access is denied. Errors
/// that do not come from the operating system keep their text.
pub fn io_reason(source: &std::io::Error) -> String {
    if source.raw_os_error().is_none() {
        return source.to_string();
    }
    match source.kind() {
        ErrorKind::NotFound => "No such file or folder. Check the path".into(),
        ErrorKind::PermissionDenied => {
            "permission denied. Check the permissions of the file and its folder".into()
        }
        _ => source.to_string(),
    }
}

/// A message about a file for display: control characters escaped; tokens in backquotes, long words (200 bytes) and
/// long lines (3000 bytes) cut.
pub fn shown(message: &str) -> String {
    printable(&clipped(&with_tokens_cut(message, '`'))).into_owned()
}

/// Words, and lines, longer than this, bytes, are shown without their middle.
const LONG: [usize; 2] = [200, 3000];
/// Lengths of the beginning and of the end, bytes, that are shown of a long word or line.
const SHOWN: [usize; 2] = [120, 60];

/// A text whose words above 200 bytes and lines above 3000 bytes are shown without their middle, with the number of
/// bytes left out.
pub fn clipped(text: &str) -> Cow<'_, str> {
    if text.len() <= LONG[0] {
        return text.into();
    }
    let line = |line: &str| {
        let words: Vec<_> = line.split(' ').map(|word| without_middle(word, LONG[0])).collect();
        without_middle(&words.join(" "), LONG[1]).into_owned()
    };
    text.split('\n').map(line).collect::<Vec<_>>().join("\n").into()
}

/// A text without its middle if it is longer than `most` bytes: the first 120 and the last 60, cut at boundaries of
/// characters, with the number of bytes left out between them. Of a row of carets, which mark a token, only the first
/// 120 stay.
fn without_middle(text: &str, most: usize) -> Cow<'_, str> {
    if text.len() <= most {
        return text.into();
    }
    // Both cuts are moved to boundaries of characters, as a slice inside of one would panic.
    let boundary = |i: &usize| text.is_char_boundary(*i);
    let head = (0..=SHOWN[0]).rev().find(boundary).unwrap_or(0);
    if text.bytes().all(|byte| byte == b'^') {
        // Carets below a line, which mark a token.
        return text[..head].into();
    }
    let tail = (text.len() - SHOWN[1]..).find(boundary).unwrap_or(text.len());
    let left_out = tail - head;
    format!("{} [.. {left_out} bytes left out ..] {}", &text[..head], &text[tail..]).into()
}

/// A text with escapes, as `\n`, `\x1b` or `\u202e`, in place of control characters and characters that change its
/// direction, where `is_shown` returns true for them. Borrowed without any.
fn escaped(text: &str, is_shown: impl Fn(char) -> bool) -> Cow<'_, str> {
    let acts = |c: char| (c.is_control() || reverses(c)) && is_shown(c);
    if !text.contains(acts) {
        return text.into();
    }
    let mut shown = String::with_capacity(text.len() + 8);
    for c in text.chars() {
        // Writing to a string cannot fail.
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

/// Whether a character changes the direction of text: marks, embeddings, overrides and isolates of the bidirectional
/// algorithm (Unicode Standard Annex 9).
fn reverses(c: char) -> bool {
    matches!(c, '\u{200e}' | '\u{200f}' | '\u{061c}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

#[cfg(test)]
mod tests {
    use crate::printable::{printable, printable_name, token, with_tokens_cut};
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
        // 80 characters are the limit; one more leaves out its two bytes in UTF-8.
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
