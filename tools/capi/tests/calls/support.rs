//! A world of two bodies in the layout of an engine, and a handle that closes itself.

use std::ffi::{CStr, CString, c_char};
use std::ptr::{from_ref, null, null_mut};

use zynq_pgs::{Accelerator, Body, OpenOptions, Pose, StepParameters, Velocity};
use zynq_pgs_c::*;

/// A body in the layout of an engine, with words of its own between the library's.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub(crate) struct Crate {
    pub(crate) name: u32,
    pub(crate) orientation: [f32; 4],
    pub(crate) angular: [f32; 3],
    pub(crate) colour: u32,
    pub(crate) linear: [f32; 3],
    pub(crate) position: [f32; 3],
    pub(crate) shape: u32,
}

pub(crate) fn crate_at(y: f32, shape: u32, speed: f32) -> Crate {
    Crate {
        name: 7,
        orientation: [0.0, 0.0, 0.0, 1.0],
        angular: [0.0, 0.25, 0.0],
        colour: 9,
        linear: [0.5 * speed, speed, 0.0],
        position: [0.0, y, 0.0],
        shape,
    }
}

/// A ground at rest and a cube that falls on it.
pub(crate) fn world() -> [Crate; 2] {
    let mut ground = crate_at(-1.0, 0, 0.0);
    ground.angular = [0.0; 3];
    [ground, crate_at(0.99, 1, -2.0)]
}

pub(crate) fn collision() -> Collision {
    let corner = |x, z| Contact { point: [x, -0.01, z], distance: -0.01 };
    let contacts = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0)];
    Collision { body_a: 0, body_b: 1, normal: [0.0, -1.0, 0.0], count: 4, contacts }
}

pub(crate) const SHAPES: [Shape; 2] = [
    Shape { inverse_mass: 0.0, inverse_inertia: [0.0; 3] },
    Shape { inverse_mass: 1.0, inverse_inertia: [1.5; 3] },
];

pub(crate) fn arrays(bodies: &mut [Crate]) -> BodyArrays {
    let (stride, first) = (size_of::<Crate>(), bodies.as_mut_ptr());
    let column =
        |offset: usize| Strided { data: first.cast::<u8>().wrapping_add(offset).cast(), stride };
    let shapes = column(std::mem::offset_of!(Crate, shape));
    BodyArrays {
        count: bodies.len(),
        positions: column(std::mem::offset_of!(Crate, position)),
        orientations: column(std::mem::offset_of!(Crate, orientation)),
        linear_velocities: column(std::mem::offset_of!(Crate, linear)),
        angular_velocities: column(std::mem::offset_of!(Crate, angular)),
        shapes: StridedConst { data: shapes.data, stride },
        ..BodyArrays::default()
    }
}

pub(crate) fn collisions(all: &[Collision]) -> CollisionArray {
    CollisionArray {
        size: size_of::<CollisionArray>(),
        count: all.len(),
        collisions: StridedConst { data: all.as_ptr().cast(), stride: size_of::<Collision>() },
        impulses: StridedConst { data: null(), stride: 0 },
        places: null(),
        factor: 0.0,
        world: 0,
    }
}

pub(crate) fn defaults() -> Parameters {
    // SAFETY: every bit pattern is a structure of numbers.
    let mut parameters: Parameters = unsafe { std::mem::zeroed() };
    let status = made!(zpgs_parameters_default(&raw mut parameters, size_of::<Parameters>()));
    assert_eq!((status, parameters.size), (Status::Ok, size_of::<Parameters>()));
    parameters
}

pub(crate) fn text(text: *const c_char) -> String {
    assert!(!text.is_null());
    // SAFETY: the library gives texts that end with a null byte, and no call fails meanwhile.
    unsafe { CStr::from_ptr(text) }.to_str().expect("UTF-8").to_owned()
}

/// An open accelerator, closed in the end.
pub(crate) struct Open(pub(crate) *mut AcceleratorHandle);

impl Open {
    pub(crate) fn new(board: &str) -> Self {
        let (board, mut handle) = (CString::new(board).expect("a text"), null_mut());
        assert_eq!(made!(zpgs_open(board.as_ptr(), &raw mut handle)), Status::Ok);
        let open = Self(handle);
        assert_eq!(open.text(), "", "nothing has failed yet");
        assert_eq!(open.set_shapes(&SHAPES), Status::Ok);
        open
    }

    pub(crate) fn set_shapes(&self, shapes: &[Shape]) -> Status {
        made!(zpgs_set_shapes(self.0, shapes.as_ptr(), shapes.len()))
    }

    pub(crate) fn step(
        &self,
        bodies: &BodyArrays,
        all: &CollisionArray,
        parameters: &Parameters,
    ) -> Status {
        made!(zpgs_step(self.0, from_ref(bodies), from_ref(all), from_ref(parameters), null_mut()))
    }

    pub(crate) fn submit(&self, bodies: &BodyArrays, all: &CollisionArray) -> Status {
        made!(zpgs_submit(self.0, from_ref(bodies), from_ref(all), from_ref(&defaults())))
    }

    pub(crate) fn wait(&self, bodies: &BodyArrays) -> Status {
        made!(zpgs_wait(self.0, from_ref(bodies), null_mut()))
    }

    pub(crate) fn cancel(&self) {
        assert_eq!(made!(zpgs_cancel(self.0)), Status::Ok);
    }

    pub(crate) fn text(&self) -> String {
        text(made!(zpgs_last_error(self.0)))
    }
}

impl Drop for Open {
    fn drop(&mut self) {
        assert_eq!(made!(zpgs_close(self.0)), Status::Ok);
    }
}

/// The world after one step of the driver.
pub(crate) fn stepped() -> [Crate; 2] {
    let mut board =
        Accelerator::open(OpenOptions::emulated("float").expect("a build")).expect("open");
    board.set_shapes(&SHAPES.map(zynq_pgs::Shape::from)).expect("shapes");
    let mut crates = world();
    let mut bodies = crates.map(|body| Body {
        pose: Pose { position: body.position, orientation: body.orientation },
        velocity: Velocity { linear: body.linear, angular: body.angular },
        shape: body.shape,
    });
    let given = collision();
    let contacts =
        given.contacts.map(|Contact { point, distance }| zynq_pgs::Contact { point, distance });
    let Collision { body_a, body_b, normal, count, .. } = given;
    let all = [zynq_pgs::Collision { body_a, body_b, normal, count, contacts }];
    board.step(&mut bodies[..], &all[..], &StepParameters::default()).expect("a step");
    for (to, from) in crates.iter_mut().zip(bodies) {
        (to.position, to.orientation) = (from.pose.position, from.pose.orientation);
        (to.linear, to.angular) = (from.velocity.linear, from.velocity.angular);
    }
    assert_ne!(crates, world());
    crates
}
