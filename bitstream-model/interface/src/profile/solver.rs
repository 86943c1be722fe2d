//! Constants of the solver that are wired into the pipeline, as f32.

/// A normal with a larger |z| takes its first tangent in the yz plane (Bullet).
pub const TANGENT_Z: f32 = std::f32::consts::FRAC_1_SQRT_2;
/// Cosine between B - A and contact centre - A above which the spin is damped (Bullet).
pub const SPIN_COSINE: f32 = 0.95;
/// Share of the spin about the normal that one friction pass takes away, where the bitstream has no
/// argument for it or nothing is written to it (Bullet).
pub const SPIN_DAMPING: f32 = 0.1;
/// Largest rotation in one step, rad: a quarter of f32 pi (Bullet).
pub const ROTATION_LIMIT: f32 = 0.25 * 3.141_592_5;
/// Angular speed below which the sine is replaced by its series, rad/s (Bullet).
pub const SERIES_BELOW: f32 = 0.001;
/// Coefficient of the series' second term (Bullet).
pub const SERIES_TERM: f32 = 0.020_833_334;
