//! A world of one scene, with Rapier's own solver or with the board.

use rapier3d::prelude::*;
use zynq_pgs::OpenOptions;

use crate::board::Board;
use crate::sets::{GRAVITY, Sets, TIME_STEP};

/// The solver of a world.
enum Solver {
    Rapier(Box<Rapier>),
    /// Opened in the first step, when all bodies are there.
    Closed(Box<OpenOptions>, u32),
    Board(Box<Board>),
}

/// A world of one scene.
pub(crate) struct World {
    pub(crate) sets: Sets,
    solver: Solver,
}

impl World {
    /// A world with Rapier's own solver.
    pub(crate) fn of_rapier(passes: u32) -> Self {
        Self { sets: Sets::new(), solver: Solver::Rapier(Box::new(Rapier::new(passes))) }
    }

    /// A world with a board.
    pub(crate) fn of_board(options: OpenOptions, passes: u32) -> Self {
        Self { sets: Sets::new(), solver: Solver::Closed(Box::new(options), passes) }
    }

    /// Takes some steps.
    pub(crate) fn step(&mut self, count: u32) -> Result<(), zynq_pgs::Error> {
        for _ in 0..count {
            if let Solver::Closed(options, passes) = &self.solver {
                let board = Board::open((**options).clone(), *passes, &self.sets)?;
                self.solver = Solver::Board(Box::new(board));
            }
            match &mut self.solver {
                Solver::Rapier(rapier) => rapier.step(&mut self.sets),
                Solver::Board(board) => board.step(&mut self.sets)?,
                Solver::Closed(..) => {}
            }
        }
        Ok(())
    }

    /// The kinetic energy of all bodies, J.
    pub(crate) fn kinetic_energy(&self) -> f64 {
        let ahead = match self.solver {
            // The board's integration ends with gravity.
            Solver::Board(_) => GRAVITY * TIME_STEP,
            Solver::Rapier(_) | Solver::Closed(..) => Vector::ZERO,
        };
        self.sets.kinetic_energy(ahead)
    }

    /// Collisions and the board's time of its last step, ms; not a number with Rapier's own solver.
    pub(crate) fn work(&self) -> [f64; 2] {
        match &self.solver {
            Solver::Board(board) => board.report().map_or([f64::NAN; 2], |report| {
                [report.collisions as f64, 1e3 * report.modelled_time().as_secs_f64()]
            }),
            Solver::Rapier(_) | Solver::Closed(..) => [f64::NAN; 2],
        }
    }
}

/// Rapier's own pipeline.
struct Rapier {
    pipeline: PhysicsPipeline,
    parameters: IntegrationParameters,
    impulse_joints: ImpulseJointSet,
    multibody_joints: MultibodyJointSet,
    soft_bodies: SoftBodySet,
    continuous: CCDSolver,
}

impl Rapier {
    fn new(passes: u32) -> Self {
        let parameters = IntegrationParameters {
            dt: TIME_STEP,
            num_solver_iterations: passes as usize,
            ..IntegrationParameters::default()
        };
        Self {
            pipeline: PhysicsPipeline::new(),
            parameters,
            impulse_joints: ImpulseJointSet::new(),
            multibody_joints: MultibodyJointSet::new(),
            soft_bodies: SoftBodySet::new(),
            continuous: CCDSolver::new(),
        }
    }

    fn step(&mut self, sets: &mut Sets) {
        self.pipeline.step(
            GRAVITY,
            &self.parameters,
            &mut sets.islands,
            &mut sets.broad_phase,
            &mut sets.narrow_phase,
            &mut sets.bodies,
            &mut sets.colliders,
            &mut self.impulse_joints,
            &mut self.multibody_joints,
            &mut self.soft_bodies,
            &mut self.continuous,
            &(),
            &(),
        );
    }
}
