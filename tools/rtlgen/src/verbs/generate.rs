//! `rtlgen generate`: the accelerator as a folder of Verilog.

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use rtlgen::{emit, simulator};

use super::Error;
use super::build::BuildArgs;

/// Writes the accelerator as a folder of Verilog-2001 for a tool.
///
/// The folder has one module a file, the headers that they include, `pgs.f`, the list of the
/// modules, and `pgs_vivado.tcl`, the numbers that `tools/vivado/build.tcl` reads. The top module
/// is `pgs_top`.
#[derive(Debug, Args)]
pub(crate) struct Generate {
    /// Folder to write; it is made if it does not exist
    #[arg(long, value_name = "FOLDER")]
    out: PathBuf,
    #[command(flatten)]
    build: BuildArgs,
}

/// Writes the files.
pub(crate) fn run(args: &Generate, out: &mut dyn Write) -> Result<ExitCode, Error> {
    let files = emit::files(&args.build.design()?);
    simulator::write(&args.out, &files)?;
    let lines: usize = files.iter().map(|file| file.text.lines().count()).sum();
    writeln!(
        out,
        "{} files, {lines} lines in {}; top module {}",
        files.len(),
        args.out.display(),
        emit::TOP
    )?;
    Ok(ExitCode::SUCCESS)
}
