//! Writes the velocity and pose segments of a step into the channels' buffers.
//!
//! Threads take ranges of bodies, and a range goes by blocks that fit in the cache. Packing checks
//! the caller's bodies on the way. It reports that the input is wrong, but not the cause.

use std::ops::Range;

use pgs_interface::profile::Inertia;
use pgs_interface::record::{Beat, velocity};

use super::Target;
use super::deal::Dealer;
use super::format::beats_of;
use super::pool::{ChannelChunks, PackPool, Piece, ranges, whole};
use super::stripe::{BLOCK, Segment};
use crate::record::Magnitudes;
use crate::record::body::{pose, vectors, velocity, world_velocity};
use crate::record::body_table::{End, Table};
use crate::scene::{Bodies, Body, Pose, Shape, Velocity};
use crate::validate::Scene;

/// Data on the bodies of a step that packing collects. It is kept, so that a step allocates
/// nothing.
#[derive(Debug)]
pub(crate) struct Survey<'a> {
    /// The ends that collision records are made from.
    pub(crate) ends: &'a mut Table,
    /// The indices of static bodies, in ascending order.
    pub(crate) statics: &'a mut Vec<u32>,
}

/// Surveys `count` bodies and writes their velocity and pose records, velocities with the inertia
/// where the bitstream wants it; the sums of both, modulo 2^32, and whether validation accepts all
/// bodies.
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
    let work = |part: Part<'_>| pack_range(bodies, part);
    pack_parts(target, count, into, (velocities, poses), packers, &work)
}

/// A range of bodies, their ends, and their packer.
type Part<'a> = (Range<usize>, &'a mut [End], BodyPacker<'a>);

/// [`pack_bodies`] by the work on each range.
fn pack_parts(
    target: Target<'_>,
    count: usize,
    into: Survey<'_>,
    (velocities, poses): (&mut [&mut [Beat]], &mut [&mut [Beat]]),
    packers: &mut PackPool,
    work: &(dyn Fn(Part<'_>) -> ([u32; 2], bool) + Sync),
) -> (u32, u32, bool) {
    let (mut sums, mut good) = ([0_u32; 2], true);
    let ends = into.ends.anew(count);
    let (velocities, poses) = (whole(velocities), whole(poses));
    let cut = |size| {
        let chunks = |segment: Segment, channels| {
            ChannelChunks::new(&segment.layout(target.scene.variant), size, channels)
        };
        let mut velocities = chunks(Segment::Velocities, velocities);
        let mut poses = chunks(Segment::Poses, poses);
        ranges(count, size).zip(ends.chunks_mut(size)).map(move |(range, ends)| {
            (range, ends, BodyPacker::new(target, velocities.cut(), poses.cut()))
        })
    };
    packers.each(count, cut, work, |(of_range, also): ([u32; 2], bool)| {
        sums = [sums[0].wrapping_add(of_range[0]), sums[1].wrapping_add(of_range[1])];
        good &= also;
    });
    into.statics.clear();
    into.statics.extend(into.ends.statics());
    (sums[0], sums[1], good)
}

/// Packs a range of bodies; the sums of its velocities and poses, and whether validation accepts
/// all bodies.
///
/// Only this function depends on the caller's container: it finds where the bodies of a block lie.
#[inline]
fn pack_range<B: Bodies + ?Sized>(
    bodies: &B,
    (range, ends, mut packer): Part<'_>,
) -> ([u32; 2], bool) {
    let mut copies = [NOBODY; BLOCK];
    for (first, ends) in range.step_by(BLOCK).zip(ends.chunks_mut(BLOCK)) {
        let copies = &mut copies[..ends.len()];
        let lying = bodies.structures().and_then(|all| all.get(first..first + ends.len()));
        let block = lying.unwrap_or_else(|| {
            for (at, to) in copies.iter_mut().enumerate() {
                *to = bodies.body(first + at);
            }
            copies
        });
        packer.write(block, ends);
    }
    ([packer.velocities.sum(), packer.poses.sum()], packer.good)
}

/// Surveys, checks and writes bodies, a block at a time.
struct BodyPacker<'a> {
    target: Target<'a>,
    velocities: Dealer<'a>,
    poses: Dealer<'a>,
    good: bool,
}

impl<'a> BodyPacker<'a> {
    fn new(target: Target<'a>, velocities: Piece<'a>, poses: Piece<'a>) -> Self {
        let dealer = |segment: Segment, channels| {
            Dealer::new(segment.layout(target.scene.variant), channels)
        };
        let velocities = dealer(Segment::Velocities, velocities);
        let poses = dealer(Segment::Poses, poses);
        Self { target, velocities, poses, good: true }
    }

    /// Packs the next bodies, at most [`BLOCK`].
    fn write(&mut self, bodies: &[Body], ends: &mut [End]) {
        let Self { target: Target { scene, streamed_masses }, velocities, poses, good } = self;
        *good &= survey(scene, bodies, ends);
        match scene.variant.inertia {
            Inertia::Isotropic => deal(velocities, bodies, &[velocity::LINEAR], velocity),
            Inertia::World => deal(velocities, bodies, &[velocity::LINEAR], |body, rows| {
                let shape = scene.shape_of(body).unwrap_or(&Shape::STATIC);
                world_velocity(body, shape, *streamed_masses, rows);
            }),
        }
        deal(poses, bodies, &[], pose);
    }
}

/// Makes the ends of bodies, and says whether validation accepts all of them.
fn survey(scene: &Scene<'_>, bodies: &[Body], ends: &mut [End]) -> bool {
    let mut good = true;
    let [mut speeds, mut poses] = [Magnitudes::default(); 2];
    let limit = scene.held.collisions.largest();
    for (body, end) in bodies.iter().zip(ends) {
        let [linear, angular, position, orientation] = vectors(body);
        speeds.see(linear);
        speeds.see(angular);
        // The word beside the position is one of the orientation.
        poses.see(position);
        poses.see(orientation);
        let shape = scene.shape_of(body);
        *end = End::of(body, shape, limit);
        good &= scene.accepts_body(body, shape);
    }
    good & speeds.of_vec3_are_within(scene.held.velocities.largest())
        & poses.are_within(scene.held.poses.largest())
}

/// Writes a record of each body. `integers` are the rows that end in an integer.
fn deal<const ROWS: usize>(
    dealer: &mut Dealer<'_>,
    bodies: &[Body],
    integers: &[usize],
    record: impl Fn(&Body, &mut [Beat; ROWS]),
) {
    let mut rows = [[Beat::default(); ROWS]; BLOCK];
    let mut halves = [[Beat::default(); ROWS]; BLOCK.div_ceil(2)];
    for (to, body) in rows.iter_mut().zip(bodies) {
        record(body, to);
    }
    let (layout, halves) = (dealer.layout, halves.as_flattened_mut());
    dealer.write(beats_of(&layout, (&mut rows, bodies.len()), integers, halves));
}

/// The initial content of a block of copies.
const NOBODY: Body = Body {
    pose: Pose { position: [0.0; 3], orientation: [0.0; 4] },
    velocity: Velocity { linear: [0.0; 3], angular: [0.0; 3] },
    shape: 0,
};
