//! This file works through the phases of a step on what has arrived: load, passes, integration.

use super::array::{Array, Records};
use super::decode::{self, Collision};
use super::inertia::{self, Isotropic, World};
use super::integrate::integrate;
use super::number::{Format, Half, HalfFlushed, Number, Single, SingleFlushed};
use super::pipeline::Entry;
use super::results::Results;
use super::segment::{PacketError, Reader, Segment};
use super::solver::{self, Mass, Velocity};
use super::striping::Striping;
use super::{Accelerator, Phase};
use crate::cast::register;
use crate::config::{Hazards, Subnormals};
use crate::interface::control::{ErrorCode, IMPULSE_SUM_FRACTION_BITS};
use crate::interface::number::{Precision, StreamFormat};
use crate::interface::profile::{Depth, Geometry, Inertia};
use crate::interface::record::{CONTACT_POINTS, pose, result, velocity};
use crate::stream::Stream;

/// The integer part, toward zero and stopped at the ends, as the accumulator takes it.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
fn to_fixed(value: f64) -> u64 {
    value as u64
}

impl Accelerator {
    /// An array of body records that comes in.
    fn bodies_in(&self, rows: usize) -> Segment {
        let profile = self.variant.profile;
        let striping = Striping::new(&profile.stripes.bodies, profile.mm2s_widths);
        Segment::new(Array::new(striping, self.body_records(rows)))
    }

    fn body_records(&self, rows: usize) -> Records {
        Records {
            format: self.variant.numbers.bodies,
            rows,
            count: self.arguments.bodies as usize,
            together: 1,
        }
    }

    pub(super) fn velocities_in(&self) -> Segment {
        self.bodies_in(self.variant.velocity_rows())
    }

    fn collisions_in(&self) -> Segment {
        let profile = self.variant.profile;
        let striping = Striping::new(&profile.stripes.collisions, profile.mm2s_widths);
        let records = Records {
            format: self.variant.numbers.collisions,
            rows: self.variant.collision_rows(),
            count: self.arguments.collisions as usize,
            together: profile.collisions_per_issue as usize,
        };
        Segment::new(Array::new(striping, records))
    }

    fn results_out(&self) -> Results {
        let profile = self.variant.profile;
        let striping = Striping::new(&profile.stripes.bodies, profile.s2mm_widths);
        Results::new(Array::new(striping, self.body_records(result::ROWS)))
    }

    fn injected(&mut self) -> Result<(), PacketError> {
        match self.fault.take() {
            Some(code) => Err(PacketError { code, channel: 0, beat: 0 }),
            None => Ok(()),
        }
    }

    fn received(&mut self, sum: u32) {
        self.counters.sum_received = self.counters.sum_received.wrapping_add(sum);
    }

    /// Numbers as an on-chip array of that precision holds them.
    #[inline]
    fn stored<const N: usize>(&self, precision: Precision, numbers: [f32; N]) -> [f32; N] {
        fn rounded<F: Format, const N: usize>(numbers: [f32; N]) -> [f32; N] {
            numbers.map(|number| Number::<F>::new(number).value())
        }
        match (precision, self.config.subnormals) {
            // What the arithmetic left, as it is.
            (Precision::F32, _) => numbers,
            (Precision::Binary16, Subnormals::Keep) => rounded::<Half, N>(numbers),
            (Precision::Binary16, Subnormals::Flush) => rounded::<HalfFlushed, N>(numbers),
        }
    }

    #[inline]
    fn stored_velocity(&self, velocity: Velocity) -> Velocity {
        let precision = self.variant.numbers.velocities;
        Velocity {
            linear: self.stored(precision, velocity.linear),
            angular: self.stored(precision, velocity.angular),
        }
    }

    /// Loads the velocities that have arrived, a beat a cycle from each stream of 128 bits.
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
        let format = self.variant.numbers.bodies;
        let mut reader = segment.reader(inputs);
        let shapes = self.registers.shapes();
        for body in segment.done..segment.done + records {
            let (velocity, shape) = match self.variant.inertia {
                Inertia::Isotropic => decode::velocity(format, &reader.record()),
                Inertia::World => {
                    let rows = reader.record::<{ velocity::WORLD_ROWS }>();
                    let inertia = decode::world_inertia(format, &rows);
                    self.inertias[body] = self.stored(self.variant.numbers.velocities, inertia);
                    decode::velocity(format, &[rows[velocity::LINEAR], rows[velocity::ANGULAR]])
                }
            };
            let known = (shape as usize) < shapes.len();
            let Some(shape) = u8::try_from(shape).ok().filter(|_| known) else {
                return Err(PacketError {
                    code: ErrorCode::ShapeIndex,
                    channel: 0,
                    beat: register(body),
                });
            };
            // A static body's words are not looked at: thesis16 has none for 0.
            let moves = shapes[usize::from(shape)].inverse_mass != 0.0;
            let velocity = if moves { velocity } else { Velocity::default() };
            self.velocities[body] = self.stored_velocity(velocity);
            self.shape_of[body] = shape;
        }
        let before = segment.cycles();
        let sum = segment.advance(records, inputs);
        self.received(sum);
        self.debt += segment.cycles() - before;
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
        let profile = self.variant.profile;
        let contact = pass < self.arguments.contact_iterations;
        self.config.depth(if contact { profile.contact } else { profile.friction })
    }

    fn start_pass(&mut self, number: u32) {
        if number == self.passes() {
            let (poses, results) = (self.bodies_in(pose::ROWS), self.results_out());
            self.phase = Phase::Integrate { poses, results };
            return;
        }
        self.pipeline.start_pass(self.depth(number).window.into());
        self.phase = Phase::Pass { number, segment: self.collisions_in() };
    }

    /// Solves the collisions that have arrived, for up to `limit` cycles.
    pub(super) fn pass(
        &mut self,
        number: u32,
        segment: Segment,
        limit: u64,
        inputs: &mut [Stream],
    ) -> Result<bool, PacketError> {
        match self.config.subnormals {
            Subnormals::Keep => self.pass_of::<Single, Half>(number, segment, limit, inputs),
            Subnormals::Flush => {
                self.pass_of::<SingleFlushed, HalfFlushed>(number, segment, limit, inputs)
            }
        }
    }

    fn pass_of<S: Format, H: Format>(
        &mut self,
        number: u32,
        segment: Segment,
        limit: u64,
        inputs: &mut [Stream],
    ) -> Result<bool, PacketError> {
        let numbers = self.variant.numbers;
        match (numbers.updates, numbers.rows) {
            // Rows that need more than the updates have: the configuration refuses them.
            (Precision::Binary16, _) => self.pass_with::<H, H>(number, segment, limit, inputs),
            (Precision::F32, Precision::Binary16) => {
                self.pass_with::<H, S>(number, segment, limit, inputs)
            }
            (Precision::F32, Precision::F32) => {
                self.pass_with::<S, S>(number, segment, limit, inputs)
            }
        }
    }

    fn pass_with<R: Format, U: Format>(
        &mut self,
        number: u32,
        segment: Segment,
        limit: u64,
        inputs: &mut [Stream],
    ) -> Result<bool, PacketError> {
        match self.variant.inertia {
            Inertia::Isotropic => {
                self.collisions::<R, U, Isotropic>(number, segment, limit, inputs)
            }
            Inertia::World => self.collisions::<R, U, World>(number, segment, limit, inputs),
        }
    }

    fn collisions<R: Format, U: Format, I: inertia::Inertia>(
        &mut self,
        number: u32,
        mut segment: Segment,
        limit: u64,
        inputs: &mut [Stream],
    ) -> Result<bool, PacketError> {
        let profile = self.variant.profile;
        let interval = u64::from(profile.initiation_interval);
        let per_issue = profile.collisions_per_issue as usize;
        let mut available = segment.available(inputs);
        if available < segment.left() {
            // The collisions of an issue enter together.
            available -= available % per_issue;
        }
        if available == 0 {
            return Ok(false);
        }
        self.injected()?;
        segment.check(available, inputs)?;
        let mut cycles = 0;
        let mut records = 0;
        let mut reader = segment.reader(inputs);
        while records < available && cycles <= limit {
            let issue = (available - records).min(per_issue);
            let first = segment.done + records;
            for index in first..first + issue {
                let collision = self.collision(&mut reader);
                let now = self.clock + cycles;
                let stall = self.solve::<R, U, I>(number, index, now, &collision)?;
                cycles += stall;
                self.counters.stalls += stall;
            }
            cycles += interval;
            records += issue;
        }
        let sum = segment.advance(records, inputs);
        self.received(sum);
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

    /// The next collision.
    #[inline]
    fn collision(&self, reader: &mut Reader<'_>) -> Collision {
        use StreamFormat::{Binary16, F32, Thesis16};
        match (self.variant.profile.geometry, self.variant.numbers.collisions) {
            (Geometry::Absolute, F32) => Collision::absolute(F32, &reader.record()),
            (Geometry::Absolute, Binary16) => Collision::absolute(Binary16, &reader.record()),
            (Geometry::Absolute, Thesis16) => Collision::absolute(Thesis16, &reader.record()),
            (Geometry::Relative, Binary16) => Collision::relative(Binary16, &reader.record()),
            (Geometry::Relative, format) => Collision::relative(format, &reader.record()),
        }
    }

    /// Solves one collision in one pass; returns the cycles that it waited for its bodies.
    #[inline]
    fn solve<R: Format, U: Format, I: inertia::Inertia>(
        &mut self,
        pass: u32,
        index: usize,
        now: u64,
        collision: &Collision,
    ) -> Result<u64, PacketError> {
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
        let masses = self.checked::<I>(index, collision, sides)?;
        let moving = [masses[0].inverse_mass != 0.0, masses[1].inverse_mass != 0.0];
        let entry = Entry { bodies: [collision.body_a, collision.body_b], moving };
        let stall = if unchecked { 0 } else { self.pipeline.wait(now, &entry) };

        let mut velocities = [self.velocities[sides[0]], self.velocities[sides[1]]];
        let mut impulses = self.impulses[index];
        let parameters = &self.arguments.solver;
        let contacts = self.arguments.contact_iterations;
        let precision = self.variant.numbers.impulses;
        if pass < contacts {
            solver::contact::<R, U, I>(
                collision,
                parameters,
                &masses,
                &mut velocities,
                &mut impulses,
            );
            impulses = self.stored(precision, impulses);
            if pass + 1 == contacts {
                let sum = f64::from(solver::normal_sum::<U>(&impulses));
                let unit = f64::from(1_u32 << IMPULSE_SUM_FRACTION_BITS);
                self.counters.impulse_sum =
                    self.counters.impulse_sum.saturating_add(to_fixed(sum * unit));
            }
        } else {
            if pass == contacts {
                let sum = solver::normal_sum::<U>(&impulses);
                impulses = self.stored(precision, [sum, 0.0, 0.0, 0.0]);
            }
            solver::friction::<R, U, I>(
                collision,
                parameters,
                &masses,
                &mut velocities,
                &mut impulses,
            );
            impulses = self.stored(precision, impulses);
        }
        self.impulses[index] = impulses;
        let [a, b] = velocities;
        let velocities = [self.stored_velocity(a), self.stored_velocity(b)];

        if unchecked {
            let stale = self.pipeline.issue(&entry, velocities);
            self.counters.hazards += u64::from(stale);
        } else {
            for side in 0..2 {
                if moving[side] {
                    self.velocities[sides[side]] = velocities[side];
                }
            }
            self.pipeline.entered(now + stall, &entry);
            self.counters.hazards += u64::from(stall > 0);
        }
        Ok(stall)
    }

    /// What the decoder refuses; the mass properties of both bodies otherwise.
    #[inline]
    fn checked<I: inertia::Inertia>(
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
        let mass = |body: usize| {
            let shape = shapes[usize::from(self.shape_of[body])];
            let inverse_inertia = I::stored(shape.inverse_inertia, &self.inertias, body);
            Mass { inverse_mass: shape.inverse_mass, inverse_inertia }
        };
        let (a, b) = (mass(sides[0]), mass(sides[1]));
        if a.inverse_mass == 0.0 && b.inverse_mass == 0.0 {
            return Err(error(ErrorCode::StaticPair));
        }
        Ok([a, b])
    }

    /// Integrates the bodies whose poses have arrived and sends their results, a beat a cycle on
    /// each stream of 128 bits.
    pub(super) fn integrate(
        &mut self,
        mut poses: Segment,
        mut results: Results,
        inputs: &mut [Stream],
        outputs: &mut [Stream],
    ) -> Result<bool, PacketError> {
        let records = poses.available(inputs).min(results.room(outputs));
        if records == 0 {
            return Ok(false);
        }
        self.injected()?;
        poses.check(records, inputs)?;
        let format = self.variant.numbers.bodies;
        let cycles = |poses: &Segment, results: &Results| poses.cycles().max(results.cycles());
        let before = cycles(&poses, &results);
        let shapes = self.registers.shapes();
        let step = match (self.variant.numbers.updates, self.config.subnormals) {
            (Precision::F32, Subnormals::Keep) => integrate::<Single>,
            (Precision::F32, Subnormals::Flush) => integrate::<SingleFlushed>,
            (Precision::Binary16, Subnormals::Keep) => integrate::<Half>,
            (Precision::Binary16, Subnormals::Flush) => integrate::<HalfFlushed>,
        };
        let mut reader = poses.reader(inputs);
        for body in poses.done..poses.done + records {
            let pose = decode::pose(format, &reader.record());
            let velocity = self.velocities[body];
            let moves = shapes[usize::from(self.shape_of[body])].inverse_mass != 0.0;
            let (pose, velocity) = if moves && self.arguments.integrate {
                step(&self.arguments.integration, &pose, &velocity)
            } else {
                (pose, velocity)
            };
            let sum = results.send(&decode::result(format, &pose, &velocity), outputs);
            self.counters.sum_sent = self.counters.sum_sent.wrapping_add(sum);
        }
        let sum = poses.advance(records, inputs);
        self.received(sum);
        self.debt += cycles(&poses, &results) - before;
        let finished = poses.finished();
        self.phase = if finished { Phase::Ending } else { Phase::Integrate { poses, results } };
        Ok(true)
    }
}
