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
    into: Survey<'_>,
    velocities: &mut [&mut [Beat]],
    poses: &mut [&mut [Beat]],
) -> (u32, u32, bool) {
    let velocities = Velocities::new(target, velocities);
    let poses = Poses::new(target, poses);
    in_wide_vectors(Packing { target, bodies, count, into, velocities, poses })
}

/// All bodies of a step, and where they go.
struct Packing<'a, 'b, 'c, B: ?Sized> {
    target: Target<'a>,
    bodies: &'a B,
    count: usize,
    into: Survey<'a>,
    velocities: Velocities<'a, 'b>,
    poses: Poses<'a, 'c>,
}

impl<B: Bodies + ?Sized> Work for Packing<'_, '_, '_, B> {
    type Output = (u32, u32, bool);

    #[inline(always)]
    fn run(self) -> (u32, u32, bool) {
        let Self { target, bodies, count, mut into, mut velocities, mut poses } = self;
        into.clear();
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

/// Reads the next block of `count` bodies.
#[inline(always)]
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
    #[inline(always)]
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
