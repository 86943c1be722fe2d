//! Rows of the index that lead to the tables of `pgs model`.

use super::document::{Origin, Row};
use crate::failure::{Cause, Failure};
use crate::verbs::model::render::shown;
use crate::verbs::model::table::{Cell, Table};

/// A table of the thesis, and the columns that hold its figures and ours.
struct Source {
    /// Id of the table.
    table: &'static str,
    /// Section and table of the thesis; a column may add to it.
    thesis: &'static str,
    section: &'static str,
    /// Keys of the columns that name a row.
    names: &'static [&'static str],
    /// Key of the column with the thesis' figure.
    recorded: &'static str,
    /// Key of the column with ours.
    ours: &'static str,
    unit: &'static str,
}

/// A table of words, whose rows are one row of the index: before and after each reduction.
const fn words(table: &'static str, thesis: &'static str) -> Source {
    let (recorded, ours) = ("thesis_words", "words");
    Source { table, thesis, section: "data", names: &[], recorded, ours, unit: " words" }
}

/// Data and memory.
const CHAPTER_4: [Source; 8] = [
    words("T4.1", "§4.4.1, Table 4.1"),
    words("T4.2", "§4.4.1, Table 4.2"),
    words("T4.3", "§4.4.1, Table 4.3"),
    words("T4.4", "§4.4.1, Table 4.4"),
    words("T4.5", "§4.4.1, Table 4.5"),
    words("T4.6", "§4.4.1, Table 4.6"),
    Source {
        table: "memory",
        thesis: "§4.4.2",
        section: "memory",
        names: &["profile"],
        recorded: "thesis_mib",
        ours: "mib",
        unit: " MiB",
    },
    Source {
        table: "memory",
        thesis: "§4.4.2, with positions",
        section: "memory",
        names: &["profile"],
        recorded: "thesis_with_positions_mib",
        ours: "with_positions_mib",
        unit: " MiB",
    },
];

/// Cycles, resources and the comparison with GPU and CPU.
const CHAPTER_6: [Source; 5] = [
    Source {
        table: "cycles",
        thesis: "§6.4, §6.5, Tables 6.4 and 6.8: cycles",
        section: "step",
        names: &["profile", "records"],
        recorded: "thesis",
        ours: "total",
        unit: "",
    },
    Source {
        table: "blocks",
        thesis: "§6.4, §6.5, Tables 6.4 and 6.8: BRAM_18K",
        section: "memory",
        names: &["profile"],
        recorded: "thesis_percent",
        ours: "ideal_percent",
        unit: "",
    },
    Source {
        table: "time",
        thesis: "§6.4, §6.5, Tables 6.5 and 6.9: ms",
        section: "step",
        names: &["profile", "records", "bandwidth"],
        recorded: "thesis_ms",
        ours: "ms",
        unit: "",
    },
    Source {
        table: "comparison",
        thesis: "§6.4, §6.5",
        section: "comparison",
        names: &["table", "profile", "figure"],
        recorded: "thesis",
        ours: "packed_unlimited",
        unit: "",
    },
    Source {
        table: "platforms",
        thesis: "§6.1, Tables 6.5 and 6.9: energy of GPU and CPU, J",
        section: "comparison",
        names: &["platform"],
        recorded: "joules",
        ours: "recomputed_joules",
        unit: "",
    },
];

/// Id of a table in the report.
pub(super) fn anchor(table: &Table) -> String {
    let text = table.id.to_lowercase().replace(['.', '_'], "-");
    format!("table-{text}")
}

pub(super) fn of_chapter_4(tables: &[Table]) -> Result<Vec<Row>, Failure> {
    rows(&CHAPTER_4, tables)
}

pub(super) fn of_chapter_6(tables: &[Table]) -> Result<Vec<Row>, Failure> {
    rows(&CHAPTER_6, tables)
}

/// A row of the index for each row of a table that has a figure of the thesis.
fn rows(sources: &[Source], tables: &[Table]) -> Result<Vec<Row>, Failure> {
    let mut rows = Vec::new();
    for source in sources {
        let missing = |what: &str| {
            Failure::new(Cause::Input, format!("the model has no {what} in {}", source.table))
        };
        let table = tables.iter().find(|table| table.id == source.table);
        let table = table.ok_or_else(|| missing("table"))?;
        let column = |key: &str| {
            let place = table.columns.iter().position(|column| column.key == key);
            place.ok_or_else(|| missing(key))
        };
        let names = source.names.iter().map(|key| column(key)).collect::<Result<Vec<_>, _>>()?;
        let (recorded, ours) = (column(source.recorded)?, column(source.ours)?);
        if source.names.is_empty() {
            let together = |column: usize| {
                let cells: Vec<String> = table.rows.iter().map(|row| shown(&row[column])).collect();
                cells.join(" → ") + source.unit
            };
            let subject = table.title.split(':').next().unwrap_or_default();
            let subject = subject.trim_start_matches(table.id).trim().to_owned();
            rows.push(row(source, table, subject, together(recorded), together(ours)));
            continue;
        }
        for cells in &table.rows {
            // Powers of the thesis alone have no figure of ours to stand beside it.
            if [recorded, ours].iter().any(|column| cells[*column] == Cell::Missing) {
                continue;
            }
            let subject: Vec<String> = names.iter().map(|column| shown(&cells[*column])).collect();
            let figure = |column: usize| shown(&cells[column]) + source.unit;
            rows.push(row(source, table, subject.join(", "), figure(recorded), figure(ours)));
        }
    }
    Ok(rows)
}

fn row(source: &Source, table: &Table, subject: String, recorded: String, ours: String) -> Row {
    Row {
        thesis: source.thesis.to_owned(),
        subject,
        recorded,
        ours,
        origin: Origin::Modelled,
        command: format!("pgs model --section {}", source.section),
        shown: anchor(table),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::verbs::model::thesis_tables;

    #[test]
    fn every_table_of_the_thesis_has_rows_with_both_figures() {
        let tables = thesis_tables();
        let mut rows = of_chapter_4(&tables).expect("every source has its table");
        rows.extend(of_chapter_6(&tables).expect("every source has its table"));
        for source in CHAPTER_4.iter().chain(&CHAPTER_6) {
            let own = rows.iter().filter(|row| row.thesis == source.thesis);
            assert!(own.count() > 0, "{}", source.thesis);
        }
        let cycles = rows.iter().find(|row| row.recorded == "2,062,697").expect("Table 6.4");
        assert_eq!(cycles.subject, "float, packed");
        assert_eq!(cycles.ours, "2,066,606");
        let words = rows.iter().find(|row| row.thesis.ends_with("4.1")).expect("Table 4.1");
        assert_eq!(words.ours, "7,423,040 → 3,662,280 words");
        assert_eq!(words.subject, "PGS input");
    }
}
