//! The accelerator behind its streams and registers: results, refusals, counters.

use bitstream_model::{Bandwidth, BoardConfig, Direction, Hazards, ViolationKind};
use pgs_interface::axi_dma::dmasr;
use pgs_interface::control::{self, ErrorCode, ap_ctrl, irq};
use pgs_interface::profile::{FLOAT, NAIVE};
use pgs_interface::record::Beat;
use pgs_interface::register::Register;

use crate::common::ring::{EOF, SOF};
use crate::common::scene::{
    AT_REST, Body, Collision, Lane, STATIC, Step, bits, ground_contact, one_cube, result_beats,
};
use crate::common::sg::{Failure, Flight, LONG, Machine, Outcome};
use crate::common::{CORES, microseconds, numbered, without_queue};

const UNLIMITED: Bandwidth = Bandwidth::Unlimited;

fn machine() -> Machine {
    Machine::new(BoardConfig { bandwidth: UNLIMITED, ..without_queue() })
}

#[test]
fn one_cube_on_the_ground_ends_in_bullets_bits() {
    for hazards in [Hazards::Interlocked, Hazards::Unchecked] {
        for profile in [&FLOAT, &NAIVE] {
            let mut machine = Machine::new(BoardConfig { hazards, profile, ..without_queue() });
            let outcome = machine.step(&one_cube()).expect("the step completes");
            let cube = bits(&outcome.bodies[1]);
            assert_eq!(cube[0], [0x3E7F_E9BD, 0x3F7E_B865, 0xBF00_04AA, 0]);
            assert_eq!(cube[1], [0xB729_9ED1, 0x3990_00D2, 0xB721_B401, 0x3F80_0000]);
            assert_eq!(cube[2], [0x39D8_3474, 0xBE27_3CAA, 0xB9E2_8EF9, 0]);
            assert_eq!(cube[3], [0xB9E0_4C29, 0x3835_3825, 0xB9DC_5132, 0]);
            let ground = Body { position: [0.0, -400.0, 0.0], ..AT_REST };
            assert_eq!(bits(&outcome.bodies[0]), bits(&ground));
            machine.host.assert_no_violation();
        }
    }
}

#[test]
fn without_integration_the_velocities_are_those_after_the_last_pass() {
    let mut machine = machine();
    let scene = Step { integrate: false, ..one_cube() };
    let outcome = machine.step(&scene).expect("the step completes");
    let cube = bits(&outcome.bodies[1]);
    assert_eq!(cube[..2], bits(&scene.bodies[1])[..2], "the pose comes back unchanged");
    assert_eq!(cube[2], [0x39D8_3474, 0x3786_2000, 0xB9E2_8EF9, 0]);
    assert_eq!(cube[3], [0xB9E2_9029, 0x3837_0CC0, 0xB9DE_8AE7, 0]);
}

#[test]
fn one_contact_pass_alone_gives_bullets_velocities_after_it() {
    let mut machine = machine();
    let scene = Step { integrate: false, iterations: [1, 0], ..one_cube() };
    let outcome = machine.step(&scene).expect("the step completes");
    let cube = bits(&outcome.bodies[1]);
    assert_eq!(cube[2], [0xB940_21DF, 0x3CE6_1AA6, 0x3947_72CA, 0]);
    assert_eq!(cube[3], [0xBC2B_C1EF, 0x3746_D8B6, 0x3C90_32F2, 0]);
}

#[test]
fn the_impulse_sum_is_that_of_bullets_normal_impulses() {
    let mut machine = machine();
    let outcome = machine.step(&one_cube()).expect("the step completes");
    let [a, b, c] = [0x3DA4_FAD7, 0x3D2E_D0D4, 0x3D24_5516].map(f32::from_bits);
    // 2^-20 N s, rounded down: exact in an f64.
    let units = (f64::from((a + b) + c) * f64::from(1 << 20)).floor();
    let found = u32::try_from(outcome.impulse_sum).expect("a small number");
    assert!((f64::from(found) - units).abs() < 0.5, "{found} {units}");
}

#[test]
fn the_sums_are_those_of_all_words_on_the_streams() {
    for scene in [one_cube(), Step::falling(7), Step::on_ground(9, 30)] {
        let mut machine = machine();
        let outcome = machine.step(&scene).expect("the step completes");
        assert_eq!(outcome.sum_received, scene.sum_of_input(&machine.host.variant()));
        assert_eq!(outcome.sum_sent, outcome.sum_of_results);
        assert_ne!(outcome.sum_received, 0);
    }
}

/// Lets a step fail, checks what an error leaves, and that only a reset revives.
fn assert_refused(
    machine: &mut Machine,
    scene: &Step,
    lanes: &[Lane],
    code: ErrorCode,
    channel: u32,
    detail: u32,
) {
    let failure = machine.step_with(scene, lanes).expect_err("it is refused");
    assert_eq!(failure, Failure::Accelerator(code as u32, channel, detail), "{code:?}");
    let host = &machine.host;
    assert!(irq::ERROR.is_set(host.control(control::ISR)), "the error interrupt");
    let control_value = host.control(control::AP_CTRL);
    assert!(ap_ctrl::DONE.is_set(control_value), "done, {control_value:#x}");
    assert!(ap_ctrl::IDLE.is_set(control_value));
    host.pause(50);
    let before = host.board.counts();
    host.pause(50);
    assert_eq!(host.board.counts().beats_written, before.beats_written, "nothing is sent");
    machine.recover();
    assert_eq!(machine.host.error(), (0, 0, 0));
    machine.host.assert_no_violation();
    let outcome = machine.step(&Step::falling(5)).expect("the next step completes");
    assert_eq!(
        outcome.bodies.iter().map(bits).collect::<Vec<_>>(),
        Step::fallen(5).iter().map(bits).collect::<Vec<_>>()
    );
}

/// Four bodies, body 0 static, and three good collisions; `change` spoils the last of them.
fn spoilt(change: impl FnOnce(&mut Collision)) -> Step {
    let mut scene = Step::on_ground(3, 3);
    change(&mut scene.collisions[2]);
    scene
}

#[test]
fn bad_records_are_refused_with_the_index_of_the_record() {
    let cases = [
        (ErrorCode::BodyIndex, spoilt(|collision| collision.bodies = [0, 4]), 2),
        (ErrorCode::BodyIndex, spoilt(|collision| collision.bodies = [u32::MAX, 1]), 2),
        (ErrorCode::ContactCount, spoilt(|collision| collision.count = 5), 2),
        (ErrorCode::ContactCount, spoilt(|collision| collision.count = u32::MAX), 2),
        (ErrorCode::SelfCollision, spoilt(|collision| collision.bodies = [3, 3]), 2),
    ];
    for (code, scene, detail) in cases {
        let mut machine = machine();
        assert_refused(&mut machine, &scene, &scene.lanes(), code, 0, detail);
    }
    let mut scene = Step::on_ground(3, 3);
    scene.bodies[2].shape = STATIC;
    assert_refused(&mut machine(), &scene, &scene.lanes(), ErrorCode::StaticPair, 0, 1);
    let mut scene = Step::falling(6);
    scene.bodies[4].shape = 64;
    assert_refused(&mut machine(), &scene, &scene.lanes(), ErrorCode::ShapeIndex, 0, 4);
}

/// Starts with arguments that are refused before any packet.
fn error_of(arguments: &[(Register, u32)]) -> (u32, u32, u32) {
    let machine = machine();
    Step::falling(4).write_arguments(&machine.host);
    for (register, value) in arguments {
        machine.host.set_control(*register, *value);
    }
    machine.start();
    assert!(machine.host.port.wait_interrupt(microseconds(10)).is_some(), "the error interrupt");
    machine.host.error()
}

#[test]
fn arguments_out_of_range_are_refused_at_the_start() {
    let argument = ErrorCode::Argument as u32;
    assert_eq!(error_of(&[(control::BODIES, 0)]), (argument, 0, 0x10));
    assert_eq!(error_of(&[(control::BODIES, 131_073)]), (argument, 0, 0x10));
    assert_eq!(error_of(&[(control::CONTACT_ITERATIONS, 256)]), (argument, 0, 0x20));
    assert_eq!(error_of(&[(control::FRICTION_ITERATIONS, u32::MAX)]), (argument, 0, 0x28));
    // Their sum is more than a register holds.
    let many = [control::COLLISIONS, control::CONTACT_ITERATIONS, control::FRICTION_ITERATIONS];
    assert_eq!(error_of(&many.map(|register| (register, u32::MAX))), (argument, 0, 0x20));
}

#[test]
fn a_step_that_does_not_fit_is_refused_with_the_bytes_that_it_needs() {
    let capacity = ErrorCode::Capacity as u32;
    // 24 bytes a body and 16 a collision of 4 MiB.
    let most = ((4 << 20) - 4 * 24) / 16;
    let needed = 4 * 24 + (most + 1) * 16;
    assert_eq!(error_of(&[(control::COLLISIONS, most + 1)]), (capacity, 0, needed));
    assert_eq!(error_of(&[(control::COLLISIONS, u32::MAX)]), (capacity, 0, u32::MAX));
    let machine = machine();
    Step::falling(4).write_arguments(&machine.host);
    machine.host.set_control(control::COLLISIONS, most);
    machine.start();
    machine.host.pause(10);
    assert_eq!(machine.host.error(), (0, 0, 0), "it just fits");
}

#[test]
fn tlast_before_the_end_of_a_packet_is_refused() {
    // Five bodies: 3, 3, 2, 2 velocity beats.
    let scene = Step::falling(5);
    for (channel, beats) in [(0, 1), (1, 2), (3, 1)] {
        let mut lanes = scene.lanes();
        // The segment in two packets.
        let rest = lanes[channel].segments[0].split_off(beats);
        lanes[channel].segments[1] = rest;
        lanes[channel].packets = vec![0, 1, 2];
        let number = u32::try_from(channel).expect("a stream");
        let detail = u32::try_from(beats - 1).expect("a beat");
        let code = ErrorCode::TlastEarly;
        assert_refused(&mut machine(), &scene, &lanes, code, number, detail);
    }
}

#[test]
fn a_collision_packet_that_is_too_short_is_refused() {
    let scene = Step::on_ground(3, 3);
    for channel in 0..CORES {
        let mut lanes = scene.lanes();
        let beats = &mut lanes[channel].segments[1];
        beats.pop();
        let detail = u32::try_from(beats.len() - 1).expect("a beat");
        let number = u32::try_from(channel).expect("a stream");
        let code = ErrorCode::TlastEarly;
        assert_refused(&mut machine(), &scene, &lanes, code, number, detail);
    }
}

#[test]
fn a_packet_that_goes_on_where_it_must_end_is_refused() {
    for segment in 0..3 {
        let scene = Step::on_ground(3, 3);
        for channel in 0..CORES {
            let mut lanes = scene.lanes();
            let beats = &mut lanes[channel].segments[segment];
            beats.push(Beat::default());
            let detail = u32::try_from(beats.len() - 2).expect("a beat");
            let number = u32::try_from(channel).expect("a stream");
            let code = ErrorCode::TlastMissing;
            assert_refused(&mut machine(), &scene, &lanes, code, number, detail);
        }
    }
}

#[test]
fn a_beat_with_invalid_bytes_is_refused() {
    let mut machine = machine();
    Step::falling(2).write_arguments(&machine.host);
    machine.start();
    for ring in &mut machine.mm2s {
        let bytes = if ring.core == 2 { 12 } else { 16 };
        let slot = ring.push(machine.host.readable(&numbered(1)), SOF | EOF | bytes);
        ring.doorbell(&machine.host, slot);
    }
    machine.host.pause(20);
    let code = ErrorCode::PartialBeat as u32;
    assert_eq!(machine.host.error(), (code, 2, 0));
}

#[test]
fn the_first_error_stays_and_a_start_does_not_clear_it() {
    let mut machine = Machine::new(BoardConfig { strict: false, ..without_queue() });
    let scene = spoilt(|collision| collision.count = 9);
    let failure = machine.step(&scene).expect_err("it is refused");
    assert_eq!(failure, Failure::Accelerator(ErrorCode::ContactCount as u32, 0, 2));
    machine.start();
    machine.host.pause(10);
    assert_eq!(machine.host.error(), (ErrorCode::ContactCount as u32, 0, 2));
    assert_eq!(machine.host.violations(), [ViolationKind::StartWhileBusy]);
}

#[test]
fn padding_changes_nothing_wherever_it_stands() {
    let scene = one_cube();
    let mut machine = machine();
    let expected = machine.step(&scene).expect("the step completes");
    // Indices that would be refused and a normal that would damp, if they were read.
    let padding = Collision {
        bodies: [u32::MAX, 1],
        count: 0,
        contacts: [[f32::NAN; 4]; 4],
        ..scene.collisions[0]
    };
    for at in [0, 1] {
        for hazards in [Hazards::Interlocked, Hazards::Unchecked] {
            let mut padded = scene.clone();
            padded.collisions.insert(at, padding);
            padded.collisions.insert(at, padding);
            let config = BoardConfig { hazards, ..without_queue() };
            let outcome = Machine::new(config).step(&padded).expect("the step completes");
            assert_eq!(bits(&outcome.bodies[1]), bits(&expected.bodies[1]));
            assert_eq!(outcome.impulse_sum, expected.impulse_sum);
            assert_eq!((outcome.stalls, outcome.hazards), (0, 0));
        }
    }
}

#[test]
fn half_a_packet_survives_a_dma_reset_and_is_gone_after_an_accelerator_reset() {
    for reset_accelerator in [false, true] {
        let mut machine = machine();
        for ring in &mut machine.mm2s {
            let slot = ring.push(machine.host.readable(&numbered(1)), SOF | 16);
            ring.doorbell(&machine.host, slot);
        }
        machine.host.pause(20);
        for core in 0..CORES {
            machine.host.reset_dma(core);
        }
        if reset_accelerator {
            machine.host.reset_accelerator();
        }
        for ring in machine.mm2s.iter_mut().chain(&mut machine.s2mm) {
            ring.restart();
            ring.run(&machine.host, 0);
        }
        // Eight bodies: four velocity beats on each stream.
        let result = machine.step(&Step::falling(8));
        if reset_accelerator {
            let outcome = result.expect("the step completes");
            assert_eq!(bits(&outcome.bodies[7]), bits(&Step::fallen(8)[7]));
        } else {
            let failure = result.expect_err("a beat too many in front");
            // The fifth beat on each stream carries the TLAST that belongs to the fourth.
            let code = ErrorCode::TlastMissing as u32;
            assert_eq!(failure, Failure::Accelerator(code, 0, 3));
        }
        machine.host.assert_no_violation();
    }
}

#[test]
fn results_left_in_the_fifo_are_gone_after_a_reset() {
    let mut machine = machine();
    let scene = Step::falling(8);
    scene.write_arguments(&machine.host);
    let mut flight = Flight::default();
    machine.start();
    machine.send(&mut flight, &scene.lanes());
    machine.host.pause(50);
    assert!(ap_ctrl::DONE.is_set(machine.host.control(control::AP_CTRL)), "the FIFOs took all");
    machine.recover();
    let outcome = machine.step(&Step::falling(3)).expect("the step completes");
    assert_eq!(bits(&outcome.bodies[2]), bits(&Step::fallen(3)[2]));
}

#[test]
fn a_host_that_waits_for_mm2s_idle_before_it_arms_s2mm_waits_for_ever() {
    // 512 beats in each FIFO: 1024 bodies' poses and 512 bodies' results.
    for (bodies, fits) in [(500, true), (3000, false)] {
        let mut machine = machine();
        let scene = Step::falling(bodies);
        scene.write_arguments(&machine.host);
        let mut flight = Flight::default();
        machine.start();
        machine.send(&mut flight, &scene.lanes());
        machine.host.pause(5_000);
        for core in 0..CORES {
            let value = machine.host.status(core, Direction::Mm2s);
            assert_eq!(dmasr::IDLE.is_set(value), fits, "{bodies} bodies: {value:#x}");
        }
        // Nothing is lost: armed late, the results come.
        machine.arm(&mut flight, &result_beats(bodies.into()));
        machine.wait(&flight, LONG).expect("the step completes");
        let outcome = machine.collect(&flight, bodies.into());
        let last = usize::from(bodies) - 1;
        assert_eq!(bits(&outcome.bodies[last]), bits(&Step::fallen(bodies)[last]));
        machine.host.assert_no_violation();
    }
}

#[test]
fn arguments_and_shapes_are_not_taken_while_a_step_runs() {
    let mut machine = Machine::new(BoardConfig { strict: false, ..without_queue() });
    let host = &machine.host;
    Step::falling(4).write_arguments(host);
    machine.start();
    assert_eq!(host.control(control::AP_CTRL) & 0x7, 0x1, "started, neither done nor idle");
    host.set_control(control::BODIES, 9);
    host.set_control(control::GRAVITY_Y, 0);
    let shape = control::SHAPE_TABLE + control::SHAPE_STRIDE;
    host.port.write32(0xA004_0000 + u64::from(shape), 0);
    machine.start();
    let kind = |offset| ViolationKind::ArgumentWhileRunning { offset };
    assert_eq!(
        host.violations(),
        [
            kind(control::BODIES.offset),
            kind(control::GRAVITY_Y.offset),
            kind(shape),
            ViolationKind::StartWhileBusy
        ]
    );
    let mut flight = Flight::default();
    machine.arm(&mut flight, &result_beats(4));
    machine.send(&mut flight, &Step::falling(4).lanes());
    machine.wait(&flight, LONG).expect("the step completes");
    let outcome = machine.collect(&flight, 4);
    assert_eq!(bits(&outcome.bodies[3]), bits(&Step::fallen(4)[3]));
}

#[test]
fn done_is_cleared_by_reading_and_interrupts_by_toggling() {
    let mut machine = machine();
    let host = &machine.host;
    host.set_control(control::IER, 0b111);
    host.set_control(control::GIE, 0);
    let scene = Step::falling(4);
    scene.write_arguments(host);
    let mut flight = Flight::default();
    machine.arm(&mut flight, &result_beats(4));
    machine.start();
    machine.send(&mut flight, &scene.lanes());
    machine.wait(&flight, LONG).expect("the step completes");
    let host = &machine.host;
    assert_eq!(host.control(control::AP_CTRL), 0b1110, "done, idle, ready");
    assert_eq!(host.control(control::AP_CTRL), 0b0100);
    assert_eq!(host.control(control::ISR), 0b011, "done and ready");
    assert_eq!(host.port.wait_interrupt(microseconds(5)), None, "not enabled globally");
    host.set_control(control::GIE, 1);
    assert!(host.port.wait_interrupt(microseconds(5)).is_some());
    host.set_control(control::ISR, 0b001);
    assert_eq!(host.control(control::ISR), 0b010);
    host.set_control(control::ISR, 0b010);
    assert_eq!(host.control(control::ISR), 0);
    // The bits toggle: a constant written blindly sets bits that were clear.
    host.set_control(control::ISR, 0b100);
    // A pending bit stays when its source goes off, and can be acknowledged.
    host.set_control(control::IER, 0b001);
    assert_eq!(host.control(control::ISR), 0b100);
    host.set_control(control::ISR, 0b101);
    assert_eq!(host.control(control::ISR), 0b001, "toggled, enabled or not");
    host.set_control(control::ISR, 0b001);
    host.port.unmask_interrupt();
    assert_eq!(host.port.wait_interrupt(microseconds(5)), None);
}

fn formula(scene: &Step) -> u64 {
    scene.cycles(&FLOAT.default_variant())
}

fn assert_accounted(outcome: &Outcome, scene: &Step) {
    assert_eq!(outcome.cycles, formula(scene) + outcome.stalls + outcome.waits, "{outcome:?}");
}

#[test]
fn cycles_are_the_formula_and_stalls_and_waits_exactly() {
    for bandwidth in [UNLIMITED, Bandwidth::ZCU102_SUSTAINED, Bandwidth::BytesPerSecond(1 << 30)] {
        for scene in [
            one_cube(),
            Step::falling(1),
            Step::falling(7),
            Step::on_ground(3, 50),
            Step { iterations: [3, 0], ..Step::on_ground(200, 199) },
            Step { iterations: [0, 2], ..Step::on_ground(200, 401) },
            Step { iterations: [0, 0], ..Step::on_ground(2, 5) },
        ] {
            let mut machine = Machine::new(BoardConfig { bandwidth, ..without_queue() });
            // Without passes the collisions are not streamed.
            let outcome = machine.step(&scene).expect("the step completes");
            assert_accounted(&outcome, &scene);
        }
    }
}

#[test]
fn independent_collisions_stall_nowhere_and_wait_only_for_the_start() {
    let scene = Step::on_ground(1999, 5000);
    let mut machine = machine();
    let outcome = machine.step(&scene).expect("the step completes");
    assert_accounted(&outcome, &scene);
    assert_eq!((outcome.stalls, outcome.hazards), (0, 0));
    assert!(outcome.waits < 3000, "{} cycles", outcome.waits);
    machine.host.assert_no_violation();
}

#[test]
fn a_chain_on_one_body_stalls_for_the_window_less_the_interval_each() {
    // Three collisions of one body with the ground: two wait in each pass.
    let scene = Step { iterations: [1, 1], ..Step::on_ground(1, 3) };
    let mut machine = machine();
    let outcome = machine.step(&scene).expect("the step completes");
    assert_eq!(outcome.stalls, 2 * (324 - 2) + 2 * (190 - 2));
    assert_eq!(outcome.hazards, 4);
    assert_accounted(&outcome, &scene);
    let config = BoardConfig { window_slots: Some(10), ..without_queue() };
    let mut machine = Machine::new(config);
    let outcome = machine.step(&scene).expect("the step completes");
    assert_eq!(outcome.stalls, 4 * (20 - 2));
    assert_eq!(control::depth::WINDOW.of(machine.host.control(control::CONTACT_DEPTH)), 20);
}

#[test]
fn a_pass_ends_no_sooner_than_its_last_write_back() {
    // 2,000 slots are 4,000 cycles, more than either fill.
    let config =
        BoardConfig { window_slots: Some(2_000), hazards: Hazards::Unchecked, ..without_queue() };
    let scene = Step { iterations: [1, 1], ..Step::on_ground(1, 3) };
    let mut machine = Machine::new(config);
    let outcome = machine.step(&scene).expect("the step completes");
    let longer = (4_000 - 374) + (4_000 - 314);
    assert_eq!(outcome.cycles, formula(&scene) + longer + outcome.waits, "{outcome:?}");
    assert_eq!(outcome.stalls, 0);
    for register in [control::CONTACT_DEPTH, control::FRICTION_DEPTH] {
        let depth = machine.host.control(register);
        assert_eq!(
            (control::depth::FILL.of(depth), control::depth::WINDOW.of(depth)),
            (4_000, 4_000)
        );
    }
}

#[test]
fn stalls_of_more_than_32_bits_leave_the_formula_right() {
    let config = BoardConfig { window_slots: Some(32_767), ..without_queue() };
    let scene = Step { iterations: [1, 0], ..Step::on_ground(1, 66_000) };
    let outcome = Machine::new(config).step(&scene).expect("the step completes");
    assert_eq!(outcome.stalls, 65_999 * (65_534 - 2));
    assert!(outcome.stalls > u64::from(u32::MAX));
    let longer = 65_534 - 374;
    assert_eq!(outcome.cycles - outcome.stalls - outcome.waits, formula(&scene) + longer);
}

#[test]
fn a_window_of_one_slot_never_stalls() {
    for hazards in [Hazards::Interlocked, Hazards::Unchecked] {
        let config = BoardConfig { window_slots: Some(1), hazards, ..without_queue() };
        let outcome = Machine::new(config).step(&Step::on_ground(1, 3)).expect("completes");
        assert_eq!((outcome.stalls, outcome.hazards), (0, 0));
    }
}

/// A point mass of 1 kg that flies into two walls at once, at (-5, -3, 0) m/s.
fn corner() -> Step {
    let ground = Body { shape: STATIC, ..AT_REST };
    let mass = Body { linear: [-5.0, -3.0, 0.0], ..AT_REST };
    let floor = ground_contact(1, [0.0, -1.0, 0.0]);
    let wall = ground_contact(1, [-1.0, 0.0, 0.0]);
    Step {
        integrate: false,
        iterations: [1, 0],
        ..Step::new(vec![ground, mass], vec![floor, wall])
    }
}

#[test]
fn interlocked_both_impulses_count() {
    let outcome = machine().step(&corner()).expect("the step completes");
    assert_eq!(bits(&outcome.bodies[1])[2], [0; 4], "stopped by both walls");
    assert_eq!(outcome.impulse_sum, 8 << 20, "3 and 5 N s");
    assert_eq!(outcome.hazards, 1);
}

#[test]
fn unchecked_the_first_impulse_is_overwritten() {
    let config = BoardConfig { hazards: Hazards::Unchecked, ..without_queue() };
    let outcome = Machine::new(config).step(&corner()).expect("the step completes");
    // The wall's write-back, made from the velocity before the floor, comes last.
    let [x, y, z] = outcome.bodies[1].linear.map(f32::to_bits);
    assert_eq!([x, y, z], [0.0_f32.to_bits(), (-3.0_f32).to_bits(), 0]);
    assert_eq!(outcome.impulse_sum, 8 << 20);
    assert_eq!((outcome.hazards, outcome.stalls), (1, 0));
}

#[test]
fn unchecked_is_right_when_the_collisions_stand_a_window_apart() {
    let scene = corner();
    let padding = Collision { count: 0, ..scene.collisions[0] };
    // Contact window of 324 cycles: 162 slots.
    for (between, hazards) in [(161, 0), (160, 1)] {
        let mut spread = scene.clone();
        for _ in 0..between {
            spread.collisions.insert(1, padding);
        }
        let config = BoardConfig { hazards: Hazards::Unchecked, ..without_queue() };
        let outcome = Machine::new(config).step(&spread).expect("the step completes");
        assert_eq!(outcome.hazards, hazards);
        assert_eq!(bits(&outcome.bodies[1])[2] == [0; 4], hazards == 0);
    }
}

#[test]
fn only_float_flushes_subnormals() {
    let tiny = f32::from_bits(0x0000_1000);
    let mut scene = Step::falling(1);
    scene.bodies[0].linear = [tiny, 0.0, 0.0];
    for (profile, expected) in [(&NAIVE, tiny), (&FLOAT, 0.0)] {
        let mut machine = Machine::new(BoardConfig { profile, ..without_queue() });
        let outcome = machine.step(&scene).expect("the step completes");
        assert_eq!(outcome.bodies[0].linear[0].to_bits(), expected.to_bits());
    }
}

#[test]
fn the_same_step_on_two_boards_gives_the_same_cycles() {
    let scene = Step::on_ground(30, 200);
    let run = || {
        let mut machine = Machine::new(without_queue());
        let outcome = machine.step(&scene).expect("the step completes");
        (outcome.cycles, outcome.sum_sent, machine.host.board.counts())
    };
    assert_eq!(run(), run());
}
