//! Deals the records of a segment out to its channels.
//!
//! Whole units go from registers to the channels ([`unrolled`]). The rest at a segment's end, and a
//! stripe that no profile has, go beat by beat. Each channel is written upwards in whole beats, as
//! write-combining memory needs. The writer reads nothing back: it takes the sum for the check of
//! the accelerator on the way.

use pgs_interface::number::StreamFormat;
use std::mem;

use pgs_interface::record::Beat;

use super::pattern::Pattern;
use super::unrolled;
use crate::beat::format::{Beats, Format, Records, in_format};
use crate::beat::stripe::{BLOCK, Deal, Layout, total};
use crate::record::{Row, Rows};
use crate::simd::{Lanes, Vectors};

/// Records of many blocks: at this number the start of a run costs next to nothing a record.
pub(crate) const MANY: usize = 32 * BLOCK;

/// Collisions of an array that are checked together: they fit in the L1 cache, in case of a second
/// check.
pub(crate) const CHECKED: usize = 4 * BLOCK;

/// Bodies of a block. The number is larger than [`BLOCK`], as bodies are small and adjacent in
/// memory.
pub(crate) const BODIES: usize = 120;
const _: () = assert!(BODIES.is_multiple_of(BLOCK), "so that each begins with a group");

/// Writes the records of one segment.
pub(crate) struct StripeWriter<'a, 'b> {
    /// The beats that are not written yet.
    channels: &'a mut [&'b mut [Beat]],
    format: StreamFormat,
    /// The pattern of the stripe, if a profile has it, and its first channel.
    pattern: Option<(Pattern, usize)>,
    deal: Deal,
    padded: bool,
    sum: Lanes,
}

impl<'a, 'b> StripeWriter<'a, 'b> {
    /// Begins with the first record.
    ///
    /// Shape: each channel is as long as [`Layout::beats_on_channel`] says.
    pub(crate) fn new(layout: &Layout, channels: &'a mut [&'b mut [Beat]]) -> Self {
        Self {
            channels,
            format: layout.format,
            pattern: Pattern::of(layout.stripe.streams),
            deal: Deal::new(layout.stripe),
            padded: layout.stripe.padded,
            sum: Lanes::all(0),
        }
    }

    /// Writes the next records; only the last block may be incomplete.
    #[inline(always)]
    pub(crate) fn write<V: Vectors, R: Records<ROWS>, const ROWS: usize>(
        &mut self,
        vectors: V,
        records: &mut R,
    ) {
        in_format!(self.format, F => self.write_as::<V, F, R, ROWS>(vectors, records));
    }

    /// The format of the words.
    #[inline(always)]
    pub(crate) const fn format(&self) -> StreamFormat {
        self.format
    }

    /// As [`Self::write`], in the format `F`, which is [`Self::format`].
    #[inline(always)]
    pub(crate) fn write_as<V: Vectors, F: Format, R: Records<ROWS>, const ROWS: usize>(
        &mut self,
        vectors: V,
        records: &mut R,
    ) {
        debug_assert_eq!(F::WORDS, self.format, "the words are those of the stream");
        let mut sum = self.sum;
        let done = match self.pattern {
            Some((pattern, first)) if self.deal.at_end_of_group() => {
                let rest = self.channels.get_mut(first..).unwrap_or_default();
                unrolled::write::<V, F, R, ROWS>(pattern, vectors, records, rest, &mut sum)
            }
            _ => 0,
        };
        self.sum = sum;
        // The units did not take these records.
        let mut rest = Rest { dealer: self, beats: Beats::<V, F>::new(vectors) };
        for at in done..records.len() {
            if records.some::<1>(at, &mut rest).is_none() {
                break;
            }
        }
        let Rest { dealer, beats } = rest;
        if let Some(beat) = beats.last() {
            dealer.put(beat);
        }
    }

    /// Writes the next beat. Inlined into the loops of units, it would leave them too few
    /// registers.
    #[inline(never)]
    fn put(&mut self, beat: Beat) {
        let channel = self.deal.next();
        let (to, behind) = mem::take(&mut self.channels[channel]).split_at_mut(1);
        to[0] = beat;
        self.channels[channel] = behind;
        self.sum = self.sum.plus(beat.into());
    }

    /// Fills the last group if the stripe says so; the sum of all words, modulo 2^32.
    #[inline(always)]
    pub(crate) fn finish(mut self) -> u32 {
        while self.padded && !self.deal.at_end_of_group() {
            self.put(Beat::default());
        }
        total(self.sum)
    }
}

/// Takes rows whose beats are written one by one.
struct Rest<'d, 'a, 'b, V, F> {
    dealer: &'d mut StripeWriter<'a, 'b>,
    beats: Beats<V, F>,
}

impl<V: Vectors, F: Format> Rows for Rest<'_, '_, '_, V, F> {
    #[inline(always)]
    fn row(&mut self, row: Row) {
        if let Some(beat) = self.beats.with(row) {
            self.dealer.put(beat);
        }
    }
}

#[cfg(test)]
mod tests {
    use pgs_interface::number::StreamFormat;
    use pgs_interface::record::LANES;
    use pgs_interface::stripe::Stripe;
    use pgs_support::chunks::Chunks;
    use proptest::prelude::*;

    use super::*;
    use crate::beat::stripe::Place;
    use crate::record::{Record, sixteen};
    use crate::simd::{Integer, Work, in_wide_vectors};

    const ROWS: usize = 3;

    /// Records of three rows, whose first word is an integer.
    #[derive(Clone, Copy)]
    struct Made<'a>(&'a [[[u32; LANES]; ROWS]]);

    impl Records<ROWS> for Made<'_> {
        #[inline(always)]
        fn len(&self) -> usize {
            self.0.len()
        }

        #[inline(always)]
        fn some<const N: usize>(&mut self, nth: usize, to: &mut impl Rows) -> Option<()> {
            for record in self.0.split_arrays::<N>().0.get(nth)? {
                let mut record = Record::from(record.map(Lanes::new));
                record.integers[0] = Some(Integer::new::<{ LANES - 1 }>(record.rows[0]));
                record.give(to);
            }
            Some(())
        }
    }

    struct Dealing<'p, 'a, 'b>(&'p mut StripeWriter<'a, 'b>, Made<'p>);

    impl Work for Dealing<'_, '_, '_> {
        type Output = ();

        #[inline(always)]
        fn run<V: Vectors>(mut self, vectors: V) {
            self.0.write(vectors, &mut self.1);
        }
    }

    proptest! {
        /// Covers stripes that no profile has, and some that a profile has.
        #[test]
        fn every_beat_goes_where_the_definition_says(
            records in prop::collection::vec(prop::array::uniform3(any::<[u32; LANES]>()), 0..100),
            streams in prop::sample::select(vec![
                &[1, 0][..], &[0, 1, 1], &[3, 2, 1, 0, 0, 1], &[0, 0, 0, 1, 1, 1, 2], &[2], &[0, 1],
            ]),
            padded in any::<bool>(),
            format in prop::sample::select(StreamFormat::ALL.to_vec()),
        ) {
            let layout = Layout { rows: ROWS, format, stripe: Stripe { streams, padded } };
            // The segments are full of ones, so that a missing beat shows.
            let mut segments: Vec<Vec<Beat>> = (0..4)
                .map(|channel| vec![Beat([u32::MAX; LANES]); layout.beats_on_channel(records.len(), channel)])
                .collect();
            let mut channels: Vec<&mut [Beat]> = segments.iter_mut().map(Vec::as_mut_slice).collect();
            let mut dealer = StripeWriter::new(&layout, &mut channels);
            for block in records.chunks(BLOCK) {
                in_wide_vectors(Dealing(&mut dealer, Made(block)));
            }
            let sum = dealer.finish();

            // The expected beats are made row by row, and each conversion has one row alone.
            let rows: Vec<[u32; LANES]> = records.iter().flatten().copied().collect();
            let mut beats = vec![Beat::default(); layout.beats(records.len())];
            for (at, row) in rows.iter().enumerate() {
                match format {
                    StreamFormat::F32 => beats[at] = Beat(*row),
                    StreamFormat::Binary16 => {
                        let integer = at % ROWS == 0;
                        let row = narrowed(*row, integer).map(u32::from);
                        let to = &mut beats[at / 2].0[at % 2 * 2..][..2];
                        to.copy_from_slice(&[row[0] | row[1] << 16, row[2] | row[3] << 16]);
                    }
                }
            }
            let mut expected: Vec<Vec<Beat>> =
                segments.iter().map(|segment| vec![Beat::default(); segment.len()]).collect();
            for (at, beat) in beats.iter().enumerate() {
                let Place { channel, slot } = layout.place(at);
                expected[channel][slot] = *beat;
            }
            prop_assert_eq!(&segments, &expected);
            let words = expected.iter().flatten().flat_map(|beat| beat.0);
            prop_assert_eq!(sum, words.fold(0, u32::wrapping_add));
        }
    }

    fn narrowed(row: [u32; LANES], integer: bool) -> [u16; LANES] {
        struct One([u32; LANES], bool);
        impl Work for One {
            type Output = [u16; LANES];

            #[inline(always)]
            fn run<V: Vectors>(self, vectors: V) -> [u16; LANES] {
                let Self(row, integer) = self;
                let numbers = Lanes::new(row);
                let integer = integer.then(|| Integer::new::<{ LANES - 1 }>(numbers));
                let [narrow, _] = sixteen::narrow(vectors, [Row { numbers, integer }, Row::zero()]);
                narrow
            }
        }
        in_wide_vectors(One(row, integer))
    }
}
