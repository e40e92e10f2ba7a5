//! HTML tables: a row for each item, a column for each of its properties.
//!
//! [`HtmlTable`] is built from items, and columns by functions that return the cell of an item as text (`text`,
//! escaped) or HTML (`html`). `id`, `class` and `row_class` set an identifier and CSS classes. The first column has the
//! headings of the rows. Other columns without content are left out, missing cells have a dash, and rows beyond a
//! number can be folded (`render_folded`), except a single one. Output is HTML, empty without rows: a labeled region
//! that scrolls on narrow screens. [`KeyTable`] is a table of keys (HTML) with one text each; `row_if_any` adds a row
//! only if there is a text.

use crate::page::html::{escaped, folded};
use crate::page::number::MISSING;
use std::ops::Range;

/// A table of items of type `T` under construction. The first column has the headings of the rows.
pub(super) struct HtmlTable<T> {
    /// Description for screen readers.
    name: String,
    id: &'static str,
    class: &'static str,
    heads: Vec<String>,
    rows: Vec<ItemRow<T>>,
}

/// An item with its CSS class and its cells in HTML, `None` where there is no value.
struct ItemRow<T> {
    item: T,
    class: &'static str,
    cells: Vec<Option<String>>,
}

impl<T> HtmlTable<T> {
    /// A table of these items without columns. `name` (text) describes it for screen readers.
    pub fn new(name: &str, items: impl IntoIterator<Item = T>) -> Self {
        let row = |item| ItemRow { item, class: "", cells: Vec::new() };
        let rows = items.into_iter().map(row).collect();
        Self { name: name.into(), id: "", class: "", heads: Vec::new(), rows }
    }

    /// Sets the identifier of the table on its page.
    pub fn id(self, id: &'static str) -> Self {
        Self { id, ..self }
    }

    /// Sets the CSS class of the table.
    pub fn class(self, class: &'static str) -> Self {
        Self { class, ..self }
    }

    /// Sets the CSS class of each row by its item; rows with an empty one have none.
    pub fn row_class(mut self, class: impl Fn(&T) -> &'static str) -> Self {
        self.rows.iter_mut().for_each(|row| row.class = class(&row.item));
        self
    }

    /// Adds a column of text below a heading (text); `cell` returns the text of an item, or `None` for a dash.
    pub fn text<C: Into<Option<String>>>(self, head: &str, cell: impl Fn(&T) -> C) -> Self {
        self.html(head, |item| cell(item).into().map(|text| escaped(&text)))
    }

    /// Adds a column of HTML below a heading (text); `cell` returns the HTML of an item, or `None` for a dash. A cell
    /// with attributes of its own begins with `<td`.
    pub fn html<C: Into<Option<String>>>(mut self, head: &str, cell: impl Fn(&T) -> C) -> Self {
        self.heads.push(escaped(head));
        self.rows.iter_mut().for_each(|row| row.cells.push(cell(&row.item).into()));
        self
    }

    /// The table as HTML, without columns that have no content; empty without rows.
    pub fn render(&self) -> String {
        self.render_rows(0..self.rows.len())
    }

    /// The first `shown` rows as HTML, and a folded table of the others under their number and `plural`, their name. A
    /// single further row is not folded. Empty without rows.
    pub fn render_folded(&self, shown: usize, plural: &str) -> String {
        let all = self.rows.len();
        // Folding a single row would save no space.
        if all <= shown + 1 {
            return self.render();
        }
        let summary = format!("Show {} more {plural}", all - shown);
        self.render_rows(0..shown) + &folded(&summary, &self.render_rows(shown..all))
    }

    /// The table with a range of its rows only, as HTML, without columns that have no content in them (the first is
    /// kept); empty without rows in it.
    fn render_rows(&self, range: Range<usize>) -> String {
        let rows = &self.rows[range];
        if rows.is_empty() {
            return String::new();
        }
        // A column without content belongs to an analysis that was not made.
        let has_content =
            |k: usize| rows.iter().any(|r| !r.cells[k].as_deref().unwrap_or("").is_empty());
        // The heading of a row is kept even if it is empty.
        let kept: Vec<usize> =
            (0..self.heads.len()).filter(|k| *k == 0 || has_content(*k)).collect();
        let head = |k: &usize| format!("<th scope=\"col\">{}</th>", self.heads[*k]);
        let heads: String = kept.iter().map(head).collect();
        let mut body = String::new();
        for row in rows {
            body += &format!("<tr{}>", attribute("class", row.class));
            for k in &kept {
                let cell = row.cells[*k].as_deref().unwrap_or(MISSING);
                body += &match k {
                    0 => format!("<th scope=\"row\">{}</th>", with_line_breaks(cell)),
                    _ if cell.starts_with("<td") => cell.to_string(),
                    _ => format!("<td>{cell}</td>"),
                };
            }
            body += "</tr>\n";
        }
        let name = escaped(&self.name);
        let (id, class) = (attribute("id", self.id), attribute("class", self.class));
        format!(
            "<div class=\"wide\" tabindex=\"0\" role=\"region\" aria-label=\"{name}\"><table{id}{class}>\
             <thead><tr>{heads}</tr></thead>\n<tbody>{body}</tbody></table></div>\n"
        )
    }
}

/// HTML with permitted line breaks (`<wbr>`) after a period or an underscore before a letter, so that narrow screens do
/// not break names of parameters within a word. Tags and entities stay as they are.
fn with_line_breaks(html: &str) -> String {
    let (mut broken, mut is_markup) = (String::with_capacity(html.len()), false);
    let mut characters = html.chars().peekable();
    while let Some(c) = characters.next() {
        broken.push(c);
        match c {
            // A break within a tag or an entity would destroy it.
            '<' | '&' => is_markup = true,
            '>' | ';' => is_markup = false,
            '.' | '_'
                if !is_markup && characters.peek().is_some_and(|next| next.is_alphabetic()) =>
            {
                broken += "<wbr>";
            }
            _ => {}
        }
    }
    broken
}

/// The attribute of an HTML element with a space before it; empty without a value.
fn attribute(name: &str, value: &str) -> String {
    if value.is_empty() { String::new() } else { format!(" {name}=\"{value}\"") }
}

/// A table of keys with one text each, under construction: the HTML of its rows.
#[derive(Default)]
pub(super) struct KeyTable(String);

impl KeyTable {
    /// Adds a row with a key (HTML) and a text, which is escaped.
    pub fn row(mut self, key: &str, text: impl AsRef<str>) -> Self {
        self.0 += &format!("<tr><th>{key}</th><td>{}</td></tr>\n", escaped(text.as_ref()));
        self
    }

    /// Adds a row with a key (HTML) and a text, if there is a text.
    pub fn row_if_any(self, key: &str, text: Option<impl AsRef<str>>) -> Self {
        text.into_iter().fold(self, |table, text| table.row(key, text))
    }

    /// The table as HTML, also without rows.
    pub fn render(&self) -> String {
        format!("<table class=\"plain\">{}</table>", self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn row_headings_break_after_periods_but_not_within_tags() {
        let html = with_line_breaks("rod.section_a <code title=\"a.b\">x.y</code> 1.5");
        assert_eq!(html, "rod.<wbr>section_<wbr>a <code title=\"a.b\">x.<wbr>y</code> 1.5");
    }

    #[test]
    fn empty_columns_are_left_out_and_missing_cells_have_a_dash() {
        let table = HtmlTable::new("<name>", [true, false])
            .text("a", |_| "<1>".to_string())
            .text("b", |_| None)
            .html("c", |first| first.then(|| "<b>x</b>".to_string()))
            .text("d", |first| first.then(String::new));
        let html = table.render();
        assert!(html.contains("aria-label=\"&lt;name&gt;\"") && html.contains("&lt;1&gt;"));
        assert_eq!(html.matches("scope=\"col\"").count(), 2, "{html}");
        assert!(html.contains(">c<") && !html.contains(">b</th>") && !html.contains(">d<"));
        assert!(html.contains("<td><b>x</b></td>") && html.contains("<td>\u{2013}</td>"));
        assert!(HtmlTable::new("none", [0; 0]).render().is_empty());
    }

    #[test]
    fn rows_beyond_the_shown_ones_are_folded() {
        let table = HtmlTable::new("rows", 0..5).text("a", |k: &i32| k.to_string());
        let html = table.render_folded(3, "rows");
        assert_eq!((html.matches("<table").count(), html.matches("<details").count()), (2, 1));
        assert!(html.contains("2 more rows"));
    }
}
