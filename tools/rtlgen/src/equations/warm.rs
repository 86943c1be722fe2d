//! The difference that a warm pass makes to a collision.
//!
//! ```text
//! u = the given impulse;  l = u - 0;  a point beyond the count, or with J = 0, has no impulse
//! ```
//!
//! The given impulse comes in as the accumulated one, which is 0 in a warm pass. So u is a third choice of
//! the last comparison, and nothing is taken from it.

use crate::graph::{Graph, Operand, Source};

/// Whether a pass can be a warm one, and whether impulses go out (FEATURES bit 8).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WarmStart {
    /// It can.
    Built,
    /// All passes solve their impulses, which stay on chip.
    LeftOut,
}

/// The switch between passes that solve their impulses and warm ones.
#[derive(Debug, Clone, Copy)]
pub(super) struct Warm {
    /// 1 in a pass that solves; a build without warm start reads no switch.
    solves: Option<Operand>,
}

impl Warm {
    pub(super) fn new(graph: &mut Graph, warm_start: WarmStart) -> Self {
        let solves = graph.input(Source::Switch, "solves");
        Self { solves: (warm_start == WarmStart::Built).then_some(solves) }
    }

    /// `max(a, b)`, or the given impulse in a warm pass.
    pub(super) fn maximum(
        self,
        graph: &mut Graph,
        [a, b]: [Operand; 2],
        given: Operand,
    ) -> Operand {
        match self.solves {
            Some(solves) => graph.maximum_or(solves, [a, b], given),
            None => graph.maximum(a, b),
        }
    }

    /// `min(a, b)`, or the given impulse in a warm pass.
    pub(super) fn minimum(
        self,
        graph: &mut Graph,
        [a, b]: [Operand; 2],
        given: Operand,
    ) -> Operand {
        match self.solves {
            Some(solves) => graph.minimum_or(solves, [a, b], given),
            None => graph.minimum(a, b),
        }
    }

    /// `after - before`, or `after` in a warm pass.
    pub(super) fn change(self, graph: &mut Graph, after: Operand, before: Operand) -> Operand {
        let before = self.solves.map_or(before, |solves| before.only_if(solves));
        graph.subtract(after, before)
    }

    /// Puts an impulse out. Impulses that leave the chip are 0 where a row does not act.
    pub(super) fn output(self, graph: &mut Graph, name: &str, impulse: Operand, acts: Operand) {
        let impulse = match self.solves {
            Some(_) => {
                let zero = graph.constant(0.0);
                graph.select(acts, impulse, zero)
            }
            None => impulse,
        };
        graph.output(name, &[impulse]);
    }

    /// The flag, or 0 in a warm pass.
    pub(super) fn unless_warm(self, graph: &mut Graph, flag: Operand) -> Operand {
        self.solves.map_or(flag, |solves| graph.both(flag, solves))
    }
}
