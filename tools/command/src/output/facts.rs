//! Writes labelled facts in lines of the terminal's width.

use std::io::{self, Write};

use super::width::{of_terminal, stdout_width, wrapped};

/// Columns of a label.
const LABEL: usize = 11;

/// Writes a fact behind its label, in as many lines as it needs.
///
/// # Errors
///
/// Fails where the output takes no more.
pub fn fact(out: &mut dyn Write, label: &str, text: &str) -> io::Result<()> {
    labelled(out, &format!("{label:<LABEL$}"), LABEL, text, stdout_width())
}

/// The same; a file or a pipe gets it in one line.
///
/// # Errors
///
/// Fails where the output takes no more.
pub fn whole_fact(out: &mut dyn Write, label: &str, text: &str) -> io::Result<()> {
    whole(out, &format!("{label:<LABEL$}"), LABEL, text)
}

/// Writes a text behind a label of `indent` columns. A terminal gets lines of its width, a file or a
/// pipe gets one line, which programs can search.
///
/// # Errors
///
/// Fails where the output takes no more.
pub fn whole(out: &mut dyn Write, label: &str, indent: usize, text: &str) -> io::Result<()> {
    let columns = of_terminal(io::stdout()).unwrap_or(usize::MAX);
    labelled(out, label, indent, text, columns)
}

/// Lines end between words; a word longer than a line stays whole.
fn labelled(
    out: &mut dyn Write,
    label: &str,
    indent: usize,
    text: &str,
    columns: usize,
) -> io::Result<()> {
    let mut label = label.to_owned();
    for line in wrapped(text, columns.saturating_sub(indent)) {
        writeln!(out, "{}", format!("{label}{line}").trim_end())?;
        label = " ".repeat(indent);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::width::MOST;
    use super::*;

    fn written(label: &str, text: &str) -> String {
        let mut out = Vec::new();
        labelled(&mut out, &format!("{label:<LABEL$}"), LABEL, text, MOST).expect("written");
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
