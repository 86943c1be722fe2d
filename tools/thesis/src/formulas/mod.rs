//! The cost of a step by formula, beside every table of the thesis, without running anything.

pub(crate) mod comparison;
mod data;
mod euler;
mod memory;
mod mixed;
mod ports;
mod scene;
mod step;
mod warm;
mod windowed;

use bitstream_model::Bandwidth;
use clap::Args;
use clap::builder::PossibleValuesParser;
use pgs_command::failure::Failure;
use pgs_command::numbers::grouped;
use pgs_command::options::build::number;
use pgs_interface::profile::{Inertia, Profile, Variant};
use serde_json::json;

use self::scene::Scene;
use crate::estimate::{DESIGNS, StepShape, thesis};
use crate::experiment::{Boards, Measured, Part};
use crate::table::Table;

const HELP: &str = "\
The kind of every row is exact (counted), modelled (by formula: a step that stalls on hazards takes
longer), recorded (a figure of the thesis) or open (unknown). No figure was measured.";

/// The name of all designs on the command line.
const ALL: &str = "all";

/// The step, the designs and the bandwidths of the formulas.
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
    /// Take the designs with the world inertia of every body, streamed and kept on chip
    #[arg(long)]
    world_inertia: bool,
    /// Memory bandwidth of the table of times in GB/s, or "unlimited" [default: unlimited, 17.07,
    /// 16 and 12.8 in turn]
    #[arg(long, value_name = "GBPS", value_parser = number("bandwidth", |build| build.bandwidth))]
    bandwidth: Option<Bandwidth>,
}

fn names() -> PossibleValuesParser {
    DESIGNS.iter().map(|profile| profile.name).chain([ALL]).collect::<Vec<_>>().into()
}

const BANDWIDTHS: [Bandwidth; 4] = [
    Bandwidth::Unlimited,
    Bandwidth::ZCU102_PEAK,
    thesis::recorded::MEMORY_BANDWIDTH,
    Bandwidth::ZCU102_SUSTAINED,
];

impl StepArgs {
    fn scene(&self) -> Scene {
        let bodies = self.bodies.map_or(thesis::BODIES, u64::from);
        let collisions = self.collisions.map_or(thesis::COLLISIONS, u64::from);
        let inertia = if self.world_inertia { Inertia::World } else { Inertia::Isotropic };
        let asked =
            |profile: &&&'static Profile| self.profile == ALL || self.profile == profile.name;
        let variant = |profile: &&'static Profile| Variant { inertia, ..profile.default_variant() };
        Scene {
            step: StepShape::new(bodies, collisions),
            variants: DESIGNS.iter().filter(asked).map(variant).collect(),
            bandwidths: self.bandwidth.map_or_else(|| BANDWIDTHS.to_vec(), |one| vec![one]),
        }
    }

    /// The tables of this step.
    fn part(&self, tables: Tables) -> Result<Part, Failure> {
        let scene = self.scene();
        let tables = tables(&scene);
        if tables.is_empty() {
            let error = format!("there is nothing about {} here", self.profile);
            return Err(Failure::input(error).next("ask for another --profile, or for all"));
        }
        let mut part = Part::of(tables);
        part.fact("step", self.head(&scene));
        let step = &scene.step;
        part.data = json!({
            "bodies": step.bodies,
            "collisions": step.collisions,
            "contact_iterations": step.contact_iterations,
            "friction_iterations": step.friction_iterations,
            "thesis_step": scene.is_thesis_step(),
            "world_inertia": self.world_inertia,
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
        if self.world_inertia {
            text += " With the world inertia of every body, which the thesis does not have.";
        }
        text
    }
}

/// Tables by formula.
type Tables = fn(&Scene) -> Vec<Table>;

/// Experiments that only calculate, with the functions of their tables.
pub(crate) static FORMULAS: [(Measured<StepArgs>, Tables); 10] = [
    (
        Measured {
            id: "step",
            thesis: "Tables 6.4 and 6.8",
            about: "Cycles and time of a step, and what world inertia costs",
            boards: Boards::None,
            run: |args, _| args.part(step::tables),
        },
        step::tables,
    ),
    (
        Measured {
            id: "mixed",
            thesis: "§7.3",
            about: "A design of ours, mixed, against float",
            boards: Boards::None,
            run: |args, _| args.part(mixed::tables),
        },
        mixed::tables,
    ),
    (
        Measured {
            id: "windowed",
            thesis: "§4.7, §7.3",
            about: "Two designs that stream the collisions once, against float",
            boards: Boards::None,
            run: |args, _| args.part(windowed::tables),
        },
        windowed::tables,
    ),
    (
        Measured {
            id: "data",
            thesis: "§4.4.1, Tables 4.1 to 4.6",
            about: "Words in and out",
            boards: Boards::None,
            run: |args, _| args.part(data::tables),
        },
        data::tables,
    ),
    (
        Measured {
            id: "memory",
            thesis: "§4.4.2, Tables 6.4 and 6.8",
            about: "On-chip memory and logic",
            boards: Boards::None,
            run: |args, _| args.part(memory::tables),
        },
        memory::tables,
    ),
    (
        Measured {
            id: "streams",
            thesis: "§5.4.2",
            about: "Stream widths and memory bandwidth",
            boards: Boards::None,
            run: |args, _| args.part(memory::streams),
        },
        memory::streams,
    ),
    (
        Measured {
            id: "ports",
            thesis: "§5.4.3, §5.5",
            about: "Block RAM ports and the initiation interval",
            boards: Boards::None,
            run: |args, _| args.part(ports::tables),
        },
        ports::tables,
    ),
    (
        Measured {
            id: "warm",
            thesis: "§2.2.3",
            about: "The cost of a warm start",
            boards: Boards::None,
            run: |args, _| args.part(warm::tables),
        },
        warm::tables,
    ),
    (
        Measured {
            id: "comparison",
            thesis: "§6.4, §6.5, Tables 6.5 to 6.7 and 6.9 to 6.11",
            about: "Speed-up and energy against GPU and CPU",
            boards: Boards::None,
            run: |args, _| args.part(comparison::tables),
        },
        comparison::tables,
    ),
    (
        Measured {
            id: "euler",
            thesis: "§2.1.3, Figure 2.6",
            about: "Explicit integration of a fall",
            boards: Boards::None,
            run: |args, _| args.part(euler::tables),
        },
        euler::tables,
    ),
];

/// All tables of the thesis' step, for the report.
pub(crate) fn thesis_tables() -> Vec<Table> {
    let scene = Scene {
        step: thesis::step(),
        variants: DESIGNS.iter().map(|profile| profile.default_variant()).collect(),
        bandwidths: BANDWIDTHS.to_vec(),
    };
    FORMULAS.iter().flat_map(|(_, tables)| tables(&scene)).collect()
}
