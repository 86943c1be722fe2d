//! Steps the same scene beside a run, cold and with one friction: what a board without a warm start makes of
//! it.

use scene::Scene;
use serde_json::{Value, json};
use zynq_pgs::{Accelerator, StepParameters};

use super::row::{Row, step};
use super::summary::FinalState;
use crate::output::table::Column;
use crate::permutation::Arranger;

/// The columns that the scene adds to the table of the run.
pub(super) const COLUMNS: [Column; 2] = [
    Column { name: "deepest", unit: "cold mm", width: 9 },
    Column { name: "kinetic", unit: "cold kJ", width: 9 },
];

/// The scene, and its last step.
pub(super) struct Cold {
    scene: Scene,
    parameters: StepParameters,
    /// The order of the run.
    arranger: Option<Arranger>,
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

impl Cold {
    /// A scene that is stepped with the parameters of the run, but for a warm start and frictions.
    pub(super) fn new(
        scene: Scene,
        parameters: &StepParameters,
        arranger: Option<Arranger>,
    ) -> Self {
        let parameters = parameters
            .with_warm_start(false)
            .with_impulses_out(false)
            .with_pair_friction(false)
            .with_shape_friction(false);
        Self { scene, parameters, arranger, last: None }
    }

    /// Takes a step; none if Ctrl-C ended it.
    pub(super) fn step(
        &mut self,
        number: u32,
        accelerator: &mut Accelerator,
    ) -> Result<Option<Beside>, zynq_pgs::Error> {
        let Self { scene, parameters, arranger, last } = self;
        let row = step(number, parameters, accelerator, scene, None, arranger.as_mut())?;
        let of = |row: &Row| Beside { deepest: row.deepest, kinetic_energy: row.before_gravity };
        let beside = row.as_ref().map(of);
        if row.is_some() {
            *last = row;
        }
        Ok(beside)
    }

    fn end(&mut self) -> Option<FinalState> {
        let Self { scene, last, .. } = self;
        last.as_ref().map(|last| FinalState::of(scene, last))
    }

    /// The pile at the end, for people.
    pub(super) fn end_text(&mut self) -> Option<String> {
        let text =
            |end: FinalState| format!("the same without warm start, one friction, {}", end.text());
        self.end().map(text)
    }

    /// The pile at the end, for programs.
    pub(super) fn end_json(&mut self) -> Option<Value> {
        self.end().map(FinalState::to_json)
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
