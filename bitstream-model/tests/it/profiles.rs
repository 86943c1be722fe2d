//! Every profile end to end: stripes, padding, packets, cycles, hazards, registers.

#![expect(clippy::float_cmp, reason = "the expected values are exact")]

use bitstream_model::{Bandwidth, BoardConfig, Delays, EmulatedBoard, Hazards};
use pgs_interface::control::{self, ErrorCode};
use pgs_interface::number::{Numbers, Precision, StreamFormat};
use pgs_interface::profile::{
    FLOAT, HALF, Inertia, NAIVE, OnChipMemory, PROFILES, Profile, Variant,
};
use pgs_interface::record::Beat;
use pgs_interface::stripe::{Stripe, Stripes};

use crate::common::packing::result_beats;
use crate::common::scene::{AT_REST, Body, Collision, STATIC, Step, bits, ground_contact};
use crate::common::sg::{Failure, Machine, Outcome};
use crate::common::without_queue;

fn config(profile: &'static Profile) -> BoardConfig {
    BoardConfig { profile, bandwidth: Bandwidth::Unlimited, ..without_queue() }
}

/// Every profile with every format of its streams and both inertias.
fn variants() -> Vec<Variant> {
    let mut variants = Vec::new();
    for profile in PROFILES {
        let own = profile.numbers;
        let built = profile.inertias().iter();
        variants.extend(built.map(|inertia| Variant { profile, numbers: own, inertia: *inertia }));
    }
    let numbers = Numbers { collisions: StreamFormat::Binary16, ..Numbers::F32 };
    let half = StreamFormat::Binary16;
    let numbers = Numbers { bodies: half, poses: half, ..numbers };
    variants.push(Variant { profile: &HALF, numbers, inertia: Inertia::Isotropic });
    variants
}

fn own_variants() -> Vec<Variant> {
    PROFILES.iter().map(|profile| profile.default_variant()).collect()
}

fn built(variant: &Variant, config: BoardConfig) -> Machine {
    let Variant { profile, numbers, inertia } = *variant;
    Machine::new(BoardConfig { profile, numbers: Some(numbers), inertia, ..config })
}

fn unlimited(variant: &Variant) -> Machine {
    built(variant, config(variant.profile))
}

fn states(outcome: &Outcome) -> Vec<[[u32; 4]; 4]> {
    outcome.bodies.iter().map(bits).collect()
}

#[test]
fn bodies_fall_alike_on_every_profile_whatever_their_number() {
    for variant in variants() {
        let mut machine = unlimited(&variant);
        for bodies in (1..14).chain([100]) {
            let outcome = machine.step(&Step::falling(bodies)).expect("the step completes");
            // Small multiples of one half: exact in binary16 too.
            let expected: Vec<_> = Step::fallen(bodies).iter().map(bits).collect();
            assert_eq!(states(&outcome), expected, "{} {bodies} bodies", variant.profile.name);
        }
        machine.host.assert_no_violation();
    }
}

#[test]
fn masses_on_the_ground_stop_alike_on_every_profile_whatever_their_number() {
    for variant in variants() {
        for hazards in [Hazards::Interlocked, Hazards::Unchecked] {
            let config = BoardConfig { hazards, ..config(variant.profile) };
            let mut machine = built(&variant, config);
            for bodies in 1..9 {
                let scene = Step::on_ground(bodies, bodies.into());
                let outcome = machine.step(&scene).expect("the step completes");
                for (k, body) in outcome.bodies.iter().enumerate().skip(1) {
                    // Stopped by 1 N s, then half a second of gravity.
                    assert_eq!(body.linear, [0.0, -4.0, 0.0], "{k} of {bodies}");
                }
                assert_eq!(outcome.impulse_sum, u64::from(bodies) << 20);
                assert_eq!(outcome.hazards, 0);
            }
            machine.host.assert_no_violation();
        }
    }
}

#[test]
fn the_sums_count_every_word_and_the_padding() {
    for variant in variants() {
        let mut machine = unlimited(&variant);
        for scene in [Step::falling(7), Step::on_ground(9, 9), Step::on_ground(6, 30)] {
            let outcome = machine.step(&scene).expect("the step completes");
            assert_eq!(outcome.sum_received, scene.sum_of_input(&variant));
            assert_eq!(outcome.sum_sent, outcome.sum_of_results);
        }
    }
}

#[test]
fn words_of_the_padding_are_summed_and_otherwise_ignored() {
    let variant = HALF.default_variant();
    let scene = Step::on_ground(5, 5);
    let mut lanes = scene.packed(&variant);
    let last = lanes[2].segments[1].last_mut().expect("the padding's last beat");
    assert_eq!(*last, Beat::default());
    *last = Beat([1, 2, 3, 0xFFFF_FFFF]);
    let expected = unlimited(&variant).step(&scene).expect("the step completes");
    let found = unlimited(&variant).step_with(&scene, &lanes).expect("the step completes");
    assert_eq!(states(&found), states(&expected));
    // Eight passes.
    assert_eq!(found.sum_received, expected.sum_received.wrapping_add(8 * 5));
}

#[test]
fn cycles_are_the_formula_and_stalls_and_waits_exactly() {
    for variant in variants() {
        for bandwidth in [Bandwidth::Unlimited, Bandwidth::BytesPerSecond(1 << 30)] {
            for scene in [
                Step::falling(1),
                Step::falling(8),
                Step::on_ground(3, 50),
                Step { iterations: [3, 0], ..Step::on_ground(200, 199) },
                Step { iterations: [0, 2], ..Step::on_ground(200, 400) },
            ] {
                let config = BoardConfig { bandwidth, ..config(variant.profile) };
                let outcome = built(&variant, config).step(&scene).expect("the step completes");
                let formula = scene.cycles(&variant);
                let name = variant.profile.name;
                assert_eq!(
                    outcome.cycles,
                    formula + outcome.stalls + outcome.waits,
                    "{name} {outcome:?}"
                );
            }
        }
    }
}

/// By hand: eight beats of `half` take its stream of 64 bits four cycles, so that every fourth slot
/// of three cycles is empty: 1, 33 and 133 slots for 1, 25 and 100 pairs.
#[test]
fn an_issue_of_a_warm_pass_takes_the_cycles_of_its_busiest_stream() {
    let passes = [[32, 32 * 50, 32 * 199], [2, 2 * 50, 2 * 199], [3, 99, 399]];
    for (profile, passes) in [&NAIVE, &FLOAT, &HALF].into_iter().zip(passes) {
        let variant = profile.default_variant();
        let work = |step: &Step| {
            let outcome = unlimited(&variant).step(step).expect("the step completes");
            outcome.cycles - outcome.stalls - outcome.waits
        };
        for (collisions, pass) in [1_u16, 50, 199].into_iter().zip(passes) {
            let cold = Step::on_ground(200, collisions.into());
            let impulses = vec![[[0.0; 4]; 2]; collisions.into()];
            let warm = Step { impulses, ..cold.clone() };
            let fills = u64::from(profile.contact.fill + profile.friction.fill);
            assert_eq!(work(&warm), work(&cold) + 2 * pass + fills);
            assert_eq!(work(&warm), warm.cycles(&variant), "{}", profile.name);
        }
    }
}

/// The formula of the tests themselves, for the thesis' step, by hand.
#[test]
fn the_thesis_step_takes_the_cycles_of_the_formula_on_each_profile() {
    let step = Step {
        bodies: vec![AT_REST; 38_880],
        collisions: vec![ground_contact(1, [0.0; 3]); 127_000],
        ..Step::falling(1)
    };
    let fill = 4 * (364 + 306);
    let of_float = 4 * (374 + 314);
    let of_half = 4 * (285 + 222);
    for (profile, load, pass, fill, last, integration) in [
        // 32-bit words one by one.
        (&NAIVE, 38_880 * 8, 127_000 * 28, fill, 38_880 * 16, 264),
        (&FLOAT, 19_440, 127_000 * 2, of_float, 38_880, 264),
        // Groups of five beats take two cycles.
        (&HALF, 15_552, 63_500 * 3, of_half, 31_104, 177),
    ] {
        let expected = load + 8 * pass + fill + last + integration;
        assert_eq!(step.cycles(&profile.default_variant()), expected, "{}", profile.name);
    }
}

#[test]
fn without_hazards_a_large_step_waits_for_its_start_alone() {
    for variant in own_variants() {
        let scene = Step::on_ground(1999, 1999);
        let outcome = unlimited(&variant).step(&scene).expect("the step completes");
        assert_eq!((outcome.stalls, outcome.hazards), (0, 0));
        assert!(outcome.waits < 3000, "{}: {} cycles", variant.profile.name, outcome.waits);
    }
}

#[test]
fn packets_that_end_too_early_or_too_late_are_refused_on_every_stream() {
    for variant in own_variants() {
        // Odd numbers: padding at the end of each segment of `half`.
        let scene = Step::on_ground(3, 3);
        let sound = scene.packed(&variant);
        for channel in 0..sound.len() {
            for segment in 0..3 {
                for shorter in [true, false] {
                    let mut lanes = sound.clone();
                    let beats = &mut lanes[channel].segments[segment];
                    let length = u32::try_from(beats.len()).expect("some beats");
                    let (code, beat) = if shorter {
                        // The poses are the last packet: nothing would follow.
                        if length < 2 || segment == 2 {
                            continue;
                        }
                        beats.pop();
                        (ErrorCode::TlastEarly, length - 2)
                    } else {
                        beats.push(Beat::default());
                        (ErrorCode::TlastMissing, length - 1)
                    };
                    let failure =
                        unlimited(&variant).step_with(&scene, &lanes).expect_err("refused");
                    let number = u32::try_from(channel).expect("a stream");
                    assert_eq!(
                        failure,
                        Failure::Accelerator(code as u32, number, beat),
                        "{} segment {segment}",
                        variant.profile.name
                    );
                }
            }
        }
    }
}

#[test]
fn a_step_whose_padding_does_not_come_does_not_end() {
    let variant = HALF.default_variant();
    let scene = Step::falling(1);
    let mut lanes = scene.packed(&variant);
    // One body, four beats of padding.
    lanes[2].packets = vec![0];
    let failure = unlimited(&variant).step_with(&scene, &lanes).expect_err("it waits");
    assert_eq!(failure, Failure::Deadline);
}

#[test]
fn bad_records_are_refused_with_the_index_of_the_record() {
    for variant in own_variants() {
        let spoilt = |change: &dyn Fn(&mut Collision)| {
            let mut scene = Step::on_ground(3, 3);
            change(&mut scene.collisions[2]);
            scene
        };
        let beyond = spoilt(&|collision| collision.bodies = [0, 4]);
        let twice = spoilt(&|collision| collision.bodies = [3, 3]);
        let mut shape = Step::on_ground(3, 3);
        shape.bodies[1].shape = 64;
        shape.inertias = vec![[0.0; 6]; 4];
        for (scene, code, detail) in [
            (beyond, ErrorCode::BodyIndex, 2),
            (twice, ErrorCode::SelfCollision, 2),
            (shape, ErrorCode::ShapeIndex, 1),
        ] {
            let failure = unlimited(&variant).step(&scene).expect_err("refused");
            assert_eq!(failure, Failure::Accelerator(code as u32, 0, detail));
        }
    }
}

#[test]
fn a_count_above_four_is_refused_where_there_is_a_count() {
    for profile in [&NAIVE, &FLOAT, &HALF] {
        let mut scene = Step::on_ground(3, 3);
        scene.collisions[1].count = 5;
        let failure = unlimited(&profile.default_variant()).step(&scene).expect_err("refused");
        assert_eq!(failure, Failure::Accelerator(ErrorCode::ContactCount as u32, 0, 1));
    }
}

/// A point mass of 1 kg that flies into two walls at once, at (-5, -3, 0) m/s.
fn corner(between: usize) -> Step {
    let ground = Body { shape: STATIC, ..AT_REST };
    let mass = Body { linear: [-5.0, -3.0, 0.0], ..AT_REST };
    let floor = ground_contact(1, [0.0, -1.0, 0.0]);
    let wall = ground_contact(1, [-1.0, 0.0, 0.0]);
    let mut collisions = vec![floor];
    collisions.extend(vec![Collision { count: 0, ..floor }; between]);
    collisions.push(wall);
    let step = Step::new(vec![ground, mass], collisions);
    Step { integrate: false, iterations: [1, 0], ..step }
}

#[test]
fn interlocked_the_second_collision_of_an_issue_waits_for_the_first() {
    let variant = HALF.default_variant();
    // In one issue, in the next one, and in the one after.
    for (between, stalls) in [(0, 255), (1, 255 - 3), (2, 255 - 3), (3, 255 - 6)] {
        let scene = corner(between);
        let outcome = unlimited(&variant).step(&scene).expect("the step completes");
        assert_eq!(outcome.bodies[1].linear, [0.0; 3], "stopped by both walls");
        assert_eq!(outcome.impulse_sum, 8 << 20);
        assert_eq!((outcome.stalls, outcome.hazards), (stalls, 1), "{between} between");
        assert_eq!(outcome.cycles, scene.cycles(&variant) + stalls + outcome.waits);
    }
}

#[test]
fn unchecked_a_write_back_is_seen_from_the_issue_a_window_later_on() {
    let config = BoardConfig { hazards: Hazards::Unchecked, ..config(&HALF) };
    // Contact window of 255 cycles: 85 issues of two collisions. The floor is the first of its
    // issue; in the issue 85 later the wall is the first with 169 in between.
    for (between, hazards) in [(0, 1), (1, 1), (167, 1), (168, 1), (169, 0), (170, 0)] {
        let outcome = Machine::new(config).step(&corner(between)).expect("the step completes");
        assert_eq!((outcome.hazards, outcome.stalls), (hazards, 0), "{between} between");
        // The wall's write-back, made from the velocity before the floor, comes last.
        let y = if hazards == 0 { 0.0 } else { -3.0 };
        assert_eq!(outcome.bodies[1].linear, [0.0, y, 0.0], "{between} between");
    }
}

#[test]
fn padding_changes_nothing_wherever_it_stands() {
    for variant in variants() {
        let mut machine = unlimited(&variant);
        let scene = Step::on_ground(3, 3);
        let expected = machine.step(&scene).expect("the step completes");
        let padding = Collision { bodies: [9, 9], count: 0, ..scene.collisions[0] };
        for at in 0..=3 {
            let mut padded = scene.clone();
            padded.collisions.insert(at, padding);
            let outcome = machine.step(&padded).expect("the step completes");
            assert_eq!(states(&outcome), states(&expected), "{} at {at}", variant.profile.name);
        }
    }
}

#[test]
fn the_registers_say_how_each_board_was_built() {
    // Profile, channels, widths, issue, clock, bodies, memory per record, numbers.
    let cases = [
        (&NAIVE, [2, 0x0101, 0x2, 0x0001_001C, 275_000, 131_072, (16 << 16) | 24, 0]),
        (&FLOAT, [1, 0x0404, 0x4444, 0x0001_0002, 275_000, 131_072, (16 << 16) | 24, 0]),
        (&HALF, [3, 0x0303, 0x344, 0x0002_0003, 250_000, 65_536, (8 << 16) | 24, 0x111_1111]),
    ];
    let registers = [
        control::PROFILE,
        control::CHANNELS,
        control::MM2S_WIDTHS,
        control::ISSUE,
        control::CLOCK_KHZ,
        control::BODY_CAPACITY,
        control::MEMORY_PER_RECORD,
        control::NUMBERS,
    ];
    for (profile, expected) in cases {
        let machine = unlimited(&profile.default_variant());
        let host = &machine.host;
        assert_eq!(registers.map(|register| host.control(register)), expected, "{}", profile.name);
        assert_eq!(host.control(control::S2MM_WIDTHS), host.control(control::MM2S_WIDTHS));
        assert!(!control::features::WORLD_INERTIA.is_set(host.control(control::FEATURES)));
    }
    let world = Variant { inertia: Inertia::World, ..FLOAT.default_variant() };
    let machine = unlimited(&world);
    let features = machine.host.control(control::FEATURES);
    assert!(control::features::WORLD_INERTIA.is_set(features));
    assert_eq!(machine.host.control(control::MEMORY_PER_RECORD), (16 << 16) | 48);
}

#[test]
fn a_body_count_that_an_index_cannot_name_is_refused() {
    let machine = unlimited(&HALF.default_variant());
    Step::falling(1).write_arguments(&machine.host);
    machine.host.set_control(control::BODIES, 65_537);
    machine.start();
    machine.host.pause(10);
    assert_eq!(machine.host.error(), (ErrorCode::Argument as u32, 0, control::BODIES.offset));
}

fn refusal(config: BoardConfig) -> String {
    EmulatedBoard::new(config).expect_err("it is refused").to_string()
}

#[test]
fn formats_that_cannot_be_built_are_refused_with_what_is_expected() {
    let with = |profile: &'static Profile, numbers| {
        refusal(BoardConfig { numbers: Some(numbers), ..config(profile) })
    };
    for profile in [&NAIVE, &HALF] {
        let text = refusal(BoardConfig { inertia: Inertia::World, ..config(profile) });
        assert!(text.contains(&format!("inertia on {}, found world", profile.name)), "{text}");
    }
    let text = with(&FLOAT, Numbers { bodies: StreamFormat::Binary16, ..Numbers::F32 });
    assert!(text.contains("velocity records of 16 bits a number, expected 32"), "{text}");
    let text = with(&HALF, Numbers::F32);
    assert!(text.contains("collision records of 32 bits a number, expected 16"), "{text}");
    let numbers = Numbers { updates: Precision::Binary16, ..Numbers::F32 };
    let text = with(&FLOAT, numbers);
    assert!(text.contains("expected updates in f32, or both in binary16"), "{text}");
}

#[test]
fn a_profile_that_contradicts_itself_is_refused_with_what_is_expected() {
    static NO_STREAM: Profile = Profile { mm2s_widths: &[], ..FLOAT };
    static ODD_WIDTH: Profile = Profile { s2mm_widths: &[128, 128, 128, 96], ..FLOAT };
    static NO_ISSUE: Profile = Profile { initiation_interval: 0, ..FLOAT };
    static NO_CLOCK: Profile = Profile { clock_khz: 0, ..FLOAT };
    static BEYOND: Profile = {
        let mut profile = FLOAT;
        profile.stripes.poses = Stripe { streams: &[0, 4], padded: false };
        profile
    };
    static OTHER_WARM: Profile = {
        let mut profile = FLOAT;
        profile.stripes.collisions = Stripe { streams: &[3, 2, 1, 0, 3, 2, 1], padded: false };
        profile
    };
    for (profile, expected) in [
        (&NO_STREAM, "1 to 4 streams"),
        (&ODD_WIDTH, "32, 64 or 128 bits"),
        (&NO_ISSUE, "at least one cycle"),
        (&NO_CLOCK, "at least 1 kHz"),
        (&BEYOND, "streams that exist"),
        (&OTHER_WARM, "a warm stripe that begins as the stripe of the collisions"),
    ] {
        let text = refusal(config(profile));
        assert!(text.contains("profile \"float\"") && text.contains(expected), "{text}");
    }
}

#[test]
fn a_profile_larger_than_registers_tables_and_fifos_is_refused() {
    const fn with(memory: OnChipMemory) -> Profile {
        Profile { memory, ..FLOAT }
    }
    const MEMORY: OnChipMemory = FLOAT.memory;
    static NO_COPY: Profile = with(OnChipMemory { velocity_copies: 0, ..MEMORY });
    static COPIES: Profile = with(OnChipMemory { velocity_copies: 17, ..MEMORY });
    static NO_PUMP: Profile = with(OnChipMemory { pump: 0, ..MEMORY });
    static NO_SHAPE: Profile = Profile { shape_capacity: 0, ..FLOAT };
    static SHAPES: Profile = Profile { shape_capacity: 193, ..FLOAT };
    static NO_COLLISION: Profile = Profile { collisions_per_issue: 0, ..FLOAT };
    // An issue of many collisions has other beats than a warm pass of `float` begins with.
    const COLD: Stripes = Stripes { warm_collisions: None, ..FLOAT.stripes };
    static COLLISIONS: Profile = Profile { collisions_per_issue: u32::MAX, stripes: COLD, ..FLOAT };
    for (profile, expected) in [
        (&NO_COPY, "copies of the velocities is 0, expected 1 to 16"),
        (&COPIES, "copies of the velocities is 17, expected 1 to 16"),
        (&NO_PUMP, "clocks of the accelerator is 0, expected 1 to 16"),
        (&NO_SHAPE, "shape table in entries is 0, expected 1 to 192"),
        (&SHAPES, "shape table in entries is 193, expected 1 to 192"),
        (&NO_COLLISION, "collisions of an issue is 0, expected 1 to 16"),
        (&COLLISIONS, "collisions of an issue is 4294967295, expected 1 to 16"),
    ] {
        let text = refusal(config(profile));
        assert!(text.contains(expected), "{text}");
    }
    // Sixteen collisions of seven beats need a FIFO of 112.
    static SIXTEEN: Profile = Profile {
        collisions_per_issue: 16,
        queue: None,
        shape_capacity: 192,
        stripes: COLD,
        ..FLOAT
    };
    let with = |fifo_beats| {
        let delays = Delays { fifo_beats, ..Delays::default() };
        BoardConfig { delays, ..config(&SIXTEEN) }
    };
    let text = refusal(with(111));
    assert!(text.contains("beats of an issue is 112, expected 1 to 111"), "{text}");
    let mut machine = Machine::new(with(112));
    let outcome = machine.step(&Step::on_ground(3, 17)).expect("the step completes");
    let reference = unlimited(&FLOAT.default_variant()).step(&Step::on_ground(3, 17));
    assert_eq!(states(&outcome), states(&reference.expect("the step completes")));
}

#[test]
fn result_packets_have_the_beats_that_the_stripes_say() {
    for (profile, bodies, expected) in [
        (&NAIVE, 3, vec![12]),
        (&FLOAT, 3, vec![3, 3, 3, 3]),
        // Six beats, padded to two groups.
        (&HALF, 3, vec![4, 4, 2]),
    ] {
        assert_eq!(result_beats(&profile.default_variant(), bodies), expected);
    }
}
