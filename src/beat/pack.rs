//! This file writes the segments of a step into the channels' buffers.
//!
//! The buffers may be write-combining memory of a board, so they are written once, upwards, in
//! whole beats, and never read: the sum that the accelerator is checked with is taken from the
//! values on their way.
//!
//! It goes by blocks of records that lie in the cache: what the caller has is read into one, looked
//! at, made rows of ([`record`]) and, where the stream has sixteen bits, narrowed; then the block is
//! dealt out to the channels ([`Dealer`]). What is wrong with the input is not said here, only that
//! something is.

use bitstream_model::interface::profile::{Geometry, Inertia, Variant};
use bitstream_model::interface::record::{Beat, pose, relative, velocity};

use super::deal::{BLOCK, Dealer};
use super::stage::Stage;
use super::stripe::Segment;
use crate::platform::prefetch;
use crate::record;
use crate::record::end::{End, Ends, Survey};
use crate::scene::validate::{Block, Quick, head};
use crate::scene::{
    Bodies, Body, CONTACT_POINTS, Collision, Collisions, Contact, Pose, Shape, Velocity,
};

/// What records are packed for.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Target<'a> {
    pub(crate) variant: &'a Variant,
    pub(crate) shapes: &'a [Shape],
    /// Looks at everything on its way; without it nothing is wrong.
    pub(crate) quick: Option<&'a Quick<'a>>,
}

/// The collisions of a step, as they are sent.
#[derive(Debug)]
pub(crate) struct Entries<'a, C: ?Sized> {
    pub(crate) collisions: &'a C,
    /// Records, those that an order added included.
    pub(crate) count: usize,
    /// Whether they are in an order that was made for them, which may have added some.
    pub(crate) scheduled: bool,
    /// What stands in place of the bodies' indices, of each record. Only for
    /// [`Geometry::Relative`].
    pub(crate) words: Option<&'a [[u32; 2]]>,
}

/// Looks at all bodies and remembers what their collisions' records are made from, and which never
/// move; whether validation refuses none.
pub(crate) fn survey<B: Bodies + ?Sized>(
    target: Target<'_>,
    bodies: &B,
    count: usize,
    mut into: Survey<'_>,
) -> bool {
    into.clear();
    let mut block = [NOBODY; BLOCK];
    let mut good = true;
    for first in (0..count).step_by(BLOCK) {
        let bodies = read(bodies, first, count, &mut block);
        good &= target.survey(first, bodies, &mut into);
    }
    good
}

/// Surveys `count` bodies and writes their velocity and pose records, the first with their inertia
/// where the bitstream wants it; the sums of both, modulo 2^32, and whether validation refuses
/// none.
///
/// Shape: each channel is as long as [`Layout::beats_on_channel`](super::stripe::Layout::beats_on_channel) says.
pub(crate) fn pack_bodies<B: Bodies + ?Sized>(
    target: Target<'_>,
    bodies: &B,
    count: usize,
    mut into: Survey<'_>,
    velocities: &mut [&mut [Beat]],
    poses: &mut [&mut [Beat]],
) -> (u32, u32, bool) {
    into.clear();
    let mut velocities = Velocities::new(target, velocities);
    let mut poses = Poses::new(target, poses);
    let mut block = [NOBODY; BLOCK];
    let mut good = true;
    for first in (0..count).step_by(BLOCK) {
        let bodies = read(bodies, first, count, &mut block);
        good &= target.survey(first, bodies, &mut into);
        velocities.write(bodies);
        poses.write(bodies);
    }
    (velocities.finish(), poses.finish(), good)
}

/// Writes the velocity records of `count` bodies, and their inertia where the bitstream wants it;
/// returns the sum of the words written, modulo 2^32.
///
/// Shape: each channel is as long as [`Layout::beats_on_channel`](super::stripe::Layout::beats_on_channel) says.
pub(crate) fn pack_velocities<B: Bodies + ?Sized>(
    target: Target<'_>,
    bodies: &B,
    count: usize,
    channels: &mut [&mut [Beat]],
) -> u32 {
    let mut velocities = Velocities::new(target, channels);
    let mut block = [NOBODY; BLOCK];
    for first in (0..count).step_by(BLOCK) {
        velocities.write(read(bodies, first, count, &mut block));
    }
    velocities.finish()
}

/// Writes the pose records of `count` bodies; otherwise as [`pack_velocities`].
pub(crate) fn pack_poses<B: Bodies + ?Sized>(
    target: Target<'_>,
    bodies: &B,
    count: usize,
    channels: &mut [&mut [Beat]],
) -> u32 {
    let mut poses = Poses::new(target, channels);
    let mut block = [NOBODY; BLOCK];
    for first in (0..count).step_by(BLOCK) {
        poses.write(read(bodies, first, count, &mut block));
    }
    poses.finish()
}

/// Writes the records of collisions; the sum of the words written, modulo 2^32, and whether validation
/// refuses none.
///
/// A body that does not exist has its position written as zeros, and one without a shape is static.
/// Should a caller's [`Collisions`] answer differently from one look to the next, the accelerator
/// refuses the index.
pub(crate) fn pack_collisions<C: Collisions + ?Sized>(
    target: Target<'_>,
    ends: Ends<'_>,
    entries: &Entries<'_, C>,
    channels: &mut [&mut [Beat]],
) -> (u32, bool) {
    match target.variant.profile.geometry {
        Geometry::Absolute => {
            let encode = |_, it: &Collision, ends: [End; 2]| record::collision::encode(it, ends);
            let integers = &record::collision::INTEGERS;
            let look = |quick: &Quick<'_>, block: &Block<'_>, records: &[_]| {
                quick.absolute(block, records)
            };
            pack_entries(target, ends, entries, integers, channels, encode, look)
        }
        Geometry::Relative => {
            let encode =
                |index, it: &Collision, ends| relative_record(ends, entries.words, index, it);
            let integers = &record::relative::INTEGERS;
            let look = |quick: &Quick<'_>, block: &Block<'_>, records: &[_]| {
                quick.relative(block, records)
            };
            pack_entries(target, ends, entries, integers, channels, encode, look)
        }
    }
}

/// Collisions that are fetched ahead of the one that is read.
const AHEAD: usize = 16;

/// Reads, encodes, looks at and deals out collisions, a block at a time.
#[inline]
fn pack_entries<C: Collisions + ?Sized, const ROWS: usize>(
    target: Target<'_>,
    ends: Ends<'_>,
    entries: &Entries<'_, C>,
    integers: &[bool; ROWS],
    channels: &mut [&mut [Beat]],
    encode: impl Fn(usize, &Collision, [End; 2]) -> [Beat; ROWS],
    look: impl Fn(&Quick<'_>, &Block<'_>, &[[Beat; ROWS]]) -> bool,
) -> (u32, bool) {
    let Entries { collisions, count, scheduled, .. } = *entries;
    let layout = Segment::Collisions.layout(target.variant);
    let mut dealer = Dealer::new(&layout, channels);
    let mut stage = Stage::new(&layout);
    let mut block = [NOTHING; BLOCK];
    let mut good = true;
    let structures = collisions.structures();
    for first in (0..count).step_by(BLOCK) {
        let block = &mut block[..(count - first).min(BLOCK)];
        let block = match structures.and_then(|all| all.get(first..first + block.len())) {
            Some(block) => {
                let ahead = structures.and_then(|all| all.get(first + block.len() + AHEAD..));
                ahead.into_iter().flatten().take(block.len()).for_each(prefetch);
                block
            }
            None => {
                for (index, to) in (first..).zip(&mut *block) {
                    // They lie anywhere: on their way while those before them are dealt with.
                    if scheduled && index + AHEAD < count {
                        collisions.soon(index + AHEAD);
                    }
                    *to = collisions.collision(index);
                    ends.soon([to.body_a, to.body_b]);
                }
                block
            }
        };
        let block = Block { first, collisions: block, ends, scheduled, heads: true };
        good &=
            pack_block(target.quick, block, integers, (&mut stage, &mut dealer), &encode, &look);
    }
    (dealer.finish(), good)
}

/// Encodes, looks at and deals out a block of collisions; whether validation refuses none.
#[inline]
pub(super) fn pack_block<const ROWS: usize>(
    quick: Option<&Quick<'_>>,
    mut block: Block<'_>,
    integers: &[bool; ROWS],
    (stage, dealer): (&mut Stage<ROWS>, &mut Dealer<'_, '_>),
    encode: impl Fn(usize, &Collision, [End; 2]) -> [Beat; ROWS],
    look: impl Fn(&Quick<'_>, &Block<'_>, &[[Beat; ROWS]]) -> bool,
) -> bool {
    let Block { first, collisions, ends, scheduled, .. } = block;
    let records = stage.records(collisions.len());
    let of_both = |from: &Collision| [from.body_a, from.body_b].map(|body| ends.get(body));
    let from = collisions.iter().map(|from| (from, of_both(from)));
    let mut good = true;
    if let Some(quick) = quick {
        for (at, (to, (from, ends))) in records.iter_mut().zip(from).enumerate() {
            block.heads &= head(from, ends, scheduled);
            *to = encode(first + at, from, ends);
        }
        good = look(quick, &block, records);
    } else {
        for (at, (to, (from, ends))) in records.iter_mut().zip(from).enumerate() {
            *to = encode(first + at, from, ends);
        }
    }
    stage.deal(collisions.len(), integers, dealer);
    good
}

/// What no record of a live body holds; the accelerator refuses a collision of it with itself.
const REFUSED: [u32; 2] = [u32::MAX; 2];

/// The record of a collision relative to body A, with its words, if there are any.
///
/// Nobody reads the marks of padding, so that a collision which had contact points when the marks
/// were made and has none now would shift all bodies behind it: it is sent as one to be refused.
#[inline(always)]
pub(super) fn relative_record(
    ends: [End; 2],
    words: Option<&[[u32; 2]]>,
    index: usize,
    collision: &Collision,
) -> [Beat; relative::ROWS] {
    let ends = record::relative::anchors(ends, ends.map(|end| !end.is_static()));
    let Some(words) = words else { return record::relative::encode(collision, ends) };
    let (mut collision, mut words) = (*collision, words[index]);
    if collision.count == 0 && words != [0; 2] {
        (collision.count, words) = (1, REFUSED);
    }
    [collision.body_a, collision.body_b] = words;
    record::relative::encode(&collision, ends)
}

/// Some of the bodies, in an order of their own: a view of what is packed.
#[derive(Debug)]
pub(crate) struct Chosen<'a, B: ?Sized> {
    pub(crate) bodies: &'a B,
    /// Their indices.
    pub(crate) order: &'a [u32],
}

impl<B: Bodies + ?Sized> Bodies for Chosen<'_, B> {
    fn len(&self) -> usize {
        self.order.len()
    }

    fn body(&self, index: usize) -> Body {
        self.bodies.body(self.order[index] as usize)
    }

    /// Nothing is stored through a view.
    fn commit(&mut self, _: usize, _: Pose, _: Velocity) {}
}

/// What a block of bodies holds before it is read.
const NOBODY: Body = Body {
    pose: Pose { position: [0.0; 3], orientation: [0.0; 4] },
    velocity: Velocity { linear: [0.0; 3], angular: [0.0; 3] },
    shape: 0,
};
/// What a block of collisions holds before it is read.
pub(crate) const NOTHING: Collision = Collision {
    body_a: 0,
    body_b: 0,
    normal: [0.0; 3],
    count: 0,
    contacts: [Contact { point: [0.0; 3], distance: 0.0 }; CONTACT_POINTS],
};

/// Reads the next block of `count` bodies.
#[inline]
fn read<'a, B: Bodies + ?Sized>(
    bodies: &'a B,
    first: usize,
    count: usize,
    block: &'a mut [Body; BLOCK],
) -> &'a [Body] {
    let block = &mut block[..(count - first).min(BLOCK)];
    if let Some(block) = bodies.structures().and_then(|all| all.get(first..first + block.len())) {
        return block;
    }
    for (at, to) in block.iter_mut().enumerate() {
        *to = bodies.body(first + at);
    }
    block
}

impl Target<'_> {
    /// Remembers a block of bodies; whether validation refuses none.
    #[inline]
    fn survey(&self, first: usize, bodies: &[Body], into: &mut Survey<'_>) -> bool {
        let ends = into.add(bodies, self.shapes);
        self.quick.is_none_or(|quick| quick.bodies(first, bodies, ends))
    }
}

/// Writes velocity records, a block at a time.
struct Velocities<'a, 'b> {
    shapes: &'a [Shape],
    dealer: Dealer<'a, 'b>,
    stage: VelocityStage,
}

/// With and without inertia.
#[expect(clippy::large_enum_variant, reason = "both are blocks, and lie on the stack")]
enum VelocityStage {
    Isotropic(Stage<{ velocity::ROWS }>),
    World(Stage<{ velocity::WORLD_ROWS }>),
}

impl<'a, 'b> Velocities<'a, 'b> {
    fn new(target: Target<'a>, channels: &'a mut [&'b mut [Beat]]) -> Self {
        let layout = Segment::Velocities.layout(target.variant);
        let stage = match target.variant.inertia {
            Inertia::Isotropic => VelocityStage::Isotropic(Stage::new(&layout)),
            Inertia::World => VelocityStage::World(Stage::new(&layout)),
        };
        Self { shapes: target.shapes, dealer: Dealer::new(&layout, channels), stage }
    }

    #[inline]
    fn write(&mut self, bodies: &[Body]) {
        match &mut self.stage {
            VelocityStage::Isotropic(stage) => {
                for (to, body) in stage.records(bodies.len()).iter_mut().zip(bodies) {
                    *to = record::velocity::encode(body);
                }
                stage.deal(bodies.len(), &record::velocity::INTEGERS, &mut self.dealer);
            }
            VelocityStage::World(stage) => {
                for (to, body) in stage.records(bodies.len()).iter_mut().zip(bodies) {
                    *to = world_velocity(body, self.shapes);
                }
                stage.deal(bodies.len(), &record::velocity::WORLD_INTEGERS, &mut self.dealer);
            }
        }
    }

    fn finish(self) -> u32 {
        self.dealer.finish()
    }
}

/// Writes pose records, a block at a time.
struct Poses<'a, 'b> {
    dealer: Dealer<'a, 'b>,
    stage: Stage<{ pose::ROWS }>,
}

impl<'a, 'b> Poses<'a, 'b> {
    fn new(target: Target<'_>, channels: &'a mut [&'b mut [Beat]]) -> Self {
        let layout = Segment::Poses.layout(target.variant);
        Self { dealer: Dealer::new(&layout, channels), stage: Stage::new(&layout) }
    }

    #[inline]
    fn write(&mut self, bodies: &[Body]) {
        for (to, body) in self.stage.records(bodies.len()).iter_mut().zip(bodies) {
            *to = record::pose::encode(body);
        }
        self.stage.deal(bodies.len(), &record::pose::INTEGERS, &mut self.dealer);
    }

    fn finish(self) -> u32 {
        self.dealer.finish()
    }
}

/// The velocity record of a body with its inertia.
fn world_velocity(body: &Body, shapes: &[Shape]) -> [Beat; velocity::WORLD_ROWS] {
    let shape = usize::try_from(body.shape).ok().and_then(|shape| shapes.get(shape));
    let shape = shape.unwrap_or(&Shape::STATIC);
    let inertia = record::inertia::about_world_axes(shape, body.pose.orientation);
    record::velocity::encode_world(body, &inertia)
}
