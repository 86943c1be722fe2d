//! Steps that are taken by the fast way and by the reference, and the scenes of these steps.

use bitstream_model::{BoardConfig, Counts, PacketCount, ViolationKind};
use pgs_interface::profile::{FLOAT, HALF, NAIVE, Profile};
use pgs_interface::record::Beat;

use super::scene::{AT_REST, Body, Collision, STATIC, Step, bits};
use super::sg::{Failure, Machine, Outcome};

/// Descriptors of a ring: some packets take many.
pub(crate) const SLOTS: usize = 256;

/// The designs that have a fast way.
pub(crate) const PROFILES: [&Profile; 3] = [&FLOAT, &HALF, &NAIVE];

/// Bodies as bits; cycles, stalls, waits, impulse sum and hazards; sums of the received and sent
/// words; the impulses that went out.
pub(crate) type Visible = (Vec<[[u32; 4]; 4]>, [u64; 5], [u32; 2], Vec<Beat>);

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

/// Everything that a host can see of some steps.
#[derive(Debug, Clone)]
pub(crate) struct Seen {
    pub(crate) steps: Vec<Result<Outcome, Failure>>,
    pub(crate) counts: Counts,
    pub(crate) packets: Vec<PacketCount>,
    pub(crate) violations: Vec<ViolationKind>,
}

/// Takes steps on a board of its own until one fails.
pub(crate) fn see(
    config: BoardConfig,
    steps: usize,
    take: &mut impl FnMut(&mut Machine) -> Result<Outcome, Failure>,
) -> Seen {
    let mut machine = Machine::with_slots(config, SLOTS);
    let mut taken = Vec::new();
    for _ in 0..steps {
        taken.push(take(&mut machine));
        if taken.last().is_some_and(Result::is_err) {
            // A part may never come back from its reset.
            break;
        }
    }
    let board = &machine.host.board;
    let mut packets = board.packets();
    packets
        .sort_by_key(|packet| (packet.core, packet.direction == bitstream_model::Direction::S2mm));
    let counts = board.counts();
    Seen { steps: taken, counts, packets, violations: machine.host.violations() }
}

/// Takes steps by the reference, and by the fast way on one thread and on two, and asserts that the
/// results and the counters are the same, within a tolerance of waits.
pub(crate) fn same(
    config: BoardConfig,
    steps: usize,
    tolerance: Tolerance,
    mut take: impl FnMut(&mut Machine) -> Result<Outcome, Failure>,
) -> Seen {
    let reference = see(BoardConfig { fast: false, ..config }, steps, &mut take);
    for threads in [1, 2] {
        let seen = see(BoardConfig { threads, ..config }, steps, &mut take);
        assert_eq!(seen.steps.len(), reference.steps.len());
        for (found, expected) in seen.steps.iter().zip(&reference.steps) {
            match (found, expected) {
                (Ok(found), Ok(expected)) => agree(found, expected, tolerance),
                _ => assert_eq!(found.as_ref().err(), expected.as_ref().err()),
            }
        }
        let all = |counts: Counts| {
            let Counts { beats_read, beats_written, descriptors, .. } = counts;
            [counts.doorbells, beats_read, beats_written, descriptors, counts.violations]
        };
        if reference.steps.iter().all(Result::is_ok) {
            assert_eq!(all(seen.counts), all(reference.counts));
            assert_eq!(seen.packets, reference.packets);
        }
        assert_eq!(seen.violations, reference.violations);
    }
    reference
}

fn agree(found: &Outcome, expected: &Outcome, tolerance: Tolerance) {
    let (bodies, [cycles, stalls, waits, sum, hazards], sums, impulses) = visible(found);
    let expected_one = visible(expected);
    assert_eq!((bodies, sum, sums, impulses), {
        let (bodies, [_, _, _, sum, _], sums, impulses) = expected_one.clone();
        (bodies, sum, sums, impulses)
    });
    let (_, [all, stalled, waited, _, hazardous], ..) = expected_one;
    assert_eq!(cycles - stalls - waits, all - stalled - waited, "work");
    // A collision that waits for its beats stalls less, or not at all.
    assert!(stalls >= stalled, "{stalls} cycles of stalls, by the reference {stalled}");
    match tolerance {
        Tolerance::Exact { slices } => {
            assert_eq!((hazards, stalls), (hazardous, stalled));
            assert!(waits.abs_diff(waited) <= slices, "waits {waits}, expected {waited}");
        }
        Tolerance::Queued { slices } => {
            assert_eq!((hazards, stalls), (hazardous, stalled));
            let most = slices + stalls;
            assert!(waits.abs_diff(waited) <= most, "waits {waits}, expected {waited} +- {most}");
        }
        Tolerance::Limited { slices } => {
            // A pass that stalls here and waits there takes longer than the larger of both, and a
            // wait can move a stall to another collision.
            let most = slices + stalls;
            assert!(waits.abs_diff(waited) <= most, "waits {waits}, expected {waited} +- {most}");
        }
    }
}

/// Cycles by which waits may differ from the reference's.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Tolerance {
    /// On a board whose memory does not limit it: stalls and hazards are the reference's.
    Exact { slices: u64 },
    /// On any board, through the issue queue: stalls and hazards are the reference's.
    Queued { slices: u64 },
    /// A collision that waits for its beats may stall less by the reference.
    Limited { slices: u64 },
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

/// Bodies, every eighth one static, and collisions between any two unless both are static. Body B
/// is random, or with `apart` comes again only after all others have.
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

/// The step with each extension whose bit is set: a friction for each collision in `float`, a warm
/// start and impulses that go out in a design with a warm start, a mass of each body, and with two
/// bits no poses. A board without the masses ignores them.
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
