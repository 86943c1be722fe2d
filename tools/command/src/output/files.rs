//! Files that a verb writes at its end.

use std::ffi::OsStr;
use std::fs;
use std::io::ErrorKind;
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};

use step_folder::replace::ReplaceError;
use thiserror::Error;

use crate::common::CommonArgs;
use crate::failure::{Cause, Failure, Result};

/// The folder of a file is missing.
#[derive(Debug, Error)]
#[error("{}: expected a folder to write {} in, found none", folder.display(), name.display())]
struct NoFolder {
    folder: PathBuf,
    name: PathBuf,
}

/// Refuses a file that could not be written: its folder is missing.
///
/// # Errors
///
/// Fails where its folder is missing.
pub fn check_folder(path: &Path) -> Result<()> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    match folder.filter(|folder| !folder.is_dir()) {
        None => Ok(()),
        Some(folder) => {
            let error = NoFolder { folder: folder.to_owned(), name: path.to_owned() };
            Err(Failure::input(error).next("make the folder, or name another file"))
        }
    }
}

/// The failure of a file that could not be written.
pub fn unwritten(error: ReplaceError) -> Failure {
    let next = match error.source.kind() {
        ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem => {
            "name a place that may be written to; what was there has not changed"
        }
        _ => "make room, or name another place; what was there has not changed",
    };
    Failure::new(Cause::Output, error).next(next)
}

/// A file that a command writes or reads.
#[derive(Debug, Clone)]
pub struct Named {
    /// The option with its dashes, or the role.
    name: String,
    path: PathBuf,
}

impl Named {
    /// The file of an option.
    pub fn option(option: &str, path: impl Into<PathBuf>) -> Self {
        Self { name: format!("--{option}"), path: path.into() }
    }

    fn role(role: &str, path: impl Into<PathBuf>) -> Self {
        Self { name: role.to_owned(), path: path.into() }
    }
}

/// Two files of a command are one.
#[derive(Debug, Error)]
#[error("{option} {} and {other} are one file", path.display())]
struct OneFile {
    option: String,
    path: PathBuf,
    other: String,
}

/// The files that the command line names: each output must be a file of its own.
#[derive(Debug, Default)]
pub struct Files {
    outputs: Vec<Named>,
    inputs: Vec<Named>,
}

impl Files {
    /// No file but the simulator, which is read.
    pub fn of(common: &CommonArgs) -> Self {
        let simulator = common.accelerator.simulator.as_ref();
        let inputs = simulator.map(|(path, _)| Named::option("accelerator", path));
        Self { outputs: Vec::new(), inputs: inputs.into_iter().collect() }
    }

    /// Adds outputs.
    pub fn write(mut self, outputs: impl IntoIterator<Item = Named>) -> Self {
        self.outputs.extend(outputs);
        self
    }

    /// Adds the arrays of a folder as inputs, except for the names that `unread` knows.
    pub fn read_folder(mut self, folder: &Path, unread: impl Fn(&str) -> bool) -> Self {
        // A folder that cannot be listed is refused when it is read.
        for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
            let (path, name) = (entry.path(), entry.file_name());
            let is_array = path.extension() == Some(OsStr::new("npy"));
            if is_array && !name.to_str().is_some_and(&unread) {
                self.inputs.push(Named::role("the input", path));
            }
        }
        self
    }

    /// Refuses an output that is another output, an input, or the file that stdout or stderr goes
    /// to. Devices and pipes take any number of outputs.
    ///
    /// # Errors
    ///
    /// Fails where two of the files are one.
    pub fn check(&self) -> Result<()> {
        let streams = [("standard output", "/dev/stdout"), ("standard error", "/dev/stderr")];
        let streams = streams.map(|(name, path)| Named::role(name, path));
        for (at, output) in self.outputs.iter().enumerate() {
            let Some(identity) = identity(&output.path) else { continue };
            let others = self.outputs[at + 1..].iter().chain(&self.inputs).chain(&streams);
            let mut others =
                others.filter(|other| self::identity(&other.path) == Some(identity.clone()));
            if let Some(other) = others.next() {
                let next = format!("name another file with {}", output.name);
                let (option, path) = (output.name.clone(), output.path.clone());
                let other = format!("{} {}", other.name, other.path.display());
                return Err(Failure::input(OneFile { option, path, other }).next(next));
            }
        }
        Ok(())
    }
}

/// The device and the inode of a file; of a new one, the deepest folder above it that exists, and
/// the path from there: equal for every path and link to the file. `None` for a device, a pipe or a
/// folder.
fn identity(path: &Path) -> Option<(u64, u64, PathBuf)> {
    if let Ok(found) = fs::metadata(path) {
        return found.is_file().then(|| (found.dev(), found.ino(), PathBuf::new()));
    }
    let mut path = path.to_owned();
    // A link to a file that does not exist yet; the system follows 40 of them at most.
    for _ in 0..40 {
        let Ok(target) = fs::read_link(&path) else { break };
        path = path.parent().unwrap_or(Path::new("")).join(target);
    }
    path.ancestors().skip(1).find_map(|folder| {
        let here = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        let found = fs::metadata(here).ok()?;
        Some((found.dev(), found.ino(), path.strip_prefix(folder).ok()?.to_owned()))
    })
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::symlink;

    use super::*;

    fn checked(outputs: &[&Path], inputs: &Path) -> Result<(), String> {
        let outputs = outputs.iter().map(|path| Named::option("out", *path));
        let files = Files::default().write(outputs).read_folder(inputs, |name| name == "c.npy");
        files.check().map_err(|failure| failure.chain())
    }

    #[test]
    fn a_file_is_one_by_every_path_and_link_to_it() {
        let folder = tempfile::tempdir().expect("a folder");
        let root = folder.path();
        let at = |name: &str| root.join(name);
        fs::create_dir(at("below")).expect("a folder");
        symlink("below", at("link")).expect("a link");
        symlink("below/new", at("dangling")).expect("a link");
        for name in ["a.npy", "b.npy", "c.npy", "a.txt"] {
            fs::write(at(name), name).expect("written");
        }
        fs::hard_link(at("a.txt"), at("below/hard")).expect("a link");
        let one = |a: &str, b: &str| {
            let refused = checked(&[&at(a), &at(b)], root).expect_err(a);
            assert!(refused.contains(" are one file"), "{refused}");
            assert!(refused.contains("next: name another file"), "{refused}");
        };
        one("new", "new");
        one("new", "below/../new");
        one("below/new", "./link/new");
        one("below/new", "dangling");
        one("a.txt", "below/hard");
        one("deep/er/new", "deep/./er/new");
        assert_eq!(checked(&[&at("new"), &at("below/new"), &at("a.txt")], root), Ok(()));
        let refused = checked(&[&at("new"), &at("b.npy")], root).expect_err("an input");
        assert!(refused.contains("b.npy and the input "), "{refused}");
        assert_eq!(checked(&[&at("c.npy")], root), Ok(()), "not read");
    }

    #[test]
    fn devices_pipes_and_folders_may_repeat() {
        let folder = tempfile::tempdir().expect("a folder");
        let null = Path::new("/dev/null");
        assert_eq!(checked(&[null, null, folder.path(), folder.path()], folder.path()), Ok(()));
    }
}
