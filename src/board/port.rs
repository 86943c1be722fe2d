//! A port: one DMA channel with its buffers and its ring.

use std::sync::Arc;

use super::bank::{Bank, PerBank};
use crate::axi_dma::{ChainState, Channel, Descriptor, DmaError, Dmacr, Ring, pieces};
use crate::platform::{Access, CpuBuffer, DeviceBuffer, Platform, PlatformError, Reach};

use pgs_interface::record::Beat;

/// Who holds a buffer.
#[derive(Debug, Default)]
enum Held {
    /// No buffer was allocated, or a fault has lost it.
    #[default]
    Nobody,
    Cpu(CpuBuffer),
    Device(DeviceBuffer),
}

/// One DMA channel with its memory.
#[derive(Debug)]
pub(crate) struct Port {
    pub(crate) channel: Channel,
    control: Dmacr,
    access: Access,
    ring: Option<Ring>,
    held: PerBank<Held>,
    running: bool,
}

impl Port {
    /// A port of a channel that was reset; `control` is its DMACR while it runs.
    pub(crate) fn new(channel: Channel, access: Access, control: Dmacr) -> Self {
        Self { channel, control, access, ring: None, held: PerBank::default(), running: false }
    }

    /// Makes a buffer hold `beats` beats. It grows with slack and never shrinks.
    pub(crate) fn reserve_beats(
        &mut self,
        platform: &Arc<dyn Platform>,
        bank: Bank,
        beats: usize,
        reach: Reach,
    ) -> Result<(), PlatformError> {
        let held = &mut self.held[bank];
        match held {
            Held::Cpu(buffer) if buffer.beats().len() >= beats.max(1) => return Ok(()),
            _ => {}
        }
        // The old buffer goes first: memory for DMA is scarce.
        *held = Held::Nobody;
        let slack = (beats + beats / 4).max(1).next_multiple_of(4);
        *held = Held::Cpu(CpuBuffer::allocate(platform, slack, reach)?);
        Ok(())
    }

    /// Whether the bank has a buffer, held by the CPU or by the device.
    pub(crate) fn has_buffer(&self, bank: Bank) -> bool {
        !matches!(self.held[bank], Held::Nobody)
    }

    /// Frees a buffer that the CPU holds; returns whether it held one.
    pub(crate) fn drop_buffer(&mut self, bank: Bank) -> bool {
        let held = &mut self.held[bank];
        let was_held = matches!(held, Held::Cpu(_));
        if was_held {
            *held = Held::Nobody;
        }
        was_held
    }

    /// Whether the ring takes a chain of `descriptors` descriptors.
    pub(crate) fn ring_takes(&self, descriptors: usize) -> bool {
        self.ring.as_ref().is_some_and(|ring| ring.capacity() >= descriptors)
    }

    /// Replaces the ring of a channel that is stopped.
    pub(crate) fn replace_ring(
        &mut self,
        platform: &Arc<dyn Platform>,
        descriptors: usize,
        reach: Reach,
    ) -> Result<(), PlatformError> {
        self.ring = None;
        let slack = descriptors.saturating_add(descriptors / 4);
        self.ring = Some(Ring::new(platform, self.channel.name().direction, slack, reach)?);
        Ok(())
    }

    /// Frees the ring of a channel that is stopped.
    pub(crate) fn drop_ring(&mut self) {
        self.ring = None;
    }

    /// Stops the channel if it runs.
    pub(crate) fn stop(&mut self, platform: &dyn Platform) -> Result<(), DmaError> {
        if self.running {
            self.channel.stop(platform)?;
            self.running = false;
        }
        Ok(())
    }

    /// The beats of a buffer that the CPU holds; none while the device does.
    pub(crate) fn beats(&self, bank: Bank) -> &[Beat] {
        match &self.held[bank] {
            Held::Cpu(buffer) => buffer.beats(),
            Held::Nobody | Held::Device(_) => &[],
        }
    }

    /// The beats of a buffer that the CPU holds, to write; none while the device does.
    pub(crate) fn beats_mut(&mut self, bank: Bank) -> &mut [Beat] {
        match &mut self.held[bank] {
            Held::Cpu(buffer) => buffer.beats_mut(),
            Held::Nobody | Held::Device(_) => &mut [],
        }
    }

    /// Gives a buffer to the device, which accesses its first `used` beats. No change if the device
    /// already has it.
    pub(crate) fn hand_over(&mut self, bank: Bank, used: usize) -> Result<(), PlatformError> {
        let held = &mut self.held[bank];
        match std::mem::take(held) {
            Held::Cpu(buffer) => *held = Held::Device(buffer.into_device(used, self.access)?),
            other => *held = other,
        }
        Ok(())
    }

    /// Takes a buffer back, if the device has it. Allowed when its chain is complete or was never
    /// begun, or after a reset.
    pub(crate) fn take_back(&mut self, bank: Bank) -> Result<(), PlatformError> {
        let held = &mut self.held[bank];
        match std::mem::take(held) {
            Held::Device(buffer) => *held = Held::Cpu(buffer.into_cpu()?),
            other => *held = other,
        }
        Ok(())
    }

    /// Takes back the buffers of both banks.
    pub(crate) fn take_all_back(&mut self) -> Result<(), PlatformError> {
        let [first, second] = Bank::BOTH.map(|bank| self.take_back(bank));
        first.and(second)
    }

    /// Starts the chain of a step.
    pub(crate) fn begin(&mut self) {
        self.ring_mut().begin();
    }

    /// Appends the descriptors of one packet to the chain: of its data for MM2S, of room for it for
    /// S2MM. A packet of 0 bytes appends none.
    pub(crate) fn queue(
        &mut self,
        bank: Bank,
        offset: u64,
        bytes: u64,
        largest: u32,
    ) -> Result<(), PlatformError> {
        let Self { ring: Some(ring), held, access, .. } = self else {
            unreachable!("a chain begins after reserving");
        };
        let Held::Device(buffer) = &held[bank] else {
            unreachable!("a chain begins after handing over");
        };
        // S2MM: the device marks where the packet starts and ends.
        let marks = *access == Access::Read;
        for (piece, length) in pieces(bytes, largest) {
            ring.push(&Descriptor {
                address: buffer.range(offset + piece, u64::from(length))?,
                bytes: length,
                starts_packet: marks && piece == 0,
                ends_packet: marks && piece + u64::from(length) == bytes,
            });
        }
        Ok(())
    }

    /// Whether the channel was started, and neither stopped nor reset since.
    pub(crate) fn running(&self) -> bool {
        self.running
    }

    /// Starts the channel at this step's chain, if it does not run yet; returns whether it did.
    pub(crate) fn ensure_running(&mut self, platform: &dyn Platform) -> Result<bool, DmaError> {
        let starts = !self.running && self.ring_mut().used() > 0;
        if starts {
            let first = self.ring_mut().start()?;
            self.channel.start(platform, first, self.control)?;
            self.running = true;
        }
        Ok(starts)
    }

    /// Lets the engine run to the end of the chain; returns whether the chain has any descriptor.
    pub(crate) fn ring_doorbell(&mut self) -> Result<bool, PlatformError> {
        let tail = self.ring_mut().tail()?;
        if let Some(tail) = tail {
            self.channel.ring_doorbell(tail);
        }
        Ok(tail.is_some())
    }

    /// The ring.
    pub(crate) fn ring_mut(&mut self) -> &mut Ring {
        self.ring.as_mut().expect("every step reserves the rings first")
    }

    /// The state of the step's chain, and of its descriptor at `address`.
    pub(crate) fn survey(&self, address: u64) -> ChainState {
        self.ring.as_ref().map(|ring| ring.survey(address)).unwrap_or_default()
    }

    /// Records that the core was reset, and takes the buffers back.
    pub(crate) fn was_reset(&mut self) -> Result<(), PlatformError> {
        self.running = false;
        self.channel.was_reset();
        self.take_all_back()
    }

    /// Leaves ring and buffers to an engine that could not be stopped and may still reach them.
    /// Their memory is never used or freed again, even if the CPU holds it.
    pub(crate) fn leave_to_device(&mut self) {
        if let Some(ring) = &mut self.ring {
            ring.leave_to_device();
        }
        for bank in Bank::BOTH {
            match std::mem::take(&mut self.held[bank]) {
                Held::Cpu(buffer) => buffer.leave_to_device(),
                // Dropping a buffer of the device does not free it.
                held @ (Held::Device(_) | Held::Nobody) => self.held[bank] = held,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::axi_dma::Direction;
    use crate::platform::RegisterMap;
    use crate::platform::fake::{FakePlatform, FakeRegisters};

    #[test]
    fn a_ring_takes_a_chain_of_its_exact_length_and_none_longer() {
        let platform: Arc<dyn Platform> = Arc::new(FakePlatform::default());
        let window = Arc::new(FakeRegisters::default().window(RegisterMap::Dma(0)));
        let channel = Channel::new(window, 0, Direction::Mm2s, 40);
        let mut port = Port::new(channel, Access::Read, Dmacr::RUNNING);
        assert!(!port.ring_takes(1));
        // A quarter is slack.
        port.replace_ring(&platform, 8, 40.into()).expect("allocated");
        assert_eq!([9, 10, 11].map(|length| port.ring_takes(length)), [true, true, false]);
    }
}
