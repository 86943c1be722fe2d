//! This file makes the records of a block of collisions, and has them looked at on their way.

use bitstream_model::interface::record::{collision, relative};

use super::format::{Format, Records};
use crate::platform::Lanes;
use crate::record::end::{End, Ends, Lookup};
use crate::record::{self, Integer, Record, Rows};
use crate::scene::validate::{Block, Look, Quick, Reach};
use crate::scene::{Collision, Lying, Next};

/// A kind of collision record of `ROWS` rows.
pub(super) trait Kind<const ROWS: usize>: Copy {
    /// Where the bodies of a collision are looked up whose record is sent in a format.
    type Among<'a, F: Format>: Lookup<'a>;

    /// The record of collision `index`.
    fn encode(self, index: usize, from: &Collision, ends: [&End; 2]) -> Record<ROWS>;

    /// Bits where a number is beyond what the stream holds.
    fn beyond(quick: &Quick<'_>, record: &[Lanes; ROWS], count: u32) -> Lanes;

    /// How far the contact points are.
    fn reach(record: &[Lanes; ROWS], count: u32) -> Reach;
}

/// Records in world coordinates.
#[derive(Clone, Copy)]
pub(super) struct Absolute;

impl Kind<{ collision::ROWS }> for Absolute {
    type Among<'a, F: Format> = F::Among<'a>;

    #[inline(always)]
    fn encode(self, _: usize, from: &Collision, ends: [&End; 2]) -> Record<{ collision::ROWS }> {
        record::collision::encode(from, ends)
    }

    #[inline(always)]
    fn beyond(quick: &Quick<'_>, record: &[Lanes; collision::ROWS], _: u32) -> Lanes {
        quick.beyond_absolute(record)
    }

    #[inline(always)]
    fn reach([_, a, b, points @ ..]: &[Lanes; collision::ROWS], count: u32) -> Reach {
        Reach::new([*a, *b], *points, count)
    }
}

/// Records relative to body A.
#[derive(Clone, Copy)]
pub(super) struct Relative;

impl Kind<{ relative::ROWS }> for Relative {
    type Among<'a, F: Format> = F::Among<'a>;

    #[inline(always)]
    fn encode(self, _: usize, from: &Collision, ends: [&End; 2]) -> Record<{ relative::ROWS }> {
        of_bodies(from, ends, || record::bodies(from))
    }

    #[inline(always)]
    fn beyond(quick: &Quick<'_>, record: &[Lanes; relative::ROWS], count: u32) -> Lanes {
        quick.beyond_relative(record, count)
    }

    #[inline(always)]
    fn reach([_, offset, points @ ..]: &[Lanes; relative::ROWS], count: u32) -> Reach {
        Reach::new([Lanes::all(0), *offset], *points, count)
    }
}

/// The relative record whose indices are these. They are asked for where they are needed: made earlier, they
/// would hold registers until then.
#[inline(always)]
fn of_bodies(
    from: &Collision,
    [a, b]: [&End; 2],
    bodies: impl FnOnce() -> [Integer; 2],
) -> Record<{ relative::ROWS }> {
    // Whether it does is mostly foreseen, as few collisions are with what never moves or nearly all are: a
    // jump costs less then than to choose.
    let ends = if a.is_static() | b.is_static() { anchors(a, b) } else { [a, b] };
    record::relative::encode(from, ends, bodies())
}

/// The ends that a record is made from where one never moves.
#[cold]
#[inline(never)]
fn anchors<'a>(a: &'a End, b: &'a End) -> [&'a End; 2] {
    record::relative::anchors([a, b], [!a.is_static(), !b.is_static()])
}

/// The same, with these words in place of the indices of each one's bodies.
#[derive(Clone, Copy)]
pub(super) struct Worded<'a>(pub(super) &'a [[u32; 2]]);

impl Kind<{ relative::ROWS }> for Worded<'_> {
    /// The words are short and the indices are not: there may be more bodies than sixteen bits name.
    type Among<'a, F: Format> = Ends<'a>;

    #[inline(always)]
    fn encode(self, index: usize, from: &Collision, ends: [&End; 2]) -> Record<{ relative::ROWS }> {
        let [word_a, word_b] = self.0[index];
        let words = Lanes::new([word_a, word_b, 0, 0]);
        of_bodies(from, ends, || [Integer::new::<0>(words), Integer::new::<1>(words)])
    }

    #[inline(always)]
    fn beyond(quick: &Quick<'_>, record: &[Lanes; relative::ROWS], count: u32) -> Lanes {
        Relative::beyond(quick, record, count)
    }

    #[inline(always)]
    fn reach(record: &[Lanes; relative::ROWS], count: u32) -> Reach {
        Relative::reach(record, count)
    }
}

/// The ends of a collision's bodies.
#[inline(always)]
fn both<'a>(ends: impl Lookup<'a>, collision: &Collision) -> [&'a End; 2] {
    [ends.get(collision.body_a), ends.get(collision.body_b)]
}

/// The records of a block of collisions. What is behind it is fetched meanwhile.
#[derive(Clone, Copy)]
pub(super) struct Encoding<K, L, E> {
    kind: K,
    first: usize,
    collisions: L,
    ends: E,
}

impl<'p, K, L: Lying<'p>, E: Lookup<'p>> Encoding<K, L, E> {
    /// Those of a block, whose bodies are looked up here.
    #[inline(always)]
    pub(super) fn new(kind: K, block: &Block<'p, L>, ends: E) -> Self {
        let Block { first, collisions, .. } = *block;
        Self { kind, first, collisions, ends }
    }

    /// Gives the rows of the `nth` so many records to `to`; `witness` sees each.
    #[inline(always)]
    fn give<W: Witness<K, ROWS>, const ROWS: usize, const N: usize>(
        &self,
        nth: usize,
        to: &mut impl Rows,
        witness: &mut W,
    ) -> Option<()>
    where
        K: Kind<ROWS>,
    {
        let Next { these, soon } = self.collisions.next::<N>(nth, W::SLOW)?;
        if let Some(soon) = soon {
            for collision in soon {
                self.ends.soon([collision.body_a, collision.body_b]);
            }
        }
        let first = self.first + nth * N;
        // A loop of so much is not unrolled, and its rows would go through memory.
        macro_rules! each {
            ($($at:literal)*) => {
                const { assert!(N <= [$($at),*].len(), "all of them are written out") };
                // What there is not is not compiled.
                $(if const { $at < N } {
                    let collision = these[$at];
                    let ends = both(self.ends, collision);
                    let record = self.kind.encode(first + $at, collision, ends);
                    let theirs = self.ends.by_all_bits([collision.body_a, collision.body_b]);
                    witness.see(&record, collision, ends, theirs);
                    record.give(to);
                })*
            };
        }
        each!(0 1 2 3 4);
        Some(())
    }
}

/// Who sees the records on their way. An `#[inline(always)]` belongs to every implementation.
trait Witness<K: Kind<ROWS>, const ROWS: usize> {
    /// Whether that takes longer than to make the record.
    const SLOW: bool;

    /// Sees the record of a collision. These are the ends it was made of: whether they are `theirs`, the
    /// bodies' of the collision, is sure or not.
    fn see(&mut self, record: &Record<ROWS>, collision: &Collision, ends: [&End; 2], theirs: bool);
}

/// Nobody.
impl<K: Kind<ROWS>, const ROWS: usize> Witness<K, ROWS> for () {
    const SLOW: bool = false;

    #[inline(always)]
    fn see(&mut self, _: &Record<ROWS>, _: &Collision, _: [&End; 2], _: bool) {}
}

impl<'p, K: Kind<ROWS>, L: Lying<'p>, E: Lookup<'p>, const ROWS: usize> Records<ROWS>
    for Encoding<K, L, E>
{
    #[inline(always)]
    fn len(&self) -> usize {
        self.collisions.len()
    }

    #[inline(always)]
    fn some<const N: usize>(&mut self, nth: usize, to: &mut impl Rows) -> Option<()> {
        self.give::<(), ROWS, N>(nth, to, &mut ())
    }
}

/// Whoever looks at them as validation does.
#[derive(Clone, Copy)]
struct Looking<'p> {
    quick: &'p Quick<'p>,
    look: Look<'p>,
    scheduled: bool,
}

impl<K: Kind<ROWS>, const ROWS: usize> Witness<K, ROWS> for Looking<'_> {
    const SLOW: bool = true;

    #[inline(always)]
    fn see(&mut self, record: &Record<ROWS>, collision: &Collision, ends: [&End; 2], theirs: bool) {
        self.look.head(collision, ends, theirs, self.scheduled);
        self.look.numbers(K::beyond(self.quick, &record.rows, collision.count));
        if self.look.asks_how_far() {
            self.look.reach(&K::reach(&record.rows, collision.count), ends);
        }
    }
}

/// The same records, looked at on their way.
#[derive(Clone, Copy)]
pub(super) struct LookedAt<'p, K, L, E> {
    records: Encoding<K, L, E>,
    looking: Looking<'p>,
}

impl<'p, K: Copy, L: Lying<'p>, E: Lookup<'p>> LookedAt<'p, K, L, E> {
    #[inline(always)]
    pub(super) fn new(records: Encoding<K, L, E>, quick: &'p Quick<'p>, scheduled: bool) -> Self {
        Self { records, looking: Looking { quick, look: Look::new(quick), scheduled } }
    }

    /// How many of those taken look like padding.
    #[inline(always)]
    pub(super) fn paddings(&self) -> usize {
        self.looking.look.paddings()
    }

    /// Whether validation refuses none of the block, all of whose records were taken.
    #[inline(always)]
    pub(super) fn good<const ROWS: usize>(self, block: &Block<'p, L>) -> bool
    where
        K: Kind<ROWS>,
    {
        let Self { records: Encoding { kind, .. }, looking: Looking { look, .. } } = self;
        // These are asked for only where every record was made of its own bodies' ends, or is padding.
        let reaches = (block.first..).zip(block.collisions.iter()).map(|(index, collision)| {
            let record = kind.encode(index, collision, both(block.ends, collision));
            K::reach(&record.rows, collision.count)
        });
        look.good(block, reaches)
    }
}

impl<'p, K: Kind<ROWS>, L: Lying<'p>, E: Lookup<'p>, const ROWS: usize> Records<ROWS>
    for LookedAt<'p, K, L, E>
{
    #[inline(always)]
    fn len(&self) -> usize {
        self.records.collisions.len()
    }

    #[inline(always)]
    fn some<const N: usize>(&mut self, nth: usize, to: &mut impl Rows) -> Option<()> {
        self.records.give::<_, ROWS, N>(nth, to, &mut self.looking)
    }
}
