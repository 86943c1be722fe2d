//! This file takes the collisions of a step from their buffers once, and replays them in the other
//! passes, as long as these bring the same bytes.
//!
//! What a pass takes and how long is accounted for beat by beat as ever; what it computes is left for
//! later, until somebody can see it, and then done for many passes at once. The bytes are the same
//! where they come from the same place of the same hand-over of a buffer: the device owns it, and
//! nobody writes to it. Where a stream brings anything else, the rest of the step goes the long way.

use super::eligible::{BEATS_MAX, Layout};
use crate::accelerator::control::Shape;
use crate::accelerator::hazards::{Entry, Pipeline};
use crate::accelerator::records::segment::{PacketError, Segment};
use crate::accelerator::records::striping::{PerStream, STREAMS_MAX, Turns};
use crate::accelerator::solver::Mass;
use crate::config::BoardConfig;
use crate::memory::{Memory, Source};
use crate::shortcut::batch::{Batch, Translation};
use crate::stream::Stream;
use crate::stream::span::Spans;
use pgs_interface::record::Beat;

/// Issue slots of a hazard window that are kept in mind.
const SLOTS_MAX: usize = 512;

/// Beats that are about to come to a stream: where from, and how many.
pub(crate) type Coming = [Option<(Source, usize)>; STREAMS_MAX];

/// Collisions that entered, an issue an interval.
#[derive(Debug, Clone, Copy, Default)]
struct Entered {
    clock: u64,
    first: usize,
    records: usize,
}

/// The collisions of a step.
#[derive(Debug)]
pub(crate) struct Replay {
    /// How collisions lie on the streams, if the design is one of those that it knows.
    layout: Option<Layout>,
    /// What makes of them what the batch takes in, unless it takes them as they are.
    translation: Option<Translation>,
    /// Whether the step has brought nothing so far that it cannot replay.
    pub(crate) on: bool,
    pub(crate) batch: Batch,
    /// Passes that were computed.
    pub(crate) computed: u32,
    /// Mass properties of each shape.
    pub(crate) masses: Vec<Mass>,
    /// Where the beats of the decoded collisions are, stream by stream.
    origin: [Spans; STREAMS_MAX],
    /// The sum of all words of none of them, of the first one, of the first two...
    sums: Vec<u32>,
    /// What the decoder said to the collision behind the last one decoded.
    pub(crate) refused: Option<PacketError>,
    /// Issue slots from a collision to the first that sees its write-back.
    slots: usize,
    /// Whether each collision entered as soon as it had come, up to now in this pass.
    pub(crate) even: bool,
    /// The last collisions that entered so.
    entered: Box<[Entered]>,
    next_entered: usize,
}

impl Replay {
    pub(crate) fn new(config: &BoardConfig) -> Self {
        let layout = if config.replay { Layout::of(config) } else { None };
        let translated = layout.filter(|layout| !layout.in_place);
        let threads = if layout.is_some() { config.threads } else { 1 };
        let mut batch = Batch::new(threads, config.lanes);
        if let Some(Layout { precision, together, .. }) = layout {
            batch = batch.of(precision, together);
        }
        Self {
            layout,
            translation: translated.map(Translation::new),
            on: layout.is_some(),
            batch,
            computed: 0,
            masses: Vec::new(),
            origin: std::array::from_fn(|_| Spans::with_capacity(64)),
            sums: vec![0],
            refused: None,
            slots: 0,
            even: true,
            entered: vec![Entered::default(); SLOTS_MAX].into(),
            next_entered: 0,
        }
    }

    /// A step begins.
    pub(crate) fn begin(&mut self, collisions: usize, shapes: &[Shape]) {
        self.on = self.layout.is_some();
        if !self.on {
            return;
        }
        self.batch.begin(collisions);
        self.computed = 0;
        self.masses.clear();
        self.masses.extend(shapes.iter().map(|shape| Mass {
            inverse_mass: shape.inverse_mass,
            inverse_inertia: [shape.inverse_inertia, 0.0, 0.0, 0.0, 0.0, 0.0],
        }));
        self.origin.iter_mut().for_each(Spans::clear);
        if self.sums.len() <= collisions {
            self.sums.resize(collisions + 1, 0);
        }
        self.refused = None;
    }

    /// How bodies lie on the streams, if they can be taken from their buffers and put into them.
    pub(crate) fn bodies(&self) -> Option<Turns> {
        self.layout.filter(|_| self.on)?.bodies
    }

    /// Beats of an issue on each stream; none if the design cannot be replayed.
    pub(crate) fn share(&self) -> PerStream {
        self.layout.map_or([0; STREAMS_MAX], |layout| layout.share)
    }

    /// Collisions that enter together.
    pub(crate) fn together(&self) -> usize {
        self.layout.map_or(1, |layout| layout.together)
    }

    /// Issues of so many collisions, the last one with padding.
    pub(crate) fn issues(&self, collisions: usize) -> usize {
        collisions.div_ceil(self.together())
    }

    /// The streams of the design, and the beats of an issue on each.
    fn shares(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        self.share().into_iter().enumerate().filter(|(_, share)| *share > 0)
    }

    /// A pass begins, with a hazard window of so many issue slots.
    pub(crate) fn begin_pass(&mut self, slots: u64) {
        self.slots = usize::try_from(slots).unwrap_or(usize::MAX);
        self.entered.fill(Entered::default());
        self.next_entered = 0;
        self.even = self.slots <= SLOTS_MAX && self.far_enough();
    }

    /// Whether no decoded collision is so close behind another that it may have to wait for it.
    fn far_enough(&self) -> bool {
        self.batch.distance() as usize >= self.slots
    }

    /// Collisions of which everything is known.
    pub(crate) fn known(&self) -> usize {
        self.batch.len()
    }

    /// Issue slots that collisions have to be apart.
    pub(crate) fn slots(&self) -> usize {
        self.slots
    }

    /// Decodes what is on the streams and what is about to come behind that. The segment says which
    /// collisions of the first pass are next.
    pub(crate) fn look_ahead(
        &mut self,
        segment: &Segment,
        inputs: &[Stream],
        coming: &Coming,
        shape_of: &[u8],
        memory: &Memory,
    ) {
        let total = segment.done + segment.left();
        // Where beats are, by their number behind the front of their stream.
        let piece = |k: usize, ahead: usize, most: usize| {
            let there = inputs[k].len();
            match coming[k] {
                _ if ahead < there => inputs[k].piece(ahead, most),
                Some((source, count)) => {
                    let at = ahead - there;
                    (count.saturating_sub(at).min(most), Some(source.further(at as u64)))
                }
                None => (0, None),
            }
        };
        while self.refused.is_none() && self.known() < total {
            // All issues that are known are whole ones.
            let known = self.known();
            let first = self.issues(known);
            let share_of = self.share();
            let ahead = |k: usize| (first - self.issues(segment.done)) * share_of[k];
            let mut issues = self.issues(total) - first;
            for (k, share) in self.shares() {
                issues = issues.min(piece(k, ahead(k), issues * share).0 / share);
            }
            // Where the beats of an issue are not together it is gathered.
            let apart = issues == 0;
            let issues = issues.max(1);
            let mut gathered = [[Beat::default(); BEATS_MAX]; STREAMS_MAX];
            let mut streams: [&[Beat]; STREAMS_MAX] = [&[]; STREAMS_MAX];
            let mut sources = [[None; BEATS_MAX]; STREAMS_MAX];
            let step = |share: usize| if apart { 1 } else { issues * share };
            for (k, share) in self.shares() {
                for at in (0..issues * share).step_by(step(share)) {
                    let (count, source) = piece(k, ahead(k) + at, step(share));
                    let view = source.and_then(|source| memory.view(source, count));
                    let Some(view) = view.filter(|view| view.len() == step(share)) else { return };
                    if apart {
                        gathered[k][at] = view[0];
                    } else {
                        streams[k] = view;
                    }
                    sources[k][at] = source;
                }
            }
            for (k, share) in self.shares() {
                let first = (first * share) as u64;
                for (at, source) in (0..).zip(sources[k].into_iter().flatten()) {
                    self.origin[k].push(first + at, step(share) as u64, source);
                }
                if apart {
                    streams[k] = &gathered[k][..share];
                }
            }
            let records = (issues * self.together()).min(total - known);
            let [before, sums @ ..] = &mut self.sums[known..=known + records] else { return };
            let (shapes, masses) = (shape_of, &self.masses);
            let decoded = match &mut self.translation {
                Some(translation) => {
                    translation.decode(&mut self.batch, streams, records, shapes, masses, sums)
                }
                None => self.batch.decode(streams, records, shapes, masses, sums),
            };
            self.refused = decoded.err();
            let mut sum = *before;
            for each in &mut sums[..self.batch.len() - known] {
                sum = sum.wrapping_add(*each);
                *each = sum;
            }
        }
    }

    /// The sum of all words of some collisions, of which the first begins an issue.
    pub(crate) fn sum(&self, first: usize, records: usize) -> u32 {
        self.sums[first + records].wrapping_sub(self.sums[first])
    }

    /// Whether the next `records` collisions on the streams are the decoded ones, as far as they have
    /// come: on some streams there may be more of them than on others.
    pub(crate) fn same(&self, segment: &Segment, records: usize, inputs: &[Stream]) -> bool {
        self.shares().all(|(k, share)| {
            let first = (self.issues(segment.done) * share) as u64;
            let most = (self.issues(records) * share).min(inputs[k].len());
            let mut at = 0;
            while at < most {
                let (count, source) = inputs[k].piece(at, most - at);
                let same = |from| self.origin[k].holds(first + at as u64, count, from);
                if count == 0 || !source.is_some_and(same) {
                    return false;
                }
                at += count;
            }
            true
        })
    }

    /// Whether what is about to come to the streams goes on with the decoded collisions, as far as it
    /// belongs to the segment.
    pub(crate) fn goes_on(&self, segment: &Segment, inputs: &[Stream], coming: &Coming) -> bool {
        self.shares().all(|(k, share)| {
            let Some((source, count)) = coming[k] else { return false };
            let next = self.issues(segment.done) * share + inputs[k].len();
            let all = self.issues(segment.done + segment.left());
            let left = (all * share).saturating_sub(next);
            self.origin[k].holds(next as u64, count.min(left), source)
        })
    }

    /// Collisions enter, an issue an interval from that clock on; the first one begins an issue.
    pub(crate) fn enter(&mut self, clock: u64, first: usize, records: usize) {
        self.entered[self.next_entered] = Entered { clock, first, records };
        self.next_entered = (self.next_entered + 1) % SLOTS_MAX;
    }

    /// From now on collisions may have to wait for those that have entered.
    pub(crate) fn end_even(&mut self, interval: u64, pipeline: &mut Pipeline) {
        if !std::mem::replace(&mut self.even, false) {
            return;
        }
        let together = self.together();
        let (newer, older) = self.entered.split_at(self.next_entered);
        for Entered { clock, first, records } in older.iter().chain(newer) {
            for (at, index) in (*first..first + records).enumerate() {
                if let Some(entry) = self.batch.entry(index) {
                    pipeline.entered(clock + (at / together) as u64 * interval, &entry);
                }
            }
        }
    }

    /// Looks again whether a collision may have to wait.
    pub(crate) fn look_at_distances(&mut self, interval: u64, pipeline: &mut Pipeline) {
        if self.even && !self.far_enough() {
            self.end_even(interval, pipeline);
        }
    }

    pub(crate) fn entry(&self, index: usize) -> Option<Entry> {
        self.batch.entry(index)
    }
}
