//! Reads the impulses that a step gives out, in the order of the caller's collisions.
//!
//! A step through the issue queue gives them in the order of issue. Behind each four of them, and
//! behind the last, stands a beat with their numbers in the stream (interface specification,
//! packets).

use pgs_interface::record::Beat;

use crate::beat::deal::sum_of_words;
use crate::board::plan::{NUMBERS_PER_BEAT, Plan};
use crate::fault::Fault;
use crate::record::MAGNITUDE;
use crate::scene::Impulses;

/// The impulses of the collisions of one step.
#[derive(Debug, Default)]
pub(super) struct ImpulsesOut {
    /// Of the last step that has ended without an error and gave them out.
    pub(super) committed: Vec<Impulses>,
    /// Of the step that is being read.
    staged: Vec<Impulses>,
    /// The collisions whose impulses of one kind have come, a bit each.
    seen: Vec<u64>,
}

impl ImpulsesOut {
    /// Reads the impulses from the beats in front of the results. `collision_of` tells the caller's
    /// collision of an entry, of `given` ones. Returns the sum of the words.
    ///
    /// # Errors
    /// Beside the sum [`Fault::ImpulseNumber`] where the numbers of the queue are no permutation,
    /// or [`Fault::ImpulseNotFinite`] of the first collision.
    pub(super) fn read(
        &mut self,
        plan: &Plan,
        beats: &[Beat],
        given: usize,
        collision_of: impl Fn(usize) -> Option<usize>,
    ) -> (u32, Result<(), Fault>) {
        if !plan.passes.impulses_out {
            return (0, Ok(()));
        }
        self.staged.clear();
        self.staged.resize(given, Impulses::ZERO);
        // The two change places when the step is committed: the next one then allocates nothing.
        self.committed.reserve(given.saturating_sub(self.committed.len()));
        let sum = sum_of_words(beats);
        let kinds = plan.passes.kinds_out().max(1);
        let mut parts = beats.chunks(beats.len().div_ceil(kinds).max(1));
        let mut read = || {
            let of_contact = |impulses: &mut Impulses, words| impulses.normal = words;
            let of_friction = |impulses: &mut Impulses, [first, second, ..]: [f32; 4]| {
                impulses.friction = [first, second];
            };
            if plan.passes.contact > 0 {
                let part = parts.next().unwrap_or_default();
                self.kind(plan, ("contact", part), &collision_of, of_contact)?;
            }
            if plan.passes.friction > 0 {
                let part = parts.next().unwrap_or_default();
                self.kind(plan, ("friction", part), &collision_of, of_friction)?;
            }
            // Without a branch for each, as all are finite.
            let words: &[u32] = bytemuck::cast_slice(&self.staged);
            let largest = words.iter().fold(0, |largest, word| largest.max(word & MAGNITUDE));
            if largest <= f32::MAX.to_bits() {
                return Ok(());
            }
            let broken = self.staged.iter().position(|impulses| !impulses.are_finite());
            broken.map_or(Ok(()), |collision| Err(Fault::ImpulseNotFinite { collision }))
        };
        (sum, read())
    }

    /// Reads the impulses of one kind.
    fn kind(
        &mut self,
        plan: &Plan,
        (kind, beats): (&'static str, &[Beat]),
        collision_of: impl Fn(usize) -> Option<usize>,
        store: impl Fn(&mut Impulses, [f32; 4]),
    ) -> Result<(), Fault> {
        let staged = &mut self.staged;
        let mut put = |entry: usize, beat: &Beat| {
            if let Some(impulses) = collision_of(entry).and_then(|place| staged.get_mut(place)) {
                store(impulses, beat.0.map(f32::from_bits));
            }
        };
        if !plan.queued {
            beats.iter().enumerate().for_each(|(entry, beat)| put(entry, beat));
            return Ok(());
        }
        let collisions = plan.collisions;
        self.seen.clear();
        self.seen.resize(collisions.div_ceil(64), 0);
        for (group, beats) in beats.chunks(NUMBERS_PER_BEAT + 1).enumerate() {
            let Some((numbers, impulses)) = beats.split_last() else { continue };
            for (place, (number, beat)) in numbers.0.iter().zip(impulses).enumerate() {
                let number = *number as usize;
                let bit = 1 << (number % 64);
                match self.seen.get_mut(number / 64) {
                    Some(seen) if number < collisions && *seen & bit == 0 => *seen |= bit,
                    _ => {
                        let at = group * NUMBERS_PER_BEAT + place;
                        return Err(Fault::ImpulseNumber { kind, at, number, collisions });
                    }
                }
                put(number, beat);
            }
        }
        Ok(())
    }

    /// Publishes the impulses that were read.
    pub(super) fn commit(&mut self) {
        std::mem::swap(&mut self.committed, &mut self.staged);
    }
}

#[cfg(test)]
mod tests {
    use pgs_interface::profile::FLOAT;

    use super::*;
    use crate::scene::Passes;

    const PASSES: Passes = Passes { contact: 1, friction: 1, warm: false, impulses_out: true };

    /// The plan of seven collisions that go through the queue.
    fn plan(passes: Passes) -> Plan {
        let variant = FLOAT.default_variant();
        let (bodies, collisions, streamed_masses, queued) = (3, 7, false, true);
        Plan { bodies, collisions, passes, variant, streamed_masses, queued }
    }

    /// The beats of a kind as a board sends them that issues in this order: the first word of an
    /// impulse is `base` and ten times the number of its collision.
    fn sent(order: &[u32], base: f32) -> Vec<Beat> {
        let impulse = |number: &u32| Beat([(base + 10.0 * *number as f32).to_bits(), 0, 0, 0]);
        let group = |numbers: &[u32]| {
            let mut last = [0; 4];
            last[..numbers.len()].copy_from_slice(numbers);
            let beats: Vec<Beat> = numbers.iter().map(impulse).chain([Beat(last)]).collect();
            beats
        };
        order.chunks(4).flat_map(group).collect()
    }

    const ISSUED: [u32; 7] = [2, 0, 1, 6, 3, 5, 4];
    /// The caller's collision of each entry; entry 5 is empty.
    const ENTRIES: [Option<usize>; 7] =
        [Some(3), Some(0), Some(5), Some(1), Some(2), None, Some(4)];

    fn read(passes: Passes, beats: &[Beat]) -> (u32, Result<(), Fault>, ImpulsesOut) {
        let mut out = ImpulsesOut::default();
        let (sum, read) = out.read(&plan(passes), beats, 6, |entry| ENTRIES[entry]);
        (sum, read, out)
    }

    #[test]
    fn impulses_in_the_order_of_issue_come_back_in_the_callers_order() {
        let beats = [sent(&ISSUED, 1.0), sent(&ISSUED, 2.0)].concat();
        assert_eq!(beats.len(), plan(PASSES).impulses(0));
        let (sum, read, mut out) = read(PASSES, &beats);
        read.expect("a permutation");
        let words = beats.iter().flat_map(|beat| beat.0);
        assert_eq!(sum, words.fold(0, u32::wrapping_add));
        assert!(out.committed.is_empty(), "not before the step is committed");
        out.commit();
        let found: Vec<[f32; 2]> =
            out.committed.iter().map(|of| [of.normal[0], of.friction[0]]).collect();
        // Entries 1, 3, 4, 0, 6, 2 have the collisions 0 to 5.
        let expected = [1, 3, 4, 0, 6, 2].map(|entry: u8| 10.0 * f32::from(entry));
        assert_eq!(found, expected.map(|of| [1.0 + of, 2.0 + of]));
    }

    #[test]
    fn a_kind_without_passes_has_no_beats() {
        let alone = |contact, friction| Passes { contact, friction, ..PASSES };
        for passes in [alone(0, 3), alone(3, 0)] {
            let (_, read, mut out) = read(passes, &sent(&ISSUED, 1.0));
            read.expect("a permutation");
            out.commit();
            let found = [out.committed[0].normal[0], out.committed[0].friction[0]];
            let expected = if passes.contact > 0 { [11.0_f32, 0.0] } else { [0.0, 11.0] };
            assert_eq!(found.map(f32::to_bits), expected.map(f32::to_bits));
        }
    }

    #[test]
    fn numbers_that_are_no_permutation_are_a_fault_that_says_where() {
        let mut twice = ISSUED;
        twice[5] = 6;
        let mut beyond = ISSUED;
        beyond[6] = 7;
        for (kind, wrong, says) in [
            ("contact", twice, "found number 6 at place 5, for the second time"),
            ("contact", beyond, "found number 7 at place 6, which no collision has"),
            ("friction", twice, "among the impulses of the friction passes, found number 6"),
            ("friction", [u32::MAX; 7], "found number 4294967295 at place 0"),
        ] {
            let orders = if kind == "contact" { [wrong, ISSUED] } else { [ISSUED, wrong] };
            let beats = [sent(&orders[0], 1.0), sent(&orders[1], 2.0)].concat();
            let fault = read(PASSES, &beats).1.expect_err("no permutation");
            assert_eq!(fault.name(), "impulse-number");
            let text = fault.to_string();
            assert!(text.contains(says) && text.contains("each of 7 collisions once"), "{text}");
        }
    }

    #[test]
    fn an_impulse_that_is_not_finite_is_named_as_the_caller_knows_it() {
        let mut beats = [sent(&ISSUED, 1.0), sent(&ISSUED, 2.0)].concat();
        // The last impulse of friction is entry 4.
        beats[16].0[1] = f32::NAN.to_bits();
        let fault = read(PASSES, &beats).1.expect_err("not finite");
        assert!(matches!(fault, Fault::ImpulseNotFinite { collision: 2 }), "{fault}");
    }
}
