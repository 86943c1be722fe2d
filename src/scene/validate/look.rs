//! This file looks at the collisions of a block, one after the other, while their records are made.

use bitstream_model::interface::record::LANES;

use super::quick::{Block, Quick, head, is_padding};
use super::reach::{Furthest, Reach};
use crate::platform::Lanes;
use crate::record::end::End;
use crate::scene::{Collision, Lying};

/// What has been seen of the collisions of a block.
#[derive(Clone, Copy)]
pub(crate) struct Look<'a> {
    quick: &'a Quick<'a>,
    /// Whether [`head`] is right for all of them but padding.
    heads: bool,
    paddings: usize,
    /// Bits where a number is beyond what the stream holds.
    beyond: Lanes,
    /// Whether it matters how far they reach.
    reaches: bool,
    furthest: Furthest,
}

impl<'a> Look<'a> {
    /// At none yet.
    #[inline(always)]
    pub(crate) fn new(quick: &'a Quick<'a>) -> Self {
        Self {
            quick,
            heads: true,
            paddings: 0,
            beyond: Lanes::all(0),
            reaches: quick.bounds_of_rows().is_some_and(|bounds| bounds.allow()),
            furthest: Furthest::new(),
        }
    }

    /// Looks at normal, count and bodies of the next. The ends are `theirs`, the bodies', or may be others': then
    /// it is looked at again, unless it is padding, which it may be where collisions are `scheduled`.
    #[inline(always)]
    pub(crate) fn head(
        &mut self,
        collision: &Collision,
        ends: [&End; 2],
        theirs: bool,
        scheduled: bool,
    ) {
        let padding = scheduled & is_padding(collision);
        self.heads &= head(collision, ends) & theirs | padding;
        self.paddings += usize::from(padding);
    }

    /// Looks at its record, of which these are the bits of numbers that are beyond what the stream
    /// holds.
    #[inline(always)]
    pub(crate) fn numbers(&mut self, beyond: Lanes) {
        self.beyond = self.beyond.or(beyond);
    }

    /// Whether it is to be said how far each reaches.
    #[inline(always)]
    pub(crate) fn asks_how_far(&self) -> bool {
        self.reaches
    }

    /// Looks at how far it reaches.
    #[inline(always)]
    pub(crate) fn reach(&mut self, reach: &Reach, ends: [&End; 2]) {
        self.furthest.take(reach, ends.map(|end| !end.is_static()));
    }

    /// How many look like padding.
    #[inline(always)]
    pub(crate) fn paddings(&self) -> usize {
        self.paddings
    }

    /// Whether validation refuses nothing of the block, whose collisions all these were and reach as far
    /// as `reaches` say.
    #[inline(always)]
    pub(crate) fn good<'b, L: Lying<'b>>(
        self,
        block: &Block<'b, L>,
        reaches: impl Iterator<Item = Reach>,
    ) -> bool {
        let mut good = self.heads & (self.beyond.words() == [0; LANES]);
        if let Some(bounds) = self.quick.bounds_of_rows() {
            // Where one shape of the table forbids it, nothing is found of all at once.
            good = good
                && (self.reaches && self.furthest.all_surely_fit(bounds)
                    || self.quick.rows_fit(block, reaches));
        }
        good || self.quick.exactly(block)
    }
}
