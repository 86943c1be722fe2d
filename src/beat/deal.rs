//! This file deals the beats of a segment out to its channels.
//!
//! A block of records is laid out in the cache first; then its beats go to the channels one after
//! the other, each a run of whole beats upwards, as memory that combines writes wants them. Nothing
//! is read back: the sum that the accelerator is checked with is taken on the way.

use bitstream_model::interface::record::{BEAT_BYTES, Beat, LANES};

use super::stripe::{Deal, Layout, Place};
use super::unpack::{add, total};
use crate::platform::{Slots, Streamed};

/// Records of a block. Divisible by the records of a group of every stripe, so that each block
/// begins with a group; and so few that a block, read and written, lies in the innermost cache.
pub(super) const BLOCK: usize = 30;

/// Beats from which on a segment goes past the caches: what has more than 2 MiB is not in them any
/// more when the device reads it. Tests have both ways with few records.
const STREAMED: usize = if cfg!(test) { 64 } else { (2 << 20) / BEAT_BYTES };

/// Writes the beats of one segment.
pub(super) struct Dealer<'a, 'b> {
    channels: Streamed<'a, 'b>,
    deal: Deal,
    padded: bool,
    lanes: [u32; LANES],
    past_caches: bool,
}

impl<'a, 'b> Dealer<'a, 'b> {
    /// From the first beat on.
    ///
    /// Shape: each channel is as long as [`Layout::beats_on_channel`] says.
    pub(super) fn new(layout: &Layout, channels: &'a mut [&'b mut [Beat]]) -> Self {
        let beats: usize = channels.iter().map(|beats| beats.len()).sum();
        Self {
            channels: Streamed::new(channels),
            deal: Deal::new(layout.stripe),
            padded: layout.stripe.padded,
            lanes: [0; LANES],
            past_caches: beats > STREAMED,
        }
    }

    /// Writes the next beats.
    #[inline]
    pub(super) fn write(&mut self, beats: &[Beat]) {
        let rest = match self.deal.group().len() {
            _ if !self.deal.at_end_of_group() => beats,
            1 => self.groups::<1>(beats),
            2 => self.groups::<2>(beats),
            3 => self.groups::<3>(beats),
            4 => self.groups::<4>(beats),
            5 => self.groups::<5>(beats),
            7 => self.groups::<7>(beats),
            _ => beats,
        };
        for beat in rest {
            let Place { channel, slot } = self.deal.next();
            self.channels.put(channel, slot, *beat);
            add(&mut self.lanes, *beat);
        }
    }

    /// Writes whole groups of `G` beats; what is left of the beats.
    #[inline]
    fn groups<'c, const G: usize>(&mut self, beats: &'c [Beat]) -> &'c [Beat] {
        let (groups, rest) = beats.as_chunks::<G>();
        for channel in 0..self.channels.len() {
            let (places, share) = places::<G>(self.deal.group(), channel);
            let slots = self.deal.take(channel, groups.len() * share);
            let to = self.channels.slots(channel, slots);
            let lanes = &mut self.lanes;
            match (share, self.past_caches) {
                (0, _) => {}
                (1, false) => run::<G, 1, false>(groups, places, to, lanes),
                (1, true) => run::<G, 1, true>(groups, places, to, lanes),
                (2, false) => run::<G, 2, false>(groups, places, to, lanes),
                (2, true) => run::<G, 2, true>(groups, places, to, lanes),
                (3, false) => run::<G, 3, false>(groups, places, to, lanes),
                (3, true) => run::<G, 3, true>(groups, places, to, lanes),
                _ => {
                    let places = &places[..share];
                    let beats = groups.iter().flat_map(|group| places.iter().map(|at| group[*at]));
                    to.write::<1, false>(beats.map(|beat| {
                        add(lanes, beat);
                        [beat]
                    }));
                }
            }
        }
        rest
    }

    /// Fills the last group if the stripe says so; the sum of all words, modulo 2^32.
    pub(super) fn finish(mut self) -> u32 {
        while self.padded && !self.deal.at_end_of_group() {
            self.write(&[Beat::default()]);
        }
        total(self.lanes)
    }
}

/// Which beats of a group of `G` go to a channel, and how many they are.
pub(super) fn places<const G: usize>(group: &[u8], channel: usize) -> ([usize; G], usize) {
    let (mut places, mut share) = ([0; G], 0);
    for (place, stream) in group.iter().enumerate().take(G) {
        if usize::from(*stream) == channel {
            places[share] = place;
            share += 1;
        }
    }
    (places, share)
}

/// Writes the `S` beats of each group that go to one channel, and adds them up.
#[inline]
fn run<const G: usize, const S: usize, const PAST_CACHES: bool>(
    groups: &[[Beat; G]],
    places: [usize; G],
    to: Slots<'_>,
    lanes: &mut [u32; LANES],
) {
    // Said once here, so that it is not asked of every beat.
    let places: [usize; S] = std::array::from_fn(|at| places[at % G].min(G - 1));
    let mut sum = *lanes;
    to.write::<S, PAST_CACHES>(groups.iter().map(|group| {
        let beats = places.map(|place| group[place]);
        beats.iter().for_each(|beat| add(&mut sum, *beat));
        beats
    }));
    *lanes = sum;
}
