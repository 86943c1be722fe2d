//! This file finds where two bodies touch.
//!
//! Pairs are taken a few at a time, one in each lane. Those of boxes are computed [here](super::boxes),
//! with the bits of [parry](super::parry), which is asked about all others; the choice of points and
//! their way into the world is the same for both.

use zynq_pgs::{Body, CONTACT_POINTS, Collision, Contact};

use super::Geometries;
use super::boxes::{self, Placed};
use super::lanes::{self, LANES_MAX, Lanes, Mask, Numbers, Rotation, Row, Vector, Work};
use super::parry::Parry;
use super::points::Points;
use super::reduce::reduce;
use crate::Geometry;

/// How far from 1 the length of a normal may be: rounding is far below, a broken pose above.
const NORMAL_TOLERANCE: f32 = 5e-4;

/// The narrow phase, with its buffers.
#[derive(Debug, Default)]
pub(super) struct Narrow {
    parry: Parry,
}

impl Narrow {
    /// Adds the collisions of those pairs of `bodies` that have one, in their order.
    pub(super) fn collide(
        &mut self,
        bodies: &[Body],
        geometries: Geometries<'_>,
        pairs: impl Iterator<Item = (u32, u32)>,
        found: &mut Vec<Collision>,
    ) {
        lanes::run(Collide { narrow: self, bodies, geometries, pairs, found });
    }
}

/// What is done, with whatever lanes.
struct Collide<'a, I> {
    narrow: &'a mut Narrow,
    bodies: &'a [Body],
    geometries: Geometries<'a>,
    pairs: I,
    found: &'a mut Vec<Collision>,
}

impl<I: Iterator<Item = (u32, u32)>> Work for Collide<'_, I> {
    #[inline(always)]
    fn with<L: Lanes>(mut self, lanes: L) {
        let mut batch = Batch::default();
        let mut points = Points::none(lanes.load(&Row::default()));
        loop {
            batch.take(L::WIDTH, &mut self.pairs, self.bodies, self.geometries);
            if batch.count == 0 {
                break;
            }
            batch.collide(lanes, &mut self.narrow.parry, &mut points, self.bodies, self.found);
        }
    }
}

/// One body of the pairs of a batch.
#[derive(Debug, Default)]
struct Side {
    position: [Row; 3],
    orientation: [Row; 4],
    half_extents: [Row; 3],
}

impl Side {
    #[inline(always)]
    fn set(&mut self, lane: usize, body: &Body, geometry: Geometry) -> bool {
        for (row, number) in self.position.iter_mut().zip(body.pose.position) {
            row.0[lane] = number;
        }
        for (row, number) in self.orientation.iter_mut().zip(body.pose.orientation) {
            row.0[lane] = number;
        }
        // What is no box is given to the lanes as one without a size; nothing is made of it.
        let (half_extents, is_box) = match geometry {
            Geometry::Box { half_extents } => (half_extents, true),
            _ => ([0.0; 3], false),
        };
        for (row, number) in self.half_extents.iter_mut().zip(half_extents) {
            row.0[lane] = number;
        }
        is_box
    }

    #[inline(always)]
    fn load<L: Lanes>(&self, lanes: L) -> Loaded<L::Numbers> {
        let ([px, py, pz], [hx, hy, hz]) = (&self.position, &self.half_extents);
        let [x, y, z, w] = &self.orientation;
        Loaded {
            position: Vector { x: lanes.load(px), y: lanes.load(py), z: lanes.load(pz) },
            axis: Vector { x: lanes.load(x), y: lanes.load(y), z: lanes.load(z) },
            w: lanes.load(w),
            half_extents: Vector { x: lanes.load(hx), y: lanes.load(hy), z: lanes.load(hz) },
        }
    }
}

/// The same in lanes; the orientation as a quaternion's axis and w.
struct Loaded<N> {
    position: Vector<N>,
    axis: Vector<N>,
    w: N,
    half_extents: Vector<N>,
}

/// Pairs, one in each lane.
#[derive(Debug, Default)]
struct Batch {
    pairs: [(u32, u32); LANES_MAX],
    geometries: [Option<[Geometry; 2]>; LANES_MAX],
    count: usize,
    /// In which lanes both are boxes.
    boxes: u32,
    a: Side,
    b: Side,
}

impl Batch {
    /// Takes the next pairs, as many as there are lanes or left.
    #[inline(always)]
    fn take(
        &mut self,
        lanes: usize,
        pairs: &mut impl Iterator<Item = (u32, u32)>,
        bodies: &[Body],
        geometries: Geometries<'_>,
    ) {
        (self.count, self.boxes) = (0, 0);
        while self.count < lanes.min(LANES_MAX) {
            let Some((a, b)) = pairs.next() else { break };
            let (Some(body_a), Some(body_b)) = (bodies.get(a as usize), bodies.get(b as usize))
            else {
                continue;
            };
            let (Some(of_a), Some(of_b)) = (geometries.of(body_a), geometries.of(body_b)) else {
                continue;
            };
            let lane = self.count;
            let are_boxes = self.a.set(lane, body_a, of_a) & self.b.set(lane, body_b, of_b);
            self.boxes |= u32::from(are_boxes) << lane;
            self.pairs[lane] = (a, b);
            self.geometries[lane] = Some([of_a, of_b]);
            self.count += 1;
        }
    }

    /// Adds the collisions of the pairs.
    #[inline(always)]
    fn collide<L: Lanes>(
        &self,
        lanes: L,
        parry: &mut Parry,
        points: &mut Points<L::Numbers>,
        bodies: &[Body],
        found: &mut Vec<Collision>,
    ) {
        let (a, b) = (self.a.load(lanes), self.b.load(lanes));
        let (turn_a, turn_b) = (Rotation::new(a.axis, a.w), Rotation::new(b.axis, b.w));
        // As glam does it: the inverse of A's pose, times B's.
        let (axis, w) = product((a.axis.negated(), a.w), (b.axis, b.w));
        let b_in_a = Rotation::new(axis, w);
        let placed = Placed {
            half_a: a.half_extents,
            half_b: b.half_extents,
            b_in_a,
            a_in_b: b_in_a.inverse(),
            translation: turn_a.inverse().turn(b.position.minus(a.position)),
        };

        points.clear();
        let zero = w.all(0.0);
        let mut axis = Vector::all(zero, [0.0; 3]);
        let mut by_parry = (1 << self.count) - 1;
        if self.boxes != 0 {
            let boxes = lanes::mask(zero, self.boxes);
            let touch = boxes::touch(&placed, boxes, points);
            axis = touch.axis;
            by_parry &= !(self.boxes & !touch.unknown.bits());
        }
        if by_parry != 0 {
            axis = self.ask_parry(by_parry, parry, bodies, axis, points);
        }

        let normal = turn_a.turn(axis).negated();
        let error = (normal.dot(normal).sqrt() - zero.all(1.0)).abs();
        let mut valid = zero.all(NORMAL_TOLERANCE).at_least(error);
        let chosen = reduce(points, axis);
        let nothing = Vector::all(zero, [0.0; 3]);
        let mut contacts = [[Row::default(); 4]; CONTACT_POINTS];
        for (slot, contact) in chosen.iter().zip(&mut contacts) {
            let mut on_b = placed.in_b(slot.on_b);
            if by_parry != 0 {
                on_b = slot.on_b.or(lanes::mask(zero, by_parry), on_b);
            }
            let point = turn_b.turn(on_b).plus(b.position);
            valid = valid.without(slot.taken.without(point.is_finite()));
            let Vector { x, y, z } = point.or(slot.taken, nothing);
            let distance = slot.distance.or(slot.taken, zero);
            *contact = [x.row(), y.row(), z.row(), distance.row()];
        }
        let [first, second, third, fourth] = &chosen;
        let taken =
            [first.taken.bits(), second.taken.bits(), third.taken.bits(), fourth.taken.bits()];
        let normal = normal.rows();
        let valid = valid.bits() & taken[0];
        for (lane, &(body_a, body_b)) in self.pairs.iter().enumerate().take(self.count) {
            if valid >> lane & 1 != 0 {
                let contact = |[x, y, z, distance]: &[Row; 4]| Contact {
                    point: [x.0[lane], y.0[lane], z.0[lane]],
                    distance: distance.0[lane],
                };
                found.push(Collision {
                    body_a,
                    body_b,
                    normal: [normal[0].0[lane], normal[1].0[lane], normal[2].0[lane]],
                    count: taken.iter().map(|taken| taken >> lane & 1).sum(),
                    contacts: contacts.each_ref().map(contact),
                });
            }
        }
    }

    /// Takes the points that parry finds of the pairs in these lanes, on B in its own frame; the axes
    /// with theirs among them.
    #[inline(never)]
    fn ask_parry<N: Numbers>(
        &self,
        lanes: u32,
        parry: &mut Parry,
        bodies: &[Body],
        axis: Vector<N>,
        points: &mut Points<N>,
    ) -> Vector<N> {
        let mut rows = axis.rows();
        for (lane, &(a, b)) in self.pairs.iter().enumerate().take(self.count) {
            let Some(geometries) = self.geometries[lane].filter(|_| lanes >> lane & 1 != 0) else {
                continue;
            };
            let pair = [&bodies[a as usize], &bodies[b as usize]];
            let Some((axis, places)) = parry.ask(pair, geometries) else { continue };
            for (row, number) in rows.iter_mut().zip(axis) {
                row.0[lane] = number;
            }
            for (index, place) in places.iter().enumerate() {
                points.put(index, lane, place.on_a, place.on_b, place.distance);
            }
        }
        let [x, y, z] = &rows;
        Vector { x: axis.x.of_row(x), y: axis.x.of_row(y), z: axis.x.of_row(z) }
    }
}

/// The product of two quaternions, as axis and w.
#[inline(always)]
fn product<N: Numbers>(
    (Vector { x: x0, y: y0, z: z0 }, w0): (Vector<N>, N),
    (Vector { x: x1, y: y1, z: z1 }, w1): (Vector<N>, N),
) -> (Vector<N>, N) {
    let axis = Vector {
        x: w0 * x1 + x0 * w1 + y0 * z1 - z0 * y1,
        y: w0 * y1 - x0 * z1 + y0 * w1 + z0 * x1,
        z: w0 * z1 + x0 * y1 - y0 * x1 + z0 * w1,
    };
    (axis, w0 * w1 - x0 * x1 - y0 * y1 - z0 * z1)
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "of boxes along the axes the normal is exact")]
mod tests {
    use zynq_pgs::{Pose, Velocity};

    use super::super::MARGIN;
    use super::*;

    const LEVEL: [f32; 4] = [0.0, 0.0, 0.0, 1.0];

    fn cube(position: [f32; 3], orientation: [f32; 4]) -> Body {
        Body { pose: Pose { position, orientation }, velocity: Velocity::default(), shape: 1 }
    }

    /// The collision of one pair.
    fn one(
        narrow: &mut Narrow,
        bodies: &[Body],
        geometries: Geometries<'_>,
        pair: (u32, u32),
    ) -> Option<Collision> {
        let mut found = Vec::new();
        narrow.collide(bodies, geometries, std::iter::once(pair), &mut found);
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
            // Where the faces overlap.
            assert!((9.999..11.001).contains(&contact.point[0]), "{contact:?}");
            assert!((-0.201..1.001).contains(&contact.point[2]), "{contact:?}");
        }
        // The other way round the normal turns and the points lie on the other cube.
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
        // parry gives the eight corners of the octagon in which the faces overlap, at the radius
        // 1 / cos 22.5 degrees. The four are opposites in pairs, the pairs at right angles.
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

    /// The collision of two bodies of these geometries, and that of the two the other way round.
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
        // Its round end reaches a corner's diagonal no farther than its radius.
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
}
