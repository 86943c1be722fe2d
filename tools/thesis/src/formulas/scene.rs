//! The input of the model: a step and profiles.

use crate::estimate::{StepShape, thesis};
use pgs_interface::profile::Variant;

use crate::table::{Cell, Kind, Table, text};

/// The subject of the tables.
#[derive(Debug, Clone)]
pub(crate) struct Scene {
    pub(super) step: StepShape,
    pub(super) variants: Vec<Variant>,
}

impl Scene {
    /// Whether the step is the thesis', so that its figures can be compared with ours.
    pub(super) fn is_thesis_step(&self) -> bool {
        self.step == thesis::step()
    }

    /// The deviation of our figure from the thesis', percent.
    pub(super) fn difference(&self, ours: f64, thesis: f64) -> Cell {
        if self.is_thesis_step() { difference(ours, thesis) } else { Cell::Missing }
    }

    /// The thesis' figure, if it has one, and the deviation of ours.
    pub(super) fn beside(&self, ours: f64, thesis: Option<f64>, digits: usize) -> [Cell; 2] {
        let off = Cell::known(thesis, |thesis| self.difference(ours, thesis));
        [Cell::known(thesis, |thesis| Cell::Number(thesis, digits)), off]
    }

    /// A table with the rows of each design: its name, the cells of `rows`, and the kind.
    pub(super) fn table<'a, All, Row>(
        &'a self,
        id: &'static str,
        title: &str,
        kind: Kind,
        rows: impl Fn(&'a Variant) -> All,
    ) -> Table
    where
        All: IntoIterator<Item = Row>,
        Row: IntoIterator<Item = (&'static str, &'static str, Cell)>,
    {
        let mut table = Table::new(id, title);
        for variant in &self.variants {
            let name = ("profile", "profile", text(variant.profile.name));
            for row in rows(variant) {
                let row = std::iter::once(name.clone()).chain(row);
                table.row(row.chain([("kind", "kind", kind.cell())]));
            }
        }
        table
    }
}

/// A count.
pub(super) fn whole(count: impl Into<u64>) -> Cell {
    Cell::Whole(count.into())
}

/// The deviation of a figure from another one, percent.
pub(super) fn difference(ours: f64, theirs: f64) -> Cell {
    Cell::Difference((ours / theirs - 1.0) * 100.0)
}

pub(super) fn mib(bytes: u64) -> f64 {
    bytes as f64 / f64::from(1 << 20)
}

/// MiB with the two digits that the thesis prints: figures that round to the same digits are equal.
pub(super) fn printed_mib(bytes: u64) -> f64 {
    (mib(bytes) * 100.0).round() / 100.0
}

pub(super) fn yes_or_no(yes: bool) -> Cell {
    text(if yes { "yes" } else { "no" })
}
