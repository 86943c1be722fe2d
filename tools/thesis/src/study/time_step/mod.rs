//! The study `time-step`: the trade-off of speed against accuracy that the time step decides
//! (thesis §2.1, Figure 2.2).
//!
//! Two scenes, each for the same simulated time: a body in free flight, whose exact path is known,
//! and a pile of cubes. The board integrates both.

mod show;

use clap::Args;
use scene::{Grid, Scene, SceneOptions};
use zynq_pgs::{Body, Pose, StepParameters, Velocity};

use crate::experiment::{Boards, Experiment, Measure, Part};
use crate::session::Session;
use pgs_command::board::{self, OpenBoard};
use pgs_command::failure::{Failure, Result};
use pgs_command::options::scenes;

const EXAMPLES: &str = "\
Examples:
  pgs thesis time-step
  pgs thesis time-step --grid 8x8x8 --seconds 3 --iterations 10
  pgs thesis time-step --json > time-step.json

Free flight: explicit Euler moves by the velocity at the start of the step, symplectic Euler by the
one at its end. The board is explicit (position before gravity). With contacts it is symplectic one
step late: the velocity that moves a body has passed the solver and has the gravity of the step
before. Pile: deepest penetration of the whole run and at its end, kinetic energy without the
gravity of the last step, and the mean distance of the bodies from those of the shortest time step.

Damping acts once a step, and the share of a penetration that a step removes is the same for each
time step: a pile with a short time step is damped and pushed apart more often a second.";

/// Steps a second, from the shortest time step to the longest: each a multiple of the last.
const RATES: [u16; 6] = [480, 240, 120, 60, 30, 15];
/// Velocity of the body in flight at the start, m/s.
const THROWN: [f32; 3] = [3.0, 8.0, 0.0];
/// Its height, m.
const HEIGHT: f32 = 50.0;

/// The experiment.
pub(crate) static TIME_STEP: Experiment = Experiment::of::<Options>(
    "time-step",
    "§2.1.1, Figure 2.2",
    Boards::Any,
    "A body in flight and a pile with time steps from 1/480 s to 1/15 s",
);

/// Its arguments.
#[derive(Debug, Clone, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Options {
    /// Cubes of the pile along each axis.
    #[arg(long, value_name = "NXxNYxNZ", default_value = "5x5x5")]
    pub(crate) grid: Grid,
    /// Height of the lowest cubes above the ground at the start, m.
    #[arg(long, value_name = "H", default_value_t = 1.0)]
    pub(crate) drop: f32,
    /// Simulated time, s.
    #[arg(
        long,
        value_name = "S",
        default_value_t = 2,
        value_parser = clap::value_parser!(u16).range(1..=60)
    )]
    pub(crate) seconds: u16,
    /// Contact iterations, and the same number of friction iterations.
    #[arg(
        long,
        value_name = "K",
        default_value_t = 4,
        value_parser = clap::value_parser!(u32).range(1..=255)
    )]
    pub(crate) iterations: u32,
}

/// One time step.
#[derive(Debug)]
pub(crate) struct Row {
    pub(crate) steps_per_second: u16,
    pub(crate) time_step_s: f64,
    pub(crate) flight: Flight,
    pub(crate) pile: Pile,
}

/// Distance of a body in free flight from its exact position at the end, m.
#[derive(Debug)]
pub(crate) struct Flight {
    pub(crate) explicit_m: f64,
    pub(crate) symplectic_m: f64,
    pub(crate) board_m: f64,
}

/// A pile after the simulated time, and the cost of its steps.
#[derive(Debug)]
pub(crate) struct Pile {
    pub(crate) steps: u32,
    pub(crate) deepest_m: f64,
    pub(crate) deepest_at_end_m: f64,
    /// Without the gravity that the last step has added.
    pub(crate) kinetic_at_end_j: f64,
    pub(crate) kinetic_most_j: f64,
    /// Mean over the bodies; 0 for the shortest time step.
    pub(crate) distance_from_shortest_m: f64,
    pub(crate) cycles_per_second: f64,
    /// Time on the board for a simulated second.
    pub(crate) board_ms_per_second: f64,
}

/// The pile at one time.
#[derive(Debug)]
struct Sample {
    deepest_m: f64,
    kinetic_j: f64,
}

impl Measure for Options {
    /// Takes the steps of every length.
    fn measure(&self, session: &Session) -> Result<Part> {
        scenes::check_rows(self.grid)?;
        let mut opened = board::open(&session.common, session.common.build().config())?.stated();
        session.watch(&mut opened);
        let scene = scene(self)?;
        opened.accelerator.set_shapes(scene.shapes()).map_err(|error| opened.failure(error))?;
        let seconds = u32::from(self.seconds);
        session.expect(RATES.iter().map(|rate| 2 * u64::from(*rate) * u64::from(seconds)).sum());
        let mut rows: Vec<Row> = Vec::new();
        let mut shortest = None;
        for rate in RATES {
            let parameters = StepParameters::thesis()
                .with_contact_iterations(self.iterations)
                .with_friction_iterations(self.iterations)
                .with_time_step(1.0 / f32::from(rate));
            let mut run = Run { opened: &mut opened, session, parameters, rate, seconds };
            let Some(flight) = run.fly(&scene)? else { break };
            let Some((pile, ends)) = run.pile(self, shortest.as_deref())? else { break };
            shortest.get_or_insert(ends);
            let time_step_s = 1.0 / f64::from(rate);
            rows.push(Row { steps_per_second: rate, time_step_s, flight, pile });
        }
        session.end();
        Ok(Part { complete: rows.len() == RATES.len(), ..show::part(self, &rows) })
    }
}

fn scene(options: &Options) -> Result<Scene> {
    let Options { grid, drop, .. } = *options;
    Scene::new(&SceneOptions { grid, drop }).map_err(Failure::input)
}

/// A pile's measures, and its positions at the end.
type Ended = (Pile, Vec<[f64; 3]>);

/// The runs with one time step.
struct Run<'a> {
    opened: &'a mut OpenBoard,
    session: &'a Session,
    parameters: StepParameters,
    rate: u16,
    seconds: u32,
}

impl Run<'_> {
    fn steps(&self) -> u32 {
        u32::from(self.rate) * self.seconds
    }

    /// Throws a body of the scene's shape; none if Ctrl-C ended it.
    fn fly(&mut self, scene: &Scene) -> Result<Option<Flight>> {
        let position = [0.0, HEIGHT, 0.0];
        let pose = Pose { position, orientation: [0.0, 0.0, 0.0, 1.0] };
        let velocity = Velocity { linear: THROWN, angular: [0.0; 3] };
        let shape = scene.bodies().last().map_or(0, |body| body.shape);
        let mut bodies = vec![Body { pose, velocity, shape }];
        for _ in 0..self.steps() {
            let none: &[zynq_pgs::Collision] = &[];
            let stepped = self.opened.accelerator.step(&mut bodies, none, &self.parameters);
            match stepped {
                Ok(_) => self.session.advance(),
                Err(error) if board::is_cancelled(&error) => return Ok(None),
                Err(error) => return Err(self.opened.failure(error)),
            }
        }
        let wide = |v: [f32; 3]| v.map(f64::from);
        let gravity = wide(self.parameters.gravity);
        let exact = flown([wide(position), wide(THROWN), gravity], self.seconds.into());
        let at_end = bodies.first().map_or([f64::NAN; 3], |body| wide(body.pose.position));
        // Explicit Euler is too high by half a step of the speed gained, symplectic too low.
        let half_a_step = f64::from(self.seconds) / f64::from(self.rate) / 2.0;
        let off = distance(gravity.map(|g| g * half_a_step), [0.0; 3]);
        let board_m = distance(at_end, exact);
        Ok(Some(Flight { explicit_m: off, symplectic_m: off, board_m }))
    }

    /// Drops the pile; its measures and the positions at the end, or none if Ctrl-C ended it.
    fn pile(&mut self, options: &Options, shortest: Option<&[[f64; 3]]>) -> Result<Option<Ended>> {
        let mut scene = scene(options)?;
        let (mut cycles, mut board) = (0_u64, 0.0);
        let (mut deepest, mut kinetic_most) = (0.0_f64, 0.0_f64);
        let mut at_end = self.sample(&mut scene, 0);
        for step in 1..=self.steps() {
            let (bodies, collisions) = scene.parts_mut();
            let report = match self.opened.accelerator.step(bodies, collisions, &self.parameters) {
                Ok(report) => report,
                Err(error) if board::is_cancelled(&error) => return Ok(None),
                Err(error) => return Err(self.opened.failure(error)),
            };
            self.session.advance();
            cycles = cycles.saturating_add(report.cycles.total);
            board += report.modelled_time().as_secs_f64();
            at_end = self.sample(&mut scene, step);
            deepest = larger(deepest, at_end.deepest_m);
            kinetic_most = larger(kinetic_most, at_end.kinetic_j);
        }
        let positions = scene.bodies().iter().map(|body| body.pose.position.map(f64::from));
        let positions: Vec<[f64; 3]> = positions.collect();
        let pile = Pile {
            steps: self.steps(),
            deepest_m: deepest,
            deepest_at_end_m: at_end.deepest_m,
            kinetic_at_end_j: at_end.kinetic_j,
            kinetic_most_j: kinetic_most,
            distance_from_shortest_m: shortest
                .map_or(0.0, |other| mean_distance(&positions, other)),
            cycles_per_second: cycles as f64 / f64::from(self.seconds),
            board_ms_per_second: board * 1e3 / f64::from(self.seconds),
        };
        Ok(Some((pile, positions)))
    }

    /// Detects the collisions of the next step, and measures the pile.
    fn sample(&self, scene: &mut Scene, step: u32) -> Sample {
        let deepest_m = scene::penetration(scene.detect()).largest;
        let StepParameters { gravity, time_step, .. } = self.parameters;
        let (bodies, shapes) = (scene.bodies(), scene.shapes());
        let kinetic = match step {
            0 => scene::kinetic_energy_parts(bodies, shapes),
            _ => scene::kinetic_energy_before_gravity(bodies, shapes, gravity, time_step),
        };
        Sample { deepest_m, kinetic_j: kinetic.total() }
    }
}

/// The position of a body in free flight (thesis, equation 2.7).
fn flown([position, speed, gravity]: [[f64; 3]; 3], t: f64) -> [f64; 3] {
    [0, 1, 2].map(|k| position[k] + speed[k] * t + 0.5 * gravity[k] * t * t)
}

fn larger(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    let [x, y, z] = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    (x * x + y * y + z * z).sqrt()
}

fn mean_distance(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    let sum = a.iter().zip(b).fold(0.0, |sum, (a, b)| sum + distance(*a, *b));
    // The ground, which all runs share, does not move.
    sum / (a.len().saturating_sub(1) as f64).max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand, with steps: both are off by g t dt / 2, explicit above and symplectic below.
    #[test]
    fn euler_is_off_by_half_a_step_of_the_speed_gained() {
        let exact = flown([[1.0, 2.0, 0.0], [3.0, 8.0, 0.0], [0.0, -10.0, 0.0]], 2.0);
        assert!(distance(exact, [7.0, -2.0, 0.0]) < 1e-12);
        for rate in RATES {
            let dt = 1.0 / f64::from(rate);
            let (mut explicit, mut symplectic, mut speed) = (2.0, 2.0, 8.0);
            for _ in 0..2 * rate {
                explicit += speed * dt;
                speed -= 10.0 * dt;
                symplectic += speed * dt;
            }
            let expected = 10.0 * 2.0 * dt / 2.0;
            assert!((explicit - exact[1] - expected).abs() < 1e-9, "{explicit}");
            assert!((symplectic - exact[1] + expected).abs() < 1e-9, "{symplectic}");
        }
    }

    #[test]
    fn the_mean_distance_leaves_the_ground_out() {
        let at = |y| vec![[0.0; 3], [0.0, y, 0.0], [0.0, y, 0.0]];
        assert!((mean_distance(&at(1.0), &at(4.0)) - 3.0).abs() < 1e-12);
    }
}
