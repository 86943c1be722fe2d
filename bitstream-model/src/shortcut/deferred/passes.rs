//! Goes through passes whose collisions are decoded: when each collision enters.

use super::Deferred;
use super::decode_once::{Coming, Upcoming};
use super::warm::Brings;
use crate::accelerator::Accelerator;
use crate::accelerator::defer::ArrivedRecords;
use crate::accelerator::records::segment::{PacketError, Segment};
use crate::accelerator::records::striping::PerStream;
use crate::memory::Memory;
use crate::stream::Stream;
use pgs_interface::record::CONTACT_POINTS;

/// Collisions of a pass that have arrived or are about to come, all of them decoded.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ahead {
    /// Issues of them.
    pub(crate) issues: usize,
    /// Cycles from one issue to the next, at most.
    pub(crate) interval_max: u64,
    /// Beats of an issue on each stream.
    pub(crate) share: PerStream,
    /// If no issue waits for its bodies: how many issues before the end must be gone through.
    pub(crate) last: Option<usize>,
}

impl Deferred {
    /// Takes collisions that have arrived, for up to `limit` cycles, if they are the decoded ones.
    pub(super) fn take_collisions(
        &mut self,
        accelerator: &mut Accelerator,
        pass: u32,
        segment: &mut Segment,
        limit: u64,
        ArrivedRecords { records: arrived, inputs, memory }: ArrivedRecords<'_>,
        outputs: &mut [Stream],
    ) -> Result<Option<u64>, PacketError> {
        let brings = Brings::of(&accelerator.arguments, pass);
        let upcoming = Upcoming { inputs, coming: &Coming::default() };
        self.decode_ahead(accelerator, pass, segment, &upcoming, memory);
        let decoded = &self.decoded;
        let (together, interval) = (decoded.together(), self.entered.interval());
        let known = arrived.min(decoded.known(brings) - segment.done);
        let refused = decoded.refused().filter(|_| known < arrived);
        let same = decoded.same(brings, segment, known, inputs);
        if !same
            || known < arrived && refused.is_none()
            || !self.impulses_are_there(accelerator, pass)
        {
            self.give_up(accelerator, pass, segment.done, inputs, memory);
            return Ok(None);
        }
        let decoded = &self.decoded;
        let (mut cycles, mut records) = (0, 0);
        if self.entered.even() {
            let fit = usize::try_from(limit / interval).unwrap_or(usize::MAX);
            records = known.min(fit.saturating_add(1).saturating_mul(together));
            cycles = decoded.issues(records) as u64 * interval;
            self.entered.enter(accelerator.clock, segment.done, records);
        } else {
            while records < known && cycles <= limit {
                let issue = (known - records).min(together);
                let now = accelerator.clock + cycles;
                cycles += self.issue_enters(accelerator, segment.done + records, issue, now);
                records += issue;
            }
        }
        // In the middle of an issue that has entered, or before one that does.
        let enters = records % together != 0 || cycles <= limit;
        if let Some(error) = refused.filter(|_| records == known && enters) {
            self.compute_to(accelerator, pass, segment.done + records);
            self.active = false;
            return Err(error);
        }
        if accelerator.arguments.sends_impulses(pass) {
            self.send_impulses(accelerator, pass, segment.done, records, outputs);
        }
        self.take_beats(accelerator, brings, segment, records, inputs);
        Ok(Some(cycles))
    }

    /// Decodes the collisions on the streams and about to come, in the first pass; later passes
    /// bring the same ones.
    fn decode_ahead(
        &mut self,
        accelerator: &mut Accelerator,
        pass: u32,
        segment: &Segment,
        upcoming: &Upcoming<'_>,
        memory: &Memory,
    ) {
        let Self { decoded, entered, .. } = self;
        let brings = Brings::of(&accelerator.arguments, pass);
        if pass == 0 {
            let bodies = (&accelerator.shape_of[..], &accelerator.inverse_masses[..]);
            decoded.decode_ahead(segment, upcoming, bodies, memory);
            let pipeline = &mut accelerator.pipeline;
            entered.distance_is(decoded.distance(), &decoded.batch, pipeline);
        } else if brings != decoded.first {
            decoded.follow(brings, segment, upcoming, memory);
        }
    }

    /// A collision enters at that clock, or as soon as it can; returns the cycles until then.
    #[inline]
    fn collision_enters(&self, accelerator: &mut Accelerator, index: usize, now: u64) -> u64 {
        let Some(entry) = self.decoded.batch.entry(index) else { return 0 };
        let stall = accelerator.pipeline.wait(now, &entry);
        accelerator.pipeline.entered(now + stall, &entry);
        accelerator.counters.stalls += stall;
        accelerator.counters.hazards += u64::from(stall > 0);
        stall
    }

    /// The collisions of an issue enter at that clock, or as soon as they can; returns the cycles
    /// until the next issue.
    #[inline]
    fn issue_enters(
        &self,
        accelerator: &mut Accelerator,
        first: usize,
        collisions: usize,
        now: u64,
    ) -> u64 {
        let mut stalls = 0;
        for index in first..first + collisions {
            stalls += self.collision_enters(accelerator, index, now + stalls);
        }
        stalls + self.entered.interval()
    }

    /// Takes the beats of collisions that have entered.
    fn take_beats(
        &self,
        accelerator: &mut Accelerator,
        brings: Brings,
        segment: &mut Segment,
        records: usize,
        inputs: &mut [Stream],
    ) {
        accelerator.received(self.decoded.sum(brings, segment.done, records));
        segment.skip(records, inputs);
    }

    /// Leaves the rest of the step to the accelerator, from collision `next` of `pass` on.
    fn give_up(
        &mut self,
        accelerator: &mut Accelerator,
        pass: u32,
        next: usize,
        inputs: &mut [Stream],
        memory: &Memory,
    ) {
        log::debug!("accelerator: pass {pass} brings other beats from collision {next} on");
        self.entered.end_even(&self.decoded.batch, &mut accelerator.pipeline);
        self.compute_to(accelerator, pass, next);
        let known = self.decoded.batch.len();
        let impulses = &mut accelerator.impulses;
        impulses.clear();
        impulses.resize(accelerator.arguments.collisions as usize, [0.0; CONTACT_POINTS]);
        for (index, impulses) in impulses.iter_mut().enumerate().take(known) {
            *impulses = self.decoded.batch.impulses(index);
        }
        self.active = false;
        for stream in inputs {
            stream.fetch(stream.len(), memory);
        }
    }

    /// The collisions of a pass that flow undisturbed: on the streams, and about to come to them.
    pub(crate) fn collisions_ahead(
        &mut self,
        accelerator: &mut Accelerator,
        pass: u32,
        segment: &Segment,
        inputs: &[Stream],
        coming: &Coming,
        memory: &Memory,
    ) -> Option<Ahead> {
        let brings = Brings::of(&accelerator.arguments, pass);
        let (left, share) = (self.decoded.issues(segment.left()), self.decoded.share(brings));
        let within = |(stream, share): (&Stream, usize)| stream.len() <= left * share;
        if !inputs.iter().zip(share).all(within) {
            return None;
        }
        self.decode_ahead(accelerator, pass, segment, &Upcoming { inputs, coming }, memory);
        let decoded = &self.decoded;
        let together = decoded.together();
        let there = segment.available(inputs) / together * together;
        let known = decoded.known(brings) - segment.done;
        let same = there <= known
            && decoded.same(brings, segment, known, inputs)
            && decoded.goes_on(brings, segment, inputs, coming)
            && self.impulses_are_there(accelerator, pass);
        let decoded = &self.decoded;
        let (even, interval) = (self.entered.even(), self.entered.interval());
        let stall_max = if even { 0 } else { u64::from(accelerator.depth(pass).window) };
        same.then_some(Ahead {
            issues: decoded.issues(known.min(segment.left())),
            interval_max: interval + together as u64 * stall_max,
            share,
            last: even.then(|| self.entered.slots()),
        })
    }

    /// Whole issues enter from that clock on. The first one is number `first` behind collision `done`.
    /// Returns the cycles that they take.
    pub(crate) fn issues_enter(
        &mut self,
        accelerator: &mut Accelerator,
        done: usize,
        (first, issues): (usize, usize),
        clock: u64,
    ) -> u64 {
        let together = self.decoded.together();
        if self.entered.even() {
            self.entered.enter(clock, done + first * together, issues * together);
            return issues as u64 * self.entered.interval();
        }
        let mut cycles = 0;
        for issue in first..first + issues {
            let collision = done + issue * together;
            cycles += self.issue_enters(accelerator, collision, together, clock + cycles);
        }
        cycles
    }

    /// Whole issues have entered, whose beats are on the streams.
    pub(crate) fn pass_over_issues(
        &self,
        accelerator: &mut Accelerator,
        pass: u32,
        segment: &mut Segment,
        issues: usize,
        inputs: &mut [Stream],
    ) {
        let brings = Brings::of(&accelerator.arguments, pass);
        self.take_beats(accelerator, brings, segment, issues * self.decoded.together(), inputs);
    }
}
