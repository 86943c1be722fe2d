//! Steps the same scene beside a run, cold and with one friction: what a board without a warm start
//! makes of it.

use scene::Scene;
use serde_json::{Value, json};
use zynq_pgs::{Accelerator, StepParameters};

use super::row::{Row, step};
use super::summary::FinalState;
use pgs_command::output::rows::Fixed;

/// The columns that the scene adds to the table of the run.
pub(super) const COLUMNS: [Fixed; 2] = [
    Fixed { name: "deepest", unit: "cold mm", width: 9 },
    Fixed { name: "kinetic", unit: "cold kJ", width: 9 },
];

/// The scene, and its last step.
pub(super) struct Cold {
    scene: Scene,
    parameters: StepParameters,
    last: Option<Row>,
}

/// The measures of one of its steps.
#[derive(Debug, Clone, Copy)]
pub(super) struct Beside {
    /// Deepest penetration, m.
    deepest: f64,
    /// Kinetic energy without gravity's last addition, J.
    kinetic_energy: f64,
}

/// Whether the scene is stepped: as the user chooses, or by default unless the energy of a step is
/// to be measured, to which the steps of two scenes would add up.
pub(super) fn is_stepped(choice: Option<bool>, by_default: bool, has_sensors: bool) -> bool {
    choice.unwrap_or(by_default && !has_sensors)
}

impl Cold {
    /// A scene that is stepped with the parameters of the run, but for a warm start and frictions.
    pub(super) fn new(scene: Scene, parameters: &StepParameters) -> Self {
        let parameters =
            parameters.with_warm_start(false).with_impulses_out(false).with_pair_friction(false);
        Self { scene, parameters, last: None }
    }

    /// Takes a step; none if Ctrl-C ended it.
    pub(super) fn step(
        &mut self,
        number: u32,
        accelerator: &mut Accelerator,
    ) -> Result<Option<Beside>, zynq_pgs::Error> {
        let Self { scene, parameters, last } = self;
        let row = step(number, parameters, accelerator, scene, None)?;
        let of = |row: &Row| Beside { deepest: row.deepest, kinetic_energy: row.before_gravity };
        let beside = row.as_ref().map(of);
        if row.is_some() {
            *last = row;
        }
        Ok(beside)
    }

    /// Whether its last step is that one.
    pub(super) fn has_taken(&self, step: u32) -> bool {
        self.last.as_ref().is_some_and(|last| last.step == step)
    }

    /// The pile after `done` steps; none if it has taken fewer.
    fn end(&mut self, done: u32) -> Option<FinalState> {
        let Self { scene, last, .. } = self;
        let last = last.as_ref().filter(|last| last.step == done)?;
        Some(FinalState::of(scene, last))
    }

    /// The pile at the end of `done` steps, for programs.
    pub(super) fn end_json(&mut self, done: u32) -> Option<Value> {
        self.end(done).map(FinalState::to_json)
    }
}

impl Beside {
    pub(super) fn cells(self) -> [String; COLUMNS.len()] {
        [format!("{:.1}", self.deepest * 1e3), format!("{:.3}", self.kinetic_energy / 1e3)]
    }

    pub(super) fn to_json(self) -> Value {
        json!({
            "deepest_penetration_m": self.deepest,
            "kinetic_energy_before_gravity_j": self.kinetic_energy,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use scene::SceneOptions;
    use zynq_pgs::OpenOptions;

    #[test]
    fn a_board_with_sensors_steps_one_scene_unless_asked() {
        assert!(is_stepped(None, true, false));
        assert!(!is_stepped(None, true, true));
        assert!(is_stepped(Some(true), false, true));
        assert!(!is_stepped(Some(false), true, false));
    }

    #[test]
    fn a_scene_that_has_taken_fewer_steps_has_no_end() {
        let grid = "1x1x1".parse().expect("a grid");
        let scene = Scene::new(&SceneOptions { grid, ..SceneOptions::default() }).expect("a scene");
        let mut accelerator = Accelerator::open(OpenOptions::default()).expect("an emulated board");
        accelerator.set_shapes(scene.shapes()).expect("two shapes");
        let mut cold = Cold::new(scene, &StepParameters::thesis());
        assert!(!cold.has_taken(1) && cold.end_json(1).is_none());
        cold.step(1, &mut accelerator).expect("no fault").expect("no Ctrl-C");
        assert!(cold.has_taken(1) && cold.end_json(1).is_some());
        assert!(!cold.has_taken(2) && cold.end_json(2).is_none());
    }
}
