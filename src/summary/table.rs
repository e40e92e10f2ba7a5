//! Tables of text for terminals: a row for each item, a column for each property.
//!
//! Columns are as wide as their longest cell or heading; columns with a heading only are left out. If a table is too
//! wide, columns of the kind `wrapped` shrink, the widest first, and their cells continue on further lines; a line may
//! exceed the width if no column can shrink. Control characters of cells are escaped. Tables are built from items by
//! [`ItemTable`], or row by row as [`SummaryTable`], and a summary shows them. The kinds of columns are `left`, `right`
//! (numbers) and `wrapped`.

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
    /// A column of text with a heading, aligned on the left.
    pub fn left(heading: impl Into<String>) -> Self {
        Self { heading: heading.into(), alignment: Alignment::Left }
    }

    /// A column of numbers with a heading, aligned on the right.
    pub fn right(heading: impl Into<String>) -> Self {
        Self { heading: heading.into(), alignment: Alignment::Right }
    }

    /// A column of longer text with a heading, aligned on the left. Its cells continue on further lines if the table
    /// would be too wide.
    pub fn wrapped(heading: impl Into<String>) -> Self {
        Self { heading: heading.into(), alignment: Alignment::Wrapped }
    }
}

/// Number of columns of a line with cells of these `widths` and [`GAP`] spaces between them; 0 without cells.
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
    /// A table with one row for each of these items, without columns.
    pub fn new(items: impl IntoIterator<Item = T>) -> Self {
        let items: Vec<T> = items.into_iter().collect();
        let rows = vec![Vec::new(); items.len()];
        Self { items, table: SummaryTable { columns: Vec::new(), rows } }
    }

    /// Adds a column. `cell` returns the text of an item, of which control characters are escaped; for `None` the cell
    /// is empty.
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

    /// Adds a column of text, aligned on the left, with the text `cell` of each item or an empty cell.
    pub fn left<C: Into<Option<String>>>(self, heading: &str, cell: impl Fn(&T) -> C) -> Self {
        self.column(TextColumn::left(heading), cell)
    }

    /// Adds a column of numbers, aligned on the right, with the text `cell` of each item or an empty cell.
    pub fn right<C: Into<Option<String>>>(self, heading: &str, cell: impl Fn(&T) -> C) -> Self {
        self.column(TextColumn::right(heading), cell)
    }

    /// Adds a column of longer text, which continues on further lines if the table would be too wide. `cell` returns
    /// the text of each item or none.
    pub fn wrapped<C: Into<Option<String>>>(self, heading: &str, cell: impl Fn(&T) -> C) -> Self {
        self.column(TextColumn::wrapped(heading), cell)
    }
}

impl<T> From<ItemTable<T>> for SummaryTable {
    /// The table with its columns and rows; the items are dropped.
    fn from(built: ItemTable<T>) -> Self {
        built.table
    }
}

impl SummaryTable {
    /// A table with these columns and without rows.
    pub fn new(columns: impl IntoIterator<Item = TextColumn>) -> Self {
        Self { columns: columns.into_iter().collect(), rows: Vec::new() }
    }

    /// Adds a row, with control characters of its cells escaped. Missing cells are empty, and excess ones are dropped.
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

    /// Indices, ascending, of the columns with text in at least one row; headings do not count.
    fn used(&self) -> Vec<usize> {
        // Columns that no row uses are left out.
        let has_text = |k: &usize| self.rows.iter().any(|row| !row[*k].is_empty());
        (0..self.columns.len()).filter(has_text).collect()
    }

    /// Number of columns of the narrowest line that all rows fit into, with wrapped columns at their smallest width and
    /// without an indent. Columns without text do not count.
    pub(crate) fn min_width(&self) -> usize {
        line_width(&self.widths(&self.used(), 0))
    }

    /// Widths of the `used` columns (indices): those of the longest cell or heading. Wrapped ones shrink, the widest
    /// first, until the line fits into `available` columns. None shrinks below its longest word or [`MIN_COLUMN`], so
    /// that the line may exceed these.
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

    /// The headings and the rows as lines of up to `width` columns, of which `indent` are spaces in front. Lines are
    /// longer if columns cannot shrink. Only used columns are shown, and spaces at the ends are removed.
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

/// Items without repetitions, in the order of their first appearance.
pub(crate) fn distinct<T: PartialEq>(items: impl IntoIterator<Item = T>) -> Vec<T> {
    let mut distinct = Vec::new();
    for item in items {
        if !distinct.contains(&item) {
            distinct.push(item);
        }
    }
    distinct
}
