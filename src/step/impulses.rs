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
    /// collision of an entry, of `given` ones. Returns the sum of the words, and the first
    /// collision whose impulses are not finite.
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
        let mut sums = [0_u32; 4];
        let mut broken = None::<usize>;
        let contact = if plan.passes.contact > 0 { plan.collisions } else { 0 };
        let (contact, friction) = beats.split_at(contact.min(beats.len()));
        for entry in 0..contact.len().max(friction.len()) {
            let [normal, tangential] = [contact, friction].map(|of| {
                let words = of.get(entry).copied().unwrap_or_default().0;
                for (sum, word) in sums.iter_mut().zip(words) {
                    *sum = sum.wrapping_add(word);
                }
                words.map(f32::from_bits)
            });
            let Some(collision) = collision_of(entry) else { continue };
            let Some(impulses) = self.staged.get_mut(collision) else { continue };
            let [first, second, ..] = tangential;
            *impulses = Impulses { normal, friction: [first, second] };
            if !impulses.are_finite() {
                broken = Some(broken.map_or(collision, |first| first.min(collision)));
            }
        }
        let sum = sums.into_iter().fold(0, u32::wrapping_add);
        (sum, broken)
    }

    /// Publishes the impulses that were read.
    pub(super) fn commit(&mut self) {
        std::mem::swap(&mut self.committed, &mut self.staged);
    }
}
