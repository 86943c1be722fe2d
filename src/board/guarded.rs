//! Puts the memory of one DMA master into the guard behind the fence, for a test of the fence. A
//! master that the fence holds then meets a decode error; any other works on memory that is
//! reserved for this.

use std::fmt;
use std::sync::Arc;

use super::bank::Bank;
use super::device::Device;
use super::plan::Plan;
use super::symptom::Symptom;
use crate::axi_dma::{ChannelName, Direction};
use crate::platform::{Platform, Reach};

/// A master of a DMA core, with an address map of its own in the block design.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Master {
    /// Descriptors of both channels.
    Sg,
    /// Data of a channel.
    Data(Direction),
}

impl Master {
    /// The masters of a core.
    pub(crate) const ALL: [Self; 3] =
        [Self::Sg, Self::Data(Direction::Mm2s), Self::Data(Direction::S2mm)];

    /// The channel that uses it first.
    pub(crate) const fn direction(self) -> Direction {
        match self {
            Self::Sg => Direction::Mm2s,
            Self::Data(direction) => direction,
        }
    }
}

/// One master, and the guard for its memory.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Guarded<'a> {
    pub(crate) guard: &'a Arc<dyn Platform>,
    pub(crate) core: usize,
    pub(crate) master: Master,
}

impl Guarded<'_> {
    /// The channel of the master.
    pub(crate) fn channel(&self) -> ChannelName {
        ChannelName { core: self.core, direction: self.master.direction() }
    }
}

impl fmt::Display for Guarded<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.master {
            Master::Sg => write!(f, "dma{} SG", self.core),
            Master::Data(_) => self.channel().fmt(f),
        }
    }
}

impl Device {
    /// Moves the ring or the buffer of a master into the guard, for a step that is reserved and not
    /// packed.
    pub(crate) fn move_to_guard(
        &mut self,
        guarded: &Guarded<'_>,
        plan: &Plan,
        bank: Bank,
    ) -> Result<(), Symptom> {
        let Guarded { guard, core, master } = *guarded;
        // On purpose: the guard lies outside the fence.
        let reach = Reach { fence: None, ..self.capabilities.reach() };
        let [descriptors, _] = self.descriptors_of(plan, core);
        let (port, beats) = match master.direction() {
            Direction::Mm2s => (&mut self.mm2s[core], plan.segments(core).end()),
            Direction::S2mm => (&mut self.s2mm[core], plan.results(core)),
        };
        if master == Master::Sg {
            self.platform.check_present()?;
            port.stop(&*self.platform)?;
            port.replace_ring(guard, descriptors, reach)?;
        } else {
            port.drop_buffer(bank);
            port.reserve_beats(guard, bank, beats, reach)?;
        }
        Ok(())
    }

    /// Frees the guard after the step. A channel that cannot be stopped keeps its part of it.
    pub(crate) fn leave_guard(&mut self, guarded: &Guarded<'_>, bank: Bank) {
        let port = match guarded.master.direction() {
            Direction::Mm2s => &mut self.mm2s[guarded.core],
            Direction::S2mm => &mut self.s2mm[guarded.core],
        };
        if guarded.master != Master::Sg {
            port.drop_buffer(bank);
        } else if self.platform.check_present().is_ok() && port.stop(&*self.platform).is_ok() {
            port.drop_ring();
        }
    }
}
