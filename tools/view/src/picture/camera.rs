//! Where a picture is taken from, and where a point of the world lies on it.

use zynq_pgs::Pose;

use crate::mesh::{cross, dot, minus, unit};

/// Half the height of a picture at distance 1.
const HALF_HEIGHT: f32 = 0.36;
/// Share of the picture that stays free around the bodies.
const MARGIN: f32 = 1.04;

/// A camera that looks at a point; y is up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// The point in the middle of the picture, m.
    pub target: [f32; 3],
    /// The eye, m; not straight above the target.
    pub eye: [f32; 3],
}

impl Camera {
    /// Sees all poses, with bodies of this radius, from a side and above; `aspect` is the picture's
    /// width over its height.
    #[must_use]
    pub fn around<'a>(
        poses: impl Iterator<Item = &'a Pose> + Clone,
        radius: f32,
        aspect: f32,
    ) -> Self {
        let back = unit([0.75, 0.52, 1.0]);
        let mut low = [f32::INFINITY; 3];
        let mut high = [f32::NEG_INFINITY; 3];
        for pose in poses.clone() {
            for axis in 0..3 {
                let value = pose.position[axis];
                low[axis] = if value < low[axis] { value } else { low[axis] };
                high[axis] = if value > high[axis] { value } else { high[axis] };
            }
        }
        let target = [0, 1, 2].map(|axis: usize| 0.5 * (low[axis] + high[axis]));
        if !target.iter().all(|value| value.is_finite()) {
            return Self { target: [0.0; 3], eye: back.map(|value| 10.0 * value) };
        }
        let here = Self { target, eye: [0, 1, 2].map(|axis: usize| target[axis] + back[axis]) };
        let axes = here.axes();
        let mut distance = 4.0 * radius;
        for pose in poses {
            let [right, up, towards] = axes.map(|axis| dot(axis, minus(pose.position, target)));
            let across = (right.abs() + radius) / aspect;
            let along = up.abs() + radius;
            let most = if across > along { across } else { along };
            let needed = towards + MARGIN * most / HALF_HEIGHT;
            distance = if needed > distance { needed } else { distance };
        }
        Self { target, eye: [0, 1, 2].map(|axis: usize| target[axis] + distance * back[axis]) }
    }

    /// Right, up and towards the eye.
    pub(super) fn axes(&self) -> [[f32; 3]; 3] {
        let back = unit(minus(self.eye, self.target));
        let right = unit(cross([0.0, 1.0, 0.0], back));
        [right, cross(back, right), back]
    }
}

/// A camera with a picture of some size.
#[derive(Debug, Clone, Copy)]
pub(super) struct View {
    camera: Camera,
    axes: [[f32; 3]; 3],
    width: f32,
    height: f32,
    /// Pixels of a length of 1 at distance 1.
    scale: f32,
}

impl View {
    pub(super) fn new(camera: Camera, width: u16, height: u16) -> Self {
        let (width, height) = (f32::from(width), f32::from(height));
        let scale = 0.5 * height / HALF_HEIGHT;
        Self { camera, axes: camera.axes(), width, height, scale }
    }

    pub(super) fn eye(&self) -> [f32; 3] {
        self.camera.eye
    }

    /// The pixel of a point, from the left and from above, and the inverse of its distance; none
    /// for a point behind the eye.
    pub(super) fn project(&self, point: [f32; 3]) -> Option<[f32; 3]> {
        let [right, up, towards] = self.axes.map(|axis| dot(axis, minus(point, self.camera.eye)));
        let inverse = -1.0 / towards;
        let is_seen = inverse > 0.0 && inverse.is_finite();
        is_seen.then(|| {
            let x = 0.5 * self.width + self.scale * right * inverse;
            let y = 0.5 * self.height - self.scale * up * inverse;
            [x, y, inverse]
        })
    }

    /// The distance from the eye to the middle, m.
    pub(super) fn distance(&self) -> f32 {
        let towards = minus(self.camera.eye, self.camera.target);
        dot(towards, towards).sqrt()
    }

    /// The pixels of points; none if one is behind the eye.
    pub(super) fn all(&self, points: &[[f32; 3]]) -> Option<Vec<[f32; 3]>> {
        points.iter().map(|point| self.project(*point)).collect()
    }

    /// The point of the plane y = 0 at a pixel; none above the horizon.
    pub(super) fn ground(&self, x: f32, y: f32) -> Option<[f32; 3]> {
        let [right, up, back] = self.axes;
        let across = (x - 0.5 * self.width) / self.scale;
        let along = (0.5 * self.height - y) / self.scale;
        let ray = [0, 1, 2].map(|k: usize| (across * right[k] + along * up[k]) - back[k]);
        let eye = self.camera.eye;
        (ray[1] < 0.0 && eye[1] > 0.0).then(|| {
            let length = -eye[1] / ray[1];
            [eye[0] + length * ray[0], 0.0, eye[2] + length * ray[2]]
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_target_is_in_the_middle_and_right_and_up_are_so() {
        let camera = Camera { target: [1.0, 2.0, 3.0], eye: [1.0, 2.0, 13.0] };
        let view = View::new(camera, 200, 100);
        let near = |point: [f32; 3], expected: [f32; 2]| {
            let [x, y, _] = view.project(point).expect("seen");
            assert!((x - expected[0]).abs() + (y - expected[1]).abs() < 1e-3, "{point:?}: {x} {y}");
        };
        near([1.0, 2.0, 3.0], [100.0, 50.0]);
        // Half the height at distance 10 is 3.6 m.
        near([1.0, 5.6, 3.0], [100.0, 0.0]);
        near([4.6, 2.0, 3.0], [150.0, 50.0]);
        assert!(view.project([1.0, 2.0, 14.0]).is_none(), "behind the eye");
    }

    #[test]
    fn a_pixel_of_the_ground_shows_its_point() {
        let camera = Camera { target: [0.0; 3], eye: [3.0, 4.0, 5.0] };
        let view = View::new(camera, 200, 100);
        let [x, y, _] = view.project([1.0, 0.0, -2.0]).expect("seen");
        let found = view.ground(x, y).expect("below the horizon");
        assert!((found[0] - 1.0).abs() + (found[2] + 2.0).abs() < 1e-4, "{found:?}");
        assert!(view.ground(100.0, -1000.0).is_none());
    }

    #[test]
    fn all_bodies_are_on_the_picture() {
        let pose = |position| Pose { position, orientation: [0.0, 0.0, 0.0, 1.0] };
        let poses = [[0.0; 3], [30.0, 1.0, 2.0], [5.0, 9.0, -8.0], [1.0, 4.0, 20.0]].map(pose);
        let view = View::new(Camera::around(poses.iter(), 1.0, 1.6), 160, 100);
        for pose in &poses {
            let [x, y, _] = view.project(pose.position).expect("seen");
            assert!((1.0..159.0).contains(&x) && (1.0..99.0).contains(&y), "{pose:?}: {x} {y}");
        }
        // Nothing, and one body in one place.
        assert!(Camera::around([].iter(), 1.0, 1.6).eye[1] > 0.0);
        let one = Camera::around(poses[..1].iter(), 1.0, 1.6);
        assert!(dot(one.eye, one.eye) > 1.0);
    }
}
