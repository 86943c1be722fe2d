//! Decoding collisions once and replaying them is nobody's business but the host's: results,
//! registers, counters, cycles and faults are those of decoding them in every pass.

mod common;

use bitstream_model::interface::control;
use bitstream_model::interface::record::Beat;
use bitstream_model::{
    Bandwidth, BoardConfig, Counts, Delays, DeviceAccess, Direction, FaultPlan, PacketCount,
    RegisterAccess, ViolationKind,
};
use proptest::prelude::*;

use common::ring::WHOLE;
use common::scene::{AT_REST, Body, Collision, Lane, STATIC, Step, bits, result_beats};
use common::sg::{Failure, Flight, LONG, Machine, Outcome};

/// Bodies as bits; cycles, stalls, waits, impulse sum and hazards; sums of what was received and sent.
type Visible = (Vec<[[u32; 4]; 4]>, [u64; 5], [u32; 2]);

/// Everything that a host can see of some steps.
#[derive(Debug, Clone, PartialEq)]
struct Seen {
    steps: Vec<Result<Visible, Failure>>,
    counters: Vec<Vec<u32>>,
    counts: Counts,
    packets: Vec<PacketCount>,
    violations: Vec<ViolationKind>,
    accesses: Vec<RegisterAccess>,
    faults: u64,
}

/// What can be seen of an outcome.
fn visible(outcome: &Outcome) -> Visible {
    let Outcome { cycles, stalls, waits, impulse_sum, .. } = *outcome;
    (
        outcome.bodies.iter().map(bits).collect(),
        [cycles, stalls, waits, impulse_sum, outcome.hazards.into()],
        [outcome.sum_received, outcome.sum_sent],
    )
}

/// Takes steps as `take` says, and resets everything after one that fails.
fn see(
    config: BoardConfig,
    plan: Option<&FaultPlan>,
    steps: usize,
    mut take: impl FnMut(&mut Machine) -> Result<Outcome, Failure>,
) -> Seen {
    let mut machine = Machine::new(config);
    if let Some(plan) = plan {
        machine.host.board.inject(plan.clone());
    }
    let (mut taken, mut counters) = (Vec::new(), Vec::new());
    for _ in 0..steps {
        let outcome = take(&mut machine);
        let registers = [
            control::CYCLES_LO,
            control::WORK_CYCLES,
            control::WAIT_CYCLES,
            control::HAZARDS,
            control::SUM_RECEIVED,
            control::SUM_SENT,
            control::IMPULSE_SUM_LO,
            control::IMPULSE_SUM_HI,
            control::ERROR,
            control::ERROR_DETAIL,
        ];
        counters.push(registers.map(|register| machine.host.control(register)).to_vec());
        let failed = outcome.is_err();
        taken.push(outcome.map(|outcome| visible(&outcome)));
        if failed {
            // A part may never come back from its reset.
            break;
        }
    }
    let board = &machine.host.board;
    Seen {
        steps: taken,
        counters,
        counts: board.counts(),
        packets: board.packets(),
        violations: machine.host.violations(),
        accesses: board.register_accesses(),
        faults: board.faults(),
    }
}

/// The same with and without replaying, and on as many threads and lanes as there are.
fn same(
    config: BoardConfig,
    plan: Option<&FaultPlan>,
    steps: usize,
    mut take: impl FnMut(&mut Machine) -> Result<Outcome, Failure>,
) -> Seen {
    let long = see(BoardConfig { replay: false, ..config }, plan, steps, &mut take);
    for (threads, lanes) in [(1, false), (2, true)] {
        let short = see(BoardConfig { threads, lanes, ..config }, plan, steps, &mut take);
        assert_eq!(short, long);
    }
    long
}

/// A number that depends on another one in no simple way.
fn scatter(seed: u64, number: u64) -> u64 {
    let mut x = seed ^ number.wrapping_mul(0x9E37_79B9_7F4A_7C15);
    x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB)
}

/// A number between -1 and 1.
fn unit(seed: u64, number: u64) -> f32 {
    #[allow(clippy::cast_precision_loss, reason = "any number will do")]
    let whole = (scatter(seed, number) >> 40) as f32;
    whole / (1 << 23) as f32 - 1.0
}

/// Bodies of which every eighth is static, and collisions of any two that have one that moves: as they
/// come, or so that a body comes again only after all others have.
fn scene(bodies: u32, collisions: u32, seed: u64, apart: bool) -> Step {
    let body = |k: u32| {
        let of = |n: u64| unit(seed, 16 * u64::from(k) + n);
        Body {
            shape: if k.is_multiple_of(8) { STATIC } else { 1 + k % 2 },
            position: [of(0) * 4.0, of(1) * 4.0, of(2) * 4.0],
            linear: [of(3), of(4), of(5)],
            angular: [of(6), of(7), of(8)],
            ..AT_REST
        }
    };
    let all: Vec<Body> = (0..bodies).map(body).collect();
    let collision = |n: u32| {
        let random = |k: u64| scatter(seed ^ 0x55, 8 * u64::from(n) + k);
        let of = |k: u64| unit(seed ^ 0xAA, 32 * u64::from(n) + k);
        let b = if apart { 1 + n % (bodies - 1) } else { 1 + below(random(0), bodies - 1) };
        let b = if b.is_multiple_of(8) { b - 1 } else { b };
        let a = if apart { 0 } else { below(random(1), bodies) };
        let a = if a == b { 0 } else { a };
        let count = if random(2).is_multiple_of(16) { 0 } else { 1 + below(random(3), 4) };
        let length = (of(0).mul_add(of(0), of(1) * of(1)) + 0.01).sqrt();
        Collision {
            bodies: [a, b],
            count,
            normal: [of(0) / length, -of(1) / length, 0.1 / length],
            positions: [all[a as usize].position, all[b as usize].position],
            contacts: std::array::from_fn(|k| {
                let k = 8 + 4 * k as u64;
                [of(k), of(k + 1), of(k + 2), of(k + 3) * 0.01]
            }),
        }
    };
    Step {
        shapes: vec![[0.0, 0.0], [1.0, 2.5], [0.25, 0.0]],
        time_step: 0.02,
        drift: 0.005,
        coefficient: 0.2,
        ..Step::new(all.clone(), (0..collisions).map(collision).collect())
    }
}

fn below(random: u64, end: u32) -> u32 {
    u32::try_from(random % u64::from(end)).expect("less than the end")
}

fn config() -> impl Strategy<Value = BoardConfig> {
    (
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
    )
        .prop_map(|(fifo_beats, length_width, bandwidth, window_slots)| BoardConfig {
            length_width,
            bandwidth,
            window_slots,
            strict: false,
            delays: Delays { fifo_beats, ..Delays::default() },
            ..BoardConfig::default()
        })
}

fn iterations() -> impl Strategy<Value = [u32; 2]> {
    prop::sample::select(&[[4, 4], [1, 2], [0, 3], [2, 0]][..])
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(80))]

    #[test]
    fn a_step_is_the_same_with_and_without(
        config in config(),
        (bodies, collisions, seed, apart) in (9..400_u32, 0..900_u32, any::<u64>(), any::<bool>()),
        iterations in iterations(),
        spoilt in prop::option::weighted(0.3, (any::<u64>(), 0..5_u32)),
    ) {
        let mut step = scene(bodies, collisions, seed, apart);
        step.iterations = iterations;
        if let Some((at, how)) = spoilt
            && collisions > 0
        {
            let collision = &mut step.collisions[below(at, collisions) as usize];
            match how {
                0 => collision.count = 5,
                1 => collision.bodies[1] = bodies,
                2 => collision.bodies[1] = collision.bodies[0],
                3 => collision.bodies = [0, 8],
                _ => collision.count = u32::MAX,
            }
        }
        same(config, None, 2, |machine| machine.step(&step));
    }

    #[test]
    fn a_step_of_many_bodies_is_the_same_with_and_without(
        config in config(),
        (bodies, collisions, seed) in (300..1500_u32, 0..40_u32, any::<u64>()),
        integrate in prop::bool::weighted(0.8),
        spoilt in prop::option::weighted(0.3, (any::<u64>(), 3..600_u32)),
        pauses in prop::collection::vec(1..9000_u64, 0..4),
    ) {
        let mut step = Step { integrate, ..scene(bodies, collisions, seed, true) };
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
    fn a_step_with_faults_is_the_same_with_and_without(
        config in config(),
        (bodies, collisions, seed, apart) in (9..100_u32, 1..400_u32, any::<u64>(), any::<bool>()),
        iterations in iterations(),
    ) {
        let step = Step { iterations, ..scene(bodies, collisions, seed, apart) };
        let plan = FaultPlan::random(seed, &config, iterations[0], iterations[1]);
        same(config, Some(&plan), 2, |machine| machine.step(&step));
    }

    #[test]
    fn a_host_that_looks_all_the_time_sees_the_same(
        config in config(),
        (bodies, seed, apart) in (60..200_u32, any::<u64>(), any::<bool>()),
        pauses in prop::collection::vec(1..4000_u64, 1..20),
    ) {
        let step = scene(bodies, 500, seed, apart);
        let config = BoardConfig { length_width: 26, ..config };
        let seen = same(config, None, 1, |machine| {
            let (flight, _) = begin(machine, &step, |_, _, _| {});
            for nanoseconds in &pauses {
                machine.host.port.pause(std::time::Duration::from_nanos(*nanoseconds));
                machine.host.status(1, common::BOTH[0]);
                machine.host.control(control::AP_CTRL);
            }
            machine.wait(&flight, 40 * LONG)?;
            Ok(machine.collect(&flight, step.bodies.len()))
        });
        prop_assert!(seen.steps[0].is_ok());
    }
}

/// Begins a step with a buffer for every packet, of which `change` may change the beats; returns the
/// addresses of each stream's too.
fn begin(
    machine: &mut Machine,
    step: &Step,
    change: impl Fn(usize, usize, &mut Vec<Beat>),
) -> (Flight, Vec<Vec<u64>>) {
    step.write_arguments(&machine.host);
    let mut flight = Flight::default();
    machine.arm(&mut flight, &result_beats(step.bodies.len()));
    machine.start();
    let mut addresses = Vec::new();
    for (stream, Lane { segments, packets }) in step.lanes().iter().enumerate() {
        let mut of_stream = Vec::new();
        let mut tail = 0;
        for (packet, segment) in packets.iter().enumerate() {
            let mut beats = segments[*segment].clone();
            change(stream, packet, &mut beats);
            let address = machine.host.readable(&beats);
            flight.input(address);
            of_stream.push(address);
            let bytes = u32::try_from(beats.len() * 16).expect("some kilobytes");
            tail = machine.mm2s[stream].push(address, bytes | WHOLE);
        }
        machine.mm2s[stream].doorbell(&machine.host, tail);
        addresses.push(of_stream);
    }
    (flight, addresses)
}

/// A scene of many collisions without hazards.
fn large() -> Step {
    scene(400, 800, 7, true)
}

fn whole_length() -> BoardConfig {
    BoardConfig { strict: false, ..BoardConfig::default() }
}

#[test]
fn other_bytes_in_a_later_pass_are_noticed() {
    let step = large();
    let run = |change: &dyn Fn(usize, usize, &mut Vec<Beat>)| {
        same(whole_length(), None, 2, |machine| {
            let (flight, _) = begin(machine, &step, change);
            machine.wait(&flight, LONG)?;
            Ok(machine.collect(&flight, step.bodies.len()))
        })
    };
    let usual = run(&|_, _, _| {});
    // Packet 0 are the velocities, 1 to 4 the contact passes.
    for pass in 2..=4 {
        for beat in [0, 1, 401, 799] {
            let changed = run(&|stream, packet, beats| {
                // Stream 3 has the first contact point.
                if stream == 3 && packet == pass {
                    beats[beat].0[3] = (-50.0_f32).to_bits();
                }
            });
            let bodies = |seen: &Seen| seen.steps[0].clone().expect("no fault").0;
            assert_ne!(bodies(&changed), bodies(&usual), "pass {pass}, beat {beat}");
        }
    }
    // What the decoder refuses is refused in the pass that brings it.
    let refused = run(&|stream, packet, beats| {
        if stream == 0 && packet == 6 {
            beats[2 * 300].0[3] = 5;
        }
    });
    let code = control::ErrorCode::ContactCount as u32;
    assert_eq!(refused.steps, [Err(Failure::Accelerator(code, 0, 300))]);
}

#[test]
fn the_same_bytes_in_other_buffers_give_the_same() {
    let step = large();
    let apart = same(whole_length(), None, 1, |machine| {
        let (flight, _) = begin(machine, &step, |_, _, _| {});
        machine.wait(&flight, LONG)?;
        Ok(machine.collect(&flight, step.bodies.len()))
    });
    let together = same(whole_length(), None, 1, |machine| machine.step(&step));
    let results = |seen: &Seen| seen.steps[0].clone().expect("no fault");
    assert_eq!(results(&apart).0, results(&together).0);
}

#[test]
fn a_corrupt_beat_in_a_later_pass_is_noticed() {
    let step = large();
    let usual = same(whole_length(), None, 1, |machine| machine.step(&step));
    for at in ["contact1", "contact3", "friction2"] {
        let plan = format!("corrupt=0x00700000@dma3.mm2s,phase={at},beat=500");
        let plan: FaultPlan = plan.parse().expect("a plan");
        let seen = same(whole_length(), Some(&plan), 1, |machine| machine.step(&step));
        assert_eq!(seen.faults, 1);
        assert_ne!(seen.steps, usual.steps, "{at}");
    }
}

#[test]
fn a_buffer_that_changes_hands_in_the_middle_of_a_pass_is_noticed() {
    let step = large();
    // A pass takes some 1600 cycles of 3.6 ns.
    for pause in [3, 5, 6, 8, 14, 21, 33] {
        let seen = same(whole_length(), None, 1, |machine| {
            let mut flight = Flight::default();
            step.write_arguments(&machine.host);
            machine.arm(&mut flight, &result_beats(step.bodies.len()));
            machine.start();
            let lanes = step.lanes();
            let mut addresses = Vec::new();
            for (stream, Lane { segments, packets }) in lanes.iter().enumerate() {
                let buffers = segments.each_ref().map(|beats| machine.host.readable(beats));
                buffers.iter().for_each(|address| flight.input(*address));
                let mut tail = 0;
                for segment in packets {
                    let bytes = u32::try_from(segments[*segment].len() * 16).expect("some");
                    tail = machine.mm2s[stream].push(buffers[*segment], bytes | WHOLE);
                }
                machine.mm2s[stream].doorbell(&machine.host, tail);
                addresses.push(buffers);
            }
            machine.host.pause(pause);
            // The contact points of the first half lie elsewhere from now on.
            let address = addresses[3][1];
            let mut beats = machine.host.take(address);
            for beat in &mut beats[..400] {
                beat.0[1] = 0.75_f32.to_bits();
            }
            let port = &machine.host.port;
            port.hand_over(address, beats, DeviceAccess::Read).expect("the CPU owns it");
            machine.wait(&flight, LONG)?;
            Ok(machine.collect(&flight, step.bodies.len()))
        });
        assert!(seen.steps[0].is_ok(), "{seen:?}");
    }
}

/// Begins a step of which every pass takes the same buffers, so that it is replayed to its end.
fn begin_once(machine: &mut Machine, step: &Step) -> Flight {
    step.write_arguments(&machine.host);
    let mut flight = Flight::default();
    machine.arm(&mut flight, &result_beats(step.bodies.len()));
    machine.start();
    machine.send(&mut flight, &step.lanes());
    flight
}

/// How far a step of many bodies has come, by the buffers of stream 2.
#[derive(Debug, Clone, Copy)]
enum Moment {
    /// Velocities are loaded.
    Load,
    /// Poses come.
    Poses,
    /// Results go.
    Results,
}

impl Moment {
    fn access(self) -> DeviceAccess {
        match self {
            Self::Load | Self::Poses => DeviceAccess::Read,
            Self::Results => DeviceAccess::Write,
        }
    }

    /// The buffer that is at work then.
    fn buffer(self, flight: &Flight) -> u64 {
        match self {
            // Velocities, collisions and poses of each stream.
            Self::Load => flight.inputs()[3 * 2],
            Self::Poses => flight.inputs()[3 * 2 + 2],
            Self::Results => flight.outputs()[2],
        }
    }
}

/// When each moment is for a step of 3000 bodies and 40 collisions, microseconds from its start.
const MOMENTS: [(Moment, &[u64]); 3] = [
    (Moment::Load, &[1, 3, 6]),
    (Moment::Poses, &[20, 44, 49]),
    (Moment::Results, &[44, 49, 51, 57]),
];

#[test]
fn a_buffer_of_bodies_that_changes_hands_is_noticed() {
    let step = scene(3000, 40, 7, true);
    // One word of each beat is another when the device gets the buffer back, if `other` says so.
    let run = |moment: Moment, pause, other: bool| {
        let mut seen = same(whole_length(), None, 1, |machine| {
            let flight = begin_once(machine, &step);
            machine.host.pause(pause);
            let address = moment.buffer(&flight);
            let mut beats = machine.host.take(address);
            for beat in beats.iter_mut().filter(|_| other) {
                beat.0[0] = 0.75_f32.to_bits();
            }
            let port = &machine.host.port;
            port.hand_over(address, beats, moment.access()).expect("the CPU owns it");
            machine.wait(&flight, LONG)?;
            Ok(machine.collect(&flight, step.bodies.len()))
        });
        seen.steps.remove(0).expect("no fault").0
    };
    for (moment, pauses) in MOMENTS {
        // The stream brings odd bodies, and takes a row of each away.
        let all = match moment {
            Moment::Load | Moment::Poses => 1500,
            Moment::Results => 3000,
        };
        for pause in pauses {
            let [usual, changed] = [false, true].map(|other| run(moment, *pause, other));
            let others = usual.iter().zip(&changed).filter(|(usual, changed)| usual != changed);
            // It was in the middle.
            let others = others.count();
            assert!((1..all).contains(&others), "{moment:?} {pause}: {others}");
        }
    }
}

#[test]
fn a_buffer_of_bodies_that_is_gone_or_shorter_is_noticed() {
    let step = scene(3000, 40, 7, true);
    for (moment, pauses) in MOMENTS {
        for (pause, gone) in pauses.iter().flat_map(|pause| [(pause, false), (pause, true)]) {
            let seen = same(whole_length(), None, 1, |machine| {
                let flight = begin_once(machine, &step);
                machine.host.pause(*pause);
                let address = moment.buffer(&flight);
                let beats = machine.host.take(address);
                // More are missing than a FIFO holds.
                let granted = beats.len() - 700;
                let kept = (!gone).then(|| beats[granted..].to_vec());
                if !gone {
                    let port = &machine.host.port;
                    port.hand_over_first(address, beats, granted, moment.access())
                        .expect("the CPU owns it");
                }
                let waited = machine.wait(&flight, LONG);
                if let Some(kept) = kept {
                    // Whoever notices it, and when: nothing was written where nothing was granted.
                    assert_eq!(machine.host.take(address)[granted..], kept, "{moment:?} {pause}");
                }
                waited?;
                Ok(machine.collect(&flight, step.bodies.len()))
            });
            let direction = match moment.access() {
                DeviceAccess::Read => Direction::Mm2s,
                DeviceAccess::Write => Direction::S2mm,
            };
            let met = match seen.steps[0] {
                Err(Failure::Dma { core, direction, .. }) => Some((core, direction)),
                _ => None,
            };
            assert_eq!(met, Some((2, direction)), "{moment:?} {pause} {gone}");
        }
    }
}

#[test]
fn beats_on_the_way_are_there_when_their_buffer_is_gone() {
    let step = large();
    for pause in [3, 6, 20] {
        let seen = same(whole_length(), None, 1, |machine| {
            let (flight, addresses) = begin(machine, &step, |_, _, _| {});
            machine.host.pause(pause);
            // The device runs into the hole that they leave.
            for stream in &addresses {
                for address in stream {
                    machine.host.take(*address);
                    machine.host.port.release(*address).expect("it was allocated");
                }
            }
            machine.host.pause(200);
            machine.wait(&flight, LONG)?;
            Ok(machine.collect(&flight, step.bodies.len()))
        });
        assert!(matches!(seen.steps[0], Err(Failure::Dma { .. })), "{seen:?}");
    }
}
