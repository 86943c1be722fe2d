//! Draws a recorded step as lanes over time: CPU, channels, accelerator, interrupt.
//!
//! The board's part has the modelled clock. The CPU's part is an A53's on paper: the bytes of the
//! step at the speed of memcpy on one core. No time of this machine is in it, so that the picture
//! is the same on every machine.

use std::io::{self, Write};

use crate::a53::a53_copy_seconds;
use bitstream_model::interface::record::BEAT_BYTES;
use bitstream_model::recording::{ChannelRecording, Span, Stage};
use bitstream_model::{Direction, StepPhase};

use crate::svg::{Anchor, Picture};
use crate::{TracedStep, names};

const WIDTH: f64 = 1000.0;
/// The lanes, from left to right.
const LEFT: f64 = 130.0;
const RIGHT: f64 = 985.0;
const TOP: f64 = 46.0;
/// Heights of the lanes, and the space between them.
const CPU_HEIGHT: f64 = 30.0;
const HEIGHT: f64 = 24.0;
const GAP: f64 = 6.0;
/// Ticks of the axis, about.
const TICKS: f64 = 8.0;
/// Narrowest box that can be seen.
const NARROWEST: f64 = 0.75;

/// The legend: class and words.
const LEGEND: [(&str, &str); 7] = [
    ("vel", "velocities"),
    ("con", "collisions, contact pass"),
    ("fri", "collisions, friction pass"),
    ("pos", "poses"),
    ("res", "results"),
    ("irq", "interrupt"),
    ("wait", "accelerator waits for a stream"),
];

/// Places times on the picture.
struct Scale {
    /// Nanoseconds of packing before the board's first clock, and of unpacking after its last.
    pack: f64,
    unpack: f64,
    board: f64,
}

impl Scale {
    fn whole(&self) -> f64 {
        self.pack + self.board + self.unpack
    }

    /// The place of a time from the begin of the picture, ns.
    fn place(&self, nanoseconds: f64) -> f64 {
        let whole = self.whole();
        if whole > 0.0 { LEFT + (RIGHT - LEFT) * nanoseconds / whole } else { LEFT }
    }
}

fn stage_class(stage: Stage) -> &'static str {
    match stage {
        Stage::Load => "vel",
        Stage::Contact(_) => "con",
        Stage::Friction(_) => "fri",
        Stage::Integrate => "pos",
    }
}

fn packet_class(phase: Option<StepPhase>) -> &'static str {
    match phase {
        None => "cpu",
        Some(StepPhase::Load) => "vel",
        Some(StepPhase::Contact(_)) => "con",
        Some(StepPhase::Friction(_)) => "fri",
        Some(StepPhase::Poses) => "pos",
        Some(StepPhase::Results) => "res",
    }
}

/// The last word of a name, for a box with no room for all of it.
fn short(name: &str) -> &str {
    name.rsplit(' ').next().unwrap_or(name)
}

impl TracedStep<'_> {
    /// Writes the picture.
    ///
    /// # Errors
    /// The error of the output.
    pub fn write_timeline(&self, out: &mut dyn Write) -> io::Result<()> {
        let scale = self.scale();
        let mut picture = Picture::default();
        let title = self.title();
        picture.text("t", [LEFT, 26.0], Anchor::Start, &title);
        let mut y = self.draw_cpu(&mut picture, &scale);
        for direction in [Direction::Mm2s, Direction::S2mm] {
            for channel in self.recording.channels.iter().filter(|one| one.direction == direction) {
                self.draw_channel(&mut picture, &scale, y, channel);
                y += HEIGHT + GAP;
            }
            if direction == Direction::Mm2s {
                y = self.draw_accelerator(&mut picture, &scale, y);
            }
        }
        lane(&mut picture, y, HEIGHT, "interrupt");
        for span in self.high() {
            self.draw_span(&mut picture, &scale, (y, HEIGHT), ("irq", "interrupt"), (span, true));
        }
        y += HEIGHT + GAP;
        y = axis(&mut picture, &scale, y);
        y = legend(&mut picture, y);
        for line in self.notes() {
            picture.text("s", [LEFT, y], Anchor::Start, &line);
            y += 16.0;
        }
        out.write_all(picture.document([WIDTH, y], &title).as_bytes())
    }

    fn title(&self) -> String {
        let of = match self.report {
            Some(report) => format!(
                " of {} bodies and {} collisions, {} passes",
                report.bodies, report.collisions, report.passes
            ),
            None => " that did not end".to_owned(),
        };
        format!("One step{of}, on design {}", self.design)
    }

    fn notes(&self) -> Vec<String> {
        let mut notes = vec![format!("Board: modelled, {} MHz.", self.megahertz())];
        if let Some(work) = self.work() {
            notes[0] += &work;
        }
        let attempts = self.report.map_or(0, |report| report.retries);
        if attempts > 0 {
            notes.push(format!("The driver repeated the step: attempt {} ended.", attempts + 1));
        }
        notes.push(
            "CPU: an A53 on paper, which copies the step's bytes on one core; checks are left out."
                .to_owned(),
        );
        notes
    }

    /// The clocks of the accelerator: of the whole step as its counters say, or of the stages that
    /// the recording has.
    fn work(&self) -> Option<String> {
        let stages = || self.recording.stages.iter();
        let [clocks, stalls, waits] = match self.report.map(|report| &report.cycles) {
            Some(cycles) => [cycles.total, cycles.stalls, cycles.waits],
            None if self.recording.stages.is_empty() => return None,
            None => [
                stages().map(|stage| stage.span.clocks()).sum(),
                stages().map(|stage| stage.stalls).sum(),
                stages().map(|stage| stage.waits).sum(),
            ],
        };
        Some(format!(" Accelerator: {clocks} clocks, {stalls} of them stalls and {waits} waits."))
    }

    /// The bytes of a phase's packets. A step that is repeated sends the same buffers again.
    fn bytes(&self, phase: StepPhase) -> u64 {
        let of_channel = |channel: &ChannelRecording| {
            let packets = channel.packets.iter().filter(|packet| packet.phase == Some(phase));
            packets.map(|packet| packet.beats).max().unwrap_or(0)
        };
        self.recording.channels.iter().map(of_channel).sum::<u64>() * BEAT_BYTES as u64
    }

    /// The phase of the first packet with collisions.
    fn first_pass(&self) -> Option<StepPhase> {
        let packets = self.recording.channels.iter().flat_map(|channel| &channel.packets);
        packets
            .filter_map(|packet| match packet.phase? {
                phase @ (StepPhase::Contact(_) | StepPhase::Friction(_)) => {
                    Some((packet.span.begin, phase))
                }
                _ => None,
            })
            .min_by_key(|(begin, _)| *begin)
            .map(|(_, phase)| phase)
    }

    fn scale(&self) -> Scale {
        // All passes read one buffer, which the CPU writes once.
        let written = [Some(StepPhase::Load), self.first_pass(), Some(StepPhase::Poses)];
        let written = written.into_iter().flatten().map(|phase| self.bytes(phase)).sum();
        let read = self.bytes(StepPhase::Results);
        Scale {
            pack: a53_copy_seconds(written) * 1e9,
            unpack: a53_copy_seconds(read) * 1e9,
            board: self.nanoseconds(self.recording.span.clocks()),
        }
    }

    /// The place of a clock of the board.
    fn place(&self, scale: &Scale, clock: u64) -> f64 {
        let clocks = clock.saturating_sub(self.recording.span.begin);
        scale.place(scale.pack + self.nanoseconds(clocks))
    }

    /// Draws a span of the board's clock with its name.
    fn draw_span(
        &self,
        picture: &mut Picture,
        scale: &Scale,
        (y, height): (f64, f64),
        (class, name): (&str, &str),
        (span, ended): (Span, bool),
    ) {
        let x = self.place(scale, span.begin);
        let width = (self.place(scale, span.end) - x).max(NARROWEST);
        let cut = if ended { "" } else { ", cut short" };
        let title = format!("{name}: clocks {} to {}{cut}", span.begin, span.end);
        // Neighbours stay apart.
        picture.rectangle(class, [x, y, (width - 0.5).max(NARROWEST), height], Some(&title));
        picture.label([x, y, width, height], &[name, short(name)]);
    }

    fn draw_cpu(&self, picture: &mut Picture, scale: &Scale) -> f64 {
        lane(picture, TOP, CPU_HEIGHT, "CPU");
        let [begin, board, end, whole] = [0.0, scale.pack, scale.pack + scale.board, scale.whole()]
            .map(|time| scale.place(time));
        for (from, to, name) in [(begin, board, "pack"), (end, whole, "unpack")] {
            picture.rectangle("cpu", [from, TOP, to - from, CPU_HEIGHT], Some(name));
        }
        picture.label([begin, TOP, board - begin, CPU_HEIGHT], &["pack"]);
        let below = TOP + CPU_HEIGHT + 14.0;
        picture.text("s", [RIGHT, below], Anchor::End, "unpack");
        for access in &self.recording.accesses {
            let span = self.span_of(access);
            let x = self.place(scale, span.begin);
            let width = self.place(scale, span.end) - x - 0.2;
            let place = [x, TOP + CPU_HEIGHT - 10.0, width.max(0.3), 10.0];
            picture.rectangle("cpu", place, Some(&names::access(access)));
        }
        for bell in &self.recording.doorbells {
            let x = self.place(scale, *bell);
            picture.path("bell", &format!("M{x:.2} {:.1}v12m-2 -4l2 4l2 -4", TOP + 3.0));
        }
        let (accesses, bells) = (self.recording.accesses.len(), self.recording.doorbells.len());
        let text = format!("{accesses} register accesses, {bells} of them doorbells (arrows)");
        picture.text("s", [board, below], Anchor::Start, &text);
        below + GAP + 4.0
    }

    fn draw_channel(
        &self,
        picture: &mut Picture,
        scale: &Scale,
        y: f64,
        channel: &ChannelRecording,
    ) {
        lane(picture, y, HEIGHT, &names::channel(channel));
        for packet in &channel.packets {
            let name = names::packet(packet.phase);
            let class = packet_class(packet.phase);
            self.draw_span(
                picture,
                scale,
                (y, HEIGHT),
                (class, &name),
                (packet.span, packet.ended),
            );
        }
    }

    fn draw_accelerator(&self, picture: &mut Picture, scale: &Scale, y: f64) -> f64 {
        if self.recording.stages.is_empty() {
            return y;
        }
        lane(picture, y, CPU_HEIGHT, "accelerator");
        for stage in &self.recording.stages {
            let name = names::stage(stage.stage);
            let class = stage_class(stage.stage);
            self.draw_span(
                picture,
                scale,
                (y, CPU_HEIGHT),
                (class, &name),
                (stage.span, stage.ended),
            );
        }
        for wait in &self.recording.waits {
            let (from, to) = (self.place(scale, wait.begin), self.place(scale, wait.end));
            picture.rectangle("wait", [from, y + CPU_HEIGHT - 4.0, to - from, 4.0], None);
        }
        y + CPU_HEIGHT + GAP
    }
}

fn lane(picture: &mut Picture, y: f64, height: f64, name: &str) {
    picture.rectangle("lane", [LEFT, y, RIGHT - LEFT, height], None);
    picture.text("t", [LEFT - 10.0, y + height / 2.0 + 4.5], Anchor::End, name);
}

/// Draws the axis, in microseconds.
fn axis(picture: &mut Picture, scale: &Scale, y: f64) -> f64 {
    let whole = scale.whole() / 1e3;
    let mut step = 0.001;
    for factor in [2.0, 2.5, 2.0].into_iter().cycle() {
        if whole / step <= TICKS * 1.5 {
            break;
        }
        step *= factor;
    }
    let mut number = 0;
    loop {
        let time = f64::from(number) * step;
        if time > whole {
            break;
        }
        let x = scale.place(time * 1e3);
        picture.path("line", &format!("M{x:.2} {y:.1}v5"));
        // Three decimals suffice, and hide the rounding of the product.
        let text = format!("{time:.3}");
        let text = text.trim_end_matches('0').trim_end_matches('.');
        let unit = if number == 0 { " us" } else { "" };
        picture.text("s", [x, y + 17.0], Anchor::Middle, &format!("{text}{unit}"));
        number += 1;
    }
    y + 34.0
}

fn legend(picture: &mut Picture, y: f64) -> f64 {
    let mut x = LEFT;
    let mut y = y;
    for (class, words) in LEGEND {
        let width = 30.0 + 6.4 * words.len() as f64;
        if x + width > RIGHT {
            x = LEFT;
            y += 20.0;
        }
        picture.rectangle(class, [x, y - 10.0, 12.0, 12.0], None);
        picture.text("s", [x + 17.0, y], Anchor::Start, words);
        x += width;
    }
    y + 24.0
}
