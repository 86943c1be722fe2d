//! Command line of the co-simulation. `--help` lists the verbs.
#![forbid(unsafe_code)]
#![allow(clippy::print_stderr, reason = "a program says what it does")]

use std::error::Error;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use bitstream_model::external::{
    ExternalAccelerator, ExternalError, LockStep, ModelAccelerator, SimulatorProcess, serve,
};
use bitstream_model::{BoardConfig, Hazards};
use clap::{Parser, Subcommand, ValueEnum};
use cosim::accesses;
use cosim::crowded;
use cosim::flaws::{Flawed, Flaws};
use cosim::mutation::{MUTATIONS, Mutation};
use cosim::outcome::{self, Arrival, Outcome, difference};
use cosim::packets::packets;
use cosim::refusal::{Refusal, refusals};
use cosim::scene::Scene;
use cosim::{full, random, recorded};
use pgs_interface::control::{BODY_CAPACITY, COLLISION_CAPACITY, QUEUE, error};
use pgs_interface::profile::{FLOAT, HALF, Inertia, Profile, Variant};
use pgs_interface::register::Register;
use rtlgen::design::{Design, Parameters};
use rtlgen::emit::{self, File};
use rtlgen::ending::without_result;
use rtlgen::simulator;
use rtlgen::simulator::Waveform;
use step_folder::folder::Folder;

/// Runs the generated Verilog beside the model, beat by beat.
#[derive(Debug, Parser)]
#[command(name = "cosim", version, after_help = EXAMPLES)]
struct Cli {
    #[command(subcommand)]
    verb: Verb,
}

const EXAMPLES: &str = "\
Examples:
  rtlgen simulator --out target/rtl    build the simulator target/rtl/pgs-rtl
  cosim recorded --simulator target/rtl/pgs-rtl tests/golden/*/
  cosim random --simulator target/rtl/pgs-rtl --cases 1000
  cosim random --simulator target/rtl/pgs-rtl --gaps 300 --stalls 700
  cosim random --simulator target/rtl-world/pgs-rtl --inertia world
  cosim errors --simulator target/rtl/pgs-rtl
  cosim full --simulator target/rtl/pgs-rtl
  cosim crowded --simulator target/rtl/pgs-rtl --queue 64
  cosim registers --simulator target/rtl/pgs-rtl --cases 500
  cosim mutations                      builds a simulator for each: about a minute and a half each

Exit codes: 0 done; 1 a difference, or a mutation that nothing found; 2 wrong usage or an error; \
77 a
tool that the verb needs is not installed.";

/// The behaviour of the hardware on a hazard.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum HazardMode {
    /// Waits for the velocity.
    Interlocked,
    /// Reads the stale velocity, and counts.
    Unchecked,
}

/// The form of the bodies' inertia.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum InertiaForm {
    /// Equal about every axis, by the shape.
    Isotropic,
    /// Any, streamed with every body, with its mass.
    World,
}

impl From<InertiaForm> for Inertia {
    fn from(form: InertiaForm) -> Self {
        match form {
            InertiaForm::Isotropic => Self::Isotropic,
            InertiaForm::World => Self::World,
        }
    }
}

/// The profiles that have Verilog.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum ProfileName {
    /// f32.
    Float,
    /// binary16.
    Half,
}

impl ProfileName {
    fn profile(self) -> &'static Profile {
        match self {
            Self::Float => &FLOAT,
            Self::Half => &HALF,
        }
    }
}

/// The build of the hardware.
#[derive(Debug, Clone, Copy, clap::Args)]
struct BuildArgs {
    /// The treatment of hazards for which it was built
    #[arg(long, value_enum, default_value_t = HazardMode::Interlocked)]
    hazards: HazardMode,
    /// The profile for which it was built
    #[arg(long, value_enum, default_value_t = ProfileName::Float)]
    profile: ProfileName,
    /// The inertia for which it was built
    #[arg(long, value_enum, default_value_t = InertiaForm::Isotropic)]
    inertia: InertiaForm,
    /// The depth of the issue queue with which it was built [default: that of the default build]
    #[arg(long, value_name = "N")]
    queue: Option<u32>,
}

impl BuildArgs {
    /// The configuration of a model that equals the generated hardware.
    fn config(self) -> BoardConfig {
        let hazards = match self.hazards {
            HazardMode::Interlocked => Hazards::Interlocked,
            HazardMode::Unchecked => Hazards::Unchecked,
        };
        let (profile, inertia) = (self.profile.profile(), self.inertia.into());
        let fence = Some(Parameters::of(profile, inertia).memory);
        BoardConfig { profile, hazards, inertia, fence, queue: self.queue, ..Default::default() }
    }
}

/// A simulator and how its streams behave.
#[derive(Debug, Clone, clap::Args)]
struct SimulatorArgs {
    /// The simulator that `rtlgen simulator` built
    #[arg(long, value_name = "PATH")]
    simulator: PathBuf,
    #[command(flatten)]
    build: BuildArgs,
    /// Cycles in a thousand in which a stream into the accelerator has no beat
    #[arg(long, value_name = "N", default_value_t = 0)]
    gaps: u32,
    /// Cycles in a thousand in which a stream out of the accelerator takes no beat
    #[arg(long, value_name = "N", default_value_t = 0)]
    stalls: u32,
}

impl SimulatorArgs {
    /// The arguments of the simulator's program.
    fn disturbance(&self) -> [String; 3] {
        [self.gaps, self.stalls, 1].map(|number| number.to_string())
    }
}

#[derive(Debug, Subcommand)]
enum Verb {
    /// Recorded steps: the results against the folders' own, counters against the model
    Recorded {
        #[command(flatten)]
        simulator: SimulatorArgs,
        /// Folders of recorded steps
        #[arg(required = true)]
        folders: Vec<PathBuf>,
    },
    /// Random steps of every kind, sound and faulty, against the model
    Random {
        #[command(flatten)]
        simulator: SimulatorArgs,
        /// Steps
        #[arg(long, value_name = "N", default_value_t = 500)]
        cases: u64,
        /// Seed of the first step
        #[arg(long, value_name = "S", default_value_t = 1)]
        seed: u64,
    },
    /// Every error code of the accelerator: the model's report and the hardware's
    Errors {
        #[command(flatten)]
        simulator: SimulatorArgs,
    },
    /// Steps whose streams out are full for a while
    Full {
        #[command(flatten)]
        simulator: SimulatorArgs,
    },
    /// Steps whose collisions hinder each other: one body in all, and a pair that starves
    Crowded {
        #[command(flatten)]
        simulator: SimulatorArgs,
    },
    /// Random register accesses before, in and after a step, in lock step with the model
    Registers {
        #[command(flatten)]
        simulator: SimulatorArgs,
        /// Steps
        #[arg(long, value_name = "N", default_value_t = 200)]
        cases: u64,
        /// Seed of the first step
        #[arg(long, value_name = "S", default_value_t = 1)]
        seed: u64,
    },
    /// The model as a simulator: requests on standard input, answers on standard output
    ///
    /// For tests of boards with an accelerator in another process, where no simulator can be built.
    Model {
        #[command(flatten)]
        build: BuildArgs,
        /// Flips the lowest bit of the first word of this body's linear velocity
        #[arg(long, value_name = "BODY")]
        wrong: Option<usize>,
        /// Ends the process after this number of exchanges of beats
        #[arg(long, value_name = "N")]
        dies_after: Option<u64>,
        /// Stops answering after this number of exchanges of beats
        #[arg(long, value_name = "N")]
        hangs_after: Option<u64>,
        /// GAPS, STALLS, SEED and WAVEFORM of a real simulator; without effect here
        #[arg(hide = true)]
        ignored: Vec<String>,
    },
    /// Seeded mistakes in the Verilog: each must be found
    Mutations {
        /// Steps that look for each
        #[arg(long, value_name = "N", default_value_t = 300)]
        cases: u64,
        /// Plants the ones alone that have this text in their name, or one of these
        #[arg(long, value_name = "TEXT")]
        only: Vec<String>,
    },
}

type Failure = Box<dyn Error>;

fn main() -> ExitCode {
    let mut out = io::stdout().lock();
    let done = act(&Cli::parse().verb, &mut out);
    let Err(error) = done else { return done.unwrap_or(ExitCode::SUCCESS) };
    without_result(error.as_ref())
}

fn act(verb: &Verb, out: &mut dyn Write) -> Result<ExitCode, Failure> {
    let good = match verb {
        Verb::Recorded { simulator, folders } => run_recorded(simulator, folders, out)?,
        Verb::Random { simulator, cases, seed } => {
            let mut bench = Bench::new(simulator)?;
            match first_difference(&mut bench, *seed, *cases)? {
                None => {
                    writeln!(out, "{cases} random steps from seed {seed}: the model's outcomes")?;
                    true
                }
                Some(difference) => {
                    writeln!(out, "{difference}")?;
                    false
                }
            }
        }
        Verb::Registers { simulator, cases, seed } => {
            let rtl = SimulatorProcess::start_with(&simulator.simulator, &simulator.disturbance())?;
            let mut both = LockStep::new(&simulator.build.config(), Box::new(rtl), None)?;
            for seed in *seed..*seed + *cases {
                let difference =
                    match accesses::run(&mut both, simulator.build.config().variant(), seed) {
                        Ok(true) => continue,
                        Ok(false) => "neither ends the step".to_owned(),
                        Err(ExternalError::Difference(difference)) => difference.to_string(),
                        Err(error) => return Err(error.into()),
                    };
                writeln!(out, "seed {seed}: {difference}")?;
                return Ok(ExitCode::FAILURE);
            }
            writeln!(
                out,
                "{cases} steps among random register accesses from seed {seed}: as the model"
            )?;
            true
        }
        Verb::Full { simulator } => {
            let Bench { variant, mut model, mut rtl, .. } = Bench::new(simulator)?;
            let difference = full::first_difference(variant, &mut *model, &mut *rtl)?;
            let text = difference.as_deref().unwrap_or("the model's outcomes with full streams");
            writeln!(out, "{text}")?;
            difference.is_none()
        }
        Verb::Crowded { simulator } => run_crowded(simulator, out)?,
        Verb::Errors { simulator } => run_errors(simulator, out)?,
        Verb::Model { build, wrong, dies_after, hangs_after, .. } => {
            let [dies_after, hangs_after] = [*dies_after, *hangs_after];
            let flaws = Flaws { wrong: *wrong, dies_after, hangs_after };
            let mut flawed = Flawed::new(ModelAccelerator::new(&build.config())?, flaws);
            serve(&mut flawed, &mut io::stdin().lock(), out)?;
            true
        }
        Verb::Mutations { cases, only } => run_mutations(*cases, only, out)?,
    };
    Ok(if good { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// The Verilog and the model side by side.
struct Bench {
    variant: Variant,
    arrival: Arrival,
    rtl: Box<dyn ExternalAccelerator>,
    model: Box<dyn ExternalAccelerator>,
}

impl Bench {
    fn new(args: &SimulatorArgs) -> Result<Self, Failure> {
        let SimulatorArgs { simulator, build, gaps, stalls } = args;
        let rtl = SimulatorProcess::start_with(simulator, &args.disturbance())?;
        let steady = *gaps == 0 && *stalls == 0;
        let arrival = if steady { Arrival::Steady } else { Arrival::Disturbed };
        let config = build.config();
        let model = ModelAccelerator::new(&config)?;
        let variant = config.variant();
        Ok(Self { variant, arrival, rtl: Box::new(rtl), model: Box::new(model) })
    }

    fn has_queue(&mut self) -> Result<bool, ExternalError> {
        Ok(self.model.read(QUEUE.offset)? != 0)
    }

    /// A sound step's outcomes of the Verilog and of the model.
    fn outcomes(&mut self, scene: &Scene) -> Result<[Outcome; 2], ExternalError> {
        let beats = packets(scene, None);
        let rtl = outcome::run(&mut *self.rtl, scene, &beats)?;
        Ok([rtl, outcome::run(&mut *self.model, scene, &beats)?])
    }
}

fn run_recorded(
    args: &SimulatorArgs,
    folders: &[PathBuf],
    out: &mut dyn Write,
) -> Result<bool, Failure> {
    let mut bench = Bench::new(args)?;
    let mut good = true;
    for path in folders {
        let folder = Folder::load(path)?;
        let mut scene = recorded::scene(&folder, bench.variant);
        let [rtl, model] = bench.outcomes(&scene)?;
        let name = path.file_name().map_or(Path::new("."), Path::new).display();
        if (args.build.hazards, args.build.profile) == (HazardMode::Interlocked, ProfileName::Float)
        {
            let (differ, all) = recorded::differences(&folder, &rtl)?;
            writeln!(out, "{name}: {differ} of {all} recorded values differ")?;
            good &= differ == 0;
        }
        writeln!(out, "  {}", counters(&rtl, &model))?;
        if let Some(difference) = difference(&model, &rtl, bench.arrival) {
            writeln!(out, "  not the model's: {difference}")?;
            good = false;
        }
        if !bench.has_queue()? {
            continue;
        }
        scene.arguments.in_order = false;
        let [rtl, model] = bench.outcomes(&scene)?;
        writeln!(out, "  through the queue: {}", counters(&rtl, &model))?;
        if let Some(difference) = difference(&model, &rtl, bench.arrival) {
            writeln!(out, "  not the model's: {difference}")?;
            good = false;
        }
    }
    Ok(good)
}

fn counters(rtl: &Outcome, model: &Outcome) -> String {
    format!(
        "work {} (model {}), stalls {} ({}), hazards {} ({}), waits {} ({})",
        rtl.work,
        model.work,
        rtl.stalls(),
        model.stalls(),
        rtl.hazards,
        model.hazards,
        rtl.waits,
        model.waits
    )
}

/// The first random step on which the Verilog and the model differ.
fn first_difference(bench: &mut Bench, seed: u64, cases: u64) -> Result<Option<String>, Failure> {
    for seed in seed..seed + cases {
        let case = random::case(seed, bench.variant);
        let beats = packets(&case.scene, case.fault);
        let model = outcome::run(&mut *bench.model, &case.scene, &beats)?;
        let rtl = outcome::run(&mut *bench.rtl, &case.scene, &beats)?;
        if let Some(difference) = difference(&model, &rtl, bench.arrival) {
            return Ok(Some(format!("seed {seed}: {difference}")));
        }
    }
    Ok(None)
}

/// Whether the Verilog does each step that is hard for a queue as the model does.
fn run_crowded(args: &SimulatorArgs, out: &mut dyn Write) -> Result<bool, Failure> {
    let mut bench = Bench::new(args)?;
    let mut good = true;
    for (name, scene) in crowded::scenes(bench.variant) {
        let [rtl, model] = bench.outcomes(&scene)?;
        writeln!(out, "{name}: {}", counters(&rtl, &model))?;
        if let Some(difference) = difference(&model, &rtl, bench.arrival) {
            writeln!(out, "  not the model's: {difference}")?;
            good = false;
        }
    }
    Ok(good)
}

/// Whether the Verilog reports each error as the model does.
fn run_errors(args: &SimulatorArgs, out: &mut dyn Write) -> Result<bool, Failure> {
    let mut bench = Bench::new(args)?;
    let variant = bench.variant;
    let mut larger = |register: Register| -> Result<u32, Failure> {
        Ok(bench.model.read(register.offset)?.max(bench.rtl.read(register.offset)?))
    };
    let all = refusals(variant, larger(BODY_CAPACITY)?, larger(COLLISION_CAPACITY)?);
    let mut good = true;
    writeln!(out, "{:31} {:>4}  {:27} {:27}", "mistake", "code", "model", "hardware")?;
    for Refusal { name, code, scene, fault, registers } in all {
        let beats = packets(&scene, fault);
        let report = |accelerator: &mut dyn ExternalAccelerator| -> Result<_, Failure> {
            let outcome = outcome::run_with(accelerator, &scene, &beats, &registers)?;
            Ok((outcome.error, outcome.ended))
        };
        let [model, rtl] = [report(&mut *bench.model)?, report(&mut *bench.rtl)?];
        let text = |([code, detail], ended): ([u32; 2], bool)| {
            let end = if ended { "" } else { ", does not end" };
            format!("{code:#06x}, detail {detail}{end}")
        };
        writeln!(out, "{name:31} {:4}  {:27} {:27}", code as u32, text(model), text(rtl))?;
        good &= model == rtl && model.1 && error::CODE.of(model.0[0]) == code as u32;
    }
    Ok(good)
}

/// Returns whether each design shows no difference, and each mutant of a design shows one.
fn run_mutations(cases: u64, only: &[String], out: &mut dyn Write) -> Result<bool, Failure> {
    let mut all_found = true;
    for form in [InertiaForm::Isotropic, InertiaForm::World] {
        let inertia = form.into();
        let chosen = |mutation: &&Mutation| {
            mutation.inertia == inertia
                && (only.is_empty() || only.iter().any(|text| mutation.name.contains(text)))
        };
        let mut mutations = MUTATIONS.iter().filter(chosen).peekable();
        if mutations.peek().is_none() {
            continue;
        }
        let design = Design::new(Parameters { queue: MUTANTS_QUEUE, ..Parameters::with(inertia) });
        let files = emit::files(&design);
        if let Some(difference) = difference_of(&files, form, cases)? {
            writeln!(out, "the design with {inertia:?} inertia, without a mutation: {difference}")?;
            return Ok(false);
        }
        writeln!(out, "the design with {inertia:?} inertia: no difference in {cases} steps")?;
        for mutation in mutations {
            let mutant = mutation.apply(&files).ok_or_else(|| {
                format!("{}: its text is not in {}", mutation.name, mutation.file)
            })?;
            let found = difference_of(&mutant, form, cases)?;
            let by = found.as_deref().unwrap_or("NOT FOUND");
            writeln!(out, "{}: {by}", mutation.name)?;
            out.flush()?;
            all_found &= found.is_some();
        }
    }
    Ok(all_found)
}

/// Depth of the queue of designs with a mistake: random steps fill it, and it is small to build.
const MUTANTS_QUEUE: u32 = 16;

/// Builds a simulator of these files; the first random step, or step with a starving collision or
/// with full streams, on which it and the model differ.
fn difference_of(
    files: &[File],
    inertia: InertiaForm,
    cases: u64,
) -> Result<Option<String>, Failure> {
    let folder = tempfile::tempdir()?;
    let mut args = SimulatorArgs {
        simulator: simulator::build_files(files, folder.path(), Waveform::None)?,
        build: BuildArgs {
            hazards: HazardMode::Interlocked,
            profile: ProfileName::Float,
            inertia,
            queue: Some(MUTANTS_QUEUE),
        },
        gaps: 0,
        stalls: 0,
    };
    let mut bench = Bench::new(&args)?;
    if let Some(found) = first_difference(&mut bench, 1, cases)? {
        return Ok(Some(found));
    }
    let [rtl, model] = bench.outcomes(&crowded::starving(bench.variant))?;
    if let Some(found) = difference(&model, &rtl, bench.arrival) {
        return Ok(Some(format!("a starving pair: {found}")));
    }
    // Without hazards the issue soon waits for a stream that lags behind the others.
    args.gaps = 300;
    let mut bench = Bench::new(&args)?;
    Ok(full::first_difference(bench.variant, &mut *bench.model, &mut *bench.rtl)?)
}
