//! Writes the files of the report: all of them, or none.

use std::ffi::OsStr;
use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use step_folder::replace::{ReplaceError, Replacement};

use super::parts::Report;
use super::{page, text};
use pgs_command::failure::{Cause, Failure, Result};
use pgs_command::output::files::{self, Named};

/// The files beside the figures.
const FILES: [&str; 3] = ["thesis.html", "thesis.md", "thesis.json"];
/// The folder of the figures.
const FIGURES: &str = "figures";

/// The files that the report may replace.
pub(super) fn named(folder: &Path) -> impl Iterator<Item = Named> {
    let figures = fs::read_dir(folder.join(FIGURES)).into_iter().flatten().flatten();
    let figures = figures.map(|entry| entry.path());
    let figures = figures.filter(|path| path.extension() == Some(OsStr::new("svg")));
    let files = FILES.map(|file| folder.join(file)).into_iter().chain(figures);
    files.map(|path| Named::option("out", path))
}

/// Makes the folder of the report, and sees that files can be written into it.
pub(super) fn check(folder: &Path) -> Result<()> {
    let figures = folder.join(FIGURES);
    fs::create_dir_all(&figures).map_err(|error| {
        let message = format!("{} cannot be made: {error}", figures.display());
        Failure::new(Cause::Output, message).next("name another folder with --out")
    })?;
    // Without a commit the replacements leave earlier files as they are.
    let mut probe = Replacement::default();
    for path in FILES.map(|file| folder.join(file)).into_iter().chain([figures.join("probe.svg")]) {
        probe.stage(&path, |_| Ok(())).map_err(unwritten)?;
    }
    Ok(())
}

/// Writes the report into a folder that [`check`] has made; the paths of the files.
pub(super) fn write(folder: &Path, report: &Report) -> Result<Vec<PathBuf>> {
    let texts = [page::html(report), text::markdown(report), format!("{:#}\n", text::json(report))];
    let mut files: Vec<_> = FILES.map(|file| folder.join(file)).into_iter().zip(texts).collect();
    let pictures = report.part.figures.iter();
    files.extend(pictures.map(|figure| (folder.join(figure.file()), figure.svg.clone())));
    let mut replacement = Replacement::default();
    for (path, text) in &files {
        replacement.stage(path, |file| file.write_all(text.as_bytes())).map_err(unwritten)?;
    }
    replacement.commit().map_err(unwritten)?;
    Ok(files.into_iter().map(|(path, _)| path).collect())
}

/// The failure of a file that could not be written.
fn unwritten(error: ReplaceError) -> Failure {
    files::unwritten(error).next("make room, or name another folder with --out")
}
