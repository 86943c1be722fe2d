//! A step through the C interface has the bits of the driver.

use std::ffi::c_void;
use std::ptr::{from_ref, null, null_mut};

use zynq_pgs::{Accelerator, Body, OpenOptions, Pose, StepParameters, Velocity};
use zynq_pgs_c::*;

use crate::support::*;

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

/// The impulses that come out of two steps of the driver. The second begins with the impulses of
/// the first.
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
fn impulses_come_by_place_from_the_step_that_was_committed() {
    let (open, mut crates, all) = (Open::new("emulated:float"), world(), [collision()]);
    let parameters = Parameters { warm_start: 1, impulses_out: 1, ..defaults() };
    let driver = StepParameters::default().with_warm_start(true).with_impulses_out(true);
    let place = |collision, point| [Place { collision, points: [point; ZPGS_CONTACT_POINTS] }];
    let same = [Place { collision: 0, points: [0, 1, 2, 3] }];
    let given = |places: &[Place; 1], world| {
        let impulses = StridedConst { data: null(), stride: 0 };
        CollisionArray { impulses, places: places.as_ptr(), factor: 1.0, world, ..collisions(&all) }
    };
    let new = place(ZPGS_NEW_COLLISION, ZPGS_NEW_POINT);
    assert_eq!(open.step(&arrays(&mut crates), &given(&same, 7), &parameters), Status::Input);
    assert!(open.text().contains("that step had 0 collisions"), "{}", open.text());
    let mut out = [Impulses::default()];
    for (places, expected) in [&new, &same].into_iter().zip(warm_steps(&driver)) {
        let all = given(places, 7);
        let status = open.step(&arrays(&mut crates), &all, &parameters);
        assert_eq!(status, Status::Ok, "{}", open.text());
        let into = Strided { data: out.as_mut_ptr().cast(), stride: size_of::<Impulses>() };
        assert_eq!(made!(zpgs_read_impulses(open.0, into, 1)), Status::Ok, "{}", open.text());
        assert_eq!((out[0].normal, out[0].friction), (expected.normal, expected.friction));
        assert_eq!(made!(zpgs_commit(open.0, &raw const all)), Status::Ok, "{}", open.text());
    }
    // Another world has another last step.
    assert_eq!(open.step(&arrays(&mut crates), &given(&same, 8), &parameters), Status::Input);
    let cold = CollisionArray { factor: 0.0, ..given(&same, 7) };
    assert_eq!(open.step(&arrays(&mut crates), &cold, &parameters), Status::Argument);
    assert!(open.text().contains("with 0 as the factor"), "{}", open.text());
    assert_eq!(open.step(&arrays(&mut crates), &cold, &defaults()), Status::Ok, "not warm");
    let wrong = place(0, 4);
    assert_eq!(open.step(&arrays(&mut crates), &given(&wrong, 7), &parameters), Status::Input);
    assert!(open.text().contains("contact point 0"), "{}", open.text());
    let none = CollisionArray { count: 0, ..given(&same, 7) };
    assert_eq!(made!(zpgs_commit(open.0, &raw const none)), Status::Input);
    assert!(open.text().contains("found 1 impulses of 0 collisions"), "{}", open.text());
    let mut both = given(&same, 7);
    both.impulses = StridedConst { data: out.as_ptr().cast(), stride: size_of::<Impulses>() };
    assert_eq!(open.step(&arrays(&mut crates), &both, &parameters), Status::Argument);
    assert!(open.text().contains("set one of them to null"), "{}", open.text());
    assert_eq!(made!(zpgs_forget(open.0, 7)), Status::Ok, "{}", open.text());
    assert_eq!(open.step(&arrays(&mut crates), &given(&same, 7), &parameters), Status::Input);
    assert!(open.text().contains("that step had 0 collisions"), "{}", open.text());
    assert_eq!(made!(zpgs_forget(open.0, 7)), Status::Ok, "nothing is kept");
}

#[test]
fn a_pair_has_the_friction_that_its_count_carries() {
    let count = zpgs_count_with_friction(4, 0.5);
    let contacts = [zynq_pgs::Contact::default(); 4];
    let carried = zynq_pgs::Collision { body_a: 0, body_b: 1, normal: [0.0; 3], count, contacts };
    assert_eq!((carried.points(), carried.friction().to_bits()), (4, 0.5_f32.to_bits()));
}

#[test]
fn the_versions_are_those_of_the_header_and_of_the_package() {
    assert_eq!(zpgs_abi_version(), ZPGS_ABI_VERSION);
    assert_eq!(text(zpgs_version()), env!("CARGO_PKG_VERSION"));
}
