//! Deals the beats of a segment out to its channels, and joins the beats of the channels again.
//!
//! The buffers may be write-combining memory of a board. Each channel is written once, upwards, in
//! whole beats, and never read: the sum for the check of the accelerator is taken on the way.

use std::mem;

use pgs_interface::address_map::DMA_COUNT_MAX;
use pgs_interface::record::Beat;
use pgs_interface::stripe::Stripe;

use super::pool::{Piece, PieceRead, Stretch as _};
use super::stripe::Layout;
use crate::simd::Sum;

/// Beats of two groups, at most.
const BEATS_MAX: usize = 16;

/// The places of a channel's beats among some.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Share {
    places: [usize; BEATS_MAX],
    count: usize,
}

impl Share {
    /// The first places at which `takes` is true.
    pub(crate) fn of(places: usize, takes: impl Fn(usize) -> bool) -> Self {
        let mut share = Self::default();
        for (to, place) in share.places.iter_mut().zip((0..places).filter(|at| takes(*at))) {
            *to = place;
            share.count += 1;
        }
        share
    }

    pub(crate) fn places(&self) -> &[usize] {
        &self.places[..self.count]
    }
}

/// The share of each channel in two groups: a loop over pairs of groups takes half the turns.
fn shares(stripe: Stripe) -> [Share; DMA_COUNT_MAX] {
    let group = stripe.streams;
    let channel_of = |at: usize| usize::from(group[at % group.len()]);
    std::array::from_fn(|channel| Share::of(2 * group.len(), |at| channel_of(at) == channel))
}

/// Copies the beats at these places of each `pair` of groups to a channel, and adds them to `sum`.
#[inline(always)]
fn pick(from: &[Beat], pair: usize, places: &[usize], to: &mut [Beat], sum: &mut Sum) {
    if places.is_empty() || places.iter().any(|place| *place >= pair) {
        return;
    }
    let mut all = *sum;
    for (to, from) in to.chunks_exact_mut(places.len()).zip(from.chunks_exact(pair)) {
        for (to, place) in to.iter_mut().zip(places) {
            *to = from[*place];
            all.add(*to);
        }
    }
    *sum = all;
}

/// Copies the beats of a channel to these places of each `pair` of groups.
#[inline(always)]
fn place(from: &[Beat], places: &[usize], to: &mut [Beat], pair: usize) {
    if places.is_empty() || places.iter().any(|place| *place >= pair) {
        return;
    }
    for (to, from) in to.chunks_exact_mut(pair).zip(from.chunks_exact(places.len())) {
        for (from, place) in from.iter().zip(places) {
            to[*place] = *from;
        }
    }
}

/// Writes the beats of one segment to its channels.
#[derive(Debug)]
pub(crate) struct Dealer<'a> {
    pub(crate) layout: Layout,
    shares: [Share; DMA_COUNT_MAX],
    /// The beats that are not written yet.
    channels: Piece<'a>,
    sum: Sum,
}

impl<'a> Dealer<'a> {
    /// Begins with the first record of a group.
    ///
    /// Shape: each channel is as long as [`Layout::beats_on_channel`] says.
    pub(crate) fn new(layout: Layout, channels: Piece<'a>) -> Self {
        Self { layout, shares: shares(layout.stripe), channels, sum: Sum::default() }
    }

    /// Writes the next beats, which are whole groups unless they are the last.
    pub(crate) fn write(&mut self, beats: &[Beat]) {
        let streams = self.layout.stripe.streams;
        let (pair, sum) = (2 * streams.len(), &mut self.sum);
        let pairs = beats.len() / pair;
        let (whole, rest) = beats.split_at(pairs * pair);
        for (channel, share) in self.channels.iter_mut().zip(&self.shares) {
            let (to, behind) = mem::take(channel).parted(pairs * share.count);
            // A loop for each of these numbers, so that no loop counts to it.
            match *share.places() {
                [a, b] => pick(whole, pair, &[a, b], to, sum),
                [a, b, c, d] => pick(whole, pair, &[a, b, c, d], to, sum),
                [a, b, c, d, e, f] => pick(whole, pair, &[a, b, c, d, e, f], to, sum),
                _ => pick(whole, pair, share.places(), to, sum),
            }
            *channel = behind;
        }
        for (beat, stream) in rest.iter().zip(streams.iter().cycle()) {
            let channel = &mut self.channels[usize::from(*stream)];
            let (to, behind) = mem::take(channel).parted(1);
            to.fill(*beat);
            sum.add(*beat);
            *channel = behind;
        }
    }

    /// The sum of the words written, modulo 2^32.
    pub(crate) fn sum(&self) -> u32 {
        self.sum.total()
    }
}

/// Reads the beats of one segment from its channels.
#[derive(Debug)]
pub(crate) struct Joiner<'a> {
    stripe: Stripe,
    shares: [Share; DMA_COUNT_MAX],
    /// The beats that are not read yet.
    channels: PieceRead<'a>,
}

impl<'a> Joiner<'a> {
    /// Begins with the first record of a group.
    ///
    /// Shape: each channel is as long as [`Layout::beats_on_channel`] says.
    pub(crate) fn new(stripe: Stripe, channels: PieceRead<'a>) -> Self {
        Self { stripe, shares: shares(stripe), channels }
    }

    /// Reads the next beats, which are whole groups unless they are the last.
    pub(crate) fn read(&mut self, beats: &mut [Beat]) {
        let streams = self.stripe.streams;
        let pair = 2 * streams.len();
        let pairs = beats.len() / pair;
        let (whole, rest) = beats.split_at_mut(pairs * pair);
        for (channel, share) in self.channels.iter_mut().zip(&self.shares) {
            let (from, behind) = mem::take(channel).parted(pairs * share.count);
            match *share.places() {
                [a, b] => place(from, &[a, b], whole, pair),
                [a, b, c, d] => place(from, &[a, b, c, d], whole, pair),
                _ => place(from, share.places(), whole, pair),
            }
            *channel = behind;
        }
        for (to, stream) in rest.iter_mut().zip(streams.iter().cycle()) {
            let channel = &mut self.channels[usize::from(*stream)];
            let (from, behind) = mem::take(channel).parted(1);
            *to = from.first().copied().unwrap_or_default();
            *channel = behind;
        }
    }
}

/// Sum of all 32-bit words, modulo 2^32.
pub(crate) fn sum_of_words(beats: &[Beat]) -> u32 {
    let mut sum = Sum::default();
    beats.iter().for_each(|beat| sum.add(*beat));
    sum.total()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::pool::{whole, whole_read};
    use super::*;
    use crate::beat::stripe::{BLOCK, Place};
    use pgs_interface::number::StreamFormat;
    use pgs_interface::record::LANES;

    proptest! {
        /// Covers stripes that no profile has, and some that a profile has.
        #[test]
        fn every_beat_goes_where_the_definition_says_and_comes_back(
            beats in prop::collection::vec(any::<[u32; LANES]>().prop_map(Beat), 0..500),
            streams in prop::sample::select(vec![
                &[1, 0][..], &[0, 1, 1], &[3, 2, 1, 0, 0, 1], &[0, 0, 1, 1, 2], &[2], &[0, 1],
                &[0, 1, 2, 3], &[1, 1, 1, 1, 0],
            ]),
        ) {
            let stripe = Stripe { streams, padded: false };
            let layout = Layout { rows: 1, format: StreamFormat::F32, stripe };
            // The segments are full of ones, so that a missing beat shows.
            let buffer = |channel| {
                vec![Beat([u32::MAX; LANES]); layout.beats_on_channel(beats.len(), channel)]
            };
            let mut segments: [Vec<Beat>; DMA_COUNT_MAX] = std::array::from_fn(buffer);
            let mut views = segments.each_mut().map(Vec::as_mut_slice);
            let mut dealer = Dealer::new(layout, whole(&mut views));
            beats.chunks(BLOCK).for_each(|block| dealer.write(block));
            let words = beats.iter().flat_map(|beat| beat.0);
            prop_assert_eq!(dealer.sum(), words.fold(0, u32::wrapping_add));
            let mut expected = segments.each_ref().map(|it| vec![Beat::default(); it.len()]);
            for (at, beat) in beats.iter().enumerate() {
                let Place { channel, slot } = layout.place(at);
                expected[channel][slot] = *beat;
            }
            prop_assert_eq!(&segments, &expected);
            let views = segments.each_ref().map(Vec::as_slice);
            let mut joiner = Joiner::new(stripe, whole_read(&views));
            let mut read = vec![Beat::default(); beats.len()];
            read.chunks_mut(BLOCK).for_each(|block| joiner.read(block));
            prop_assert_eq!(read, beats);
        }
    }
}
