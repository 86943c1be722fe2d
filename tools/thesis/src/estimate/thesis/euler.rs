//! Recomputes Figure 2.6: a fall from rest, integrated explicitly.

/// Acceleration of the example, m/s²: 500 m after 10 s.
pub const ACCELERATION: f64 = 10.0;
/// Its duration, s.
pub const SECONDS: u32 = 10;

/// Position after [`SECONDS`] by explicit Euler with `steps_per_second`, m: each step moves by the
/// speed at its start.
#[must_use]
pub fn explicit(steps_per_second: u32) -> f64 {
    let dt = 1.0 / f64::from(steps_per_second.max(1));
    let (mut position, mut speed) = (0.0, 0.0);
    for _ in 0..u64::from(SECONDS) * u64::from(steps_per_second.max(1)) {
        position += speed * dt;
        speed += ACCELERATION * dt;
    }
    position
}

/// The position of [`explicit`] in single precision, m.
#[must_use]
pub fn explicit_single(steps_per_second: u16) -> f32 {
    let dt = 1.0 / f32::from(steps_per_second.max(1));
    let (mut position, mut speed) = (0.0_f32, 0.0_f32);
    for _ in 0..SECONDS * u32::from(steps_per_second.max(1)) {
        position += speed * dt;
        speed += 10.0 * dt;
    }
    position
}

/// The exact position, m (equation 2.7).
#[must_use]
pub fn exact() -> f64 {
    0.5 * ACCELERATION * f64::from(SECONDS).powi(2)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: a dt² n (n - 1) / 2. The thesis prints 499.49 instead of 499.5: the position in
    /// single precision is 499.497, cut off after two digits.
    #[test]
    fn the_fall_is_450_m_and_499_5_m_of_500() {
        assert!((explicit(1) - 450.0).abs() < 1e-9);
        assert!((explicit(100) - 499.5).abs() < 1e-9);
        assert!((exact() - 500.0).abs() < 1e-9);
        assert!((explicit_single(100) - 499.497).abs() < 5e-4, "{}", explicit_single(100));
    }
}
