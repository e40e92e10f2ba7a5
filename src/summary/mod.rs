//! Results as text for a terminal: the status and the result first, then warnings, then the details.
//!
//! Every report of the library has a function `summary` that returns a [`Summary`]. It has a status with its [`Tone`]
//! (severity), subject and code, and a list of labelled facts, notes, tables and verbatim text. Those that are added
//! before the warnings are the result, later ones are details. The `Display` of a summary is 80 columns wide and
//! without color; [`Summary::render`] takes another width, and colors the status and the warnings. Control characters
//! of names are escaped. `quantity` writes numbers with units, `table` the tables, and `layout` wraps lines.

mod layout;
pub(crate) mod quantity;
mod table;

use crate::code::Code;
use marker_files::printable::{printable, printable_name};
use std::fmt;

pub use layout::{DEFAULT_WIDTH, wrap_message};
pub use quantity::duration;
pub(crate) use table::distinct;
pub use table::{ItemTable, SummaryTable, TextColumn};

/// Columns of the labels of facts, including the indent; texts begin behind them.
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
    /// The severity of a computation: `Bad` without success, `Doubtful` with success and warnings, `Good` with success
    /// alone.
    pub const fn of_result(is_success: bool, has_warnings: bool) -> Self {
        match (is_success, has_warnings) {
            (true, false) => Self::Good,
            (true, true) => Self::Doubtful,
            (false, _) => Self::Bad,
        }
    }

    /// The escape sequence that begins the color (ECMA-48, select graphic rendition); empty for `Neutral`.
    const fn escape(self) -> &'static str {
        match self {
            Self::Good => "\x1b[32m",
            Self::Doubtful => "\x1b[33m",
            Self::Bad => "\x1b[31m",
            Self::Neutral => "",
        }
    }

    /// A text between escape sequences that begin and end this color, if `is_colored`. Else, and for `Neutral`, the
    /// text itself.
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
    /// The style of text for files and pipes: [`DEFAULT_WIDTH`] columns, without color.
    fn default() -> Self {
        Self { width: DEFAULT_WIDTH, is_colored: false }
    }
}

/// A part of a summary below its status.
#[derive(Clone, Debug, PartialEq)]
enum SummaryBlock {
    /// Text with a label in front.
    Fact { label: String, text: String },
    /// A text without a label.
    Note(String),
    /// A table with a title.
    Table { title: String, table: SummaryTable },
    /// Lines as they are, such as a part of a file.
    Verbatim { title: String, text: String },
}

/// A result as text: the status, the result, the warnings, the details, in this order.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    subject: String,
    status: String,
    code: Option<Code>,
    tone: Tone,
    result: Vec<SummaryBlock>,
    warnings: Vec<String>,
    /// Blocks that were added after the warnings; none before there are warnings.
    details: Option<Vec<SummaryBlock>>,
}

impl Summary {
    /// A summary with a status (text of the first line) and its severity, without other parts.
    pub fn new(status: impl Into<String>, tone: Tone) -> Self {
        Self {
            subject: String::new(),
            status: status.into(),
            code: None,
            tone,
            result: Vec::new(),
            warnings: Vec::new(),
            details: None,
        }
    }

    /// The summary with another code of the status, which is shown in brackets behind it, or without one.
    pub fn with_code(self, code: Option<Code>) -> Self {
        Self { code, ..self }
    }

    /// The summary with the subject of the result, such as its file, which is shown in front of the status.
    pub fn with_subject(self, subject: impl ToString) -> Self {
        Self { subject: subject.to_string(), ..self }
    }

    /// Adds warnings, the most severe first, behind earlier ones. All blocks that are added later are details, even if
    /// there are no warnings.
    pub fn warnings<T: Into<String>>(mut self, warnings: impl IntoIterator<Item = T>) -> Self {
        self.warnings.extend(warnings.into_iter().map(Into::into));
        // Also without warnings the result ends here, so that summaries of one kind have one layout.
        self.details.get_or_insert_default();
        self
    }

    /// The summary with the codes of its present warnings in the status, so that the first line has them: `completed,
    /// with warnings: unstable-state`. The code of a warning is in brackets at its end; each one is listed once.
    /// Without codes the summary is unchanged.
    pub fn naming_warnings(mut self) -> Self {
        let mut codes: Vec<&str> = Vec::new();
        for warning in &self.warnings {
            let code = warning.strip_suffix(']').and_then(|text| Some(text.rsplit_once('[')?.1));
            codes.extend(code.filter(|code| !codes.contains(code)));
        }
        if !codes.is_empty() {
            let status = format!("{}, with warnings: {}", self.status, codes.join(", "));
            self.status = status;
        }
        self
    }

    /// Ends the result: all blocks that are added later are details, which are shown after the warnings behind an empty
    /// line.
    pub fn details(self) -> Self {
        self.warnings(None::<String>)
    }

    /// Adds a text with a label in front to the result or the details. A label that equals that of the fact above is
    /// not shown again.
    pub fn fact(mut self, label: impl Into<String>, text: impl Into<String>) -> Self {
        self.push(SummaryBlock::Fact { label: label.into(), text: text.into() });
        self
    }

    /// Adds facts with one label, which is shown once; none without texts.
    pub fn facts<T: Into<String>>(self, label: &str, texts: impl IntoIterator<Item = T>) -> Self {
        texts.into_iter().fold(self, |summary, text| summary.fact(label, text))
    }

    /// Adds a text without a label to the result or the details; it is shown wrapped and indented.
    pub fn note(mut self, text: impl Into<String>) -> Self {
        self.push(SummaryBlock::Note(text.into()));
        self
    }

    /// Adds a table below a title, which may be empty. A table without rows is left out with its title.
    pub fn table(mut self, title: impl Into<String>, table: impl Into<SummaryTable>) -> Self {
        let table = table.into();
        if !table.is_empty() {
            self.push(SummaryBlock::Table { title: title.into(), table });
        }
        self
    }

    /// Adds the lines of `text`, such as a part of a file, without wrapping and indent, below a title and an empty
    /// line.
    pub fn verbatim(mut self, title: impl Into<String>, text: impl Into<String>) -> Self {
        self.push(SummaryBlock::Verbatim { title: title.into(), text: text.into() });
        self
    }

    /// Adds a block to the result, or to the details once these have begun.
    fn push(&mut self, block: SummaryBlock) {
        self.details.as_mut().unwrap_or(&mut self.result).push(block);
    }

    /// The lines of `subject: status [code]`, wrapped to the width of the style and indented from the second one on,
    /// with control characters escaped. Without a subject the status begins the line. If the style is colored, so is
    /// the line on which the status begins, from the status on.
    fn headline(&self, style: TextStyle) -> Vec<String> {
        let subject = printable_name(&self.subject);
        let subject = if subject.is_empty() { String::new() } else { format!("{subject}: ") };
        let code = self.code.map(|code| format!(" [{code}]")).unwrap_or_default();
        let text = format!("{subject}{}{code}", printable(&self.status));
        let mut lines = layout::wrapped_behind("", &text, style.width, INDENT);
        // Wrapping changes spaces only: the status begins behind as many other characters as the subject has.
        let visible = |text: &str| text.chars().filter(|c| !c.is_whitespace()).count();
        let mut ahead = visible(&subject);
        for line in &mut lines {
            let mut places = line.char_indices().filter(|(_, c)| !c.is_whitespace());
            if let Some((start, _)) = places.nth(ahead) {
                let status = line.split_off(start);
                line.push_str(&self.tone.paint(&status, style.is_colored));
                break;
            }
            ahead -= visible(line);
        }
        lines
    }

    /// The wrapped and indented lines of a block. Texts of facts begin behind the label at [`LABEL_WIDTH`]; with
    /// `repeats_label` the label, which equals that of the block above, is left blank. Tables are indented by 4 below a
    /// title, by 2 without one or if they are too wide. Verbatim lines are neither wrapped nor indented. Control
    /// characters are escaped.
    fn block_lines(block: &SummaryBlock, repeats_label: bool, style: TextStyle) -> Vec<String> {
        match block {
            SummaryBlock::Fact { label, text } => {
                let label = if repeats_label { "" } else { label };
                // The label and its text share a line; long texts are wrapped behind the label.
                let head = format!("{:INDENT$}{label:<width$}", "", width = LABEL_WIDTH - INDENT);
                let indent = layout::columns(&head).clamp(LABEL_WIDTH, LABEL_WIDTH + INDENT);
                layout::wrapped_behind(&head, &printable(text), style.width, indent)
            }
            SummaryBlock::Note(text) => {
                layout::wrapped_behind("  ", &printable(text), style.width, INDENT)
            }
            SummaryBlock::Table { title, table } => {
                // A table that does not fit is indented less.
                let is_wide = table.min_width() + 2 * INDENT > style.width;
                let indent = if title.is_empty() || is_wide { INDENT } else { 2 * INDENT };
                let mut lines = match title.is_empty() {
                    true => Vec::new(),
                    false => {
                        layout::wrapped_behind("  ", &printable(title), style.width, 2 * INDENT)
                    }
                };
                lines.extend(table.lines(indent, style.width));
                lines
            }
            SummaryBlock::Verbatim { title, text } => {
                let mut lines =
                    layout::wrapped_behind("  ", &printable(title), style.width, INDENT);
                lines.push(String::new());
                lines.extend(printable(text).lines().map(String::from));
                lines
            }
        }
    }

    /// The lines of several blocks. An empty line is between two blocks, but not between facts and notes, nor between a
    /// table without a title and a note. A label that equals that of the fact above is left blank.
    fn section_lines(blocks: &[SummaryBlock], style: TextStyle) -> Vec<String> {
        use SummaryBlock::{Fact, Note, Table};
        let mut lines = Vec::new();
        for (k, block) in blocks.iter().enumerate() {
            let last = k.checked_sub(1).map(|last| &blocks[last]);
            // Facts and notes follow each other without an empty line.
            let follows = match last {
                None | Some(Fact { .. } | Note(_)) => matches!(block, Fact { .. } | Note(_)),
                Some(Table { title, .. }) => title.is_empty() && matches!(block, Note(_)),
                Some(SummaryBlock::Verbatim { .. }) => false,
            };
            if last.is_some() && !follows {
                lines.push(String::new());
            }
            let repeats_label = matches!(
                (last, block),
                (Some(Fact { label: above, .. }), Fact { label, .. }) if above == label
            );
            lines.extend(Self::block_lines(block, repeats_label, style));
        }
        lines
    }

    /// The text in a style, without a line break at its end: status, result, warnings and details, separated by empty
    /// lines. Each warning begins with `warning:`. Parts without lines are left out.
    pub fn render(&self, style: TextStyle) -> String {
        let warning = |text: &String| {
            let text = printable(text);
            wrap_message(&format!("warning: {text}"), style)
        };
        let details = self.details.as_deref().unwrap_or_default();
        // Status, result, warnings, details: each part is set off by an empty line.
        let mut sections = vec![
            self.headline(style),
            Self::section_lines(&self.result, style),
            self.warnings.iter().map(warning).collect(),
            Self::section_lines(details, style),
        ];
        sections.retain(|lines| !lines.is_empty());
        sections.iter().map(|lines| lines.join("\n")).collect::<Vec<_>>().join("\n\n")
    }
}

impl fmt::Display for Summary {
    /// Writes the summary without color, 80 columns wide.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.render(TextStyle::default()))
    }
}

#[cfg(test)]
mod tests;
