//! Works through the phases of a step on what has arrived: load, passes, integration.

use super::arithmetic::inertia::{self, Isotropic, World};
use super::arithmetic::number::{Format, Half, HalfFlushed, Single, SingleFlushed};
use super::defer::{ArrivedRecords, Deferral};
use super::hazards::Entry;
use super::records::array::{Array, Records};
use super::records::decode::{self, Collision};
use super::records::results::Results;
use super::records::segment::{PacketError, Reader, Segment};
use super::records::striping::Striping;
use super::solver::Mass;
use super::{Accelerator, Phase};
use crate::cast::register;
use crate::config::{Hazards, Subnormals};
use crate::memory::Memory;
use crate::stream::Stream;
use pgs_interface::control::ErrorCode;
use pgs_interface::number::{Precision, StreamFormat};
use pgs_interface::profile::{Depth, Inertia, Variant};
use pgs_interface::record::{CONTACT_POINTS, collision, pose, result};
use pgs_interface::stripe::IMPULSES_STREAM;

/// Collisions of a pass that have arrived, and for how many cycles they may enter.
#[derive(Debug)]
struct PassInput<'a> {
    number: u32,
    segment: &'a mut Segment,
    records: usize,
    limit: u64,
    inputs: &'a mut [Stream],
    /// For the impulses that go out.
    outputs: &'a mut [Stream],
}

impl Accelerator {
    fn body_records(&self, format: StreamFormat, rows: usize) -> Records {
        Records { format, rows, count: self.arguments.bodies as usize, together: 1 }
    }

    pub(super) fn velocities_in(&self) -> Segment {
        let Variant { profile, numbers, .. } = self.variant;
        let striping = Striping::new(&profile.stripes.velocities, profile.mm2s_widths);
        let records = self.body_records(numbers.bodies, self.variant.velocity_rows());
        Segment::new(Array::new(striping, records))
    }

    /// The poses.
    pub(super) fn poses_in(&self) -> Segment {
        let Variant { profile, numbers, .. } = self.variant;
        let striping = Striping::new(&profile.stripes.poses, profile.mm2s_widths);
        let records = self.body_records(numbers.poses, pose::ROWS);
        Segment::new(Array::new(striping, records))
    }

    /// The collisions of a pass. In a warm pass their impulses follow them.
    pub(super) fn collisions_in(&self, pass: u32) -> Segment {
        let profile = self.variant.profile;
        let (stripe, rows) = match profile.stripes.warm_collisions {
            Some(warm) if self.arguments.is_warm(pass) => (warm, collision::WARM_ROWS),
            _ => (profile.stripes.collisions, collision::ROWS),
        };
        let striping = Striping::new(&stripe, profile.mm2s_widths);
        let records = Records {
            format: self.variant.numbers.collisions,
            rows,
            count: self.arguments.collisions as usize,
            together: profile.collisions_per_issue as usize,
        };
        Segment::new(Array::new(striping, records))
    }

    pub(super) fn results_out(&self) -> Results {
        let Variant { profile, numbers, .. } = self.variant;
        let striping = Striping::new(&profile.stripes.results, profile.s2mm_widths);
        Results::new(Array::new(striping, self.body_records(numbers.poses, result::ROWS)))
    }

    pub(crate) fn received(&mut self, sum: u32) {
        self.counters.sum_received = self.counters.sum_received.wrapping_add(sum);
    }

    pub(crate) fn sent(&mut self, sum: u32) {
        self.counters.sum_sent = self.counters.sum_sent.wrapping_add(sum);
        if let Some(stages) = &mut self.stages {
            stages.sends(self.clock);
        }
    }

    /// Loads the velocities that have arrived, a beat a cycle from each stream of 128 bits.
    pub(super) fn load(
        &mut self,
        mut segment: Segment,
        inputs: &mut [Stream],
        memory: &Memory,
        mut deferral: Deferral<'_>,
    ) -> Result<bool, PacketError> {
        let records = segment.available(inputs);
        if records == 0 {
            return segment.check_waiting(inputs).map(|()| false);
        }
        segment.check(records, inputs)?;
        let before = segment.cycles();
        let mut arrived = ArrivedRecords { records, inputs, memory };
        let deferred =
            deferral.as_deref_mut().and_then(|defer| defer.load(self, &mut segment, &mut arrived));
        let sum = match deferred {
            Some(sum) => sum?,
            None => {
                segment.fetch(records, inputs, memory);
                self.load_records(&segment, records, inputs)?;
                segment.advance(records, inputs)
            }
        };
        self.received(sum);
        self.debt += segment.cycles() - before;
        self.phase = Phase::Load(segment);
        if segment.finished() {
            self.start_pass(0, deferral);
        }
        Ok(true)
    }

    fn load_records(
        &mut self,
        segment: &Segment,
        records: usize,
        inputs: &[Stream],
    ) -> Result<(), PacketError> {
        let mut reader = segment.reader(0, inputs);
        for body in segment.done..segment.done + records {
            let arrival = self.arrival(body, &mut reader)?;
            if self.variant.inertia == Inertia::World {
                self.inertias[body] = arrival.inertia;
            }
            self.velocities[body] = arrival.velocity;
            self.shape_of[body] = arrival.shape;
            if let Some(inverse_mass) = self.inverse_masses.get_mut(body) {
                *inverse_mass = arrival.inverse_mass;
            }
        }
        Ok(())
    }

    /// Depth of the pipeline that a pass goes through.
    pub(crate) fn depth(&self, pass: u32) -> Depth {
        let contact = pass < self.arguments.contact_passes();
        self.config.depth(match contact {
            true => self.variant.contact(),
            false => self.variant.friction(),
        })
    }

    fn start_pass(&mut self, number: u32, deferral: Deferral<'_>) {
        if number == self.arguments.passes() {
            if let Some(defer) = deferral {
                defer.compute(self, number, 0);
            }
            let (poses, results) = (self.poses_in(), self.results_out());
            self.phase = Phase::Integrate { poses, results };
            return;
        }
        self.pipeline.start_pass(self.depth(number).window.into());
        if let Some(defer) = deferral {
            defer.begin_pass(self.pipeline.depth());
        }
        self.phase = Phase::Pass { number, segment: self.collisions_in(number) };
    }

    /// Takes the collisions that have arrived, for up to `limit` cycles.
    pub(super) fn pass(
        &mut self,
        number: u32,
        mut segment: Segment,
        limit: u64,
        (inputs, outputs): (&mut [Stream], &mut [Stream]),
        memory: &Memory,
        mut deferral: Deferral<'_>,
    ) -> Result<bool, PacketError> {
        let mut records = segment.available(inputs);
        let arrived = records;
        if self.arguments.sends_impulses(number) {
            records = records.min(outputs[IMPULSES_STREAM].space());
        }
        if records < segment.left() {
            // The collisions of an issue enter together.
            records -= records % self.variant.profile.collisions_per_issue as usize;
        }
        if arrived == 0 {
            segment.check_waiting(inputs)?;
        }
        if records == 0 {
            return Ok(false);
        }
        segment.check(records, inputs)?;
        let deferred = match deferral.as_deref_mut().filter(|defer| defer.takes_collisions()) {
            Some(defer) => {
                let arrived = ArrivedRecords { records, inputs, memory };
                defer.collisions(self, number, &mut segment, limit, arrived, outputs)?
            }
            None => None,
        };
        let cycles = match deferred {
            Some(cycles) => cycles,
            None => {
                let input =
                    PassInput { number, segment: &mut segment, records, limit, inputs, outputs };
                self.solve_arrived(input)?
            }
        };
        self.debt += cycles;
        self.phase = Phase::Pass { number, segment };
        if segment.finished() {
            if self.config.hazards == Hazards::Unchecked {
                self.pipeline.finish_pass(&mut self.velocities);
            }
            self.debt += u64::from(self.depth(number).fill);
            self.start_pass(number + 1, deferral);
        }
        Ok(true)
    }

    /// Solves collisions that have arrived, for up to `limit` cycles; returns the cycles that they
    /// take to enter, stalls included.
    fn solve_arrived(&mut self, input: PassInput<'_>) -> Result<u64, PacketError> {
        match self.config.subnormals {
            Subnormals::Keep => self.solve_of::<Single, Half>(input),
            Subnormals::Flush => self.solve_of::<SingleFlushed, HalfFlushed>(input),
        }
    }

    fn solve_of<S: Format, H: Format>(&mut self, input: PassInput<'_>) -> Result<u64, PacketError> {
        let numbers = self.variant.numbers;
        match (numbers.updates, numbers.rows) {
            // Rows that need more than the updates have: the configuration refuses them.
            (Precision::Binary16, _) => self.solve_with::<H, H>(input),
            (Precision::F32, Precision::Binary16) => self.solve_with::<H, S>(input),
            (Precision::F32, Precision::F32) => self.solve_with::<S, S>(input),
        }
    }

    fn solve_with<R: Format, U: Format>(
        &mut self,
        input: PassInput<'_>,
    ) -> Result<u64, PacketError> {
        match self.variant.inertia {
            Inertia::Isotropic => self.solve_all::<R, U, Isotropic>(input),
            Inertia::World => self.solve_all::<R, U, World>(input),
        }
    }

    fn solve_all<R: Format, U: Format, I: inertia::Inertia>(
        &mut self,
        input: PassInput<'_>,
    ) -> Result<u64, PacketError> {
        let PassInput { number, segment, records: available, limit, inputs, outputs } = input;
        let profile = self.variant.profile;
        let per_issue = profile.collisions_per_issue as usize;
        let warm = self.arguments.is_warm(number);
        let sends = self.arguments.sends_impulses(number);
        // Longer records may take their streams longer.
        let of_streams = if warm { segment.cycles_of(per_issue) } else { 0 };
        let interval = u64::from(profile.initiation_interval).max(of_streams);
        let mut cycles = 0;
        let mut records = 0;
        let mut reader = segment.reader(0, inputs);
        let mut together = std::mem::take(&mut self.warm_issue);
        together.clear();
        while records < available && cycles <= limit {
            let issue = (available - records).min(per_issue);
            let first = segment.done + records;
            if warm {
                self.read_warm_issue(&mut reader, &mut together);
            }
            for at in 0..issue {
                let index = first + at;
                let collision = match together.get(at) {
                    Some(collision) => *collision,
                    None => self.collision(&mut reader),
                };
                let now = self.clock + cycles;
                let stall = self.solve::<R, U, I>(number, index, now, &collision)?;
                cycles += stall;
                self.counters.stalls += stall;
                if sends {
                    self.send_impulses(number, index, &collision, outputs);
                }
            }
            cycles += interval;
            records += issue;
        }
        self.warm_issue = together;
        let sum = segment.advance(records, inputs);
        self.received(sum);
        Ok(cycles)
    }

    /// Reads the collisions of the next issue of a warm pass, padding included: their records, and then the
    /// impulses of each.
    fn read_warm_issue(&self, reader: &mut Reader<'_>, together: &mut Vec<Collision>) {
        let profile = self.variant.profile;
        let format = self.variant.numbers.collisions;
        together.clear();
        together.extend((0..profile.collisions_per_issue).map(|_| self.collision(reader)));
        for collision in together {
            const _: () = assert!(collision::WARM_ROWS == collision::IMPULSES + 1);
            let [impulses] = reader.rows();
            *collision = collision.with_impulses(format, impulses);
        }
    }

    /// Sends the impulses of a collision after the last pass of its kind; zeros for padding.
    fn send_impulses(
        &mut self,
        pass: u32,
        index: usize,
        collision: &Collision,
        outputs: &mut [Stream],
    ) {
        let impulses = match self.impulses[index] {
            _ if collision.count == 0 => [0.0; CONTACT_POINTS],
            normal if pass < self.arguments.contact_passes() => normal,
            [_, first, second, _] => [first, second, 0.0, 0.0],
        };
        let beat = decode::impulses(impulses);
        self.sent(beat.0.into_iter().fold(0, u32::wrapping_add));
        outputs[IMPULSES_STREAM].push(&[beat]);
    }

    /// The next collision.
    #[inline]
    pub(super) fn collision(&self, reader: &mut Reader<'_>) -> Collision {
        use StreamFormat::{Binary16, F32};
        match self.variant.numbers.collisions {
            F32 if self.arguments.solver.pair_friction => {
                Collision::with_friction(&reader.record())
            }
            F32 => Collision::of(F32, &reader.record()),
            Binary16 => Collision::of(Binary16, &reader.record()),
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
        self.compute::<R, U, I>(pass, collision, &masses, &mut velocities, &mut impulses);
        self.impulses[index] = impulses;

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

    /// The mass properties of both bodies, or the reason to refuse the collision.
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
        let [a, b] = sides.map(|body| self.mass_of(body));
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
        memory: &Memory,
        deferral: Deferral<'_>,
    ) -> Result<bool, PacketError> {
        let arrived = poses.available(inputs);
        let records = arrived.min(results.room(outputs));
        if arrived == 0 {
            poses.check_waiting(inputs)?;
        }
        if records == 0 {
            return Ok(false);
        }
        poses.check(records, inputs)?;
        let cycles = |poses: &Segment, results: &Results| poses.cycles().max(results.cycles());
        let before = cycles(&poses, &results);
        let mut arrived = ArrivedRecords { records, inputs, memory };
        let deferred = deferral.and_then(|defer| {
            defer.integrate(self, &mut poses, &mut results, &mut arrived, outputs)
        });
        let [received, sent] = deferred.unwrap_or_else(|| {
            poses.fetch(records, inputs, memory);
            let sent = self.integrate_records(&poses, &mut results, records, inputs, outputs);
            [poses.advance(records, inputs), sent]
        });
        self.received(received);
        self.sent(sent);
        self.debt += cycles(&poses, &results) - before;
        self.phase = if poses.finished() {
            self.debt += u64::from(self.variant.profile.integration_fill);
            Phase::Ending
        } else {
            Phase::Integrate { poses, results }
        };
        Ok(true)
    }

    /// Integrates the next bodies and sends their results; the sum of all words that were sent.
    fn integrate_records(
        &self,
        poses: &Segment,
        results: &mut Results,
        records: usize,
        inputs: &[Stream],
        outputs: &mut [Stream],
    ) -> u32 {
        let format = self.variant.numbers.poses;
        let mut reader = poses.reader(0, inputs);
        let mut sent = 0_u32;
        for body in poses.done..poses.done + records {
            let pose = decode::pose(format, &reader.record());
            let velocity = self.velocities[body];
            let moves = self.mass_of(body).inverse_mass != 0.0;
            let (pose, velocity) = self.integrated(moves, pose, velocity);
            let sum = results.send(&decode::result(format, &pose, &velocity), outputs);
            sent = sent.wrapping_add(sum);
        }
        sent
    }
}
