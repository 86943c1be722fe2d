//! Carries impulses from one step to the next for callers whose contacts have no memory of their
//! own.

use super::impulses::Impulses;
use super::{CONTACT_POINTS, Collision, Collisions, Contact};
use crate::scene::tangents::tangents;

/// Remembers the collisions of the last step with their impulses, and finds them again in the next.
///
/// A contact is the one of the last step if the bodies are the same and it is the nearest within
/// [`reach`](Self::new); a new contact begins with 0. An engine whose manifolds persist knows its
/// contacts better, and needs no such memory.
///
/// ```
/// # use zynq_pgs::{Accelerator, Body, Collision, Contact, Error, OpenOptions};
/// # use zynq_pgs::{Pose, Shape, Velocity};
/// use zynq_pgs::{ContactMemory, StepParameters, WarmCollisions};
///
/// # fn main() -> Result<(), Error> {
/// # let mut accelerator = Accelerator::open(OpenOptions::default())?;
/// # accelerator.set_shapes(&[Shape::STATIC, Shape::isotropic(1.0, 1.5)])?;
/// # let pose = |y| Pose { position: [0.0, y, 0.0], orientation: [0.0, 0.0, 0.0, 1.0] };
/// # let mut bodies =
/// #     vec![(-1.0, 0), (1.0, 1)].into_iter().map(|(y, shape)| {
/// #         Body { pose: pose(y), velocity: Velocity::default(), shape }
/// #     }).collect::<Vec<_>>();
/// # let contacts = [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]]
/// #     .map(|[x, z]| Contact { point: [x, 0.0, z], distance: 0.0 });
/// # let detect = || {
/// #     vec![Collision { body_a: 0, body_b: 1, normal: [0.0, -1.0, 0.0], count: 4, contacts }]
/// # };
/// let parameters = StepParameters::default().with_warm_start(true).with_impulses_out(true);
/// let mut memory = ContactMemory::new(0.02);
/// for _ in 0..3 {
///     let collisions = detect();
///     let impulses = memory.recall(&collisions, 0.85);
///     let warm = WarmCollisions { collisions: &collisions, impulses: &impulses };
///     accelerator.step(&mut bodies, &warm, &parameters)?;
///     memory.remember(&collisions, accelerator.impulses());
/// }
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone)]
pub struct ContactMemory {
    reach: f32,
    /// In the order of their pairs.
    kept: Vec<Kept>,
}

/// A collision of the last step.
#[derive(Debug, Clone, Copy)]
struct Kept {
    /// The bodies, the lower index first.
    pair: [u32; 2],
    collision: Collision,
    impulses: Impulses,
}

impl ContactMemory {
    /// A memory without contacts. A contact that has moved by more than `reach` metres is a new
    /// one.
    #[must_use]
    pub const fn new(reach: f32) -> Self {
        Self { reach, kept: Vec::new() }
    }

    /// Takes the collisions of a step and the impulses that came out of it, in place of the ones of
    /// the step before. Collisions beyond the end of `impulses` are forgotten.
    pub fn remember<C: Collisions + ?Sized>(&mut self, collisions: &C, impulses: &[Impulses]) {
        self.kept.clear();
        for (index, impulses) in (0..collisions.len()).zip(impulses) {
            let collision = collisions.collision(index);
            if !collision.is_empty() {
                let pair = pair_of(&collision);
                self.kept.push(Kept { pair, collision, impulses: *impulses });
            }
        }
        // Stable: collisions of one pair stay in their order.
        self.kept.sort_by_key(|kept| kept.pair);
    }

    /// The impulses with which the collisions of the next step begin: the ones that it remembers,
    /// times `factor`.
    #[must_use]
    pub fn recall<C: Collisions + ?Sized>(&self, collisions: &C, factor: f32) -> Vec<Impulses> {
        let mut left: Vec<Left> = self.kept.iter().map(Left::of).collect();
        (0..collisions.len())
            .map(|index| self.found(&collisions.collision(index), &mut left).scaled(factor))
            .collect()
    }

    /// The impulses of a collision that it remembers, which it takes out of what is `left`.
    fn found(&self, collision: &Collision, left: &mut [Left]) -> Impulses {
        let mut found = Impulses::ZERO;
        if collision.is_empty() {
            return found;
        }
        let pair = pair_of(collision);
        let begin = self.kept.partition_point(|kept| kept.pair < pair);
        let end = self.kept.partition_point(|kept| kept.pair <= pair);
        let mut nearest = None;
        for (contact, to) in points(collision).iter().zip(&mut found.normal) {
            let all = (begin..end).flat_map(|at| (0..CONTACT_POINTS).map(move |i| (at, i)));
            let near = all
                .filter(|(at, i)| left[*at].points[*i])
                .map(|(at, i)| {
                    let old = &self.kept[at].collision.contacts[i];
                    (distance(contact.point, old.point), at, i)
                })
                .filter(|(distance, ..)| *distance <= self.reach)
                .min_by(|(a, ..), (b, ..)| a.total_cmp(b));
            if let Some((_, at, i)) = near {
                *to = self.kept[at].impulses.normal[i];
                left[at].points[i] = false;
                nearest.get_or_insert(at);
            }
        }
        if let Some(at) = nearest.filter(|at| left[*at].friction) {
            left[at].friction = false;
            found.friction = turned(&self.kept[at], collision);
        }
        found
    }
}

/// The parts of a collision of the last step that no collision has taken yet.
#[derive(Debug, Clone, Copy)]
struct Left {
    points: [bool; CONTACT_POINTS],
    friction: bool,
}

impl Left {
    fn of(kept: &Kept) -> Self {
        let count = points(&kept.collision).len();
        Self { points: std::array::from_fn(|i| i < count), friction: true }
    }
}

/// The friction impulses of a collision that is kept, along the tangents of the new one.
fn turned(kept: &Kept, collision: &Collision) -> [f32; 2] {
    let [first, second] = tangents(kept.collision.normal);
    let [along_first, along_second] = kept.impulses.friction;
    // On body A; the bodies may have changed places.
    let sign = if kept.collision.body_a == collision.body_a { 1.0 } else { -1.0 };
    let on_a: [f32; 3] =
        std::array::from_fn(|i| (first[i] * along_first + second[i] * along_second) * sign);
    tangents(collision.normal).map(|t| (t[0] * on_a[0] + t[1] * on_a[1]) + t[2] * on_a[2])
}

fn pair_of(collision: &Collision) -> [u32; 2] {
    let Collision { body_a, body_b, .. } = *collision;
    [body_a.min(body_b), body_a.max(body_b)]
}

fn points(collision: &Collision) -> &[Contact] {
    let count = (collision.points() as usize).min(CONTACT_POINTS);
    &collision.contacts[..count]
}

fn distance(a: [f32; 3], b: [f32; 3]) -> f32 {
    let [x, y, z]: [f32; 3] = std::array::from_fn(|i| a[i] - b[i]);
    ((x * x + y * y) + z * z).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn collision(bodies: [u32; 2], points: &[[f32; 3]]) -> Collision {
        let mut contacts = [Contact::default(); CONTACT_POINTS];
        for (to, point) in contacts.iter_mut().zip(points) {
            to.point = *point;
        }
        let [body_a, body_b] = bodies;
        let count = u32::try_from(points.len()).expect("at most four");
        Collision { body_a, body_b, normal: [0.0, 1.0, 0.0], count, contacts }
    }

    const CORNERS: [[f32; 3]; 2] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]];

    fn remembers() -> ContactMemory {
        let mut memory = ContactMemory::new(0.1);
        let others = collision([1, 3], &CORNERS);
        let ours = collision([2, 7], &CORNERS);
        let impulses = Impulses { normal: [3.0, 4.0, 0.0, 0.0], friction: [0.5, -0.25] };
        memory.remember(&[others, ours][..], &[Impulses::ZERO, impulses]);
        memory
    }

    #[test]
    fn a_contact_is_the_nearest_of_the_same_pair() {
        let moved = [[0.95, 0.01, 0.0], [0.0, 0.0, 0.05]];
        let found = remembers().recall(&[collision([2, 7], &moved)][..], 0.5);
        assert_eq!(found, [Impulses { normal: [2.0, 1.5, 0.0, 0.0], friction: [0.25, -0.125] }]);
        for other in [collision([2, 8], &moved), collision([2, 7], &[[0.5, 0.0, 0.0]])] {
            assert_eq!(remembers().recall(&[other][..], 1.0), [Impulses::ZERO]);
        }
        let empty = Collision { count: 0, ..collision([2, 7], &moved) };
        assert_eq!(remembers().recall(&[empty][..], 1.0), [Impulses::ZERO]);
    }

    #[test]
    fn a_contact_gives_its_impulse_to_one_other() {
        let twice = [CORNERS[0], CORNERS[0]];
        let [found] = remembers().recall(&[collision([2, 7], &twice)][..], 1.0)[..] else {
            panic!("one collision")
        };
        assert_eq!(found.normal.map(f32::to_bits), [3.0, 0.0, 0.0, 0.0].map(f32::to_bits));
        // A manifold of two points may become two collisions of one.
        let split = CORNERS.map(|corner| collision([2, 7], &[corner, CORNERS[0]]));
        let found = remembers().recall(&split[..], 1.0);
        let normals = found.iter().map(|of| of.normal.map(f32::to_bits));
        let expected = [[3.0, 0.0, 0.0, 0.0], [4.0, 0.0, 0.0, 0.0]].map(|of| of.map(f32::to_bits));
        assert!(normals.eq(expected), "{found:?}");
        let rubs = |of: &Impulses| of.friction.iter().any(|impulse| *impulse != 0.0);
        assert!(rubs(&found[0]) && !rubs(&found[1]), "{found:?}");
    }

    #[test]
    fn friction_turns_with_the_normal_and_with_the_order_of_the_bodies() {
        let mut swapped = collision([7, 2], &CORNERS);
        swapped.normal = [0.0, -1.0, 0.0];
        let [found] = remembers().recall(&[swapped][..], 1.0)[..] else { panic!("one collision") };
        let world = |normal: [f32; 3], [g0, g1]: [f32; 2]| {
            let [t0, t1] = tangents(normal);
            [0, 1, 2].map(|i| t0[i] * g0 + t1[i] * g1)
        };
        let on_seven = world(swapped.normal, found.friction);
        let on_two = world([0.0, 1.0, 0.0], [0.5, -0.25]);
        for (a, b) in on_seven.iter().zip(on_two) {
            assert!((a + b).abs() < 1e-6, "{on_seven:?} {on_two:?}");
        }
        assert_eq!(found.normal.map(f32::to_bits), [3.0, 4.0, 0.0, 0.0].map(f32::to_bits));
    }
}
