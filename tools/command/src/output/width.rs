//! Breaks text between words at the width of the terminal.

use std::io;
use std::os::fd::AsFd;
use std::sync::OnceLock;

use terminal_size::{Width, terminal_size_of};

/// The most columns of a line; a line that no terminal shows has room for all.
pub const MOST: usize = 100;

/// Columns of a line on stdout.
pub fn stdout_width() -> usize {
    static FOUND: OnceLock<usize> = OnceLock::new();
    *FOUND.get_or_init(|| of_terminal(io::stdout()).unwrap_or(MOST))
}

/// Columns of a line on this terminal; `None` for a file, a pipe, and a terminal that does not know
/// its width.
pub fn of_terminal(stream: impl AsFd) -> Option<usize> {
    terminal_size_of(stream).map(|(Width(columns), _)| MOST.min(columns.into()))
}

/// Columns of a table on stdout: all of a terminal, without an end in a file or a pipe.
pub fn terminal() -> usize {
    terminal_size_of(io::stdout()).map_or(usize::MAX, |(Width(columns), _)| columns.into())
}

/// Breaks a text between words into lines of at most `columns`; a longer word stays whole.
pub fn wrapped(text: &str, columns: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    let mut used = 0;
    for word in text.split_whitespace() {
        let length = word.chars().count();
        if used > 0 && used + 1 + length > columns {
            lines.push(String::new());
            used = 0;
        }
        if let Some(line) = lines.last_mut() {
            if used > 0 {
                line.push(' ');
                used += 1;
            }
            line.push_str(word);
            used += length;
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_end_between_words_at_every_width() {
        let text = "word ".repeat(50);
        for columns in [8, 60, 80, 100] {
            let lines = wrapped(&text, columns);
            assert!(lines.len() > 1 && lines.iter().all(|line| line.len() <= columns), "{columns}");
            assert_eq!(lines.join(" "), text.trim_end());
        }
        assert_eq!(wrapped("a much-longer-word b", 6), ["a", "much-longer-word", "b"]);
        assert_eq!(wrapped("", 6), [""]);
    }
}
