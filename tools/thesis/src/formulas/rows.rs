//! Rows of the index that lead to the tables of the formulas.

use crate::estimate::thesis::recorded::{CPU, DESIGNS, DEVICE_MEGABYTES, Design, GPU, Platform};
use crate::estimate::{BLOCK_BITS, BLOCKS};

use crate::index::{Origin, Row};
use crate::table::{Cell, Table, anchor};
use pgs_command::numbers::grouped;

/// A table of ours, and the columns that hold the thesis' figures and ours.
struct Source {
    /// Id of the table.
    table: &'static str,
    /// The place in the thesis; in braces a table of the design of the row's profile, or the table
    /// that the row names.
    thesis: &'static str,
    /// Keys of the columns that name a row; without one all rows of the table are one of the index:
    /// before and after each reduction.
    names: &'static [&'static str],
    figures: &'static [Figure],
}

/// The column of a figure of the thesis, the one of ours, and the unit.
type Figure = (&'static str, &'static str, &'static str);

const fn source(
    table: &'static str,
    thesis: &'static str,
    names: &'static [&'static str],
    figures: &'static [Figure],
) -> Source {
    Source { table, thesis, names, figures }
}

/// Words, bytes and stream accesses.
const DATA: &[Figure] = &[
    ("thesis_words", "words", " words"),
    ("thesis_mib", "mib", " MiB"),
    ("thesis_beats", "beats", " beats"),
];
const POSITIONS: Figure = ("thesis_with_positions_mib", "with_positions_mib", " MiB");
const ENERGY: &str = "§6.4, §6.5, Tables 6.5 and 6.9: energy of GPU and CPU, J";

/// The tables that have figures of the thesis.
const SOURCES: [Source; 12] = [
    source("T4.1", "§4.4.1, Table 4.1", &[], DATA),
    source("T4.2", "§4.4.1, Table 4.2", &[], DATA),
    source("T4.3", "§4.4.1, Table 4.3", &[], DATA),
    source("T4.4", "§4.4.1, Table 4.4", &[], DATA),
    source("T4.5", "§4.4.1, Table 4.5", &[], DATA),
    source("T4.6", "§4.4.1, Table 4.6", &[], DATA),
    source("memory", "§4.4.2", &["profile"], &[("thesis_mib", "mib", " MiB")]),
    source("memory", "§4.4.2, with positions", &["profile"], &[POSITIONS]),
    source("cycles", "{results}: cycles", &["profile", "records"], &[("thesis", "total", "")]),
    source(
        "blocks",
        "{results}: BRAM_18K",
        &["profile"],
        &[("thesis_percent", "ideal_percent", "")],
    ),
    source("platforms", ENERGY, &["platform"], &[("joules", "recomputed_joules", "")]),
    source("comparison", "{table}", &["profile", "figure"], &[("thesis", "packed_unlimited", "")]),
];

/// A place of a design's figures, from the short name of a table.
fn of_design(design: &Design, table: &str, what: &str) -> String {
    let table = match table.strip_prefix('T') {
        Some(number) => format!("Table {number}"),
        None => table.replace("eq", "equation"),
    };
    format!("{}, {table}{what}", design.section)
}

/// The rows of the index that lead to these tables.
pub(super) fn of(tables: &[Table]) -> Vec<Row> {
    let mut rows = Vec::new();
    for table in tables {
        match table.id {
            "memory" => rows.extend(std::iter::once(device()).chain(DESIGNS.map(logic))),
            "platforms" => rows.push(powers()),
            _ => {}
        }
    }
    for source in &SOURCES {
        let Some(table) = tables.iter().find(|table| table.id == source.table) else { continue };
        match source.names {
            [] => rows.push(source.together(table)),
            _ => rows.extend(source.each(table)),
        }
    }
    rows
}

fn row(
    thesis: String,
    subject: String,
    [recorded, ours]: [String; 2],
    origin: Origin,
    command: &str,
    shown: String,
) -> Row {
    Row { thesis, subject, recorded, ours, origin, command: command.to_owned(), shown }
}

/// The block RAM of the device (Table 6.1).
fn device() -> Row {
    let mebibytes = (BLOCKS * BLOCK_BITS) as f64 / 8.0 / f64::from(1 << 20);
    let ours = format!("{} BRAM_18K: {mebibytes:.1} MiB", grouped(BLOCKS));
    row(
        "§6.1.1, Table 6.1".to_owned(),
        "block RAM of the device".to_owned(),
        [format!("{DEVICE_MEGABYTES} MB"), ours],
        Origin::Modelled,
        "",
        anchor("blocks"),
    )
}

/// The powers of GPU and CPU (Tables 6.2 and 6.3).
fn powers() -> Row {
    let both = |watts: fn(&Platform) -> f64| format!("{} W and {} W", watts(&GPU), watts(&CPU));
    let calculated = both(|platform| platform.watts);
    let ours = format!("not measured; Tables 6.5 and 6.9 calculate with {calculated}");
    row(
        "§6.1.2, §6.1.3, Tables 6.2 and 6.3".to_owned(),
        format!("thermal design power of {} and {}", GPU.name, CPU.name),
        [both(|platform| platform.design_watts), ours],
        Origin::Open,
        "",
        anchor("platforms"),
    )
}

/// Logic and clock of a design (Tables 6.4 and 6.8), which no synthesis has given for ours.
fn logic(design: &Design) -> Row {
    let Design { dsp, flip_flops, lookup_tables, clock_mhz, .. } = design;
    let ours = "not synthesised by Vivado; Yosys counts the cells of its generated Verilog (the \
                command); the clock is taken from the thesis";
    row(
        of_design(design, design.results, ": logic and clock"),
        format!("{}: DSP48E, FF, LUT, clock", design.profile.name),
        [format!("{dsp} %, {flip_flops} %, {lookup_tables} %, {clock_mhz} MHz"), ours.to_owned()],
        Origin::Open,
        "tools/scripts/rtl-resources.sh",
        anchor("logic"),
    )
}

/// The cell of a row in the column with this key, if it is known.
fn known(table: &Table, row: &[Cell], key: &str) -> Option<String> {
    let place = table.columns.iter().position(|column| column.key == key)?;
    (row[place] != Cell::Missing).then(|| row[place].shown())
}

impl Source {
    /// All rows of a table in one of the index.
    fn together(&self, table: &Table) -> Row {
        let all = |key: fn(&Figure) -> &'static str| {
            let figures = self.figures.iter().map(|figure| {
                let rows = table.rows.iter();
                let cells: Vec<_> = rows.filter_map(|row| known(table, row, key(figure))).collect();
                cells.join(" → ") + figure.2
            });
            figures.collect::<Vec<_>>().join(", ")
        };
        let subject = table.title.split(':').next().unwrap_or_default();
        let subject = subject.trim_start_matches(table.id).trim().to_owned();
        let (recorded, ours) = (all(|figure| figure.0), all(|figure| figure.1));
        let thesis = self.thesis.to_owned();
        row(thesis, subject, [recorded, ours], Origin::Modelled, "", table.anchor())
    }

    /// A row of the index for each row that has both figures.
    fn each(&self, table: &Table) -> Vec<Row> {
        let mut rows = Vec::new();
        for cells in &table.rows {
            let cell = |key: &str| known(table, cells, key);
            for &(recorded, ours, unit) in self.figures {
                // The thesis' powers give the power efficiency, without a figure of ours.
                let ours = cell(ours).or_else(|| cell("recomputed"));
                let Some(both) = cell(recorded).zip(ours) else { continue };
                let subject = self.names.iter().filter_map(|name| cell(name)).collect::<Vec<_>>();
                let thesis = self.place(cell).unwrap_or_else(|| "Chapter 6".to_owned());
                let figures = [both.0, both.1].map(|text| text + unit);
                let shown = table.anchor();
                rows.push(row(thesis, subject.join(", "), figures, Origin::Modelled, "", shown));
            }
        }
        rows
    }

    /// The place of a row in the thesis.
    fn place(&self, cell: impl Fn(&str) -> Option<String>) -> Option<String> {
        let Some((table, what)) = self.thesis.split_once('}') else {
            return Some(self.thesis.to_owned());
        };
        let name = cell("profile")?;
        let design = DESIGNS.into_iter().find(|design| design.profile.name == name)?;
        let table = match table {
            "{results" => design.results.to_owned(),
            _ => cell("table")?,
        };
        Some(of_design(design, &table, what))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formulas::thesis_parts;

    fn all() -> Vec<Row> {
        thesis_parts().into_iter().flat_map(|part| part.rows).collect()
    }

    fn of<'a>(rows: &'a [Row], thesis: &str, subject: &str) -> &'a Row {
        let found = rows.iter().find(|row| row.thesis == thesis && row.subject.contains(subject));
        found.unwrap_or_else(|| panic!("{thesis}, {subject}: {rows:#?}"))
    }

    #[test]
    fn every_table_of_the_thesis_has_rows_with_both_figures() {
        let rows = all();
        for chapter in [4, 6] {
            for table in 1..=if chapter == 4 { 6 } else { 11 } {
                let number = format!("{chapter}.{table}");
                let has = |row: &&Row| {
                    let end =
                        |text: &str| !text.starts_with(|letter: char| letter.is_ascii_digit());
                    row.thesis
                        .match_indices(&number)
                        .any(|(at, _)| end(&row.thesis[at + number.len()..]))
                        && row.thesis.contains("Table")
                };
                let own: Vec<_> = rows.iter().filter(has).collect();
                assert!(!own.is_empty(), "Table {number}");
            }
        }
        let cycles = of(&rows, "§6.4, Table 6.4: cycles", "float, packed");
        assert_eq!((&*cycles.recorded, &*cycles.ours), ("2,062,697", "2,066,606"));
        let words = of(&rows, "§4.4.1, Table 4.1", "PGS input");
        let first = "7,423,040 → 3,662,280 words, 28.32 → 13.97 MiB, 1,855,760 → 915,570 beats";
        assert_eq!((&*words.subject, &*words.recorded), ("PGS input", first));
        assert_eq!(words.ours, first);
    }

    #[test]
    fn rows_without_a_time_of_ours_have_the_figure_that_the_thesis_powers_give() {
        let rows = all();
        for table in ["§6.4, Table 6.7", "§6.5, Table 6.11"] {
            let gpu = of(&rows, table, "power efficiency over GTX 980");
            assert_eq!((&*gpu.recorded, &*gpu.ours), ("19.20", "19.20"));
            let cpu = of(&rows, table, "power efficiency over i7-3770");
            assert_eq!((&*cpu.recorded, &*cpu.ours), ("8.67", "8.87"));
        }
        let logic = of(&rows, "§6.5, Table 6.8: logic and clock", "half");
        assert_eq!((&*logic.recorded, logic.origin), ("42 %, 29 %, 49 %, 250 MHz", Origin::Open));
        assert_eq!(of(&rows, "§6.1.1, Table 6.1", "block RAM").ours, "1,824 BRAM_18K: 4.0 MiB");
    }
}
