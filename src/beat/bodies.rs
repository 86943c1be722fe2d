//! This file writes the velocity and pose segments of a step into the channels' buffers.
//!
//! The buffers may be write-combining memory of a board, so they are written once, upwards, in
//! whole beats, and never read: the sum that the accelerator is checked with is taken from the
//! values on their way.
//!
//! It goes by blocks of records that lie in the cache: what the caller has is read into one, looked
//! at, made rows of ([`record`]) and, where the stream has sixteen bits, narrowed; then the block is
//! dealt out to the channels ([`Dealer`]). What is wrong with the input is not said here, only that
//! something is.

use bitstream_model::interface::profile::Inertia;
use bitstream_model::interface::record::{Beat, pose, velocity};

use super::deal::{BLOCK, Dealer};
use super::stage::Stage;
use super::stripe::Segment;
use super::target::Target;
use crate::platform::{Work, in_wide_vectors};
use crate::record;
use crate::record::end::Survey;
use crate::scene::{Bodies, Body, Pose, Shape, Velocity};

/// Looks at all bodies and remembers what their collisions' records are made from, and which never
/// move; whether validation refuses none.
pub(crate) fn survey<B: Bodies + ?Sized>(
    target: Target<'_>,
    bodies: &B,
    count: usize,
    mut into: Survey<'_>,
) -> bool {
    into.clear();
    let mut packer = BodyPacker { target, into: Some(into), velocities: None, poses: None };
    packer.write_all(bodies, count)
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
    let velocities = Some(Velocities::new(target, velocities));
    let poses = Some(Poses::new(target, poses));
    let mut packer = BodyPacker { target, into: Some(into), velocities, poses };
    let good = packer.write_all(bodies, count);
    let [velocities, poses] = packer.finish();
    (velocities, poses, good)
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
    let velocities = Some(Velocities::new(target, channels));
    let mut packer = BodyPacker { target, into: None, velocities, poses: None };
    packer.write_all(bodies, count);
    packer.finish()[0]
}

/// Writes the pose records of `count` bodies; otherwise as [`pack_velocities`].
pub(crate) fn pack_poses<B: Bodies + ?Sized>(
    target: Target<'_>,
    bodies: &B,
    count: usize,
    channels: &mut [&mut [Beat]],
) -> u32 {
    let poses = Some(Poses::new(target, channels));
    let mut packer = BodyPacker { target, into: None, velocities: None, poses };
    packer.write_all(bodies, count);
    packer.finish()[1]
}

/// Surveys bodies and writes their records, whatever of it is wanted, a block at a time.
struct BodyPacker<'a, 'b, 'c> {
    target: Target<'a>,
    into: Option<Survey<'a>>,
    velocities: Option<Velocities<'a, 'b>>,
    poses: Option<Poses<'a, 'c>>,
}

impl BodyPacker<'_, '_, '_> {
    /// Goes through `count` bodies; whether validation refuses none of those that are surveyed.
    ///
    /// Here is only what depends on the caller's container: where the bodies of a block lie.
    fn write_all<B: Bodies + ?Sized>(&mut self, bodies: &B, count: usize) -> bool {
        let mut copies = [NOBODY; BLOCK];
        let mut good = true;
        for first in (0..count).step_by(BLOCK) {
            let block = &mut copies[..(count - first).min(BLOCK)];
            let lie = bodies.structures().and_then(|all| all.get(first..first + block.len()));
            let block = lie.unwrap_or_else(|| {
                for (at, to) in block.iter_mut().enumerate() {
                    *to = bodies.body(first + at);
                }
                block
            });
            good &= self.write(first, block);
        }
        good
    }

    /// Does it with the next bodies, at most [`BLOCK`], the first of which has the index `first`;
    /// whether validation refuses none that is surveyed.
    fn write(&mut self, first: usize, bodies: &[Body]) -> bool {
        in_wide_vectors(Writing { packer: self, first, bodies })
    }

    /// Ends the segments; the sums of the words written, modulo 2^32.
    fn finish(self) -> [u32; 2] {
        let Self { velocities, poses, .. } = self;
        [velocities.map(Velocities::finish), poses.map(Poses::finish)]
            .map(Option::unwrap_or_default)
    }
}

/// A block of bodies, and where it goes.
struct Writing<'p, 'a, 'b, 'c> {
    packer: &'p mut BodyPacker<'a, 'b, 'c>,
    first: usize,
    bodies: &'p [Body],
}

impl Work for Writing<'_, '_, '_, '_> {
    type Output = bool;

    #[inline(always)]
    fn run(self) -> bool {
        let Self { packer: BodyPacker { target, into, velocities, poses }, first, bodies } = self;
        let mut good = true;
        if let Some(into) = into {
            let ends = into.add(bodies, target.shapes);
            good = target.quick.is_none_or(|quick| quick.bodies(first, bodies, ends));
        }
        if let Some(velocities) = velocities {
            velocities.write(bodies);
        }
        if let Some(poses) = poses {
            poses.write(bodies);
        }
        good
    }
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

    #[inline(always)]
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

    #[inline(always)]
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
#[inline(always)]
fn world_velocity(body: &Body, shapes: &[Shape]) -> [Beat; velocity::WORLD_ROWS] {
    let shape = usize::try_from(body.shape).ok().and_then(|shape| shapes.get(shape));
    let shape = shape.unwrap_or(&Shape::STATIC);
    let inertia = record::inertia::about_world_axes(shape, body.pose.orientation);
    record::velocity::encode_world(body, &inertia)
}
