//! Steps that are seen with the board's short cuts and without them, and the scenes of these steps.

use bitstream_model::{BoardConfig, Counts, FaultPlan, PacketCount, RegisterAccess, ViolationKind};
use pgs_interface::control;
use pgs_interface::profile::{FLOAT, HALF, Profile};
use pgs_interface::record::Beat;
use pgs_interface::stripe::{Stripe, Stripes};

use super::packing::beats_out;
use super::ring::WHOLE;
use super::scene::{AT_REST, Body, Collision, Lane, STATIC, Step, bits};
use super::sg::{Failure, Flight, Machine, Outcome};

/// The designs that have short cuts.
pub(crate) const PROFILES: [&Profile; 2] = [&FLOAT, &HALF];

/// Designs of no table that have short cuts too: one without a short cut for bodies, one with narrow
/// streams, and one with pairs of collisions on other streams than in `half`.
pub(crate) const OTHERS: [&Profile; 3] = [&BODIES_APART, &NARROW, &PAIRS];

static BODIES_APART: Profile = Profile {
    stripes: Stripes {
        velocities: Stripe { streams: &[2], padded: false },
        poses: Stripe { streams: &[1], padded: false },
        results: Stripe { streams: &[0, 1, 2], padded: true },
        ..FLOAT.stripes
    },
    ..FLOAT
};
static NARROW: Profile = Profile { mm2s_widths: &[128, 32, 64, 128], ..FLOAT };
static PAIRS: Profile = Profile {
    mm2s_widths: &[64, 128, 32],
    stripes: Stripes {
        collisions: Stripe { streams: &[2, 0, 1, 1, 0, 1, 1], padded: false },
        warm_collisions: None,
        ..HALF.stripes
    },
    initiation_interval: 2,
    ..HALF
};
/// Bodies as bits; cycles, stalls, waits, impulse sum and hazards; sums of the received and sent
/// words; the impulses that went out.
pub(crate) type Visible = (Vec<[[u32; 4]; 4]>, [u64; 5], [u32; 2], Vec<Beat>);

/// Everything that a host can see of some steps.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Seen {
    pub(crate) steps: Vec<Result<Visible, Failure>>,
    pub(crate) counters: Vec<Vec<u32>>,
    pub(crate) counts: Counts,
    pub(crate) packets: Vec<PacketCount>,
    pub(crate) violations: Vec<ViolationKind>,
    pub(crate) accesses: Vec<RegisterAccess>,
    pub(crate) faults: u64,
}

/// The visible part of an outcome.
pub(crate) fn visible(outcome: &Outcome) -> Visible {
    let Outcome { cycles, stalls, waits, impulse_sum, .. } = *outcome;
    (
        outcome.bodies.iter().map(bits).collect(),
        [cycles, stalls, waits, impulse_sum, outcome.hazards.into()],
        [outcome.sum_received, outcome.sum_sent],
        outcome.impulses.clone(),
    )
}

/// Takes steps on a board of its own until one fails, and looks at everything.
pub(crate) fn see(
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

/// Takes steps on boards without short cuts and with them, on one thread and on two with lanes, and
/// asserts that everybody sees the same of them: results, registers, counters, cycles, packets,
/// violations and faults.
pub(crate) fn same(
    config: BoardConfig,
    plan: Option<&FaultPlan>,
    steps: usize,
    mut take: impl FnMut(&mut Machine) -> Result<Outcome, Failure>,
) -> Seen {
    let reference = see(BoardConfig { shortcuts: false, ..config }, plan, steps, &mut take);
    for (threads, lanes) in [(1, false), (2, true)] {
        let seen = see(BoardConfig { threads, lanes, ..config }, plan, steps, &mut take);
        assert_eq!(seen, reference);
    }
    reference
}

/// A number that depends on another one in no simple way.
pub(crate) fn scatter(seed: u64, number: u64) -> u64 {
    let mut x = seed ^ number.wrapping_mul(0x9E37_79B9_7F4A_7C15);
    x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB)
}

/// A number between -1 and 1.
pub(crate) fn unit(seed: u64, number: u64) -> f32 {
    #[allow(clippy::cast_precision_loss, reason = "any number will do")]
    let whole = (scatter(seed, number) >> 40) as f32;
    whole / (1 << 23) as f32 - 1.0
}

/// Bodies, every eighth one static, and collisions between any two unless both are static. Body B is
/// random, or with `apart` comes again only after all others have.
pub(crate) fn scene(bodies: u32, collisions: u32, seed: u64, apart: bool) -> Step {
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
        let b = if b % 8 == 0 { b - 1 } else { b };
        let a = if apart { 0 } else { below(random(1), bodies) };
        let a = if a == b { 0 } else { a };
        let count = if random(2) % 16 == 0 { 0 } else { 1 + below(random(3), 4) };
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
    let inertia = |k: u32| {
        let of = |n: u64| unit(seed ^ 0x33, 8 * u64::from(k) + n);
        [2.0 + of(0), 2.0 + of(1), 2.0 + of(2), of(3), of(4), of(5)]
    };
    Step {
        shapes: vec![[0.0, 0.0], [1.0, 2.5], [0.25, 0.0]],
        inertias: (0..bodies).map(inertia).collect(),
        time_step: 0.02,
        drift: 0.005,
        coefficient: 0.2,
        ..Step::new(all.clone(), (0..collisions).map(collision).collect())
    }
}

/// The step with each extension whose bit is set: a friction for each collision in `float`, a warm start and
/// impulses that go out in a design with a warm start, a mass of each body, and with two bits no poses. A
/// board without the masses ignores them.
pub(crate) fn extended(mut step: Step, bits: u8, seed: u64, profile: &Profile) -> Step {
    let of = |n: usize, k: u64| unit(seed ^ 0x99, 16 * n as u64 + k);
    let has = |bit: u8| bits >> bit & 1 == 1;
    if has(3) {
        // A body of the static shape has no mass, and a shape beyond the table does not matter.
        let mass = |(n, body): (usize, &Body)| match body.shape {
            STATIC => 0.0,
            _ => 1.5 + of(n, 9),
        };
        step.masses = step.bodies.iter().enumerate().map(mass).collect();
    }
    if profile.stripes.warm_collisions.is_none() {
        return step;
    }
    let has_friction = has(0) && *profile == FLOAT;
    let each = 0..step.collisions.len();
    let impulses = |n| [0, 4].map(|k| [0, 1, 2, 3].map(|at| 0.1 * of(n, k + at)));
    Step {
        frictions: each.clone().filter(|_| has_friction).map(|n| 0.5 + 0.5 * of(n, 8)).collect(),
        impulses: each.filter(|_| has(1)).map(impulses).collect(),
        impulses_out: has(2),
        ..step
    }
}

pub(crate) fn below(random: u64, end: u32) -> u32 {
    u32::try_from(random % u64::from(end)).expect("less than the end")
}

/// Begins a step with a buffer for every packet, whose beats `change` may change; returns the buffers'
/// addresses too, stream by stream.
pub(crate) fn begin(
    machine: &mut Machine,
    step: &Step,
    change: impl Fn(usize, usize, &mut Vec<Beat>),
) -> (Flight, Vec<Vec<u64>>) {
    let variant = machine.host.variant();
    step.write_arguments(&machine.host);
    let mut flight = Flight::default();
    machine.arm(&mut flight, &beats_out(&variant, step));
    machine.start();
    let mut addresses = Vec::new();
    for (stream, Lane { segments, packets }) in step.packed(&variant).iter().enumerate() {
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

/// Begins a step whose passes all take the same buffers, so that its collisions are decoded once.
pub(crate) fn begin_once(machine: &mut Machine, step: &Step) -> Flight {
    let variant = machine.host.variant();
    step.write_arguments(&machine.host);
    let mut flight = Flight::default();
    machine.arm(&mut flight, &beats_out(&variant, step));
    machine.start();
    machine.send(&mut flight, &step.packed(&variant));
    flight
}

/// A scene of many collisions without hazards.
pub(crate) fn large() -> Step {
    scene(400, 800, 7, true)
}

pub(crate) fn whole_length() -> BoardConfig {
    BoardConfig { strict: false, ..BoardConfig::default() }
}
