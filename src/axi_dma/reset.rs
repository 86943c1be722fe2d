//! Resets a whole DMA core: a reset of one direction resets both.

use super::{Channel, DmaError, STATE_CHANGE};
use crate::platform::{Deadline, Platform, poll_until};

/// Resets the core of these two channels, and waits until both show the end of the reset.
///
/// The reset is graceful: it waits for transfers that the memory has not answered. After
/// [`STATE_CHANGE`] that is an error.
pub(crate) fn reset_core(
    platform: &dyn Platform,
    mm2s: &mut Channel,
    s2mm: &mut Channel,
) -> Result<(), DmaError> {
    mm2s.request_reset();
    s2mm.was_reset();
    let deadline = Deadline::after(platform, STATE_CHANGE);
    for channel in [mm2s, s2mm] {
        let mut found = channel.control();
        let done = poll_until(platform, &deadline, || {
            found = channel.control();
            (found.0 == u32::MAX || !found.resetting()).then_some(())
        });
        if found.0 == u32::MAX {
            return Err(DmaError::Gone { channel: channel.name() });
        }
        done.ok_or_else(|| DmaError::State {
            channel: channel.name(),
            awaited: "out of reset",
            limit: deadline.limit(),
            found: found.to_string(),
        })?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::axi_dma::Direction;
    use crate::platform::RegisterMap;
    use crate::platform::fake::{FakePlatform, FakeRegisters};

    fn reset(registers: &FakeRegisters) -> Result<(), DmaError> {
        let window = Arc::new(registers.window(RegisterMap::Dma(0)));
        let mut mm2s = Channel::new(Arc::clone(&window), 0, Direction::Mm2s, 40);
        let mut s2mm = Channel::new(window, 0, Direction::S2mm, 40);
        reset_core(&FakePlatform::default(), &mut mm2s, &mut s2mm)
    }

    #[test]
    fn both_directions_must_come_out_of_reset() {
        let registers = FakeRegisters::default();
        registers.with(|state| {
            state.scripted.insert(0x00, vec![0x0001_0006, 0x0001_0006, 0x0001_0002]);
            state.scripted.insert(0x30, vec![0x0001_0006, 0x0001_0006, 0x0001_0002]);
        });
        reset(&registers).expect("out of reset");
        assert!(registers.with(|state| state.scripted.values().all(Vec::is_empty)));
        assert_eq!(registers.with(|state| state.writes.clone()), [(0x00, 0x0001_0006)]);
    }

    #[test]
    fn a_reset_that_never_ends_is_an_error_that_names_the_direction() {
        let registers = FakeRegisters::default();
        registers.with(|state| {
            state.kept_bits.insert(0x00, 0x0001_0002);
            state.values.insert(0x30, 0x0001_0006);
        });
        let error = reset(&registers).expect_err("S2MM stays in reset").to_string();
        assert!(error.contains("dma0 S2MM") && error.contains("out of reset"), "{error}");
    }

    #[test]
    fn a_board_that_reads_all_ones_is_gone() {
        let registers = FakeRegisters::default();
        registers.with(|state| state.scripted.insert(0x00, vec![u32::MAX; 4]));
        assert!(matches!(reset(&registers), Err(DmaError::Gone { .. })));
    }
}
