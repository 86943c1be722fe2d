//! Rows of the index that lead to the tables of the formulas.

use crate::estimate::thesis::recorded::{CPU, DESIGNS, DEVICE_MEGABYTES, Design, GPU, Platform};
use crate::estimate::{BLOCK_BITS, BLOCKS};
use pgs_interface::profile::FLOAT;

use crate::index::{Origin, Row};
use crate::table::{Cell, Table, anchor};
use pgs_command::failure::{Cause, Failure, Result};
use pgs_command::numbers::grouped;

/// A table of the thesis, and the columns that hold its figures and ours.
struct Source {
    /// Id of the table.
    table: &'static str,
    section: &'static str,
    /// The place in the thesis.
    thesis: Place,
    /// Keys of the columns that name a row; without one all rows of the table are one of the index:
    /// before and after each reduction.
    names: &'static [&'static str],
    figures: &'static [Figure],
}

/// Where the thesis has the figures of a row.
enum Place {
    /// All rows.
    Fixed(&'static str),
    /// By the design of the row's profile.
    OfDesign(fn(&Design) -> String),
    /// By the design, in the table that the row names.
    Named,
}

/// Columns with a figure of the thesis and ours.
struct Figure {
    recorded: &'static str,
    /// Ours, or where this column is empty the one behind it.
    ours: &'static [&'static str],
    unit: &'static str,
}

const fn figure(
    recorded: &'static str,
    ours: &'static [&'static str],
    unit: &'static str,
) -> Figure {
    Figure { recorded, ours, unit }
}

/// A table of words, bytes and stream accesses.
const fn data(table: &'static str, thesis: &'static str) -> Source {
    const FIGURES: [Figure; 3] = [
        figure("thesis_words", &["words"], " words"),
        figure("thesis_mib", &["mib"], " MiB"),
        figure("thesis_beats", &["beats"], " beats"),
    ];
    Source { table, section: "data", thesis: Place::Fixed(thesis), names: &[], figures: &FIGURES }
}

/// The tables that have figures of the thesis.
const SOURCES: [Source; 13] = [
    data("T4.1", "§4.4.1, Table 4.1"),
    data("T4.2", "§4.4.1, Table 4.2"),
    data("T4.3", "§4.4.1, Table 4.3"),
    data("T4.4", "§4.4.1, Table 4.4"),
    data("T4.5", "§4.4.1, Table 4.5"),
    data("T4.6", "§4.4.1, Table 4.6"),
    Source {
        table: "memory",
        section: "memory",
        thesis: Place::Fixed("§4.4.2"),
        names: &["profile"],
        figures: &[figure("thesis_mib", &["mib"], " MiB")],
    },
    Source {
        table: "memory",
        section: "memory",
        thesis: Place::Fixed("§4.4.2, with positions"),
        names: &["profile"],
        figures: &[figure("thesis_with_positions_mib", &["with_positions_mib"], " MiB")],
    },
    Source {
        table: "cycles",
        section: "step",
        thesis: Place::OfDesign(|design| of_design(design, design.results, ": cycles")),
        names: &["profile", "records"],
        figures: &[figure("thesis", &["total"], "")],
    },
    Source {
        table: "blocks",
        section: "memory",
        thesis: Place::OfDesign(|design| of_design(design, design.results, ": BRAM_18K")),
        names: &["profile"],
        figures: &[figure("thesis_percent", &["ideal_percent"], "")],
    },
    Source {
        table: "time",
        section: "step",
        thesis: Place::OfDesign(|design| of_design(design, design.comparison, ": ms")),
        names: &["profile", "records", "bandwidth"],
        figures: &[figure("thesis_ms", &["ms"], "")],
    },
    Source {
        table: "platforms",
        section: "comparison",
        thesis: Place::Fixed("§6.4, §6.5, Tables 6.5 and 6.9: energy of GPU and CPU, J"),
        names: &["platform"],
        figures: &[figure("joules", &["recomputed_joules"], "")],
    },
    Source {
        table: "comparison",
        section: "comparison",
        thesis: Place::Named,
        names: &["profile", "figure"],
        // The thesis' powers give the power efficiency, without a figure of ours.
        figures: &[figure("thesis", &["packed_unlimited", "recomputed"], "")],
    },
];

/// A place of a design's figures, from the short name of a table.
fn of_design(design: &Design, table: &str, what: &str) -> String {
    let table = match table.strip_prefix('T') {
        Some(number) => format!("Table {number}"),
        None => table.replace("eq", "equation"),
    };
    format!("{}, {table}{what}", design.section)
}

/// The rows of the index that lead to the tables of an experiment.
pub(super) fn of(section: &str, tables: &[Table]) -> Result<Vec<Row>> {
    let mut rows = match section {
        "memory" => std::iter::once(device()).chain(DESIGNS.map(logic)).collect(),
        "comparison" => vec![powers()],
        _ => Vec::new(),
    };
    for source in SOURCES.iter().filter(|source| source.section == section) {
        let table = tables.iter().find(|table| table.id == source.table);
        let table = table.ok_or_else(|| source.missing("table"))?;
        match source.names {
            [] => rows.push(source.together(table)?),
            names => rows.extend(source.each(table, names)?),
        }
    }
    Ok(rows)
}

/// The block RAM of the device (Table 6.1).
fn device() -> Row {
    let mebibytes = (BLOCKS * BLOCK_BITS) as f64 / 8.0 / f64::from(1 << 20);
    Row {
        thesis: "§6.1.1, Table 6.1".to_owned(),
        subject: "block RAM of the device".to_owned(),
        recorded: format!("{DEVICE_MEGABYTES} MB"),
        ours: format!("{} BRAM_18K: {mebibytes:.1} MiB", grouped(BLOCKS)),
        origin: Origin::Modelled,
        command: String::new(),
        shown: anchor("blocks"),
    }
}

/// The powers of GPU and CPU (Tables 6.2 and 6.3).
fn powers() -> Row {
    let both = |watts: fn(&Platform) -> f64| format!("{} W and {} W", watts(&GPU), watts(&CPU));
    Row {
        thesis: "§6.1.2, §6.1.3, Tables 6.2 and 6.3".to_owned(),
        subject: format!("thermal design power of {} and {}", GPU.name, CPU.name),
        recorded: both(|platform| platform.design_watts),
        ours: format!(
            "not measured; Tables 6.5 and 6.9 calculate with {}",
            both(|platform| platform.watts)
        ),
        origin: Origin::Open,
        command: String::new(),
        shown: anchor("platforms"),
    }
}

/// Logic and clock of a design (Tables 6.4 and 6.8), which no synthesis has given for ours.
fn logic(design: &Design) -> Row {
    let name = design.profile.name;
    let Design { dsp, flip_flops, lookup_tables, clock_mhz, .. } = design;
    // The Verilog is of this profile.
    let (counted, command) = match design.profile.id == FLOAT.id {
        true => (
            "Yosys counts the cells of its generated Verilog (the command)",
            "tools/scripts/rtl-resources.sh",
        ),
        false => ("it has no Verilog", ""),
    };
    Row {
        thesis: of_design(design, design.results, ": logic and clock"),
        subject: format!("{name}: DSP48E, FF, LUT, clock"),
        recorded: format!("{dsp} %, {flip_flops} %, {lookup_tables} %, {clock_mhz} MHz"),
        ours: format!("not synthesised by Vivado; {counted}; the clock is taken from the thesis"),
        origin: Origin::Open,
        command: command.to_owned(),
        shown: anchor("logic"),
    }
}

impl Source {
    fn missing(&self, what: &str) -> Failure {
        Failure::new(Cause::Input, format!("the model has no {what} in {}", self.table))
    }

    fn column(&self, table: &Table, key: &str) -> Result<usize> {
        let place = table.columns.iter().position(|column| column.key == key);
        place.ok_or_else(|| self.missing(key))
    }

    /// The first of these cells of a row that is known.
    fn known(&self, table: &Table, row: &[Cell], keys: &[&str]) -> Result<Option<String>> {
        for key in keys {
            let cell = &row[self.column(table, key)?];
            if *cell != Cell::Missing {
                return Ok(Some(cell.shown()));
            }
        }
        Ok(None)
    }

    /// All rows of a table in one of the index.
    fn together(&self, table: &Table) -> Result<Row> {
        let all = |keys_of: fn(&Figure) -> &[&'static str]| -> Result<String> {
            let mut figures = Vec::new();
            for figure in self.figures {
                let mut cells = Vec::new();
                for row in &table.rows {
                    cells.extend(self.known(table, row, keys_of(figure))?);
                }
                figures.push(cells.join(" → ") + figure.unit);
            }
            Ok(figures.join(", "))
        };
        let subject = table.title.split(':').next().unwrap_or_default();
        let subject = subject.trim_start_matches(table.id).trim().to_owned();
        let recorded = all(|figure| std::slice::from_ref(&figure.recorded))?;
        let ours = all(|figure| figure.ours)?;
        Ok(self.row(table, None, subject, recorded, ours))
    }

    /// A row of the index for each row that has both figures.
    fn each(&self, table: &Table, names: &[&str]) -> Result<Vec<Row>> {
        let mut rows = Vec::new();
        for cells in &table.rows {
            for figure in self.figures {
                let recorded = self.known(table, cells, &[figure.recorded])?;
                let ours = self.known(table, cells, figure.ours)?;
                // Powers of the thesis alone have no figure of ours to stand beside it.
                let Some((recorded, ours)) = recorded.zip(ours) else { continue };
                let subject = names
                    .iter()
                    .map(|name| Ok(cells[self.column(table, name)?].shown()))
                    .collect::<Result<Vec<_>>>()?;
                let [recorded, ours] = [recorded, ours].map(|text| text + figure.unit);
                rows.push(self.row(table, Some(cells), subject.join(", "), recorded, ours));
            }
        }
        Ok(rows)
    }

    fn row(
        &self,
        table: &Table,
        cells: Option<&[Cell]>,
        subject: String,
        recorded: String,
        ours: String,
    ) -> Row {
        let cell = |key: &str| {
            let place = table.columns.iter().position(|column| column.key == key)?;
            cells.map(|cells| cells[place].shown())
        };
        let design = || {
            let name = cell("profile")?;
            DESIGNS.into_iter().find(|design| design.profile.name == name)
        };
        let thesis = match self.thesis {
            Place::Fixed(thesis) => Some(thesis.to_owned()),
            Place::OfDesign(place) => design().map(place),
            Place::Named => design().zip(cell("table")).map(|(d, table)| of_design(d, &table, "")),
        };
        Row {
            thesis: thesis.unwrap_or_else(|| "Chapter 6".to_owned()),
            subject,
            recorded,
            ours,
            origin: Origin::Modelled,
            command: String::new(),
            shown: table.anchor(),
        }
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
