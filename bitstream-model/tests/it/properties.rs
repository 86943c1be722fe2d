//! No program on the registers and the descriptors makes the board panic or hang, and a reset makes
//! it work again.

use bitstream_model::{Bandwidth, BoardConfig, Delays, Direction, EmulatedBoard, Hazards};
use pgs_interface::address_map::{CONTROL_BASE, dma_base};
use pgs_interface::axi_dma::{ADDRESS, ADDRESS_MSB, CHANNEL_REGISTERS, DMACR, LENGTH};
use pgs_interface::control::{self, ap_ctrl};
use pgs_interface::descriptor::WORDS;
use pgs_interface::profile::{PROFILES, Profile, Variant};
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;

use crate::common;
use crate::common::ring::{Ring, WHOLE, halves};
use crate::common::scene::{Step, bits};
use crate::common::sg::{Flight, LONG, Machine};
use crate::common::{BOTH, CORES, Host, microseconds, numbered};

/// Descriptors and beats that a random program uses.
const SLOTS: usize = 8;
const BEATS: u32 = 64;

#[derive(Debug, Clone)]
enum Act {
    Read(u64),
    Write(u64, u32),
    /// A register of a channel, with a value that has a meaning for it.
    Channel(usize, Direction, usize, u32),
    /// A descriptor: slot, offset in a buffer, CONTROL.
    Fill(usize, Direction, usize, u64, u32),
    /// Any word of a descriptor.
    Word(usize, Direction, usize, u32),
    Point(usize, Direction, usize),
    Run(usize, Direction, u32),
    Doorbell(usize, Direction, usize),
    /// A reset of a core, with both channels running again afterwards.
    Revive(usize),
    /// A packet as it should be, by descriptor or by LENGTH.
    Packet(usize, Direction, usize, u32),
    /// A whole step, but for the wait for its end.
    Step(u16, usize),
    Start(u32, u32, u32),
    Pause(u16),
    Wait(u16),
    Unmask,
}

fn channel() -> impl Strategy<Value = (usize, Direction)> {
    (0..CORES, prop::sample::select(&BOTH[..]))
}

fn value() -> impl Strategy<Value = u32> {
    prop_oneof![
        any::<u32>(),
        (0..32_u32).prop_map(|bit| 1 << bit),
        Just(0),
        Just(u32::MAX),
        0..0x100_u32,
        Just(0x0001_0001),
        Just(0x0001_7013),
    ]
}

fn address() -> impl Strategy<Value = u64> {
    prop_oneof![
        8 => (0..CORES, 0..0x1A_u64).prop_map(|(core, word)| dma_base(core) + 4 * word),
        4 => (0..0x80_u64).prop_map(|word| CONTROL_BASE + 4 * word),
        2 => (0..0x400_u64).prop_map(|word| CONTROL_BASE + 4 * word),
        1 => (0..0x6_0000_u64).prop_map(|offset| dma_base(0) + offset),
        1 => any::<u64>(),
    ]
}

fn act() -> impl Strategy<Value = Act> {
    let slot = 0..SLOTS;
    let control = prop_oneof![
        any::<u32>(),
        (0..4_u32, 0..80_u32).prop_map(|(flags, beats)| (flags << 26) | (beats * 16)),
    ];
    prop_oneof![
        3 => address().prop_map(Act::Read),
        1 => (address(), value()).prop_map(|(at, value)| Act::Write(at, value)),
        1 => (channel(), 0..CHANNEL_REGISTERS.len(), value())
            .prop_map(|((core, way), register, value)| Act::Channel(core, way, register, value)),
        1 => (channel(), slot.clone(), 0..40_u64, control)
            .prop_map(|((core, way), slot, at, control)| Act::Fill(core, way, slot, at * 8, control)),
        1 => (channel(), 0..SLOTS * WORDS, value())
            .prop_map(|((core, way), word, value)| Act::Word(core, way, word, value)),
        1 => (channel(), slot.clone()).prop_map(|((core, way), slot)| Act::Point(core, way, slot)),
        1 => (channel(), value()).prop_map(|((core, way), value)| Act::Run(core, way, value)),
        2 => (channel(), slot.clone())
            .prop_map(|((core, way), slot)| Act::Doorbell(core, way, slot)),
        5 => (0..CORES).prop_map(Act::Revive),
        6 => (channel(), slot, 1..BEATS)
            .prop_map(|((core, way), slot, beats)| Act::Packet(core, way, slot, beats)),
        5 => (1..40_u16, 0..20_usize)
            .prop_map(|(bodies, collisions)| Act::Step(bodies, collisions)),
        1 => (0..40_u32, 0..20_u32, 0..3_u32)
            .prop_map(|(bodies, collisions, passes)| Act::Start(bodies, collisions, passes)),
        3 => any::<u16>().prop_map(Act::Pause),
        2 => any::<u16>().prop_map(Act::Wait),
        2 => Just(Act::Unmask),
    ]
}

/// Every profile with each form of inertia that it can be built with.
fn variants() -> Vec<Variant> {
    let own = |profile: &&'static Profile| {
        let (variant, built) = (profile.default_variant(), profile.inertias().iter());
        built.map(move |inertia| Variant { inertia: *inertia, ..variant })
    };
    PROFILES.iter().flat_map(own).collect()
}

fn config() -> impl Strategy<Value = BoardConfig> {
    (
        prop::sample::select(variants()),
        any::<[bool; 4]>(),
        prop::sample::select(&[8_u32, 14, 26][..]),
        prop::sample::select(&[32_u32, 40, 64][..]),
        prop::sample::select(
            &[
                Bandwidth::Unlimited,
                Bandwidth::ZCU102_SUSTAINED,
                Bandwidth::BytesPerSecond(50_000_000),
            ][..],
        ),
        prop::option::of(1..400_u32),
    )
        .prop_map(
            |(variant, switches, length_width, address_width, bandwidth, window_slots)| {
                let [direct, unchecked, scattered, strict] = switches;
                let Variant { profile, numbers, inertia } = variant;
                BoardConfig {
                    profile,
                    numbers: Some(numbers),
                    inertia,
                    hazards: if unchecked { Hazards::Unchecked } else { Hazards::Interlocked },
                    window_slots,
                    bandwidth,
                    length_width,
                    address_width,
                    // Most boards with scatter-gather and lenient: the others see less.
                    scatter_gather: !direct || scattered,
                    strict: strict && unchecked,
                    ..BoardConfig::default()
                }
            },
        )
}

/// A ring and a buffer for every channel.
struct Playground {
    rings: Vec<Ring>,
    buffers: Vec<u64>,
}

impl Playground {
    fn new(host: &Host) -> Self {
        let all = || (0..CORES).flat_map(|core| BOTH.map(|direction| (core, direction)));
        let rings = all().map(|(core, way)| Ring::new(host, core, way, SLOTS)).collect();
        let buffer = |way| match way {
            Direction::Mm2s => host.readable(&numbered(BEATS)),
            Direction::S2mm => host.writable(BEATS as usize),
        };
        Self { rings, buffers: all().map(|(_, way)| buffer(way)).collect() }
    }

    /// The index of a channel in both lists.
    fn of(core: usize, direction: Direction) -> usize {
        2 * core + usize::from(direction == Direction::S2mm)
    }

    /// Lets a channel move a packet: by the descriptor in that slot, or directly.
    fn packet(&self, host: &Host, ring: &Ring, slot: usize, address: u64, beats: u32) {
        if host.board.config().scatter_gather {
            ring.fill(slot, address, WHOLE | (beats * 16));
            ring.doorbell(host, slot);
        } else {
            let [low, high] = halves(address);
            host.write(ring.core, ring.direction, ADDRESS, low);
            host.write(ring.core, ring.direction, ADDRESS_MSB, high);
            host.write(ring.core, ring.direction, LENGTH, beats * 16);
        }
    }

    fn act(&self, host: &Host, act: &Act) {
        let ring = |core, way| &self.rings[Self::of(core, way)];
        match *act {
            Act::Read(address) => {
                let _ = host.port.read32(address);
            }
            Act::Write(address, value) => host.port.write32(address, value),
            Act::Channel(core, way, register, value) => {
                let [low, high] = halves(self.buffers[Self::of(core, way)]);
                host.write(core, way, ADDRESS, low);
                host.write(core, way, ADDRESS_MSB, high);
                host.write(core, way, CHANNEL_REGISTERS[register], value);
            }
            Act::Fill(core, way, slot, offset, control) => {
                ring(core, way).fill(slot, self.buffers[Self::of(core, way)] + offset, control);
            }
            Act::Word(core, way, word, value) => {
                ring(core, way).set(word / WORDS, word % WORDS, value);
            }
            Act::Point(core, way, slot) => ring(core, way).point(host, ring(core, way).at(slot)),
            Act::Run(core, way, value) => {
                host.write(core, way, DMACR, value | 1);
                host.pause(1);
            }
            Act::Doorbell(core, way, slot) => ring(core, way).doorbell(host, slot),
            Act::Start(bodies, collisions, passes) => {
                host.set_control(control::BODIES, bodies);
                host.set_control(control::COLLISIONS, collisions);
                host.set_control(control::CONTACT_ITERATIONS, passes);
                host.set_control(control::AP_CTRL, ap_ctrl::START.mask());
            }
            Act::Revive(core) => {
                host.write(core, Direction::S2mm, DMACR, 0x4);
                host.pause(1);
                for way in BOTH {
                    ring(core, way).point(host, ring(core, way).address);
                    host.write(core, way, DMACR, 0x0001_7001);
                }
                host.pause(1);
            }
            Act::Packet(core, way, slot, beats) => {
                self.packet(host, ring(core, way), slot, self.buffers[Self::of(core, way)], beats);
            }
            Act::Step(bodies, collisions) => {
                (0..host.cores()).for_each(|core| self.act(host, &Act::Revive(core)));
                host.set_control(control::RESET, 1);
                host.pause(1);
                let scene = Step { iterations: [1, 1], ..Step::on_ground(bodies, collisions) };
                let lanes = scene.packed(&host.variant());
                scene.write_arguments(host);
                host.set_control(control::IER, 0b111);
                host.set_control(control::GIE, 1);
                for core in 0..host.cores() {
                    let room = 5 * (u32::from(bodies) + 1);
                    let address = host.writable(room as usize);
                    self.packet(host, ring(core, Direction::S2mm), 0, address, room);
                }
                host.set_control(control::AP_CTRL, ap_ctrl::START.mask());
                for (core, lane) in lanes.iter().enumerate() {
                    for (slot, segment) in lane.packets.iter().enumerate() {
                        let beats = &lane.segments[*segment];
                        let length = u32::try_from(beats.len()).expect("few");
                        let address = host.readable(beats);
                        self.packet(host, ring(core, Direction::Mm2s), slot, address, length);
                        host.pause(1);
                    }
                }
            }
            Act::Pause(count) => host.pause(u64::from(count) % 2_000),
            Act::Wait(count) => {
                let _ = host.port.wait_interrupt(microseconds(u64::from(count) % 2_000));
            }
            Act::Unmask => host.port.unmask_interrupt(),
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn no_program_makes_the_board_panic_or_hang(
        config in config(),
        acts in prop::collection::vec(act(), 1..120),
    ) {
        let host = Host::new(config);
        let playground = Playground::new(&host);
        for act in &acts {
            playground.act(&host, act);
        }
        // Time goes on.
        let before = host.port.now();
        host.pause(1_000);
        prop_assert!(host.port.now() >= before + microseconds(1_000));
        let counts = host.board.counts();
        prop_assert!(host.violations().len() as u64 <= counts.violations);
        if config.strict {
            prop_assert_eq!(counts.violations > 0, host.port.read32(CONTROL_BASE + 0x100) == u32::MAX);
        }
    }

    #[test]
    fn a_reset_of_everything_ends_whatever_came_before(
        config in config(),
        acts in prop::collection::vec(act(), 1..80),
    ) {
        let config = BoardConfig { strict: false, scatter_gather: true, length_width: 26, ..config };
        let mut machine = Machine::new(config);
        let playground = Playground::new(&machine.host);
        for act in &acts {
            playground.act(&machine.host, act);
        }
        machine.recover();
        for core in 0..machine.host.cores() {
            for direction in BOTH {
                prop_assert_eq!(machine.host.status(core, direction), 0x0001_0008);
            }
        }
        let before = machine.host.board.counts().violations;
        let outcome = machine.step(&Step::falling(5)).expect("the step completes");
        let found: Vec<_> = outcome.bodies.iter().map(bits).collect();
        let expected: Vec<_> = Step::fallen(5).iter().map(bits).collect();
        prop_assert_eq!(found, expected);
        prop_assert_eq!(machine.host.board.counts().violations, before);
    }

    #[test]
    fn no_beats_make_the_accelerator_panic_or_touch_what_was_not_granted(
        config in config(),
        words in prop::collection::vec(any::<u32>(), 64),
        bodies in 1..12_u16,
        collisions in 0..8_usize,
        spoilt in prop::collection::vec((0..CORES, 0..3_usize, 0..64_usize, 0..4_usize, any::<u32>()), 0..6),
    ) {
        let config = BoardConfig { scatter_gather: true, length_width: 26, ..config };
        let mut machine = Machine::new(config);
        let scene = Step::on_ground(bodies, collisions);
        let mut lanes = scene.packed(&machine.host.variant());
        scene.write_arguments(&machine.host);
        for (register, word) in [control::TIME_STEP, control::FRICTION, control::GRAVITY_Y].into_iter().zip(&words) {
            machine.host.set_control(register, *word);
        }
        for (channel, segment, beat, lane, word) in spoilt {
            let streams = lanes.len();
            let beats = &mut lanes[channel % streams].segments[segment];
            if let Some(beat) = beat.checked_rem(beats.len()) {
                beats[beat].0[lane] = word;
            }
        }
        let mut flight = Flight::default();
        machine.arm(&mut flight, &vec![5 * (usize::from(bodies) + 1); lanes.len()]);
        machine.start();
        machine.send(&mut flight, &lanes);
        // It completes or ends in a sticky error: never in a deadline, never in a DMA error.
        let result = machine.wait(&flight, LONG);
        prop_assert!(
            matches!(result, Ok(()) | Err(common::sg::Failure::Accelerator(..))),
            "{:?}", result
        );
        prop_assert!(machine.host.violations().is_empty());
    }

    #[test]
    fn a_board_is_built_or_its_configuration_is_refused(
        numbers in any::<[u32; 3]>(),
        delays in any::<[u64; 5]>(),
        window in any::<Option<u32>>(),
        rate in any::<u64>(),
    ) {
        let [length_width, address_width, pick] = numbers;
        let mut config = BoardConfig {
            length_width,
            address_width,
            window_slots: window,
            bandwidth: Bandwidth::BytesPerSecond(rate),
            ..BoardConfig::default()
        };
        // At most one option is out of range: otherwise hardly any board could be built.
        let wild = |k: u32| pick % 8 == k;
        if !wild(0) { config.length_width = 26; }
        if !wild(1) { config.address_width = 40; }
        if !wild(2) { config.window_slots = None; }
        if !wild(3) { config.bandwidth = Bandwidth::Unlimited; }
        let [access, halt, reset, fetch, fifo] = delays;
        if wild(4) { config.delays.register_access_ns = access; }
        if wild(5) { config.delays.halt = halt; }
        if wild(6) { config.delays.reset = reset; }
        if wild(7) {
            config.delays.descriptor_fetch = fetch;
            config.delays.fifo_beats = usize::try_from(fifo % (1 << 21)).expect("21 bits");
        }
        if let Ok(board) = EmulatedBoard::new(config) {
            let port = board.cpu_port();
            port.write32(dma_base(0), 1);
            port.write32(dma_base(1), 4);
            port.pause(microseconds(10));
            prop_assert_eq!(port.read32(CONTROL_BASE + 0x100), control::IDENTIFICATION_VALUE);
        }
    }
}

/// The programs above test little unless they reach these states.
#[test]
fn random_programs_reach_engines_interrupts_and_results() {
    let mut runner = TestRunner::deterministic();
    let programs = (config(), prop::collection::vec(act(), 1..120));
    let mut reached = [0_u32; 4];
    for _ in 0..100 {
        let (config, acts) = programs.new_tree(&mut runner).expect("nothing is rejected").current();
        let host = Host::new(config);
        let playground = Playground::new(&host);
        acts.iter().for_each(|act| playground.act(&host, act));
        let counts = host.board.counts();
        let done = [counts.beats_read, counts.beats_written, counts.descriptors, counts.interrupts];
        for (reached, done) in reached.iter_mut().zip(done) {
            *reached += u32::from(done > 0);
        }
    }
    assert!(reached.iter().all(|programs| *programs > 40), "{reached:?} of 100");
}

#[test]
fn delays_that_would_overflow_the_clock_are_refused_with_their_range() {
    let delays = BoardConfig::default().delays;
    for (name, delays) in [
        ("halt", Delays { halt: u64::MAX, ..delays }),
        ("reset", Delays { reset: u64::MAX, ..delays }),
        ("descriptor fetch", Delays { descriptor_fetch: u64::MAX, ..delays }),
    ] {
        let error = EmulatedBoard::new(BoardConfig { delays, ..BoardConfig::default() })
            .expect_err("the clock has 64 bits");
        assert!(error.to_string().starts_with(name), "{error}");
        assert!(error.to_string().contains("0 to 4294967296"), "{error}");
    }
}
