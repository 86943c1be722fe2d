//! Writes a recorded step as a value change dump (IEEE 1364, clause 18), for `GTKWave`.
//!
//! Time counts from the begin of the recording, in picoseconds; each change stands at an edge of the
//! accelerator's clock, which itself is left out. Names of registers and stages are ASCII in vectors.

use std::collections::BTreeMap;
use std::io::{self, Write};

use bitstream_model::recording::{ChannelRecording, Port};

use crate::{TracedStep, names};

/// Bits of a physical address.
const ADDRESS_BITS: usize = 40;
/// Letters of a register's name, and of a stage's.
const REGISTER_LETTERS: usize = 24;
const STAGE_LETTERS: usize = 12;

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

/// The bits of a text, which ends at the lowest bit.
fn ascii(text: &str, letters: usize) -> String {
    let padded = format!("{text:>letters$.letters$}");
    padded.bytes().map(|byte| format!("{byte:08b}")).collect()
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
        let name = dump.signal("register", 8 * REGISTER_LETTERS);
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
            let text = ascii(&names::register(access.address), REGISTER_LETTERS);
            dump.change(access.cycle, name, text);
        }
        for clock in &self.recording.doorbells {
            dump.level(*clock, doorbell, true);
            dump.level(clock + 1, doorbell, false);
        }
    }

    fn accelerator_signals(&self, dump: &mut Dump) {
        let (busy, waits) = (dump.signal("busy", 1), dump.signal("waits", 1));
        let stage = dump.signal("stage", 8 * STAGE_LETTERS);
        dump.change(self.recording.span.begin, stage, ascii("idle", STAGE_LETTERS));
        for one in &self.recording.stages {
            dump.level(one.span.begin, busy, true);
            dump.change(one.span.begin, stage, ascii(&names::stage(one.stage), STAGE_LETTERS));
            // The next stage, if one follows at once, replaces this.
            dump.level(one.span.end, busy, false);
            dump.change(one.span.end, stage, ascii("idle", STAGE_LETTERS));
        }
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
            "$comment {}: clock {} kHz, from clock {} on; clock = {} + time * {} / 10^9, rounded up $end",
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

/// The signals of a stream's port: a clock with TVALID and TREADY moves a beat, or on a stream of less
/// than 128 bits a part of one.
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
    for (number, packet) in (1..).zip(&channel.packets) {
        dump.number(packet.span.end, packets, number);
    }
    for (number, descriptor) in (1..).zip(&channel.descriptors) {
        dump.number(descriptor.span.end, descriptors, number);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn identifiers_are_short_and_differ() {
        let all: Vec<_> = (0..9000).map(|number| Signal(number).identifier()).collect();
        assert_eq!((all[0].as_str(), all[93].as_str(), all[94].as_str()), ("!", "~", "!!"));
        let different: std::collections::HashSet<_> = all.iter().collect();
        assert_eq!(different.len(), all.len());
    }

    #[test]
    fn a_text_is_cut_to_its_vector_and_ends_at_its_lowest_bit() {
        assert_eq!(ascii("ab", 2), "0110000101100010");
        assert_eq!(ascii("ab", 3), format!("00100000{}", ascii("ab", 2)));
        assert_eq!(ascii("abc", 2), ascii("ab", 2));
    }
}
