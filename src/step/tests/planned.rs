//! Tests the driver's reaction to faults that the emulated board has by configuration.

use std::time::Duration;

use bitstream_model::{Bandwidth, BoardConfig, FaultPlan};

use super::fault::{CUBES, fault_of, recovered};
use super::{bits, open, scene, step, undisturbed};
use crate::board::anomalies::Anomaly;
use crate::diagnosis::ChannelState;
use crate::{Error, StepParameters};

/// Each line names the fault, and the channel and the phase of the message.
#[test]
fn planned_faults_are_named_with_channel_and_phase() {
    let cases = [
        ("dma-int-err@dma1.mm2s,phase=load", "dma-internal-error", Some("dma1 MM2S"), "load"),
        ("dma-slv-err@dma2.mm2s,phase=contact3", "dma-slave-error", Some("dma2 MM2S"), "contact3"),
        ("dma-dec-err@dma0.s2mm,beat=7", "dma-decode-error", Some("dma0 S2MM"), "results"),
        (
            "sg-int-err@dma3.mm2s,phase=friction1",
            "sg-internal-error",
            Some("dma3 MM2S"),
            "friction1",
        ),
        ("sg-slv-err@dma1.s2mm", "sg-slave-error", Some("dma1 S2MM"), "results"),
        ("sg-dec-err@dma1.mm2s,phase=poses", "sg-decode-error", Some("dma1 MM2S"), "poses"),
        (
            "sg-dec-err-write@dma0.mm2s,phase=contact1",
            "sg-decode-error",
            Some("dma0 MM2S"),
            "contact1",
        ),
        ("bd-int-err@dma2.s2mm", "descriptor-internal-error", Some("dma2 S2MM"), "results"),
        ("bd-dec-err@dma2.mm2s,phase=load", "descriptor-decode-error", Some("dma2 MM2S"), "load"),
        ("short-packet@dma3.s2mm,beat=4", "short-packet", Some("dma3 S2MM"), "results"),
        ("long-packet@dma0.s2mm", "long-packet", Some("dma0 S2MM"), "results"),
        ("no-tlast@dma1.s2mm", "no-tlast", Some("dma1 S2MM"), "results"),
        ("no-tlast@dma3.s2mm", "no-tlast", Some("dma3 S2MM"), "results"),
        (
            "short-packet@dma2.mm2s,phase=load,beat=3",
            "accelerator-tlast-early",
            Some("dma2 MM2S"),
            "",
        ),
        ("no-tlast@dma1.mm2s,phase=poses", "accelerator-tlast-missing", Some("dma1 MM2S"), ""),
        ("corrupt=1@dma0.mm2s,phase=contact2", "checksum", None, ""),
        ("corrupt=1@dma0.s2mm", "checksum", None, ""),
        ("accelerator-hang", "deadline", None, ""),
        ("no-done", "no-done", None, ""),
        ("reloaded", "logic-reset", None, ""),
        ("reloaded@dma2.mm2s,phase=contact2,beat=9", "logic-reset", None, ""),
        ("reloaded@dma3.s2mm,beat=20", "logic-reset", None, ""),
        (
            "late-cmplted=900000000@dma2.s2mm",
            "descriptor-status-missing",
            Some("dma2 S2MM"),
            "results",
        ),
    ];
    for (line, name, channel, phase) in cases {
        let (board, mut accelerator) = open(BoardConfig::default());
        step(&mut accelerator, CUBES).0.expect("a good step");
        board.inject(line.parse::<FaultPlan>().expect(line));
        let error = step(&mut accelerator, CUBES).0.expect_err(line);
        assert_eq!(board.faults(), 1, "{line}");
        let fault = fault_of(&error);
        assert_eq!(fault.name(), name, "{line}: {fault}");
        let found = fault.channel().map(|channel| channel.to_string());
        assert_eq!(found.as_deref(), channel, "{line}: {fault}");
        if !phase.is_empty() {
            let diagnosis = error.diagnosis().expect("taken down");
            let named = |state: &&ChannelState| Some(state.channel) == fault.channel();
            let state = diagnosis.channels.iter().find(named).expect("it is there");
            assert_eq!(state.phase.name(), phase, "{line}: {fault}");
        }
        recovered(&mut accelerator, &error);
        assert_eq!(board.violations(), [], "{line}");
    }
}

#[test]
fn planned_anomalies_cost_no_step_and_are_told() {
    let cases = [
        ("irq-drop", Some(Anomaly::MissedInterrupt)),
        ("irq-spurious,access=10", Some(Anomaly::SpuriousInterrupt)),
        ("late-cmplted=400000@dma3.s2mm", Some(Anomaly::LateStatus)),
        ("slow=50@dma1.mm2s", None),
    ];
    for (line, anomaly) in cases {
        let (board, mut accelerator) = open(BoardConfig::default());
        step(&mut accelerator, CUBES).0.expect("a good step");
        board.inject(line.parse::<FaultPlan>().expect(line));
        let (result, bodies) = step(&mut accelerator, CUBES);
        result.expect(line);
        assert_eq!((bits(&bodies), board.faults()), (undisturbed(CUBES), 1), "{line}");
        for other in [Anomaly::MissedInterrupt, Anomaly::SpuriousInterrupt, Anomaly::LateStatus] {
            let told = accelerator.device.anomalies.told(other);
            assert_eq!(told, Some(other) == anomaly, "{line}: {other:?}");
        }
        assert_eq!(board.violations(), [], "{line}");
    }
}

#[test]
fn a_board_that_is_lost_is_not_touched_any_more() {
    for (line, name) in [
        ("power-lost@dma1.mm2s,phase=contact2", "gone"),
        ("stall@dma0.s2mm;reset-never@dma2", "deadline"),
        ("stall@dma0.s2mm;reset-never@accelerator", "deadline"),
    ] {
        let (board, mut accelerator) = open(BoardConfig::default());
        step(&mut accelerator, CUBES).0.expect("a good step");
        board.inject(line.parse::<FaultPlan>().expect(line));
        let (mut bodies, collisions) = scene(CUBES);
        let parameters = StepParameters { retries: 9, ..StepParameters::default() };
        let error = accelerator.step(&mut bodies, &collisions, &parameters).expect_err(line);
        assert_eq!(fault_of(&error).name(), name, "{line}: {error:?}");
        assert!(error.must_reopen(), "{line}");
        assert_eq!(bits(&bodies), bits(&scene(CUBES).0), "{line}");
        let before = board.counts();
        assert!(matches!(step(&mut accelerator, CUBES).0, Err(Error::MustReopen)), "{line}");
        drop(accelerator);
        let after = board.counts();
        assert_eq!(after.register_writes, before.register_writes, "{line}");
        assert_eq!(after.register_reads, before.register_reads, "{line}");
    }
}

/// The chain of a larger step needs a larger ring, and the channel must stop for it.
#[test]
fn a_channel_that_does_not_stop_for_its_new_ring_is_reset() {
    let config = BoardConfig { length_width: 8, ..BoardConfig::default() };
    let (board, mut accelerator) = open(config);
    step(&mut accelerator, 3).0.expect("a small step");
    board.inject("halt-never@dma1.mm2s".parse::<FaultPlan>().expect("a plan"));
    let (result, bodies) = step(&mut accelerator, 60);
    result.expect("reset, and no step lost");
    assert_eq!((bits(&bodies), board.faults()), (undisturbed(60), 1));
    assert!(accelerator.device.anomalies.told(Anomaly::NoHalt));
    drop(accelerator);
    assert_eq!(board.violations(), []);
}

/// The polling interval is twice the time of the step before, and 10 ms at least.
#[test]
fn an_interrupt_that_is_dropped_costs_at_most_one_polling_interval() {
    for bandwidth in [Bandwidth::ZCU102_SUSTAINED, Bandwidth::BytesPerSecond(20_000_000)] {
        let (board, mut accelerator) = open(BoardConfig { bandwidth, ..BoardConfig::default() });
        let port = board.cpu_port();
        let mut time_of = |fault: Option<&str>| {
            if let Some(line) = fault {
                board.inject(line.parse::<FaultPlan>().expect(line));
            }
            let before = port.now();
            let (result, bodies) = step(&mut accelerator, 300);
            result.expect("no failure");
            assert_eq!(bits(&bodies), undisturbed(300));
            port.now() - before
        };
        // The first step also starts the channels.
        time_of(None);
        let took = time_of(None);
        let dropped = time_of(Some("irq-drop"));
        assert_eq!(board.faults(), 1);
        let interval = (2 * took).max(Duration::from_millis(10));
        // The driver reads all registers once more.
        assert!(dropped > took && dropped < interval + Duration::from_micros(50), "{dropped:?}");
        assert!(time_of(None) < took + Duration::from_micros(50), "relied on again");
    }
}

/// The last channel is done late in the step, and another one later still: polling for the other
/// one has the deadline too.
#[test]
fn a_channel_that_is_slow_at_the_end_is_not_waited_for_beyond_the_deadline() {
    let (board, mut accelerator) = open(BoardConfig::default());
    step(&mut accelerator, CUBES).0.expect("a good step");
    let plan = "slow=8000@dma3.s2mm; slow=60000@dma0.s2mm";
    board.inject(plan.parse::<FaultPlan>().expect("a plan"));
    let deadline = Duration::from_millis(1);
    let parameters = StepParameters { deadline: Some(deadline), ..StepParameters::default() };
    let (mut bodies, collisions) = scene(CUBES);
    let error = accelerator.step(&mut bodies, &collisions, &parameters).expect_err("too slow");
    assert_eq!(board.faults(), 2);
    assert_eq!(fault_of(&error).name(), "deadline");
    let elapsed = error.diagnosis().expect("the board had a part in it").elapsed;
    assert!(elapsed >= deadline && elapsed < deadline + Duration::from_micros(100), "{elapsed:?}");
}
