//! Turns a shape's inverse inertia into that of a body, about world axes.

use crate::scene::Shape;

/// An inverse inertia about world axes, 1/(kg m²).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Inverse {
    /// xx, yy, zz.
    pub(crate) diagonal: [f32; 3],
    /// xy, xz, yz.
    pub(crate) off_diagonal: [f32; 3],
}

/// The inverse inertia of a body of that shape and orientation: M diag(k) M^T, M the rotation.
///
/// If the shape's three components are equal, the inverse inertia is the same about any axes. It
/// stays as it is, without the rounding of M: the results match a bitstream that supports equal
/// components only. A static shape has zeros.
///
/// The orientation x, y, z, w need not have unit length.
///
/// Source: Bullet 2.87, `b3Matrix3x3::setRotation` and `b3UpdateInvInertiaTensor`, in this order of
/// operations; interface specification, world inertia.
#[inline(always)]
pub(crate) fn about_world_axes(shape: &Shape, orientation: [f32; 4]) -> Inverse {
    let k = shape.inverse_inertia;
    if shape.is_isotropic() {
        return Inverse { diagonal: k, off_diagonal: [0.0; 3] };
    }
    let m = rotation(orientation);
    let element = |row: usize, column: usize| {
        let (a, b) = (m[row], m[column]);
        ((a[0] * k[0]) * b[0] + (a[1] * k[1]) * b[1]) + (a[2] * k[2]) * b[2]
    };
    Inverse {
        diagonal: [element(0, 0), element(1, 1), element(2, 2)],
        off_diagonal: [element(0, 1), element(0, 2), element(1, 2)],
    }
}

/// The rotation matrix of a quaternion, by rows.
#[inline(always)]
fn rotation([x, y, z, w]: [f32; 4]) -> [[f32; 3]; 3] {
    let d = ((x * x + y * y) + z * z) + w * w;
    let s = 2.0 / d;
    let (xs, ys, zs) = (x * s, y * s, z * s);
    let (wx, wy, wz) = (w * xs, w * ys, w * zs);
    let (xx, xy, xz) = (x * xs, x * ys, x * zs);
    let (yy, yz, zz) = (y * ys, y * zs, z * zs);
    [
        [1.0 - (yy + zz), xy - wz, xz + wy],
        [xy + wz, 1.0 - (xx + zz), yz - wx],
        [xz - wy, yz + wx, 1.0 - (xx + yy)],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const BOX: Shape = Shape { inverse_inertia: [1.0, 2.0, 4.0], ..Shape::isotropic(1.0, 0.0) };

    #[test]
    fn an_unturned_body_has_its_own_axes() {
        let found = about_world_axes(&BOX, [0.0, 0.0, 0.0, 1.0]);
        assert_eq!(found, Inverse { diagonal: [1.0, 2.0, 4.0], off_diagonal: [0.0; 3] });
    }

    #[test]
    fn a_quarter_turn_about_z_exchanges_x_and_y() {
        // (0, 0, 1, 1) is not of unit length, and exact: s = 1.
        let found = about_world_axes(&BOX, [0.0, 0.0, 1.0, 1.0]);
        assert_eq!(found, Inverse { diagonal: [2.0, 1.0, 4.0], off_diagonal: [0.0; 3] });
    }

    #[test]
    fn an_eighth_of_a_turn_about_z_mixes_x_and_y() {
        let (sine, cosine) = std::f32::consts::FRAC_PI_8.sin_cos();
        let Inverse { diagonal, off_diagonal } = about_world_axes(&BOX, [0.0, 0.0, sine, cosine]);
        // xx and yy are c²k0 + s²k1 = 1.5, xy is cs(k0 - k1) = -0.5.
        for (found, expected) in
            diagonal.into_iter().chain(off_diagonal).zip([1.5, 1.5, 4.0, -0.5, 0.0, 0.0])
        {
            assert!((found - expected).abs() < 1e-6, "{diagonal:?} {off_diagonal:?}");
        }
    }

    #[test]
    fn static_shapes_have_zeros() {
        assert_eq!(about_world_axes(&Shape::STATIC, [0.1, 0.2, 0.3, 0.4]), Inverse::default());
    }

    proptest! {
        #[test]
        fn equal_components_stay_as_they_are(
            k in 1e-3_f32..1e3,
            orientation in prop::array::uniform4(-1.0_f32..1.0),
        ) {
            let found = about_world_axes(&Shape::isotropic(1.0, k), orientation);
            prop_assert_eq!(found.diagonal.map(f32::to_bits), [k.to_bits(); 3]);
            prop_assert_eq!(found.off_diagonal.map(f32::to_bits), [0; 3]);
        }

        /// A rotation keeps the trace and the determinant of a tensor.
        #[test]
        fn rotation_keeps_the_invariants(orientation in prop::array::uniform4(-1.0_f32..1.0)) {
            let length: f32 = orientation.iter().fold(0.0, |sum, q| sum + q * q);
            prop_assume!(length > 0.01);
            let Inverse { diagonal, off_diagonal } = about_world_axes(&BOX, orientation);
            let [xx, yy, zz] = diagonal.map(f64::from);
            let [xy, xz, yz] = off_diagonal.map(f64::from);
            let determinant = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz)
                + xz * (xy * yz - yy * xz);
            prop_assert!((xx + yy + zz - 7.0).abs() < 1e-4);
            prop_assert!((determinant - 8.0).abs() < 1e-3, "{}", determinant);
        }
    }
}
