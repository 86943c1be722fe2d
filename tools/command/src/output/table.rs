//! Lays text out in columns.

use std::io::{self, Write};

/// A column: its name, its unit below it, and its width in characters.
#[derive(Debug, Clone, Copy)]
pub struct Column {
    /// Its name.
    pub name: &'static str,
    /// The unit below the name.
    pub unit: &'static str,
    /// Its width in characters.
    pub width: usize,
}

/// Writes the two lines of heading.
///
/// # Errors
///
/// Fails where the output takes no more.
pub fn heading(out: &mut dyn Write, columns: &[Column]) -> io::Result<()> {
    line(out, columns, columns.iter().map(|column| column.name.to_owned()))?;
    line(out, columns, columns.iter().map(|column| column.unit.to_owned()))
}

/// Writes one row, each cell flush right in its column.
///
/// # Errors
///
/// Fails where the output takes no more.
pub fn line(
    out: &mut dyn Write,
    columns: &[Column],
    cells: impl IntoIterator<Item = String>,
) -> io::Result<()> {
    let mut row = String::new();
    for (column, cell) in columns.iter().zip(cells) {
        let width = column.width;
        row.push_str(&format!("{cell:>width$} "));
    }
    writeln!(out, "{}", row.trim_end())
}
