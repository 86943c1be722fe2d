//! Tests that the driver reports the cause of a failed step, not its effects.

use std::sync::Arc;
use std::time::Duration;

use bitstream_model::{
    BoardConfig, Direction as Side, EmulatedBoard, Fault as Injected, FaultKind,
};
use pgs_interface::control::ErrorCode;

use super::tampered::{CONTROL_BLOCK, Tamper, Tampered};
use super::{bits, open, scene, step, undisturbed};
use crate::board::anomalies::Anomaly;
use crate::diagnosis::{ChannelFault, Direction, Phase};
use crate::error::Aftermath;
use crate::{Accelerator, Error, Fault, Shape, StepParameters, StepReport};

const DMASR: u32 = 0x04;
const S2MM: u32 = 0x30;
pub(crate) const CUBES: u32 = 20;

const RXEOF: u32 = 1 << 26;
const CMPLTED: u32 = 1 << 31;

/// The ring of descriptors of the S2MM channel of a core.
const fn receiver(core: usize) -> usize {
    2 * core + 1
}

/// The error of a failed step that stands between two good steps.
fn failed(tampered: &Arc<Tampered>, accelerator: &mut Accelerator) -> Error {
    let (result, bodies) = step(accelerator, CUBES);
    let error = result.expect_err("tampered with");
    assert_eq!(bits(&bodies), bits(&scene(CUBES).0), "the bodies are as they were");
    tampered.restore();
    error
}

pub(crate) fn recovered(accelerator: &mut Accelerator, error: &Error) {
    assert!(error.may_retry(), "{error}");
    let (result, bodies) = step(accelerator, CUBES);
    result.expect("the next step");
    assert_eq!(bits(&bodies), undisturbed(CUBES), "after {error}");
}

pub(crate) fn fault_of(error: &Error) -> &Fault {
    error.fault().expect("a step that failed")
}

#[test]
fn every_error_bit_of_a_channel_has_a_name() {
    let names = [
        (1 << 4, "dma-internal-error"),
        (1 << 5, "dma-slave-error"),
        (1 << 6, "dma-decode-error"),
        (1 << 8, "sg-internal-error"),
        (1 << 9, "sg-slave-error"),
        (1 << 10, "sg-decode-error"),
    ];
    for (bit, name) in names {
        for (direction, base) in [(Direction::Mm2s, 0), (Direction::S2mm, S2MM)] {
            let (_, tampered, mut accelerator) = Tampered::open();
            tampered.tamper(2, base + DMASR, Tamper::Set(bit));
            // A bit that is set from the start is found at the end of the step.
            let error = failed(&tampered, &mut accelerator);
            let fault = fault_of(&error);
            assert_eq!(fault.name(), name, "{fault}");
            let channel = fault.channel().expect("one channel");
            assert_eq!((channel.core, channel.direction), (2, direction));
            let diagnosis = error.diagnosis().expect("everything was taken down");
            let lines = diagnosis.registers();
            let shown = format!("{channel} DMASR = ");
            assert!(lines.iter().any(|line| line.starts_with(&shown)), "{lines:#?}");
            recovered(&mut accelerator, &error);
        }
    }
}

#[test]
fn a_descriptor_that_failed_behind_the_channels_back_is_named() {
    for (bit, name) in [
        (1 << 28, "descriptor-internal-error"),
        (1 << 29, "descriptor-slave-error"),
        (1 << 30, "descriptor-decode-error"),
    ] {
        let (_, tampered, mut accelerator) = Tampered::open();
        // The fifth descriptor of dma1 MM2S: the load, then the fourth contact pass.
        tampered.after_wait(move |rings| rings.change(2, 4, |status| status | bit));
        let error = failed(&tampered, &mut accelerator);
        let fault = fault_of(&error);
        assert_eq!(fault.name(), name, "{fault}");
        let text = fault.to_string();
        assert!(text.contains("dma1 MM2S in contact pass 4, descriptor 5 of 10"), "{text}");
        recovered(&mut accelerator, &error);
    }
}

#[test]
fn packets_that_are_too_short_too_long_or_without_an_end_are_told_apart() {
    let (_, tampered, mut accelerator) = Tampered::open();
    // 21 bodies are 84 beats of results, 21 a channel.
    tampered.after_wait(|rings| rings.change(receiver(3), 0, |status| status - 16));
    let error = failed(&tampered, &mut accelerator);
    let Fault::Channel { cause: ChannelFault::ShortPacket, at } = fault_of(&error) else {
        panic!("{error:?}")
    };
    assert_eq!((at.channel.core, at.bytes_moved, at.bytes_expected), (3, 320, 336));
    assert_eq!(at.phase, Phase::Results);
    recovered(&mut accelerator, &error);

    let (_, tampered, mut accelerator) = Tampered::open();
    tampered.after_wait(|rings| rings.change(receiver(1), 0, |status| status & !RXEOF));
    let error = failed(&tampered, &mut accelerator);
    assert!(matches!(
        fault_of(&error),
        Fault::Channel { cause: ChannelFault::NoPacketEnd, at } if at.channel.core == 1
    ));
    recovered(&mut accelerator, &error);

    let (_, tampered, mut accelerator) = Tampered::open();
    tampered.after_wait(|rings| rings.change(receiver(1), 0, |status| status & !RXEOF));
    // The board sent more than the buffers hold.
    tampered.tamper(1, S2MM + DMASR, Tamper::Set(1 << 4));
    let error = failed(&tampered, &mut accelerator);
    assert!(
        matches!(
            fault_of(&error),
            Fault::Channel { cause: ChannelFault::LongPacket, at } if at.channel.core == 1
        ),
        "{error:?}"
    );
    recovered(&mut accelerator, &error);
}

#[test]
fn a_status_that_never_reaches_memory_is_not_taken_for_a_channel_that_hangs() {
    let (_, tampered, mut accelerator) = Tampered::open();
    tampered.after_wait(|rings| rings.change(receiver(2), 0, |_| 0));
    let error = failed(&tampered, &mut accelerator);
    assert!(matches!(
        fault_of(&error),
        Fault::Channel { cause: ChannelFault::StatusMissing, at } if at.channel.core == 2
    ));
    recovered(&mut accelerator, &error);
}

#[test]
fn a_status_that_is_late_costs_no_step_and_is_told_once() {
    let (board, tampered, mut accelerator) = Tampered::open();
    step(&mut accelerator, CUBES).0.expect("a good step");
    assert!(!accelerator.device.anomalies.told(Anomaly::LateStatus));
    let mut looks = 0;
    let mut seen = 0;
    // The driver does not see the bit at its first look; at the third look the bit is back.
    tampered.after_wait(move |rings| {
        looks += 1;
        let hide = looks == 1;
        let found = std::cell::Cell::new(0);
        let back = seen;
        // The second step's descriptor is the ring's second.
        rings.change(receiver(3), 1, |status| {
            found.set(status);
            match looks {
                3 => back,
                _ if hide => 0,
                _ => status,
            }
        });
        if hide {
            seen = found.get();
            assert_ne!(seen & CMPLTED, 0, "the step was over");
        }
    });
    let (result, bodies) = step(&mut accelerator, CUBES);
    result.expect("only late");
    assert_eq!(bits(&bodies), undisturbed(CUBES));
    assert!(accelerator.device.anomalies.told(Anomaly::LateStatus));
    assert_eq!(board.violations(), []);
}

#[test]
fn an_accelerator_that_is_never_done_is_not_one_whose_results_are_late() {
    let (_, tampered, mut accelerator) = Tampered::open();
    tampered.tamper(CONTROL_BLOCK, 0, Tamper::Clear(2));
    let error = failed(&tampered, &mut accelerator);
    assert_eq!(fault_of(&error).name(), "no-done", "{error:?}");
    assert_eq!(error.diagnosis().expect("taken down").phase, Phase::Results);
    recovered(&mut accelerator, &error);
}

#[test]
fn a_channel_that_is_behind_the_others_is_named_at_the_deadline() {
    for (core, direction, side) in
        [(1, Side::S2mm, Direction::S2mm), (3, Side::S2mm, Direction::S2mm)]
    {
        let (board, _, mut accelerator) = Tampered::open();
        board.inject(Injected::new(FaultKind::Stall).on(core, direction));
        let error = step(&mut accelerator, CUBES).0.expect_err("a channel that stalls");
        let fault = fault_of(&error);
        let channel = fault.channel().expect("the channel that is behind");
        assert_eq!((fault.name(), channel.core, channel.direction), ("deadline", core, side));
    }
}

/// Cases of several errors at once, with the message for each.
#[test]
fn the_cause_is_told_and_not_what_follows_from_it() {
    const ERROR: u32 = 0x180;
    let sticky = Tamper::Value(ErrorCode::BodyIndex as u32);
    let named = |tamper: &dyn Fn(&Tampered)| {
        let (_, tampered, mut accelerator) = Tampered::open();
        tamper(&tampered);
        let error = failed(&tampered, &mut accelerator);
        fault_of(&error).name()
    };
    let stopped = |wires: &Tampered| wires.tamper(0, DMASR, Tamper::Set(1 << 5));
    let broken =
        |wires: &Tampered| wires.after_wait(|rings| rings.change(0, 1, |status| status | 1 << 30));
    let short =
        |wires: &Tampered| wires.after_wait(|rings| rings.change(1, 0, |status| status - 16));
    assert_eq!(
        named(&|wires| {
            wires.tamper(CONTROL_BLOCK, ERROR, sticky);
            broken(wires);
            stopped(wires);
        }),
        "dma-slave-error"
    );
    assert_eq!(
        named(&|wires| {
            wires.tamper(CONTROL_BLOCK, ERROR, sticky);
            broken(wires);
        }),
        "descriptor-decode-error"
    );
    assert_eq!(
        named(&|wires| {
            wires.tamper(CONTROL_BLOCK, ERROR, sticky);
            short(wires);
        }),
        "accelerator-body-index"
    );
    // Two channels: the earlier phase.
    assert_eq!(
        named(&|wires| {
            wires.tamper(0, S2MM + DMASR, Tamper::Set(1 << 4));
            wires.after_wait(|rings| rings.change(0, 9, |_| 0));
            stopped(wires);
        }),
        "dma-slave-error"
    );
}

#[test]
fn an_error_of_the_accelerator_names_the_stream_or_the_collision() {
    let (_, tampered, mut accelerator) = Tampered::open();
    tampered.tamper(CONTROL_BLOCK, 0x180, Tamper::Value(0x0203));
    tampered.tamper(CONTROL_BLOCK, 0x184, Tamper::Value(17));
    let error = failed(&tampered, &mut accelerator);
    let fault = fault_of(&error);
    assert_eq!(fault.name(), "accelerator-tlast-early");
    let text = fault.to_string();
    assert!(text.contains("on the stream of dma2 MM2S, beat 17 of the packet"), "{text}");
    recovered(&mut accelerator, &error);

    tampered.tamper(CONTROL_BLOCK, 0x180, Tamper::Value(ErrorCode::ContactCount as u32));
    tampered.tamper(CONTROL_BLOCK, 0x184, Tamper::Value(17));
    let error = failed(&tampered, &mut accelerator);
    let text = fault_of(&error).to_string();
    assert!(text.contains("collision 17 (sent as entry 17)"), "{text}");
    recovered(&mut accelerator, &error);

    tampered.tamper(CONTROL_BLOCK, 0x180, Tamper::Value(0xEE));
    let error = failed(&tampered, &mut accelerator);
    assert_eq!(fault_of(&error).name(), "accelerator-unknown");
}

#[test]
fn another_bitstream_is_found_at_the_fault_and_after_the_reset() {
    const IDENTIFICATION: u32 = 0x100;
    const NUMBERS: u32 = 0x144;
    for (at, value) in [(IDENTIFICATION, 0x1234_5678), (NUMBERS, 0x0111_1111)] {
        let (board, tampered, mut accelerator) = Tampered::open();
        step(&mut accelerator, CUBES).0.expect("a good step");
        board.inject(Injected::new(FaultKind::Stall).on(0, Side::Mm2s));
        tampered.tamper(CONTROL_BLOCK, at, Tamper::Value(value));
        let error = step(&mut accelerator, CUBES).0.expect_err("another bitstream");
        assert!(
            matches!(fault_of(&error), Fault::OtherBitstream { found, .. } if *found == value),
            "{error:?}"
        );
        assert!(error.must_reopen() && !error.may_retry());
        // The driver writes not even a reset to the other design.
        let before = board.counts().register_writes;
        assert!(matches!(step(&mut accelerator, CUBES).0, Err(Error::MustReopen)));
        drop(accelerator);
        assert_eq!(board.counts().register_writes, before);
    }
}

/// Where the channels were, the other design has nothing.
#[test]
fn another_bitstream_without_these_channels_is_not_a_board_that_is_gone() {
    let (_, tampered, mut accelerator) = Tampered::open();
    for core in 0..4 {
        tampered.tamper(core, DMASR, Tamper::Value(u32::MAX));
        tampered.tamper(core, S2MM + DMASR, Tamper::Value(u32::MAX));
    }
    tampered.tamper(CONTROL_BLOCK, 0x100, Tamper::Value(0x1234_5678));
    let error = failed(&tampered, &mut accelerator);
    assert!(error.must_reopen());
    // The channels did not start, and the driver found it when it read their registers again.
    assert_eq!(fault_of(&error).name(), "other-bitstream", "{error:?}");
}

#[test]
fn a_reset_that_never_ends_leaves_all_memory_to_the_engines() {
    for core in 0..4 {
        let (board, tampered, mut accelerator) = Tampered::open();
        step(&mut accelerator, CUBES).0.expect("a good step");
        // The check at the end reads the bit when the CPU owns all buffers again.
        tampered.tamper(core, 0, Tamper::Set(1 << 2));
        tampered.tamper(CONTROL_BLOCK, 0, Tamper::Clear(2));
        let error = step(&mut accelerator, CUBES).0.expect_err("never done");
        assert!(error.must_reopen(), "{error}");
        assert_eq!(fault_of(&error).name(), "no-done", "the error still names the cause");
        let reset = error.diagnosis().expect("taken down").reset.as_deref();
        let reset = reset.expect("why it failed").to_string();
        assert!(reset.contains(&format!("dma{core} MM2S")) && reset.contains("reset"), "{reset}");
        let released = tampered.wires().released.len();
        let again = accelerator.set_shapes(&[Shape::STATIC]).expect_err("given up");
        assert!(again.must_reopen() && again.to_string().contains("open it again"), "{again}");
        drop(accelerator);
        assert_eq!(tampered.wires().released.len(), released, "nothing is freed");
        assert_eq!(board.violations(), []);
    }
}

#[test]
fn memory_that_the_engines_left_is_freed() {
    let (_, tampered, mut accelerator) = Tampered::open();
    step(&mut accelerator, CUBES).0.expect("a good step");
    drop(accelerator);
    // A buffer and a ring for each of eight channels.
    assert_eq!(tampered.wires().released.len(), 16);
}

fn odd(cubes: u32, interrupts: u32) -> (Result<StepReport, Error>, Accelerator, Arc<Tampered>) {
    let (_, tampered, mut accelerator) = Tampered::open();
    step(&mut accelerator, cubes).0.expect("a good step");
    tampered.wires().storm = interrupts;
    let (result, bodies) = step(&mut accelerator, cubes);
    assert_eq!(bits(&bodies), undisturbed(cubes));
    (result, accelerator, tampered)
}

#[test]
fn interrupts_without_a_reason_cost_no_step_and_are_told_once() {
    let (result, accelerator, _) = odd(CUBES, 1);
    assert_eq!(result.expect("one spurious interrupt costs no step").interrupts, 2);
    let told = |accelerator: &Accelerator, anomaly| accelerator.device.anomalies.told(anomaly);
    assert!(told(&accelerator, Anomaly::SpuriousInterrupt));
    assert!(!told(&accelerator, Anomaly::InterruptStorm));

    // A step that takes longer than the storm survives it.
    let (result, mut accelerator, tampered) = odd(2_000, 10_000);
    let accesses = |report: StepReport| report.register_reads + report.register_writes;
    let during = accesses(result.expect("a storm costs no step"));
    assert!(told(&accelerator, Anomaly::InterruptStorm));
    assert!(!told(&accelerator, Anomaly::LateStatus));
    // Eight status registers and a few more at each interrupt, and no thousand of them.
    assert!(during < 1_000, "{during}");
    tampered.wires().storm = 0;
    let report = step(&mut accelerator, 2_000).0.expect("after the storm");
    assert_eq!((report.interrupts, accesses(report)), (1, 38));
}

#[test]
fn a_step_is_taken_again_if_it_may_be_and_gives_the_same_bits() {
    let (board, mut accelerator) = open(BoardConfig::default());
    let again = |accelerator: &mut Accelerator, retries| {
        let (mut bodies, collisions) = scene(CUBES);
        let parameters = StepParameters { retries, ..StepParameters::default() };
        let result = accelerator.step(&mut bodies, &collisions, &parameters);
        (result, bits(&bodies))
    };
    let fault = Injected::new(FaultKind::DmaDecErr).on(1, Side::Mm2s);
    assert_eq!(again(&mut accelerator, 3).0.expect("nothing happens").retries, 0);
    board.inject(fault);
    let before = board.counts();
    let (result, bodies) = again(&mut accelerator, 1);
    let (report, after) = (result.expect("taken again"), board.counts());
    assert_eq!(report.retries, 1);
    // The report counts both attempts, and the reset between them.
    assert_eq!(report.register_reads, after.register_reads - before.register_reads);
    assert_eq!(report.register_writes, after.register_writes - before.register_writes);
    assert!(report.register_reads + report.register_writes > 2 * 38);
    assert_eq!(bodies, undisturbed(CUBES));
    board.inject(fault);
    let (result, bodies) = again(&mut accelerator, 0);
    assert!(result.expect_err("off by default").may_retry());
    assert_eq!(bodies, bits(&scene(CUBES).0));
    drop(accelerator);
    assert_eq!(board.violations(), []);
}

#[test]
fn a_diagnosis_holds_the_last_accesses_and_every_channel() {
    let (board, mut accelerator) = open(BoardConfig::default());
    step(&mut accelerator, CUBES).0.expect("a good step");
    board.inject(Injected::new(FaultKind::DmaDecErr).on(2, Side::Mm2s));
    let error = step(&mut accelerator, CUBES).0.expect_err("a fault");
    assert!(matches!(&error, Error::Step { aftermath: Aftermath::Ready, .. }));
    let diagnosis = error.diagnosis().expect("taken down");
    assert_eq!(diagnosis.accesses.len(), 64);
    // The last access to the channel is the status read that showed the error, or its
    // acknowledgement.
    let accesses: Vec<_> = diagnosis.accesses.iter().map(ToString::to_string).collect();
    assert!(
        accesses.iter().any(|line| line.contains("dma2 MM2S DMASR") && line.contains("DMADecErr"))
    );
    assert!(accesses.iter().any(|line| line == "control AP_CTRL <- 0x00000001 ap_start"));
    let names: Vec<_> = diagnosis.channels.iter().map(|state| state.channel.to_string()).collect();
    assert_eq!(names[0], "dma0 S2MM");
    assert_eq!(names[7], "dma3 MM2S");
    assert!(diagnosis.elapsed < Duration::from_millis(15), "{:?}", diagnosis.elapsed);
    assert_eq!(diagnosis.channels[6].bytes_moved, 0);
    assert!(diagnosis.channels[6].bytes_expected > 0);
    assert_eq!(diagnosis.phase, Phase::Load);
}

/// Without a board there is no diagnosis.
#[test]
fn what_the_board_has_no_part_in_has_no_diagnosis() {
    let board = EmulatedBoard::new(BoardConfig::default()).expect("a board that can be built");
    let (_, mut accelerator) = open(board.config());
    let (mut bodies, collisions) = scene(4);
    bodies[3].velocity.linear = [3.0e38, -3.0e38, 3.0e38];
    bodies[3].velocity.angular = [3.0e38, 3.0e38, -3.0e38];
    let parameters = StepParameters { retries: 3, ..StepParameters::default() };
    let error = accelerator.step(&mut bodies, &collisions, &parameters).expect_err("beyond f32");
    assert_eq!(fault_of(&error).name(), "not-finite");
    assert!(error.diagnosis().is_none());
}
