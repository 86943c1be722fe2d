//! This file goes through the passes over collisions that are replayed: which enter when, and what of
//! it is computed at last.

use super::decode_once::Coming;
use crate::accelerator::records::segment::{PacketError, Segment};
use crate::accelerator::records::striping::PerStream;
use crate::accelerator::{Accelerator, Phase};
use crate::memory::Memory;
use crate::shortcut::flow::collisions::{Pace, Slice};
use crate::shortcut::flow::periods::Recurrence;
use crate::stream::Stream;
use pgs_interface::record::CONTACT_POINTS;

impl Accelerator {
    /// Whether it takes beats that stay in their buffer.
    pub(crate) fn by_reference(&self) -> bool {
        self.replay.on
    }

    fn interval(&self) -> u64 {
        self.variant.profile.initiation_interval.into()
    }

    /// Takes the collisions that have arrived, for up to `limit` cycles, if they can be replayed, and
    /// are those that were decoded.
    pub(crate) fn replayed(
        &mut self,
        number: u32,
        mut segment: Segment,
        limit: u64,
        inputs: &mut [Stream],
        memory: &Memory,
    ) -> Result<bool, PacketError> {
        let together = self.replay.together();
        let mut available = segment.available(inputs);
        if available < segment.left() {
            // The collisions of an issue enter together.
            available -= available % together;
        }
        if available == 0 {
            return segment.check_waiting(inputs).map(|()| false);
        }
        segment.check(available, inputs)?;
        self.look_ahead(number, &segment, inputs, &Coming::default(), memory);
        let known = available.min(self.replay.known() - segment.done);
        let refused = known < available && self.replay.refused.is_some();
        if !self.replay.same(&segment, known, inputs) || known < available && !refused {
            self.end_replay(number, segment.done, inputs, memory);
            return self.pass(number, segment, limit, inputs);
        }
        let interval = self.interval();
        let (mut cycles, mut records) = (0, 0);
        if self.replay.even {
            let fit = usize::try_from(limit / interval).unwrap_or(usize::MAX);
            records = known.min(fit.saturating_add(1).saturating_mul(together));
            cycles = self.replay.issues(records) as u64 * interval;
            self.replay.enter(self.clock, segment.done, records);
        } else {
            while records < known && cycles <= limit {
                let issue = (known - records).min(together);
                cycles += self.issue_enters(segment.done + records, issue, self.clock + cycles);
                records += issue;
            }
        }
        // In the middle of an issue that has entered, or before one that does.
        let enters = records % together != 0 || cycles <= limit;
        if records == known && enters && refused {
            self.compute_to(number, segment.done + records);
            self.replay.on = false;
            return self.replay.refused.map_or(Ok(true), Err);
        }
        self.take(&mut segment, records, inputs);
        self.debt += cycles;
        self.phase = Phase::Pass { number, segment };
        if segment.finished() {
            self.debt += u64::from(self.depth(number).fill);
            self.start_pass(number + 1);
        }
        Ok(true)
    }

    /// Decodes what is on the streams and about to come, unless that has been done in the first pass.
    fn look_ahead(
        &mut self,
        number: u32,
        segment: &Segment,
        inputs: &[Stream],
        coming: &Coming,
        memory: &Memory,
    ) {
        if number == 0 {
            self.replay.look_ahead(segment, inputs, coming, &self.shape_of, memory);
            self.replay.look_at_distances(self.interval(), &mut self.pipeline);
        }
    }

    /// A collision enters at that clock, or as soon as it can: the cycles until then.
    #[inline]
    fn wait(&mut self, index: usize, now: u64) -> u64 {
        let Some(entry) = self.replay.entry(index) else { return 0 };
        let stall = self.pipeline.wait(now, &entry);
        self.pipeline.entered(now + stall, &entry);
        self.counters.stalls += stall;
        self.counters.hazards += u64::from(stall > 0);
        stall
    }

    /// The collisions of an issue enter at that clock, or as soon as they can: the cycles until the next
    /// one.
    #[inline]
    fn issue_enters(&mut self, first: usize, collisions: usize, now: u64) -> u64 {
        let mut stalls = 0;
        for index in first..first + collisions {
            stalls += self.wait(index, now + stalls);
        }
        stalls + self.interval()
    }

    /// Takes the beats of collisions that have entered.
    fn take(&mut self, segment: &mut Segment, records: usize, inputs: &mut [Stream]) {
        self.received(self.replay.sum(segment.done, records));
        segment.skip(records, inputs);
    }

    /// Computes what passes have been through so far: those before this one, and the collisions of
    /// this one before that.
    pub(crate) fn compute_to(&mut self, number: u32, collision: usize) {
        if !self.replay.on {
            return;
        }
        let contact = self.arguments.contact_iterations;
        let parameters = &self.arguments.solver;
        let replay = &mut self.replay;
        let passes = replay.computed..number;
        let (batch, masses) = (&mut replay.batch, &replay.masses);
        let (shapes, velocities) = (&self.shape_of, &mut self.velocities);
        batch.run(passes, contact, parameters, shapes, masses, velocities);
        if collision > 0 {
            let part = 0..collision;
            batch.run_part(number, part, contact, parameters, shapes, masses, velocities);
        }
        replay.computed = number;
        self.counters.impulse_sum = batch.impulse_sum();
    }

    /// The rest of the step goes the long way, from this collision of this pass on.
    fn end_replay(
        &mut self,
        number: u32,
        collision: usize,
        inputs: &mut [Stream],
        memory: &Memory,
    ) {
        log::debug!("accelerator: pass {number} brings other beats from collision {collision} on");
        let interval = self.interval();
        self.replay.end_even(interval, &mut self.pipeline);
        self.compute_to(number, collision);
        let known = self.replay.known();
        self.impulses.clear();
        self.impulses.resize(self.arguments.collisions as usize, [0.0; CONTACT_POINTS]);
        for (index, impulses) in self.impulses.iter_mut().enumerate().take(known) {
            *impulses = self.replay.batch.impulses(index);
        }
        self.replay.on = false;
        for stream in inputs {
            stream.fetch(stream.len(), memory);
        }
    }

    /// The pass that it is in, if nothing but collisions can be next for it.
    fn flowing(&self) -> Option<(u32, Segment)> {
        match self.phase {
            Phase::Pass { number, segment } if self.replay.on && self.debt == 0 && !self.hung => {
                Some((number, segment))
            }
            _ => None,
        }
    }

    /// Beats of an issue on each stream.
    pub(crate) fn share(&self) -> PerStream {
        self.replay.share()
    }

    /// Whether the collisions flow that are on the streams and about to come: how many issues may, and
    /// how long each of them may take.
    pub(crate) fn flows(
        &mut self,
        inputs: &[Stream],
        coming: impl FnOnce() -> Option<Coming>,
        memory: &Memory,
    ) -> Option<(usize, u64)> {
        let (number, segment) = self.flowing()?;
        let left = self.replay.issues(segment.left());
        let within = |(stream, share): (&Stream, usize)| stream.len() <= left * share;
        if !inputs.iter().zip(self.replay.share()).all(within) {
            return None;
        }
        let coming = coming()?;
        self.look_ahead(number, &segment, inputs, &coming, memory);
        let together = self.replay.together();
        let there = segment.available(inputs) / together * together;
        let known = self.replay.known() - segment.done;
        let same = there <= known
            && self.replay.same(&segment, known, inputs)
            && self.replay.goes_on(&segment, inputs, &coming);
        let stall_max = if self.replay.even { 0 } else { u64::from(self.depth(number).window) };
        let issues = self.replay.issues(known.min(segment.left()));
        same.then_some((issues, self.interval() + together as u64 * stall_max))
    }

    /// Lets collisions flow.
    pub(crate) fn flow(&mut self, pace: &mut Pace, known: &mut Recurrence) {
        let Some((_, segment)) = self.flowing() else { return };
        let (start, done, together) = (self.clock, segment.done, self.replay.together());
        if self.replay.even {
            let last = self.replay.slots();
            pace.run_evenly(last, known, |Slice { cycles, first, issues }| {
                let (first, records) = (done + first * together, issues * together);
                self.replay.enter(start + cycles, first, records);
            });
        } else {
            pace.run(|Slice { cycles, first, issues }| {
                let mut taken = 0;
                for issue in first..first + issues {
                    let now = start + cycles + taken;
                    taken += self.issue_enters(done + issue * together, together, now);
                }
                taken
            });
        }
    }

    /// Collisions have flowed, and the beats with them that are on the streams now.
    pub(crate) fn flowed(&mut self, pace: &Pace, inputs: &mut [Stream]) {
        let Some((number, mut segment)) = self.flowing() else { return };
        self.take(&mut segment, pace.flowed.issues * self.replay.together(), inputs);
        self.phase = Phase::Pass { number, segment };
        self.clock += pace.flowed.cycles;
        self.counters.waits += pace.flowed.waits;
    }
}
