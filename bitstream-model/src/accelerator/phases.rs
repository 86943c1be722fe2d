//! Works through the phases of a step on what has arrived: load, passes, integration.

use std::ops::Range;

use super::arithmetic::inertia::{self, Isotropic, World};
use super::arithmetic::number::{Format, Half, Single, SingleFlushed};
use super::hazards::Entry;
use super::records::array::{Array, Records};
use super::records::decode::{self, Collision};
use super::records::results::Results;
use super::records::segment::{Beats, PacketError, Reader, Segment};
use super::records::striping::Striping;
use super::state::Velocity;
use super::{Accelerator, Phase};
use crate::cast::register;
use crate::config::Hazards;
use crate::stream::Stream;
use pgs_interface::control::{ErrorCode, NUMBERS_PER_BEAT};
use pgs_interface::number::{Precision, StreamFormat};
use pgs_interface::profile::{Depth, Inertia, Variant};
use pgs_interface::record::{Beat, CONTACT_POINTS, collision, pose, result};
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

    pub(crate) fn velocities_in(&self) -> Segment {
        let Variant { profile, numbers, .. } = self.variant;
        let striping = Striping::new(&profile.stripes.velocities, profile.mm2s_widths);
        let records = self.body_records(numbers.bodies, self.variant.velocity_rows());
        Segment::new(Array::new(striping, records))
    }

    /// The poses.
    pub(crate) fn poses_in(&self) -> Segment {
        let Variant { profile, numbers, .. } = self.variant;
        let striping = Striping::new(&profile.stripes.poses, profile.mm2s_widths);
        let records = self.body_records(numbers.poses, pose::ROWS);
        Segment::new(Array::new(striping, records))
    }

    /// The collisions of a pass. In a warm pass their impulses follow them.
    pub(crate) fn collisions_in(&self, pass: u32) -> Segment {
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

    pub(crate) fn results_out(&self) -> Results {
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
    ) -> Result<bool, PacketError> {
        let records = segment.available(inputs);
        if records == 0 {
            return segment.check_waiting(inputs).map(|()| false);
        }
        segment.check(records, inputs)?;
        let before = segment.cycles();
        self.load_records(&segment, records, inputs)?;
        let sum = segment.advance(records, inputs);
        self.received(sum);
        self.debt += segment.cycles() - before;
        self.phase = Phase::Load(segment);
        if segment.finished() {
            self.start_pass(0);
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
        self.load_bodies(segment.done..segment.done + records, &mut reader)
    }

    pub(super) fn load_bodies(
        &mut self,
        bodies: Range<usize>,
        reader: &mut Reader<'_, impl Beats>,
    ) -> Result<(), PacketError> {
        for body in bodies {
            let arrival = self.arrival(body, reader)?;
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

    /// Cycles for which the records of an issue of a warm pass take their streams; 0 of another one.
    pub(crate) fn of_streams(&self, pass: u32) -> u64 {
        let together = self.variant.profile.collisions_per_issue as usize;
        match self.arguments.is_warm(pass) {
            true => self.collisions_in(pass).cycles_of(together),
            false => 0,
        }
    }

    fn start_pass(&mut self, number: u32) {
        if number == self.arguments.passes() {
            let (poses, results) = (self.poses_in(), self.results_out());
            self.phase = Phase::Integrate { poses, results };
            return;
        }
        self.pipeline.start_pass(self.depth(number).window.into());
        self.queue.start_pass();
        self.unsent.clear();
        self.phase = Phase::Pass { number, segment: self.collisions_in(number) };
    }

    /// Takes the collisions that have arrived, for up to `limit` cycles.
    pub(super) fn pass(
        &mut self,
        number: u32,
        mut segment: Segment,
        limit: u64,
        (inputs, outputs): (&mut [Stream], &mut [Stream]),
    ) -> Result<bool, PacketError> {
        let mut records = segment.available(inputs);
        if records == 0 {
            segment.check_waiting(inputs)?;
        }
        let queued = self.is_queued();
        if !queued {
            if self.arguments.sends_impulses(number) {
                records = records.min(outputs[IMPULSES_STREAM].space());
            }
            if records < segment.left() {
                // The collisions of an issue enter together.
                records -= records % self.variant.profile.collisions_per_issue as usize;
            }
            if records == 0 {
                return Ok(false);
            }
        }
        segment.check(records, inputs)?;
        let before = segment.done;
        let input = PassInput { number, segment: &mut segment, records, limit, inputs, outputs };
        let cycles = self.solve_arrived(input)?;
        if cycles == 0 && segment.done == before {
            return Ok(false);
        }
        self.debt += cycles;
        self.phase = Phase::Pass { number, segment };
        if segment.finished() && !(queued && self.queue.len() > 0) {
            if self.config.hazards == Hazards::Unchecked {
                self.pipeline.finish_pass(&mut self.velocities);
            }
            self.debt += u64::from(self.depth(number).fill);
            self.start_pass(number + 1);
        }
        Ok(true)
    }

    /// Solves collisions that have arrived, for up to `limit` cycles; returns the cycles that they
    /// take to enter, stalls included.
    fn solve_arrived(&mut self, input: PassInput<'_>) -> Result<u64, PacketError> {
        if self.config.profile.flushes_subnormals {
            self.solve_of::<SingleFlushed>(input)
        } else {
            self.solve_of::<Single>(input)
        }
    }

    fn solve_of<S: Format>(&mut self, input: PassInput<'_>) -> Result<u64, PacketError> {
        let numbers = self.variant.numbers;
        match (numbers.updates, numbers.rows) {
            // Rows that need more than the updates have: the configuration refuses them.
            (Precision::Binary16, _) => self.solve_with::<Half, Half>(input),
            (Precision::F32, Precision::Binary16) => self.solve_with::<Half, S>(input),
            (Precision::F32, Precision::F32) => self.solve_with::<S, S>(input),
        }
    }

    fn solve_with<R: Format, U: Format>(
        &mut self,
        input: PassInput<'_>,
    ) -> Result<u64, PacketError> {
        match (self.variant.inertia, self.is_queued()) {
            (Inertia::Isotropic, false) => self.solve_all::<R, U, Isotropic>(input),
            (Inertia::Isotropic, true) => self.solve_queued::<R, U, Isotropic>(input),
            (Inertia::World, false) => self.solve_all::<R, U, World>(input),
            (Inertia::World, true) => self.solve_queued::<R, U, World>(input),
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
        let of_streams = self.of_streams(number);
        let (mut cycles, mut records) = (0, 0);
        let mut reader = segment.reader(0, inputs);
        let mut together = std::mem::take(&mut self.warm_issue);
        together.clear();
        while records < available && cycles <= limit {
            let issue = (available - records).min(per_issue);
            let first = segment.done + records;
            let issued = (first / per_issue) as u64;
            let at = profile.issue_at(issued, of_streams);
            // The slots in front of the issue that stay empty.
            let empty = at - profile.issues_take(issued, of_streams);
            cycles += empty;
            if self.config.hazards == Hazards::Unchecked {
                let slots = empty / u64::from(profile.initiation_interval);
                self.pipeline.pass_slots(slots, &mut self.velocities);
            }
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
            cycles += profile.issues_take(issued + 1, of_streams) - at;
            records += issue;
        }
        self.warm_issue = together;
        let sum = segment.advance(records, inputs);
        self.received(sum);
        Ok(cycles)
    }

    /// Reads the collisions of the next issue of a warm pass, padding included: their records, and
    /// then the impulses of each.
    pub(super) fn read_warm_issue(
        &self,
        reader: &mut Reader<'_, impl Beats>,
        together: &mut Vec<Collision>,
    ) {
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

    /// Lets collisions that have arrived enter the queue, and solves the ones that it issues, for
    /// up to `limit` cycles; returns the cycles of these slots.
    fn solve_queued<R: Format, U: Format, I: inertia::Inertia>(
        &mut self,
        input: PassInput<'_>,
    ) -> Result<u64, PacketError> {
        let PassInput { number, segment, records: arrived, limit, inputs, outputs } = input;
        let sends = self.arguments.sends_impulses(number);
        // A queue is in front of slots alone, whose records take their streams no longer.
        let interval = u64::from(self.variant.profile.initiation_interval);
        let (mut cycles, mut entered) = (0, 0);
        let mut reader = (arrived > 0).then(|| segment.reader(0, inputs));
        loop {
            let left = segment.left() - entered;
            let enters = left > 0 && !self.queue.is_full();
            // A collision that takes the place of another one needs no slot of its own.
            let takes_slot = !enters || self.queue.fills();
            if takes_slot && cycles > limit {
                break;
            }
            if enters {
                let Some(reader) = reader.as_mut().filter(|_| entered < arrived) else { break };
                self.enter(number, segment.done + entered, reader)?;
                entered += 1;
                cycles += if takes_slot { interval } else { 0 };
                continue;
            }
            // Behind each group and behind the last one go the numbers.
            let last = left == 0 && self.queue.len() == 1;
            let closes = last || self.unsent.len() + 1 == NUMBERS_PER_BEAT as usize;
            if sends && outputs[IMPULSES_STREAM].space() < 1 + usize::from(closes) {
                break;
            }
            let Some(issued) = self.queue.issue() else { break };
            self.counters.stalls += issued.idle * interval;
            self.counters.hazards += u64::from(issued.hazard);
            cycles += (issued.idle + 1) * interval;
            let (index, collision) = (issued.number as usize, self.queued[issued.place as usize]);
            if let Some(entry) = self.entry_of(index, &collision)? {
                let velocities = self.solved::<R, U, I>(number, index, &collision, &entry);
                self.write_back(&entry, velocities);
            }
            if sends {
                self.send_impulses(number, index, &collision, outputs);
                self.unsent.push(issued.number);
                if closes {
                    let numbers = std::mem::take(&mut self.unsent);
                    self.send_beat(decode::numbers(&numbers), outputs);
                }
            }
        }
        let sum = segment.advance(entered, inputs);
        self.received(sum);
        Ok(cycles)
    }

    /// The next collision enters the queue.
    fn enter(
        &mut self,
        pass: u32,
        index: usize,
        reader: &mut Reader<'_, impl Beats>,
    ) -> Result<(), PacketError> {
        let mut collision = self.collision(reader);
        if self.arguments.is_warm(pass) {
            let [impulses] = reader.rows();
            collision = collision.with_impulses(self.variant.numbers.collisions, impulses);
        }
        let entry = self.entry_of(index, &collision)?;
        let place = self.queue.enter(entry) as usize;
        if place == self.queued.len() {
            self.queued.push(collision);
        } else {
            self.queued[place] = collision;
        }
        Ok(())
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
        self.send_beat(decode::impulses(impulses), outputs);
    }

    /// Sends a beat in front of the results.
    fn send_beat(&mut self, beat: Beat, outputs: &mut [Stream]) {
        self.sent(beat.0.into_iter().fold(0, u32::wrapping_add));
        outputs[IMPULSES_STREAM].push(&[beat]);
    }

    /// The next collision.
    #[inline]
    pub(super) fn collision(&self, reader: &mut Reader<'_, impl Beats>) -> Collision {
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
        let Some(entry) = self.entry_of(index, collision)? else {
            if unchecked {
                self.pipeline.issue_padding();
            }
            return Ok(0);
        };
        let stall = if unchecked { 0 } else { self.pipeline.wait(now, &entry) };
        let velocities = self.solved::<R, U, I>(pass, index, collision, &entry);
        if unchecked {
            let stale = self.pipeline.issue(&entry, velocities);
            self.counters.hazards += u64::from(stale);
        } else {
            self.write_back(&entry, velocities);
            self.pipeline.entered(now + stall, &entry);
            self.counters.hazards += u64::from(stall > 0);
        }
        Ok(stall)
    }

    /// The bodies of a collision that comes in and which of them move; `None` of padding.
    #[inline]
    fn entry_of(&self, index: usize, collision: &Collision) -> Result<Option<Entry>, PacketError> {
        let (count, bodies) = collision.head();
        if count == 0 {
            return Ok(None);
        }
        let wrong = |code| PacketError { code, channel: 0, beat: register(index) };
        self.checked(count, bodies).map(Some).map_err(wrong)
    }

    /// The velocities that a collision writes back; its impulses are the values after the pass.
    #[inline]
    fn solved<R: Format, U: Format, I: inertia::Inertia>(
        &mut self,
        pass: u32,
        index: usize,
        collision: &Collision,
        entry: &Entry,
    ) -> [Velocity; 2] {
        let sides = entry.bodies.map(|body| body as usize);
        let masses = sides.map(|body| self.mass_of(body));
        let mut velocities = sides.map(|body| self.velocities[body]);
        let mut impulses = self.impulses[index];
        self.compute::<R, U, I>(pass, collision, &masses, &mut velocities, &mut impulses);
        self.impulses[index] = impulses;
        velocities
    }

    fn write_back(&mut self, entry: &Entry, velocities: [Velocity; 2]) {
        for ((body, moves), velocity) in entry.bodies.iter().zip(entry.moving).zip(velocities) {
            if moves {
                self.velocities[*body as usize] = velocity;
            }
        }
    }

    /// The bodies of a collision and which of them move, or the reason to refuse it.
    #[inline]
    pub(super) fn checked(&self, count: usize, bodies: [u32; 2]) -> Result<Entry, ErrorCode> {
        let sides = bodies.map(|body| body as usize);
        if count > CONTACT_POINTS {
            return Err(ErrorCode::ContactCount);
        }
        if sides.iter().any(|body| *body >= self.shape_of.len()) {
            return Err(ErrorCode::BodyIndex);
        }
        if sides[0] == sides[1] {
            return Err(ErrorCode::SelfCollision);
        }
        let moving = sides.map(|body| self.moves(body));
        if moving == [false; 2] {
            return Err(ErrorCode::StaticPair);
        }
        Ok(Entry { bodies, moving })
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
        let sent = self.integrate_records(&poses, &mut results, records, inputs, outputs);
        let received = poses.advance(records, inputs);
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
        let mut reader = poses.reader(0, inputs);
        let mut sent = 0_u32;
        for body in poses.done..poses.done + records {
            sent = sent.wrapping_add(results.send(&self.result(body, &mut reader), outputs));
        }
        sent
    }
}
