//! The energy of a step from the samples of the idle and the busy board.

use std::num::NonZeroU32;
use std::time::Duration;

use serde_json::{Value, json};

use super::sensors::{Domain, GAIN_ERROR, Sensors, Watts};

/// The mean of samples, and the standard error of the mean, W.
#[derive(Debug, Clone, Copy)]
pub(super) struct Mean {
    watts: Watts,
    error: Watts,
    samples: usize,
}

impl Mean {
    /// `None` for less than two samples.
    pub(super) fn of(samples: &[Watts]) -> Option<Self> {
        if samples.len() < 2 {
            return None;
        }
        let count = samples.len() as f64;
        let of = |domain: usize| {
            let sum = |of: &dyn Fn(f64) -> f64| {
                samples.iter().fold(0.0, |sum, watts| sum + of(watts[domain]))
            };
            let mean = sum(&|watts| watts) / count;
            let squares = sum(&|watts| (watts - mean) * (watts - mean));
            (mean, (squares / (count - 1.0) / count).sqrt())
        };
        let [(logic, logic_error), (processor, processor_error)] = [of(0), of(1)];
        Some(Self {
            watts: [logic, processor],
            error: [logic_error, processor_error],
            samples: samples.len(),
        })
    }
}

/// A number with its uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Uncertain {
    pub(crate) value: f64,
    /// Two standard errors of the samples, and the gain error of the sensors.
    pub(crate) within: f64,
}

/// The measured energy of a step.
#[derive(Debug, Clone)]
pub(crate) struct Energy {
    rails: [Vec<&'static str>; 2],
    idle: Mean,
    busy: Mean,
    /// Time of a step, with the work of the processor between two steps, s.
    seconds: f64,
}

impl Energy {
    pub(super) fn new(
        sensors: &Sensors,
        idle: Mean,
        busy: Mean,
        elapsed: Duration,
        steps: NonZeroU32,
    ) -> Self {
        let rails = Domain::ALL.map(|domain| sensors.rails(domain));
        Self { rails, idle, busy, seconds: elapsed.as_secs_f64() / f64::from(steps.get()) }
    }

    /// The domains that have a sensor, with their rails.
    fn domains(&self) -> impl Iterator<Item = (Domain, &[&'static str])> {
        let all = Domain::ALL.into_iter().zip(&self.rails);
        all.filter(|(_, rails)| !rails.is_empty()).map(|(domain, rails)| (domain, &rails[..]))
    }

    /// Energy of a step above idle, J.
    pub(crate) fn joules(&self, domain: Domain) -> Uncertain {
        let (idle, busy) = (self.idle.watts[domain as usize], self.busy.watts[domain as usize]);
        let random = self.idle.error[domain as usize].hypot(self.busy.error[domain as usize]);
        let above = busy - idle;
        let within = (2.0 * random).hypot(GAIN_ERROR * above);
        Uncertain { value: above * self.seconds, within: within * self.seconds }
    }

    /// For people.
    pub(crate) fn text(&self) -> String {
        let parts: Vec<String> = self
            .domains()
            .map(|(domain, rails)| {
                let joules = self.joules(domain);
                format!(
                    "{:.4} ± {:.4} J a step above idle in the {} ({}; idle {:.3} W, busy {:.3} W)",
                    joules.value,
                    joules.within,
                    domain.name(),
                    rails.join(", "),
                    self.idle.watts[domain as usize],
                    self.busy.watts[domain as usize],
                )
            })
            .collect();
        format!(
            "measured: {}; {} samples idle and {} busy; ± two standard errors and the sensors' \
             gain, without the tolerance of the shunts",
            parts.join("; "),
            self.idle.samples,
            self.busy.samples
        )
    }

    /// For programs.
    pub(crate) fn to_json(&self) -> Value {
        let mut document = json!({
            "origin": "measured",
            "seconds_a_step": self.seconds,
            "samples_idle": self.idle.samples,
            "samples_busy": self.busy.samples,
        });
        for (domain, rails) in self.domains() {
            let joules = self.joules(domain);
            document[domain.key()] = json!({
                "rails": rails,
                "idle_w": self.idle.watts[domain as usize],
                "busy_w": self.busy.watts[domain as usize],
                "joules_a_step": joules.value,
                "joules_within": joules.within,
            });
        }
        document
    }
}

#[cfg(test)]
mod tests {
    use super::super::sensors::tests::monitors;
    use super::*;

    #[test]
    fn a_step_has_its_share_of_the_power_above_idle() {
        let folder = monitors(&[("name", "ina226_u79", "1"), ("name", "ina226_u76", "1")]);
        let sensors = Sensors::find(folder.path()).expect("sensors");
        let samples = |logic: [f64; 2]| logic.map(|logic| [logic, 1.0]);
        let idle = Mean::of(&samples([1.9, 2.1])).expect("samples");
        let busy = Mean::of(&samples([5.0, 5.0])).expect("samples");
        let steps = NonZeroU32::new(100).expect("steps");
        let energy = Energy::new(&sensors, idle, busy, Duration::from_secs(2), steps);
        let joules = energy.joules(Domain::Logic);
        assert!((joules.value - 3.0 * 0.02).abs() < 1e-12);
        // The standard error of 1.9 and 2.1 is 0.1 W; the gain error is 0.006 W.
        assert!((joules.within - 0.2_f64.hypot(0.006) * 0.02).abs() < 1e-12);
        assert!(energy.joules(Domain::Processor).value.abs() < 1e-12);
        assert!(Mean::of(&samples([1.0, 1.0])[..1]).is_none());
    }

    #[test]
    fn a_domain_without_sensors_has_no_power() {
        let folder = monitors(&[("name", "ina226_u79", "1")]);
        let sensors = Sensors::find(folder.path()).expect("sensors");
        let mean = Mean::of(&[[1.0, 0.0]; 3]).expect("samples");
        let steps = NonZeroU32::new(1).expect("a step");
        let energy = Energy::new(&sensors, mean, mean, Duration::from_secs(1), steps);
        let document = energy.to_json();
        assert_eq!(document["logic"]["rails"], json!(["VCCINT"]));
        assert_eq!(document.get("processor"), None);
        assert!(!energy.text().contains("processing system"));
    }
}
