//! Works through the records that have arrived: passes issue, bodies come alive and leave, cycle by
//! cycle, until a record is missing on a stream.

use super::super::solver::{Impulses, Mass, Velocity};
use super::super::{Accelerator, Phase};
use super::entry::{Entry, Use};
use super::flow::{Flow, NEVER, Next};
use super::place::Place;
use crate::accelerator::arithmetic::inertia::{Isotropic, World};
use crate::accelerator::arithmetic::number::{Format, Half, HalfFlushed, Single, SingleFlushed};
use crate::accelerator::records::decode;
use crate::accelerator::records::results::Results;
use crate::accelerator::records::segment::{PacketError, Segment};
use crate::cast::register;
use crate::config::Subnormals;
use crate::stream::Stream;
use pgs_interface::control::ErrorCode;
use pgs_interface::number::Precision;
use pgs_interface::profile::Inertia;

/// Cycles for which the passes go on while a stream lacks a record, before the streams are read
/// again.
const GRACE: u64 = 16;

/// One pass over one collision, in the formats of a bitstream.
type PassFn =
    fn(&mut Accelerator, u32, &decode::Collision, &[Mass; 2], &mut [Velocity; 2], &mut Impulses);

/// The condition that the first pass waits for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum First {
    /// A known cycle, or nothing any more.
    Time,
    /// The collision, or a velocity that comes with it.
    Stream,
    /// A place that is still taken.
    Place,
    /// Room in the delay line behind it.
    Room,
}

/// A step of a design that streams the collisions once.
#[derive(Debug)]
pub(in super::super) struct Windowed {
    flow: Flow,
    collisions: Segment,
    velocities: Segment,
    poses: Segment,
    results: Results,
    /// The entry that the first pass takes next, once its record has come.
    head: Option<Entry>,
    first: First,
    /// Bodies that have come alive, and that have left.
    born: usize,
    left: usize,
    /// The cycle from which the streams let the next body leave for the integration.
    leave_due: u64,
    /// Cycles between two bodies that leave after a collision.
    leave_interval: u64,
    /// Cycles between two bodies in no collision, which come and leave at the end.
    idle_interval: u64,
}

impl Windowed {
    pub(super) fn new(
        flow: Flow,
        collisions: Segment,
        velocities: Segment,
        poses: Segment,
        results: Results,
    ) -> Self {
        let leave_interval = poses.cycles_of(1).max(results.cycles_of_one());
        let idle_interval = leave_interval.max(velocities.cycles_of(1));
        Self {
            flow,
            collisions,
            velocities,
            poses,
            results,
            head: None,
            first: First::Time,
            born: 0,
            left: 0,
            leave_due: 0,
            leave_interval,
            idle_interval,
        }
    }

    fn arrived(&self, inputs: &[Stream], outputs: &[Stream]) -> Arrived {
        let all = self.flow.shape.collisions;
        Arrived {
            collisions: if all == 0 { 0 } else { self.collisions.available(inputs) },
            velocities: self.velocities.available(inputs),
            poses: self.poses.available(inputs),
            room: self.results.room(outputs),
            ..Arrived::default()
        }
    }

    /// Checks that packets end where they must.
    fn check(&self, there: &Arrived, inputs: &[Stream]) -> Result<(), PacketError> {
        for (segment, records) in [
            (&self.collisions, there.collisions),
            (&self.velocities, there.velocities),
            (&self.poses, there.poses),
        ] {
            if records > 0 {
                segment.check(records, inputs)?;
            }
            // The step may wait for more records than have arrived.
            segment.check_waiting(inputs)?;
        }
        Ok(())
    }

    /// Takes the beats of all records that were read; returns the sum of their words.
    fn advance(&mut self, there: &Arrived, inputs: &mut [Stream]) -> u32 {
        let mut sum = 0_u32;
        for (segment, taken) in [
            (&mut self.collisions, there.collisions_taken),
            (&mut self.velocities, there.velocities_taken),
            (&mut self.poses, there.poses_taken),
        ] {
            if taken > 0 {
                sum = sum.wrapping_add(segment.advance(taken, inputs));
            }
        }
        sum
    }

    fn bodies(&self) -> usize {
        self.poses.done + self.poses.left()
    }

    fn finished(&self) -> bool {
        self.left == self.bodies() && self.flow.issued_all()
    }

    /// The cycle at which the next body leaves if no record is missing for it: a body after its
    /// last use, or at the end a body in no collision.
    fn leaves(&self) -> Option<u64> {
        match self.flow.leaving.front() {
            Some(leaving) => Some(leaving.ready.max(self.leave_due)),
            None => {
                let rest = self.flow.issued_all() && self.born == self.left;
                (rest && self.left < self.bodies()).then_some(self.leave_due)
            }
        }
    }

    /// The cycle since which the first pass lacks a record on a stream, if it lacks one.
    fn first_lacks(&self) -> Option<u64> {
        let first = self.flow.passes.first().filter(|_| self.first == First::Stream)?;
        Some(self.flow.free(first))
    }

    /// Whether all records have arrived for the next body that leaves.
    fn may_leave(&self, there: &Arrived) -> bool {
        there.pose() && (!self.flow.leaving.is_empty() || there.velocities(1))
    }
}

/// Records on the streams, and how many of them were taken.
#[derive(Debug, Clone, Copy, Default)]
struct Arrived {
    collisions: usize,
    velocities: usize,
    poses: usize,
    /// Results that the streams have room for.
    room: usize,
    collisions_taken: usize,
    velocities_taken: usize,
    poses_taken: usize,
}

impl Arrived {
    fn collision(&self) -> bool {
        self.collisions_taken < self.collisions
    }

    fn velocities(&self, count: usize) -> bool {
        self.velocities_taken + count <= self.velocities
    }

    /// Whether a body can leave.
    fn pose(&self) -> bool {
        self.poses_taken < self.poses && self.poses_taken < self.room
    }
}

impl Accelerator {
    /// Works for up to `limit` cycles on the records that have arrived.
    pub(in super::super) fn windowed(
        &mut self,
        limit: u64,
        inputs: &mut [Stream],
        outputs: &mut [Stream],
    ) -> Result<bool, PacketError> {
        let Some(mut window) = self.window.take() else { return Ok(false) };
        let worked = self.session(&mut window, limit, inputs, outputs);
        self.window = Some(window);
        worked
    }

    fn session(
        &mut self,
        window: &mut Windowed,
        limit: u64,
        inputs: &mut [Stream],
        outputs: &mut [Stream],
    ) -> Result<bool, PacketError> {
        let mut there = window.arrived(inputs, outputs);
        window.check(&there, inputs)?;
        let pass_fn = self.pass_fn();
        let start = self.clock;
        let (grace, end) = (start + limit.min(GRACE), start + limit);
        let mut now = start;
        let mut progressed = false;
        self.reschedule_first(window, &there, now, inputs)?;
        while !window.finished() {
            let (issues, pass) = window.flow.earliest();
            let leaves = window.leaves();
            let leaving = leaves.filter(|at| window.may_leave(&there) && *at <= issues);
            // The cycle at which a stream begins to lack a record.
            let by_first = window.first_lacks();
            let by_leaving = leaves.filter(|_| !window.may_leave(&there));
            let lacking = by_first.into_iter().chain(by_leaving).min();
            let next = leaving.unwrap_or(issues).max(now);
            let stop = lacking.map_or(end, |at| at.max(grace).max(now).min(end));
            if next == NEVER && lacking.is_none_or(|at| at <= now) {
                if lacking.is_none() {
                    return Err(PacketError {
                        code: ErrorCode::Deadlock,
                        channel: 0,
                        beat: register(window.flow.stuck()),
                    });
                }
                break;
            }
            let until = next.min(stop);
            self.account(window, &there, now, until);
            now = until;
            if next > stop || now == end {
                break;
            }
            progressed = true;
            if leaving.is_some() {
                self.leave(window, &mut there, now, inputs, outputs)?;
                self.reschedule_first(window, &there, now, inputs)?;
            } else {
                self.issue(window, &mut there, pass, now, pass_fn, inputs)?;
            }
        }
        if window.finished() {
            // The last result is under way.
            now = now.max(window.leave_due);
            self.debt += u64::from(self.variant.profile.integration_fill);
            self.phase = Phase::Ending;
            progressed = true;
        }
        let sum = window.advance(&there, inputs);
        self.received(sum);
        self.debt += now - start;
        Ok(progressed || now > start)
    }

    /// Counts the cycles in which the first pass was due and its unit free, but it did not issue:
    /// waits for a stream, or stalls.
    fn account(&mut self, window: &Windowed, there: &Arrived, from: u64, to: u64) {
        let starved = window.leaves().is_some_and(|at| at <= from) && !window.may_leave(there);
        let (blocked, first) = match window.flow.passes.first() {
            Some(first) if first.next < window.flow.shape.collisions => {
                let since = first.due.max(window.flow.free(first)).max(from);
                (to.saturating_sub(since), window.first)
            }
            _ if window.flow.issued_all() && starved => (to - from, First::Stream),
            _ => return,
        };
        match first {
            First::Stream => self.counters.waits += blocked,
            First::Place if starved => self.counters.waits += blocked,
            First::Time | First::Place | First::Room => self.counters.stalls += blocked,
        }
    }

    /// Computes again when the first pass can issue, after a change of its conditions.
    fn reschedule_first(
        &self,
        window: &mut Windowed,
        there: &Arrived,
        now: u64,
        inputs: &[Stream],
    ) -> Result<(), PacketError> {
        let flow = &mut window.flow;
        let Some(next) = flow.passes.first().map(|first| first.next) else { return Ok(()) };
        flow.passes[0].ready = NEVER;
        window.first = First::Time;
        if next == flow.shape.collisions {
            return Ok(());
        }
        let entry = match window.head {
            Some(entry) => entry,
            None if !there.collision() => {
                window.first = First::Stream;
                return Ok(());
            }
            None => {
                let collision =
                    self.collision(&mut window.collisions.reader(there.collisions_taken, inputs));
                let entry = Entry::new(collision, next, flow.shape.places)?;
                let error = |code| PacketError { code, channel: 0, beat: register(next) };
                let empty = |of: &Use| of.moves() && !of.first && !flow.places[of.place].alive;
                if entry.uses.iter().any(empty) {
                    return Err(error(ErrorCode::EmptyPlace));
                }
                if window.born + entry.births() > window.velocities.done + window.velocities.left()
                {
                    return Err(error(ErrorCode::BodyIndex));
                }
                *window.head.insert(entry)
            }
        };
        let taken = |of: &Use| of.first && flow.places[of.place].occupied;
        if !there.velocities(entry.births()) {
            window.first = First::Stream;
        } else if entry.uses.iter().any(taken) {
            window.first = First::Place;
        } else if !flow.has_room(0) {
            window.first = First::Room;
        } else {
            flow.passes[0].ready = flow.when(0, Next { uses: entry.uses, written: 0 }, now);
        }
        Ok(())
    }

    /// Issues the next entry of a pass.
    fn issue(
        &mut self,
        window: &mut Windowed,
        there: &mut Arrived,
        pass: usize,
        now: u64,
        pass_fn: PassFn,
        inputs: &[Stream],
    ) -> Result<(), PacketError> {
        if let (0, Some(entry)) = (pass, window.head) {
            window.head = None;
            there.collisions_taken += 1;
            for of in entry.uses.iter().filter(|of| of.first) {
                let taken = there.velocities_taken;
                let body = self.arrival(
                    window.velocities.done + taken,
                    &mut window.velocities.reader(taken, inputs),
                )?;
                there.velocities_taken += 1;
                window.born += 1;
                let mass = self.mass(body.shape, body.inertia);
                window.flow.places[of.place] = Place::new(body.velocity, mass);
            }
            window.flow.push(entry);
        }
        self.solve_entry(&mut window.flow, pass, pass_fn)?;
        self.counters.hazards += u64::from(window.flow.issue(pass, now));
        window.flow.reschedule(pass + 1, now);
        window.flow.reschedule(pass, now);
        if pass > 1 {
            window.flow.reschedule(pass - 1, now);
        } else {
            self.reschedule_first(window, there, now, inputs)?;
        }
        Ok(())
    }

    /// Solves the next entry of a pass.
    fn solve_entry(
        &mut self,
        flow: &mut Flow,
        pass: usize,
        pass_fn: PassFn,
    ) -> Result<(), PacketError> {
        let number = flow.passes[pass].next;
        let Some((entry, places)) = flow.parts(pass) else { return Ok(()) };
        if entry.is_bubble() {
            return Ok(());
        }
        let sides = entry.uses.map(|of| of.place);
        let masses = sides.map(|place| places[place].mass);
        if masses.iter().all(|mass| mass.inverse_mass == 0.0) {
            let beat = register(number);
            return Err(PacketError { code: ErrorCode::StaticPair, channel: 0, beat });
        }
        let mut velocities = sides.map(|place| places[place].velocity);
        pass_fn(
            self,
            register(pass),
            &entry.collision,
            &masses,
            &mut velocities,
            &mut entry.impulses,
        );
        for side in 0..2 {
            if masses[side].inverse_mass != 0.0 {
                places[sides[side]].velocity = velocities[side];
            }
        }
        Ok(())
    }

    /// Lets the next body leave: a body whose last pass is over, or one in no collision.
    fn leave(
        &mut self,
        window: &mut Windowed,
        there: &mut Arrived,
        now: u64,
        inputs: &[Stream],
        outputs: &mut [Stream],
    ) -> Result<(), PacketError> {
        let (velocity, mass, interval) = if let Some(leaving) = window.flow.leaving.pop_front() {
            let place = &mut window.flow.places[leaving.place];
            place.occupied = false;
            (place.velocity, place.mass, window.leave_interval)
        } else {
            let taken = there.velocities_taken;
            let body = self.arrival(
                window.velocities.done + taken,
                &mut window.velocities.reader(taken, inputs),
            )?;
            there.velocities_taken += 1;
            window.born += 1;
            (body.velocity, self.mass(body.shape, body.inertia), window.idle_interval)
        };
        let format = self.variant.numbers.poses;
        let pose = decode::pose(format, &window.poses.reader(there.poses_taken, inputs).record());
        there.poses_taken += 1;
        window.left += 1;
        window.leave_due = now + interval;
        let (pose, velocity) = self.integrated(mass.inverse_mass != 0.0, pose, velocity);
        let sum = window.results.send(&decode::result(format, &pose, &velocity), outputs);
        self.counters.sum_sent = self.counters.sum_sent.wrapping_add(sum);
        Ok(())
    }

    /// The pass function in the formats of this bitstream.
    fn pass_fn(&self) -> PassFn {
        match self.config.subnormals {
            Subnormals::Keep => self.pass_fn_in::<Single, Half>(),
            Subnormals::Flush => self.pass_fn_in::<SingleFlushed, HalfFlushed>(),
        }
    }

    fn pass_fn_in<S: Format, H: Format>(&self) -> PassFn {
        let numbers = self.variant.numbers;
        match (numbers.updates, numbers.rows) {
            // The configuration refuses rows in a wider format than the updates.
            (Precision::Binary16, _) => self.pass_fn_with::<H, H>(),
            (Precision::F32, Precision::Binary16) => self.pass_fn_with::<H, S>(),
            (Precision::F32, Precision::F32) => self.pass_fn_with::<S, S>(),
        }
    }

    fn pass_fn_with<R: Format, U: Format>(&self) -> PassFn {
        match self.variant.inertia {
            Inertia::Isotropic => Self::compute::<R, U, Isotropic>,
            Inertia::World => Self::compute::<R, U, World>,
        }
    }
}
