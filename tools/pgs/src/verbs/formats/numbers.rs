//! This file gathers the numbers of a step, kind by kind.

use zynq_pgs::{Body, CONTACT_POINTS, Collision};

/// Of which sums numbers are a part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Part {
    /// Of both.
    Given,
    /// Streamed with every collision, though the bodies have them already.
    Repeated,
    /// Of none: streamed by another profile.
    Relative,
}

/// A sum over kinds of numbers.
pub(super) struct Sum {
    pub(super) name: &'static str,
    /// Whether a part is in it.
    pub(super) has: fn(Part) -> bool,
}

/// What a step streams, with the positions of both bodies in every collision.
pub(super) const AS_STREAMED: Sum = Sum { name: "as streamed", has: |part| part != Part::Relative };
/// Every number that a step is given.
pub(super) const EACH_ONCE: Sum = Sum { name: "each once", has: |part| part == Part::Given };
/// Both.
pub(super) const SUMS: [Sum; 2] = [AS_STREAMED, EACH_ONCE];

impl Sum {
    /// The numbers in it.
    pub(super) fn of<'a>(&self, kinds: &'a [Numbers]) -> impl Iterator<Item = &'a f32> + Clone {
        let has = self.has;
        kinds.iter().filter(move |kind| has(kind.part)).flat_map(|kind| &kind.values)
    }
}

/// The numbers of one kind.
pub(super) struct Numbers {
    pub(super) name: &'static str,
    pub(super) part: Part,
    pub(super) values: Vec<f32>,
}

/// The numbers of a step, kind by kind.
pub(super) fn numbers(bodies: &[Body], collisions: &[Collision]) -> Vec<Numbers> {
    let of_bodies = |name, field: fn(&Body) -> &[f32]| Numbers {
        name,
        part: Part::Given,
        values: bodies.iter().flat_map(field).copied().collect(),
    };
    let position = |body: u32| {
        let body = usize::try_from(body).ok().and_then(|index| bodies.get(index));
        body.map_or([f32::NAN; 3], |body| body.pose.position)
    };
    let used = |collision: &Collision| {
        let count = usize::try_from(collision.count).unwrap_or(CONTACT_POINTS);
        count.min(CONTACT_POINTS)
    };
    let of_pairs = |name, part, of: &dyn Fn(&Collision) -> Vec<f32>| Numbers {
        name,
        part,
        values: collisions.iter().flat_map(of).filter(|value| !value.is_nan()).collect(),
    };
    let points = |collision: &Collision, of: &dyn Fn([f32; 3]) -> [f32; 3]| -> Vec<f32> {
        collision.contacts[..used(collision)].iter().flat_map(|c| of(c.point)).collect()
    };
    vec![
        of_bodies("velocity", |body| &body.velocity.linear),
        of_bodies("spin", |body| &body.velocity.angular),
        of_pairs("normal", Part::Given, &|c| c.normal.to_vec()),
        of_pairs("positions of A and B", Part::Repeated, &|c| {
            [position(c.body_a), position(c.body_b)].concat()
        }),
        of_pairs("contact points", Part::Given, &|c| points(c, &|point| point)),
        of_pairs("distances", Part::Given, &|c| {
            c.contacts[..used(c)].iter().map(|contact| contact.distance).collect()
        }),
        of_bodies("position", |body| &body.pose.position),
        of_bodies("orientation", |body| &body.pose.orientation),
        of_pairs("relative: B - A", Part::Relative, &|c| {
            less(position(c.body_b), position(c.body_a)).to_vec()
        }),
        of_pairs("relative: points - A", Part::Relative, &|c| {
            points(c, &|point| less(point, position(c.body_a)))
        }),
    ]
}

/// a - b.
fn less(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
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
        let kinds = numbers(&[body(1.0), body(3.0)], &[collision]);
        let of = |name| &kinds.iter().find(|kind| kind.name == name).expect(name).values[..];
        assert_eq!(of("distances"), [-0.25, -0.25]);
        assert_eq!(of("contact points").len(), 6);
        assert_eq!(of("positions of A and B"), [1.0, 0.0, 0.0, 3.0, 0.0, 0.0]);
        assert_eq!(of("relative: B - A"), [2.0, 0.0, 0.0]);
        assert_eq!(of("relative: points - A")[..3], [0.5, 0.5, 0.0]);
        // 13 a body, 3 + 6 + 2 x 4 the collision.
        assert_eq!(AS_STREAMED.of(&kinds).count(), 2 * 13 + 17);
        assert_eq!(EACH_ONCE.of(&kinds).count(), 2 * 13 + 11);
    }
}
