//! The yardstick of the packing benchmark: deals collisions out without making records of them.
//!
//! The loops of [units](super::pack::unrolled) read every word of a collision and write as many
//! bytes as its record has. They look up no body, and mask, convert and check nothing. Packing can
//! hardly take less time.

use pgs_interface::profile::Variant;
use pgs_interface::record::{Beat, LANES, collision};

use super::format::{Join, Records};
use super::pack::encode::each;
use super::pack::pattern::Pattern;
use super::pack::unrolled;
use super::stripe::Segment;
use crate::record::source::{CollisionSource, Contiguous, Indexed, Next};
use crate::record::{Record, Row, Rows};
use crate::scene::{Collision, Collisions, Structures};
use crate::simd::{Lanes, Vectors, Work, in_wide_vectors};

/// Deals out all collisions except a rest at the end that fills no unit, and returns their number.
/// Returns 0 for a stripe of no profile, and for collisions that do not lie in memory as
/// structures.
///
/// Shape: each channel is as long as
/// [`Layout::beats_on_channel`](super::stripe::Layout::beats_on_channel) says for these collisions.
pub(crate) fn deal<C: Collisions + ?Sized>(
    variant: &Variant,
    collisions: &C,
    channels: &mut [&mut [Beat]],
) -> usize {
    // The channels have room for `collisions.len()` records, and for no other number.
    match collisions.structures().filter(|all| all.len() == collisions.len()) {
        Some(Structures::Array(all)) => dealt(variant, Contiguous(all), channels),
        Some(Structures::Ordered { all, order }) => {
            let order = Indexed::new(all, order);
            match order.nearby(0) {
                Some(order) => dealt(variant, order, channels),
                None => dealt(variant, order, channels),
            }
        }
        None => 0,
    }
}

fn dealt<'p, L: CollisionSource<'p>>(
    variant: &Variant,
    collisions: L,
    channels: &mut [&mut [Beat]],
) -> usize {
    let layout = Segment::Collisions.layout(variant);
    let Some((pattern, first)) = Pattern::of(layout.stripe.streams) else { return 0 };
    let rest = channels.get_mut(first..).unwrap_or_default();
    let per_beat = layout.rows_per_beat();
    in_wide_vectors(Dealing { per_beat, pattern, collisions, rest })
}

/// Collisions, and where they go.
struct Dealing<'c, 'b, L> {
    per_beat: usize,
    pattern: Pattern,
    collisions: L,
    rest: &'c mut [&'b mut [Beat]],
}

impl<'p, L: CollisionSource<'p>> Work for Dealing<'_, '_, L> {
    type Output = usize;

    #[inline(always)]
    fn run<V: Vectors>(self, vectors: V) -> usize {
        let Self { per_beat, pattern, collisions, rest } = self;
        let (records, sum) = (&mut AsTheyLie(collisions), &mut Lanes::all(0));
        macro_rules! written {
            ($join:ty) => {
                unrolled::write::<V, $join, _, { collision::ROWS }>(
                    pattern, vectors, records, rest, sum,
                )
            };
        }
        match per_beat {
            1 => written!(Alone),
            _ => written!(Folded),
        }
    }
}

/// A row is a beat.
struct Alone;

impl Join for Alone {
    const PER_BEAT: usize = 1;

    #[inline(always)]
    fn beat<V: Vectors>(_: V, [row, _]: [Row; 2]) -> Beat {
        row.numbers.into()
    }
}

/// The bitwise OR of two rows is a beat, so that all words of both rows are read.
struct Folded;

impl Join for Folded {
    const PER_BEAT: usize = 2;

    #[inline(always)]
    fn beat<V: Vectors>(_: V, [first, second]: [Row; 2]) -> Beat {
        first.numbers.or(second.numbers).into()
    }
}

/// The words of collisions as they lie in memory, in `ROWS` rows each.
#[derive(Clone, Copy)]
struct AsTheyLie<L>(L);

impl<'p, L: CollisionSource<'p>, const ROWS: usize> Records<ROWS> for AsTheyLie<L> {
    #[inline(always)]
    fn len(&self) -> usize {
        self.0.len()
    }

    #[inline(always)]
    fn some<const N: usize>(&mut self, nth: usize, to: &mut impl Rows) -> Option<()> {
        let Next { these, .. } = self.0.next::<N>(nth)?;
        each!(N, at => Record::<ROWS>::from(rows(these[at])).give(to));
        Some(())
    }
}

/// Words of a collision.
const WORDS: usize = size_of::<Collision>() / 4;

/// All words of a collision. A row that would pass the end holds the last four words.
#[inline(always)]
fn rows<const ROWS: usize>(collision: &Collision) -> [Lanes; ROWS] {
    const { assert!(ROWS * LANES >= WORDS, "all are there") };
    let words: &[u32; WORDS] = bytemuck::cast_ref(collision);
    let mut rows = [Lanes::all(0); ROWS];
    for (at, row) in rows.iter_mut().enumerate() {
        let from = (at * LANES).min(WORDS - LANES);
        *row = words[from..].first_chunk().map_or(*row, |words| Lanes::new(*words));
    }
    rows
}

#[cfg(test)]
mod tests {
    use pgs_interface::address_map::DMA_COUNT_MAX;
    use pgs_interface::profile::PROFILES;

    use super::*;
    use crate::order::{Ordered, Schedule};

    fn channels<C: Collisions + ?Sized>(
        variant: &Variant,
        collisions: &C,
    ) -> (usize, Vec<Vec<Beat>>) {
        let layout = Segment::Collisions.layout(variant);
        let beats = |channel| layout.beats_on_channel(collisions.len(), channel);
        let mut channels: Vec<_> =
            (0..DMA_COUNT_MAX).map(|channel| vec![Beat([1; LANES]); beats(channel)]).collect();
        let mut all: Vec<&mut [Beat]> = channels.iter_mut().map(Vec::as_mut_slice).collect();
        let count = deal(variant, collisions, &mut all);
        (count, channels)
    }

    /// Divisible by the records of a unit of every stripe.
    const COUNT: usize = 60;

    #[test]
    fn every_word_is_read_and_every_beat_written() {
        for profile in PROFILES {
            let variant = profile.default_variant();
            let nothing = vec![Collision::NOTHING; COUNT];
            let (count, zeros) = channels(&variant, &nothing);
            assert_eq!(count, COUNT, "{}", profile.name);
            assert!(
                zeros.iter().flatten().all(|beat| *beat == Beat::default()),
                "{}",
                profile.name
            );
            // The last five collisions cover every position in a unit.
            for (nth, word) in
                (COUNT - 5..COUNT).flat_map(|nth| (0..WORDS).map(move |it| (nth, it)))
            {
                let mut collisions = nothing.clone();
                bytemuck::cast_mut::<_, [u32; WORDS]>(&mut collisions[nth])[word] = 1;
                let (_, found) = channels(&variant, &collisions);
                assert!(found != zeros, "{} {nth} {word}", profile.name);
            }
        }
    }

    /// One order reverses the list, the other swaps neighbours.
    #[test]
    fn collisions_in_an_order_are_dealt_out_in_it() {
        const MANY: u32 = 12_000;
        let one = |body_a| Collision { body_a, ..Collision::NOTHING };
        let list: Vec<Collision> = (1..).map(one).take(MANY as usize).collect();
        let turned: Vec<u32> = (0..MANY).rev().collect();
        let swapped: Vec<u32> = (0..MANY).map(|at| at ^ 1).collect();
        for order in [turned, swapped] {
            let schedule: Schedule = order.iter().copied().map(Some).collect();
            let there: Vec<Collision> = order.iter().map(|at| list[*at as usize]).collect();
            for profile in PROFILES {
                let variant = profile.default_variant();
                let ordered = Ordered { collisions: &list, schedule: &schedule };
                let (expected, found) = (channels(&variant, &there), channels(&variant, &ordered));
                assert!(found == expected, "{}", profile.name);
            }
        }
    }

    /// A caller's container may contradict itself.
    #[test]
    fn what_lies_there_is_as_many_as_are_told() {
        struct Wrong(Vec<Collision>);
        impl Collisions for Wrong {
            fn len(&self) -> usize {
                self.0.len() - 1
            }

            fn collision(&self, index: usize) -> Collision {
                self.0[index]
            }

            fn structures(&self) -> Option<Structures<'_>> {
                Some(Structures::Array(&self.0))
            }
        }
        let variant = PROFILES[0].default_variant();
        assert_eq!(channels(&variant, &Wrong(vec![Collision::NOTHING; COUNT])).0, 0);
    }
}
