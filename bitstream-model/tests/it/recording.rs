//! A recording tells a step to the clock, and changes nothing of it.

use bitstream_model::recording::{
    ChannelRecording, PacketSpan, Port, PortState, Recording, Span, Stage,
};
use bitstream_model::{
    Bandwidth, BoardConfig, Counts, Delays, Direction, Fault, FaultKind, PacketCount, StepPhase,
    When,
};
use pgs_interface::profile::{FLOAT, HALF, NAIVE, Profile};

use crate::common::fast::{Visible, scene, visible};
use crate::common::microseconds;
use crate::common::packing::beats_out;
use crate::common::scene::Step;
use crate::common::sg::{Failure, Flight, LONG, Machine};

/// A step of a board of its own.
struct Taken {
    outcome: Result<Visible, Failure>,
    counts: Counts,
    packets: Vec<PacketCount>,
    recording: Option<Recording>,
}

fn take(config: BoardConfig, step: &Step, record: bool) -> Taken {
    let mut machine = Machine::new(config);
    // A step before it and one after it are not recorded.
    machine.step(step).expect("a step without a fault");
    if record {
        machine.host.board.record();
    }
    let outcome = machine.step(step).map(|outcome| visible(&outcome));
    let packets = machine.host.board.packets();
    let recording = machine.host.board.take_recording();
    machine.step(step).expect("a step without a fault");
    Taken { outcome, counts: machine.host.board.counts(), packets, recording }
}

fn recorded(config: BoardConfig, step: &Step) -> Taken {
    // Waits are exact by the reference alone.
    let config = BoardConfig { fast: false, ..config };
    let (bare, taken) = (take(config, step, false), take(config, step, true));
    assert_eq!(taken.outcome, bare.outcome);
    assert_eq!(taken.counts, bare.counts);
    assert_eq!(taken.packets, bare.packets);
    assert!(bare.recording.is_none());
    taken
}

/// A design with narrow streams.
static NARROW: Profile = Profile { mm2s_widths: &[128, 32, 64, 128], ..FLOAT };

fn small() -> Step {
    Step { iterations: [2, 3], ..scene(40, 90, 7, false) }
}

fn board(profile: &'static Profile, bandwidth: Bandwidth) -> BoardConfig {
    let delays = Delays { fifo_beats: 48, ..Delays::default() };
    BoardConfig { profile, bandwidth, delays, ..BoardConfig::default() }
}

/// Beats, and beats with TLAST, of a channel; its states follow one another.
fn beats_of(channel: &ChannelRecording, whole: Span) -> [u64; 2] {
    let mut sum = [0; 2];
    let mut at = whole.begin;
    for state in &channel.port {
        assert!(state.begin >= at, "{state:?} begins before {at}");
        at = state.end_of_beats();
        match state.port {
            Port::Moves { beats, last, .. } => {
                assert!(beats > 0);
                sum = [sum[0] + beats, sum[1] + u64::from(last)];
            }
            Port::Rests { valid, ready } => assert!(!(valid && ready), "that would be a beat"),
        }
    }
    assert!(at <= whole.end);
    sum
}

#[test]
fn a_recorded_step_is_the_step() {
    let designs = [&FLOAT, &HALF, &NAIVE];
    for profile in designs.into_iter().chain([&NARROW]) {
        for bandwidth in [Bandwidth::Unlimited, Bandwidth::BytesPerSecond(900_000_000)] {
            recorded(board(profile, bandwidth), &small());
        }
    }
}

#[test]
fn the_packets_have_the_beats_and_descriptors_that_the_board_counts() {
    for (profile, length_width) in [(&FLOAT, 26), (&FLOAT, 10), (&NARROW, 26)] {
        let config = BoardConfig { length_width, ..board(profile, Bandwidth::ZCU102_SUSTAINED) };
        let Taken { packets, recording, .. } = recorded(config, &small());
        let Recording { span, channels, .. } = recording.expect("it was recorded");
        for channel in &channels {
            let of_channel = |packet: &&PacketCount| {
                (packet.core, packet.direction) == (channel.core, channel.direction)
            };
            let counted: Vec<_> = packets
                .iter()
                .filter(of_channel)
                .map(|packet| (packet.phase, packet.beats, packet.descriptors))
                .collect();
            let found: Vec<_> = channel
                .packets
                .iter()
                .map(|packet| (packet.phase, packet.beats, packet.descriptors))
                .collect();
            assert_eq!(found, counted);
            let beats = counted.iter().map(|(_, beats, _)| beats).sum();
            assert_eq!(beats_of(channel, span), [beats, counted.len() as u64]);
            let descriptors: u32 = counted.iter().map(|(.., descriptors)| descriptors).sum();
            assert_eq!(channel.descriptors.len(), descriptors as usize);
            let bytes: u64 = channel.descriptors.iter().map(|one| one.bytes).sum();
            assert_eq!(bytes, 16 * beats);
            let ends = channel.packets.windows(2).all(|two| two[0].span.end <= two[1].span.begin);
            assert!(ends, "{:?}", channel.packets);
        }
    }
}

#[test]
fn the_stages_follow_one_another_and_share_the_counters() {
    let Taken { outcome, recording, .. } =
        recorded(board(&FLOAT, Bandwidth::ZCU102_SUSTAINED), &small());
    let (_, [cycles, stalls, waits, _, hazards], ..) = outcome.expect("no fault");
    let Recording { stages, waits: waited, .. } = recording.expect("it was recorded");
    let names: Vec<_> = stages.iter().map(|stage| stage.stage).collect();
    let passes = [Stage::Contact(1), Stage::Contact(2), Stage::Friction(1), Stage::Friction(2)];
    assert_eq!(names[0], Stage::Load);
    assert_eq!(names[1..5], passes);
    assert_eq!(names[5..], [Stage::Friction(3), Stage::Integrate]);
    assert!(stages.windows(2).all(|two| two[0].span.end == two[1].span.begin));
    let sum = |of: fn(&bitstream_model::recording::StageSpan) -> u64| -> u64 {
        stages.iter().map(of).sum()
    };
    assert_eq!(sum(|stage| stage.span.clocks()), cycles);
    assert_eq!(sum(|stage| stage.stalls), stalls);
    assert_eq!(sum(|stage| stage.hazards), hazards);
    assert_eq!(sum(|stage| stage.waits), waits);
    assert_eq!(waited.iter().map(|span| span.clocks()).sum::<u64>(), waits);
    // A collision takes a clock or more.
    assert!(stages[1..6].iter().all(|stage| stage.span.clocks() >= 90 && stage.stalls > 0));
}

#[test]
fn the_interrupt_rises_once_after_the_last_beat_and_the_accesses_are_all_there() {
    let config = board(&FLOAT, Bandwidth::Unlimited);
    let mut machine = Machine::new(config);
    let before = machine.host.board.counts();
    machine.host.board.record();
    machine.step(&small()).expect("no fault");
    let after = machine.host.board.counts();
    let last = machine.host.board.register_accesses();
    let recording = machine.host.board.take_recording().expect("it was recorded");
    assert_eq!(recording.span, Span { begin: before.cycles, end: after.cycles });
    let [reads, writes] = [false, true].map(|write| {
        recording.accesses.iter().filter(|access| access.write == write).count() as u64
    });
    assert_eq!(reads, after.register_reads - before.register_reads);
    assert_eq!(writes, after.register_writes - before.register_writes);
    assert_eq!(recording.doorbells.len() as u64, after.doorbells - before.doorbells);
    assert!(recording.accesses.ends_with(&last[last.len() - 20..]));
    assert!(!recording.interrupt.first);
    let rise = recording.interrupt.edges[0];
    let sends = recording.stages.last().expect("the integration");
    assert_eq!(sends.stage, Stage::Integrate);
    let results = recording.channels.iter().filter(|one| one.direction == Direction::S2mm);
    let end = results.flat_map(|one| &one.packets).map(|packet| packet.span.end).max();
    assert!(end.is_some_and(|end| end <= rise), "{end:?} {rise}");
    let results = recording.channels.iter().filter(|one| one.direction == Direction::S2mm);
    let begin = results.flat_map(|one| &one.packets).map(|packet| packet.span.begin).min();
    assert!(begin.is_some_and(|begin| sends.span.begin <= begin), "{begin:?} {sends:?}");
    assert_eq!(recording.interrupt.edges.len().div_ceil(2) as u64, after.interrupts);
}

#[test]
fn a_stream_without_room_shows_a_sender_that_waits() {
    let Taken { recording, .. } = recorded(board(&FLOAT, Bandwidth::Unlimited), &small());
    let channels = recording.expect("it was recorded").channels;
    let waits = |port: &Port| *port == Port::Rests { valid: true, ready: false };
    // Collisions with hazards take longer than their beats.
    assert!(channels[0].port.iter().any(|state| waits(&state.port)));
}

/// A machine that records; a step has failed on it, at beat 17 of the second contact pass on MM2S
/// 2.
fn failed() -> Machine {
    let config = BoardConfig { strict: false, ..board(&FLOAT, Bandwidth::Unlimited) };
    let mut machine = Machine::new(config);
    let fault = Fault::new(FaultKind::DmaDecErr).on(2, Direction::Mm2s);
    machine.host.board.inject(fault.in_phase(StepPhase::Contact(2)).when(When::Beat(17)));
    machine.host.board.record();
    machine.step(&small()).expect_err("the fault");
    machine
}

#[test]
fn a_step_that_fails_is_recorded_to_its_end() {
    let machine = failed();
    let recording = machine.host.board.take_recording().expect("it was recorded");
    let faulty = &recording.channels[2];
    assert_eq!(faulty.core, 2);
    let found: Vec<_> = faulty.packets.iter().map(|packet| (packet.phase, packet.ended)).collect();
    let phases = [StepPhase::Load, StepPhase::Contact(1), StepPhase::Contact(2)].map(Some);
    assert_eq!(found, phases.into_iter().zip([true, true, false]).collect::<Vec<_>>());
    assert_eq!(faulty.packets[2].beats, 17);
    let descriptor = faulty.descriptors.last().expect("three packets");
    assert_eq!((descriptor.ended, descriptor.bytes), (false, 17 * 16));
    let stages: Vec<_> = recording.stages.iter().map(|stage| (stage.stage, stage.ended)).collect();
    // The channel runs ahead of the accelerator.
    assert_eq!(stages, [(Stage::Load, true), (Stage::Contact(1), false)]);
    assert_packets_have_their_beats(&recording);
}

/// Asserts that the beats of the ports within each packet are the packet's, and that no packet
/// begins before the last one has ended.
fn assert_packets_have_their_beats(recording: &Recording) {
    for channel in &recording.channels {
        let mut at = recording.span.begin;
        for packet in &channel.packets {
            assert!(packet.span.begin >= at, "{packet:?} begins before {at}");
            at = packet.span.end;
            let beats = channel.port.iter().filter_map(|state| match state.port {
                Port::Moves { beats, .. } if state.begin >= packet.span.begin => {
                    (state.end_of_beats() <= packet.span.end).then_some(beats)
                }
                _ => None,
            });
            assert_eq!(beats.sum::<u64>(), packet.beats, "{packet:?}");
        }
        assert!(at <= recording.span.end);
    }
}

#[test]
fn a_step_after_one_that_fails_has_packets_of_its_own() {
    let mut machine = failed();
    let failed = machine.host.board.counts().cycles;
    machine.recover();
    let recovered = machine.host.board.counts().cycles;
    machine.step(&small()).expect("no other fault");
    let packets = machine.host.board.packets();
    let recording = machine.host.board.take_recording().expect("it was recorded");
    assert_packets_have_their_beats(&recording);
    for channel in &recording.channels {
        // Whatever the error left behind ends with the reset, on each channel.
        let later = |packet: &&PacketSpan| packet.span.begin >= recovered;
        let [before, after]: [Vec<_>; 2] =
            [false, true].map(|is| channel.packets.iter().filter(|one| later(one) == is).collect());
        assert!(before.iter().all(|packet| packet.span.end <= recovered), "{before:?}");
        let counted: Vec<_> = packets
            .iter()
            .filter(|one| (one.core, one.direction) == (channel.core, channel.direction))
            .map(|one| (one.phase, one.beats, one.descriptors, true))
            .collect();
        let found: Vec<_> =
            after.iter().map(|one| (one.phase, one.beats, one.descriptors, one.ended)).collect();
        assert_eq!(found, counted);
        // In the reset neither side is ready.
        let silent = Port::Rests { valid: false, ready: false };
        let in_reset = |state: &&PortState| (failed..recovered).contains(&state.begin);
        assert!(channel.port.iter().filter(in_reset).any(|state| state.port == silent));
    }
}

/// A recorded step; one that is recorded late has been under way for some time.
fn take_late(late: bool, step: &Step) -> Recording {
    let mut machine = Machine::new(board(&FLOAT, Bandwidth::ZCU102_SUSTAINED));
    machine.step(step).expect("a step without a fault");
    if !late {
        machine.host.board.record();
    }
    step.write_arguments(&machine.host);
    let variant = machine.host.variant();
    let mut flight = Flight::default();
    machine.arm(&mut flight, &beats_out(&variant, step, false));
    machine.start();
    machine.send(&mut flight, &step.packed(&variant));
    machine.host.port.pause(microseconds(3));
    if late {
        machine.host.board.record();
    }
    machine.wait(&flight, LONG).expect("no fault");
    assert!(machine.is_done());
    let recording = machine.host.board.take_recording().expect("it was recorded");
    machine.collect(&flight, step.bodies.len());
    recording
}

#[test]
fn a_recording_that_begins_within_a_step_has_the_clocks_of_the_whole() {
    let [whole, late] = [false, true].map(|late| take_late(late, &small()));
    let begin = late.span.begin;
    assert!(begin > whole.span.begin);
    assert_eq!(late.span.end, whole.span.end);
    let [first, others @ ..] = late.stages.as_slice() else { panic!("no stage") };
    let place = whole.stages.len() - late.stages.len();
    assert_eq!(*others, whole.stages[place + 1..]);
    assert!(place > 0, "the step was under way: {first:?}");
    let same = &whole.stages[place];
    assert_eq!((first.stage, first.span.end), (same.stage, same.span.end));
    assert!(first.span.begin >= begin && same.span.begin < begin, "{first:?} of {same:?}");
    for (late, whole) in late.channels.iter().zip(&whole.channels) {
        let later: Vec<_> =
            whole.packets.iter().filter(|one| one.span.begin >= begin).copied().collect();
        assert_eq!(late.packets, later);
    }
    let cut = |channel: &ChannelRecording| {
        channel.packets.iter().any(|one| one.span.begin < begin && one.span.end > begin)
    };
    assert!(whole.channels.iter().any(cut), "no packet was under way");
}

#[test]
fn the_stages_before_another_bitstream_stay_in_the_recording() {
    let config = BoardConfig { strict: false, ..board(&FLOAT, Bandwidth::Unlimited) };
    let mut machine = Machine::new(config);
    let fault = Fault::new(FaultKind::OtherBitstream { identification: 7 });
    let fault = fault.on(2, Direction::Mm2s).in_phase(StepPhase::Friction(3));
    machine.host.board.inject(fault.when(When::Beat(17)));
    machine.host.board.record();
    machine.step(&small()).expect_err("another bitstream");
    let recording = machine.host.board.take_recording().expect("it was recorded");
    let (last, others) = recording.stages.split_last().expect("stages");
    assert!(!last.ended, "{last:?}");
    assert_eq!(others.first().map(|stage| stage.stage), Some(Stage::Load));
    assert!(others.len() > 2 && others.iter().all(|stage| stage.ended), "{others:?}");
    let cut = recording.channels[2].packets.last().expect("packets");
    assert_eq!((cut.phase, cut.beats, cut.ended), (Some(StepPhase::Friction(3)), 17, false));
    assert_packets_have_their_beats(&recording);
}
