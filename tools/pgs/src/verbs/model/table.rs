//! The model's tables: typed cells, laid out by `render`.

use serde_json::{Map, Value, json};

/// The origin of a row's figures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Counted.
    Exact,
    /// Computed by a cycle, memory or bandwidth model.
    Modelled,
    /// Taken from the thesis.
    Recorded,
    /// Unknown.
    Open,
}

impl Kind {
    pub(crate) fn cell(self) -> Cell {
        text(match self {
            Self::Exact => "exact",
            Self::Modelled => "modelled",
            Self::Recorded => "recorded",
            Self::Open => "open",
        })
    }
}

/// The content of a table's cell.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Cell {
    Text(String),
    Whole(u64),
    /// A number, and its digits behind the point.
    Number(f64, usize),
    /// Percent with its sign.
    Difference(f64),
    /// Percent.
    Share(f64),
    /// Unknown, or of another scene.
    Missing,
}

pub(crate) fn text(value: impl Into<String>) -> Cell {
    Cell::Text(value.into())
}

impl Cell {
    fn to_json(&self) -> Value {
        match self {
            Self::Text(text) => json!(text),
            Self::Whole(number) => json!(number),
            Self::Number(value, _) | Self::Difference(value) | Self::Share(value) => json!(value),
            Self::Missing => Value::Null,
        }
    }
}

/// A column: its JSON key, and its heading.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Column {
    pub(crate) key: &'static str,
    pub(crate) head: &'static str,
}

/// A table with its notes.
#[derive(Debug, Clone)]
pub(crate) struct Table {
    pub(crate) id: &'static str,
    pub(crate) title: String,
    pub(crate) columns: Vec<Column>,
    pub(crate) rows: Vec<Vec<Cell>>,
    pub(crate) notes: Vec<String>,
}

impl Table {
    /// A table without rows; columns are (key, heading).
    pub(crate) fn new(
        id: &'static str,
        title: impl Into<String>,
        columns: &[(&'static str, &'static str)],
    ) -> Self {
        let columns = columns.iter().map(|(key, head)| Column { key, head }).collect();
        Self { id, title: title.into(), columns, rows: Vec::new(), notes: Vec::new() }
    }

    pub(crate) fn row(&mut self, cells: impl IntoIterator<Item = Cell>) {
        let cells: Vec<Cell> = cells.into_iter().collect();
        debug_assert_eq!(cells.len(), self.columns.len(), "{}", self.id);
        self.rows.push(cells);
    }

    pub(crate) fn note(&mut self, note: impl Into<String>) {
        self.notes.push(note.into());
    }

    pub(crate) fn to_json(&self) -> Value {
        let row = |cells: &Vec<Cell>| {
            let members = self.columns.iter().zip(cells);
            members
                .map(|(column, cell)| (column.key.to_owned(), cell.to_json()))
                .collect::<Map<_, _>>()
        };
        json!({
            "id": self.id,
            "title": self.title,
            "columns": self.columns.iter().map(|column| column.key).collect::<Vec<_>>(),
            "rows": self.rows.iter().map(row).collect::<Vec<_>>(),
            "notes": self.notes,
        })
    }
}
