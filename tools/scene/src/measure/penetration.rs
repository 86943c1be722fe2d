//! Measures the penetration of bodies.

use zynq_pgs::scene::CONTACT_POINTS;
use zynq_pgs::{Body, Collision};

use super::{dot, rotation, to_body, to_world};

/// Penetration depths over the contact points with a negative distance.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Penetration {
    /// Contact points, penetrating or not.
    pub contacts: u64,
    /// Contact points with a negative distance.
    pub penetrating: u64,
    /// Mean depth of these, m; 0 if there are none.
    pub mean: f64,
    /// Largest depth, m; 0 if there is none.
    pub largest: f64,
}

/// Measures the depths of these collisions' contact points.
#[must_use]
pub fn penetration(collisions: &[Collision]) -> Penetration {
    let mut found = Penetration::default();
    let mut sum = 0.0;
    for collision in collisions {
        for contact in &collision.contacts[..used(collision)] {
            found.contacts += 1;
            if contact.distance < 0.0 {
                let depth = -f64::from(contact.distance);
                found.penetrating += 1;
                sum += depth;
                if depth > found.largest {
                    found.largest = depth;
                }
            }
        }
    }
    if found.penetrating > 0 {
        found.mean = sum / found.penetrating as f64;
    }
    found
}

fn used(collision: &Collision) -> usize {
    usize::try_from(collision.count).map_or(CONTACT_POINTS, |count| count.min(CONTACT_POINTS))
}

/// Moves contacts along with their bodies: each point follows the body that it lies on, and the
/// distance is measured along the old normal.
///
/// This serves a step without the shapes' geometry, for which collisions cannot be detected again.
/// A collision of a missing body stays as it is.
#[must_use]
pub fn carry_along(collisions: &[Collision], before: &[Body], after: &[Body]) -> Vec<Collision> {
    let along = |body: u32, point: [f64; 3]| {
        let index = usize::try_from(body).ok()?;
        let (old, new) = (before.get(index)?.pose, after.get(index)?.pose);
        let arm = [0, 1, 2].map(|k| point[k] - f64::from(old.position[k]));
        let arm = to_world(&rotation(new.orientation), to_body(&rotation(old.orientation), arm));
        Some([0, 1, 2].map(|k| f64::from(new.position[k]) + arm[k]))
    };
    collisions
        .iter()
        .map(|collision| {
            let mut moved = *collision;
            let normal = collision.normal.map(f64::from);
            for contact in &mut moved.contacts[..used(collision)] {
                let on_b = contact.point.map(f64::from);
                let distance = f64::from(contact.distance);
                let on_a = [0, 1, 2].map(|k| on_b[k] + distance * normal[k]);
                let (Some(a), Some(b)) =
                    (along(collision.body_a, on_a), along(collision.body_b, on_b))
                else {
                    continue;
                };
                let distance = dot(normal, [a[0] - b[0], a[1] - b[1], a[2] - b[2]]);
                #[allow(clippy::cast_possible_truncation, reason = "rounding to f32 is meant")]
                {
                    contact.point = b.map(|value| value as f32);
                    contact.distance = distance as f32;
                }
            }
            moved
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use zynq_pgs::Contact;

    use super::*;
    use crate::fixtures::{LEVEL, body};

    fn collision(distances: [f32; 4], count: u32) -> Collision {
        let contacts = distances.map(|distance| Contact { point: [0.0, 1.0, 2.0], distance });
        Collision { body_a: 0, body_b: 1, normal: [0.0, -1.0, 0.0], count, contacts }
    }

    #[test]
    fn only_used_points_with_negative_distance_count() {
        let found = penetration(&[
            collision([-0.25, 0.5, -0.75, -9.0], 3),
            collision([0.0, -0.0, 0.125, -9.0], 3),
        ]);
        let expected = Penetration { contacts: 6, penetrating: 2, mean: 0.5, largest: 0.75 };
        assert_eq!(found, expected);
        assert_eq!(penetration(&[]), Penetration::default());
        // A count above the maximum is cut off.
        assert_eq!(penetration(&[collision([-1.0; 4], 9)]).contacts, 4);
    }

    #[test]
    fn contacts_go_along_with_their_bodies() {
        // B lies on A, half a metre deep; then it is lifted by a quarter of a metre.
        let before = [body([0.0; 3], LEVEL), body([0.0, 2.0, 0.0], LEVEL)];
        let mut after = before;
        after[1].pose.position[1] = 2.25;
        let collisions = [collision([-0.5; 4], 1)];
        let moved = carry_along(&collisions, &before, &after);
        assert!((moved[0].contacts[0].distance + 0.25).abs() < 1e-6, "{moved:?}");
        assert!((moved[0].contacts[0].point[1] - 1.25).abs() < 1e-6, "{moved:?}");
        assert!((moved[0].contacts[1].distance + 0.5).abs() < 1e-6, "an unused point stays");

        // B turns by half a turn about y: its point (0, -1, 2) goes to (0, -1, -2).
        after[1] = body([0.0, 2.0, 0.0], [0.0, 1.0, 0.0, 0.0]);
        let moved = carry_along(&collisions, &before, &after)[0].contacts[0];
        assert!((moved.point[2] + 2.0).abs() < 1e-6 && (moved.distance + 0.5).abs() < 1e-6);

        // A sinks below it.
        after = before;
        after[0].pose.position[1] = -1.0;
        let moved = carry_along(&collisions, &before, &after)[0].contacts[0];
        assert!((moved.distance - 0.5).abs() < 1e-6, "{moved:?}");

        let nobody = carry_along(&collisions, &before[..1], &after);
        assert_eq!(nobody[..], collisions[..]);
    }
}
