//! Measures one step of a run, and shows it in a row or a document.

use std::time::{Duration, Instant};

use scene::{Scene, WarmStart};
use serde_json::Value;
use zynq_pgs::{Accelerator, StepParameters, StepReport};

use crate::a53::Paper;
use pgs_command::board::is_cancelled;
use pgs_command::numbers::grouped;
use pgs_command::output::rows::Fixed;
use pgs_command::output::{milliseconds, report_json};

/// Share of the last step's impulses that a warm step begins with (Bullet's).
const WARM_FACTOR: f32 = 0.85;

/// The measures of one step.
pub(super) struct Row {
    pub(super) step: u32,
    pub(super) ground_pairs: usize,
    /// Deepest penetration in the contacts given to the step, m.
    pub(super) deepest: f64,
    /// Kinetic energy after the step, J.
    pub(super) kinetic_energy: f64,
    /// Kinetic energy without gravity's last addition, J: 0 for a pile at rest.
    pub(super) before_gravity: f64,
    pub(super) detect: Duration,
    pub(super) report: StepReport,
    /// The step on the processor of a ZCU102, if it is counted.
    pub(super) a53: Option<Paper>,
}

/// The default columns. The times of an emulated board are modelled.
pub(super) const fn columns(is_emulated: bool) -> [Fixed; 6] {
    let (board, host) = if is_emulated { ("modelled", "emulated") } else { ("board", "host") };
    [
        Fixed { name: "step", unit: "", width: 6 },
        Fixed { name: "pairs", unit: "", width: 9 },
        Fixed { name: "deepest", unit: "mm", width: 9 },
        Fixed { name: "kinetic", unit: "kJ", width: 11 },
        Fixed { name: board, unit: "ms", width: 10 },
        Fixed { name: host, unit: if is_emulated { "host ms" } else { "ms" }, width: 10 },
    ]
}

impl Row {
    /// Host time of the whole step, with the emulation of the board.
    pub(super) fn host(&self) -> Duration {
        let host = &self.report.host;
        let around = host.validate + host.order + host.pack + host.start;
        self.detect + around + host.wait + host.unpack + host.commit
    }

    pub(super) fn cells(&self) -> [String; 6] {
        [
            self.step.to_string(),
            grouped(self.report.collisions),
            format!("{:.1}", self.deepest * 1e3),
            format!("{:.3}", self.before_gravity / 1e3),
            format!("{:.3}", milliseconds(self.report.modelled_time())),
            format!("{:.1}", milliseconds(self.host())),
        ]
    }

    pub(super) fn to_json(&self) -> Value {
        let mut value = report_json(&self.report);
        value["step"] = self.step.into();
        value["ground_pairs"] = self.ground_pairs.into();
        value["deepest_penetration_m"] = self.deepest.into();
        value["kinetic_energy_j"] = self.kinetic_energy.into();
        value["kinetic_energy_before_gravity_j"] = self.before_gravity.into();
        value["host_on_a53_ms"] = self.a53.map(Paper::to_json).into();
        value["host_ms"]["detect"] = milliseconds(self.detect).into();
        value
    }
}

/// Detects collisions and takes one step; none if Ctrl-C ended it. It begins with the impulses of
/// the last one, if that is given.
pub(super) fn step(
    number: u32,
    parameters: &StepParameters,
    accelerator: &mut Accelerator,
    scene: &mut Scene,
    warm: Option<&mut WarmStart>,
) -> Result<Option<Row>, zynq_pgs::Error> {
    let begin = Instant::now();
    scene.detect();
    let detect = begin.elapsed();
    let ground_pairs = scene.ground_pairs();
    let deepest = scene::penetration(scene.collisions()).largest;
    let (bodies, collisions) = scene.parts_mut();
    let stepped = match warm {
        None => accelerator.step(bodies, collisions, parameters),
        Some(warm) => {
            let placed = warm.placed(collisions, WARM_FACTOR)?;
            accelerator.step(bodies, &placed, parameters).and_then(|report| {
                warm.commit(collisions, accelerator.impulses())?;
                Ok(report)
            })
        }
    };
    let report = match stepped {
        Ok(report) => report,
        Err(error) if is_cancelled(&error) => return Ok(None),
        Err(error) => return Err(error),
    };
    let kinetic_energy = scene::kinetic_energy(scene.bodies(), scene.shapes());
    let before_gravity = scene::kinetic_energy_before_gravity(
        scene.bodies(),
        scene.shapes(),
        parameters.gravity,
        parameters.time_step,
    );
    Ok(Some(Row {
        step: number,
        ground_pairs,
        deepest,
        kinetic_energy,
        before_gravity: before_gravity.total(),
        detect,
        a53: Paper::of(accelerator, &report, [parameters.warm_start, true]),
        report,
    }))
}
