//! The faces of all bodies that show their outside to the eye, with their colours.

use scene::Geometry;
use zynq_pgs::{Body, Pose};

use super::camera::View;
use crate::error::ViewError;
use crate::kinds::{COLOURS, Kinds, surfaces};
use crate::mesh::{Mesh, cross, dot, minus};

/// Colours of low and high bodies, where all are of one kind.
const LOW: [f32; 3] = [52.0, 92.0, 148.0];
const HIGH: [f32; 3] = [238.0, 196.0, 96.0];
/// Where the light comes from, of length 1.
const LIGHT: [f32; 3] = [0.48, 0.8, 0.36];

/// A face on the picture.
#[derive(Debug, Clone)]
pub(super) struct Face {
    /// The body.
    pub(super) body: u32,
    /// Each corner: its pixel from the left and from above, and the inverse of its distance.
    pub(super) corners: Vec<[f32; 3]>,
    /// The colour at each corner, red, green, blue up to 255.
    pub(super) colours: Vec<[f32; 3]>,
}

/// Bodies with their surfaces.
#[derive(Debug)]
pub(super) struct Surfaces<'a> {
    bodies: &'a [Body],
    /// The kind of each body.
    kinds: Vec<Option<usize>>,
    /// The surface of each kind.
    meshes: Vec<Mesh>,
}

impl<'a> Surfaces<'a> {
    /// The surfaces of bodies; `geometries` has one for each shape.
    pub(super) fn of(
        bodies: &'a [Body],
        geometries: &[Option<Geometry>],
    ) -> Result<Self, ViewError> {
        let kinds = Kinds::of(bodies, geometries);
        Ok(Self { bodies, kinds: kinds.of_body, meshes: surfaces(&kinds.geometries)? })
    }

    /// The bodies that are drawn, with their index and kind.
    fn drawn(&self) -> impl Iterator<Item = (u32, &'a Body, usize)> + '_ {
        let bodies = (0..).zip(self.bodies).zip(&self.kinds);
        bodies.filter_map(|((index, body), kind)| Some((index, body, (*kind)?)))
    }

    /// Calls `draw` with each face.
    pub(super) fn for_each(&self, view: &View, mut draw: impl FnMut(Face)) {
        let heights = self.drawn().map(|(_, body, _)| body.pose.position[1]);
        let highest = heights.fold(1.0, |most, height| if height > most { height } else { most });
        for (index, body, kind) in self.drawn() {
            let colour = if self.meshes.len() > 1 {
                COLOURS[kind % COLOURS.len()]
            } else {
                let share = (body.pose.position[1] / highest).clamp(0.0, 1.0);
                [0, 1, 2].map(|k: usize| (1.0 - share) * LOW[k] + share * HIGH[k])
            };
            for_each_of(index, body.pose, &self.meshes[kind], colour, view, &mut draw);
        }
    }
}

fn for_each_of(
    body: u32,
    pose: Pose,
    mesh: &Mesh,
    colour: [f32; 3],
    view: &View,
    draw: &mut impl FnMut(Face),
) {
    let world = |point: [f32; 3]| {
        let turned = turned(pose.orientation, point);
        [0, 1, 2].map(|axis: usize| pose.position[axis] + turned[axis])
    };
    for corners in &mesh.faces {
        let points: Vec<[f32; 3]> =
            corners.iter().map(|corner| world(mesh.positions[usize::from(*corner)])).collect();
        let normal = cross(minus(points[1], points[0]), minus(points[2], points[0]));
        // False for a body without a finite pose.
        let shows_outside = dot(normal, minus(view.eye(), points[0])) > 0.0;
        let projected: Option<Vec<_>> = points.iter().map(|point| view.project(*point)).collect();
        let Some(projected) = projected.filter(|_| shows_outside) else { continue };
        let lit = |corner: &u16| {
            let normal = turned(pose.orientation, mesh.normals[usize::from(*corner)]);
            let facing = dot(normal, LIGHT);
            let shade = 0.62 + 0.38 * facing;
            colour.map(|value| shade * value)
        };
        let colours = corners.iter().map(lit).collect();
        draw(Face { body, corners: projected, colours });
    }
}

/// A vector turned by the unit quaternion x, y, z, w.
fn turned(q: [f32; 4], v: [f32; 3]) -> [f32; 3] {
    let axis = [q[0], q[1], q[2]];
    let first = cross(axis, v);
    let inner = [0, 1, 2].map(|k: usize| first[k] + q[3] * v[k]);
    let twice = cross(axis, inner);
    [0, 1, 2].map(|k: usize| v[k] + 2.0 * twice[k])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::Camera;
    use zynq_pgs::Velocity;

    #[test]
    fn a_cube_shows_three_faces_the_upper_one_lightest() {
        let camera = Camera { target: [0.0; 3], eye: [6.0, 8.0, 7.0] };
        let pose = Pose { position: [0.0, 0.5, 0.0], orientation: [0.0, 0.0, 0.0, 1.0] };
        let body = Body { pose, velocity: Velocity::default(), shape: 1 };
        let mut faces = Vec::new();
        let view = View::new(camera, 100, 100);
        let bodies = [body];
        let surfaces = Surfaces::of(&bodies, &[None, Some(Geometry::CUBE)]).expect("a cube");
        surfaces.for_each(&view, |face| faces.push(face));
        assert_eq!(faces.len(), 3);
        let light = |face: &Face| face.colours[0][1];
        let highest = |face: &Face| face.corners.iter().map(|c| c[1]).fold(f32::INFINITY, f32::min);
        let lightest = faces.iter().max_by(|a, b| light(a).total_cmp(&light(b))).expect("faces");
        let top = faces.iter().min_by(|a, b| highest(a).total_cmp(&highest(b))).expect("faces");
        assert!((highest(lightest) - highest(top)).abs() < 1e-3);
    }

    #[test]
    fn a_quarter_turn_about_y_carries_z_to_x() {
        let half = 0.5_f32.sqrt();
        let [x, y, z] = turned([0.0, half, 0.0, half], [0.0, 0.0, 1.0]);
        assert!((x - 1.0).abs() + y.abs() + z.abs() < 1e-6);
    }
}
