//! Tests how a step waits: with late, missing or endless interrupts, with slow clocks and slow
//! callers, and the errors when a wait ends badly.

use std::time::Duration;

use bitstream_model::{BoardConfig, Direction as Side, Fault as Injected, FaultKind};
use pgs_interface::address_map::dma_base;
use pgs_interface::axi_dma::dmasr;

use super::fault::{CUBES, fault_of};
use super::tampered::{CONTROL_BLOCK, Tamper, Tampered};
use super::{bits, open, scene, step, undisturbed};
use crate::board::anomalies::Anomaly;
use crate::error::Aftermath;
use crate::{Cancellation, Error, InputError, StepParameters};

const DMASR: u32 = 0x04;
const S2MM: u32 = 0x30;

/// Parameters with a deadline that no step here reaches.
fn long_deadline() -> StepParameters {
    StepParameters { deadline: Some(Duration::from_secs(10)), ..StepParameters::default() }
}

#[test]
fn a_look_that_takes_its_time_is_not_a_status_that_is_late() {
    let (board, tampered, mut accelerator) = Tampered::open();
    tampered.wires().clock_read = Duration::from_micros(20);
    let (result, bodies) = step(&mut accelerator, CUBES);
    result.expect("only slow");
    assert_eq!(bits(&bodies), undisturbed(CUBES));
    assert!(!accelerator.device.anomalies.told(Anomaly::LateStatus));
    assert_eq!(board.violations(), []);
}

#[test]
fn a_platform_without_an_interrupt_lets_the_driver_look_though_it_may_be_cancelled() {
    for cancellation in [None, Some(Cancellation::new())] {
        let (board, tampered, mut accelerator) = Tampered::open();
        if let Some(cancellation) = cancellation {
            accelerator.set_cancellation(cancellation);
        }
        tampered.wires().wait_limit = Some(Duration::from_millis(1));
        let before = board.cpu_port().now();
        let (mut bodies, collisions) = scene(CUBES);
        accelerator.step(&mut bodies, &collisions, &long_deadline()).expect("found by looking");
        let took = board.cpu_port().now() - before;
        assert!(took < Duration::from_millis(2), "{took:?}");
    }
}

#[test]
fn what_the_caller_does_meanwhile_is_not_what_a_step_takes() {
    let (board, mut accelerator) = open(BoardConfig::default());
    let (mut bodies, collisions) = scene(CUBES);
    let flight = accelerator.submit(&bodies, &collisions, &long_deadline()).expect("it starts");
    board.cpu_port().pause(Duration::from_secs(1));
    flight.wait(&mut bodies).expect("long over");

    board.inject(Injected::new(FaultKind::IrqDrop));
    let before = board.cpu_port().now();
    let (mut bodies, collisions) = scene(CUBES);
    accelerator.step(&mut bodies, &collisions, &long_deadline()).expect("found by looking");
    let took = board.cpu_port().now() - before;
    assert!(accelerator.device.anomalies.told(Anomaly::MissedInterrupt));
    assert!(took < Duration::from_millis(12), "{took:?}");
}

/// The step becomes complete between the driver's reads of registers and of descriptors.
#[test]
fn a_completion_that_was_not_seen_is_not_left_to_the_next_step() {
    let (board, tampered, mut accelerator) = Tampered::open();
    step(&mut accelerator, CUBES).0.expect("a good step");
    board.inject(Injected::new(FaultKind::IrqDrop));
    tampered.tamper(3, S2MM + DMASR, Tamper::ClearOnce(dmasr::IOC_IRQ.mask()));
    step(&mut accelerator, CUBES).0.expect("found by looking");
    let status = board.cpu_port().read32(dma_base(3) + u64::from(S2MM + DMASR));
    assert_eq!(status & dmasr::IOC_IRQ.mask(), 0, "{status:#x}");
    let report = step(&mut accelerator, CUBES).0.expect("the next step");
    assert_eq!((report.interrupts, report.register_reads + report.register_writes), (1, 38));
    assert!(!accelerator.device.anomalies.told(Anomaly::SpuriousInterrupt));
    assert_eq!(board.violations(), []);
}

/// The interrupt bits of the channels stay set, as the error interrupt of a channel does until its
/// reset.
#[test]
fn interrupts_that_end_nothing_are_a_storm_though_a_channel_asks_for_them() {
    let (board, tampered, mut accelerator) = Tampered::open();
    step(&mut accelerator, CUBES).0.expect("a good step");
    board.inject(Injected::new(FaultKind::Stall).on(0, Side::Mm2s));
    tampered.wires().storm = u32::MAX;
    tampered.tamper(3, S2MM + DMASR, Tamper::Set(dmasr::IOC_IRQ.mask()));
    let (mut bodies, collisions) = scene(CUBES);
    let deadline = Some(Duration::from_millis(100));
    let parameters = StepParameters { deadline, ..StepParameters::default() };
    let error = accelerator.step(&mut bodies, &collisions, &parameters).expect_err("it stalls");
    assert_eq!(fault_of(&error).name(), "deadline");
    assert!(accelerator.device.anomalies.told(Anomaly::InterruptStorm));
    // The driver takes one more after the reset.
    let taken = u32::MAX - tampered.wires().storm;
    assert!((16..=17).contains(&taken), "{taken}");
}

#[test]
fn other_bodies_on_a_board_that_cannot_be_stopped_must_reopen() {
    for (stops, core) in [(true, 0), (false, 0), (false, 3)] {
        let (_, tampered, mut accelerator) = Tampered::open();
        let (bodies, collisions) = scene(CUBES);
        let flight = accelerator
            .submit(&bodies, &collisions, &StepParameters::default())
            .expect("it starts");
        if !stops {
            // A reset that never ends.
            tampered.tamper(core, 0, Tamper::Set(1 << 2));
        }
        let (mut other, _) = scene(CUBES + 1);
        let error = flight.wait(&mut other).expect_err("one body more");
        match error {
            Error::Input(InputError::OtherBodies { .. }) => assert!(stops),
            Error::MustReopen => assert!(!stops),
            error => panic!("{error}"),
        }
    }
}

#[test]
fn why_a_cancelled_step_could_not_be_stopped_is_told() {
    let (board, tampered, mut accelerator) = Tampered::open();
    let cancellation = Cancellation::new();
    accelerator.set_cancellation(cancellation.clone());
    let (mut bodies, collisions) = scene(CUBES);
    let flight =
        accelerator.submit(&bodies, &collisions, &StepParameters::default()).expect("it starts");
    tampered.tamper(2, 0, Tamper::Set(1 << 2));
    cancellation.cancel();
    let error = flight.wait(&mut bodies).expect_err("cancelled");
    assert_eq!(fault_of(&error).name(), "cancelled");
    assert!(error.must_reopen(), "{error}");
    let reset = error.diagnosis().and_then(|diagnosis| diagnosis.reset.as_deref());
    let reset = reset.expect("why it failed").to_string();
    assert!(reset.contains("dma2 MM2S") && reset.contains("reset"), "{reset}");
    assert_eq!(board.violations(), []);
}

#[test]
fn a_step_without_bodies_is_cancelled_too() {
    let (board, mut accelerator) = open(BoardConfig::default());
    let cancellation = Cancellation::new();
    accelerator.set_cancellation(cancellation.clone());
    let (mut bodies, collisions): (Vec<crate::Body>, Vec<crate::Collision>) =
        (Vec::new(), Vec::new());
    let mut step = || accelerator.step(&mut bodies, &collisions, &StepParameters::default());
    assert_eq!(step().expect("a step without work").doorbells, 0);
    cancellation.cancel();
    let error = step().expect_err("cancelled");
    assert_eq!(fault_of(&error).name(), "cancelled");
    assert!(matches!(error, Error::Step { aftermath: Aftermath::Untouched, .. }), "{error}");
    assert_eq!(board.violations(), []);
}

#[test]
fn a_board_that_is_gone_before_a_larger_step_did_not_fail_to_stop() {
    let (_, tampered, mut accelerator) = Tampered::open();
    step(&mut accelerator, CUBES).0.expect("a good step");
    accelerator.device.largest = 64;
    for core in 0..4 {
        for base in [0, S2MM] {
            tampered.tamper(core, base + DMASR, Tamper::Value(u32::MAX));
        }
    }
    tampered.tamper(CONTROL_BLOCK, 0x100, Tamper::Value(u32::MAX));
    let error = step(&mut accelerator, CUBES).0.expect_err("nothing answers");
    assert_eq!(fault_of(&error).name(), "gone");
    assert!(error.must_reopen(), "{error}");
    assert!(!accelerator.device.anomalies.told(Anomaly::NoHalt));
}

#[test]
fn a_diagnosis_shows_the_registers_that_were_read_and_no_others() {
    for (address_width, wide) in [(40, true), (32, false)] {
        let config = BoardConfig { address_width, ..BoardConfig::default() };
        let (board, mut accelerator) = open(config);
        board.inject(Injected::new(FaultKind::DmaDecErr).on(2, Side::Mm2s));
        let error = step(&mut accelerator, CUBES).0.expect_err("a fault");
        let diagnosis = error.diagnosis().expect("taken down");
        let lines = diagnosis.registers();
        // Rings lie on both sides of 4 GiB.
        let above = diagnosis.channels.iter().filter(|state| state.tail >> 32 == 8);
        assert_eq!(above.clone().count(), if wide { 4 } else { 0 });
        for state in above {
            let ring = state.tail & !0xFFFF;
            assert_eq!((state.current & !0xFFFF, ring >> 32), (ring, 8));
            for (name, address) in [("CURDESC", state.current), ("TAILDESC", state.tail)] {
                for (half, value) in [("", address & 0xFFFF_FFFF), ("_MSB", address >> 32)] {
                    let line = format!("{} {name}{half} = {value:#010x}", state.channel);
                    assert!(lines.contains(&line), "{line}: {lines:#?}");
                }
            }
        }
        let of = |name: &str| lines.iter().filter(|line| line.contains(name)).count();
        assert_eq!((of("DMACR"), of("DMASR"), of(" CURDESC = "), of(" TAILDESC = ")), (8, 8, 8, 8));
        let upper = if wide { 8 } else { 0 };
        assert_eq!((of("CURDESC_MSB"), of("TAILDESC_MSB")), (upper, upper), "{lines:#?}");
    }

    let (_, tampered, mut accelerator) = Tampered::open();
    step(&mut accelerator, CUBES).0.expect("a good step");
    tampered.tamper(1, S2MM + DMASR, Tamper::Value(u32::MAX));
    let error = step(&mut accelerator, CUBES).0.expect_err("a channel that is gone");
    let lines = error.diagnosis().expect("taken down").registers();
    let gone: Vec<_> = lines.iter().filter(|line| line.starts_with("dma1 S2MM")).collect();
    assert!(gone.len() == 1 && gone[0].contains("DMASR = 0xffffffff"), "{gone:?}");
}
