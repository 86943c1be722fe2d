//! Tests whole steps on the emulated board, which goes dead at the driver's first mistake.
mod detached;
mod fault;
mod life;
mod memory;
mod mistakes;
mod planned;
mod prepared;
mod prepared_fault;
mod tampered;
mod unplugged;
mod wait;
mod written;

use std::sync::Arc;
use std::time::Duration;

use bitstream_model::{BoardConfig, Direction, EmulatedBoard, Fault as Injected, FaultKind};
use pgs_interface::control::ErrorCode;
use pgs_interface::profile::PROFILES;
use pgs_interface::record::Beat;

use self::tampered::{CONTROL_BLOCK, MEMORY, Tampered};
use crate::board::open::{BoardDescription, BoardKind, Found};
use crate::diagnosis::{Awaited, ChannelFault};
use crate::error::{Aftermath, OpenError};
use crate::platform::{Access, Platform};
use crate::{
    Accelerator, BoardChoice, Body, Collision, Contact, Error, Fault, OpenOptions, Pose, Shape,
    StepParameters, StepReport, Velocity,
};

pub(super) fn open(config: BoardConfig) -> (EmulatedBoard, Accelerator) {
    let board = EmulatedBoard::new(config).expect("a board that can be built");
    let mut accelerator = Accelerator::open(options(&board)).expect("a board that opens");
    accelerator.set_shapes(&SHAPES).expect("shapes that fit");
    (board, accelerator)
}

/// The ground's shape and the cubes'.
const SHAPES: [Shape; 2] = [Shape::STATIC, Shape::isotropic(1.0, 0.4)];

/// A board behind a test's own platform.
fn found(platform: Arc<dyn Platform>) -> Found {
    let (name, reason) = ("between".to_owned(), "a test".to_owned());
    Found { platform, description: BoardDescription { kind: BoardKind::Emulated, name, reason } }
}

/// Opens a board behind a test's own platform.
fn open_on(platform: Arc<dyn Platform>) -> Accelerator {
    let mut accelerator = Accelerator::on(found(platform), None).expect("a board that opens");
    accelerator.set_shapes(&SHAPES).expect("shapes that fit");
    accelerator
}

pub(super) fn options(board: &EmulatedBoard) -> OpenOptions {
    OpenOptions { board: BoardChoice::Emulated(board.cpu_port()), ..OpenOptions::default() }
}

/// A row of cubes that fall on the ground, each with its own speed, each in contact.
pub(super) fn scene(cubes: u32) -> (Vec<Body>, Vec<Collision>) {
    let body = |position, shape, velocity| Body {
        pose: Pose { position, orientation: [0.0, 0.0, 0.0, 1.0] },
        velocity,
        shape,
    };
    let mut bodies = vec![body([0.0, -400.0, 0.0], 0, Velocity::default())];
    let mut collisions = Vec::new();
    for cube in 1..=cubes {
        let x = 2.2 * f32::from(u16::try_from(cube).expect("a small scene"));
        let velocity = Velocity { linear: [0.1 * x, -1.0 - x, 0.3], angular: [0.2, 0.0, -0.1 * x] };
        bodies.push(body([x, 0.99, 0.0], 1, velocity));
        let corner = |dx, dz| Contact { point: [x + dx, -0.01, dz], distance: -0.01 };
        collisions.push(Collision {
            body_a: 0,
            body_b: cube,
            normal: [0.0, -1.0, 0.0],
            count: 4,
            contacts: [corner(-1.0, -1.0), corner(1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0)],
        });
    }
    (bodies, collisions)
}

pub(super) fn bits(bodies: &[Body]) -> Vec<u32> {
    let numbers = |body: &Body| {
        let Pose { position, orientation } = body.pose;
        let Velocity { linear, angular } = body.velocity;
        [position.to_vec(), orientation.to_vec(), linear.to_vec(), angular.to_vec()].concat()
    };
    bodies.iter().flat_map(numbers).map(f32::to_bits).collect()
}

/// Runs one step of a fresh scene.
pub(super) fn step(
    accelerator: &mut Accelerator,
    cubes: u32,
) -> (Result<StepReport, Error>, Vec<Body>) {
    let (mut bodies, collisions) = scene(cubes);
    let result = accelerator.step(&mut bodies, &collisions, &StepParameters::default());
    (result, bodies)
}

pub(super) fn undisturbed(cubes: u32) -> Vec<u32> {
    let (result, bodies) = step(&mut open(BoardConfig::default()).1, cubes);
    result.expect("nothing disturbs it");
    bits(&bodies)
}

#[test]
fn a_step_stops_the_cubes_and_leaves_the_ground() {
    let (board, mut accelerator) = open(BoardConfig::default());
    let (result, bodies) = step(&mut accelerator, 5);
    let report = result.expect("a good step");
    assert_eq!(bits(&bodies[..1]), bits(&scene(5).0[..1]));
    assert!(bodies[1..].iter().all(|body| body.velocity.linear[1] > -1.0));
    assert!(report.impulse_sum.expect("counted") > 0.0);
    assert_eq!(
        report.cycles.total,
        report.cycles.work + report.cycles.stalls + report.cycles.waits
    );
    drop(accelerator);
    assert_eq!(board.violations(), []);
}

/// A step has megabytes, which would flood a log.
#[test]
fn what_an_accelerator_prints_for_debugging_is_no_longer_after_a_longer_step() {
    let printed = |cubes| {
        let (_, mut accelerator) = open(BoardConfig::default());
        step(&mut accelerator, cubes).0.expect("a good step");
        format!("{accelerator:?}")
    };
    let (short, long) = (printed(5), printed(500));
    assert!(short.contains("emulated") && short.contains("collisions: 5,"), "{short}");
    assert!(long.contains("collisions: 500,"), "{long}");
    // The numbers of a large step have more digits.
    assert!(long.len() < short.len() + 100, "{} and {} characters", short.len(), long.len());
}

#[test]
fn a_steady_step_costs_39_accesses_with_wide_addresses_and_31_with_narrow_ones() {
    for (address_width, accesses) in [(40, 39), (32, 31)] {
        let (board, mut accelerator) =
            open(BoardConfig { address_width, ..BoardConfig::default() });
        step(&mut accelerator, 9).0.expect("the first step");
        for cubes in [8, 7, 9] {
            let before = board.counts();
            let report = step(&mut accelerator, cubes).0.expect("a later step");
            let after = board.counts();
            assert_eq!(report.register_reads, after.register_reads - before.register_reads);
            assert_eq!(report.register_writes, after.register_writes - before.register_writes);
            // B changes here beside C.
            assert_eq!(report.register_reads + report.register_writes, accesses + 1);
            assert_eq!((report.doorbells, report.interrupts), (9, 1));
            assert_eq!(after.doorbells - before.doorbells, 9);
            assert_eq!(after.interrupts - before.interrupts, 1);
            assert_eq!(after.descriptors - before.descriptors, report.descriptors);
            assert_eq!(report.descriptors, 4 * 10 + 4);
            assert_eq!((after.beats_read - before.beats_read) * 16, report.bytes_to_device);
            assert_eq!((after.beats_written - before.beats_written) * 16, report.bytes_from_device);
        }
    }
}

#[test]
fn every_length_and_address_width_gives_the_same_bits() {
    let expected = undisturbed(30);
    for (length_width, address_width) in [(8, 32), (8, 64), (10, 40), (14, 36), (26, 32)] {
        let (board, mut accelerator) =
            open(BoardConfig { length_width, address_width, ..BoardConfig::default() });
        for _ in 0..3 {
            let (result, bodies) = step(&mut accelerator, 30);
            result.unwrap_or_else(|error| panic!("{error}: {:?}", board.violations()));
            assert_eq!(bits(&bodies), expected, "{length_width} {address_width}");
        }
    }
}

#[test]
fn steps_of_any_size_follow_each_other() {
    let (board, mut accelerator) = open(BoardConfig { length_width: 8, ..BoardConfig::default() });
    for cubes in [1, 40, 3, 2, 90, 1, 91] {
        let (result, bodies) = step(&mut accelerator, cubes);
        result.unwrap_or_else(|error| panic!("{error}: {:?}", board.violations()));
        assert_eq!(bits(&bodies), undisturbed(cubes), "{cubes} cubes");
    }
}

#[test]
fn bodies_without_collisions_and_collisions_without_passes_are_steps_too() {
    let (_, mut accelerator) = open(BoardConfig::default());
    let (mut bodies, collisions) = scene(1);
    let none: [Collision; 0] = [];
    let parameters = StepParameters::default();
    // One body: two channels have no packet to send.
    let mut one = vec![bodies[1]];
    let report = accelerator.step(&mut one, &none[..], &parameters).expect("one body falls");
    assert_eq!((report.doorbells, report.descriptors), (1 + 4 + 2, 4 + 4));
    assert!(one[0].velocity.linear[1] < bodies[1].velocity.linear[1]);
    let parameters = StepParameters {
        contact_iterations: 0,
        friction_iterations: 0,
        integrate: false,
        ..StepParameters::default()
    };
    let before = bits(&bodies);
    accelerator.step(&mut bodies, &collisions, &parameters).expect("no passes");
    assert_eq!(bits(&bodies), before, "nothing solved, nothing integrated");
}

/// The stream's sixteen bits would round the pose of a cube at 2.2 m; the caller's own pose must
/// stay.
#[test]
fn without_integration_every_profile_leaves_the_poses_as_they_are() {
    let parameters = StepParameters { integrate: false, ..StepParameters::default() };
    for profile in PROFILES {
        let (_, mut accelerator) = open(BoardConfig { profile, ..BoardConfig::default() });
        let (mut bodies, collisions) = scene(3);
        let before = bodies.clone();
        accelerator.step(&mut bodies, &collisions, &parameters).expect("a step");
        for (found, given) in bodies.iter().zip(&before) {
            let bits =
                |pose: Pose| (pose.position.map(f32::to_bits), pose.orientation.map(f32::to_bits));
            assert_eq!(bits(found.pose), bits(given.pose), "{}", profile.name);
        }
        assert_ne!(bodies[1].velocity, before[1].velocity, "{}", profile.name);
    }
}

/// The velocity in y of a ball after a step that it enters with `speed`. The distance of its
/// contact with the ground stands for a velocity.
fn after_contact(speed: f32, distance: f32) -> f32 {
    let (_, mut accelerator) = open(BoardConfig::default());
    let (mut bodies, mut collisions) = scene(1);
    bodies[1].velocity = Velocity { linear: [0.0, speed, 0.0], angular: [0.0; 3] };
    collisions[0].count = 1;
    collisions[0].contacts[0] = Contact { point: [2.2, -0.01, 0.0], distance };
    let mut parameters = StepParameters { integrate: false, ..StepParameters::default() };
    parameters.position_drift = 0.0;
    parameters.position_coefficient = parameters.time_step;
    accelerator.step(&mut bodies, &collisions, &parameters).expect("a step");
    bodies[1].velocity.linear[1]
}

#[test]
fn a_distance_is_a_velocity_where_the_coefficient_is_the_time_step() {
    for (speed, distance, expected) in [
        // Bodies part with at least this velocity.
        (0.0, -2.0, 2.0),
        (-7.0, -2.0, 2.0),
        (5.0, -2.0, 5.0),
        // Bodies may approach with this velocity, and not faster.
        (-7.0, 3.0, -3.0),
        (-2.5, 3.0, -2.5),
        (-7.0, 0.0, 0.0),
    ] {
        let found: f32 = after_contact(speed, distance);
        assert!((found - expected).abs() < 1e-5, "{speed} {distance}: {found}");
    }
}

#[test]
fn refused_input_reaches_no_register() {
    let (board, mut accelerator) = open(BoardConfig::default());
    let before = board.counts();
    let (mut bodies, mut collisions) = scene(3);
    collisions[1].body_b = 4;
    let as_before = bits(&bodies);
    let error = accelerator
        .step(&mut bodies, &collisions, &StepParameters::default())
        .expect_err("there is no body 4");
    assert!(error.is_input() && !error.may_retry() && !error.must_reopen());
    assert!(accelerator.set_shapes(&[]).expect_err("no shapes").is_input());
    let after = board.counts();
    assert_eq!(after.register_reads, before.register_reads);
    assert_eq!(after.register_writes, before.register_writes);
    assert_eq!(bits(&bodies), as_before);
}

/// Injects a fault into a step. Checks that it changes nothing, and that the next step is
/// undisturbed.
fn survives(injected: Injected, seen: impl Fn(&Fault) -> bool) {
    let (board, mut accelerator) = open(BoardConfig::default());
    step(&mut accelerator, 20).0.expect("before the fault");
    board.inject(injected);
    let (result, bodies) = step(&mut accelerator, 20);
    let error = result.expect_err("a fault");
    let Error::Step { fault, aftermath, .. } = &error else { panic!("{error}") };
    assert!(seen(fault), "{fault}");
    assert_eq!(*aftermath, Aftermath::Ready, "{fault}");
    assert!(error.may_retry());
    assert_eq!(bits(&bodies), bits(&scene(20).0), "the bodies are as they were");
    for _ in 0..2 {
        let (result, bodies) = step(&mut accelerator, 20);
        result.unwrap_or_else(|error| panic!("{error}: {:?}", board.violations()));
        assert_eq!(bits(&bodies), undisturbed(20), "after {injected:?}");
    }
    drop(accelerator);
    assert_eq!(board.violations(), [], "after {injected:?}");
}

const BOTH: [Direction; 2] = [Direction::Mm2s, Direction::S2mm];

#[test]
fn a_decode_error_on_any_channel_is_told_by_name_and_survived() {
    for core in 0..4 {
        for direction in BOTH {
            survives(Injected::new(FaultKind::DmaDecErr).on(core, direction), |fault| {
                let Fault::Channel { cause: ChannelFault::DmaDecode, at } = fault else {
                    return false;
                };
                (at.channel.core, at.channel.direction) == (core, direction)
                    && at.descriptor.is_some_and(|descriptor| descriptor.status.failed())
            });
        }
    }
}

#[test]
fn a_channel_that_stalls_for_ever_ends_at_the_deadline() {
    for core in 0..4 {
        for direction in BOTH {
            survives(Injected::new(FaultKind::Stall).on(core, direction), |fault| {
                matches!(fault, Fault::Deadline { awaited: Awaited::Results, .. })
            });
        }
    }
}

#[test]
fn every_sticky_error_of_the_accelerator_is_decoded_and_survived() {
    for code in ErrorCode::ALL {
        survives(
            Injected::new(FaultKind::AcceleratorError { code }),
            |fault| matches!(fault, Fault::Accelerator(error) if error.code == Some(code)),
        );
    }
}

#[test]
fn without_interrupts_steps_are_found_by_looking_and_soon_more_often() {
    let (board, tampered, mut accelerator) = Tampered::open();
    tampered.wires().wait_limit = Some(Duration::MAX);
    let mut times = Vec::new();
    for _ in 0..4 {
        let before = tampered.now();
        let (result, bodies) = step(&mut accelerator, 20);
        assert_eq!(result.expect("found by looking").interrupts, 0);
        assert_eq!(bits(&bodies), undisturbed(20));
        times.push(tampered.now() - before);
    }
    // The first step takes one polling interval; later steps no longer rely on the interrupt.
    assert!(times[0] >= Duration::from_millis(10) && times[0] < Duration::from_millis(12));
    assert!(times[3] < Duration::from_millis(2), "{times:?}");
    // The interrupt comes back, and the driver relies on it again.
    tampered.wires().wait_limit = None;
    step(&mut accelerator, 20).0.expect("a step");
    let report = step(&mut accelerator, 20).0.expect("a step");
    assert_eq!((report.interrupts, report.register_reads + report.register_writes), (1, 38));
    assert_eq!(board.violations(), []);
}

#[test]
fn receivers_start_before_the_accelerator_and_it_before_the_senders() {
    let (_, tampered, mut accelerator) = Tampered::open();
    step(&mut accelerator, 20).0.expect("the first step");
    tampered.wires().writes.clear();
    step(&mut accelerator, 20).0.expect("a step");
    // The low word, then the upper word, which starts the engine; last the acknowledgement of the
    // completion.
    let tails = |low, high| (0..4).flat_map(move |core| [(core, low), (core, high)]);
    let expected: Vec<_> = tails(0x40, 0x44)
        .chain([(CONTROL_BLOCK, 0x00)])
        .chain(tails(0x10, 0x14))
        .chain([(3, 0x34)])
        .collect();
    let mut writes = tampered.wires().writes.clone();
    writes.retain(|(region, _)| *region != MEMORY);
    assert_eq!(writes, expected);
}

#[test]
fn a_bit_that_flips_on_the_way_is_found_by_the_sums() {
    let (_, tampered, mut accelerator) = Tampered::open();
    for (access, way) in [(Access::Read, Direction::Mm2s), (Access::Write, Direction::S2mm)] {
        tampered.wires().spoil = Some((access, |beats| beats[0].0[0] ^= 1 << 4));
        let (result, bodies) = step(&mut accelerator, 20);
        let error = result.expect_err("a flipped bit");
        let Error::Step { fault, .. } = &error else { panic!("{error}") };
        assert!(
            matches!(**fault, Fault::Checksum { direction, .. } if direction == way),
            "{fault}"
        );
        assert!(error.may_retry());
        assert_eq!(bits(&bodies), bits(&scene(20).0));
        let (result, bodies) = step(&mut accelerator, 20);
        result.expect("the next step is undisturbed");
        assert_eq!(bits(&bodies), undisturbed(20));
    }
}

/// A change to the words of a transfer.
type Spoil = fn(&mut [Beat]);

/// The sums of all words stay right: nothing but the numbers tells.
#[test]
fn a_queue_whose_numbers_are_no_permutation_fails_the_step_and_changes_nothing() {
    let queue = Some(64);
    let board = EmulatedBoard::new(BoardConfig { queue, ..BoardConfig::default() });
    let (tampered, mut accelerator) = Tampered::on(&board.expect("a board that can be built"));
    let parameters = StepParameters {
        order: Some(crate::order::Order::Interleaved),
        ..StepParameters::default().with_impulses_out(true)
    };
    let (mut bodies, collisions) = scene(20);
    accelerator.step(&mut bodies, &collisions, &parameters).expect("a step");
    let (before, impulses) = (bits(&bodies), accelerator.impulses().to_vec());
    // On a static ground nothing waits: beat 4 has the numbers 0 to 3.
    let spoils: [(Spoil, &str); 2] = [
        (|beats| beats[4].0 = [1, 1, 2, 2], "found number 1 at place 1, for the second time"),
        (|beats| beats[4].0 = [20, 1_u32.wrapping_sub(20), 2, 3], "found number 20 at place 0"),
    ];
    for (spoil, says) in spoils {
        tampered.wires().spoil = Some((Access::Write, spoil));
        let error = accelerator.step(&mut bodies, &collisions, &parameters).expect_err("wrong");
        let Error::Step { fault, aftermath: Aftermath::Ready, .. } = &error else {
            panic!("{error}")
        };
        assert_eq!(fault.name(), "impulse-number");
        assert!(fault.to_string().contains(says), "{fault}");
        assert_eq!(bits(&bodies), before);
        assert_eq!(accelerator.impulses(), impulses);
    }
    let mut twice = bodies.clone();
    accelerator.step(&mut bodies, &collisions, &parameters).expect("the next step");
    tampered.wires().spoil = Some((Access::Write, spoils[0].0));
    let parameters = parameters.with_retries(1);
    accelerator.step(&mut twice, &collisions, &parameters).expect("another try");
    assert_eq!(bits(&twice), bits(&bodies));
}

#[test]
fn a_scene_that_diverges_is_refused_with_the_body_and_needs_no_reset() {
    let (board, mut accelerator) = open(BoardConfig::default());
    let (mut bodies, collisions) = scene(4);
    bodies[3].velocity.angular = [3.0e38, 3.0e38, -3.0e38];
    bodies[3].velocity.linear = [3.0e38, -3.0e38, 3.0e38];
    let before = bits(&bodies);
    let error = accelerator
        .step(&mut bodies, &collisions, &StepParameters::default())
        .expect_err("beyond f32");
    let Error::Step { fault, aftermath: Aftermath::Untouched, .. } = &error else {
        panic!("{error}")
    };
    assert!(matches!(**fault, Fault::NotFinite { body: 3 }), "{fault}");
    assert!(!error.may_retry() && !error.must_reopen());
    assert_eq!(bits(&bodies), before);
    let (result, bodies) = step(&mut accelerator, 4);
    result.expect("the next step");
    assert_eq!(bits(&bodies), undisturbed(4));
    assert_eq!(board.violations(), []);
}

#[test]
fn a_board_that_is_no_board_any_more_must_be_opened_again() {
    let (board, mut accelerator) = open(BoardConfig::default());
    // The strict board goes dead after an access that no register answers.
    let port = board.cpu_port();
    port.write32(0xA004_0FF0, 1);
    assert_eq!(board.violations().len(), 1);
    let (result, bodies) = step(&mut accelerator, 3);
    let error = result.expect_err("all ones");
    assert!(error.must_reopen() && !error.may_retry(), "{error}");
    assert_eq!(bits(&bodies), bits(&scene(3).0));
    assert!(matches!(step(&mut accelerator, 3).0, Err(Error::MustReopen)));
    assert!(matches!(accelerator.set_shapes(&[Shape::STATIC]), Err(Error::MustReopen)));
    let again = Accelerator::open(options(&board)).expect_err("still dead");
    assert!(matches!(again, Error::Open(OpenError::Identity(_))), "{again}");
}

#[test]
fn a_deadline_that_is_too_short_says_what_was_awaited() {
    let (_, mut accelerator) = open(BoardConfig::default());
    let (mut bodies, collisions) = scene(20);
    let deadline = Some(Duration::from_nanos(1));
    let parameters = StepParameters { deadline, ..StepParameters::default() };
    let error = accelerator.step(&mut bodies, &collisions, &parameters).expect_err("no time");
    let Error::Step { fault, .. } = &error else { panic!("{error}") };
    let text = fault.to_string();
    assert!(matches!(**fault, Fault::Deadline { .. }), "{text}");
    let diagnosis = error.diagnosis().expect("the board has a part in it");
    assert_eq!(diagnosis.channels.len(), 8);
    assert!(diagnosis.elapsed >= Duration::from_nanos(1), "{:?}", diagnosis.elapsed);
    assert_eq!(bits(&bodies), bits(&scene(20).0));
    let (result, bodies) = step(&mut accelerator, 20);
    result.expect("the next step has time");
    assert_eq!(bits(&bodies), undisturbed(20));
}

#[test]
fn a_length_width_that_the_cores_do_not_have_is_refused() {
    let board = EmulatedBoard::new(BoardConfig::default()).expect("a board that can be built");
    let open =
        |length_width| Accelerator::open(OpenOptions { length_width, ..options(&board) }).map(drop);
    let error = open(Some(14)).expect_err("the cores have 26 bits");
    assert!(
        matches!(
            error,
            Error::Open(OpenError::Core(crate::diagnosis::DmaError::LengthWidth {
                expected: 14,
                found: 26,
                ..
            }))
        ),
        "{error}"
    );
    assert!(matches!(open(Some(7)), Err(Error::Open(OpenError::LengthWidth { found: 7, .. }))));
    open(Some(26)).expect("the right width");
    open(None).expect("the width that the bitstream says");
    assert_eq!(board.violations(), []);
}

#[test]
fn cores_without_scatter_gather_are_refused() {
    let config = BoardConfig { scatter_gather: false, ..BoardConfig::default() };
    let board = EmulatedBoard::new(config).expect("a board that can be built");
    let error = Accelerator::open(options(&board)).expect_err("direct mode only");
    assert!(
        matches!(
            error,
            Error::Open(OpenError::Core(crate::diagnosis::DmaError::NoScatterGather { .. }))
        ),
        "{error}"
    );
}
