//! Computes where two boxes touch, with parry3d's bits in less time.
//!
//! Nearly all pairs of a pile are boxes. parry computes their manifold in
//! `contact_manifold_cuboid_cuboid` pair by pair, one axis and one point at a time. This module
//! does the same operations in the same order for one pair in each lane, so that every bit is the
//! same; the tests compare. Data that parry keeps for its own callers (features, manifolds of
//! earlier steps) is left out. parry itself handles boxes that are apart along two normals of one
//! box at once, which is rare in a pile.

mod axis;
mod clip;

use super::MARGIN;
use super::lanes::{Mask, Numbers, Rotation, Vector};
use super::points::Points;

/// Two boxes, one in the frame of the other.
#[derive(Debug, Clone, Copy)]
pub(super) struct Placed<N> {
    pub(super) half_a: Vector<N>,
    pub(super) half_b: Vector<N>,
    pub(super) b_in_a: Rotation<N>,
    pub(super) a_in_b: Rotation<N>,
    /// From the centre of A to that of B, in the frame of A.
    pub(super) translation: Vector<N>,
}

/// The contact of two boxes.
#[derive(Clone, Copy)]
pub(super) struct Touch<N: Numbers> {
    /// Unit vector from A to B along which they touch, in the frame of A.
    pub(super) axis: Vector<N>,
    /// The pairs that are farther apart than the margin.
    pub(super) apart: N::Mask,
    /// The pairs that only parry can decide.
    pub(super) unknown: N::Mask,
}

/// Collects the contact points of some pairs; points on B are in the frame of A, too.
#[inline(always)]
pub(super) fn touch<N: Numbers>(
    placed: &Placed<N>,
    pairs: N::Mask,
    points: &mut Points<N>,
) -> Touch<N> {
    let touch = axis::find(placed, MARGIN);
    let pairs = pairs.without(touch.apart).without(touch.unknown);
    if pairs.bits() != 0 {
        clip::points(placed, touch.axis, pairs, points);
    }
    touch
}

impl<N: Numbers> Placed<N> {
    /// Transforms points from the frame of A to that of B.
    #[inline(always)]
    pub(super) fn in_b(&self, point: Vector<N>) -> Vector<N> {
        self.a_in_b.turn(point.minus(self.translation))
    }
}

#[cfg(test)]
mod tests {
    use parry3d::math::{Pose, Rotation as Quaternion, Vector as Vec3};
    use parry3d::query::ContactManifold;
    use parry3d::query::details::contact_manifold_cuboid_cuboid;
    use parry3d::shape::Cuboid;

    use super::super::lanes::{Lanes, Portable, Row, Work, run};
    use super::*;
    use crate::random::SplitMix64;

    /// Two boxes: the pose of B in the frame of A, and their half extents.
    type Pair = (Pose, [f32; 3], [f32; 3]);

    /// Bits of an axis and of points.
    type Manifold = (Vec<u32>, Vec<u32>);

    /// The bits of parry's manifold of two boxes, the axis and the points, whether or not they are
    /// near enough.
    fn by_parry((b_in_a, half_a, half_b): Pair) -> Option<Manifold> {
        let boxes = [half_a, half_b].map(|half| Cuboid::new(Vec3::from_array(half)));
        let mut manifold = ContactManifold::<(), ()>::new();
        contact_manifold_cuboid_cuboid(&b_in_a, &boxes[0], &boxes[1], MARGIN, &mut manifold);
        if manifold.points.is_empty() {
            return None;
        }
        let points = manifold.points.iter().filter(|point| point.dist <= MARGIN);
        let points = points.flat_map(|point| {
            let [a, b] = [point.local_p1, point.local_p2].map(|p| p.to_array());
            a.into_iter().chain(b).chain([point.dist]).map(f32::to_bits)
        });
        Some((manifold.local_n1.to_array().map(f32::to_bits).to_vec(), points.collect()))
    }

    /// The result of the lanes for a pair.
    #[derive(Debug, Clone, PartialEq)]
    enum Found {
        Apart,
        Touching(Manifold),
        /// parry must decide.
        Unknown,
    }

    /// Computes pairs, one in each lane at a time.
    struct Compute<'a>(&'a [Pair], &'a mut Vec<Found>);

    impl Work for Compute<'_> {
        fn with<L: Lanes>(self, lanes: L) {
            let any = lanes.load(&Row::default());
            let mut points = Points::none(any);
            for pairs in self.0.chunks(L::WIDTH) {
                points.clear();
                let vector = |of: &dyn Fn(&Pair) -> [f32; 3]| {
                    let mut rows = [Row::default(); 3];
                    for (lane, pair) in pairs.iter().enumerate() {
                        for (row, number) in rows.iter_mut().zip(of(pair)) {
                            row.0[lane] = number;
                        }
                    }
                    Vector {
                        x: any.of_row(&rows[0]),
                        y: any.of_row(&rows[1]),
                        z: any.of_row(&rows[2]),
                    }
                };
                let mut w = Row::default();
                for (lane, (pose, ..)) in pairs.iter().enumerate() {
                    w.0[lane] = pose.rotation.w;
                }
                let axis =
                    vector(&|(pose, ..)| [pose.rotation.x, pose.rotation.y, pose.rotation.z]);
                let b_in_a = Rotation::new(axis, any.of_row(&w));
                let placed = Placed {
                    half_a: vector(&|(_, half, _)| *half),
                    half_b: vector(&|(.., half)| *half),
                    b_in_a,
                    a_in_b: b_in_a.inverse(),
                    translation: vector(&|(pose, ..)| pose.translation.to_array()),
                };
                let touch = touch(&placed, any.is(any), &mut points);
                for lane in 0..pairs.len() {
                    self.1.push(found(&placed, &touch, &points, lane));
                }
            }
        }
    }

    fn found<N: Numbers>(
        placed: &Placed<N>,
        touch: &Touch<N>,
        points: &Points<N>,
        lane: usize,
    ) -> Found {
        let is = |mask: N::Mask| mask.bits() >> lane & 1 != 0;
        let bits = |vector: Vector<N>| vector.rows().map(|row| row.0[lane].to_bits());
        assert!(!is(touch.apart.and(touch.unknown)));
        if is(touch.apart) || is(touch.unknown) {
            assert!(points.slots().iter().all(|slot| !is(slot.taken)));
            return if is(touch.apart) { Found::Apart } else { Found::Unknown };
        }
        let mut numbers = Vec::new();
        for slot in points.slots().iter().filter(|slot| is(slot.taken)) {
            numbers.extend(bits(slot.on_a));
            numbers.extend(bits(placed.in_b(slot.on_b)));
            numbers.push(slot.distance.row().0[lane].to_bits());
        }
        Found::Touching((bits(touch.axis).to_vec(), numbers))
    }

    /// A pair in one of several positions: random, stacked and slightly tilted, turned about the
    /// vertical only, along the axes, and on edges.
    fn pair(random: &mut SplitMix64, kind: u32) -> Pair {
        let mut sign = || random.sign();
        let tilt = match kind {
            0 => 1.0,
            1 => 1e-3,
            _ => 0.0,
        };
        let q = match kind {
            0 | 1 => [sign() * tilt, sign() * tilt, sign() * tilt, 1.0],
            2 => [0.0, sign(), 0.0, 1.0],
            3 => [0.0, 0.0, 0.0, 1.0],
            _ => [sign(), 0.0, 1.0, 0.1 * sign()],
        };
        let length = (((q[0] * q[0] + q[1] * q[1]) + q[2] * q[2]) + q[3] * q[3]).sqrt();
        let half_a = [1.0, 1.0 + 0.5 * sign(), 1.0];
        let half_b = [1.0, 1.0, 1.0 + 0.5 * sign()];
        let above = half_a[1] + half_b[1] + 0.03 * sign();
        let translation = match kind {
            0 => [2.0 * sign(), 2.0 * sign(), 2.0 * sign()],
            // On the lattice of the thesis' scene, where ties are exact.
            3 => [1.0, half_a[1] + half_b[1], -1.2 * sign().signum()],
            _ => [1.5 * sign(), above, 1.5 * sign()],
        };
        let rotation = Quaternion::from_array(q.map(|value| value / length));
        (Pose::from_parts(Vec3::from_array(translation), rotation), half_a, half_b)
    }

    #[test]
    fn not_a_bit_differs_from_what_parry_computes() {
        let mut random = SplitMix64::new(7);
        for kind in 0..5 {
            // Not a multiple of the lanes, so that some stay empty.
            let pairs: Vec<Pair> = (0..4001).map(|_| pair(&mut random, kind)).collect();
            let (mut portable, mut widest) = (Vec::new(), Vec::new());
            Portable.run(Compute(&pairs, &mut portable));
            run(Compute(&pairs, &mut widest));
            assert!(portable == widest, "kind {kind}");
            assert_eq!(portable.len(), pairs.len());

            let (mut touching, mut apart, mut unknown) = (0, 0, 0);
            for (pair, found) in pairs.into_iter().zip(portable) {
                let expected = by_parry(pair);
                match found {
                    Found::Touching(found) => {
                        touching += 1;
                        // parry has no axis for a pair without points.
                        let none = expected.is_none() && found.1.is_empty();
                        assert!(none || expected == Some(found), "{pair:?}");
                    }
                    Found::Apart => {
                        apart += 1;
                        assert_eq!(expected, None, "{pair:?}");
                    }
                    Found::Unknown => unknown += 1,
                }
            }
            assert!(touching > 800, "kind {kind}: {touching}, {apart}, {unknown}");
            assert!(unknown < 400, "kind {kind}: {touching}, {apart}, {unknown}");
        }
    }

    #[test]
    fn boxes_apart_along_two_normals_are_left_to_parry() {
        let pose = Pose::from_parts(Vec3::new(2.005, 2.005, 0.0), Quaternion::IDENTITY);
        let mut found = Vec::new();
        run(Compute(&[(pose, [1.0; 3], [1.0; 3])], &mut found));
        assert_eq!(found, [Found::Unknown]);
    }
}
