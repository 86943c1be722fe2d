//! Writes the records of a step into the buffers of its ports.

use std::ops::Range;

use pgs_interface::address_map::DMA_COUNT_MAX;
use pgs_interface::record::Beat;

use crate::beat::Target;
use crate::beat::bodies::{Survey, pack_bodies};
use crate::beat::collisions::{Entries, Packed, pack_collisions};
use crate::beat::impulses::{WarmSegments, WarmSums};
use crate::beat::writer::{Writer, Written};
use crate::board::bank::Bank;
use crate::board::device::Device;
use crate::board::plan::Plan;
use crate::board::port::Port;
use crate::scene::{Bodies, Collisions, Velocity};
use crate::validate::{InputError, Scene};

/// Sums of the words that a step sends, for comparison with the accelerator's sum.
#[derive(Debug, Clone, Copy)]
pub(super) struct SentSums {
    pub(super) velocities: u32,
    pub(super) collisions: u32,
    /// Of the impulses alone.
    pub(super) warm: WarmSums,
    pub(super) poses: u32,
}

/// The input of a packing.
#[derive(Debug)]
pub(super) struct PackInput<'a, B: ?Sized, C: ?Sized> {
    pub(super) bodies: &'a B,
    /// In the order of sending.
    pub(super) collisions: &'a C,
    /// Number of empty entries that the order added; `None` without a schedule.
    pub(super) added: Option<usize>,
    /// Checks the input during packing.
    pub(super) scene: &'a Scene<'a>,
}

impl Device {
    /// Writes the records of a step into the buffers of a bank. Returns the sums of the words,
    /// whether the checks passed all input, and the number of paddings.
    pub(super) fn pack<B: Bodies + ?Sized, C: Collisions + ?Sized>(
        &mut self,
        plan: &Plan,
        bank: Bank,
        input: &PackInput<'_, B, C>,
    ) -> (SentSums, bool, usize) {
        let PackInput { bodies, collisions, added, scene } = *input;
        let SegmentBuffers { mut velocities, mut poses, mut entries, warm } =
            SegmentBuffers::of(&mut self.mm2s, plan, bank);
        let active = ..plan.channels();
        let velocities = &mut velocities[active];
        let poses = &mut poses[active];
        let target = Target { scene, streamed_masses: plan.streamed_masses };
        let packers = &mut self.packers;
        let into = Survey { ends: &mut self.ends, statics: &mut self.statics[bank] };
        let (velocities, poses, bodies_passed) =
            pack_bodies(target, bodies, plan.bodies, into, (velocities, poses), packers);
        if scene.kinematic {
            self.statics[bank].retain(|body| rests(bodies, *body));
        }
        let of_entries = Entries { collisions, count: plan.collisions, added };
        let (ends, entries) = (self.ends.ends(), &mut entries[active]);
        let packed = pack_collisions(target, ends, &of_entries, entries, warm, packers);
        let Packed { sum: collisions, warm, good, paddings } = packed;
        (SentSums { velocities, collisions, warm, poses }, good & bodies_passed, paddings)
    }

    /// Writes the records of a step whose collisions `narrow_phase` writes one after the other.
    /// Returns the sums of the words, unless the step has no bodies, and the written collisions.
    /// `refuse` names the error of a body that the checks refuse.
    pub(super) fn pack_written<B: Bodies + ?Sized>(
        &mut self,
        plan: &Plan,
        bank: Bank,
        target: Target<'_>,
        bodies: &B,
        refuse: impl FnOnce() -> Result<(), InputError>,
        narrow_phase: impl FnOnce(&mut Writer<'_>),
    ) -> Result<(Option<SentSums>, Written), InputError> {
        if plan.bodies == 0 {
            let mut writer =
                Writer::without_bodies(target.scene, self.ends.ends(), plan.collisions);
            narrow_phase(&mut writer);
            return Ok((None, writer.finish()?));
        }
        let SegmentBuffers { mut velocities, mut poses, mut entries, .. } =
            SegmentBuffers::of(&mut self.mm2s, plan, bank);
        let active = ..plan.channels();
        let velocities = &mut velocities[active];
        let poses = &mut poses[active];
        let into = Survey { ends: &mut self.ends, statics: &mut self.statics[bank] };
        let (velocities, poses, passed) =
            pack_bodies(target, bodies, plan.bodies, into, (velocities, poses), &mut self.packers);
        if target.scene.kinematic {
            self.statics[bank].retain(|body| rests(bodies, *body));
        }
        if !passed {
            refuse()?;
            return Err(InputError::Unsteady);
        }
        let (ends, entries) = (self.ends.ends(), &mut entries[active]);
        let mut writer = Writer::new(target.scene, ends, plan.collisions, entries);
        narrow_phase(&mut writer);
        let written = writer.finish()?;
        let warm = WarmSums::default();
        Ok((Some(SentSums { velocities, collisions: written.sum, warm, poses }), written))
    }
}

/// Whether a body is at rest. A static one then keeps its pose, and its result is not read.
fn rests<B: Bodies + ?Sized>(bodies: &B, index: u32) -> bool {
    let Velocity { linear, angular } = bodies.body(index as usize).velocity;
    linear.into_iter().chain(angular).all(|speed| speed == 0.0)
}

/// The buffers of the MM2S ports, each split into its three segments.
struct SegmentBuffers<'a> {
    velocities: [&'a mut [Beat]; DMA_COUNT_MAX],
    poses: [&'a mut [Beat]; DMA_COUNT_MAX],
    entries: [&'a mut [Beat]; DMA_COUNT_MAX],
    /// The segments of the warm passes on the channel that carries impulses.
    warm: Option<WarmSegments<'a>>,
}

impl<'a> SegmentBuffers<'a> {
    /// Borrows each buffer once, up to the length that the plan needs.
    fn of(ports: &'a mut [Port], plan: &Plan, bank: Bank) -> Self {
        type Channels<'a> = [&'a mut [Beat]; DMA_COUNT_MAX];
        let (mut velocities, mut poses, mut entries) =
            <(Channels<'_>, Channels<'_>, Channels<'_>)>::default();
        let mut warm = None;
        for (place, port) in ports.iter_mut().enumerate() {
            let segments = plan.segments(place);
            let mut rest = Rest { beats: &mut port.beats_mut(bank)[..segments.end()], at: 0 };
            velocities[place] = rest.take(&segments.velocities);
            poses[place] = rest.take(&segments.poses);
            entries[place] = rest.take(&segments.collisions);
            if plan.carries_impulses(place) {
                let mut taken = |part: &Option<Range<usize>>| {
                    part.as_ref().map(|part| rest.take(part)).unwrap_or_default()
                };
                let contact = taken(&segments.warm_contact);
                let friction = taken(&segments.warm_friction);
                warm = Some(WarmSegments { channel: place, contact, friction });
            }
        }
        Self { velocities, poses, entries, warm }
    }
}

/// The rest of a buffer, from which segments are taken one after the other.
struct Rest<'a> {
    beats: &'a mut [Beat],
    /// Where the rest begins in the buffer.
    at: usize,
}

impl<'a> Rest<'a> {
    /// Takes a segment; an empty one may lie beyond the buffer.
    fn take(&mut self, segment: &Range<usize>) -> &'a mut [Beat] {
        if segment.is_empty() {
            return &mut [];
        }
        let beats = std::mem::take(&mut self.beats);
        let (_, beats) = beats.split_at_mut(segment.start - self.at);
        let (taken, beats) = beats.split_at_mut(segment.len());
        (self.beats, self.at) = (beats, segment.end);
        taken
    }
}
