//! A register region with a planted mistake in front of it.

use bitstream_model::Direction;
use pgs_interface::axi_dma::{
    CURDESC, CURDESC_MSB, DMACR, DMASR, LENGTH, S2MM_OFFSET, TAILDESC, TAILDESC_MSB, dmacr, dmasr,
};
use pgs_interface::control::{self, AP_CTRL, CYCLES_LO, GIE, ap_ctrl, reset};

use super::kinds::{ChannelId, Event, Mistake, Trouble};
use super::planted::{Planted, State};
use crate::platform::RegisterWindow;
use crate::step::tests::tampered::CONTROL_BLOCK;

/// The length width that [`Mistake::LengthWidthAssumed`] assumes, bits.
const ASSUMED_WIDTH: u32 = 26;

/// A register region behind planted mistakes.
#[derive(Debug)]
pub(crate) struct PlantedRegion {
    planted: Planted,
    inner: Box<dyn RegisterWindow>,
    region: usize,
}

fn channel(region: usize, at: u32) -> (ChannelId, (usize, bool), u32) {
    let receives = at >= S2MM_OFFSET;
    let direction = if receives { Direction::S2mm } else { Direction::Mm2s };
    let offset = if receives { at - S2MM_OFFSET } else { at };
    ((region, direction), (region, receives), offset)
}

impl PlantedRegion {
    pub(crate) fn new(planted: &Planted, inner: Box<dyn RegisterWindow>, region: usize) -> Self {
        Self { planted: planted.clone(), inner, region }
    }

    /// Whether the driver reads this register to learn whether it still has what was written.
    fn believed(region: usize, at: u32) -> bool {
        match region {
            CONTROL_BLOCK => at == GIE.offset,
            _ => [CURDESC.offset, CURDESC_MSB.offset].contains(&channel(region, at).2),
        }
    }

    fn read_control(state: &State, at: u32, mut value: u32) -> u32 {
        if at == control::DMA.offset && state.mistake == Some(Mistake::LengthWidthAssumed) {
            value = control::dma::LENGTH_WIDTH.put(value, ASSUMED_WIDTH);
        }
        if at == AP_CTRL.offset {
            if state.forged {
                value |= ap_ctrl::DONE.mask();
            }
            if state.trouble == Some(Trouble::NeverDone) {
                value &= !ap_ctrl::DONE.mask();
            }
        }
        if at == CYCLES_LO.offset && state.forged {
            // A driver that believes in the end of the step believes in its counters.
            value = value.max(1);
        }
        let stays = state.trouble == Some(Trouble::AcceleratorInReset) && state.opened;
        if at == control::RESET.offset && stays {
            value |= reset::RESET.mask();
        }
        value
    }

    fn read_dma(state: &State, region: usize, at: u32, mut value: u32) -> u32 {
        let (channel, key, offset) = channel(region, at);
        if offset == DMASR.offset {
            let failed = value & dmasr::ERRORS != 0;
            match state.trouble {
                Some(Trouble::Status(troubled, bits)) if troubled == channel && state.opened => {
                    value |= bits;
                }
                Some(Trouble::NeverRuns(troubled)) if troubled == channel => {
                    value |= dmasr::HALTED.mask();
                }
                _ => {}
            }
            if let Some(Mistake::StatusUnseen(bits)) = state.mistake {
                value &= !bits;
                if failed {
                    // An error halts the channel, and such a driver does not see that either.
                    value &= !dmasr::HALTED.mask();
                }
            }
            if let Some(halted) = state.believed.get(&key) {
                value = dmasr::HALTED.put(value, u32::from(*halted));
            }
        }
        let stays = state.trouble == Some(Trouble::NeverOutOfReset(region)) && state.opened;
        if offset == DMACR.offset && stays {
            value |= dmacr::RESET.mask();
        }
        if offset == LENGTH.offset && state.mistake == Some(Mistake::LengthWidthAssumed) {
            let written = state.last.get(&(region, at)).copied().unwrap_or(0);
            value = written & (u32::MAX >> (32 - ASSUMED_WIDTH));
        }
        value
    }

    /// Makes the writes that replace one write to a DMA core.
    fn write_dma(&self, state: &mut State, at: u32, mut value: u32) {
        let region = self.region;
        let (channel, key, offset) = channel(region, at);
        let lower = offset == TAILDESC.offset;
        let upper = offset == TAILDESC_MSB.offset;
        if offset == CURDESC.offset || offset == CURDESC_MSB.offset {
            state.places.entry(key).or_default().starts_at(offset == CURDESC_MSB.offset, value);
        }
        if lower || upper {
            state.places.entry(key).or_default().ends_at(upper, value);
        }
        let doorbell = if state.wide { upper } else { lower };
        if doorbell {
            self.planted.ring(state, channel);
        }
        let tail = lower || upper;
        let controls = offset == DMACR.offset;
        let resets = controls && dmacr::RESET.is_set(value);
        let stops = controls && !resets && !dmacr::RS.is_set(value);
        match state.mistake {
            Some(Mistake::UpperHalfFirst) if lower => {
                state.held.push((region, at, value));
                return;
            }
            Some(Mistake::UpperHalfFirst) if upper => {
                self.planted.pass_on(state, vec![(region, at, value)]);
                self.planted.preempt(state);
                return self.planted.release_held(state);
            }
            Some(Mistake::HaltNotAwaited) if stops => {
                state.believed.insert(key, true);
            }
            Some(Mistake::HaltNotAwaited) if offset == CURDESC_MSB.offset => {
                state.believed.remove(&key);
            }
            Some(Mistake::OneDirectionReset) if state.opened => {
                if resets {
                    state.believed.insert((region, true), true);
                } else if let Some(halted) = state.believed.get_mut(&key).filter(|_| !tail) {
                    *halted = !(controls && dmacr::RS.is_set(value));
                    return;
                }
            }
            Some(Mistake::ThresholdRaised) if controls => {
                value = dmacr::IRQ_THRESHOLD.put(value, 4);
            }
            Some(Mistake::UnmaskedFirst) if offset == DMASR.offset => {
                state.held.push((region, at, value));
                return;
            }
            Some(Mistake::ReceiversLast) if tail && key.1 => {
                state.held.push((region, at, value));
                return;
            }
            Some(Mistake::ReceiversLast) if doorbell => {
                self.planted.pass_on(state, vec![(region, at, value)]);
                return self.planted.release_held(state);
            }
            Some(Mistake::NotReset) if resets && state.opened => return,
            _ => {}
        }
        if state.trouble == Some(Trouble::DoorbellLost(channel)) && tail {
            return;
        }
        self.planted.pass_on(state, vec![(region, at, value)]);
        if lower {
            self.planted.preempt(state);
        }
    }
}

impl RegisterWindow for PlantedRegion {
    fn bytes(&self) -> u64 {
        self.inner.bytes()
    }

    fn read32(&self, at: u32) -> u32 {
        let mut state = self.planted.state();
        let key = (self.region, at);
        let again = self.region < CONTROL_BLOCK && channel(self.region, at).2 == DMASR.offset;
        if again && state.unmasked && state.mistake == Some(Mistake::NoSecondLook) {
            return state.last.get(&key).copied().unwrap_or(0);
        }
        state.events.push(Event::Read(self.region, at));
        if again && state.unmasked && std::mem::take(&mut state.forge_due) {
            Planted::forge(&mut state);
        }
        let value = self.inner.read32(at);
        let believed =
            Self::believed(self.region, at) && state.mistake == Some(Mistake::StartBelieved);
        let value = if let Some(written) = state.last.get(&key).filter(|_| believed) {
            *written
        } else if self.region == CONTROL_BLOCK {
            Self::read_control(&state, at, value)
        } else {
            Self::read_dma(&state, self.region, at, value)
        };
        state.last.insert(key, value);
        value
    }

    fn write32(&self, at: u32, value: u32) {
        let mut state = self.planted.state();
        state.last.insert((self.region, at), value);
        state.unmasked = false;
        if self.region < CONTROL_BLOCK {
            return self.write_dma(&mut state, at, value);
        }
        let resets = at == control::RESET.offset;
        if resets && state.opened && state.mistake == Some(Mistake::NotReset) {
            return;
        }
        self.planted.pass_on(&mut state, vec![(CONTROL_BLOCK, at, value)]);
    }
}
