//! Results as text for a terminal: the status and the result first, then warnings, then everything else.
//!
//! Every report of the library has a function `summary` that returns a [`Summary`]. Its `Display` is 80 columns wide and
//! without color; [`Summary::render`] takes another width, and colors the status and the warnings.

mod layout;
pub(crate) mod quantity;
mod table;

use crate::code::Code;
use marker_files::printable::{printable, printable_name};
use std::fmt;

pub use layout::{DEFAULT_WIDTH, wrap_message};
pub use quantity::duration;
pub use table::{SummaryTable, TextColumn};

/// Columns of the labels of facts, with the indent.
const LABEL_WIDTH: usize = 26;
/// Columns in front of all lines below the status.
const INDENT: usize = 2;

/// Severity of a status, which a terminal shows as a color.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Tone {
    /// No problem: green.
    Good,
    /// Usable with warnings: yellow.
    Doubtful,
    /// Unusable or failed: red.
    Bad,
    /// A statement without a grade.
    Neutral,
}

impl Tone {
    /// The escape sequence that begins the color (ECMA-48, select graphic rendition).
    const fn escape(self) -> &'static str {
        match self {
            Self::Good => "\x1b[32m",
            Self::Doubtful => "\x1b[33m",
            Self::Bad => "\x1b[31m",
            Self::Neutral => "",
        }
    }

    /// A text in this color, if colors `is_colored`.
    pub fn paint(self, text: &str, is_colored: bool) -> String {
        match is_colored && self != Self::Neutral {
            true => format!("{}{text}\x1b[0m", self.escape()),
            false => text.into(),
        }
    }
}

/// Width and color of a text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TextStyle {
    /// Columns of the longest line. Only words that are longer than a line exceed it.
    pub width: usize,
    /// Whether the status and the warnings are colored by escape sequences.
    pub is_colored: bool,
}

impl Default for TextStyle {
    fn default() -> Self {
        Self { width: DEFAULT_WIDTH, is_colored: false }
    }
}

/// A part of a summary below its status.
#[derive(Clone, Debug, PartialEq)]
enum Block {
    /// Text with a label in front.
    Fact { label: String, text: String },
    /// A text without a label.
    Note(String),
    /// A table with a title.
    Table { title: String, table: SummaryTable },
    /// Lines as they are, such as a part of a file.
    Verbatim { title: String, text: String },
}

/// Place of a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Section {
    Result,
    Detail,
}

/// A result as text: the status, the result, the warnings, the details, in this order.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    subject: String,
    status: String,
    code: Option<Code>,
    tone: Tone,
    blocks: Vec<(Section, Block)>,
    warnings: Vec<String>,
    section: Section,
}

impl Summary {
    /// A summary with a status and its severity.
    pub fn new(status: impl Into<String>, tone: Tone) -> Self {
        Self {
            subject: String::new(),
            status: status.into(),
            code: None,
            tone,
            blocks: Vec::new(),
            warnings: Vec::new(),
            section: Section::Result,
        }
    }

    /// Adds the code of the status.
    pub fn coded(mut self, code: Option<Code>) -> Self {
        self.code = code;
        self
    }

    /// Names the subject of the result, such as its file, in front of the status.
    pub fn of(mut self, subject: impl Into<String>) -> Self {
        self.subject = subject.into();
        self
    }

    /// Adds warnings, the most severe first. All blocks after them are details.
    pub fn warnings<T: Into<String>>(mut self, warnings: impl IntoIterator<Item = T>) -> Self {
        self.warnings.extend(warnings.into_iter().map(Into::into));
        self.section = Section::Detail;
        self
    }

    /// Adds a text with a label in front. A label that equals that of the line above is not repeated.
    pub fn fact(mut self, label: impl Into<String>, text: impl Into<String>) -> Self {
        self.push(Block::Fact { label: label.into(), text: text.into() });
        self
    }

    /// Adds facts with one label.
    pub fn facts<T: Into<String>>(self, label: &str, texts: impl IntoIterator<Item = T>) -> Self {
        texts.into_iter().fold(self, |summary, text| summary.fact(label, text))
    }

    /// Adds a line of text.
    pub fn note(mut self, text: impl Into<String>) -> Self {
        self.push(Block::Note(text.into()));
        self
    }

    /// Adds a table below a title, which may be empty; none without rows.
    pub fn table(mut self, title: impl Into<String>, table: SummaryTable) -> Self {
        if !table.is_empty() {
            self.push(Block::Table { title: title.into(), table });
        }
        self
    }

    /// Adds lines as they are, such as a part of a file, below a title.
    pub fn verbatim(mut self, title: impl Into<String>, text: impl Into<String>) -> Self {
        self.push(Block::Verbatim { title: title.into(), text: text.into() });
        self
    }

    fn push(&mut self, block: Block) {
        self.blocks.push((self.section, block));
    }

    /// The status with its subject and its code, on one line.
    fn headline(&self, style: TextStyle) -> Vec<String> {
        let subject = printable_name(&self.subject);
        let subject = if subject.is_empty() { String::new() } else { format!("{subject}: ") };
        let code = self.code.map(|code| format!(" [{code}]")).unwrap_or_default();
        let text = format!("{subject}{}{code}", printable(&self.status));
        let mut lines = layout::wrapped(&text, style.width, INDENT);
        // The color covers the status, which begins on the first line.
        if let Some(first) = lines.first_mut() {
            let status = first.split_off(subject.len().min(first.len()));
            *first = format!("{subject}{}", self.tone.paint(&status, style.is_colored));
        }
        lines
    }

    /// The lines of a block.
    fn lines(block: &Block, repeats_label: bool, style: TextStyle) -> Vec<String> {
        match block {
            Block::Fact { label, text } => {
                let label = if repeats_label { "" } else { label };
                let head = format!("{:INDENT$}{label:<width$}", "", width = LABEL_WIDTH - INDENT);
                let indent = layout::columns(&head).max(LABEL_WIDTH);
                let text = printable(text);
                layout::wrapped_behind(&head, &text, style.width, indent.min(LABEL_WIDTH + INDENT))
            }
            Block::Note(text) => {
                layout::wrapped_behind("  ", &printable(text), style.width, INDENT)
            }
            Block::Table { title, table } => {
                let mut lines = Vec::new();
                if !title.is_empty() {
                    let title = printable(title);
                    lines.extend(layout::wrapped_behind("  ", &title, style.width, 2 * INDENT));
                }
                let is_wide = table.least_width() + 2 * INDENT > style.width;
                let indent = if title.is_empty() || is_wide { INDENT } else { 2 * INDENT };
                lines.extend(table.lines(indent, style.width));
                lines
            }
            Block::Verbatim { title, text } => {
                let mut lines = layout::wrapped_behind("  ", &printable(title), style.width, 2);
                lines.push(String::new());
                lines.extend(printable(text).lines().map(String::from));
                lines
            }
        }
    }

    /// The lines of a section: tables are set off by empty lines, facts follow each other.
    fn section_lines(&self, section: Section, style: TextStyle) -> Vec<String> {
        let mut lines = Vec::new();
        let mut last: Option<&Block> = None;
        for (_, block) in self.blocks.iter().filter(|(own, _)| *own == section) {
            let is_text = |block: &Block| matches!(block, Block::Fact { .. } | Block::Note(_));
            let is_untitled =
                |block: &Block| matches!(block, Block::Table { title, .. } if title.is_empty());
            let follows = last.is_some_and(|last| {
                is_text(last) && is_text(block)
                    || is_untitled(last) && matches!(block, Block::Note(_))
            });
            if last.is_some() && !follows {
                lines.push(String::new());
            }
            let repeats_label = match (last, block) {
                (Some(Block::Fact { label: before, .. }), Block::Fact { label, .. }) => {
                    before == label
                }
                _ => false,
            };
            lines.extend(Self::lines(block, repeats_label, style));
            last = Some(block);
        }
        lines
    }

    /// The text in a style, without a line break at its end.
    pub fn render(&self, style: TextStyle) -> String {
        let warnings: Vec<String> = self
            .warnings
            .iter()
            .flat_map(|text| warning_lines(&format!("warning: {text}"), style))
            .collect();
        let sections = [
            self.headline(style),
            self.section_lines(Section::Result, style),
            warnings,
            self.section_lines(Section::Detail, style),
        ];
        let sections = sections.into_iter().filter(|lines| !lines.is_empty());
        let texts: Vec<String> = sections.map(|lines| lines.join("\n")).collect();
        texts.join("\n\n")
    }
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.render(TextStyle::default()))
    }
}

/// The lines of a warning or an error, whose first word is colored.
fn warning_lines(text: &str, style: TextStyle) -> Vec<String> {
    wrap_message(&printable(text), style).lines().map(String::from).collect()
}

#[cfg(test)]
mod tests;
