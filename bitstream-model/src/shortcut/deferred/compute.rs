//! Computes the passes of decoded collisions, and gives out the impulses after the last pass of a kind.
//!
//! A pass is computed when a host can see its results. Impulses that go out can be seen while their pass is
//! under way: then this pass is computed as if its last collision had entered. If it ends before that, the
//! passes are computed again from the loaded velocities on, which stay as they are until then.

use super::Deferred;
use super::bodies::properties;
use crate::accelerator::Accelerator;
use crate::accelerator::control::Arguments;
use crate::shortcut::batch::{Plan, Properties};
use crate::stream::Stream;
use pgs_interface::record::Beat;
use pgs_interface::stripe::IMPULSES_STREAM;

/// The passes of a step.
fn plan(arguments: &Arguments) -> Plan<'_> {
    let Arguments { warm_start: warm, solver: parameters, .. } = arguments;
    Plan { contact: arguments.contact_passes(), warm: *warm, parameters }
}

impl Deferred {
    /// Computes the passes before `pass`, and the first `collisions` of `pass`.
    pub(super) fn compute_to(
        &mut self,
        accelerator: &mut Accelerator,
        pass: u32,
        collisions: usize,
    ) {
        if !self.active {
            return;
        }
        let (batch, masses) = (&mut self.decoded.batch, &self.decoded.masses);
        if self.computed > pass {
            batch.restart();
            self.computed = 0;
        }
        let Accelerator { arguments, velocities, shape_of, inverse_masses, inertias, .. } =
            accelerator;
        let properties = Properties { shape_of, masses, inverse_masses, inertias };
        let plan = plan(arguments);
        batch.run(self.computed..pass, &plan, properties, velocities);
        batch.leave(velocities);
        if collisions > 0 {
            batch.run_part(pass, 0..collisions, &plan, properties, velocities);
        }
        self.computed = pass;
        accelerator.counters.impulse_sum = batch.impulse_sum();
    }

    /// Computes a pass under way as if it had ended, if its impulses go out. Returns whether the impulses
    /// that have to go out are there.
    pub(super) fn impulses_are_there(&mut self, accelerator: &Accelerator, pass: u32) -> bool {
        let Accelerator { arguments, velocities, .. } = accelerator;
        if !arguments.sends_impulses(pass) {
            return true;
        }
        if self.decoded.batch.len() < arguments.collisions as usize {
            return false;
        }
        let properties = properties(accelerator, &self.decoded.masses);
        let passes = self.computed..pass + 1;
        self.decoded.batch.run(passes, &plan(arguments), properties, velocities);
        self.computed = pass + 1;
        true
    }

    /// Gives out the impulses of collisions from `first` on. Returns the sum of their words.
    fn impulses_to(
        &mut self,
        accelerator: &Accelerator,
        pass: u32,
        first: usize,
        to: &mut [Beat],
    ) -> u32 {
        let contact = pass < accelerator.arguments.contact_passes();
        self.decoded.batch.outgoing(contact, first, to)
    }

    /// Puts the impulses of collisions from `first` on onto their stream, which has space for them.
    pub(super) fn send_impulses(
        &mut self,
        accelerator: &mut Accelerator,
        pass: u32,
        first: usize,
        collisions: usize,
        outputs: &mut [Stream],
    ) {
        let mut impulses = std::mem::take(&mut self.impulses);
        impulses.resize(collisions, Beat::default());
        let sum = self.impulses_to(accelerator, pass, first, &mut impulses);
        accelerator.sent(sum);
        outputs[IMPULSES_STREAM].push(&impulses);
        self.impulses = impulses;
    }

    /// The impulses of collisions from `first` on have gone out, behind the ones that wait on the stream:
    /// to `place` as far as this has room, the others onto the stream.
    pub(crate) fn pass_over_impulses(
        &mut self,
        accelerator: &mut Accelerator,
        pass: u32,
        (first, collisions): (usize, usize),
        outputs: &mut [Stream],
        place: &mut [Beat],
    ) {
        let waiting = outputs[IMPULSES_STREAM].len().min(place.len());
        let (from_stream, behind) = place.split_at_mut(waiting);
        outputs[IMPULSES_STREAM].pop_into(from_stream);
        let gone = behind.len().min(collisions);
        let sum = self.impulses_to(accelerator, pass, first, &mut behind[..gone]);
        accelerator.sent(sum);
        self.send_impulses(accelerator, pass, first + gone, collisions - gone, outputs);
    }
}
