//! Bodies, and the trait that makes a caller's own arrays bodies.
//!
//! A step reads bodies and writes them back through [`Bodies`]. Slices, arrays and vectors of
//! [`Body`] implement it, [`BodyArrays`] implements it over separate arrays, and an engine with a
//! layout of its own implements its two methods: nothing is copied in between.

use std::array;
use std::ops::Sub;

use bytemuck::{Pod, Zeroable};

/// Position and orientation of a body, world frame.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Pose {
    /// Centre of mass, m.
    pub position: [f32; 3],
    /// Unit quaternion in the order x, y, z, w; it turns the body's own axes to the world's. No
    /// rotation is `[0.0, 0.0, 0.0, 1.0]`.
    pub orientation: [f32; 4],
}

/// Linear and angular velocity of a body, world frame.
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
#[repr(C)]
pub struct Velocity {
    /// Velocity of the centre of mass, m/s.
    pub linear: [f32; 3],
    /// Angular velocity about world axes, rad/s.
    pub angular: [f32; 3],
}

/// A rigid body.
///
/// Units: metres, kilograms, seconds and radians, in the world frame. The direction of gravity
/// decides which axis points up. The words lie in this order, without a gap.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Body {
    /// Position and orientation.
    pub pose: Pose,
    /// Linear and angular velocity; zero for a static body, unless a step lets it
    /// [move](crate::StepParameters::kinematic).
    pub velocity: Velocity,
    /// Index into the shapes given to `Accelerator::set_shapes`.
    pub shape: u32,
}

/// The bodies of a step, in the caller's own layout.
///
/// A step calls [`body`](Self::body) for every index below [`len`](Self::len), any number of times.
/// Only after success it calls [`commit`](Self::commit), once for each index.
///
/// Several threads may call [`body`](Self::body) at the same time, each for bodies of its own
/// ([`OpenOptions::pack_threads`]); a container must therefore be [`Sync`]. Only the caller's
/// thread calls [`commit`](Self::commit). All methods run in the standard [floating-point
/// environment](crate#the-floating-point-environment), and must leave it as it is.
///
/// [`OpenOptions::pack_threads`]: crate::OpenOptions::pack_threads
pub trait Bodies: Sync {
    /// Number of bodies.
    fn len(&self) -> usize;

    /// Body `index`, which is below [`len`](Self::len).
    fn body(&self, index: usize) -> Body;

    /// Stores the new state of body `index`.
    fn commit(&mut self, index: usize, pose: Pose, velocity: Velocity);

    /// All bodies as one slice, if they lie in an array of structures: a step reads them there,
    /// without a copy.
    ///
    /// Each must equal [`body`](Self::body) of its index. A view that changes any body must keep
    /// the default.
    fn structures(&self) -> Option<&[Body]> {
        None
    }

    /// Whether there are no bodies.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Whether separate arrays have an element for every index; otherwise a step refuses the
    /// bodies.
    fn lengths_agree(&self) -> bool {
        true
    }
}

impl Bodies for [Body] {
    fn len(&self) -> usize {
        <[Body]>::len(self)
    }

    fn body(&self, index: usize) -> Body {
        self[index]
    }

    fn structures(&self) -> Option<&[Body]> {
        Some(self)
    }

    fn commit(&mut self, index: usize, pose: Pose, velocity: Velocity) {
        let body = &mut self[index];
        body.pose = pose;
        body.velocity = velocity;
    }
}

impl Bodies for Vec<Body> {
    fn len(&self) -> usize {
        self.as_slice().len()
    }

    fn body(&self, index: usize) -> Body {
        self[index]
    }

    fn structures(&self) -> Option<&[Body]> {
        Some(self)
    }

    fn commit(&mut self, index: usize, pose: Pose, velocity: Velocity) {
        self.as_mut_slice().commit(index, pose, velocity);
    }
}

impl<const N: usize> Bodies for [Body; N] {
    fn len(&self) -> usize {
        N
    }

    fn body(&self, index: usize) -> Body {
        self[index]
    }

    fn structures(&self) -> Option<&[Body]> {
        Some(self)
    }

    fn commit(&mut self, index: usize, pose: Pose, velocity: Velocity) {
        self.as_mut_slice().commit(index, pose, velocity);
    }
}

impl<B: Bodies + ?Sized> Bodies for &mut B {
    fn len(&self) -> usize {
        B::len(self)
    }

    fn body(&self, index: usize) -> Body {
        B::body(self, index)
    }

    fn commit(&mut self, index: usize, pose: Pose, velocity: Velocity) {
        B::commit(self, index, pose, velocity);
    }

    fn structures(&self) -> Option<&[Body]> {
        B::structures(self)
    }

    fn is_empty(&self) -> bool {
        B::is_empty(self)
    }

    fn lengths_agree(&self) -> bool {
        B::lengths_agree(self)
    }
}

/// A number of the caller's arrays: `f32`, or `f64`, which the board gets rounded.
pub trait Real: Copy + Default + Send + Sync + From<f32> + Sub<Output = Self> {
    /// The nearest number that the board has.
    fn single(self) -> f32;

    /// An element of an array relative to `origin`.
    fn relative<const N: usize>(given: [Self; N], origin: [Self; N]) -> [f32; N] {
        array::from_fn(|i| (given[i] - origin[i]).single())
    }

    /// Stores a result that is relative to `origin`. A number that the step has not changed keeps
    /// all its digits.
    fn store<const N: usize>(kept: &mut [Self; N], results: [f32; N], origin: [Self; N]) {
        for ((kept, result), origin) in kept.iter_mut().zip(results).zip(origin) {
            if (*kept - origin).single().to_bits() != result.to_bits() {
                // Not a sum: -0 plus 0 is 0.
                *kept = Self::from(result) - (Self::default() - origin);
            }
        }
    }
}

impl Real for f32 {
    fn single(self) -> f32 {
        self
    }
}

impl Real for f64 {
    #[expect(clippy::cast_possible_truncation, reason = "the board computes with f32")]
    fn single(self) -> f32 {
        self as f32
    }
}

/// Bodies kept in separate arrays of one length, of `f32` or of `f64`; a step refuses arrays of
/// unequal lengths.
#[derive(Debug)]
pub struct BodyArrays<'a, R = f32> {
    /// Centres of mass, m.
    pub positions: &'a mut [[R; 3]],
    /// Unit quaternions x, y, z, w.
    pub orientations: &'a mut [[R; 4]],
    /// Linear velocities, m/s.
    pub linear_velocities: &'a mut [[R; 3]],
    /// Angular velocities, rad/s.
    pub angular_velocities: &'a mut [[R; 3]],
    /// Indices into the shape table.
    pub shapes: &'a [u32],
    /// The place that the board takes for 0, m: near the bodies in a large world of `f64`. The
    /// contact points are relative to it, too.
    pub origin: [R; 3],
}

impl<R> BodyArrays<'_, R> {
    fn lengths(&self) -> [usize; 5] {
        [
            self.positions.len(),
            self.orientations.len(),
            self.linear_velocities.len(),
            self.angular_velocities.len(),
            self.shapes.len(),
        ]
    }
}

impl<R: Real> Bodies for BodyArrays<'_, R> {
    fn len(&self) -> usize {
        self.positions.len()
    }

    fn lengths_agree(&self) -> bool {
        self.lengths().iter().all(|length| *length == self.len())
    }

    fn body(&self, index: usize) -> Body {
        Body {
            pose: Pose {
                position: R::relative(self.positions[index], self.origin),
                orientation: self.orientations[index].map(R::single),
            },
            velocity: Velocity {
                linear: self.linear_velocities[index].map(R::single),
                angular: self.angular_velocities[index].map(R::single),
            },
            shape: self.shapes[index],
        }
    }

    fn commit(&mut self, index: usize, pose: Pose, velocity: Velocity) {
        let zero = [R::default(); 3];
        R::store(&mut self.positions[index], pose.position, self.origin);
        R::store(&mut self.orientations[index], pose.orientation, [R::default(); 4]);
        R::store(&mut self.linear_velocities[index], velocity.linear, zero);
        R::store(&mut self.angular_velocities[index], velocity.angular, zero);
    }
}
