//! Reads a value change dump, and holds it against the board's own logs and counts.

use std::collections::BTreeMap;

use bitstream_model::{BoardConfig, Direction, PacketCount, RegisterAccess};

use crate::step::Taken;

/// A dump as read: for each signal its changes, with the clocks.
struct Dump {
    signals: BTreeMap<String, Vec<(u64, u64)>>,
    end: u64,
}

/// Reads a dump by the letters of the standard; `clock` makes clocks of its times.
fn read(text: &str, clock: impl Fn(u128) -> u64) -> Dump {
    let mut names = BTreeMap::new();
    let mut scopes: Vec<&str> = Vec::new();
    let mut signals: BTreeMap<String, Vec<(u64, u64)>> = BTreeMap::new();
    let (mut now, mut last_time) = (None, None);
    for line in text.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words.as_slice() {
            ["$scope", "module", name, "$end"] => scopes.push(name),
            ["$upscope", "$end"] => {
                scopes.pop().expect("a scope");
            }
            ["$var", "wire", _, identifier, name, ..] => {
                let path = format!("{}.{name}", scopes.join("."));
                assert!(names.insert(*identifier, path).is_none(), "{identifier} comes twice");
            }
            ["$timescale", "1", "ps", "$end"] | ["$dumpvars"] | ["$end"] => {}
            ["$version" | "$comment" | "$enddefinitions", .., "$end"] => {}
            [time] if time.starts_with('#') => {
                let time: u128 = time[1..].parse().expect("a number");
                assert!(last_time.is_none_or(|last| last <= time), "time goes back at {time}");
                last_time = Some(time);
                now = Some(clock(time));
            }
            [value, identifier] if value.starts_with('b') => {
                // A text is longer than a number; its last letters tell it from the others.
                let bits = &value[1..];
                let low = &bits[bits.len().saturating_sub(64)..];
                let value = u64::from_str_radix(low, 2).expect("bits");
                let changes = signals.entry(names[identifier].clone()).or_default();
                changes.push((now.expect("a time"), value));
            }
            [change] => {
                let (value, identifier) = change.split_at(1);
                let value = value.parse().expect("a bit");
                let changes = signals.entry(names[identifier].clone()).or_default();
                changes.push((now.expect("a time"), value));
            }
            _ => panic!("a line that no dump has: {line}"),
        }
    }
    Dump { signals, end: now.expect("a time") }
}

impl Dump {
    fn changes(&self, name: &str) -> &[(u64, u64)] {
        self.signals.get(name).unwrap_or_else(|| panic!("no signal {name}"))
    }

    fn at(&self, name: &str, clock: u64) -> u64 {
        let before = self.changes(name).iter().take_while(|(at, _)| *at <= clock);
        before.last().map_or(0, |(_, value)| *value)
    }

    /// The clocks at which a line rises.
    fn rises(&self, name: &str) -> Vec<u64> {
        self.changes(name).iter().filter(|(_, value)| *value == 1).map(|(at, _)| *at).collect()
    }

    /// Clocks in which all of these lines are 1.
    fn clocks(&self, names: &[String]) -> u64 {
        let mut times: Vec<u64> =
            names.iter().flat_map(|name| self.changes(name)).map(|(at, _)| *at).collect();
        times.push(self.end);
        times.sort_unstable();
        let high = |at| names.iter().all(|name| self.at(name, at) == 1);
        times.windows(2).filter(|two| high(two[0])).map(|two| two[1] - two[0]).sum()
    }
}

/// Asserts that the dump shows the accesses, beats, packets and the interrupt that the board
/// counts.
pub(crate) fn assert_agrees(taken: &Taken) {
    let recording = &taken.recording;
    let mut out = Vec::new();
    taken.traced().write_vcd(&mut out).expect("a vector takes all");
    let text = String::from_utf8(out).expect("text");
    let khz = u128::from(recording.clock_khz);
    // As the comment in the dump says.
    let clock = |time: u128| {
        recording.span.begin + u64::try_from((time * khz).div_ceil(1_000_000_000)).expect("clocks")
    };
    let dump = read(&text, clock);
    let [before, after] = &taken.counts;

    let accesses: Vec<RegisterAccess> = dump
        .changes("board.cpu.accesses")
        .iter()
        .filter(|(_, number)| *number > 0)
        .map(|(cycle, _)| RegisterAccess {
            cycle: *cycle,
            address: dump.at("board.cpu.address", *cycle),
            write: dump.at("board.cpu.write", *cycle) == 1,
            value: u32::try_from(dump.at("board.cpu.data", *cycle)).expect("32 bits"),
        })
        .collect();
    let of = |write| accesses.iter().filter(|access| access.write == write).count() as u64;
    assert_eq!(of(false), after.register_reads - before.register_reads);
    assert_eq!(of(true), after.register_writes - before.register_writes);
    let log: Vec<_> =
        taken.accesses.iter().copied().filter(|one| one.cycle > before.cycles).collect();
    assert!(log.len() >= 20 && accesses.ends_with(&log), "{accesses:?}");
    assert_eq!(dump.rises("board.cpu.write").len() as u64, of(true));
    assert_eq!(dump.rises("board.cpu.read").len() as u64, of(false));
    let bells = dump.rises("board.cpu.doorbell").len() as u64;
    assert_eq!(bells, after.doorbells - before.doorbells);

    for channel in &recording.channels {
        let scope = match channel.direction {
            Direction::Mm2s => format!("board.mm2s{}", channel.core),
            Direction::S2mm => format!("board.s2mm{}", channel.core),
        };
        let line = |name| format!("{scope}.{name}");
        let packets: Vec<&PacketCount> = taken
            .packets
            .iter()
            .filter(|one| (one.core, one.direction) == (channel.core, channel.direction))
            .collect();
        let beats: u64 = packets.iter().map(|packet| packet.beats).sum();
        let handshake = [line("tvalid"), line("tready")];
        let last = [line("tvalid"), line("tready"), line("tlast")];
        let profile = taken.config.profile;
        let widths = match channel.direction {
            Direction::Mm2s => profile.mm2s_widths,
            Direction::S2mm => profile.s2mm_widths,
        };
        // A narrow stream takes several transfers for a beat.
        let transfers = widths.get(channel.core).map_or(0, |width| u64::from(128 / width));
        assert_eq!(dump.clocks(&handshake), transfers * beats, "{scope}");
        assert_eq!(dump.clocks(&last), packets.len() as u64, "{scope}");
        assert_eq!(dump.at(&line("packets_ended"), dump.end), packets.len() as u64);
        let descriptors: u32 = packets.iter().map(|packet| packet.descriptors).sum();
        assert_eq!(dump.at(&line("descriptors_ended"), dump.end), u64::from(descriptors));
    }

    let cycles = taken.report.as_ref().expect("no fault").cycles;
    assert_eq!(dump.clocks(&["board.accelerator.busy".to_owned()]), cycles.total);
    assert_eq!(dump.clocks(&["board.accelerator.waits".to_owned()]), cycles.waits);
    let rises = dump.rises("board.interrupt");
    assert_eq!(rises.len() as u64, after.interrupts - before.interrupts);
    // The pulse of an access in the last clock ends after it.
    assert!((0..=1).contains(&(dump.end - recording.span.end)), "{}", dump.end);
}

#[test]
fn edges_of_registers_and_streams_agree_with_the_board() {
    for length_width in [26, 10] {
        let config = BoardConfig { length_width, ..BoardConfig::default() };
        assert_agrees(&Taken::new(config));
    }
}
