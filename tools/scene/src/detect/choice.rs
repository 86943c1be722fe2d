//! Finds all contact points of one pair: the points among which the narrow phase chooses four.

use zynq_pgs::{Body, Contact};

use super::Geometries;
use super::ground;
use super::parry::{Parry, Place, pose};
use crate::GROUND;

/// The contact points of bodies `a` and `b` before four of them are chosen, on the surface of `b`.
/// None if a body is missing or is no obstacle; body 0 is the ground, which can only be `a`.
pub(crate) fn all_points(
    bodies: &[Body],
    geometries: Geometries<'_>,
    a: u32,
    b: u32,
) -> Option<Vec<Contact>> {
    let (body_a, body_b) = (bodies.get(a as usize)?, bodies.get(b as usize)?);
    let geometry_b = geometries.of(body_b)?;
    if a == GROUND {
        let found = ground::collide(b, body_b, geometry_b);
        let used = |found: zynq_pgs::Collision| found.contacts[..found.count as usize].to_vec();
        return Some(found.map(used).unwrap_or_default());
    }
    let b_in_a = pose(body_a).inv_mul(&pose(body_b));
    let mut parry = Parry::default();
    let (_, places) = parry.ask(&b_in_a, [geometries.of(body_a)?, geometry_b])?;
    let in_world = |place: &Place| Contact {
        point: (pose(body_b) * place.on_b).to_array(),
        distance: place.distance,
    };
    Some(places.iter().map(in_world).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Scene, SceneOptions};

    #[test]
    fn the_chosen_points_are_among_all_of_them() {
        let grid = "3x3x3".parse().expect("a grid");
        let options = SceneOptions { grid, drop: 0.0 };
        let mut scene = Scene::new(&options).expect("a scene");
        // A cube right above another and turned by 45 degrees: the faces overlap in an octagon.
        let [x, y, z] = scene.bodies()[1].pose.position;
        let turned = &mut scene.bodies_mut()[4].pose;
        turned.position = [x, y + 2.0, z];
        turned.orientation = [0.0, 0.382_683_43, 0.0, 0.923_879_5];
        let mut most = 0;
        for collision in scene.detect().to_vec() {
            let all = scene.all_points(collision.body_a, collision.body_b).expect("a pair");
            most = most.max(all.len());
            for chosen in &collision.contacts[..collision.count as usize] {
                let same = |other: &Contact| {
                    (0..3).all(|k| (other.point[k] - chosen.point[k]).abs() < 1e-5)
                        && (other.distance - chosen.distance).abs() < 1e-5
                };
                assert!(all.iter().any(same), "{chosen:?} is none of {all:?}");
            }
        }
        assert!(most >= 8, "{most} points at most");
        assert!(scene.all_points(1, 1000).is_none() && scene.all_points(1, 0).is_none());
    }
}
