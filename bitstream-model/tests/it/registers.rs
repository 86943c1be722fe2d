//! The registers of the emulated AXI DMAs: reset values, access kinds, side effects.

use bitstream_model::{BoardConfig, Direction, ViolationKind};
use pgs_interface::address_map::{CONTROL_BASE, dma_base};
use pgs_interface::axi_dma::{
    ADDRESS, ADDRESS_MSB, CURDESC, CURDESC_MSB, DMACR, DMASR, LENGTH, TAILDESC, TAILDESC_MSB,
    dmacr, dmasr,
};
use pgs_interface::control;
use pgs_interface::descriptor::status;

use crate::common::ring::{Ring, WHOLE, halves};
use crate::common::{BOTH, CORES, Host, numbered};
use std::time::Duration;

/// Reset values of the MM2S half, as PG021 prints them; S2MM has the same 0x30 higher.
const RESET_VALUES: [(u64, u32); 9] = [
    (0x00, 0x0001_0002),
    (0x04, 0x0001_0009),
    (0x08, 0),
    (0x0C, 0),
    (0x10, 0),
    (0x14, 0),
    (0x18, 0),
    (0x1C, 0),
    (0x28, 0),
];

fn assert_reset_values(host: &Host, core: usize) {
    for half in [0x00, 0x30] {
        for (offset, value) in RESET_VALUES {
            let address = dma_base(core) + half + offset;
            assert_eq!(host.port.read32(address), value, "{address:#x}");
        }
    }
}

#[test]
fn every_register_reads_its_reset_value_after_power_up() {
    let host = Host::new(BoardConfig::default());
    (0..CORES).for_each(|core| assert_reset_values(&host, core));
    host.assert_no_violation();
}

#[test]
fn dmasr_says_whether_scatter_gather_is_built_in() {
    let host = Host::new(BoardConfig { scatter_gather: false, ..BoardConfig::default() });
    for direction in BOTH {
        assert_eq!(host.status(0, direction), 0x0001_0001);
    }
}

#[test]
fn each_bit_of_dmacr_is_writable_or_not_as_the_guide_says() {
    for direction in BOTH {
        for bit in (0..32_u32).filter(|bit| *bit != 2) {
            let host = Host::new(BoardConfig::default());
            host.write(1, direction, DMACR, 1 << bit);
            let writable = matches!(bit, 0 | 3 | 4 | 12..=14 | 16..=31);
            // Threshold 0 keeps the old one.
            let threshold = if (16..24).contains(&bit) { 0 } else { 0x0001_0000 };
            let expected = 0x2 | threshold | (u32::from(writable) << bit);
            assert_eq!(host.read(1, direction, DMACR), expected, "{direction} bit {bit}");
            host.write(1, direction, DMACR, 0);
            let kept = if (16..24).contains(&bit) { 1 << bit } else { 0x0001_0000 };
            assert_eq!(host.read(1, direction, DMACR), 0x2 | kept, "{direction} bit {bit}");
        }
    }
}

#[test]
fn no_write_reaches_the_read_only_bits_of_dmasr() {
    let host = Host::new(BoardConfig::default());
    for direction in BOTH {
        host.write(0, direction, DMASR, u32::MAX);
        assert_eq!(host.status(0, direction), 0x0001_0009);
    }
    host.assert_no_violation();
}

#[test]
fn threshold_zero_keeps_the_old_threshold_and_a_new_one_reloads_the_count() {
    let host = Host::new(BoardConfig::default());
    host.write(0, Direction::S2mm, DMACR, 0x0007_0000);
    assert_eq!(host.status(0, Direction::S2mm) >> 16 & 0xFF, 7);
    host.write(0, Direction::S2mm, DMACR, 0x0000_4000);
    assert_eq!(host.read(0, Direction::S2mm, DMACR), 0x0007_4002);
    assert_eq!(host.status(0, Direction::S2mm) >> 16 & 0xFF, 7);
}

/// A channel with IOC, delay and error interrupt all latched, none enabled.
fn with_all_interrupts() -> (Host, Ring) {
    let host = Host::lenient(BoardConfig::default());
    let mut ring = Ring::new(&host, 0, Direction::Mm2s, 4);
    let data = host.readable(&numbered(4));
    let slot = ring.push(data, WHOLE | 64);
    ring.run(&host, dmacr::IRQ_DELAY.put(0, 1));
    ring.doorbell(&host, slot);
    host.pause(20);
    // No memory answers at this data address.
    let slot = ring.push(0x7_0000_0000, WHOLE | 64);
    ring.doorbell(&host, slot);
    host.pause(20);
    (host, ring)
}

#[test]
fn writing_dmasr_clears_exactly_the_written_interrupt_bits() {
    for mask in 0..8_u32 {
        let (host, _ring) = with_all_interrupts();
        let before = host.status(0, Direction::Mm2s);
        assert_eq!(before & 0x7000, 0x7000, "all latch, though none is enabled: {before:#x}");
        host.write(0, Direction::Mm2s, DMASR, mask << 12);
        assert_eq!(host.status(0, Direction::Mm2s), before & !(mask << 12));
    }
}

#[test]
fn an_error_bit_is_cleared_by_a_reset_and_by_nothing_else() {
    let (host, _ring) = with_all_interrupts();
    host.write(0, Direction::Mm2s, DMASR, u32::MAX);
    let value = host.status(0, Direction::Mm2s);
    assert_eq!(value & 0x7FF1, 0x0041, "Halted and DMADecErr stay: {value:#x}");
    assert!(!dmacr::RS.is_set(host.read(0, Direction::Mm2s, DMACR)), "an error clears RS");
    host.reset_dma(0);
    assert_reset_values(&host, 0);
}

#[test]
fn halted_follows_run_and_stop_later_than_the_next_read() {
    let host = Host::new(BoardConfig::default());
    for direction in BOTH {
        host.write(0, direction, DMACR, 0x0001_0001);
        assert!(dmasr::HALTED.is_set(host.status(0, direction)));
        assert!(dmasr::HALTED.is_set(host.status(0, direction)), "still");
        host.wait_halted(0, direction, false);
        assert!(!dmasr::IDLE.is_set(host.status(0, direction)), "nothing was transferred yet");
        host.write(0, direction, DMACR, 0x0001_0000);
        assert!(!dmasr::HALTED.is_set(host.status(0, direction)));
        assert!(!dmasr::HALTED.is_set(host.status(0, direction)), "still");
        host.wait_halted(0, direction, true);
    }
}

#[test]
fn reset_of_either_channel_resets_both_and_takes_more_than_one_read() {
    for direction in BOTH {
        let host = Host::new(BoardConfig::default());
        for way in BOTH {
            let ring = Ring::new(&host, 2, way, 2);
            ring.run(&host, 0x7200_7000);
        }
        host.write(2, direction, DMACR, 0x4);
        for _ in 0..2 {
            for way in BOTH {
                assert!(
                    dmacr::RESET.is_set(host.read(2, way, DMACR)),
                    "{direction} shows in {way}"
                );
            }
        }
        host.pause(10);
        assert_reset_values(&host, 2);
        host.assert_no_violation();
    }
}

#[test]
fn a_core_under_reset_ignores_writes() {
    let host = Host::new(BoardConfig::default());
    host.write(0, Direction::Mm2s, DMACR, 0x4);
    host.write(0, Direction::S2mm, CURDESC, 0x4000_0000);
    host.write(0, Direction::S2mm, DMACR, 0x0001_0001);
    host.pause(10);
    assert_reset_values(&host, 0);
    assert_eq!(host.read(1, Direction::Mm2s, DMACR), 0x0001_0002, "the others live on");
}

#[test]
fn curdesc_is_cut_to_bits_31_6_and_ignored_while_running() {
    for direction in BOTH {
        let host = Host::lenient(BoardConfig::default());
        host.write(0, direction, CURDESC, 0x1234_567F);
        host.write(0, direction, CURDESC_MSB, 0xFFFF_FF08);
        assert_eq!(host.read(0, direction, CURDESC), 0x1234_5640);
        assert_eq!(host.read(0, direction, CURDESC_MSB), 0x08, "40 bits of address");
        host.assert_no_violation();
        host.run_channel(0, direction, 0);
        host.write(0, direction, CURDESC, 0x4000_0000);
        host.write(0, direction, CURDESC_MSB, 0);
        assert_eq!(host.read(0, direction, CURDESC), 0x1234_5640);
        assert_eq!(host.read(0, direction, CURDESC_MSB), 0x08);
        let kind = ViolationKind::CurdescWhileRunning { core: 0, direction };
        assert_eq!(host.violations(), [kind, kind]);
    }
}

#[test]
fn curdesc_is_not_writable_between_rs_and_halted() {
    let host = Host::lenient(BoardConfig::default());
    host.write(0, Direction::Mm2s, DMACR, 0x0001_0001);
    host.write(0, Direction::Mm2s, CURDESC, 0x4000_0000);
    assert_eq!(host.read(0, Direction::Mm2s, CURDESC), 0);
    assert_eq!(host.violations().len(), 1);
}

#[test]
fn a_doorbell_while_halted_is_latched_and_starts_nothing() {
    for direction in BOTH {
        let host = Host::lenient(BoardConfig::default());
        let mut ring = Ring::new(&host, 0, direction, 2);
        let slot = ring.push(host.readable(&numbered(4)), WHOLE | 64);
        ring.point(&host, ring.address);
        ring.doorbell(&host, slot);
        let [low, high] = halves(ring.at(slot));
        assert_eq!(host.read(0, direction, TAILDESC), low);
        assert_eq!(host.read(0, direction, TAILDESC_MSB), high);
        assert_eq!(host.violations(), [ViolationKind::DoorbellWhileHalted { core: 0, direction }]);
        host.run_channel(0, direction, 0);
        host.pause(20);
        assert_eq!(ring.status(slot), 0, "the tail written before does not count");
        assert_eq!(host.board.counts().doorbells, 0);
    }
}

#[test]
fn all_ones_in_length_while_halted_read_back_as_its_width() {
    for scatter_gather in [true, false] {
        for width in [8, 14, 16, 23, 26] {
            let host = Host::new(BoardConfig {
                length_width: width,
                scatter_gather,
                ..BoardConfig::default()
            });
            for direction in BOTH {
                host.write(3, direction, LENGTH, u32::MAX);
                assert_eq!(host.read(3, direction, LENGTH), (1 << width) - 1);
                host.write(3, direction, LENGTH, 0);
                assert_eq!(host.read(3, direction, LENGTH), 0);
            }
            host.assert_no_violation();
            assert_eq!(control::dma::LENGTH_WIDTH.of(host.control(control::DMA)), width);
        }
    }
}

#[test]
fn a_length_while_halted_starts_nothing() {
    let config = BoardConfig { scatter_gather: false, ..BoardConfig::default() };
    let host = Host::lenient(config);
    let direction = Direction::Mm2s;
    host.write(0, direction, ADDRESS, halves(host.readable(&numbered(4)))[0]);
    host.write(0, direction, LENGTH, 64);
    assert_eq!(host.read(0, direction, LENGTH), 64, "the bits can be read");
    assert_eq!(host.violations(), [ViolationKind::DoorbellWhileHalted { core: 0, direction }]);
    host.run_channel(0, direction, 0);
    host.pause(20);
    assert_eq!(host.board.counts().beats_read, 0);
}

#[test]
fn a_length_wider_than_the_register_is_cut_and_moves_the_cut_length() {
    let config = BoardConfig { scatter_gather: false, length_width: 14, ..BoardConfig::default() };
    let host = Host::lenient(config);
    let direction = Direction::Mm2s;
    let [low, high] = halves(host.readable(&numbered(8)));
    host.write(0, direction, ADDRESS, low);
    host.write(0, direction, ADDRESS_MSB, high);
    host.run_channel(0, direction, 0);
    host.write(0, direction, LENGTH, 16_384);
    host.pause(20);
    assert_eq!(host.board.counts().beats_read, 0, "that was a write of 0");
    host.write(0, direction, LENGTH, 16_384 + 32);
    host.pause(20);
    assert_eq!(host.board.counts().beats_read, 2);
    let kind = |wanted| ViolationKind::LengthTooWide { core: 0, direction, wanted, width: 14 };
    assert_eq!(host.violations(), [kind(16_384), kind(16_416)]);
}

#[test]
fn with_32_bit_addresses_the_upper_halves_do_not_exist() {
    let host = Host::new(BoardConfig { address_width: 32, ..BoardConfig::default() });
    for direction in BOTH {
        for register in [CURDESC_MSB, TAILDESC_MSB, ADDRESS_MSB] {
            host.write(0, direction, register, u32::MAX);
            assert_eq!(host.read(0, direction, register), 0, "{}", register.name);
        }
    }
    host.assert_no_violation();
}

#[test]
fn the_doorbell_is_taildesc_with_32_bit_addresses_and_taildesc_msb_with_wider_ones() {
    for address_width in [32, 33, 40, 64] {
        let host = Host::new(BoardConfig { address_width, ..BoardConfig::default() });
        let mut ring = Ring::new(&host, 0, Direction::Mm2s, 2);
        let slot = ring.push(host.readable(&numbered(4)), WHOLE | 64);
        ring.run(&host, 0);
        let [low, high] = halves(ring.at(slot));
        host.write(0, Direction::Mm2s, TAILDESC, low);
        host.pause(20);
        let started = status::CMPLTED.is_set(ring.status(slot));
        assert_eq!(started, address_width == 32, "{address_width} bits");
        host.write(0, Direction::Mm2s, TAILDESC_MSB, high);
        host.pause(20);
        assert!(status::CMPLTED.is_set(ring.status(slot)), "{address_width} bits");
        host.assert_no_violation();
        assert_eq!(host.board.counts().doorbells, 1, "{address_width} bits");
    }
}

#[test]
fn reserved_offsets_read_0_ignore_writes_and_are_violations() {
    let dma = [0x20, 0x24, 0x2C, 0x50, 0x54, 0x5C, 0x60, 0xFFFC].map(|at| dma_base(1) + at);
    let control = [0x14, 0x7C, 0x158, 0x1AC, 0x1C4, 0x800, 0xFFC].map(|at| CONTROL_BASE + at);
    for address in dma.into_iter().chain(control) {
        let host = Host::lenient(BoardConfig::default());
        host.port.write32(address, u32::MAX);
        assert_eq!(host.port.read32(address), 0, "{address:#x}");
        let kind = ViolationKind::ReservedRegister { address };
        assert_eq!(host.violations(), [kind, kind]);
    }
}

#[test]
fn accesses_outside_the_regions_and_across_words_are_violations() {
    let host = Host::lenient(BoardConfig::default());
    for address in [0, 0x9FFF_FFFC, 0xA004_1000, 0xA005_0000, 0x1_A000_0000, u64::MAX - 3] {
        assert_eq!(host.port.read32(address), 0);
        assert_eq!(host.violations().last(), Some(&ViolationKind::UnmappedRegister { address }));
    }
    for address in [0xA000_0001, 0xA000_0002, 0xA004_0003, u64::MAX] {
        host.port.write32(address, 1);
        assert_eq!(host.violations().last(), Some(&ViolationKind::UnalignedRegister { address }));
    }
    assert_eq!(host.board.counts().violations, 10);
    assert_reset_values(&host, 0);
}

#[test]
fn a_strict_board_is_dead_after_its_first_violation() {
    let host = Host::new(BoardConfig::default());
    let _ = host.port.read32(dma_base(0) + 0x20);
    assert_eq!(host.port.read32(dma_base(0)), u32::MAX);
    assert_eq!(host.control(control::IDENTIFICATION), u32::MAX);
    host.write(0, Direction::Mm2s, DMACR, 0x4);
    assert_eq!(host.read(0, Direction::Mm2s, DMACR), u32::MAX, "not even a reset");
    let _ = host.port.read32(3);
    assert_eq!(host.violations(), [ViolationKind::ReservedRegister { address: 0xA000_0020 }]);
    let violation = host.board.violations().remove(0);
    let last = violation.accesses.last().expect("the access itself");
    assert_eq!((last.address, last.write, last.value), (0xA000_0020, false, 0));
    assert!(violation.to_string().contains("0x00a0000020"), "{violation}");
}

#[test]
fn a_lenient_board_counts_violations_and_keeps_the_first_64() {
    let host = Host::lenient(BoardConfig::default());
    for k in 0..100 {
        let _ = host.port.read32(4 * k);
    }
    assert_eq!(host.board.counts().violations, 100);
    let kinds = host.violations();
    assert_eq!(kinds.len(), 64);
    assert_eq!(kinds[63], ViolationKind::UnmappedRegister { address: 4 * 63 });
    assert_reset_values(&host, 0);
}

#[test]
fn a_register_access_takes_150_ns_and_nothing_else_passes_time() {
    let host = Host::new(BoardConfig::default());
    let start = host.port.now();
    for _ in 0..100 {
        let _ = host.status(0, Direction::Mm2s);
        host.write(0, Direction::Mm2s, DMASR, 0);
    }
    let took = host.port.now() - start;
    // Rounded up to clocks of 3.6 ns.
    assert!(took >= Duration::from_nanos(30_000), "{took:?}");
    assert!(took < Duration::from_nanos(30_800), "{took:?}");
    let start = host.port.now();
    let address = host.readable(&numbered(100));
    host.take(address);
    host.port.unmask_interrupt();
    assert_eq!(host.port.now(), start);
    let counts = host.board.counts();
    assert_eq!((counts.register_reads, counts.register_writes), (100, 100));
}

#[test]
fn time_can_run_to_its_end_without_harm() {
    let host = Host::new(BoardConfig::default());
    for _ in 0..3 {
        host.port.pause(Duration::MAX);
        assert_eq!(host.port.wait_interrupt(Duration::MAX), None);
        assert_eq!(host.read(0, Direction::Mm2s, DMACR), 0x0001_0002);
    }
    host.reset_all();
    assert_reset_values(&host, 0);
}

#[test]
fn misread_identity_is_impossible_on_a_live_board() {
    let host = Host::new(BoardConfig::default());
    assert_eq!(host.control(control::IDENTIFICATION), 0x5047_5331);
    assert_eq!(host.control(control::VERSION), 0x0002_0000);
    assert_eq!(host.control(control::PROFILE), 1);
    // Interlocked.
    assert_eq!(host.control(control::FEATURES), 0b1);
    assert_eq!(host.control(control::CHANNELS), 0x0404);
    // 16 bytes are 2^4.
    assert_eq!(host.control(control::MM2S_WIDTHS), 0x4444);
    assert_eq!(host.control(control::S2MM_WIDTHS), 0x4444);
    assert_eq!(host.control(control::ISSUE), 0x0001_0002);
    assert_eq!(host.control(control::CONTACT_DEPTH), (324 << 16) | 374);
    assert_eq!(host.control(control::FRICTION_DEPTH), (190 << 16) | 314);
    assert_eq!(host.control(control::CLOCK_KHZ), 275_000);
    assert_eq!(host.control(control::MEMORY_BYTES), 4 << 20);
    assert_eq!(host.control(control::MEMORY_PER_RECORD), (16 << 16) | 24);
    assert_eq!(host.control(control::DMA), (40 << 8) | 26);
    assert_eq!(host.control(control::NUMBERS), 0, "f32 throughout");
    for register in control::REGISTERS.iter().filter(|register| {
        (control::IDENTIFICATION.offset..=control::FENCE_SIZE.offset).contains(&register.offset)
    }) {
        let before = host.control(*register);
        host.set_control(*register, !before);
        assert_eq!(host.control(*register), before, "{} is read-only", register.name);
    }
    host.assert_no_violation();
}

#[test]
fn arguments_and_shapes_read_back_and_a_reset_clears_them() {
    let host = Host::new(BoardConfig::default());
    let arguments: Vec<_> = control::REGISTERS
        .iter()
        .filter(|register| (0x10..0x100).contains(&register.offset))
        .collect();
    assert_eq!(arguments.len(), 14);
    for register in &arguments {
        host.set_control(**register, 0x8000_0000 | register.offset);
    }
    host.port.write32(CONTROL_BASE + 0x400 + 63 * 16, 0x3F80_0000);
    host.port.write32(CONTROL_BASE + 0x404 + 63 * 16, 0x3EBC_3782);
    for register in &arguments {
        assert_eq!(host.control(**register), 0x8000_0000 | register.offset);
    }
    assert_eq!(host.port.read32(CONTROL_BASE + 0x400 + 63 * 16), 0x3F80_0000);
    assert_eq!(host.port.read32(CONTROL_BASE + 0x404 + 63 * 16), 0x3EBC_3782);
    host.set_control(control::RESET, 1);
    assert_eq!(host.control(control::RESET), 1, "a reset takes more than one read");
    assert_eq!(host.control(control::RESET), 1);
    host.pause(10);
    assert_eq!(host.control(control::RESET), 0);
    for register in &arguments {
        assert_eq!(host.control(**register), register.reset, "{}", register.name);
    }
    assert_eq!(host.port.read32(CONTROL_BASE + 0x404 + 63 * 16), 0);
    assert_eq!(host.control(control::AP_CTRL), 0x4, "idle");
    host.assert_no_violation();
}
