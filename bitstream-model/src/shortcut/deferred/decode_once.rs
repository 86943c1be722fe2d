//! Takes the collisions of a step from their buffers once, and tells whether other passes bring the
//! same ones.
//!
//! Two passes bring the same bytes if the beats come from the same place of the same hand-over of a
//! buffer: the device owns it, and no one else writes to it.

use super::eligible::{BEATS_MAX, Layout};
use super::warm::{self, Brings, Kind};
use crate::accelerator::control::{Arguments, Shape};
use crate::accelerator::records::segment::{PacketError, Segment};
use crate::accelerator::records::striping::{PerStream, STREAMS_MAX};
use crate::accelerator::solver::Mass;
use crate::config::BoardConfig;
use crate::memory::{Memory, Source};
use crate::shortcut::batch::{Batch, Properties, Translation};
use crate::stream::Stream;
use crate::stream::span::Spans;
use pgs_interface::record::Beat;

/// Beats that are about to come to a stream: where from, and how many.
pub(crate) type Coming = [Option<(Source, usize)>; STREAMS_MAX];

/// The beats on the streams, and the ones about to come behind them.
#[derive(Debug)]
pub(super) struct Upcoming<'a> {
    pub(super) inputs: &'a [Stream],
    pub(super) coming: &'a Coming,
}

impl Upcoming<'_> {
    /// Where the beats `ahead` places behind the front of a stream are, and how many together.
    pub(super) fn piece(&self, k: usize, ahead: usize, most: usize) -> (usize, Option<Source>) {
        let there = self.inputs[k].len();
        match self.coming[k] {
            _ if ahead < there => self.inputs[k].piece(ahead, most),
            Some((source, count)) => {
                let at = ahead - there;
                (count.saturating_sub(at).min(most), Some(source.further(at as u64)))
            }
            None => (0, None),
        }
    }
}

/// The collisions of a step, decoded as far as they are known.
#[derive(Debug)]
pub(super) struct Decoded {
    pub(super) layout: Layout,
    /// Converts records into the format of the batch; `None` if they come in it.
    translation: Option<Translation>,
    pub(super) batch: Batch,
    /// Mass properties of each shape.
    pub(super) masses: Vec<Mass>,
    /// Whether each body has a shape of the table: without streamed masses.
    pub(super) needs_shapes: bool,
    /// Where the beats of the decoded collisions are, stream by stream. [`Kind`] says it for the
    /// stream on which impulses come.
    origin: [Spans; STREAMS_MAX],
    /// Whether the first pass brings impulses, and which.
    pub(super) first: Brings,
    /// The passes by the impulses that they bring.
    pub(super) kinds: [Kind; Brings::ALL],
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
            needs_shapes: true,
            origin: std::array::from_fn(|_| Spans::with_capacity(64)),
            first: Brings::Nothing,
            kinds: std::array::from_fn(|_| Kind::new()),
            sums: vec![0],
            refused: None,
        }
    }

    /// A step begins.
    pub(super) fn begin_step(&mut self, arguments: &Arguments, shapes: &[Shape]) {
        let collisions = arguments.collisions as usize;
        self.batch.begin(collisions, arguments.solver.pair_friction);
        self.needs_shapes = !arguments.streamed_masses;
        self.masses.clear();
        self.masses.extend(shapes.iter().map(|shape| Mass {
            inverse_mass: shape.inverse_mass,
            inverse_inertia: [shape.inverse_inertia, 0.0, 0.0, 0.0, 0.0, 0.0],
        }));
        self.origin.iter_mut().for_each(Spans::clear);
        self.first = Brings::of(arguments, 0);
        let impulses = arguments.warm_start.then_some(collisions);
        let [nothing, warm @ ..] = &mut self.kinds;
        nothing.begin_step(None);
        warm.iter_mut().for_each(|kind| kind.begin_step(impulses));
        if self.sums.len() <= collisions {
            self.sums.resize(collisions + 1, 0);
        }
        self.refused = None;
    }

    /// Beats of an issue on each stream.
    pub(super) fn share(&self, brings: Brings) -> PerStream {
        match (brings, self.layout.warm_share) {
            (Brings::NormalImpulses | Brings::FrictionImpulses, Some(share)) => share,
            _ => self.layout.share,
        }
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
    fn shares(&self, brings: Brings) -> impl Iterator<Item = (usize, usize)> + use<> {
        self.share(brings).into_iter().enumerate().filter(|(_, share)| *share > 0)
    }

    /// Where the beats of the decoded collisions are on a stream.
    fn origin(&self, brings: Brings, k: usize) -> &Spans {
        if k == warm::STREAM { &self.kinds[brings as usize].origin } else { &self.origin[k] }
    }

    /// The least number of issues between two decoded collisions that share a body that moves.
    pub(super) fn distance(&self) -> usize {
        self.batch.distance() as usize
    }

    /// Collisions that are decoded, and known in passes that bring the same.
    pub(super) fn known(&self, brings: Brings) -> usize {
        self.kinds[brings as usize].known
    }

    /// Why the decoder refused the collision after the last decoded one, if it did.
    pub(super) fn refused(&self) -> Option<PacketError> {
        self.refused
    }

    /// Decodes the upcoming collisions of the first pass. The segment says which ones are next.
    pub(super) fn decode_ahead(
        &mut self,
        segment: &Segment,
        upcoming: &Upcoming<'_>,
        (shape_of, inverse_masses): (&[u8], &[f32]),
        memory: &Memory,
    ) {
        let (brings, total) = (self.first, segment.done + segment.left());
        while self.refused.is_none() && self.known(brings) < total {
            // All decoded issues are whole ones.
            let known = self.known(brings);
            let first = self.issues(known);
            let share_of = self.share(brings);
            let ahead = |k: usize| (first - self.issues(segment.done)) * share_of[k];
            let mut issues = self.issues(total) - first;
            for (k, share) in self.shares(brings) {
                issues = issues.min(upcoming.piece(k, ahead(k), issues * share).0 / share);
            }
            // An issue whose beats are not together is gathered.
            let apart = issues == 0;
            let issues = issues.max(1);
            let mut gathered = [[Beat::default(); BEATS_MAX]; STREAMS_MAX];
            let mut streams: [&[Beat]; STREAMS_MAX] = [&[]; STREAMS_MAX];
            let mut sources = [[None; BEATS_MAX]; STREAMS_MAX];
            let step = |share: usize| if apart { 1 } else { issues * share };
            for (k, share) in self.shares(brings) {
                for at in (0..issues * share).step_by(step(share)) {
                    let (count, source) = upcoming.piece(k, ahead(k) + at, step(share));
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
            for (k, share) in self.shares(brings) {
                let first = (first * share) as u64;
                let origin = match k {
                    warm::STREAM => &mut self.kinds[brings as usize].origin,
                    _ => &mut self.origin[k],
                };
                for (at, source) in (0..).zip(sources[k].into_iter().flatten()) {
                    origin.push(first + at, step(share) as u64, source);
                }
                if apart {
                    streams[k] = &gathered[k][..share];
                }
            }
            let records = (issues * self.together()).min(total - known);
            let [before, sums @ ..] = &mut self.sums[known..=known + records] else { return };
            let (batch, masses) = (&mut self.batch, &self.masses);
            // The decoder asks which bodies move, and nothing else.
            let properties = Properties { shape_of, masses, inverse_masses, inertias: &[] };
            let decoded = match &mut self.translation {
                Some(translation) => translation.decode(batch, streams, records, properties, sums),
                None if brings == Brings::Nothing => {
                    batch.decode(streams, records, properties, sums)
                }
                None => batch.decode_warm(streams, records, properties, sums),
            };
            self.refused = decoded.err();
            let decoded = self.batch.len() - known;
            let mut sum = *before;
            for each in &mut sums[..decoded] {
                sum = sum.wrapping_add(*each);
                *each = sum;
            }
            let impulses = streams[warm::STREAM];
            let beats = impulses.len().min(decoded * share_of[warm::STREAM]);
            self.take_impulses(brings, known, &impulses[..beats]);
            self.kinds[brings as usize].known = self.batch.len();
        }
    }

    /// The sum of all words of `records` collisions. The first one begins an issue.
    pub(super) fn sum(&self, brings: Brings, first: usize, records: usize) -> u32 {
        let sum = self.sums[first + records].wrapping_sub(self.sums[first]);
        match brings {
            Brings::Nothing => sum,
            _ => sum.wrapping_add(self.kinds[brings as usize].sum(first, records)),
        }
    }

    /// Whether the next `records` collisions on the streams are the decoded ones, as far as their
    /// beats have come: more may have come on one stream than on another.
    pub(super) fn same(
        &self,
        brings: Brings,
        segment: &Segment,
        records: usize,
        inputs: &[Stream],
    ) -> bool {
        self.shares(brings).all(|(k, share)| {
            let first = (self.issues(segment.done) * share) as u64;
            let most = (self.issues(records) * share).min(inputs[k].len());
            let mut at = 0;
            while at < most {
                let (count, source) = inputs[k].piece(at, most - at);
                let same = |from| self.origin(brings, k).holds(first + at as u64, count, from);
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
    pub(super) fn goes_on(
        &self,
        brings: Brings,
        segment: &Segment,
        inputs: &[Stream],
        coming: &Coming,
    ) -> bool {
        self.shares(brings).all(|(k, share)| {
            let Some((source, count)) = coming[k] else { return false };
            let next = self.issues(segment.done) * share + inputs[k].len();
            let all = self.issues(segment.done + segment.left());
            let left = (all * share).saturating_sub(next);
            self.origin(brings, k).holds(next as u64, count.min(left), source)
        })
    }
}
