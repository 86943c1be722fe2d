//! The verb `model`: computes the cost of a step by formula, beside every table of the thesis,
//! without running anything.

mod beyond;
pub(crate) mod comparison;
mod data;
mod estimate;
mod euler;
mod memory;
mod ports;
pub(crate) mod render;

mod scene;
mod step;
pub(crate) mod table;
mod warm;
mod window;

use std::io::Write;

use bitstream_model::Bandwidth;
use bitstream_model::estimate::{DESIGNS, MIXED, StepShape, Window, thesis};
use bitstream_model::interface::profile::{Inertia, Profile, Variant};
use clap::builder::PossibleValuesParser;
use clap::{Args, ValueEnum};
use serde_json::json;

use crate::common::CommonArgs;
use crate::failure::{Failure, Verdict};
use crate::numbers::grouped;
use crate::options::build::number;
use crate::output::facts::labelled;
use crate::output::width::stdout_width;
use scene::Scene;
use table::Table;

const EXAMPLES: &str = "\
Examples:
  pgs model                                              the thesis' step, all profiles, all tables
  pgs model --collisions 127000 --bodies 38880 --profile mixed
  pgs model --section step,ports --bandwidth 8.5 --json
  pgs model --markdown > tables.md

The kind of every row is exact (counted), modelled (by formula: a step that stalls on hazards takes
longer), recorded (a figure of the thesis) or open (unknown). No figure was measured.";

/// Version of this verb's JSON layout: 2 since it holds several profiles and the tables.
const SCHEMA: u32 = 2;

/// The name of all profiles on the command line.
const ALL: &str = "all";

/// Show the cost of a step by formula, beside every table of the thesis.
#[derive(Debug, Clone, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct ModelArgs {
    /// Collisions in the step [default: 127000, the thesis' step]
    #[arg(long, value_name = "C", requires = "bodies")]
    collisions: Option<u32>,
    /// Bodies in the step [default: 38880, the thesis' step]
    #[arg(long, value_name = "B", requires = "collisions")]
    bodies: Option<u32>,
    /// Profile of the bitstream
    #[arg(long, value_name = "NAME", default_value = ALL, value_parser = names())]
    profile: String,
    /// Take the profiles with the world inertia of every body, streamed and kept on chip
    #[arg(long)]
    world_inertia: bool,
    /// Memory bandwidth of the table of times in GB/s, or "unlimited" [default: unlimited, 17.07,
    /// 16 and 12.8 in turn]
    #[arg(long, value_name = "GBPS", value_parser = number("bandwidth", |build| build.bandwidth))]
    bandwidth: Option<Bandwidth>,
    /// Tables to show [default: all]
    #[arg(long, value_name = "SECTION", value_delimiter = ',')]
    section: Vec<Section>,
    /// Print Markdown instead of text
    #[arg(long)]
    markdown: bool,
}

/// A group of tables.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Section {
    /// Cycles and time (T6.4, T6.8)
    Step,
    /// mixed against float
    Mixed,
    /// windowed and windowed16 against float
    Windowed,
    /// Words in and out (T4.1 to T4.6)
    Data,
    /// On-chip memory and logic (§4.4.2, T6.4, T6.8)
    Memory,
    /// Stream widths and memory bandwidth
    Streams,
    /// Block RAM ports and the initiation interval
    Ports,
    /// Warm start
    Warm,
    /// Speed-up and energy (T6.5 to T6.7, T6.9 to T6.11, equation 6.5)
    Comparison,
    /// Explicit integration (Figure 2.6)
    Euler,
}

impl Section {
    fn tables(self, scene: &Scene) -> Vec<Table> {
        match self {
            Self::Step => step::tables(scene),
            Self::Mixed => beyond::tables(scene),
            Self::Windowed => window::tables(scene),
            Self::Data => data::tables(scene),
            Self::Memory => memory::tables(scene),
            Self::Streams => memory::streams(scene),
            Self::Ports => ports::tables(scene),
            Self::Warm => warm::tables(scene),
            Self::Comparison => comparison::tables(scene),
            Self::Euler => euler::tables(),
        }
    }
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

impl ModelArgs {
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

    /// Refuses the sections `mixed`, `windowed` and `warm` without their profiles.
    fn check(&self, json: bool) -> Result<(), Failure> {
        if json && self.markdown {
            return Err(Failure::input("--json and --markdown exclude each other")
                .next("leave one of them out"));
        }
        if self.section.contains(&Section::Mixed) && ![ALL, MIXED.name].contains(&&*self.profile) {
            let message = format!("the section mixed has nothing about profile {}", self.profile);
            return Err(Failure::input(message).next("ask for --profile mixed, or for all"));
        }
        let windowed = |profile: &&'static Profile| {
            Window::of(profile).is_some() && [ALL, profile.name].contains(&&*self.profile)
        };
        if self.section.contains(&Section::Windowed)
            && !DESIGNS.iter().copied().any(|profile| windowed(&profile))
        {
            let message =
                format!("the section windowed has nothing about profile {}", self.profile);
            return Err(Failure::input(message)
                .next("ask for --profile windowed or windowed16, or for all"));
        }
        let starts_warm = |profile: &&'static Profile| {
            profile.stripes.warm_collisions.is_some()
                && [ALL, profile.name].contains(&&*self.profile)
        };
        if self.section.contains(&Section::Warm)
            && !DESIGNS.iter().copied().any(|profile| starts_warm(&profile))
        {
            let message = format!("the section warm has nothing about profile {}", self.profile);
            return Err(Failure::input(message)
                .next("ask for --profile naive, float, half or mixed, or for all"));
        }
        Ok(())
    }

    fn sections(&self) -> Vec<Section> {
        let all = Section::value_variants();
        all.iter()
            .copied()
            .filter(|s| self.section.is_empty() || self.section.contains(s))
            .collect()
    }
}

/// All tables of the thesis' step, for the report.
#[cfg(feature = "report")]
pub(crate) fn thesis_tables() -> Vec<Table> {
    let scene = Scene {
        step: thesis::step(),
        variants: DESIGNS.iter().map(|profile| profile.default_variant()).collect(),
        bandwidths: BANDWIDTHS.to_vec(),
    };
    Section::value_variants().iter().flat_map(|section| section.tables(&scene)).collect()
}

/// Computes and shows the tables.
pub(crate) fn run(
    args: &ModelArgs,
    common: &CommonArgs,
    out: &mut dyn Write,
) -> Result<Verdict, Failure> {
    args.check(common.json)?;
    let scene = args.scene();
    let tables: Vec<Table> =
        args.sections().into_iter().flat_map(|section| section.tables(&scene)).collect();
    let step = &scene.step;

    if common.json {
        let document = json!({
            "schema": SCHEMA,
            "verb": "model",
            "bodies": step.bodies,
            "collisions": step.collisions,
            "contact_iterations": step.contact_iterations,
            "friction_iterations": step.friction_iterations,
            "thesis_step": scene.is_thesis_step(),
            "world_inertia": args.world_inertia,
            "profiles": estimate::profiles(&scene),
            "tables": tables.iter().map(Table::to_json).collect::<Vec<_>>(),
        });
        writeln!(out, "{document:#}")?;
        return Ok(Verdict::Done);
    }

    let head = head(args, &scene);
    if args.markdown {
        writeln!(out, "## What a step costs\n")?;
        for line in head {
            writeln!(out, "{line}\n")?;
        }
        for table in &tables {
            render::markdown(out, table)?;
        }
    } else {
        for line in head {
            labelled(out, "", 0, &line, stdout_width())?;
        }
        writeln!(out)?;
        for table in &tables {
            render::terminal(out, table)?;
        }
    }
    Ok(Verdict::Done)
}

/// The lines above the tables.
fn head(args: &ModelArgs, scene: &Scene) -> Vec<String> {
    let step = &scene.step;
    let mut lines = vec![format!(
        "{} bodies, {} collisions, {} contact and {} friction iterations{}.",
        grouped(step.bodies),
        grouped(step.collisions),
        step.contact_iterations,
        step.friction_iterations,
        if scene.is_thesis_step() { ": the thesis' step (iterations inferred)" } else { "" },
    )];
    if !scene.is_thesis_step() {
        lines.push(format!(
            "The thesis' figures and the notes on them are of its own step: {} bodies, {} collisions.",
            grouped(thesis::BODIES),
            grouped(thesis::COLLISIONS),
        ));
    }
    if args.world_inertia {
        lines.push(
            "With the world inertia of every body, which the thesis does not have.".to_owned(),
        );
    }
    lines.push(
        "Exact: counted. Modelled: by formula, without stalls on hazards. Recorded: the thesis'. \
         Open: not known. Nothing was measured."
            .to_owned(),
    );
    lines
}
