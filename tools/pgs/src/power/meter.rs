//! Samples the sensors in a thread of its own.

use std::num::NonZeroU32;
use std::ops::RangeInclusive;
use std::panic::resume_unwind;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::energy::{Energy, Mean};
use super::sensors::{SensorError, Sensors, Watts};

/// Time for the samples of the idle board before the first step; their number has limits.
const IDLE_TIME: Duration = Duration::from_secs(3);
const IDLE_SAMPLES: RangeInclusive<u128> = 5..=30;

/// Samples of an idle board whose sensors have a new value once an interval.
fn idle_samples(interval: Duration) -> u32 {
    let samples = IDLE_TIME.as_millis() / interval.as_millis().max(1);
    let samples = samples.clamp(*IDLE_SAMPLES.start(), *IDLE_SAMPLES.end());
    u32::try_from(samples).unwrap_or(u32::MAX)
}

/// Samples the sensors until [`stop`](Self::stop).
#[derive(Debug)]
pub(crate) struct PowerMeter {
    sensors: Sensors,
    idle: Vec<Watts>,
    started: Instant,
    /// Dropping it ends the thread.
    stop: Sender<()>,
    thread: JoinHandle<Result<Vec<Watts>, SensorError>>,
    /// The samples that the thread has taken.
    taken: Arc<AtomicUsize>,
}

impl PowerMeter {
    /// Samples the idle board, then begins to sample the steps.
    ///
    /// # Errors
    /// [`SensorError`] if a sensor cannot be read.
    pub(crate) fn start(sensors: Sensors) -> Result<Self, SensorError> {
        let (_running, idle) = channel();
        let taken = Arc::new(AtomicUsize::new(0));
        let idle = sample(&sensors, &idle, idle_samples(sensors.interval()), &AtomicUsize::new(0))?;
        let (stop, stopped) = channel();
        let (own, count) = (sensors.clone(), Arc::clone(&taken));
        let thread = std::thread::spawn(move || sample(&own, &stopped, u32::MAX, &count));
        Ok(Self { sensors, idle, started: Instant::now(), stop, thread, taken })
    }

    /// Ends the sampling; the energy of each of `steps` steps. `None` if the steps took less time
    /// than a sensor needs for a value.
    ///
    /// # Errors
    /// [`SensorError`] if a sensor could not be read during the steps.
    pub(crate) fn stop(self, steps: NonZeroU32) -> Result<Option<Energy>, SensorError> {
        let Self { sensors, idle, started, stop, thread, taken } = self;
        log::debug!("{} samples of the power", taken.load(Ordering::Relaxed));
        let elapsed = started.elapsed();
        drop(stop);
        let samples = thread.join().unwrap_or_else(|panic| resume_unwind(panic))?;
        // The first value may be of the time before the steps.
        let Some((_, samples)) = samples.split_first() else { return Ok(None) };
        let means = (Mean::of(&idle), Mean::of(samples));
        let (Some(idle), Some(busy)) = means else { return Ok(None) };
        Ok(Some(Energy::new(&sensors, idle, busy, elapsed, steps)))
    }
}

/// Reads the sensors once an interval, at most `count` times, until the sender of `stopped` is
/// gone. Counts the samples in `taken`.
fn sample(
    sensors: &Sensors,
    stopped: &Receiver<()>,
    count: u32,
    taken: &AtomicUsize,
) -> Result<Vec<Watts>, SensorError> {
    let mut samples = Vec::new();
    let mut due = Instant::now();
    for _ in 0..count {
        samples.push(sensors.read()?);
        taken.store(samples.len(), Ordering::Relaxed);
        due += sensors.interval();
        let left = due.saturating_duration_since(Instant::now()).max(Duration::from_millis(1));
        if stopped.recv_timeout(left) != Err(RecvTimeoutError::Timeout) {
            break;
        }
    }
    Ok(samples)
}

#[cfg(test)]
mod tests {
    use super::super::sensors::tests::monitors;
    use super::*;
    use std::fs;

    fn steps(number: u32) -> NonZeroU32 {
        NonZeroU32::new(number).expect("a step")
    }

    #[test]
    fn slow_sensors_have_fewer_samples_of_the_idle_board() {
        for (milliseconds, samples) in [(10, 30), (100, 30), (300, 10), (2000, 5)] {
            assert_eq!(idle_samples(Duration::from_millis(milliseconds)), samples);
        }
    }

    #[test]
    fn the_idle_boards_power_is_subtracted() {
        let folder = monitors(&[("name", "ina226_u79", "2000000")]);
        let file = folder.path().join("hwmon0/power1_input");
        fs::write(folder.path().join("hwmon0/update_interval"), "10\n").expect("written");
        let sensors = Sensors::find(folder.path()).expect("a sensor");
        let meter = PowerMeter::start(sensors.clone()).expect("idle power");
        // Replaced as a whole: the meter never reads half a number.
        let next = folder.path().join("next");
        fs::write(&next, "5000000\n").expect("written");
        fs::rename(&next, &file).expect("replaced");
        while meter.taken.load(Ordering::Relaxed) < 4 {
            std::thread::yield_now();
        }
        let energy = meter.stop(steps(10)).expect("power").expect("samples");
        let text = energy.text();
        // 3 W above idle, three intervals of 10 ms or more, 10 steps.
        assert!(energy.joules(super::super::sensors::Domain::Logic).value >= 0.009, "{text}");
        assert!(text.contains("VCCINT") && text.contains("idle 2.000 W"), "{text}");
    }

    #[test]
    fn a_sensor_that_fails_during_the_steps_is_told() {
        let folder = monitors(&[("name", "ina226_u79", "2000000")]);
        fs::write(folder.path().join("hwmon0/update_interval"), "10\n").expect("written");
        let sensors = Sensors::find(folder.path()).expect("a sensor");
        let meter = PowerMeter::start(sensors).expect("idle power");
        fs::remove_file(folder.path().join("hwmon0/power1_input")).expect("there");
        // The thread ends by itself at the first sample that fails.
        while !meter.thread.is_finished() {
            std::thread::yield_now();
        }
        assert!(meter.stop(steps(1)).is_err());
    }
}
