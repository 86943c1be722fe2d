//! Takes the impulses that come in with the collisions of a warm pass, and gives out the ones that a kind of
//! passes ends with.

use std::sync::atomic::{AtomicU32, Ordering};

use super::block::{Block, LANES, Words};
use super::{Batch, NO_SLOT};
use pgs_interface::record::{Beat, CONTACT_POINTS};
use pgs_support::lanes::{F32x16, Instructions, Quad, Work};

/// Friction impulses of a collision.
const FRICTION: usize = 2;

/// The impulses that the first pass of each kind brings for the collisions of a block.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct Given {
    pub(crate) normal: [Words; CONTACT_POINTS],
    pub(crate) friction: [Words; FRICTION],
}

impl Given {
    pub(crate) const NONE: Self =
        Self { normal: [[0.0; LANES]; CONTACT_POINTS], friction: [[0.0; LANES]; FRICTION] };

    /// The impulses of a lane, for a pass of that kind.
    pub(crate) fn of(&self, contact: bool, lane: usize) -> [f32; CONTACT_POINTS] {
        if contact {
            self.normal.map(|words| words[lane])
        } else {
            let [first, second] = self.friction.map(|words| words[lane]);
            [first, second, 0.0, 0.0]
        }
    }

    fn words(&mut self, contact: bool) -> &mut [Words] {
        if contact { &mut self.normal } else { &mut self.friction }
    }
}

/// The block that the next sixteen collisions fill in their order, if they do.
#[inline(always)]
fn whole_block(slots: &[u32]) -> Option<usize> {
    let slots: &[u32; LANES] = slots.get(..LANES)?.try_into().ok()?;
    let [first, ..] = *slots;
    // `NO_SLOT` is no multiple.
    let begins = (first as usize).is_multiple_of(LANES);
    let in_order = || slots.iter().zip(first..).all(|(slot, expected)| *slot == expected);
    (begins && in_order()).then_some(first as usize / LANES)
}

/// Puts the second beats of sixteen pairs side by side, and adds the words of each up.
struct Give<'a> {
    contact: bool,
    pairs: &'a [[Beat; 2]],
    slots: &'a [u32],
    /// The blocks from number `first` on.
    given: &'a mut [Given],
    first: usize,
    sums: &'a mut [u32],
}

impl Give<'_> {
    #[inline(always)]
    fn one_by_one(self) {
        let Self { contact, pairs, slots, given, first, sums } = self;
        for (([_, beat], slot), sum) in pairs.iter().zip(slots).zip(sums) {
            *sum = beat.0.into_iter().fold(0, u32::wrapping_add);
            let (block, lane) = (*slot as usize / LANES, *slot as usize % LANES);
            let given = block.checked_sub(first).and_then(|block| given.get_mut(block));
            if let Some(given) = given.filter(|_| *slot != NO_SLOT) {
                for (words, word) in given.words(contact).iter_mut().zip(beat.0) {
                    words[lane] = f32::from_bits(word);
                }
            }
        }
    }
}

impl Work for Give<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self, instructions: impl Instructions) {
        let Self { contact, pairs, slots, given, first, sums } = self;
        let mut at = 0;
        while at < slots.len() {
            let block = whole_block(&slots[at..]);
            let to = block.and_then(|block| given.get_mut(block.checked_sub(first)?));
            let count = if to.is_some() { LANES } else { 1 };
            let (pairs, sums) = (&pairs[at..at + count], &mut sums[at..at + count]);
            let slots = &slots[at..at + count];
            at += count;
            let Some(to) = to else {
                Give { contact, pairs, slots, given: &mut *given, first, sums }.one_by_one();
                continue;
            };
            let quads: &[Quad] = bytemuck::cast_slice(pairs);
            let columns = instructions.load(&quads[1..], 2);
            for (words, column) in to.words(contact).iter_mut().zip(columns) {
                *words = column.to_array();
            }
            let [a, b, c, d] = columns;
            let added = a.with_words(b).with_words(c.with_words(d)).to_array();
            for (sum, added) in sums.iter_mut().zip(added) {
                *sum = added.to_bits();
            }
        }
    }
}

/// Impulses that go out after the last pass of a kind: zeros for padding.
struct Outgoing<'a> {
    contact: bool,
    slots: &'a [u32],
    blocks: &'a [Block],
    to: &'a mut [Beat],
}

impl Outgoing<'_> {
    #[inline(always)]
    fn one_by_one(self) {
        let Self { contact, slots, blocks, to } = self;
        for (beat, slot) in to.iter_mut().zip(slots) {
            let (block, lane) = (*slot as usize / LANES, *slot as usize % LANES);
            let block = blocks.get(block).filter(|_| *slot != NO_SLOT);
            let words = match (contact, block.map(|block| block.impulses(lane))) {
                (_, None) => [0.0; CONTACT_POINTS],
                (true, Some(normal)) => normal,
                (false, Some([_, first, second, _])) => [first, second, 0.0, 0.0],
            };
            *beat = Beat(words.map(f32::to_bits));
        }
    }
}

impl Work for Outgoing<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self, instructions: impl Instructions) {
        let Self { contact, slots, blocks, to } = self;
        let zero = F32x16::splat(0.0);
        let mut at = 0;
        while at < slots.len() {
            let block = whole_block(&slots[at..]).and_then(|block| blocks.get(block));
            let count = if block.is_some() { LANES } else { 1 };
            let (slots, to) = (&slots[at..at + count], &mut to[at..at + count]);
            at += count;
            let Some(block) = block else {
                Outgoing { contact, slots, blocks, to }.one_by_one();
                continue;
            };
            let [a, b, c, d] = block.impulses.map(F32x16::from_array);
            let columns = if contact { [a, b, c, d] } else { [b, c, zero, zero] };
            instructions.store(columns, bytemuck::cast_slice_mut(to), 1);
        }
    }
}

/// The collisions whose impulses one thread takes or gives out at once.
const OF_THREAD: usize = 128 * LANES;

/// Neighbouring collisions, no two parts in the same block: how many, and the block behind theirs.
fn parts(slots: &[u32]) -> impl Iterator<Item = (usize, usize)> {
    let mut ends = Vec::new();
    let (mut count, mut behind) = (0, 0);
    for slots in slots.chunks(OF_THREAD) {
        let used = || slots.iter().filter(|slot| **slot != NO_SLOT);
        let first = used().min().map_or(behind, |slot| *slot as usize / LANES);
        if first >= behind && count > 0 {
            ends.push((count, behind));
            count = 0;
        }
        count += slots.len();
        behind = used().max().map_or(behind, |slot| behind.max(*slot as usize / LANES + 1));
    }
    ends.push((count, behind));
    ends.into_iter()
}

impl Batch {
    /// Takes the impulses of the decoded collisions from `first` on: the second beat of each pair. `sums`
    /// receives the sum of the words of each.
    pub(crate) fn give(
        &mut self,
        contact: bool,
        first: usize,
        pairs: &[[Beat; 2]],
        sums: &mut [u32],
    ) {
        let blocks = self.places.blocks();
        if self.given.len() < blocks {
            self.given.resize(blocks, Given::NONE);
        }
        let slots = &self.slots[first..first + pairs.len()];
        let width = self.width;
        // The parts that are left: their collisions and, from the one with that number on, their blocks.
        let (mut pairs, mut left, mut sums) = (pairs, slots, sums);
        let (mut given, mut begin) = (&mut self.given[..], 0);
        let works = parts(slots).map(|(count, behind)| {
            let (own, others) = std::mem::take(&mut given).split_at_mut(behind - begin);
            let (of_pairs, other_pairs) = pairs.split_at(count);
            let (of_slots, other_slots) = left.split_at(count);
            let (of_sums, other_sums) = std::mem::take(&mut sums).split_at_mut(count);
            (given, pairs, left, sums) = (others, other_pairs, other_slots, other_sums);
            let first = std::mem::replace(&mut begin, behind);
            Give { contact, pairs: of_pairs, slots: of_slots, given: own, first, sums: of_sums }
        });
        self.crew.each(works, |work| {
            if let Err(work) = width.run(work) {
                work.one_by_one();
            }
        });
    }

    /// The impulses of the collisions from `first` on as they go out after the last pass of a kind: zeros
    /// for padding. Returns the sum of their words.
    pub(crate) fn outgoing(&mut self, contact: bool, first: usize, to: &mut [Beat]) -> u32 {
        let slots = &self.slots[first..first + to.len()];
        let (blocks, width, sum) = (&self.blocks[..], self.width, AtomicU32::new(0));
        let parts = slots.chunks(OF_THREAD).zip(to.chunks_mut(OF_THREAD));
        self.crew.each(parts, |(slots, to)| {
            if let Err(work) = width.run(Outgoing { contact, slots, blocks, to: &mut *to }) {
                work.one_by_one();
            }
            let words = to.iter().flat_map(|beat| beat.0);
            sum.fetch_add(words.fold(0, u32::wrapping_add), Ordering::Relaxed);
        });
        sum.into_inner()
    }
}
