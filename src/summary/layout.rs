//! Wrapping of text to lines of a limited width, for terminals.
//!
//! Lines break between words; a number and its unit stay together, and words longer than a line are not divided.
//! Continued lines are indented; quoted lines of files in messages stay whole. The width is 80 columns
//! ([`DEFAULT_WIDTH`]) without a terminal; beside a label a text has at least 20. Text is plain: columns are
//! characters. [`wrapped`] wraps a text, [`wrapped_behind`] a text behind a label, with an indent; [`wrap_message`]
//! wraps a message and colors its `error:` or `warning:`.

use crate::summary::{TextStyle, Tone};

/// Columns of a line of text that goes to a file or pipe, or to a narrower terminal.
pub const DEFAULT_WIDTH: usize = 80;
/// Fewest columns for text beside a label or in a column, however narrow the terminal is.
const MIN_TEXT_WIDTH: usize = 20;
/// Units that stay on the line of the number in front of them.
const UNITS: [&str; 17] = [
    "%", "m", "mm", "um", "nm", "s", "ms", "us", "min", "h", "Pa", "N", "J", "kg", "g", "mg", "Hz",
];

/// Number of columns of a text on one line of the terminal: its number of characters.
pub(crate) fn columns(text: &str) -> usize {
    text.chars().count()
}

/// The words of a text, between which a line may end, without the spaces. A unit of [`UNITS`] behind a number, also
/// with punctuation, belongs to the word of the number.
fn words(text: &str) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        let bare = word.trim_end_matches([',', ';', '.', ':', ')']);
        // "1.5 mm" is one word.
        match words.last_mut() {
            Some(last) if UNITS.contains(&bare) && last.ends_with(|c: char| c.is_ascii_digit()) => {
                last.push(' ');
                last.push_str(word);
            }
            _ => words.push(word.into()),
        }
    }
    words
}

/// A text in lines of up to `width` columns, or at least [`MIN_TEXT_WIDTH`] behind the indent. The first line begins
/// with `head`, the others, also those of line breaks, with `indent` spaces. Spaces at the ends of lines are removed.
pub(crate) fn wrapped_behind(head: &str, text: &str, width: usize, indent: usize) -> Vec<String> {
    lines_behind(head, text, width.max(indent + MIN_TEXT_WIDTH), indent)
}

/// Lines of `text`, wrapped to `width` columns behind `head`, as in [`wrapped_behind`] but for any width. A part that
/// fits on a line keeps its spaces. One line for an empty text.
fn lines_behind(head: &str, text: &str, width: usize, indent: usize) -> Vec<String> {
    let mut lines = Vec::new();
    let mut start = head.to_string();
    for part in text.lines() {
        let mut line = std::mem::replace(&mut start, " ".repeat(indent));
        if columns(&line) + columns(part) <= width {
            // A line that fits keeps its own spaces.
            lines.push(line + part);
            continue;
        }
        let mut is_empty = true;
        for word in words(part) {
            if !is_empty && columns(&line) + 1 + columns(&word) > width {
                lines.push(std::mem::replace(&mut line, " ".repeat(indent)));
            } else if !is_empty {
                line.push(' ');
            }
            line.push_str(&word);
            is_empty = false;
        }
        lines.push(line);
    }
    if lines.is_empty() {
        lines.push(start);
    }
    lines.into_iter().map(|line| line.trim_end().to_string()).collect()
}

/// A text in lines of up to `width` columns, without head and indent; longer words exceed it. One empty line for an
/// empty text.
pub(crate) fn wrapped(text: &str, width: usize) -> Vec<String> {
    lines_behind("", text, width, 0)
}

/// A message of one or several lines, such as a warning or an error, with lines wrapped to the width of the style.
/// Continued lines are indented by 2 below the first, else like their line. Lines that quote a file (number and `|`)
/// are not wrapped. `error:` and `warning:` at the start are colored if the style is.
pub fn wrap_message(text: &str, style: TextStyle) -> String {
    let is_quotation = |line: &str| {
        let rest = line.trim_start().trim_start_matches(|c: char| c.is_ascii_digit());
        rest.trim_start().starts_with('|')
    };
    let mut lines = Vec::new();
    for (k, line) in text.split('\n').enumerate() {
        if columns(line) <= style.width || is_quotation(line) {
            lines.push(line.to_string());
            continue;
        }
        // Continued lines keep the indent of their first.
        let own = line.chars().take_while(|c| *c == ' ').count();
        let indent = if k == 0 { 2 } else { own };
        lines.extend(wrapped_behind(&" ".repeat(own), line.trim_start(), style.width, indent));
    }
    for (start, tone) in [("error:", Tone::Bad), ("warning:", Tone::Doubtful)] {
        if let Some(rest) = lines[0].strip_prefix(start) {
            lines[0] = tone.paint(start, style.is_colored) + rest;
        }
    }
    lines.join("\n")
}
