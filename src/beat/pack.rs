//! This file writes the segments of a step into the channels' buffers.
//!
//! The buffers may be write-combining memory of a board, so they are written once, upwards, in
//! whole beats, and never read: the sum that the accelerator is checked with is taken from the
//! values on their way.
//!
//! Records become rows (`record`), rows become beats ([`Writer`]), the profile's stripe deals these
//! out. The stripes of `float`, through which most bytes go, are written out.

use bitstream_model::interface::profile::{Geometry, Inertia, Variant};
use bitstream_model::interface::record::{Beat, LANES, pose, velocity};
use bitstream_model::interface::stripe::Stripe;

use super::stripe::{Deal, Layout, Place, Segment};
use super::unpack::{add, total};
use crate::record;
use crate::record::sixteen::{Row, Sixteen};
use crate::scene::{Bodies, Body, Collision, Collisions, Pose, Shape, Velocity};

/// Stripes with a path of their own.
const FLOAT_BODIES: Stripe = Stripe { streams: &[0, 1, 2, 3], padded: false };
const FLOAT_COLLISIONS: Stripe = Stripe { streams: &[0, 1, 2, 3, 0, 1, 2], padded: false };

/// Writes the velocity records of `count` bodies, and their inertia where the bitstream wants it;
/// returns the sum of the words written, modulo 2^32.
///
/// Shape: each channel is as long as [`Layout::beats_on_channel`] says.
pub(crate) fn pack_velocities<B: Bodies + ?Sized>(
    variant: &Variant,
    bodies: &B,
    count: usize,
    shapes: &[Shape],
    channels: &mut [&mut [Beat]],
) -> u32 {
    let layout = Segment::Velocities.layout(variant);
    match variant.inertia {
        Inertia::Isotropic => {
            let integers = &record::velocity::INTEGERS;
            let record = |index| record::velocity::encode(&bodies.body(index));
            pack_pairs(&layout, count, integers, channels, record)
        }
        Inertia::World => {
            let integers = &record::velocity::WORLD_INTEGERS;
            let record = |index| world_velocity(&bodies.body(index), shapes);
            pack_dealt(&layout, count, integers, channels, record)
        }
    }
}

/// Writes the pose records of `count` bodies; otherwise as [`pack_velocities`].
pub(crate) fn pack_poses<B: Bodies + ?Sized>(
    variant: &Variant,
    bodies: &B,
    count: usize,
    channels: &mut [&mut [Beat]],
) -> u32 {
    let layout = Segment::Poses.layout(variant);
    let record = |index| record::pose::encode(&bodies.body(index));
    pack_pairs(&layout, count, &record::pose::INTEGERS, channels, record)
}

/// Writes the records of `count` collisions; otherwise as [`pack_velocities`].
///
/// A body that does not exist has its position written as zeros, and one without a shape is static.
/// Validation has refused it; should a caller's [`Collisions`] answer differently the second time,
/// the accelerator refuses the index.
pub(crate) fn pack_collisions<B: Bodies + ?Sized, C: Collisions + ?Sized>(
    variant: &Variant,
    bodies: &B,
    collisions: &C,
    count: usize,
    shapes: &[Shape],
    channels: &mut [&mut [Beat]],
) -> u32 {
    let body_count = bodies.len();
    let position = |index| body(bodies, body_count, index).map_or([0.0; 3], |b| b.pose.position);
    let layout = Segment::Collisions.layout(variant);
    match variant.profile.geometry {
        Geometry::Absolute => {
            let integers = &record::collision::INTEGERS;
            pack_sevens(&layout, count, integers, channels, |index| {
                let collision = collisions.collision(index);
                let (a, b) = (position(collision.body_a), position(collision.body_b));
                record::collision::encode(&collision, a, b)
            })
        }
        Geometry::Relative => {
            let integers = &record::relative::INTEGERS;
            pack_dealt(&layout, count, integers, channels, |index| {
                let collision = collisions.collision(index);
                let [a, b] = anchors(bodies, body_count, &collision, shapes);
                record::relative::encode(&collision, a, b)
            })
        }
    }
}

/// What no record of a live body holds; the accelerator refuses a collision of it with itself.
const REFUSED: [u32; 2] = [u32::MAX; 2];

/// Writes the records of collisions with these words in place of the bodies' indices; otherwise as
/// [`pack_collisions`]. Only for [`Geometry::Relative`].
///
/// Nobody reads the marks of padding, so that a collision which had contact points when the marks
/// were made and has none now would shift all bodies behind it: it is sent as one to be refused.
pub(crate) fn pack_marked_collisions<B: Bodies + ?Sized, C: Collisions + ?Sized>(
    variant: &Variant,
    bodies: &B,
    collisions: &C,
    words: &[[u32; 2]],
    shapes: &[Shape],
    channels: &mut [&mut [Beat]],
) -> u32 {
    let body_count = bodies.len();
    let layout = Segment::Collisions.layout(variant);
    pack_dealt(&layout, words.len(), &record::relative::INTEGERS, channels, |index| {
        let mut collision = collisions.collision(index);
        let [a, b] = anchors(bodies, body_count, &collision, shapes);
        let mut words = words[index];
        if collision.count == 0 && words != [0; 2] {
            (collision.count, words) = (1, REFUSED);
        }
        [collision.body_a, collision.body_b] = words;
        record::relative::encode(&collision, a, b)
    })
}

/// The body of that index, if there is one.
fn body<B: Bodies + ?Sized>(bodies: &B, count: usize, index: u32) -> Option<Body> {
    match usize::try_from(index) {
        Ok(index) if index < count => Some(bodies.body(index)),
        _ => None,
    }
}

/// The positions that the relative record of a collision is made from.
#[inline]
fn anchors<B: Bodies + ?Sized>(
    bodies: &B,
    count: usize,
    collision: &Collision,
    shapes: &[Shape],
) -> [[f32; 3]; 2] {
    let end = |index| {
        let Some(body) = body(bodies, count, index) else { return ([0.0; 3], false) };
        (body.pose.position, !shape_of(&body, shapes).is_static())
    };
    let ((a, a_moves), (b, b_moves)) = (end(collision.body_a), end(collision.body_b));
    record::relative::anchors([a, b], [a_moves, b_moves])
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

/// The shape of a body; a static one for a shape that is not in the table.
fn shape_of<'a>(body: &Body, shapes: &'a [Shape]) -> &'a Shape {
    let shape = usize::try_from(body.shape).ok().and_then(|shape| shapes.get(shape));
    shape.unwrap_or(&Shape::STATIC)
}

/// The velocity record of a body with its inertia.
fn world_velocity(body: &Body, shapes: &[Shape]) -> [Beat; velocity::WORLD_ROWS] {
    let shape = shape_of(body, shapes);
    let inertia = record::inertia::about_world_axes(shape, body.pose.orientation);
    record::velocity::encode_world(body, &inertia)
}

/// Writes records of seven rows.
fn pack_sevens(
    layout: &Layout,
    count: usize,
    integers: &[bool; 7],
    channels: &mut [&mut [Beat]],
    record: impl Fn(usize) -> [Beat; 7],
) -> u32 {
    let (FLOAT_COLLISIONS, None, [first, second, third, fourth]) =
        (layout.stripe, Sixteen::of(layout.format), &mut *channels)
    else {
        return pack_dealt(layout, count, integers, channels, record);
    };
    // Here all divisions are by constants.
    let mut lanes = [0; LANES];
    let pairs = first.as_chunks_mut::<2>().0.iter_mut();
    let pairs = pairs.zip(second.as_chunks_mut::<2>().0);
    let pairs = pairs.zip(third.as_chunks_mut::<2>().0);
    for (index, (((first, second), third), fourth)) in pairs.zip(fourth.iter_mut()).enumerate() {
        let beats = record(index);
        beats.iter().for_each(|beat| add(&mut lanes, *beat));
        let [beat_0, beat_1, beat_2, beat_3, beat_4, beat_5, beat_6] = beats;
        *first = [beat_0, beat_4];
        *second = [beat_1, beat_5];
        *third = [beat_2, beat_6];
        *fourth = beat_3;
    }
    total(lanes)
}

/// Writes records of two rows.
fn pack_pairs(
    layout: &Layout,
    count: usize,
    integers: &[bool; pose::ROWS],
    channels: &mut [&mut [Beat]],
    record: impl Fn(usize) -> [Beat; pose::ROWS],
) -> u32 {
    let (FLOAT_BODIES, None, [first, second, third, fourth]) =
        (layout.stripe, Sixteen::of(layout.format), &mut *channels)
    else {
        return pack_dealt(layout, count, integers, channels, record);
    };
    // Two records fill one slot of each channel; an odd last one has only the first two.
    let mut lanes = [0; LANES];
    let mut encode = |index| {
        let beats = record(index);
        beats.iter().for_each(|beat| add(&mut lanes, *beat));
        beats
    };
    let whole = fourth.len();
    let (first, first_tail) = first.split_at_mut(whole);
    let (second, second_tail) = second.split_at_mut(whole);
    let slots = first.iter_mut().zip(second).zip(third.iter_mut()).zip(fourth.iter_mut());
    for (slot, (((first, second), third), fourth)) in slots.enumerate() {
        [*first, *second] = encode(2 * slot);
        [*third, *fourth] = encode(2 * slot + 1);
    }
    for (first, second) in first_tail.iter_mut().zip(second_tail) {
        [*first, *second] = encode(2 * whole);
    }
    total(lanes)
}

/// Writes records of any kind over any stripe, and its padding.
fn pack_dealt<const ROWS: usize>(
    layout: &Layout,
    count: usize,
    integers: &[bool; ROWS],
    channels: &mut [&mut [Beat]],
    record: impl Fn(usize) -> [Beat; ROWS],
) -> u32 {
    let mut writer = Writer::new(layout, channels);
    match Sixteen::of(layout.format) {
        None => {
            for index in 0..count {
                record(index).into_iter().for_each(|row| writer.push(row));
            }
        }
        Some(format) => {
            for index in 0..count {
                writer.push_rows(&format.narrow(&record(index), integers));
            }
        }
    }
    writer.finish(layout.stripe.padded)
}

/// Deals beats out to the channels and adds up their words.
struct Writer<'a, 'b> {
    channels: &'a mut [&'b mut [Beat]],
    deal: Deal,
    lanes: [u32; LANES],
    /// A row of sixteen bits that waits for the other half of its beat.
    half: Option<Row>,
}

impl<'a, 'b> Writer<'a, 'b> {
    fn new(layout: &Layout, channels: &'a mut [&'b mut [Beat]]) -> Self {
        Self { channels, deal: Deal::new(layout.stripe), lanes: [0; LANES], half: None }
    }

    #[inline]
    fn push(&mut self, beat: Beat) {
        let Place { channel, slot } = self.deal.next();
        self.channels[channel][slot] = beat;
        add(&mut self.lanes, beat);
    }

    /// Two rows a beat, without a gap between records.
    #[inline]
    fn push_rows(&mut self, mut rows: &[Row]) {
        if let (Some(low), [high, rest @ ..]) = (self.half, rows) {
            self.half = None;
            self.push(bytemuck::cast([low, *high]));
            rows = rest;
        }
        let (pairs, last) = rows.as_chunks::<2>();
        for pair in pairs {
            self.push(bytemuck::cast(*pair));
        }
        if let [row] = last {
            self.half = Some(*row);
        }
    }

    /// Fills the last beat, and the last group if the stripe says so; the sum of all words.
    fn finish(mut self, padded: bool) -> u32 {
        if let Some(low) = self.half.take() {
            self.push(bytemuck::cast([low, Row::default()]));
        }
        while padded && !self.deal.at_end_of_group() {
            self.push(Beat::default());
        }
        total(self.lanes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::interface::profile::FLOAT;
    use crate::interface::stripe::Stripes;

    /// Or `float` takes the slow path.
    #[test]
    fn the_stripes_with_a_path_of_their_own_are_those_of_float() {
        assert_eq!(FLOAT.stripes, Stripes::new(FLOAT_COLLISIONS, FLOAT_BODIES));
    }
}
