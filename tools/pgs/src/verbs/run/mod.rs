//! The verb `run`: steps a scene, shows the cost of every step, and sums up.

mod beside;
mod end;
mod energy;
mod facts;
mod files;
pub(crate) mod film;
#[cfg(feature = "live")]
mod live;
mod row;
mod summary;

use std::io::{self, Write};

use clap::Args;
use scene::{Scene, WarmStart};
use serde_json::Value;
use zynq_pgs::emulation::Build;
use zynq_pgs::{Capabilities, StepParameters, StepReport};

use self::beside::{Beside, Cold};
use self::end::{document, print_end};
use self::facts::is_emulated;
use self::files::{FileArgs, write_files};
use self::film::Film;
use self::row::{Row, columns, step};
use self::summary::Totals;
use crate::bug_report::FaultArgs;
use crate::traced::{TraceFiles, TracedArgs, Tracing};
use pgs_command::board::{self, OpenBoard};
use pgs_command::common::{AcceleratorOptions, BoardOptions, CommonArgs};
use pgs_command::failure::{Failure, Result, Verdict};
use pgs_command::interrupt::Interrupt;
use pgs_command::options::build::ThreadsArgs;
use pgs_command::options::ordering::OrderingArgs;
use pgs_command::options::planned::PlannedArgs;
use pgs_command::options::scenes::{ITERATIONS, STEPS, SceneArgs};
use pgs_command::options::solver::{DeadlineArgs, SolverArgs};
use pgs_command::output::facts::fact;
use pgs_command::output::files::Files;
use pgs_command::output::order;
use pgs_command::output::progress::progress_bar;
use pgs_command::output::rows::{Fixed, heading, line};
use pgs_command::output::width::terminal;

const EXAMPLES: &str = "\
Examples:
  pgs run                                        the thesis' 38,880 cubes
  pgs run --contact-iterations 4 --friction-iterations 4 --drop 5     the thesis' passes (inferred)
  pgs run --grid 10x10x10 --steps 600 --report-every 30
  pgs run --board emulated:float,unchecked --order as-given     the thesis' design: piles gain energy
  pgs run --order hazard-free --verify
  pgs run --board emulated:half                  the thesis' design in sixteen bits
  pgs run --scene shapes                         shapes of several masses, warm beside cold
  pgs run --scene shapes --warm-start=false --pair-friction=false     cold, with one friction
  pgs run --contact-iterations 4 --friction-iterations 4 --warm-start --grid 10x10x10 --steps 300
  pgs run --board emulated:float,bandwidth=unlimited --json > run.json
  pgs run --fault 'dma-dec-err@dma2.mm2s,phase=contact2,beat=17,step=5'
  pgs run --grid 4x4x4 --steps 60 --traced-step 30 --trace step.json --timeline step.svg
  pgs run --view pile.html --picture pile.png    a page that plays the run, and its last step
  pgs run --scene shapes --steps 90 --picture pile.apng          a picture that moves
  pgs run --live 8000                            a page that plays while the board steps
  pgs run --poses pile.npz --fps 15              fifteen poses of a second, for numpy
  pgs run --retries 2 --report fault.json        repeat a failed step; save a report of the fault

The grid, the cubes and the solver's constants are the thesis'. The drop is our choice, because the
thesis names no height. So are 10 + 10 iterations: with 4 + 4, the thesis' number by its cycles, a
pile of 30 layers sinks 0.2 m into itself and bounces.

Columns: step; pairs of bodies in contact; deepest penetration in the contacts given to the step;
kinetic energy of the velocities that moved the bodies, which is 0 for a pile at rest; time of the
step on the board, modelled for an emulated board; time of this machine. With --beside-cold the \
depth
and the energy of the same scene without a warm start and with one friction, stepped beside it.

Ratio: the time of the same steps in software on a ZCU102's four Cortex-A53 cores, divided by
that of board and driver; on paper, without the search for collisions (docs/worth.md).";

/// The end of the short help.
const MORE: &str = "`pgs run --help` has all options, by subject, and examples.";

/// Default rows of the table.
const ROWS: u32 = 15;

/// Step a pile dropped on the ground.
#[derive(Debug, Clone, Args)]
#[command(after_help = MORE, after_long_help = EXAMPLES)]
pub(crate) struct RunArgs {
    /// Steps to take [default: 120 cubes, 600 shapes]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) steps: Option<u32>,
    #[command(flatten)]
    scene: SceneArgs,
    /// Show every N-th step [default: a fifteenth of all]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    report_every: Option<u32>,
    #[command(flatten)]
    solver: SolverArgs,
    /// Begin each step with the impulses of the last one
    ///
    /// With 0.85 of them, in one more pass of each kind [default: on for --scene shapes]
    #[arg(
        long,
        hide_possible_values = true,
        value_name = "BOOL",
        help_heading = "Solver",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "true"
    )]
    warm_start: Option<bool>,
    /// Give each pair of shapes a friction of its own, from both bodies' kinds [default: on for
    /// --scene shapes, if the collision records of the board have room for it]
    #[arg(
        long,
        value_name = "BOOL",
        help_heading = "Solver",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "true"
    )]
    pair_friction: Option<bool>,
    /// Step the same scene beside this one without a warm start and with one friction, and show how
    /// deep its bodies sink and how much they move [default: on for --scene shapes with a warm
    /// start, unless a fault is planned or the energy of a step is measured]
    #[arg(
        long,
        value_name = "BOOL",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "true"
    )]
    beside_cold: Option<bool>,
    #[command(flatten)]
    ordering: OrderingArgs,
    #[command(flatten)]
    deadline: DeadlineArgs,
    #[command(flatten)]
    pub(crate) board: BoardOptions,
    #[command(flatten)]
    pub(crate) threads: ThreadsArgs,
    #[command(flatten)]
    pub(crate) accelerator: AcceleratorOptions,
    #[command(flatten)]
    faults: FaultArgs,
    #[command(flatten)]
    planned: PlannedArgs,
    #[command(flatten)]
    traced: TracedArgs,
    /// Step to show the inside of [default: the last]
    #[arg(long, value_name = "N", help_heading = "Inside a step (emulated \
        board)", value_parser = clap::value_parser!(u32).range(1..))]
    traced_step: Option<u32>,
    #[command(flatten)]
    files: FileArgs,
}

impl RunArgs {
    /// The parameters of a step. The shapes ask for all that a board can; a choice of the user's is
    /// taken as it is.
    fn parameters(&self, can: &Capabilities) -> StepParameters {
        let shapes = !self.scene.is_cubes();
        let warm = self.warm_start.unwrap_or(shapes);
        let has_frictions = can.variant.has_pair_friction();
        let frictions = self.pair_friction.unwrap_or(shapes && has_frictions);
        let parameters = StepParameters::thesis()
            .with_contact_iterations(ITERATIONS)
            .with_friction_iterations(ITERATIONS)
            .with_warm_start(warm)
            .with_impulses_out(warm)
            .with_pair_friction(frictions);
        let parameters = self.deadline.apply(self.solver.apply(parameters));
        self.faults.apply(self.ordering.apply(parameters))
    }

    /// Whether the table shows this step.
    fn is_shown(&self, step: u32) -> bool {
        let every = self.report_every.unwrap_or(self.steps().div_ceil(ROWS));
        step == 1 || step.is_multiple_of(every) || step == self.steps()
    }

    fn steps(&self) -> u32 {
        let [cubes, shapes] = STEPS;
        self.steps.unwrap_or(if self.scene.is_cubes() { cubes } else { shapes })
    }

    /// The board whose step is recorded, and the number of the step.
    fn tracing(&self, opened: &OpenBoard) -> Result<Option<(Tracing<'_>, u32)>> {
        let (step, steps) = (self.traced_step.unwrap_or(self.steps()), self.steps());
        if self.traced_step.is_some() && !self.traced.is_given() {
            let error = "--traced-step names a step, and no file to write is named";
            return Err(Failure::input(error).next("add --vcd, --trace or --timeline FILE"));
        }
        if step > steps {
            let error = format!("--traced-step is {step}, and the run has {steps} steps");
            return Err(Failure::input(error).next("name an earlier step, or take more steps"));
        }
        Ok(self.traced.tracing(opened)?.map(|tracing| (tracing, step)))
    }

    /// The scene that is stepped beside this one, if one is. A planned fault names a step of the
    /// board by its number, and the steps of a second scene would shift the numbers.
    fn beside(
        &self,
        build: &Build,
        parameters: &StepParameters,
        has_sensors: bool,
    ) -> Result<Option<Cold>> {
        let shown = !self.scene.is_cubes() && parameters.warm_start && !self.planned.is_given();
        let wanted = beside::is_stepped(self.beside_cold, shown, has_sensors);
        wanted
            .then(|| self.scene.build(build).map(|scene| Cold::new(scene, parameters)))
            .transpose()
    }
}

/// The course of a run so far.
#[derive(Default)]
struct Course {
    done: u32,
    retries: u64,
    totals: Totals,
    /// With `--json`, the document of every step.
    documents: Vec<Value>,
    last: Option<Row>,
    /// The scene beside it.
    cold: Option<Cold>,
    /// The energy of a step, for people and for programs.
    energy: Option<(String, Value)>,
    /// The poses for the files.
    film: Option<Film>,
    /// The page that plays the run while it steps.
    #[cfg(feature = "live")]
    page: Option<live::Page>,
    /// Whether the files of the traced step were written.
    inside: TraceFiles,
}

impl Course {
    /// Whether the scene and its cold twin, if it has one, have taken all steps.
    fn is_complete(&self, steps: u32) -> bool {
        let cold = self.cold.as_ref();
        self.done == steps && cold.is_none_or(|cold| cold.has_taken(steps))
    }
}

/// Steps the scene.
pub(crate) fn run(args: &RunArgs, common: &CommonArgs, out: &mut dyn Write) -> Result<Verdict> {
    args.files.check()?;
    let outputs = args.files.named().chain(args.traced.named()).chain(args.faults.named());
    Files::of(common).write(outputs).check()?;
    let build = common.build();
    let mut opened = board::open(common, args.scene.config(&build))?;
    args.scene.check_size(opened.accelerator.capabilities())?;
    let parameters = args.parameters(opened.accelerator.capabilities());
    let mut scene = args.scene.build(&build)?;
    if parameters.pair_friction {
        args.scene.give_frictions(&mut scene)?;
    }
    let tracing = args.tracing(&opened)?;
    opened.accelerator.set_shapes(scene.shapes()).map_err(|error| opened.failure(error))?;
    let interrupt = Interrupt::install();
    opened.accelerator.set_cancellation(interrupt.cancellation());
    let sensors = energy::sensors(is_emulated(&opened));
    let cold = args.beside(&build, &parameters, sensors.is_some())?;
    let mut course = Course { cold, ..Course::default() };
    opened.inject(&args.planned, &parameters)?;
    course.film = args.files.film(&scene, args.steps(), parameters.time_step)?;
    #[cfg(feature = "live")]
    {
        course.page = live::Page::start(args, &opened, &parameters, &scene)?;
    }
    let meter = energy::start(sensors, course.cold.is_none());
    let scenes = (&mut scene, &mut course);
    let with = (&parameters, tracing.as_ref());
    take_steps(args, common, with, &mut opened, scenes, &interrupt, out)?;
    // Directly behind the steps: the meter also counts the time in which nothing steps.
    course.energy = energy::end(meter, course.done);
    #[cfg(feature = "live")]
    if let Some(page) = course.page.take() {
        page.end(&course, &opened, &scene);
    }
    let complete = course.is_complete(args.steps());
    let written = write_files(args, &opened, &parameters, &scene, &mut course)?;
    if common.json {
        let mut document = document(args, &parameters, &opened, &mut scene, course);
        for file in written {
            document["files"][file.label] = file.document;
        }
        writeln!(out, "{document:#}")?;
    } else {
        writeln!(out)?;
        for file in written {
            fact(out, file.label, &file.text)?;
        }
        args.traced.print(course.inside, out)?;
        print_end(args, &opened, &mut scene, &course, out)?;
    }
    Ok(if complete { Verdict::Done } else { Verdict::Interrupted })
}

/// Takes the steps and shows them, until the last one or Ctrl-C.
fn take_steps(
    args: &RunArgs,
    common: &CommonArgs,
    (parameters, tracing): (&StepParameters, Option<&(Tracing<'_>, u32)>),
    opened: &mut OpenBoard,
    (scene, course): (&mut Scene, &mut Course),
    interrupt: &Interrupt,
    out: &mut dyn Write,
) -> Result<()> {
    let progress = progress_bar(args.steps());
    let mut warm = parameters.warm_start.then(WarmStart::default);
    while course.done < args.steps() && !interrupt.is_set() {
        let number = course.done + 1;
        let tracing = tracing.filter(|(_, step)| *step == number).map(|(tracing, _)| tracing);
        if let Some(tracing) = tracing {
            tracing.begin();
        }
        let row = step(number, parameters, &mut opened.accelerator, scene, warm.as_mut());
        let traced = tracing.map(|tracing| {
            let row = row.as_ref().ok().and_then(Option::as_ref);
            tracing.end(row.map(|row| &row.report))
        });
        // The error of the step comes before the one of a file that cannot be written.
        let row = row.map_err(|error| args.faults.failure(opened, parameters, error))?;
        if let Some(inside) = traced.transpose()? {
            course.inside = inside;
        }
        opened.alive()?;
        let Some(row) = row else { break };
        let mut beside = None;
        if let Some(cold) = &mut course.cold {
            beside = cold
                .step(course.done + 1, &mut opened.accelerator)
                .map_err(|error| args.faults.failure(opened, parameters, error))?;
            opened.alive()?;
        }
        course.done += 1;
        if let Some(film) = &mut course.film {
            film.step(course.done, scene)?;
        }
        #[cfg(feature = "live")]
        if let Some(page) = &mut course.page {
            page.step(course.done, &row.report, opened, scene);
        }
        course.retries += u64::from(row.report.retries);
        course.totals.add(&row);
        if course.done == 1 && !common.json {
            // The heading waits for the first step: a refused scene prints only the refusal.
            let cold = course.cold.is_some();
            progress.suspend(|| print_heading(args, opened, (&row.report, cold), out))?;
        }
        progress.inc(1);
        if common.json {
            let mut document = row.to_json();
            if let Some(beside) = &beside {
                document["beside_cold"] = beside.to_json();
            }
            course.documents.push(document);
        } else if args.is_shown(course.done) {
            let cells = row.cells().into_iter();
            let cells = cells.chain(beside.map(Beside::cells).into_iter().flatten());
            progress.suspend(|| line(out, &all_columns(opened, beside.is_some()), cells))?;
            out.flush()?;
        }
        course.last = Some(row);
    }
    progress.finish_and_clear();
    Ok(())
}

/// The columns of the default table that fit the terminal.
fn all_columns(opened: &OpenBoard, beside_cold: bool) -> Vec<Fixed> {
    let (own, mut used) = (columns(is_emulated(opened)), 0);
    let all = own.into_iter().chain(beside::COLUMNS.into_iter().filter(|_| beside_cold));
    let fits = |column: &Fixed| {
        used += column.width + 1;
        used <= terminal().saturating_add(1)
    };
    all.take_while(fits).collect()
}

/// The board, the scene, the first step's order, and the names of the columns.
fn print_heading(
    args: &RunArgs,
    opened: &OpenBoard,
    (first, beside_cold): (&StepReport, bool),
    out: &mut dyn Write,
) -> io::Result<()> {
    opened.print(out)?;
    fact(out, "scene", &args.scene.text())?;
    fact(out, "order", &order::with_reason(first))?;
    writeln!(out)?;
    heading(out, &all_columns(opened, beside_cold))?;
    out.flush()
}
