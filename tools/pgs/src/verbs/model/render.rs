//! Lays tables out, for a terminal and as Markdown.

use std::io::{self, Write};

use super::table::{Cell, Table};
use crate::numbers::grouped;
use crate::output::width::{stdout_width, wrapped};

/// Columns before a line of a note.
const BULLET: usize = 4;

/// A cell as people read it.
pub(crate) fn shown(cell: &Cell) -> String {
    match cell {
        // A share of nothing is not finite.
        Cell::Number(value, _) | Cell::Difference(value) | Cell::Share(value)
            if !value.is_finite() =>
        {
            "-".to_owned()
        }
        Cell::Text(text) => text.clone(),
        Cell::Whole(number) => grouped(*number),
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a count, rounded; it saturates"
        )]
        Cell::Number(value, 0) => grouped(value.round() as u64),
        Cell::Number(value, digits) => format!("{value:.digits$}"),
        Cell::Difference(percent) => format!("{percent:+.2} %"),
        Cell::Share(percent) => format!("{percent:.1} %"),
        Cell::Missing => "-".to_owned(),
    }
}

/// Whether a column is flush right: columns with a number are, columns of words are not.
pub(crate) fn at_right(table: &Table, column: usize) -> bool {
    let number = |cell: &Cell| !matches!(cell, Cell::Text(_) | Cell::Missing);
    table.rows.iter().any(|row| number(&row[column]))
}

/// Writes a table in aligned columns.
pub(super) fn terminal(out: &mut dyn Write, table: &Table) -> io::Result<()> {
    writeln!(out, "{}", table.title)?;
    let heads: Vec<String> = table.columns.iter().map(|column| column.head.to_owned()).collect();
    let rows: Vec<Vec<String>> =
        table.rows.iter().map(|row| row.iter().map(shown).collect()).collect();
    let all = || std::iter::once(&heads).chain(&rows);
    let widths: Vec<usize> = (0..heads.len())
        .map(|k| all().map(|row| row[k].chars().count()).max().unwrap_or(0))
        .collect();
    for row in all() {
        let mut line = String::new();
        for (k, (cell, width)) in row.iter().zip(&widths).enumerate() {
            let width = *width;
            line.push_str(&if at_right(table, k) {
                format!("  {cell:>width$}")
            } else {
                format!("  {cell:<width$}")
            });
        }
        writeln!(out, "{}", line.trim_end())?;
    }
    for note in &table.notes {
        for (k, line) in wrapped(note, stdout_width().saturating_sub(BULLET)).iter().enumerate() {
            writeln!(out, "  {} {line}", if k == 0 { "*" } else { " " })?;
        }
    }
    writeln!(out)
}

/// Writes a table as Markdown.
pub(crate) fn markdown(out: &mut dyn Write, table: &Table) -> io::Result<()> {
    let escaped = |text: &str| text.replace('|', "\\|");
    writeln!(out, "### {}\n", table.title)?;
    let heads: Vec<String> = table.columns.iter().map(|column| escaped(column.head)).collect();
    writeln!(out, "| {} |", heads.join(" | "))?;
    let rules: Vec<&str> =
        (0..heads.len()).map(|k| if at_right(table, k) { "--:" } else { ":--" }).collect();
    writeln!(out, "| {} |", rules.join(" | "))?;
    for row in &table.rows {
        let cells: Vec<String> = row.iter().map(|cell| escaped(&shown(cell))).collect();
        writeln!(out, "| {} |", cells.join(" | "))?;
    }
    writeln!(out)?;
    for note in &table.notes {
        writeln!(out, "- {note}")?;
    }
    if !table.notes.is_empty() {
        writeln!(out)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::table::text;
    use super::*;

    fn table() -> Table {
        let mut table = Table::new("t", "A table", &[("name", "name"), ("n", "n"), ("d", "diff.")]);
        table.row([text("a|b"), Cell::Whole(1234), Cell::Difference(0.174)]);
        table.row([text("c"), Cell::Missing, Cell::Number(2.0, 1)]);
        table.note("Said.");
        table
    }

    fn written(by: fn(&mut dyn Write, &Table) -> io::Result<()>) -> String {
        let mut out = Vec::new();
        by(&mut out, &table()).expect("memory takes everything");
        String::from_utf8(out).expect("text")
    }

    #[test]
    fn numbers_stand_at_the_right_and_words_at_the_left() {
        assert_eq!(
            written(terminal),
            "A table\n  name      n    diff.\n  a|b   1,234  +0.17 %\n  c         -      2.0\n  \
             * Said.\n\n"
        );
    }

    #[test]
    fn markdown_has_a_rule_for_each_column_and_no_stray_bar() {
        assert_eq!(
            written(markdown),
            "### A table\n\n| name | n | diff. |\n| :-- | --: | --: |\n| a\\|b | 1,234 | +0.17 % |\n\
             | c | - | 2.0 |\n\n- Said.\n\n"
        );
    }
}
