//! Delays blocks whose bodies are not used again for long, so that the uses of a body lie close
//! together.
//!
//! Without it a front would have to wait: collisions with the ground often come first of all, and
//! their bodies' others much later.

use crate::cast::register;

/// Blocks up to the next use, below which a block keeps its place.
const NEAR: u32 = 32;
/// No block.
const NONE: u32 = u32::MAX;

/// The order in which blocks are taken.
#[derive(Debug, Default)]
pub(crate) struct Order {
    /// All blocks, each once; the blocks of a body keep the order of their numbers.
    pub(crate) blocks: Vec<u32>,
    /// The place of each block in it.
    pub(crate) places: Vec<u32>,
    /// The first block of each list of blocks that are put off until just before a block.
    put_off: Vec<u32>,
    /// The next block of the same list.
    next: Vec<u32>,
}

impl Order {
    /// Finds the order; `again` says for each block which later one first uses a body of it again.
    ///
    /// A block that is put off still comes before that one's place, and what comes later than its
    /// own number never comes earlier than that place.
    pub(crate) fn find(&mut self, again: &[u32]) {
        let count = register(again.len());
        self.put_off.clear();
        self.put_off.resize(again.len(), NONE);
        self.next.clear();
        self.next.resize(again.len(), NONE);
        let far = |block: u32| {
            let again = again[block as usize];
            (again < count && again - block > NEAR).then_some(again)
        };
        for block in (0..count).rev() {
            if let Some(until) = far(block) {
                self.next[block as usize] = self.put_off[until as usize];
                self.put_off[until as usize] = block;
            }
        }
        self.blocks.clear();
        self.places.clear();
        self.places.resize(again.len(), 0);
        for block in 0..count {
            let mut before = self.put_off[block as usize];
            while before != NONE {
                self.take(before);
                before = self.next[before as usize];
            }
            if far(block).is_none() {
                self.take(block);
            }
        }
    }

    fn take(&mut self, block: u32) {
        self.places[block as usize] = register(self.blocks.len());
        self.blocks.push(block);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_block_is_put_off_until_its_bodies_are_used_again() {
        let mut again = vec![NONE; 100];
        again[0] = 90;
        again[1] = 20;
        again[2] = 90;
        again[90] = 99;
        let mut order = Order::default();
        order.find(&again);
        assert_eq!(order.blocks[..3], [1, 3, 4]);
        assert_eq!(order.blocks[86..92], [88, 89, 0, 2, 90, 91]);
    }

    proptest! {
        #[test]
        fn each_block_is_taken_once_and_before_its_bodies_are_used_again(
            steps in prop::collection::vec(1_u32..200, 0..300),
        ) {
            let numbered = (0_u32..).zip(&steps);
            let again: Vec<u32> = numbered.map(|(block, step)| block + step).collect();
            let mut order = Order::default();
            order.find(&again);
            let mut all = order.blocks.clone();
            all.sort_unstable();
            prop_assert_eq!(all, (0..register(steps.len())).collect::<Vec<u32>>());
            for (block, again) in again.iter().enumerate() {
                let place = order.places[block];
                prop_assert_eq!(order.blocks[place as usize], register(block));
                // A block that uses one of its bodies again has that number or a larger one.
                prop_assert!(order.places.iter().skip(*again as usize).all(|later| *later > place));
            }
        }
    }
}
