//! Packs and unpacks without a board, for benchmarks: feature `bench`.

use pgs_interface::address_map::DMA_COUNT_MAX;
use pgs_interface::profile::Variant;
use pgs_interface::record::{BEAT_BYTES, Beat};

use crate::beat::pack::bodies::{pack_bodies, survey};
use crate::beat::pack::collisions::{Entries, pack_collisions};
use crate::beat::pack::pool::PackPool;
use crate::beat::pack::target::Target;
use crate::beat::stripe::Segment;
use crate::record::body_table::{Survey, Table};
use crate::record::result::Record;
use crate::scene::{Bodies, Collisions, Shape, StepParameters};
use crate::step::{Results, commit};
use crate::validate::InputError;
use crate::validate::{Limits, Quick, preflight};

/// Packs collisions as a step does, into memory of its own instead of a board's.
#[derive(Debug)]
pub struct CollisionPacker {
    variant: Variant,
    channels: [Vec<Beat>; DMA_COUNT_MAX],
    ends: Table,
    statics: Vec<u32>,
}

impl CollisionPacker {
    /// For one bitstream; without memory of its own yet.
    #[must_use]
    pub fn new(variant: Variant) -> Self {
        Self { variant, channels: Default::default(), ends: Table::default(), statics: Vec::new() }
    }

    /// Packs the records of all collisions over the bitstream's channels; returns the sum of their
    /// words, modulo 2^32, or `None` if there are more bodies than a stream of sixteen bits has
    /// indices for.
    pub fn pack<B: Bodies + ?Sized, C: Collisions + ?Sized>(
        &mut self,
        bodies: &B,
        collisions: &C,
        shapes: &[Shape],
    ) -> Option<u32> {
        let count = collisions.len();
        let layout = Segment::Collisions.layout(&self.variant);
        let streams = self.variant.profile.mm2s_widths.len();
        let used = &mut self.channels[..streams];
        for (place, channel) in used.iter_mut().enumerate() {
            channel.resize(layout.beats_on_channel(count, place), Beat::default());
        }
        let mut channels = self.channels.each_mut().map(Vec::as_mut_slice);
        let channels = &mut channels[..streams];
        let target = Target { variant: &self.variant, shapes, streamed_masses: false, quick: None };
        let into = Survey { ends: &mut self.ends, statics: &mut self.statics };
        survey(target, bodies, bodies.len(), into, &mut PackPool::alone());
        let entries = Entries { collisions, count, added: None };
        let packers = &mut PackPool::alone();
        let (sum, seen) = pack_collisions(target, self.ends.ends(), &entries, channels, packers);
        seen.good.then_some(sum)
    }
}

/// Packs all segments of steps, as a step does, into memory of its own.
#[derive(Debug)]
pub struct StepPacker {
    limits: Limits,
    velocities: [Vec<Beat>; DMA_COUNT_MAX],
    collisions: [Vec<Beat>; DMA_COUNT_MAX],
    poses: [Vec<Beat>; DMA_COUNT_MAX],
    ends: Table,
    statics: Vec<u32>,
    packers: PackPool,
}

impl StepPacker {
    /// A packer for one bitstream with the capacities of its profile; it has no memory yet.
    /// `threads` is the same as in [`OpenOptions::pack_threads`](crate::OpenOptions::pack_threads).
    #[must_use]
    pub fn new(variant: Variant, threads: Option<usize>) -> Self {
        Self {
            limits: Limits::roomy(variant),
            velocities: Default::default(),
            collisions: Default::default(),
            poses: Default::default(),
            ends: Table::default(),
            statics: Vec::new(),
            packers: PackPool::new(threads),
        }
    }

    /// Writes the records of all bodies, unchecked; returns the sum of their words, modulo 2^32.
    pub fn pack_bodies<B: Bodies + ?Sized>(&mut self, bodies: &B, shapes: &[Shape]) -> u32 {
        let variant = self.limits.variant;
        self.bodies(
            bodies,
            Target { variant: &variant, shapes, streamed_masses: false, quick: None },
        )
        .0
    }

    /// Writes the records of all collisions of the bodies that were packed last, unchecked; returns
    /// the sum of their words, modulo 2^32, or `None` as [`CollisionPacker::pack`] does, or if no
    /// bodies were packed. `added` is how many the order added that was made for them, `None` if
    /// there is none.
    pub fn pack_collisions<C: Collisions + ?Sized>(
        &mut self,
        collisions: &C,
        shapes: &[Shape],
        added: Option<usize>,
    ) -> Option<u32> {
        let variant = self.limits.variant;
        let target = Target { variant: &variant, shapes, streamed_masses: false, quick: None };
        let (sum, good) = self.entries(collisions, added, target);
        good.then_some(sum)
    }

    /// Writes and checks everything; returns the sum of all words, modulo 2^32, or `None` if
    /// validation refuses something.
    ///
    /// # Errors
    /// What a step refuses whatever its bodies and collisions hold.
    pub fn pack<B: Bodies + ?Sized, C: Collisions + ?Sized>(
        &mut self,
        bodies: &B,
        collisions: &C,
        shapes: &[Shape],
        added: Option<usize>,
    ) -> Result<Option<u32>, InputError> {
        let limits = self.limits;
        let scene = preflight(bodies, collisions, shapes, &StepParameters::default(), &limits)?;
        let quick = Quick::new(scene);
        let target = Target {
            variant: &limits.variant,
            shapes,
            streamed_masses: false,
            quick: Some(&quick),
        };
        let (of_bodies, bodies_good) = self.bodies(bodies, target);
        let (of_collisions, good) = self.entries(collisions, added, target);
        Ok((bodies_good & good).then(|| of_bodies.wrapping_add(of_collisions)))
    }

    /// Bytes of the records of `bodies` bodies, and of `collisions` collisions.
    #[must_use]
    pub fn bytes(&self, bodies: usize, collisions: usize) -> [usize; 2] {
        let beats = |segment: Segment, records| segment.layout(&self.limits.variant).beats(records);
        [
            beats(Segment::Velocities, bodies) + beats(Segment::Poses, bodies),
            beats(Segment::Collisions, collisions),
        ]
        .map(|beats| beats * BEAT_BYTES)
    }

    fn bodies<B: Bodies + ?Sized>(&mut self, bodies: &B, target: Target<'_>) -> (u32, bool) {
        let count = bodies.len();
        let velocities = &mut channels(&mut self.velocities, Segment::Velocities, count, target);
        let poses = &mut channels(&mut self.poses, Segment::Poses, count, target);
        let active = ..target.variant.profile.mm2s_widths.len();
        let into = Survey { ends: &mut self.ends, statics: &mut self.statics };
        let (velocities, poses, good) = pack_bodies(
            target,
            bodies,
            count,
            into,
            (&mut velocities[active], &mut poses[active]),
            &mut self.packers,
        );
        (velocities.wrapping_add(poses), good)
    }

    fn entries<C: Collisions + ?Sized>(
        &mut self,
        collisions: &C,
        added: Option<usize>,
        target: Target<'_>,
    ) -> (u32, bool) {
        let count = collisions.len();
        let channels = &mut channels(&mut self.collisions, Segment::Collisions, count, target);
        let active = ..target.variant.profile.mm2s_widths.len();
        let entries = Entries { collisions, count, added };
        let channels = &mut channels[active];
        let (sum, seen) =
            pack_collisions(target, self.ends.ends(), &entries, channels, &mut self.packers);
        (sum, seen.good)
    }
}

/// Reads results as a step does, from memory of its own instead of a board's.
#[derive(Debug)]
pub struct Unpacker {
    variant: Variant,
    channels: [Vec<Beat>; DMA_COUNT_MAX],
    statics: Vec<u32>,
    spare: Vec<Record>,
    packers: PackPool,
}

impl Unpacker {
    /// For one bitstream and these bodies, whose results are all the same finite numbers. Packing
    /// them remembers which never move; it is done here. Threads as [`StepPacker::new`].
    #[must_use]
    pub fn new<B: Bodies + ?Sized>(
        variant: Variant,
        bodies: &B,
        shapes: &[Shape],
        threads: Option<usize>,
    ) -> Self {
        let layout = Segment::Results.layout(&variant);
        let mut channels: [Vec<Beat>; DMA_COUNT_MAX] = Default::default();
        for (place, channel) in channels.iter_mut().enumerate() {
            // 1 in f32; 1.875 and 0 in sixteen bits.
            let one = Beat([0x3F80_0000; 4]);
            channel.resize(layout.beats_on_channel(bodies.len(), place), one);
        }
        let (mut ends, mut statics) = (Table::default(), Vec::new());
        let target = Target { variant: &variant, shapes, streamed_masses: false, quick: None };
        let into = Survey { ends: &mut ends, statics: &mut statics };
        survey(target, bodies, bodies.len(), into, &mut PackPool::alone());
        Self { variant, channels, statics, spare: Vec::new(), packers: PackPool::new(threads) }
    }

    /// Bytes of the results of `bodies` bodies in the driver's memory: f32 for every stream format.
    #[must_use]
    pub const fn bytes(bodies: usize) -> usize {
        bodies * size_of::<Record>()
    }

    /// Reads and checks the results of all bodies; returns the sum of their words, modulo 2^32, or
    /// `None` if something is not finite.
    pub fn unpack<B: Bodies + ?Sized>(&mut self, bodies: &B) -> Option<u32> {
        let layout = Segment::Results.layout(&self.variant);
        let channels = self.channels.each_ref().map(Vec::as_slice);
        let active = ..self.variant.profile.s2mm_widths.len();
        let results = Results { layout: &layout, channels: &channels[active] };
        let Self { statics, spare, packers, .. } = self;
        let (sum, broken) = results.read_in_order(bodies.len(), bodies, statics, spare, packers);
        broken.is_none().then_some(sum)
    }

    /// Stores what was read last with the bodies.
    pub fn commit<B: Bodies + ?Sized>(&self, bodies: &mut B) {
        commit(&self.spare, bodies);
    }
}

/// The channels of a segment, each long enough for `records` records.
fn channels<'a>(
    memory: &'a mut [Vec<Beat>; DMA_COUNT_MAX],
    segment: Segment,
    records: usize,
    target: Target<'_>,
) -> [&'a mut [Beat]; DMA_COUNT_MAX] {
    let layout = segment.layout(target.variant);
    let used = target.variant.profile.mm2s_widths.len();
    for (place, channel) in memory.iter_mut().enumerate().take(used) {
        channel.resize(layout.beats_on_channel(records, place), Beat::default());
    }
    memory.each_mut().map(Vec::as_mut_slice)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Body, Collision, Contact, Pose, Velocity};
    use pgs_interface::profile::FLOAT;

    #[test]
    fn every_collision_is_packed() {
        let pose = Pose { position: [0.0; 3], orientation: [0.0, 0.0, 0.0, 1.0] };
        let bodies = vec![Body { pose, velocity: Velocity::default(), shape: 0 }; 2];
        let collision = Collision {
            body_a: 0,
            body_b: 1,
            normal: [0.0; 3],
            count: 4,
            contacts: [Contact::default(); 4],
        };
        // All other words are zero.
        assert_eq!(
            CollisionPacker::new(FLOAT.default_variant()).pack(&bodies, &vec![collision; 7], &[]),
            Some(7 * (4 + 1))
        );
    }
}
