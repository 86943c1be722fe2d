//! Whole steps through the issue queue: order, numbers, counters, refusals.

use bitstream_model::{Bandwidth, BoardConfig, EmulatedBoard, Hazards};
use pgs_interface::control::{self, ErrorCode};
use pgs_interface::profile::{FLOAT, HALF, NAIVE};
use pgs_interface::record::Beat;

use crate::common::fast::{Visible, scene, visible};
use crate::common::packing::numbered;
use crate::common::scene::{AT_REST, Body, Collision, STATIC, Step, ground_contact};
use crate::common::sg::{Failure, Machine};

/// A board whose memory limits nothing, with a queue of that depth; the reference takes its steps.
fn queued(depth: u32) -> BoardConfig {
    BoardConfig {
        queue: Some(depth),
        bandwidth: Bandwidth::Unlimited,
        fast: false,
        ..BoardConfig::default()
    }
}

#[test]
fn a_board_reports_the_depth_of_its_queue() {
    for (config, depth) in [
        (queued(64), 64),
        (queued(256), 256),
        (queued(0), 0),
        (BoardConfig { hazards: Hazards::Unchecked, ..BoardConfig::default() }, 0),
        (BoardConfig { profile: &NAIVE, ..BoardConfig::default() }, 0),
        (BoardConfig { profile: &HALF, ..BoardConfig::default() }, 0),
    ] {
        assert_eq!(Machine::new(config).host.control(control::QUEUE), depth);
    }
}

#[test]
fn a_queue_in_a_design_without_one_is_refused_in_words() {
    let refusal = |config| EmulatedBoard::new(config).expect_err("refused").to_string();
    let advice = "found one of 8 collisions: take an interlocked float, or queue=0";
    for (profile, hazards, expected) in [
        (&NAIVE, Hazards::Interlocked, "expected no issue queue in an interlocked naive, "),
        (&HALF, Hazards::Interlocked, "expected no issue queue in an interlocked half, "),
        (&FLOAT, Hazards::Unchecked, "expected no issue queue in an unchecked float, "),
    ] {
        let text = refusal(BoardConfig { profile, hazards, ..queued(8) });
        assert_eq!(text, format!("{expected}{advice}"));
    }
    let text = refusal(queued(257));
    assert_eq!(text, "depth of the issue queue in collisions is 257, expected 0 to 256");
}

/// Collisions of some pairs of bodies in a plane, each at another place and with another normal.
fn pairs(pairs: &[[u32; 2]]) -> Step {
    let body = |k: u8| {
        let linear = [f32::from(k % 3), -f32::from(k), 0.5];
        Body { position: [f32::from(k), 0.0, 0.0], linear, ..AT_REST }
    };
    let normals = [[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.6, 0.8, 0.0]];
    let collisions = pairs
        .iter()
        .zip(normals.iter().cycle())
        .map(|(bodies, normal)| Collision { bodies: *bodies, ..ground_contact(1, *normal) });
    Step { impulses_out: true, ..Step::new((0..12).map(body).collect(), collisions.collect()) }
}

#[test]
fn impulses_leave_in_the_order_of_issue_with_the_numbers_behind_each_four() {
    // Number 1 shares body 1 with number 0, and number 2 a body with each.
    let step = pairs(&[[0, 1], [1, 2], [2, 0], [3, 4], [5, 6], [7, 8]]);
    let order = [0, 3, 4, 5, 1, 2];
    let config = BoardConfig { window_slots: Some(5), ..queued(4) };
    let outcome = Machine::new(config).step(&step).expect("the step completes");
    assert_eq!(outcome.impulses.len(), 2 * 8, "six beats and two of numbers of each kind");
    for of_kind in outcome.impulses.chunks(8) {
        assert_eq!(of_kind[4], Beat([0, 3, 4, 5]));
        assert_eq!(of_kind[7], Beat([1, 2, 0, 0]));
    }
    // A board without a queue that gets them in this order solves the same.
    let mut given = step.clone();
    given.collisions = order.iter().map(|number| step.collisions[*number]).collect();
    let config = BoardConfig { queue: Some(0), ..config };
    let as_given = Machine::new(config).step(&given).expect("the step completes");
    assert_eq!(visible(&outcome).0, visible(&as_given).0);
    assert_eq!(outcome.impulse_sum, as_given.impulse_sum);
    let kinds = outcome.impulses.chunks(8).zip(as_given.impulses.chunks(6));
    for (of_kind, as_given) in kinds {
        let impulses: Vec<Beat> =
            numbered(of_kind, 6).into_iter().map(|(_, impulses)| impulses).collect();
        assert_eq!(impulses, as_given);
    }
}

#[test]
fn a_hub_stalls_for_the_window_in_every_pass_and_filling_is_work() {
    // Three collisions of one body with the ground. The window of all passes is 162 slots: a pass
    // idles in 161 slots twice. Three slots fill the queue.
    let step = Step::on_ground(1, 3);
    let outcome = Machine::new(queued(64)).step(&step).expect("the step completes");
    assert_eq!(outcome.stalls, 8 * 2 * 161 * 2);
    assert_eq!(outcome.hazards, 8 * 2);
    let formula = step.cycles(&FLOAT.default_variant()) + 8 * 3 * 2;
    assert_eq!(outcome.cycles, formula + outcome.stalls + outcome.waits);
    // A queue of two collisions takes two slots to fill.
    let outcome = Machine::new(queued(2)).step(&step).expect("the step completes");
    assert_eq!(outcome.cycles - outcome.stalls - outcome.waits, formula - 8 * 2);
}

#[test]
fn collisions_that_can_pass_each_other_hide_the_window() {
    // Two collisions of each of 200 bodies, one behind the other, are 162 slots apart at least.
    let step = Step::on_ground(200, 400);
    let mut twice = step.clone();
    twice.collisions = (0..400).map(|k| step.collisions[k / 2]).collect();
    let in_order = Step { in_order: true, ..twice.clone() };
    let through = Machine::new(queued(256)).step(&twice).expect("the step completes");
    let by = Machine::new(queued(256)).step(&in_order).expect("the step completes");
    assert_eq!(by.stalls, 4 * 200 * (324 - 2) + 4 * 200 * (190 - 2));
    // The queue holds 128 bodies: their second collisions wait until slot 162.
    assert!(through.stalls < by.stalls / 50, "{} of {}", through.stalls, by.stalls);
    assert_eq!(visible(&through).0, visible(&by).0, "each body's own order is the same");
}

/// A scene with hubs, and all that a host sees of a step of it.
fn busy() -> Step {
    Step { impulses_out: true, ..scene(40, 300, 11, false) }
}

fn seen(config: BoardConfig, step: &Step) -> Visible {
    visible(&Machine::new(config).step(step).expect("the step completes"))
}

#[test]
fn a_step_in_order_is_that_of_a_board_without_a_queue_to_the_last_cycle() {
    let step = Step { in_order: true, ..busy() };
    let without = seen(queued(0), &step);
    assert_eq!(seen(queued(64), &step), without);
    // Without a queue the flag has no meaning.
    assert_eq!(seen(queued(0), &busy()), without);
    assert_ne!(seen(queued(64), &busy()), without);
}

#[test]
fn a_pass_that_waits_for_memory_makes_the_same_choices() {
    let (bodies, [cycles, stalls, waits, sum, hazards], sums, impulses) = seen(queued(64), &busy());
    assert!(stalls > 0 && hazards > 0);
    for (bytes, fifo_beats) in [(1 << 30, 512), (300_000_000, 16)] {
        let mut slow = BoardConfig { bandwidth: Bandwidth::BytesPerSecond(bytes), ..queued(64) };
        slow.delays.fifo_beats = fifo_beats;
        let found = seen(slow, &busy());
        let (_, [slower, _, waited, ..], ..) = found;
        assert!(waited > waits, "{waited} cycles");
        assert_eq!(slower - waited, cycles - waits);
        let expected =
            (bodies.clone(), [slower, stalls, waited, sum, hazards], sums, impulses.clone());
        assert_eq!(found, expected);
    }
}

#[test]
fn a_wrong_collision_is_refused_when_it_enters_with_its_number_in_the_stream() {
    for at in [0_u32, 5, 63, 64, 250, 299] {
        let mut step = busy();
        let collision = &mut step.collisions[at as usize];
        (collision.count, collision.bodies) = (1, [3, 3]);
        let error = Machine::new(queued(64)).step(&step).expect_err("it is refused");
        assert_eq!(error, Failure::Accelerator(ErrorCode::SelfCollision as u32, 0, at));
    }
    // A hub, which issues in the order of the stream.
    let mut hub = Step::on_ground(1, 100);
    hub.collisions[80].count = 5;
    let mut machine = Machine::new(queued(8));
    let error = machine.step(&hub).expect_err("it is refused");
    assert_eq!(error, Failure::Accelerator(ErrorCode::ContactCount as u32, 0, 80));
    // It enters in the slot in which number 72 issues; all but the first have met a hazard.
    assert_eq!(machine.host.control(control::HAZARDS), 72);
}

#[test]
fn a_reset_in_the_middle_of_a_pass_empties_the_queue() {
    let expected = seen(queued(64), &busy());
    let mut machine = Machine::new(queued(64));
    for nanoseconds in [2_000, 4_000, 9_000] {
        let variant = machine.host.variant();
        let step = busy();
        let flight = machine.begin(&step, &step.packed(&variant));
        machine.host.port.pause(std::time::Duration::from_nanos(nanoseconds));
        machine.recover();
        for address in flight.inputs().iter().chain(flight.outputs()) {
            machine.host.take(*address);
        }
        let outcome = machine.step(&step).expect("the step completes");
        assert_eq!(visible(&outcome), expected, "after {nanoseconds} ns");
    }
}

#[test]
fn padding_issues_in_its_turn_with_a_number_and_zeros() {
    let mut step = pairs(&[[0, 1], [0, 1], [2, 3]]);
    step.collisions[2].count = 0;
    step.bodies[11].shape = STATIC;
    let outcome = Machine::new(queued(64)).step(&step).expect("the step completes");
    for of_kind in outcome.impulses.chunks(4) {
        let numbers: Vec<u32> = numbered(of_kind, 3).iter().map(|(number, _)| *number).collect();
        assert_eq!(numbers, [0, 2, 1]);
        assert_eq!(of_kind[1], Beat::default());
    }
}
