//! Opens the board of the command line, and describes it.

mod accelerator;

use std::io::{self, Write};
use std::sync::Once;

use bitstream_model::interface::address_map::{UIO_CONTROL_NODE, UIO_NODE};
use bitstream_model::interface::number::Numbers;
use bitstream_model::interface::profile::{PROFILES, Variant};
use bitstream_model::{BoardConfig, ConfigError, EmulatedBoard};
use serde_json::{Value, json};
use zynq_pgs::board::BoardKind;
use zynq_pgs::platform::MemoryChoice;
use zynq_pgs::platform::{System, uio_listing};
use zynq_pgs::validate::Excess;
use zynq_pgs::{Accelerator, BoardChoice, Fault, OpenOptions, StepParameters};

use self::accelerator::dead;
pub use self::accelerator::{emulated_board, external_accelerator};
use crate::common::CommonArgs;
use crate::diagnosis;
use crate::environment::MEMORY;
use crate::failure::{Cause, Failure, Result};
use crate::options::bandwidth::bandwidth_text;
use crate::options::build::described;
use crate::options::planned::{Injected, PlannedArgs};
use crate::output::facts::fact;

/// Next step for bodies whose inertia is too general for the board.
const WORLD_INERTIA: &str =
    "add the word world to the text of the board, as --board emulated:float,world";

/// An open board.
#[derive(Debug)]
pub struct OpenBoard {
    /// The driver of the board.
    pub accelerator: Accelerator,
    /// The builder's handle of an emulated board; none for a real one.
    pub observer: Option<EmulatedBoard>,
    /// The faults that the emulated board was given.
    injected: Option<Injected>,
    /// Why this board was chosen.
    pub reason: String,
    /// It is emulated, because there is no real one.
    stands_in: bool,
}

/// The name of a kind of board, on the command line and in results.
pub fn kind_text(kind: BoardKind) -> &'static str {
    match kind {
        BoardKind::Emulated => "emulated",
        BoardKind::DevMem => "devmem",
        BoardKind::Served => "served",
        _ => "uio",
    }
}

/// The kind of board that a choice means on this system, and why.
pub fn choose(board: &BoardChoice, system: &System) -> (BoardKind, String) {
    let kind = match board {
        BoardChoice::Automatic => return find_kind(system),
        BoardChoice::Uio { .. } => BoardKind::Uio,
        BoardChoice::DevMem(_) => BoardKind::DevMem,
        BoardChoice::Served { .. } => BoardKind::Served,
        _ => BoardKind::Emulated,
    };
    (kind, "as asked for".to_owned())
}

/// The kind of board that this system has, and why.
fn find_kind(system: &System) -> (BoardKind, String) {
    // A node that cannot be read may be the board: the attempt to open it names the obstacle.
    let unreadable = |error| (BoardKind::Uio, format!("UIO nodes cannot be listed: {error}"));
    let mut listing = match uio_listing(&system.uio) {
        Ok(listing) => listing,
        Err(error) => return unreadable(error),
    };
    match listing.has_board(UIO_NODE) {
        Ok(true) => {
            let names = [UIO_NODE, UIO_CONTROL_NODE];
            let named = |name: &&str| listing.nodes.iter().any(|node| node.name == **name);
            let name = names.into_iter().find(named).unwrap_or(UIO_NODE);
            (BoardKind::Uio, format!("there is a UIO node named {name:?}"))
        }
        Ok(false) => (BoardKind::Emulated, listing.without_board(UIO_NODE)),
        Err(error) => unreadable(error),
    }
}

/// Refuses to stand an emulated board in for a missing real one, for commands that test a board.
///
/// # Errors
///
/// Fails where there is no real board and none was named.
pub fn require(common: &CommonArgs) -> Result<()> {
    let (kind, reason) = choose(&common.board, &System::default());
    if kind != BoardKind::Emulated || !matches!(common.board, BoardChoice::Automatic) {
        return Ok(());
    }
    Err(Failure::new(Cause::NoBoard, format!("there is no board: {reason}")).next(
        "list the nodes with `pgs list`, and name a node with --board uio:NODE; or take the \
         emulated board with --board emulated",
    ))
}

/// A board that is chosen and not yet open.
#[derive(Debug)]
pub struct ChosenBoard {
    /// Its kind.
    pub kind: BoardKind,
    /// How to open it.
    pub options: OpenOptions,
    /// The builder's handle of an emulated board; none for a real one.
    pub observer: Option<EmulatedBoard>,
    /// Why this board was chosen.
    pub reason: String,
}

/// Chooses a board; an emulated one is built as `config` says.
///
/// # Errors
///
/// Fails where the options exclude each other, or no board is built as `config` says.
pub fn find(common: &CommonArgs, config: BoardConfig) -> Result<ChosenBoard> {
    let CommonArgs { board, memory, memory_of_environment, manager, .. } = common;
    let (kind, reason) = choose(board, &System::default());
    let (board, observer) = if kind == BoardKind::Emulated {
        // `PGS_MEMORY` describes real boards; it does not matter to an emulated board asked for by
        // name.
        let ignored = *memory_of_environment && matches!(board, BoardChoice::Built(_));
        if *memory != MemoryChoice::Automatic && !ignored {
            let (option, next) = match memory_of_environment {
                true => (MEMORY, "choose the board with --board emulated or --board uio"),
                false => ("--memory", "leave out --memory, or add --board uio"),
            };
            let error = format!(
                "{option} is for real boards; this one is emulated and has memory of its own"
            );
            return Err(Failure::input(error).next(next));
        }
        let emulated = emulated_board(config, &common.accelerator)?;
        (BoardChoice::Emulated(emulated.cpu_port()), Some(emulated))
    } else if matches!(board, BoardChoice::Automatic) {
        (BoardChoice::Uio { node: UIO_NODE.to_owned() }, None)
    } else {
        (board.clone(), None)
    };
    let pack_threads = Some(config.threads);
    let memory = match kind {
        BoardKind::Emulated => MemoryChoice::Automatic,
        _ => memory.clone(),
    };
    let manager = manager.clone();
    let options = OpenOptions { board, memory, manager, pack_threads, ..OpenOptions::default() };
    Ok(ChosenBoard { kind, options, observer, reason })
}

/// The failure for a configuration that no emulated board has.
pub fn not_built(error: ConfigError) -> Failure {
    let narrow = |numbers: &Numbers| {
        [numbers.collisions, numbers.bodies, numbers.poses]
            .iter()
            .any(|stream| stream.bits() < u32::BITS)
    };
    let narrow: Vec<&str> =
        PROFILES.iter().filter(|p| narrow(&p.numbers)).map(|profile| profile.name).collect();
    let is_format = matches!(error, ConfigError::StreamFormat { .. });
    let failure = Failure::input(error);
    match is_format {
        true => failure.next(format!(
            "leave out the format, or take a profile with streams of 16 bits ({})",
            narrow.join(", ")
        )),
        false => failure,
    }
}

/// Opens a board; an emulated one is built as `config` says.
///
/// # Errors
///
/// Fails where there is no such board, or it cannot be opened.
pub fn open(common: &CommonArgs, config: BoardConfig) -> Result<OpenBoard> {
    let ChosenBoard { options, observer, reason, .. } = find(common, config)?;
    let accelerator = Accelerator::open(options)
        .map_err(|error| dead(observer.as_ref()).unwrap_or_else(|| unusable(error)))?;
    let stands_in = matches!(common.board, BoardChoice::Automatic) && observer.is_some();
    Ok(OpenBoard { accelerator, observer, injected: None, reason, stands_in })
}

/// The failure for a board that is missing or cannot be opened.
pub fn unusable(error: zynq_pgs::Error) -> Failure {
    let general =
        || "see what there is with `pgs list`, or use the emulated board with --board emulated";
    let next = error.next_step().unwrap_or_else(|| general().to_owned());
    Failure::new(Cause::NoBoard, error).next(next)
}

/// Whether Ctrl-C ended a step, with its channels stopped.
pub fn is_cancelled(error: &zynq_pgs::Error) -> bool {
    matches!(error, zynq_pgs::Error::Step { fault, .. } if matches!(**fault, Fault::Cancelled))
        && !error.must_reopen()
}

impl OpenBoard {
    /// Says once on stderr that the emulated board stands in for a real one; for results that do
    /// not name their board.
    pub fn stated(self) -> Self {
        static STATED: Once = Once::new();
        if self.stands_in {
            STATED.call_once(|| {
                // With stderr closed, the results still come.
                let _ = writeln!(io::stderr(), "board: {} ({})", self.kind(), self.reason);
            });
        }
        self
    }

    /// Makes a failure of an error of the driver.
    pub fn failure(&self, error: zynq_pgs::Error) -> Failure {
        if let zynq_pgs::Error::Input(input) = &error {
            let anisotropic = matches!(input.excess(), Some(Excess::Anisotropic { .. }));
            let failure = Failure::input(error);
            return match anisotropic && self.observer.is_some() {
                true => failure.next(WORLD_INERTIA),
                false => failure,
            };
        }
        if let Some(failure) = dead(self.observer.as_ref()) {
            return failure;
        }
        let diverged = matches!(&error, zynq_pgs::Error::Step { fault, .. }
            if matches!(**fault, Fault::NotFinite { .. } | Fault::ImpulseNotFinite { .. }));
        if diverged && self.observer.is_some() {
            // The emulated board does not miscalculate: the input numbers are too large.
            return Failure::input(error).next(
                "start from smaller velocities (run: a lower --drop), take a board that \
                 waits on hazards, or a shorter time step (solve: params.npy)",
            );
        }
        let late = matches!(error.fault(), Some(Fault::Deadline { .. }));
        let next = match (late, self.observer.is_some() && self.injected.is_none()) {
            // The emulated board takes the same time again.
            (true, true) => {
                "the same deadline ends this step again: give a longer --deadline, or none"
            }
            (true, false) if error.may_retry() => {
                "run the command again, with a longer --deadline if this one ends the step again"
            }
            _ if error.may_retry() => "run the command again",
            _ => "run the command again; load the bitstream anew if that does not help",
        };
        let violations = self.observer.as_ref().map(EmulatedBoard::violations).unwrap_or_default();
        let seen: String = violations.iter().map(|violation| format!("\n{violation}")).collect();
        let next = match seen.is_empty() {
            true => next.to_owned(),
            false => format!("{next}; the emulated board saw this misuse:{seen}"),
        };
        let failure = diagnosis::hardware(error).next(next);
        match &self.injected {
            Some(injected) => failure.planned(&injected.text(), injected.to_json()),
            None => failure,
        }
    }

    /// Whether the accelerator still answers, as the model does if that runs beside it.
    ///
    /// The last registers of a step can be read from one that has died: they are all ones, and the
    /// driver takes these for counters.
    ///
    /// # Errors
    ///
    /// Fails where it has died or does not answer as the model.
    pub fn alive(&self) -> Result<()> {
        dead(self.observer.as_ref()).map_or(Ok(()), Err)
    }

    /// Gives the board the faults of `planned`, effective from its first step.
    ///
    /// # Errors
    ///
    /// Fails where the board is not an emulated one of this process.
    pub fn inject(&mut self, planned: &PlannedArgs, parameters: &StepParameters) -> Result<()> {
        if !planned.is_given() {
            return Ok(());
        }
        let Some(board) = &self.observer else {
            let next = match self.accelerator.board().kind {
                BoardKind::Served => "leave out --fault, or give it to the board's `pgs serve`",
                _ => "leave out --fault, or add --board emulated",
            };
            let error = "--fault is for an emulated board of this process";
            return Err(Failure::input(error).next(next));
        };
        if let Some(plan) = planned.plan(&board.config(), parameters) {
            board.inject(plan.clone());
            self.injected = Some(Injected { plan, board: board.clone() });
        }
        Ok(())
    }

    /// The planned faults and the number that have happened, for people.
    pub fn faults_text(&self) -> Option<String> {
        self.injected.as_ref().map(Injected::text)
    }

    /// The same for programs; null without a plan.
    pub fn faults_json(&self) -> Value {
        self.injected.as_ref().map_or(Value::Null, Injected::to_json)
    }

    fn kind(&self) -> &'static str {
        kind_text(self.accelerator.board().kind)
    }

    /// The profile with its formats and inertia, as the bitstream reports them.
    fn design(&self) -> String {
        let Variant { profile, numbers, inertia } = self.accelerator.capabilities().variant;
        let numbers = Some(numbers);
        described(&BoardConfig { profile, numbers, inertia, ..BoardConfig::default() })
    }

    /// Prints in lines of at most 100 columns which board was opened, why, and its bitstream.
    ///
    /// # Errors
    ///
    /// Fails where the output takes no more.
    pub fn print(&self, out: &mut dyn Write) -> io::Result<()> {
        let can = self.accelerator.capabilities();
        fact(out, "board", &format!("{} ({})", self.kind(), self.reason))?;
        let bitstream = format!(
            "{}, {} MHz, {} + {} channels, initiation interval {}, {}",
            self.design(),
            f64::from(can.clock_khz) / 1e3,
            can.mm2s_channels,
            can.s2mm_channels,
            can.initiation_interval,
            if can.interlocked { "interlocked" } else { "unchecked" },
        );
        let bitstream = match can.queue {
            0 => bitstream,
            depth => format!("{bitstream}, queue {depth}"),
        };
        fact(out, "bitstream", &bitstream)?;
        let Some(config) = self.config() else { return Ok(()) };
        let window = match config.window_slots {
            Some(slots) => format!("{slots} slots"),
            None => format!(
                "{} cycles (contact), {} cycles (friction)",
                can.contact.window, can.friction.window
            ),
        };
        let bandwidth = bandwidth_text(config.bandwidth);
        fact(out, "emulation", &format!("memory bandwidth {bandwidth}, hazard window {window}"))
    }

    /// The same for programs.
    pub fn to_json(&self) -> Value {
        let can = self.accelerator.capabilities();
        json!({
            "kind": self.kind(),
            "reason": self.reason,
            "profile": can.variant.profile.name,
            "design": self.design(),
            "interface_version": [can.version.0, can.version.1],
            "clock_khz": can.clock_khz,
            "interlocked": can.interlocked,
            "queue": can.queue,
            "mm2s_channels": can.mm2s_channels,
            "s2mm_channels": can.s2mm_channels,
            "initiation_interval": can.initiation_interval,
            "contact_window_cycles": can.contact.window,
            "friction_window_cycles": can.friction.window,
            "body_capacity": can.body_capacity,
            "shape_capacity": can.shape_capacity,
            "streamed_masses": can.variant.has_streamed_masses(),
            "memory_bytes": can.memory_bytes,
            "bytes_per_body": can.bytes_per_body,
            "bytes_per_collision": can.bytes_per_collision,
            "length_width": can.length_width,
            "address_width": can.address_width,
            "emulation": self.config().map(|config| json!({ "build": described(&config) })),
        })
    }

    /// The configuration of an emulated board.
    pub fn config(&self) -> Option<BoardConfig> {
        self.observer.as_ref().map(EmulatedBoard::config)
    }
}
