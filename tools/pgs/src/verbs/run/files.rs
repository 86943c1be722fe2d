//! The files of a run's poses: arrays, glTF, a page and a picture.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use clap::Args;
use scene::Scene;
use serde_json::{Value, json};
use step_folder::replace::replace;
use thiserror::Error;
use zynq_pgs_view::page::page;
use zynq_pgs_view::picture::Picture;
use zynq_pgs_view::{Recording, TooLarge, gltf, npz};

use crate::failure::{Cause, Failure};
use crate::numbers::grouped;
use crate::output::files::check_folder;

/// Most frames without a choice of the user's, beside the start.
const FRAMES: u32 = 200;

/// Where the poses go.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Poses")]
pub(crate) struct FileArgs {
    /// Write the poses: .npz for numpy, .glb or .gltf for 3D programs; `docs/command-line.md` has the
    /// arrays.
    #[arg(long, value_name = "FILE", value_parser = poses_file)]
    poses: Option<PosesFile>,
    /// Write a page that plays the poses in a browser, without a network.
    #[arg(long, value_name = "FILE.html", value_parser = |text: &str| with_extension(text, &["html"]))]
    view: Option<PathBuf>,
    /// Write a picture of the last step.
    #[arg(long, value_name = "FILE.png|svg", value_parser = |text: &str| with_extension(text, &["png", "svg"]))]
    picture: Option<PathBuf>,
    /// Record every K-th step [default: the smallest K that gives at most 200 frames]
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u32).range(1..))]
    every: Option<u32>,
    /// Record about N frames beside the start, evenly spread.
    #[arg(long, value_name = "N", conflicts_with = "every", value_parser = clap::value_parser!(u32).range(1..))]
    frames: Option<u32>,
}

/// A file for poses, and its format.
#[derive(Debug, Clone)]
struct PosesFile {
    path: PathBuf,
    format: PosesFormat,
}

#[derive(Debug, Clone, Copy)]
enum PosesFormat {
    Npz,
    /// Text, with the buffer inside.
    Gltf,
    Glb,
}

fn poses_file(text: &str) -> Result<PosesFile, String> {
    let path = with_extension(text, &["npz", "glb", "gltf"])?;
    let format = match extension(&path) {
        "gltf" => PosesFormat::Gltf,
        "glb" => PosesFormat::Glb,
        _ => PosesFormat::Npz,
    };
    Ok(PosesFile { path, format })
}

fn extension(path: &Path) -> &str {
    path.extension().and_then(|extension| extension.to_str()).unwrap_or("")
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
    source: TooLarge,
}

impl FileArgs {
    /// Refuses files that could not be written after the run.
    pub(super) fn check(&self) -> Result<(), Failure> {
        self.paths().try_for_each(check_folder)
    }

    fn paths(&self) -> impl Iterator<Item = &Path> {
        let poses = self.poses.as_ref().map(|poses| poses.path.as_path());
        poses.into_iter().chain(self.view.as_deref()).chain(self.picture.as_deref())
    }

    /// Begins to record a scene at its start; `None` if no file shows its course.
    pub(super) fn film(&self, scene: &Scene, steps: u32, time_step: f32) -> Option<Film> {
        if self.poses.is_none() && self.view.is_none() {
            return None;
        }
        let every = match (self.every, self.frames) {
            (Some(every), _) => every,
            (None, frames) => steps.div_ceil(frames.unwrap_or(FRAMES)),
        };
        let recording = Recording::new(scene.bodies(), scene.geometries());
        let mut film = Film { recording, every: every.max(1), time_step };
        film.add(0, scene);
        Some(film)
    }

    /// Writes the picture of a scene.
    pub(super) fn write_picture(&self, scene: &Scene) -> Result<Option<Written>, Failure> {
        let Some(path) = &self.picture else { return Ok(None) };
        let picture = Picture::of_all(scene.bodies(), scene.geometries());
        let Picture { width, height, .. } = picture;
        let bytes = match extension(path) {
            "svg" => picture.svg().into_bytes(),
            _ => picture.png().map_err(|error| Failure::new(Cause::Output, error))?,
        };
        let document = json!({ "width": width, "height": height });
        Written::new("picture", path, &bytes, format!("{width} x {height} pixels"), document)
            .map(Some)
    }

    /// Writes the files of a course; returns what was written.
    pub(super) fn write(
        &self,
        film: &Film,
        title: &str,
        facts: &[(&str, String)],
    ) -> Result<Vec<Written>, Failure> {
        let recording = &film.recording;
        let frames = recording.frames().len();
        let bodies = grouped(recording.bodies() as u64);
        let mut written = Vec::new();
        if let Some(PosesFile { path, format }) = &self.poses {
            let bytes = match format {
                PosesFormat::Npz => npz::bytes(recording),
                PosesFormat::Gltf => gltf::text(recording).map(String::into_bytes),
                PosesFormat::Glb => gltf::binary(recording),
            };
            let bytes = bytes.map_err(|source| Unfit { path: path.clone(), source });
            let bytes =
                bytes.map_err(|error| Failure::input(error).next("give --every or --frames"))?;
            let text = format!("{frames} frames of {bodies} bodies");
            written.push(Written::new("poses", path, &bytes, text, json!({ "frames": frames }))?);
        }
        if let Some(path) = &self.view {
            let page = page(recording, title, facts);
            let text = format!("{frames} frames of {bodies} bodies, {}", page.error.text());
            let document = json!({
                "frames": frames,
                "largest_error_m": page.error.distance,
                "largest_error_degrees": page.error.angle,
            });
            written.push(Written::new("view", path, page.html.as_bytes(), text, document)?);
        }
        Ok(written)
    }
}

/// The poses of a run so far.
#[derive(Debug)]
pub(super) struct Film {
    recording: Recording,
    every: u32,
    time_step: f32,
}

impl Film {
    /// Adds the scene after `step` steps, if its frame is a chosen one.
    pub(super) fn step(&mut self, steps: u32, scene: &Scene) {
        if steps.is_multiple_of(self.every) {
            self.add(steps, scene);
        }
    }

    /// Adds the scene after the last step.
    pub(super) fn end(&mut self, steps: u32, scene: &Scene) {
        self.add(steps, scene);
    }

    /// The length of a step, s.
    pub(super) fn time_step(&self) -> f32 {
        self.time_step
    }

    fn add(&mut self, steps: u32, scene: &Scene) {
        #[allow(clippy::cast_possible_truncation, reason = "rounding to f32 is meant")]
        let time = (f64::from(self.time_step) * f64::from(steps)) as f32;
        self.recording.add(steps, time, scene.bodies());
    }
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
    ) -> Result<Self, Failure> {
        replace(path, |file| file.write_all(bytes))
            .map_err(|error| Failure::new(Cause::Output, error))?;
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
