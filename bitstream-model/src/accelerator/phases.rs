//! This file works through the phases of a step on what has arrived: load, passes, integration.

use super::decode::{self, Collision};
use super::integrate::{Pose, integrate};
use super::number::Number;
use super::pipeline::Entry;
use super::segment::{PacketError, Segment, Striping};
use super::solver::{self, Mass, Velocity};
use super::{Accelerator, Phase};
use crate::cast::register;
use crate::config::Hazards;
use crate::interface::control::{ErrorCode, IMPULSE_SUM_FRACTION_BITS};
use crate::interface::profile::Depth;
use crate::interface::record::{Beat, CONTACT_POINTS, collision, pose, result, velocity};
use crate::stream::Stream;

/// The integer part, toward zero and stopped at the ends, as the accumulator takes it.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
fn to_fixed(value: f64) -> u64 {
    value as u64
}

impl Accelerator {
    pub(super) fn segment(&self, striping: Striping, beats: usize, records: usize) -> Segment {
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
    pub(super) fn load(
        &mut self,
        mut segment: Segment,
        inputs: &mut [Stream],
    ) -> Result<bool, PacketError> {
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
        let rows = |records: usize| (records * velocity::ROWS).div_ceil(inputs.len()) as u64;
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
        let segment = self.segment(Striping::ByRecord, collision::ROWS, collisions);
        if number == self.passes() {
            self.start_integration();
            return;
        }
        self.pipeline.start_pass(self.depth(number).window.into());
        self.phase = Phase::Pass { number, segment };
    }

    fn start_integration(&mut self) {
        let bodies = self.arguments.bodies as usize;
        self.phase = Phase::Integrate(self.segment(Striping::Running, pose::ROWS, bodies));
    }

    /// Solves the collisions that have arrived, for up to `limit` cycles.
    pub(super) fn pass<N: Number>(
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
        beats: &[Beat; collision::ROWS],
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
    pub(super) fn integrate<N: Number>(
        &mut self,
        mut segment: Segment,
        inputs: &mut [Stream],
        outputs: &mut [Stream],
    ) -> Result<bool, PacketError> {
        let lanes = outputs.len();
        let space = outputs.iter().map(Stream::space).min().unwrap_or(0);
        let records = segment.available(inputs).min(space * lanes / result::ROWS);
        if records == 0 {
            return Ok(false);
        }
        self.injected()?;
        segment.check(records, inputs)?;
        let first = segment.done;
        let total = self.arguments.bodies as usize * result::ROWS;
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
                let running = body * result::ROWS + k;
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
            let poses_in = (records * pose::ROWS).div_ceil(inputs.len());
            let results_out = (records * result::ROWS).div_ceil(lanes);
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
