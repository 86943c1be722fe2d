//! Reads the packer's beats back with a decoder that was written from the specification's tables
//! and shares nothing with the packer: no stripe, no record, no conversion.

use bytemuck::Zeroable as _;
use proptest::prelude::*;

use super::{buffers, scene, surveyed, views};
use crate::beat::Target;
use crate::beat::bodies::{Survey, pack_bodies};
use crate::beat::collisions::{Entries, pack_collisions};
use crate::beat::pool::PackPool;
use crate::beat::stripe::{BLOCK, Segment};
use crate::record::body_table::Table;
use crate::scene::{
    Bodies, Body, BodyArrays, Collision, CollisionArrays, Collisions, Contact, Pose, Shape,
    Structures, Velocity,
};
use pgs_interface::profile::{FLOAT, HALF, Inertia, NAIVE, Variant};
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
    world: false,
};
fn any_spec() -> impl Strategy<Value = Spec> {
    let specs = vec![NAIVE_SPEC, FLOAT_SPEC, HALF_SPEC];
    (prop::sample::select(specs), any::<bool>()).prop_map(|(spec, world)| {
        let world = world && spec.variant.profile.world.is_some();
        let inertia = if world { Inertia::World } else { Inertia::Isotropic };
        Spec { variant: Variant { inertia, ..spec.variant }, world, ..spec }
    })
}

/// The word of a number, in sixteen bits or thirty-two.
fn word(words: Words, value: f32) -> u32 {
    match words {
        Words::F32 => value.to_bits(),
        Words::Binary16 => half::f16::from_f32(value).to_bits().into(),
    }
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
    let mut buffers = buffers(&spec.variant, segment, records);
    let sum = pack(&mut views(&mut buffers));
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

/// The beats of the velocities and of the poses.
fn packed_bodies(spec: &Spec, bodies: &(impl Bodies + ?Sized)) -> [Vec<Vec<Beat>>; 2] {
    let (mut ends, mut statics) = (Table::default(), Vec::new());
    let into = Survey { ends: &mut ends, statics: &mut statics };
    let (count, packers) = (bodies.len(), &mut PackPool::alone());
    let scene = scene(&spec.variant, &SHAPES);
    let target = Target { scene: &scene, streamed_masses: false };
    let mut velocities = Vec::new();
    let poses = packed(spec, Segment::Poses, count, |poses| {
        let mut of_poses = 0;
        velocities = packed(spec, Segment::Velocities, count, |views| {
            let places = (views, poses);
            let (sum, other, _) = pack_bodies(target, bodies, count, into, places, packers);
            of_poses = other;
            sum
        });
        of_poses
    });
    [velocities, poses]
}

fn velocities(spec: &Spec, bodies: &(impl Bodies + ?Sized)) -> Vec<Vec<Beat>> {
    let [velocities, _] = packed_bodies(spec, bodies);
    velocities
}

fn poses(spec: &Spec, bodies: &(impl Bodies + ?Sized)) -> Vec<Vec<Beat>> {
    let [_, poses] = packed_bodies(spec, bodies);
    poses
}

/// The beats of collisions.
fn collisions(
    spec: &Spec,
    bodies: &(impl Bodies + ?Sized),
    collisions: &(impl Collisions + ?Sized),
) -> Vec<Vec<Beat>> {
    let count = collisions.len();
    let scene = scene(&spec.variant, &SHAPES);
    let target = Target { scene: &scene, streamed_masses: false };
    let (table, _) = surveyed(target, bodies);
    let entries = Entries { collisions, count, added: None };
    packed(spec, Segment::Collisions, count, |views| {
        let packers = &mut PackPool::alone();
        pack_collisions(target, table.ends(), &entries, views, None, packers).sum
    })
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
        let buffers = collisions(&spec, &bodies, &list);
        let needed = 7 * list.len();
        let mut reader =
            Reader::new(&spec, spec.collision_group, spec.collisions, &buffers, needed);
        for collision in &list {
            let ends = [collision.body_a, collision.body_b].map(|index| bodies[index as usize]);
            let [a, b] = ends.map(|body| body.pose.position);
            reader.vector(collision.normal, collision.count);
            reader.vector(a, collision.body_a);
            reader.vector(b, collision.body_b);
            for (ordinal, Contact { point, distance }) in (0..).zip(collision.contacts) {
                if ordinal < collision.count {
                    let [x, y, z] = point;
                    reader.numbers([x, y, z, distance]);
                } else {
                    reader.vector([0.0; 3], 0);
                }
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
            origin: [0.0; 3],
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

/// Where sixteen bits do not name all bodies, a profile sends all bits of an index.
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
    for spec in [NAIVE_SPEC, FLOAT_SPEC] {
        let buffers = collisions(&spec, &bodies, list.as_slice());
        let mut reader = Reader::new(&spec, spec.collision_group, spec.collisions, &buffers, 7);
        reader.vector(normal, 1);
        reader.vector([at(body_a), 0.0, 0.0], body_a);
        reader.vector([at(body_b), 0.0, 0.0], body_b);
        reader.numbers([5.0, 0.0, 0.0, 0.25]);
    }
}

/// No profile has room for these bodies. If they come here nevertheless, the packer refuses all
/// collisions.
#[test]
fn more_bodies_than_a_stream_has_indices_for_are_refused() {
    let list = [Collision::NOTHING; BLOCK];
    let entries = Entries { collisions: &list[..], count: BLOCK, added: None };
    let scene = scene(&HALF_SPEC.variant, &SHAPES);
    let target = Target { scene: &scene, streamed_masses: false };
    for (count, fits) in [(1 << 16, true), ((1 << 16) + 1, false)] {
        let (table, _) = surveyed(target, &vec![Body { shape: 1, ..Body::zeroed() }; count]);
        let mut buffers = buffers(&HALF_SPEC.variant, Segment::Collisions, BLOCK);
        let (views, packers) = (&mut views(&mut buffers), &mut PackPool::alone());
        let packed = pack_collisions(target, table.ends(), &entries, views, None, packers);
        assert_eq!(packed.good, fits, "{count}");
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
