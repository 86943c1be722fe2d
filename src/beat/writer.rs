//! This file writes collisions into the channels' buffers as a caller finds them, one after the
//! other.

use std::fmt;

use bitstream_model::interface::profile::Geometry;
use bitstream_model::interface::record::{Beat, collision, relative};

use super::collisions::{Absolute, Kind, NOTHING, Relative, pack_block};
use super::deal::{BLOCK, Dealer};
use super::stage::Stage;
use super::stripe::Segment;
use super::target::Target;
use crate::platform::{Work, in_wide_vectors};
use crate::record::end::Ends;
use crate::scene::validate::{Block, Quick};
use crate::scene::{Collision, InputError};

/// Takes the collisions of a step straight into the memory that the board reads.
///
/// A few of them lie in the cache until their records are made; no copy of the others is kept.
pub struct Writer<'a> {
    target: Target<'a>,
    ends: Ends<'a>,
    dealer: Dealer<'a, 'a>,
    stage: EntryStage,
    /// Collisions whose records are not made yet.
    block: [Collision; BLOCK],
    held: usize,
    /// Records written.
    written: usize,
    room: usize,
    refused: Option<InputError>,
}

/// Of either kind of record.
#[expect(clippy::large_enum_variant, reason = "both are blocks, and lie on the stack")]
enum EntryStage {
    Absolute(Stage<{ collision::ROWS }>),
    Relative(Stage<{ relative::ROWS }>),
}

impl fmt::Debug for Writer<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { written, held, room, refused, .. } = self;
        f.debug_struct("Writer")
            .field("len", &(written + held))
            .field("room", room)
            .field("refused", refused)
            .finish_non_exhaustive()
    }
}

impl<'a> Writer<'a> {
    /// From the first collision on, with room for so many.
    ///
    /// Shape: each channel is as long as [`Layout::beats_on_channel`](super::stripe::Layout::beats_on_channel)
    /// says for `room`.
    pub(crate) fn new(
        target: Target<'a>,
        ends: Ends<'a>,
        room: usize,
        channels: &'a mut [&'a mut [Beat]],
    ) -> Self {
        let layout = Segment::Collisions.layout(target.variant);
        let stage = match target.variant.profile.geometry {
            Geometry::Absolute => EntryStage::Absolute(Stage::new(&layout)),
            Geometry::Relative => EntryStage::Relative(Stage::new(&layout)),
        };
        Self {
            target,
            ends,
            dealer: Dealer::new(&layout, channels),
            stage,
            block: [NOTHING; BLOCK],
            held: 0,
            written: 0,
            room,
            refused: None,
        }
    }

    /// Writes the next collision. Its index is that of [`Self::len`] before.
    ///
    /// Whether it is right is looked at a little later: what is wrong with one is said when all are
    /// written, and what comes after it is left out ([`Self::is_refused`]): the length stands still.
    #[inline]
    pub fn push(&mut self, collision: &Collision) {
        if self.is_refused() {
            return;
        }
        if self.written + self.held == self.room {
            self.overfull();
            return;
        }
        self.block[self.held] = *collision;
        self.held += 1;
        if self.held == BLOCK {
            self.flush();
        }
    }

    /// Number of collisions written so far.
    #[must_use]
    pub fn len(&self) -> usize {
        self.written + self.held
    }

    /// Whether there are none so far.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Whether a collision was found to be wrong: the step is refused, whatever is written after it.
    #[must_use]
    pub fn is_refused(&self) -> bool {
        self.refused.is_some()
    }

    #[cold]
    fn overfull(&mut self) {
        // What was wrong before is said first.
        self.flush();
        self.refused.get_or_insert(InputError::MoreThanAnnounced { announced: self.room });
    }

    /// Makes the records of what is held.
    fn flush(&mut self) {
        let count = std::mem::take(&mut self.held);
        if count == 0 {
            return;
        }
        let Self { target, ends, dealer, stage, written, .. } = self;
        let (quick, collisions) = (target.quick, self.block.each_ref());
        let collisions = &collisions[..count];
        let block =
            || Block { first: *written, collisions, ends: *ends, scheduled: false, heads: true };
        let good = match stage {
            EntryStage::Absolute(stage) => {
                in_wide_vectors(Flush { kind: Absolute, quick, block: block(), stage, dealer })
            }
            EntryStage::Relative(stage) => {
                let kind = Relative { words: None };
                in_wide_vectors(Flush { kind, quick, block: block(), stage, dealer })
            }
        };
        if !good {
            self.refused = quick.and_then(|quick| quick.refusal(&block()).err());
        }
        self.written += count;
    }

    /// Ends the segment; the sum of the words written, modulo 2^32, and how many collisions there are.
    ///
    /// # Errors
    /// What validation refuses of the first collision that is wrong;
    /// [`InputError::MoreThanAnnounced`].
    pub(crate) fn finish(mut self) -> Result<(u32, usize), InputError> {
        self.flush();
        match self.refused {
            Some(refused) => Err(refused),
            None => Ok((self.dealer.finish(), self.written)),
        }
    }
}

/// A block of collisions, and where it goes.
struct Flush<'a, 'b, K, const ROWS: usize> {
    kind: K,
    quick: Option<&'a Quick<'a>>,
    block: Block<'a>,
    stage: &'a mut Stage<ROWS>,
    dealer: &'a mut Dealer<'b, 'b>,
}

impl<K: Kind<ROWS>, const ROWS: usize> Work for Flush<'_, '_, K, ROWS> {
    type Output = bool;

    #[inline(always)]
    fn run(self) -> bool {
        let Self { kind, quick, block, stage, dealer } = self;
        pack_block(&kind, quick, block, (stage, dealer), |_| {})
    }
}
