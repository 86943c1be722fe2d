//! The measures of the scenes on both solvers, and the limits of the board.

use std::fmt;

use zynq_pgs::{BoardChoice, OpenOptions};

use crate::world::World;

/// Where a measure of the board must lie.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Limit {
    low: f64,
    high: f64,
}

impl Limit {
    pub(crate) const NONE: Self = Self { low: f64::NEG_INFINITY, high: f64::INFINITY };

    pub(crate) const fn at_most(high: f64) -> Self {
        Self { high, ..Self::NONE }
    }

    pub(crate) const fn at_least(low: f64) -> Self {
        Self { low, ..Self::NONE }
    }

    pub(crate) const fn within(low: f64, high: f64) -> Self {
        Self { low, high }
    }

    fn is_set(self) -> bool {
        self.low.is_finite() || self.high.is_finite()
    }

    /// Whether a measure keeps the limit. Not a number keeps none.
    fn holds(self, value: f64) -> bool {
        !self.is_set() || (self.low..=self.high).contains(&value)
    }
}

impl fmt::Display for Limit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [low, high] = [self.low, self.high].map(|bound| number(bound, 4));
        match (self.low.is_finite(), self.high.is_finite()) {
            (false, false) => Ok(()),
            (false, true) => write!(f, "at most {high}"),
            (true, false) => write!(f, "at least {low}"),
            (true, true) => write!(f, "{low} to {high}"),
        }
    }
}

/// One measure.
#[derive(Debug)]
struct Row {
    measure: String,
    unit: &'static str,
    rapier: f64,
    board: f64,
    limit: Limit,
}

/// The measures of a scene on Rapier's own solver and on the board.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Both<const N: usize> {
    pub(crate) rapier: [f64; N],
    pub(crate) board: [f64; N],
}

/// The table of all scenes.
#[derive(Debug)]
pub(crate) struct Table {
    board: BoardChoice,
    /// The title of each scene, and its rows.
    scenes: Vec<(String, Vec<Row>)>,
}

impl Table {
    pub(crate) fn new(board: BoardChoice) -> Self {
        Self { board, scenes: Vec::new() }
    }

    /// Starts the rows of a scene.
    pub(crate) fn begin(&mut self, title: String) {
        self.scenes.push((title, Vec::new()));
    }

    /// Runs a scene on both solvers, one after the other.
    pub(crate) fn measure<const N: usize>(
        &self,
        passes: u32,
        scene: impl Fn(&mut World) -> Result<[f64; N], zynq_pgs::Error>,
    ) -> Result<Both<N>, zynq_pgs::Error> {
        let rapier = scene(&mut World::of_rapier(passes))?;
        let options = OpenOptions { board: self.board.clone(), ..OpenOptions::default() };
        let board = scene(&mut World::of_board(options, passes))?;
        Ok(Both { rapier, board })
    }

    /// Adds a row to the scene that was begun last.
    pub(crate) fn add(
        &mut self,
        (rapier, board): (f64, f64),
        measure: impl Into<String>,
        unit: &'static str,
        limit: Limit,
    ) {
        if let Some((_, rows)) = self.scenes.last_mut() {
            rows.push(Row { measure: measure.into(), unit, rapier, board, limit });
        }
    }

    /// Whether each limit holds.
    pub(crate) fn holds(&self) -> bool {
        let mut rows = self.scenes.iter().flat_map(|(_, rows)| rows);
        rows.all(|row| row.limit.holds(row.board))
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{:52} {:>10} {:>10} {:6} limit of the board", "", "Rapier", "board", "")?;
        for (title, rows) in &self.scenes {
            writeln!(f, "{title}")?;
            for row in rows {
                let [rapier, board] = [row.rapier, row.board].map(|value| number(value, 3));
                let verdict = match (row.limit.is_set(), row.limit.holds(row.board)) {
                    (false, _) => String::new(),
                    (true, true) => format!("{}: ok", row.limit),
                    (true, false) => format!("{}: FAILS", row.limit),
                };
                let line = format!(
                    "  {:50} {rapier:>10} {board:>10} {:6} {verdict}",
                    row.measure, row.unit
                );
                writeln!(f, "{}", line.trim_end())?;
            }
        }
        Ok(())
    }
}

/// A number with some digits that count; a dash for none.
fn number(value: f64, digits: i32) -> String {
    let size = value.abs();
    if value.is_nan() {
        return "-".to_owned();
    }
    if size != 0.0 && size < 1e-3 {
        return format!("{value:.1e}");
    }
    let before = if size >= 1.0 { size.log10().floor() as i32 + 1 } else { 0 };
    let behind = usize::try_from(digits - before).unwrap_or_default();
    let text = format!("{value:.behind$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_has_the_digits_that_count() {
        let shown =
            [0.0, 4.86, 1.0 / 3.0, 1234.6, 0.000_033, 12.0, f64::NAN].map(|it| number(it, 3));
        assert_eq!(shown, ["0", "4.86", "0.333", "1235", "3.3e-5", "12", "-"]);
    }

    #[test]
    fn a_table_fails_if_the_board_misses_a_limit_and_shows_it() {
        let mut table = Table::new(BoardChoice::default());
        table.begin("scene: of a test".to_owned());
        table.add((9.0, 1.0), "kept", "J", Limit::at_most(1.0));
        table.add((1.0, f64::NAN), "open", "", Limit::NONE);
        assert!(table.holds());
        for (board, limit) in [
            (1.1, Limit::at_most(1.0)),
            (0.9, Limit::at_least(1.0)),
            (3.0, Limit::within(1.0, 2.0)),
            (f64::NAN, Limit::at_most(1.0)),
        ] {
            table.add((1.5, board), "missed", "m", limit);
            assert!(!table.holds(), "{limit}");
            assert!(table.to_string().ends_with(&format!("{limit}: FAILS\n")), "{table}");
            if let Some((_, rows)) = table.scenes.last_mut() {
                rows.pop();
            }
        }
        assert!(table.to_string().contains("at most 1: ok"), "{table}");
    }
}
