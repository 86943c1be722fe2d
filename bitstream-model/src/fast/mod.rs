#![doc = include_str!("README.md")]

mod block;
mod fronts;
mod groups;
mod order;
mod read;
mod solve;
mod time;

use pgs_support::Crew;

use crate::accelerator::Accelerator;
use crate::accelerator::control::Counters;
use crate::accelerator::hazards::{Entry, Pipeline};
use crate::accelerator::records::decode::Collision;
use crate::accelerator::records::striping::{PerStream, STREAMS_MAX};
use crate::arbiter::Arbiter;
use crate::axi_dma::{Core, Surroundings};
use crate::config::{BoardConfig, Hazards, THREADS_MAX, beat_cycles};
use crate::memory::Memory;
use crate::stream::Stream;
use pgs_interface::axi_dma::Direction;
use pgs_interface::number::Numbers;
use pgs_interface::record::Beat;
use pgs_interface::stripe::IMPULSES_STREAM;
use time::{Course, Part, Stalls, Streams, course, stalls};

/// The passes of a step.
#[derive(Debug, Clone, Copy)]
struct Plan {
    passes: u32,
    /// How many are contact passes: the first ones.
    contact: u32,
    /// Whether impulses come in with the first pass of each kind.
    warm: bool,
    /// Share of the spin that a friction pass takes away.
    damping: f32,
    /// Whether a subnormal number has the step taken again.
    watches: bool,
    /// Whether the design computes in binary16, or else in f32.
    binary16: bool,
}

/// The kind of a pass.
#[derive(Debug, Clone, Copy)]
struct Stage {
    contact: bool,
    /// The last contact pass, which counts its impulses, or the first friction pass, which adds the
    /// impulses of each collision.
    turning: bool,
    /// Impulses that came in take the place of the computed ones.
    warm: bool,
}

impl Plan {
    fn stage(&self, pass: u32) -> Stage {
        let contact = pass < self.contact;
        let turning = if contact { pass + 1 == self.contact } else { pass == self.contact };
        Stage { contact, turning, warm: self.warm && (pass == 0 || pass == self.contact) }
    }
}

/// The parts of a board that a step changes.
pub(crate) struct Parts<'a> {
    pub(crate) now: u64,
    pub(crate) accelerator: &'a mut Accelerator,
    pub(crate) cores: &'a mut [Core],
    pub(crate) inputs: &'a mut [Stream],
    pub(crate) outputs: &'a mut [Stream],
    pub(crate) arbiter: Arbiter,
    pub(crate) with: Surroundings<'a>,
}

/// The end of a step that was taken at once.
#[derive(Debug, Clone, Copy)]
struct End {
    at: u64,
    /// Cycles of the accelerator from the start of the fast way to its end, and its counters then.
    cycles: u64,
    counters: Counters,
}

/// The fast way for a whole step, with the memory that it keeps from step to step.
#[derive(Debug)]
pub(crate) struct Fast {
    config: BoardConfig,
    crew: Crew,
    pipeline: Pipeline,
    packets: read::Packets,
    /// The same when the step ends.
    at_end: read::Packets,
    /// The step that was taken and has not ended.
    end: Option<End>,
    parts: Vec<Part>,
    /// Stalls by window and interval.
    counted: Vec<((u64, u64), Stalls)>,
    /// For beats that are counted and not moved.
    passing: Stream,
    /// Which bodies each collision moves; `None` for padding.
    entries: Vec<Option<Entry>>,
    /// Collisions in sixteen bits as they would come in f32.
    widened: read::Widened,
    /// In the way of one collision after the other: the collisions of each kind of pass.
    collisions: [Vec<Collision>; read::KINDS],
    order: order::Order,
    lanes: solve::Lanes,
    results: [Vec<Beat>; STREAMS_MAX],
}

impl Fast {
    /// The fast way of a board, unless it is switched off or its design has none.
    pub(crate) fn of(config: &BoardConfig) -> Option<Self> {
        let (variant, profile) = (config.variant(), config.profile);
        let known = [Numbers::F32, Numbers::BINARY16].contains(&variant.numbers)
            && config.hazards == Hazards::Interlocked;
        if !(config.fast && known) {
            return None;
        }
        let crew = Crew::new("board", config.threads.clamp(1, THREADS_MAX) - 1);
        if let Some(error) = crew.refused() {
            log::warn!("no thread to help the board: {error}");
        }
        let pipeline = Pipeline::new(
            config.hazards,
            profile.initiation_interval,
            profile.collisions_per_issue,
        );
        Some(Self {
            config: *config,
            crew,
            pipeline,
            packets: read::Packets::default(),
            at_end: read::Packets::default(),
            end: None,
            parts: Vec::new(),
            counted: Vec::new(),
            passing: Stream::unread(),
            entries: Vec::new(),
            widened: Default::default(),
            collisions: Default::default(),
            order: order::Order::new(config.queue_depth()),
            lanes: solve::Lanes::default(),
            results: Default::default(),
        })
    }

    /// Takes the whole rest of a step, from a load on that has ended within the `ran` cycles from
    /// now on. Its host does nothing before the cycle `until`, or `waits` for an interrupt and may
    /// go on waiting: else it does not. Returns whether it did. Nothing of it is to be seen before
    /// [`finish`](Self::finish).
    pub(crate) fn take(
        &mut self,
        ran: u64,
        until: u64,
        waits: bool,
        parts: &mut Parts<'_>,
    ) -> bool {
        let mut widened = std::mem::take(&mut self.widened);
        self.end = self.taken(ran, if waits { u64::MAX } else { until }, &mut widened, parts);
        self.widened = widened;
        self.end.is_some()
    }

    /// The cycle at which the step ends that was taken and is not finished, if there is one.
    pub(crate) fn end(&self) -> Option<u64> {
        self.end.map(|end| end.at)
    }

    fn taken(
        &mut self,
        ran: u64,
        until: u64,
        widened: &mut read::Widened,
        parts: &mut Parts<'_>,
    ) -> Option<End> {
        let Parts { now, accelerator, cores, inputs, outputs, arbiter, with } = parts;
        let debt = accelerator.loaded()?;
        let arguments = accelerator.arguments;
        let issues = self.issues(arguments.collisions as usize) as u64;
        let interval = u64::from(self.config.profile.initiation_interval);
        let shortest = issues * interval * u64::from(arguments.passes());
        let empty = outputs.iter().all(|output| output.len() == 0);
        if *now + shortest > until || !empty {
            return None;
        }
        let outgoing = outgoing(accelerator);
        self.packets.find(accelerator, cores, &outgoing, with.memory)?;
        let ahead = self.packets.ahead(inputs)?;
        let input = self.packets.views(with.memory)?;
        let usable = self.read_collisions(accelerator, &input, widened)?;
        let (mut counters, course) = self.course(accelerator, *arbiter, (ran + debt, ahead));
        let end = *now + ran + debt + course.last_beat.max(course.cycles);
        if end >= until {
            return None;
        }
        let mut summed = read::sum(&input.velocities).wrapping_add(read::sum(&input.poses));
        let of_kinds = input.collisions.map(|views| views.as_ref().map_or(0, read::sum));
        for pass in 0..arguments.passes() {
            summed = summed.wrapping_add(of_kinds[read::kind(accelerator, pass)]);
        }
        counters.sum_received = summed;
        let plan = Plan {
            passes: arguments.passes(),
            contact: arguments.contact_passes(),
            warm: arguments.warm_start,
            damping: arguments.solver.spin_damping,
            watches: self.config.profile.flushes_subnormals,
            binary16: accelerator.variant.numbers == Numbers::BINARY16,
        };
        for (results, beats) in self.results.iter_mut().zip(outgoing) {
            results.clear();
            results.resize(beats, Beat::default());
        }
        let solved = match usable {
            Some(records) => self.solve_in_lanes(accelerator, &records, plan),
            None => Some(self.solve_one_by_one(accelerator, plan)),
        };
        let Some(impulse_sum) = solved else {
            log::debug!("accelerator: a subnormal number, left to the reference");
            accelerator.forget_passes(input.velocities);
            return None;
        };
        counters.impulse_sum = impulse_sum;
        counters.sum_sent = self.integrate(accelerator, &input.poses);
        Some(End { at: end, cycles: debt + course.cycles, counters })
    }

    /// Ends the step that was taken. Returns whether it did: a host that has changed descriptors
    /// meanwhile finds the reference.
    pub(crate) fn finish(&mut self, parts: &mut Parts<'_>) -> bool {
        let Parts { accelerator, cores, inputs, with, .. } = parts;
        let outgoing = outgoing(accelerator);
        let found = self.at_end.find(accelerator, cores, &outgoing, with.memory);
        if found.is_none() || self.at_end != self.packets {
            return false;
        }
        let Some(End { at: end, cycles, counters }) = self.end.take() else { return false };
        accelerator.end_after(cycles, counters);
        for (pieces, results) in self.packets.receivers.iter().zip(&self.results) {
            let mut results = &results[..];
            for piece in pieces {
                let (own, others) = results.split_at(piece.beats.min(results.len()));
                results = others;
                let fill = |beats: &mut [Beat]| beats.copy_from_slice(own);
                let written = with.memory.write(piece.at, own.len(), fill);
                if let Err(error) = written {
                    log::error!("results of a step cannot be written: {error:?}");
                }
            }
        }
        with.counts_only = true;
        for (k, core) in cores.iter_mut().enumerate() {
            let left = self.packets.beats[0][k] - self.packets.moved[k];
            let stream = &mut self.passing;
            core.pass_chain(Direction::Mm2s, left, end, stream, with);
            core.pass_chain(Direction::S2mm, self.packets.beats[1][k], end, stream, with);
        }
        inputs.iter_mut().for_each(Stream::clear);
        log::debug!("accelerator: a step taken at once");
        true
    }

    /// Forgets the step that was taken, if one was and is not finished: the accelerator is as
    /// before.
    pub(crate) fn forget(&mut self, accelerator: &mut Accelerator, memory: &Memory) {
        if self.end.take().is_some() {
            let input = self.packets.views(memory);
            match input {
                Some(input) => accelerator.forget_passes(input.velocities),
                None => log::error!("the buffers of a step went while the device had them"),
            }
        }
    }

    fn issues(&self, collisions: usize) -> usize {
        collisions.div_ceil(self.config.profile.collisions_per_issue as usize)
    }

    /// The counters at the end of the step and its course, by the entries of its collisions.
    fn course(
        &mut self,
        accelerator: &Accelerator,
        arbiter: Arbiter,
        (early, ahead): (u64, PerStream),
    ) -> (Counters, Course) {
        let profile = self.config.profile;
        let clocks = [profile.mm2s_widths, profile.s2mm_widths].map(|widths| {
            let mut clocks: PerStream = [1; STREAMS_MAX];
            for (clocks, width) in clocks.iter_mut().zip(widths) {
                *clocks = usize::try_from(beat_cycles(*width)).unwrap_or(usize::MAX);
            }
            clocks
        });
        let streams = Streams { arbiter, depth: self.config.delays.fifo_beats, clocks };
        let none = [0; STREAMS_MAX];
        let mut parts = std::mem::take(&mut self.parts);
        parts.clear();
        let bodies = accelerator.velocities.len();
        let together = profile.collisions_per_issue as usize;
        let issues = self.issues(self.entries.len()) as u64;
        let mut counters = accelerator.counters;
        self.counted.clear();
        for pass in 0..accelerator.arguments.passes() {
            let segment = accelerator.collisions_in(pass);
            let depth = accelerator.depth(pass);
            let (interval, of_streams) =
                (u64::from(profile.initiation_interval), accelerator.of_streams(pass));
            let mut writes = none;
            if accelerator.arguments.sends_impulses(pass) {
                writes[IMPULSES_STREAM] = accelerator.impulse_beats();
            }
            let (reads, fill) = (segment.array().packets, u64::from(depth.fill));
            if let Some(slots) = self.order.slots() {
                counters.stalls += slots.idle * interval;
                counters.hazards += slots.hazards;
                let work = (slots.all - slots.draining) * interval;
                let fill = slots.draining * interval + fill;
                parts.push(Part { reads, writes, work, fill });
                continue;
            }
            let of = (u64::from(depth.window), of_streams);
            let known =
                self.counted.iter().find(|(kind, _)| *kind == of).map(|(_, stalls)| *stalls);
            let found = known.unwrap_or_else(|| {
                let at = |issue| profile.issue_at(issue, of_streams);
                stalls(&mut self.pipeline, bodies, (of.0, together), at, &self.entries)
            });
            if known.is_none() {
                self.counted.push((of, found));
            }
            counters.stalls += found.cycles;
            counters.hazards += found.collisions;
            let work = profile.issues_take(issues, of_streams) + found.cycles;
            parts.push(Part { reads, writes, work, fill });
        }
        let (poses, results) = (accelerator.poses_in(), accelerator.results_out());
        let cycles = |array: &crate::accelerator::records::array::Array| array.cycles(bodies);
        parts.push(Part {
            reads: poses.array().packets,
            writes: results.array().packets,
            work: cycles(poses.array()).max(cycles(results.array())),
            fill: profile.integration_fill.into(),
        });
        let course = course(&parts, early, ahead, &streams);
        counters.waits += course.waits;
        self.parts = parts;
        (counters, course)
    }
}

/// The beats that go out on each stream: impulses, then results.
fn outgoing(accelerator: &Accelerator) -> PerStream {
    let mut beats = accelerator.results_out().array().packets;
    let arguments = &accelerator.arguments;
    let sends = (0..arguments.passes()).filter(|pass| arguments.sends_impulses(*pass)).count();
    beats[IMPULSES_STREAM] += sends * accelerator.impulse_beats();
    beats
}
