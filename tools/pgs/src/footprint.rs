//! Holds the peak memory of a run against the least that it must store: the beats of one step, and
//! the bodies and collisions of the scene.

use bitstream_model::interface::profile::Variant;
use serde_json::{Value, json};
use zynq_pgs::{Body, Collision, StepReport};

/// The least memory that the largest step of a run needs.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Footprint {
    /// Bytes of the beats: each record once, however often it is streamed.
    beats: u64,
    /// Bytes of the bodies and collisions in the scene.
    scene: u64,
}

impl Footprint {
    /// Includes a step.
    pub(crate) fn include(&mut self, variant: &Variant, report: &StepReport) {
        let StepReport { bodies, collisions, empty, .. } = *report;
        let words = variant.words();
        let of_body = words.velocity + words.pose + words.result;
        let of_step =
            bodies * u64::from(of_body) + (collisions + empty) * u64::from(words.collision);
        let scene = bodies * size_of::<Body>() as u64 + collisions * size_of::<Collision>() as u64;
        self.beats = self.beats.max(of_step * size_of::<u32>() as u64);
        self.scene = self.scene.max(scene);
    }

    /// For people; none if the system does not report the peak.
    pub(crate) fn text(&self) -> Option<String> {
        let mb = |bytes: u64| bytes as f64 / 1e6;
        let (peak, times) = (peak()?, self.times()?);
        Some(format!(
            "{:.1} MB at most, {times:.1} times the beats of a step ({:.1} MB) and the scene \
             ({:.1} MB)",
            mb(peak),
            mb(self.beats),
            mb(self.scene),
        ))
    }

    /// For programs.
    pub(crate) fn to_json(self) -> Value {
        json!({
            "peak_bytes": peak(),
            "beats_bytes": self.beats,
            "scene_bytes": self.scene,
            "times": self.times(),
        })
    }

    /// The peak as a multiple of the needed memory.
    fn times(&self) -> Option<f64> {
        let held = self.beats + self.scene;
        if held == 0 { None } else { Some(peak()? as f64 / held as f64) }
    }
}

/// Peak memory of this process so far, bytes.
fn peak() -> Option<u64> {
    peak_of(&std::fs::read_to_string("/proc/self/status").ok()?)
}

/// Parses the line `VmHWM` (proc(5)) into bytes.
fn peak_of(status: &str) -> Option<u64> {
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kibibytes.checked_mul(1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_peak_is_read_in_kibibytes() {
        assert_eq!(peak_of("Name:\tpgs\nVmPeak:\t  9 kB\nVmHWM:\t   12 kB\n"), Some(12 * 1024));
        assert_eq!(peak_of("Name:\tpgs\n"), None);
        assert_eq!(peak_of("VmHWM:\t12 MB\n"), None);
    }

    #[test]
    fn this_process_has_some_memory() {
        let held = vec![1_u8; 1 << 24];
        assert!(peak().expect("Linux says it") > held.len() as u64);
    }
}
