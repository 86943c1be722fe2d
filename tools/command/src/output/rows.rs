//! Rows of a table that are printed as they come, in columns of fixed widths.

use std::io::{self, Write};

use super::table::aligned;

/// A column of rows that are printed as they come, at the right of its width in characters.
#[derive(Debug, Clone, Copy)]
pub struct Fixed {
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
pub fn heading(out: &mut dyn Write, columns: &[Fixed]) -> io::Result<()> {
    line(out, columns, columns.iter().map(|column| column.name.to_owned()))?;
    line(out, columns, columns.iter().map(|column| column.unit.to_owned()))
}

/// Writes one row.
///
/// # Errors
///
/// Fails where the output takes no more.
pub fn line(
    out: &mut dyn Write,
    columns: &[Fixed],
    cells: impl IntoIterator<Item = String>,
) -> io::Result<()> {
    let cells: Vec<String> = cells.into_iter().collect();
    let places = columns.iter().map(|column| (column.width, true));
    writeln!(out, "{}", aligned(&cells, places, " "))
}
