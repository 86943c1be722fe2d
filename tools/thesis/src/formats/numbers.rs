//! Collects the numbers of a step by kind.

use zynq_pgs::scene::CONTACT_POINTS;
use zynq_pgs::{Body, Collision, Shape};

/// The sums that include a kind of numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Membership {
    /// In both sums.
    Given,
    /// Streamed with every collision, although the bodies have these numbers already.
    Repeated,
    /// In no sum: only another profile streams these numbers.
    Relative,
}

/// A sum over kinds of numbers.
pub(crate) struct Sum {
    pub(crate) name: &'static str,
    /// Whether the sum includes a part.
    pub(crate) has: fn(Membership) -> bool,
}

/// The numbers that a step streams, with the positions of both bodies in every collision.
pub(crate) const AS_STREAMED: Sum =
    Sum { name: "as streamed", has: |part| part != Membership::Relative };
/// Every input number of a step, once.
pub(crate) const EACH_ONCE: Sum = Sum { name: "each once", has: |part| part == Membership::Given };
/// Both sums.
pub(crate) const SUMS: [Sum; 2] = [AS_STREAMED, EACH_ONCE];

impl Sum {
    /// The numbers of the sum.
    pub(crate) fn of<'a>(&self, kinds: &'a [Numbers]) -> impl Iterator<Item = &'a f32> + Clone {
        let has = self.has;
        kinds.iter().filter(move |kind| has(kind.part)).flat_map(|kind| &kind.values)
    }
}

/// The numbers of one kind.
pub(crate) struct Numbers {
    pub(crate) name: &'static str,
    pub(crate) part: Membership,
    pub(crate) values: Vec<f32>,
}

/// The numbers of a step, kind by kind.
pub(crate) fn numbers(bodies: &[Body], shapes: &[Shape], collisions: &[Collision]) -> Vec<Numbers> {
    let of_bodies = |name, field: fn(&Body) -> &[f32]| Numbers {
        name,
        part: Membership::Given,
        values: bodies.iter().flat_map(field).copied().collect(),
    };
    let position = |body: u32| {
        let body = usize::try_from(body).ok().and_then(|index| bodies.get(index));
        body.map_or([f32::NAN; 3], |body| body.pose.position)
    };
    let is_static = |body: u32| {
        let body = usize::try_from(body).ok().and_then(|index| bodies.get(index));
        let shape = body.and_then(|body| shapes.get(usize::try_from(body.shape).ok()?));
        shape.is_some_and(|shape| shape.inverse_mass == 0.0)
    };
    // A static body is placed at the position of the other one.
    let seen_from = |body, other| position(if is_static(body) { other } else { body });
    let used = |collision: &Collision| {
        let count = usize::try_from(collision.count).unwrap_or(CONTACT_POINTS);
        count.min(CONTACT_POINTS)
    };
    // Nothing of an empty collision is streamed.
    let given = || collisions.iter().filter(|collision| collision.count > 0);
    let of_pairs = |name, part, of: &dyn Fn(&Collision) -> Vec<f32>| Numbers {
        name,
        part,
        values: given().flat_map(of).filter(|value| !value.is_nan()).collect(),
    };
    let points = |collision: &Collision, of: &dyn Fn([f32; 3]) -> [f32; 3]| -> Vec<f32> {
        collision.contacts[..used(collision)].iter().flat_map(|c| of(c.point)).collect()
    };
    vec![
        of_bodies("velocity", |body| &body.velocity.linear),
        of_bodies("spin", |body| &body.velocity.angular),
        of_pairs("normal", Membership::Given, &|c| c.normal.to_vec()),
        of_pairs("positions of A and B", Membership::Repeated, &|c| {
            [position(c.body_a), position(c.body_b)].concat()
        }),
        of_pairs("contact points", Membership::Given, &|c| points(c, &|point| point)),
        of_pairs("distances", Membership::Given, &|c| {
            c.contacts[..used(c)].iter().map(|contact| contact.distance).collect()
        }),
        of_bodies("position", |body| &body.pose.position),
        of_bodies("orientation", |body| &body.pose.orientation),
        of_pairs("relative: B - A", Membership::Relative, &|c| {
            subtract(seen_from(c.body_b, c.body_a), seen_from(c.body_a, c.body_b)).to_vec()
        }),
        of_pairs("relative: points - A", Membership::Relative, &|c| {
            points(c, &|point| subtract(point, seen_from(c.body_a, c.body_b)))
        }),
    ]
}

/// a - b.
fn subtract(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_numbers_of_a_step_are_those_of_its_records() {
        use zynq_pgs::{Contact, Pose, Velocity};
        let body = |x| Body {
            pose: Pose { position: [x, 0.0, 0.0], orientation: [0.0, 0.0, 0.0, 1.0] },
            velocity: Velocity::default(),
            shape: 0,
        };
        let contacts = [Contact { point: [1.5, 0.5, 0.0], distance: -0.25 }; CONTACT_POINTS];
        let collision =
            Collision { body_a: 0, body_b: 1, normal: [-1.0, 0.0, 0.0], count: 2, contacts };
        let bodies = [body(1.0), body(3.0)];
        let kinds = numbers(&bodies, &[Shape::isotropic(1.0, 1.0)], &[collision]);
        let of = |name| &kinds.iter().find(|kind| kind.name == name).expect(name).values[..];
        assert_eq!(of("distances"), [-0.25, -0.25]);
        assert_eq!(of("contact points").len(), 6);
        assert_eq!(of("positions of A and B"), [1.0, 0.0, 0.0, 3.0, 0.0, 0.0]);
        assert_eq!(of("relative: B - A"), [2.0, 0.0, 0.0]);
        assert_eq!(of("relative: points - A")[..3], [0.5, 0.5, 0.0]);
        // 13 numbers a body, 3 + 6 + 2 x 4 for the collision.
        assert_eq!(AS_STREAMED.of(&kinds).count(), 2 * 13 + 17);
        assert_eq!(EACH_ONCE.of(&kinds).count(), 2 * 13 + 11);

        // A static A is placed at B.
        let mut bodies = bodies;
        bodies[1].shape = 1;
        let shapes = [Shape::STATIC, Shape::isotropic(1.0, 1.0)];
        let kinds = numbers(&bodies, &shapes, &[collision]);
        let of = |name| &kinds.iter().find(|kind| kind.name == name).expect(name).values[..];
        assert_eq!(of("relative: B - A"), [0.0; 3]);
        assert_eq!(of("relative: points - A")[..3], [-1.5, 0.5, 0.0]);
    }
}
