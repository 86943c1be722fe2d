//! Holds the segments of warm passes against the other segments and against the layout.

use half::f16;
use proptest::prelude::*;

use super::{buffers, scene, surveyed, views};
use crate::beat::Target;
use crate::beat::collisions::{Entries, pack_collisions};
use crate::beat::impulses::WarmSegments;
use crate::beat::pool::{PackPool, RANGE};
use crate::beat::stripe::{Place, Segment};
use crate::scene::{Body, Collision, Contact, Impulses, Pose, Shape, Velocity, WarmCollisions};
use pgs_interface::profile::{FLOAT, HALF, NAIVE, Profile};
use pgs_interface::record::Beat;

const SHAPES: [Shape; 2] = [Shape::STATIC, Shape::isotropic(1.0, 1.5)];
const PROFILES: [&Profile; 3] = [&NAIVE, &FLOAT, &HALF];
const BODIES: u16 = 7;

/// Beats of an issue in every pass, and in a warm pass, by hand.
const BEATS_OF_ISSUE: [usize; 2] = [7, 8];

/// The words of rows of impulses in a beat.
fn beat_of(profile: &Profile, rows: &[[f32; 4]]) -> Beat {
    if profile.numbers.collisions.bits() == 32 {
        return Beat(rows[0].map(f32::to_bits));
    }
    let mut words = rows.iter().flatten().map(|number| u32::from(f16::from_f32(*number).to_bits()));
    let mut word = || words.next().unwrap_or_default();
    Beat(std::array::from_fn(|_| word() | word() << 16))
}

/// The first of the bodies is static.
fn body(index: u16) -> Body {
    let position = [0.5, 1.25 * f32::from(index), -1.0];
    let pose = Pose { position, orientation: [0.0, 0.0, 0.0, 1.0] };
    Body { pose, velocity: Velocity::default(), shape: u32::from(index > 0) }
}

fn any_number() -> impl Strategy<Value = f32> {
    prop_oneof![
        4 => -9.0_f32..9.0,
        1 => -65_504.0_f32..65_504.0,
        1 => -1e-6_f32..1e-6,
        1 => Just(-0.0)
    ]
}

prop_compose! {
    fn any_collision()(
        (a, b) in (0..BODIES, 1..BODIES),
        count in 0_u32..=4,
        numbers in prop::array::uniform5(prop::array::uniform4(any_number())),
        impulses in prop::array::uniform6(any_number()),
    ) -> (Collision, Impulses) {
        let [[x, y, z, _], points @ ..] = numbers;
        let contact = |[x, y, z, distance]: [f32; 4]| Contact { point: [x, y, z], distance };
        let [body_a, body_b] = [a, (a + b) % BODIES].map(u32::from);
        let contacts = points.map(contact);
        let [first, second, third, fourth, friction @ ..] = impulses;
        let normal = [first, second, third, fourth];
        let collision = Collision { body_a, body_b, normal: [x, y, z], count, contacts };
        (collision, Impulses { normal, friction })
    }
}

fn any_count() -> impl Strategy<Value = usize> {
    prop_oneof![3 => 0_usize..70, 1 => RANGE - 2..RANGE + 3, 1 => 2 * RANGE..2 * RANGE + 40]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn impulses_lie_behind_the_beats_that_their_issue_has_in_every_pass(
        profile in prop::sample::select(&PROFILES[..]),
        some in prop::collection::vec(any_collision(), 1..40),
        count in any_count(),
        threads in 1..=3_usize,
    ) {
        let variant = profile.default_variant();
        let (collisions, impulses): (Vec<_>, Vec<_>) =
            some.iter().copied().cycle().take(count).unzip();
        let mut packers = PackPool::new(Some(threads));
        let scene = scene(&variant, &SHAPES);
        let target = Target { scene: &scene, streamed_masses: false };
        let bodies: Vec<Body> = (0..BODIES).map(body).collect();
        let (table, _) = surveyed(target, &bodies);
        let mut usual = buffers(&variant, Segment::Collisions, count);
        let channel = profile.mm2s_widths.len() - 1;
        let mut kinds = [(); 2].map(|()| {
            buffers(&variant, Segment::WarmCollisions, count).remove(channel)
        });
        let [contact, friction] = &mut kinds;
        let segments = Some(WarmSegments { channel, contact, friction });
        let warm = WarmCollisions { collisions: &collisions, impulses: &impulses };
        let entries = Entries { collisions: &warm, count, added: None };
        let views = &mut views(&mut usual);
        let packed =
            pack_collisions(target, table.ends(), &entries, views, segments, &mut packers);
        let words = usual.iter().flatten().flat_map(|beat| beat.0);
        prop_assert_eq!(packed.sum, words.fold(0, u32::wrapping_add), "without the impulses");
        let sums = packed.warm;

        let layouts = [Segment::Collisions, Segment::WarmCollisions].map(|of| of.layout(&variant));
        let [in_every_pass, all] = BEATS_OF_ISSUE;
        let together = profile.collisions_per_issue as usize;
        let mut written = 0;
        for (issue, first) in (0..count).step_by(together).enumerate() {
            for beat in 0..in_every_pass {
                let [usual_at, warm_at] = [
                    layouts[0].place(issue * in_every_pass + beat),
                    layouts[1].place(issue * all + beat),
                ];
                prop_assert_eq!(usual_at.channel, warm_at.channel);
                if warm_at.channel == channel {
                    let expected = usual[channel][usual_at.slot];
                    prop_assert_eq!(kinds[0][warm_at.slot], expected);
                    prop_assert_eq!(kinds[1][warm_at.slot], expected);
                    written += 1;
                } else {
                    prop_assert_eq!(usual_at.slot, warm_at.slot, "the other channels are the same");
                }
            }
            let rows = |kind: usize| -> Vec<[f32; 4]> {
                let of_issue = (first..count.min(first + together)).map(|index| {
                    let points = collisions[index].count as usize;
                    let Impulses { normal, friction: [g0, g1] } = impulses[index];
                    match (kind, points) {
                        (_, 0) => [0.0; 4],
                        (0, _) => std::array::from_fn(|k| if k < points { normal[k] } else { 0.0 }),
                        _ => [g0, g1, 0.0, 0.0],
                    }
                });
                of_issue.collect()
            };
            let place = layouts[1].place(issue * all + in_every_pass);
            prop_assert_eq!(place, Place { channel, slot: place.slot });
            for (kind, beats) in kinds.iter().enumerate() {
                prop_assert_eq!(beats[place.slot], beat_of(profile, &rows(kind)), "kind {}", kind);
            }
            written += 1;
        }
        prop_assert_eq!(written, kinds[0].len(), "no other beat");
        let impulse_sum = |kind: usize| -> u32 {
            let slots = (0..count.div_ceil(together)).map(|issue| issue * all + in_every_pass);
            let words = slots.flat_map(|beat| kinds[kind][layouts[1].place(beat).slot].0);
            words.fold(0, u32::wrapping_add)
        };
        prop_assert_eq!([sums.contact, sums.friction], [impulse_sum(0), impulse_sum(1)]);
    }
}

/// Impulses are in range of their bitstream, or the step is refused.
#[test]
fn an_impulse_beyond_the_range_is_noticed_whichever_it_is() {
    let normal = [0.0, 1.0, 0.0];
    let contacts = [Contact { point: [0.5, 1.0, -1.0], distance: 0.0 }; 4];
    let collision = Collision { body_a: 1, body_b: 2, normal, count: 3, contacts };
    for profile in PROFILES {
        let (variant, largest) = (profile.default_variant(), profile.numbers.collisions.largest());
        let scene = scene(&variant, &SHAPES);
        let target = Target { scene: &scene, streamed_masses: false };
        let (table, _) = surveyed(target, &(0..BODIES).map(body).collect::<Vec<_>>());
        let channel = profile.mm2s_widths.len() - 1;
        let good = |impulses: Impulses| {
            let list = [collision; 7];
            let mut impulses_of = [Impulses::ZERO; 7];
            impulses_of[5] = impulses;
            let warm = WarmCollisions { collisions: &list, impulses: &impulses_of };
            let entries = Entries { collisions: &warm, count: 7, added: None };
            let mut usual = buffers(&variant, Segment::Collisions, 7);
            let mut contact = buffers(&variant, Segment::WarmCollisions, 7).remove(channel);
            // Without friction passes no friction impulse is sent, and all are checked.
            let segments = WarmSegments { channel, contact: &mut contact, friction: &mut [] };
            let views = &mut views(&mut usual);
            let packers = &mut PackPool::alone();
            pack_collisions(target, table.ends(), &entries, views, Some(segments), packers).good
        };
        for value in [f32::NAN, -f32::INFINITY, largest.next_up(), -largest.next_up()] {
            for at in 0..6 {
                let mut impulses = Impulses { normal: [largest; 4], friction: [-largest; 2] };
                assert!(good(impulses));
                let mut all = impulses.normal.iter_mut().chain(&mut impulses.friction);
                *all.nth(at).expect("one of six") = value;
                // The fourth point is not in use.
                assert_eq!(good(impulses), at == 3, "{} {value} {at}", profile.name);
            }
        }
    }
}
