//! Writes velocity and pose records, a block at a time.

use pgs_interface::profile::Inertia;
use pgs_interface::record::{Beat, pose, velocity};
use pgs_support::chunks::Chunks;

use super::stripe_writer::StripeWriter;
use super::target::Target;
use crate::beat::format::Records;
use crate::beat::stripe::Segment;
use crate::record::{self, Record, Rows};
use crate::scene::{Body, Shape};
use crate::simd::Vectors;

/// Writes velocity records.
pub(crate) struct Velocities<'a, 'b> {
    shapes: &'a [Shape],
    streamed_masses: bool,
    dealer: StripeWriter<'a, 'b>,
    inertia: Inertia,
}

impl<'a, 'b> Velocities<'a, 'b> {
    /// From the first record of a group on.
    pub(crate) fn new(target: Target<'a>, channels: &'a mut [&'b mut [Beat]]) -> Self {
        let layout = Segment::Velocities.layout(target.variant);
        let inertia = target.variant.inertia;
        let Target { shapes, streamed_masses, .. } = target;
        Self { shapes, streamed_masses, dealer: StripeWriter::new(&layout, channels), inertia }
    }

    /// Writes the records of the next block of bodies. A block has
    /// [`BODIES`](super::stripe_writer::BODIES) bodies, and only the last block may have fewer.
    #[inline(always)]
    pub(crate) fn write<V: Vectors>(&mut self, vectors: V, bodies: &[Body]) {
        match self.inertia {
            Inertia::Isotropic => {
                self.dealer.write(vectors, &mut Isotropic(bodies));
            }
            Inertia::World => {
                let Self { shapes, streamed_masses, .. } = *self;
                let mut records = World { bodies, shapes, streamed_masses };
                self.dealer.write(vectors, &mut records);
            }
        }
    }

    /// Ends the segment; the sum of the words written, modulo 2^32.
    pub(crate) fn finish(self) -> u32 {
        self.dealer.finish()
    }
}

/// Writes pose records.
pub(crate) struct Poses<'a, 'b> {
    dealer: StripeWriter<'a, 'b>,
}

impl<'a, 'b> Poses<'a, 'b> {
    /// From the first record of a group on.
    pub(crate) fn new(target: Target<'_>, channels: &'a mut [&'b mut [Beat]]) -> Self {
        let layout = Segment::Poses.layout(target.variant);
        Self { dealer: StripeWriter::new(&layout, channels) }
    }

    /// Writes the records of the next block of bodies. A block has
    /// [`BODIES`](super::stripe_writer::BODIES) bodies, and only the last block may have fewer.
    #[inline(always)]
    pub(crate) fn write<V: Vectors>(&mut self, vectors: V, bodies: &[Body]) {
        self.dealer.write(vectors, &mut OfPoses(bodies));
    }

    /// Ends the segment; the sum of the words written, modulo 2^32.
    pub(crate) fn finish(self) -> u32 {
        self.dealer.finish()
    }
}

/// The velocity records of bodies.
#[derive(Clone, Copy)]
struct Isotropic<'a>(&'a [Body]);

impl Records<{ velocity::ROWS }> for Isotropic<'_> {
    #[inline(always)]
    fn len(&self) -> usize {
        self.0.len()
    }

    #[inline(always)]
    fn some<const N: usize>(&mut self, nth: usize, to: &mut impl Rows) -> Option<()> {
        give::<{ velocity::ROWS }, N>(self.0, nth, record::velocity::encode, to)
    }
}

/// The velocity records of bodies, with their inertia.
#[derive(Clone, Copy)]
struct World<'a> {
    bodies: &'a [Body],
    shapes: &'a [Shape],
    streamed_masses: bool,
}

impl Records<{ velocity::WORLD_ROWS }> for World<'_> {
    #[inline(always)]
    fn len(&self) -> usize {
        self.bodies.len()
    }

    #[inline(always)]
    fn some<const N: usize>(&mut self, nth: usize, to: &mut impl Rows) -> Option<()> {
        let Self { shapes, streamed_masses, .. } = *self;
        let record = |body: &Body| world_velocity(body, shapes, streamed_masses);
        give::<{ velocity::WORLD_ROWS }, N>(self.bodies, nth, record, to)
    }
}

/// The pose records of bodies.
#[derive(Clone, Copy)]
struct OfPoses<'a>(&'a [Body]);

impl Records<{ pose::ROWS }> for OfPoses<'_> {
    #[inline(always)]
    fn len(&self) -> usize {
        self.0.len()
    }

    #[inline(always)]
    fn some<const N: usize>(&mut self, nth: usize, to: &mut impl Rows) -> Option<()> {
        let record = |body: &Body| record::pose::encode(body).into();
        give::<{ pose::ROWS }, N>(self.0, nth, record, to)
    }
}

/// Gives the rows of the `nth` chunk of `N` bodies to `to`; `record` makes the record of a body.
#[inline(always)]
fn give<const ROWS: usize, const N: usize>(
    bodies: &[Body],
    nth: usize,
    record: impl Fn(&Body) -> Record<ROWS>,
    to: &mut impl Rows,
) -> Option<()> {
    for body in bodies.split_arrays::<N>().0.get(nth)? {
        record(body).give(to);
    }
    Some(())
}

/// The velocity record of a body with its inertia, and with its inverse mass where masses are
/// streamed.
#[inline(always)]
fn world_velocity(
    body: &Body,
    shapes: &[Shape],
    streamed_masses: bool,
) -> Record<{ velocity::WORLD_ROWS }> {
    let shape = usize::try_from(body.shape).ok().and_then(|shape| shapes.get(shape));
    let shape = shape.unwrap_or(&Shape::STATIC);
    let inertia = record::inertia::about_world_axes(shape, body.pose.orientation);
    let inverse_mass = if streamed_masses { shape.inverse_mass } else { 0.0 };
    record::velocity::encode_world(body, &inertia, inverse_mass)
}
