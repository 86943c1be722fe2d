//! Compares collisions converted from other designs with the decoder's.

use super::*;
use crate::accelerator::records::array::beat_of;
use crate::accelerator::records::decode::Collision;
use crate::accelerator::solver::Mass;
use crate::cast::register;
use crate::config::BoardConfig;
use pgs_interface::control::ErrorCode;
use pgs_interface::number::StreamFormat;
use pgs_interface::profile::{HALF, Profile};
use pgs_support::chunks::Chunks;

/// Number of bodies; the first is static.
const BODIES: u32 = 3000;

fn layout(profile: &'static Profile) -> Layout {
    Layout::of(&BoardConfig { profile, ..BoardConfig::default() }).expect("it can be replayed")
}

/// Bodies, contact points, and the bits of all numbers.
fn bits(collision: &Collision) -> ([u32; 2], usize, Vec<u32>) {
    let Collision { body_a, body_b, count, normal, position_a, position_b, contacts, .. } =
        collision;
    let vectors = [normal, position_a, position_b].into_iter().flatten();
    let numbers = vectors.chain(contacts.as_flattened());
    ([*body_a, *body_b], *count, numbers.map(|number| number.to_bits()).collect())
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
            let expected = Collision::of(StreamFormat::Binary16, rows);
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
