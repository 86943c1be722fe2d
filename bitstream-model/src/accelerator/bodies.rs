//! This file loads and integrates bodies whose beats are still in their buffers, in the layout of
//! `float`: two rows of a body on streams 0 and 1, of the next one on 2 and 3; of a result a row on each
//! stream.

use std::ops::Range;
use std::sync::atomic::{AtomicU32, Ordering};

use super::control::Arguments;
use super::decode;
use super::integrate::{Integration, integrate};
use super::number::Single;
use super::results::Results;
use super::segment::{PacketError, Segment};
use super::solver::{Mass, Velocity};
use super::striping::STREAMS_MAX;
use super::{Accelerator, Phase};
use crate::body_pace::{BodyPace, BodyPhase, beats_of};
use crate::cast::register;
use crate::interface::control::ErrorCode;
use crate::interface::number::StreamFormat;
use crate::interface::record::{Beat, WORD_LANE, velocity};
use crate::memory::{Memory, Source};
use crate::stream::Stream;

/// The beats of some bodies on each stream, where they are.
pub(super) type Views<'a> = [&'a [Beat]; STREAMS_MAX];

/// Room for the results of some bodies, for each stream.
type Places<'a> = [&'a mut [Beat]; STREAMS_MAX];

/// Bodies that a thread integrates at once.
const TOGETHER: usize = 256;

/// Two rows of each of those bodies, of which the views begin with body `first`.
fn rows_of(
    views: Views<'_>,
    first: usize,
    bodies: Range<usize>,
) -> impl Iterator<Item = [[u32; 4]; 2]> {
    let before = beats_of(first);
    bodies.map(move |body| {
        let stream = 2 * (body % 2);
        let row = |k: usize| views[k][body / 2 - before[k]].0;
        [row(stream), row(stream + 1)]
    })
}

/// The sum of all words.
fn sum(views: Views<'_>) -> u32 {
    let mut lanes = [0_u32; 4];
    for beat in views.into_iter().flatten() {
        for (lane, word) in lanes.iter_mut().zip(beat.0) {
            *lane = lane.wrapping_add(word);
        }
    }
    lanes.into_iter().fold(0, u32::wrapping_add)
}

/// Bodies that are integrated.
#[derive(Debug, Clone, Copy)]
struct Bodies<'a> {
    velocities: &'a [Velocity],
    shape_of: &'a [u8],
    masses: &'a [Mass],
    /// Where bodies move at all.
    integration: Option<&'a Integration>,
    /// The poses from body `first` on.
    poses: Views<'a>,
    first: usize,
}

impl Bodies<'_> {
    /// The results of bodies, from one on as many as there are places; the sum of their words.
    fn results(&self, first: usize, places: Places<'_>) -> u32 {
        let mut sum = [0_u32; 4];
        let bodies = first..first + places[0].len();
        let [positions, orientations, linears, angulars] = places;
        let poses = rows_of(self.poses, self.first, bodies.clone());
        let states = self.velocities[bodies.clone()].iter().zip(&self.shape_of[bodies]);
        let places = positions.iter_mut().zip(orientations).zip(linears.iter_mut().zip(angulars));
        for (((velocity, shape), pose), ((position, orientation), (linear, angular))) in
            states.zip(poses).zip(places)
        {
            let (mut pose, mut velocity) = (decode::pose(StreamFormat::F32, &pose), *velocity);
            if let Some(integration) = self.integration
                && self.masses[usize::from(*shape)].inverse_mass != 0.0
            {
                (pose, velocity) = integrate::<Single>(integration, &pose, &velocity);
            }
            let rows = decode::result(StreamFormat::F32, &pose, &velocity);
            for row in rows {
                for (sum, word) in sum.iter_mut().zip(row) {
                    *sum = sum.wrapping_add(word);
                }
            }
            [position.0, orientation.0, linear.0, angular.0] = rows;
        }
        sum.into_iter().fold(0, u32::wrapping_add)
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
        if !self.replay.on {
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
        let masses = self.replay.masses.as_slice();
        let bodies = segment.done..segment.done + records;
        let kept = self.velocities[bodies.clone()].iter_mut();
        let kept = kept.zip(&mut self.shape_of[bodies.clone()]);
        let rows = rows_of(views, segment.done, bodies.clone());
        for (body, (rows, (kept, kept_shape))) in bodies.zip(rows.zip(kept)) {
            let (velocity, shape) = decode::velocity(StreamFormat::F32, &rows);
            let mass = masses.get(shape as usize);
            let (Some(mass), Ok(shape)) = (mass, u8::try_from(shape)) else {
                let beat = register(body);
                return Err(PacketError { code: ErrorCode::ShapeIndex, channel: 0, beat });
            };
            // A static body's words are not looked at.
            *kept = if mass.inverse_mass == 0.0 { Velocity::default() } else { velocity };
            *kept_shape = shape;
        }
        Ok(sum(views))
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
        let Arguments { integrate, integration, .. } = &self.arguments;
        let bodies = Bodies {
            velocities: &self.velocities,
            shape_of: &self.shape_of,
            masses: &self.replay.masses,
            integration: integrate.then_some(integration),
            poses: views,
            first,
        };
        let sent = bodies.results(first, places);
        results.send_rows(records, &rows, outputs);
        self.rows = rows;
        [sum(views), sent]
    }

    /// What happens to the bodies, if nothing else can be next for it.
    pub(crate) fn flowing_bodies(&self) -> Option<BodyPhase> {
        if !self.replay.on || self.debt > 0 || self.hung {
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
            let before = beats_of(first);
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
        places: Places<'_>,
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
                self.received(sum(views));
                let sent = self.flowed_results(poses.done, records, views, places, outputs);
                self.counters.sum_sent = self.counters.sum_sent.wrapping_add(sent);
                poses.skip(records, inputs);
                results.pass(records);
                Phase::Integrate { poses, results }
            }
            other => other,
        };
    }

    /// Integrates bodies from `first` on. The results go where there is place for them, behind those
    /// that wait on the streams, and the last ones onto the streams. Returns the sum of their words.
    fn flowed_results(
        &mut self,
        first: usize,
        records: usize,
        poses: Views<'_>,
        mut places: Places<'_>,
        outputs: &mut [Stream],
    ) -> u32 {
        let mut direct = records;
        for (place, stream) in places.iter_mut().zip(&mut *outputs) {
            let waiting = stream.len().min(place.len());
            let (from_stream, behind) = std::mem::take(place).split_at_mut(waiting);
            stream.pop_into(from_stream);
            direct = direct.min(behind.len());
            *place = behind;
        }
        let Arguments { integrate, integration, .. } = &self.arguments;
        let bodies = Bodies {
            velocities: &self.velocities,
            shape_of: &self.shape_of,
            masses: &self.replay.masses,
            integration: integrate.then_some(integration),
            poses,
            first,
        };
        let mut now = Places::default();
        for (now, place) in now.iter_mut().zip(&mut places) {
            (*now, *place) = std::mem::take(place).split_at_mut(direct);
        }
        let sent = AtomicU32::new(0);
        let [a, b, c, d] = now.map(|beats| beats.chunks_mut(TOGETHER));
        let parts = a.zip(b).zip(c.zip(d)).enumerate();
        self.replay.batch.share(parts, |(part, ((a, b), (c, d)))| {
            let sum = bodies.results(first + part * TOGETHER, [a, b, c, d]);
            sent.fetch_add(sum, Ordering::Relaxed);
        });
        let mut rows = std::mem::take(&mut self.rows);
        rows.iter_mut().for_each(|rows| rows.resize(records - direct, Beat::default()));
        let sum = bodies.results(first + direct, rows.each_mut().map(Vec::as_mut_slice));
        for ((rows, place), stream) in rows.iter().zip(places).zip(outputs) {
            let (leaving, staying) = rows.split_at(place.len());
            place.copy_from_slice(leaving);
            stream.push(staying);
        }
        self.rows = rows;
        sent.into_inner().wrapping_add(sum)
    }
}
