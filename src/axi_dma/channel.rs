//! Drives one channel of a DMA core; both directions share this code.

use std::sync::Arc;

use pgs_interface::axi_dma::{
    CURDESC, CURDESC_MSB, DMACR, DMASR, Direction, LENGTH, TAILDESC, TAILDESC_MSB,
};
use pgs_interface::register::Register;

use super::{ChannelName, DmaError, Dmacr, Dmasr, STATE_CHANGE};
use crate::platform::{BusAddress, Deadline, Platform, Window, poll_until};

/// One direction of one DMA core, in scatter-gather mode.
#[derive(Debug)]
pub(crate) struct Channel {
    window: Arc<Window>,
    name: ChannelName,
    address_width: u32,
    pub(crate) control: Dmacr,
}

impl Channel {
    /// A channel of a core that was reset.
    pub(crate) fn new(
        window: Arc<Window>,
        core: usize,
        direction: Direction,
        address_width: u32,
    ) -> Self {
        let name = ChannelName { core, direction };
        Self { window, name, address_width, control: Dmacr::STOPPED }
    }

    /// The name of the channel.
    pub(crate) fn name(&self) -> ChannelName {
        self.name
    }

    /// Bits of its bus addresses.
    pub(crate) fn address_width(&self) -> u32 {
        self.address_width
    }

    fn read(&self, register: &Register) -> u32 {
        self.window.read32(register.offset + self.name.direction.offset())
    }

    fn write(&mut self, register: &Register, value: u32) {
        self.window.write32(register.offset + self.name.direction.offset(), value);
    }

    /// Low half first: with addresses above 32 bits, the write of the upper half starts the engine.
    fn write_address(&mut self, low: &Register, high: &Register, address: BusAddress) {
        self.write(low, address.low());
        if self.address_width > 32 {
            self.write(high, address.high());
        }
    }

    /// The status register.
    pub(crate) fn status(&self) -> Dmasr {
        Dmasr(self.read(&DMASR))
    }

    /// The control register.
    pub(crate) fn control(&self) -> Dmacr {
        Dmacr(self.read(&DMACR))
    }

    /// The interrupt bits of `status` that reach the line.
    pub(crate) fn pending(&self, status: Dmasr) -> u32 {
        status.interrupts() & self.control.enabled()
    }

    /// Acknowledges the interrupts that `status` shows, and no later ones.
    pub(crate) fn acknowledge(&mut self, status: Dmasr) {
        self.write(&DMASR, status.interrupts());
    }

    fn read_address(&self, low: &Register, high: &Register) -> u64 {
        let upper = if self.address_width > 32 { self.read(high) } else { 0 };
        (u64::from(upper) << 32) | u64::from(self.read(low))
    }

    /// The descriptor in work, or the one that failed.
    pub(crate) fn current_descriptor(&self) -> u64 {
        self.read_address(&CURDESC, &CURDESC_MSB)
    }

    /// The descriptor up to which the engine runs.
    pub(crate) fn tail_descriptor(&self) -> u64 {
        self.read_address(&TAILDESC, &TAILDESC_MSB)
    }

    /// Starts a halted channel at a descriptor, waits until it runs, and reads CURDESC back.
    ///
    /// The logic may be loaded anew between any two accesses, and has then forgotten the address or
    /// half of it. After this check it has the address, or RS is 0 since, and a doorbell starts
    /// nothing (PG021, DMACR bit 0: a reset clears it).
    pub(crate) fn start(
        &mut self,
        platform: &dyn Platform,
        first: BusAddress,
        control: Dmacr,
    ) -> Result<(), DmaError> {
        // CURDESC can be written only now: a running channel silently ignores the write.
        self.wait_for(platform, "halted", Dmasr::halted)?;
        self.write_address(&CURDESC, &CURDESC_MSB, first);
        self.write(&DMACR, control.0);
        self.control = control;
        self.wait_for(platform, "running", |status| !status.halted())?;
        let (expected, found) = (first.raw(), self.current_descriptor());
        if found != expected {
            return Err(DmaError::FirstDescriptor { channel: self.name, expected, found });
        }
        Ok(())
    }

    /// Stops the channel, and waits until it has.
    pub(crate) fn stop(&mut self, platform: &dyn Platform) -> Result<(), DmaError> {
        self.write(&DMACR, Dmacr::STOPPED.0);
        self.control = Dmacr::STOPPED;
        self.wait_for(platform, "halted", Dmasr::halted)
    }

    /// Records that the core was reset.
    pub(crate) fn was_reset(&mut self) {
        self.control = Dmacr::STOPPED;
    }

    /// Moves the tail; the engine runs up to and including the descriptor there.
    pub(crate) fn ring_doorbell(&mut self, tail: BusAddress) {
        self.write_address(&TAILDESC, &TAILDESC_MSB, tail);
    }

    /// Resets the whole core, this direction and the other.
    pub(super) fn request_reset(&mut self) {
        self.write(&DMACR, Dmacr::RESET.0);
        self.control = Dmacr::STOPPED;
    }

    fn wait_for(
        &self,
        platform: &dyn Platform,
        awaited: &'static str,
        reached: impl Fn(Dmasr) -> bool,
    ) -> Result<(), DmaError> {
        let deadline = Deadline::after(platform, STATE_CHANGE);
        let mut found = Dmasr(0);
        let seen = poll_until(platform, &deadline, || {
            found = self.status();
            (found.gone() || reached(found)).then_some(())
        });
        if found.gone() {
            return Err(DmaError::Gone { channel: self.name });
        }
        seen.ok_or_else(|| DmaError::State {
            channel: self.name,
            awaited,
            limit: deadline.limit(),
            found: found.to_string(),
        })
    }
}

/// The width of a halted channel's length register: all ones are written, and the existing bits
/// read back.
///
/// A write while halted starts nothing (PG021, LENGTH); 0 is restored.
pub(crate) fn detect_length_width(channel: &mut Channel) -> Result<u32, DmaError> {
    channel.write(&LENGTH, u32::MAX);
    let found = channel.read(&LENGTH);
    channel.write(&LENGTH, 0);
    let width = found.trailing_ones();
    if found == u32::MAX {
        return Err(DmaError::Gone { channel: channel.name });
    }
    if width == 0 || width != found.count_ones() {
        return Err(DmaError::NotALength { channel: channel.name, found });
    }
    Ok(width)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::platform::fake::{FakePlatform, FakeRegisters};
    use crate::platform::{RegisterMap, SharedWords};

    fn channel(registers: &FakeRegisters, direction: Direction, address_width: u32) -> Channel {
        let window = Arc::new(registers.window(RegisterMap::Dma(1)));
        Channel::new(window, 1, direction, address_width)
    }

    fn address() -> BusAddress {
        let platform: Arc<dyn Platform> = Arc::new(FakePlatform::default());
        let words = SharedWords::allocate(&platform, 64, 40.into()).expect("allocated");
        words.range(16, 16).expect("inside")
    }

    #[test]
    fn the_low_word_is_written_before_the_one_that_starts() {
        let registers = FakeRegisters::default();
        channel(&registers, Direction::S2mm, 40).ring_doorbell(address());
        assert_eq!(registers.with(|state| state.writes.clone()), [(0x40, 0x40), (0x44, 8)]);
    }

    #[test]
    fn short_addresses_are_one_write() {
        let registers = FakeRegisters::default();
        channel(&registers, Direction::Mm2s, 32).ring_doorbell(address());
        assert_eq!(registers.with(|state| state.writes.clone()), [(0x10, 0x40)]);
    }

    #[test]
    fn a_channel_that_does_not_halt_is_not_given_a_descriptor() {
        let registers = FakeRegisters::default();
        let platform = FakePlatform::default();
        let error = channel(&registers, Direction::Mm2s, 40)
            .start(&platform, address(), Dmacr::RUNNING)
            .expect_err("never halted");
        assert!(error.to_string().contains("dma1 MM2S was expected to be halted"), "{error}");
        assert!(registers.with(|state| state.writes.is_empty()));
    }

    #[test]
    fn a_start_waits_for_the_channel_to_run() {
        let registers = FakeRegisters::default();
        registers.with(|state| state.scripted.insert(0x04, vec![1, 1, 1, 0]));
        channel(&registers, Direction::Mm2s, 40)
            .start(&FakePlatform::default(), address(), Dmacr::RUNNING)
            .expect("runs at the third look");
        assert_eq!(
            registers.with(|state| state.writes.clone()),
            [(0x08, 0x40), (0x0C, 8), (0x00, 0x0001_4003)]
        );
        assert!(registers.with(|state| state.scripted[&0x04].is_empty()));
    }

    /// The logic is loaded anew behind the first write, the second, or the start.
    #[test]
    fn a_channel_that_has_lost_its_first_descriptor_does_not_start() {
        let start = |address_width, kept: [(u32, u32); 2]| {
            let registers = FakeRegisters::default();
            registers.with(|state| {
                state.scripted.insert(0x34, vec![1, 0]);
                state.kept_bits.extend(kept);
            });
            channel(&registers, Direction::S2mm, address_width)
                .start(&FakePlatform::default(), address(), Dmacr::RUNNING)
                .map_err(|error| error.to_string())
        };
        const ALL: u32 = u32::MAX;
        assert_eq!(start(40, [(0x38, ALL), (0x3C, ALL)]), Ok(()));
        for (kept, found) in [
            ([(0x38, 0), (0x3C, ALL)], "0x800000000,"),
            ([(0x38, ALL), (0x3C, 0)], "0x40,"),
            ([(0x38, 0), (0x3C, 0)], "0x0,"),
        ] {
            let refused = start(40, kept).expect_err("lost");
            let both = refused.contains(found) && refused.contains("0x800000040 was written");
            assert!(both && refused.starts_with("dma1 S2MM has its first descriptor"), "{refused}");
        }
        assert!(start(32, [(0x38, 0), (0x3C, ALL)]).is_err());
    }

    #[test]
    fn both_halves_of_a_descriptors_address_are_read_if_there_are_two() {
        let registers = FakeRegisters::default();
        registers.with(|state| {
            state.values.extend([(0x38, 0x40), (0x3C, 9), (0x40, 0xFFFF_FF80), (0x44, 0xA)]);
        });
        let of = |address_width| {
            let channel = channel(&registers, Direction::S2mm, address_width);
            [channel.current_descriptor(), channel.tail_descriptor()]
        };
        assert_eq!(of(40), [0x9_0000_0040, 0xA_FFFF_FF80]);
        assert_eq!(of(32), [0x40, 0xFFFF_FF80]);
    }

    #[test]
    fn a_board_that_is_gone_is_said_to_be() {
        let registers = FakeRegisters::default();
        registers.with(|state| state.values.insert(0x34, u32::MAX));
        let error = channel(&registers, Direction::S2mm, 40).stop(&FakePlatform::default());
        assert!(matches!(error, Err(DmaError::Gone { .. })));
    }

    #[test]
    fn only_what_was_seen_is_acknowledged() {
        let registers = FakeRegisters::default();
        channel(&registers, Direction::S2mm, 40).acknowledge(Dmasr(0x0001_5002));
        assert_eq!(registers.with(|state| state.writes.clone()), [(0x34, 0x5000)]);
    }

    #[test]
    fn the_length_width_is_what_reads_back() {
        let registers = FakeRegisters::default();
        registers.with(|state| state.kept_bits.insert(0x28, 0x3FFF));
        let mut channel = channel(&registers, Direction::Mm2s, 40);
        assert_eq!(detect_length_width(&mut channel).expect("a row of ones"), 14);
        assert_eq!(registers.with(|state| state.values[&0x28]), 0);
        for kept in [0x3FF0, 0] {
            registers.with(|state| state.kept_bits.insert(0x28, kept));
            let refused = detect_length_width(&mut channel);
            assert!(matches!(refused, Err(DmaError::NotALength { found, .. }) if found == kept));
        }
    }
}
