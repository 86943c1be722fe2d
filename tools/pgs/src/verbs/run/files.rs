//! The files of a run's poses: arrays, a page and a picture.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use clap::Args;
use scene::Scene;
use serde_json::{Value, json};
use step_folder::digest;
use step_folder::replace::replace;
use thiserror::Error;
use zynq_pgs::StepParameters;
use zynq_pgs_view::page::page;
use zynq_pgs_view::picture::Picture;
use zynq_pgs_view::{ViewError, npz};

use super::facts::{board_time, facts};
use super::film::Film;
use super::{Course, RunArgs};
use pgs_command::board::OpenBoard;
use pgs_command::failure::{Cause, Failure, Result};
use pgs_command::numbers::grouped;
use pgs_command::options::solver::time_step_text;
use pgs_command::output::files::{Named, check_folder, unwritten};

/// Most frames without a choice of the user's, beside the start.
const FRAMES: u32 = 200;

/// Where the poses go.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Poses")]
pub(crate) struct FileArgs {
    /// Write the poses as arrays for numpy; `docs/command-line.md` has their shapes.
    #[arg(
        long,
        value_name = "FILE.npz",
        value_parser = |text: &str| with_extension(text, &["npz"])
    )]
    poses: Option<PathBuf>,
    /// Write a page that plays the poses
    ///
    /// In a browser, without a network.
    #[arg(
        long,
        value_name = "FILE.html",
        value_parser = |text: &str| with_extension(text, &["html"])
    )]
    view: Option<PathBuf>,
    /// Write a picture of the end, or of the run, which moves
    ///
    /// .png of the last step, .apng of the whole run; a name for pages that know only .png ends in
    /// .apng.png.
    #[arg(
        long,
        value_name = "FILE.png|apng",
        value_parser = |text: &str| with_extension(text, &["png", "apng"])
    )]
    picture: Option<PathBuf>,
    #[cfg(feature = "live")]
    #[command(flatten)]
    pub(super) live: super::live::LiveArgs,
    /// Frames of a simulated second, a step each [default: about 200 of the run]
    #[arg(long, value_name = "N", value_parser = frames_per_second)]
    fps: Option<f32>,
}

fn frames_per_second(text: &str) -> Result<f32, String> {
    let frames = text.parse().ok().filter(|frames| (0.01..=1e6).contains(frames));
    frames.ok_or_else(|| "expected frames of a second, from 0.01 to 1000000".to_owned())
}

fn extension(path: &Path) -> &str {
    path.extension().and_then(|extension| extension.to_str()).unwrap_or("")
}

/// Whether a picture of that name moves.
fn is_moving(picture: &Path) -> bool {
    let name = picture.to_string_lossy();
    name.ends_with(".apng") || name.ends_with(".apng.png")
}

/// A path whose extension names a format that can be written.
fn with_extension(text: &str, known: &[&str]) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    if known.contains(&extension(&path)) {
        return Ok(path);
    }
    Err(format!("expected a name that ends in .{}", known.join(" or .")))
}

/// Poses that no file can hold.
#[derive(Debug, Error)]
#[error("{} cannot hold the poses", path.display())]
struct Unfit {
    path: PathBuf,
    source: ViewError,
}

impl Unfit {
    fn failure(path: &Path, source: ViewError) -> Failure {
        let is_size = matches!(source, ViewError::TooLarge(_));
        let failure = Failure::input(Self { path: path.to_owned(), source });
        if is_size { failure.next("give a smaller --fps") } else { failure }
    }
}

impl FileArgs {
    /// Refuses files that could not be written after the run.
    pub(super) fn check(&self) -> Result<()> {
        self.given().try_for_each(|(_, path)| check_folder(path))
    }

    /// The options that the command line has, with their files.
    fn given(&self) -> impl Iterator<Item = (&'static str, &PathBuf)> {
        let all = [("poses", &self.poses), ("view", &self.view), ("picture", &self.picture)];
        all.into_iter().filter_map(|(name, path)| Some((name, path.as_ref()?)))
    }

    /// The files, to be told from every other file of the command.
    pub(super) fn named(&self) -> impl Iterator<Item = Named> {
        self.given().map(|(name, path)| Named::option(name, path))
    }

    /// Begins to record a scene at its start; `None` if no file shows it.
    pub(super) fn film(&self, scene: &Scene, steps: u32, time_step: f32) -> Result<Option<Film>> {
        if self.poses.is_none()
            && self.view.is_none()
            && self.picture.as_deref().is_none_or(|picture| !is_moving(picture))
        {
            // A still picture shows the end, with colours of the start.
            let still = self.picture.is_some().then(|| Film::new(scene, 0.0, time_step));
            return still.transpose();
        }
        let a_step = match self.fps {
            Some(fps) => f64::from(fps) / f64::from(1.0 / time_step),
            None => 1.0 / f64::from(steps.div_ceil(FRAMES)),
        };
        Film::new(scene, a_step, time_step).map(Some)
    }

    /// Writes the files of a course; returns what was written.
    pub(super) fn write(
        &self,
        film: &Film,
        title: &str,
        facts: &[(&str, String)],
    ) -> Result<Vec<Written>> {
        let recording = film.recording();
        let frames = recording.frames().len();
        let bodies = grouped(recording.bodies() as u64);
        let mut written = Vec::new();
        if let Some(path) = &self.poses {
            let bytes = npz::bytes(recording).map_err(ViewError::from);
            let bytes = bytes.map_err(|error| Unfit::failure(path, error))?;
            let text = format!("{frames} frames of {bodies} bodies");
            written.push(Written::new("poses", path, &bytes, text, json!({ "frames": frames }))?);
        }
        if let Some(path) = &self.view {
            let page =
                page(recording, title, facts).map_err(|error| Unfit::failure(path, error))?;
            let text = format!("{frames} frames of {bodies} bodies, {}", page.error.text());
            let document = json!({
                "frames": frames,
                "largest_error_m": page.error.distance,
                "largest_error_degrees": page.error.angle,
            });
            written.push(Written::new("view", path, page.html.as_bytes(), text, document)?);
        }
        if let Some(path) = &self.picture {
            let (picture, moves) = match is_moving(path) {
                true => (Picture::moving(recording), format!(", {frames} frames")),
                false => (Picture::of(recording), String::new()),
            };
            let Picture { width, height, .. } = picture;
            let bytes = if moves.is_empty() { picture.png() } else { picture.apng() };
            let bytes = bytes.map_err(|error| Failure::new(Cause::Output, error))?;
            let text = format!("{width} x {height} pixels{moves}");
            let document = json!({ "width": width, "height": height });
            written.push(Written::new("picture", path, &bytes, text, document)?);
        }
        Ok(written)
    }
}

/// Writes the files of the poses.
pub(super) fn write_files(
    args: &RunArgs,
    opened: &OpenBoard,
    parameters: &StepParameters,
    scene: &Scene,
    course: &mut Course,
) -> Result<Vec<Written>> {
    let Some(film) = &mut course.film else { return Ok(Vec::new()) };
    film.end(course.done, scene)?;
    let mut facts = facts(args, opened, parameters).to_vec();
    let digest = digest::of_bodies(scene.bodies());
    facts.push(("time", board_time(opened, course.totals.mean()) + " on average"));
    facts.push(("steps", format!("{} of {}", course.done, time_step_text(film.time_step()))));
    facts.push(("digest", format!("{} {digest:016x}", digest::ALGORITHM)));
    args.files.write(film, &args.scene.text(), &facts)
}

/// A file that was written.
#[derive(Debug)]
pub(super) struct Written {
    pub(super) label: &'static str,
    pub(super) text: String,
    pub(super) document: Value,
}

impl Written {
    fn new(
        label: &'static str,
        path: &Path,
        bytes: &[u8],
        what: String,
        mut document: Value,
    ) -> Result<Self> {
        replace(path, |file| file.write_all(bytes)).map_err(unwritten)?;
        document["path"] = path.display().to_string().into();
        document["bytes"] = bytes.len().into();
        let size = match bytes.len() {
            few if few < 1_000_000 => format!("{:.1} kB", few as f64 / 1e3),
            many => format!("{:.1} MB", many as f64 / 1e6),
        };
        let text = format!("{}: {what}, {size}", path.display());
        Ok(Self { label, text, document })
    }
}
