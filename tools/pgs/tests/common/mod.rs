//! Shared by the tests of the command line: running it, and folders of arrays to break.

#![allow(dead_code, reason = "not every test uses every helper")]

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output};

use serde_json::Value;
use tempfile::TempDir;

/// Where the data of the golden arrays begins: `.npy` pads its header to 128 bytes here.
pub(crate) const DATA: usize = 128;

/// Reads a variable of the environment; a blank one counts as unset.
pub(crate) fn variable(name: &str) -> Option<String> {
    let text = std::env::var_os(name)?.into_string().expect("a variable in UTF-8");
    Some(text).filter(|text| !text.trim().is_empty())
}

/// The command, on the emulated board and with errors only in its log.
///
/// `PGS_TEST_RUNNER` names the program that starts a command built for another processor.
pub(crate) fn pgs() -> Command {
    let runner = variable("PGS_TEST_RUNNER").unwrap_or_default();
    let mut words = runner.split_whitespace().chain([env!("CARGO_BIN_EXE_pgs")]);
    let mut command = Command::new(words.next().expect("at least the command itself"));
    command.args(words);
    command.env("PGS_BOARD", "emulated").env("RUST_LOG", "error");
    command
}

/// A process that ends with the test, even when the test panics.
#[derive(Debug)]
pub(crate) struct Tied(pub(crate) Child);

impl Drop for Tied {
    fn drop(&mut self) {
        // An ended process ignores it.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Sends a signal to a process.
pub(crate) fn signal(which: &str, process: u32) {
    let kill = Command::new("kill").args([which, &process.to_string()]).status();
    assert!(kill.expect("kill runs").success());
}

/// Reports a skipped test on stderr, past the harness, which captures the output of passing tests.
pub(crate) fn skipped(what: &str) {
    // With stderr closed, the report is lost and the test goes on.
    let _ = writeln!(std::io::stderr(), "skipped: {what}");
}

/// The outcome of a command: its code, stdout and stderr.
pub(crate) struct Ran {
    pub(crate) code: Option<i32>,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl From<Output> for Ran {
    fn from(output: Output) -> Self {
        Self {
            code: output.status.code(),
            stdout: String::from_utf8(output.stdout).expect("stdout is text"),
            stderr: String::from_utf8(output.stderr).expect("stderr is text"),
        }
    }
}

/// Runs `pgs` with these arguments.
pub(crate) fn run<S: AsRef<std::ffi::OsStr>>(arguments: impl IntoIterator<Item = S>) -> Ran {
    pgs().args(arguments).output().expect("the command starts").into()
}

impl Ran {
    /// Parses stdout.
    pub(crate) fn json(&self) -> Value {
        serde_json::from_str(&self.stdout).expect("one JSON document and nothing else")
    }
}

/// A number in a document.
pub(crate) fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

/// Asserts that a number in a document differs from `expected` by at most `tolerance`.
pub(crate) fn near(value: &Value, expected: f64, tolerance: f64) {
    let found = number(value);
    assert!((found - expected).abs() <= tolerance, "{found}, expected {expected}");
}

/// The rows of a table of an experiment's document.
pub(crate) fn rows<'a>(document: &'a Value, id: &str) -> &'a [Value] {
    let tables = document["tables"].as_array().expect("tables");
    let table = tables.iter().find(|table| table["id"] == id);
    let table = table.unwrap_or_else(|| panic!("no table {id}: {document:#}"));
    table["rows"].as_array().expect("rows")
}

/// The row of a side in the table of steps.
pub(crate) fn at<'a>(document: &'a Value, step: u64, side: &str) -> &'a Value {
    let found =
        rows(document, "steps").iter().find(|row| row["step"] == step && row["side"] == side);
    found.unwrap_or_else(|| panic!("no step {step} of {side}: {document:#}"))
}

/// A path as an argument.
pub(crate) fn text(path: &Path) -> &str {
    path.to_str().expect("a path in UTF-8")
}

/// A folder of golden arrays.
pub(crate) fn golden(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/golden").join(name)
}

/// A copy of a golden folder, for a test to change.
pub(crate) fn copy(name: &str) -> TempDir {
    let copy = tempfile::tempdir().expect("a temporary folder");
    for entry in fs::read_dir(golden(name)).expect("the golden folder") {
        let from = entry.expect("an entry").path();
        fs::copy(&from, copy.path().join(from.file_name().expect("a name"))).expect("a copy");
    }
    copy
}

/// Overwrites a 32-bit value of an array.
pub(crate) fn patch(folder: &TempDir, file: &str, index: usize, bytes: [u8; 4]) {
    let path = folder.path().join(file);
    let mut content = fs::read(&path).expect("the array");
    let at = DATA + 4 * index;
    content[at..at + 4].copy_from_slice(&bytes);
    fs::write(path, content).expect("the array");
}

/// Writes an array that repeats `data` up to its shape.
pub(crate) fn write(folder: &TempDir, file: &str, descr: &str, shape: &[usize], data: &[[u8; 4]]) {
    let dimensions: String = shape.iter().map(|n| format!("{n}, ")).collect();
    let mut header =
        format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': ({dimensions}), }}");
    header = format!("{header:<117}\n");
    let mut content = b"\x93NUMPY\x01\x00\x76\x00".to_vec();
    content.extend(header.as_bytes());
    let values: usize = shape.iter().product();
    content.extend(data.iter().cycle().take(values).flatten());
    fs::write(folder.path().join(file), content).expect("the array");
}
