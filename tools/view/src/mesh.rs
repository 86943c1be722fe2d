//! Triangles of a geometry's surface.

use scene::{Geometry, hull_faces};

/// Sides of a round outline, and rings of a half sphere.
const SIDES: u16 = 16;
const RINGS: u16 = 5;

/// A surface of convex faces.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Mesh {
    pub(crate) positions: Vec<[f32; 3]>,
    /// The unit normal at each position.
    pub(crate) normals: Vec<[f32; 3]>,
    /// The corners of each face, counter-clockwise from outside.
    pub(crate) faces: Vec<Vec<u16>>,
}

/// A ring about the y axis: its radius and height, and the normal's share outwards and up.
#[derive(Debug, Clone, Copy)]
struct Ring {
    radius: f32,
    y: f32,
    normal: [f32; 2],
}

impl Mesh {
    /// The surface of a geometry; none for a hull of too few points.
    pub(crate) fn of(geometry: &Geometry) -> Option<Self> {
        let mesh = match *geometry {
            Geometry::Box { half_extents } => Self::of_faces(&box_faces(half_extents)),
            Geometry::Hull { points } => Self::of_faces(&hull_faces(points)?),
            Geometry::Sphere { radius } => Self::of_rings(&capsule(0.0, radius)),
            Geometry::Capsule { half_height, radius } => {
                Self::of_rings(&capsule(half_height, radius))
            }
            Geometry::Cylinder { half_height, radius } => {
                let ring = |y| Ring { radius, y, normal: [1.0, 0.0] };
                let mut mesh = Self::of_rings(&[ring(-half_height), ring(half_height)]);
                for (y, up) in [(-half_height, -1.0), (half_height, 1.0)] {
                    let mut cap: Vec<u16> = around(radius)
                        .map(|[x, z]| mesh.corner([x, y, z], [0.0, up, 0.0]))
                        .collect();
                    if up > 0.0 {
                        cap.reverse();
                    }
                    mesh.faces.push(cap);
                }
                mesh
            }
        };
        (!mesh.faces.is_empty()).then_some(mesh)
    }

    /// Adds a corner; returns its index. The largest mesh has a few hundred corners, which 16 bits
    /// count.
    fn corner(&mut self, position: [f32; 3], normal: [f32; 3]) -> u16 {
        self.positions.push(position);
        self.normals.push(normal);
        u16::try_from(self.positions.len() - 1).unwrap_or(u16::MAX)
    }

    /// Flat faces, each as its corners.
    fn of_faces(faces: &[Vec<[f32; 3]>]) -> Self {
        let mut mesh = Self::default();
        for face in faces {
            let [a, b, c, ..] = face[..] else { continue };
            let normal = unit(cross(minus(b, a), minus(c, a)));
            let corners: Vec<u16> =
                face.iter().map(|corner| mesh.corner(*corner, normal)).collect();
            mesh.faces.push(corners);
        }
        mesh
    }

    /// The surface between each ring and the next one above.
    fn of_rings(rings: &[Ring]) -> Self {
        let mut mesh = Self::default();
        let mut below: Option<(Ring, Vec<u16>)> = None;
        for ring in rings {
            let [outwards, up] = ring.normal;
            let directions = around(outwards).map(|[x, z]| [x, up, z]);
            let places = around(ring.radius).map(|[x, z]| [x, ring.y, z]);
            let corners: Vec<u16> =
                places.zip(directions).map(|(place, normal)| mesh.corner(place, normal)).collect();
            if let Some((lower, low)) = &below {
                for side in 0..corners.len() {
                    let next = (side + 1) % corners.len();
                    // A ring at a pole is one corner.
                    match (lower.radius > 0.0, ring.radius > 0.0) {
                        (true, true) => mesh.faces.push(vec![
                            low[side],
                            corners[side],
                            corners[next],
                            low[next],
                        ]),
                        (true, false) => {
                            mesh.faces.push(vec![low[side], corners[side], low[next]]);
                        }
                        (false, _) => {
                            mesh.faces.push(vec![low[side], corners[side], corners[next]]);
                        }
                    }
                }
            }
            below = Some((*ring, corners));
        }
        mesh
    }

    /// The faces as triangles.
    pub(crate) fn triangles(&self) -> impl Iterator<Item = [u16; 3]> + Clone {
        self.faces.iter().flat_map(|face| {
            let last = face.get(1..).unwrap_or_default();
            last.windows(2).map(|pair| [face[0], pair[0], pair[1]])
        })
    }
}

/// Points x, z of a circle about the y axis, from x to z.
fn around(radius: f32) -> impl Iterator<Item = [f32; 2]> {
    (0..SIDES).map(move |side| {
        let turn = f32::from(side) / f32::from(SIDES) * std::f32::consts::TAU;
        [radius * libm::cosf(turn), radius * libm::sinf(turn)]
    })
}

/// The six faces of a box.
fn box_faces([x, y, z]: [f32; 3]) -> Vec<Vec<[f32; 3]>> {
    let around = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    let mut faces = Vec::new();
    for axis in 0..3 {
        for sign in [1.0, -1.0] {
            let corner = |[a, b]: [f32; 2]| {
                let mut corner = [0.0; 3];
                corner[axis] = sign;
                corner[(axis + 1) % 3] = sign * a;
                corner[(axis + 2) % 3] = b;
                [corner[0] * x, corner[1] * y, corner[2] * z]
            };
            faces.push(around.map(corner).to_vec());
        }
    }
    faces
}

/// The rings of a capsule from below; of a sphere without a height.
fn capsule(half_height: f32, radius: f32) -> Vec<Ring> {
    let ring = |k: u16, height: f32| {
        let turn = f32::from(k) / f32::from(2 * RINGS) * std::f32::consts::PI;
        let (sine, cosine) = (libm::sinf(turn), libm::cosf(turn));
        // At the poles exactly 0: no side, and no area.
        let outwards = if k == 0 || k == 2 * RINGS { 0.0 } else { sine };
        Ring { radius: radius * outwards, y: height - radius * cosine, normal: [outwards, -cosine] }
    };
    let lower = (0..=RINGS).map(|k| ring(k, -half_height));
    let upper = (RINGS..=2 * RINGS).map(|k| ring(k, half_height));
    let skipped = usize::from(half_height <= 0.0);
    lower.chain(upper.skip(skipped)).collect()
}

pub(crate) fn minus(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(crate) fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(crate) fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2]
}

/// The vector's direction; a zero stays one.
pub(crate) fn unit(a: [f32; 3]) -> [f32; 3] {
    let length = dot(a, a).sqrt();
    if length > 0.0 { a.map(|value| value / length) } else { a }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::fixture;

    /// Volume by tetrahedra from the origin; positive if the triangles show their outside.
    fn volume(mesh: &Mesh) -> f32 {
        let corner = |index: u16| mesh.positions[usize::from(index)];
        let part = |[a, b, c]: [u16; 3]| dot(corner(a), cross(corner(b), corner(c))) / 6.0;
        mesh.triangles().map(part).fold(0.0, |sum, part| sum + part)
    }

    #[test]
    fn surfaces_are_closed_and_face_outwards() {
        let pi = std::f32::consts::PI;
        let (radius, half_height) = (0.5, 0.75);
        let solids = [
            (Geometry::Box { half_extents: [1.0, 2.0, 3.0] }, 48.0, 1e-5),
            (Geometry::Sphere { radius }, pi / 6.0, 0.06),
            (Geometry::Capsule { half_height, radius }, pi / 6.0 + pi * 0.375, 0.05),
            (Geometry::Cylinder { half_height, radius }, pi * 0.375, 0.03),
        ];
        for (geometry, expected, tolerance) in solids {
            let found = volume(&Mesh::of(&geometry).expect("a surface"));
            assert!((found / expected - 1.0).abs() < tolerance, "{geometry:?}: {found}");
        }
        let hull = fixture(1).geometries().iter().copied().find(|g| g.name() == "hull");
        let mesh = Mesh::of(&hull.expect("a hull")).expect("a surface");
        // A cuboctahedron has 5/6 of the box around it.
        assert!((volume(&mesh) / (8.0 * 0.9 * 0.5 * 0.6) - 5.0 / 6.0).abs() < 1e-5);
        assert_eq!((mesh.faces.len(), mesh.triangles().count()), (8 + 6, 8 + 2 * 6));
    }

    #[test]
    fn normals_are_unit_and_point_outwards() {
        for geometry in fixture(1).geometries() {
            let mesh = Mesh::of(geometry).expect("a surface");
            assert_eq!(mesh.positions.len(), mesh.normals.len());
            for (position, normal) in mesh.positions.iter().zip(&mesh.normals) {
                assert!((dot(*normal, *normal) - 1.0).abs() < 1e-5, "{geometry:?}: {normal:?}");
                assert!(dot(*position, *normal) > 0.0, "{geometry:?}: {position:?}");
            }
        }
    }
}
