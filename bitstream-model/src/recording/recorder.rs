//! Takes the notes of a board's parts and joins neighbours.

use super::{
    ChannelRecording, DescriptorSpan, Levels, PacketSpan, Port, PortState, Recording, Span, Stage,
    StageSpan,
};
use crate::fault::StepPhase;
use crate::violation::RegisterAccess;
use pgs_interface::axi_dma::Direction;
use pgs_interface::record::BEAT_BYTES;

/// A descriptor under way.
#[derive(Debug, Clone, Copy)]
struct OpenDescriptor {
    /// Clock of the fetch.
    begin: u64,
    address: u64,
    /// Beats that it has moved.
    beats: u64,
}

/// A packet under way.
#[derive(Debug, Clone, Copy)]
struct OpenPacket {
    /// Clock of the first beat.
    begin: u64,
    phase: Option<StepPhase>,
    beats: u64,
    /// Descriptors of it that have ended.
    descriptors: u32,
    /// It began before the recording.
    began_before_recording: bool,
}

/// The recording of a channel, and the descriptor and packet under way.
#[derive(Debug)]
struct Channel {
    recording: ChannelRecording,
    descriptor: Option<OpenDescriptor>,
    packet: Option<OpenPacket>,
}

impl Channel {
    /// The clock after the last beat so far.
    fn end_of_beats(&self) -> u64 {
        self.recording.port.last().map_or(0, PortState::end_of_beats)
    }

    /// Ends what is under way, which will not end by itself.
    fn cut_short(&mut self, now: u64) {
        let end = now.max(self.end_of_beats());
        if let Some(OpenDescriptor { begin, address, beats }) = self.descriptor.take() {
            let span = Span { begin, end: end.max(begin) };
            let bytes = beats * BEAT_BYTES as u64;
            self.recording.descriptors.push(DescriptorSpan { span, address, bytes, ended: false });
        }
        let packet = self.packet.take().filter(|packet| !packet.began_before_recording);
        if let Some(OpenPacket { begin, phase, beats, descriptors, .. }) = packet {
            let span = Span { begin, end };
            let packet = PacketSpan { span, phase, beats, descriptors, ended: false };
            self.recording.packets.push(packet);
        }
    }
}

/// Beats that have moved without a pause.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MovedBeats {
    pub(crate) beats: u64,
    /// Clocks of each.
    pub(crate) clocks: u64,
    /// Whether the last one carries TLAST.
    pub(crate) last: bool,
    /// Beats of the same packet before them.
    pub(crate) beats_before: u64,
    /// The phase whose records the packet carries.
    pub(crate) phase: Option<StepPhase>,
}

/// A recording under way.
#[derive(Debug)]
pub(crate) struct Recorder {
    begin: u64,
    clock_khz: u32,
    access_clocks: u64,
    accesses: Vec<RegisterAccess>,
    doorbells: Vec<u64>,
    /// MM2S and S2MM of each core, in that order.
    channels: Vec<Channel>,
    waits: Vec<Span>,
    /// The clock at which the accelerator has sent last. It works first in a slice of the board's
    /// time, and the channels then move its beats from the begin of the slice on: no beat moves
    /// before it exists.
    sent_at: u64,
    level: bool,
    interrupt: Levels,
}

impl Recorder {
    pub(crate) fn new(
        begin: u64,
        (clock_khz, access_clocks): (u32, u64),
        cores: usize,
        level: bool,
    ) -> Self {
        let both = |core| [Direction::Mm2s, Direction::S2mm].map(|direction| (core, direction));
        let channel = |(core, direction)| Channel {
            recording: ChannelRecording {
                core,
                direction,
                port: vec![PortState { begin, port: Port::Rests { valid: false, ready: false } }],
                descriptors: Vec::new(),
                packets: Vec::new(),
            },
            descriptor: None,
            packet: None,
        };
        Self {
            begin,
            clock_khz,
            access_clocks,
            accesses: Vec::new(),
            doorbells: Vec::new(),
            channels: (0..cores).flat_map(both).map(channel).collect(),
            waits: Vec::new(),
            sent_at: begin,
            level,
            interrupt: Levels { first: level, edges: Vec::new() },
        }
    }

    fn channel(&mut self, core: usize, direction: Direction) -> &mut Channel {
        &mut self.channels[2 * core + usize::from(direction == Direction::S2mm)]
    }

    pub(crate) fn access(&mut self, access: RegisterAccess) {
        self.accesses.push(access);
    }

    /// Notes that the access at this clock was a doorbell.
    pub(crate) fn doorbell(&mut self, now: u64) {
        self.doorbells.push(now);
    }

    /// The level of the interrupt line at a clock.
    pub(crate) fn interrupt(&mut self, now: u64, level: bool) {
        if level != self.level {
            self.level = level;
            self.interrupt.edges.push(now);
        }
    }

    /// The accelerator waits for some clocks.
    pub(crate) fn waits(&mut self, begin: u64, clocks: u64) {
        let end = begin + clocks;
        match self.waits.last_mut() {
            Some(last) if last.end == begin => last.end = end,
            _ => self.waits.push(Span { begin, end }),
        }
    }

    /// The accelerator has sent at a clock.
    pub(crate) fn sent_at(&mut self, now: u64) {
        self.sent_at = self.sent_at.max(now);
    }

    /// Beats of a channel move, from a clock on, each for a number of clocks.
    pub(crate) fn moves(
        &mut self,
        (core, direction): (usize, Direction),
        begin: u64,
        moved: &MovedBeats,
    ) {
        let MovedBeats { beats, clocks, last, beats_before, phase } = *moved;
        let exists = if direction == Direction::S2mm { self.sent_at } else { 0 };
        let Channel { recording: ChannelRecording { port, .. }, packet, descriptor } =
            self.channel(core, direction);
        let begin = begin.max(exists).max(port.last().map_or(0, PortState::end_of_beats));
        let goes_on = packet.is_some();
        let began_before_recording = beats_before > 0;
        packet
            .get_or_insert(OpenPacket {
                begin,
                phase,
                beats: 0,
                descriptors: 0,
                began_before_recording,
            })
            .beats += beats;
        if let Some(descriptor) = descriptor {
            descriptor.beats += beats;
        }
        // A rest of no clocks was none.
        port.pop_if(|state| state.begin >= begin && matches!(state.port, Port::Rests { .. }));
        if let Some(PortState {
            begin: since,
            port: Port::Moves { beats: before, clocks: each, last: ended },
        }) = port.last_mut()
            && goes_on
            && *since + *before * *each == begin
            && *each == clocks
            && !*ended
        {
            *before += beats;
            *ended = last;
            return;
        }
        port.push(PortState { begin, port: Port::Moves { beats, clocks, last } });
    }

    /// A channel drops what is under way: it has failed, or stops, or its core is reset.
    pub(crate) fn abandons(&mut self, (core, direction): (usize, Direction), now: u64) {
        self.channel(core, direction).cut_short(now);
        self.rests((core, direction), now, [false, false]);
    }

    /// No beat of a channel moves from a clock on.
    pub(crate) fn rests(
        &mut self,
        (core, direction): (usize, Direction),
        begin: u64,
        [valid, ready]: [bool; 2],
    ) {
        let port = &mut self.channel(core, direction).recording.port;
        let rest = Port::Rests { valid, ready };
        let begin = port.last().map_or(begin, |last| begin.max(last.end_of_beats()));
        port.pop_if(|state| state.begin == begin && matches!(state.port, Port::Rests { .. }));
        if port.last().is_none_or(|last| last.port != rest) {
            port.push(PortState { begin, port: rest });
        }
    }

    pub(crate) fn descriptor_begins(
        &mut self,
        (core, direction): (usize, Direction),
        now: u64,
        address: u64,
    ) {
        let channel = self.channel(core, direction);
        let before = channel.recording.descriptors.last().map_or(0, |last| last.span.end);
        channel.descriptor = Some(OpenDescriptor { begin: now.max(before), address, beats: 0 });
    }

    pub(crate) fn descriptor_ends(
        &mut self,
        (core, direction): (usize, Direction),
        now: u64,
        bytes: u32,
    ) {
        let channel = self.channel(core, direction);
        if let Some(OpenDescriptor { begin, address, .. }) = channel.descriptor.take() {
            let span = Span { begin, end: now.max(channel.end_of_beats()) };
            let bytes = bytes.into();
            channel.recording.descriptors.push(DescriptorSpan {
                span,
                address,
                bytes,
                ended: true,
            });
        }
        if let Some(packet) = &mut channel.packet {
            packet.descriptors += 1;
        }
    }

    pub(crate) fn packet_ends(&mut self, (core, direction): (usize, Direction), now: u64) {
        let channel = self.channel(core, direction);
        let packet = channel.packet.take().filter(|packet| !packet.began_before_recording);
        if let Some(OpenPacket { begin, phase, beats, descriptors, .. }) = packet {
            let span = Span { begin, end: now.max(channel.end_of_beats()) };
            let packet = PacketSpan { span, phase, beats, descriptors, ended: true };
            channel.recording.packets.push(packet);
        }
    }

    /// The recording up to a clock, with the stages of the accelerator.
    pub(crate) fn finish(mut self, now: u64, stages: Vec<StageSpan>) -> Recording {
        // A narrow beat under way ends after the board's clock.
        let beats = self.channels.iter().filter_map(|channel| channel.recording.port.last());
        let end = beats.map(PortState::end_of_beats).fold(now, u64::max);
        self.channels.iter_mut().for_each(|channel| channel.cut_short(end));
        let mut channels: Vec<_> =
            self.channels.into_iter().map(|channel| channel.recording).collect();
        channels.sort_by_key(|channel| channel.direction == Direction::S2mm);
        Recording {
            span: Span { begin: self.begin, end },
            clock_khz: self.clock_khz,
            access_clocks: self.access_clocks,
            accesses: self.accesses,
            doorbells: self.doorbells,
            channels,
            stages,
            waits: self.waits,
            interrupt: self.interrupt,
        }
    }
}

/// The counters that a stage has its part of.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct StageCounts {
    pub(crate) stalls: u64,
    pub(crate) waits: u64,
    pub(crate) hazards: u64,
}

/// The stages of an accelerator, as it goes through them.
#[derive(Debug, Default)]
pub(crate) struct StageLog {
    /// The board's clock at the start of the step.
    start: u64,
    sent_at: u64,
    /// The stage under way, its first clock, and the counters there.
    current: Option<(Stage, u64, StageCounts)>,
    ended: Vec<StageSpan>,
}

impl StageLog {
    /// A log from now on; `clock` clocks of a step have passed.
    pub(crate) fn new(now: u64, clock: u64) -> Self {
        Self { start: now.saturating_sub(clock), ..Self::default() }
    }

    /// A step begins at a clock of the board.
    pub(crate) fn begin_step(&mut self, now: u64) {
        self.start = now;
    }

    /// The stage, `clock` clocks after the start of the step, with the counters of the step.
    pub(crate) fn note(&mut self, stage: Option<Stage>, clock: u64, counts: StageCounts) {
        if self.current.map(|(current, ..)| current) == stage {
            return;
        }
        self.close(clock, counts, true);
        self.current = stage.map(|stage| (stage, self.start + clock, counts));
    }

    /// The stage under way ends with an error, a reset or the recording.
    pub(crate) fn cut_short(&mut self, clock: u64, counts: StageCounts) {
        self.close(clock, counts, false);
    }

    fn close(&mut self, clock: u64, counts: StageCounts, ended: bool) {
        let Some((stage, begin, before)) = self.current.take() else { return };
        self.ended.push(StageSpan {
            stage,
            span: Span { begin, end: self.start + clock },
            stalls: counts.stalls - before.stalls,
            waits: counts.waits - before.waits,
            hazards: counts.hazards - before.hazards,
            ended,
        });
    }

    /// The accelerator sends, `clock` clocks after the start of the step.
    pub(crate) fn sends(&mut self, clock: u64) {
        self.sent_at = self.start + clock;
    }

    /// The board's clock at which the accelerator has sent last; 0 before that.
    pub(crate) fn sent_at(&self) -> u64 {
        self.sent_at
    }

    /// The stages so far.
    pub(crate) fn finish(self) -> Vec<StageSpan> {
        self.ended
    }
}
