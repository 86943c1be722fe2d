//! Figures of the thesis, for comparison with the figures that follow from the profiles.
//!
//! [`data`] counts words as the thesis' Tables 4.1 to 4.6 do, for any scene. [`recorded`] holds the
//! figures that the thesis measured or cites; this project has measured none. [`euler`] recomputes
//! its Figure 2.6.

pub mod data;
pub mod euler;
pub mod recorded;

use super::step::StepShape;

/// Bodies of the thesis' step: the moving ones.
pub const BODIES: u64 = 38_880;
/// Collisions of the thesis' step.
pub const COLLISIONS: u64 = 127_000;

/// The thesis' step: bodies and collisions as printed, passes as [`StepShape::new`] infers them.
#[must_use]
pub const fn step() -> StepShape {
    StepShape::new(BODIES, COLLISIONS)
}

/// Speed-up of a whole whose share `p` becomes `s` times as fast (equation 6.5).
#[must_use]
pub fn amdahl(p: f64, s: f64) -> f64 {
    1.0 / ((1.0 - p) + p / s)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_whole_step_gains_1_37_and_1_48() {
        for (latency, expected) in [(7.49, 1.37), (6.23, 1.48)] {
            let whole = amdahl(0.6, 13.64 / latency);
            assert!((whole - expected).abs() < 0.005, "{whole}, not {expected}");
        }
    }
}
