//! The index: statements of the thesis beside ours, in the order of the thesis.

use serde_json::{Value, json};

/// The origin of a figure or a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Origin {
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
    pub(crate) const ALL: [Self; 4] = [Self::Recorded, Self::Modelled, Self::Measured, Self::Open];

    /// The word for it.
    pub(crate) const fn word(self) -> &'static str {
        match self {
            Self::Modelled => "modelled",
            Self::Measured => "measured",
            Self::Recorded => "recorded",
            Self::Open => "open",
        }
    }

    /// The mark before the word.
    pub(crate) const fn mark(self) -> &'static str {
        match self {
            Self::Modelled => "◆",
            Self::Measured => "●",
            Self::Recorded => "▣",
            Self::Open => "○",
        }
    }

    /// The meaning of the mark.
    pub(crate) const fn meaning(self) -> &'static str {
        match self {
            Self::Modelled => "counted, computed by a formula, or a time of the emulated board",
            Self::Measured => "measured on this machine: results of steps, or the host's time",
            Self::Recorded => "a figure that the thesis prints",
            Self::Open => "not known: no figure of ours",
        }
    }
}

/// A row of the index: a statement of the thesis beside ours.
#[derive(Debug, Clone)]
pub(crate) struct Row {
    /// Section of the thesis, and its figure or table.
    pub(crate) thesis: String,
    /// The subject of both figures.
    pub(crate) subject: String,
    /// The thesis' figure.
    pub(crate) recorded: String,
    pub(crate) ours: String,
    /// The origin of ours.
    pub(crate) origin: Origin,
    /// The command that prints ours.
    pub(crate) command: String,
    /// Id of the figure or table that shows it.
    pub(crate) shown: String,
}

impl Row {
    pub(crate) fn to_json(&self) -> Value {
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

/// A key that sorts places of the thesis such as "§4.6.3, Figure 4.10": the numbers of the first
/// section or chapter.
pub(crate) fn section_key(thesis: &str) -> Vec<u32> {
    let from = thesis.trim_start_matches(|letter: char| !letter.is_ascii_digit());
    let end = from.find(|letter: char| !letter.is_ascii_digit() && letter != '.');
    from[..end.unwrap_or(from.len())].split('.').map_while(|number| number.parse().ok()).collect()
}

/// Figures of the thesis that have no counterpart here, and why.
pub(crate) const WITHOUT_COUNTERPART: [(&str, &str); 7] = [
    ("Figure 2.1", "the loop of a simulation: a diagram without numbers"),
    ("Figure 2.3", "the bounding box of a sphere: a drawing without numbers"),
    ("Figure 2.4", "two bounding boxes apart: a drawing without numbers"),
    ("Figure 2.5", "two bounding boxes that overlap: a drawing without numbers"),
    ("Figure 2.7", "the pipeline of Bullet, another program: a diagram without numbers"),
    ("Figure 2.8", "the separating axis of two bodies: a drawing without numbers"),
    ("Figure 5.3", "the blocks of the first design: a diagram; Figure 5.1 has the stages of naive"),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_sort_by_section_and_not_by_letters() {
        let sorted = [
            "§2.2.3",
            "§4.4",
            "§4.4.1, Table 4.1",
            "§4.6.2, Figure 4.5",
            "§4.6.10",
            "Chapter 5",
            "§5.1.1, Figure 5.1",
            "§5.4.3, §5.4.4",
            "§10.1",
        ];
        let places: Vec<_> = sorted.iter().map(|thesis| section_key(thesis)).collect();
        assert!(places.is_sorted(), "{places:?}");
        assert_eq!(places[2], [4, 4, 1]);
    }
}
