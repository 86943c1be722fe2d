//! A board with a quirk misbehaves in the way of its quirk, and in no other.

use std::time::Duration;

use crate::common::{BOTH, CORES, Host};
use bitstream_model::{BoardConfig, InterruptWiring, Quirks, Resettable};
use pgs_interface::axi_dma::{DMACR, LENGTH, dmacr};
use pgs_interface::control::{
    AP_CTRL, CLOCK_KHZ, DMA, GIE, IDENTIFICATION, IER, ISR, QUEUE, RESET, VERSION,
};

fn built_with(quirks: Quirks) -> Host {
    Host::new(BoardConfig { quirks, ..BoardConfig::default() })
}

#[test]
fn identification_version_and_queue_read_the_configured_values() {
    let host = built_with(Quirks {
        identification: 0x1234_5678,
        version: 0x0002_0003,
        queue: Some(7),
        ..Quirks::default()
    });
    assert_eq!(host.control(IDENTIFICATION), 0x1234_5678);
    assert_eq!(host.control(VERSION), 0x0002_0003);
    assert_eq!(host.control(QUEUE), 7);
    assert_eq!(host.control(CLOCK_KHZ), 275_000);
    host.assert_no_violation();
}

#[test]
fn the_length_registers_are_narrower_than_the_dma_register_says() {
    let host = built_with(Quirks { length_register: Some(14), ..Quirks::default() });
    assert_eq!(host.control(DMA), (40 << 8) | 26);
    for (core, way) in (0..CORES).flat_map(|core| BOTH.map(|way| (core, way))) {
        host.write(core, way, LENGTH, u32::MAX);
        assert_eq!(host.read(core, way, LENGTH), 0x3FFF, "dma{core} {way}");
    }
    host.assert_no_violation();
}

#[test]
fn a_length_register_of_no_bits_or_more_than_26_is_refused() {
    for width in [0, 27] {
        let quirks = Quirks { length_register: Some(width), ..Quirks::default() };
        let error =
            bitstream_model::EmulatedBoard::new(BoardConfig { quirks, ..BoardConfig::default() })
                .expect_err("out of range")
                .to_string();
        assert!(error.contains("true length register width"), "{error}");
    }
}

#[test]
fn a_held_reset_never_ends_and_holds_nothing_else() {
    let host = built_with(Quirks { held_reset: Some(Resettable::Dma(2)), ..Quirks::default() });
    let resetting = |core| BOTH.map(|way| dmacr::RESET.is_set(host.read(core, way, DMACR)));
    assert_eq!(resetting(2), [true; 2], "from power-up on");
    host.write(2, BOTH[0], DMACR, dmacr::RESET.mask());
    host.port.pause(Duration::from_secs(3600));
    assert_eq!(resetting(2), [true; 2]);
    for core in [0, 1, 3] {
        host.reset_dma(core);
    }
    host.reset_accelerator();

    let host =
        built_with(Quirks { held_reset: Some(Resettable::Accelerator), ..Quirks::default() });
    host.set_control(RESET, 1);
    host.port.pause(Duration::from_secs(3600));
    assert_eq!(host.control(RESET), 1);
    (0..CORES).for_each(|core| host.reset_dma(core));
    host.assert_no_violation();
}

#[test]
fn the_interrupt_comes_never_or_without_end() {
    let wait = |host: &Host| host.port.wait_interrupt(Duration::from_millis(1));
    for (interrupt, expected) in [
        (InterruptWiring::Connected, [None, Some(1), None]),
        (InterruptWiring::Disconnected, [None, None, None]),
        (InterruptWiring::StuckHigh, [Some(1), Some(2), Some(3)]),
    ] {
        let host = built_with(Quirks { interrupt, ..Quirks::default() });
        let quiet = wait(&host);
        host.port.unmask_interrupt();
        // A start with no bodies is refused at once: the sticky error, as an interrupt.
        host.set_control(GIE, 1);
        host.set_control(IER, 4);
        host.set_control(AP_CTRL, 1);
        let raised = wait(&host);
        host.set_control(ISR, 4);
        host.port.unmask_interrupt();
        assert_eq!([quiet, raised, wait(&host)], expected, "{interrupt:?}");
        host.assert_no_violation();
    }
}
