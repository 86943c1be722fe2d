//! Tests that the self-test passes on a good board, and names the cause on a bad one.

#![cfg(feature = "emulation")]

use bitstream_model::interface::fence::Fence;
use bitstream_model::interface::number::{Numbers, Precision};
use bitstream_model::interface::profile::{FLOAT, HALF, Inertia, PROFILES};
use bitstream_model::{
    Bandwidth, BoardConfig, Coherency, Direction, EmulatedBoard, InterruptWiring, Master, Quirks,
    Resettable,
};
use zynq_pgs::check::Outcome;
use zynq_pgs::error::OpenError;
use zynq_pgs::{Accelerator, BoardChoice, CheckReport, Error, OpenOptions, check};

const NAMES: [&str; 13] = [
    "identification",
    "interface version",
    "capabilities",
    "register regions",
    "reset",
    "dma mode",
    "length register",
    "echo",
    "sums",
    "coherency",
    "interrupt",
    "issue queue",
    "fence",
];

/// A board with a fence.
fn fenced() -> BoardConfig {
    BoardConfig { fence: Some(Fence::default()), ..BoardConfig::default() }
}

fn checked(config: BoardConfig) -> (CheckReport, EmulatedBoard) {
    let board = EmulatedBoard::new(config).expect("a board that can be built");
    let port = BoardChoice::Emulated(board.cpu_port());
    let report = check(OpenOptions { board: port, ..OpenOptions::default() }).expect("reachable");
    assert_eq!(report.lines.iter().map(|line| line.name).collect::<Vec<_>>(), NAMES);
    assert_eq!(board.violations(), [], "the self-test breaks no rule of the board");
    (report, board)
}

fn detail<'a>(report: &'a CheckReport, name: &str) -> &'a str {
    let line = report.lines.iter().find(|line| line.name == name).expect("a line of that name");
    match &line.outcome {
        Outcome::Ok { detail } => detail,
        other => panic!("{name}: {other:?}"),
    }
}

/// Checks a board with these quirks. `name` alone fails: its `found`, `expected` and `next` texts
/// contain the given ones. The lines behind it are skipped if `stops`.
fn fails(quirks: Quirks, name: &str, stops: bool, [found, expected, next]: [&str; 3]) {
    // One that says a queue has none.
    let queue = quirks.queue.map(|_| 0);
    let (report, board) = checked(BoardConfig { quirks, queue, ..fenced() });
    assert!(!report.passed());
    let place = NAMES.iter().position(|line| *line == name).expect("a line of that name");
    for (index, line) in report.lines.iter().enumerate() {
        match &line.outcome {
            Outcome::Ok { .. } => assert!(index < place || index > place && !stops, "{line:?}"),
            Outcome::Skipped { reason } => {
                assert!(index > place && (stops || line.name == "issue queue"), "{line:?}");
                assert_eq!(reason, &format!("needs the line \"{name}\""));
            }
            Outcome::Failed { found: seen, expected: wanted, next: advice } => {
                assert_eq!(line.name, name, "{line:?}");
                assert!(seen.contains(found), "{line:?}");
                assert!(wanted.contains(expected), "{line:?}");
                assert!(advice.contains(next), "{line:?}");
            }
            other => panic!("{other:?}"),
        }
    }
    // The clock is virtual: a wait without end would never return, and a wait of minutes would show
    // here.
    let seconds = board.counts().cycles / 275_000_000;
    assert!(seconds < 5, "{seconds} s on the board's clock");
}

#[test]
fn a_board_as_it_should_be_passes_every_line() {
    let (report, board) = checked(fenced());
    assert!(report.passed());
    assert_eq!(detail(&report, "identification"), "0x50475331 (\"PGS1\")");
    assert_eq!(detail(&report, "interface version"), "2.0");
    assert!(
        detail(&report, "capabilities")
            .starts_with("profile float, 4 + 4 streams of 128 bits, 275000 kHz")
    );
    assert!(detail(&report, "length register").starts_with("26 bits on 8 channels"));
    assert!(detail(&report, "echo").contains("1, 7, 101, 4099 bodies"));
    assert!(detail(&report, "sums").contains("4 steps"));
    assert!(detail(&report, "coherency").contains("3 rounds of 1501 bodies"));
    assert!(detail(&report, "interrupt").contains("each of 3 steps"));
    // The number of descriptors of the echoes follows from their lengths in pieces of 192 bytes:
    // - 1 body: 2 velocities and 2 poses, 1 result on each of 4 channels;
    // - 7 bodies: one each on 3 x 4 channels;
    // - 101 bodies: 50 or 51 beats are 5 pieces, twice 4 channels, and 101 result beats are 9;
    // - 4099 bodies: one each.
    let descriptors = (2 + 2 + 4) + 12 + (2 * 4 * 5 + 4 * 9) + 12;
    assert!(detail(&report, "echo").contains(&format!("{descriptors} descriptors")));
    let fence = "0x50000000+64M holds 12 masters";
    assert!(detail(&report, "fence").starts_with(fence), "{}", detail(&report, "fence"));
    assert!(board.counts().cycles < 275_000 * 100, "less than 0.1 s on the board's clock");
}

/// Why a line was skipped.
fn skipped<'a>(report: &'a CheckReport, name: &str) -> &'a str {
    let line = report.lines.iter().find(|line| line.name == name).expect("a line of that name");
    match &line.outcome {
        Outcome::Skipped { reason } => reason,
        other => panic!("{name}: {other:?}"),
    }
}

#[test]
fn the_fence_of_every_profile_is_proven_master_by_master() {
    for profile in PROFILES {
        for address_width in [32, 40] {
            let (report, _) = checked(BoardConfig { profile, address_width, ..fenced() });
            assert!(report.passed(), "{report:#?}");
            let masters = 3 * profile.mm2s_widths.len();
            let expected = format!(
                "0x50000000+64M holds {masters} masters: each met a decode error in the 65536 \
                 bytes at 0x54000000"
            );
            assert_eq!(detail(&report, "fence"), expected, "{}", profile.name);
        }
    }
}

/// A step with the memory of an open master in the guard works: nothing outside the granted memory
/// and the guard is touched (`checked` finds no violation), and the other masters are held.
#[test]
fn each_master_that_the_fence_does_not_hold_is_named_and_reaches_the_guard_alone() {
    const ALL: [(usize, Master); 12] = {
        let mut all = [(0, Master::Sg); 12];
        let mut k = 0;
        while k < 12 {
            all[k] = (k / 3, Master::ALL[k % 3]);
            k += 1;
        }
        all
    };
    const TEXTS: [&str; 3] = ["SG", "MM2S", "S2MM"];
    for (k, (core, _)) in ALL.iter().enumerate() {
        let quirks = Quirks { unfenced: &ALL[k..=k], ..Quirks::default() };
        let found = format!("dma{core} {} in reach of 0x54000000", TEXTS[k % 3]);
        fails(quirks, "fence", false, [&found, "12 masters", "block design"]);
    }
    let names: Vec<_> = (0..12).map(|k| format!("dma{} {}", k / 3, TEXTS[k % 3])).collect();
    let quirks = Quirks { unfenced: &ALL, ..Quirks::default() };
    fails(quirks, "fence", false, [&names.join(", "), "12 masters", "block design"]);
}

#[test]
fn without_a_fence_or_a_guard_nothing_is_proven_and_nothing_fails() {
    let no_guard = Quirks { no_guard: true, ..Quirks::default() };
    let at_the_end = Fence::new(0x7C00_0000, 64 << 20);
    for (config, why) in [
        (BoardConfig::default(), "not proven: the bitstream reports no fence"),
        (BoardConfig { quirks: no_guard, ..fenced() }, "not proven: no memory is reserved behind"),
        (BoardConfig { fence: at_the_end, ..fenced() }, "not proven: no memory is reserved behind"),
    ] {
        let (report, _) = checked(config);
        assert!(report.passed(), "{report:#?}");
        assert!(skipped(&report, "fence").starts_with(why), "{}", skipped(&report, "fence"));
    }
}

#[test]
fn boards_of_other_builds_pass_too() {
    for config in [
        BoardConfig { length_width: 8, address_width: 32, ..BoardConfig::default() },
        BoardConfig { length_width: 14, ..BoardConfig::default() },
        BoardConfig { address_width: 64, ..BoardConfig::default() },
        BoardConfig {
            hazards: bitstream_model::Hazards::Unchecked,
            bandwidth: bitstream_model::Bandwidth::Unlimited,
            ..BoardConfig::default()
        },
    ] {
        let (report, _) = checked(config);
        assert!(report.passed(), "{report:#?}");
        let length = detail(&report, "length register");
        assert!(length.starts_with(&format!("{} bits", config.length_width)), "{length}");
        // The driver works with a narrow register, and reports its cost.
        assert_eq!(length.contains("fewer descriptors"), config.length_width < 26, "{length}");
    }
}

#[test]
fn boards_of_every_profile_pass_every_line() {
    // Arrays of sixteen bits behind streams of thirty-two.
    let short = Numbers { velocities: Precision::Binary16, ..FLOAT.numbers };
    let mut configs = Vec::new();
    for profile in PROFILES {
        for inertia in profile.inertias().iter().copied() {
            configs.push(BoardConfig { profile, inertia, ..BoardConfig::default() });
        }
    }
    configs.extend([BoardConfig { numbers: Some(short), ..BoardConfig::default() }]);
    for config in configs {
        let (report, _) = checked(config);
        assert!(report.passed(), "{report:#?}");
        let lines = detail(&report, "capabilities");
        assert!(lines.starts_with(&format!("profile {}, ", config.profile.name)), "{lines}");
        assert_eq!(lines.contains("world inertia"), config.inertia == Inertia::World, "{lines}");
    }
}

/// Stale data is named on a board whose results carry padding, too.
#[test]
fn stale_data_is_named_on_a_board_of_sixteen_bits() {
    for (coherency, side) in [
        (Coherency::StaleReads { from_byte: 0 }, "MM2S"),
        (Coherency::StaleWrites { from_byte: 0 }, "S2MM"),
    ] {
        let quirks = Quirks { coherency, ..Quirks::default() };
        let (report, _) = checked(BoardConfig { profile: &HALF, quirks, ..BoardConfig::default() });
        let line = report.lines.iter().find(|line| line.name == "coherency").expect("a line");
        assert!(
            matches!(&line.outcome, Outcome::Failed { found, .. }
                if found.starts_with("stale data") && found.contains(side)),
            "{line:?}"
        );
    }
}

#[test]
fn another_design_is_named_by_its_identification() {
    let quirks = Quirks { identification: 0x1234_5678, ..Quirks::default() };
    fails(quirks, "identification", true, ["0x12345678", "0x50475331", "load the accelerator's"]);
    let quirks = Quirks { identification: u32::MAX, ..Quirks::default() };
    fails(quirks, "identification", true, ["nothing answers", "0x50475331", "clock"]);
}

#[test]
fn another_interface_version_is_named() {
    let quirks = Quirks { version: 0x0001_0001, ..Quirks::default() };
    fails(quirks, "interface version", true, ["1.1", "2.x", "driver that belongs"]);
}

#[test]
fn a_length_register_that_no_core_can_have_ends_the_test() {
    for width in [1, 6, 7] {
        let quirks = Quirks { length_register: Some(width), ..Quirks::default() };
        let found = format!("{width} bits on all 8 channels");
        fails(quirks, "length register", true, [&found, "26 bits", "8 to 26 bits"]);
    }
}

#[test]
fn a_length_register_of_14_bits_is_found_and_the_rest_goes_on_with_it() {
    let quirks = Quirks { length_register: Some(14), ..Quirks::default() };
    let texts = ["14 bits on all 8 channels", "26 bits, as the bitstream says", "width of 14"];
    fails(quirks, "length register", false, texts);
}

#[test]
fn a_reset_that_never_ends_is_named_by_its_part() {
    for core in 0..4 {
        let quirks = Quirks { held_reset: Some(Resettable::Dma(core)), ..Quirks::default() };
        let name = format!("dma{core} MM2S in reset (0x00010006");
        fails(quirks, "reset", true, [&name, "10ms", "reset input"]);
    }
    let quirks = Quirks { held_reset: Some(Resettable::Accelerator), ..Quirks::default() };
    fails(quirks, "reset", true, ["the accelerator in reset", "10ms", "reset input"]);
}

#[test]
fn data_that_the_device_read_stale_is_named_with_its_channel_and_offset() {
    for (from_byte, offset) in [(0, "0x0 "), (0x400, "0x400 "), (0x1008, "0x1010 ")] {
        let coherency = Coherency::StaleReads { from_byte };
        let found = format!("dma0 MM2S read at byte {offset}of its buffer");
        let quirks = Quirks { coherency, ..Quirks::default() };
        fails(quirks, "coherency", false, [&found, "round 2", "synchronise"]);
    }
}

#[test]
fn results_that_the_cpu_sees_stale_are_named_with_their_channel_and_offset() {
    for (from_byte, offset) in [(0, "0x0 "), (0x400, "0x400 "), (0x1008, "0x1010 ")] {
        let coherency = Coherency::StaleWrites { from_byte };
        let found = format!("at byte {offset}of the buffer of dma0 S2MM the CPU finds");
        let quirks = Quirks { coherency, ..Quirks::default() };
        fails(quirks, "coherency", false, [&found, "round 2", "synchronise"]);
    }
}

#[test]
fn an_interrupt_that_never_comes_or_always_stands_is_told_apart() {
    let quirks = Quirks { interrupt: InterruptWiring::Disconnected, ..Quirks::default() };
    let texts = ["0 of 3 steps", "at the end of every step", "connected"];
    fails(quirks, "interrupt", false, texts);
    let quirks = Quirks { interrupt: InterruptWiring::StuckHigh, ..Quirks::default() };
    let texts = ["nothing asks for one", "quiet", "level, active high"];
    fails(quirks, "interrupt", false, texts);
}

#[test]
fn a_queue_that_is_not_there_is_found_by_the_order_of_issue() {
    let quirks = Quirks { queue: Some(64), ..Quirks::default() };
    let found = "the bits of the order of the list, 4080 cycles of stalls";
    let expected = "the third of three collisions ahead of the second, 2576 cycles of stalls";
    fails(quirks, "issue queue", false, [found, expected, "past the queue"]);
}

#[test]
fn the_queue_of_every_depth_passes_and_a_board_without_one_is_not_asked() {
    for (depth, profile) in [(0, &FLOAT), (2, &FLOAT), (32, &FLOAT), (256, &FLOAT), (0, &HALF)] {
        for bandwidth in [Bandwidth::Unlimited, Bandwidth::BytesPerSecond(1_000_000_000)] {
            let config = BoardConfig { queue: Some(depth), profile, bandwidth, ..fenced() };
            let (report, _) = checked(config);
            assert!(report.passed(), "{report:#?}");
            match depth {
                0 => {
                    assert_eq!(skipped(&report, "issue queue"), "the bitstream has no issue queue");
                }
                _ => assert!(detail(&report, "issue queue").ends_with(" 2576 cycles of stalls")),
            }
        }
    }
}

#[test]
fn a_core_without_scatter_gather_is_named() {
    let (report, _) = checked(BoardConfig { scatter_gather: false, ..BoardConfig::default() });
    let failed: Vec<_> = report
        .lines
        .iter()
        .filter(|line| matches!(line.outcome, Outcome::Failed { .. }))
        .map(|line| line.name)
        .collect();
    assert_eq!(failed, ["dma mode"]);
}

#[test]
fn a_stream_that_carries_nothing_ends_the_test_at_the_echo() {
    for core in 0..4 {
        // A single body has nothing for the last two senders: a later echo finds their fault.
        for direction in [Direction::Mm2s, Direction::S2mm] {
            let quirks = Quirks { unconnected: Some((core, direction)), ..Quirks::default() };
            let found = format!("no end after 200ms: dma{core} {direction} 0x");
            fails(quirks, "echo", true, [&found, "within 200ms", "stream of the named channel"]);
        }
    }
}

#[test]
fn a_length_width_that_was_given_is_what_the_cores_are_held_against() {
    let quirks = Quirks { length_register: Some(14), ..Quirks::default() };
    let board = EmulatedBoard::new(BoardConfig { quirks, ..BoardConfig::default() })
        .expect("a board that can be built");
    let options = |width| OpenOptions {
        board: BoardChoice::Emulated(board.cpu_port()),
        length_width: Some(width),
        ..OpenOptions::default()
    };
    let report = check(options(14)).expect("reachable");
    assert!(report.passed(), "{report:#?}");
    assert!(detail(&report, "length register").contains("as given"));
    // The advice of the failing line is the option that opening needs.
    assert!(Accelerator::open(options(14)).is_ok());
    assert!(Accelerator::open(options(26)).is_err());
    assert!(matches!(check(options(27)), Err(Error::Open(OpenError::LengthWidth { .. }))));
}

#[test]
fn a_board_that_was_checked_can_be_checked_again_and_opened() {
    let board = EmulatedBoard::new(BoardConfig::default()).expect("a board");
    let options =
        || OpenOptions { board: BoardChoice::Emulated(board.cpu_port()), ..OpenOptions::default() };
    let first = check(options()).expect("reachable");
    assert_eq!(check(options()).expect("reachable"), first);
    Accelerator::open(options()).expect("nothing is left running");
    assert_eq!(board.violations(), []);
}
