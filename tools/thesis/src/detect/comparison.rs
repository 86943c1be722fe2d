//! Compares detected collisions with a folder's.

use scene::{GROUND, Scene};
use zynq_pgs::{Collision, Contact};

use super::cause::{Beside, NormalCause, PointCause, SAME_POINT, nearest};
use super::geometry::{Cube, Vector, angle};

/// Depth beyond which a missing or extra pair is a difference, m.
pub(super) const DEEP: f64 = 1e-3;

/// Two bodies, the lower index first.
pub(super) type Pair = (u32, u32);

/// Pairs that only one side has.
#[derive(Debug, Default)]
pub(super) struct OneSided {
    pub(super) count: u64,
    /// The number deeper than [`DEEP`].
    pub(super) deep: u64,
    /// The least distance, m, and its pair.
    pub(super) deepest: Option<(f64, Pair)>,
}

impl OneSided {
    fn add(&mut self, collision: &Collision) {
        let distance = deepest(collision);
        self.count += 1;
        self.deep += u64::from(distance < -DEEP);
        if self.deepest.is_none_or(|(least, _)| distance < least) {
            self.deepest = Some((distance, pair(collision)));
        }
    }
}

/// Differences of one kind.
#[derive(Debug, Default, Clone, Copy)]
pub(super) struct Tally {
    pub(super) count: u64,
    sum: f64,
    /// The largest difference, and its pair.
    pub(super) largest: Option<(f64, Pair)>,
}

impl Tally {
    fn add(&mut self, difference: f64, pair: Pair) {
        self.count += 1;
        self.sum += difference;
        if self.largest.is_none_or(|(most, _)| difference > most) {
            self.largest = Some((difference, pair));
        }
    }

    /// The mean difference; 0 without differences.
    pub(super) fn mean(&self) -> f64 {
        self.sum / (self.count as f64).max(1.0)
    }
}

/// The result of a comparison.
#[derive(Debug, Default)]
pub(super) struct Comparison {
    /// Collisions of the folder, without empty ones.
    pub(super) theirs: u64,
    pub(super) ours: u64,
    pub(super) missing: OneSided,
    pub(super) extra: OneSided,
    /// Angles between normals, degrees, by [`NormalCause::ALL`].
    pub(super) normals: [Tally; NormalCause::ALL.len()],
    /// The same of pairs deeper than [`DEEP`] on both sides.
    pub(super) deep_normals: Tally,
    /// Distances of the folder's points from our nearest, m, by [`PointCause::ALL`].
    pub(super) points: [Tally; PointCause::ALL.len()],
    /// Differences between the depths of points at one place, m.
    pub(super) depths: Tally,
    /// Our points.
    pub(super) our_points: u64,
    /// Our points at whose place the folder has none.
    pub(super) unmatched: u64,
    /// The same, in collisions without a point of the cause [`PointCause::First`].
    pub(super) unmatched_otherwise: u64,
}

impl Comparison {
    /// Compares the collisions of the scene's last detection with the folder's.
    pub(super) fn of(scene: &Scene, folder: &[Collision]) -> Self {
        let mut theirs: Vec<&Collision> = folder.iter().filter(|c| c.count > 0).collect();
        theirs.sort_by_key(|collision| pair(collision));
        let ours = scene.collisions();
        let count = |length: usize| length as u64;
        let mut found =
            Self { theirs: count(theirs.len()), ours: count(ours.len()), ..Self::default() };
        let (mut ours, mut theirs) = (ours.iter().peekable(), theirs.into_iter().peekable());
        loop {
            match (ours.peek().map(|c| pair(c)), theirs.peek().map(|c| pair(c))) {
                (None, None) => break,
                (Some(our), Some(their)) if our == their => {
                    if let (Some(our), Some(their)) = (ours.next(), theirs.next()) {
                        found.compare(scene, our, their);
                    }
                }
                (Some(our), their) if their.is_none_or(|their| our < their) => {
                    ours.next().into_iter().for_each(|collision| found.extra.add(collision));
                }
                _ => theirs.next().into_iter().for_each(|collision| found.missing.add(collision)),
            }
        }
        found
    }

    /// Whether no deep pair is missing or extra.
    pub(super) fn agrees(&self) -> bool {
        self.missing.deep == 0 && self.extra.deep == 0
    }

    fn compare(&mut self, scene: &Scene, ours: &Collision, theirs: &Collision) {
        let pair = pair(ours);
        let is_turned = ours.body_a != theirs.body_a;
        let turned = if is_turned { -1.0 } else { 1.0 };
        let our_normal = ours.normal.map(|value| turned * f64::from(value));
        let their_normal = theirs.normal.map(f64::from);
        let bodies = scene.bodies();
        let cubes = (pair.0 != GROUND)
            .then(|| [theirs.body_a, theirs.body_b].map(|body| Cube::of(&bodies[body as usize])));
        let cause = NormalCause::of(cubes.as_ref(), our_normal, their_normal);
        let off = angle(our_normal, their_normal);
        tally(&mut self.normals, &NormalCause::ALL, cause).add(off, pair);
        if deepest(ours) < -DEEP && deepest(theirs) < -DEEP {
            self.deep_normals.add(off, pair);
        }

        // Our points, on the folder's body B.
        let place = |contact: &Contact| -> Vector {
            let along = if is_turned { f64::from(contact.distance) } else { 0.0 };
            [0, 1, 2].map(|k| f64::from(contact.point[k]) + along * f64::from(ours.normal[k]))
        };
        let our_contacts = used(ours);
        let our_places: Vec<Vector> = our_contacts.iter().map(place).collect();
        let all = scene.all_points(ours.body_a, ours.body_b).unwrap_or_default();
        let all: Vec<Vector> = all.iter().map(place).collect();
        let beside = Beside { cubes, normal: their_normal, cause, ours: &our_places, all: &all };
        let mut has_first = false;
        for (index, contact) in used(theirs).iter().enumerate() {
            let point = contact.point.map(f64::from);
            let cause = PointCause::of(&beside, index, point);
            has_first |= cause == PointCause::First;
            let off = nearest(point, &our_places);
            tally(&mut self.points, &PointCause::ALL, cause).add(off, pair);
            if cause == PointCause::Same {
                let depths = our_contacts.iter().zip(&our_places).filter_map(|(our, place)| {
                    let is_here = nearest(point, std::slice::from_ref(place)) <= SAME_POINT;
                    is_here.then(|| (f64::from(our.distance) - f64::from(contact.distance)).abs())
                });
                self.depths.add(depths.fold(f64::INFINITY, f64::min), pair);
            }
        }
        let their_places: Vec<Vector> =
            used(theirs).iter().map(|contact| contact.point.map(f64::from)).collect();
        let is_unmatched = |place: &&Vector| nearest(**place, &their_places) > SAME_POINT;
        let unmatched = our_places.iter().filter(is_unmatched).count() as u64;
        self.our_points += our_places.len() as u64;
        self.unmatched += unmatched;
        self.unmatched_otherwise += if has_first { 0 } else { unmatched };
    }
}

/// The tally of a cause.
fn tally<'a, C: PartialEq>(tallies: &'a mut [Tally], causes: &[C], cause: C) -> &'a mut Tally {
    let index = causes.iter().position(|other| *other == cause).unwrap_or_default();
    &mut tallies[index]
}

fn pair(collision: &Collision) -> Pair {
    let (a, b) = (collision.body_a, collision.body_b);
    (a.min(b), a.max(b))
}

/// The contact points in use.
pub(super) fn used(collision: &Collision) -> &[Contact] {
    let count = usize::try_from(collision.count).unwrap_or(usize::MAX);
    collision.contacts.get(..count).unwrap_or(&collision.contacts)
}

/// The least distance of the points, m.
fn deepest(collision: &Collision) -> f64 {
    used(collision).iter().map(|c| f64::from(c.distance)).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use scene::SceneOptions;

    use super::*;

    fn scene() -> Scene {
        let grid = "3x3x3".parse().expect("a grid");
        let options = SceneOptions { grid, drop: 0.0 };
        let mut scene = Scene::new(&options).expect("a scene");
        for (index, body) in (0_u8..).zip(scene.bodies_mut()).skip(1) {
            body.pose.position[1] -= 0.005 * f32::from((index - 1) / 3 % 3);
        }
        scene.detect();
        scene
    }

    /// A collision as the other body sees it.
    fn turned(collision: &Collision) -> Collision {
        let mut turned = *collision;
        (turned.body_a, turned.body_b) = (collision.body_b, collision.body_a);
        turned.normal = collision.normal.map(|value| -value);
        for contact in &mut turned.contacts {
            for (coordinate, normal) in contact.point.iter_mut().zip(collision.normal) {
                *coordinate += contact.distance * normal;
            }
        }
        turned
    }

    #[test]
    fn a_detection_agrees_with_itself_in_any_order_and_direction() {
        let scene = scene();
        let theirs: Vec<Collision> = scene.collisions().iter().rev().map(turned).collect();
        let found = Comparison::of(&scene, &theirs);
        assert!(found.agrees() && found.theirs > 20 && found.theirs == found.ours);
        assert_eq!((found.missing.count, found.extra.count, found.unmatched), (0, 0, 0));
        assert_eq!(found.normals[0].count, found.theirs);
        assert_eq!(found.points[0].count, found.our_points);
        assert!(found.points[0].largest.is_some_and(|(most, _)| most < 1e-5), "{found:?}");
        assert!(found.depths.largest.is_some_and(|(most, _)| most < 1e-6), "{found:?}");
    }

    #[test]
    fn what_only_one_side_has_is_a_difference_if_it_is_deep() {
        let scene = scene();
        let all = scene.collisions().to_vec();
        let deep = all.iter().position(|c| deepest(c) < -DEEP).expect("a deep pair");
        let shallow = all.iter().position(|c| deepest(c) > -DEEP).expect("a shallow pair");
        let without = |left_out: usize| {
            let mut some = all.clone();
            some.remove(left_out);
            Comparison::of(&scene, &some)
        };
        let found = without(deep);
        assert!(!found.agrees());
        assert_eq!((found.extra.count, found.extra.deep, found.missing.count), (1, 1, 0));
        assert_eq!(found.extra.deepest.map(|(_, at)| at), Some(pair(&all[deep])));
        let found = without(shallow);
        assert!(found.agrees());
        assert_eq!((found.extra.count, found.extra.deep), (1, 0));

        let mut more = all.clone();
        more.push(Collision { body_a: 1, body_b: 27, ..all[deep] });
        let found = Comparison::of(&scene, &more);
        assert!(!found.agrees() && found.missing.deep == 1);
        more.last_mut().expect("one").count = 0;
        assert_eq!(Comparison::of(&scene, &more).missing.count, 0, "an empty collision is none");
    }

    #[test]
    fn moved_points_and_turned_normals_are_counted_with_their_places() {
        let scene = scene();
        let mut theirs = scene.collisions().to_vec();
        let last = theirs.len() - 1;
        theirs[last].contacts[0].point[0] += 0.25;
        theirs[last].contacts[1].point[0] += 0.5;
        theirs[0].normal = [0.1_f32.sin(), -(0.1_f32.cos()), 0.0];
        let found = Comparison::of(&scene, &theirs);
        let of = |cause: PointCause| {
            let index = PointCause::ALL.iter().position(|other| *other == cause).expect("listed");
            found.points[index]
        };
        assert_eq!((of(PointCause::First).count, of(PointCause::Unknown).count), (1, 1));
        let largest = of(PointCause::Unknown).largest.expect("one");
        assert_eq!(largest.1, pair(&theirs[last]));
        assert!(found.unmatched == 2 && found.unmatched_otherwise == 0, "{found:?}");
        let [.., unknown] = found.normals;
        assert_eq!(unknown.count, 1);
        assert!(unknown.largest.is_some_and(|(off, at)| (off - 5.73).abs() < 0.01 && at == (0, 1)));
    }
}
