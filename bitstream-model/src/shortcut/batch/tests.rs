//! Compares a batch with `solver.rs`, which takes one collision after the other.

use proptest::prelude::*;

use super::*;
use crate::accelerator::arithmetic::inertia::{Inertia as InertiaForm, Stored};
use crate::accelerator::arithmetic::number::{Format, Number};
use crate::accelerator::records::array::Row;
use crate::accelerator::records::segment::PacketError;
use crate::accelerator::solver::{self, Mass, SolverParameters};
use crate::cast::register;
use pgs_interface::control::ErrorCode;
use pgs_interface::number::StreamFormat;
use pgs_interface::record::{Beat, WORD_LANE, collision};

/// A format that a batch computes in, as a test wants it.
pub(crate) trait Tested: Format {
    const PRECISION: Precision;
}

impl Tested for Single {
    const PRECISION: Precision = Precision::F32;
}

impl Tested for Half {
    const PRECISION: Precision = Precision::Binary16;
}

fn rounded<F: Format, const N: usize>(numbers: [f32; N]) -> [f32; N] {
    numbers.map(|number| Number::<F>::new(number).value())
}

const PARAMETERS: SolverParameters = SolverParameters {
    time_step: 1.0 / 60.0,
    drift: 0.005,
    coefficient: 0.2,
    friction: 0.7,
    spin_damping: 0.1,
    pair_friction: false,
};

const fn mass(inverse_mass: f32, inverse_inertia: f32) -> Mass {
    let inverse_inertia = [inverse_inertia, 0.0, 0.0, 0.0, 0.0, 0.0];
    Mass { inverse_mass, inverse_inertia }
}

/// Static, three that move, a static one of a negative zero, one that moves although sixteen bits have
/// no such number, and one of infinite inverse inertia, whose rows have an effective mass of zero.
pub(crate) const MASSES: [Mass; 7] = [
    mass(0.0, 0.0),
    mass(1.0, 6.0),
    mass(0.125, 0.4),
    mass(3.0, 0.0),
    mass(-0.0, 0.0),
    mass(1e-9, 0.1),
    mass(1.0, f32::INFINITY),
];

/// The records of a step and the bodies that they are about.
#[derive(Debug, Clone)]
pub(crate) struct Step {
    pub(crate) records: Vec<[Row; collision::ROWS]>,
    pub(crate) shape_of: Vec<u8>,
    pub(crate) velocities: Vec<Velocity>,
    /// World inertia of each body, or none.
    pub(crate) inertias: Vec<Stored>,
    /// The impulses of each collision that the first pass of each kind brings, or none.
    pub(crate) given: Vec<[Impulses; 2]>,
}

impl Step {
    pub(crate) fn properties(&self) -> Properties<'_> {
        let Self { shape_of, inertias, .. } = self;
        Properties { inertias, ..Properties::of_shapes(shape_of, &MASSES) }
    }

    /// The passes, the first `contact` of them contact passes.
    fn plan(&self, contact: u32) -> Plan<'static> {
        Plan { contact, warm: !self.given.is_empty(), parameters: &PARAMETERS }
    }

    /// The same with the inertia of the shapes.
    fn isotropic(self) -> Self {
        Self { inertias: Vec::new(), ..self }
    }

    fn inertia(&self) -> Inertia {
        if self.inertias.is_empty() { Inertia::Isotropic } else { Inertia::World }
    }

    pub(crate) fn streams(&self, records: Range<usize>) -> [Vec<Beat>; 4] {
        let mut streams = [const { Vec::new() }; 4];
        for rows in &self.records[records] {
            for (beat, row) in rows.iter().enumerate() {
                streams[beat % 4].push(Beat(*row));
            }
        }
        streams
    }

    /// The same in numbers of a format.
    fn in_format<F: Format>(mut self) -> Self {
        for rows in &mut self.records {
            for (number, row) in rows.iter_mut().enumerate() {
                let word = row[WORD_LANE];
                *row = rounded::<F, 4>(row.map(f32::from_bits)).map(f32::to_bits);
                if number <= collision::BODY_B {
                    row[WORD_LANE] = word;
                }
            }
        }
        for Velocity { linear, angular } in &mut self.velocities {
            (*linear, *angular) = (rounded::<F, 3>(*linear), rounded::<F, 3>(*angular));
        }
        // No layout has a warm start in other numbers than f32.
        self.given.clear();
        self
    }

    fn decoded(&self, mut batch: Batch, cut: usize, masses: &[Mass]) -> Batch {
        batch.begin(self.records.len(), false);
        for part in [0..cut, cut..self.records.len()] {
            let mut streams = self.streams(part.clone());
            let mut sums = vec![0; part.len()];
            if self.given.is_empty() {
                let streams = streams.each_ref().map(Vec::as_slice);
                batch.decode(
                    streams,
                    part.len(),
                    Properties::of_shapes(&self.shape_of, masses),
                    &mut sums,
                )
            } else {
                let pairs = [0, 1].map(|kind| self.with_impulses(part.clone(), kind, &streams[3]));
                streams[3] = pairs[0].concat();
                let streams = streams.each_ref().map(Vec::as_slice);
                let decoded = batch.decode_warm(
                    streams,
                    part.len(),
                    Properties::of_shapes(&self.shape_of, masses),
                    &mut sums,
                );
                for (contact, pairs) in [true, false].into_iter().zip(&pairs) {
                    let mut of_impulses = vec![0; part.len()];
                    batch.give(contact, part.start, pairs, &mut of_impulses);
                    for (sum, [_, beat]) in of_impulses.iter().zip(pairs) {
                        assert_eq!(*sum, beat.0.into_iter().fold(0, u32::wrapping_add));
                    }
                }
                decoded
            }
            .expect("nothing is wrong");
            for (rows, sum) in self.records[part].iter().zip(&sums) {
                let words = rows.as_flattened().iter();
                assert_eq!(*sum, words.fold(0, |sum, word| word.wrapping_add(sum)));
            }
        }
        batch
    }

    /// Contact points, each with the impulses of its collision behind it.
    fn with_impulses(&self, part: Range<usize>, kind: usize, points: &[Beat]) -> Vec<[Beat; 2]> {
        let impulses = self.given[part].iter().map(|given| Beat(given[kind].map(f32::to_bits)));
        points.iter().copied().zip(impulses).map(|(point, impulses)| [point, impulses]).collect()
    }

    /// Velocities, impulses and impulse sum after the passes, one collision after the other.
    pub(crate) fn expected<F: Format>(
        &self,
        contact: u32,
        passes: u32,
    ) -> (Vec<Velocity>, Vec<Impulses>, u64) {
        match self.inertia() {
            Inertia::Isotropic => self.expected_with::<F, Isotropic>(contact, passes),
            Inertia::World => self.expected_with::<F, World>(contact, passes),
        }
    }

    fn expected_with<F: Format, I: InertiaForm>(
        &self,
        contact: u32,
        passes: u32,
    ) -> (Vec<Velocity>, Vec<Impulses>, u64) {
        let properties = self.properties();
        let mut velocities = self.velocities.clone();
        let mut impulses = vec![[0.0; 4]; self.records.len()];
        let mut sum = 0_u64;
        for pass in 0..passes {
            let kind = usize::from(pass >= contact);
            let warm = !self.given.is_empty() && (pass == 0 || pass == contact);
            for (index, (rows, impulses)) in self.records.iter().zip(&mut impulses).enumerate() {
                let given = self.given.get(index).filter(|_| warm).map(|given| &given[kind]);
                let collision = Collision::of(StreamFormat::F32, rows);
                if collision.count == 0 {
                    continue;
                }
                let sides = [collision.body_a as usize, collision.body_b as usize];
                let both = sides.map(|body| properties.mass(body));
                let mut pair = sides.map(|body| velocities[body]);
                let arguments = (&collision, &PARAMETERS, &both);
                let (collision, parameters, both) = arguments;
                if pass < contact {
                    solver::contact::<F, F, I>(
                        collision, parameters, both, &mut pair, impulses, given,
                    );
                } else {
                    if pass == contact {
                        *impulses = [solver::normal_sum::<F>(impulses), 0.0, 0.0, 0.0];
                    }
                    solver::friction::<F, F, I>(
                        collision, parameters, both, &mut pair, impulses, given,
                    );
                }
                if pass + 1 == contact {
                    let share = f64::from(solver::normal_sum::<F>(impulses)) * 1_048_576.0;
                    #[expect(
                        clippy::cast_possible_truncation,
                        clippy::cast_sign_loss,
                        reason = "saturates"
                    )]
                    let share = share as u64;
                    sum = sum.saturating_add(share);
                }
                for side in 0..2 {
                    if both[side].inverse_mass != 0.0 {
                        velocities[sides[side]] = pair[side];
                    }
                }
            }
        }
        (velocities, impulses, sum)
    }
}

/// The bits of numbers, all NaNs as one: which of two is passed on is nowhere defined.
fn bits<const N: usize>(numbers: [f32; N]) -> [u32; N] {
    numbers.map(|number| if number.is_nan() { f32::NAN.to_bits() } else { number.to_bits() })
}

fn velocity_bits(velocities: &[Velocity]) -> Vec<[[u32; 3]; 2]> {
    velocities.iter().map(|v| [bits(v.linear), bits(v.angular)]).collect()
}

/// Numbers of a scene, and few of every other kind.
fn number(size: f32, special: bool) -> BoxedStrategy<f32> {
    let ordinary = -size..size;
    if !special {
        return ordinary.boxed();
    }
    prop_oneof![
        60 => ordinary,
        2 => Just(0.0_f32),
        2 => Just(-0.0_f32),
        1 => Just(f32::INFINITY),
        1 => Just(f32::NEG_INFINITY),
        1 => Just(f32::NAN),
        2 => (0_u32..0x0080_0000).prop_map(f32::from_bits),
        1 => Just(1e30_f32),
        1 => Just(-1e-30_f32),
    ]
    .boxed()
}

fn vector(size: f32, special: bool) -> impl Strategy<Value = [f32; 3]> {
    prop::array::uniform3(number(size, special))
}

/// A unit vector, along an axis now and then.
fn normal(special: bool) -> impl Strategy<Value = [f32; 3]> {
    let unit = vector(1.0, false).prop_map(|[x, y, z]| {
        let length = (x * x + y * y + z * z).sqrt().max(1e-3);
        [x / length, y / length, z / length]
    });
    prop_oneof![
        6 => unit,
        1 => Just([0.0, -1.0, 0.0]),
        1 => Just([0.0, 0.0, 1.0]),
        1 => Just([1.0, -0.0, 0.0]),
        u32::from(special) => vector(1.0, true),
    ]
}

fn row([x, y, z]: [f32; 3], word: u32) -> Row {
    [x.to_bits(), y.to_bits(), z.to_bits(), word]
}

type Numbers = (u32, [f32; 3], [f32; 3], [f32; 3], [([f32; 3], f32); 4]);

fn numbers(special: bool) -> impl Strategy<Value = Numbers> {
    (
        prop_oneof![1 => Just(0_u32), 12 => 1_u32..=4, 20 => Just(4)],
        normal(special),
        vector(3.0, special),
        vector(3.0, special),
        prop::array::uniform4((vector(3.0, special), number(0.02, special))),
    )
}

/// Steps of up to `collisions` collisions between few or many bodies.
fn steps(collisions: usize, special: bool) -> impl Strategy<Value = Step> {
    let shapes = if special { 7_u8 } else { 6 };
    let bodies = prop_oneof![2_usize..6, 6_usize..40, 40_usize..400];
    bodies
        .prop_flat_map(move |bodies| {
            (
                prop::collection::vec(0..shapes, bodies),
                prop::collection::vec((vector(4.0, special), vector(4.0, special)), bodies),
                prop::collection::vec((vector(4.0, special), vector(1.0, special)), bodies),
                prop::collection::vec((0..bodies, 1..bodies, numbers(special)), 0..collisions),
                (any::<bool>(), prop::collection::vec(number(0.3, special), 8 * collisions)),
            )
        })
        .prop_map(|(mut shape_of, velocities, inertias, collisions, (warm, given))| {
            let bodies = shape_of.len();
            // The last one moves and stands in where neither would.
            shape_of[bodies - 1] = 1;
            let moves = |body: usize| MASSES[usize::from(shape_of[body])].inverse_mass != 0.0;
            let records = collisions.into_iter().map(|(a, apart, numbers)| {
                let (mut a, b) = (a, (a + apart) % bodies);
                if !moves(a) && !moves(b) {
                    a = bodies - 1;
                }
                let (count, normal, position_a, position_b, contacts) = numbers;
                let [p, q, r, s] = contacts.map(|(point, distance)| row(point, distance.to_bits()));
                let (a, b) = (register(a), register(b));
                [row(normal, count), row(position_a, a), row(position_b, b), p, q, r, s]
            });
            let records: Vec<_> = records.collect();
            let given = given.chunks_exact(8).take(if warm { records.len() } else { 0 });
            let given =
                given.map(|of| [0, 4].map(|at| [of[at], of[at + 1], of[at + 2], of[at + 3]]));
            let given = given.collect();
            let velocities = velocities.iter().zip(&shape_of).map(|((linear, angular), shape)| {
                // As they are loaded.
                let moves = MASSES[usize::from(*shape)].inverse_mass != 0.0;
                let velocity = Velocity { linear: *linear, angular: *angular };
                if moves { velocity } else { Velocity::default() }
            });
            let velocities = velocities.collect();
            let inertia = |(diagonal, others): ([f32; 3], [f32; 3])| {
                let ([xx, yy, zz], [xy, xz, yz]) = (diagonal, others);
                [xx, yy, zz, xy, xz, yz]
            };
            let inertias = inertias.into_iter().map(inertia).collect();
            Step { records, shape_of, velocities, inertias, given }
        })
}

/// A batch of one of the widths.
pub(crate) fn batch(threads: usize, width: prop::sample::Index) -> Batch {
    let widths: Vec<Width> = Width::all().collect();
    Batch::with_width(threads, *width.get(&widths))
}

/// Runs a step in a batch, the passes in two calls, and compares.
fn check<F: Tested>(step: &Step, batch: Batch, contact: u32, passes: u32, halt: u32) -> Batch {
    let batch = batch.of(F::PRECISION, 1).with_inertia(step.inertia());
    let mut batch = step.decoded(batch, step.records.len() / 3, &MASSES);
    let (expected, impulses, sum) = step.expected::<F>(contact, passes);
    let mut found = step.velocities.clone();
    let halt = halt.min(passes);
    // The second time all at once, from the velocities before the passes on.
    for halt in [halt, passes] {
        for part in [0..halt, halt..passes] {
            batch.run(part, &step.plan(contact), step.properties(), &step.velocities);
        }
        batch.leave(&mut found);
        assert_eq!(velocity_bits(&found), velocity_bits(&expected));
        for (index, expected) in impulses.iter().enumerate() {
            assert_eq!(bits(batch.impulses(index)), bits(*expected), "collision {index}");
        }
        assert_eq!(batch.impulse_sum(), sum);
        check_outgoing(&mut batch, &impulses);
        batch.restart();
    }
    batch
}

/// Compares the impulses that go out after a pass of either kind.
fn check_outgoing(batch: &mut Batch, impulses: &[Impulses]) {
    for contact in [true, false] {
        let mut beats = vec![Beat([7; 4]); impulses.len()];
        let sum = batch.outgoing(contact, 0, &mut beats);
        let words = beats.iter().flat_map(|beat| beat.0);
        assert_eq!(sum, words.fold(0, u32::wrapping_add));
        for (beat, impulses) in beats.iter().zip(impulses) {
            let [_, first, second, _] = *impulses;
            let expected = if contact { *impulses } else { [first, second, 0.0, 0.0] };
            assert_eq!(bits(beat.0.map(f32::from_bits)), bits(expected));
        }
    }
}

/// Runs two passes of a step, then a third one in two parts, and compares.
fn check_parts<F: Tested>(step: &Step, batch: Batch, cut: usize) {
    let mut batch =
        step.decoded(batch.of(F::PRECISION, 1).with_inertia(step.inertia()), cut, &MASSES);
    let mut velocities = step.velocities.clone();
    batch.run(0..2, &step.plan(1), step.properties(), &step.velocities);
    batch.leave(&mut velocities);
    for part in [0..cut, cut..step.records.len()] {
        batch.run_part(2, part, &step.plan(1), step.properties(), &mut velocities);
    }
    let (expected, impulses, sum) = step.expected::<F>(1, 3);
    assert_eq!(velocity_bits(&velocities), velocity_bits(&expected));
    for (index, expected) in impulses.iter().enumerate() {
        assert_eq!(bits(batch.impulses(index)), bits(*expected), "collision {index}");
    }
    assert_eq!(batch.impulse_sum(), sum);
}

/// The smallest distance of collisions with a moving body in common, in issues of `together`, by comparing
/// all.
fn distance(step: &Step, together: usize) -> u32 {
    let moving = |rows: &[Row; collision::ROWS]| {
        let bodies = if rows[0][WORD_LANE] == 0 { vec![] } else { vec![rows[1][3], rows[2][3]] };
        let moves =
            |body: &u32| MASSES[usize::from(step.shape_of[*body as usize])].inverse_mass != 0.0;
        bodies.into_iter().filter(moves).collect::<Vec<_>>()
    };
    let bodies: Vec<Vec<u32>> = step.records.iter().map(moving).collect();
    let meets = |i: usize, j: usize| bodies[i].iter().any(|body| bodies[j].contains(body));
    let pairs = (0..bodies.len()).flat_map(|j| (0..j).map(move |i| (i, j)));
    pairs
        .filter(|(i, j)| meets(*i, *j))
        .map(|(i, j)| register(j / together - i / together))
        .min()
        .unwrap_or(u32::MAX)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn passes_have_the_bits_of_one_collision_after_the_other(
        step in steps(300, false),
        contact in 0_u32..4,
        friction in 0_u32..4,
        halt in 0_u32..8,
        width: prop::sample::Index,
        threads in 1_usize..4,
    ) {
        let batch = || batch(threads, width);
        check::<Single>(&step, batch(), contact, contact + friction, halt);
        let step = step.isotropic();
        check::<Single>(&step, batch(), contact, contact + friction, halt);
        check::<Half>(&step.in_format::<Half>(), batch(), contact, contact + friction, halt);
    }

    #[test]
    fn numbers_of_every_kind_pass_alike(
        step in steps(200, true),
        contact in 0_u32..3,
        friction in 0_u32..3,
        width: prop::sample::Index,
    ) {
        check::<Single>(&step, batch(1, width), contact, contact + friction, 1);
        let step = step.isotropic();
        check::<Single>(&step, batch(1, width), contact, contact + friction, 1);
        let step = step.in_format::<Half>();
        check::<Half>(&step, batch(1, width), contact, contact + friction, 1);
    }

    #[test]
    fn a_part_of_a_pass_has_those_bits_too(
        step in steps(200, false),
        cut in 0_usize..200,
        width: prop::sample::Index,
    ) {
        let cut = cut.min(step.records.len());
        check_parts::<Single>(&step, batch(1, width), cut);
        let step = step.isotropic();
        check_parts::<Single>(&step, batch(1, width), cut);
        check_parts::<Half>(&step.in_format::<Half>(), batch(1, width), cut);
    }

    #[test]
    fn entries_and_distance_are_those_of_the_records(step in steps(120, false), cut in 0_usize..120) {
        let cut = cut.min(step.records.len());
        let batch = step.decoded(Batch::new(1, true), cut, &MASSES);
        prop_assert_eq!(batch.len(), step.records.len());
        prop_assert_eq!(batch.distance(), distance(&step, 1));
        let pairs = step.decoded(Batch::new(1, true).of(Precision::F32, 2), cut, &MASSES);
        prop_assert_eq!(pairs.distance(), distance(&step, 2));
        for (index, rows) in step.records.iter().enumerate() {
            let entry = batch.entry(index);
            prop_assert_eq!(entry.is_none(), rows[0][WORD_LANE] == 0);
            if let Some(entry) = entry {
                prop_assert_eq!(entry.bodies, [rows[1][WORD_LANE], rows[2][WORD_LANE]]);
                let moves = entry.bodies.map(|body| {
                    MASSES[usize::from(step.shape_of[body as usize])].inverse_mass != 0.0
                });
                prop_assert_eq!(entry.moving, moves);
            }
        }
    }
}

/// A step of collisions between given bodies, of which `fixed` do not move.
fn chain(pairs: &[[u32; 2]], bodies: usize, fixed: &[usize]) -> Step {
    let mut shape_of = vec![1_u8; bodies];
    fixed.iter().for_each(|body| shape_of[*body] = 0);
    let records = pairs.iter().enumerate().map(|(i, [a, b])| {
        let x = i as f32 * 0.01;
        let point = row([x, 0.5, 0.25], (-0.001_f32).to_bits());
        let positions = [row([x, 0.0, 0.0], *a), row([x, 1.0, 0.0], *b)];
        [row([0.0, -1.0, 0.0], 2), positions[0], positions[1], point, point, point, point]
    });
    let velocity = |body: usize| {
        let moves = shape_of[body] != 0;
        let speed = if moves { body as f32 * 0.1 - 1.0 } else { 0.0 };
        Velocity { linear: [0.1 * speed, speed, 0.0], angular: [speed, 0.0, -speed] }
    };
    let records = records.collect();
    let velocities = (0..bodies).map(velocity).collect();
    Step { records, velocities, shape_of, inertias: Vec::new(), given: Vec::new() }
}

#[test]
fn two_static_bodies_are_refused() {
    let step = chain(&[[2, 1], [0, 1]], 3, &[0, 1]);
    let mut batch = Batch::new(1, true);
    batch.begin(2, false);
    let streams = step.streams(0..2);
    let error = PacketError { code: ErrorCode::StaticPair, channel: 0, beat: 1 };
    let streams = streams.each_ref().map(Vec::as_slice);
    let found =
        batch.decode(streams, 2, Properties::of_shapes(&step.shape_of, &MASSES), &mut [0; 2]);
    assert_eq!(found, Err(error));
}

#[test]
fn independent_collisions_stay_in_their_order_in_full_blocks() {
    // Every 40th collision has the same bodies.
    let pairs: Vec<[u32; 2]> = (0..400).map(|i| [i % 40, 40 + i % 40]).collect();
    let step = chain(&pairs, 80, &[]);
    let batch = check::<Single>(&step, Batch::new(2, true), 2, 4, 4);
    assert_eq!(batch.slots, (0..400).collect::<Vec<u32>>());
    assert_eq!(batch.distance(), 40);
}

#[test]
fn collisions_of_one_body_take_bounded_memory() {
    let pairs: Vec<[u32; 2]> = (0..6000).map(|i| [1 + i, 0]).collect();
    let step = chain(&pairs, 6001, &[]);
    let batch = check::<Single>(&step, Batch::new(2, true), 2, 4, 4);
    assert!(batch.blocks.len() <= 6000 * 3 / 2 / LANES + 66 + LANES, "{}", batch.blocks.len());
    assert!(batch.blocks.iter().any(Block::serial));
}
