//! Bodies side by side, against one after the other.

use super::super::Properties;
use super::*;
use crate::accelerator::solver::{Mass, Velocity};

/// A zero, a very small number, or one between 2^-12 and 16 of either sign.
fn number(seed: &mut u64) -> f32 {
    *seed = seed.wrapping_mul(0x5851_F42D_4C95_7F2D).wrapping_add(0x1405_7B7E_F767_814F);
    let bits = (*seed >> 32) as u32;
    match bits % 8 {
        0 => 0.0,
        1 => f32::from_bits(bits >> 3),
        _ => f32::from_bits((bits & 0x807F_FFFF) | ((115 + (bits >> 23) % 16) << 23)),
    }
}

/// A vector of such numbers.
fn vector(seed: &mut u64) -> [f32; 3] {
    std::array::from_fn(|_| number(seed))
}

/// The shape and the velocity of each body.
fn moving(bodies: usize) -> (Vec<u8>, Vec<Velocity>) {
    let mut seed = 3;
    let shape_of = (0..bodies).map(|body| [2, 2, 0, 2, 1, 3][body % 6]).collect();
    let velocities = (0..bodies)
        .map(|_| Velocity { linear: vector(&mut seed), angular: vector(&mut seed) })
        .collect();
    (shape_of, velocities)
}

/// How many of the bodies of shape 2 turn too fast in one step, and how many do not.
fn fast(integration: &Integration, bodies: Range<usize>) -> [usize; 2] {
    let (shape_of, velocities) = moving(bodies.end);
    let mut counts = [0; 2];
    for body in bodies.filter(|body| shape_of[*body] == 2) {
        let [x, y, z] = velocities[body].angular.map(|w| w * integration.angular_damping);
        let angle = (x * x + y * y + z * z).sqrt() * integration.time_step;
        counts[usize::from(angle <= ROTATION_LIMIT)] += 1;
    }
    counts
}

/// The rows of the results of bodies from `first` on, of poses that begin with body `from`.
fn results(
    width: Width,
    (threads, streams): (usize, usize),
    (from, first, count): (usize, usize, usize),
    integration: Option<&Integration>,
) -> ([u32; 2], Vec<Beat>) {
    let mut seed = 7;
    let turns = Turns { streams };
    let bodies = first..first + count;
    let masses =
        [0.0, -0.0, 2.0, f32::NAN].map(|inverse_mass| Mass { inverse_mass, ..Mass::default() });
    let (shape_of, velocities) = moving(bodies.end);
    let mut poses = [const { Vec::new() }; STREAMS_MAX];
    for row in 0..ROWS_IN * bodies.end {
        let beat = Beat(std::array::from_fn(|_| number(&mut seed).to_bits()));
        if row >= ROWS_IN * from {
            poses[turns.place(row).0].push(beat);
        }
    }
    let mut batch = Batch::with_width(threads, width);
    batch.begin(0, false);
    let properties = Properties::of_shapes(&shape_of, &masses);
    batch.enter(&velocities, properties);
    let mut places = [const { Vec::new() }; STREAMS_MAX];
    for (place, beats) in places.iter_mut().zip(beats_of_results(turns, bodies.clone())) {
        place.resize(beats, Beat::default());
    }
    let poses =
        BodyRows { views: poses.each_ref().map(Vec::as_slice), turns, rows: ROWS_IN, first: from };
    let room = places.each_mut().map(Vec::as_mut_slice);
    let sums = batch.integrate(integration, bodies.clone(), poses, room);
    let before = turns.counts(ROWS_OUT * first);
    let rows = (ROWS_OUT * bodies.start..ROWS_OUT * bodies.end).map(|row| {
        let (k, number) = turns.place(row);
        places[k][number - before[k]]
    });
    (sums, rows.collect())
}

#[test]
fn bodies_side_by_side_move_as_one_by_one() {
    let slow =
        Integration { time_step: 1.0 / 60.0, angular_damping: 0.99, gravity: [0.0, -9.8, 0.1] };
    // In a step this long, many bodies turn further than the limit.
    let long = Integration { time_step: 0.5, ..slow };
    // Parts of one chunk and of several, from even and odd bodies on.
    let parts = [
        (0, 0, 1600),
        (3, 5, 1300),
        (1, 1, 70),
        (3, 4, 100),
        (2, 2, 32),
        (5, 5, 33),
        (0, 1, 1),
        (1, 2, 0),
    ];
    for (from, first, count) in parts.into_iter().filter(|(.., count)| *count > 1) {
        let bodies = first..first + count;
        assert!(fast(&long, bodies).into_iter().all(|some| some > 0), "{from} {first} {count}");
    }
    for part in parts {
        for integration in [Some(&slow), Some(&long), None] {
            let expected = results(Width::One, (1, 4), part, integration);
            let streams = [(1, 1), (1, 2), (1, 3), (3, 3), (1, 4), (3, 4)];
            for (width, on) in Width::all().flat_map(|width| streams.map(|on| (width, on))) {
                let found = results(width, on, part, integration);
                assert_eq!(found, expected, "{width:?} {on:?} {part:?} {integration:?}");
            }
        }
    }
}
