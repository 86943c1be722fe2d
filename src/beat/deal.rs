//! This file deals the beats of a segment out to its channels.
//!
//! A block of records is laid out in the cache first; then its beats go to the channels one after
//! the other, each a run of whole beats upwards, as memory that combines writes wants them. Nothing
//! is read back: the sum that the accelerator is checked with is taken on the way.

use std::mem;

use bitstream_model::interface::record::Beat;

use super::stripe::{Deal, GROUP, Layout, Place};
use super::unpack::total;
use crate::platform::{Lanes, soon_written};

/// Records of a block. Divisible by the records of a group of every stripe, so that each block
/// begins with a group; and so few that a block, read and written, lies in the innermost cache.
pub(crate) const BLOCK: usize = 30;

/// Records of a block of bodies, which lie one behind the other, as [`BLOCK`].
pub(super) const BODIES: usize = 120;

/// Writes the beats of one segment.
pub(super) struct Dealer<'a, 'b> {
    /// What is not written yet.
    channels: &'a mut [&'b mut [Beat]],
    deal: Deal,
    padded: bool,
    sum: Lanes,
}

impl<'a, 'b> Dealer<'a, 'b> {
    /// From the first beat on.
    ///
    /// Shape: each channel is as long as [`Layout::beats_on_channel`] says.
    pub(super) fn new(layout: &Layout, channels: &'a mut [&'b mut [Beat]]) -> Self {
        Self {
            channels,
            deal: Deal::new(layout.stripe),
            padded: layout.stripe.padded,
            sum: Lanes::all(0),
        }
    }

    /// Writes the next beats.
    #[inline(always)]
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
            let Place { channel, .. } = self.deal.next();
            let (to, behind) = mem::take(&mut self.channels[channel]).split_at_mut(1);
            to[0] = *beat;
            self.channels[channel] = behind;
            self.sum = self.sum.plus(Lanes::from(*beat));
        }
    }

    /// Writes whole groups of `G` beats; what is left of the beats.
    #[inline(always)]
    fn groups<'c, const G: usize>(&mut self, beats: &'c [Beat]) -> &'c [Beat] {
        let (groups, rest) = beats.as_chunks::<G>();
        for (channel, share) in self.channels.iter_mut().zip(&self.deal.shares) {
            let (to, behind) = mem::take(channel).split_at_mut(groups.len() * share.count);
            soon_written(&behind[..to.len().min(behind.len())]);
            *channel = behind;
            let (places, sum) = (&share.places, &mut self.sum);
            match share.count {
                0 => {}
                1 => run::<G, 1>(groups, places, to, sum),
                2 => run::<G, 2>(groups, places, to, sum),
                3 => run::<G, 3>(groups, places, to, sum),
                count => {
                    let beats =
                        groups.iter().flat_map(|group| places[..count].iter().map(|at| group[*at]));
                    for (to, beat) in to.iter_mut().zip(beats) {
                        *to = beat;
                        *sum = sum.plus(Lanes::from(beat));
                    }
                }
            }
        }
        rest
    }

    /// Fills the last group if the stripe says so; the sum of all words, modulo 2^32.
    #[inline(always)]
    pub(super) fn finish(mut self) -> u32 {
        while self.padded && !self.deal.at_end_of_group() {
            self.write(&[Beat::default()]);
        }
        total(self.sum)
    }
}

/// Writes the `S` beats of each group that go to one channel, and adds them up.
#[inline(always)]
fn run<const G: usize, const S: usize>(
    groups: &[[Beat; G]],
    places: &[usize; GROUP],
    to: &mut [Beat],
    sum: &mut Lanes,
) {
    // Said once here, so that it is not asked of every beat.
    let places: [usize; S] = std::array::from_fn(|at| places[at % GROUP].min(G - 1));
    let mut total = *sum;
    for (to, group) in to.as_chunks_mut::<S>().0.iter_mut().zip(groups) {
        let beats = places.map(|place| Lanes::from(group[place]));
        total = beats.iter().fold(total, |total, beat| total.plus(*beat));
        *to = beats.map(Beat::from);
    }
    *sum = total;
}
