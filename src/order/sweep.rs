//! Puts collisions in the order in which a plane that sweeps through the scene meets them.
//!
//! Bodies are ranked along an axis, and a collision stands at the sum of its bodies' ranks; a
//! collision with a static body stands at the other body. Ranks serve in place of coordinates, so
//! that a body far away changes nothing. The axis is the one along which the moving bodies spread
//! furthest, because the plane then meets few bodies at a time. It is tilted towards the second
//! axis, so that a layer of equal coordinates is swept as well.
//!
//! Both sorts are by counting: bodies in two passes over the leading bits of their coordinate,
//! collisions in one pass over buckets of neighbouring sums. Collisions with equal keys keep the
//! order in which they were given.
//!
//! For an order near to the given one there is no sweep: the collisions stay as given, and a body's
//! index is its rank.

use super::OrderInput;

/// How much the axis leans towards the second axis.
const TILT: f32 = 0.1;
/// A later axis is taken if its variance is larger by this factor, a tenth in length, so that axes
/// of nearly equal length do not take turns from step to step.
const LONGER: f64 = 1.21;

/// Leading bits of a body's coordinate that the sort uses, and bits of one pass.
const KEY_BITS: u32 = 2 * DIGIT_BITS;
const DIGIT_BITS: u32 = 11;
const DIGITS: usize = 1 << DIGIT_BITS;
/// Largest number of buckets of collisions.
const BUCKETS_MAX: usize = 1 << 14;

/// Rank of a static body until the sweep is made.
const STATIC: u32 = u32::MAX;

/// A collision in the order of the sweep.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Swept {
    /// Ranks of its bodies; a static body has the rank after the last.
    pub(super) ranks: [u32; 2],
    /// Its index in the given order.
    pub(super) index: u32,
}

/// Ranks and swept collisions. The memory is kept from order to order.
#[derive(Debug, Default)]
pub(super) struct Sweep {
    /// Coordinate and index of the moving bodies, and room to sort them.
    keys: Vec<(u32, u32)>,
    sorted: Vec<(u32, u32)>,
    ranks: Vec<u32>,
    moving_count: u32,
    /// Where the next collision of each bucket goes.
    buckets: Vec<u32>,
    bucket_of: Vec<u16>,
    pub(super) collisions: Vec<Swept>,
}

impl Sweep {
    /// The rank of every static body. It is above the rank of every moving one.
    pub(super) fn static_rank(&self) -> u32 {
        self.moving_count
    }

    /// Sweeps the collisions of an input that was checked.
    pub(super) fn run(&mut self, input: &OrderInput<'_>) {
        self.rank(input);
        self.sort(input);
    }

    /// Takes the collisions of a checked input in their given order.
    pub(super) fn as_given(&mut self, input: &OrderInput<'_>) {
        let moving = input.moving;
        #[allow(clippy::cast_possible_truncation, reason = "an index of each is a u32: checked")]
        let static_rank = moving.len() as u32;
        let rank = |body: u32| if moving[body as usize] { body } else { static_rank };
        let swept = |(index, pair): (u32, [u32; 2])| Swept { ranks: pair.map(rank), index };
        self.moving_count = static_rank;
        self.collisions.clear();
        self.collisions.extend(input.taking_part().map(swept));
    }

    /// Ranks the moving bodies along the axis.
    fn rank(&mut self, input: &OrderInput<'_>) {
        let (first, second) = axes(input);
        let mut counts = [[0; DIGITS]; 2];
        self.keys.clear();
        for (index, (position, moving)) in (0..).zip(input.positions.iter().zip(input.moving)) {
            if *moving {
                let key = leading_bits(position[first] + TILT * position[second]);
                let [low, high] = digits(key);
                counts[0][low] += 1;
                counts[1][high] += 1;
                self.keys.push((key, index));
            }
        }
        // Overwritten below; only its length matters.
        self.sorted.resize(self.keys.len(), (0, 0));
        for (pass, counts) in counts.iter_mut().enumerate() {
            to_starts(counts);
            for entry in &self.keys {
                let next = &mut counts[digits(entry.0)[pass]];
                self.sorted[*next as usize] = *entry;
                *next += 1;
            }
            std::mem::swap(&mut self.keys, &mut self.sorted);
        }
        self.ranks.clear();
        self.ranks.resize(input.moving.len(), STATIC);
        self.moving_count = 0;
        for (_, index) in &self.keys {
            self.ranks[*index as usize] = self.moving_count;
            self.moving_count += 1;
        }
    }

    /// Sorts the collisions by the sum of their bodies' ranks.
    fn sort(&mut self, input: &OrderInput<'_>) {
        let sums = 2 * self.moving_count as usize + 1;
        let mut shift = 0;
        while sums >> shift >= BUCKETS_MAX {
            shift += 1;
        }
        let ranks = &self.ranks;
        let ranks_of = |pair: [u32; 2]| pair.map(|body| ranks[body as usize]);
        self.buckets.clear();
        self.buckets.resize((sums >> shift) + 1, 0);
        self.bucket_of.clear();
        for (_, pair) in input.taking_part() {
            let [a, b] = ranks_of(pair);
            // A collision with a static body stands at its other body.
            let (from_a, from_b) =
                (if a == STATIC { b } else { a }, if b == STATIC { a } else { b });
            let sum = if a & b == STATIC { 0 } else { from_a + from_b };
            #[allow(clippy::cast_possible_truncation, reason = "below BUCKETS_MAX by the shift")]
            let bucket = (sum >> shift) as u16;
            self.buckets[usize::from(bucket)] += 1;
            self.bucket_of.push(bucket);
        }
        to_starts(&mut self.buckets);
        self.collisions.resize(self.bucket_of.len(), Swept::default());
        for ((index, pair), bucket) in input.taking_part().zip(&self.bucket_of) {
            let next = &mut self.buckets[usize::from(*bucket)];
            let ranks = ranks_of(pair).map(|rank| rank.min(self.moving_count));
            self.collisions[*next as usize] = Swept { ranks, index };
            *next += 1;
        }
    }
}

/// The two axes along which moving bodies are spread out furthest.
fn axes(input: &OrderInput<'_>) -> (usize, usize) {
    let (mut count, mut sums, mut squares) = (0.0, [0.0; 3], [0.0; 3]);
    for (position, moving) in input.positions.iter().zip(input.moving) {
        if *moving {
            count += 1.0;
            for axis in 0..3 {
                let x = f64::from(position[axis]);
                sums[axis] += x;
                squares[axis] += x * x;
            }
        }
    }
    // The variance, times the number of bodies squared.
    let spread = |axis: usize| squares[axis] * count - sums[axis] * sums[axis];
    let longer = |a: usize, b: usize| if spread(b) > spread(a) * LONGER { b } else { a };
    let first = longer(longer(0, 1), 2);
    let [low, high] = [[1, 2], [0, 2], [0, 1]][first];
    (first, longer(low, high))
}

/// The leading bits of a number, as an integer of the same order.
fn leading_bits(number: f32) -> u32 {
    let bits = number.to_bits();
    let ordered = if bits >> 31 == 1 { !bits } else { bits | 1 << 31 };
    ordered >> (u32::BITS - KEY_BITS)
}

/// The digits of a key, the lower one first.
fn digits(key: u32) -> [usize; 2] {
    [key as usize % DIGITS, key as usize >> DIGIT_BITS]
}

/// Replaces each count by the sum of all counts before it.
fn to_starts(counts: &mut [u32]) {
    let mut sum = 0;
    for count in counts {
        sum += std::mem::replace(count, sum);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn swept(input: &OrderInput<'_>) -> Vec<u32> {
        let mut sweep = Sweep::default();
        sweep.run(input);
        sweep.collisions.iter().map(|swept| swept.index).collect()
    }

    #[test]
    fn leading_bits_are_ordered_as_the_numbers() {
        let numbers = [-f32::INFINITY, -80.0, -1.0, -0.5, 0.0, 1e-3, 0.5, 1.0, 79.0, f32::INFINITY];
        assert!(numbers.is_sorted_by(|a, b| leading_bits(*a) < leading_bits(*b)));
    }

    #[test]
    fn collisions_are_met_along_the_longest_axis_whatever_the_index() {
        for axis in 0..3 {
            let at = |x: f32| {
                let mut position = [0.0; 3];
                position[axis] = x;
                position
            };
            let input = OrderInput {
                pairs: &[[0, 3], [0, 1], [1, 2], [2, 3], [0, 2]],
                moving: &[false, true, true, true],
                positions: &[at(-400.0), at(8.0), at(6.0), at(4.0)],
            };
            // Ranks 2, 1, 0; sums 0, 4, 3, 1, 2.
            assert_eq!(swept(&input), [0, 3, 4, 2, 1], "{axis}");
        }
    }

    #[test]
    fn the_tilt_parts_a_layer_of_equal_coordinates() {
        let input = OrderInput {
            pairs: &[[0, 1], [2, 3], [4, 5]],
            moving: &[true; 6],
            positions: &[
                [0.0, 0.0, 20.0],
                [0.0, 0.0, 18.0],
                [0.0, 0.0, 2.0],
                [0.0, 0.0, 0.0],
                [-40.0, 0.0, 0.0],
                [40.0, 0.0, 0.0],
            ],
        };
        // Ranks by x + 0.1 z: 4, 0, 1, 2, 3, 5 are the bodies 3 2 1 0 within the layer.
        assert_eq!(swept(&input), [1, 2, 0]);
    }

    #[test]
    fn what_is_not_a_number_is_ranked_somewhere() {
        let input = OrderInput {
            pairs: &[[0, 1], [1, 2]],
            moving: &[true, false, true],
            positions: &[[f32::NAN; 3], [0.0; 3], [f32::INFINITY; 3]],
        };
        let mut order = swept(&input);
        order.sort_unstable();
        assert_eq!(order, [0, 1]);
    }

    #[test]
    fn pairs_that_do_not_move_are_met_first() {
        let input = OrderInput {
            pairs: &[[2, 3], [0, 1]],
            moving: &[false, false, true, true],
            positions: &[[0.0; 3]; 4],
        };
        assert_eq!(swept(&input), [1, 0]);
    }
}
