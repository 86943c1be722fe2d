//! The calls of the C interface, made as C makes them.

#![allow(unsafe_code, reason = "the calls take raw pointers")]

use std::ffi::{CStr, CString, c_char, c_void};
use std::ptr::{from_ref, null, null_mut};

use zynq_pgs::{Accelerator, Body, OpenOptions, Pose, StepParameters, Velocity};
use zynq_pgs_c::*;

/// Makes a call whose pointers are null, a handle that is open, or structures and arrays of a test.
macro_rules! made {
    ($call:expr) => {
        // SAFETY: every call below keeps the contract of the header: the handle is open, or null.
        unsafe { $call }
    };
}

/// A body in the layout of an engine, with words of its own between the library's.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
struct Crate {
    name: u32,
    orientation: [f32; 4],
    angular: [f32; 3],
    colour: u32,
    linear: [f32; 3],
    position: [f32; 3],
    shape: u32,
}

fn crate_at(y: f32, shape: u32, speed: f32) -> Crate {
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
fn world() -> [Crate; 2] {
    let mut ground = crate_at(-1.0, 0, 0.0);
    ground.angular = [0.0; 3];
    [ground, crate_at(0.99, 1, -2.0)]
}

fn collision() -> Collision {
    let corner = |x, z| Contact { point: [x, -0.01, z], distance: -0.01 };
    let contacts = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0)];
    Collision { body_a: 0, body_b: 1, normal: [0.0, -1.0, 0.0], count: 4, contacts }
}

const SHAPES: [Shape; 2] = [
    Shape { inverse_mass: 0.0, inverse_inertia: [0.0; 3] },
    Shape { inverse_mass: 1.0, inverse_inertia: [1.5; 3] },
];

fn arrays(bodies: &mut [Crate]) -> BodyArrays {
    let (stride, first) = (size_of::<Crate>(), bodies.as_mut_ptr());
    let column =
        |offset: usize| Strided { data: first.cast::<u8>().wrapping_add(offset).cast(), stride };
    let shapes = column(std::mem::offset_of!(Crate, shape));
    BodyArrays {
        size: size_of::<BodyArrays>(),
        count: bodies.len(),
        positions: column(std::mem::offset_of!(Crate, position)),
        orientations: column(std::mem::offset_of!(Crate, orientation)),
        linear_velocities: column(std::mem::offset_of!(Crate, linear)),
        angular_velocities: column(std::mem::offset_of!(Crate, angular)),
        shapes: StridedConst { data: shapes.data, stride },
    }
}

fn collisions(all: &[Collision]) -> CollisionArray {
    CollisionArray {
        size: size_of::<CollisionArray>(),
        count: all.len(),
        collisions: StridedConst { data: all.as_ptr().cast(), stride: size_of::<Collision>() },
        impulses: StridedConst { data: null(), stride: 0 },
    }
}

fn defaults() -> Parameters {
    // SAFETY: every bit pattern is a structure of numbers.
    let mut parameters: Parameters = unsafe { std::mem::zeroed() };
    let status = made!(zpgs_parameters_default(&raw mut parameters, size_of::<Parameters>()));
    assert_eq!((status, parameters.size), (Status::Ok, size_of::<Parameters>()));
    parameters
}

fn text(text: *const c_char) -> String {
    assert!(!text.is_null());
    // SAFETY: the library gives texts that end with a null byte, and no call fails meanwhile.
    unsafe { CStr::from_ptr(text) }.to_str().expect("UTF-8").to_owned()
}

/// An open accelerator, closed in the end.
struct Open(*mut AcceleratorHandle);

impl Open {
    fn new(board: &str) -> Self {
        let (board, mut handle) = (CString::new(board).expect("a text"), null_mut());
        assert_eq!(made!(zpgs_open(board.as_ptr(), &raw mut handle)), Status::Ok);
        let open = Self(handle);
        assert_eq!(open.text(), "", "nothing has failed yet");
        assert_eq!(open.set_shapes(&SHAPES), Status::Ok);
        open
    }

    fn set_shapes(&self, shapes: &[Shape]) -> Status {
        made!(zpgs_set_shapes(self.0, shapes.as_ptr(), shapes.len()))
    }

    fn step(&self, bodies: &BodyArrays, all: &CollisionArray, parameters: &Parameters) -> Status {
        made!(zpgs_step(self.0, from_ref(bodies), from_ref(all), from_ref(parameters), null_mut()))
    }

    fn submit(&self, bodies: &BodyArrays, all: &CollisionArray) -> Status {
        made!(zpgs_submit(self.0, from_ref(bodies), from_ref(all), from_ref(&defaults())))
    }

    fn wait(&self, bodies: &BodyArrays) -> Status {
        made!(zpgs_wait(self.0, from_ref(bodies), null_mut()))
    }

    fn cancel(&self) {
        assert_eq!(made!(zpgs_cancel(self.0)), Status::Ok);
    }

    fn text(&self) -> String {
        text(made!(zpgs_last_error(self.0)))
    }
}

impl Drop for Open {
    fn drop(&mut self) {
        assert_eq!(made!(zpgs_close(self.0)), Status::Ok);
    }
}

/// The world after one step of the driver.
fn stepped() -> [Crate; 2] {
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

#[test]
fn the_versions_are_those_of_the_header_and_of_the_package() {
    assert_eq!(zpgs_abi_version(), ZPGS_ABI_VERSION);
    assert_eq!(text(zpgs_version()), env!("CARGO_PKG_VERSION"));
}

#[test]
fn a_step_over_the_engines_own_structures_gives_the_drivers_bits() {
    let (open, mut crates, all) = (Open::new("emulated:float"), world(), [collision()]);
    let mut report = Report { size: size_of::<Report>(), ..Report::default() };
    let (bodies, given, parameters) = (arrays(&mut crates), collisions(&all), defaults());
    let status = made!(zpgs_step(
        open.0,
        &raw const bodies,
        &raw const given,
        &raw const parameters,
        &raw mut report
    ));
    assert_eq!((status, open.text()), (Status::Ok, String::new()));
    assert_eq!(crates, stepped());
    assert!(report.cycles > 0 && report.seconds > 0.0 && report.impulse_sum > 0.0, "{report:?}");
    assert_eq!((report.size, report.bodies, report.collisions), (size_of::<Report>(), 2, 1));
}

#[test]
fn threads_that_share_the_packing_read_the_same_bodies() {
    let (open, many) = (Open::new("emulated:float"), 5000_u16);
    let mut crates: Vec<_> = (0..many).map(|at| crate_at(f32::from(at), 1, -1.0)).collect();
    let all = collisions(&[]);
    assert_eq!(open.step(&arrays(&mut crates), &all, &defaults()), Status::Ok, "{}", open.text());
    let alone = |at: u16| {
        let mut crates = [crate_at(f32::from(at), 1, -1.0)];
        assert_eq!(open.step(&arrays(&mut crates), &all, &defaults()), Status::Ok);
        crates[0]
    };
    for at in (0..many).step_by(499) {
        assert_eq!(crates[usize::from(at)], alone(at), "{at}");
    }
}

#[test]
fn collisions_with_gaps_between_them_are_the_same_collisions() {
    let (open, mut crates) = (Open::new("emulated:float"), world());
    let apart = [(collision(), [f32::NAN; 3]), (Collision::default(), [f32::NAN; 3])];
    let stride = size_of_val(&apart[0]);
    let mut all = collisions(&[collision(), Collision::default()]);
    let first: *const c_void = from_ref(&apart[0].0).cast();
    all.collisions = StridedConst { data: first, stride };
    assert_eq!(open.step(&arrays(&mut crates), &all, &defaults()), Status::Ok, "{}", open.text());
    assert_eq!(crates, stepped());
}

#[test]
fn submit_and_wait_are_a_step_and_one_step_is_in_flight() {
    let (open, mut crates, all) = (Open::new("emulated:float"), world(), [collision()]);
    let (bodies, all) = (arrays(&mut crates), collisions(&all));
    assert_eq!(open.wait(&bodies), Status::Sequence);
    assert!(open.text().contains("zpgs_submit"), "{}", open.text());
    assert_eq!(open.submit(&bodies, &all), Status::Ok, "{}", open.text());
    assert_eq!(open.submit(&bodies, &all), Status::Sequence);
    assert_eq!(open.step(&bodies, &all, &defaults()), Status::Sequence);
    assert_eq!(open.set_shapes(&SHAPES), Status::Sequence);
    assert_eq!(made!(zpgs_wait(open.0, null(), null_mut())), Status::NullPointer);
    assert_eq!(open.wait(&bodies), Status::Ok, "{}", open.text());
    assert_eq!(crates, stepped());
    assert_eq!(open.submit(&arrays(&mut crates), &all), Status::Ok, "and closed in flight");
}

/// The impulses that come out of two steps of the driver. The second begins with the impulses of the first.
fn warm_steps(parameters: &StepParameters) -> [zynq_pgs::Impulses; 2] {
    let mut board =
        Accelerator::open(OpenOptions::emulated("float").expect("a build")).expect("open");
    board.set_shapes(&SHAPES.map(zynq_pgs::Shape::from)).expect("shapes");
    let mut bodies = world().map(|body| Body {
        pose: Pose { position: body.position, orientation: body.orientation },
        velocity: Velocity { linear: body.linear, angular: body.angular },
        shape: body.shape,
    });
    let Collision { body_a, body_b, normal, count, contacts } = collision();
    let contacts =
        contacts.map(|Contact { point, distance }| zynq_pgs::Contact { point, distance });
    let collisions = [zynq_pgs::Collision { body_a, body_b, normal, count, contacts }];
    let mut impulses = zynq_pgs::Impulses::ZERO;
    [(); 2].map(|()| {
        let warm = zynq_pgs::WarmCollisions { collisions: &collisions[..], impulses: &[impulses] };
        board.step(&mut bodies[..], &warm, parameters).expect("a step");
        impulses = board.impulses()[0];
        impulses
    })
}

#[test]
fn impulses_go_in_and_come_out_at_their_strides() {
    let (open, mut crates, all) = (Open::new("emulated:float"), world(), [collision()]);
    let parameters = Parameters { warm_start: 1, impulses_out: 1, ..defaults() };
    let driver = StepParameters::default().with_warm_start(true).with_impulses_out(true);
    // A number of the engine's behind the impulses.
    let mut kept = [(Impulses::default(), 5_u32)];
    let stride = size_of_val(&kept[0]);
    for expected in warm_steps(&driver) {
        let data: *mut c_void = (&raw mut kept[0].0).cast();
        let mut given = collisions(&all);
        given.impulses = StridedConst { data, stride };
        let status = open.step(&arrays(&mut crates), &given, &parameters);
        assert_eq!(status, Status::Ok, "{}", open.text());
        let out = Strided { data, stride };
        assert_eq!(made!(zpgs_read_impulses(open.0, out, 1)), Status::Ok, "{}", open.text());
        let (Impulses { normal, friction }, engines) = kept[0];
        assert_eq!((normal, friction, engines), (expected.normal, expected.friction, 5));
        assert!(normal[0] > 0.0);
    }
    let none = Strided { data: null_mut(), stride: 0 };
    assert_eq!(made!(zpgs_read_impulses(open.0, none, 2)), Status::Argument);
    assert!(open.text().contains("had 1 collisions"), "{}", open.text());
    assert_eq!(made!(zpgs_read_impulses(open.0, none, 1)), Status::NullPointer);
    let status = open.step(&arrays(&mut crates), &collisions(&all), &parameters);
    assert_eq!(status, Status::Argument);
    assert!(open.text().contains("a warm start without impulses"), "{}", open.text());
}

#[test]
fn a_step_is_prepared_while_another_is_in_flight() {
    let (open, all) = (Open::new("emulated:float"), [collision()]);
    let (mut left, mut right) = (world(), world());
    let (all, parameters) = (collisions(&all), defaults());
    let prepare = |bodies: &BodyArrays| {
        made!(zpgs_prepare(open.0, from_ref(bodies), from_ref(&all), from_ref(&parameters)))
    };
    let wait_and_start = |bodies: &BodyArrays| {
        let mut started = Status::Panic;
        let (report, out) = (null_mut(), &raw mut started);
        (made!(zpgs_wait_and_start(open.0, from_ref(bodies), report, out)), started)
    };
    let refused = (Status::Sequence, Status::Sequence);
    assert_eq!(prepare(&arrays(&mut right)), Status::Sequence);
    assert_eq!(made!(zpgs_start(open.0)), Status::Sequence);
    assert!(open.text().contains("zpgs_prepare"), "{}", open.text());
    assert_eq!(open.submit(&arrays(&mut left), &all), Status::Ok, "{}", open.text());
    assert_eq!(wait_and_start(&arrays(&mut left)), refused, "nothing is prepared");
    assert_eq!(prepare(&arrays(&mut right)), Status::Ok, "{}", open.text());
    assert_eq!(made!(zpgs_start(open.0)), Status::Sequence, "a step is in flight");
    assert_eq!(wait_and_start(&arrays(&mut left)), (Status::Ok, Status::Ok), "{}", open.text());
    assert_eq!(left, stepped());
    assert_eq!(open.wait(&arrays(&mut right)), Status::Ok, "{}", open.text());
    assert_eq!(right, stepped());
    // Its records are still there.
    let mut again = world();
    assert_eq!(made!(zpgs_start(open.0)), Status::Ok, "{}", open.text());
    assert_eq!(open.wait(&arrays(&mut again)), Status::Ok, "{}", open.text());
    assert_eq!(again, stepped());
    assert_eq!(wait_and_start(&arrays(&mut again)), refused, "none is in flight");
    // A start that is refused leaves the results of the step before in place.
    let (mut left, mut right) = (world(), world());
    assert_eq!(open.submit(&arrays(&mut left), &all), Status::Ok, "{}", open.text());
    assert_eq!(prepare(&arrays(&mut right)), Status::Ok, "{}", open.text());
    open.cancel();
    let (done, started) = wait_and_start(&arrays(&mut left));
    assert_eq!((done, started), (Status::Cancelled, Status::Cancelled), "{}", open.text());
    assert_eq!((left, right), (world(), world()));
    assert_eq!(open.wait(&arrays(&mut right)), Status::Sequence, "no step is in flight");
}

#[test]
fn a_cancellation_ends_one_step() {
    let (open, mut crates, all) = (Open::new("emulated:float"), world(), [collision()]);
    let (bodies, all) = (arrays(&mut crates), collisions(&all));
    open.cancel();
    assert_eq!(open.step(&bodies, &all, &defaults()), Status::Cancelled);
    assert!(open.text().contains("cancel"), "{}", open.text());
    assert_eq!(open.submit(&bodies, &all), Status::Ok, "{}", open.text());
    open.cancel();
    assert_eq!(open.wait(&bodies), Status::Cancelled);
    assert_eq!(crates, world());
    assert_eq!(open.step(&arrays(&mut crates), &all, &defaults()), Status::Ok, "{}", open.text());
    assert_eq!(crates, stepped());
}

#[test]
fn refused_input_is_named_with_its_cause_and_leaves_the_bodies() {
    let (open, mut crates) = (Open::new("emulated:float"), world());
    let all = [Collision { body_b: 5, ..collision() }];
    assert_eq!(open.step(&arrays(&mut crates), &collisions(&all), &defaults()), Status::Input);
    assert!(open.text().contains('5'), "{}", open.text());
    let negative = Parameters { time_step: -1.0, ..defaults() };
    let all = [collision()];
    assert_eq!(open.step(&arrays(&mut crates), &collisions(&all), &negative), Status::Input);
    assert_eq!(crates, world());
    let shapes = [Shape { inverse_mass: f32::NAN, ..SHAPES[1] }];
    assert_eq!(open.set_shapes(&shapes), Status::Input);
    assert_eq!(open.step(&arrays(&mut crates), &collisions(&all), &defaults()), Status::Ok);
}

#[test]
fn a_board_that_cannot_be_opened_is_a_status_a_text_and_a_null_handle() {
    for (board, named) in
        [(c"no such board", "no such board"), (c"emulated:fast", "fast"), (c"\xff", "UTF-8")]
    {
        let mut handle = std::ptr::dangling_mut();
        let status = made!(zpgs_open(board.as_ptr(), &raw mut handle));
        let expected = if named == "UTF-8" { Status::Argument } else { Status::Open };
        assert_eq!((status, handle), (expected, null_mut()));
        let text = text(made!(zpgs_last_error(null())));
        assert!(text.contains(named), "{text}");
    }
}

#[test]
fn a_null_pointer_is_a_status_wherever_it_comes() {
    let (open, mut crates, all) = (Open::new("emulated:float"), world(), [collision()]);
    let (bodies, all, parameters) = (arrays(&mut crates), collisions(&all), defaults());
    let (b, c, p) = (&raw const bodies, &raw const all, &raw const parameters);
    let mut handle = null_mut();
    let statuses = [
        made!(zpgs_open(null(), &raw mut handle)),
        made!(zpgs_open(c"emulated".as_ptr(), null_mut())),
        made!(zpgs_set_shapes(null_mut(), SHAPES.as_ptr(), 2)),
        made!(zpgs_set_shapes(open.0, null(), 2)),
        made!(zpgs_parameters_default(null_mut(), size_of::<Parameters>())),
        made!(zpgs_step(null_mut(), b, c, p, null_mut())),
        made!(zpgs_step(open.0, null(), c, p, null_mut())),
        made!(zpgs_step(open.0, b, null(), p, null_mut())),
        made!(zpgs_step(open.0, b, c, null(), null_mut())),
        made!(zpgs_submit(null_mut(), b, c, p)),
        made!(zpgs_submit(open.0, null(), c, p)),
        made!(zpgs_submit(open.0, b, null(), p)),
        made!(zpgs_submit(open.0, b, c, null())),
        made!(zpgs_wait(null_mut(), b, null_mut())),
        made!(zpgs_wait(open.0, null(), null_mut())),
        made!(zpgs_cancel(null())),
    ];
    assert_eq!(statuses, [Status::NullPointer; 16]);
    assert_eq!(made!(zpgs_close(null_mut())), Status::Ok);
    let mut positions = bodies;
    positions.positions.data = null_mut();
    assert_eq!(open.step(&positions, &all, &parameters), Status::NullPointer);
    assert!(open.text().contains("positions"), "{}", open.text());
    let mut nothing = all;
    nothing.collisions.data = null();
    assert_eq!(open.step(&bodies, &nothing, &parameters), Status::NullPointer);
    nothing.count = 0;
    assert_eq!(open.step(&bodies, &nothing, &parameters), Status::Ok, "no collision, no address");
}

#[test]
fn an_array_that_is_misaligned_or_too_large_or_overlaps_itself_is_refused() {
    let (open, mut crates, all) = (Open::new("emulated:float"), world(), [collision()]);
    let (bodies, all, parameters) = (arrays(&mut crates), collisions(&all), defaults());
    let refused = |bodies: &BodyArrays, all: &CollisionArray, named: &str| {
        assert_eq!(open.step(bodies, all, &parameters), Status::Argument, "{named}");
        assert!(open.text().contains(named), "{}: {named}", open.text());
    };
    let mut odd = bodies;
    odd.orientations.data = odd.orientations.data.wrapping_byte_add(1);
    refused(&odd, &all, "orientations");
    for stride in [0, 8, 13] {
        let mut close = bodies;
        close.linear_velocities.stride = stride;
        refused(&close, &all, "linear velocities");
    }
    let mut wide = bodies;
    wide.angular_velocities.stride = usize::MAX - 3;
    refused(&wide, &all, "angular velocities");
    let mut many = all;
    many.count = usize::MAX;
    refused(&bodies, &many, "collisions");
    assert_eq!(made!(zpgs_set_shapes(open.0, SHAPES.as_ptr(), usize::MAX)), Status::Argument);
    refused(&BodyArrays { size: 3, ..bodies }, &all, "sizeof(zpgs_bodies)");
    let mut report = Report::default();
    let status = made!(zpgs_step(
        open.0,
        &raw const bodies,
        &raw const all,
        &raw const parameters,
        &raw mut report
    ));
    assert_eq!(status, Status::Argument, "a report without a size");
    assert_eq!(crates, world());
}

#[test]
fn a_pair_has_the_friction_that_its_count_carries() {
    let count = zpgs_count_with_friction(4, 0.5);
    let contacts = [zynq_pgs::Contact::default(); 4];
    let carried = zynq_pgs::Collision { body_a: 0, body_b: 1, normal: [0.0; 3], count, contacts };
    assert_eq!((carried.points(), carried.friction().to_bits()), (4, 0.5_f32.to_bits()));
}
