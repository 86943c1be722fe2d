//! The processor's part of a step on a ZCU102, on paper: four Cortex-A53 cores, by the model of
//! `docs/worth.md`.

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

/// The item that a part handles.
enum Of {
    Collision,
    Body,
}

/// The time of each part on four cores, ms; a sum over steps.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct HostTimes([f64; PARTS.len()]);

impl HostTimes {
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
        let StepReport { bodies, collisions, .. } = *report;
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
        counted.then_some(Self(parts))
    }

    /// Adds the times of another step.
    pub(crate) fn and(self, other: Self) -> Self {
        Self(std::array::from_fn(|part| self.0[part] + other.0[part]))
    }

    /// The mean of a step, for people, and whether it or the board's `board` ms limit.
    pub(crate) fn text(self, steps: u32, board: f64) -> String {
        let [detection, driver @ ..] = self.0.map(|ms| ms / f64::from(steps.max(1)));
        let driver: f64 = driver.iter().sum();
        let limit = |host: f64| if host > board { "host" } else { "board" };
        let mut text = format!(
            "A53, on paper: {driver:.3} ms a step on four cores, {:.3} ms with the board: the {} \
             limits",
            driver + board,
            limit(driver),
        );
        if detection > 0.0 {
            let with = limit(driver + detection);
            text += &format!("; with the search, {detection:.3} ms more, the {with} limits");
        }
        text
    }

    /// For programs: the parts, and all of them but the detection.
    pub(crate) fn to_json(self) -> Value {
        let parts =
            PARTS.iter().zip(self.0).map(|((name, ..), ms)| ((*name).to_owned(), ms.into()));
        let mut parts: Map<String, Value> = parts.collect();
        parts.insert("step".to_owned(), self.0[1..].iter().sum::<f64>().into());
        parts.into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longer_of_host_and_board_limits() {
        let mut times = [1.0; PARTS.len()];
        times[DETECTION] = 6.0;
        let told = HostTimes(times).and(HostTimes(times)).text(2, 9.0);
        let expected = "A53, on paper: 7.000 ms a step on four cores, 16.000 ms with the board: the \
                        board limits; with the search, 6.000 ms more, the host limits";
        assert_eq!(told, expected);
        times[DETECTION] = 0.0;
        assert!(HostTimes(times).text(1, 6.9).ends_with("with the board: the host limits"));
    }
}
