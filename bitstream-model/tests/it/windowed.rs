//! The design that streams the collisions once: the same bits as one pass after the other, and the
//! cycles of its rules.

use bitstream_model::{Bandwidth, BoardConfig, Delays, EmulatedBoard, Hazards, Subnormals};
use pgs_interface::control::{self, ErrorCode};
use pgs_interface::descriptor::status;
use pgs_interface::profile::{Flow, Geometry, Inertia, Profile, WINDOWED, WINDOWED16, Window};
use pgs_interface::record::{BEAT_BYTES, Beat, live};
use pgs_interface::stripe::Stripe;
use proptest::prelude::*;

use crate::common::clock::{Clock, Counted};
use crate::common::packing::result_beats;
use crate::common::ring::{EOF, SOF};
use crate::common::scene::{AT_REST, Body, Collision, MOVING, STATIC, Step, bits, ground_contact};
use crate::common::sg::{Failure, Flight, LONG, Machine, Outcome};

/// The same numbers and records, one pass after the other.
static SEQUENTIAL: Profile = Profile { flow: Flow::Passes, ..WINDOWED };
static SEQUENTIAL16: Profile = Profile { flow: Flow::Passes, ..WINDOWED16 };
const PAIRS: [(&Profile, &Profile); 2] = [(&WINDOWED, &SEQUENTIAL), (&WINDOWED16, &SEQUENTIAL16)];

fn config(profile: &'static Profile) -> BoardConfig {
    BoardConfig { profile, bandwidth: Bandwidth::Unlimited, ..BoardConfig::default() }
}

/// A board whose streams hold a whole step, so that all records are there from the start.
fn deep(profile: &'static Profile) -> BoardConfig {
    let delays = Delays { fifo_beats: 1 << 14, ..Delays::default() };
    BoardConfig { delays, ..config(profile) }
}

/// A profile with another window.
fn with(profile: &'static Profile, design: Window) -> &'static Profile {
    Box::leak(Box::new(Profile { flow: Flow::Window(design), ..*profile }))
}

fn design(profile: &Profile) -> Window {
    match profile.flow {
        Flow::Window(design) => design,
        Flow::Passes => panic!("it has a window"),
    }
}

/// Places for all bodies, and room for the longest span.
fn roomy(step: &Step, [contact_units, friction_units]: [u32; 2]) -> Window {
    let lag = u32::try_from(step.longest_span() + 1).expect("small");
    Window { contact_units, friction_units, slots: 8192, lag }
}

fn states(bodies: &[Body]) -> Vec<[[u32; 4]; 4]> {
    bodies.iter().map(bits).collect()
}

fn run(config: BoardConfig, step: &Step) -> Outcome {
    let mut machine = Machine::new(config);
    let outcome = machine.step(step).expect("the step completes");
    machine.host.assert_no_violation();
    outcome
}

/// Numbers that follow each other without a pattern.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        self.0 >> 33
    }

    fn below(&mut self, end: usize) -> usize {
        usize::try_from(self.next()).expect("31 bits") % end
    }

    /// From -1 to 1, in steps of 2^-10.
    fn number(&mut self) -> f32 {
        f32::from(u16::try_from(self.below(2049)).expect("small")) / 1024.0 - 1.0
    }

    fn vector(&mut self) -> [f32; 3] {
        [self.number(), self.number(), self.number()]
    }
}

/// A crowd: the bodies of every collision have nearby indices, and at least one of them moves. Some
/// collisions are bubbles, and some bodies are in no collision.
fn crowd(seed: u64, bodies: usize, collisions: usize, reach: usize) -> Step {
    let mut random = Random(seed);
    let mut all: Vec<Body> = (0..bodies)
        .map(|_| Body {
            shape: if random.below(8) == 0 { STATIC } else { 1 + u32::from(random.below(2) == 0) },
            position: random.vector(),
            linear: random.vector(),
            angular: random.vector(),
            ..AT_REST
        })
        .collect();
    for body in &mut all {
        if body.shape == STATIC {
            (body.linear, body.angular) = ([0.0; 3], [0.0; 3]);
        }
    }
    let mut list = Vec::new();
    for n in 0..collisions {
        let near = n * bodies / collisions;
        let [a, b] = [0; 2].map(|_| (near + random.below(reach)) % bodies);
        let sound = a != b && [a, b].iter().any(|k| all[*k].shape != STATIC);
        let [x, y, z] = random.vector();
        let [a32, b32] = [a, b].map(|k| u32::try_from(k).expect("small"));
        list.push(Collision {
            bodies: [a32, b32],
            count: if sound { 1 + u32::try_from(random.below(4)).expect("small") } else { 0 },
            normal: [x, y, z],
            positions: [random.vector(), random.vector()],
            contacts: [0; 4].map(|_| {
                let [x, y, z] = random.vector();
                [x, y, z, random.number()]
            }),
        });
    }
    Step {
        shapes: vec![[0.0, 0.0], [1.0, 0.5], [0.25, 2.0]],
        drift: 0.25,
        coefficient: 0.125,
        time_step: 0.125,
        damping: 0.875,
        ..Step::new(all, list)
    }
}

fn crowds() -> impl Strategy<Value = Step> {
    (any::<u64>(), 2..60_usize, 0..120_usize, 2..20_usize, [0..4_u32, 0..4_u32]).prop_map(
        |(seed, bodies, collisions, reach, iterations)| {
            let bodies = bodies.max(reach);
            let mut step = Step { iterations, ..crowd(seed, bodies, collisions, reach) };
            // At least one body moves.
            step.bodies[0].shape = MOVING;
            step
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(150))]

    #[test]
    fn the_bits_are_those_of_one_pass_after_the_other(
        step in crowds(),
        units in [1..4_u32, 1..4_u32],
        window_slots in prop::option::of(1..60_u32),
        sixteen in any::<bool>(),
        world in any::<bool>(),
        flush in any::<bool>(),
        slow in any::<bool>(),
    ) {
        let (profile, sequential) = PAIRS[usize::from(sixteen)];
        let bandwidth = Bandwidth::BytesPerSecond(if slow { 100_000_000 } else { 12_800_000_000 });
        let own = BoardConfig {
            inertia: if world { Inertia::World } else { Inertia::Isotropic },
            subnormals: if flush { Subnormals::Flush } else { Subnormals::Keep },
            window_slots,
            bandwidth,
            ..config(with(profile, roomy(&step, units)))
        };
        let found = run(own, &step);
        let expected = run(BoardConfig { profile: sequential, ..own }, &step);
        prop_assert_eq!(states(&found.bodies), states(&expected.bodies));
        prop_assert_eq!(found.impulse_sum, expected.impulse_sum);
        prop_assert_eq!(found.sum_sent, found.sum_of_results);
        prop_assert_eq!(found.sum_received, step.sum_of_input(&own.variant()));
    }

    #[test]
    fn cycles_stalls_and_hazards_are_what_the_rules_give(
        step in crowds(),
        units in [1..4_u32, 1..4_u32],
        window_slots in prop::option::of(1..60_u32),
        spare in 0..3_u32,
        places in prop::option::of(0..3_u32),
        sixteen in any::<bool>(),
    ) {
        let profile = PAIRS[usize::from(sixteen)].0;
        let mut design = roomy(&step, units);
        design.lag += spare;
        // With places that are only just enough the first pass waits for them.
        design.slots = places.map_or(8192, |places| step.fewest_slots() + places);
        let profile = with(profile, design);
        let own = BoardConfig { window_slots, ..deep(profile) };
        let found = at_once(own, &step);
        let expected = clock(&own, &step);
        prop_assert_eq!(found.waits, 0);
        let counted =
            Counted { cycles: found.cycles, stalls: found.stalls, hazards: found.hazards };
        prop_assert_eq!(Some(counted), expected);
    }

    #[test]
    fn streams_that_dry_up_anywhere_cost_time_alone(
        step in crowds(),
        seed in any::<u64>(),
        sixteen in any::<bool>(),
    ) {
        let profile = PAIRS[usize::from(sixteen)].0;
        let own = config(with(profile, roomy(&step, [2, 2])));
        let expected = run(own, &step);
        let found = trickle(own, &step, &mut Random(seed)).expect("the step completes");
        prop_assert_eq!(states(&found.bodies), states(&expected.bodies));
        prop_assert_eq!(
            (found.impulse_sum, found.sum_received, found.sum_sent),
            (expected.impulse_sum, expected.sum_received, expected.sum_sent)
        );
    }
}

/// The counters of a step by the rules, on a board whose streams never lack a record.
fn clock(config: &BoardConfig, step: &Step) -> Option<Counted> {
    let variant = config.variant();
    let profile = variant.profile;
    let design = design(profile);
    let marked = step.marked(design.slots).expect("there are places");
    let [contact, friction] = step.iterations;
    let window = |depth: u32| {
        u64::from(config.window_slots.map_or(depth, |slots| slots * profile.initiation_interval))
    };
    let of = |passes: u32, depth: u32| std::iter::repeat_n(window(depth), passes as usize);
    let passes_per_unit =
        contact.div_ceil(design.contact_units).max(friction.div_ceil(design.friction_units));
    let slot =
        (passes_per_unit * profile.initiation_interval).div_ceil(profile.collisions_per_issue);
    let clock = Clock {
        slot: slot.into(),
        windows: of(contact, profile.contact.window)
            .chain(of(friction, profile.friction.window))
            .collect(),
        design,
        units: (0..contact)
            .map(|k| k % design.contact_units)
            .chain((0..friction).map(|k| design.contact_units + k % design.friction_units))
            .collect(),
        interval: profile.initiation_interval.into(),
        per_issue: profile.collisions_per_issue as usize,
        // Two beats of a pose on its stream.
        leave_interval: 2,
    };
    let counted = clock.run(step, &marked.words, marked.come.len())?;
    // The last body is in; its result is out after the fill of the integration.
    Some(Counted { cycles: counted.cycles + u64::from(profile.integration_fill), ..counted })
}

/// Sends everything before the start.
fn at_once(config: BoardConfig, step: &Step) -> Outcome {
    let mut machine = Machine::new(config);
    let (told, lanes) = step.on(&machine.host.variant());
    told.write_arguments(&machine.host);
    let mut flight = Flight::default();
    let beats = result_beats(&machine.host.variant(), told.bodies.len());
    machine.arm(&mut flight, &beats);
    machine.send(&mut flight, &lanes);
    machine.host.pause(1000);
    machine.start();
    machine.wait(&flight, LONG).expect("the step completes");
    assert!(machine.is_done());
    machine.host.assert_no_violation();
    machine.collect(&flight, told.bodies.len())
}

/// Sends every stream in small pieces at random moments, and asks for the results as late.
fn trickle(config: BoardConfig, step: &Step, random: &mut Random) -> Result<Outcome, Failure> {
    let mut machine = Machine::with_slots(config, 2048);
    let variant = machine.host.variant();
    let packed = step.packed_once(&variant);
    let told = step.moving_in_order(&packed.leave);
    told.write_arguments(&machine.host);
    let mut flight = Flight::default();
    let beats = result_beats(&variant, told.bodies.len());
    let late = random.below(2) == 0;
    if !late {
        machine.arm(&mut flight, &beats);
    }
    machine.start();
    // For each stream the pieces that are left: address, beats, flags.
    let mut left: Vec<Vec<(u64, usize, u32)>> = Vec::new();
    for lane in &packed.lanes {
        let mut pieces = Vec::new();
        for segment in &lane.packets {
            let beats = &lane.segments[*segment];
            let address = machine.host.readable(beats);
            flight.input(address);
            let mut at = 0;
            while at < beats.len() {
                let n = (1 + random.below(9)).min(beats.len() - at);
                let first = if at == 0 { SOF } else { 0 };
                let last = if at + n == beats.len() { EOF } else { 0 };
                pieces.push((address + (at * BEAT_BYTES) as u64, n, first | last));
                at += n;
            }
        }
        pieces.reverse();
        left.push(pieces);
    }
    let mut last: Vec<Option<usize>> = vec![None; left.len()];
    while left.iter().any(|pieces| !pieces.is_empty()) {
        let stream = random.below(left.len());
        // A doorbell rings at a ring that is idle.
        let ring = &machine.mm2s[stream];
        let done = |slot: &usize| status::CMPLTED.is_set(ring.status(*slot));
        let pieces = if last[stream].as_ref().is_none_or(done) { random.below(6) } else { 0 };
        for k in 0..pieces {
            let Some((address, beats, flags)) = left[stream].pop() else { break };
            let length = u32::try_from(beats * BEAT_BYTES).expect("few");
            let slot = machine.mm2s[stream].push(address, length | flags);
            last[stream] = Some(slot);
            if k + 1 == pieces || left[stream].is_empty() {
                machine.mm2s[stream].doorbell(&machine.host, slot);
            }
        }
        if random.below(3) == 0 {
            machine.host.pause(u64::try_from(random.below(4)).expect("few"));
        }
        if late && flight.is_without_results() && random.below(20) == 0 {
            machine.arm(&mut flight, &beats);
        }
    }
    if flight.is_without_results() {
        machine.arm(&mut flight, &beats);
    }
    let waited = machine.wait(&flight, LONG);
    machine.host.assert_no_violation();
    waited?;
    assert!(machine.is_done());
    let outcome = machine.collect(&flight, told.bodies.len());
    Ok(Outcome { bodies: step.restored(&packed.leave, &outcome.bodies), ..outcome })
}

#[test]
fn a_span_as_long_as_the_delay_lines_and_one_place_too_few_end_in_the_error_for_it() {
    for seed in 0..20 {
        let step = crowd(seed, 30, 60, 8);
        let sound = roomy(&step, [2, 2]);
        let short = Window { lag: sound.lag - 1, ..sound };
        let failure = Machine::new(config(with(&WINDOWED, short))).step(&step).expect_err("stuck");
        let Failure::Accelerator(code, 0, detail) = failure else { panic!("{failure:?}") };
        assert_eq!(code, ErrorCode::Deadlock as u32);
        assert!((detail as usize) < step.collisions.len());

        // With the fewest places the step still ends.
        let fewest = step.fewest_slots();
        assert!(fewest > 3, "some bodies are alive at once");
        let tight = Window { slots: fewest, ..sound };
        run(config(with(&WINDOWED, tight)), &step);
    }
}

/// Three masses in a row, and the index words with which they go out.
fn chain() -> (Step, Vec<[u32; 2]>) {
    let ground = Body { shape: STATIC, ..AT_REST };
    let step = Step::new(
        vec![ground, AT_REST, AT_REST, AT_REST],
        [[0, 1], [1, 2], [2, 3]]
            .map(|bodies| Collision { bodies, ..ground_contact(1, [0.0, -1.0, 0.0]) })
            .into(),
    );
    let words = vec![
        [0, live::FIRST | 1],
        [live::LAST | 1, live::FIRST | 2],
        [live::LAST | 2, live::FIRST | live::LAST | 3],
    ];
    (step, words)
}

/// The outcome of a step with the index words `words`.
fn with_words(step: &Step, words: &[[u32; 2]]) -> Result<Outcome, Failure> {
    let mut machine = Machine::new(config(&WINDOWED));
    let lanes = step.lanes_of(&machine.host.variant(), words, &[1, 2, 3], &[1, 2, 3]);
    machine.step_with(&step.moving_in_order(&[1, 2, 3]), &lanes)
}

#[test]
fn invalid_marks_are_refused_with_the_collision() {
    let (step, sound) = chain();
    with_words(&step, &sound).expect("it is sound");
    assert_eq!(step.marked(8192).expect("there are places").words, sound);
    use ErrorCode::{BodyIndex, Deadlock, EmptyPlace, SelfCollision, StaticPair};
    for (entry, words, code, detail) in [
        // Before its first use, after its last, and never.
        (0, [0, 1], EmptyPlace, 0),
        (2, [live::LAST | 1, live::FIRST | 3], EmptyPlace, 2),
        (1, [live::LAST | 1, 7], EmptyPlace, 1),
        // A place that is never freed, and a body that never leaves.
        (1, [live::LAST | 1, live::FIRST | 1], SelfCollision, 1),
        (2, [live::LAST | 2, live::FIRST | 2], SelfCollision, 2),
        (1, [1, live::FIRST | 2], Deadlock, 0),
        (2, [live::LAST | 2, live::FIRST | 3], Deadlock, 2),
        (2, [2, live::FIRST | live::LAST | 3], Deadlock, 1),
        (1, [0, 0], StaticPair, 1),
        (1, [live::FIRST, live::LAST | 1], BodyIndex, 1),
        (1, [live::LAST | 1, 1 << 15 | live::FIRST | 2], BodyIndex, 1),
    ] {
        let mut spoilt = sound.clone();
        spoilt[entry] = words;
        let failure = with_words(&step, &spoilt).expect_err("refused");
        let expected = Failure::Accelerator(code as u32, 0, detail);
        assert_eq!(failure, expected, "entry {entry}: {words:x?}");
    }
    // The place of a body that is used again later.
    let mut spoilt = sound.clone();
    spoilt[2] = [2 | live::LAST, live::FIRST | live::LAST | 1];
    spoilt[1] = [1, live::FIRST | 2];
    let failure = with_words(&step, &spoilt).expect_err("refused");
    assert_eq!(failure, Failure::Accelerator(Deadlock as u32, 0, 2));
}

#[test]
fn more_first_uses_than_bodies_are_refused() {
    let (step, words) = chain();
    let mut machine = Machine::new(config(&WINDOWED));
    let lanes = step.lanes_of(&machine.host.variant(), &words, &[1, 2], &[1, 2]);
    let failure = machine.step_with(&step.moving_in_order(&[1, 2]), &lanes).expect_err("refused");
    assert_eq!(failure, Failure::Accelerator(ErrorCode::BodyIndex as u32, 0, 2));
}

#[test]
fn a_shape_that_is_not_there_is_refused_with_the_number_of_the_velocity() {
    let (mut step, words) = chain();
    step.bodies[2].shape = 64;
    let failure = with_words(&step, &words);
    assert_eq!(
        failure.expect_err("refused"),
        Failure::Accelerator(ErrorCode::ShapeIndex as u32, 0, 1)
    );
}

#[test]
fn two_bodies_of_no_inverse_mass_are_refused_though_they_have_places() {
    let (mut step, words) = chain();
    step.bodies[1].shape = STATIC;
    let failure = with_words(&step, &words).expect_err("refused");
    assert_eq!(failure, Failure::Accelerator(ErrorCode::StaticPair as u32, 0, 0));
}

#[test]
fn a_packet_that_goes_on_is_refused_on_every_stream() {
    for (profile, _) in PAIRS {
        let step = crowd(5, 20, 31, 6);
        let packed = step.packed_once(&config(profile).variant());
        let told = step.moving_in_order(&packed.leave);
        for channel in 0..packed.lanes.len() {
            for segment in packed.lanes[channel].packets.clone() {
                // One beat more.
                {
                    let mut lanes = packed.lanes.clone();
                    let beats = &mut lanes[channel].segments[segment];
                    let length = u32::try_from(beats.len()).expect("some beats");
                    beats.push(Beat::default());
                    let (code, beat) = (ErrorCode::TlastMissing, length - 1);
                    let failure = Machine::new(config(profile))
                        .step_with(&told, &lanes)
                        .expect_err("refused");
                    let number = u32::try_from(channel).expect("a stream");
                    let expected = Failure::Accelerator(code as u32, number, beat);
                    assert_eq!(failure, expected, "{} segment {segment}", profile.name);
                }
            }
        }
    }
}

#[test]
fn a_packet_that_ends_before_the_last_record_is_refused_on_every_stream() {
    for (profile, _) in PAIRS {
        let step = crowd(5, 20, 31, 6);
        let packed = step.packed_once(&config(profile).variant());
        let told = step.moving_in_order(&packed.leave);
        for (channel, lane) in packed.lanes.iter().enumerate() {
            for segment in lane.packets.clone() {
                let mut lanes = packed.lanes.clone();
                let beats = &lane.segments[segment];
                let (head, tail) = beats.split_at(beats.len() / 2);
                // Two packets; the second takes the place of an empty segment.
                let other = lanes[channel].segments.iter().position(Vec::is_empty).expect("one");
                lanes[channel].segments[segment] = head.to_vec();
                lanes[channel].segments[other] = tail.to_vec();
                lanes[channel].packets = vec![segment, other];
                let failure =
                    Machine::new(config(profile)).step_with(&told, &lanes).expect_err("refused");
                let [number, beat] =
                    [channel, head.len() - 1].map(|n| u32::try_from(n).expect("few"));
                let expected = Failure::Accelerator(ErrorCode::TlastEarly as u32, number, beat);
                assert_eq!(failure, expected, "{} segment {segment}", profile.name);
            }
        }
    }
}

#[test]
fn the_registers_report_the_parts_of_the_design() {
    for (profile, numbers) in [(&WINDOWED, 0), (&WINDOWED16, 0x11_1111)] {
        let machine = Machine::new(config(profile));
        let host = &machine.host;
        assert_eq!(host.control(control::PROFILE), profile.id);
        assert_eq!(host.control(control::WINDOW), 0x0202);
        assert_eq!(host.control(control::WINDOW_CAPACITY), (2816 << 16) | 8192);
        assert_eq!(host.control(control::BODY_CAPACITY), 1 << 20);
        assert_eq!(host.control(control::COLLISION_CAPACITY), 1 << 20);
        assert_eq!(host.control(control::MEMORY_PER_RECORD), 0);
        assert_eq!(host.control(control::NUMBERS), numbers);
        assert!(control::features::INTERLOCKED.is_set(host.control(control::FEATURES)));
    }
    let machine = Machine::new(config(&SEQUENTIAL));
    assert_eq!(machine.host.control(control::WINDOW), 0);
    assert_eq!(machine.host.control(control::WINDOW_CAPACITY), 0);
}

#[test]
fn more_collisions_than_the_counters_hold_are_refused() {
    let machine = Machine::new(config(&WINDOWED));
    Step::falling(1).write_arguments(&machine.host);
    machine.host.set_control(control::COLLISIONS, (1 << 20) + 1);
    machine.start();
    machine.host.pause(10);
    let expected = (ErrorCode::Argument as u32, 0, control::COLLISIONS.offset);
    assert_eq!(machine.host.error(), expected);
}

#[test]
fn designs_that_contradict_themselves_are_refused_with_what_is_expected() {
    let own = design(&WINDOWED);
    let refusal = |config| EmulatedBoard::new(config).expect_err("it is refused").to_string();
    for (window, expected) in [
        (Window { contact_units: 0, ..own }, "1 to 255 units"),
        (Window { friction_units: 256, ..own }, "1 to 255 units"),
        (Window { slots: 1, ..own }, "2 to 8192 places"),
        (Window { slots: 8193, ..own }, "2 to 8192 places"),
        (Window { lag: 0, ..own }, "1 to 65535 collisions"),
    ] {
        let text = refusal(config(with(&WINDOWED, window)));
        assert!(text.contains("profile \"windowed\"") && text.contains(expected), "{text}");
    }
    static SHARED: Profile = {
        let mut profile = WINDOWED;
        profile.stripes.poses = Stripe { streams: &[2, 3], padded: false };
        profile
    };
    assert!(refusal(config(&SHARED)).contains("streams of their own"));
    static ABSOLUTE: Profile = Profile { geometry: Geometry::Absolute, ..WINDOWED };
    assert!(refusal(config(&ABSOLUTE)).contains("relative to body A"));
    let unchecked = BoardConfig { hazards: Hazards::Unchecked, ..config(&WINDOWED16) };
    assert!(refusal(unchecked).contains("expected `interlocked`"));
}

/// One mass on the ground, in three collisions one after the other.
#[test]
fn a_body_that_is_used_twice_waits_a_window() {
    let step = Step { iterations: [1, 0], ..Step::on_ground(1, 3) };
    // T = 2: issues at 0, 316 and 632, integrated from 948 on, the last body in at 950.
    let found = at_once(config(&WINDOWED), &step);
    assert_eq!((found.hazards, found.stalls), (2, 2 * 314));
    assert_eq!(found.cycles, 3 * 316 + 2 + 264);
    // A second pass, a window after the last of them: at 948, 1264 and 1580.
    let found = at_once(config(&WINDOWED), &Step { iterations: [2, 0], ..step });
    assert_eq!((found.hazards, found.stalls), (4, 2 * 314));
    assert_eq!(found.cycles, 6 * 316 + 2 + 264);
}

#[test]
fn masses_of_their_own_flow_through_without_a_stall() {
    // Every pass has a unit for itself, an entry every two cycles: the third pass begins when the
    // first has ended. Each pass is a window behind the previous one.
    let step = Step::on_ground(100, 100);
    let found = at_once(config(&WINDOWED), &step);
    assert_eq!((found.hazards, found.stalls, found.waits), (0, 0, 0));
    assert_eq!(found.cycles, 99 * 2 + 4 * 316 + 4 * 182 + 2 + 264);
    // One unit each: four passes share it, two cycles an entry.
    let one = Window { contact_units: 1, friction_units: 1, ..design(&WINDOWED) };
    let step = Step { iterations: [2, 0], ..Step::on_ground(1000, 1000) };
    let found = at_once(deep(with(&WINDOWED, one)), &step);
    // The first alone for 158 entries, then both in turn, then the second alone.
    assert_eq!(found.stalls, 0);
    assert_eq!(found.cycles, 1999 * 2 + 316 + 2 + 264);
}
