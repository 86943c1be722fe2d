//! Compares the packer's checks of bodies, and of collisions with bodies far away, with validation.

use super::checks::{BODY, said};
use crate::scene::{Body, Collision, Contact};
use crate::validate::InputError;
use crate::validate::Limits;
use pgs_interface::number::{Numbers, Precision, StreamFormat};
use pgs_interface::profile::{HALF, PROFILES, Profile};

/// Whether packing and validation accept these bodies in a profile, without collisions.
fn said_of(profile: &'static Profile, bodies: &Vec<Body>) -> bool {
    let limits = Limits::roomy(profile.default_variant());
    let (good, valid) = said(&limits, bodies, &Vec::new(), None).expect("nothing else wrong");
    assert_eq!(good, valid.is_ok(), "{}: {valid:?}", profile.name);
    good
}

#[test]
fn a_static_body_that_moves_in_any_direction_is_noticed() {
    for profile in PROFILES {
        for component in 0..6 {
            for (speed, right) in [(0.0, true), (-0.0, true), (-0.5, false), (f32::NAN, false)] {
                let mut bodies = vec![BODY; 3];
                let still = &mut bodies[1];
                still.shape = 0;
                let velocities = [&mut still.velocity.linear, &mut still.velocity.angular];
                velocities[component / 3][component % 3] = speed;
                let of = (profile.name, component, speed);
                assert_eq!(said_of(profile, &bodies), right, "{of:?}");
            }
        }
    }
}

/// Both the shortest length and the largest number that a stream holds are limits.
#[test]
fn an_orientation_that_is_too_short_or_too_long_is_noticed() {
    for profile in PROFILES {
        let holds = profile.default_variant().numbers.poses.largest();
        for component in 0..4 {
            for (length, right) in [
                (1.0, true),
                (-1.0, true),
                (0.9 * InputError::SHORTEST_ORIENTATION, false),
                (0.0, false),
                (1e30, false),
                (f32::NAN, false),
                (f32::INFINITY, false),
                (1e5, holds >= 1e5),
            ] {
                let mut bodies = vec![BODY; 3];
                bodies[1].pose.orientation = [0.0; 4];
                bodies[1].pose.orientation[component] = length;
                let of = (profile.name, component, length);
                assert_eq!(said_of(profile, &bodies), right, "{of:?}");
            }
        }
    }
}

/// The verdicts of packing and of validation on two bodies in contact. One body has this shape and
/// lies at this distance, as body A and as body B, along each axis. Each verdict comes with a
/// description of its case.
fn said_of_far(limits: &Limits, distance: f32, shape: u32) -> Vec<((bool, bool), String)> {
    let contact = Contact { point: BODY.pose.position, distance: -0.01 };
    let pairs = [[0, 1], [1, 0]].into_iter();
    let cases = pairs.flat_map(|pair| (0..3).map(move |component| (pair, component)));
    let said = |([body_a, body_b], component): ([u32; 2], usize)| {
        let mut far = Body { shape, ..BODY };
        far.pose.position[component] = distance;
        let normal = [0.0, 1.0, 0.0];
        let collision = Collision { body_a, body_b, normal, count: 4, contacts: [contact; 4] };
        let (good, valid) =
            said(limits, &vec![far, BODY], &vec![collision; 3], None).expect("nothing else wrong");
        let of = limits.variant.profile.name;
        ((good, valid.is_ok()), format!("{of}, {body_a}, {component}, {distance}: {valid:?}"))
    };
    cases.map(said).collect()
}

/// The arm is computed although a static body does not turn.
#[test]
fn a_static_body_that_is_too_far_is_noticed_whichever_it_is() {
    for (distance, right) in [(30_000.0, true), (-50_000.0, false), (50_000.0, false)] {
        for (found, of) in said_of_far(&Limits::roomy(HALF.default_variant()), distance, 0) {
            assert_eq!(found, (right, right), "{of}");
        }
    }
}

/// The position is beyond the range of collisions and within the range of poses. Rows are f32, so
/// that no arm is refused first.
#[test]
fn a_position_that_collisions_do_not_hold_is_noticed_whichever_body_it_is_of() {
    let mut variant = HALF.default_variant();
    variant.numbers = Numbers { poses: StreamFormat::F32, rows: Precision::F32, ..variant.numbers };
    for (distance, right) in [(60_000.0, true), (-70_000.0, false), (70_000.0, false)] {
        for (found, of) in said_of_far(&Limits::roomy(variant), distance, 1) {
            assert_eq!(found, (right, right), "{of}");
        }
    }
}
