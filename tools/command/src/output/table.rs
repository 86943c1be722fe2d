//! A table of typed cells, and its four renderings: text, JSON, Markdown and HTML.

use std::fmt::Write as _;

use crate::numbers::{grouped, number, signed};
use crate::output::width::wrapped;
use serde_json::{Map, Value, json};

/// The content of a table's cell.
#[derive(Debug, Clone, PartialEq)]
pub enum Cell {
    /// Words.
    Text(String),
    /// A count.
    Whole(u64),
    /// A number, and its digits behind the point.
    Number(f64, usize),
    /// A number with five digits.
    Digits(f64),
    /// The same with its sign.
    Signed(f64),
    /// Percent with its sign.
    Difference(f64),
    /// Percent.
    Share(f64),
    /// Unknown, or of another scene.
    Missing,
}

/// A cell of words.
pub fn text(value: impl Into<String>) -> Cell {
    Cell::Text(value.into())
}

impl Cell {
    /// The cell, or the mark of a missing one.
    pub fn known<T>(value: Option<T>, cell: impl FnOnce(T) -> Self) -> Self {
        value.map_or(Self::Missing, cell)
    }

    /// As people read it.
    pub fn shown(&self) -> String {
        match self {
            // A share of nothing is not finite.
            Self::Number(value, _) | Self::Difference(value) | Self::Share(value)
                if !value.is_finite() =>
            {
                "-".to_owned()
            }
            Self::Text(text) => text.clone(),
            Self::Whole(number) => grouped(*number),
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "a count, rounded; it saturates"
            )]
            Self::Number(value, 0) => grouped(value.round() as u64),
            Self::Number(value, digits) => format!("{value:.digits$}"),
            Self::Digits(value) => number(*value),
            Self::Signed(value) => signed(*value),
            Self::Difference(percent) => format!("{percent:+.2} %"),
            Self::Share(percent) => format!("{percent:.1} %"),
            Self::Missing => "-".to_owned(),
        }
    }

    fn to_json(&self) -> Value {
        match self {
            Self::Text(text) => json!(text),
            Self::Whole(number) => json!(number),
            Self::Number(value, _)
            | Self::Digits(value)
            | Self::Signed(value)
            | Self::Difference(value)
            | Self::Share(value) => json!(value),
            Self::Missing => Value::Null,
        }
    }
}

/// A column: its JSON key, and its heading, whose second line is the unit.
#[derive(Debug, Clone, Copy)]
pub struct Column {
    /// Its key for programs.
    pub key: &'static str,
    /// Its heading.
    pub head: &'static str,
}

/// Cells in a line, each at the right or the left of its width, with a space between two.
pub(super) fn aligned(
    cells: &[String],
    places: impl Iterator<Item = (usize, bool)>,
    space: &str,
) -> String {
    let cells: Vec<String> = places
        .zip(cells)
        .map(|((width, at_right), cell)| match at_right {
            true => format!("{cell:>width$}"),
            false => format!("{cell:<width$}"),
        })
        .collect();
    cells.join(space).trim_end().to_owned()
}

/// A cell of a row, which may bring its column.
pub trait InRow {
    /// The column, if the cell brings it, and the cell.
    fn split(self) -> (Option<Column>, Cell);
}

impl InRow for Cell {
    fn split(self) -> (Option<Column>, Cell) {
        (None, self)
    }
}

impl InRow for (&'static str, &'static str, Cell) {
    fn split(self) -> (Option<Column>, Cell) {
        let (key, head, cell) = self;
        (Some(Column { key, head }), cell)
    }
}

/// A table with its notes.
#[derive(Debug, Clone)]
pub struct Table {
    /// Its name for programs.
    pub id: &'static str,
    /// Its title.
    pub title: String,
    /// Its columns.
    pub columns: Vec<Column>,
    /// Its rows, a cell a column.
    pub rows: Vec<Vec<Cell>>,
    /// Notes below the rows.
    pub notes: Vec<String>,
}

/// Columns before a line of a note.
const BULLET: usize = 4;

/// Text as HTML.
pub fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

impl Table {
    /// A table whose first row brings the columns.
    pub fn new(id: &'static str, title: impl Into<String>) -> Self {
        Self::with_columns(id, title, &[])
    }

    /// A table without rows; columns are (key, heading).
    pub fn with_columns(
        id: &'static str,
        title: impl Into<String>,
        columns: &[(&'static str, &'static str)],
    ) -> Self {
        let columns = columns.iter().map(|(key, head)| Column { key, head }).collect();
        Self { id, title: title.into(), columns, rows: Vec::new(), notes: Vec::new() }
    }

    /// Adds a row of cells, or of (key, heading, cell).
    pub fn row<C: InRow>(&mut self, cells: impl IntoIterator<Item = C>) {
        let (columns, cells): (Vec<_>, Vec<_>) = cells.into_iter().map(InRow::split).unzip();
        if self.columns.is_empty() {
            self.columns = columns.into_iter().flatten().collect();
        }
        debug_assert_eq!(cells.len(), self.columns.len(), "{}", self.id);
        self.rows.push(cells);
    }

    /// Adds a note below the rows.
    pub fn note(&mut self, note: impl Into<String>) {
        self.notes.push(note.into());
    }

    /// Whether a column is flush right: columns with a number are, columns of words are not.
    fn at_right(&self, column: usize) -> bool {
        let number = |cell: &Cell| !matches!(cell, Cell::Text(_) | Cell::Missing);
        self.rows.iter().any(|row| number(&row[column]))
    }

    /// The lines of the headings, one cell a column.
    fn heads(&self) -> Vec<Vec<String>> {
        let lines = self.columns.iter().map(|column| column.head.lines().count()).max();
        let line = |k: usize| {
            let columns = self.columns.iter();
            columns.map(|column| column.head.lines().nth(k).unwrap_or("").to_owned()).collect()
        };
        (0..lines.unwrap_or(0)).map(line).collect()
    }

    /// The table in aligned columns, and its notes in lines of at most `width`. A table of more than
    /// `columns` goes on below itself, with its first column again.
    pub fn to_text(&self, width: usize, columns: usize) -> String {
        let mut out = format!("{}\n", self.title);
        let rows = self.rows.iter().map(|row| row.iter().map(Cell::shown).collect());
        let lines: Vec<Vec<String>> = self.heads().into_iter().chain(rows).collect();
        let widths: Vec<usize> = (0..self.columns.len())
            .map(|k| lines.iter().map(|row| row[k].chars().count()).max().unwrap_or(0))
            .collect();
        let mut parts = vec![Vec::new()];
        for k in 0..widths.len() {
            let taken = |part: &Vec<usize>| part.iter().map(|k| widths[*k] + 2).sum::<usize>();
            let is_full = |part: &Vec<usize>| taken(part) + widths[k] + 2 > columns;
            if parts.last().is_some_and(|part| part.len() > 1 && is_full(part)) {
                parts.push(vec![0]);
            }
            parts.last_mut().into_iter().for_each(|part| part.push(k));
        }
        for (at, part) in parts.iter().enumerate() {
            out += if at > 0 { "\n" } else { "" };
            for row in &lines {
                let cells: Vec<String> = part.iter().map(|k| row[*k].clone()).collect();
                let places = part.iter().map(|k| (widths[*k], self.at_right(*k)));
                let line = format!("  {}", aligned(&cells, places, "  "));
                let _ = writeln!(out, "{}", line.trim_end());
            }
        }
        for note in &self.notes {
            for (k, line) in wrapped(note, width.saturating_sub(BULLET)).iter().enumerate() {
                let _ = writeln!(out, "  {} {line}", if k == 0 { "*" } else { " " });
            }
        }
        out
    }

    /// For programs.
    pub fn to_json(&self) -> Value {
        let row = |cells: &Vec<Cell>| {
            let members = self.columns.iter().zip(cells);
            members
                .map(|(column, cell)| (column.key.to_owned(), cell.to_json()))
                .collect::<Map<_, _>>()
        };
        json!({
            "id": self.id,
            "title": self.title,
            "columns": self.columns.iter().map(|column| column.key).collect::<Vec<_>>(),
            "rows": self.rows.iter().map(row).collect::<Vec<_>>(),
            "notes": self.notes,
        })
    }

    /// The heading of a column in one line.
    fn head(column: &Column) -> String {
        column.head.replace('\n', " ").trim().to_owned()
    }

    /// As Markdown, behind a heading of the third level.
    pub fn to_markdown(&self) -> String {
        let escaped = |text: &str| text.replace('|', "\\|");
        let heads: Vec<String> =
            self.columns.iter().map(|column| escaped(&Self::head(column))).collect();
        let rules: Vec<&str> =
            (0..heads.len()).map(|k| if self.at_right(k) { "--:" } else { ":--" }).collect();
        let mut out =
            format!("### {}\n\n| {} |\n| {} |\n", self.title, heads.join(" | "), rules.join(" | "));
        for row in &self.rows {
            let cells: Vec<String> = row.iter().map(|cell| escaped(&cell.shown())).collect();
            let _ = writeln!(out, "| {} |", cells.join(" | "));
        }
        out.push('\n');
        for note in &self.notes {
            let _ = writeln!(out, "- {note}");
        }
        if !self.notes.is_empty() {
            out.push('\n');
        }
        out
    }

    /// Its id on a page.
    pub fn anchor(&self) -> String {
        anchor(self.id)
    }

    /// As a section of a page.
    pub fn to_html(&self) -> String {
        let mut out = format!(
            "<section class=\"table\" id=\"{}\">\n<h3>{}</h3>\n<div class=\"wide\"><table>\n\
             <thead><tr>",
            self.anchor(),
            escaped(&self.title)
        );
        let class = |column| if self.at_right(column) { " class=\"number\"" } else { "" };
        for (place, column) in self.columns.iter().enumerate() {
            let _ = write!(out, "<th{}>{}</th>", class(place), escaped(&Self::head(column)));
        }
        out.push_str("</tr></thead>\n<tbody>\n");
        for row in &self.rows {
            out.push_str("<tr>");
            for (place, cell) in row.iter().enumerate() {
                let _ = write!(out, "<td{}>{}</td>", class(place), escaped(&cell.shown()));
            }
            out.push_str("</tr>\n");
        }
        out.push_str("</tbody>\n</table></div>\n");
        if !self.notes.is_empty() {
            out.push_str("<ul>\n");
            for note in &self.notes {
                let _ = writeln!(out, "<li>{}</li>", escaped(note));
            }
            out.push_str("</ul>\n");
        }
        out.push_str("</section>\n");
        out
    }
}

/// The id of a table on a page.
pub fn anchor(id: &str) -> String {
    format!("table-{}", id.to_lowercase().replace(['.', '_'], "-"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Table {
        let mut table = Table::with_columns(
            "T.1",
            "A table",
            &[("name", "name"), ("n", "n\nall"), ("d", "diff.")],
        );
        table.row([text("a|b"), Cell::Whole(1234), Cell::Difference(0.174)]);
        table.row([text("<c>"), Cell::Missing, Cell::Number(2.0, 1)]);
        table.note("Said.");
        table
    }

    #[test]
    fn numbers_stand_at_the_right_and_words_at_the_left() {
        assert_eq!(
            table().to_text(80, 80),
            "A table\n  name      n    diff.\n          all\n  a|b   1,234  +0.17 %\n  <c>       \
             -      \
             2.0\n  * Said.\n"
        );
    }

    #[test]
    fn a_table_wider_than_the_terminal_goes_on_below_with_its_first_column() {
        assert_eq!(
            table().to_text(80, 14),
            "A table\n  name      n\n          all\n  a|b   1,234\n  <c>       -\n\n  name    diff.\n\n  \
             a|b   +0.17 %\n  <c>       2.0\n  * Said.\n"
        );
    }

    #[test]
    fn markdown_has_a_rule_for_each_column_and_no_stray_bar() {
        assert_eq!(
            table().to_markdown(),
            "### A table\n\n| name | n all | diff. |\n| :-- | --: | --: |\n\
             | a\\|b | 1,234 | +0.17 % |\n| <c> | - | 2.0 |\n\n- Said.\n\n"
        );
    }

    #[test]
    fn programs_get_numbers_and_nothing_for_a_missing_one() {
        let document = table().to_json();
        assert_eq!(document["rows"][0], json!({ "name": "a|b", "n": 1234, "d": 0.174 }));
        assert_eq!(document["rows"][1]["n"], Value::Null);
    }

    #[test]
    fn a_page_has_an_anchor_and_no_stray_mark() {
        let html = table().to_html();
        assert!(html.contains("id=\"table-t-1\"") && html.contains("&lt;c&gt;"), "{html}");
        assert!(html.contains("<th class=\"number\">n all</th>"), "{html}");
    }
}
