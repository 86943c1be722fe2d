//! Takes the collisions of a step from their buffers once, and tells whether other passes bring the
//! same ones.
//!
//! Two passes bring the same bytes if the beats come from the same place of the same hand-over of a
//! buffer: the device owns it, and no one else writes to it.

use super::eligible::{BEATS_MAX, Layout};
use crate::accelerator::control::{Arguments, Shape};
use crate::accelerator::records::segment::{PacketError, Segment};
use crate::accelerator::records::striping::{PerStream, STREAMS_MAX};
use crate::accelerator::solver::Mass;
use crate::config::BoardConfig;
use crate::memory::{Memory, Source};
use crate::shortcut::batch::{Batch, Translation};
use crate::stream::Stream;
use crate::stream::span::Spans;
use pgs_interface::record::Beat;

/// Beats that are about to come to a stream: where from, and how many.
pub(crate) type Coming = [Option<(Source, usize)>; STREAMS_MAX];

/// The collisions of a step, decoded as far as they are known.
#[derive(Debug)]
pub(super) struct Decoded {
    pub(super) layout: Layout,
    /// Converts records into the format of the batch; `None` if they come in it.
    translation: Option<Translation>,
    pub(super) batch: Batch,
    /// Mass properties of each shape.
    pub(super) masses: Vec<Mass>,
    /// Where the beats of the decoded collisions are, stream by stream.
    origin: [Spans; STREAMS_MAX],
    /// Element `n` is the sum of all words of the first `n` collisions.
    sums: Vec<u32>,
    /// Why the decoder refused the collision after the last decoded one.
    refused: Option<PacketError>,
}

impl Decoded {
    pub(super) fn new(config: &BoardConfig, layout: Layout) -> Self {
        let batch = Batch::new(config.threads, config.lanes);
        Self {
            layout,
            translation: (!layout.in_place).then(|| Translation::new(layout)),
            batch: batch.of(layout.precision, layout.together).with_inertia(layout.inertia),
            masses: Vec::new(),
            origin: std::array::from_fn(|_| Spans::with_capacity(64)),
            sums: vec![0],
            refused: None,
        }
    }

    /// A step begins.
    pub(super) fn begin_step(&mut self, arguments: &Arguments, shapes: &[Shape]) {
        let collisions = arguments.collisions as usize;
        self.batch.begin(collisions, arguments.solver.pair_friction);
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

    /// Beats of an issue on each stream.
    pub(super) fn share(&self) -> PerStream {
        self.layout.share
    }

    /// Collisions that enter together.
    pub(super) fn together(&self) -> usize {
        self.layout.together
    }

    /// The number of issues that `collisions` fill, the last one with padding.
    pub(super) fn issues(&self, collisions: usize) -> usize {
        collisions.div_ceil(self.together())
    }

    /// The streams of the design, and the beats of an issue on each.
    fn shares(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        self.share().into_iter().enumerate().filter(|(_, share)| *share > 0)
    }

    /// The least number of issues between two decoded collisions that share a body that moves.
    pub(super) fn distance(&self) -> usize {
        self.batch.distance() as usize
    }

    /// Collisions that are decoded.
    pub(super) fn known(&self) -> usize {
        self.batch.len()
    }

    /// Why the decoder refused the collision after the last decoded one, if it did.
    pub(super) fn refused(&self) -> Option<PacketError> {
        self.refused
    }

    /// Decodes the collisions on the streams and the ones about to come behind them. The segment
    /// says which collisions of the first pass are next.
    pub(super) fn decode_ahead(
        &mut self,
        segment: &Segment,
        inputs: &[Stream],
        coming: &Coming,
        shape_of: &[u8],
        memory: &Memory,
    ) {
        let total = segment.done + segment.left();
        // Where the beats `ahead` places behind the front of a stream are, and how many together.
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
            // All decoded issues are whole ones.
            let known = self.known();
            let first = self.issues(known);
            let share_of = self.share();
            let ahead = |k: usize| (first - self.issues(segment.done)) * share_of[k];
            let mut issues = self.issues(total) - first;
            for (k, share) in self.shares() {
                issues = issues.min(piece(k, ahead(k), issues * share).0 / share);
            }
            // An issue whose beats are not together is gathered.
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

    /// The sum of all words of `records` collisions. The first one begins an issue.
    pub(super) fn sum(&self, first: usize, records: usize) -> u32 {
        self.sums[first + records].wrapping_sub(self.sums[first])
    }

    /// Whether the next `records` collisions on the streams are the decoded ones, as far as their
    /// beats have come: more may have come on one stream than on another.
    pub(super) fn same(&self, segment: &Segment, records: usize, inputs: &[Stream]) -> bool {
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

    /// Whether the beats about to come to the streams go on with the decoded collisions, as far as
    /// they belong to the segment.
    pub(super) fn goes_on(&self, segment: &Segment, inputs: &[Stream], coming: &Coming) -> bool {
        self.shares().all(|(k, share)| {
            let Some((source, count)) = coming[k] else { return false };
            let next = self.issues(segment.done) * share + inputs[k].len();
            let all = self.issues(segment.done + segment.left());
            let left = (all * share).saturating_sub(next);
            self.origin[k].holds(next as u64, count.min(left), source)
        })
    }
}
