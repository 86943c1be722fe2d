//! The headline: one step of a pile on the thesis' design as it describes it, on a pipeline that
//! waits, and on the boards of this project; their kinetic energy, and both piles after more steps.

mod piles;

use std::io::Write as _;
use std::path::PathBuf;
use std::sync::Arc;

use bitstream_model::BoardConfig;
use clap::Args;
use pgs_command::board::{self, OpenBoard};
use pgs_command::failure::{Failure, Result};
use pgs_command::numbers::{grouped, number};
use pgs_command::options::scenes::DROP;
use pgs_command::output::files::{Files, Named, check_folder, unwritten};
use pgs_command::{pile, step_input};
use scene::{Grid, kinetic_energy};
use step_folder::replace::replace;
use zynq_pgs::emulation::Build;
use zynq_pgs::order::Order;
use zynq_pgs::{Body, StepParameters, StepReport};

use self::piles::piles;
use super::start::World;
use crate::estimate::thesis::recorded::{Design, FLOAT_DESIGN, HALF_DESIGN};
use crate::experiment::{Boards, Experiment, Measure, PILES, Part, shown};
use crate::index::{Origin, Row};
use crate::session::Session;
use crate::table::{Cell, Kind, Table, text};

const HELP: &str = "\
Examples:
  pgs thesis step                               minutes: 120 steps of 33,696 cubes on four boards
  pgs thesis step --grid 10x10x10 --picture piles.svg
  pgs thesis step --input tests/golden/pile5_step60

All boards are emulated, with 16 GB/s of memory (the thesis' figure), and start from one state: a
pile that has fallen from 1 m for 30 steps, its collisions in the order of their detection; or the
step of a folder. Cycles and times are modelled. A stale read is a collision that reads a velocity
which an earlier collision, still in the pipeline, is about to change. The energy is kinetic, of
translation and spin.";

/// The experiment.
pub(crate) static STEP: Experiment = Experiment::of::<Options>(
    "step",
    "§5.4.4, §7.3",
    Boards::Own,
    "The thesis' design as described, beside a pipeline that waits and ours: time and energy",
);

/// Its arguments.
#[derive(Debug, Clone, Args)]
#[command(after_help = HELP)]
pub(crate) struct Options {
    /// Take one step from this folder of .npy arrays instead of a pile.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["grid", "picture"])]
    input: Option<PathBuf>,
    /// Cubes of the pile along each axis [default: 36x26x36, about the thesis' 127,000 collisions]
    #[arg(long, value_name = "NXxNYxNZ")]
    grid: Option<Grid>,
    /// Write the piles of the thesis' design and of ours after the last step, as SVG.
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,
}

/// Steps of the pile's fall before the boards start: its lowest layers have landed.
const FALL: u32 = 30;
/// Steps of each board.
const STEPS: u32 = 120;

/// What the thesis says of hazards.
const CLAIM: &str = "recorded (§5.4.4): the dependences between collisions are declared false, \
     because, as on a GPU, the design \"could afford to calculate some values for the bodies \
     involved in a collision without always have the last updated values\"; it prints no energy, \
     and judges its results by the positions after a step (§4.6.3)";

/// A row of the table: a design on an emulated board.
struct Side {
    name: &'static str,
    /// Its board.
    build: &'static str,
    /// The order of its collisions; none for the driver's choice.
    order: Option<Order>,
    /// Its place in the thesis.
    thesis: &'static str,
    /// The thesis' figures of it.
    recorded: Option<&'static Design>,
}

const SIDES: [Side; 4] = [
    Side {
        name: "the thesis' design as described",
        build: "float,unchecked,bandwidth=16",
        order: Some(Order::AsGiven),
        thesis: "§5.4.4",
        recorded: Some(&FLOAT_DESIGN),
    },
    Side {
        name: "a pipeline that waits",
        build: "float,interlocked,queue=0,bandwidth=16",
        order: Some(Order::AsGiven),
        thesis: "§5.4.4",
        recorded: None,
    },
    Side {
        name: "ours: the FPGA sorts, by its issue queue",
        build: "float,bandwidth=16",
        order: None,
        thesis: "§7.3",
        recorded: None,
    },
    Side {
        name: "ours, half",
        build: "half,bandwidth=16",
        order: None,
        thesis: "§7.3",
        recorded: Some(&HALF_DESIGN),
    },
];

/// The run of a side.
struct Run {
    /// Of its first step.
    report: StepReport,
    /// Kinetic energy after the first step, and after all of a scene, J.
    first: f64,
    last: Option<f64>,
    bodies: Vec<Body>,
}

impl Measure for Options {
    fn measure(&self, session: &Session) -> Result<Part> {
        if let Some(path) = &self.picture {
            check_folder(path)?;
            Files::of(&session.common).write([Named::option("picture", path)]).check()?;
        }
        let Some((world, parameters)) = self.start(session)? else {
            return Ok(Part::interrupted());
        };
        let (mut runs, before) = (Vec::new(), kinetic_energy(world.bodies(), world.shapes()));
        for side in &SIDES {
            match side.run(&world, parameters, session)? {
                Some(run) => runs.push(run),
                None => return Ok(Part::interrupted()),
            }
        }
        session.end();
        let mut table = table(if self.input.is_some() { "given_step" } else { "step" });
        let mut rows = Vec::new();
        for (side, run) in SIDES.iter().zip(&runs) {
            table.row(side.cells(before, run));
            rows.extend(side.rows(before, run, &table));
        }
        let mut part = Part { rows, ..Part::of(vec![table]) };
        part.fact("step", self.subject(&runs[0].report));
        part.fact("thesis", CLAIM);
        if let World::Scene(scene) = &world {
            let figure = piles(
                scene,
                STEPS,
                [0, 2].map(|k: usize| (SIDES[k].name, runs[k].bodies.as_slice())),
            )?;
            if let Some(path) = &self.picture {
                replace(path, |file| file.write_all(figure.svg.as_bytes())).map_err(unwritten)?;
                part.fact("picture", path.display().to_string());
            }
            part.figure(figure, []);
        }
        Ok(part)
    }
}

impl Options {
    /// The state in which all boards start, with its collisions; none if Ctrl-C ended the fall.
    fn start(&self, session: &Session) -> Result<Option<(World, StepParameters)>> {
        let parameters = StepParameters::thesis();
        session.expect(if self.input.is_some() { 4 } else { (FALL + 4 * STEPS).into() });
        let Some(path) = &self.input else {
            let (mut scene, mut opened) =
                pile::open(self.grid()?, DROP, &session.emulated(), BoardConfig::default())?;
            session.watch(&mut opened);
            let fallen = pile::step_to(&mut scene, &mut opened, &parameters, FALL, || {
                session.advance();
                !session.is_interrupted()
            })?;
            return Ok(fallen.then(|| (World::Scene(Box::new(scene)), parameters)));
        };
        let folder = Arc::new(step_input::load(path)?);
        let (own, bodies) = (folder.parameters, folder.bodies.clone());
        Ok(Some((World::Folder { folder, bodies }, own)))
    }

    fn grid(&self) -> Result<Grid> {
        self.grid.map_or_else(|| Grid::new(36, 26, 36).map_err(Failure::input), Ok)
    }

    /// The step, for people.
    fn subject(&self, report: &StepReport) -> String {
        let StepReport { bodies, collisions, passes, .. } = report;
        let from = match &self.input {
            Some(path) => shown(path),
            None => format!("step {} of a pile dropped from {DROP} m", FALL + 1),
        };
        let [bodies, collisions] = [bodies, collisions].map(|count| grouped(*count));
        format!("{from}: {bodies} bodies, {collisions} collisions, {passes} passes; 16 GB/s")
    }
}

impl Side {
    /// Takes the step, and of a scene the steps behind it; none if Ctrl-C ended them.
    fn run(
        &self,
        start: &World,
        parameters: StepParameters,
        session: &Session,
    ) -> Result<Option<Run>> {
        let build: Build = self.build.parse().map_err(Failure::input)?;
        let mut opened = board::open(&session.emulated(), build.config())?.stated();
        session.watch(&mut opened);
        let mut world = start.clone();
        step_input::set_shapes(&mut opened.accelerator, world.shapes())
            .map_err(|error| world.failure(&opened, error))?;
        let parameters = parameters.with_order(self.order);
        let Some(report) = step(&mut world, &mut opened, &parameters, session)? else {
            return Ok(None);
        };
        let energy = |world: &World| kinetic_energy(world.bodies(), world.shapes());
        let (first, mut last) = (energy(&world), None);
        if matches!(world, World::Scene(_)) {
            for _ in 1..STEPS {
                if step(&mut world, &mut opened, &parameters, session)?.is_none() {
                    return Ok(None);
                }
            }
            last = Some(energy(&world));
        }
        Ok(Some(Run { report, first, last, bodies: world.bodies().to_vec() }))
    }

    /// The share of the collisions that read a velocity too early: on a board that waits, none.
    fn stale(&self, report: &StepReport) -> f64 {
        let reads = report.collisions * u64::from(report.passes);
        let stale = if self.build.contains("unchecked") { report.hazards } else { 0 };
        stale as f64 / reads.max(1) as f64
    }

    fn cells(&self, before: f64, run: &Run) -> [Cell; 8] {
        let milliseconds = run.report.modelled_time().as_secs_f64() * 1e3;
        let energy = |joules: f64| Cell::Digits(joules / 1e3);
        [
            text(self.name),
            Cell::Whole(run.report.cycles.total),
            Cell::Number(milliseconds, 3),
            Cell::Share(self.stale(&run.report) * 100.0),
            energy(before),
            energy(run.first),
            Cell::known(run.last, energy),
            Kind::Modelled.cell(),
        ]
    }

    /// Rows of the index: the time of the step, and the energy.
    fn rows(&self, before: f64, run: &Run, table: &Table) -> [Row; 2] {
        let stale = self.stale(&run.report) * 100.0;
        let milliseconds = run.report.modelled_time().as_secs_f64() * 1e3;
        let last = run.last.map_or_else(String::new, |joules| {
            format!(", {} kJ after {STEPS} steps", number(joules / 1e3))
        });
        let recorded = self.recorded.map_or_else(
            || if self.thesis == "§7.3" { "future work" } else { "no such design" }.to_owned(),
            |design| format!("{} ms", design.latency_ms),
        );
        let row = |what: &str, recorded: String, ours: String, shown: String| Row {
            thesis: self.thesis.to_owned(),
            subject: format!("{what} of a step: {}", self.name),
            recorded,
            ours,
            origin: Origin::Modelled,
            command: String::new(),
            shown,
        };
        let time = format!("{milliseconds:.2} ms, {stale:.1} % stale reads");
        let [before, first] = [before, run.first].map(|joules| number(joules / 1e3));
        let energy = format!("{before} → {first} kJ{last}");
        let anchor = table.anchor();
        let pictured = run.last.map_or_else(|| anchor.clone(), |_| PILES.to_owned());
        [
            row("time", recorded, time, anchor),
            row("kinetic energy", "not given".to_owned(), energy, pictured),
        ]
    }
}

/// Takes a step, and detects the collisions of the next one; none if Ctrl-C ended it.
fn step(
    world: &mut World,
    opened: &mut OpenBoard,
    parameters: &StepParameters,
    session: &Session,
) -> Result<Option<StepReport>> {
    if session.is_interrupted() {
        return Ok(None);
    }
    let (bodies, collisions) = world.parts_mut();
    let report = match opened.accelerator.step(bodies, collisions, parameters) {
        Ok(report) => report,
        Err(error) if board::is_cancelled(&error) => return Ok(None),
        Err(error) => return Err(world.failure(opened, error)),
    };
    opened.alive()?;
    if let World::Scene(scene) = world {
        scene.detect();
    }
    session.advance();
    Ok(Some(report))
}

/// The table with the thesis' own row.
fn table(id: &'static str) -> Table {
    let columns = [
        ("design", "design"),
        ("cycles", "cycles"),
        ("ms", "ms"),
        ("stale_percent", "stale\nreads"),
        ("before_kj", "before\nkJ"),
        ("after_kj", "after it\nkJ"),
        ("after_steps_kj", "after 120\nkJ"),
        ("kind", "kind"),
    ];
    let mut table = Table::with_columns(id, "One step on five designs (§5.4.4, §7.3)", &columns);
    let Design { cycles, latency_ms, .. } = FLOAT_DESIGN;
    let unknown = || Cell::Missing;
    table.row([
        text("the thesis' own figures"),
        Cell::Whole(cycles),
        Cell::Number(latency_ms, 2),
        unknown(),
        unknown(),
        unknown(),
        unknown(),
        Kind::Recorded.cell(),
    ]);
    table
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::tests::parsed;
    use pgs_command::common::CommonArgs;
    use serde_json::Value;

    /// The document of the experiment.
    fn document(options: &str) -> Value {
        let common = CommonArgs { json: true, ..CommonArgs::emulated() };
        let args = parsed(&format!("pgs thesis step {options}")).expect("words");
        let mut out = Vec::new();
        args.run_one(&Session::new(&common), &mut out).expect("it runs");
        serde_json::from_slice(&out).expect("a document")
    }

    #[test]
    fn stale_reads_give_a_pile_energy_and_neither_waiting_nor_sorting_does() {
        let document = document("--grid 6x6x6");
        let rows = document["tables"][0]["rows"].as_array().expect("rows");
        assert_eq!(rows.len(), 5);
        assert_eq!((&rows[0]["cycles"], &rows[0]["kind"]), (&2_062_697.into(), &"recorded".into()));
        let number = |row: usize, key: &str| rows[row][key].as_f64().expect("a number");
        let before = number(1, "before_kj");
        assert!(number(1, "after_kj") > before && number(1, "stale_percent") > 50.0, "{rows:#?}");
        for row in [2, 3, 4] {
            assert!(number(row, "after_kj") < before, "{rows:#?}");
            assert!(number(row, "stale_percent") == 0.0, "{rows:#?}");
        }
        assert!(number(1, "after_steps_kj") > 2.0 * before, "{rows:#?}");
        for row in [2, 3] {
            assert!(number(row, "after_steps_kj") < before, "{rows:#?}");
        }
        // The pipeline that waits pays for it with its time.
        assert!(number(2, "ms") > 10.0 * number(1, "ms"), "{rows:#?}");
        assert_eq!(document["index"].as_array().map(Vec::len), Some(8));
        assert_eq!(document["figures"][0]["id"], PILES);
    }
}
