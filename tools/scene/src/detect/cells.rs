//! Finds near bodies with a grid of cells.
//!
//! The cells are as wide as the greatest distance of two near bodies' centres, so that all partners
//! of a body have their centres in its own cell or one of the 26 around it. The cells are not
//! stored: the bodies are sorted by their cell (x, then y, then z), and each body searches forward
//! only, in the rest of its own row of cells along z and in four neighbouring rows. In each of the
//! five, the partners are a range of the sorted bodies that moves forward as the body does.
//!
//! In a second sort, bodies that stayed in their cell keep their order; only the others are sorted
//! and merged.

use std::ops::Range;

use super::bounds::Bounds;

/// Width of a cell, m: above the diagonal of a cube (3.4641 m) and [`GAP_MAX`]. No body of any
/// scene is larger.
const CELL: f32 = 3.85;

/// Largest gap between two boxes that the cells allow, m.
pub(super) const GAP_MAX: f32 = 0.38;

/// Cells on either side of the origin: 20 bits, minus 1 for the neighbours. Bodies beyond share the
/// outermost cell, which costs time and loses no pair.
const CELLS: f32 = 1_048_574.0;

/// Bits of a cell's number along one axis.
const BITS: u32 = 21;

/// The cell of a body that takes no part; no real cell has this number.
const NOWHERE: u64 = u64::MAX;

/// A body and its cell.
#[derive(Debug, Clone, Copy)]
struct Entry {
    /// Numbers of the cell along x, y and z, 21 bits each.
    cell: u64,
    /// Index of the body.
    index: u32,
    bounds: Bounds,
}

/// Bodies sorted by their cells.
#[derive(Debug, Default, Clone)]
pub(super) struct Cells {
    /// The cell of each body.
    numbers: Vec<u64>,
    /// Cells and bodies, sorted.
    order: Vec<(u64, u32)>,
    /// Bodies that have left their cell.
    strays: Vec<(u64, u32)>,
    entries: Vec<Entry>,
}

impl Cells {
    /// Sorts the bodies that take part.
    pub(super) fn sort(&mut self, bounds: &[Bounds]) {
        let Self { numbers, order, strays, entries } = self;
        numbers.resize(bounds.len(), NOWHERE);
        strays.clear();
        for ((index, bounds), number) in (0..).zip(bounds).zip(&mut *numbers) {
            let cell = cell(bounds);
            if cell != *number && cell != NOWHERE {
                strays.push((cell, index));
            }
            *number = cell;
        }
        order.retain(|&(cell, index)| numbers.get(index as usize) == Some(&cell));
        strays.sort_unstable();
        merge(order, strays);
        entries.clear();
        entries.extend(order.iter().map(|&(cell, index)| Entry {
            cell,
            index,
            bounds: bounds[index as usize],
        }));
    }

    /// The number of bodies that take part.
    pub(super) fn len(&self) -> usize {
        self.entries.len()
    }

    /// Adds to `found` the pairs of bodies at most `gap` m apart, lower index first, whose first
    /// body in the order of the cells lies in `range`.
    pub(super) fn find(&self, range: Range<usize>, gap: f32, found: &mut Vec<(u32, u32)>) {
        debug_assert!(gap <= GAP_MAX, "partners are in neighbouring cells");
        let entries = &*self.entries;
        let Some(first) = entries[range.clone()].first() else { return };
        // The own row and the rows after it, as steps in x and y.
        for (dx, dy) in [(0, 0), (0, 1), (1, -1), (1, 0), (1, 1)] {
            let row = (dx << (2 * BITS)) + (dy << BITS);
            // No field overflows: see `CELLS`.
            let begin = first.cell.wrapping_add_signed(row) - 1;
            let mut start = entries.partition_point(|entry| entry.cell < begin);
            let mut end = start;
            for (position, own) in range.clone().zip(&entries[range.clone()]) {
                let cell = own.cell.wrapping_add_signed(row);
                while start < entries.len() && entries[start].cell < cell - 1 {
                    start += 1;
                }
                while end < entries.len() && entries[end].cell <= cell + 1 {
                    end += 1;
                }
                // In the own row, each pair is found from its first body only.
                let from = if row == 0 { position + 1 } else { start };
                for other in &entries[from..end] {
                    if own.bounds.near(&other.bounds, gap) {
                        let (a, b) = (own.index, other.index);
                        found.push(if a < b { (a, b) } else { (b, a) });
                    }
                }
            }
        }
    }
}

/// Merges the sorted `strays` into the sorted `order`; no two entries are equal.
pub(super) fn merge<T: Copy + Ord>(order: &mut Vec<T>, strays: &[T]) {
    let mut kept = order.len();
    order.extend_from_slice(strays);
    let mut place = order.len();
    // From the end, where each move frees the place for the next.
    for &stray in strays.iter().rev() {
        while kept > 0 && order[kept - 1] > stray {
            (kept, place) = (kept - 1, place - 1);
            order[place] = order[kept];
        }
        place -= 1;
        order[place] = stray;
    }
}

/// The cell of a centre.
fn cell(bounds: &Bounds) -> u64 {
    if !bounds.takes_part() {
        return NOWHERE;
    }
    let [x, y, z] = bounds.centre.map(cell_number);
    x << (2 * BITS) | y << BITS | z
}

/// The cell of a coordinate along one axis; it grows with the coordinate.
fn cell_number(coordinate: f32) -> u64 {
    // Never NaN; the sign of a zero does not matter here.
    let cell = (coordinate / CELL).floor().clamp(-CELLS, CELLS);
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a whole number from 2 to 2^21 - 2"
    )]
    let number = (cell + 1_048_576.0) as u64;
    number
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn merged_is_as_sorted(
            numbers in prop::collection::btree_map((0..20_u64, 0..9_u32), any::<bool>(), 0..60)
        ) {
            let sorted: Vec<(u64, u32)> = numbers.keys().copied().collect();
            let of = |kind| numbers.iter().filter(move |(_, k)| **k == kind).map(|(key, _)| *key);
            let (mut order, strays): (Vec<_>, Vec<_>) = (of(true).collect(), of(false).collect());
            merge(&mut order, &strays);
            prop_assert_eq!(order, sorted);
        }
    }

    #[test]
    fn a_cell_is_wide_enough_for_two_cubes_on_their_corners() {
        let diagonal = 2.0 * 3.0_f32.sqrt();
        assert!(CELL > diagonal + GAP_MAX, "{}", CELL - diagonal);
    }

    #[test]
    fn who_stays_in_its_cell_is_not_sorted_again() {
        let at = |x: f32| Bounds { centre: [x, 0.0, 0.0], reach: [1.0; 3] };
        let mut bounds: Vec<Bounds> =
            std::iter::once(Bounds::NONE).chain([9.0, 1.0, 5.0, 2.0].map(at)).collect();
        let mut cells = Cells::default();
        cells.sort(&bounds);
        assert_eq!((cells.len(), cells.strays.len()), (4, 4));
        bounds[3] = at(-5.0);
        bounds[4] = at(2.5);
        cells.sort(&bounds);
        assert_eq!((cells.len(), &*cells.strays), (4, &[(cell(&at(-5.0)), 3)][..]));
        assert_eq!(cells.order.iter().map(|entry| entry.1).collect::<Vec<_>>(), [3, 2, 4, 1]);
        bounds[2] = Bounds::NONE;
        cells.sort(&bounds);
        assert_eq!((cells.len(), cells.strays.len()), (3, 0));
    }
}
