//! The verb `serve`: runs an emulated board as a process of its own.

use std::io::{self, Write};
use std::path::PathBuf;

use bitstream_model::BoardConfig;
use bitstream_model::interface::address_map::{MEMORY_BASE, MEMORY_BYTES};
use bitstream_model::remote::{Ended, ServeError, Server, Visit};
use clap::Args;
use serde_json::json;
use zynq_pgs::StepParameters;

use pgs_command::board::{external_accelerator, not_built};
use pgs_command::common::{AcceleratorOptions, CommonArgs};
use pgs_command::failure::{Cause, Failure, Result, Verdict};
use pgs_command::interrupt;
use pgs_command::numbers::grouped;
use pgs_command::options::build::{BuiltArgs, described};
use pgs_command::options::planned::PlannedArgs;
use pgs_command::output::facts::whole_fact;
use pgs_command::output::files::{Files, Named};
use pgs_command::output::{REFUSED, SCHEMA};

const EXAMPLES: &str = "\
Examples:
  pgs serve --socket /tmp/board                   in one terminal
  pgs --board socket:/tmp/board                   in another
  pgs serve --socket /tmp/board --memory-mib 256 --board emulated:half
  pgs serve --socket /tmp/board --fault 'stall@dma1.mm2s,step=3'

Examples with the Verilog in simulation (docs/to-a-board.md):
  pgs serve --socket /tmp/board --accelerator rtl:rtl-sim/pgs-rtl

One driver at a time has the board, with new memory of its own; a connection that says nothing for
5 s is closed. A killed driver leaves the engines running, and the next driver resets them. Ctrl-C
ends the server and removes the socket.";

/// Serve an emulated board to other processes, at a Unix socket
#[derive(Debug, Clone, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct ServeArgs {
    /// Unix socket to create; who may write to it may drive the board.
    #[arg(long, value_name = "PATH")]
    pub(crate) socket: PathBuf,
    /// Length of each driver's memory, MiB
    #[arg(
        long,
        value_name = "MIB",
        default_value_t = MEMORY_BYTES >> 20,
        value_parser = clap::value_parser!(u64).range(1..=1024)
    )]
    memory_mib: u64,
    #[command(flatten)]
    built: BuiltArgs,
    #[command(flatten)]
    planned: PlannedArgs,
    #[command(flatten)]
    pub(crate) accelerator: AcceleratorOptions,
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
pub(crate) fn run(args: &ServeArgs, common: &CommonArgs, out: &mut dyn Write) -> Result<Verdict> {
    Files::of(common).write([Named::option("socket", &args.socket)]).check()?;
    // A driver's mistake is reported, and the board goes on to serve the next driver.
    let mut config = BoardConfig { strict: false, ..args.built.board.unwrap_or_default().config() };
    let planned = args.planned.plan(&config, &StepParameters::thesis());
    let accelerator = external_accelerator(&mut config, &common.accelerator)?;
    let bytes = args.memory_mib << 20;
    if let Some(fence) = config.fence.filter(|fence| !fence.contains(MEMORY_BASE, bytes)) {
        let error = format!("{bytes} bytes of memory at {MEMORY_BASE:#x} reach out of {fence}");
        return Err(Failure::input(error).next("give a smaller --memory-mib, or another fence"));
    }
    let memory = MEMORY_BASE..MEMORY_BASE + bytes;
    let mut server =
        Server::bind(config, memory, &args.socket, accelerator).map_err(|error| match error {
            ServeError::Config(error) => not_built(error),
            ServeError::Memory(error) => Failure::input(error).next(
                "give a smaller --memory-mib, free memory, or raise the limit of the container \
                 (docker run --memory)",
            ),
            error @ ServeError::Socket { .. } => Failure::input(error).next(
                "name a socket with --socket whose folder is there and may be written to, and \
                 whose path has at most 107 bytes",
            ),
            error => Failure::input(error),
        })?;
    if let Some(plan) = &planned {
        server.board().inject(plan.clone());
    }
    let stopper = server.stopper();
    let at_signal = stopper.clone();
    interrupt::take_over(move || at_signal.stop());

    if !common.json {
        let mut line = |label: &str, text: String| whole_fact(out, label, &text);
        line("board", described(&config))?;
        if let Some((simulator, _)) = &common.accelerator.simulator {
            line("simulator", simulator.display().to_string())?;
        }
        if let Some(plan) = &planned {
            line("faults", plan.to_string())?;
        }
        let bytes = grouped(bytes);
        line("memory", format!("{bytes} bytes at {MEMORY_BASE:#x}, new for each driver"))?;
        line("serving", format!("pgs --board socket:{}", args.socket.display()))?;
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
        let [drivers, left, requests, violations] =
            [drivers, left_running, requests, violations].map(grouped);
        let text = format!(
            "{drivers} drivers, {left} left engines running; {requests} requests, {violations} \
             violations"
        );
        whole_fact(out, "served", &text)?;
    }
    match dead {
        Some(reason) => {
            let next = "serve the board again; a new simulator starts with it";
            Err(Failure::new(Cause::Hardware, reason).next(next))
        }
        None => Ok(Verdict::Done),
    }
}

fn at(number: u64) -> usize {
    usize::try_from(number).unwrap_or(usize::MAX)
}

/// Reports a driver that has left.
fn line(out: &mut dyn Write, number: u64, visit: &Visit) -> io::Result<()> {
    let Visit { requests, ended, left_running, .. } = visit;
    let ended = match ended {
        Ended::Left => "left".to_owned(),
        Ended::Refused(error) => format!("{REFUSED}refused{REFUSED:#}: {error}"),
        Ended::Broken(error) => format!("broken off: {error}"),
        _ => "gone".to_owned(),
    };
    let engines = if *left_running { "engines running" } else { "engines at rest" };
    let text = format!("{} requests, {ended}, {engines}", grouped(*requests));
    whole_fact(out, &format!("driver {number:<3}"), &text)?;
    out.flush()
}
