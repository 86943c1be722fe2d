//! Writes labelled facts in lines of at most 100 columns.

use std::io::{self, Write};

/// Columns of a line.
pub(crate) const WIDTH: usize = 100;
/// Columns of a label.
const LABEL: usize = 11;

/// Writes a fact behind its label, in as many lines as it needs. Lines end between words; a word
/// longer than a line stays whole.
pub(crate) fn fact(out: &mut dyn Write, label: &str, text: &str) -> io::Result<()> {
    let mut line = format!("{label:<LABEL$}");
    let mut columns = LABEL;
    let mut is_first = true;
    for word in text.split_whitespace() {
        let length = word.chars().count();
        if !is_first && columns + 1 + length > WIDTH {
            writeln!(out, "{line}")?;
            line = " ".repeat(LABEL);
            columns = LABEL;
            is_first = true;
        }
        if !is_first {
            line.push(' ');
            columns += 1;
        }
        line.push_str(word);
        columns += length;
        is_first = false;
    }
    writeln!(out, "{}", line.trim_end())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(label: &str, text: &str) -> String {
        let mut out = Vec::new();
        fact(&mut out, label, text).expect("written");
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
        assert!(lines.iter().all(|line| line.len() <= WIDTH), "{text}");
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
