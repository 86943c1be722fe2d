//! The emulated accelerator: beats in, beats out.
//!
//! ```text
//! streams -> segment.rs -> decode.rs -> pipeline.rs (hazards) -> solver.rs -> velocities
//!                                                             -> integrate.rs -> streams
//! ```
//!
//! `control.rs` is its register file. It takes what has arrived on the streams, keeps account of the
//! clock cycles that this costs, and knows nothing of who sent it.

mod control;
mod decode;
mod integrate;
mod number;
mod pipeline;
mod segment;
mod solver;
mod vector;

use crate::cast::register;
use crate::config::{BoardConfig, Hazards, Subnormals};
use crate::interface::control::{
    BODIES, CONTACT_ITERATIONS, ErrorCode, FRICTION_ITERATIONS, IMPULSE_SUM_FRACTION_BITS,
    ITERATIONS_MAX,
};
use crate::interface::profile::Depth;
use crate::interface::record::{Beat, CONTACT_POINTS, collision, pose, result, velocity};
use crate::stream::Stream;
use crate::violation::{Log, ViolationKind};

use control::{Arguments, Counters, Registers, Request};
use decode::Collision;
use integrate::{Pose, integrate};
use number::{Flush, Keep, Number};
use pipeline::{Entry, Pipeline};
use segment::{PacketError, Segment, Striping};
use solver::{Impulses, Mass, Velocity};

/// Where a step stands.
#[derive(Debug, Clone, Copy)]
enum Phase {
    Idle,
    Load(Segment),
    Pass {
        number: u32,
        segment: Segment,
    },
    Integrate(Segment),
    /// The last results are on their way out.
    Ending,
    Failed,
}

/// The integer part, toward zero and stopped at the ends, as the accumulator takes it.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
fn to_fixed(value: f64) -> u64 {
    value as u64
}

/// What [`Accelerator::run`] did.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Ran {
    /// Clock cycles that passed in it.
    pub(crate) cycles: u64,
    /// Whether anything but waiting was done.
    pub(crate) progressed: bool,
}

/// The accelerator.
#[derive(Debug)]
pub(crate) struct Accelerator {
    config: BoardConfig,
    registers: Registers,
    arguments: Arguments,
    phase: Phase,
    start_due: bool,
    reset_until: Option<u64>,
    fault: Option<ErrorCode>,
    /// Cycles since the start of the step.
    clock: u64,
    /// Cycles that the last action still takes.
    debt: u64,
    counters: Counters,
    pipeline: Pipeline,
    velocities: Vec<Velocity>,
    shape_of: Vec<u8>,
    impulses: Vec<Impulses>,
}

impl Accelerator {
    pub(crate) fn new(config: &BoardConfig) -> Self {
        let profile = config.profile;
        Self {
            config: *config,
            registers: Registers::new(config),
            arguments: Arguments::default(),
            phase: Phase::Idle,
            start_due: false,
            reset_until: None,
            fault: None,
            clock: 0,
            debt: 0,
            counters: Counters::default(),
            pipeline: Pipeline::new(
                config.hazards,
                profile.initiation_interval,
                profile.collisions_per_issue,
            ),
            velocities: Vec::new(),
            shape_of: Vec::new(),
            impulses: Vec::new(),
        }
    }

    pub(crate) fn inject(&mut self, code: ErrorCode) {
        self.fault = Some(code);
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
                self.reset_until = Some(now + self.config.delays.reset);
                self.registers.reset();
                self.phase = Phase::Idle;
                self.start_due = false;
                self.debt = 0;
                self.fault = None;
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

    /// Lets `cycles` pass in which nothing could be done for want of beats or space.
    pub(crate) fn starve(&mut self, cycles: u64) {
        self.clock += cycles;
        self.counters.waits += cycles;
    }

    /// Works for up to `limit` cycles on what has arrived, then returns; it returns early when
    /// there is nothing to do.
    pub(crate) fn run(&mut self, limit: u64, inputs: &mut [Stream], outputs: &mut [Stream]) -> Ran {
        match self.config.subnormals {
            Subnormals::Keep => self.run_with::<Keep>(limit, inputs, outputs),
            Subnormals::Flush => self.run_with::<Flush>(limit, inputs, outputs),
        }
    }

    fn run_with<N: Number>(
        &mut self,
        limit: u64,
        inputs: &mut [Stream],
        outputs: &mut [Stream],
    ) -> Ran {
        let mut ran = Ran::default();
        if !self.running() {
            return ran;
        }
        if std::mem::take(&mut self.start_due) {
            ran.progressed = true;
            self.start();
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
            let left = limit - ran.cycles;
            let progress = match self.phase {
                Phase::Idle | Phase::Failed => break,
                Phase::Load(segment) => self.load(segment, inputs),
                Phase::Pass { number, segment } => self.pass::<N>(number, segment, left, inputs),
                Phase::Integrate(segment) => self.integrate::<N>(segment, inputs, outputs),
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

    fn fail(&mut self, code: ErrorCode, channel: usize, detail: u32) {
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
        let memory = profile.memory;
        let needed = u64::from(arguments.bodies) * u64::from(memory.bytes_per_body)
            + u64::from(arguments.collisions) * u64::from(memory.bytes_per_collision);
        let out_of_range = [
            (BODIES.offset, arguments.bodies == 0 || arguments.bodies > profile.body_capacity),
            (CONTACT_ITERATIONS.offset, arguments.contact_iterations > ITERATIONS_MAX),
            (FRICTION_ITERATIONS.offset, arguments.friction_iterations > ITERATIONS_MAX),
        ];
        if let Some((offset, _)) = out_of_range.into_iter().find(|(_, wrong)| *wrong) {
            self.fail(ErrorCode::Argument, 0, offset);
            return;
        }
        if needed > u64::from(memory.bytes) {
            self.fail(ErrorCode::Capacity, 0, register(needed));
            return;
        }
        let bodies = arguments.bodies as usize;
        self.velocities.clear();
        self.velocities.resize(bodies, Velocity::default());
        self.shape_of.clear();
        self.shape_of.resize(bodies, 0);
        self.impulses.clear();
        self.impulses.resize(arguments.collisions as usize, [0.0; CONTACT_POINTS]);
        self.pipeline.start_step(bodies);
        self.phase = Phase::Load(self.segment(Striping::Running, velocity::BEATS, bodies));
    }

    fn segment(&self, striping: Striping, beats: usize, records: usize) -> Segment {
        Segment::new(striping, beats, records, self.config.profile.mm2s_widths.len())
    }

    fn received(&mut self, beats: &[Beat]) {
        self.counters.sum_received = beats
            .iter()
            .flat_map(|beat| beat.0)
            .fold(self.counters.sum_received, u32::wrapping_add);
    }

    fn injected(&mut self) -> Result<(), PacketError> {
        match self.fault.take() {
            Some(code) => Err(PacketError { code, channel: 0, beat: 0 }),
            None => Ok(()),
        }
    }

    /// Loads the velocities that have arrived: one beat a cycle from each stream.
    fn load(&mut self, mut segment: Segment, inputs: &mut [Stream]) -> Result<bool, PacketError> {
        let records = segment.available(inputs);
        if records == 0 {
            return Ok(false);
        }
        self.injected()?;
        segment.check(records, inputs)?;
        let first = segment.done;
        for ahead in 0..records {
            let beats = segment.record(ahead, inputs);
            self.received(&beats);
            let (velocity, shape) = decode::velocity_from_beats(&beats);
            let body = first + ahead;
            let known = (shape as usize) < self.registers.shapes().len();
            let Some(shape) = u8::try_from(shape).ok().filter(|_| known) else {
                return Err(PacketError {
                    code: ErrorCode::ShapeIndex,
                    channel: 0,
                    beat: register(body),
                });
            };
            self.velocities[body] = velocity;
            self.shape_of[body] = shape;
        }
        segment.advance(records, inputs);
        let rows = |records: usize| (records * velocity::BEATS).div_ceil(inputs.len()) as u64;
        self.debt += rows(segment.done) - rows(first);
        self.phase = Phase::Load(segment);
        if segment.finished() {
            self.start_pass(0);
        }
        Ok(true)
    }

    /// Passes of the step; without collisions there is none.
    fn passes(&self) -> u32 {
        match self.arguments.collisions {
            0 => 0,
            _ => self.arguments.contact_iterations + self.arguments.friction_iterations,
        }
    }

    /// Depth of the pipeline that a pass goes through.
    fn depth(&self, pass: u32) -> Depth {
        let profile = self.config.profile;
        let contact = pass < self.arguments.contact_iterations;
        self.config.depth(if contact { profile.contact } else { profile.friction })
    }

    fn start_pass(&mut self, number: u32) {
        let collisions = self.arguments.collisions as usize;
        let segment = self.segment(Striping::ByRecord, collision::BEATS, collisions);
        if number == self.passes() {
            self.start_integration();
            return;
        }
        self.pipeline.start_pass(self.depth(number).window.into());
        self.phase = Phase::Pass { number, segment };
    }

    fn start_integration(&mut self) {
        let bodies = self.arguments.bodies as usize;
        self.phase = Phase::Integrate(self.segment(Striping::Running, pose::BEATS, bodies));
    }

    /// Solves the collisions that have arrived, for up to `limit` cycles.
    fn pass<N: Number>(
        &mut self,
        number: u32,
        mut segment: Segment,
        limit: u64,
        inputs: &mut [Stream],
    ) -> Result<bool, PacketError> {
        let available = segment.available(inputs);
        if available == 0 {
            return Ok(false);
        }
        self.injected()?;
        segment.check(available, inputs)?;
        let profile = self.config.profile;
        let interval = u64::from(profile.initiation_interval);
        let per_issue = profile.collisions_per_issue as usize;
        let mut cycles = 0;
        let mut records = 0;
        while records < available && cycles <= limit {
            let beats = segment.record(records, inputs);
            self.received(&beats);
            let index = segment.done + records;
            let now = self.clock + cycles;
            let stall = self.solve::<N>(number, index, now, &beats)?;
            cycles += stall;
            self.counters.stalls += stall;
            if index.is_multiple_of(per_issue) {
                cycles += interval;
            }
            records += 1;
        }
        segment.advance(records, inputs);
        self.debt += cycles;
        self.phase = Phase::Pass { number, segment };
        if segment.finished() {
            if self.config.hazards == Hazards::Unchecked {
                self.pipeline.finish_pass(&mut self.velocities);
            }
            self.debt += u64::from(self.depth(number).fill);
            self.start_pass(number + 1);
        }
        Ok(true)
    }

    /// Solves one collision in one pass; returns the cycles that it waited for its bodies.
    #[inline]
    fn solve<N: Number>(
        &mut self,
        pass: u32,
        index: usize,
        now: u64,
        beats: &[Beat; collision::BEATS],
    ) -> Result<u64, PacketError> {
        let collision = Collision::from_beats(beats);
        let unchecked = self.config.hazards == Hazards::Unchecked;
        if unchecked {
            self.pipeline.retire_due(&mut self.velocities);
        }
        if collision.count == 0 {
            if unchecked {
                self.pipeline.issue_padding();
            }
            return Ok(0);
        }
        let sides = [collision.body_a as usize, collision.body_b as usize];
        let masses = self.checked(index, &collision, sides)?;
        let moving = masses.map(|mass| mass.inverse_mass != 0.0);
        let entry = Entry { bodies: [collision.body_a, collision.body_b], moving };
        let stall = if unchecked { 0 } else { self.pipeline.wait(now, &entry) };

        let mut velocities = sides.map(|body| self.velocities[body]);
        let impulses = &mut self.impulses[index];
        let parameters = &self.arguments.solver;
        let contacts = self.arguments.contact_iterations;
        if pass < contacts {
            solver::contact::<N>(&collision, parameters, masses, &mut velocities, impulses);
            if pass + 1 == contacts {
                let sum = f64::from(solver::normal_sum::<N>(impulses));
                let unit = f64::from(1_u32 << IMPULSE_SUM_FRACTION_BITS);
                self.counters.impulse_sum =
                    self.counters.impulse_sum.saturating_add(to_fixed(sum * unit));
            }
        } else {
            if pass == contacts {
                *impulses = [solver::normal_sum::<N>(impulses), 0.0, 0.0, 0.0];
            }
            solver::friction::<N>(&collision, parameters, masses, &mut velocities, impulses);
        }

        if unchecked {
            let stale = self.pipeline.issue(&entry, velocities);
            self.counters.hazards += u64::from(stale);
        } else {
            for (body, velocity) in sides.into_iter().zip(velocities) {
                self.velocities[body] = velocity;
            }
            self.pipeline.entered(now + stall, &entry);
            self.counters.hazards += u64::from(stall > 0);
        }
        Ok(stall)
    }

    /// What the decoder refuses; the mass properties of both bodies otherwise.
    #[inline]
    fn checked(
        &self,
        index: usize,
        collision: &Collision,
        sides: [usize; 2],
    ) -> Result<[Mass; 2], PacketError> {
        let error = |code| PacketError { code, channel: 0, beat: register(index) };
        if collision.count > CONTACT_POINTS {
            return Err(error(ErrorCode::ContactCount));
        }
        if sides.iter().any(|body| *body >= self.shape_of.len()) {
            return Err(error(ErrorCode::BodyIndex));
        }
        if sides[0] == sides[1] {
            return Err(error(ErrorCode::SelfCollision));
        }
        let shapes = self.registers.shapes();
        let masses = sides.map(|body| shapes[usize::from(self.shape_of[body])]);
        if masses.iter().all(|mass| mass.inverse_mass == 0.0) {
            return Err(error(ErrorCode::StaticPair));
        }
        Ok(masses)
    }

    /// Integrates the bodies whose poses have arrived and sends their results, one beat a cycle on
    /// each stream.
    fn integrate<N: Number>(
        &mut self,
        mut segment: Segment,
        inputs: &mut [Stream],
        outputs: &mut [Stream],
    ) -> Result<bool, PacketError> {
        let lanes = outputs.len();
        let space = outputs.iter().map(Stream::space).min().unwrap_or(0);
        let records = segment.available(inputs).min(space * lanes / result::BEATS);
        if records == 0 {
            return Ok(false);
        }
        self.injected()?;
        segment.check(records, inputs)?;
        let first = segment.done;
        let total = self.arguments.bodies as usize * result::BEATS;
        let shapes = self.registers.shapes();
        for ahead in 0..records {
            let beats = segment.record(ahead, inputs);
            self.counters.sum_received = beats
                .iter()
                .flat_map(|beat: &Beat| beat.0)
                .fold(self.counters.sum_received, u32::wrapping_add);
            let body = first + ahead;
            let pose = decode::pose_from_beats(&beats);
            let velocity = self.velocities[body];
            let moves = shapes[usize::from(self.shape_of[body])].inverse_mass != 0.0;
            let (pose, velocity): (Pose, Velocity) = if moves && self.arguments.integrate {
                integrate::<N>(&self.arguments.integration, &pose, &velocity)
            } else {
                (pose, velocity)
            };
            let beats = decode::result_to_beats(&pose, &velocity);
            for (k, beat) in beats.into_iter().enumerate() {
                let running = body * result::BEATS + k;
                let output = &mut outputs[running % lanes];
                output.push(&[beat]);
                if running + lanes >= total {
                    output.mark_last();
                }
                self.counters.sum_sent =
                    beat.0.into_iter().fold(self.counters.sum_sent, u32::wrapping_add);
            }
        }
        segment.advance(records, inputs);
        let rows = |records: usize| {
            let poses_in = (records * pose::BEATS).div_ceil(inputs.len());
            let results_out = (records * result::BEATS).div_ceil(lanes);
            poses_in.max(results_out) as u64
        };
        self.debt += rows(segment.done) - rows(first);
        self.phase = Phase::Integrate(segment);
        if segment.finished() {
            self.phase = Phase::Ending;
        }
        Ok(true)
    }
}
