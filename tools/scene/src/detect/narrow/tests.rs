//! Contacts of two bodies, pair by pair.

#![allow(clippy::float_cmp, reason = "of boxes along the axes the normal is exact")]

use zynq_pgs::Contact;

use super::super::MARGIN;
use super::*;
use crate::Geometry;
use crate::fixtures::{LEVEL, bits, body as cube};
use pgs_support::random::SplitMix64;

/// The collisions of pairs, each found anew.
fn all(
    narrow: &mut Narrow,
    bodies: &[Body],
    geometries: Geometries<'_>,
    pairs: impl Iterator<Item = (u32, u32)>,
) -> Vec<Collision> {
    let one = |pair| narrow.collide(bodies, geometries, &mut Touch::unknown(pair));
    pairs.filter_map(one).collect()
}

/// The collision of one pair.
fn one(
    narrow: &mut Narrow,
    bodies: &[Body],
    geometries: Geometries<'_>,
    pair: (u32, u32),
) -> Option<Collision> {
    let mut found = all(narrow, bodies, geometries, std::iter::once(pair));
    assert!(found.len() < 2, "{found:?}");
    found.pop()
}

fn collide(a: Body, b: Body) -> Option<Collision> {
    let cubes = Geometries(&[None, Some(Geometry::CUBE)]);
    one(&mut Narrow::default(), &[a, b], cubes, (0, 1))
}

#[test]
fn the_normal_points_b_in_a_and_the_points_lie_on_b() {
    // B on A, 5 mm deep.
    let a = cube([10.0, 3.0, 0.0], LEVEL);
    let b = cube([11.0, 4.995, 0.8], LEVEL);
    let found = collide(a, b).expect("contact");
    assert_eq!((found.body_a, found.body_b, found.count), (0, 1, 4));
    assert_eq!(found.normal, [0.0, -1.0, 0.0]);
    for contact in found.contacts {
        assert!((contact.distance + 0.005).abs() < 1e-5, "{contact:?}");
        // The underside of B; the point on A's surface is c + d n, its top at y = 4.
        assert!((contact.point[1] - 3.995).abs() < 1e-5, "{contact:?}");
        assert!((contact.point[1] - contact.distance - 4.0).abs() < 1e-5, "{contact:?}");
        // The overlap of the faces.
        assert!((9.999..11.001).contains(&contact.point[0]), "{contact:?}");
        assert!((-0.201..1.001).contains(&contact.point[2]), "{contact:?}");
    }
    // With A and B exchanged, the normal turns and the points lie on the other cube.
    let found = collide(b, a).expect("contact");
    assert_eq!(found.normal, [0.0, 1.0, 0.0]);
    assert!(found.contacts.iter().all(|c| (c.point[1] - 4.0).abs() < 1e-5), "{found:?}");
}

#[test]
fn a_cube_turned_by_45_degrees_touches_another_in_four_points_of_its_octagon() {
    let turn = [0.0, 0.382_683_43, 0.0, 0.923_879_5];
    let a = cube([0.0, 1.0, 0.0], LEVEL);
    let b = cube([0.0, 2.99, 0.0], turn);
    let found = collide(a, b).expect("contact");
    assert_eq!(found.count, 4);
    // parry gives the eight corners of the octagon in which the faces overlap, at the radius 1 /
    // cos 22.5 degrees. The chosen four are opposites in pairs, and the pairs are at right angles.
    let radius = 1.082_392_2_f32;
    let planar = found.contacts.map(|contact| [contact.point[0], contact.point[2]]);
    for [x, z] in planar {
        assert!(((x * x + z * z).sqrt() - radius).abs() < 1e-4, "{found:?}");
    }
    let sum = planar.iter().fold([0.0, 0.0], |s: [f32; 2], p| [s[0] + p[0], s[1] + p[1]]);
    assert!(sum[0].abs() < 1e-4 && sum[1].abs() < 1e-4, "{found:?}");
    let corner = |i: usize, j: usize| planar[i][0] * planar[j][0] + planar[i][1] * planar[j][1];
    assert!((corner(0, 1) + radius * radius).abs() < 1e-3, "{found:?}");
    assert!(corner(0, 2).abs() < 1e-3 && corner(0, 3).abs() < 1e-3, "{found:?}");
}

#[test]
fn a_cube_exactly_on_another_touches_it_in_its_four_corners() {
    let found =
        collide(cube([0.0, 1.0, 0.0], LEVEL), cube([0.0, 3.0, 0.0], LEVEL)).expect("contact");
    assert_eq!(found.count, 4);
    for (x, z) in [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)] {
        let here = |c: &Contact| (c.point[0] - x).abs() < 1e-5 && (c.point[2] - z).abs() < 1e-5;
        assert!(found.contacts.iter().any(here), "({x}, {z}): {found:?}");
    }
}

#[test]
fn the_margin_is_kept_at_two_centimetres() {
    let a = cube([0.0, 1.0, 0.0], LEVEL);
    let found = collide(a, cube([0.5, 3.0199, 0.5], LEVEL)).expect("within the margin");
    assert!(found.contacts.iter().all(|c| c.distance > 0.0 && c.distance <= MARGIN));
    assert!(collide(a, cube([0.5, 3.0201, 0.5], LEVEL)).is_none());
}

#[test]
fn stacked_cubes_have_the_contact_that_bullet_finds() {
    // Bullet's vectors, scene `two_cubes`, collision 1.
    let a = cube(
        [0.250_276_68, 0.994_702_9, -0.499_972_02],
        [-6.372_234e-5, -0.000_124_026_96, -0.000_107_972_42, 1.0],
    );
    let b = cube(
        [0.645_283_4, 2.989_992_4, -0.695_435_1],
        [-0.000_229_805_8, 0.001_554_238_3, -0.000_130_734_36, 0.999_998_75],
    );
    // Bullet gives one corner of the overlap twice and leaves one out.
    let bullet: [[f32; 4]; 4] = [
        [1.248_292_3, 1.991_913, -1.497_404_5, -0.004_895_148],
        [1.250_292_7, 1.990_293_9, 0.303_148_15, -0.004_295_349],
        [-0.351_863_92, 1.990_714, 0.308_128_3, -0.004_221_797],
        [1.250_739_8, 1.989_464_3, -1.499_850_7, -0.004_895_091],
    ];
    let found = collide(a, b).expect("contact");
    assert_eq!(found.count, 4);
    for (ours, theirs) in found.normal.iter().zip([-0.000_260_754, -1.0, 0.000_460_017_4]) {
        assert!((ours - theirs).abs() < 1e-3, "{found:?}");
    }
    for [x, y, z, distance] in bullet {
        let near = |c: &Contact| {
            (c.point[0] - x).abs() < 5e-3
                && (c.point[1] - y).abs() < 5e-3
                && (c.point[2] - z).abs() < 5e-3
                && (c.distance - distance).abs() < 1e-3
        };
        assert!(found.contacts.iter().any(near), "({x}, {y}, {z}) is none of {found:?}");
    }
}

#[test]
fn crossed_edges_touch_in_one_point() {
    // A on an edge along z, B above it on an edge along x: both turned by 45 degrees.
    let (sin, cos) = (0.382_683_43, 0.923_879_5);
    let a = cube([0.0; 3], [0.0, 0.0, sin, cos]);
    let b = cube([0.0, 2.82, 0.0], [sin, 0.0, 0.0, cos]);
    let found = collide(a, b).expect("contact");
    assert!((found.normal[1] + 1.0).abs() < 1e-4, "{found:?}");
    assert_eq!(found.count, 1);
    let contact = found.contacts[0];
    assert!((contact.distance + 0.008_427).abs() < 1e-3, "{found:?}");
    assert!(contact.point[0].abs() < 1e-3 && contact.point[2].abs() < 1e-3, "{found:?}");
}

const SPHERE: Geometry = Geometry::Sphere { radius: 0.5 };
const CAPSULE: Geometry = Geometry::Capsule { half_height: 0.6, radius: 0.4 };

/// The collision of two bodies with these geometries; checks it with A and B exchanged, too.
fn pair(a: (Geometry, Body), b: (Geometry, Body)) -> Option<[Collision; 2]> {
    let shaped = |(_, body): (Geometry, Body), shape| Body { shape, ..body };
    let bodies = [shaped(a, 0), shaped(b, 1)];
    let outlines = [Some(a.0), Some(b.0)];
    let mut narrow = Narrow::default();
    let mut of = |pair| one(&mut narrow, &bodies, Geometries(&outlines), pair);
    match (of((0, 1)), of((1, 0))) {
        (Some(found), Some(reverse)) => Some([found, reverse]),
        (None, None) => None,
        other => panic!("one way only: {other:?}"),
    }
}

#[test]
fn spheres_touch_in_one_point_between_their_centres() {
    let b = (SPHERE, cube([0.0, 1.99, 0.0], LEVEL));
    let [found, reverse] = pair((SPHERE, cube([0.0, 1.0, 0.0], LEVEL)), b).expect("contact");
    assert_eq!((found.count, found.normal), (1, [0.0, -1.0, 0.0]));
    assert_eq!(reverse.normal, [0.0, 1.0, 0.0]);
    assert!((found.contacts[0].distance + 0.01).abs() < 1e-6, "{found:?}");
    assert!((found.contacts[0].point[1] - 1.49).abs() < 1e-6, "{found:?}");
    assert!((reverse.contacts[0].point[1] - 1.5).abs() < 1e-6, "{reverse:?}");
    assert!(pair((SPHERE, cube([0.0, 0.969, 0.0], LEVEL)), b).is_none());
}

#[test]
fn a_sphere_on_a_box_touches_its_face_edge_or_corner() {
    let a = (Geometry::CUBE, cube([0.0; 3], LEVEL));
    let on = |position| pair(a, (SPHERE, cube(position, LEVEL)));
    let [face, _] = on([0.3, 1.495, -0.2]).expect("face");
    assert_eq!(face.count, 1);
    assert!((face.normal[1] + 1.0).abs() < 1e-6, "{face:?}");
    assert!((face.contacts[0].distance + 0.005).abs() < 1e-5, "{face:?}");
    // Beyond a corner, along its diagonal: 0.49 m away.
    let beyond = 1.0 + 0.49 / 3.0_f32.sqrt();
    let [corner, _] = on([beyond; 3]).expect("corner");
    assert!((corner.contacts[0].distance + 0.01).abs() < 1e-5, "{corner:?}");
    assert!(corner.normal.iter().all(|n| (n + 3.0_f32.sqrt().recip()).abs() < 1e-5));
}

#[test]
fn a_capsule_lies_on_a_box_with_both_ends_and_stands_on_one() {
    let half = 0.5_f32.sqrt();
    let a = (Geometry::CUBE, cube([0.0; 3], LEVEL));
    // A quarter turn about x lays it along z.
    let [lying, _] =
        pair(a, (CAPSULE, cube([0.0, 1.39, 0.0], [half, 0.0, 0.0, half]))).expect("lying");
    assert_eq!(lying.count, 2, "{lying:?}");
    for contact in &lying.contacts[..2] {
        assert!((contact.distance + 0.01).abs() < 1e-4, "{lying:?}");
        assert!((contact.point[1] - 0.99).abs() < 1e-4, "{lying:?}");
        assert!((contact.point[2].abs() - 0.6).abs() < 1e-4, "{lying:?}");
    }
    let [standing, _] = pair(a, (CAPSULE, cube([0.0, 1.99, 0.0], LEVEL))).expect("standing");
    assert_eq!(standing.count, 1, "{standing:?}");
    assert!((standing.contacts[0].distance + 0.01).abs() < 1e-4, "{standing:?}");
    // Its round end reaches no farther along a corner's diagonal than its radius.
    let beyond = 1.0 + 0.43 / 3.0_f32.sqrt();
    let far = cube([beyond, beyond + 0.6, beyond], LEVEL);
    assert!(pair(a, (CAPSULE, far)).is_none());
}

#[test]
fn capsules_and_spheres_touch_where_they_are_nearest() {
    let half = 0.5_f32.sqrt();
    let a = (CAPSULE, cube([0.0; 3], [half, 0.0, 0.0, half]));
    // Crossed: one along z, the other along x above it.
    let crossed = cube([0.0, 0.79, 0.3], [0.0, 0.0, half, half]);
    let [found, _] = pair(a, (CAPSULE, crossed)).expect("crossed");
    assert_eq!(found.count, 1);
    assert!((found.contacts[0].distance + 0.01).abs() < 1e-5, "{found:?}");
    assert!((found.contacts[0].point[2] - 0.3).abs() < 1e-5, "{found:?}");
    let [found, _] = pair(a, (SPHERE, cube([0.0, 0.0, 1.49], LEVEL))).expect("sphere");
    assert_eq!(found.count, 1);
    assert!((found.normal[2] + 1.0).abs() < 1e-5, "{found:?}");
    assert!((found.contacts[0].distance + 0.01).abs() < 1e-5, "{found:?}");
}

#[test]
fn pairs_of_all_kinds_side_by_side_are_as_each_alone() {
    let mut random = SplitMix64::new(3);
    let mut bodies = Vec::new();
    for shape in (0..4).cycle().take(200) {
        let position = [0; 3].map(|_| 2.0 * random.sign());
        let q = [random.sign(), random.sign(), random.sign(), 1.0];
        let length = (((q[0] * q[0] + q[1] * q[1]) + q[2] * q[2]) + q[3] * q[3]).sqrt();
        bodies.push(Body { shape, ..cube(position, q.map(|value| value / length)) });
    }
    bodies[7].pose.position[1] = f32::NAN;
    let pairs = || (0..200).flat_map(|a| (a + 1..a + 9).map(move |b| (a, b)));
    let kinds = [Some(Geometry::CUBE), Some(SPHERE), None, Some(CAPSULE)];
    for outlines in [kinds, [Some(Geometry::CUBE); 4]] {
        let (geometries, mut narrow) = (Geometries(&outlines), Narrow::default());
        let found = all(&mut narrow, &bodies, geometries, pairs());
        // The last pairs hold no such body.
        let single = pairs().filter_map(|pair| one(&mut narrow, &bodies, geometries, pair));
        assert!(found.len() > 100, "{}", found.len());
        assert_eq!(bits(&found), bits(&single.collect::<Vec<_>>()));
    }
}

/// A cube at rest on the ground, and one above it, 5 mm deep and moved by `way`.
fn stack(way: [f32; 3], orientation: [f32; 4]) -> [Body; 2] {
    let [x, y, z] = way;
    [cube([0.0, 1.0, 0.0], LEVEL), cube([0.5 + x, 2.995 + y, 0.25 + z], orientation)]
}

/// The collision of both bodies, found anew.
fn anew(bodies: &[Body]) -> Option<Collision> {
    one(&mut Narrow::default(), bodies, CUBES, (0, 1))
}

const CUBES: Geometries<'static> = Geometries(&[Some(SPHERE), Some(Geometry::CUBE)]);

#[test]
fn a_second_look_at_the_same_poses_finds_the_same_bits() {
    let (mut narrow, mut touch) = (Narrow::default(), Touch::unknown((0, 1)));
    let bodies = stack([0.0; 3], [0.001, 0.2, 0.0, 0.979_795_4]);
    let first = narrow.collide(&bodies, CUBES, &mut touch).expect("contact");
    let second = narrow.collide(&bodies, CUBES, &mut touch).expect("contact");
    assert_eq!(bits(&[first]), bits(&[second]));
}

#[test]
fn contacts_that_are_kept_follow_the_poses() {
    let (mut narrow, mut touch) = (Narrow::default(), Touch::unknown((0, 1)));
    narrow.collide(&stack([0.0; 3], LEVEL), CUBES, &mut touch).expect("contact");
    let found_at = touch.b_in_a;
    // Down by 4 mm, aside by 0.9 mm, and turned by 0.1 degrees.
    let moved = stack([0.000_9, -0.004, 0.0], [0.000_872_7, 0.0, 0.0, 1.0]);
    let found = narrow.collide(&moved, CUBES, &mut touch).expect("contact");
    assert_eq!(touch.b_in_a, found_at, "kept");
    let expected = anew(&moved).expect("contact");
    assert_eq!(found.count, 4);
    for contact in found.contacts {
        let near =
            |other: &&Contact| (0..3).all(|k| (other.point[k] - contact.point[k]).abs() < 2e-3);
        let same = expected.contacts.iter().find(near).expect("the point is there, too");
        assert!((same.distance - contact.distance).abs() < 1e-5, "{found:?}, not {expected:?}");
    }
    // Up again, and out of reach: nothing is left of them.
    assert_eq!(narrow.collide(&stack([0.0, 0.026, 0.0], LEVEL), CUBES, &mut touch), None);
}

#[test]
fn contacts_are_found_anew_after_a_way_a_turn_or_a_change_of_shape() {
    let mut ball = stack([0.0; 3], LEVEL);
    ball[1].shape = 0;
    ball[1].pose.position[1] = 2.49;
    for (name, bodies) in [
        ("across", stack([0.000_8, 0.0, 0.000_8], LEVEL)),
        ("along", stack([0.0, -0.010_1, 0.0], LEVEL)),
        ("tilted", stack([0.0; 3], [0.003_5, 0.0, 0.0, 0.999_993_9])),
        ("turned", stack([0.0; 3], [0.0, 0.003_5, 0.0, 0.999_993_9])),
        ("shape", ball),
    ] {
        let (mut narrow, mut touch) = (Narrow::default(), Touch::unknown((0, 1)));
        narrow.collide(&stack([0.0; 3], LEVEL), CUBES, &mut touch).expect("contact");
        let found = narrow.collide(&bodies, CUBES, &mut touch);
        assert_eq!(bits(found.as_slice()), bits(anew(&bodies).as_slice()), "{name}");
        assert!(found.is_some(), "{name}");
    }
}

#[test]
fn contacts_do_not_creep_over_an_edge() {
    let (mut narrow, mut touch) = (Narrow::default(), Touch::unknown((0, 1)));
    let (mut kept, mut last) = (0, 0.0);
    for step in 0..4000_u16 {
        let way = 0.000_4 * f32::from(step);
        let bodies = stack([way, 0.0, 0.0], LEVEL);
        let before = touch.b_in_a;
        let Some(found) = narrow.collide(&bodies, CUBES, &mut touch) else { continue };
        kept += usize::from(touch.b_in_a == before);
        last = way;
        let farthest =
            found.contacts[..found.count as usize].iter().map(|contact| contact.point[0]);
        assert!(farthest.fold(f32::MIN, f32::max) < 1.0 + 2e-3 + MARGIN, "{way}: {found:?}");
    }
    assert!(kept > 2000, "{kept}");
    // The cubes no longer overlap from 1.5 m on.
    assert!((1.499..1.525).contains(&last), "{last}");
}

#[test]
fn what_is_known_of_a_pair_stays_with_it_while_it_is_a_candidate() {
    let mut touches = Vec::new();
    let mut known: Vec<(u32, u32)> = Vec::new();
    let mut random = SplitMix64::new(9);
    for _ in 0..200 {
        let all = (0..4).flat_map(|a| (0..4).map(move |b| (a, b)));
        let candidates: Vec<(u32, u32)> = all.filter(|_| random.below(2) == 0).collect();
        follow(&mut touches, &candidates);
        assert!(touches.iter().map(|touch| touch.pair).eq(candidates.iter().copied()));
        for touch in &mut touches {
            assert_eq!(touch.count == 1, known.contains(&touch.pair), "{candidates:?}, {known:?}");
            touch.count = 1;
        }
        known = candidates;
    }
}
