//! Compares blocks that threads fill with records put in one after the other.

use proptest::prelude::*;

use super::super::tests::{MASSES, batch};
use super::*;
use crate::accelerator::records::array::Row;
use pgs_interface::control::ErrorCode;
use pgs_interface::record::{WORD_LANE, collision};

/// Records and the shapes of the bodies that they are about.
#[derive(Debug, Clone)]
struct Scene {
    records: Vec<[Row; collision::ROWS]>,
    shape_of: Vec<u8>,
}

/// How collisions follow each other.
#[derive(Debug, Clone, Copy)]
struct Order {
    /// Collisions after which a body returns.
    period: u32,
    /// Collisions in 256 between random bodies, and padding entries in 256.
    odd: u32,
    padding: u32,
}

/// Numbers that depend on their numbers in no simple way.
fn scatter(seed: u64, number: u64) -> u64 {
    let mut x = seed ^ number.wrapping_mul(0x9E37_79B9_7F4A_7C15);
    x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    x ^ (x >> 27)
}

/// Records of any words; the last eight bodies are static.
fn scene(seed: u64, count: u32, order: Order) -> Scene {
    let Order { period, odd, padding } = order;
    let moving = 2 * period;
    let shape_of = (0..moving + 8).map(|body| u8::from(body < moving)).collect();
    let record = |n: u32| {
        let random = |k: u64| register(scatter(seed, u64::from(n) * 64 + k) >> 32);
        let mut rows: [Row; collision::ROWS] = [[0; 4]; collision::ROWS];
        for (k, word) in (0..).zip(rows.as_flattened_mut()) {
            *word = random(k);
        }
        let any = random(32) % 256 < odd;
        let a = if any { random(33) % moving } else { n % period };
        let b = if any { random(34) % (moving + 8) } else { period + n % period };
        let is_padding = random(35) % 256 < padding;
        rows[collision::NORMAL][WORD_LANE] = if is_padding { 0 } else { 1 + random(36) % 4 };
        rows[collision::BODY_A][WORD_LANE] = a;
        rows[collision::BODY_B][WORD_LANE] = if a == b { moving } else { b };
        rows
    };
    Scene { records: (0..count).map(record).collect(), shape_of }
}

impl Scene {
    /// Slots, words of the blocks, sums and error, of one record after the other.
    fn serially(&self) -> Found {
        let mut places = Places::default();
        places.begin(self.records.len());
        let moves = |body: usize| MASSES[usize::from(self.shape_of[body])].inverse_mass != 0.0;
        places.bodies(self.shape_of.len(), moves);
        let (mut blocks, mut slots, mut sums) = (Vec::new(), Vec::new(), Vec::new());
        for (index, rows) in (0..).zip(&self.records) {
            let bodies = [rows[collision::BODY_A][WORD_LANE], rows[collision::BODY_B][WORD_LANE]];
            let count = rows[collision::NORMAL][WORD_LANE];
            if count > 0 {
                let moving = match places.moving(count, bodies) {
                    Ok(moving) => moving,
                    Err(code) => {
                        let error = PacketError { code, channel: 0, beat: index };
                        return (slots, words(&blocks), sums, Err(error));
                    }
                };
                let place = places.place(index, bodies, moving);
                blocks.resize(places.blocks(), Block::EMPTY);
                let kind = block::kind::of(count, moving, place.serial);
                blocks[place.block].put(place.lane, rows, kind);
                slots.push(register(place.block * LANES + place.lane));
            } else {
                slots.push(NO_SLOT);
            }
            let sum = rows.as_flattened().iter().fold(0_u32, |sum, word| sum.wrapping_add(*word));
            sums.push(sum);
        }
        (slots, words(&blocks), sums, Ok(()))
    }

    /// The same by a batch, in two parts.
    fn shared(&self, batch: &mut Batch, cut: usize) -> Found {
        batch.begin(self.records.len(), false);
        let mut sums = vec![0; self.records.len()];
        let mut result = Ok(());
        for part in [0..cut, cut..self.records.len()] {
            let mut streams = [const { Vec::new() }; 4];
            for rows in &self.records[part.clone()] {
                for (beat, row) in rows.iter().enumerate() {
                    streams[beat % 4].push(Beat(*row));
                }
            }
            let streams = streams.each_ref().map(Vec::as_slice);
            let (count, sums) = (part.len(), &mut sums[part]);
            result =
                batch.decode(streams, count, Properties::of_shapes(&self.shape_of, &MASSES), sums);
            if result.is_err() {
                break;
            }
        }
        sums.truncate(batch.len());
        (batch.slots.clone(), words(&batch.blocks[..batch.places.blocks()]), sums, result)
    }
}

type Found = (Vec<u32>, Vec<Vec<u32>>, Vec<u32>, Result<(), PacketError>);

/// All words of each block.
fn words(blocks: &[Block]) -> Vec<Vec<u32>> {
    let words = |block: &Block| {
        let Block { normal, position_a, position_b, contacts, rows, kind, impulses } = block;
        let numbers = [&normal[..], position_a, position_b, contacts.as_flattened(), impulses];
        let numbers = numbers.into_iter().flatten().flatten().map(|number| number.to_bits());
        numbers.chain(rows.as_flattened().iter().copied()).chain(*kind).collect()
    };
    blocks.iter().map(words).collect()
}

fn orders() -> impl Strategy<Value = Order> {
    let period = prop_oneof![Just(16_u32), 17_u32..60, 160_u32..2000];
    let of_256 = || prop_oneof![3 => Just(0_u32), 1 => Just(1), 1 => 2_u32..16, 1 => Just(200)];
    (period, of_256(), of_256()).prop_map(|(period, odd, padding)| Order { period, odd, padding })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn threads_fill_blocks_as_one_after_the_other_would(
        seed: u64,
        counts in prop::array::uniform3((0_u32..5000, orders())),
        cut: prop::sample::Index,
        width: prop::sample::Index,
        threads in 1_usize..5,
    ) {
        // A step leaves nothing behind for the next one.
        let mut batch = batch(threads, width);
        for (step, (count, order)) in (0..).zip(counts) {
            let scene = scene(seed ^ step, count, order);
            let cut = cut.index(count as usize + 1);
            prop_assert_eq!(scene.shared(&mut batch, cut), scene.serially());
        }
    }

    #[test]
    fn what_comes_before_a_refused_record_is_there(
        seed: u64,
        (count, order) in (1_u32..3000, orders()),
        at: prop::sample::Index,
        cut: prop::sample::Index,
        wrong in 0_usize..5,
        width: prop::sample::Index,
        threads in 1_usize..5,
    ) {
        let mut scene = scene(seed, count, order);
        let (at, bodies) = (at.index(count as usize), scene.shape_of.len());
        let record = &mut scene.records[at];
        let first = record[collision::BODY_A][WORD_LANE];
        let (row, word, code) = [
            // Several errors at once: the one checked first is reported.
            (collision::NORMAL, 5, ErrorCode::ContactCount),
            (collision::BODY_B, register(bodies), ErrorCode::BodyIndex),
            (collision::BODY_B, first, ErrorCode::SelfCollision),
            (collision::BODY_A, u32::MAX, ErrorCode::BodyIndex),
            (collision::NORMAL, u32::MAX, ErrorCode::ContactCount),
        ][wrong];
        record[collision::NORMAL][WORD_LANE] = 1;
        record[row][WORD_LANE] = word;
        if row == collision::NORMAL {
            record[collision::BODY_B][WORD_LANE] = u32::MAX;
        }
        let found = scene.shared(&mut batch(threads, width), cut.index(at + 1));
        let error = PacketError { code, channel: 0, beat: register(at) };
        prop_assert_eq!(found.0.len(), at);
        prop_assert_eq!(found.3, Err(error));
        prop_assert_eq!(found, scene.serially());
    }
}
