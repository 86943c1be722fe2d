//! This file loads and integrates bodies whose beats are still in their buffers, in the layout of
//! `float`: two rows of a body on streams 0 and 1, of the next one on 2 and 3; of a result a row on each
//! stream.

use std::sync::atomic::{AtomicU32, AtomicUsize, Ordering};

use super::array::Row;
use super::batch::ResultPlaces;
use super::control::Arguments;
use super::decode;
use super::replay::Replay;
use super::results::Results;
use super::segment::{PacketError, Segment};
use super::solver::{Mass, Velocity};
use super::striping::{STREAMS_MAX, beats_of_bodies};
use super::{Accelerator, Phase};
use crate::body_pace::{BodyPace, BodyPhase};
use crate::cast::register;
use crate::config::SHAPES_MAX;
use crate::interface::control::ErrorCode;
use crate::interface::number::StreamFormat;
use crate::interface::record::{Beat, LANES, WORD_LANE, velocity};
use crate::memory::{Memory, Source};
use crate::stream::Stream;

/// The beats of some bodies on each stream, where they are.
pub(super) type Views<'a> = [&'a [Beat]; STREAMS_MAX];

/// Bodies that a thread loads at once.
const LOADED_TOGETHER: usize = 2048;

// Whatever shape the table has fits, so that a body is refused only if `bodies_known` has found it.
const _: () = assert!(SHAPES_MAX <= 1 << u8::BITS);

/// Two rows of each of some bodies, of which the views begin with body `first`.
#[derive(Debug, Clone, Copy)]
pub(super) struct BodyRows<'a> {
    pub(super) views: Views<'a>,
    pub(super) first: usize,
}

impl BodyRows<'_> {
    /// The rows of a body.
    pub(super) fn of(&self, body: usize) -> [Row; 2] {
        let before = beats_of_bodies(self.first);
        let stream = 2 * (body % 2);
        [stream, stream + 1].map(|k| self.views[k][body / 2 - before[k]].0)
    }

    /// Loads bodies from `first` on; the sum of the words of their rows, and the first body that has no
    /// shape.
    fn load(
        &self,
        first: usize,
        masses: &[Mass],
        velocities: &mut [Velocity],
        shape_of: &mut [u8],
    ) -> (u32, Option<usize>) {
        let before = beats_of_bodies(self.first);
        let (mut sum, mut wrong) = ([0_u32; LANES], None);
        for begin in [first, first + 1] {
            let k = 2 * (begin % 2);
            let rows = |k: usize| self.views[k].iter().skip(begin / 2 - before[k]);
            let kept = velocities.iter_mut().zip(&mut *shape_of).skip(begin - first).step_by(2);
            let bodies = (begin..).step_by(2).zip(rows(k).zip(rows(k + 1)));
            for ((velocity, kept_shape), (body, (linear, angular))) in kept.zip(bodies) {
                for (sum, words) in sum.iter_mut().zip(linear.0.into_iter().zip(angular.0)) {
                    *sum = sum.wrapping_add(words.0).wrapping_add(words.1);
                }
                let (loaded, shape) = decode::velocity(StreamFormat::F32, &[linear.0, angular.0]);
                let (Some(mass), Ok(shape)) = (masses.get(shape as usize), u8::try_from(shape))
                else {
                    wrong = wrong.into_iter().chain([body]).min();
                    continue;
                };
                // A static body's words are not looked at.
                let moves = mass.inverse_mass != 0.0;
                *velocity = if moves { loaded } else { Velocity::default() };
                *kept_shape = shape;
            }
        }
        (sum.into_iter().fold(0, u32::wrapping_add), wrong)
    }
}

impl Accelerator {
    /// Where the beats of the next bodies are, if they are all in their buffers.
    pub(super) fn views<'a>(
        &self,
        segment: &Segment,
        records: usize,
        inputs: &[Stream],
        memory: &'a Memory,
    ) -> Option<Views<'a>> {
        if !self.replay.takes_bodies() {
            return None;
        }
        let counts = segment.beats_of_next(records);
        let mut views: Views<'a> = [&[]; STREAMS_MAX];
        for ((view, stream), count) in views.iter_mut().zip(inputs).zip(counts) {
            if count > 0 {
                let (_, source) =
                    Some(stream.piece(0, count)).filter(|(there, _)| *there == count)?;
                *view = memory.view(source?, count)?;
            }
        }
        Some(views)
    }

    /// Loads the next bodies.
    pub(super) fn load_views(
        &mut self,
        segment: &Segment,
        records: usize,
        views: Views<'_>,
    ) -> Result<u32, PacketError> {
        let bodies = segment.done..segment.done + records;
        let rows = BodyRows { views, first: segment.done };
        let Replay { batch, masses, .. } = &mut self.replay;
        let velocities = self.velocities[bodies.clone()].chunks_mut(LOADED_TOGETHER);
        let shapes = self.shape_of[bodies.clone()].chunks_mut(LOADED_TOGETHER);
        let (sum, wrong) = (AtomicU32::new(0), AtomicUsize::new(usize::MAX));
        let parts = bodies.step_by(LOADED_TOGETHER).zip(velocities.zip(shapes));
        batch.share(parts, |(first, (velocities, shapes))| {
            let (of_part, wrong_body) = rows.load(first, masses, velocities, shapes);
            sum.fetch_add(of_part, Ordering::Relaxed);
            wrong.fetch_min(wrong_body.unwrap_or(usize::MAX), Ordering::Relaxed);
        });
        match wrong.into_inner() {
            usize::MAX => Ok(sum.into_inner()),
            body => {
                let beat = register(body);
                Err(PacketError { code: ErrorCode::ShapeIndex, channel: 0, beat })
            }
        }
    }

    /// Integrates the next bodies and sends their results; the sums of what has come and gone.
    pub(super) fn integrate_views(
        &mut self,
        poses: &Segment,
        results: &mut Results,
        records: usize,
        views: Views<'_>,
        outputs: &mut [Stream],
    ) -> [u32; 2] {
        let first = poses.done;
        let mut rows = std::mem::take(&mut self.rows);
        rows.iter_mut().for_each(|rows| rows.resize(records, Beat::default()));
        let places = rows.each_mut().map(Vec::as_mut_slice);
        let sums = self.results(first, BodyRows { views, first }, places);
        results.send_rows(records, &rows, outputs);
        self.rows = rows;
        sums
    }

    /// Makes the results of bodies from `first` on, one for each place. Returns the sums of what has
    /// come and gone.
    fn results(&mut self, first: usize, poses: BodyRows<'_>, places: ResultPlaces<'_>) -> [u32; 2] {
        let Replay { batch, masses, .. } = &mut self.replay;
        batch.enter(&self.velocities, &self.shape_of, masses);
        let Arguments { integrate, integration, .. } = &self.arguments;
        batch.integrate(integrate.then_some(integration), first, poses, places)
    }

    /// What happens to the bodies, if nothing else can be next for it.
    pub(crate) fn flowing_bodies(&self) -> Option<BodyPhase> {
        if !self.replay.takes_bodies() || self.debt > 0 || self.hung {
            return None;
        }
        match self.phase {
            Phase::Load(_) => Some(BodyPhase::Load),
            Phase::Integrate { .. } => Some(BodyPhase::Integrate),
            _ => None,
        }
    }

    /// Which body is next, and from how many on something may happen that is not for here; as far as
    /// is to be known for so many cycles. `sources` say where the beats are.
    pub(crate) fn bodies_known(
        &self,
        sources: &[(Source, usize); STREAMS_MAX],
        cycles: u64,
        memory: &Memory,
    ) -> Option<(usize, usize)> {
        let (segment, load) = match &self.phase {
            Phase::Load(segment) => (segment, true),
            Phase::Integrate { poses, .. } => (poses, false),
            _ => return None,
        };
        let first = segment.done;
        // The last two end packets.
        let mut records = segment.left().saturating_sub(1);
        if load {
            let before = beats_of_bodies(first);
            // Two a cycle, if there are that many.
            let most = usize::try_from(cycles).unwrap_or(usize::MAX).saturating_mul(2);
            records = records.min(most.saturating_add(1));
            for even in [true, false] {
                let k = if even { 0 } else { 2 };
                let (source, count) = sources[k + velocity::LINEAR];
                let known = |beat: &Beat| (beat.0[WORD_LANE] as usize) < self.replay.masses.len();
                let bad = memory
                    .view(source, count)?
                    .iter()
                    .take(records / 2 + 1)
                    .position(|b| !known(b));
                if let Some(bad) = bad {
                    let body = 2 * (before[k] + bad) + usize::from(!even);
                    records = records.min(body - first);
                }
            }
        }
        Some((first, records))
    }

    /// Bodies have flowed, and the beats with them that are on the streams now. `views` are theirs;
    /// `places` is where the results go that have left their FIFOs.
    pub(crate) fn flowed_bodies(
        &mut self,
        pace: &BodyPace,
        views: Views<'_>,
        places: ResultPlaces<'_>,
        inputs: &mut [Stream],
        outputs: &mut [Stream],
    ) {
        let records = pace.flowed.records;
        self.clock += pace.flowed.cycles;
        self.counters.waits += pace.flowed.waits;
        self.phase = match self.phase {
            Phase::Load(mut segment) => {
                match self.load_views(&segment, records, views) {
                    Ok(sum) => self.received(sum),
                    // They were looked at before.
                    Err(error) => return self.fail(error.code, error.channel, error.beat),
                }
                segment.skip(records, inputs);
                Phase::Load(segment)
            }
            Phase::Integrate { mut poses, mut results } => {
                let poses_there = BodyRows { views, first: poses.done };
                let [received, sent] = self.flowed_results(poses_there, records, places, outputs);
                self.received(received);
                self.counters.sum_sent = self.counters.sum_sent.wrapping_add(sent);
                poses.skip(records, inputs);
                results.pass(records);
                Phase::Integrate { poses, results }
            }
            other => other,
        };
    }

    /// Integrates bodies. The results go where there is place for them, behind those that wait on the
    /// streams, and the last ones onto the streams. Returns the sums of what has come and gone.
    fn flowed_results(
        &mut self,
        poses: BodyRows<'_>,
        records: usize,
        mut places: ResultPlaces<'_>,
        outputs: &mut [Stream],
    ) -> [u32; 2] {
        let mut direct = records;
        for (place, stream) in places.iter_mut().zip(&mut *outputs) {
            let waiting = stream.len().min(place.len());
            let (from_stream, behind) = std::mem::take(place).split_at_mut(waiting);
            stream.pop_into(from_stream);
            direct = direct.min(behind.len());
            *place = behind;
        }
        let now = places.each_mut().map(|place| {
            let (now, behind) = std::mem::take(place).split_at_mut(direct);
            *place = behind;
            now
        });
        let first = poses.first;
        let before = self.results(first, poses, now);
        let mut rows = std::mem::take(&mut self.rows);
        rows.iter_mut().for_each(|rows| rows.resize(records - direct, Beat::default()));
        let behind = self.results(first + direct, poses, rows.each_mut().map(Vec::as_mut_slice));
        for ((rows, place), stream) in rows.iter().zip(places).zip(outputs) {
            let (leaving, staying) = rows.split_at(place.len());
            place.copy_from_slice(leaving);
            stream.push(staying);
        }
        self.rows = rows;
        [before[0].wrapping_add(behind[0]), before[1].wrapping_add(behind[1])]
    }
}
