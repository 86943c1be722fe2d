//! Loads and integrates bodies whose beats are still in their buffers, on streams that take turns.
//!
//! ```text
//! four streams    0 1 | 2 3 |              two rows of a body, of the next one...
//! three           0 1 | 2 0 | 1 2 |
//! ```
//!
//! After two bodies, or three, the next one begins with stream 0 again: that is a period. With world
//! inertia a body has four rows, and a period on four streams is one body.

use std::ops::Range;
use std::sync::atomic::{AtomicU32, AtomicUsize, Ordering};

use super::Deferred;
use crate::accelerator::Accelerator;
use crate::accelerator::arithmetic::inertia::Stored;
use crate::accelerator::control::Arguments;
use crate::accelerator::defer::ArrivedRecords;
use crate::accelerator::records::array::Row;
use crate::accelerator::records::decode;
use crate::accelerator::records::results::Results;
use crate::accelerator::records::segment::{PacketError, Segment};
use crate::accelerator::records::striping::{PerStream, ROWS_IN, ROWS_OUT, STREAMS_MAX, Turns};
use crate::accelerator::solver::{Mass, Velocity};
use crate::cast::register;
use crate::config::SHAPES_MAX;
use crate::memory::{Memory, Source};
use crate::shortcut::batch::{Properties, ResultPlaces};
use crate::stream::Stream;
use pgs_interface::control::ErrorCode;
use pgs_interface::number::StreamFormat;
use pgs_interface::record::{Beat, LANES, WORD_LANE, velocity};

/// Beats of bodies in their buffers, stream by stream.
pub(crate) type Views<'a> = [&'a [Beat]; STREAMS_MAX];

/// Bodies that a thread loads at once.
const LOADED_TOGETHER: usize = 2048;

// Every shape of the table fits into a byte: a body is refused only where `bodies_with_shape` ends.
const _: () = assert!(SHAPES_MAX <= 1 << u8::BITS);

/// Beats of the results of `bodies` on each stream.
pub(crate) fn beats_of_results(turns: Turns, bodies: Range<usize>) -> PerStream {
    let [before, after] = [bodies.start, bodies.end].map(|body| turns.counts(ROWS_OUT * body));
    std::array::from_fn(|k| after[k] - before[k])
}

/// Bodies of `rows` rows each after which the next one begins with stream 0 again.
pub(crate) const fn period(streams: usize, rows: usize) -> usize {
    let mut bodies = 1;
    while !(bodies * rows).is_multiple_of(streams) {
        bodies += 1;
    }
    bodies
}

/// Velocities or poses in their buffers. The views begin with body `first`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BodyRows<'a> {
    pub(crate) views: Views<'a>,
    pub(crate) turns: Turns,
    /// Rows of a body.
    pub(crate) rows: usize,
    pub(crate) first: usize,
}

/// Where bodies are loaded to.
#[derive(Debug)]
struct Loaded<'a> {
    velocities: &'a mut [Velocity],
    shape_of: &'a mut [u8],
    /// With streamed masses only.
    inverse_masses: &'a mut [f32],
    /// With world inertia only.
    inertias: &'a mut [Stored],
}

impl BodyRows<'_> {
    /// Beats on each stream before the views.
    pub(crate) fn before(&self) -> PerStream {
        self.turns.counts(self.rows * self.first)
    }

    /// The rows of a body's pose.
    pub(crate) fn of(&self, body: usize) -> [Row; ROWS_IN] {
        let before = self.before();
        std::array::from_fn(|row| {
            let (k, number) = self.turns.place(ROWS_IN * body + row);
            self.views[k][number - before[k]].0
        })
    }

    /// Loads the bodies from `first` on; with `kinematic`, bodies of inverse mass 0 have the velocity of
    /// their record. Returns the sum of their words, and the first body whose shape is not in the table.
    fn load(
        &self,
        first: usize,
        masses: &[Mass],
        to: Loaded<'_>,
        kinematic: bool,
    ) -> (u32, Option<usize>) {
        const WORLD: usize = velocity::WORLD_ROWS;
        match (self.turns.streams, self.rows) {
            (4, WORLD) => self.load_from::<4, WORLD>(first, masses, to, kinematic),
            (3, WORLD) => self.load_from::<3, WORLD>(first, masses, to, kinematic),
            (2, WORLD) => self.load_from::<2, WORLD>(first, masses, to, kinematic),
            (_, WORLD) => self.load_from::<1, WORLD>(first, masses, to, kinematic),
            (4, _) => self.load_from::<4, ROWS_IN>(first, masses, to, kinematic),
            (3, _) => self.load_from::<3, ROWS_IN>(first, masses, to, kinematic),
            (2, _) => self.load_from::<2, ROWS_IN>(first, masses, to, kinematic),
            (..) => self.load_from::<1, ROWS_IN>(first, masses, to, kinematic),
        }
    }

    /// [`load`](Self::load) with the numbers of streams and rows known when this is compiled.
    fn load_from<const STREAMS: usize, const ROWS: usize>(
        &self,
        first: usize,
        masses: &[Mass],
        to: Loaded<'_>,
        kinematic: bool,
    ) -> (u32, Option<usize>) {
        let Loaded { velocities, shape_of, inverse_masses, inertias } = to;
        let turns = Turns { streams: STREAMS };
        let (period, stride) =
            const { (period(STREAMS, ROWS), period(STREAMS, ROWS) * ROWS / STREAMS) };
        let before = self.before();
        let (mut sum, mut wrong) = ([0_u32; LANES], None);
        for own in 0..period.min(velocities.len()) {
            let views: [&[Beat]; ROWS] = std::array::from_fn(|row| {
                let (k, number) = turns.place(ROWS * (first + own) + row);
                &self.views[k][number - before[k]..]
            });
            for at in 0..(velocities.len() - own).div_ceil(period) {
                let rows: [Row; ROWS] = views.map(|view| view[at * stride].0);
                let body = own + at * period;
                for row in rows {
                    for (sum, word) in sum.iter_mut().zip(row) {
                        *sum = sum.wrapping_add(word);
                    }
                }
                let moving = [rows[velocity::LINEAR], rows[velocity::ANGULAR]];
                let (loaded, shape) = decode::velocity(StreamFormat::F32, &moving);
                let world = <&[Row; velocity::WORLD_ROWS]>::try_from(rows.as_slice());
                let inverse_mass = match (inverse_masses.get_mut(body), world) {
                    (Some(streamed), Ok(rows)) => {
                        *streamed = decode::inverse_mass(StreamFormat::F32, rows);
                        *streamed
                    }
                    _ => {
                        let (Some(mass), Ok(shape)) =
                            (masses.get(shape as usize), u8::try_from(shape))
                        else {
                            wrong = wrong.into_iter().chain([first + body]).min();
                            continue;
                        };
                        shape_of[body] = shape;
                        mass.inverse_mass
                    }
                };
                // The words of a body at rest are ignored.
                let moves = inverse_mass != 0.0 || kinematic;
                velocities[body] = if moves { loaded } else { Velocity::default() };
                if let (Ok(rows), Some(inertia)) = (world, inertias.get_mut(body)) {
                    *inertia = decode::world_inertia(StreamFormat::F32, rows);
                }
            }
        }
        (sum.into_iter().fold(0, u32::wrapping_add), wrong)
    }

    /// The first of the next `bodies` bodies whose shape is not among `shapes`.
    fn without_shape(&self, bodies: usize, shapes: usize) -> Option<usize> {
        let (period, before) = (period(self.turns.streams, self.rows), self.before());
        let stride = period * self.rows / self.turns.streams;
        let found = (self.first..self.first + period.min(bodies)).filter_map(|begin| {
            let (k, number) = self.turns.place(self.rows * begin + velocity::LINEAR);
            let linear = self.views[k].iter().skip(number - before[k]).step_by(stride);
            let most = (self.first + bodies - begin).div_ceil(period);
            let unknown = |beat: &Beat| beat.0[WORD_LANE] as usize >= shapes;
            linear.take(most).position(unknown).map(|at| begin + at * period)
        });
        found.min()
    }
}

/// The shapes, masses and inertias of the bodies of the step under way.
pub(super) fn properties<'a>(accelerator: &'a Accelerator, masses: &'a [Mass]) -> Properties<'a> {
    let Accelerator { shape_of, inverse_masses, inertias, .. } = accelerator;
    Properties { shape_of, masses, inverse_masses, inertias }
}

impl Deferred {
    /// How bodies lie on the streams, if they can be taken from their buffers and put into them.
    pub(crate) fn bodies(&self) -> Option<Turns> {
        self.decoded.layout.bodies.filter(|_| self.active)
    }

    /// Rows of a body's velocity.
    pub(crate) fn rows_of_velocity(&self) -> usize {
        self.decoded.layout.velocity_rows
    }

    /// The rows of the bodies that have arrived, `rows` a body, if they are all in their buffers.
    pub(super) fn rows_of_next<'a>(
        &self,
        rows: usize,
        segment: &Segment,
        ArrivedRecords { records, inputs, memory }: &ArrivedRecords<'a>,
    ) -> Option<BodyRows<'a>> {
        let turns = self.bodies()?;
        let counts = segment.beats_of_next(*records);
        let mut views: Views<'a> = [&[]; STREAMS_MAX];
        for ((view, stream), count) in views.iter_mut().zip(inputs.iter()).zip(counts) {
            if count > 0 {
                let (_, source) =
                    Some(stream.piece(0, count)).filter(|(there, _)| *there == count)?;
                *view = memory.view(source?, count)?;
            }
        }
        Some(BodyRows { views, turns, rows, first: segment.done })
    }

    /// Loads the next bodies; returns the sum of their words.
    pub(super) fn load_rows(
        &mut self,
        accelerator: &mut Accelerator,
        records: usize,
        rows: BodyRows<'_>,
    ) -> Result<u32, PacketError> {
        let bodies = rows.first..rows.first + records;
        let (batch, masses) = (&mut self.decoded.batch, &self.decoded.masses);
        let kinematic = accelerator.arguments.kinematic;
        let velocities = accelerator.velocities[bodies.clone()].chunks_mut(LOADED_TOGETHER);
        let shapes = accelerator.shape_of[bodies.clone()].chunks_mut(LOADED_TOGETHER);
        // Without world inertia there is none, nor a mass without streamed ones.
        let inertias = accelerator.inertias.get_mut(bodies.clone()).unwrap_or_default();
        let none = std::iter::repeat_with(Default::default);
        let inertias = inertias.chunks_mut(LOADED_TOGETHER).chain(none);
        let inverse_masses = accelerator.inverse_masses.get_mut(bodies.clone()).unwrap_or_default();
        let none = std::iter::repeat_with(Default::default);
        let inverse_masses = inverse_masses.chunks_mut(LOADED_TOGETHER).chain(none);
        let (sum, wrong) = (AtomicU32::new(0), AtomicUsize::new(usize::MAX));
        let parts = bodies.step_by(LOADED_TOGETHER).zip(velocities.zip(shapes));
        let parts = parts.zip(inverse_masses.zip(inertias));
        batch.share(parts, |((first, (velocities, shape_of)), (inverse_masses, inertias))| {
            let to = Loaded { velocities, shape_of, inverse_masses, inertias };
            let (of_part, wrong_body) = rows.load(first, masses, to, kinematic);
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

    /// Integrates the next bodies and sends their results; returns the sums of the words received
    /// and sent.
    pub(super) fn integrate_rows(
        &mut self,
        accelerator: &Accelerator,
        results: &mut Results,
        records: usize,
        poses: BodyRows<'_>,
        outputs: &mut [Stream],
    ) -> [u32; 2] {
        let first = poses.first;
        let mut rows = self.room(poses.turns, first..first + records);
        let places = rows.each_mut().map(Vec::as_mut_slice);
        let sums = self.results(accelerator, first..first + records, poses, places);
        results.send_rows(records, &rows, outputs);
        self.rows = rows;
        sums
    }

    /// Room for the results of bodies.
    fn room(&mut self, turns: Turns, bodies: Range<usize>) -> [Vec<Beat>; STREAMS_MAX] {
        let mut rows = std::mem::take(&mut self.rows);
        for (rows, beats) in rows.iter_mut().zip(beats_of_results(turns, bodies)) {
            rows.resize(beats, Beat::default());
        }
        rows
    }

    /// Computes the results of bodies into the places that have room for them. Returns the sums of
    /// the words received and sent.
    fn results(
        &mut self,
        accelerator: &Accelerator,
        bodies: Range<usize>,
        poses: BodyRows<'_>,
        places: ResultPlaces<'_>,
    ) -> [u32; 2] {
        let batch = &mut self.decoded.batch;
        batch.enter(&accelerator.velocities, properties(accelerator, &self.decoded.masses));
        let Arguments { integrate, integration, .. } = &accelerator.arguments;
        batch.integrate(integrate.then_some(integration), bodies, poses, places)
    }

    /// The part of the next bodies to load within `cycles` that have a shape. `sources` say where
    /// their beats are.
    pub(crate) fn bodies_with_shape(
        &self,
        segment: &Segment,
        sources: &[(Source, usize); STREAMS_MAX],
        cycles: u64,
        memory: &Memory,
    ) -> Option<usize> {
        let (turns, rows) = (self.bodies()?, self.rows_of_velocity());
        // A row a cycle from each stream.
        let most = usize::try_from(cycles).unwrap_or(usize::MAX).saturating_mul(turns.streams);
        let records = segment.left().min((most / rows).saturating_add(1));
        let mut views: Views<'_> = [&[]; STREAMS_MAX];
        for (view, (source, count)) in views.iter_mut().zip(sources).take(turns.streams) {
            *view = memory.view(*source, *count)?;
        }
        let rows = BodyRows { views, turns, rows, first: segment.done };
        let bad = match self.decoded.needs_shapes {
            true => rows.without_shape(records, self.decoded.masses.len()),
            false => None,
        };
        Some(bad.map_or(records, |body| body - segment.done))
    }

    /// Bodies have been loaded that flowed undisturbed, whose beats are on the streams now.
    pub(crate) fn pass_over_loaded(
        &mut self,
        accelerator: &mut Accelerator,
        segment: &mut Segment,
        records: usize,
        rows: BodyRows<'_>,
        inputs: &mut [Stream],
    ) {
        let loaded = self.load_rows(accelerator, records, rows);
        debug_assert!(loaded.is_ok(), "all of them have a shape: {loaded:?}");
        accelerator.received(loaded.unwrap_or_default());
        segment.skip(records, inputs);
    }

    /// Bodies have been integrated that flowed undisturbed, whose beats are on the streams now. The
    /// results go to `places` as far as these have room, behind the results that wait on the streams;
    /// the last ones go onto the streams.
    pub(crate) fn pass_over_integrated(
        &mut self,
        accelerator: &mut Accelerator,
        poses: &mut Segment,
        records: usize,
        rows: BodyRows<'_>,
        (inputs, outputs): (&mut [Stream], &mut [Stream]),
        mut places: ResultPlaces<'_>,
    ) {
        for (place, stream) in places.iter_mut().zip(&mut *outputs) {
            let waiting = stream.len().min(place.len());
            let (from_stream, behind) = std::mem::take(place).split_at_mut(waiting);
            stream.pop_into(from_stream);
            *place = behind;
        }
        let (turns, bodies) = (rows.turns, rows.first..rows.first + records);
        let went = turns.counts(ROWS_OUT * bodies.start);
        let whole = turns.contiguous(|k| went[k] + places[k].len()) / ROWS_OUT;
        let whole = whole.min(bodies.end);
        let mut beats = beats_of_results(turns, bodies.start..whole).into_iter();
        let now = places.each_mut().map(|place| {
            let beats = beats.next().unwrap_or(0);
            let (now, behind) = std::mem::take(place).split_at_mut(beats);
            *place = behind;
            now
        });
        let before = self.results(accelerator, bodies.start..whole, rows, now);
        let mut staying = self.room(turns, whole..bodies.end);
        let places_of_rows = staying.each_mut().map(Vec::as_mut_slice);
        let behind = self.results(accelerator, whole..bodies.end, rows, places_of_rows);
        for ((rows, place), stream) in staying.iter().zip(places).zip(outputs) {
            let (leaving, staying) = rows.split_at(place.len());
            place.copy_from_slice(leaving);
            stream.push(staying);
        }
        self.rows = staying;
        accelerator.received(before[0].wrapping_add(behind[0]));
        accelerator.sent(before[1].wrapping_add(behind[1]));
        poses.skip(records, inputs);
    }
}
