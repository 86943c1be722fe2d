//! The power sensors of a ZCU102: INA226 chips at its rails, which the kernel shows under hwmon.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use thiserror::Error;

/// The kernel's hardware monitors.
pub(crate) const HWMON: &str = "/sys/class/hwmon";
/// Name of a sensor on the ZCU102: this, and the designator of the chip.
const PREFIX: &str = "ina226";
/// Shortest time between two samples, whatever a sensor says.
const INTERVAL_MIN: Duration = Duration::from_millis(10);
/// Longest time between two samples: five samples of the idle board then take ten seconds.
const INTERVAL_MAX: Duration = Duration::from_secs(2);
/// Time between two samples of sensors that do not say it.
const INTERVAL: Duration = Duration::from_millis(35);
/// Largest gain error of the power: 0.1 % of the shunt voltage and 0.1 % of the bus voltage (data
/// sheet SBOS547).
pub(super) const GAIN_ERROR: f64 = 0.002;

/// The part of the chip that a rail supplies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Domain {
    /// Programmable logic: the accelerator.
    Logic,
    /// Processing system: processor, memory controller and DDR interface.
    Processor,
}

impl Domain {
    pub(crate) const ALL: [Self; 2] = [Self::Logic, Self::Processor];

    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Logic => "programmable logic",
            Self::Processor => "processing system",
        }
    }

    pub(crate) const fn key(self) -> &'static str {
        match self {
            Self::Logic => "logic",
            Self::Processor => "processor",
        }
    }
}

/// Rails by the designator of their sensor (UG1182, tables of the power rails and of the I2C
/// multiplexer U60). Rails of transceivers and of the FMC connectors are left out: no step uses
/// them.
const RAILS: [(&str, &str, Domain); 12] = [
    ("u79", "VCCINT", Domain::Logic),
    ("u81", "VCCBRAM", Domain::Logic),
    ("u80", "VCCAUX", Domain::Logic),
    ("u84", "VCC1V2", Domain::Logic),
    ("u76", "VCCPSINTFP", Domain::Processor),
    ("u77", "VCCPSINTLP", Domain::Processor),
    ("u78", "VCCPSAUX", Domain::Processor),
    ("u87", "VCCPSPLL", Domain::Processor),
    ("u93", "VCCO_PSDDR_504", Domain::Processor),
    ("u88", "VCCOPS", Domain::Processor),
    ("u15", "VCCOPS3", Domain::Processor),
    ("u92", "VCCPSDDRPLL", Domain::Processor),
];

/// A sensor that cannot be read.
#[derive(Debug, Error)]
pub(crate) enum SensorError {
    /// The file of its power.
    #[error("the power of the rail {rail} cannot be read from {}", path.display())]
    Read {
        rail: &'static str,
        path: PathBuf,
        #[source]
        source: std::io::Error,
    },
    /// The text in it.
    #[error("expected the power of the rail {rail} in µW in {}, found {found:?}", path.display())]
    Number { rail: &'static str, path: PathBuf, found: String },
}

/// The sensor of a rail.
#[derive(Debug, Clone)]
struct Sensor {
    rail: &'static str,
    domain: Domain,
    /// Its power, µW.
    file: PathBuf,
}

impl Sensor {
    fn watts(&self) -> Result<f64, SensorError> {
        let Self { rail, file: path, .. } = self;
        let text = fs::read_to_string(path).map_err(|source| SensorError::Read {
            rail,
            path: path.clone(),
            source,
        })?;
        let number: i64 = text.trim().parse().map_err(|_| SensorError::Number {
            rail,
            path: path.clone(),
            found: text.trim().to_owned(),
        })?;
        Ok(number as f64 / 1e6)
    }
}

/// The power of each of [`Domain::ALL`] at one time, W.
pub(crate) type Watts = [f64; 2];

/// All sensors of a board.
#[derive(Debug, Clone)]
pub(crate) struct Sensors {
    sensors: Vec<Sensor>,
    /// Time in which every sensor has a new value.
    interval: Duration,
}

impl Sensors {
    /// Finds the sensors under a folder of hardware monitors; `None` without a sensor of the
    /// programmable logic, or with one too slow to sample.
    pub(crate) fn find(hwmon: &Path) -> Option<Self> {
        let mut sensors = Vec::new();
        let mut interval = None;
        for monitor in fs::read_dir(hwmon).ok()?.flatten() {
            let monitor = monitor.path();
            let Some((rail, domain)) = rail(&monitor) else { continue };
            let file = monitor.join("power1_input");
            if file.exists() {
                sensors.push(Sensor { rail, domain, file });
                interval = interval.max(update_interval(&monitor));
            }
        }
        sensors.sort_by_key(|sensor| RAILS.iter().position(|(_, rail, _)| *rail == sensor.rail));
        let logic = sensors.iter().any(|sensor| sensor.domain == Domain::Logic);
        let interval = interval.unwrap_or(INTERVAL).max(INTERVAL_MIN);
        if logic && interval > INTERVAL_MAX {
            log::warn!(
                "the power is not measured: expected sensors with a new value every \
                 {INTERVAL_MAX:?} or \
                 less, found {interval:?}; write a smaller update_interval under {}",
                hwmon.display()
            );
            return None;
        }
        logic.then_some(Self { sensors, interval })
    }

    /// Time in which every sensor has a new value.
    pub(crate) fn interval(&self) -> Duration {
        self.interval
    }

    /// The rails of a domain.
    pub(crate) fn rails(&self, domain: Domain) -> Vec<&'static str> {
        self.sensors.iter().filter(|sensor| sensor.domain == domain).map(|s| s.rail).collect()
    }

    /// Reads all sensors.
    pub(crate) fn read(&self) -> Result<Watts, SensorError> {
        let mut sum = Watts::default();
        for sensor in &self.sensors {
            sum[sensor.domain as usize] += sensor.watts()?;
        }
        Ok(sum)
    }
}

/// The rail of a hardware monitor, by the label of its device tree node or by its name.
fn rail(monitor: &Path) -> Option<(&'static str, Domain)> {
    let text = |file: &str| fs::read_to_string(monitor.join(file)).ok();
    ["label", "name"].into_iter().filter_map(text).find_map(|name| {
        let designator = name.trim().to_lowercase();
        let designator = designator.strip_prefix(PREFIX)?.trim_start_matches(['_', '-']);
        let found = RAILS.iter().find(|(known, ..)| *known == designator)?;
        Some((found.1, found.2))
    })
}

/// The time in which a sensor has a new value, if it says so.
fn update_interval(monitor: &Path) -> Option<Duration> {
    let text = fs::read_to_string(monitor.join("update_interval")).ok()?;
    text.trim().parse().ok().map(Duration::from_millis)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A folder of hardware monitors: (file of the name, name, µW).
    pub(in super::super) fn monitors(all: &[(&str, &str, &str)]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().expect("a folder");
        for (place, (file, name, power)) in all.iter().enumerate() {
            let monitor = folder.path().join(format!("hwmon{place}"));
            fs::create_dir(&monitor).expect("a folder");
            fs::write(monitor.join(file), format!("{name}\n")).expect("written");
            fs::write(monitor.join("power1_input"), format!("{power}\n")).expect("written");
        }
        folder
    }

    #[test]
    fn rails_are_found_by_label_or_name_and_summed_by_domain() {
        let folder = monitors(&[
            ("name", "ina226_u79", "2500000"),
            ("label", "ina226-u81", "500000"),
            ("name", "ina226_u76", "1250000"),
            ("name", "ina226_u74", "9000000"),
            ("name", "cpu_thermal", "7000000"),
        ]);
        fs::write(folder.path().join("hwmon0/update_interval"), "40\n").expect("written");
        let sensors = Sensors::find(folder.path()).expect("sensors");
        assert_eq!(sensors.rails(Domain::Logic), ["VCCINT", "VCCBRAM"]);
        assert_eq!(sensors.rails(Domain::Processor), ["VCCPSINTFP"]);
        assert_eq!(sensors.interval(), Duration::from_millis(40));
        let watts = sensors.read().expect("power");
        assert!((watts[0] - 3.0).abs() < 1e-12 && (watts[1] - 1.25).abs() < 1e-12);
    }

    #[test]
    fn slow_sensors_keep_their_interval_and_very_slow_ones_are_not_used() {
        let folder = monitors(&[("name", "ina226_u79", "1"), ("name", "ina226_u76", "1")]);
        let file = folder.path().join("hwmon1/update_interval");
        fs::write(&file, "750\n").expect("written");
        let sensors = Sensors::find(folder.path()).expect("sensors");
        assert_eq!(sensors.interval(), Duration::from_millis(750));
        fs::write(&file, "16900\n").expect("written");
        assert!(Sensors::find(folder.path()).is_none());
    }

    #[test]
    fn a_board_without_sensors_of_the_logic_has_none() {
        assert!(Sensors::find(Path::new("/no/such/folder")).is_none());
        assert!(Sensors::find(monitors(&[("name", "ina226_u76", "1")]).path()).is_none());
    }

    #[test]
    fn a_sensor_that_says_nonsense_is_named() {
        let folder = monitors(&[("name", "ina226_u79", "much")]);
        let error = Sensors::find(folder.path()).expect("a sensor").read().expect_err("no number");
        let text = error.to_string();
        assert!(text.contains("VCCINT") && text.contains("\"much\""), "{text}");
    }
}
