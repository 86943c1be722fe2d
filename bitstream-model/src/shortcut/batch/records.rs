//! Reads collision records in place from their beats, and sets sixteen of them side by side.

use super::block::{Block, LANES, ROWS_APART, Words};
use crate::accelerator::records::array::Row;
use pgs_interface::record::{Beat, WORD_LANE, collision};
use pgs_support::chunks::Chunks;
use pgs_support::lanes::{F32x16, Instructions, Quad, Work};

/// Streams that records come on.
pub(crate) const STREAMS: usize = 4;
/// Beats of a record on each stream, which take turns.
pub(crate) const BEATS: [usize; STREAMS] = [2, 2, 2, 1];

/// The stream of each row of a record, and its number among the record's there.
pub(crate) const PLACES: [(usize, usize); collision::ROWS] =
    [(0, 0), (1, 0), (2, 0), (3, 0), (0, 1), (1, 1), (2, 1)];

/// The stream and the place there of the row that follows a record in a warm pass: its impulses.
pub(crate) const IMPULSES: (usize, usize) = (3, 1);
const _: () = assert!(IMPULSES.1 == BEATS[IMPULSES.0]);

/// Beats of a record on each stream, in a warm pass or in another one.
const fn beats(warm: bool) -> [usize; STREAMS] {
    let mut beats = BEATS;
    if warm {
        beats[IMPULSES.0] += 1;
    }
    beats
}

/// Records that have arrived, on four streams.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Records<'a> {
    pub(crate) streams: [&'a [Beat]; STREAMS],
    /// Whether impulses follow each, which are not read here.
    pub(crate) warm: bool,
    /// Whether each has the friction of its pair above its contact count.
    pub(crate) pair_friction: bool,
}

/// The words of a record that decide where it goes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Head {
    /// Contact points, as received.
    pub(crate) count: u32,
    /// The friction of the pair, in its place above the contact count.
    pub(crate) friction: u32,
    pub(crate) bodies: [u32; 2],
}

impl<'a> Records<'a> {
    #[inline(always)]
    fn row(&self, record: usize, row: usize) -> Row {
        let stream = row % STREAMS;
        self.streams[stream][record * beats(self.warm)[stream] + row / STREAMS].0
    }

    /// All rows of a record.
    #[inline]
    pub(crate) fn rows(&self, record: usize) -> [Row; collision::ROWS] {
        std::array::from_fn(|row| self.row(record, row))
    }

    /// The heads of records, from one on.
    #[inline(always)]
    pub(crate) fn heads(&self, first: usize) -> impl Iterator<Item = Head> {
        const { assert!(collision::NORMAL == 0 && collision::BODY_A == 1 && collision::BODY_B == 2) };
        let friction = if self.pair_friction { collision::FRICTION_BITS } else { 0 };
        let [normals, bodies_a, bodies_b, _] = self.streams;
        let from =
            |stream: &'a [Beat]| stream.split_arrays::<2>().0.get(first..).unwrap_or(&[]).iter();
        let word = |[beat, _]: &[Beat; 2]| beat.0[WORD_LANE];
        let bodies = from(bodies_a).zip(from(bodies_b));
        from(normals).zip(bodies).map(move |(n, (a, b))| Head {
            count: word(n) & !friction,
            friction: word(n) & friction,
            bodies: [word(a), word(b)],
        })
    }
}

/// Puts records side by side, sixteen in each block, of kinds that are known, and adds the words of
/// each up.
pub(crate) struct Fill<'a> {
    pub(crate) records: &'a Records<'a>,
    pub(crate) first: usize,
    pub(crate) kinds: &'a [Words<u32>],
    pub(crate) blocks: &'a mut [Block],
    pub(crate) sums: &'a mut [u32],
}

/// The sum of all words of a record.
pub(crate) fn sum(rows: &[Row; collision::ROWS]) -> u32 {
    rows.as_flattened().iter().copied().fold(0, u32::wrapping_add)
}

/// A row of sixteen records, from record `first` on, by words.
#[inline(always)]
fn columns(
    instructions: impl Instructions,
    records: &Records<'_>,
    first: usize,
    row: usize,
) -> [F32x16; 4] {
    let stream = row % STREAMS;
    let beats = beats(records.warm)[stream];
    let first = first * beats + row / STREAMS;
    let quads: &[Quad] = bytemuck::cast_slice(&records.streams[stream][first..]);
    instructions.load(quads, beats)
}

#[inline(always)]
fn store(columns: [F32x16; 4], words: &mut [Words]) {
    for (words, column) in words.iter_mut().zip(columns) {
        *words = column.to_array();
    }
}

#[inline(always)]
fn added([a, b, c, d]: [F32x16; 4]) -> F32x16 {
    a.with_words(b).with_words(c.with_words(d))
}

impl Work for Fill<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self, instructions: impl Instructions) {
        let Self { records, first, kinds, blocks, sums } = self;
        let apart = F32x16::splat(f32::from_bits(ROWS_APART));
        let sums = sums.split_arrays_mut::<LANES>().0;
        for (number, ((block, kinds), sums)) in blocks.iter_mut().zip(kinds).zip(sums).enumerate() {
            block.begin(kinds);
            let row = |row| columns(instructions, records, first + number * LANES, row);
            let normal = row(collision::NORMAL);
            store(normal, &mut block.normal);
            let [body_a, body_b] = [row(collision::BODY_A), row(collision::BODY_B)];
            store(body_a, &mut block.position_a);
            store(body_b, &mut block.position_b);
            for (rows, body) in block.rows.iter_mut().zip([body_a, body_b]) {
                *rows = bytemuck::cast(body[WORD_LANE].with_words(apart).to_array());
            }
            let mut sum = added(normal).with_words(added(body_a)).with_words(added(body_b));
            for (contact, words) in block.contacts.iter_mut().enumerate() {
                let contact = row(collision::CONTACTS + contact);
                store(contact, words);
                sum = sum.with_words(added(contact));
            }
            *sums = bytemuck::cast(sum.to_array());
        }
    }
}

impl Fill<'_> {
    /// The same, one record after the other.
    pub(crate) fn one_by_one(self) {
        let Self { records, mut first, kinds, blocks, sums } = self;
        let sums = sums.split_arrays_mut::<LANES>().0;
        for ((block, kinds), sums) in blocks.iter_mut().zip(kinds).zip(sums) {
            *block = Block::EMPTY;
            for (lane, (kind, sum_of)) in kinds.iter().zip(sums).enumerate() {
                let rows = records.rows(first + lane);
                block.put(lane, &rows, *kind);
                *sum_of = sum(&rows);
            }
            first += LANES;
        }
    }
}
