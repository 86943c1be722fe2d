//! Writes labelled facts in lines of the terminal's width.

use std::io::{self, Write};

use super::width::{stdout_width, wrapped};

/// Columns of a label.
const LABEL: usize = 11;

/// Writes a fact behind its label, in as many lines as it needs.
///
/// # Errors
///
/// Fails where the output takes no more.
pub fn fact(out: &mut dyn Write, label: &str, text: &str) -> io::Result<()> {
    labelled(out, label, LABEL, text, stdout_width())
}

/// Writes a text behind a label of `indent` columns, in lines of at most `columns`. Lines end
/// between words; a word longer than a line stays whole.
///
/// # Errors
///
/// Fails where the output takes no more.
pub fn labelled(
    out: &mut dyn Write,
    label: &str,
    indent: usize,
    text: &str,
    columns: usize,
) -> io::Result<()> {
    let mut label = label;
    for line in wrapped(text, columns.saturating_sub(indent)) {
        writeln!(out, "{}", format!("{label:<indent$}{line}").trim_end())?;
        label = "";
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::width::MOST;
    use super::*;

    fn written(label: &str, text: &str) -> String {
        let mut out = Vec::new();
        labelled(&mut out, label, LABEL, text, MOST).expect("written");
        String::from_utf8(out).expect("text")
    }

    #[test]
    fn a_short_fact_is_one_line() {
        assert_eq!(
            written("board", "emulated (as asked for)"),
            "board      emulated (as asked for)\n"
        );
        assert_eq!(written("", ""), "\n");
    }

    #[test]
    fn a_long_fact_goes_on_below_its_beginning() {
        let text = written("scene", &"word ".repeat(40));
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), 3);
        assert!(lines.iter().all(|line| line.len() <= MOST), "{text}");
        assert!(lines[1].starts_with("           word word"), "{text}");
        assert_eq!(text.matches("word").count(), 40);
    }

    #[test]
    fn a_word_longer_than_a_line_is_kept_whole() {
        let path = "x".repeat(120);
        assert_eq!(written("input", &path), format!("input      {path}\n"));
        assert_eq!(written("input", &format!("at {path}")).lines().count(), 2);
    }
}
