//! Writes a recorded step as trace events (the JSON of Chrome's tracing), for Perfetto.
//!
//! Two processes, because two clocks tell the time: the board's, modelled, and the host's. Both
//! begin at 0; a place in one says nothing about the other. `docs/trace.schema.json` has the
//! layout.

use std::io::{self, Write};

use bitstream_model::Direction;
use bitstream_model::recording::{ChannelRecording, PacketSpan, Port, PortState, Span};
use serde_json::{Value, json};

use crate::{TracedStep, names};

/// Version of the layout; it grows when a key changes its meaning or goes.
pub const SCHEMA: u32 = 1;

/// The processes.
const BOARD: u32 = 1;
const HOST: u32 = 2;

/// Threads of the board; a channel's follow its number.
const CPU: usize = 1;
const ACCELERATOR: usize = 2;
const WAITS: usize = 3;
const INTERRUPT: usize = 4;
const CHANNELS: usize = 10;

/// Threads of a channel.
const PACKETS: usize = 0;
const DESCRIPTORS: usize = 1;
const OF_CHANNEL: usize = 2;

fn metadata(kind: &str, process: u32, thread: usize, arguments: &Value) -> Value {
    json!({ "ph": "M", "name": kind, "pid": process, "tid": thread, "args": arguments })
}

impl TracedStep<'_> {
    /// Writes the events, one a line.
    ///
    /// # Errors
    /// The error of the output.
    pub fn write_events(&self, out: &mut dyn Write) -> io::Result<()> {
        let mut events = self.name_events();
        self.access_events(&mut events);
        for (number, channel) in self.recording.channels.iter().enumerate() {
            self.channel_events(CHANNELS + OF_CHANNEL * number, channel, &mut events);
        }
        self.stage_events(&mut events);
        self.host_events(&mut events);
        let about = json!({
            "schema": SCHEMA,
            "generator": format!("zynq-pgs {}", env!("CARGO_PKG_VERSION")),
            "design": self.design,
            "clock_khz": self.recording.clock_khz,
            "first_clock": self.recording.span.begin,
            "clocks": format!(
                "process {BOARD}: the emulated board's clock, modelled; process {HOST}: the clock \
                 of the machine that emulates it, measured; both from 0, independently of each \
                 other"
            ),
        });
        writeln!(
            out,
            "{{\"displayTimeUnit\": \"ns\",\n\"otherData\": {about},\n\"traceEvents\": ["
        )?;
        for (number, event) in events.iter().enumerate() {
            let comma = if number + 1 < events.len() { "," } else { "" };
            writeln!(out, "{event}{comma}")?;
        }
        writeln!(out, "]}}")
    }

    fn name_events(&self) -> Vec<Value> {
        let board = format!("board: modelled clock, {} MHz", self.megahertz());
        let mut events = vec![
            metadata("process_name", BOARD, 0, &json!({ "name": board })),
            metadata("process_name", HOST, 0, &json!({ "name": "host: clock of this machine" })),
        ];
        let mut thread = |process, number: usize, name: &str| {
            events.push(metadata("thread_name", process, number, &json!({ "name": name })));
            let order = json!({ "sort_index": number });
            events.push(metadata("thread_sort_index", process, number, &order));
        };
        thread(BOARD, CPU, "CPU: register accesses");
        thread(BOARD, ACCELERATOR, "accelerator");
        thread(BOARD, WAITS, "accelerator waits");
        thread(BOARD, INTERRUPT, "interrupt");
        for (number, channel) in self.recording.channels.iter().enumerate() {
            let (name, first) = (names::channel(channel), CHANNELS + OF_CHANNEL * number);
            thread(BOARD, first + PACKETS, &name);
            thread(BOARD, first + DESCRIPTORS, &format!("{name} descriptors"));
        }
        thread(HOST, CPU, "driver");
        events
    }

    /// A span of the board's clock.
    fn on_board(&self, thread: usize, name: &str, span: Span, mut arguments: Value) -> Value {
        let since = span.begin.saturating_sub(self.recording.span.begin);
        arguments["clock"] = span.begin.into();
        arguments["clocks"] = span.clocks().into();
        json!({
            "ph": "X",
            "name": name,
            "cat": "board",
            "pid": BOARD,
            "tid": thread,
            "ts": self.nanoseconds(since) / 1e3,
            "dur": self.nanoseconds(span.clocks()) / 1e3,
            "args": arguments,
        })
    }

    fn access_events(&self, events: &mut Vec<Value>) {
        for access in &self.recording.accesses {
            let (name, span) = (names::access(access), self.span_of(access));
            let arguments = json!({
                "address": format!("{:#x}", access.address),
                "value": format!("{:#x}", access.value),
                "write": access.write,
                "doorbell": access.write && self.recording.doorbells.contains(&access.cycle),
            });
            events.push(self.on_board(CPU, &name, span, arguments));
        }
    }

    fn channel_events(&self, first: usize, channel: &ChannelRecording, events: &mut Vec<Value>) {
        let thread = first + PACKETS;
        let mut port = channel.port.as_slice();
        for packet in &channel.packets {
            let arguments = json!({
                "beats": packet.beats,
                "descriptors": packet.descriptors,
                "ended": packet.ended,
            });
            let name = names::packet(packet.phase);
            port = self.beats_outside(thread, port, packet.span.begin, events);
            events.push(self.on_board(thread, &name, packet.span, arguments));
            port = self.port_events(thread, (channel.direction, packet), port, events);
        }
        self.beats_outside(thread, port, u64::MAX, events);
        for descriptor in &channel.descriptors {
            let arguments = json!({
                "address": format!("{:#x}", descriptor.address),
                "bytes": descriptor.bytes,
                "ended": descriptor.ended,
            });
            let thread = first + DESCRIPTORS;
            events.push(self.on_board(thread, "descriptor", descriptor.span, arguments));
        }
    }

    /// The beats before the next packet, of a packet that began before the recording; returns the
    /// later states.
    fn beats_outside<'a>(
        &self,
        thread: usize,
        port: &'a [PortState],
        packet: u64,
        events: &mut Vec<Value>,
    ) -> &'a [PortState] {
        let (outside, rest) = port.split_at(port.partition_point(|state| state.begin < packet));
        for state in outside {
            if let Port::Moves { beats, .. } = state.port {
                let span = Span { begin: state.begin, end: state.end_of_beats() };
                events.push(self.on_board(thread, "beats", span, json!({ "beats": beats })));
            }
        }
        rest
    }

    /// The states of a port within a packet; returns the later ones.
    fn port_events<'a>(
        &self,
        thread: usize,
        (direction, packet): (Direction, &PacketSpan),
        mut port: &'a [PortState],
        events: &mut Vec<Value>,
    ) -> &'a [PortState] {
        while let [state, rest @ ..] = port {
            if state.begin >= packet.span.end {
                break;
            }
            port = rest;
            let next = rest.first().map_or(packet.span.end, |next| next.begin);
            let (name, arguments) = match (state.port, direction) {
                (Port::Moves { beats, .. }, _) => ("beats", json!({ "beats": beats })),
                (Port::Rests { valid: true, .. }, Direction::Mm2s) => ("FIFO is full", json!({})),
                (Port::Rests { ready: true, .. }, Direction::S2mm) => ("no results", json!({})),
                (Port::Rests { .. }, _) => ("memory is slower", json!({})),
            };
            let span = Span { begin: state.begin, end: next.min(packet.span.end) };
            events.push(self.on_board(thread, name, span, arguments));
        }
        port
    }

    fn stage_events(&self, events: &mut Vec<Value>) {
        for stage in &self.recording.stages {
            let arguments = json!({
                "stalls": stage.stalls,
                "waits": stage.waits,
                "hazards": stage.hazards,
                "ended": stage.ended,
            });
            let name = names::stage(stage.stage);
            events.push(self.on_board(ACCELERATOR, &name, stage.span, arguments));
        }
        for wait in &self.recording.waits {
            events.push(self.on_board(WAITS, "waits for a stream", *wait, json!({})));
        }
        for span in self.high() {
            events.push(self.on_board(INTERRUPT, "interrupt", span, json!({})));
        }
    }

    /// The spans in which the interrupt line is high.
    pub(crate) fn high(&self) -> Vec<Span> {
        let whole = self.recording.span;
        let levels = &self.recording.interrupt;
        let first = levels.first.then_some(whole.begin);
        let edges: Vec<u64> = first.into_iter().chain(levels.edges.iter().copied()).collect();
        edges
            .chunks(2)
            .map(|edges| Span { begin: edges[0], end: *edges.get(1).unwrap_or(&whole.end) })
            .collect()
    }

    /// The host's phases, one after the other.
    fn host_events(&self, events: &mut Vec<Value>) {
        let Some(report) = self.report else { return };
        let host = &report.host;
        let mut begin = 0.0;
        for (name, time) in [
            ("validate", host.validate),
            ("order", host.order),
            ("pack", host.pack),
            ("start", host.start),
            ("wait (emulation included)", host.wait),
            ("unpack", host.unpack),
            ("commit", host.commit),
        ] {
            let microseconds = time.as_secs_f64() * 1e6;
            events.push(json!({
                "ph": "X",
                "name": name,
                "cat": "host",
                "pid": HOST,
                "tid": CPU,
                "ts": begin,
                "dur": microseconds,
                "args": {},
            }));
            begin += microseconds;
        }
    }
}
