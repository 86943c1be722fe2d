//! The report's content, apart from how it is written: figures, and rows that lead to them.

use serde_json::{Value, json};

use super::place::section_key;

/// The origin of a figure or a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Origin {
    /// Computed by a formula, counted, or a time of the emulated board.
    Modelled,
    /// Measured on this machine: results of steps, or the host's time.
    Measured,
    /// Printed in the thesis.
    Recorded,
    /// Unknown.
    Open,
}

impl Origin {
    pub(super) const ALL: [Self; 4] = [Self::Recorded, Self::Modelled, Self::Measured, Self::Open];

    /// The word for it.
    pub(super) const fn word(self) -> &'static str {
        match self {
            Self::Modelled => "modelled",
            Self::Measured => "measured",
            Self::Recorded => "recorded",
            Self::Open => "open",
        }
    }

    /// The mark before the word.
    pub(super) const fn mark(self) -> &'static str {
        match self {
            Self::Modelled => "◆",
            Self::Measured => "●",
            Self::Recorded => "▣",
            Self::Open => "○",
        }
    }

    /// The meaning of the mark.
    pub(super) const fn meaning(self) -> &'static str {
        match self {
            Self::Modelled => "counted, computed by a formula, or a time of the emulated board",
            Self::Measured => "measured on this machine: results of steps, or the host's time",
            Self::Recorded => "a figure that the thesis prints",
            Self::Open => "not known: no figure of ours",
        }
    }
}

/// A picture with its caption.
#[derive(Debug, Clone)]
pub(super) struct Figure {
    /// Its anchor, and the name of its file.
    pub(super) id: &'static str,
    /// Its place in the thesis, section first: "§4.7, Figure 4.13".
    pub(super) thesis: &'static str,
    pub(super) title: String,
    /// SVG text.
    pub(super) svg: String,
    pub(super) caption: String,
    pub(super) origin: Origin,
    /// A page of its own that plays the subject.
    pub(super) playback: Option<String>,
}

/// A row of the index: a statement of the thesis beside ours.
#[derive(Debug, Clone)]
pub(super) struct Row {
    /// Section of the thesis, and its figure or table.
    pub(super) thesis: String,
    /// The subject of both figures.
    pub(super) subject: String,
    /// The thesis' figure.
    pub(super) recorded: String,
    pub(super) ours: String,
    /// The origin of ours.
    pub(super) origin: Origin,
    /// The command that prints ours.
    pub(super) command: String,
    /// Id of the figure or table that shows it.
    pub(super) shown: String,
}

/// A part of the report.
#[derive(Debug, Clone, Default)]
pub(super) struct Part {
    pub(super) figures: Vec<Figure>,
    pub(super) rows: Vec<Row>,
}

impl Part {
    /// Adds another part behind this one.
    pub(super) fn append(&mut self, mut other: Self) {
        self.figures.append(&mut other.figures);
        self.rows.append(&mut other.rows);
    }

    /// Sorts by the sections of the thesis; within one, figures and rows keep their order.
    pub(super) fn sort(&mut self) {
        self.figures.sort_by_key(|figure| section_key(figure.thesis));
        self.rows.sort_by_key(|row| section_key(&row.thesis));
    }
}

impl Row {
    pub(super) fn to_json(&self) -> Value {
        json!({
            "thesis": self.thesis,
            "subject": self.subject,
            "recorded": self.recorded,
            "ours": self.ours,
            "origin": self.origin.word(),
            "command": self.command,
            "shown": self.shown,
        })
    }
}

impl Figure {
    pub(super) fn to_json(&self) -> Value {
        json!({
            "id": self.id,
            "thesis": self.thesis,
            "title": self.title,
            "caption": self.caption,
            "origin": self.origin.word(),
            "file": self.file(),
        })
    }

    /// Path of its file in the report's folder.
    pub(super) fn file(&self) -> String {
        format!("figures/{}.svg", self.id)
    }
}
