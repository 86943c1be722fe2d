//! A text that grows by lines.

use std::fmt::{self, Write as _};

/// Verilog that is being written.
#[derive(Debug, Default)]
pub(super) struct Text(String);

impl Text {
    /// Appends a line.
    pub(super) fn line(&mut self, line: fmt::Arguments<'_>) {
        // A write to a `String` does not fail.
        let _ = writeln!(self.0, "{line}");
    }

    /// The whole text.
    pub(super) fn into_string(self) -> String {
        self.0
    }
}

/// Appends a formatted line to a [`Text`].
macro_rules! line {
    ($text:expr) => { $text.line(format_args!("")) };
    ($text:expr, $($format:tt)*) => { $text.line(format_args!($($format)*)) };
}
pub(super) use line;
