//! The report as Markdown and as JSON.

use std::fmt::Write as _;

use serde_json::{Value, json};

use super::parts::Report;
use crate::experiment::SCHEMA;
use crate::figure::Figure;
use crate::index::WITHOUT_COUNTERPART;
use crate::index::{Origin, Row};
use crate::table::Table;

/// The source of the page's figures.
pub(super) fn preface(report: &Report) -> String {
    let step = match report.given {
        true => format!("Measured on {}.", report.step),
        false => format!(
            "Measured on {}: no folder with a step of Bullet was given (--input).",
            report.step
        ),
    };
    let effort = match report.quick {
        true => " The quick report: fewer seeds and steps.",
        false => "",
    };
    format!("{step}{effort}")
}

/// The figures of the thesis that the index lacks.
pub(super) fn without_counterpart() -> String {
    let each = WITHOUT_COUNTERPART.map(|(thesis, reason)| format!("{thesis} ({reason})"));
    format!("Without a counterpart: {}.", each.join("; "))
}

pub(super) fn json(report: &Report) -> Value {
    json!({
        "schema": SCHEMA,
        "verb": "thesis",
        "step": report.step,
        "of_folder": report.given,
        "quick": report.quick,
        "without_counterpart": WITHOUT_COUNTERPART
            .iter()
            .map(|(thesis, reason)| json!({ "thesis": thesis, "reason": reason }))
            .collect::<Vec<_>>(),
        "index": report.part.rows.iter().map(Row::to_json).collect::<Vec<_>>(),
        "figures": report.part.figures.iter().map(Figure::to_json).collect::<Vec<_>>(),
        "tables": report.part.tables.iter().map(Table::to_json).collect::<Vec<_>>(),
    })
}

pub(super) fn markdown(report: &Report) -> String {
    let mut text =
        format!("# The thesis' figures, from our own numbers\n\n{}\n\n", preface(report));
    for origin in Origin::ALL {
        let _ = writeln!(text, "- {} {}: {}", origin.mark(), origin.word(), origin.meaning());
    }
    text.push_str("\n## Eight numbers\n\n");
    for Row { thesis, subject, recorded, ours, shown, .. } in &report.numbers {
        let _ = writeln!(text, "- **{ours}** [{subject}](#{shown}); thesis, {thesis}: {recorded}");
    }
    text.push_str("\n## Figures\n\n");
    for figure in &report.part.figures {
        let _ = writeln!(
            text,
            "<a id=\"{}\"></a>\n### {}: {}\n\n![{}]({})\n\n{} {}: {}\n",
            figure.id,
            figure.thesis,
            figure.title,
            figure.title,
            figure.file(),
            figure.origin.mark(),
            figure.origin.word(),
            figure.caption
        );
    }
    text.push_str("## Index\n\n| thesis | subject | its figure | ours | | command |\n");
    text.push_str("| :-- | :-- | :-- | :-- | :-- | :-- |\n");
    for row in &report.part.rows {
        let _ = writeln!(
            text,
            "| {} | [{}](#{}) | {} | {} | {} {} | `{}` |",
            row.thesis,
            row.subject.replace('|', "\\|"),
            row.shown,
            row.recorded.replace('|', "\\|"),
            row.ours.replace('|', "\\|"),
            row.origin.mark(),
            row.origin.word(),
            row.command
        );
    }
    let _ = writeln!(text, "\n{}\n", without_counterpart());
    text.push_str("## Tables\n\n");
    for table in &report.part.tables {
        let _ = write!(text, "<a id=\"{}\"></a>\n{}", table.anchor(), table.to_markdown());
    }
    text
}
