//! Brings a board up in stages. Opening runs all of them; the self-test runs and reports one at a
//! time.

use std::sync::Arc;
use std::time::Duration;

use pgs_interface::axi_dma::{LENGTH_WIDTH_MAX, LENGTH_WIDTH_MIN};

use crate::axi_dma::{Channel, ChannelName, Direction, DmaError, detect_length_width, reset_core};
use crate::control_block::Capabilities;
use crate::error::OpenError;
use crate::platform::{AccessCounts, Platform, PlatformError, Reach, RegisterMap, Window};

/// The two channels of a DMA core.
#[derive(Debug)]
pub(crate) struct Core {
    pub(crate) sender: Channel,
    pub(crate) receiver: Channel,
}

impl Core {
    /// Resets both channels.
    pub(crate) fn reset(&mut self, platform: &dyn Platform) -> Result<(), DmaError> {
        reset_core(platform, &mut self.sender, &mut self.receiver)
    }

    /// Checks that both channels answer after a reset, and have scatter-gather.
    pub(crate) fn check_mode(&self) -> Result<(), DmaError> {
        [&self.sender, &self.receiver].into_iter().try_for_each(check_mode)
    }

    /// The widths of both length registers of a core that was just reset.
    pub(crate) fn length_widths(&mut self) -> Result<[(ChannelName, u32); 2], DmaError> {
        let Self { sender, receiver } = self;
        let width = |channel: &mut Channel| {
            detect_length_width(channel).map(|width| (channel.name(), width))
        };
        Ok([width(sender)?, width(receiver)?])
    }

    /// Checks that both length registers of a core that was just reset have `expected` bits.
    pub(crate) fn check_length_width(&mut self, expected: u32) -> Result<(), DmaError> {
        for (channel, found) in self.length_widths()? {
            if found != expected {
                return Err(DmaError::LengthWidth { channel, expected, found });
            }
        }
        Ok(())
    }
}

/// Refuses a length width that no core can have.
pub(crate) fn check_given_width(given: Option<u32>) -> Result<(), OpenError> {
    let (low, high) = (LENGTH_WIDTH_MIN, LENGTH_WIDTH_MAX);
    match given {
        Some(found) if !(low..=high).contains(&found) => {
            Err(OpenError::LengthWidth { found, low, high })
        }
        _ => Ok(()),
    }
}

/// Refuses memory for DMA outside the fence of the bitstream, as a whole. No register is touched.
pub(crate) fn check_memory(
    platform: &dyn Platform,
    capabilities: &Capabilities,
) -> Result<(), PlatformError> {
    let memory = platform.memory();
    // Width is a matter of each buffer: memory may lie on both sides of 4 GiB.
    let reach = Reach { address_width: u64::BITS, ..capabilities.reach() };
    memory.extent().map_or(Ok(()), |(address, bytes)| reach.check(memory.name(), address, bytes))
}

/// Maps the DMA cores of a bitstream. No register is read or written.
pub(crate) fn connect(
    platform: &dyn Platform,
    capabilities: &Capabilities,
    counts: &Arc<AccessCounts>,
) -> Result<Vec<Core>, PlatformError> {
    let width = capabilities.address_width;
    let core = |core| {
        let window = Arc::new(Window::open(platform, RegisterMap::Dma(core), counts)?);
        Ok(Core {
            sender: Channel::new(Arc::clone(&window), core, Direction::Mm2s, width),
            receiver: Channel::new(window, core, Direction::S2mm, width),
        })
    };
    (0..capabilities.mm2s_channels).map(core).collect()
}

fn check_mode(channel: &Channel) -> Result<(), DmaError> {
    let status = channel.status();
    let channel = channel.name();
    if status.gone() {
        return Err(DmaError::Gone { channel });
    }
    if !status.scatter_gather() {
        return Err(DmaError::NoScatterGather { channel, found: status.to_string() });
    }
    Ok(())
}

/// Consumes a pending interrupt, and unmasks the next one.
pub(crate) fn drain_interrupt(platform: &dyn Platform) -> Result<(), PlatformError> {
    platform.wait_interrupt(Duration::ZERO)?;
    platform.unmask_interrupt()
}
