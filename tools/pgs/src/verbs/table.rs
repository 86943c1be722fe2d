//! This file lays text out in columns.

use std::io::{self, Write};

/// A column: two lines of heading, and its width in characters.
#[derive(Debug, Clone, Copy)]
pub(super) struct Column {
    pub(super) name: &'static str,
    pub(super) unit: &'static str,
    pub(super) width: usize,
}

/// Writes the two lines of heading.
pub(super) fn heading(out: &mut dyn Write, columns: &[Column]) -> io::Result<()> {
    line(out, columns, columns.iter().map(|column| column.name.to_owned()))?;
    line(out, columns, columns.iter().map(|column| column.unit.to_owned()))
}

/// Writes one row, each cell at the right of its column.
pub(super) fn line(
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

/// A whole number with a comma between groups of three digits.
pub(crate) fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (k, digit) in digits.chars().enumerate() {
        if k > 0 && (digits.len() - k).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_are_grouped_from_the_right() {
        assert_eq!(grouped(0), "0");
        assert_eq!(grouped(999), "999");
        assert_eq!(grouped(1000), "1,000");
        assert_eq!(grouped(2_066_270), "2,066,270");
    }
}
