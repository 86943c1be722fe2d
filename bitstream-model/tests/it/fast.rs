//! A step that the board takes at once has the results, sums, hazards and stalls of the reference,
//! and its waits within slices.

use std::cell::Cell;

use bitstream_model::{Bandwidth, BoardConfig, Delays, FaultPlan};
use pgs_interface::profile::{FLOAT, HALF, Inertia, NAIVE, Profile};
use proptest::prelude::*;

use crate::common::fast::{PROFILES, SLOTS, Tolerance, below, extended, same, scene, visible};
use crate::common::scene::Step;
use crate::common::sg::{LONG, Machine};

thread_local! {
    /// Steps that boards of this thread have taken at once.
    static AT_ONCE: Cell<u32> = const { Cell::new(0) };
    /// Steps with a subnormal number.
    static SUBNORMAL: Cell<u32> = const { Cell::new(0) };
}

/// Counts the messages of boards about steps taken at once.
struct Counter;

impl log::Log for Counter {
    fn enabled(&self, metadata: &log::Metadata<'_>) -> bool {
        metadata.target().ends_with("::fast")
    }

    fn log(&self, record: &log::Record<'_>) {
        if self.enabled(record.metadata()) {
            let text = record.args().to_string();
            let of = if text.contains("subnormal") { &SUBNORMAL } else { &AT_ONCE };
            of.set(of.get() + 1);
        }
    }

    fn flush(&self) {}
}

/// Runs something; returns how many steps were taken at once in it, and how many had a subnormal
/// number.
fn counted(run: impl FnOnce()) -> [u32; 2] {
    // Another test of this program may have set it before.
    let _ = log::set_logger(&Counter);
    log::set_max_level(log::LevelFilter::Debug);
    AT_ONCE.set(0);
    SUBNORMAL.set(0);
    run();
    [AT_ONCE.get(), SUBNORMAL.get()]
}

/// Cycles by which the waits may differ: a slice for each pass and each phase of the bodies, and
/// where the memory limits the board the time in which it fills the FIFOs once.
fn tolerance(config: &BoardConfig, passes: u32) -> Tolerance {
    let slices = 64 * u64::from(passes + 3);
    let beats = config.delays.fifo_beats * config.profile.mm2s_widths.len();
    match config.bandwidth {
        Bandwidth::Unlimited if config.delays.fifo_beats >= 512 => Tolerance::Exact { slices },
        Bandwidth::Unlimited => Tolerance::Limited { slices: slices + beats as u64 },
        Bandwidth::BytesPerSecond(bytes) => {
            let fill = 16 * beats as u64 * u64::from(config.profile.clock_khz) / (bytes / 1000);
            Tolerance::Limited { slices: slices + fill }
        }
    }
}

fn config() -> impl Strategy<Value = BoardConfig> {
    (
        prop_oneof![4 => Just(PROFILES[0]), 2 => Just(PROFILES[1]), 1 => Just(PROFILES[2])],
        prop::sample::select(&[48_usize, 512][..]),
        prop::sample::select(&[14_u32, 26][..]),
        prop::sample::select(
            &[
                Bandwidth::Unlimited,
                Bandwidth::ZCU102_SUSTAINED,
                Bandwidth::BytesPerSecond(7_123_456_789),
                Bandwidth::BytesPerSecond(900_000_000),
            ][..],
        ),
        prop::option::of(prop::sample::select(&[1_u32, 3, 20, 600][..])),
        prop::sample::select(&[Inertia::Isotropic, Inertia::World][..]),
        prop::sample::select(&[0_u32, 1, 2, 7, 64, 256][..]),
    )
        .prop_map(
            |(profile, fifo_beats, length_width, bandwidth, window_slots, inertia, queue)| {
                let usual = board(profile, fifo_beats);
                let inertia = profile.world.map_or(Inertia::Isotropic, |_| inertia);
                let queue = profile.queue.map(|_| queue);
                BoardConfig { length_width, bandwidth, window_slots, inertia, queue, ..usual }
            },
        )
}

/// A board that goes on after a violation.
fn board(profile: &'static Profile, fifo_beats: usize) -> BoardConfig {
    BoardConfig {
        profile,
        strict: false,
        delays: Delays { fifo_beats, ..Delays::default() },
        ..BoardConfig::default()
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(120))]

    #[test]
    fn a_step_is_the_same_by_the_fast_way_and_by_the_reference(
        config in config(),
        (bodies, collisions, seed, apart) in (9..400_u32, 0..900_u32, any::<u64>(), any::<bool>()),
        iterations in prop::sample::select(&[[4, 4], [1, 2], [0, 3], [2, 0], [1, 1]][..]),
        (integrate, in_order, extensions) in
            (prop::bool::weighted(0.8), prop::bool::weighted(0.2), 0..16_u8),
        spoilt in prop::option::weighted(0.2, (any::<u64>(), 0..5_u32)),
    ) {
        let step = Step { integrate, in_order, ..scene(bodies, collisions, seed, apart) };
        let mut step = extended(step, extensions, seed, config.profile);
        step.iterations = iterations;
        if let Some((at, how)) = spoilt.filter(|_| collisions > 0) {
            let collision = &mut step.collisions[below(at, collisions) as usize];
            match how {
                0 => collision.count = 5,
                1 => collision.bodies[1] = bodies,
                2 => collision.bodies[1] = collision.bodies[0],
                3 => collision.bodies = [0, 8],
                _ => collision.count = config.profile.numbers.collisions.largest_index(),
            }
        }
        let passes = iterations[0] + iterations[1] + 2;
        let tolerance = match tolerance(&config, passes) {
            Tolerance::Limited { slices } if step.is_queued(&config) => Tolerance::Queued { slices },
            tolerance => tolerance,
        };
        same(config, 2, tolerance, |machine| machine.step(&step));
    }
}

#[test]
fn a_host_that_waits_for_a_whole_step_has_it_taken_at_once() {
    for (profile, inertia) in PROFILES
        .iter()
        .flat_map(|profile| profile.inertias().iter().map(|inertia| (*profile, *inertia)))
    {
        let queue = profile.queue.map(|_| 64);
        for extensions in 0..16 {
            let step = extended(scene(400, 800, 7, true), extensions, 7, profile);
            for length_width in [14, 26] {
                let config = BoardConfig { length_width, inertia, queue, ..board(profile, 512) };
                let found = counted(|| {
                    let mut machine = Machine::with_slots(config, SLOTS);
                    for _ in 0..2 {
                        machine.step(&step).unwrap_or_else(|e| {
                            panic!("{} {inertia:?} {extensions:04b}: {e:?}", profile.name)
                        });
                    }
                });
                let case = format!("{} {inertia:?} {extensions:04b} {length_width}", profile.name);
                assert_eq!(found, [2, 0], "{case}");
            }
        }
    }
}

/// While the queue of a pass empties, the next pass's beats come as far as the FIFOs hold them: 512
/// cycles of eight passes are more than the tolerance.
#[test]
fn a_pass_that_the_memory_limits_empties_its_queue_during_the_next_transfer() {
    let step = Step::on_ground(3000, 6000);
    for bandwidth in [Bandwidth::ZCU102_SUSTAINED, Bandwidth::BytesPerSecond(5_000_000_000)] {
        let config = BoardConfig { bandwidth, queue: Some(256), ..board(&FLOAT, 512) };
        let Tolerance::Limited { slices } = tolerance(&config, 8) else { panic!("no limit") };
        assert!(slices < 8 * 512, "{slices}");
        same(config, 1, Tolerance::Queued { slices }, |machine| machine.step(&step));
    }
}

#[test]
fn a_host_that_looks_in_the_middle_of_a_step_sees_the_reference() {
    let step = scene(400, 800, 7, true);
    let look = |machine: &mut Machine| {
        let variant = machine.host.variant();
        let flight = machine.begin(&step, &step.packed(&variant));
        for _ in 0..4 {
            machine.host.port.pause(std::time::Duration::from_nanos(900));
            machine.host.status(1, bitstream_model::Direction::Mm2s);
        }
        machine.wait(&flight, LONG)?;
        Ok(machine.collect(&flight, step.bodies.len()))
    };
    let found = counted(|| {
        let seen = same(board(&FLOAT, 512), 1, Tolerance::Exact { slices: 0 }, look);
        assert!(seen.steps[0].is_ok());
    });
    assert_eq!(found, [0, 0]);
}

#[test]
fn a_host_that_waits_in_slices_has_the_step_taken_at_once() {
    let step = scene(400, 800, 7, true);
    let wait = |machine: &mut Machine| {
        let variant = machine.host.variant();
        let flight = machine.begin(&step, &step.packed(&variant));
        let before = machine.host.port.now();
        for slice in 1..=20 {
            let time = std::time::Duration::from_micros(2);
            assert_eq!(machine.host.port.wait_interrupt(time), None, "before its end");
            assert_eq!(machine.host.port.now() - before, time * slice);
        }
        machine.wait(&flight, LONG)?;
        Ok(machine.collect(&flight, step.bodies.len()))
    };
    let config = board(&FLOAT, 512);
    let found = counted(|| {
        same(config, 2, tolerance(&config, 10), wait);
    });
    assert_eq!(found, [4, 0]);
}

/// An act of a host.
type Act = fn(&Machine);

#[test]
fn a_host_that_acts_before_the_end_of_a_step_taken_at_once_finds_the_reference() {
    let step = scene(400, 800, 7, true);
    let time = std::time::Duration::from_micros(25);
    let acts: [(&str, Act); 4] = [
        ("a look", |machine| assert!(machine.host.status(1, bitstream_model::Direction::Mm2s) > 0)),
        ("beats so far", |machine| assert!(machine.host.board.counts().beats_read > 400)),
        ("a fault", |machine| {
            let plan: FaultPlan = "irq-delay=7".parse().expect("a fault");
            machine.host.board.inject(plan);
        }),
        ("a reset", |machine| machine.host.reset_all()),
    ];
    for (name, act) in acts {
        let disturb = |machine: &mut Machine| {
            let variant = machine.host.variant();
            let flight = machine.begin(&step, &step.packed(&variant));
            assert_eq!(machine.host.port.wait_interrupt(time), None, "{name}: before its end");
            act(machine);
            machine.wait(&flight, LONG)?;
            Ok(machine.collect(&flight, step.bodies.len()))
        };
        let found = counted(|| {
            let seen = same(board(&FLOAT, 512), 1, Tolerance::Exact { slices: 0 }, disturb);
            assert_eq!(seen.steps[0].is_ok(), name != "a reset", "{name}");
        });
        assert_eq!(found, [0, 0], "{name}");
    }
}

/// A body that falls onto the ground by `speed`, in a step without gravity.
fn falling(speed: f32, integrate: bool) -> Step {
    let mut step = scene(9, 1, 7, true);
    let collision = &mut step.collisions[0];
    (collision.bodies, collision.count, collision.normal) = ([0, 1], 1, [0.0, -1.0, 0.0]);
    (collision.positions, collision.contacts) =
        ([[0.0, -1.0, 0.0], [0.0, 1.0, 0.0]], [[0.0; 4]; 4]);
    (step.drift, step.coefficient, step.integrate) = (0.0, 0.0, integrate);
    step.friction = 0.1;
    for body in &mut step.bodies {
        (body.linear, body.angular) = ([0.0; 3], [0.0; 3]);
    }
    step.bodies[1].linear = [0.0, -speed, 0.0];
    step
}

#[test]
fn a_subnormal_number_has_the_step_taken_by_the_reference_on_a_board_that_flushes() {
    let smallest = f32::MIN_POSITIVE;
    let flushes = board(&FLOAT, 512);
    for (what, speed, drift, subnormal) in [
        ("none", 1.0, 0.0, false),
        ("an operand", smallest / 2.0, 0.0, true),
        // The impulse of 4.4 * 2^-126 times the friction.
        ("an inexact result", 1.1 * smallest, 0.0, true),
        // The distance of 2^-126 and a drift of -1.5 * 2^-126.
        ("an exact result", 1.0, -1.5 * smallest, true),
    ] {
        for integrate in [false, true] {
            let mut step = falling(speed, integrate);
            if drift != 0.0 {
                step.drift = drift;
                step.collisions[0].contacts[0][3] = smallest;
            }
            let found = counted(|| {
                let tolerance = tolerance(&flushes, 10);
                let seen = same(flushes, 1, tolerance, |machine| machine.step(&step));
                assert!(seen.steps[0].is_ok(), "{what}");
            });
            let expected = if subnormal { [0, 2] } else { [2, 0] };
            assert_eq!(found, expected, "{what} {integrate}");
            // A board that keeps them takes the step at once.
            let keeps = board(&NAIVE, 512);
            let found = counted(|| {
                same(keeps, 1, tolerance(&keeps, 10), |machine| machine.step(&step));
            });
            assert_eq!(found, [2, 0], "{what} {integrate}");
        }
    }
}

#[test]
fn what_binary16_cannot_hold_is_the_same_by_the_fast_way_and_by_the_reference() {
    let half = board(&HALF, 512);
    let mut step = extended(scene(400, 801, 7, true), 0b0110, 7, &HALF);
    // Normal impulses that are infinite after the last pass, times a friction of 0.
    step.iterations = [1, 1];
    step.friction = 0.0;
    for body in step.bodies.iter_mut().skip(1).step_by(16) {
        body.linear = [60_000.0; 3];
    }
    let take = |step: &Step, expected: [u32; 2]| {
        let mut nan = [false; 2];
        let found = counted(|| {
            let seen = same(half, 1, tolerance(&half, 10), |machine| machine.step(step));
            let outcome = seen.steps[0].as_ref().expect("a step");
            let is_nan = |word: &u32| f32::from_bits(*word).is_nan();
            nan = [
                outcome.impulses.iter().any(|beat| beat.0.iter().any(is_nan)),
                visible(outcome).0.as_flattened().as_flattened().iter().any(is_nan),
            ];
        });
        assert_eq!(found, expected);
        nan
    };
    assert_eq!(take(&step, [2, 0]), [true; 2]);
    // The inverse mass of a shape, which binary16 rounds to 0.
    step.shapes[2][0] = 1e-9;
    take(&step, [0, 2]);
}
