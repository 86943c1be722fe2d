//! Checks and reads all results of a step before any of them is committed.
//!
//! Each beat is read once, and checked while it is read.

use pgs_interface::address_map::DMA_COUNT_MAX;
use pgs_interface::record::Beat;
use pgs_interface::stripe::IMPULSES_STREAM;

use super::packing::SentSums;
use crate::axi_dma::Direction;
use crate::beat::pool::PackPool;
use crate::beat::results::read_all;
use crate::beat::stripe::Layout;
use crate::board::bank::Bank;
use crate::board::device::Device;
use crate::board::plan::Plan;
use crate::board::port::Port;
use crate::control_block::Counters;
use crate::fault::Fault;
use crate::record::result::{self, Record, finite};
use crate::scene::Bodies;

/// Compares the accelerator's sum of the words that it received with the driver's.
pub(super) fn check_received(
    plan: &Plan,
    sent: SentSums,
    counters: &Counters,
) -> Result<(), Fault> {
    let (received, _) = counters.sums;
    #[allow(clippy::cast_possible_truncation, reason = "the sum is one modulo 2^32")]
    let rounds = plan.passes.total() as u32;
    let SentSums { velocities, collisions, warm, poses } = sent;
    let parts = [velocities, collisions.wrapping_mul(rounds), warm.contact, warm.friction, poses];
    let expected = parts.into_iter().fold(0, u32::wrapping_add);
    if received != expected {
        let direction = Direction::Mm2s;
        return Err(Fault::Checksum { direction, expected, found: received });
    }
    Ok(())
}

/// Reads the results of a bank into `staged`. Compares the driver's sum of the words, with `before`
/// for the impulses, with `expected`, the accelerator's sum of the words that it sent.
pub(super) fn read<B: Bodies + ?Sized>(
    device: &mut Device,
    staged: &mut Vec<Record>,
    (plan, bank): (&Plan, Bank),
    bodies: &B,
    (expected, before): (u32, u32),
) -> Result<(), Fault> {
    // A panic in the caller's code loses the memory: the next step allocates it anew.
    let mut records = std::mem::take(staged);
    let Device { s2mm, statics, packers, .. } = device;
    let channels = received(s2mm, plan, bank);
    let layout = plan.result_layout();
    let results = Results { layout: &layout, channels: &channels[..plan.channels()] };
    let (found, broken) =
        results.read_in_order(plan.bodies, bodies, &statics[bank], &mut records, packers);
    *staged = records;
    let found = found.wrapping_add(before);
    if expected != found {
        return Err(Fault::Checksum { direction: Direction::S2mm, expected, found });
    }
    broken.map_or(Ok(()), |body| Err(Fault::NotFinite { body }))
}

/// The result beats of each channel in a bank.
pub(super) fn received<'a>(
    ports: &'a [Port],
    plan: &Plan,
    bank: Bank,
) -> [&'a [Beat]; DMA_COUNT_MAX] {
    let mut channels = <[&[Beat]; DMA_COUNT_MAX]>::default();
    for (place, port) in ports.iter().enumerate() {
        channels[place] = &port.beats(bank)[plan.impulses(place)..plan.results(place)];
    }
    channels
}

/// The beats of impulses in a bank.
pub(super) fn impulses_of<'a>(ports: &'a [Port], plan: &Plan, bank: Bank) -> &'a [Beat] {
    let port = ports.get(IMPULSES_STREAM);
    port.map_or(&[], |port| &port.beats(bank)[..plan.impulses(IMPULSES_STREAM)])
}

/// The result segments of a step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Results<'a> {
    pub(crate) layout: &'a Layout,
    /// One slice of beats per channel.
    pub(crate) channels: &'a [&'a [Beat]],
}

impl Results<'_> {
    /// Reads the results of `count` bodies in their order. Returns the sum of the words, and the
    /// first body that is not finite.
    ///
    /// A static body at rest does not move, whatever comes back for it: `statics` are the indices
    /// of these bodies, ascending.
    pub(crate) fn read_in_order<B: Bodies + ?Sized>(
        self,
        count: usize,
        bodies: &B,
        statics: &[u32],
        staged: &mut Vec<Record>,
        packers: &mut PackPool,
    ) -> (u32, Option<usize>) {
        // All records of the last step are overwritten.
        staged.resize(count, Record::default());
        let (sum, broken) = self.read_contiguous(statics, staged, packers);
        for index in statics.iter().map(|index| *index as usize) {
            if let Some(to) = staged.get_mut(index) {
                *to = unchanged(bodies, index);
            }
        }
        (sum, broken)
    }

    /// The part that does not depend on the caller's container: it is compiled once, with the
    /// driver.
    fn read_contiguous(
        self,
        statics: &[u32],
        into: &mut [Record],
        packers: &mut PackPool,
    ) -> (u32, Option<usize>) {
        let (sum, all_finite) = read_all(self.layout, self.channels, into, packers);
        if all_finite {
            return (sum, None);
        }
        let moves = |at: &usize| statics.binary_search_by_key(at, |at| *at as usize).is_err();
        let wrong = (0..).zip(&*into).filter(|(_, record)| !finite(record));
        (sum, wrong.map(|(index, _)| index).find(moves))
    }
}

/// The record of a body's present state.
fn unchanged<B: Bodies + ?Sized>(bodies: &B, index: usize) -> Record {
    let body = bodies.body(index);
    result::of(body.pose, body.velocity)
}

/// Stores the results in the bodies.
pub(crate) fn commit<B: Bodies + ?Sized>(results: &[Record], bodies: &mut B) {
    for (index, record) in results.iter().enumerate() {
        let (pose, velocity) = result::decode(record);
        bodies.commit(index, pose, velocity);
    }
}

/// Stores the velocities alone. A body that was not integrated keeps the caller's own pose, which a
/// stream of sixteen bits would round.
pub(super) fn commit_velocities<B: Bodies + ?Sized>(results: &[Record], bodies: &mut B) {
    for (index, record) in results.iter().enumerate() {
        let (_, velocity) = result::decode(record);
        let pose = bodies.body(index).pose;
        bodies.commit(index, pose, velocity);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::beat::stripe::Segment;
    use crate::scene::{Body, Pose, Velocity};
    use pgs_interface::profile::FLOAT;
    use pgs_interface::record::result::{ORIENTATION, POSITION};

    const COUNT: usize = 40;

    /// Calls `read` with the results of `COUNT` bodies, one row a channel. The bodies in `broken`
    /// are not finite.
    fn with_broken<T>(broken: &[usize], read: impl FnOnce(Results<'_>, &Vec<Body>) -> T) -> T {
        let layout = &Segment::Results.layout(&FLOAT.default_variant());
        let mut channels = vec![vec![Beat::default(); COUNT]; FLOAT.s2mm_widths.len()];
        for record in broken {
            channels[ORIENTATION][*record] = Beat([f32::NAN.to_bits(), 0, 0, 0]);
        }
        let channels: Vec<&[Beat]> = channels.iter().map(Vec::as_slice).collect();
        let pose = Pose { position: [5.0; 3], orientation: [0.0, 0.0, 0.0, 1.0] };
        let bodies = vec![Body { pose, velocity: Velocity::default(), shape: 0 }; COUNT];
        read(Results { layout, channels: &channels }, &bodies)
    }

    #[test]
    fn the_first_body_that_moves_and_is_not_finite_is_reported() {
        let statics = [3, 7];
        for (broken, expected) in
            [(&[][..], None), (&[7, 3], None), (&[39, 7, 31], Some(31)), (&[4, 3, 38], Some(4))]
        {
            let mut staged = Vec::new();
            let (_, found) = with_broken(broken, |results, bodies| {
                results.read_in_order(COUNT, bodies, &statics, &mut staged, &mut PackPool::alone())
            });
            assert_eq!(found, expected, "{broken:?}");
            for (index, record) in staged.iter().enumerate() {
                let stays = record[POSITION].0[0] == 5.0_f32.to_bits();
                assert_eq!(stays, statics.contains(&u32::try_from(index).expect("few")), "{index}");
            }
        }
    }
}
