//! Catches the end of an execution, and saves the input of a failed one.

use std::cell::RefCell;
use std::fmt;
use std::fs;
use std::io::{self, Write as _};
use std::panic::{self, AssertUnwindSafe};
use std::path::{Path, PathBuf};
use std::sync::Once;
use std::time::Duration;

use step_folder::replace::replace;
use thiserror::Error;

use crate::tally::Tally;
use crate::targets::{self, Target};

/// How an execution failed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Ending {
    /// The target panicked: the message and the place.
    Panic(String),
    /// The execution took longer than this limit.
    Hang(Duration),
}

impl fmt::Display for Ending {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Panic(message) => write!(f, "panic: {message}"),
            Self::Hang(limit) => write!(f, "hang: not finished after {limit:?}"),
        }
    }
}

/// A failed execution.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Finding {
    /// The target's name.
    pub target: &'static str,
    /// The execution's number.
    pub number: u64,
    /// Its input.
    pub input: Vec<u8>,
    /// How it failed.
    pub ending: Ending,
}

thread_local! {
    /// Whether panics of this thread are caught, and the message of the last one.
    static CAUGHT: RefCell<Option<String>> = const { RefCell::new(None) };
}

/// Records panics that [`run`] catches, instead of printing them.
fn note_panics() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let before = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            let noted = CAUGHT.with_borrow_mut(|caught| match caught {
                Some(message) => {
                    *message = info.to_string();
                    true
                }
                None => false,
            });
            if !noted {
                before(info);
            }
        }));
    });
}

/// Runs a target on an input.
///
/// # Errors
///
/// The panic's message and place.
pub fn run(target: &Target, input: &[u8]) -> Result<Tally, String> {
    note_panics();
    CAUGHT.set(Some(String::new()));
    let ended = panic::catch_unwind(AssertUnwindSafe(|| (target.run)(input)));
    let message = CAUGHT.take().unwrap_or_default();
    ended.map_err(|_| message)
}

/// An input file that cannot be used.
#[derive(Debug, Error)]
pub enum ReplayError {
    /// The file cannot be read.
    #[error("cannot read {}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The reason.
        #[source]
        source: io::Error,
    },
    /// The file was not written by [`Finding::save`].
    #[error(
        "{}, line {line}: expected {expected}: give a file that a campaign has written",
        path.display()
    )]
    Format {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: usize,
        /// The expected content.
        expected: &'static str,
    },
}

const BYTES_PER_LINE: usize = 32;

impl Finding {
    /// Writes the input into a file of the folder, which is made if necessary; returns its path.
    ///
    /// # Errors
    ///
    /// The file cannot be written.
    pub fn save(&self, folder: &Path) -> io::Result<PathBuf> {
        let mut text = format!("target {}\n", self.target);
        for line in self.ending.to_string().lines() {
            text.push_str(&format!("# {line}\n"));
        }
        for line in self.input.chunks(BYTES_PER_LINE) {
            text.extend(line.iter().map(|byte| format!("{byte:02x}")));
            text.push('\n');
        }
        fs::create_dir_all(folder)?;
        let path = folder.join(format!("{}-{}.txt", self.target, self.number));
        replace(&path, |file| file.write_all(text.as_bytes())).map_err(|error| error.source)?;
        Ok(path)
    }
}

/// Reads a file of [`Finding::save`].
///
/// # Errors
///
/// [`ReplayError`]: the file cannot be read, or is of another kind.
pub fn load(path: &Path) -> Result<(&'static Target, Vec<u8>), ReplayError> {
    let text = fs::read_to_string(path)
        .map_err(|source| ReplayError::Read { path: path.to_path_buf(), source })?;
    let wrong = |line, expected| ReplayError::Format { path: path.to_path_buf(), line, expected };
    let mut lines = (1..).zip(text.lines());
    let target = lines
        .next()
        .and_then(|(_, line)| targets::by_name(line.strip_prefix("target ")?))
        .ok_or_else(|| wrong(1, "\"target\" and the name of one"))?;
    let mut input = Vec::new();
    for (number, line) in lines.filter(|(_, line)| !line.starts_with('#')) {
        let bytes = (0..line.len())
            .step_by(2)
            .map(|at| line.get(at..at + 2).and_then(|digits| u8::from_str_radix(digits, 16).ok()));
        let bytes: Option<Vec<u8>> = bytes.collect();
        input.extend(bytes.ok_or_else(|| wrong(number, "pairs of hexadecimal digits"))?);
    }
    Ok((target, input))
}
