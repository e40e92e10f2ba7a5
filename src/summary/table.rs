//! Tables of text for terminals: a row for each item, a column for each property.
//!
//! Columns are as wide as their longest cell, and columns without any text are left out. If a table is too wide, columns of the
//! kind `wrapped` shrink, the widest first, and their cells continue on further lines.

use crate::summary::layout::{columns, wrapped};
use marker_files::printable::printable_name;

/// Spaces between columns.
const GAP: usize = 2;
/// Smallest width of a column whose cells are wrapped, columns of the terminal; a longer word widens it.
const MIN_COLUMN: usize = 12;

/// Position of the cells of a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Alignment {
    Left,
    Right,
    /// On the left; long cells continue on further lines if the table would be too wide.
    Wrapped,
}

/// A column of a table: its heading and the alignment of its cells.
#[derive(Clone, Debug, PartialEq)]
pub struct TextColumn {
    heading: String,
    alignment: Alignment,
}

impl TextColumn {
    /// A column of text, aligned on the left.
    pub fn left(heading: impl Into<String>) -> Self {
        Self { heading: heading.into(), alignment: Alignment::Left }
    }

    /// A column of numbers, aligned on the right.
    pub fn right(heading: impl Into<String>) -> Self {
        Self { heading: heading.into(), alignment: Alignment::Right }
    }

    /// A column of longer text, which continues on further lines if the table would be too wide.
    pub fn wrapped(heading: impl Into<String>) -> Self {
        Self { heading: heading.into(), alignment: Alignment::Wrapped }
    }
}

/// Columns of the terminal of a line with cells of these widths.
fn line_width(widths: &[usize]) -> usize {
    widths.iter().sum::<usize>() + GAP * widths.len().saturating_sub(1)
}

/// A table with headings. Columns without any text are left out.
#[derive(Clone, Debug, PartialEq)]
pub struct SummaryTable {
    columns: Vec<TextColumn>,
    rows: Vec<Vec<String>>,
}

/// A table under construction with a row for each item of type `T`. A cell without a value is empty.
pub struct ItemTable<T> {
    items: Vec<T>,
    table: SummaryTable,
}

impl<T> ItemTable<T> {
    /// A table of these items without columns.
    pub fn new(items: impl IntoIterator<Item = T>) -> Self {
        let items: Vec<T> = items.into_iter().collect();
        let rows = vec![Vec::new(); items.len()];
        Self { items, table: SummaryTable { columns: Vec::new(), rows } }
    }

    /// Adds a column; `cell` returns the text of an item, of which control characters are escaped, or `None`.
    fn column<C: Into<Option<String>>>(
        mut self,
        column: TextColumn,
        cell: impl Fn(&T) -> C,
    ) -> Self {
        self.table.columns.push(column);
        for (row, item) in self.table.rows.iter_mut().zip(&self.items) {
            row.push(printable_name(&cell(item).into().unwrap_or_default()).into_owned());
        }
        self
    }

    /// Adds a column of text, aligned on the left.
    pub fn left<C: Into<Option<String>>>(self, heading: &str, cell: impl Fn(&T) -> C) -> Self {
        self.column(TextColumn::left(heading), cell)
    }

    /// Adds a column of numbers, aligned on the right.
    pub fn right<C: Into<Option<String>>>(self, heading: &str, cell: impl Fn(&T) -> C) -> Self {
        self.column(TextColumn::right(heading), cell)
    }

    /// Adds a column of longer text, which continues on further lines if the table would be too wide.
    pub fn wrapped<C: Into<Option<String>>>(self, heading: &str, cell: impl Fn(&T) -> C) -> Self {
        self.column(TextColumn::wrapped(heading), cell)
    }
}

impl<T> From<ItemTable<T>> for SummaryTable {
    /// Converts `ItemTable<T>` to `SummaryTable`.
    fn from(built: ItemTable<T>) -> Self {
        built.table
    }
}

impl SummaryTable {
    /// A table with these columns and without rows.
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

    /// Indices of the columns that have text.
    fn used(&self) -> Vec<usize> {
        // Columns that no row uses are left out.
        let has_text = |k: &usize| self.rows.iter().any(|row| !row[*k].is_empty());
        (0..self.columns.len()).filter(has_text).collect()
    }

    /// Width of the narrowest line that all rows fit into, with all wrapped columns at their smallest width.
    pub(crate) fn min_width(&self) -> usize {
        line_width(&self.widths(&self.used(), 0))
    }

    /// Widths of the `used` columns (indices). Wrapped ones share the space that the others leave of the `available` columns; the
    /// result may exceed it if they cannot shrink further.
    fn widths(&self, used: &[usize], available: usize) -> Vec<usize> {
        let natural = |k: &usize| {
            let cells = self.rows.iter().map(|row| columns(&row[*k]));
            cells.max().unwrap_or(0).max(columns(&self.columns[*k].heading))
        };
        let mut widths: Vec<usize> = used.iter().map(natural).collect();
        let longest_word = |k: usize| {
            let words = self.rows.iter().flat_map(|row| row[k].split_whitespace());
            words.map(columns).max().unwrap_or(0)
        };
        // A column keeps its longest word.
        let least = |i: &usize| longest_word(used[*i]).max(MIN_COLUMN);
        let is_wrapped = |i: &usize| self.columns[used[*i]].alignment == Alignment::Wrapped;
        let wrapped: Vec<usize> = (0..used.len()).filter(is_wrapped).collect();
        // The widest column that may shrink gives way first.
        while line_width(&widths) > available {
            let can_shrink = wrapped.iter().filter(|i| widths[**i] > least(i));
            match can_shrink.max_by_key(|i| widths[**i]) {
                Some(i) => widths[*i] -= 1,
                None => break,
            }
        }
        widths
    }

    /// The heading and the rows as lines of up to `width` columns, of which `indent` are spaces in front.
    pub(crate) fn lines(&self, indent: usize, width: usize) -> Vec<String> {
        let used = self.used();
        let widths = self.widths(&used, width.saturating_sub(indent));
        let headings: Vec<String> = self.columns.iter().map(|c| c.heading.clone()).collect();
        let mut lines = Vec::new();
        for row in std::iter::once(&headings).chain(&self.rows) {
            // A row is as high as its highest wrapped cell.
            let cell_lines = |(k, width): (&usize, &usize)| match self.columns[*k].alignment {
                Alignment::Wrapped if columns(&row[*k]) > *width => wrapped(&row[*k], *width),
                _ => vec![row[*k].clone()],
            };
            let cells: Vec<Vec<String>> = used.iter().zip(&widths).map(cell_lines).collect();
            for i in 0..cells.iter().map(Vec::len).max().unwrap_or(0) {
                let mut line = " ".repeat(indent);
                for ((cell, width), k) in cells.iter().zip(&widths).zip(&used) {
                    let text = cell.get(i).map_or("", String::as_str);
                    line += &match self.columns[*k].alignment {
                        Alignment::Right => format!("{text:>width$}"),
                        _ => format!("{text:<width$}"),
                    };
                    line += &" ".repeat(GAP);
                }
                lines.push(line.trim_end().to_string());
            }
        }
        lines
    }
}

/// Items without repetitions, in the order of their first appearance, such as the columns of several results.
#[cfg(feature = "page")]
pub(crate) fn distinct<T: PartialEq>(items: impl IntoIterator<Item = T>) -> Vec<T> {
    let mut distinct = Vec::new();
    for item in items {
        if !distinct.contains(&item) {
            distinct.push(item);
        }
    }
    distinct
}
