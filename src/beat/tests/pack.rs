//! Reads the packer's beats back with a decoder that was written from the specification's tables
//! and shares nothing with the packer: no stripe, no record, no conversion.

use bytemuck::Zeroable as _;
use proptest::prelude::*;

use crate::beat::pack::bodies::{Chosen, pack_poses, pack_velocities, survey};
use crate::beat::pack::collisions::{Entries, pack_collisions};
use crate::beat::pack::pool::PackPool;
use crate::beat::pack::stripe_writer::{BLOCK, BODIES};
use crate::beat::pack::target::Target;
use crate::beat::stripe::Segment;
use crate::record::body_table::{Survey, Table};
use crate::scene::{
    Bodies, Body, BodyArrays, Collision, CollisionArrays, Collisions, Contact, Pose, Shape,
    Structures, Velocity,
};
use pgs_interface::number::{Numbers, StreamFormat};
use pgs_interface::profile::{FLOAT, HALF, Inertia, MIXED, NAIVE, Variant, WINDOWED, WINDOWED16};
use pgs_interface::record::Beat;

/// Collisions in an order of their own. An index beyond the list is a collision without contact
/// points.
struct Placed<'a> {
    list: &'a [Collision],
    order: &'a [u32],
}

impl Collisions for Placed<'_> {
    fn len(&self) -> usize {
        self.order.len()
    }

    fn collision(&self, _: usize) -> Collision {
        unreachable!("they are read where they lie")
    }

    fn structures(&self) -> Option<Structures<'_>> {
        Some(Structures::Ordered { all: self.list, order: self.order })
    }
}

/// Collisions that do not lie in memory as structures.
struct Given<'a>(&'a [Collision]);

impl Collisions for Given<'_> {
    fn len(&self) -> usize {
        self.0.len()
    }

    fn collision(&self, index: usize) -> Collision {
        self.0[index]
    }
}

/// How the words of a stream are written.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Words {
    F32,
    Binary16,
    Thesis16,
    Thesis16Literal,
}

/// A bitstream as the specification describes it.
#[derive(Debug, Clone, Copy)]
struct Spec {
    variant: Variant,
    channels: usize,
    /// Channel of each beat of a group.
    collision_group: &'static [usize],
    body_group: &'static [usize],
    /// Whether groups are always whole.
    whole: bool,
    collisions: Words,
    bodies: Words,
    relative: bool,
    world: bool,
}

const NAIVE_SPEC: Spec = Spec {
    variant: NAIVE.default_variant(),
    channels: 1,
    collision_group: &[0],
    body_group: &[0],
    whole: false,
    collisions: Words::F32,
    bodies: Words::F32,
    relative: false,
    world: false,
};
const FLOAT_SPEC: Spec = Spec {
    variant: FLOAT.default_variant(),
    channels: 4,
    collision_group: &[0, 1, 2, 3, 0, 1, 2],
    body_group: &[0, 1, 2, 3],
    ..NAIVE_SPEC
};
const HALF_SPEC: Spec = Spec {
    variant: HALF.default_variant(),
    channels: 3,
    collision_group: &[0, 0, 0, 1, 1, 1, 2],
    body_group: &[0, 0, 1, 1, 2],
    whole: true,
    collisions: Words::Binary16,
    bodies: Words::Binary16,
    relative: false,
    world: false,
};
const THESIS_SPEC: Spec = Spec {
    variant: Variant {
        numbers: Numbers {
            collisions: StreamFormat::Thesis16,
            bodies: StreamFormat::Thesis16,
            poses: StreamFormat::Thesis16,
            ..HALF.numbers
        },
        ..HALF.default_variant()
    },
    collisions: Words::Thesis16,
    bodies: Words::Thesis16,
    ..HALF_SPEC
};
const LITERAL_SPEC: Spec = Spec {
    variant: Variant {
        numbers: Numbers {
            collisions: StreamFormat::Thesis16Literal,
            bodies: StreamFormat::Thesis16Literal,
            poses: StreamFormat::Thesis16Literal,
            ..HALF.numbers
        },
        ..HALF.default_variant()
    },
    collisions: Words::Thesis16Literal,
    bodies: Words::Thesis16Literal,
    ..HALF_SPEC
};
const MIXED_SPEC: Spec = Spec {
    variant: MIXED.default_variant(),
    channels: 3,
    collision_group: &[0, 1, 2],
    body_group: &[0, 1, 2],
    collisions: Words::Binary16,
    relative: true,
    ..NAIVE_SPEC
};

const WINDOWED_SPEC: Spec = Spec {
    variant: WINDOWED.default_variant(),
    channels: 4,
    collision_group: &[0, 1],
    relative: true,
    ..NAIVE_SPEC
};
const WINDOWED16_SPEC: Spec = Spec {
    variant: WINDOWED16.default_variant(),
    collisions: Words::Binary16,
    bodies: Words::Binary16,
    ..WINDOWED_SPEC
};

fn any_spec() -> impl Strategy<Value = Spec> {
    let specs = vec![NAIVE_SPEC, FLOAT_SPEC, HALF_SPEC, THESIS_SPEC, LITERAL_SPEC, MIXED_SPEC];
    (prop::sample::select(specs), any::<bool>()).prop_map(|(spec, world)| {
        let inertia = if world { Inertia::World } else { Inertia::Isotropic };
        Spec { variant: Variant { inertia, ..spec.variant }, world, ..spec }
    })
}

/// The word of a number, in sixteen bits or thirty-two.
fn word(words: Words, value: f32) -> u32 {
    match words {
        Words::F32 => value.to_bits(),
        Words::Binary16 => half::f16::from_f32(value).to_bits().into(),
        Words::Thesis16 => thesis(value),
        Words::Thesis16Literal => literal(value),
    }
}

/// Sign, F and mantissa of the written definition, by arithmetic.
fn thesis(value: f32) -> u32 {
    let sign = if value.is_sign_negative() { 0x8000 } else { 0 };
    let magnitude = f64::from(value).abs();
    let Some(f) = (0..31_i32).rev().find(|f| magnitude >= 2.0_f64.powi(f - 15)) else {
        return sign;
    };
    if magnitude >= 65_536.0 {
        return sign | 31 << 10;
    }
    let mantissa = ((magnitude / 2.0_f64.powi(f - 15) - 1.0) * 1024.0).floor();
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 1023")]
    let mantissa = mantissa as u32;
    sign | (u32::try_from(f).expect("0 to 30") << 10) | mantissa
}

/// Sign, the exponent's top bit and four low bits, and the mantissa's ten top bits.
fn literal(value: f32) -> u32 {
    let bits = value.to_bits();
    let [sign, top, low] = [bits >> 31, bits >> 30 & 1, bits >> 23 & 15];
    sign << 15 | top << 14 | low << 10 | bits >> 13 & 1023
}

/// The rows of a segment in their order, and the number of beats.
fn rows(buffers: &[Vec<Beat>], group: &[usize], words: Words) -> (Vec<[u32; 4]>, usize) {
    let total: usize = buffers.iter().map(Vec::len).sum();
    let mut channels: Vec<_> = buffers.iter().map(|beats| beats.iter()).collect();
    let mut rows = Vec::new();
    for beat in 0..total {
        let Beat(lanes) = channels[group[beat % group.len()]].next().expect("a beat in its turn");
        if words == Words::F32 {
            rows.push(*lanes);
        } else {
            let halves = lanes.map(|lane| [lane & 0xFFFF, lane >> 16]);
            rows.extend(
                [[halves[0], halves[1]].concat(), [halves[2], halves[3]].concat()]
                    .map(|row| <[u32; 4]>::try_from(row).expect("four words")),
            );
        }
    }
    (rows, total)
}

/// Takes rows apart and, at the end, the padding.
struct Reader {
    rows: std::vec::IntoIter<[u32; 4]>,
    words: Words,
}

impl Reader {
    /// Checks that the beats are as many as `needed` rows take.
    fn new(
        spec: &Spec,
        group: &[usize],
        words: Words,
        buffers: &[Vec<Beat>],
        needed: usize,
    ) -> Self {
        assert_eq!(buffers.len(), spec.channels);
        let (rows, total) = rows(buffers, group, words);
        let mut expected = if words == Words::F32 { needed } else { needed.div_ceil(2) };
        if spec.whole {
            expected = expected.div_ceil(group.len()) * group.len();
        }
        assert_eq!(total, expected, "beats");
        Self { rows: rows.into_iter(), words }
    }

    #[track_caller]
    fn numbers(&mut self, numbers: [f32; 4]) {
        let expected = numbers.map(|number| word(self.words, number));
        assert_eq!(self.rows.next(), Some(expected), "{numbers:?}");
    }

    #[track_caller]
    fn vector(&mut self, [x, y, z]: [f32; 3], integer: u32) {
        let [x, y, z] = [x, y, z].map(|number| word(self.words, number));
        assert_eq!(self.rows.next(), Some([x, y, z, integer]));
    }

    fn end(self) {
        assert!(self.rows.into_iter().all(|row| row == [0; 4]), "padding is zeros");
    }
}

/// Packs into buffers full of ones, so that a missing beat shows; checks the sum.
fn packed(
    spec: &Spec,
    segment: Segment,
    records: usize,
    pack: impl FnOnce(&mut [&mut [Beat]]) -> u32,
) -> Vec<Vec<Beat>> {
    let layout = segment.layout(&spec.variant);
    let mut buffers: Vec<_> = (0..spec.channels)
        .map(|channel| vec![Beat([u32::MAX; 4]); layout.beats_on_channel(records, channel)])
        .collect();
    let mut views: Vec<&mut [Beat]> = buffers.iter_mut().map(Vec::as_mut_slice).collect();
    let sum = pack(&mut views);
    let words = buffers.iter().flatten().flat_map(|beat| beat.0);
    assert_eq!(sum, words.fold(0, u32::wrapping_add), "padding counts");
    buffers
}

/// Shapes. Every bitstream takes all of them except the last.
const SHAPES: [Shape; 3] = [
    Shape::STATIC,
    Shape::isotropic(1.0, 1.5),
    Shape { inverse_inertia: [1.0, 2.0, 3.0], ..Shape::isotropic(2.0, 0.0) },
];

fn velocities(spec: &Spec, bodies: &(impl Bodies + ?Sized)) -> Vec<Vec<Beat>> {
    let count = bodies.len();
    packed(spec, Segment::Velocities, count, |views| {
        pack_velocities(target(spec), bodies, count, views, &mut PackPool::alone()).0
    })
}

fn poses(spec: &Spec, bodies: &(impl Bodies + ?Sized)) -> Vec<Vec<Beat>> {
    let count = bodies.len();
    packed(spec, Segment::Poses, count, |views| {
        pack_poses(target(spec), bodies, count, views, &mut PackPool::alone()).0
    })
}

fn target(spec: &Spec) -> Target<'_> {
    Target { variant: &spec.variant, shapes: &SHAPES, streamed_masses: false, quick: None }
}

/// The beats of collisions, with words in place of the bodies' indices.
fn entries(
    spec: &Spec,
    bodies: &(impl Bodies + ?Sized),
    collisions: &(impl Collisions + ?Sized),
    words: Option<&[[u32; 2]]>,
) -> Vec<Vec<Beat>> {
    let count = collisions.len();
    let (mut ends, mut statics) = (Table::default(), Vec::new());
    let into = Survey { ends: &mut ends, statics: &mut statics };
    survey(target(spec), bodies, bodies.len(), into, &mut PackPool::alone());
    let entries = Entries { collisions, count, added: None, words };
    packed(spec, Segment::Collisions, count, |views| {
        pack_collisions(target(spec), ends.ends(), &entries, views, &mut PackPool::alone()).0
    })
}

fn collisions(
    spec: &Spec,
    bodies: &(impl Bodies + ?Sized),
    collisions: &(impl Collisions + ?Sized),
) -> Vec<Vec<Beat>> {
    entries(spec, bodies, collisions, None)
}

/// Any number that every format has a word for: within 65,504, tiny ones and both zeros among them.
fn any_f32() -> impl Strategy<Value = f32> {
    let bits = any::<u32>().prop_map(f32::from_bits);
    let near = bits.prop_filter("in range", |value| value.abs() <= 65_504.0);
    prop_oneof![4 => -100.0_f32..100.0, 2 => near, 1 => Just(0.0), 1 => Just(-0.0)]
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
        shape in 0_u32..2,
    ) -> Body {
        Body {
            pose: Pose { position, orientation },
            velocity: Velocity { linear, angular },
            shape,
        }
    }
}

/// Contact points that are not in use hold anything.
fn any_contact() -> impl Strategy<Value = [f32; 4]> {
    any_vec4()
}

prop_compose! {
    fn any_collision()(
        body_a in 0_u32..12,
        body_b in 0_u32..12,
        normal in any_vec3(),
        count in 1_u32..=4,
        contacts in prop::array::uniform4(any_contact()),
        unused in any::<u32>().prop_map(f32::from_bits),
    ) -> Collision {
        let mut contacts =
            contacts.map(|[x, y, z, distance]| Contact { point: [x, y, z], distance });
        for contact in &mut contacts[count as usize..] {
            *contact = Contact { point: [unused; 3], distance: unused };
        }
        Collision { body_a, body_b, normal, count, contacts }
    }
}

fn minus(to: [f32; 3], from: [f32; 3]) -> [f32; 3] {
    [to[0] - from[0], to[1] - from[1], to[2] - from[2]]
}

proptest! {
    #[test]
    fn velocities_arrive_as_they_were(
        spec in any_spec(),
        bodies in prop::collection::vec(any_body(), 0..40),
    ) {
        let per_body = if spec.world { 4 } else { 2 };
        let buffers = velocities(&spec, &bodies);
        let needed = per_body * bodies.len();
        let mut reader = Reader::new(&spec, spec.body_group, spec.bodies, &buffers, needed);
        for body in &bodies {
            reader.vector(body.velocity.linear, body.shape);
            reader.vector(body.velocity.angular, 0);
            if spec.world {
                let k = SHAPES[body.shape as usize].inverse_inertia[0];
                // Zeros are the word 0 in every format.
                reader.vector([k; 3], 0);
                reader.vector([0.0; 3], 0);
            }
        }
        reader.end();
    }

    #[test]
    fn poses_arrive_as_they_were(
        spec in any_spec(),
        bodies in prop::collection::vec(any_body(), 0..40),
    ) {
        let buffers = poses(&spec, &bodies);
        let needed = 2 * bodies.len();
        let mut reader = Reader::new(&spec, spec.body_group, spec.bodies, &buffers, needed);
        for body in &bodies {
            reader.vector(body.pose.position, 0);
            reader.numbers(body.pose.orientation);
        }
        reader.end();
    }

    #[test]
    fn collisions_arrive_as_they_were(
        spec in any_spec(),
        bodies in prop::collection::vec(any_body(), 12..14),
        list in prop::collection::vec(any_collision(), 0..40),
    ) {
        let per_collision = if spec.relative { 6 } else { 7 };
        let buffers = collisions(&spec, &bodies, &list);
        let needed = per_collision * list.len();
        let mut reader =
            Reader::new(&spec, spec.collision_group, spec.collisions, &buffers, needed);
        for collision in &list {
            let ends = [collision.body_a, collision.body_b].map(|index| bodies[index as usize]);
            let [mut a, mut b] = ends.map(|body| body.pose.position);
            if spec.relative {
                // A static body takes the position of the other body.
                let [a_moves, b_moves] =
                    ends.map(|body| SHAPES[body.shape as usize].inverse_mass != 0.0);
                a = if a_moves { a } else { b };
                b = if b_moves { b } else { a };
            }
            if spec.relative {
                reader.vector(collision.normal, collision.body_a);
                reader.vector(minus(b, a), collision.body_b);
            } else {
                reader.vector(collision.normal, collision.count);
                reader.vector(a, collision.body_a);
                reader.vector(b, collision.body_b);
            }
            for (ordinal, Contact { point, distance }) in (0..).zip(collision.contacts) {
                if ordinal < collision.count {
                    let [x, y, z] = if spec.relative { minus(point, a) } else { point };
                    reader.numbers([x, y, z, distance]);
                } else if spec.relative {
                    reader.numbers([0.0, 0.0, 0.0, f32::INFINITY]);
                } else {
                    reader.vector([0.0; 3], 0);
                }
            }
        }
        reader.end();
    }

    /// Places and marks replace the indices, and nothing else changes.
    #[test]
    fn marks_arrive_in_place_of_indices(
        short in any::<bool>(),
        bodies in prop::collection::vec(any_body(), 12..14),
        list in prop::collection::vec(any_collision(), 0..40),
        seed in 0_u32..0x8000,
    ) {
        let spec = if short { WINDOWED16_SPEC } else { WINDOWED_SPEC };
        let words: Vec<[u32; 2]> =
            (0..).zip(&list).map(|(at, _)| [seed, (seed + 77 * at) % 0x8000]).collect();
        let count = list.len();
        let marked = entries(&spec, &bodies, &list, Some(&words));
        let plain = collisions(&spec, &bodies, &list);
        let needed = 6 * count;
        let mut reader = Reader::new(&spec, spec.collision_group, spec.collisions, &marked, needed);
        let mut other = Reader::new(&spec, spec.collision_group, spec.collisions, &plain, needed);
        let row = |reader: &mut Reader| reader.rows.next().expect("as many as are needed");
        for words in words {
            for (at, word) in words.into_iter().enumerate() {
                let (found, expected) = (row(&mut reader), row(&mut other));
                prop_assert_eq!(&found[..3], &expected[..3]);
                prop_assert_eq!(found[3], word, "row {}", at);
            }
            for _ in 0..4 {
                prop_assert_eq!(row(&mut reader), row(&mut other));
            }
        }
        reader.end();
    }

    /// The orders reach over several blocks.
    #[test]
    fn collisions_arrive_wherever_they_lie(
        spec in any_spec(),
        bodies in prop::collection::vec(any_body(), 12),
        list in prop::collection::vec(any_collision(), 1..10),
        order in prop::collection::vec(
            prop_oneof![9 => 0_u32..10, 1 => Just(u32::MAX)],
            0..4 * BLOCK,
        ),
    ) {
        let place = |place: &u32| list.get(*place as usize).copied();
        let copied: Vec<Collision> =
            order.iter().map(|at| place(at).unwrap_or(Collision::NOTHING)).collect();
        let expected = collisions(&spec, &bodies, &copied);
        let placed = Placed { list: &list, order: &order };
        prop_assert_eq!(&collisions(&spec, &bodies, &placed), &expected);
        prop_assert_eq!(&collisions(&spec, &bodies, &Given(&copied)), &expected);
    }

    /// The picks reach over several blocks. The chosen bodies are not adjacent in memory, so the
    /// packer copies each of them.
    #[test]
    fn chosen_bodies_arrive_in_their_own_order(
        spec in any_spec(),
        bodies in prop::collection::vec(any_body(), 1..20),
        picks in prop::collection::vec(any::<prop::sample::Index>(), 0..3 * BODIES),
    ) {
        let order: Vec<u32> =
            picks.iter().map(|pick| u32::try_from(pick.index(bodies.len())).expect("few")).collect();
        let chosen = Chosen { bodies: &bodies, order: &order };
        let copied: Vec<Body> = order.iter().map(|index| bodies[*index as usize]).collect();
        prop_assert_eq!(velocities(&spec, &chosen), velocities(&spec, &copied));
        prop_assert_eq!(poses(&spec, &chosen), poses(&spec, &copied));
    }

    #[test]
    fn separate_arrays_give_the_beats_of_an_array_of_structures(
        spec in any_spec(),
        bodies in prop::collection::vec(any_body(), 12..20),
        list in prop::collection::vec(any_collision(), 0..20),
    ) {
        let mut positions: Vec<_> = bodies.iter().map(|body| body.pose.position).collect();
        let mut orientations: Vec<_> = bodies.iter().map(|body| body.pose.orientation).collect();
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
            list.iter().map(|collision| [collision.body_a, collision.body_b]).collect();
        let normals: Vec<_> = list.iter().map(|collision| collision.normal).collect();
        let counts: Vec<_> = list.iter().map(|collision| collision.count).collect();
        let contacts: Vec<_> = list
            .iter()
            .map(|collision| {
                collision.contacts.map(|contact| {
                    let [x, y, z] = contact.point;
                    [x, y, z, contact.distance]
                })
            })
            .collect();
        let collision_arrays =
            CollisionArrays { bodies: &pairs, normals: &normals, counts: &counts, contacts: &contacts };
        prop_assert_eq!(velocities(&spec, &bodies), velocities(&spec, &body_arrays));
        prop_assert_eq!(poses(&spec, &bodies), poses(&spec, &body_arrays));
        prop_assert_eq!(
            collisions(&spec, &bodies, &list),
            collisions(&spec, &body_arrays, &collision_arrays)
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
    let buffers = collisions(&FLOAT_SPEC, bodies.as_slice(), [collision].as_slice());
    assert_eq!(buffers[1][0], Beat([0, 0, 0, 3]));
    assert_eq!(buffers[2][0], Beat([0, 0, 0, u32::MAX]));
}

/// Where sixteen bits do not name all bodies, a profile sends all bits of an index, or another word
/// in its place.
#[test]
fn bodies_beyond_sixteen_bits_are_looked_up_by_all_their_bits() {
    let count = (1 << 16) + 2;
    let at = |index: u32| if index < 1 << 16 { 0.0 } else { (index % 7 + 1) as f32 };
    let bodies: Vec<Body> = (0..count)
        .map(|index| Body {
            pose: Pose { position: [at(index), 0.0, 0.0], orientation: [0.0, 0.0, 0.0, 1.0] },
            velocity: Velocity::default(),
            shape: 1,
        })
        .collect();
    let [body_a, body_b] = [count - 1, count - 2];
    let normal = [0.0, 1.0, 0.0];
    let contact = Contact { point: [5.0, 0.0, 0.0], distance: 0.25 };
    let list = [Collision { body_a, body_b, normal, count: 1, contacts: [contact; 4] }];
    assert_ne!(at(body_a).to_bits(), at(body_b).to_bits(), "they are told apart");
    for spec in [NAIVE_SPEC, FLOAT_SPEC, WINDOWED_SPEC, WINDOWED16_SPEC] {
        let words = spec.relative.then_some(&[[8, 9]][..]);
        let buffers = entries(&spec, &bodies, list.as_slice(), words);
        let rows = if spec.relative { 6 } else { 7 };
        let mut reader = Reader::new(&spec, spec.collision_group, spec.collisions, &buffers, rows);
        let reach = if spec.relative {
            reader.vector(normal, 8);
            reader.vector([at(body_b) - at(body_a), 0.0, 0.0], 9);
            5.0 - at(body_a)
        } else {
            reader.vector(normal, 1);
            reader.vector([at(body_a), 0.0, 0.0], body_a);
            reader.vector([at(body_b), 0.0, 0.0], body_b);
            5.0
        };
        reader.numbers([reach, 0.0, 0.0, 0.25]);
    }
}

/// No profile has room for these bodies. If they come here nevertheless, the packer writes no
/// collision.
#[test]
fn more_bodies_than_a_stream_has_indices_for_are_refused() {
    let list = [Collision::NOTHING; BLOCK];
    let entries = Entries { collisions: &list[..], count: BLOCK, added: None, words: None };
    for (count, fits) in [(1 << 16, true), ((1 << 16) + 1, false)] {
        let bodies = vec![Body { shape: 1, ..Body::zeroed() }; count];
        let (mut ends, mut statics) = (Table::default(), Vec::new());
        let into = Survey { ends: &mut ends, statics: &mut statics };
        survey(target(&HALF_SPEC), &bodies, count, into, &mut PackPool::alone());
        let layout = Segment::Collisions.layout(&HALF_SPEC.variant);
        let ones = Beat([u32::MAX; 4]);
        let mut buffers: [Vec<Beat>; 3] =
            std::array::from_fn(|channel| vec![ones; layout.beats_on_channel(BLOCK, channel)]);
        let mut views = buffers.each_mut().map(Vec::as_mut_slice);
        let packers = &mut PackPool::alone();
        let (_, seen) =
            pack_collisions(target(&HALF_SPEC), ends.ends(), &entries, &mut views, packers);
        assert_eq!(seen.good, fits, "{count}");
        let untouched = buffers.iter().flatten().filter(|beat| **beat == ones).count();
        assert_eq!(untouched, if fits { 0 } else { layout.beats(BLOCK) }, "{count}");
    }
}

/// The shape of the first body turns with it. The second body has a shape that does not exist.
#[test]
fn world_inertia_is_that_of_the_bodys_shape_about_world_axes() {
    let variant = Variant { inertia: Inertia::World, ..FLOAT.default_variant() };
    let spec = Spec { variant, world: true, ..FLOAT_SPEC };
    // A quarter turn about z exchanges x and y.
    let pose = Pose { position: [0.0; 3], orientation: [0.0, 0.0, 1.0, 1.0] };
    let body = |shape| Body { pose, velocity: Velocity::default(), shape };
    let buffers = velocities(&spec, [body(2), body(9)].as_slice());
    let numbers = [2.0_f32, 1.0, 3.0].map(f32::to_bits);
    assert_eq!(buffers[2][0].0[..3], numbers);
    assert_eq!(buffers[3][0], Beat([0; 4]));
    assert_eq!((buffers[2][1], buffers[3][1]), (Beat([0; 4]), Beat([0; 4])));
}
