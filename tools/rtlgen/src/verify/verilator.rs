//! Runs Verilator and the C++ compiler behind it.

use std::path::Path;
use std::process::{Command, Stdio};

use tempfile::TempDir;

use super::Error;

/// A program to build from Verilog and C++.
#[derive(Debug)]
pub struct Build<'a> {
    /// The top module.
    pub top: &'a str,
    /// Flags of the C++ compiler.
    pub flags: &'a str,
    /// Names of the files, in the folder.
    pub files: &'a [String],
    /// Whether the program can write waveforms.
    pub waveform: bool,
}

/// Whether a program can be run.
fn installed(tool: &str) -> bool {
    let run =
        Command::new(tool).arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status();
    run.is_ok_and(|status| status.success())
}

/// Refuses a purpose for which a tool is missing.
///
/// # Errors
///
/// [`Error::Missing`] with the first tool that is not installed.
pub fn require(purpose: &'static str) -> Result<(), Error> {
    match ["verilator", "c++", "make"].into_iter().find(|tool| !installed(tool)) {
        Some(tool) => Err(Error::Missing { tool, purpose }),
        None => Ok(()),
    }
}

/// Whether Verilator's makefiles work in a folder: `make` takes spaces and some other characters of
/// the path for its own.
///
/// # Errors
///
/// The folder does not exist.
pub fn takes(folder: &Path) -> Result<bool, Error> {
    let path = folder.canonicalize().map_err(Error::io("find the folder"))?;
    let plain = |c: char| c.is_alphanumeric() || "/._-+,@".contains(c);
    Ok(path.to_str().is_some_and(|path| path.chars().all(plain)))
}

/// A temporary folder in which Verilator's makefiles work.
///
/// # Errors
///
/// [`Error::Place`] if there is none.
pub fn place() -> Result<TempDir, Error> {
    let folder = tempfile::tempdir().map_err(Error::io("make a temporary folder"))?;
    match takes(folder.path())? {
        true => Ok(folder),
        false => Err(Error::Place { folder: folder.path().to_owned() }),
    }
}

/// Builds `obj/V<top>` in a folder that [`takes`] it. Warnings do not stop it: a seeded mistake may
/// cause one.
///
/// # Errors
///
/// The tools' messages, if one of them fails.
pub fn build(folder: &Path, build: &Build<'_>) -> Result<(), Error> {
    let output = Command::new("verilator")
        .current_dir(folder)
        .args(["--cc", "--exe", "--build", "-Wno-fatal", "-O3", "--noassert"])
        .args(["--x-assign", "fast", "--x-initial", "fast"])
        // Smaller files of C++, which make compiles side by side.
        .args(["--output-split", "20000", "-j", "0"])
        .args(["--top-module", build.top, "-Mdir", "obj", "-CFLAGS", build.flags])
        .args(build.waveform.then_some("--trace"))
        .args(build.files)
        .output()
        .map_err(Error::io("run verilator"))?;
    if output.status.success() {
        return Ok(());
    }
    let text = [output.stdout, output.stderr].concat();
    let output_text = String::from_utf8_lossy(&text).into_owned();
    Err(Error::Build { status: output.status, output: output_text })
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn a_folder_that_make_does_not_take_is_told_by_its_whole_path() {
        let root = place().expect("a temporary folder without odd characters");
        let within = |name: &str| {
            let folder = root.path().join(name).join("sim");
            fs::create_dir_all(&folder).expect("a folder");
            takes(&folder).expect("it exists")
        };
        for odd in
            ["my design", "a#b", "a$b", "a:b", "a%b", "it's", "(1)", "a&b", "a=b", "a;b", "a~"]
        {
            assert!(!within(odd), "{odd}");
        }
        for plain in ["design", "my-design_1.2", "a+b,c@d", "ü"] {
            assert!(within(plain), "{plain}");
        }
        takes(&root.path().join("none")).expect_err("no such folder");
    }
}
