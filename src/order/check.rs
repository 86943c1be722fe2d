//! Verifies a schedule: every collision once, and no moving body twice in a window.
//!
//! This module does not know how schedules are made.

use super::schedule::EMPTY;
use super::{IssueWindow, OrderError, OrderInput, Schedule};

/// Verifies schedules, keeping its memory from one to the next.
#[derive(Debug, Clone, Default)]
pub struct Checker {
    /// The first issue slot that may use each body again.
    free_from: Vec<usize>,
    seen: Vec<bool>,
}

impl Checker {
    /// Makes a checker that has allocated nothing yet.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Verifies that every collision is in the schedule exactly once, and that no moving body is
    /// used twice within the window. A collision without contact points may be left out, and uses
    /// no body.
    ///
    /// # Errors
    /// [`OrderError`]: the input cannot be ordered, or the first entry at which the schedule is
    /// wrong, or the first collision that it lacks.
    pub fn verify(
        &mut self,
        schedule: &Schedule,
        input: &OrderInput<'_>,
        window: IssueWindow,
    ) -> Result<(), OrderError> {
        input.check()?;
        let collisions = input.pairs.len();
        self.free_from.clear();
        self.free_from.resize(input.moving.len(), 0);
        self.seen.clear();
        self.seen.resize(collisions, false);
        let depth = window.depth() as usize;
        let per_issue = window.per_issue() as usize;
        let issues = schedule.entries.chunks(per_issue).enumerate();
        for (slot, issue) in issues {
            for (place, index) in issue.iter().copied().enumerate().filter(|(_, i)| *i != EMPTY) {
                let entry = slot * per_issue + place;
                let Some(pair) = input.pairs.get(index as usize) else {
                    return Err(OrderError::NoSuchCollision { entry, found: index, collisions });
                };
                if std::mem::replace(&mut self.seen[index as usize], true) {
                    return Err(OrderError::Repeated { collision: index, entry });
                }
                if !OrderInput::takes_part(*pair) {
                    continue;
                }
                for body in *pair {
                    let free_from = &mut self.free_from[body as usize];
                    if *free_from > slot {
                        let (earlier, depth) = (*free_from - depth, window.depth());
                        return Err(OrderError::Hazard { body, earlier, slot, depth });
                    }
                    let occupied = if input.moving[body as usize] { slot + depth } else { 0 };
                    *free_from = occupied;
                }
            }
        }
        let lacks = |(seen, pair): (&bool, &[u32; 2])| !*seen && OrderInput::takes_part(*pair);
        match self.seen.iter().zip(input.pairs).position(lacks) {
            Some(collision) => Err(OrderError::Missing { collision }),
            None => Ok(()),
        }
    }
}
