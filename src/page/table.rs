//! Tables that scroll on narrow screens and leave out empty columns.

use crate::page::html::escaped;
use crate::page::number::NONE;

/// A table with a heading for every row. Cells are HTML.
pub(super) struct Table {
    /// What the table shows, as text, for readers that do not see it.
    name: String,
    id: Option<&'static str>,
    class: &'static str,
    heads: Vec<String>,
    rows: Vec<Row>,
}

struct Row {
    class: &'static str,
    /// The heading of the row is the first.
    cells: Vec<Option<String>>,
}

impl Table {
    /// A table with these heads, the first of which is that of the headings of the rows.
    pub fn new(name: &str, heads: impl IntoIterator<Item = impl Into<String>>) -> Self {
        let heads = heads.into_iter().map(Into::into).collect();
        Self { name: name.into(), id: None, class: "", heads, rows: Vec::new() }
    }

    pub fn id(self, id: &'static str) -> Self {
        Self { id: Some(id), ..self }
    }

    pub fn class(self, class: &'static str) -> Self {
        Self { class, ..self }
    }

    /// Adds a row: its heading, and its cells where there are any.
    pub fn row(&mut self, heading: impl Into<String>, cells: Vec<Option<String>>) {
        self.marked_row("", heading, cells);
    }

    /// Adds a row of a class.
    pub fn marked_row(
        &mut self,
        class: &'static str,
        heading: impl Into<String>,
        cells: Vec<Option<String>>,
    ) {
        let cells = std::iter::once(Some(heading.into())).chain(cells).collect();
        self.rows.push(Row { class, cells });
    }

    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// The HTML, without columns that are empty in all rows; nothing without rows.
    pub fn html(&self) -> String {
        self.of_rows(0..self.rows.len())
    }

    /// The first rows, and a table of the others that is folded under their number and `name`, a plural.
    pub fn folded_after(&self, shown: usize, name: &str) -> String {
        let all = self.rows.len();
        if all <= shown + 1 {
            return self.html();
        }
        let more = format!("{} more {name}", all - shown);
        self.of_rows(0..shown) + &crate::page::html::folded(&more, &self.of_rows(shown..all))
    }

    fn of_rows(&self, range: std::ops::Range<usize>) -> String {
        let rows = &self.rows[range];
        if rows.is_empty() {
            return String::new();
        }
        let is_filled = |k: usize| {
            rows.iter().any(|row| matches!(row.cells.get(k), Some(Some(text)) if !text.is_empty()))
        };
        let kept: Vec<usize> = (0..self.heads.len()).filter(|k| *k == 0 || is_filled(*k)).collect();
        let head = |k: &usize| format!("<th scope=\"col\">{}</th>", self.heads[*k]);
        let heads: String = kept.iter().map(head).collect();
        let cell = |row: &Row, k: usize| {
            let text = row.cells.get(k).and_then(Option::as_deref).unwrap_or(NONE);
            match k {
                0 => format!("<th scope=\"row\">{text}</th>"),
                // A cell may bring its own attributes.
                _ if text.starts_with("<td") => text.to_string(),
                _ => format!("<td>{text}</td>"),
            }
        };
        let body: String = rows
            .iter()
            .map(|row| {
                let cells: String = kept.iter().map(|k| cell(row, *k)).collect();
                format!("<tr{}>{cells}</tr>\n", attribute("class", row.class))
            })
            .collect();
        let name = escaped(&self.name);
        let id = attribute("id", self.id.unwrap_or_default());
        let class = attribute("class", self.class);
        format!(
            "<div class=\"wide\" tabindex=\"0\" role=\"region\" aria-label=\"{name}\"><table{id}{class}>\
             <thead><tr>{heads}</tr></thead>\n<tbody>{body}</tbody></table></div>\n"
        )
    }
}

fn attribute(name: &str, value: &str) -> String {
    if value.is_empty() { String::new() } else { format!(" {name}=\"{value}\"") }
}

/// A table of keys and plain text.
pub(super) fn of_keys(rows: &[(&str, String)]) -> String {
    let row = |(key, value): &(&str, String)| {
        format!("<tr><th>{key}</th><td>{}</td></tr>\n", escaped(value))
    };
    format!("<table class=\"plain\">{}</table>", rows.iter().map(row).collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn empty_columns_are_left_out_and_missing_cells_have_a_dash() {
        let mut table = Table::new("<name>", ["a", "b", "c", "d"]);
        table.row("1", vec![None, Some("x".into()), Some(String::new())]);
        table.row("2", vec![None, None, None]);
        let html = table.html();
        assert!(html.contains("aria-label=\"&lt;name&gt;\""));
        assert_eq!(html.matches("scope=\"col\"").count(), 2, "{html}");
        assert!(html.contains(">c<") && !html.contains(">b<") && !html.contains(">d<"));
        assert!(html.contains("<td>\u{2013}</td>"));
        assert!(Table::new("none", ["a"]).html().is_empty());
    }

    #[test]
    fn rows_beyond_the_shown_ones_are_folded() {
        let mut table = Table::new("rows", ["a", "b"]);
        (0..5).for_each(|k| table.row(k.to_string(), vec![Some("x".into())]));
        let html = table.folded_after(3, "rows");
        assert_eq!((html.matches("<table").count(), html.matches("<details").count()), (2, 1));
        assert!(html.contains("2 more rows"));
    }
}
