//! Lays out one step: the place of each segment in the buffers of the channels, the number of
//! descriptors, and the deadline.
//!
//! ```text
//! MM2S buffer of a channel: | velocities | poses | collisions |    each from a multiple of 64 bytes
//! ... that carries impulses: | velocities | poses | collisions | warm contact | warm friction |
//! S2MM buffer of a channel: | impulses | results |
//! ```
//!
//! Collisions come last, so that a step may have fewer of them than its buffers have room for. In a
//! warm pass one channel carries an impulse behind each collision's beats; the others send the same
//! beats in every pass.

use std::ops::Range;
use std::time::Duration;

use pgs_interface::control;
use pgs_interface::profile::Variant;
use pgs_interface::record::BEAT_BYTES;
use pgs_interface::stripe::IMPULSES_STREAM;

use crate::axi_dma::pieces;
use crate::beat::stripe::{Layout, Segment};
use crate::control_block::Capabilities;
use crate::control_block::time_of;
use crate::scene::{Passes, StepParameters};

/// A memory slower than 100 MB/s counts as one that does not answer.
const SLOWEST_BYTES_PER_MICROSECOND: u64 = 100;
/// Beats to which segments are aligned: 64 bytes.
const ALIGNMENT: usize = 64 / BEAT_BYTES;
/// Collisions whose numbers share a beat.
pub(crate) const NUMBERS_PER_BEAT: usize = control::NUMBERS_PER_BEAT as usize;

/// The number and layout of the records that a step streams.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Plan {
    /// Records of bodies.
    pub(crate) bodies: usize,
    /// Records of collisions, padding included.
    pub(crate) collisions: usize,
    pub(crate) passes: Passes,
    /// Profile and formats: they decide how records lie on the channels.
    pub(crate) variant: Variant,
    /// Whether the velocity records bring the inverse masses, because the shapes do not fit the
    /// table.
    pub(crate) streamed_masses: bool,
    /// Whether the collisions go through the issue queue. Their numbers then come out with the
    /// impulses.
    pub(crate) queued: bool,
}

/// Where the segments lie in the buffer of one MM2S channel, beats.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Segments {
    pub(crate) velocities: Range<usize>,
    pub(crate) poses: Range<usize>,
    pub(crate) collisions: Range<usize>,
    /// The collisions of the warm contact pass, where this channel carries impulses in it.
    pub(crate) warm_contact: Option<Range<usize>>,
    /// Of the warm friction pass, likewise.
    pub(crate) warm_friction: Option<Range<usize>>,
}

impl Segments {
    /// Beats up to the end of the last segment.
    pub(crate) fn end(&self) -> usize {
        let parts = [&self.warm_friction, &self.warm_contact].map(Option::as_ref);
        let mut parts = parts.into_iter().flatten().chain([&self.collisions, &self.poses]);
        parts.find(|part| !part.is_empty()).map_or(self.velocities.end, |part| part.end)
    }

    /// The collisions of one of the passes, counted over both kinds from 0.
    pub(crate) fn of_pass(&self, pass: u64, passes: Passes) -> &Range<usize> {
        let warm = match passes.is_warm(pass) {
            true if pass < u64::from(passes.contact) => self.warm_contact.as_ref(),
            true => self.warm_friction.as_ref(),
            false => None,
        };
        warm.unwrap_or(&self.collisions)
    }
}

/// Bytes of a number of beats.
pub(crate) const fn bytes(beats: usize) -> u64 {
    (beats as u64) * BEAT_BYTES as u64
}

impl Plan {
    /// Channels each way.
    pub(crate) const fn channels(&self) -> usize {
        self.variant.profile.mm2s_widths.len()
    }

    /// The segments of one MM2S channel.
    pub(crate) fn segments(&self, channel: usize) -> Segments {
        let place = |segment: Segment, records, start: usize| {
            let start = start.next_multiple_of(ALIGNMENT);
            start..start + segment.layout(&self.variant).beats_on_channel(records, channel)
        };
        let velocities = place(Segment::Velocities, self.bodies, 0);
        let poses = place(Segment::Poses, self.bodies, velocities.end);
        let collisions = place(Segment::Collisions, self.collisions, poses.end);
        let mut end = collisions.end;
        let mut warm = |passes: u32| {
            (passes > 0 && self.carries_impulses(channel)).then(|| {
                let placed = place(Segment::WarmCollisions, self.collisions, end);
                end = placed.end;
                placed
            })
        };
        let (warm_contact, warm_friction) = (warm(self.passes.contact), warm(self.passes.friction));
        Segments { velocities, poses, collisions, warm_contact, warm_friction }
    }

    /// Whether an MM2S channel carries the impulses of a warm start.
    pub(crate) fn carries_impulses(&self, channel: usize) -> bool {
        let beats = |segment: Segment| segment.layout(&self.variant).beats_on_channel(1, channel);
        self.passes.warm && beats(Segment::WarmCollisions) != beats(Segment::Collisions)
    }

    /// Beats of impulses on one S2MM channel, in front of the results.
    pub(crate) fn impulses(&self, channel: usize) -> usize {
        if channel != IMPULSES_STREAM {
            return 0;
        }
        let numbers = if self.queued { self.collisions.div_ceil(NUMBERS_PER_BEAT) } else { 0 };
        (self.collisions + numbers) * self.passes.kinds_out()
    }

    /// The layout of the results.
    pub(crate) const fn result_layout(&self) -> Layout {
        Segment::Results.layout(&self.variant)
    }

    /// Beats of results on one S2MM channel, with the impulses in front of them.
    pub(crate) fn results(&self, channel: usize) -> usize {
        self.impulses(channel) + self.result_layout().beats_on_channel(self.bodies, channel)
    }

    /// Descriptors of one MM2S channel, whose descriptors carry at most `largest` bytes.
    pub(crate) fn descriptors(&self, channel: usize, largest: u32) -> usize {
        let count = |range: Range<usize>| pieces(bytes(range.len()), largest).count();
        let segments = self.segments(channel);
        let warm = |part: &Option<Range<usize>>| part.clone().map(count);
        let (contact, friction) = (warm(&segments.warm_contact), warm(&segments.warm_friction));
        let others = self.passes.total() - self.warm_rounds(&segments);
        let others = usize::try_from(others).unwrap_or(usize::MAX);
        (count(segments.velocities) + count(segments.poses))
            .saturating_add(count(segments.collisions).saturating_mul(others))
            .saturating_add(contact.unwrap_or(0) + friction.unwrap_or(0))
    }

    /// The passes in which a channel carries impulses.
    fn warm_rounds(&self, segments: &Segments) -> u64 {
        let Segments { warm_contact, warm_friction, .. } = segments;
        u64::from(warm_contact.is_some()) + u64::from(warm_friction.is_some())
    }

    /// Bytes streamed to the accelerator, all channels.
    pub(crate) fn bytes_to_device(&self) -> u64 {
        (0..self.channels())
            .map(|channel| {
                let segments = self.segments(channel);
                let others = self.passes.total() - self.warm_rounds(&segments);
                let Segments { velocities, poses, collisions, warm_contact, warm_friction } =
                    segments;
                let warm = [warm_contact, warm_friction].into_iter().flatten();
                bytes(velocities.len() + poses.len())
                    .saturating_add(bytes(collisions.len()).saturating_mul(others))
                    .saturating_add(bytes(warm.map(|part| part.len()).sum()))
            })
            .fold(0, u64::saturating_add)
    }

    /// Bytes streamed from the accelerator, all channels.
    pub(crate) fn bytes_from_device(&self) -> u64 {
        (0..self.channels()).map(|channel| bytes(self.results(channel))).sum()
    }

    /// How long the step may last, unless the caller has set a deadline: four times the cycles of a
    /// step whose every collision waits for the one before, the transfer of its bytes from the
    /// slowest memory, and 10 ms.
    pub(crate) fn deadline(
        &self,
        parameters: &StepParameters,
        capabilities: &Capabilities,
    ) -> Duration {
        parameters.deadline.unwrap_or_else(|| {
            let window = capabilities.contact.window.max(capabilities.friction.window);
            let cycles = 4u64
                .saturating_mul(self.passes.total())
                .saturating_mul(self.collisions as u64)
                .saturating_mul(u64::from(capabilities.initiation_interval) + u64::from(window));
            let bytes = self.bytes_to_device().saturating_add(self.bytes_from_device());
            let moving = Duration::from_micros(bytes / SLOWEST_BYTES_PER_MICROSECOND);
            time_of(cycles, capabilities.clock_khz)
                .saturating_add(moving)
                .saturating_add(Duration::from_millis(10))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control_block::{fake, identify};
    use crate::platform::RegisterMap;
    use crate::platform::fake::FakeRegisters;
    use pgs_interface::profile::{FLOAT, HALF, Inertia, NAIVE};

    const FOUR: Plan = Plan {
        bodies: 38_881,
        collisions: 127_746,
        passes: PASSES,
        variant: FLOAT.default_variant(),
        streamed_masses: false,
        queued: false,
    };
    const PASSES: Passes = Passes { contact: 4, friction: 4, warm: false, impulses_out: false };

    #[test]
    fn a_wide_length_register_takes_ten_descriptors_a_channel() {
        // Velocities, eight passes, poses (interface specification, packets).
        assert!((0..4).all(|channel| FOUR.descriptors(channel, 67_108_800) == 10));
    }

    #[test]
    fn segments_begin_on_64_bytes_and_hold_every_beat() {
        let all: Vec<_> = (0..4).map(|channel| FOUR.segments(channel)).collect();
        assert!(all.iter().all(|s| s.collisions.start % 4 == 0 && s.poses.start % 4 == 0));
        let beats = |of: fn(&Segments) -> &Range<usize>| -> usize {
            all.iter().map(|segments| of(segments).len()).sum()
        };
        assert_eq!(beats(|s| &s.velocities), 2 * 38_881);
        assert_eq!(beats(|s| &s.collisions), 7 * 127_746);
        assert_eq!(beats(|s| &s.poses), 2 * 38_881);
        assert_eq!(FOUR.bytes_to_device(), 16 * (4 * 38_881 + 8 * 7 * 127_746));
        assert_eq!(FOUR.bytes_from_device(), 16 * 4 * 38_881);
    }

    /// Channel 3 of `float` has one beat of a collision, and in a warm pass two.
    #[test]
    fn impulses_have_a_segment_of_their_own_on_one_channel() {
        let passes = Passes { contact: 5, friction: 5, warm: true, impulses_out: true };
        let warm = Plan { passes, ..FOUR };
        let (bodies, collisions) = (38_881, 127_746);
        for channel in 0..3 {
            let segments = warm.segments(channel);
            assert_eq!((&segments.warm_contact, &segments.warm_friction), (&None, &None));
            assert_eq!(segments.of_pass(0, passes), &segments.collisions);
        }
        let segments = warm.segments(3);
        let lengths = [0, 1, 4, 5, 6, 9].map(|pass| segments.of_pass(pass, passes).len());
        let [one, two] = [collisions, 2 * collisions];
        assert_eq!(lengths, [two, one, one, two, one, one]);
        let friction = segments.warm_friction.clone().expect("a segment");
        assert!(friction.start >= segments.warm_contact.clone().expect("a segment").end);
        assert_eq!(segments.end(), friction.end);
        assert_eq!(warm.bytes_to_device(), 16 * (4 * bodies + (8 * 7 + 2 * 8) * collisions as u64));
        assert_eq!(warm.bytes_from_device(), 16 * (4 * bodies + 2 * collisions as u64));
        assert_eq!((warm.impulses(0), warm.impulses(3)), (2 * collisions, 0));
        assert!((0..4).all(|channel| warm.descriptors(channel, 67_108_800) == 12));
        // Through the queue a beat of numbers for four collisions: 31,936 and one for the last two.
        let queued = Plan { queued: true, ..warm };
        assert_eq!((queued.impulses(0), queued.impulses(3)), (2 * (collisions + 31_937), 0));
        assert_eq!(queued.results(0), queued.impulses(0) + 38_881);
        let contact_alone = Passes { friction: 0, ..passes };
        let plan = Plan { passes: contact_alone, ..FOUR };
        assert_eq!((plan.impulses(0), plan.segments(3).warm_friction), (collisions, None));
    }

    #[test]
    fn a_channel_without_beats_has_no_descriptors() {
        let one = Plan { bodies: 1, collisions: 0, ..FOUR };
        let counts: Vec<_> = (0..4).map(|channel| one.descriptors(channel, 192)).collect();
        assert_eq!(counts, [2, 2, 0, 0]);
    }

    /// B = 38,881 and C = 127,746 by hand from the record table and the stripes.
    #[test]
    fn bytes_of_every_profile_include_its_padding() {
        let bytes = |variant| {
            let plan = Plan { variant, ..FOUR };
            (plan.bytes_to_device() / 16, plan.bytes_from_device() / 16)
        };
        let (bodies, collisions) = (38_881, 127_746);
        assert_eq!(bytes(NAIVE.default_variant()), (4 * bodies + 8 * 7 * collisions, 4 * bodies));
        // A beat a record, filled up to five: 38,885. Two collisions in seven beats. 77,762 beats
        // of results, filled up to five: 77,765.
        assert_eq!(bytes(HALF.default_variant()), (2 * 38_885 + 8 * 7 * (collisions / 2), 77_765));
        // Twice the velocities: four beats a body.
        let world = Variant { inertia: Inertia::World, ..FLOAT.default_variant() };
        assert_eq!(bytes(world), (6 * bodies + 8 * 7 * collisions, 4 * bodies));
    }

    #[test]
    fn an_odd_collision_of_half_is_paid_for_as_a_pair() {
        let bytes = |collisions| {
            let variant = HALF.default_variant();
            let passes = Passes { contact: 1, ..Passes::default() };
            let plan = Plan { collisions, passes, variant, bodies: 5, ..FOUR };
            plan.bytes_to_device()
        };
        assert_eq!(bytes(3), bytes(4));
        assert_eq!(bytes(1), 16 * (5 + 7 + 5));
    }

    #[test]
    fn the_deadline_follows_from_the_work_unless_it_is_given() {
        let registers = FakeRegisters::default();
        fake::describe(&registers);
        let capabilities = identify(&registers.window(RegisterMap::Control)).expect("well formed");
        let mut parameters = StepParameters::default();
        // 4 x 8 x 127,746 x (2 + 324) cycles at 275 MHz are 4.845986 s; 119,437,184 bytes in and
        // out are 1.194371 s at 100 MB/s.
        let limit = FOUR.deadline(&parameters, &capabilities);
        assert_eq!(limit.as_micros(), 4_845_986 + 1_194_371 + 10_000);
        parameters.deadline = Some(Duration::from_millis(3));
        assert_eq!(FOUR.deadline(&parameters, &capabilities), Duration::from_millis(3));
    }
}
