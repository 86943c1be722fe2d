//! The study `ladder`: the designs of the thesis' chapter 5 one behind the other, and the factor that
//! each brings.
//!
//! A design is a profile where there is one. Where the profile differs in one property from another
//! design, it is made here from that design, so that all of them go through one formula
//! ([`StepCycles`]). Two designs have other records, or no streams, and formulae of their own
//! ([`register_accesses`], [`unreduced_stream`]).

use std::cmp::Ordering;
use std::io::{self, Write};

use bitstream_model::Bandwidth;
use bitstream_model::estimate::thesis::data::{DataRow, TABLES};
use bitstream_model::estimate::thesis::recorded::{Design, FLOAT_DESIGN, HALF_DESIGN};
use bitstream_model::estimate::{
    PORTS, PortAccount, Records, StepCycles, StepShape, StepTime, thesis,
};
use bitstream_model::interface::profile::{
    FLOAT, HALF, NAIVE, OnChipMemory, Profile, THESIS_WORDS,
};
use clap::Args;
use indicatif::ProgressBar;
use serde::Serialize;

use crate::failure::Failure;
use crate::numbers::grouped;
use crate::output::facts::fact;
use crate::output::table::{Column, heading, line};

const EXAMPLES: &str = "\
Examples:
  pgs study ladder
  pgs study ladder --collisions 90000 --json

Every figure is modelled: by formula, without stalls on hazards; the thesis' cycles stand beside the
two designs that it measured. Factors are ratios of times, because the clocks differ. Numbers are
counted as the thesis packs them, without padding.";

/// Cycles of a register access (thesis §5.2: 30 to 50 for each request), least and most.
const ACCESS_CYCLES: [u64; 2] = [30, 50];

/// Rows of the velocities that a collision reads, and as many that it writes back.
const ROWS: u32 = 2;

/// Cycles that the velocities' block RAM takes for a collision if each of their words is a row of its
/// own, in one array: before the thesis' directive `ARRAY_PARTITION` (§5.4.3).
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

/// Compare the designs of the thesis' chapter 5, from register accesses to sixteen bits.
#[derive(Debug, Clone, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Options {
    /// Collisions of the step.
    #[arg(long, value_name = "C", default_value_t = thesis::COLLISIONS, value_parser = clap::value_parser!(u64).range(1..=1 << 40))]
    pub(crate) collisions: u64,
    /// Moving bodies of the step.
    #[arg(long, value_name = "B", default_value_t = thesis::BODIES, value_parser = clap::value_parser!(u64).range(1..=1 << 40))]
    pub(crate) bodies: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self { collisions: thesis::COLLISIONS, bodies: thesis::BODIES }
    }
}

/// The ladder.
#[derive(Debug, Serialize)]
pub(crate) struct Outcome {
    pub(crate) bodies: u64,
    pub(crate) collisions: u64,
    pub(crate) passes: u64,
    pub(crate) rungs: Vec<Rung>,
}

/// A design on the ladder.
#[derive(Debug, Serialize)]
pub(crate) struct Rung {
    pub(crate) design: &'static str,
    /// Where the thesis describes it.
    pub(crate) thesis: &'static str,
    /// The change on the design before.
    pub(crate) change: &'static str,
    /// The formula of the cycles.
    pub(crate) formula: String,
    /// Cycles an issue that the streams allow; none without streams.
    pub(crate) interval_by_streams: Option<u32>,
    /// Cycles an issue that the block RAM allows.
    pub(crate) interval_by_ports: Option<u32>,
    pub(crate) collisions_per_issue: u32,
    /// Cycles of a step; the least, if accesses take a range of cycles.
    pub(crate) cycles: u64,
    /// The most.
    pub(crate) cycles_most: u64,
    pub(crate) clock_khz: u32,
    pub(crate) milliseconds: f64,
    /// With the memory bandwidth that a ZCU102 sustains.
    pub(crate) milliseconds_sustained: f64,
    /// Time of the design before, in units of this one's; none for the first.
    pub(crate) factor: Option<f64>,
    /// Time of the first design, in units of this one's.
    pub(crate) factor_in_all: f64,
    pub(crate) bound_by: &'static str,
    /// Cycles that the thesis prints, for its own step.
    pub(crate) recorded_cycles: Option<u64>,
}

/// A design's name, its section, and its change on the design before.
#[derive(Debug, Clone, Copy)]
struct Named {
    design: &'static str,
    thesis: &'static str,
    change: &'static str,
}

/// A design before its factors are known.
struct Modelled {
    named: Named,
    formula: String,
    /// By streams and by ports.
    intervals: Option<[u32; 2]>,
    collisions_per_issue: u32,
    cycles: [u64; 2],
    clock_khz: u32,
    /// Time with the bandwidth that a ZCU102 sustains, ms, where memory can limit the design.
    sustained: Option<f64>,
    bound_by: &'static str,
    recorded: Option<&'static Design>,
}

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

/// Cycles of a step on one stream of 32 bits each way: a word a cycle, results out while poses come in.
fn unreduced_stream(words: Unreduced, step: &StepShape) -> u64 {
    let passes = step.passes().saturating_mul(step.collisions).saturating_mul(words.collision);
    let bodies = step.bodies.saturating_mul(words.velocity + words.pose.max(words.result));
    passes.saturating_add(bodies)
}

/// Models the ladder.
#[expect(clippy::unnecessary_wraps, reason = "every study has this form")]
pub(crate) fn measure(options: &Options, _progress: &ProgressBar) -> Result<Outcome, Failure> {
    let step = StepShape::new(options.bodies, options.collisions);
    let is_thesis_step = step == StepShape::new(thesis::BODIES, thesis::COLLISIONS);
    let mut rungs: Vec<Rung> = Vec::new();
    for modelled in designs(&step) {
        let milliseconds = modelled.cycles[0] as f64 / f64::from(modelled.clock_khz);
        let factor = |of: &Rung| of.milliseconds / milliseconds;
        rungs.push(Rung {
            design: modelled.named.design,
            thesis: modelled.named.thesis,
            change: modelled.named.change,
            formula: modelled.formula,
            interval_by_streams: modelled.intervals.map(|[streams, _]| streams),
            interval_by_ports: modelled.intervals.map(|[_, ports]| ports),
            collisions_per_issue: modelled.collisions_per_issue,
            cycles: modelled.cycles[0],
            cycles_most: modelled.cycles[1],
            clock_khz: modelled.clock_khz,
            milliseconds,
            milliseconds_sustained: modelled.sustained.unwrap_or(milliseconds),
            factor: rungs.last().map(factor),
            factor_in_all: rungs.first().map_or(1.0, factor),
            bound_by: modelled.bound_by,
            recorded_cycles: modelled.recorded.filter(|_| is_thesis_step).map(|d| d.cycles),
        });
    }
    let StepShape { bodies, collisions, .. } = step;
    Ok(Outcome { bodies, collisions, passes: step.passes(), rungs })
}

/// The designs in the thesis' order.
fn designs(step: &StepShape) -> [Modelled; 8] {
    let named = |design, thesis, change| Named { design, thesis, change };
    [
        by_accesses(step),
        by_one_stream(step),
        by_profile(
            step,
            &NAIVE,
            VelocityRow::Word,
            named("naive", "§5.4.1", "conversion inside the solvers, reduced records"),
        ),
        by_profile(
            step,
            &ONE_WIDE_STREAM,
            VelocityRow::Word,
            named(ONE_WIDE_STREAM.name, "§5.4.2", "four words a cycle"),
        ),
        by_profile(
            step,
            &FOUR_STREAMS,
            VelocityRow::Word,
            named(FOUR_STREAMS.name, "§5.4.2", "four DMAs"),
        ),
        by_profile(
            step,
            &FLOAT,
            VelocityRow::Whole,
            named("float", "§5.4.3, §5.4.4", "a velocity is one row: an issue every 2 cycles"),
        ),
        by_profile(
            step,
            &ONE_COPY_HALF,
            VelocityRow::Whole,
            named(ONE_COPY_HALF.name, "§5.5.2", "sixteen bits, two collisions an issue, 250 MHz"),
        ),
        by_profile(
            step,
            &HALF,
            VelocityRow::Whole,
            named("half", "§5.5.3", "a second copy of the velocities"),
        ),
    ]
}

/// The design whose every word is a request.
fn by_accesses(step: &StepShape) -> Modelled {
    let words = Unreduced::of_thesis();
    let Unreduced { collision, velocity, pose, result } = words;
    let [least, most] = ACCESS_CYCLES;
    Modelled {
        named: Named {
            design: "register accesses",
            thesis: "§5.2",
            change: "memory-mapped: each word a request",
        },
        formula: format!(
            "({} passes x {collision} C + ({velocity} + {pose} + {result}) B) x {least} to {most}",
            step.passes(),
        ),
        intervals: None,
        collisions_per_issue: 1,
        cycles: ACCESS_CYCLES.map(|cycles| register_accesses(words.words(step), cycles)),
        clock_khz: NAIVE.clock_khz,
        sustained: None,
        bound_by: "accesses",
        recorded: None,
    }
}

/// The first design with DMA, whose records are not reduced.
fn by_one_stream(step: &StepShape) -> Modelled {
    let words = Unreduced::of_thesis();
    let Unreduced { collision, velocity, pose, result } = words;
    let interval = u32::try_from(collision).unwrap_or(u32::MAX);
    Modelled {
        named: Named {
            design: "one 32-bit stream",
            thesis: "§5.3.3",
            change: "DMA: a word a cycle",
        },
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
    named: Named,
) -> Modelled {
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
    let issues = if each == 1 { "C".to_owned() } else { format!("ceil(C / {each})") };
    Modelled {
        named,
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
        recorded: [FLOAT_DESIGN, HALF_DESIGN]
            .iter()
            .find(|design| std::ptr::eq(design.profile, profile)),
    }
}

const COLUMNS: [Column; 11] = [
    Column { name: "design", unit: "", width: 22 },
    Column { name: "streams", unit: "cycles", width: 7 },
    Column { name: "ports", unit: "cycles", width: 6 },
    Column { name: "each", unit: "coll.", width: 5 },
    Column { name: "cycles", unit: "modelled", width: 13 },
    Column { name: "thesis", unit: "recorded", width: 9 },
    Column { name: "time", unit: "ms", width: 9 },
    Column { name: "12.8 GB/s", unit: "ms", width: 9 },
    Column { name: "factor", unit: "", width: 6 },
    Column { name: "in all", unit: "", width: 7 },
    Column { name: "bound by", unit: "", width: 8 },
];

/// Shows the ladder.
pub(crate) fn show(outcome: &Outcome, out: &mut dyn Write) -> io::Result<()> {
    let step = format!(
        "{} bodies, {} collisions, {} passes; numbers as the thesis packs them",
        grouped(outcome.bodies),
        grouped(outcome.collisions),
        outcome.passes
    );
    fact(out, "step", &step)?;
    writeln!(out)?;
    heading(out, &COLUMNS)?;
    for rung in &outcome.rungs {
        line(out, &COLUMNS, cells(rung))?;
    }
    writeln!(out)?;
    for rung in &outcome.rungs {
        let range = match rung.cycles_most > rung.cycles {
            true => format!("; up to {} cycles", grouped(rung.cycles_most)),
            false => String::new(),
        };
        let text =
            format!("{} ({}): {} = {}{range}", rung.design, rung.thesis, rung.change, rung.formula);
        fact(out, "", &text)?;
    }
    Ok(())
}

fn cells(rung: &Rung) -> [String; COLUMNS.len()] {
    let interval = |cycles: Option<u32>| cycles.map_or_else(|| "-".to_owned(), |c| c.to_string());
    let factor = |factor: f64| format!("{factor:.2}");
    [
        format!("{:<22}", rung.design),
        interval(rung.interval_by_streams),
        interval(rung.interval_by_ports),
        rung.collisions_per_issue.to_string(),
        grouped(rung.cycles),
        rung.recorded_cycles.map_or_else(|| "-".to_owned(), grouped),
        format!("{:.3}", rung.milliseconds),
        format!("{:.3}", rung.milliseconds_sustained),
        rung.factor.map_or_else(|| "-".to_owned(), factor),
        format!("{:.1}", rung.factor_in_all),
        rung.bound_by.to_owned(),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ladder(options: &Options) -> Outcome {
        measure(options, &ProgressBar::hidden()).expect("a ladder")
    }

    #[test]
    fn each_design_takes_the_cycles_of_a_calculation_by_hand() {
        let outcome = ladder(&Options::default());
        let cycles: Vec<u64> = outcome.rungs.iter().map(|rung| rung.cycles).collect();
        let (bodies, collisions) = (38_880, 127_000);
        let accesses = (8 * 56 * collisions + (8 + 17 + 8) * bodies) * 30;
        assert_eq!(cycles[0], accesses);
        assert_eq!(outcome.rungs[0].cycles_most, accesses / 30 * 50);
        assert_eq!(cycles[1], 8 * 56 * collisions + 25 * bodies);
        // Twelve cycles a collision; fill 4 x 374 + 4 x 314 + 264; 6 + 7 words a body, four a cycle.
        let wide = 8 * 12 * collisions + 2_752 + 264 + (6 + 7) * bodies / 4;
        assert_eq!(cycles[3], wide);
        assert_eq!(
            &cycles[5..],
            [2_066_606, 8 * 254_000 + 2_680 + 264 + 11_664 + 13_608, 1_552_216]
        );
        let recorded: Vec<Option<u64>> =
            outcome.rungs.iter().map(|rung| rung.recorded_cycles).collect();
        assert_eq!(recorded[5], Some(2_062_697));
        assert_eq!(recorded[7], Some(1_557_317));
        assert_eq!(recorded.iter().flatten().count(), 2);
    }

    #[test]
    fn a_design_issues_no_faster_than_its_streams_and_ports() {
        for rung in ladder(&Options::default()).rungs {
            let Some((streams, ports)) = rung.interval_by_streams.zip(rung.interval_by_ports)
            else {
                continue;
            };
            let issues = 8 * 127_000 / u64::from(rung.collisions_per_issue);
            let interval = rung.cycles / issues;
            assert_eq!(interval, streams.max(ports).into(), "{}", rung.design);
        }
    }

    #[test]
    fn factors_are_ratios_of_times() {
        let outcome = ladder(&Options { collisions: 1000, bodies: 10 });
        let product: f64 = outcome.rungs.iter().filter_map(|rung| rung.factor).product();
        let last = outcome.rungs.last().expect("a design");
        assert!((product / last.factor_in_all - 1.0).abs() < 1e-12);
        assert!(outcome.rungs.iter().all(|rung| rung.recorded_cycles.is_none()));
    }
}
