//! The faces of all bodies that show their outside to the eye, with their colours.

use scene::Geometry;
use zynq_pgs::{Body, Pose};

use super::camera::View;
use crate::mesh::{Mesh, cross, dot, minus};

/// Colours of low and high bodies, where all are of one kind.
const LOW: [f32; 3] = [52.0, 92.0, 148.0];
const HIGH: [f32; 3] = [238.0, 196.0, 96.0];
/// Colours of the kinds in turn, where they differ.
const KINDS: [[f32; 3]; 6] = [
    [86.0, 140.0, 200.0],
    [226.0, 140.0, 80.0],
    [110.0, 176.0, 128.0],
    [222.0, 190.0, 90.0],
    [160.0, 126.0, 190.0],
    [196.0, 100.0, 104.0],
];
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

/// Calls `draw` with each face; `geometries` has one for each shape.
pub(super) fn for_each(
    bodies: &[Body],
    geometries: &[Option<Geometry>],
    view: &View,
    mut draw: impl FnMut(Face),
) {
    let meshes: Vec<Option<Mesh>> =
        geometries.iter().map(|geometry| geometry.as_ref().map(Mesh::of)).collect();
    let mut kinds: Vec<&Geometry> = Vec::new();
    for geometry in geometries.iter().flatten() {
        if !kinds.contains(&geometry) {
            kinds.push(geometry);
        }
    }
    let heights = bodies.iter().filter(|body| mesh_of(body, &meshes).is_some());
    let highest = heights.map(|body| body.pose.position[1]).fold(1.0, f32::max);
    for (index, body) in (0..).zip(bodies) {
        let Some(mesh) = mesh_of(body, &meshes) else { continue };
        let colour = if kinds.len() > 1 {
            let shape = usize::try_from(body.shape).unwrap_or(0);
            let kind = kinds.iter().position(|kind| geometries[shape].as_ref() == Some(*kind));
            KINDS[kind.unwrap_or(0) % KINDS.len()]
        } else {
            let share = (body.pose.position[1] / highest).clamp(0.0, 1.0);
            [0, 1, 2].map(|k: usize| (1.0 - share) * LOW[k] + share * HIGH[k])
        };
        for_each_of(index, body.pose, mesh, colour, view, &mut draw);
    }
}

fn mesh_of<'a>(body: &Body, meshes: &'a [Option<Mesh>]) -> Option<&'a Mesh> {
    let shape = usize::try_from(body.shape).ok()?;
    meshes.get(shape)?.as_ref()
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
        for_each(&[body], &[None, Some(Geometry::CUBE)], &view, |face| faces.push(face));
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
