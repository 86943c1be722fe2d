//! Records a step on the emulated board, and writes its course to files.

use std::io::{self, Write};
use std::path::PathBuf;

use bitstream_model::EmulatedBoard;
use bitstream_model::recording::Recording;
use clap::Args;
use serde_json::{Value, json};
use step_folder::replace::Replacement;
use step_trace::TracedStep;
use zynq_pgs::StepReport;
use zynq_pgs::board::BoardKind;

use pgs_command::board::OpenBoard;
use pgs_command::failure::{Failure, Result};
use pgs_command::options::build::described;
use pgs_command::output::files::{Named, check_folder, unwritten};

/// The files that show the inside of a step.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "Inside a step (emulated board)")]
pub(crate) struct TracedArgs {
    /// Write streams, registers, stages and the interrupt of the step to FILE, for `GTKWave`
    #[arg(long, value_name = "FILE")]
    vcd: Option<PathBuf>,
    /// Write the course of the step to FILE as JSON, for Perfetto (<https://ui.perfetto.dev>)
    #[arg(long, value_name = "FILE")]
    trace: Option<PathBuf>,
    /// Draw the step to FILE (SVG): CPU, channels and accelerator over time
    #[arg(long, value_name = "FILE")]
    timeline: Option<PathBuf>,
}

/// Why a step has no files.
const NOTHING: &str = "no clock of the step has passed on the board";

/// Whether the files of the traced step were written.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) enum TraceFiles {
    /// All of them.
    Written,
    /// None: the step was not reached, or ended before the board passed a clock.
    #[default]
    NotWritten,
}

/// A board to record a step of.
#[derive(Debug)]
pub(crate) struct Tracing<'a> {
    args: &'a TracedArgs,
    board: EmulatedBoard,
}

impl TracedArgs {
    /// The options that the command line has, with their files.
    fn given(&self) -> impl Iterator<Item = (&'static str, &PathBuf)> {
        let all = [("vcd", &self.vcd), ("trace", &self.trace), ("timeline", &self.timeline)];
        all.into_iter().filter_map(|(name, path)| Some((name, path.as_ref()?)))
    }

    /// The files, which no other file of the command may be.
    pub(crate) fn named(&self) -> impl Iterator<Item = Named> {
        self.given().map(|(name, path)| Named::option(name, path))
    }

    /// Whether a step is to be recorded.
    pub(crate) fn is_given(&self) -> bool {
        self.given().next().is_some()
    }

    /// The board to record, if a step is to be recorded. A board outside this process has no
    /// recorder.
    pub(crate) fn tracing(&self, opened: &OpenBoard) -> Result<Option<Tracing<'_>>> {
        let Some((name, _)) = self.given().next() else { return Ok(None) };
        self.given().try_for_each(|(_, path)| check_folder(path))?;
        if let Some(board) = &opened.observer {
            return Ok(Some(Tracing { args: self, board: board.clone() }));
        }
        let (kind, next) = match opened.accelerator.board().kind {
            BoardKind::Served => (
                "served by another process",
                format!("leave out --{name}, or leave out --board socket:PATH"),
            ),
            _ => ("real", format!("leave out --{name}, or add --board emulated")),
        };
        let error = format!(
            "--{name} shows the inside of an emulated board of this process, and this board is \
             {kind}"
        );
        let accesses = "RUST_LOG=trace shows its register accesses";
        Err(Failure::input(error).next(format!("{next}; {accesses}")))
    }

    /// The files, for people.
    pub(crate) fn print(&self, files: TraceFiles, out: &mut dyn Write) -> io::Result<()> {
        self.given().try_for_each(|(name, path)| match files {
            TraceFiles::Written => writeln!(out, "{name:<10} {}", path.display()),
            TraceFiles::NotWritten => writeln!(out, "{name:<10} not written: {NOTHING}"),
        })
    }

    /// The same for programs; null without any.
    pub(crate) fn to_json(&self, files: TraceFiles) -> Value {
        match self.is_given() && files == TraceFiles::Written {
            true => json!({
                "vcd": self.vcd.as_ref().map(|path| path.display().to_string()),
                "trace": self.trace.as_ref().map(|path| path.display().to_string()),
                "timeline": self.timeline.as_ref().map(|path| path.display().to_string()),
            }),
            false => Value::Null,
        }
    }
}

impl Tracing<'_> {
    /// Records from now on.
    pub(crate) fn begin(&self) {
        self.board.record();
    }

    /// Ends the recording and writes the files; all of them, or none. A step that failed or was
    /// interrupted has no report.
    pub(crate) fn end(&self, report: Option<&StepReport>) -> Result<TraceFiles> {
        match self.board.take_recording().filter(|recording| recording.span.clocks() > 0) {
            Some(recording) => self.write(&recording, report).map(|()| TraceFiles::Written),
            None => {
                log::warn!("no file shows the step: {NOTHING}");
                Ok(TraceFiles::NotWritten)
            }
        }
    }

    fn write(&self, recording: &Recording, report: Option<&StepReport>) -> Result<()> {
        let design = described(&self.board.config());
        let step = TracedStep { recording, design: &design, report };
        let mut files = Replacement::default();
        let written = self.args.given().try_for_each(|(name, path)| {
            files.stage(path, |file| {
                let mut out = io::BufWriter::new(file);
                match name {
                    "vcd" => step.write_vcd(&mut out)?,
                    "trace" => step.write_events(&mut out)?,
                    _ => step.write_timeline(&mut out)?,
                }
                out.flush()
            })
        });
        written.and_then(|()| files.commit()).map_err(unwritten)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_that_was_not_reached_names_no_file() {
        let args = TracedArgs { vcd: Some("step.vcd".into()), ..TracedArgs::default() };
        assert_eq!(args.to_json(TraceFiles::NotWritten), Value::Null);
        assert_eq!(args.to_json(TraceFiles::Written)["vcd"], "step.vcd");
        assert_eq!(TracedArgs::default().to_json(TraceFiles::Written), Value::Null);
        let mut out = Vec::new();
        args.print(TraceFiles::NotWritten, &mut out).expect("a vector takes all");
        let said = String::from_utf8(out).expect("text");
        assert!(said.starts_with("vcd        not written: "), "{said}");
    }
}
