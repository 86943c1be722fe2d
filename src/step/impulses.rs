//! Reads the impulses that a step gives out, in the order of the caller's collisions.

use pgs_interface::record::Beat;

use crate::board::plan::Plan;
use crate::scene::Impulses;

/// The impulses of the collisions of one step.
#[derive(Debug, Default)]
pub(super) struct ImpulsesOut {
    /// Of the last step that has ended without an error and gave them out.
    pub(super) committed: Vec<Impulses>,
    /// Of the step that is being read.
    staged: Vec<Impulses>,
}

impl ImpulsesOut {
    /// Reads the impulses from the beats in front of the results. `collision_of` tells the caller's
    /// collision of an entry, of `given` ones. Returns the sum of the words, and the first collision
    /// whose impulses are not finite.
    pub(super) fn read(
        &mut self,
        plan: &Plan,
        beats: &[Beat],
        given: usize,
        collision_of: impl Fn(usize) -> Option<usize>,
    ) -> (u32, Option<usize>) {
        if !plan.passes.impulses_out {
            return (0, None);
        }
        self.staged.clear();
        self.staged.resize(given, Impulses::ZERO);
        // The two change places when the step is committed: the next one then allocates nothing.
        self.committed.reserve(given.saturating_sub(self.committed.len()));
        let (mut sum, mut broken) = (0_u32, None::<usize>);
        let contact = if plan.passes.contact > 0 { plan.collisions } else { 0 };
        for (place, beat) in beats.iter().enumerate() {
            sum = beat.0.into_iter().fold(sum, u32::wrapping_add);
            let (entry, of_contact) = match place.checked_sub(contact) {
                None => (place, true),
                Some(entry) => (entry, false),
            };
            let Some(collision) = collision_of(entry) else { continue };
            let Some(impulses) = self.staged.get_mut(collision) else { continue };
            let words @ [first, second, ..] = beat.0.map(f32::from_bits);
            match of_contact {
                true => impulses.normal = words,
                false => impulses.friction = [first, second],
            }
            if !impulses.are_finite() {
                broken = Some(broken.map_or(collision, |first| first.min(collision)));
            }
        }
        (sum, broken)
    }

    /// Publishes the impulses that were read.
    pub(super) fn commit(&mut self) {
        std::mem::swap(&mut self.committed, &mut self.staged);
    }
}
