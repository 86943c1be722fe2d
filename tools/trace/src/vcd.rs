//! Writes a recorded step as a value change dump (IEEE 1364, clause 18), for `GTKWave`.
//!
//! Time counts from the begin of the recording, in picoseconds; each change stands at an edge of
//! the accelerator's clock, which itself is left out. Names of registers and stages are ASCII in
//! vectors.

use std::collections::BTreeMap;
use std::io::{self, Write};

use bitstream_model::recording::{ChannelRecording, Port};

use crate::{TracedStep, names};

/// Bits of a physical address.
const ADDRESS_BITS: usize = 40;
/// The stage of an accelerator that has none.
const IDLE: &str = "idle";

/// A signal of the dump.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Signal(usize);

impl Signal {
    /// Its identifier: printable letters, the least first.
    fn identifier(self) -> String {
        let Self(mut number) = self;
        let mut text = String::new();
        loop {
            let digit = u8::try_from(number % 94).unwrap_or_default();
            text.push(char::from(b'!' + digit));
            number /= 94;
            if number == 0 {
                return text;
            }
            number -= 1;
        }
    }
}

/// The bits of a value, the highest first.
fn bits(value: u64, width: usize) -> String {
    format!("{value:0width$b}")
}

/// The bits of a text, which ends at the lowest bit of a vector for the longest text.
fn ascii(text: &str, letters: usize) -> String {
    let padded = format!("{text:>letters$}");
    padded.bytes().map(|byte| format!("{byte:08b}")).collect()
}

/// The letters of the longest text, one at least.
fn longest(texts: &[(u64, String)]) -> usize {
    texts.iter().map(|(_, text)| text.len()).fold(1, usize::max)
}

/// The declarations, and the changes at each clock.
#[derive(Default)]
struct Dump {
    declarations: String,
    widths: Vec<usize>,
    /// In each clock the last value of a signal stands.
    changes: BTreeMap<u64, BTreeMap<Signal, String>>,
}

impl Dump {
    fn scope(&mut self, name: &str, declare: impl FnOnce(&mut Self)) {
        self.declarations += &format!("$scope module {name} $end\n");
        declare(self);
        self.declarations += "$upscope $end\n";
    }

    fn signal(&mut self, name: &str, width: usize) -> Signal {
        let signal = Signal(self.widths.len());
        self.widths.push(width);
        let range = if width == 1 { String::new() } else { format!(" [{}:0]", width - 1) };
        let identifier = signal.identifier();
        self.declarations += &format!("$var wire {width} {identifier} {name}{range} $end\n");
        signal
    }

    fn change(&mut self, clock: u64, signal: Signal, bits: String) {
        self.changes.entry(clock).or_default().insert(signal, bits);
    }

    fn level(&mut self, clock: u64, signal: Signal, level: bool) {
        self.change(clock, signal, String::from(if level { "1" } else { "0" }));
    }

    /// A vector with room for each of these texts, which it has from a clock on.
    fn texts(&mut self, name: &str, texts: &[(u64, String)]) {
        let letters = longest(texts);
        let signal = self.signal(name, 8 * letters);
        for (clock, text) in texts {
            self.change(*clock, signal, ascii(text, letters));
        }
    }

    fn number(&mut self, clock: u64, signal: Signal, value: u64) {
        let bits = bits(value, self.widths[signal.0]);
        self.change(clock, signal, bits);
    }
}

impl TracedStep<'_> {
    /// Writes the dump.
    ///
    /// # Errors
    /// The error of the output.
    pub fn write_vcd(&self, out: &mut dyn Write) -> io::Result<()> {
        let mut dump = Dump::default();
        dump.scope("board", |dump| {
            dump.scope("cpu", |dump| self.access_signals(dump));
            for channel in &self.recording.channels {
                dump.scope(&names::channel_scope(channel), |dump| stream_signals(dump, channel));
            }
            dump.scope("accelerator", |dump| self.accelerator_signals(dump));
            self.interrupt_signal(dump);
        });
        self.write_dump(&dump, out)
    }

    fn access_signals(&self, dump: &mut Dump) {
        let count = dump.signal("accesses", 32);
        let [read, write, doorbell] =
            ["read", "write", "doorbell"].map(|name| dump.signal(name, 1));
        let (address, data) = (dump.signal("address", ADDRESS_BITS), dump.signal("data", 32));
        let accesses = self.recording.accesses.iter();
        let names: Vec<_> =
            accesses.map(|access| (access.cycle, names::register(access.address))).collect();
        dump.texts("register", &names);
        for (number, access) in (1..).zip(&self.recording.accesses) {
            // A pulse of one clock; accesses in adjacent clocks tell apart by their number.
            let kind = if access.write { write } else { read };
            let other = if access.write { read } else { write };
            dump.level(access.cycle, kind, true);
            dump.level(access.cycle, other, false);
            dump.level(access.cycle + 1, kind, false);
            dump.number(access.cycle, count, number);
            dump.number(access.cycle, address, access.address);
            dump.number(access.cycle, data, access.value.into());
        }
        for clock in &self.recording.doorbells {
            dump.level(*clock, doorbell, true);
            dump.level(clock + 1, doorbell, false);
        }
    }

    fn accelerator_signals(&self, dump: &mut Dump) {
        let (busy, waits) = (dump.signal("busy", 1), dump.signal("waits", 1));
        let mut stages = vec![(self.recording.span.begin, IDLE.to_owned())];
        for one in &self.recording.stages {
            dump.level(one.span.begin, busy, true);
            stages.push((one.span.begin, names::stage(one.stage)));
            // The next stage, if one follows at once, replaces this.
            dump.level(one.span.end, busy, false);
            stages.push((one.span.end, IDLE.to_owned()));
        }
        dump.texts("stage", &stages);
        for wait in &self.recording.waits {
            dump.level(wait.begin, waits, true);
            dump.level(wait.end, waits, false);
        }
    }

    fn interrupt_signal(&self, dump: &mut Dump) {
        let line = dump.signal("interrupt", 1);
        let mut level = self.recording.interrupt.first;
        dump.level(self.recording.span.begin, line, level);
        for edge in &self.recording.interrupt.edges {
            level = !level;
            dump.level(*edge, line, level);
        }
    }

    /// Picoseconds from the begin of the recording to a clock.
    fn picoseconds(&self, clock: u64) -> u128 {
        let clocks = u128::from(clock.saturating_sub(self.recording.span.begin));
        clocks * 1_000_000_000 / u128::from(self.recording.clock_khz)
    }

    fn write_dump(&self, dump: &Dump, out: &mut dyn Write) -> io::Result<()> {
        let Dump { declarations, widths, changes } = dump;
        writeln!(out, "$version zynq-pgs {} $end", env!("CARGO_PKG_VERSION"))?;
        writeln!(
            out,
            "$comment {}: clock {} kHz, from clock {} on; clock = {} + time * {} / 10^9, rounded \
             up $end",
            self.design,
            self.recording.clock_khz,
            self.recording.span.begin,
            self.recording.span.begin,
            self.recording.clock_khz,
        )?;
        writeln!(out, "$timescale 1 ps $end\n{declarations}$enddefinitions $end")?;
        let mut values: Vec<String> = widths.iter().map(|width| bits(0, *width)).collect();
        let begin = self.recording.span.begin;
        if let Some(first) = changes.get(&begin) {
            for (signal, value) in first {
                values[signal.0].clone_from(value);
            }
        }
        writeln!(out, "#0\n$dumpvars")?;
        for (number, value) in values.iter().enumerate() {
            write_value(out, Signal(number), value)?;
        }
        writeln!(out, "$end")?;
        for (clock, changes) in changes.range(begin + 1..) {
            let changed = changes.iter().filter(|(signal, value)| values[signal.0] != **value);
            let changed: Vec<_> = changed.collect();
            if changed.is_empty() {
                continue;
            }
            writeln!(out, "#{}", self.picoseconds(*clock))?;
            for (signal, value) in changed {
                write_value(out, *signal, value)?;
                values[signal.0].clone_from(value);
            }
        }
        let end = changes.keys().next_back().copied().unwrap_or_default();
        writeln!(out, "#{}", self.picoseconds(end.max(self.recording.span.end)))
    }
}

fn write_value(out: &mut dyn Write, signal: Signal, bits: &str) -> io::Result<()> {
    let identifier = signal.identifier();
    if bits.len() == 1 {
        return writeln!(out, "{bits}{identifier}");
    }
    // A shorter vector is extended by zeros.
    let short = bits.trim_start_matches('0');
    writeln!(out, "b{} {identifier}", if short.is_empty() { "0" } else { short })
}

/// The signals of a stream's port: a clock with TVALID and TREADY moves a beat, or on a stream of
/// less than 128 bits a part of one.
fn stream_signals(dump: &mut Dump, channel: &ChannelRecording) {
    let [valid, ready, last] = ["tvalid", "tready", "tlast"].map(|name| dump.signal(name, 1));
    let [packets, descriptors] =
        ["packets_ended", "descriptors_ended"].map(|name| dump.signal(name, 32));
    for state in &channel.port {
        dump.level(state.begin, last, false);
        match state.port {
            Port::Moves { last: ends, .. } => {
                let end = state.end_of_beats();
                for signal in [valid, ready] {
                    dump.level(state.begin, signal, true);
                    // The next state, if it begins here, replaces this.
                    dump.level(end, signal, false);
                }
                if ends {
                    dump.level(end - 1, last, true);
                    dump.level(end, last, false);
                }
            }
            Port::Rests { valid: sender, ready: receiver } => {
                dump.level(state.begin, valid, sender);
                dump.level(state.begin, ready, receiver);
            }
        }
    }
    let ended = channel.packets.iter().filter(|packet| packet.ended);
    for (number, packet) in (1..).zip(ended) {
        dump.number(packet.span.end, packets, number);
    }
    let ended = channel.descriptors.iter().filter(|descriptor| descriptor.ended);
    for (number, descriptor) in (1..).zip(ended) {
        dump.number(descriptor.span.end, descriptors, number);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bitstream_model::interface::address_map::CONTROL_BASE;
    use bitstream_model::interface::control::REGISTERS;

    #[test]
    fn identifiers_are_short_and_differ() {
        let all: Vec<_> = (0..9000).map(|number| Signal(number).identifier()).collect();
        assert_eq!((all[0].as_str(), all[93].as_str(), all[94].as_str()), ("!", "~", "!!"));
        let different: std::collections::HashSet<_> = all.iter().collect();
        assert_eq!(different.len(), all.len());
    }

    #[test]
    fn a_text_ends_at_the_lowest_bit_of_its_vector() {
        assert_eq!(ascii("ab", 2), "0110000101100010");
        assert_eq!(ascii("ab", 3), format!("00100000{}", ascii("ab", 2)));
    }

    #[test]
    fn every_register_has_its_whole_name() {
        let texts: Vec<_> = REGISTERS
            .iter()
            .map(|row| (7, names::register(CONTROL_BASE + u64::from(row.offset))))
            .chain([(7, "a".to_owned())])
            .collect();
        let letters = longest(&texts);
        for (row, (_, text)) in REGISTERS.iter().zip(&texts) {
            assert_eq!(*text, format!("control {}", row.name));
            let bits = ascii(text, letters);
            assert_eq!(bits.len(), 8 * letters);
            let byte = |at: usize| u8::from_str_radix(&bits[at..at + 8], 2).expect("bits");
            let read: Vec<u8> = (0..letters).map(|letter| byte(8 * letter)).collect();
            assert_eq!(String::from_utf8(read).expect("letters").trim_start(), text);
        }
        let mut dump = Dump::default();
        dump.texts("register", &texts);
        assert_eq!(dump.widths, [8 * letters]);
    }
}
