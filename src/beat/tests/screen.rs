//! Compares the packer's checks of the input with validation.

use std::sync::atomic::Ordering;

use crate::beat::pack::bodies::{pack_bodies, survey};
use crate::beat::pack::collisions::{CollisionPacker, Entries, pack_collisions};
use crate::beat::pack::pool::PackPool;
use crate::beat::pack::stripe_writer::CHECKED;
use crate::beat::pack::target::Target;
use crate::beat::stripe::Segment;
use crate::order::{Ordered, Schedule};
use crate::record::body_table::{Ends, Survey, Table};
use crate::record::source::Contiguous;
use crate::scene::{Body, Collision, Collisions, Contact, Pose, Shape, StepParameters, Velocity};
use crate::validate::InputError;
use crate::validate::{Limits, Quick, preflight, validate};
use pgs_interface::number::{Numbers, Precision, StreamFormat};
use pgs_interface::profile::{FLOAT, HALF, NAIVE, PROFILES, Variant};
use pgs_interface::record::Beat;

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

/// Buffers for `records` records.
fn buffers(variant: &Variant, segment: Segment, records: usize) -> Vec<Vec<Beat>> {
    let layout = segment.layout(variant);
    let channels = variant.profile.mm2s_widths.len();
    (0..channels)
        .map(|channel| vec![Beat::default(); layout.beats_on_channel(records, channel)])
        .collect()
}

fn views(buffers: &mut [Vec<Beat>]) -> Vec<&mut [Beat]> {
    buffers.iter_mut().map(Vec::as_mut_slice).collect()
}

/// Whether packing accepts these entries. Packing without checks must write the same beats.
fn looked_at<C: Collisions + ?Sized>(
    target: Target<'_>,
    ends: Ends<'_>,
    entries: &Entries<'_, C>,
) -> bool {
    let packed = |target: Target<'_>| {
        let mut channels = buffers(target.variant, Segment::Collisions, entries.count);
        let views = &mut views(&mut channels);
        let (sum, seen) = pack_collisions(target, ends, entries, views, &mut PackPool::alone());
        ((channels, sum), seen)
    };
    let (beats, found) = packed(target);
    // The other loop packs a scene with few contact points.
    let list: Vec<_> = (0..entries.count).map(|at| entries.collisions.collision(at)).collect();
    let mut channels = buffers(target.variant, Segment::Collisions, entries.count);
    let mut views = views(&mut channels);
    let packer = CollisionPacker::new(target, ends, 0, &mut views);
    let mut packer = packer.expecting_few_full();
    let seen = packer.write(Contiguous(&list));
    // `pack_collisions` compares the number of paddings over all blocks; this loop does not.
    assert!(entries.added.is_some() || seen == found, "found as in the other loop: {seen:?}");
    let empty = list.iter().filter(|collision| collision.count == 0).count();
    assert_eq!(found.paddings, empty);
    let sum = packer.finish();
    assert!((channels, sum) == beats, "the same beats in either loop");
    let (unchecked, all) = packed(Target { quick: None, ..target });
    assert!(unchecked == beats && all.good, "the same beats");
    found.good
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
    said_and_doubted(limits, bodies, collisions, schedule).map(|(said, _)| said)
}

/// As [`said`], with the number of blocks that failed the quick check, so that packing checked them
/// exactly.
fn said_and_doubted(
    limits: &Limits,
    bodies: &Vec<Body>,
    collisions: &Vec<Collision>,
    schedule: Option<&Schedule>,
) -> Option<(Said, usize)> {
    let (parameters, shapes) = (StepParameters::default(), &SHAPES);
    let scene = preflight(bodies, collisions, shapes, &parameters, limits).ok()?;
    let quick = Quick::new(scene);
    let variant = &limits.variant;
    let target = Target { variant, shapes, streamed_masses: false, quick: Some(&quick) };
    let (mut ends, mut statics) = (Table::default(), Vec::new());
    let count = bodies.len();
    let mut velocities = buffers(variant, Segment::Velocities, count);
    let mut poses = buffers(variant, Segment::Poses, count);
    let (.., bodies_good) = pack_bodies(
        target,
        bodies,
        count,
        Survey { ends: &mut ends, statics: &mut statics },
        (&mut views(&mut velocities), &mut views(&mut poses)),
        &mut PackPool::alone(),
    );
    let moves =
        |body: &Body| shapes.get(body.shape as usize).is_some_and(|shape| !shape.is_static());
    let still = (0..).zip(bodies).filter(|(_, body)| !moves(body)).map(|(at, _)| at);
    assert_eq!(statics, still.collect::<Vec<u32>>());
    let (mut other_ends, mut other_statics) = (Table::default(), vec![7]);
    let into = Survey { ends: &mut other_ends, statics: &mut other_statics };
    assert_eq!(survey(target, bodies, count, into, &mut PackPool::alone()), bodies_good);
    // The comparison is by bytes, as a position may be NaN.
    let bytes = |ends: &Table| bytemuck::cast_slice::<_, u8>(ends.of_bodies()).to_vec();
    assert_eq!((bytes(&other_ends), other_statics), (bytes(&ends), statics));
    let count = schedule.map_or(collisions.len(), Schedule::len);
    let added = schedule.map(Schedule::empty);
    let good = match schedule {
        None => looked_at(target, ends.ends(), &Entries { collisions, count, added }),
        Some(schedule) => {
            let collisions = &Ordered { collisions, schedule };
            looked_at(target, ends.ends(), &Entries { collisions, count, added })
        }
    };
    let valid = validate(bodies, collisions, shapes, &parameters, limits);
    Some(((bodies_good & good, valid), quick.doubted.load(Ordering::Relaxed)))
}

/// An ordinary scene passes the quick check of every bitstream. A second check would be as right,
/// and slow.
#[test]
fn a_pile_is_found_good_at_once() {
    let body = |x: f32, shape| Body {
        pose: Pose { position: [x, 0.5, 90.0], orientation: [0.0, 0.6, 0.0, 0.8] },
        velocity: Velocity { linear: [0.1, -9.0, 0.0], angular: [0.0; 3] },
        shape,
    };
    // The centre of the ground is far away.
    let ground = Body { velocity: Velocity::default(), ..body(-400.0, 0) };
    let moving = (0..299).map(|at| body(at as f32 / 4.0, 1));
    let bodies: Vec<Body> = std::iter::once(ground).chain(moving).collect();
    let far = Contact { point: [f32::NAN; 3], distance: f32::INFINITY };
    let pile = |count: fn(u32) -> u32| -> Vec<Collision> {
        let collision = |at| {
            let x = (at - 1) as f32 / 4.0;
            let contact = Contact { point: [x, 0.25, 89.75], distance: -0.01 };
            let mut contacts = [contact; 4];
            contacts[count(at) as usize..].fill(far);
            let other = if at % 5 == 0 { 0 } else { at + 1 };
            let [body_a, body_b] = if at % 2 == 0 { [at, other] } else { [other, at] };
            let normal = [0.6, 0.0, if at % 3 == 0 { 0.8 } else { -0.8 }];
            Collision { body_a, body_b, normal, count: count(at), contacts }
        };
        (1..299).map(collision).collect()
    };
    // Collisions have one to four contact points in the first pile, and nearly always four in the
    // second.
    let piles = [pile(|at| 1 + at % 4), pile(|at| if at % 60 == 0 { 2 } else { 4 })];
    let entries = (0..298).map(|at| (at % 90 != 89).then_some(at));
    let schedule: Schedule = entries.chain((0..298).filter(|at| at % 90 == 89).map(Some)).collect();
    let formats = StreamFormat::ALL;
    for profile in PROFILES {
        for inertia in profile.inertias().iter().copied() {
            for format in formats {
                for rows in [Precision::F32, Precision::Binary16] {
                    let mut variant = Variant { inertia, ..profile.default_variant() };
                    if format.bits() != variant.numbers.collisions.bits() {
                        continue;
                    }
                    variant.numbers = Numbers { rows, collisions: format, ..variant.numbers };
                    let ordered = [None, Some(&schedule)];
                    for (schedule, collisions) in
                        ordered.into_iter().flat_map(|it| piles.iter().map(move |pile| (it, pile)))
                    {
                        let limits = Limits::roomy(variant);
                        let ((good, valid), doubted) =
                            said_and_doubted(&limits, &bodies, collisions, schedule)
                                .expect("nothing else wrong");
                        let of = (profile.name, inertia, format, rows, schedule.is_some());
                        let count = collisions[0].count;
                        assert_eq!((good, valid, doubted), (true, Ok(()), 0), "{of:?} {count}");
                    }
                }
            }
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
    // No collision of the first pile has all contact points, and most of the second have.
    let piles = [vec![collision; 2 * CHECKED + 1], {
        let mut collisions = vec![full; 2 * CHECKED + 1];
        collisions.iter_mut().step_by(50).for_each(|some| *some = collision);
        collisions
    }];
    let profiles = [&FLOAT, &HALF];
    for (profile, collisions) in
        profiles.into_iter().flat_map(|of| piles.iter().map(move |it| (of, it)))
    {
        let limits = Limits::roomy(profile.default_variant());
        let said = |bodies: &Vec<Body>, collisions: &Vec<Collision>| {
            let (good, valid) =
                said(&limits, bodies, collisions, None).expect("nothing else wrong");
            assert_eq!(good, valid.is_ok(), "{valid:?}");
            good
        };
        assert!(said(&bodies, collisions));
        for at in [0, CHECKED - 1, CHECKED, 2 * CHECKED] {
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

/// A block with padding among its collisions takes a second check, on another path.
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
            let mut collisions = [COLLISION, on_ground].repeat(CHECKED);
            if let Some(wrong) = wrong {
                collisions[at] = wrong;
            }
            let mut entries: Vec<Option<u32>> =
                (0..u32::try_from(2 * CHECKED).expect("few")).map(Some).collect();
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
            (0, &[0, 1, 52, CHECKED + 30, 2 * CHECKED]),
            (CHECKED + 20, &[40]),
            (CHECKED + 20, &[CHECKED + 30]),
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
