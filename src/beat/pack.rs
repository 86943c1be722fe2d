//! This file writes the segments of a step into the channels' buffers.
//!
//! The buffers may be write-combining memory of a board, so they are written once, upwards, in
//! whole beats, and never read: the sum that the accelerator is checked with is taken from the
//! values on their way.
//!
//! How many records there are follows from the buffers, not from a second question to the caller.

use super::stripe::{Place, Segment};
use super::unpack::{add, total};
use crate::interface::record::{Beat, LANES, collision};
use crate::record;
use crate::scene::{Bodies, Collisions};

/// Writes the velocity records of all bodies, striped over `channels`, and returns the sum of the
/// words written, modulo 2^32.
///
/// Shape: each channel is as long as [`beats_on_channel`](super::stripe::beats_on_channel) says.
pub(crate) fn pack_velocities<B: Bodies + ?Sized>(bodies: &B, channels: &mut [&mut [Beat]]) -> u32 {
    pack_pairs(Segment::Velocities, channels, |index| record::velocity::encode(&bodies.body(index)))
}

/// Writes the pose records of all bodies; otherwise as [`pack_velocities`].
pub(crate) fn pack_poses<B: Bodies + ?Sized>(bodies: &B, channels: &mut [&mut [Beat]]) -> u32 {
    pack_pairs(Segment::Poses, channels, |index| record::pose::encode(&bodies.body(index)))
}

/// Writes the records of all collisions; otherwise as [`pack_velocities`].
///
/// A body that does not exist has its position written as zeros. Validation has refused it; should
/// a caller's [`Collisions`] answer differently the second time, the accelerator refuses the index.
pub(crate) fn pack_collisions<B: Bodies + ?Sized, C: Collisions + ?Sized>(
    bodies: &B,
    collisions: &C,
    channels: &mut [&mut [Beat]],
) -> u32 {
    let body_count = bodies.len();
    let position = |index: u32| match usize::try_from(index) {
        Ok(index) if index < body_count => bodies.body(index).pose.position,
        _ => [0.0; 3],
    };
    let record = |index: usize| {
        let collision = collisions.collision(index);
        let (position_a, position_b) = (position(collision.body_a), position(collision.body_b));
        record::collision::encode(&collision, position_a, position_b)
    };
    let mut lanes = [0; LANES];
    if let [first, second, third, fourth] = channels {
        // Four channels are the board's, and here all divisions are by constants.
        let pairs = first.as_chunks_mut::<2>().0.iter_mut();
        let pairs = pairs.zip(second.as_chunks_mut::<2>().0);
        let pairs = pairs.zip(third.as_chunks_mut::<2>().0);
        for (index, (((first, second), third), fourth)) in pairs.zip(fourth.iter_mut()).enumerate()
        {
            let beats: [Beat; collision::ROWS] = record(index);
            beats.iter().for_each(|beat| add(&mut lanes, *beat));
            let [beat_0, beat_1, beat_2, beat_3, beat_4, beat_5, beat_6] = beats;
            *first = [beat_0, beat_4];
            *second = [beat_1, beat_5];
            *third = [beat_2, beat_6];
            *fourth = beat_3;
        }
    } else {
        pack_placed(Segment::Collisions, channels, &mut lanes, record);
    }
    total(lanes)
}

/// Writes records of two beats by their running index.
fn pack_pairs(
    segment: Segment,
    channels: &mut [&mut [Beat]],
    record: impl Fn(usize) -> [Beat; 2],
) -> u32 {
    let mut lanes = [0; LANES];
    if let [first, second, third, fourth] = channels {
        // Two records fill one slot of each channel; an odd last one has only the first two.
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
    } else {
        pack_placed(segment, channels, &mut lanes, record);
    }
    total(lanes)
}

/// Writes records by the definition of the striping, over any number of channels.
fn pack_placed<const BEATS: usize>(
    segment: Segment,
    channels: &mut [&mut [Beat]],
    lanes: &mut [u32; LANES],
    record: impl Fn(usize) -> [Beat; BEATS],
) {
    let count = channels.len();
    let records = channels.iter().map(|channel| channel.len()).sum::<usize>() / BEATS;
    for index in 0..records {
        for (ordinal, beat) in record(index).into_iter().enumerate() {
            let Place { channel, slot } = segment.place(index, ordinal, count);
            channels[channel][slot] = beat;
            add(lanes, beat);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::stripe::beats_on_channel;
    use super::*;
    use crate::scene::{Body, BodyArrays, Collision, CollisionArrays, Contact, Pose, Velocity};
    use proptest::prelude::*;

    /// Buffers of a segment's length, full of ones so that a beat left out is seen.
    fn buffers(segment: Segment, records: usize, channels: usize) -> Vec<Vec<Beat>> {
        (0..channels)
            .map(|channel| {
                let beats = beats_on_channel(segment, records, channel, channels);
                vec![Beat([u32::MAX; 4]); beats]
            })
            .collect()
    }

    fn packed(
        segment: Segment,
        records: usize,
        channels: usize,
        pack: impl FnOnce(&mut [&mut [Beat]]) -> u32,
    ) -> (Vec<Vec<Beat>>, u32) {
        let mut buffers = buffers(segment, records, channels);
        let mut views: Vec<&mut [Beat]> = buffers.iter_mut().map(Vec::as_mut_slice).collect();
        let sum = pack(&mut views);
        (buffers, sum)
    }

    /// Takes beats off the channels in the order in which the accelerator's table has them.
    struct Reader {
        channels: Vec<std::vec::IntoIter<Beat>>,
        next: usize,
    }

    impl Reader {
        fn new(buffers: Vec<Vec<Beat>>) -> Self {
            Self { channels: buffers.into_iter().map(Vec::into_iter).collect(), next: 0 }
        }

        fn beat(&mut self) -> [u32; 4] {
            let channel = self.next;
            self.next = (channel + 1) % self.channels.len();
            self.channels[channel].next().expect("a beat of the segment").0
        }

        /// A collision starts on channel 0 again.
        fn start_record(&mut self) {
            self.next = 0;
        }

        fn has_ended(self) -> bool {
            self.channels.into_iter().all(|mut channel| channel.next().is_none())
        }
    }

    /// A sum of what stands in the buffers, channel by channel.
    fn sum_one_by_one(buffers: &[Vec<Beat>]) -> u32 {
        let words = buffers.iter().flatten().flat_map(|beat| beat.0);
        words.fold(0, u32::wrapping_add)
    }

    fn bits3(value: [f32; 3]) -> [u32; 3] {
        value.map(f32::to_bits)
    }

    fn any_f32() -> impl Strategy<Value = f32> {
        any::<u32>().prop_map(f32::from_bits)
    }

    fn any_vec3() -> impl Strategy<Value = [f32; 3]> {
        [any_f32(), any_f32(), any_f32()]
    }

    fn any_vec4() -> impl Strategy<Value = [f32; 4]> {
        [any_f32(), any_f32(), any_f32(), any_f32()]
    }

    prop_compose! {
        fn any_body()(
            position in any_vec3(),
            orientation in any_vec4(),
            linear in any_vec3(),
            angular in any_vec3(),
            shape in any::<u32>(),
        ) -> Body {
            Body {
                pose: Pose { position, orientation },
                velocity: Velocity { linear, angular },
                shape,
            }
        }
    }

    prop_compose! {
        fn any_collision()(
            body_a in 0_u32..12,
            body_b in 0_u32..12,
            normal in any_vec3(),
            count in 1_u32..=4,
            contacts in prop::array::uniform4(any_vec4()),
        ) -> Collision {
            let contacts =
                contacts.map(|[x, y, z, distance]| Contact { point: [x, y, z], distance });
            Collision { body_a, body_b, normal, count, contacts }
        }
    }

    proptest! {
        #[test]
        fn velocities_arrive_as_they_were(
            bodies in prop::collection::vec(any_body(), 0..30),
            channels in 1_usize..=4,
        ) {
            let (buffers, sum) = packed(Segment::Velocities, bodies.len(), channels, |views| {
                pack_velocities(&bodies, views)
            });
            prop_assert_eq!(sum, sum_one_by_one(&buffers));
            let mut reader = Reader::new(buffers);
            for body in &bodies {
                let [x, y, z] = bits3(body.velocity.linear);
                prop_assert_eq!(reader.beat(), [x, y, z, body.shape]);
                let [x, y, z] = bits3(body.velocity.angular);
                prop_assert_eq!(reader.beat(), [x, y, z, 0]);
            }
            prop_assert!(reader.has_ended());
        }

        #[test]
        fn poses_arrive_as_they_were(
            bodies in prop::collection::vec(any_body(), 0..30),
            channels in 1_usize..=4,
        ) {
            let (buffers, sum) = packed(Segment::Poses, bodies.len(), channels, |views| {
                pack_poses(&bodies, views)
            });
            prop_assert_eq!(sum, sum_one_by_one(&buffers));
            let mut reader = Reader::new(buffers);
            for body in &bodies {
                let [x, y, z] = bits3(body.pose.position);
                prop_assert_eq!(reader.beat(), [x, y, z, 0]);
                prop_assert_eq!(reader.beat(), body.pose.orientation.map(f32::to_bits));
            }
            prop_assert!(reader.has_ended());
        }

        #[test]
        fn collisions_arrive_as_they_were(
            bodies in prop::collection::vec(any_body(), 12..14),
            collisions in prop::collection::vec(any_collision(), 0..30),
            channels in 1_usize..=4,
        ) {
            let (buffers, sum) = packed(Segment::Collisions, collisions.len(), channels, |views| {
                pack_collisions(&bodies, &collisions, views)
            });
            prop_assert_eq!(sum, sum_one_by_one(&buffers));
            let mut reader = Reader::new(buffers);
            for collision in &collisions {
                reader.start_record();
                let [x, y, z] = bits3(collision.normal);
                prop_assert_eq!(reader.beat(), [x, y, z, collision.count]);
                for index in [collision.body_a, collision.body_b] {
                    let [x, y, z] = bits3(bodies[index as usize].pose.position);
                    prop_assert_eq!(reader.beat(), [x, y, z, index]);
                }
                for (ordinal, contact) in (0..).zip(&collision.contacts) {
                    let [x, y, z] = bits3(contact.point);
                    let sent = [x, y, z, contact.distance.to_bits()];
                    let expected = if ordinal < collision.count { sent } else { [0; 4] };
                    prop_assert_eq!(reader.beat(), expected);
                }
            }
            prop_assert!(reader.has_ended());
        }

        #[test]
        fn separate_arrays_give_the_beats_of_an_array_of_structures(
            bodies in prop::collection::vec(any_body(), 12..20),
            collisions in prop::collection::vec(any_collision(), 0..20),
        ) {
            let mut positions: Vec<_> = bodies.iter().map(|body| body.pose.position).collect();
            let mut orientations: Vec<_> =
                bodies.iter().map(|body| body.pose.orientation).collect();
            let mut linear: Vec<_> = bodies.iter().map(|body| body.velocity.linear).collect();
            let mut angular: Vec<_> = bodies.iter().map(|body| body.velocity.angular).collect();
            let shapes: Vec<_> = bodies.iter().map(|body| body.shape).collect();
            let body_arrays = BodyArrays {
                positions: &mut positions,
                orientations: &mut orientations,
                linear_velocities: &mut linear,
                angular_velocities: &mut angular,
                shapes: &shapes,
            };
            let pairs: Vec<_> =
                collisions.iter().map(|collision| [collision.body_a, collision.body_b]).collect();
            let normals: Vec<_> = collisions.iter().map(|collision| collision.normal).collect();
            let counts: Vec<_> = collisions.iter().map(|collision| collision.count).collect();
            let contacts: Vec<_> = collisions
                .iter()
                .map(|collision| {
                    collision.contacts.map(|contact| {
                        let [x, y, z] = contact.point;
                        [x, y, z, contact.distance]
                    })
                })
                .collect();
            let collision_arrays = CollisionArrays {
                bodies: &pairs,
                normals: &normals,
                counts: &counts,
                contacts: &contacts,
            };
            let count = bodies.len();
            prop_assert_eq!(
                packed(Segment::Velocities, count, 4, |views| pack_velocities(&bodies, views)),
                packed(Segment::Velocities, count, 4, |views| pack_velocities(&body_arrays, views))
            );
            prop_assert_eq!(
                packed(Segment::Poses, count, 4, |views| pack_poses(&bodies, views)),
                packed(Segment::Poses, count, 4, |views| pack_poses(&body_arrays, views))
            );
            prop_assert_eq!(
                packed(Segment::Collisions, collisions.len(), 4, |views| {
                    pack_collisions(&bodies, &collisions, views)
                }),
                packed(Segment::Collisions, collisions.len(), 4, |views| {
                    pack_collisions(&body_arrays, &collision_arrays, views)
                })
            );
        }
    }

    #[test]
    fn a_body_that_does_not_exist_is_sent_with_a_position_of_zeros() {
        let collision = Collision {
            body_a: 3,
            body_b: u32::MAX,
            normal: [0.0, 1.0, 0.0],
            count: 1,
            contacts: [Contact::default(); 4],
        };
        let bodies: [Body; 0] = [];
        let (buffers, _) = packed(Segment::Collisions, 1, 4, |views| {
            pack_collisions(bodies.as_slice(), [collision].as_slice(), views)
        });
        assert_eq!(buffers[1][0], Beat([0, 0, 0, 3]));
        assert_eq!(buffers[2][0], Beat([0, 0, 0, u32::MAX]));
    }
}
