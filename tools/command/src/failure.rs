//! Ends a command: exit codes, and errors as a chain with the next step.
//!
//! | code | meaning |
//! |---|---|
//! | 0 | done; also when the reader of a pipe has gone |
//! | 1 | ran, and the answer is no |
//! | 2 | wrong usage or unreadable input |
//! | 3 | no usable board, or no rights |
//! | 4 | hardware fault or deadline |
//! | 130 | interrupted; the channels were stopped |

use std::error::Error;
use std::io::{self, Write};
use std::process::ExitCode;

use serde_json::{Value, json};
use thiserror::Error;

use crate::output::width::{of_terminal, wrapped};
use crate::output::{BAD, SCHEMA};

/// The exit code of an interrupted command.
pub const INTERRUPTED: u8 = 130;

/// The outcome of a command that ran.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// It did as asked.
    Done,
    /// A comparison found differences, or a check failed.
    Differs,
    /// Ctrl-C ended the command, and no channel runs.
    Interrupted,
}

impl Verdict {
    /// The exit code.
    pub fn code(self) -> ExitCode {
        ExitCode::from(match self {
            Self::Done => 0,
            Self::Differs => 1,
            Self::Interrupted => INTERRUPTED,
        })
    }
}

/// The cause of a failure, which decides the exit code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cause {
    /// The command line, or a file named on it.
    Input,
    /// No board can be used.
    NoBoard,
    /// The board failed.
    Hardware,
    /// Results could not be written.
    Output,
}

/// The outcome of a command, or of a part of it.
pub type Result<T, E = Failure> = std::result::Result<T, E>;

/// The failure of a command.
#[derive(Debug)]
pub struct Failure {
    cause: Cause,
    error: Box<dyn Error + Send + Sync>,
    /// The next step, where the innermost message does not name it.
    next: Option<String>,
    /// Further lines for people.
    details: String,
    /// The document for programs.
    document: Option<Value>,
}

impl Failure {
    /// A failure by its cause.
    pub fn new(cause: Cause, error: impl Into<Box<dyn Error + Send + Sync>>) -> Self {
        Self { cause, error: error.into(), next: None, details: String::new(), document: None }
    }

    /// Wrong usage or unreadable input.
    pub fn input(error: impl Into<Box<dyn Error + Send + Sync>>) -> Self {
        Self::new(Cause::Input, error)
    }

    /// Sets the next step.
    pub fn next(mut self, next: impl Into<String>) -> Self {
        self.next = Some(next.into());
        self
    }

    /// Adds to the next step.
    pub fn hint(self, hint: &str) -> Self {
        let next = match &self.next {
            Some(next) => format!("{next}; {hint}"),
            None => hint.to_owned(),
        };
        self.next(next)
    }

    /// Adds details: lines for people, and a document for programs.
    pub fn details(mut self, lines: String, document: Value) -> Self {
        self.details = lines;
        self.document = (!document.is_null()).then_some(document);
        self
    }

    /// Adds the planned faults: a line for people, and a value for programs.
    pub fn planned(mut self, line: &str, faults: Value) -> Self {
        self.details.push_str(&format!("faults     {line}\n"));
        if let Some(document) = &mut self.document {
            document["faults"] = faults;
        }
        self
    }

    /// Puts a context, such as one of two boards, before the error.
    pub fn about(mut self, about: impl Into<String>) -> Self {
        self.error = Box::new(About { about: about.into(), source: self.error });
        self
    }

    fn is_closed_pipe(&self) -> bool {
        let stdout = self.error.downcast_ref::<StdoutError>();
        stdout.is_some_and(|error| error.0.kind() == io::ErrorKind::BrokenPipe)
    }

    /// The messages from the outermost to the innermost, one a line, and the next step.
    pub fn chain(&self) -> String {
        let mut text = format!("error: {}", self.error);
        let mut source = self.error.source();
        while let Some(error) = source {
            text.push_str(&format!("\n  because: {error}"));
            source = error.source();
        }
        if let Some(next) = &self.next {
            text.push_str(&format!("\n  next: {next}"));
        }
        text
    }

    /// Writes the document for programs, if there is one.
    pub fn write_document(&self, out: &mut dyn Write) {
        if let Some(error) = &self.document {
            let document = json!({ "schema": SCHEMA, "error": error });
            // With stdout closed, the exit code still tells the failure.
            let _ = writeln!(out, "{document:#}").and_then(|()| out.flush());
        }
    }

    /// Reports the failure on `stderr`, in colours.
    pub fn report(&self, stderr: &mut impl Write) -> ExitCode {
        if self.is_closed_pipe() {
            return ExitCode::SUCCESS;
        }
        let chain = self.chain();
        let chain = match of_terminal(io::stderr()) {
            Some(columns) => broken(&chain, columns),
            None => chain,
        };
        let chain = chain.replacen("error:", &format!("{BAD}error:{BAD:#}"), 1);
        // With stderr closed, the exit code still tells the failure.
        let _ = writeln!(stderr, "{chain}");
        let _ = write!(stderr, "{}", self.details);
        ExitCode::from(match self.cause {
            Cause::Input | Cause::Output => 2,
            Cause::NoBoard => 3,
            Cause::Hardware => 4,
        })
    }
}

/// Breaks lines between words, and indents what follows in a line of its own. A file or a pipe gets
/// whole lines, which programs can search.
fn broken(text: &str, columns: usize) -> String {
    let mut lines = Vec::new();
    for line in text.lines() {
        let begin = &line[..line.len() - line.trim_start().len()];
        let mut indent = begin.len();
        for part in wrapped(line, columns.saturating_sub(begin.len() + 4)) {
            lines.push(format!("{:indent$}{part}", ""));
            indent = begin.len() + 4;
        }
    }
    lines.join("\n")
}

/// An error behind its context.
#[derive(Debug, Error)]
#[error("{about}")]
struct About {
    about: String,
    source: Box<dyn Error + Send + Sync>,
}

/// Stdout takes no more.
#[derive(Debug, Error)]
#[error("standard output cannot be written")]
struct StdoutError(#[source] io::Error);

/// Verbs write to stdout only; errors of files have types of their own.
impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Self {
        Self::new(Cause::Output, StdoutError(error)).next("make room, or redirect it elsewhere")
    }
}

/// Writes what the command line's parser has to say: help and version to stdout with code 0, a
/// usage error to stderr with code 2.
pub fn report_usage(message: &clap::Error) -> ExitCode {
    let printed = message.print().and_then(|()| io::stdout().flush());
    match printed {
        // Without a stream to print a usage error, the exit code still shows it.
        _ if message.use_stderr() => ExitCode::from(2),
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => Failure::from(error).report(&mut anstream::stderr().lock()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use step_folder::npy::{NpyError, Problem};

    #[test]
    fn a_chain_names_every_cause_once() {
        let missing = io::Error::new(io::ErrorKind::NotFound, "no such file");
        let error = NpyError { path: "x/params.npy".into(), problem: Problem::Read(missing) };
        let text = Failure::input(error).next("look").chain();
        assert_eq!(
            text,
            "error: x/params.npy\n  because: cannot be read\n  because: no such file\n  next: look"
        );
    }

    #[test]
    fn hints_stand_behind_the_next_step() {
        let text = Failure::input("no").next("look").hint("see there").chain();
        assert_eq!(text, "error: no\n  next: look; see there");
        assert_eq!(Failure::input("no").hint("see there").chain(), "error: no\n  next: see there");
    }

    #[test]
    fn on_a_terminal_a_chain_is_broken_between_words() {
        let chain = Failure::input("one two three four").next("look here and there").chain();
        assert_eq!(
            broken(&chain, 20),
            "error: one two\n    three four\n  next: look\n      here and there"
        );
    }

    #[test]
    fn only_what_has_a_document_writes_one() {
        let written = |failure: Failure| {
            let mut out = Vec::new();
            failure.write_document(&mut out);
            String::from_utf8(out).expect("text")
        };
        assert_eq!(written(Failure::input("no")), "");
        assert_eq!(written(Failure::input("no").details(String::new(), Value::Null)), "");
        let text = written(Failure::input("no").details(String::new(), json!({ "fault": "gone" })));
        let document: Value = serde_json::from_str(&text).expect("a document");
        assert_eq!(document["error"]["fault"], "gone");
        assert_eq!(document["schema"], SCHEMA);
    }

    #[test]
    fn what_a_failure_is_about_comes_first() {
        let text = Failure::input("too many").about("board half").next("less").chain();
        assert_eq!(text, "error: board half\n  because: too many\n  next: less");
    }

    #[test]
    fn a_closed_pipe_is_quiet_and_a_full_disk_is_not() {
        let mut stderr = Vec::new();
        Failure::from(io::Error::from(io::ErrorKind::BrokenPipe)).report(&mut stderr);
        assert!(stderr.is_empty());
        Failure::from(io::Error::from(io::ErrorKind::StorageFull)).report(&mut stderr);
        let text = String::from_utf8(stderr).expect("text");
        let expected = format!("{BAD}error:{BAD:#} standard output cannot be written\n  because: ");
        assert!(text.starts_with(&expected), "{text}");
    }
}
