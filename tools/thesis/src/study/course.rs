//! Steps sides from one start, and measures how far each strays from one of them, step by step.

use pgs_command::board::{self, OpenBoard};
use pgs_command::failure::{Failure, Result};
use scene::{
    KineticEnergy, Momentum, Penetration, carry_along, kinetic_energy_parts, momentum, penetration,
    potential_energy,
};
use zynq_pgs::{Body, StepParameters};

use super::start::{Start, World};
use super::words;
use crate::deviation::{Deviations, StateDeviation, components, moving, unmoved_share};
use crate::narrow::{NarrowFormat, carried};
use crate::permutation::{Arranger, Permutation};
use crate::session::Session;
use crate::table::{Cell, Table, text};

/// A state, after a step of a side or at the start.
#[derive(Debug, Clone)]
pub(crate) struct Point {
    collisions: usize,
    /// Collisions that met a hazard in the step, as the board counts them.
    hazards: Option<u64>,
    pub(crate) kinetic: KineticEnergy,
    /// J.
    potential: f64,
    momentum: Momentum,
    /// After the step: over the newly detected collisions, or over the step's own contacts, carried
    /// along with their bodies.
    penetration: Penetration,
    /// Share of the position components whose bits, as sent to the board, the step did not change;
    /// none at the start.
    unmoved: Option<f64>,
    /// Against the original; none for the original itself, and at the start.
    pub(crate) away: Option<Away>,
}

/// A state against the original's.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Away {
    pub(crate) state: StateDeviation,
    /// Kinetic energy of the original, J.
    kinetic: f64,
}

impl Point {
    /// The kinetic energy by that of the original; none where the original rests.
    pub(crate) fn energy_ratio(&self) -> Option<f64> {
        let original = self.away?.kinetic;
        (original > 0.0).then(|| self.kinetic.total() / original)
    }
}

/// A measure of a state: its key, its heading, and its value.
pub(crate) type Measure = (&'static str, &'static str, fn(&Point) -> Option<f64>);

/// All measures.
const MEASURES: [Measure; 20] = [
    ("collisions", "pairs", |at| Some(at.collisions as f64)),
    ("hazards", "hazards", |at| at.hazards.map(|count| count as f64)),
    ("kinetic_kj", "kinetic\nkJ", |at| Some(at.kinetic.total() / 1e3)),
    ("rotational_kj", "of spin\nkJ", |at| Some(at.kinetic.rotational / 1e3)),
    ("energy_ratio", "energy\ntimes", Point::energy_ratio),
    ("energy_difference_percent", "energy\n% apart", |at| {
        let [new, original] = [at.kinetic.total(), at.away?.kinetic];
        Some(if original == 0.0 { 0.0 } else { (new - original).abs() / original * 100.0 })
    }),
    ("potential_kj", "potential\nkJ", |at| Some(at.potential / 1e3)),
    ("momentum_n_s", "momentum\nN s", |at| Some(length(at.momentum.linear))),
    ("angular_n_m_s", "angular\nN m s", |at| Some(length(at.momentum.angular))),
    ("penetration_mean_mm", "deep\nmm mean", |at| Some(at.penetration.mean * 1e3)),
    ("penetration_most_mm", "deep\nmm most", |at| Some(at.penetration.largest * 1e3)),
    ("unmoved_percent", "unmoved\n%", |at| Some(at.unmoved? * 100.0)),
    POSITION_MEAN,
    ("position_under_1_percent", "position\n% < 1 %", |at| {
        Some(at.away?.state.position.under_share() * 100.0)
    }),
    ("position_mean_mm", "position\nmm mean", |at| {
        Some(at.away?.state.position.mean_absolute * 1e3)
    }),
    ("position_most_percent", "position\n% most", |at| {
        Some(at.away?.state.position.largest * 100.0)
    }),
    ("linear_within_1_percent", "linear\n% in 1 %", |at| {
        Some(at.away?.state.linear.within_share() * 100.0)
    }),
    ("linear_most_m_s", "linear\nm/s most", |at| Some(at.away?.state.linear.largest_absolute)),
    ("angular_within_1_percent", "spin\n% in 1 %", |at| {
        Some(at.away?.state.angular.within_share() * 100.0)
    }),
    ("angular_most_rad_s", "spin\nrad/s most", |at| Some(at.away?.state.angular.largest_absolute)),
];

/// The mean deviation of the positions (thesis, equation 4.1).
pub(crate) const POSITION_MEAN: Measure =
    ("position_mean_percent", "position\n% mean", |at| Some(at.away?.state.position.mean * 100.0));

fn length([x, y, z]: [f64; 3]) -> f64 {
    ((x * x + y * y) + z * z).sqrt()
}

/// A table with a row for each shown step of each side.
pub(crate) struct Steps {
    measures: Vec<Measure>,
    pub(crate) table: Table,
}

impl Steps {
    /// A table of the measures with these keys.
    pub(crate) fn new(title: &str, keys: &[&str]) -> Self {
        let measures: Vec<_> =
            MEASURES.into_iter().filter(|(key, ..)| keys.contains(key)).collect();
        debug_assert_eq!(measures.len(), keys.len(), "{keys:?}");
        let columns = [("step", "step"), ("side", "")].into_iter();
        let columns: Vec<_> =
            columns.chain(measures.iter().map(|(key, head, _)| (*key, *head))).collect();
        Self { table: Table::with_columns("steps", title, &columns), measures }
    }

    /// Adds a row.
    pub(crate) fn row(
        &mut self,
        step: u32,
        side: &str,
        value: impl Fn(fn(&Point) -> Option<f64>) -> Option<f64>,
    ) {
        let cells = self.measures.iter().map(|(key, _, of)| {
            Cell::known(value(*of), |value| match *key {
                "collisions" | "hazards" => Cell::Number(value, 0),
                _ => Cell::Digits(value),
            })
        });
        self.table.row([Cell::Whole(step.into()), text(side)].into_iter().chain(cells));
    }

    /// Adds a row for each side at the shown steps; at the start all are the same.
    pub(crate) fn rows(&mut self, start: &Start<'_>, sides: &[Side]) {
        for step in start.shown() {
            let all = if step == 0 { &sides[..sides.len().min(1)] } else { sides };
            for side in all {
                let Some(point) = side.points.get(step as usize) else { continue };
                let name = if step == 0 { "start" } else { &side.name };
                self.row(step, name, |of| of(point));
            }
        }
    }
}

/// The solver of a side.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Solver {
    /// The board at this place.
    Board(usize),
    /// The reference solver in binary16, behind words of this format.
    Words(NarrowFormat),
}

/// A run that is compared.
#[derive(Debug)]
pub(crate) struct Side {
    pub(crate) name: String,
    pub(crate) world: World,
    /// None if the collisions stay as given.
    arranger: Option<Arranger>,
    solver: Solver,
    parameters: StepParameters,
    /// The start, and the state after each step.
    pub(crate) points: Vec<Point>,
    /// The step that failed, and why.
    pub(crate) failed: Option<(u32, Failure)>,
}

impl Side {
    pub(crate) fn new(
        name: impl Into<String>,
        start: &Start<'_>,
        solver: Solver,
        permutation: Option<Permutation>,
        parameters: StepParameters,
    ) -> Self {
        let recorded = || start.recorded_order.clone();
        Self {
            name: name.into(),
            world: start.world.clone(),
            arranger: permutation.map(|order| Arranger::new(order, recorded())),
            solver,
            parameters,
            points: Vec::new(),
            failed: None,
        }
    }

    /// Takes a step, and measures the state behind it; false if Ctrl-C ended it.
    fn step(&mut self, boards: &mut [OpenBoard], moving: &[bool]) -> Result<bool> {
        let before = self.world.bodies().to_vec();
        let shapes = self.world.shapes().to_vec();
        let (bodies, collisions) = self.world.parts_mut();
        let collisions = match &mut self.arranger {
            Some(arranger) => arranger.arrange(bodies, &shapes, collisions),
            None => collisions,
        };
        let (poses, hazards) = match self.solver {
            Solver::Board(place) => {
                let opened = &mut boards[place];
                match opened.accelerator.step(bodies, collisions, &self.parameters) {
                    Ok(report) => {
                        opened.alive()?;
                        let numbers = opened.accelerator.capabilities().variant.numbers;
                        (NarrowFormat::of(numbers.poses), Some(report.hazards))
                    }
                    Err(error) if board::is_cancelled(&error) => return Ok(false),
                    Err(error) => return Err(self.world.failure(opened, error)),
                }
            }
            Solver::Words(format) => {
                words::step(format, bodies, &shapes, collisions, &self.parameters)
                    .map_err(Failure::input)?;
                (Some(format), None)
            }
        };
        let unmoved = unmoved_share(&before, self.world.bodies(), moving, |x| carried(poses, x));
        self.measure(Some((&before, unmoved)), hazards);
        Ok(true)
    }

    /// Detects the collisions of the next step, and measures the state; `step` is the bodies before
    /// the step that led here, and the share of components that it left as they were.
    fn measure(&mut self, step: Option<(&[Body], f64)>, hazards: Option<u64>) {
        let collisions = match (&mut self.world, step) {
            (World::Scene(scene), _) => scene.detect().to_vec(),
            (World::Folder { folder, bodies }, Some((before, _))) => {
                carry_along(&folder.collisions, before, bodies)
            }
            (World::Folder { folder, .. }, None) => folder.collisions.clone(),
        };
        let (bodies, shapes) = (self.world.bodies(), self.world.shapes());
        self.points.push(Point {
            collisions: collisions.len(),
            hazards,
            kinetic: kinetic_energy_parts(bodies, shapes),
            potential: potential_energy(bodies, shapes, self.parameters.gravity),
            momentum: momentum(bodies, shapes),
            penetration: penetration(&collisions),
            unmoved: step.map(|(_, unmoved)| unmoved),
            away: None,
        });
    }

    /// The deviations of a part of the moving bodies' states from another side's.
    pub(crate) fn deviations(&self, original: &Self, field: fn(&Body) -> [f32; 3]) -> Deviations {
        let moving = moving(self.world.bodies(), self.world.shapes());
        Deviations::of(components(original.world.bodies(), self.world.bodies(), &moving, field))
    }
}

/// Takes the steps of all sides, and compares them with the one at the place `original`; false if
/// Ctrl-C ended them. A side that fails stops; a failure of the original, or of a side before it,
/// ends all.
pub(crate) fn take(
    sides: &mut [Side],
    original: usize,
    boards: &mut [OpenBoard],
    start: &Start<'_>,
    session: &Session,
) -> Result<bool> {
    let moving = moving(start.world.bodies(), start.world.shapes());
    session.expect(u64::from(start.steps) * sides.len() as u64);
    sides.iter_mut().for_each(|side| side.measure(None, None));
    for step in 1..=start.steps {
        for (place, side) in sides.iter_mut().enumerate() {
            if side.failed.is_some() {
                continue;
            }
            if session.is_interrupted() {
                return Ok(false);
            }
            match side.step(boards, &moving) {
                Ok(true) => session.advance(),
                Ok(false) => return Ok(false),
                Err(failure) if place <= original => return Err(failure),
                Err(failure) => side.failed = Some((step, failure)),
            }
        }
        let of = &sides[original];
        let (bodies, kinetic) = (of.world.bodies().to_vec(), of.points.last().map(|at| at.kinetic));
        let others = sides.iter_mut().enumerate().filter(|(place, _)| *place != original);
        for (_, side) in others.filter(|(_, side)| side.failed.is_none()) {
            let state = StateDeviation::of(&bodies, side.world.bodies(), &moving);
            if let Some(point) = side.points.last_mut() {
                point.away = kinetic.map(|kinetic| Away { state, kinetic: kinetic.total() });
            }
        }
    }
    Ok(true)
}
