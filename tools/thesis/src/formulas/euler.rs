//! Figure 2.6: a fall of ten seconds by explicit Euler.

use crate::estimate::thesis::euler::{exact, explicit, explicit_single};

use super::scene::{Scene, difference};
use crate::table::{Cell, Kind, Table, text};

pub(super) fn tables(_: &Scene) -> Vec<Table> {
    let mut table = Table::new(
        "euler",
        "Position after 10 s at 10 m/s², m (Figure 2.6)",
        &[
            ("integration", "integration"),
            ("metres", "ours"),
            ("thesis", "thesis"),
            ("difference_percent", "difference"),
            ("kind", "kind"),
        ],
    );
    for (name, ours, thesis) in [
        ("explicit Euler, dt = 1 s", explicit(1), 450.0),
        ("explicit Euler, dt = 1/100 s", explicit(100), 499.49),
        ("the same in single precision", explicit_single(100).into(), 499.49),
        ("exact", exact(), 500.0),
    ] {
        table.row([
            text(name),
            Cell::Number(ours, 3),
            Cell::Number(thesis, 2),
            difference(ours, thesis),
            Kind::Exact.cell(),
        ]);
    }
    table.note("a dt² n (n - 1) / 2 is 499.500 m for dt = 1/100 s; the thesis prints the first digits of the \
         single-precision result.");
    vec![table]
}
