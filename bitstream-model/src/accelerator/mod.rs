//! The emulated accelerator: beats in, beats out.
//!
//! ```text
//! streams -> records/segment.rs -> records/decode.rs -> queue.rs or hazards.rs -> solver.rs
//!                                       integrate.rs -> records/results.rs -> streams
//! ```
//!
//! `phases.rs` goes through load, passes and integration, `per_record.rs` is what happens to one
//! record. `records` says where rows lie in
//! beats and beats on streams, `arithmetic` is that of the words; `control.rs` is the register
//! file. The accelerator takes what has arrived on the streams, keeps account of the clock cycles
//! that this costs, and knows nothing of who sent it.
//!
//! **Which code runs.** This folder is the reference: it computes a record when it takes it. Where
//! a host waits for a whole step, the board takes it by [`fast`](crate::fast) instead, with the
//! same bits. To see the reference run, switch that off: [`BoardConfig::fast`].

pub(crate) mod arithmetic;
mod at_once;
pub(crate) mod control;
pub(crate) mod hazards;
pub(crate) mod integrate;
pub(crate) mod per_record;
mod phases;
pub(crate) mod queue;
pub(crate) mod records;
pub(crate) mod solver;
pub(crate) mod state;

use crate::cast::register;
use crate::config::BoardConfig;
use crate::config::quirks::Resettable;
use crate::fault::{
    FaultKind, Faults, PassKind, Place, StepPhase, StepShape, end_of_reset, pass_of,
};
use crate::recording::{Stage, StageCounts, StageLog, StageSpan};
use crate::stream::Stream;
use crate::violation::{Log, ViolationKind};
use pgs_interface::control::{
    BODIES, CONTACT_ITERATIONS, ErrorCode, FRICTION_ITERATIONS, ITERATIONS_MAX, NUMBERS_PER_BEAT,
};
use pgs_interface::profile::{Inertia, Variant};
use pgs_interface::record::CONTACT_POINTS;

use control::{Arguments, Counters, Registers, Request};
use hazards::Pipeline;
use queue::Queue;
use records::decode::Collision;
use records::results::Results;
use records::segment::Segment;
use solver::Impulses;
use state::Velocity;

/// Where a step stands.
#[derive(Debug, Clone, Copy)]
#[expect(clippy::large_enum_variant, reason = "an accelerator has one")]
pub(crate) enum Phase {
    Idle,
    Load(Segment),
    Pass {
        number: u32,
        segment: Segment,
    },
    Integrate {
        poses: Segment,
        results: Results,
    },
    /// The last results are on their way out.
    Ending,
    Failed,
}

/// The outcome of [`Accelerator::run`].
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Ran {
    /// Clock cycles that passed in it.
    pub(crate) cycles: u64,
    /// Whether anything but waiting was done.
    pub(crate) progressed: bool,
    /// All bodies are loaded just now, and the run can go on.
    pub(crate) loaded: bool,
}

/// The accelerator.
#[derive(Debug)]
pub(crate) struct Accelerator {
    config: BoardConfig,
    pub(crate) variant: Variant,
    registers: Registers,
    pub(crate) arguments: Arguments,
    phase: Phase,
    start_due: bool,
    reset_until: Option<u64>,
    /// Takes and sends nothing until it is reset.
    hung: bool,
    /// Cycles since the start of the step.
    pub(crate) clock: u64,
    /// Cycles that the last action still takes.
    debt: u64,
    pub(crate) counters: Counters,
    pub(crate) pipeline: Pipeline,
    queue: Queue,
    /// The records of the collisions in the queue, by their places.
    queued: Vec<Collision>,
    /// The numbers of collisions whose impulses went out, and which have not gone out themselves.
    unsent: Vec<u32>,
    pub(crate) velocities: Vec<Velocity>,
    pub(crate) shape_of: Vec<u8>,
    /// With streamed masses, that of each body.
    pub(crate) inverse_masses: Vec<f32>,
    /// With world inertia, that of each body.
    pub(crate) inertias: Vec<arithmetic::inertia::Stored>,
    pub(crate) impulses: Vec<Impulses>,
    /// The collisions of the issue under way in a warm pass; kept for its memory.
    warm_issue: Vec<Collision>,
    /// The stages of the step, while the board is recorded.
    stages: Option<Box<StageLog>>,
}

impl Accelerator {
    pub(crate) fn new(config: &BoardConfig) -> Self {
        let profile = config.profile;
        let held = config.quirks.held_reset == Some(Resettable::Accelerator);
        Self {
            config: *config,
            variant: config.variant(),
            registers: Registers::new(config),
            arguments: Arguments::default(),
            phase: Phase::Idle,
            start_due: false,
            reset_until: held.then_some(u64::MAX),
            hung: false,
            clock: 0,
            debt: 0,
            counters: Counters::default(),
            pipeline: Pipeline::new(
                config.hazards,
                profile.initiation_interval,
                profile.collisions_per_issue,
            ),
            queue: Queue::new(config.queue_depth()),
            queued: Vec::new(),
            unsent: Vec::new(),
            velocities: Vec::new(),
            shape_of: Vec::new(),
            inverse_masses: Vec::new(),
            inertias: Vec::new(),
            impulses: Vec::new(),
            warm_issue: Vec::new(),
            stages: None,
        }
    }

    /// Whether the step goes through the issue queue.
    pub(crate) fn is_queued(&self) -> bool {
        self.config.queue_depth() > 0 && !self.arguments.in_order
    }

    /// Slots for which a collision in the issue queue occupies its bodies.
    pub(crate) fn queue_window(&self) -> u64 {
        let kinds = [self.variant.contact(), self.variant.friction()];
        let [contact, friction] = kinds.map(|kind| self.config.depth(kind).window);
        let interval = self.variant.profile.initiation_interval;
        contact.max(friction).div_ceil(interval).max(1).into()
    }

    /// Beats of impulses that go out behind the last pass of a kind, with the numbers among them.
    pub(crate) fn impulse_beats(&self) -> usize {
        let collisions = self.arguments.collisions;
        let numbers = if self.is_queued() { collisions.div_ceil(NUMBERS_PER_BEAT) } else { 0 };
        collisions as usize + numbers as usize
    }

    fn busy(&self) -> bool {
        self.start_due || !matches!(self.phase, Phase::Idle | Phase::Failed)
    }

    /// Reads a register; `None` where there is none.
    pub(crate) fn read(&mut self, offset: u32) -> Option<u32> {
        let (busy, resetting) = (self.busy(), self.reset_until.is_some());
        self.registers.read(&self.config, offset, busy, resetting)
    }

    /// Writes a register. Returns whether it was a doorbell, or `None` where there is no register.
    pub(crate) fn write(
        &mut self,
        now: u64,
        offset: u32,
        value: u32,
        log: &mut Log,
        faults: &mut Faults,
    ) -> Option<bool> {
        if self.reset_until.is_some() {
            // Deaf until the reset has ended.
            return Some(false);
        }
        if self.busy() && self.registers.is_argument(offset) {
            log.violation(ViolationKind::ArgumentWhileRunning { offset });
            return Some(false);
        }
        match self.registers.write(offset, value)? {
            Request::None => Some(false),
            Request::Start if !matches!(self.phase, Phase::Idle) || self.start_due => {
                log.violation(ViolationKind::StartWhileBusy);
                Some(false)
            }
            Request::Start => {
                self.start_due = true;
                Some(true)
            }
            Request::Reset => {
                let fault = faults.at_reset(Place::Accelerator);
                self.reset_until = Some(end_of_reset(&self.config, now, fault));
                self.registers.reset();
                self.phase = Phase::Idle;
                self.start_due = false;
                self.debt = 0;
                self.hung = false;
                self.cut_stage_short();
                Some(false)
            }
        }
    }

    /// Lets a reset end; returns whether it has just ended, which empties the streams.
    pub(crate) fn tick(&mut self, now: u64) -> bool {
        let ends = self.reset_until.is_some_and(|until| until <= now);
        if ends {
            self.reset_until = None;
        }
        ends
    }

    pub(crate) fn next_event(&self) -> Option<u64> {
        self.reset_until
    }

    pub(crate) fn interrupt(&self) -> bool {
        self.registers.interrupt()
    }

    /// Whether a step is under way.
    pub(crate) fn running(&self) -> bool {
        self.reset_until.is_none() && self.busy()
    }

    /// Notes the stages from now on.
    pub(crate) fn watch_stages(&mut self, now: u64) {
        let clock = if matches!(self.phase, Phase::Idle | Phase::Failed) { 0 } else { self.clock };
        self.stages = Some(Box::new(StageLog::new(now, clock)));
    }

    /// Goes on with the notes of another accelerator, whose place this one takes.
    pub(crate) fn watch_after(&mut self, before: &mut Self) {
        before.cut_stage_short();
        self.stages = before.stages.take();
    }

    /// A step begins at a clock of the board.
    pub(crate) fn step_begins_at(&mut self, now: u64) {
        if let Some(stages) = &mut self.stages {
            stages.begin_step(now);
        }
    }

    /// The board's clock at which the accelerator has sent last, if it is watched.
    pub(crate) fn sent_at(&self) -> Option<u64> {
        self.stages.as_ref().map(|stages| stages.sent_at())
    }

    /// The stages since they are watched, and watches no more.
    pub(crate) fn take_stages(&mut self) -> Vec<StageSpan> {
        self.cut_stage_short();
        self.stages.take().map_or_else(Vec::new, |stages| stages.finish())
    }

    fn stage_counts(&self) -> StageCounts {
        let Counters { stalls, waits, hazards, .. } = self.counters;
        StageCounts { stalls, waits, hazards }
    }

    fn note_stage(&mut self) {
        let (clock, counts) = (self.clock, self.stage_counts());
        let Some(stages) = &mut self.stages else { return };
        let stage = match self.phase {
            Phase::Idle => None,
            Phase::Failed => return stages.cut_short(clock, counts),
            Phase::Ending => return,
            Phase::Load(_) => Some(Stage::Load),
            Phase::Pass { number, .. } => {
                Some(match pass_of(number, self.arguments.contact_passes()) {
                    (PassKind::Contact, pass) => Stage::Contact(pass),
                    (PassKind::Friction, pass) => Stage::Friction(pass),
                })
            }
            Phase::Integrate { .. } => Some(Stage::Integrate),
        };
        stages.note(stage, clock, counts);
    }

    /// Notes that the stage under way does not end by itself.
    fn cut_stage_short(&mut self) {
        let (clock, counts) = (self.clock, self.stage_counts());
        if let Some(stages) = &mut self.stages {
            stages.cut_short(clock, counts);
        }
    }

    /// Whether a step begins with the next run.
    pub(crate) fn starts(&self) -> bool {
        self.reset_until.is_none() && self.start_due
    }

    /// Lets `cycles` pass in which nothing could be done for want of beats or space.
    pub(crate) fn starve(&mut self, cycles: u64) {
        self.clock += cycles;
        self.counters.waits += cycles;
    }

    /// If all bodies are loaded and no collision has come in: the cycles that the last bodies still
    /// take.
    pub(crate) fn loaded(&self) -> Option<u64> {
        match self.phase {
            Phase::Pass { number: 0, segment } if segment.done == 0 && !self.hung => {
                self.stages.is_none().then_some(self.debt)
            }
            _ => None,
        }
    }

    /// Ends the step under way, `cycles` from now, with these counters.
    pub(crate) fn end_after(&mut self, cycles: u64, counters: Counters) {
        self.clock += cycles;
        self.debt = 0;
        self.counters = counters;
        self.phase = Phase::Idle;
        self.end_step();
    }

    /// Works for up to `limit` cycles on what has arrived, then returns; it returns early when
    /// there is nothing to do, and once in each step when all bodies are loaded: then the caller
    /// goes on with the run, or takes the passes in another way.
    pub(crate) fn run(
        &mut self,
        limit: u64,
        inputs: &mut [Stream],
        outputs: &mut [Stream],
        faults: &mut Faults,
    ) -> Ran {
        let mut ran = Ran::default();
        if !self.running() {
            return ran;
        }
        if std::mem::take(&mut self.start_due) {
            ran.progressed = true;
            self.start();
            faults.step_begins(self.step_shape());
        }
        loop {
            let paid = self.debt.min(limit - ran.cycles);
            self.debt -= paid;
            self.clock += paid;
            ran.cycles += paid;
            ran.progressed |= paid > 0;
            if self.debt > 0 {
                break;
            }
            self.note_stage();
            // After it hangs no other fault can happen.
            if !self.hung && !faults.none() {
                ran.progressed |= self.apply_due_fault(faults, inputs);
            }
            if self.hung {
                break;
            }
            let left = limit - ran.cycles;
            let progress = match self.phase {
                Phase::Idle | Phase::Failed => break,
                Phase::Load(segment) => match self.load(segment, inputs) {
                    Ok(true) if matches!(self.phase, Phase::Pass { .. }) => {
                        (ran.progressed, ran.loaded) = (true, true);
                        break;
                    }
                    loaded => loaded,
                },
                Phase::Pass { number, segment } => {
                    self.pass(number, segment, left, (inputs, outputs))
                }
                Phase::Integrate { poses, results } => {
                    self.integrate(poses, results, inputs, outputs)
                }
                Phase::Ending => {
                    self.phase = Phase::Idle;
                    self.end_step();
                    Ok(true)
                }
            };
            match progress {
                Ok(true) => ran.progressed = true,
                Ok(false) => break,
                Err(error) => {
                    ran.progressed = true;
                    self.fail(error.code, error.channel, error.beat);
                }
            }
        }
        ran
    }

    /// A step begins on the accelerator that this one shadows: its packets are known, and nothing
    /// is computed.
    pub(crate) fn shadow_start(&mut self, faults: &mut Faults) {
        self.start_due = false;
        self.arguments = self.registers.arguments();
        faults.step_begins(self.step_shape());
    }

    /// The packets of the step.
    fn step_shape(&self) -> StepShape {
        let segments = [self.velocities_in(), self.collisions_in(0), self.poses_in()];
        StepShape {
            segments: std::array::from_fn(|core| {
                segments.each_ref().map(|segment| segment.beats_on(core) > 0)
            }),
            contact: self.arguments.contact_passes(),
            passes: self.arguments.passes(),
        }
    }

    /// Lets a fault happen whose time has come; returns whether one did.
    fn apply_due_fault(&mut self, faults: &mut Faults, inputs: &[Stream]) -> bool {
        let (phase, segment) = match &self.phase {
            Phase::Idle | Phase::Failed => return false,
            Phase::Ending => {
                self.hung |= faults.keeps_done();
                return self.hung;
            }
            Phase::Load(segment) => (Some(StepPhase::Load), Some(segment)),
            Phase::Pass { number, segment } => {
                let pass = StepPhase::of_pass(*number, self.arguments.contact_passes());
                (Some(pass), Some(segment))
            }
            Phase::Integrate { poses, .. } => (Some(StepPhase::Poses), Some(poses)),
        };
        let (done, arrived) = match segment {
            Some(segment) => (segment.done, segment.done + segment.available(inputs)),
            // The last records: it is at every record.
            None => (0, usize::MAX),
        };
        if arrived == done {
            return false;
        }
        let fault = faults.in_accelerator(phase, arrived as u64);
        match fault {
            Some(FaultKind::AcceleratorError { code }) => {
                self.fail(code, 0, register(done));
            }
            Some(_) => self.hung = true,
            None => {}
        }
        fault.is_some()
    }

    pub(crate) fn fail(&mut self, code: ErrorCode, channel: usize, detail: u32) {
        log::debug!("accelerator: {} (stream {channel}, detail {detail})", code.describe());
        self.registers.fail(code, channel, detail);
        self.phase = Phase::Failed;
        self.debt = 0;
        self.end_step();
    }

    fn end_step(&mut self) {
        self.counters.cycles = self.clock;
        self.registers.counters = self.counters;
        self.registers.finish();
    }

    /// Takes the arguments and starts with the load.
    fn start(&mut self) {
        let arguments = self.registers.arguments();
        self.arguments = arguments;
        self.counters = Counters::default();
        self.clock = 0;
        self.debt = 0;
        let profile = self.config.profile;
        let variant = self.variant;
        let needed = u64::from(arguments.bodies) * u64::from(variant.bytes_per_body())
            + u64::from(arguments.collisions) * u64::from(variant.bytes_per_collision());
        let out_of_range = [
            (BODIES.offset, arguments.bodies == 0 || arguments.bodies > variant.body_capacity()),
            (CONTACT_ITERATIONS.offset, arguments.contact_iterations > ITERATIONS_MAX),
            (FRICTION_ITERATIONS.offset, arguments.friction_iterations > ITERATIONS_MAX),
        ];
        if let Some((offset, _)) = out_of_range.into_iter().find(|(_, wrong)| *wrong) {
            self.fail(ErrorCode::Argument, 0, offset);
            return;
        }
        if needed > u64::from(profile.memory.bytes) {
            self.fail(ErrorCode::Capacity, 0, register(needed));
            return;
        }
        let bodies = arguments.bodies as usize;
        self.velocities.clear();
        self.velocities.resize(bodies, Velocity::default());
        self.shape_of.clear();
        self.shape_of.resize(bodies, 0);
        self.inverse_masses.clear();
        if arguments.streamed_masses {
            self.inverse_masses.resize(bodies, 0.0);
        }
        self.inertias.clear();
        if variant.inertia == Inertia::World {
            self.inertias.resize(bodies, arithmetic::inertia::Stored::default());
        }
        let collisions = arguments.collisions as usize;
        self.impulses.clear();
        self.impulses.resize(collisions, [0.0; CONTACT_POINTS]);
        self.pipeline.start_step(bodies);
        if self.is_queued() {
            self.queue.start_step(bodies, self.queue_window());
        }
        self.phase = Phase::Load(self.velocities_in());
    }
}
