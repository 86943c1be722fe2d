//! This file writes velocity and pose records, a block at a time.

use bitstream_model::interface::profile::Inertia;
use bitstream_model::interface::record::{Beat, pose, velocity};

use super::deal::Dealer;
use super::format::Records;
use super::stripe::Segment;
use super::target::Target;
use crate::platform::{Lanes, Vectors};
use crate::record;
use crate::scene::{Body, Shape};

/// Writes velocity records.
pub(super) struct Velocities<'a, 'b> {
    shapes: &'a [Shape],
    dealer: Dealer<'a, 'b>,
    inertia: Inertia,
}

impl<'a, 'b> Velocities<'a, 'b> {
    /// From the first record of a group on.
    pub(super) fn new(target: Target<'a>, channels: &'a mut [&'b mut [Beat]]) -> Self {
        let layout = Segment::Velocities.layout(target.variant);
        let inertia = target.variant.inertia;
        Self { shapes: target.shapes, dealer: Dealer::new(&layout, channels), inertia }
    }

    /// Writes those of the next bodies, at most [`BODIES`](super::deal::BODIES); only the last may be fewer.
    #[inline(always)]
    pub(super) fn write<V: Vectors>(&mut self, vectors: V, bodies: &[Body]) {
        match self.inertia {
            Inertia::Isotropic => {
                self.dealer.write(vectors, &mut Isotropic(bodies));
            }
            Inertia::World => {
                let mut records = World { bodies, shapes: self.shapes };
                self.dealer.write(vectors, &mut records);
            }
        }
    }

    /// Ends the segment; the sum of the words written, modulo 2^32.
    pub(super) fn finish(self) -> u32 {
        self.dealer.finish()
    }
}

/// Writes pose records.
pub(super) struct Poses<'a, 'b> {
    dealer: Dealer<'a, 'b>,
}

impl<'a, 'b> Poses<'a, 'b> {
    /// From the first record of a group on.
    pub(super) fn new(target: Target<'_>, channels: &'a mut [&'b mut [Beat]]) -> Self {
        let layout = Segment::Poses.layout(target.variant);
        Self { dealer: Dealer::new(&layout, channels) }
    }

    /// Writes those of the next bodies, at most [`BODIES`](super::deal::BODIES); only the last may be fewer.
    #[inline(always)]
    pub(super) fn write<V: Vectors>(&mut self, vectors: V, bodies: &[Body]) {
        self.dealer.write(vectors, &mut OfPoses(bodies));
    }

    /// Ends the segment; the sum of the words written, modulo 2^32.
    pub(super) fn finish(self) -> u32 {
        self.dealer.finish()
    }
}

/// The velocity records of bodies.
struct Isotropic<'a>(&'a [Body]);

impl Records<{ velocity::ROWS }> for Isotropic<'_> {
    const INTEGERS: [bool; velocity::ROWS] = record::velocity::INTEGERS;

    #[inline(always)]
    fn len(&self) -> usize {
        self.0.len()
    }

    #[inline(always)]
    fn some<const N: usize>(&mut self, nth: usize) -> Option<[[Lanes; velocity::ROWS]; N]> {
        some(self.0, nth, record::velocity::encode)
    }
}

/// The same, with their inertia.
struct World<'a> {
    bodies: &'a [Body],
    shapes: &'a [Shape],
}

impl Records<{ velocity::WORLD_ROWS }> for World<'_> {
    const INTEGERS: [bool; velocity::WORLD_ROWS] = record::velocity::WORLD_INTEGERS;

    #[inline(always)]
    fn len(&self) -> usize {
        self.bodies.len()
    }

    #[inline(always)]
    fn some<const N: usize>(&mut self, nth: usize) -> Option<[[Lanes; velocity::WORLD_ROWS]; N]> {
        some(self.bodies, nth, |body| world_velocity(body, self.shapes))
    }
}

/// The pose records of bodies.
struct OfPoses<'a>(&'a [Body]);

impl Records<{ pose::ROWS }> for OfPoses<'_> {
    const INTEGERS: [bool; pose::ROWS] = record::pose::INTEGERS;

    #[inline(always)]
    fn len(&self) -> usize {
        self.0.len()
    }

    #[inline(always)]
    fn some<const N: usize>(&mut self, nth: usize) -> Option<[[Lanes; pose::ROWS]; N]> {
        some(self.0, nth, record::pose::encode)
    }
}

/// The records of the `nth` so many bodies.
#[inline(always)]
fn some<const ROWS: usize, const N: usize>(
    bodies: &[Body],
    nth: usize,
    record: impl Fn(&Body) -> [Lanes; ROWS],
) -> Option<[[Lanes; ROWS]; N]> {
    let bodies = bodies.as_chunks::<N>().0.get(nth)?;
    let mut records = [[Lanes::all(0); ROWS]; N];
    for (to, body) in records.iter_mut().zip(bodies) {
        *to = record(body);
    }
    Some(records)
}

/// The velocity record of a body with its inertia.
#[inline(always)]
fn world_velocity(body: &Body, shapes: &[Shape]) -> [Lanes; velocity::WORLD_ROWS] {
    let shape = usize::try_from(body.shape).ok().and_then(|shape| shapes.get(shape));
    let shape = shape.unwrap_or(&Shape::STATIC);
    let inertia = record::inertia::about_world_axes(shape, body.pose.orientation);
    record::velocity::encode_world(body, &inertia)
}
