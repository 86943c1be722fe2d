//! This file deals collisions out without making records of them: feature `bench`.
//!
//! Every word of each is read and as many bytes go to the channels as its record has, in the same loops of
//! units; nothing is looked up and nothing converted. Packing cannot take less.

use bitstream_model::interface::profile::{Geometry, Variant};
use bitstream_model::interface::record::{Beat, LANES, collision, relative};

use super::pattern::{self, Pattern, Places};
use super::stripe::{Place, Segment};
use super::unit::part;
use crate::platform::{Lanes, Vectors, Work, in_wide_vectors};
use crate::scene::{Collision, Collisions, InArray, InOrder, Lying, Next, Structures};

/// Deals out all collisions but what fills no unit; how many these are. None of a stripe that no profile has,
/// and where they lie nowhere as structures.
///
/// Shape: each channel is as long as [`Layout::beats_on_channel`](super::stripe::Layout::beats_on_channel)
/// says of their records.
pub(crate) fn deal<C: Collisions + ?Sized>(
    variant: &Variant,
    collisions: &C,
    channels: &mut [&mut [Beat]],
) -> usize {
    match collisions.structures() {
        Some(Structures::Array(all)) => lying(variant, InArray(all), channels),
        Some(Structures::Ordered { all, order }) => {
            let order = InOrder::new(all, order);
            match order.nearby(0) {
                Some(order) => lying(variant, order, channels),
                None => lying(variant, order, channels),
            }
        }
        None => 0,
    }
}

fn lying<'p, L: Lying<'p>>(
    variant: &Variant,
    collisions: L,
    channels: &mut [&mut [Beat]],
) -> usize {
    let layout = Segment::Collisions.layout(variant);
    let Some((pattern, first)) = Pattern::of(layout.stripe.streams) else { return 0 };
    let rest = channels.get_mut(first..).unwrap_or_default();
    match (variant.profile.geometry, layout.rows_per_beat()) {
        (Geometry::Absolute, 1) => {
            in_wide_vectors(Dealing::<_, { collision::ROWS }, 1> { pattern, collisions, rest })
        }
        (Geometry::Absolute, _) => {
            in_wide_vectors(Dealing::<_, { collision::ROWS }, 2> { pattern, collisions, rest })
        }
        (Geometry::Relative, 1) => {
            in_wide_vectors(Dealing::<_, { relative::ROWS }, 1> { pattern, collisions, rest })
        }
        (Geometry::Relative, _) => {
            in_wide_vectors(Dealing::<_, { relative::ROWS }, 2> { pattern, collisions, rest })
        }
    }
}

/// Collisions, and where they go: as many bytes as records of `ROWS` rows have, so many a beat.
struct Dealing<'c, 'b, L, const ROWS: usize, const PER_BEAT: usize> {
    pattern: Pattern,
    collisions: L,
    rest: &'c mut [&'b mut [Beat]],
}

impl<'p, L: Lying<'p>, const ROWS: usize, const PER_BEAT: usize> Work
    for Dealing<'_, '_, L, ROWS, PER_BEAT>
{
    type Output = usize;

    #[inline(always)]
    fn run<V: Vectors>(self, vectors: V) -> usize {
        let Self { pattern, collisions, rest } = self;
        macro_rules! unit {
            ($places:ident: $records:literal are $beats:literal: $($channel:ident $share:literal),*) => {
                if const { $records * ROWS == $beats * PER_BEAT } {
                    return vectors.apart(move || {
                        let count = collisions.len() / $records;
                        let mut rest = rest.iter_mut();
                        $(let Some($channel) = part::<$share>(rest.next(), count) else { return 0 };)*
                        for at in 0..count {
                            let Some(Next { these, .. }) = collisions.next::<$records>(at) else { break };
                            let beats: [Lanes; $beats] = folded(these);
                            let to = [$(&mut $channel[at][..]),*];
                            let places = <pattern::$places as Places<$beats>>::PLACES;
                            for (beat, Place { channel, slot }) in beats.into_iter().zip(places) {
                                to[channel][slot] = beat.into();
                            }
                        }
                        count * $records
                    });
                }
            };
        }
        pattern::units!(pattern, unit);
        0
    }
}

/// All words of some collisions in so many beats, one over the other where there are more.
#[inline(always)]
fn folded<const RECORDS: usize, const BEATS: usize>(
    these: [&Collision; RECORDS],
) -> [Lanes; BEATS] {
    let mut beats = [Lanes::all(0); BEATS];
    // Loops of so much are not unrolled, and the words would go through memory.
    macro_rules! each {
        ($nth:literal: $($at:literal)*) => {
            const { assert!([$($at),*].len() == ROWS_LYING, "all of them are written out") };
            if const { $nth < RECORDS } {
                let words: &[u32; WORDS] = bytemuck::cast_ref(these[$nth]);
                $({
                    // The last one overlaps the one before it.
                    let from = const { if $at == ROWS_LYING - 1 { WORDS - LANES } else { LANES * $at } };
                    let row = words[from..].first_chunk().map_or(Lanes::all(0), |row| Lanes::new(*row));
                    let beat = &mut beats[const { ($nth * ROWS_LYING + $at) % BEATS }];
                    *beat = beat.or(row);
                })*
            }
        };
    }
    const { assert!(RECORDS <= 5, "all of them are written out") };
    each!(0: 0 1 2 3 4 5);
    each!(1: 0 1 2 3 4 5);
    each!(2: 0 1 2 3 4 5);
    each!(3: 0 1 2 3 4 5);
    each!(4: 0 1 2 3 4 5);
    beats
}

/// Words of a collision as it lies, and rows with all of these.
const WORDS: usize = size_of::<Collision>() / 4;
const ROWS_LYING: usize = WORDS.div_ceil(LANES);

#[cfg(test)]
mod tests {
    use bitstream_model::interface::address_map::DMA_COUNT_MAX;
    use bitstream_model::interface::profile::PROFILES;

    use super::*;

    fn dealt(variant: &Variant, collisions: &[Collision]) -> (usize, Vec<Vec<Beat>>) {
        let layout = Segment::Collisions.layout(variant);
        let beats = |channel| layout.beats_on_channel(collisions.len(), channel);
        let mut channels: Vec<_> =
            (0..DMA_COUNT_MAX).map(|channel| vec![Beat([1; LANES]); beats(channel)]).collect();
        let mut all: Vec<&mut [Beat]> = channels.iter_mut().map(Vec::as_mut_slice).collect();
        let count = deal(variant, collisions, &mut all);
        (count, channels)
    }

    #[test]
    fn every_word_is_read_and_every_beat_written() {
        const COUNT: usize = 12;
        for profile in PROFILES {
            let variant = profile.default_variant();
            let nothing = vec![Collision::NOTHING; COUNT];
            let (count, zeros) = dealt(&variant, &nothing);
            assert_eq!(count, COUNT, "{}", profile.name);
            assert!(
                zeros.iter().flatten().all(|beat| *beat == Beat::default()),
                "{}",
                profile.name
            );
            for word in 0..WORDS {
                let mut collisions = nothing.clone();
                bytemuck::cast_mut::<_, [u32; WORDS]>(&mut collisions[COUNT - 1])[word] = 1;
                assert!(dealt(&variant, &collisions).1 != zeros, "{} {word}", profile.name);
            }
        }
    }
}
