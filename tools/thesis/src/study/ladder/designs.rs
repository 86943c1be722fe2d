//! The designs of the ladder, each with its formula.

use std::cmp::Ordering;

use super::Rung;
use crate::estimate::thesis::data::{DataRow, TABLES};
use crate::estimate::thesis::recorded::{Design, ONE_COPY_INTERVAL};
use crate::estimate::{PORTS, PortAccount, Records, StepCycles, StepShape, StepTime};
use bitstream_model::Bandwidth;
use pgs_interface::profile::{FLOAT, HALF, NAIVE, OnChipMemory, Profile, THESIS_WORDS};

/// Cycles of a register access (thesis §5.2: 30 to 50 for each request), least and most.
const ACCESS_CYCLES: [u64; 2] = [30, 50];

/// Rows of the velocities that a collision reads; it writes the same rows back.
const ROWS: u32 = 2;

/// Cycles that the velocities' block RAM takes for a collision if each of their words is a row of
/// its own, in one array: before the thesis' directive `ARRAY_PARTITION` (§5.4.3).
const WORD_BY_WORD: u32 = (ROWS + ROWS) * THESIS_WORDS.velocity / PORTS;

/// One stream of 128 bits.
const ONE_WIDE_STREAM: Profile = Profile {
    name: "one 128-bit stream",
    mm2s_widths: &[128],
    s2mm_widths: &[128],
    stripes: NAIVE.stripes,
    initiation_interval: WORD_BY_WORD,
    ..FLOAT
};

/// Four streams of 128 bits, before the arrays are partitioned.
const FOUR_STREAMS: Profile =
    Profile { name: "four 128-bit streams", initiation_interval: WORD_BY_WORD, ..FLOAT };

/// Half before its second copy of the velocities (§5.5.2).
const ONE_COPY_HALF: Profile = Profile {
    name: "half, one copy",
    initiation_interval: 4,
    memory: OnChipMemory { velocity_copies: 1, ..HALF.memory },
    ..HALF
};

/// The row of the array that holds the velocities on chip.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum VelocityRow {
    /// One of six words.
    Word,
    /// All six: the array is partitioned.
    Whole,
}

/// Words of a step before the thesis' reductions: of a collision in each pass, and of a body.
#[derive(Debug, Clone, Copy)]
struct Unreduced {
    collision: u64,
    velocity: u64,
    pose: u64,
    result: u64,
}

impl Unreduced {
    /// The rows "before" of Tables 4.1, 4.3 and 4.4.
    fn of_thesis() -> Self {
        let before = |table: usize| -> &DataRow { &TABLES[table].rows[0] };
        Self {
            collision: before(0).per_collision.into(),
            velocity: before(0).per_body.into(),
            pose: before(2).per_body.into(),
            result: before(3).per_body.into(),
        }
    }

    /// Words of a step in which every pass reads all collisions.
    fn words(self, step: &StepShape) -> u64 {
        let bodies = step.bodies.saturating_mul(self.velocity + self.pose + self.result);
        step.passes().saturating_mul(step.collisions).saturating_mul(self.collision) + bodies
    }
}

/// Cycles of a step whose words are read and written one at a time.
fn register_accesses(words: u64, cycles: u64) -> u64 {
    words.saturating_mul(cycles)
}

/// Cycles of a step on one stream of 32 bits each way: a word a cycle, results out while poses come
/// in.
fn unreduced_stream(words: Unreduced, step: &StepShape) -> u64 {
    let passes = step.passes().saturating_mul(step.collisions).saturating_mul(words.collision);
    let bodies = step.bodies.saturating_mul(words.velocity + words.pose.max(words.result));
    passes.saturating_add(bodies)
}

/// The designs in the thesis' order.
pub(super) fn designs(step: &StepShape) -> [Rung; 8] {
    [
        by_accesses(step),
        by_one_stream(step),
        by_profile(
            step,
            &NAIVE,
            VelocityRow::Word,
            ["naive", "§5.4.1", "conversion inside the solvers, reduced records"],
        ),
        by_profile(
            step,
            &ONE_WIDE_STREAM,
            VelocityRow::Word,
            [ONE_WIDE_STREAM.name, "§5.4.2", "four words a cycle"],
        ),
        by_profile(
            step,
            &FOUR_STREAMS,
            VelocityRow::Word,
            [FOUR_STREAMS.name, "§5.4.2", "four DMAs"],
        ),
        by_profile(
            step,
            &FLOAT,
            VelocityRow::Whole,
            ["float", "§5.4.3, §5.4.4", "a velocity is one row: an issue every 2 cycles"],
        ),
        Rung {
            recorded_interval: Some(ONE_COPY_INTERVAL),
            ..by_profile(
                step,
                &ONE_COPY_HALF,
                VelocityRow::Whole,
                [ONE_COPY_HALF.name, "§5.5.2", "sixteen bits, two collisions an issue, 250 MHz"],
            )
        },
        by_profile(
            step,
            &HALF,
            VelocityRow::Whole,
            ["half", "§5.5.3", "a second copy of the velocities"],
        ),
    ]
}

/// The design whose every word is a request.
fn by_accesses(step: &StepShape) -> Rung {
    let words = Unreduced::of_thesis();
    let Unreduced { collision, velocity, pose, result } = words;
    let [least, most] = ACCESS_CYCLES;
    Rung {
        design: "register accesses",
        thesis: "§5.2",
        change: "memory-mapped: each word a request",
        formula: format!(
            "({} passes x {collision} C + ({velocity} + {pose} + {result}) B) x {least} to {most}",
            step.passes(),
        ),
        intervals: None,
        collisions_per_issue: 1,
        cycles: ACCESS_CYCLES.map(|cycles| register_accesses(words.words(step), cycles)),
        clock_khz: NAIVE.clock_khz,
        sustained: None,
        factor: None,
        factor_in_all: 1.0,
        bound_by: "accesses",
        recorded_cycles: None,
        recorded_interval: None,
    }
}

/// The first design with DMA, whose records are not reduced.
fn by_one_stream(step: &StepShape) -> Rung {
    let words = Unreduced::of_thesis();
    let Unreduced { collision, velocity, pose, result } = words;
    let interval = u32::try_from(collision).unwrap_or(u32::MAX);
    Rung {
        design: "one 32-bit stream",
        thesis: "§5.3.3",
        change: "DMA: a word a cycle",
        formula: format!(
            "{} passes x {collision} C + ({velocity} + max({pose}, {result})) B",
            step.passes(),
        ),
        intervals: Some([interval, WORD_BY_WORD]),
        cycles: [unreduced_stream(words, step); 2],
        bound_by: "streams",
        ..by_accesses(step)
    }
}

/// A design that a profile describes.
fn by_profile(
    step: &StepShape,
    profile: &'static Profile,
    row: VelocityRow,
    [design, thesis, change]: [&'static str; 3],
) -> Rung {
    let variant = profile.default_variant();
    let account = PortAccount::new(&variant);
    let streams = account.by_streams;
    let ports = match row {
        VelocityRow::Word => WORD_BY_WORD.max(account.by_ports()),
        VelocityRow::Whole => account.by_ports(),
    };
    let cycles = StepCycles::new(&variant, Records::Packed, step).total;
    let sustained = Bandwidth::ZCU102_SUSTAINED;
    let time = StepTime::new(&variant, Records::Packed, step, sustained);
    let Profile { initiation_interval: interval, collisions_per_issue: each, .. } = *profile;
    let recorded = Design::of(profile).filter(|design| design.profile.name == profile.name);
    let issues = if each == 1 { "C".to_owned() } else { format!("ceil(C / {each})") };
    Rung {
        design,
        thesis,
        change,
        formula: format!(
            "{} passes x {interval} x {issues} + fill + load + integration",
            step.passes()
        ),
        intervals: Some([streams, ports]),
        collisions_per_issue: each,
        cycles: [cycles; 2],
        clock_khz: profile.clock_khz,
        sustained: Some(time.seconds * 1e3),
        bound_by: match streams.cmp(&ports) {
            Ordering::Less => "ports",
            Ordering::Equal => "both",
            Ordering::Greater => "streams",
        },
        factor: None,
        factor_in_all: 1.0,
        recorded_cycles: recorded.map(|design| design.cycles),
        recorded_interval: recorded.map(|design| design.initiation_interval),
    }
}
