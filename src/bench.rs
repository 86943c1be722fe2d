//! Packs and unpacks without a board, for benchmarks: feature `bench`.

use pgs_interface::address_map::DMA_COUNT_MAX;
use pgs_interface::profile::Variant;
use pgs_interface::record::{BEAT_BYTES, Beat};

use crate::beat::Target;
use crate::beat::bodies::{Survey, pack_bodies};
use crate::beat::collisions::{Entries, pack_collisions};
use crate::beat::impulses::WarmSegments;
use crate::beat::pool::PackPool;
use crate::beat::stripe::Segment;
use crate::record::body_table::Table;
use crate::record::result::Record;
use crate::scene::{Bodies, Collisions, Shape, StepParameters};
use crate::step::{Results, commit};
use crate::validate::{InputError, Limits, preflight};

/// Memory for a segment, one part a channel.
type Channels = [Vec<Beat>; DMA_COUNT_MAX];

/// Packs steps as a step does, into memory of its own instead of a board's.
#[derive(Debug)]
pub struct StepPacker {
    limits: Limits,
    segments: [Channels; 3],
    /// Of the channel that carries impulses.
    warm: [Vec<Beat>; 2],
    ends: Table,
    statics: Vec<u32>,
    packers: PackPool,
}

impl StepPacker {
    /// A packer for one bitstream that has room for every scene; it has no memory yet. `threads` is
    /// the same as in [`OpenOptions::pack_threads`](crate::OpenOptions::pack_threads).
    #[must_use]
    pub fn new(variant: Variant, threads: Option<usize>) -> Self {
        Self {
            limits: Limits::roomy(variant),
            segments: Default::default(),
            warm: Default::default(),
            ends: Table::default(),
            statics: Vec::new(),
            packers: PackPool::new(threads),
        }
    }

    /// Writes and checks everything; returns the sum of all words, modulo 2^32, or `None` if
    /// validation refuses something. `added` is how many entries the order of the collisions
    /// added, `None` if there is none.
    ///
    /// # Errors
    /// What a step refuses whatever its bodies and collisions hold.
    pub fn pack<B: Bodies + ?Sized, C: Collisions + ?Sized>(
        &mut self,
        bodies: &B,
        collisions: &C,
        shapes: &[Shape],
        (added, parameters): (Option<usize>, &StepParameters),
    ) -> Result<Option<u32>, InputError> {
        let Self { limits, segments, warm, ends, statics, packers } = self;
        let scene = preflight(bodies, collisions, shapes, parameters, limits)?;
        let target = Target { scene: &scene, streamed_masses: false };
        let (bodies_count, count) = (bodies.len(), collisions.len());
        let [velocities, poses, records] = segments;
        let velocities = &mut channels(velocities, Segment::Velocities, bodies_count, limits);
        let poses = &mut channels(poses, Segment::Poses, bodies_count, limits);
        let records = &mut channels(records, Segment::Collisions, count, limits);
        let active = ..limits.variant.profile.mm2s_widths.len();
        let into = Survey { ends, statics };
        let places = (&mut velocities[active], &mut poses[active]);
        let (velocities, poses, good) =
            pack_bodies(target, bodies, bodies_count, into, places, packers);
        let carries = |channel: &usize| {
            let [usual, warm] = [Segment::Collisions, Segment::WarmCollisions]
                .map(|segment| segment.layout(&limits.variant).beats_on_channel(count, *channel));
            usual != warm
        };
        let channel = (0..DMA_COUNT_MAX).filter(|_| parameters.warm_start).find(carries);
        let warm = channel.map(|channel| {
            let layout = Segment::WarmCollisions.layout(&limits.variant);
            let beats = layout.beats_on_channel(count, channel);
            warm.iter_mut().for_each(|segment| segment.resize(beats, Beat::default()));
            let [contact, friction] = warm.each_mut().map(Vec::as_mut_slice);
            WarmSegments { channel, contact, friction }
        });
        let entries = Entries { collisions, count, added };
        let (ends, records) = (self.ends.ends(), &mut records[active]);
        let packed = pack_collisions(target, ends, &entries, records, warm, &mut self.packers);
        let sums = [velocities, poses, packed.sum].into_iter().fold(0, u32::wrapping_add);
        Ok((good & packed.good).then_some(sums))
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
}

/// Reads results as a step does, from memory of its own instead of a board's.
#[derive(Debug)]
pub struct Unpacker {
    variant: Variant,
    channels: Channels,
    statics: Vec<u32>,
    spare: Vec<Record>,
    packers: PackPool,
}

impl Unpacker {
    /// For one bitstream and these bodies, whose results are all the same finite numbers. Threads
    /// as [`StepPacker::new`].
    #[must_use]
    pub fn new<B: Bodies + ?Sized>(
        variant: Variant,
        bodies: &B,
        shapes: &[Shape],
        threads: Option<usize>,
    ) -> Self {
        let layout = Segment::Results.layout(&variant);
        let mut channels = Channels::default();
        for (place, channel) in channels.iter_mut().enumerate() {
            // 1 in f32; 1.875 and 0 in sixteen bits.
            let one = Beat([0x3F80_0000; 4]);
            channel.resize(layout.beats_on_channel(bodies.len(), place), one);
        }
        let shape = |index: &u32| shapes.get(bodies.body(*index as usize).shape as usize);
        let statics = (0..).take(bodies.len()).filter(|it| shape(it).is_none_or(Shape::is_static));
        let statics = statics.collect();
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
    memory: &'a mut Channels,
    segment: Segment,
    records: usize,
    limits: &Limits,
) -> [&'a mut [Beat]; DMA_COUNT_MAX] {
    let layout = segment.layout(&limits.variant);
    for (place, channel) in memory.iter_mut().enumerate() {
        channel.resize(layout.beats_on_channel(records, place), Beat::default());
    }
    memory.each_mut().map(Vec::as_mut_slice)
}
