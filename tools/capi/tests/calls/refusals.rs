//! Wrong arguments and wrong input are refused by status and name, and change nothing.

use std::ptr::{from_ref, null, null_mut};

use zynq_pgs_c::*;

use crate::support::*;

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
fn outputs_that_share_bytes_are_refused_and_alternating_arrays_are_not() {
    let (open, mut crates) = (Open::new("emulated:float"), world());
    let all = [collision(), collision()];
    let (bodies, given, parameters) = (arrays(&mut crates), collisions(&all), defaults());
    let mut report = Report { size: size_of::<Report>(), ..Report::default() };
    let step = |bodies: &BodyArrays, all: &CollisionArray, report: *mut Report| {
        let status = made!(zpgs_step(
            open.0,
            from_ref(bodies),
            from_ref(all),
            &raw const parameters,
            report
        ));
        (status, open.text())
    };
    let refused = |(status, text): (Status, String), one: &str, other: &str| {
        assert_eq!(status, Status::Argument, "{one}, {other}");
        assert!(text.contains(&format!("the {one} and the {other} share bytes")), "{text}");
    };
    let none = null_mut();
    let same = BodyArrays { angular_velocities: bodies.linear_velocities, ..bodies };
    refused(step(&same, &given, none), "linear velocities", "angular velocities");
    // The last element of one in the first of the other.
    let mut shifted = bodies;
    shifted.positions.data = bodies.orientations.data.wrapping_byte_add(size_of::<Crate>());
    refused(step(&shifted, &given, none), "positions", "orientations");
    let mut dense = bodies;
    dense.orientations = Strided { data: crates.as_mut_ptr().cast(), stride: 16 };
    refused(step(&dense, &given, none), "orientations", "angular velocities");
    let own_shapes = StridedConst { data: bodies.positions.data, stride: bodies.positions.stride };
    refused(
        step(&BodyArrays { shapes: own_shapes, ..bodies }, &given, none),
        "positions",
        "shapes of the bodies",
    );
    let mut inside = given;
    inside.collisions.data = crates.as_ptr().cast();
    inside.count = 1;
    refused(step(&bodies, &inside, none), "positions", "collisions");
    let mut warm = given;
    warm.impulses = StridedConst { data: bodies.linear_velocities.data, stride: 24 };
    refused(step(&bodies, &warm, none), "positions", "impulses");
    let mut apart = bodies;
    apart.positions = Strided { data: (&raw mut report.cycles).cast(), stride: 12 };
    refused(step(&apart, &given, &raw mut report), "positions", "zpgs_report");
    refused(
        step(&bodies, &given, (&raw const parameters).cast_mut().cast()),
        "zpgs_report",
        "zpgs_parameters",
    );
    assert_eq!(crates, world());

    // Inputs may lie over each other.
    let mut over = given;
    over.impulses = StridedConst { data: all.as_ptr().cast(), stride: 24 };
    let (status, text) = step(&bodies, &over, &raw mut report);
    assert_eq!((status, report.bodies), (Status::Ok, 2), "{text}");
    let mut crates = world();
    let bodies = arrays(&mut crates);
    let same = BodyArrays { angular_velocities: bodies.linear_velocities, ..bodies };
    let resting = BodyArrays { count: 1, ..same };
    let nothing = collisions(&[]);
    let start = |bodies: &BodyArrays, call: unsafe extern "C" fn(_, _, _, _) -> _| {
        made!(call(open.0, from_ref(bodies), &raw const nothing, &raw const parameters))
    };
    assert_eq!(start(&resting, zpgs_submit), Status::Argument);
    assert!(open.text().contains("share bytes"), "{}", open.text());
    assert_eq!(made!(zpgs_begin(open.0)), Status::Ok);
    let end = made!(zpgs_end(open.0, &raw const resting, &raw const parameters));
    assert_eq!(end, Status::Argument, "{}", open.text());
    let apart = BodyArrays { count: 1, ..bodies };
    assert_eq!(start(&apart, zpgs_submit), Status::Ok, "{}", open.text());
    assert_eq!(start(&resting, zpgs_prepare), Status::Argument);
    assert!(open.text().contains("share bytes"), "{}", open.text());
    assert_eq!(open.wait(&resting), Status::Argument);
    let mut started = Status::Ok;
    let ahead = |bodies: &BodyArrays, report: *mut Report, started: *mut Status| {
        made!(zpgs_wait_and_start(open.0, from_ref(bodies), report, started))
    };
    assert_eq!(ahead(&resting, null_mut(), &raw mut started), Status::Argument);
    assert!(open.text().contains("angular velocities"), "{}", open.text());
    let over = bodies.positions.data.cast();
    assert_eq!(ahead(&bodies, null_mut(), over), Status::Argument);
    assert!(open.text().contains("status of the start"), "{}", open.text());
    assert_eq!(crates, world());
    assert_eq!(open.wait(&apart), Status::Ok, "still in flight");
}
