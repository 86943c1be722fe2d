//! Runs a step that changes nothing: no contact points, no integration. Every bitstream returns its
//! poses and velocities bit for bit, and the self-test compares them.

use std::time::Duration;

use pgs_interface::axi_dma::LENGTH_WIDTH_MIN;
use pgs_interface::profile::Variant;
use pgs_interface::record::Beat;

use super::accelerator::Accelerator;
use super::packing::PackInput;
use super::results::received;
use crate::axi_dma::{Direction, largest_piece};
use crate::beat::stripe::{Place, Segment};
use crate::board::Guarded;
use crate::board::plan::{Plan, bytes};
use crate::board::symptom::Symptom;
use crate::error::Error;
use crate::platform::{Deadline, GuardPlatform, PlatformError};
use crate::scene::{Body, Collision, Passes, StepParameters};
use crate::validate::{Scene, SceneNeeds};

/// Time limit of an echo. The driver polls without an interrupt after a quarter of it.
pub(crate) const ECHO_LIMIT: Duration = Duration::from_millis(200);

/// Fills a buffer before its use: a beat by direction, channel and index.
pub(crate) type FillPattern = fn(Direction, usize, usize) -> Beat;

/// The bodies to send, and the state of the buffers.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Echo<'a> {
    /// The bodies. They need not be valid: nothing is computed with them.
    pub(crate) bodies: &'a [Body],
    /// Whether to cut every packet into the shortest pieces, for many descriptors.
    pub(crate) short_pieces: bool,
    /// Whether to release the buffers of an earlier run first.
    pub(crate) fresh_buffers: bool,
    /// The pattern to write over all buffers first.
    pub(crate) filler: Option<FillPattern>,
    /// The master whose memory lies in the guard.
    pub(crate) guarded: Option<Guarded<'a>>,
}

/// The results and counters of an echo.
#[derive(Debug)]
pub(crate) struct EchoResult {
    /// The result beats of each channel.
    pub(crate) results: Vec<Vec<Beat>>,
    /// Sum of the words that the driver sent.
    pub(crate) sent: u32,
    /// The accelerator's sums of the words that it received and sent.
    pub(crate) sums: (u32, u32),
    /// Interrupts that woke the driver.
    pub(crate) interrupts: u64,
    /// Descriptors used.
    pub(crate) descriptors: u64,
}

impl Accelerator {
    /// Runs an echo. After an error the board was reset, if a reset was possible.
    pub(crate) fn echo(&mut self, echo: &Echo<'_>) -> Result<EchoResult, Error> {
        self.settle()?;
        let largest = self.device.largest;
        if echo.short_pieces {
            self.device.largest = largest_piece(LENGTH_WIDTH_MIN);
        }
        let echoed = self.run_echo(echo);
        self.device.largest = largest;
        let echoed = echoed.map_err(|fault| self.device.fail(fault, &self.shapes));
        if let Some(guarded) = &echo.guarded {
            self.device.leave_guard(guarded, self.bank);
        }
        echoed
    }

    fn run_echo(&mut self, echo: &Echo<'_>) -> Result<EchoResult, Symptom> {
        let plan = plan(echo.bodies.len(), self.device.capabilities.variant);
        let bank = self.bank;
        self.packed[bank] = None;
        if echo.fresh_buffers {
            self.device.release_buffers(bank);
        }
        self.device.reserve_or_reset(&plan, bank, &self.shapes)?;
        if let Some(guarded) = &echo.guarded {
            self.device.move_to_guard(guarded, &plan, bank)?;
        }
        if let Some(filler) = echo.filler {
            let sides = [
                (Direction::Mm2s, &mut self.device.mm2s),
                (Direction::S2mm, &mut self.device.s2mm),
            ];
            for (direction, ports) in sides {
                for (channel, port) in ports.iter_mut().enumerate() {
                    for (slot, beat) in port.beats_mut(bank).iter_mut().enumerate() {
                        *beat = filler(direction, channel, slot);
                    }
                }
            }
        }
        let none: &[Collision] = &[];
        let parameters = StepParameters {
            contact_iterations: 0,
            friction_iterations: 0,
            integrate: false,
            deadline: Some(ECHO_LIMIT),
            ..StepParameters::default()
        };
        let needs =
            SceneNeeds { bodies: plan.bodies, collisions: 0, inertia: plan.variant.inertia };
        let scene = &Scene::new(&self.shapes, needs, &plan.variant, &parameters);
        let input = PackInput { bodies: echo.bodies, collisions: none, added: None, scene };
        // Whatever the bodies are, the accelerator sends them back.
        let (sent, ..) = self.device.pack(&plan, bank, &input);
        let deadline = Deadline::after(&*self.device.platform, ECHO_LIMIT);
        self.device.arm(&plan, bank, &parameters)?;
        self.device.start()?;
        let interrupts = self.device.wait(&plan, &deadline)?;
        let counters = self.device.collect(&deadline)?;
        self.device.take_back(bank)?;
        let channels = received(&self.device.s2mm, &plan, bank);
        Ok(EchoResult {
            results: channels[..plan.channels()].iter().map(|beats| beats.to_vec()).collect(),
            sent: sent.velocities.wrapping_add(sent.poses),
            sums: counters.sums,
            interrupts,
            descriptors: self.device.descriptors(),
        })
    }

    /// The guard behind the fence, if one is reserved.
    pub(crate) fn guard(&self) -> Result<Option<GuardPlatform>, PlatformError> {
        GuardPlatform::of(&self.device.platform)
    }

    /// Whether an interrupt comes within `timeout`. Unmasks the interrupt afterwards.
    pub(crate) fn interrupt_within(&mut self, timeout: Duration) -> Result<bool, PlatformError> {
        let came = self.device.platform.wait_interrupt(timeout)?.is_some();
        if came {
            self.device.platform.unmask_interrupt()?;
        }
        Ok(came)
    }
}

/// The plan of an echo: bodies alone.
fn plan(bodies: usize, variant: Variant) -> Plan {
    let (collisions, passes) = (0, Passes::default());
    // The shapes of an echo fit every table.
    Plan { bodies, collisions, passes, variant, streamed_masses: false, queued: false }
}

/// The MM2S channel that carried a beat of the results, and the beat's offset in the buffer of that
/// channel, in bytes. `None` for padding, which no channel carried.
pub(crate) fn source_of(bodies: usize, variant: &Variant, result: Place) -> Option<(usize, u64)> {
    let layout = |segment: Segment| {
        let layout = segment.layout(variant);
        // These records are whole beats in every format.
        (layout, layout.rows / layout.rows_per_beat())
    };
    let (results, per_result) = layout(Segment::Results);
    let (poses, per_pose) = layout(Segment::Poses);
    let (velocities, per_velocity) = layout(Segment::Velocities);
    let index = results.beat_at(result);
    let (record, beat) = (index / per_result, index % per_result);
    if record >= bodies {
        return None;
    }
    // A result is the pose and then the velocity.
    let (place, start) = if let Some(beat) = beat.checked_sub(per_pose) {
        (velocities.place(record * per_velocity + beat), 0)
    } else {
        let place = poses.place(record * per_pose + beat);
        (place, plan(bodies, *variant).segments(place.channel).poses.start)
    };
    Some((place.channel, bytes(start + place.slot)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use pgs_interface::profile::{FLOAT, HALF};

    #[test]
    fn a_result_is_traced_to_the_beat_that_was_sent() {
        let at = |channel, slot| {
            let place = Place { channel, slot };
            source_of(7, &FLOAT.default_variant(), place).expect("not padding")
        };
        // Body 0: pose on channels 0 and 1, velocity on 0 and 1. Seven bodies are four beats of
        // velocities on channel 0, so that the poses begin at beat 4.
        assert_eq!([at(0, 0), at(1, 0), at(2, 0), at(3, 0)], [(0, 64), (1, 64), (0, 0), (1, 0)]);
        // Body 1: its pose is beats 2 and 3.
        assert_eq!([at(0, 1), at(3, 1)], [(2, 64), (3, 0)]);
        // Body 6: beats 12 and 13.
        assert_eq!([at(1, 6), at(2, 6)], [(1, 64 + 48), (0, 48)]);
    }
    #[test]
    fn a_result_of_half_is_traced_too_and_its_padding_to_nowhere() {
        let half = |channel, slot| source_of(7, &HALF.default_variant(), Place { channel, slot });
        // Velocities are seven beats, two groups: four on channel 0, so that the poses begin at
        // beat 4 there, and on channel 2, with two, at beat 4 too (64 bytes). Body 0: pose and
        // velocity are the first beats of channel 0.
        assert_eq!([half(0, 0), half(0, 1)], [Some((0, 64)), Some((0, 0))]);
        // Body 2: beats 4 and 5 of the results; its pose and its velocity are beat 2 of their
        // segments.
        assert_eq!([half(2, 0), half(0, 2)], [Some((1, 64)), Some((1, 0))]);
        // Body 6: beats 12 and 13; beat 6 of the velocities is the second group's second.
        assert_eq!(half(1, 5), Some((0, 48)));
        // Beat 14 is the last of the third group, and padding.
        assert_eq!(half(2, 2), None);
    }
}
