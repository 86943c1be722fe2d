//! Reads results from the channels, stripe by stripe. The stripes of the profiles are constants of
//! the compiler.
//!
//! The beats of a unit go from the channels through registers into its records, upwards on each
//! channel, without a copy in between.

use pgs_interface::record::{Beat, result};
use pgs_support::chunks::Chunks;

use crate::beat::format::Format;
use crate::beat::pack::pattern::{self, Pattern, Places};
use crate::beat::stripe::Place;
use crate::record::finite::Finite;
use crate::record::result::Record;
use crate::simd::{Lanes, Vectors};

/// The sum and the check for finite numbers of the records read so far.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tally {
    pub(crate) sum: Lanes,
    pub(crate) finite: Finite,
}

impl Tally {
    /// Decodes the record of these beats, and counts it.
    #[inline(always)]
    pub(crate) fn record<V: Vectors, F: Format>(&mut self, vectors: V, beats: &[Beat]) -> Record {
        for beat in beats {
            self.sum = self.sum.plus((*beat).into());
        }
        let rows = F::wide::<V, { result::ROWS }>(vectors, beats);
        self.finite.see(&rows);
        rows.map(Beat::from)
    }
}

/// Reads the records that fill whole units, and returns their number. `rest` is the unread part of
/// the channels, from the first channel of the stripe on.
#[inline(always)]
pub(crate) fn read<V: Vectors, F: Format>(
    pattern: Pattern,
    vectors: V,
    rest: &mut [&[Beat]],
    records: &mut [Record],
    tally: &mut Tally,
) -> usize {
    macro_rules! unit {
        ($places:ident: $records:literal are $beats:literal: $($channel:ident $share:literal),*) => {
            if $records * result::ROWS == $beats * F::PER_BEAT {
                let units = records.split_arrays_mut::<$records>().0;
                let count = units.len();
                let mut rest = rest.iter_mut();
                $(let Some($channel) = part::<$share>(rest.next(), count) else { return 0 };)*
                const CHANNELS: usize = [$($share),*].len();
                for at in 0..count {
                    units[at] = read_unit::<pattern::$places, V, F, $records, $beats, CHANNELS>(
                        vectors, [$(&$channel[at]),*], tally,
                    );
                }
                return count * $records;
            }
        };
    }
    pattern::units!(pattern, unit);
    0
}

/// The next `count` times `S` beats of a channel.
#[inline(always)]
fn part<'b, const S: usize>(
    rest: Option<&mut &'b [Beat]>,
    count: usize,
) -> Option<&'b [[Beat; S]]> {
    let rest = rest?;
    let (part, behind) = rest.split_at(count * S);
    *rest = behind;
    part.split_arrays().0.get(..count)
}

/// Reads one unit.
#[inline(always)]
fn read_unit<
    P: Places<BEATS>,
    V: Vectors,
    F: Format,
    const RECORDS: usize,
    const BEATS: usize,
    const CHANNELS: usize,
>(
    vectors: V,
    from: [&[Beat]; CHANNELS],
    tally: &mut Tally,
) -> [Record; RECORDS] {
    let mut beats = [Beat::default(); BEATS];
    for (beat, Place { channel, slot }) in beats.iter_mut().zip(P::PLACES) {
        *beat = from[channel][slot];
    }
    let mut records = [Record::default(); RECORDS];
    for (record, beats) in records.iter_mut().zip(beats.chunks_exact(BEATS / RECORDS)) {
        *record = tally.record::<V, F>(vectors, beats);
    }
    records
}

#[cfg(test)]
mod tests {
    use pgs_interface::profile::PROFILES;

    use super::*;
    use crate::beat::format::in_format;
    use crate::beat::stripe::BLOCK;
    use crate::beat::stripe::{Layout, Segment};
    use crate::simd::{Work, in_wide_vectors};

    /// Counts the records of a layout that are read by units.
    struct Read(Layout);

    impl Work for Read {
        type Output = usize;

        #[inline(always)]
        fn run<V: Vectors>(self, vectors: V) -> usize {
            let Self(layout) = self;
            let (pattern, _) = Pattern::of(layout.stripe.streams).expect("a known one");
            let beats = [Beat::default(); BLOCK * result::ROWS];
            let rest = &mut [&beats[..]; 4];
            let records = &mut [Record::default(); BLOCK];
            let tally = &mut Tally { sum: Lanes::all(0), finite: Finite::new() };
            in_format!(layout.format, F => {
                read::<V, F>(pattern, vectors, rest, records, tally)
            })
        }
    }

    /// Records outside of units would be as right, and slower.
    #[test]
    fn all_results_of_the_profiles_are_read_by_units() {
        for profile in PROFILES {
            let layout = Segment::Results.layout(&profile.default_variant());
            assert_eq!(in_wide_vectors(Read(layout)), BLOCK, "{}", profile.name);
        }
    }
}
