//! Convex hulls: their polyhedra, and the inertia of the solids.

use parry3d::math::Vector;
use parry3d::shape::ConvexPolyhedron;

/// Distance of the centre of mass from the origin, and product of inertia per kg, that count as
/// none, in m and m².
const NONE: f64 = 1e-5;

/// The corners of a cuboctahedron, stretched along the axes: its faces are eight triangles and six
/// parallelograms.
pub(crate) const fn cuboctahedron([x, y, z]: [f32; 3]) -> [[f32; 3]; 12] {
    [
        [x, y, 0.0],
        [x, -y, 0.0],
        [-x, y, 0.0],
        [-x, -y, 0.0],
        [x, 0.0, z],
        [x, 0.0, -z],
        [-x, 0.0, z],
        [-x, 0.0, -z],
        [0.0, y, z],
        [0.0, y, -z],
        [0.0, -y, z],
        [0.0, -y, -z],
    ]
}

/// The hull of points; none if they have no volume.
pub(crate) fn polyhedron(points: &[[f32; 3]]) -> Option<ConvexPolyhedron> {
    if points.len() < 4 {
        return None;
    }
    let points: Vec<Vector> = points.iter().map(|point| Vector::from_array(*point)).collect();
    ConvexPolyhedron::from_convex_hull(&points)
}

/// The faces of the convex hull of points, each as its corners in the order that is
/// counter-clockwise from outside. None if the hull has no volume.
#[must_use]
pub fn faces(points: &[[f32; 3]]) -> Option<Vec<Vec<[f32; 3]>>> {
    let hull = polyhedron(points)?;
    let corners = hull.vertices_adj_to_face();
    let faces = hull.faces().iter().map(|face| {
        let begin = face.first_vertex_or_edge as usize;
        let corners = &corners[begin..][..face.num_vertices_or_edges as usize];
        corners.iter().map(|corner| hull.points()[*corner as usize].to_array()).collect()
    });
    Some(faces.collect())
}

/// The moments of inertia about x, y and z of the solid hull of points, m² (per kg). None without a
/// volume, if the centre of mass is not the origin, or if the axes are not the principal ones.
pub(crate) fn inertia_per_mass(points: &[[f32; 3]]) -> Option<[f64; 3]> {
    let faces = faces(points)?;
    let mut volume = 0.0;
    let mut first = [0.0; 3];
    let mut second = [[0.0; 3]; 3];
    for corners in faces {
        let corner = |index: usize| corners[index].map(f64::from);
        // Tetrahedra from the origin to the triangles of the face.
        for k in 2..corners.len() {
            let [a, b, c] = [corner(0), corner(k - 1), corner(k)];
            let part = determinant(a, b, c) / 6.0;
            let sum = [0, 1, 2].map(|i| a[i] + b[i] + c[i]);
            volume += part;
            for i in 0..3 {
                first[i] += part * sum[i] / 4.0;
                for j in 0..3 {
                    let squares = a[i] * a[j] + b[i] * b[j] + c[i] * c[j];
                    second[i][j] += part * (squares + sum[i] * sum[j]) / 20.0;
                }
            }
        }
    }
    let is_centred = first.iter().all(|moment| (moment / volume).abs() <= NONE);
    let products = [second[0][1], second[1][2], second[2][0]];
    let is_principal = products.iter().all(|product| (product / volume).abs() <= NONE);
    let about = |i: usize, j: usize| (second[i][i] + second[j][j]) / volume;
    (is_centred && is_principal).then(|| [about(1, 2), about(2, 0), about(0, 1)])
}

fn determinant(a: [f64; 3], b: [f64; 3], c: [f64; 3]) -> f64 {
    a[0] * (b[1] * c[2] - b[2] * c[1])
        + a[1] * (b[2] * c[0] - b[0] * c[2])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cuboctahedron_has_fourteen_faces_of_at_most_four_corners() {
        let hull = polyhedron(&cuboctahedron([0.9, 0.5, 0.6])).expect("a hull");
        let mut corners: Vec<u32> =
            hull.faces().iter().map(|face| face.num_vertices_or_edges).collect();
        corners.sort_unstable();
        assert_eq!(corners, [3, 3, 3, 3, 3, 3, 3, 3, 4, 4, 4, 4, 4, 4]);
    }

    #[test]
    fn the_inertia_of_a_cube_as_a_hull_is_that_of_a_cube() {
        let signs = [-1.0_f32, 1.0];
        let corner = |k: usize| [signs[k & 1], 2.0 * signs[k >> 1 & 1], 3.0 * signs[k >> 2 & 1]];
        let corners: Vec<[f32; 3]> = (0..8).map(corner).collect();
        let found = inertia_per_mass(&corners).expect("a solid");
        // (4 + 9) / 3, (1 + 9) / 3, (1 + 4) / 3.
        for (found, wanted) in found.into_iter().zip([13.0 / 3.0, 10.0 / 3.0, 5.0 / 3.0]) {
            assert!((found - wanted).abs() < 1e-9, "{found}");
        }
    }

    #[test]
    fn what_is_flat_or_aside_has_no_inertia() {
        let flat = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]];
        assert_eq!(inertia_per_mass(&flat), None);
        let aside = cuboctahedron([1.0; 3]).map(|[x, y, z]| [x + 0.5, y, z]);
        assert_eq!(inertia_per_mass(&aside), None);
        // Turned by 45 degrees about z.
        let turned = cuboctahedron([2.0, 1.0, 1.0]).map(|[x, y, z]| [x - y, x + y, z]);
        assert_eq!(inertia_per_mass(&turned), None);
    }
}
