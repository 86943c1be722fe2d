//! The verb `check`: the start-up self-test of a board, line by line.

use std::io::Write;

use bitstream_model::interface::fence::Fence;
use bitstream_model::{
    BoardConfig, Coherency, Direction, InterruptWiring, Master, Quirks, Resettable,
};
use clap::builder::styling::Style;
use clap::{Args, ValueEnum};
use serde_json::{Value, json};
use zynq_pgs::board::BoardKind;
use zynq_pgs::check::{CheckLine, Outcome};
use zynq_pgs::emulation::Build;
use zynq_pgs::{CheckReport, check};

use pgs_command::board::{self, ChosenBoard};
use pgs_command::common::{AcceleratorOptions, BoardOptions, CommonArgs};
use pgs_command::failure::{Failure, Result, Verdict};
use pgs_command::output::facts::whole;
use pgs_command::output::{BAD, GOOD, REFUSED, SCHEMA};

const EXAMPLES: &str = "\
Examples:
  pgs check --board emulated --json
  pgs check --board emulated --quirk stale     see what a failure looks like
  pgs check --board emulated:float,fence=0x50000000+64M   DMA cores that reach this memory alone

Examples on a board:
  pgs check
  pgs check --board uio:pgs@a0000000           a node of another name; `pgs list` shows them

Resets the board: nothing else may use it meanwhile. Exit code 0 if no line fails, 1 if one does,
3 if there is no board. The emulated board is tested only if --board or PGS_BOARD asks for it.";

/// Test a board line by line; a failure names the next step
#[derive(Debug, Clone, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct CheckArgs {
    /// Build the emulated board with a defect, to see how the test reports it
    #[arg(long, value_enum, value_name = "QUIRK", help_heading = "Emulated board")]
    quirk: Option<QuirkName>,
    #[command(flatten)]
    pub(crate) board: BoardOptions,
    #[command(flatten)]
    pub(crate) accelerator: AcceleratorOptions,
}

/// A defect of the emulated board.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum QuirkName {
    /// Another design's identification
    Identity,
    /// Interface version 2.0
    Version,
    /// Length registers of 14 bits, although the bitstream states another width
    Length14,
    /// No issue queue, although the bitstream states one
    NoQueue,
    /// The interrupt line is not connected
    NoInterrupt,
    /// The interrupt line is always high
    StuckInterrupt,
    /// The device reads stale data
    Stale,
    /// The CPU finds stale results
    StaleResults,
    /// The second DMA core stays in reset
    HeldReset,
    /// The stream from the third DMA core carries nothing
    UnconnectedStream,
    /// The fence does not hold the results of the second DMA core
    OpenFence,
    /// The device tree reserves no guard behind the fence
    NoGuard,
}

impl QuirkName {
    /// Offset in the report from which buffers are stale.
    const STALE_FROM: usize = 0x400;

    fn quirks(self) -> Quirks {
        let from_byte = Self::STALE_FROM;
        let mut quirks = Quirks::default();
        match self {
            Self::Identity => quirks.identification = 0xFFFF_0000,
            Self::Version => quirks.version = 0x0003_0000,
            Self::Length14 => quirks.length_register = Some(14),
            Self::NoQueue => quirks.queue = Some(64),
            Self::NoInterrupt => quirks.interrupt = InterruptWiring::Disconnected,
            Self::StuckInterrupt => quirks.interrupt = InterruptWiring::StuckHigh,
            Self::Stale => quirks.coherency = Coherency::StaleReads { from_byte },
            Self::StaleResults => quirks.coherency = Coherency::StaleWrites { from_byte },
            Self::HeldReset => quirks.held_reset = Some(Resettable::Dma(1)),
            Self::UnconnectedStream => quirks.unconnected = Some((2, Direction::Mm2s)),
            Self::OpenFence => quirks.unfenced = &[(1, Master::Data(Direction::S2mm))],
            Self::NoGuard => quirks.no_guard = true,
        }
        quirks
    }
}

impl CheckArgs {
    fn config(&self, build: &Build) -> BoardConfig {
        let quirks = self.quirk.map(QuirkName::quirks).unwrap_or_default();
        let config = build.config();
        // These two are about a fence.
        let needs = matches!(self.quirk, Some(QuirkName::OpenFence | QuirkName::NoGuard));
        let fence = config.fence.or(needs.then(Fence::default));
        let queue = if quirks.queue.is_some() { Some(0) } else { config.queue };
        BoardConfig { quirks, fence, queue, ..config }
    }
}

/// Tests the board.
pub(crate) fn run(args: &CheckArgs, common: &CommonArgs, out: &mut dyn Write) -> Result<Verdict> {
    board::require(common)?;
    let ChosenBoard { kind, options, reason, .. } =
        board::find(common, args.config(&common.build()))?;
    if args.quirk.is_some() && kind != BoardKind::Emulated {
        let error = "--quirk builds an emulated board, but this one is there already";
        return Err(Failure::input(error).next("leave out --quirk, or add --board emulated"));
    }
    let report = check(options).map_err(board::unusable)?;
    let kind = board::kind_text(kind);
    if common.json {
        let document = json!({
            "schema": SCHEMA,
            "verb": "check",
            "board": { "kind": kind, "reason": reason },
            "passed": report.passed(),
            "lines": report.lines.iter().map(line_json).collect::<Vec<_>>(),
        });
        writeln!(out, "{document:#}")?;
    } else {
        writeln!(out, "board {kind} ({reason})")?;
        print(&report, out)?;
    }
    Ok(if report.passed() { Verdict::Done } else { Verdict::Differs })
}

fn line_json(line: &CheckLine) -> Value {
    let mut value = match &line.outcome {
        Outcome::Ok { detail } => json!({ "outcome": "ok", "detail": detail }),
        Outcome::Failed { found, expected, next } => {
            json!({ "outcome": "failed", "found": found, "expected": expected, "next": next })
        }
        Outcome::Skipped { reason } => json!({ "outcome": "skipped", "reason": reason }),
        _ => json!({ "outcome": "unknown" }),
    };
    value["name"] = line.name.into();
    value
}

fn print(report: &CheckReport, out: &mut dyn Write) -> std::io::Result<()> {
    let (mut failed, mut skipped) = (0, 0);
    let mut line = |style: Style, begin: &str, name: &str, text: &str| {
        whole(
            out,
            &format!("{style}{begin}{style:#}{:1$}{name:<19}", "", 6 - begin.len()),
            25,
            text,
        )
    };
    for CheckLine { name, outcome, .. } in &report.lines {
        match outcome {
            Outcome::Ok { detail } => line(GOOD, "ok", name, detail)?,
            Outcome::Failed { found, expected, next } => {
                failed += 1;
                line(BAD, "FAIL", name, &format!("found {found}"))?;
                line(BAD, "", "", &format!("expected {expected}"))?;
                line(BAD, "", "", &format!("next: {next}"))?;
            }
            Outcome::Skipped { reason } => {
                skipped += 1;
                line(REFUSED, "skip", name, reason)?;
            }
            _ => line(REFUSED, "?", name, "")?,
        }
    }
    let passed = report.lines.len() - failed - skipped;
    writeln!(out, "{passed} ok, {failed} failed, {skipped} skipped")
}
