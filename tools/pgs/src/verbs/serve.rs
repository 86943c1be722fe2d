//! The verb `serve`: runs an emulated board as a process of its own.

use std::fs;
use std::io::{self, Write};
use std::path::PathBuf;

use bitstream_model::BoardConfig;
use bitstream_model::interface::address_map::{MEMORY_BASE, MEMORY_BYTES};
use bitstream_model::interface::message::MEMORY_SUFFIX;
use bitstream_model::remote::{Ended, MemoryFile, MemoryFileError, ServeError, Server, Visit};
use clap::Args;
use serde_json::json;
use zynq_pgs::{MemoryChoice, StepParameters};

use crate::board::{external_accelerator, not_built};
use crate::common::{BoardName, CommonArgs};
use crate::failure::{Cause, Failure, Verdict};
use crate::interrupt;
use crate::numbers::grouped;
use crate::options::build::{BuildArgs, described};
use crate::options::planned::PlannedArgs;
use crate::output::SCHEMA;

const EXAMPLES: &str = "\
Examples:
  pgs serve --socket /tmp/board                   in one terminal
  pgs --board socket:/tmp/board                   in another
  pgs serve --socket /tmp/board --memory file:/dev/shm/board --profile half
  pgs serve --socket /tmp/board --fault 'stall@dma1.mm2s,step=3'

Examples with the Verilog in simulation (docs/bitstream.md):
  pgs serve --socket /tmp/board --accelerator rtl:rtl-sim/pgs-rtl

One driver at a time has the board; a connection that says nothing for 5 s is closed. A killed
driver leaves the engines running, and the next driver resets them. Ctrl-C ends the server and
removes the socket; the memory's file stays.";

/// Serve an emulated board to drivers in other processes: registers at a Unix socket, memory in a
/// file.
#[derive(Debug, Clone, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct ServeArgs {
    /// Unix socket to create. The memory is the file with ".memory" appended to this name, unless
    /// --memory names another.
    #[arg(long, value_name = "PATH")]
    pub(crate) socket: PathBuf,
    /// Length of the memory, MiB [default: the length of the file; 64 for a new file]
    #[arg(long, value_name = "MIB", value_parser = clap::value_parser!(u64).range(1..=1024))]
    memory_mib: Option<u64>,
    #[command(flatten)]
    build: BuildArgs,
    #[command(flatten)]
    planned: PlannedArgs,
}

/// Counts over all drivers.
#[derive(Default)]
struct Tally {
    drivers: u64,
    requests: u64,
    left_running: u64,
    violations: u64,
}

/// Serves until Ctrl-C.
pub(crate) fn run(
    args: &ServeArgs,
    common: &CommonArgs,
    out: &mut dyn Write,
) -> Result<Verdict, Failure> {
    if !matches!(common.board, BoardName::Auto | BoardName::Emulated) {
        let error = "`pgs serve` serves an emulated board, and no other";
        return Err(Failure::input(error).next("leave out --board (and PGS_BOARD)"));
    }
    let path = match &common.memory {
        MemoryChoice::Automatic => {
            let mut path = args.socket.clone().into_os_string();
            path.push(MEMORY_SUFFIX);
            path.into()
        }
        MemoryChoice::File { path } => path.clone(),
        _ => {
            let error = "the memory of a served board is a file";
            return Err(Failure::input(error).next("write --memory file:PATH, or leave it out"));
        }
    };
    // A driver's mistake is reported, and the board goes on to serve the next driver.
    let mut config = BoardConfig { strict: false, ..args.build.build().config() };
    let planned = args.planned.plan(&config, &StepParameters::default());
    let accelerator = external_accelerator(&mut config, &common.accelerator)?;
    let wanted = args.memory_mib.map(|mib| mib << 20);
    let made = !path.exists();
    let memory = MemoryFile::open(&path, MEMORY_BASE, wanted, MEMORY_BYTES).map_err(no_memory)?;
    let addresses = memory.addresses();
    let mut server = Server::bind(config, memory, &args.socket, accelerator).map_err(|error| {
        let removed = if made { fs::remove_file(&path) } else { Ok(()) };
        if let Err(error) = removed {
            log::warn!("{} stays: {error}", path.display());
        }
        match error {
            ServeError::Config(error) => not_built(error),
            error @ ServeError::Socket { .. } => Failure::input(error).next(
                "name a socket with --socket whose folder is there and may be written to, and whose \
                 path has at most 107 bytes",
            ),
            error => Failure::input(error),
        }
    })?;
    if let Some(plan) = &planned {
        server.board().inject(plan.clone());
    }
    let stopper = server.stopper();
    let at_signal = stopper.clone();
    interrupt::take_over(move || at_signal.stop());

    if !common.json {
        writeln!(out, "board      {}", described(&config))?;
        if let Some((simulator, _)) = common.accelerator.simulator() {
            writeln!(out, "simulator  {}", simulator.display())?;
        }
        if let Some(plan) = &planned {
            writeln!(out, "faults     {plan}")?;
        }
        let bytes = grouped(addresses.end - addresses.start);
        writeln!(out, "memory     {}, {bytes} bytes at {:#x}", path.display(), addresses.start)?;
        writeln!(out, "serving    pgs --board socket:{}", args.socket.display())?;
        out.flush()?;
    }
    let mut tally = Tally::default();
    let mut written = Ok(());
    let mut dead = None;
    let served = server.serve(|board, visit| {
        // A visit without requests only tested whether a board is served here.
        if visit.requests == 0 && matches!(visit.ended, Ended::Left) {
            return;
        }
        tally.drivers += 1;
        tally.requests += visit.requests;
        tally.left_running += u64::from(visit.left_running);
        for violation in board.violations().iter().skip(at(tally.violations)) {
            log::error!("driver {}: {violation}", tally.drivers);
        }
        tally.violations = board.counts().violations;
        dead = board.accelerator_error();
        if dead.is_some() {
            // A board without its accelerator has no use for any driver.
            stopper.stop();
        }
        if !common.json {
            written = line(out, tally.drivers, &visit);
            if written.is_err() {
                stopper.stop();
            }
        }
    });
    written?;
    served.map_err(|error| Failure::new(Cause::Output, error))?;
    let Tally { drivers, requests, left_running, violations } = tally;
    if common.json {
        let document = json!({
            "schema": SCHEMA,
            "verb": "serve",
            "drivers": drivers,
            "requests": requests,
            "left_running": left_running,
            "violations": violations,
            "accelerator_error": dead,
        });
        writeln!(out, "{document:#}")?;
    } else {
        writeln!(
            out,
            "served     {} drivers, {} left engines running; {} requests, {} violations",
            grouped(drivers),
            grouped(left_running),
            grouped(requests),
            grouped(violations),
        )?;
    }
    match dead {
        Some(reason) => {
            let next = "serve the board again; a new simulator starts with it";
            Err(Failure::new(Cause::Hardware, reason).next(next))
        }
        None => Ok(Verdict::Done),
    }
}

/// There is no memory for the board.
fn no_memory(error: MemoryFileError) -> Failure {
    let no_room = matches!(error, MemoryFileError::NoRoom { .. });
    let failure = Failure::input(error);
    match no_room {
        true => failure.next(
            "give a smaller --memory-mib, make room, or name another file with --memory file:PATH; \
             a container's /dev/shm is as large as its --shm-size says",
        ),
        false => failure,
    }
}

fn at(number: u64) -> usize {
    usize::try_from(number).unwrap_or(usize::MAX)
}

/// Reports a driver that has left.
fn line(out: &mut dyn Write, number: u64, visit: &Visit) -> io::Result<()> {
    let Visit { requests, ended, left_running, .. } = visit;
    write!(out, "driver {number:<3} {} requests, ", grouped(*requests))?;
    match ended {
        Ended::Left => write!(out, "left")?,
        Ended::Refused(error) => write!(out, "refused: {error}")?,
        Ended::Broken(error) => write!(out, "broken off: {error}")?,
        _ => write!(out, "gone")?,
    }
    writeln!(out, ", {}", if *left_running { "engines running" } else { "engines at rest" })?;
    out.flush()
}
