//! Counts the words of Tables 4.1 to 4.6, for any number of bodies and collisions.
//!
//! The input of a solver is a number of words for each collision and each body; every table gives
//! both numbers before and after its reductions. Collisions are counted once, although a step
//! streams them once a pass.

const WORD_BYTES: u64 = 4;
const WORDS_PER_BEAT: u64 = 4;

/// A row: one state of the reduction, and the figures that the thesis prints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DataRow {
    /// Name of the state.
    pub name: &'static str,
    /// Words a collision that the total counts.
    pub per_collision: u32,
    /// Words a body that the total counts.
    pub per_body: u32,
    /// Printed: words of one record, "per collision" or "per iteration".
    pub each: u32,
    /// Printed: words in total.
    pub total: u64,
    /// Printed: memory footprint in total, hundredths of a MiB.
    pub centi_mebibytes: u64,
    /// Printed: stream accesses of 128 bits in total.
    pub accesses: u64,
}

/// A table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DataTable {
    /// Number in the thesis.
    pub id: &'static str,
    /// The data that it counts.
    pub title: &'static str,
    /// Its rows.
    pub rows: &'static [DataRow],
    /// Contradictions and gaps of the thesis.
    pub remarks: &'static [&'static str],
}

impl DataRow {
    /// Words in total.
    #[must_use]
    pub const fn words(&self, bodies: u64, collisions: u64) -> u64 {
        collisions * self.per_collision as u64 + bodies * self.per_body as u64
    }

    /// Bytes in total.
    #[must_use]
    pub const fn bytes(&self, bodies: u64, collisions: u64) -> u64 {
        self.words(bodies, collisions) * WORD_BYTES
    }

    /// Stream accesses of 128 bits in total.
    #[must_use]
    pub const fn beats(&self, bodies: u64, collisions: u64) -> u64 {
        self.words(bodies, collisions).div_ceil(WORDS_PER_BEAT)
    }
}

const BEFORE: &str = "before";
const AFTER: &str = "after";
const WITH_POSITIONS: &str = "with positions";

/// One row; the printed figures in the order of the table: each, words, footprint, accesses.
const fn row(
    name: &'static str,
    per_collision: u32,
    per_body: u32,
    each: u32,
    total: u64,
    centi_mebibytes: u64,
    accesses: u64,
) -> DataRow {
    DataRow { name, per_collision, per_body, each, total, centi_mebibytes, accesses }
}

/// Tables 4.1 to 4.6.
pub const TABLES: [DataTable; 6] = [
    DataTable {
        id: "T4.1",
        title: "PGS input",
        rows: &[
            row(BEFORE, 56, 8, 56, 7_423_040, 2832, 1_855_760),
            row(AFTER, 27, 6, 28, 3_662_280, 1397, 915_570),
        ],
        remarks: &[
            "The row after the reduction says 28 words a collision, its total counts 27: with 28 \
             it would be 3,789,280. The record that is streamed has the 28th, the number of \
             contact points.",
        ],
    },
    DataTable {
        id: "T4.2",
        title: "PGS output",
        rows: &[
            row(BEFORE, 0, 8, 8, 311_040, 119, 77_760),
            row(AFTER, 0, 6, 6, 233_280, 89, 58_320),
        ],
        remarks: &["Rows called \"per collision\" count words a body, as in T4.3 and T4.4."],
    },
    DataTable {
        id: "T4.3",
        title: "integration input",
        rows: &[
            row(BEFORE, 0, 17, 17, 660_960, 252, 165_240),
            row(AFTER, 0, 7, 7, 272_160, 103, 68_040),
            row(WITH_POSITIONS, 0, 4, 4, 155_520, 59, 38_880),
        ],
        remarks: &["272,160 words are 1.038 MiB: 1.04, where the thesis prints 1.03."],
    },
    DataTable {
        id: "T4.4",
        title: "integration output",
        rows: &[
            row(BEFORE, 0, 8, 8, 311_040, 119, 77_760),
            row(AFTER, 0, 6, 6, 233_280, 89, 58_320),
        ],
        remarks: &[
            "Six words cannot hold what the integration yields, a position and an orientation: 7 \
             words, or 13 with the velocities. The result record that is streamed has all 13 in \
             16.",
        ],
    },
    DataTable {
        id: "T4.5",
        title: "combined input",
        rows: &[
            row(BEFORE, 56, 25, 73, 8_084_000, 3084, 2_021_000),
            row(AFTER, 27, 13, 35, 3_934_440, 1500, 983_610),
            row(WITH_POSITIONS, 27, 10, 32, 3_817_800, 1456, 954_450),
        ],
        remarks: &[
            "3,934,440 words are 15.009 MiB: 15.01, where the thesis prints 15.00.",
            "With positions on chip the total leaves out that they must be loaded, 3 words a body, \
             and that a collision then needs 6 words less: 21 C + 13 B would be 3,172,440.",
        ],
    },
    DataTable {
        id: "T4.6",
        title: "combined output",
        rows: &[
            row(BEFORE, 0, 16, 16, 622_080, 237, 155_520),
            row(AFTER, 0, 6, 6, 233_280, 89, 58_320),
        ],
        remarks: &["The six words after the reduction are those of T4.4."],
    },
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::thesis::{BODIES, COLLISIONS};

    #[test]
    fn every_total_of_the_thesis_is_met_exactly() {
        let totals: Vec<Vec<u64>> = TABLES
            .iter()
            .map(|table| table.rows.iter().map(|row| row.words(BODIES, COLLISIONS)).collect())
            .collect();
        let expected: [&[u64]; 6] = [
            &[7_423_040, 3_662_280],
            &[311_040, 233_280],
            &[660_960, 272_160, 155_520],
            &[311_040, 233_280],
            &[8_084_000, 3_934_440, 3_817_800],
            &[622_080, 233_280],
        ];
        assert_eq!(totals, expected);
        let accesses: Vec<Vec<u64>> = TABLES
            .iter()
            .map(|table| table.rows.iter().map(|row| row.beats(BODIES, COLLISIONS)).collect())
            .collect();
        let expected: [&[u64]; 6] = [
            &[1_855_760, 915_570],
            &[77_760, 58_320],
            &[165_240, 68_040, 38_880],
            &[77_760, 58_320],
            &[2_021_000, 983_610, 954_450],
            &[155_520, 58_320],
        ];
        assert_eq!(accesses, expected);
        for row in TABLES.iter().flat_map(|table| table.rows) {
            assert_eq!(row.words(BODIES, COLLISIONS), row.total);
            assert_eq!(row.beats(BODIES, COLLISIONS), row.accesses);
        }
    }

    /// All but two footprints are rounded; those two are cut off.
    #[test]
    fn the_footprints_are_the_thesis_but_for_two() {
        let wrong: Vec<_> = TABLES
            .iter()
            .flat_map(|table| table.rows.iter().map(move |row| (table.id, row)))
            .filter_map(|(id, row)| {
                let rounded = (row.bytes(BODIES, COLLISIONS) * 100 + (1 << 19)) >> 20;
                let printed = row.centi_mebibytes;
                (rounded != printed).then_some((id, row.name, rounded, printed))
            })
            .collect();
        assert_eq!(wrong, [("T4.3", AFTER, 104, 103), ("T4.5", AFTER, 1501, 1500)]);
    }

    #[test]
    fn the_combination_is_the_sum_of_its_parts() {
        for row in 0..3 {
            let [pgs, integration, both] = [0, 2, 4].map(|table: usize| TABLES[table].rows);
            let (pgs, integration) = (pgs[row.min(1)], integration[row]);
            assert_eq!(both[row].per_collision, pgs.per_collision + integration.per_collision);
            assert_eq!(both[row].per_body, pgs.per_body + integration.per_body);
            assert_eq!(both[row].each, pgs.each + integration.each);
        }
    }

    #[test]
    fn the_remarks_numbers_are_right() {
        assert_eq!(28 * COLLISIONS + 6 * BODIES, 3_789_280);
        assert_eq!(21 * COLLISIONS + 13 * BODIES, 3_172_440);
    }
}
