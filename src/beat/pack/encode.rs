//! Makes the records of a block of collisions, and screens them on the way.

use pgs_interface::record::{CONTACT_POINTS, collision};

use crate::beat::format::Records;
use crate::record::body_table::{End, Lookup};
use crate::record::largest::MAGNITUDE;
use crate::record::source::{CollisionSource, Next};
use crate::record::{self, Counted, FULL, Record, Rows};
use crate::scene::Collision;
use crate::simd::Lanes;
use crate::validate::{Block, Locations, Look, Quick};

/// The sampling distance of [`most_are_full`]: eight samples in a block that is checked, two in a
/// block of copies of a caller's collisions.
const SAMPLED: usize = 15;

/// Whether most of these collisions have all contact points, according to a sample. One sample in
/// eight may have fewer, as a mispredicted branch costs about as much as the masks of eight
/// collisions.
#[inline(always)]
pub(crate) fn most_are_full<'p>(collisions: impl CollisionSource<'p>) -> bool {
    let sampled = (0..collisions.len()).step_by(SAMPLED);
    let full =
        |nth: &usize| collisions.some::<1>(*nth).is_some_and(|[collision]| collision.count == FULL);
    let others = sampled.clone().filter(|nth| !full(nth)).count();
    others * 8 <= sampled.len()
}

/// The locations that the record of a collision holds.
#[inline(always)]
fn locations(of: Counted<'_>, ends: [&End; 2]) -> Locations {
    let record = record::collision::encode(of, ends);
    let [_, a, b, points @ ..] = record.rows;
    let magnitudes = points.map(|point| point.and(Lanes::all(MAGNITUDE)));
    let [of_a, of_b] = [a, b].map(|position| position.and(magnitude_of_vec3()));
    let sum = added(magnitudes).plus_f32(of_a.plus_f32(of_b));
    Locations { positions: [a, b], points, sum }
}

/// The sum of magnitudes.
#[inline(always)]
fn added([first, second, third, fourth]: [Lanes; CONTACT_POINTS]) -> Lanes {
    first.plus_f32(second).plus_f32(third.plus_f32(fourth))
}

/// The mask of the magnitudes of a vec3. It clears the word beside the vec3.
#[inline(always)]
fn magnitude_of_vec3() -> Lanes {
    Lanes::new([MAGNITUDE, MAGNITUDE, MAGNITUDE, 0])
}

/// The ends of a collision's bodies.
#[inline(always)]
fn both<'a>(ends: impl Lookup<'a>, collision: &Collision) -> [&'a End; 2] {
    [ends.get(collision.body_a), ends.get(collision.body_b)]
}

/// The records of a block of collisions. A witness sees each record, and later collisions are
/// prefetched.
///
/// `MOST_FULL` says that most collisions have all contact points. A chunk in which every collision
/// has all of them is encoded without masks. The branch for this is then mostly predicted.
#[derive(Clone, Copy)]
pub(crate) struct Encoding<L, E, W, const MOST_FULL: bool> {
    collisions: L,
    ends: E,
    witness: W,
}

impl<'p, L: CollisionSource<'p>, E: Lookup<'p>, W, const MOST_FULL: bool>
    Encoding<L, E, W, MOST_FULL>
{
    /// The records of a block. Their bodies are looked up in `ends`.
    #[inline(always)]
    pub(crate) fn new(block: &Block<'p, L>, ends: E, witness: W) -> Self {
        Self { collisions: block.collisions, ends, witness }
    }
}

/// Observes the records as they are made. Every implementation carries `#[inline(always)]`.
pub(crate) trait Witness: Copy {
    /// Sees a collision and the ends of its bodies, which its record is made from.
    fn see(&mut self, of: Counted<'_>, ends: [&End; 2]);
}

/// Packs without a check.
impl Witness for () {
    #[inline(always)]
    fn see(&mut self, _: Counted<'_>, _: [&End; 2]) {}
}

/// Checks collisions as validation does.
impl<const REACHES: bool> Witness for Look<REACHES> {
    #[inline(always)]
    fn see(&mut self, of: Counted<'_>, ends: [&End; 2]) {
        self.take(of, ends, &locations(of, ends));
    }
}

impl<'p, L: CollisionSource<'p>, E: Lookup<'p>, const REACHES: bool, const MOST_FULL: bool>
    Encoding<L, E, Look<REACHES>, MOST_FULL>
{
    /// Whether validation accepts the whole block, whose records must all be made before the call;
    /// and the number of collisions that are padding.
    #[inline(always)]
    pub(crate) fn good(self, quick: &Quick<'_>, block: &Block<'p, L>) -> (bool, usize) {
        let Self { ends, witness, .. } = self;
        // The witness reads these only if every record was made from its own bodies' ends, or is
        // padding.
        let locations = block
            .collisions
            .iter()
            .map(|collision| locations(collision.into(), both(ends, collision)));
        witness.good(quick, block, ends, locations)
    }
}

/// Does `$work` for each index below `$count`, written out. The compiler does not unroll a loop of
/// this size, and the rows would go through memory.
macro_rules! each {
    ($count:ident, $at:ident => $work:expr) => {
        each!($count, $at => $work; 0 1 2 3 4)
    };
    ($count:ident, $at:ident => $work:expr; $($nth:literal)*) => {
        const { assert!($count <= [$($nth),*].len(), "all of them are written out") };
        // An index beyond the count is not compiled.
        $(if const { $nth < $count } {
            let $at = $nth;
            $work;
        })*
    };
}

impl<'p, L, E: Lookup<'p>, W: Witness, const MOST_FULL: bool> Encoding<L, E, W, MOST_FULL> {
    /// The record of one collision of the block, which the witness sees.
    #[inline(always)]
    fn record(&mut self, of: Counted<'_>) -> Record<{ collision::ROWS }> {
        let ends = both(self.ends, of.collision);
        let record = record::collision::encode(of, ends);
        self.witness.see(of, ends);
        record
    }
}

impl<'p, L, E, W, const MOST_FULL: bool> Records<{ collision::ROWS }>
    for Encoding<L, E, W, MOST_FULL>
where
    L: CollisionSource<'p>,
    E: Lookup<'p>,
    W: Witness,
{
    #[inline(always)]
    fn len(&self) -> usize {
        self.collisions.len()
    }

    #[inline(always)]
    fn some<const N: usize>(&mut self, nth: usize, to: &mut impl Rows) -> Option<()> {
        let Next { these, soon } = self.collisions.next::<N>(nth)?;
        if let Some(soon) = soon {
            for collision in soon {
                self.ends.soon([collision.body_a, collision.body_b]);
            }
        }
        if MOST_FULL && these.iter().all(|collision| collision.count == FULL) {
            each!(N, at => self.record(Counted::full(these[at])).give(to));
        } else {
            each!(N, at => self.record(these[at].into()).give(to));
        }
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::source::Contiguous;

    #[test]
    fn most_are_full_where_few_of_those_looked_at_are_not() {
        let full = Collision { count: FULL, ..Collision::NOTHING };
        let mut collisions = vec![full; 16 * SAMPLED];
        let most = |collisions: &[Collision]| most_are_full(Contiguous(collisions));
        assert!(most(&collisions) && most(&[]) && most(&[full]));
        assert!(!most(&[Collision::NOTHING]));
        for (nth, count) in [(0, 3), (15, 5)] {
            collisions[nth * SAMPLED].count = count;
            assert!(most(&collisions), "{nth}");
        }
        collisions[7 * SAMPLED].count = 0;
        assert!(!most(&collisions));
    }
}
