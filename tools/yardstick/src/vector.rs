//! Vector arithmetic of the formulae, with every sum in their order.

/// Three components.
pub(super) type Vec3 = [f32; 3];

#[inline]
pub(super) fn add(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[inline]
pub(super) fn subtract(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline]
pub(super) fn negate(a: Vec3) -> Vec3 {
    [-a[0], -a[1], -a[2]]
}

#[inline]
pub(super) fn scale(a: Vec3, factor: f32) -> Vec3 {
    [a[0] * factor, a[1] * factor, a[2] * factor]
}

/// Component by component.
#[inline]
pub(super) fn times(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] * b[0], a[1] * b[1], a[2] * b[2]]
}

#[inline]
pub(super) fn dot(a: Vec3, b: Vec3) -> f32 {
    (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2]
}

#[inline]
pub(super) fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The vector scaled to length one.
#[inline]
pub(super) fn unit(a: Vec3) -> Vec3 {
    scale(a, 1.0 / dot(a, a).sqrt())
}

/// Two unit vectors, orthogonal to the unit vector `n` and to each other.
#[inline]
pub(super) fn tangents(n: Vec3) -> [Vec3; 2] {
    // cos 45 degrees
    const STEEP: f32 = std::f32::consts::FRAC_1_SQRT_2;
    if n[2].abs() > STEEP {
        let s = n[1] * n[1] + n[2] * n[2];
        let k = 1.0 / s.sqrt();
        let t = [0.0, -n[2] * k, n[1] * k];
        [t, [s * k, -n[0] * t[2], n[0] * t[1]]]
    } else {
        let s = n[0] * n[0] + n[1] * n[1];
        let k = 1.0 / s.sqrt();
        let t = [-n[1] * k, n[0] * k, 0.0];
        [t, [-n[2] * t[1], n[2] * t[0], s * k]]
    }
}
