//! The collisions of a step that a narrow phase hands over one after the other.
//!
//! They stay in memory of the library until the step is submitted, in place of records on the way
//! to the board: the cheapest order needs all collisions, and a step can be submitted once more
//! after a fault.

use zynq_pgs::{Collision, Impulses, WarmCollisions};

use crate::failure::Failure;

/// A list of collisions. Its memory serves every later list.
#[derive(Debug, Default)]
pub(crate) struct Pushed {
    collisions: Vec<Collision>,
    /// One for each collision, up to the first that came without impulses.
    impulses: Vec<Impulses>,
    stage: Stage,
}

/// How far a list has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Stage {
    /// None was begun.
    #[default]
    None,
    /// It takes collisions.
    Open,
    /// Its step was submitted, and may be submitted again.
    Ended,
}

impl Pushed {
    /// Begins a list, in place of an earlier one.
    pub(crate) fn begin(&mut self) {
        self.collisions.clear();
        self.impulses.clear();
        self.stage = Stage::Open;
    }

    /// Appends collisions, all or none. `impulses` has one entry for each of them, if given.
    pub(crate) fn push(
        &mut self,
        collisions: &[Collision],
        impulses: Option<&[Impulses]>,
    ) -> Result<(), Failure> {
        match self.stage {
            Stage::Open => {}
            Stage::None => return Err(Failure::sequence("no list is open: call zpgs_begin first")),
            Stage::Ended => {
                return Err(Failure::sequence("the list has ended: call zpgs_begin for another"));
            }
        }
        let warm = impulses.filter(|_| self.has_impulses()).unwrap_or_default();
        let room = self.collisions.try_reserve(collisions.len());
        room.and_then(|()| self.impulses.try_reserve(warm.len())).map_err(|error| {
            Failure::argument(format!(
                "no memory for {} more collisions ({error}): push fewer",
                collisions.len()
            ))
        })?;
        self.collisions.extend_from_slice(collisions);
        self.impulses.extend_from_slice(warm);
        Ok(())
    }

    /// Whether each collision came with its impulses.
    fn has_impulses(&self) -> bool {
        self.impulses.len() == self.collisions.len()
    }

    /// The list, for a step that begins with its impulses or from zero.
    pub(crate) fn all(&self, warm_start: bool) -> Result<List<'_>, Failure> {
        let Self { collisions, impulses, stage } = self;
        if *stage == Stage::None {
            return Err(Failure::sequence("no list is open: call zpgs_begin first"));
        }
        match (warm_start, self.has_impulses()) {
            (false, _) => Ok(List::Cold(collisions)),
            (true, true) => Ok(List::Warm(WarmCollisions { collisions, impulses })),
            (true, false) => Err(Failure::argument(format!(
                "a warm start, but collision {} was pushed without impulses: push the impulses of \
                 every collision, or leave warm_start 0",
                impulses.len()
            ))),
        }
    }

    /// Takes no more collisions.
    pub(crate) fn end(&mut self) {
        self.stage = Stage::Ended;
    }
}

/// All collisions of a list.
#[derive(Debug)]
pub(crate) enum List<'a> {
    Cold(&'a [Collision]),
    Warm(WarmCollisions<'a, [Collision]>),
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbered(body_a: u32) -> Collision {
        let contacts = [zynq_pgs::Contact::default(); 4];
        Collision { body_a, body_b: 0, normal: [0.0; 3], count: 1, contacts }
    }

    fn bodies(list: &List<'_>) -> Vec<u32> {
        let (List::Cold(all) | List::Warm(WarmCollisions { collisions: all, .. })) = list;
        all.iter().map(|collision| collision.body_a).collect()
    }

    #[test]
    fn a_list_has_the_collisions_since_its_begin_in_the_order_of_the_calls() {
        let mut pushed = Pushed::default();
        pushed.begin();
        pushed.push(&[numbered(9)], None).expect("pushed");
        pushed.begin();
        pushed.push(&[numbered(1), numbered(2)], None).expect("pushed");
        pushed.push(&[], None).expect("pushed");
        pushed.push(&[numbered(3)], None).expect("pushed");
        assert_eq!(bodies(&pushed.all(false).expect("a list")), [1, 2, 3]);
    }

    #[test]
    fn a_warm_list_names_the_first_collision_without_impulses() {
        let mut pushed = Pushed::default();
        pushed.begin();
        assert!(matches!(pushed.all(true), Ok(List::Warm(_))), "no collision lacks any");
        let impulses = [Impulses { normal: [5.0; 4], ..Impulses::ZERO }];
        pushed.push(&[numbered(1)], Some(&impulses)).expect("pushed");
        let Ok(List::Warm(warm)) = pushed.all(true) else { panic!("a warm list") };
        assert_eq!(warm.impulses, impulses);
        pushed.push(&[numbered(2)], None).expect("pushed");
        pushed.push(&[numbered(3)], Some(&impulses)).expect("pushed");
        let refused = pushed.all(true).expect_err("refused");
        assert!(refused.text.contains("collision 1 was pushed without"), "{}", refused.text);
        assert_eq!(bodies(&pushed.all(false).expect("a cold list")), [1, 2, 3]);
    }
}
