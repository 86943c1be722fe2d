//! Converts a unit quaternion to a rotation matrix.

/// Rows of the rotation matrix of the unit quaternion x, y, z, w: world = matrix * body.
///
/// Source: the usual formula, each entry evaluated as written.
pub(crate) fn matrix([x, y, z, w]: [f32; 4]) -> [[f32; 3]; 3] {
    [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]
}

/// A point of a body in the world. `rows` is the [`matrix`] of the body.
pub(crate) fn placed(centre: [f32; 3], rows: &[[f32; 3]; 3], [px, py, pz]: [f32; 3]) -> [f32; 3] {
    [0, 1, 2].map(|row| {
        let [x, y, z] = rows[row];
        centre[row] + ((x * px + y * py) + z * pz)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quarter_turn_about_y_carries_z_to_x() {
        let half = 0.5_f32.sqrt();
        let rows = matrix([0.0, half, 0.0, half]);
        let expected = [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]];
        for (row, wanted) in rows.iter().flatten().zip(expected.iter().flatten()) {
            assert!((row - wanted).abs() < 1e-6, "{rows:?}");
        }
    }
}
