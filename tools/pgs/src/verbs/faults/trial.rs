//! Tries one cell: a step without faults, a step with the fault, and the step after it.

use std::time::Duration;

use bitstream_model::{BoardConfig, Delays, Direction, EmulatedBoard, FaultKind, PacketCount};
use scene::{Grid, Scene, SceneOptions, WarmStart};
use zynq_pgs::emulation::Build;
use zynq_pgs::error::Aftermath;
use zynq_pgs::{
    Accelerator, BoardChoice, Body, Collision, Collisions as _, Error, Impulses, OpenOptions,
    Shape, StepParameters, WarmCollisions,
};

use super::cells::Cell;
use super::expected::Expected;
use pgs_command::board;
use pgs_command::common::AcceleratorChoice;
use pgs_command::failure::{Failure, Result};

/// Limits on the board's clock: for a step of the model and of a simulator, which needs seconds for
/// a millisecond; for reading all registers after a timeout; and for the reset of all parts.
const DEADLINE: Duration = Duration::from_millis(100);
const SIMULATOR_DEADLINE: Duration = Duration::from_micros(200);
const LOOKING: Duration = Duration::from_micros(100);
const RECOVERY: Duration = Duration::from_millis(60);
/// Length registers so narrow that a packet needs several descriptors.
const LENGTH_WIDTH: u32 = 8;
/// FIFOs so short that a channel cannot run ahead of the accelerator by a whole step.
const FIFO_BEATS: usize = 16;
/// Steps until cubes dropped from 0.05 m lie on each other.
const SETTLING: u32 = 12;

/// The start of a trial's step.
#[derive(Debug)]
struct State {
    shapes: Vec<Shape>,
    bodies: Vec<Body>,
    collisions: Vec<Collision>,
    /// The impulses that the collisions begin with: zeros in a cold step.
    impulses: Vec<Impulses>,
    /// The impulses that come out of a step without faults, if they do.
    impulses_after: Vec<[u32; 6]>,
    /// The bits after a step without faults, and the step's time on the board's clock.
    after: Vec<[u32; 13]>,
    takes: Duration,
}

/// The setting of all cells of a profile.
#[derive(Debug)]
pub(super) struct Bench {
    pub(super) config: BoardConfig,
    /// Packets of the smaller step.
    pub(super) packets: Vec<PacketCount>,
    small: State,
    large: State,
    parameters: StepParameters,
    accelerator: AcceleratorChoice,
    deadline: Duration,
}

/// The results of a cell.
#[derive(Debug, Clone, Default)]
pub(super) struct CellResult {
    /// The cause in the error; none if the step succeeded.
    pub(super) cause: Option<&'static str>,
    /// Whether the fault happened, and no other violation.
    pub(super) happened: bool,
    /// Whether the error names the right cause, phase and channel; or, without an expected error,
    /// the fault had its effect.
    pub(super) named: bool,
    /// Whether the bodies are as before the step, or as after a step without faults.
    pub(super) bodies: bool,
    /// Whether the error came within its time limit.
    pub(super) in_time: bool,
    /// Whether the next step is undisturbed, or every call reports that the board is lost.
    pub(super) next: bool,
    /// Time of the step on the board's clock.
    pub(super) elapsed: Duration,
}

impl CellResult {
    pub(super) fn passed(&self) -> bool {
        self.failed_checks().is_empty()
    }

    /// The checks that failed.
    pub(super) fn failed_checks(&self) -> Vec<&'static str> {
        let all = [
            (self.happened, "happened"),
            (self.named, "named"),
            (self.bodies, "bodies"),
            (self.in_time, "in time"),
            (self.next, "next step"),
        ];
        all.into_iter().filter(|(right, _)| !right).map(|(_, what)| what).collect()
    }
}

fn bits(bodies: &[Body]) -> Vec<[u32; 13]> {
    bodies
        .iter()
        .map(|body| {
            let mut all = [0; 13];
            let numbers = body.pose.position.iter().chain(&body.pose.orientation);
            let numbers = numbers.chain(&body.velocity.linear).chain(&body.velocity.angular);
            for (bits, number) in all.iter_mut().zip(numbers) {
                *bits = number.to_bits();
            }
            all
        })
        .collect()
}

/// The bits of impulses.
fn words(impulses: &[Impulses]) -> Vec<[u32; 6]> {
    let of = |impulses: &Impulses| {
        let [a, b, c, d] = impulses.normal;
        let [e, f] = impulses.friction;
        [a, b, c, d, e, f].map(f32::to_bits)
    };
    impulses.iter().map(of).collect()
}

/// An emulated board, and the driver on it.
fn open(
    config: BoardConfig,
    choice: &AcceleratorChoice,
    shapes: &[Shape],
) -> Result<(EmulatedBoard, Accelerator)> {
    let emulated = board::emulated_board(config, choice)?;
    let accelerator = reopen(&emulated).map_err(board::unusable);
    let mut accelerator = accelerator?;
    accelerator.set_shapes(shapes).map_err(Failure::input)?;
    Ok((emulated, accelerator))
}

fn reopen(board: &EmulatedBoard) -> Result<Accelerator, Error> {
    let board = BoardChoice::Emulated(board.cpu_port());
    Accelerator::open(OpenOptions { board, ..OpenOptions::default() })
}

/// How the steps of a setting begin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Start {
    Cold,
    /// With the impulses of the step before; they come out, too.
    Warm,
}

impl Start {
    fn parameters(self) -> StepParameters {
        let warm = self == Self::Warm;
        StepParameters::thesis().with_warm_start(warm).with_impulses_out(warm)
    }
}

impl State {
    /// The collisions, with the impulses that they begin with.
    fn given(&self) -> WarmCollisions<'_, [Collision]> {
        WarmCollisions { collisions: &self.collisions, impulses: &self.impulses }
    }

    /// A pile of cubes some steps after its drop, on a board without faults.
    fn settled(side: u16, config: BoardConfig, start: Start) -> Result<Self> {
        let grid = Grid::new(side, side, side).map_err(Failure::input)?;
        let options = SceneOptions { grid, drop: 0.05 };
        let mut scene = Scene::new(&options).map_err(Failure::input)?;
        let (emulated, mut accelerator) =
            open(config, &AcceleratorChoice::default(), scene.shapes())?;
        let parameters = start.parameters();
        let mut warm = WarmStart::default();
        for _ in 0..SETTLING {
            scene.detect();
            let (bodies, collisions) = scene.parts_mut();
            let placed = warm.placed(collisions, 1.0).map_err(Failure::input)?;
            accelerator.step(bodies, &placed, &parameters).map_err(Failure::input)?;
            if parameters.impulses_out {
                warm.commit(collisions, accelerator.impulses()).map_err(Failure::input)?;
            }
        }
        scene.detect();
        let mut after = Vec::new();
        let collisions = scene.collisions().to_vec();
        let placed = warm.placed(&collisions, 1.0).map_err(Failure::input)?;
        let impulses: Vec<_> = collisions
            .iter()
            .enumerate()
            .map(|(at, of)| placed.impulses(at, of.normal, of.points()))
            .collect();
        let (port, mut takes) = (emulated.cpu_port(), Duration::ZERO);
        // From the second step on the channels are running.
        for _ in 0..2 {
            after = scene.bodies().to_vec();
            let begin = port.now();
            let warm = WarmCollisions { collisions: &collisions, impulses: &impulses };
            accelerator.step(&mut after, &warm, &parameters).map_err(Failure::input)?;
            takes = port.now().saturating_sub(begin);
        }
        Ok(Self {
            shapes: scene.shapes().to_vec(),
            bodies: scene.bodies().to_vec(),
            impulses_after: words(accelerator.impulses()),
            collisions,
            impulses,
            after: bits(&after),
            takes,
        })
    }
}

impl Bench {
    /// The setting of a build, with a pile of 27 cubes and one of 64, for the model.
    pub(super) fn new(build: &Build, start: Start) -> Result<Self> {
        let delays = Delays { fifo_beats: FIFO_BEATS, ..Delays::default() };
        let length_width = build.length_width.unwrap_or(LENGTH_WIDTH);
        let config = BoardConfig { length_width, delays, ..build.config() };
        Self::of(config, start, DEADLINE)
    }

    /// The setting of a board that equals one with a simulator, for the model.
    pub(super) fn like_simulator(build: &Build) -> Result<Self> {
        let delays = Delays { fifo_beats: FIFO_BEATS, ..Delays::default() };
        let config = BoardConfig { delays, ..build.config() };
        Self::of(config, Start::Cold, SIMULATOR_DEADLINE)
    }

    fn of(config: BoardConfig, start: Start, deadline: Duration) -> Result<Self> {
        let (small, large) = (State::settled(3, config, start)?, State::settled(4, config, start)?);
        let parameters = start.parameters().with_deadline(deadline);
        let accelerator = AcceleratorChoice::default();
        let (board, mut driver) = open(config, &accelerator, &small.shapes)?;
        let mut bodies = small.bodies.clone();
        driver.step(&mut bodies, &small.given(), &parameters).map_err(Failure::input)?;
        let packets = board.packets();
        Ok(Self { config, packets, small, large, parameters, accelerator, deadline })
    }

    /// The same setting with another accelerator.
    pub(super) fn with(self, accelerator: AcceleratorChoice) -> Self {
        Self { accelerator, ..self }
    }

    /// Contact and friction passes, the warm ones included.
    pub(super) fn passes(&self) -> [u32; 2] {
        let StepParameters { contact_iterations, friction_iterations, warm_start, .. } =
            self.parameters;
        let of = |count: u32| count + u32::from(warm_start && count > 0);
        [contact_iterations, friction_iterations].map(of)
    }
}

/// Tries a cell.
pub(super) fn run(bench: &Bench, cell: &Cell) -> CellResult {
    let mut found = CellResult::default();
    let Ok((board, mut accelerator)) = open(bench.config, &bench.accelerator, &bench.small.shapes)
    else {
        return found;
    };
    let mut step = |accelerator: &mut Accelerator, state: &State| {
        let mut bodies = state.bodies.clone();
        let result = accelerator.step(&mut bodies, &state.given(), &bench.parameters);
        (result, bits(&bodies), words(accelerator.impulses()))
    };
    let (small, port) = (&bench.small, board.cpu_port());
    let undisturbed =
        matches!(step(&mut accelerator, small), (Ok(_), ref bodies, _) if *bodies == small.after);
    let before = words(accelerator.impulses());
    board.inject(cell.plan.clone());
    let begin = port.now();
    let state = if cell.larger { &bench.large } else { small };
    let (result, bodies, impulses) = step(&mut accelerator, state);
    found.elapsed = port.now().saturating_sub(begin);
    found.happened = undisturbed
        && board.faults() == cell.plan.faults.len() as u64
        && board.violations().is_empty();
    found.cause = result.as_ref().err().and_then(Error::fault).map(zynq_pgs::Fault::name);
    // The deadline ends the step itself; the reset follows.
    let until_error = result.as_ref().err().and_then(Error::diagnosis).map(|seen| seen.elapsed);
    found.in_time = until_error.is_none_or(|time| time <= bench.deadline + LOOKING)
        && found.elapsed <= bench.deadline + RECOVERY;
    let mut interrupts = 0;
    let lost = match (&result, cell.expected) {
        (Ok(report), Expected::SameBits) => {
            interrupts = report.interrupts;
            found.bodies = bodies == state.after && impulses == state.impulses_after;
            false
        }
        (Err(error), Expected::Fails { cause, channel, aftermath }) => {
            let lost = aftermath == Aftermath::MustReopen;
            found.named = found.cause == Some(cause)
                && (channel.is_none() || channel == channel_of(error))
                && locates_fault(cell, error)
                && error.must_reopen() == lost
                && error.may_retry() != lost;
            found.bodies = bodies == bits(&state.bodies) && impulses == before;
            lost
        }
        (Ok(_) | Err(_), _) => false,
    };
    if lost {
        found.next = reports_lost(&mut accelerator, small, &mut step);
        drop(accelerator);
        found.next &= reopen(&board).is_err();
        return found;
    }
    let (next, bodies, impulses) = step(&mut accelerator, small);
    if let (Ok(report), true) = (&next, cell.expected == Expected::SameBits) {
        found.named = match cell.kind {
            // A single spurious interrupt can replace the real one, which then never comes.
            FaultKind::IrqSpurious => true,
            // A storm at the end of a step goes on in the next step.
            FaultKind::IrqStorm { .. } => interrupts + report.interrupts > 2,
            _ => found.elapsed > state.takes,
        };
    }
    found.next = next.is_ok()
        && bodies == small.after
        && impulses == small.impulses_after
        && board.violations().is_empty();
    found
}

/// The channel that an error names.
fn channel_of(error: &Error) -> Option<(usize, Direction)> {
    let name = error.fault()?.channel()?;
    let direction = match name.direction {
        zynq_pgs::diagnosis::Direction::Mm2s => Direction::Mm2s,
        zynq_pgs::diagnosis::Direction::S2mm => Direction::S2mm,
    };
    Some((name.core, direction))
}

/// Whether the diagnosis shows the fault in its channel: an error in its phase, a stall with
/// missing bytes.
///
/// When the accelerator detects a fault, its channel may be ahead by the content of the FIFOs.
fn locates_fault(cell: &Cell, error: &Error) -> bool {
    let Some((core, direction)) = cell.channel() else { return true };
    let same_way =
        |way| (way == zynq_pgs::diagnosis::Direction::S2mm) == (direction == Direction::S2mm);
    let states = error.diagnosis().map(|diagnosis| &diagnosis.channels);
    let state = states.and_then(|states| {
        states.iter().find(|s| s.channel.core == core && same_way(s.channel.direction))
    });
    let at_phase =
        |state: &zynq_pgs::diagnosis::ChannelState| state.phase.name() == cell.phase_text();
    match cell.kind {
        FaultKind::Stall => state.is_some_and(|state| state.bytes_moved < state.bytes_expected),
        FaultKind::DmaIntErr
        | FaultKind::DmaSlvErr
        | FaultKind::DmaDecErr
        | FaultKind::SgIntErr
        | FaultKind::SgSlvErr
        | FaultKind::SgDecErr
        | FaultKind::SgDecErrWrite
        | FaultKind::BdIntErr
        | FaultKind::BdSlvErr
        | FaultKind::BdDecErr => state.is_some_and(at_phase),
        _ => true,
    }
}

/// Whether every call reports that the board must be opened again.
fn reports_lost(
    accelerator: &mut Accelerator,
    state: &State,
    step: &mut impl FnMut(
        &mut Accelerator,
        &State,
    ) -> (Result<zynq_pgs::StepReport, Error>, Vec<[u32; 13]>, Vec<[u32; 6]>),
) -> bool {
    let (result, bodies, _) = step(accelerator, state);
    matches!(result, Err(Error::MustReopen))
        && bodies == bits(&state.bodies)
        && matches!(accelerator.set_shapes(&state.shapes), Err(Error::MustReopen))
}
