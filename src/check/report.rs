//! The report of a self-test: one line per test, in a fixed order.

use crate::board::BoardDescription;

/// The tests and their outcomes.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct CheckReport {
    /// The board under test.
    pub board: BoardDescription,
    /// All lines, always the same ones in the same order.
    pub lines: Vec<CheckLine>,
}

impl CheckReport {
    /// Whether no line failed.
    #[must_use]
    pub fn passed(&self) -> bool {
        !self.lines.iter().any(|line| matches!(line.outcome, Outcome::Failed { .. }))
    }
}

/// One test.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct CheckLine {
    /// Name of the test.
    pub name: &'static str,
    /// Outcome of the test.
    pub outcome: Outcome,
}

/// The outcome of a test.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum Outcome {
    /// The test passed.
    Ok {
        /// The state that was found.
        detail: String,
    },
    /// The test failed.
    Failed {
        /// The state that was found.
        found: String,
        /// The state that was expected.
        expected: String,
        /// The next step for the reader.
        next: String,
    },
    /// The test was not run.
    Skipped {
        /// The reason.
        reason: String,
    },
}

impl Outcome {
    pub(super) fn ok(detail: impl Into<String>) -> Self {
        Self::Ok { detail: detail.into() }
    }

    pub(super) fn failed(
        found: impl Into<String>,
        expected: impl Into<String>,
        next: impl Into<String>,
    ) -> Self {
        Self::Failed { found: found.into(), expected: expected.into(), next: next.into() }
    }

    pub(super) fn skipped(reason: impl Into<String>) -> Self {
        Self::Skipped { reason: reason.into() }
    }
}

/// The tests, in their order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Line {
    Identification,
    Version,
    Capabilities,
    Regions,
    Reset,
    Mode,
    Length,
    Echo,
    Sums,
    Coherency,
    Interrupt,
    Queue,
    Fence,
}

impl Line {
    const ALL: [Self; 13] = [
        Self::Identification,
        Self::Version,
        Self::Capabilities,
        Self::Regions,
        Self::Reset,
        Self::Mode,
        Self::Length,
        Self::Echo,
        Self::Sums,
        Self::Coherency,
        Self::Interrupt,
        Self::Queue,
        Self::Fence,
    ];

    const fn name(self) -> &'static str {
        match self {
            Self::Identification => "identification",
            Self::Version => "interface version",
            Self::Capabilities => "capabilities",
            Self::Regions => "register regions",
            Self::Reset => "reset",
            Self::Mode => "dma mode",
            Self::Length => "length register",
            Self::Echo => "echo",
            Self::Sums => "sums",
            Self::Coherency => "coherency",
            Self::Interrupt => "interrupt",
            Self::Queue => "issue queue",
            Self::Fence => "fence",
        }
    }
}

/// The lines so far.
#[derive(Debug, Default)]
pub(super) struct Lines {
    outcomes: [Option<Outcome>; Line::ALL.len()],
    /// The line after whose failure no test makes sense.
    stopped_at: Option<Line>,
}

impl Lines {
    /// Records the outcome of a line.
    pub(super) fn set(&mut self, line: Line, outcome: Outcome) {
        self.outcomes[line as usize] = Some(outcome);
    }

    pub(super) fn ok(&mut self, line: Line, detail: impl Into<String>) {
        self.set(line, Outcome::ok(detail));
    }

    /// Records a failure after which no other line makes sense.
    pub(super) fn stop(&mut self, line: Line, outcome: Outcome) {
        self.set(line, outcome);
        self.stopped_at = Some(line);
    }

    /// All lines; the lines without an outcome were skipped.
    pub(super) fn finish(self) -> Vec<CheckLine> {
        let reason = match self.stopped_at {
            Some(line) => format!("needs the line \"{}\"", line.name()),
            None => "not reached".to_owned(),
        };
        let lines = Line::ALL.into_iter().zip(self.outcomes);
        lines
            .map(|(line, outcome)| CheckLine {
                name: line.name(),
                outcome: outcome.unwrap_or_else(|| Outcome::skipped(reason.clone())),
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_has_no_outcome_was_skipped_for_what_failed() {
        let mut lines = Lines::default();
        lines.ok(Line::Identification, "fine");
        lines.stop(Line::Reset, Outcome::failed("a", "b", "c"));
        let lines = lines.finish();
        let names: Vec<_> = lines.iter().map(|line| line.name).collect();
        assert_eq!(names, Line::ALL.map(Line::name));
        assert!(Line::ALL.iter().enumerate().all(|(index, line)| *line as usize == index));
        assert_eq!(lines[10].outcome, Outcome::skipped("needs the line \"reset\""));
    }
}
