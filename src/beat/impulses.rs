//! Writes the collision segments of the warm passes for the channel that carries impulses. A
//! segment repeats, issue by issue, the collision beats of the channel, and adds a beat of impulses
//! to each issue.
//!
//! The other channels have the same beats in every pass.

use pgs_interface::profile::Variant;
use pgs_interface::record::{Beat, LANES, collision};
use pgs_interface::stripe::Stripe;

use super::deal::Share;
use super::format::beats_of;
use super::pool::Stretch as _;
use super::stripe::{BLOCK, Layout, Segment};
use crate::record::Magnitudes;
use crate::record::collision::{and, used_lanes};
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
    /// Of either kind.
    largest: [Magnitudes; 2],
    /// The rows of a block's impulses of either kind, and their beats in sixteen bits.
    kinds: [[[Beat; 1]; BLOCK]; 2],
    halves: [[Beat; BLOCK.div_ceil(2)]; 2],
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
            largest: [Magnitudes::default(); 2],
            kinds: [[[Beat::default()]; BLOCK]; 2],
            halves: [[Beat::default(); BLOCK.div_ceil(2)]; 2],
        }
    }

    /// Makes the rows of the impulses of the next collisions, whose records have these rows.
    #[inline]
    pub(super) fn take(
        &mut self,
        records: &[[Beat; collision::ROWS]],
        impulses: impl Fn(usize, [f32; 3], u32) -> Impulses,
    ) {
        let [contact, friction] = &mut self.kinds;
        let [mut of_contact, mut of_friction] = self.largest;
        let rows = records.iter().zip(contact.iter_mut().zip(friction));
        for (at, (record, ([normal], [tangential]))) in rows.enumerate() {
            let [x, y, z, count] = record[collision::NORMAL].0;
            let points = count & !collision::FRICTION_BITS;
            let impulses = impulses(at, [x, y, z].map(f32::from_bits), points);
            [*normal, *tangential] = rows_of(&impulses, count);
            of_contact.see(*normal);
            of_friction.see(*tangential);
        }
        self.largest = [of_contact, of_friction];
    }

    /// Writes the `count` collisions whose rows were made: their beats, as in every pass, and
    /// behind each issue a beat of impulses.
    pub(super) fn write(&mut self, beats: &[Beat], count: usize) {
        let Self { segments, layout, issue, share, sums, kinds, halves, .. } = self;
        let [contact, friction] = kinds;
        let [of_contact, of_friction] = halves;
        let added = [
            beats_of(layout, (contact, count), &[], of_contact),
            beats_of(layout, (friction, count), &[], of_friction),
        ];
        let beats = (beats, *issue);
        match *share.places() {
            [place] => add(segments, beats, &[place], added, sums),
            _ => add(segments, beats, share.places(), added, sums),
        }
    }

    /// Whether all impulses are numbers of at most this magnitude.
    pub(super) fn are_within(&self, limit: f32) -> bool {
        self.largest.iter().all(|largest| largest.are_within(limit))
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
    let used = used_lanes(count);
    let [first, second] = impulses.friction;
    let normal = Beat(impulses.normal.map(f32::to_bits));
    let tangential = Beat([first.to_bits(), second.to_bits(), 0, 0]);
    [and(normal, used), and(tangential, &Beat([used.0[0]; LANES]))]
}

/// Writes the beats at these places of each issue to both segments, and behind them the added one.
#[inline(always)]
fn add(
    segments: &mut WarmSegments<'_>,
    (beats, issue): (&[Beat], usize),
    places: &[usize],
    added: [&[Beat]; 2],
    sums: &mut [Sum; 2],
) {
    let each = places.len() + 1;
    if places.iter().any(|place| *place >= issue) {
        return;
    }
    let write = |to: &mut [Beat], beats: &[Beat], added: &Beat, sum: &mut Sum| {
        for (to, place) in to.iter_mut().zip(places) {
            *to = beats[*place];
        }
        to[places.len()] = *added;
        sum.add(*added);
    };
    let length = added[0].len() * each;
    let WarmSegments { contact, friction, .. } = segments;
    let ((contact, rest), (tangential, behind)) =
        (std::mem::take(contact).parted(length), std::mem::take(friction).parted(length));
    (segments.contact, segments.friction) = (rest, behind);
    let [contact, friction] = [contact, tangential].map(|to| to.chunks_exact_mut(each));
    let mut all = *sums;
    let [in_contact, in_friction] = &mut all;
    let beats = beats.chunks_exact(issue);
    if contact.len() == friction.len() {
        let added = added[0].iter().zip(added[1]);
        for (((first, second), beats), added) in contact.zip(friction).zip(beats).zip(added) {
            write(first, beats, added.0, in_contact);
            write(second, beats, added.1, in_friction);
        }
    } else {
        // A kind without passes has no segment.
        let kinds = [(contact, added[0], in_contact), (friction, added[1], in_friction)];
        for (segment, added, sum) in kinds {
            for ((to, beats), added) in segment.zip(beats.clone()).zip(added) {
                write(to, beats, added, sum);
            }
        }
    }
    *sums = all;
}
