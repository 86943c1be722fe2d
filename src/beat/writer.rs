//! Writes collisions into the channels' buffers one by one, as a caller finds them.

use std::fmt;

use pgs_interface::record::Beat;
use pgs_support::float_env::standard;

use super::collisions::{CollisionPacker, IN_ARRAY};
use super::pool::whole;
use super::stripe::BLOCK;
use crate::record::body_table::Ends;
use crate::scene::Collision;
use crate::validate::{InputError, Scene};

/// Takes the collisions of a step straight into the memory that the board reads.
///
/// A few of them lie in the cache until their records are made; no copy of the others is kept.
pub struct Writer<'a> {
    scene: &'a Scene<'a>,
    ends: Ends<'a>,
    /// `None` for a step without bodies, which has no records.
    packer: Option<CollisionPacker<'a>>,
    /// Collisions that were looked at, and whose records are made.
    done: usize,
    /// Collisions whose records are not made yet.
    block: [Collision; BLOCK],
    held: usize,
    room: usize,
    refused: Option<InputError>,
}

/// The collisions that a writer has written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Written {
    /// The sum of the words written, modulo 2^32.
    pub(crate) sum: u32,
    pub(crate) collisions: usize,
    /// The collisions among them without contact points.
    pub(crate) paddings: usize,
}

impl fmt::Debug for Writer<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { room, refused, .. } = self;
        f.debug_struct("Writer")
            .field("len", &self.len())
            .field("room", room)
            .field("refused", refused)
            .finish_non_exhaustive()
    }
}

impl<'a> Writer<'a> {
    /// Begins with the first collision and has room for `room` collisions.
    ///
    /// Shape: each channel is as long as
    /// [`Layout::beats_on_channel`](crate::beat::stripe::Layout::beats_on_channel) says for `room`.
    pub(crate) fn new(
        scene: &'a Scene<'a>,
        ends: Ends<'a>,
        room: usize,
        channels: &'a mut [&'a mut [Beat]],
    ) -> Self {
        let packer = CollisionPacker::new(scene, ends, whole(channels), None);
        Self { packer: Some(packer), ..Self::without_bodies(scene, ends, room) }
    }

    /// As [`Self::new`], for a step without bodies. All of its collisions must be without contact
    /// points.
    pub(crate) fn without_bodies(scene: &'a Scene<'a>, ends: Ends<'a>, room: usize) -> Self {
        Self {
            scene,
            ends,
            packer: None,
            done: 0,
            block: [Collision::NOTHING; BLOCK],
            held: 0,
            room,
            refused: None,
        }
    }

    /// Writes the next collision. Its index is the value of [`Self::len`] before the call. A
    /// collision of count 0 has an index, too, and is sent as padding.
    ///
    /// Validation follows a little later, and its error comes when all collisions are written. Once
    /// [`Self::is_refused`], the writer drops every further collision, and the length stands still.
    /// The records do not depend on the caller's floating-point environment.
    #[inline]
    pub fn push(&mut self, collision: &Collision) {
        if self.is_refused() {
            return;
        }
        if self.len() == self.room {
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
        self.done + self.held
    }

    /// Whether there are none so far.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Whether a collision was found to be wrong. The step is then refused, whatever is written
    /// later.
    #[must_use]
    pub fn is_refused(&self) -> bool {
        self.refused.is_some()
    }

    #[cold]
    fn overfull(&mut self) {
        // An earlier error takes precedence.
        self.flush();
        self.refused.get_or_insert(InputError::MoreThanAnnounced { announced: self.room });
    }

    /// Makes the records of the held collisions. All computation of a writer happens here, called
    /// from the caller's narrow phase.
    fn flush(&mut self) {
        standard(|| self.make_records());
    }

    fn make_records(&mut self) {
        let count = std::mem::take(&mut self.held);
        if count == 0 {
            return;
        }
        let (first, collisions) = (self.done, &self.block[..count]);
        let good = match &mut self.packer {
            Some(packer) => {
                packer.write(collisions, &IN_ARRAY, count);
                packer.is_good()
            }
            None => collisions.iter().all(Collision::is_empty),
        };
        self.done += count;
        if !good {
            let found = self.scene.refusal(first, collisions, self.ends).err();
            // Collisions that no index of the stream can name are never sent.
            self.refused = Some(found.unwrap_or(InputError::Unsteady));
        }
    }

    /// Ends the segment.
    ///
    /// # Errors
    /// The refusal of the first wrong collision by validation; [`InputError::MoreThanAnnounced`];
    /// [`InputError::Unsteady`] if the stream's indices do not name all bodies, which the driver's
    /// limits on bodies rule out.
    pub(crate) fn finish(mut self) -> Result<Written, InputError> {
        self.flush();
        match self.refused {
            Some(refused) => Err(refused),
            None => {
                let Self { done: collisions, packer, .. } = self;
                let packed = packer.as_ref().map(CollisionPacker::finish);
                let (sum, paddings) =
                    packed.map_or((0, collisions), |packed| (packed.sum, packed.paddings));
                Ok(Written { sum, collisions, paddings })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable as _;

    use super::*;
    use crate::beat::Target;
    use crate::beat::stripe::Segment;
    use crate::beat::tests::surveyed;
    use crate::scene::{Body, Contact, Shape, StepParameters};
    use crate::validate::{Limits, preflight};
    use pgs_interface::profile::HALF;

    /// The driver's limits on bodies rule this case out, but the refusal does not rest on them.
    #[test]
    fn what_no_index_can_name_is_refused() {
        let shapes = [Shape::isotropic(1.0, 1.0)];
        let mut body = Body::zeroed();
        body.pose.orientation = [0.0, 0.0, 0.0, 1.0];
        let collision = Collision {
            body_a: 0,
            body_b: 1,
            normal: [0.0, 1.0, 0.0],
            count: 1,
            contacts: [Contact::default(); 4],
        };
        let variant = HALF.default_variant();
        for (count, fits) in [(1 << 16, true), ((1 << 16) + 1, false)] {
            let bodies = vec![body; count];
            let limits = Limits::roomy(variant);
            let list = vec![collision; BLOCK];
            let parameters = StepParameters::default();
            let scene = preflight(&bodies, &list, &shapes, &parameters, &limits)
                .expect("limits that rule nothing out");
            let target = Target { scene: &scene, streamed_masses: false };
            let (table, good) = surveyed(target, &bodies);
            assert!(good);
            let layout = Segment::Collisions.layout(&variant);
            let mut buffers: [Vec<Beat>; 3] = std::array::from_fn(|channel| {
                vec![Beat::default(); layout.beats_on_channel(BLOCK, channel)]
            });
            let mut views = buffers.each_mut().map(Vec::as_mut_slice);
            let mut writer = Writer::new(&scene, table.ends(), BLOCK, &mut views);
            list.iter().for_each(|collision| writer.push(collision));
            let finished = writer.finish();
            let expected = if fits { Ok(BLOCK) } else { Err(InputError::Unsteady) };
            assert_eq!(finished.map(|written| written.collisions), expected, "{count}");
        }
    }
}
