//! Interleaves the caller's list: places far from each other in turn, so that collisions that
//! follow each other seldom share a body.
//!
//! ```text
//! window of 12, 3 streams     0 1 2 3 | 4 5 6 7 | 8 9 10 11
//! order                       0 4 8  1 5 9  2 6 10  3 7 11
//! ```
//!
//! A window is short enough that its records stay in a second-level cache, and long enough for many
//! streams. The streams follow from the number of collisions alone: an order without any look at
//! the scene. An issue queue keeps apart the hazards that are left (interface specification,
//! hazards).

/// Collisions of a window: their records are 1 MB, as large as the second-level cache of the
/// board's processor.
const WINDOW: usize = 8192;
/// Most streams of a window: twice the hazard window of `float` in issue slots, and a little more.
const STREAMS_MAX: usize = 340;
/// Fewest collisions of a stream. Shorter ones would bring every neighbour near.
const STREAM_MIN: usize = 4;

/// The distance of two neighbours in the order of a window of `count` collisions: the length of its
/// streams.
fn stride(count: usize) -> usize {
    count.div_ceil((count / STREAM_MIN).clamp(1, STREAMS_MAX))
}

/// Writes the interleaved order of as many collisions as `entries` has places.
#[allow(clippy::cast_possible_truncation, reason = "a window has 8192 collisions at most")]
pub(super) fn interleave(entries: &mut [u32]) {
    let mut first = 0_u32;
    for mut window in entries.chunks_mut(WINDOW) {
        let count = window.len();
        let stride = stride(count);
        // A row has the collision at one place of each stream.
        for start in 0..stride {
            let row;
            (row, window) = window.split_at_mut((count - start).div_ceil(stride));
            let mut at = first.wrapping_add(start as u32);
            for entry in row {
                *entry = at;
                at = at.wrapping_add(stride as u32);
            }
        }
        first = first.wrapping_add(count as u32);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn interleaved(count: usize) -> Vec<u32> {
        let mut entries = vec![u32::MAX; count];
        interleave(&mut entries);
        entries
    }

    #[test]
    fn small_lists_are_interleaved_as_written_here() {
        assert_eq!(interleaved(0), [0; 0]);
        assert_eq!(interleaved(1), [0]);
        // One stream below eight collisions.
        assert_eq!(interleaved(7), [0, 1, 2, 3, 4, 5, 6]);
        assert_eq!(interleaved(8), [0, 4, 1, 5, 2, 6, 3, 7]);
        // Two streams, of five and of four.
        assert_eq!(interleaved(9), [0, 5, 1, 6, 2, 7, 3, 8, 4]);
        assert_eq!(interleaved(12), [0, 4, 8, 1, 5, 9, 2, 6, 10, 3, 7, 11]);
    }

    /// 8192 over 340 streams: 25 each, so that 328 have any, and the last of these 17.
    #[test]
    fn a_window_has_hundreds_of_streams_and_the_next_one_follows_it() {
        let entries = interleaved(8192 + 8);
        assert_eq!(entries[..3], [0, 25, 50]);
        assert_eq!(entries[326..330], [8150, 8175, 1, 26]);
        // The last stream lacks the places from 17 on.
        assert_eq!(entries[17 * 328..17 * 328 + 2], [17, 42]);
        assert_eq!(entries[17 * 328 + 326..17 * 328 + 328], [8167, 18]);
        assert_eq!(entries[8192..], [8192, 8196, 8193, 8197, 8194, 8198, 8195, 8199]);
    }

    proptest! {
        #[test]
        fn every_interleaved_order_is_a_permutation_within_windows(
            count in prop_oneof![0_usize..2000, 8000..8400_usize, 0..40_000_usize],
        ) {
            let entries = interleaved(count);
            for (number, window) in entries.chunks(8192).enumerate() {
                let mut sorted = window.to_vec();
                sorted.sort_unstable();
                let first = u32::try_from(8192 * number).expect("few");
                let all: Vec<u32> = (first..).take(window.len()).collect();
                prop_assert_eq!(sorted, all);
            }
        }
    }
}
