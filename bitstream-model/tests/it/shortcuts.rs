//! The board's short cuts change nothing but the time that its host takes: results, registers,
//! counters, cycles and faults are the same with them and without.

use bitstream_model::{Bandwidth, BoardConfig, Delays, FaultPlan};
use pgs_interface::control;
use pgs_interface::profile::{FLOAT, HALF, Inertia, Profile};
use proptest::prelude::*;

use crate::common;
use crate::common::scene::Step;
use crate::common::sg::LONG;
use crate::common::shortcuts::{OTHERS, begin, begin_once, below, extended, same, scene};

fn config() -> impl Strategy<Value = BoardConfig> {
    (
        prop_oneof![
            3 => Just(&FLOAT),
            4 => Just(&HALF),
            2 => prop::sample::select(&OTHERS[..]),
        ],
        prop::sample::select(&[16_usize, 48, 512][..]),
        prop::sample::select(&[10_u32, 14, 26][..]),
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
    )
        .prop_map(|(profile, fifo_beats, length_width, bandwidth, window_slots, inertia)| {
            let usual = board(profile, fifo_beats);
            let inertia = profile.world.map_or(Inertia::Isotropic, |_| inertia);
            BoardConfig { length_width, bandwidth, window_slots, inertia, ..usual }
        })
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

fn iterations() -> impl Strategy<Value = [u32; 2]> {
    prop::sample::select(&[[4, 4], [1, 2], [0, 3], [2, 0]][..])
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(80))]

    #[test]
    fn a_step_is_the_same_with_short_cuts_and_without(
        config in config(),
        (bodies, collisions, seed, apart) in (9..400_u32, 0..900_u32, any::<u64>(), any::<bool>()),
        iterations in iterations(),
        extensions in any::<u8>(),
        spoilt in prop::option::weighted(0.3, (any::<u64>(), 0..5_u32)),
    ) {
        let step = scene(bodies, collisions, seed, apart);
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
        same(config, None, 2, |machine| machine.step(&step));
    }

    #[test]
    fn a_step_of_many_bodies_is_the_same_with_short_cuts_and_without(
        config in config(),
        (bodies, collisions, seed) in (300..1500_u32, 0..40_u32, any::<u64>()),
        (integrate, extensions) in (prop::bool::weighted(0.8), any::<u8>()),
        spoilt in prop::option::weighted(0.3, (any::<u64>(), 3..600_u32)),
        pauses in prop::collection::vec(1..9000_u64, 0..4),
    ) {
        let step = Step { integrate, ..scene(bodies, collisions, seed, true) };
        let mut step = extended(step, extensions, seed, config.profile);
        if let Some((at, shape)) = spoilt {
            step.bodies[below(at, bodies) as usize].shape = shape;
        }
        let config = BoardConfig { length_width: config.length_width.max(14), ..config };
        same(config, None, 2, |machine| {
            let flight = begin_once(machine, &step);
            for nanoseconds in &pauses {
                machine.host.port.pause(std::time::Duration::from_nanos(*nanoseconds));
                machine.host.status(1, common::BOTH[1]);
            }
            machine.wait(&flight, 40 * LONG)?;
            Ok(machine.collect(&flight, step.bodies.len()))
        });
    }

    #[test]
    fn a_step_with_faults_is_the_same_with_short_cuts_and_without(
        config in config(),
        scene in (9..100_u32, 1..400_u32, any::<u64>(), any::<bool>()),
        (iterations, extensions) in (iterations(), any::<u8>()),
    ) {
        step_with_faults(config, scene, iterations, extensions);
    }

    #[test]
    fn a_host_that_looks_sees_a_collision_refused_at_the_same_time(
        config in config(),
        (bodies, seed, at) in (9..60_u32, any::<u64>(), 0..60_u32),
        pause in 1..3000_u64,
    ) {
        let mut step = scene(bodies, 60, seed, false);
        step.collisions[at as usize].bodies = [0, 8];
        step.collisions[at as usize].count = 1;
        let config = BoardConfig { length_width: 26, ..config };
        let seen = same(config, None, 1, |machine| {
            let flight = begin_once(machine, &step);
            for _ in 0..20 {
                machine.host.port.pause(std::time::Duration::from_nanos(pause));
                machine.host.status(1, common::BOTH[0]);
            }
            machine.wait(&flight, LONG)?;
            Ok(machine.collect(&flight, step.bodies.len()))
        });
        prop_assert!(seen.steps[0].is_err());
    }

    #[test]
    fn a_host_that_looks_all_the_time_sees_the_same(
        config in config(),
        scene in (9..200_u32, any::<u64>(), any::<bool>()),
        extensions in any::<u8>(),
        pauses in prop::collection::vec(1..4000_u64, 1..20),
    ) {
        host_that_looks(config, scene, extensions, &pauses);
    }
}

/// One step, with faults that follow from the seed of the scene.
fn step_with_faults(
    config: BoardConfig,
    (bodies, collisions, seed, apart): (u32, u32, u64, bool),
    iterations: [u32; 2],
    extensions: u8,
) {
    let step = scene(bodies, collisions, seed, apart);
    let step = extended(step, extensions, seed, config.profile);
    let step = Step { iterations, ..step };
    let plan = FaultPlan::random(seed, &config, iterations[0], iterations[1]);
    same(config, Some(&plan), 2, |machine| machine.step(&step));
}

/// One step of 500 collisions, during which the host reads registers after each pause, in ns. Every pass
/// has buffers of its own, or with bit 3 of the extensions the same ones as the others.
fn host_that_looks(
    config: BoardConfig,
    (bodies, seed, apart): (u32, u64, bool),
    extensions: u8,
    pauses: &[u64],
) {
    let step = scene(bodies, 500, seed, apart);
    let step = extended(step, extensions, seed, config.profile);
    let config = BoardConfig { length_width: 26, ..config };
    let seen = same(config, None, 1, |machine| {
        let flight = match extensions >> 3 & 1 {
            0 => begin(machine, &step, |_, _, _| {}).0,
            _ => begin_once(machine, &step),
        };
        for nanoseconds in pauses {
            machine.host.port.pause(std::time::Duration::from_nanos(*nanoseconds));
            machine.host.status(1, common::BOTH[0]);
            machine.host.control(control::AP_CTRL);
        }
        machine.wait(&flight, 40 * LONG)?;
        Ok(machine.collect(&flight, step.bodies.len()))
    });
    assert!(seen.steps[0].is_ok());
}

// Inputs that the properties above failed on once, shrunk.

#[test]
fn a_host_that_looks_after_a_nanosecond_sees_the_same() {
    host_that_looks(board(&FLOAT, 16), (60, 0, false), 0, &[1]);
}

#[test]
fn a_fault_of_a_board_with_one_window_slot_is_the_same_with_short_cuts_and_without() {
    let config = BoardConfig { length_width: 10, window_slots: Some(1), ..board(&FLOAT, 16) };
    step_with_faults(config, (35, 46, 987_651_107_387_363_228, false), [4, 4], 0);
}

#[test]
fn a_fault_of_a_step_with_one_collision_is_the_same_with_short_cuts_and_without() {
    let config = BoardConfig { length_width: 10, ..board(&FLOAT, 16) };
    step_with_faults(config, (12, 1, 6_219_227_694_810_742_345, false), [4, 4], 0);
}
