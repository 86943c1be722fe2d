//! Takes the impulses that come in with the collisions of a warm pass, and gives out the ones that a kind of
//! passes ends with.

use super::block::{LANES, Words};
use super::{Batch, NO_SLOT};
use pgs_interface::record::{Beat, CONTACT_POINTS};
use pgs_support::lanes::{Instructions, Quad, Work};

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

/// The slots of sixteen collisions, if these fill a block in their order.
fn whole_block(slots: &[u32; LANES]) -> Option<usize> {
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
    given: &'a mut [Given],
    sums: &'a mut [u32],
}

impl Give<'_> {
    fn one_by_one(self) {
        let Self { contact, pairs, slots, given, sums } = self;
        for (([_, beat], slot), sum) in pairs.iter().zip(slots).zip(sums) {
            *sum = beat.0.into_iter().fold(0, u32::wrapping_add);
            let (block, lane) = (*slot as usize / LANES, *slot as usize % LANES);
            if let Some(given) = given.get_mut(block).filter(|_| *slot != NO_SLOT) {
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
        let Self { contact, pairs, slots, given, sums } = self;
        let groups = pairs.chunks(LANES).zip(slots.chunks(LANES)).zip(sums.chunks_mut(LANES));
        for ((pairs, slots), sums) in groups {
            let block = slots.try_into().ok().and_then(whole_block);
            let Some(to) = block.and_then(|block| given.get_mut(block)) else {
                Give { contact, pairs, slots, given: &mut *given, sums }.one_by_one();
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
        let work = Give { contact, pairs, slots, given: &mut self.given, sums };
        if let Err(work) = self.width.run(work) {
            work.one_by_one();
        }
    }

    /// The impulses of the collisions from `first` on as they go out after the last pass of a kind: zeros
    /// for padding. Returns the sum of their words.
    pub(crate) fn outgoing(&self, contact: bool, first: usize, to: &mut [Beat]) -> u32 {
        let slots = &self.slots[first..first + to.len()];
        let mut sum = 0_u32;
        for (beat, slot) in to.iter_mut().zip(slots) {
            let mut words = [0; CONTACT_POINTS];
            if *slot != NO_SLOT {
                let (block, lane) = (*slot as usize / LANES, *slot as usize % LANES);
                let impulses = self.blocks[block].impulses(lane);
                words = match (contact, impulses) {
                    (true, normal) => normal.map(f32::to_bits),
                    (false, [_, first, second, _]) => [first.to_bits(), second.to_bits(), 0, 0],
                };
            }
            *beat = Beat(words);
            sum = words.into_iter().fold(sum, u32::wrapping_add);
        }
        sum
    }
}
