//! This file checks the results of a step and reads them, all before any of them is committed.

use bitstream_model::interface::address_map::DMA_COUNT_MAX;
use bitstream_model::interface::record::Beat;

use super::bank::Bank;
use super::fault::Fault;
use super::packing::Sent;
use super::plan::Plan;
use super::solver::Accelerator;
use crate::accelerator::Counters;
use crate::axi_dma::Direction;
use crate::beat::stripe::Segment;
use crate::beat::unpack::{Results, sum_of_words};
use crate::order::LiveReport;
use crate::scene::{Bodies, Pose, Velocity};

impl Accelerator {
    /// The result beats of each channel, in a bank.
    pub(super) fn results<'a>(
        &'a self,
        plan: &Plan,
        bank: Bank,
        channels: &mut [&'a [Beat]; DMA_COUNT_MAX],
    ) {
        for (place, lane) in self.device.s2mm.iter().enumerate() {
            channels[place] = &lane.beats(bank)[..plan.results(place)];
        }
    }

    /// Compares the accelerator's sum of the words that it received with ours, if it has one.
    pub(super) fn check_received(
        plan: &Plan,
        sent: Sent,
        counters: &Counters,
    ) -> Result<(), Fault> {
        let Some((received, _)) = counters.sums else { return Ok(()) };
        #[allow(clippy::cast_possible_truncation, reason = "the sum is one modulo 2^32")]
        let rounds = plan.rounds() as u32;
        let expected = sent
            .velocities
            .wrapping_add(sent.collisions.wrapping_mul(rounds))
            .wrapping_add(sent.poses);
        if received != expected {
            let direction = Direction::Mm2s;
            return Err(Fault::Checksum { direction, expected, found: received });
        }
        Ok(())
    }

    /// Compares the accelerator's sum of the words that it sent with ours, if it has one.
    pub(super) fn check_answered(
        &self,
        plan: &Plan,
        bank: Bank,
        counters: &Counters,
    ) -> Result<(), Fault> {
        let Some((_, answered)) = counters.sums else { return Ok(()) };
        let mut channels = Default::default();
        self.results(plan, bank, &mut channels);
        let found = channels.iter().fold(0u32, |sum, beats| sum.wrapping_add(sum_of_words(beats)));
        if found != answered {
            let direction = Direction::S2mm;
            return Err(Fault::Checksum { direction, expected: answered, found });
        }
        Ok(())
    }

    /// Reads the results into the spare.
    ///
    /// Where only live bodies are kept, `live` says so: results come in an order of their own then.
    pub(super) fn unpack<B: Bodies + ?Sized>(
        &mut self,
        plan: &Plan,
        bank: Bank,
        bodies: &B,
        live: Option<LiveReport>,
    ) -> Result<(), Fault> {
        // A panic of the caller's loses it: the next step makes it anew.
        let mut spare = std::mem::take(&mut self.spare);
        spare.clear();
        let mut channels = Default::default();
        self.results(plan, bank, &mut channels);
        let layout = Segment::Results.layout(&plan.variant);
        let mut results = Results::new(&layout, &channels[..plan.channels()]);
        let broken = match live.map(|_| self.orderings[bank].lives()) {
            Some(lives) => scatter(&mut results, lives.results(), bodies, &mut spare),
            None => self.in_turn(&mut results, plan.bodies, bodies, &mut spare),
        };
        self.spare = spare;
        match broken {
            Some(body) => Err(Fault::NotFinite { body }),
            None => Ok(()),
        }
    }

    /// Reads the results of all bodies in their order; the first that is not finite.
    fn in_turn<B: Bodies + ?Sized>(
        &self,
        results: &mut Results<'_>,
        count: usize,
        bodies: &B,
        spare: &mut Vec<(Pose, Velocity)>,
    ) -> Option<usize> {
        spare.reserve(count);
        for index in 0..count {
            let (pose, velocity) = results.next();
            let own = bodies.body(index);
            let shape = usize::try_from(own.shape).ok().and_then(|shape| self.shapes.get(shape));
            if shape.is_none_or(|shape| shape.inverse_mass == 0.0) {
                // A static body does not move, whatever comes back for it.
                spare.push((own.pose, own.velocity));
                continue;
            }
            if !finite(&pose, &velocity) {
                return Some(index);
            }
            spare.push((pose, velocity));
        }
        None
    }
}

/// Reads results in the order of these bodies, and leaves all others as they are; the first body
/// that is not finite.
fn scatter<B: Bodies + ?Sized>(
    results: &mut Results<'_>,
    order: &[u32],
    bodies: &B,
    spare: &mut Vec<(Pose, Velocity)>,
) -> Option<usize> {
    spare.extend((0..bodies.len()).map(|index| {
        let own = bodies.body(index);
        (own.pose, own.velocity)
    }));
    let mut broken = None;
    for body in order {
        let (pose, velocity) = results.next();
        let index = *body as usize;
        if !finite(&pose, &velocity) {
            broken = Some(broken.map_or(index, |lowest: usize| lowest.min(index)));
        }
        // Should a caller's bodies have become fewer, there is nothing to be told of the others.
        if let Some(state) = spare.get_mut(index) {
            *state = (pose, velocity);
        }
    }
    broken
}

fn finite(pose: &Pose, velocity: &Velocity) -> bool {
    let all = |numbers: &[f32]| numbers.iter().all(|number| number.is_finite());
    all(&pose.position) && all(&pose.orientation) && all(&velocity.linear) && all(&velocity.angular)
}
