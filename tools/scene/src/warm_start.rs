//! Carries impulses from one step of a scene to the next.

use zynq_pgs::PlacedCollisions;
use zynq_pgs::{Collision, Impulses, InputError, LastStep, Place};

/// Largest way of a contact point in a step, m: one that has moved farther is a new one.
const REACH: f32 = 0.05;

/// The last step of a scene that succeeded, and the places that the next one's collisions had in
/// it.
///
/// The collisions of a [`Scene`](crate::Scene) are in the order of their pairs, one for each, so
/// that one pass over the collisions of both steps finds the places.
#[derive(Debug, Clone, Default)]
pub struct WarmStart {
    last: LastStep,
    /// The collisions of that step.
    collisions: Vec<Collision>,
    places: Vec<Place>,
}

impl WarmStart {
    /// The collisions of the next step with `factor` times the impulses that they had in the last.
    ///
    /// # Errors
    /// None for the collisions of a scene: each has its place.
    pub fn placed<'a>(
        &'a mut self,
        collisions: &'a [Collision],
        factor: f32,
    ) -> Result<PlacedCollisions<'a, [Collision]>, InputError> {
        let pair = |collision: &Collision| (collision.body_a, collision.body_b);
        let mut old = (0..).zip(&self.collisions).peekable();
        self.places.clear();
        self.places.extend(collisions.iter().map(|new| {
            while old.next_if(|(_, old)| pair(old) < pair(new)).is_some() {}
            let same = old.next_if(|(_, old)| pair(old) == pair(new));
            same.map_or(Place::NEW, |(at, old)| Place::nearest(at, old, new, REACH))
        }));
        self.last.placed(collisions, &self.places, factor)
    }

    /// Takes the collisions of a step that has succeeded, and the impulses that it gave out.
    ///
    /// # Errors
    /// [`InputError::OtherImpulses`]: they are not the impulses of these collisions.
    pub fn commit(
        &mut self,
        collisions: &[Collision],
        impulses: &[Impulses],
    ) -> Result<(), InputError> {
        self.last.commit(collisions, impulses)?;
        self.collisions.clear();
        self.collisions.extend_from_slice(collisions);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use zynq_pgs::{Collisions, Contact};

    fn collision([body_a, body_b]: [u32; 2]) -> Collision {
        let contacts = [0.0, 1.0, 2.0, 3.0]
            .map(|x| Contact { point: [x + body_b as f32, 0.0, 0.0], distance: 0.0 });
        Collision { body_a, body_b, normal: [0.0, 1.0, 0.0], count: 4, contacts }
    }

    #[test]
    fn every_collision_finds_its_pair_in_the_last_step_or_is_new() {
        let old = [[0, 2], [0, 3], [1, 2], [2, 7], [2, 9]].map(collision);
        let impulses: Vec<_> = (1_u8..)
            .zip(&old)
            .map(|(at, _)| Impulses { normal: [1.0, 2.0, 3.0, 4.0], friction: [at.into(), 0.0] })
            .collect();
        let mut warm = WarmStart::default();
        warm.commit(&old, &impulses).expect("one for each");
        let mut new = [[0, 1], [0, 3], [1, 3], [2, 7], [2, 9], [3, 4]].map(collision);
        // Its points are in reverse order, and the first one has moved by a little.
        new[3].contacts.reverse();
        new[3].contacts[0].point[1] = 0.04;
        // Too far away.
        new[4].contacts.iter_mut().for_each(|contact| contact.point[2] = 0.06);
        let placed = warm.placed(&new, 1.0).expect("places");
        let found: Vec<_> = new
            .iter()
            .enumerate()
            .map(|(at, of)| placed.impulses(at, of.normal, of.points()))
            .collect();
        let of = |normal, at| Impulses { normal, friction: [at, 0.0] };
        let none = Impulses::ZERO;
        let (ahead, behind) = ([1.0, 2.0, 3.0, 4.0], [4.0, 3.0, 2.0, 1.0]);
        assert_eq!(found, [none, of(ahead, 2.0), none, of(behind, 4.0), none, none]);
    }
}
