//! The tangents along which friction acts.

/// The two tangents of a collision with this unit normal, as the accelerator makes them: the
/// directions of [`Impulses::friction`](crate::Impulses::friction).
///
/// Source: interface specification, §7, `tangents(q)` with q = -n.
#[must_use]
pub(crate) fn tangents(normal: [f32; 3]) -> [[f32; 3]; 2] {
    let [x, y, z] = normal.map(|component| -component);
    if z.abs() > std::f32::consts::FRAC_1_SQRT_2 {
        let s = y * y + z * z;
        let k = 1.0 / s.sqrt();
        let first = [0.0, -z * k, y * k];
        [first, [s * k, -x * first[2], x * first[1]]]
    } else {
        let s = x * x + y * y;
        let k = 1.0 / s.sqrt();
        let first = [-y * k, x * k, 0.0];
        [first, [-z * first[1], z * first[0], s * k]]
    }
}
