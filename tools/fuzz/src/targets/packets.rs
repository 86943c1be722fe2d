//! Sends steps with damaged packets and arguments to the accelerator.

use bitstream_model::interface::control;
use bitstream_model::interface::record::Beat;
use bitstream_model::{BoardConfig, Delays};

use crate::boards;
use crate::host::packing::result_beats;
use crate::host::scene::{AT_REST, Body, Collision, Lane, STATIC, Step, bits};
use crate::host::sg::{Failure, Flight, Machine};
use crate::host::{Host, microseconds};
use crate::input::Input;
use crate::tally::Tally;

/// Longer than any of these steps takes when nothing is missing.
const ENOUGH: u64 = 2_000;

/// One execution.
pub(super) fn run(bytes: &[u8]) -> Tally {
    let mut input = Input::new(bytes);
    let config = boards::any(&mut input);
    // The steps have few beats; but with 8-bit lengths they would need many descriptors.
    let config = BoardConfig { length_width: config.length_width.max(11), ..config };
    let step = step(&mut input);
    let mut machine = Machine::with_slots(config, 24);
    let variant = machine.host.variant();
    let mut lanes = step.packed(&variant);
    step.write_arguments(&machine.host);
    let damaged = damage(&mut input, &machine.host, &mut lanes);

    let mut flight = Flight::default();
    machine.arm(&mut flight, &result_beats(&variant, step.bodies.len()));
    machine.start();
    machine.send(&mut flight, &lanes);
    let ended = machine.wait(&flight, microseconds(if damaged { 60 } else { ENOUGH }));
    let mut tally = Tally::default();
    match ended {
        Ok(()) => tally.steps += 1,
        Err(Failure::Accelerator(..) | Failure::Deadline) if damaged => tally.refused += 1,
        Err(Failure::Dma { errors, .. }) if damaged && errors != 0 => tally.refused += 1,
        Err(failure) => panic!("nothing was damaged, and the step ended with {failure:?}"),
    }
    machine.host.assert_no_violation();
    if input.one_in(4) {
        machine.recover();
        check_next(&mut machine, &step);
        tally.steps += 1;
    }
    machine.host.assert_no_violation();
    tally.add_board(&machine.host.board.counts());
    tally
}

/// After a reset a step gives the same result as on a fresh board.
fn check_next(machine: &mut Machine, step: &Step) {
    let config = machine.host.board.config();
    let fresh = BoardConfig { delays: Delays::default(), ..config };
    let expected = Machine::with_slots(fresh, 24).step(step).expect("a step as it should be");
    let found = machine.step(step).expect("the reset has ended what came before");
    let all = |bodies: &[Body]| bodies.iter().map(bits).collect::<Vec<_>>();
    assert_eq!(all(&found.bodies), all(&expected.bodies), "not the bits of a fresh board");
    assert_eq!(found.sum_received, expected.sum_received);
}

/// A few bodies on the ground and beside each other.
fn step(input: &mut Input<'_>) -> Step {
    let ground = Body { shape: STATIC, position: [0.0, -1.0, 0.0], ..AT_REST };
    let moving = |input: &mut Input<'_>| Body {
        position: [(); 3].map(|()| 2.0 * input.share()),
        linear: [(); 3].map(|()| input.share()),
        ..AT_REST
    };
    let count = 1 + input.below(7);
    let mut bodies = vec![ground];
    bodies.extend((0..count).map(|_| moving(input)));
    let bodies_end = count + 1;
    let mut collisions: Vec<Collision> = Vec::new();
    for _ in 0..input.below(7) {
        let b = 1 + input.below(count);
        // Never with itself.
        let a = (b + 1 + input.below(bodies_end - 1)) % bodies_end;
        let positions = [a, b].map(|body| bodies[body as usize].position);
        let point = [input.share(), input.share(), input.share(), input.share() / 16.0];
        collisions.push(Collision {
            bodies: [a, b],
            count: 1 + input.below(4),
            normal: [0.0, -1.0, 0.0],
            positions,
            contacts: [point; 4],
        });
    }
    Step { iterations: [input.below(3), input.below(3)], ..Step::new(bodies, collisions) }
}

/// Damages arguments and packets; returns whether anything was damaged.
fn damage(input: &mut Input<'_>, host: &Host, lanes: &mut [Lane]) -> bool {
    let mut damaged = false;
    if input.one_in(8) {
        let register = input.pick(&[
            control::BODIES,
            control::COLLISIONS,
            control::CONTACT_ITERATIONS,
            control::FRICTION_ITERATIONS,
            control::FLAGS,
            control::TIME_STEP,
            control::FRICTION,
        ]);
        host.set_control(register, input.telling_word());
        damaged = true;
    }
    for _ in 0..input.below(5) {
        let lane = input.index(lanes.len());
        let Lane { segments, packets } = &mut lanes[lane];
        let beats = &mut segments[input.index(3)];
        let at = input.index(beats.len() + 1);
        damaged = true;
        match input.below(8) {
            0 if at < beats.len() => {
                beats.remove(at);
            }
            1 => beats.insert(at, Beat([(); 4].map(|()| input.telling_word()))),
            2 if !packets.is_empty() => {
                packets.remove(input.index(packets.len()));
            }
            3 if packets.len() > 1 => {
                let (one, other) = (input.index(packets.len()), input.index(packets.len()));
                packets.swap(one, other);
            }
            4 if packets.len() < 7 => {
                let again = input.index(3);
                packets.push(again);
            }
            _ => {
                if let Some(beat) = beats.get_mut(at) {
                    let lane = input.index(4);
                    beat.0[lane] = match input.below(3) {
                        0 => beat.0[lane] ^ (1 << input.below(32)),
                        1 => input.telling_word(),
                        _ => input.share().to_bits(),
                    };
                }
            }
        }
    }
    // A packet of no beats cannot be sent.
    for Lane { segments, packets } in lanes {
        packets.retain(|segment| !segments[*segment].is_empty());
    }
    damaged
}
