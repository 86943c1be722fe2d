//! Integrates bodies side by side: the formulae and the order of evaluation of `integrate.rs`, SIMD
//! lane by SIMD lane.
//!
//! The bodies come and go on streams that take turns. Bodies at the same place in successive periods
//! lie at a constant distance on their streams.

use std::mem;
use std::ops::Range;
use std::sync::atomic::{AtomicU32, Ordering};

use super::Batch;
use super::block::{LANES, ROWS_APART};
use super::line::Line;
use super::width::Width;
use crate::accelerator::arithmetic::number::Single;
use crate::accelerator::integrate::{Integration, integrate};
use crate::accelerator::records::array::Row;
use crate::accelerator::records::decode;
use crate::accelerator::records::striping::{ROWS_IN, ROWS_OUT, STREAMS_MAX, Turns};
use crate::accelerator::solver::Velocity;
use crate::shortcut::deferred::bodies::{BodyRows, beats_of_results, period};
use pgs_interface::number::StreamFormat;
use pgs_interface::profile::solver::{ROTATION_LIMIT, SERIES_BELOW, SERIES_TERM};
use pgs_interface::record::Beat;
use pgs_support::lanes::{F32x16, Instructions, Quad, Work};

/// Bodies that a thread integrates at once.
const INTEGRATED_TOGETHER: usize = 512;

/// Room for results, on each stream.
pub(crate) type ResultPlaces<'a> = [&'a mut [Beat]; STREAMS_MAX];

fn added(rows: &[Row]) -> u32 {
    rows.as_flattened().iter().copied().fold(0, u32::wrapping_add)
}

/// Bodies, and their integration if they are integrated.
#[derive(Clone, Copy)]
struct Bodies<'a> {
    integration: Option<&'a Integration>,
    /// Their rows of velocities, two to a line, from body 0 on.
    lines: &'a [Line],
    poses: BodyRows<'a>,
    width: Width,
}

/// Takes room for the results of bodies.
fn take<'a>(places: &mut ResultPlaces<'a>, turns: Turns, bodies: Range<usize>) -> ResultPlaces<'a> {
    let mut beats = beats_of_results(turns, bodies).into_iter();
    places.each_mut().map(|place| {
        let (taken, rest) = mem::take(place).split_at_mut(beats.next().unwrap_or(0));
        *place = rest;
        taken
    })
}

impl Bodies<'_> {
    /// The results of bodies; the sums of the words of their poses and of their results.
    fn results(&self, bodies: Range<usize>, places: ResultPlaces<'_>) -> [u32; 2] {
        match self.poses.turns.streams {
            4 => self.results_on::<4>(bodies, places),
            3 => self.results_on::<3>(bodies, places),
            2 => self.results_on::<2>(bodies, places),
            _ => self.results_on::<1>(bodies, places),
        }
    }

    /// The same, from and to `STREAMS` streams.
    fn results_on<const STREAMS: usize>(
        &self,
        bodies: Range<usize>,
        mut places: ResultPlaces<'_>,
    ) -> [u32; 2] {
        let turns = Turns { streams: STREAMS };
        let period = const { period(STREAMS, ROWS_IN) };
        // In a group, the bodies at each place of a period fill all lanes.
        let group = period * LANES;
        let mut sums = [0; 2];
        let Range { start, end } = bodies;
        let mut last = start;
        let side_by_side = self.integration.filter(|_| !matches!(self.width, Width::One));
        if let Some(integration) = side_by_side {
            let first = start.next_multiple_of(period).min(end);
            last = first + (end - first) / group * group;
            let places_before = take(&mut places, turns, start..first);
            self.one_by_one::<STREAMS>(start..first, places_before, &mut sums);
            let places = take(&mut places, turns, first..last);
            let groups = self.groups::<STREAMS>(integration, first..last, places, &mut sums);
            let _ = self.width.run(groups);
        }
        self.one_by_one::<STREAMS>(last..end, places, &mut sums);
        sums
    }

    /// Whole groups of bodies; the first body begins a period.
    fn groups<'a, const STREAMS: usize>(
        &'a self,
        integration: &'a Integration,
        bodies: Range<usize>,
        places: ResultPlaces<'a>,
        sums: &'a mut [u32; 2],
    ) -> Groups<'a, STREAMS> {
        let turns = self.poses.turns;
        let [from, to] = [bodies.start, bodies.end].map(|body| turns.counts(ROWS_IN * body));
        let before = self.poses.before();
        let poses = std::array::from_fn(|k| {
            bytemuck::cast_slice(&self.poses.views[k][from[k] - before[k]..to[k] - before[k]])
        });
        let rows = bytemuck::cast_slice(self.lines);
        let rows = &rows[ROWS_IN * bodies.start..ROWS_IN * bodies.end];
        let places = places.map(bytemuck::cast_slice_mut);
        Groups { integration, rows, poses, places, sums }
    }

    /// The same, one body after the other.
    fn one_by_one<const STREAMS: usize>(
        &self,
        bodies: Range<usize>,
        places: ResultPlaces<'_>,
        sums: &mut [u32; 2],
    ) {
        let turns = Turns { streams: STREAMS };
        let before = turns.counts(ROWS_OUT * bodies.start);
        let poses = BodyRows { turns, ..self.poses };
        for body in bodies {
            let rows = poses.of(body);
            let mut pose = decode::pose(StreamFormat::F32, &rows);
            let (line, second) = (&self.lines[body / 2], body % 2 == 1);
            let mut velocity = line.velocity(second);
            if let Some(integration) = self.integration {
                if line.moves(second) {
                    (pose, velocity) = integrate::<Single>(integration, &pose, &velocity);
                } else if velocity != Velocity::default() {
                    (pose, _) = integrate::<Single>(&integration.undamped(), &pose, &velocity);
                }
            }
            let result = decode::result(StreamFormat::F32, &pose, &velocity);
            sums[0] = sums[0].wrapping_add(added(&rows));
            sums[1] = sums[1].wrapping_add(added(&result));
            for (row, words) in result.into_iter().enumerate() {
                let (k, number) = turns.place(ROWS_OUT * body + row);
                places[k][number - before[k]] = Beat(words);
            }
        }
    }
}

/// Bodies side by side: the lanes hold bodies at the same place in their periods.
struct Groups<'a, const STREAMS: usize> {
    integration: &'a Integration,
    /// Two quads of a body.
    rows: &'a [Quad],
    /// The beats of whole periods on each stream.
    poses: [&'a [Quad]; STREAMS_MAX],
    places: [&'a mut [Quad]; STREAMS_MAX],
    sums: &'a mut [u32; 2],
}

/// The constants of an integration.
#[derive(Clone, Copy)]
struct Constants {
    zero: F32x16,
    one: F32x16,
    half: F32x16,
    time_step: F32x16,
    damping: F32x16,
    /// The change of the velocity by gravity.
    fall: [F32x16; 3],
    rotation_limit: F32x16,
    speed_limit: F32x16,
    series_below: F32x16,
    series_first: F32x16,
    series_second: F32x16,
}

impl Constants {
    #[inline(always)]
    fn new(integration: &Integration) -> Self {
        let Integration { time_step: dt, angular_damping, gravity } = *integration;
        let n = F32x16::splat;
        Self {
            zero: n(0.0),
            one: n(1.0),
            half: n(0.5),
            time_step: n(dt),
            damping: n(angular_damping),
            fall: gravity.map(|gravity| n(gravity) * n(dt)),
            rotation_limit: n(ROTATION_LIMIT),
            speed_limit: n(ROTATION_LIMIT) / n(dt),
            series_below: n(SERIES_BELOW),
            series_first: n(0.5) * n(dt),
            series_second: ((n(dt) * n(dt)) * n(dt)) * n(SERIES_TERM),
        }
    }

    /// The factor from the angular velocity to the rotation, and the cosine of half the angle.
    #[inline(always)]
    fn rotation(&self, w: [F32x16; 3]) -> [F32x16; 2] {
        let Self { half, time_step, .. } = *self;
        let speed = ((w[0] * w[0] + w[1] * w[1]) + w[2] * w[2]).sqrt();
        let fast = (speed * time_step).above(self.rotation_limit);
        let speed = self.speed_limit.or(fast, speed);
        let slow = self.series_below.above(speed);
        let series = self.series_first - (self.series_second * speed) * speed;
        let mut sines = ((half * speed) * time_step).to_array();
        let mut cosines = ((speed * time_step) * half).to_array();
        let lacking = slow.bits();
        for (lane, (sine, cosine)) in sines.iter_mut().zip(&mut cosines).enumerate() {
            if lacking & (1 << lane) == 0 {
                *sine = libm::sinf(*sine);
            }
            *cosine = libm::cosf(*cosine);
        }
        let factor = series.or(slow, F32x16::from_array(sines) / speed);
        [factor, F32x16::from_array(cosines)]
    }
}

impl<const STREAMS: usize> Work for Groups<'_, STREAMS> {
    type Output = ();

    #[inline(always)]
    fn run(self, instructions: impl Instructions) {
        let Self { integration, rows, poses, places, sums } = self;
        let constants = Constants::new(integration);
        let Constants { zero, one, time_step: dt, damping, fall, .. } = constants;
        let period = const { period(STREAMS, ROWS_IN) };
        // Beats of a period on each stream.
        let (came, goes) = (period * ROWS_IN / STREAMS, period * ROWS_OUT / STREAMS);
        let turns = Turns { streams: STREAMS };
        let periods = rows.len() / (ROWS_IN * period);
        let mut totals = [zero; 2];
        for (at, body) in
            (0..periods).step_by(LANES).flat_map(|at| (0..period).map(move |body| (at, body)))
        {
            let first = ROWS_IN * (period * at + body);
            let [vx, vy, vz, m] = instructions.load(&rows[first..], ROWS_IN * period);
            let before = instructions.load(&rows[first + 1..], ROWS_IN * period);
            let (k, number) = turns.place(ROWS_IN * body);
            let [px, py, pz, unused] = instructions.load(&poses[k][came * at + number..], came);
            let (k, number) = turns.place(ROWS_IN * body + 1);
            let [qx, qy, qz, qw] = instructions.load(&poses[k][came * at + number..], came);
            // A body of inverse mass 0 keeps its velocity, and stays where it is if that is 0.
            let held = m.is(zero);
            let damping = one.or(held, damping);
            let [wx, wy, wz] = [before[0] * damping, before[1] * damping, before[2] * damping];

            let [factor, c] = constants.rotation([wx, wy, wz]);
            let (x, y, z) = (wx * factor, wy * factor, wz * factor);
            let rx = ((c * qx + x * qw) + y * qz) - z * qy;
            let ry = ((c * qy + y * qw) + z * qx) - x * qz;
            let rz = ((c * qz + z * qw) + x * qy) - y * qx;
            let rw = ((c * qw - x * qx) - y * qy) - z * qz;
            let scale = one / (((rx * rx + ry * ry) + rz * rz) + rw * rw).sqrt();

            let speeds = [vx, vy, vz, before[0], before[1], before[2]];
            let rests = speeds.into_iter().fold(held, |rests, speed| rests.and(speed.is(zero)));
            let results = [
                [
                    px.or(rests, px + vx * dt),
                    py.or(rests, py + vy * dt),
                    pz.or(rests, pz + vz * dt),
                    zero,
                ],
                [
                    qx.or(rests, rx * scale),
                    qy.or(rests, ry * scale),
                    qz.or(rests, rz * scale),
                    qw.or(rests, rw * scale),
                ],
                [
                    vx.or(held, vx + fall[0]),
                    vy.or(held, vy + fall[1]),
                    vz.or(held, vz + fall[2]),
                    zero,
                ],
                [before[0].or(held, wx), before[1].or(held, wy), before[2].or(held, wz), zero],
            ];
            for row in [[px, py, pz, unused], [qx, qy, qz, qw]] {
                totals[0] = row.into_iter().fold(totals[0], F32x16::with_words);
            }
            for (row, words) in results.into_iter().enumerate() {
                totals[1] = words.into_iter().fold(totals[1], F32x16::with_words);
                let (k, number) = turns.place(ROWS_OUT * body + row);
                instructions.store(words, &mut places[k][goes * at + number..], goes);
            }
        }
        for (sum, total) in sums.iter_mut().zip(totals) {
            let words = total.to_array().map(f32::to_bits);
            *sum = words.into_iter().fold(*sum, u32::wrapping_add);
        }
    }
}

impl Batch {
    /// Integrates bodies, or only sends them back, into the room that `places` has. The velocities are
    /// the entered ones as the passes have left them. Returns the sums of the words of the poses and of
    /// the results.
    pub(crate) fn integrate(
        &mut self,
        integration: Option<&Integration>,
        bodies: Range<usize>,
        poses: BodyRows<'_>,
        mut places: ResultPlaces<'_>,
    ) -> [u32; 2] {
        let own = Bodies {
            integration,
            lines: &self.lines[ROWS_APART as usize / 2..],
            poses,
            width: self.width,
        };
        let sums = [const { AtomicU32::new(0) }; 2];
        let parts = bodies.clone().step_by(INTEGRATED_TOGETHER).map(|first| {
            let part = first..(first + INTEGRATED_TOGETHER).min(bodies.end);
            (part.clone(), take(&mut places, poses.turns, part))
        });
        self.crew.each(parts, |(part, places)| {
            let found = own.results(part, places);
            for (sum, found) in sums.iter().zip(found) {
                sum.fetch_add(found, Ordering::Relaxed);
            }
        });
        sums.map(AtomicU32::into_inner)
    }
}

#[cfg(test)]
mod tests;
