//! The clock cycles of a step without its beats: a segment takes as long as the larger of its work
//! and its transfer.
//!
//! While a pass empties its issue queue and drains its pipeline, and while it works longer than its
//! transfer takes, the next segment's beats fill the FIFOs. The same collisions come in every pass
//! of a kind, so stalls are counted once for each kind.

use crate::accelerator::hazards::{Entry, Pipeline};
use crate::accelerator::records::striping::PerStream;
use crate::arbiter::Arbiter;

/// Beats of a segment on the streams, and the cycles of its work.
#[derive(Debug, Clone, Copy)]
pub(super) struct Part {
    pub(super) reads: PerStream,
    pub(super) writes: PerStream,
    /// Cycles in which its records are taken, stalls included.
    pub(super) work: u64,
    /// Cycles behind them in which nothing is taken: an issue queue empties, a pipeline drains.
    pub(super) fill: u64,
}

/// The streams of a board.
#[derive(Debug, Clone, Copy)]
pub(super) struct Streams {
    pub(super) arbiter: Arbiter,
    pub(super) depth: usize,
    /// Clocks of a beat on each, in and out.
    pub(super) clocks: [PerStream; 2],
}

impl Streams {
    fn transfer(&self, reads: &PerStream, writes: &PerStream) -> u64 {
        let of = |beats: &PerStream, clocks: &PerStream| {
            beats.iter().zip(clocks).map(|(beats, clocks)| beats * clocks).max().unwrap_or(0)
        };
        let all: usize = reads.iter().chain(writes).sum();
        let busiest = of(reads, &self.clocks[0]).max(of(writes, &self.clocks[1]));
        self.arbiter.cycles(all).max(busiest as u64)
    }

    /// The part of the reads' transfer that the FIFOs take ahead.
    fn ahead(&self, reads: &PerStream) -> u64 {
        let transfer = self.transfer(reads, &PerStream::default());
        let of = |beats: &usize| transfer * (*beats).min(self.depth) as u64 / *beats as u64;
        reads.iter().filter(|beats| **beats > 0).map(of).min().unwrap_or(0)
    }
}

/// The cycles of a step's rest.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Course {
    /// To the accelerator's end.
    pub(super) cycles: u64,
    pub(super) waits: u64,
    /// To the last beat in memory.
    pub(super) last_beat: u64,
}

/// The course of the parts of a step, after `moved` beats of its input on each stream. The streams
/// are `early` cycles ahead of the accelerator.
pub(super) fn course(
    parts: &[Part],
    mut early: u64,
    mut moved: PerStream,
    streams: &Streams,
) -> Course {
    let (mut course, none) = (Course::default(), PerStream::default());
    for (at, Part { reads, writes, work, fill }) in parts.iter().enumerate() {
        let mut left = *reads;
        for (left, moved) in left.iter_mut().zip(&mut moved) {
            let there = (*left).min(*moved);
            (*left, *moved) = (*left - there, *moved - there);
        }
        let all = streams.transfer(&left, writes);
        // Beyond what the FIFOs hold, the arbiter saves some bandwidth up.
        let held = early.min(streams.ahead(&left));
        let ahead = (held + (early - held).min(streams.arbiter.saved_cycles())).min(all);
        let mut transfer = all - ahead;
        course.last_beat = course.cycles + transfer;
        if at + 1 == parts.len() {
            // The accelerator ends when the last results are in the FIFOs: behind the reads, with
            // which the results share the bandwidth, and behind the results that found no room.
            let held = writes.map(|beats| beats.min(streams.depth));
            let sent: PerStream = std::array::from_fn(|k| writes[k] - held[k]);
            let shared = 2 * streams.arbiter.cycles(left.iter().sum()).saturating_sub(ahead);
            let reads = streams.transfer(&left, &none).saturating_sub(ahead).max(shared);
            transfer = streams.transfer(&left, &sent).saturating_sub(ahead).max(reads);
        }
        let taken = transfer.max(*work);
        course.last_beat = course.last_beat.max(course.cycles + taken);
        course.waits += taken - work;
        course.cycles += taken + fill;
        early = work.saturating_sub(transfer) + fill;
    }
    course
}

/// Stalls of a pass, and the collisions that stall.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Stalls {
    pub(super) cycles: u64,
    pub(super) collisions: u64,
}

/// Counts the stalls of a pass whose collisions enter without waiting for beats. Padding has no
/// entry.
pub(super) fn stalls(
    pipeline: &mut Pipeline,
    bodies: usize,
    (window, together): (u64, usize),
    issue_at: impl Fn(u64) -> u64,
    entries: &[Option<Entry>],
) -> Stalls {
    pipeline.start_step(bodies);
    pipeline.start_pass(window);
    let mut stalls = Stalls::default();
    for (number, issue) in (0..).zip(entries.chunks(together)) {
        let mut now = issue_at(number) + stalls.cycles;
        for entry in issue.iter().flatten() {
            let stall = pipeline.wait(now, entry);
            now += stall;
            pipeline.entered(now, entry);
            stalls.cycles += stall;
            stalls.collisions += u64::from(stall > 0);
        }
    }
    stalls
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{Bandwidth, BoardConfig};

    fn streams(bandwidth: Bandwidth) -> Streams {
        let config = BoardConfig { bandwidth, ..BoardConfig::default() };
        Streams { arbiter: Arbiter::new(&config, 4), depth: 512, clocks: [[1; 4]; 2] }
    }

    fn part(beats: usize, work: u64) -> Part {
        Part { reads: [beats; 4], writes: [0; 4], work, fill: 100 }
    }

    #[test]
    fn a_part_takes_the_larger_of_work_and_transfer_and_fills_come_on_top() {
        let parts = [part(10_000, 20_000), part(0, 0)];
        let found = course(&parts, 0, [0; 4], &streams(Bandwidth::Unlimited));
        assert_eq!(found, Course { cycles: 20_200, waits: 0, last_beat: 20_100 });
        // A beat a cycle in all, of 16 bytes at 275 MHz.
        let one = streams(Bandwidth::BytesPerSecond(16 * 275_000_000));
        let found = course(&parts, 0, [0; 4], &one);
        assert_eq!(found, Course { cycles: 40_200, waits: 20_000, last_beat: 40_100 });
        // Moved beats need no time.
        let found = course(&parts, 0, [2_500; 4], &one);
        assert_eq!((found.cycles, found.waits), (30_200, 10_000));
    }

    #[test]
    fn the_next_beats_come_while_the_pipeline_drains_as_far_as_the_fifos_hold_them() {
        let one = streams(Bandwidth::BytesPerSecond(16 * 275_000_000));
        // The second part's transfer has the 100 cycles of the fill in front.
        let found = course(&[part(1_000, 0), part(1_000, 0), part(0, 0)], 0, [0; 4], &one);
        assert_eq!(found.waits, 4_000 + 3_900);
        // FIFOs of 512 beats of 1,000 hold 2,048 of the transfer's 4,000 cycles, and 128 more are
        // saved up: a burst of 16 beats for each engine.
        let found = course(&[part(1_000, 50_000), part(1_000, 0), part(0, 0)], 0, [0; 4], &one);
        assert_eq!(found.waits, 4_000 - 2_048 - 128);
    }

    #[test]
    fn stalls_are_those_of_collisions_that_follow_each_other_at_once() {
        let config = BoardConfig::default();
        let mut pipeline = Pipeline::new(config.hazards, 2, 1);
        let entry = |bodies| Some(Entry { bodies, moving: [true; 2] });
        let entries = [entry([0, 1]), None, entry([1, 2]), entry([0, 3])];
        let found = stalls(&mut pipeline, 4, (10, 1), |issue| 2 * issue, &entries);
        // The third may enter 10 cycles after the first; the fourth then finds body 0 written.
        assert_eq!(found, Stalls { cycles: 6, collisions: 1 });
    }
}
