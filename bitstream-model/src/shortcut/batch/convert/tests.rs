//! Compares collisions converted from other designs with the decoder's.

use super::*;
use crate::accelerator::records::array::beat_of;
use crate::accelerator::solver::Mass;
use crate::config::BoardConfig;
use pgs_interface::control::ErrorCode;
use pgs_interface::number::Numbers;
use pgs_interface::profile::{HALF, MIXED, Profile};
use pgs_support::chunks::Chunks;

static RELATIVE: Profile = Profile { numbers: Numbers::F32, ..MIXED };
/// Number of bodies; the first is static.
const BODIES: u32 = 3000;

fn layout(profile: &'static Profile) -> Layout {
    Layout::of(&BoardConfig { profile, ..BoardConfig::default() }).expect("it can be replayed")
}

/// A record of any words, every fourth distance +infinity, between bodies that exist.
fn record(format: StreamFormat, seed: &mut u64) -> [Row; relative::ROWS] {
    let mut random = || {
        *seed = seed.wrapping_mul(0x5851_F42D_4C95_7F2D).wrapping_add(0x1405_7B7E_F767_814F);
        (*seed >> 32) as u32
    };
    let (mask, infinity) = match format {
        StreamFormat::F32 => (u32::MAX, f32::INFINITY.to_bits()),
        _ => (0xFFFF, 0x7C00),
    };
    let mut rows = [[0; 4]; relative::ROWS];
    rows.as_flattened_mut().iter_mut().for_each(|word| *word = random() & mask);
    for row in &mut rows[relative::CONTACTS..] {
        if random() % 4 == 0 {
            row[WORD_LANE] = infinity;
        }
    }
    let a = random() % (BODIES - 1);
    rows[relative::NORMAL][WORD_LANE] = a;
    rows[relative::OFFSET][WORD_LANE] = a + 1;
    rows
}

/// The beats of records on each stream.
fn dealt(layout: &Layout, records: &[[Row; relative::ROWS]]) -> [Vec<Beat>; STREAMS_MAX] {
    let mut streams = [const { Vec::new() }; STREAMS_MAX];
    let rows_per_beat = if layout.format == StreamFormat::F32 { 1 } else { 2 };
    for rows in records {
        for (beat, rows) in rows.chunks(rows_per_beat).enumerate() {
            let words = match rows {
                [a, b] => [a, b].map(|[x, y, z, w]| [x | y << 16, z | w << 16]),
                _ => [[rows[0][0], rows[0][1]], [rows[0][2], rows[0][3]]],
            };
            let [[a, b], [c, d]] = words;
            streams[layout.places[beat].0].push(Beat([a, b, c, d]));
        }
    }
    streams
}

/// Bodies, contact points, and the bits of all numbers.
fn bits(collision: &Collision) -> ([u32; 2], usize, Vec<u32>) {
    let Collision { body_a, body_b, count, normal, position_a, position_b, contacts, .. } =
        collision;
    let vectors = [normal, position_a, position_b].into_iter().flatten();
    let numbers = vectors.chain(contacts.as_flattened());
    ([*body_a, *body_b], *count, numbers.map(|number| number.to_bits()).collect())
}

#[test]
fn what_is_taken_in_is_what_the_decoder_makes_of_each() {
    for (profile, threads) in [(&MIXED, 1), (&MIXED, 3), (&RELATIVE, 2)] {
        let layout = layout(profile);
        let mut translation = Translation::new(layout);
        let mut batch = Batch::new(threads, true);
        let mut seed = 11;
        for count in [1, OF_THREAD + 3, 2 * TOGETHER + 77] {
            let records: Vec<_> = (0..count).map(|_| record(layout.format, &mut seed)).collect();
            let dealt = dealt(&layout, &records);
            let streams = dealt.each_ref().map(Vec::as_slice);
            let mut shape_of = vec![1; BODIES as usize];
            shape_of[0] = 0;
            let masses = [0.0, 1.0].map(|mass| Mass { inverse_mass: mass, ..Mass::default() });
            batch.begin(count, false);
            let mut sums = vec![0; count];
            let decoded = translation.decode(
                &mut batch,
                streams,
                count,
                Properties::of_shapes(&shape_of, &masses),
                &mut sums,
            );
            assert_eq!(decoded, Ok(()));
            assert_eq!(batch.len(), count);
            let mut left_out = [0; 5];
            for (index, rows) in records.iter().enumerate() {
                let expected = Collision::relative(layout.format, rows);
                left_out[expected.count] += 1;
                let found = batch.collision(index);
                assert_eq!(found.is_none(), expected.count == 0);
                if let Some(found) = found {
                    assert_eq!(bits(&found), bits(&expected), "{} {index}", profile.name);
                }
                let beats = |k: usize| {
                    let share = layout.share[k];
                    streams[k][index * share..][..share].iter().flat_map(|beat| beat.0)
                };
                let sum = (0..STREAMS_MAX).flat_map(beats).fold(0, u32::wrapping_add);
                assert_eq!(sums[index], sum, "{} {index}", profile.name);
            }
            assert!(count < 2000 || left_out.iter().all(|some| *some > 0), "{left_out:?}");
        }
    }
}

#[test]
fn what_comes_before_a_refused_record_is_there() {
    let layout = layout(&MIXED);
    let mut translation = Translation::new(layout);
    let masses = [0.0, 1.0].map(|mass| Mass { inverse_mass: mass, ..Mass::default() });
    for bad in [0, 5, TOGETHER - 1, TOGETHER, TOGETHER + 700] {
        let mut seed = 5;
        let mut records: Vec<_> =
            (0..TOGETHER + 1000).map(|_| record(layout.format, &mut seed)).collect();
        records[bad][relative::CONTACTS][WORD_LANE] = 0;
        records[bad][relative::OFFSET][WORD_LANE] = BODIES;
        let dealt = dealt(&layout, &records);
        let streams = dealt.each_ref().map(Vec::as_slice);
        let mut batch = Batch::new(2, true);
        batch.begin(records.len(), false);
        let mut sums = vec![0; records.len()];
        let shape_of = vec![1; BODIES as usize];
        let found = translation.decode(
            &mut batch,
            streams,
            records.len(),
            Properties::of_shapes(&shape_of, &masses),
            &mut sums,
        );
        let error = PacketError { code: ErrorCode::BodyIndex, channel: 0, beat: register(bad) };
        assert_eq!((found, batch.len()), (Err(error), bad));
        for (index, sum) in sums[..bad].iter().enumerate() {
            let words = streams[..3].iter().flat_map(|beats| beats[index].0);
            assert_eq!(*sum, words.fold(0, u32::wrapping_add), "{index}");
        }
    }
}

/// Pairs of records of any words, with valid bodies and numbers of points.
fn pairs(records: usize, seed: &mut u64) -> Vec<[Row; collision::ROWS]> {
    let mut random = || {
        *seed = seed.wrapping_mul(0x5851_F42D_4C95_7F2D).wrapping_add(0x1405_7B7E_F767_814F);
        (*seed >> 32) as u32
    };
    let mut record = || {
        let mut rows = [[0; LANES]; collision::ROWS];
        rows.as_flattened_mut().iter_mut().for_each(|word| *word = random() & 0xFFFF);
        let a = random() % (BODIES - 1);
        rows[collision::NORMAL][WORD_LANE] = random() % 5;
        rows[collision::BODY_A][WORD_LANE] = a;
        rows[collision::BODY_B][WORD_LANE] = a + 1;
        rows
    };
    (0..records.next_multiple_of(PAIR)).map(|_| record()).collect()
}

/// The beats of pairs on each stream, and the sum of the words of each pair.
fn dealt_in_pairs(
    layout: &Layout,
    records: &[[Row; collision::ROWS]],
) -> ([Vec<Beat>; STREAMS_MAX], Vec<u32>) {
    let mut streams = [const { Vec::new() }; STREAMS_MAX];
    let mut sums = Vec::new();
    for pair in records.split_arrays::<PAIR>().0 {
        let mut sum = 0_u32;
        for (beat, rows) in pair.as_flattened().split_arrays::<2>().0.iter().enumerate() {
            let beat_of_rows = beat_of(rows[0], rows[1]);
            sum = beat_of_rows.0.into_iter().fold(sum, u32::wrapping_add);
            streams[layout.places[beat].0].push(beat_of_rows);
        }
        sums.push(sum);
    }
    (streams, sums)
}

fn masses_and_shapes() -> ([Mass; 2], Vec<u8>) {
    let masses = [0.0, 1.0].map(|mass| Mass { inverse_mass: mass, ..Mass::default() });
    let mut shape_of = vec![1; BODIES as usize];
    shape_of[0] = 0;
    (masses, shape_of)
}

#[test]
fn pairs_are_taken_in_as_the_decoder_makes_them_and_what_pads_the_last_is_not() {
    let layout = layout(&HALF);
    let (masses, shape_of) = masses_and_shapes();
    let mut seed = 17;
    for (count, threads) in [(1, 1), (2, 1), (OF_THREAD + 3, 3), (2 * TOGETHER + 77, 2)] {
        let mut translation = Translation::new(layout);
        let mut batch = Batch::new(threads, threads > 1).of(layout.precision, PAIR);
        let records = pairs(count, &mut seed);
        let (dealt, expected_sums) = dealt_in_pairs(&layout, &records);
        let streams = dealt.each_ref().map(Vec::as_slice);
        let mut sums = vec![u32::MAX; count];
        batch.begin(count, false);
        let decoded = translation.decode(
            &mut batch,
            streams,
            count,
            Properties::of_shapes(&shape_of, &masses),
            &mut sums,
        );
        assert_eq!((decoded, batch.len()), (Ok(()), count));
        for (index, rows) in records[..count].iter().enumerate() {
            let expected = Collision::absolute(StreamFormat::Binary16, rows);
            let found = batch.collision(index);
            assert_eq!(found.is_none(), expected.count == 0);
            if let Some(found) = found {
                assert_eq!(bits(&found), bits(&expected), "{index}");
            }
            // The first one has the words of both.
            let sum = if index % PAIR == 0 { expected_sums[index / PAIR] } else { 0 };
            assert_eq!(sums[index], sum, "{index}");
        }
    }
}

#[test]
fn a_refused_record_ends_what_is_there_in_the_middle_of_a_pair_too() {
    let layout = layout(&HALF);
    let (masses, shape_of) = masses_and_shapes();
    for bad in [0, 1, TOGETHER - 1, TOGETHER, TOGETHER + 701] {
        let mut records = pairs(TOGETHER + 1000, &mut 5);
        records[bad][collision::NORMAL][WORD_LANE] = 5;
        let (dealt, _) = dealt_in_pairs(&layout, &records);
        let streams = dealt.each_ref().map(Vec::as_slice);
        let mut translation = Translation::new(layout);
        let mut batch = Batch::new(2, true).of(layout.precision, PAIR);
        let mut sums = vec![0; records.len()];
        batch.begin(records.len(), false);
        let (count, shapes) = (records.len(), &shape_of);
        let found = translation.decode(
            &mut batch,
            streams,
            count,
            Properties::of_shapes(shapes, &masses),
            &mut sums,
        );
        let error = PacketError { code: ErrorCode::ContactCount, channel: 0, beat: register(bad) };
        assert_eq!((found, batch.len()), (Err(error), bad));
    }
}
