//! Impulses come in and go out with short cuts as without: a pass brings the same collisions from other
//! buffers, and impulses leave in the middle of a pass.

use std::cell::Cell;

use bitstream_model::{BoardConfig, DeviceAccess, FaultPlan};
use pgs_interface::profile::{FLOAT, Inertia};
use pgs_interface::record::Beat;
use proptest::prelude::*;

use crate::common::scene::{Lane, Step};
use crate::common::sg::{LONG, Machine};
use crate::common::shortcuts::{
    Seen, begin_once, extended, large, same, scatter, scene, whole_length,
};

/// The stream with the impulses, and the beats of a collision on it.
const STREAM: usize = 3;
const BEATS: usize = 2;
/// The segments of collisions with their normal impulses, and with their friction impulses.
const WARM: [usize; 2] = [3, 4];

/// A step with a warm start, whose impulses go out.
fn warm(step: Step) -> Step {
    extended(step, 0b1111, 7, &FLOAT)
}

fn config(inertia: Inertia) -> BoardConfig {
    BoardConfig { inertia, ..whole_length() }
}

fn lanes(config: BoardConfig, step: &Step) -> Vec<Lane> {
    step.packed(&config.variant())
}

thread_local! {
    /// How often a board that this thread runs has gone the long way for the rest of a step.
    static LONG_WAYS: Cell<u32> = const { Cell::new(0) };
}

/// Counts the messages of boards that go the long way for the rest of a step.
struct Counter;

impl log::Log for Counter {
    fn enabled(&self, metadata: &log::Metadata<'_>) -> bool {
        metadata.target().ends_with("deferred::passes")
    }

    fn log(&self, record: &log::Record<'_>) {
        let counts = self.enabled(record.metadata());
        if counts && record.args().to_string().contains("brings other beats") {
            LONG_WAYS.set(LONG_WAYS.get() + 1);
        }
    }

    fn flush(&self) {}
}

#[test]
fn steps_with_impulses_take_the_short_cuts_to_their_end() {
    log::set_logger(&Counter).expect("no other test has a logger");
    log::set_max_level(log::LevelFilter::Debug);
    for (extensions, inertia) in
        (0..16).flat_map(|bits| [Inertia::Isotropic, Inertia::World].map(|of| (bits, of)))
    {
        let step = extended(large(), extensions, 7, &FLOAT);
        for length_width in [14, 26] {
            let mut machine = Machine::new(BoardConfig { length_width, ..config(inertia) });
            for _ in 0..2 {
                machine.step(&step).expect("no fault");
            }
            assert_eq!(LONG_WAYS.get(), 0, "{extensions:b} {inertia:?} {length_width}");
        }
    }
    // And a step that cannot.
    let step = warm(large());
    let mut changed = lanes(config(Inertia::World), &step);
    changed[STREAM].segments[WARM[1]][0].0[1] ^= 1;
    let mut machine = Machine::new(config(Inertia::World));
    machine.step_with(&step, &changed).expect("no fault");
    assert_eq!(LONG_WAYS.get(), 1);
}

fn outcome(seen: &Seen) -> (Vec<[[u32; 4]; 4]>, Vec<Beat>) {
    let (bodies, _, _, impulses) = seen.steps[0].clone().expect("no fault");
    (bodies, impulses)
}

#[test]
fn contact_points_that_come_with_impulses_are_compared_with_the_others() {
    let step = warm(large());
    let config = config(Inertia::World);
    let usual = same(config, None, 2, |machine| machine.step(&step));
    for segment in WARM {
        for collision in [0, 1, 401, 799] {
            let mut changed = lanes(config, &step);
            changed[STREAM].segments[segment][BEATS * collision].0[1] ^= 0x0040_0000;
            let seen = same(config, None, 2, |machine| machine.step_with(&step, &changed));
            assert_ne!(outcome(&seen), outcome(&usual), "{segment} {collision}");
        }
        // The points of a collision without contacts count in the sum alone.
        let empty = step.collisions.iter().position(|of| of.count == 0).expect("some are empty");
        let mut changed = lanes(config, &step);
        changed[STREAM].segments[segment][BEATS * empty].0[1] ^= 0x0040_0000;
        let seen = same(config, None, 2, |machine| machine.step_with(&step, &changed));
        assert_eq!(outcome(&seen), outcome(&usual), "{segment} {empty}");
        assert_ne!(seen.steps, usual.steps, "{segment} {empty}");
    }
}

#[test]
fn a_corrupt_beat_of_a_pass_with_impulses_is_noticed() {
    let step = warm(large());
    let config = config(Inertia::World);
    let usual = same(config, None, 1, |machine| machine.step(&step));
    // The first pass of each kind brings impulses, and with the fifth some go out.
    for (phase, beat) in ["contact1", "contact2", "contact5", "friction1", "friction2", "friction5"]
        .into_iter()
        .flat_map(|phase| [0, 401, 500].map(|beat| (phase, beat)))
    {
        let plan = format!("corrupt=0x00700000@dma3.mm2s,phase={phase},beat={beat}");
        let plan: FaultPlan = plan.parse().expect("a plan");
        let seen = same(config, Some(&plan), 1, |machine| machine.step(&step));
        assert_eq!(seen.faults, 1, "{phase} {beat}");
        assert_ne!(seen.steps, usual.steps, "{phase} {beat}");
    }
}

/// Begins a step, and after a pause lets the buffer of stream 3 with that number change hands, `change`d.
fn changing(
    config: BoardConfig,
    step: &Step,
    (buffer, pause): (usize, u64),
    change: impl Fn(&mut [Beat]),
) -> Seen {
    same(config, None, 1, |machine: &mut Machine| {
        let flight = begin_once(machine, step);
        machine.host.pause(pause);
        // Streams 0 to 2 have three buffers each, and stream 3 five.
        let address = flight.inputs()[3 * STREAM + buffer];
        let mut beats = machine.host.take(address);
        change(&mut beats);
        let port = &machine.host.port;
        port.hand_over(address, beats, DeviceAccess::Read).expect("the CPU owns it");
        machine.wait(&flight, LONG)?;
        Ok(machine.collect(&flight, step.bodies.len()))
    })
}

#[test]
fn a_buffer_that_changes_hands_in_the_middle_of_a_pass_with_impulses_is_noticed() {
    let step = warm(large());
    // A pass takes some 2000 cycles of 3.6 ns.
    for pause in [2, 3, 5, 8, 11, 14, 21, 30, 33, 36, 38, 40, 41, 44, 50, 60, 70, 74, 78] {
        for buffer in [1, WARM[0], WARM[1]] {
            let config = config(Inertia::Isotropic);
            let point = |beat: &mut Beat| beat.0[1] = 0.75_f32.to_bits();
            let seen = changing(config, &step, (buffer, pause), |beats| {
                beats.iter_mut().step_by(BEATS).take(400).for_each(point);
            });
            assert!(seen.steps[0].is_ok(), "{buffer} {pause}");
        }
    }
}

#[test]
fn room_for_impulses_that_changes_hands_or_ends_is_noticed() {
    let step = warm(large());
    let config = config(Inertia::World);
    for pause in [5, 30, 36, 38, 40, 42, 74, 76, 78, 80] {
        for gone in [false, true] {
            same(config, None, 1, |machine| {
                let flight = begin_once(machine, &step);
                machine.host.pause(pause);
                let address = flight.outputs()[0];
                let beats = machine.host.take(address);
                if !gone {
                    let port = &machine.host.port;
                    port.hand_over_first(address, beats, 1100, DeviceAccess::Write)
                        .expect("the CPU owns it");
                }
                machine.wait(&flight, LONG)?;
                Ok(machine.collect(&flight, step.bodies.len()))
            });
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn a_host_that_looks_sees_impulses_come_and_go_at_the_same_time(
        (bodies, collisions, seed, apart) in (9..400_u32, 1..1500_u32, any::<u64>(), any::<bool>()),
        iterations in prop::sample::select(&[[4, 4], [1, 2], [0, 3], [2, 0], [1, 1]][..]),
        extensions in 1..8_u8,
        world in any::<bool>(),
        fifo_beats in prop::sample::select(&[16_usize, 64, 512][..]),
        pauses in prop::collection::vec(1..30_000_u64, 0..6),
    ) {
        let step = extended(scene(bodies, collisions, seed, apart), extensions, seed, &FLOAT);
        let step = Step { iterations, ..step };
        let mut config = config(if world { Inertia::World } else { Inertia::Isotropic });
        config.delays.fifo_beats = fifo_beats;
        // Pieces that end in the middle of a collision, at times.
        config.length_width = [14, 15, 26][(scatter(seed, 1) % 3) as usize];
        same(config, None, 2, |machine| {
            let flight = begin_once(machine, &step);
            for nanoseconds in &pauses {
                machine.host.port.pause(std::time::Duration::from_nanos(*nanoseconds));
                machine.host.status(0, bitstream_model::Direction::S2mm);
            }
            machine.wait(&flight, 40 * LONG)?;
            Ok(machine.collect(&flight, step.bodies.len()))
        });
    }
}
