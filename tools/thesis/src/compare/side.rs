//! Steps one of the two compared boards and measures its state.

use scene::{
    KineticEnergy, Momentum, Penetration, carry_along, kinetic_energy_parts, momentum, penetration,
    potential_energy,
};
use serde_json::{Value, json};
use zynq_pgs::{Body, Collision, Error, Fault, InputError, StepParameters, StepReport};

use super::spec::SideSpec;
use crate::deviation::{moving, unmoved_share};
use crate::narrow::{NarrowFormat, carried};
use crate::permutation::{self, Permutation};
use crate::study::run::{Run, World};
use pgs_command::board::{self, OpenBoard};
use pgs_command::common::{BoardName, CommonArgs};
use pgs_command::failure::{Failure, Result};
use pgs_command::step_input;
use step_folder::digest;

/// The measures of a state.
pub(super) struct Measured {
    /// The number of collisions that `penetration` measures.
    pub(super) collisions: u64,
    pub(super) kinetic: KineticEnergy,
    /// J.
    pub(super) potential: f64,
    pub(super) momentum: Momentum,
    /// Measured after the step: over the newly detected collisions, or over the step's own
    /// contacts, carried along with their bodies.
    pub(super) penetration: Penetration,
    /// Share of the position components whose bits, as sent to the board, the step did not change;
    /// none at the start.
    pub(super) unmoved: Option<f64>,
    /// The report of the step that led here; none at the start.
    pub(super) report: Option<StepReport>,
}

impl Measured {
    pub(super) fn to_json(&self) -> Value {
        let Measured { kinetic, momentum, penetration, .. } = self;
        json!({
            "collisions": self.collisions,
            "kinetic_energy_j": kinetic.total(),
            "translational_energy_j": kinetic.translational,
            "rotational_energy_j": kinetic.rotational,
            "potential_energy_j": self.potential,
            "linear_momentum_n_s": momentum.linear,
            "angular_momentum_n_m_s": momentum.angular,
            "penetration": {
                "contacts": penetration.contacts,
                "penetrating": penetration.penetrating,
                "mean_m": penetration.mean,
                "largest_m": penetration.largest,
            },
            "unmoved_share": self.unmoved,
            "step": self.report.as_ref().map(pgs_command::output::report_json),
        })
    }
}

/// The failure that ended a board's steps.
pub(super) struct Failed {
    pub(super) step: u32,
    /// The first body that the error names, if it names one.
    pub(super) body: Option<usize>,
    pub(super) failure: Failure,
}

/// One board and its world.
pub(super) struct Side<'a> {
    pub(super) name: &'static str,
    pub(super) spec: SideSpec,
    pub(super) opened: OpenBoard,
    pub(super) run: Run<'a>,
    pub(super) failed: Option<Failed>,
    gravity: [f32; 3],
}

impl<'a> Side<'a> {
    /// Builds the board, and gives it the shapes of the world that `world` makes.
    pub(super) fn open(
        name: &'static str,
        spec: SideSpec,
        common: CommonArgs,
        world: impl FnOnce(&OpenBoard) -> Result<World<'a>>,
        gravity: [f32; 3],
    ) -> Result<Self> {
        let common = CommonArgs { board: BoardName::Emulated, ..common };
        let begin = || {
            let mut opened = board::open(&common, &spec.build)?;
            let world = world(&opened)?;
            if let Err(error) = step_input::set_shapes(&mut opened.accelerator, world.shapes()) {
                return Err(world.failure(&opened, error));
            }
            Ok((opened, world))
        };
        let (opened, world) =
            begin().map_err(|failure: Failure| failure.about(format!("board {name} ({spec})")))?;
        let recorded = match (&world, spec.permutation) {
            (World::Folder { folder, .. }, Some(Permutation::Gpu)) => {
                permutation::recorded(&folder.path, folder.collisions.len())?
            }
            _ => None,
        };
        let run = Run::new(world, spec.permutation, recorded);
        Ok(Self { name, spec, opened, run, failed: None, gravity })
    }

    /// Detects the collisions of the first step and measures the start.
    pub(super) fn start(&mut self) -> Measured {
        let collisions = self.run.world.collisions();
        self.measure(&collisions, None, None)
    }

    /// Takes a step and measures the state after it; none if the board has failed.
    pub(super) fn step(&mut self, number: u32, parameters: &StepParameters) -> Option<Measured> {
        if self.failed.is_some() {
            return None;
        }
        let capabilities = self.opened.accelerator.capabilities();
        let parameters = &self.spec.ordering.apply_to_compare(*parameters, capabilities);
        let before = self.run.world.bodies().to_vec();
        let stepped = self.run.take(&mut self.opened, parameters);
        let report = match stepped {
            Ok(report) => report,
            Err(error) => {
                let body = body_of(&error);
                let failure = self.run.world.failure(&self.opened, error);
                self.failed = Some(Failed { step: number, body, failure });
                return None;
            }
        };
        let collisions = match &mut self.run.world {
            World::Scene(scene) => scene.detect().to_vec(),
            World::Folder { folder, bodies } => carry_along(&folder.collisions, &before, bodies),
        };
        Some(self.measure(&collisions, Some(&before), Some(report)))
    }

    fn measure(
        &self,
        collisions: &[Collision],
        before: Option<&[Body]>,
        report: Option<StepReport>,
    ) -> Measured {
        let (bodies, shapes) = (self.run.world.bodies(), self.run.world.shapes());
        Measured {
            collisions: collisions.len() as u64,
            kinetic: kinetic_energy_parts(bodies, shapes),
            potential: potential_energy(bodies, shapes, self.gravity),
            momentum: momentum(bodies, shapes),
            penetration: penetration(collisions),
            unmoved: before.map(|before| {
                unmoved_share(before, bodies, &moving(bodies, shapes), |value| self.carried(value))
            }),
            report,
        }
    }

    /// Rounds a number as the streams of the bodies do.
    fn carried(&self, value: f32) -> f32 {
        carried(NarrowFormat::of(self.spec.build.config().variant().numbers.poses), value)
    }

    pub(super) fn digest(&self) -> String {
        format!("{:016x}", digest::of_bodies(self.run.world.bodies()))
    }

    /// The board for programs.
    pub(super) fn to_json(&self) -> Value {
        let mut value = self.opened.to_json();
        value["name"] = self.name.into();
        value["build"] = self.spec.to_string().into();
        value["digest"] = json!({ "algorithm": digest::ALGORITHM, "value": self.digest() });
        value["failed"] = self.failed.as_ref().map_or(Value::Null, |failed| {
            json!({
                "step": failed.step,
                "body": failed.body,
                "error": failed.failure.chain(),
            })
        });
        value
    }
}

/// The body that an error names.
fn body_of(error: &Error) -> Option<usize> {
    match error {
        Error::Step { fault, .. } => match **fault {
            Fault::NotFinite { body } => Some(body),
            _ => None,
        },
        Error::Input(
            InputError::BodyNotFinite { body, .. } | InputError::Orientation { body, .. },
        ) => Some(*body),
        _ => None,
    }
}
