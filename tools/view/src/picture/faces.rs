//! The faces of all bodies that show their outside to the eye or to the light, with their colours.

use zynq_pgs::Pose;

use super::camera::View;
use crate::error::ViewError;
use crate::kinds::{COLOURS, surfaces};
use crate::mesh::{Mesh, cross, dot, minus};
use crate::recording::{Frame, Recording};

/// Colours of bodies that begin low and high, where all are of one kind.
pub(super) const LOW: [f32; 3] = [52.0, 92.0, 148.0];
pub(super) const HIGH: [f32; 3] = [238.0, 196.0, 96.0];
/// Where the light comes from, of length 1.
const LIGHT: [f32; 3] = [-0.36, 0.8, 0.48];
/// Height of a centre above the ground, in radii around the body, from which it casts no shadow.
const SHADOWLESS: f32 = 30.0;

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

/// The surface and the colour of each body of a recording.
#[derive(Debug)]
pub(super) struct Surfaces<'a> {
    recording: &'a Recording,
    /// The surface of each kind, and the radius of the ball around it.
    meshes: Vec<(Mesh, f32)>,
    colours: Vec<[f32; 3]>,
}

impl<'a> Surfaces<'a> {
    pub(super) fn of(recording: &'a Recording) -> Result<Self, ViewError> {
        let radii = recording.geometries().iter().map(|geometry| geometry.bounding_radius());
        let meshes = surfaces(recording.geometries())?.into_iter().zip(radii).collect();
        Ok(Self { recording, meshes, colours: colours(recording) })
    }

    /// The bodies of a frame: index, pose, surface and radius.
    fn bodies(&self, frame: &'a Frame) -> impl Iterator<Item = (u32, Pose, &(Mesh, f32))> {
        let bodies = (0..).zip(&frame.poses).zip(self.recording.kinds());
        bodies.map(|((body, pose), kind)| (body, *pose, &self.meshes[*kind]))
    }

    /// Calls `draw` with each face of a frame that the eye may see.
    pub(super) fn for_each(&self, frame: &Frame, view: &View, mut draw: impl FnMut(Face)) {
        for ((body, pose, (mesh, _)), colour) in self.bodies(frame).zip(&self.colours) {
            for corners in &mesh.faces {
                let points = places(pose, mesh, corners);
                let outside = cross(minus(points[1], points[0]), minus(points[2], points[0]));
                let shows_outside = dot(outside, minus(view.eye(), points[0])) > 0.0;
                let Some(projected) = view.all(&points).filter(|_| shows_outside) else { continue };
                let lit = |corner: &u16| {
                    let normal = turned(pose.orientation, mesh.normals[usize::from(*corner)]);
                    let shade = 0.62 + 0.38 * dot(normal, LIGHT);
                    colour.map(|value| shade * value)
                };
                let colours = corners.iter().map(lit).collect();
                draw(Face { body, corners: projected, colours });
            }
        }
    }

    /// Calls `draw` with the shadow on the ground of each lit face: its corners, and its darkness
    /// up to 1, which fades with the body's height.
    pub(super) fn shadows(
        &self,
        frame: &Frame,
        view: &View,
        mut draw: impl FnMut(&[[f32; 3]], f32),
    ) {
        for (_, pose, (mesh, radius)) in self.bodies(frame) {
            let darkness = 1.0 - pose.position[1] / (SHADOWLESS * radius);
            if darkness <= 0.0 {
                continue;
            }
            for corners in &mesh.faces {
                let mut points = places(pose, mesh, corners);
                let outside = cross(minus(points[1], points[0]), minus(points[2], points[0]));
                if dot(outside, LIGHT) <= 0.0 {
                    continue;
                }
                for point in &mut points {
                    let along = if point[1] > 0.0 { point[1] / LIGHT[1] } else { 0.0 };
                    *point = [point[0] - along * LIGHT[0], 0.0, point[2] - along * LIGHT[2]];
                }
                if let Some(projected) = view.all(&points) {
                    draw(&projected, darkness);
                }
            }
        }
    }
}

/// The colour of each body: of its kind, or of its height at the start where all are of one kind.
fn colours(recording: &Recording) -> Vec<[f32; 3]> {
    let Some(start) = recording.frames().first().filter(|_| recording.geometries().len() < 2)
    else {
        return recording.kinds().iter().map(|kind| COLOURS[kind % COLOURS.len()]).collect();
    };
    let heights = || start.poses.iter().map(|pose| pose.position[1]);
    let low = heights().fold(f32::INFINITY, |low, height| if height < low { height } else { low });
    let high = heights().fold(low, |high, height| if height > high { height } else { high });
    let extent = if high > low { high - low } else { 1.0 };
    heights().map(|height| mixed((height - low) / extent, LOW, HIGH)).collect()
}

/// The colour between two, for a share from 0 to 1 of the second.
pub(super) fn mixed(share: f32, one: [f32; 3], other: [f32; 3]) -> [f32; 3] {
    [0, 1, 2].map(|k: usize| (1.0 - share) * one[k] + share * other[k])
}

/// Where the corners of a face are in the world.
fn places(pose: Pose, mesh: &Mesh, corners: &[u16]) -> Vec<[f32; 3]> {
    let place = |corner: &u16| {
        let turned = turned(pose.orientation, mesh.positions[usize::from(*corner)]);
        [0, 1, 2].map(|axis: usize| pose.position[axis] + turned[axis])
    };
    corners.iter().map(place).collect()
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
    use scene::Geometry;
    use zynq_pgs::{Body, Velocity};

    /// A cube whose centre is that high.
    fn cube(height: f32) -> Recording {
        let pose = Pose { position: [0.0, height, 0.0], orientation: [0.0, 0.0, 0.0, 1.0] };
        let bodies = [Body { pose, velocity: Velocity::default(), shape: 1 }];
        let mut recording = Recording::new(&bodies, &[None, Some(Geometry::CUBE)]);
        recording.add(0, 0.0, &bodies).expect("a finite pose");
        recording
    }

    #[test]
    fn a_cube_shows_three_faces_the_upper_one_lightest() {
        let camera = Camera { target: [0.0; 3], eye: [6.0, 8.0, 7.0] };
        let mut faces = Vec::new();
        let (view, recording) = (View::new(camera, 100, 100), cube(0.5));
        let surfaces = Surfaces::of(&recording).expect("a cube");
        surfaces.for_each(&recording.frames()[0], &view, |face| faces.push(face));
        assert_eq!(faces.len(), 3);
        let light = |face: &Face| face.colours[0][1];
        let highest = |face: &Face| face.corners.iter().map(|c| c[1]).fold(f32::INFINITY, f32::min);
        let lightest = faces.iter().max_by(|a, b| light(a).total_cmp(&light(b))).expect("faces");
        let top = faces.iter().min_by(|a, b| highest(a).total_cmp(&highest(b))).expect("faces");
        assert!((highest(lightest) - highest(top)).abs() < 1e-3);
    }

    /// The light falls by 0.8 m on 0.36 m of x: the upper face of a cube of 2 m that lies on the
    /// ground has its shadow 0.9 m and 1.2 m beside it.
    #[test]
    fn a_shadow_lies_beside_a_body_away_from_the_light_and_fades_with_height() {
        let camera = Camera { target: [0.0; 3], eye: [0.0, 40.0, 0.1] };
        let view = View::new(camera, 1000, 1000);
        let darkest = |height: f32| {
            let (recording, mut shadows) = (cube(height), Vec::new());
            let surfaces = Surfaces::of(&recording).expect("a cube");
            let draw = |corners: &[[f32; 3]], dark: f32| shadows.push((corners.to_vec(), dark));
            surfaces.shadows(&recording.frames()[0], &view, draw);
            shadows
        };
        let shadows = darkest(1.0);
        assert_eq!(shadows.len(), 3, "the lit faces");
        let [x, y, _] = view.project([1.0 + 0.9, 0.0, -1.0 - 1.2]).expect("seen");
        let near = |corner: &[f32; 3]| (corner[0] - x).abs() + (corner[1] - y).abs() < 0.1;
        assert!(shadows.iter().any(|(corners, _)| corners.iter().any(near)), "{shadows:?}");
        assert!(darkest(20.0)[0].1 < 0.7 * shadows[0].1);
        assert!(darkest(60.0).is_empty());
    }

    #[test]
    fn a_quarter_turn_about_y_carries_z_to_x() {
        let half = 0.5_f32.sqrt();
        let [x, y, z] = turned([0.0, half, 0.0, half], [0.0, 0.0, 1.0]);
        assert!((x - 1.0).abs() + y.abs() + z.abs() < 1e-6);
    }
}
