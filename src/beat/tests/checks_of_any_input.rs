//! Compares the packer's checks of any input with validation.

use proptest::prelude::*;

use super::checks::{BODIES, said};
use crate::order::Schedule;
use crate::scene::{Body, Collision, Contact, Pose, Velocity};
use crate::validate::Limits;
use pgs_interface::number::{Numbers, Precision, StreamFormat};
use pgs_interface::profile::{FLOAT, HALF, Inertia, NAIVE};

fn any_limits() -> impl Strategy<Value = Limits> {
    let profiles = vec![&NAIVE, &FLOAT, &HALF];
    let short_rows = vec![Precision::F32, Precision::Binary16];
    let formats = StreamFormat::ALL.to_vec();
    (
        prop::sample::select(profiles),
        prop::option::of((prop::sample::select(short_rows), prop::sample::select(formats))),
        any::<bool>(),
    )
        .prop_map(|(profile, other, world)| {
            let mut variant = profile.default_variant();
            if let Some((rows, format)) = other {
                let numbers = Numbers { rows, collisions: format, ..variant.numbers };
                // A 16-bit format halves the beats, and the stripe of a profile fits one size of
                // word.
                let same = format.bits() == variant.numbers.collisions.bits();
                variant.numbers = if same { numbers } else { Numbers { rows, ..variant.numbers } };
            }
            let world = variant.profile.world.filter(|_| world);
            variant.inertia = world.map_or(Inertia::Isotropic, |_| Inertia::World);
            Limits::roomy(variant)
        })
}

/// Numbers at the limits of the checks, and others.
fn any_f32() -> impl Strategy<Value = f32> {
    let edges = [
        0.0,
        -0.0,
        65_504.0,
        -65_504.0,
        65_504.0_f32.next_up(),
        43_000.0,
        16_000.0,
        210.0,
        1e-6,
        f32::MAX,
        -f32::MAX,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::NAN,
        -f32::NAN,
        f32::from_bits(0x7F80_0001),
        f32::from_bits(0xFF80_0001),
        1e-40,
    ];
    prop_oneof![20 => -5.0_f32..5.0, 1 => prop::sample::select(edges.to_vec())]
}

/// As [`any_f32`], but rarely at an edge.
fn mostly() -> impl Strategy<Value = f32> {
    prop_oneof![300 => -5.0_f32..5.0, 1 => any_f32()]
}

fn any_vec3() -> impl Strategy<Value = [f32; 3]> {
    [mostly(), mostly(), mostly()]
}

prop_compose! {
    fn any_body()(
        position in any_vec3(),
        orientation in prop_oneof![
            400 => Just([0.0, 0.6, 0.0, 0.8]),
            1 => [any_f32(), any_f32(), any_f32(), any_f32()],
            1 => Just([1e-6, 0.0, 0.0, 0.0]),
            1 => Just([0.9e-6, 0.0, 0.0, 0.0]),
            1 => Just([1e30; 4]),
        ],
        linear in any_vec3(),
        angular in any_vec3(),
        shape in prop_oneof![600 => 1_u32..3, 100 => Just(0), 1 => 3_u32..6, 1 => any::<u32>()],
        moves in prop::bool::weighted(0.01),
    ) -> Body {
        let mut velocity = Velocity { linear, angular };
        if shape == 0 && !moves {
            velocity = Velocity::default();
        }
        Body { pose: Pose { position, orientation }, velocity, shape }
    }
}

prop_compose! {
    fn any_collision()(
        any_pair in any::<Option<[u32; 2]>>(),
        pair in prop_oneof![
            300 => (0_u32..40, 1_u32..40).prop_map(|(a, by)| [a, (a + by) % 40]),
            1 => [0_u32..42, 0_u32..42],
            1 => [any::<u32>(), any::<u32>()],
            // The lower halves of these indices name existing bodies.
            1 => (0_u32..40, 1_u32..40, 1_u32..4).prop_map(|(a, by, beyond)| {
                let [a, b] = [a, (a + by) % 40];
                [a | (beyond & 1) << 16, b | (beyond & 2) << 30]
            }),
        ],
        normal in prop_oneof![
            300 => Just([0.0_f32, -1.0, 0.0]),
            1 => (0.99_f32..1.01).prop_map(|x| [x, 0.0, 0.0]),
            1 => (0.9989_f32..1.0011).prop_map(|x| [x, 0.0, 0.0]),
            1 => any_vec3(),
        ],
        count in prop_oneof![
            600 => Just(4_u32),
            300 => 1_u32..5,
            15 => Just(0),
            1 => Just(5),
            1 => any::<u32>(),
        ],
        points in [any_vec3(), any_vec3(), any_vec3(), any_vec3()],
        distances in [mostly(), mostly(), mostly(), mostly()],
        unused in any::<u32>().prop_map(f32::from_bits),
    ) -> Collision {
        let mut contacts = [Contact { point: [unused; 3], distance: unused }; 4];
        for (at, contact) in contacts.iter_mut().enumerate().take(count.min(4) as usize) {
            *contact = Contact { point: points[at], distance: distances[at] };
        }
        // Nothing of an empty collision matters but its count.
        let [body_a, body_b] = any_pair.filter(|_| count == 0).unwrap_or(pair);
        Collision { body_a, body_b, normal, count, contacts }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1500))]

    /// With and without an order, packing refuses a step exactly if validation does.
    #[test]
    fn packing_notices_what_validation_refuses(
        limits in any_limits(),
        bodies in prop::collection::vec(any_body(), BODIES),
        collisions in prop::collection::vec(any_collision(), 0..70),
        order in any::<Option<u64>>(),
    ) {
        let schedule: Option<Schedule> = order.map(|seed| {
            // One entry is empty, and the others run backwards, without the empty collisions.
            let taking_part = (0..).zip(&collisions).filter(|(_, it)| it.count != 0);
            let mut entries: Vec<Option<u32>> = taking_part.map(|(at, _)| Some(at)).collect();
            entries.reverse();
            let at = usize::try_from(seed % (entries.len() as u64 + 1)).expect("few");
            entries.insert(at, None);
            entries.into_iter().collect()
        });
        // No order is ever made for a collision of a body with itself.
        let alike = collisions.iter().any(|it| it.count != 0 && it.body_a == it.body_b);
        prop_assume!(schedule.is_none() || !alike);
        if let Some((good, valid)) = said(&limits, &bodies, &collisions, schedule.as_ref()) {
            prop_assert_eq!(good, valid.is_ok(), "{:?}", valid);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(6000))]

    /// The collision is alone in its block, so that no other mistake hides a check that fails to
    /// notice its own.
    #[test]
    fn packing_notices_what_validation_refuses_of_one(
        limits in any_limits(),
        places in [any_vec3(), any_vec3(), any_vec3()],
        shapes in [0..3_u32, 0..3_u32, 1..5_u32],
        mut collision in any_collision(),
        pair in prop_oneof![
            20 => [0..3_u32, 0..3_u32],
            1 => [0..4_u32, 0..4_u32],
            1 => any::<[u32; 2]>()
        ],
        wrong in prop::option::of((0..4_usize, 0..4_usize, any_f32(), any::<u32>())),
    ) {
        let bodies: Vec<Body> = places
            .iter()
            .zip(shapes)
            .map(|(position, shape)| Body {
                pose: Pose { position: *position, orientation: [0.0, 0.6, 0.0, 0.8] },
                velocity: Velocity::default(),
                shape,
            })
            .collect();
        [collision.body_a, collision.body_b] = pair;
        if let Some((what, at, number, bits)) = wrong {
            match what {
                0 => collision.normal[at % 3] = f32::from_bits(bits),
                1 => collision.contacts[at].point[at % 3] = f32::from_bits(bits),
                2 => collision.contacts[at].distance = f32::from_bits(bits),
                _ => collision.contacts[at].point = [number; 3],
            }
        }
        if let Some((good, valid)) = said(&limits, &bodies, &vec![collision], None) {
            prop_assert_eq!(good, valid.is_ok(), "{:?}", valid);
        }
    }
}
