//! This file loads and integrates bodies whose beats are still in their buffers, in the layout of
//! `float`: two rows of a body on streams 0 and 1, of the next one on 2 and 3; of a result a row on each
//! stream.

use super::Accelerator;
use super::decode;
use super::integrate::{Turn, integrate};
use super::number::Single;
use super::results::Results;
use super::segment::{PacketError, Segment};
use super::solver::Velocity;
use super::striping::STREAMS_MAX;
use crate::cast::register;
use crate::interface::control::ErrorCode;
use crate::interface::number::StreamFormat;
use crate::interface::record::Beat;
use crate::memory::Memory;
use crate::stream::Stream;

/// The beats of some bodies on each stream, where they are.
type Views<'a> = [&'a [Beat]; STREAMS_MAX];

/// Two rows of each of those bodies, and which it is.
fn rows_of<'a>(
    segment: &Segment,
    records: usize,
    views: Views<'a>,
) -> impl Iterator<Item = (usize, [[u32; 4]; 2])> + use<'a> {
    let before: [usize; STREAMS_MAX] = std::array::from_fn(|k| segment.taken_from(k));
    (segment.done..segment.done + records).map(move |body| {
        let first = 2 * (body % 2);
        let row = |k: usize| views[k][body / 2 - before[k]].0;
        (body, [row(first), row(first + 1)])
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
        let bodies = self.velocities.iter_mut().zip(&mut self.shape_of).skip(segment.done);
        for ((body, rows), (kept, kept_shape)) in rows_of(segment, records, views).zip(bodies) {
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

    /// Finds what becomes of the bodies before their poses come, where threads can help.
    pub(super) fn turn_ahead(&mut self) {
        let (on, integrates) = (self.replay.on, self.arguments.integrate);
        if !on || !integrates || !self.replay.batch.has_threads() {
            return;
        }
        let integration = &self.arguments.integration;
        let none = Turn::new(integration, &Velocity::default());
        self.turns.resize(self.velocities.len(), none);
        self.turned = true;
        let turn = |velocity: &Velocity| Turn::new(integration, velocity);
        self.replay.batch.make(&self.velocities, &mut self.turns, turn);
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
        let mut rows = std::mem::take(&mut self.rows);
        rows.iter_mut().for_each(Vec::clear);
        let integration = self.arguments.integrate.then_some(&self.arguments.integration);
        let turns = if self.turned { self.turns.as_slice() } else { &[] };
        for (body, pose) in rows_of(poses, records, views) {
            let (mut pose, mut velocity) =
                (decode::pose(StreamFormat::F32, &pose), self.velocities[body]);
            let mass = &self.replay.masses[usize::from(self.shape_of[body])];
            if let Some(integration) = integration
                && mass.inverse_mass != 0.0
            {
                (pose, velocity) = match turns.get(body) {
                    Some(turn) => turn.of(&pose),
                    None => integrate::<Single>(integration, &pose, &velocity),
                };
            }
            let result = decode::result(StreamFormat::F32, &pose, &velocity);
            for (rows, row) in rows.iter_mut().zip(result) {
                rows.push(Beat(row));
            }
        }
        results.send_rows(records, &rows, outputs);
        let sent = sum(rows.each_ref().map(Vec::as_slice));
        self.rows = rows;
        [sum(views), sent]
    }
}
