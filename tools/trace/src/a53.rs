//! Time of the CPU's part of a step on a Cortex-A53, on paper: `docs/a53-cost.md`.

/// Bandwidth in bytes per second of a memcpy of 8 MB on A53 cores of another chip, by the number of
/// cores (TI SPRADG0A, AM62P, `bw_mem 8M bcopy`).
pub const A53_COPIES: [(u32, f64); 3] = [(1, 1956.71e6), (2, 3122.66e6), (4, 3605.80e6)];

/// Seconds in which one A53 core writes or reads bytes at the speed of memcpy.
#[must_use]
pub fn a53_copy_seconds(bytes: u64) -> f64 {
    let [(_, one_core), ..] = A53_COPIES;
    bytes as f64 / one_core
}
