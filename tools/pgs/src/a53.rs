//! A step on the processor of a ZCU102, on paper: the driver's part, and the whole step in software,
//! on four Cortex-A53 cores, by the model of `docs/worth.md`.

use serde_json::{Map, Value};
use zynq_pgs::board::BoardKind;
use zynq_pgs::interface::number::StreamFormat;
use zynq_pgs::order::Order;
use zynq_pgs::{Accelerator, StepReport};

/// Bytes of the second-level cache.
const CACHE: u64 = 1 << 20;
/// Bytes that the driver reads and writes of a collision, and of a body.
const BYTES: [u64; 2] = [224, 128];

/// The cores, which share a step evenly.
const CORES: f64 = 4.0;

/// The parts of a step, and the time of each on one core, ns a collision or a body: in a scene that
/// the second-level cache holds and in a larger one, each cold and warm.
///
/// `tools/scripts/a53-step.sh` counts the times, prints them in its last table, and fails if a time
/// is off by more than a tenth and by more than a hundredth of the step.
const PARTS: [(&str, Of, [[f64; 2]; 2]); 8] = [
    ("detection", Of::Collision, [[936.0, 873.0], [870.0, 870.0]]),
    ("points", Of::Collision, [[0.0, 129.0], [0.0, 141.0]]),
    ("order", Of::Collision, [[1.4, 1.4], [1.3, 1.3]]),
    ("pack", Of::Collision, [[242.0, 484.0], [337.0, 560.0]]),
    ("bodies", Of::Body, [[119.0, 119.0], [130.0, 130.0]]),
    ("results", Of::Body, [[75.0, 75.0], [74.0, 74.0]]),
    ("commit", Of::Collision, [[0.0, 194.0], [0.0, 205.0]]),
    ("driver", Of::Collision, [[16.4, 21.7], [9.5, 9.9]]),
];

/// The place of the detection, which is no part of the driver.
const DETECTION: usize = 0;

/// The time of a step that is solved in software, by the emulated board's own solver in lanes, on
/// one core: ns a collision, and ns a collision and pass; by scene and start as the parts.
///
/// The script holds these, too.
const SOFTWARE: [[[f64; 2]; 2]; 2] =
    [[[1126.0, 165.0], [1315.0, 168.0]], [[1086.0, 271.0], [1343.0, 274.0]]];

/// The item that a part handles.
enum Of {
    Collision,
    Body,
}

/// Times on four cores, ms; a sum over steps.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Paper {
    /// The time of each part.
    parts: [f64; PARTS.len()],
    /// The time of the step in software.
    software: f64,
}

impl Paper {
    /// The times of one step, with the detection if it `detects`. `None` for a board that is not
    /// emulated, for streams in sixteen bits, and for an order that the host computes: the script
    /// does not count them.
    pub(crate) fn of(
        accelerator: &Accelerator,
        report: &StepReport,
        [warm, detects]: [bool; 2],
    ) -> Option<Self> {
        let kind = accelerator.board().kind;
        let format = accelerator.capabilities().variant.numbers.collisions;
        let counted = matches!(kind, BoardKind::Emulated | BoardKind::Served)
            && format == StreamFormat::F32
            && report.order != Order::HazardFree;
        let StepReport { bodies, collisions, passes, .. } = *report;
        let is_large = BYTES[0] * collisions + BYTES[1] * bodies > CACHE;
        let part = |(_, of, ns): &(_, Of, [[f64; 2]; 2])| {
            let count = match of {
                Of::Collision => collisions,
                Of::Body => bodies,
            };
            ns[usize::from(is_large)][usize::from(warm)] * count as f64 / CORES / 1e6
        };
        let mut parts = PARTS.each_ref().map(part);
        parts[DETECTION] *= f64::from(u8::from(detects));
        let [once, a_pass] = SOFTWARE[usize::from(is_large)][usize::from(warm)];
        let ns = once + a_pass * f64::from(passes);
        counted.then_some(Self { parts, software: ns * collisions as f64 / CORES / 1e6 })
    }

    /// Adds the times of another step.
    pub(crate) fn and(self, other: Self) -> Self {
        let parts = std::array::from_fn(|part| self.parts[part] + other.parts[part]);
        Self { parts, software: self.software + other.software }
    }

    /// The driver's part, without the detection, ms.
    fn driver(&self) -> f64 {
        self.parts[DETECTION + 1..].iter().sum()
    }

    /// How many times as long as board and driver the software takes for these steps, with `board`
    /// ms on the board for each.
    pub(crate) fn ratio(&self, steps: u32, board: f64) -> f64 {
        self.software / (self.driver() + board * f64::from(steps.max(1)))
    }

    /// For programs: the parts, all of them but the detection, and the step in software.
    pub(crate) fn to_json(self) -> Value {
        let parts =
            PARTS.iter().zip(self.parts).map(|((name, ..), ms)| ((*name).to_owned(), ms.into()));
        let mut parts: Map<String, Value> = parts.collect();
        parts.insert("step".to_owned(), self.driver().into());
        parts.insert("software".to_owned(), self.software.into());
        parts.into()
    }
}

/// The ratio of steps for people, with its two sides.
pub(crate) fn ratio_text(paper: Option<Paper>, steps: u32, board: f64) -> String {
    let Some(paper) = paper else {
        return "not counted for sixteen bits, hazard-free, and real boards".into();
    };
    let each = |ms: f64| ms / f64::from(steps.max(1));
    format!(
        "{:.1} (on paper): {:.1} ms with driver, {:.1} ms on four A53 alone",
        paper.ratio(steps, board),
        each(paper.driver()) + board,
        each(paper.software),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ratio_is_that_of_software_to_board_and_driver() {
        let mut parts = [1.0; PARTS.len()];
        parts[DETECTION] = 6.0;
        let step = Paper { parts, software: 64.0 };
        let (two, told) =
            (step.and(step), "4.0 (on paper): 16.0 ms with driver, 64.0 ms on four A53");
        assert!((two.ratio(2, 9.0) - 4.0).abs() < 1e-12);
        assert!(ratio_text(Some(two), 2, 9.0).starts_with(told));
        assert!(ratio_text(None, 2, 9.0).starts_with("not counted"));
    }
}
