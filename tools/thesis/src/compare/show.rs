//! The tables of a comparison: row by row, and the last step in detail.

use scene::Penetration;
use step_folder::digest;

use super::side::{Measured, Side};
use super::{Row, vector};
use crate::deviation::Deviation;
use crate::experiment::Part;
use crate::table::{Cell, Table, text};
use pgs_command::numbers::{grouped, number};

/// A table without rows for the steps that are shown.
pub(super) fn steps() -> Table {
    Table::with_columns(
        "boards",
        "Both boards, and B minus A",
        &[
            ("step", "step"),
            ("board", ""),
            ("collisions", "pairs"),
            ("kinetic_kj", "kinetic\nkJ"),
            ("potential_kj", "potential\nkJ"),
            ("momentum_n_s", "momentum\nN s"),
            ("angular_n_m_s", "angular\nN m s"),
            ("penetration_mean_mm", "deep\nmm mean"),
            ("penetration_most_mm", "deep\nmm most"),
            ("unmoved_percent", "unmoved\n%"),
            ("position_mean_percent", "position\n% mean"),
            ("position_under_1_percent", "position\n% < 1 %"),
            ("position_most_percent", "position\n% most"),
            ("linear_within_1_percent", "linear\n% in 1 %"),
            ("linear_most_m_s", "linear\nm/s most"),
            ("angular_within_1_percent", "spin\n% in 1 %"),
            ("angular_most_rad_s", "spin\nrad/s"),
        ],
    )
}

/// Cells behind those of one board.
const DEVIATIONS: usize = 7;

/// Adds rows for A, for B, and for B minus A; the start is the same on both.
pub(super) fn row(table: &mut Table, row: &Row) {
    let step = || Cell::Whole(row.step.into());
    let both = if row.step == 0 { &["start"][..] } else { &["A", "B"] };
    for (name, measured) in both.iter().zip([&row.a, &row.b]) {
        let Some(measured) = measured else { continue };
        let mut cells = vec![step(), text(*name)];
        cells.extend(of_board(measured));
        cells.extend([const { Cell::Missing }; DEVIATIONS]);
        table.row(cells);
    }
    let (Some(a), Some(b), Some(state)) = (&row.a, &row.b, &row.deviation) else { return };
    let percent = |share: f64| Cell::Digits(share * 100.0);
    table.row([
        step(),
        text("B-A"),
        Cell::Signed(b.collisions as f64 - a.collisions as f64),
        Cell::Signed((b.kinetic.total() - a.kinetic.total()) / 1e3),
        Cell::Signed((b.potential - a.potential) / 1e3),
        Cell::Digits(length(vector(b.momentum.linear, a.momentum.linear))),
        Cell::Digits(length(vector(b.momentum.angular, a.momentum.angular))),
        Cell::Signed((b.penetration.mean - a.penetration.mean) * 1e3),
        Cell::Signed((b.penetration.largest - a.penetration.largest) * 1e3),
        Cell::known(b.unmoved.zip(a.unmoved), |(b, a)| Cell::Signed((b - a) * 100.0)),
        percent(state.position.mean),
        percent(state.position.under_share()),
        percent(state.position.largest),
        percent(state.linear.within_share()),
        Cell::Digits(state.linear.largest_absolute),
        percent(state.angular.within_share()),
        Cell::Digits(state.angular.largest_absolute),
    ]);
}

/// The cells of one board, without the deviations.
fn of_board(measured: &Measured) -> [Cell; 8] {
    let Measured { kinetic, momentum, penetration, .. } = measured;
    [
        Cell::Whole(measured.collisions),
        Cell::Digits(kinetic.total() / 1e3),
        Cell::Digits(measured.potential / 1e3),
        Cell::Digits(length(momentum.linear)),
        Cell::Digits(length(momentum.angular)),
        Cell::Digits(penetration.mean * 1e3),
        Cell::Digits(penetration.largest * 1e3),
        Cell::known(measured.unmoved, |share| Cell::Digits(share * 100.0)),
    ]
}

/// The deviations of the last step.
pub(super) fn last(row: &Row) -> Option<Table> {
    let state = row.deviation.as_ref()?;
    let mut table = Table::new("last", format!("Step {}, B against A", row.step));
    for (name, deviation) in [
        ("position, m", &state.position),
        ("linear, m/s", &state.linear),
        ("spin, rad/s", &state.angular),
    ] {
        let Deviation { mean, largest, mean_absolute, largest_absolute, .. } = *deviation;
        table.row([
            ("of", "of", text(name)),
            ("under_1_percent", "% under\n1 %", Cell::Digits(deviation.under_share() * 100.0)),
            ("within_1_percent", "% within\n1 %", Cell::Digits(deviation.within_share() * 100.0)),
            ("mean_percent", "relative\nmean %", Cell::Digits(mean * 100.0)),
            ("most_percent", "relative\nmost %", Cell::Digits(largest * 100.0)),
            ("absolute_mean", "absolute\nmean", Cell::Digits(mean_absolute)),
            ("absolute_most", "absolute\nmost", Cell::Digits(largest_absolute)),
            ("components", "components", Cell::Whole(deviation.components)),
            ("zeros", "zeros\nof A", Cell::Whole(deviation.zeros)),
            ("zeros_moved", "not\nin B", Cell::Whole(deviation.zeros_moved)),
        ]);
    }
    Some(table)
}

/// Adds the end of a board: its last state, and its digest or its failure.
pub(super) fn end(part: &mut Part, side: &Side<'_>, measured: Option<&Measured>) {
    if let Some(Measured { kinetic, momentum, penetration, .. }) = measured {
        let Penetration { contacts, penetrating, .. } = penetration;
        let text = format!(
            "{:.3} J translational, {:.3} J rotational; {} N s, {} N m s; {} of {} contacts \
             penetrate",
            kinetic.translational,
            kinetic.rotational,
            three(momentum.linear),
            three(momentum.angular),
            grouped(*penetrating),
            grouped(*contacts),
        );
        part.fact(side.name, text);
    }
    match &side.failed {
        None => {
            let text = format!("{} {} {}", side.name, digest::ALGORITHM, side.digest());
            part.fact("digest", text);
        }
        Some(failed) => {
            let (name, spec, step) = (side.name, side.spec, failed.step);
            let text = format!("{name} ({spec}) in step {step}: {}", failed.failure.chain());
            part.fact("failed", text);
        }
    }
}

fn three(vector: [f64; 3]) -> String {
    format!("({})", vector.map(number).join(", "))
}

fn length([x, y, z]: [f64; 3]) -> f64 {
    ((x * x + y * y) + z * z).sqrt()
}
