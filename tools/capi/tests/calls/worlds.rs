//! Worlds that share an accelerator, and worlds in doubles.

use std::ptr::from_ref;

use zynq_pgs_c::*;

use crate::support::*;

/// The shapes of a world whose cube has five times the mass and turns less.
const HEAVY: [Shape; 2] = [SHAPES[0], Shape { inverse_mass: 0.2, inverse_inertia: [0.25; 3] }];

fn arrays_with<'a>(crates: &'a mut [Crate], table: &'a [Shape]) -> BodyArrays {
    BodyArrays { table: table.as_ptr(), table_count: table.len(), ..arrays(crates) }
}

/// A world after `steps` steps on an accelerator of its own.
fn alone(shapes: &[Shape], steps: usize) -> [Crate; 2] {
    let (open, mut crates, all) = (Open::new("emulated:float"), world(), [collision()]);
    assert_eq!(open.set_shapes(shapes), Status::Ok);
    for _ in 0..steps {
        let status = open.step(&arrays(&mut crates), &collisions(&all), &defaults());
        assert_eq!(status, Status::Ok, "{}", open.text());
    }
    crates
}

#[test]
fn worlds_with_shapes_of_their_own_take_turns_on_an_accelerator() {
    let (open, all) = (Open::new("emulated:float"), [collision()]);
    let (mut light, mut heavy) = (world(), world());
    for _ in 0..3 {
        for (crates, table) in [(&mut light, &SHAPES), (&mut heavy, &HEAVY)] {
            let bodies = arrays_with(crates, table);
            let status = open.step(&bodies, &collisions(&all), &defaults());
            assert_eq!(status, Status::Ok, "{}", open.text());
        }
    }
    assert_ne!(light, heavy);
    assert_eq!((light, heavy), (alone(&SHAPES, 3), alone(&HEAVY, 3)));
}

#[test]
fn a_step_is_prepared_for_the_shapes_of_the_one_in_flight_alone() {
    let (open, all) = (Open::new("emulated:float"), [collision()]);
    let (mut left, mut right) = (world(), world());
    let (all, parameters) = (collisions(&all), defaults());
    let prepare = |bodies: &BodyArrays| {
        made!(zpgs_prepare(open.0, from_ref(bodies), from_ref(&all), from_ref(&parameters)))
    };
    assert_eq!(prepare(&arrays_with(&mut right, &HEAVY)), Status::Sequence, "none is in flight");
    let mut light = world();
    assert_eq!(open.step(&arrays(&mut light), &all, &parameters), Status::Ok, "{}", open.text());
    assert_eq!(light, alone(&SHAPES, 1), "the refused step has loaded no shapes");
    assert_eq!(open.submit(&arrays_with(&mut left, &HEAVY), &all), Status::Ok, "{}", open.text());
    assert_eq!(prepare(&arrays_with(&mut right, &SHAPES)), Status::Sequence);
    assert!(open.text().contains("one table of all shapes"), "{}", open.text());
    assert_eq!(prepare(&arrays_with(&mut right, &HEAVY)), Status::Ok, "{}", open.text());
    assert_eq!(open.wait(&arrays(&mut left)), Status::Ok, "{}", open.text());
    assert_eq!(made!(zpgs_start(open.0)), Status::Ok, "{}", open.text());
    assert_eq!(open.wait(&arrays(&mut right)), Status::Ok, "{}", open.text());
    assert_eq!((left, right), (alone(&HEAVY, 1), alone(&HEAVY, 1)));
}

#[test]
fn the_bytes_behind_an_older_structure_are_the_callers() {
    #[repr(C)]
    struct Older {
        bodies: [usize; 12],
        report: Report,
    }
    let (open, mut crates, all) = (Open::new("emulated:float"), world(), [collision()]);
    let whole = BodyArrays { size: size_of::<[usize; 12]>(), ..arrays(&mut crates) };
    // SAFETY: the structure is longer than its first 12 words, which are initialised.
    let bodies = unsafe { from_ref(&whole).cast::<[usize; 12]>().read() };
    let report = Report { size: size_of::<Report>(), ..Report::default() };
    let mut older = Older { bodies, report };
    let (bodies, report) = ((&raw const older.bodies).cast(), &raw mut older.report);
    let (all, parameters) = (collisions(&all), defaults());
    let status = made!(zpgs_step(open.0, bodies, from_ref(&all), from_ref(&parameters), report));
    assert_eq!(status, Status::Ok, "{}", open.text());
    assert_eq!((crates, older.report.bodies), (stepped(), 2));
}

/// The numbers of a body in doubles: position, orientation, both velocities.
type Doubles = [f64; 13];

fn doubles(of: &Crate, origin: [f64; 3]) -> Doubles {
    let [x, y, z] = of.position.map(f64::from);
    let position = [x + origin[0], y + origin[1], z + origin[2]];
    let rest = of.orientation.into_iter().chain(of.linear).chain(of.angular).map(f64::from);
    let mut all = position.into_iter().chain(rest);
    std::array::from_fn(|_| all.next().expect("13 numbers"))
}

/// The numbers after a step in doubles.
fn step_of_doubles(origin: [f64; 3]) -> [Doubles; 2] {
    let (open, all) = (Open::new("emulated:float"), [collision()]);
    let mut crates = world();
    let mut given = crates.map(|body| doubles(&body, origin));
    let first = given.as_mut_ptr().cast::<f64>();
    let column = |at| Strided { data: first.wrapping_add(at).cast(), stride: size_of::<Doubles>() };
    let bodies = BodyArrays {
        positions: column(0),
        orientations: column(3),
        linear_velocities: column(7),
        angular_velocities: column(10),
        number_size: 8,
        origin,
        ..arrays(&mut crates)
    };
    let step = |bodies| open.step(&bodies, &collisions(&all), &defaults());
    assert_eq!(step(BodyArrays { number_size: 2, ..bodies }), Status::Argument);
    assert!(open.text().contains("number_size"), "{}", open.text());
    let odd = Strided { stride: 4 * 25, ..bodies.positions };
    assert_eq!(step(BodyArrays { positions: odd, ..bodies }), Status::Argument, "{}", open.text());
    assert_eq!(step(bodies), Status::Ok, "{}", open.text());
    given
}

#[test]
fn doubles_give_the_bits_of_floats_also_far_from_zero() {
    let bits = |all: [Doubles; 2]| all.map(|body| body.map(f64::to_bits));
    // A double holds the sum of a position and of either place without rounding.
    for origin in [[0.0; 3], [1e6, -65_536.0, 4096.0]] {
        let expected = stepped().map(|body| doubles(&body, origin));
        assert_eq!(bits(step_of_doubles(origin)), bits(expected), "{origin:?}");
    }
}
