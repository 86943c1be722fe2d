//! Runs an emulated board as the programmable logic of a guest in QEMU, on the guest's memory.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a command line tool")]

use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use bitstream_model::external::{ExternalAccelerator, ExternalError, SimulatorProcess};
use bitstream_model::interface::address_map::{INTERRUPT_SPI, MEMORY_BASE, MEMORY_BYTES};
use bitstream_model::{BoardConfig, EmulatedBoard};
use clap::Parser;
use guest_board::guest_file::GuestFile;
use guest_board::qtest::QtestLine;
use guest_board::server::{ServeError, Server};

/// Time within which QEMU must create its socket.
const START_LIMIT: Duration = Duration::from_secs(30);

/// Runs an emulated board as the programmable logic of a guest in QEMU, until the guest ends.
///
/// QEMU is started with `-object memory-backend-file,id=ddr,size=SIZE,mem-path=FILE,share=on
/// -machine memory-backend=ddr -accel tcg -qtest unix:SOCKET,server=on,wait=off`.
///
/// Exit codes: 0 the driver made no mistake; 1 it did, or the guest could not be served to its end,
/// or the simulator ended before it; 2 wrong usage.
#[derive(Debug, Parser)]
struct Args {
    /// File behind the guest's memory; its byte 0 is physical address 0
    #[arg(long, value_name = "FILE")]
    memory: PathBuf,
    /// QEMU's qtest socket.
    #[arg(long, value_name = "SOCKET")]
    qtest: PathBuf,
    /// Physical address of the mailbox page.
    #[arg(long, value_name = "ADDRESS", value_parser = number)]
    mailbox: u64,
    /// Simulator of the generated Verilog, the accelerator in place of the model;
    /// `rtlgen simulator` builds one
    #[arg(long, value_name = "PATH")]
    simulator: Option<PathBuf>,
    /// Time limit of the guest, seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 600)]
    limit: u64,
}

fn number(text: &str) -> Result<u64, String> {
    let parsed = match text.strip_prefix("0x") {
        Some(digits) => u64::from_str_radix(digits, 16),
        None => text.parse(),
    };
    parsed.map_err(|_| format!("expected a number like 0x30000000, found {text:?}"))
}

fn main() -> ExitCode {
    env_logger::init();
    match run(&Args::parse()) {
        Ok(code) => code,
        Err(error) => {
            eprintln!("error: {error}");
            let mut cause = error.source();
            while let Some(error) = cause {
                eprintln!("  because {error}");
                cause = error.source();
            }
            ExitCode::FAILURE
        }
    }
}

/// How the board is built, and its accelerator where that is not the model.
fn design(
    simulator: Option<&Path>,
) -> Result<(BoardConfig, Option<Box<dyn ExternalAccelerator>>), ExternalError> {
    let mut config = BoardConfig::default();
    let Some(path) = simulator else { return Ok((config, None)) };
    let simulator = SimulatorProcess::start_for(&mut config, path)?;
    Ok((config, Some(Box::new(simulator))))
}

fn run(args: &Args) -> Result<ExitCode, Box<dyn Error>> {
    let (config, accelerator) = design(args.simulator.as_deref())?;
    let limit = Duration::from_secs(args.limit);
    // QEMU answers once its machine exists, and with it the memory.
    let line = QtestLine::connect(&args.qtest, INTERRUPT_SPI, limit.min(START_LIMIT))
        .map_err(|error| format!("{}: {error}", args.qtest.display()))?;
    let memory = GuestFile::open(&args.memory)
        .map_err(|error| format!("{}: {error}", args.memory.display()))?;
    let page = memory.page(args.mailbox)?;
    let granted = std::iter::once(MEMORY_BASE..MEMORY_BASE + MEMORY_BYTES).collect();
    let board = EmulatedBoard::on_memory(config, Box::new(memory), granted, accelerator)?;
    let ended = Server::new(board.clone(), page, line)?.serve(limit);

    let counts = board.counts();
    println!(
        "board: {} register reads, {} writes, {} doorbells, {} descriptors, {} beats read, \
         {} written, {} interrupts, {} violations",
        counts.register_reads,
        counts.register_writes,
        counts.doorbells,
        counts.descriptors,
        counts.beats_read,
        counts.beats_written,
        counts.interrupts,
        counts.violations
    );
    for violation in board.violations() {
        println!("board: {violation}");
    }
    let dead = board.accelerator_error();
    if let Some(reason) = &dead {
        println!("board: {reason}");
    }
    ended.map_err(Box::<ServeError>::new)?;
    let good = counts.violations == 0 && dead.is_none();
    Ok(if good { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}
