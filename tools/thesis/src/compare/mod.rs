//! Steps two boards from the same start, independently, and measures how far they diverge.

mod spec;

use clap::Args;
use pgs_command::common::{AcceleratorChoice, CommonArgs};
use pgs_command::failure::{Failure, Result};
use step_folder::digest;

use self::spec::SideSpec;
use crate::experiment::{Boards, Experiment, Measure, Part};
use crate::session::Session;
use crate::study::course::{Side, Solver, Steps, take};
use crate::study::start::{Start, StartArgs};
use crate::table::{Cell, Table, text};

const EXAMPLES: &str = "\
Examples:
  pgs thesis compare float float,unchecked --grid 10x10x10 --steps 200
  pgs thesis compare float,hazard-free float,unchecked,as-given --input tests/golden/pile5_step60
  pgs thesis compare float,gpu float,as-given --input tests/golden/pile5_step60
  pgs thesis compare float half --input tests/golden/pile5_step60
  pgs thesis compare half,f32 half --steps 300 --every 10 --json
  pgs thesis compare float,world float,world,unchecked --scene shapes --grid 8x8x8

Examples with the Verilog in simulation (docs/to-a-board.md):
  pgs thesis compare float float --grid 2x2x2 --steps 3 --accelerator \
  rtl:rtl-sim/pgs-rtl

A and B are builds of the emulated board, as behind `--board emulated:` of `pgs run`, whose --help
tells the words. The order of a board's collisions is one word more: auto, as-given, interleaved,
hazard-free, body-by-body, body-by-body-oldest, body-by-body-newest, gpu, random=SEED (another one
in each step). Without an order, a board that waits on hazards takes the
collisions as given, so that two such boards solve them in the same order. Each board detects its
own collisions. `--accelerator` gives board B another accelerator; board A keeps the built-in
model.

Only moving bodies are compared; A is the original. Relative deviations are |B - A| / |A| of each
component (thesis eq. 4.1) and leave out components where A is 0. A velocity is within 1 % if it
differs from A's by at most 1 % of A's; with 0 only 0 agrees. Momenta are shown by their length,
angular momentum is about the origin, potential energy from y = 0. Unmoved is the share of position
components whose bits the step did not change from the ones sent to the board. Penetration is
measured after the step: in a scene over all contacts detected then; in a folder, which has no
geometry, over the step's own contacts, carried along with their bodies.

If a step fails on B, this board stops and A goes on. Exit code 0 if every step was taken, 1 if one
failed.";

/// The experiment.
pub(crate) static COMPARE: Experiment = Experiment::of::<CompareArgs>(
    "compare",
    "§4.6.3, equation 4.1",
    Boards::Own,
    "Two boards from the same start, and how far they diverge",
);

/// Its arguments.
#[derive(Debug, Clone, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct CompareArgs {
    /// Build of the original board.
    #[arg(value_name = "A")]
    a: SideSpec,
    /// Build of the board compared with it.
    #[arg(value_name = "B")]
    b: SideSpec,
    /// Prove before each step on either board that no moving body recurs within the hazard window;
    /// the board fails otherwise
    #[arg(long)]
    verify: bool,
    #[command(flatten)]
    start: StartArgs,
}

/// Measures of a step that are shown.
const MEASURES: [&str; 18] = [
    "collisions",
    "hazards",
    "kinetic_kj",
    "rotational_kj",
    "potential_kj",
    "momentum_n_s",
    "angular_n_m_s",
    "penetration_mean_mm",
    "penetration_most_mm",
    "unmoved_percent",
    "position_mean_percent",
    "position_under_1_percent",
    "position_mean_mm",
    "position_most_percent",
    "linear_within_1_percent",
    "linear_most_m_s",
    "angular_within_1_percent",
    "angular_most_rad_s",
];

impl Measure for CompareArgs {
    /// Steps both boards.
    fn measure(&self, session: &Session) -> Result<Part> {
        let common = session.emulated();
        let mut start = Start::load(&self.start)?;
        start.parameters.verify_order |= self.verify;
        let model = CommonArgs { accelerator: AcceleratorChoice::default(), ..common.clone() };
        let (mut boards, mut orders) = (Vec::new(), Vec::new());
        for (name, spec, common) in [("A", self.a, &model), ("B", self.b, &common)] {
            let about = |failure: Failure| failure.about(format!("board {name} ({spec})"));
            let opened = start.open(spec.build.config(), common, session).map_err(about)?;
            let capabilities = opened.accelerator.capabilities();
            orders.push((
                name,
                spec,
                spec.ordering.apply_to_compare(start.parameters, capabilities),
            ));
            boards.push(opened);
        }
        let begun = start.step_to(&mut boards[0], session)?;
        let side = |(place, (name, spec, parameters)): (usize, (&str, SideSpec, _))| {
            Side::new(name, &start, Solver::Board(place), spec.permutation, parameters)
        };
        let mut sides: Vec<Side> = orders.into_iter().enumerate().map(side).collect();
        let about = |failure: Failure| failure.about(format!("board A ({})", self.a));
        let complete = begun && take(&mut sides, 0, &mut boards, &start, session).map_err(about)?;
        session.end();

        let mut steps = Steps::new("Both boards, and B against A", &MEASURES);
        steps.rows(&start, &sides);
        let mut ends = Table::new("boards", "Both boards at the end");
        let mut part = Part::of(Vec::new());
        part.fact("start", start.text());
        for (side, spec) in sides.iter().zip([self.a, self.b]) {
            let (name, build) = (&side.name, spec.to_string());
            let step = side.failed.as_ref().map(|(step, _)| *step);
            if let Some((step, failure)) = &side.failed {
                part.fact(
                    "failed",
                    format!("{name} ({build}) in step {step}: {}", failure.chain()),
                );
            }
            let digest = format!("{:016x}", digest::of_bodies(side.world.bodies()));
            ends.row([
                ("side", "", text(name)),
                ("build", "build", text(build)),
                ("digest", digest::ALGORITHM, text(digest)),
                ("failed_in_step", "failed\nin step", Cell::known(step, |n| Cell::Whole(n.into()))),
            ]);
        }
        part.agrees = sides.iter().all(|side| side.failed.is_none());
        part.complete = complete && part.agrees;
        part.tables = vec![steps.table, ends];
        Ok(part)
    }
}
