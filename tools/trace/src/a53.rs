//! Time of the CPU's part of a step on a Cortex-A53, on paper: `docs/worth.md`.

/// Bandwidth in bytes per second of a memcpy of 8 MB on one A53 core of another chip (TI SPRADG0A,
/// AM62P, `bw_mem 8M bcopy`).
const COPY: f64 = 1956.71e6;

/// Seconds in which one A53 core writes or reads bytes at the speed of memcpy.
#[must_use]
pub(crate) fn a53_copy_seconds(bytes: u64) -> f64 {
    bytes as f64 / COPY
}
