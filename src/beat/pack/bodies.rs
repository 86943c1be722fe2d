//! Writes the velocity and pose segments of a step into the channels' buffers.
//!
//! The buffers may be write-combining memory of a board. Each thread therefore writes its range of
//! them once, upwards, in whole beats, and never reads it: the sum for the check of the accelerator
//! is taken from the values on their way.
//!
//! A range goes by blocks of bodies that fit in the cache, as the packer reads each body more than
//! once. It checks the caller's bodies, makes their rows ([`record`](crate::record)), and writes
//! these to the channels in the format of the stream
//! ([`StripeWriter`](super::stripe_writer::StripeWriter)). It reports that the input is wrong, but
//! not the cause.

use std::mem;
use std::ops::Range;

use pgs_interface::record::Beat;

use super::body_records::{Poses, Velocities};
use super::pool::{ChannelChunks, PackPool, Piece, ranges, whole};
use super::stripe_writer::BODIES;
use super::target::Target;
use crate::beat::stripe::Segment;
use crate::record::body_table::{End, Survey, Tags};
use crate::scene::{Bodies, Body, Pose, Velocity};
use crate::simd::{Vectors, Work, in_wide_vectors};

/// Checks all bodies, and keeps the values that collision records need and the indices of static
/// bodies; returns whether validation accepts all bodies. A step writes the records meanwhile
/// ([`pack_bodies`]).
#[cfg(any(test, feature = "bench"))]
pub(crate) fn survey<B: Bodies + ?Sized>(
    target: Target<'_>,
    bodies: &B,
    count: usize,
    into: Survey<'_>,
    packers: &mut PackPool,
) -> bool {
    let wanted = Wanted { into, velocities: None, poses: None };
    let (.., good) = pack(target, bodies, count, wanted, packers);
    good
}

/// Surveys `count` bodies and writes their velocity and pose records, velocities with the inertia
/// where the bitstream wants it, and poses; the sums of both, modulo 2^32,
/// and whether validation accepts all bodies.
///
/// Shape: each channel is as long as
/// [`Layout::beats_on_channel`](crate::beat::stripe::Layout::beats_on_channel) says.
pub(crate) fn pack_bodies<B: Bodies + ?Sized>(
    target: Target<'_>,
    bodies: &B,
    count: usize,
    into: Survey<'_>,
    (velocities, poses): (&mut [&mut [Beat]], &mut [&mut [Beat]]),
    packers: &mut PackPool,
) -> (u32, u32, bool) {
    let wanted = Wanted { into, velocities: Some(whole(velocities)), poses: Some(whole(poses)) };
    pack(target, bodies, count, wanted, packers)
}

/// The outputs that a caller wants of bodies.
struct Wanted<'a> {
    into: Survey<'a>,
    velocities: Option<Piece<'a>>,
    poses: Option<Piece<'a>>,
}

/// Surveys `count` bodies and writes their records, as far as wanted; the sums of velocity and of
/// pose records, and whether validation accepts all bodies.
fn pack<B: Bodies + ?Sized>(
    target: Target<'_>,
    bodies: &B,
    count: usize,
    wanted: Wanted<'_>,
    packers: &mut PackPool,
) -> (u32, u32, bool) {
    let Wanted { mut into, velocities, poses } = wanted;
    let ends = into.ends(count);
    let cut = |size| parts(target, (count, size), ends, velocities, poses);
    let mut all = Outcome::default();
    let work = |part| pack_part(target, bodies, part);
    packers.each(count, cut, work, |of_part| all.join(of_part));
    let Outcome { velocities, poses, good, still } = all;
    into.settle(still);
    (velocities, poses, good)
}

/// A range of bodies, and the destinations of the wanted outputs.
struct Part<'a> {
    range: Range<usize>,
    ends: &'a mut [End],
    velocities: Option<Piece<'a>>,
    poses: Option<Piece<'a>>,
}

/// Cuts `count` bodies into parts of `size`.
fn parts<'a>(
    target: Target<'_>,
    (count, size): (usize, usize),
    ends: &'a mut [End],
    velocities: Option<Piece<'a>>,
    poses: Option<Piece<'a>>,
) -> impl Iterator<Item = Part<'a>> + Send {
    let [of_velocities, of_poses] =
        [Segment::Velocities, Segment::Poses].map(|segment| segment.layout(target.variant));
    let mut ends = ends.chunks_mut(size);
    let mut velocities =
        velocities.map(|channels| ChannelChunks::new(&of_velocities, size, channels));
    let mut poses = poses.map(|channels| ChannelChunks::new(&of_poses, size, channels));
    ranges(count, size).map(move |range| Part {
        range,
        ends: ends.next().unwrap_or_default(),
        velocities: velocities.as_mut().map(ChannelChunks::cut),
        poses: poses.as_mut().map(ChannelChunks::cut),
    })
}

/// The result of packing: the sums of the words written, whether validation accepts all bodies, and
/// a range of indices that contains all static bodies.
struct Outcome {
    velocities: u32,
    poses: u32,
    good: bool,
    still: Range<usize>,
}

/// The empty range: [`around`] of it and another range is the other range.
const NONE: Range<usize> = Range { start: usize::MAX, end: 0 };

impl Default for Outcome {
    fn default() -> Self {
        Self { velocities: 0, poses: 0, good: true, still: NONE }
    }
}

impl Outcome {
    fn join(&mut self, other: Self) {
        self.velocities = self.velocities.wrapping_add(other.velocities);
        self.poses = self.poses.wrapping_add(other.poses);
        self.good &= other.good;
        self.still = around(&self.still, &other.still);
    }
}

/// The smallest range that contains both.
fn around(one: &Range<usize>, other: &Range<usize>) -> Range<usize> {
    one.start.min(other.start)..one.end.max(other.end)
}

/// Makes the wanted outputs of one part.
///
/// Only this function depends on the caller's container: it finds where the bodies of a block lie.
fn pack_part<B: Bodies + ?Sized>(target: Target<'_>, bodies: &B, mut part: Part<'_>) -> Outcome {
    let Part { range, .. } = &part;
    let (first, until) = (range.start, range.end);
    let mut packer = BodyPacker::new(target, &mut part);
    let mut copies = [NOBODY; BODIES];
    for first in (first..until).step_by(BODIES) {
        let block = &mut copies[..(until - first).min(BODIES)];
        let lying = bodies.structures().and_then(|all| all.get(first..first + block.len()));
        packer.write(lying.unwrap_or_else(|| {
            for (at, to) in block.iter_mut().enumerate() {
                *to = bodies.body(first + at);
            }
            block
        }));
    }
    packer.finish()
}

/// Surveys bodies and writes their records, as far as wanted, a block at a time.
struct BodyPacker<'a, 'b> {
    target: Target<'a>,
    tags: Tags<'a>,
    /// The index of the next body.
    next: usize,
    /// The ends that are not written yet.
    ends: &'a mut [End],
    velocities: Option<Velocities<'a, 'b>>,
    poses: Option<Poses<'a, 'b>>,
    good: bool,
    still: Range<usize>,
}

impl<'a, 'b> BodyPacker<'a, 'b> {
    fn new(target: Target<'a>, part: &'a mut Part<'b>) -> Self {
        let Part { range, ends, velocities, poses } = part;
        let Outcome { good, still, .. } = Outcome::default();
        Self {
            target,
            tags: Tags::new(target.shapes),
            next: range.start,
            ends,
            velocities: velocities.as_mut().map(|channels| Velocities::new(target, channels)),
            poses: poses.as_mut().map(|channels| Poses::new(target, channels)),
            good,
            still,
        }
    }

    /// Packs the next bodies, at most [`BODIES`].
    fn write(&mut self, bodies: &[Body]) {
        in_wide_vectors(Writing { packer: self, bodies });
    }

    /// Ends the segments.
    fn finish(self) -> Outcome {
        let Self { velocities, poses, good, still, .. } = self;
        let [velocities, poses] = [velocities.map(Velocities::finish), poses.map(Poses::finish)]
            .map(Option::unwrap_or_default);
        Outcome { velocities, poses, good, still }
    }
}

/// A block of bodies, and where it goes.
struct Writing<'p, 'a, 'b> {
    packer: &'p mut BodyPacker<'a, 'b>,
    bodies: &'p [Body],
}

impl Work for Writing<'_, '_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Vectors>(self, vectors: V) {
        let Self { packer, bodies } = self;
        let BodyPacker { target, tags, next, ends, velocities, poses, good, still } = packer;
        let quick = target.quick;
        let range = *next..*next + bodies.len();
        *next = range.end;
        let (written, behind) = mem::take(ends).split_at_mut(bodies.len());
        *ends = behind;
        let any_still = tags.ends(bodies, written);
        *good &= quick.is_none_or(|quick| quick.bodies(range.start, bodies, written, any_still));
        if any_still {
            *still = around(still, &range);
        }
        if let Some(velocities) = velocities {
            velocities.write(vectors, bodies);
        }
        if let Some(poses) = poses {
            poses.write(vectors, bodies);
        }
    }
}

/// The initial content of a block of copies.
const NOBODY: Body = Body {
    pose: Pose { position: [0.0; 3], orientation: [0.0; 4] },
    velocity: Velocity { linear: [0.0; 3], angular: [0.0; 3] },
    shape: 0,
};
