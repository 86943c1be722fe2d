//! `rtlgen simulator`: a simulator of the accelerator.

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use rtlgen::simulator::{self, Waveform};

use super::Error;
use super::build::BuildArgs;

/// Builds a simulator of the accelerator with Verilator, for an emulated board.
///
/// The last line is the path of the program: `pgs solve FOLDER --accelerator rtl:PATH`.
#[derive(Debug, Args)]
pub(crate) struct Simulator {
    /// Folder for the Verilog and the program; it is made if it does not exist
    #[arg(long, value_name = "FOLDER")]
    out: PathBuf,
    /// Let the program write waveforms: it is slower, and `--accelerator both:PATH` keeps one of
    /// the first difference
    #[arg(long)]
    waveform: bool,
    #[command(flatten)]
    build: BuildArgs,
}

/// Builds it and prints its path.
pub(crate) fn run(args: &Simulator, out: &mut dyn Write) -> Result<ExitCode, Error> {
    let waveform = if args.waveform { Waveform::Vcd } else { Waveform::None };
    let program = simulator::build(&args.build.design()?, &args.out, waveform)?;
    writeln!(out, "{}", program.display())?;
    Ok(ExitCode::SUCCESS)
}
