//! Writes the files of the report: all of them, or none.

use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use step_folder::replace::{ReplaceError, Replacement};

use super::parts::Report;
use super::{page, text};
use crate::failure::{Cause, Failure};

/// Writes the report into a folder, which it makes; the paths of the files.
pub(super) fn write(folder: &Path, report: &Report) -> Result<Vec<PathBuf>, Failure> {
    let figures = folder.join("figures");
    fs::create_dir_all(&figures).map_err(|error| {
        let message = format!("{} cannot be made: {error}", figures.display());
        Failure::new(Cause::Output, message).next("name another folder with --out")
    })?;
    let mut files = vec![
        (folder.join("report.html"), page::html(report)),
        (folder.join("report.md"), text::markdown(report)?),
        (folder.join("report.json"), format!("{:#}\n", text::json(report))),
    ];
    let pictures = report.part.figures.iter();
    files.extend(pictures.map(|figure| (folder.join(figure.file()), figure.svg.clone())));
    let failed = |error: ReplaceError| {
        Failure::new(Cause::Output, error).next("make room, or name another folder with --out")
    };
    let mut replacement = Replacement::default();
    for (path, text) in &files {
        replacement.stage(path, |file| file.write_all(text.as_bytes())).map_err(failed)?;
    }
    replacement.commit().map_err(failed)?;
    Ok(files.into_iter().map(|(path, _)| path).collect())
}
