//! Compares the packer's checks of the input with validation.

use super::{buffers, surveyed, views};
use crate::beat::Target;
use crate::beat::collisions::{Entries, pack_collisions};
use crate::beat::pool::PackPool;
use crate::beat::stripe::{BLOCK, Segment};
use crate::order::{Ordered, Schedule};
use crate::record::body_table::Ends;
use crate::scene::{Body, Collision, Collisions, Contact, Pose, Shape, StepParameters, Velocity};
use crate::validate::{InputError, Limits, preflight, validate};
use pgs_interface::profile::{FLOAT, HALF, NAIVE, PROFILES};

const SHAPES: [Shape; 3] =
    [Shape::STATIC, Shape::isotropic(1.0, 1.5), Shape::isotropic(0.5, 100.0)];
pub(crate) const BODIES: usize = 40;

/// The pose of a body.
const POSE: Pose = Pose { position: [1.0, 2.0, 3.0], orientation: [0.0, 0.0, 0.0, 1.0] };

/// A body that is at rest, and may move.
pub(crate) const BODY: Body =
    Body { pose: POSE, velocity: Velocity { linear: [0.0; 3], angular: [0.0; 3] }, shape: 1 };

/// A contact point near the body.
const CONTACT: Contact = Contact { point: [1.5, 2.5, 3.5], distance: -0.01 };

/// A collision of two such bodies. It is right if both may move.
const COLLISION: Collision =
    Collision { body_a: 3, body_b: 4, normal: [0.0, 1.0, 0.0], count: 3, contacts: [CONTACT; 4] };

/// Whether packing accepts these entries.
fn accepts<C: Collisions + ?Sized>(
    target: Target<'_>,
    ends: Ends<'_>,
    entries: &Entries<'_, C>,
) -> bool {
    let mut channels = buffers(target.scene.variant, Segment::Collisions, entries.count);
    let (views, packers) = (&mut views(&mut channels), &mut PackPool::alone());
    let packed = pack_collisions(target, ends, entries, views, None, packers);
    let empty = (0..entries.count).filter(|at| entries.collisions.collision(*at).count == 0);
    assert_eq!(packed.paddings, empty.count());
    packed.good
}

/// The verdict of packing on a step, and that of validation.
pub(crate) type Said = (bool, Result<(), InputError>);

/// The verdicts of packing and of validation; `None` if the preflight check refuses the step.
pub(crate) fn said(
    limits: &Limits,
    bodies: &Vec<Body>,
    collisions: &Vec<Collision>,
    schedule: Option<&Schedule>,
) -> Option<Said> {
    let parameters = StepParameters::default();
    said_with(limits, &parameters, bodies, collisions, schedule)
}

/// As [`said`], for a step with these parameters.
fn said_with(
    limits: &Limits,
    parameters: &StepParameters,
    bodies: &Vec<Body>,
    collisions: &Vec<Collision>,
    schedule: Option<&Schedule>,
) -> Option<Said> {
    let shapes = &SHAPES;
    let scene = preflight(bodies, collisions, shapes, parameters, limits).ok()?;
    let target = Target { scene: &scene, streamed_masses: false };
    let (table, bodies_good) = surveyed(target, bodies);
    let moves =
        |body: &Body| shapes.get(body.shape as usize).is_some_and(|shape| !shape.is_static());
    let still = (0..).zip(bodies).filter(|(_, body)| !moves(body)).map(|(at, _)| at);
    assert_eq!(table.statics().collect::<Vec<_>>(), still.collect::<Vec<u32>>());
    let count = schedule.map_or(collisions.len(), Schedule::len);
    let added = schedule.map(Schedule::empty);
    let good = match schedule {
        None => accepts(target, table.ends(), &Entries { collisions, count, added }),
        Some(schedule) => {
            let collisions = &Ordered { collisions, schedule };
            accepts(target, table.ends(), &Entries { collisions, count, added })
        }
    };
    let valid = validate(bodies, collisions, shapes, parameters, limits);
    Some((bodies_good & good, valid))
}

/// The friction of a pair is above its number of points, and must not be taken for points.
#[test]
fn a_friction_is_accepted_where_validation_accepts_it() {
    let bodies = vec![BODY; 8];
    let own = COLLISION.with_friction(0.5);
    for pair_friction in [false, true] {
        let parameters = StepParameters::default().with_pair_friction(pair_friction);
        for (collision, right) in [
            (COLLISION, true),
            (own, pair_friction),
            // Nothing but a friction is no padding.
            (Collision { count: own.count & 0xFFFF_0000, ..own }, pair_friction),
            (COLLISION.with_friction(f32::INFINITY), false),
            (Collision { count: own.count | 1 << 31, ..own }, false),
            (Collision { count: own.count + 2, ..own }, false),
        ] {
            let limits = Limits::roomy(FLOAT.default_variant());
            let list = vec![collision; 3];
            let (good, valid) =
                said_with(&limits, &parameters, &bodies, &list, None).expect("nothing else wrong");
            assert_eq!((good, valid.is_ok()), (right, right), "{:#x}", collision.count);
        }
    }
}

/// The properties are not vacuous: both verdicts occur for every width of rows.
#[test]
fn a_good_scene_is_good_and_one_wrong_number_is_not() {
    let bodies: Vec<Body> = (0..BODIES)
        .map(|_| Body {
            pose: POSE,
            velocity: Velocity { linear: [1.0; 3], angular: [2.0; 3] },
            shape: 1,
        })
        .collect();
    let mut collision = COLLISION;
    collision.contacts[3] = Contact { point: [f32::NAN; 3], distance: f32::NAN };
    let full = Collision { count: 4, ..COLLISION };
    // Some collisions have all contact points.
    let mut collisions = vec![collision; 2 * BLOCK + 1];
    collisions.iter_mut().step_by(2).for_each(|some| *some = full);
    let collisions = &collisions;
    let profiles = [&FLOAT, &HALF];
    for profile in profiles {
        let limits = Limits::roomy(profile.default_variant());
        let said = |bodies: &Vec<Body>, collisions: &Vec<Collision>| {
            let (good, valid) =
                said(&limits, bodies, collisions, None).expect("nothing else wrong");
            assert_eq!(good, valid.is_ok(), "{valid:?}");
            good
        };
        assert!(said(&bodies, collisions));
        for at in [0, BLOCK - 1, BLOCK, 2 * BLOCK] {
            let mut wrong = collisions.clone();
            let last = wrong[at].count as usize - 1;
            wrong[at].contacts[last].distance = f32::INFINITY;
            assert!(!said(&bodies, &wrong));
            let mut wrong = bodies.clone();
            wrong[at % BODIES].velocity.angular[2] = f32::NAN;
            assert!(!said(&wrong, collisions));
        }
    }
}

#[test]
fn what_is_wrong_beside_padding_is_noticed() {
    let body = |shape| Body { pose: POSE, velocity: Velocity::default(), shape };
    // Padding names body 0, which is static, and so is the last body.
    let bodies = [vec![body(0)], vec![body(1); BODIES], vec![body(0)]].concat();
    let still = u32::try_from(BODIES + 1).expect("few");
    let on_ground = Collision { body_b: still, ..COLLISION };
    let nan = Contact { distance: f32::NAN, ..CONTACT };
    let wrongs = [
        ("static", Collision { body_a: 0, ..on_ground }),
        ("missing", Collision { body_a: still + 1, ..COLLISION }),
        ("beyond sixteen bits", Collision { body_b: 1 << 16, ..COLLISION }),
        ("long", Collision { normal: [0.0, 1.002, 0.0], ..COLLISION }),
        ("short", Collision { normal: [0.0, 0.998, 0.0], ..COLLISION }),
        ("no number", Collision { normal: [0.0, f32::NAN, 0.0], ..COLLISION }),
        ("no number either", Collision { normal: [0.0, -f32::NAN, 0.0], ..COLLISION }),
        ("many", Collision { count: 5, ..COLLISION }),
        ("NaN", Collision { contacts: [CONTACT, CONTACT, nan, CONTACT], ..COLLISION }),
    ];
    for profile in PROFILES {
        let limits = Limits::roomy(profile.default_variant());
        let said_of = |wrong: Option<Collision>, at: usize, empty: &[usize]| {
            let mut collisions = [COLLISION, on_ground].repeat(BLOCK);
            if let Some(wrong) = wrong {
                collisions[at] = wrong;
            }
            let mut entries: Vec<Option<u32>> =
                (0..u32::try_from(2 * BLOCK).expect("few")).map(Some).collect();
            empty.iter().for_each(|at| entries.insert(*at, None));
            let schedule: Schedule = entries.into_iter().collect();
            said(&limits, &bodies, &collisions, Some(&schedule)).expect("nothing else wrong")
        };
        let said = |wrong, at, empty: &[usize]| {
            let (good, valid) = said_of(wrong, at, empty);
            assert_eq!(good, valid.is_ok(), "{}: {valid:?}", profile.name);
            good
        };
        for (at, empty) in [
            (50, &[][..]),
            (50, &[40]),
            (0, &[0, 1, 52, BLOCK + 30, 2 * BLOCK]),
            (BLOCK + 20, &[40]),
            (BLOCK + 20, &[BLOCK + 30]),
        ] {
            assert!(said(None, at, empty), "{} {empty:?}", profile.name);
            for (what, wrong) in wrongs {
                assert!(!said(Some(wrong), at, empty), "{} {empty:?}: {what}", profile.name);
            }
        }
        // A collision that was not empty when the order was made is one padding too many.
        for body_b in [3, 4, u32::MAX] {
            let emptied = Collision { body_b, count: 0, ..COLLISION };
            assert_eq!(said_of(Some(emptied), 50, &[40]), (false, Ok(())), "{}", profile.name);
        }
    }
}

/// The lower halves of the indices name other bodies. These are right where the named bodies are
/// wrong, and wrong where the named bodies are right.
#[test]
fn bodies_beyond_sixteen_bits_are_looked_at_by_all_their_bits() {
    let low = 1 << 16;
    let body = |shape| Body { pose: POSE, velocity: Velocity::default(), shape };
    let collision = |body_a, body_b| Collision {
        body_a,
        body_b,
        normal: [0.0, 1.0, 0.0],
        count: 1,
        contacts: [Contact::default(); 4],
    };
    for profile in [&NAIVE, &FLOAT] {
        let limits = Limits::roomy(profile.default_variant());
        // Two bodies are static, and all others move.
        for still in [[0, 1], [low, low + 1]] {
            let mut bodies = vec![body(1); low + 2];
            still.iter().for_each(|at| bodies[*at] = body(0));
            for (pair, right) in [([0, 1], still[0] == low), ([low, low + 1], still[0] == 0)] {
                let [a, b] = pair.map(|at| u32::try_from(at).expect("few"));
                let (good, valid) = said(&limits, &bodies, &vec![collision(a, b); 3], None)
                    .expect("nothing else wrong");
                assert_eq!((good, valid.is_ok()), (right, right), "{} {pair:?}", profile.name);
            }
        }
    }
}

/// The lever arm of the last contact point alone is too long about one body, which turns. The other
/// body may turn, too.
#[test]
fn an_arm_that_is_too_long_is_noticed_about_whichever_body() {
    let at = |x, shape| Body {
        pose: Pose { position: [x, 2.0, 3.0], orientation: [0.0, 0.0, 0.0, 1.0] },
        velocity: Velocity::default(),
        shape,
    };
    let contact = |x| Contact { point: [x, 2.0, 3.0], distance: -0.01 };
    {
        let profile = &HALF;
        let limits = Limits::roomy(profile.default_variant());
        for (near, far) in [(2, 2), (1, 2), (2, 1), (0, 2), (2, 0)] {
            let bodies = vec![at(1.0, near), at(27.0, far)];
            for (body_a, count) in (0..8).map(|case| (case % 2, 1 + case / 2)) {
                // All other used contact points lie midway between the bodies.
                let mut contacts = [contact(14.0); 4];
                let (used, unused) = contacts.split_at_mut(count as usize);
                used[used.len() - 1] = contact(1.0);
                unused.fill(contact(f32::NAN));
                let normal = [0.0, 1.0, 0.0];
                let body_b = 1 - body_a;
                let collision = Collision { body_a, body_b, normal, count, contacts };
                let (good, valid) =
                    said(&limits, &bodies, &vec![collision; 3], None).expect("nothing else wrong");
                assert_eq!(good, valid.is_ok(), "{} {near} {far}: {valid:?}", profile.name);
                assert_eq!(good, far != 2, "{} {near} {far}", profile.name);
            }
        }
    }
}
