//! The caller's arrays of bodies and collisions: where each lies, and how far apart its elements
//! are.

use std::ffi::c_void;

use crate::collision::Place;
use crate::shape::Shape;

/// An array that the library reads and writes: element `i` lies `i * stride` bytes behind `data`.
///
/// Address and stride are multiples of 4, or of 8 for doubles, and the stride is at least the size
/// of an element. An array of structures has the size of its structure as the stride, a dense array
/// that of its element. `data` may be null if the array has no element.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct Strided {
    /// The first element.
    pub data: *mut c_void,
    /// Bytes from one element to the next.
    pub stride: usize,
}

/// An array that the library only reads; as `zpgs_strided`.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct StridedConst {
    /// The first element.
    pub data: *const c_void,
    /// Bytes from one element to the next.
    pub stride: usize,
}

/// The bodies of a step, in the caller's own memory. Units are m, s, kg and rad, in the world
/// frame.
///
/// During a call no other thread writes the arrays. A call with bodies refuses arrays that share a
/// byte with each other or with another of its arguments. Elements of several arrays may alternate,
/// as the members of an array of structures do.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct BodyArrays {
    /// Size of the structure, as the caller's header has it.
    pub size: usize,
    /// Number of bodies.
    pub count: usize,
    /// Centres of mass, m: `float[3]`.
    pub positions: Strided,
    /// Unit quaternions x, y, z, w: `float[4]`.
    pub orientations: Strided,
    /// Velocities of the centres of mass, m/s: `float[3]`.
    pub linear_velocities: Strided,
    /// Angular velocities, rad/s: `float[3]`.
    pub angular_velocities: Strided,
    /// Indices into the shapes: `uint32_t`.
    pub shapes: StridedConst,
    /// The shapes of this world, a dense array: the step loads them where the accelerator has
    /// others, so that worlds with shapes of their own share it. They stay loaded, also where the
    /// step is refused.
    pub table: *const Shape,
    /// Number of these shapes. 0: the step takes the shapes that the accelerator has.
    pub table_count: usize,
    /// Bytes of a number in the arrays above: 4 or 0 for `float`, 8 for `double`, which the board
    /// gets rounded. A number that a step has not changed keeps all its digits.
    pub number_size: usize,
    /// The place that the board takes for 0, m: near the bodies in a large world of doubles. The
    /// contact points are relative to it, too.
    pub origin: [f64; 3],
}

impl Default for BodyArrays {
    /// No bodies.
    fn default() -> Self {
        let none = Strided { data: std::ptr::null_mut(), stride: 0 };
        Self {
            size: size_of::<Self>(),
            count: 0,
            positions: none,
            orientations: none,
            linear_velocities: none,
            angular_velocities: none,
            shapes: StridedConst { data: std::ptr::null(), stride: 0 },
            table: std::ptr::null(),
            table_count: 0,
            number_size: 0,
            origin: [0.0; 3],
        }
    }
}

/// The collisions of a step, in the caller's own memory.
///
/// During a call no thread writes them. A step refuses them where they share a byte with the
/// bodies.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct CollisionArray {
    /// Size of the structure, as the caller's header has it.
    pub size: usize,
    /// Number of collisions.
    pub count: usize,
    /// The collisions: `zpgs_collision`. A step reads a dense array without a copy.
    pub collisions: StridedConst,
    /// The impulses that a step with `warm_start` begins with: `zpgs_impulses`, one for each
    /// collision. Null without a warm start, and where the impulses come by place.
    pub impulses: StridedConst,
    /// Where each collision was in the last step of its world that `zpgs_commit` has kept: a
    /// dense array. Null without a warm start by place.
    pub places: *const Place,
    /// The share of the impulses at the places that a step begins with, such as 0.85. A warm start
    /// with 0 is refused: it would be a cold one that takes longer.
    pub factor: f32,
    /// The world: any number. Each one has a last step of its own.
    pub world: u32,
}
