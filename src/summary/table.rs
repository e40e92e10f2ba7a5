//! Tables whose columns are as wide as their longest cell.

use crate::summary::layout::{columns, wrapped};
use marker_files::printable::printable_name;

/// Spaces between columns.
const GAP: usize = 2;
/// The narrowest a column gets whose cells are wrapped.
const MIN_COLUMN: usize = 14;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Alignment {
    Left,
    Right,
    /// On the left; long cells continue on further lines where the table would be too wide.
    Wrapped,
}

/// A column of a table, with its heading.
#[derive(Clone, Debug, PartialEq)]
pub struct TextColumn {
    heading: String,
    alignment: Alignment,
}

impl TextColumn {
    /// A column of text.
    pub fn left(heading: impl Into<String>) -> Self {
        Self { heading: heading.into(), alignment: Alignment::Left }
    }

    /// A column of numbers.
    pub fn right(heading: impl Into<String>) -> Self {
        Self { heading: heading.into(), alignment: Alignment::Right }
    }

    /// A column of longer text, which continues on further lines where the table would be too wide.
    pub fn wrapped(heading: impl Into<String>) -> Self {
        Self { heading: heading.into(), alignment: Alignment::Wrapped }
    }
}

/// Columns of a line with columns of these widths.
fn total(widths: &[usize]) -> usize {
    widths.iter().sum::<usize>() + GAP * widths.len().saturating_sub(1)
}

/// A table with headings. Columns without any text are left out.
#[derive(Clone, Debug, PartialEq)]
pub struct SummaryTable {
    columns: Vec<TextColumn>,
    rows: Vec<Vec<String>>,
}

impl SummaryTable {
    /// A table without rows.
    pub fn new(columns: impl IntoIterator<Item = TextColumn>) -> Self {
        Self { columns: columns.into_iter().collect(), rows: Vec::new() }
    }

    /// Adds a row; missing cells are empty.
    pub fn row<T: Into<String>>(&mut self, cells: impl IntoIterator<Item = T>) {
        let mut row: Vec<String> =
            cells.into_iter().map(|cell| printable_name(&cell.into()).into_owned()).collect();
        row.resize(self.columns.len(), String::new());
        self.rows.push(row);
    }

    /// Whether the table has no rows.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// The columns that have text.
    fn used(&self) -> Vec<usize> {
        let has_text = |k: &usize| self.rows.iter().any(|row| !row[*k].is_empty());
        (0..self.columns.len()).filter(has_text).collect()
    }

    /// Widths of the used columns without wrapped cells.
    fn natural_widths(&self, used: &[usize]) -> Vec<usize> {
        let natural = |k: &usize| {
            let cells = self.rows.iter().map(|row| columns(&row[*k]));
            cells.max().unwrap_or(0).max(columns(&self.columns[*k].heading))
        };
        used.iter().map(natural).collect()
    }

    /// Columns of the narrowest table.
    pub(crate) fn least_width(&self) -> usize {
        total(&self.widths(&self.used(), 0))
    }

    /// Widths of the used columns: those that are wrapped share the space that the others leave.
    fn widths(&self, used: &[usize], available: usize) -> Vec<usize> {
        let mut widths = self.natural_widths(used);
        let wrapped: Vec<usize> = (0..used.len())
            .filter(|i| self.columns[used[*i]].alignment == Alignment::Wrapped)
            .collect();
        // The widest of them gives way first.
        while total(&widths) > available {
            let widest = wrapped.iter().copied().max_by_key(|i| widths[*i]);
            match widest.filter(|i| widths[*i] > MIN_COLUMN) {
                Some(i) => widths[i] -= 1,
                None => break,
            }
        }
        widths
    }

    /// The heading and the rows.
    pub(crate) fn lines(&self, indent: usize, width: usize) -> Vec<String> {
        let used = self.used();
        let widths = self.widths(&used, width.saturating_sub(indent));
        let headings: Vec<String> = used.iter().map(|k| self.columns[*k].heading.clone()).collect();
        let rows = self.rows.iter().map(|row| used.iter().map(|k| row[*k].clone()).collect());
        let mut lines = Vec::new();
        for cells in std::iter::once(headings).chain(rows.collect::<Vec<Vec<String>>>()) {
            // Cells of several lines.
            let parts: Vec<Vec<String>> = cells
                .iter()
                .zip(&widths)
                .zip(&used)
                .map(|((cell, width), k)| match self.columns[*k].alignment {
                    Alignment::Wrapped if columns(cell) > *width => wrapped(cell, *width, 0),
                    _ => vec![cell.clone()],
                })
                .collect();
            let height = parts.iter().map(Vec::len).max().unwrap_or(0);
            for i in 0..height {
                let mut line = " ".repeat(indent);
                for ((part, width), k) in parts.iter().zip(&widths).zip(&used) {
                    let cell = part.get(i).map_or("", String::as_str);
                    let padding = " ".repeat(width.saturating_sub(columns(cell)));
                    match self.columns[*k].alignment {
                        Alignment::Right => line = line + &padding + cell,
                        _ => line = line + cell + &padding,
                    }
                    line.push_str(&" ".repeat(GAP));
                }
                lines.push(line.trim_end().to_string());
            }
        }
        lines
    }
}
