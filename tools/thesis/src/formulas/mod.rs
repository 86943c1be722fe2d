//! The cost of a step by formula, beside every table of the thesis, without running anything.

mod comparison;
mod cycles;
mod data;
mod euler;
mod memory;
mod rows;
mod scene;
mod warm;

use clap::builder::PossibleValuesParser;
use clap::{ArgMatches, Args, Command};
use pgs_command::failure::Result;
use pgs_command::numbers::grouped;
use pgs_interface::profile::{PROFILES, Profile};
use serde_json::json;

use self::scene::Scene;
use crate::estimate::{StepShape, thesis};
use crate::experiment::{Boards, Experiment, Part, given};
use crate::session::Session;
use crate::table::Table;

const HELP: &str = "\
The kind of every row is exact (counted), modelled (by formula: a step that stalls on hazards takes
longer), recorded (a figure of the thesis) or open (unknown). No figure was measured.";

/// The name of all designs on the command line.
const ALL: &str = "all";

/// The step and the designs of the formulas.
#[derive(Debug, Clone, Args)]
#[command(after_help = HELP)]
pub(crate) struct StepArgs {
    /// Collisions in the step [default: 127000, the thesis' step]
    #[arg(long, value_name = "C", requires = "bodies")]
    collisions: Option<u32>,
    /// Bodies in the step [default: 38880, the thesis' step]
    #[arg(long, value_name = "B", requires = "collisions")]
    bodies: Option<u32>,
    /// Design whose rows are shown
    #[arg(long, value_name = "NAME", default_value = ALL, value_parser = names())]
    profile: String,
}

fn names() -> PossibleValuesParser {
    PROFILES.iter().map(|profile| profile.name).chain([ALL]).collect::<Vec<_>>().into()
}

impl StepArgs {
    fn scene(&self) -> Scene {
        let bodies = self.bodies.map_or(thesis::BODIES, u64::from);
        let collisions = self.collisions.map_or(thesis::COLLISIONS, u64::from);
        let asked =
            |profile: &&&'static Profile| self.profile == ALL || self.profile == profile.name;
        Scene {
            step: StepShape::new(bodies, collisions),
            variants: PROFILES
                .iter()
                .filter(asked)
                .map(|profile| profile.default_variant())
                .collect(),
        }
    }

    /// The tables of this step.
    fn part(&self, tables: Tables) -> Result<Part> {
        let scene = self.scene();
        let tables = tables(&scene);
        // The thesis has its own step and its own designs alone.
        let of_thesis = scene.is_thesis_step() && self.profile == ALL;
        let rows = if of_thesis { rows::of(&tables) } else { Vec::new() };
        let mut part = Part { rows, ..Part::of(tables) };
        part.fact("step", self.head(&scene));
        let step = &scene.step;
        part.data = json!({
            "bodies": step.bodies,
            "collisions": step.collisions,
            "contact_iterations": step.contact_iterations,
            "friction_iterations": step.friction_iterations,
            "thesis_step": scene.is_thesis_step(),
        });
        Ok(part)
    }

    /// The lines above the tables.
    fn head(&self, scene: &Scene) -> String {
        let step = &scene.step;
        let mut text = format!(
            "{} bodies, {} collisions, {} contact and {} friction iterations{}.",
            grouped(step.bodies),
            grouped(step.collisions),
            step.contact_iterations,
            step.friction_iterations,
            if scene.is_thesis_step() { ": the thesis' step (iterations inferred)" } else { "" },
        );
        if !scene.is_thesis_step() {
            text += &format!(
                " The thesis' figures and the notes on them are of its own step: {} bodies, {} \
                 collisions.",
                grouped(thesis::BODIES),
                grouped(thesis::COLLISIONS),
            );
        }
        text
    }
}

/// The tables of the step that the arguments give.
fn part(args: &ArgMatches, tables: Tables) -> Result<Part> {
    given::<StepArgs>(args)?.part(tables)
}

/// Tables by formula.
type Tables = fn(&Scene) -> Vec<Table>;

/// An experiment that only calculates.
const fn formula(
    [id, thesis, about]: [&'static str; 3],
    run: fn(&ArgMatches, &Session) -> Result<Part>,
) -> Experiment {
    let (boards, arguments) = (Boards::None, StepArgs::augment_args as fn(Command) -> Command);
    Experiment { id, thesis, about, boards, arguments, run }
}

const CYCLES: [&str; 3] = ["cycles", "Tables 6.4 and 6.8", "Cycles and time of a step"];
const DATA: [&str; 3] = ["data", "§4.4.1, Tables 4.1 to 4.6", "Words in and out"];
const MEMORY: [&str; 3] = ["memory", "§4.4.2, Tables 6.4 and 6.8", "On-chip memory and logic"];
const WARM: [&str; 3] = ["warm", "§2.2.3", "The cost of a warm start"];
const COMPARISON: [&str; 3] = [
    "comparison",
    "§6.4, §6.5, Tables 6.5 to 6.7 and 6.9 to 6.11",
    "Speed-up and energy against GPU and CPU",
];
const EULER: [&str; 3] = ["euler", "§2.1.3, Figure 2.6", "Explicit integration of a fall"];

/// All of them.
pub(crate) static FORMULAS: [Experiment; 6] = [
    formula(CYCLES, |args, _| part(args, cycles::tables)),
    formula(DATA, |args, _| part(args, data::tables)),
    formula(MEMORY, |args, _| part(args, memory::tables)),
    formula(WARM, |args, _| part(args, warm::tables)),
    formula(COMPARISON, |args, _| {
        let mut part = part(args, comparison::tables)?;
        comparison::figures(&mut part);
        Ok(part)
    }),
    formula(EULER, |args, _| {
        let mut part = part(args, euler::tables)?;
        euler::figures(&mut part);
        Ok(part)
    }),
];

/// The parts of the thesis' step.
#[cfg(test)]
pub(crate) fn thesis_parts() -> Vec<Part> {
    let args = StepArgs::augment_args(Command::new("step")).get_matches_from(["step"]);
    let session = Session::new(&pgs_command::common::CommonArgs::emulated());
    FORMULAS.iter().map(|formula| (formula.run)(&args, &session).expect("tables")).collect()
}
