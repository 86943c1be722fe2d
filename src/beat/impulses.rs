//! Writes the collision segments of the warm passes for the channel that carries impulses. A
//! segment repeats, issue by issue, the collision beats of the channel, and adds a beat of impulses
//! to each issue.
//!
//! The other channels have the same beats in every pass.

use pgs_interface::profile::Variant;
use pgs_interface::record::{Beat, WORD_LANE, collision};
use pgs_interface::stripe::Stripe;

use super::deal::Share;
use super::format::beats_of;
use super::pool::Stretch as _;
use super::stripe::{BLOCK, Layout, Segment};
use crate::record::Magnitudes;
use crate::record::collision::{and, used, used_lanes};
use crate::scene::Impulses;
use crate::simd::Sum;

/// The segments of both warm passes on the channel that carries impulses. A kind without iterations
/// has no warm pass and an empty segment.
#[derive(Debug, Default)]
pub(crate) struct WarmSegments<'a> {
    pub(crate) channel: usize,
    pub(crate) contact: &'a mut [Beat],
    pub(crate) friction: &'a mut [Beat],
}

/// Sums of the words of the impulses, modulo 2^32.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct WarmSums {
    /// In the contact pass.
    pub(crate) contact: u32,
    /// In the friction pass.
    pub(crate) friction: u32,
}

impl WarmSums {
    pub(crate) const NONE: Self = Self { contact: 0, friction: 0 };

    /// The sums of two parts.
    pub(super) fn and(self, other: Self) -> Self {
        Self {
            contact: self.contact.wrapping_add(other.contact),
            friction: self.friction.wrapping_add(other.friction),
        }
    }
}

impl<'a> WarmSegments<'a> {
    /// Takes the part of the next `size` collisions, in whole blocks, or the rest.
    pub(super) fn cut(&mut self, variant: &Variant, size: usize) -> WarmDealer<'a> {
        let channel = self.channel;
        let beats = Segment::WarmCollisions.layout(variant).beats_on_channel(size, channel);
        let mut part = Self { channel, ..Self::default() };
        // A segment without beats stays empty.
        let segments =
            [(&mut self.contact, &mut part.contact), (&mut self.friction, &mut part.friction)];
        for (rest, part) in segments {
            (*part, *rest) = std::mem::take(rest).parted(beats);
        }
        WarmDealer::new(variant, part)
    }
}

/// Writes the segments of both warm passes.
#[derive(Debug)]
pub(crate) struct WarmDealer<'a> {
    segments: WarmSegments<'a>,
    /// The impulses alone, as records of one row.
    layout: Layout,
    /// Collision beats of an issue, on all channels.
    issue: usize,
    /// The places of this channel's beats among them.
    share: Share,
    sums: [Sum; 2],
    largest: Magnitudes,
    /// The rows of a block's impulses of either kind, and the beats of one kind in sixteen bits.
    kinds: [[[Beat; 1]; BLOCK]; 2],
    halves: [Beat; BLOCK.div_ceil(2)],
}

impl<'a> WarmDealer<'a> {
    fn new(variant: &Variant, segments: WarmSegments<'a>) -> Self {
        const _: () = assert!(collision::WARM_ROWS == collision::ROWS + 1);
        let warm = Segment::WarmCollisions.layout(variant);
        let issue =
            variant.profile.collisions_per_issue as usize * collision::ROWS / warm.rows_per_beat();
        let share = Share::of(issue, |beat| warm.place(beat).channel == segments.channel);
        let stripe = Stripe { streams: &[0], padded: false };
        let layout = Layout { rows: 1, format: warm.format, stripe };
        Self {
            segments,
            layout,
            issue,
            share,
            sums: [Sum::default(); 2],
            largest: Magnitudes::default(),
            kinds: [[[Beat::default()]; BLOCK]; 2],
            halves: [Beat::default(); BLOCK.div_ceil(2)],
        }
    }

    /// Writes the next collisions: their beats, as in every pass, and behind each issue a beat of
    /// impulses. `records` are the rows of the collisions.
    pub(super) fn write(
        &mut self,
        beats: &[Beat],
        records: &[[Beat; collision::ROWS]],
        impulses: &[Impulses],
    ) {
        let Self { segments, layout, issue, share, sums, largest, kinds, halves } = self;
        let [contact, friction] = &mut *kinds;
        let rows = contact.iter_mut().zip(friction);
        for (([normal], [tangential]), (of, record)) in rows.zip(impulses.iter().zip(records)) {
            [*normal, *tangential] = rows_of(of, record[collision::NORMAL].0[WORD_LANE]);
            largest.see(*normal);
            largest.see(*tangential);
        }
        let segments = [&mut segments.contact, &mut segments.friction];
        for ((rows, segment), sum) in kinds.iter_mut().zip(segments).zip(sums) {
            let added = beats_of(layout, (rows, impulses.len()), &[], halves);
            let beats = (beats, *issue);
            match *share.places() {
                [place] => add(segment, beats, &[place], added, sum),
                _ => add(segment, beats, share.places(), added, sum),
            }
        }
    }

    /// Whether all impulses are numbers of at most this magnitude.
    pub(super) fn are_within(&self, limit: f32) -> bool {
        self.largest.are_within(limit)
    }

    pub(super) fn sums(&self) -> WarmSums {
        let [contact, friction] = self.sums.map(Sum::total);
        WarmSums { contact, friction }
    }
}

/// The rows of a collision's impulses, normal and tangential. Impulses without a contact point are
/// zeros: the caller may leave anything there.
#[inline(always)]
fn rows_of(impulses: &Impulses, count: u32) -> [Beat; 2] {
    let points = count & !collision::FRICTION_BITS;
    let [first, second] = impulses.friction.map(f32::to_bits);
    let normal = Beat(impulses.normal.map(f32::to_bits));
    let tangential = Beat([first, second, 0, 0]);
    [and(normal, used_lanes(points)), and(tangential, &used(points)[0])]
}

/// Writes the beats at these places of each issue to a segment, and behind them the added one.
#[inline(always)]
fn add(
    segment: &mut &mut [Beat],
    (beats, issue): (&[Beat], usize),
    places: &[usize],
    added: &[Beat],
    sum: &mut Sum,
) {
    let each = places.len() + 1;
    if places.iter().any(|place| *place >= issue) || segment.is_empty() {
        return;
    }
    let (to, behind) = std::mem::take(segment).parted(added.len() * each);
    let mut all = *sum;
    for ((to, beats), added) in to.chunks_exact_mut(each).zip(beats.chunks_exact(issue)).zip(added)
    {
        for (to, place) in to.iter_mut().zip(places) {
            *to = beats[*place];
        }
        to[places.len()] = *added;
        all.add(*added);
    }
    (*segment, *sum) = (behind, all);
}
