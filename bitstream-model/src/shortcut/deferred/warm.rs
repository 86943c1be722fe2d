//! Passes that bring impulses with their collisions, or none where the first pass brought some.
//!
//! ```text
//! stream 0, 1, 2    the same beats of the same buffers in every pass
//! stream 3          c | c | c | ...             contact points, in most passes
//!                   c L | c L | c L | ...       with impulses behind each, from another buffer
//! ```
//!
//! So the passes of each kind have an origin of their own on that stream. Where the contact points have
//! the same bytes as in the first pass, the collisions are the decoded ones.

use std::sync::atomic::{AtomicUsize, Ordering};

use super::decode_once::{Decoded, Upcoming};
use crate::accelerator::control::Arguments;
use crate::accelerator::records::segment::Segment;
use crate::memory::{Memory, Source};
use crate::shortcut::batch::IMPULSES;
use crate::stream::span::Spans;
use pgs_interface::record::Beat;
use pgs_support::chunks::Chunks;

/// The stream on which impulses come.
pub(super) const STREAM: usize = IMPULSES.0;
/// Beats of a collision on it, with the impulses.
const BEATS: usize = IMPULSES.1 + 1;

/// The impulses that a pass brings beside the collisions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Brings {
    Nothing,
    NormalImpulses,
    FrictionImpulses,
}

impl Brings {
    pub(super) const ALL: usize = 3;

    pub(super) fn of(arguments: &Arguments, pass: u32) -> Self {
        if !arguments.is_warm(pass) {
            Self::Nothing
        } else if pass < arguments.contact_passes() {
            Self::NormalImpulses
        } else {
            Self::FrictionImpulses
        }
    }
}

/// The passes of one kind, as far as their collisions are known.
#[derive(Debug)]
pub(super) struct Kind {
    /// Where their beats on the stream of the impulses are.
    pub(super) origin: Spans,
    /// Collisions that are the decoded ones.
    pub(super) known: usize,
    /// Element `n` is the sum of the words of the impulses of the first `n` collisions.
    sums: Vec<u32>,
}

impl Kind {
    pub(super) fn new() -> Self {
        Self { origin: Spans::with_capacity(64), known: 0, sums: Vec::new() }
    }

    /// A step begins; the passes of this kind bring the impulses of `impulses` collisions.
    pub(super) fn begin_step(&mut self, impulses: Option<usize>) {
        self.origin.clear();
        self.known = 0;
        let sums = impulses.map_or(0, |collisions| collisions + 1);
        if self.sums.len() < sums {
            self.sums.resize(sums, 0);
        }
    }

    /// The sum of the words of the impulses of `records` collisions, of a kind that brings some.
    pub(super) fn sum(&self, first: usize, records: usize) -> u32 {
        self.sums[first + records].wrapping_sub(self.sums[first])
    }
}

impl Decoded {
    /// Takes the impulses of decoded collisions from `first` on, if the pass brings some: `beats` has the
    /// beats of each on the stream of the impulses.
    pub(super) fn take_impulses(&mut self, brings: Brings, first: usize, beats: &[Beat]) {
        let contact = match brings {
            Brings::Nothing => return,
            Brings::NormalImpulses => true,
            Brings::FrictionImpulses => false,
        };
        let pairs = beats.split_arrays::<BEATS>().0;
        let sums = &mut self.kinds[brings as usize].sums[first..];
        let Some((before, sums)) = sums.split_first_mut() else { return };
        let sums = &mut sums[..pairs.len()];
        self.batch.give(contact, first, pairs, sums);
        let mut sum = *before;
        for each in sums {
            sum = sum.wrapping_add(*each);
            *each = sum;
        }
    }

    /// Goes through the beats of a pass of another kind than the first pass, as far as its collisions are
    /// the decoded ones.
    pub(super) fn follow(
        &mut self,
        brings: Brings,
        segment: &Segment,
        upcoming: &Upcoming<'_>,
        memory: &Memory,
    ) {
        let share = self.share(brings)[STREAM];
        while self.known(brings) < self.batch.len() {
            let known = self.known(brings);
            let ahead = (known - segment.done) * share;
            let (count, source) = upcoming.piece(STREAM, ahead, (self.batch.len() - known) * share);
            let mut records = count / share;
            let mut gathered = [Beat::default(); BEATS];
            let mut sources = [None; BEATS];
            let view = if records > 0 {
                sources[0] = source;
                source.and_then(|source| memory.view(source, records * share))
            } else {
                // The beats of the collision lie apart.
                records = 1;
                gather(&mut gathered[..share], &mut sources, upcoming, ahead, memory)
            };
            let Some(view) = view else { return };
            let same = self.same_contacts(known, view, share, memory);
            let step = (records * share).min(if sources[1].is_some() { 1 } else { same * share });
            if same > 0 {
                let origin = &mut self.kinds[brings as usize].origin;
                for (at, source) in (0..).zip(sources.into_iter().flatten()) {
                    origin.push((known * share) as u64 + at, step as u64, source);
                }
                self.take_impulses(brings, known, &view[..same * share]);
                self.kinds[brings as usize].known += same;
            }
            if same < records {
                return;
            }
        }
    }

    /// How many collisions from `first` on have the contact points of the decoded ones: `beats` are
    /// `share` beats of each.
    fn same_contacts(
        &mut self,
        first: usize,
        beats: &[Beat],
        share: usize,
        memory: &Memory,
    ) -> usize {
        let origin = &self.kinds[self.first as usize].origin;
        let of_first = self.share(self.first)[STREAM];
        let records = beats.len() / share;
        let end = (first + records) * of_first;
        let mut same = 0;
        while same < records {
            let (count, source) = origin.piece(((first + same) * of_first) as u64, end as u64);
            let Some(decoded) = source.and_then(|source| memory.view(source, count)) else { break };
            let beats = &beats[same * share..];
            // The first beat of a collision has the contact point.
            let there = (beats.len() / share).min(decoded.len().div_ceil(of_first));
            let differs = AtomicUsize::new(there);
            let parts = (0..there).step_by(COMPARED_TOGETHER);
            self.batch.share(parts, |from| {
                let until = (from + COMPARED_TOGETHER).min(there);
                let (beats, decoded) = (&beats[from * share..], &decoded[from * of_first..]);
                let equal = match (share, of_first) {
                    (1, BEATS) => equal::<1, BEATS>(beats, decoded, until - from),
                    (BEATS, 1) => equal::<BEATS, 1>(beats, decoded, until - from),
                    _ => equal::<BEATS, BEATS>(beats, decoded, until - from),
                };
                if from + equal < until {
                    differs.fetch_min(from + equal, Ordering::Relaxed);
                }
            });
            let equal = differs.into_inner();
            same += equal;
            if equal < there || there == 0 {
                break;
            }
        }
        same
    }
}

/// Collisions that a thread compares at once.
const COMPARED_TOGETHER: usize = 2048;

/// How many of the first `count` collisions have the same first beat, of `A` and of `B` beats each.
fn equal<const A: usize, const B: usize>(a: &[Beat], b: &[Beat], count: usize) -> usize {
    let first = |at: usize| a.get(at * A).zip(b.get(at * B));
    let same = |at: usize| first(at).is_some_and(|(a, b)| a == b);
    // Most often all are; without a branch for each the compiler vectorises it.
    if (0..count).fold(true, |all, at| all & same(at)) {
        return count;
    }
    (0..count).take_while(|at| same(*at)).count()
}

/// Gathers beats of one collision, each from where it lies.
fn gather<'a>(
    gathered: &'a mut [Beat],
    sources: &mut [Option<Source>; BEATS],
    upcoming: &Upcoming<'_>,
    ahead: usize,
    memory: &Memory,
) -> Option<&'a [Beat]> {
    for (at, (beat, from)) in gathered.iter_mut().zip(sources).enumerate() {
        let (_, source) = upcoming.piece(STREAM, ahead + at, 1);
        *beat = *memory.view(source?, 1)?.first()?;
        *from = source;
    }
    Some(gathered)
}
