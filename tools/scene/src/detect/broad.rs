//! This file finds the pairs of bodies that may touch.
//!
//! Space is cut into cells as wide as the largest two bodies are apart at most when they touch, so
//! that partners of a body have their centres in its own cell or one of the 26 around it. The cells
//! are not stored: the bodies are sorted by their cell (x, then y, then z), and each body looks
//! forward only, at the rest of its own row of cells along z and at four neighbouring rows. In each
//! of the five the partners are a range of the sorted bodies that moves forward as the body does.

use zynq_pgs::Body;

use super::{Geometries, MARGIN};
use crate::{Geometry, rotation};

/// Width of a cell, m: above the diagonal of a cube (3.4641 m) and the margin. No body of any scene
/// is larger.
const CELL: f32 = 3.5;

/// What rounding may take away from a gap between two boxes, m; the narrow phase decides.
const SLACK: f32 = 1e-3;

/// Cells on either side of the origin. Beyond it bodies share the outermost cell, which costs time but
/// loses no pair. 20 bits, less the neighbours' 1.
const CELLS: f32 = 1_048_574.0;

/// Bits of a cell's number along one axis.
const BITS: u32 = 21;

/// A body in its cell.
#[derive(Debug, Clone, Copy)]
struct Entry {
    /// Numbers of the cell along x, y and z, 21 bits each.
    cell: u64,
    /// Index of the body.
    index: u32,
    /// Centre of mass, m.
    centre: [f32; 3],
    /// Half extents of the box along the world's axes around the body, m.
    reach: [f32; 3],
}

/// The broad phase, with its buffers.
#[derive(Debug, Default)]
pub(super) struct Broad {
    entries: Vec<Entry>,
    /// Pairs, lower index first, as the cells have them.
    found: Vec<(u32, u32)>,
    /// Where the pairs of each body end.
    ends: Vec<usize>,
}

impl Broad {
    /// Writes the pairs of bodies whose boxes are not farther apart than the margin, lower index
    /// first, sorted. `bodies[0]` is the ground and takes no part.
    pub(super) fn pairs(
        &mut self,
        bodies: &[Body],
        geometries: Geometries<'_>,
        pairs: &mut Vec<(u32, u32)>,
    ) {
        self.entries.clear();
        let placed = (0..).zip(bodies).skip(1);
        self.entries.extend(placed.filter_map(|(i, b)| entry(i, b, geometries.of(b)?)));
        self.entries.sort_unstable_by_key(|entry| (entry.cell, entry.index));

        self.found.clear();
        let Self { entries, found, .. } = self;
        // Rows after the own one, as steps in x and y.
        for (dx, dy) in [(0, 0), (0, 1), (1, -1), (1, 0), (1, 1)] {
            let row = (dx << (2 * BITS)) + (dy << BITS);
            let (mut start, mut end) = (0, 0);
            for (position, own) in entries.iter().enumerate() {
                // No field overflows: see `CELLS`.
                let cell = own.cell.wrapping_add_signed(row);
                while start < entries.len() && entries[start].cell < cell - 1 {
                    start += 1;
                }
                while end < entries.len() && entries[end].cell <= cell + 1 {
                    end += 1;
                }
                // In the own row each pair is seen from its first body only.
                let from = if row == 0 { position + 1 } else { start };
                for other in &entries[from..end] {
                    if near(own, other) {
                        let (a, b) = if own.index < other.index {
                            (own.index, other.index)
                        } else {
                            (other.index, own.index)
                        };
                        found.push((a, b));
                    }
                }
            }
        }
        self.sort(bodies.len(), pairs);
    }

    /// Writes the pairs that were found, sorted.
    ///
    /// By their lower body they are counted into place: that one has few partners, which are sorted
    /// among themselves.
    fn sort(&mut self, bodies: usize, pairs: &mut Vec<(u32, u32)>) {
        let Self { found, ends, .. } = self;
        ends.clear();
        ends.resize(bodies, 0);
        for (a, _) in &*found {
            ends[*a as usize] += 1;
        }
        let mut begin = 0;
        for end in &mut *ends {
            // Until its pairs are in place, where the next one goes.
            begin += std::mem::replace(end, begin);
        }
        pairs.clear();
        pairs.resize(found.len(), (0, 0));
        for pair in &*found {
            let next = &mut ends[pair.0 as usize];
            pairs[*next] = *pair;
            *next += 1;
        }
        let mut begin = 0;
        for end in &*ends {
            sort_few(&mut pairs[begin..*end]);
            begin = *end;
        }
    }
}

/// Sorts the pairs of one body, which in a pile are few.
fn sort_few(pairs: &mut [(u32, u32)]) {
    const FEW: usize = 24;
    if pairs.len() > FEW {
        pairs.sort_unstable();
        return;
    }
    for sorted in 1..pairs.len() {
        let pair = pairs[sorted];
        let mut at = sorted;
        while at > 0 && pairs[at - 1].1 > pair.1 {
            pairs[at] = pairs[at - 1];
            at -= 1;
        }
        pairs[at] = pair;
    }
}

/// Where a body is; `None` if its pose is not finite.
fn entry(index: u32, body: &Body, geometry: Geometry) -> Option<Entry> {
    let centre = body.pose.position;
    let rows = rotation::matrix(body.pose.orientation);
    let reach = match geometry {
        Geometry::Box { half_extents: [hx, hy, hz] } => {
            rows.map(|[x, y, z]| (x.abs() * hx + y.abs() * hy) + z.abs() * hz)
        }
        Geometry::Sphere { radius } => [radius; 3],
        Geometry::Capsule { half_height, radius } => {
            rows.map(|[_, y, _]| y.abs() * half_height + radius)
        }
    };
    if !centre.iter().chain(&reach).all(|value| value.is_finite()) {
        return None;
    }
    let [x, y, z] = centre.map(cell_number);
    Some(Entry { cell: x << (2 * BITS) | y << BITS | z, index, centre, reach })
}

/// Number of the cell in which a coordinate lies; it grows with the coordinate.
fn cell_number(coordinate: f32) -> u64 {
    // Never NaN, and the sign of a zero does not matter here.
    let cell = (coordinate / CELL).floor().clamp(-CELLS, CELLS);
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a whole number from 2 to 2^21 - 2"
    )]
    let number = (cell + 1_048_576.0) as u64;
    number
}

/// Whether the boxes around two bodies are not farther apart than the margin.
fn near(a: &Entry, b: &Entry) -> bool {
    (0..3).all(|axis| {
        (a.centre[axis] - b.centre[axis]).abs()
            <= (a.reach[axis] + b.reach[axis]) + (MARGIN + SLACK)
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use zynq_pgs::{Pose, Velocity};

    use super::*;

    const CUBES: Geometries<'static> = Geometries(&[None, Some(Geometry::CUBE)]);

    fn body(position: [f32; 3], q: [f32; 4]) -> Body {
        let length = (((q[0] * q[0] + q[1] * q[1]) + q[2] * q[2]) + q[3] * q[3]).sqrt();
        let orientation = q.map(|value| value / length);
        Body { pose: Pose { position, orientation }, velocity: Velocity::default(), shape: 1 }
    }

    fn every_pair(bodies: &[Body]) -> Vec<(u32, u32)> {
        let entries: Vec<Entry> =
            (0..).zip(bodies).skip(1).filter_map(|(i, b)| entry(i, b, Geometry::CUBE)).collect();
        let mut pairs = Vec::new();
        for (n, a) in entries.iter().enumerate() {
            for b in &entries[n + 1..] {
                if near(a, b) {
                    pairs.push((a.index, b.index));
                }
            }
        }
        pairs
    }

    proptest! {
        #[test]
        fn the_pairs_are_those_of_a_comparison_of_all_with_all(
            cubes in prop::collection::vec(
                (prop::array::uniform3(-9.0_f32..9.0), prop::array::uniform4(0.1_f32..1.0)), 0..60
            ),
            far in prop::collection::vec(prop::array::uniform3(-1e8_f32..1e8), 0..4),
        ) {
            let mut bodies = vec![body([0.0; 3], [0.0, 0.0, 0.0, 1.0])];
            bodies.extend(cubes.into_iter().map(|(position, q)| body(position, q)));
            bodies.extend(far.into_iter().map(|position| body(position, [0.0, 0.0, 0.0, 1.0])));
            let mut pairs = Vec::new();
            Broad::default().pairs(&bodies, CUBES, &mut pairs);
            prop_assert_eq!(pairs, every_pair(&bodies));
        }
    }

    #[test]
    fn cubes_beyond_the_last_cell_are_still_compared() {
        let level = [0.0, 0.0, 0.0, 1.0];
        let bodies = [[0.0; 3], [9e6, 0.0, 0.0], [9e6, 2.0, 0.0], [-9e30, 0.0, 9e30]]
            .map(|position| body(position, level));
        let mut pairs = Vec::new();
        Broad::default().pairs(&bodies, CUBES, &mut pairs);
        assert_eq!(pairs, [(1, 2)]);
    }

    #[test]
    fn a_cube_without_a_place_has_no_pairs() {
        let level = [0.0, 0.0, 0.0, 1.0];
        let mut bodies = [[0.0; 3], [1.0; 3], [1.5; 3]].map(|position| body(position, level));
        bodies[2].pose.orientation[0] = f32::NAN;
        let mut pairs = vec![(9, 9)];
        Broad::default().pairs(&bodies, CUBES, &mut pairs);
        assert!(pairs.is_empty());
    }
}
