//! The verb `solve`: takes one step from a folder of arrays, and compares it with expected arrays.

use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use scene::kinetic_energy;
use serde_json::{Value, json};
use zynq_pgs::{Body, Capabilities, StepParameters, StepReport};

use crate::a53::{Paper, ratio_text};
use crate::bug_report::FaultArgs;
use crate::difference::{self, Difference};
use crate::traced::TracedArgs;
use pgs_command::board;
use pgs_command::common::{AcceleratorOptions, BoardOptions, CommonArgs};
use pgs_command::failure::{Failure, Result, Verdict};
use pgs_command::interrupt::Interrupt;
use pgs_command::numbers::{Bound, grouped};
use pgs_command::options::build::ThreadsArgs;
use pgs_command::options::ordering::OrderingArgs;
use pgs_command::options::planned::PlannedArgs;
use pgs_command::options::solver::{DeadlineArgs, SolverArgs};
use pgs_command::output::SCHEMA;
use pgs_command::output::facts::{fact, whole_fact};
use pgs_command::output::files::{Files, Named, unwritten};
use pgs_command::output::order;
use pgs_command::output::{limit_text, milliseconds};
use pgs_command::step_input;
use step_folder::digest;
use step_folder::folder::{self, BODY_ORIENTATION, BODY_POSITION, Folder, State};
use step_folder::npy::{self, Dimensions};

const VELOCITIES_CONTACT: &str = "out_vel_contact.npy";
const VELOCITIES_FRICTION: &str = "out_vel_friction.npy";

const EXAMPLES: &str = "\
Examples:
  pgs solve tests/golden/one_cube --compare
  pgs solve tests/golden/pile5_step60 --out result --digest
  pgs solve tests/golden/pile5_step60 --board emulated:float,unchecked --verify
  pgs solve tests/golden/one_cube --vcd step.vcd --trace step.json --timeline step.svg
  pgs solve tests/golden/one_cube --compare --contact-iterations 2 --friction-iterations 0 \\
      --no-integrate

The folder holds one .npy array a property, in C order; metres, kilograms, seconds, radians, world
frame:

  params            (8) <f4        time step, position drift, position coefficient, friction, \
  angular
                                   damping, gravity x, y, z
  iterations        (2) <u4        contact, friction
  body_pos          (N, 3) <f4     centre of mass
  body_quat         (N, 4) <f4     orientation, a unit quaternion in the order x, y, z, w
  body_linvel       (N, 3) <f4     velocity of the centre of mass
  body_angvel       (N, 3) <f4     angular velocity about world axes
  body_inv_mass     (N) <f4        1/mass; 0 is a static body, whose velocities and inverse \
  inertia are 0
  body_inv_inertia  (N, 3) <f4     inverse inertia about the body's own axes x, y, z
  contact_bodies    (M, 2) <u4     indices of bodies A and B, from 0
  contact_npoints   (M) <u4        contact points of each collision, 0 to 4
  contact_normal    (M, 3) <f4     unit normal, which points from B to A
  contact_points    (M, 4, 4) <f4  x, y, z of a point on B's surface, and its signed distance d \
  from A,
                                   whose surface is at point + d * normal; negative for penetration.
                                   Only the first contact_npoints of the four are read

A collision of 0 points is empty: it has no effect, and none of its other values matters. A step
without bodies or collisions has arrays of N = 0 or M = 0; an array without rows may also have
shape (0,) and any type, as numpy.array([]) has. With position drift 0 and a position coefficient
equal to the time step, a distance is a velocity in m/s: a negative one is the least speed of
separation, and a positive one the greatest speed of approach.

--no-integrate leaves the rest of a step to the caller: forces and gravity, damping, gyroscopic
terms, motion. Poses stay unchanged.

--out replaces earlier results together: if one cannot be written, all stay unchanged.";

/// Take one step from a folder of arrays.
#[derive(Debug, Clone, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct SolveArgs {
    /// Folder of .npy arrays.
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Write the results as arrays to this folder: `out_pos`, `out_quat`, `out_linvel`,
    /// `out_angvel`.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Compare bit by bit with the expected results in the folder; exit code 1 on a difference.
    /// With --no-integrate, compare with the folder's velocities after the iterations taken.
    #[arg(long)]
    compare: bool,
    /// Print the digest of the final state alone.
    #[arg(long, conflicts_with = "json")]
    digest: bool,
    /// Stop after the solver: poses stay, velocities are without damping and gravity.
    #[arg(long)]
    no_integrate: bool,
    #[command(flatten)]
    solver: SolverArgs,
    #[command(flatten)]
    ordering: OrderingArgs,
    #[command(flatten)]
    deadline: DeadlineArgs,
    #[command(flatten)]
    faults: FaultArgs,
    #[command(flatten)]
    planned: PlannedArgs,
    #[command(flatten)]
    traced: TracedArgs,
    #[command(flatten)]
    pub(crate) board: BoardOptions,
    #[command(flatten)]
    pub(crate) threads: ThreadsArgs,
    #[command(flatten)]
    pub(crate) accelerator: AcceleratorOptions,
}

impl SolveArgs {
    /// The folder's parameters, overridden by the command line; the order is not set yet.
    fn parameters(&self, folder: &StepParameters) -> StepParameters {
        let mut parameters = *folder;
        parameters.integrate = !self.no_integrate;
        self.faults.apply(self.deadline.apply(self.solver.apply(parameters)))
    }

    /// The files that the command writes and reads. The expected results are read to compare alone.
    fn files(&self, common: &CommonArgs) -> Files {
        let out = self.out.iter().flat_map(|folder| {
            State::ALL.into_iter().map(move |state| Named::option("out", folder.join(state.file())))
        });
        let outputs = out.chain(self.traced.named()).chain(self.faults.named());
        let unread = |name: &str| !self.compare && name.starts_with("out_");
        Files::of(common).write(outputs).read_folder(&self.folder, unread)
    }

    /// Sets the order in which the board gets the collisions.
    fn ordered(&self, parameters: StepParameters, capabilities: &Capabilities) -> StepParameters {
        match self.compare {
            true => self.ordering.apply_to_compare(parameters, capabilities),
            false => self.ordering.apply(parameters),
        }
    }
}

/// An array that the result must equal.
struct Expected {
    name: String,
    values: Vec<f32>,
    kind: Kind,
}

enum Kind {
    /// One property.
    State(State),
    /// Linear and angular velocities alternate.
    Velocities,
}

/// Takes the step.
pub(crate) fn run(args: &SolveArgs, common: &CommonArgs, out: &mut dyn Write) -> Result<Verdict> {
    args.files(common).check()?;
    let mut folder = step_input::load(&args.folder)?;
    let parameters = args.parameters(&folder.parameters);
    let expected = match args.compare {
        true => expected(&folder, &parameters)?,
        false => Vec::new(),
    };
    let mut opened = board::open(common, common.build().config())?;
    folder.check_shapes(opened.accelerator.capabilities().shapes_max()).map_err(Failure::input)?;
    let parameters = args.ordered(parameters, opened.accelerator.capabilities());
    let tracing = args.traced.tracing(&opened)?;
    opened.inject(&args.planned, &parameters)?;
    let interrupt = Interrupt::install();
    opened.accelerator.set_cancellation(interrupt.cancellation());
    let energy_before = kinetic_energy(&folder.bodies, &folder.shapes);
    let mut bodies = std::mem::take(&mut folder.bodies);
    let accelerator = &mut opened.accelerator;
    let stepped = step_input::set_shapes(accelerator, &folder.shapes).and_then(|()| {
        if let Some(tracing) = &tracing {
            tracing.begin();
        }
        accelerator.step(&mut bodies, &folder.collisions, &parameters)
    });
    let traced = tracing.as_ref().map(|tracing| tracing.end(stepped.as_ref().ok()));
    if stepped.is_ok() {
        opened.alive()?;
    }
    let report = match stepped {
        Ok(_) if interrupt.is_set() => return Ok(Verdict::Interrupted),
        Ok(report) => report,
        Err(error) if board::is_cancelled(&error) => return Ok(Verdict::Interrupted),
        Err(error) if error.is_input() => {
            return Err(Failure::input(step_input::locate(error, &folder)));
        }
        Err(error) => return Err(args.faults.failure(&opened, &parameters, error)),
    };
    // A step that failed is told before a file that cannot be written.
    let inside = traced.transpose()?.unwrap_or_default();
    if let Some(path) = &args.out {
        folder::write_results(path, &bodies).map_err(unwritten)?;
    }

    let beside_bullet = match args.compare {
        true => order::beside_bullet(&report, opened.accelerator.capabilities()),
        false => None,
    };
    let solved = StepResult {
        parameters,
        beside_bullet,
        a53: Paper::of(&opened.accelerator, &report, [parameters.warm_start, false]),
        report,
        energy: [energy_before, kinetic_energy(&bodies, &folder.shapes)],
        digest: format!("{:016x}", digest::of_bodies(&bodies)),
        differences: compared(&bodies, &expected),
    };
    let equal = solved.differences.iter().all(|difference| difference.differing == 0);
    if common.json {
        let mut document = solved.to_json();
        document["folder"] = args.folder.display().to_string().into();
        document["board"] = opened.to_json();
        document["faults"] = opened.faults_json();
        document["traced"] = args.traced.to_json(inside);
        document["equal"] = args.compare.then_some(equal).into();
        writeln!(out, "{document:#}")?;
    } else if args.digest {
        writeln!(out, "{} {}", digest::ALGORITHM, solved.digest)?;
    } else {
        opened.print(out)?;
        if let Some(faults) = opened.faults_text() {
            fact(out, "faults", &faults)?;
        }
        solved.print(out)?;
        args.traced.print(inside, out)?;
    }
    if args.digest && !equal {
        for difference in solved.differences.iter().filter(|d| d.differing > 0) {
            log::error!("{}: {} values differ", difference.array, difference.differing);
        }
    }
    Ok(if equal { Verdict::Done } else { Verdict::Differs })
}

/// The arrays that the step must reproduce.
fn expected(folder: &Folder, parameters: &StepParameters) -> Result<Vec<Expected>> {
    let own = &folder.parameters;
    let contact = parameters.contact_iterations;
    let friction = parameters.friction_iterations;
    let all_contact = contact == own.contact_iterations;
    let n = folder.bodies.len();
    if parameters.integrate && all_contact && friction == own.friction_iterations {
        return State::ALL
            .into_iter()
            .map(|property| state(folder, property.file(), property))
            .collect();
    }
    let (name, passes, pass) = if !parameters.integrate
        && friction == 0
        && (1..=own.contact_iterations).contains(&contact)
    {
        (VELOCITIES_CONTACT, own.contact_iterations, contact)
    } else if !parameters.integrate
        && all_contact
        && (1..=own.friction_iterations).contains(&friction)
    {
        (VELOCITIES_FRICTION, own.friction_iterations, friction)
    } else {
        let error = format!(
            "there are no expected results after {contact} contact and \
             {friction} friction iterations {} integration",
            if parameters.integrate { "and the" } else { "without" },
        );
        return Err(Failure::input(error).next(format!(
            "compare the whole step ({} and {}, integrated), or with --no-integrate 1 to {} \
             contact and no friction iterations, or {} contact and 1 to {} friction iterations",
            own.contact_iterations,
            own.friction_iterations,
            own.contact_iterations,
            own.contact_iterations,
            own.friction_iterations,
        )));
    };
    let path = folder.path.join(name);
    let size = |n: u32| usize::try_from(n).unwrap_or(usize::MAX);
    let shape = Dimensions(vec![Some(size(passes)), Some(n), Some(6)]);
    let values = npy::read_row::<f32>(&path, &shape, size(pass) - 1).map_err(Failure::input)?;
    difference::check(&path, &values).map_err(Failure::input)?;
    let velocities =
        Expected { name: format!("{name}[{}]", pass - 1), values, kind: Kind::Velocities };
    Ok(vec![
        velocities,
        state(folder, BODY_POSITION, State::Position)?,
        state(folder, BODY_ORIENTATION, State::Orientation)?,
    ])
}

/// Reads the array in `file`, which the property must equal after the step.
fn state(folder: &Folder, file: &str, property: State) -> Result<Expected> {
    let path = &folder.path.join(file);
    let shape = Dimensions(vec![Some(folder.bodies.len()), Some(property.width())]);
    let (_, values) = npy::read::<f32>(path, &shape).map_err(Failure::input)?;
    difference::check(path, &values).map_err(Failure::input)?;
    Ok(Expected { name: file.to_owned(), values, kind: Kind::State(property) })
}

fn compared(bodies: &[Body], expected: &[Expected]) -> Vec<Difference> {
    expected
        .iter()
        .map(|Expected { name, values, kind }| match kind {
            Kind::State(property) => difference::compare(name, property.of(bodies), values),
            Kind::Velocities => difference::compare(name, folder::velocities(bodies), values),
        })
        .collect()
}

/// The result of the step.
struct StepResult {
    parameters: StepParameters,
    /// How the order relates to Bullet's, if the results are compared.
    beside_bullet: Option<&'static str>,
    report: StepReport,
    /// The step on the processor of a ZCU102, if it is counted.
    a53: Option<Paper>,
    /// Before and after the step, J.
    energy: [f64; 2],
    digest: String,
    differences: Vec<Difference>,
}

impl StepResult {
    /// Share of the collisions with a hazard, over all passes.
    fn hazard_share(&self) -> f64 {
        let issued = self.report.collisions * u64::from(self.report.passes);
        if issued == 0 { 0.0 } else { self.report.hazards as f64 / issued as f64 }
    }

    fn print(&self, out: &mut dyn Write) -> std::io::Result<()> {
        let Self { report, parameters, energy: [before, after], .. } = self;
        let (saturated, modelled) = (report.saturated, milliseconds(report.modelled_time()));
        let mut line = |label: &str, text: String| whole_fact(out, label, &text);
        line(
            "step",
            format!(
                "{} bodies, {} collisions, {} contact and {} friction iterations, {}",
                grouped(report.bodies),
                grouped(report.collisions),
                parameters.contact_iterations,
                parameters.friction_iterations,
                if parameters.integrate { "integrated" } else { "not integrated" },
            ),
        )?;
        let mut order = order::text(report);
        if let Some(text) = self.beside_bullet.map(str::to_owned).or(order::reason(report)) {
            order += &format!(" ({text})");
        }
        line("order", order)?;
        line(
            "cycles",
            format!(
                "{} = {} by formula + {} stalls + {} waits; {modelled:.3} ms modelled, limit: {}",
                grouped(report.cycles.total),
                Bound::AtLeast.words(saturated.work, report.cycles.work),
                Bound::AtMost.words(saturated.stalls(), report.cycles.stalls),
                Bound::AtLeast.words(saturated.waits, report.cycles.waits),
                limit_text(report.limit()),
            ),
        )?;
        line("ratio", ratio_text(self.a53, 1, modelled))?;
        line(
            "transfers",
            format!(
                "{} bytes to the board and {} back, in {} descriptors",
                grouped(report.bytes_to_device),
                grouped(report.bytes_from_device),
                grouped(report.descriptors),
            ),
        )?;
        line(
            "hazards",
            format!(
                "{} ({}{:.1} % of the collisions of a pass)",
                Bound::AtLeast.words(saturated.hazards, report.hazards),
                if saturated.hazards { "at least " } else { "" },
                self.hazard_share() * 100.0,
            ),
        )?;
        match report.impulse_sum {
            Some(sum) => line("impulses", format!("{sum:.3} N s"))?,
            None if saturated.impulse_sum => {
                #[allow(clippy::cast_possible_truncation, reason = "a whole number, 2^44")]
                let most = StepReport::IMPULSE_SUM_MAX as u64;
                line("impulses", format!("{} N s", Bound::AtLeast.words(true, most)))?;
            }
            None => {}
        }
        if report.retries > 0 {
            line("retries", report.retries.to_string())?;
        }
        line("energy", format!("{before:.3} J before, {after:.3} J after (kinetic)"))?;
        line("digest", format!("{} {}", digest::ALGORITHM, self.digest))?;
        for Difference { array, values, differing, largest, first } in &self.differences {
            let at = first.as_ref().map(|at| format!(", by {largest:e} at most, first at {at}"));
            let at = at.unwrap_or_default();
            line("compare", format!("{array}: {differing} of {values} values differ in bits{at}"))?;
        }
        Ok(())
    }

    fn to_json(&self) -> Value {
        let differences: Vec<Value> = self
            .differences
            .iter()
            .map(|difference| {
                json!({
                    "array": difference.array,
                    "values": difference.values,
                    "differing": difference.differing,
                    // An infinite difference is null: JSON cannot express it.
                    "largest": difference.largest,
                    "first": difference.first,
                })
            })
            .collect();
        let mut step = pgs_command::output::report_json(&self.report);
        step["host_on_a53_ms"] = self.a53.map(Paper::to_json).into();
        json!({
            "schema": SCHEMA,
            "verb": "solve",
            "config": {
                "contact_iterations": self.parameters.contact_iterations,
                "friction_iterations": self.parameters.friction_iterations,
                "integrate": self.parameters.integrate,
            },
            "step": step,
            "hazard_share": (!self.report.saturated.hazards).then(|| self.hazard_share()),
            "kinetic_energy_before_j": self.energy[0],
            "kinetic_energy_j": self.energy[1],
            "digest": { "algorithm": digest::ALGORITHM, "value": self.digest },
            "comparison": differences,
            "beside_bullet": self.beside_bullet,
        })
    }
}
