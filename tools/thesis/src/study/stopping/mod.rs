//! The study `stopping`: what each rule by which the thesis ends an iterative solver (§2.2.3) costs
//! in passes, and what a fixed number of passes leaves.
//!
//! The board takes the same step with 0, 1, 2 ... passes; the impulses and velocities that it gives
//! out are judged on the host ([`residual`]). No other solver runs.

mod residual;

use std::path::PathBuf;

use clap::Args;
use scene::Grid;
use zynq_pgs::order::Order;
use zynq_pgs::{Impulses, StepParameters};

use self::residual::{Part as RowPart, Problem, Residuals};
use crate::estimate::thesis;
use crate::experiment::{Boards, Experiment, Measure, Part};
use crate::figure::{Axis, Drawn, Figure, Series, lines};
use crate::session::Session;
use crate::study::given::GivenStep;
use crate::table::{Cell, Table};
use pgs_command::board::{self, OpenBoard};
use pgs_command::failure::Result;
use pgs_command::numbers::{grouped, number};
use pgs_command::options::scenes;
use pgs_command::options::solver::SolverArgs;
use pgs_command::pile;
use pgs_command::step_input;

const EXAMPLES: &str = "\
Examples:
  pgs thesis stopping
  pgs thesis stopping --input tests/golden/pile5_step60 --passes 60
  pgs thesis stopping --grid 10x10x10 --steps 90 --spin-damping 0 --json

The residual is a speed in m/s: over all contacts min(L / m, e + b), with L the impulse, m the
effective mass and e + b the speed along the normal with its bias; over all tangents what one more
pass would change, by the effective mass. It is computed in 64 bits, the passes in the board's 32.

Rules (thesis 2.2.3): a fixed number of passes; the residual (root mean square) falls below a
tolerance; the largest change of an impulse in a pass falls below a tolerance; each change falls
below a share of the impulse before the pass. Tolerances of the first two are relative: to the
residual before the first pass, and to the change of the first pass. Friction passes follow the
step's own contact passes. The damping of spin is no part of the problem; with it the friction
passes leave a residual that they never remove: --spin-damping 0 takes it out.";

/// Tolerances.
const TOLERANCES: [f64; 4] = [1e-1, 1e-2, 1e-3, 1e-4];

/// The experiment.
pub(crate) static STOPPING: Experiment = Experiment::of::<Options>(
    "stopping",
    "§2.2.3",
    Boards::Any,
    "One step with 0, 1, 2 ... passes, and what is left to solve",
);

/// Its arguments.
#[derive(Debug, Clone, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Options {
    /// Take the step in this folder of .npy arrays instead of a pile's.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["grid", "drop", "steps"])]
    pub(crate) input: Option<PathBuf>,
    /// Cubes of the pile along each axis.
    #[arg(long, value_name = "NXxNYxNZ", default_value = "6x6x6")]
    pub(crate) grid: Grid,
    /// Height of the lowest cubes above the ground at the start, m.
    #[arg(long, value_name = "H", default_value_t = 0.5)]
    pub(crate) drop: f32,
    /// Steps that the pile takes before the measured step.
    #[arg(long, value_name = "N", default_value_t = 60)]
    pub(crate) steps: u32,
    /// Most passes of each kind.
    #[arg(
        long,
        value_name = "K",
        default_value_t = 64,
        value_parser = clap::value_parser!(u32).range(2..=255)
    )]
    pub(crate) passes: u32,
    #[command(flatten)]
    pub(crate) solver: SolverArgs,
}

/// The state after a number of passes.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Pass {
    passes: u32,
    residuals: Residuals,
    /// Largest change of an impulse in the last pass, N s; none before the first.
    change: Option<f64>,
    /// The largest change as a share of the impulse before the pass; none before the first, and
    /// where an impulse has begun in the pass.
    share: Option<f64>,
}

/// The kind of passes that are counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Counted {
    /// Contact passes without friction passes.
    Contact,
    /// Friction passes behind the step's own contact passes.
    Friction,
}

/// The step, and the board that takes it.
struct Course<'a> {
    opened: &'a mut OpenBoard,
    session: &'a Session,
    step: &'a GivenStep,
    problem: &'a Problem,
}

impl Course<'_> {
    /// Takes the step with 0 to `most` passes; fewer where Ctrl-C ended them.
    fn take(&mut self, most: u32, counted: Counted) -> Result<Vec<Pass>> {
        let contact = self.step.parameters.contact_iterations;
        let mut passes: Vec<Pass> = Vec::new();
        let mut before: Option<Vec<Impulses>> = None;
        for number in 0..=most {
            let split = match counted {
                Counted::Contact => [number, 0],
                Counted::Friction => [contact, number],
            };
            let Some((residuals, impulses)) = self.solve(split)? else { break };
            let changes = before.map(|before| self.changes(counted, &before, &impulses));
            let (change, share) = changes.unzip();
            passes.push(Pass { passes: number, residuals, change, share: share.flatten() });
            before = Some(impulses);
        }
        Ok(passes)
    }

    /// The residuals and impulses after the passes; none if Ctrl-C ended them. Without a pass
    /// nothing has changed, and the board takes no step. The order is one for every number of
    /// passes, so that each pass goes on from the one before.
    fn solve(
        &mut self,
        [contact, friction]: [u32; 2],
    ) -> Result<Option<(Residuals, Vec<Impulses>)>> {
        let mut bodies = self.step.bodies.clone();
        let mut impulses = vec![Impulses::ZERO; self.step.collisions.len()];
        if contact + friction > 0 {
            let parameters = self
                .step
                .parameters
                .with_integrate(false)
                .with_impulses_out(true)
                .with_contact_iterations(contact)
                .with_friction_iterations(friction)
                .with_order(Order::AsGiven);
            let accelerator = &mut self.opened.accelerator;
            match accelerator.step(&mut bodies, &self.step.collisions, &parameters) {
                Ok(_) => self.opened.alive()?,
                Err(error) if board::is_cancelled(&error) => return Ok(None),
                Err(error) => {
                    return Err(step_input::failure(self.step.folder.as_ref(), self.opened, error));
                }
            }
            impulses = self.opened.accelerator.impulses().to_vec();
        }
        self.session.advance();
        Ok(Some((self.problem.residuals(&bodies, &impulses), impulses)))
    }

    /// The largest change of an impulse, and the largest share of its value before; none where one
    /// begins, whose share is infinite.
    fn changes(
        &self,
        counted: Counted,
        before: &[Impulses],
        after: &[Impulses],
    ) -> (f64, Option<f64>) {
        let (mut change, mut share) = (0.0_f64, 0.0_f64);
        let is_counted = |part: RowPart| match part {
            RowPart::Point(_) => counted == Counted::Contact,
            RowPart::Tangent(_) => counted == Counted::Friction,
        };
        for row in self.problem.rows.iter().filter(|row| is_counted(row.part)) {
            let was = row.impulse(before);
            let moved = (row.impulse(after) - was).abs();
            change = change.max(moved);
            if moved > 0.0 {
                share = share.max(moved / was.abs());
            }
        }
        (change, share.is_finite().then_some(share))
    }
}

impl Measure for Options {
    /// Takes the step with each number of passes.
    fn measure(&self, session: &Session) -> Result<Part> {
        let mut opened = board::open(&session.common, session.common.build().config())?.stated();
        let (name, step) = match &self.input {
            Some(path) => (path.display().to_string(), Some(GivenStep::folder(path)?)),
            None => {
                let Options { grid, drop, steps, .. } = *self;
                scenes::check_size(grid, opened.accelerator.capabilities())?;
                let (scene, parameters) = (pile::build(grid, drop)?, StepParameters::thesis());
                let parameters = self.solver.apply(parameters);
                let step = GivenStep::after(steps, scene, &mut opened, parameters, session)?;
                (format!("step {} of {grid} cubes dropped from {drop} m", steps + 1), step)
            }
        };
        let Some(mut step) = step else { return Ok(Part::interrupted()) };
        session.watch(&mut opened);
        step.parameters = self.solver.apply(step.parameters);
        step_input::set_shapes(&mut opened.accelerator, &step.shapes)
            .map_err(|error| step_input::failure(step.folder.as_ref(), &opened, error))?;
        let problem = Problem::new(&step.bodies, &step.shapes, &step.collisions, &step.parameters);
        let StepParameters { contact_iterations, friction_iterations, spin_damping, .. } =
            step.parameters;
        session.expect(2 * u64::from(self.passes) + 2);
        let mut course = Course { opened: &mut opened, session, step: &step, problem: &problem };
        let contact = course.take(self.passes, Counted::Contact)?;
        let friction = course.take(self.passes, Counted::Friction)?;
        session.end();

        let mut part = Part::of(vec![
            residuals("contact", "Contact passes", &contact),
            residuals(
                "friction",
                "Friction passes behind the step's own contact passes",
                &friction,
            ),
            rules(&contact, &friction),
        ]);
        part.complete = contact.len() + friction.len() == 2 * (self.passes as usize + 1);
        let text = format!(
            "{name}: {} bodies, {} collisions, spin damping {spin_damping}",
            grouped(step.bodies.len() as u64),
            grouped(step.collisions.len() as u64),
        );
        part.fact("step", text);
        if let Some(Pass { residuals: Residuals { contact, friction }, .. }) =
            friction.get(friction_iterations as usize)
        {
            let text = format!(
                "{contact_iterations} + {friction_iterations} passes leave {} m/s at the contacts and \
             {} m/s at the tangents (root mean square), {} and {} m/s at most",
                number(contact.rms),
                number(friction.rms),
                number(contact.largest),
                number(friction.largest),
            );
            part.fact("fixed", text);
        }
        let series = |passes: &[Pass], of: fn(&Pass) -> f64| -> Vec<(f64, f64)> {
            passes.iter().map(|pass| (f64::from(pass.passes), of(pass))).collect()
        };
        let behind = format!("friction passes behind {contact_iterations} contact passes");
        let series = [
            Series::new("contact passes", Drawn::Line, series(&contact, contact_rms)),
            Series::new(behind, Drawn::Line, series(&friction, friction_rms)),
        ];
        let (x, y) = (Axis::linear("passes"), Axis::log("residual (root mean square), m/s"));
        let figure = Figure::new(
            ("figure-stopping", "§2.2.3"),
            "Residual of the contact problem after each pass",
            lines(x, y, &series),
            format!("{name}. The thesis stops after {}.", fixed()),
        );
        let passes = |passes: &[Pass], tolerance, of| {
            let found = Rules::of(passes, tolerance, of).residual;
            found.map_or_else(|| format!("more than {}", most(passes)), |passes| passes.to_string())
        };
        let ours = TOLERANCES.map(|tolerance| {
            let [contact, friction] = [
                passes(&contact, tolerance, contact_rms),
                passes(&friction, tolerance, friction_rms),
            ];
            format!("{tolerance:.0e}: {contact} contact, {friction} friction")
        });
        let row = figure.row(
            "passes until the residual has fallen to a share of its first value",
            fixed(),
            ours.join("; "),
        );
        part.figure(figure, [row]);
        Ok(part)
    }
}

fn contact_rms(pass: &Pass) -> f64 {
    pass.residuals.contact.rms
}

fn friction_rms(pass: &Pass) -> f64 {
    pass.residuals.friction.rms
}

fn most(passes: &[Pass]) -> u32 {
    passes.last().map_or(0, |pass| pass.passes)
}

/// The thesis' stopping rule; its number of passes is inferred.
fn fixed() -> String {
    let passes = thesis::step().passes();
    format!("a fixed number of passes, not printed; {passes} by its cycles (inferred)")
}

/// A table of the residuals after the first passes, and after later ones ever further apart.
fn residuals(id: &'static str, title: &str, passes: &[Pass]) -> Table {
    let mut table = Table::new(id, title);
    let shown = |number: u32| {
        number <= 8
            || number == most(passes)
            || number.is_power_of_two()
            || number.is_multiple_of(3) && (number / 3).is_power_of_two()
    };
    for pass in passes.iter().filter(|pass| shown(pass.passes)) {
        let Residuals { contact, friction } = pass.residuals;
        table.row([
            ("passes", "passes", Cell::Whole(pass.passes.into())),
            ("contact_rms_m_s", "contacts\nrms m/s", Cell::Digits(contact.rms)),
            ("contact_largest_m_s", "\nlargest", Cell::Digits(contact.largest)),
            ("friction_rms_m_s", "tangents\nrms m/s", Cell::Digits(friction.rms)),
            ("friction_largest_m_s", "\nlargest", Cell::Digits(friction.largest)),
            ("largest_change_n_s", "change\nN s", Cell::known(pass.change, Cell::Digits)),
            ("largest_share", "share", Cell::known(pass.share, Cell::Digits)),
        ]);
    }
    table
}

/// Passes by each rule; none if the measured passes are too few.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Rules {
    residual: Option<u32>,
    largest_change: Option<u32>,
    each_change: Option<u32>,
}

impl Rules {
    /// The passes after which each rule holds for the first time.
    fn of(passes: &[Pass], tolerance: f64, residual: fn(&Pass) -> f64) -> Self {
        let first = |holds: &dyn Fn(&Pass) -> bool| {
            passes.iter().find(|pass| holds(pass)).map(|pass| pass.passes)
        };
        let start = passes.first().map_or(0.0, residual);
        let change = passes.iter().find_map(|pass| pass.change).unwrap_or(0.0);
        let below = |value: Option<f64>, limit: f64| value.is_some_and(|value| value <= limit);
        Self {
            residual: first(&|pass| residual(pass) <= tolerance * start),
            largest_change: first(&|pass| below(pass.change, tolerance * change)),
            each_change: first(&|pass| below(pass.share, tolerance)),
        }
    }
}

/// The passes until each rule holds.
fn rules(contact: &[Pass], friction: &[Pass]) -> Table {
    let mut table = Table::new("rules", "Passes until a rule holds");
    for tolerance in TOLERANCES {
        let passes = |passes: Option<u32>| Cell::known(passes, |n| Cell::Whole(n.into()));
        let [of_contact, of_friction] = [
            Rules::of(contact, tolerance, contact_rms),
            Rules::of(friction, tolerance, friction_rms),
        ];
        table.row([
            ("tolerance", "tolerance", Cell::Digits(tolerance)),
            ("contact_residual", "contact\nresidual", passes(of_contact.residual)),
            ("contact_change", "contact\nchange", passes(of_contact.largest_change)),
            ("contact_each", "contact\neach", passes(of_contact.each_change)),
            ("friction_residual", "friction\nresidual", passes(of_friction.residual)),
            ("friction_change", "friction\nchange", passes(of_friction.largest_change)),
            ("friction_each", "friction\neach", passes(of_friction.each_change)),
        ]);
    }
    table.note(format!(
        "A missing number is above the {} contact and {} friction passes that were measured.",
        most(contact),
        most(friction)
    ));
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_thesis_stops_after_a_number_that_it_does_not_print() {
        let text = fixed();
        assert!(text.contains("not printed; 8 by its cycles (inferred)"), "{text}");
        assert!(!text.contains('4'), "{text}");
    }
}
