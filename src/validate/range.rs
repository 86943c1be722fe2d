//! Refuses collisions with numbers outside the range that a bitstream keeps from stream to solver.

use pgs_interface::number::{Numbers, Precision, StreamFormat};
use pgs_interface::profile::Variant;

use super::collision::numbers_of;
use super::{Excess, InputError, InputItem, OutOfRange, Scene};
use crate::scene::{CONTACT_POINTS, Collision, Contact, Impulses};

/// The narrowest format of each input on its way through stream, arithmetic and array.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Held {
    /// Positions and orientations.
    pub(crate) poses: StreamFormat,
    /// Linear and angular velocities.
    pub(crate) velocities: StreamFormat,
    /// All numbers of a collision.
    pub(crate) collisions: StreamFormat,
    /// The impulses that a collision begins with.
    pub(crate) impulses: StreamFormat,
}

impl Held {
    /// The narrowest formats of a bitstream.
    pub(crate) const fn by(numbers: &Numbers) -> Self {
        Self {
            // Poses that are streamed in f32 are integrated in f32.
            poses: numbers.poses,
            velocities: narrower(narrower(numbers.bodies, numbers.updates), numbers.velocities),
            collisions: narrower(numbers.collisions, numbers.rows),
            impulses: narrower(narrower(numbers.collisions, numbers.updates), numbers.impulses),
        }
    }
}

/// The narrower of the format on a stream and the precision behind it.
const fn narrower(stream: StreamFormat, behind: Precision) -> StreamFormat {
    match (stream, behind) {
        (StreamFormat::F32, Precision::Binary16) => StreamFormat::Binary16,
        (stream, _) => stream,
    }
}

/// The largest magnitude of an impulse that a collision begins with.
pub(crate) const fn largest_impulse(numbers: &Numbers) -> f32 {
    Held::by(numbers).impulses.largest()
}

/// Checks the impulses that a collision begins with.
pub(crate) fn check_impulses(
    index: usize,
    impulses: &Impulses,
    scene: &Scene<'_>,
) -> Result<(), InputError> {
    if !impulses.are_finite() {
        return Err(InputError::ImpulseNotFinite { collision: index });
    }
    let (format, largest) = (scene.held.impulses, scene.held.impulses.largest());
    if impulses.are_within(largest) {
        return Ok(());
    }
    let normal = impulses.normal.into_iter().enumerate();
    let friction = impulses.friction.into_iter().enumerate();
    let all = normal.map(|of| ("normal impulse", of));
    let mut all = all.chain(friction.map(|of| ("friction impulse", of)));
    let beyond = all.find(|(_, (_, found))| found.abs() > largest);
    let (field, (component, found)) = beyond.unwrap_or(("normal impulse", (0, f32::NAN)));
    let item = InputItem::Collision(index, None);
    let number = OutOfRange { item, field, component, found, format, smallest: 0.0, largest };
    Err(scene.needs.refuse(Excess::OutOfRange(number), &|variant| {
        impulses.are_within(largest_impulse(&variant.numbers))
    }))
}

/// Whether masses and step parameters enter arithmetic of sixteen bits.
pub(crate) const fn computes_short(numbers: &Numbers) -> bool {
    !matches!((numbers.rows, numbers.updates), (Precision::F32, Precision::F32))
}

/// The smallest magnitude that binary16 does not round to 0, the subnormal 2^-24.
pub(crate) const SMALLEST_SHORT: f32 = 1.0 / 16_777_216.0;

/// Checks every number of a collision as it is streamed. [`check_collision`] has accepted it.
///
/// `positions` belong to bodies A and B.
///
/// [`check_collision`]: super::collision::check_collision
pub(crate) fn check_range(
    index: usize,
    collision: &Collision,
    positions: [[f32; 3]; 2],
    scene: &Scene<'_>,
) -> Result<(), InputError> {
    let format = scene.held.collisions;
    let Some((contact, field, component, found)) = beyond(format, collision, positions) else {
        return Ok(());
    };
    let item = InputItem::Collision(index, contact);
    let (smallest, largest) = (0.0, format.largest());
    let number = OutOfRange { item, field, component, found, format, smallest, largest };
    Err(scene
        .needs
        .refuse(Excess::OutOfRange(number), &|variant| fits(variant, collision, positions)))
}

/// Whether every number of a collision is in a bitstream's range.
pub(crate) fn fits(variant: &Variant, collision: &Collision, positions: [[f32; 3]; 2]) -> bool {
    beyond(Held::by(&variant.numbers).collisions, collision, positions).is_none()
}

/// The first number of a collision that a format does not hold: contact point, name, component,
/// value.
fn beyond(
    format: StreamFormat,
    collision: &Collision,
    [a, b]: [[f32; 3]; 2],
) -> Option<(Option<usize>, &'static str, usize, f32)> {
    let limit = format.largest();
    let vectors =
        [("normal", collision.normal), ("position of body A", a), ("position of body B", b)];
    let vectors = vectors.into_iter().flat_map(|(field, [x, y, z])| {
        [(0, x), (1, y), (2, z)].map(|(component, found)| (None, field, component, found))
    });
    let contacts = used(collision).iter().enumerate().flat_map(numbers_of);
    let contacts =
        contacts.map(|(at, field, component, found)| (Some(at), field, component, found));
    vectors.chain(contacts).find(|(.., found)| found.is_nan() || found.abs() > limit)
}

/// The used contact points.
pub(crate) fn used(collision: &Collision) -> &[Contact] {
    let used = usize::try_from(collision.count).unwrap_or(CONTACT_POINTS).min(CONTACT_POINTS);
    &collision.contacts[..used]
}

#[cfg(test)]
mod tests {
    use super::super::tests::{UNUSED, USED, scene_on};
    use super::*;
    use pgs_interface::profile::{FLOAT, HALF, Profile};

    const COLLISION: Collision = Collision {
        body_a: 0,
        body_b: 1,
        normal: [0.0, -1.0, 0.0],
        count: 2,
        contacts: [USED, USED, UNUSED, UNUSED],
    };

    fn check(
        profile: &'static Profile,
        collision: &Collision,
        positions: [[f32; 3]; 2],
    ) -> Result<(), InputError> {
        check_range(7, collision, positions, &scene_on(&profile.default_variant()))
    }

    fn far(contact: Contact) -> Collision {
        Collision { contacts: [USED, contact, UNUSED, UNUSED], ..COLLISION }
    }

    #[test]
    fn what_the_format_still_carries_is_accepted_and_unused_points_do_not_matter() {
        for profile in [&FLOAT, &HALF] {
            assert_eq!(check(profile, &COLLISION, [[0.0; 3]; 2]), Ok(()));
        }
        let edge = far(Contact { point: [65_504.0, 0.0, -65_504.0], distance: 65_504.0 });
        assert_eq!(check(&HALF, &edge, [[65_504.0; 3], [-65_504.0; 3]]), Ok(()));
    }

    #[test]
    fn absolute_coordinates_are_held_against_the_limit_as_they_are() {
        let beyond = 65_504.0_f32.next_up();
        let cases = [
            (COLLISION, [[0.0, beyond, 0.0], [0.0; 3]], None, "position of body A", 1, beyond),
            (COLLISION, [[0.0; 3], [0.0, 0.0, -beyond]], None, "position of body B", 2, -beyond),
            (
                far(Contact { point: [-7e4, 0.0, 0.0], distance: 0.0 }),
                [[0.0; 3]; 2],
                Some(1),
                "point",
                0,
                -7e4,
            ),
            (
                far(Contact { point: [0.0; 3], distance: -1e9 }),
                [[0.0; 3]; 2],
                Some(1),
                "distance",
                0,
                -1e9,
            ),
        ];
        for (collision, positions, contact, field, component, found) in cases {
            let refused = check(&HALF, &collision, positions).expect_err(field);
            let (item, format) = (InputItem::Collision(7, contact), StreamFormat::Binary16);
            let (smallest, largest) = (0.0, 65_504.0);
            let expected = OutOfRange { item, field, component, found, format, smallest, largest };
            assert_eq!(refused.out_of_range(), Some(expected), "{refused}");
            assert_eq!(check(&FLOAT, &collision, positions), Ok(()));
        }
    }

    #[test]
    fn a_refused_position_names_the_profiles_that_could() {
        let far = [1e6, 0.0, 0.0];
        let text = check(&HALF, &COLLISION, [far; 2]).expect_err("far").to_string();
        assert_eq!(
            text,
            "collision 7: position of body A[0] is 1000000, but this bitstream holds collisions \
             in binary16, which ends at 65504: bring it into range, or load another (profiles that \
             could: naive, float)"
        );
    }

    #[test]
    fn impulses_are_held_against_the_narrowest_place_on_their_way() {
        let of = |profile: &'static Profile, impulses: &Impulses| {
            check_impulses(7, impulses, &scene_on(&profile.default_variant()))
        };
        let beyond = 65_504.0_f32.next_up();
        let edge = Impulses { normal: [0.0, -65_504.0, 0.0, 0.0], friction: [65_504.0; 2] };
        assert_eq!(of(&HALF, &edge), Ok(()));
        let far = Impulses { normal: [0.0, 0.0, 0.0, -beyond], ..edge };
        let refused = of(&HALF, &far).expect_err("beyond");
        let (item, field) = (InputItem::Collision(7, None), "normal impulse");
        let (format, component) = (StreamFormat::Binary16, 3);
        let (found, smallest, largest) = (-beyond, 0.0, 65_504.0);
        let expected = OutOfRange { item, field, component, found, format, smallest, largest };
        assert_eq!(refused.out_of_range(), Some(expected));
        assert!(refused.to_string().ends_with("(profiles that could: naive, float)"));
        assert_eq!(of(&FLOAT, &far), Ok(()));
        let no_number = Impulses { friction: [f32::NAN, beyond], ..far };
        let not_finite = InputError::ImpulseNotFinite { collision: 7 };
        assert_eq!(of(&HALF, &no_number), Err(not_finite));
        let numbers = Numbers { impulses: Precision::Binary16, ..Numbers::F32 };
        assert_eq!(
            [&numbers, &Numbers::F32].map(|of| largest_impulse(of).to_bits()),
            [65_504.0_f32, f32::MAX].map(f32::to_bits)
        );
    }

    #[test]
    fn the_narrowest_place_on_the_way_decides() {
        use StreamFormat::{Binary16, F32};
        let held = |numbers: &Numbers| {
            let Held { poses, velocities, collisions, .. } = Held::by(numbers);
            (poses, velocities, collisions)
        };
        assert_eq!(held(&FLOAT.numbers), (F32, F32, F32));
        assert_eq!(held(&HALF.numbers), (Binary16, Binary16, Binary16));
        let short = Precision::Binary16;
        let with = |numbers| held(&numbers);
        let velocities = short;
        assert_eq!(with(Numbers { velocities, ..Numbers::F32 }), (F32, Binary16, F32));
        assert_eq!(with(Numbers { updates: short, ..Numbers::F32 }), (F32, Binary16, F32));
        assert_eq!(with(Numbers { rows: short, ..Numbers::F32 }), (F32, F32, Binary16));
        assert_eq!(with(Numbers { impulses: short, ..Numbers::F32 }), (F32, F32, F32));
    }
}
