//! The study `ladder`: the designs of the thesis' chapter 5 one behind the other, and the factor
//! that each brings.
//!
//! A design is a profile where there is one. A design that differs in few properties from a profile
//! is made from it, so that all of them go through one formula. Two designs have other records, or
//! no streams, and formulae of their own.

mod designs;
mod show;

use crate::estimate::{StepShape, thesis};
use crate::experiment::{Boards, Experiment, given};
use clap::Args;

use self::designs::designs;

const EXAMPLES: &str = "\
Examples:
  pgs thesis ladder
  pgs thesis ladder --collisions 90000 --json

Every figure is modelled: by formula, without stalls on hazards; the thesis' cycles stand beside the
two designs that it measured. Factors are ratios of times, because the clocks differ. Numbers are
counted as the thesis packs them, without padding.

Streams and ports are the cycles that the streams and the block RAM need for an issue; a design
takes the larger. Up to four streams each word of a velocity is taken for a row of its own, 24
accesses a collision on two ports, and from float on a velocity for one row (thesis 5.4.3 tells that
the arrays were partitioned, and not how they were before). Before the reduction every pass is taken
to read the 56 words of Table 4.1.";

/// The experiment.
pub(crate) static LADDER: Experiment = Experiment {
    id: "ladder",
    thesis: "Chapter 5",
    about: "The designs of chapter 5, from register accesses to sixteen bits",
    boards: Boards::None,
    arguments: Options::augment_args,
    run: |args, _| Ok(measure(&given(args)?).part()),
};

/// Its arguments.
#[derive(Debug, Clone, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Options {
    /// Collisions of the step.
    #[arg(
        long,
        value_name = "C",
        default_value_t = thesis::COLLISIONS,
        value_parser = clap::value_parser!(u64).range(1..=1 << 40)
    )]
    pub(crate) collisions: u64,
    /// Moving bodies of the step.
    #[arg(
        long,
        value_name = "B",
        default_value_t = thesis::BODIES,
        value_parser = clap::value_parser!(u64).range(1..=1 << 40)
    )]
    pub(crate) bodies: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self { collisions: thesis::COLLISIONS, bodies: thesis::BODIES }
    }
}

/// The ladder.
#[derive(Debug)]
pub(crate) struct Outcome {
    pub(crate) step: StepShape,
    pub(crate) rungs: [Rung; 8],
}

/// A design on the ladder.
#[derive(Debug)]
pub(crate) struct Rung {
    pub(crate) design: &'static str,
    /// Where the thesis describes it.
    pub(crate) thesis: &'static str,
    /// The change on the design before.
    pub(crate) change: &'static str,
    /// The formula of the cycles.
    pub(crate) formula: String,
    /// Cycles an issue that streams and block RAM allow; none without streams.
    pub(crate) intervals: Option<[u32; 2]>,
    /// Cycles an issue that the thesis prints.
    pub(crate) recorded_interval: Option<u32>,
    pub(crate) collisions_per_issue: u32,
    /// Cycles of a step, least and most: accesses take a range of cycles.
    pub(crate) cycles: [u64; 2],
    pub(crate) clock_khz: u32,
    /// Time with the memory bandwidth that a ZCU102 sustains, ms, where memory can limit the
    /// design.
    pub(crate) sustained: Option<f64>,
    /// Time of the design before, in units of this one's; none for the first.
    pub(crate) factor: Option<f64>,
    /// Time of the first design, in units of this one's.
    pub(crate) factor_in_all: f64,
    pub(crate) bound_by: &'static str,
    /// Cycles that the thesis prints, for its own step.
    pub(crate) recorded_cycles: Option<u64>,
}

impl Rung {
    pub(crate) fn milliseconds(&self) -> f64 {
        self.cycles[0] as f64 / f64::from(self.clock_khz)
    }
}

/// Models the ladder.
pub(crate) fn measure(options: &Options) -> Outcome {
    let step = StepShape::new(options.bodies, options.collisions);
    let mut rungs = designs(&step);
    let times: Vec<f64> = rungs.iter().map(Rung::milliseconds).collect();
    for (place, rung) in rungs.iter_mut().enumerate() {
        rung.factor = (place > 0).then(|| times[place - 1] / times[place]);
        rung.factor_in_all = times[0] / times[place];
        rung.recorded_cycles = rung.recorded_cycles.filter(|_| step == thesis::step());
    }
    Outcome { step, rungs }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_design_takes_the_cycles_of_a_calculation_by_hand() {
        let outcome = measure(&Options::default());
        let cycles: Vec<u64> = outcome.rungs.iter().map(|rung| rung.cycles[0]).collect();
        let (bodies, collisions) = (38_880, 127_000);
        let accesses = (8 * 56 * collisions + (8 + 17 + 8) * bodies) * 30;
        assert_eq!(cycles[0], accesses);
        assert_eq!(outcome.rungs[0].cycles[1], accesses / 30 * 50);
        assert_eq!(cycles[1], 8 * 56 * collisions + 25 * bodies);
        // Twelve cycles a collision; fill 4 x 374 + 4 x 314 + 264; 6 + 7 words a body, four a
        // cycle.
        let wide = 8 * 12 * collisions + 2_752 + 264 + (6 + 7) * bodies / 4;
        assert_eq!(cycles[3], wide);
        assert_eq!(
            &cycles[5..],
            [2_066_606, 8 * 254_000 + 2_028 + 177 + 11_664 + 13_608, 1_551_477]
        );
        let recorded: Vec<Option<u64>> =
            outcome.rungs.iter().map(|rung| rung.recorded_cycles).collect();
        assert_eq!(recorded[5], Some(2_062_697));
        assert_eq!(recorded[7], Some(1_557_317));
        assert_eq!(recorded.iter().flatten().count(), 2);
    }

    #[test]
    fn a_design_issues_no_faster_than_its_streams_and_ports() {
        for rung in measure(&Options::default()).rungs {
            let Some([streams, ports]) = rung.intervals else { continue };
            let issues = 8 * 127_000 / u64::from(rung.collisions_per_issue);
            let interval = rung.cycles[0] / issues;
            assert_eq!(interval, u64::from(streams.max(ports)), "{}", rung.design);
        }
    }

    #[test]
    fn the_thesis_intervals_are_those_of_streams_and_ports() {
        let rungs = measure(&Options::default()).rungs;
        let printed: Vec<_> = rungs.iter().filter_map(|rung| rung.recorded_interval).collect();
        assert_eq!(printed, [2, 4, 3]);
        for rung in rungs.iter().filter(|rung| rung.recorded_interval.is_some()) {
            let ours = rung.intervals.map(|[streams, ports]| streams.max(ports));
            assert_eq!(ours, rung.recorded_interval, "{}", rung.design);
        }
    }

    #[test]
    fn factors_are_ratios_of_times() {
        let outcome = measure(&Options { collisions: 1000, bodies: 10 });
        let product: f64 = outcome.rungs.iter().filter_map(|rung| rung.factor).product();
        let last = outcome.rungs.last().expect("a design");
        assert!((product / last.factor_in_all - 1.0).abs() < 1e-12);
        assert!(outcome.rungs.iter().all(|rung| rung.recorded_cycles.is_none()));
    }
}
