//! Measures the host time of making an order.

use std::time::Instant;

use zynq_pgs::order::{OrderError, OrderInput};

/// The median of `runs` runs after one warm-up run, ns a collision.
pub(super) fn per_collision(
    input: &OrderInput<'_>,
    runs: u32,
    mut run: impl FnMut() -> Result<(), OrderError>,
) -> Result<f64, OrderError> {
    run()?;
    let mut times = Vec::new();
    for _ in 0..runs {
        let begin = Instant::now();
        run()?;
        times.push(begin.elapsed());
    }
    times.sort_unstable();
    let median = times.get(times.len() / 2).copied().unwrap_or_default();
    Ok(median.as_secs_f64() * 1e9 / (input.pairs.len() as f64).max(1.0))
}
